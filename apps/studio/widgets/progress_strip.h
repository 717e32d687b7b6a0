// How far long work has come, and how to stop it.
#pragma once

#include <QWidget>
#include <functional>

class QLabel;
class QProgressBar;
class QPushButton;

namespace relief::studio {

/// The phase in words, one bar for the whole, the time left once three seconds have passed, and a button to cancel.
/// Assistive tools know the bar as `Convert progress` and the button as `Cancel`.
class ProgressStrip : public QWidget {
  Q_OBJECT
 public:
  static constexpr double kShowTimeAfter = 3;  // seconds: before that, the rate is not worth a guess

  /// Seconds from any beginning, never falling.
  using Clock = std::function<double()>;
  /// Without `clock`: a steady one.
  explicit ProgressStrip(QWidget* parent = nullptr, Clock clock = {});

  void start(const QString& phase);
  /// `fraction` of the whole, 0..1; a smaller one than before changes nothing.
  void set_progress(const QString& phase, double fraction);
  void finish();

  [[nodiscard]] double fraction() const { return fraction_; }
  /// "About 2 min left"; empty where it cannot be known yet.
  [[nodiscard]] QString time_left() const;

 signals:
  /// Once per start().
  void cancelRequested();

 private:
  void show_state();
  void cancel();

  Clock clock_;
  double began_ = 0, fraction_ = 0;
  bool cancelled_ = false;
  QLabel *phase_, *left_;
  QProgressBar* bar_;
  QPushButton* cancel_;
};

}  // namespace relief::studio
