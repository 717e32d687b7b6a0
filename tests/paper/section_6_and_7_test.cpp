// Sections 6 and 7: what graphics gets, and the models of the paper's size.
#include "support/data.h"
#include "support/shells.h"

#include <relief/convert/convert.h>
#include <relief/core/query.h>
#include <relief/core/tessellate.h>
#include <relief/edit/editor.h>
#include <relief/mesh/import.h>
#include <relief/mesh/samples.h>

#include <gtest/gtest.h>

#include <set>

namespace relief {
namespace {

using testing::sphere_shell;

TEST(PaperSec6, OnlyModifiedSlabsNeedANewDisplayList) {
  const SnapshotPtr before = Snapshot::make(sphere_shell(3, 15));
  Editor editor(before);
  editor.begin_stroke({.tool = Tool::Carve, .radius = 0.15, .detail = 0});
  const SurfacePoint p = closest_point(*before, {0, 0, 1});
  editor.dab({.slab = p.slab, .contact = p.position, .cursor = p.position - p.normal * 0.05, .normal = p.normal});
  editor.end_stroke();
  std::set<SlabId> changed;
  for_each_change(*before, *editor.head(), [&](Layer, SlabId s) { changed.insert(s); });
  EXPECT_FALSE(changed.empty());
  EXPECT_LT(changed.size(), 40U) << "of 512 slabs";
  for (SlabId s = 0; s < before->slab_mesh().slab_count(); ++s)
    EXPECT_EQ(before->tile(Layer::Displacement, s).same_values(editor.head()->tile(Layer::Displacement, s)),
              !changed.contains(s));
}

TEST(PaperSec6, AVisibleMeshComesFromACoarseSubsetOfTheCoordinates) {
  const SnapshotPtr model = Snapshot::make(sphere_shell(1, 16));
  EXPECT_EQ(tessellate(*model, 0).triangles.size(), 32U * 256);
  EXPECT_EQ(tessellate(*model, 2).triangles.size(), 32U * 16);
}

TEST(PaperSec6, ColourHasAResolutionOfItsOwn) {
  SnapshotDraft draft(Snapshot::make(sphere_shell(1, 15)));
  draft.add_layer(Layer::Colour, 64, 1);
  const SnapshotPtr model = draft.finish();
  EXPECT_EQ(model->tile(Layer::Colour, 0).intervals(), 64);
  EXPECT_EQ(model->tile(Layer::Displacement, 0).intervals(), 15);
  EXPECT_TRUE(validate(*model));
}

void expect_paper_model(const TriangleMesh& source, int slabs) {
  const auto made = convert(source, {.slabs = slabs, .intervals = 15});
  ASSERT_TRUE(made) << made.error().message;
  const Snapshot& head = *made->model.head;
  EXPECT_LE(head.slab_mesh().slab_count(), static_cast<SlabId>(slabs));
  EXPECT_GE(head.slab_mesh().slab_count(), static_cast<SlabId>(slabs * 9 / 10));
  for (SlabId s = 0; s < head.slab_mesh().slab_count(); ++s) EXPECT_EQ(head.slab_mesh().intervals(s), 15);
  EXPECT_EQ(sample_count(15), 136U) << "16 values along each edge";
  const std::size_t most = std::size_t{225} * head.slab_mesh().slab_count(), drawn = tessellate(head).triangles.size();
  if (head.has(Layer::Void)) {
    EXPECT_LT(drawn, most);
    EXPECT_GT(drawn, most * 9 / 10);
  } else {
    EXPECT_EQ(drawn, most);
  }
  EXPECT_TRUE(validate(head));
}

TEST(PaperSec7, HeadAndPumpkinWith200SlabsOf225Polygons) {
  for (const char* name : {"head", "pumpkin"}) {
    const auto source = make_sample(name, 60'000);
    ASSERT_TRUE(source);
    SCOPED_TRACE(name);
    expect_paper_model(*source, 200);
  }
}

TEST(PaperSec7, BunnyWith150Slabs) {
  RELIEF_DATA_FILE(file, "a_models/bunny.ply");
  const auto source = import_mesh(file);
  ASSERT_TRUE(source) << source.error().message;
  expect_paper_model(*source, 150);
}

}  // namespace
}  // namespace relief
