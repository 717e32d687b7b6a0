// Cut faces are judged by the areas that they keep, and piece against piece in doubles.
#include "skin_support.h"

#include <relief/convert/skin/face_arrangement.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <set>
#include <vector>

namespace relief::detail {
namespace {

/// Twice the area of a face as it was, along the normal.
Vec3d area_of_face(const ClosedSource& source, std::uint32_t f) {
  const Vec3d a = to_double(source.points[source.faces[f][0]]);
  return cross(to_double(source.points[source.faces[f][1]]) - a, to_double(source.points[source.faces[f][2]]) - a);
}

TriangleMesh triangles(std::vector<Vec3d> corners) {
  TriangleMesh mesh;
  mesh.positions = std::move(corners);
  for (std::uint32_t k = 0; k + 2 < mesh.positions.size(); k += 3) mesh.triangles.push_back({k, k + 1, k + 2});
  return mesh;
}

TEST(FaceArrangement, LeavesApartWhatDoesNotMeet) {
  TriangleMesh boxes = box_at({100, 100, 100}, {50, 60, 70});
  ::relief::testing::append(boxes, box_at({300, 100, 100}, {50, 60, 70}));
  const Arranged all(boxes);
  EXPECT_TRUE(all.made.made.empty());
  EXPECT_EQ(all.made.cut + all.made.coincident, 0U);
  ASSERT_EQ(all.made.pieces.size(), 24U);
  for (std::uint32_t f = 0; f < 24; ++f) {
    EXPECT_EQ(all.made.pieces[f].from, f);
    EXPECT_EQ(all.made.pieces[f].sheets, 1);
    EXPECT_EQ(all.made.pieces[f].corners, all.source.faces[f]);
  }
}

TEST(FaceArrangement, CutsTwoFacesAlongWhatTheyHaveInCommon) {
  // The second stands on the plane of the first and pierces it from (200, 100) to (200, 200).
  const Arranged all(triangles(
      {{100, 100, 500}, {400, 100, 500}, {100, 400, 500}, {200, 100, 400}, {200, 200, 500}, {200, 100, 600}}));
  EXPECT_EQ(all.made.cut, 2U);
  std::set<std::array<double, 3>> points;
  for (const Piece& p : all.made.pieces)
    for (const Vec3d at : all.corners(p)) points.insert({at.x, at.y, at.z});
  // Its corner on the first is one of that one's points now; the other end of the cut is new.
  EXPECT_EQ(points.size(), 7U);
  EXPECT_TRUE(points.contains({200, 100, 500}));
  EXPECT_EQ(all.made.made.size(), 1U);
}

TEST(FaceArrangement, CountsSheetsThatLieOnEachOther) {
  const std::vector<Vec3d> t = {{100, 100, 100}, {400, 100, 100}, {100, 400, 100}};
  for (const bool same : {true, false}) {
    std::vector<Vec3d> twice = t;
    twice.insert(twice.end(), {t[0], t[same ? 1 : 2], t[same ? 2 : 1]});
    const Arranged all(triangles(twice));
    ASSERT_EQ(all.made.pieces.size(), 1U);
    EXPECT_EQ(all.made.pieces[0].sheets, same ? 2 : 0);
    EXPECT_EQ(all.made.coincident, 1U);
  }
}

/// Corners and edges of all planes in common, or in general position.
class FaceArrangementOfSoups : public ::testing::TestWithParam<int> {};

TEST_P(FaceArrangementOfSoups, KeepsAllAreaAndCrossesNowhere) {
  std::size_t cut = 0;
  for (std::uint32_t seed = 0; seed < 6; ++seed) {
    SCOPED_TRACE(seed);
    const Arranged all(soup(seed, 14, GetParam()));
    const std::vector<Piece>& pieces = all.made.pieces;
    cut += all.made.cut;
    // What lies on each other counts as often as it is there.
    Vec3d of_pieces, of_faces;
    std::vector<double> area(all.source.faces.size(), 0);
    for (const Piece& p : pieces) {
      const Vec3d n = all.area_of(p);
      EXPECT_GT(dot(n, area_of_face(all.source, p.from)), 0) << "the sense of the face";
      area[p.from] += length(n);
      of_pieces += n * double(p.sheets);
    }
    for (std::uint32_t f = 0; f < area.size(); ++f) {
      of_faces += area_of_face(all.source, f);
      const double whole = length(area_of_face(all.source, f));
      EXPECT_LE(area[f], whole * (1 + 1e-9));
      if (all.made.coincident > 0) continue;
      EXPECT_NEAR(area[f], whole, 1e-9 * whole);
    }
    EXPECT_LT(length(of_pieces - of_faces), 1e-9 * *std::ranges::max_element(area));
    // No edge of a piece runs through the inside of another.
    for (const Piece& p : pieces)
      for (const Piece& q : pieces) {
        const auto [a, b, c] = all.corners(q);
        const Vec3d n = normalized(area_of_face(all.source, q.from));
        for (std::size_t k = 0; k < 3; ++k) {
          const Vec3d from = all.corners(p)[k], to = all.corners(p)[(k + 1) % 3];
          const double below = dot(from - a, n), above = dot(to - a, n);
          if (!(std::min(below, above) < -1e-3 && std::max(below, above) > 1e-3)) continue;
          const Vec3d at = from + (to - from) * (below / (below - above));
          const auto side = [&](Vec3d u, Vec3d v) { return dot(cross(normalized(v - u), at - u), n); };
          EXPECT_LT(std::min({side(a, b), side(b, c), side(c, a)}), 1e-3);
        }
      }
  }
  EXPECT_GT(cut, 60U);
}

INSTANTIATE_TEST_SUITE_P(Grids, FaceArrangementOfSoups, ::testing::Values(12, 1'000'000));

}  // namespace
}  // namespace relief::detail
