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
  std::uint64_t reads = 0;  ///< calls of latest()
  /// Those of them that gave another snapshot than the reader's last: only there has one changed hands.
  std::uint64_t exchanges = 0;
  std::uint64_t fewest = 0;  ///< exchanges of the reader with the fewest
  std::uint64_t published = 0, torn = 0;
  std::size_t most_held = 0;  ///< snapshots alive in the channel
};

/// Until the readers together have read and exchanged so many times. Every sample of a snapshot is looked at in the
/// read that first gives it; in each later one, the samples that were written first and last.
inline HandOver hand_over_runs(std::uint64_t reads_wanted, std::uint64_t exchanges_wanted, int reader_count) {
  const auto mesh = sphere_shell(0, 6);
  SnapshotDraft draft(Snapshot::make(mesh));
  SnapshotChannel channel(next_handed_over(draft, mesh->slab_count(), 0));
  std::atomic<std::uint64_t> reads{0}, torn{0}, exchanges{0};
  std::atomic<bool> crowded{false};
  std::vector<std::uint64_t> of_each(static_cast<std::size_t>(reader_count));
  const auto done_enough = [&] {
    return reads.load(std::memory_order_relaxed) >= reads_wanted &&
           exchanges.load(std::memory_order_relaxed) >= exchanges_wanted;
  };
  std::vector<std::thread> readers;
  readers.reserve(of_each.size());
  for (std::uint64_t& own : of_each)
    readers.emplace_back([&, reader = channel.reader()]() mutable {
      std::uint64_t last = 0;
      constexpr std::uint64_t kBatch = 64;
      do {
        std::uint64_t bad = 0, fresh = 0;
        for (std::uint64_t k = 0; k < kBatch; ++k) {
          const Snapshot& model = reader.latest();
          // By its number: a new one may lie where one that was freed has been.
          const bool is_new = model.number() != last;
          last = model.number();
          fresh += is_new ? 1 : 0;
          const float first = model.displacement(0)[0];
          bool whole = model.displacement(mesh->slab_count() - 1)[sample_count(6) - 1] == hand_over_sum(first);
          for (SlabId s = 0; is_new && s < mesh->slab_count(); ++s) {
            for (std::size_t i = 0; i + 1 < sample_count(6); ++i) whole = whole && model.displacement(s)[i] == first;
            whole = whole && model.displacement(s)[sample_count(6) - 1] == hand_over_sum(first);
          }
          bad += whole ? 0 : 1;
        }
        own += fresh;
        torn.fetch_add(bad, std::memory_order_relaxed);
        exchanges.fetch_add(fresh, std::memory_order_relaxed);
        reads.fetch_add(kBatch, std::memory_order_relaxed);
        if (fresh == 0 && crowded.load(std::memory_order_relaxed)) std::this_thread::yield();
      } while (!done_enough());
    });
  HandOver done;
  while (!done_enough()) {
    channel.publish(next_handed_over(draft, mesh->slab_count(), ++done.published));
    done.most_held = std::max(done.most_held, channel.held());
    // At full speed; where there are too few cores for that, and most would be published or read in vain, by turns.
    crowded = done.published > 4 * exchanges_wanted || reads.load(std::memory_order_relaxed) > 5'000 * exchanges_wanted;
    if (crowded) std::this_thread::yield();
  }
  for (std::thread& reader : readers) reader.join();
  done.reads = reads.load();
  done.torn = torn.load();
  done.exchanges = exchanges.load();
  done.fewest = std::ranges::min(of_each);
  return done;
}

}  // namespace relief::testing
