// The surface contact point: it meets the displaced surface where the cursor goes in, and stays on it until the
// straight segment to the cursor is free. It neither allocates nor locks.
#pragma once

#include <relief/core/micro_triangles.h>
#include <relief/haptics/contact/principle.h>
#include <relief/haptics/contact/walk.h>
#include <relief/haptics/foothold.h>

#include <optional>

namespace relief {

/// The contact point of one cursor: a god-object (Zilles and Salisbury 1995) on the micro-triangles. It moves in
/// bounded steps along the surface wherever its distance to the cursor falls. Past the middle of a thin part it follows
/// the hand's sideways motion only. docs/decisions/0009-contact.md has the principle. Cost per tick: usually a few
/// micro-triangles; at most a few walks of detail::kTries each, and two sweeps.
class Proxy {
 public:
  /// Ends the contact. The next cursor is taken to be in free space.
  void reset() noexcept { *this = {}; }
  /// Ends the contact. The next way starts at a place in free space, or one that the surface has risen past, which is
  /// `at` in its slab. Unlike step(), it does not look for the slab.
  void start(const SlabMesh& mesh, Vec3d place, const std::optional<SlabCoord>& at = {}) noexcept;
  /// Returns one tick: the cursor has moved straight to `cursor`, and the model may have changed. Returns whether the
  /// point is held. While the cursor moves by s, the point moves by at most 10 s or 2 % of its distance to the cursor,
  /// except where it leaves the surface and lands again. An edit brings it to rest on the new surface; another cage
  /// does not move it (detail::Foothold).
  bool step(const Snapshot& model, Vec3d cursor) noexcept;

  [[nodiscard]] bool held() const noexcept { return held_; }
  /// In this tick a change of the model has moved it, or begun to: there was no time to see where it comes to rest.
  [[nodiscard]] bool settling() const noexcept { return settling_; }
  /// Returns the place at which the point last left the surface for a free way to the cursor: in this tick, if
  /// has_left().
  [[nodiscard]] bool has_left() const noexcept { return has_left_; }
  [[nodiscard]] Vec3d left_at() const noexcept { return left_at_; }
  /// Returns how far the surface rose under the point, or past the free cursor, in this tick, model units; negative
  /// when it fell.
  [[nodiscard]] double rise() const noexcept { return rise_; }
  /// Samples whose positions the last tick worked out: its cost, whatever the machine.
  [[nodiscard]] int samples_placed() const noexcept { return samples_placed_; }
  /// In this tick a hole opened under the point, or in another cage nothing was found near it; the point lost its
  /// contact wherever the cursor is.
  [[nodiscard]] bool lost() const noexcept { return lost_; }
  /// The rest is for a held point.
  [[nodiscard]] Vec3d position() const noexcept { return place_.position; }
  /// From the cursor to the point, model units.
  [[nodiscard]] double depth() const noexcept { return depth_; }
  /// Unit, from the cursor to the point; as it was, where they are one.
  [[nodiscard]] Vec3d way_out() const noexcept { return way_out_; }

  /// Holds what of the contact only a point tool needs.
  struct Description {
    SurfacePoint surface;
    double alpha = 0;  ///< the cursor's where it lies in the point's slab, else that of the surface at the point
    Vec3d normal;      ///< unit, outwards: the surface's at the point, going evenly, and turning no faster than `turn`
    double turn = 0;   ///< rad, in this tick; anything in the first of a contact
  };
  /// Describes the contact of the last step(), in the same model. Call it in each tick or never: the normal turns from
  /// tick to tick.
  [[nodiscard]] Description describe(const Snapshot& model) noexcept;
  /// Returns the surface where the point is; where that is no more, as it was.
  [[nodiscard]] SurfacePoint surface(const Snapshot& model) noexcept;

 private:
  /// Says where the free cursor is seen above the surface.
  struct Above {
    SlabCoord at;
    SlabOrigin origin;
  };
  /// A ball without a micro-triangle.
  struct Clear {
    std::uint64_t model = 0;  ///< number of the snapshot
    Vec3d centre;
    double radius = 0;
    SlabId nearest = kNoSlab;
  };
  /// Takes over what has become of the surface, with the cursor where it was. Whether that may be felt.
  bool carry(MicroTriangles& surface) noexcept;
  /// Returns where the point is in a model in which it may not yet have been measured; empty when there is a hole, or
  /// in another cage nothing near.
  [[nodiscard]] std::optional<SurfacePlace> place_in(MicroTriangles& surface) const noexcept;
  /// Puts the point where it is in this model. False when it is nowhere.
  [[nodiscard]] bool measure_again(MicroTriangles& surface) noexcept;
  /// Returns where the free cursor was last is in a cage, if it was seen above the surface.
  [[nodiscard]] std::optional<SlabCoord> above_in(const SlabMesh& mesh) noexcept;
  /// Returns whether the surface has risen past the free cursor; then that is held.
  [[nodiscard]] bool risen_past(MicroTriangles& surface) noexcept;
  /// The cursor goes in free space.
  void meet(MicroTriangles& surface, Vec3d cursor) noexcept;
  /// Returns whether the way to the cursor lies in a ball that is known to be clear, or that this finds.
  [[nodiscard]] bool is_clear(MicroTriangles& surface, Vec3d cursor) noexcept;
  /// Notes where the free cursor is above the surface.
  void look_below(const Snapshot& model, Vec3d cursor) noexcept;
  /// Moves the point towards the cursor, by `budget` at most, or with the hand's own step `move`. Returns whether its
  /// place of rest is known.
  bool pursue(MicroTriangles& surface, Vec3d cursor, Vec3d move, double budget) noexcept;
  /// Past the middle: by the hand's own way.
  void go_along(MicroTriangles& surface, Vec3d cursor, Vec3d move, const detail::Descent& descent) noexcept;
  /// Returns whether the line from the point through the cursor leaves the body within twice the depth.
  [[nodiscard]] bool past_the_middle(MicroTriangles& surface, Vec3d cursor) noexcept;
  /// Takes the straight segment to the cursor where it leads into the air.
  void leave(MicroTriangles& surface, Vec3d cursor) noexcept;
  void hold(MicroTriangles& surface, const SurfacePlace& place) noexcept;
  /// Comes onto the surface.
  void land(const SurfacePlace& place) noexcept;
  void let_go() noexcept;
  /// Keeps the corners of the slab where the point is.
  void know_corners(const SlabMesh& mesh) noexcept;

  bool known_ = false;  ///< last_ holds a cursor
  bool held_ = false;
  bool fresh_ = false;   ///< held since this tick
  bool settled_ = true;  ///< it has come to rest after the last change of the surface
  bool settling_ = false;
  bool lost_ = false, has_left_ = false;
  Vec3d last_;  ///< the last cursor
  Vec3d left_at_;
  std::uint64_t model_ = 0;  ///< number of the last tick's
  LocateHint hint_;
  std::optional<Above> above_;
  Clear clear_;
  bool open_ = false;  ///< the last way was free, and a clear ball may be found
  SurfacePlace place_;
  SlabCorners corners_{};      ///< of the point's slab
  detail::Foothold foothold_;  ///< of the point in its slab
  SlabId slab_ = kNoSlab;      ///< of the point
  detail::Ledger ledger_;
  Vec3d way_out_;
  double depth_ = 0, rise_ = 0, travel_ = 0;
  int samples_placed_ = 0;
  // Of describe().
  detail::CellNormals normals_;
  Vec3d normal_;
  double described_ = 0;  ///< depth in the last tick
  SlabCoord under_;       ///< the cursor's coordinates, where it lies in the point's slab
};

}  // namespace relief
