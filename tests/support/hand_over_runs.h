// A writer at full speed and readers at full speed on one channel of snapshots.
#pragma once

#include "support/shells.h"

#include <relief/core/snapshot_channel.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <thread>
#include <vector>

namespace relief::testing {

/// Snapshot number k holds this displacement in every sample of every slab, so any mixture shows; and a sum of it in
/// its last sample.
inline float hand_over_value(std::uint64_t k) { return static_cast<float>(k % 1000) / 1000.0F; }
inline float hand_over_sum(float value) { return 1 - value; }

inline SnapshotPtr next_handed_over(SnapshotDraft& draft, SlabId slabs, std::uint64_t k) {
  const float value = hand_over_value(k);
  for (SlabId s = 0; s < slabs; ++s) {
    Tile& tile = draft.edit(Layer::Displacement, s);
    std::fill_n(tile.plane(), tile.size(), value);
    tile.plane()[tile.size() - 1] = hand_over_sum(value);
  }
  return draft.finish();
}

struct HandOver {
  std::uint64_t reads = 0, published = 0, torn = 0, seen_new = 0;
  std::size_t most_held = 0;  ///< snapshots alive in the channel
};

/// Until the readers together have taken a snapshot so many times, and found a new one often enough to show anything.
inline HandOver hand_over_runs(std::uint64_t wanted, int reader_count) {
  constexpr std::uint64_t kSeen = 20;
  const auto mesh = sphere_shell(0, 6);
  SnapshotDraft draft(Snapshot::make(mesh));
  SnapshotChannel channel(next_handed_over(draft, mesh->slab_count(), 0));
  std::atomic<std::uint64_t> reads{0}, torn{0}, seen_new{0};
  std::vector<std::thread> readers;
  readers.reserve(static_cast<std::size_t>(reader_count));
  for (int r = 0; r < reader_count; ++r)
    readers.emplace_back([&, reader = channel.reader()]() mutable {
      const Snapshot* last = nullptr;
      constexpr std::uint64_t kBatch = 64;
      for (bool more = true; more;) {
        std::uint64_t bad = 0, fresh = 0;
        for (std::uint64_t k = 0; k < kBatch; ++k) {
          const Snapshot& model = reader.latest();
          const bool is_new = &model != last;
          last = &model;
          fresh += is_new ? 1 : 0;
          const float first = model.displacement(0)[0];
          // All of a new one; of the same once more two samples that were written first and last.
          bool whole = model.displacement(mesh->slab_count() - 1)[sample_count(6) - 1] == hand_over_sum(first);
          for (SlabId s = 0; is_new && s < mesh->slab_count(); ++s) {
            for (std::size_t i = 0; i + 1 < sample_count(6); ++i) whole = whole && model.displacement(s)[i] == first;
            whole = whole && model.displacement(s)[sample_count(6) - 1] == hand_over_sum(first);
          }
          bad += whole ? 0 : 1;
        }
        torn.fetch_add(bad, std::memory_order_relaxed);
        seen_new.fetch_add(fresh, std::memory_order_relaxed);
        more = reads.fetch_add(kBatch, std::memory_order_relaxed) + kBatch < wanted || seen_new.load() < kSeen;
      }
    });
  HandOver done;
  while (reads.load(std::memory_order_relaxed) < wanted || seen_new.load() < kSeen) {
    channel.publish(next_handed_over(draft, mesh->slab_count(), ++done.published));
    done.most_held = std::max(done.most_held, channel.held());
  }
  for (std::thread& reader : readers) reader.join();
  done.reads = reads.load();
  done.torn = torn.load();
  done.seen_new = seen_new.load();
  return done;
}

}  // namespace relief::testing
