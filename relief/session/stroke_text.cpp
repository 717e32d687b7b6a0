#include <relief/base/nearest_word.h>
#include <relief/base/try.h>
#include <relief/session/stroke_text.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

namespace relief {

namespace {

using nlohmann::json;
using nlohmann::ordered_json;

constexpr std::array<std::string_view, 17> kFields = {
    "tool",           "radius",          "strength",   "colour",   "points", "label",   "resilience", "height", "exact",
    "pressure_curve", "pressure_drives", "stabiliser", "symmetry", "mirror", "falloff", "tip",        "detail"};
/// What the journal adds to them.
constexpr std::string_view kLimited = "limited";
constexpr std::string_view kAxes = "xyz";

/// "own, linear, smooth", for messages.
template <typename Choices>
std::string names_of(const Choices& all) {
  std::string names;
  for (const auto one : all) names.append(names.empty() ? "" : ", ").append(name(one));
  return names;
}

std::string in_quotes(std::string_view text) { return '"' + printable(text, 40) + '"'; }

/// Reads the fields of one stroke; the first problem is kept as a sentence that names stroke and field.
class StrokeReader {
 public:
  StrokeReader(const json& object, std::string place) : object_(object), place_(std::move(place)) {}

  Result<Stroke> read() {
    if (!object_.is_object()) return problem("is no object");
    RELIEF_CHECK(only_known_fields());
    Stroke stroke;
    Brush& brush = stroke.brush;
    RELIEF_TRY(brush.tool, tool());
    RELIEF_TRY(brush.radius, number(object_, "radius", std::nullopt));
    RELIEF_TRY(brush.strength, number(object_, "strength", brush.strength));
    RELIEF_TRY(brush.resilience, number(object_, "resilience", brush.resilience));
    RELIEF_TRY(brush.height, number(object_, "height", brush.height));
    RELIEF_TRY(brush.stabiliser, number(object_, "stabiliser", brush.stabiliser));
    RELIEF_TRY(brush.detail, number(object_, "detail", brush.detail));
    RELIEF_TRY(brush.exact, flag("exact"));
    RELIEF_TRY(brush.falloff, falloff());
    RELIEF_TRY(brush.symmetry, symmetry());
    RELIEF_TRY(brush.mirror, mirror());
    RELIEF_TRY(brush.pressure, pressure_curve());
    RELIEF_TRY(brush.pressure_drives, pressure_drives());
    RELIEF_TRY(brush.colour, colour(brush));
    RELIEF_TRY(stroke.tip, flag("tip"));
    RELIEF_TRY(stroke.label, text("label"));
    RELIEF_TRY(stroke.points, points());
    if (const Status sound = check(stroke); !sound) return problem(sound.error().message);
    return stroke;
  }

 private:
  std::unexpected<Error> problem(std::string_view what) const {
    return fail(Errc::Corrupt, place_ + ": " + std::string(what));
  }

  [[nodiscard]] Status only_known_fields() const {
    for (const auto& [key, value] : object_.items()) {
      if (key == kLimited || std::ranges::find(kFields, key) != kFields.end()) continue;
      std::string known;
      for (const std::string_view field : kFields) known.append(known.empty() ? "" : ", ").append(field);
      return problem("has the unknown field " + in_quotes(key) + detail::nearest_clause(key, kFields) + "; known are " +
                     known);
    }
    return {};
  }

  [[nodiscard]] Result<Tool> tool() const {
    const auto found = object_.find("tool");
    if (found == object_.end() || !found->is_string())
      return problem("needs a \"tool\", one of " + std::string(tool_names()));
    const auto& said = found->get_ref<const std::string&>();
    const auto known = tool_from_name(said);
    if (known) return *known;
    return problem("names the unknown tool " + in_quotes(said) + detail::nearest_clause(said, tool_ids()) +
                   "; known are " + std::string(tool_names()));
  }

  [[nodiscard]] Result<double> number(const json& object, const char* key, std::optional<double> fallback) const {
    const auto value = object.find(key);
    if (value == object.end()) {
      if (fallback) return *fallback;
      return problem("needs a \"" + std::string(key) + '"');
    }
    if (!value->is_number()) return problem("has a \"" + std::string(key) + "\" that is not a number");
    return value->get<double>();
  }

  [[nodiscard]] Result<bool> flag(const char* key) const {
    const auto value = object_.find(key);
    if (value == object_.end()) return false;
    if (!value->is_boolean()) return problem("has a \"" + std::string(key) + "\" that is not true or false");
    return value->get<bool>();
  }

  [[nodiscard]] Result<std::string> text(const char* key) const {
    const auto value = object_.find(key);
    if (value == object_.end()) return std::string();
    if (!value->is_string()) return problem("has a \"" + std::string(key) + "\" that is no text");
    return value->get<std::string>();
  }

  [[nodiscard]] Result<Falloff> falloff() const {
    RELIEF_TRY(const std::string said, text("falloff"));
    if (said.empty()) return Falloff::Own;
    if (const auto known = falloff_from_name(said)) return *known;
    constexpr std::array kAll = {Falloff::Own, Falloff::Linear, Falloff::Smooth, Falloff::Dome};
    return problem("has the unknown \"falloff\" " + in_quotes(said) + "; known are " + names_of(kAll));
  }

  /// Axes whose planes mirror, each once: "x", "xz".
  [[nodiscard]] Result<std::uint8_t> symmetry() const {
    RELIEF_TRY(const std::string said, text("symmetry"));
    unsigned bits = 0;
    for (const char axis : said) {
      const std::size_t k = kAxes.find(axis);
      if (k == std::string_view::npos || (bits >> k & 1U) != 0)
        return problem("has a \"symmetry\" " + in_quotes(said) + "; it names axes, such as \"x\" or \"xy\"");
      bits |= 1U << k;
    }
    return static_cast<std::uint8_t>(bits);
  }

  [[nodiscard]] Result<Vec3d> mirror() const {
    const auto value = object_.find("mirror");
    if (value == object_.end()) return Vec3d{};
    std::array<double, 3> at{};
    if (!numbers(*value, at)) return problem("has a \"mirror\" that is not three numbers [x, y, z]");
    return Vec3d{at[0], at[1], at[2]};
  }

  [[nodiscard]] Result<PressureCurve> pressure_curve() const {
    PressureCurve curve;
    const auto value = object_.find("pressure_curve");
    if (value == object_.end()) return curve;
    if (!value->is_object()) return problem("has a \"pressure_curve\" that is no object");
    for (const auto& [key, ignored] : value->items())
      if (key != "low" && key != "high" && key != "exponent")
        return problem("has the unknown field " + in_quotes(key) +
                       " in its \"pressure_curve\"; known are low, high, exponent");
    RELIEF_TRY(curve.low, number(*value, "low", curve.low));
    RELIEF_TRY(curve.high, number(*value, "high", curve.high));
    RELIEF_TRY(curve.exponent, number(*value, "exponent", curve.exponent));
    return curve;
  }

  [[nodiscard]] Result<PressureDrives> pressure_drives() const {
    RELIEF_TRY(const std::string said, text("pressure_drives"));
    if (said.empty()) return PressureDrives::Strength;
    if (const auto known = pressure_drives_from_name(said)) return *known;
    constexpr std::array kAll = {PressureDrives::Strength, PressureDrives::Radius, PressureDrives::Both};
    return problem("has the unknown \"pressure_drives\" " + in_quotes(said) + "; known are " + names_of(kAll));
  }

  [[nodiscard]] Result<Vec3f> colour(const Brush& brush) const {
    const auto value = object_.find("colour");
    if (value == object_.end()) {
      if (info(brush.tool).writes != Layer::Colour) return brush.colour;
      return problem("paints, so it needs a \"colour\": three numbers 0..255");
    }
    std::array<double, 3> rgb{};
    if (!numbers(*value, rgb)) return problem("has a \"colour\" that is not three numbers 0..255");
    for (const double c : rgb)
      if (!(c >= 0 && c <= 255)) return problem("has a \"colour\" outside 0..255");
    return to_float(Vec3d{rgb[0], rgb[1], rgb[2]} / 255.0);
  }

  [[nodiscard]] Result<std::vector<StrokePoint>> points() const {
    const auto list = object_.find("points");
    if (list == object_.end() || !list->is_array() || list->empty())
      return problem("needs \"points\": a list of [t, x, y, z, pressure]");
    std::vector<StrokePoint> all;
    all.reserve(list->size());
    for (const json& point : *list) {
      std::array<double, 5> p{};
      if (!numbers(point, p))
        return problem("point " + std::to_string(all.size() + 1) + " is not five numbers [t, x, y, z, pressure]");
      all.push_back({p[0], {p[1], p[2], p[3]}, p[4]});
    }
    return all;
  }

  template <std::size_t N>
  static bool numbers(const json& list, std::array<double, N>& out) {
    if (!list.is_array() || list.size() != N) return false;
    for (std::size_t k = 0; k < N; ++k) {
      if (!list[k].is_number()) return false;
      out[k] = list[k].get<double>();
    }
    return true;
  }

  const json& object_;
  std::string place_;
};

Result<json> parse(std::string_view text, std::string_view place) {
  try {
    return json::parse(text);
  } catch (const json::parse_error& error) {
    // The byte is the last one that was read, from 1.
    const std::string_view read = text.substr(0, std::max<std::size_t>(error.byte, 1) - 1);
    const auto line = 1 + std::ranges::count(read, '\n');
    const std::size_t column = read.size() - (read.find_last_of('\n') + 1) + 1;
    return fail(Errc::Corrupt, std::string(place) + ": line " + std::to_string(line) + ", column " +
                                   std::to_string(column) + ": not JSON");
  } catch (const json::out_of_range&) {
    return fail(Errc::Corrupt, std::string(place) + ": not JSON: a number is too large");
  }
}

ordered_json list_of(Vec3d v) { return {v.x, v.y, v.z}; }

ordered_json json_of(const Stroke& stroke) {
  const Brush plain, &brush = stroke.brush;
  ordered_json object;
  const auto put = [&object](const char* key, const auto& value, const auto& usual) {
    if (value != usual) object[key] = value;
  };
  object["tool"] = name(brush.tool);
  put("label", stroke.label, std::string());
  object["radius"] = brush.radius;
  put("strength", brush.strength, plain.strength);
  // Exact both ways: 24 bits times 8 fit into a double.
  if (brush.colour != plain.colour || info(brush.tool).writes == Layer::Colour)
    object["colour"] = list_of(to_double(brush.colour) * 255.0);
  put("resilience", brush.resilience, plain.resilience);
  put("height", brush.height, plain.height);
  if (brush.falloff != plain.falloff) object["falloff"] = name(brush.falloff);
  put("exact", brush.exact, plain.exact);
  if (brush.pressure != plain.pressure)
    object["pressure_curve"] = {
        {"low", brush.pressure.low}, {"high", brush.pressure.high}, {"exponent", brush.pressure.exponent}};
  if (brush.pressure_drives != plain.pressure_drives) object["pressure_drives"] = name(brush.pressure_drives);
  put("stabiliser", brush.stabiliser, plain.stabiliser);
  put("detail", brush.detail, plain.detail);
  std::string axes;
  for (std::size_t k = 0; k < kAxes.size(); ++k)
    if ((static_cast<unsigned>(brush.symmetry) >> k & 1U) != 0) axes += kAxes[k];
  put("symmetry", axes, std::string());
  if (brush.mirror != plain.mirror) object["mirror"] = list_of(brush.mirror);
  put("tip", stroke.tip, false);
  ordered_json& points = object["points"] = ordered_json::array();
  for (const StrokePoint& p : stroke.points)
    points.push_back({p.t, p.position.x, p.position.y, p.position.z, p.pressure});
  return object;
}

std::string one_line(const ordered_json& object) {
  return object.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

}  // namespace

std::string text_of(const Stroke& stroke) { return one_line(json_of(stroke)); }

std::string journal_text(const Stroke& stroke, const StrokeResult& result) {
  ordered_json object = json_of(stroke);
  if (result.limited > 0) object[std::string(kLimited)] = result.limited;
  return one_line(object);
}

Result<Stroke> stroke_of(std::string_view text, std::string_view place) {
  RELIEF_TRY(const json parsed, parse(text, place));
  return StrokeReader(parsed, std::string(place)).read();
}

Result<std::vector<Stroke>> strokes_of(std::string_view text, std::string_view file) {
  RELIEF_TRY(const json parsed, parse(text, file));
  if (!parsed.is_array()) return fail(Errc::Corrupt, std::string(file) + ": a strokes file is a list [...] of strokes");
  std::vector<Stroke> strokes;
  for (std::size_t k = 0; k < parsed.size(); ++k) {
    const std::string place = std::string(file) + ": stroke " + std::to_string(k + 1);
    RELIEF_TRY(Stroke stroke, StrokeReader(parsed[k], place).read());
    strokes.push_back(std::move(stroke));
  }
  return strokes;
}

}  // namespace relief
