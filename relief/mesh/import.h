// Triangle meshes from files that people have.
#pragma once

#include <relief/base/error.h>
#include <relief/base/progress.h>
#include <relief/mesh/triangle_mesh.h>

#include <filesystem>

namespace relief {

/// Reads PLY (ascii, both byte orders), OBJ, STL (ascii, binary), OFF, glTF, GLB, 3MF or Draco, inside gzip or not,
/// chosen by content first and extension second. Polygons are cut into triangles, transforms, skins and morph targets
/// of scenes are applied, positions keep the precision of the file. Colours of vertices and faces are kept, and PNG and
/// JPEG images inside the file or beside it; what a user would miss of the file is a note and no error. glTF and 3MF
/// give the unit; a 3MF in microns, inches or feet is scaled to millimetres. Nothing is welded, turned or dropped here
/// except points and lines; see repair(). Errors: NotFound, Io, Corrupt (damaged, or counts that the file cannot hold),
/// UnsupportedFormat, Cancelled; each message names the file and the place. Memory stays within a small multiple of the
/// file's size. `progress` has the phase "import". One image, the JSON of a glTF file, and the Draco data of one part
/// are each taken as a whole: cancelling waits for their end.
[[nodiscard]] Result<TriangleMesh> import_mesh(const std::filesystem::path& file, const Progress& progress = {});

}  // namespace relief
