#include "mesh_checks.h"
#include "support/blocks.h"

#include <relief/mesh/repair.h>

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <limits>
#include <random>

namespace relief {
namespace {

using testing::append;
using testing::box;

Repaired repaired(const TriangleMesh& soup) {
  auto result = repair(soup);
  EXPECT_TRUE(result.has_value()) << result.error().message;
  if (!result) return {};
  EXPECT_EQ(testing::manifold_fault(result->mesh), "");
  return *std::move(result);
}

TriangleMesh soup_of(const TriangleMesh& mesh) {
  TriangleMesh soup;
  for (const Triangle& t : mesh.triangles) {
    for (const std::uint32_t corner : t) soup.positions.push_back(mesh.positions[corner]);
    const auto last = static_cast<std::uint32_t>(soup.positions.size() - 1);
    soup.triangles.push_back({last - 2, last - 1, last});
  }
  return soup;
}

TEST(Repair, LeavesACleanMeshAlone) {
  TriangleMesh mesh = box({0, 0, 0}, {1, 2, 3});
  for (std::uint8_t k = 0; k < 8; ++k) mesh.colours.push_back({k, k, k, k});
  mesh.unit = Unit::Centimetre;
  const Repaired out = repaired(mesh);
  EXPECT_EQ(out.mesh.unit, Unit::Centimetre);
  EXPECT_EQ(out.mesh.positions, mesh.positions);
  EXPECT_EQ(out.mesh.triangles, mesh.triangles);
  EXPECT_EQ(out.mesh.colours, mesh.colours);
  EXPECT_EQ(to_string(out.report), "");
  EXPECT_EQ(out.report.parts, 1U);
  EXPECT_EQ(out.report.boundary_loops, 0U);
}

TEST(Repair, WeldsEqualPositionsAndSignedZeros) {
  TriangleMesh soup = soup_of(box({0, 0, 0}, {1, 2, 3}));
  for (std::size_t k = 0; k < soup.positions.size(); k += 2) {
    if (soup.positions[k].x == 0.0) soup.positions[k].x = -0.0;
  }
  const Repaired out = repaired(soup);
  EXPECT_EQ(out.mesh.positions.size(), 8U);
  EXPECT_EQ(out.report.welded_vertices, 28U);
  EXPECT_EQ(out.report.boundary_loops, 0U);
  EXPECT_EQ(to_string(out.report), "28 vertices welded");
}

/// A ball of radius 1: a cube of grids, blown up.
TriangleMesh ball(std::uint32_t steps) {
  TriangleMesh mesh;
  for (int side = 0; side < 6; ++side) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (std::uint32_t j = 0; j <= steps; ++j)
      for (std::uint32_t i = 0; i <= steps; ++i) {
        const double u = 2.0 * i / steps - 1, v = 2.0 * j / steps - 1, w = side < 3 ? 1 : -1;
        const Vec3d p = {w, w * u, v};
        mesh.positions.push_back(normalized(side % 3 == 0   ? p
                                            : side % 3 == 1 ? Vec3d{p.z, p.x, p.y}
                                                            : Vec3d{p.y, p.z, p.x}));
      }
    for (std::uint32_t j = 0; j < steps; ++j)
      for (std::uint32_t i = 0; i < steps; ++i) {
        const std::uint32_t a = first + j * (steps + 1) + i, b = a + 1, c = a + steps + 1, d = c + 1;
        mesh.triangles.push_back({a, b, d});
        mesh.triangles.push_back({a, d, c});
      }
  }
  return mesh;
}

/// Each triangle with corners of its own, each moved by up to `most` along each axis.
TriangleMesh jittered(const TriangleMesh& mesh, double most, std::uint32_t seed) {
  TriangleMesh soup = soup_of(mesh);
  std::mt19937 random(seed);
  for (Vec3d& p : soup.positions)
    for (std::size_t k = 0; k < 3; ++k) p[k] += most * (2.0 * double(random()) / 4294967295.0 - 1);
  return soup;
}

TEST(Repair, SewsSeamsThatLieNearlyOnEachOther) {
  const TriangleMesh clean = repaired(soup_of(ball(16))).mesh;
  const TriangleMesh whole = box({0, 0, 0}, {1, 2, 3});
  for (const double most : {1e-12, 1e-9, 2e-7}) {
    TriangleMesh soup = jittered(clean, most, 3);
    soup.colours.resize(soup.positions.size(), {1, 2, 3, 4});
    const Repaired out = repaired(soup);
    EXPECT_EQ(out.report.parts, 1U);
    EXPECT_EQ(out.report.boundary_loops, 0U);
    EXPECT_EQ(out.mesh.triangles.size(), clean.triangles.size());
    EXPECT_EQ(out.mesh.positions.size(), clean.positions.size());
    EXPECT_EQ(out.mesh.colours.size(), clean.positions.size());
    EXPECT_EQ(out.report.sewn_vertices + out.report.welded_vertices + out.mesh.positions.size(), soup.positions.size());
    EXPECT_EQ(out.report.unused_vertices, 0U);
    EXPECT_GT(out.report.sewn_most, 0.1 * most);
    EXPECT_LE(out.report.sewn_most, most);  // 2 sqrt(3) of it, and the diagonal is as long
    EXPECT_NEAR(signed_volume(out.mesh), signed_volume(clean), 10 * most);
    EXPECT_EQ(repaired(jittered(whole, most, 5)).mesh.positions.size(), 8U);
  }
  // Far from the origin, in single precision.
  TriangleMesh far = clean;
  for (Vec3d& p : far.positions) p += Vec3d{5, -7, 3};
  far = jittered(far, 3e-7, 7);
  for (Vec3d& p : far.positions) p = to_double(to_float(p));
  const Repaired out = repaired(far);
  EXPECT_EQ(out.report.boundary_loops, 0U);
  EXPECT_EQ(out.report.parts, 1U);
}

TEST(Repair, SaysHowManyVerticesOfSeamsWereWelded) {
  TriangleMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1e-7, 0}, {0, 1, 1e-7}, {1, 1, 0}};
  mesh.triangles = {{0, 1, 2}, {3, 5, 4}};
  const Repaired out = repaired(mesh);
  EXPECT_EQ(out.report.sewn_vertices, 2U);
  EXPECT_EQ(out.report.boundary_loops, 1U);
  EXPECT_EQ(to_string(out.report), "2 vertices of open edges welded to others up to 7.1e-08 of the diagonal away");
  EXPECT_EQ(out.mesh.positions[1], mesh.positions[1]) << "the first one stays";
}

TEST(Repair, FindsSeamsWhereverTheyLie) {
  std::mt19937 random(17);
  const auto between = [&](double low, double high) { return low + (high - low) * double(random()) / 4294967295.0; };
  for (int round = 0; round < 4000; ++round) {
    // An edge as long as the box beside it, or so short that the size of cells goes by its length.
    TriangleMesh mesh;
    const double size = round % 2 == 0 ? 1.0 : between(0x1p-15, 0x1p-14);
    const Vec3d at = {between(0, 1), between(0, 1), 2}, off = {between(-6e-7, 6e-7), between(-6e-7, 6e-7), 0};
    mesh.positions = {at,
                      at + Vec3d{size, 0, 0},
                      at + Vec3d{0, size, 0},
                      at + Vec3d{size, 0, 0} + off,
                      at + Vec3d{0, 0, between(-6e-7, 6e-7)},
                      at + Vec3d{size, -size, 0}};
    mesh.triangles = {{0, 1, 2}, {3, 4, 5}};
    append(mesh, box({0, 0, 0}, {1, 1, 1}));
    const Repaired out = repaired(mesh);
    ASSERT_EQ(out.report.sewn_vertices, 2U) << "round " << round;
    ASSERT_EQ(out.report.boundary_loops, 1U) << "round " << round;
  }
}

TEST(Repair, SewsNothingThatWouldGoTooFar) {
  // A spiral stair around the z axis: each step begins 4e-7 above where the last one ends, all of it 5e-6.
  TriangleMesh stair;
  for (int k = 0; k < 12; ++k) {
    const auto first = static_cast<std::uint32_t>(stair.positions.size());
    for (const double angle : {0.5 * k, 0.5 * (k + 1)})
      stair.positions.push_back({std::cos(angle), std::sin(angle), 4e-7 * k});
    stair.positions.push_back({0, 0, 4e-7 * k});
    stair.triangles.push_back({first, first + 1, first + 2});
  }
  EXPECT_EQ(repaired(stair).report.sewn_vertices, 0U);
  stair.triangles.resize(3);
  EXPECT_EQ(repaired(stair).report.sewn_vertices, 4U) << "so few steps lie near enough";

  // Two sheets that cross along a to b, and whose open edges lie along each other beyond a and beyond b: sewn there,
  // four triangles would have the edge a b.
  TriangleMesh cross;
  cross.positions = {{-1, 0, 0}, {0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0.5, 1, 0}, {0.5, -1, 0}};
  cross.triangles = {{1, 2, 4}, {2, 1, 5}, {0, 1, 4}, {2, 3, 4}};
  for (std::size_t k = 0; k < 4; ++k) cross.positions.push_back(cross.positions[k] + Vec3d{1e-7, 0, 1e-7});
  cross.positions.insert(cross.positions.end(), {{0.5, 0, 1}, {0.5, 0, -1}});
  cross.triangles.insert(cross.triangles.end(), {{7, 8, 10}, {8, 7, 11}, {7, 6, 11}, {9, 8, 11}});
  const Repaired out = repaired(cross);
  EXPECT_EQ(out.report.sewn_vertices, 0U);
  EXPECT_EQ(out.report.split_edges, 0U);
  EXPECT_EQ(out.mesh.triangles, cross.triangles);
}

TEST(Repair, WhatIsNoSeamStaysOpen) {
  const auto stays = [](const TriangleMesh& mesh, const char* what) {
    const Repaired out = repaired(mesh);
    EXPECT_EQ(out.report.sewn_vertices, 0U) << what;
    EXPECT_EQ(out.mesh.positions, mesh.positions) << what;
    EXPECT_EQ(out.mesh.triangles, mesh.triangles) << what;
  };
  // A gap that is wider than a millionth, and one that is wide for its triangles.
  for (const double size : {1.0, 1e-6}) {
    TriangleMesh mesh;
    const double gap = size == 1.0 ? 1e-5 : 0.2 * size;
    mesh.positions = {{0, 0, 0}, {size, 0, 0}, {0, size, 0}, {size, gap, 0}, {0, size + gap, 0}, {size, size + gap, 0}};
    mesh.triangles = {{0, 1, 2}, {3, 5, 4}};
    if (size < 1.0) append(mesh, box({1, 1, 1}, {2, 2, 2}));
    stays(mesh, "gap");
  }
  // Three sheets that meet in an edge, and a sheet that runs along another the same way.
  TriangleMesh three;
  three.positions = {{0, 0, 0},  {1, 0, 0},    {0, 1, 0},    {1, 1e-9, 0}, {0, 1e-9, 0},
                     {0, -1, 0}, {0, 0, 1e-9}, {1, 0, 1e-9}, {0, 0, 1}};
  three.triangles = {{0, 1, 2}, {3, 4, 5}, {6, 7, 8}};
  stays(three, "three sheets");
  three.triangles[1] = {4, 3, 5};
  three.triangles.pop_back();
  three.positions.resize(6);
  stays(three, "same way");
  // A sheet that is there twice, looking both ways, with its corners a little off.
  TriangleMesh twice;
  twice.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1e-9}, {1, 0, 1e-9}, {0, 1, 1e-9}};
  twice.triangles = {{0, 1, 2}, {3, 5, 4}};
  stays(twice, "twice");
}

TEST(Repair, AJitteredTangleBecomesAnOrientedManifold) {
  std::mt19937 engine(11);
  const auto random = [&](std::uint32_t below) { return static_cast<std::uint32_t>(engine()) % below; };
  std::size_t sewn = 0;
  for (int round = 0; round < 200; ++round) {
    TriangleMesh tangle;
    const std::uint32_t points = 4 + random(20);
    for (std::uint32_t k = 0; k < points; ++k)
      tangle.positions.push_back({double(random(3)), double(random(3)), double(random(3))});
    for (std::uint32_t k = 0, end = 3 + random(40); k < end; ++k)
      tangle.triangles.push_back({random(points), random(points), random(points)});
    const TriangleMesh soup = jittered(tangle, round % 2 == 0 ? 1e-8 : 4e-7, static_cast<std::uint32_t>(round));
    const auto result = repair(soup);
    if (!result) continue;
    ASSERT_EQ(testing::manifold_fault(result->mesh), "") << "round " << round;
    EXPECT_LE(result->report.sewn_most, 1e-6);
    sewn += result->report.sewn_vertices;
  }
  EXPECT_GT(sewn, 500U);
}

TEST(Repair, SaysWhereSheetsLieAlongEachOtherWithoutCommonCorners) {
  // Two strips along x that meet at y = 0, one in three pieces and one in four.
  const auto strip = [](std::uint32_t pieces, double y) {
    TriangleMesh mesh;
    for (std::uint32_t k = 0; k <= pieces; ++k)
      for (const double v : {std::min(y, 0.0), std::max(y, 0.0)})
        mesh.positions.push_back({double(k) / pieces, v, 0.1 * v});
    for (std::uint32_t k = 0; k < pieces; ++k) {
      mesh.triangles.push_back({2 * k, 2 * k + 2, 2 * k + 3});
      mesh.triangles.push_back({2 * k, 2 * k + 3, 2 * k + 1});
    }
    return mesh;
  };
  TriangleMesh mesh = strip(3, 1);
  EXPECT_EQ(repaired(mesh).report.corners_on_edges, 0U);
  append(mesh, strip(4, -1));
  const Repaired out = repaired(mesh);
  EXPECT_EQ(out.report.corners_on_edges, 5U);  // of the one 2, of the other 3
  EXPECT_EQ(out.report.sewn_vertices, 0U);
  EXPECT_NE(to_string(out.report).find("5 corners of open edges lie on other open edges"), std::string::npos)
      << to_string(out.report);
  TriangleMesh apart = strip(3, 1);
  for (Vec3d& p : apart.positions) p.y += 1e-4;
  append(apart, strip(4, -1));
  EXPECT_EQ(repaired(apart).report.corners_on_edges, 0U);
}

TEST(Repair, DropsWhatIsNotThereAndCountsIt) {
  TriangleMesh mesh = box({0, 0, 0}, {1, 1, 1});
  mesh.positions.push_back({std::nan(""), 0, 0});
  mesh.positions.push_back({0, std::numeric_limits<double>::infinity(), 0});
  mesh.positions.push_back({5, 5, 5});
  mesh.triangles.push_back({0, 1, 8});
  mesh.triangles.push_back({9, 1, 2});
  mesh.triangles.push_back({3, 3, 1});
  mesh.triangles.push_back({2, 1, 0});  // the first one, the other way round
  const Repaired out = repaired(mesh);
  EXPECT_EQ(out.report.nonfinite_triangles, 2U);
  EXPECT_EQ(out.report.degenerate_triangles, 1U);
  EXPECT_EQ(out.report.duplicate_triangles, 1U);
  EXPECT_EQ(out.report.unused_vertices, 1U);
  EXPECT_EQ(out.mesh.triangles.size(), 12U);
  EXPECT_DOUBLE_EQ(signed_volume(out.mesh), 1.0);
}

TEST(Repair, FlatTrianglesDoNotOpenTheMesh) {
  // The top of a box with a point in the middle of one edge: a triangle without area closes the gap to the side below.
  for (const double shift : {0.0, 1e6, 0.1}) {
    TriangleMesh mesh = box({shift, shift, shift}, {shift + 1, shift + 1, shift + 1});
    const auto m = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.push_back((mesh.positions[4] + mesh.positions[5]) * 0.5);
    std::erase(mesh.triangles, Triangle{4, 5, 6});
    mesh.triangles.push_back({4, m, 6});
    mesh.triangles.push_back({m, 5, 6});
    mesh.triangles.push_back({4, 5, m});
    const Repaired out = repaired(mesh);
    EXPECT_EQ(out.report.boundary_loops, 0U);
    EXPECT_EQ(out.report.flipped_triangles, 1U);
    EXPECT_EQ(out.report.degenerate_triangles, 0U);
    EXPECT_NEAR(signed_volume(out.mesh), 1.0, 1e-9);
  }
}

TEST(Repair, TinyTrianglesFarAwayAreNotFlat) {
  const TriangleMesh mesh = box({5e5, 4e6, 0}, {5e5 + 1e-6, 4e6 + 1e-6, 1e-6});
  EXPECT_EQ(repaired(mesh).mesh.triangles.size(), 12U);
}

TEST(Repair, OrientsShuffledTriangles) {
  TriangleMesh mesh = box({0, 0, 0}, {1, 1, 1});
  for (std::size_t k = 0; k < mesh.triangles.size(); k += 3) std::swap(mesh.triangles[k][0], mesh.triangles[k][1]);
  const Repaired out = repaired(mesh);
  EXPECT_EQ(out.report.turned_triangles, 4U);
  EXPECT_DOUBLE_EQ(signed_volume(out.mesh), 1.0);
}

TEST(Repair, TurnsInsideOutParts) {
  TriangleMesh mesh;
  append(mesh, box({0, 0, 0}, {1, 1, 1}), true);
  append(mesh, box({2, 0, 0}, {3, 1, 1}));
  const Repaired out = repaired(mesh);
  EXPECT_EQ(out.report.turned_parts, 1U);
  EXPECT_EQ(out.report.parts, 2U);
  EXPECT_DOUBLE_EQ(signed_volume(out.mesh), 2.0);
}

TEST(Repair, CavitiesStayCavities) {
  const TriangleMesh outer = box({0, 0, 0}, {4, 4, 4});
  const TriangleMesh inner = box({1, 1, 1}, {3, 3, 3});
  const TriangleMesh island = box({1.5, 1.5, 1.5}, {2.5, 2.5, 2.5});
  struct Case {
    bool outer_turned, inner_turned, island_turned;
    double volume;
  };
  for (const Case& c : {Case{false, true, false, 64 - 8 + 1},   // a hollow box with an island: nothing to do
                        Case{true, false, true, 64 - 8 + 1},    // all of it inside out
                        Case{false, true, true, 64 - 8 + 1},    // only the island inside out
                        Case{false, false, false, 64 + 8 + 1},  // solids in solids stay so
                        Case{true, true, true, 64 + 8 + 1}}) {
    TriangleMesh mesh;
    append(mesh, inner, c.inner_turned);  // not in order of size
    append(mesh, outer, c.outer_turned);
    append(mesh, island, c.island_turned);
    EXPECT_NEAR(signed_volume(repaired(mesh).mesh), c.volume, 1e-12);
  }
}

TEST(Repair, OverlappingPartsAreNotNested) {
  TriangleMesh mesh;
  append(mesh, box({0, 0, 0}, {4, 4, 4}));
  append(mesh, box({2, 2, 2}, {5, 5, 5}), true);
  EXPECT_DOUBLE_EQ(signed_volume(repaired(mesh).mesh), 64.0 + 27.0);
}

TEST(Repair, BoxesThatShareAnEdgeComeApartClosed) {
  TriangleMesh mesh;
  append(mesh, box({0, 0, 0}, {1, 1, 1}));
  append(mesh, box({1, 1, 0}, {2, 2, 1}));
  const Repaired out = repaired(mesh);
  EXPECT_EQ(out.report.split_edges, 1U);
  EXPECT_EQ(out.report.split_vertices, 2U);
  EXPECT_EQ(out.report.parts, 2U);
  EXPECT_EQ(out.report.boundary_loops, 0U);
  EXPECT_DOUBLE_EQ(signed_volume(out.mesh), 2.0);
}

TEST(Repair, BoxesThatShareACornerComeApart) {
  TriangleMesh mesh;
  append(mesh, box({0, 0, 0}, {1, 1, 1}));
  append(mesh, box({1, 1, 1}, {2, 2, 2}));
  const Repaired out = repaired(mesh);
  EXPECT_EQ(out.report.split_vertices, 1U);
  EXPECT_EQ(out.mesh.positions.size(), 16U);
  EXPECT_EQ(out.report.parts, 2U);
}

TEST(Repair, BoxesThatShareAFaceBothKeepIt) {
  const TriangleMesh low = box({0, 0, 0}, {1, 1, 1});
  TriangleMesh high = box({0, 0, 1}, {1, 1, 2});
  for (const bool same_diagonal : {true, false}) {
    // The top of the one has corners 4 to 7, the bottom of the other 0 to 3.
    if (!same_diagonal) high.triangles[0] = {0, 2, 3}, high.triangles[1] = {0, 3, 1};
    TriangleMesh mesh = low;
    append(mesh, high);
    const Repaired out = repaired(mesh);
    EXPECT_EQ(out.report.parts, 2U) << same_diagonal;
    EXPECT_EQ(out.report.boundary_loops, 0U);
    EXPECT_EQ(out.report.duplicate_triangles, 0U);
    EXPECT_EQ(out.mesh.triangles.size(), 24U);
    EXPECT_EQ(out.mesh.positions.size(), 16U);
    EXPECT_DOUBLE_EQ(signed_volume(out.mesh), 2.0);
  }
}

TEST(Repair, ABoxInsideOutBesideAnotherIsTurnedBeforeTheirFaceIsSharedOut) {
  for (const bool same_diagonal : {true, false})
    for (const bool first : {true, false}) {
      TriangleMesh low = box({0, 0, 0}, {1, 1, 1}), high = box({0, 0, 1}, {1, 1, 2});
      if (!same_diagonal) high.triangles[0] = {0, 2, 3}, high.triangles[1] = {0, 3, 1};
      for (Triangle& t : (first ? low : high).triangles) std::swap(t[1], t[2]);
      TriangleMesh mesh = low;
      append(mesh, high);
      const Repaired out = repaired(mesh);
      EXPECT_EQ(out.report.parts, 2U) << same_diagonal << first;
      EXPECT_EQ(out.report.boundary_loops, 0U);
      EXPECT_EQ(out.report.duplicate_triangles, 0U);
      EXPECT_EQ(out.report.turned_parts, 1U);
      EXPECT_EQ(out.mesh.triangles.size(), 24U);
      EXPECT_DOUBLE_EQ(signed_volume(out.mesh), 2.0);
    }
}

TEST(Repair, ACavityThatTouchesTheSurfaceInAnEdgeStaysACavity) {
  TriangleMesh mesh = box({0, 0, 0}, {1, 1, 1});
  TriangleMesh cavity = box({0, 0, 0}, {0.5, 0.5, 1});
  // Only its edge along z lies on that of the box: pulled off the faces.
  for (Vec3d& p : cavity.positions)
    if (p.x > 0 || p.y > 0) p = {p.x * 0.5 + 0.2, p.y * 0.5 + 0.2, p.z * 0.5 + 0.25};
  for (Triangle& t : cavity.triangles) std::swap(t[1], t[2]);
  const double hollow = signed_volume(cavity);
  append(mesh, cavity);
  EXPECT_NEAR(signed_volume(repaired(mesh).mesh), 1 + hollow, 1e-12);
}

TEST(Repair, BlocksThatShareFacesComeApartAsSolids) {
  std::mt19937 random(5);
  std::size_t shared = 0;
  for (int round = 0; round < 200; ++round) {
    // Aligned and, in single precision, askew.
    const auto place = [&](Vec3d p) {
      if (round % 2 == 0) return p;
      const Vec3d q = {0.36 * p.x - 0.8 * p.y + 0.48 * p.z, 0.48 * p.x + 0.6 * p.y + 0.64 * p.z,
                       -0.8 * p.x + 0.6 * p.z};
      return Vec3d{double(float(q.x)), double(float(q.y)), double(float(q.z))};
    };
    const auto blocks = testing::random_blocks(2 + round % 3, 1 + round % 4, random, place);
    if (blocks.cubes == 0) continue;
    const Repaired out = repaired(blocks.mesh);
    EXPECT_EQ(out.report.boundary_loops, 0U) << "round " << round;
    EXPECT_EQ(out.report.duplicate_triangles, 0U) << "round " << round;
    EXPECT_EQ(out.report.turned_triangles, 0U) << "round " << round;
    EXPECT_NEAR(signed_volume(out.mesh), double(blocks.cubes), 1e-4) << "round " << round;
    EXPECT_NEAR(testing::area(out.mesh), testing::area(blocks.mesh), 1e-4) << "round " << round;
    shared += blocks.shared_faces;
  }
  EXPECT_GT(shared, 1000U);
}

TEST(Repair, ASheetThatIsThereTwiceIsOne) {
  TriangleMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 2, 1}, {0, 3, 2}};
  EXPECT_EQ(repaired(mesh).mesh.triangles.size(), 2U);
  // A box, and the same once more inside out.
  TriangleMesh twice = box({0, 0, 0}, {1, 1, 1});
  append(twice, box({0, 0, 0}, {1, 1, 1}), true);
  const Repaired out = repaired(twice);
  EXPECT_EQ(out.report.duplicate_triangles, 12U);
  EXPECT_DOUBLE_EQ(signed_volume(out.mesh), 1.0);
}

TEST(Repair, AFinOnASolidIsCutOff) {
  TriangleMesh mesh = box({0, 0, 0}, {1, 1, 1});
  mesh.positions.push_back({0.5, -1, -1});
  mesh.triangles.push_back({0, 1, 8});
  const Repaired out = repaired(mesh);
  EXPECT_EQ(out.report.split_edges, 1U);
  EXPECT_EQ(out.report.parts, 2U);
  EXPECT_EQ(out.report.boundary_loops, 1U) << "the box stays closed, the fin has a rim";
}

TEST(Repair, AMoebiusStripIsCutOnce) {
  TriangleMesh mesh;
  constexpr std::uint32_t kSteps = 24;
  for (std::uint32_t k = 0; k < kSteps; ++k) {
    const double a = 2 * 3.14159265358979 * k / kSteps;
    for (const double side : {-0.3, 0.3}) {
      const double r = 1 + side * std::cos(a / 2);
      mesh.positions.push_back({r * std::cos(a), r * std::sin(a), side * std::sin(a / 2)});
    }
  }
  for (std::uint32_t k = 0; k < kSteps; ++k) {
    const bool last = k + 1 == kSteps;
    const std::uint32_t a = 2 * k, b = 2 * k + 1, c = last ? 1 : 2 * k + 2, d = last ? 0 : 2 * k + 3;
    mesh.triangles.push_back({a, c, b});
    mesh.triangles.push_back({b, c, d});
  }
  const Repaired out = repaired(mesh);
  EXPECT_EQ(out.report.cut_seams, 1U);
  EXPECT_EQ(out.report.parts, 1U);
  EXPECT_EQ(out.report.boundary_loops, 1U);
  EXPECT_EQ(out.mesh.positions.size(), 2 * kSteps + 2);
}

TEST(Repair, AKleinBottleBecomesAnOrientedManifold) {
  // A grid whose second direction closes with a flip; only the connections matter, positions are spread out.
  constexpr std::uint32_t kSteps = 6;
  TriangleMesh mesh;
  const auto id = [&](std::uint32_t i, std::uint32_t j) {
    if (j == kSteps) return (kSteps - i % kSteps) % kSteps;
    return j * kSteps + i % kSteps;
  };
  for (std::uint32_t k = 0; k < kSteps * kSteps; ++k) {
    mesh.positions.push_back({std::cos(1.0 * k), std::sin(1.7 * k), std::cos(2.3 * k + 1)});
  }
  for (std::uint32_t j = 0; j < kSteps; ++j) {
    for (std::uint32_t i = 0; i < kSteps; ++i) {
      mesh.triangles.push_back({id(i, j), id(i + 1, j), id(i, j + 1)});
      mesh.triangles.push_back({id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)});
    }
  }
  EXPECT_GT(repaired(mesh).report.cut_seams, 0U);
}

TEST(Repair, ARandomTangleBecomesAnOrientedManifold) {
  std::uint64_t state = 1;
  const auto random = [&](std::uint32_t below) {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<std::uint32_t>((state >> 33U) % below);
  };
  for (int round = 0; round < 60; ++round) {
    TriangleMesh mesh;
    // Few grid points: many equal positions, flat triangles, crowded edges and pinched vertices.
    const std::uint32_t points = 4 + random(40);
    for (std::uint32_t k = 0; k < points; ++k) {
      mesh.positions.push_back({double(random(4)), double(random(4)), double(random(3))});
      mesh.colours.push_back({static_cast<std::uint8_t>(k), 0, 0, 255});
    }
    const std::uint32_t triangles = 3 + random(200);
    for (std::uint32_t k = 0; k < triangles; ++k)
      mesh.triangles.push_back({random(points), random(points), random(points)});
    const auto result = repair(mesh);
    if (!result) continue;
    ASSERT_EQ(testing::manifold_fault(result->mesh), "") << "round " << round;
    EXPECT_EQ(result->mesh.colours.size(), result->mesh.positions.size());
    // The same soup always gives the same mesh.
    const auto again = repair(mesh);
    EXPECT_EQ(again->mesh.triangles, result->mesh.triangles);
  }
}

TEST(Repair, RefusesWhatHasNoAreaAndStopsWhenAsked) {
  TriangleMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}};
  mesh.triangles = {{0, 1, 2}};
  EXPECT_EQ(repair(mesh).error().code, Errc::Corrupt);
  EXPECT_EQ(repair({}).error().code, Errc::Corrupt);
  for (Vec3d& p : mesh.positions) p.y = std::numeric_limits<double>::infinity();
  EXPECT_NE(repair(mesh).error().message.find("infinite"), std::string::npos) << repair(mesh).error().message;
  const std::atomic<bool> stop{true};
  EXPECT_EQ(repair(box({0, 0, 0}, {1, 1, 1}), {.report = {}, .cancel = &stop}).error().code, Errc::Cancelled);
}

}  // namespace
}  // namespace relief
