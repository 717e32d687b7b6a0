#include "kiosk_log.h"

#include <QDateTime>
#include <QDir>
#include <QFile>

namespace relief::studio {

namespace {

const QString kBefore = QStringLiteral("kiosk-"), kAfter = QStringLiteral(".log");

}  // namespace

KioskLog::KioskLog(QString folder) : folder_(std::move(folder)) { QDir().mkpath(folder_); }

void KioskLog::write(const QString& words) {
  const QDateTime now = QDateTime::currentDateTime();
  if (now.date() != day_) {
    day_ = now.date();
    tidy(day_);
  }
  QFile file(folder_ + QLatin1Char('/') + kBefore + day_.toString(Qt::ISODate) + kAfter);
  if (!file.open(QIODevice::Append)) return;
  file.write((now.toString(Qt::ISODate) + QLatin1Char(' ') + words.simplified() + QLatin1Char('\n')).toUtf8());
}

void KioskLog::tidy(QDate today) const {
  QDir folder(folder_);
  for (const QString& name : folder.entryList({kBefore + QLatin1Char('*') + kAfter}, QDir::Files)) {
    const QDate day =
        QDate::fromString(name.mid(kBefore.size(), name.size() - kBefore.size() - kAfter.size()), Qt::ISODate);
    if (day.isValid() && day.daysTo(today) > kDays) folder.remove(name);
  }
}

}  // namespace relief::studio
