// The index is judged by the source that it was made of, triangle by triangle.
#include <relief/convert/geometry/source_index.h>

#include <gtest/gtest.h>
#include <unit/convert/shell/shell_support.h>

#include <algorithm>
#include <random>
#include <set>

namespace relief::detail {
namespace {

/// Normals point as the corners turn, and each cluster holds its triangles.
void expect_current(const SourceIndex& source) {
  for (std::uint32_t t = 0; t < source.faces.size(); ++t) {
    const Vec3d n = source.cross_of(t);
    EXPECT_LT(length(source.normal(t) - normalized(n)), 1e-6);
    const SourceTriangle triangle = source.triangle(t);
    const SourceCluster& cluster = source.clusters[t / kClusterSize];
    EXPECT_GE(dot(cluster.axis, triangle.normal), cluster.cosine);
    EXPECT_GE(cluster.slack, triangle.slack);
    for (const Vec3d p : {triangle.a, triangle.b, triangle.c})
      for (std::size_t k = 0; k < 3; ++k) EXPECT_LE(std::abs(p[k] - cluster.centre[k]), cluster.half[k]);
  }
}

TEST(SourceIndex, IsTheSourceInAnotherOrder) {
  LatticeMesh mesh(noisy_field(20, 0.1));
  mesh.points.insert(mesh.points.begin() + 7, mesh.points.front());  // no face names it
  for (Face& f : mesh.faces)
    for (std::uint32_t& v : f) v += v >= 7;
  const SourceIndex source(mesh.points, mesh.faces);
  ASSERT_EQ(source.faces.size(), mesh.faces.size());
  EXPECT_EQ(source.points.size(), mesh.points.size() - 1);
  EXPECT_EQ(std::set(source.face_of.begin(), source.face_of.end()).size(), mesh.faces.size());
  EXPECT_EQ(std::ranges::count(source.point_of, 7U), 0);
  std::uint32_t last = 0, next = 0;
  for (std::uint32_t t = 0; t < source.faces.size(); ++t) {
    const Face& given = mesh.faces[source.face_of[t]];
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(source.point_of[source.faces[t][k]], given[k]);
      EXPECT_EQ(source.points[source.faces[t][k]], mesh.points[given[k]]);
      EXPECT_LE(source.faces[t][k], next) << "points are numbered as triangles name them";
      next = std::max(next, source.faces[t][k] + 1);
    }
    const std::uint32_t code = morton_code(mesh.points[given[0]]);
    EXPECT_GE(code, last);
    last = code;
  }
  expect_current(source);
}

TEST(SourceIndex, FollowsPointsThatMove) {
  const LatticeMesh mesh(testing::ball(12));
  SourceIndex source(mesh.points, mesh.faces);
  std::mt19937 random(1);
  for (LatticePoint& p : source.points) p.x += static_cast<std::int32_t>(random() % 100'000);
  source.update();
  expect_current(source);
}

TEST(SourceIndex, FindsTheTrianglesNearASlab) {
  const ThinShell thin(noisy_field(16, 0.05));
  const ShellDraft draft = thin.draft();
  std::vector<std::uint32_t> all(thin.source.faces.size());
  for (std::uint32_t t = 0; t < all.size(); ++t) all[t] = t;
  std::mt19937 random(2);
  std::size_t sections = 0, apart = 0;
  for (int round = 0; round < 60; ++round) {
    const Face& f = draft.faces[random() % draft.faces.size()];
    LatticeTriangle inner, outer;
    for (std::size_t k = 0; k < 3; ++k) {
      inner[k] = draft.ends[f[k]][kInner];
      outer[k] = draft.ends[f[k]][kOuter];
    }
    const SlabShape shape(inner, outer);
    std::set<std::uint32_t> near;
    thin.source.for_near(shape, all, [&](std::uint32_t t, bool is_crossed) {
      EXPECT_TRUE(near.insert(t).second);
      if (!is_crossed) return;
      ++sections;
      const Meeting meeting = shape.meet(thin.source.triangle(t));
      EXPECT_TRUE(meeting == Meeting::Section || meeting == Meeting::Apart) << t;
    });
    for (const std::uint32_t t : all) {
      if (near.contains(t)) continue;
      ++apart;
      EXPECT_EQ(shape.meet(thin.source.triangle(t)), Meeting::Apart) << t;
    }
  }
  EXPECT_GT(sections, 60U);
  EXPECT_GT(apart, 1000U);
}

}  // namespace
}  // namespace relief::detail
