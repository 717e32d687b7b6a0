// Which slabs a picture shows, where in it, and at which level of detail.
#pragma once

#include "display_cache.h"
#include "frame.h"
#include "studio.h"

#include <span>
#include <vector>

namespace relief::detail {

/// Kept as long as the camera is still; update() takes in what an edit changes.
class SlabView {
 public:
  /// All slabs of the cache, for this eye (relative to the cache's centre) and size of picture.
  void look(const DisplayCache& cache, const Eye& eye, int width, int height);
  /// One slab again; after another cage, first as many slabs as there are now.
  void update(const DisplayCache& cache, SlabId s);
  [[nodiscard]] std::size_t slab_count() const noexcept { return slabs_.size(); }
  /// Returns the pixels that triangles in a box may colour; none where it is not in the picture.
  [[nodiscard]] PixelRect pixels_of(const Box3d& box) const;
  /// Returns the pixels where it is.
  [[nodiscard]] const PixelRect& pixels(SlabId s) const noexcept { return slabs_[s].pixels; }
  /// Returns whether any of it can be seen: it is in the picture, and its triangles do not all face away.
  [[nodiscard]] bool seen(SlabId s) const noexcept { return slabs_[s].seen; }

 private:
  struct Place {
    PixelRect pixels;
    bool seen = false;
  };
  [[nodiscard]] Place find(const DisplayCache& cache, SlabId s) const;
  Eye eye_;
  int width_ = 0, height_ = 0;
  std::vector<Place> slabs_;
};

/// Returns the coarsest level of each slab whose rows of samples are at most `tau` pixels apart half way along the
/// fibres, face on, at the slab's nearest corner, as if its triangles were equilateral. From the cage alone, so that it
/// stays while the surface is worked on. 0 everywhere for tau 0.
[[nodiscard]] std::vector<std::uint8_t> choose_levels(const SlabMesh& mesh, Vec3d centre, const Eye& eye, int height,
                                                      double tau);

/// Returns the smallest rectangle that holds both; of two of which one is empty the other.
[[nodiscard]] PixelRect united(const PixelRect& a, const PixelRect& b) noexcept;
[[nodiscard]] bool meet(const PixelRect& a, const PixelRect& b) noexcept;

}  // namespace relief::detail
