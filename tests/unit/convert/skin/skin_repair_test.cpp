// What repair may do to a skin: how far, and what must be gone after it.
#include "skin_support.h"

#include <relief/convert/skin/skin_repair.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

namespace relief::detail {
namespace {

constexpr double kThin = 30, kFarthest = 100;  // lattice steps

/// All of it as given.
SkinDraft draft_of(const TriangleMesh& mesh) {
  const ClosedSource source = source_of(mesh);
  SkinDraft draft;
  draft.points = source.points;
  for (const LatticePoint p : draft.points) draft.exact.push_back(to_double(p));
  draft.made.assign(draft.points.size(), 0);
  draft.faces = source.faces;
  for (std::uint32_t f = 0; f < draft.faces.size(); ++f) {
    const auto [a, b, c] = draft.faces[f];
    draft.from.push_back(f);
    draft.normals.push_back(normalized(cross(draft.exact[b] - draft.exact[a], draft.exact[c] - draft.exact[a])));
  }
  draft.piece.assign(draft.faces.size(), 0);
  return draft;
}

/// Cuts a face in three at a new point.
void cut_at(SkinDraft& draft, std::uint32_t f, Vec3d exact, LatticePoint rounded) {
  const auto v = static_cast<std::uint32_t>(draft.points.size());
  draft.points.push_back(rounded);
  draft.exact.push_back(exact);
  draft.made.push_back(1);
  const auto [a, b, c] = draft.faces[f];
  draft.faces[f] = {a, b, v};
  draft.piece[f] = 1;
  for (const Face& more : {Face{b, c, v}, Face{c, a, v}}) {
    draft.faces.push_back(more);
    draft.from.push_back(draft.from[f]);
    draft.normals.push_back(draft.normals[f]);
    draft.piece.push_back(1);
  }
}

double volume_of(const SkinDraft& draft) {
  ClosedSource source;
  source.points = draft.points;
  source.faces = draft.faces;
  return volume(source);
}

/// Of the lowest face.
double least_height(const SkinDraft& draft) {
  double least = 1e9;
  for (const auto [a, b, c] : draft.faces) {
    const Vec3d p = to_double(draft.points[a]), q = to_double(draft.points[b]), r = to_double(draft.points[c]);
    least = std::min(least, length(cross(q - p, r - p)) / std::max({length(q - p), length(r - q), length(p - r)}));
  }
  return least;
}

/// The bottom's first face has the corners (1000, 1000), (1000, 5000) and (5000, 5000).
TriangleMesh block() { return box_at({1000, 1000, 1000}, {4000, 4000, 4000}); }

TEST(SkinRepair, LeavesAloneWhatIsSound) {
  SkinDraft draft = draft_of(block());
  cut_at(draft, 0, {2000, 3000, 1000}, {2000, 3000, 1000});
  const SkinDraft before = draft;
  const SkinRepairs repairs = repair_skin(draft, kThin, kFarthest, {});
  EXPECT_EQ(repairs.repaired + repairs.slivers + repairs.crossing, 0U);
  EXPECT_EQ(repairs.moved_most, 0);
  EXPECT_EQ(draft.points, before.points);
  EXPECT_EQ(draft.faces, before.faces);
}

TEST(SkinRepair, JoinsAPointToTheCornerThatItIsCloseTo) {
  SkinDraft draft = draft_of(block());
  cut_at(draft, 0, {1005, 1015, 1000}, {1005, 1015, 1000});
  ASSERT_LT(least_height(draft), kThin);
  const SkinRepairs repairs = repair_skin(draft, kThin, kFarthest, {});
  EXPECT_GT(repairs.repaired, 0U);
  EXPECT_EQ(repairs.moved_most, 0) << "along its plane a point moves no surface";
  EXPECT_EQ(repairs.crossing, 0U);
  EXPECT_EQ(draft.points.size(), 8U);
  EXPECT_EQ(draft.faces.size(), 12U);
  EXPECT_EQ(draft.from.size(), 12U);
  EXPECT_DOUBLE_EQ(volume_of(draft), 6.4e10);
}

TEST(SkinRepair, MovesNothingFartherThanItMay) {
  // Eight steps off the plane, which is where it is to be.
  SkinDraft draft = draft_of(block());
  cut_at(draft, 0, {1005, 1015, 992}, {1005, 1015, 992});
  const double before = volume_of(draft);
  const SkinRepairs repairs = repair_skin(draft, kThin, 4, {});
  EXPECT_LE(repairs.moved_most, 4);
  EXPECT_EQ(draft.points.size(), 9U);
  EXPECT_NEAR(volume_of(draft), before, 4 * 1.6e7);
}

TEST(SkinRepair, OfTwoPointsInAPlaneTheGivenOneStays) {
  for (const std::uint32_t given : {8U, 9U}) {
    SkinDraft draft = draft_of(block());
    cut_at(draft, 0, {2000, 3000, 1000}, {2000, 3000, 1000});
    cut_at(draft, 0, {1995, 3000, 1000}, {1995, 3000, 1000});
    ASSERT_LT(least_height(draft), kThin);
    draft.made[given] = 0;
    const LatticePoint place = draft.points[given];
    EXPECT_GT(repair_skin(draft, kThin, kFarthest, {}).repaired, 0U);
    EXPECT_EQ(draft.points.size(), 9U);
    EXPECT_NE(std::ranges::find(draft.points, place), draft.points.end()) << given;
  }
}

TEST(SkinRepair, TakesBackAPointThatRoundingPutThroughTheOtherSide) {
  SkinDraft draft = draft_of(box_at({1000, 1000, 1000}, {4000, 4000, 60}));
  cut_at(draft, 0, {2000, 3000, 1000}, {2000, 3000, 1070});
  const SkinRepairs repairs = repair_skin(draft, kThin, kFarthest, {});
  EXPECT_GT(repairs.repaired, 0U);
  EXPECT_EQ(repairs.crossing, 0U);
  EXPECT_GE(repairs.moved_most, 70);
  EXPECT_LE(repairs.moved_most, kFarthest);
  EXPECT_NEAR(volume_of(draft), 1.6e7 * 60, 0.2 * 1.6e7 * 60);
}

TEST(SkinRepair, SaysWhatStillCrosses) {
  SkinDraft draft = draft_of(box_at({1000, 1000, 1000}, {4000, 4000, 600}));
  cut_at(draft, 0, {2000, 3000, 1000}, {2000, 3000, 1640});
  // It would be 40 steps back to the inside, but 640 is too far off already.
  const SkinRepairs repairs = repair_skin(draft, kThin, kFarthest, {});
  EXPECT_GT(repairs.crossing, 0U);
  EXPECT_EQ(repairs.moved_most, 640);
}

TEST(SkinRepair, LeavesOutPartsThatAreMereSlivers) {
  // Beside the block a tetrahedron as flat as 20 steps, whose faces are wide: 20 / 3 thick on average.
  TriangleMesh both = block();
  TriangleMesh flat = ::relief::testing::tetrahedron();
  flat.positions = {{0, 0, 0}, {6000, 0, 0}, {0, 6000, 0}, {2000, 2000, 20}};
  ::relief::testing::append(both, flat, {7000, 1000, 1000});
  for (const bool has_pieces : {true, false}) {
    SkinDraft draft = draft_of(both);
    std::fill(draft.piece.begin() + 12, draft.piece.end(), has_pieces ? 1 : 0);
    // What no cut has made is the source's own and stays.
    const SkinRepairs repairs = repair_skin(draft, kThin, kFarthest, {});
    EXPECT_EQ(repairs.slivers, has_pieces ? 1U : 0U);
    EXPECT_EQ(draft.faces.size(), has_pieces ? 12U : 16U);
    EXPECT_NEAR(repairs.moved_most, has_pieces ? 20.0 / 3 : 0, 0.01);
  }
}

}  // namespace
}  // namespace relief::detail
