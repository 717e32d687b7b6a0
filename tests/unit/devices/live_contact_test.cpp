// Hand, plant, servo and surface together: where they come to rest, and that they do come to rest.
#include "support/shells.h"

#include <relief/devices/simulated_hand.h>
#include <relief/haptics/servo.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace relief {
namespace {

const SnapshotPtr& plane() {
  static const SnapshotPtr model = testing::displaced(testing::plane_shell(4, 8), [](Vec3d) { return 0.5; });
  return model;
}

/// The hand wants to be 5 mm under a plane that it approaches from 4 mm above; 0.1 m per model unit.
HandTarget press(double t) { return {{0.05, 4e-3 - 9e-3 * std::min(1.0, t / 0.2), 0.05}, 0}; }

struct Rest {
  double y = 0;           ///< m
  double force = 0;       ///< N
  double late_speed = 0;  ///< m/s, the largest in the last fifth
  std::uint32_t flags = 0;
};

Rest come_to_rest(const PlantPreset& preset, const Hand& person, const ForceSettings& force) {
  SimulatedHand hand(preset, person, press);
  Servo servo({.workspace = {.metres_per_unit = 0.1}, .force = force}, hand.info());
  Rest rest;
  for (int k = 0; k < 3000; ++k) {
    DeviceState state;
    EXPECT_TRUE(hand.read(state));
    const ServoSample felt = servo.step(*plane(), state);
    rest.flags |= felt.flags;
    rest.force = felt.force.y;
    EXPECT_TRUE(hand.write({felt.force, felt.torque}));
    if (k >= 2400) rest.late_speed = std::max(rest.late_speed, length(hand.handle_velocity()));
  }
  rest.y = hand.handle_position().y;
  return rest;
}

TEST(LiveContact, RestsWhereTheSpringsBalance) {
  PlantPreset preset = plant_presets().front();
  preset.plant.coulomb = 0;
  preset.plant.encoder_step = 0;
  for (const double stiffness : {200.0, 400.0}) {
    const Rest rest = come_to_rest(preset, {.stiffness = 300, .damping = 3, .tremor = 0}, {.stiffness = stiffness});
    // 300 (y + 5 mm) = -k y
    const double y = -300 * 5e-3 / (300 + stiffness);
    EXPECT_NEAR(rest.y, y, 1e-7);
    EXPECT_NEAR(rest.force, -stiffness * y, 1e-4);
    EXPECT_LT(rest.late_speed, 1e-6);
    EXPECT_EQ(rest.flags & ~bit(ServoFault::Passivity), 0U) << "going in makes a little energy";
  }
}

TEST(LiveContact, TheDefaultForceIsStableOnEveryPresetAlsoWithADelay) {
  for (const PlantPreset& listed : plant_presets())
    for (const int delay : {0, 1}) {
      PlantPreset preset = listed;
      preset.plant.delay_ticks = delay;
      const Rest rest = come_to_rest(preset, {.stiffness = 300, .damping = 2, .tremor = 0}, {});
      // Stick friction and one encoder step leave the balance open by this much.
      const double slack = (preset.plant.coulomb + 400 * preset.plant.encoder_step) / 700 + preset.plant.encoder_step;
      EXPECT_NEAR(rest.y, -300 * 5e-3 / 700, slack) << preset.name << " delay " << delay;
      EXPECT_LT(rest.late_speed, 1e-3) << preset.name << " delay " << delay;
    }
}

}  // namespace
}  // namespace relief
