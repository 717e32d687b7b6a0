// The figures of a simulated device and its hand, from a file.
#pragma once

#include <relief/devices/simulated_hand.h>

#include <filesystem>

namespace relief::detail {

struct PlantFile {
  PlantPreset preset;
  Hand hand;
};

/// Returns a JSON object with "like" (a preset's name; else the first one), and in "plant", "device" and "hand" the
/// figures that differ from it, named as the members of Plant, DeviceInfo and Hand. Errors: NotFound, Io; Corrupt,
/// naming the figure and its range.
[[nodiscard]] Result<PlantFile> read_plant_file(const std::filesystem::path& file);

}  // namespace relief::detail
