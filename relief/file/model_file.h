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

inline constexpr int kFormatVersion = 3;

/// One finished stroke as the journal keeps it.
struct StrokeRecord {
  std::uint64_t number = 0;  ///< 1 for the first
  std::string label{};       ///< what people read
  std::string details{};     ///< JSON of the stroke, for replay; may be empty
  std::uint64_t tiles = 0;   ///< changed by it
};

/// An open model file. One thread at a time. While it is open for writing, others can read it; a second writer, in this
/// process or another, gets Io ("in use") after two seconds. Whatever happens to the process, the file is a whole model
/// at the last committed stroke. All errors name the file.
class ModelFile {
 public:
  /// Makes a new file, as a whole and at once (written beside and renamed); an existing file, and whatever a killed run
  /// left beside it, is replaced. Errors: Io (also when the old file is in use), InvalidArgument (samples out of range
  /// or torn at an edge).
  [[nodiscard]] static Result<ModelFile> create(const std::filesystem::path& file, const Model& model);
  /// Opens and checks everything it reads: format version, sizes against the file, numbers, C0 of the cage, shared
  /// and constrained samples and ranges; whether its slabs are sound is asked with doubt(). Errors: NotFound, Io,
  /// Corrupt, NewerVersion, UnsupportedFormat (not a .relief file).
  [[nodiscard]] static Result<ModelFile> open(const std::filesystem::path& file, bool read_only = false);
  /// Copies a model file with its whole history to another place, as a whole and at once.
  [[nodiscard]] static Status copy(const std::filesystem::path& from, const std::filesystem::path& to);

  ModelFile(ModelFile&&) noexcept;
  ModelFile& operator=(ModelFile&&) noexcept;
  ~ModelFile();

  /// The model at the current stroke.
  [[nodiscard]] const Model& model() const noexcept;
  /// Has the verifier look at the slabs: one sentence where they do not hold what was proven of them when the file was
  /// made, or what certified and tolerant mode claim; else empty. The model is none the less as it was saved. Some 3
  /// microseconds per slab, far more where many lie across each other. Cancelled: what it says means nothing.
  [[nodiscard]] std::string doubt(const Progress& progress = {}) const;
  /// Finished strokes up to the current one; undone ones follow in redo_count().
  [[nodiscard]] std::uint64_t stroke_count() const noexcept;
  [[nodiscard]] std::uint64_t redo_count() const noexcept;
  /// All of them in order, those that were undone at the end.
  [[nodiscard]] Result<std::vector<StrokeRecord>> strokes() const;

  /// Writes the tiles in which `head` differs from model(), as one transaction; strokes that had been undone are
  /// dropped. On return the stroke is on disk. Errors: Io (disk full, read-only), InvalidArgument (another cage,
  /// samples out of range or torn at an edge); then nothing has changed.
  [[nodiscard]] Status commit(SnapshotPtr head, const StrokeRecord& stroke);
  /// Moves the current stroke back or forth, as one transaction. Returns how many strokes it moved, fewer at the end.
  [[nodiscard]] Result<std::uint64_t> undo(std::uint64_t strokes = 1);
  [[nodiscard]] Result<std::uint64_t> redo(std::uint64_t strokes = 1);

 private:
  struct State;
  explicit ModelFile(std::unique_ptr<State> state) noexcept;
  std::unique_ptr<State> state_;
};

}  // namespace relief
