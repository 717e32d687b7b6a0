#include "style.h"

#include "icons.h"
#include "theme.h"

#include <QFile>
#include <QPainter>
#include <QPainterPath>
#include <QRegularExpression>
#include <QStyleOption>
#include <array>

namespace relief::studio {

namespace {

/// A line through points of the unit square, as a path in `rect`.
template <std::size_t N>
QPainterPath path_in(const QRectF& rect, const std::array<QPointF, N>& points) {
  QPainterPath path;
  for (std::size_t i = 0; i < N; ++i) {
    const QPointF at(rect.x() + points[i].x() * rect.width(), rect.y() + points[i].y() * rect.height());
    if (i == 0)
      path.moveTo(at);
    else
      path.lineTo(at);
  }
  return path;
}

QRectF centred_square(const QRect& rect, double side) {
  const QPointF c = QRectF(rect).center();
  return {c.x() - side / 2, c.y() - side / 2, side, side};
}

void paint_check(QPainter& painter, const QStyleOption& option, bool round) {
  const Theme& theme = current_theme();
  const bool on = option.state.testFlag(QStyle::State_On), some = option.state.testFlag(QStyle::State_NoChange);
  const bool enabled = option.state.testFlag(QStyle::State_Enabled);
  const QRectF box = centred_square(option.rect, std::min(option.rect.width(), option.rect.height()) - 2);
  const QColor fill = !enabled ? theme.line : on || some ? theme.accent : theme.field;
  painter.setPen(QPen(on || some || !enabled ? fill : theme.dim, 1.2));
  painter.setBrush(fill);
  const double radius = round ? box.width() / 2 : 0.22 * box.width();
  painter.drawRoundedRect(box, radius, radius);
  if (!on && !some) return;
  const QColor mark = enabled ? theme.on_accent : theme.dim;
  if (round) {
    painter.setPen(Qt::NoPen);
    painter.setBrush(mark);
    painter.drawEllipse(box.center(), box.width() / 5, box.width() / 5);
    return;
  }
  painter.setBrush(Qt::NoBrush);
  painter.setPen(QPen(mark, box.width() / 8, Qt::SolidLine, Qt::RoundCap, Qt::RoundJoin));
  if (some)
    painter.drawPath(path_in<2>(box, {QPointF(0.28, 0.5), QPointF(0.72, 0.5)}));
  else
    painter.drawPath(path_in<3>(box, {QPointF(0.25, 0.52), QPointF(0.43, 0.7), QPointF(0.76, 0.31)}));
}

void paint_arrow(QPainter& painter, const QStyleOption& option, QStyle::PrimitiveElement direction) {
  const Theme& theme = current_theme();
  const bool enabled = option.state.testFlag(QStyle::State_Enabled);
  const double side = std::min({9.0 * text_scale(), double(option.rect.width()), double(option.rect.height())});
  const QRectF box = centred_square(option.rect, side);
  painter.setBrush(Qt::NoBrush);
  painter.setPen(QPen(enabled ? theme.text : theme.line, side / 6, Qt::SolidLine, Qt::RoundCap, Qt::RoundJoin));
  std::array<QPointF, 3> points = {QPointF(0.1, 0.3), QPointF(0.5, 0.7), QPointF(0.9, 0.3)};  // down
  for (QPointF& p : points) {
    if (direction == QStyle::PE_IndicatorArrowUp) p = {p.x(), 1 - p.y()};
    if (direction == QStyle::PE_IndicatorArrowRight) p = {p.y(), p.x()};
    if (direction == QStyle::PE_IndicatorArrowLeft) p = {1 - p.y(), p.x()};
  }
  painter.drawPath(path_in(box, points));
}

void paint_focus(QPainter& painter, const QStyleOption& option) {
  painter.setPen(QPen(current_theme().accent, 1));
  painter.setBrush(Qt::NoBrush);
  painter.drawRoundedRect(QRectF(option.rect).adjusted(0.5, 0.5, -0.5, -0.5), 2, 2);
}

/// A line across a tool bar, one pixel wide, that leaves a fifth free at both ends.
void paint_separator(QPainter& painter, const QStyleOption& option) {
  const QRect& all = option.rect;
  const bool upright = option.state.testFlag(QStyle::State_Horizontal);
  const QRect line = upright ? QRect(all.center().x(), all.top() + all.height() / 5, 1, all.height() * 3 / 5)
                             : QRect(all.left() + all.width() / 5, all.center().y(), all.width() * 3 / 5, 1);
  painter.fillRect(line, current_theme().line);
}

QString text_of(const QString& resource) {
  QFile file(resource);
  const bool open = file.open(QIODevice::ReadOnly);
  Q_ASSERT(open);
  return open ? QString::fromUtf8(file.readAll()) : QString();
}

}  // namespace

Style::Style() : QProxyStyle(QStringLiteral("Fusion")) {}

void Style::drawPrimitive(PrimitiveElement element, const QStyleOption* option, QPainter* painter,
                          const QWidget* widget) const {
  painter->save();
  painter->setRenderHint(QPainter::Antialiasing);
  bool drawn = true;
  switch (element) {
    case PE_IndicatorCheckBox:
    case PE_IndicatorItemViewItemCheck:
    case PE_IndicatorMenuCheckMark:
      paint_check(*painter, *option, false);
      break;
    case PE_IndicatorRadioButton:
      paint_check(*painter, *option, true);
      break;
    case PE_IndicatorArrowUp:
    case PE_IndicatorArrowDown:
    case PE_IndicatorArrowLeft:
    case PE_IndicatorArrowRight:
      paint_arrow(*painter, *option, element);
      break;
    case PE_FrameFocusRect:
      paint_focus(*painter, *option);
      break;
    case PE_IndicatorToolBarSeparator:
      paint_separator(*painter, *option);
      break;
    case PE_IndicatorSpinUp:
      paint_arrow(*painter, *option, PE_IndicatorArrowUp);
      break;
    case PE_IndicatorSpinDown:
      paint_arrow(*painter, *option, PE_IndicatorArrowDown);
      break;
    default:
      drawn = false;
  }
  painter->restore();
  if (!drawn) QProxyStyle::drawPrimitive(element, option, painter, widget);
}

int Style::pixelMetric(PixelMetric metric, const QStyleOption* option, const QWidget* widget) const {
  switch (metric) {
    case PM_IndicatorWidth:
    case PM_IndicatorHeight:
    case PM_ExclusiveIndicatorWidth:
    case PM_ExclusiveIndicatorHeight:
      return scaled(17);
    case PM_SmallIconSize:
    case PM_ButtonIconSize:
    case PM_ListViewIconSize:
    case PM_TabBarIconSize:
      return scaled(18);
    case PM_ToolBarSeparatorExtent:
      return scaled(11);
    case PM_ToolBarExtensionExtent:  // the button for what has no room
      return scaled(26);
    case PM_ToolBarIconSize:
      return scaled(22);
    case PM_MessageBoxIconSize:
      return scaled(40);
    case PM_ScrollBarSliderMin:
      return scaled(28);
    default:
      return QProxyStyle::pixelMetric(metric, option, widget);
  }
}

QIcon Style::standardIcon(StandardPixmap which, const QStyleOption* option, const QWidget* widget) const {
  const int side = scaled(40);  // of a message box; there the icon has the colour of its mood
  const auto mood_icon = [side](Mood mood) { return QIcon(icon_pixmap(icon_of(mood), side, colour_of(mood), 2)); };
  switch (which) {
    case SP_MessageBoxInformation:
      return mood_icon(Mood::Plain);
    case SP_MessageBoxWarning:
      return mood_icon(Mood::Warn);
    case SP_MessageBoxCritical:
      return mood_icon(Mood::Bad);
    case SP_MessageBoxQuestion:
      return QIcon(icon_pixmap(u"help", side, current_theme().text, 2));
    case SP_DirIcon:
    case SP_DirClosedIcon:
      return icon(u"folder");
    case SP_DirOpenIcon:
      return icon(u"open");
    case SP_DirHomeIcon:
      return icon(u"home");
    case SP_FileIcon:
      return icon(u"file");
    case SP_ComputerIcon:
    case SP_DesktopIcon:
    case SP_DriveHDIcon:
    case SP_DriveNetIcon:
      return icon(u"kiosk");
    case SP_FileDialogNewFolder:
      return icon(u"folder-new");
    case SP_FileDialogToParent:
    case SP_ArrowUp:
      return icon(u"up");
    case SP_ArrowBack:
    case SP_ArrowLeft:
      return icon(u"back");
    case SP_ArrowForward:
    case SP_ToolBarHorizontalExtensionButton:
    case SP_ToolBarVerticalExtensionButton:
    case SP_ArrowRight:
      return icon(u"forward");
    case SP_FileDialogListView:
      return icon(u"grid");
    case SP_FileDialogDetailedView:
      return icon(u"list");
    default:
      return QProxyStyle::standardIcon(which, option, widget);
  }
}

int Style::styleHint(StyleHint hint, const QStyleOption* option, const QWidget* widget,
                     QStyleHintReturn* result) const {
  switch (hint) {
    case SH_EtchDisabledText:
    case SH_DialogButtonBox_ButtonsHaveIcons:
      return 0;
    case SH_ToolTip_WakeUpDelay:
      return 400;  // ms; Fusion's 700 is long for someone who looks for a tool
    default:
      return QProxyStyle::styleHint(hint, option, widget, result);
  }
}

QString style_sheet() {
  const Theme& t = current_theme();
  const std::array colours = {std::pair{"window", t.window},
                              std::pair{"panel", t.panel},
                              std::pair{"raised", t.raised},
                              std::pair{"field", t.field},
                              std::pair{"line", t.line},
                              std::pair{"text", t.text},
                              std::pair{"dim", t.dim},
                              std::pair{"accent", t.accent},
                              std::pair{"onaccent", t.on_accent},
                              std::pair{"good", t.good},
                              std::pair{"warn", t.warn},
                              std::pair{"bad", t.bad},
                              std::pair{"hover", mixed(t.raised, t.text, 0.08)},
                              std::pair{"faint", mixed(t.panel, t.dim, 0.6)}};
  QString sheet = text_of(QStringLiteral(":/relief/studio/studio.qss"));
  for (const auto& [name, colour] : colours) {
    const QRegularExpression word(QStringLiteral("@%1\\b").arg(QLatin1String(name)));
    sheet.replace(word, colour.name());
  }
  // Lengths stand in the sheet as they are at 100 % text: 1px and 2px are lines and stay, all others grow.
  static const QRegularExpression length(QStringLiteral("\\b(\\d+)px"));
  QString scaled_sheet;
  qsizetype from = 0;
  for (auto it = length.globalMatch(sheet); it.hasNext();) {
    const auto match = it.next();
    const int pixels = match.captured(1).toInt();
    scaled_sheet += QStringView(sheet).mid(from, match.capturedStart() - from);
    scaled_sheet += QStringLiteral("%1px").arg(pixels <= 2 ? pixels : scaled(pixels));
    from = match.capturedEnd();
  }
  return scaled_sheet.append(QStringView(sheet).mid(from));
}

}  // namespace relief::studio
