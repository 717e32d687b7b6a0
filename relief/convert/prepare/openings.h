// The openings of a source, and with what each of them is closed.
#pragma once

#include <relief/base/progress.h>
#include <relief/convert/geometry/lattice.h>
#include <relief/convert/prepare/hole_filling.h>
#include <relief/convert/prepare/source_editor.h>
#include <relief/mesh/triangle_mesh.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace relief::detail {

/// A source whose openings are closed with fill triangles, on the lattice; these come last.
struct ClosedOpenings {
  ClosedSource source;
  std::vector<std::size_t> patches;  ///< where the faces of each opening begin, and their end
  Lattice lattice;
};

/// Returns how many openings have some of these faces, numbers in the source with its openings closed. `patches`: as in
/// ClosedOpenings.
[[nodiscard]] std::size_t count_openings(const std::vector<std::size_t>& patches, std::span<const std::uint32_t> faces);

/// The boundary loops of an oriented manifold, and how each is closed. Patches come first. A box closes a loop whose
/// patch would be about as large as the surface and close behind it, as with a height field. The mesh is given to each
/// function: it may be paged out in between.
class Openings {
 public:
  explicit Openings(const TriangleMesh& mesh);

  [[nodiscard]] std::size_t count() const noexcept { return loops_.size(); }
  [[nodiscard]] const std::vector<Closing>& closings() const noexcept { return closings_; }

  /// `room`: how far slabs may reach beyond the surface, model units.
  [[nodiscard]] ClosedOpenings close(const TriangleMesh& mesh, double room) const;

  /// Closes openings differently where the faces that close() made are bad. A patch becomes a box the first time, and a
  /// box an offset copy where that intersects no more faces. Returns false when nothing else helps, or when cancelled.
  bool change(const TriangleMesh& mesh, const std::vector<std::size_t>& patches,
              std::span<const std::uint32_t> bad_faces, double room, const Progress& progress);

 private:
  bool try_boxes(const TriangleMesh& mesh, std::span<const std::size_t> bad, double room, const Progress& progress);
  bool try_offset_copies(const TriangleMesh& mesh, std::span<const std::size_t> bad, double room,
                         const Progress& progress);

  std::vector<std::vector<std::uint32_t>> loops_;
  std::vector<Closing> closings_;  // by loop
  bool boxes_tried_ = false;
};

}  // namespace relief::detail
