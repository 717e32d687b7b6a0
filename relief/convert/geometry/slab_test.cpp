#include <relief/convert/geometry/slab_test.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <span>

namespace relief::detail {
namespace {

using Corners = std::array<Vec3d, 3>;

/// Sines that cover rounding: of the sine of a cone's angle, and of a lean in float, some ten roundings of 2^-24.
constexpr double kConeSlack = 1e-6;
constexpr float kFloatSlack = 1e-5F;

Box3d box_of(std::span<const Vec3d> points) noexcept {
  Box3d box;
  for (const Vec3d p : points) box.add(p);
  return box;
}

/// Returns whether the two sets lie more than the clearance apart along the axis, which need not have unit length.
bool apart_along(Vec3d axis, std::span<const Vec3d> a, std::span<const Vec3d> b) noexcept {
  double a_low = Box3d::kFar, a_high = -Box3d::kFar, b_low = Box3d::kFar, b_high = -Box3d::kFar;
  for (const Vec3d p : a) {
    const double h = dot(axis, p);
    a_low = std::min(a_low, h), a_high = std::max(a_high, h);
  }
  for (const Vec3d p : b) {
    const double h = dot(axis, p);
    b_low = std::min(b_low, h), b_high = std::max(b_high, h);
  }
  const double gap = std::max(b_low - a_high, a_low - b_high);
  return gap > 0 && gap * gap > kClearance * kClearance * dot(axis, axis);
}

/// Two triangles, by their planes, the crosswise products of their edges and, for parallel ones, in their plane.
bool triangles_apart(const Corners& s, const Corners& t) noexcept {
  const Vec3d origin = s[0];
  const Corners a = {Vec3d{}, s[1] - origin, s[2] - origin};
  const Corners b = {t[0] - origin, t[1] - origin, t[2] - origin};
  const Vec3d na = cross(a[1] - a[0], a[2] - a[0]), nb = cross(b[1] - b[0], b[2] - b[0]);
  if (apart_along(na, a, b) || apart_along(nb, a, b)) return true;
  const double upright = 1 / std::max(1.0, length(na));
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3d e = a[(i + 1) % 3] - a[i], f = b[(i + 1) % 3] - b[i];
    if (apart_along(cross(na * upright, e), a, b) || apart_along(cross(na * upright, f), a, b)) return true;
    for (std::size_t j = 0; j < 3; ++j)
      if (apart_along(cross(e, b[(j + 1) % 3] - b[j]), a, b)) return true;
  }
  return false;
}

/// The planes of a wall that bulge outwards; i, j are the ends of one fibre and k, l those of the next.
template <typename Add>
void wall_planes(Vec3d i, Vec3d j, Vec3d k, Vec3d l, Add&& add) noexcept {
  // Inner ends i, k; outer ends j, l; the slab lies to the left of i -> k seen from outside.
  const double bulge = dot(cross(k - i, l - i), j - i);
  if (bulge <= 0) {
    add(cross(k - i, l - i));
    add(cross(l - i, j - i));
  } else {
    add(cross(k - i, j - i));
    add(cross(l - k, j - k));
  }
}

}  // namespace

SlabShape::SlabShape(const LatticeTriangle& inner, const LatticeTriangle& outer) noexcept
    : triangles_{inner, outer},
      ends_{to_double(inner[0]), to_double(inner[1]), to_double(inner[2]),
            to_double(outer[0]), to_double(outer[1]), to_double(outer[2])},
      fibres_{ends_[3] - ends_[0], ends_[4] - ends_[1], ends_[5] - ends_[2]},
      lengths_{length(fibres_[0]), length(fibres_[1]), length(fibres_[2])} {
  for (std::size_t k = 0; k < 3; ++k) {
    side_boxes_[0].add(ends_[k]);
    side_boxes_[1].add(ends_[k + 3]);
  }
  box_ = side_boxes_[0];
  box_.add(side_boxes_[1]);
  std::size_t count = 0;
  const auto add = [&](Vec3d n) {
    for (std::size_t axis = 0; axis < 3; ++axis) normals_[axis][count] = n[axis];
    ++count;
  };
  add(cross(ends_[2] - ends_[0], ends_[1] - ends_[0]));
  add(cross(ends_[4] - ends_[3], ends_[5] - ends_[3]));
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t l = (k + 1) % 3;
    wall_planes(ends_[k], ends_[k + 3], ends_[l], ends_[l + 3], add);
  }
  for (std::size_t k = 0; k < kPlanes; ++k) {
    const double size =
        std::sqrt(normals_[0][k] * normals_[0][k] + normals_[1][k] * normals_[1][k] + normals_[2][k] * normals_[2][k]);
    const double inverse = size > 0 ? 1 / size : 0;
    for (std::size_t axis = 0; axis < 3; ++axis) normals_[axis][k] *= inverse;
    limits_[k] = -Box3d::kFar;
  }
  for (const Vec3d p : ends_)
    for (std::size_t k = 0; k < kPlanes; ++k) {
      const double height = normals_[0][k] * p.x + normals_[1][k] * p.y + normals_[2][k] * p.z;
      limits_[k] = limits_[k] < height ? height : limits_[k];
    }
  levels_ = {dot(plane(0), ends_[0]), dot(plane(1), ends_[3])};
}

double SlabShape::middle_area() const noexcept {
  const Vec3d a = ends_[0] + ends_[3], b = ends_[1] + ends_[4], c = ends_[2] + ends_[5];
  constexpr double kOfSums = 1.0 / 8;  // the corners are sums of two, and the product is that of a parallelogram
  return kOfSums * length(cross(b - a, c - a));
}

bool SlabShape::is_apart(const SourceTriangle& t) const noexcept {
  if (misses_box(t)) return true;
  for (std::size_t k = 0; k < kPlanes; ++k) {
    const Vec3d n = plane(k);
    if (std::min({dot(n, t.a), dot(n, t.b), dot(n, t.c)}) > limits_[k] + kClearance) return true;
  }
  return false;
}

bool SlabShape::holds_end_of(const SlabShape& other) const noexcept {
  return std::ranges::any_of(other.ends_, [&](Vec3d p) { return !is_apart({p, p, p, {}, 0}); });
}

Meeting SlabShape::meet(const SourceTriangle& t) const noexcept {
  if (misses_box(t)) return Meeting::Apart;
  std::array<double, 2> highest{};
  for (std::size_t k = 0; k < 8; ++k) {
    const double a = dot(plane(k), t.a), b = dot(plane(k), t.b), c = dot(plane(k), t.c);
    if (std::min({a, b, c}) > limits_[k] + kClearance) return Meeting::Apart;
    if (k < 2) highest[k] = std::max({a, b, c});
  }
  const Corners corners = {t.a, t.b, t.c};
  if (highest[1] >= levels_[1] - kClearance && !triangles_apart({ends_[3], ends_[4], ends_[5]}, corners))
    return Meeting::Outer;
  if (highest[0] >= levels_[0] - kClearance && !triangles_apart({ends_[0], ends_[1], ends_[2]}, corners))
    return Meeting::Inner;
  std::array<double, 3> lean{};
  bool good = true;
  for (std::size_t k = 0; k < 3; ++k) {
    lean[k] = dot(t.normal, fibres_[k]) - t.slack * lengths_[k];
    good = good && lean[k] > 0;
  }
  return good || misses_bad_part(t, lean) ? Meeting::Section : Meeting::Folded;
}

Meeting SlabShape::meet(const SourceCluster& cluster) const noexcept {
  for (std::size_t k = 0; k < 3; ++k) {
    if (cluster.centre[k] - cluster.half[k] > box_.high[k] + kClearance ||
        cluster.centre[k] + cluster.half[k] < box_.low[k] - kClearance)
      return Meeting::Apart;
  }
  bool clear = true, inside = true;
  for (std::size_t k = 0; k < 8; ++k) {
    const Vec3d n = plane(k);
    const double middle = dot(n, cluster.centre);
    const double reach =
        std::abs(n.x) * cluster.half.x + std::abs(n.y) * cluster.half.y + std::abs(n.z) * cluster.half.z;
    if (middle - reach > limits_[k] + kClearance) return Meeting::Apart;
    inside = inside && middle + reach < limits_[k];
    if (k < 2) clear = clear && middle + reach < levels_[k] - kClearance;
  }
  if (!clear) return Meeting::Mixed;
  for (std::size_t k = 0; k < 3; ++k)
    inside = inside && cluster.centre[k] - cluster.half[k] > box_.low[k] &&
             cluster.centre[k] + cluster.half[k] < box_.high[k];
  const Meeting unless_crossed = inside ? Meeting::Within : Meeting::Mixed;
  if (cluster.cosine <= 0) return unless_crossed;
  const double sine = std::sqrt(std::max(0.0, 1 - cluster.cosine * cluster.cosine));
  for (std::size_t k = 0; k < 3; ++k) {
    const double along = dot(cluster.axis, fibres_[k]);
    const double across = std::sqrt(std::max(0.0, lengths_[k] * lengths_[k] - along * along));
    if (along * cluster.cosine - across * sine <= (cluster.slack + kConeSlack) * lengths_[k]) return unless_crossed;
  }
  return Meeting::Section;
}

bool SlabShape::surely_apart(std::size_t side, const SlabShape& other, std::size_t other_side) const noexcept {
  const auto beyond = [](const SlabShape& s, std::size_t of, const SlabShape& o, std::size_t side_of_o) {
    const Vec3d n = s.plane(of);
    const double level = s.levels_[of];
    int above = 0, below = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double h = dot(n, o.ends_[k + 3 * side_of_o]) - level;
      above += h > kSurelyBeyond;
      below += h < -kSurelyBeyond;
    }
    return above == 3 || below == 3;
  };
  return beyond(*this, side, other, other_side) || beyond(other, other_side, *this, side);
}

// The fibres that lean too little towards t fill the slab, or a part of it cut off by a line of the base triangle. That
// part is one or two smaller slabs, each within the hull of its six ends.
bool SlabShape::misses_bad_part(const SourceTriangle& t, const std::array<double, 3>& lean) const noexcept {
  std::size_t bad = 0, odd = 0;
  for (std::size_t k = 0; k < 3; ++k) bad += lean[k] <= 0;
  for (std::size_t k = 0; k < 3; ++k)
    if ((lean[k] <= 0) == (bad == 1)) odd = k;
  const std::size_t j = (odd + 1) % 3, k = (odd + 2) % 3;
  const Vec3d origin = ends_[odd];
  // A cut at the share of the way from the odd corner, moved so that the bad part grows by what the verifier cannot
  // tell apart: it cuts edges at multiples of 2^-12. Beside a fibre a hundred times as long that is a good deal of the
  // turn.
  constexpr double kResolution = 0x1p-12 + 1e-6;
  const auto cut = [&](std::size_t to) {
    const double share = lean[odd] / (lean[odd] - lean[to]);
    return std::clamp(bad == 1 ? share + kResolution : share - kResolution, 0.0, 1.0);
  };
  struct Pair {
    Vec3d in, out;
  };
  const auto fibre = [&](std::size_t v) { return Pair{ends_[v] - origin, ends_[v + 3] - origin}; };
  const Pair at_odd = fibre(odd), at_j = fibre(j), at_k = fibre(k);
  const auto between = [&](const Pair& to, double share) {
    return Pair{at_odd.in + (to.in - at_odd.in) * share, at_odd.out + (to.out - at_odd.out) * share};
  };
  const Corners corners = {t.a - origin, t.b - origin, t.c - origin};
  const auto misses = [&](std::initializer_list<Pair> part) {
    const std::size_t count = part.size();
    std::array<Vec3d, 8> places;
    std::size_t at = 0;
    for (const Pair& p : part) {
      places[at] = p.in;
      places[count + at++] = p.out;
    }
    const std::span<const Vec3d> ends = std::span(places).first(2 * count);
    const Box3d box = box_of(ends), other = box_of(corners);
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (other.low[axis] > box.high[axis] + kClearance || other.high[axis] < box.low[axis] - kClearance) return true;
    bool apart = apart_along(t.normal, ends, corners);
    const auto add = [&](Vec3d n) { apart = apart || apart_along(n, ends, corners); };
    add(plane(0));
    add(plane(1));
    for (std::size_t a = 0; a < count && !apart; ++a) {
      const std::size_t b = (a + 1) % count;
      wall_planes(ends[a], ends[count + a], ends[b], ends[count + b], add);
    }
    for (std::size_t a = 0; a < count && !apart; ++a) {
      const std::size_t b = (a + 1) % count, c = count + a, d = count + b;
      for (const Vec3d along :
           {ends[b] - ends[a], ends[d] - ends[c], ends[c] - ends[a], ends[d] - ends[a], ends[c] - ends[b]})
        for (std::size_t e = 0; e < 3 && !apart; ++e) add(cross(corners[(e + 1) % 3] - corners[e], along));
    }
    return apart;
  };
  if (bad == 3) return misses({at_odd, at_j, at_k});
  const Pair cut_j = between(at_j, cut(j)), cut_k = between(at_k, cut(k));
  if (bad == 1) return misses({at_odd, cut_j, cut_k});
  // The verifier's cut is nearer to the bad corners, for it needs no slack: the second part holds what it may put
  // there.
  const double turn = t.slack * lengths_[odd] + lean[odd], other_turn = t.slack * lengths_[j] + lean[j];
  const Pair latest = other_turn < 0 ? between(at_j, turn / (turn - other_turn)) : at_j;
  return misses({cut_j, at_j, at_k}) && misses({cut_j, latest, at_k, cut_k});
}

void FourTriangles::set(const std::array<LatticeTriangle, 4>& triangles,
                        const std::array<std::array<float, 4>, 4>& normals_and_slacks, std::size_t count,
                        LatticePoint origin) noexcept {
  const FourInts start = {origin.x, origin.y, origin.z, 0};
  std::array<std::array<Four, 4>, 3> places;  // by corner, by axis
  for (std::size_t corner = 0; corner < 3; ++corner) {
    for (std::size_t k = 0; k < 4; ++k) {
      const LatticePoint p = triangles[k][corner];
      places[corner][k] = __builtin_convertvector(FourInts{p.x, p.y, p.z, 0} - start, Four);
    }
    transpose(places[corner]);
  }
  Four farthest{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Four a = places[0][axis], b = places[1][axis], c = places[2][axis];
    const Four from = least(least(a, b), c), to = greatest(greatest(a, b), c);
    farthest = greatest(farthest, greatest(-from, to));
    for (std::size_t corner = 0; corner < 3; ++corner)
      corners[corner][axis] = std::bit_cast<Lanes>(places[corner][axis]);
    low[axis] = std::bit_cast<Lanes>(from);
    high[axis] = std::bit_cast<Lanes>(to);
  }
  reach = std::bit_cast<Lanes>(farthest);
  clusters = 0;
  std::array<Four, 4> leans{};
  for (std::size_t k = 0; k < 4; ++k) leans[k] = std::bit_cast<Four>(normals_and_slacks[k]);
  transpose(leans);
  for (std::size_t axis = 0; axis < 3; ++axis) normals[axis] = std::bit_cast<Lanes>(leans[axis]);
  slack = std::bit_cast<Lanes>(leans[3]);
  constexpr float kNowhere = 1e30F;  // a box turned inside out meets nothing
  for (std::size_t k = count; k < 4; ++k)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis].of[k] = kNowhere;
      high[axis].of[k] = -kNowhere;
    }
}

void FourTriangles::set(std::size_t k, const SourceCluster& cluster, LatticePoint origin) noexcept {
  clusters |= 1U << k;
  reach.of[k] = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    low[axis].of[k] = static_cast<float>(cluster.centre[axis] - cluster.half[axis] - origin[axis]);
    high[axis].of[k] = static_cast<float>(cluster.centre[axis] + cluster.half[axis] - origin[axis]);
    reach.of[k] = std::max({reach.of[k], -low[axis].of[k], high[axis].of[k]});
  }
}

QuickShape::QuickShape(const SlabShape& shape, LatticePoint origin) noexcept {
  const Vec3d o = to_double(origin);
  for (std::size_t k = 0; k < SlabShape::kPlanes; ++k) {
    for (std::size_t axis = 0; axis < 3; ++axis) normals_[axis][k] = static_cast<float>(shape.normals_[axis][k]);
    limits_[k] = static_cast<float>(shape.limits_[k] - dot(shape.plane(k), o));
  }
  for (std::size_t side = 0; side < 2; ++side)
    levels_[side] = static_cast<float>(shape.levels_[side] - dot(shape.plane(side), o));
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t axis = 0; axis < 3; ++axis) fibres_[k][axis] = static_cast<float>(shape.fibres_[k][axis]);
    lengths_[k] = static_cast<float>(shape.lengths_[k]);
    // Below 2^26 floats are off by two at most, at either side of the comparison.
    low_[k] = static_cast<float>(shape.box_.low[k] - o[k] - kClearance - 6);
    high_[k] = static_cast<float>(shape.box_.high[k] - o[k] + kClearance + 6);
    reach_ = std::max({reach_, -low_[k], high_[k]});
  }
}

unsigned QuickShape::near(const FourTriangles& t) const noexcept {
  return bits_of((t.low[0].all() <= high_[0]) & (t.high[0].all() >= low_[0]) & (t.low[1].all() <= high_[1]) &
                 (t.high[1].all() >= low_[1]) & (t.low[2].all() <= high_[2]) & (t.high[2].all() >= low_[2]));
}

unsigned QuickShape::near_boxes(const FourTriangles& t) const noexcept {
  const Four margin = margin_for(t.reach.all());
  unsigned left = near(t);
  for (std::size_t k = 0; k < SlabShape::kPlanes && left != 0; ++k) {
    // Of the corner that lies farthest down.
    Four height{};
    for (std::size_t axis = 0; axis < 3; ++axis)
      height += normals_[axis][k] * (normals_[axis][k] > 0 ? t.low[axis] : t.high[axis]).all();
    left &= ~bits_of(height > limits_[k] + margin);
  }
  return left;
}

unsigned QuickShape::crossed(const FourTriangles& t) const noexcept {
  auto doubtful = t.slack.all() < 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Four lean =
        t.normals[0].all() * fibres_[k][0] + t.normals[1].all() * fibres_[k][1] + t.normals[2].all() * fibres_[k][2];
    doubtful |= lean <= (t.slack.all() + kFloatSlack) * lengths_[k];
  }
  return ~bits_of(doubtful) & 15U;
}

QuickShape::Verdict QuickShape::meet(const FourTriangles& t) const noexcept {
  const unsigned in_box = near(t), triangles = in_box & ~t.clusters;
  const unsigned kept_clusters = in_box == triangles ? 0 : near_boxes(t) & t.clusters;
  const Four margin = margin_for(t.reach.all());
  auto apart = margin < 0;
  auto doubtful = apart;
  for (std::size_t k = 0; k < SlabShape::kPlanes; ++k) {
    if (k % 2 == 0 && (triangles & ~bits_of(apart)) == 0) return {kept_clusters, 0};
    const auto height = [&](std::size_t corner) {
      return t.corners[corner][0].all() * normals_[0][k] + t.corners[corner][1].all() * normals_[1][k] +
             t.corners[corner][2].all() * normals_[2][k];
    };
    const Four a = height(0), b = height(1), c = height(2);
    apart |= least(least(a, b), c) > limits_[k] + margin;
    if (k < 2) doubtful |= greatest(greatest(a, b), c) >= levels_[k] - margin;
  }
  const unsigned kept = triangles & ~bits_of(apart);
  return {kept | kept_clusters, kept & ~bits_of(doubtful) & crossed(t)};
}

}  // namespace relief::detail
