// The force law: from one reading and one snapshot to one force. A pure function with a small state.
#pragma once

#include <relief/haptics/device.h>
#include <relief/haptics/fault.h>
#include <relief/haptics/foothold.h>
#include <relief/haptics/force_blend.h>
#include <relief/haptics/friction.h>
#include <relief/haptics/guard.h>
#include <relief/haptics/hand_limit.h>
#include <relief/haptics/placement.h>
#include <relief/haptics/readings.h>
#include <relief/haptics/shading.h>
#include <relief/haptics/texture_fade.h>
#include <relief/haptics/touch.h>
#include <relief/haptics/workspace.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

namespace relief {

/// The version of the force law and of what judges its readings: one more with each change after which the same
/// readings give other forces. Recordings say under which they were made; those that do not, under 1.
inline constexpr int kContactLaw = 15;

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

/// Holds what the servo can be told.
struct ServoSettings {
  Workspace workspace = {};       ///< where the device stands in the model
  ForceSettings force = {};       ///< the law of force, and its limits
  TouchTool tool = {};            ///< what touches
  ReadingSettings readings = {};  ///< which readings are believed
  Clutch clutch = {};             ///< whether the hand moves without the tool
};

/// Everything about one tick; trivially copyable, so that it fits the telemetry queue and a recording.
struct ServoSample {
  double t = 0;          ///< s, as the device gave it
  Vec3d device;          ///< m, as read
  Vec3d cursor;          ///< model units; the last good one when this reading's position is bad
  Quatd orientation;     ///< from the tool's frame to the model's, unit; the last good one when this reading's is bad
  Vec3d velocity;        ///< m/s of the hand, as used, along the model's axes
  bool contact = false;  ///< whether it touches
  /// Slab, u, v of the surface contact point; alpha of the cursor where it is in that slab, else of the surface there.
  /// Slab kNoSlab without contact.
  SlabCoord at;
  /// Model units: from the cursor to the surface contact point; to the ball's centre; of a rigid tool, that of all its
  /// points together (PointShell), up to 1.54 times the deepest point's.
  double depth = 0;
  Vec3d contact_point;  ///< surface contact point, model units; the cursor without contact
  /// Unit outwards, along which the spring pushes: the surface's at the contact point, interpolated; with exact_normals
  /// the way from the tool to that point. Zero without contact.
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
  /// Returns whether the tool still looks for what is around it. Give the next step the same model: on another one that
  /// begins anew.
  [[nodiscard]] bool is_looking() const noexcept { return looking_; }
  /// The next reading comes after a standstill of the loop that its own time does not show: the safe state.
  void stalled() noexcept { readings_.interrupt(ServoFault::Stalled); }
  /// The next reading is the first after some to which the device did not answer: the safe state.
  void reconnected() noexcept { readings_.interrupt(ServoFault::Reconnected); }
  /// Takes new settings. Thread: the one that calls step(). Another radius or kind of contact starts again: no force
  /// until the tool is outside the solid. Another workspace keeps the contact, and the force blends over about 50 ms. A
  /// tool that touches nothing and would land more than 3 mm inside the solid starts again too.
  void set(const ServoSettings& settings) noexcept;
  /// Returns what holds now.
  [[nodiscard]] const ServoSettings& settings() const noexcept { return settings_; }
  /// Returns how the device's workspace lies now: as set, except for what clutch and re-centring have moved it by.
  [[nodiscard]] const Workspace& workspace() const noexcept { return placement_.workspace(); }
  /// Returns what the device is to be told after the last step: that step's force and torque in its axes.
  [[nodiscard]] Wrench command() const noexcept { return workspace().command_to_device({last_.force, last_.torque}); }

 private:
  /// Holds what the settings and the device allow together; every number finite and not negative.
  struct Limits {
    double stiffness = 0, damping = 0, friction = 0, static_friction = 0, max_force = 0;
    bool clamped = false;
    bool lowered = false;  ///< stiffness, because ticks come late
  };
  void limit_settings() noexcept;
  /// The workspace was another one in the last tick.
  void workspace_changed(const Placement::Change& change) noexcept;
  /// The last answer again, for a reading that is the last one again.
  void hold(const Snapshot& model, const Readings::Judged& now, const DeviceState& reading) noexcept;
  /// Returns the surface where it was touched in the last tick, empty where there is none.
  [[nodiscard]] std::optional<SurfacePlace> last_place(MicroTriangles& surface) const noexcept;
  /// What is felt continues from that, though something else than the hand has changed it.
  void lead_over(Vec3d force, Vec3d torque) noexcept;
  /// Returns the answer to a reading.
  [[nodiscard]] ServoSample answer(const Snapshot& model, const DeviceState& reading,
                                   const Readings::Judged& now) noexcept;
  /// Takes in where the hand is, or that this is not known.
  [[nodiscard]] Placement::Place follow_hand(const DeviceState& reading, const Readings::Judged& now) noexcept;
  /// Returns what can be told before anything is felt.
  [[nodiscard]] ServoSample sample_of(const DeviceState& reading, const Readings::Judged& now,
                                      const Placement::Place& at) const noexcept;
  /// Says what is touched.
  static void tell(const Touched& felt, ServoSample& sample) noexcept;
  /// The law: a spring, a damper along it, friction across it, within their limits.
  void push(const Snapshot& model, const Touched& felt, const Placement::Place& at, double dt, double gift,
            ServoSample& sample) noexcept;
  /// Returns by how much the damper weakens the spring, N.
  [[nodiscard]] double damper(const Touched& felt, Vec3d along, bool blended,
                              const Placement::Place& at) const noexcept;
  /// Returns whether no force is given until a good reading outside the solid.
  [[nodiscard]] bool in_safe_state() const noexcept;
  /// Enters the safe state where it is due, and leaves it where the tool has come out.
  void keep_safe(const Snapshot& model, const ToolPose& tool, const Touched& felt, const Readings::Judged& now,
                 ServoSample& sample) noexcept;
  /// Returns whether contact is the paper's: in the safe state there is no way of the cursor to go by.
  [[nodiscard]] bool feels_as_paper() const noexcept;
  /// Returns what the tool touches in this tick.
  [[nodiscard]] Touched feel(const Snapshot& model, const ToolPose& tool) noexcept;
  /// No force, and none that comes from what was felt before.
  void give_nothing() noexcept;
  /// What is left of the force of a contact that something else than the hand has ended.
  void fade_out(const Snapshot& model, ServoSample& sample, double dt, double gift) noexcept;
  /// Limits the settings again where ticks have begun to come late.
  void follow_period() noexcept;
  /// Returns what the tool touches in this tick, felt along the way in which the spring pushes.
  [[nodiscard]] Touched touch(const Snapshot& model, const ToolPose& tool) noexcept;
  /// Along the interpolated normal, as far as that makes no energy.
  [[nodiscard]] Vec3d shaded(const Touched& felt) noexcept;
  /// Takes out of what is touched what goes by too fast to be felt.
  void limit_band(const Snapshot& model, Vec3d origin, Touched& felt) noexcept;
  /// Returns the spring of a contact, led over from the last tick's where it is not the hand that has changed it.
  [[nodiscard]] Wrench spring(const Touched& felt, double stiffness, Vec3d hand_step, double dt) noexcept;
  [[nodiscard]] Friction::Given friction(const Snapshot& model, const Touched& felt, Vec3d along, double stiffness,
                                         double normal_force, const Placement::Place& at) noexcept;
  /// Returns whether the tool is outside the material.
  [[nodiscard]] bool clear(const Snapshot& model, const ToolPose& tool) noexcept;
  /// Forgets what the tool touches.
  void start_contact_anew() noexcept;
  /// By how much such a force bends the spring, model units; without end where there is none.
  [[nodiscard]] double depth_for(double force) const noexcept;
  /// J in the spring at a depth in m.
  [[nodiscard]] double in_spring(double stiffness, double depth) const noexcept;
  /// J in a spring that pushes so hard, below the greatest force.
  [[nodiscard]] double in_spring_of(double stiffness, double force) const noexcept;

  /// Copied with the servo.
  class Contact {
   public:
    explicit Contact(std::unique_ptr<Touch> touch) noexcept : touch_(std::move(touch)) {}
    Contact(const Contact& other) : touch_(other.touch_->clone()) {}
    Contact(Contact&&) noexcept = default;
    Contact& operator=(const Contact& other) { return *this = Contact(other); }
    Contact& operator=(Contact&&) noexcept = default;
    ~Contact() = default;
    Touch* operator->() const noexcept { return touch_.get(); }

   private:
    std::unique_ptr<Touch> touch_;
  };

  ServoSettings settings_;
  DeviceInfo device_;
  Readings readings_;
  Limits limits_;
  Contact touch_, paper_;
  HandLimit hand_;
  TextureFade fade_;
  Shading shading_;
  ForceBlend blend_;
  Friction friction_;
  ForceGuard guard_;
  Wrench spring_;     ///< that of the last tick, as it was blended
  Wrench rubbed_;     ///< friction's share of the last tick's answer
  ServoSample last_;  ///< of the last tick
  Placement placement_;
  bool put_elsewhere_ = false;  ///< something else than the hand has moved the tool, which has not yet followed
  bool first_ = true;
  bool latched_ = false;
  bool start_inside_ = false;
  bool looking_ = false;          ///< the tool, since the last reading that was news
  double late_ = 0, softer_ = 1;  ///< as readings_ had them when the settings were limited last
  Vec3d last_cursor_;             ///< model units
  double last_depth_ = 0;         ///< m
  double last_share_ = 1;         ///< of the stiffness, by the model's layer
  double last_stored_ = 0;        ///< J in the springs of friction
  std::uint64_t roots_ = 0;       ///< number of those of the last tick's cage
  detail::Foothold foothold_;     ///< in the slab of last_.at
  double gift_ = 0;               ///< J, what new settings added to the spring since the last tick
};

}  // namespace relief
