// A cage as plain numbers, the form in which the verifier reads one.
#pragma once

#include <relief/base/triples.h>
#include <relief/core/slab_mesh.h>

namespace relief {

/// Fibre i runs from inner[i] to outer[i]; each triangle names the three fibres of a slab. Usable as the fields of
/// verify::Shell. The mesh must outlive it.
struct PlainCage {
  Triples<double> inner, outer;
  Triples<FibreId> triangles;

  static_assert(sizeof(Vec3d) == 3 * sizeof(double), "its components are taken for rows of an array");
  explicit PlainCage(const SlabMesh&&) = delete;
  explicit PlainCage(const SlabMesh& mesh) noexcept
      : inner(&mesh.fibres().data()->inner.x, mesh.fibres().size(), sizeof(Fibre)),
        outer(&mesh.fibres().data()->outer.x, mesh.fibres().size(), sizeof(Fibre)),
        triangles(mesh.slabs().data()->fibres.data(), mesh.slabs().size(), sizeof(Slab)) {}
};

}  // namespace relief
