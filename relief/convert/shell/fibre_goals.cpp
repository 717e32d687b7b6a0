#include <relief/convert/shell/fibre_goals.h>

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

namespace relief::detail {
namespace {

using Reach = ShellPatch::Reach;

// Shares of the longest fibre, by default 0.2 of the diagonal.
constexpr double kBelow = 0.4;  // wanted below the surface: 0.08 of the diagonal, a deep eye socket
constexpr double kAbove = 0.3;  // wanted above it: 0.06, for deposits are lower than cuts are deep
constexpr double kMost = 0.7;   // what one side may take where the other has no room
/// Of the body's thickness along the fibre: as much is left for the other side, and a core between the two.
constexpr double kOfThickness = 0.45;
/// Of what is wanted below: a fibre that has less is turned and moved.
constexpr double kShort = 0.95;
constexpr int kRounds = 3;  // of turning and moving; the fourth gains next to nothing

/// Returns how far fibres are to reach on each side; in thin places less below.
std::vector<Reach> wanted_reach(const ShellPatch& patch, const BoxTree& tree, double below, double above) {
  const LinkedDraft& draft = patch.draft();
  std::vector<Reach> wanted(draft.out.size());
  for (std::uint32_t v = 0; v < wanted.size(); ++v) {
    if (!draft.can_move(v)) continue;
    const double thickness =
        depth_below(draft.at[v], -normalized(draft.fibre(v)), below / kOfThickness, patch.source(), tree);
    wanted[v] = {std::min(below, kOfThickness * thickness), above};
  }
  return wanted;
}

/// Returns the free fibres that fall short of what is wanted below, and those around them, ascending.
std::vector<std::uint32_t> short_ones(const ShellPatch& patch, std::span<const Reach> wanted) {
  const LinkedDraft& draft = patch.draft();
  std::vector<std::uint32_t> found;
  for (std::uint32_t v = 0; v < wanted.size(); ++v) {
    if (!draft.can_move(v)) continue;
    if (patch.reach(v)[kInner] >= kShort * wanted[v][kInner]) continue;
    found.push_back(v);
    draft.for_ring(v, [&](std::uint32_t h) {
      if (draft.can_move(draft.target(h))) found.push_back(draft.target(h));
    });
  }
  std::ranges::sort(found);
  found.erase(std::ranges::unique(found).begin(), found.end());
  return found;
}

}  // namespace

bool lengthen_to_goals(ShellPatch& patch, const Progress& progress) {
  const BoxTree tree = tree_of(patch.source());
  const double longest = patch.longest();
  patch.place_on_source(tree);
  std::vector<Reach> goals;
  ShellPatch::FailedSteps failed;
  std::vector<std::uint32_t> in_vain(patch.draft().out.size(), 0);  // by fibre: the clock when no turn or move was left
  for (int round = 0;; ++round) {
    goals = wanted_reach(patch, tree, kBelow * longest, kAbove * longest);
    if (!patch.lengthen(goals, failed, progress)) return false;
    const std::vector<std::uint32_t> crowded = short_ones(patch, goals);
    if (round == kRounds || crowded.empty()) break;
    FibreMoves moves = patch.moves();
    const std::uint32_t before = patch.draft().clock;
    for (const std::uint32_t v : crowded) {
      if (progress.cancelled()) return false;
      if (patch.draft().changed[v] <= in_vain[v]) continue;
      const std::uint32_t now = patch.draft().clock;
      moves.re_aim(v);
      moves.settle(v);
      if (patch.draft().clock == now) in_vain[v] = now;
    }
    if (patch.draft().clock == before) break;
    patch.place_on_source(tree);
  }
  std::vector<Reach> rest = wanted_reach(patch, tree, kMost * longest, kMost * longest);
  for (std::uint32_t v = 0; v < rest.size(); ++v)
    for (const Side side : {kInner, kOuter})
      if (patch.reach(v)[side] < kShort * goals[v][side]) rest[v][side] = 0;  // it would fail again
  failed.clear();
  return patch.lengthen(rest, failed, progress);
}

}  // namespace relief::detail
