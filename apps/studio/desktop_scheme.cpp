#include "desktop_scheme.h"

#include <QDBusConnection>
#include <QDBusConnectionInterface>
#include <QDBusMessage>

namespace relief::studio {

namespace {

const QString kService = QStringLiteral("org.freedesktop.portal.Desktop");
const QString kPath = QStringLiteral("/org/freedesktop/portal/desktop");
const QString kInterface = QStringLiteral("org.freedesktop.portal.Settings");
const QString kGroup = QStringLiteral("org.freedesktop.appearance");
const QString kKey = QStringLiteral("color-scheme");
/// ms that the start may wait for a portal that is there but does not answer.
constexpr int kPatience = 300;

/// 1: dark, 2: light, all else: no wish (XDG Desktop Portal, Settings). It comes in one or two variants.
std::optional<bool> dark_of(QVariant value) {
  while (value.canConvert<QDBusVariant>()) value = value.value<QDBusVariant>().variant();
  const uint scheme = value.toUInt();
  if (scheme != 1 && scheme != 2) return std::nullopt;
  return scheme == 1;
}

}  // namespace

DesktopScheme::DesktopScheme(QObject* parent) : QObject(parent) {
  QDBusConnection bus = QDBusConnection::sessionBus();
  if (!bus.isConnected() || !bus.interface()->isServiceRegistered(kService)) return;
  QDBusMessage question = QDBusMessage::createMethodCall(kService, kPath, kInterface, QStringLiteral("Read"));
  question << kGroup << kKey;
  const QDBusMessage answer = bus.call(question, QDBus::Block, kPatience);
  if (answer.type() == QDBusMessage::ReplyMessage && !answer.arguments().isEmpty())
    dark_ = dark_of(answer.arguments().first());
  bus.connect(kService, kPath, kInterface, QStringLiteral("SettingChanged"), this,
              SLOT(take(QString, QString, QDBusVariant)));
}

void DesktopScheme::take(const QString& group, const QString& key, const QDBusVariant& value) {
  if (group != kGroup || key != kKey) return;
  dark_ = dark_of(QVariant::fromValue(value));
  emit changed();
}

const Theme& theme_for(const QString& choice, std::optional<bool> desktop_dark) {
  if (choice == QLatin1String("dark")) return dark_theme();
  if (choice == QLatin1String("light")) return light_theme();
  return desktop_dark.value_or(true) ? dark_theme() : light_theme();
}

}  // namespace relief::studio
