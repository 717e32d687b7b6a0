#include "sample_ring.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace relief::studio {

SampleRing::SampleRing(std::size_t capacity) : ring_(capacity) {}

void SampleRing::append(std::span<const Sample> samples) {
  for (const Sample& sample : samples) {
    if (!std::isfinite(sample.time) || !std::isfinite(sample.value)) continue;
    if (!empty() && sample.time < newest().time) continue;
    ring_[(begin_ + size_) % ring_.size()] = sample;
    if (size_ < ring_.size())
      ++size_;
    else
      begin_ = (begin_ + 1) % ring_.size();
  }
}

std::size_t SampleRing::lower_bound(double time) const {
  std::size_t first = 0, count = size_;
  while (count > 0) {
    const std::size_t half = count / 2;
    if ((*this)[first + half].time < time) {
      first += half + 1;
      count -= half + 1;
    } else {
      count = half;
    }
  }
  return first;
}

std::optional<float> SampleRing::at(double time) const {
  const std::size_t after = lower_bound(std::nextafter(time, std::numeric_limits<double>::infinity()));
  return after == 0 ? std::nullopt : std::optional((*this)[after - 1].value);
}

std::vector<Extent> SampleRing::envelope(double from, double to, std::size_t columns) const {
  constexpr float kNone = std::numeric_limits<float>::infinity();
  std::vector<Extent> extents(columns, Extent{kNone, -kNone});
  const double per_second = static_cast<double>(columns) / (to - from);
  for (std::size_t i = lower_bound(from); i < size_ && (*this)[i].time < to; ++i) {
    const Sample& sample = (*this)[i];
    const auto column = std::min(static_cast<std::size_t>((sample.time - from) * per_second), columns - 1);
    Extent& extent = extents[column];
    extent.low = std::min(extent.low, sample.value);
    extent.high = std::max(extent.high, sample.value);
  }
  return extents;
}

}  // namespace relief::studio
