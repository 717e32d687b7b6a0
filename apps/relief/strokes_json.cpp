// Strokes from a JSON file.
#include "commands.h"

#include <relief/base/try.h>

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <optional>

namespace relief::cli {

namespace {

using nlohmann::json;

/// Reads the fields of one stroke; the first problem is kept as a sentence that names stroke and field.
class StrokeReader {
 public:
  StrokeReader(const json& object, std::string place) : object_(object), place_(std::move(place)) {}

  Result<Stroke> read() {
    if (!object_.is_object()) return problem("is no object");
    for (const auto& [key, value] : object_.items())
      if (key != "tool" && key != "radius" && key != "strength" && key != "colour" && key != "points" &&
          key != "label" && key != "resilience")
        return problem(
            fmt::format("has the unknown field \"{}\"; known are tool, radius, strength, colour, points, label, "
                        "resilience",
                        printable(key, 40)));
    Stroke stroke;
    const auto tool = object_.find("tool");
    if (tool == object_.end() || !tool->is_string()) return problem("needs a \"tool\": carve, deposit or paint");
    const auto known = tool_from_name(tool->get_ref<const std::string&>());
    if (!known)
      return problem(fmt::format("names the unknown tool \"{}\"; known are carve, deposit, paint",
                                 printable(tool->get_ref<const std::string&>(), 40)));
    stroke.brush.tool = *known;
    RELIEF_TRY(stroke.brush.radius, number("radius", std::nullopt));
    RELIEF_TRY(stroke.brush.strength, number("strength", 1.0));
    RELIEF_TRY(stroke.brush.resilience, number("resilience", 0.0));
    if (const auto label = object_.find("label"); label != object_.end()) {
      if (!label->is_string()) return problem("has a \"label\" that is no text");
      stroke.label = label->get<std::string>();
    }
    if (const auto colour = object_.find("colour"); colour != object_.end()) {
      std::array<double, 3> rgb{};
      if (!numbers(*colour, rgb)) return problem("has a \"colour\" that is not three numbers 0..255");
      for (const double c : rgb)
        if (!(c >= 0 && c <= 255)) return problem("has a \"colour\" outside 0..255");
      stroke.brush.colour = to_float(Vec3d{rgb[0], rgb[1], rgb[2]} / 255.0);
    } else if (stroke.brush.tool == Tool::Paint) {
      return problem("paints, so it needs a \"colour\": three numbers 0..255");
    }
    const auto points = object_.find("points");
    if (points == object_.end() || !points->is_array() || points->empty())
      return problem("needs \"points\": a list of [t, x, y, z, pressure]");
    for (std::size_t k = 0; k < points->size(); ++k) {
      std::array<double, 5> p{};
      if (!numbers((*points)[k], p))
        return problem(fmt::format("point {} is not five numbers [t, x, y, z, pressure]", k + 1));
      stroke.points.push_back({p[0], {p[1], p[2], p[3]}, p[4]});
    }
    if (const Status sound = check(stroke); !sound) return problem(sound.error().message);
    return stroke;
  }

 private:
  std::unexpected<Error> problem(std::string_view what) const {
    return fail(Errc::Corrupt, fmt::format("{}: {}", place_, what));
  }
  Result<double> number(const char* key, std::optional<double> fallback) const {
    const auto value = object_.find(key);
    if (value == object_.end()) {
      if (fallback) return *fallback;
      return problem(fmt::format("needs a \"{}\"", key));
    }
    if (!value->is_number()) return problem(fmt::format("has a \"{}\" that is no number", key));
    return value->get<double>();
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

}  // namespace

Result<std::vector<Stroke>> read_strokes(const std::filesystem::path& file) {
  RELIEF_TRY(const std::string text, read_text(file, std::uintmax_t{1} << 30U));
  const std::string shown = printable(file.string());
  json parsed;
  try {
    parsed = json::parse(text);
  } catch (const json::exception& error) {
    // The library's message starts with its own code in brackets.
    std::string_view what = error.what();
    if (const std::size_t end = what.find("] "); end != std::string_view::npos) what.remove_prefix(end + 2);
    return fail(Errc::Corrupt, fmt::format("{}: no valid JSON: {}", shown, printable(what, 200)));
  }
  if (!parsed.is_array()) return fail(Errc::Corrupt, shown + ": a strokes file is a list [...] of strokes");
  std::vector<Stroke> strokes;
  for (std::size_t k = 0; k < parsed.size(); ++k) {
    RELIEF_TRY(Stroke stroke, StrokeReader(parsed[k], fmt::format("{}: stroke {}", shown, k + 1)).read());
    strokes.push_back(std::move(stroke));
  }
  return strokes;
}

}  // namespace relief::cli
