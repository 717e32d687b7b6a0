// A rigid tool made of points that touches the displaced surface.
#pragma once

#include <relief/haptics/contact/proxy.h>
#include <relief/haptics/touch.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace relief {

/// A point shell (after McNeely, Puterbaugh and Troy 1999): each point of the tool that goes into the surface has a
/// surface contact point of its own (Proxy). Together they push with the gradient of half the square of one depth, the
/// 16-norm of theirs, without a step where a point comes in or goes out. Of m points that are equally deep and pushed
/// the same way that depth is m^(1/16) times theirs, and the push m^(1/8) times (1.54 and 2.37 times for 1,000). After
/// construction it neither allocates nor locks. Cost per tick: next to nothing for points that are known to be away
/// from the surface, one or two microseconds every now and then to know it, a third of a microsecond in contact and
/// five where it begins, until kWork is done; what is left is dealt with first in the next tick, and until then pushed
/// along the way that it last was. Points that hardly push come last, but every fourth tick like any other, so that
/// none waits for longer than all of them take: of 1,000 points in rough ground, 30 ticks where a hand shakes the tool
/// at a quarter of a metre per second, 100 at one.
class PointShell {
 public:
  static constexpr std::size_t kMostPoints = TouchTool::kMostPoints;
  static constexpr int kWork = 6400;  ///< in the time of a sample that is placed, some 25 ns

  /// Points in the tool's own frame, model units; those beyond kMostPoints are left out.
  explicit PointShell(std::span<const Vec3d> points);

  [[nodiscard]] std::size_t size() const noexcept { return points_.size(); }
  /// By how much the tool can be stiffer than a single point: where all touch alike.
  [[nodiscard]] double most_stiffening() const noexcept;

  /// Lets go of everything. The next pose is taken to be in the open.
  void reset() noexcept;
  /// Whether no point is inside the solid at this pose, as far as it is known: points below all slabs are looked for a
  /// few at a time, so that where there may be such points the answer is yes only after some ticks of asking.
  [[nodiscard]] bool clear(const Snapshot& model, const ToolPose& pose) noexcept;
  /// One tick: the tool has moved to `pose`, and the model may have changed. Whether a point is held.
  bool step(const Snapshot& model, const ToolPose& pose) noexcept;

  /// How the surface rose under a held point, or past a free one, at most in this tick, model units; and whether a
  /// point was let go because its slab was exchanged.
  [[nodiscard]] double rise() const noexcept { return rise_; }
  [[nodiscard]] bool lost() const noexcept { return lost_; }
  /// The model has changed, and maybe not all points have been dealt with since.
  [[nodiscard]] bool settling() const noexcept { return settling_; }
  /// How many points are held, and how many were worked on in this tick.
  [[nodiscard]] int held() const noexcept { return held_; }
  [[nodiscard]] int worked() const noexcept { return worked_; }
  /// For how many ticks a point that was dealt with in this one had waited for that, at most.
  [[nodiscard]] int waited() const noexcept { return waited_; }
  /// The rest is for a tool that is pushed. The depth of all points together, model units.
  [[nodiscard]] double depth() const noexcept { return depth_; }
  /// The force of a spring of stiffness 1: depth() for one point, up to the square root of most_stiffening() times that
  /// where many are equally deep. Model units.
  [[nodiscard]] Vec3d push() const noexcept { return push_; }
  /// Its torque about the pose's origin, model units squared.
  [[nodiscard]] Vec3d twist() const noexcept { return twist_; }
  /// The surface contact point of the deepest point, or of the last that was.
  [[nodiscard]] const SurfacePoint& surface() const noexcept { return surface_; }
  /// Where the tool touches: the mean of the points that push, by their parts of the push; and how far around that,
  /// root mean square across the push. Model units.
  [[nodiscard]] Vec3d touched() const noexcept { return touched_; }
  [[nodiscard]] double spread() const noexcept { return spread_; }

 private:
  /// What is known of a point.
  struct Point {
    Vec3d own;   ///< in the tool's frame
    Vec3d now;   ///< model units
    Vec3d last;  ///< where it was dealt with last
    bool held = false;
    // Of a held one:
    bool light = false;  ///< pushes next to nothing
    Vec3d way_out = {};
    double depth = 0;  ///< at `last`
    // Of a free one:
    double room = 0;           ///< so far it may go from `last` and not meet the surface of the last tick's model
    SlabId nearest = kNoSlab;  ///< where the surface was nearest when it was looked for last
    std::uint8_t close = 0;    ///< ticks for which it is taken to be too near the surface to be told that it is clear
    // Of each:
    bool old_model = false;        ///< it was not yet looked at in the last tick's model
    std::uint32_t dealt_with = 0;  ///< number of the tick

    /// The way out of a point that was not worked on in this tick stays as it was; only the point has moved.
    [[nodiscard]] double depth_now() const noexcept { return std::max(0.0, depth - dot(now - last, way_out)); }
  };
  void start(const Snapshot& model, const ToolPose& pose) noexcept;
  /// Takes in where the tool is now, and which model it is in.
  void move(const Snapshot& model, const ToolPose& pose) noexcept;
  /// Whether a free point is sure not to have met the surface, or else where the surface has risen past it.
  [[nodiscard]] bool stays_clear(MicroTriangles& surface, Point& point, std::optional<SlabCoord>& risen) noexcept;
  void work_on(MicroTriangles& surface, Point& point, Proxy& proxy) noexcept;
  void sum(Vec3d origin) noexcept;

  std::vector<Point> points_;
  std::vector<Proxy> proxies_;
  struct {
    Vec3d middle;
    double radius = 0;
  } ball_;  ///< around all points, in the tool's frame
  LocateHint hint_;
  bool started_ = false;
  std::uint64_t model_ = 0;  ///< number of the last tick's
  std::uint32_t tick_ = 0;
  std::size_t next_ = 0, next_light_ = 0;  ///< the points that are dealt with first in the next tick
  std::size_t clean_ = 0;                  ///< points that were found not to be below the slabs, one after the other
  double rise_ = 0, depth_ = 0, most_depth_ = 0;
  std::size_t deepest_ = 0;
  bool lost_ = false, settling_ = false;
  int held_ = 0, worked_ = 0, work_ = 0, waited_ = 0;
  Vec3d push_, twist_, touched_;
  double spread_ = 0;
  SurfacePoint surface_;
};

}  // namespace relief
