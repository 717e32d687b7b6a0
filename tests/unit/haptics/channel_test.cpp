// The hand-over of snapshots with a writer at full speed: readers never see a torn or freed one.
#include "support/shells.h"

#include <relief/core/snapshot_channel.h>

#include <gtest/gtest.h>

#include <atomic>
#include <cstdint>
#include <thread>
#include <vector>

namespace relief {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr int kPublished = 3'000;
#else
constexpr int kPublished = 30'000;
#endif

/// Snapshot number k holds the displacement value(k) in every sample of every slab: any mixture shows.
float value(int k) { return static_cast<float>(k % 1000) / 1000.0F; }

SnapshotPtr next(SnapshotDraft& draft, SlabId slabs, int k) {
  for (SlabId s = 0; s < slabs; ++s) {
    Tile& tile = draft.edit(Layer::Displacement, s);
    std::fill_n(tile.plane(), tile.size(), value(k));
  }
  return draft.finish();
}

TEST(Channel, ReadersNeverSeeAMixtureOrAFreedSnapshot) {
  const auto mesh = testing::sphere_shell(0, 6);
  SnapshotDraft draft(Snapshot::make(mesh));
  SnapshotChannel channel(next(draft, mesh->slab_count(), 0));
  std::atomic<bool> done{false};
  std::atomic<std::uint64_t> reads{0}, torn{0}, seen_new{0};
  std::vector<std::thread> readers;
  for (int r = 0; r < 3; ++r)
    readers.emplace_back([&, reader = channel.reader()]() mutable {
      const Snapshot* last = nullptr;
      while (!done.load(std::memory_order_acquire)) {
        const Snapshot& model = reader.latest();
        const float first = model.displacement(0)[0];
        bool same = true;
        for (SlabId s = 0; s < mesh->slab_count(); ++s)
          for (std::size_t k = 0; k < sample_count(6); ++k) same = same && model.displacement(s)[k] == first;
        if (!same) torn.fetch_add(1);
        if (&model != last) seen_new.fetch_add(1);
        last = &model;
        reads.fetch_add(1);
      }
    });
  std::size_t most_held = 0;
  for (int k = 1; k < kPublished; ++k) {
    channel.publish(next(draft, mesh->slab_count(), k));
    most_held = std::max(most_held, channel.held());
  }
  while (reads.load() < 1000) std::this_thread::yield();
  done.store(true, std::memory_order_release);
  for (std::thread& reader : readers) reader.join();
  EXPECT_EQ(torn.load(), 0U);
  EXPECT_GT(seen_new.load(), 10U);
  EXPECT_LE(most_held, 1U + 2U * 3U) << "the newest, and two per reader at most";
}

TEST(Channel, AStalledReaderKeepsItsSnapshotAndOnlyThat) {
  const auto mesh = testing::sphere_shell(0, 4);
  SnapshotDraft draft(Snapshot::make(mesh));
  SnapshotChannel channel(next(draft, mesh->slab_count(), 0));
  SnapshotChannel::Reader stalled = channel.reader();
  const Snapshot& old = stalled.latest();
  for (int k = 1; k < 500; ++k) channel.publish(next(draft, mesh->slab_count(), k));
  EXPECT_EQ(old.displacement(3)[2], value(0));
  EXPECT_LE(channel.held(), 3U);
  EXPECT_EQ(stalled.latest().displacement(3)[2], value(499));
}

}  // namespace
}  // namespace relief
