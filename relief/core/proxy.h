// The surface contact point: it meets the displaced surface where the cursor goes in, and stays on it until the cursor
// is out again. It neither allocates nor locks.
#pragma once

#include <relief/core/query.h>

#include <array>
#include <optional>

namespace relief {

/// Where the straight way from `from` to `to` first goes in through the tessellated surface, and at which share of the
/// way; empty where it only leaves or misses. Exact on the micro-triangles near the way, also where it leaves the slabs
/// and enters them again. Cost: a few cells per slab on the way.
[[nodiscard]] std::optional<RayHit> first_entry(const Snapshot& model, Vec3d from, Vec3d to) noexcept;

/// One triangle of the tessellated surface: three samples of a slab, counter-clockwise seen from outside, and where
/// they lie.
struct MicroTriangle {
  SlabId slab = kNoSlab;
  std::array<GridPoint, 3> corners;
  std::array<Vec3d, 3> positions;

  [[nodiscard]] Vec3d point(const std::array<double, 3>& weights) const noexcept {
    return positions[0] * weights[0] + positions[1] * weights[1] + positions[2] * weights[2];
  }
  /// Outwards; its length is twice the area.
  [[nodiscard]] Vec3d area() const noexcept { return cross(positions[1] - positions[0], positions[2] - positions[0]); }
};

/// A place on the tessellated surface.
struct SurfacePlace {
  MicroTriangle triangle;
  std::array<double, 3> weights{};  ///< of the triangle's corners
  Vec3d position;
};

namespace detail {
class MicroTriangles;
}  // namespace detail

/// The surface contact point of one cursor. It goes from micro-triangle to micro-triangle towards the cursor, never
/// through material, to a place around which none is nearer; so it keeps to the side from which the cursor came,
/// however deep that goes, and is let go only when the straight way from it to the cursor is free. Where the cursor is
/// deeper than the surface is curved, that place runs away to another side (round a rim, say); the point then goes
/// along with the cursor instead. What an edit does to the surface is taken over little by little, and where one has
/// taken all material from between point and cursor, the depth shrinks before it is let go. Cost per tick: usually a
/// few micro-triangles, at most some hundred; a way into the surface or off it costs a sweep. Where the cursor leaps
/// farther than a hand goes in a tick both are counted, and where it has gone farther than time allows to look, the
/// point is late().
class Proxy {
 public:
  /// How quickly the point takes over a change of the surface under it, in one tick: a share of what is left of the
  /// change, and at most so many model units.
  struct Ease {
    double share = 1;
    double most = 1e300;
  };

  /// How far around its place the point looks for one nearer to the cursor.
  enum class Look {
    Here,    ///< in the triangles that touch the place: it clings a little, for it leaves a triangle later than it came
    Around,  ///< in those beside them, too: where the surface is less curved than the cursor is deep, it rests at the
             ///< nearest place whichever way it came. Costs another triangle or a few per tick
  };

  /// What of the place where the point comes to rest a tick works out.
  enum class Tell {
    All,
    WayOut  ///< not the normals, nor alpha(): they stay as they are. A third cheaper
  };

  /// Lets go. The next cursor is taken to be in the open.
  void reset() noexcept { *this = {}; }
  /// Lets go. The next way starts at a place in the open, or one that the surface has just risen past, which is `at` in
  /// its slab. Unlike step(), it does not look for the slab.
  void start(const SlabMesh& mesh, Vec3d place, const std::optional<SlabCoord>& at = {}) noexcept;
  /// One tick: the cursor has moved straight to `cursor`, and the model may have changed. Whether the point is held.
  /// Under a cursor that moves by s the point moves by at most 10 s and a fiftieth of its distance from the cursor,
  /// unless it leaves the surface and meets it again on the way to the cursor.
  bool step(const Snapshot& model, Vec3d cursor, Ease ease, Look look = Look::Here, Tell tell = Tell::All) noexcept;

  [[nodiscard]] bool held() const noexcept { return held_; }
  /// Not held, and on its way to a cursor that has gone farther than a tick has time to look along (more than 2 % of
  /// the slabs' diagonal): it is at place(), up to which the straight way is clear, and goes on from there in the next
  /// tick.
  [[nodiscard]] bool late() const noexcept { return late_; }
  /// Where a free point is: the cursor, unless it is late.
  [[nodiscard]] Vec3d place() const noexcept { return here_; }
  /// Samples whose positions the last tick worked out: its cost, whatever the machine.
  [[nodiscard]] int samples_placed() const noexcept { return samples_placed_; }
  /// What the last tick's walks and looks along the way took, in units of some 12 ns.
  [[nodiscard]] int work() const noexcept { return work_; }
  /// The place at which the point last left the surface for a free way to the cursor: in this tick, if has_left().
  [[nodiscard]] bool has_left() const noexcept { return has_left_; }
  [[nodiscard]] Vec3d left_at() const noexcept { return left_at_; }
  /// The rest is for a held point.
  [[nodiscard]] const SurfacePoint& surface() const noexcept { return surface_; }
  /// surface() as it is in this model, also where the last tick did not work out its normal or was in another model; as
  /// it was, with the way out for a normal, where this one has no such place.
  [[nodiscard]] const SurfacePoint& told_surface(const Snapshot& model) noexcept;
  /// From the cursor to the point, model units; less than that after the surface has risen, until it is taken over.
  [[nodiscard]] double depth() const noexcept { return depth_; }
  /// Unit, outwards: the surface's normal, but turning no faster than the cursor moves.
  [[nodiscard]] Vec3d normal() const noexcept { return normal_; }
  /// rad that the way out may have turned by in this tick, and normal() did at most; anything in the first of a
  /// contact.
  [[nodiscard]] double turn() const noexcept { return turn_; }
  /// Unit, from the cursor to the point; normal() at depth 0.
  [[nodiscard]] Vec3d way_out() const noexcept { return way_out_; }
  /// The cursor's alpha where it lies in the point's slab, else that of the surface at the point.
  [[nodiscard]] double alpha() const noexcept { return alpha_; }
  /// How far the surface rose under the point in this tick, model units; negative when it fell.
  [[nodiscard]] double rise() const noexcept { return rise_; }
  /// How much of depth() came in this tick from taking over the surface's changes, not from the cursor.
  [[nodiscard]] double grown() const noexcept { return grown_; }
  /// The slabs under the point were exchanged in this tick, or a hole opened there; the point was let go wherever the
  /// cursor is.
  [[nodiscard]] bool lost() const noexcept { return lost_; }

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
  /// What in this tick is not the hand's doing: how much of a change of the surface was taken over, and by how much
  /// what is felt may still change.
  struct Own {
    double eased, most;
  };
  void meet(detail::MicroTriangles& surface, Vec3d cursor) noexcept;
  /// Whether the way to the cursor lies in a ball that is known to be clear, or that this finds.
  bool is_clear(detail::MicroTriangles& surface, Vec3d cursor) noexcept;
  /// Notes where the free cursor is above the surface.
  void look_below(const Snapshot& model, Vec3d cursor) noexcept;
  /// Micro-triangles that a walk may look at in what is left of the tick.
  [[nodiscard]] int tries_left() const noexcept;
  /// Whether the cursor does in this tick.
  [[nodiscard]] bool leaps() const noexcept;
  /// Takes over what happened to the surface under the point. False when there is another one, or a hole.
  bool follow_surface(detail::MicroTriangles& surface) noexcept;
  /// Moves a place from the point to where that would come to rest, and measures the way; false where it is not yet
  /// there. `over`: the place beyond the edge that it goes to next, if it is about to cross one that is farther off.
  /// `round`: whether it goes over what faces away from its side.
  [[nodiscard]] bool look_ahead(detail::MicroTriangles& surface, SurfacePlace& rest, Vec3d goal, Look look, double& way,
                                std::optional<SurfacePlace>& over, bool& round) noexcept;
  /// Towards the cursor; lets go when the way to it is free.
  void pursue(detail::MicroTriangles& surface, Vec3d cursor, Own own, Look look, Tell tell) noexcept;
  void hold(detail::MicroTriangles& surface, const SurfacePlace& place) noexcept;
  /// Comes onto the surface at a place.
  void land(detail::MicroTriangles& surface, const SurfacePlace& place) noexcept;
  void let_go() noexcept;
  /// Puts where the point is into surface_, with the normal there.
  void tell_surface(detail::MicroTriangles& surface) noexcept;
  void describe(detail::MicroTriangles& surface, Vec3d goal, Vec3d cursor, double travel, double most,
                Tell tell) noexcept;

  bool known_ = false;  ///< last_ holds a cursor
  bool held_ = false;
  bool fresh_ = false;  ///< held since this tick
  bool lost_ = false;
  bool has_left_ = false;
  bool told_ = false;      ///< surface_ has its normal
  bool yielding_ = false;  ///< only the change holds the point: the way to the cursor is free
  bool late_ = false;
  Vec3d last_;  ///< where it was free in the last tick; held, the cursor
  Vec3d here_;  ///< the same in this tick
  Vec3d left_at_;
  LocateHint hint_;
  std::optional<Above> above_;
  Clear clear_;
  bool open_ = false;  ///< the last way was free, and a clear ball may be found
  SurfacePlace place_;
  std::optional<SurfacePlace> ahead_;  ///< how far the look ahead has come that took more than this tick
  bool ahead_round_ = false;           ///< whether it went over what faces away from the side
  SlabCorners corners_{};              ///< of the point's slab
  detail::CellNormals normals_;
  Vec3d lag_;  ///< what of the surface's changes is not yet taken over: felt surface - surface
  SurfacePoint surface_;
  Vec3d normal_, way_out_;
  Vec3d side_;       ///< that it is pushed out to: follows the way out as the hand goes along it; at first the normal
  SlabCoord under_;  ///< the cursor's coordinates, where it lies in the point's slab
  double depth_ = 0, turn_ = 0, rise_ = 0, grown_ = 0, alpha_ = 0;
  double nearer_ =
      0;  ///< squared: by how much its own moves have brought it nearer to the cursor, and may take it back
  /// Ticks in which a free way to the cursor counts as the doing of a change of the surface: until the point has come
  /// to rest after it.
  int unsettled_ = 0;
  int samples_placed_ = 0, work_ = 0;
  int most_work_ = 0;  ///< of this tick, until a way is left where it is known to be clear
};

}  // namespace relief
