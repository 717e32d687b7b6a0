// A ball that touches the displaced surface: held outside it, nearest to the cursor. It neither allocates nor locks.
#pragma once

#include <relief/core/proxy.h>

#include <memory>

namespace relief {

/// The ball of one spherical tip: a god-object (Zilles and Salisbury 1995) with a radius. Its centre goes towards the
/// cursor as long as no micro-triangle comes nearer than the radius, and then along the micro-triangles that it
/// touches, to a place around which none is nearer to the cursor; so it keeps to the side from which the cursor came,
/// however deep that goes, and rests in creases on both sides of them. Each step is a projection onto half-spaces:
/// around each triangle, the one beyond the plane that touches the radius around the triangle's point nearest to the
/// centre. Their intersection is free of the surface and convex, so that the straight way to any place in it is free.
/// Cost per tick: a few looks around the centre, at most kSearches and one, whatever the number of triangles. They
/// share lists of what is near, which are made anew where the centre leaves them or the model is another. What a tick
/// may take is counted; where it is not enough to see where the ball would come to rest, it goes on towards the cursor
/// as far as was seen, and the rest of the way comes in the next tick. A look that would take too long is left, and
/// goes on there.
class BallProxy {
 public:
  using Ease = Proxy::Ease;
  static constexpr int kSearches = 12;

  /// Allocates, as copies do.
  BallProxy() = default;

  /// Lets go. The next cursor is taken to be in the open, with the ball around it.
  void reset() noexcept;
  /// One tick: the cursor has moved straight to `cursor`, and the model may have changed; the radius is one for good.
  /// Whether the centre is held back. Under a cursor that moves by s the held centre moves by at most 10 s and a
  /// fiftieth of its distance from the cursor, and what `ease` lets it move when the surface has risen. In the open it
  /// follows a cursor that is too far for one tick in several, and is not held until it has touched something.
  bool step(const Snapshot& model, Vec3d cursor, double radius, Ease ease) noexcept;
  /// Whether no micro-triangle is nearer to the centre than the radius.
  [[nodiscard]] static bool clear(const Snapshot& model, Vec3d centre, double radius) noexcept;

  /// Whether the centre is not where the cursor is.
  [[nodiscard]] bool held() const noexcept { return held_; }
  /// It is so only because it follows in the open.
  [[nodiscard]] bool under_way() const noexcept { return under_way_; }
  /// Searches that the last tick took.
  [[nodiscard]] int searches() const noexcept { return searches_; }
  /// What the last tick took, in the time of a sample that is placed, some 25 ns.
  [[nodiscard]] int work() const noexcept { return work_; }
  [[nodiscard]] Vec3d centre() const noexcept { return centre_; }
  /// How far the surface rose into the ball in this tick, model units.
  [[nodiscard]] double rise() const noexcept { return rise_; }
  /// The surface rose beyond the ball's centre in this tick.
  [[nodiscard]] bool lost() const noexcept { return lost_; }
  /// How far the nearest micro-triangle reaches into the ball, model units: what a risen surface, or one that the ball
  /// came to from behind, has not yet pushed out.
  [[nodiscard]] double overlap() const noexcept { return overlap_; }
  /// The rest is for a held ball.
  /// Where it touches the surface; of several such places the one that pushes most.
  [[nodiscard]] const SurfacePoint& surface() const noexcept { return surface_; }
  /// From the cursor to the centre, model units.
  [[nodiscard]] double depth() const noexcept { return depth_; }
  /// Unit, from the cursor to the centre.
  [[nodiscard]] Vec3d way_out() const noexcept { return way_out_; }
  /// How much of depth() came in this tick from what the surface pushed, not from the cursor.
  [[nodiscard]] double grown() const noexcept { return grown_; }

 private:
  struct Memory;
  /// Copied with the ball.
  class OwnMemory {
   public:
    OwnMemory();
    OwnMemory(const OwnMemory& other);
    OwnMemory(OwnMemory&&) noexcept;
    OwnMemory& operator=(const OwnMemory& other);
    OwnMemory& operator=(OwnMemory&&) noexcept;
    ~OwnMemory();
    Memory* operator->() const noexcept { return memory_.get(); }
    Memory& operator*() const noexcept { return *memory_; }

   private:
    std::unique_ptr<Memory> memory_;
  };
  explicit BallProxy(OwnMemory memory) noexcept : memory_(std::move(memory)) {}

  OwnMemory memory_;  ///< what is known of the surface, and room to work in; 3.2 MiB
  bool known_ = false, held_ = false, lost_ = false;
  bool under_way_ = false;   ///< in the open, to a cursor too far away for one tick
  int late_ = 0;             ///< for so many ticks away from the cursor, with nothing found that it touches
  std::uint64_t model_ = 0;  ///< number of the last tick's
  Vec3d last_;               ///< the cursor of the last tick
  Vec3d centre_;
  Vec3d side_;  ///< the side that it is pushed out to
  /// Of the last tick in which it was seen where it would come to rest, and went there.
  struct Seen {
    Vec3d cursor, centre;
    bool known = false;  ///< there was one since it is held
  };
  Seen seen_;
  bool behind_ = false;  ///< the nearest triangle in the ball shows its back: a sheet that the ball came to from there
  detail::CellNormals normals_;
  SurfacePoint surface_;
  Vec3d way_out_;
  bool settling_ = false;  ///< the surface rose into the ball and is still in it
  double depth_ = 0, rise_ = 0, grown_ = 0, overlap_ = 0;
  int along_ = 0;        ///< work that it took to go along with the hand when it was last not seen where it would rest
  bool easing_ = false;  ///< an edit has left the ball in the air
  double left_ = 0;      ///< of the way to where the ball would come to rest, after the last tick
  int searches_ = 0, work_ = 0;
};

}  // namespace relief
