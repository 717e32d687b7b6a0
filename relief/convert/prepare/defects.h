// What stands in the way of slabs on a closed source: found as a list of places, each of one kind.
#pragma once

#include <relief/base/progress.h>
#include <relief/convert/geometry/lattice.h>
#include <relief/convert/prepare/closed_source.h>
#include <relief/convert/prepare/source_editor.h>
#include <relief/convert/shell/initial_shell.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace relief::detail {

/// The gravest come first.
enum class DefectKind : std::uint8_t {
  HighValence,        ///< a vertex with too many triangles around it to compare each with each
  SingularVertex,     ///< no direction sees all faces of a vertex, or hardly one does
  SelfIntersection,   ///< a face that was scanned meets another that was, without a common corner
  PatchIntersection,  ///< the same where one of them closes an opening or a cut
  TooNear,            ///< a face lies nearer to others than the lattice can tell apart, or folds back on its neighbours
  Fold                ///< another face folds in the slab on this one, however thin it is
};

/// One place where slabs cannot stand.
struct Defect {
  DefectKind kind;
  std::uint32_t at;         ///< HighValence, SingularVertex: a point of the editor's source, else a face
  LatticePoint place;       ///< the point, or the face's first corner
  std::uint32_t component;  ///< see SourceEditor::component_of()
};

/// Some defects of one kind, told as a whole.
struct Obstacle {
  DefectKind kind;
  LatticePoint place;           ///< of the first
  std::uint32_t component = 0;  ///< of the first
  std::size_t count = 0;        ///< vertices or faces; of HighValence, the faces around the one vertex
};

/// Returns the vertices that smoothing left singular.
[[nodiscard]] std::vector<Defect> singular_vertices(SourceEditor& editor, std::span<const std::uint32_t> points);
/// Returns the faces on which no initial shell stands, and those that fold where `with_folds` says so. O(log n) for
/// each.
[[nodiscard]] std::vector<Defect> shell_defects(SourceEditor& editor, const InitialShell& shell, bool with_folds);

/// Returns the faces that have them, and those around the vertices that do; ascending.
[[nodiscard]] std::vector<std::uint32_t> faces_of(const SourceEditor& editor, std::span<const Defect> defects);

/// Returns the gravest kind among some defects; at least one.
[[nodiscard]] Obstacle gravest(std::span<const Defect> defects);
/// Returns the same of each component that has some, by its number.
[[nodiscard]] std::vector<Obstacle> gravest_by_component(std::vector<Defect> defects);

/// Pairs of faces that meet, of which at least one is a patch and which have no corner in common. O(n log n + pairs).
/// When cancelled, those found so far.
[[nodiscard]] std::size_t count_patch_intersections(const ClosedSource& source, const Progress& progress);

}  // namespace relief::detail
