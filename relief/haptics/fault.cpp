#include <relief/haptics/fault.h>

namespace relief {

std::string_view name(ServoFault fault) noexcept {
  switch (fault) {
    case ServoFault::None:
      return "none";
    case ServoFault::BadPosition:
      return "bad position";
    case ServoFault::BadTime:
      return "bad time";
    case ServoFault::TooFast:
      return "too fast";
    case ServoFault::Latched:
      return "latched";
    case ServoFault::ForceClamped:
      return "force clamped";
    case ServoFault::RateClamped:
      return "rate clamped";
    case ServoFault::StiffnessClamped:
      return "stiffness clamped";
    case ServoFault::StartInside:
      return "start inside";
    case ServoFault::DeviceLost:
      return "device lost";
    case ServoFault::Overrun:
      return "overrun";
    case ServoFault::SampleDropped:
      return "sample dropped";
    case ServoFault::SurfaceJumped:
      return "surface jumped";
    case ServoFault::Passivity:
      return "passivity";
    case ServoFault::LoadLimited:
      return "load limited";
    case ServoFault::SpeedLimited:
      return "speed limited";
    case ServoFault::Stalled:
      return "stalled";
    case ServoFault::LateTicks:
      return "late ticks";
    case ServoFault::NoNews:
      return "no news";
    case ServoFault::Uncalibrated:
      return "looks uncalibrated";
    case ServoFault::Reconnected:
      return "reconnected";
    case ServoFault::ForcesOff:
      return "forces off";
  }
  return "unknown";
}

}  // namespace relief
