// A ball that touches the displaced surface: held outside it, nearest to the cursor. It neither allocates nor locks.
#pragma once

#include <relief/core/micro_triangles.h>
#include <relief/haptics/contact/principle.h>
#include <relief/haptics/foothold.h>

#include <memory>
#include <optional>

namespace relief {

namespace detail::ball {
class Mover;
struct Around;
}  // namespace detail::ball

/// The ball of one spherical tip: a god-object (Zilles and Salisbury 1995) whose body is the material grown by the
/// radius. The centre goes towards the cursor by projections onto half-spaces, one beyond each near triangle. Past the
/// middle of the body it follows the hand's sideways motion only (Proxy). Cost per tick: at most kSearches + 1 queries,
/// at any number of triangles. docs/explanation/contact.md explains the ball.
class BallProxy {
 public:
  static constexpr int kSearches = 12;  ///< queries of a tick; what is left of its way waits for the next

  /// Allocates, as copies do.
  BallProxy() = default;

  /// Ends the contact. The next cursor is taken to be in free space, with the ball around it.
  void reset() noexcept;
  /// Returns one tick: the cursor has moved straight to `cursor`; the model may have changed, the radius never does.
  /// Returns whether the ball is held. While the cursor moves by s, the held centre moves by at most 10 s or 2 % of its
  /// distance to the cursor. An edit brings it to rest on the new surface. In free space it may follow a far cursor
  /// over several ticks.
  bool step(const Snapshot& model, Vec3d cursor, double radius) noexcept;
  /// Returns whether no micro-triangle is nearer to the centre than the radius.
  [[nodiscard]] static bool clear(const Snapshot& model, Vec3d centre, double radius) noexcept;

  /// Returns whether the centre is not where the cursor is.
  [[nodiscard]] bool held() const noexcept { return held_; }
  /// It is so only because it follows in free space, and has not touched anything yet.
  [[nodiscard]] bool under_way() const noexcept { return under_way_; }
  /// In this tick a change of the model has moved it, or begun to: there was no time to see where it comes to rest.
  [[nodiscard]] bool settling() const noexcept { return settling_; }
  /// Returns whether it has had no time yet to see what is around it. On another model it would begin anew.
  [[nodiscard]] bool is_looking() const noexcept;
  /// Searches that the last tick took.
  [[nodiscard]] int searches() const noexcept { return searches_; }
  /// Returns what the last tick took, in the time of a sample that is placed, about 25 ns.
  [[nodiscard]] int work() const noexcept { return work_; }
  [[nodiscard]] Vec3d centre() const noexcept { return centre_; }
  /// Returns how far the surface rose into the ball in this tick, model units.
  [[nodiscard]] double rise() const noexcept { return rise_; }
  /// Returns the surface rose beyond the ball's centre in this tick.
  [[nodiscard]] bool lost() const noexcept { return lost_; }
  /// Returns how far the nearest micro-triangle reaches into the ball, model units: what a risen surface, or one that
  /// the ball came to from behind, has not yet pushed out.
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
  /// How changes of the model have moved the place where the ball touched.
  struct Shift {
    Vec3d way = {};      ///< less what the ball has gone of it
    double carried = 0;  ///< how far the ball went with it, out of the material
    bool lost = false;   ///< it is no more
    bool leads = false;  ///< the ball is on that way already, and goes to its end
  };
  /// The place where the ball touched goes with the material, by which it stays known.
  void follow_surface(MicroTriangles& surface) noexcept;
  /// Takes over what has become of the surface, with the cursor where it was. Whether that may be felt.
  bool carry(MicroTriangles& surface, double radius) noexcept;
  /// Returns whether the surface has risen beyond the centre.
  [[nodiscard]] bool is_buried(const Snapshot& model, const detail::ball::Around& around, double radius) const noexcept;
  /// Towards the cursor, which has moved there with the hand.
  void go(MicroTriangles& surface, Vec3d cursor, double radius) noexcept;
  /// Work that the hand's way may take in a tick, beyond what was done before.
  struct Limits {
    int before, work;
    [[nodiscard]] int half() const noexcept { return before + work / 2; }
    [[nodiscard]] int most() const noexcept { return before + work; }
  };
  /// Past the middle: by the hand's own way.
  void go_along(detail::ball::Mover& ball, Vec3d move, const Limits& limits) noexcept;
  /// Returns whether the line from the centre through the cursor leaves the grown body within twice the depth.
  [[nodiscard]] bool past_the_middle(const Snapshot& model, Vec3d cursor, double radius) const noexcept;
  /// The ball stays where its mover has come to.
  void arrive(detail::ball::Mover& ball, double radius) noexcept;
  /// Returns the place that holds the ball back: one that it touches, or all but touches; else one ahead.
  [[nodiscard]] std::optional<SurfacePoint> place_ahead(MicroTriangles& surface, const detail::ball::Around& around,
                                                        double radius) noexcept;
  /// Finds where it touches: nowhere where it `flies`.
  void touch(MicroTriangles& surface, const detail::ball::Around& around, double radius, bool flies) noexcept;

  OwnMemory memory_;  ///< what is known of the surface, and room to work in; 1.6 MiB
  bool known_ = false, held_ = false, lost_ = false;
  bool settled_ = true;  ///< it has come to rest after the last change of the surface
  bool settling_ = false;
  bool unseen_ = false;      ///< there was no time yet to see what a change of the surface has done
  Shift shift_;              ///< meanwhile
  bool touches_ = false;     ///< surface_ is a place
  bool under_way_ = false;   ///< to a cursor that was too far away for one tick, and it has not landed yet
  int late_ = 0;             ///< for so many ticks away from the cursor, with nothing found that it touches
  std::uint64_t model_ = 0;  ///< number of the last tick's
  Vec3d last_;               ///< the last cursor
  Vec3d centre_;
  bool behind_ = false;  ///< the nearest triangle in the ball shows its back: a sheet that the ball came to from there
  detail::CellNormals normals_;
  SurfacePoint surface_;
  detail::Foothold foothold_;  ///< in its slab
  std::uint64_t cage_ = 0;     ///< number of the last that was seen
  detail::Ledger ledger_;
  Vec3d way_out_;
  double depth_ = 0, rise_ = 0, overlap_ = 0;
  int searches_ = 0, work_ = 0;
};

}  // namespace relief
