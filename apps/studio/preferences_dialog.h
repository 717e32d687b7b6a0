// What people choose for good, in a window.
#pragma once

#include <QDialog>
#include <QSettings>
#include <functional>
#include <vector>

class QLabel;
class QLineEdit;
class QListWidget;
class QStackedWidget;
class QVBoxLayout;

namespace relief::studio {

class KeyMap;
class KeysPage;

/// Each choice is kept and told as soon as it is made; there is nothing to confirm.
class PreferencesDialog : public QDialog {
  Q_OBJECT
 public:
  /// `drawing`: what draws the pictures, in words.
  PreferencesDialog(QSettings& settings, KeyMap& keys, const QString& drawing, QWidget* parent = nullptr);
  /// Shows the page: "look", "input", "drawing", "forces", "saving", "language" or "keys".
  void show_page(const QString& page);

 signals:
  /// The choice under this key is another one now.
  void changed(const QString& key);

 private:
  struct Row {
    QString key, words;  ///< what the search finds it by
    QWidget* widget;
    int page;
    std::function<void()> refresh;  ///< shows what is chosen now
  };

  QVBoxLayout* add_page(const QString& id, const QString& title);
  void finish_page(QVBoxLayout& column, std::function<void()> reset = {});
  void add_row(QVBoxLayout& column, const QString& key, const QString& title, const QString& help, QWidget* control,
               std::function<void()> refresh);
  void add_choice(QVBoxLayout& column, const QString& key, const QString& title, const QString& help,
                  const QStringList& titles);
  void add_switch(QVBoxLayout& column, const QString& key, const QString& title, const QString& help);
  void add_folder(QVBoxLayout& column, const QString& key, const QString& title, const QString& help);
  void add_look();
  void add_input();
  void add_percent(QVBoxLayout& column, const QString& key, const QString& title, const QString& help);
  void add_drawing(const QString& drawing);
  void add_forces();
  void add_saving();
  void add_language();
  void add_keys(KeyMap& keys);

  void keep(const QString& key, const QVariant& value);
  void reset(int page);
  void narrow(const QString& typed);

  QSettings& settings_;
  QLineEdit* search_;
  QListWidget* list_;
  QStackedWidget* pages_;
  QLabel* nothing_;
  KeysPage* keys_page_ = nullptr;
  std::vector<Row> rows_;
};

}  // namespace relief::studio
