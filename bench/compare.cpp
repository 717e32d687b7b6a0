#include "compare.h"

#include "paper/paper_algorithm.h"
#include "peers.h"
#include "support/tools.h"
#include "timing.h"

#include <relief/core/query.h>
#include <relief/haptics/servo.h>
#include <relief/render/renderer.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <random>
#include <span>
#include <utility>

namespace relief::bench {

std::vector<Vec3d> slide_path(const Snapshot& model, double depth, int count) {
  const Box3d box = surface_bounds(model);
  const double scale = diagonal(box);
  std::vector<Vec3d> path;
  const int anchors = std::max(2, count / 50);
  std::vector<Vec3d> held;
  for (int k = 0; k <= anchors; ++k) {
    const double turn = 6.283185307179586 * k / anchors;
    const Vec3d from = box.centre() + Vec3d{std::sin(turn), 0.25 * std::sin(3 * turn), std::cos(turn)} * scale;
    const auto hit = raycast(model, {from, box.centre() - from});
    if (hit) held.push_back(hit->point.position - hit->point.normal * (depth * scale));
  }
  for (std::size_t k = 0; k + 1 < held.size(); ++k)
    for (int i = 0; i < 50; ++i) path.push_back(held[k] + (held[k + 1] - held[k]) * (i / 50.0));
  return path;
}

namespace {

using nlohmann::ordered_json;

/// Cursors, one per frame.
struct Workload {
  const char* name;
  bool coherent;  ///< from frame to frame the cursor moves as a hand does
  std::vector<Vec3d> cursors;
  std::size_t section = 100;  ///< frames after which it is elsewhere
  /// The nearest point of the tessellation, exact in double, to every so manyth cursor from the first one.
  std::size_t apart = 1;
  std::vector<SurfacePoint> truths = {};

  /// The first ones, for what takes longer.
  [[nodiscard]] Workload few(std::size_t most) const {
    Workload part = *this;
    part.cursors.resize(std::min(most, cursors.size()));
    return part;
  }
};

std::vector<Workload> workloads(const Snapshot& model, int frames) {
  const double scale = diagonal(surface_bounds(model));
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1, 1);
  // A turn round the model in 40 s: about 1e-4 of the diagonal per frame.
  std::vector<Vec3d> slide = slide_path(model, 0.005, 40'000);
  slide.resize(std::min(slide.size(), static_cast<std::size_t>(frames)));
  const auto near = [&](std::size_t k) { return closest_point(model, slide[k * 7919 % slide.size()]); };
  Workload tap = {"tap", true, {}}, press = {"press", true, {}}, jump = {"jump", false, {}};
  for (std::size_t k = 0; tap.cursors.size() < slide.size(); ++k) {
    const SurfacePoint at = near(k);
    // In to 1 % of the diagonal and out again, in a tenth of a second; then a hold that leans to and fro.
    for (int i = 0; i < 100; ++i)
      tap.cursors.push_back(at.position + at.normal * (0.01 * scale * std::cos(2 * std::numbers::pi * i / 100)));
    const Vec3d aside = normalized(cross(at.normal, std::abs(at.normal.x) < 0.7 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0}));
    for (int i = 0; i < 100; ++i)
      press.cursors.push_back(at.position - at.normal * (0.01 * scale) + aside * (0.003 * scale * std::sin(0.1 * i)));
    for (int i = 0; i < 100; ++i) {
      const SurfacePoint there = near(k * 100 + static_cast<std::size_t>(i));
      jump.cursors.push_back(there.position + there.normal * (0.005 * scale * unit(random)));
    }
  }
  const std::size_t whole = slide.size();
  std::vector<Workload> all = {
      {"slide", true, std::move(slide), whole}, std::move(tap), std::move(press), std::move(jump)};
  for (Workload& work : all) {
    work.apart = std::max<std::size_t>(1, work.cursors.size() / 500);
    for (std::size_t k = 0; k < work.cursors.size(); k += work.apart)
      work.truths.push_back(closest_point(model, work.cursors[k]));
  }
  return all;
}

/// Asked once per frame; `coherent` as in Peer. A sum of answers keeps the optimiser honest.
using Question = std::function<double(Vec3d cursor, bool coherent)>;
/// Comes before each section, untimed, with its first cursor.
using Approach = std::function<void(Vec3d cursor)>;

ordered_json times(const Question& ask, const std::vector<Workload>& works, const Approach& approach = {}) {
  const CallTimer timer;
  static std::vector<char> other(16U << 20U);
  double sum = 0;
  ordered_json json;
  for (const Workload& work : works) {
    std::vector<double> least(work.cursors.size(), 1e9);
    for (int pass = 0; pass < 3; ++pass)
      for (std::size_t k = 0; k < least.size(); ++k) {
        if (approach && k % work.section == 0) approach(work.cursors[k]);
        least[k] = std::min(least[k], timer([&] { sum += std::abs(ask(work.cursors[k], work.coherent)); }));
      }
    std::vector<double> cold;
    for (std::size_t k = 0; k < std::min<std::size_t>(500, work.cursors.size()); ++k) {
      if (approach && k % work.section == 0) approach(work.cursors[k]);
      for (std::size_t i = 0; i < other.size(); i += 64) ++other[i];
      cold.push_back(timer([&] { sum += std::abs(ask(work.cursors[k], work.coherent)); }));
    }
    json[work.name] = {{"warm_ns", percentiles(least, 1e9)}, {"cold_ns", percentiles(cold, 1e9)}};
  }
  json["check"] = std::isfinite(sum) ? sum : 0.0;
  return json;
}

/// No answer where contact is lost.
using Answer = std::function<std::optional<Nearest>(Vec3d cursor, bool coherent)>;

/// Against the nearest point of the tessellation, over some 500 frames of each workload.
ordered_json accuracy(double scale, const Answer& answer, std::span<const Workload> works,
                      const Approach& approach = {}) {
  ordered_json json;
  for (const Workload& work : works) {
    std::vector<double> errors, angles;
    int wrong_side = 0, none = 0;
    for (std::size_t k = 0; k < work.cursors.size(); ++k) {
      const Vec3d p = work.cursors[k];
      if (approach && k % work.section == 0) approach(p);
      const std::optional<Nearest> found = answer(p, work.coherent);
      if (k % work.apart != 0) continue;
      const SurfacePoint& truth = work.truths[k / work.apart];
      const double distance = length(p - truth.position);
      if (!found) {
        ++none;
        continue;
      }
      errors.push_back(std::abs(std::abs(found->distance) - distance) / scale);
      angles.push_back(std::acos(std::clamp(dot(found->normal, truth.normal), -1.0, 1.0)) * 180 / std::numbers::pi);
      if (distance > 1e-6 * scale && (found->distance < 0) != (dot(p - truth.position, truth.normal) < 0)) ++wrong_side;
    }
    json[work.name] = {{"distance_error_of_diagonal", percentiles(errors, 1)},
                       {"normal_degrees", percentiles(angles, 1)},
                       {"wrong_side", wrong_side},
                       {"without_answer", none}};
  }
  return json;
}

/// The cage and the displacement, which is all that touch reads of a plain model.
std::size_t bytes_of(const Snapshot& model) {
  const SlabMesh& mesh = model.slab_mesh();
  std::size_t bytes = mesh.fibres().size_bytes() + mesh.slabs().size_bytes() + mesh.tree().size_bytes() +
                      mesh.tree_slabs().size_bytes() + mesh.slab_count() * sizeof(Box3d);
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    const Tile& tile = model.tile(Layer::Displacement, s);
    bytes += tile.bytes() + tile.bounds().bytes();
  }
  return bytes;
}

}  // namespace

ordered_json compare_on(const Snapshot& model, double build_seconds, int frames) {
  const Tessellation surface = tessellate(model);
  const auto triangles = static_cast<double>(surface.triangles.size());
  const Box3d box = surface_bounds(model);
  const double scale = diagonal(box);
  const std::vector<Workload> works = workloads(model, frames);
  ordered_json json = {{"triangles", surface.triangles.size()}, {"frames", works.front().cursors.size()}};
  /// What was built once for all ways; `answer` without one: there is no nearest point to compare with.
  const auto row = [&](const std::string& name, double seconds, std::size_t bytes, const std::vector<Workload>& ways,
                       const Answer& answer, const Question& ask, const Approach& approach = {}) {
    json[name] = {{"build_cpu_seconds", seconds}, {"bytes_per_triangle", static_cast<double>(bytes) / triangles}};
    if (answer) json[name]["accuracy"] = accuracy(scale, answer, ways, approach);
    json[name]["ns"] = times(ask, ways, approach);
  };
  const auto of_a_query = [&](const std::string& name, double seconds, std::size_t bytes, const Answer& answer) {
    row(name, seconds, bytes, works, answer, [&](Vec3d p, bool coherent) {
      const std::optional<Nearest> found = answer(p, coherent);
      return found ? found->distance : 0.0;
    });
  };
  const std::size_t bytes = bytes_of(model);

  LocateHint hint;
  of_a_query("relief tracked query", build_seconds, bytes, [&](Vec3d p, bool) -> std::optional<Nearest> {
    const std::optional<Contact> at = probe(model, p, hint);
    if (!at) return std::nullopt;
    const double depth = length(p - at->surface.position);
    // In place: a copy of what was just written would add a tenth to the query's time.
    return std::optional<Nearest>(std::in_place, at->surface.position, at->surface.normal,
                                  at->touching() ? -depth : depth);
  });
  // From nothing and over the whole surface, it takes longer. It is what the others are compared with.
  std::vector<Workload> few;
  few.reserve(works.size());
  for (const Workload& work : works) few.push_back(work.few(500));
  row("relief closest point", build_seconds, bytes, few, {},
      [&](Vec3d p, bool) { return length(closest_point(model, p).position - p); });

  // Contact takes the cursors as a hand's way: it comes to each section from outside, and jumps are fast moves within
  // the device's limits.
  const Vec3d centre = box.centre();
  const auto from_outside = [&](Vec3d first, const auto& tick) {
    const Vec3d away = normalized(first - centre) * (0.3 * scale);
    for (int k = 0; k < 200; ++k) static_cast<void>(tick(first + away * (1 - k / 200.0), true));
  };
  for (const auto& [name, look] : {std::pair{"relief contact point", Proxy::Look::Here},
                                   {"relief contact point, looking around", Proxy::Look::Around}}) {
    Proxy proxy;
    const auto tick = [&](Vec3d p, bool) -> std::optional<Nearest> {
      if (!proxy.step(model, p, {}, look)) return std::nullopt;
      return Nearest{proxy.surface().position, proxy.normal(), -proxy.depth()};
    };
    const auto approach = [&](Vec3d first) {
      proxy.reset();
      from_outside(first, tick);
    };
    row(
        name, build_seconds, bytes, works, tick,
        [&](Vec3d p, bool coherent) { return tick(p, coherent) ? proxy.depth() : 0.0; }, approach);
  }

  // The servo with a point, with a ball of 1 % of the diagonal, and with a rigid tool: points all over a sphere of 5 %.
  const std::vector<Vec3d> shell = testing::sphere_points(TouchTool::kMostPoints, 0.05 * scale);
  std::vector<Workload> fewer;
  fewer.reserve(works.size());
  for (const Workload& work : works) fewer.push_back(work.few(works.front().cursors.size() / 4));
  struct Held {
    const char* name;
    TouchTool tool;
    const std::vector<Workload>& works;
  };
  for (const Held& held :
       {Held{"relief servo tick", {}, works}, Held{"relief servo tick, ball", {.radius = 0.01 * scale}, works},
        Held{"relief servo tick, 1000 points", {.points = shell}, fewer}}) {
    const ServoSettings settings = {.workspace = {.metres_per_unit = 0.15 / scale}, .tool = held.tool};
    std::optional<Servo> servo;
    double t = 0;
    std::size_t ticks = 0, latched = 0, touching = 0;
    const auto tick = [&](Vec3d p, bool coherent) {
      t += coherent ? 1e-3 : 0.045;
      const ServoSample felt =
          servo->step(model, {.t = t, .position = settings.workspace.to_device(p), .velocity = {}});
      ++ticks;
      latched += (felt.flags & bit(ServoFault::Latched)) != 0 ? 1 : 0;
      touching += felt.contact ? 1 : 0;
      return felt;
    };
    const auto approach = [&](Vec3d first) {
      servo.emplace(settings, DeviceInfo{});
      from_outside(first, tick);
    };
    // A ball is held that much above the surface; points that push together have no one nearest point.
    const auto answer = [&](Vec3d p, bool coherent) -> std::optional<Nearest> {
      const ServoSample felt = tick(p, coherent);
      if (!felt.contact) return std::nullopt;
      return Nearest{felt.contact_point, felt.normal, held.tool.radius - felt.depth};
    };
    row(
        held.name, build_seconds, bytes, held.works, held.tool.points.empty() ? Answer(answer) : Answer(),
        [&](Vec3d p, bool coherent) { return length(tick(p, coherent).force); }, approach);
    json[held.name]["latched_share"] = static_cast<double>(latched) / static_cast<double>(ticks);
    json[held.name]["contact_share"] = static_cast<double>(touching) / static_cast<double>(ticks);
  }

  SlabId last = kNoSlab;
  of_a_query("the paper", build_seconds, bytes, [&](Vec3d p, bool coherent) -> std::optional<Nearest> {
    const auto at = paper::locate(model.slab_mesh(), p, coherent ? last : kNoSlab);
    if (!at) return std::nullopt;  // the contact is lost
    last = at->slab;
    const SurfacePoint there = surface_point(model, at->slab, at->u, at->v);
    const SlabCorners corners = model.slab_mesh().corners(at->slab);
    const Vec3d fibre =
        corners.point({1 - at->u - at->v, at->u, at->v}, 1) - corners.point({1 - at->u - at->v, at->u, at->v}, 0);
    return Nearest{there.position, there.normal, (at->alpha - there.alpha) * length(fibre)};
  });

  for (const auto& peer : make_peers(surface))
    of_a_query(peer->name, peer->build_seconds, peer->bytes,
               [&](Vec3d p, bool coherent) -> std::optional<Nearest> { return peer->nearest(p, coherent); });
  return json;
}

namespace {

constexpr std::array kWays = {"slide", "tap", "press", "jump"};

/// Percentiles of a row, and in which unit of the figures.
std::string four(const ordered_json& p, double unit) {
  std::string text;
  for (const char* which : {"p50", "p99", "p999", "max"}) {
    const double value = p[which].get<double>() / unit;
    text += fmt::format("{}{:.{}f}", text.empty() ? "" : "/", value, value < 10 ? 2 : 0);
  }
  return text;
}

/// Rows of cells under their headings, each column as wide as it must be.
std::string aligned(const std::vector<std::vector<std::string>>& rows) {
  std::vector<std::size_t> widths;
  for (const auto& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t k = 0; k < row.size(); ++k) widths[k] = std::max(widths[k], row[k].size());
  }
  std::string text;
  for (const auto& row : rows) {
    std::string line;
    for (std::size_t k = 0; k < row.size(); ++k) line += fmt::format("{:<{}}  ", row[k], widths[k]);
    text += "  " + line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
  }
  return text;
}

}  // namespace

std::string comparison_table(const ordered_json& on_surfaces) {
  using Table = std::vector<std::vector<std::string>>;
  const Table head = {{"", kWays[0], kWays[1], kWays[2], kWays[3]}};
  std::string text;
  for (const auto& [size, all] : on_surfaces.items()) {
    Table warm = head, cold = head, off = head;
    warm[0].insert(warm[0].end(), {"bytes/triangle", "build, CPU s"});
    for (const auto& [name, row] : all.items()) {
      if (!row.is_object()) continue;
      for (Table* table : {&warm, &cold}) table->push_back({name});
      for (const char* way : kWays) {
        warm.back().push_back(four(row["ns"][way]["warm_ns"], 1000));
        cold.back().push_back(four(row["ns"][way]["cold_ns"], 1000));
      }
      warm.back().push_back(fmt::format("{:.1f}", row["bytes_per_triangle"].get<double>()));
      warm.back().push_back(fmt::format("{:.1f}", row["build_cpu_seconds"].get<double>()));
      if (!row.contains("accuracy")) continue;
      off.push_back({name});
      for (const char* way : kWays) {
        const ordered_json &at = row["accuracy"][way], &distance = at["distance_error_of_diagonal"],
                           &normal = at["normal_degrees"];
        const int found = distance["count"].get<int>(), none = at["without_answer"].get<int>();
        off.back().push_back(fmt::format("{:.0e}/{:.0e} {:.1f}/{:.1f} {:.0f}", distance["p50"].get<double>(),
                                         distance["p99"].get<double>(), normal["p50"].get<double>(),
                                         normal["p99"].get<double>(), 100.0 * none / std::max(1, found + none)));
      }
    }
    text += fmt::format("\n{}, {} triangles. Warm, us: p50/p99/p99.9/max; build: once, for all ways\n", size,
                        all["triangles"].get<std::size_t>());
    text += aligned(warm) + "\nCold, us: p50/p99/p99.9/max\n" + aligned(cold);
    text += "\nOff the nearest point, of the diagonal: p50/p99; normal, degrees: p50/p99; frames without answer, %\n";
    text += aligned(off);
  }
  return text;
}

}  // namespace relief::bench
