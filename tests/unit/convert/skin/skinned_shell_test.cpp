// The outer skin in the place of a source, and whose faces and parts its own are.
#include "skin_support.h"

#include <relief/convert/geometry/components.h>
#include <relief/convert/skinned_shell.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <set>

namespace relief::detail {
namespace {

constexpr double kUnit = 1 << 20;  // lattice steps of a box's side

/// Steps of 1, from 0, so that model units are lattice steps.
const Lattice kLattice = {};

ClosedSource two_boxes() {
  TriangleMesh boxes = box_at({0, 0, 0}, Vec3d{1, 1, 1} * kUnit);
  ::relief::testing::append(boxes, box_at(Vec3d{0.5, 0.25, 0.25} * kUnit, Vec3d{1, 0.5, 0.5} * kUnit));
  return source_of(boxes);
}

Vec3d normal_of(const ClosedSource& s, std::uint32_t f) {
  const Vec3d a = to_double(s.points[s.faces[f][0]]);
  return normalized(cross(to_double(s.points[s.faces[f][1]]) - a, to_double(s.points[s.faces[f][2]]) - a));
}

TEST(SkinnedShell, AsksForASkinWherePartsOverlapOrTooMuchOfOneCrosses) {
  constexpr std::size_t kFaces = 10'000;  // a few of them: 250
  EXPECT_FALSE(asks_for_skin({}, kFaces, false));
  EXPECT_FALSE(asks_for_skin({}, kFaces, true)) << "there is nothing to do";
  EXPECT_TRUE(asks_for_skin({.between = 1}, kFaces, false));
  EXPECT_TRUE(asks_for_skin({.nested = 1}, kFaces, false));
  EXPECT_FALSE(asks_for_skin({.within = 250}, kFaces, false)) << "smoothed";
  EXPECT_TRUE(asks_for_skin({.within = 251}, kFaces, false));
  EXPECT_TRUE(asks_for_skin({.within = 1}, kFaces, true));
  EXPECT_FALSE(asks_for_skin({.patched = 1000}, kFaces, false)) << "patches get another shape first";
  EXPECT_TRUE(asks_for_skin({.patched = 1}, kFaces, true));
}

TEST(SkinnedShell, FacesOfTheSkinNameThoseThatTheyAreCutFrom) {
  const ClosedSource given = two_boxes();
  const Skinned made = take_skin(two_boxes(), kLattice, 1e-6, {}, {});
  ASSERT_TRUE(made.report);
  // What stands out of the first box is the second's farther half.
  EXPECT_NEAR(volume(made.source) / std::pow(kUnit, 3), 1 + 0.5 * 0.25, 1e-6);
  ASSERT_EQ(made.face_of.size(), made.source.faces.size());
  std::set<std::uint32_t> named;
  for (std::uint32_t f = 0; f < made.source.faces.size(); ++f) {
    const std::uint32_t from = made.face_of[f];
    ASSERT_LT(from, given.faces.size());
    named.insert(from);
    EXPECT_GT(dot(normal_of(made.source, f), normal_of(given, from)), 1 - 1e-9);
    const Vec3d on = to_double(given.points[given.faces[from][0]]);
    for (const std::uint32_t v : made.source.faces[f])
      EXPECT_LE(std::abs(dot(to_double(made.source.points[v]) - on, normal_of(given, from))), 1) << f;
  }
  // Of 24 faces the two of the second box's lower side lie inside; cut are its eight long ones and the two around them.
  EXPECT_EQ(named.size(), 22U);
  EXPECT_EQ(made.report->dropped, 2U);
  EXPECT_EQ(made.report->cut, 10U);
  EXPECT_EQ(made.report->crossing, 0U);
  EXPECT_EQ(made.part_of, std::vector<std::uint32_t>{0}) << "one part, whose first face is of the first";
}

TEST(SkinnedShell, PartsOfTheSkinNameThePartThatTheirFirstFaceIsOf) {
  TriangleMesh boxes;
  // The second lies in the first, the others apart; all are crossed by nothing.
  for (const auto& [low, side] : {std::pair{0.0, 1.0}, {0.25, 0.5}, {2.0, 1.0}, {4.0, 0.5}})
    ::relief::testing::append(boxes, box_at(Vec3d{low, low, low} * kUnit, Vec3d{side, side, side} * kUnit));
  const Skinned made = take_skin(source_of(boxes), kLattice, 1e-6, {}, {});
  ASSERT_TRUE(made.report);
  EXPECT_EQ(made.report->dropped, 12U);
  const Components parts = find_components(made.source.points.size(), made.source.faces);
  ASSERT_EQ(parts.count, 3U);
  ASSERT_EQ(made.part_of.size(), 3U);
  for (std::uint32_t f = 0; f < made.source.faces.size(); ++f)
    EXPECT_EQ(made.part_of[parts.of_face[f]], made.face_of[f] / 12);
  EXPECT_EQ(std::set<std::uint32_t>(made.part_of.begin(), made.part_of.end()), (std::set<std::uint32_t>{0, 2, 3}));
}

TEST(SkinnedShell, OpenPartsThatLayInsideAreCounted) {
  ClosedSource source = source_of([] {
    TriangleMesh boxes = box_at({0, 0, 0}, Vec3d{1, 1, 1} * kUnit);
    for (const double at : {0.1, 0.4, 2.0})
      ::relief::testing::append(boxes, box_at(Vec3d{at, at, at} * kUnit, Vec3d{0.2, 0.2, 0.2} * kUnit));
    return boxes;
  }());
  // A fill triangle in each but the first; of the last one something is left.
  for (const std::size_t f : {12U, 13U, 24U, 36U}) source.phantom[f] = source.patch[f] = 1;
  const Vec3d first = to_double(source.points[source.faces[12][0]]);
  const Skinned made = take_skin(std::move(source), kLattice, 1e-6, {}, {});
  ASSERT_TRUE(made.report);
  EXPECT_EQ(made.report->open_parts, 2U);
  EXPECT_LT(length(made.report->open_near - kLattice.to_model(snap(first))), 1e-9);
}

TEST(SkinnedShell, WithoutASkinTheSourceStaysAsItWas) {
  const ClosedSource given = two_boxes();
  const std::atomic<bool> stop = true;
  const Skinned cancelled = take_skin(two_boxes(), kLattice, 1e-6, {}, {.report = {}, .cancel = &stop});
  EXPECT_FALSE(cancelled.report);
  EXPECT_EQ(cancelled.source.faces, given.faces);
  EXPECT_TRUE(cancelled.face_of.empty() && cancelled.part_of.empty());
  // Inside out, it winds around nothing.
  ClosedSource turned = source_of(::relief::testing::turned(box_at({0, 0, 0}, Vec3d{1, 1, 1} * kUnit)));
  turned.faces.pop_back();  // nor is it closed
  turned.patch.pop_back(), turned.phantom.pop_back();
  const std::size_t faces = turned.faces.size();
  const Skinned open = take_skin(std::move(turned), kLattice, 1e-6, {}, {});
  EXPECT_FALSE(open.report);
  EXPECT_EQ(open.source.faces.size(), faces);
}

}  // namespace
}  // namespace relief::detail
