// The force on the hand, as a column with its limit.
#pragma once

#include <QTimer>
#include <QWidget>

namespace relief::studio {

/// Lies over the picture; the mouse goes through it.
class ForceMeter : public QWidget {
  Q_OBJECT
 public:
  explicit ForceMeter(QWidget* parent = nullptr);

  /// Newtons, >= 0; what is not finite counts as 0.
  void set_force(double newtons);
  /// Newtons, > 0: the most that the device is allowed to exert.
  void set_limit(double newtons);
  /// Off: no column, and the words say so.
  void set_forces_on(bool on);

  [[nodiscard]] QString words() const;

  QSize sizeHint() const override;

 protected:
  void paintEvent(QPaintEvent* event) override;

 private:
  [[nodiscard]] QRectF column() const;
  [[nodiscard]] double y(double newtons) const;
  void paint_column(QPainter& painter) const;
  void paint_scale(QPainter& painter) const;
  [[nodiscard]] QString description() const;
  void tell();

  double force_ = 0, limit_ = 3;
  bool on_ = true;
  QTimer told_;  ///< runs for a while after the words were told
};

}  // namespace relief::studio
