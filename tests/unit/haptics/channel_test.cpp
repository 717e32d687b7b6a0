// The hand-over of snapshots: what a reader that stalls costs. S22 of the acceptance tests has both at full speed.
#include "support/hand_over_runs.h"

#include <relief/core/snapshot_channel.h>

#include <gtest/gtest.h>

namespace relief {
namespace {

TEST(Channel, AStalledReaderKeepsItsSnapshotAndOnlyThat) {
  const auto mesh = testing::sphere_shell(0, 4);
  SnapshotDraft draft(Snapshot::make(mesh));
  SnapshotChannel channel(testing::next_handed_over(draft, mesh->slab_count(), 0));
  SnapshotChannel::Reader stalled = channel.reader();
  const Snapshot& old = stalled.latest();
  for (std::uint64_t k = 1; k < 500; ++k) channel.publish(testing::next_handed_over(draft, mesh->slab_count(), k));
  EXPECT_EQ(old.displacement(3)[2], testing::hand_over_value(0));
  EXPECT_LE(channel.held(), 3U);
  EXPECT_EQ(stalled.latest().displacement(3)[2], testing::hand_over_value(499));
}

}  // namespace
}  // namespace relief
