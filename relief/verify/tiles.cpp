// Whether the tiles of neighbouring slabs say the same along their edges.
#include <relief/verify/shell_facts.h>

#include <algorithm>
#include <bit>
#include <string>
#include <tuple>

namespace relief::verify {

namespace detail {

void for_each_shared_edge(const Shell& shell, const std::function<void(const SharedEdge&)>& told) {
  struct Side {
    std::uint32_t low, high, number;  // three times the slab, and the edge
  };
  std::vector<Side> sides;
  sides.reserve(3 * shell.triangles.size());
  for (std::uint32_t t = 0; t < shell.triangles.size(); ++t) {
    const auto fibres = shell.triangles[t];
    for (std::uint32_t k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(fibres[(k + 1) % 3], fibres[(k + 2) % 3]);
      sides.push_back({low, high, 3 * t + k});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return std::tie(a.low, a.high, a.number) < std::tie(b.low, b.high, b.number);
  });
  for (std::size_t k = 1; k < sides.size(); ++k) {
    const Side &a = sides[k - 1], &b = sides[k];
    if (a.low == b.low && a.high == b.high) told({{a.number / 3, b.number / 3}, {a.number % 3, b.number % 3}});
  }
}

std::size_t sample_on_edge(int n, std::uint32_t edge, int t) {
  // Edge k runs from corner k+1 to corner k+2.
  const int towards_1 = edge == 0 ? n - t : edge == 1 ? 0 : t;
  const int towards_2 = edge == 0 ? t : edge == 1 ? n - t : 0;
  std::size_t at = 0;
  for (int row = 0; row < towards_2; ++row) at += static_cast<std::size_t>(n - row) + 1;
  return at + static_cast<std::size_t>(towards_1);
}

}  // namespace detail

namespace {

class TileChecker {
 public:
  TileChecker(const Shell& shell, std::span<const SampleTile> tiles, Between between, const WasRead& was_read)
      : shell_(shell), tiles_(tiles), between_(between), was_read_(was_read), failed_(tiles.size()) {}

  TileCheck run() {
    check_all();
    for (std::uint32_t s = 0; s < failed_.size(); ++s)
      if (failed_[s]) check_.slabs.push_back(s);
    return std::move(check_);
  }

 private:
  void check_all() {
    if (tiles_.size() != shell_.triangles.size()) {
      return note(kNothing, kNothing,
                  "there are tiles for " + std::to_string(tiles_.size()) + " slabs, not " +
                      std::to_string(shell_.triangles.size()));
    }
    for (std::uint32_t s = 0; s < tiles_.size(); ++s) {
      sizes_and_ranges(s);
      done_with(s);
    }
    if (check_.failure_count > 0) return;
    corners();
    detail::for_each_shared_edge(shell_, [&](const detail::SharedEdge& edge) {
      along(edge);
      for (const std::uint32_t slab : edge.slab) done_with(slab);
    });
  }
  void done_with(std::uint32_t slab) const {
    if (was_read_) was_read_(slab);
  }
  void note(std::uint32_t slab, std::uint32_t sample, std::string what) {
    if (slab != kNothing) failed_[slab] = true;
    if (check_.failure_count++ < 100) check_.failures.push_back({slab, sample, std::move(what)});
  }
  [[nodiscard]] std::uint32_t bits(std::uint32_t slab, std::size_t sample) const {
    return std::bit_cast<std::uint32_t>(tiles_[slab].values[sample]);
  }
  static std::string sample_name(std::uint32_t slab, std::size_t sample) {
    return "sample " + std::to_string(sample) + " of slab " + std::to_string(slab);
  }

  void sizes_and_ranges(std::uint32_t s) {
    const auto n = static_cast<std::size_t>(std::max(tiles_[s].intervals, 0));
    if (n == 0 || n > 128 || tiles_[s].values.size() != (n + 1) * (n + 2) / 2)
      return note(s, kNothing, "the tile of slab " + std::to_string(s) + " has the wrong size");
    for (std::uint32_t k = 0; k < tiles_[s].values.size(); ++k)
      if (!(tiles_[s].values[k] >= 0.0F && tiles_[s].values[k] <= 1.0F))
        note(s, k, sample_name(s, k) + " is not in 0..1");
  }

  /// All slabs of a fibre hold the same bits there.
  void corners() {
    std::vector<std::uint32_t> first(shell_.inner.size(), kNothing);
    for (std::uint32_t s = 0; s < tiles_.size(); ++s) {
      for (std::uint32_t k = 0; k < 3; ++k) {
        const std::size_t sample = detail::sample_on_edge(tiles_[s].intervals, (k + 2) % 3, 0);
        const std::uint32_t fibre = shell_.triangles[s][k];
        if (first[fibre] == kNothing) first[fibre] = bits(s, sample);
        if (first[fibre] != bits(s, sample))
          note(s, static_cast<std::uint32_t>(sample), sample_name(s, sample) + " differs from another slab's copy");
      }
      done_with(s);
    }
  }

  void along(const detail::SharedEdge& edge) {
    const std::array<int, 2> n = {tiles_[edge.slab[0]].intervals, tiles_[edge.slab[1]].intervals};
    const int m = std::min(n[0], n[1]), more = std::max(n[0], n[1]);
    if (more % m != 0 || !std::has_single_bit(static_cast<unsigned>(more / m)))
      return note(edge.slab[0], kNothing,
                  "slabs " + std::to_string(edge.slab[0]) + " and " + std::to_string(edge.slab[1]) +
                      " differ in n by what is no power of two");
    const auto sample = [&](std::size_t side, int t) { return detail::sample_on_edge(n[side], edge.edge[side], t); };
    for (int t = 1; t < m; ++t) {
      const std::size_t a = sample(0, t * (n[0] / m)), b = sample(1, (m - t) * (n[1] / m));
      if (bits(edge.slab[0], a) != bits(edge.slab[1], b))
        note(edge.slab[1], static_cast<std::uint32_t>(b),
             sample_name(edge.slab[1], b) + " differs from another slab's copy");
    }
    for (std::size_t side = 0; side < 2; ++side) {
      const int r = n[side] / m;
      const std::uint32_t slab = edge.slab[side];
      for (int t = 0; t < n[side]; ++t) {
        if (t % r == 0) continue;
        const int k = t % r;
        const float before = tiles_[slab].values[sample(side, t - k)],
                    after = tiles_[slab].values[sample(side, t - k + r)];
        // The products are exact and a power of two divides exactly, so this is rounded once to a double and once more.
        const double linear = (static_cast<double>(before) * (r - k) + static_cast<double>(after) * k) / r;
        const float want = between_ == Between::Linear ? static_cast<float>(linear) : 2 * k <= r ? before : after;
        const std::size_t at = sample(side, t);
        if (bits(slab, at) != std::bit_cast<std::uint32_t>(want))
          note(slab, static_cast<std::uint32_t>(at),
               sample_name(slab, at) + " does not follow from those that a coarser slab shares");
      }
    }
  }

  const Shell& shell_;
  std::span<const SampleTile> tiles_;
  Between between_;
  const WasRead& was_read_;
  std::vector<bool> failed_;  // by slab
  TileCheck check_;
};

}  // namespace

TileCheck check_tiles(const Shell& shell, std::span<const SampleTile> tiles, Between between, const WasRead& was_read) {
  return TileChecker(shell, tiles, between, was_read).run();
}

}  // namespace relief::verify
