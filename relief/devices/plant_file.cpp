#include <relief/base/try.h>
#include <relief/devices/plant_file.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <span>
#include <string>
#include <system_error>
#include <utility>
#include <variant>

namespace relief::detail {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kLargest = std::size_t{1} << 20U;  // bytes of a file
constexpr std::size_t kMostJitter = 1000;

/// A figure: its name, its range and where it goes; of a list, the range of each entry.
template <typename Part>
struct Figure {
  std::string_view name;
  double low, high;
  std::variant<double Part::*, int Part::*, std::vector<std::uint8_t> Part::*> place;
};

constexpr Figure<Plant> kPlant[] = {
    {"mass", 1e-3, 10, &Plant::mass},           {"viscous", 0, 100, &Plant::viscous},
    {"coulomb", 0, 100, &Plant::coulomb},       {"encoder_step", 0, 0.01, &Plant::encoder_step},
    {"max_force", 0, 1000, &Plant::max_force},  {"slew", 0, 1e9, &Plant::slew},
    {"dac_step", 0, 100, &Plant::dac_step},     {"lag", 0, 1, &Plant::lag},
    {"resonance", 0, 5000, &Plant::resonance},  {"resonance_damping", 0, 10, &Plant::resonance_damping},
    {"delay_ticks", 0, 3, &Plant::delay_ticks}, {"jitter", 0, 3, &Plant::jitter},
    {"watchdog", 0, 10, &Plant::watchdog},      {"substeps", 20, 1000, &Plant::substeps},
    {"silent_at", 0, 1e6, &Plant::silent_at},   {"silent_for", 0, 1e6, &Plant::silent_for}};
constexpr Figure<DeviceInfo> kDevice[] = {{"max_force", 0, 1000, &DeviceInfo::max_force},
                                          {"max_stiffness", 0, 1e6, &DeviceInfo::max_stiffness},
                                          {"max_damping", 0, 1e4, &DeviceInfo::max_damping},
                                          {"max_force_rate", 0, 1e9, &DeviceInfo::max_force_rate},
                                          {"max_torque", 0, 100, &DeviceInfo::max_torque},
                                          {"continuous_force", 0, 1000, &DeviceInfo::continuous_force},
                                          {"max_work", 0, 1000, &DeviceInfo::max_work},
                                          {"max_speed", 0, 10, &DeviceInfo::max_speed},
                                          {"delay_ticks", 0, 3, &DeviceInfo::delay_ticks},
                                          {"delay", 0, 0.1, &DeviceInfo::delay},
                                          {"rate", 0, 1e5, &DeviceInfo::rate},
                                          {"workspace_radius", 0, 10, &DeviceInfo::workspace_radius}};
constexpr Figure<Hand> kHand[] = {{"stiffness", 0, 1e4, &Hand::stiffness},
                                  {"damping", 0, 1000, &Hand::damping},
                                  {"max_force", 0, 1000, &Hand::max_force},
                                  {"tremor", 0, 0.1, &Hand::tremor},
                                  {"pump", 0, 100, &Hand::pump}};

std::string text(double value) {
  char words[32];
  return {words, static_cast<std::size_t>(std::snprintf(words, sizeof words, "%g", value))};
}

std::string text(const Json& value) {
  if (value.is_structured()) return value.is_object() ? "an object" : "a list";
  const std::string words = value.dump(-1, ' ', true, Json::error_handler_t::replace);
  return words.size() <= 40 ? words : words.substr(0, 37) + "...";
}

bool is_in(const Json& value, double low, double high, bool whole) {
  if (!value.is_number()) return false;
  const double number = value.get<double>();
  return number >= low && number <= high && (!whole || number == static_cast<double>(static_cast<int>(number)));
}

/// Takes over the figures of one part of the file; `shown` is the file's name.
template <typename Part>
Status read_part(const Json& all, const char* name, std::span<const Figure<Part>> figures, Part& part,
                 const std::string& shown) {
  const auto given = all.find(name);
  if (given == all.end()) return {};
  if (!given->is_object())
    return fail(Errc::Corrupt, shown + ": \"" + name + "\" must be an object, and is " + text(*given));
  for (const auto& [key, value] : given->items()) {
    const auto figure = std::ranges::find(figures, key, &Figure<Part>::name);
    if (figure == figures.end()) {
      std::string known;
      for (const Figure<Part>& f : figures) known.append(known.empty() ? "" : ", ").append(f.name);
      return fail(Errc::Corrupt,
                  shown + ": \"" + name + "\" has no figure " + printable(text(Json(key))) + ", but " + known);
    }
    const auto& [_, low, high, place] = *figure;
    const auto refuse = [&](const char* what, const Json& found) {
      return fail(Errc::Corrupt, shown + ": " + name + "." + key + " must be " + what + " from " + text(low) + " to " +
                                     text(high) + ", and is " + text(found));
    };
    if (const auto* real = std::get_if<double Part::*>(&place)) {
      if (!is_in(value, low, high, false)) return refuse("a number", value);
      part.*(*real) = value.template get<double>();
    } else if (const auto* whole = std::get_if<int Part::*>(&place)) {
      if (!is_in(value, low, high, true)) return refuse("a whole number", value);
      part.*(*whole) = static_cast<int>(value.template get<double>());
    } else {
      auto& list = part.*std::get<std::vector<std::uint8_t> Part::*>(place);
      if (!value.is_array() || value.size() > kMostJitter) return refuse("a list of at most 1000 whole numbers", value);
      list.clear();
      for (const Json& entry : value) {
        if (!is_in(entry, low, high, true)) return refuse("a list of whole numbers", entry);
        list.push_back(static_cast<std::uint8_t>(entry.get<double>()));
      }
    }
  }
  return {};
}

Result<std::string> read_text(const std::filesystem::path& file, const std::string& shown) {
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  if (!std::filesystem::exists(status)) return fail(Errc::NotFound, shown + ": no such file");
  if (std::filesystem::is_directory(status)) return fail(Errc::Io, shown + ": is a folder");
  std::ifstream stream(file, std::ios::binary);
  std::string words(kLargest + 1, '\0');
  if (!stream || (!stream.read(words.data(), static_cast<std::streamsize>(words.size())) && !stream.eof()))
    return fail(Errc::Io, shown + ": cannot be read");
  words.resize(static_cast<std::size_t>(stream.gcount()));
  if (words.size() > kLargest)
    return fail(Errc::Io, shown + ": larger than 1 MiB, which no file of this kind should be");
  return words;
}

}  // namespace

Result<PlantFile> read_plant_file(const std::filesystem::path& file) {
  const std::string shown = printable(file.string());
  RELIEF_TRY(const std::string words, read_text(file, shown));
  const Json all = Json::parse(words, nullptr, false);
  if (!all.is_object())
    return fail(Errc::Corrupt, shown + ": must be a JSON object with \"like\", \"plant\", \"device\" and \"hand\"");
  PlantFile read = {.preset = plant_presets().front(), .hand = {}};
  for (const auto& [key, value] : all.items()) {
    if (key == "plant" || key == "device" || key == "hand") continue;
    if (key != "like")
      return fail(Errc::Corrupt, shown + ": may have \"like\", \"plant\", \"device\" and \"hand\", but not " +
                                     printable(text(Json(key))));
    const auto preset = std::ranges::find_if(
        plant_presets(), [&](const PlantPreset& p) { return value.is_string() && value == std::string(p.name); });
    if (preset == plant_presets().end()) {
      std::string known;
      for (const PlantPreset& p : plant_presets()) known.append(known.empty() ? "" : ", ").append(p.name);
      return fail(Errc::Corrupt, shown + ": \"like\" must be one of " + known + ", and is " + printable(text(value)));
    }
    read.preset = *preset;
  }
  RELIEF_CHECK(read_part<Plant>(all, "plant", kPlant, read.preset.plant, shown));
  RELIEF_CHECK(read_part<DeviceInfo>(all, "device", kDevice, read.preset.info, shown));
  RELIEF_CHECK(read_part<Hand>(all, "hand", kHand, read.hand, shown));
  return read;
}

}  // namespace relief::detail
