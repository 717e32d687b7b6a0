// What a servo tick may never do: allocate, free, lock.
#include "support/no_alloc.h"
#include "support/shells.h"

#include <relief/core/snapshot_channel.h>
#include <relief/devices/simulated_hand.h>
#include <relief/haptics/servo.h>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <mutex>
#include <vector>

namespace relief {
namespace {

TEST(ForbiddenCalls, AreSeen) {
  std::mutex mutex;
  const testing::NoAllocScope scope;
  auto number = std::make_unique<int>(3);
  EXPECT_EQ(scope.calls().news, 1);
  number.reset();
  EXPECT_EQ(scope.calls().deletes, 1);
  const std::scoped_lock lock(mutex);
  EXPECT_EQ(scope.calls().locks, testing::kCountsLocks ? 1 : 0);
}

/// Whatever the tool; how many ticks touched.
int ticks_without_calls(const TouchTool& tool) {
  const auto sphere = [](double radius) {
    return testing::displaced(testing::sphere_shell(2, 16), [=](Vec3d p) { return (radius / length(p) - 0.8) / 0.4; });
  };
  SnapshotChannel channel(sphere(1));
  auto reader = channel.reader();
  PlantPreset preset = plant_presets().front();
  preset.plant.resonance = 80;
  SimulatedHand hand(preset, {.tremor = 1e-3},
                     [](double t) { return HandTarget{{0.05 * std::sin(3 * t), 0.02, 0.09 * std::cos(3 * t)}, 0}; });
  Servo servo({.workspace = {.metres_per_unit = 0.1}, .force = {.friction = 0.4}, .tool = tool}, hand.info());
  int touched = 0, faults = 0;
  for (int k = 0; k < 20'000; ++k) {
    if (k == 10'000) channel.publish(sphere(0.99));
    const testing::NoAllocScope scope;
    DeviceState state;
    const bool alive = hand.read(state);
    if (k % 1500 == 7) state.position.x = std::numeric_limits<double>::quiet_NaN();
    const ServoSample felt = servo.step(reader.latest(), state);
    const bool written = hand.write({felt.force, felt.torque});
    const testing::ForbiddenCalls calls = scope.calls();
    EXPECT_TRUE(alive && written);
    EXPECT_EQ(calls.news + calls.deletes + calls.locks, 0) << "tick " << k;
    if (::testing::Test::HasFailure()) return 0;
    touched += felt.contact ? 1 : 0;
    faults += felt.flags != 0 ? 1 : 0;
  }
  EXPECT_GT(faults, 10);
  return touched;
}

TEST(ServoTick, NeitherAllocatesNorFreesNorLocks) { EXPECT_GT(ticks_without_calls({}), 2000); }

TEST(ServoTick, NeitherDoesItWithABall) { EXPECT_GT(ticks_without_calls({.radius = 0.03}), 1000); }

TEST(ServoTick, NeitherDoesItWithARigidTool) {
  std::vector<Vec3d> points;
  for (int k = 0; k < 200; ++k) points.push_back(Vec3d{std::cos(2.4 * k), 0.01 * k - 1, std::sin(2.4 * k)} * 0.05);
  EXPECT_GT(ticks_without_calls({.points = points}), 1000);
}

}  // namespace
}  // namespace relief
