// The same surface on longer fibres, exactly: for tests of what goes on across such a change.
#pragma once

#include <relief/core/snapshot.h>

#include <gtest/gtest.h>

#include <memory>
#include <vector>

namespace relief::testing {

/// Each fibre goes on beyond its ends by these shares of itself. Points of the surface move by the rounding of a float
/// of alpha.
inline SnapshotPtr with_longer_fibres(const SnapshotPtr& model, double in, double out) {
  const SlabMesh& mesh = model->slab_mesh();
  std::vector<Fibre> fibres;
  for (const Fibre& f : mesh.root_fibres())
    fibres.push_back({f.inner - f.direction() * in, f.outer + f.direction() * out});
  auto made = mesh.with_root_fibres(std::move(fibres));
  EXPECT_TRUE(made) << made.error().message;
  const auto cage = std::make_shared<const SlabMesh>(*std::move(made));
  return Snapshot::with_cage(*model, cage, [&](Layer layer) {
    std::vector<TilePtr> tiles;
    for (SlabId s = 0; s < mesh.slab_count(); ++s) {
      if (layer != Layer::Displacement) {
        tiles.push_back(model->shared_tile(layer, s));
        continue;
      }
      const auto tile = std::make_shared<Tile>(model->tile(layer, s));
      for (std::size_t k = 0; k < tile->size(); ++k) {
        const double alpha = double{model->displacement(s)[k]};
        tile->plane()[k] = static_cast<float>((alpha + in) / (1 + in + out));
      }
      constrain(*cage, layer, s, *tile);
      tiles.push_back(tile);
    }
    return tiles;
  });
}

}  // namespace relief::testing
