// The same surface on a cage with two roots halved: for tests of what goes on across such a change.
#pragma once

#include <relief/core/detail.h>
#include <relief/core/room.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <memory>
#include <utility>
#include <vector>

namespace relief::testing {

struct Halved {
  SnapshotPtr model;
  HalvedRoots roots;
};

/// Halves a root of a closed model without cuts in the middle of its edge 0, and the one across. Grids keep their
/// intervals.
inline Halved halved(const SnapshotPtr& model, SlabId root) {
  const SlabMesh& mesh = model->slab_mesh();
  const SlabId other = mesh.slabs()[root].neighbours[0];
  const auto first = static_cast<SlabId>(mesh.roots().size());
  std::vector<Fibre> fibres(mesh.root_fibres().begin(), mesh.root_fibres().end());
  std::vector<SlabMesh::Face> faces;
  std::vector<RootPlace> origins;
  for (SlabId s = 0; s < first; ++s) {
    faces.push_back({mesh.slabs()[s].fibres, mesh.intervals(s)});
    origins.push_back({.root = s});
  }
  const auto middle = static_cast<FibreId>(fibres.size());
  const Fibre &b = fibres[faces[root].fibres[1]], &c = fibres[faces[root].fibres[2]];
  fibres.push_back({(b.inner + c.inner) * 0.5, (b.outer + c.outer) * 0.5});
  for (const auto& [s, edge] :
       {std::pair(root, std::size_t{0}), std::pair(other, static_cast<std::size_t>(mesh.mirror_edge(root, 0)))}) {
    SlabMesh::Face one = faces[s], two = one;
    RootPlace part{.root = s, .level = 1, .corners = {{{2, 0, 0}, {0, 2, 0}, {0, 0, 2}}}};
    RootPlace rest = part;
    std::array<int, 3> between = {1, 1, 1};
    between[edge] = 0;
    one.fibres[(edge + 2) % 3] = two.fibres[(edge + 1) % 3] = middle;
    part.corners[(edge + 2) % 3] = rest.corners[(edge + 1) % 3] = between;
    faces[s] = one;
    origins[s] = part;
    faces.push_back(two);
    origins.push_back(rest);
  }
  auto made = SlabMesh::make(std::move(fibres), faces);
  EXPECT_TRUE(made) << made.error().message;
  std::array<std::vector<int>, kLayerCount> intervals;
  for (int k = 0; k < kLayerCount; ++k)
    if (model->has(static_cast<Layer>(k)))
      for (const RootPlace& from : origins)
        intervals[static_cast<std::size_t>(k)].push_back(model->intervals(static_cast<Layer>(k), from.root));
  const auto cage = std::make_shared<const SlabMesh>(*std::move(made));
  return {DetailChange::of_parts(*model, cage, std::move(origins), std::move(intervals)).of(*model),
          {.first = first, .added = 2, .numbers = {std::min(root, other), std::max(root, other)}}};
}

}  // namespace relief::testing
