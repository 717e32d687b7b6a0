// A panel's content that may be higher than the panel.
#pragma once

#include <QEvent>
#include <QLayout>
#include <QScrollArea>
#include <QScrollBar>

namespace relief::studio {

/// Scrolls up and down only, and is never narrower than what it holds beside its bar.
class ColumnArea : public QScrollArea {
 public:
  explicit ColumnArea(QWidget* parent = nullptr) : QScrollArea(parent) {
    setWidgetResizable(true);
    setFrameShape(QFrame::NoFrame);
    setHorizontalScrollBarPolicy(Qt::ScrollBarAlwaysOff);
  }
  /// All of it, at the width that it has.
  [[nodiscard]] QSize sizeHint() const override {
    if (widget() == nullptr) return QScrollArea::sizeHint();
    const QLayout* layout = widget()->layout();
    const bool in_lines = layout != nullptr && layout->hasHeightForWidth();
    return {widget()->sizeHint().width(),
            in_lines ? layout->totalHeightForWidth(widget()->width()) : widget()->sizeHint().height()};
  }
  [[nodiscard]] QSize minimumSizeHint() const override {
    const int content = widget() == nullptr ? 0 : widget()->minimumSizeHint().width();
    return {content + verticalScrollBar()->sizeHint().width(), QScrollArea::minimumSizeHint().height()};
  }

 protected:
  bool eventFilter(QObject* object, QEvent* event) override {
    if (object == widget() && event->type() == QEvent::LayoutRequest) updateGeometry();
    return QScrollArea::eventFilter(object, event);
  }
};

}  // namespace relief::studio
