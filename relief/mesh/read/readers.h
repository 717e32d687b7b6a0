// One reader per format; import.cpp chooses among them.
#pragma once

#include <relief/mesh/read/source.h>

namespace relief::detail {

[[nodiscard]] Result<TriangleMesh> read_ply(const Source& source);
[[nodiscard]] Result<TriangleMesh> read_obj(const Source& source);
[[nodiscard]] Result<TriangleMesh> read_stl_text(const Source& source);
[[nodiscard]] Result<TriangleMesh> read_stl_binary(const Source& source);
[[nodiscard]] Result<TriangleMesh> read_off(const Source& source);
/// glTF (JSON with buffers inside or in files beside it) and GLB.
[[nodiscard]] Result<TriangleMesh> read_gltf(const Source& source);
/// Returns a file of the Draco library (.drc).
[[nodiscard]] Result<TriangleMesh> read_draco(const Source& source);
[[nodiscard]] Result<TriangleMesh> read_3mf(const Source& source);

}  // namespace relief::detail
