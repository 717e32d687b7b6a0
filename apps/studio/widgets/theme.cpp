#include "theme.h"

#include "style.h"

#include <QApplication>
#include <QFontDatabase>
#include <QPainter>
#include <QPalette>
#include <QStyle>
#include <QToolTip>
#include <algorithm>
#include <cmath>

namespace relief::studio {

namespace {

struct Applied {
  Theme theme = dark_theme();
  double scale = 1;
  bool reduced_motion = false;
};

Applied& applied() {
  static Applied current;
  return current;
}

QPalette palette(const Theme& t) {
  QPalette p;
  p.setColor(QPalette::Window, t.panel);
  p.setColor(QPalette::WindowText, t.text);
  p.setColor(QPalette::Base, t.field);
  p.setColor(QPalette::AlternateBase, t.panel);
  p.setColor(QPalette::Text, t.text);
  p.setColor(QPalette::PlaceholderText, t.dim);
  p.setColor(QPalette::Button, t.raised);
  p.setColor(QPalette::ButtonText, t.text);
  p.setColor(QPalette::BrightText, t.bad);
  p.setColor(QPalette::ToolTipBase, t.raised);
  p.setColor(QPalette::ToolTipText, t.text);
  p.setColor(QPalette::Highlight, t.accent);
  p.setColor(QPalette::HighlightedText, t.on_accent);
  p.setColor(QPalette::Link, t.accent);
  p.setColor(QPalette::LinkVisited, t.dim);
  p.setColor(QPalette::Light, t.raised);
  p.setColor(QPalette::Midlight, t.raised);
  p.setColor(QPalette::Mid, t.line);
  p.setColor(QPalette::Dark, t.line);
  p.setColor(QPalette::Shadow, t.window);
  const QColor faint = mixed(t.panel, t.dim, 0.6);
  for (const auto role : {QPalette::WindowText, QPalette::Text, QPalette::ButtonText})
    p.setColor(QPalette::Disabled, role, faint);
  p.setColor(QPalette::Disabled, QPalette::Highlight, t.line);
  p.setColor(QPalette::Disabled, QPalette::HighlightedText, t.dim);
  return p;
}

/// Share of linear light of an sRGB channel (IEC 61966-2-1).
double linear(double channel) {
  return channel <= 0.04045 ? channel / 12.92 : std::pow((channel + 0.055) / 1.055, 2.4);
}

double luminance(const QColor& c) {
  return 0.2126 * linear(double(c.redF())) + 0.7152 * linear(double(c.greenF())) + 0.0722 * linear(double(c.blueF()));
}

}  // namespace

const Theme& dark_theme() {
  static const Theme theme{.window = 0x17191d,
                           .panel = 0x212429,
                           .raised = 0x2b2f36,
                           .field = 0x15171a,
                           .line = 0x343942,
                           .text = 0xdfe2e7,
                           .dim = 0x949ba6,
                           .accent = 0xe39a5c,
                           .on_accent = 0x1b130c,
                           .good = 0x5fb3a3,
                           .warn = 0xe8c15a,
                           .bad = 0xea7d78};
  return theme;
}

const Theme& light_theme() {
  static const Theme theme{.window = 0xd6d9dc,
                           .panel = 0xeceef0,
                           .raised = 0xffffff,
                           .field = 0xffffff,
                           .line = 0xb9bfc5,
                           .text = 0x22262b,
                           .dim = 0x535b64,
                           .accent = 0x8f4510,
                           .on_accent = 0xffffff,
                           .good = 0x10685a,
                           .warn = 0x6f5100,
                           .bad = 0xa32b26};
  return theme;
}

const Theme& current_theme() { return applied().theme; }

bool is_dark(const Theme& theme) { return luminance(theme.panel) < luminance(theme.text); }

double text_scale() { return applied().scale; }

int scaled(double pixels) { return static_cast<int>(std::lround(pixels * text_scale())); }

void apply(QApplication& application, const Theme& theme, double scale) {
  applied().theme = theme;
  applied().scale = std::clamp(scale, 0.8, 2.0);
  // One beside another, entries with a picture and those with a box to check would begin at different places.
  QApplication::setAttribute(Qt::AA_DontShowIconsInMenus);
  application.setStyle(new Style);  // the application owns it
  application.setPalette(palette(theme));
  QToolTip::setPalette(palette(theme));
  application.setFont(ui_font());
  application.setStyleSheet(style_sheet());
}

bool reduced_motion() { return applied().reduced_motion; }

void set_reduced_motion(bool reduced) { applied().reduced_motion = reduced; }

QFont ui_font(double points, QFont::Weight weight) {
  QFont font;
  // "Inter" by name would fall back to whatever fontconfig likes best; the desktop's own font is the better guess.
  static const bool installed = QFontDatabase::families().contains(QStringLiteral("Inter"));
  if (installed)
    font.setFamilies({QStringLiteral("Inter"), QFontDatabase::systemFont(QFontDatabase::GeneralFont).family()});
  else
    font = QFontDatabase::systemFont(QFontDatabase::GeneralFont);
  font.setPointSizeF(points * text_scale());
  font.setWeight(weight);
  font.setHintingPreference(QFont::PreferNoHinting);
  return font;
}

QColor mixed(const QColor& under, const QColor& over, double share) {
  const auto mix = [share](int a, int b) { return static_cast<int>(std::lround(a + (b - a) * share)); };
  return {mix(under.red(), over.red()), mix(under.green(), over.green()), mix(under.blue(), over.blue())};
}

double contrast(const QColor& a, const QColor& b) {
  const auto [low, high] = std::minmax({luminance(a), luminance(b)});
  return (high + 0.05) / (low + 0.05);
}

QColor curve_blue(const Theme& theme) { return is_dark(theme) ? QColor(0x6aa2e8) : QColor(0x2a62b0); }

QColor colour_of(Mood mood) {
  const Theme& theme = current_theme();
  switch (mood) {
    case Mood::Good:
      return theme.good;
    case Mood::Warn:
      return theme.warn;
    case Mood::Bad:
      return theme.bad;
    case Mood::Plain:
      break;
  }
  return theme.text;
}

QString icon_of(Mood mood) {
  switch (mood) {
    case Mood::Good:
      return QStringLiteral("check");
    case Mood::Warn:
      return QStringLiteral("warning");
    case Mood::Bad:
      return QStringLiteral("error");
    case Mood::Plain:
      break;
  }
  return QStringLiteral("info");
}

int text_flags(Qt::LayoutDirection direction, Qt::AlignmentFlag side) {
  return static_cast<int>((QStyle::visualAlignment(direction, side) | Qt::AlignVCenter).toInt());
}

double corner() { return 5 * text_scale(); }

void paint_field(QPainter& painter, const QRectF& rect, bool focus) {
  const Theme& theme = current_theme();
  const double width = focus ? 2 : 1;
  painter.setRenderHint(QPainter::Antialiasing);
  painter.setPen(QPen(focus ? theme.accent : theme.line, width));
  painter.setBrush(theme.field);
  const double inset = width / 2;
  painter.drawRoundedRect(rect.adjusted(inset, inset, -inset, -inset), corner(), corner());
}

}  // namespace relief::studio
