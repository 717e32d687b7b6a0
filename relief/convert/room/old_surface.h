// The displaced surface of some slabs as it stands, to be sampled again on other fibres.
#pragma once

#include <relief/convert/sample/source_rays.h>
#include <relief/core/snapshot.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace relief::detail {

/// A place in a slab, by weights of its corners 1 and 2.
struct SlabPlace {
  SlabId slab = kNoSlab;
  double u = 0, v = 0;
};

/// The micro-triangles of slabs, stitched, holes last; no vertex twice.
class OldSurface {
 public:
  /// `slabs`: ascending. The surface must outlive it.
  OldSurface(const Snapshot& surface, std::span<const SlabId> slabs, const Lattice& lattice);

  [[nodiscard]] const SourceRays& rays() const noexcept { return rays_; }
  /// Returns the number of the first face that is a hole.
  [[nodiscard]] std::size_t phantom_from() const noexcept { return triangles_.phantom_from; }
  /// Of weights of a face's corners.
  [[nodiscard]] SlabPlace place(std::uint32_t face, const std::array<double, 3>& weights) const noexcept;

 private:
  struct Triangles {
    std::vector<Vec3d> points;  ///< model units
    std::vector<Face> faces;
    std::size_t phantom_from = 0;
    std::vector<SlabId> slab_of;  ///< by face
    /// By face: i and j of its corners on the slab's own grid.
    std::vector<std::array<std::uint8_t, 6>> cell_of;
    std::vector<std::size_t> begin_of;  ///< of each slab's samples
    std::vector<std::uint32_t> number;  ///< by sample: of the point that the first of its copies has

    Triangles(const Snapshot& surface, std::span<const SlabId> slabs);
    void add_points(const Snapshot& surface, std::span<const SlabId> slabs);
    void add_faces(const Snapshot& surface, std::span<const SlabId> slabs, bool holes);
  };
  const Snapshot& surface_;
  Triangles triangles_;
  SourceRays rays_;
};

}  // namespace relief::detail
