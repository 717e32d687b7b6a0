// What a stroke leaves behind, and what it does not touch.
#include "edit_support.h"

namespace relief {
namespace {

using testing::dab_near;
using testing::displaced;

void stroke(Editor& editor, Tool tool, double turn) {
  editor.begin_stroke({.tool = tool, .radius = 0.25, .detail = 0, .colour = {0, 0, 1}});
  for (int k = 0; k < 12; ++k) {
    const double at = turn + 0.05 * k;
    editor.dab(dab_near(*editor.head(), {std::cos(at), 0.3, std::sin(at)}, 0.03, 1, 0.05));
  }
  EXPECT_TRUE(editor.end_stroke().changed);
}

TEST(EditorStroke, CancelDropsTheOpenStroke) {
  Editor editor(Snapshot::make(testing::sphere_shell(1, 15)));
  stroke(editor, Tool::Carve, 0);
  const SnapshotPtr before = editor.head();
  editor.begin_stroke({.tool = Tool::Deposit, .radius = 0.3, .detail = 0});
  EXPECT_TRUE(editor.in_stroke());
  editor.dab(dab_near(*editor.head(), {0, 1, 0}, 0, 1, 0.1));
  EXPECT_NE(editor.head(), before);
  editor.cancel_stroke();
  EXPECT_FALSE(editor.in_stroke());
  EXPECT_EQ(editor.head(), before);
}

TEST(EditorStroke, AStrokeThatChangesNothingLeavesNoStep) {
  Editor editor(Snapshot::make(testing::sphere_shell(1, 15)));
  editor.begin_stroke({.tool = Tool::Deposit, .radius = 0.3, .detail = 0});
  EXPECT_EQ(editor.dab(dab_near(*editor.head(), {0, 1, 0}, 0, 1, 0)).samples, 0U);
  EXPECT_FALSE(editor.end_stroke().changed);
}

TEST(EditorStroke, SnapshotsThatReadersHoldNeverChange) {
  Editor editor(Snapshot::make(testing::sphere_shell(1, 15)));
  const SnapshotPtr held = editor.head();
  const std::uint64_t hash = held->content_hash();
  editor.begin_stroke({.tool = Tool::Carve, .radius = 0.3, .detail = 0});
  editor.dab(dab_near(*held, {0, 1, 0}, 0.05));
  const SnapshotPtr between = editor.head();
  const std::uint64_t between_hash = between->content_hash();
  editor.dab(dab_near(*held, {0, 1, 0.05}, 0.08));
  editor.end_stroke();
  EXPECT_EQ(held->content_hash(), hash);
  EXPECT_EQ(between->content_hash(), between_hash);
  EXPECT_NE(editor.head()->content_hash(), between_hash);
}

TEST(EditorStroke, ADabCopiesOnlyTheTilesItChanges) {
  Editor editor(Snapshot::make(testing::sphere_shell(3, 15)));
  const SnapshotPtr before = editor.head();
  editor.begin_stroke({.tool = Tool::Carve, .radius = 0.1, .detail = 0});
  const DabResult result = editor.dab(dab_near(*before, {0.5, 0.8, 0.3}, 0.03));
  editor.end_stroke();
  std::size_t copied = 0;
  for_each_change(*before, *editor.head(), [&](Layer, SlabId) { ++copied; });
  EXPECT_GT(copied, 0U);
  EXPECT_LE(copied, result.slabs + 12);
  EXPECT_LT(copied, 40U);
}

TEST(EditorStroke, TheSameStrokesGiveTheSameBits) {
  std::vector<std::uint64_t> hashes;
  for (int run = 0; run < 2; ++run) {
    Editor editor(displaced(testing::torus_shell(10, 6, 15), testing::bumps));
    for (const Tool tool : {Tool::Carve, Tool::Deposit, Tool::Paint}) stroke(editor, tool, 1);
    hashes.push_back(editor.head()->content_hash());
  }
  EXPECT_EQ(hashes[0], hashes[1]);
}

}  // namespace
}  // namespace relief
