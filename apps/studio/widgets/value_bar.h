// A slider with its name and its value written inside.
#pragma once

#include "value_format.h"

#include <QPointer>
#include <QSlider>

class QLineEdit;

namespace relief::studio {

/// Drag changes the value by the way of the hand (Shift: a tenth of it), a click jumps there, a double click, Enter or
/// F2 types it, arrows and Page keys step (Shift with arrows: a tenth), the wheel steps when the bar has the focus; Esc
/// takes a drag or what is typed back. To assistive tools it is a slider of 0..1000 whose description is the value in
/// words ("8.5 mm").
class ValueBar : public QSlider {
  Q_OBJECT
 public:
  /// Logarithmic: equal ways are equal ratios; needs 0 < min.
  enum class Scale { Linear, Logarithmic };

  /// `name`: accessible name and, where set_title() says nothing else, what stands in the bar.
  explicit ValueBar(const QString& name, QWidget* parent = nullptr);

  /// min < max. `step`, in the value's unit, is what an arrow key does on a linear scale; 0: a hundredth of the way.
  void set_range(double min, double max, Scale scale = Scale::Linear, double step = 0);
  void set_format(ValueFormat format);
  /// What stands in the bar.
  void set_title(const QString& title);
  /// Tool tip: one sentence and the key that does the same, which may be empty.
  void set_help(const QString& help, const QString& key = {});

  /// The value itself, finer than the slider's thousand steps.
  [[nodiscard]] double real_value() const { return value_; }
  /// Brought into the range. Emits nothing.
  void set_real_value(double value);
  [[nodiscard]] QString text() const;

  QSize sizeHint() const override;
  QSize minimumSizeHint() const override;

 signals:
  /// While a person changes it.
  void valueEdited(double value);
  /// When the change is done: one step of history.
  void editFinished();

 protected:
  bool event(QEvent* event) override;
  void paintEvent(QPaintEvent* event) override;
  void mousePressEvent(QMouseEvent* event) override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void mouseReleaseEvent(QMouseEvent* event) override;
  void mouseDoubleClickEvent(QMouseEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;
  void wheelEvent(QWheelEvent* event) override;
  void resizeEvent(QResizeEvent* event) override;
  bool eventFilter(QObject* object, QEvent* event) override;

 private:
  /// From and to the share 0..1 of the way along the bar.
  [[nodiscard]] double share_of(double value) const;
  [[nodiscard]] double value_at(double share) const;
  [[nodiscard]] double share_at(double x) const;
  void store(double value);
  void edit(double value);
  void drag_to(const QMouseEvent& event);
  void take_back_drag();
  void start_typing();
  void finish_typing(bool keep);
  void paint_fill(QPainter& painter) const;
  void paint_texts(QPainter& painter) const;

  struct Press {
    double x = 0, share = 0, value = 0;
    bool dragged = false;
  };

  QString title_;
  ValueFormat format_ = plain_format(2);
  double min_ = 0, max_ = 1, value_ = 0;
  Scale scale_ = Scale::Linear;
  bool storing_ = false;
  std::optional<Press> press_;
  double before_click_ = 0;  ///< value before the last jump, for a double click to restore
  QPointer<QLineEdit> editor_;
};

}  // namespace relief::studio
