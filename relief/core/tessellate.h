// From a snapshot to vertices and triangles, at full resolution or coarser.
#pragma once

#include <relief/base/progress.h>
#include <relief/core/snapshot.h>

#include <array>
#include <cstdint>
#include <vector>

namespace relief {

/// One vertex per distinct sample that a triangle uses (shared samples once), triangles counter-clockwise seen from
/// outside. Stitched where n differs across an edge, so it is as closed as the cage, except for holes, which are left
/// out.
struct Tessellation {
  std::vector<Vec3d> positions;                         ///< corners, model units
  std::vector<Vec3f> normals;                           ///< unit, as sample_normal() of the full resolution
  std::vector<Vec3f> colours;                           ///< 0..1, empty when the model has no colour layer
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< counter-clockwise from outside
};

/// Returns how many levels of detail a grid has: level k takes every 2^k-th sample, as long as 2^k divides n (n = 15
/// has only 0).
[[nodiscard]] int level_count(int n) noexcept;
/// Returns the same for a model: as many as its finest slab has.
[[nodiscard]] int level_count(const SlabMesh& mesh) noexcept;
/// Every how many samples of a grid a level takes; past the last level of the grid as many as that one.
[[nodiscard]] int level_step(int n, int level) noexcept;
/// Returns the same for a slab: the middle of an edge with two slabs across is taken on every level.
[[nodiscard]] int level_step(const SlabMesh& mesh, SlabId s, int level) noexcept;

/// Level k of the whole surface (0 <= k < level_count(mesh), asserted); slabs with fewer levels show their last.
/// `progress` has the phase "surface". Cancelled: what it returns means nothing.
[[nodiscard]] Tessellation tessellate(const Snapshot& model, int level = 0, const Progress& progress = {});

}  // namespace relief
