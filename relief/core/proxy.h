// The surface contact point: it meets the displaced surface where the cursor goes in, and stays on it until the cursor
// is out again. It neither allocates nor locks.
#pragma once

#include <relief/core/query.h>

#include <optional>

namespace relief {

/// Where the straight way from `from` to `to` first goes in through the tessellated surface, and at which share of the
/// way; empty where it only leaves or misses. Exact on the micro-triangles near the way, also where it leaves the slabs
/// and enters them again. Cost: a few cells per slab on the way.
[[nodiscard]] std::optional<RayHit> first_entry(const Snapshot& model, Vec3d from, Vec3d to) noexcept;

/// One triangle of the tessellated surface: three samples of a slab, counter-clockwise seen from outside.
struct MicroTriangle {
  SlabId slab = kNoSlab;
  std::array<GridPoint, 3> corners;
};

/// A place on the tessellated surface.
struct SurfacePlace {
  MicroTriangle triangle;
  std::array<double, 3> weights{};  ///< of the triangle's corners
  Vec3d position;
};

/// The surface contact point of one cursor. It goes from micro-triangle to micro-triangle, at most 64 a tick, always
/// towards the cursor, never through material; so it keeps to the side from which the cursor came, however deep that
/// goes, and is let go only when the straight way from it to the cursor is free.
class Proxy {
 public:
  /// How quickly the point takes over a change of the surface under it, in one tick: a share of what is left of the
  /// change, and at most so many model units.
  struct Ease {
    double share = 1;
    double most = 1e300;
  };

  /// Lets go. The next cursor is taken to be in the open.
  void reset() noexcept { *this = {}; }
  /// One tick: the cursor has moved straight to `cursor`, and the model may have changed. Whether the point is held.
  bool step(const Snapshot& model, Vec3d cursor, Ease ease) noexcept;

  [[nodiscard]] bool held() const noexcept { return held_; }
  /// The rest is for a held point.
  [[nodiscard]] const SurfacePoint& surface() const noexcept { return surface_; }
  /// From the cursor to the point, model units; less than that after the surface has risen, until it is taken over.
  [[nodiscard]] double depth() const noexcept { return depth_; }
  /// Unit, outwards: the surface's normal, but turning no faster than the cursor moves.
  [[nodiscard]] Vec3d normal() const noexcept { return normal_; }
  /// Unit, from the cursor to the point; normal() at depth 0.
  [[nodiscard]] Vec3d way_out() const noexcept { return way_out_; }
  /// How far the surface rose under the point in this tick, model units; negative when it fell.
  [[nodiscard]] double rise() const noexcept { return rise_; }
  /// The slabs under the point were exchanged in this tick; the point was let go wherever the cursor is.
  [[nodiscard]] bool lost() const noexcept { return lost_; }

 private:
  /// Where the free cursor is seen above the surface, with the slab as it stood.
  struct Above {
    SlabCoord at;
    SlabCorners corners;
  };
  void meet(const Snapshot& model, Vec3d cursor) noexcept;
  void look_below(const Snapshot& model, Vec3d cursor, bool was_above) noexcept;
  /// Takes over what happened to the surface under the point. False when the slab is another one.
  bool follow_surface(const Snapshot& model) noexcept;
  /// Towards the cursor; false when the way to it is free.
  bool pursue(const Snapshot& model, Vec3d cursor, double travel) noexcept;
  void hold(const Snapshot& model, const SurfacePlace& place) noexcept;
  void let_go() noexcept;
  void describe(const Snapshot& model, Vec3d goal, double travel) noexcept;

  bool known_ = false;  ///< last_ holds a cursor
  bool held_ = false;
  bool fresh_ = false;  ///< held since this tick
  bool lost_ = false;
  Vec3d last_;  ///< the cursor of the last tick
  LocateHint hint_;
  std::optional<Above> above_;
  SurfacePlace place_;
  SlabCorners corners_{};  ///< of the point's slab
  Vec3d lag_;              ///< what of the surface's changes is not yet taken over: felt surface - surface
  SurfacePoint surface_;
  Vec3d normal_, way_out_;
  Vec3d came_;  ///< the way out when the surface last faced it
  double depth_ = 0, rise_ = 0;
};

}  // namespace relief
