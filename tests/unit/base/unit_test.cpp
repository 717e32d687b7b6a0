#include <relief/base/progress.h>
#include <relief/base/unit.h>

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace relief {
namespace {

TEST(Unit, NamesRoundTripAndOthersAreRefused) {
  for (const Unit unit : {Unit::Millimetre, Unit::Centimetre, Unit::Metre, Unit::Inch})
    EXPECT_EQ(unit_from_name(name(unit)), unit);
  for (const std::string_view text : {"", "MM", "mm ", "km", "inch"}) EXPECT_FALSE(unit_from_name(text)) << text;
}

TEST(Unit, MetresAreThoseOfTheName) {
  EXPECT_EQ(metres(*unit_from_name("mm")), 1e-3);
  EXPECT_EQ(metres(*unit_from_name("cm")), 1e-2);
  EXPECT_EQ(metres(*unit_from_name("m")), 1.0);
  EXPECT_EQ(metres(*unit_from_name("in")), 0.0254);
}

TEST(Progress, EmptyOneSaysNothingAndNeverCancels) {
  const Progress progress;
  progress("decimate", 0.5);
  EXPECT_FALSE(progress.cancelled());
}

TEST(Progress, ReportsAndSeesTheWishToStop) {
  std::vector<std::string> phases;
  std::atomic<bool> stop = false;
  const Progress progress = {.report = [&](std::string_view phase, double) { phases.emplace_back(phase); },
                             .cancel = &stop};
  progress("decimate", 0);
  EXPECT_FALSE(progress.cancelled());
  stop = true;
  EXPECT_TRUE(progress.cancelled());
  EXPECT_EQ(phases, std::vector<std::string>{"decimate"});
}

}  // namespace
}  // namespace relief
