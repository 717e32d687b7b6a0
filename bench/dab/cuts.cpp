#include "cuts.h"

#include "strokes.h"
#include "support/shells.h"

#include <relief/base/try.h>
#include <relief/convert/convert.h>
#include <relief/core/detail.h>
#include <relief/core/query.h>
#include <relief/edit/editor.h>
#include <relief/mesh/samples.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

namespace relief::bench {

namespace {

using nlohmann::ordered_json;

constexpr std::array kRatios = {6, 12, 25};  ///< radii of the ball, in spacings of samples
constexpr double kDepth = 0.6;               ///< of the ball's radius
constexpr double kBall = 0.005;              ///< of the diagonal: the ball that must come out right anywhere
constexpr int kAngles = 180, kCurves = 9;    ///< along the rim, and from one spacing inside it to one outside
constexpr std::size_t kRippleAngles = 15;    ///< of kAngles: ripple is what differs from the mean over so many each way
constexpr double kDegree = std::numbers::pi / 180;

/// A ball that goes into a surface.
struct Ball {
  Vec3d contact, axis, centre;
  double radius, depth;
  Ball(const SurfacePoint& at, double r)
      : contact(at.position),
        axis(at.normal),
        centre(at.position + at.normal * (r * (1 - kDepth))),
        radius(r),
        depth(kDepth * r) {}
  /// Along the axis, of its lower half; `aside` squared, from the axis.
  [[nodiscard]] double bottom(double square) const noexcept {
    return dot(centre - contact, axis) - std::sqrt(std::max(radius * radius - square, 0.0));
  }
};

struct Vertex {
  Vec3d position, normal;
};
/// The triangles of a surface around the ball.
using Patch = std::vector<std::array<Vertex, 3>>;

Patch patch_of(const Snapshot& model, const Ball& ball, double reach) {
  const SlabMesh& mesh = model.slab_mesh();
  Patch patch;
  std::vector<Vertex> samples;
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    if (mesh.box(s).distance2(ball.contact) > reach * reach) continue;
    const int n = mesh.intervals(s);
    const auto near = [&](GridPoint p) { return length(sample_position(model, s, p) - ball.contact) <= reach; };
    samples.assign(sample_count(n), {});
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i + j <= n; ++i)
        if (near({i, j}))
          samples[sample_index(n, {i, j})] = {sample_position(model, s, {i, j}), sample_normal(model, s, {i, j})};
    const auto add = [&](GridPoint a, GridPoint b, GridPoint c) {
      if (near(a) && near(b) && near(c))
        patch.push_back({samples[sample_index(n, a)], samples[sample_index(n, b)], samples[sample_index(n, c)]});
    };
    for (int j = 0; j < n; ++j)
      for (int i = 0; i + j < n; ++i) {
        add({i, j}, {i + 1, j}, {i, j + 1});
        if (i + j + 1 < n) add({i + 1, j}, {i + 1, j + 1}, {i, j + 1});
      }
  }
  return patch;
}

/// The patch as a mesh whose vertices inside the ball go down along the axis to where it ends.
Patch clipped(Patch patch, const Ball& ball) {
  std::map<std::array<double, 3>, Vec3d> normals;  // by where a vertex was
  const auto key = [](Vec3d p) { return std::array{p.x, p.y, p.z}; };
  for (auto& triangle : patch) {
    std::array<std::array<double, 3>, 3> keys;
    for (std::size_t k = 0; k < 3; ++k) {
      Vec3d& p = triangle[k].position;
      keys[k] = key(p);
      const Vec3d off = p - ball.contact;
      const double high = dot(off, ball.axis), bottom = ball.bottom(dot(off, off) - high * high);
      if (length(p - ball.centre) < ball.radius) p += ball.axis * (bottom - high);
    }
    const Vec3d area = cross(triangle[1].position - triangle[0].position, triangle[2].position - triangle[0].position);
    for (const auto& each : keys) normals[each] += area;
    for (std::size_t k = 0; k < 3; ++k) triangle[k].normal = {keys[k][0], keys[k][1], keys[k][2]};
  }
  for (auto& triangle : patch)
    for (Vertex& v : triangle) v.normal = normalized(normals[key(v.normal)]);
  return patch;
}

/// Heights over the plane through the contact across the axis.
class Heights {
 public:
  Heights(const Patch& patch, const Ball& ball, double cell)
      : patch_(patch), ball_(ball), side_(aside(ball.axis)), ahead_(cross(ball.axis, side_)), cell_(cell) {
    for (std::size_t t = 0; t < patch.size(); ++t) {
      const auto [low, high] = cells_of(patch[t]);
      for (int y = low.second; y <= high.second; ++y)
        for (int x = low.first; x <= high.first; ++x) at_[{x, y}].push_back(t);
    }
  }
  [[nodiscard]] Vec3d place(double distance, double angle) const {
    return ball_.contact + (side_ * std::cos(angle) + ahead_ * std::sin(angle)) * distance;
  }
  struct Hit {
    double height = 0;
    Vec3d position, normal;
  };
  /// The highest above or below a place; empty beyond the patch.
  [[nodiscard]] std::optional<Hit> above(Vec3d p) const {
    const auto found = at_.find(cell(p));
    if (found == at_.end()) return std::nullopt;
    std::optional<Hit> best;
    for (const std::size_t t : found->second) {
      const auto& [a, b, c] = patch_[t];
      const auto across = [&](Vec3d u, Vec3d v) { return dot(cross(u - p, v - p), ball_.axis); };
      const double all = dot(cross(b.position - a.position, c.position - a.position), ball_.axis);
      const double wa = across(b.position, c.position) / all, wb = across(c.position, a.position) / all,
                   wc = 1 - wa - wb;
      constexpr double kOnEdge = -1e-9;
      if (!(wa >= kOnEdge && wb >= kOnEdge && wc >= kOnEdge)) continue;
      const Vec3d at = a.position * wa + b.position * wb + c.position * wc;
      const double height = dot(at - ball_.contact, ball_.axis);
      if (!best || height > best->height)
        best = Hit{height, at, normalized(a.normal * wa + b.normal * wb + c.normal * wc)};
    }
    return best;
  }

 private:
  using Cell = std::pair<int, int>;
  [[nodiscard]] Cell cell(Vec3d p) const {
    return {static_cast<int>(std::floor(dot(p - ball_.contact, side_) / cell_)),
            static_cast<int>(std::floor(dot(p - ball_.contact, ahead_) / cell_))};
  }
  [[nodiscard]] std::pair<Cell, Cell> cells_of(const std::array<Vertex, 3>& triangle) const {
    Cell low = cell(triangle[0].position), high = low;
    for (const Vertex& v : triangle) {
      const Cell at = cell(v.position);
      low = {std::min(low.first, at.first), std::min(low.second, at.second)};
      high = {std::max(high.first, at.first), std::max(high.second, at.second)};
    }
    return {low, high};
  }

  const Patch& patch_;
  const Ball& ball_;
  Vec3d side_, ahead_;
  double cell_;
  std::map<Cell, std::vector<std::size_t>> at_;
};

/// How far a cut surface is from the true one, model units and degrees.
struct Error {
  double rms = 0, max = 0, ripple = 0, ripple_degrees = 0;
  double limited = 0;  ///< samples that would have gone beyond the clay
};

/// A ball and the surface that it goes into.
class Cut {
 public:
  Cut(const Snapshot& start, const Ball& ball, double spacing)
      : start_(start),
        ball_(ball),
        spacing_(spacing),
        reach_(ball.radius + 6 * spacing),
        before_(patch_of(start, ball, reach_)),
        heights_(before_, ball_, spacing) {
    for (int k = 0; k < kAngles; ++k) rim_.push_back(rim_at(angle(k)));
  }
  Cut(const Cut&) = delete;
  Cut& operator=(const Cut&) = delete;

  [[nodiscard]] Error by_tool(const SnapshotPtr& start, const SurfacePoint& at, bool exact) const {
    Editor editor(start);
    editor.begin_stroke({.tool = Tool::Carve, .radius = ball_.radius, .detail = 0, .exact = exact});
    editor.dab({.slab = at.slab,
                .contact = at.position,
                .cursor = at.position - ball_.axis * ball_.depth,
                .normal = ball_.axis});
    const StrokeResult result = editor.end_stroke();
    Error error = error_of(patch_of(*editor.head(), ball_, reach_));
    error.limited = static_cast<double>(result.limited);
    return error;
  }
  [[nodiscard]] Error on_plain_mesh() const { return error_of(clipped(before_, ball_)); }

 private:
  static double angle(int k) { return 2 * std::numbers::pi * k / kAngles; }

  /// How far from the axis the surface leaves the ball, in one direction.
  [[nodiscard]] double rim_at(double angle) const {
    double in = 0, out = ball_.radius;
    for (int k = 0; k < 40; ++k) {
      const double middle = (in + out) / 2;
      const auto hit = heights_.above(heights_.place(middle, angle));
      (hit && length(hit->position - ball_.centre) < ball_.radius ? in : out) = middle;
    }
    return in;
  }

  /// From what the ball leaves of the solid.
  [[nodiscard]] double distance(Vec3d p, PickHint& hint) const {
    const SurfacePoint near = closest_point(start_, p, hint);
    const double above = std::copysign(length(p - near.position), dot(p - near.position, near.normal));
    return std::abs(std::max(above, ball_.radius - length(p - ball_.centre)));
  }

  [[nodiscard]] Error error_of(const Patch& after) const {
    Error error;
    PickHint hint;
    double sum = 0, weight = 0;
    const double widest = *std::ranges::max_element(rim_) + spacing_;
    constexpr int kParts = 4;  // along each edge of a triangle
    for (const auto& [a, b, c] : after) {
      const Vec3d u = (b.position - a.position) / kParts, v = (c.position - a.position) / kParts;
      const double area = length(cross(u, v));
      for (int j = 0; j < kParts; ++j)
        for (int i = 0; i + j < kParts; ++i)
          for (const double third : {1.0 / 3, 2.0 / 3}) {
            if (third > 0.5 && i + j + 1 == kParts) continue;
            const Vec3d p = a.position + u * (i + third) + v * (j + third), off = p - ball_.contact;
            if (length(off - ball_.axis * dot(off, ball_.axis)) > widest) continue;
            const double far = distance(p, hint);
            sum += area * far * far;
            weight += area;
            error.max = std::max(error.max, far);
          }
    }
    error.rms = std::sqrt(sum / std::max(weight, 1e-300));
    find_ripple(after, error);
    return error;
  }

  /// Of the mean over an angle each way, about half a radius along the rim: what differs from it is ripple. A blend is
  /// as wide as the samples are far apart and as its edge is sharp, and where these change slowly along the rim, so
  /// does its depth: that is no ripple, and the rms has it.
  template <typename T>
  static T mean_around(const std::vector<T>& values, std::size_t at) {
    T sum{};
    for (std::size_t k = at + values.size() - kRippleAngles; k <= at + values.size() + kRippleAngles; ++k)
      sum += values[k % values.size()];
    return sum / (2.0 * kRippleAngles + 1);
  }

  /// Along curves beside the rim: how much height and normal vary, less those of the true surface, seen from the axis.
  /// Heights are those across the surface: where it slopes away from the axis, one along it would be far more.
  void find_ripple(const Patch& after, Error& error) const {
    const Heights now(after, ball_, spacing_);
    double heights = 0, turns = 0;
    int taken = 0;
    for (int curve = 0; curve < kCurves; ++curve) {
      const double beside = spacing_ * (2.0 * curve / (kCurves - 1) - 1);
      std::vector<double> off;
      std::vector<Vec3d> turns_of;
      for (int k = 0; k < kAngles; ++k) {
        const double from_axis = rim_[static_cast<std::size_t>(k)] + beside;
        const Vec3d p = heights_.place(from_axis, angle(k));
        const auto hit = now.above(p), before = heights_.above(p);
        if (!hit || !before || !(from_axis > 0)) continue;
        const bool in_ball = beside < 0;
        const double height = in_ball ? ball_.bottom(from_axis * from_axis) : before->height;
        off.push_back((hit->height - height) * dot(before->normal, ball_.axis));
        const Vec3d truth = in_ball ? (ball_.centre - p - ball_.axis * height) / ball_.radius : before->normal;
        const Vec3d outwards = (p - ball_.contact) / from_axis, along = cross(ball_.axis, outwards);
        const Vec3d turn = hit->normal - truth;
        turns_of.push_back({dot(turn, outwards), dot(turn, along), dot(turn, ball_.axis)});
      }
      if (off.size() <= 2 * kRippleAngles) continue;
      ++taken;
      const double share = 1.0 / static_cast<double>(off.size());
      for (std::size_t k = 0; k < off.size(); ++k) {
        const double uneven = off[k] - mean_around(off, k);
        const Vec3d turned = turns_of[k] - mean_around(turns_of, k);
        heights += uneven * uneven * share;
        turns += dot(turned, turned) * share / (kDegree * kDegree);
      }
    }
    // No curve, no figure: one that misses every goal.
    const double none = std::numeric_limits<double>::infinity();
    error.ripple = taken > 0 ? std::sqrt(heights / taken) : none;
    error.ripple_degrees = taken > 0 ? std::sqrt(turns / taken) : none;
  }

  const Snapshot& start_;
  Ball ball_;
  double spacing_, reach_;
  Patch before_;
  Heights heights_;
  std::vector<double> rim_;
};

/// A model that is cut, and where.
struct Subject {
  std::string name;
  SnapshotPtr model;
  std::vector<SurfacePoint> places;
};

/// Of the samples of a slab, where the surface is: mean over its edges.
double spacing_at(const Snapshot& model, SlabId s) {
  const int n = model.slab_mesh().intervals(s);
  const std::array<Vec3d, 3> corners = {sample_position(model, s, {0, 0}), sample_position(model, s, {n, 0}),
                                        sample_position(model, s, {0, n})};
  double sum = 0;
  for (std::size_t k = 0; k < 3; ++k) sum += length(corners[(k + 1) % 3] - corners[k]);
  return sum / 3 / n;
}

/// Of each the root of the mean square over some places, in units of `unit`; of `max` the greatest, of `limited` the
/// sum.
class Errors {
 public:
  void add(const Error& error, double unit) {
    ++count_;
    sum_.rms += error.rms * error.rms / (unit * unit);
    sum_.ripple += error.ripple * error.ripple / (unit * unit);
    sum_.ripple_degrees += error.ripple_degrees * error.ripple_degrees;
    sum_.max = std::max(sum_.max, error.max / unit);
    sum_.limited += error.limited;
  }
  [[nodiscard]] Error mean() const {
    return {std::sqrt(sum_.rms / count_), sum_.max, std::sqrt(sum_.ripple / count_),
            std::sqrt(sum_.ripple_degrees / count_), sum_.limited};
  }

 private:
  Error sum_;
  double count_ = 0;
};

void cut_at_ratios(const Subject& subject, ordered_json& figures) {
  for (const int ratio : kRatios) {
    std::array<std::pair<const char*, Errors>, 3> all = {{{"exact", {}}, {"blended", {}}, {"plain mesh", {}}}};
    for (const SurfacePoint& at : subject.places) {
      const double spacing = spacing_at(*subject.model, at.slab);
      const Cut cut(*subject.model, {at, ratio * spacing}, spacing);
      all[0].second.add(cut.by_tool(subject.model, at, true), spacing);
      all[1].second.add(cut.by_tool(subject.model, at, false), spacing);
      all[2].second.add(cut.on_plain_mesh(), spacing);
    }
    for (const auto& [how, errors] : all) {
      const Error error = errors.mean();
      ordered_json made = figure(fmt::format("ball cut, r/h = {}, {}, rms", ratio, how), subject.name, error.rms,
                                 "spacings", {}, "none");
      made["more"] = {{"max", error.max},
                      {"rim ripple", error.ripple},
                      {"rim ripple, degrees", error.ripple_degrees},
                      {"limited", error.limited}};
      figures.push_back(std::move(made));
    }
  }
}

void cut_small_ball(const Subject& subject, double diagonal, ordered_json& figures) {
  Errors blended, exact;
  std::vector<double> ratios;
  const double radius = kBall * diagonal, depth = kDepth * radius;
  for (const SurfacePoint& at : subject.places) {
    const double spacing = spacing_at(*subject.model, at.slab);
    ratios.push_back(radius / spacing);
    const Cut cut(*subject.model, {at, radius}, spacing);
    blended.add(cut.by_tool(subject.model, at, false), depth);
    exact.add(cut.by_tool(subject.model, at, true), depth);
  }
  ordered_json made = figure("ball of 0.5 % of the diagonal, rms of its depth", subject.name, 100 * blended.mean().rms,
                             "%", at_most(5), "none");
  made["more"] = {
      {"exact", 100 * exact.mean().rms}, {"r/h, median", median(ratios)}, {"limited", blended.mean().limited}};
  figures.push_back(std::move(made));
}

int places_of(Extent extent) { return extent == Extent::Form ? 1 : extent == Extent::Long ? 8 : 3; }

/// Surfaces without detail of their own.
std::vector<Subject> even_subjects(Extent extent) {
  const int n = extent == Extent::Form ? 8 : 32, places = places_of(extent);
  std::vector<Subject> subjects;
  {
    // Equal sides: the two directions of the sheet's grid and their sum.
    const auto sheet = testing::mapped_shell(*testing::plane_shell(8, n, 0.25), [](Vec3d p) {
      return Vec3d{p.x - p.z / 2, p.y, p.z * std::numbers::sqrt3 / 2};
    });
    Subject flat = {.name = "flat sheet", .model = Snapshot::make(sheet), .places = {}};
    for (int k = 0; k < places; ++k)
      flat.places.push_back(closest_point(*flat.model, {0.25 + 0.0137 * k, 0, 0.433 + 0.0071 * k}));
    subjects.push_back(std::move(flat));
  }
  {
    // Samples exactly on the unit sphere: a fibre is longer than its share towards the middle of a slab.
    const auto shell = testing::icosphere_shell(2, n, 0.7, 1.3);
    const auto share = [](Vec3d p) { return 0.5 + (1 - length(p)) / (0.6 * length(p)); };
    Subject sphere = {.name = "sphere", .model = testing::displaced(shell, share), .places = {}};
    for (int k = 0; k < places; ++k)
      sphere.places.push_back(closest_point(*sphere.model, {std::cos(2.4 * k), 0.3 * k - 1, std::sin(2.4 * k)}));
    subjects.push_back(std::move(sphere));
  }
  return subjects;
}

SnapshotPtr with_half_the_spacing(const SnapshotPtr& model) {
  Detail detail;
  for (SlabId s = 0; s < model->slab_mesh().slab_count(); ++s)
    detail.grids.push_back({Layer::Displacement, s, 2 * model->slab_mesh().intervals(s)});
  return *with_detail(model, detail);
}

}  // namespace

Result<ordered_json> measure_cuts(Extent extent) {
  const bool form = extent == Extent::Form;
  std::vector<Subject> subjects = even_subjects(extent);
  ordered_json figures = ordered_json::array();
  RELIEF_TRY(const TriangleMesh mesh, make_sample("pumpkin", form ? 4'000 : 100'000));
  RELIEF_TRY(const Conversion made, form ? convert(mesh, {.slabs = 60, .intervals = 8}) : convert(mesh, {}));
  Subject pumpkin = {.name = "pumpkin", .model = made.model.head, .places = {}};
  const double size = made.model.info.source_diagonal;
  for (int k = 0; k < places_of(extent); ++k) {
    const Vec3d way = {std::cos(2.4 * k + 0.4), 0.5 - 0.2 * k, std::sin(2.4 * k + 0.4)};
    pumpkin.places.push_back(
        closest_point(*pumpkin.model, pumpkin.model->slab_mesh().bounds().centre() + way * (0.5 * size)));
  }
  subjects.push_back(std::move(pumpkin));
  for (const Subject& subject : subjects) cut_at_ratios(subject, figures);
  cut_small_ball(subjects.back(), size, figures);
  return figures;
}

ordered_json measure_rims(Extent extent) {
  constexpr int kSpacings = 12;
  ordered_json figures = ordered_json::array();
  for (const Subject& subject : even_subjects(extent)) {
    Errors errors;
    const SnapshotPtr halved = with_half_the_spacing(subject.model);
    for (const SurfacePoint& at : subject.places) {
      const double spacing = spacing_at(*subject.model, at.slab);
      const Cut cut(*halved, {at, kSpacings * spacing}, spacing);
      errors.add(cut.by_tool(halved, at, false), spacing);
    }
    const Error error = errors.mean();
    const std::string rim = "rim of a ball of 12 spacings, spacing halved, ";
    ordered_json height = figure(rim + "height ripple", subject.name, error.ripple, "spacings", at_most(0.015), "none");
    height["more"] = {{"rms", error.rms}, {"max", error.max}};
    figures.push_back(std::move(height));
    figures.push_back(
        figure(rim + "normal ripple", subject.name, error.ripple_degrees, "degrees", at_most(0.9), "none"));
  }
  return figures;
}

}  // namespace relief::bench
