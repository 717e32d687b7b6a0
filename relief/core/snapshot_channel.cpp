#include <relief/base/assert.h>
#include <relief/core/snapshot_channel.h>

#include <utility>

namespace relief {

// Invariant: a pinned snapshot was the newest at some moment after its pin was stored. The publisher replaces the
// newest before it reads the pins, so it sees the pin. All is sequentially consistent: storing the pin and checking
// `newest_` must not change places. A reader's two pins take turns: one tries a newer snapshot while the other protects
// the last.

SnapshotChannel::SnapshotChannel(SnapshotPtr first) : newest_(first.get()) { alive_.push_back(std::move(first)); }

SnapshotChannel::~SnapshotChannel() {
  for (const Slot& slot : slots_) RELIEF_ASSERT(!slot.taken.load());
}

SnapshotChannel::Reader SnapshotChannel::reader() {
  for (int s = 0; s < kMaxReaders; ++s) {
    bool expected = false;
    if (slots_[static_cast<std::size_t>(s)].taken.compare_exchange_strong(expected, true)) return {*this, s};
  }
  RELIEF_ASSERT(!"a free reader slot");
  std::unreachable();
}

void SnapshotChannel::publish(SnapshotPtr next) {
  const Snapshot* newest = next.get();
  if (newest == newest_.load(std::memory_order_relaxed)) return;
  alive_.push_back(std::move(next));
  newest_.store(newest, std::memory_order_seq_cst);
  std::erase_if(alive_, [&](const SnapshotPtr& held) {
    if (held.get() == newest) return false;
    for (const Slot& slot : slots_)
      for (const auto& pin : slot.pinned)
        if (pin.load(std::memory_order_seq_cst) == held.get()) return false;
    return true;
  });
}

SnapshotChannel::Reader::Reader(SnapshotChannel& channel, int slot) noexcept : channel_(&channel), slot_(slot) {
  // A first pin, so that latest() always has one to fall back to. Not on the servo's path, so it may repeat.
  auto& pin = channel_->slots_[static_cast<std::size_t>(slot_)].pinned[0];
  const Snapshot* seen = channel_->newest_.load();
  do {
    pin.store(seen);
    const Snapshot* again = channel_->newest_.load();
    if (again == seen) break;
    seen = again;
  } while (true);
}

SnapshotChannel::Reader::Reader(Reader&& other) noexcept
    : channel_(std::exchange(other.channel_, nullptr)), slot_(other.slot_), active_(other.active_) {}

SnapshotChannel::Reader::~Reader() {
  if (channel_ == nullptr) return;
  Slot& slot = channel_->slots_[static_cast<std::size_t>(slot_)];
  for (auto& pin : slot.pinned) pin.store(nullptr);
  slot.taken.store(false);
}

const Snapshot& SnapshotChannel::Reader::current() const noexcept {
  const Slot& slot = channel_->slots_[static_cast<std::size_t>(slot_)];
  return *slot.pinned[static_cast<std::size_t>(active_)].load(std::memory_order_relaxed);
}

const Snapshot& SnapshotChannel::Reader::latest() noexcept {
  Slot& slot = channel_->slots_[static_cast<std::size_t>(slot_)];
  auto& mine = slot.pinned[static_cast<std::size_t>(active_)];
  const Snapshot* have = mine.load(std::memory_order_relaxed);
  const Snapshot* seen = channel_->newest_.load(std::memory_order_seq_cst);
  if (seen == have) return *have;
  auto& other = slot.pinned[static_cast<std::size_t>(1 - active_)];
  for (int tries = 0; tries < 4; ++tries) {
    other.store(seen, std::memory_order_seq_cst);
    const Snapshot* again = channel_->newest_.load(std::memory_order_seq_cst);
    if (again == seen) {
      active_ = 1 - active_;
      mine.store(nullptr, std::memory_order_release);
      return *seen;
    }
    seen = again;
  }
  other.store(nullptr, std::memory_order_release);
  return *have;
}

}  // namespace relief
