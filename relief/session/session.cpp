#include <relief/base/assert.h>
#include <relief/session/session.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

namespace relief {

namespace {

/// A second of ticks: the session's thread may be away that long before samples are dropped.
constexpr std::size_t kTelemetryCapacity = 1024;
/// s without contact that a stroke bridges: a tip that bounces, not a hand that lifts off.
constexpr double kLongestGap = 0.05;
/// s: half a tick of slack, so that 1000 and 250 points per second come out as every and every fourth tick.
constexpr double kSlack = 0.5e-3;

}  // namespace

struct Session::State {
  State(HapticDevice& device, Document& doc, const Settings& given, Recorder* given_recorder)
      : settings(given), document(doc), recorder(given_recorder), telemetry(kTelemetryCapacity) {
    // Before the servo can feel what the recorder does not know.
    if (recorder != nullptr) document.watch([this](const EditNote& note) { recorder->note(note); });
    servo.emplace(device, document.channel(), settings.servo, &telemetry, settings.loss);
    thread = std::thread([this] { run(); });
  }

  void run() {
    while (true) {
      // Read before the queue is found empty: what the servo pushed before it ended is then still taken.
      const bool last_round = stopping.load(std::memory_order_acquire), ended = !servo->running();
      const bool idle = !take_ticks();
      if (ended) end_stroke();
      if (last_round) break;
      if (idle) std::this_thread::sleep_for(std::chrono::microseconds(500));
    }
    end_stroke();
  }

  bool take_ticks() {
    bool any = false;
    for (ServoTick tick; telemetry.pop(tick); any = true) {
      if (recorder != nullptr) recorder->tick(tick);
      if (settings.on_tick) settings.on_tick(tick);
      count(tick);
      sculpt(tick.sample);
    }
    return any;
  }

  void count(const ServoTick& tick) {
    const ServoSample& sample = tick.sample;
    const std::scoped_lock lock(mutex);
    stats.samples += tick.model != nullptr ? 1U : 0U;
    stats.contact_samples += sample.contact ? 1U : 0U;
    stats.force_max = std::max(stats.force_max, length(sample.force));
    stats.depth_max = std::max(stats.depth_max, sample.depth);
    stats.flagged_samples += sample.flags != 0 ? 1U : 0U;
    stats.flags |= sample.flags;
    stats.last = sample;
  }

  void sculpt(const ServoSample& sample) {
    constexpr std::uint32_t kSafeState = bit(ServoFault::Latched) | bit(ServoFault::StartInside);
    const bool pressed = (sample.buttons & 1U) != 0, safe = (sample.flags & kSafeState) != 0;
    if (!pressed || safe || !std::isfinite(sample.t)) {
      end_stroke();
      return;
    }
    if (open && sample.t - touched > kLongestGap) end_stroke();
    if (!sample.contact) return;
    touched = sample.t;
    if (!open)
      begin_stroke(sample.buttons >> 8U);
    else if (sample.t - told < 1 / settings.sculpt.points_per_second - kSlack)
      return;
    told = sample.t;
    document.post(MoveStroke{{{sample.t, sample.cursor, pressure_at(sample.depth)}}, settings.sculpt.source});
    const std::scoped_lock lock(mutex);
    ++stats.points;
  }

  [[nodiscard]] double pressure_at(double depth) const {
    const SculptSettings& s = settings.sculpt;
    const double span = s.full_depth - s.light_depth;
    return span > 0 ? std::clamp((depth - s.light_depth) / span, 0.0, 1.0) : 1.0;
  }

  void begin_stroke(std::size_t number) {
    open = true;
    const std::scoped_lock lock(mutex);
    ++stats.strokes;
    const Brush& brush = brushes[std::min(number, brushes.size() - 1)];
    document.post(BeginStroke{.brush = brush, .tip = true, .label = {}, .source = settings.sculpt.source});
  }

  void end_stroke() {
    if (std::exchange(open, false)) document.post(EndStroke{settings.sculpt.source});
  }

  Status stop() {
    if (std::exchange(stopped, true)) return recorded;
    servo->stop();
    stopping.store(true, std::memory_order_release);
    thread.join();
    stats.servo = servo->times();
    if (recorder == nullptr) return recorded;
    document.watch({});  // what was posted has been done and noted
    recorded = recorder->finish(&stats.servo);
    return recorded;
  }

  const Settings settings;
  Document& document;
  Recorder* recorder;
  SpscQueue<ServoTick> telemetry;
  // The session's thread alone.
  bool open = false;   ///< a stroke
  double touched = 0;  ///< s, when the tip last touched
  double told = 0;     ///< s, when the last point was told

  mutable std::mutex mutex;  ///< of the brushes and the statistics
  std::vector<Brush> brushes{1};
  SessionStats stats;
  Status recorded;
  std::atomic<bool> stopping{false};
  bool stopped = false;
  std::optional<ServoThread> servo;
  std::thread thread;
};

Session::Session(HapticDevice& device, Document& document, const Settings& settings, Recorder* recorder)
    : state_(std::make_unique<State>(device, document, settings, recorder)) {}

Session::~Session() { static_cast<void>(stop()); }

void Session::set_brush(const Brush& brush) { set_brushes({brush}); }

void Session::set_brushes(std::vector<Brush> brushes) {
  if (brushes.empty()) return;
  for (const Brush& brush : brushes) RELIEF_ASSERT(std::isfinite(brush.radius) && brush.radius > 0);
  const std::scoped_lock lock(state_->mutex);
  state_->brushes = std::move(brushes);
}

bool Session::set_servo(const ServoSettings& settings) {
  if (!state_->servo->set(settings)) return false;
  if (state_->recorder != nullptr) state_->recorder->set(settings);
  return true;
}

void Session::set_forces(bool on) noexcept { state_->servo->set_forces(on); }

bool Session::running() const noexcept { return state_->servo->running(); }
std::vector<DeviceLoss> Session::losses() const { return state_->servo->losses(); }

SessionStats Session::stats() const {
  const std::scoped_lock lock(state_->mutex);
  return state_->stats;
}

Status Session::stop() { return state_->stop(); }

}  // namespace relief
