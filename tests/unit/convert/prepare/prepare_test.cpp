// Each remedy on a model that has just its kind of defect, and what is said of them.
#include "../certified.h"
#include "../shapes.h"
#include "closed_source.h"

#include <relief/convert/geometry/components.h>
#include <relief/convert/geometry/visibility.h>
#include <relief/convert/prepare/prepare.h>
#include <relief/mesh/repair.h>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>
#include <random>

namespace relief {
namespace {

using namespace detail;
using testing::append;
using testing::certified;
using testing::closed_source;
using testing::diagonal_of;
using testing::expect_certified;
using testing::expect_stands;
using testing::fans;
using testing::limits_for;
using testing::prepared;

TEST(Certified, OneSpikeIsMendedAloneAndReported) {
  TriangleMesh ball = testing::ball(24);
  // Pulled through its neighbours, the vertex has faces that no direction sees.
  const std::size_t spike = 500;
  const Vec3d aside = normalized(cross(ball.positions[spike], Vec3d{0, 0, 1}));
  ball.positions[spike] = ball.positions[spike] * 0.999 + aside * 0.22;
  const auto result = convert(ball, certified(60));
  expect_certified(result, 60);
  EXPECT_GT(result->report.moved_vertices, 0U);
  EXPECT_LE(result->report.moved_vertices, 4U);
  EXPECT_LT(result->report.moved_most, 0.01);
  EXPECT_EQ(result->report.replaced_triangles, 0U);
}

TEST(Certified, ManyPlacesAreMendedTheSameOnAnyNumberOfThreads) {
  // Vertices that have changed places lie across their neighbours' faces.
  TriangleMesh mesh = testing::ball(120, 0.05);
  append(mesh, testing::ball(10), {4, 0, 0});
  for (const std::size_t v : {3000U, 9000U, 9020U, 15000U, 21000U}) std::swap(mesh.positions[v], mesh.positions[v + 7]);
  std::array<std::uint64_t, 2> hashes{};
  for (const std::size_t run : {0U, 1U}) {
    const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, run + 1);
    const auto result = convert(mesh, certified(150));
    ASSERT_TRUE(result) << result.error().message;
    if (run == 0) expect_certified(result, 150, 4);
    const ConvertReport& report = result->report;
    EXPECT_GT(report.replaced_triangles, 20U);
    EXPECT_LT(report.replaced_triangles, 1500U);
    EXPECT_EQ(report.vanished_parts, 0U);
    EXPECT_EQ(report.parts.count, 2U);
    EXPECT_EQ(report.parts.certified, 2U);
    EXPECT_EQ(report.closed_openings, 0U);
    hashes[run] = result->model.head->content_hash();
  }
  EXPECT_EQ(hashes[0], hashes[1]);
}

double area_of(const ClosedSource& s, bool patches) {
  double area = 0;
  for (std::size_t f = 0; f < s.faces.size(); ++f) {
    const Vec3d a = to_double(s.points[s.faces[f][0]]);
    if ((s.patch[f] != 0) == patches)
      area += 0.5 * length(cross(to_double(s.points[s.faces[f][1]]) - a, to_double(s.points[s.faces[f][2]]) - a));
  }
  return area;
}

TEST(Prepare, ASoundSourceStaysAsItWasGiven) {
  const ClosedSource given = closed_source(testing::torus(40, 20));
  const Prepared made = prepared(given);
  expect_stands(made);
  EXPECT_EQ(made.source.points, given.points);
  EXPECT_EQ(made.source.faces, given.faces);
  const Repairs& r = made.repairs;
  EXPECT_EQ(r.split_vertices + r.truncated_spikes + r.parted_points + r.moved_points + r.replaced_faces, 0U);
  EXPECT_TRUE(made.bad_faces.empty());
}

TEST(Prepare, AFoldIsSmoothed) {
  // One point aside over its neighbours, on a source whose edges are as short as points may be moved.
  TriangleMesh mesh = testing::ball(200);
  const std::size_t pulled = 40'000;
  mesh.positions[pulled] += normalized(cross(mesh.positions[pulled], Vec3d{0, 0, 1})) * 0.02;
  const ClosedSource given = closed_source(mesh);
  const Prepared made = prepared(given);
  expect_stands(made);
  EXPECT_EQ(made.repairs.replaced_faces, 0U);
  EXPECT_GT(made.repairs.moved_points, 0U);
  EXPECT_LT(made.repairs.moved_points, 50U);
  EXPECT_LE(made.repairs.moved_most, limits_for(given).farthest + 1);
  double most = 0;
  std::size_t moved = 0;
  for (std::size_t v = 0; v < given.points.size(); ++v) {
    const double far = length(to_double(made.source.points[v] - given.points[v]));
    most = std::max(most, far);
    moved += far > 0;
  }
  EXPECT_EQ(made.repairs.moved_most, most);
  EXPECT_EQ(made.repairs.moved_points, moved);
}

TEST(Prepare, ASpikeThroughTheFarSideIsCutOutWithinTheBudget) {
  TriangleMesh mesh = testing::ball(80);
  const std::size_t pushed = 6000;
  const Vec3d at = mesh.positions[pushed];
  mesh.positions[pushed] = at * -1.2;
  const ClosedSource given = closed_source(mesh);
  const Prepared made = prepared(given);
  expect_stands(made);
  const Repairs& r = made.repairs;
  EXPECT_GT(r.replaced_faces, 5U);
  EXPECT_EQ(r.vanished_components, 0U);
  EXPECT_LE(double(r.replaced_faces), 0.03 * (double(given.faces.size()) + 2000));
  EXPECT_GE(area_of(made.source, false), 0.97 * area_of(closed_source(testing::ball(80)), false));
  Box3d box;
  for (const LatticePoint p : made.stand->source.points) box.add(to_double(p));
  EXPECT_LT(length(box.extent()), 0.97 * diagonal_of(given)) << "without the spike";
  EXPECT_FALSE(made.bad_faces.empty());
}

TEST(Prepare, WhatWouldTakeMoreThanTheBudgetIsAnObstacle) {
  // A tenth of all points pulled through their neighbours: to cut out each would replace most of the surface.
  std::mt19937 random(4);
  TriangleMesh mesh = testing::ball(16);
  for (std::size_t v = 1; v + 1 < mesh.positions.size(); ++v)
    if (random() % 10 == 0) mesh.positions[v] = mesh.positions[v] * -1.3;
  const ClosedSource given = closed_source(mesh);
  const Prepared made = prepared(given);
  EXPECT_FALSE(made.stand);
  ASSERT_TRUE(made.obstacle);
  EXPECT_GT(made.obstacle->count, 0U);
}

TEST(Prepare, CancelledItLeavesNeitherStandNorObstacle) {
  TriangleMesh mesh = testing::ball(60);
  mesh.positions[3000] = mesh.positions[3000] * -1.2;
  const std::atomic<bool> cancel = true;
  const ClosedSource given = closed_source(mesh);
  const Prepared made = prepare(given, limits_for(given), {{}, &cancel});
  EXPECT_FALSE(made.stand);
  EXPECT_FALSE(made.obstacle);
}

TEST(Prepare, ObstaclesNameTheirComponents) {
  // A sound ball, and two balls that cross each other along a circle.
  TriangleMesh mesh = testing::ball(16, 0.1);
  append(mesh, testing::ball(60), {2.2, 0, 0}, 0.6);
  append(mesh, testing::ball(60), {2.8, 0.1, 0}, 0.6);
  const Prepared made = prepared(closed_source(mesh));
  EXPECT_FALSE(made.stand);
  ASSERT_TRUE(made.obstacle);
  EXPECT_EQ(made.obstacle->kind, DefectKind::SelfIntersection);
  ASSERT_EQ(made.bad_components.size(), 2U);
  std::size_t all = 0;
  for (std::uint32_t k = 0; k < 2; ++k) {
    const Obstacle& bad = made.bad_components[k];
    EXPECT_EQ(bad.kind, DefectKind::SelfIntersection);
    EXPECT_EQ(bad.component, k + 1);
    all += bad.count;
  }
  EXPECT_EQ(made.obstacle->count, all);
}

TEST(Prepare, SpecksAreNamedBeforeAnythingIsCutOut) {
  // Finer than the lattice can hold; and two balls that cross each other beside them.
  TriangleMesh mesh;
  for (int k = 0; k < 3; ++k) append(mesh, testing::ball(16), {double(k) / 4, 3, 0}, 1e-5);
  append(mesh, testing::ball(20));
  append(mesh, testing::ball(20), {1, 0.1, 0});
  const Prepared made = prepared(closed_source(mesh));
  EXPECT_FALSE(made.stand);
  ASSERT_EQ(made.specks.size(), 3U);
  for (std::uint32_t k = 0; k < 3; ++k) EXPECT_EQ(made.specks[k].component, k);
  EXPECT_EQ(made.bad_components.size(), 5U);
  EXPECT_EQ(made.repairs.replaced_faces, 0U);
}

TEST(Certified, VerticesThatAreSeenOnlyJustStayWhereTheyAre) {
  // Open: a lone obtuse triangle, whose corners are as sharp as 3 degrees. Closed: a wedge of 5 degrees.
  const TriangleMesh triangle = {{{0, 0, 0}, {10, 0, 0}, {1, 0.5, 0}}, {{0, 1, 2}}, {}};
  TriangleMesh wedge = testing::box({1, 0.0875, 1});
  for (Vec3d& p : wedge.positions) p.y *= 1 - p.x;
  wedge.triangles = {{0, 2, 1}, {4, 5, 6}, {0, 1, 5}, {0, 5, 4}, {0, 4, 6}, {0, 6, 2}, {2, 6, 5}, {2, 5, 1}};
  for (const TriangleMesh& mesh : {triangle, wedge}) {
    const auto result = convert(mesh, certified(40));
    expect_certified(result, 40);
    EXPECT_EQ(result->report.moved_vertices, 0U);
    EXPECT_EQ(result->report.replaced_triangles, 0U);
  }
}

TEST(Certified, NeedlesAndKnifeEdgesThatADirectionSeesStay) {
  const auto even = [](std::uint32_t) { return 1.0; };
  // A cone with a half angle of a fifth of a degree, a lens with a rim of a twentieth, a ball with one point far out.
  TriangleMesh spiked = testing::ball(40);
  const std::size_t tip = 1500;
  spiked.positions[tip] = spiked.positions[tip] * 8.0;
  for (const TriangleMesh& mesh : {fans(24, 300, 0, even), fans(60, 5e-4, -5e-4, even), spiked}) {
    const auto result = convert(mesh, certified(120));
    expect_certified(result, 120);
    EXPECT_EQ(result->report.moved_vertices, 0U);
    EXPECT_EQ(result->report.replaced_triangles, 0U);
    EXPECT_LT(result->report.from_source.max, 0.02);
    testing::expect_holds_as_read(*result, mesh);
  }
  // Elsewhere something has to be mended: the spike stays for all that.
  const std::size_t pulled = 400;
  const Vec3d aside = normalized(cross(spiked.positions[pulled], Vec3d{0, 0, 1}));
  spiked.positions[pulled] = spiked.positions[pulled] * 0.999 + aside * 0.22;
  const auto result = convert(spiked, certified(120));
  expect_certified(result, 120);
  double farthest = 0;
  for (const Vec3d p : result->mended.positions) farthest = std::max(farthest, length(p));
  EXPECT_GT(farthest, 7.9);
}

TEST(Certified, WhatIsSaidOfACutIsTrue) {
  // Two points change places, far apart from each other: two crossings, each cut out for itself.
  TriangleMesh mesh = testing::ball(60, 0.02);
  std::swap(mesh.positions[2000], mesh.positions[2004]);
  ConvertSettings settings = certified(200);
  const auto result = convert(mesh, settings);
  ASSERT_TRUE(result) << result.error().message;
  const ConvertReport& report = result->report;
  if (report.replaced_triangles == 0) GTEST_SKIP() << "nothing had to be cut out";
  const Vec3d at = mesh.positions[2002];
  EXPECT_LT(length(report.replaced_near - at), 0.5);
  EXPECT_GT(report.replaced_widest, 0.01);
  EXPECT_LT(report.replaced_widest, 0.3);
  EXPECT_NE(to_string(report).find("cut out and closed with patches"), std::string::npos);
}

TEST(Prepare, SolidsThatShareAFaceCutInOtherTrianglesAreMovedApart) {
  // Boxes of 4 and 5, 5 and 7, 6 and 7 cells along each edge, one on top of the other: few points coincide.
  const auto add_box = [](TriangleMesh& to, int cells, double level) {
    for (int axis = 0; axis < 3; ++axis)
      for (const bool far : {false, true}) {
        const TriangleMesh side = testing::bent_grid(cells, cells, false, false, [&](double u, double v) {
          const double w = far ? 1 : 0;
          const Vec3d p = axis == 0 ? Vec3d{w, u, v} : axis == 1 ? Vec3d{v, w, u} : Vec3d{u, v, w};
          return Vec3d{p.x, p.y, p.z + level};
        });
        append(to, far ? side : testing::turned(side));
      }
  };
  for (const auto& [low, high] : {std::pair(4, 5), std::pair(5, 7), std::pair(6, 7)}) {
    TriangleMesh mesh;
    add_box(mesh, low, 0);
    add_box(mesh, high, 1);
    const auto repaired = repair(mesh);
    ASSERT_TRUE(repaired);
    const ClosedSource given = closed_source(repaired->mesh);
    const Prepared made = prepared(given);
    expect_stands(made);
    EXPECT_EQ(find_components(made.source.points.size(), made.source.faces).count, 2U);
    EXPECT_EQ(made.repairs.replaced_faces, 0U);
    EXPECT_GT(made.repairs.moved_most, 0);
    EXPECT_LE(made.repairs.moved_most, limits_for(given).farthest + 1);
  }
}

/// Points whose faces no direction sees.
std::size_t count_singular(const TriangleMesh& mesh) {
  std::vector<std::vector<Vec3d>> normals(mesh.positions.size());
  for (const Triangle& t : mesh.triangles) {
    const Vec3d a = mesh.positions[t[0]];
    for (const std::uint32_t v : t)
      normals[v].push_back(normalized(cross(mesh.positions[t[1]] - a, mesh.positions[t[2]] - a)));
  }
  return static_cast<std::size_t>(
      std::ranges::count_if(normals, [](const auto& n) { return best_direction(n).visibility <= 0; }));
}

/// The greatest distance between points of the same number, share of the source's diagonal, and how many moved.
std::pair<double, std::size_t> moves_between(const TriangleMesh& source, const Conversion& made) {
  double most = 0;
  std::size_t count = 0;
  EXPECT_EQ(made.mended.positions.size(), source.positions.size());
  for (std::size_t v = 0; v < source.positions.size(); ++v) {
    const double far = length(made.mended.positions[v] - source.positions[v]) / made.model.info.source_diagonal;
    most = std::max(most, far);
    count += far > 1e-7;  // more than rounding to the lattice
  }
  return {most, count};
}

TEST(Certified, FoldsAtRandomPlacesAreMendedAndMovesAreTrue) {
  std::mt19937 random(31);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::size_t singular = 0;
  for (int trial = 0; trial < 6; ++trial) {
    TriangleMesh mesh = trial % 2 == 0 ? testing::ball(40, 0.05) : testing::torus(90, 40);
    for (int fold = 0; fold < 5 + 5 * trial; ++fold) {
      // One and a half edges aside: across its neighbours.
      const Triangle& t = mesh.triangles[random() % mesh.triangles.size()];
      const Vec3d edge = mesh.positions[t[1]] - mesh.positions[t[0]];
      mesh.positions[t[0]] += edge * 1.5 + Vec3d{unit(random), unit(random), unit(random)} * (0.1 * length(edge));
    }
    singular += count_singular(mesh);
    const auto result = convert(mesh, certified(150));
    SCOPED_TRACE("trial " + std::to_string(trial));
    expect_certified(result, 1000, 4);
    const ConvertReport& report = result->report;
    EXPECT_GT(report.moved_vertices, 0U);
    EXPECT_LE(report.moved_most, 8.1e-3);
    EXPECT_LT(report.replaced_triangles, 60U * static_cast<std::size_t>(5 + 5 * trial));
    if (report.replaced_triangles > 0) continue;
    const auto [most, count] = moves_between(mesh, *result);
    EXPECT_NEAR(report.moved_most, most, 1e-6);
    EXPECT_EQ(report.moved_vertices, count);
  }
  EXPECT_GT(singular, 20U) << "these models are too easy for the test";
}

/// A round body with a slot along its equator, whose banks swell so far that they cross by `depth` in places.
TriangleMesh slotted_ball(double depth, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> turn(0, 2 * std::numbers::pi);
  const double above = turn(random), below = turn(random);
  TriangleMesh mesh = testing::bent_grid(160, 90, true, false, [&](double u, double v) {
    // Along the profile: the lower half of the ball, the lower bank inwards, the slot's floor, and back.
    const double a = 2 * std::numbers::pi * u, side = v < 0.5 ? -1 : 1, s = 1 - std::abs(2 * v - 1);  // 0 pole, 1 floor
    if (s == 0) return Vec3d{0, 0, side};
    double rho = 0, z = 0;
    if (s < 0.5) {
      const double b = 0.04 + (0.5 * std::numbers::pi - 0.04) * (1 - 2 * s);
      rho = std::cos(b), z = std::sin(b);
    } else {
      const double in = 2 * s - 1, swell = std::sin(std::numbers::pi * in);  // 0 at the rim, 1 in the floor
      rho = std::cos(0.04) - 0.4 * in;
      const double wave = 0.6 + 0.4 * std::sin(3 * a + (side > 0 ? above : below));
      z = 0.04 * (1 - swell * swell) * (1 - std::pow(in, 16)) - 0.5 * depth * wave * swell * swell;
    }
    return Vec3d{rho * std::cos(a), rho * std::sin(a), side * z};
  });
  return mesh;
}

TEST(Prepare, SheetsThatCrossArePushedApart) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const auto repaired = repair(slotted_ball(6e-3, seed));
    ASSERT_TRUE(repaired);
    const ClosedSource given = closed_source(repaired->mesh);
    const Prepared made = prepared(given);
    expect_stands(made);
    EXPECT_GT(made.repairs.moved_points, 1000U);
    EXPECT_EQ(made.repairs.parted_points, 0U);
    EXPECT_LT(made.repairs.replaced_faces, 50U);
    EXPECT_LE(made.repairs.moved_most, 4 * limits_for(given).farthest + 1);
  }
}

TEST(Prepare, APatchLeavesAsMuchRoomAsTheScanAround) {
  // A hollow ball, of which two points have changed places: flat patches come near the hollow.
  constexpr double kHollow = 0.985;  // radius
  TriangleMesh mesh = testing::ball(60);
  const std::size_t pole = mesh.positions.size() - 1;
  std::swap(mesh.positions[3500], mesh.positions[3504]);
  append(mesh, testing::turned(testing::ball(60)), {}, kHollow);
  const ClosedSource given = closed_source(mesh);
  const Prepared made = prepared(given);
  expect_stands(made);
  EXPECT_GT(made.repairs.replaced_faces, 0U);
  const Vec3d middle = (to_double(given.points[0]) + to_double(given.points[pole])) * 0.5;
  const double radius = length(to_double(given.points[pole]) - middle);
  double least = 2;
  for (std::size_t f = 0; f < made.source.faces.size(); ++f)
    if (made.source.patch[f] != 0)
      for (const std::uint32_t v : made.source.faces[f])
        least = std::min(least, length(to_double(made.source.points[v]) - middle) / radius - kHollow);
  EXPECT_GE(least, 0.999 * (1 - kHollow));
}

TEST(Certified, WhatIsInsideOutIsPushedOut) {
  // A plate whose two sides have changed places over a disc: its solid is thinner than nothing there.
  TriangleMesh plate = testing::ball(60);
  for (Vec3d& p : plate.positions) {
    const double x = p.x - 0.45;
    p.z *= 0.1 - 0.104 * std::exp(-std::pow((x * x + p.y * p.y) / 0.09, 3));
  }
  const auto result = convert(plate, certified(100));
  expect_certified(result, 200, 10);
  const ConvertReport& report = result->report;
  EXPECT_EQ(report.replaced_triangles, 0U);
  const auto [most, count] = moves_between(plate, *result);
  EXPECT_NEAR(report.moved_most, most, 1e-6);
  EXPECT_EQ(report.moved_vertices, count);
  EXPECT_GT(count, 100U);
  // There and nowhere else.
  for (std::size_t v = 0; v < plate.positions.size(); ++v) {
    const Vec3d p = plate.positions[v];
    if (std::hypot(p.x - 0.45, p.y) < 0.45) continue;
    EXPECT_LT(length(result->mended.positions[v] - p), 1e-6);
  }
}

}  // namespace
}  // namespace relief
