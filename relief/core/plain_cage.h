// A cage as plain numbers, the form in which the verifier reads one.
#pragma once

#include <relief/base/triples.h>
#include <relief/core/slab_mesh.h>

#include <span>

namespace relief {

/// Fibre i runs from inner[i] to outer[i]; each triangle names the three fibres of a slab. Usable as the fields of
/// verify::Shell. The mesh must outlive it.
struct PlainCage {
  /// ends of the fibres, model units
  Triples<double> inner, outer;
  Triples<FibreId> triangles;  ///< the slabs, as three fibres each

  static_assert(sizeof(Vec3d) == 3 * sizeof(double), "its components are taken for rows of an array");
  explicit PlainCage(const SlabMesh&&) = delete;
  /// Of the roots, of which everything is proven: what they were cut into has the same field of fibres.
  explicit PlainCage(const SlabMesh& mesh) noexcept : PlainCage(mesh.root_fibres(), mesh.roots()) {}
  /// Of the slabs that there are, where middles of edges hang; only of these can one speak of tiles.
  [[nodiscard]] static PlainCage of_pieces(const SlabMesh& mesh) noexcept { return {mesh.fibres(), mesh.slabs()}; }

 private:
  PlainCage(std::span<const Fibre> fibres, std::span<const Slab> slabs) noexcept
      : inner(&fibres.data()->inner.x, fibres.size(), sizeof(Fibre)),
        outer(&fibres.data()->outer.x, fibres.size(), sizeof(Fibre)),
        triangles(slabs.data()->fibres.data(), slabs.size(), sizeof(Slab)) {}
};

}  // namespace relief
