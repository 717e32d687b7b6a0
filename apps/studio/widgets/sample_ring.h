// The last minute of a signal, and its envelope for drawing.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace relief::studio {

struct Sample {
  double time = 0;  ///< seconds, never falling from one sample to the next
  float value = 0;
};

/// Least and greatest value in a column of a drawing; empty where low > high.
struct Extent {
  float low, high;
  [[nodiscard]] bool empty() const { return low > high; }
};

/// The newest `capacity` samples; older ones are forgotten. A minute at 1 kHz is 1 MB.
class SampleRing {
 public:
  static constexpr std::size_t kMinute = 60'000;  // samples at 1 kHz
  explicit SampleRing(std::size_t capacity = kMinute);

  /// What is not finite or older than the newest sample is left out. O(samples).
  void append(std::span<const Sample> samples);
  void clear() { size_ = 0; }
  [[nodiscard]] bool empty() const { return size_ == 0; }
  [[nodiscard]] std::size_t size() const { return size_; }
  /// From the oldest to the newest.
  [[nodiscard]] const Sample& operator[](std::size_t i) const { return ring_[(begin_ + i) % ring_.size()]; }
  [[nodiscard]] const Sample& newest() const { return (*this)[size_ - 1]; }

  /// The last value at or before `time`; empty before the first sample. O(log size).
  [[nodiscard]] std::optional<float> at(double time) const;
  /// The extent of the samples in each of `columns` equal parts of [from, to), so that no spike is lost. 60,000 samples
  /// take about 0.1 ms.
  [[nodiscard]] std::vector<Extent> envelope(double from, double to, std::size_t columns) const;

 private:
  /// The first sample at or after `time`.
  [[nodiscard]] std::size_t lower_bound(double time) const;

  std::vector<Sample> ring_;
  std::size_t begin_ = 0, size_ = 0;
};

}  // namespace relief::studio
