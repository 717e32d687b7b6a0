// How hard the hand presses, and what the tool makes of it: a curve to be bent.
#pragma once

#include <relief/edit/tools.h>

#include <QWidget>
#include <array>
#include <optional>

namespace relief::studio {

/// Three handles: where the output begins (low, on the bottom edge), where it is full (high, on the top edge), and one
/// in the middle between them that bends the curve (exponent). Drag them, or Tab between them and use the arrows
/// (Shift: a fifth), Home for the straight line. A line stands at the pressure that the hand exerts now.
class CurveEditor : public QWidget {
  Q_OBJECT
 public:
  enum class Handle { Low, Bend, High };

  explicit CurveEditor(QWidget* parent = nullptr);

  [[nodiscard]] const PressureCurve& curve() const { return curve_; }
  /// Brought into what the handles reach. Emits nothing.
  void set_curve(const PressureCurve& curve);
  /// 0..1; empty: nobody presses, or nothing measures it.
  void set_live_pressure(std::optional<double> pressure);

  [[nodiscard]] Handle current() const { return current_; }
  /// In pixels of the widget.
  [[nodiscard]] QPointF position(Handle handle) const;

  QSize sizeHint() const override;
  QSize minimumSizeHint() const override;

 signals:
  void curveEdited(const relief::PressureCurve& curve);
  void editFinished();

 protected:
  void paintEvent(QPaintEvent* event) override;
  void mousePressEvent(QMouseEvent* event) override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void mouseReleaseEvent(QMouseEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;
  bool focusNextPrevChild(bool next) override;
  void focusInEvent(QFocusEvent* event) override;

 private:
  [[nodiscard]] QRectF plot() const;
  [[nodiscard]] QPointF to_pixel(QPointF point) const;
  [[nodiscard]] QPointF from_pixel(QPointF pixel) const;
  void move_to(QPointF point);
  void edit(const PressureCurve& curve);
  void choose(Handle handle);
  void describe_curve();
  void paint_curve(QPainter& painter) const;
  void paint_handles(QPainter& painter) const;
  void paint_texts(QPainter& painter) const;

  PressureCurve curve_;
  std::optional<double> live_;
  Handle current_ = Handle::Bend;
  bool dragging_ = false;
};

}  // namespace relief::studio
