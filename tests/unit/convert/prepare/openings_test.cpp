// Openings: what closes them, and how that changes where it does not do.
#include "../certified.h"
#include "../shapes.h"
#include "closed_source.h"

#include <relief/convert/prepare/defects.h>
#include <relief/convert/prepare/openings.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>
#include <random>

namespace relief {
namespace {

using namespace detail;
using testing::append;
using testing::pierced;

/// As a conversion closes openings and prepares what that makes, until it stands.
struct ClosedAndPrepared {
  Openings openings;
  ClosedOpenings closed;
  Prepared made;
  explicit ClosedAndPrepared(const TriangleMesh& mesh) : openings(mesh) {
    const double room = 0.1 * length(bounds(mesh).extent());
    for (int attempt = 0; attempt < 3; ++attempt) {
      closed = openings.close(mesh, room);
      made = testing::prepared(closed.source);
      if (made.stand || !openings.change(mesh, closed.patches, made.bad_faces, room, {})) break;
    }
  }
};

TEST(Openings, TerrainStandsOpenBehindABox) {
  for (const double height : {0.1, 0.2}) {
    const ClosedAndPrepared all(testing::sheet(40, height));
    testing::expect_stands(all.made);
    EXPECT_EQ(all.openings.closings()[0].kind, Closing::Box);
    EXPECT_EQ(all.made.repairs.replaced_faces, 0U);
  }
}

/// A bowl with a wall as thick as a fifth of its radius and a hole through its bottom, open between its two brims: the
/// outer one lies level, the inner one rises on one side and hangs down on the other.
TriangleMesh bowl_open_at_its_brims() {
  constexpr double kInside = 0.8, kHole = 0.2, kBrim = 0.3, kSlant = 0.5;
  const double inner = std::acos(kHole / kInside), outer = std::acos(kHole);
  const double through = kInside * std::sin(inner) - std::sin(outer);
  // Down the inside, through the hole, up the outside: r and z, in the ratio of their lengths.
  return testing::bent_grid(48, 60, true, false, [&](double u, double v) {
    const double a = 2 * std::numbers::pi * u;
    double at = v * (kBrim + kInside * inner - through + outer), r = kHole, z = 0;
    if (at <= kBrim) {
      r = kInside;
      z = (kBrim - at) * (1 + kSlant / kBrim * std::cos(a));
    } else if ((at -= kBrim) <= kInside * inner) {
      r = kInside * std::cos(at / kInside);
      z = -kInside * std::sin(at / kInside);
    } else if ((at -= kInside * inner) <= -through) {
      z = -kInside * std::sin(inner) - at;
    } else {
      r = std::cos(outer - (at + through));
      z = -std::sin(outer - (at + through));
    }
    return Vec3d{r * std::cos(a), r * std::sin(a), z};
  });
}

TEST(Openings, OnlyThoseThatABoxHelpsGetOne) {
  // The patches of both brims cross each other. A box over the outer brim holds the inner one's patch; a box on the
  // inner brim would run down through the bowl.
  const TriangleMesh bowl = bowl_open_at_its_brims();
  const ClosedAndPrepared all(bowl);
  testing::expect_stands(all.made);
  ASSERT_EQ(all.openings.count(), 2U);
  EXPECT_EQ(std::ranges::count(all.openings.closings(), Closing::Box, &Closing::kind), 1);
  EXPECT_EQ(std::ranges::count(all.openings.closings(), Closing::Patch, &Closing::kind), 1);
  EXPECT_LT(all.made.repairs.replaced_faces, bowl.triangles.size() / 50);
}

/// A slanting sheet close above a level one: the boxes of both would run through each other.
TriangleMesh two_sheets(double gap) {
  TriangleMesh mesh = testing::sheet(30);
  append(mesh,
         testing::bent_grid(30, 30, false, false, [&](double u, double v) { return Vec3d{u, v, gap + 0.2 * u}; }));
  return mesh;
}

TEST(Openings, SheetsWithoutRoomForABoxGetOffsetCopies) {
  for (const double gap : {0.05, 0.01, 0.002}) {
    const ClosedAndPrepared all(two_sheets(gap));
    testing::expect_stands(all.made);
    EXPECT_EQ(all.openings.count(), 2U);
    EXPECT_GT(std::ranges::count(all.openings.closings(), Closing::OffsetCopy, &Closing::kind), 0);
    EXPECT_EQ(all.made.repairs.replaced_faces, 0U);
    EXPECT_EQ(all.made.repairs.moved_points, 0U);
  }
}

TEST(Openings, WhatClosesThemIsNotCalledTheSource) {
  // So near that neither a box nor an offset copy has room.
  const ClosedAndPrepared all(two_sheets(1e-5));
  EXPECT_FALSE(all.made.stand);
  ASSERT_TRUE(all.made.obstacle);
  EXPECT_EQ(all.made.obstacle->kind, DefectKind::PatchIntersection);
}

TEST(Openings, ALargeFlatOneGetsABoxAndAHoleAPatch) {
  const Openings terrain(testing::sheet(20, 0.1));
  ASSERT_EQ(terrain.count(), 1U);
  EXPECT_EQ(terrain.closings()[0].kind, Closing::Box);
  const TriangleMesh pierced_ball = pierced(testing::ball(30), [](Vec3d p) { return p.z > 0.9 || p.x < -0.8; });
  const Openings holes(pierced_ball);
  ASSERT_EQ(holes.count(), 2U);
  const ClosedOpenings closed = holes.close(pierced_ball, 0.1);
  for (const Closing& c : holes.closings()) EXPECT_EQ(c.kind, Closing::Patch);
  ASSERT_EQ(closed.patches.size(), 3U);
  EXPECT_EQ(closed.patches.front(), pierced_ball.triangles.size());
  EXPECT_EQ(closed.patches.back(), closed.source.faces.size());
  for (std::size_t f = 0; f < closed.source.faces.size(); ++f) {
    EXPECT_EQ(closed.source.phantom[f] != 0, f >= pierced_ball.triangles.size());
    EXPECT_EQ(closed.source.patch[f], closed.source.phantom[f]);
  }
  EXPECT_TRUE(find_boundary_loops(closed.source.points.size(), closed.source.faces).empty());
}

TEST(Openings, OnlyBadOnesAreClosedInAnotherWay) {
  // The boxes of the two sheets run through each other: an offset copy behind either leaves room for the other's box.
  const TriangleMesh mesh = two_sheets(0.05);
  Openings openings(mesh);
  const ClosedOpenings closed = openings.close(mesh, 0.1);
  ASSERT_EQ(openings.closings()[0].kind, Closing::Box);
  ASSERT_EQ(openings.closings()[1].kind, Closing::Box);
  EXPECT_GT(count_patch_intersections(closed.source, {}), 0U);
  EXPECT_FALSE(openings.change(mesh, closed.patches, {}, 0.1, {})) << "none is bad";
  std::vector<std::uint32_t> bad;
  for (std::size_t f = closed.patches[0]; f < closed.patches[2]; ++f) bad.push_back(static_cast<std::uint32_t>(f));
  ASSERT_TRUE(openings.change(mesh, closed.patches, bad, 0.1, {}));
  for (const Closing& c : openings.closings()) EXPECT_EQ(c.kind, Closing::OffsetCopy);
  EXPECT_EQ(count_patch_intersections(openings.close(mesh, 0.1).source, {}), 0U);
  const std::atomic<bool> cancel = true;
  EXPECT_FALSE(Openings(mesh).change(mesh, closed.patches, bad, 0.1, {{}, &cancel}));
}

}  // namespace
}  // namespace relief
