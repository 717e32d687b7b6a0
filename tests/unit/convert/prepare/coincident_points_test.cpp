#include "../certified.h"
#include "../shapes.h"
#include "closed_source.h"
#include "support/blocks.h"

#include <relief/convert/prepare/coincident_points.h>
#include <relief/convert/shell/initial_shell.h>
#include <relief/mesh/repair.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace relief {
namespace {

using namespace detail;
using testing::append;
using testing::certified;
using testing::expect_certified;

TEST(Certified, PartsThatTouchAreMovedApart) {
  // Two cubes that share an edge, as one surface whose edge has four faces.
  TriangleMesh both = testing::box({1, 1, 1});
  append(both, testing::box({1, 1, 1}), {1, 1, 0});
  const auto result = convert(both, certified(100));
  expect_certified(result, 100);
  EXPECT_GT(result->report.parted_vertices, 0U);
  EXPECT_GT(result->report.moved_most, 0);
  EXPECT_LE(result->report.moved_most, 2.1e-3);
}

TEST(CoincidentPoints, BlocksThatShareFacesAreMovedApart) {
  // In any case shared edges and corners, too; every solid stays, no more than the reported distance from where it was.
  std::mt19937 random(3);
  std::size_t shared = 0;
  for (int round = 0; round < 12; ++round) {
    SCOPED_TRACE(round);
    const auto place = [&](Vec3d p) {
      return round % 2 == 0 ? p : Vec3d{0.6 * p.x - 0.8 * p.y, 0.8 * p.x + 0.6 * p.y, 0.3 * p.x + p.z};
    };
    const auto blocks = testing::random_blocks(2 + round % 3, testing::kEachItsOwn, random, place);
    if (blocks.cubes == 0) continue;
    const auto repaired = repair(blocks.mesh);
    ASSERT_TRUE(repaired);
    const ClosedSource given = testing::closed_source(repaired->mesh);
    const Prepared made = testing::prepared(given);
    testing::expect_stands(made);
    EXPECT_EQ(made.repairs.replaced_faces, 0U);
    EXPECT_EQ(made.repairs.parted_points > 0, repaired->report.split_vertices > 0);
    double most = 0;
    for (std::size_t v = 0; v < given.points.size(); ++v)
      most = std::max(most, length(to_double(made.source.points[v] - given.points[v])));
    EXPECT_LE(most, made.repairs.moved_most);
    shared += blocks.shared_faces;
  }
  EXPECT_GT(shared, 60U);
}

TEST(CoincidentPoints, GoOutOfTheSolidThatTheOthersLieIn) {
  // Two boxes, tip to tip, and a box in the notch of another: a corner in each.
  TriangleMesh tips = testing::box({1, 1, 1});
  append(tips, testing::box({1, 1, 1}), {1, 1, 1});
  ClosedSource source = testing::closed_source(tips);
  const ClosedSource given = source;
  EXPECT_EQ(separate_coincident_points(source, 1e4), 2U);
  for (std::uint32_t v = 0; v < given.points.size(); ++v) {
    const Vec3d by = to_double(source.points[v] - given.points[v]);
    const bool first = v == 7, second = v == 8;
    EXPECT_EQ(length(by) > 0, first || second) << v;
    if (!first && !second) continue;
    EXPECT_NEAR(length(by), 1e4, 2);
    // Each into its own box.
    const Vec3d into = first ? by * -1.0 : by;
    EXPECT_GT(std::min({into.x, into.y, into.z}), 0);
  }
  // On a lattice that is coarse beside the solids, what is allowed would not do for two slabs.
  for (const double farthest : {0.5, 1.0, 20.0}) {
    SCOPED_TRACE(farthest);
    ClosedSource coarse = given;
    EXPECT_EQ(separate_coincident_points(coarse, farthest), 2U);
    EXPECT_GT(coarse.points[8].x - coarse.points[7].x, 4 * kLeastHeight);
    EXPECT_LE(length(to_double(coarse.points[8] - given.points[8])), 4 * kLeastHeight + 1);
  }
  ClosedSource apart = testing::closed_source(testing::ball(8));
  EXPECT_EQ(separate_coincident_points(apart, 1e4), 0U);
}

}  // namespace
}  // namespace relief
