// Contact that holds: presses deeper than the part is thick, over rims and through thin walls, on converted models.
#include "support/data.h"
#include "support/shells.h"

#include <relief/convert/convert.h>
#include <relief/haptics/servo.h>
#include <relief/mesh/import.h>
#include <relief/mesh/samples.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

namespace relief {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr int kPresses = 10;
constexpr bool kShares = false;  // too few for a share of the ticks
#else
constexpr int kPresses = 60;
constexpr bool kShares = true;
#endif
constexpr int kTicks = 2500;  // per press

SnapshotPtr converted(const std::string& name) {
  const auto mesh = make_sample(name, 30'000);
  EXPECT_TRUE(mesh);
  if (!mesh) return nullptr;
  const auto made = convert(*mesh, {.slabs = 200, .intervals = 32});
  EXPECT_TRUE(made) << made.error().message;
  return made ? made->model.head : nullptr;
}

/// The diagonal is 0.15 m.
Workspace space_of(const Snapshot& model) {
  const Box3d& box = model.slab_mesh().bounds();
  return {.metres_per_unit = 0.15 / diagonal(box), .device_origin = {}, .model_origin = box.centre()};
}

/// Of a press in its tick k, of the diagonal: in from 1 % above, and then to and fro between 0.2 and 4 %.
double depth_at(int k) { return k < 100 ? -0.01 + 1.2e-4 * k : 0.021 - 0.019 * std::cos(4.1 * (k * 1e-3 - 0.1)); }

/// A place of the surface, how thick the model is below it, and whether there is room above it to come from.
struct Place {
  SurfacePoint at;
  double thickness = 0;
  bool open = false;
};
Place any_place(const Snapshot& model, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  const double size = diagonal(model.slab_mesh().bounds());
  const auto slab = static_cast<SlabId>(unit(random) * model.slab_mesh().slab_count());
  double u = unit(random), v = unit(random);
  if (u + v > 1) {
    u = 1 - u;
    v = 1 - v;
  }
  const SurfacePoint p = surface_point(model, slab, u, v);
  const auto above = raycast(model, {p.position + p.normal * (1e-4 * size), p.normal});
  if (above && above->distance < 0.02 * size) return {.at = p};
  const auto back = raycast(model, {p.position - p.normal * (1e-4 * size), -p.normal});
  return {.at = p, .thickness = back ? back->distance : size, .open = true};
}

/// A sample, and whether with exact normals.
class Hold : public ::testing::TestWithParam<std::tuple<const char*, bool>> {};

/// Whether the surface around p, out to `reach`, faces the same way: no rim is near.
bool wide(const Snapshot& model, const SurfacePoint& p, Vec3d side, Vec3d other, double reach) {
  for (int k = 0; k < 8; ++k) {
    const Vec3d way = side * std::cos(0.785398 * k) + other * std::sin(0.785398 * k);
    const auto hit = raycast(model, {p.position + way * reach + p.normal * reach, -p.normal});
    if (!hit || hit->distance > 2 * reach || dot(hit->point.normal, p.normal) < 0.7) return false;
  }
  return true;
}

/// Presses at many places, half of them where the part is thinner than 3 % of the diagonal: straight in and then
/// swinging between 0.2 and 4 % of the diagonal, while the hand strays by up to 0.5 % sideways. The right answer is
/// always the face that was pressed.
TEST_P(Hold, NeverLetsGoOfThePressedFace) {
  const auto [sample, exact] = GetParam();
  const SnapshotPtr model = converted(sample);
  ASSERT_TRUE(model);
  const SlabMesh& mesh = model->slab_mesh();
  const double size = diagonal(mesh.bounds());
  const Workspace space = space_of(*model);
  std::mt19937 random(8);
  std::uniform_real_distribution<double> unit(0, 1);
  long pressed = 0, lost = 0, wrong = 0, thin = 0, rim_pressed = 0, rim_bad = 0, flips = 0;
  for (int press = 0; press < kPresses; ++press) {
    SurfacePoint p;
    double thickness = 0;
    for (int attempt = 0; attempt < 30; ++attempt) {
      const Place place = any_place(*model, random);
      p = place.at;
      if (!place.open) continue;
      thickness = place.thickness;
      if (press % 2 == 1 || thickness < 0.03 * size) break;
    }
    const Vec3d side = normalized(cross(p.normal, std::abs(p.normal.x) < 0.7 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0}));
    const Vec3d other = cross(p.normal, side);
    const bool rim = !wide(*model, p, side, other, 0.03 * size);
    thin += thickness < 0.03 * size && !rim ? 1 : 0;
    const ForceSettings law = {.stiffness = 400, .damping = 0, .exact_normals = exact, .guard = false};
    Servo servo({.workspace = space, .force = law}, DeviceInfo{});
    const double phase = 6.28 * unit(random), wander = 0.005 * size * unit(random);
    Vec3d last;
    for (int k = 0; k < kTicks; ++k) {
      const double t = k * 1e-3;
      const double depth = depth_at(k);
      const double fade = std::min(1.0, k / 300.0);
      const Vec3d cursor = p.position - p.normal * (depth * size) +
                           (side * std::sin(7 * t + phase) + other * std::cos(5 * t + 2 * phase)) * (wander * fade);
      const ServoSample felt = servo.step(*model, {.t = t, .position = space.to_device(cursor), .velocity = {}});
      flips += length(felt.force) > 0.2 && length(last) > 0.2 && dot(felt.force, last) < 0 ? 1 : 0;
      last = felt.force;
      if (k < 150) continue;
      const bool bad = !felt.contact || dot(felt.force, p.normal) <= 0;
      if (rim) {
        ++rim_pressed;
        rim_bad += bad ? 1 : 0;
      } else {
        ++pressed;
        lost += felt.contact ? 0 : 1;
        wrong += felt.contact && bad ? 1 : 0;
      }
    }
  }
  std::printf(
      "%s%s: %ld pressed ticks, %ld thin places: %ld without contact, %ld towards the wrong side, %ld flips; slipped "
      "off the rim in %ld of %ld\n",
      sample, exact ? ", exact normals" : "", pressed, thin, lost, wrong, flips, rim_bad, rim_pressed);
  EXPECT_GT(pressed, 0);
  EXPECT_EQ(lost, 0);
  EXPECT_EQ(wrong, 0);
  EXPECT_EQ(flips, 0);
  // Near a rim the point may slip off it, with the hand; whether its way there is legal, legal_contact_test.cpp judges.
  // It is to be as seldom as it is: never here; it was 3 % of the ticks.
  EXPECT_GT(rim_pressed, 0);
  if (kShares) {
    EXPECT_LE(double(rim_bad), 0.001 * double(rim_pressed));
  }
}

INSTANTIATE_TEST_SUITE_P(Samples, Hold,
                         ::testing::Combine(::testing::Values("bowl", "pumpkin", "head"), ::testing::Bool()),
                         [](const auto& test) {
                           return std::string(std::get<0>(test.param)) + (std::get<1>(test.param) ? "_exact" : "");
                         });

/// Of the data set, and how many of the ticks may be without a force outwards. Measured here: 0 and 0.023 % (bunny),
/// 0.03 and 0 % (visible_human_skin), none (elephant_refined); at 1,200 other places up to 0.012 and 0.016, 0.019 and
/// 0.20, 0.004 and 0 %, and a change of the conversion is one of places.
struct Scan {
  const char* name;
  double most, most_exact;
};

constexpr std::uint32_t kSeed = 8;        // of the places that the bounds of a Scan are for
constexpr double kMostElsewhere = 0.003;  // share of the ticks, at others

/// Thinner than 3 % of the diagonal.
std::optional<SurfacePoint> thin_place(const Snapshot& model, std::mt19937& random) {
  for (int attempt = 0; attempt < 100'000; ++attempt) {
    const Place place = any_place(model, random);
    if (place.open && place.thickness < 0.03 * diagonal(model.slab_mesh().bounds())) return place.at;
  }
  return {};
}

/// Share of the ticks of straight presses of up to 4 % of the diagonal, where the model is thinner than 3 %, in which
/// no force pushes outwards.
double share_without_a_force_outwards(const Snapshot& model, std::uint32_t seed, bool exact) {
  std::mt19937 random(seed);
  const double size = diagonal(model.slab_mesh().bounds());
  const Workspace space = space_of(model);
  long ticks = 0, bad = 0;
  for (int press = 0; press < 5 * kPresses; ++press) {
    const auto place = thin_place(model, random);
    if (!place) throw std::runtime_error("no thin place");
    Servo servo({.workspace = space, .force = {.stiffness = 400, .damping = 0, .exact_normals = exact, .guard = false}},
                DeviceInfo{});
    for (int k = 0; k < kTicks; ++k) {
      const double depth = depth_at(k);
      const ServoSample felt =
          servo.step(model, {.t = k * 1e-3,
                             .position = space.to_device(place->position - place->normal * (depth * size)),
                             .velocity = {}});
      if (k < 150) continue;
      ++ticks;
      bad += !felt.contact || dot(felt.force, place->normal) <= 0 ? 1 : 0;
    }
  }
  return double(bad) / double(ticks);
}

class HoldOnScans : public ::testing::TestWithParam<Scan> {};

/// Nearly all of the places are beside a rim. The long form presses at four more sets of them.
TEST_P(HoldOnScans, IsSeldomWithoutAForceOutwards) {
  const Scan scan = GetParam();
  RELIEF_DATA_FILE(file, std::string("a_models/") + scan.name + ".ply");
  const auto mesh = import_mesh(file);
  ASSERT_TRUE(mesh) << mesh.error().message;
  const auto made = convert(*mesh, {});
  ASSERT_TRUE(made) << made.error().message;
  std::vector<std::uint32_t> seeds = {kSeed};
  if (std::getenv("RELIEF_SOAK") != nullptr) seeds.insert(seeds.end(), {9, 10, 11, 12});
  for (const std::uint32_t seed : seeds)
    for (const bool exact : {false, true}) {
      const double share = share_without_a_force_outwards(*made->model.head, seed, exact);
      std::printf("%s%s, places %u: without a force outwards in %.3f %% of the ticks\n", scan.name,
                  exact ? ", exact normals" : "", seed, 100 * share);
      if (!kShares) continue;
      const double most = exact ? scan.most_exact : scan.most;
      EXPECT_LE(share, seed == kSeed ? most : std::max(most, kMostElsewhere)) << (exact ? "exact normals" : "");
    }
}

INSTANTIATE_TEST_SUITE_P(Scans, HoldOnScans,
                         ::testing::Values(Scan{"bunny", 0.0005, 0.001}, Scan{"visible_human_skin", 0.0015, 0.004},
                                           Scan{"elephant_refined", 0.0003, 0.0005}),
                         [](const auto& test) { return std::string(test.param.name); });

TEST(FastCursor, DoesNotTunnelThroughTheBowl) {
  const SnapshotPtr model = converted("bowl");
  ASSERT_TRUE(model);
  const SlabMesh& mesh = model->slab_mesh();
  const double size = diagonal(mesh.bounds());
  const Workspace space = space_of(*model);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1, 1);
  int shots = 0, missed = 0, through_wall = 0;
  for (int shot = 0; shot < 1000; ++shot) {
    const Vec3d from =
        mesh.bounds().centre() + normalized(Vec3d{unit(random), unit(random), unit(random)}) * (0.7 * size);
    const Vec3d to = mesh.bounds().centre() + Vec3d{unit(random), unit(random), unit(random)} * (0.25 * size);
    const Vec3d way = normalized(to - from);
    const auto hit = raycast(*model, {from, way});
    if (!hit || dot(hit->point.normal, way) > -0.5) continue;  // grazing ways lead out round the rim
    ++shots;
    for (const double speed : {0.5, 2.0}) {  // m/s
      Servo servo({.workspace = space, .force = {.guard = false}}, DeviceInfo{});
      const double step = speed * 1e-3 / space.metres_per_unit;
      ServoSample felt;
      double along = hit->distance - 10 * step + unit(random) * step;
      if (along < 0) continue;
      int k = 0;
      for (; along < hit->distance + 2 * step; along += step, ++k)
        felt = servo.step(*model, {.t = k * 1e-3, .position = space.to_device(from + way * along), .velocity = {}});
      missed += felt.contact ? 0 : 1;
      through_wall += felt.contact && felt.contact_point != felt.cursor && dot(felt.normal, way) > 0.5 ? 1 : 0;
    }
  }
  EXPECT_GT(shots, 300);
  EXPECT_EQ(missed, 0);
  EXPECT_EQ(through_wall, 0);
}

}  // namespace
}  // namespace relief
