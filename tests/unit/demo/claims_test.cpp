#include "claims.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

namespace relief::demo {

namespace {

/// A run in which every promise was kept.
Facts good() {
  Facts f;
  f.is_certified = true;
  f.distance = 0.3;
  f.diagonal = 200;
  f.tick_p99 = 20;
  f.ticks = f.null_ticks = 10'000;
  f.force_max = 2;
  f.force_limit = 8;
  f.strokes = 12;
  f.undo_equal = f.redo_equal = f.reload_equal = true;
  f.recorded = f.repeated = 10'000;
  f.painted = f.seen = 100;
  return f;
}

Claim claim(const std::vector<Claim>& claims, const std::string& id) {
  const auto found = std::ranges::find(claims, id, &Claim::id);
  return found == claims.end() ? Claim{} : *found;
}

struct Case {
  std::string id;
  std::function<void(Facts&)> spoil;
  Verdict verdict;
};

}  // namespace

TEST(Claims, AGoodRunPasses) {
  const std::vector<Claim> claims = judge(good());
  EXPECT_EQ(worst(claims), Verdict::Pass);
  EXPECT_EQ(summary(claims), "PASS: all 10 claims hold.");
  for (const Claim& c : claims) EXPECT_TRUE(c.why.empty()) << c.id;
}

/// Each is broken alone, a little beyond its limit; what lies in the scan or the machine is a warning.
TEST(Claims, EachFailsAlone) {
  const std::vector<Case> cases = {
      {"certified", [](Facts& f) { f.is_certified = false; }, Verdict::Warn},
      {"certified", [](Facts& f) { f.failed_conditions = 1; }, Verdict::Fail},
      {"distance", [](Facts& f) { f.distance = 2.1; }, Verdict::Fail},
      {"distance", [](Facts& f) { f.distance = 2.1, f.own_model = false; }, Verdict::Warn},
      {"touch", [](Facts& f) { f.tick_p99 = 501; }, Verdict::Fail},
      {"missed", [](Facts& f) { f.missed = 11; }, Verdict::Warn},
      {"missed", [](Facts& f) { f.missed = f.slow_ticks = 11; }, Verdict::Fail},
      {"force", [](Facts& f) { f.force_max = 8.1; }, Verdict::Fail},
      {"stuck", [](Facts& f) { f.stuck_for = 0.11; }, Verdict::Fail},
      {"undo", [](Facts& f) { f.undo_equal = false; }, Verdict::Fail},
      {"undo", [](Facts& f) { f.redo_equal = false; }, Verdict::Fail},
      {"saved", [](Facts& f) { f.reload_equal = false; }, Verdict::Fail},
      {"replay", [](Facts& f) { f.repeated = 9'999; }, Verdict::Fail},
      {"replay", [](Facts& f) { f.repeated = 9'999, f.dropped = true; }, Verdict::Warn},
      {"paint", [](Facts& f) { f.seen = 89; }, Verdict::Fail},
      {"paint", [](Facts& f) { f.seen = 89, f.own_model = false; }, Verdict::Warn},
  };
  for (const Case& c : cases) {
    Facts facts = good();
    c.spoil(facts);
    const std::vector<Claim> claims = judge(facts);
    EXPECT_EQ(claim(claims, c.id).verdict, c.verdict) << c.id;
    EXPECT_GT(claim(claims, c.id).value, claim(claims, c.id).limit) << c.id;
    EXPECT_EQ(std::ranges::count(claims, Verdict::Pass, &Claim::verdict), 9) << c.id;
    EXPECT_EQ(worst(claims), c.verdict) << c.id;
  }
}

TEST(Claims, WhatLiesWithinItsLimitPasses) {
  Facts f = good();
  f.distance = 1.9;
  f.tick_p99 = 499;
  f.missed = 10;
  f.force_max = 8;
  f.seen = 90;
  EXPECT_EQ(worst(judge(f)), Verdict::Pass);
}

TEST(Claims, AnotherLimitJudgesAnew) {
  Limits limits;
  ASSERT_TRUE(add_limit(limits, "touch=10"));
  EXPECT_EQ(claim(judge(good(), limits), "touch").verdict, Verdict::Fail);
  EXPECT_EQ(summary(judge(good(), limits)), "FAIL: 9 of 10 claims hold; see FAIL below.");
  ASSERT_TRUE(add_limit(limits, "touch=20"));
  EXPECT_EQ(worst(judge(good(), limits)), Verdict::Pass);
  // A scan of the user's is excused where the limit is the demo's, not where it is the user's.
  Facts scan = good();
  scan.own_model = false;
  scan.distance = 2.1;
  EXPECT_EQ(worst(judge(scan, limits)), Verdict::Warn);
  ASSERT_TRUE(add_limit(limits, "distance=1"));
  EXPECT_EQ(worst(judge(scan, limits)), Verdict::Fail);
  for (const char* text : {"", "touch", "touch=", "touch=x", "touch=1x", "touch=nan", "feel=1"}) {
    const Status status = add_limit(limits, text);
    ASSERT_FALSE(status) << text;
    EXPECT_TRUE(status.error().message.contains("certified, distance, touch")) << status.error().message;
  }
}

}  // namespace relief::demo
