#include <relief/base/assert.h>
#include <relief/base/steps.h>
#include <relief/core/query.h>
#include <relief/core/tessellate.h>

#include <algorithm>

namespace relief {

int level_count(int n) noexcept {
  int levels = 1;
  for (; n % 2 == 0; n /= 2) ++levels;
  return levels;
}

int level_count(const SlabMesh& mesh) noexcept {
  int levels = 1;
  for (const Slab& slab : mesh.slabs()) levels = std::max(levels, level_count(slab.intervals));
  return levels;
}

int level_step(int n, int level) noexcept { return 1 << std::min(level, level_count(n) - 1); }

int level_step(const SlabMesh& mesh, SlabId s, int level) noexcept {
  const bool hangs = std::ranges::find(mesh.slabs()[s].shares, EdgeShare::Halves) != mesh.slabs()[s].shares.end();
  return 1 << std::min(level, level_count(mesh.intervals(s)) - (hangs ? 2 : 1));
}

Tessellation tessellate(const Snapshot& model, int level, const Progress& progress) {
  const SlabMesh& mesh = model.slab_mesh();
  RELIEF_ASSERT(level >= 0 && level < level_count(mesh));
  const bool coloured = model.has(Layer::Colour), holes = model.has(Layer::Void);
  const auto step_of = [&](SlabId s) { return level_step(mesh, s, level); };
  const auto coarse_of = [&](SlabId s) { return mesh.intervals(s) / step_of(s); };
  Tessellation out;
  Steps steps(progress, "surface", 2 * std::uint64_t{mesh.slab_count()});
  // Samples of each slab's coarse grid; a shared one belongs to the lowest slab that has it.
  std::vector<std::size_t> begin(mesh.slab_count() + std::size_t{1}, 0);
  for (SlabId s = 0; s < mesh.slab_count(); ++s) begin[s + 1] = begin[s] + sample_count(coarse_of(s));
  const auto owner_of = [&](SlabId s, GridPoint p) {
    SampleCopy owner;
    mesh.for_each_copy(s, coarse_of, p, [&](const SampleCopy& copy) {
      if (owner.slab == kNoSlab) owner = copy;
    });
    return static_cast<std::uint32_t>(begin[owner.slab] + sample_index(coarse_of(owner.slab), owner.at));
  };
  std::vector<bool> used(begin.back());
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    if (!steps.next()) return {};
    const int coarse = coarse_of(s), step = step_of(s);
    const std::array<int, 3> edges = mesh.edge_intervals(s, coarse_of);
    std::vector<std::uint32_t> owners;
    owners.reserve(sample_count(coarse));
    for (int j = 0; j <= coarse; ++j)
      for (int i = 0; i + j <= coarse; ++i) owners.push_back(owner_of(s, {i, j}));
    for_each_cell(coarse, edges, [&](const std::array<GridPoint, 3>& cell) {
      const auto fine = [&](GridPoint p) { return GridPoint{p.i * step, p.j * step}; };
      if (holes && model.is_hole(s, {fine(cell[0]), fine(cell[1]), fine(cell[2])})) return;
      std::array<std::uint32_t, 3>& triangle = out.triangles.emplace_back();
      for (std::size_t k = 0; k < 3; ++k) {
        triangle[k] = owners[sample_index(coarse, cell[k])];
        used[triangle[k]] = true;
      }
    });
  }
  // From samples to vertices.
  std::vector<std::uint32_t> number(begin.back());
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    if (!steps.next()) return {};
    const int coarse = coarse_of(s), step = step_of(s);
    std::size_t at = begin[s];
    for (int j = 0; j <= coarse; ++j)
      for (int i = 0; i + j <= coarse; ++i, ++at) {
        if (!used[at]) continue;
        number[at] = static_cast<std::uint32_t>(out.positions.size());
        const GridPoint fine = {i * step, j * step};
        out.positions.push_back(sample_position(model, s, fine));
        out.normals.push_back(to_float(sample_normal(model, s, fine)));
        if (coloured) out.colours.push_back(colour_at(model, s, double(i) / coarse, double(j) / coarse));
      }
  }
  for (auto& triangle : out.triangles)
    for (std::uint32_t& v : triangle) v = number[v];
  return out;
}

}  // namespace relief
