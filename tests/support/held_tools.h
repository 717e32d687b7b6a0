// The tools of the product, for scenes that are tried with each.
#pragma once

#include "support/tools.h"

#include <relief/haptics/servo.h>

#include <array>
#include <string>

namespace relief::testing {

/// What a hand holds.
struct HeldTool {
  std::string name;   ///< what a figure's name ends with; empty for the point
  double radius = 0;  ///< model units: where the device's position is, it touches a flat surface that is so far below
  std::vector<Vec3d> points = {};
  int dear = 1;  ///< a tick takes about so many times longer than a point's: a short form has as many ticks fewer

  [[nodiscard]] bool is_point() const noexcept { return radius == 0; }
  [[nodiscard]] bool is_ball() const noexcept { return radius > 0 && points.empty(); }
  [[nodiscard]] TouchTool tool() const noexcept {
    return points.empty() ? TouchTool{.radius = radius} : TouchTool{.points = points};
  }
};

/// A point, a ball, and a rigid tool: 100 points evenly all over that ball.
inline std::array<HeldTool, 3> held_tools(double radius) {
  return {{{.name = ""},
           {.name = ", ball", .radius = radius, .dear = 5},
           {.name = ", rigid tool", .radius = radius, .points = sphere_points(100, radius), .dear = 20}}};
}

}  // namespace relief::testing
