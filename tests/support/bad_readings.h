// Readings that no device can mean, and what the servo calls each.
#pragma once

#include <relief/haptics/servo.h>

#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace relief::testing {

struct BadReading {
  std::string name;
  /// Makes a good reading at t = 1.011 s, one tick after one at 1.010 s, a bad one.
  std::function<void(DeviceState&)> spoil;
  ServoFault expected;
};

inline std::vector<BadReading> bad_readings() {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInf = std::numeric_limits<double>::infinity();
  return {
      {"NaN", [](DeviceState& s) { s.position.y = kNan; }, ServoFault::BadPosition},
      {"AllNaN", [](DeviceState& s) { s.position = {kNan, kNan, kNan}; }, ServoFault::BadPosition},
      {"Infinity", [](DeviceState& s) { s.position.x = -kInf; }, ServoFault::BadPosition},
      {"Denormal", [](DeviceState& s) { s.position.x = 1e-310; }, ServoFault::BadPosition},
      {"Huge", [](DeviceState& s) { s.position.z = 1e30; }, ServoFault::BadPosition},
      {"Largest", [](DeviceState& s) { s.position.z = std::numeric_limits<double>::max(); }, ServoFault::BadPosition},
      {"OutsideTheWorkspace", [](DeviceState& s) { s.position.z = 0.31; }, ServoFault::BadPosition},
      {"OutOfReach", [](DeviceState& s) { s.position.z = 11; }, ServoFault::BadPosition},
      {"TimeRunsBack", [](DeviceState& s) { s.t = 0.5; }, ServoFault::BadTime},
      {"TimeRunsBackABit", [](DeviceState& s) { s.t = 1.0079; }, ServoFault::BadTime},
      {"TimeJumps", [](DeviceState& s) { s.t += 0.049; }, ServoFault::BadTime},
      {"TimeIsNaN", [](DeviceState& s) { s.t = kNan; }, ServoFault::BadTime},
      {"TimeIsInfinite", [](DeviceState& s) { s.t = kInf; }, ServoFault::BadTime},
      {"TimeIsHuge", [](DeviceState& s) { s.t = 1e30; }, ServoFault::BadTime},
      {"Jump", [](DeviceState& s) { s.position.x += 0.02; }, ServoFault::TooFast},
      {"OwnVelocityNaN",
       [](DeviceState& s) {
         s.has_velocity = true;
         s.velocity.y = kNan;
       },
       ServoFault::BadPosition},
      {"OrientationZero",
       [](DeviceState& s) {
         s.has_orientation = true;
         s.orientation = {0, 0, 0, 0};
       },
       ServoFault::BadPosition},
      {"OrientationNaN",
       [](DeviceState& s) {
         s.has_orientation = true;
         s.orientation.x = kNan;
       },
       ServoFault::BadPosition},
      {"ForcesOff", [](DeviceState& s) { s.forces_off = true; }, ServoFault::ForcesOff},
      {"OwnVelocityTooHigh",
       [](DeviceState& s) {
         s.has_velocity = true;
         s.velocity.y = -30;
       },
       ServoFault::TooFast}};
}

}  // namespace relief::testing
