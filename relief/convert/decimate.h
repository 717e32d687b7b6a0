// From the source to the coarse base triangles that the slabs stand on.
#pragma once

#include <relief/base/progress.h>
#include <relief/convert/lattice.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace relief::detail {

using Face = std::array<std::uint32_t, 3>;

[[nodiscard]] inline bool share_a_corner(const Face& f, const Face& g) noexcept {
  bool shared = false;
  for (const std::uint32_t v : f) shared = shared || v == g[0] || v == g[1] || v == g[2];
  return shared;
}

/// An oriented manifold triangle mesh on the lattice, open or closed, in one or more parts.
struct BaseMesh {
  std::vector<LatticePoint> points;
  std::vector<Face> faces;
};

/// Quadric edge collapse [Garland and Heckbert 1997] down to a number of faces, in two stages. Far above the target
/// only link condition, flipped normals and shape are guarded. From there each collapse must also leave every vertex a
/// direction that sees its faces, wind once around it, and bring no two faces to meet (exact). The topology never
/// changes: closed parts stay closed, no part vanishes; where the guards leave no way down, more faces than the target
/// remain. Points are in lattice coordinates. Deterministic; O(n log n).
class Decimation {
 public:
  /// The first stage, to a multiple of `target`. Valid unless cancelled.
  Decimation(std::span<const Vec3d> points, std::span<const Face> faces, std::size_t target, const Progress& progress);
  ~Decimation();
  Decimation(const Decimation&) = delete;
  Decimation& operator=(const Decimation&) = delete;

  /// Points that the first stage left.
  [[nodiscard]] std::size_t point_count() const noexcept;

  struct Result {
    BaseMesh base;
    std::vector<std::uint32_t> went_to;  ///< per point of the first stage: the base point it was merged into
  };
  /// The second stage, as often as wanted: down to `target` faces, at most `most` while any collapse is possible at
  /// all. Errors near a point of the first stage count `importance` times (one entry per point). Empty when cancelled.
  [[nodiscard]] Result finish(std::size_t target, std::size_t most, std::span<const double> importance,
                              const Progress& progress) const;

 private:
  std::unique_ptr<class Collapser> fine_;
};

}  // namespace relief::detail
