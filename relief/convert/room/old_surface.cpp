#include <relief/convert/room/old_surface.h>
#include <relief/core/query.h>

#include <algorithm>
#include <utility>

namespace relief::detail {

OldSurface::OldSurface(const Snapshot& surface, std::span<const SlabId> slabs) {
  const SlabMesh& mesh = surface.slab_mesh();
  std::vector<std::size_t> begin = {0};  // of each slab's samples
  for (const SlabId s : slabs) begin.push_back(begin.back() + sample_count(mesh.intervals(s)));
  std::vector<std::uint32_t> number(begin.back(), kNone);  // of the point that is first among a sample's copies
  const auto number_at = [&](std::size_t k, GridPoint p) -> std::uint32_t& {
    return number[begin[k] + sample_index(mesh.intervals(slabs[k]), p)];
  };
  const auto point_of = [&](std::size_t k, GridPoint p) {
    std::uint32_t& mine = number_at(k, p);
    if (mine != kNone) return mine;
    mesh.for_each_copy(slabs[k], p, [&](const SampleCopy& copy) {
      if (mine != kNone) return;
      const auto at = std::ranges::lower_bound(slabs, copy.slab);
      if (at != slabs.end() && *at == copy.slab)
        mine = number_at(static_cast<std::size_t>(at - slabs.begin()), copy.at);
    });
    if (mine != kNone) return mine;
    mine = static_cast<std::uint32_t>(points.size());
    points.push_back(sample_position(surface, slabs[k], p));
    return mine;
  };
  for (const bool holes : {false, true}) {
    if (holes) {
      phantom_from = faces.size();
      if (!surface.has(Layer::Void)) break;
    }
    for (std::size_t k = 0; k < slabs.size(); ++k)
      for_each_cell(mesh.intervals(slabs[k]), mesh.edge_intervals(slabs[k]), [&](const std::array<GridPoint, 3>& cell) {
        if (surface.is_hole(slabs[k], cell) != holes) return;
        faces.push_back({point_of(k, cell[0]), point_of(k, cell[1]), point_of(k, cell[2])});
        slab_of.push_back(slabs[k]);
        cell_of.push_back(cell);
      });
  }
}

SlabPlace OldSurface::place(const Snapshot& surface, std::uint32_t face,
                            const std::array<double, 3>& weights) const noexcept {
  const double n = surface.slab_mesh().intervals(slab_of[face]);
  SlabPlace place = {slab_of[face], 0, 0};
  for (std::size_t k = 0; k < 3; ++k) {
    place.u += weights[k] * cell_of[face][k].i / n;
    place.v += weights[k] * cell_of[face][k].j / n;
  }
  return place;
}

}  // namespace relief::detail
