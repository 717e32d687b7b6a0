// What a benchmark says: figures, each with its goal beside it, and the table that people read.
#pragma once

#include "machine.h"

#include <nlohmann/json.hpp>

#include <string>

namespace relief::bench {

/// How much is measured. Form: models so small and repeats so few that only the form of the output means something.
enum class Extent { Form, Usual, Long };

struct Goal {
  const char* kind = nullptr;  ///< "at_most" or "at_least"; none
  double value = 0;
};
constexpr Goal at_most(double value) { return {"at_most", value}; }
constexpr Goal at_least(double value) { return {"at_least", value}; }

/// One object: name, surface, value, unit, clock, and where there is a goal, `goal` ({"at_most": x} or {"at_least":
/// x}) and `met`.
[[nodiscard]] nlohmann::ordered_json figure(const std::string& name, const std::string& surface, double value,
                                            const char* unit, Goal goal, const char* clock);

/// What is known of the machine.
[[nodiscard]] nlohmann::ordered_json to_json(const Machine& machine);

/// Figures as lines: what each is, its goal, `MISSED` where it is not met, its clock, its `percentiles`, and `more`,
/// numbers by their names.
[[nodiscard]] std::string figures_table(const nlohmann::ordered_json& figures);

}  // namespace relief::bench
