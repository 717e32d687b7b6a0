#include <relief/base/assert.h>
#include <relief/base/cpu_time.h>
#include <relief/session/session.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

namespace relief {

namespace {

/// A second of ticks: the edit thread may be away that long before samples are dropped.
constexpr std::size_t kTelemetryCapacity = 1024;

}  // namespace

struct Session::State {
  State(HapticDevice& haptic_device, SnapshotPtr first, ModelFile* model_file, const Settings& session_settings,
        Recorder* session_recorder)
      : settings(session_settings),
        file(model_file),
        recorder(session_recorder),
        editor(first),
        channel(std::move(first)),
        telemetry(kTelemetryCapacity),
        servo(haptic_device, channel, session_settings.servo, &telemetry, session_settings.loss),
        edit_thread([this] { edit_loop(); }) {}

  void edit_loop() {
    ServoTick tick;
    while (true) {
      // Read before the queue is found empty: what the servo pushed before it ended is then still taken.
      const bool last_round = stopping.load(std::memory_order_acquire), ended = !servo.running();
      bool idle = true;
      while (telemetry.pop(tick)) {
        idle = false;
        if (recorder != nullptr) recorder->tick(tick);
        if (settings.on_tick) settings.on_tick(tick);
        if (tick.model != nullptr) ++stats.samples;
        take(tick.sample);
      }
      if (ended) finish_stroke();
      if (last_round) break;
      if (idle) std::this_thread::sleep_for(std::chrono::microseconds(500));
    }
  }

  void take(const ServoSample& sample) {
    stats.contact_samples += sample.contact ? 1U : 0U;
    stats.force_max = std::max(stats.force_max, length(sample.force));
    stats.depth_max = std::max(stats.depth_max, sample.depth);
    stats.flagged_samples += sample.flags != 0 ? 1U : 0U;
    stats.flags |= sample.flags;
    const bool pressed = (sample.buttons & 1U) != 0;
    if (!pressed) {
      finish_stroke();
      return;
    }
    // In the safe state the hand feels nothing, so it must not cut anything either.
    constexpr std::uint32_t kSafeState = bit(ServoFault::Latched) | bit(ServoFault::StartInside);
    if (!sample.contact || (sample.flags & kSafeState) != 0) {
      if (std::isfinite(sample.t)) last_dab_t = sample.t;
      return;
    }
    if (!editor.in_stroke()) {
      const std::scoped_lock lock(brush_mutex);
      brush = brushes[std::min<std::size_t>(sample.buttons >> 8U, brushes.size() - 1)];
      editor.begin_stroke(brush, std::string(name(brush.tool)));
      if (recorder != nullptr) recorder->begin_stroke(brush);
      last_dab_t = sample.t - 1 / settings.sculpt.dabs_per_second;
      axis = sample.normal;
    }
    const double elapsed = sample.t - last_dab_t;
    if (!(elapsed >= 0)) {
      if (std::isfinite(sample.t)) last_dab_t = sample.t;
      return;
    }
    // Half a tick of slack, so that 1000 and 250 dabs per second come out as every and every fourth tick.
    if (elapsed < 1 / settings.sculpt.dabs_per_second - 0.5e-3) return;
    last_dab_t = sample.t;
    make_dab(sample, elapsed);
  }

  void make_dab(const ServoSample& sample, double elapsed) {
    const SculptSettings& s = settings.sculpt;
    const double span = s.full_depth - s.light_depth;
    const double pressure = span > 0 ? std::clamp((sample.depth - s.light_depth) / span, 0.0, 1.0) : 1.0;
    const double follow = s.turn_time > 0 ? 1 - std::exp(-elapsed / s.turn_time) : 1.0;
    axis = normalized(axis + (sample.normal - axis) * follow);
    const std::uint64_t start = thread_cpu_ns();
    const Dab dab = {.slab = sample.at.slab,
                     .contact = sample.contact_point,
                     .cursor = sample.cursor,
                     .normal = axis,
                     .pressure = pressure,
                     .seconds = std::clamp(elapsed, 0.0, 0.1)};
    const DabResult result = editor.dab(dab);
    channel.publish(editor.head());
    stats.dab_time.add(thread_cpu_ns() - start);
    ++stats.dabs;
    stats.samples_edited += result.samples;
    if (recorder != nullptr) recorder->dab(dab, editor.head());
  }

  void finish_stroke() {
    if (!editor.in_stroke()) return;
    const bool changed = editor.end_stroke();
    if (recorder != nullptr) recorder->end_stroke();
    if (!changed) return;
    ++stats.strokes;
    save();
  }

  /// Writes what is not in the file yet: after a commit that failed (a reader may hold the file for long) the next one
  /// carries the stroke that was missed.
  void save() {
    if (file == nullptr || file->model().head == editor.head()) return;
    StrokeRecord record;
    record.label = std::string(name(brush.tool));
    file_status = file->commit(editor.head(), record);
  }

  Settings settings;
  ModelFile* file;
  Recorder* recorder;
  Editor editor;
  SnapshotChannel channel;
  SpscQueue<ServoTick> telemetry;
  std::mutex brush_mutex;
  std::vector<Brush> brushes{1};
  Brush brush;
  double last_dab_t = 0;
  Vec3d axis;  ///< of the tool, while a stroke is open
  Status file_status, recorder_status;
  SessionStats stats;
  std::atomic<bool> stopping{false};
  bool stopped = false;
  ServoThread servo;
  std::thread edit_thread;
};

Session::Session(HapticDevice& device, SnapshotPtr head, ModelFile* file, const Settings& settings, Recorder* recorder)
    : state_(std::make_unique<State>(device, std::move(head), file, settings, recorder)) {}

Session::~Session() { static_cast<void>(stop()); }

void Session::set_brush(const Brush& brush) { set_brushes({brush}); }

void Session::set_brushes(std::vector<Brush> brushes) {
  if (brushes.empty()) return;
  for (const Brush& brush : brushes) RELIEF_ASSERT(std::isfinite(brush.radius) && brush.radius > 0);
  const std::scoped_lock lock(state_->brush_mutex);
  state_->brushes = std::move(brushes);
}

bool Session::set_servo(const ServoSettings& settings) {
  if (!state_->servo.set(settings)) return false;
  if (state_->recorder != nullptr) state_->recorder->set(settings);
  return true;
}

SnapshotChannel::Reader Session::reader() { return state_->channel.reader(); }
bool Session::running() const noexcept { return state_->servo.running(); }
std::vector<DeviceLoss> Session::losses() const { return state_->servo.losses(); }

Status Session::stop() {
  if (!state_->stopped) {
    state_->stopped = true;
    state_->servo.stop();
    state_->stopping.store(true, std::memory_order_release);
    state_->edit_thread.join();
    state_->stats.servo = state_->servo.times();
    if (!state_->file_status) state_->save();
    if (state_->recorder != nullptr) state_->recorder_status = state_->recorder->finish(&state_->stats.servo);
  }
  return state_->file_status ? state_->recorder_status : state_->file_status;
}

const Status& Session::recorded() const noexcept { return state_->recorder_status; }
const SnapshotPtr& Session::head() const noexcept { return state_->editor.head(); }
const SessionStats& Session::stats() const noexcept { return state_->stats; }

}  // namespace relief
