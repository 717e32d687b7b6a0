// Where lines cross the source.
#include <relief/convert/source_surface.h>

#include <gtest/gtest.h>

#include <array>
#include <random>
#include <vector>

namespace relief {
namespace {

// The search runs in float; within a few steps of an edge it may give the face beside the one that is crossed.
TEST(SourceSurface, NextToASteepEdgeTheFaceThatIsCrossedIsMet) {
  constexpr double kEdge = 20'000'001, kSteep = 40, kBase = 9'000'000;
  std::vector<Vec3d> points;  // a flat ground, from an edge askew on a steep slope
  const std::vector<detail::Face> faces = {{0, 1, 2}, {0, 2, 3}, {1, 4, 5}, {1, 5, 2}};
  const auto height = [&](Vec3d p) {
    const double beyond = p.x - kEdge - 0.37 * (p.y - 12'345'677);
    return kBase + (beyond > 0 ? kSteep * beyond : 0);
  };
  const auto add = [&](double across, double y) {
    const Vec3d p = {kEdge + 0.37 * (y - 12'345'677) + across, y, 0};
    points.push_back({p.x, p.y, height(p)});
  };
  for (const auto& [across, y] : std::vector<std::pair<double, double>>{{-90'001, 12'300'003},
                                                                        {0, 12'300'003},
                                                                        {0, 12'400'007},
                                                                        {-90'001, 12'400'007},
                                                                        {90'001, 12'300'003},
                                                                        {90'001, 12'400'007}})
    add(across, y);
  const detail::SourceSurface surface(points, faces, {});
  std::mt19937 random(3);
  std::uniform_real_distribution<double> off(-4, 4), along(12'310'000, 12'390'000);
  for (int trial = 0; trial < 20'000; ++trial) {
    const double y = along(random);
    const Vec3d from = {kEdge + 0.37 * (y - 12'345'677) + off(random), y, kBase - 1'000'000};
    detail::Crossings found;
    surface.cross(from, {0, 0, 2'000'000}, 0, 1, found);
    ASSERT_EQ(found.count, 1U);
    EXPECT_NEAR(from.z + found.items[0].t * 2'000'000, height(from), 0.01);
  }
}

}  // namespace
}  // namespace relief
