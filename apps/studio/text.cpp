#include "text.h"

#include <QCoreApplication>
#include <QLocale>

#include <cmath>

namespace relief::studio {

namespace {
QString tr(const char* words, int n = -1) { return QCoreApplication::translate("Text", words, nullptr, n); }
}  // namespace

QString length_text(double length, Unit unit) {
  const double size = std::abs(length);
  const int digits = size >= 100 || size == 0 ? 0 : size >= 10 ? 1 : size >= 1 ? 2 : 2 - static_cast<int>(std::floor(std::log10(size)));
  return QLocale().toString(length, 'f', std::min(digits, 6)) + QChar(0x00a0) + text(name(unit));
}

QString percent_text(double share) { return QLocale().toString(std::lround(100 * share)) + QChar(0x00a0) + QLatin1Char('%'); }

QString ago_text(qint64 seconds) {
  if (seconds < 60) return tr("just now");
  if (seconds < 3600) return tr("%n minute(s) ago", static_cast<int>(seconds / 60));
  if (seconds < 86400) return tr("%n hour(s) ago", static_cast<int>(seconds / 3600));
  return tr("%n day(s) ago", static_cast<int>(seconds / 86400));
}

}  // namespace relief::studio
