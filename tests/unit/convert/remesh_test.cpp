// Solids made anew: whatever the source, a closed surface comes out, and where the source was sound it stays in place.
#include "shapes.h"

#include <relief/convert/convert.h>
#include <relief/convert/remesh.h>
#include <relief/convert/source_surface.h>
#include <relief/convert/winding.h>
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

constexpr double kBall = 4 * std::numbers::pi / 3;

Remeshed solid_of(const TriangleMesh& source, double voxel = 0) {
  const auto repaired = repair(source);
  EXPECT_TRUE(repaired);
  auto made = remesh(repaired->mesh, voxel, {});
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
  const detail::SourceSurface surface(to.positions, to.triangles, lattice);
  double most = 0;
  for (const Vec3d p : from.positions) most = std::max(most, surface.nearest(lattice.to_lattice(p)).distance);
  return most * lattice.step;
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
  EXPECT_EQ(made->model.info.mode, Mode::Certified) << made->report.not_certified;
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
  EXPECT_EQ(made->model.info.mode, Mode::Certified) << made->report.not_certified;
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
  const auto refused = remesh(source, 1e-4, {});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, Errc::InvalidArgument);
  const std::atomic<bool> stop = true;
  const auto stopped = remesh(source, 0, {.report = {}, .cancel = &stop});
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, Errc::Cancelled);
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
