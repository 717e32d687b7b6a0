// Triangle meshes into files that other programs read.
#pragma once

#include <relief/base/error.h>
#include <relief/base/progress.h>
#include <relief/base/unit.h>
#include <relief/mesh/triangle_mesh.h>

#include <filesystem>

namespace relief {

/// Writes PLY (binary, double coordinates only with `double_positions`, else float), OBJ, STL (binary), GLB or 3MF by
/// the extension of `file`. Colours go into every format that has them (PLY, OBJ as "v x y z r g b", GLB, 3MF). The
/// file appears whole and at once (written beside and renamed); an existing one is replaced. `progress` has the phase
/// "export". Errors: UnsupportedFormat, InvalidArgument (no triangle, or a corner that the format cannot hold), Io,
/// Cancelled; then the file is as it was.
struct ExportSettings {
  Unit unit =
      Unit::Millimetre;  ///< what one model unit is, for 3MF (unit attribute) and glTF (scaled to metres by a node)
  bool double_positions = false;  ///< PLY only
};
[[nodiscard]] Status export_mesh(const TriangleMesh& mesh, const std::filesystem::path& file,
                                 const ExportSettings& settings = {}, const Progress& progress = {});

}  // namespace relief
