// The point that planes share, by closed forms.
#include <relief/convert/remesh/plane_fit.h>

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace relief::detail {
namespace {

class RandomPlanes {
 public:
  explicit RandomPlanes(unsigned seed) : random_(seed) {}
  Vec3d direction() { return normalized(Vec3d{normal_(random_), normal_(random_), normal_(random_)}); }
  Vec3d place() { return Vec3d{normal_(random_), normal_(random_), normal_(random_)} * 3.0; }

 private:
  std::mt19937 random_;
  std::normal_distribution<double> normal_{0, 1};
};

/// A place of the plane through `on`, some way from it.
Vec3d in_plane(Vec3d on, Vec3d normal, Vec3d along) { return on + along - normal * dot(normal, along); }

TEST(PlaneFit, OnePlaneDecidesOneDirection) {
  RandomPlanes random(1);
  for (int k = 0; k < 100; ++k) {
    const Vec3d near = random.place(), n = random.direction(), on = random.place();
    PlaneFit fit(near);
    fit.add(n, on);
    fit.add(n, in_plane(on, n, random.place()));
    ASSERT_EQ(fit.solve(), 1);
    EXPECT_LT(length(fit.at(1) - (near - n * dot(n, near - on))), 1e-9);
    EXPECT_LT(length(fit.at(3) - fit.at(1)), 1e-12) << "more directions than are decided";
    EXPECT_EQ(fit.at(0), near);
  }
}

TEST(PlaneFit, TwoPlanesMeetInALineWhoseNearestPointItIs) {
  RandomPlanes random(2);
  for (int k = 0; k < 100; ++k) {
    const Vec3d near = random.place(), on = random.place(), a = random.direction();
    const Vec3d side = normalized(cross(a, random.direction()));
    const double angle = 0.4 + 0.02 * k;
    const Vec3d b = a * std::cos(angle) + side * std::sin(angle), along = normalized(cross(a, b));
    PlaneFit fit(near);
    fit.add(a, in_plane(on, a, random.place()));
    fit.add(b, in_plane(on, b, random.place()));
    ASSERT_EQ(fit.solve(), 2) << angle;
    EXPECT_LT(length(fit.at(2) - (on + along * dot(along, near - on))), 1e-7) << angle;
  }
}

TEST(PlaneFit, ThreePlanesMeetInTheirCorner) {
  RandomPlanes random(3);
  int tried = 0;
  for (int k = 0; k < 300; ++k) {
    const Vec3d corner = random.place(), a = random.direction(), b = random.direction(), c = random.direction();
    if (std::abs(dot(a, cross(b, c))) < 0.4) continue;
    ++tried;
    PlaneFit fit(random.place());
    for (const Vec3d n : {a, b, c}) fit.add(n, in_plane(corner, n, random.place()));
    ASSERT_EQ(fit.solve(), 3);
    EXPECT_LT(length(fit.at(3) - corner), 1e-7);
  }
  EXPECT_GT(tried, 30);
}

// With planes that share no point the sum of the squared distances is least: its derivatives vanish.
TEST(PlaneFit, ManyPlanesMeetWhereTheSquaredDistancesAreLeast) {
  RandomPlanes random(4);
  for (int k = 0; k < 50; ++k) {
    PlaneFit fit(random.place());
    std::vector<std::pair<Vec3d, Vec3d>> planes;
    for (int p = 0; p < 9; ++p) {
      planes.emplace_back(random.direction(), random.place());
      fit.add(planes.back().first, planes.back().second);
    }
    if (fit.solve() < 3) continue;
    const Vec3d at = fit.at(3);
    Vec3d slope;
    for (const auto& [n, on] : planes) slope += n * dot(n, at - on);
    EXPECT_LT(length(slope), 1e-9);
  }
}

TEST(PlaneFit, PlanesThatAreAllButParallelAreNoEdge) {
  for (const auto& [degrees, rank] : {std::pair{0.0, 1}, {4.0, 1}, {7.0, 1}, {9.0, 2}, {30.0, 2}, {90.0, 2}}) {
    // Two planes at an angle: the eigenvalues are 1 + cos and 1 - cos, their ratio the squared tangent of its half.
    const double angle = degrees * std::numbers::pi / 180;
    PlaneFit fit({0, 0, 0});
    fit.add({1, 0, 0}, {0.3, 0, 0});
    fit.add({std::cos(angle), std::sin(angle), 0}, {0.3, 0, 0});
    const bool is_edge = std::pow(std::tan(angle / 2), 2) > 0.005;
    EXPECT_EQ(fit.solve(), is_edge ? 2 : 1) << degrees;
    EXPECT_EQ(is_edge, rank == 2) << degrees;
  }
}

}  // namespace
}  // namespace relief::detail
