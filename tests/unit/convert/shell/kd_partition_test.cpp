#include <relief/convert/shell/kd_partition.h>

#include <gtest/gtest.h>

#include <random>
#include <set>
#include <vector>

namespace relief::detail {
namespace {

Box3d around(Vec3d p, double half) {
  Box3d box;
  box.add(p - Vec3d{half, half, half});
  box.add(p + Vec3d{half, half, half});
  return box;
}

TEST(KdPartition, CoversSpaceOnceWithCellsThatHoldTheirShare) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> anywhere(-1, 1);
  for (const double share : {0.5, 0.4})
    for (const std::size_t most : {std::size_t{1}, std::size_t{50}, std::size_t{5000}}) {
      std::vector<Vec3d> points(2000);
      for (Vec3d& p : points) p = {anywhere(random), 2 * anywhere(random), 0.1 * anywhere(random)};
      const std::vector<Vec3d> given = points;
      const KdPartition cells(points, most, share);
      std::vector<std::size_t> held(cells.count(), 0);
      for (const Vec3d p : given) {
        // A box that lies in no cut has one cell, whose box holds it.
        std::vector<std::size_t> found;
        cells.for_each(around(p + Vec3d{1e-9, 1e-9, 1e-9}, 0), [&](std::size_t c) { found.push_back(c); });
        ASSERT_EQ(found.size(), 1U);
        ++held[found[0]];
        EXPECT_TRUE(cells.box(found[0]).contains(p + Vec3d{1e-9, 1e-9, 1e-9}));
      }
      std::size_t fullest = 0;
      for (const std::size_t count : held) {
        EXPECT_GT(count, 0U);
        fullest = std::max(fullest, count);
      }
      EXPECT_LE(fullest, most);
      // Far outside, too, there is a cell.
      int far = 0;
      cells.for_each(around({1e6, -1e6, 1e6}, 1), [&](std::size_t) { ++far; });
      EXPECT_EQ(far, 1);
      for (int k = 0; k < 200; ++k) {
        const Box3d box = around({anywhere(random), anywhere(random), anywhere(random)}, 0.3 * (anywhere(random) + 1));
        std::set<std::size_t> found, expected;
        cells.for_each(box, [&](std::size_t c) { EXPECT_TRUE(found.insert(c).second) << "visited twice"; });
        for (std::size_t c = 0; c < cells.count(); ++c)
          if (cells.box(c).meets(box)) expected.insert(c);
        EXPECT_EQ(found, expected);
      }
    }
}

TEST(KdPartition, KeepsEqualPointsInOneCell) {
  std::vector<Vec3d> points(100, Vec3d{1, 2, 3});
  const KdPartition cells(points, 10, 0.5);
  EXPECT_EQ(cells.count(), 1U);
}

}  // namespace
}  // namespace relief::detail
