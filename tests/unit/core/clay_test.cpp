#include "support/shells.h"

#include <relief/core/clay.h>

#include <gtest/gtest.h>

namespace relief {
namespace {

TEST(Clay, IsMeasuredAlongTheFibresOnBothSides) {
  const auto mesh = testing::sphere_shell(3, 8);
  const double whole = length(mesh->fibres()[0].direction());
  SnapshotDraft draft(Snapshot::make(mesh));
  const SnapshotPtr even = draft.finish();
  const Clay before = measure_clay(*even, 1);
  EXPECT_EQ(before.fibres, mesh->fibres().size());
  for (const ClaySide& side : {before.below, before.above}) {
    EXPECT_NEAR(side.least, whole / 2, 1e-6);
    EXPECT_NEAR(side.tenth, whole / 2, 1e-6);
    EXPECT_EQ(side.thin_fibres, 0);
    EXPECT_EQ(side.thin_samples, 0);
  }
  // Shares of another diagonal.
  EXPECT_NEAR(measure_clay(*even, 2).below.least, whole / 4, 1e-6);

  // One fibre just under what counts as thin, another just above.
  const auto with = [&](double thin) {
    SnapshotDraft cut(even);
    const auto alpha = static_cast<float>(thin / whole);
    for (const SlabCorner c : mesh->fan(5))
      cut.edit(Layer::Displacement, c.slab).plane()[sample_index(8, corner_point(8, c.corner))] = alpha;
    return measure_clay(*cut.finish(), 1);
  };
  const Clay under = with(0.0199), over = with(0.0201);
  EXPECT_NEAR(under.below.least, 0.0199, 1e-6);
  EXPECT_NEAR(under.below.tenth, whole / 2, 1e-6);
  EXPECT_NEAR(under.above.least, whole / 2, 1e-6);
  EXPECT_EQ(under.below.thin_fibres, 1 / double(mesh->fibres().size()));
  EXPECT_NEAR(under.below.thin_samples, double(mesh->fan(5).size()) / double(mesh->slab_count() * sample_count(8)),
              1e-12);
  const Fibre& cut = mesh->fibres()[5];
  EXPECT_LT(length(under.below.least_at - (cut.inner + normalized(cut.direction()) * 0.0199)), 1e-6);
  EXPECT_NEAR(over.below.least, 0.0201, 1e-6);
  EXPECT_EQ(over.below.thin_fibres, 0);
  EXPECT_EQ(over.below.thin_samples, 0);
}

TEST(Clay, HolesHaveNone) {
  const auto mesh = testing::sphere_shell(2, 4);
  SnapshotDraft draft(Snapshot::make(mesh));
  draft.add_layer(Layer::Void, kOwnIntervals, 0);
  for (const SlabCorner c : mesh->fan(3)) {
    const std::size_t k = sample_index(4, corner_point(4, c.corner));
    draft.edit(Layer::Displacement, c.slab).plane()[k] = 0;
    draft.edit(Layer::Void, c.slab).plane()[k] = 1;
  }
  const Clay clay = measure_clay(*draft.finish(), 1);
  EXPECT_EQ(clay.fibres, mesh->fibres().size() - 1);
  EXPECT_EQ(clay.below.thin_fibres, 0);
  EXPECT_GT(clay.below.least, 0.1);
}

}  // namespace
}  // namespace relief
