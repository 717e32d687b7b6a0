#include <relief/base/assert.h>
#include <relief/core/query.h>
#include <relief/core/tessellate.h>

#include <algorithm>

namespace relief {

int level_count(int n) noexcept {
  int levels = 1;
  for (; n % 2 == 0; n /= 2) ++levels;
  return levels;
}

Tessellation tessellate(const Snapshot& model, int level) {
  const SlabMesh& mesh = model.slab_mesh();
  const bool coloured = model.has(Layer::Colour);
  const int step = 1 << level;
  Tessellation out;
  // Vertex numbers of each slab's coarse grid; a shared sample gets its number from the lowest slab that has it.
  std::vector<std::size_t> begin(mesh.slab_count() + std::size_t{1}, 0);
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    RELIEF_ASSERT(level >= 0 && level < level_count(mesh.intervals(s)));
    begin[s + 1] = begin[s] + sample_count(mesh.intervals(s) / step);
  }
  std::vector<std::uint32_t> number(begin.back());
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    const int n = mesh.intervals(s), coarse = n / step;
    const auto id = [&](GridPoint p) { return number[begin[s] + sample_index(coarse, p)]; };
    for (int j = 0; j <= coarse; ++j)
      for (int i = 0; i + j <= coarse; ++i) {
        SampleCopy owner;
        mesh.for_each_copy(s, coarse, {i, j}, [&](const SampleCopy& copy) {
          if (owner.slab == kNoSlab) owner = copy;
        });
        std::uint32_t& mine = number[begin[s] + sample_index(coarse, {i, j})];
        if (owner.slab != s) {
          mine = number[begin[owner.slab] + sample_index(coarse, owner.at)];
          continue;
        }
        mine = static_cast<std::uint32_t>(out.positions.size());
        const GridPoint fine = {i * step, j * step};
        out.positions.push_back(sample_position(model, s, fine));
        out.normals.push_back(to_float(sample_normal(model, s, fine)));
        if (coloured) out.colours.push_back(colour_at(model, s, double(i) / coarse, double(j) / coarse));
      }
    for (int j = 0; j < coarse; ++j)
      for (int i = 0; i + j < coarse; ++i) {
        out.triangles.push_back({id({i, j}), id({i + 1, j}), id({i, j + 1})});
        if (i + j + 1 < coarse) out.triangles.push_back({id({i + 1, j}), id({i + 1, j + 1}), id({i, j + 1})});
      }
  }
  return out;
}

}  // namespace relief
