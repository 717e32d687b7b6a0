#include <relief/convert/skin/piece_winding.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace relief::detail {
namespace {

using Long = Vec3<std::int64_t>;

constexpr int sign(Int128 v) noexcept { return v > 0 ? 1 : v < 0 ? -1 : 0; }

LatticePlane plane_of(const LatticeTriangle& t) noexcept { return LatticePlane::through(t[0], t[1], t[2]); }

/// Puts the pieces around an edge into order.
class AroundEdge {
 public:
  /// Seen from `to` towards `from`: counter-clockwise.
  AroundEdge(const FaceArrangement& arrangement, std::uint32_t from, std::uint32_t to) {
    const ExactPoint a = arrangement.point(from), b = arrangement.point(to);
    std::int64_t most = -1;
    for (std::size_t k = 0; k < 3; ++k)
      if (const std::int64_t by = std::abs(b.rounded()[k] - a.rounded()[k]); by > most) most = by, axis_ = k;
    way_ = compare(b, a, axis_);
  }
  /// Of two vectors across the edge: 1 when the second comes within half a turn after the first, 0 when they lie on one
  /// line.
  [[nodiscard]] int turn(const Long& m, const Long& n) const noexcept {
    const std::size_t i = (axis_ + 1) % 3, j = (axis_ + 2) % 3;
    return way_ * sign(Int128{m[i]} * n[j] - Int128{m[j]} * n[i]);
  }

 private:
  std::size_t axis_ = 0;
  int way_ = 0;
};

/// Holds a half-edge and the normal of its piece. The normal is turned so that the piece lies to the left of the
/// edge's own way.
struct Wing {
  std::uint32_t half_edge;
  bool along;  // the edge's own way
  Long normal;
};

class Winder {
 public:
  Winder(const FaceArrangement& arrangement, const FaceTree& tree) : all_(arrangement), tree_(tree) {}

  std::optional<PieceWinding> find(const Progress& progress) {
    link_sides();
    if (progress.cancelled()) return std::nullopt;
    result_.in_front.assign(all_.pieces.size(), 0);
    seen_.assign(all_.pieces.size(), 0);
    for (std::uint32_t p = 0; p < all_.pieces.size(); ++p) {
      if (seen_[p] != 0) continue;
      if (progress.cancelled()) return std::nullopt;
      spread_from(p);
    }
    return std::move(result_);
  }

 private:
  [[nodiscard]] LatticePlane plane(std::uint32_t piece) const noexcept {
    return plane_of(tree_.corners(all_.pieces[piece].from));
  }

  void link_sides() {
    struct Key {
      std::uint64_t edge;
      std::uint32_t half_edge;
      bool operator<(const Key& b) const noexcept { return edge != b.edge ? edge < b.edge : half_edge < b.half_edge; }
    };
    std::vector<Key> keys;
    keys.reserve(3 * all_.pieces.size());
    for (std::uint32_t p = 0; p < all_.pieces.size(); ++p)
      for (std::uint32_t k = 0; k < 3; ++k) {
        const std::uint32_t v = all_.pieces[p].corners[k], w = all_.pieces[p].corners[(k + 1) % 3];
        keys.push_back({std::uint64_t{std::min(v, w)} << 32U | std::max(v, w), 3 * p + k});
      }
    std::sort(keys.begin(), keys.end());
    result_.across.assign(6 * all_.pieces.size(), kNone);
    std::vector<Wing> wings;
    for (std::size_t k = 0; k < keys.size();) {
      const std::uint64_t edge = keys[k].edge;
      const auto from = static_cast<std::uint32_t>(edge >> 32U), to = static_cast<std::uint32_t>(edge);
      wings.clear();
      for (; k < keys.size() && keys[k].edge == edge; ++k) {
        const std::uint32_t h = keys[k].half_edge;
        wings.push_back({h, all_.pieces[h / 3].corners[h % 3] == from, {}});
      }
      if (wings.size() == 1) {
        result_.open += all_.pieces[wings[0].half_edge / 3].sheets != 0;
        link(wings[0], wings[0]);
        continue;
      }
      if (wings.size() > 2) sort_around(from, to, wings);
      for (std::size_t i = 0; i < wings.size(); ++i) link(wings[i], wings[(i + 1) % wings.size()]);
    }
  }

  void sort_around(std::uint32_t from, std::uint32_t to, std::vector<Wing>& wings) const {
    for (Wing& wing : wings) {
      wing.normal = plane(wing.half_edge / 3).normal;
      if (!wing.along) wing.normal = -wing.normal;
    }
    const AroundEdge around(all_, from, to);
    const Long first = wings.front().normal;
    const auto half = [&](const Wing& wing) {  // of the turn from the first one
      const int side = around.turn(first, wing.normal);
      if (side != 0) return side > 0 ? 1 : 3;
      const Int128 ahead =
          Int128{first.x} * wing.normal.x + Int128{first.y} * wing.normal.y + Int128{first.z} * wing.normal.z;
      return ahead > 0 ? 0 : 2;
    };
    std::sort(wings.begin(), wings.end(), [&](const Wing& a, const Wing& b) {
      const int at_a = half(a), at_b = half(b);
      if (at_a != at_b) return at_a < at_b;
      if (const int turn = around.turn(a.normal, b.normal); turn != 0) return turn > 0;
      return a.half_edge < b.half_edge;
    });
  }

  /// What lies between a piece and the next one around an edge.
  void link(const Wing& wing, const Wing& next) {
    const std::uint32_t a = 2 * wing.half_edge + (wing.along ? 0 : 1);
    const std::uint32_t b = 2 * next.half_edge + (next.along ? 1 : 0);
    result_.across[a] = b;
    result_.across[b] = a;
  }

  /// Winding of all pieces that hang together by edges with one.
  void spread_from(std::uint32_t first) {
    std::vector<std::uint32_t> group = {first};
    seen_[first] = 1;
    for (std::size_t k = 0; k < group.size(); ++k) {
      const std::uint32_t p = group[k];
      for (std::uint32_t h = 3 * p; h < 3 * p + 3; ++h)
        for (std::uint32_t side = 0; side < 2; ++side) {
          const std::uint32_t other = result_.across[2 * h + side], q = other / 6;
          if (seen_[q] != 0) continue;
          seen_[q] = 1;
          result_.in_front[q] = result_.in_front[p] + (side == 1 ? all_.pieces[p].sheets : 0) -
                                (other % 2 == 1 ? all_.pieces[q].sheets : 0);
          group.push_back(q);
        }
    }
    // Large pieces have room for a place to count from.
    constexpr std::size_t kTries = 8;
    std::vector<std::pair<double, std::uint32_t>> large;
    large.reserve(group.size());
    for (const std::uint32_t p : group) large.emplace_back(-all_.area(p), p);
    const auto tried = large.begin() + static_cast<std::ptrdiff_t>(std::min(kTries, large.size()));
    std::partial_sort(large.begin(), tried, large.end());
    for (auto at = large.begin(); at != tried; ++at)
      if (const auto winding = count_in_front(at->second)) {
        const std::int32_t by = *winding - result_.in_front[at->second];
        for (const std::uint32_t p : group) result_.in_front[p] += by;
        return;
      }
    for (const std::uint32_t p : group) result_.in_front[p] = 1 + std::abs(all_.pieces[p].sheets);
    result_.undecided.insert(result_.undecided.end(), group.begin(), group.end());
  }

  /// Counts the faces that a line along an axis from a place within the piece crosses.
  [[nodiscard]] std::optional<std::int32_t> count_in_front(std::uint32_t p) const {
    constexpr std::array<std::array<double, 3>, 4> kWeights = {
        {{0.34, 0.31, 0.35}, {0.29, 0.4, 0.31}, {0.41, 0.27, 0.32}, {0.22, 0.37, 0.41}}};
    for (const auto& w : kWeights)
      if (const auto count = count_in_front(p, w)) return count;
    return std::nullopt;
  }

  static constexpr unsigned kFine = 20;  // bits of a step to which the place is chosen

  /// Says how far along its axis a plane is at a place: numerator and denominator.
  struct Height {
    Int128 over;
    std::int64_t under;
  };
  [[nodiscard]] static Height height(const LatticePlane& plane, const Long& place, std::size_t axis) noexcept {
    const std::size_t i = (axis + 1) % 3, j = (axis + 2) % 3;
    return {
        plane.offset * (Int128{1} << kFine) - Int128{plane.normal[i]} * place[i] - Int128{plane.normal[j]} * place[j],
        plane.normal[axis]};
  }
  [[nodiscard]] static int compare_heights(const Height& a, const Height& b) noexcept {
    const WideInt<4> left = WideInt<2>(a.over) * WideInt<2>(b.under), right = WideInt<2>(b.over) * WideInt<2>(a.under);
    return (left - right).sign() * sign(a.under) * sign(b.under);
  }

  [[nodiscard]] std::optional<std::int32_t> count_in_front(std::uint32_t p,
                                                           const std::array<double, 3>& weights) const {
    const Piece& piece = all_.pieces[p];
    const LatticePlane own = plane(p);
    const std::size_t axis = dominant_axis(own.normal), i = (axis + 1) % 3, j = (axis + 2) % 3;
    Vec3d middle;
    for (std::size_t k = 0; k < 3; ++k) middle += all_.approximate(piece.corners[k]) * weights[k];
    Long place;
    place[i] = static_cast<std::int64_t>(std::floor(std::ldexp(middle[i], kFine)));
    place[j] = static_cast<std::int64_t>(std::floor(std::ldexp(middle[j], kFine)));
    const ExactPoint at = ExactPoint::scaled(place, kFine);
    const int sense = own.normal[axis] > 0 ? 1 : -1;
    for (std::size_t k = 0; k < 3; ++k)
      if (turn(all_.point(piece.corners[k]), all_.point(piece.corners[(k + 1) % 3]), at, axis) != sense)
        return std::nullopt;
    const Height here = height(own, place, axis);
    Box3d line;
    line.low = line.high = middle;
    line.low[axis] = 0;
    line.high[axis] = Lattice::kSpan;
    bool is_clear = true;
    std::int32_t beyond = 0;
    tree_.query(line, [&](std::uint32_t f) {
      const LatticeTriangle t = tree_.corners(f);
      std::array<int, 3> s{};
      for (std::size_t k = 0; k < 3; ++k) {
        const LatticePoint a = t[k], e = t[(k + 1) % 3] - a;
        s[k] = sign(Int128{e[i]} * (place[j] - (std::int64_t{a[j]} << kFine)) -
                    Int128{e[j]} * (place[i] - (std::int64_t{a[i]} << kFine)));
      }
      const bool outside = (s[0] < 0 || s[1] < 0 || s[2] < 0) && (s[0] > 0 || s[1] > 0 || s[2] > 0);
      if (outside) return true;
      const LatticePlane plane = plane_of(t);
      if (plane.normal[axis] == 0) {  // seen from its edge, which the line may meet
        is_clear = (s[0] != 0 || s[1] != 0 || s[2] != 0);
        return is_clear;
      }
      if (s[0] == 0 || s[1] == 0 || s[2] == 0) {
        is_clear = false;
        return false;
      }
      const int higher = compare_heights(height(plane, place, axis), here);
      if (higher == 0) {
        const Long n = cross_sign(plane.normal, own.normal);
        is_clear = n == Long{};
        return is_clear;
      }
      if (higher > 0) beyond += plane.normal[axis] > 0 ? 1 : -1;
      return true;
    });
    if (!is_clear) return std::nullopt;
    return sense > 0 ? beyond : beyond - piece.sheets;
  }

  [[nodiscard]] static Long cross_sign(const Long& a, const Long& b) noexcept {
    return {sign(Int128{a.y} * b.z - Int128{a.z} * b.y), sign(Int128{a.z} * b.x - Int128{a.x} * b.z),
            sign(Int128{a.x} * b.y - Int128{a.y} * b.x)};
  }

  const FaceArrangement& all_;
  const FaceTree& tree_;
  PieceWinding result_;
  std::vector<std::uint8_t> seen_;
};

}  // namespace

std::optional<PieceWinding> find_winding(const FaceArrangement& arrangement, const FaceTree& tree,
                                         const Progress& progress) {
  return Winder(arrangement, tree).find(progress);
}

}  // namespace relief::detail
