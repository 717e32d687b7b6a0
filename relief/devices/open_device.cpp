#include <relief/base/try.h>
#include <relief/core/query.h>
#include <relief/devices/open_device.h>
#include <relief/devices/plant_file.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

namespace relief {
namespace {

constexpr std::string_view kSimulatedHand = "sim:hand";
constexpr std::string_view kPlantOfFile = "sim:hand:";
constexpr int kPlaces = 13;  // that an exploring hand goes to, then again

/// A unit vector that visits the sphere evenly, the top first (golden angle).
Vec3d direction(int index) noexcept {
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  const double y = 1 - 2 * (index % kPlaces + 0.5) / kPlaces;
  const double ring = std::sqrt(1 - y * y), turn = golden * (index % kPlaces) + std::numbers::pi / 2;
  return {ring * std::cos(turn), y, ring * std::sin(turn)};
}

/// Minimum-jerk way from 0 to 1.
double ease(double share) noexcept {
  const double s = std::clamp(share, 0.0, 1.0);
  return s * s * s * (10 - s * (15 - 6 * s));
}

}  // namespace

std::string_view name(Evidence evidence) noexcept {
  switch (evidence) {
    case Evidence::Simulated:
      return "simulated";
    case Evidence::ContractTested:
      return "contract-tested against a fake; never run on hardware";
    case Evidence::FieldTested:
      return "field-tested";
  }
  return "";
}

std::vector<DeviceListing> list_devices() {
  std::vector<DeviceListing> devices;
  const auto list = [&](const std::string& name, const PlantPreset& preset) {
    devices.push_back({.name = name,
                       .description = "simulated hand on a " + std::string(preset.name) + " device",
                       .evidence = Evidence::Simulated,
                       .info = preset.info});
  };
  list(std::string(kSimulatedHand), plant_presets().front());
  for (const PlantPreset& preset : plant_presets()) list(preset.info.name, preset);
  return devices;
}

Result<std::unique_ptr<HapticDevice>> open_device(std::string_view name, HandScript script) {
  for (const PlantPreset& preset : plant_presets())
    if (name == preset.info.name || (name == kSimulatedHand && &preset == &plant_presets().front()))
      return std::make_unique<SimulatedHand>(preset, Hand{}, std::move(script));
  if (name.starts_with(kPlantOfFile) && name.ends_with(".json")) {
    RELIEF_TRY(detail::PlantFile read, detail::read_plant_file(name.substr(kPlantOfFile.size())));
    read.preset.info.name = name;
    return std::make_unique<SimulatedHand>(read.preset, read.hand, std::move(script));
  }
  std::string known;
  for (const DeviceListing& device : list_devices()) known += device.name + ", ";
  return fail(Errc::NotFound,
              "no device is named \"" + printable(name) + "\"; known are " + known + "and sim:hand:FILE.json");
}

HandScript exploring_hand(const Snapshot& model, const Workspace& workspace, std::uint32_t buttons) {
  Box3d box;
  box.add(workspace.to_device(model.slab_mesh().bounds().low));
  box.add(workspace.to_device(model.slab_mesh().bounds().high));
  const Vec3d centre = box.centre(), half = box.extent() * 0.5;
  const double size = diagonal(box);
  /// Where the hand comes from, in the air; where it would press the tool to; along the surface there.
  struct Place {
    Vec3d above, in, side;
  };
  const auto around = [=](Vec3d way) { return centre + Vec3d{way.x * half.x, way.y * half.y, way.z * half.z} * 1.2; };
  std::array<Place, kPlaces> places;
  for (int k = 0; k < kPlaces; ++k) {
    // The nearest place of the surface: the straight way there is free.
    const Vec3d above = around(direction(k));
    const SurfacePoint nearest = closest_point(model, workspace.to_model(above));
    const bool found = nearest.slab != kNoSlab;
    const Vec3d normal = found ? nearest.normal : direction(k);
    const Vec3d surface = found ? workspace.to_device(nearest.position) : centre;
    const Vec3d side = normalized(cross(normal, std::abs(normal.y) < 0.9 ? Vec3d{0, 1, 0} : Vec3d{1, 0, 0}));
    places[static_cast<std::size_t>(k)] = {above, surface - normal * (0.08 * size), side * (0.08 * size)};
  }
  return [places, around, buttons](double t) -> HandTarget {
    // One place after the other, 2 s each: travel around the box, press in, stroke there and back, lift off. The first
    // one needs no travel.
    constexpr double kVisit = 2, kFirst = 0.5;
    const double now = std::max(t, 0.0) + kFirst, visit = std::floor(now / kVisit), at = now - visit * kVisit;
    const int index = static_cast<int>(std::fmod(visit, 1e6));
    const Vec3d here = direction(index), from = index > 0 ? direction(index - 1) : here;
    if (at < 0.7) {
      const double angle = std::acos(std::clamp(dot(from, here), -1.0, 1.0)), share = ease(at / 0.7);
      if (std::sin(angle) <= 1e-6) return {.position = around(here), .buttons = 0};
      const Vec3d way = (from * std::sin((1 - share) * angle) + here * std::sin(share * angle)) / std::sin(angle);
      return {.position = around(way), .buttons = 0};
    }
    const Place& place = places[static_cast<std::size_t>(index % kPlaces)];
    const double press = ease((at - 0.7) / 0.3) * (1 - ease((at - 1.7) / 0.3));
    const double stroke = ease((at - 0.95) / 0.35) - ease((at - 1.35) / 0.35);
    return {.position = place.above + (place.in - place.above) * press + place.side * stroke,
            .buttons = press > 0.5 ? buttons : 0U};
  };
}

}  // namespace relief
