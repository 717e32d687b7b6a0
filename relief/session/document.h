// The one live model of a program: takes commands, publishes snapshots, keeps the history, saves.
#pragma once

#include <relief/core/model.h>
#include <relief/core/room.h>
#include <relief/core/snapshot_channel.h>
#include <relief/edit/stroke.h>
#include <relief/file/model_file.h>
#include <relief/haptics/servo_thread.h>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace relief {

// ---- Commands

/// Who makes a stroke: the mouse, the hand at a device, a file. While one has a stroke open, the strokes of others are
/// refused whole (StrokeRefused), so that two never mix.
using StrokeSource = std::uint32_t;

/// Ends the stroke that the same source has open.
struct BeginStroke {
  Brush brush;              ///< with what
  bool tip = false;         ///< see Stroke
  std::string label;        ///< what people read; the tool's name where it is empty
  StrokeSource source = 0;  ///< whose stroke it is
};
/// Points that are not finite or run back in time are left out, pressures are clamped.
struct MoveStroke {
  std::vector<StrokePoint> points;  ///< in the order of time
  StrokeSource source = 0;          ///< whose stroke it is
};
/// Ends a stroke and keeps it.
struct EndStroke {
  StrokeSource source = 0;  ///< whose stroke it is
};
/// Drops the stroke that the source has open, also where it is being worked on and its end waits: what is left of it is
/// not done.
struct CancelStroke {
  StrokeSource source = 0;  ///< whose stroke it is
};
/// Fewer at the end of the history. An open stroke is ended first, and is the first one that is undone.
struct Undo {
  std::uint64_t steps = 1;  ///< how many strokes
};
/// Brings undone strokes back.
struct Redo {
  std::uint64_t steps = 1;  ///< how many strokes
};
/// Goes on in another file, which is replaced: a copy of the file so far with its whole history. Without a file, or
/// where it cannot be read, a new one with what is in memory: the model and the steps that can be undone without it.
struct SaveElsewhere {
  std::filesystem::path file;  ///< the new file
  /// Set by any thread to end it before the new file stands: Failed says Cancelled, and what stood there stays. May be
  /// null.
  std::shared_ptr<const std::atomic<bool>> cancel{};
};
/// Another budget for the history, bytes.
struct SetHistoryBytes {
  std::size_t bytes = 0;  ///< of snapshots held for undo
};
/// Another cage for the model, or finer grids: `make` is called on a thread of the document's own with the newest
/// state, while tools go on. What it makes becomes a step of the history, if the model is still that one when it is
/// done; otherwise it is asked again, and the third time all wait for it.
struct ChangeCage {
  /// Gets the model as it was when its slabs were new, from the file perhaps; null where nobody has it any more.
  /// Called by `make`, on its thread. Errors: Io, Cancelled.
  using AsMade = std::function<Result<SnapshotPtr>(const Progress&)>;
  std::string label;    ///< what people read
  std::string details;  ///< of the journal, JSON; may be empty
  /// A changed model, and how far its surface lies from the one before at most.
  struct Made {
    SnapshotPtr model;         ///< null where there is nothing to change
    double surface_moved = 0;  ///< model units; 0 where only grids and fibres are others
    Made(SnapshotPtr changed, double moved = 0) : model(std::move(changed)), surface_moved(moved) {}
  };
  /// Makes the changed model. Called on the worker, or on the edit thread where strokes follow each other all the time.
  std::function<Result<Made>(const SnapshotPtr& model, const AsMade& as_made, const Progress&)> make;
};
/// Drops the changes of the cage that have not ended.
struct CancelChanges {};
using Command = std::variant<BeginStroke, MoveStroke, EndStroke, CancelStroke, Undo, Redo, SaveElsewhere,
                             SetHistoryBytes, ChangeCage, CancelChanges>;

// ---- Events

/// A snapshot was published. What differs from the one before lies in the box, model units.
struct SnapshotChanged {
  std::uint64_t number = 0;  ///< Snapshot::number()
  Box3d box;                 ///< what has changed, model units
};
/// A stroke is in the history.
struct StrokeFinished {
  StrokeSource source = 0;   ///< whose stroke it was
  Tool tool = Tool::Carve;   ///< its tool
  std::string label;         ///< what the history shows
  StrokeResult result;       ///< changed: it is a step of the history
  bool cancelled = false;    ///< it has left nothing
  std::uint64_t stroke = 0;  ///< strokes that stand now
  std::uint64_t tiles = 0;   ///< that it changed
  double overhang = 0;       ///< the widest of the rooms that were made for it, see Room
  Vec3d overhang_at = {};    ///< where that is
  std::size_t folded = 0;    ///< after all these rooms, see SampledAnew
  double seconds = 0;        ///< thread CPU time, with undo and publishing
};
/// A stroke was not begun, for another source had one open.
struct StrokeRefused {
  StrokeSource source = 0;  ///< whose stroke it was
};
/// Undo and redo have other steps.
struct HistoryChanged {
  /// how many there are
  std::uint64_t undo_steps = 0, redo_steps = 0;
  /// of the next ones; empty where there is none
  std::string undo_label, redo_label;
};
/// Old steps did not fit into the budget of a document without a file: they can no more be undone, or redone.
struct HistoryDropped {
  std::uint64_t steps = 0;  ///< the oldest ones, which went
};
/// Stroke `stroke` and all before it are on the disk.
struct Saved {
  std::uint64_t stroke = 0;  ///< the last stroke in the file
};
/// The document goes on in this file.
struct SavedElsewhere {
  std::filesystem::path file;  ///< the new file
  bool whole = true;           ///< with all of the history; else with what was in memory
};
/// The first time in a stroke that samples would have gone beyond their fibre's ends, and no room can be made.
struct LimitReached {
  StrokeSource source = 0;  ///< whose stroke it is
  StrokeResult so_far;      ///< what it did until now
};
/// The first time in a stroke that a point was farther from the surface than the radius, and left out.
struct PointMissed {
  StrokeSource source = 0;  ///< whose stroke it is
  Vec3d at = {};            ///< that point, to which the tool was on its way; model units
};
/// The first time in a stroke that the grid stays coarser than its tool wants: finer samples would exceed what a dab, a
/// stroke or a model may add, or kFinestDetail.
struct DetailLimited {
  StrokeSource source = 0;  ///< whose stroke it is
  Vec3d at = {};            ///< the surface there, model units
};
/// At the end of a stroke of Carve that took clay from beside the tool, see DabResult::beside. Until then the stroke
/// may get other fibres.
struct TakenBeside {
  StrokeSource source = 0;  ///< whose stroke it is
  Vec3d at = {};            ///< the surface under the first dab that did, model units
};
/// A stroke runs out of clay, or of the room above it, or took clay from beside the tool: from now on room is made
/// under it.
struct RoomAsked {
  StrokeSource source = 0;  ///< whose stroke it is
  bool runs_out = true;     ///< else it has all it wants, and other fibres may keep what lies beside the tool
};
/// Room was made under a stroke, which continues as if it had always been; or could not be made.
struct RoomEnded {
  StrokeSource source = 0;      ///< whose stroke it is
  std::size_t fibres = 0;       ///< that were moved; 0: none could be
  std::size_t lacking = 0;      ///< that do not reach as far as the stroke; none either, where nothing ran out
  double surface_moved = 0;     ///< the farthest, model units
  RoomBar bar = RoomBar::None;  ///< why those do not
  double bar_distance = 0;      ///< see Room; along the axis from bar_at, model units
  Vec3d bar_at = {};            ///< see Room; on the surface, model units
  double overhang = 0;          ///< see Room
  Vec3d overhang_at = {};       ///< see Room
  std::size_t folded = 0;       ///< of the new samples, see SampledAnew
};
/// A ChangeCage has ended.
struct CageChanged {
  std::string label;     ///< what was done
  bool changed = false;  ///< it is a step of the history
  /// Failed has said why
  bool cancelled = false, failed = false;
  std::uint64_t stroke = 0;  ///< steps that stand now
  double surface_moved = 0;  ///< the farthest, model units, as its maker says; 0 where nothing has changed
};
/// The world failed. Strokes that are not saved are tried again every `retry_after`, with the next one, and by close();
/// Saved tells that it went well.
struct Failed {
  Error error;                ///< what went wrong
  std::uint64_t unsaved = 0;  ///< strokes that are in memory only
  bool elsewhere = false;     ///< it answers a SaveElsewhere
};
/// Of a long command.
struct Progressed {
  std::string phase;  ///< what is done
  double share = 0;   ///< 0..1
};
using Event = std::variant<SnapshotChanged, StrokeFinished, StrokeRefused, HistoryChanged, HistoryDropped, Saved,
                           SavedElsewhere, LimitReached, PointMissed, DetailLimited, TakenBeside, RoomAsked, RoomEnded,
                           CageChanged, Failed, Progressed>;

// ---- What a recorder must know to make the same snapshots again, in order

/// A stroke has begun; for a recording.
struct StrokeBegun {
  Brush brush;  ///< with what
};
/// A dab was applied; for a recording.
struct DabMade {
  Dab dab;  ///< the dab
};
/// Room is made for the open stroke, for a recording: from where it began, with the detail that it has added so far.
struct RoomNeeded {
  RoomWanted wanted;   ///< as its maker gets it
  bool ended = false;  ///< it waits for that at its end: from what it began on last, without its detail
};
/// The open stroke begins again, and its dabs are told again; for a recording.
struct StrokeAgain {
  bool on_room = false;  ///< on the room that was told last; else on the model before it
};
/// A stroke has ended; for a recording.
struct StrokeEnded {
  bool kept = true;     ///< else it was cancelled
  bool changed = true;  ///< it is a step of the history
};
/// By this many steps of the history, back where negative.
struct HistoryMoved {
  std::int64_t steps = 0;  ///< above 0: redone, below 0: undone
};
/// Holds what the editor has after all that came before; told before any reader sees it.
struct HeadMade {
  SnapshotPtr head;  ///< the model now
};
using EditNote = std::variant<StrokeBegun, DabMade, RoomNeeded, StrokeAgain, StrokeEnded, HistoryMoved, HeadMade>;

/// Holds what a document has counted since it was opened.
struct DocumentStatistics {
  std::uint64_t strokes = 0;  ///< that changed the model
  std::uint64_t dabs = 0;     ///< dabs that were applied
  std::uint64_t samples = 0;  ///< changed by them
  std::uint64_t limited = 0;  ///< see DabResult
  std::uint64_t missed = 0;   ///< points that were left out
  TimeHistogram dab_time;     ///< thread CPU time of one dab, with finding its place, undo and publishing
  /// steps of the history
  std::uint64_t undo_steps = 0, redo_steps = 0;
  std::size_t history_bytes = 0;     ///< of tiles that only the history holds in memory
  std::size_t history_held = 0;      ///< states in memory, the head included
  std::uint64_t unsaved = 0;         ///< strokes that are in memory only
  std::size_t waiting_commands = 0;  ///< that were posted and not begun
};

/// Holds what a document can be told at its start.
struct DocumentSettings {
  /// Of tiles that only the history holds. The default holds some thousand strokes.
  std::size_t history_bytes = std::size_t{512} << 20U;
  /// Called by the edit thread, in the order in which things happen. It may post commands; strokes wait for it.
  std::function<void(const Event&)> on_event = {};
  /// Makes room where a stroke would run out of clay; without it such strokes fade out. Who repeats a recording must
  /// have the same one (see verify()).
  RoomMaker make_room = {};
  /// After which what could not be saved is tried again.
  std::chrono::milliseconds retry_after = std::chrono::seconds(10);
};

/// One model, one history, one writer. Commands are values that an edit thread of the document's own carries out in
/// their order; a saver thread writes finished strokes into the file, each with its text (stroke_text.h), and neither
/// the edit thread nor any reader waits for it, except for an undo into steps that only the file holds.
/// One history: steps stay in memory within a budget; of a document with a file older ones, and those that the file had
/// when it was opened, are read back from it when they are needed. A stroke after an undo ends the redo.
class Document {
 public:
  /// A document without a file; see SaveElsewhere.
  explicit Document(Model model, DocumentSettings settings = {});
  /// Goes on with a file; `place` is its name. Errors: those of ModelFile::strokes().
  [[nodiscard]] static Result<Document> open(std::filesystem::path place, ModelFile file,
                                             DocumentSettings settings = {});
  /// Takes over; the other one may only be destroyed.
  Document(Document&&) noexcept;
  Document& operator=(Document&&) = delete;
  /// close(). Readers must be gone.
  ~Document();

  /// Any thread but a servo's; takes a short lock. After close() nothing is done.
  void post(Command command);
  /// Returns when all that was posted before has been done, except for a ChangeCage; not when it is on the disk. Any
  /// thread but that of events.
  void settle();
  /// Ends an open stroke, does what was posted, drops a ChangeCage that has not ended, writes what is not in the file
  /// yet, and ends both threads. Error: why not all is in the file. One thread; again harmless.
  [[nodiscard]] Status close();

  /// Returns the newest published snapshot. Any thread but a servo's.
  [[nodiscard]] SnapshotPtr head() const;
  /// Returns where it is published: for a ServoThread, and for the readers of others.
  [[nodiscard]] SnapshotChannel& channel() noexcept;
  /// Returns a reader of the snapshots, for one thread.
  [[nodiscard]] SnapshotChannel::Reader reader();
  /// Returns what is known of the model beside its surface.
  [[nodiscard]] const ModelInfo& info() const noexcept;
  /// Any thread.
  [[nodiscard]] DocumentStatistics statistics() const;
  /// Labels of all strokes that can be undone, then of those that can be redone. Any thread.
  [[nodiscard]] std::vector<std::string> labels() const;

  /// From now on `note` is called by the edit thread with all that makes snapshots; empty: nobody any more. An open
  /// stroke is ended. Returns, with the head at that moment, when it holds. Any thread but that of events.
  SnapshotPtr watch(std::function<void(const EditNote&)> note);

 private:
  struct State;
  explicit Document(std::unique_ptr<State> state) noexcept;
  std::unique_ptr<State> state_;
};

}  // namespace relief
