#include <relief/base/assert.h>
#include <relief/edit/tools.h>

#include <algorithm>
#include <cmath>

namespace relief {

namespace {

using Kind = SettingInfo::Kind;
using Unit = SettingInfo::Unit;

constexpr std::array<std::string_view, 4> kFalloffs = {"own", "linear", "smooth", "dome"};
constexpr std::array<std::string_view, 8> kSymmetries = {"none", "x", "y", "xy", "z", "xz", "yz", "xyz"};

constexpr std::array<std::string_view, 3> kDriven = {"strength", "radius", "both"};

constexpr SettingInfo kRadius = {.id = "radius", .title = "Radius", .unit = Unit::Length, .pressure_may_drive = true};
constexpr SettingInfo kStrength = {
    .id = "strength", .title = "Strength", .unit = Unit::Percent, .preset = 0.5, .pressure_may_drive = true};
constexpr SettingInfo kFalloff = {
    .id = "falloff", .title = "Fall-off", .kind = Kind::Choice, .max = 3, .step = 1, .choices = kFalloffs};
constexpr SettingInfo kPressure = {.id = "pressure_curve", .title = "Pressure", .kind = Kind::Curve};
constexpr SettingInfo kDrives = {
    .id = "pressure_drives", .title = "Pressure drives", .kind = Kind::Choice, .max = 2, .step = 1, .choices = kDriven};
constexpr SettingInfo kStabiliser = {.id = "stabiliser", .title = "Stabiliser", .unit = Unit::Length};
constexpr SettingInfo kSymmetry = {
    .id = "symmetry", .title = "Symmetry", .kind = Kind::Choice, .max = 7, .step = 1, .choices = kSymmetries};
constexpr SettingInfo kResilience = {.id = "resilience", .title = "Resilience", .unit = Unit::Length};
constexpr SettingInfo kExact = {.id = "exact", .title = "Exact cut", .kind = Kind::Switch, .step = 1};
constexpr SettingInfo kHeight = {.id = "height", .title = "Height", .unit = Unit::Length};
constexpr SettingInfo kSpacing = {.id = "detail",
                                  .title = "Sample spacing",
                                  .help =
                                      "The grid becomes as fine as this part of the radius under a tool. "
                                      "0 leaves it as it is.",
                                  .unit = Unit::Radii,
                                  .max = kCoarsestDetail,
                                  .step = 0.005,
                                  .preset = kDetail};
constexpr SettingInfo kColour = {.id = "colour", .title = "Colour", .kind = Kind::Colour};

constexpr std::array kOfAll = {kRadius, kStrength, kFalloff, kSpacing, kPressure, kDrives, kStabiliser, kSymmetry};
constexpr std::array kOfCarve = {kRadius,   kStrength, kResilience, kExact,   kSpacing,
                                 kPressure, kDrives,   kStabiliser, kSymmetry};
constexpr std::array kOfLayer = {kRadius,   kStrength, kHeight,     kFalloff, kSpacing,
                                 kPressure, kDrives,   kStabiliser, kSymmetry};
constexpr std::array kOfPaint = {kRadius,   kStrength, kColour,     kFalloff, kSpacing,
                                 kPressure, kDrives,   kStabiliser, kSymmetry};

// Rates are 1/s. The slow ones let a hand follow. Cover at 12/s is 70 % there after 0.1 s, the time in which a 5 mm
// brush at 50 mm/s passes its own radius. Even at 60/s mixes a sample with its neighbours by a third per 8 ms; from
// 250/s on it would overshoot.
constexpr std::array kTools = {
    ToolInfo{.id = "carve",
             .title = "Carve",
             .help = "Cuts with a ball, strength x pressure x radius deep.",
             .key = "C",
             .opposite = "deposit",
             .action = Action::Cut,
             .settings = kOfCarve},
    ToolInfo{.id = "deposit",
             .title = "Deposit",
             .help = "Lays on material while it is held, whatever the pressure.",
             .key = "D",
             .opposite = "carve",
             .action = Action::Raise,
             .falloff = Falloff::Linear,
             .by_pressure = false,
             .settings = kOfAll},
    ToolInfo{.id = "paint",
             .title = "Paint",
             .help = "Colours the surface.",
             .key = "B",
             .writes = Layer::Colour,
             .action = Action::Cover,
             .falloff = Falloff::Linear,
             .rate = 12,
             .settings = kOfPaint},
    ToolInfo{.id = "smooth",
             .title = "Smooth",
             .help = "Takes out bumps and grain.",
             .key = "S",
             .action = Action::Even,
             .rate = 60,
             .settings = kOfAll},
    ToolInfo{.id = "flatten",
             .title = "Flatten",
             .help = "Lowers hills and fills hollows to one plane.",
             .key = "Shift+T",
             .action = Action::Plane,
             .rate = 12,
             .settings = kOfAll},
    ToolInfo{.id = "inflate",
             .title = "Inflate",
             .help = "Swells the surface outwards everywhere under the tool.",
             .key = "I",
             .action = Action::Swell,
             .settings = kOfAll},
    ToolInfo{.id = "clay",
             .title = "Clay",
             .help = "Builds up flat layers of clay: fills hollows first.",
             .key = "Shift+D",
             .action = Action::Plane,
             .rate = 12,
             .value = 0.1,
             .lowers = false,
             .settings = kOfAll},
    ToolInfo{.id = "layer",
             .title = "Layer",
             .help = "Raises the surface by one even height, however often the stroke crosses itself.",
             .key = "L",
             .opposite = "layer",
             .action = Action::Cover,
             .rate = 12,
             .by_height = true,
             .settings = kOfLayer},
    ToolInfo{.id = "mask",
             .title = "Mask",
             .help = "Protects the surface from all tools.",
             .key = "M",
             .opposite = "unmask",
             .writes = Layer::Mask,
             .action = Action::Cover,
             .rate = 12,
             .value = 1,
             .settings = kOfAll},
    ToolInfo{.id = "unmask",
             .title = "Unmask",
             .help = "Takes the protection away again.",
             .key = "Shift+M",
             .opposite = "mask",
             .writes = Layer::Mask,
             .action = Action::Cover,
             .rate = 12,
             .value = 0,
             .settings = kOfAll},
};
static_assert(kTools[static_cast<std::size_t>(Tool::Unmask)].id == "unmask");

/// Returns the number in the brush that a setting stands for; null for those that are no plain number.
template <typename B>
auto number_of(B& brush, std::string_view id) noexcept -> decltype(&brush.radius) {
  if (id == kRadius.id) return &brush.radius;
  if (id == kStrength.id) return &brush.strength;
  if (id == kResilience.id) return &brush.resilience;
  if (id == kHeight.id) return &brush.height;
  if (id == kStabiliser.id) return &brush.stabiliser;
  if (id == kSpacing.id) return &brush.detail;
  return nullptr;
}

}  // namespace

std::string_view name(Falloff falloff) noexcept { return kFalloffs[static_cast<std::size_t>(falloff)]; }

std::optional<Falloff> falloff_from_name(std::string_view text) noexcept {
  const auto at = std::ranges::find(kFalloffs, text);
  if (at == kFalloffs.end()) return std::nullopt;
  return static_cast<Falloff>(at - kFalloffs.begin());
}

std::string_view name(PressureDrives drives) noexcept { return kDriven[static_cast<std::size_t>(drives)]; }

std::optional<PressureDrives> pressure_drives_from_name(std::string_view text) noexcept {
  const auto at = std::ranges::find(kDriven, text);
  if (at == kDriven.end()) return std::nullopt;
  return static_cast<PressureDrives>(at - kDriven.begin());
}

double PressureCurve::operator()(double pressure) const noexcept {
  const double share = std::clamp((pressure - low) / (high - low), 0.0, 1.0);
  return exponent == 1 ? share : std::pow(share, exponent);
}

std::span<const ToolInfo> tools() noexcept { return kTools; }

const ToolInfo& info(Tool tool) noexcept {
  RELIEF_ASSERT(static_cast<std::size_t>(tool) < kTools.size());
  return kTools[static_cast<std::size_t>(tool)];
}

std::string_view name(Tool tool) noexcept { return info(tool).id; }

std::optional<Tool> tool_from_name(std::string_view text) noexcept {
  const auto at = std::ranges::find(kTools, text, &ToolInfo::id);
  if (at == kTools.end()) return std::nullopt;
  return static_cast<Tool>(at - kTools.begin());
}

std::vector<std::string_view> tool_ids() {
  std::vector<std::string_view> ids;
  for (const ToolInfo& tool : kTools) ids.push_back(tool.id);
  return ids;
}

std::string tool_names() {
  std::string names;
  for (const ToolInfo& tool : kTools) names += (names.empty() ? "" : ", ") + std::string(tool.id);
  return names;
}

std::optional<double> setting(const Brush& brush, std::string_view id) noexcept {
  if (const double* number = number_of(brush, id)) return *number;
  if (id == kExact.id) return brush.exact ? 1.0 : 0.0;
  if (id == kFalloff.id) return static_cast<double>(brush.falloff);
  if (id == kDrives.id) return static_cast<double>(brush.pressure_drives);
  if (id == kSymmetry.id) return static_cast<double>(brush.symmetry);
  return std::nullopt;
}

bool set(Brush& brush, std::string_view id, double value) noexcept {
  if (double* number = number_of(brush, id)) {
    *number = value;
    return true;
  }
  const auto choice = static_cast<std::uint8_t>(std::clamp(value, 0.0, 255.0));
  if (id == kExact.id)
    brush.exact = value != 0;
  else if (id == kFalloff.id)
    brush.falloff = static_cast<Falloff>(std::min<std::uint8_t>(choice, kFalloffs.size() - 1));
  else if (id == kDrives.id)
    brush.pressure_drives = static_cast<PressureDrives>(std::min<std::uint8_t>(choice, kDriven.size() - 1));
  else if (id == kSymmetry.id)
    brush.symmetry = std::min<std::uint8_t>(choice, kSymmetries.size() - 1);
  else
    return false;
  return true;
}

}  // namespace relief
