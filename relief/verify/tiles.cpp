// Whether the tiles of neighbouring slabs say the same along their edges.
#include <relief/verify/shell_facts.h>

#include <algorithm>
#include <bit>
#include <map>
#include <string>
#include <tuple>

namespace relief::verify {

namespace detail {

void for_each_shared_edge(const Shell& shell, const std::function<void(const SharedEdge&)>& told,
                          const std::function<void(const LoneEdge&)>& told_lone) {
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
  const auto same = [&](std::size_t k) {
    return k > 0 && k < sides.size() && sides[k - 1].low == sides[k].low && sides[k - 1].high == sides[k].high;
  };
  for (std::size_t k = 0; k < sides.size(); ++k) {
    const std::uint32_t number = sides[k].number;
    if (same(k))
      told({{sides[k - 1].number / 3, number / 3}, {sides[k - 1].number % 3, number % 3}});
    else if (told_lone && !same(k + 1))
      told_lone({number / 3, number % 3});
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
  TileChecker(const Shell& shell, std::span<const SampleTile> tiles, Between between, const WasRead& was_read,
              const Shell* roots)
      : shell_(shell), tiles_(tiles), between_(between), was_read_(was_read), roots_(roots), failed_(tiles.size()) {}

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
    const auto both = [&](const detail::SharedEdge& edge) {
      along(whole(edge.slab[0], edge.edge[0]), whole(edge.slab[1], edge.edge[1]));
      for (const std::uint32_t slab : edge.slab) done_with(slab);
    };
    if (roots_ == nullptr) return detail::for_each_shared_edge(shell_, both);
    detail::for_each_shared_edge(shell_, both, [&](const detail::LoneEdge& edge) { lone_.push_back(edge); });
    hanging();
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

  /// Samples on an edge of a slab, `length` intervals from `begin` on.
  struct Run {
    std::uint32_t slab, edge;
    int n, begin, length;
    [[nodiscard]] std::size_t sample(int t) const { return detail::sample_on_edge(n, edge, begin + t); }
  };
  [[nodiscard]] Run whole(std::uint32_t slab, std::uint32_t edge) const {
    const int n = tiles_[slab].intervals;
    return {slab, edge, n, 0, n};
  }

  /// The same stretch of a wall, counted by its two sides in opposite directions.
  void along(const Run& first, const Run& second) {
    const std::array<const Run*, 2> runs = {&first, &second};
    const int m = std::min(first.length, second.length), more = std::max(first.length, second.length);
    if (more % m != 0 || !std::has_single_bit(static_cast<unsigned>(more / m)))
      return note(first.slab, kNothing,
                  "slabs " + std::to_string(first.slab) + " and " + std::to_string(second.slab) +
                      " differ in n by a factor that is not a power of two");
    for (int t = 1; t < m; ++t) same(first, t * (first.length / m), second, (m - t) * (second.length / m));
    for (const Run* const run : runs) {
      const int r = run->length / m;
      const std::uint32_t slab = run->slab;
      for (int t = 0; t < run->length; ++t) {
        if (t % r == 0) continue;
        const int k = t % r;
        const float before = tiles_[slab].values[run->sample(t - k)],
                    after = tiles_[slab].values[run->sample(t - k + r)];
        // The products are exact and a power of two divides exactly, so this is rounded once to a double and once more.
        const double linear = (static_cast<double>(before) * (r - k) + static_cast<double>(after) * k) / r;
        const float want = between_ == Between::Linear ? static_cast<float>(linear) : 2 * k <= r ? before : after;
        const std::size_t at = run->sample(t);
        if (bits(slab, at) != std::bit_cast<std::uint32_t>(want))
          note(slab, static_cast<std::uint32_t>(at),
               sample_name(slab, at) + " does not follow from those that a coarser slab shares");
      }
    }
  }

  void same(const Run& first, int t, const Run& second, int u) {
    const std::size_t a = first.sample(t), b = second.sample(u);
    if (bits(first.slab, a) != bits(second.slab, b))
      note(second.slab, static_cast<std::uint32_t>(b),
           sample_name(second.slab, b) + " differs from another slab's copy");
  }

  /// Returns the fibres between which an edge runs.
  [[nodiscard]] std::array<std::uint32_t, 2> ends(const detail::LoneEdge& edge) const {
    const auto fibres = shell_.triangles[edge.slab];
    return {fibres[(edge.edge + 1) % 3], fibres[(edge.edge + 2) % 3]};
  }
  [[nodiscard]] bool is_middle(std::uint32_t m, std::uint32_t p, std::uint32_t q) const {
    for (const auto& places : {shell_.inner, shell_.outer})
      for (std::size_t axis = 0; axis < 3; ++axis)
        if (places[m][axis] != (places[p][axis] + places[q][axis]) * 0.5) return false;
    return true;
  }

  /// Edges that have two lone ones across, each along half of them: they meet at the fibre in the middle.
  void hanging() {
    std::map<std::array<std::uint32_t, 2>, std::size_t> by_ends;
    for (std::size_t k = 0; k < lone_.size(); ++k) by_ends.emplace(ends(lone_[k]), k);
    std::vector<bool> met(lone_.size());
    for (std::size_t k = 0; k < lone_.size(); ++k) {
      const auto [p, q] = ends(lone_[k]);
      for (auto to_middle = by_ends.lower_bound({q, 0}); to_middle != by_ends.end() && to_middle->first[0] == q;
           ++to_middle) {
        const std::uint32_t m = to_middle->first[1];
        const auto from_middle = by_ends.find({m, p});
        if (from_middle == by_ends.end() || !is_middle(m, p, q)) continue;
        met[k] = met[to_middle->second] = met[from_middle->second] = true;
        halves(lone_[k], lone_[from_middle->second], lone_[to_middle->second]);
      }
    }
    bool is_open = false;
    detail::for_each_shared_edge(
        *roots_, [](const detail::SharedEdge&) {}, [&](const detail::LoneEdge&) { is_open = true; });
    for (std::size_t k = 0; k < lone_.size() && !is_open; ++k)
      if (!met[k])
        note(lone_[k].slab, kNothing,
             "nothing lies across edge " + std::to_string(lone_[k].edge) + " of slab " + std::to_string(lone_[k].slab) +
                 ", and the shell is closed");
  }
  void halves(const detail::LoneEdge& edge, const detail::LoneEdge& first, const detail::LoneEdge& second) {
    const int n = tiles_[edge.slab].intervals;
    for (const auto& [half, begin] : {std::pair(first, 0), std::pair(second, n / 2)}) {
      const Run fine = whole(half.slab, half.edge);
      if (n % 2 != 0 || n / 2 > fine.n) {
        note(edge.slab, kNothing,
             "slabs " + std::to_string(edge.slab) + " and " + std::to_string(half.slab) +
                 " do not fit where one is cut and the other is not");
        continue;
      }
      const Run coarse = {edge.slab, edge.edge, n, begin, n / 2};
      along(coarse, fine);
      if (begin == 0)
        same(coarse, n / 2, fine, 0);
      else
        same(coarse, 0, fine, fine.n);
      for (const std::uint32_t slab : {edge.slab, half.slab}) done_with(slab);
    }
  }

  const Shell& shell_;
  std::span<const SampleTile> tiles_;
  Between between_;
  const WasRead& was_read_;
  const Shell* roots_;  // null: no edge hangs
  std::vector<detail::LoneEdge> lone_;
  std::vector<bool> failed_;  // by slab
  TileCheck check_;
};

}  // namespace

TileCheck check_tiles(const Shell& shell, std::span<const SampleTile> tiles, Between between, const WasRead& was_read) {
  return TileChecker(shell, tiles, between, was_read, nullptr).run();
}

TileCheck check_tiles(const Shell& roots, const Shell& pieces, std::span<const SampleTile> tiles, Between between,
                      const WasRead& was_read) {
  return TileChecker(pieces, tiles, between, was_read, &roots).run();
}

}  // namespace relief::verify
