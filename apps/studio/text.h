// Between the library's words and numbers and Qt's.
#pragma once

#include <relief/base/error.h>
#include <relief/base/unit.h>
#include <relief/base/vec.h>

#include <QString>
#include <filesystem>
#include <string>
#include <string_view>

namespace relief::studio {

[[nodiscard]] inline QString text(std::string_view utf8) {
  return QString::fromUtf8(utf8.data(), static_cast<qsizetype>(utf8.size()));
}
[[nodiscard]] inline QString text(const std::string& utf8) { return QString::fromStdString(utf8); }
[[nodiscard]] inline QString text(const std::filesystem::path& file) { return text(file.native()); }
[[nodiscard]] inline std::filesystem::path path(const QString& file) { return file.toUtf8().toStdString(); }

/// A length in model units as people read it: three significant digits and the unit, "8.5 mm".
[[nodiscard]] QString length_text(double length, Unit unit);
/// A place as rounded_place() has it: "(12.3, -4.5, 0) mm"; with semicolons where commas are decimal points. `across`:
/// the model's diagonal.
[[nodiscard]] QString place_text(const Vec3d& place, double across, Unit unit);
/// A share as people read it: "60 %".
[[nodiscard]] QString percent_text(double share);
/// A sample model by its name in the library: "Pumpkin".
[[nodiscard]] QString sample_title(const QString& name);
/// A content hash as the command line writes it: 16 hexadecimal digits.
[[nodiscard]] inline QString hash_text(quint64 hash) {
  return QStringLiteral("%1").arg(hash, 16, 16, QLatin1Char('0'));
}
/// "3 minutes ago".
[[nodiscard]] QString ago_text(qint64 seconds);

/// A note of a conversion or a file in the user's language. Numbers with their units, places in brackets and names in
/// quotation marks are kept; what stands around them is looked up, as a whole or else before and behind the first
/// colon. Words that nobody has translated stay as they are.
[[nodiscard]] QString note_text(const std::string& note);
/// A failure in the user's language. The library's sentence is English: for people who read another language, what kind
/// of failure it is stands before it.
[[nodiscard]] QString error_text(const Error& error);

}  // namespace relief::studio
