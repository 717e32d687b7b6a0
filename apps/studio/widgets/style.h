// The style behind theme.h: what a style sheet cannot draw, and the style sheet. Internal to the widgets.
#pragma once

#include <QIcon>
#include <QProxyStyle>
#include <QString>

namespace relief::studio {

/// Fusion, with check marks, arrows and sizes of our own: painted, so that they are sharp and right at every text size.
class Style : public QProxyStyle {
  Q_OBJECT
 public:
  Style();
  void drawPrimitive(PrimitiveElement element, const QStyleOption* option, QPainter* painter,
                     const QWidget* widget) const override;
  int pixelMetric(PixelMetric metric, const QStyleOption* option, const QWidget* widget) const override;
  QIcon standardIcon(StandardPixmap which, const QStyleOption* option, const QWidget* widget) const override;
  int styleHint(StyleHint hint, const QStyleOption* option, const QWidget* widget,
                QStyleHintReturn* result) const override;
};

/// Of the theme in use, at the text size in use. Labels take part by the dynamic property `role`: heading, dim,
/// good, warn, bad; frames by `role` card or pill; push buttons by `role` primary.
[[nodiscard]] QString style_sheet();

}  // namespace relief::studio
