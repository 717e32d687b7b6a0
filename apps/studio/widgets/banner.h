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

/// Colour, icon and words; to assistive tools an alert. What it says stays until one of its buttons is pressed, or
/// retract() is called because it is no longer so. Of several subjects the worst is seen, of equally bad ones the
/// newest; what it covers comes back.
class Banner : public QFrame {
  Q_OBJECT
 public:
  explicit Banner(QWidget* parent = nullptr);

  /// One sentence. Replaces what was said of the same subject; the same once more changes nothing. Without actions
  /// there is a button that says "I have read it". A button takes the sentence away, then runs its action. Returns
  /// whether anything changed.
  bool say(Mood mood, const QString& words, std::vector<BannerAction> actions = {}, const QString& subject = {});
  /// Nothing happens where nothing of the subject is said.
  void retract(const QString& subject = {});
  [[nodiscard]] Mood mood() const { return said_.empty() ? Mood::Plain : said_.back().mood; }
  /// The background, on which `words` stand; for tests of contrast.
  [[nodiscard]] QColor ground() const;

 signals:
  /// Nothing is said any more.
  void closed();

 protected:
  void paintEvent(QPaintEvent* event) override;
  void changeEvent(QEvent* event) override;

 private:
  struct Said {
    QString subject, words;
    Mood mood;
    std::vector<BannerAction> actions;
  };
  void show_first();
  void show_icon();

  std::vector<Said> said_;  ///< the one that is seen last
  QLabel *icon_, *words_;
  QHBoxLayout* buttons_;
};

}  // namespace relief::studio
