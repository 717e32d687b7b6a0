// How a number is written and read in a control: with its unit, in the user's own way of writing numbers.
#pragma once

#include <QString>
#include <functional>
#include <optional>

namespace relief::studio {

struct ValueFormat {
  std::function<QString(double)> text;
  /// What a person typed, with or without unit; empty where it is no such value.
  std::function<std::optional<double>(const QString&)> parse;
  QString example;  ///< for the hint when parse() fails: "8.5 mm"
};

/// A plain number with so many decimals.
[[nodiscard]] ValueFormat plain_format(int decimals);
/// A share 0..1 with so many decimals, as "60 %".
[[nodiscard]] ValueFormat percent_format(int decimals = 0);
/// Degrees: "12°".
[[nodiscard]] ValueFormat degree_format();
/// A length in the document's unit, three significant digits: "7.5 mm". Reads µm, mm, cm, m and in as well, where the
/// document's unit is one of them.
[[nodiscard]] ValueFormat length_format(const QString& unit);

}  // namespace relief::studio
