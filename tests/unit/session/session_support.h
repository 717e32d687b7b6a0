// How the tests of live sessions hold a ball of radius about 1: 0.05 m in the hand.
#pragma once

#include <relief/session/session.h>

namespace relief::testing {

inline constexpr double kMetres = 0.05;

inline Session::Settings settings() {
  Session::Settings s;
  s.servo.workspace.metres_per_unit = kMetres;
  s.sculpt.full_depth = 0.02;
  return s;
}

}  // namespace relief::testing
