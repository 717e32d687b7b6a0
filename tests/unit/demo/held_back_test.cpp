#include "held_back.h"

#include "support/driver.h"

#include <gtest/gtest.h>

#include <vector>

namespace relief::demo {
namespace {

/// So many ticks at a depth below the sheet at y = 0, held by a point that lies so far beside the foot.
std::vector<ServoSample> pressed(int ticks, double depth, double beside) {
  std::vector<ServoSample> trace;
  for (int k = 0; k < ticks; ++k) {
    ServoSample s;
    s.t = 1e-3 * k;
    s.cursor = {0.4, -depth, 0.4};
    s.contact = true;
    s.contact_point = {0.4 + beside, 0, 0.4};
    s.depth = length(s.contact_point - s.cursor);
    trace.push_back(s);
  }
  return trace;
}

TEST(HeldBack, IsWhatHangsBesideTheNearestPlaceForSoLong) {
  const SnapshotPtr sheet = testing::displaced(testing::plane_shell(4, 8), [](Vec3d) { return 0.5; });
  EXPECT_EQ(longest_held_back(pressed(300, 0.02, 0), *sheet, *sheet), 0);
  EXPECT_EQ(longest_held_back(pressed(300, 0.02, 0.02), *sheet, *sheet), 0) << "1.41 times as far";
  EXPECT_NEAR(longest_held_back(pressed(300, 0.02, 0.03), *sheet, *sheet), 0.29, 1e-9) << "1.8 times as far";
  EXPECT_NEAR(longest_held_back(pressed(150, 0.02, 0.1), *sheet, *sheet), 0.14, 1e-9);

  std::vector<ServoSample> let_go = pressed(300, 0.02, 0.1);
  for (int k = 100; k < 200; ++k) let_go[std::size_t(k)].contact = false;
  EXPECT_NEAR(longest_held_back(let_go, *sheet, *sheet), 0.09, 1e-9);
}

TEST(HeldBack, TheFartherOfBothModelsCounts) {
  const auto shell = testing::plane_shell(4, 8);
  const SnapshotPtr low = testing::displaced(shell, [](Vec3d) { return 0.4; });
  const SnapshotPtr high = testing::displaced(shell, [](Vec3d) { return 0.5; });
  // It was held by the higher surface at first, and that was carved away later.
  EXPECT_EQ(longest_held_back(pressed(300, 0.02, 0), *high, *low), 0);
  EXPECT_EQ(longest_held_back(pressed(300, 0.02, 0), *low, *high), 0);
}

}  // namespace
}  // namespace relief::demo
