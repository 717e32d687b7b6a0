// A session's ticks as people look at them: a minute for plots, and what the hand may know about its safety.
#pragma once

#include <relief/base/spsc_queue.h>
#include <relief/haptics/servo_thread.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace relief {

/// One tick of a plot.
struct HandTick {
  double t = 0;             ///< s, as the device gave it
  Vec3f position;           ///< of the tool, model units
  Vec3f contact_point;      ///< model units; the position without contact
  Vec3f force;              ///< N, on the hand, along the model's axes
  float depth = 0;          ///< model units
  float period = 0;         ///< s, since the wake-up before; 0 for the first tick
  float late = 0;           ///< s, wake-up after the due time
  float compute = 0;        ///< s, thread CPU time of the tick
  std::uint32_t flags = 0;  ///< ServoFault bits
  bool contact = false;     ///< whether the tool touches
};

/// What the hand feels at the moment, in kinds; the sentences are the program's.
enum class HandState : std::uint8_t {
  Waiting,   ///< no tick has come yet
  Free,      ///< nothing is touched
  Touching,  ///< the surface holds the hand
  Limited,   ///< so does it, but with less force than the law asks for, or a warning is due: HandSafety::cause
  NoForce    ///< the safe state, or a lost device: HandSafety::cause
};

/// Holds what a program shows of the hand's safety.
struct HandSafety {
  HandState state = HandState::Waiting;  ///< what the hand is doing
  /// Of NoForce, what began it; of Limited, what limits.
  ServoFault cause = ServoFault::None;
  /// Of NoForce: the cause is over, and forces come back once the hand has left the solid.
  bool lift_off = false;
  friend bool operator==(const HandSafety&, const HandSafety&) noexcept = default;
};

/// A time without force.
struct HandStop {
  ServoFault cause = ServoFault::None;  ///< why there is no force
  double t = 0;                         ///< s, when it began
  double seconds = 0;                   ///< how long so far
  bool over = false;                    ///< whether the cause has passed
};

/// Judges ticks one after the other. No clock, no allocation.
class SafetyWatch {
 public:
  /// s for which a touch, or a limit, is reported after its last tick: words that flicker cannot be read.
  static constexpr double kHold = 0.3;
  /// s for which a device must have answered before it counts as back: a sentence of ten words is read in that time, at
  /// 200 words a minute.
  static constexpr double kSteady = 3;

  /// Takes a tick. The thread that drains the telemetry.
  void tick(const ServoSample& sample) noexcept;
  /// Returns what holds now.
  [[nodiscard]] const HandSafety& now() const noexcept { return now_; }
  /// Times without force so far, the present one included.
  [[nodiscard]] std::uint64_t stops() const noexcept { return stops_; }
  /// Returns the last time that the force ended.
  [[nodiscard]] const HandStop& last_stop() const noexcept { return last_stop_; }
  /// Causes so far of which people must hear. That a device answers again is told once it has answered for kSteady.
  /// Until then no other loss of it is told.
  [[nodiscard]] std::uint64_t alarms() const noexcept { return alarms_; }
  /// Returns the newest of them, as it was when it was counted.
  [[nodiscard]] const HandStop& alarm() const noexcept { return alarm_; }

 private:
  void judge(const ServoSample& sample, double t) noexcept;
  void count_alarm(bool lost, double t) noexcept;

  HandSafety now_;
  HandStop last_stop_, alarm_;
  std::uint64_t stops_ = 0, alarms_ = 0;
  bool first_ = true;
  bool untold_ = false;               ///< last_stop_'s cause is not yet among the alarms
  bool unsteady_ = false;             ///< the device was lost, and does not yet count as back
  bool told_loss_ = false;            ///< the last alarm that says something is a loss
  double answers_since_ = 0;          ///< s; infinite while it is lost
  double touched_ = 0, limited_ = 0;  ///< s, when last; below the first tick's time where never
  ServoFault limit_ = ServoFault::None;
};

/// Takes a session's ticks without ever waiting (Session::Settings::on_tick), and keeps the last minute for another
/// thread.
class HandMonitor {
 public:
  static constexpr std::size_t kMinute = 60'000;  ///< ticks of 1 ms
  static constexpr std::size_t kWaiting = 4096;   ///< ticks for which the other thread may be away

  /// `capacity`: ticks that are kept.
  explicit HandMonitor(std::size_t capacity = kMinute);

  /// The session's thread; wait-free. Where kWaiting ticks wait already, it is dropped, and counted.
  void tick(const ServoTick& tick) noexcept;

  // All that follows: one other thread.
  /// Takes over what has come since the last call; how many ticks.
  std::size_t drain();
  /// Ticks that are kept, oldest first.
  [[nodiscard]] std::size_t size() const noexcept { return ring_.size(); }
  /// Tick k, the oldest kept one first.
  [[nodiscard]] const HandTick& operator[](std::size_t k) const noexcept { return ring_[(oldest_ + k) % ring_.size()]; }
  /// Returns a copy of them, for a plot that stands still.
  [[nodiscard]] std::vector<HandTick> freeze() const;
  /// Returns the newest tick, whole.
  [[nodiscard]] const ServoSample& last() const noexcept { return last_; }
  /// Returns the hand's safety.
  [[nodiscard]] const SafetyWatch& safety() const noexcept { return safety_; }
  /// Ticks taken since the start.
  [[nodiscard]] std::uint64_t taken() const noexcept { return taken_; }
  /// Ticks that are missing, whoever dropped them.
  [[nodiscard]] std::uint64_t missing() const noexcept { return missing_; }
  /// Forgets all ticks; for another session.
  void clear();

 private:
  /// Holds what travels: no reading, no model.
  struct Waiting {
    std::uint64_t number = 0, clock_ns = 0;
    ServoSample sample;
  };
  void keep(const Waiting& tick);

  SpscQueue<Waiting> queue_;
  const std::size_t capacity_;
  std::vector<HandTick> ring_;
  std::size_t oldest_ = 0;
  ServoSample last_;
  SafetyWatch safety_;
  std::uint64_t taken_ = 0, missing_ = 0, next_ = 0, clock_ns_ = 0;
};

}  // namespace relief
