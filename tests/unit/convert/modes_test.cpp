// What a mode makes of the ground that it is given, and what it leaves as it was.
#include "certified.h"
#include "shapes.h"

#include <relief/convert/modes.h>
#include <relief/convert/report.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace relief::detail {
namespace {

struct Stand {
  double diagonal;
  Ground ground;
  ConvertReport report = {};

  explicit Stand(const TriangleMesh& mesh) : diagonal(relief::diagonal(bounds(mesh))) {
    ground = {.mesh = Paged(TriangleMesh(mesh), false),
              .phantom_from = mesh.triangles.size(),
              .lattice = Lattice::around(bounds(mesh), 0.1 * diagonal)};
  }
  std::shared_ptr<const SlabMesh> certify(const ConvertSettings& settings) {
    return detail::certify(ground, settings, diagonal, 0, report, {});
  }
};

bool is_on(const Lattice& lattice, Vec3d p) {
  const Vec3d at = lattice.to_lattice(p);
  return at.x == std::round(at.x) && at.y == std::round(at.y) && at.z == std::round(at.z);
}

TEST(Modes, LittleThatWindingLeavesOpenIsNotTold) {
  constexpr double kTold = ConvertReport::Undecided::kTold;
  ConvertReport report;
  add_undecided(report, 0.999 * kTold * 7, {1, 2, 3}, 7);
  EXPECT_EQ(report.undecided.share, 0);
  add_undecided(report, 1.001 * kTold * 7, {1, 2, 3}, 7);
  EXPECT_NEAR(report.undecided.share, 1.001 * kTold, 1e-12);
  EXPECT_EQ(report.undecided.near, (Vec3d{1, 2, 3}));
  add_undecided(report, 1.0005 * kTold * 7, {4, 5, 6}, 7);
  EXPECT_EQ(report.undecided.near, (Vec3d{1, 2, 3})) << "there is more already";
  add_undecided(report, 8, {4, 5, 6}, 7);
  EXPECT_EQ(report.undecided.share, 1);
  EXPECT_EQ(report.undecided.near, (Vec3d{4, 5, 6}));
}

TEST(Modes, CertifyPutsTheMendedSourceInThePlaceOfTheRepairedOne) {
  // A ball without its ends: two openings.
  const TriangleMesh open = testing::pierced(testing::ball(24), [](Vec3d p) { return std::abs(p.z) > 0.8; });
  Stand stand(open);
  const auto mesh = stand.certify(testing::certified(80));
  ASSERT_TRUE(mesh) << stand.report.not_certified;
  EXPECT_TRUE(testing::certificate(*mesh).all());
  EXPECT_EQ(stand.report.closed_openings, 2U);
  EXPECT_FALSE(stand.ground.tolerant);
  const TriangleMesh& mended = stand.ground.mesh.get();
  ASSERT_EQ(stand.ground.phantom_from, open.triangles.size());
  EXPECT_EQ(stand.report.phantom_triangles, mended.triangles.size() - open.triangles.size());
  // Fill triangles come last: they alone have no corner between the openings' rims, or lie beyond these.
  const auto is_beyond = [&](const Triangle& t) {
    const Vec3d m = (mended.positions[t[0]] + mended.positions[t[1]] + mended.positions[t[2]]) / 3.0;
    return std::hypot(m.x, m.y) < 0.99 * std::sqrt(1 - m.z * m.z) - 0.02;
  };
  for (std::size_t f = 0; f < mended.triangles.size(); ++f)
    EXPECT_LE(is_beyond(mended.triangles[f]), f >= stand.ground.phantom_from) << f;
  for (const Vec3d p : mended.positions) EXPECT_TRUE(is_on(stand.ground.lattice, p));
  for (const Fibre& f : mesh->fibres())
    EXPECT_TRUE(is_on(stand.ground.lattice, f.inner) && is_on(stand.ground.lattice, f.outer));
}

TEST(Modes, CertifyLeavesTheGroundWhereItFails) {
  const TriangleMesh star = testing::unheld_star();
  Stand stand(star);
  EXPECT_EQ(stand.certify(testing::certified(60)), nullptr);
  EXPECT_EQ(stand.ground.mesh.get().triangles, star.triangles);
  EXPECT_EQ(stand.ground.mesh.get().positions, star.positions);
  EXPECT_EQ(stand.ground.phantom_from, star.triangles.size());
  ASSERT_EQ(stand.report.parts.obstacles.size(), 1U);
  EXPECT_EQ(stand.report.parts.obstacles[0].triangles, star.triangles.size());
  EXPECT_EQ(stand.report.parts.certified, 0U);
  EXPECT_TRUE(stand.report.not_certified.starts_with("a vertex has ")) << stand.report.not_certified;
  EXPECT_NE(stand.report.not_certified.find(", first near ("), std::string::npos) << stand.report.not_certified;
}

// What crosses itself is cut to its skin, but a solid with sharp edges that was made again makes way for a smooth one.
TEST(Modes, CertifyRefusesASharpSolidThatCrossesItselfMuch) {
  TriangleMesh balls = testing::ball(10);
  testing::append(balls, testing::ball(10), {0.7, 0.1, 0.05});
  Stand as_read(balls), smooth(balls), sharp(balls);
  smooth.report.remesh = ConvertReport::Remesh{.is_smooth = true};
  sharp.report.remesh = ConvertReport::Remesh{.is_smooth = false};
  EXPECT_TRUE(as_read.certify(testing::certified(60))) << as_read.report.not_certified;
  EXPECT_TRUE(smooth.certify(testing::certified(60))) << smooth.report.not_certified;
  EXPECT_EQ(sharp.certify(testing::certified(60)), nullptr);
  EXPECT_NE(sharp.report.not_certified.find("triangles intersect others, first near ("), std::string::npos)
      << sharp.report.not_certified;
  EXPECT_EQ(sharp.ground.mesh.get().triangles, balls.triangles);
}

// 4 for each ball and 14 for a torus (Ringel, Jungerman), and no fewer.
TEST(Modes, SaysHowFewSlabsTheTopologyAllows) {
  TriangleMesh parts = testing::torus(24, 12);
  testing::append(parts, testing::ball(10), {5, 0, 0});
  testing::append(parts, testing::ball(10), {8, 0, 0});
  Stand stand(parts);
  const auto mesh = stand.certify(testing::certified(8));
  ASSERT_TRUE(mesh) << stand.report.not_certified;
  EXPECT_EQ(stand.report.fewest.components, 3U);
  EXPECT_EQ(stand.report.fewest.handles, 1U);
  EXPECT_EQ(stand.report.fewest.slabs, 22U);
  EXPECT_GE(mesh->slab_count(), 22U);
  EXPECT_EQ(stand.report.parts.count, 3U);
  EXPECT_EQ(stand.report.parts.certified, 3U);
}

}  // namespace
}  // namespace relief::detail
