// How the newest snapshot gets from the one writer to readers that may never wait.
#pragma once

#include <relief/core/snapshot.h>

#include <array>
#include <atomic>
#include <memory>
#include <vector>

namespace relief {

/// One thread publishes; up to kMaxReaders threads read. A reader pins its snapshot in a slot of its own (a hazard
/// pointer). The publisher frees a snapshot that is neither the newest nor pinned. Readers are wait-free: they never
/// lock, allocate, free or retry without bound. A stalled reader only lengthens the list of waiting snapshots.
class SnapshotChannel {
 public:
  static constexpr int kMaxReaders = 8;  ///< readers that may exist at a time

  /// One reader's end of the channel; each belongs to one thread.
  class Reader {
   public:
    /// Takes over the other one's place in the channel.
    Reader(Reader&& other) noexcept;
    Reader& operator=(Reader&&) = delete;
    ~Reader();

    /// Returns the newest snapshot, or, when the writer kept replacing it during four tries, the one this reader
    /// already had. Valid until the next call on this reader. Wait-free.
    [[nodiscard]] const Snapshot& latest() noexcept;
    /// Returns the one that this reader already has. Wait-free.
    [[nodiscard]] const Snapshot& current() const noexcept;

   private:
    friend class SnapshotChannel;
    Reader(SnapshotChannel& channel, int slot) noexcept;
    SnapshotChannel* channel_;
    int slot_;
    int active_ = 0;
  };

  /// Publishes a first snapshot; not null.
  explicit SnapshotChannel(SnapshotPtr first);
  SnapshotChannel(const SnapshotChannel&) = delete;
  SnapshotChannel& operator=(const SnapshotChannel&) = delete;
  /// All readers must be gone.
  ~SnapshotChannel();

  /// Returns a place for one more reader; asserts when all are taken. Any thread, not on the servo's path.
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
