#include "../shapes.h"

#include <relief/convert/prepare/strays.h>

#include <gtest/gtest.h>

#include <cmath>

namespace relief::detail {
namespace {

using ::relief::testing::append;
using ::relief::testing::box;
using ::relief::testing::tetrahedron;

/// A box of diagonal 3 and a small one whose middle lies so many diagonals to the right of it.
TriangleMesh with_stray(double away, double size) {
  TriangleMesh mesh = box({1, 2, 2});
  append(mesh, box({1, 1, 1}), {1 + 3 * away - size / 2, 1, 1}, size);
  return mesh;
}

TEST(Strays, AreFartherOffThanTenDiagonalsOfTheRest) {
  TriangleMesh near = with_stray(9.99, 0.01), far = with_stray(10.01, 0.01);
  EXPECT_EQ(leave_out_strays(near).components, 0U);
  EXPECT_EQ(near.triangles.size(), 24U);
  const ConvertReport::Strays gone = leave_out_strays(far);
  EXPECT_EQ(gone.components, 1U);
  EXPECT_EQ(gone.triangles, 12U);
  EXPECT_NEAR(gone.away, 10.01, 1e-9);
  EXPECT_NEAR(gone.near.x, 1 + 30.03, 1e-9);
  EXPECT_EQ(far.triangles, box({1, 2, 2}).triangles);
  EXPECT_EQ(far.positions, box({1, 2, 2}).positions) << "its points would still count for the box";
}

TEST(Strays, HaveAThousandthOfTheAreaAtMost) {
  // The box has an area of 16, the other one 6 s s.
  const double least = std::sqrt(16.0 / 999 / 6);
  TriangleMesh small = with_stray(50, 0.98 * least), large = with_stray(50, 1.02 * least);
  EXPECT_EQ(leave_out_strays(small).components, 1U);
  EXPECT_EQ(leave_out_strays(large).components, 0U);
}

TEST(Strays, TheFarthestIsNamed) {
  TriangleMesh mesh = with_stray(20, 0.01);
  append(mesh, tetrahedron(), {-300, 0, 0}, 0.01);
  append(mesh, tetrahedron(), {0, 200, 0}, 0.01);
  const ConvertReport::Strays gone = leave_out_strays(mesh);
  EXPECT_EQ(gone.components, 3U);
  EXPECT_EQ(gone.triangles, 20U);
  EXPECT_NEAR(gone.away, 100, 0.01);
  EXPECT_NEAR(gone.near.x, -300, 0.01);
}

}  // namespace
}  // namespace relief::detail
