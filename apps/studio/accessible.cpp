#include "accessible.h"

#include <QAccessible>
#include <QAccessibleObject>
#include <QAccessibleWidget>
#include <QApplication>
#include <QWidget>

namespace relief::studio {
namespace {

/// The application and its windows, as Qt tells of them; but Qt 6.4 reads past the end of its list where a window has
/// closed since an assistive tool counted them.
class Application final : public QAccessibleObject {
 public:
  Application() : QAccessibleObject(qApp) {}

  [[nodiscard]] int childCount() const override { return static_cast<int>(windows().size()); }
  [[nodiscard]] QAccessibleInterface* child(int index) const override {
    const QWidgetList all = windows();
    return index >= 0 && index < all.size() ? QAccessible::queryAccessibleInterface(all[index]) : nullptr;
  }
  [[nodiscard]] int indexOfChild(const QAccessibleInterface* child) const override {
    return static_cast<int>(windows().indexOf(qobject_cast<QWidget*>(child->object())));
  }
  [[nodiscard]] QAccessibleInterface* parent() const override { return nullptr; }
  [[nodiscard]] QAccessibleInterface* focusChild() const override {
    QWidget* const focus = QApplication::focusWidget();
    return focus != nullptr ? QAccessible::queryAccessibleInterface(focus) : nullptr;
  }
  [[nodiscard]] QString text(QAccessible::Text which) const override {
    if (which == QAccessible::Name) return QApplication::applicationName();
    return which == QAccessible::Description ? QApplication::applicationFilePath() : QString();
  }
  [[nodiscard]] QAccessible::Role role() const override { return QAccessible::Application; }
  [[nodiscard]] QAccessible::State state() const override {
    QAccessible::State now;
    now.active = QApplication::activeWindow() != nullptr ? 1 : 0;
    return now;
  }

 private:
  static QWidgetList windows() {
    QWidgetList all;
    for (QWidget* const window : QApplication::topLevelWidgets())
      if (window->windowType() != Qt::Popup && window->windowType() != Qt::Desktop) all.append(window);
    return all;
  }
};

}  // namespace

void install_accessibility() {
  QAccessible::installFactory([](const QString& type, QObject* object) -> QAccessibleInterface* {
    if (type == QLatin1String("QApplication")) return new Application;
    if (type == QLatin1String("relief::studio::Viewport"))
      return new QAccessibleWidget(qobject_cast<QWidget*>(object), QAccessible::Canvas);
    return nullptr;
  });
}

}  // namespace relief::studio
