// What a held tool touches: what a point, a ball and a rigid tool all answer.
#pragma once

#include <relief/core/query.h>

#include <cstddef>
#include <memory>
#include <span>

namespace relief {

/// Holds what the hand holds, in model units.
struct TouchTool {
  static constexpr std::size_t kMostPoints = 1000;  ///< points that a rigid tool may have

  double radius = 0;  ///< of a ball around the device's position; 0: a point
  /// Of a rigid tool made of points, in its own frame, the device's position being its origin; empty: a point or ball.
  /// At most kMostPoints. They belong to the caller, are copied where a servo is made, and are the servo's for good.
  std::span<const Vec3d> points = {};
};

/// The radii that a ball may have on a model of this diagonal: a smaller one is a point, a larger one looks at too much
/// of the surface for a tick.
struct BallRange {
  /// of the diagonal
  static constexpr double kLeast = 1e-6, kMost = 0.05;  // of the diagonal

  /// m; radii that a device's tool may have
  double least = 0, most = 0;
  /// Returns whether such a radius may be set.
  [[nodiscard]] bool has(double radius) const noexcept { return radius >= least && radius <= most; }
};
[[nodiscard]] constexpr BallRange ball_range(double diagonal) noexcept {
  return {BallRange::kLeast * diagonal, BallRange::kMost * diagonal};
}

/// Says where a tool is: its own frame in the model's.
struct ToolPose {
  Vec3d origin;       ///< model units
  Quatd orientation;  ///< unit
  /// Returns a point of the tool, in the model.
  [[nodiscard]] Vec3d place(Vec3d own) const noexcept { return origin + orientation.turn(own); }
};

/// Holds what a tool touches in one tick. All but the first three is for a tool that touches.
struct Touched {
  bool touching = false;  ///< whether the tool touches
  bool jumped = false;    ///< material came to the tool by more than the hand could have pressed
  bool settling = false;  ///< the surface has changed: what is touched has changed by more than the hand has done
  /// Slab, u, v of the surface contact point; alpha of the cursor where it is in that slab, else of the surface there.
  SlabCoord at;
  SurfacePoint surface;  ///< where the surface is touched
  Vec3d contact_point;   ///< where the tool would be if nothing gave way
  Vec3d normal;          ///< unit, along which the tool is pushed out
  Vec3d way_out;         ///< unit, straight from the tool to where it is held
  double depth = 0;      ///< model units, of which the spring holds energy
  double push = 0;       ///< model units, by which the spring pushes
  double turn = 0;       ///< rad that the normal may have turned by in this tick
  Vec3d twist;           ///< torque of the spring about the tool's origin at stiffness 1, model units squared
  Vec3d arm;             ///< from there to where it touches, model units
  double spread = 0;     ///< how far around that place it touches, model units
};

/// The contact of one tool. After construction it neither allocates nor locks; copies allocate.
class Touch {
 public:
  virtual ~Touch() = default;
  /// Returns a copy with its contact.
  [[nodiscard]] virtual std::unique_ptr<Touch> clone() const = 0;
  /// Ends the contact. The next pose is taken to be in free space.
  virtual void reset() noexcept = 0;
  /// Returns one tick: the tool has moved straight to `pose`, and the model may have changed. A rise of the surface by
  /// more than `jump` (model units) counts as one that the hand could not have pressed.
  [[nodiscard]] virtual Touched step(const Snapshot& model, const ToolPose& pose, double jump) noexcept = 0;
  /// A ball of another radius, or a point; a tool made of points stays as it is. To be followed by reset().
  virtual void resize(double /*radius*/) noexcept {}
  /// Returns whether a tool that touches nothing lies in the material nevertheless, as where the cage has been
  /// exchanged around it: it may be below all slabs.
  [[nodiscard]] virtual bool is_buried(const Snapshot& model, const ToolPose& pose) noexcept = 0;
  /// Returns whether the last step had no time to find what is around the tool. On another model that begins anew.
  [[nodiscard]] virtual bool is_looking() const noexcept { return false; }
  /// Returns whether the tool is outside the material.
  [[nodiscard]] virtual bool clear(const Snapshot& model, const ToolPose& pose) noexcept = 0;
  /// Returns how many times as stiff as a single point the tool can be.
  [[nodiscard]] virtual double most_stiffening() const noexcept { return 1; }
  /// Returns how far from its origin the tool reaches, model units: what a turn moves.
  [[nodiscard]] virtual double reach() const noexcept { return 0; }
};

[[nodiscard]] std::unique_ptr<Touch> make_touch(const TouchTool& tool);
/// Returns a point's contact as the paper has it (Sec. 3.3 and 3.4): a function of the cursor's place alone, with the
/// contact point off the surface; it is lost below the slabs.
[[nodiscard]] std::unique_ptr<Touch> make_paper_touch();

}  // namespace relief
