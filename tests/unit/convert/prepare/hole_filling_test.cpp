// Patches over rims: closed, oriented with the surface, without edges that it has already.
#include "../shapes.h"

#include <relief/convert/prepare/hole_filling.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

namespace relief::detail {
namespace {

struct Closed {
  std::vector<Vec3d> points;
  std::vector<Face> faces;
  std::vector<std::size_t> begins;
};
Closed close_all(const TriangleMesh& open, Closing closing) {
  Closed closed{open.positions, open.triangles, {}};
  const auto rims = find_boundary_loops(closed.points.size(), closed.faces);
  closed.begins = fill_holes(closed.points, closed.faces, rims, std::vector<Closing>(rims.size(), closing));
  return closed;
}

/// Every directed edge once, and its opposite once.
void expect_closed(const Closed& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const Face& f : mesh.faces)
    for (std::size_t k = 0; k < 3; ++k) ++edges[{f[k], f[(k + 1) % 3]}];
  for (const auto& [edge, count] : edges) {
    ASSERT_EQ(count, 1) << edge.first << " " << edge.second;
    ASSERT_TRUE(edges.contains({edge.second, edge.first})) << edge.first << " " << edge.second;
  }
}

double volume(const Closed& mesh) {
  double six = 0;
  for (const Face& f : mesh.faces) six += dot(mesh.points[f[0]], cross(mesh.points[f[1]], mesh.points[f[2]]));
  return six / 6;
}

/// A tube of the given number of edges around, open at both ends.
TriangleMesh tube(int around) {
  return testing::bent_grid(around, 6, true, false, [](double u, double v) {
    const double a = 2 * std::numbers::pi * u;
    return Vec3d{std::cos(a), std::sin(a), v};
  });
}

TEST(Rims, RunAgainstTheSurface) {
  const TriangleMesh open = tube(12);
  const auto rims = find_boundary_loops(open.positions.size(), open.triangles);
  ASSERT_EQ(rims.size(), 2U);
  for (const auto& rim : rims) {
    ASSERT_EQ(rim.size(), 12U);
    for (std::size_t k = 0; k < rim.size(); ++k) {
      const auto runs = [&](std::uint32_t from, std::uint32_t to) {
        return std::any_of(open.triangles.begin(), open.triangles.end(), [&](const Triangle& t) {
          return (t[0] == from && t[1] == to) || (t[1] == from && t[2] == to) || (t[2] == from && t[0] == to);
        });
      };
      EXPECT_TRUE(runs(rim[(k + 1) % 12], rim[k]));
      EXPECT_FALSE(runs(rim[k], rim[(k + 1) % 12]));
    }
  }
  const TriangleMesh ball = testing::ball(8);
  EXPECT_TRUE(find_boundary_loops(ball.positions.size(), ball.triangles).empty());
}

TEST(Patch, ClosesFlatOpeningsFlat) {
  for (const int around : {3, 4, 5, 12, 60, 250, 700}) {
    const Closed mesh = close_all(tube(around), Closing::Patch);
    expect_closed(mesh);
    for (std::size_t v = 7 * static_cast<std::size_t>(around); v < mesh.points.size(); ++v) {
      const Vec3d p = mesh.points[v];
      EXPECT_TRUE(std::abs(p.z) < 1e-9 || std::abs(p.z - 1) < 1e-9);
      EXPECT_LT(std::hypot(p.x, p.y), 1);
    }
    const double flat = 0.5 * around * std::sin(2 * std::numbers::pi / around);
    EXPECT_NEAR(volume(mesh), flat, 1e-6 * flat) << around;
    // None of the patch's triangles looks back.
    for (std::size_t f = mesh.begins.front(); f < mesh.faces.size(); ++f) {
      const Vec3d a = mesh.points[mesh.faces[f][0]];
      const Vec3d n = cross(mesh.points[mesh.faces[f][1]] - a, mesh.points[mesh.faces[f][2]] - a);
      EXPECT_GT(a.z > 0.5 ? n.z : -n.z, 0);
    }
  }
}

TEST(Patch, BoxReachesBeyondThePart) {
  const TriangleMesh sheet = testing::sheet(12, 0.4);
  const Closed mesh = close_all(sheet, Closing::Box);
  expect_closed(mesh);
  double lowest = 0, floor = 0;
  for (std::size_t v = 0; v < mesh.points.size(); ++v)
    (v < sheet.positions.size() ? lowest : floor) =
        std::min(v < sheet.positions.size() ? lowest : floor, mesh.points[v].z);
  EXPECT_LT(floor, lowest - 0.02);
  EXPECT_GT(volume(mesh), 0);
}

TEST(Patch, BackIsThePartShiftedWithItsOtherPatches) {
  constexpr double kDepth = 0.05;
  TriangleMesh sheet = testing::sheet(12, 0.4);
  std::erase_if(sheet.triangles, [&](const Triangle& t) {
    return std::ranges::any_of(t,
                               [&](std::uint32_t v) { return length(sheet.positions[v] - Vec3d{0.5, 0.5, 0}) < 0.2; });
  });
  // Another part is no business of it.
  testing::append(sheet, testing::ball(6), {5, 0, 0});
  Closed mesh{sheet.positions, sheet.triangles, {}};
  auto rims = find_boundary_loops(mesh.points.size(), mesh.faces);
  ASSERT_EQ(rims.size(), 2U);
  std::ranges::sort(rims, {}, &std::vector<std::uint32_t>::size);
  mesh.begins =
      fill_holes(mesh.points, mesh.faces, rims, std::vector<Closing>{{Closing::Patch}, {Closing::OffsetCopy, kDepth}});
  expect_closed(mesh);
  const std::size_t hole = mesh.begins[1] - mesh.begins[0], ball = testing::ball(6).triangles.size();
  EXPECT_EQ(mesh.begins[2] - mesh.begins[1], sheet.triangles.size() - ball + hole + 2 * rims[1].size());
  Closed alone = mesh;
  std::erase_if(alone.faces, [&](const Face& f) { return mesh.points[f[0]].x > 2; });
  // Shifted along the normal of the plane of its rim, which is not level.
  Vec3d normal;
  for (std::size_t k = 0; k < rims[1].size(); ++k)
    normal += cross(mesh.points[rims[1][k]], mesh.points[rims[1][(k + 1) % rims[1].size()]]);
  EXPECT_NEAR(volume(alone), kDepth * length(normal) / 2, 1e-9);
}

TEST(Patch, TakesNoEdgeThatTheSurfaceHas) {
  // Two triangles folded along a diagonal: the patch over their rim of four must use the other one, or a new point.
  Closed mesh;
  mesh.points = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0.3}, {0, 1, 0}};
  mesh.faces = {{0, 1, 2}, {0, 2, 3}};
  const auto rims = find_boundary_loops(4, mesh.faces);
  fill_holes(mesh.points, mesh.faces, rims, std::vector<Closing>(1, Closing::Patch));
  expect_closed(mesh);
}

}  // namespace
}  // namespace relief::detail
