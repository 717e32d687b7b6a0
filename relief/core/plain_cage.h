// A cage as plain arrays, the form in which the verifier reads one.
#pragma once

#include <relief/core/slab_mesh.h>

#include <array>
#include <cstdint>
#include <vector>

namespace relief {

/// Fibre i runs from inner[i] to outer[i]; each triangle names the three fibres of a slab. Usable as the fields of
/// verify::Shell.
struct PlainCage {
  std::vector<std::array<double, 3>> inner, outer;
  std::vector<std::array<FibreId, 3>> triangles;

  explicit PlainCage(const SlabMesh& mesh) {
    inner.reserve(mesh.fibres().size());
    outer.reserve(mesh.fibres().size());
    triangles.reserve(mesh.slabs().size());
    for (const Fibre& f : mesh.fibres()) {
      inner.push_back({f.inner.x, f.inner.y, f.inner.z});
      outer.push_back({f.outer.x, f.outer.y, f.outer.z});
    }
    for (const Slab& s : mesh.slabs()) triangles.push_back(s.fibres);
  }
};

}  // namespace relief
