// Plants of which one knows what they do, for tests.
#pragma once

#include <relief/devices/simulated_hand.h>

namespace relief::testing {

/// Only a mass and a viscous damper; perfect sensor and amplifier.
inline PlantPreset bare(double mass, double viscous) {
  return {.name = "bare",
          .plant = {.mass = mass,
                    .viscous = viscous,
                    .coulomb = 0,
                    .encoder_step = 0,
                    .max_force = 1e9,
                    .slew = 0,
                    .dac_step = 0,
                    .lag = 0},
          .info = {}};
}
inline constexpr Hand kNobody = {.stiffness = 0, .damping = 0, .max_force = 0, .tremor = 0};
inline HandTarget at_origin(double /*t*/) { return {}; }

}  // namespace relief::testing
