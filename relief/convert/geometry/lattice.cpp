#include <relief/convert/geometry/lattice.h>

#include <algorithm>
#include <cmath>
#include <tuple>

namespace relief::detail {
namespace {

// Coordinates are at most 2^25 apart, so components of cross products stay below 2^51 and are exact in double and
// int64. A determinant stays below 2^78; its sum of three rounded products is off by less than 2^28.
constexpr double kCertain = 1073741824.0;  // 2^30

__extension__ using Wide = __int128;
__extension__ using UnsignedWide = unsigned __int128;

using Long = Vec3<std::int64_t>;

constexpr Long widen(LatticePoint a) noexcept { return {a.x, a.y, a.z}; }

constexpr Wide wide_dot(Long a, Long b) noexcept { return Wide{a.x} * b.x + Wide{a.y} * b.y + Wide{a.z} * b.z; }

constexpr int sign(Wide v) noexcept { return v > 0 ? 1 : v < 0 ? -1 : 0; }

int determinant_sign(Long a, Long b, Long c) noexcept {
  const Long n = cross(a, b);
  const double estimate = double(n.x) * double(c.x) + double(n.y) * double(c.y) + double(n.z) * double(c.z);
  if (estimate > kCertain) return 1;
  if (estimate < -kCertain) return -1;
  return sign(wide_dot(n, c));
}

// a * a < b * c for b, c > 0, with products of up to 160 bits.
bool square_below_product(Wide a, Wide b, Wide c) noexcept {
  struct Product {
    UnsignedWide high, low;
  };
  const auto multiply = [](UnsignedWide x, UnsignedWide y) {
    constexpr UnsignedWide kLow = ~std::uint64_t{0};
    const UnsignedWide x0 = x & kLow, x1 = x >> 64U, y0 = y & kLow, y1 = y >> 64U;
    const UnsignedWide p00 = x0 * y0, p01 = x0 * y1, p10 = x1 * y0, p11 = x1 * y1;
    const UnsignedWide middle = (p00 >> 64U) + (p01 & kLow) + (p10 & kLow);
    return Product{p11 + (p01 >> 64U) + (p10 >> 64U) + (middle >> 64U), (middle << 64U) | (p00 & kLow)};
  };
  const auto magnitude = static_cast<UnsignedWide>(a < 0 ? -a : a);
  const Product left = multiply(magnitude, magnitude);
  const Product right = multiply(static_cast<UnsignedWide>(b), static_cast<UnsignedWide>(c));
  return left.high != right.high ? left.high < right.high : left.low < right.low;
}

using Flat = std::array<std::int64_t, 2>;

int turn(Flat a, Flat b, Flat c) noexcept {
  return sign(Wide{b[0] - a[0]} * (c[1] - a[1]) - Wide{b[1] - a[1]} * (c[0] - a[0]));
}

bool between(Flat a, Flat b, Flat p) noexcept {
  return std::min(a[0], b[0]) <= p[0] && p[0] <= std::max(a[0], b[0]) && std::min(a[1], b[1]) <= p[1] &&
         p[1] <= std::max(a[1], b[1]);
}

bool segments_meet(Flat a, Flat b, Flat c, Flat d) noexcept {
  const int abc = turn(a, b, c), abd = turn(a, b, d), cda = turn(c, d, a), cdb = turn(c, d, b);
  if (abc * abd < 0 && cda * cdb < 0) return true;
  return (abc == 0 && between(a, b, c)) || (abd == 0 && between(a, b, d)) || (cda == 0 && between(c, d, a)) ||
         (cdb == 0 && between(c, d, b));
}

bool in_triangle(const std::array<Flat, 3>& t, Flat p) noexcept {
  const int s0 = turn(t[0], t[1], p), s1 = turn(t[1], t[2], p), s2 = turn(t[2], t[0], p);
  return (s0 >= 0 && s1 >= 0 && s2 >= 0) || (s0 <= 0 && s1 <= 0 && s2 <= 0);
}

// The two coordinates that remain when the largest component of the normal is left out.
Flat flatten(LatticePoint p, int drop) noexcept {
  return drop == 0 ? Flat{p.y, p.z} : drop == 1 ? Flat{p.z, p.x} : Flat{p.x, p.y};
}

int dominant_axis(const LatticeTriangle& t) noexcept {
  const Long n = cross(widen(t[1] - t[0]), widen(t[2] - t[0]));
  const std::int64_t x = std::abs(n.x), y = std::abs(n.y), z = std::abs(n.z);
  return x >= y && x >= z ? 0 : y >= z ? 1 : 2;
}

std::array<Flat, 3> flatten(const LatticeTriangle& t, int drop) noexcept {
  return {flatten(t[0], drop), flatten(t[1], drop), flatten(t[2], drop)};
}

bool coplanar_triangles_meet(const LatticeTriangle& a, const LatticeTriangle& b) noexcept {
  const int drop = dominant_axis(a);
  const auto fa = flatten(a, drop), fb = flatten(b, drop);
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      if (segments_meet(fa[i], fa[(i + 1) % 3], fb[j], fb[(j + 1) % 3])) return true;
  return in_triangle(fa, fb[0]) || in_triangle(fb, fa[0]);
}

// p and q with the sides of t's plane on which they lie; both in the plane is handled in the plane.
bool segment_meets(LatticePoint p, LatticePoint q, int sp, int sq, const LatticeTriangle& t) noexcept {
  if (sp * sq > 0) return false;
  if (sp == 0 && sq == 0) {
    const int drop = dominant_axis(t);
    const auto ft = flatten(t, drop);
    const Flat fp = flatten(p, drop), fq = flatten(q, drop);
    for (std::size_t i = 0; i < 3; ++i)
      if (segments_meet(fp, fq, ft[i], ft[(i + 1) % 3])) return true;
    return in_triangle(ft, fp);
  }
  const int s0 = orientation(p, q, t[0], t[1]), s1 = orientation(p, q, t[1], t[2]), s2 = orientation(p, q, t[2], t[0]);
  return !((s0 > 0 || s1 > 0 || s2 > 0) && (s0 < 0 || s1 < 0 || s2 < 0));
}

}  // namespace

Lattice Lattice::around(const Box3d& box, double room) noexcept {
  const Vec3d extent = box.extent();
  const double widest = std::max({extent.x, extent.y, extent.z}) + 2 * room;
  double farthest = 0;
  for (std::size_t k = 0; k < 3; ++k) farthest = std::max({farthest, std::abs(box.low[k]), std::abs(box.high[k])});
  // Two steps are lost to rounding the origin down.
  int exponent = 0;
  std::frexp(widest / (kSpan - 4), &exponent);
  int coarsest = 0;
  std::frexp(farthest + room, &coarsest);
  Lattice lattice;
  lattice.step = std::ldexp(1.0, std::max({exponent, coarsest - 52, -1000}));
  for (std::size_t k = 0; k < 3; ++k)
    lattice.origin[k] = (std::floor((box.low[k] - room) / lattice.step) - 1) * lattice.step;
  return lattice;
}

LatticePoint snap(Vec3d p) noexcept {
  const auto round = [](double v) {
    return static_cast<std::int32_t>(std::floor(std::clamp(v, 0.0, Lattice::kSpan) + 0.5));
  };
  return {round(p.x), round(p.y), round(p.z)};
}

int determinant_sign(LatticePoint a, LatticePoint b, LatticePoint c) noexcept {
  return determinant_sign(widen(a), widen(b), widen(c));
}

int orientation(LatticePoint a, LatticePoint b, LatticePoint c, LatticePoint d) noexcept {
  return determinant_sign(b - a, c - a, d - a);
}

bool triangles_meet(const LatticeTriangle& a, const LatticeTriangle& b) noexcept {
  std::array<int, 3> sb{}, sa{};
  for (std::size_t k = 0; k < 3; ++k) sb[k] = orientation(a[0], a[1], a[2], b[k]);
  if ((sb[0] > 0 && sb[1] > 0 && sb[2] > 0) || (sb[0] < 0 && sb[1] < 0 && sb[2] < 0)) return false;
  for (std::size_t k = 0; k < 3; ++k) sa[k] = orientation(b[0], b[1], b[2], a[k]);
  if ((sa[0] > 0 && sa[1] > 0 && sa[2] > 0) || (sa[0] < 0 && sa[1] < 0 && sa[2] < 0)) return false;
  if (sb[0] == 0 && sb[1] == 0 && sb[2] == 0) return coplanar_triangles_meet(a, b);
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t next = (k + 1) % 3;
    if (segment_meets(b[k], b[next], sb[k], sb[next], a) || segment_meets(a[k], a[next], sa[k], sa[next], b))
      return true;
  }
  return false;
}

JacobianFault jacobian_fault(const LatticeTriangle& inner, const LatticeTriangle& outer) noexcept {
  const Long e_in = widen(inner[1] - inner[0]), g_in = widen(inner[2] - inner[0]);
  const Long e_out = widen(outer[1] - outer[0]), g_out = widen(outer[2] - outer[0]);
  const Long n_in = cross(e_in, g_in), n_out = cross(e_out, g_out);
  const Long n_mid = cross(e_in, g_out) + cross(e_out, g_in);
  for (std::size_t k = 0; k < 3; ++k) {
    const Long d = widen(outer[k] - inner[k]);
    const Wide c0 = wide_dot(n_in, d);
    if (c0 <= 0) return JacobianFault::Inner;
    const Wide c2 = wide_dot(n_out, d);
    if (c2 <= 0) return JacobianFault::Outer;
    const Wide c1 = wide_dot(n_mid, d);  // twice the middle coefficient
    if (c1 < 0 && !square_below_product(c1, 4 * c0, c2)) return JacobianFault::Between;
  }
  return JacobianFault::None;
}

bool in_hull(const LatticeTriangle& inner, const LatticeTriangle& outer, LatticePoint p) noexcept {
  const std::array<LatticePoint, 6> q = {inner[0], inner[1], inner[2], outer[0], outer[1], outer[2]};
  // Beyond the plane of the inner or the outer triangle, when all other corners are on its near side.
  for (const auto& [t, other, beyond] : {std::tuple{&inner, &outer, -1}, std::tuple{&outer, &inner, 1}}) {
    const LatticeTriangle& base = *t;
    const int sense = beyond;
    const auto side = [&](LatticePoint x) { return sense * orientation(base[0], base[1], base[2], x); };
    if (side(p) > 0 && side((*other)[0]) <= 0 && side((*other)[1]) <= 0 && side((*other)[2]) <= 0) return false;
  }
  // A point of the hull lies in one of the tetrahedra over four of its points.
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t b = a + 1; b < 4; ++b)
      for (std::size_t c = b + 1; c < 5; ++c)
        for (std::size_t d = c + 1; d < 6; ++d) {
          const int all = orientation(q[a], q[b], q[c], q[d]);
          if (all == 0) continue;
          if (all * orientation(q[a], q[b], q[c], p) >= 0 && all * orientation(q[a], q[c], q[d], p) >= 0 &&
              all * orientation(q[a], q[d], q[b], p) >= 0 && all * orientation(q[b], q[d], q[c], p) >= 0)
            return true;
        }
  return false;
}

}  // namespace relief::detail
