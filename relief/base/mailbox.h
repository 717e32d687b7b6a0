// The newest value from one thread to one other thread; neither ever waits.
#pragma once

#include <array>
#include <atomic>
#include <type_traits>

namespace relief {

/// Single writer, single reader, three places. Both calls are wait-free and never allocate. A value that is overtaken
/// before it was taken is lost: where each one counts, see SpscQueue.
template <typename T>
class Mailbox {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  /// Leaves a value in place of the one that lies there.
  void put(const T& value) noexcept {
    items_[back_] = value;
    back_ = middle_.exchange(back_ | kFresh, std::memory_order_acq_rel) & kPlace;
  }
  /// False, and `value` as it was, where nothing was put since the last call.
  [[nodiscard]] bool take(T& value) noexcept {
    if ((middle_.load(std::memory_order_relaxed) & kFresh) == 0) return false;
    front_ = middle_.exchange(front_, std::memory_order_acq_rel) & kPlace;
    value = items_[front_];
    return true;
  }

 private:
  static constexpr unsigned kFresh = 4, kPlace = 3;
  std::array<T, 3> items_{};
  unsigned back_ = 0, front_ = 1;  ///< the writer's, the reader's
  std::atomic<unsigned> middle_{2};
};

}  // namespace relief
