#include <relief/base/free_memory.h>
#include <relief/convert/geometry/components.h>
#include <relief/convert/shell/patch.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <queue>
#include <utility>

namespace relief::detail {
namespace {

/// Returns where the line from `from` to `to` crosses a triangle, as a share of the way; rounded.
std::optional<double> crossing_of(Vec3d from, Vec3d to, const SourceTriangle& t) noexcept {
  const Vec3d d = to - from, e = t.b - t.a, g = t.c - t.a, s = from - t.a;
  const Vec3d n = cross(e, g), q = cross(d, s);
  const double det = -dot(n, d);
  if (det == 0) return std::nullopt;
  const double u = -dot(g, q) / det, v = dot(e, q) / det, share = dot(n, s) / det;
  if (u < 0 || v < 0 || u + v > 1 || share < 0 || share > 1) return std::nullopt;
  return share;
}

/// Returns the least share of the segment at which the source is crossed. The tree is asked piece by piece: boxes
/// around short pieces of a slanting segment hold little.
std::optional<double> first_crossing(Vec3d from, Vec3d to, const SourceIndex& source, const BoxTree& tree) {
  constexpr int kPieces = 16;
  const Vec3d along = to - from;
  for (int k = 0; k < kPieces; ++k) {
    Box3d box;
    box.add(from + along * (double(k) / kPieces));
    box.add(from + along * (double(k + 1) / kPieces));
    double first = 2;
    tree.query(box, [&](std::uint32_t t) {
      if (const auto share = crossing_of(from, to, source.triangle(t))) first = std::min(first, *share);
      return true;
    });
    if (first <= double(k + 1) / kPieces) return first;
  }
  return std::nullopt;
}

}  // namespace

ShellPatch::ShellPatch(const SourceIndex& source, const BoxTree& tree, double longest, ShellDraft&& draft,
                       const Box3d& room, const Progress& progress)
    : source_(source), longest_(longest), draft_(std::move(draft)), checks_(source, room) {
  for (std::uint32_t f = 0; f < draft_.faces.size(); ++f) {
    if (checks_.is_within(draft_.box(f))) {
      ++free_count_;
      continue;
    }
    for (const std::uint32_t v : draft_.faces[f]) draft_.fixed[v] = 1;
  }
  find_lists(tree, progress);
}

ShellPatch::ShellPatch(const SourceIndex& source, const BoxTree& tree, double longest, ShellDraft&& draft,
                       std::span<const std::uint8_t> fixed, const Progress& progress, const Box3d& room)
    : source_(source), longest_(longest), draft_(std::move(draft)), checks_(source, room) {
  for (std::uint32_t v = 0; v < draft_.fixed.size(); ++v)
    if (fixed[v] != 0) draft_.fixed[v] = 1;
  for (const Face& f : draft_.faces)
    free_count_ += draft_.is_free(f[0]) && draft_.is_free(f[1]) && draft_.is_free(f[2]);
  find_lists(tree, progress);
}

void ShellPatch::find_lists(const BoxTree& tree, const Progress& progress) {
  constexpr std::size_t kUsual = 24;  // references per slab, stale ones included; what is not used stays untouched
  draft_.lists.reserve_pool(kUsual * draft_.faces.size());
  std::vector<std::uint32_t> near;
  std::vector<TriangleReference> found;
  for (std::uint32_t f = 0; f < draft_.faces.size(); ++f) {
    if ((f & 255U) == 0 && progress.cancelled()) return;
    if (draft_.from[f] == kNone) continue;
    const Face& face = draft_.faces[f];
    if (!draft_.is_free(face[0]) && !draft_.is_free(face[1]) && !draft_.is_free(face[2])) continue;
    draft_.from[f] = kNone;
    const SlabShape shape(draft_.triangle(f, kInner), draft_.triangle(f, kOuter));
    near.clear();
    found.clear();
    tree.query(shape.box(), [&](std::uint32_t t) {
      near.push_back(t);
      return true;
    });
    source_.for_near(shape, near, [&](std::uint32_t t, bool is_section) {
      if (is_section || !shape.is_apart(source_.triangle(t))) found.push_back(TriangleReference::triangle(t));
    });
    draft_.lists.replace(f, found);
  }
  draft_.lists.reserve_pool();
  free_memory(draft_.from);
  checks_.build_boxes(draft_);
}

std::vector<ShellPatch::FibreFault> ShellPatch::check() {
  std::vector<FibreFault> faults;
  for (std::uint32_t v = 0; v < draft_.out.size(); ++v) {
    if (!draft_.can_move(v)) continue;
    checks_.begin().set_fibre(draft_, v);
    if (const Fault fault = checks_.check(draft_, draft_.ends[v]); fault != Fault::None) faults.push_back({v, fault});
  }
  return faults;
}

ShellPatch::Reach ShellPatch::reach(std::uint32_t v) const noexcept {
  return {length(draft_.at[v] - to_double(draft_.ends[v][kInner])),
          length(to_double(draft_.ends[v][kOuter]) - draft_.at[v])};
}

bool ShellPatch::lengthen(std::span<const Reach> wanted, FailedSteps& failed, const Progress& progress) {
  constexpr double kStep = 0.25;     // of the fibre, at most: its neighbours grow meanwhile
  constexpr double kLeastStep = 16;  // lattice steps: less is rounding
  constexpr int kPasses = 4;         // what failed may go once its neighbours have moved
  struct Lack {
    double lack;
    std::uint32_t fibre;
    Side side;
    bool operator<(const Lack& b) const noexcept {
      if (lack != b.lack) return lack < b.lack;
      return fibre != b.fibre ? fibre > b.fibre : side > b.side;
    }
  };
  FibreMoves steps = moves();
  std::priority_queue<Lack> queue;
  failed.resize(2 * wanted.size(), 0);
  const auto push = [&](std::uint32_t v, Side side) {
    const double lack = wanted[v][side] - reach(v)[side];
    if (lack >= kLeastStep) queue.push({lack, v, side});
  };
  const auto step = [&](std::uint32_t v, Side side, double lack) {
    const double whole = length(draft_.fibre(v));
    return steps.extend(v, side, std::min({lack, kStep * whole, kJustBelow * longest_ - whole}), kLeastStep);
  };
  for (int pass = 0; pass < kPasses; ++pass) {
    for (std::uint32_t v = 0; v < wanted.size(); ++v) {
      if (!draft_.can_move(v)) continue;
      for (const Side side : {kInner, kOuter})
        if (draft_.changed[v] > failed[2 * v + side]) push(v, side);
    }
    if (queue.empty()) break;
    while (!queue.empty()) {
      if (progress.cancelled()) return false;
      const Lack next = queue.top();
      queue.pop();
      if (step(next.fibre, next.side, next.lack))
        push(next.fibre, next.side);
      else
        failed[2 * next.fibre + next.side] = draft_.clock;
    }
  }
  return true;
}

std::size_t ShellPatch::re_aim(const Progress& progress) {
  constexpr int kPasses = 4;
  FibreMoves steps = moves();
  std::vector<std::uint32_t> tried(draft_.out.size(), 0);
  std::size_t turned = 0;
  for (int pass = 0; pass < kPasses; ++pass) {
    const std::size_t before = turned;
    for (std::uint32_t v = 0; v < draft_.out.size(); ++v) {
      if (progress.cancelled()) return turned;
      if (!draft_.can_move(v) || draft_.changed[v] <= tried[v]) continue;
      turned += steps.re_aim(v);
      tried[v] = draft_.clock;
    }
    if (turned == before) break;
  }
  return turned;
}

void ShellPatch::place_on_source(const BoxTree& tree) {
  for (std::uint32_t v = 0; v < draft_.out.size(); ++v)
    if (draft_.can_move(v)) draft_.at[v] = surface_on(draft_.ends[v], source_, tree);
}

void ShellPatch::tolerate(const Tolerance& tolerance) {
  const bool loses_first = tolerance.loss > 0 && checks_.tolerance().loss == 0;
  checks_.tolerate(tolerance);
  if (!loses_first) return;
  // The loss is counted triangle by triangle, so the lists name single ones.
  ReferenceLists single;
  single.resize(draft_.faces.size());
  std::vector<TriangleReference> found;
  for (std::uint32_t f = 0; f < draft_.faces.size(); ++f) {
    if (!draft_.alive(f)) continue;
    const SlabShape shape(draft_.triangle(f, kInner), draft_.triangle(f, kOuter));
    found.clear();
    for_triangles(source_, draft_.lists.of(f), [&](std::uint32_t t) {
      if (!shape.is_apart(source_.triangle(t))) found.push_back(TriangleReference::triangle(t));
    });
    single.replace(f, found);
  }
  draft_.lists = std::move(single);
}

void ShellPatch::free_quadrics() { free_memory(draft_.quadrics); }

BoxTree tree_of(const SourceIndex& source) {
  return BoxTree(source.faces.size(), [&](std::size_t t) {
    Box3d box;
    for (const LatticePoint p : source.corners(static_cast<std::uint32_t>(t))) box.add(to_double(p));
    return box;
  });
}

ShellDraft draft_of(const Shell& shell, const SourceIndex& source, const BoxTree& tree) {
  ShellDraft draft;
  draft.faces = shell.faces;
  const std::size_t fibres = shell.ends[kInner].size();
  if (Components components = find_components(fibres, shell.faces); components.count > 1)
    draft.component = std::move(components.of_face);
  draft.from.assign(shell.faces.size(), 0);
  draft.lists.resize(shell.faces.size());
  for (std::size_t v = 0; v < fibres; ++v) {
    const Ends ends = {shell.ends[kInner][v], shell.ends[kOuter][v]};
    draft.ends.push_back(ends);
    draft.at.push_back(surface_on(ends, source, tree));
  }
  return draft;
}

Vec3d surface_on(const Ends& fibre, const SourceIndex& source, const BoxTree& tree) {
  const Vec3d in = to_double(fibre[kInner]), out = to_double(fibre[kOuter]);
  return out + (in - out) * first_crossing(out, in, source, tree).value_or(0.5);
}

double depth_below(Vec3d surface, Vec3d inwards, double most, const SourceIndex& source, const BoxTree& tree) {
  constexpr double kLeave = 1e-3;  // of the way: the surface itself is no far side
  const Vec3d to = surface + inwards * most;
  const Vec3d from = surface + (to - surface) * kLeave;
  const auto share = first_crossing(from, to, source, tree);
  return share ? length(from + (to - from) * *share - surface) : most;
}

}  // namespace relief::detail
