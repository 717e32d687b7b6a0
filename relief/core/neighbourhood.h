// The micro-triangles around a place, found once and then asked about from many places near it.
#pragma once

#include <relief/base/lanes.h>
#include <relief/core/near_surface.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace relief::detail {

/// A list of the triangles that come within a reach of a place. What is nearer to some other place than a distance is
/// in it as long as covers(). Cost of a look at it: two nanoseconds a triangle, and what is done with those that may
/// be near.
class Neighbourhood {
 public:
  static constexpr std::size_t kMost = 1024;

  /// Makes the list anew. Where there are more than kMost it covers nothing. `flat`: see visit_near().
  void gather(MicroTriangles& surface, Vec3d centre, double reach, double flat) noexcept {
    count_ = 0;
    centre_ = centre;
    reach_ = reach;
    scale_ = 1 / reach;
    double reach2 = reach * reach;
    bool fits = true;
    gather_near(surface, centre, flat, reach2, [&](SlabId slab, const auto& corners, const auto& p) noexcept {
      if (!add(slab, corners, p)) fits = false, reach2 = 0;
    });
    if (!fits) reach_ = 0;
    // The last four are filled up with what is never near.
    for (std::size_t k = count_; k % kLanes != 0; ++k) bound(k, {3, 0, 0}, {1, 0, 0}, 0);
  }
  void forget() noexcept { reach_ = 0; }

  [[nodiscard]] bool covers(Vec3d point, double distance) const noexcept {
    return length(point - centre_) + distance <= reach_ * (1 - 1e-9);
  }
  /// As visit_near(), for what is covered.
  template <typename Visit>
  void visit_near(Vec3d point, double& reach2, Visit&& visit) const noexcept {
    const Vec3f at = to_float((point - centre_) * scale_);
    for (std::size_t k = 0; k < count_; k += kLanes) {
      const auto most2 = static_cast<float>(reach2 * scale_ * scale_) + kSlack;
      for (unsigned near = may_be_near(bounds_[k / kLanes], at, most2); near != 0; near &= near - 1) {
        const Triangle& found = triangles_[k + static_cast<std::size_t>(std::countr_zero(near))];
        const Vec3d from = point - centre_;
        const NearTriangle t(found.slab, found.corners,
                             {found.places[0] - from, found.places[1] - from, found.places[2] - from});
        if (t.distance2 < reach2) visit(t);
      }
    }
  }

 private:
  static constexpr std::size_t kLanes = 4;
  static constexpr float kSlack = 1e-5F;  // of the reach squared: above what floats round

  struct Triangle {
    SlabId slab;
    std::array<GridPoint, 3> corners;
    std::array<Vec3d, 3> places;  ///< relative to the centre
  };
  /// Four triangles in discs: middle, unit normal and squared radius, in reaches and relative to the centre.
  struct Discs {
    Lanes x, y, z, nx, ny, nz, radius2;
  };

  /// A bit for each of the four that is not known to be farther off. The distance from a disc is at least the height
  /// over its plane, and where the foot is outside, at least that and the way from the rim.
  [[nodiscard]] static unsigned may_be_near(const Discs& d, Vec3f at, float most2) noexcept {
    const Four x = d.x.all() - at.x, y = d.y.all() - at.y, z = d.z.all() - at.z, r2 = d.radius2.all();
    const Four far2 = x * x + y * y + z * z, height = x * d.nx.all() + y * d.ny.all() + z * d.nz.all();
    const Four height2 = height * height, aside2 = far2 - height2, over = far2 + r2 - most2;
    const FourMask far = (height2 > most2) | ((aside2 > r2 + kSlack) & (over > 0) &
                                              (over * over > 4 * r2 * (aside2 + kSlack)));
    return ~bits_of(far) & 15U;
  }

  void bound(std::size_t k, Vec3d middle, Vec3d normal, double radius2) noexcept {
    Discs& d = bounds_[k / kLanes];
    const std::size_t lane = k % kLanes;
    const Vec3f m = to_float(middle), n = to_float(normal);
    d.x.of[lane] = m.x, d.y.of[lane] = m.y, d.z.of[lane] = m.z;
    d.nx.of[lane] = n.x, d.ny.of[lane] = n.y, d.nz.of[lane] = n.z;
    d.radius2.of[lane] = static_cast<float>(radius2);
  }

  /// False where there is no room.
  [[nodiscard]] bool add(SlabId slab, const std::array<GridPoint, 3>& corners, const std::array<Vec3d, 3>& p) noexcept {
    const Vec3d middle = (p[0] + p[1] + p[2]) * (1.0 / 3), area = cross(p[1] - p[0], p[2] - p[0]);
    const double area2 = dot(area, area), to_plane = dot(middle, area), far2 = dot(middle, middle);
    double radius2 = 0;
    for (const Vec3d corner : p) radius2 = std::max(radius2, dot(corner - middle, corner - middle));
    const double most2 = reach_ * reach_, over = far2 - most2 - radius2;
    const bool past_plane = (to_plane * to_plane >= most2 * area2) & (area2 > 0);
    const bool past_rim = (over > 0) & (over * over > 4 * most2 * radius2);
    if (past_plane | past_rim) return true;
    if (count_ == kMost) return false;
    const bool small = radius2 < reach_ * reach_;
    bound(count_, small ? middle * scale_ : Vec3d{}, small && area2 > 0 ? area / std::sqrt(area2) : Vec3d{},
          small ? radius2 * scale_ * scale_ : 100);
    triangles_[count_++] = {slab, corners, p};
    return true;
  }

  std::size_t count_ = 0;
  Vec3d centre_;
  double reach_ = 0, scale_ = 0;
  std::array<Discs, kMost / kLanes> bounds_;
  std::array<Triangle, kMost> triangles_;
};

}  // namespace relief::detail
