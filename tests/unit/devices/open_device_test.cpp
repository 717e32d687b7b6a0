#include "support/bodies.h"
#include "support/data.h"
#include "support/shells.h"

#include <relief/convert/convert.h>
#include <relief/core/query.h>
#include <relief/devices/open_device.h>
#include <relief/mesh/import.h>
#include <relief/mesh/samples.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

namespace relief {
namespace {

HandTarget still(double /*t*/) { return {}; }

TEST(OpenDevice, OpensEveryListedName) {
  ASSERT_GE(list_devices().size(), 5U);
  for (const DeviceListing& listing : list_devices()) {
    auto device = open_device(listing.name, still);
    ASSERT_TRUE(device) << listing.name;
    EXPECT_FALSE(listing.description.empty());
    DeviceState state;
    EXPECT_TRUE((*device)->read(state));
    EXPECT_TRUE((*device)->write({}));
    EXPECT_EQ((*device)->info().max_force, listing.info.max_force) << "as it is listed";
    EXPECT_EQ((*device)->info().workspace_radius, listing.info.workspace_radius);
    EXPECT_EQ(listing.evidence, Evidence::Simulated);
    EXPECT_EQ((*device)->status().to_do, "");
  }
  EXPECT_EQ((*open_device("sim:hand", still))->info().max_force, 3.3);
  EXPECT_EQ((*open_device("sim:hand:premium-like", still))->info().max_force, 8.5);
}

TEST(OpenDevice, AnUnknownNameGetsTheKnownOnes) {
  for (const char* name : {"", "sim", "sim:hand:", "sim:hand:omega", "mouse\n"}) {
    const auto device = open_device(name, still);
    ASSERT_FALSE(device) << name;
    EXPECT_EQ(device.error().code, Errc::NotFound);
    EXPECT_NE(device.error().message.find("sim:hand:falcon-like"), std::string::npos);
    EXPECT_EQ(device.error().message.find('\n'), std::string::npos);
    EXPECT_LT(device.error().message.size(), 500U);
  }
}

TEST(ReplayDevice, PlaysEachReadingOnceAndHasThenEnded) {
  std::vector<DeviceState> path(3);
  for (std::size_t k = 0; k < path.size(); ++k) {
    path[k].t = 0.5 * static_cast<double>(k);
    path[k].position = {static_cast<double>(k), 2, 3};
  }
  ReplayDevice device(DeviceInfo{}, path);
  DeviceState state;
  for (const DeviceState& expected : path) {
    EXPECT_FALSE(device.ended());
    ASSERT_TRUE(device.read(state));
    EXPECT_EQ(state.t, expected.t);
    EXPECT_EQ(state.position, expected.position);
    EXPECT_TRUE(device.write({.force = {1, 2, 3}, .torque = {}}));
  }
  EXPECT_FALSE(device.read(state));
  EXPECT_TRUE(device.ended());
  EXPECT_FALSE(device.read(state));
  EXPECT_TRUE(device.status().connected);
  EXPECT_FALSE(device.status().forces_on);
}

SnapshotPtr sample_model(std::string_view name) {
  const auto mesh = make_sample(name, 20'000);
  EXPECT_TRUE(mesh);
  const auto made = convert(*mesh, {.slabs = 200, .intervals = 16});
  EXPECT_TRUE(made) << made.error().message;
  return made->model.head;
}

TEST(ExploringHand, StartsOutsidePressesInAndMovesSmoothly) {
  const SnapshotPtr model = sample_model("head");
  const Box3d box = bounds_of_surface(*model);
  const Workspace space = fit_workspace(DeviceInfo{}, box);
  const HandScript script = exploring_hand(*model, space);
  LocateHint hint;
  const auto inside_at = [&](double t) { return inside(*model, space.to_model(script(t).position), hint); };
  EXPECT_FALSE(inside_at(0));
  Vec3d last = script(0).position;
  int presses = 0;
  bool in = false;
  double deepest = 0;
  Box3d seen;
  for (int k = 1; k <= 30'000; ++k) {
    const Vec3d now = script(1e-3 * k).position;
    ASSERT_LT(length(now - last), 0.8e-3) << "under 0.8 m/s, t = " << 1e-3 * k;
    if (const bool pressed = inside_at(1e-3 * k); pressed != in) {
      in = pressed;
      presses += in ? 1 : 0;
    }
    if (in) seen.add(space.to_model(now));
    if (const Vec3d at = space.to_model(now); in && k % 50 == 0)
      deepest = std::max(deepest, length(closest_point(*model, at).position - at));
    last = now;
  }
  EXPECT_GE(presses, 15);
  EXPECT_GT(diagonal(seen), 0.5 * diagonal(box)) << "all sides";
  EXPECT_NEAR(deepest, 0.08 * diagonal(box), 0.03 * diagonal(box)) << "as deep as a hand of 1.5 N presses, and more";
}

/// Returns the snapshot of a polygon made a solid along z.
SnapshotPtr solid_of(const std::vector<Vec3d>& polygon, double half_length) {
  const auto made = convert(testing::extruded(polygon, half_length), {.slabs = 200, .intervals = 8});
  EXPECT_TRUE(made) << made.error().message;
  return made->model.head;
}

/// Where the exploring hand wants the tool in each of its visits, in the model's space.
class Visits {
 public:
  explicit Visits(const Snapshot& model)
      : space_(fit_workspace(DeviceInfo{}, bounds_of_surface(model))), script_(exploring_hand(model, space_)) {}
  static constexpr int kCount = 13;
  [[nodiscard]] Vec3d above(int visit) const { return at(visit, 0.2); }
  [[nodiscard]] Vec3d pressed(int visit) const { return at(visit, 1.2); }
  /// At the far end of its stroke.
  [[nodiscard]] Vec3d stroked(int visit) const { return at(visit, 0.8); }

 private:
  [[nodiscard]] Vec3d at(int visit, double t) const { return space_.to_model(script_(2 * visit + t).position); }

  Workspace space_;
  HandScript script_;
};

/// A wedge whose edge is sharp and whose back is thick: wherever the hand comes from, it presses where the wedge is
/// thicker than it goes deep.
TEST(ExploringHand, PressesWhereItDoesNotGoThrough) {
  const SnapshotPtr wedge = solid_of({{-0.5, -0.002, 0}, {0.5, -0.1, 0}, {0.5, 0.1, 0}, {-0.5, 0.002, 0}}, 0.5);
  const Visits visits(*wedge);
  for (int visit = 0; visit < Visits::kCount; ++visit) {
    const Vec3d above = visits.above(visit), target = visits.pressed(visit);
    LocateHint hint;
    double inside_for = 0;
    constexpr int kSteps = 4000;
    for (int k = 0; k <= kSteps; ++k) {
      const bool in = inside(*wedge, above + (target - above) * (double(k) / kSteps), hint);
      if (!in && inside_for > 0) break;
      if (in) inside_for += length(target - above) / kSteps;
    }
    EXPECT_GE(inside_for, 0.025 * diagonal(bounds_of_surface(*wedge)))
        << "how deep a hand of 1.5 N goes, visit " << visit;
  }
}

/// A bar that lies across the hand's axes, narrower than the hand strokes far: strokes go along it.
TEST(ExploringHand, StrokesWhereTheSurfaceGoesOn) {
  const double turn = 0.8;  // rad
  const auto at = [&](double x, double y) {
    return Vec3d{x * std::cos(turn) - y * std::sin(turn), x * std::sin(turn) + y * std::cos(turn), 0};
  };
  const SnapshotPtr bar = solid_of({at(-0.5, -0.05), at(0.5, -0.05), at(0.5, 0.05), at(-0.5, 0.05)}, 0.05);
  const Visits visits(*bar);
  for (int visit = 0; visit < Visits::kCount; ++visit) {
    const Vec3d above = visits.above(visit), in = visits.pressed(visit);
    EXPECT_TRUE(raycast(*bar, {above + visits.stroked(visit) - in, normalized(in - above)})) << visit;
  }
}

/// A sample model, or a scan.
class ExploringHandOn : public ::testing::TestWithParam<std::string_view> {};

/// The first tick with a force comes within a second, and of 13 places so many are felt: at a rim the hand may slip
/// off.
void expect_found_soon(const Snapshot& model, const PlantPreset& preset, int places, Quatd rotation = {}) {
  const Workspace space = fit_workspace(preset.info, bounds_of_surface(model), 0, rotation);
  SimulatedHand hand(preset, {}, exploring_hand(model, space));
  Servo servo({.workspace = space}, preset.info);
  int first = -1, visits = 0, touched = 0;
  for (int k = 0; k < 26'000; ++k) {
    DeviceState state;
    static_cast<void>(hand.read(state));
    const ServoSample felt = servo.step(model, state);
    static_cast<void>(hand.write({felt.force, felt.torque}));
    if (length(felt.force) > 0.1) {
      if (first < 0) first = k;
      ++touched;
    }
    if (k % 2000 != 1999) continue;
    visits += touched > 300 ? 1 : 0;
    touched = 0;
  }
  EXPECT_GE(first, 0) << preset.name;
  EXPECT_LT(first, 1000) << preset.name;
  EXPECT_GE(visits, places) << preset.name;
}

TEST_P(ExploringHandOn, FindsTheSurfaceWithinASecond) {
  const SnapshotPtr model = sample_model(GetParam());
  ASSERT_TRUE(model);
  for (const PlantPreset& preset : plant_presets()) expect_found_soon(*model, preset, 12);
}

TEST_P(ExploringHandOn, FindsAModelThatIsOpenOnTop) {
  const SnapshotPtr model = sample_model(GetParam());
  ASSERT_TRUE(model);
  const Box3d box = bounds_of_surface(*model);
  const double rim = box.low.y + 0.7 * box.extent().y;
  const SnapshotPtr open = testing::with_hole(model, [=](Vec3d p) { return p.y > rim; });
  for (const PlantPreset& preset : plant_presets()) expect_found_soon(*open, preset, 10);
}

TEST_P(ExploringHandOn, FindsWhatIsLeftBetweenHoles) {
  const SnapshotPtr model = sample_model(GetParam());
  ASSERT_TRUE(model);
  const double wave = 12 * std::numbers::pi / diagonal(bounds_of_surface(*model));
  const SnapshotPtr sieve = testing::with_hole(
      model, [=](Vec3d p) { return std::sin(wave * p.x) * std::sin(wave * p.y) * std::sin(wave * p.z) > 0.2; });
  for (const PlantPreset& preset : plant_presets()) expect_found_soon(*sieve, preset, 7);
}

TEST_P(ExploringHandOn, FindsAModelThatIsTurned) {
  const SnapshotPtr model = sample_model(GetParam());
  ASSERT_TRUE(model);
  for (const Quatd turn : {Quatd{0.5, 0.5, 0.5, 0.5}, Quatd{std::cos(0.4), 0, 0, std::sin(0.4)}})
    expect_found_soon(*model, plant_presets().front(), 12, turn);
}
INSTANTIATE_TEST_SUITE_P(Samples, ExploringHandOn, ::testing::ValuesIn(sample_names()),
                         [](const auto& test) { return std::string(test.param); });

/// Where all is hole the hand moves and meets nothing.
TEST(ExploringHand, OfAllHoleMovesOn) {
  const SnapshotPtr model = sample_model("torus");
  ASSERT_TRUE(model);
  const SnapshotPtr nothing = testing::with_hole(model, [](Vec3d) { return true; });
  const HandScript script = exploring_hand(*nothing, fit_workspace(DeviceInfo{}, bounds_of_surface(*model)));
  Box3d seen;
  for (int k = 0; k < 26'000; k += 10) {
    const Vec3d at = script(1e-3 * k).position;
    ASSERT_TRUE(is_finite(at)) << k;
    seen.add(at);
  }
  EXPECT_GT(diagonal(seen), 0.1) << "m";
}

/// Scans with thin parts, rims and holes; of some the first place to go to lies beside the surface, or behind it.
class ExploringHandOnScan : public ::testing::TestWithParam<std::string_view> {};

TEST_P(ExploringHandOnScan, FindsTheSurfaceWithinASecond) {
  RELIEF_DATA_FILE(file, "a_models/" + std::string(GetParam()) + ".ply");
  const auto mesh = import_mesh(file);
  ASSERT_TRUE(mesh) << mesh.error().message;
  const auto made = convert(*mesh, {.slabs = 200, .intervals = 16});
  ASSERT_TRUE(made) << made.error().message;
  for (const PlantPreset& preset : plant_presets()) expect_found_soon(*made->model.head, preset, 9);
}
INSTANTIATE_TEST_SUITE_P(Scans, ExploringHandOnScan,
                         ::testing::Values("bunny", "human_nose_scan", "max_planck_face", "scallop_scan",
                                           "tower_holes"),
                         [](const auto& test) { return std::string(test.param); });

}  // namespace
}  // namespace relief
