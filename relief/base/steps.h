// Long work of known size: its share is told now and then, and each step asks whether to go on.
#pragma once

#include <relief/base/progress.h>

#include <algorithm>
#include <cstdint>
#include <string_view>

namespace relief {

/// Work of `count` steps, which is the share `from` to `to` of a phase. Reports at most a hundred times. A step
/// costs a nanosecond. `progress` must outlive it.
class Steps {
 public:
  Steps(const Progress& progress, std::string_view phase, std::uint64_t count, double from = 0, double to = 1) noexcept
      : progress_(progress),
        phase_(phase),
        count_(std::max<std::uint64_t>(count, 1)),
        next_report_(stride()),
        from_(from),
        to_(to) {}

  /// One more is done. False: the work was cancelled.
  [[nodiscard]] bool next() { return reached(done_ + 1); }
  /// So many are done. False: the work was cancelled.
  [[nodiscard]] bool reached(std::uint64_t done) {
    done_ = done;
    if (done >= next_report_) report();
    stopped_ = stopped_ || progress_.cancelled();
    return !stopped_;
  }
  /// Returns whether a step has found the work cancelled.
  [[nodiscard]] bool stopped() const noexcept { return stopped_; }

 private:
  static constexpr std::uint64_t kReports = 100;
  [[nodiscard]] std::uint64_t stride() const noexcept { return (count_ + kReports - 1) / kReports; }
  void report() {
    next_report_ = done_ < count_ ? std::min(done_ + stride(), count_) : ~std::uint64_t{0};  // the last one once
    const double share = static_cast<double>(std::min(done_, count_)) / static_cast<double>(count_);
    progress_(phase_, from_ + (to_ - from_) * share);
  }

  const Progress& progress_;
  std::string_view phase_;
  std::uint64_t count_, done_ = 0, next_report_;
  double from_, to_;
  bool stopped_ = false;
};

/// Returns what work that is a part of a phase gets: its shares, of whatever phase, become `from` to `to` of `phase`.
/// `progress` and the text of `phase` must outlive it.
[[nodiscard]] inline Progress part_of(const Progress& progress, std::string_view phase, double from, double to) {
  Progress part{.report = {}, .cancel = progress.cancel};
  if (progress.report)
    part.report = [&progress, phase, from, to](std::string_view, double share) {
      progress(phase, from + (to - from) * share);
    };
  return part;
}

}  // namespace relief
