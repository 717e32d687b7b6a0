#include <relief/convert/geometry/slab_test.h>
#include <relief/convert/geometry/source_index.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <optional>
#include <random>
#include <vector>

namespace relief::detail {
namespace {

struct Slab {
  LatticeTriangle inner, outer;

  [[nodiscard]] Vec3d in(double u, double v) const noexcept { return on(inner, u, v); }
  [[nodiscard]] Vec3d out(double u, double v) const noexcept { return on(outer, u, v); }

 private:
  static Vec3d on(const LatticeTriangle& t, double u, double v) noexcept {
    return to_double(t[0]) * (1 - u - v) + to_double(t[1]) * u + to_double(t[2]) * v;
  }
};

/// Slabs with a positive Jacobian, of many shapes, and triangles of many sizes in and around them.
class Cases {
 public:
  explicit Cases(unsigned seed) : random_(seed) {}

  Slab slab() {
    for (;;) {
      const double thick = 0.2 + 1.5 * part();
      const auto corner = [&](double x, double y, double z) {
        return snap(kMiddle + (Vec3d{x, y, z} + Vec3d{some(), some(), some()} * 0.35) * kSize);
      };
      const Slab s = {{corner(0, 0, 0), corner(1, 0, 0), corner(0, 1, 0)},
                      {corner(0, 0, thick), corner(1, 0, thick), corner(0, 1, thick)}};
      if (jacobian_fault(s.inner, s.outer) == JacobianFault::None) return s;
    }
  }
  LatticeTriangle triangle() {
    const double size = std::array{0.03, 0.2, 0.8}[random_() % 3];
    const Vec3d at = Vec3d{part(), part(), part()} * 1.6 - Vec3d{0.3, 0.3, 0.3};
    const auto corner = [&] { return snap(kMiddle + (at + Vec3d{some(), some(), some()} * size) * kSize); };
    return {corner(), corner(), corner()};
  }
  double some() { return some_(random_); }
  double part() { return 0.5 * (some() + 1); }

  static constexpr Vec3d kMiddle = {1.6e7, 1.6e7, 1.6e7};
  static constexpr double kSize = 1e5;  // lattice steps

 private:
  std::mt19937 random_;
  std::uniform_real_distribution<double> some_{-1, 1};
};

/// Where a fibre crosses a triangle, well inside both; and whether it leaves through the front.
struct Hit {
  bool front;
};
std::optional<Hit> hit(const Slab& s, double u, double v, const SourceTriangle& t) {
  const Vec3d a = s.in(u, v), d = s.out(u, v) - a;
  const double along = dot(t.normal, d);
  if (along == 0) return std::nullopt;
  const double h = dot(t.normal, t.a - a) / along;
  if (!(h >= 0 && h <= 1)) return std::nullopt;
  const Vec3d p = a + d * h;
  if (dot(cross(t.b - t.a, p - t.a), t.normal) < 0 || dot(cross(t.c - t.b, p - t.b), t.normal) < 0 ||
      dot(cross(t.a - t.c, p - t.c), t.normal) < 0)
    return std::nullopt;
  return Hit{along > 0};
}

// Against fibres cast by the thousand, and the exact test of triangles.
TEST(SlabShape, JudgesTrianglesAsTheFibresDo) {
  Cases cases(5);
  std::array<int, 5> found{};
  int refused = 0, refused_rightly = 0;
  for (int trial = 0; trial < 4000; ++trial) {
    const Slab slab = cases.slab();
    const LatticeTriangle corners = cases.triangle();
    const std::vector<LatticePoint> points(corners.begin(), corners.end());
    const SourceIndex source(points, std::vector<Face>{{0, 1, 2}});
    const SourceTriangle t = source.triangle(0);
    if (!(length(t.normal) > 0)) continue;
    const SlabShape shape(slab.inner, slab.outer);
    const Meeting meeting = shape.meet(t);
    ++found[static_cast<std::size_t>(meeting)];
    EXPECT_EQ(shape.is_apart(t), meeting == Meeting::Apart);
    int fronts = 0, backs = 0;
    for (int k = 0; k < 400; ++k) {
      double u = cases.part(), v = cases.part();
      if (u + v > 1) u = 1 - u, v = 1 - v;
      const auto h = hit(slab, u, v, t);
      if (!h) continue;
      ++(h->front ? fronts : backs);
    }
    const bool meets_outer = triangles_meet(slab.outer, source.corners(0)),
               meets_inner = triangles_meet(slab.inner, source.corners(0));
    switch (meeting) {
      case Meeting::Apart:
        EXPECT_EQ(fronts + backs, 0);
        EXPECT_FALSE(meets_outer || meets_inner);
        break;
      case Meeting::Section:
        EXPECT_EQ(backs, 0);
        EXPECT_FALSE(meets_outer || meets_inner);
        break;
      case Meeting::Outer:
        refused_rightly += meets_outer;
        ++refused;
        break;
      case Meeting::Inner:
        refused_rightly += meets_inner;
        ++refused;
        EXPECT_FALSE(meets_outer) << "the outer triangle is asked first";
        break;
      case Meeting::Folded:
      case Meeting::Within:
      case Meeting::Mixed:
        EXPECT_FALSE(meets_outer || meets_inner);
        break;
    }
    // The quick test, in floats, proves what it says.
    FourTriangles four;
    source.set_four(four, 1, slab.inner[0], [](std::size_t) { return 0U; });
    const QuickShape::Verdict verdict = QuickShape(shape, slab.inner[0]).meet(four);
    if ((verdict.near & 1U) == 0) {
      EXPECT_EQ(fronts + backs, 0);
    }
    if ((verdict.section & 1U) != 0) {
      EXPECT_EQ(backs, 0);
      EXPECT_FALSE(meets_outer || meets_inner);
    }
    EXPECT_EQ(verdict.near >> 1U, 0U) << "those that are not set lie nowhere";
  }
  for (const Meeting m : {Meeting::Apart, Meeting::Section, Meeting::Inner, Meeting::Outer, Meeting::Folded})
    EXPECT_GT(found[static_cast<std::size_t>(m)], 50) << static_cast<int>(m);
  // Refusals are certain but for two lattice steps.
  EXPECT_GT(refused_rightly, 0.99 * refused);
}

// A block of sixteen is judged as each of them would be.
TEST(SlabShape, JudgesClustersAsTheirTrianglesAtBest) {
  Cases cases(6);
  int sections = 0, within = 0, apart = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    const Slab slab = cases.slab();
    const SlabShape shape(slab.inner, slab.outer);
    // A small sheet of triangles across the slab, more or less.
    const Vec3d at = Cases::kMiddle + Vec3d{cases.part(), cases.part(), cases.part()} * Cases::kSize;
    const Vec3d up = normalized(Vec3d{1.5 * cases.some(), 1.5 * cases.some(), 1});
    const Vec3d e = normalized(cross(up, Vec3d{0, 1, 0})), g = cross(up, e);
    std::vector<LatticePoint> points;
    std::vector<Face> faces;
    const double size = 0.02 * Cases::kSize;
    for (std::uint32_t y = 0; y < 3; ++y)
      for (std::uint32_t x = 0; x < 5; ++x) points.push_back(snap(at + e * (x * size) + g * (y * size)));
    for (std::uint32_t y = 0; y < 2; ++y)
      for (std::uint32_t x = 0; x < 4; ++x) {
        const std::uint32_t v = 5 * y + x;
        faces.push_back({v, v + 1, v + 6});
        faces.push_back({v, v + 6, v + 5});
      }
    const SourceIndex source(points, faces);
    ASSERT_EQ(source.clusters.size(), 1U);
    const Meeting whole = shape.meet(source.clusters[0]);
    for (std::uint32_t t = 0; t < source.faces.size(); ++t) {
      const Meeting one = shape.meet(source.triangle(t));
      if (whole == Meeting::Section) {
        EXPECT_TRUE(one == Meeting::Section || one == Meeting::Apart);
      }
      if (whole == Meeting::Apart) {
        EXPECT_EQ(one, Meeting::Apart);
      }
      if (whole == Meeting::Within) {
        EXPECT_TRUE(one == Meeting::Section || one == Meeting::Folded);
      }
    }
    sections += whole == Meeting::Section;
    within += whole == Meeting::Within;
    apart += whole == Meeting::Apart;
  }
  EXPECT_GT(sections, 30);
  EXPECT_GT(within, 20);
  EXPECT_GT(apart, 30);
}

TEST(SlabShape, SurelyApartIsAProof) {
  Cases cases(7);
  int apart = 0;
  for (int trial = 0; trial < 4000; ++trial) {
    const Slab a = cases.slab(), b = cases.slab();
    const SlabShape s(a.inner, a.outer), t(b.inner, b.outer);
    for (const std::size_t mine : {std::size_t{0}, std::size_t{1}})
      for (const std::size_t theirs : {std::size_t{0}, std::size_t{1}}) {
        if (!s.surely_apart(mine, t, theirs)) continue;
        ++apart;
        EXPECT_FALSE(triangles_meet(s.triangle(mine), t.triangle(theirs)));
      }
  }
  EXPECT_GT(apart, 1000);
}

}  // namespace
}  // namespace relief::detail
