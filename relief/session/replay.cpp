#include <relief/base/cpu_time.h>
#include <relief/base/steps.h>
#include <relief/base/try.h>
#include <relief/edit/stroke.h>
#include <relief/file/model_file.h>
#include <relief/session/fields.h>
#include <relief/session/replay.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <system_error>
#include <utility>
#include <variant>

namespace relief {

namespace {

using detail::RowReader;

constexpr std::string_view kDamagedOrder = "its edits do not follow from each other";
/// Set by the servo's thread, not by the servo.
constexpr std::uint32_t kThreadFlags =
    bit(ServoFault::DeviceLost) | bit(ServoFault::Overrun) | bit(ServoFault::SampleDropped);

/// An edit; a stroke of paint, for example, is a Brush, Dabs, and Nothing more.
struct Edit {
  std::uint64_t model = 0;  ///< the number of the snapshot that it leads to
  std::variant<Brush, Dab, detail::Solid, detail::Needed, StrokeAgain, detail::Nothing, detail::Cancelled,
               detail::Moved>
      what;
};

std::uint64_t number_of(std::string_view text, int base) {
  std::uint64_t value = 0;
  std::from_chars(text.data(), text.data() + text.size(), value, base);
  return value;
}

std::string names_of(const RecordingColumns& columns) {
  std::string text;
  for (const RecordingColumn& column : columns) text += (text.empty() ? "" : ", ") + printable(column.name, 40);
  return text;
}

template <typename T>
RowReader<T> reader_of(const Recording& recording) {
  const auto& streams = recording.head().streams;
  const auto found = streams.find(detail::kStream<T>);
  return RowReader<T>(found == streams.end() ? RecordingColumns{} : found->second);
}

}  // namespace

struct Replay::State {
  explicit State(Recording opened) : recording(std::move(opened)), ticks(recording.columns()) {}

  Recording recording;
  RowReader<RecordedTick> ticks;
  /// Before they were debounced, they were those of the reading.
  bool has_held_buttons =
      std::ranges::find(recording.columns(), "held_buttons", &RecordingColumn::name) != recording.columns().end();
  DeviceInfo device;
  std::vector<ServoSettings> settings;
  std::vector<Vec3d> tool_points;  ///< the servo's for good: those of all settings
  std::vector<Edit> edits;
  bool has_room = false;  ///< a stroke went on with room that was made for it
  std::string unknown;
  std::vector<std::string> missing;
  // The batch that is being read.
  std::uint64_t first = 0;
  std::span<const std::byte> rows;
  std::size_t at = 0;  ///< bytes of it that were read

  template <typename T>
  void note(const RowReader<T>& reader, bool unknown_matters) {
    if (unknown_matters && !reader.unknown().empty())
      unknown += (unknown.empty() ? "" : ", ") + std::string(detail::kStream<T>) + ": " + names_of(reader.unknown());
    for (const RecordingColumn& column : reader.missing())
      missing.push_back(std::string(detail::kStream<T>) + ": " + column.name);
  }

  [[nodiscard]] Status read_events() {
    const auto device_reader = reader_of<DeviceInfo>(recording);
    const auto settings_reader = reader_of<ServoSettings>(recording);
    const auto point_reader = reader_of<Vec3d>(recording);
    const auto brush_reader = reader_of<Brush>(recording);
    const auto dab_reader = reader_of<Dab>(recording);
    const auto solid_reader = reader_of<detail::Solid>(recording);
    const auto needed_reader = reader_of<detail::Needed>(recording);
    const auto again_reader = reader_of<StrokeAgain>(recording);
    const auto moved_reader = reader_of<detail::Moved>(recording);
    note(device_reader, true);
    note(settings_reader, true);
    RecordingColumns inputs = ticks.unknown();
    std::erase_if(inputs, [](const RecordingColumn& c) { return c.role != detail::name(detail::Role::Input); });
    if (!inputs.empty()) unknown += (unknown.empty() ? "" : ", ") + ("tick: " + names_of(inputs));
    note(ticks, false);
    device.name = recording.head().fact("device");

    bool has_device = false, in_stroke = false, may_get_room = false;
    // Rows that only an open stroke may have.
    const auto add_to_stroke = [&]<typename T>(const RowReader<T>& reader, const RecordingEvent& event) {
      T row;
      reader.read(event.row, row);
      edits.push_back({event.at, row});
      return in_stroke;
    };
    for (const RecordingEvent& event : recording.events()) {
      const auto is = [&](std::string_view stream) { return event.stream == stream; };
      if (is(detail::kStream<DeviceInfo>)) {
        device_reader.read(event.row, device);
        has_device = true;
      } else if (is(detail::kStream<ServoSettings>)) {
        if (event.at != settings.size()) return recording.damaged("its settings are not in order");
        settings_reader.read(event.row, settings.emplace_back());
      } else if (is(detail::kStream<Vec3d>)) {
        if (tool_points.size() == TouchTool::kMostPoints) return recording.damaged("its tool has too many points");
        point_reader.read(event.row, tool_points.emplace_back());
      } else if (is(detail::kStream<Brush>)) {
        // Recordings that do not have it were made on the grid as it was.
        Brush brush{.detail = 0};
        brush_reader.read(event.row, brush);
        const bool sound = static_cast<std::size_t>(brush.tool) < tools().size() && brush.falloff <= Falloff::Dome &&
                           check(Stroke{.brush = brush, .label = {}, .points = {}}).has_value();
        if (!sound || in_stroke) return recording.damaged(kDamagedOrder);
        in_stroke = true;
        may_get_room = false;
        edits.push_back({event.at, brush});
      } else if (is(detail::kStream<Dab>)) {
        if (!add_to_stroke(dab_reader, event)) return recording.damaged(kDamagedOrder);
      } else if (is(detail::kStream<detail::Solid>)) {
        if (!add_to_stroke(solid_reader, event)) return recording.damaged(kDamagedOrder);
      } else if (is(detail::kStream<detail::Needed>)) {
        if (!add_to_stroke(needed_reader, event)) return recording.damaged(kDamagedOrder);
        may_get_room = true;
      } else if (is(detail::kStream<StrokeAgain>)) {
        if (!add_to_stroke(again_reader, event)) return recording.damaged(kDamagedOrder);
        const bool on_room = std::get<StrokeAgain>(edits.back().what).on_room;
        if (on_room && !may_get_room) return recording.damaged(kDamagedOrder);
        has_room = has_room || on_room;
      } else if (is(detail::kStream<detail::Nothing>) || is(detail::kStream<detail::Cancelled>)) {
        if (!in_stroke) return recording.damaged(kDamagedOrder);
        in_stroke = false;
        edits.push_back({event.at, detail::Nothing{}});
        if (is(detail::kStream<detail::Cancelled>)) edits.back().what = detail::Cancelled{};
      } else if (is(detail::kStream<detail::Moved>)) {
        if (in_stroke) return recording.damaged(kDamagedOrder);
        detail::Moved moved;
        moved_reader.read(event.row, moved);
        edits.push_back({event.at, moved});
      } else {
        unknown += (unknown.empty() ? "" : ", ") + printable(event.stream, 40);
      }
    }
    if (!has_device || settings.empty())
      return recording.damaged(recording.cut() ? "it was cut before its device and its settings"
                                               : "it does not say its device or its settings");
    if (!tool_points.empty()) note(point_reader, true);
    for (ServoSettings& known : settings) known.tool.points = tool_points;
    if (!edits.empty()) {
      note(brush_reader, true);
      note(dab_reader, true);
      note(solid_reader, true);
      note(needed_reader, true);
      note(again_reader, true);
    }
    return {};
  }
};

Replay::Replay(std::unique_ptr<State> state) noexcept : state_(std::move(state)) {}
Replay::Replay(Replay&&) noexcept = default;
Replay& Replay::operator=(Replay&&) noexcept = default;
Replay::~Replay() = default;

Result<Replay> Replay::open(const std::filesystem::path& file) {
  RELIEF_TRY(Recording recording, Recording::open(file));
  auto state = std::make_unique<State>(std::move(recording));
  RELIEF_CHECK(state->read_events());
  return Replay(std::move(state));
}

Recording& Replay::recording() noexcept { return state_->recording; }
const Recording& Replay::recording() const noexcept { return state_->recording; }
const DeviceInfo& Replay::device() const noexcept { return state_->device; }
const std::vector<ServoSettings>& Replay::settings() const noexcept { return state_->settings; }
int Replay::contact_law() const noexcept {
  const auto law = number_of(state_->recording.head().fact("contact_law"), 10);
  return law > 0 && law < 1'000'000 ? static_cast<int>(law) : 1;
}
const std::string& Replay::unknown() const noexcept { return state_->unknown; }

void Replay::rewind() noexcept {
  state_->recording.rewind();
  state_->rows = {};
  state_->at = 0;
}

Result<bool> Replay::next(std::uint64_t& number, RecordedTick& tick) {
  State& s = *state_;
  const std::size_t width = row_bytes(s.recording.columns());
  if (s.at == s.rows.size()) {
    RELIEF_TRY(const bool more, s.recording.next(s.first, s.rows));
    s.at = 0;
    if (!more) {
      s.rows = {};
      return false;
    }
  }
  number = s.first + s.at / width;
  tick = {};
  s.ticks.read(s.rows.subspan(s.at, width), tick);
  tick.sample.t = tick.reading.t;
  tick.sample.device = tick.reading.position;
  if (!s.has_held_buttons) tick.sample.buttons = tick.reading.buttons;
  s.at += width;
  if (tick.settings < s.settings.size()) return true;
  if (!s.recording.cut()) return s.recording.damaged("a tick has settings that it does not hold");
  rewind();
  return false;
}

Result<std::vector<DeviceState>> Replay::readings(const Progress& progress) {
  Steps steps(progress, "recording", state_->recording.tick_count());
  std::vector<DeviceState> all;
  all.reserve(state_->recording.tick_count());
  rewind();
  std::uint64_t number = 0;
  for (RecordedTick tick;;) {
    RELIEF_TRY(const bool more, next(number, tick));
    if (!more) return all;
    all.push_back(tick.reading);
    if (!steps.next())
      return fail(Errc::Cancelled, "'" + printable(state_->recording.file().string()) + "' is not read: cancelled");
  }
}

Result<PlayedDevice> play_as_device(const std::filesystem::path& file, const Progress& progress) {
  RELIEF_TRY(Replay replay, Replay::open(file));
  RELIEF_TRY(std::vector<DeviceState> readings, replay.readings(progress));
  auto device = std::make_unique<ReplayDevice>(replay.device(), std::move(readings));
  return PlayedDevice{.replay = std::move(replay), .device = std::move(device)};
}

bool PlayedDevice::was_made_with(const Snapshot& model) const {
  return number_of(replay.recording().head().fact("model_hash"), 16) == model.content_hash();
}

// ---- The model

Result<SnapshotPtr> find_model(const Replay& replay, const std::filesystem::path& instead,
                               const std::function<Status(const std::filesystem::path&, const ModelFile&)>& opened,
                               const Progress& progress) {
  const Recording& recording = replay.recording();
  const std::uint64_t hash = number_of(recording.head().fact("model_hash"), 16);
  const std::uint64_t strokes = number_of(recording.head().fact("model_strokes"), 10);
  const std::string said = printable(recording.file().string());
  std::filesystem::path file = instead;
  if (file.empty()) {
    std::error_code code;
    file = std::string(recording.head().fact("model"));
    if (!std::filesystem::exists(file, code)) file = recording.file().parent_path() / file.filename();
    if (file.filename().empty() || !std::filesystem::exists(file, code))
      return fail(Errc::NotFound, said + ": its model '" + printable(recording.head().fact("model")) +
                                      "' is not there; name it with --model");
  }
  RELIEF_TRY(const ModelFile found, ModelFile::open(file, true, progress));
  if (opened) RELIEF_CHECK(opened(file, found));
  if (found.model().head->content_hash() == hash) return found.model().head;
  if (found.stroke_count() != strokes && found.stroke_count() + found.redo_count() >= strokes) {
    RELIEF_TRY(SnapshotPtr before, found.at(strokes, progress));
    if (before->content_hash() == hash) return before;
  }
  return fail(Errc::InvalidArgument, said + ": '" + printable(file.string()) +
                                         "' is not the model that was recorded, or has been changed since; name the "
                                         "one that was with --model");
}

// ---- Playing

namespace {

/// Leads a model through the recorded edits.
class Edits {
 public:
  Edits(const std::vector<Edit>& edits, const SnapshotPtr& model, const RoomMaker& make_room, const Progress& progress)
      : edits_(edits), make_room_(make_room), progress_(progress), editor_(model), history_{model} {}

  /// Does what leads to snapshot `model`; false where nothing recorded leads there. Errors: those of the room maker.
  [[nodiscard]] Result<bool> lead_to(std::uint64_t model) {
    before_ = editor_.head();
    for (; next_ < edits_.size() && edits_[next_].model <= model; ++next_) {
      number_ = edits_[next_].model;
      RELIEF_TRY(const bool done, std::visit([this](const auto& edit) { return apply(edit); }, edits_[next_].what));
      if (!done) return false;
    }
    head_ = editor_.head();
    return number_ == model;
  }
  [[nodiscard]] const Snapshot& head() const noexcept { return *head_; }

 private:
  Result<bool> apply(const Brush& brush) {
    brush_ = brush;
    start_ = editor_.head();
    begin_on(start_);
    return true;
  }
  Result<bool> apply(const Dab& dab) {
    editor_.dab(dab);
    return true;
  }
  Result<bool> apply(const detail::Solid& solid) {
    (solid.fills ? solids_.fill : solids_.cut).push_back(solid.shape);
    return true;
  }
  Result<bool> apply(detail::Needed needed) {
    wanted_ = std::exchange(solids_, {});
    room_from_ = needed.ended ? base_ : editor_.start();
    return true;
  }
  /// False where no room can be made.
  Result<bool> apply(StrokeAgain again) {
    SnapshotPtr base = start_;
    if (again.on_room) {
      RELIEF_TRY(const Room room, make_room_(room_from_, wanted_, progress_));
      if (!room.model) return false;
      base = room.model;
    }
    editor_.cancel_stroke();
    begin_on(base);
    return true;
  }
  Result<bool> apply(detail::Nothing /*end*/) {
    if (!editor_.end_stroke().changed) {
      editor_.set_head(start_);
      return true;
    }
    history_.resize(++position_);
    history_.push_back(editor_.head());
    return true;
  }
  Result<bool> apply(detail::Cancelled /*end*/) {
    editor_.cancel_stroke();
    editor_.set_head(start_);
    return true;
  }
  /// False where it leads to what was before the recording.
  Result<bool> apply(detail::Moved moved) {
    const std::int64_t to = static_cast<std::int64_t>(position_) + moved.steps;
    if (to < 0 || to >= static_cast<std::int64_t>(history_.size())) return false;
    position_ = static_cast<std::size_t>(to);
    editor_.set_head(history_[position_]);
    return true;
  }

  void begin_on(const SnapshotPtr& base) {
    base_ = base;
    editor_.set_head(base);
    editor_.begin_stroke(brush_);
  }

  const std::vector<Edit>& edits_;
  const RoomMaker& make_room_;
  const Progress& progress_;
  std::size_t next_ = 0;
  Editor editor_;
  Brush brush_;            ///< of the open stroke
  SnapshotPtr start_;      ///< the model before it
  SnapshotPtr base_;       ///< what it began on last
  RoomWanted solids_;      ///< of the room that comes next
  RoomWanted wanted_;      ///< of the one that was needed last
  SnapshotPtr room_from_;  ///< what that is made from
  SnapshotPtr head_ = editor_.head();
  SnapshotPtr before_;                ///< alive for a tick more, so that the servo never meets its address again
  std::vector<SnapshotPtr> history_;  ///< after each stroke of the recording
  std::size_t position_ = 0;
  std::uint64_t number_ = 0;
};

/// Calls visit(number, tick, model) -> bool for all ticks in order, with the model as it was then; false stops. Returns
/// why it ended before the last tick, or nothing.
template <typename Visit>
Result<std::string> play(Replay& replay, const SnapshotPtr& model, const RoomMaker& make_room, const Progress& progress,
                         std::string_view phase, Visit&& visit) {
  if (!replay.unknown().empty())
    return fail(Errc::InvalidArgument, printable(replay.recording().file().string()) +
                                           ": was made by a newer program (" +
                                           printable(replay.recording().head().fact("program"), 60) +
                                           ") and has what this one cannot repeat: " + replay.unknown());
  if (replay.state().has_room && !make_room)
    return fail(Errc::InvalidArgument, printable(replay.recording().file().string()) +
                                           ": room was made under its strokes, and nobody here can make it again");
  const Progress silent = {.report = {}, .cancel = progress.cancel};
  Edits edits(replay.state().edits, model, make_room, silent);
  replay.rewind();
  std::uint64_t number = 0, done = 0, model_number = 0;
  for (RecordedTick tick;; ++done) {
    if (done % 4096 == 0) {
      if (progress.cancelled()) return fail(Errc::Cancelled, "cancelled");
      progress(phase, static_cast<double>(done) / static_cast<double>(replay.recording().tick_count() + 1));
    }
    RELIEF_TRY(const bool more, replay.next(number, tick));
    if (!more) return std::string();
    if (std::exchange(model_number, tick.model) != tick.model) {
      RELIEF_TRY(const bool led, edits.lead_to(tick.model));
      if (!led) return "the model changed at tick " + std::to_string(number) + " in a way that was not recorded";
    }
    if (!visit(number, tick, edits.head())) return std::string();
  }
}

/// A servo whose settings follow the recording.
class RecordedServo {
 public:
  RecordedServo(std::vector<ServoSettings> settings, const DeviceInfo& device)
      : settings_(std::move(settings)), servo_(settings_.front(), device) {}
  [[nodiscard]] ServoSample step(const Snapshot& model, const RecordedTick& tick) {
    while (used_ < tick.settings) servo_.set(settings_[++used_]);
    // That its loop stood still, or its device was away, the servo was told from outside; its answer says so.
    if ((tick.sample.flags & bit(ServoFault::Stalled)) != 0) servo_.stalled();
    if ((tick.sample.flags & bit(ServoFault::Reconnected)) != 0) servo_.reconnected();
    return servo_.step(model, tick.reading);
  }

 private:
  std::vector<ServoSettings> settings_;
  std::size_t used_ = 0;
  Servo servo_;
};

/// Returns the first output in which two rows of columns_of<RecordedTick>() differ.
std::optional<Verification::Difference> difference(const RowReader<RecordedTick>& reader,
                                                   const RecordingColumns& columns, std::span<const std::byte> recorded,
                                                   std::span<const std::byte> now) {
  std::size_t at = 0;
  for (std::size_t k = 0; k < columns.size(); ++k) {
    const std::size_t bytes = bytes_of(columns[k].type);
    const auto was = recorded.subspan(at, bytes), is = now.subspan(at, bytes);
    at += bytes;
    if (columns[k].role != detail::name(detail::Role::Output) || !reader.has(k) || std::ranges::equal(was, is))
      continue;
    return Verification::Difference{0, 0, columns[k].name, text_of(was, columns[k], kSlabOrNone),
                                    text_of(is, columns[k], kSlabOrNone)};
  }
  return std::nullopt;
}

}  // namespace

Result<Verification> verify(Replay& replay, const SnapshotPtr& model, const RoomMaker& make_room,
                            const Progress& progress) {
  Verification result;
  result.ticks = replay.recording().tick_count();
  result.missing = replay.state().missing;
  result.contact_law = replay.contact_law();
  const RecordingColumns columns = detail::columns_of<RecordedTick>();
  RecordedServo servo(replay.settings(), replay.device());
  std::vector<std::byte> was, is;
  RELIEF_TRY(std::string ended, play(replay, model, make_room, progress, "verify",
                                     [&](std::uint64_t number, const RecordedTick& tick, const Snapshot& snapshot) {
                                       if (number != result.checked) {
                                         result.stopped = std::to_string(number - result.checked) +
                                                          " ticks before tick " + std::to_string(number) +
                                                          " were dropped";
                                         return false;
                                       }
                                       RecordedTick now = tick;
                                       now.sample = servo.step(snapshot, tick);
                                       now.sample.flags |= tick.sample.flags & kThreadFlags;
                                       if ((now.sample.flags & bit(ServoFault::DeviceLost)) != 0)
                                         now.sample.force = now.sample.torque = {};
                                       was.clear();
                                       is.clear();
                                       detail::append_row(tick, was);
                                       detail::append_row(now, is);
                                       result.difference = difference(replay.state().ticks, columns, was, is);
                                       if (result.difference) {
                                         result.difference->tick = number;
                                         result.difference->t = tick.reading.t;
                                         return false;
                                       }
                                       ++result.checked;
                                       return true;
                                     }));
  if (result.stopped.empty()) result.stopped = std::move(ended);
  return result;
}

Result<Comparison> compare(Replay& replay, const SnapshotPtr& model, const std::function<void(ServoSettings&)>& change,
                           const RoomMaker& make_room, const Progress& progress) {
  std::vector<ServoSettings> others = replay.settings();
  for (ServoSettings& settings : others) change(settings);
  RecordedServo recorded(replay.settings(), replay.device()), other(std::move(others), replay.device());
  Comparison result;
  std::uint64_t pressed = 0, directed = 0;
  const auto timed = [](RecordedServo& servo, const Snapshot& snapshot, const RecordedTick& tick, TimeHistogram& cost) {
    const std::uint64_t start = thread_cpu_ns();
    const ServoSample sample = servo.step(snapshot, tick);
    cost.add(thread_cpu_ns() - start);
    return sample;
  };
  RELIEF_TRY(const std::string stopped,
             play(replay, model, make_room, progress, "compare",
                  [&](std::uint64_t number, const RecordedTick& tick, const Snapshot& snapshot) {
                    const ServoSample a = timed(recorded, snapshot, tick, result.cost);
                    const ServoSample b = timed(other, snapshot, tick, result.other_cost);
                    ++result.ticks;
                    result.contact += a.contact ? 1U : 0U;
                    result.contact_differs += a.contact != b.contact ? 1U : 0U;
                    const double fa = length(a.force), fb = length(b.force), error = length(b.force - a.force);
                    if (fa > 0 || fb > 0) {
                      ++pressed;
                      result.force_rms += fa * fa;
                      result.error_rms += error * error;
                    }
                    if (error > result.error_max) {
                      result.error_max = error;
                      result.error_at = number;
                    }
                    if (fa > 0.05 && fb > 0.05) {
                      const double degrees =
                          std::atan2(length(cross(a.force, b.force)), dot(a.force, b.force)) * (180 / std::numbers::pi);
                      ++directed;
                      result.direction_rms += degrees * degrees;
                      result.direction_max = std::max(result.direction_max, degrees);
                    }
                    return true;
                  }));
  if (!stopped.empty())
    return fail(Errc::InvalidArgument, printable(replay.recording().file().string()) + ": " + stopped);
  const auto root_mean = [](double sum, std::uint64_t count) {
    return count == 0 ? 0.0 : std::sqrt(sum / static_cast<double>(count));
  };
  result.force_rms = root_mean(result.force_rms, pressed);
  result.error_rms = root_mean(result.error_rms, pressed);
  result.direction_rms = root_mean(result.direction_rms, directed);
  return result;
}

}  // namespace relief
