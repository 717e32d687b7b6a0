// S5 to S7: how the force changes from tick to tick: over smooth surfaces, across borders, and when the surface changes
// under the tip.
#include "acceptance/acceptance.h"
#include "support/driver.h"
#include "support/held_tools.h"
#include "support/tools.h"

#include <relief/edit/editor.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

namespace relief::acceptance {
namespace {

using testing::Driver;

constexpr double kTick = 1e-3;  // s
constexpr double kSize = 0.15;  // m, of the diagonal at the hand
constexpr double kDegree = 3.14159265358979323846 / 180;
constexpr double kStiffness = 400;    // N/m
constexpr double kToolRadius = 0.04;  // of the diagonal

ServoSettings usual(const Snapshot& model, double damping, double friction, const TouchTool& tool = {}) {
  const Box3d& bounds = model.slab_mesh().bounds();
  ServoSettings settings = testing::settings_with(kStiffness, damping, friction, kSize / diagonal(bounds));
  settings.workspace.model_origin = bounds.centre();
  settings.tool = tool;
  return settings;
}

/// What happened to the force over one run.
struct Steps {
  std::vector<double> sizes;  ///< |dF| per tick, N
  double turn = 0;            ///< the largest per tick, rad, where |F| is above 0.5 N
  Vec3d last;
  bool any = false;

  void add(Vec3d force) {
    if (any) {
      sizes.push_back(length(force - last));
      if (length(force) > 0.5 && length(last) > 0.5)
        turn = std::max(turn, std::atan2(length(cross(force, last)), dot(force, last)));
    }
    last = force;
    any = true;
  }
  [[nodiscard]] double quantile(double q) {
    if (sizes.empty()) return std::nan("");
    const auto at = static_cast<std::ptrdiff_t>(q * double(sizes.size() - 1));
    std::ranges::nth_element(sizes, sizes.begin() + at);
    return sizes[static_cast<std::size_t>(at)];
  }
};

/// Round a sphere of radius 1 on a tilted circle, at the given height above the surface, model units.
Vec3d round_sphere(double turn, double height) {
  return Vec3d{std::sin(turn), 0.31 * std::cos(turn), 0.95 * std::cos(turn)} *
         ((1 + height) / std::hypot(std::sin(turn), std::hypot(0.31, 0.95) * std::cos(turn)));
}
/// Along the tube of torus_shell(), winding round it slowly.
Vec3d round_torus(double turn, double height) {
  const double p = turn / 2.8, q = 0.2 * turn, tube = 0.8 + height;
  return {(2 + tube * std::cos(q)) * std::cos(p), tube * std::sin(q), (2 + tube * std::cos(q)) * std::sin(p)};
}

/// Slides over a smooth surface at a speed in m/s, at a depth in shares of the diagonal.
template <typename Way>
void slide(const Snapshot& model, Way&& over, const ServoSettings& settings, double tool_radius, double speed,
           double depth, int ticks, Steps& steps) {
  const auto way = [&](double turn, double height) { return over(turn, height + tool_radius); };
  const double size = diagonal(model.slab_mesh().bounds()), step = speed * kTick / settings.workspace.metres_per_unit;
  steps.any = false;
  Driver hand(settings, testing::strong_device());
  static_cast<void>(hand.at(model, way(-300 * step, 0.01 * size)));
  for (int k = -299; k < ticks; ++k) {
    // In by little steps, and some time to settle.
    const double in = k < -200 ? 0.01 - (depth + 0.01) * (k + 300) / 100 : -depth;
    const ServoSample felt = hand.at(model, way(k * step, in * size));
    if (k >= 0) steps.add(felt.force);
  }
}

}  // namespace

void force_continuity(Report& report) {
  const int ticks = report.long_form() ? 3'000'000 : 60'000;
  const SnapshotPtr sphere = testing::shaped(testing::sphere_shell(2, 32), testing::sphere_field());
  const auto mixed = [](int coarsest) {
    return testing::shaped(testing::mixed_shell(*testing::sphere_shell(2, 1), coarsest, 2), testing::sphere_field());
  };
  const SnapshotPtr coarse = mixed(16), fine = mixed(32);
  const SnapshotPtr torus = testing::shaped(testing::torus_shell(16, 10, 32), testing::torus_field);
  constexpr double kSpeed = 0.1, kMu = 0.3;  // m/s
  // Deeper than the tools are large, too.
  const auto tools = testing::held_tools(kToolRadius * diagonal(sphere->slab_mesh().bounds()));
  for (const double friction : {0.0, kMu}) {
    const auto measure = [&](const std::string& name, const SnapshotPtr& model, auto&& way, const auto& held) {
      Steps steps;
      for (const double depth : {0.005, 0.02, 0.04})
        slide(*model, way, usual(*model, 1, friction, held.tool()), held.radius, kSpeed, depth, ticks / 3 / held.dear,
              steps);
      const std::string what = name + (friction > 0 ? " with friction" : "") + held.name;
      report.at_most(what + ": force step at 0.1 m/s", steps.quantile(1), 1.5 * kStiffness * kSpeed * kTick + 0.02,
                     "N");
      report.shown("    of that p99.999", steps.quantile(0.99999), "N");
      report.at_most(what + ": turn per tick", steps.turn / kDegree, 5, "degrees");
    };
    for (const testing::HeldTool& held : tools) {
      measure("sphere", sphere, round_sphere, held);
      // A tool deeper than it is large has the steps of the facets' angles, which at n = 16 come near the limit.
      if (held.is_point())
        measure("sphere, n from 16 to 64", coarse, round_sphere, held);
      else
        measure("sphere, n from 32 to 128", fine, round_sphere, held);
      measure("torus", torus, round_torus, held);
    }
  }

  // In the air there is nothing; where the hand goes in, the spring grows with the way and the damper acts at once.
  for (const testing::HeldTool& held : tools) {
    Driver hand(usual(*sphere, 1, 0, held.tool()), testing::strong_device());
    const double step = kSpeed * kTick / (kSize / diagonal(sphere->slab_mesh().bounds()));
    double in_air = 0, entry = 0;
    Vec3d last;
    for (int k = 0; k < 400; ++k) {
      const double height = 200 * step - k * step;
      const ServoSample felt = hand.at(*sphere, round_sphere(1, height + held.radius));
      if (height > 0) in_air = std::max(in_air, length(felt.force));
      if (height <= 0) entry = std::max(entry, length(felt.force - last));
      last = felt.force;
    }
    report.at_most("force in the air" + held.name, in_air, 0, "N");
    report.at_most("force step where the hand goes in at 0.1 m/s" + held.name, entry,
                   1.5 * kStiffness * kSpeed * kTick + 1 * kSpeed + 0.02, "N");
  }

  // Against the force of the ideal sphere, whose step is its size times the angle that the hand goes round it. A ball
  // has no interpolated normals: its steps are the angles between micro-triangles. A rigid tool's points come and go:
  // its ideal force is no such circle (S21 has it).
  for (const testing::HeldTool& held : tools)
    for (const int n : {16, 32, 64})
      for (const double depth : {0.01, 0.03, 0.06}) {
        if (!held.points.empty()) continue;
        const SnapshotPtr model = testing::shaped(testing::sphere_shell(2, n), testing::sphere_field());
        const double size = diagonal(model->slab_mesh().bounds());
        Steps steps;
        slide(*model, round_sphere, usual(*model, 0, 0, held.tool()), held.radius, 0.5 * kSize, depth,
              ticks / 3 / held.dear, steps);
        const double force = kStiffness * depth * kSize;
        // round_sphere() turns by its argument: model units of way at radius 1.
        const double ideal = 2 * force * std::sin(0.5 * 0.5 * kTick * size);
        const double off = std::max(std::abs(steps.quantile(1) - ideal), std::abs(steps.quantile(0) - ideal));
        const std::string what = "sphere, n = " + std::to_string(n) + ", " + std::to_string(int(depth * 100)) +
                                 " % deep" + held.name + ": step off the ideal, of the force";
        if (n >= 32 && held.is_point())
          report.at_most(what, off / force, 0.002);
        else
          report.shown(what, off / force);
      }
}

namespace {

/// Presses on a sphere while an editor works under the tip.
class Workbench {
 public:
  Workbench(Vec3d tip, const testing::HeldTool& held, bool exact = false)
      : editor_(testing::shaped(testing::sphere_shell(2, 32), testing::sphere_field())),
        size_(diagonal(editor_.head()->slab_mesh().bounds())),
        radius_(1 + held.radius),
        hand_(settings(*editor_.head(), held, exact), testing::strong_device()),
        tip_(tip) {
    for (int k = 0; k < 400; ++k) tick();
  }
  [[nodiscard]] Editor& editor() { return editor_; }
  [[nodiscard]] double size() const { return size_; }
  [[nodiscard]] const ServoSample& felt() const { return felt_; }
  [[nodiscard]] const Snapshot& seen() const { return *hand_.seen(); }
  /// Whether the tool worked on an older model in that tick.
  [[nodiscard]] bool is_behind() const { return is_behind_; }
  [[nodiscard]] long dabs() const { return dabs_; }
  /// The hand comes down to a depth of 1 % of the diagonal, and stays.
  void tick() {
    height_ = std::max(-0.01, height_ - 1e-4);
    rest();
  }
  void rest() {
    const SnapshotPtr newest = editor_.head();
    felt_ = hand_.at(newest, normalized(tip_) * (radius_ + height_ * size_));
    is_behind_ = hand_.seen() != newest;
  }
  /// It moves on, and follows the surface up and down as a hand does that pushes with the same force.
  void tick(Vec3d moved) {
    tip_ = tip_ + moved;
    height_ += std::clamp(0.02 * (felt_.depth / size_ - 0.01), -1e-4, 1e-4);
    rest();
  }
  void dab(Tool tool, double radius, double by) {
    editor_.begin_stroke({.tool = tool, .radius = radius * size_, .strength = 1});
    const Dab dab = {.slab = felt_.at.slab,
                     .contact = felt_.contact_point,
                     .cursor = felt_.contact_point - felt_.normal * (by * size_),
                     .normal = felt_.normal,
                     .seconds = by / radius};
    static_cast<void>(editor_.dab(dab));
    static_cast<void>(editor_.end_stroke());
    ++dabs_;
  }

 private:
  static ServoSettings settings(const Snapshot& model, const testing::HeldTool& held, bool exact) {
    ServoSettings all = usual(model, 1, 0.3, held.tool());
    all.force.exact_normals = exact;
    return all;
  }

  Editor editor_;
  double size_;
  double radius_;  ///< of the sphere on which the tool's origin is when it touches the sphere as it was at first
  Driver hand_;
  Vec3d tip_;
  ServoSample felt_;
  double height_ = 0.01;  ///< above that, of the diagonal
  long dabs_ = 0;
  bool is_behind_ = false;
};

/// What a change of the surface under the resting tip does to the force.
struct Change {
  double step = 0;   ///< N, the largest in one tick
  double whole = 0;  ///< N, in the end
  int settled = 0;   ///< ticks until 95 % of it are there
};

Change change_by(Workbench& bench) {
  const Vec3d before = bench.felt().force;
  std::vector<Vec3d> forces = {before};
  Change change;
  for (int k = 0; k < 400; ++k) {
    bench.tick();
    change.step = std::max(change.step, length(bench.felt().force - forces.back()));
    forces.push_back(bench.felt().force);
  }
  change.whole = length(forces.back() - before);
  while (change.settled < 400 && length(forces[std::size_t(change.settled)] - forces.back()) > 0.05 * change.whole)
    ++change.settled;
  return change;
}

/// A tip rests all over a model with ribs and creases, and the ground around it is carved away, so that it may stand in
/// the open, or on what lies beside; then that is undone.
void ground_taken_away(const SnapshotPtr& model, Report& report) {
  constexpr double kAbove = 0.01, kDown = 2e-5, kCarved = 0.006;  // of the diagonal; the second per tick
  const int places = report.long_form() ? 400 : 60;
  const Box3d& bounds = model->slab_mesh().bounds();
  const double size = diagonal(bounds);
  const std::vector<Vec3d> ways = testing::sphere_points(static_cast<std::size_t>(places), size);
  for (const bool exact : {false, true})
    for (const double deep : {0.003, 0.015}) {
      double step = 0;
      int edits = 0, freed = 0;
      for (const Vec3d way : ways) {
        const SurfacePoint at = closest_point(*model, bounds.centre() + way);
        ServoSettings settings = usual(*model, 0, 0);
        settings.force.exact_normals = exact;
        Driver hand(settings, testing::strong_device());
        Editor editor(model);
        ServoSample felt;
        for (double height = kAbove; height > -deep; height -= kDown)
          felt = hand.at(*model, at.position + at.normal * (std::max(height, -deep) * size));
        if (!felt.contact) continue;
        ++edits;
        Vec3d last = felt.force;
        const auto rest = [&] {
          for (int k = 0; k < 300; ++k) {
            felt = hand.at(*editor.head(), at.position - at.normal * (deep * size));
            step = std::max(step, length(felt.force - last));
            last = felt.force;
          }
        };
        rest();
        const SurfacePoint ground = closest_point(*model, felt.contact_point);
        editor.begin_stroke({.tool = Tool::Carve, .radius = 0.05 * size, .strength = 1});
        static_cast<void>(editor.dab({.slab = ground.slab,
                                      .contact = ground.position,
                                      .cursor = ground.position - ground.normal * (kCarved * size),
                                      .normal = ground.normal}));
        static_cast<void>(editor.end_stroke());
        rest();
        freed += felt.contact ? 0 : 1;
        editor.set_head(model);
        rest();
      }
      const std::string what =
          std::string(exact ? ", exact normals, " : ", ") + (deep < 0.01 ? "0.3 % deep" : "1.5 % deep");
      report.at_least("ground carved away on a rough model" + what, edits, places / 2);
      if (deep < 0.01)
        report.at_least("tips that then stood in free space" + what, freed, places / 2);
      else
        report.shown("tips that then stood in free space" + what, freed);
      report.at_most("its largest jump in a tick" + what, step, 0.05, "N");
    }
}

}  // namespace

void borders_and_edits(Report& report) {
  // Sliding across slab and tile borders of a plane: its force does not change at all.
  constexpr double kSlope = 0.06;
  for (const bool mixed : {false, true}) {
    const auto shell = testing::plane_shell(4, 16);
    const SnapshotPtr sheet = testing::displaced(mixed ? testing::mixed_shell(*shell, 8, 2) : shell,
                                                 [](Vec3d p) { return 0.5 + 5 * kSlope * (p.x - 0.5); });
    for (const testing::HeldTool& held : testing::held_tools(kToolRadius * diagonal(sheet->slab_mesh().bounds()))) {
      Driver hand(usual(*sheet, 1, 0.3, held.tool()), testing::strong_device());
      Steps steps;
      int crossed = 0;
      SlabId last = kNoSlab;
      for (int k = 0; k < 4000; ++k) {
        const double x = 0.1 + 2e-4 * k,
                     height = std::max(-0.02, 0.02 - 4e-4 * k) + held.radius * std::hypot(1, kSlope);
        const ServoSample felt = hand.at(*sheet, {x, kSlope * (x - 0.5) + height, 0.13 + 1.7e-4 * k});
        if (k < 500) continue;
        steps.add(felt.force);
        crossed += felt.at.slab != last ? 1 : 0;
        last = felt.at.slab;
      }
      const std::string what = (mixed ? "slab borders of different n" : "slab borders") + held.name;
      report.at_least(what + " crossed", crossed, 6);
      report.at_most(what + ": extra jump", steps.quantile(1), 0.05, "N");
    }
  }

  // Dabs of a size, and their undoing, under a resting tip.
  const int places = report.long_form() ? 200 : 6;
  const double size = diagonal(testing::sphere_shell(2, 32)->bounds());
  std::vector<std::pair<testing::HeldTool, bool>> ways;  // a tool, and whether with exact normals
  for (const testing::HeldTool& held : testing::held_tools(kToolRadius * size)) {
    ways.emplace_back(held, false);
    if (held.is_point()) ways.emplace_back(held, true);
  }
  for (const auto& [held, exact] : ways) {
    const std::string with = exact ? ", exact normals" : held.name;
    double step = 0, whole = 0;
    int soonest = 1000, changes = 0;
    for (int place = 0; place < places; ++place) {
      const double turn = 2.4 * place, up = -0.9 + 1.8 * (place + 0.5) / places;
      const Vec3d tip = normalized(Vec3d{std::cos(turn), up, std::sin(turn)});
      for (const auto& [tool, by] :
           {std::pair{Tool::Carve, 0.003}, {Tool::Carve, 0.008}, {Tool::Deposit, 0.003}, {Tool::Deposit, 0.008}}) {
        Workbench bench(tip, held, exact);
        const auto look = [&] {
          const Change change = change_by(bench);
          if (change.whole < 0.02) return;
          ++changes;
          whole = std::max(whole, change.whole);
          step = std::max(step, change.step);
          soonest = std::min(soonest, change.settled);
        };
        const SnapshotPtr before = bench.editor().head();
        bench.dab(tool, 0.05, by);
        const SnapshotPtr after = bench.editor().head();
        look();
        bench.editor().set_head(before);
        look();
        bench.editor().set_head(after);
        look();
      }
    }
    report.at_least("edits, undone and redone, that were felt" + with, changes, 10 * places);
    report.shown("largest change of the force by one of them", whole, "N");
    report.at_most("its largest jump in a tick" + with, step, 0.05, "N");
    report.at_least("ticks over which a change is blended" + with, soonest, 20, "ms");
  }

  // Thorns, thinner at their feet than the tip is deep.
  ground_taken_away(testing::shaped(testing::sphere_shell(2, 64),
                                    [](Vec3d p) {
                                      const Vec3d way = normalized(p);
                                      const double wave =
                                          std::cos(14 * way.x) * std::cos(14 * way.y) * std::cos(14 * way.z);
                                      return length(p) - 0.85 - 0.3 * std::pow(wave, 6);
                                    }),
                    report);
}

namespace {

/// A hand goes over a sphere while a tool works under it, so many times per second.
struct Sculpting {
  const testing::HeldTool& held;
  Tool tool;
  int rate;

  /// Calls visit(bench, tick) after each tick and, for tick -1, before the first.
  template <typename Visit>
  void run(int ticks, Visit&& visit) const {
    Workbench bench(normalized(Vec3d{0.3, 0.7, 0.6}), held);
    visit(bench, -1);
    for (int k = 0; k < ticks; ++k) {
      if (k * rate / 1000 != (k + 1) * rate / 1000 && bench.felt().contact)
        bench.dab(tool, 0.04, tool == Tool::Carve ? 0.004 : 0.02 / rate);
      bench.tick(Vec3d{2e-4 * std::cos(2e-3 * k), 0, 2e-4 * std::sin(2e-3 * k)});
      visit(bench, k);
    }
  }
};

}  // namespace

void sculpting(Report& report) {
  const int ticks = report.long_form() ? 60'000 : 4'000;
  const double tool_size = kToolRadius * diagonal(testing::sphere_shell(2, 32)->bounds());
  for (const testing::HeldTool& held : testing::held_tools(tool_size))
    for (const int rate : {10, 60, 1000})
      for (const Tool tool : {Tool::Carve, Tool::Deposit}) {
        const Sculpting scene = {held, tool, rate};
        double step = 0, off_surface = 0;
        long inside = 0, edits = 0, behind = 0, most_behind = 0;
        ServoSample last;
        scene.run(ticks, [&](const Workbench& bench, int k) {
          const ServoSample felt = bench.felt(), before = std::exchange(last, felt);
          if (k < 0) return;
          edits = bench.dabs();
          step = std::max(step, length(felt.force - before.force));
          behind = bench.is_behind() ? behind + 1 : 0;
          most_behind = std::max(most_behind, behind);
          if (!felt.contact) return;
          const SurfacePoint near = closest_point(bench.seen(), felt.contact_point);
          off_surface = std::max(off_surface, length(near.position - felt.contact_point) / bench.size());
          LocateHint hint;
          const Vec3d above = felt.contact_point + near.normal * (1e-3 * bench.size());
          inside += relief::inside(bench.seen(), above, hint) ? 1 : 0;
        });
        const std::string what = std::string(name(tool)) + " at " + std::to_string(rate) + " Hz" + held.name;
        report.shown(what + ": edits", double(edits));
        // With what the hand's own motion does, also where a point slips off a ridge that it was pressed through.
        report.at_most(what + ": force step", step, 0.1, "N");
        report.at_most(what + ": contact point off the surface, of the diagonal", off_surface, 1e-9);
        report.at_most(what + ": ticks with the contact point in the material", double(inside), 0);
        report.at_most(what + ": ticks in an older model, in a row", double(most_behind), 12);
      }
}

}  // namespace relief::acceptance
