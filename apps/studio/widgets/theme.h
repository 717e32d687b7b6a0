// The look of the program: twelve colours, from which palette, style sheet, icons and painted widgets are made.
#pragma once

#include <QColor>
#include <QFont>
#include <QString>

class QApplication;
class QPainter;
class QRectF;
class QWidget;

namespace relief::studio {

/// Dark and light differ in these only. Text, accent and state colours reach 4.5:1 on every background that they stand
/// on, borders 1.3:1 (WCAG 2.1, contrast ratio).
struct Theme {
  QColor window;  ///< behind everything: menu bar, status bar, gaps between panels
  QColor panel;   ///< docks, tool bars, dialogs
  QColor raised;  ///< buttons, menus, selected rows
  QColor field;   ///< what is typed or dragged in, plots
  QColor line;    ///< borders
  QColor text;
  QColor dim;        ///< text of lesser weight: units, hints, axes
  QColor accent;     ///< what is chosen, the part of a bar that is filled, the focus ring
  QColor on_accent;  ///< text on `accent`
  QColor good, warn, bad;
  friend bool operator==(const Theme&, const Theme&) = default;
};

/// How good the news is. Its colour never stands alone: an icon and words say the same.
enum class Mood { Plain, Good, Warn, Bad };

[[nodiscard]] const Theme& dark_theme();
[[nodiscard]] const Theme& light_theme();

/// The theme last applied; the dark one before that. UI thread.
[[nodiscard]] const Theme& current_theme();
[[nodiscard]] bool is_dark(const Theme& theme);
/// Text size as a share of 10 points, as last applied; 0.8..2.
[[nodiscard]] double text_scale();
/// Pixels at 100 % text, in pixels at the text size in use. For paddings and sizes of painted widgets.
[[nodiscard]] int scaled(double pixels);

/// Sets style (Fusion with our own marks), palette, style sheet and font of the whole program; may be called again at
/// any time, open windows follow. `scale` is brought into 0.8..2. UI thread, some milliseconds per open window.
void apply(QApplication& application, const Theme& theme, double scale);

/// Whether things may move by themselves: fades and slides. UI thread.
[[nodiscard]] bool reduced_motion();
void set_reduced_motion(bool reduced);

/// Inter at `points` x text_scale() without hinting; where it is not installed, the desktop's own font.
[[nodiscard]] QFont ui_font(double points = 10, QFont::Weight weight = QFont::Normal);

/// Share of `over` on `under`, both opaque; 0..1.
[[nodiscard]] QColor mixed(const QColor& under, const QColor& over, double share);
/// Contrast ratio of two opaque colours, 1..21 (WCAG 2.1, relative luminance).
[[nodiscard]] double contrast(const QColor& a, const QColor& b);
/// A second colour for curves, blue, legible on `field`.
[[nodiscard]] QColor curve_blue(const Theme& theme);

/// Parts that several painted widgets share: a field with rounded border, its border in the accent colour where
/// `focus`.
void paint_field(QPainter& painter, const QRectF& rect, bool focus);
/// Text colour for Plain, else the state's.
[[nodiscard]] QColor colour_of(Mood mood);
/// Id of the icon that says the same as the colour.
[[nodiscard]] QString icon_of(Mood mood);
/// For QPainter::drawText: on that side of where text runs from left to right, on the other elsewhere; in the middle of
/// the height.
[[nodiscard]] int text_flags(Qt::LayoutDirection direction, Qt::AlignmentFlag side);
/// Radius of rounded corners in pixels.
[[nodiscard]] double corner();

}  // namespace relief::studio
