// The page of the preferences that shows all keys.
#pragma once

#include <QWidget>

class QLabel;
class QPushButton;
class QTreeWidget;
class QTreeWidgetItem;

namespace relief::studio {

class KeyMap;

/// A row for each action with its keys. A double click, Enter or the button waits for the new key to be pressed; a key
/// that another action has is not given without asking.
class KeysPage : public QWidget {
  Q_OBJECT
 public:
  explicit KeysPage(KeyMap& keys, QWidget* parent = nullptr);
  /// Shows the rows whose title or keys hold all typed words; false where there is none.
  bool narrow(const QString& typed);
  [[nodiscard]] bool waiting() const { return !waiting_for_.isEmpty(); }

 protected:
  bool eventFilter(QObject* object, QEvent* event) override;
  void changeEvent(QEvent* event) override;

 private:
  void fill();
  void refresh();
  void wait_for_key();
  void take(const QKeySequence& key);
  void give(const QKeySequence& key);
  void stop_waiting();
  [[nodiscard]] QString chosen_id() const;
  [[nodiscard]] QString titles(const QStringList& ids) const;

  KeyMap& keys_;
  QTreeWidget* list_;
  QLabel* words_;
  QPushButton *change_, *none_, *preset_, *take_over_, *leave_;
  QString waiting_for_;  ///< id of the action that gets the next key
};

}  // namespace relief::studio
