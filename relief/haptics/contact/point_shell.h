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

/// A point shell (after McNeely, Puterbaugh and Troy 1999): each point of the tool inside the surface has a contact
/// point of its own (Proxy). They push with the gradient of one depth, the 16-norm of theirs, which has no step where
/// points come or go. Never allocates or locks. Cost per tick: at most kWork; the rest comes first in the next tick.
class PointShell {
 public:
  static constexpr std::size_t kMostPoints = TouchTool::kMostPoints;
  /// In the time of a sample that is placed, about 25 ns: 0.16 ms of a tick. With half of it, points wait too long
  /// (NoPointWaitsLong).
  static constexpr int kWork = 6400;

  /// Points in the tool's own frame, model units; those beyond kMostPoints are left out.
  explicit PointShell(std::span<const Vec3d> points);

  [[nodiscard]] std::size_t size() const noexcept { return points_.size(); }
  /// By how much the tool can be stiffer than a single point: where all touch alike.
  [[nodiscard]] double most_stiffening() const noexcept;

  /// Ends every contact. The next pose is taken to be in free space.
  void reset() noexcept;
  /// Returns whether no point is known to be inside the solid at this pose. Points below all slabs are found a few at a
  /// time, so yes may take some ticks of asking.
  [[nodiscard]] bool clear(const Snapshot& model, const ToolPose& pose) noexcept;
  /// Returns whether a tool of which no point is held lies in the solid: its first point tells. Others that are in a
  /// slab below the surface come out of it in the next ticks.
  [[nodiscard]] bool is_buried(const Snapshot& model, const ToolPose& pose) const noexcept;
  /// Returns one tick: the tool has moved to `pose`, and the model may have changed. Returns whether it is pushed, or a
  /// point is held. Its push changes by no more than what is held may go: 10 times the way of the tool's points, or 2 %
  /// of the push.
  bool step(const Snapshot& model, const ToolPose& pose) noexcept;

  /// Returns how far the surface rose in this tick under a held point, or past a free one, at most, model units.
  [[nodiscard]] double rise() const noexcept { return rise_; }
  /// Returns whether a point lost its contact in the solid because no surface is where it was.
  [[nodiscard]] bool lost() const noexcept { return lost_; }
  /// The model has changed, and maybe not all points have been dealt with since.
  [[nodiscard]] bool settling() const noexcept { return settling_; }
  /// Returns how many points are held, and how many were worked on in this tick.
  [[nodiscard]] int held() const noexcept { return held_; }
  [[nodiscard]] int worked() const noexcept { return worked_; }
  /// Returns what the last tick took, in the time of a sample that is placed, about 25 ns.
  [[nodiscard]] int work() const noexcept { return work_; }
  /// For how many ticks a point that was dealt with in this one had waited for that, at most.
  [[nodiscard]] int waited() const noexcept { return waited_; }
  /// The rest is for a tool that is pushed. The depth of all points together, model units.
  [[nodiscard]] double depth() const noexcept { return answer_.depth; }
  /// Returns the force of a spring of stiffness 1: depth() for one point, up to the square root of most_stiffening()
  /// times that where many are equally deep. Model units.
  [[nodiscard]] Vec3d push() const noexcept { return answer_.push; }
  /// Returns its torque about the pose's origin, model units squared.
  [[nodiscard]] Vec3d twist() const noexcept { return answer_.twist; }
  /// Returns the surface contact point of the deepest point, or of the last that was.
  [[nodiscard]] const SurfacePoint& surface() const noexcept { return surface_; }
  /// Returns where the tool touches: the mean of the points that push, by their parts of the push; and how far around
  /// that, root mean square across the push. Model units.
  [[nodiscard]] Vec3d touched() const noexcept { return touched_; }
  [[nodiscard]] double spread() const noexcept { return spread_; }

 private:
  /// Holds what is known of a point.
  struct Point {
    Vec3d own;   ///< in the tool's frame
    Vec3d now;   ///< model units
    Vec3d last;  ///< where it was dealt with last
    bool held = false;
    // Of a held one:
    Vec3d way_out = {};
    double depth = 0;  ///< at `last`
    // Of a free one:
    double room = 0;           ///< so far it may go from `last` and not meet the surface of the last tick's model
    SlabId nearest = kNoSlab;  ///< where the surface was nearest when it was looked for last
    // Of each:
    bool old_model = false;  ///< it was not yet looked at in the last tick's model, which may have another surface
    std::uint32_t dealt_with = 0;  ///< number of the tick

    /// Returns the way out of a point that was not worked on in this tick stays as it was; only the point has moved.
    [[nodiscard]] double depth_now() const noexcept { return std::max(0.0, depth - dot(now - last, way_out)); }
  };
  /// Holds how the tool is pushed.
  struct Answer {
    Vec3d push, twist;
    double depth = 0;
  };
  void start(const Snapshot& model, const ToolPose& pose) noexcept;
  /// Takes in where the tool is now, and which model it is in.
  void move(const Snapshot& model, const ToolPose& pose) noexcept;
  /// Returns whether a free point is sure not to have met the surface, or else where the surface has risen past it.
  [[nodiscard]] bool stays_clear(MicroTriangles& surface, Point& point, std::optional<SlabCoord>& risen) noexcept;
  void work_on(MicroTriangles& surface, Point& point, Proxy& proxy) noexcept;
  void sum(Vec3d origin) noexcept;
  /// Leads the push over to that of the points by no more than what is held may go in a tick: a point that slips off a
  /// ridge, or comes free, leaves the tool to the others in steps.
  void follow(const Answer& before, const ToolPose& pose) noexcept;

  std::vector<Point> points_;
  std::vector<Proxy> proxies_;
  struct {
    Vec3d middle;
    double radius = 0;
  } ball_;  ///< around all points, in the tool's frame
  LocateHint hint_;
  bool started_ = false;
  std::uint64_t model_ = 0;  ///< number of the last tick's
  std::uint64_t cage_ = 0;   ///< number of its cage
  std::uint32_t tick_ = 0;
  std::size_t next_ = 0;   ///< the point that is dealt with first in the next tick
  std::size_t clean_ = 0;  ///< points that were found not to be below the slabs, one after the other
  double rise_ = 0, most_depth_ = 0;
  std::size_t deepest_ = 0;
  bool lost_ = false, settling_ = false;
  int held_ = 0, worked_ = 0, work_ = 0, waited_ = 0;
  Answer answer_;
  ToolPose pose_;     ///< of the last tick
  double reach_ = 0;  ///< of its points from its origin
  Vec3d touched_;
  double spread_ = 0;
  SurfacePoint surface_;
};

}  // namespace relief
