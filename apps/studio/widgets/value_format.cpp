#include "value_format.h"

#include <QLocale>
#include <QRegularExpression>
#include <algorithm>
#include <array>
#include <cmath>

namespace relief::studio {

namespace {

/// A number as the user's language writes it, or with a decimal point. No grouping, so that "1,234" is never 1234 in
/// one language and 1.234 in the next.
std::optional<double> number(const QString& text) {
  QString plain = text.trimmed();
  plain.replace(QLocale().decimalPoint(), QStringLiteral("."));
  if (!plain.contains(u'.')) plain.replace(u',', u'.');
  bool ok = false;
  const double value = QLocale::c().toDouble(plain, &ok);
  return ok && std::isfinite(value) ? std::optional(value) : std::nullopt;
}

struct Typed {
  double value;
  QString unit;
};

std::optional<Typed> number_and_unit(const QString& text) {
  static const QRegularExpression form(QStringLiteral("^\\s*([-+]?[0-9.,]+(?:[eE][-+]?[0-9]+)?)\\s*(\\D*)$"));
  const auto match = form.match(text);
  if (!match.hasMatch()) return std::nullopt;
  const auto value = number(match.captured(1));
  if (!value) return std::nullopt;
  return Typed{*value, match.captured(2).trimmed()};
}

QString written(double value, int decimals) {
  QLocale locale;
  locale.setNumberOptions(QLocale::OmitGroupSeparator);
  return locale.toString(value, 'f', decimals);
}

/// Decimals that leave three significant digits, at most three, and no zeros at the end beyond the first.
int decimals_of_length(double value) {
  const double size = std::abs(value);
  if (size >= 100) return 0;
  const int most = size >= 10 || size == 0 ? 1 : size >= 1 ? 2 : 3;
  for (int decimals = 1; decimals < most; ++decimals) {
    const double scale = std::pow(10, decimals);
    if (std::abs(std::round(value * scale) / scale - value) < 0.5 * std::pow(10, -most)) return decimals;
  }
  return most;
}

/// Millimetres in a unit; 0 where it is not known.
double millimetres(const QString& unit) {
  struct Known {
    QStringView name;
    double size;
  };
  static constexpr std::array kKnown = {Known{u"µm", 1e-3}, Known{u"um", 1e-3}, Known{u"mm", 1},
                                        Known{u"cm", 10},   Known{u"m", 1e3},   Known{u"in", 25.4}};
  const auto* found = std::ranges::find(kKnown, QStringView(unit), &Known::name);
  return found == kKnown.end() ? 0 : found->size;
}

std::optional<double> parse_with(const QString& typed, const QString& unit) {
  const auto parts = number_and_unit(typed);
  return parts && (parts->unit.isEmpty() || parts->unit == unit) ? std::optional(parts->value) : std::nullopt;
}

}  // namespace

ValueFormat plain_format(int decimals) {
  return {.text = [decimals](double value) { return written(value, decimals); },
          .parse = [](const QString& typed) { return parse_with(typed, {}); },
          .example = written(1.5, decimals)};
}

ValueFormat percent_format(int decimals) {
  return {.text = [decimals](double value) { return written(100 * value, decimals) + QStringLiteral(" %"); },
          .parse = [](const QString& typed) -> std::optional<double> {
            const auto value = parse_with(typed, QStringLiteral("%"));
            return value ? std::optional(*value / 100) : std::nullopt;
          },
          .example = written(60, decimals) + QStringLiteral(" %")};
}

ValueFormat degree_format() {
  return {.text = [](double value) { return written(value, 0) + u'°'; },
          .parse = [](const QString& typed) { return parse_with(typed, QStringLiteral("°")); },
          .example = QStringLiteral("45°")};
}

ValueFormat length_format(const QString& unit) {
  const auto text = [unit](double value) {
    const QString plain = written(value, decimals_of_length(value));
    return unit.isEmpty() ? plain : plain + u' ' + unit;
  };
  const auto parse = [unit](const QString& typed) -> std::optional<double> {
    const auto parts = number_and_unit(typed);
    if (!parts) return std::nullopt;
    if (parts->unit.isEmpty() || parts->unit == unit) return parts->value;
    const double theirs = millimetres(parts->unit), ours = millimetres(unit);
    return theirs > 0 && ours > 0 ? std::optional(parts->value * theirs / ours) : std::nullopt;
  };
  return {.text = text, .parse = parse, .example = text(8.5)};
}

}  // namespace relief::studio
