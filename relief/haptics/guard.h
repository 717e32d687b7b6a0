// What stands between the force law and the motor: limits on force, its rate, its work and its lasting, and a
// passivity observer and controller (Hannaford and Ryu 2002). A small state, no clock, no allocation.
#pragma once

#include <relief/haptics/device.h>
#include <relief/haptics/energy.h>

#include <array>
#include <cstddef>
#include <cstdint>

namespace relief {

/// Holds what a device and a person's hand bear; SI units, each finite and not negative.
struct GuardLimits {
  double max_force = 0;         ///< N
  double max_force_rate = 0;    ///< N/s, how fast the force may grow or turn
  double max_torque = 0;        ///< N*m
  double max_damping = 0;       ///< N*s/m, what the passivity controller and the speed brake may use
  double continuous_force = 0;  ///< N, what the motors bear for ever
  double max_work = 0;          ///< J, what the force may do on the hand within any second
  double max_speed = 0;         ///< m/s, above which the force brakes
  int delay_ticks = 0;          ///< from a command to its force
};

/// Judges one force per tick. The limits on force and rate always hold; the rest only while `guarding`.
class ForceGuard {
 public:
  /// Along F^2, the time constant with which motors warm up, s.
  static constexpr double kWarmUp = 60;
  /// Faster hands never come here, m/s: such readings are refused before.
  static constexpr double kFastest = 10;

  /// Takes new limits; `guarding` switches passivity control.
  void set(const GuardLimits& limits, bool guarding) noexcept;

  /// Holds what the hand did in a tick.
  struct Motion {
    Vec3d position;   ///< m
    Vec3d velocity;   ///< m/s
    double dt = 0;    ///< s, since the last tick
    Vec3d turn = {};  ///< rad, since the last tick
    /// The model was moved under the tool, or the hand went without the tool: what this does to the springs' energy is
    /// not the hand's doing.
    bool moved = false;
  };
  /// To be called once in each tick, before wrench(): what the last forces did on the way here.
  void observe(const Motion& now) noexcept;
  /// A new start: no force has acted, nothing is known of the motion before. What the motors have borne stays.
  void restart() noexcept;
  /// Holds what the law asks for.
  struct Wish {
    Vec3d force;         ///< N
    Vec3d torque;        ///< N*m, of the same springs about the position
    Vec3d normal;        ///< unit, outwards
    double stored = 0;   ///< J, in the law's springs, as they are
    double gift = 0;     ///< J of that which came in this tick without the hand's doing: a surface that rose under it
    bool moved = false;  ///< what came so is not known: the tick is not judged
  };
  /// Returns what the hand gets. The torque is cut as much as the force is, and by its own limits. Sets ServoFault bits
  /// of what was cut.
  [[nodiscard]] Wrench wrench(const Wish& wish, std::uint32_t& flags) noexcept;
  /// In place of wrench() in a tick without contact.
  void rest() noexcept;
  /// In place of observe() and wrench() in a tick without news, in which this is commanded again.
  void hold(const Wrench& wrench) noexcept { command(wrench); }
  /// The axes in which positions and forces are given have turned.
  void turn(Quatd axes) noexcept;

  /// Energy that came from nowhere in the last half second, J: what the force did on the hand beyond what the springs
  /// gave up, of sampling, of delay, of a normal that is no gradient. What was lost (to damping, say) is not set off
  /// against it, so that it hides nothing. The more, the more damping; at most 2e-5.
  [[nodiscard]] double leak() const noexcept { return leak_; }
  /// Returns what the force has done on the hand lately, J; at most the half of max_work.
  [[nodiscard]] double work() const noexcept { return work_; }
  /// Mean square of the force over kWarmUp, N^2; at most the square of continuous_force.
  [[nodiscard]] double warmth() const noexcept { return warmth_; }

 private:
  [[nodiscard]] double most_now() const noexcept;
  [[nodiscard]] Vec3d force(const Wish& wish, std::uint32_t& flags) const noexcept;
  [[nodiscard]] Vec3d torque(const Wish& wish, Vec3d force) const noexcept;
  void command(const Wrench& wrench) noexcept;
  /// Books what the springs hold now; `judged`: and what that makes.
  void book(double stored, double gift, bool judged) noexcept;

  GuardLimits limits_;
  bool guarding_ = true;
  bool moving_ = false;  ///< motion_ holds the last tick's
  Motion motion_;
  std::array<Wrench, 4> given_{};  ///< the last commands, newest first
  double done_ = 0;                ///< J, by the force on the hand since the last tick
  EnergyAccount energy_;
  double leak_ = 0, work_ = 0, warmth_ = 0;
  bool first_contact_ = true;
  double in_contact_ = 0;  ///< s, of the first contact since the start
};

}  // namespace relief
