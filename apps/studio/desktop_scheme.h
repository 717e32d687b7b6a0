// Whether the desktop is dark or light.
#pragma once

#include "widgets/theme.h"

#include <QDBusVariant>
#include <QObject>
#include <optional>

namespace relief::studio {

/// Asks the desktop's portal (org.freedesktop.appearance, color-scheme) and hears of changes. Without a portal, or
/// where the desktop has no wish, nothing is known.
class DesktopScheme : public QObject {
  Q_OBJECT
 public:
  explicit DesktopScheme(QObject* parent = nullptr);
  [[nodiscard]] std::optional<bool> dark() const { return dark_; }

 signals:
  void changed();

 private slots:
  void take(const QString& group, const QString& key, const QDBusVariant& value);

 private:
  std::optional<bool> dark_;
};

/// The theme for a choice: "dark", "light", else that of the desktop, dark where it is not known.
[[nodiscard]] const Theme& theme_for(const QString& choice, std::optional<bool> desktop_dark);

}  // namespace relief::studio
