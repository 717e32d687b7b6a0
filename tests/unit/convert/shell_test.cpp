#include "shapes.h"

#include <relief/convert/reach.h>
#include <relief/convert/shell.h>

#include <gtest/gtest.h>

#include <algorithm>

namespace relief::detail {
namespace {

using relief::testing::append;

BaseMesh on_lattice(const TriangleMesh& mesh, double scale) {
  BaseMesh base;
  for (const Vec3d p : mesh.positions) base.points.push_back(snap(p * scale + Vec3d{4e6, 4e6, 4e6}));
  base.faces = mesh.triangles;
  return base;
}

Fibres equal_fibres(const BaseMesh& base, double depth) {
  Fibres fibres;
  fibres.directions = vertex_directions(base);
  for (const Side side : {kInner, kOuter}) fibres.wanted[side].assign(base.points.size(), depth);
  return fibres;
}

double least_length(const Shell& shell) {
  double least = 1e300;
  for (std::size_t v = 0; v < shell.ends[kInner].size(); ++v)
    least = std::min(least, length(to_double(shell.ends[kOuter][v] - shell.ends[kInner][v])));
  return least;
}

TEST(Shell, KeepsWantedDepthWhereThereIsRoom) {
  const BaseMesh base = on_lattice(testing::sheet(3), 1e6);
  const Shell shell = build_shell(base, equal_fibres(base, 2e5), {});
  ASSERT_EQ(shell.faces.size(), 18U);
  EXPECT_TRUE(shell.dropped.empty());
  for (std::size_t v = 0; v < base.points.size(); ++v) {
    EXPECT_EQ(shell.ends[kOuter][v].z - base.points[v].z, 200000);
    EXPECT_EQ(base.points[v].z - shell.ends[kInner][v].z, 200000);
  }
}

TEST(Shell, SheetsSideBySideShareTheGap) {
  TriangleMesh mesh = testing::sheet(3);
  append(mesh, testing::sheet(3), {0.03, 0.04, 0.1});
  const BaseMesh base = on_lattice(mesh, 1e6);
  const Shell shell = build_shell(base, equal_fibres(base, 2e5), {});
  EXPECT_TRUE(shell.dropped.empty());
  ASSERT_EQ(shell.ends[kOuter].size(), base.points.size());
  std::int32_t lower_top = 0, upper_bottom = 1 << 30;
  for (std::size_t v = 0; v < base.points.size(); ++v) {
    const bool lower = base.points[v].z < 4050000;
    if (lower) lower_top = std::max(lower_top, shell.ends[kOuter][v].z);
    if (!lower) upper_bottom = std::min(upper_bottom, shell.ends[kInner][v].z);
  }
  // The gap is 100,000 steps; both sheets reach into it, and neither through the other.
  EXPECT_GT(lower_top, 4020000);
  EXPECT_LT(upper_bottom, 4080000);
  EXPECT_GT(least_length(shell), 1.5e5);
}

TEST(Shell, LeavesOutFacesThatCross) {
  TriangleMesh mesh = testing::sheet(4);
  append(mesh, testing::bent_grid(4, 4, false, false,
                                  [](double u, double v) { return Vec3d{0.1 + 0.8 * u, 0.57, v - 0.53}; }));
  const BaseMesh base = on_lattice(mesh, 1e6);
  const Shell shell = build_shell(base, equal_fibres(base, 1e5), {});
  EXPECT_GE(shell.dropped.size(), 4U);
  EXPECT_LE(shell.dropped.size(), 24U);
  EXPECT_EQ(shell.dropped.size() + shell.faces.size(), base.faces.size());
  EXPECT_EQ(shell.from.size(), shell.faces.size());
}

TEST(Shell, KeepsOneOfTwoFacesBackToBack) {
  BaseMesh base;
  base.points = {{100000, 100000, 100000}, {900000, 100000, 100000}, {100000, 900000, 100000}};
  base.faces = {{0, 1, 2}};
  EXPECT_EQ(build_shell(base, equal_fibres(base, 1e4), {}).faces.size(), 1U);
  base.points.insert(base.points.end(), base.points.begin(), base.points.end());
  base.faces.push_back({3, 5, 4});
  const Shell shell = build_shell(base, equal_fibres(base, 1e4), {});
  EXPECT_EQ(shell.faces.size(), 1U) << "one of two coinciding sheets can stay";
}

}  // namespace
}  // namespace relief::detail
