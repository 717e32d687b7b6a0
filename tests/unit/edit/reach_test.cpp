// Which samples a dab reaches: across slab borders and corners, and never through to the far side.
#include "edit_support.h"

namespace relief {
namespace {

using testing::apply;
using testing::dab_near;
using testing::for_each_sample;
using testing::valid;

/// Every sample inside the tool's sphere is cut, whichever slab it belongs to: a border leaves no seam.
void expect_cut_everywhere(const SlabMesh& mesh, const Snapshot& before, const Snapshot& after, Vec3d centre,
                           double radius) {
  std::size_t inside = 0;
  for_each_sample(mesh, [&](SlabId s, std::size_t, GridPoint at) {
    EXPECT_GE(length(sample_position(after, s, at) - centre), radius - 1e-5)
        << "slab " << s << " sample " << at.i << "," << at.j;
    inside += length(sample_position(before, s, at) - centre) < radius ? 1 : 0;
  });
  EXPECT_GT(inside, 0U);
}

class Borders : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Intervals, Borders, ::testing::Values(1, 15, 32, 128));

TEST_P(Borders, EdgesAndCornersLeaveNoSeam) {
  const auto mesh = testing::plane_shell(2, GetParam());
  // On the middle corner, on an edge, and just beside it; the radius covers several slabs.
  for (const Vec3d at : {Vec3d{0.5, 0, 0.5}, {0.5, 0, 0.25}, {0.5001, 0, 0.2499}, {0.75, 0, 0.75}}) {
    Editor editor(Snapshot::make(mesh));
    const SnapshotPtr before = editor.head();
    const Dab dab = dab_near(*before, at, 0.05);
    apply(editor, {.tool = Tool::Carve, .radius = 1.5, .detail = 0}, dab);
    EXPECT_TRUE(valid(*editor.head()));
    expect_cut_everywhere(*mesh, *before, *editor.head(), dab.cursor + dab.normal * 1.5, 1.5);
  }
}

class Valence : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Fans, Valence, ::testing::Values(3, 4, 5, 6, 7, 8));

TEST_P(Valence, AllSlabsOfAFanTakePart) {
  const auto mesh = testing::double_pyramid(GetParam(), 32);
  for (const Tool tool : {Tool::Carve, Tool::Deposit, Tool::Paint}) {
    Editor editor(Snapshot::make(mesh));
    const SnapshotPtr before = editor.head();
    // From one slab at the tip, a brush that reaches all slabs around it; a second one at a corner of the waist.
    for (const Vec3d at : {Vec3d{0.01, 1, 0.005}, Vec3d{1, 0.01, 0.005}}) {
      Dab dab = dab_near(*editor.head(), at, 0, 1, 0.1);
      dab.normal = normalized(at);
      dab.cursor = dab.contact - dab.normal * 0.15;
      EXPECT_GT(apply(editor, {.tool = tool, .radius = 0.2, .detail = 0, .colour = {0, 0, 0}}, dab).samples, 0U);
      EXPECT_TRUE(valid(*editor.head()));
    }
    const Layer layer = tool == Tool::Paint ? Layer::Colour : Layer::Displacement;
    const float untouched = tool == Tool::Paint ? from_u16(to_u16(kClayColour.x)) : 0.5F;
    for (const SlabCorner c : mesh->fan(0)) {
      const Tile& tile = editor.head()->tile(layer, c.slab);
      // The tip itself and a sample inside the slab next to it.
      EXPECT_NE(tile.value(0, sample_index(tile.intervals(), corner_point(tile.intervals(), c.corner))), untouched);
      std::array<int, 3> w = {1, 1, 1};
      w[static_cast<std::size_t>(c.corner)] = tile.intervals() - 2;
      EXPECT_NE(tile.value(0, sample_index(tile.intervals(), from_weights(w))), untouched);
    }
  }
}

TEST(Reach, SharedSamplesReachSlabsThatTheToolDoesNot) {
  // The rim's fibres belong to both sides; the lower side is not worked on, yet must keep the same rim.
  const auto mesh = testing::thin_plate(4, 15, 0);
  Editor editor(Snapshot::make(mesh));
  const SnapshotPtr before = editor.head();
  Dab dab = dab_near(*before, {0.9, 0.1, 0.1}, 0, 1, 0.01);
  dab.normal = {0, 1, 0};
  EXPECT_GT(apply(editor, {.tool = Tool::Deposit, .radius = 0.3, .detail = 0}, dab).samples, 0U);
  EXPECT_TRUE(valid(*editor.head()));
  std::size_t changed_below = 0;
  for_each_sample(*mesh, [&](SlabId s, std::size_t k, GridPoint at) {
    if (s < mesh->slab_count() / 2 || editor.head()->displacement(s)[k] == before->displacement(s)[k]) return;
    ++changed_below;
    EXPECT_TRUE(at.i == 0 || at.j == 0 || at.i + at.j == 15) << "slab " << s;
  });
  EXPECT_GT(changed_below, 3U);
}

TEST(Reach, TheFarSideOfAThinWallStaysAsItIs) {
  for (const double bend : {0.0, 0.4, -0.4}) {
    const auto mesh = testing::thin_plate(6, 15, bend);
    const SlabId upper = mesh->slab_count() / 2;
    for (const Tool tool : {Tool::Carve, Tool::Deposit, Tool::Paint})
      // In the middle and at the rim, with a brush ten times as large as the wall is thick, from above and from below.
      for (const Vec3d at : {Vec3d{0.1, 0, 0.05}, {0.85, 0, 0.1}, {0.9, 0, 0.9}})
        for (const double side : {1.0, -1.0}) {
          Editor editor(Snapshot::make(mesh));
          const SnapshotPtr before = editor.head();
          const Vec3d wall = at + Vec3d{0, bend * dot(at, at), 0};
          Dab dab = dab_near(*before, wall + Vec3d{0, side * 0.02, 0}, 0.01, 1, 0.05);
          dab.normal = {0, side, 0};
          dab.cursor = dab.contact - dab.normal * 0.01;
          ASSERT_EQ(dab.slab < upper, side > 0);
          EXPECT_GT(apply(editor, {.tool = tool, .radius = 0.2, .detail = 0, .colour = {0, 0, 0}}, dab).samples, 0U);
          EXPECT_TRUE(valid(*editor.head()));
          const Layer layer = tool == Tool::Paint ? Layer::Colour : Layer::Displacement;
          for (SlabId s = 0; s < mesh->slab_count(); ++s) {
            if ((s < upper) == (side > 0)) continue;
            const Tile& tile = editor.head()->tile(layer, s);
            const int n = tile.intervals();
            for (int j = 1; j < n; ++j)
              for (int i = 1; i + j < n; ++i)
                ASSERT_EQ(tile.value(0, sample_index(n, {i, j})),
                          tool == Tool::Paint ? from_u16(to_u16(kClayColour.x)) : 0.5F)
                    << name(tool) << " reached slab " << s;
          }
        }
  }
}

TEST(Reach, ALayerThatIsNotConnectedStaysAsItIs) {
  // Two sheets, one above the other, in one cage: both face upwards, so only connection tells them apart.
  std::vector<Fibre> fibres;
  std::vector<SlabMesh::Face> faces;
  for (const double y : {0.0, 0.05}) {
    const auto first = static_cast<FibreId>(fibres.size());
    for (const auto& [x, z] : {std::pair{0.0, 0.0}, {0.0, 1.0}, {1.0, 1.0}, {1.0, 0.0}})
      fibres.push_back({{x, y - 0.02, z}, {x, y + 0.02, z}});
    faces.push_back({{first, first + 1, first + 2}, 32});
    faces.push_back({{first, first + 2, first + 3}, 32});
  }
  const auto mesh = testing::built(SlabMesh::make(std::move(fibres), faces));
  Editor editor(Snapshot::make(mesh));
  const Dab dab = {.slab = 0, .contact = {0.5, 0, 0.52}, .cursor = {0.5, -0.01, 0.52}, .normal = {0, 1, 0}};
  const SnapshotPtr before = editor.head();
  EXPECT_EQ(apply(editor, {.tool = Tool::Carve, .radius = 0.3, .detail = 0}, dab).slabs, 2U);
  for (const SlabId s : {0U, 1U, 2U, 3U})
    EXPECT_EQ(&editor.head()->tile(Layer::Displacement, s) == &before->tile(Layer::Displacement, s), s >= 2);
}

TEST(Reach, TheRimOfAnOpenSheetCanBeWorked) {
  const auto mesh = testing::plane_shell(3, 31);
  for (const Tool tool : {Tool::Carve, Tool::Deposit, Tool::Paint})
    for (const Vec3d at : {Vec3d{0, 0, 0}, {1, 0, 0.4}, {-0.2, 0, 1.2}}) {
      Editor editor(Snapshot::make(mesh));
      Dab dab = dab_near(*editor.head(), at, 0.03, 1, 0.1);
      dab.normal = {0, 1, 0};
      dab.cursor = dab.contact - dab.normal * 0.03;
      EXPECT_GT(apply(editor, {.tool = tool, .radius = 0.3, .detail = 0, .colour = {0, 0, 0}}, dab).samples, 0U);
      EXPECT_TRUE(valid(*editor.head()));
    }
}

TEST(Reach, ASmallBrushWorksInsideOneLargeSlab) {
  Editor editor(Snapshot::make(testing::plane_shell(1, 128)));
  const DabResult result =
      apply(editor, {.tool = Tool::Carve, .radius = 0.02, .detail = 0}, dab_near(*editor.head(), {0.7, 0, 0.3}, 0.005));
  EXPECT_EQ(result.slabs, 1U);
  EXPECT_GT(result.samples, 5U);
}

}  // namespace
}  // namespace relief
