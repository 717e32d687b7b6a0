// Every command of a window, found by typing.
#pragma once

#include <QFrame>
#include <QList>
#include <QPointer>

class QAction;
class QLabel;
class QLineEdit;
class QListWidget;
class QListWidgetItem;

namespace relief::studio {

/// Lies over its window as a child of it, not as a dialog: without a window manager a new top-level window gets no
/// keyboard focus. F3 or Ctrl+K opens it; typed words narrow the list in any order; Enter triggers, Esc or a click
/// elsewhere closes, and the focus goes back to where it was.
class CommandPalette : public QFrame {
  Q_OBJECT
 public:
  /// Lists the actions of `window` and of everything inside it that can be triggered now.
  explicit CommandPalette(QWidget* window);

  /// For a menu; carries the shortcuts.
  [[nodiscard]] QAction* open_action() const { return open_action_; }
  void open();
  void close_again();

  /// What can be triggered in `window`: enabled, visible, with a name, no separators and no menus; each name and
  /// shortcut once, in the order of the menus.
  [[nodiscard]] static QList<QAction*> actions_of(const QWidget& window, const QWidget* without = nullptr);
  /// Gives an action further words to be found by, such as "dark mode" for "Light or dark". They are not shown.
  static void set_words(QAction& action, const QString& words);
  /// Whether each word of `typed` is somewhere in `title`, in any case.
  [[nodiscard]] static bool matches(const QString& title, const QString& typed);

 protected:
  bool eventFilter(QObject* object, QEvent* event) override;

 private:
  void narrow(const QString& typed);
  void place();
  void trigger(const QListWidgetItem* item);
  bool key_pressed(const QKeyEvent& event);

  QAction* open_action_;
  QLineEdit* line_;
  QListWidget* list_;
  QLabel* nothing_;  ///< instead of an empty list
  QList<QPointer<QAction>> actions_;
  QPointer<QWidget> focus_before_;
};

}  // namespace relief::studio
