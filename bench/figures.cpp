#include "figures.h"

#include "compare.h"

#include <fmt/format.h>

#include <cmath>
#include <string_view>
#include <vector>

namespace relief::bench {

namespace {

using nlohmann::ordered_json;

std::string goal_text(const ordered_json& figure) {
  if (!figure.contains("goal")) return "";
  const auto goal = figure["goal"].items().begin();
  return fmt::format("{} {:g}{}", goal.key() == "at_most" ? "at most" : "at least", goal.value().get<double>(),
                     figure["met"].get<bool>() ? "" : ", MISSED");
}

std::string value_text(const ordered_json& figure) {
  const double value = figure["value"].get<double>();
  if (figure["unit"] == "bytes") return fmt::format("{:.0f}", value);
  const bool is_tiny = value != 0 && std::abs(value) < 0.005;
  return is_tiny ? fmt::format("{:.1e}", value) : fmt::format("{:.2f}", value);
}

std::string percentiles_text(const ordered_json& figure) {
  std::string all;
  if (figure.contains("percentiles"))
    for (const auto& [which, number] : figure["percentiles"].items())
      all += fmt::format("{}{:.2f}", all.empty() ? "" : "/", number.get<double>());
  return all;
}

std::string more_text(const ordered_json& figure) {
  std::string all;
  if (figure.contains("more"))
    for (const auto& [what, number] : figure["more"].items())
      all += fmt::format("{}{} {:.6g}", all.empty() ? "" : ", ", what, number.get<double>());
  return all;
}

}  // namespace

ordered_json figure(const std::string& name, const std::string& surface, double value, const char* unit, Goal goal,
                    const char* clock) {
  ordered_json row = {{"name", name}, {"surface", surface}, {"value", value}, {"unit", unit}, {"clock", clock}};
  if (goal.kind != nullptr) {
    row["goal"] = {{goal.kind, goal.value}};
    row["met"] = goal.kind == std::string_view("at_most") ? value <= goal.value : value >= goal.value;
  }
  return row;
}

ordered_json to_json(const Machine& machine) {
  return {{"processor", machine.processor},
          {"cores", machine.cores},
          {"level_2_cache_bytes", machine.core_cache},
          {"last_level_cache_bytes", machine.last_level_cache}};
}

std::string figures_table(const ordered_json& figures) {
  std::vector<std::vector<std::string>> rows = {{"", "on", "is", "", "goal", "clock", "p50/p90/p99/p99.9/max"}};
  for (const ordered_json& f : figures)
    rows.push_back({f["name"].get<std::string>(), f["surface"].get<std::string>(), value_text(f),
                    f["unit"].get<std::string>(), goal_text(f), f["clock"].get<std::string>(), percentiles_text(f),
                    more_text(f)});
  return aligned(rows);
}

}  // namespace relief::bench
