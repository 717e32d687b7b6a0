// Drawings (SVG) and tables (HTML) of what a servo did, for pages that need nothing outside themselves.
#pragma once

#include <relief/haptics/servo_thread.h>

#include <array>
#include <cstddef>
#include <functional>
#include <string>
#include <string_view>

namespace relief::plots {

/// Text for HTML, in an element or between quotes.
[[nodiscard]] std::string escaped(std::string_view text);

/// Least and greatest value per column of a drawing, so that no spike is lost, however many values there are.
class Envelope {
 public:
  static constexpr std::size_t kColumns = 800;
  /// x goes from 0 to `end`.
  explicit Envelope(double end);
  /// What is not finite or outside is left out.
  void add(double x, double value) noexcept;
  [[nodiscard]] double end() const noexcept { return end_; }
  [[nodiscard]] bool empty(std::size_t column) const noexcept { return low_[column] > high_[column]; }
  [[nodiscard]] double low(std::size_t column) const noexcept { return low_[column]; }
  [[nodiscard]] double high(std::size_t column) const noexcept { return high_[column]; }

 private:
  double end_;
  std::array<double, kColumns> low_{}, high_{};
};

/// The values over x; `colour`, where given, colours a strip under zero by column (empty: none there).
[[nodiscard]] std::string trace(const Envelope& values, std::string_view x_title, std::string_view y_title,
                                const std::function<std::string_view(std::size_t)>& colour = {});

/// One or two histograms over the same logarithmic axis, as shares of all ticks.
[[nodiscard]] std::string histogram(const TimeHistogram& ours, const TimeHistogram* null, std::string_view title);

/// A row of a table: what, value, both HTML.
[[nodiscard]] std::string row(std::string_view what, std::string_view value);
/// A row of a table with count, median, p99, p99.9 and max in microseconds, and the head of such a table.
[[nodiscard]] std::string times_row(std::string_view what, const TimeHistogram& times);
inline constexpr std::string_view kTimesHead =
    "<tr class=\"head\"><th>µs</th><th>count</th><th>median</th><th>p99</th><th>p99.9</th><th>max</th></tr>";

/// The whole page, light or dark as the reader's system is; `body` is HTML, `style` is CSS beyond that of all pages.
[[nodiscard]] std::string page(std::string_view title, std::string_view body, std::string_view style = {});

}  // namespace relief::plots
