#include "compare.h"

#include "paper/paper_algorithm.h"
#include "peers.h"
#include "timing.h"

#include <relief/core/query.h>
#include <relief/haptics/servo.h>
#include <relief/render/renderer.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

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
  return {{"slide", true, std::move(slide), whole}, std::move(tap), std::move(press), std::move(jump)};
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
        least[k] = std::min(least[k], timer([&] { sum += ask(work.cursors[k], work.coherent); }));
      }
    std::vector<double> cold;
    for (std::size_t k = 0; k < std::min<std::size_t>(500, work.cursors.size()); ++k) {
      if (approach && k % work.section == 0) approach(work.cursors[k]);
      for (std::size_t i = 0; i < other.size(); i += 64) ++other[i];
      cold.push_back(timer([&] { sum += ask(work.cursors[k], work.coherent); }));
    }
    json[work.name] = {{"warm_ns", percentiles(least, 1e9)}, {"cold_ns", percentiles(cold, 1e9)}};
  }
  json["check"] = std::isfinite(sum) ? sum : 0.0;
  return json;
}

/// Against the nearest point of the tessellation, exact in double.
ordered_json accuracy(const Snapshot& model, const std::function<Nearest(Vec3d)>& answer, const Workload& jump) {
  const double scale = diagonal(surface_bounds(model));
  std::vector<double> errors, angles;
  int wrong_side = 0;
  for (std::size_t k = 0; k < jump.cursors.size(); k += std::max<std::size_t>(1, jump.cursors.size() / 500)) {
    const Vec3d p = jump.cursors[k];
    const SurfacePoint truth = closest_point(model, p);
    const Nearest found = answer(p);
    const double distance = length(p - truth.position);
    errors.push_back(std::abs(std::abs(found.distance) - distance) / scale);
    angles.push_back(std::acos(std::clamp(dot(found.normal, truth.normal), -1.0, 1.0)) * 180 / std::numbers::pi);
    if (distance > 1e-6 * scale && (found.distance < 0) != (dot(p - truth.position, truth.normal) < 0)) ++wrong_side;
  }
  return {{"distance_error_of_diagonal", percentiles(errors, 1)},
          {"normal_degrees", percentiles(angles, 1)},
          {"wrong_side", wrong_side}};
}

/// The cage and the displacement, which is all that touch reads of a plain model.
std::size_t bytes_of(const Snapshot& model) {
  const SlabMesh& mesh = model.slab_mesh();
  std::size_t bytes = mesh.fibres().size_bytes() + mesh.slabs().size_bytes() + mesh.tree().size_bytes() +
                      mesh.tree_slabs().size_bytes() + mesh.slab_count() * sizeof(Box3d);
  for (SlabId s = 0; s < mesh.slab_count(); ++s) bytes += model.tile(Layer::Displacement, s).bytes();
  return bytes;
}

}  // namespace

ordered_json compare_on(const Snapshot& model, int frames) {
  const Tessellation surface = tessellate(model);
  const auto triangles = static_cast<double>(surface.triangles.size());
  const std::vector<Workload> works = workloads(model, frames);
  const Workload& jump = works.back();
  ordered_json json = {{"triangles", surface.triangles.size()}, {"frames", works.front().cursors.size()}};

  LocateHint hint;
  const auto probed = [&](Vec3d p) {
    const std::optional<Contact> at = probe(model, p, hint);
    if (!at) return Nearest{};
    const double depth = length(p - at->surface.position);
    return Nearest{at->surface.position, at->surface.normal, at->touching() ? -depth : depth};
  };
  json["relief tracked query"] = {{"bytes_per_triangle", static_cast<double>(bytes_of(model)) / triangles},
                                  {"accuracy", accuracy(model, probed, jump)},
                                  {"ns", times([&](Vec3d p, bool) { return probed(p).distance; }, works)}};
  json["relief closest point"] = {
      {"ns", times([&](Vec3d p, bool) { return length(closest_point(model, p).position - p); }, works)}};

  // A tick of the servo takes the cursors as a hand's way: it comes to each section from outside, and jumps are fast
  // moves within the device's limits.
  const double scale = diagonal(surface_bounds(model));
  const Vec3d centre = surface_bounds(model).centre();
  const ServoSettings settings = {.workspace = {.metres_per_unit = 0.15 / scale}};
  std::optional<Servo> servo;
  double t = 0;
  std::size_t ticks = 0, latched = 0;
  const auto tick = [&](Vec3d p, bool coherent) {
    t += coherent ? 1e-3 : 0.05;
    const ServoSample felt = servo->step(model, {.t = t, .position = settings.workspace.to_device(p), .velocity = {}});
    ++ticks;
    latched += (felt.flags & bit(ServoFault::Latched)) != 0 ? 1 : 0;
    return length(felt.force);
  };
  const auto approach = [&](Vec3d first) {
    servo.emplace(settings, DeviceInfo{});
    const Vec3d away = normalized(first - centre) * (0.3 * scale);
    for (int k = 0; k < 200; ++k) static_cast<void>(tick(first + away * (1 - k / 200.0), true));
  };
  ordered_json ns = times(tick, works, approach);
  json["relief servo tick"] = {{"latched_share", static_cast<double>(latched) / static_cast<double>(ticks)},
                               {"ns", std::move(ns)}};

  const std::vector<Workload> few = {
      {"slide", true, {works.front().cursors.begin(), works.front().cursors.begin() + 500}, 500}};
  json["the paper, slabs in sequence"] = {
      {"ns", times([&](Vec3d p, bool) { return paper::locate(model.slab_mesh(), p) ? 1.0 : 0.0; }, few)}};

  for (const auto& peer : make_peers(surface))
    json[peer->name] = {
        {"build_cpu_seconds", peer->build_seconds},
        {"bytes_per_triangle", static_cast<double>(peer->bytes) / triangles},
        {"accuracy", accuracy(
                         model, [&](Vec3d p) { return peer->nearest(p, false); }, jump)},
        {"ns", times([&](Vec3d p, bool coherent) { return peer->nearest(p, coherent).distance; }, works)}};
  return json;
}

}  // namespace relief::bench
