// A short remark at the bottom of a window.
#pragma once

#include <QFrame>
#include <QTimer>

class QGraphicsOpacityEffect;
class QLabel;
class QPropertyAnimation;

namespace relief::studio {

/// For what may be missed ("Saved as you work"); what must not be missed is a Banner. Stands three seconds at the
/// bottom middle, then fades, or vanishes where motion is reduced. The mouse goes through it.
class Toast : public QFrame {
  Q_OBJECT
 public:
  static constexpr int kShownFor = 3000;  // ms

  explicit Toast(QWidget* window);

  /// Replaces what stands there. `keep_clear`, in the window's pixels: where the brush ring is; a toast that would
  /// cover it goes to the top.
  void say(const QString& words, const QRect& keep_clear = {});

 protected:
  bool eventFilter(QObject* object, QEvent* event) override;

 private:
  void place();
  void vanish();

  QLabel* label_;
  QGraphicsOpacityEffect* opacity_;
  QPropertyAnimation* fade_;
  QTimer shown_;
  QRect keep_clear_;
};

}  // namespace relief::studio
