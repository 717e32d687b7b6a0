// A title, a few lines and buttons: for the start page and for what a conversion has found.
#pragma once

#include "theme.h"

#include <QFrame>
#include <QStringList>

class QHBoxLayout;
class QLabel;
class QPushButton;
class QVBoxLayout;

namespace relief::studio {

class Card : public QFrame {
  Q_OBJECT
 public:
  explicit Card(const QString& title, const QStringList& lines = {}, QWidget* parent = nullptr);

  void set_title(const QString& title);
  void set_lines(const QStringList& lines);
  /// Colours the title and puts the state's icon before it.
  void set_mood(Mood mood);
  /// A picture above the title, 16:9, for example of a model; scaled and cut to fit.
  void set_picture(const QPixmap& picture);
  /// At the bottom, in order of call; the primary one in accent.
  QPushButton* add_button(const QString& text, bool primary = false);

 protected:
  void changeEvent(QEvent* event) override;

 private:
  void show_mood();

  Mood mood_ = Mood::Plain;
  QLabel *picture_, *icon_, *title_;
  QVBoxLayout* lines_;
  QHBoxLayout* buttons_;
};

}  // namespace relief::studio
