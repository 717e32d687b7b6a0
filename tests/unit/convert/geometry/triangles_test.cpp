// Half-edges, visibility and contacts of triangles: closed forms, and brute force over small lattices.
#include <relief/convert/geometry/half_edges.h>
#include <relief/convert/geometry/triangle_contact.h>
#include <relief/convert/geometry/visibility.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <set>
#include <vector>

namespace relief::detail {
namespace {

const std::vector<Face> kTetrahedron = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};

TEST(HalfEdges, TwinsRunTheOtherWay) {
  const std::vector<std::uint32_t> twins = find_twins(kTetrahedron, 4);
  ASSERT_EQ(twins.size(), 12U);
  const auto from = [](std::uint32_t h) { return kTetrahedron[h / 3][h % 3]; };
  for (std::uint32_t h = 0; h < 12; ++h) {
    ASSERT_NE(twins[h], kNone);
    EXPECT_EQ(twins[twins[h]], h);
    EXPECT_EQ(from(twins[h]), from(next_of(h)));
    EXPECT_EQ(from(next_of(twins[h])), from(h));
    EXPECT_EQ(next_of(last_of(h)), h);
  }
  // Without a face its three edges are open.
  const std::vector<std::uint32_t> open = find_twins(std::span(kTetrahedron).first(3), 4);
  EXPECT_EQ(std::ranges::count(open, kNone), 3);
}

TEST(HalfEdges, RingsGoOnceAroundEachPoint) {
  const Rings rings(kTetrahedron, 5);
  for (std::uint32_t v = 0; v < 4; ++v) {
    std::set<std::uint32_t> others;
    std::size_t count = 0;
    rings.around(v, [&](std::uint32_t h) {
      EXPECT_EQ(kTetrahedron[h / 3][h % 3], v);
      others.insert(kTetrahedron[h / 3][(h + 1) % 3]);
      ++count;
    });
    EXPECT_EQ(count, 3U);
    EXPECT_EQ(others.size(), 3U);
  }
  rings.around(4, [](std::uint32_t) { FAIL() << "a point that no face names"; });
}

TEST(Visibility, OfACubesCornerAndOfAWedge) {
  const std::vector<Vec3d> corner = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const Direction there = best_direction(corner);
  EXPECT_NEAR(there.visibility, 1 / std::sqrt(3), 1e-12);
  EXPECT_NEAR(length(there.d - normalized(Vec3d{1, 1, 1})), 0, 1e-12);
  for (const double angle : {0.1, 1.0, 2.0, 3.0}) {
    const std::vector<Vec3d> wedge = {{1, 0, 0}, {std::cos(angle), std::sin(angle), 0}};
    EXPECT_NEAR(best_direction(wedge).visibility, std::cos(angle / 2), 1e-12) << angle;
  }
  const std::vector<Vec3d> all_around = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  EXPECT_LE(best_direction(all_around).visibility, 0);
}

// Nothing that a fine search finds sees more.
TEST(Visibility, IsTheMostThatAnyDirectionHas) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  for (int round = 0; round < 50; ++round) {
    std::vector<Vec3d> normals(3 + round % 6);
    for (Vec3d& n : normals) n = normalized(Vec3d{normal(random), normal(random), normal(random) + 2.5});
    const Direction best = best_direction(normals);
    const auto least = [&](Vec3d d) {
      double value = 1;
      for (const Vec3d n : normals) value = std::min(value, dot(n, d));
      return value;
    };
    EXPECT_NEAR(least(best.d), best.visibility, 1e-12);
    for (int k = 0; k < 2000; ++k) {
      const Vec3d d = normalized(best.d + Vec3d{normal(random), normal(random), normal(random)} * 0.3);
      ASSERT_LE(least(d), best.visibility + 1e-12);
    }
  }
}

/// Twice the area of the part of the plane triangle b that lies in a, by cutting with its edges; z is left out.
double common_area(const LatticeTriangle& a, const LatticeTriangle& b) {
  std::vector<Vec3d> polygon;
  for (const LatticePoint p : b) polygon.push_back(to_double(p));
  const auto side = [](Vec3d u, Vec3d v, Vec3d p) { return (v.x - u.x) * (p.y - u.y) - (v.y - u.y) * (p.x - u.x); };
  const double sense = side(to_double(a[0]), to_double(a[1]), to_double(a[2])) > 0 ? 1 : -1;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3d u = to_double(a[k]), v = to_double(a[(k + 1) % 3]);
    std::vector<Vec3d> kept;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Vec3d p = polygon[i], q = polygon[(i + 1) % polygon.size()];
      const double at_p = sense * side(u, v, p), at_q = sense * side(u, v, q);
      if (at_p >= 0) kept.push_back(p);
      if ((at_p > 0 && at_q < 0) || (at_p < 0 && at_q > 0)) kept.push_back(p + (q - p) * (at_p / (at_p - at_q)));
    }
    polygon = std::move(kept);
  }
  double area = 0;
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i) area += side(polygon[0], polygon[i], polygon[i + 1]);
  return std::abs(area);
}

TEST(TriangleContact, InAPlaneIsWhereTheyHaveAreaInCommon) {
  std::mt19937 random(3);
  std::uniform_int_distribution<std::int32_t> place(0, 5);
  const auto triangle = [&] {
    LatticeTriangle t;
    do
      for (LatticePoint& p : t) p = {place(random), place(random), 7};
    while (!has_area(t));
    return t;
  };
  int met = 0;
  for (int round = 0; round < 3000; ++round) {
    const LatticeTriangle a = triangle(), b = triangle();
    const TriangleContact contact = find_contact(a, b);
    if (common_area(a, b) < 1e-9) continue;  // they touch at most
    ++met;
    ASSERT_TRUE(contact.coplanar);
    // A hull with area has three points at least.
    ASSERT_GE(contact.count, 3U);
  }
  EXPECT_GT(met, 500);
}

TEST(TriangleContact, AcrossAPlane) {
  const LatticeTriangle flat = {LatticePoint{0, 0, 0}, LatticePoint{12, 0, 0}, LatticePoint{0, 12, 0}};
  const auto standing = [](std::int32_t x, std::int32_t low, std::int32_t high) {
    return LatticeTriangle{LatticePoint{x, 2, low}, LatticePoint{x, 4, low}, LatticePoint{x, 3, high}};
  };
  EXPECT_TRUE(meet_beyond_corners(flat, standing(3, -4, 4)));
  EXPECT_TRUE(meet_beyond_corners(flat, standing(3, 0, 4))) << "it stands on it";
  EXPECT_FALSE(meet_beyond_corners(flat, standing(3, 1, 4)));
  EXPECT_FALSE(meet_beyond_corners(flat, standing(20, -4, 4)));
  // A common corner and a common edge are no meeting, and a triangle through a common corner is one.
  EXPECT_FALSE(meet_beyond_corners(flat, {flat[0], LatticePoint{-3, 0, 2}, LatticePoint{0, -3, 2}}));
  EXPECT_FALSE(meet_beyond_corners(flat, {flat[1], flat[0], LatticePoint{3, -3, 2}}));
  EXPECT_TRUE(meet_beyond_corners(flat, {flat[0], LatticePoint{6, 6, 3}, LatticePoint{6, 6, -3}}));
  EXPECT_EQ(find_contact(flat, standing(3, 1, 4)).count, 0U);
  EXPECT_GE(find_contact(flat, standing(3, -4, 4)).count, 2U);
}

}  // namespace
}  // namespace relief::detail
