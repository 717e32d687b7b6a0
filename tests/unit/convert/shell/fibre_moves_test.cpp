#include <relief/convert/shell/fibre_direction.h>
#include <relief/convert/shell/fibre_moves.h>

#include <gtest/gtest.h>
#include <unit/convert/shell/shell_support.h>

#include <algorithm>
#include <functional>
#include <vector>

namespace relief::detail {
namespace {

std::vector<TriangleMesh> models() { return {testing::ball(24, 0.1), testing::torus(30, 18), noisy_field(16, 0.03)}; }

/// Makes a move of every fibre of coarse shells, and has the verifier judge all that came of them. Returns how many
/// fibres have changed.
std::size_t expect_valid(const std::function<void(FibreMoves&, std::uint32_t)>& move) {
  std::size_t changed = 0;
  for (const TriangleMesh& mesh : models()) {
    const ThinShell thin(mesh);
    ShellPatch patch = coarse_patch(thin, 80);
    const std::vector<Ends> before = patch.draft().ends;
    FibreMoves moves = patch.moves();
    for (std::uint32_t v = 0; v < patch.draft().out.size(); ++v) move(moves, v);
    for (std::size_t v = 0; v < before.size(); ++v) {
      changed += patch.draft().ends[v] != before[v];
      EXPECT_LE(length(patch.draft().fibre(static_cast<std::uint32_t>(v))), thin.longest);
    }
    expect_certified(patch.draft(), thin.source);
  }
  return changed;
}

TEST(FibreMoves, KeepAllConditions) {
  EXPECT_GT(expect_valid([](FibreMoves& m, std::uint32_t v) { m.re_aim(v); }), 20U);
  EXPECT_GT(expect_valid([](FibreMoves& m, std::uint32_t v) { m.improve(v); }), 50U);
  EXPECT_GT(expect_valid([](FibreMoves& m, std::uint32_t v) { m.settle(v); }), 20U);
  EXPECT_GT(expect_valid([](FibreMoves& m, std::uint32_t v) { m.even_out(v); }), 20U);
  EXPECT_GT(expect_valid([](FibreMoves& m, std::uint32_t v) { m.lengthen(v, 0.5); }), 50U);
  EXPECT_GT(expect_valid([](FibreMoves& m, std::uint32_t v) { m.extend(v, kOuter, 20000, 20000); }), 20U);
}

/// The visibility of a fibre over the source in its star.
double source_visibility(const ThinShell& thin, const LinkedDraft& draft, std::uint32_t v) {
  std::vector<TriangleReference> held;
  draft.for_ring(v, [&](std::uint32_t h) {
    const auto list = draft.lists.of(h / 3);
    held.insert(held.end(), list.begin(), list.end());
  });
  return view_of_source(thin.source, held).visibility(normalized(draft.fibre(v)));
}

TEST(FibreMoves, ReAimSeesTheSourceBetter) {
  for (const TriangleMesh& mesh : models()) {
    const ThinShell thin(mesh);
    ShellPatch patch = coarse_patch(thin, 80);
    FibreMoves moves = patch.moves();
    int turned = 0;
    for (std::uint32_t v = 0; v < patch.draft().out.size(); ++v) {
      const double before = source_visibility(thin, patch.draft(), v);
      const Vec3d at = patch.draft().at[v];
      const double size = length(patch.draft().fibre(v));
      if (!moves.re_aim(v)) continue;
      ++turned;
      EXPECT_EQ(patch.draft().at[v], at);
      EXPECT_NEAR(length(patch.draft().fibre(v)), size, 4);
      // The set of triangles in the star changes a little with the fibre.
      EXPECT_GT(source_visibility(thin, patch.draft(), v), before - 0.05);
    }
    EXPECT_GT(turned, 0);
  }
}

TEST(FibreMoves, SettleSeesTheStarBetter) {
  const ThinShell thin(testing::ball(24, 0.1));
  ShellPatch patch = coarse_patch(thin, 80);
  const auto visibility = [&](std::uint32_t v) {
    Star star;
    star.set_fibre(patch.draft(), v);
    double least = 1;
    for (const LinkEdge& e : star.link(patch.draft()))
      least = std::min(least, dot(normalized(cross(e.from - patch.draft().at[v], e.to - patch.draft().at[v])),
                                  normalized(patch.draft().fibre(v))));
    return least;
  };
  FibreMoves moves = patch.moves();
  int moved = 0, better = 0;
  for (std::uint32_t v = 0; v < patch.draft().out.size(); ++v) {
    const double before = visibility(v);
    const Ends ends = patch.draft().ends[v];
    moves.settle(v);
    if (patch.draft().ends[v] == ends) continue;
    ++moved;
    better += visibility(v) > before;
  }
  EXPECT_GT(moved, 20);
  EXPECT_GE(better, 0.9 * moved);
}

TEST(FibreMoves, LengthenGoesToTheLongestAndNoFurther) {
  const ThinShell thin(testing::ball(24));
  ShellPatch patch = coarse_patch(thin, 80);
  FibreMoves moves = patch.moves();
  for (int pass = 0; pass < 30; ++pass)
    for (std::uint32_t v = 0; v < patch.draft().out.size(); ++v) {
      const double before = length(patch.draft().fibre(v));
      moves.lengthen(v, 0.5);
      EXPECT_GE(length(patch.draft().fibre(v)), before);
    }
  int longest = 0;
  for (std::uint32_t v = 0; v < patch.draft().out.size(); ++v)
    longest += length(patch.draft().fibre(v)) > 0.9 * thin.longest;
  EXPECT_GT(2 * longest, static_cast<int>(patch.draft().out.size()));
}

TEST(FibreMoves, ExtendMovesOneEndAlongTheFibre) {
  const ThinShell thin(testing::ball(24));
  ShellPatch patch = coarse_patch(thin, 80);
  FibreMoves moves = patch.moves();
  int extended = 0;
  for (std::uint32_t v = 0; v < patch.draft().out.size(); ++v)
    for (const Side side : {kInner, kOuter}) {
      const Ends before = patch.draft().ends[v];
      const Vec3d d = normalized(patch.draft().fibre(v));
      EXPECT_FALSE(moves.extend(v, side, 2 * thin.longest, 2 * thin.longest)) << "longer than the longest";
      EXPECT_EQ(patch.draft().ends[v], before);
      if (!moves.extend(v, side, 5000, 5000)) continue;
      ++extended;
      const Ends after = patch.draft().ends[v];
      EXPECT_EQ(after[1 - side], before[1 - side]);
      const Vec3d by = to_double(after[side] - before[side]);
      EXPECT_LT(length(by - d * (side == kOuter ? 5000.0 : -5000.0)), 1);
    }
  EXPECT_GT(extended, 50);
}

// The lattice ends somewhere: an end that had to stay on it would bend its fibre, or shorten it in silence.
TEST(FibreMoves, ReachEitherAsFarAsWantedOrNotAtAll) {
  const ThinShell thin(testing::ball(24));
  ShellPatch patch = thin.patch();
  patch.allow(4 * Lattice::kSpan);
  FibreMoves moves = patch.moves();
  int reached = 0, refused = 0;
  for (std::uint32_t v = 0; v < patch.draft().out.size(); ++v) {
    const double inner = patch.reach(v)[kInner];
    for (const double outer : {0.01 * Lattice::kSpan, 0.6 * Lattice::kSpan}) {
      const Ends before = patch.draft().ends[v];
      const Vec3d d = normalized(patch.draft().fibre(v));
      if (!moves.reach_to(v, {inner, outer})) {
        ++refused;
        EXPECT_EQ(patch.draft().ends[v], before);
        continue;
      }
      ++reached;
      EXPECT_NEAR(patch.reach(v)[kOuter], outer, 1);
      EXPECT_GT(dot(normalized(patch.draft().fibre(v)), d), 1 - 1e-9) << "the fibre is bent";
    }
  }
  EXPECT_GT(reached, 0);
  EXPECT_GT(refused, 0);
}

TEST(FibreMoves, ExtendTakesSmallerStepsWhereLargeOnesFail) {
  const ThinShell thin(testing::ball(24));
  ShellPatch patch = coarse_patch(thin, 80);
  FibreMoves moves = patch.moves();
  int halved = 0;
  for (std::uint32_t v = 0; v < patch.draft().out.size(); ++v) {
    const Ends before = patch.draft().ends[v];
    const double room = thin.longest - length(patch.draft().fibre(v)), steps = 3 * room;
    EXPECT_FALSE(moves.extend(v, kOuter, steps, steps));
    EXPECT_EQ(patch.draft().ends[v], before);
    if (!moves.extend(v, kOuter, steps, 1)) continue;
    const double by = length(to_double(patch.draft().ends[v][kOuter] - before[kOuter]));
    EXPECT_LT(std::min(std::abs(by - steps / 4), std::abs(by - steps / 8)), 2);
    ++halved;
  }
  EXPECT_GT(halved, 20);
}

}  // namespace
}  // namespace relief::detail
