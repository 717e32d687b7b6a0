#include <relief/convert/shell/fibre_direction.h>

#include <gtest/gtest.h>
#include <unit/convert/shell/shell_support.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace relief::detail {
namespace {

/// Directions spread evenly over the sphere.
std::vector<Vec3d> sphere(int count) {
  std::vector<Vec3d> all;
  for (int k = 0; k < count; ++k) {
    const double z = 1 - (2 * k + 1.0) / count, r = std::sqrt(1 - z * z), a = 2.399963229728653 * k;
    all.push_back({r * std::cos(a), r * std::sin(a), z});
  }
  return all;
}
double least(const std::vector<Vec3d>& normals, Vec3d d) {
  double found = 1;
  for (const Vec3d n : normals) found = std::min(found, dot(n, d));
  return found;
}
double best_of_sphere(const std::vector<Vec3d>& normals) {
  static const std::vector<Vec3d> directions = sphere(8000);
  double best = -1;
  for (const Vec3d d : directions) best = std::max(best, least(normals, d));
  return best;
}
constexpr double kSpacing = 0.045;  // rad; every direction has one of the sphere nearer than that

// What the view leaves out, and the choice of the triangles, may cost a little.
TEST(ViewOfSource, SeesAllTrianglesNearlyAsWellAsTheBestOfAllDirections) {
  constexpr double kAsideAtMost = 0.06;
  const LatticeMesh mesh(testing::ball(60, 0.03));
  const SourceIndex source(mesh.points, mesh.faces);
  std::mt19937 random(9);
  double worst = -1;
  int seen = 0;
  for (int trial = 0; trial < 40; ++trial) {
    // The triangles around a random place, as triangles and as clusters.
    const Vec3d centre = source.normal(static_cast<std::uint32_t>(random() % source.faces.size()));
    const double reach = 0.98 - 0.01 * double(trial);
    std::vector<TriangleReference> some;
    std::vector<Vec3d> normals;
    for (std::uint32_t c = 0; c < source.clusters.size(); ++c) {
      const std::uint32_t end =
          std::min<std::uint32_t>(static_cast<std::uint32_t>(source.faces.size()), (c + 1) * kClusterSize);
      if (dot(source.normal(c * kClusterSize), centre) < reach) continue;
      if (trial % 2 == 0) {
        some.push_back(TriangleReference::cluster(c));
      } else {
        for (std::uint32_t t = c * kClusterSize; t < end; ++t) some.push_back(TriangleReference::triangle(t));
      }
      for (std::uint32_t t = c * kClusterSize; t < end; ++t) normals.push_back(source.normal(t));
    }
    const SourceView view = view_of_source(source, some);
    EXPECT_LE(view.normals.size(), 14U);
    EXPECT_NEAR(length(view.best.d), 1, 1e-9);
    EXPECT_NEAR(view.visibility(view.best.d), view.best.visibility, 1e-9);
    const double brute = best_of_sphere(normals);
    if (brute < 0.1) continue;
    ++seen;
    EXPECT_GT(least(normals, view.best.d), brute - kAsideAtMost);
    worst = std::max(worst, brute - least(normals, view.best.d));
  }
  EXPECT_GT(worst, -kSpacing) << "the sphere's directions are no measure";
  EXPECT_GT(seen, 20);
}

TEST(ViewOfSource, TakesTheLeastBadDirectionWhereNoneSeesAll) {
  const LatticeMesh mesh(testing::ball(12));
  const SourceIndex source(mesh.points, mesh.faces);
  std::vector<TriangleReference> some;
  std::vector<Vec3d> normals;
  for (std::uint32_t t = 0; t < source.faces.size(); ++t)
    if (source.normal(t).z > -0.5) {
      some.push_back(TriangleReference::triangle(t));
      normals.push_back(source.normal(t));
    }
  const SourceView view = view_of_source(source, some);
  const double brute = best_of_sphere(normals);
  EXPECT_LT(brute, 0);
  EXPECT_GT(view.best.visibility, brute - 0.1);
  EXPECT_GT(view.best.d.z, 0.9);
}

TEST(StarDirection, SeesTheStarAsTheBestOfAllDirectionsDoes) {
  const ThinShell thin(testing::ball(24, 0.1));
  const LinkedDraft draft(coarse(thin, 120));
  Star star;
  for (std::uint32_t v = 0; v < draft.out.size(); ++v) {
    if (draft.out[v] == kNone) continue;
    star.set_fibre(draft, v);
    const std::vector<LinkEdge> link = star.link(draft);
    std::vector<Vec3d> normals;
    for (const LinkEdge& e : link) normals.push_back(normalized(cross(e.from - draft.at[v], e.to - draft.at[v])));
    const Direction found = star_direction(link, draft.at[v]);
    EXPECT_NEAR(least(normals, found.d), found.visibility, 1e-12);
    const double brute = best_of_sphere(normals);
    EXPECT_GE(found.visibility, brute - 1e-9);
    EXPECT_LT(found.visibility, brute + kSpacing);
  }
}

/// The edges of a polygon in the plane z = height, of one side.
std::vector<LinkEdge> polygon(const std::vector<Vec3d>& corners) {
  std::vector<LinkEdge> link;
  for (std::size_t k = 0; k < corners.size(); ++k)
    link.push_back({kOuter, corners[k], corners[(k + 1) % corners.size()]});
  return link;
}

TEST(Innermost, FindsTheCentreOfTheLargestCircle) {
  std::vector<Vec3d> hexagon;
  for (int k = 0; k < 6; ++k)
    hexagon.push_back({std::cos(k * std::numbers::pi / 3), std::sin(k * std::numbers::pi / 3), 0});
  const Vec3d up = {0, 0, 1};
  EXPECT_LT(length(innermost(polygon(hexagon), {0.5, 0.2, 0}, up)), 0.03);
  // A triangle of 3, 4 and 5: the circle has the radius 1.
  const Vec3d found = innermost(polygon({{0, 0, 0}, {4, 0, 0}, {0, 3, 0}}), {2, 0.5, 0}, up);
  EXPECT_LT(length(found - Vec3d{1, 1, 0}), 0.1);
  EXPECT_EQ(innermost({}, {7, 8, 9}, up), (Vec3d{7, 8, 9}));
}

TEST(SeeingPlace, IsNeverWorseThanTheStartAndMostlyBetter) {
  const ThinShell thin(testing::ball(24, 0.1));
  const LinkedDraft draft(coarse(thin, 120));
  Star star;
  int better = 0, all = 0;
  for (std::uint32_t v = 0; v < draft.out.size(); ++v) {
    star.set_fibre(draft, v);
    const std::vector<LinkEdge> link = star.link(draft);
    const double before = star_direction(link, draft.at[v]).visibility;
    const double after = star_direction(link, seeing_place(link, draft.at[v])).visibility;
    EXPECT_GE(after, before);
    better += after > before + 0.01;
    ++all;
  }
  EXPECT_GT(2 * better, all);
}

}  // namespace
}  // namespace relief::detail
