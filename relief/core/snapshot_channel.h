// How the newest snapshot gets from the one writer to readers that may never wait.
#pragma once

#include <relief/core/snapshot.h>

#include <array>
#include <atomic>
#include <memory>
#include <vector>

namespace relief {

/// One thread publishes; up to kMaxReaders threads read. A reader pins the snapshot it uses in a slot of its own (a
/// hazard pointer); the publisher frees a snapshot when it is neither the newest nor pinned. Readers are wait-free:
/// they never lock, allocate, free or retry without bound. A reader that stalls only makes the list of waiting
/// snapshots longer.
class SnapshotChannel {
 public:
  static constexpr int kMaxReaders = 8;

  class Reader {
   public:
    Reader(Reader&& other) noexcept;
    Reader& operator=(Reader&&) = delete;
    ~Reader();

    /// The newest snapshot, or, when the writer kept replacing it during four tries, the one this reader already had.
    /// Valid until the next call on this reader. Wait-free.
    [[nodiscard]] const Snapshot& latest() noexcept;

   private:
    friend class SnapshotChannel;
    Reader(SnapshotChannel& channel, int slot) noexcept;
    SnapshotChannel* channel_;
    int slot_;
    int active_ = 0;
  };

  explicit SnapshotChannel(SnapshotPtr first);
  SnapshotChannel(const SnapshotChannel&) = delete;
  SnapshotChannel& operator=(const SnapshotChannel&) = delete;
  /// All readers must be gone.
  ~SnapshotChannel();

  /// A place for one more reader; asserts when all are taken. Any thread, not on the servo's path.
  [[nodiscard]] Reader reader();
  /// Makes `next` the newest and frees what nobody pins. The writer's thread only.
  void publish(SnapshotPtr next);
  /// Snapshots kept alive by the channel, the newest included. The writer's thread only.
  [[nodiscard]] std::size_t held() const noexcept { return alive_.size(); }

 private:
  struct alignas(64) Slot {
    std::array<std::atomic<const Snapshot*>, 2> pinned{};
    std::atomic<bool> taken{false};
  };
  std::atomic<const Snapshot*> newest_;
  std::array<Slot, kMaxReaders> slots_;
  std::vector<SnapshotPtr> alive_;
};

}  // namespace relief
