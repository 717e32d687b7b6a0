// Solids made anew: whatever the source, a closed surface comes out, and where the source was sound it stays in place.
#include "../shapes.h"

#include <relief/convert/convert.h>
#include <relief/convert/geometry/half_edges.h>
#include <relief/convert/geometry/winding_number.h>
#include <relief/convert/remesh/remesh.h>
#include <relief/convert/sample/source_rays.h>
#include <relief/mesh/repair.h>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>
#include <random>
#include <set>

namespace relief {
namespace {

using detail::remesh;
using detail::Remeshed;
using testing::append;
using testing::ball;
using testing::scaled;

constexpr double kBall = 4 * std::numbers::pi / 3;

Remeshed solid_of(const TriangleMesh& source, double voxel = 0) {
  const auto repaired = repair(source);
  EXPECT_TRUE(repaired);
  auto made = remesh(repaired->mesh, voxel, detail::Follow::Skin, {});
  EXPECT_TRUE(made) << made.error().message;
  return made ? *std::move(made) : Remeshed{};
}

bool is_closed(const TriangleMesh& mesh) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const Triangle& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k)
      if (!edges.emplace(t[k], t[(k + 1) % 3]).second) return false;
  return !edges.empty() &&
         std::ranges::all_of(edges, [&](const auto& e) { return edges.contains({e.second, e.first}); });
}

/// The greatest distance from a vertex of one mesh to the surface of the other.
double farthest(const TriangleMesh& from, const TriangleMesh& to) {
  const detail::Lattice lattice = detail::Lattice::around(bounds(from), 0.1);
  const detail::SourceRays surface(to.positions, to.triangles, lattice);
  double most = 0;
  for (const Vec3d p : from.positions) most = std::max(most, surface.nearest(lattice.to_lattice(p)).distance);
  return most * lattice.step;
}

/// Twelve edges, from corner to corner.
std::vector<std::pair<Vec3d, Vec3d>> edges_of(const TriangleMesh& box) {
  std::vector<std::pair<Vec3d, Vec3d>> edges;
  for (unsigned k = 0; k < 8; ++k)
    for (const unsigned bit : {1U, 2U, 4U})
      if ((k & bit) == 0) edges.emplace_back(box.positions[k], box.positions[k | bit]);
  return edges;
}

TriangleMesh moved(TriangleMesh mesh, Vec3d axis, double angle, Vec3d shift = {}) {
  const Vec3d n = normalized(axis) * std::sin(angle / 2);
  const Quatd q = {std::cos(angle / 2), n.x, n.y, n.z};
  for (Vec3d& p : mesh.positions) p = q.turn(p) + shift;
  return mesh;
}

/// How far the mesh is at most from places along the edges, ends included, model units.
double farthest_from_edges(const TriangleMesh& mesh, const std::vector<std::pair<Vec3d, Vec3d>>& edges) {
  TriangleMesh places;
  for (const auto& [a, b] : edges)
    for (int k = 0; k <= 100; ++k) places.positions.push_back(a + (b - a) * (k / 100.0));
  return farthest(places, mesh);
}

/// Edges of the mesh between triangles that turn back on each other.
std::size_t folds(const TriangleMesh& mesh) {
  const std::vector<std::uint32_t> twins = detail::find_twins(mesh.triangles, mesh.positions.size());
  const auto normal = [&](std::uint32_t t) {
    const auto& [a, b, c] = mesh.triangles[t];
    return normalized(cross(mesh.positions[b] - mesh.positions[a], mesh.positions[c] - mesh.positions[a]));
  };
  return static_cast<std::size_t>(std::count_if(twins.begin(), twins.end(), [&](const std::uint32_t& twin) {
    const auto h = static_cast<std::uint32_t>(&twin - twins.data());
    return dot(normal(h / 3), normal(twin / 3)) < -0.5;
  }));
}

void expect_the_box(const TriangleMesh& box, double voxel, const std::string& name) {
  const Remeshed made = solid_of(box, voxel);
  EXPECT_TRUE(is_closed(made.mesh)) << name;
  EXPECT_EQ(made.parts, 1U) << name;
  EXPECT_LT(farthest(made.mesh, box), 1e-6) << name;
  EXPECT_LT(farthest_from_edges(made.mesh, edges_of(box)), 1e-6) << name;
  EXPECT_NEAR(signed_volume(made.mesh), signed_volume(box), 1e-6) << name;
  EXPECT_EQ(folds(made.mesh), 0U) << name;
  EXPECT_EQ(made.on_skin, 1) << name;
  EXPECT_LT(std::max(made.to_skin, made.from_skin), 1e-6) << name;
}

TEST(Remesh, ABoxStaysTheBox) {
  const TriangleMesh box = testing::box({1, 0.8, 0.5});
  expect_the_box(box, 0, "along the axes");
  expect_the_box(box, 0.02, "faces as far apart as many voxels");
  expect_the_box(scaled(box, 1, {100, -70, 3}), 0.0237, "away from the origin");
  for (int k = 0; k < 30; ++k)
    expect_the_box(moved(box, {1.0 + k, 2, 3 - 0.3 * k}, 0.1 + 0.45 * k), 0.03, "turned, " + std::to_string(k));
}

TEST(Remesh, FacesOnTheGridAreNoMatter) {
  // The grid starts at a known margin off the source's box, so this box's upper faces lie on planes of it.
  constexpr double kVoxel = 0.02;
  const TriangleMesh box =
      testing::box({kVoxel * (50 - 0.381966011), kVoxel * (40 - 0.276393202), kVoxel * (30 - 0.447213595)});
  expect_the_box(box, kVoxel, "on the grid");
}

TEST(Remesh, ABallStaysABall) {
  const TriangleMesh source = ball(30);
  const Remeshed made = solid_of(source);
  EXPECT_TRUE(is_closed(made.mesh));
  EXPECT_EQ(made.parts, 1U);
  EXPECT_EQ(made.sheets + made.crumbs + made.rims, 0U);
  EXPECT_NEAR(signed_volume(made.mesh), signed_volume(source), 0.005 * kBall);
  EXPECT_LT(farthest(source, made.mesh), 0.3 * made.voxel);
  EXPECT_LT(farthest(made.mesh, source), 0.3 * made.voxel);
}

TEST(Remesh, BallsThatMeetBecomeOne) {
  TriangleMesh source = ball(24);
  append(source, ball(24), {0.8, 0, 0});
  const Remeshed made = solid_of(source, 0.03);
  EXPECT_TRUE(is_closed(made.mesh));
  EXPECT_EQ(made.parts, 1U);
  // Two caps of height 0.6 lie in both.
  const double both = 2 * std::numbers::pi * 0.36 * (3 - 0.6) / 3;
  EXPECT_NEAR(signed_volume(made.mesh), 2 * kBall - both, 0.02 * kBall);
}

TEST(Remesh, DoubledSkinsCountOnce) {
  TriangleMesh source = ball(24);
  append(source, ball(24), {}, 0.999);
  append(source, ball(24), {}, 1.001);
  const Remeshed made = solid_of(source, 0.03);
  EXPECT_TRUE(is_closed(made.mesh));
  EXPECT_EQ(made.parts, 1U);
  EXPECT_NEAR(signed_volume(made.mesh), kBall, 0.03 * kBall);
}

TEST(Remesh, ACavityStays) {
  TriangleMesh source = ball(24);
  append(source, testing::turned(ball(24)), {}, 0.5);
  const Remeshed made = solid_of(source, 0.03);
  EXPECT_EQ(made.parts, 2U);
  EXPECT_NEAR(signed_volume(made.mesh), kBall * 7 / 8, 0.02 * kBall);
}

TEST(Remesh, HolesAreClosedByAMembrane) {
  TriangleMesh source = ball(24);
  std::erase_if(source.triangles, [&](const Triangle& t) {
    return std::ranges::any_of(t, [&](std::uint32_t v) { return source.positions[v].z > 0.8; });
  });
  const Remeshed made = solid_of(source, 0.03);
  EXPECT_TRUE(is_closed(made.mesh));
  EXPECT_EQ(made.sheets, 0U);
  EXPECT_EQ(made.parts, 1U);
  const double cap = std::numbers::pi * 0.04 * (3 - 0.2) / 3;
  EXPECT_GT(signed_volume(made.mesh), kBall - 3 * cap);
  EXPECT_LT(signed_volume(made.mesh), kBall);
}

TEST(Remesh, SheetsGetAThicknessOfTwoVoxels) {
  const TriangleMesh sheet = testing::bent_grid(
      40, 40, false, false, [](double x, double y) { return Vec3d{x, y, 0.05 * std::sin(7 * x) * std::sin(5 * y)}; });
  const Remeshed made = solid_of(sheet, 0.02);
  EXPECT_TRUE(is_closed(made.mesh));
  EXPECT_EQ(made.sheets, 1U);
  EXPECT_NEAR(signed_volume(made.mesh), 1.03 * 2 * 0.02, 0.01);
  EXPECT_LT(farthest(made.mesh, sheet), 1.3 * made.voxel);
}

TEST(Remesh, LooseTrianglesOfASolidStillMakeASolid) {
  // No triangle shares a vertex with another, and between them are slits.
  const TriangleMesh joined = ball(16);
  TriangleMesh source;
  for (const Triangle& t : joined.triangles) {
    const auto first = static_cast<std::uint32_t>(source.positions.size());
    const Vec3d middle = (joined.positions[t[0]] + joined.positions[t[1]] + joined.positions[t[2]]) / 3.0;
    for (const std::uint32_t v : t) source.positions.push_back(middle + (joined.positions[v] - middle) * 0.98);
    source.triangles.push_back({first, first + 1, first + 2});
  }
  const Remeshed made = solid_of(source, 0.04);
  EXPECT_TRUE(is_closed(made.mesh));
  EXPECT_EQ(made.parts, 1U);
  EXPECT_NEAR(signed_volume(made.mesh), signed_volume(joined), 0.03 * kBall);
}

TEST(Remesh, SheetsThatTouchAtEdgesAndCornersComeApart) {
  // Four boxes whose edges and corners meet.
  const auto box = [](Vec3d low) {
    TriangleMesh mesh;
    for (unsigned k = 0; k < 8; ++k)
      mesh.positions.push_back(low + Vec3d{double(k & 1U), double(k >> 1U & 1U), double(k >> 2U)});
    mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                      {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    return mesh;
  };
  TriangleMesh source = box({0, 0, 0});
  append(source, box({1, 1, 0}));
  append(source, box({1, 0, 1}));
  append(source, box({-1, -1, -1}));
  ConvertSettings settings;
  settings.slabs = 100;
  settings.intervals = 8;
  settings.remesh = 0.02;
  const auto made = convert(source, settings);
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_TRUE(is_closed(made->mended));
  // Where four of them touch in a point a little is cut out and closed, which the verdict says.
  EXPECT_TRUE(testing::certificate(made->model.head->slab_mesh()).all());
  EXPECT_GT(made->report.coverage.share, 0.99) << verdict(made->report, made->model.info);
}

TEST(Remesh, CrossingBallsAreCertifiedAndKeepTheirColours) {
  TriangleMesh source = ball(30);
  append(source, ball(30), {0.9, 0.1, 0}, 0.8);
  for (const Vec3d p : source.positions)
    source.colours.push_back({static_cast<std::uint8_t>(std::clamp(100 * (p.x + 1), 0.0, 255.0)), 50, 200});
  ConvertSettings settings;
  settings.slabs = 100;
  settings.intervals = 16;
  settings.remesh = 0;
  const auto made = convert(source, settings);
  ASSERT_TRUE(made) << made.error().message;
  // Where four of them touch in a point a little is cut out and closed, which the verdict says.
  EXPECT_TRUE(testing::certificate(made->model.head->slab_mesh()).all());
  EXPECT_GT(made->report.coverage.share, 0.99) << verdict(made->report, made->model.info);
  ASSERT_TRUE(made->report.remesh);
  const ConvertReport::Remesh& report = *made->report.remesh;
  EXPECT_GT(report.voxel, 0.001);
  EXPECT_LT(made->report.to_source.max, report.voxel);
  EXPECT_GT(made->report.from_source.max, 0.1) << "what of each ball lies in the other is gone";
  EXPECT_EQ(made->report.hits_single, made->report.fibres_cast);
  const TriangleMesh out = to_mesh(*made->model.head);
  ASSERT_EQ(out.colours.size(), out.positions.size());
  for (std::size_t v = 0; v < out.positions.size(); v += 97)
    EXPECT_NEAR(out.colours[v].r, std::min(255.0, 100 * (out.positions[v].x + 1)), 8);
}

TEST(Remesh, BoxesThatOverlapKeepTheirEdgesAndGetTheOneBetweenThem) {
  TriangleMesh source = testing::box({1, 1, 1});
  const TriangleMesh second = scaled(testing::box({1, 0.6, 0.6}), 1, {0.5, 0.2, 0.25});
  append(source, second);
  const Remeshed made = solid_of(source, 0.02);
  EXPECT_TRUE(is_closed(made.mesh));
  EXPECT_EQ(made.parts, 1U);
  EXPECT_NEAR(signed_volume(made.mesh), 1 + 0.5 * 0.36, 1e-6);
  std::vector<std::pair<Vec3d, Vec3d>> edges = edges_of(testing::box({1, 1, 1}));
  const std::array<Vec3d, 4> ring = {Vec3d{1, 0.2, 0.25}, {1, 0.8, 0.25}, {1, 0.8, 0.85}, {1, 0.2, 0.85}};
  for (std::size_t k = 0; k < 4; ++k) edges.emplace_back(ring[k], ring[(k + 1) % 4]);
  for (auto [a, b] : edges_of(second))
    if (b.x > 1) edges.emplace_back(Vec3d{std::max(a.x, 1.0), a.y, a.z}, b);
  EXPECT_LT(farthest_from_edges(made.mesh, edges), 1e-6);
  EXPECT_LT(farthest(made.mesh, source), 1e-6);
  EXPECT_EQ(made.on_skin, 1);
}

TEST(Remesh, SolidsThatShareFacesBecomeOne) {
  TriangleMesh source = testing::box({1, 1, 1});
  append(source, testing::box({1, 1, 1}), {0.5, 0, 0});
  append(source, testing::box({0.5, 0.5, 0.5}), {0.25, 0.25, 1});
  const Remeshed made = solid_of(source, 0.025);
  EXPECT_TRUE(is_closed(made.mesh));
  EXPECT_EQ(made.parts, 1U);
  EXPECT_NEAR(signed_volume(made.mesh), 1.5 + 0.125, 1e-6);
}

TEST(Remesh, ATorusStaysATorus) {
  const TriangleMesh source = testing::torus(80, 40);
  const Remeshed made = solid_of(source, 0.08);
  EXPECT_TRUE(is_closed(made.mesh));
  EXPECT_EQ(made.mesh.positions.size() + made.mesh.triangles.size() - made.mesh.triangles.size() * 3 / 2, 0U);
  EXPECT_EQ(folds(made.mesh), 0U);
  EXPECT_LT(farthest(made.mesh, source), 0.01 * made.voxel);
  EXPECT_LT(farthest(source, made.mesh), 0.1 * made.voxel);
}

TEST(Remesh, APlateOfOneAndAHalfVoxelsIsNotTornWhateverItsDirection) {
  for (int k = 0; k < 6; ++k) {
    const TriangleMesh plate = moved(testing::box({1, 1, 0.03}), {1.0 + k, 2.0 - k, 0.4}, 0.5 * k);
    const Remeshed made = solid_of(plate, 0.02);
    EXPECT_TRUE(is_closed(made.mesh)) << k;
    EXPECT_EQ(made.parts, 1U) << k;
    EXPECT_EQ(made.mesh.positions.size() - made.mesh.triangles.size() / 2, 2U) << k << ": a hole";
    EXPECT_NEAR(signed_volume(made.mesh), 0.03, 1e-4) << k;
    EXPECT_LT(farthest(made.mesh, plate), 1e-3) << k;
    EXPECT_EQ(made.lost, 0) << k;
  }
}

TEST(Remesh, WhatIsThinnerThanAVoxelIsReported) {
  // On the ball stands a card much thinner than a voxel, between two planes of the grid.
  TriangleMesh source = ball(30);
  append(source, testing::box({0.015, 0.8, 0.8}), {0.11, 0.3, 0.9});
  const Remeshed made = solid_of(source, 0.04);
  EXPECT_GT(made.lost, 0.03);
  EXPECT_LT(made.lost, 0.12);
  EXPECT_GT(made.from_skin, 0.5);
  // Left to itself, the voxel is made for the walls.
  const TriangleMesh plate = testing::box({1, 1, 0.006});
  const Remeshed fine = solid_of(plate);
  EXPECT_LT(fine.voxel, 0.0045);
  EXPECT_EQ(fine.lost, 0);
}

/// A cube of side 1 with a fin on it, turned off the grid.
TriangleMesh finned_cube(double thickness, double width = 0.2, double height = 0.2) {
  TriangleMesh source = testing::box({1, 1, 1});
  append(source, testing::box({width, thickness, 0.1 + height}), {0.4, 0.5, 0.9});
  return moved(source, {0.6, -0.4, 1}, 0.4);
}

// One voxel for all of a solid follows its thin parts, of however little area, as far as voxels go.
TEST(Remesh, AThinFinOnAThickBodyIsKeptByDefault) {
  for (const double thickness : {0.012, 0.008}) {
    const TriangleMesh source = finned_cube(thickness);
    // The voxel that the cube alone gets tears the fin.
    const double coarse = diagonal(bounds(source)) / 150;
    ASSERT_GT(coarse, thickness);
    const Remeshed torn = solid_of(source, coarse);
    EXPECT_GT(torn.crumbs + torn.parts, 1U) << thickness;

    const Remeshed made = solid_of(source);
    EXPECT_NEAR(made.voxel, thickness / 1.5, 0.01 * thickness);
    EXPECT_TRUE(is_closed(made.mesh));
    EXPECT_EQ(made.parts, 1U);
    EXPECT_EQ(made.crumbs, 0U);
    EXPECT_EQ(made.lost, 0);
    EXPECT_NEAR(signed_volume(made.mesh), 1 + 0.2 * 0.2 * thickness, 1e-6);
    EXPECT_LT(made.from_skin, 1e-6);
  }
}

// Below its rim a fin is as thick as it is high or wide, which makes it no less of one.
TEST(Remesh, ANarrowFinIsKeptByDefault) {
  const Remeshed made = solid_of(finned_cube(0.012, 0.05, 0.5));
  EXPECT_NEAR(made.voxel, 0.008, 1e-4);
  EXPECT_EQ(made.parts, 1U);
  EXPECT_NEAR(signed_volume(made.mesh), 1 + 0.05 * 0.5 * 0.012, 1e-6);
}

TEST(Remesh, WhatIsTooThinForTheVoxelsThatAreAllowedCostsNone) {
  // Three hundred thousand voxels on a cube's faces have an edge of 0.0045, a fin of 0.003 wants 0.002.
  const TriangleMesh source = finned_cube(0.003);
  const Remeshed made = solid_of(source);
  EXPECT_NEAR(made.voxel, solid_of(moved(testing::box({1, 1, 1}), {0.6, -0.4, 1}, 0.4)).voxel, 0.1 * made.voxel);
  EXPECT_GT(made.lost, 0.005);
  // The place that is told is one of the fin.
  const Quatd back = {std::cos(0.2), normalized(Vec3d{0.6, -0.4, 1}).x * -std::sin(0.2),
                      normalized(Vec3d{0.6, -0.4, 1}).y * -std::sin(0.2),
                      normalized(Vec3d{0.6, -0.4, 1}).z * -std::sin(0.2)};
  const Vec3d at = back.turn(made.lost_at);
  EXPECT_NEAR(at.y, 0.5015, 0.0016);
  EXPECT_GT(at.z, 1 + made.voxel / 2);
}

TEST(Remesh, EdgesOfWedgesAndThickBodiesGetNoFinerVoxels) {
  const TriangleMesh cube = testing::box({1, 1, 1});
  EXPECT_DOUBLE_EQ(solid_of(cube).voxel, diagonal(bounds(cube)) / 150);
  TriangleMesh wedge = cube;  // its upper faces meet at 45 degrees
  for (Vec3d& p : wedge.positions)
    if (p.z == 1) p.x = 0;
  EXPECT_DOUBLE_EQ(solid_of(wedge).voxel, diagonal(bounds(wedge)) / 150);
}

// Sheets are made two voxels thick: the voxels that are wanted at most are those on both sides.
TEST(Remesh, ByDefaultTheSurfaceHasAHundredThousandVoxels) {
  TriangleMesh sheets;
  for (int k = 0; k < 20; ++k) {
    TriangleMesh plate = testing::box({1, 1, 1});
    std::erase_if(plate.triangles, [&](const Triangle& t) {
      return std::ranges::any_of(t, [&](std::uint32_t v) { return plate.positions[v].z > 0.5; });
    });
    if (k % 2 == 1)  // else they wind around what lies between them
      for (Triangle& t : plate.triangles) std::swap(t[1], t[2]);
    append(sheets, plate, {0, 0, 0.1 * k});
  }
  const Remeshed made = solid_of(sheets);
  EXPECT_GT(made.sheets, 15U);
  EXPECT_LT(surface_area(made.mesh), 1.1 * 1e5 * made.voxel * made.voxel);
}

TEST(Remesh, ABowlIsFilledToItsRim) {
  TriangleMesh source = ball(30);
  std::erase_if(source.triangles, [&](const Triangle& t) {
    return std::ranges::any_of(t, [&](std::uint32_t v) { return source.positions[v].z > 0.3; });
  });
  const Remeshed made = solid_of(source, 0.04);
  EXPECT_TRUE(is_closed(made.mesh));
  EXPECT_EQ(made.parts, 1U);
  EXPECT_LT(made.on_skin, 0.95);
  EXPECT_GT(made.on_skin, 0.5);
  const double full = std::numbers::pi * 1.25 * 1.25 * (3 - 1.25) / 3;
  EXPECT_NEAR(signed_volume(made.mesh), full, 0.1 * kBall);
}

bool is_in_box(const TriangleMesh& box, Vec3d p) {
  const Vec3d d = p - box.positions[0];
  for (const unsigned axis : {0U, 1U, 2U}) {
    const Vec3d side = box.positions[1U << axis] - box.positions[0];
    if (const double along = dot(d, side); along < 0 || along > dot(side, side)) return false;
  }
  return true;
}

/// Counted in a grid that has the faces of boxes along the axes between its cells, else in an even one.
double volume_of_union(const std::vector<TriangleMesh>& boxes, bool along_axes) {
  constexpr int kSide = 150;
  Box3d around;
  std::array<std::vector<double>, 3> cuts;
  for (const TriangleMesh& box : boxes) around.add(bounds(box));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (along_axes)
      for (const TriangleMesh& box : boxes)
        cuts[axis].insert(cuts[axis].end(), {bounds(box).low[axis], bounds(box).high[axis]});
    else
      for (int k = 0; k <= kSide; ++k) cuts[axis].push_back(around.low[axis] + around.extent()[axis] * k / kSide);
    std::ranges::sort(cuts[axis]);
  }
  double volume = 0;
  for (std::size_t x = 1; x < cuts[0].size(); ++x)
    for (std::size_t y = 1; y < cuts[1].size(); ++y)
      for (std::size_t z = 1; z < cuts[2].size(); ++z) {
        const Vec3d low = {cuts[0][x - 1], cuts[1][y - 1], cuts[2][z - 1]}, high = {cuts[0][x], cuts[1][y], cuts[2][z]};
        if (std::ranges::any_of(boxes, [&](const TriangleMesh& box) { return is_in_box(box, (low + high) / 2.0); }))
          volume += (high.x - low.x) * (high.y - low.y) * (high.z - low.z);
      }
  return volume;
}

TEST(Remesh, RandomBoxesBecomeTheirUnion) {
  // The first along the axes, whose union is known exactly.
  for (unsigned seed = 1; seed <= 4; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> share(0, 1);
    TriangleMesh source;
    std::vector<TriangleMesh> boxes;
    for (int k = 0; k < 8; ++k) {
      const Vec3d size = {0.2 + 0.5 * share(random), 0.2 + 0.5 * share(random), 0.2 + 0.5 * share(random)};
      const TriangleMesh box = moved(testing::box(size), {share(random), share(random), share(random)},
                                     seed == 1 ? 0 : 6 * share(random), {share(random), share(random), share(random)});
      boxes.push_back(box);
      append(source, box);
    }
    const Remeshed made = solid_of(source, 0.025);
    EXPECT_TRUE(is_closed(made.mesh)) << seed;
    const double volume = volume_of_union(boxes, seed == 1);
    EXPECT_NEAR(signed_volume(made.mesh), volume, (seed == 1 ? 2e-5 : 0.004) * volume) << seed;
    EXPECT_LT(farthest(made.mesh, source), 0.5 * made.voxel) << seed;
  }
}

TEST(Remesh, ManyThreadsMakeTheSameSolid) {
  TriangleMesh source = ball(30, 0.1);
  append(source, ball(30, 0.1), {0.7, 0.2, 0});
  const Remeshed many = solid_of(source);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const Remeshed alone = solid_of(source);
  EXPECT_EQ(many.mesh.triangles, alone.mesh.triangles);
  EXPECT_EQ(many.mesh.positions, alone.mesh.positions);
}

TEST(Remesh, RefusesTooSmallVoxelsAndStopsWhenAsked) {
  const TriangleMesh source = ball(16);
  const auto refused = remesh(source, 1e-4, detail::Follow::Skin, {});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, Errc::InvalidArgument);
  const std::atomic<bool> stop = true;
  const auto stopped = remesh(source, 0, detail::Follow::Skin, {.report = {}, .cancel = &stop});
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, Errc::Cancelled);
}

TEST(Remesh, StopsInEachPhase) {
  const TriangleMesh source = ball(16);
  for (const double when : {0.1, 0.3, 0.6, 0.75}) {
    std::atomic<bool> stop = false;
    const auto stopped =
        remesh(source, 0, detail::Follow::Skin,
               {.report = [&](std::string_view, double share) { stop = share > when; }, .cancel = &stop});
    ASSERT_FALSE(stopped) << when;
    EXPECT_EQ(stopped.error().code, Errc::Cancelled) << when;
  }
}

TEST(WindingNumber, CountsHowOftenAMeshGoesAround) {
  TriangleMesh mesh = ball(30);
  append(mesh, ball(30), {}, 0.5);
  const detail::WindingNumber winding(mesh.positions, mesh.triangles);
  EXPECT_NEAR(winding.at({0, 0, 0.2}), 2, 0.05);
  EXPECT_NEAR(winding.at({0.7, 0, 0}), 1, 0.05);
  EXPECT_NEAR(winding.at({0, 1.1, 0}), 0, 0.05);
  EXPECT_NEAR(winding.at({0, 30, 7}), 0, 0.001);
  std::erase_if(mesh.triangles, [&](const Triangle& t) { return mesh.positions[t[0]].z > 0; });
  const detail::WindingNumber open(mesh.positions, mesh.triangles);
  EXPECT_NEAR(open.at({0, 0, 0}), 1, 0.12) << "half of two";
  EXPECT_EQ(detail::WindingNumber({}, {}).at({1, 2, 3}), 0);
}

void expect_near_the_sum(const detail::WindingNumber& winding, const TriangleMesh& mesh) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> share(-1.5, 1.5);
  for (int k = 0; k < 2000; ++k) {
    const Vec3d p = {share(random), share(random), share(random)};
    double sum = 0;
    for (const Triangle& t : mesh.triangles) {
      const Vec3d a = mesh.positions[t[0]] - p, b = mesh.positions[t[1]] - p, c = mesh.positions[t[2]] - p;
      const double la = length(a), lb = length(b), lc = length(c);
      sum += 2 * std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
    }
    EXPECT_NEAR(winding.at(p), sum / (4 * std::numbers::pi), 0.05) << p.x << ' ' << p.y << ' ' << p.z;
  }
}

TEST(WindingNumber, StaysNearTheSumOverAllTriangles) {
  TriangleMesh mesh = ball(60);
  std::erase_if(mesh.triangles, [&](const Triangle& t) { return mesh.positions[t[0]].z > 0.8; });
  append(mesh, ball(7), {0.9, 0.2, 0}, 0.3);
  const std::size_t flat = mesh.triangles.size() / 3;
  for (std::uint32_t k = 0; k < 40; ++k)
    mesh.triangles.insert(mesh.triangles.begin() + std::ptrdiff_t(flat), {k, k, k});
  detail::WindingNumber winding(mesh.positions, mesh.triangles);
  expect_near_the_sum(winding, mesh);

  // One side is pressed in, deeper than the small ball in it.
  std::vector<std::uint8_t> moved;
  for (Vec3d& p : mesh.positions) {
    moved.push_back(p.x > 0.3);
    if (moved.back() != 0) p.x -= 0.7 * (p.x - 0.3);
  }
  winding.update(moved);
  expect_near_the_sum(winding, mesh);
}

}  // namespace
}  // namespace relief
