// The oracles of contact (tests/support) on bodies whose contact is known in closed form.
#include "support/bodies.h"
#include "support/god_ball.h"
#include "support/god_object.h"
#include "support/hand_ways.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace relief::testing {
namespace {

BareTriangles bare(const TriangleMesh& mesh) { return {mesh.positions, mesh.triangles}; }

/// What an oracle said of each place of a hand.
template <typename Oracle>
std::vector<OracleTick> moved(Oracle&& oracle, const std::vector<Vec3d>& hand) {
  std::vector<OracleTick> ticks;
  for (const Vec3d cursor : hand) ticks.push_back(oracle.move(cursor));
  return ticks;
}
double deepest(const std::vector<OracleTick>& ticks) {
  double most = 0;
  for (const OracleTick& tick : ticks) most = std::max(most, tick.depth);
  return most;
}
long jumps(const std::vector<OracleTick>& ticks) { return std::ranges::count_if(ticks, &OracleTick::jumped); }

/// A flat sheet with rims, y = 0, a whole number of cells across.
TriangleMesh sheet(int cells) {
  TriangleMesh mesh;
  const auto id = [&](int x, int z) { return static_cast<std::uint32_t>(z * (cells + 1) + x); };
  for (int z = 0; z <= cells; ++z)
    for (int x = 0; x <= cells; ++x) mesh.positions.push_back({double(x) / cells, 0, double(z) / cells});
  for (int z = 0; z < cells; ++z)
    for (int x = 0; x < cells; ++x) {
      mesh.triangles.push_back({id(x, z), id(x, z + 1), id(x + 1, z + 1)});
      mesh.triangles.push_back({id(x, z), id(x + 1, z + 1), id(x + 1, z)});
    }
  return mesh;
}

/// Corners of a hand's way round a prism that stands along z: in at the middle of a side, along the outline `h` below
/// it, and once all round. `flat` is from the middle to the sides.
std::vector<Vec3d> round_prism(int sides, double flat, double h, double outside) {
  const double half = kPi / sides, corner = (flat - h) / std::cos(half);
  const auto at = [](double turn, double far) { return Vec3d{far * std::cos(turn), far * std::sin(turn), 0.013}; };
  std::vector<Vec3d> corners = {at(half, flat + outside), at(half, flat - h)};
  for (int k = 1; k <= sides; ++k) corners.push_back(at(2 * half * k, corner));
  corners.push_back(at(half, flat - h));
  return corners;
}

TEST(GodObjectOracle, IsAtTheFootOnAPlane) {
  const TriangleMesh mesh = sheet(7);
  const BareTriangles surface = bare(mesh);
  GodObject point(surface);
  for (const Vec3d cursor :
       straight_ways({{0.4, 0.1, 0.3}, {0.4, -0.05, 0.3}, {0.83, -0.08, 0.61}, {0.2, -0.01, 0.2}}, 1e-3)) {
    const OracleTick tick = point.move(cursor);
    ASSERT_EQ(tick.held, cursor.y < 0);
    ASSERT_NEAR(tick.depth, std::max(0.0, -cursor.y), 1e-15);
    ASSERT_NEAR(tick.point.x, cursor.x, 1e-15);
    ASSERT_NEAR(tick.point.z, cursor.z, 1e-15);
  }
  EXPECT_FALSE(point.move({0.2, 0.01, 0.2}).held);
}

TEST(GodObjectOracle, LetsGoOverARimAndIsNeverOnTheBack) {
  const TriangleMesh mesh = sheet(3);
  const BareTriangles surface = bare(mesh);
  GodObject point(surface);
  for (const Vec3d cursor : straight_ways({{0.6, 0.1, 0.3}, {0.6, -0.05, 0.3}, {1.2, -0.05, 0.3}}, 1e-3))
    ASSERT_EQ(point.move(cursor).held, cursor.y < 0 && cursor.x <= 1 + 1e-9) << cursor.x;
  // From below through the sheet, and back in from above.
  for (const Vec3d cursor : straight_ways({{1.2, -0.05, 0.3}, {0.7, -0.05, 0.4}, {0.7, 0.05, 0.4}}, 1e-3))
    ASSERT_FALSE(point.move(cursor).held);
  EXPECT_TRUE(point.move({0.7, -0.01, 0.4}).held);
}

TEST(GodObjectOracle, RoundsAPrismAsDeepAsItsEdgesAllow) {
  for (const int sides : {5, 6, 7, 8, 9, 10, 12}) {
    const TriangleMesh mesh = subdivided(extruded(regular_polygon(sides, 1), 0.5), 3);
    const BareTriangles surface = bare(mesh);
    for (const double h : {0.01, 0.02}) {
      GodObject point(surface);
      const double flat = std::cos(kPi / sides), step = 0.01 * h;
      const double most = h * (1 + std::tan(kPi / sides) * std::tan(2 * kPi / sides));
      const auto ticks = moved(point, straight_ways(round_prism(sides, flat, h, 0.1 * h), step));
      EXPECT_LE(deepest(ticks), most * (1 + 1e-9)) << sides << " sides, depth " << h;
      EXPECT_GE(deepest(ticks), most * 0.995) << sides << " sides, depth " << h;
      EXPECT_EQ(jumps(ticks), sides + 1) << "it lands, and goes round each edge at once";
    }
  }
}

TEST(GodObjectOracle, RoundsTheEdgesOfAnOctahedron) {
  const TriangleMesh mesh = subdivided(octahedron(), 4);
  const BareTriangles surface = bare(mesh);
  // In the plane across the edge from x to z the sides turn by 70.5 degrees: 1 + tan(35.3) tan(70.5) = 3.
  const double h = 0.01;
  const Vec3d along = normalized(Vec3d{1, 0, 1}), edge = along * std::sqrt(0.5);
  const Vec3d corner = edge - along * (h * std::sqrt(1.5)), near = normalized(Vec3d{-1, 2, -1}),
              far = {near.x, -near.y, near.z};
  const Vec3d begin = corner + near * 0.3, out = normalized(Vec3d{1, 1, 1});
  const auto ticks =
      moved(GodObject(surface), straight_ways({begin + out * (2 * h), begin, corner, corner + far * 0.3}, 2e-5));
  EXPECT_NEAR(deepest(ticks), 3 * h, 0.015 * h);
  EXPECT_NEAR(ticks.back().depth, h, 1e-12);
  EXPECT_EQ(jumps(ticks), 2);
}

TEST(GodObjectOracle, IsAsDeepAsTheHandOutOverAnEdge) {
  const double h = 0.01;
  for (const int degrees : {30, 45, 60, 90, 110, 130, 150}) {
    const double angle = degrees * kPi / 180;
    const TriangleMesh mesh = subdivided(wedge(angle, 0.5), 3);
    const BareTriangles surface = bare(mesh);
    GodObject point(surface);
    double x = 0;
    for (const Vec3d cursor : straight_ways({{-0.5, 0.01, 0.02}, {-0.5, -h, 0.02}, {0.5, -h, 0.03}}, 2e-5)) {
      const OracleTick tick = point.move(cursor);
      x = cursor.x;
      // It stays over the hand on the face that it came by; past the edge it is below the other one, or let go.
      const double below_the_other = h * std::cos(kPi - angle) - cursor.x * std::sin(kPi - angle);
      const double depth = cursor.x < 0 ? -cursor.y : below_the_other;
      if (std::abs(cursor.x) > 1e-9) {
        ASSERT_NEAR(tick.depth, std::max(0.0, depth), 1e-12) << degrees << " degrees, at " << cursor.x;
      }
    }
    EXPECT_EQ(x, 0.5);
  }
}

TEST(GodObjectOracle, SlidesOutOverTheEdgesOfACube) {
  const TriangleMesh mesh = subdivided(extruded({{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}, 1), 4);
  const BareTriangles surface = bare(mesh);
  std::mt19937 random(3);
  const auto unit = [&] { return double(random()) / 4294967296.0; };
  for (int k = 0; k < 20; ++k) {
    GodObject point(surface);
    const double h = 0.002 + 0.05 * unit(), turn = 2 * kPi * unit();
    const Vec3d in = {0.6 * unit() - 0.3, 1 - h, 0.6 * unit() - 0.3};
    const Vec3d out = in + Vec3d{std::cos(turn), 0, std::sin(turn)} * 3.0;
    for (const Vec3d cursor : straight_ways({in + Vec3d{0, 2 * h, 0}, in, out}, 1e-3)) {
      const OracleTick tick = point.move(cursor);
      const bool inside = std::abs(cursor.x) < 1 && std::abs(cursor.z) < 1;
      ASSERT_NEAR(tick.depth, inside ? std::max(0.0, 1 - cursor.y) : 0.0, 1e-12);
    }
  }
}

TEST(GodObjectOracle, IsNearestOnASphere) {
  const TriangleMesh mesh = round_sphere_mesh(6);
  const BareTriangles surface = bare(mesh);
  std::mt19937 random(4);
  const auto unit = [&] { return 2 * (double(random()) / 4294967296.0) - 1; };
  for (const double h : {0.04, 0.2, 0.6})
    for (int k = 0; k < 10; ++k) {
      const Vec3d from = normalized(Vec3d{unit(), unit(), unit()});
      const Vec3d side = normalized(cross(from, Vec3d{unit(), unit(), unit()}));
      std::vector<Vec3d> corners = {from * 1.01};
      for (int i = 0; i <= 200; ++i)
        corners.push_back((from * std::cos(0.02 * i) + side * std::sin(0.02 * i)) * (1 - h));
      GodObject point(surface);
      for (const Vec3d cursor : straight_ways(corners, 5e-4)) {
        const OracleTick tick = point.move(cursor);
        // A facet lies up to 3.5e-4 below the sphere, and the one next to the nearest may hold it.
        ASSERT_LE(tick.depth, 1.002 * std::max(0.0, 1 - length(cursor)));
        ASSERT_GE(tick.depth, 1 - length(cursor) - 4e-4);
      }
    }
}

TEST(GodObjectOracle, SaysWhenItJumps) {
  const TriangleMesh mesh = sheet(2);
  const BareTriangles surface = bare(mesh);
  GodObject point(surface);
  EXPECT_FALSE(point.move({0.5, 0.001, 0.5}).jumped);
  EXPECT_TRUE(point.move({0.5, -0.001, 0.5}).jumped) << "it landed";
  EXPECT_FALSE(point.move({0.51, -0.001, 0.5}).jumped);
  EXPECT_TRUE(point.move({0.51, 0.001, 0.5}).jumped) << "it let go";
  EXPECT_FALSE(point.move({0.52, 0.001, 0.5}).jumped);
  // Ten times the cursor's way of 0.001, and 2 % of the depth of 0.1.
  const Vec3d last = {0, -0.1, 0}, cursor = {0.001, -0.1, 0};
  EXPECT_FALSE(is_jump({}, {0.0119, 0, 0}, last, cursor));
  EXPECT_TRUE(is_jump({}, {0.0121, 0, 0}, last, cursor));
}

TEST(GodBallOracle, IsItsRadiusAboveAPlane) {
  const TriangleMesh mesh = sheet(40);
  const BareTriangles surface = bare(mesh);
  const double radius = 0.04;
  GodBall ball(surface, radius);
  for (const Vec3d cursor :
       straight_ways({{0.4, 0.1, 0.3}, {0.4, 0.02, 0.3}, {0.83, -0.01, 0.61}, {0.2, 0.03, 0.2}}, 5e-4)) {
    const OracleTick tick = ball.move(cursor);
    ASSERT_NEAR(tick.depth, std::max(0.0, radius - cursor.y), 1e-6 * radius);
    ASSERT_NEAR(tick.point.x, cursor.x, 1e-6 * radius);
    ASSERT_NEAR(tick.point.z, cursor.z, 1e-6 * radius);
  }
  EXPECT_TRUE(ball.move({0.2, 0.039, 0.2}).held);
  EXPECT_FALSE(ball.move({0.2, 0.041, 0.2}).held);
}

TEST(GodBallOracle, IsNearestOnASphere) {
  const TriangleMesh mesh = round_sphere_mesh(5);
  const BareTriangles surface = bare(mesh);
  const double radius = 0.05;
  GodBall ball(surface, radius);
  std::vector<Vec3d> corners = {{0, 0.1, 1.1}};
  for (int i = 0; i <= 100; ++i)
    corners.push_back(Vec3d{std::sin(0.02 * i), 0.1 * std::cos(0.05 * i), std::cos(0.02 * i)} * (0.9 - 0.001 * i));
  for (const Vec3d cursor : straight_ways(corners, 2e-3)) {
    const OracleTick tick = ball.move(cursor);
    // A facet lies up to 1.4e-3 below the sphere, and the one next to the nearest may hold it.
    const double depth = std::max(0.0, 1 + radius - length(cursor));
    ASSERT_LE(tick.depth, 1.002 * depth);
    ASSERT_GE(tick.depth, depth - 1.5e-3);
  }
}

/// How far a place lies outside the outline of a prism as in round_prism() whose corners are 1 from the middle.
double outside_prism(int sides, Vec3d place) {
  double least = Box3d::kFar;
  bool inside = true;
  for (int side = 0; side < sides; ++side) {
    const auto corner = [&](int k) { return Vec3d{std::cos(2 * kPi * k / sides), std::sin(2 * kPi * k / sides), 0}; };
    const Vec3d a = corner(side), along = corner(side + 1) - a, to = {place.x - a.x, place.y - a.y, 0};
    inside = inside && cross(along, to).z >= 0;
    least = std::min(least, length(to - along * std::clamp(dot(to, along) / dot(along, along), 0.0, 1.0)));
  }
  return inside ? 0 : least;
}

TEST(GodBallOracle, IsItsRadiusOffAPrism) {
  const double h = 0.01, radius = 0.03;
  for (const int sides : {4, 5, 6, 8, 12}) {
    const TriangleMesh mesh = subdivided(extruded(regular_polygon(sides, 1), 0.5), 3);
    const BareTriangles surface = bare(mesh);
    GodBall ball(surface, radius);
    for (const Vec3d cursor : straight_ways(round_prism(sides, std::cos(kPi / sides) + radius, h, 0.1 * h), 1e-4))
      ASSERT_NEAR(ball.move(cursor).depth, std::max(0.0, radius - outside_prism(sides, cursor)), 2e-3 * radius);
  }
}

/// With the cursor inside the prism the centre leaves a grown side where a point would leave the bare one, and goes
/// round the edge at once.
TEST(GodBallOracle, RoundsAPrismAsDeepAsItsEdgesAllow) {
  const double below = 0.01, radius = 0.02;
  for (const int sides : {5, 6, 8, 12}) {
    const TriangleMesh mesh = subdivided(extruded(regular_polygon(sides, 1), 0.5), 3);
    const BareTriangles surface = bare(mesh);
    const double flat = std::cos(kPi / sides);
    const auto ticks =
        moved(GodBall(surface, radius), straight_ways(round_prism(sides, flat, below, 1.1 * radius), 1e-4));
    const double most = radius + below * (1 + std::tan(kPi / sides) * std::tan(2 * kPi / sides));
    EXPECT_NEAR(deepest(ticks), most, 5e-3 * most) << sides;
    EXPECT_NEAR(ticks.back().depth, radius + below, 1e-6 * radius) << sides;
    EXPECT_EQ(jumps(ticks), sides + 1) << sides;
  }
}

TEST(GodBallOracle, SlidesOutOverTheEdgeOfAWedge) {
  const double h = 0.01, radius = 0.03;
  for (const int degrees : {30, 60, 90, 120, 150}) {
    const double angle = degrees * kPi / 180;
    const TriangleMesh mesh = subdivided(wedge(angle, 0.5), 4);
    const BareTriangles surface = bare(mesh);
    GodBall ball(surface, radius);
    for (const Vec3d cursor :
         straight_ways({{-0.5, 1.1 * radius, 0.02}, {-0.5, radius - h, 0.02}, {0.5, radius - h, 0.03}}, 2e-4)) {
      const OracleTick tick = ball.move(cursor);
      if (cursor.x < 0) {
        ASSERT_NEAR(tick.depth, std::max(0.0, radius - cursor.y), 1e-3 * radius) << degrees << " at " << cursor.x;
        continue;
      }
      // Off the edge, or off the other face where the foot of the cursor is on it.
      const double along = cursor.x * -std::cos(angle) - cursor.y * std::sin(angle);
      const double off =
          along < 0 ? length(Vec3d{cursor.x, cursor.y, 0}) : cursor.x * std::sin(angle) - cursor.y * std::cos(angle);
      if (cursor.x > 1e-3) {
        ASSERT_NEAR(tick.depth, std::max(0.0, radius - off), 1e-3 * radius) << degrees << " at " << cursor.x;
      }
    }
  }
}

TEST(GodBallOracle, RestsOnBothSidesOfACrease) {
  // Two sheets that rise from the z axis by 30 and 50 degrees.
  const double left = 30 * kPi / 180, right = 50 * kPi / 180, radius = 0.05;
  TriangleMesh mesh;
  const Vec3d a = {-std::cos(left), std::sin(left), 0}, b = {std::cos(right), std::sin(right), 0}, z = {0, 0, 1};
  mesh.positions = {-z, z, a - z, a + z, b - z, b + z};
  mesh.triangles = {{2, 3, 1}, {2, 1, 0}, {0, 1, 5}, {0, 5, 4}};
  const TriangleMesh fine = subdivided(mesh, 5);
  const BareTriangles surface = bare(fine);
  GodBall ball(surface, radius);
  // The middle of a ball that touches both is radius / sin(half of the angle between them) from the crease.
  const Vec3d rest = normalized(a + b) * (radius / std::sin((kPi - left - right) / 2));
  for (const Vec3d cursor :
       straight_ways({{-0.2, 0.5, 0}, {0, 0.02, 0}, {0.01, -0.01, 0.2}, {-0.01, 0.03, -0.2}}, 1e-3)) {
    const OracleTick tick = ball.move(cursor);
    if (cursor.y > 0.03) continue;
    ASSERT_NEAR(tick.point.x, rest.x, 1e-3 * radius);
    ASSERT_NEAR(tick.point.y, rest.y, 1e-3 * radius);
    ASSERT_NEAR(tick.point.z, cursor.z, 1e-3 * radius);
  }
}

TEST(GodBallOracle, DoesNotDependOnItsStep) {
  const TriangleMesh mesh = subdivided(random_hull(7, 14), 3);
  const BareTriangles surface = bare(mesh);
  const double radius = 0.03;
  std::vector<Vec3d> corners = {{0.2, 0.1, 1.3}};
  for (int i = 0; i <= 300; ++i)
    corners.push_back(Vec3d{std::sin(0.02 * i), 0.3 * std::cos(0.05 * i), std::cos(0.02 * i)} * 0.7);
  const auto hand = straight_ways(corners, 1e-3);
  const auto usual = moved(GodBall(surface, radius), hand), half = moved(GodBall(surface, radius, 0.01), hand);
  long held = 0;
  for (std::size_t k = 0; k < hand.size(); ++k) {
    ASSERT_EQ(usual[k].held, half[k].held) << k;
    ASSERT_NEAR(usual[k].depth, half[k].depth, 0.005 * half[k].depth) << k;
    held += usual[k].held ? 1 : 0;
  }
  EXPECT_GT(held, 1000);
}

/// It stays above a sheet that has no thickness, however deep the hand presses, and whatever its way.
TEST(GodBallOracle, NeverPassesThroughASheet) {
  const TriangleMesh mesh = sheet(20);
  const BareTriangles surface = bare(mesh);
  const double radius = 0.02;
  GodBall ball(surface, radius);
  for (const Vec3d cursor :
       straight_ways({{0.5, 0.1, 0.5}, {0.5, -0.4, 0.5}, {0.7, -0.2, 0.35}, {0.3, -0.3, 0.6}}, 7e-3)) {
    const OracleTick tick = ball.move(cursor);
    ASSERT_GE(tick.point.y, radius * (1 - 1e-9));
    ASSERT_EQ(tick.held, cursor.y < radius);
  }
}

TEST(BareTrianglesOfOracles, SayHowThickTheMaterialIs) {
  const TriangleMesh mesh = subdivided(wedge(kPi / 4, 0.5), 3);
  const BareTriangles surface = bare(mesh);
  for (const double x : {-0.1, -0.3, -0.6}) {
    const auto at = surface.nearest_within({x, 0.02, 0.1}, 0.1);
    ASSERT_TRUE(at);
    EXPECT_NEAR(surface.thickness(*at, 1), -x, 1e-9) << "the other face falls by 45 degrees";
    EXPECT_EQ(surface.thickness(*at, 0.05), 0.05);
  }
}

TEST(SlidesOfAHand, KeepTheirDepthAndSpeed) {
  const TriangleMesh mesh = round_sphere_mesh(5);
  const BareTriangles surface = bare(mesh);
  const Slide like = {.depth = 0.02, .step = 1e-3, .longest = 2};
  for (std::uint32_t seed = 1; seed <= 10; ++seed) {
    const auto way = slide(surface, like, seed);
    ASSERT_GT(way.size(), 2000U);
    long at_depth = 0;
    for (std::size_t k = 0; k < way.size(); ++k) {
      EXPECT_GE(length(way[k]), 0.975);
      at_depth += std::abs(1 - length(way[k]) - like.depth) < 0.003 ? 1 : 0;
      if (k > 0) {
        EXPECT_LE(length(way[k] - way[k - 1]), like.step * (1 + 1e-9));
      }
    }
    EXPECT_GT(at_depth, 1850) << "seed " << seed;
    EXPECT_GT(length(way.front()), 1.02);
    EXPECT_GT(length(way.back()), 1.02);
  }
}

TEST(SlidesOfAHand, EndBeforeThinPartsAndSharpEdges) {
  const TriangleMesh mesh = subdivided(wedge(kPi / 4, 0.5), 5);
  const BareTriangles surface = bare(mesh);
  const Slide like = {.depth = 0.02, .step = 1e-3, .longest = 2};
  int some = 0;
  for (std::uint32_t seed = 1; seed <= 60; ++seed) {
    const auto way = slide(surface, like, seed);
    some += way.empty() ? 0 : 1;
    // At -0.12 the wedge is 6 times as thick as the hand is deep.
    for (const Vec3d p : way) EXPECT_LT(p.x, -0.1) << "seed " << seed;
  }
  EXPECT_GT(some, 10);
}

}  // namespace
}  // namespace relief::testing
