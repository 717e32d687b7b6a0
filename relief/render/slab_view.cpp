#include "slab_view.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace relief::detail {

namespace {

/// Pixels around a slab's bounds that its triangles may colour: samples beside the middle of a pixel, and roundings of
/// positions and of the driver's sub-pixels.
constexpr double kBeside = 3;

}  // namespace

PixelRect SlabView::pixels_of(const Box3d& box) const {
  const Vec3d middle = box.centre() - eye_.at, half = box.extent() * 0.5;
  const auto reach = [&](Vec3d axis) {
    return std::abs(axis.x) * half.x + std::abs(axis.y) * half.y + std::abs(axis.z) * half.z;
  };
  const double away = dot(middle, eye_.forward), thick = reach(eye_.forward);
  if (away + thick < eye_.near || away - thick > eye_.far) return {};
  double left = -1, right = 1, low = -1, high = 1;  // in half pictures from the middle
  const double nearest = eye_.parallel ? 1 : away - thick;
  if (nearest > 0.5 * eye_.near || eye_.parallel) {
    left = low = Box3d::kFar;
    right = high = -Box3d::kFar;
    for (unsigned k = 0; k < 8; ++k) {
      const Vec3d p = middle + Vec3d{(k & 1U) != 0 ? half.x : -half.x, (k & 2U) != 0 ? half.y : -half.y,
                                     (k & 4U) != 0 ? half.z : -half.z};
      const double share = eye_.parallel ? 1 : 1 / dot(p, eye_.forward);
      const double x = dot(p, eye_.right) * share / eye_.tan_x, y = dot(p, eye_.up) * share / eye_.tan_y;
      left = std::min(left, x);
      right = std::max(right, x);
      low = std::min(low, y);
      high = std::max(high, y);
    }
  }
  const auto pixel = [](double share, int size) { return std::clamp((share * 0.5 + 0.5) * size, -1e6, 1e6); };
  const int x0 = std::max(0, static_cast<int>(std::floor(pixel(left, width_) - kBeside))),
            x1 = std::min(width_, static_cast<int>(std::ceil(pixel(right, width_) + kBeside))),
            y0 = std::max(0, static_cast<int>(std::floor(pixel(-high, height_) - kBeside))),
            y1 = std::min(height_, static_cast<int>(std::ceil(pixel(-low, height_) + kBeside)));
  if (x0 >= x1 || y0 >= y1) return {};
  return {x0, y0, x1 - x0, y1 - y0};
}

SlabView::Place SlabView::find(const DisplayCache& cache, SlabId s) const {
  const DisplayCache::SlabState& slab = cache.slabs()[s];
  Place place{pixels_of(slab.box), true};
  place.seen = !place.pixels.empty();
  if (!place.seen) return place;
  const Vec3d middle = slab.box.centre() - eye_.at, half = slab.box.extent() * 0.5;
  if (!cache.closed() || !(slab.cosine > 0)) return place;
  // All normals are within `wide` of the axis, and all ways from the eye to the box within `spread` of that to its
  // middle: then all triangles face away where the axis is farther than both from a right angle.
  const double wide = std::acos(std::min(1.0, static_cast<double>(slab.cosine))), distance = length(middle);
  const double size = length(half),
               axis_along =
                   dot(to_double(slab.axis), eye_.parallel ? eye_.forward : middle * (1 / std::max(distance, 1e-300)));
  const double spread = eye_.parallel ? 0 : distance > size ? std::asin(size / distance) : 2;
  constexpr double kSlack = 1e-3, kRightAngle = 1.5707963267948966;
  place.seen = std::acos(std::clamp(axis_along, -1.0, 1.0)) + wide + spread + kSlack > kRightAngle;
  return place;
}

void SlabView::look(const DisplayCache& cache, const Eye& eye, int width, int height) {
  eye_ = eye;
  width_ = width;
  height_ = height;
  slabs_.resize(cache.slabs().size());
  for (SlabId s = 0; s < slabs_.size(); ++s) slabs_[s] = find(cache, s);
}

void SlabView::update(const DisplayCache& cache, SlabId s) {
  slabs_.resize(cache.slabs().size());
  slabs_[s] = find(cache, s);
}

std::vector<std::uint8_t> choose_levels(const SlabMesh& mesh, Vec3d centre, const Eye& eye, int height, double tau) {
  std::vector<std::uint8_t> levels(mesh.slab_count(), 0);
  if (!(tau > 0)) return levels;
  for (SlabId s = 0; s < levels.size(); ++s) {
    const SlabCorners corners = mesh.corners(s);
    std::array<Vec3d, 3> middle;
    double nearest = Box3d::kFar;
    for (std::size_t k = 0; k < 3; ++k) {
      middle[k] = (corners.inner[k] + corners.outer[k]) * 0.5;
      nearest = std::min(nearest, dot(middle[k] - centre - eye.at, eye.forward));
    }
    // The height of an equilateral triangle of the same area.
    constexpr double kHeight = 1.3160740129524924;  // the fourth root of 3, of the root of the area
    const double across = kHeight * std::sqrt(0.5 * length(cross(middle[1] - middle[0], middle[2] - middle[0])));
    const double pixels = 0.5 * height / (eye.tan_y * (eye.parallel ? 1 : std::max(nearest, eye.near)));
    const int n = mesh.intervals(s);
    const double spacing = across * pixels / n;
    const int most = std::countr_zero(static_cast<unsigned>(n));
    while (levels[s] < most && std::ldexp(spacing, levels[s] + 1) <= tau) ++levels[s];
  }
  return levels;
}

PixelRect united(const PixelRect& a, const PixelRect& b) noexcept {
  if (a.empty()) return b;
  if (b.empty()) return a;
  const int x = std::min(a.x, b.x), y = std::min(a.y, b.y);
  return {x, y, std::max(a.x + a.width, b.x + b.width) - x, std::max(a.y + a.height, b.y + b.height) - y};
}

bool meet(const PixelRect& a, const PixelRect& b) noexcept {
  return !a.empty() && !b.empty() && a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height &&
         b.y < a.y + a.height;
}

}  // namespace relief::detail
