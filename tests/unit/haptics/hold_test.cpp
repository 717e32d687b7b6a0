// Contact that holds: presses deeper than the part is thick, over rims and through thin walls, on converted models.
#include "support/data.h"
#include "support/exported.h"
#include "support/god_object.h"

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
#include <utility>
#include <vector>

namespace relief {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr int kPresses = 30;
constexpr bool kShares = false;  // too few for a share of the ticks
#else
constexpr int kPresses = 300;
constexpr bool kShares = true;
#endif
constexpr int kTicks = 2500;  // per press

/// Of the places: the long form presses at four more sets of them.
std::vector<std::uint32_t> seeds() {
  std::vector<std::uint32_t> all = {8};
  if (std::getenv("RELIEF_SOAK") != nullptr) all.insert(all.end(), {9, 10, 11, 12});
  return all;
}

/// A model and what it was made of.
struct Made {
  TriangleMesh source;
  SnapshotPtr model;
};
Made made_of(Result<TriangleMesh> source, const ConvertSettings& options) {
  if (!source) throw std::runtime_error(source.error().message);
  auto made = convert(*source, options);
  if (!made) throw std::runtime_error(made.error().message);
  return {std::move(*source), made->model.head};
}
Made converted(const std::string& sample) {
  return made_of(make_sample(sample, 30'000), {.slabs = 200, .intervals = 32});
}

/// The diagonal is 0.15 m.
Workspace space_of(const Snapshot& model) {
  const Box3d box = bounds_of_surface(model);
  return {.metres_per_unit = 0.15 / diagonal(box), .device_origin = {}, .model_origin = box.centre()};
}

/// Of a press in its tick k, of the diagonal: in from 1 % above, and then to and fro between 0.2 and 4 %.
double depth_at(int k) { return k < 100 ? -0.01 + 1.2e-4 * k : 0.021 - 0.019 * std::cos(4.1 * (k * 1e-3 - 0.1)); }

/// A place of the surface and how thick the model is below it.
struct Place {
  SurfacePoint at;
  double thickness = 0;
};

/// Places of a model that have room above them to come from: chosen on its source, by area, so that they hardly move
/// when the same surface becomes other slabs. Where the source is farther than 0.5 % of the diagonal from the model, as
/// in its openings, there are none.
class Places {
 public:
  Places(const Made& made, std::uint32_t seed)
      : source_(made.source), model_(*made.model), size_(diagonal(bounds_of_surface(model_))), random_(seed) {
    std::vector<double> areas;
    for (const Triangle& t : source_.triangles) areas.push_back(length(twice_area(t)));
    triangle_ = std::discrete_distribution<std::size_t>(areas.begin(), areas.end());
  }

  Place next() {
    for (int attempt = 0; attempt < 100'000; ++attempt)
      if (const auto place = below(source_.triangles[triangle_(random_)])) return *place;
    throw std::runtime_error("no place of the source has room above it");
  }
  /// Thinner than 3 % of the diagonal.
  std::optional<Place> next_thin(int attempts) {
    for (int attempt = 0; attempt < attempts; ++attempt)
      if (const Place place = next(); place.thickness < 0.03 * size_) return place;
    return {};
  }

 private:
  [[nodiscard]] Vec3d twice_area(const Triangle& t) const {
    const Vec3d a = source_.positions[t[0]];
    return cross(source_.positions[t[1]] - a, source_.positions[t[2]] - a);
  }
  std::optional<Place> below(const Triangle& t) {
    std::uniform_real_distribution<double> unit(0, 1);
    double u = unit(random_), v = unit(random_);
    if (u + v > 1) {
      u = 1 - u;
      v = 1 - v;
    }
    const Vec3d a = source_.positions[t[0]], out = normalized(twice_area(t));
    const Vec3d p = a + (source_.positions[t[1]] - a) * u + (source_.positions[t[2]] - a) * v;
    const auto hit = raycast(model_, {p + out * (0.005 * size_), -out});
    if (!hit || hit->distance > 0.01 * size_) return {};
    const SurfacePoint at = hit->point;
    const auto above = raycast(model_, {at.position + at.normal * (1e-4 * size_), at.normal});
    if (above && above->distance < 0.02 * size_) return {};
    const auto back = raycast(model_, {at.position - at.normal * (1e-4 * size_), -at.normal});
    return Place{at, back ? back->distance : size_};
  }

  const TriangleMesh& source_;
  const Snapshot& model_;
  double size_;
  std::mt19937 random_;
  std::discrete_distribution<std::size_t> triangle_;
};

/// A sample, and whether with exact normals.
class Hold : public ::testing::TestWithParam<std::tuple<const char*, bool>> {};

/// Two ways across a unit vector, square to each other.
std::pair<Vec3d, Vec3d> across(Vec3d normal) {
  const Vec3d side = normalized(cross(normal, std::abs(normal.x) < 0.7 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0}));
  return {side, cross(normal, side)};
}

/// Whether the surface around p, out to `reach`, faces the same way: no rim is near.
bool wide(const Snapshot& model, const SurfacePoint& p, double reach) {
  const auto [side, other] = across(p.normal);
  for (int k = 0; k < 8; ++k) {
    const Vec3d way = side * std::cos(0.785398 * k) + other * std::sin(0.785398 * k);
    const auto hit = raycast(model, {p.position + way * reach + p.normal * reach, -p.normal});
    if (!hit || hit->distance > 2 * reach || dot(hit->point.normal, p.normal) < 0.7) return false;
  }
  return true;
}

/// Whether a plain god-object on the bare triangles, pressed straight in, leaves the face while the cursor is on its
/// side of the part: the way from the contact point through the cursor, as far again, does not come out of the solid.
/// Lobes and rims are like that. Off such a face a contact rolls before there is another side to be kept from.
bool rolls_off(const testing::BareTriangles& bare, const Place& place, double size) {
  testing::GodObject oracle(bare, 1);
  bool past_the_middle = false;
  for (double depth = -0.01 * size; depth <= 0.04 * size; depth += 2e-5 * size) {
    const Vec3d cursor = place.at.position - place.at.normal * depth;
    const testing::OracleTick felt = oracle.move(cursor);
    if (depth < 1e-4 * size) continue;
    if (!(felt.held && dot(felt.point - cursor, place.at.normal) > 0.5 * felt.depth)) return !past_the_middle;
    past_the_middle = bare.past_the_middle(felt.point, cursor);
  }
  return false;
}

/// Ticks of presses, and those of them in which the face that was pressed did not push outwards.
struct Pressed {
  long ticks = 0;
  long lost = 0, wrong = 0;  ///< without contact; with a force that is not outwards
  long flips = 0;            ///< from one tick to the next the force turns round
  double step = 0;           ///< N, at most, from one tick to the next while it touches
  [[nodiscard]] double share() const { return double(lost + wrong) / double(ticks); }
};

/// How the hand strays sideways while it presses, by up to `most` along each of two ways.
struct Straying {
  double phase = 0, most = 0;
};

/// Presses at p: straight in and then swinging between 0.2 and 4 % of the diagonal.
void press(const Snapshot& model, const SurfacePoint& p, bool exact, const Straying& straying, Pressed& done) {
  const double size = diagonal(bounds_of_surface(model));
  const Workspace space = space_of(model);
  const auto [side, other] = across(p.normal);
  const ForceSettings law = {.stiffness = 400, .damping = 0, .exact_normals = exact, .guard = false};
  Servo servo({.workspace = space, .force = law}, DeviceInfo{});
  Vec3d last;
  for (int k = 0; k < kTicks; ++k) {
    const double t = k * 1e-3, aside = straying.most * std::min(1.0, k / 300.0);
    const Vec3d cursor = p.position - p.normal * (depth_at(k) * size) +
                         side * (aside * std::sin(7 * t + straying.phase)) +
                         other * (aside * std::cos(5 * t + 2 * straying.phase));
    const ServoSample felt = servo.step(model, {.t = t, .position = space.to_device(cursor), .velocity = {}});
    done.flips += length(felt.force) > 0.2 && length(last) > 0.2 && dot(felt.force, last) < 0 ? 1 : 0;
    if (k >= 150 && felt.contact) done.step = std::max(done.step, length(felt.force - last));
    last = felt.force;
    if (k < 150) continue;
    ++done.ticks;
    done.lost += felt.contact ? 0 : 1;
    done.wrong += felt.contact && dot(felt.force, p.normal) <= 0 ? 1 : 0;
  }
}

/// Presses at many places, half of them where the part is thinner than 3 % of the diagonal, while the hand strays by
/// up to 0.5 % each way sideways. The right answer is always the face that was pressed, but where a plain god-object
/// rolls off it, too. Beside a rim the point may slip off with the hand (whether its way there is legal,
/// legal_contact_test.cpp judges): there the hand also presses straight.
TEST_P(Hold, NeverLetsGoOfThePressedFace) {
  const auto [sample, exact] = GetParam();
  const Made made = converted(sample);
  const Snapshot& model = *made.model;
  const testing::BareTriangles bare = testing::bare_triangles(model);
  const double size = diagonal(bounds_of_surface(model));
  for (const std::uint32_t seed : seeds()) {
    Places places(made, seed);
    std::mt19937 random(seed + 100);
    std::uniform_real_distribution<double> unit(0, 1);
    Pressed away, straight, with_the_hand, rolled;
    long thin = 0;
    int rims = 0, rolling = 0;
    for (int k = 0; k < kPresses; ++k) {
      const std::optional<Place> found = k % 2 == 0 ? places.next_thin(100) : std::nullopt;
      const Place place = found ? *found : places.next();
      const bool rim = !wide(model, place.at, 0.03 * size);
      thin += place.thickness < 0.03 * size && !rim ? 1 : 0;
      const Straying straying = {6.28 * unit(random), 0.005 * size * unit(random)};
      rims += rim ? 1 : 0;
      if (rim && rolls_off(bare, place, size)) {
        ++rolling;
        press(model, place.at, exact, {}, rolled);
        continue;
      }
      press(model, place.at, exact, straying, rim ? with_the_hand : away);
      if (rim) press(model, place.at, exact, {}, straight);
    }
    // What rolls off goes round step by step, too.
    const long flips = away.flips + straight.flips + with_the_hand.flips + rolled.flips;
    std::printf(
        "%s%s, places %u: %ld pressed ticks, %ld thin places: %ld without contact, %ld towards the wrong side, %ld "
        "flips; of %d presses beside a rim a god-object rolls off in %d, and the tool in %.0f %% of their ticks; "
        "slipped off with the hand in %.2f %% of %ld, pressed straight in %ld of %ld\n",
        sample, exact ? ", exact normals" : "", seed, away.ticks, thin, away.lost, away.wrong, flips, rims, rolling,
        100 * rolled.share(), 100 * with_the_hand.share(), with_the_hand.ticks, straight.lost + straight.wrong,
        straight.ticks);
    EXPECT_GT(away.ticks, 0);
    EXPECT_EQ(away.lost, 0);
    EXPECT_EQ(away.wrong, 0);
    EXPECT_EQ(flips, 0);
    EXPECT_GT(straight.ticks, 0);
    EXPECT_EQ(straight.lost + straight.wrong, 0);
    if (!kShares) continue;
    EXPECT_LE(rolling, 0.08 * rims);
    EXPECT_LE(with_the_hand.share(), 0.035);
  }
}

INSTANTIATE_TEST_SUITE_P(Samples, Hold,
                         ::testing::Combine(::testing::Values("bowl", "pumpkin", "head"), ::testing::Bool()),
                         [](const auto& test) {
                           return std::string(std::get<0>(test.param)) + (std::get<1>(test.param) ? "_exact" : "");
                         });

/// Of the data set.
class HoldOnScans : public ::testing::TestWithParam<const char*> {};

/// Straight presses where the model is thinner than 3 % of the diagonal: mostly beside a rim.
TEST_P(HoldOnScans, PushesOutwardsWhereverAGodObjectDoesNotRollOff) {
  RELIEF_DATA_FILE(file, std::string("a_models/") + GetParam() + ".ply");
  const Made made = made_of(import_mesh(file), {});
  const testing::BareTriangles bare = testing::bare_triangles(*made.model);
  const double size = diagonal(bounds_of_surface(*made.model));
  for (const std::uint32_t seed : seeds()) {
    Places places(made, seed);
    Pressed done, done_exact, rolled;
    int rolling = 0;
    for (int k = 0; k < kPresses; ++k) {
      const auto place = places.next_thin(100'000);
      ASSERT_TRUE(place) << "no thin place";
      if (rolls_off(bare, *place, size)) {
        ++rolling;
        press(*made.model, place->at, false, {}, rolled);
        press(*made.model, place->at, true, {}, rolled);
        continue;
      }
      press(*made.model, place->at, false, {}, done);
      press(*made.model, place->at, true, {}, done_exact);
    }
    std::printf(
        "%s, places %u: a god-object rolls off in %d of %d presses; in the others %ld of %ld ticks without a "
        "force outwards, %ld with exact normals; the force changes by at most %.3f N in a tick, %.3f N\n",
        GetParam(), seed, rolling, kPresses, done.lost + done.wrong, done.ticks, done_exact.lost + done_exact.wrong,
        done.step, done_exact.step);
    EXPECT_EQ(done.lost + done.wrong, 0);
    EXPECT_EQ(done_exact.lost + done_exact.wrong, 0);
    EXPECT_EQ(rolled.flips, 0) << "what rolls off goes round step by step";
    EXPECT_LT(std::max(done.step, done_exact.step), 0.06) << "N; 4 % of the diagonal in and out";
    if (!kShares) continue;
    EXPECT_LE(rolling, 0.02 * kPresses);
  }
}

INSTANTIATE_TEST_SUITE_P(Scans, HoldOnScans, ::testing::Values("bunny", "visible_human_skin", "elephant_refined"),
                         [](const auto& test) { return std::string(test.param); });

/// Whether the cursor was past the middle of the part in a tick of a god-object.
bool past_the_middle(const testing::BareTriangles& bare, const testing::OracleTick& tick, Vec3d cursor) {
  return tick.held && bare.past_the_middle(tick.point, cursor);
}

/// Straight shots that end up to two ticks' way behind the wall. Beside the rim the rim itself may be the nearest place
/// before the cursor has come to the middle of the wall. A contact that has gone round it is right where a plain
/// god-object goes to the same place. Everywhere else the wall pushes the cursor back.
TEST(FastCursor, DoesNotTunnelThroughTheBowl) {
  const Made made = converted("bowl");
  const Snapshot& model = *made.model;
  const testing::BareTriangles bare = testing::bare_triangles(model);
  const Box3d box = bounds_of_surface(model);
  const double size = diagonal(box);
  const Workspace space = space_of(model);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1, 1);
  int shots = 0, missed = 0, through_wall = 0, round_the_rim = 0;
  for (int shot = 0; shot < 1000; ++shot) {
    const Vec3d from = box.centre() + normalized(Vec3d{unit(random), unit(random), unit(random)}) * (0.7 * size);
    const Vec3d to = box.centre() + Vec3d{unit(random), unit(random), unit(random)} * (0.25 * size);
    const Vec3d way = normalized(to - from);
    const auto hit = raycast(model, {from, way});
    if (!hit || dot(hit->point.normal, way) > -0.5) continue;  // grazing ways lead out round the rim
    for (const double speed : {0.5, 2.0}) {                    // m/s
      Servo servo({.workspace = space, .force = {.guard = false}}, DeviceInfo{});
      testing::GodObject oracle(bare);
      const double step = speed * 1e-3 / space.metres_per_unit;
      ServoSample felt;
      testing::OracleTick plain;
      bool past = false;
      double along = hit->distance - 10 * step + unit(random) * step;
      if (along < 0) continue;
      ++shots;
      for (int k = 0; along < hit->distance + 2 * step; along += step, ++k) {
        const Vec3d cursor = from + way * along;
        felt = servo.step(model, {.t = k * 1e-3, .position = space.to_device(cursor), .velocity = {}});
        plain = oracle.move(cursor);
        past = past || past_the_middle(bare, plain, cursor);
      }
      missed += felt.contact ? 0 : 1;
      if (!felt.contact || felt.contact_point == felt.cursor || dot(felt.normal, way) <= 0.5) continue;
      const bool as_it = !past && plain.held && length(felt.contact_point - plain.point) < 1e-6 * size;
      ++(as_it ? round_the_rim : through_wall);
    }
  }
  std::printf("bowl: %d shots, in %d of them round the rim as a god-object\n", shots, round_the_rim);
  EXPECT_GT(shots, 600);
  EXPECT_LE(round_the_rim, 0.002 * shots);
  EXPECT_EQ(missed, 0);
  EXPECT_EQ(through_wall, 0);
}

}  // namespace
}  // namespace relief
