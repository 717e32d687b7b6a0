#include <relief/base/cpu_time.h>
#include <relief/base/try.h>
#include <relief/session/cage_worker.h>
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
#include <map>
#include <mutex>
#include <optional>
#include <ranges>
#include <span>
#include <thread>
#include <utility>

namespace relief {

namespace {

using detail::CageWorker;
using detail::History;
using detail::Saver;

/// Dabs of one MoveStroke after which readers see what it has done so far: at a dab each 8 ms, 15 times a second of the
/// hand's time. Single points, as a hand gives them, are seen at once.
constexpr int kDabsUnseen = 8;

/// How often room is made for one stroke: each time costs 0.1 s and more, and what is asked for reaches a
/// good way beyond what the stroke has done.
constexpr int kMostRooms = 8;

/// Parts of a stroke nearer to each other than this, in radii, want the same room.
constexpr double kSameRoom = 0.125;

void add_solid(std::vector<Capsule>& solids, const Capsule& solid) {
  const double near = kSameRoom * solid.radius;
  if (!solids.empty() && length(solids.back().a - solid.a) < near && length(solids.back().b - solid.b) < near) return;
  solids.push_back(solid);
}

/// Returns whether a point can be of a stroke that goes on after `last`; as StrokeEngine sees it.
bool counts(const StrokePoint& p, const StrokePoint* last) noexcept {
  constexpr double kFarthestTime = 1e12;  // s, as check(Stroke)
  return std::isfinite(p.t) && std::abs(p.t) <= kFarthestTime && is_finite(p.position) && std::isfinite(p.pressure) &&
         (last == nullptr || p.t >= last->t);
}

/// Returns where a dab may have moved the surface. No dab moves it by more than a radius, or the brush's height, which
/// is a tenth of the brush's radius where nobody set one.
Box3d reach_of(const Brush& brush, const Dab& dab) noexcept {
  const double radius = brush.radius * dab.size,
               reach = 2 * radius + std::max(std::abs(brush.height), kLayerHeight * brush.radius);
  Box3d box;
  const auto add = [&](Vec3d centre) {
    box.add(centre - Vec3d{reach, reach, reach});
    box.add(centre + Vec3d{reach, reach, reach});
  };
  add(dab.contact);
  if (info(brush.tool).action == Action::Cut) {
    const Vec3d to_centre = dab.normal * (radius + brush.resilience);
    add(dab.cursor + to_centre);
    if (dab.swept) add(dab.from);
  }
  return box;
}

/// Returns the slabs in which two models differ.
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

/// Returns a layer that comes or goes may change how all of the surface looks.
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
        history(first.head, strokes, position, has_file),
        editor(first.head),
        engine(editor),
        channel(first.head),
        published(first.head),
        saver(first.info, std::move(place), std::move(file), settings.retry_after,
              [this](Saver::Notice notice) { tell(std::move(notice)); }),
        worker([this](CageWorker::Done done) { tell(std::move(done)); },
               [this](std::string_view phase, double share) { tell(Saver::Progressed{std::string(phase), share}); }) {
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
    if (const auto* command = std::get_if<Command>(&order)) {
      if (const auto* cancel = std::get_if<CancelStroke>(command)) cancel_open(*cancel);
      if (std::holds_alternative<CancelChanges>(*command)) stop_change.store(true);
    }
    orders.push_back(std::move(order));
    wake.notify_one();
    return true;
  }

  /// Returns whether an order ends the stroke that a source has open.
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

  void tell(CageWorker::Done done) {
    const std::scoped_lock lock(mutex);
    cages.push_back(std::move(done));
    wake.notify_one();
  }

  Status close() {
    if (!thread.joinable()) return closed;
    {
      const std::scoped_lock lock(mutex);
      closing = true;
      stop_change.store(true);
      wake.notify_one();
    }
    thread.join();
    return closed;
  }

  // ---- The edit thread

  void run() {
    std::unique_lock lock(mutex);
    while (true) {
      wake.wait(lock, [&] { return !orders.empty() || !notices.empty() || !cages.empty() || closing; });
      if (!notices.empty()) {
        lock.unlock();
        while (take_notice()) {
        }
        lock.lock();
        continue;
      }
      if (!cages.empty() && !closing) {
        lock.unlock();
        take_cages();
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
    drop_changes();
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
  /// Of work on the edit thread, which ends when the flag is set.
  [[nodiscard]] Progress progress_until(const std::atomic<bool>& cancel) const {
    return {.report = [this](std::string_view phase, double share) { emit(Progressed{std::string(phase), share}); },
            .cancel = &cancel};
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
    bool said_limit = false, said_miss = false, said_coarse = false;
    RoomWanted wanted;                      ///< by what it has done so far
    int rooms = 0;                          ///< how often room was made
    bool ends = false;                      ///< room is made at its end
    bool is_full = false;                   ///< no more room can be made
    std::uint64_t room_asked = 0;           ///< number of the job that makes room for it; 0: none
    double overhang = 0;                    ///< the widest of the rooms
    Vec3d overhang_at;                      ///< where that is
    std::map<SlabId, SampledAnew> sampled;  ///< after all rooms
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
      take_cages();
      if (count > 100 && k % (count / 100) == 0)
        emit(Progressed{"stroke", static_cast<double>(k) / static_cast<double>(count)});
    }
    publish();
    open->cpu += thread_cpu_ns() - start;
  }

  /// Each dab, just after it was made.
  void made(const Dab& dab, const DabResult& result) {
    say(DabMade{dab});
    want_room(dab, result);
    if (replaying) return;
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
    tell_shortcomings(so_far, so_far.limited > 0 && !may_make_room());
  }
  /// What a stroke could not do, each once; what matters most comes last.
  void tell_shortcomings(const StrokeResult& result, bool clay_ends) {
    if (result.detail_limited && !std::exchange(open->said_coarse, true))
      emit(DetailLimited{open->source, result.detail_limited_at});
    if (result.missed > 0 && !std::exchange(open->said_miss, true)) emit(PointMissed{open->source, result.missed_at});
    if (clay_ends && !std::exchange(open->said_limit, true)) emit(LimitReached{open->source, result});
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
    SnapshotPtr base = open->start;
    open->ends = true;
    if (open->rooms > 0) begin_again();
    StrokeResult result = engine.end();
    // What was taken beside the tool, too, other fibres may keep.
    while ((result.limited > 0 || result.beside) && make_room_at_end(base, result.limited > 0)) result = engine.end();
    set_open(kNobody);
    if (stop.load()) {
      cancel_ended_stroke();
      return;
    }
    if (!result.changed && open->rooms > 0) editor.set_head(open->start);
    after_end(result);
    StrokeFinished finished = finish(result, start);
    say(StrokeEnded{.kept = true, .changed = result.changed});
    publish();
    if (result.changed) keep(finished);
    finished.stroke = history.position();
    if (open->room_asked != 0) worker.cancel(open->room_asked);
    open.reset();
    emit(finished);
    if (result.changed) tell_history();
    take_ready_change();
  }

  /// What the last dab brought.
  void after_end(const StrokeResult& result) {
    if (result.beside) emit(TakenBeside{open->source, result.beside_at});
    tell_shortcomings(result, result.limited > 0);
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
            .overhang = open->overhang,
            .overhang_at = open->overhang_at,
            .folded = folded_in(std::views::values(open->sampled)),
            .seconds = static_cast<double>(open->cpu + thread_cpu_ns() - start) * 1e-9};
  }

  void cancel_stroke() {
    set_open(kNobody);
    engine.cancel();
    cancel_ended_stroke();
  }

  void cancel_ended_stroke() {
    const std::uint64_t start = thread_cpu_ns();
    if (open->room_asked != 0) worker.cancel(open->room_asked);
    editor.set_head(open->start);
    StrokeFinished finished = finish({}, start);
    finished.cancelled = true;
    finished.stroke = history.position();
    say(StrokeEnded{.kept = false, .changed = false});
    publish();
    open.reset();
    stop.store(false);
    emit(finished);
    take_ready_change();
  }

  // ---- Room under a stroke

  /// Notes what a dab needs, and has room made where it ran out. With dabs that come again nobody is asked: who plays
  /// them again looks at the end.
  void want_room(const Dab& dab, const DabResult& result) {
    if (!settings.make_room) return;
    const Brush& brush = open->stroke.brush;
    const ToolInfo& tool = relief::info(brush.tool);
    if (tool.writes != Layer::Displacement) return;
    const double radius = brush.radius * dab.size;
    if (tool.action == Action::Cut) {
      const Vec3d centre = dab.cursor + dab.normal * (radius + brush.resilience);
      add_solid(open->wanted.cut, {dab.swept ? dab.from : centre, centre, radius, normalized(dab.normal)});
    } else if (result.limited > 0) {
      // How much more will come nobody knows: as much again as the tool is wide.
      const Vec3d up = normalized(dab.normal), way = up * (2 * radius);
      const bool sinks = tool.by_height && brush.height < 0;
      if (!sinks) add_solid(open->wanted.fill, {dab.contact, dab.contact + way, radius, up});
      if (sinks || tool.action == Action::Even || (tool.action == Action::Plane && tool.lowers))
        add_solid(open->wanted.cut, {dab.contact, dab.contact - way / 2, radius / 2, up});
    }
    if (result.limited == 0) return;
    if (replaying || open->ends || open->room_asked != 0 || !may_make_room()) return;
    open->room_asked = worker.ask([make = settings.make_room, start = editor.start(), wanted = open->wanted](
                                      const Progress& progress) { return make(start, wanted, progress); });
    say(RoomNeeded{open->wanted});
    emit(RoomAsked{open->source});
  }

  [[nodiscard]] bool may_make_room() const {
    return settings.make_room && !open->is_full && open->rooms < kMostRooms && !open->wanted.empty();
  }

  /// The stroke from its beginning, on other fibres, up to where it is.
  void play_again(const SnapshotPtr& base) {
    say(StrokeAgain{.on_room = base != open->start});
    replaying = true;
    editor.set_head(base);
    engine.begin(open->stroke.brush, open->stroke.tip, base == open->start ? nullptr : open->start);
    open->wanted.cut.clear();  // they come again; fills do not, where there is room now
    const std::span<const StrokePoint> points = open->stroke.points;
    const std::size_t hundredth = points.size() / 100, part = open->ends ? hundredth + 1 : points.size();
    for (std::size_t k = 0; k < points.size(); k += part) {
      engine.move(points.subspan(k, std::min(part, points.size() - k)));
      if (open->ends && hundredth > 0)
        emit(Progressed{"stroke", static_cast<double>(k) / static_cast<double>(points.size())});
    }
    replaying = false;
    open->box = {};
  }

  /// What was made while the stroke went on depends on when it was done. At the end it is forgotten, so that the same
  /// points lead to the same model.
  void begin_again() {
    engine.cancel();
    open->rooms = 0;
    open->is_full = false;
    open->overhang = 0;
    open->overhang_at = {};
    open->sampled.clear();
    open->wanted = {};
    set_open(open->source);
    play_again(open->start);
  }

  /// Takes what was made; true where the stroke is to be played again on it.
  bool take_room(const Result<Room>& made) {
    open->room_asked = 0;
    if (!made) {
      open->is_full = true;
      if (made.error().code != Errc::Cancelled) emit(Failed{made.error(), saver.unsaved()});
      return false;
    }
    ++open->rooms;
    open->is_full = !made->model;
    if (made->overhang > open->overhang) {
      open->overhang = made->overhang;
      open->overhang_at = made->overhang_at;
    }
    if (made->model) note_sampled(*made);
    emit(RoomEnded{open->source, made->fibres, made->lacking, made->surface_moved, made->bar, made->bar_distance,
                   made->bar_at, made->overhang, made->overhang_at, folded_in(made->sampled)});
    return made->model != nullptr;
  }

  /// Keeps what of the slabs was taken anew, by their numbers in the last cage; halves of a root have samples of their
  /// own.
  void note_sampled(const Room& made) {
    if (made.halved.added > 0)
      for (const auto& [slab, sampled] : std::exchange(open->sampled, {}))
        if (const SlabId now = made.halved.now(slab); now != kNoSlab) open->sampled[now] = sampled;
    for (SampledAnew slab : made.sampled) {
      SampledAnew& last = open->sampled[slab.slab];
      slab.come_after(last);
      last = slab;
    }
  }

  /// Returns the ended stroke ran out on `base`: makes room and plays it again, all but its end. False where that is no
  /// use.
  bool make_room_at_end(SnapshotPtr& base, bool runs_out) {
    if (!may_make_room() || stop.load()) return false;
    if (open->room_asked != 0) worker.cancel(open->room_asked);
    if (open->rooms == 0 && open->room_asked == 0) emit(RoomAsked{open->source, runs_out});
    set_open(open->source);
    say(RoomNeeded{.wanted = open->wanted, .ended = true});
    const Result<Room> made = settings.make_room(base, open->wanted, progress_until(stop));
    const bool again = take_room(made);
    if (again) {
      base = made->model;
      play_again(base);
    }
    return again;
  }

  /// Cages that were made meanwhile.
  void take_cages() {
    while (true) {
      std::optional<CageWorker::Done> done;
      {
        const std::scoped_lock lock(mutex);
        if (cages.empty()) return;
        done = std::move(cages.front());
        cages.pop_front();
      }
      if (changing && done->number == changing->number) {
        take_change(done->result);
      } else if (open.has_value() && done->number == open->room_asked && take_room(done->result)) {
        const std::uint64_t start = dab_began = thread_cpu_ns();
        engine.cancel();
        play_again(done->result->model);
        publish();
        open->cpu += thread_cpu_ns() - start;
      }
    }
  }

  // ---- Other changes of the cage

  struct Change {
    ChangeCage command;
    SnapshotPtr from;
    std::uint64_t number = 0;  ///< of the worker's job
    int times = 0;
    std::optional<Result<Room>> ready;  ///< waits for the end of the open stroke
  };
  std::deque<ChangeCage> changes;  ///< that wait for the one before
  std::optional<Change> changing;

  void take(ChangeCage& change) {
    changes.push_back(std::move(change));
    start_change();
  }
  void take(const CancelChanges&) {
    stop_change.store(false);
    drop_changes();
  }

  /// The one that is worked on ends when its worker tells so.
  void drop_changes() {
    for (const ChangeCage& change : std::exchange(changes, {}))
      emit(CageChanged{.label = change.label, .cancelled = true, .stroke = history.position()});
    if (changing) worker.cancel(changing->number);
  }

  void start_change() {
    if (changing || changes.empty()) return;
    changing.emplace();
    changing->command = std::move(changes.front());
    changes.pop_front();
    ask_for_change();
  }

  [[nodiscard]] static Status watched() {
    return fail(Errc::InvalidArgument,
                "fibres and grids cannot change while a recording is being made; end the recording first");
  }

  /// For the state that the history is at.
  [[nodiscard]] ChangeCage::AsMade as_made() {
    return [this, held = history.held_as_made(),
            number = history.last_saved()](const Progress& progress) -> Result<SnapshotPtr> {
      if (held || !number) return held;
      return saver.read_as_made(*number, progress.cancel);
    };
  }

  void ask_for_change() {
    if (note) {
      end_change(watched());
      return;
    }
    changing->from = history.at(history.position()).snapshot;
    ++changing->times;
    changing->number = worker.ask([make = changing->command.make, from = changing->from,
                                   first = as_made()](const Progress& progress) -> Result<Room> {
      auto made = make(from, first, progress);
      if (!made) return std::unexpected(made.error());
      return Room{.model = made->model, .surface_moved = made->surface_moved};
    });
  }

  void take_ready_change() {
    if (!changing || !changing->ready) return;
    const Result<Room> made = *std::exchange(changing->ready, std::nullopt);
    take_change(made);
  }

  void take_change(const Result<Room>& made) {
    // What it read may belong to a state that is gone.
    const bool is_of_head = editor.head() == changing->from;
    if (!made && (is_of_head || made.error().code == Errc::Cancelled)) {
      end_change(std::unexpected(made.error()));
    } else if (note) {
      end_change(watched());
    } else if (open.has_value()) {
      changing->ready = made;  // the stroke would lose its start
    } else if (made && (is_of_head || !made->model)) {
      finish_change(made->model, made->surface_moved);
    } else if (changing->times < 2) {
      ask_for_change();
    } else {
      change_now();
    }
  }

  /// Whoever sculpts all the time waits for it.
  void change_now() {
    const auto made = changing->command.make(editor.head(), as_made(), progress_until(stop_change));
    if (!made) {
      end_change(std::unexpected(made.error()));
      return;
    }
    finish_change(made->model, made->surface_moved);
  }

  void finish_change(const SnapshotPtr& model, double surface_moved) {
    if (model) push_change(model);
    end_change({}, model != nullptr, surface_moved);
  }

  void push_change(const SnapshotPtr& model) {
    const ChangeCage& command = changing->command;
    const bool new_slabs = !has_slabs_of(model->slab_mesh(), editor.head()->slab_mesh());
    editor.set_head(model);
    const std::size_t number = history.push(model, command.label, command.details, new_slabs);
    {
      const std::scoped_lock lock(counted_mutex);
      labels.resize(number - 1 - history.first());
      labels.push_back(command.label);
    }
    if (has_file) saver.commit(history.at(number).serial, model, {.label = command.label, .details = command.details});
    publish();
    fit();
    tell_history();
  }

  void end_change(const Status& status, bool changed = false, double surface_moved = 0) {
    CageChanged ended{.label = changing->command.label,
                      .changed = changed,
                      .stroke = history.position(),
                      .surface_moved = changed ? surface_moved : 0};
    changing.reset();
    ended.cancelled = !status && status.error().code == Errc::Cancelled;
    ended.failed = !status && !ended.cancelled;
    if (ended.failed) emit(Failed{status.error(), saver.unsaved()});
    emit(ended);
    start_change();
  }

  /// The stroke that has ended becomes a step of the history.
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

  /// Of the history; from the file where memory has it no more.
  [[nodiscard]] Result<SnapshotPtr> state_at(std::size_t number) {
    if (const SnapshotPtr& held = history.at(number).snapshot) return held;
    const auto [near_number, near] = history.nearest_saved(number);
    return saver.read(number, near_number, near);
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
    const Result<SnapshotPtr> found = state_at(number);
    if (!found) {
      emit(Failed{found.error(), saver.unsaved()});
      return;
    }
    SnapshotPtr state = *found;
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
    const FirstState first = history.at(low).new_slabs ? FirstState::AsMade : FirstState::Sculpted;
    saver.elsewhere(save.file, save.cancel, low, history.position(), std::move(kept), first);
    has_file = true;
  }

  /// Returns whether the file will have state `number`, if it must be made of what is in memory.
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
    emit(Failed{std::move(failed.error), failed.unsaved, true});
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
  /// Holds what went into the last SaveElsewhere: numbers, the serial number of `high`, and the newest that there was.
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
  bool replaying = false;       ///< dabs come that have come before
  SnapshotChannel channel;

  mutable std::mutex mutex;
  std::condition_variable wake;
  std::deque<Order> orders;
  std::deque<Saver::Notice> notices;
  std::deque<CageWorker::Done> cages;
  bool closing = false;
  SnapshotPtr published;  ///< written under the lock by the edit thread

  std::int64_t open_source = kNobody;    ///< of the open stroke, as long as a cancel can reach it; under the lock
  std::atomic<bool> stop{false};         ///< the open stroke is cancelled
  std::atomic<bool> stop_change{false};  ///< what change_now() makes is cancelled

  mutable std::mutex counted_mutex;
  DocumentStatistics counted;
  std::vector<std::string> labels;

  Status closed;
  Saver saver;
  CageWorker worker;
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
