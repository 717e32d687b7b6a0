// Which parts close nothing off, and what they are made into.
#include <relief/convert/geometry/half_edges.h>
#include <relief/convert/remesh/sheets.h>
#include <relief/mesh/repair.h>

#include <gtest/gtest.h>
#include <unit/convert/shapes.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

namespace relief::detail {
namespace {

using ::relief::testing::append;
using ::relief::testing::ball;

/// A ball of radius 20 whose cap above a height is open.
TriangleMesh open_ball(double height) {
  TriangleMesh mesh = ::relief::testing::scaled(ball(30), 20);
  std::erase_if(mesh.triangles, [&](const Triangle& t) {
    return std::ranges::any_of(t, [&](std::uint32_t v) { return mesh.positions[v].z > height; });
  });
  return mesh;
}

std::vector<std::uint8_t> sheets_of(const TriangleMesh& mesh) {
  const Skin skin(mesh.positions, mesh.triangles);
  return find_sheets(skin, find_components(mesh.positions.size(), mesh.triangles));
}

/// The mean winding number just behind all triangles, by the sum of the solid angles [Van Oosterom, Strackee 1983].
double winding_behind(const TriangleMesh& mesh) {
  double all = 0;
  for (const Triangle& t : mesh.triangles) {
    const auto at = [&](std::size_t k) { return mesh.positions[t[k]]; };
    const Vec3d p = (at(0) + at(1) + at(2)) / 3.0 - normalized(cross(at(1) - at(0), at(2) - at(0))) * 0.1;
    for (const Triangle& other : mesh.triangles) {
      const Vec3d a = mesh.positions[other[0]] - p, b = mesh.positions[other[1]] - p, c = mesh.positions[other[2]] - p;
      const double la = length(a), lb = length(b), lc = length(c);
      all += 2 * std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
    }
  }
  return all / (4 * std::numbers::pi) / double(mesh.triangles.size());
}

TEST(Sheets, ABowlIsASheetUntilItClosesEnoughOff) {
  std::set<bool> found;
  for (const double height : {15.0, 5.0, -5.0, -8.0, -11.0, -13.0, -15.0, -17.0}) {
    const TriangleMesh bowl = open_ball(height);
    const double behind = winding_behind(bowl);
    if (std::abs(behind - 0.7) < 0.01) continue;  // places of some triangles stand for those of all
    const bool is_sheet = behind < 0.7;
    found.insert(is_sheet);
    EXPECT_EQ(sheets_of(bowl), std::vector<std::uint8_t>{is_sheet ? std::uint8_t{1} : std::uint8_t{0}}) << height;
  }
  EXPECT_EQ(found.size(), 2U);
}

TEST(Sheets, PartsAreJudgedByTheWholeSkin) {
  TriangleMesh mesh = ::relief::testing::scaled(ball(20), 20);
  append(mesh, ::relief::testing::scaled(::relief::testing::sheet(8), 20), {40, 0, 0});
  append(mesh, ::relief::testing::scaled(::relief::testing::sheet(8), 10), {-5, -5, 0});  // within the ball: no sheet
  append(mesh, ::relief::testing::turned(ball(10)), {0, 0, -10}, 3);  // a cavity: just behind lies the solid
  EXPECT_EQ(sheets_of(mesh), (std::vector<std::uint8_t>{0, 1, 0, 0}));
}

TEST(Sheets, AFlatSheetBecomesABoxOfTwoVoxels) {
  TriangleMesh mesh = ::relief::testing::scaled(ball(12), 7);
  const TriangleMesh solid = mesh;
  append(mesh, ::relief::testing::scaled(::relief::testing::sheet(6), 30), {20, 0, 5});
  const Components parts = find_components(mesh.positions.size(), mesh.triangles);
  std::vector<Vec3d> points = mesh.positions;
  std::vector<Triangle> triangles = mesh.triangles;
  thicken_sheets(points, triangles, parts, {0, 1});

  // What is no sheet stays as it was.
  ASSERT_GT(triangles.size(), solid.triangles.size());
  EXPECT_TRUE(std::equal(solid.triangles.begin(), solid.triangles.end(), triangles.begin()));
  EXPECT_TRUE(std::equal(solid.positions.begin(), solid.positions.end(), points.begin()));
  triangles.erase(triangles.begin(), triangles.begin() + static_cast<std::ptrdiff_t>(solid.triangles.size()));
  const auto twins = find_twins(triangles, points.size());
  EXPECT_EQ(std::ranges::count(twins, kNone), 0) << "open";
  for (const Triangle& t : triangles)
    for (const std::uint32_t v : t) EXPECT_NEAR(std::abs(points[v].z - 5), 1, 1e-12);
  EXPECT_NEAR(signed_volume({points, triangles, {}}), 30 * 30 * 2, 1e-6);
}

TEST(Sheets, ABentSheetHasItsSidesAVoxelOffItsFaces) {
  TriangleMesh roof = ::relief::testing::scaled(::relief::testing::sheet(4), 20);
  for (Vec3d& p : roof.positions) p.z = std::abs(p.x - 10);  // a valley of 90 degrees
  std::vector<Vec3d> points = roof.positions;
  std::vector<Triangle> triangles = roof.triangles;
  thicken_sheets(points, triangles, find_components(points.size(), triangles), {1});
  // Each of the two sides has planes a voxel from those of the sheet: also at the fold, where corners go farther.
  const double root = std::sqrt(0.5);
  for (std::size_t v = 0; v < roof.positions.size(); ++v) {
    const Vec3d p = points[v];  // above
    const double left = (p.z - (10 - p.x)) * root, right = (p.z - (p.x - 10)) * root;
    EXPECT_NEAR(std::min(left, right), 1, 1e-9) << v;
  }
  EXPECT_EQ(std::ranges::count(find_twins(triangles, points.size()), kNone), 0);
}

}  // namespace
}  // namespace relief::detail
