// The one ray query: where a straight way first crosses the tessellated surface.
#include "support/shells.h"

#include <relief/core/sweep.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

namespace relief {
namespace {

using testing::displaced;
using testing::plane_shell;
using testing::torus_shell;

SnapshotPtr bumpy_torus() {
  return displaced(torus_shell(16, 10, 16), [](Vec3d p) {
    return 0.5 + 0.25 * std::sin(9 * p.x) * std::cos(8 * p.z) + 0.1 * std::sin(21 * p.y);
  });
}

TEST(FirstEntry, AgreesWithTheRayOnWhereItGoesIn) {
  const SnapshotPtr model = bumpy_torus();
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(-1, 1);
  int hits = 0, misses = 0;
  for (int k = 0; k < 4000; ++k) {
    const Vec3d from = Vec3d{unit(random), unit(random), unit(random)} * 4.0;
    const double reach = std::pow(10, -2.5 * std::abs(unit(random)));
    Vec3d a = from;
    // From outside: start just above the surface half of the time, so that short ways hit, too.
    if (k % 2 == 0) {
      const SurfacePoint near = closest_point(*model, from);
      a = near.position + near.normal * (0.3 * reach);
    }
    const Vec3d b = a + Vec3d{unit(random), unit(random), unit(random)} * (4 * reach);
    const auto exact = raycast(*model, {a, b - a});
    const auto swept = first_entry(*model, a, b);
    if (exact && exact->distance < 1 && dot(exact->point.normal, b - a) > 0) continue;  // began inside
    const bool hit = exact && exact->distance < 1;
    ASSERT_EQ(hit, swept.has_value()) << k;
    (hit ? hits : misses) += 1;
    if (!hit) continue;
    EXPECT_NEAR(swept->distance, exact->distance, 1e-9);
    EXPECT_LT(length(swept->point.position - exact->point.position), 1e-9);
  }
  EXPECT_GT(hits, 500);
  EXPECT_GT(misses, 500);
}

TEST(FirstEntry, MissesNothingWhereFibresLeanAndNDiffers) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(-1, 1);
  int hits = 0;
  for (int round = 0; round < 36; ++round) {
    // Fibres that flare, and turn about the middle by up to half a right angle from the inner to the outer end.
    const double flare = 2 * std::abs(unit(random)), turn = 2 * unit(random), lean = 0.4 * unit(random);
    const auto bent = testing::mapped_shell(*plane_shell(1 + round % 3, 4, 0.15), [=](Vec3d p) {
      const double x = (p.x - 0.5) * (1 + flare * p.y), z = (p.z - 0.5) * (1 + 2 * flare * p.y), a = turn * p.y;
      return Vec3d{x * std::cos(a) - z * std::sin(a), p.y * (1 + lean * p.x), x * std::sin(a) + z * std::cos(a)};
    });
    const auto mesh = round % 4 == 0   ? testing::mixed_shell(*bent, 1, 6)
                      : round % 4 == 1 ? testing::mixed_shell(*bent, 3, 3)
                                       : testing::mixed_shell(*bent, round % 4 == 2 ? 31 : 64, 0);
    ASSERT_TRUE(mesh);
    // A nearly level sheet, waves, or noise, faint or over all heights.
    const double tilt = 0.3 * unit(random), height = 0.05 * unit(random), waves = 10 + 10 * unit(random);
    const SnapshotPtr model = displaced(mesh, [=](Vec3d p) {
      if (round % 3 == 2) {
        const double any = 4e4 * std::sin(1e4 * p.x + 3e4 * p.y + 7e4 * p.z);
        return 0.5 + (round % 2 == 0 ? 0.9 : 0.05) * (any - std::floor(any) - 0.5);
      }
      return round % 2 == 0 ? 0.5 + 0.3 * std::sin(waves * p.x) * std::cos(waves * p.z)
                            : std::clamp(0.5 + (tilt * p.x + height - p.y) / 0.3, 0.0, 1.0);
    });
    std::vector<std::array<Vec3d, 3>> triangles;
    for (SlabId slab = 0; slab < mesh->slab_count(); ++slab)
      for_each_cell(mesh->intervals(slab), mesh->edge_intervals(slab), [&](const std::array<GridPoint, 3>& cell) {
        triangles.push_back({sample_position(*model, slab, cell[0]), sample_position(*model, slab, cell[1]),
                             sample_position(*model, slab, cell[2])});
      });
    for (int k = 0; k < 150; ++k) {
      const auto& [p, q, r] = triangles[random() % triangles.size()];
      const Vec3d on = (p + q + r) / 3, side = Vec3d{unit(random), 0.3 * unit(random), unit(random)} *
                                               std::pow(10, -2 * std::abs(unit(random)));
      const Vec3d from = on + side, way = side * (-1 - std::abs(unit(random)));
      double first = 2;
      for (const auto& [a, b, c] : triangles) {
        const double wa = dot(way, cross(b - from, c - from)), wb = dot(way, cross(c - from, a - from)),
                     wc = dot(way, cross(a - from, b - from)), sum = wa + wb + wc;
        if (!(wa <= 0 && wb <= 0 && wc <= 0 && sum < 0)) continue;
        const double t = dot(((a - from) * wa + (b - from) * wb + (c - from) * wc) / sum, way) / dot(way, way);
        if (t >= 0) first = std::min(first, t);
      }
      if (first > 1 - 1e-6) continue;
      const auto swept = first_entry(*model, from, from + way);
      ASSERT_TRUE(swept) << "round " << round << " way " << k;
      ASSERT_NEAR(swept->distance, first, 1e-9) << "round " << round << " way " << k;
      ++hits;
    }
  }
  EXPECT_GT(hits, 1500);
}

}  // namespace
}  // namespace relief
