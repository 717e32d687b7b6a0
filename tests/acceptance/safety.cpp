// S12: the safe state. S13: start and resume. S14: limits on every command. S15: what stands still.
#include "acceptance/acceptance.h"
#include "support/bad_readings.h"
#include "support/held_tools.h"
#include "support/shells.h"

#include <relief/base/cpu_time.h>
#include <relief/base/spsc_queue.h>
#include <relief/core/query.h>
#include <relief/core/snapshot_channel.h>
#include <relief/devices/simulated_hand.h>
#include <relief/haptics/servo.h>
#include <relief/haptics/servo_thread.h>

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <deque>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace relief::acceptance {
namespace {

const Workspace kSpace = {.metres_per_unit = 0.1};
constexpr double kToolRadius = 0.1;  // model units: 10 mm

SnapshotPtr ball_in(const std::shared_ptr<const SlabMesh>& cage, double radius) {
  return testing::displaced(cage, [=](Vec3d p) { return (radius / length(p) - 0.8) / 0.4; });
}
/// All in one cage, as edits of each other.
SnapshotPtr ball(double radius = 1) {
  static const auto cage = testing::sphere_shell(2, 16);
  return ball_in(cage, radius);
}

DeviceState reading(double t, Vec3d cursor) {
  DeviceState state;
  state.t = t;
  state.position = kSpace.to_device(cursor);
  return state;
}

ServoSettings with(const testing::HeldTool& held) { return {.workspace = kSpace, .tool = held.tool()}; }

/// A servo that presses a tool 3 mm into the top of the ball at t = 1.010 s.
struct Pressed {
  testing::HeldTool held;
  SnapshotPtr model;
  Servo servo{with(held), DeviceInfo{}};
  double start = 1;
  int ticks = 0;
  ServoSample felt;

  [[nodiscard]] double t() const { return start + 1e-3 * ticks; }
  explicit Pressed(testing::HeldTool tool, SnapshotPtr on = ball(), double top = 1)
      : held(std::move(tool)), model(std::move(on)) {
    for (int k = static_cast<int>(std::lround((top + 0.05 - 0.97) / 5e-3)) - 6; k >= 0; --k) at(0.97 + 5e-3 * k);
  }
  /// Where the tool's surface is at such a height.
  [[nodiscard]] DeviceState reading_at(double time, double z) const { return reading(time, {0, 0, z + held.radius}); }
  void at(double z) {
    felt = servo.step(*model, reading_at(t(), z));
    ++ticks;
  }
  /// Of the next ones, without lift-off.
  int ticks_with_force(int next) {
    int count = 0;
    for (int k = 0; k < next; ++k) {
      at(0.97);
      count += felt.force != Vec3d{} ? 1 : 0;
    }
    return count;
  }
  /// Goes out and in again.
  bool feels_after_lift_off() {
    for (int k = 0; k <= 30; ++k) at(0.97 + 5e-3 * k);
    for (int k = 0; k <= 30; ++k) at(1.12 - 5e-3 * k);
    return felt.force.z > 0.3 && (felt.flags & bit(ServoFault::Latched)) == 0;
  }
};

/// Figures of one event: force in its tick, ticks with force before lift-off, whether it was told and felt again.
struct Answer {
  double force = 0;
  int later = 0;
  bool told = false, feels_again = false;
};

void judge(Report& report, const std::string& what, const Answer& answer) {
  report.at_most(what + ": force in the same tick", answer.force, 0, "N");
  report.at_most(what + ": later ticks with force before lift-off", answer.later, 0);
  report.at_least(what + ": told in the flags, and felt again after lift-off",
                  (answer.told ? 1 : 0) + (answer.feels_again ? 1 : 0), 2);
}

Answer answer_to(Pressed& hand, ServoFault expected) {
  Answer answer = {.force = length(hand.felt.force), .told = (hand.felt.flags & bit(expected)) != 0};
  answer.told = answer.told && (hand.felt.flags & bit(ServoFault::Latched)) != 0;
  answer.later = hand.ticks_with_force(100);
  answer.feels_again = hand.feels_after_lift_off();
  return answer;
}

}  // namespace

namespace {

void safe_state(Report& report, const testing::HeldTool& held) {
  for (const testing::BadReading& bad : testing::bad_readings()) {
    Pressed hand(held);
    DeviceState state = hand.reading_at(1.011, 0.97);
    bad.spoil(state);
    hand.felt = hand.servo.step(*hand.model, state);
    // Times go on from wherever the bad one went.
    hand.start = std::isfinite(state.t) && std::abs(state.t) < 1e6 ? state.t : 1.02;
    hand.ticks = 1;
    judge(report, bad.name + held.name, answer_to(hand, bad.expected));
  }
  {
    Pressed hand(held);
    int ticks = 0;
    for (; ticks < 100 && (hand.felt.flags & bit(ServoFault::Latched)) == 0; ++ticks) {
      DeviceState state = hand.reading_at(hand.t(), 0.97);
      state.has_velocity = true;
      state.velocity = {0.2, 0, 0};
      hand.felt = hand.servo.step(*hand.model, state);
      ++hand.ticks;
    }
    report.at_most("frozen position under a moving velocity" + held.name + ": ticks until the safe state", ticks, 22);
    judge(report, "frozen position" + held.name, answer_to(hand, ServoFault::BadPosition));
  }
  {
    Pressed hand(held);
    hand.servo.stalled();
    hand.at(0.97);
    judge(report, "the servo stood still for over 50 ms" + held.name, answer_to(hand, ServoFault::Stalled));
  }
  {
    Pressed hand(held);
    hand.servo.reconnected();
    hand.at(0.97);
    judge(report, "the device did not answer for a while" + held.name, answer_to(hand, ServoFault::Reconnected));
  }
  {
    Pressed hand(held);
    const Vec3d before = hand.felt.force;
    double most_off = 0;
    for (int k = 0; k < 20; ++k) {
      hand.felt = hand.servo.step(*hand.model, hand.reading_at(1.010, 0.97));
      most_off = std::max(most_off, length(hand.felt.force - before));
    }
    report.at_most("the same reading for 20 ms" + held.name + ": change of the force", most_off, 0, "N");
    hand.felt = hand.servo.step(*hand.model, hand.reading_at(1.010, 0.97));
    judge(report, "the same reading for over 20 ms" + held.name, answer_to(hand, ServoFault::NoNews));
  }
  {
    Pressed hand(held);
    hand.model = ball(1.06);
    hand.at(0.97);
    judge(report, "the surface rises by 6 mm under the tip" + held.name, answer_to(hand, ServoFault::SurfaceJumped));
  }
  struct Other {
    const char* what;
    int n;
    double radius;
  };
  // Another cage is an edit like any other: a surface that stays within reach is felt on, and the force blends over.
  for (const auto& [what, n, radius] : {Other{"of the same shape", 16, 1}, Other{"of the same shape, other n", 32, 1},
                                        Other{"2 mm lower", 16, 0.98}, Other{"2.9 mm higher", 16, 1.029}}) {
    const std::string name = std::string("another model under the tip, ") + what + held.name;
    const SnapshotPtr other = ball_in(testing::sphere_shell(2, n), radius);
    // The hand rests first, so that all of a step is the model's doing.
    Pressed hand(held), on_other(held, other, radius);
    hand.ticks_with_force(100);
    on_other.ticks_with_force(300);
    hand.model = other;
    double step = 0;
    for (int k = 0; k < 200; ++k) {
      const Vec3d before = hand.felt.force;
      hand.at(0.97);
      step = std::max(step, length(hand.felt.force - before));
    }
    report.at_most(name + ": force step", step, 0.045 + 1e-9, "N");
    report.at_most(name + ": off the force of one who pressed that from the start",
                   length(hand.felt.force - on_other.felt.force), 0.05, "N");
  }
  {
    Pressed hand(held);
    hand.model = ball_in(testing::sphere_shell(2, 16), 1.06);
    hand.at(0.97);
    judge(report, "another model under the tip, 6 mm higher" + held.name, answer_to(hand, ServoFault::SurfaceJumped));
  }
  {
    Pressed hand(held);
    hand.servo = Servo(with(held), DeviceInfo{});
    hand.at(0.97);
    Answer answer = {.force = length(hand.felt.force), .told = (hand.felt.flags & bit(ServoFault::StartInside)) != 0};
    answer.later = hand.ticks_with_force(100);
    answer.feels_again = hand.feels_after_lift_off();
    judge(report, "start inside the solid" + held.name, answer);
  }
}

void start_and_resume(Report& report, const testing::HeldTool& held) {
  const auto at = [&](double t, double z) { return reading(t, {0, 0, z + held.radius}); };
  // Runs into the ball at 0.6 m/s, to 9 mm: more than the greatest force, at once.
  const auto first_contact = [&](Servo& servo, const Snapshot& model, double& t) {
    double most = 0;
    int contact = 0;
    for (int k = 0; contact < 20; ++k) {
      const ServoSample felt = servo.step(model, at(t += 1e-3, std::max(0.91, 1.02 - 6e-3 * k)));
      contact += felt.contact ? 1 : 0;
      most = std::max(most, length(felt.force));
    }
    return most;
  };
  const SnapshotPtr model = ball();
  const double limit = 0.5 * DeviceInfo{}.max_force;
  Servo servo(with(held), DeviceInfo{});
  double t = 1;
  report.at_most("first contact after the start" + held.name + ": greatest force in 20 ms",
                 first_contact(servo, *model, t), limit, "N");
  double later = 0;
  for (int k = 0; k < 10; ++k) later = std::max(later, length(servo.step(*model, at(t += 1e-3, 0.91)).force));
  report.at_least("and after that", later, 3.2, "N");
  // A fault while pressed, lift-off, and in again.
  static_cast<void>(servo.step(*model, at(t - 0.01, 0.91)));
  double inside = 0;
  for (int k = 0; k < 22; ++k)
    inside = std::max(inside, length(servo.step(*model, at(t += 1e-3, 0.91 + 5e-3 * k)).force));
  report.at_most("resume" + held.name + ": greatest force before the tool has left", inside, 0, "N");
  report.at_most("first contact after the safe state" + held.name + ": greatest force in 20 ms",
                 first_contact(servo, *model, t), limit, "N");
  // From inside, at every depth, without and with a wait there.
  double most = 0;
  for (const double depth : {0.01, 0.1, 0.3, 0.7, 1.0}) {
    Servo fresh(with(held), DeviceInfo{});
    for (int k = 0; k < 500; ++k) most = std::max(most, length(fresh.step(*model, at(1 + 1e-3 * k, 1 - depth)).force));
    for (double z = 1 - depth; z < 1; z += 1e-3)
      most = std::max(most, length(fresh.step(*model, at(t += 1e-3, z)).force));
  }
  report.at_most("start inside" + held.name + ": greatest force before the tool has left", most, 0, "N");
}

}  // namespace

void safe_state(Report& report) {
  for (const testing::HeldTool& held : testing::held_tools(kToolRadius)) safe_state(report, held);
}

void start_and_resume(Report& report) {
  for (const testing::HeldTool& held : testing::held_tools(kToolRadius)) start_and_resume(report, held);
}

namespace {

/// Checks one command after the other against the limits, from what a recording holds alone.
class LimitJudge {
 public:
  LimitJudge(const DeviceInfo& device, double user_force)
      : device_(device), most_(std::min(device.max_force, user_force)) {}

  void see(const ServoSample& s, double dt) {
    ++commands;
    const double size = length(s.force);
    if (!is_finite(s.force) || size > most_ || !(length(s.torque) <= device_.max_torque)) ++too_strong;
    // It may shrink at once: what is left of the last force, or less, is where it grows and turns from.
    const double kept =
        std::clamp(dot(s.force, last_.force) / std::max(dot(last_.force, last_.force), 1e-30), 0.0, 1.0);
    if (length(s.force - last_.force * kept) > device_.max_force_rate * dt + 1e-9) ++too_quick;
    if (commands > 1) {
      const double done = std::max(0.0, dot(last_.force, s.device - last_.device));
      works_.emplace_back(s.t, done);
      in_window_ += done;
      while (s.t - works_.front().first > 1) {
        in_window_ -= works_.front().second;
        works_.pop_front();
      }
      most_work = std::max(most_work, in_window_);
      warmth_ += (1 - std::exp(-dt / ForceGuard::kWarmUp)) * (dot(last_.force, last_.force) - warmth_);
      lasting = std::max(lasting, std::sqrt(warmth_));
    }
    if (length(s.velocity) > 2 * device_.max_speed && dot(s.force, s.velocity) > 1e-9) ++pushing_on;
    last_ = s;
  }

  long commands = 0, too_strong = 0, too_quick = 0, pushing_on = 0;
  double most_work = 0, lasting = 0;  ///< J in a second; N

 private:
  DeviceInfo device_;
  double most_;
  ServoSample last_;
  std::deque<std::pair<double, double>> works_;
  double in_window_ = 0, warmth_ = 0;
};

}  // namespace

void limits(Report& report) {
  const SnapshotPtr models[] = {ball(), ball(1.01), ball(0.99)};
  for (const testing::HeldTool& held : testing::held_tools(kToolRadius))
    for (const PlantPreset& preset : plant_presets()) {
      const int ticks = report.long_form() ? 10'000'000 : 300'000 / held.dear;
      const double user = 0.8 * preset.info.max_force;
      ServoSettings settings = with(held);
      settings.force = {.stiffness = 1e9, .damping = 2, .friction = 0.5, .max_force = user};
      DeviceInfo device = preset.info;
      device.max_torque = 2e-3 * device.max_force;  // friction at the tool's radius asks for more
      Servo servo(settings, device);
      LimitJudge judge(device, user);
      std::mt19937 random(7);
      std::uniform_real_distribution<double> unit(-1, 1);
      Vec3d at = {0, 0, 1.05}, speed;
      long cut = 0;
      double torque = 0;
      std::uint32_t seen = 0;
      const Snapshot* model = models[0].get();
      for (int k = 0; k < ticks; ++k) {
        // Flings, flings under changes of the model, long strong presses, and pumping at 8 Hz, by turns.
        const double t = 1e-3 * k;
        const int act = (k / 4000 + 2) % 4;
        if (act == 0) {
          at += (Vec3d{0, 0, 0.93} - at) * 0.02;
        } else if (act == 1) {
          at += (Vec3d{0, 0, 0.97 + 0.04 * std::sin(50 * t)} - at) * 0.2;
        } else {
          speed = speed * 0.98 + Vec3d{unit(random), unit(random), unit(random)} * 6e-3;
          at += speed;
          if (length(at) > 1.1 || length(at) < 0.85) speed = normalized(at) * (length(at) > 1 ? -0.02 : 0.03);
          if (act == 3 && k % 97 == 0) model = models[static_cast<std::size_t>(k / 97) % 3].get();
        }
        DeviceState state = reading(t, at + normalized(at) * held.radius);
        state.orientation = {std::cos(t), std::sin(t), 0, 0};
        state.has_orientation = true;
        const ServoSample felt = servo.step(*model, state);
        judge.see(felt, 1e-3);
        seen |= felt.flags;
        cut += (felt.flags & bit(ServoFault::LoadLimited)) != 0 ? 1 : 0;
        torque = std::max(torque, length(felt.torque));
      }
      const std::string name = std::string(preset.name) + held.name;
      report.shown(name + ": commands checked", static_cast<double>(judge.commands));
      report.at_most(name + ": commands over the device's or the user's force", static_cast<double>(judge.too_strong),
                     0);
      report.at_most(name + ": commands that grew too quickly", static_cast<double>(judge.too_quick), 0);
      report.at_most(name + ": root mean square of the force, with a memory of a minute", judge.lasting,
                     preset.info.continuous_force, "N");
      report.at_most(name + ": most work on the hand in a second", judge.most_work, preset.info.max_work, "J");
      report.at_most(name + ": commands that push on above twice the speed limit",
                     static_cast<double>(judge.pushing_on), 0);
      // Else the limits were not put to the test.
      report.at_least(name + ": commands limited by load", static_cast<double>(cut), 100);
      const std::uint32_t all = bit(ServoFault::ForceClamped) | bit(ServoFault::RateClamped) |
                                bit(ServoFault::SpeedLimited) | bit(ServoFault::Passivity);
      report.at_least(name + ": kinds of limits met, of 4", std::popcount(seen & all), 4);
      if (!held.points.empty())
        report.at_least(name + ": torque reached, of the limit", torque / device.max_torque, 0.99);
    }
}

namespace {

/// What a process that was stopped for a while finds in its telemetry afterwards; times of CLOCK_MONOTONIC, ns.
struct Stopped {
  double before = 0, first = 0;           ///< N, in the last tick before and in the first one after
  double later = 0;                       ///< N, the most in any tick after that
  std::uint64_t zero_at = 0;              ///< when the first zero had been commanded
  std::uint64_t late = 0, late_null = 0;  ///< the latest wake-up of the servo, and of a null loop beside it, ns
  std::uint32_t flags = 0;                ///< of the first tick after
  std::uint64_t gap = 0;                  ///< ns, the longest from one wake-up to the next
  bool stood_before = false;              ///< the machine was so busy that the servo stood still before that, too
  int ticks = 0;
};

/// A real servo's thread over a pressed hand, for a second in which a drawing thread holds its snapshot, an editor
/// publishes, and nobody takes the telemetry, as when a disk stands still. Calls `ready` once the hand presses.
template <typename Ready>
Stopped pressed_meanwhile(Ready&& ready) {
  const PlantPreset& preset = plant_presets().front();
  SimulatedHand hand(preset, {.stiffness = 300, .damping = 3, .max_force = 2, .tremor = 0},
                     [](double) { return HandTarget{kSpace.to_device({0, 0, 0.95}), 0}; });
  hand.set_state(kSpace.to_device({0, 0, 1.02}), {});
  const SnapshotPtr models[] = {ball(), ball()};
  SnapshotChannel channel(models[0]);
  SnapshotChannel::Reader drawing = channel.reader();
  static_cast<void>(drawing.latest());
  SpscQueue<ServoTick> telemetry(8192);
  ServoThread servo(hand, channel, {.workspace = kSpace}, &telemetry);
  ServoTimes null;
  std::thread beside([&] { null = null_loop(1.2); });
  for (int k = 0; k < 100; ++k) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    channel.publish(models[k % 2]);
    if (k == 50) ready();
  }
  servo.stop();
  beside.join();
  Stopped found{.late = servo.times().late.max(), .late_null = null.late.max()};
  std::vector<ServoTick> ticks;
  for (ServoTick tick; telemetry.pop(tick);) ticks.push_back(tick);
  found.ticks = static_cast<int>(ticks.size());
  std::size_t after = 0;  // the first tick after the longest gap
  for (std::size_t k = 1; k < ticks.size(); ++k) {
    const std::uint64_t gap = ticks[k].clock_ns - ticks[k - 1].clock_ns;
    if (gap <= found.gap) continue;
    found.gap = gap;
    after = k;
  }
  if (after == 0) return found;
  for (std::size_t k = 0; k < after; ++k)
    found.stood_before = found.stood_before || (ticks[k].sample.flags & bit(ServoFault::Stalled)) != 0;
  found.before = length(ticks[after - 1].sample.force);
  found.first = length(ticks[after].sample.force);
  found.flags = ticks[after].sample.flags;
  for (std::size_t k = after; k < ticks.size(); ++k) {
    const double force = length(ticks[k].sample.force);
    if (k > after) found.later = std::max(found.later, force);
    if (found.zero_at == 0 && force == 0) found.zero_at = ticks[k].clock_ns + ticks[k].sample.compute_ns;
  }
  return found;
}

/// The servo's process is really stopped, by the system, while a hand presses. Times are never judged, and nothing is
/// where the servo did not come to press before.
void stopped_process(Report& report) {
#if defined(__SANITIZE_THREAD__)
  report.skipped("no process can be forked under the thread sanitizer");
#else
  constexpr std::chrono::milliseconds kStop{250};
  int ends[2] = {};
  std::fflush(stdout);
  const pid_t child = ::pipe(ends) == 0 ? ::fork() : -1;
  if (child < 0) {
    report.skipped("the system gives no process");
    return;
  }
  if (child == 0) {
    const auto tell = [&](const auto& value) { return ::write(ends[1], &value, sizeof value) == sizeof value; };
    const Stopped found = pressed_meanwhile([&] { static_cast<void>(tell('r')); });
    ::_exit(tell(found) ? 0 : 1);
  }
  ::close(ends[1]);
  char ready = 0;
  Stopped found;
  bool whole = ::read(ends[0], &ready, 1) == 1;
  int status = 0;
  whole = whole && ::kill(child, SIGSTOP) == 0 && ::waitpid(child, &status, WUNTRACED) == child && WIFSTOPPED(status);
  std::this_thread::sleep_for(kStop);
  const std::uint64_t continued = detail::clock_ns(CLOCK_MONOTONIC);
  static_cast<void>(::kill(child, SIGCONT));
  whole = ::read(ends[0], &found, sizeof found) == sizeof found && whole;
  ::close(ends[0]);
  whole = ::waitpid(child, &status, 0) == child && whole && WIFEXITED(status) && WEXITSTATUS(status) == 0;
  report.at_least("a process stopped by SIGSTOP for 250 ms: goes on and comes to its own end", whole ? 1 : 0, 1);
  // Whether the machine left the servo alone until then, long enough to press, is no matter of the product.
  const bool pressed = whole && found.gap > 200'000'000 && found.before >= 0.3 && !found.stood_before;
  const auto none = [&](const std::string& what, double force) {
    pressed ? report.at_most(what, force, 0, "N") : report.shown(what, force, "N");
  };
  report.shown("    the standstill seen in its ticks, the hand pressing", pressed ? 1 : 0);
  report.shown("    force in the tick before", found.before, "N");
  none("    force in the first tick after", found.first);
  none("    force in any later tick, the hand still pressing", found.later);
  const int told = std::popcount(found.flags & (bit(ServoFault::Stalled) | bit(ServoFault::Latched)));
  const char* const flags = "    told in the flags: stalled, latched";
  pressed ? report.at_least(flags, told, 2) : report.shown(flags, told);
  report.shown("    from SIGCONT to the command of zero", (double(found.zero_at) - double(continued)) * 1e-3, "us");
  report.shown("    the servo's latest wake-up", double(found.late) * 1e-3, "us");
  report.shown("    a null loop's, beside it", double(found.late_null) * 1e-3, "us");
  report.shown("    ticks, while drawing and disk stand still", found.ticks);
#endif
}

}  // namespace

void standstill(Report& report) {
  stopped_process(report);
  // The plant, pressed, when nobody commands any more.
  for (const PlantPreset& preset : plant_presets()) {
    const SnapshotPtr model = ball();
    SimulatedHand hand(preset, {.stiffness = 300, .damping = 3, .max_force = 2, .tremor = 0},
                       [](double) { return HandTarget{kSpace.to_device({0, 0, 0.95}), 0}; });
    hand.set_state(kSpace.to_device({0, 0, 1.02}), {});
    Servo servo({.workspace = kSpace}, preset.info);
    DeviceState state;
    const auto live = [&](int ticks) {
      ServoSample felt;
      for (int k = 0; k < ticks; ++k) {
        static_cast<void>(hand.read(state));
        felt = servo.step(*model, state);
        static_cast<void>(hand.write({felt.force, felt.torque}));
      }
      return felt;
    };
    live(1000);
    const std::string name(preset.name);
    report.at_least(name + ": force of the motor before", length(hand.motor_force()), 0.5, "N");
    for (int k = 0; k < 10; ++k) hand.idle();
    report.at_most(name + ": force of the motor 10 ms after the last command", length(hand.motor_force()), 0.01, "N");
    for (int k = 0; k < 4990; ++k) hand.idle();
    report.at_most(name + ": and 5 s after", length(hand.motor_force()), 0, "N");
    // Time went on meanwhile: the device's clock shows it.
    const ServoSample felt = live(1);
    report.at_most(name + ": force in the first tick after that", length(felt.force), 0, "N");
    report.at_least(name + ": told", (felt.flags & bit(ServoFault::Latched)) != 0 ? 1 : 0, 1);
  }
  // A drawing thread that holds its snapshot for 5 s, and a telemetry reader that waits for its disk, while an editor
  // publishes: the touch goes on, tick by tick, and feels the newest model.
  SnapshotChannel channel(ball());
  SnapshotChannel::Reader servo_reader = channel.reader(), drawing = channel.reader();
  SpscQueue<ServoSample> telemetry(64);
  const Snapshot& held = drawing.latest();
  Servo servo({.workspace = kSpace}, DeviceInfo{});
  int late = 0, dropped = 0;
  double expected = 0;
  for (int k = 0; k < 5000; ++k) {
    const double radius = 1 + 1e-5 * (k / 10);
    if (k % 10 == 0) channel.publish(ball(radius));
    const ServoSample felt = servo.step(servo_reader.latest(), reading(1e-3 * k, {0, 0, k < 20 ? 1.02 : 0.98}));
    expected = radius - 0.98;
    if (k > 500 && std::abs(felt.depth - expected) > 0.1 * expected) ++late;
    dropped += telemetry.push(felt) ? 0 : 1;
  }
  report.at_most("drawing and disk stalled for 5 s: ticks that did not feel the newest model", late, 0);
  report.at_least("and telemetry dropped rather than waited for", dropped, 4900);
  report.at_most("and the drawing's snapshot is as it was",
                 std::abs(displacement_at(held, 0, 0.2, 0.2) - displacement_at(*ball(), 0, 0.2, 0.2)), 0);
}

}  // namespace relief::acceptance
