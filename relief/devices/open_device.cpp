#include <relief/devices/open_device.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace relief {
namespace {

constexpr std::string_view kSimulatedHand = "sim:hand";

/// A unit vector that visits the sphere evenly, the top first (golden angle).
Vec3d direction(int index) noexcept {
  constexpr int kCount = 13;
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  const double y = 1 - 2 * (index % kCount + 0.5) / kCount;
  const double ring = std::sqrt(1 - y * y), turn = golden * (index % kCount) + std::numbers::pi / 2;
  return {ring * std::cos(turn), y, ring * std::sin(turn)};
}

/// Minimum-jerk way from 0 to 1.
double ease(double share) noexcept {
  const double s = std::clamp(share, 0.0, 1.0);
  return s * s * s * (10 - s * (15 - 6 * s));
}

}  // namespace

ReplayDevice::ReplayDevice(DeviceInfo info, std::vector<DeviceState> readings)
    : info_(std::move(info)), readings_(std::move(readings)) {}

bool ReplayDevice::read(DeviceState& state) noexcept {
  if (next_ == readings_.size()) return false;
  state = readings_[next_++];
  return true;
}

bool ReplayDevice::write(const Wrench& /*wrench*/) noexcept { return true; }

std::vector<DeviceListing> list_devices() {
  std::vector<DeviceListing> devices = {{std::string(kSimulatedHand), "simulated hand on a touch-like device"}};
  for (const PlantPreset& preset : plant_presets())
    devices.push_back({preset.info.name, "simulated hand on a " + std::string(preset.name) + " device"});
  return devices;
}

Result<std::unique_ptr<HapticDevice>> open_device(std::string_view name, HandScript script) {
  for (const PlantPreset& preset : plant_presets())
    if (name == preset.info.name || (name == kSimulatedHand && &preset == &plant_presets().front()))
      return std::make_unique<SimulatedHand>(preset, Hand{}, std::move(script));
  std::string known;
  for (const DeviceListing& device : list_devices()) known += (known.empty() ? "" : ", ") + device.name;
  return fail(Errc::NotFound, "no device is named \"" + printable(name) + "\"; known are " + known);
}

HandScript exploring_hand(const Box3d& reach) {
  const Vec3d centre = reach.empty() ? Vec3d{} : reach.centre();
  const Vec3d half = reach.empty() ? Vec3d{} : reach.extent() * 0.5;
  return [centre, half](double t) -> HandTarget {
    // One place after the other, 2 s each: travel around the box, press in, stroke there and back, lift off.
    constexpr double kVisit = 2;
    const double visit = std::floor(std::max(t, 0.0) / kVisit);
    const double at = std::max(t, 0.0) - visit * kVisit;
    const int index = static_cast<int>(std::fmod(visit, 1e6));
    const Vec3d here = direction(index), from = index > 0 ? direction(index - 1) : here;

    Vec3d way = here;
    if (const double angle = std::acos(std::clamp(dot(from, here), -1.0, 1.0)); at < 0.7 && std::sin(angle) > 1e-6) {
      const double share = ease(at / 0.7);
      way = (from * std::sin((1 - share) * angle) + here * std::sin(share * angle)) / std::sin(angle);
    } else if (at >= 0.7) {
      const Vec3d side = normalized(cross(here, std::abs(here.y) < 0.9 ? Vec3d{0, 1, 0} : Vec3d{1, 0, 0}));
      way = normalized(here + side * (0.3 * (ease((at - 0.95) / 0.35) - ease((at - 1.35) / 0.35))));
    }
    const double press = ease((at - 0.7) / 0.3) * (1 - ease((at - 1.7) / 0.3));
    const double out = 1.2 - 0.65 * press;
    return {.position = centre + Vec3d{way.x * half.x, way.y * half.y, way.z * half.z} * out, .buttons = 0};
  };
}

}  // namespace relief
