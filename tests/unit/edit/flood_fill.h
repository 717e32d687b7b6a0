// The paper's own way (Sec. 4 and 5), in double: a flood fill from sample to sample. Slow and plain; the reference for
// the tile kernels.
#pragma once

#include <relief/edit/editor.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

namespace relief::testing {

/// New values of a one-channel layer: per slab, per sample.
using Values = std::vector<std::vector<double>>;

inline Values values_of(const Snapshot& model, Layer layer, int channel = 0) {
  Values all;
  for (SlabId s = 0; s < model.slab_mesh().slab_count(); ++s) {
    const Tile& tile = model.tile(layer, s);
    std::vector<double>& values = all.emplace_back();
    for (std::size_t k = 0; k < tile.size(); ++k) values.push_back(double(tile.value(channel, k)));
  }
  return all;
}

/// Starts at the sample of `seed` nearest to `from` and walks to neighbouring samples as long as `change(slab, at)`
/// gives a value; sets that value in all copies. `grid(slab)` is the n of the layer's tile.
template <typename GridOf, typename Change>
void flood_fill(const Snapshot& model, SlabId seed, Vec3d from, const GridOf& grid, const Change& change,
                Values& values) {
  const SlabMesh& mesh = model.slab_mesh();
  std::vector<std::vector<bool>> visited;
  for (const auto& tile : values) visited.emplace_back(tile.size());
  GridPoint nearest;
  double least = std::numeric_limits<double>::infinity();
  const int n = grid(seed);
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i + j <= n; ++i) {
      const double alpha = displacement_at(model, seed, double(i) / n, double(j) / n);
      const double d = length(sample_position(mesh, seed, n, {i, j}, alpha) - from);
      if (d < least) {
        least = d;
        nearest = {i, j};
      }
    }
  std::vector<SampleCopy> waiting = {{seed, nearest}};
  while (!waiting.empty()) {
    const SampleCopy at = waiting.back();
    waiting.pop_back();
    if (visited[at.slab][sample_index(grid(at.slab), at.at)]) continue;
    const std::optional<double> value = change(at.slab, at.at);
    mesh.for_each_copy(at.slab, grid, at.at, [&](SampleCopy copy) {
      const int m = grid(copy.slab);
      visited[copy.slab][sample_index(m, copy.at)] = true;
      if (!value) return;
      values[copy.slab][sample_index(m, copy.at)] = *value;
      for (const auto& [di, dj] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, -1}, {-1, 1}}) {
        const GridPoint next = {copy.at.i + di, copy.at.j + dj};
        if (next.i >= 0 && next.j >= 0 && next.i + next.j <= m) waiting.push_back({copy.slab, next});
      }
    });
  }
}

/// The displacement after a carve or deposit dab.
inline Values reference_displacement(const Snapshot& model, const Brush& brush, const Dab& dab) {
  const SlabMesh& mesh = model.slab_mesh();
  Values values = values_of(model, Layer::Displacement);
  const Vec3d centre = dab.cursor + dab.normal * (brush.radius + brush.resilience);
  const auto grid = [&](SlabId s) { return mesh.intervals(s); };
  const auto change = [&](SlabId s, GridPoint at) -> std::optional<double> {
    const int n = mesh.intervals(s);
    const double d = double(model.displacement(s)[sample_index(n, at)]);
    const Vec3d inner = sample_position(mesh, s, n, at, 0), outer = sample_position(mesh, s, n, at, 1);
    const Vec3d along = outer - inner;
    if (brush.tool == Tool::Deposit) {
      const double distance = length(inner + along * d - dab.contact);
      if (distance >= brush.radius) return std::nullopt;
      const double thickness = brush.strength * brush.radius * dab.seconds * (1 - distance / brush.radius);
      return std::min(1.0, d + thickness / length(along));
    }
    const double middle = dot(centre - inner, along) / dot(along, along);
    const Vec3d foot = inner + along * middle - centre;
    const double half2 = (brush.radius * brush.radius - dot(foot, foot)) / dot(along, along);
    if (half2 < 0 || middle + std::sqrt(half2) < 0 || middle - std::sqrt(half2) >= d) return std::nullopt;
    return std::max(0.0, middle - std::sqrt(half2));
  };
  flood_fill(model, dab.slab, dab.contact, grid, change, values);
  for (SlabId s = 0; s < mesh.slab_count(); ++s)
    mesh.for_each_constrained(s, [&](GridPoint p, const EdgePlace& place) {
      const auto value = [&](GridPoint q) -> double& { return values[s][sample_index(mesh.intervals(s), q)]; };
      value(p) = value(place.before) + (value(place.after) - value(place.before)) * place.k / place.r;
    });
  return values;
}

/// One channel of the colour after a paint dab; the model has a colour layer.
inline Values reference_colour(const Snapshot& model, const Brush& brush, const Dab& dab, int channel) {
  const SlabMesh& mesh = model.slab_mesh();
  Values values = values_of(model, Layer::Colour, channel);
  const auto grid = [&](SlabId s) { return model.tile(Layer::Colour, s).intervals(); };
  const auto change = [&](SlabId s, GridPoint at) -> std::optional<double> {
    const int m = grid(s);
    const double alpha = displacement_at(model, s, double(at.i) / m, double(at.j) / m);
    const double distance = length(sample_position(mesh, s, m, at, alpha) - dab.contact);
    if (distance >= brush.radius) return std::nullopt;
    const double share = brush.strength * dab.pressure * (1 - distance / brush.radius);
    const double old = double(model.tile(Layer::Colour, s).value(channel, sample_index(m, at)));
    return double(brush.colour[static_cast<std::size_t>(channel)]) * share + old * (1 - share);
  };
  flood_fill(model, dab.slab, dab.contact, grid, change, values);
  return values;
}

}  // namespace relief::testing
