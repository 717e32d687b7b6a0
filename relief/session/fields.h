// What ticks, settings and edits are made of, number by number: the one place that says what a recording holds.
// A new field is one line here. Recordings without it read as its default; see docs/reference/recording.md.
#pragma once

#include <relief/edit/stroke.h>
#include <relief/file/recording.h>
#include <relief/haptics/servo.h>
#include <relief/session/document.h>
#include <relief/session/replay.h>

#include <array>
#include <concepts>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace relief::detail {

/// Inputs are what Servo::step() is given, outputs what it must give again; clocks are measured.
enum class Role : std::uint8_t { Input, Output, Clock };
[[nodiscard]] constexpr std::string_view name(Role role) noexcept {
  return role == Role::Input ? "input" : role == Role::Output ? "output" : "clock";
}

struct Field {
  std::string_view name, unit;
  Role role = Role::Input;
};

template <typename T, typename U>
concept Is = std::same_as<std::remove_const_t<T>, U>;

inline constexpr std::string_view kUnits = "model units";

// The sizes are a reminder: whoever adds a field to one of these adds a line below.
static_assert(sizeof(DeviceState) == 184 && sizeof(ServoSample) == 280 && sizeof(ServoSettings) == 208 &&
              sizeof(DeviceInfo) == 272 && sizeof(Brush) == 144 && sizeof(Dab) == 136);

template <Is<RecordedTick> T, typename Visit>
void for_each_field(T& tick, Visit&& visit) {
  auto& in = tick.reading;
  auto& out = tick.sample;
  visit(Field{"t", "s"}, in.t);
  visit(Field{"device", "m"}, in.position);
  visit(Field{"device_velocity", "m/s"}, in.velocity);
  visit(Field{"has_velocity", ""}, in.has_velocity);
  visit(Field{"device_orientation", ""}, in.orientation);
  visit(Field{"has_orientation", ""}, in.has_orientation);
  visit(Field{"device_angular_velocity", "rad/s"}, in.angular_velocity);
  visit(Field{"has_angular_velocity", ""}, in.has_angular_velocity);
  visit(Field{"gripper", "m"}, in.gripper);
  visit(Field{"gripper_force", "N"}, in.gripper_force);
  visit(Field{"has_gripper", ""}, in.has_gripper);
  visit(Field{"pressure", ""}, in.pressure);
  visit(Field{"has_pressure", ""}, in.has_pressure);
  visit(Field{"forces_off", ""}, in.forces_off);
  visit(Field{"buttons", ""}, in.buttons);
  visit(Field{"pressed", ""}, in.pressed);
  visit(Field{"released", ""}, in.released);
  visit(Field{"settings", ""}, tick.settings);
  visit(Field{"model", ""}, tick.model);
  visit(Field{"cursor", kUnits, Role::Output}, out.cursor);
  visit(Field{"velocity", "m/s", Role::Output}, out.velocity);
  visit(Field{"contact", "", Role::Output}, out.contact);
  visit(Field{"slab", "", Role::Output}, out.at.slab);
  visit(Field{"u", "", Role::Output}, out.at.u);
  visit(Field{"v", "", Role::Output}, out.at.v);
  visit(Field{"alpha", "", Role::Output}, out.at.alpha);
  visit(Field{"depth", kUnits, Role::Output}, out.depth);
  visit(Field{"contact_point", kUnits, Role::Output}, out.contact_point);
  visit(Field{"normal", "", Role::Output}, out.normal);
  visit(Field{"force", "N", Role::Output}, out.force);
  visit(Field{"torque", "N*m", Role::Output}, out.torque);
  visit(Field{"orientation", "", Role::Output}, out.orientation);
  visit(Field{"leak", "J", Role::Output}, out.leak);
  visit(Field{"held_buttons", "", Role::Output}, out.buttons);
  visit(Field{"flags", "", Role::Output}, out.flags);
  visit(Field{"clock", "ns", Role::Clock}, tick.clock_ns);
  visit(Field{"compute", "ns", Role::Clock}, out.compute_ns);
  visit(Field{"late", "ns", Role::Clock}, out.late_ns);
}

template <Is<ServoSettings> T, typename Visit>
void for_each_field(T& settings, Visit&& visit) {
  visit(Field{"metres_per_unit", "m"}, settings.workspace.metres_per_unit);
  visit(Field{"device_origin", "m"}, settings.workspace.device_origin);
  visit(Field{"model_origin", kUnits}, settings.workspace.model_origin);
  visit(Field{"stiffness", "N/m"}, settings.force.stiffness);
  visit(Field{"damping", "N*s/m"}, settings.force.damping);
  visit(Field{"friction", ""}, settings.force.friction);
  visit(Field{"static_friction", ""}, settings.force.static_friction);
  visit(Field{"max_force", "N"}, settings.force.max_force);
  visit(Field{"exact_normals", ""}, settings.force.exact_normals);
  visit(Field{"paper_contact", ""}, settings.force.paper_contact);
  visit(Field{"guard", ""}, settings.force.guard);
  visit(Field{"tool_radius", kUnits}, settings.tool.radius);
  visit(Field{"rotation", ""}, settings.workspace.rotation);
  visit(Field{"debounce", "s"}, settings.readings.debounce);
  visit(Field{"clutch", ""}, settings.clutch.held);
  visit(Field{"clutch_buttons", ""}, settings.clutch.buttons);
  visit(Field{"recentre", ""}, settings.clutch.recentre);
  visit(Field{"centre", kUnits}, settings.clutch.centre);
}

/// Returns one of the points of a rigid tool, in the tool's frame.
template <Is<Vec3d> T, typename Visit>
void for_each_field(T& point, Visit&& visit) {
  visit(Field{"point", kUnits}, point);
}

/// Returns what is text is a fact of the recording.
template <Is<DeviceInfo> T, typename Visit>
void for_each_field(T& device, Visit&& visit) {
  visit(Field{"max_force", "N"}, device.max_force);
  visit(Field{"max_stiffness", "N/m"}, device.max_stiffness);
  visit(Field{"max_damping", "N*s/m"}, device.max_damping);
  visit(Field{"max_force_rate", "N/s"}, device.max_force_rate);
  visit(Field{"max_torque", "N*m"}, device.max_torque);
  visit(Field{"continuous_force", "N"}, device.continuous_force);
  visit(Field{"max_work", "J"}, device.max_work);
  visit(Field{"max_speed", "m/s"}, device.max_speed);
  visit(Field{"delay_ticks", ""}, device.delay_ticks);
  visit(Field{"delay", "s"}, device.delay);
  visit(Field{"workspace_radius", "m"}, device.workspace_radius);
  visit(Field{"workspace_low", "m"}, device.workspace.low);
  visit(Field{"workspace_high", "m"}, device.workspace.high);
  visit(Field{"rate", "Hz"}, device.rate);
  visit(Field{"sensed_positions", ""}, device.sensed.position);
  visit(Field{"sensed_rotations", ""}, device.sensed.rotation);
  visit(Field{"sensed_grippers", ""}, device.sensed.gripper);
  visit(Field{"actuated_positions", ""}, device.actuated.position);
  visit(Field{"actuated_rotations", ""}, device.actuated.rotation);
  visit(Field{"actuated_grippers", ""}, device.actuated.gripper);
  visit(Field{"handedness", ""}, device.handedness);
  visit(Field{"gravity", ""}, device.gravity);
  visit(Field{"absolute", ""}, device.absolute);
  visit(Field{"pull", ""}, device.pull);
}

template <Is<Brush> T, typename Visit>
void for_each_field(T& brush, Visit&& visit) {
  visit(Field{"tool", ""}, brush.tool);
  visit(Field{"radius", kUnits}, brush.radius);
  visit(Field{"strength", ""}, brush.strength);
  visit(Field{"colour", ""}, brush.colour);
  visit(Field{"resilience", kUnits}, brush.resilience);
  visit(Field{"height", kUnits}, brush.height);
  visit(Field{"falloff", ""}, brush.falloff);
  visit(Field{"exact", ""}, brush.exact);
  visit(Field{"pressure_low", ""}, brush.pressure.low);
  visit(Field{"pressure_high", ""}, brush.pressure.high);
  visit(Field{"pressure_exponent", ""}, brush.pressure.exponent);
  visit(Field{"pressure_drives", ""}, brush.pressure_drives);
  visit(Field{"stabiliser", kUnits}, brush.stabiliser);
  visit(Field{"detail", "radii"}, brush.detail);
  visit(Field{"symmetry", ""}, brush.symmetry);
  visit(Field{"mirror", kUnits}, brush.mirror);
}

template <Is<Dab> T, typename Visit>
void for_each_field(T& dab, Visit&& visit) {
  visit(Field{"slab", ""}, dab.slab);
  visit(Field{"contact", kUnits}, dab.contact);
  visit(Field{"cursor", kUnits}, dab.cursor);
  visit(Field{"normal", ""}, dab.normal);
  visit(Field{"pressure", ""}, dab.pressure);
  visit(Field{"seconds", "s"}, dab.seconds);
  visit(Field{"from", kUnits}, dab.from);
  visit(Field{"swept", ""}, dab.swept);
  visit(Field{"size", ""}, dab.size);
}

/// Holds what a row without numbers is made of: the end of a stroke.
struct Nothing {};
template <Is<Nothing> T, typename Visit>
void for_each_field(T& /*nothing*/, Visit&& /*visit*/) {}

/// A stroke that was dropped.
struct Cancelled {};
template <Is<Cancelled> T, typename Visit>
void for_each_field(T& /*cancelled*/, Visit&& /*visit*/) {}

/// Undo and redo.
struct Moved {
  std::int32_t steps = 0;  ///< back where negative
};
template <Is<Moved> T, typename Visit>
void for_each_field(T& moved, Visit&& visit) {
  visit(Field{"steps", ""}, moved.steps);
}

/// A part of what a stroke takes away or fills, of the Needed that follows.
struct Solid {
  Capsule shape;
  bool fills = false;  ///< else it is taken away
};
template <Is<Solid> T, typename Visit>
void for_each_field(T& solid, Visit&& visit) {
  visit(Field{"a", kUnits}, solid.shape.a);
  visit(Field{"b", kUnits}, solid.shape.b);
  visit(Field{"radius", kUnits}, solid.shape.radius);
  visit(Field{"axis", ""}, solid.shape.axis);
  visit(Field{"fills", ""}, solid.fills);
}

/// See RoomNeeded: of the solids since the one before.
struct Needed {
  bool ended = false;
};
template <Is<Needed> T, typename Visit>
void for_each_field(T& needed, Visit&& visit) {
  visit(Field{"ended", ""}, needed.ended);
}

template <Is<StrokeAgain> T, typename Visit>
void for_each_field(T& again, Visit&& visit) {
  visit(Field{"on_room", ""}, again.on_room);
}

/// The streams of a recording besides the ticks.
template <typename T>
inline constexpr std::string_view kStream = kTickStream;
template <>
inline constexpr std::string_view kStream<ServoSettings> = "settings";
template <>
inline constexpr std::string_view kStream<Vec3d> = "tool-point";
template <>
inline constexpr std::string_view kStream<DeviceInfo> = "device";
template <>
inline constexpr std::string_view kStream<Brush> = "stroke";
template <>
inline constexpr std::string_view kStream<Dab> = "dab";
template <>
inline constexpr std::string_view kStream<Solid> = "room-solid";
template <>
inline constexpr std::string_view kStream<Needed> = "room";
template <>
inline constexpr std::string_view kStream<StrokeAgain> = "stroke-again";
template <>
inline constexpr std::string_view kStream<Nothing> = "stroke-end";
template <>
inline constexpr std::string_view kStream<Cancelled> = "stroke-cancel";
template <>
inline constexpr std::string_view kStream<Moved> = "history";

// ---- From fields to numbers

template <typename T>
constexpr NumberType type_of() noexcept {
  if constexpr (std::same_as<T, double>) return NumberType::F64;
  if constexpr (std::same_as<T, float>) return NumberType::F32;
  if constexpr (std::same_as<T, std::uint64_t>) return NumberType::U64;
  if constexpr (std::same_as<T, std::uint32_t>) return NumberType::U32;
  if constexpr (std::same_as<T, std::int32_t>) return NumberType::I32;
  if constexpr (sizeof(T) == 1) return NumberType::U8;  // bool, enumerations
}

/// Calls visit(suffix of the name, number) for the parts of a field: of a quaternion or a vector, or the number itself.
template <typename T, typename Visit>
void for_each_part(T& value, Visit&& visit) {
  if constexpr (requires { value.w; }) visit(".w", value.w);
  if constexpr (requires { value.z; }) {
    visit(".x", value.x);
    visit(".y", value.y);
    visit(".z", value.z);
  } else {
    visit("", value);
  }
}

template <typename T>
[[nodiscard]] RecordingColumns columns_of() {
  RecordingColumns columns;
  const T value{};
  for_each_field(value, [&](const Field& field, const auto& whole) {
    for_each_part(whole, [&]<typename N>(std::string_view suffix, const N& /*number*/) {
      columns.push_back({std::string(field.name).append(suffix), type_of<N>(), std::string(field.unit),
                         std::string(name(field.role))});
    });
  });
  return columns;
}

template <typename T>
void append_row(const T& value, std::vector<std::byte>& row) {
  for_each_field(value, [&](const Field& /*field*/, const auto& whole) {
    for_each_part(whole, [&](std::string_view /*suffix*/, const auto& number) {
      const auto bytes = std::as_bytes(std::span(&number, 1));
      row.insert(row.end(), bytes.begin(), bytes.end());
    });
  });
}

/// Reads rows whose columns may be those of another version.
template <typename T>
class RowReader {
 public:
  RowReader() = default;
  explicit RowReader(const RecordingColumns& columns) {
    const RecordingColumns known = columns_of<T>();
    places_.assign(known.size(), kNowhere);
    std::size_t at = 0;
    for (const RecordingColumn& column : columns) {
      std::size_t k = 0;
      while (k < known.size() && (known[k].name != column.name || known[k].type != column.type)) ++k;
      if (k < known.size())
        places_[k] = at;
      else
        unknown_.push_back(column);
      at += bytes_of(column.type);
    }
    for (std::size_t k = 0; k < known.size(); ++k)
      if (places_[k] == kNowhere) missing_.push_back(known[k]);
  }

  /// Numbers that the recording has not keep their value.
  void read(std::span<const std::byte> row, T& to) const {
    std::size_t k = 0;
    for_each_field(to, [&](const Field& /*field*/, auto& whole) {
      for_each_part(whole, [&]<typename N>(std::string_view /*suffix*/, N& number) {
        const std::size_t at = places_[k++];
        if (at == kNowhere) return;
        if constexpr (std::same_as<N, bool>)
          number = row[at] != std::byte{0};
        else
          std::memcpy(&number, row.data() + at, sizeof number);
      });
    });
  }
  [[nodiscard]] const RecordingColumns& unknown() const noexcept { return unknown_; }
  [[nodiscard]] const RecordingColumns& missing() const noexcept { return missing_; }
  /// Returns whether the recording has number k of columns_of<T>().
  [[nodiscard]] bool has(std::size_t k) const noexcept { return places_[k] != kNowhere; }

 private:
  static constexpr std::size_t kNowhere = ~std::size_t{0};
  std::vector<std::size_t> places_;  ///< in the row, by number of the field's part
  RecordingColumns unknown_, missing_;
};

}  // namespace relief::detail
