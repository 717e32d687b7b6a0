// The surface contact point: it meets the displaced surface where the cursor goes in, and stays on it until the
// straight way to the cursor is free. It neither allocates nor locks.
#pragma once

#include <relief/core/micro_triangles.h>
#include <relief/haptics/contact/principle.h>
#include <relief/haptics/contact/walk.h>

#include <optional>

namespace relief {

/// The surface contact point of one cursor: a god-object (Zilles and Salisbury 1995) on the micro-triangles. It goes,
/// by bounded steps, wherever a continuous way over the surface leads on which its distance to the cursor falls; so it
/// rounds every edge that the nearest place rounds. Only past the middle of the body behind it, where the straight way
/// from it through the cursor comes out within twice the depth, does it go by the hand's own sideways way alone, so
/// that a part can be thinner than the hand is deep. docs/decisions/0009-contact.md has the principle. Cost per tick:
/// usually a few micro-triangles; at most a few walks of detail::kTries of them each, and two sweeps.
class Proxy {
 public:
  /// Lets go. The next cursor is taken to be in the open.
  void reset() noexcept { *this = {}; }
  /// Lets go. The next way starts at a place in the open, or one that the surface has just risen past, which is `at` in
  /// its slab. Unlike step(), it does not look for the slab.
  void start(const SlabMesh& mesh, Vec3d place, const std::optional<SlabCoord>& at = {}) noexcept;
  /// One tick: the cursor has moved straight to `cursor`, and the model may have changed. Whether the point is held.
  /// Under a cursor that moves by s the point moves by at most 10 s or a fiftieth of its distance from the cursor,
  /// unless it leaves the surface and meets it again on the way to the cursor; where the model has changed, it comes to
  /// rest on what is there.
  bool step(const Snapshot& model, Vec3d cursor) noexcept;

  [[nodiscard]] bool held() const noexcept { return held_; }
  /// In this tick a change of the model has moved it, or begun to: there was no time to see where it comes to rest.
  [[nodiscard]] bool settling() const noexcept { return settling_; }
  /// The place at which the point last left the surface for a free way to the cursor: in this tick, if has_left().
  [[nodiscard]] bool has_left() const noexcept { return has_left_; }
  [[nodiscard]] Vec3d left_at() const noexcept { return left_at_; }
  /// How far the surface rose under the point, or past the free cursor, in this tick, model units; negative when it
  /// fell.
  [[nodiscard]] double rise() const noexcept { return rise_; }
  /// Samples whose positions the last tick worked out: its cost, whatever the machine.
  [[nodiscard]] int samples_placed() const noexcept { return samples_placed_; }
  /// The slabs under the point were exchanged in this tick, or a hole opened there; the point was let go wherever the
  /// cursor is.
  [[nodiscard]] bool lost() const noexcept { return lost_; }
  /// The rest is for a held point.
  [[nodiscard]] Vec3d position() const noexcept { return place_.position; }
  /// From the cursor to the point, model units.
  [[nodiscard]] double depth() const noexcept { return depth_; }
  /// Unit, from the cursor to the point; as it was, where they are one.
  [[nodiscard]] Vec3d way_out() const noexcept { return way_out_; }

  /// What of the contact only a point tool needs.
  struct Description {
    SurfacePoint surface;
    double alpha = 0;  ///< the cursor's where it lies in the point's slab, else that of the surface at the point
    Vec3d normal;      ///< unit, outwards: the surface's at the point, going evenly, and turning no faster than `turn`
    double turn = 0;   ///< rad, in this tick; anything in the first of a contact
  };
  /// Of the last step(), in the same model; to be called in each tick or never, as the normal turns from tick to tick.
  [[nodiscard]] Description describe(const Snapshot& model) noexcept;
  /// The surface where the point is; where that is no more, as it was.
  [[nodiscard]] SurfacePoint surface(const Snapshot& model) noexcept;

 private:
  /// Where the free cursor is seen above the surface, with the slab as it stood.
  struct Above {
    SlabCoord at;
    SlabCorners corners;
  };
  /// A ball without a micro-triangle.
  struct Clear {
    std::uint64_t model = 0;  ///< number of the snapshot
    Vec3d centre;
    double radius = 0;
    SlabId nearest = kNoSlab;
  };
  /// Takes over what has become of the surface, with the cursor where it was.
  void carry(MicroTriangles& surface) noexcept;
  /// Puts the point where it is in this model. False when there are other slabs, or a hole.
  [[nodiscard]] bool measure_again(MicroTriangles& surface) noexcept;
  /// Whether the surface has risen past the free cursor; then that is held.
  [[nodiscard]] bool risen_past(MicroTriangles& surface) noexcept;
  /// The cursor goes in the open.
  void meet(MicroTriangles& surface, Vec3d cursor) noexcept;
  /// Whether the way to the cursor lies in a ball that is known to be clear, or that this finds.
  [[nodiscard]] bool is_clear(MicroTriangles& surface, Vec3d cursor) noexcept;
  /// Notes where the free cursor is above the surface.
  void look_below(const Snapshot& model, Vec3d cursor) noexcept;
  /// Towards the cursor, by `budget` at most, or with the hand, which has moved by `move`. Whether it has been seen
  /// where it rests.
  bool pursue(MicroTriangles& surface, Vec3d cursor, Vec3d move, double budget) noexcept;
  /// Past the middle: by the hand's own way.
  void go_along(MicroTriangles& surface, Vec3d cursor, Vec3d move, const detail::Descent& descent) noexcept;
  /// Whether the line from the point through the cursor leaves the body within twice the depth.
  [[nodiscard]] bool past_the_middle(MicroTriangles& surface, Vec3d cursor) noexcept;
  /// Where the straight way to the cursor leads into the air it is taken.
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
  SlabCorners corners_{};  ///< of the point's slab
  SlabId slab_ = kNoSlab;  ///< which that is, and in which cage
  std::uint64_t cage_ = 0;
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
