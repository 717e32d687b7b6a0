// The micro-triangles around a place, found once and then asked about from many places near it.
#pragma once

#include <relief/base/lanes.h>
#include <relief/core/near_surface.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

namespace relief::detail {

/// A list of the triangles that come within a reach of a place. Those that are nearer to another place than a distance
/// are in it as long as covers(). Cost of a look at it: two nanoseconds a triangle, and what is done with those that
/// may be near.
class Neighbourhood {
 public:
  /// Makes the list anew, with a reach from `least` to `most`: the more triangles there were in the last one, the less
  /// far. Where there is no room for those within `least`, it covers nothing. `flat`: see visit_near().
  void gather(MicroTriangles& surface, Vec3d centre, double least, double most, double flat) noexcept {
    count_ = 0;
    centre_ = centre;
    reach_ = least + (most - least) * share_;
    scale_ = 1 / reach_;
    double reach2 = reach_ * reach_;
    gather_near(surface, centre, flat, reach2, [&](SlabId slab, const auto& corners, const auto& p) noexcept {
      if (count_ == kMost && reach2 > 0) reach2 = drop_far(least, most);
      if (reach2 > 0) add(slab, corners, p);
    });
    // The last four are filled up with what is never near.
    for (std::size_t k = count_; k % kLanes != 0; ++k) bounds_[k / kLanes].set(k % kLanes, {3, 0, 0}, {1, 0, 0}, 0);
    if (count_ > kEnough) share_ = std::max(0.8 * share_, kLeastShare);
    if (count_ < kEnough / 2) share_ = std::min(1.25 * share_, 1.0);
  }
  void forget() noexcept {
    reach_ = 0;
    share_ = kShare;
  }
  /// What part of the difference between the least and the most reach the next list will have at most.
  [[nodiscard]] double share() const noexcept { return share_; }

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
  static constexpr std::size_t kMost = 512, kEnough = 260;
  static constexpr double kShare = 0.5, kLeastShare = 0.02;  // of the room between the reaches: at first, and at last
  static constexpr float kSlack = 1e-5F;                     // of the reach squared: above what floats round

  struct Triangle {
    SlabId slab;
    std::array<GridPoint, 3> corners;
    std::array<Vec3d, 3> places;  ///< relative to the centre
  };
  /// Four triangles in discs: middle, unit normal and squared radius; relative to the centre, in reaches.
  struct Discs {
    Lanes x, y, z, nx, ny, nz, radius2;

    void set(std::size_t lane, Vec3d middle, Vec3d normal, double r2) noexcept {
      const Vec3f m = to_float(middle), n = to_float(normal);
      x.of[lane] = m.x, y.of[lane] = m.y, z.of[lane] = m.z;
      nx.of[lane] = n.x, ny.of[lane] = n.y, nz.of[lane] = n.z;
      radius2.of[lane] = static_cast<float>(r2);
    }
  };

  /// A bit for each of the four that is not known to be farther off. The distance from a disc is at least the height
  /// over its plane, and where the foot is outside, at least that and the way from the rim.
  [[nodiscard]] static unsigned may_be_near(const Discs& d, Vec3f at, float most2) noexcept {
    const Four x = d.x.all() - at.x, y = d.y.all() - at.y, z = d.z.all() - at.z, r2 = d.radius2.all();
    const Four far2 = x * x + y * y + z * z, height = x * d.nx.all() + y * d.ny.all() + z * d.nz.all();
    const Four height2 = height * height, aside2 = far2 - height2, over = far2 + r2 - most2;
    const FourMask far =
        (height2 > most2) | ((aside2 > r2 + kSlack) & (over > 0) & (over * over > 4 * r2 * (aside2 + kSlack)));
    return ~bits_of(far) & 15U;
  }

  void add(SlabId slab, const std::array<GridPoint, 3>& corners, const std::array<Vec3d, 3>& p) noexcept {
    const Vec3d middle = (p[0] + p[1] + p[2]) * (1.0 / 3), area = cross(p[1] - p[0], p[2] - p[0]);
    const double area2 = dot(area, area), to_plane = dot(middle, area), far2 = dot(middle, middle);
    const double most2 = reach_ * reach_;
    if (to_plane * to_plane >= most2 * area2 && area2 > 0) return;
    double radius2 = 0;
    for (const Vec3d corner : p) radius2 = std::max(radius2, dot(corner - middle, corner - middle));
    const double over = far2 - most2 - radius2;
    if (over > 0 && over * over > 4 * most2 * radius2) return;
    // One that is larger than the reach counts as always near: floats are too coarse for it.
    Discs& discs = bounds_[count_ / kLanes];
    if (radius2 < most2)
      discs.set(count_ % kLanes, middle * scale_, area2 > 0 ? area / std::sqrt(area2) : Vec3d{},
                radius2 * scale_ * scale_);
    else
      discs.set(count_ % kLanes, {}, {}, 100);
    triangles_[count_++] = {slab, corners, p};
  }
  /// Makes room for more by a shorter reach; its square, or 0 where that is not enough.
  double drop_far(double least, double most) noexcept {
    while (count_ == kMost && share_ > kLeastShare) {
      share_ *= 0.5;
      reach_ = least + (most - least) * share_;
      const std::size_t all = std::exchange(count_, 0);
      for (std::size_t k = 0; k < all; ++k) {
        const Triangle t = triangles_[k];
        add(t.slab, t.corners, t.places);
      }
    }
    if (count_ == kMost) reach_ = 0;
    return reach_ * reach_;
  }

  std::size_t count_ = 0;
  Vec3d centre_;
  double reach_ = 0, scale_ = 0, share_ = kShare;
  std::array<Discs, kMost / kLanes> bounds_;
  std::array<Triangle, kMost> triangles_;
};

}  // namespace relief::detail
