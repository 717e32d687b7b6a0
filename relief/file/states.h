// The states of a model, from the rows of its file.
#pragma once

#include <relief/base/progress.h>
#include <relief/core/snapshot.h>
#include <relief/file/model_rows.h>

#include <cstdint>

namespace relief::detail {

/// The model after a stroke.
struct FileState {
  SnapshotPtr snapshot;
  LayerTable layers;
};

/// Reads the model at a stroke as a whole. Tiles, and the cage, that are the same in `near` (or null) are shared.
/// Errors: Corrupt, Cancelled, Io.
[[nodiscard]] Result<FileState> read_state(const Rows& rows, const Meta& meta, std::int64_t stroke,
                                           const Snapshot* near, const Progress& progress);
/// Returns the same from the model at another stroke; less work where they are near each other. Errors: Corrupt,
/// Cancelled, Io.
[[nodiscard]] Result<FileState> move_state(const Rows& rows, const Meta& meta, std::int64_t stroke,
                                           const FileState& near, std::int64_t near_stroke, const Progress& progress);
/// Returns whether a model has the cage, layers and grids that the file tells of a stroke. Errors: Corrupt, Io.
[[nodiscard]] Result<bool> has_shape_of(const Rows& rows, const Meta& meta, std::int64_t stroke, const Snapshot& model);

}  // namespace relief::detail
