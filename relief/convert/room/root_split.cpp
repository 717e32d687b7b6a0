#include <relief/convert/room/fibre_lengthening.h>
#include <relief/convert/room/reach_wanted.h>
#include <relief/convert/room/root_split.h>
#include <relief/convert/room/solids.h>
#include <relief/core/detail.h>
#include <relief/core/query.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <utility>

namespace relief::detail {
namespace {

using Weights = std::array<double, 3>;

/// A root, or a half of one, or of a half.
struct Piece {
  std::array<FibreId, 3> fibres;
  RootPlace place;         ///< in the root that it is a part of; its level says how often that was halved
  std::size_t newest = 0;  ///< the corner opposite the edge that is halved next
};

/// Of how many intervals a grid of n is in a piece: half as many after every second halving, which cuts each edge in
/// two. Then its samples are those that were there.
int intervals_of(int n, int level) noexcept { return after_cuts(n, level / 2); }

class Splitter {
 public:
  explicit Splitter(const Snapshot& surface)
      : surface_(surface),
        mesh_(surface.slab_mesh()),
        step_(std::ldexp(1.0, lowest_bit_of(mesh_.root_fibres()).value_or(0))) {
    fibres_.assign(mesh_.root_fibres().begin(), mesh_.root_fibres().end());
    for (SlabId root = 0; root < mesh_.roots().size(); ++root) {
      pieces_.push_back({.fibres = mesh_.roots()[root].fibres, .place = {.root = root}});
      pieces_.back().newest = opposite_longest(root);
      for (std::size_t k = 0; k < 3; ++k) edges_[edge(root, k)].push_back(root);
    }
  }

  /// Halves what lies in a solid until its edges are short enough.
  void split_in(const Capsule& solid, const Progress& progress) {
    Capsule wide = solid;
    wide.radius *= 1 + kBeside;
    const Box3d box = box_of(wide);
    std::vector<std::uint8_t> near(mesh_.roots().size());
    mesh_.visit_roots([&](const Box3d& b) { return b.meets(box); },
                      [&](SlabId root) {
                        near[root] = 1;
                        return false;
                      });
    // What is halved for the sake of others is looked at again.
    for (bool changed = true; std::exchange(changed, false);)
      for (SlabId number = 0; number < pieces_.size() && pieces_.size() < mesh_.roots().size() + kMostAdded; ++number) {
        if (progress.cancelled()) return;
        if (near[pieces_[number].place.root] != 0 && longest(pieces_[number]) > kSplitEdge * solid.radius &&
            lies_in(pieces_[number], wide))
          changed = halve(number) || changed;
      }
  }

  [[nodiscard]] std::optional<SplitRoots> finish() const {
    const auto roots = static_cast<SlabId>(mesh_.roots().size());
    const auto added = static_cast<SlabId>(pieces_.size()) - roots;
    if (added == 0) return std::nullopt;
    SplitRoots made;
    made.halved = {.first = roots, .added = added, .numbers = {}};
    for (SlabId root = 0; root < roots; ++root)
      if (pieces_[root].place.level > 0) made.halved.numbers.push_back(root);
    for (auto f = static_cast<FibreId>(mesh_.root_fibres().size()); f < fibres_.size(); ++f) made.fibres.push_back(f);
    std::vector<RootPlace> origins;
    for (SlabId s = 0; s < mesh_.slab_count() + added; ++s) origins.push_back(origin(s, added));
    std::array<std::vector<int>, kLayerCount> intervals;
    for (int k = 0; k < kLayerCount; ++k)
      if (surface_.has(static_cast<Layer>(k)))
        for (const RootPlace& from : origins)
          intervals[static_cast<std::size_t>(k)].push_back(
              intervals_of(surface_.intervals(static_cast<Layer>(k), from.root), from.level));
    const auto cage = make_cage(added, intervals[static_cast<std::size_t>(Layer::Displacement)]);
    if (!cage) return std::nullopt;
    made.model = DetailChange::of_parts(surface_, cage, std::move(origins), std::move(intervals)).of(surface_);
    return made;
  }
  /// How far the surface has moved outside the solids, at most: at the middles of its edges, where these cross the old
  /// ones.
  [[nodiscard]] double moved(const Snapshot& now, const RoomWanted& wanted) const {
    double most = 0;
    PickHint hint;
    for (SlabId s = 0; s < pieces_.size(); ++s) {
      const RootPlace& part = pieces_[s].place;
      if (part.level == 0) continue;
      const int twice = 2 * now.slab_mesh().intervals(s);
      const SlabCorners corners = now.slab_mesh().corners(s);
      for (int j = 0; j <= twice; ++j)
        for (int i = 0; i + j <= twice; ++i) {
          if (i % 2 == 0 && j % 2 == 0) continue;
          const Weights w = {double(twice - i - j) / twice, double(i) / twice, double(j) / twice};
          const Weights there = in_root(part, w);
          const Vec3d is = corners.point(w, displacement_at(now, s, w[1], w[2]));
          const Vec3d was = corners.point(w, displacement_at(surface_, part.root, there[1], there[2]));
          // Along the fibre it is no less.
          if (length(is - was) <= most || is_in(wanted.cut, is) || is_in(wanted.fill, is)) continue;
          most = std::max(most, length(closest_point(surface_, is, hint).position - is));
        }
    }
    return most;
  }

 private:
  using Edge = std::pair<FibreId, FibreId>;

  [[nodiscard]] Edge edge(SlabId number, std::size_t opposite) const noexcept {
    const auto& f = pieces_[number].fibres;
    return std::minmax(FibreId{f[(opposite + 1) % 3]}, FibreId{f[(opposite + 2) % 3]});
  }
  [[nodiscard]] static Weights in_root(const RootPlace& part, const Weights& w) noexcept {
    Weights there = part.in_root(w);
    for (double& x : there) x /= 1 << part.level;
    return there;
  }
  /// Returns where the surface lies at a place of a piece.
  [[nodiscard]] Vec3d at(const Piece& piece, const Weights& w) const noexcept {
    Weights there = in_root(piece.place, w);
    const SlabId slab = mesh_.descend(piece.place.root, there);
    return surface_point(surface_, slab, there[1], there[2]).position;
  }
  [[nodiscard]] std::array<double, 3> edge_lengths(const Piece& piece) const noexcept {
    const Vec3d a = at(piece, {1, 0, 0}), b = at(piece, {0, 1, 0}), c = at(piece, {0, 0, 1});
    return {length(c - b), length(a - c), length(b - a)};
  }
  [[nodiscard]] double longest(const Piece& piece) const noexcept { return std::ranges::max(edge_lengths(piece)); }
  /// Of edges of one length that with the lower fibres, so that both slabs beside it choose the same.
  [[nodiscard]] std::size_t opposite_longest(SlabId number) const noexcept {
    const std::array<double, 3> lengths = edge_lengths(pieces_[number]);
    const auto key = [&](std::size_t k) { return std::pair(-lengths[k], edge(number, k)); };
    return std::ranges::min({std::size_t{0}, std::size_t{1}, std::size_t{2}}, {}, key);
  }
  /// Returns whether the surface of a piece reaches into a solid, and its fibres towards the tool.
  [[nodiscard]] bool lies_in(const Piece& piece, const Capsule& solid) const noexcept {
    Vec3d out;
    for (const FibreId f : piece.fibres) out += normalized(fibres_[f].direction());
    if (solid.axis != Vec3d{} && !(dot(solid.axis, out) > 0)) return false;
    constexpr int kPlaces = 12;  // along an edge of a piece that may be wider than the solid
    for (int j = 0; j <= kPlaces; ++j)
      for (int i = 0; i + j <= kPlaces; ++i)
        if (is_in({&solid, 1},
                  at(piece, {double(kPlaces - i - j) / kPlaces, double(i) / kPlaces, double(j) / kPlaces})))
          return true;
    return false;
  }
  [[nodiscard]] bool is_whole(SlabId number) const noexcept {
    const SlabId root = pieces_[number].place.root;
    return mesh_.part(root).children == 0 && pieces_[number].place.level + 1 < kMaxLevel;
  }

  /// Halves a piece, and before it those across its edges whose newest edge is another. False where one of them cannot
  /// be halved; what was halved by then stays.
  bool halve(SlabId number) {
    const FibreId before = static_cast<FibreId>(fibres_.size());
    // Each of them waits for the next. Their edges get longer from one to the next, so none comes twice.
    std::vector<SlabId> waiting = {number};
    while (!waiting.empty()) {
      const SlabId last = waiting.back();
      if (!is_whole(last) || waiting.size() > pieces_.size()) return false;
      const Edge e = edge(last, pieces_[last].newest);
      std::optional<SlabId> across;
      for (const SlabId other : edges_[e])
        if (other != last) across = other;
      if (across && !is_whole(*across)) return false;
      if (across && edge(*across, pieces_[*across].newest) != e) {
        waiting.push_back(*across);
        continue;
      }
      const FibreId middle = add_middle(e);
      halve_at(last, middle);
      if (across) halve_at(*across, middle);
      waiting.pop_back();
    }
    return fibres_.size() > before;
  }
  FibreId add_middle(const Edge& e) {
    const auto middle = [&](Vec3d a, Vec3d b) {
      Vec3d m = (a + b) * 0.5;
      for (std::size_t k = 0; k < 3; ++k) m[k] = std::round(m[k] / step_) * step_;
      return m;
    };
    const Fibre &a = fibres_[e.first], &b = fibres_[e.second];
    fibres_.push_back({middle(a.inner, b.inner), middle(a.outer, b.outer)});
    return static_cast<FibreId>(fibres_.size() - 1);
  }
  void halve_at(SlabId number, FibreId middle) {
    for (std::size_t k = 0; k < 3; ++k) std::erase(edges_[edge(number, k)], number);
    const Piece whole = pieces_[number];
    const std::size_t a = whole.newest, b = (a + 1) % 3, c = (a + 2) % 3;
    Piece one = whole, two = whole;
    for (Piece* half : {&one, &two}) {
      ++half->place.level;
      for (auto& corner : half->place.corners)
        for (int& w : corner) w *= 2;
    }
    std::array<int, 3> between{};
    for (std::size_t k = 0; k < 3; ++k) between[k] = whole.place.corners[b][k] + whole.place.corners[c][k];
    one.fibres[c] = two.fibres[b] = middle;
    one.place.corners[c] = two.place.corners[b] = between;
    one.newest = c;
    two.newest = b;
    pieces_[number] = one;
    pieces_.push_back(two);
    for (const SlabId half : {number, static_cast<SlabId>(pieces_.size() - 1)})
      for (std::size_t k = 0; k < 3; ++k) edges_[edge(half, k)].push_back(half);
  }

  /// Where a slab of the new cage comes from, as DetailChange has it.
  [[nodiscard]] RootPlace origin(SlabId s, SlabId added) const noexcept {
    if (s >= pieces_.size()) return {.root = s - added};
    // Of a root that is cut, the slab in its centre has its number.
    return pieces_[s].place;
  }
  [[nodiscard]] std::shared_ptr<const SlabMesh> make_cage(SlabId added, std::span<const int> intervals) const {
    std::vector<SlabMesh::Face> faces;
    for (const Piece& piece : pieces_) {
      const SlabId root = piece.place.root;
      faces.push_back({piece.fibres, piece.place.level == 0 ? mesh_.roots()[root].intervals : intervals[faces.size()]});
    }
    auto cage = SlabMesh::make(fibres_, faces);
    if (!cage) return nullptr;
    const auto roots = static_cast<SlabId>(mesh_.roots().size());
    std::vector<SlabId> cuts(mesh_.cuts().begin(), mesh_.cuts().end());
    for (SlabId& s : cuts)
      if (s >= roots) s += added;
    if (!cuts.empty()) cage = cage->cut(cuts);
    if (!cage) return nullptr;
    if (!std::ranges::equal(intervals, cage->slabs(), {}, {}, &Slab::intervals)) cage = cage->refined(intervals);
    if (!cage) return nullptr;
    return std::make_shared<const SlabMesh>(*std::move(cage));
  }

  const Snapshot& surface_;
  const SlabMesh& mesh_;
  double step_;  ///< all ends of fibres lie on multiples of it
  std::vector<Fibre> fibres_;
  std::vector<Piece> pieces_;  ///< by the number of the root that it becomes
  std::map<Edge, std::vector<SlabId>> edges_;
};

}  // namespace

std::optional<SplitRoots> split_roots(const Snapshot& surface, const RoomWanted& wanted, const Progress& progress) {
  Splitter splitter(surface);
  for (const auto* solids : {&wanted.cut, &wanted.fill})
    for (const Capsule& solid : *solids) splitter.split_in(solid, progress);
  if (progress.cancelled()) return std::nullopt;
  std::optional<SplitRoots> made = splitter.finish();
  if (made) made->surface_moved = splitter.moved(*made->model, wanted);
  return made;
}

}  // namespace relief::detail
