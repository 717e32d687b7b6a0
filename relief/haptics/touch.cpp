#include <relief/core/sweep.h>
#include <relief/haptics/contact/ball_proxy.h>
#include <relief/haptics/contact/point_shell.h>
#include <relief/haptics/contact/proxy.h>
#include <relief/haptics/touch.h>

#include <algorithm>
#include <cmath>
#include <optional>

namespace relief {

namespace {

/// A place of the surface that is reported as it is, with its own alpha.
void tell(Touched& now, const SurfacePoint& surface) noexcept {
  now.surface = surface;
  now.contact_point = surface.position;
  now.at = {surface.slab, surface.u, surface.v, surface.alpha};
}

/// A point, or a ball: which of them may change without an allocation.
class TipTouch final : public Touch {
 public:
  explicit TipTouch(double radius) : radius_(radius) {}
  [[nodiscard]] std::unique_ptr<Touch> clone() const override { return std::make_unique<TipTouch>(*this); }
  void reset() noexcept override {
    proxy_.reset();
    ball_.reset();
  }
  void resize(double radius) noexcept override { radius_ = radius; }
  [[nodiscard]] bool is_looking() const noexcept override { return radius_ > 0 && ball_.is_looking(); }
  [[nodiscard]] bool is_buried(const Snapshot& model, const ToolPose& pose) noexcept override {
    LocateHint hint = hint_;
    return inside(model, pose.origin, hint);
  }
  [[nodiscard]] bool clear(const Snapshot& model, const ToolPose& pose) noexcept override {
    LocateHint hint = hint_;
    return !inside(model, pose.origin, hint) && (radius_ == 0 || BallProxy::clear(model, pose.origin, radius_));
  }
  [[nodiscard]] Touched step(const Snapshot& model, const ToolPose& pose, double jump) noexcept override {
    return radius_ > 0 ? ball(model, pose, jump) : point(model, pose, jump);
  }

 private:
  [[nodiscard]] Touched point(const Snapshot& model, const ToolPose& pose, double jump) noexcept {
    Touched now;
    now.touching = proxy_.step(model, pose.origin) && proxy_.depth() > 0;
    now.settling = proxy_.settling();
    now.jumped = proxy_.lost() ? inside(model, pose.origin, hint_) : proxy_.rise() > jump;
    if (!now.touching) return now;
    const Proxy::Description there = proxy_.describe(model);
    tell(now, there.surface);
    now.at.alpha = there.alpha;
    now.normal = there.normal;
    now.turn = there.turn;
    now.way_out = proxy_.way_out();
    now.depth = now.push = proxy_.depth();
    return now;
  }
  [[nodiscard]] Touched ball(const Snapshot& model, const ToolPose& pose, double jump) noexcept {
    Touched now;
    double to_go = 0;  // through the air to what it will touch
    now.touching = ball_.step(model, pose.origin, radius_);
    now.settling = ball_.settling();
    now.jumped = ball_.lost() || ball_.rise() > jump;
    SurfacePoint surface = ball_.surface();
    if (!now.touching && ball_.held()) {
      // Under a fast hand it has not come as near as to touch: held back by what is ahead, or late on a free way.
      const Vec3d far = ball_.way_out() * (ball_.depth() + radius_);
      if (const auto ahead = first_entry(model, ball_.centre(), ball_.centre() - far)) {
        now.touching = true;
        surface = ahead->point;
        to_go = std::clamp(length(surface.position - ball_.centre()) - radius_, 0.0, ball_.depth());
      }
    }
    if (!now.touching) return now;
    tell(now, surface);
    now.normal = now.way_out = ball_.way_out();
    now.depth = now.push = ball_.depth() - to_go;
    return now;
  }

  double radius_;
  Proxy proxy_;
  BallProxy ball_;
  LocateHint hint_;
};

class ShellTouch final : public Touch {
 public:
  explicit ShellTouch(std::span<const Vec3d> points) : shell_(points) {
    for (const Vec3d p : points) reach_ = std::max(reach_, length(p));
  }
  [[nodiscard]] std::unique_ptr<Touch> clone() const override { return std::make_unique<ShellTouch>(*this); }
  void reset() noexcept override { shell_.reset(); }
  [[nodiscard]] bool is_buried(const Snapshot& model, const ToolPose& pose) noexcept override {
    return shell_.is_buried(model, pose);
  }
  [[nodiscard]] bool clear(const Snapshot& model, const ToolPose& pose) noexcept override {
    return shell_.clear(model, pose);
  }
  [[nodiscard]] double most_stiffening() const noexcept override { return shell_.most_stiffening(); }
  [[nodiscard]] double reach() const noexcept override { return reach_; }
  [[nodiscard]] Touched step(const Snapshot& model, const ToolPose& pose, double jump) noexcept override {
    Touched now;
    const bool held = shell_.step(model, pose);
    now.settling = shell_.settling();
    now.jumped = shell_.lost() || shell_.rise() > jump;
    now.push = length(shell_.push());
    // A point that is held right on the surface does not push, and tells of no place.
    now.touching = held && now.push > 0 && std::isfinite(now.push);
    // Where the deepest point has lost its place and could not be dealt with in this tick, that is judged in the next.
    now.touching = now.touching && !now.jumped && shell_.surface().slab != kNoSlab;
    if (!now.touching) return now;
    tell(now, shell_.surface());
    now.depth = shell_.depth();
    now.normal = now.way_out = shell_.push() / now.push;
    now.twist = shell_.twist();
    now.arm = shell_.touched() - pose.origin;
    now.spread = shell_.spread();
    return now;
  }

 private:
  PointShell shell_;
  double reach_ = 0;
};

class PaperTouch final : public Touch {
 public:
  [[nodiscard]] std::unique_ptr<Touch> clone() const override { return std::make_unique<PaperTouch>(*this); }
  void reset() noexcept override { *this = {}; }
  [[nodiscard]] bool is_buried(const Snapshot& model, const ToolPose& pose) noexcept override {
    LocateHint hint = hint_;
    return inside(model, pose.origin, hint);
  }
  [[nodiscard]] bool clear(const Snapshot& model, const ToolPose& pose) noexcept override {
    LocateHint hint = hint_;
    return !inside(model, pose.origin, hint);
  }
  [[nodiscard]] Touched step(const Snapshot& model, const ToolPose& pose, double jump) noexcept override {
    Touched now;
    const Vec3d cursor = pose.origin;
    const std::optional<Contact> contact = probe(model, cursor, hint_);
    now.touching = contact && contact->touching() && std::isfinite(contact->depth);
    if (now.touching) {
      now.at = contact->at;
      now.surface = contact->surface;
      now.depth = now.push = contact->depth;
      now.normal = now.way_out = now.surface.normal;
      now.contact_point = cursor + now.normal * now.depth;
      now.jumped = known_ && came_to_it(model, cursor, now.depth, jump);
    }
    last_ = cursor;
    depth_ = now.depth;
    model_ = model.number();
    in_slab_ = contact && !contact->hole;
    known_ = true;
    return now;
  }

 private:
  /// Returns whether the depth is more than the hand could have pressed.
  [[nodiscard]] bool came_to_it(const Snapshot& model, Vec3d cursor, double depth, double jump) const noexcept {
    if (model.number() != model_) {
      LocateHint hint = hint_;
      const std::optional<Contact> before = probe(model, last_, hint);
      if (before && before->depth > depth_ + jump) return true;
    }
    // From outside the slabs: the hand has come through the surface, or up from below.
    MicroTriangles surface(model);
    return !in_slab_ && depth > jump && !Sweep(surface, last_, cursor, Crossing::In).run();
  }

  LocateHint hint_;
  bool known_ = false;
  bool in_slab_ = false;  ///< and not in a hole of the surface
  Vec3d last_;
  double depth_ = 0;
  std::uint64_t model_ = 0;  ///< number of the last tick's
};

}  // namespace

std::unique_ptr<Touch> make_touch(const TouchTool& tool) {
  if (!tool.points.empty()) return std::make_unique<ShellTouch>(tool.points);
  return std::make_unique<TipTouch>(tool.radius);
}

std::unique_ptr<Touch> make_paper_touch() { return std::make_unique<PaperTouch>(); }

}  // namespace relief
