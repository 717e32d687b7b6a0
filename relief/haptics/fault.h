// What a tick of the servo can report.
#pragma once

#include <cstdint>
#include <string_view>

namespace relief {

/// Why a tick's force is not what the law alone would give. Bits of ServoSample::flags and of the flags column of
/// F.csv.
enum class ServoFault : std::uint32_t {
  None = 0,
  /// Not finite, denormal, over 10 m from the workspace's origin, further from the device's than four times the radius
  /// of its workspace, or frozen; or an orientation that is no rotation.
  BadPosition = 1U << 0U,
  /// Time is not a number, stood still for over 20 ms, ran back by over 2 ms, or jumped by 50 ms or more.
  BadTime = 1U << 1U,
  TooFast = 1U << 2U,           ///< the position moved, or the device's own velocity is, faster than 10 m/s
  Latched = 1U << 3U,           ///< a fault happened and the hand has not lifted off since: zero force
  ForceClamped = 1U << 4U,      ///< |F| was limited to the device's maximum
  RateClamped = 1U << 5U,       ///< the change of F was limited
  StiffnessClamped = 1U << 6U,  ///< a setting was above what the device allows
  /// The first reading was inside the solid, or a model with another cage took the place of the last one around a tool
  /// that touched nothing: no force until the tool has left it.
  StartInside = 1U << 7U,
  DeviceLost = 1U << 8U,
  Overrun = 1U << 9U,         ///< a tick came more than one period late
  SampleDropped = 1U << 10U,  ///< the telemetry queue was full right before this sample
  /// The model rose by over 3 mm (at the hand) under the tool, or another one took its place while the tool touched, in
  /// which it lies in the material far from any surface.
  SurfaceJumped = 1U << 11U,
  /// Damped by over 1 % of the greatest force, because the hand had got more energy out of this contact than it had put
  /// in.
  Passivity = 1U << 12U,
  LoadLimited = 1U << 13U,   ///< limited by what the motors bear for long, or by the work that the force may do
  SpeedLimited = 1U << 14U,  ///< braked, because the hand was faster than the device's max_speed
  Stalled = 1U << 15U,       ///< the servo itself stood still for over 50 ms
  LateTicks = 1U << 16U,  ///< stiffness was lowered, because more than one tick in a thousand comes over 0.25 ms late
  /// The reading is the last one again, or up to 2 ms older: the last force is held, for 20 ms at most.
  NoNews = 1U << 17U,
  /// The position has stood still to the last bit for 2 s while the pen turned, as where an arm was never calibrated. A
  /// warning: forces go on.
  Uncalibrated = 1U << 18U,
  Reconnected = 1U << 19U,  ///< the device did not answer for a while, and this is its first reading since
  ForcesOff = 1U << 20U,    ///< the device has switched its forces off itself
};
[[nodiscard]] constexpr std::uint32_t bit(ServoFault fault) noexcept { return static_cast<std::uint32_t>(fault); }
[[nodiscard]] std::string_view name(ServoFault fault) noexcept;

}  // namespace relief
