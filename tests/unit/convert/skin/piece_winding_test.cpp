// Counted windings are judged by sums of solid angles.
#include "skin_support.h"

#include <relief/convert/skin/outer_skin.h>
#include <relief/convert/skin/piece_winding.h>

#include <gtest/gtest.h>

#include <vector>

namespace relief::detail {
namespace {

struct Wound : Arranged {
  PieceWinding winding;

  explicit Wound(const TriangleMesh& mesh) : Arranged(mesh) {
    auto found = find_winding(made, tree, {});
    EXPECT_TRUE(found);
    if (found) winding = std::move(*found);
  }
  /// What the faces wind around, half a step off the middle of a piece.
  [[nodiscard]] double wound_beside(const Piece& piece, int side) const {
    const auto [a, b, c] = corners(piece);
    const double off = side == 0 ? 0.5 : -0.5;
    return ::relief::detail::winding(source, (a + b + c) / 3.0 + normalized(area_of(piece)) * off);
  }
};

void expect_counted(const Wound& all) {
  EXPECT_TRUE(all.winding.undecided.empty());
  EXPECT_EQ(all.winding.open, 0U);
  ASSERT_EQ(all.winding.in_front.size(), all.made.pieces.size());
  std::size_t wide = 0;
  for (std::size_t p = 0; p < all.made.pieces.size(); ++p) {
    const Piece& piece = all.made.pieces[p];
    const auto [a, b, c] = all.corners(piece);
    const double longest = std::max({length(b - a), length(c - b), length(a - c)});
    if (length(all.area_of(piece)) < 1000 * longest) continue;  // another face may lie within half a step
    ++wide;
    EXPECT_NEAR(all.wound_beside(piece, 0), all.winding.in_front[p], 0.01) << p;
    EXPECT_NEAR(all.wound_beside(piece, 1), all.winding.in_front[p] + piece.sheets, 0.01) << p;
    EXPECT_EQ(all.winding.is_in_solid(piece, p, 0), all.wound_beside(piece, 0) > 0.5);
    EXPECT_EQ(all.winding.is_in_solid(piece, p, 1), all.wound_beside(piece, 1) > 0.5);
  }
  EXPECT_GT(wide, all.made.pieces.size() / 2);
}

TEST(PieceWinding, CountsWhatLiesInEachOther) {
  TriangleMesh nested;
  for (const double inset : {0.0, 1000.0, 2000.0, 3000.0})
    ::relief::testing::append(nested, box_at(Vec3d{1, 1, 1} * (1e4 + inset), Vec3d{1, 1, 1} * (1e4 - 2 * inset)));
  ::relief::testing::append(nested, ::relief::testing::turned(box_at({14000, 14000, 14000}, {500, 600, 700})));
  const Wound all(nested);
  expect_counted(all);
  EXPECT_EQ(all.winding.in_front[0], 0);
  EXPECT_EQ(all.winding.in_front[36], 3);
  EXPECT_EQ(all.winding.in_front[48], 3) << "looks into a cavity";
}

TEST(PieceWinding, CountsSoups) {
  for (const int grid : {12, 1'000'000})
    for (std::uint32_t seed = 0; seed < 6; ++seed) {
      SCOPED_TRACE(seed);
      expect_counted(Wound(soup(seed, 14, grid)));
    }
}

TEST(PieceWinding, SidesBoundTheSameSpace) {
  const Wound all(soup(3, 14, 12));
  const std::vector<std::uint32_t>& across = all.winding.across;
  const auto wound = [&](std::uint32_t side) {
    const Piece& piece = all.made.pieces[side / 6];
    return all.winding.in_front[side / 6] + (side % 2 == 1 ? piece.sheets : 0);
  };
  for (std::uint32_t side = 0; side < across.size(); ++side) {
    ASSERT_NE(across[side], kNone);
    EXPECT_EQ(across[across[side]], side);
    EXPECT_EQ(wound(across[side]), wound(side));
  }
}

TEST(PieceWinding, CountsTheHalfEdgesOfARim) {
  TriangleMesh mesh = box_at({1000, 1000, 1000}, {3000, 2000, 1000});
  mesh.triangles.pop_back();
  EXPECT_EQ(Wound(mesh).winding.open, 3U);
}

/// A triangle of which no place is as wide as the grid on which places to count from lie.
TriangleMesh needle() {
  TriangleMesh mesh;
  mesh.positions = {{1000, 20000000, 3000}, {1000 + 8388608, 20000000 + 8388607, 3000}, {1001, 20000001, 3000}};
  mesh.triangles = {{0, 1, 2}};
  return mesh;
}

TEST(PieceWinding, CountsPartsWithoutAPlaceToCountFrom) {
  TriangleMesh mesh = box_at({1000, 1000, 1000}, {3000, 2000, 1000});
  ::relief::testing::append(mesh, needle());
  const Wound all(mesh);
  ASSERT_EQ(all.made.pieces.size(), 13U);
  EXPECT_EQ(all.winding.undecided, std::vector<std::uint32_t>{12});
  EXPECT_TRUE(all.winding.is_in_solid(all.made.pieces[12], 12, 0));
  EXPECT_TRUE(all.winding.is_in_solid(all.made.pieces[12], 12, 1));
}

TEST(OuterSkin, SaysWhatWindingDoesNotDecide) {
  TriangleMesh mesh = box_at({1000, 1000, 1000}, {3000, 2000, 1000});
  ::relief::testing::append(mesh, box_at({2000, 2000, 1500}, {3000, 2000, 1000}));
  const auto decided = outer_skin(source_of(mesh), {});
  ASSERT_TRUE(decided);
  EXPECT_EQ(decided->undecided, 0);
  ::relief::testing::append(mesh, needle());
  const auto skin = outer_skin(source_of(mesh), {});
  ASSERT_TRUE(skin);
  EXPECT_EQ(skin->fault, OuterSkin::Fault::None);
  EXPECT_NEAR(skin->undecided, 0.5, 1e-6);
  EXPECT_EQ(skin->undecided_at, source_of(needle()).points[0]);
}

}  // namespace
}  // namespace relief::detail
