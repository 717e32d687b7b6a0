// A hand that leaps through rough models, as none does and a broken sensor may.
#pragma once

#include "support/shells.h"

#include <relief/core/query.h>

#include <cmath>
#include <random>
#include <vector>

namespace relief::testing {

/// A torus that is rough to the last triangle, and cusps with creases between them. With n = 128 a million and a half
/// triangles, and half a million.
inline std::vector<SnapshotPtr> rough_models(int n) {
  const auto noise = [](Vec3d p) {
    const double any = 4e4 * std::sin(1e4 * p.x + 3e4 * p.y + 7e4 * p.z);
    return any - std::floor(any) - 0.5;
  };
  return {displaced(torus_shell(8, 6, n),
                    [=](Vec3d p) {
                      return 0.5 + 0.25 * std::sin(9 * p.x) * std::cos(8 * p.z) + 0.1 * std::sin(21 * p.y) +
                             0.02 * noise(p);
                    }),
          displaced(sphere_shell(2, n / 2, 0.3, 1.2), [=](Vec3d p) {
            return 0.5 + 0.45 * std::sin(40 * std::atan2(p.x, p.z)) * std::sin(25 * p.y) + 0.02 * noise(p);
          })};
}

/// Leaps through a model: to beside its surface, and from one corner of its box to another.
class Leaps {
 public:
  explicit Leaps(const Snapshot& model) : model_(model), size_(diagonal(bounds_of_surface(model))) {}
  Vec3d next() {
    const Vec3d centre = bounds_of_surface(model_).centre(), any = {unit_(random_), unit_(random_), unit_(random_)};
    if (++count_ % 5 == 0) return centre + normalized(any) * (0.55 * size_);
    const SurfacePoint near = closest_point(model_, centre + any * (0.4 * size_));
    return near.position + near.normal * (0.01 * size_ * unit_(random_));
  }

 private:
  const Snapshot& model_;
  double size_;
  int count_ = 0;
  std::mt19937 random_{16};
  std::uniform_real_distribution<double> unit_{-1, 1};
};

}  // namespace relief::testing
