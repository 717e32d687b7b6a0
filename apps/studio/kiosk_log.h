// What happened at a kiosk, for those who look after it.
#pragma once

#include <QDate>
#include <QString>

namespace relief::studio {

/// A line of text per event in a file per day, kiosk-2026-11-26.log; files older than 30 days are removed. Nothing
/// about visitors but what they did to the models.
class KioskLog {
 public:
  explicit KioskLog(QString folder);
  static constexpr int kDays = 30;

  void write(const QString& words);
  /// Removes old files; called by itself when a day begins.
  void tidy(QDate today) const;

 private:
  QString folder_;
  QDate day_;
};

}  // namespace relief::studio
