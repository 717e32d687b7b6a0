// The force law: from one reading and one snapshot to one force. A pure function with a small state.
#pragma once

#include <relief/core/ball_proxy.h>
#include <relief/core/point_shell.h>
#include <relief/core/proxy.h>
#include <relief/haptics/device.h>
#include <relief/haptics/fault.h>
#include <relief/haptics/force_blend.h>
#include <relief/haptics/guard.h>
#include <relief/haptics/placement.h>
#include <relief/haptics/readings.h>
#include <relief/haptics/shading.h>
#include <relief/haptics/texture_fade.h>
#include <relief/haptics/workspace.h>

#include <cstdint>
#include <span>

namespace relief {

/// The version of the force law and of what judges its readings: one more with each change after which the same
/// readings give other forces. Recordings say under which they were made; those that do not, under 1.
inline constexpr int kContactLaw = 2;

/// Numbers that are not finite or negative count as 0 (an infinite one as the device's limit).
struct ForceSettings {
  double stiffness = 400;      ///< N/m at the hand; clamped to the device's max_stiffness
  double damping = 1;          ///< N*s/m along the normal; clamped to the device's max_damping; never pulls inwards
  double friction = 0;         ///< Coulomb coefficient of a tool that slides, 0 off; layers of the model come before it
  double static_friction = 0;  ///< that of one at rest, never less than the other one; 0: the same
  double max_force = 1e9;      ///< N; clamped to the device's
  /// The spring pulls straight towards the surface contact point, which gains no energy, in place of the interpolated
  /// normal (paper, Sec. 3.4), which feels smoother. A ball's and a rigid tool's always do.
  bool exact_normals = false;
  /// Contact as the paper has it (Sec. 3.3 and 3.4): a function of the cursor's place alone, with the contact point off
  /// the surface; it is lost below the slabs. Of a point, whatever the tool.
  bool paper_contact = false;
  /// A person's hand is on the device: the passivity controller, the limits on lasting force, work and speed, and the
  /// one on the first contact hold (ForceGuard). Off, for the bare law on a given motion, only those on force and rate.
  bool guard = true;
};

/// What the hand holds, in model units.
struct TouchTool {
  double radius = 0;  ///< of a ball around the device's position; 0: a point
  /// Of a rigid tool made of points, in its own frame, the device's position being its origin; empty: a point or ball.
  /// At most PointShell::kMostPoints. They belong to the caller, are copied where a servo is made, and are the servo's
  /// for good.
  std::span<const Vec3d> points = {};
};

struct ServoSettings {
  Workspace workspace = {};
  ForceSettings force = {};
  TouchTool tool = {};
  ReadingSettings readings = {};
  Clutch clutch = {};
};

/// Everything about one tick; trivially copyable, so that it fits the telemetry queue and a recording.
struct ServoSample {
  double t = 0;       ///< s, as the device gave it
  Vec3d device;       ///< m, as read
  Vec3d cursor;       ///< model units; the last good one when this reading's position is bad
  Quatd orientation;  ///< from the tool's frame to the model's, unit; the last good one when this reading's is bad
  Vec3d velocity;     ///< m/s of the hand, as used, along the model's axes
  bool contact = false;
  /// Slab, u, v of the surface contact point; alpha of the cursor where it is in that slab, else of the surface there.
  /// Slab kNoSlab without contact.
  SlabCoord at;
  /// Model units: from the cursor to the surface contact point; to the ball's centre; of a rigid tool, that of all its
  /// points together (PointShell), up to 1.54 times the deepest point's.
  double depth = 0;
  Vec3d contact_point;  ///< surface contact point, model units; the cursor without contact
  /// Unit outwards, along which the spring pushes: the surface's at the contact point, interpolated; with
  /// exact_normals, and where the surface there does not face the tool, the way from the tool to that point. Zero
  /// without contact.
  Vec3d normal;
  Vec3d force;                   ///< N, on the hand, after all limits, along the model's axes
  Vec3d torque;                  ///< N*m, likewise, about the device's position; zero for a point and a ball
  double leak = 0;               ///< J of energy that came from nowhere lately (ForceGuard::leak)
  std::uint32_t buttons = 0;     ///< as DeviceState has them, debounced
  std::uint32_t flags = 0;       ///< ServoFault bits
  std::uint32_t compute_ns = 0;  ///< filled by the servo thread
  std::uint32_t late_ns = 0;     ///< wake-up error, filled by the servo thread
};

/// One per device. step() neither allocates, locks nor calls the system. Its result depends only on the settings, the
/// snapshot and the readings so far.
class Servo {
 public:
  /// Allocates for the points of the tool.
  Servo(const ServoSettings& settings, const DeviceInfo& device);
  /// Any input gives a finite force within the limits. Bad input gives zero force in the same tick, and none until a
  /// good reading outside the solid. A reading that is the last one again is answered as that was, for 20 ms at most.
  /// The force may shrink at once but grows and turns by max_force_rate at most.
  [[nodiscard]] ServoSample step(const Snapshot& model, const DeviceState& reading) noexcept;
  /// The next reading comes after a standstill of the loop that its own time does not show: the safe state.
  void stalled() noexcept { readings_.interrupt(ServoFault::Stalled); }
  /// The next reading is the first after some to which the device did not answer: the safe state.
  void reconnected() noexcept { readings_.interrupt(ServoFault::Reconnected); }
  /// From the thread that calls step(). Another radius or kind of contact starts anew: no force until the tool is
  /// outside the solid. Another workspace takes the contact along, without a step of the force: it blends over some 50
  /// ms. Only where a tool that touches nothing comes over 3 mm (at the hand) further, and into the solid, it is a new
  /// start.
  void set(const ServoSettings& settings) noexcept;
  [[nodiscard]] const ServoSettings& settings() const noexcept { return settings_; }
  /// How the device's workspace lies now: as set, but for what clutch and re-centring have moved it by.
  [[nodiscard]] const Workspace& workspace() const noexcept { return placement_.workspace(); }
  /// What the device is to be told after the last step: that step's force and torque in its axes.
  [[nodiscard]] Wrench command() const noexcept { return workspace().command_to_device({last_.force, last_.torque}); }

 private:
  /// What the settings and the device allow together; every number finite and not negative.
  struct Limits {
    double stiffness = 0, damping = 0, friction = 0, static_friction = 0, max_force = 0;
    bool clamped = false;
    bool lowered = false;  ///< stiffness, because ticks come late
  };
  void limit_settings() noexcept;
  /// The workspace was another one in the last tick.
  void workspace_changed(const Placement::Change& change) noexcept;
  /// The last answer again, for a reading that is the last one again.
  void hold(const Readings::Judged& now, const DeviceState& reading) noexcept;
  /// The answer to a reading.
  [[nodiscard]] ServoSample feel(const Snapshot& model, const DeviceState& reading,
                                 const Readings::Judged& now) noexcept;
  /// No force, and none that comes from what was felt before.
  void give_nothing() noexcept;
  /// What is left of the force of a contact from which the model was moved away.
  void fade_out(ServoSample& sample, double dt, double gift) noexcept;
  /// Limits the settings anew where ticks have begun to come late.
  void follow_period() noexcept;
  /// What the tool touches in this tick.
  struct Touch {
    bool touching = false;
    SlabCoord at;
    SurfacePoint surface;
    Vec3d contact_point;
    Vec3d normal;         ///< along which the tool is pushed out
    double depth = 0;     ///< model units, of which the spring holds energy
    double push = 0;      ///< model units, by which the spring pushes
    double grown = 0;     ///< model units of the depth that the surface added in this tick, not the hand
    Vec3d twist;          ///< torque of the spring about the tool's origin at stiffness 1, model units squared
    Vec3d arm;            ///< from there to where it touches, model units
    double spread = 0;    ///< how far around that place it touches, model units
    bool jumped = false;  ///< material came to the tool rather than the tool to the material
  };
  [[nodiscard]] Touch touch(const Snapshot& model, const ToolPose& tool, const Readings::Judged& now) noexcept;
  [[nodiscard]] Touch point_touch(const Snapshot& model, Vec3d cursor, Proxy::Ease ease) noexcept;
  [[nodiscard]] Touch ball_touch(const Snapshot& model, Vec3d cursor, Proxy::Ease ease) noexcept;
  [[nodiscard]] Touch shell_touch(const Snapshot& model, const ToolPose& tool, Proxy::Ease ease) noexcept;
  /// As the paper has it, and wherever no surface contact point is held.
  [[nodiscard]] Touch paper_touch(const Snapshot& model, Vec3d cursor, double travel) noexcept;
  /// Whether material came to the tool rather than the tool to the material.
  [[nodiscard]] bool risen(double rise) const noexcept;
  /// For paper_contact.
  [[nodiscard]] bool surface_jumped(const Snapshot& model, double depth, double travel) const noexcept;
  /// Whether the tool may be in the material.
  [[nodiscard]] bool inside(const Snapshot& model, const ToolPose& tool) noexcept;
  /// Forgets what the tool touches.
  void start_contact_anew() noexcept;
  struct Friction {
    Vec3d force, torque;  ///< N; N*m about where the tool touches
    double stored = 0;    ///< J in its springs
  };
  /// `turn`: of the tool since the last tick, rad.
  [[nodiscard]] Friction friction(const Snapshot& model, const Touch& touch, Vec3d position, Vec3d turn,
                                  double stiffness, double normal_force) noexcept;
  /// By how much such a force bends the spring, model units; without end where there is none.
  [[nodiscard]] double depth_for(double force) const noexcept;
  /// J in the spring at a depth in m.
  [[nodiscard]] double in_spring(double stiffness, double depth) const noexcept;
  struct Stored {
    double all = 0, gift = 0;  ///< J in the spring; those of them that the surface added in this tick, not the hand
  };
  [[nodiscard]] Stored stored(double stiffness, const Touch& felt) const noexcept;
  void let_go() noexcept;

  ServoSettings settings_;
  DeviceInfo device_;
  Readings readings_;
  Limits limits_;
  LocateHint hint_;
  // Of these the one that the settings name is in use.
  Proxy proxy_;
  TextureFade fade_;
  Shading shading_;
  BallProxy ball_;
  PointShell shell_;
  ForceBlend blend_;
  Wrench asked_;      ///< by the law in the last tick, or as it was blended
  ServoSample last_;  ///< of the last tick
  Placement placement_;
  bool first_ = true;
  bool latched_ = false;
  bool start_inside_ = false;
  double late_ = 0, softer_ = 1;          ///< as readings_ had them when the settings were limited last
  Vec3d last_cursor_;                     ///< model units
  double last_depth_ = 0;                 ///< m
  double last_share_ = 1;                 ///< of the stiffness, by the model's layer
  double last_stored_ = 0;                ///< J in the springs of friction
  bool was_in_slab_ = false;              ///< and not in a hole of the surface
  const Snapshot* last_model_ = nullptr;  ///< compared only, never followed
  std::uint64_t cage_ = 0;                ///< number of the last tick's
  ForceGuard guard_;
  double gift_ = 0;  ///< J, what new settings added to the spring since the last tick
  bool has_anchor_ = false, sliding_ = false;
  Vec3d anchor_;     ///< m, where friction holds the tool
  double spin_ = 0;  ///< rad about the normal, from where friction holds it
};

}  // namespace relief
