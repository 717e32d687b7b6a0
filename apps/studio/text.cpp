#include "text.h"

#include "languages.h"

#include <relief/base/place.h>

#include <QCoreApplication>
#include <QLocale>
#include <QRegularExpression>
#include <QStringList>
#include <algorithm>
#include <cmath>
#include <optional>

namespace relief::studio {

namespace {
struct Text {
  Q_DECLARE_TR_FUNCTIONS(Text)
};
}  // namespace

QString length_text(double length, Unit unit) {
  // Three significant digits, at most six behind the point.
  const double size = std::abs(length) < 5e-7 ? 0 : std::abs(length);
  const int digits = size >= 100 || size == 0 ? 0
                     : size >= 10             ? 1
                     : size >= 1              ? 2
                                              : 2 - static_cast<int>(std::floor(std::log10(size)));
  return QLocale().toString(size == 0 ? 0.0 : length, 'f', std::min(digits, 6)) + QChar(0x00a0) + text(name(unit));
}

QString place_text(const Vec3d& place, double across, Unit unit) {
  QLocale locale;
  locale.setNumberOptions(QLocale::OmitGroupSeparator);  // commas stand between the numbers
  const QString between = locale.decimalPoint() == QLatin1String(",") ? QStringLiteral("; ") : QStringLiteral(", ");
  QStringList parts;
  const Vec3d at = rounded_place(place, across);
  for (const double value : {at.x, at.y, at.z}) parts.append(locale.toString(value, 'g', kPlaceDigits));
  return QLatin1Char('(') + parts.join(between) + QLatin1Char(')') + QChar(0x00a0) + text(name(unit));
}

QString percent_text(double share) {
  return QLocale().toString(std::lround(100 * share)) + QChar(0x00a0) + QLatin1Char('%');
}

QString sample_title(const QString& name) {
  QString title = QCoreApplication::translate("Samples", name.toUtf8());
  if (!title.isEmpty()) title[0] = title[0].toUpper();
  return title;
}

QString ago_text(qint64 seconds) {
  if (seconds < 60) return Text::tr("just now");
  if (seconds < 3600) return Text::tr("%n minute(s) ago", nullptr, static_cast<int>(seconds / 60));
  if (seconds < 86400) return Text::tr("%n hour(s) ago", nullptr, static_cast<int>(seconds / 3600));
  return Text::tr("%n day(s) ago", nullptr, static_cast<int>(seconds / 86400));
}

namespace {

/// The words in the user's language around the values that they hold; nothing where nobody has translated them.
std::optional<QString> translated_note(const QString& words) {
  static const QRegularExpression value(R"('[^']*'|\(-?\d[^()]*\)|\d+(?:\.\d+)?(?:e[-+]?\d+)?(?: (?:mm|cm|m|in)\b)?)");
  static const QRegularExpression slot(QStringLiteral("%(\\d+)"));
  QStringList values;
  QString pattern;
  qsizetype from = 0;
  for (auto each = value.globalMatch(words); each.hasNext();) {
    const QRegularExpressionMatch match = each.next();
    values.append(match.captured());
    pattern += words.mid(from, match.capturedStart() - from) + QLatin1Char('%') + QString::number(values.size());
    from = match.capturedEnd();
  }
  pattern += words.mid(from);
  const QString translated = QCoreApplication::translate("Notes", pattern.toUtf8());
  if (translated == pattern) return std::nullopt;
  QString result;
  from = 0;
  for (auto each = slot.globalMatch(translated); each.hasNext();) {
    const QRegularExpressionMatch match = each.next();
    result += translated.mid(from, match.capturedStart() - from) + values.value(match.captured(1).toInt() - 1);
    from = match.capturedEnd();
  }
  return result + translated.mid(from);
}

}  // namespace

QString note_text(const std::string& note) {
  const QString words = text(note), between = QStringLiteral(": ");
  if (const auto whole = translated_note(words)) return *whole;
  // The reason behind a colon may be one of many, in any note.
  const qsizetype colon = words.indexOf(between);
  if (colon < 0) return words;
  const QString head = words.left(colon), reason = words.mid(colon + between.size());
  return translated_note(head).value_or(head) + between + translated_note(reason).value_or(reason);
}

QString error_text(const Error& error) {
  if (language() == QLatin1String("en")) return text(error.message);
  const auto kind = [&] {
    switch (error.code) {
      case Errc::InvalidArgument:
        return Text::tr("What was asked for is not possible.");
      case Errc::NotFound:
        return Text::tr("The file or device is not there.");
      case Errc::Io:
        return Text::tr("Reading or writing did not work; a full disk or a missing permission does this.");
      case Errc::Corrupt:
        return Text::tr("The file is damaged, or it is not what its name says.");
      case Errc::UnsupportedFormat:
        return Text::tr("Files of this kind cannot be read.");
      case Errc::NewerVersion:
        return Text::tr("The file was made by a newer Relief; install that one.");
      case Errc::NotManifold:
        return Text::tr("The surface does not hang together so that it has two sides.");
      case Errc::Unfoldable:
        return Text::tr("No slabs can be laid over this surface.");
      case Errc::DeviceUnavailable:
        return Text::tr("The device cannot be used now.");
      case Errc::DeviceLost:
        return Text::tr("The device no longer answers.");
      case Errc::Cancelled:
        return Text::tr("It was cancelled.");
    }
    return QString();
  };
  return QStringLiteral("%1 (%2)").arg(kind(), text(error.message));
}

}  // namespace relief::studio
