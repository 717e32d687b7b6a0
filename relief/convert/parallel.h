// Loops over independent work on all threads.
#pragma once

#include <relief/base/progress.h>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <atomic>
#include <cstddef>

namespace relief::detail {

/// Calls work(k) for all k < count, `grain` of them at a time; false when cancelled, and then not all were called.
template <typename Work>
bool for_all(std::size_t count, std::size_t grain, const Progress& progress, Work&& work) {
  // TBB hands the work over and back; said once more in atomics, a thread sanitizer sees it, too (tests/tsan.supp).
  std::atomic<bool> begun;
  begun.store(true, std::memory_order_release);
  std::atomic<std::size_t> done = 0;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, grain),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      static_cast<void>(begun.load(std::memory_order_acquire));
                      if (progress.cancelled()) return;
                      for (std::size_t k = range.begin(); k != range.end(); ++k) work(k);
                      done.fetch_add(range.size(), std::memory_order_release);
                    });
  return done.load(std::memory_order_acquire) == count;
}

}  // namespace relief::detail
