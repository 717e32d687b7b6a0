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
constexpr double kShorter = 0.85;  // of a fibre's length, from one try to the next
constexpr double kApart = 0.05;    // of a fibre, between the levels that are tried after the first
constexpr int kMostVain = 4;       // levels in a row that leave no fewer fibres off
constexpr int kPasses = 2;         // what failed may go once its neighbours have moved

/// Fibres that creases join, and how far out they are crossed, as a share of their length.
class Levels {
 public:
  Levels(ShellPatch& patch, const Creases& creases, const Progress& progress)
      : patch_(patch), progress_(progress), sets_(patch.draft().out.size()) {
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

  void settle() {
    for (auto begin = on_edge_.begin(); begin != on_edge_.end();) {
      if (progress_.cancelled()) return;
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

  /// Brings fibres to one level as they stand; where some are left off it, all may turn, if that leaves fewer.
  void level_out(std::span<const std::uint32_t> fibres) {
    std::vector<double> levels;
    std::vector<ShellPatch::Reach> first;
    for (const std::uint32_t v : fibres) {
      levels.push_back(level(v));
      first.push_back(patch_.reach(v));
    }
    const auto middle = levels.begin() + static_cast<std::ptrdiff_t>(levels.size() / 2);
    std::ranges::nth_element(levels, middle);
    const Found standing = find_level(fibres, first, false, *middle);
    if (standing.left > 0) {
      undo();
      if (find_level(fibres, first, true, *middle).left >= standing.left) {
        undo();
        bring_to(fibres, first, false, standing.level);
      }
    }
    changes_.clear();
  }

  struct Found {
    double level = 0;
    std::size_t left = 0;  // fibres that are not at it
  };
  /// Tries a level, then others around it, and brings the fibres to the one that leaves fewest off it.
  Found find_level(std::span<const std::uint32_t> fibres, std::span<const ShellPatch::Reach> first, bool may_turn,
                   double about) {
    double latest = about;
    Found best = {about, bring_to(fibres, first, may_turn, about)};
    for (int k = 0, vain = 0; vain < kMostVain && best.left > 0; ++k) {
      ++vain;
      const double next = about + (k % 2 == 0 ? kApart : -kApart) * (k / 2 + 1);
      if (next < kApart || next > 1 - kApart) continue;
      latest = next;
      const std::size_t left = bring_to(fibres, first, may_turn, latest);
      if (left >= best.left) continue;
      best = {latest, left};
      vain = 0;
    }
    if (latest != best.level) best.left = bring_to(fibres, first, may_turn, best.level);
    return best;
  }

  /// Returns how many could not be brought to a level. `first`: what each of them reached before any level was tried,
  /// of which it keeps its shares.
  std::size_t bring_to(std::span<const std::uint32_t> fibres, std::span<const ShellPatch::Reach> first, bool may_turn,
                       double wanted) {
    std::size_t left = 0;
    for (int pass = 0; pass < kPasses && !progress_.cancelled(); ++pass) {
      left = 0;
      std::size_t moved = 0;
      for (std::size_t k = 0; k < fibres.size(); ++k) {
        const std::uint32_t v = fibres[k];
        if (std::abs(level(v) - wanted) <= kLevel || !patch_.draft().can_move(v)) continue;
        if (bring(v, first[k], wanted) || (may_turn && settle_around(v) && bring(v, first[k], wanted))) {
          ++moved;
        } else {
          ++left;
        }
      }
      if (left == 0 || moved == 0) break;
    }
    return left;
  }

  /// Notes where a fibre is, for undo().
  void note(std::uint32_t v) { changes_.push_back({v, patch_.draft().at[v], patch_.draft().ends[v]}); }
  /// Takes all changes back, the latest first: each leads to what passed all checks before.
  void undo() {
    FibreMoves moves = patch_.moves();
    for (; !changes_.empty(); changes_.pop_back()) {
      const Change& was = changes_.back();
      if (patch_.draft().ends[was.fibre] != was.ends) moves.put(was.fibre, was.at, was.ends);
    }
  }

  /// Brings a fibre to a level, as long as it was or as little shorter as the checks allow. `before`: see bring_to().
  bool bring(std::uint32_t v, const ShellPatch::Reach& before, double wanted) {
    FibreMoves moves = patch_.moves();
    note(v);
    const double whole = before[kInner] + before[kOuter];
    const double least = std::max(kKeptBelow * before[kInner] / wanted, kKeptAbove * before[kOuter] / (1 - wanted));
    for (double length = whole; length >= least; length *= kShorter)
      if (moves.reach_to(v, {wanted * length, (1 - wanted) * length})) return true;
    return false;
  }

  /// Turns a fibre and those around it to where they see their stars best: mostly what keeps an end from moving is that
  /// a fibre would no longer face its triangles (C1). False when none turned.
  bool settle_around(std::uint32_t v) {
    const LinkedDraft& draft = patch_.draft();
    FibreMoves moves = patch_.moves();
    std::vector<std::uint32_t> around = {v};
    draft.for_ring(v, [&](std::uint32_t h) { around.push_back(draft.target(h)); });
    const std::uint32_t clock = draft.clock;
    for (const std::uint32_t w : around)
      if (draft.can_move(w)) {
        note(w);
        moves.settle(w);
      }
    return draft.clock != clock;
  }

  struct Change {
    std::uint32_t fibre;
    Vec3d at;
    Ends ends;
  };

  ShellPatch& patch_;
  const Progress& progress_;
  std::vector<Change> changes_;  // what undo() takes back
  DisjointSets sets_;
  std::vector<std::uint32_t> on_edge_;  // fibres, those of a set together
  std::size_t edges_ = 0;
};

}  // namespace

std::size_t level_creases(ShellPatch& patch, const Creases& creases, const BoxTree& tree, const Progress& progress) {
  patch.place_on_source(tree);
  Levels levels(patch, creases, progress);
  levels.settle();
  return levels.edges();
}

}  // namespace relief::detail
