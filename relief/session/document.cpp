#include <relief/base/cpu_time.h>
#include <relief/base/try.h>
#include <relief/session/document.h>
#include <relief/session/history.h>
#include <relief/session/saver.h>
#include <relief/session/stroke_text.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <condition_variable>
#include <deque>
#include <future>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

namespace relief {

namespace {

using detail::History;
using detail::Saver;

/// Dabs of one MoveStroke after which readers see what it has done so far: at a dab each 8 ms, 15 times a second of the
/// hand's time. Single points, as a hand gives them, are seen at once.
constexpr int kDabsUnseen = 8;

/// Whether a point can be of a stroke that goes on after `last`; as StrokeEngine sees it.
bool counts(const StrokePoint& p, const StrokePoint* last) noexcept {
  constexpr double kFarthestTime = 1e12;  // s, as check(Stroke)
  return std::isfinite(p.t) && std::abs(p.t) <= kFarthestTime && is_finite(p.position) && std::isfinite(p.pressure) &&
         (last == nullptr || p.t >= last->t);
}

/// Where a dab may have moved the surface. No dab moves it by more than a radius, or the brush's height.
Box3d reach_of(const Brush& brush, const Dab& dab) noexcept {
  const double reach = 2 * brush.radius + std::abs(brush.height);
  Box3d box;
  const auto add = [&](Vec3d centre) {
    box.add(centre - Vec3d{reach, reach, reach});
    box.add(centre + Vec3d{reach, reach, reach});
  };
  add(dab.contact);
  if (info(brush.tool).action == Action::Cut) {
    const Vec3d to_centre = dab.normal * (brush.radius + brush.resilience);
    add(dab.cursor + to_centre);
    if (dab.swept) add(dab.from);
  }
  return box;
}

/// The slabs in which two models differ.
Box3d difference_of(const Snapshot& from, const Snapshot& to) {
  Box3d box;
  const auto add = [&box](const Snapshot& a, const Snapshot& b) {
    for_each_change(a, b, [&](Layer, SlabId s) {
      box.add(b.slab_mesh().box(s).low);
      box.add(b.slab_mesh().box(s).high);
    });
  };
  add(from, to);
  add(to, from);  // layers that only the old one has
  return box;
}

/// A layer that comes or goes may change how all of the surface looks.
bool same_layers(const Snapshot& a, const Snapshot& b) {
  for (int k = 0; k < kLayerCount; ++k)
    if (a.has(static_cast<Layer>(k)) != b.has(static_cast<Layer>(k))) return false;
  return true;
}

std::uint64_t tiles_between(const Snapshot& from, const Snapshot& to) {
  std::uint64_t tiles = 0;
  for_each_change(from, to, [&](Layer, SlabId) { ++tiles; });
  return tiles;
}

}  // namespace

struct Document::State {
  State(Model first, std::filesystem::path place, std::optional<ModelFile> file,
        const std::vector<std::string>& strokes, std::size_t position, DocumentSettings given)
      : settings(std::move(given)),
        info(first.info),
        has_file(file.has_value()),
        history(first.head, strokes, position),
        editor(first.head),
        engine(editor),
        channel(first.head),
        published(first.head),
        saver(first.info, std::move(place), std::move(file), settings.retry_after,
              [this](Saver::Notice notice) { tell(std::move(notice)); }) {
    engine.on_dab([this](const Dab& dab, const DabResult& result) { made(dab, result); });
    engine.stop_at(&stop);
    list_labels();
    count();
    thread = std::thread([this] { run(); });
  }
  ~State() { static_cast<void>(close()); }

  // ---- Any thread

  struct Watch {
    std::function<void(const EditNote&)> note;
    std::promise<SnapshotPtr>* done = nullptr;
  };
  struct Settle {
    std::promise<void>* done = nullptr;
  };
  using Order = std::variant<Command, Saver::Notice, Watch, Settle>;

  bool put(Order order) {
    const std::scoped_lock lock(mutex);
    if (closing) return false;
    if (const auto* command = std::get_if<Command>(&order))
      if (const auto* cancel = std::get_if<CancelStroke>(command)) cancel_open(*cancel);
    orders.push_back(std::move(order));
    wake.notify_one();
    return true;
  }

  /// Whether an order ends the stroke that a source has open.
  static bool ends_stroke(const Order& order, std::int64_t source) {
    if (std::holds_alternative<Watch>(order)) return true;
    const auto* command = std::get_if<Command>(&order);
    if (command == nullptr) return false;
    if (const auto* begin = std::get_if<BeginStroke>(command)) return begin->source == source;
    if (const auto* end = std::get_if<EndStroke>(command)) return end->source == source;
    return std::holds_alternative<Undo>(*command) || std::holds_alternative<Redo>(*command);
  }

  /// A cancel reaches the stroke that is being worked on inside, also one whose end waits already; unless it is meant
  /// for what comes after that. Under the lock.
  void cancel_open(const CancelStroke& cancel) {
    if (open_source != cancel.source) return;
    const auto comes_after = [&](const Order& order) {
      const auto* command = std::get_if<Command>(&order);
      const bool is_end = command != nullptr && std::holds_alternative<EndStroke>(*command);
      return !is_end && ends_stroke(order, open_source);
    };
    if (std::ranges::none_of(orders, comes_after)) stop.store(true);
  }

  /// From the saver's thread.
  void tell(Saver::Notice notice) {
    const std::scoped_lock lock(mutex);
    notices.push_back(std::move(notice));
    wake.notify_one();
  }

  Status close() {
    if (!thread.joinable()) return closed;
    {
      const std::scoped_lock lock(mutex);
      closing = true;
      wake.notify_one();
    }
    thread.join();
    return closed;
  }

  // ---- The edit thread

  void run() {
    std::unique_lock lock(mutex);
    while (true) {
      wake.wait(lock, [&] { return !orders.empty() || !notices.empty() || closing; });
      if (!notices.empty()) {
        lock.unlock();
        while (take_notice()) {
        }
        lock.lock();
        continue;
      }
      if (orders.empty()) break;
      Order order = std::move(orders.front());
      orders.pop_front();
      if (ends_stroke(order, open_source)) open_source = kNobody;
      lock.unlock();
      std::visit([this](auto& what) { take(what); }, order);
      lock.lock();
    }
    open_source = kNobody;
    lock.unlock();
    end_stroke();
    closed = saver.close();
    while (take_notice()) {
    }
    note = {};
  }

  bool take_notice() {
    std::optional<Saver::Notice> notice;
    {
      const std::scoped_lock lock(mutex);
      if (notices.empty()) return false;
      notice = std::move(notices.front());
      notices.pop_front();
    }
    std::visit([this](auto& what) { take(what); }, *notice);
    return true;
  }

  void take(Command& command) {
    std::visit([this](auto& what) { take(what); }, command);
    count();
  }
  void take(Saver::Notice& notice) {
    std::visit([this](auto& what) { take(what); }, notice);
  }
  void take(Watch& asked) {
    end_stroke();
    note = std::move(asked.note);
    asked.done->set_value(published);
  }
  static void take(Settle& asked) { asked.done->set_value(); }

  void emit(const Event& event) const {
    if (settings.on_event) settings.on_event(event);
  }
  void say(const EditNote& what) const {
    if (note) note(what);
  }

  // ---- Strokes

  struct OpenStroke {
    StrokeSource source = 0;
    Stroke stroke;          ///< its points so far
    SnapshotPtr start;      ///< the model before it
    std::uint64_t cpu = 0;  ///< ns of the edit thread
    int unseen = 0;         ///< dabs since the last publication
    Box3d box;              ///< of these
    bool said_limit = false, said_miss = false;
  };

  /// From now on a cancel of that source reaches the stroke inside.
  void set_open(std::int64_t source) {
    const std::scoped_lock lock(mutex);
    open_source = source;
  }
  [[nodiscard]] bool is_open(StrokeSource source) const { return open.has_value() && open->source == source; }

  void take(BeginStroke& begin) {
    if (open.has_value() && open->source != begin.source) {
      emit(StrokeRefused{begin.source});
      return;
    }
    end_stroke();
    if (const Status sound = check(Stroke{.brush = begin.brush, .label = {}, .points = {}}); !sound) {
      emit(Failed{sound.error(), saver.unsaved()});
      return;
    }
    std::string label = begin.label.empty() ? std::string(name(begin.brush.tool)) : begin.label;
    open.emplace();
    open->source = begin.source;
    open->stroke = {.brush = begin.brush, .label = std::move(label), .tip = begin.tip, .points = {}};
    open->start = editor.head();
    stop.store(false);
    set_open(begin.source);
    say(StrokeBegun{begin.brush});
    engine.begin(begin.brush, begin.tip);
  }

  void take(MoveStroke& move) {
    if (!is_open(move.source)) return;
    const std::uint64_t start = dab_began = thread_cpu_ns();
    const std::size_t count = move.points.size();
    for (std::size_t k = 0; k < count && !stop.load(); ++k) {
      StrokePoint point = move.points[k];
      std::vector<StrokePoint>& so_far = open->stroke.points;
      if (!counts(point, so_far.empty() ? nullptr : &so_far.back())) continue;
      point.pressure = std::clamp(point.pressure, 0.0, 1.0);
      so_far.push_back(point);
      engine.move(std::span(&point, 1));
      after_point();
      if (count > 100 && k % (count / 100) == 0)
        emit(Progressed{"stroke", static_cast<double>(k) / static_cast<double>(count)});
    }
    publish();
    open->cpu += thread_cpu_ns() - start;
  }

  /// Each dab, just after it was made.
  void made(const Dab& dab, const DabResult& result) {
    say(DabMade{dab});
    const Box3d reach = reach_of(open->stroke.brush, dab);
    open->box.add(reach.low);
    open->box.add(reach.high);
    if (++open->unseen >= kDabsUnseen) {
      publish();
      while (take_notice()) {
      }
    }
    const std::uint64_t now = thread_cpu_ns();
    const std::scoped_lock lock(counted_mutex);
    ++counted.dabs;
    counted.samples += result.samples;
    counted.limited += result.limited;
    counted.dab_time.add(now - std::exchange(dab_began, now));
  }

  void after_point() {
    const StrokeResult& so_far = engine.so_far();
    if (so_far.limited > 0 && !std::exchange(open->said_limit, true)) emit(LimitReached{open->source, so_far});
    if (so_far.missed > 0 && !std::exchange(open->said_miss, true)) emit(PointMissed{open->source});
  }

  void take(const EndStroke& end) {
    if (is_open(end.source)) end_stroke();
  }
  void take(const CancelStroke& cancel) {
    if (is_open(cancel.source)) cancel_stroke();
  }

  void end_stroke() {
    if (!open.has_value()) return;
    set_open(kNobody);
    if (stop.load()) {
      cancel_stroke();
      return;
    }
    const std::uint64_t start = dab_began = thread_cpu_ns();
    const StrokeResult result = engine.end();
    after_end(result);
    StrokeFinished finished = finish(result, start);
    say(StrokeEnded{.kept = true, .changed = result.changed});
    publish();
    if (result.changed) keep(finished);
    finished.stroke = history.position();
    open.reset();
    emit(finished);
    if (result.changed) tell_history();
  }

  /// What the last dab brought.
  void after_end(const StrokeResult& result) {
    if (result.limited > 0 && !open->said_limit) emit(LimitReached{open->source, result});
    if (result.missed > 0 && !open->said_miss) emit(PointMissed{open->source});
    const std::scoped_lock lock(counted_mutex);
    counted.missed += result.missed;
    counted.strokes += result.changed ? 1U : 0U;
  }

  StrokeFinished finish(const StrokeResult& result, std::uint64_t start) {
    return {.source = open->source,
            .tool = open->stroke.brush.tool,
            .label = open->stroke.label,
            .result = result,
            .tiles = result.changed ? tiles_between(*open->start, *editor.head()) : 0,
            .seconds = static_cast<double>(open->cpu + thread_cpu_ns() - start) * 1e-9};
  }

  void cancel_stroke() {
    set_open(kNobody);
    const std::uint64_t start = thread_cpu_ns();
    engine.cancel();
    StrokeFinished finished = finish({}, start);
    finished.cancelled = true;
    finished.stroke = history.position();
    say(StrokeEnded{.kept = false, .changed = false});
    publish();
    open.reset();
    stop.store(false);
    emit(finished);
  }

  /// The stroke that has just ended becomes a step of the history.
  void keep(const StrokeFinished& finished) {
    std::string text = journal_text(open->stroke, finished.result);
    StrokeRecord record{.label = finished.label, .details = text};
    const std::size_t number = history.push(editor.head(), finished.label, std::move(text));
    {
      const std::scoped_lock lock(counted_mutex);
      labels.resize(number - 1 - history.first());
      labels.push_back(finished.label);
    }
    if (has_file) saver.commit(history.at(number).serial, editor.head(), std::move(record));
    fit();
  }

  /// Readers see what the editor has.
  void publish() {
    const SnapshotPtr& head = editor.head();
    if (open.has_value()) open->unseen = 0;
    if (head == published) return;
    Box3d box = open.has_value() ? std::exchange(open->box, {}) : Box3d();
    if (box.empty() || !same_layers(*published, *head)) box = difference_of(*published, *head);
    say(HeadMade{head});
    {
      const std::scoped_lock lock(mutex);
      published = head;
    }
    channel.publish(head);
    emit(SnapshotChanged{head->number(), box});
  }

  // ---- The history

  void take(const Undo& undo) {
    end_stroke();
    const std::size_t steps = std::min<std::size_t>(undo.steps, history.position() - history.first());
    go_to(history.position() - steps);
  }
  void take(const Redo& redo) {
    end_stroke();
    const std::size_t steps = std::min<std::size_t>(redo.steps, history.last() - history.position());
    go_to(history.position() + steps);
  }

  void go_to(std::size_t number) {
    const std::size_t before = history.position();
    if (number == before) return;
    if (moving > 0 && !may_keep(number)) {
      emit(Failed{
          Error{Errc::NotFound, "the step is in a file that is being left; try again when it is saved elsewhere"},
          saver.unsaved()});
      return;
    }
    SnapshotPtr state = history.at(number).snapshot;
    if (!state) {
      const auto [near_number, near] = history.nearest_saved(number);
      auto read = saver.read(number, near_number, near);
      if (!read) {
        emit(Failed{read.error(), saver.unsaved()});
        return;
      }
      state = *std::move(read);
    }
    history.move_to(number, state);
    editor.set_head(state);
    say(HistoryMoved{static_cast<std::int64_t>(number) - static_cast<std::int64_t>(before)});
    publish();
    if (has_file) saver.go_to(number, std::move(state));
    fit();
    tell_history();
  }

  void fit() {
    const std::size_t dropped = history.fit(settings.history_bytes, has_file);
    if (dropped == 0) return;
    list_labels();
    emit(HistoryDropped{dropped});
  }

  void list_labels() {
    const std::scoped_lock lock(counted_mutex);
    labels.clear();
    for (std::size_t k = history.first() + 1; k <= history.last(); ++k) labels.push_back(history.at(k).label);
  }

  void tell_history() {
    count();
    emit(HistoryChanged{.undo_steps = history.position() - history.first(),
                        .redo_steps = history.last() - history.position(),
                        .undo_label = std::string(history.undo_label()),
                        .redo_label = std::string(history.redo_label())});
  }

  void take(const SetHistoryBytes& set) {
    settings.history_bytes = set.bytes;
    const auto undo = history.first(), redo = history.last();
    fit();
    if (undo != history.first() || redo != history.last()) tell_history();
  }

  // ---- The file

  void take(const SaveElsewhere& save) {
    const auto [low, high] = history.held_around();
    std::vector<Saver::Kept> kept;
    for (std::size_t k = low; k <= high; ++k) {
      const History::State& state = history.at(k);
      kept.push_back({state.serial, state.snapshot, state.label, state.text});
    }
    kept_range = {
        .low = low, .high = high, .serial = history.at(high).serial, .newest = history.at(history.last()).serial};
    ++moving;
    saver.elsewhere(save.file, low, history.position(), std::move(kept));
    has_file = true;
  }

  /// Whether the file will have state `number`, if it must be made of what is in memory.
  [[nodiscard]] bool may_keep(std::size_t number) const {
    return number >= kept_range.low && (number <= kept_range.high || history.at(number).serial > kept_range.newest);
  }

  void take(const Saver::Saved& saved) {
    const std::optional<std::size_t> number = history.saved(saved.serial);
    fit();
    count();
    if (number) emit(Saved{*number});
  }
  void take(Saver::Failed& failed) { emit(Failed{std::move(failed.error), failed.unsaved}); }
  void take(Saver::NotElsewhere& failed) {
    if (--moving == 0) has_file = failed.has_file;
    emit(Failed{std::move(failed.error), failed.unsaved});
  }
  void take(Saver::Elsewhere& moved) {
    --moving;
    const auto first = history.first(), last = history.last();
    if (!moved.copied) {
      history.keep_only(kept_range.low, may_keep(last) ? last : kept_range.high);
      history.saved_up_to(kept_range.serial);
    }
    const bool whole = history.first() == first && history.last() == last;
    if (!whole) list_labels();
    fit();
    count();
    emit(SavedElsewhere{std::move(moved.file), whole});
    if (!whole) tell_history();
  }
  void take(Saver::Progressed& progressed) { emit(Progressed{std::move(progressed.phase), progressed.share}); }

  void count() {
    const std::uint64_t unsaved = has_file ? saver.unsaved() : history.unsaved();
    const std::scoped_lock lock(counted_mutex);
    counted.undo_steps = history.position() - history.first();
    counted.redo_steps = history.last() - history.position();
    counted.history_bytes = history.bytes();
    counted.history_held = history.held();
    counted.unsaved = unsaved;
  }

  static constexpr std::int64_t kNobody = -1;

  DocumentSettings settings;
  const ModelInfo info;

  // The edit thread's.
  bool has_file;
  /// What went into the last SaveElsewhere: numbers, the serial number of `high`, and the newest that there was.
  struct KeptRange {
    std::size_t low = 0, high = 0;
    std::uint64_t serial = 0, newest = 0;
  } kept_range;
  int moving = 0;  ///< how many SaveElsewhere the saver has not answered
  History history;
  Editor editor;
  StrokeEngine engine;
  std::optional<OpenStroke> open;
  std::function<void(const EditNote&)> note;
  std::uint64_t dab_began = 0;  ///< thread CPU time
  SnapshotChannel channel;

  mutable std::mutex mutex;
  std::condition_variable wake;
  std::deque<Order> orders;
  std::deque<Saver::Notice> notices;
  bool closing = false;
  SnapshotPtr published;  ///< written under the lock by the edit thread

  std::int64_t open_source = kNobody;  ///< of the open stroke, as long as a cancel can reach it; under the lock
  std::atomic<bool> stop{false};       ///< the open stroke is cancelled

  mutable std::mutex counted_mutex;
  DocumentStatistics counted;
  std::vector<std::string> labels;

  Status closed;
  Saver saver;
  std::thread thread;
};

Document::Document(std::unique_ptr<State> state) noexcept : state_(std::move(state)) {}

Document::Document(Model model, DocumentSettings settings)
    : state_(std::make_unique<State>(std::move(model), std::filesystem::path(), std::nullopt,
                                     std::vector<std::string>(), std::size_t{0}, std::move(settings))) {}

Result<Document> Document::open(std::filesystem::path place, ModelFile file, DocumentSettings settings) {
  RELIEF_TRY(const std::vector<StrokeRecord> strokes, file.strokes());
  std::vector<std::string> labels;
  labels.reserve(strokes.size());
  for (const StrokeRecord& stroke : strokes) labels.push_back(stroke.label);
  Model model = file.model();
  const auto position = static_cast<std::size_t>(file.stroke_count());
  return Document(std::make_unique<State>(std::move(model), std::move(place), std::move(file), std::move(labels),
                                          position, std::move(settings)));
}

Document::Document(Document&&) noexcept = default;
Document::~Document() = default;

void Document::post(Command command) { state_->put(std::move(command)); }

void Document::settle() {
  std::promise<void> done;
  if (state_->put(State::Settle{&done})) done.get_future().wait();
}

Status Document::close() { return state_->close(); }

SnapshotPtr Document::head() const {
  const std::scoped_lock lock(state_->mutex);
  return state_->published;
}

SnapshotChannel& Document::channel() noexcept { return state_->channel; }
SnapshotChannel::Reader Document::reader() { return state_->channel.reader(); }
const ModelInfo& Document::info() const noexcept { return state_->info; }

DocumentStatistics Document::statistics() const {
  DocumentStatistics now;
  {
    const std::scoped_lock lock(state_->counted_mutex);
    now = state_->counted;
  }
  const std::scoped_lock lock(state_->mutex);
  now.waiting_commands = state_->orders.size();
  return now;
}

std::vector<std::string> Document::labels() const {
  const std::scoped_lock lock(state_->counted_mutex);
  return state_->labels;
}

SnapshotPtr Document::watch(std::function<void(const EditNote&)> note) {
  std::promise<SnapshotPtr> done;
  if (!state_->put(State::Watch{std::move(note), &done})) return head();
  return done.get_future().get();
}

}  // namespace relief
