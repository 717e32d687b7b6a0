#include "accessible.h"

#include <QAccessible>
#include <QAccessibleWidget>
#include <QWidget>

namespace relief::studio {

void install_accessibility() {
  QAccessible::installFactory([](const QString& type, QObject* object) -> QAccessibleInterface* {
    if (type == QLatin1String("relief::studio::Viewport"))
      return new QAccessibleWidget(qobject_cast<QWidget*>(object), QAccessible::Canvas);
    return nullptr;
  });
}

}  // namespace relief::studio
