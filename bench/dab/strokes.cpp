#include "strokes.h"

#include "../timing.h"

#include <algorithm>
#include <cmath>

namespace relief::bench {

using nlohmann::ordered_json;

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

void Rounds::add(const Dabs& dabs) {
  times_.push_back(bench::percentiles(dabs.seconds, 1e6));
  times_.back().erase("count");
  middles_.push_back(times_.back()["p50"].get<double>());
  samples_.push_back(median(dabs.samples));
  ends_.push_back(median(dabs.ends) * 1e6);
}

ordered_json Rounds::percentiles() const {
  ordered_json all;
  for (const auto& [which, first] : times_.front().items()) {
    std::vector<double> values;
    for (const ordered_json& round : times_) values.push_back(round[which].get<double>());
    all[which] = median(values);
  }
  return all;
}

Sized find_radius(double wanted, double guess, const std::function<double(double)>& samples_at) {
  Sized best;
  double radius = guess;
  for (int k = 0; k < 8; ++k) {
    const double samples = samples_at(radius);
    if (std::abs(samples - wanted) <= std::abs(best.samples - wanted)) best = {radius, samples};
    if (std::abs(samples - wanted) < 0.02 * wanted) break;
    // Samples grow with the square of the radius.
    radius *= std::clamp(std::sqrt(wanted / std::max(samples, 1.0)), 0.25, 2.0);
  }
  return best;
}

Brush brush_of(Tool tool, double radius) {
  return {.tool = tool, .radius = radius, .detail = 0, .strength = 0.3, .colour = {0.8F, 0.2F, 0.1F}};
}

Vec3d aside(Vec3d normal) noexcept {
  return normalized(cross(normal, std::abs(normal.x) < 0.6 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0}));
}

SurfacePoint place_of(const Snapshot& model, const SurfacePoint& start, Tool tool, double radius, int k,
                      PickHint& hint) {
  if (tool == Tool::Carve) return start;
  return closest_point(model, start.position + aside(start.normal) * (radius / 16 * k), hint);
}

SnapshotPtr with_layer(const SnapshotPtr& model, Tool tool, const SurfacePoint& somewhere) {
  const Layer layer = info(tool).writes;
  if (model->has(layer)) return model;
  const bool takes_away = tool == Tool::Unmask;
  Editor editor(model);
  editor.begin_stroke(brush_of(takes_away ? Tool::Mask : tool, 0.01 * diagonal(model->slab_mesh().bounds())));
  editor.dab({.slab = somewhere.slab,
              .contact = somewhere.position,
              .cursor = somewhere.position,
              .normal = somewhere.normal,
              .seconds = kDabSeconds});
  editor.end_stroke();
  if (!takes_away) return editor.head();
  SnapshotDraft full(model);
  full.add_layer(layer, editor.head()->tile(layer, 0).intervals(), 1);
  return full.finish();
}

Dabs run_strokes(const SnapshotPtr& model, std::span<const SurfacePoint> starts, Tool tool, double radius, int dabs) {
  const CallTimer timer;
  const bool carves = tool == Tool::Carve;
  Editor editor(model);
  std::vector<SnapshotPtr> history;
  SnapshotPtr reader = editor.head();
  Dabs all;
  for (const SurfacePoint& start : starts) {
    history.push_back(editor.head());
    editor.begin_stroke(brush_of(tool, radius));
    PickHint hint;
    for (int k = 0; k < dabs; ++k) {
      const SurfacePoint at = place_of(*model, start, tool, radius, k, hint);
      const double depth = radius * (kCarveDepth + kCarveSinks * k);
      const Dab dab = {
          .slab = at.slab,
          .contact = info(tool).writes == Layer::Displacement ? editor.position(at.slab, at.u, at.v) : at.position,
          .cursor = at.position - at.normal * (carves ? depth : 0.0),
          .normal = at.normal,
          .seconds = kDabSeconds};
      DabResult result;
      all.seconds.push_back(timer([&] {
        result = editor.dab(dab);
        reader = editor.head();
      }));
      all.samples.push_back(static_cast<double>(result.samples));
    }
    all.ends.push_back(timer([&] { editor.end_stroke(); }));
  }
  return all;
}

}  // namespace relief::bench
