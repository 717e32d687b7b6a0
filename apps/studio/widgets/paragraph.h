// Words that go over several lines.
#pragma once

#include <QLabel>
#include <QResizeEvent>

namespace relief::studio {

/// A label in lines, never lower than all of its words at its width: layouts in layouts, and scroll areas, forget to
/// ask for that.
class Paragraph : public QLabel {
 public:
  explicit Paragraph(const QString& words = {}, QWidget* parent = nullptr) : QLabel(words, parent) {
    setWordWrap(true);
  }
  [[nodiscard]] QSize minimumSizeHint() const override {
    return {QLabel::minimumSizeHint().width(), text().isEmpty() ? 0 : heightForWidth(width())};
  }

 protected:
  void resizeEvent(QResizeEvent* event) override {
    QLabel::resizeEvent(event);
    if (event->size().width() != event->oldSize().width()) updateGeometry();
  }
};

}  // namespace relief::studio
