// Loops over independent work on all threads.
#pragma once

#include <relief/base/progress.h>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <cstddef>

namespace relief::detail {

/// Calls work(k) for all k < count, `grain` of them at a time; false when cancelled, and then not all were called.
template <typename Work>
bool for_all(std::size_t count, std::size_t grain, const Progress& progress, Work&& work) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, grain),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      if (progress.cancelled()) return;
                      for (std::size_t k = range.begin(); k != range.end(); ++k) work(k);
                    });
  return !progress.cancelled();
}

}  // namespace relief::detail
