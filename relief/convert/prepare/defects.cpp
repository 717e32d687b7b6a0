#include <relief/convert/geometry/box_tree.h>
#include <relief/convert/geometry/source_index.h>
#include <relief/convert/prepare/defects.h>
#include <relief/convert/support/sort_unique.h>

#include <algorithm>

namespace relief::detail {
namespace {

/// Why no slab can stand on a face. Of faces that meet in a corner it knows nothing.
DefectKind kind_of_fault(const SourceEditor& editor, const InitialShell& shell, std::uint32_t f) {
  const SourceIndex& source = editor.source();
  Box3d box;
  for (const LatticePoint p : source.corners(f)) box.add(to_double(p));
  DefectKind kind = DefectKind::TooNear;
  shell.tree().query(box, [&](std::uint32_t g) {
    if (!source.alive(g) || share_a_corner(source.faces[f], source.faces[g])) return true;
    if (!triangles_meet(source.corners(f), source.corners(g))) return true;
    const bool scanned = editor.is_scanned(f) && editor.is_scanned(g);
    kind = std::min(kind, scanned ? DefectKind::SelfIntersection : DefectKind::PatchIntersection);
    return !scanned;
  });
  return kind;
}

}  // namespace

std::vector<Defect> singular_vertices(SourceEditor& editor, std::span<const std::uint32_t> points) {
  std::vector<Defect> defects;
  for (const std::uint32_t v : points)
    defects.push_back(
        {DefectKind::SingularVertex, v, editor.source().points[v], editor.component_of(editor.rings().out[v] / 3)});
  return defects;
}

std::vector<Defect> shell_defects(SourceEditor& editor, const InitialShell& shell, bool with_folds) {
  std::vector<Defect> defects;
  const auto add = [&](DefectKind kind, std::uint32_t f) {
    const SourceIndex& source = editor.source();
    defects.push_back({kind, f, source.points[source.faces[f][0]], editor.component_of(f)});
  };
  for (const std::uint32_t f : shell.faults()) add(kind_of_fault(editor, shell, f), f);
  if (with_folds)
    for (const std::uint32_t f : shell.folds()) add(DefectKind::Fold, f);
  return defects;
}

std::vector<std::uint32_t> faces_of(const SourceEditor& editor, std::span<const Defect> defects) {
  std::vector<std::uint32_t> faces;
  for (const Defect& d : defects) {
    if (d.kind > DefectKind::SingularVertex) {
      faces.push_back(d.at);
    } else {
      editor.rings().around(d.at, [&](std::uint32_t h) { faces.push_back(h / 3); });
    }
  }
  sort_unique(faces);
  return faces;
}

Obstacle gravest(std::span<const Defect> defects) {
  Obstacle found{defects[0].kind, defects[0].place, defects[0].component, 0};
  for (const Defect& d : defects) {
    if (d.kind < found.kind) found = {d.kind, d.place, d.component, 0};
    found.count += d.kind == found.kind;
  }
  return found;
}

std::vector<Obstacle> gravest_by_component(std::vector<Defect> defects) {
  std::ranges::stable_sort(defects, {}, &Defect::component);
  std::vector<Obstacle> found;
  const std::span<const Defect> all = defects;
  for (std::size_t k = 0, next = 0; k < all.size(); k = next) {
    while (next < all.size() && all[next].component == all[k].component) ++next;
    found.push_back(gravest(all.subspan(k, next - k)));
  }
  return found;
}

std::size_t count_patch_intersections(const ClosedSource& given, const Progress& progress) {
  const SourceIndex source(given.points, given.faces);
  const auto box_of = [&](std::size_t f) {
    Box3d box;
    for (const LatticePoint p : source.corners(static_cast<std::uint32_t>(f))) box.add(to_double(p));
    return box;
  };
  const BoxTree tree(source.faces.size(), box_of);
  const auto is_patch = [&](std::uint32_t f) { return given.patch[source.face_of[f]] != 0; };
  std::size_t pairs = 0;
  for (std::uint32_t f = 0; f < source.faces.size(); ++f) {
    if (progress.cancelled()) break;
    if (!is_patch(f)) continue;
    tree.query(box_of(f), [&](std::uint32_t g) {
      const bool counted = is_patch(g) && g <= f;
      if (!counted && !share_a_corner(source.faces[f], source.faces[g]))
        pairs += triangles_meet(source.corners(f), source.corners(g));
      return true;
    });
  }
  return pairs;
}

}  // namespace relief::detail
