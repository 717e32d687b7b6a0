// Loops over independent work on all threads.
#pragma once

#include <relief/base/progress.h>

#ifdef __SANITIZE_THREAD__
#include <algorithm>
#include <atomic>
#include <thread>
#else
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#endif

#include <cstddef>

namespace relief::detail {

/// Calls work(k) for all k < count, `grain` of them at a time; false when cancelled, and then not all may be called.
template <typename Work>
bool for_all(std::size_t count, std::size_t grain, const Progress& progress, Work&& work) {
#ifdef __SANITIZE_THREAD__
  // TBB is not built for the sanitizer, which takes what it hands over for races; two threads of our own show those of
  // the work.
  std::atomic<std::size_t> next = 0;
  const auto run = [&] {
    for (std::size_t begin = 0; (begin = next.fetch_add(grain)) < count && !progress.cancelled();)
      for (std::size_t k = begin; k < std::min(count, begin + grain); ++k) work(k);
  };
  std::thread other(run);
  run();
  other.join();
#else
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, grain),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      if (progress.cancelled()) return;
                      for (std::size_t k = range.begin(); k != range.end(); ++k) work(k);
                    });
#endif
  return !progress.cancelled();
}

}  // namespace relief::detail
