// How many samples slabs get, beside closed forms and every n in turn.
#include <relief/convert/sample/resolution.h>

#include <gtest/gtest.h>
#include <support/shells.h>
#include <unit/convert/shapes.h>

#include <cmath>
#include <functional>
#include <random>

namespace relief::detail {
namespace {

SlabSamples sampled(int n, const std::function<double(double, double)>& alpha, float steepness = 1) {
  SlabSamples samples(n);
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i + j <= n; ++i) {
      samples.alpha[sample_index(n, {i, j})] = static_cast<float>(alpha(double(i) / n, double(j) / n));
      samples.steepness[sample_index(n, {i, j})] = steepness;
    }
  return samples;
}

/// How far the surface of every step-th sample lies off all of them: each is weighed between the corners of its cell.
double farthest(const SlabSamples& s, int step) {
  double most = 0;
  for (int j = 0; j <= s.intervals; ++j)
    for (int i = 0; i + j <= s.intervals; ++i) {
      // The cell's corner nearest to the origin, and on which side of its diagonal the sample lies.
      int x = i / step * step, y = j / step * step;
      if (x + y == s.intervals) x = std::max(0, x - step);
      double u = double(i - x) / step, v = double(j - y) / step;
      const auto at = [&](int a, int b) { return double(s.alpha[sample_index(s.intervals, {a, b})]); };
      double between = 0;
      if (u + v <= 1)
        between = at(x, y) + u * (at(x + step, y) - at(x, y)) + v * (at(x, y + step) - at(x, y));
      else
        between = at(x + step, y + step) + (1 - u) * (at(x, y + step) - at(x + step, y + step)) +
                  (1 - v) * (at(x + step, y) - at(x + step, y + step));
      const std::size_t k = sample_index(s.intervals, {i, j});
      most = std::max(most, std::abs(between - double(s.alpha[k])) * double(s.steepness[k]));
    }
  return most;
}

TEST(Resolution, APlaneNeedsTheFewest) {
  EXPECT_EQ(coarsest_intervals(sampled(128, [](double u, double v) { return 0.2 + 0.3 * u - 0.1 * v; }), 1e-6), 4);
  EXPECT_EQ(coarsest_intervals(sampled(2, [](double, double) { return 0.5; }), 1), 2) << "never more than there are";
}

// Between places h apart along u, a u^2 lies a h^2 / 4 off the line.
TEST(Resolution, AParabolaNeedsWhatItsSagittaSays) {
  constexpr double kBend = 0.5;
  const SlabSamples samples = sampled(128, [](double u, double) { return kBend * u * u; }, 100);
  for (const int n : {4, 8, 16, 32, 64}) {
    const double off = 100 * kBend / (4.0 * n * n);
    EXPECT_EQ(coarsest_intervals(samples, 1.02 * off), n);
    EXPECT_EQ(coarsest_intervals(samples, 0.98 * off), 2 * n);
  }
}

TEST(Resolution, IsTheFirstOfAllHalvingsThatStaysNear) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> share(0, 1);
  for (int k = 0; k < 200; ++k) {
    const double a = 20 * share(random), b = 20 * share(random), c = share(random);
    SlabSamples samples =
        sampled(64, [&](double u, double v) { return 0.5 + 0.2 * std::sin(a * u + c) * std::cos(b * v); });
    for (float& s : samples.steepness) s = static_cast<float>(1 + share(random));
    const double error = 0.2 * std::pow(10, -3 * share(random));
    int wanted = 64;
    while (wanted > 4 && farthest(samples, 2 * 64 / wanted) <= error) wanted /= 2;
    EXPECT_EQ(coarsest_intervals(samples, error), wanted) << k;
  }
}

TEST(Resolution, WhereAHoleBeginsAllIsKeptAndVoidSamplesCountForNothing) {
  SlabSamples samples = sampled(32, [](double, double) { return 0.5; });
  samples.is_void[sample_index(32, {5, 5})] = 1;
  EXPECT_EQ(coarsest_intervals(samples, 1), 32);
  std::ranges::fill(samples.is_void, std::uint8_t{1});
  samples.alpha[sample_index(32, {5, 5})] = 0;
  EXPECT_EQ(coarsest_intervals(samples, 0.1), 4);
}

/// A round cage and a ball in it of so many rows.
struct RoundSource {
  std::shared_ptr<const SlabMesh> cage;
  TriangleMesh ball;
  Lattice lattice;
  SourceRays rays;

  RoundSource(int levels, int rows)
      : cage(::relief::testing::sphere_shell(levels, 8)),
        ball(::relief::testing::ball(rows)),
        lattice(Lattice::around(bounds(ball), 0.5)),
        rays(ball.positions, ball.triangles, lattice) {}
  [[nodiscard]] SampleSource source() const { return {rays, lattice, ball.triangles.size()}; }
};

TEST(Resolution, SlabsSampleTwiceAsDenselyAsTheSourcesCorners) {
  // All 131,072 samples that 512 slabs have anyway: n is 32 at least. A ball's poles are denser than its equator.
  const RoundSource coarse(3, 10), fine(3, 250);
  for (const int n : finest_intervals(*coarse.cage, coarse.source())) EXPECT_EQ(n, 32);
  const std::vector<int> made = finest_intervals(*fine.cage, fine.source());
  std::size_t more = 0;
  for (std::size_t k = 0; k < made.size(); ++k) {
    const SlabCorners corners = fine.cage->corners(static_cast<SlabId>(k));
    std::array<Vec3d, 3> out;
    for (std::size_t c = 0; c < 3; ++c) out[c] = normalized(corners.outer[c]);
    // Triangles whose middle lies in the slab's cone.
    const auto side = [&](std::size_t c, Vec3d p) { return dot(cross(out[c], out[(c + 1) % 3]), p); };
    std::size_t in = 0;
    for (const Triangle& t : fine.ball.triangles) {
      const Vec3d p = fine.ball.positions[t[0]] + fine.ball.positions[t[1]] + fine.ball.positions[t[2]];
      in += side(0, p) > 0 && side(1, p) > 0 && side(2, p) > 0 ? 1 : 0;
    }
    // Two triangles share a corner, and n intervals make n^2 / 2 samples: n = 4 sqrt(triangles) is four times as dense
    // along each axis, and goes up to the next power of two.
    const double wanted = 4 * std::sqrt(double(in));
    if (made[k] < kMaxIntervals) {
      EXPECT_GT(made[k], wanted / 1.25) << k;
    }
    if (made[k] > 32) {
      EXPECT_LT(made[k], 2 * 1.25 * wanted) << k;
    }
    more += made[k] > 32 ? 1 : 0;
  }
  EXPECT_GT(more, 50U);
}

TEST(Resolution, ColourGetsAFewSamplesForEachOfItsOwn) {
  // Corners have half a colour for each triangle: 2 * 250 * 500 / 2 of them on 512 slabs.
  RoundSource fine(3, 250);
  fine.ball.colours.assign(fine.ball.positions.size(), {1, 2, 3});
  const int m = colour_intervals(*fine.cage, fine.rays, fine.lattice, fine.ball);
  const double colours = 0.5 * double(fine.ball.triangles.size());
  EXPECT_EQ(m & (m - 1), 0);
  EXPECT_LE(double(sample_count(m)) * 512, 16 * 1.1 * colours);
  EXPECT_GT(double(sample_count(m)) * 512, 2 * colours);
  const RoundSource few(3, 6);
  EXPECT_LT(colour_intervals(*few.cage, few.rays, few.lattice, few.ball), 3);
}

}  // namespace
}  // namespace relief::detail
