#include "../certified.h"
#include "../shapes.h"

#include <relief/convert/prepare/split_high_valence.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace relief {
namespace {

using namespace detail;
using testing::certified;
using testing::expect_certified;
using testing::fans;

TEST(Certified, LargeFansAreDivided) {
  const auto even = [](std::uint32_t) { return 1.0; };
  for (const TriangleMesh& mesh : {fans(1001, 0.7, 0, even), fans(600, 0.3, -0.3, [](std::uint32_t k) {
                                     return 1 + 0.1 * std::sin(std::numbers::pi * k / 60);
                                   })}) {
    const auto result = convert(mesh, certified(100));
    expect_certified(result, 100);
    // Each given point is where it was, and what came lies on the given surface, but for the rounding of the lattice.
    EXPECT_EQ(result->report.moved_vertices, 0U);
    EXPECT_GT(result->mended.positions.size(), mesh.positions.size());
    const double step = 4e-7;  // not below the lattice's for a model of this size
    for (std::size_t v = 0; v < mesh.positions.size(); ++v)
      ASSERT_LE(length(result->mended.positions[v] - mesh.positions[v]), step);
    std::vector<std::size_t> around(result->mended.positions.size(), 0);
    for (const Triangle& t : result->mended.triangles)
      for (const std::uint32_t v : t) ++around[v];
    EXPECT_LE(*std::max_element(around.begin(), around.end()), 256U);
    EXPECT_LT(result->report.to_source.max, result->report.to_mended.max + step);
  }
}

TEST(DivideFans, OnlyWhereTheSurfaceStays) {
  const auto closed = [](const TriangleMesh& mesh) {
    ClosedSource source;
    for (const Vec3d p : mesh.positions) source.points.push_back(snap((p + Vec3d{2, 2, 2}) * 0x1p22));
    source.faces = mesh.triangles;
    source.patch.assign(source.faces.size(), 0);
    source.phantom = source.patch;
    return source;
  };
  const auto signed_volume = [](const ClosedSource& s) {
    double sum = 0;
    const auto at = [&](std::uint32_t v) { return to_double(s.points[v]); };
    for (const Face& f : s.faces) sum += dot(at(f[0]), cross(at(f[1]), at(f[2]))) / 6;
    return sum * 0x1p-66;
  };
  // Teeth, so that the rim is not convex; then so rough that no ring fits the lattice, and small.
  const auto teeth = [](std::uint32_t k) { return k % 2 == 0 ? 1.0 : 0.6; };
  const ClosedSource before = closed(fans(3000, 0, -0.4, teeth));
  ClosedSource after = before;
  EXPECT_GE(split_high_valence(after), 1U);
  EXPECT_NEAR(signed_volume(after), signed_volume(before), 1e-6);
  EXPECT_EQ(after.patch.size(), after.faces.size());
  EXPECT_EQ(after.phantom.size(), after.faces.size());
  const std::vector<std::uint32_t> twins = find_twins(after.faces, after.points.size());
  EXPECT_EQ(std::count(twins.begin(), twins.end(), kNone), 0);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> height(-0.1, 0.1);
  TriangleMesh crumpled = fans(1000, 1, -1, [](std::uint32_t) { return 1.0; });
  for (std::size_t v = 2; v < crumpled.positions.size(); ++v) crumpled.positions[v].z = height(random);
  ClosedSource rough = closed(crumpled), small = closed(fans(200, 1, 0, teeth));
  EXPECT_EQ(split_high_valence(rough), 0U);
  EXPECT_EQ(rough.faces.size(), crumpled.triangles.size());
  EXPECT_EQ(split_high_valence(small), 0U);
}

}  // namespace
}  // namespace relief
