#include <relief/verify/shell_facts.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace relief::verify::detail {

namespace {

constexpr double kMinSpan = 0x1p20;  // steps; a few round numbers do not make a coarse lattice

}  // namespace

Extent::Extent() {
  low.fill(std::numeric_limits<double>::infinity());
  high.fill(-std::numeric_limits<double>::infinity());
}

void Extent::add(const std::array<double, 3>& p) {
  for (std::size_t k = 0; k < 3; ++k) {
    low[k] = std::min(low[k], p[k]);
    high[k] = std::max(high[k], p[k]);
    if (p[k] == 0) continue;
    int exponent = 0;
    const double fraction = std::frexp(p[k], &exponent);
    const auto digits = static_cast<std::int64_t>(std::ldexp(fraction, 53));
    const int zeros = std::countr_zero(static_cast<std::uint64_t>(digits < 0 ? -digits : digits));
    lowest = std::min(lowest, exponent - 53 + zeros);
  }
}

void Extent::add(const Extent& other) {
  for (std::size_t k = 0; k < 3; ++k) {
    low[k] = std::min(low[k], other.low[k]);
    high[k] = std::max(high[k], other.high[k]);
  }
  lowest = std::min(lowest, other.lowest);
}

int Extent::likely_step() const {
  double farthest = 0;
  for (std::size_t k = 0; k < 3; ++k) farthest = std::max({farthest, std::abs(low[k]), std::abs(high[k])});
  int exponent = 0;
  std::frexp(farthest, &exponent);
  int likely = step();
  while (likely > exponent - 51 && span(likely) > 0 && span(likely) < kMinSpan) --likely;
  return likely;
}

double Extent::span(int step) const {
  double longest = 0;
  for (std::size_t k = 0; k < 3; ++k) longest = std::max(longest, std::ldexp(high[k] - low[k], -step));
  return longest;
}

CommonLattice::CommonLattice(const Extent& shell, const Extent& source) : origin(shell.low) {
  Extent both = shell;
  both.add(source);
  step = both.step();
  while (both.span(step) > 0 && both.span(step) < kMinSpan) --step;
  moved = !(both.span(step) <= kMaxSpan);
  if (moved) {
    // Room for a step of rounding at either side.
    for (step = shell.step(); both.span(step - 1) <= kMaxSpan - 2;) --step;
  }
  span = both.span(step) + (moved ? 2 : 0);
  fits = span <= kMaxSpan;
}

Point CommonLattice::at(const std::array<double, 3>& p) const {
  Point point{};
  for (std::size_t k = 0; k < 3; ++k) point[k] = std::llround(std::ldexp(p[k] - origin[k], -step));
  return point;
}

Extent extent_of(const Shell& shell) {
  Extent extent;
  for (const auto ends : {shell.inner, shell.outer})
    for (const auto& p : ends) extent.add(p);
  return extent;
}

std::string source_fault(const Source& source, Extent& extent) {
  constexpr std::size_t kMost = std::size_t{1} << 30U;
  if (source.triangles.size() > kMost || source.positions.size() > kMost)
    return "the source has more than 2^30 triangles or vertices";
  std::vector<bool> used(source.positions.size());
  for (std::size_t t = 0; t < source.triangles.size(); ++t)
    for (const std::uint32_t v : source.triangles[t]) {
      if (v >= source.positions.size())
        return "source triangle " + std::to_string(t) + " names vertex " + std::to_string(v) + " of " +
               std::to_string(source.positions.size());
      if (used[v]) continue;
      used[v] = true;
      for (const double coordinate : source.positions[v])
        if (!std::isfinite(coordinate))
          return "source vertex " + std::to_string(v) + " has a coordinate that is not a finite number";
      extent.add(source.positions[v]);
    }
  return {};
}

}  // namespace relief::verify::detail
