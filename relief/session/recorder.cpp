#include <relief/base/hash.h>
#include <relief/base/try.h>
#include <relief/file/recording.h>
#include <relief/session/fields.h>
#include <relief/session/recorder.h>

#include <sys/utsname.h>

#include <algorithm>
#include <array>
#include <condition_variable>
#include <ctime>
#include <deque>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

namespace relief {

namespace {

constexpr std::size_t kBatch = 250;                           // ticks: what a cut may cost beside the cut
constexpr std::size_t kLiveWaiting = std::size_t{64} << 20U;  // bytes that may wait for the disk: minutes
constexpr std::size_t kPathWaiting = std::size_t{8} << 20U;

#ifdef __clang__
constexpr const char* kCompiler = __VERSION__;
#else
constexpr const char* kCompiler = "GCC " __VERSION__;
#endif

template <typename T>
void add_stream(RecordingHead& head) {
  head.streams.emplace(detail::kStream<T>, detail::columns_of<T>());
}

template <typename T>
RecordingEvent event_of(const T& value, std::uint64_t at) {
  RecordingEvent event{std::string(detail::kStream<T>), at, {}};
  detail::append_row(value, event.row);
  return event;
}

std::string utc_now() {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  gmtime_r(&now, &parts);
  std::array<char, 32> text{};
  return {text.data(), std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%SZ", &parts)};
}

std::string kernel() {
  utsname name{};
  if (uname(&name) != 0) return {};
  return std::string(name.sysname) + ' ' + name.release + ' ' + name.version + ' ' + name.machine;
}

std::string hex(std::uint64_t value) {
  std::string digits(16, '0');
  for (std::size_t k = 16; k-- > 0; value >>= 4U) digits[k] = "0123456789abcdef"[value & 15U];
  return digits;
}

/// Tells devices apart without telling which they are.
std::uint64_t serial_hash(std::string_view serial) {
  Hash64 hash;
  hash.add_bytes(std::as_bytes(std::span(serial)));
  return hash.value();
}

struct Ticks {
  std::uint64_t first = 0;
  std::vector<std::byte> rows;
};
using Job = std::variant<Ticks, RecordingEvent>;

}  // namespace

struct Recorder::State {
  State(RecordingWriter writer_to, Pace given_pace, SnapshotPtr first)
      : writer(std::move(writer_to)), pace(given_pace), heads{std::move(first)}, thread([this] { write_loop(); }) {}
  ~State() { end(); }

  // ---- The caller's side

  void tick(const ServoTick& given) {
    const std::scoped_lock order(order_mutex);
    device_lost = (given.sample.flags & bit(ServoFault::DeviceLost)) != 0;
    if (given.model == nullptr) return;  // no reading, no step
    // The heads that the servo has left behind will not come again.
    while (heads.size() > 1 && heads.front().get() != given.model) {
      heads.pop_front();
      ++model;
    }
    if (!open.rows.empty() && given.number != next) flush();
    if (open.rows.empty()) open.first = given.number;
    next = given.number + 1;
    detail::append_row(RecordedTick{given.clock_ns, given.settings, model, given.reading, given.sample}, open.rows);
    if (++open_count == kBatch) flush();
  }

  void note(const EditNote& told) {
    const std::scoped_lock order(order_mutex);
    if (const auto* made = std::get_if<HeadMade>(&told)) {
      heads.push_back(made->head);
      push_edits();
      return;
    }
    if (const auto* begun = std::get_if<StrokeBegun>(&told)) edits.push_back(event_of(begun->brush, 0));
    if (const auto* dab = std::get_if<DabMade>(&told)) edits.push_back(event_of(dab->dab, 0));
    if (const auto* needed = std::get_if<RoomNeeded>(&told)) {
      for (const Capsule& cut : needed->wanted.cut) edits.push_back(event_of(detail::Solid{cut, false}, 0));
      for (const Capsule& fill : needed->wanted.fill) edits.push_back(event_of(detail::Solid{fill, true}, 0));
      edits.push_back(event_of(detail::Needed{needed->ended}, 0));
    }
    if (const auto* again = std::get_if<StrokeAgain>(&told)) edits.push_back(event_of(*again, 0));
    if (const auto* ended = std::get_if<StrokeEnded>(&told))
      edits.push_back(ended->kept ? event_of(detail::Nothing{}, 0) : event_of(detail::Cancelled{}, 0));
    if (const auto* moved = std::get_if<HistoryMoved>(&told))
      edits.push_back(event_of(detail::Moved{static_cast<std::int32_t>(moved->steps)}, 0));
  }

  /// The edits since the last head are what leads to the newest one.
  void push_edits() {
    for (RecordingEvent& event : edits) {
      event.at = newest();
      push(std::move(event));
    }
    edits.clear();
  }

  /// Returns the number of the newest head.
  [[nodiscard]] std::uint64_t newest() const noexcept { return model + heads.size() - 1; }

  void flush() {
    if (open.rows.empty()) return;
    push(std::exchange(open, {}));
    open_count = 0;
  }

  void push(Job job) {
    std::unique_lock lock(mutex);
    const auto* ticks = std::get_if<Ticks>(&job);
    const std::size_t bytes = ticks != nullptr ? ticks->rows.size() : 0;
    if (ticks != nullptr && pace == Pace::Path)
      freed.wait(lock, [&] { return waiting < kPathWaiting || failed(); });
    else if (ticks != nullptr && waiting > kLiveWaiting)
      return;
    if (failed()) return;
    waiting += bytes;
    jobs.push_back(std::move(job));
    wake.notify_one();
  }

  // ---- The writer's side

  void write_loop() {
    std::unique_lock lock(mutex);
    for (;;) {
      wake.wait(lock, [&] { return !jobs.empty() || ending; });
      if (jobs.empty()) return;
      const std::deque<Job> now = std::exchange(jobs, {});
      waiting = 0;
      freed.notify_all();
      if (failed()) continue;  // what comes after a gap nobody could repeat
      lock.unlock();
      Status done = write(now);
      lock.lock();
      if (!done) status = std::move(done);
    }
  }

  [[nodiscard]] Status write(const std::deque<Job>& now) {
    for (const Job& job : now) {
      const auto* ticks = std::get_if<Ticks>(&job);
      RELIEF_CHECK(ticks != nullptr ? writer.add_ticks(ticks->first, ticks->rows)
                                    : writer.add_event(std::get<RecordingEvent>(job)));
    }
    return writer.commit();
  }
  [[nodiscard]] bool failed() const noexcept { return !status; }

  void end() {
    if (!thread.joinable()) return;
    {
      const std::scoped_lock lock(mutex);
      ending = true;
      wake.notify_one();
    }
    thread.join();
  }

  RecordingWriter writer;
  const Pace pace;
  std::deque<SnapshotPtr> heads;  ///< that of the last tick, then all newer ones: alive, so that no address comes twice
  std::uint64_t model = 0;        ///< the number of heads.front()
  Ticks open;                     ///< not yet handed over
  std::size_t open_count = 0;
  std::vector<RecordingEvent> edits;  ///< that no head shows yet
  std::uint64_t next = 0;
  bool device_lost = false;

  std::mutex order_mutex;  ///< of all above
  std::mutex mutex;
  std::condition_variable wake, freed;
  std::deque<Job> jobs;
  std::size_t waiting = 0;  ///< bytes of ticks in jobs
  std::uint64_t settings = 0;
  bool ending = false;
  Status status;
  std::thread thread;
};

Recorder::Recorder(std::unique_ptr<State> state) noexcept : state_(std::move(state)) {}
Recorder::Recorder(Recorder&&) noexcept = default;
Recorder& Recorder::operator=(Recorder&&) noexcept = default;
Recorder::~Recorder() = default;

Result<Recorder> Recorder::create(const std::filesystem::path& file, Pace pace, const RecordingOrigin& origin,
                                  const SnapshotPtr& model, const ServoSettings& settings, const DeviceInfo& device) {
  std::error_code ignored;
  RecordingHead head;
  head.facts = {{"program", origin.program},
                {"compiler", kCompiler},
                {"kernel", kernel()},
                {"started", utc_now()},
                {"pace", pace == Pace::Live ? "live" : "path"},
                {"model", std::filesystem::absolute(origin.model, ignored).string()},
                {"model_hash", hex(model->content_hash())},
                {"model_strokes", std::to_string(origin.model_strokes)},
                {"model_unit", origin.model_unit},
                {"contact_law", std::to_string(kContactLaw)},
                {"device", device.name},
                {"device_filters", device.filters},
                {"device_serial_hash", device.serial.empty() ? "" : hex(serial_hash(device.serial))},
                {"axes", "x right, y up, z towards the user"}};
  head.streams.emplace(kTickStream, detail::columns_of<RecordedTick>());
  add_stream<ServoSettings>(head);
  add_stream<Vec3d>(head);
  add_stream<DeviceInfo>(head);
  add_stream<Brush>(head);
  add_stream<Dab>(head);
  add_stream<detail::Solid>(head);
  add_stream<detail::Needed>(head);
  add_stream<StrokeAgain>(head);
  add_stream<detail::Nothing>(head);
  add_stream<detail::Cancelled>(head);
  add_stream<detail::Moved>(head);
  RELIEF_TRY(RecordingWriter writer, RecordingWriter::create(file, std::move(head)));
  RELIEF_CHECK(writer.add_event(event_of(device, 0)));
  RELIEF_CHECK(writer.add_event(event_of(settings, 0)));
  const auto points = settings.tool.points.first(std::min(settings.tool.points.size(), TouchTool::kMostPoints));
  for (const Vec3d point : points) RELIEF_CHECK(writer.add_event(event_of(point, 0)));
  RELIEF_CHECK(writer.commit());
  return Recorder(std::make_unique<State>(std::move(writer), pace, model));
}

void Recorder::tick(const ServoTick& tick) { state_->tick(tick); }
void Recorder::note(const EditNote& note) { state_->note(note); }

void Recorder::set(const ServoSettings& settings) {
  std::uint64_t number = 0;
  {
    const std::scoped_lock lock(state_->mutex);
    number = ++state_->settings;
  }
  state_->push(event_of(settings, number));
}

std::uint64_t Recorder::kept() const noexcept { return state_->writer.committed_ticks(); }

Status Recorder::finish(const ServoTimes* times) {
  State& s = *state_;
  s.flush();
  s.push_edits();
  s.end();
  RELIEF_CHECK(s.status);
  std::map<std::string, std::string, std::less<>> facts = {{"end", s.device_lost ? "device lost" : "stopped"}};
  if (times != nullptr) {
    facts["scheduling"] = times->realtime ? "real-time (SCHED_FIFO)" : "normal (SCHED_OTHER)";
    facts["memory"] = times->memory_locked ? "locked" : "not locked";
    facts["servo_ticks"] = std::to_string(times->ticks);
    facts["ticks_dropped"] = std::to_string(times->dropped);
    facts["periods_skipped"] = std::to_string(times->overruns);
  }
  return s.writer.finish(facts);
}

}  // namespace relief
