#include <relief/convert/room/old_surface.h>
#include <relief/core/query.h>

#include <algorithm>
#include <cstdint>
#include <optional>

namespace relief::detail {

static_assert(kMaxIntervals < 256, "corners of cells are kept in bytes");

OldSurface::Triangles::Triangles(const Snapshot& surface, std::span<const SlabId> slabs) {
  add_points(surface, slabs);
  std::size_t most = 0;
  for (const SlabId s : slabs) {
    const auto n = static_cast<std::size_t>(surface.slab_mesh().intervals(s));
    most += n * n;
  }
  faces.reserve(most);
  slab_of.reserve(most);
  cell_of.reserve(most);
  add_faces(surface, slabs, false);
  phantom_from = faces.size();
  if (surface.has(Layer::Void)) add_faces(surface, slabs, true);
}

void OldSurface::Triangles::add_points(const Snapshot& surface, std::span<const SlabId> slabs) {
  const SlabMesh& mesh = surface.slab_mesh();
  begin_of = {0};
  for (const SlabId s : slabs) begin_of.push_back(begin_of.back() + sample_count(mesh.intervals(s)));
  number.resize(begin_of.back());
  points.reserve(begin_of.back());
  for (std::size_t k = 0; k < slabs.size(); ++k) {
    const SlabId s = slabs[k];
    const int n = mesh.intervals(s);
    const SampleField field = mesh.field(s);
    const float* const alpha = surface.displacement(s);
    // The lowest of the slabs that have a sample comes first.
    const auto earlier = [&](GridPoint p) -> std::optional<std::uint32_t> {
      std::optional<std::uint32_t> found;
      mesh.for_each_copy(s, p, [&](const SampleCopy& copy) {
        if (found || copy.slab >= s) return;
        const auto at = std::ranges::lower_bound(slabs, copy.slab);
        if (*at != copy.slab) return;
        found = number[begin_of[static_cast<std::size_t>(at - slabs.begin())] +
                       sample_index(mesh.intervals(copy.slab), copy.at)];
      });
      return found;
    };
    std::size_t index = begin_of[k];
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i + j <= n; ++i, ++index) {
        const bool inside = i > 0 && j > 0 && i + j < n;
        const std::optional<std::uint32_t> known = inside ? std::nullopt : earlier({i, j});
        number[index] = known.value_or(static_cast<std::uint32_t>(points.size()));
        if (!known) points.push_back(field.point(n, {i, j}, double{alpha[index - begin_of[k]]}));
      }
  }
}

void OldSurface::Triangles::add_faces(const Snapshot& surface, std::span<const SlabId> slabs, bool holes) {
  const SlabMesh& mesh = surface.slab_mesh();
  const auto byte = [](int place) { return static_cast<std::uint8_t>(place); };
  for (std::size_t k = 0; k < slabs.size(); ++k) {
    const int n = mesh.intervals(slabs[k]);
    const std::uint32_t* const numbers = &number[begin_of[k]];
    const float* const voids = surface.has(Layer::Void) ? surface.tile(Layer::Void, slabs[k]).plane() : nullptr;
    for_each_cell(n, mesh.edge_intervals(slabs[k]), [&](const std::array<GridPoint, 3>& cell) {
      const std::size_t a = sample_index(n, cell[0]), b = sample_index(n, cell[1]), c = sample_index(n, cell[2]);
      if (voids != nullptr && is_hole(voids[a], voids[b], voids[c]) != holes) return;
      faces.push_back({numbers[a], numbers[b], numbers[c]});
      slab_of.push_back(slabs[k]);
      cell_of.push_back(
          {byte(cell[0].i), byte(cell[0].j), byte(cell[1].i), byte(cell[1].j), byte(cell[2].i), byte(cell[2].j)});
    });
  }
}

OldSurface::OldSurface(const Snapshot& surface, std::span<const SlabId> slabs, const Lattice& lattice)
    : surface_(surface), triangles_(surface, slabs), rays_(triangles_.points, triangles_.faces, lattice) {}

SlabPlace OldSurface::place(std::uint32_t face, const std::array<double, 3>& weights) const noexcept {
  const SlabId slab = triangles_.slab_of[face];
  const double n = surface_.slab_mesh().intervals(slab);
  SlabPlace place = {slab, 0, 0};
  for (std::size_t k = 0; k < 3; ++k) {
    place.u += weights[k] * triangles_.cell_of[face][2 * k] / n;
    place.v += weights[k] * triangles_.cell_of[face][2 * k + 1] / n;
  }
  return place;
}

}  // namespace relief::detail
