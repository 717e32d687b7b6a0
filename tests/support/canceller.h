// Work that is cancelled from inside, ever later.
#pragma once

#include <relief/base/error.h>
#include <relief/base/progress.h>

#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <string_view>

namespace relief::testing {

/// Cancels at the n-th report of a share; counts them.
struct Canceller {
  explicit Canceller(int reports) : left(reports) {
    progress = {.report =
                    [this](std::string_view, double share) {
                      EXPECT_GE(share, 0);
                      EXPECT_LE(share, 1);
                      ++told;
                      if (--left == 0) stop = true;
                    },
                .cancel = &stop};
  }
  int left, told = 0;
  std::atomic<bool> stop = false;
  Progress progress;
};

/// The code of a failure; of success one that the work never has.
template <typename Outcome>
[[nodiscard]] Errc code(const Outcome& outcome) {
  return outcome ? Errc::InvalidArgument : outcome.error().code;
}

/// Runs the work again and again, stopped ever later, until it comes to its end. Each time it must say that it was
/// cancelled, and `unchanged` looks at what it left. Returns how often it was stopped.
inline int times_stopped(const std::function<Errc(const Progress&)>& work, const std::function<void()>& unchanged,
                         int most_reports) {
  for (int reports = 1; reports < 1000; ++reports) {
    Canceller canceller(reports);
    const Errc ended = work(canceller.progress);
    EXPECT_LE(canceller.told, most_reports);
    if (!canceller.stop) return reports - 1;
    EXPECT_EQ(ended, Errc::Cancelled) << "at report " << reports;
    unchanged();
    if (::testing::Test::HasFailure()) return 0;
  }
  return 0;
}

}  // namespace relief::testing
