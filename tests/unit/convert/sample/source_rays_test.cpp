// Where lines cross the source.
#include <relief/convert/sample/source_rays.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace relief {
namespace {

// The search runs in float; within a few steps of an edge it may give the face beside the one that is crossed.
TEST(SourceRays, NextToASteepEdgeTheFaceThatIsCrossedIsMet) {
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
  const detail::SourceRays surface(points, faces, {});
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

// Through a folded sheet, many of them through its edges and corners, where the search may give either face.
TEST(SourceRays, LinesCastTogetherMeetWhatEachMeetsAlone) {
  constexpr std::uint32_t kCells = 40;
  constexpr double kCell = 500'000, kHeight = 10'000'000;
  std::vector<Vec3d> points;
  std::vector<detail::Face> faces;
  for (std::uint32_t j = 0; j <= kCells; ++j)
    for (std::uint32_t i = 0; i <= kCells; ++i)
      points.push_back({i * kCell, j * kCell, kHeight + std::round(3e6 * std::sin(0.7 * i) * std::cos(0.4 * j))});
  for (std::uint32_t j = 0; j < kCells; ++j)
    for (std::uint32_t i = 0; i < kCells; ++i) {
      const std::uint32_t v = j * (kCells + 1) + i;
      faces.push_back({v, v + 1, v + kCells + 2});
      faces.push_back({v, v + kCells + 2, v + kCells + 1});
    }
  const detail::SourceRays surface(points, faces, {});
  std::mt19937 random(7);
  std::uniform_real_distribution<double> across(-kCell, (kCells + 1) * kCell), lean(-2e7, 2e7);
  std::uniform_int_distribution<std::size_t> corner(0, points.size() - 1), count(1, detail::SourceRays::kTogether);
  std::size_t crossings = 0, often = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    std::vector<detail::Line> lines(count(random));
    const Vec3d along = {lean(random), lean(random), 2e7};
    for (std::size_t k = 0; k < lines.size(); ++k) {
      const Vec3d at = k % 3 == 0   ? points[corner(random)]
                       : k % 3 == 1 ? (points[corner(random)] + points[corner(random)]) * 0.5
                                    : Vec3d{across(random), across(random), kHeight};
      lines[k] = {at - along * 0.5, k == 4 ? Vec3d{} : along};
    }
    std::array<detail::Crossings, detail::SourceRays::kTogether> together;
    surface.cross(lines, 0, 1, together);
    for (std::size_t k = 0; k < lines.size(); ++k) {
      detail::Crossings alone;
      surface.cross(lines[k].origin, lines[k].direction, 0, 1, alone);
      ASSERT_EQ(together[k].count, alone.count);
      for (std::size_t c = 0; c < alone.count; ++c) {
        EXPECT_EQ(together[k].items[c].triangle, alone.items[c].triangle);
        EXPECT_EQ(together[k].items[c].t, alone.items[c].t);
      }
      crossings += alone.count;
      often += alone.count > 1;
    }
  }
  EXPECT_GT(crossings, 10'000U);
  EXPECT_GT(often, 1000U);
}

TEST(SourceRays, AtTheRimOfAThinLensTheFaceThatIsCrossedIsMet) {
  // A line along it may miss the face that the search finds by a step, and meet its plane thousands of steps away.
  constexpr std::uint32_t kAround = 7;
  constexpr double kRadius = 8'000'000;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> off(-3, 3), turn(0, 2 * std::numbers::pi), apart(0.7, 1);
  for (int lens = 0; lens < 200; ++lens) {
    std::vector<Vec3d> points = {{0, 0, 5e-4 * kRadius}, {0, 0, -5e-4 * kRadius}};
    std::vector<detail::Face> faces;
    for (std::uint32_t k = 0; k < kAround; ++k) {
      const double a = 2 * std::numbers::pi * (k + 0.3 * apart(random)) / kAround, r = kRadius * apart(random);
      points.push_back({std::round(r * std::cos(a)), std::round(r * std::sin(a)), std::round(off(random))});
      const std::uint32_t here = 2 + k, next = 2 + (k + 1) % kAround;
      faces.push_back({0, here, next});
      faces.push_back({1, next, here});
    }
    const detail::SourceRays surface(points, faces, {});
    for (std::uint32_t k = 2; k < points.size(); ++k) {
      const Vec3d beside = {off(random), off(random), off(random)};
      const Vec3d from = points[k] * 1.2 + beside, along = points[k] * -0.9;
      // Where the line enters the cone from the tip to both middles, which is the lens there.
      double entry = -Box3d::kFar;
      for (const detail::Face& f : faces) {
        if (std::ranges::find(f, k) == f.end()) continue;
        const Vec3d n = cross(points[f[1]] - points[f[0]], points[f[2]] - points[f[0]]);
        if (dot(n, along) < 0) entry = std::max(entry, dot(n, points[f[0]] - from) / dot(n, along));
      }
      detail::Crossings found;
      surface.cross(from, along, 0, 1, found);
      ASSERT_EQ(found.count, 1U);
      EXPECT_NEAR(found.items[0].t * length(along), entry * length(along), 4) << "lens " << lens << " tip " << k;
    }
  }
}

}  // namespace
}  // namespace relief
