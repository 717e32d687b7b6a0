#include <relief/convert/geometry/visibility.h>

#include <algorithm>

namespace relief::detail {
namespace {

/// Tolerance for cosines of unit normals: a normal on the cap's edge counts as inside.
constexpr double kRounding = 1e-12;
/// Twice the area between three normals below which they lie in one great circle, or two are alike.
constexpr double kStraight = 1e-14;

double least_dot(std::span<const Vec3d> normals, Vec3d d) noexcept {
  double least = 1;
  for (const Vec3d n : normals) least = std::min(least, dot(n, d));
  return least;
}

// A cap on the unit sphere: its centre and the cosine of its radius.
struct Cap {
  Vec3d centre;
  double cosine = 1;
  [[nodiscard]] bool holds(Vec3d n) const noexcept { return dot(n, centre) >= cosine - kRounding; }
};

Cap cap_of(Vec3d a, Vec3d b) noexcept {
  const Vec3d centre = normalized(a + b);
  return {centre, std::min(dot(a, centre), dot(b, centre))};
}

Cap cap_of(Vec3d a, Vec3d b, Vec3d c) noexcept {
  Vec3d centre = cross(a - c, b - c);
  const double size = length(centre);
  if (size < kStraight) {
    // Three normals in one great circle or two alike: the widest pair decides.
    Cap widest = cap_of(a, b);
    for (const Cap other : {cap_of(b, c), cap_of(c, a)})
      if (other.cosine < widest.cosine) widest = other;
    return widest;
  }
  centre = centre / size;
  if (dot(centre, a + b + c) < 0) centre = -centre;
  return {centre, std::min({dot(a, centre), dot(b, centre), dot(c, centre)})};
}

}  // namespace

Direction best_direction(std::span<const Vec3d> normals) noexcept {
  if (normals.empty()) return {};
  Vec3d sum{};
  for (const Vec3d n : normals) sum += n;
  const Vec3d mean = normalized(sum);
  Direction best{mean, least_dot(normals, mean)};
  // The smallest enclosing cap, built up one normal at a time.
  Cap cap{normals[0], 1};
  for (std::size_t i = 1; i < normals.size(); ++i) {
    if (cap.holds(normals[i])) continue;
    cap = {normals[i], 1};
    for (std::size_t j = 0; j < i; ++j) {
      if (cap.holds(normals[j])) continue;
      cap = cap_of(normals[i], normals[j]);
      for (std::size_t k = 0; k < j; ++k)
        if (!cap.holds(normals[k])) cap = cap_of(normals[i], normals[j], normals[k]);
    }
  }
  const double visibility = least_dot(normals, cap.centre);
  if (visibility > best.visibility) best = {cap.centre, visibility};
  return best;
}

}  // namespace relief::detail
