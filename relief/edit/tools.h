// The tools as data: what each reads and writes, how it falls off, and the settings that a program shows for it.
#pragma once

#include <relief/core/snapshot.h>

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace relief {

/// A tool's row in tools(). Rows are only ever added, so that files and recordings keep their meaning; a tool that no
/// code names needs no enumerator.
enum class Tool : std::uint8_t { Carve, Deposit, Paint, Smooth, Flatten, Inflate, Clay, Layer, Mask, Unmask };

/// How the effect fades with d, the distance of the surface from the contact in radii; 0 from d = 1 on.
enum class Falloff : std::uint8_t {
  Own,     ///< the one that the tool's row names
  Linear,  ///< 1 - d (paper, Sec. 4.2 and 5)
  Smooth,  ///< (1 - d^2)^2: neither a tip nor a rim
  Dome,    ///< sqrt(1 - d^2)
};
[[nodiscard]] std::string_view name(Falloff falloff) noexcept;
[[nodiscard]] std::optional<Falloff> falloff_from_name(std::string_view text) noexcept;

/// From the hand's pressure to the tool's: 0 up to `low`, 1 from `high` on, between them ((p - low) / (high - low)) to
/// the power `exponent`.
struct PressureCurve {
  /// 0 <= low < high <= 1
  double low = 0, high = 1;
  double exponent = 1;  ///< > 0
  /// Returns what the pressure, 0 to 1, becomes.
  [[nodiscard]] double operator()(double pressure) const noexcept;
  friend bool operator==(const PressureCurve&, const PressureCurve&) noexcept = default;
};

/// What the curve's pressure changes; names as in files.
enum class PressureDrives : std::uint8_t {
  Strength,  ///< how much a dab does, of the tools that know pressure
  Radius,    ///< how wide it is: the radius times the pressure, of all tools
  Both,
};
[[nodiscard]] std::string_view name(PressureDrives drives) noexcept;
[[nodiscard]] std::optional<PressureDrives> pressure_drives_from_name(std::string_view text) noexcept;

/// So many radii from sample to sample a ball is cut to 3 % of its depth, with a smooth rim.
inline constexpr double kDetail = 1.0 / 12;
/// The largest Brush::detail that programs offer; strokes files may have more.
inline constexpr double kCoarsestDetail = 0.5;
/// Where pressure drives the radius, samples under the whole stroke lie as close as a dab of this part of the radius
/// takes them. A quarter would cost 16 times the samples of a plain stroke; this costs four.
inline constexpr double kLightRadius = 0.5;
/// How high Layer rises where nobody says it, in radii of the brush.
inline constexpr double kLayerHeight = 0.1;
/// No tool makes samples lie nearer than this part of the cage's diagonal.
inline constexpr double kFinestDetail = 1e-5;

/// Says how a stroke acts. Lengths in model units.
struct Brush {
  Tool tool = Tool::Carve;   ///< which tool
  double radius = 1;         ///< of the tool's sphere, > 0
  double detail = kDetail;   ///< the largest spacing of samples under the tool, in radii; where it is larger the grid
                             ///< gets finer, down to kFinestDetail; 0: it stays as it is; see kLightRadius
  double strength = 1;       ///< 0..1; see the tools' help
  Vec3f colour = {1, 1, 1};  ///< Paint: sRGB 0..1
  double resilience = 0;     ///< Carve: k, thickness of the band that yields without being cut (paper, Sec. 4.1)
  double height = 0;         ///< Layer: how high it rises, may be negative; 0: kLayerHeight
  Falloff falloff = Falloff::Own;  ///< how the effect ends towards the radius
  bool exact = false;              ///< Carve: the sphere itself, to the sample; its rims show the grid as teeth
  PressureCurve pressure = {};     ///< what pressure does; the identity by default
  PressureDrives pressure_drives = PressureDrives::Strength;  ///< and to what
  double stabiliser = 0;                                      ///< the tool trails the hand by about this length, >= 0
  std::uint8_t symmetry =
      0;                     ///< bit k: each dab also mirrored across the plane through `mirror` whose normal is axis k
  Vec3d mirror = {0, 0, 0};  ///< a point on the mirror planes
  friend bool operator==(const Brush&, const Brush&) noexcept = default;
};

/// One setting of a tool, as a program shows it. Values are read and written by setting() and set().
struct SettingInfo {
  /// How a program shows the setting.
  enum class Kind : std::uint8_t { Value, Switch, Choice, Colour, Curve };
  /// Percent: the value is a share, 0 to 1. Radii: a share of the tool's radius; 0 leaves things as they are.
  enum class Unit : std::uint8_t { None, Length, Percent, Radii };
  /// name in files, and name on the screen
  std::string_view id, title;
  std::string_view help = {};  ///< a sentence or two, where the title does not say it all
  Kind kind = Kind::Value;     ///< what it looks like
  Unit unit = Unit::None;      ///< what its number means
  /// of a length: 0 of all four leaves it to the program
  double min = 0, max = 1, step = 0.01, preset = 0;
  bool pressure_may_drive = false;                 ///< whether the pen may drive it
  std::span<const std::string_view> choices = {};  ///< the names of a choice's values
};

/// What a tool does to the samples under it; the one part that is code (see edit/editor.cpp).
enum class Action : std::uint8_t {
  Cut,    ///< down to where the fibre enters the sphere
  Raise,  ///< along the fibre, by the radius per second
  Swell,  ///< along the surface's own normal, by the radius per second
  Even,   ///< towards the mean of the six neighbours
  Plane,  ///< towards the plane through the mean of what is under the tool
  Cover,  ///< towards a value, from what stood there when the stroke began: several passes never go beyond it
};

/// Holds what a program needs to show a tool.
struct ToolInfo {
  std::string_view id, title, help;  ///< id as in files; title as on a button; help in one sentence
  std::string_view key = {};         ///< that chooses it in a program with a keyboard, as "Shift+T"
  std::string_view opposite = {};    ///< id of the tool that does the reverse, itself where its height has a sign
  relief::Layer writes = relief::Layer::Displacement;  ///< the layer that it changes
  Action action = Action::Raise;                       ///< what it does with that layer
  Falloff falloff = Falloff::Smooth;                   ///< how it ends towards the radius
  double rate = 1;                                     ///< 1/s at strength, pressure and fall-off 1; Cut has none
  double value = 0;         ///< Cover of one channel: the value; Plane: its height above the mean, in radii
  bool by_pressure = true;  ///< whether pressure drives its strength
  bool lowers = true;       ///< Plane: what is above it goes down
  bool raises = true;       ///< Plane: what is below it goes up
  bool by_height = false;   ///< Cover: the value is the sample's own at the start, raised by Brush::height
  std::span<const SettingInfo> settings;  ///< what can be set, in the order of a panel
  /// Samples beyond the slab's border that the action looks at.
  [[nodiscard]] constexpr int halo() const noexcept {
    return action == Action::Even || action == Action::Swell ? 1 : 0;
  }
};

/// Returns all tools, by number.
[[nodiscard]] std::span<const ToolInfo> tools() noexcept;
/// Asserts that there is such a row.
[[nodiscard]] const ToolInfo& info(Tool tool) noexcept;
[[nodiscard]] std::string_view name(Tool tool) noexcept;
[[nodiscard]] std::optional<Tool> tool_from_name(std::string_view text) noexcept;
[[nodiscard]] std::vector<std::string_view> tool_ids();
/// "carve, deposit, paint, ...", for messages.
[[nodiscard]] std::string tool_names();

/// Returns a setting of kind Value, Switch (0 or 1) or Choice (its number) by its id; empty where there is none of that
/// name.
[[nodiscard]] std::optional<double> setting(const Brush& brush, std::string_view id) noexcept;
/// False where there is none of that name.
bool set(Brush& brush, std::string_view id, double value) noexcept;

}  // namespace relief
