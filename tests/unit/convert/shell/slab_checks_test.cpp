#include <relief/convert/shell/slab_checks.h>

#include <gtest/gtest.h>
#include <unit/convert/shell/shell_support.h>

#include <algorithm>
#include <map>
#include <random>
#include <vector>

namespace relief::detail {
namespace {

using verify::Condition;

/// Fibres moved at random, by little and by much, each judged by the local checks and by the verifier of the whole
/// shell.
struct Trials {
  std::map<Fault, int> all, agreed;  // agreed: the verifier finds a fault of the same kind
};
void run_trials(const TriangleMesh& mesh, std::size_t slabs, int count, Trials& trials) {
  const ThinShell thin(mesh);
  LinkedDraft draft(coarse(thin, slabs));
  expect_certified(draft, thin.source);
  SlabChecks checks(thin.source, everywhere());
  checks.build_boxes(draft);
  std::mt19937 random(4);
  std::uniform_real_distribution<double> some(-1, 1);
  for (int trial = 0; trial < count; ++trial) {
    const auto v = static_cast<std::uint32_t>(random() % draft.out.size());
    const double reach = length(draft.fibre(v)) * std::array{0.1, 0.5, 1.0, 2.0}[random() % 4];
    Ends ends = draft.ends[v];
    for (const Side side : {kInner, kOuter})
      if (random() % 3 != 0)
        ends[side] = snap(to_double(ends[side]) + Vec3d{some(random), some(random), some(random)} * reach);
    checks.begin().set_fibre(draft, v);
    const Fault fault = checks.check(draft, ends);
    ++trials.all[fault];
    ShellDraft moved = draft;
    moved.ends[v] = ends;
    const verify::Certificate c = judge(moved, thin.source);
    const auto fails = [&](Condition condition) { return !c.holds[static_cast<std::size_t>(condition)]; };
    switch (fault) {
      case Fault::None:
        EXPECT_TRUE(c.all()) << c.failures.front().what;
        ++trials.agreed[fault];
        break;
      case Fault::Winding:
        trials.agreed[fault] += fails(Condition::C2) || fails(Condition::C1);
        break;
      case Fault::Jacobian:
        trials.agreed[fault] += fails(Condition::C1);
        break;
      case Fault::OuterOverlap:
      case Fault::InnerOverlap:
        trials.agreed[fault] += fails(Condition::C3) || fails(Condition::C4);
        break;
      case Fault::Outer:
      case Fault::Inner:
        trials.agreed[fault] += fails(Condition::C5);
        break;
      case Fault::Folded:
        trials.agreed[fault] += fails(Condition::C6);
        break;
      case Fault::Empty:
      case Fault::Outside:
      case Fault::Lost:
        break;
    }
  }
}

TEST(SlabChecks, PassOnlyWhatTheVerifierOfTheWholeShellPasses) {
  Trials trials;
  run_trials(testing::ball(24, 0.1), 80, 300, trials);
  run_trials(testing::torus(30, 18), 80, 300, trials);
  run_trials(noisy_field(16, 0.05), 60, 600, trials);
  run_trials(noisy_field(16, 0.01, 0.05), 60, 300, trials);  // inner triangles back to back
  TriangleMesh pair = testing::ball(20);
  testing::append(pair, testing::ball(20), {2.2, 0, 0});
  run_trials(pair, 60, 300, trials);
  for (const Fault exact : {Fault::Winding, Fault::Jacobian, Fault::OuterOverlap, Fault::InnerOverlap}) {
    EXPECT_EQ(trials.agreed[exact], trials.all[exact]) << static_cast<int>(exact);
    EXPECT_GT(trials.all[exact], 0) << static_cast<int>(exact);
  }
  EXPECT_GT(trials.all[Fault::None], 100);
  // These err on the safe side, but seldom.
  for (const Fault safe : {Fault::Outer, Fault::Inner, Fault::Folded}) {
    EXPECT_GT(trials.all[safe], 5) << static_cast<int>(safe);
    EXPECT_GE(trials.agreed[safe], 0.9 * trials.all[safe]) << static_cast<int>(safe);
  }
}

TEST(SlabChecks, PassesAsTheCheckOfAChangeByItselfDoes) {
  // Out of a groove long fibres meet slabs of its other bank, which are asked first from then on.
  const ThinShell thin(testing::grooved_torus(), 0.5);
  const LinkedDraft draft = thin.patch().draft();
  SlabChecks in_turn(thin.source, everywhere()), by_itself(thin.source, everywhere());
  in_turn.build_boxes(draft);
  by_itself.build_boxes(draft);
  int met_another = 0, passed_after = 0;
  for (std::uint32_t v = 0; v < draft.out.size(); ++v) {
    in_turn.begin().set_fibre(draft, v);
    bool has_met = false;
    for (const double share : {8.0, 4.0, 2.0, 1.0, 6.0, 0.5}) {
      Ends ends = draft.ends[v];
      ends[kOuter] = snap(to_double(ends[kOuter]) + draft.fibre(v) * share);
      by_itself.begin().set_fibre(draft, v);
      const Fault fault = by_itself.check(draft, ends);
      EXPECT_EQ(in_turn.passes(draft, ends), fault == Fault::None) << "fibre " << v << ", " << share;
      passed_after += has_met && fault == Fault::None;
      has_met = has_met || fault == Fault::OuterOverlap;
      met_another += fault == Fault::OuterOverlap;
    }
  }
  EXPECT_GT(met_another, 100);
  EXPECT_GT(passed_after, 100);
}

TEST(SlabChecks, SeeOtherSlabsOfTheSameSideAndOfTheOther) {
  // A thin plate: its two skins are near each other, and their inner triangles back to back.
  const ThinShell thin(testing::box({1, 1, 0.02}), 0.3);
  LinkedDraft draft = thin.patch().draft();
  SlabChecks checks(thin.source, everywhere());
  checks.build_boxes(draft);
  for (std::uint32_t v = 0; v < draft.out.size(); ++v) {
    checks.begin().set_fibre(draft, v);
    EXPECT_EQ(checks.check(draft, draft.ends[v]), Fault::None);
    Ends ends = draft.ends[v];
    // Through the plate and out at the other side.
    const double across = draft.at[v].z < 0.5 * Lattice::kSpan ? 1 : -1;
    ends[kInner] = snap(draft.at[v] + Vec3d{0, 0, across * thin.mesh.steps(0.05)});
    EXPECT_NE(checks.check(draft, ends), Fault::None);
  }
}

TEST(SlabChecks, AllowNothingOutsideTheirRoom) {
  const ThinShell thin(testing::ball(12));
  LinkedDraft draft(thin.draft());
  Box3d room;
  room.add(draft.at[40] - Vec3d{1, 1, 1} * (0.5 * thin.longest));
  room.add(draft.at[40] + Vec3d{1, 1, 1} * (0.5 * thin.longest));
  SlabChecks checks(thin.source, room);
  checks.build_boxes(draft);
  Box3d inside = room, touching = room;
  inside.low += Vec3d{1, 1, 1};
  inside.high = inside.high - Vec3d{1, 1, 1};
  touching.high = touching.high - Vec3d{1, 1, 1};
  EXPECT_TRUE(checks.is_within(inside));
  EXPECT_FALSE(checks.is_within(touching));
  checks.begin().set_fibre(draft, 0);
  EXPECT_EQ(checks.check(draft, draft.ends[0]), Fault::Outside);
}

TEST(SlabChecks, LetTheSourceFoldByTheShareThatIsAllowed) {
  const ThinShell thin(noisy_field(20, 0.04));
  ShellPatch patch = coarse_patch(thin, 80);
  LinkedDraft draft = patch.draft();
  SlabChecks checks(thin.source, everywhere());
  checks.build_boxes(draft);
  std::mt19937 random(8);
  std::uniform_real_distribution<double> some(-1, 1);
  int folded = 0, passed_some = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    const auto v = static_cast<std::uint32_t>(random() % draft.out.size());
    Ends ends = draft.ends[v];
    const Vec3d shift = Vec3d{some(random), some(random), some(random)} * (0.3 * length(draft.fibre(v)));
    ends[kOuter] = snap(to_double(ends[kOuter]) + shift);
    checks.begin().set_fibre(draft, v);
    checks.tolerate({.folds = 0});
    if (checks.check(draft, ends) != Fault::Folded) continue;
    ++folded;
    checks.tolerate({.folds = 0.2});
    const Fault with_some = checks.check(draft, ends);
    checks.tolerate({.folds = 1});
    const Fault with_all = checks.check(draft, ends);
    EXPECT_NE(with_all, Fault::Folded);
    passed_some += with_some == Fault::None;
    if (with_some == Fault::None) {
      EXPECT_EQ(with_all, Fault::None);
    }
  }
  EXPECT_GT(folded, 20);
  EXPECT_GT(passed_some, 0);
  EXPECT_LT(passed_some, folded) << "a share is not all";
}

TEST(SlabChecks, CountWhatASlabWouldLose) {
  const ThinShell thin(testing::ball(24));
  ShellPatch patch = coarse_patch(thin, 60);
  patch.tolerate({.folds = 1, .loss = 0.5});
  LinkedDraft draft = patch.draft();
  SlabChecks checks(thin.source, everywhere());
  checks.build_boxes(draft);
  checks.tolerate({.folds = 1, .loss = 0.5});
  for (std::uint32_t v = 0; v < draft.out.size(); ++v) {
    checks.begin().set_fibre(draft, v);
    // What the star holds, by area: each triangle that meets one of its slabs, once.
    double area = 0;
    for (std::uint32_t t = 0; t < thin.source.faces.size(); ++t) {
      bool listed = false;
      for (const std::uint32_t f : checks.star().slots)
        for (const TriangleReference r : draft.lists.of(f)) listed = listed || r.first() == t;
      if (listed) area += 0.5 * length(thin.source.cross_of(t));
    }
    EXPECT_EQ(checks.lost_now(draft), 0);
    EXPECT_NEAR(checks.held_area(), area, 1e-9 * area);
    // An outer end drawn down to the surface and below cuts some off; how much may be lost decides.
    Ends ends = draft.ends[v];
    ends[kOuter] = snap(draft.at[v] - (draft.at[v] - to_double(ends[kInner])) * 0.3);
    const Fault strict = checks.check(draft, ends);
    EXPECT_NE(strict, Fault::None);
    if (strict != Fault::Outer) continue;
    EXPECT_NE(checks.check(draft, ends, 0.0), Fault::None);
    EXPECT_EQ(checks.check(draft, ends, 1e30), Fault::None);
  }
}

// After a commit the lists still hold whatever a fibre of their slab crosses.
TEST(SlabChecks, KeepInListsAllThatFibresCross) {
  const ThinShell thin(testing::ball(40, 0.1));
  const ShellDraft draft = coarse(thin, 60);
  std::mt19937 random(6);
  std::uniform_real_distribution<double> share(0, 1);
  std::size_t crossings = 0, clusters = 0;
  for (std::uint32_t f = 0; f < draft.faces.size(); ++f) {
    std::set<std::uint32_t> listed;
    for_triangles(thin.source, draft.lists.of(f), [&](std::uint32_t t) { listed.insert(t); });
    for (const TriangleReference r : draft.lists.of(f)) clusters += r.is_cluster();
    for (int k = 0; k < 8; ++k) {
      double u = share(random), v = share(random);
      if (u + v > 1) u = 1 - u, v = 1 - v;
      const LatticeTriangle in = draft.triangle(f, kInner), out = draft.triangle(f, kOuter);
      const auto on = [&](const LatticeTriangle& t) {
        return to_double(t[0]) * (1 - u - v) + to_double(t[1]) * u + to_double(t[2]) * v;
      };
      const Vec3d a = on(in), d = on(out) - a;
      for (std::uint32_t t = 0; t < thin.source.faces.size(); ++t) {
        const SourceTriangle s = thin.source.triangle(t);
        const double along = dot(s.normal, d), h = dot(s.normal, s.a - a) / along;
        if (!(h >= 0 && h <= 1)) continue;
        const Vec3d p = a + d * h;
        if (dot(cross(s.b - s.a, p - s.a), s.normal) < 0 || dot(cross(s.c - s.b, p - s.b), s.normal) < 0 ||
            dot(cross(s.a - s.c, p - s.c), s.normal) < 0)
          continue;
        ++crossings;
        EXPECT_TRUE(listed.contains(t)) << "slab " << f << ", triangle " << t;
      }
    }
  }
  EXPECT_GE(crossings, 8 * draft.faces.size() - 5);
  EXPECT_GT(clusters, 50U) << "no cluster was put together";
}

}  // namespace
}  // namespace relief::detail
