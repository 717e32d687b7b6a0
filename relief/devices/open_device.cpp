#include <relief/base/try.h>
#include <relief/devices/open_device.h>
#include <relief/devices/plant_file.h>

#include <utility>

namespace relief {
namespace {

constexpr std::string_view kSimulatedHand = "sim:hand";
constexpr std::string_view kPlantOfFile = "sim:hand:";

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
                       .description = "simulated hand, " + std::string(preset.name),
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

}  // namespace relief
