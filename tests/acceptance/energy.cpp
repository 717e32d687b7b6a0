// S4: the work of the force along closed ways. What is left of it was made, or lost, by the contact.
#include "acceptance/acceptance.h"
#include "support/driver.h"
#include "support/held_tools.h"

#include <relief/convert/convert.h>
#include <relief/mesh/samples.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <random>
#include <string>
#include <vector>

namespace relief::acceptance {
namespace {

using testing::Driver;

/// What is felt, and how deep (of the diagonal) the ways go.
struct Scene {
  std::string name;
  SnapshotPtr model;
  double depth;
  /// The surface is nowhere more curved than the ways are deep, so there is one nearest place. Elsewhere (at a crease,
  /// a bump, a border between coarse and fine micro-triangles) the contact point gives way to a nearer place: work is
  /// lost there, but none is gained.
  bool one_nearest = true;
};

double ridge(Vec3d p) { return 0.5 + 5 * (0.06 - 0.3 * std::abs(p.x - 0.5)); }

std::vector<Scene> scenes() {
  std::vector<Scene> all = {
      {"sphere, n = 32", testing::shaped(testing::sphere_shell(2, 32), testing::sphere_field()), 0.02},
      {"sphere, n from 16 to 64",
       testing::shaped(testing::mixed_shell(*testing::sphere_shell(2, 1), 16, 2), testing::sphere_field()), 0.02,
       false},
      {"torus with twisted slabs", testing::shaped(testing::torus_shell(16, 10, 32), testing::torus_field), 0.01},
      {"ridge of 33 degrees", testing::displaced(testing::plane_shell(4, 32), ridge), 0.006, false},
      {"ridge of 33 degrees, deep below it", testing::displaced(testing::plane_shell(4, 32), ridge), 0.03, false},
      {"rolling sheet",
       testing::displaced(testing::plane_shell(4, 32),
                          [](Vec3d p) { return 0.5 + 0.15 * std::sin(9 * p.x) * std::cos(7 * p.z); }),
       0.02},
  };
  if (const auto mesh = make_sample("torus", 30'000))
    if (const auto made = convert(*mesh, {.slabs = 200, .intervals = 32}))
      all.push_back({"sample torus with fine relief, converted", made->model.head, 0.01, false});
  return all;
}

/// A closed way over one place: down from the air, about in the material, and out again somewhere else, unless it stays
/// in. Depths and widths are shares of the diagonal; a tool's depth is that of its surface.
class Loop {
 public:
  Loop(const Snapshot& model, double depth, double wide, double tool_radius, bool stays_in, std::mt19937& random)
      : size_(diagonal(model.slab_mesh().bounds())), depth_(depth), stays_in_(stays_in) {
    std::uniform_real_distribution<double> unit(0, 1);
    const SlabMesh& mesh = model.slab_mesh();
    for (;;) {
      double u = unit(random), v = unit(random);
      if (u + v > 1) {
        u = 1 - u;
        v = 1 - v;
      }
      place_ = surface_point(model, static_cast<SlabId>(unit(random) * mesh.slab_count()), u, v);
      const bool sheet = mesh.slabs()[0].neighbours[0] == kNoSlab || mesh.slab_count() == 32;
      // Not at the edge of an open sheet.
      if (!sheet || std::max(std::abs(place_.position.x - 0.5), std::abs(place_.position.z - 0.5)) < 0.35) break;
    }
    place_.position += place_.normal * tool_radius;
    side_ = normalized(cross(place_.normal, std::abs(place_.normal.x) < 0.7 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0}));
    other_ = cross(place_.normal, side_);
    for (double& a : phase_) a = 2 * kPi * unit(random);
    for (double& a : width_) a = (0.02 + 0.02 * unit(random)) * wide;
  }
  /// In the air.
  [[nodiscard]] Vec3d start() const { return at(0) + place_.normal * ((depth_ + 0.02) * size_); }
  [[nodiscard]] Vec3d at(double turn) const {
    const double a = 2 * kPi * turn;
    const double in = stays_in_ ? 0.75 - 0.25 * std::cos(a) : 0.25 - 0.75 * std::cos(a);
    const double x = width_[0] * (std::cos(a + phase_[0]) + 0.3 * std::sin(3 * a + phase_[1]));
    const double y = width_[1] * (std::sin(a + phase_[0]) + 0.3 * std::cos(2 * a + phase_[2]));
    return place_.position + (side_ * x + other_ * y - place_.normal * (depth_ * in)) * size_;
  }

 private:
  static constexpr double kPi = 3.14159265358979323846;
  double size_, depth_;
  bool stays_in_;
  SurfacePoint place_;
  Vec3d side_, other_;
  std::array<double, 3> phase_{};
  std::array<double, 2> width_{};
};

/// The work of the force along a way, by the trapezoidal rule, with steps halved as long as that changes anything.
class Work {
 public:
  Work(const Snapshot& model, double depth, const TouchTool& tool, bool exact)
      : model_(model), size_(diagonal(model.slab_mesh().bounds())) {
    settings_.workspace = {.metres_per_unit = kSize / size_, .model_origin = model.slab_mesh().bounds().centre()};
    settings_.force = {.stiffness = 400, .damping = 0, .exact_normals = exact, .guard = false};
    settings_.tool = tool;
    tolerance_ = 1e-9 * (400 * depth * kSize) * (0.2 * kSize);
  }
  /// As a share of the largest force times the way's length.
  [[nodiscard]] double share_left(const Loop& loop, int steps, int halvings) {
    kept_.resize(static_cast<std::size_t>(halvings) + 2);
    Driver hand(settings_, testing::strong_device());
    static_cast<void>(hand.at(model_, loop.start()));
    Place here = settled(hand, loop.at(0));
    // Once round without counting: the end of the count must find the contact as the beginning did.
    for (int k = 1; k <= steps; ++k) here = settled(hand, loop.at(double(k) / steps));
    for (int k = 1; k <= steps; ++k) {
      kept_.back() = hand;
      const Place there = settled(hand, loop.at(double(k) / steps));
      hand = *kept_.back();
      here = go(hand, here, there, halvings);
    }
    return most_ > 0 ? work_ / (most_ * way_) : std::nan("");
  }

 private:
  static constexpr double kSize = 0.15;  // m, of the diagonal
  struct Place {
    Vec3d cursor, at, force;
  };
  static double work(const Place& a, const Place& b) { return dot((a.force + b.force) * 0.5, b.at - a.at); }
  /// The hand waits until the force is at rest.
  Place settled(Driver& hand, Vec3d cursor) {
    ServoSample felt = hand.at(model_, cursor);
    for (int k = 0; k < 400; ++k) {
      const ServoSample next = hand.at(model_, cursor);
      if (next.force == felt.force) break;
      felt = next;
    }
    return {cursor, felt.device, felt.force};
  }
  /// `to` is what was felt there in one step; returns what is felt there after finer ones.
  Place go(Driver& hand, const Place& from, const Place& to, int halvings) {
    std::optional<Driver>& before = kept_[static_cast<std::size_t>(halvings)];
    before = hand;
    const Place middle = settled(hand, (from.cursor + to.cursor) * 0.5);
    const double halved = work(from, middle) + work(middle, to);
    if (halvings > 0 && !(std::abs(halved - work(from, to)) < tolerance_)) {
      hand = *before;
      const Place first = go(hand, from, middle, halvings - 1);
      return go(hand, first, to, halvings - 1);
    }
    const Place end = settled(hand, to.cursor);
    work_ += work(from, middle) + work(middle, end);
    way_ += length(end.at - from.at);
    most_ = std::max(most_, length(end.force));
    return end;
  }

  const Snapshot& model_;
  double size_, tolerance_;
  ServoSettings settings_;
  /// What the hand was before a step, by the halvings left. Kept, as each new one would ask the system for its memory.
  std::vector<std::optional<Driver>> kept_;
  double work_ = 0, way_ = 0, most_ = 0;
};

/// With exact normals in a part that is thinner than the ways are deep, where the nearest place runs away and the point
/// goes along with a hand that does not wait: what the hand got in a lap and what the spring holds after it, less what
/// it held before, as a share of the largest force times the way. The greatest of so many ways, one and two laps each.
double gained_in_a_finger(int ways) {
  constexpr double kSize = 0.15, kDepth = 0.1, kWide = 0.4, kStiffness = 400;
  constexpr int kSteps = 20'000;
  const SnapshotPtr finger = testing::displaced(
      testing::mapped_shell(*testing::sphere_shell(2, 16), [](Vec3d p) { return Vec3d{p.x, 0.12 * p.y, 0.15 * p.z}; }),
      [](Vec3d) { return 0.5; });
  const Box3d box = finger->slab_mesh().bounds();
  ServoSettings settings;
  settings.workspace = {.metres_per_unit = kSize / diagonal(box), .model_origin = box.centre()};
  settings.force = {.stiffness = kStiffness, .damping = 0, .exact_normals = true, .guard = false};
  std::mt19937 random(6);
  double most = 0;
  for (int k = 0; k < ways; ++k) {
    const Loop loop(*finger, kDepth, kWide, 0, true, random);
    Driver hand(settings, testing::strong_device());
    const Vec3d in = loop.at(0) - loop.start();
    for (int j = 0; j < kSteps; ++j) static_cast<void>(hand.at(*finger, loop.start() + in * (double(j) / kSteps)));
    ServoSample last = hand.at(*finger, loop.at(0));
    const auto stored = [&] { return 0.5 * dot(last.force, last.force) / kStiffness; };
    // After each of two laps, since the first began: what the point's own way loses it may give back later.
    double got = -stored(), greatest = 0, way = 0;
    for (int lap = 0; lap < 2; ++lap) {
      for (int j = 1; j <= kSteps; ++j) {
        const ServoSample now = hand.at(*finger, loop.at(double(j) / kSteps));
        got += dot((now.force + last.force) * 0.5, now.device - last.device);
        way += length(now.device - last.device);
        greatest = std::max(greatest, length(now.force));
        last = now;
      }
      if (greatest > 0) most = std::max(most, (got + stored()) / (greatest * way));
    }
  }
  return most;
}

}  // namespace

void closed_ways(Report& report) {
  const int loops = report.long_form() ? 200 : 4, steps = report.long_form() ? 2'000 : 400;
  // Tools of 4 % of the diagonal: larger than the ways are deep, else a ball has several nearest places on any facets.
  for (const Scene& scene : scenes())
    for (const testing::HeldTool& held : testing::held_tools(0.04 * diagonal(scene.model->slab_mesh().bounds())))
      for (const bool exact : {true, false}) {
        if (!held.is_point() && !exact) continue;  // it has no shaded normals
        std::mt19937 random(5);
        double most = 0, gained = 0;  // no number once one is
        for (int k = 0; k < (held.is_point() ? loops : loops / 2); ++k) {
          const Loop loop(*scene.model, scene.depth, 1, held.radius, k % 2 == 1, random);
          const double left = Work(*scene.model, scene.depth, held.tool(), exact).share_left(loop, steps, 12);
          if (std::isnan(left) || std::abs(left) > most) most = std::abs(left);
          if (std::isnan(left) || left > gained) gained = left;
        }
        const std::string what = scene.name + (!held.is_point() ? held.name : exact ? ", exact normals" : ", shaded");
        // Straight towards where it is held nothing is ever gained. A point goes over an edge between facets only where
        // that is the nearest place of its own facet, which loses a little at each.
        report.at_most(what + ": gained", gained, exact ? 1e-6 : 1e-3);
        if (scene.one_nearest)
          report.at_most("    lost or gained", most, held.is_ball() ? 1e-6 : 1e-3);
        else
          report.shown("    lost or gained", most);
      }
  report.at_most("finger, pressed through, exact normals: gained", gained_in_a_finger(report.long_form() ? 100 : 8),
                 1e-6);
}

}  // namespace relief::acceptance
