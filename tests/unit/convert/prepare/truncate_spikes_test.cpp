#include "../certified.h"
#include "../shapes.h"
#include "closed_source.h"
#include "support/blocks.h"

#include <relief/base/triangle.h>
#include <relief/convert/geometry/visibility.h>
#include <relief/convert/prepare/hole_filling.h>
#include <relief/convert/prepare/truncate_spikes.h>
#include <relief/mesh/repair.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace relief {
namespace {

using namespace detail;

TEST(TruncateSpikes, VoxelSolidsStandWhereNoDirectionSeesThem) {
  // Solids of several cubes have corners whose faces look every way; where two cubes of one solid touch along an edge
  // or in a corner, its sheets lie on each other there.
  std::mt19937 random(5);
  std::size_t truncated = 0;
  for (int round = 0; round < 12; ++round) {
    const auto place = [&](Vec3d p) {
      return round % 2 == 0 ? p : Vec3d{0.6 * p.x - 0.8 * p.y, 0.8 * p.x + 0.6 * p.y, 0.3 * p.x + p.z};
    };
    const auto blocks = testing::random_blocks(3 + round % 3, 1, random, place);
    SCOPED_TRACE(round);
    const auto repaired = repair(blocks.mesh);
    ASSERT_TRUE(repaired);
    const ClosedSource given = testing::closed_source(repaired->mesh);
    const Prepared made = testing::prepared(given);
    testing::expect_stands(made);
    EXPECT_EQ(made.repairs.replaced_faces, 0U);
    // What was cut off or moved lies as near to the prepared source as is said.
    const auto at = [&](std::uint32_t v) { return to_double(made.source.points[v]); };
    std::vector<std::uint8_t> used(given.points.size(), 0);
    for (const Face& f : given.faces)
      for (const std::uint32_t v : f) used[v] = 1;
    double farthest = 0;
    for (std::uint32_t v = 0; v < given.points.size(); ++v) {
      if (used[v] == 0) continue;
      const Vec3d p = to_double(given.points[v]);
      double least = 1e9;
      for (const Face& t : made.source.faces) {
        const auto w = nearest_in_triangle(p, at(t[0]), at(t[1]), at(t[2]));
        least = std::min(least, length(at(t[0]) * w[0] + at(t[1]) * w[1] + at(t[2]) * w[2] - p));
      }
      farthest = std::max(farthest, least);
    }
    EXPECT_LE(farthest, testing::limits_for(given).farthest + made.repairs.moved_most + 1);
    truncated += made.repairs.truncated_spikes > 0;
  }
  EXPECT_GT(truncated, 6U);
}

TEST(TruncateSpikes, LeavesAClosedSurfaceThatIsSeenEverywhere) {
  // Six of eight cubes around a point: two notches meet in it and along an edge, which the source then has twice.
  constexpr std::int32_t kUnit = 1 << 20;
  std::mt19937 random(1);
  std::size_t cut = 0;
  for (int round = 0; round < 200; ++round) {
    const auto place = [&](Vec3d p) { return round % 2 == 0 ? p : Vec3d{p.x, p.y + 0.4 * p.x, p.z - 0.3 * p.y}; };
    const auto blocks = testing::random_blocks(2, 1, random, place);
    if (blocks.cubes == 0) continue;
    const auto repaired = repair(blocks.mesh);
    ASSERT_TRUE(repaired);
    ClosedSource source;
    for (const Vec3d p : repaired->mesh.positions) source.points.push_back(snap((p + Vec3d{1, 1, 1}) * kUnit));
    source.faces = repaired->mesh.triangles;
    source.patch.assign(source.faces.size(), 0);
    source.phantom.assign(source.faces.size(), 0);
    const auto visibilities = [&] {
      std::vector<std::vector<Vec3d>> normals(source.points.size());
      for (const Triangle& f : source.faces) {
        const Vec3d a = to_double(source.points[f[0]]);
        const Vec3d n = normalized(cross(to_double(source.points[f[1]]) - a, to_double(source.points[f[2]]) - a));
        for (const std::uint32_t v : f) normals[v].push_back(n);
      }
      std::vector<double> seen;
      for (const auto& of : normals) seen.push_back(of.empty() ? 1 : best_direction(of).visibility);
      return seen;
    };
    std::vector<std::uint32_t> tips;
    const std::vector<double> before = visibilities();
    for (std::uint32_t v = 0; v < before.size(); ++v)
      if (before[v] < 0.02) tips.push_back(v);
    const std::size_t given = source.faces.size();
    EXPECT_EQ(truncate_spikes(source, tips, 0.01 * kUnit), tips.size());
    EXPECT_EQ(source.patch.size(), source.faces.size());
    EXPECT_EQ(source.phantom.size(), source.faces.size());
    EXPECT_EQ(std::ranges::count(std::span(source.patch).first(given), 1), 0);
    EXPECT_TRUE(find_boundary_loops(source.points.size(), source.faces).empty());
    for (const double seen : visibilities()) EXPECT_GT(seen, 0.02) << "round " << round;
    cut += tips.size();
  }
  EXPECT_GT(cut, 40U);
}

}  // namespace
}  // namespace relief
