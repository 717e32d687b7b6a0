// A device of your own, as one that Relief asks and as one that calls Relief, and what its commands must keep.
#include <relief/base/spsc_queue.h>
#include <relief/convert/convert.h>
#include <relief/core/snapshot_channel.h>
#include <relief/devices/open_device.h>
#include <relief/haptics/servo_thread.h>
#include <relief/mesh/samples.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <optional>
#include <thread>
#include <vector>

/// Stands where your vendor's library stands: millimetres, x towards the user, y right, z up. A simulated hand holds
/// it.
namespace arm {
namespace {

std::optional<relief::SimulatedHand> hand;
relief::DeviceState reading;
std::atomic<bool> is_open{false}, motors{false}, switched_off{false};
std::array<double, 3> last_force{};

bool open() { return is_open = hand.has_value(); }
void close() { is_open = motors = false; }
bool enable_motors(bool on) {
  motors = on && is_open;
  return is_open;
}
bool motors_on() { return motors && !switched_off; }
bool get_position(std::array<double, 3>& mm) {
  if (!is_open || !hand->read(reading)) return false;
  const relief::Vec3d p = reading.position * 1000;
  mm = {p.z, p.x, p.y};
  return true;
}
double seconds() { return reading.t; }
bool set_force(const std::array<double, 3>& newtons) {
  last_force = newtons;
  const relief::Vec3d force = {newtons[1], newtons[2], newtons[0]};
  relief::Wrench felt;
  if (motors_on()) felt.force = force;
  return is_open && hand->write(felt);
}

/// The library's own thread calls `tick` once per period.
class Schedule {
 public:
  void start(void (*tick)(void*), void* data) {
    runs_ = true;
    thread_ = std::thread([this, tick, data] {
      for (auto due = std::chrono::steady_clock::now(); runs_; std::this_thread::sleep_until(due)) {
        tick(data);
        due += std::chrono::milliseconds(1);
      }
    });
  }
  void stop() {
    runs_ = false;
    if (thread_.joinable()) thread_.join();
  }

 private:
  std::atomic<bool> runs_{false};
  std::thread thread_;
};

}  // namespace
}  // namespace arm

namespace {

// region units
// The arm has x towards the user, y right, z up, in mm. Relief has x right, y up, z towards the user, in m.
relief::Vec3d from_arm(const std::array<double, 3>& v) { return {v[1], v[2], v[0]}; }
std::array<double, 3> to_arm(relief::Vec3d v) { return {v.z, v.x, v.y}; }
// end units

// region pull
class PullArm : public relief::HapticDevice {
 public:
  PullArm() {
    info_.name = "my arm";
    info_.max_force = 3.3;         // N, from the data sheet
    info_.continuous_force = 0.9;  // N
    info_.max_stiffness = 1000;    // N/m
    info_.workspace_radius = 0.075;
    info_.actuated = {.position = 3};
  }
  [[nodiscard]] const relief::DeviceInfo& info() const noexcept override { return info_; }

  [[nodiscard]] relief::Status open() override {
    if (arm::open()) return {};
    return relief::fail(relief::Errc::DeviceUnavailable, "my arm: does not answer; plug it in and switch it on");
  }
  [[nodiscard]] relief::Status enable(bool forces) override {
    if (arm::enable_motors(forces) || !forces) return {};
    return relief::fail(relief::Errc::DeviceUnavailable, "my arm: motors stay off; release the emergency stop");
  }
  void close() noexcept override { arm::close(); }
  [[nodiscard]] relief::DeviceStatus status() const override {
    return {.connected = arm::is_open,
            .powered = arm::is_open,
            .forces_on = arm::motors_on(),
            .to_do = {},
            .force_off = arm::switched_off ? "the emergency stop is pressed" : "",
            .trouble = {}};
  }

  [[nodiscard]] bool read(relief::DeviceState& state) noexcept override {
    std::array<double, 3> mm{};
    if (!arm::get_position(mm)) return false;
    state.t = arm::seconds();
    state.position = from_arm(mm) / 1000;
    state.forces_off = arm::switched_off;
    return true;
  }
  [[nodiscard]] bool write(const relief::Wrench& wrench) noexcept override {
    return arm::set_force(to_arm(wrench.force));
  }

 protected:
  relief::DeviceInfo info_;
};
// end pull

// region push
class PushArm final : public PullArm {
 public:
  PushArm() { info_.pull = false; }
  ~PushArm() override { end(); }

  [[nodiscard]] bool start(relief::PushTick tick) noexcept override {
    tick_ = tick;
    schedule_.start([](void* self) { static_cast<PushArm*>(self)->once(); }, this);
    return true;
  }
  void stop() noexcept override { end(); }

 private:
  void once() noexcept {
    relief::DeviceState state;
    const bool answered = read(state);
    (void)write(answered ? tick_(state) : relief::Wrench{});
  }
  void end() noexcept {
    schedule_.stop();
    (void)write({});  // an explicit zero, never silence
  }
  relief::PushTick tick_;
  arm::Schedule schedule_;
};
// end push

// region judge
/// What no command may break, in the ticks of one run. Prints the first that does.
bool holds(const std::vector<relief::ServoTick>& ticks, const relief::DeviceInfo& device) {
  double before = 0, t = 0, strongest = 0;
  bool stopped = false;
  for (const relief::ServoTick& tick : ticks) {
    const double force = length(tick.sample.force);
    const char* broken = nullptr;
    if (tick.reading.forces_off && force > 0) broken = "force in the tick of a fault (S12)";
    if (force > device.max_force * (1 + 1e-9)) broken = "force above the device's (S14)";
    if (force - before > device.max_force_rate * (tick.sample.t - t) + 1e-9) broken = "force grows too fast (S14)";
    if (broken != nullptr) return std::printf("tick %zu: %s\n", std::size_t{tick.number}, broken), false;
    before = force;
    t = tick.sample.t;
    strongest = std::max(strongest, force);
    stopped = stopped || tick.reading.forces_off;
  }
  if (!stopped) return std::puts("the emergency stop never reached a reading (S12)"), false;
  std::printf("%s: %zu ticks, strongest force %.2f N\n", device.pull ? "pull" : "push", ticks.size(), strongest);
  return strongest > 0;
}
// end judge

/// Until the hand has pressed for a while, and presses.
bool is_enough(const std::vector<relief::ServoTick>& ticks) {
  return ticks.size() > 20'000 || (ticks.size() > 3000 && ticks.back().sample.contact);
}

bool try_out(relief::HapticDevice& device, const relief::SnapshotPtr& model) {
  relief::ServoSettings settings;
  settings.workspace = relief::fit_workspace(device.info(), model->slab_mesh().bounds());
  arm::hand.emplace(relief::plant_presets().front(), relief::Hand{},
                    relief::exploring_hand(*model, settings.workspace));
  std::vector<relief::ServoTick> ticks;

  // region run
  if (const relief::Status up = bring_up(device); !up) return std::puts(up.error().message.c_str()), false;
  relief::SnapshotChannel channel(model);
  relief::SpscQueue<relief::ServoTick> telemetry(1 << 14);
  relief::ServoThread servo(device, channel, settings, &telemetry);  // 1 kHz from here on
  while (!is_enough(ticks) && servo.running()) {
    for (relief::ServoTick tick; telemetry.pop(tick);) ticks.push_back(tick);
    arm::switched_off = ticks.size() > 2000 && ticks.size() < 2100;  // somebody presses the emergency stop
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  servo.stop();
  const bool ends_with_zero = arm::last_force == std::array<double, 3>{};
  device.close();
  // end run
  if (!ends_with_zero) std::puts("the last command is not zero");
  return ends_with_zero && holds(ticks, device.info());
}

/// Each axis of the arm, and where it leads.
bool axes_hold() {
  return from_arm({1, 0, 0}) == relief::Vec3d{0, 0, 1} && from_arm({0, 1, 0}) == relief::Vec3d{1, 0, 0} &&
         from_arm({0, 0, 1}) == relief::Vec3d{0, 1, 0} && from_arm(to_arm({1, 2, 3})) == relief::Vec3d{1, 2, 3};
}

}  // namespace

int main() {
  const auto mesh = relief::make_sample("pumpkin", 20'000);
  if (!mesh) return 1;
  const auto made = relief::convert(*mesh, {.slabs = 100, .intervals = 16});
  if (!made) return 1;
  PullArm pull;
  PushArm push;
  const bool pulled = try_out(pull, made->model.head), pushed = try_out(push, made->model.head);
  return axes_hold() && pulled && pushed ? 0 : 1;
}
