// The force law: from one reading and one snapshot to one force. A pure function with a small state.
#pragma once

#include <relief/haptics/device.h>
#include <relief/haptics/fault.h>
#include <relief/haptics/guard.h>
#include <relief/haptics/hand_limit.h>
#include <relief/haptics/shading.h>
#include <relief/haptics/texture_fade.h>
#include <relief/haptics/touch.h>

#include <cstdint>
#include <memory>
#include <span>
#include <utility>

namespace relief {

/// model = (device - device_origin) / metres_per_unit + model_origin. Axes are the same: no rotation.
struct Workspace {
  double metres_per_unit = 1;
  Vec3d device_origin = {};  ///< m
  Vec3d model_origin = {};   ///< model units
  [[nodiscard]] Vec3d to_model(Vec3d device) const noexcept {
    return (device - device_origin) / metres_per_unit + model_origin;
  }
  [[nodiscard]] Vec3d to_device(Vec3d model) const noexcept {
    return (model - model_origin) * metres_per_unit + device_origin;
  }
};
/// The model's diagonal becomes 0.15 m (or what fits the device), its centre the device's origin.
[[nodiscard]] Workspace fit_workspace(const DeviceInfo& device, const Box3d& model) noexcept;

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

struct ServoSettings {
  Workspace workspace = {};
  ForceSettings force = {};
  TouchTool tool = {};
};

/// Everything about one tick; trivially copyable, so that it fits the telemetry queue and a recording.
struct ServoSample {
  double t = 0;       ///< s, as the device gave it
  Vec3d device;       ///< m, as read
  Vec3d cursor;       ///< model units; the last good one when this reading's position is bad
  Quatd orientation;  ///< as used, unit; the last good one when this reading's is bad
  Vec3d velocity;     ///< m/s, as used
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
  Vec3d force;      ///< N, on the hand, after all limits
  Vec3d torque;     ///< N*m, on the hand, about the device's position; zero for a point and a ball
  double leak = 0;  ///< J of energy that came from nowhere lately (ForceGuard::leak)
  std::uint32_t buttons = 0;
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
  /// good reading outside the solid. The force may shrink at once but grows and turns by max_force_rate at most.
  [[nodiscard]] ServoSample step(const Snapshot& model, const DeviceState& reading) noexcept;
  /// The next reading comes after a standstill of the loop that its own time does not show: the safe state.
  void stalled() noexcept { stalled_ = true; }
  /// From the thread that calls step(). Another workspace, radius or kind of contact starts anew: no force until the
  /// tool is outside the solid.
  void set(const ServoSettings& settings) noexcept;
  [[nodiscard]] const ServoSettings& settings() const noexcept { return settings_; }

 private:
  /// What the settings and the device allow together; every number finite and not negative.
  struct Limits {
    double stiffness = 0, damping = 0, friction = 0, static_friction = 0, max_force = 0;
    bool clamped = false;
    bool lowered = false;  ///< stiffness, because ticks come late
  };
  /// What step() needs of a reading once it has been compared with the one before.
  struct Admitted {
    std::uint32_t faults = 0;
    bool has_position = false;  ///< the position itself is usable
    double dt = 1e-3;           ///< s, since the last reading
    double travel = 0;          ///< m, since the last reading
  };
  void limit_settings() noexcept;
  /// Takes in the time between two ticks; limits the settings anew where ticks come late.
  void judge_period(double dt) noexcept;
  /// Of the device, as far as it states one.
  [[nodiscard]] bool within_workspace(Vec3d position) const noexcept;
  [[nodiscard]] Admitted admit(const DeviceState& reading) noexcept;
  /// What the tool touches in this tick, and the direction in which the spring pushes.
  [[nodiscard]] Touched touch(const Snapshot& model, const ToolPose& tool, double dt) noexcept;
  /// Forgets what the tool touches.
  void start_contact_anew() noexcept;
  struct Friction {
    Vec3d force, torque;  ///< N; N*m about where the tool touches
    double stored = 0;    ///< J in its springs
  };
  /// `turn`: of the tool since the last tick, rad.
  [[nodiscard]] Friction friction(const Snapshot& model, const Touched& touch, Vec3d position, Vec3d turn,
                                  double stiffness, double normal_force) noexcept;
  /// By how much such a force bends the spring, model units; without end where there is none.
  [[nodiscard]] double depth_for(double force) const noexcept;
  /// J in the spring at a depth in m.
  [[nodiscard]] double in_spring(double stiffness, double depth) const noexcept;
  struct Stored {
    double all = 0, gift = 0;  ///< J in the spring; those of them that the surface added in this tick, not the hand
  };
  [[nodiscard]] Stored stored(double stiffness, const Touched& felt) const noexcept;
  void let_go() noexcept;

  ServoSettings settings_;
  DeviceInfo device_;
  Limits limits_;
  /// Copied with the servo.
  class Held {
   public:
    explicit Held(std::unique_ptr<Touch> touch) noexcept : touch_(std::move(touch)) {}
    Held(const Held& other) : touch_(other.touch_->clone()) {}
    Held(Held&&) noexcept = default;
    Held& operator=(const Held& other) { return *this = Held(other); }
    Held& operator=(Held&&) noexcept = default;
    ~Held() = default;
    Touch* operator->() const noexcept { return touch_.get(); }

   private:
    std::unique_ptr<Touch> touch_;
  };
  Held touch_, paper_;
  HandLimit hand_;
  TextureFade fade_;
  Shading shading_;
  bool first_ = true;
  bool latched_ = false;
  bool start_inside_ = false;
  bool has_time_ = false, has_position_ = false;
  double last_t_ = 0;
  double period_ = 0;    ///< s: one tick in a thousand comes later than that after the one before, or none
  double late_ = 0;      ///< s: how much of that is too late
  double softer_ = 1;    ///< share of the device's stiffness that is good for such ticks
  Vec3d last_position_;  ///< m
  Vec3d last_cursor_;    ///< model units
  Quatd orientation_, last_orientation_;  ///< the last good one, and that of the tick before
  double last_depth_ = 0;                 ///< m
  double last_share_ = 1;                 ///< of the stiffness, by the model's layer
  double last_stored_ = 0;                ///< J in the springs of friction
  std::uint64_t cage_ = 0;                ///< number of the last tick's
  Vec3d velocity_;                        ///< m/s
  ForceGuard guard_;
  double gift_ = 0;  ///< J, what new settings added to the spring since the last tick
  bool stalled_ = false;
  double frozen_ = 0;  ///< s, for which the device's velocity says that it moves and its position stays
  bool has_anchor_ = false, sliding_ = false;
  Vec3d anchor_;     ///< m, where friction holds the tool
  double spin_ = 0;  ///< rad about the normal, from where friction holds it
};

}  // namespace relief
