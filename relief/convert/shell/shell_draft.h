// Slabs while they are being made.
#pragma once

#include <relief/convert/geometry/quadric.h>
#include <relief/convert/geometry/shell.h>
#include <relief/convert/geometry/source_index.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace relief::detail {

/// A piece of the source that may meet a slab: a triangle or a whole cluster, by the source's order.
struct TriangleReference {
  std::uint32_t code;
  [[nodiscard]] static constexpr TriangleReference triangle(std::uint32_t t) noexcept { return {t << 1U}; }
  [[nodiscard]] static constexpr TriangleReference cluster(std::uint32_t c) noexcept {
    return {((c * kClusterSize) << 1U) | 1U};
  }
  [[nodiscard]] constexpr bool is_cluster() const noexcept { return (code & 1U) != 0; }
  /// Returns the triangle, or the first of the cluster.
  [[nodiscard]] constexpr std::uint32_t first() const noexcept { return code >> 1U; }
  friend constexpr bool operator<(TriangleReference a, TriangleReference b) noexcept { return a.code < b.code; }
};

/// Calls visit(t) for the triangles that some references stand for.
template <typename Visit>
void for_triangles(const SourceIndex& source, std::span<const TriangleReference> references, Visit&& visit) {
  for (const TriangleReference r : references) {
    const auto stop = std::min<std::size_t>(r.first() + (r.is_cluster() ? kClusterSize : 1), source.faces.size());
    for (std::uint32_t t = r.first(); t < stop; ++t) visit(t);
  }
}

/// A list of triangle references per slab. All lie in one pool; lists that were replaced stay in it until it is packed.
class ReferenceLists {
 public:
  [[nodiscard]] std::span<const TriangleReference> of(std::uint32_t slab) const noexcept {
    return std::span(pool_).subspan(ranges_[slab].begin, ranges_[slab].count);
  }
  [[nodiscard]] std::size_t size() const noexcept { return ranges_.size(); }
  /// Adds empty lists up to this many slabs.
  void resize(std::size_t slabs) { ranges_.resize(slabs); }
  void reserve(std::size_t slabs) { ranges_.reserve(slabs); }
  void reserve_pool(std::size_t references) { pool_.reserve(references); }
  /// Room in the pool for all that it holds before it is packed.
  void reserve_pool() { pool_.reserve(most_kept()); }
  /// The list of the next slab. The references must lie outside of this pool, here and below.
  void append(std::span<const TriangleReference> references) {
    ranges_.emplace_back();
    replace(static_cast<std::uint32_t>(ranges_.size() - 1), references);
  }
  void replace(std::uint32_t slab, std::span<const TriangleReference> references) {
    listed_ -= ranges_[slab].count;
    ranges_[slab] = {static_cast<std::uint32_t>(pool_.size()), static_cast<std::uint32_t>(references.size())};
    listed_ += references.size();
    pool_.insert(pool_.end(), references.begin(), references.end());
  }
  void clear(std::uint32_t slab) {
    listed_ -= ranges_[slab].count;
    ranges_[slab] = {};
  }
  /// Leaves out what is in no list any more, once a third of the pool is.
  void pack_if_stale() {
    if (pool_.size() > most_kept()) pack();
  }
  void pack();
  /// Gives back memory that was reserved and not used.
  void shrink_to_fit() { pool_.shrink_to_fit(); }
  /// Returns the references in the pool, unused ones included.
  [[nodiscard]] std::size_t pool_size() const noexcept { return pool_.size(); }

 private:
  struct Range {
    std::uint32_t begin = 0, count = 0;
  };
  /// References; below it packing a small pool is not worth the time.
  static constexpr std::size_t kSmallPool = 65536;
  [[nodiscard]] std::size_t most_kept() const noexcept { return listed_ + listed_ / 2 + kSmallPool; }

  std::vector<Range> ranges_;
  std::vector<TriangleReference> pool_;
  std::size_t listed_ = 0;  // references in lists
};

/// Slabs as triangles of fibres, and what collapsing their edges needs to know.
struct ShellDraft {
  std::vector<Face> faces;               ///< corners kNone: gone
  std::vector<std::uint32_t> component;  ///< per face: the connected component that it belongs to; empty: there is one
  std::vector<Ends> ends;                ///< of each fibre
  std::vector<Vec3d> at;                 ///< a place on each fibre: where the surface is thought to be
  std::vector<Quadric> quadrics;         ///< per fibre
  ReferenceLists lists;             ///< per face: all pieces of the source that meet the slab, except what was given up
  std::vector<std::uint32_t> from;  ///< per face: the source's triangle that it is, and then it has no list; else kNone

  [[nodiscard]] std::uint32_t component_of(std::uint32_t f) const noexcept {
    return component.empty() ? 0 : component[f];
  }
  [[nodiscard]] bool alive(std::uint32_t f) const noexcept { return faces[f][0] != kNone; }
  [[nodiscard]] LatticeTriangle triangle(std::uint32_t f, Side side) const noexcept {
    return {ends[faces[f][0]][side], ends[faces[f][1]][side], ends[faces[f][2]][side]};
  }
  /// From the inner to the outer end.
  [[nodiscard]] Vec3d fibre(std::uint32_t v) const noexcept { return to_double(ends[v][kOuter] - ends[v][kInner]); }
  [[nodiscard]] Box3d box(std::uint32_t f) const noexcept {
    Box3d box;
    for (const std::uint32_t v : faces[f])
      for (const LatticePoint p : ends[v]) box.add(to_double(p));
    return box;
  }
  /// shape_of() of the triangle between the places on its fibres.
  [[nodiscard]] double shape(const Face& f) const noexcept {
    const Vec3d a = at[f[0]], b = at[f[1]], c = at[f[2]];
    return shape_of(a, b, c, length(cross(b - a, c - a)));
  }
};

/// Adds the plane of a source triangle to the quadric of one of its corners, with a third of its area.
void add_plane(const SourceIndex& source, std::uint32_t t, Quadric& quadric) noexcept;
/// Returns one slab on every triangle of a source, none of which has a list yet. `ends` by the source's points;
/// `component` by its triangles, empty: there is one.
[[nodiscard]] ShellDraft finest_draft(const SourceIndex& source, std::vector<Ends>&& ends,
                                      std::vector<std::uint32_t>&& component);

/// A draft that is being changed: with half-edges, which fibres must stay, and when each fibre's star last changed.
/// Half-edge 3 f + k runs from corner k of face f to the next.
struct LinkedDraft : ShellDraft {
  std::vector<std::uint32_t> twins;     ///< per half-edge; kNone at the edge of a draft that is a part of a shell
  std::vector<std::uint32_t> out;       ///< per fibre a half-edge that leaves it; kNone: the fibre is gone
  std::vector<std::uint16_t> valences;  ///< per fibre the faces around it
  std::vector<std::uint8_t> fixed;      ///< per fibre, whether it must stay; all on boundary loops must
  std::vector<std::uint32_t> changed;   ///< per fibre: when it or a slab around it last changed, by `clock`
  std::size_t alive_count = 0;          ///< faces
  static constexpr std::uint32_t kAtFirst = 1;
  std::uint32_t clock = kAtFirst;

  explicit LinkedDraft(ShellDraft&& draft);

  [[nodiscard]] std::uint32_t origin(std::uint32_t h) const noexcept { return faces[h / 3][h % 3]; }
  [[nodiscard]] std::uint32_t target(std::uint32_t h) const noexcept { return origin(next_of(h)); }
  [[nodiscard]] bool is_free(std::uint32_t v) const noexcept { return fixed[v] == 0; }
  /// Returns whether a fibre stands in a slab and may change.
  [[nodiscard]] bool can_move(std::uint32_t v) const noexcept { return out[v] != kNone && is_free(v); }
  /// Returns whether h is the one of its edge's two half-edges that stands for it, between two free fibres.
  [[nodiscard]] bool is_free_edge(std::uint32_t h) const noexcept {
    return alive(h / 3) && h < twins[h] && is_free(origin(h)) && is_free(target(h));
  }
  /// Calls visit(h) for the half-edges that leave a free fibre.
  template <typename Visit>
  void for_ring(std::uint32_t v, Visit&& visit) const {
    const std::uint32_t start = out[v];
    std::uint32_t h = start;
    do {
      visit(h);
      h = twins[last_of(h)];
    } while (h != start);
  }
  /// Returns whether two fibres, of which the first is free, are the ends of an edge.
  [[nodiscard]] bool are_joined(std::uint32_t u, std::uint32_t v) const;
  /// When the star of one of an edge's ends last changed.
  [[nodiscard]] std::uint32_t changed_at(std::uint32_t h) const noexcept {
    return std::max(changed[origin(h)], changed[target(h)]);
  }
  /// Notes that a free fibre has changed, and with it the slabs around it.
  void touch(std::uint32_t v);

  /// Returns the link condition (C0). The ends of a free edge share exactly two neighbours, the far corners of its
  /// faces. Afterwards neither these nor the merged fibre have fewer than three faces, and the merged one has at most
  /// kMostValence.
  [[nodiscard]] bool link_allows(std::uint32_t h) const;
  /// Merges the target of a free edge into its origin: connectivity only. Faces other than the two that go keep their
  /// numbers.
  void collapse(std::uint32_t h);
  /// Flips the edge between two faces; connectivity only. Where h ran from u to v with a to its left and b to its
  /// right, face h / 3 becomes (u, b, a) and the twin's (b, v, a).
  void flip(std::uint32_t h);

  /// Faces around a fibre: more make stars slow to test, and their slabs thin.
  static constexpr int kMostValence = 14;

 private:
  void join(std::uint32_t g, std::uint32_t h) noexcept {
    twins[g] = h;
    twins[h] = g;
  }
};

}  // namespace relief::detail
