#include <relief/base/disjoint_sets.h>
#include <relief/convert/shell/crease_levels.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

namespace relief::detail {
namespace {

/// Share of a fibre: levels that differ by less put a wall no farther off a crease than rounding does.
constexpr double kLevel = 1e-6;
/// Of what a fibre has below the surface and above it, the least that it keeps for the sake of a sharp edge: cuts go
/// deeper than deposits are high.
constexpr double kKeptBelow = 0.5, kKeptAbove = 0.2;
constexpr int kMostLevels = 4;  // that are tried after the first
constexpr int kPasses = 4;      // what failed may go once its neighbours have moved

/// Fibres that creases join, and how far out they are crossed, as a share of their length.
class Levels {
 public:
  Levels(ShellPatch& patch, const Creases& creases) : patch_(patch), sets_(patch.draft().out.size()) {
    const LinkedDraft& draft = patch.draft();
    std::vector<std::uint8_t> is_on(draft.out.size(), 0);
    for (std::uint32_t v = 0; v < is_on.size(); ++v) is_on[v] = draft.out[v] != kNone && creases.hold(draft.at[v]);
    for (std::uint32_t h = 0; h < draft.twins.size(); ++h) {
      if (!draft.alive(h / 3) || draft.twins[h] == kNone || h > draft.twins[h]) continue;
      const std::uint32_t u = draft.origin(h), v = draft.target(h);
      if (is_on[u] == 0 || is_on[v] == 0 || !creases.hold_edge(draft.at[u], draft.at[v])) continue;
      ++edges_;
      sets_.join(u, v);
      on_edge_.push_back(u);
      on_edge_.push_back(v);
    }
    std::ranges::sort(on_edge_);
    on_edge_.erase(std::ranges::unique(on_edge_).begin(), on_edge_.end());
    std::ranges::stable_sort(on_edge_, {}, [&](std::uint32_t v) { return sets_.least(v); });
  }

  [[nodiscard]] std::size_t edges() const noexcept { return edges_; }

  void settle(const Progress& progress) {
    for (auto begin = on_edge_.begin(); begin != on_edge_.end();) {
      if (progress.cancelled()) return;
      const auto end =
          std::find_if(begin, on_edge_.end(), [&](std::uint32_t v) { return sets_.least(v) != sets_.least(*begin); });
      level_out(std::span<const std::uint32_t>(begin, end));
      begin = end;
    }
  }

 private:
  [[nodiscard]] double level(std::uint32_t v) const noexcept {
    const ShellPatch::Reach reach = patch_.reach(v);
    return reach[kInner] / (reach[kInner] + reach[kOuter]);
  }

  /// First the level in the middle, which most fibres are near. What cannot go there sets the next one: others may
  /// mostly follow it.
  void level_out(std::span<const std::uint32_t> fibres) {
    std::vector<double> levels;
    std::vector<ShellPatch::Reach> first;
    for (const std::uint32_t v : fibres) {
      levels.push_back(level(v));
      first.push_back(patch_.reach(v));
    }
    const auto middle = levels.begin() + static_cast<std::ptrdiff_t>(levels.size() / 2);
    std::ranges::nth_element(levels, middle);
    double wanted = *middle;
    Outcome best = bring_to(fibres, first, wanted);
    for (int next = 0; next < kMostLevels && best.left > 0; ++next) {
      const double other = level(best.last);
      const Outcome outcome = bring_to(fibres, first, other);
      if (outcome.left >= best.left) {
        bring_to(fibres, first, wanted);
        break;
      }
      best = outcome;
      wanted = other;
    }
  }

  struct Outcome {
    std::size_t left = 0;    // fibres that could not be brought to a level
    std::uint32_t last = 0;  // one of them
  };
  /// `first`: what each of them reached before any level was tried, of which it keeps its shares.
  Outcome bring_to(std::span<const std::uint32_t> fibres, std::span<const ShellPatch::Reach> first, double wanted) {
    FibreMoves moves = patch_.moves();
    Outcome outcome;
    for (int pass = 0; pass < kPasses; ++pass) {
      outcome = {};
      std::size_t moved = 0;
      for (std::size_t k = 0; k < fibres.size(); ++k) {
        const std::uint32_t v = fibres[k];
        if (std::abs(level(v) - wanted) <= kLevel || !patch_.draft().can_move(v)) continue;
        const ShellPatch::Reach before = first[k];
        const double whole = before[kInner] + before[kOuter];
        // As long as it is, else shorter on the side that has too much.
        const double shorter = std::min(before[kInner] / wanted, before[kOuter] / (1 - wanted));
        const auto comes_to = [&](double length) {
          const ShellPatch::Reach reach = {wanted * length, (1 - wanted) * length};
          return reach[kInner] >= kKeptBelow * before[kInner] && reach[kOuter] >= kKeptAbove * before[kOuter] &&
                 moves.reach_to(v, reach);
        };
        if (comes_to(whole) || comes_to(shorter)) {
          ++moved;
        } else {
          ++outcome.left;
          outcome.last = v;
        }
      }
      if (outcome.left == 0 || moved == 0) break;
    }
    return outcome;
  }

  ShellPatch& patch_;
  DisjointSets sets_;
  std::vector<std::uint32_t> on_edge_;  // fibres, those of a set together
  std::size_t edges_ = 0;
};

}  // namespace

std::size_t level_creases(ShellPatch& patch, const Creases& creases, const BoxTree& tree, const Progress& progress) {
  patch.place_on_source(tree);
  Levels levels(patch, creases);
  levels.settle(progress);
  return levels.edges();
}

}  // namespace relief::detail
