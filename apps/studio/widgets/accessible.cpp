#include "accessible.h"

#include <QAccessibleWidget>
#include <QVariant>
#include <QWidget>

namespace relief::studio {

namespace {

constexpr const char* kRoleProperty = "relief_accessible_role";

/// Called by Qt for each object it meets, with the names of its classes from the most derived up.
QAccessibleInterface* interface_of(const QString&, QObject* object) {
  auto* widget = qobject_cast<QWidget*>(object);
  if (!widget) return nullptr;
  const QVariant role = widget->property(kRoleProperty);
  return role.isValid() ? new QAccessibleWidget(widget, static_cast<QAccessible::Role>(role.toInt())) : nullptr;
}

}  // namespace

void set_accessible_role(QWidget* widget, QAccessible::Role role) {
  static const bool installed = (QAccessible::installFactory(interface_of), true);
  Q_UNUSED(installed);
  widget->setProperty(kRoleProperty, static_cast<int>(role));
}

void describe(QWidget* widget, const QString& words) {
  if (words != widget->accessibleDescription()) widget->setAccessibleDescription(words);
}

}  // namespace relief::studio
