// A ball that touches the displaced surface: held outside it, nearest to the cursor. It neither allocates nor locks.
#pragma once

#include <relief/core/micro_triangles.h>
#include <relief/haptics/contact/principle.h>

#include <memory>

namespace relief {

namespace detail::ball {
class Mover;
struct Around;
}  // namespace detail::ball

/// The ball of one spherical tip: a god-object (Zilles and Salisbury 1995) whose body is the material grown by the
/// radius. Its centre goes towards the cursor as long as no micro-triangle comes nearer than the radius, and then along
/// those that it touches, by bounded steps; past the middle of the grown body it goes by the hand's own sideways way,
/// as a point does (Proxy). Each step is a projection onto half-spaces: around each triangle, the one beyond the plane
/// that touches the radius around the triangle's point nearest to the centre. Their intersection is free of the surface
/// and convex, so that the straight way to any place in it is free. Cost per tick: a few looks around the centre, at
/// most kSearches and one, whatever the number of triangles. They share lists of what is near, which are made anew
/// where the centre leaves them or the model is another. What a tick may take is counted; the rest of the way comes in
/// the next tick. A look that would take too long is left, and goes on there.
class BallProxy {
 public:
  static constexpr int kSearches = 12;

  /// Allocates, as copies do.
  BallProxy() = default;

  /// Lets go. The next cursor is taken to be in the open, with the ball around it.
  void reset() noexcept;
  /// One tick: the cursor has moved straight to `cursor`, and the model may have changed; the radius is one for good.
  /// Whether the ball touches and is held back. Under a cursor that moves by s the held centre moves along the surface
  /// by at most 10 s or a fiftieth of its distance from the cursor; where the model has changed, it comes to rest on
  /// what is there. In the open it follows a cursor that is too far for one tick in several, and is not held until it
  /// has touched something.
  bool step(const Snapshot& model, Vec3d cursor, double radius) noexcept;
  /// Whether no micro-triangle is nearer to the centre than the radius.
  [[nodiscard]] static bool clear(const Snapshot& model, Vec3d centre, double radius) noexcept;

  /// Whether the centre is not where the cursor is.
  [[nodiscard]] bool held() const noexcept { return held_; }
  /// It is so only because it follows in the open.
  [[nodiscard]] bool under_way() const noexcept { return under_way_; }
  /// In this tick a change of the model has moved it, or begun to: there was no time to see where it comes to rest.
  [[nodiscard]] bool settling() const noexcept { return settling_; }
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
  /// Unit, from the cursor to the centre; as it was, where they are one.
  [[nodiscard]] Vec3d way_out() const noexcept { return way_out_; }

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
  /// Takes over what has become of the surface, with the cursor where it was.
  void carry(MicroTriangles& surface, double radius) noexcept;
  /// Towards the cursor, which has moved there with the hand.
  void go(MicroTriangles& surface, Vec3d cursor, double radius) noexcept;
  /// Past the middle: by the hand's own way.
  void go_along(detail::ball::Mover& ball, Vec3d move, int work) noexcept;
  /// Whether the line from the centre through the cursor leaves the grown body within twice the depth.
  [[nodiscard]] bool past_the_middle(const Snapshot& model, Vec3d cursor, double radius) const noexcept;
  /// The ball stays where its mover has come to.
  void arrive(detail::ball::Mover& ball, double radius) noexcept;
  /// Finds where it touches.
  void touch(MicroTriangles& surface, const detail::ball::Around& around, double radius) noexcept;

  OwnMemory memory_;  ///< what is known of the surface, and room to work in; 3.2 MiB
  bool known_ = false, held_ = false, lost_ = false;
  bool settled_ = true;  ///< it has come to rest after the last change of the surface
  bool settling_ = false;
  bool touches_ = false;     ///< surface_ is a place
  bool under_way_ = false;   ///< in the open, to a cursor too far away for one tick
  int late_ = 0;             ///< for so many ticks away from the cursor, with nothing found that it touches
  std::uint64_t model_ = 0;  ///< number of the last tick's
  Vec3d last_;               ///< the last cursor
  Vec3d centre_;
  bool behind_ = false;  ///< the nearest triangle in the ball shows its back: a sheet that the ball came to from there
  detail::CellNormals normals_;
  SurfacePoint surface_;
  detail::Ledger ledger_;
  Vec3d way_out_;
  double depth_ = 0, rise_ = 0, overlap_ = 0;
  int searches_ = 0, work_ = 0;
};

}  // namespace relief
