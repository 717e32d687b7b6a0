// The .relief file: an SQLite database with the cage, the tiles and the journal of strokes, one transaction per stroke.
#pragma once

#include <relief/base/error.h>
#include <relief/base/progress.h>
#include <relief/core/model.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace relief {

inline constexpr int kFormatVersion = 4;

/// One finished stroke as the journal keeps it.
struct StrokeRecord {
  std::uint64_t number = 0;  ///< 1 for the first
  std::string label{};       ///< what people read
  std::string details{};     ///< JSON of the stroke, for replay; may be empty
  std::uint64_t tiles = 0;   ///< changed by it
  bool damaged = false;      ///< its record fails its checksum: label and details are lost
};

/// Names strokes `first` to `last`, whose states cannot be read; 0 is the model before its first stroke.
struct DamagedStrokes {
  /// numbers of strokes, both included
  std::uint64_t first = 0, last = 0;
  friend bool operator==(const DamagedStrokes&, const DamagedStrokes&) = default;
};
/// "strokes 3 to 7".
[[nodiscard]] std::string name_of(const DamagedStrokes& strokes);
/// "strokes 3 to 7 are damaged".
[[nodiscard]] std::string to_string(const DamagedStrokes& strokes);

/// Tells what ModelFile::salvage() saved and what is lost.
struct Salvaged {
  std::uint64_t first = 0;          ///< the stroke whose state is now the model before its first stroke
  std::uint64_t current = 0;        ///< the stroke, by its old number, that is in effect now
  std::uint64_t last = 0;           ///< the last that can be redone, by its old number
  std::vector<std::string> lost{};  ///< each a clause, such as "strokes 3 to 7 (damaged)"; empty where nothing is
};

/// Says what the first state of a new file is, the model before its first stroke.
enum class FirstState : std::uint8_t {
  AsMade,    ///< its slabs are new: the surface lies where conversion has put it
  Sculpted,  ///< strokes have changed it that the file does not have
};

/// An open model file. One thread at a time. While it is open for writing, others can read it; a second writer, in this
/// process or another, gets Io ("in use") after two seconds. Whatever happens to the process, the file is a whole model
/// at the last committed stroke. All errors name the file. What takes a Progress can be cancelled: then nothing has
/// changed, and no output is left.
class ModelFile {
 public:
  /// Makes a new file, as a whole and at once (written beside and renamed); an existing file, and whatever a killed run
  /// left beside it, is replaced. Errors: Io (also when the old file is in use), InvalidArgument (samples out of range
  /// or torn at an edge), Cancelled.
  [[nodiscard]] static Result<ModelFile> create(const std::filesystem::path& file, const Model& model,
                                                const Progress& progress = {}, FirstState first = FirstState::AsMade);
  /// Opens and checks everything it reads: format version, sizes against the file, numbers, C0 of the cage, shared
  /// and constrained samples and ranges; whether its slabs are sound is asked with doubt(). Rows that only other
  /// strokes need may be damaged: see damage(). Errors: NotFound, Io, Corrupt (the sentence names the remedy,
  /// salvage()), NewerVersion, UnsupportedFormat (not a .relief file), Cancelled.
  [[nodiscard]] static Result<ModelFile> open(const std::filesystem::path& file, bool read_only = false,
                                              const Progress& progress = {});
  /// Copies a model file with its whole history to another place, as a whole and at once.
  [[nodiscard]] static Status copy(const std::filesystem::path& from, const std::filesystem::path& to,
                                   const Progress& progress = {});

  /// Writes what is whole of a damaged model to another place, as a whole and at once: the current state, or the
  /// newest whole one before it, and the strokes around it that follow each other without a gap. Errors: Corrupt
  /// (nothing is whole), InvalidArgument (`to` is `from`), NotFound, Io, UnsupportedFormat, NewerVersion, Cancelled.
  [[nodiscard]] static Result<Salvaged> salvage(const std::filesystem::path& from, const std::filesystem::path& to,
                                                const Progress& progress = {});

  /// Takes over; the other one may only be destroyed or assigned to.
  ModelFile(ModelFile&&) noexcept;
  /// Takes over; the other one may only be destroyed or assigned to.
  ModelFile& operator=(ModelFile&&) noexcept;
  ~ModelFile();

  /// Returns the model at the current stroke.
  [[nodiscard]] const Model& model() const noexcept;
  /// Has the verifier look at the slabs: one sentence where they do not hold what was proven of them when the file was
  /// made, or what certified and tolerant mode claim; else empty. The model is none the less as it was saved. Some 3
  /// microseconds per slab, far more where many lie across each other. Cancelled: what it says means nothing.
  [[nodiscard]] std::string doubt(const Progress& progress = {}) const;
  /// Finished strokes up to the current one; undone ones follow in redo_count().
  [[nodiscard]] std::uint64_t stroke_count() const noexcept;
  /// Strokes that redo() can bring back.
  [[nodiscard]] std::uint64_t redo_count() const noexcept;
  /// Returns all of them in order, those that were undone at the end.
  [[nodiscard]] Result<std::vector<StrokeRecord>> strokes() const;
  /// Returns the strokes whose states cannot be read, in order. Reads every row of the file. Errors: Io, Cancelled.
  [[nodiscard]] Result<std::vector<DamagedStrokes>> damage(const Progress& progress = {}) const;

  /// Returns the model at a stroke, undone ones included; the current one stays. `near` is the model at `near_stroke`,
  /// whose equal tiles are shared. Cost: the pages that strokes between the two changed, at most 65 rows each; where a
  /// layer came or went or the cage changed between them, what the strokes from there to here wrote, and if it lies
  /// before, the whole model. Errors: NotFound, Corrupt (see damage()), Io (another program
  /// has written since), Cancelled.
  [[nodiscard]] Result<SnapshotPtr> at(std::uint64_t stroke, const SnapshotPtr& near, std::uint64_t near_stroke,
                                       const Progress& progress = {}) const;
  /// Returns the same, near model().
  [[nodiscard]] Result<SnapshotPtr> at(std::uint64_t stroke, const Progress& progress = {}) const;
  /// Returns the model as it was when the slabs that it has at a stroke were new, before any tool had worked on them:
  /// the first state, or that of the stroke which made them. Null where the file does not have it, or has it damaged.
  /// Errors: NotFound, Io, Cancelled.
  [[nodiscard]] Result<SnapshotPtr> as_made(std::uint64_t stroke, const Progress& progress = {}) const;
  /// Returns what the first state is. Files of older programs say AsMade.
  [[nodiscard]] FirstState first_state() const noexcept;

  /// Writes that in which `head` differs from model(), as one transaction: tiles, cuts, grids, fibres that moved, or
  /// all of another cage. What follows from before by with_detail() takes next to no room. Strokes that had been undone
  /// are dropped. A file of an older format becomes one of the newest with the first stroke that changes its cage. On
  /// return the stroke is on disk. Errors: Io (disk full, read-only), InvalidArgument (samples out of range or torn at
  /// an edge), Cancelled; then nothing has changed.
  [[nodiscard]] Status commit(SnapshotPtr head, const StrokeRecord& stroke, const Progress& progress = {});
  /// Moves the current stroke back or forth, as one transaction. Returns how many strokes it moved, fewer at the end.
  /// Errors: Corrupt (the stroke it should come to is damaged; the sentence says how far it can go), Io, Cancelled.
  [[nodiscard]] Result<std::uint64_t> undo(std::uint64_t strokes = 1, const Progress& progress = {});
  /// Brings undone strokes back; says how many. Errors: Io, Cancelled, InvalidArgument where there are fewer.
  [[nodiscard]] Result<std::uint64_t> redo(std::uint64_t strokes = 1, const Progress& progress = {});
  /// Moves the current stroke to one whose model the caller holds, as at() or commit() had it: only the place is
  /// written, no page is read, so damage there shows at the next open(). Errors: NotFound (no such stroke), Corrupt (it
  /// lacks rows), InvalidArgument (`state` has other layers), Io.
  [[nodiscard]] Status go_to(std::uint64_t stroke, SnapshotPtr state);

 private:
  struct State;
  struct Rescued;
  explicit ModelFile(std::unique_ptr<State> state) noexcept;
  /// Returns a new model in an empty file that nobody else sees yet: nothing of it is sure to be on disk.
  [[nodiscard]] static Result<ModelFile> make_unsaved(const std::filesystem::path& place,
                                                      const std::filesystem::path& named, const Model& model,
                                                      FirstState first, const Progress& progress);
  std::unique_ptr<State> state_;
};

}  // namespace relief
