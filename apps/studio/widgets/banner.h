// What must not be missed, across the top of a window.
#pragma once

#include "theme.h"

#include <QFrame>
#include <functional>
#include <vector>

class QHBoxLayout;
class QLabel;

namespace relief::studio {

struct BannerAction {
  QString text;
  std::function<void()> run;
};

/// Colour, icon and words; to assistive tools an alert. Stays until one of its buttons is pressed or retract() is
/// called because what it says is no longer so.
class Banner : public QFrame {
  Q_OBJECT
 public:
  explicit Banner(QWidget* parent = nullptr);

  /// One sentence. Replaces what stands there. Without actions there is a button that says "I have read it". A button
  /// closes the banner, then runs its action.
  void say(Mood mood, const QString& words, std::vector<BannerAction> actions = {});
  void retract();
  [[nodiscard]] Mood mood() const { return mood_; }
  /// The background, on which `words` stand; for tests of contrast.
  [[nodiscard]] QColor ground() const;

 signals:
  void closed();

 protected:
  void paintEvent(QPaintEvent* event) override;
  void changeEvent(QEvent* event) override;

 private:
  void show_icon();

  Mood mood_ = Mood::Plain;
  QLabel *icon_, *words_;
  QHBoxLayout* buttons_;
};

}  // namespace relief::studio
