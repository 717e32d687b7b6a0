// S23: the contact point of the product beside a plain god-object on the bare triangles, tick by tick.
//
// To see one case alone, or to draw it:
//   RELIEF_S23_CASE=TEXT    only cases whose names have TEXT in them, such as "prism 6, round, 0.3 %, 0.1 D/s"
//   RELIEF_S23_LIST=1       prints the figures of each case, too
//   RELIEF_S23_TRACE=FILE   writes all their ticks as CSV: lengths in model units, forces in N
#include "acceptance/acceptance.h"
#include "support/bodies.h"
#include "support/data.h"
#include "support/driver.h"
#include "support/god_ball.h"
#include "support/hand_ways.h"

#include <relief/base/cpu_time.h>
#include <relief/convert/convert.h>
#include <relief/core/tessellate.h>
#include <relief/mesh/import.h>
#include <relief/mesh/samples.h>

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace relief::acceptance {
namespace {

using testing::BareTriangles;
using testing::Oracle;
using testing::OracleTick;

constexpr double kSize = 0.15;      // m, of the diagonal at the hand
constexpr double kStiffness = 400;  // N/m
constexpr int kMemory = 60;         // ticks for which a jump of the oracle may be felt: the force is blended over 45 ms
constexpr double kSlack = 1e-4;     // of the diagonal

/// How a hand moves and what it holds. Lengths are shares of the diagonal.
struct Hand {
  double depth = 0.003;
  double speed = 0.1;  ///< per second
  double radius = 0;   ///< of a ball; 0: a point
  bool exact = false;  ///< normals
  double friction = 0;

  [[nodiscard]] std::string name() const {
    return fmt::format("{:.2g} %, {} D/s, {}{}{}", 100 * depth, speed,
                       radius > 0 ? fmt::format("ball {:.1g} %", 100 * radius) : "point", exact ? ", exact" : "",
                       friction > 0 ? ", friction" : "");
  }
};

/// A model and the surface that it exports.
struct Body {
  SnapshotPtr model;
  BareTriangles surface;
  bool as_exported = false;  ///< what `relief export` writes is the very same triangles
};

/// One body and the ways over it.
struct Scene {
  std::string family, name;
  std::function<std::optional<TriangleMesh>()> source;  ///< none: it is not there
  ConvertSettings settings = {.slabs = 100, .intervals = 16, .mode = Mode::Certified};
  std::size_t ways_per_hand = 1;  ///< in the short form, taken by turns; in the long form all
  std::vector<std::string> ways = {};
  /// Places of the cursor; empty where there is no such way.
  std::function<std::vector<Vec3d>(const BareTriangles&, const Hand&, std::size_t way)> way = {};
};

std::optional<Body> made(const Scene& scene, Report& report) {
  std::optional<TriangleMesh> source = scene.source();
  if (!source) {
    report.skipped("no test data for " + scene.name);
    return std::nullopt;
  }
  auto done = convert(*std::move(source), scene.settings);
  if (!done) {
    report.at_most("cannot be converted: " + scene.name + ": " + done.error().message, 1, 0);
    return std::nullopt;
  }
  const SnapshotPtr model = done->model.head;
  const Tessellation bare = tessellate(*model);
  const TriangleMesh exported = to_mesh(*model);
  const bool same = exported.positions == bare.positions && exported.triangles == bare.triangles;
  return Body{model, BareTriangles(bare.positions, bare.triangles), same};
}

/// What was found in the cases of one family.
struct Figures {
  long cases = 0, pressed = 0;
  long deeper = 0, far_deeper = 0;  ///< ticks
  long lost = 0, stuck = 0;
  double worst = 0;                     ///< depth over that of the oracle's window
  double slow_step = 0, fast_step = 0;  ///< N
  double product_s = 0, oracle_s = 0;
  long ticks = 0;

  void add(const Figures& f) {
    cases += f.cases;
    pressed += f.pressed;
    deeper += f.deeper;
    far_deeper += f.far_deeper;
    lost += f.lost;
    stuck += f.stuck;
    worst = std::max(worst, f.worst);
    slow_step = std::max(slow_step, f.slow_step);
    fast_step = std::max(fast_step, f.fast_step);
    product_s += f.product_s;
    oracle_s += f.oracle_s;
    ticks += f.ticks;
  }
};

/// Compares a run of ticks.
class Judge {
 public:
  Judge(double size, const Hand& hand) : slack_(kSlack * size), hand_(hand) {}

  void tick(const OracleTick& oracle, const ServoSample& felt) {
    depths_.push_back(oracle.held ? oracle.depth : 0);
    if (depths_.size() > kMemory) depths_.pop_front();
    held_for_ = oracle.held && oracle.depth > slack_ ? held_for_ + 1 : 0;
    free_for_ = oracle.held ? 0 : free_for_ + 1;
    smooth_for_ = oracle.jumped ? 0 : smooth_for_ + 1;

    const double most = *std::ranges::max_element(depths_), depth = felt.contact ? felt.depth : 0;
    ++found_.ticks;
    found_.pressed += oracle.held || felt.contact ? 1 : 0;
    found_.deeper += depth > 1.05 * most + slack_ ? 1 : 0;
    found_.far_deeper += depth > 1.5 * most + slack_ ? 1 : 0;
    if (depth > slack_) found_.worst = std::max(found_.worst, depth / std::max(most, slack_));
    found_.lost += !felt.contact && held_for_ > kMemory ? 1 : 0;
    found_.stuck += felt.contact && length(felt.force) > 0.01 && free_for_ > kMemory ? 1 : 0;
    if (smooth_for_ > kMemory) {
      double& step = hand_.speed > 0.2 ? found_.fast_step : found_.slow_step;
      step = std::max(step, length(felt.force - last_));
    }
    last_ = felt.force;
  }
  [[nodiscard]] const Figures& found() const noexcept { return found_; }

 private:
  double slack_;
  Hand hand_;
  Figures found_;
  std::deque<double> depths_;  ///< of the oracle, the last ones
  int held_for_ = 0, free_for_ = 0, smooth_for_ = 0;
  Vec3d last_;
};

/// RELIEF_S23_TRACE.
class Trace {
 public:
  explicit Trace(Report& report) {
    const char* path = std::getenv("RELIEF_S23_TRACE");
    if (path == nullptr) return;
    file_.reset(std::fopen(path, "w"));
    if (!file_)
      report.skipped(std::string("the trace cannot be written to ") + path);
    else
      fmt::print(file_.get(),
                 "case;t,x,y,z,oracle_held,ox,oy,oz,oracle_depth,oracle_jumped,contact,px,py,pz,depth,nx,ny,nz,fx,fy,"
                 "fz,flags\n");
  }
  void add(const std::string& name, const OracleTick& o, const ServoSample& s) {
    if (!file_) return;
    const auto three = [](Vec3d v) { return fmt::format("{:.9g},{:.9g},{:.9g}", v.x, v.y, v.z); };
    fmt::print(file_.get(), "{};{:.3f},{},{:d},{},{:.9g},{:d},{:d},{},{:.9g},{},{},{}\n", name, s.t, three(s.cursor),
               o.held, three(o.point), o.depth, o.jumped, s.contact, three(s.contact_point), s.depth, three(s.normal),
               three(s.force), s.flags);
  }

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::unique_ptr<std::FILE, Close> file_;
};

Figures compared(const Body& body, const Hand& hand, const std::vector<Vec3d>& way, const std::string& name,
                 Trace& trace) {
  const double size = body.surface.diagonal(), radius = hand.radius * size;
  ServoSettings settings = testing::settings_with(kStiffness, 0, hand.friction, kSize / size);
  settings.workspace.model_origin = body.surface.bounds().centre();
  settings.force.exact_normals = hand.exact;
  settings.tool.radius = radius;
  testing::Driver product(settings, testing::strong_device());
  Oracle oracle(body.surface, radius);
  std::vector<OracleTick> right;
  right.reserve(way.size());
  const Stopwatch oracle_time;
  for (const Vec3d cursor : way) right.push_back(oracle.move(cursor));
  const double oracle_s = oracle_time.cpu();
  std::vector<ServoSample> felt;
  felt.reserve(way.size());
  const Stopwatch product_time;
  for (const Vec3d cursor : way) felt.push_back(product.at(*body.model, cursor));
  const double product_s = product_time.cpu();

  Judge judge(size, hand);
  for (std::size_t k = 0; k < way.size(); ++k) {
    judge.tick(right[k], felt[k]);
    trace.add(name, right[k], felt[k]);
  }
  Figures found = judge.found();
  found.cases = 1;
  found.oracle_s = oracle_s;
  found.product_s = product_s;
  return found;
}

/// Runs cases and keeps their figures by family.
class Comparison {
 public:
  explicit Comparison(Report& report) : report_(report), trace_(report) {
    if (const char* wanted = std::getenv("RELIEF_S23_CASE")) wanted_ = wanted;
    listed_ = std::getenv("RELIEF_S23_LIST") != nullptr;
  }

  /// All hands on all ways. The model is made when the first one wants it.
  void run(const Scene& scene, const std::vector<Hand>& hands) {
    std::optional<Body> body;
    bool tried = false;
    const std::size_t count = report_.long_form() ? scene.ways.size() : scene.ways_per_hand;
    for (std::size_t h = 0; h < hands.size(); ++h)
      for (std::size_t k = 0; k < count; ++k) {
        const std::size_t w = (h + turn_ + k) % scene.ways.size();
        const std::string name = scene.name + ", " + scene.ways[w] + ", " + hands[h].name();
        if (name.find(wanted_) == std::string::npos) continue;
        if (!tried) body = made(scene, report_);
        tried = true;
        if (!body) return;
        exported_ = exported_ && body->as_exported;
        const std::vector<Vec3d> way = scene.way(body->surface, hands[h], w);
        if (way.empty()) {
          ++without_way_;
          continue;
        }
        const Figures found = compared(*body, hands[h], way, name, trace_);
        found_[scene.family + (hands[h].radius > 0 ? ", ball" : "")].add(found);
        if (listed_) list(name, found);
      }
    ++turn_;
  }

  void tell() {
    if (found_.empty()) return report_.skipped("no case whose name has \"" + wanted_ + "\" in it");
    report_.at_most("models whose export is not the surface that is touched", exported_ ? 0 : 1, 0);
    report_.at_most("cases for which no way was found", double(without_way_), 0);
    for (const auto& [family, f] : found_) {
      report_.shown(family + ": cases", double(f.cases));
      report_.at_least(family + ": pressed ticks", double(f.pressed), 1000);
      report_.at_most(family + ": deeper than 1.05 times the god-object", 100 * double(f.deeper) / double(f.pressed),
                      0.1, "%");
      report_.at_most(family + ": deeper than 1.5 times, ticks", double(f.far_deeper), 0);
      report_.shown("    most, of the god-object's depth", f.worst);
      report_.at_most(family + ": ticks without contact where it is held", double(f.lost), 0);
      report_.at_most(family + ": ticks with a force where it is free", double(f.stuck), 0);
      report_.at_most(family + ": force step at 0.1 D/s", f.slow_step, 0.1, "N");
      report_.at_most(family + ": force step at 0.5 D/s", f.fast_step, 0.4, "N");
      report_.shown("    CPU time per tick, god-object", 1e6 * f.oracle_s / double(f.ticks), "us");
      report_.shown("    CPU time per tick, product", 1e6 * f.product_s / double(f.ticks), "us");
    }
  }

 private:
  static void list(const std::string& name, const Figures& f) {
    fmt::print("    {:<64} {:6d} ticks, deeper {:5d}, far {:5d}, worst {:7.2f}, lost {}, stuck {}, step {:.3f} N\n",
               name, f.ticks, f.deeper, f.far_deeper, f.worst, f.lost, f.stuck, std::max(f.slow_step, f.fast_step));
  }

  Report& report_;
  std::string wanted_;
  bool listed_ = false, exported_ = true;
  std::size_t without_way_ = 0;  ///< cases that nothing on the surface lets slide so far
  std::size_t turn_ = 0;
  Trace trace_;
  std::map<std::string, Figures> found_;
};

/// All depths and speeds with each radius. Every one has its own of the two normals, with friction or without; which,
/// is another one for each `turn`. In the long form it has all four.
std::vector<Hand> hands(bool all, const std::vector<double>& radii, std::size_t turn) {
  std::vector<Hand> list;
  for (const double radius : radii)
    for (const double speed : {0.1, 0.5})
      for (const double depth : {0.001, 0.003, 0.01, 0.02}) {
        ++turn;
        for (std::size_t kind = 0; kind < 4; ++kind)
          if (all || kind == (turn + turn / 4) % 4)
            list.push_back({depth, speed, radius, kind % 2 == 1, kind >= 2 ? 0.3 : 0});
      }
  return list;
}

/// By how much the cursor is above a surface that the hand touches.
double height(const BareTriangles& surface, const Hand& hand) {
  return (hand.radius - hand.depth) * surface.diagonal();
}
std::vector<Vec3d> straight(const BareTriangles& surface, const Hand& hand, const std::vector<Vec3d>& corners) {
  return testing::straight_ways(corners, hand.speed * 1e-3 * surface.diagonal());
}

/// A prism that stands along z. The hand comes in over the middle of a side, goes once along the outline at its depth,
/// and out again; straight round, or drifting along the sides meanwhile.
Scene prism(int sides) {
  constexpr double kRadius = 0.5, kHalfLength = 0.3;
  const auto way = [=](const BareTriangles& surface, const Hand& hand, std::size_t w) {
    const double half = testing::kPi / sides, flat = kRadius * std::cos(half), size = surface.diagonal();
    const double up = height(surface, hand), corner = (flat + up) / std::cos(half);
    const auto at = [&](double turn, double far) {
      const double z = w == 0 ? 0.01 : 0.15 - 0.3 * turn / (2 * testing::kPi);
      return Vec3d{far * std::cos(turn), far * std::sin(turn), z};
    };
    const double above = std::max(flat, flat + up) + 0.02 * size;
    std::vector<Vec3d> corners = {at(half, above), at(half, flat + up)};
    for (int k = 1; k <= sides; ++k) corners.push_back(at(2 * half * k, corner));
    corners.push_back(at(half + 2 * testing::kPi, flat + up));
    corners.push_back(at(half + 2 * testing::kPi, above));
    return straight(surface, hand, corners);
  };
  return {.family = sides == 24 ? "cylinder of 24 sides" : "prisms",
          .name = fmt::format("prism {}", sides),
          .source =
              [=] {
                return testing::subdivided(testing::extruded(testing::regular_polygon(sides, kRadius), kHalfLength), 4);
              },
          .ways = {"round", "round and along"},
          .way = way};
}

/// The hand slides along a cylinder of 24 sides and out over its end.
Scene along_cylinder() {
  Scene scene = prism(24);
  scene.ways = {"along", "along and across"};
  scene.way = [](const BareTriangles& surface, const Hand& hand, std::size_t w) {
    const double turn = testing::kPi / 24, flat = 0.5 * std::cos(turn), up = height(surface, hand);
    const auto at = [&](double far, double z, double aside) {
      return Vec3d{far * std::cos(turn) - aside * std::sin(turn), far * std::sin(turn) + aside * std::cos(turn), z};
    };
    const double above = flat + std::max(up, 0.0) + 0.02 * surface.diagonal(), aside = w == 0 ? 0 : 0.05;
    return straight(surface, hand, {at(above, -0.2, -aside), at(flat + up, -0.2, -aside), at(flat + up, 0.4, aside)});
  };
  return scene;
}

/// The hand slides out over the edge of a wedge, square to it or not.
Scene wedge(int degrees) {
  const auto way = [](const BareTriangles& surface, const Hand& hand, std::size_t w) {
    const double up = height(surface, hand), above = std::max(up, 0.0) + 0.02 * surface.diagonal();
    const double z = w == 0 ? 0.013 : 0.15;
    return straight(surface, hand, {{-0.4, above, -z}, {-0.4, up, -z}, {0.2, up, z}});
  };
  return {.family = "wedges",
          .name = fmt::format("wedge of {} degrees", degrees),
          .source = [=] { return testing::subdivided(testing::wedge(degrees * testing::kPi / 180, 0.4), 4); },
          // Samples that cut its edge off by less than the hand is deep: what is felt is a wedge.
          .settings = {.slabs = 100, .intervals = 64, .mode = Mode::Certified},
          .ways = {"out over the edge", "out over the edge aslant"},
          .way = way};
}

/// The hand slides out over the edges of a cube of side 1.
Scene cube() {
  const auto way = [](const BareTriangles& surface, const Hand& hand, std::size_t w) {
    const double up = 0.5 + height(surface, hand), above = std::max(0.5, up) + 0.02 * surface.diagonal();
    const double turn = std::array{0.0, 0.5, testing::kPi / 4, 1.3}[w];
    const Vec3d in = {0.1, up, 0.07}, out = in + Vec3d{std::cos(turn), 0, std::sin(turn)} * 0.8;
    return straight(surface, hand, {{in.x, above, in.z}, in, out});
  };
  return {.family = "cube and octahedron",
          .name = "cube",
          .source =
              [] {
                return testing::subdivided(
                    testing::extruded({{-0.5, -0.5, 0}, {0.5, -0.5, 0}, {0.5, 0.5, 0}, {-0.5, 0.5, 0}}, 0.5), 4);
              },
          .ways = {"square", "aslant", "over a corner", "steeply"},
          .way = way};
}

/// The hand goes over an edge of an octahedron from face to face, square to it or not, and round all four faces.
Scene octahedron() {
  const auto way = [](const BareTriangles& surface, const Hand& hand, std::size_t w) {
    const double up = height(surface, hand), above = 0.02 * surface.diagonal() + std::max(0.0, -up);
    const Vec3d out = normalized(Vec3d{1, 1, 1});
    if (w == 2) {
      // All faces are at their depth where |x| + |y| is this.
      const double far = 0.7 + up * std::sqrt(3.0);
      const Vec3d in = {far / 2, far / 2, 0.3};
      return straight(
          surface, hand,
          {in + out * above, in, {0, far, 0.3}, {-far, 0, 0.3}, {0, -far, 0.3}, {far, 0, 0.3}, in, in + out * above});
    }
    const Vec3d along = normalized(Vec3d{1, 0, 1}), edge = normalized(Vec3d{1, 0, -1}) * (w == 0 ? 0 : 0.2);
    const Vec3d corner = along * (std::sqrt(0.5) + up * std::sqrt(1.5)) + edge * 0.1;
    const Vec3d near = normalized(Vec3d{-1, 2, -1}) * 0.5 - edge, far = Vec3d{near.x, -near.y, near.z} + edge;
    const Vec3d in = corner + near, end = corner + far;
    return straight(surface, hand, {in + out * above, in, corner, end, end + Vec3d{out.x, -out.y, out.z} * above});
  };
  return {.family = "cube and octahedron",
          .name = "octahedron",
          .source = [] { return testing::subdivided(testing::octahedron(), 5); },
          .ways = {"over an edge", "over an edge aslant", "round"},
          .way = way};
}

/// Slides over the surface, each with a place and a direction of its own.
void add_slides(Scene& scene, std::size_t ways, double longest, std::uint32_t seed) {
  for (std::size_t w = 1; w <= ways; ++w) scene.ways.push_back(fmt::format("slide {}", w));
  scene.way = [=](const BareTriangles& surface, const Hand& hand, std::size_t w) {
    const double size = surface.diagonal();
    const testing::Slide like = {.depth = hand.depth * size,
                                 .radius = hand.radius * size,
                                 .step = hand.speed * 1e-3 * size,
                                 .longest = longest * size};
    std::vector<Vec3d> way;
    for (std::uint32_t attempt = 0; attempt < 50 && way.empty(); ++attempt)
      way = testing::slide(surface, like, seed + static_cast<std::uint32_t>(w) + 1000 * attempt);
    return way;
  };
}
Scene hull(std::uint32_t seed) {
  Scene scene = {.family = "convex hulls", .name = fmt::format("hull {}", seed), .source = [=] {
                   return testing::subdivided(testing::random_hull(seed, 14), 4);
                 }};
  return scene;
}
/// A hexagonal prism that was reported to hold the hand fast, and the way round it of that report.
Scene reported() {
  return {.family = "as reported",
          .name = "reported prism",
          .source = []() -> std::optional<TriangleMesh> {
            if (auto mesh = import_mesh(testing::data_folder() / "reports/touch/n6.ply")) return *std::move(mesh);
            return std::nullopt;
          },
          .ways = {"round"},
          .way =
              [](const BareTriangles&, const Hand&, std::size_t) {
                std::vector<Vec3d> way;
                std::ifstream file(testing::data_folder() / "reports/touch/n6_0.003.csv");
                std::string line;
                std::getline(file, line);  // the names of the columns
                double t = 0;
                for (Vec3d p; std::getline(file, line) &&
                              std::sscanf(line.c_str(), "%lf,%lf,%lf,%lf", &t, &p.x, &p.y, &p.z) == 4;)
                  way.push_back(p);
                return way;
              }};
}
Scene sample(const std::string& name) {
  return {.family = "sample " + name,
          .name = name,
          .source = [=]() -> std::optional<TriangleMesh> {
            if (auto mesh = make_sample(name, 30'000)) return *std::move(mesh);
            return std::nullopt;
          },
          .settings = {.slabs = 200, .intervals = 32, .mode = Mode::Certified},
          .ways_per_hand = 2};
}
Scene scan(const std::string& name) {
  return {.family = "scan " + name,
          .name = name,
          .source = [=]() -> std::optional<TriangleMesh> {
            const std::filesystem::path file = testing::data_folder() / "a_models" / (name + ".ply");
            std::error_code none;
            if (!std::filesystem::exists(file, none)) return std::nullopt;
            if (auto mesh = import_mesh(file)) return *std::move(mesh);
            return std::nullopt;
          },
          .settings = {.slabs = 200, .intervals = 64, .mode = Mode::Certified},
          .ways_per_hand = 2};
}

}  // namespace

void god_object(Report& report) {
  const bool all = report.long_form();
  std::vector<Scene> scenes;
  for (int sides = 5; sides <= 12; ++sides) scenes.push_back(prism(sides));
  scenes.push_back(prism(24));
  scenes.push_back(along_cylinder());
  for (const int degrees : {20, 30, 45, 60, 75, 90, 105, 120, 135, 150}) scenes.push_back(wedge(degrees));
  scenes.push_back(cube());
  scenes.push_back(octahedron());
  for (const std::uint32_t seed : {1U, 2U, 3U, 4U, 5U}) {
    scenes.push_back(hull(seed));
    add_slides(scenes.back(), all ? 8 : 4, 1, 10 * seed);
  }
  for (const std::string name : {"head", "pumpkin"}) {
    scenes.push_back(sample(name));
    add_slides(scenes.back(), all ? 12 : 6, all ? 1 : 0.5, 100);
  }
  for (const std::string name : {"igea", "bunny"}) {
    scenes.push_back(scan(name));
    add_slides(scenes.back(), all ? 12 : 6, all ? 1 : 0.5, 200);
  }
  Comparison comparison(report);
  for (std::size_t k = 0; k < scenes.size(); ++k) {
    // Balls take longer; on prisms they are much alike.
    const bool balls = all || scenes[k].family != "prisms" || k % 3 == 0;
    comparison.run(scenes[k], hands(all, balls ? std::vector{0.0, 0.01, 0.003} : std::vector{0.0}, k));
  }
  comparison.run(reported(), {{}, {.exact = true}});
  Scene made_by_us = prism(6);
  made_by_us.ways.resize(1);
  comparison.run(made_by_us, {{}, {.exact = true}, {.friction = 0.3}, {.radius = 0.01}, {.radius = 0.003}});
  comparison.tell();
}

}  // namespace relief::acceptance
