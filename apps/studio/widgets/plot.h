// One signal over the last seconds, with its limit.
#pragma once

#include "sample_ring.h"

#include <QElapsedTimer>
#include <QWidget>
#include <functional>
#include <optional>

namespace relief::studio {

/// Title at the left, the value in words at the right, under them the signal: least and greatest value per pixel
/// column, so that no spike is lost. Once frozen it can be scrubbed with the mouse or the arrows (Shift: a tenth); the
/// signal still arrives meanwhile and is there when it thaws. Painting a full minute takes under 1 ms.
class PlotView : public QWidget {
  Q_OBJECT
 public:
  enum class Colour { Good, Blue, Accent };

  explicit PlotView(const QString& title, Colour colour, QWidget* parent = nullptr);

  /// How a value is written while it is scrubbed: "1.9 N".
  void set_format(std::function<QString(double)> format);
  /// The words at the right while nobody scrubs: "1.9 N of 3.3".
  void set_text(const QString& text);
  /// A dashed line; the plot always shows it.
  void set_limit(std::optional<double> limit);
  /// Seconds from the left edge to the right, up to 60.
  void set_seconds(double seconds);

  void append(std::span<const Sample> samples);
  void clear();

  /// Frozen, it shows a copy of what there was at that moment.
  void set_frozen(bool frozen);
  [[nodiscard]] bool frozen() const { return frozen_.has_value(); }
  /// Seconds on the samples' clock; several plots can share one cursor. Shown while frozen.
  void set_cursor(std::optional<double> time);
  [[nodiscard]] std::optional<double> cursor() const { return cursor_; }
  /// Of what is shown, at the cursor.
  [[nodiscard]] std::optional<float> value_at_cursor() const;

  QSize sizeHint() const override;
  QSize minimumSizeHint() const override;

 signals:
  void scrubbed(double time);

 protected:
  void paintEvent(QPaintEvent* event) override;
  void mousePressEvent(QMouseEvent* event) override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;

 private:
  struct View {
    QRectF box;
    double from, to, low, high;
    [[nodiscard]] double x(double time) const { return box.left() + (time - from) / (to - from) * box.width(); }
    [[nodiscard]] double y(double value) const { return box.bottom() - (value - low) / (high - low) * box.height(); }
  };

  [[nodiscard]] const SampleRing& shown() const { return frozen_ ? *frozen_ : ring_; }
  [[nodiscard]] QRectF box() const;
  /// Of so many columns; ends at a whole column, so that a moving signal does not flicker.
  [[nodiscard]] View view_of(std::size_t columns) const;
  void scrub(double time);
  void scrub_to(double x);
  void describe_value();
  void paint_limit(QPainter& painter, const View& view) const;
  /// One column per extent.
  [[nodiscard]] QImage signal_picture(View view, std::span<const Extent> extents, QSize pixels) const;
  void paint_cursor(QPainter& painter, const View& view) const;
  void paint_texts(QPainter& painter) const;
  [[nodiscard]] QString words() const;

  QString title_, text_;
  Colour colour_;
  std::function<QString(double)> format_;
  std::optional<double> limit_, cursor_;
  double seconds_ = 10;
  SampleRing ring_;
  std::optional<SampleRing> frozen_;
  QElapsedTimer described_;
};

}  // namespace relief::studio
