#include <relief/convert/geometry/lattice.h>
#include <relief/convert/geometry/visibility.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

namespace relief::detail {
namespace {

TEST(Lattice, PointsSurviveTheWayToTheModelAndBack) {
  for (const double size : {1e-3, 1.0, 1e6})
    for (const double away : {0.0, 1e6, -3e9}) {
      Box3d box;
      box.add(Vec3d{away, away, away});
      box.add(Vec3d{away + size, away + 0.3 * size, away});
      const Lattice lattice = Lattice::around(box, 0.1 * size);
      int exponent = 0;
      EXPECT_EQ(std::frexp(lattice.step, &exponent), 0.5) << "the step is a power of two";
      std::mt19937 random(7);
      std::uniform_int_distribution<std::int32_t> anywhere(0, 1 << Lattice::kBits);
      for (int k = 0; k < 1000; ++k) {
        const LatticePoint p = {anywhere(random), anywhere(random), anywhere(random)};
        const Vec3d model = lattice.to_model(p);
        EXPECT_EQ(snap(lattice.to_lattice(model)), p);
        EXPECT_EQ(std::remainder(model.x, lattice.step), 0);
      }
      for (const double corner : {-0.1, 1.1}) {
        const Vec3d p = lattice.to_lattice(Vec3d{away, away, away} + Vec3d{corner, 0, 0} * size);
        EXPECT_GE(p.x, -1e-3);
        EXPECT_LE(p.x, Lattice::kSpan);
      }
    }
}

TEST(LatticeBox, HoldsAndMeetsWhatItsCornersSay) {
  std::mt19937 random(3);
  std::uniform_int_distribution<std::int32_t> some(0, 12);
  int met = 0, held = 0;
  for (int trial = 0; trial < 5000; ++trial) {
    const auto point = [&] { return LatticePoint{some(random), some(random), (1 << Lattice::kBits) - some(random)}; };
    const LatticeTriangle s = {point(), point(), point()}, t = {point(), point(), point()};
    const LatticePoint p = point();
    LatticeBox a(s), both(t);
    const auto overlap = [&](const auto& x, const auto& y) {
      for (std::size_t k = 0; k < 3; ++k)
        if (std::max({x[0][k], x[1][k], x[2][k]}) < std::min({y[0][k], y[1][k], y[2][k]}) ||
            std::max({y[0][k], y[1][k], y[2][k]}) < std::min({x[0][k], x[1][k], x[2][k]}))
          return false;
      return true;
    };
    EXPECT_EQ(a.meets(LatticeBox(t)), overlap(s, t));
    EXPECT_EQ(a.holds(p), overlap(s, LatticeTriangle{p, p, p}));
    both.add(a);
    for (const LatticeTriangle& of : {s, t})
      for (const LatticePoint q : of) EXPECT_TRUE(both.holds(q));
    met += a.meets(LatticeBox(t));
    held += a.holds(p);
  }
  EXPECT_GT(met, 500);
  EXPECT_LT(met, 4500);
  EXPECT_GT(held, 200);
}

TEST(Orientation, SeesOneStepInTwentyFiveBits) {
  constexpr std::int32_t kFar = 1 << Lattice::kBits;
  const LatticePoint a = {0, 0, 0}, b = {kFar, kFar, 1}, c = {1, kFar, kFar};
  // d = b + c lies in the plane; one step aside does not.
  const LatticePoint d = {kFar / 2, kFar / 2, 0};
  EXPECT_EQ(orientation(a, b, c, {0, 0, 0}), 0);
  EXPECT_EQ(orientation(a, b, c, d), -orientation(a, c, b, d));
  EXPECT_NE(orientation(a, b, c, {0, 0, 1}), 0);
  EXPECT_NE(orientation(a, b, c, {1, 0, 0}), 0);
  EXPECT_EQ(orientation({0, 0, 0}, {kFar, 0, 0}, {0, kFar, 0}, {5, 5, 1}), 1);
}

TEST(TrianglesMeet, KnowsTheSpecialPositions) {
  const LatticeTriangle base = {{{0, 0, 0}, {100, 0, 0}, {0, 100, 0}}};
  const auto meets = [&](const LatticeTriangle& t) {
    const bool one = triangles_meet(base, t), other = triangles_meet(t, base);
    EXPECT_EQ(one, other);
    return one;
  };
  EXPECT_TRUE(meets({{{20, 20, -5}, {20, 20, 5}, {90, 90, 5}}})) << "pierced";
  EXPECT_FALSE(meets({{{20, 20, 1}, {60, 20, 5}, {20, 60, 9}}})) << "above";
  EXPECT_TRUE(meets({{{20, 20, 0}, {60, 20, 5}, {20, 60, 9}}})) << "a corner touches the inside";
  EXPECT_TRUE(meets({{{50, 50, 0}, {90, 90, 5}, {90, 90, 9}}})) << "a corner touches an edge";
  EXPECT_FALSE(meets({{{51, 50, 0}, {90, 90, 5}, {90, 90, 9}}})) << "one step beyond the edge";
  EXPECT_TRUE(meets({{{10, 10, 0}, {20, 10, 0}, {10, 20, 0}}})) << "coplanar, inside";
  EXPECT_TRUE(meets({{{-100, -100, 0}, {300, -100, 0}, {-100, 300, 0}}})) << "coplanar, around";
  EXPECT_TRUE(meets({{{50, 50, 0}, {100, 50, 0}, {50, 100, 0}}})) << "coplanar, touching along an edge";
  EXPECT_FALSE(meets({{{51, 50, 0}, {100, 50, 0}, {51, 100, 0}}})) << "coplanar, apart";
  EXPECT_TRUE(meets({{{-10, 50, -10}, {200, 50, -10}, {50, 50, 60}}})) << "edges cross";
  EXPECT_FALSE(meets({{{200, 0, -50}, {200, 50, 50}, {210, 0, 0}}})) << "planes cross, triangles do not";
}

TEST(TrianglesMeet, AgreesWithSamplingOnRandomPairs) {
  std::mt19937 random(11);
  std::uniform_int_distribution<std::int32_t> near(0, 40);
  int met = 0;
  for (int k = 0; k < 2000; ++k) {
    LatticeTriangle a, b;
    for (LatticePoint& p : a) p = {near(random), near(random), near(random)};
    for (LatticePoint& p : b) p = {near(random), near(random), near(random)};
    const bool meet = triangles_meet(a, b);
    met += meet;
    // Where a point of b's edges runs through a from one side to the other, they must be said to meet.
    bool crossed = false;
    for (std::size_t e = 0; e < 3; ++e) {
      const Vec3d p = to_double(b[e]), q = to_double(b[(e + 1) % 3]);
      const Vec3d o = to_double(a[0]), u = to_double(a[1]) - o, v = to_double(a[2]) - o, n = cross(u, v);
      const double hp = dot(n, p - o), hq = dot(n, q - o);
      if (hp * hq >= 0) continue;
      const Vec3d x = p + (q - p) * (hp / (hp - hq)) - o;
      const double nn = dot(n, n), s = dot(cross(x, v), n) / nn, t = dot(cross(u, x), n) / nn;
      crossed = crossed || (s > 1e-9 && t > 1e-9 && s + t < 1 - 1e-9);
    }
    EXPECT_TRUE(meet || !crossed);
  }
  EXPECT_GT(met, 100);
  EXPECT_LT(met, 1900);
}

TEST(Jacobian, FindsADipBetweenSoundEnds) {
  // The outer triangle is the inner one, turned about the axis: sound at both ends for any turn, but flat half-way at
  // 180 degrees, and with a negative middle beyond about 90 (shell.md, 6).
  const auto slab = [](double degrees) {
    LatticeTriangle in, out;
    for (std::size_t k = 0; k < 3; ++k) {
      const double a = 2 * 3.14159265358979 * double(k) / 3, b = a + degrees * 3.14159265358979 / 180;
      in[k] = snap({1e6 + 1e5 * std::cos(a), 1e6 + 1e5 * std::sin(a), 1e6});
      out[k] = snap({1e6 + 1e5 * std::cos(b), 1e6 + 1e5 * std::sin(b), 1.3e6});
    }
    return jacobian_fault(in, out);
  };
  EXPECT_EQ(slab(0), JacobianFault::None);
  EXPECT_EQ(slab(60), JacobianFault::None);
  EXPECT_EQ(slab(100), JacobianFault::None);
  EXPECT_EQ(slab(180), JacobianFault::Between);
}

TEST(Jacobian, AgreesWithSamplesOfTheQuadratic) {
  std::mt19937 random(3);
  std::uniform_int_distribution<std::int32_t> jitter(-600, 600);
  int sound = 0;
  for (int round = 0; round < 4000; ++round) {
    LatticeTriangle in = {{{5000, 5000, 5000}, {6000, 5000, 5000}, {5000, 6000, 5000}}}, out = in;
    for (std::size_t k = 0; k < 3; ++k) {
      out[k] = out[k] + LatticePoint{jitter(random), jitter(random), 500 + jitter(random)};
      in[k] = in[k] + LatticePoint{jitter(random), jitter(random), jitter(random)};
    }
    double least = 1e300;
    for (int step = 0; step <= 512; ++step) {
      std::array<Vec3d, 3> p;
      for (std::size_t k = 0; k < 3; ++k) p[k] = to_double(in[k]) + to_double(out[k] - in[k]) * (step / 512.0);
      for (std::size_t k = 0; k < 3; ++k)
        least = std::min(least, dot(cross(p[1] - p[0], p[2] - p[0]), to_double(out[k] - in[k])));
    }
    const bool valid = jacobian_fault(in, out) == JacobianFault::None;
    sound += valid;
    EXPECT_TRUE(!valid || least > 0);
    EXPECT_TRUE(valid || least <= 1e4);
  }
  EXPECT_GT(sound, 200);
}

TEST(BestDirection, IsTheCentreOfTheSmallestCap) {
  // The corner of a cube sees its faces at 1/sqrt(3); a crowd of normals near one of them does not draw it aside.
  std::vector<Vec3d> normals = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (int k = 0; k < 50; ++k) normals.push_back(normalized(Vec3d{1, 0.001 * k, 0.0}));
  const Direction corner = best_direction(normals);
  EXPECT_NEAR(corner.visibility, 1 / std::sqrt(3.0), 1e-9);
  // A wedge as sharp as a knife still has one.
  const std::array<Vec3d, 2> wedge = {normalized(Vec3d{0.01, 1, 0}), normalized(Vec3d{0.01, -1, 0})};
  EXPECT_NEAR(best_direction(wedge).visibility, 0.01, 1e-4);
  // All around: none.
  const std::array<Vec3d, 4> all = {Vec3d{1, 0, 0}, Vec3d{-1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}};
  EXPECT_LE(best_direction(all).visibility, 1e-12);
}

TEST(BestDirection, IsNeverBeatenByRandomDirections) {
  std::mt19937 random(5);
  std::normal_distribution<double> bell;
  for (int round = 0; round < 200; ++round) {
    std::vector<Vec3d> normals;
    for (int k = 0; k < 8; ++k)
      normals.push_back(normalized(Vec3d{bell(random), bell(random), 0.7 + std::abs(bell(random))}));
    const Direction best = best_direction(normals);
    for (int k = 0; k < 500; ++k) {
      const Vec3d d = normalized(best.d + Vec3d{bell(random), bell(random), bell(random)} * 0.2);
      double least = 1;
      for (const Vec3d n : normals) least = std::min(least, dot(n, d));
      EXPECT_LE(least, best.visibility + 1e-9);
    }
  }
}

}  // namespace
}  // namespace relief::detail
