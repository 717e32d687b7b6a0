// Colours to paint with: sixteen with names that can be spoken, and the last ones used.
#pragma once

#include <QAbstractButton>
#include <QColor>
#include <QList>
#include <QWidget>
#include <span>

class QButtonGroup;
class QGridLayout;
class QPushButton;

namespace relief::studio {

struct NamedColour {
  const char* name;  ///< English; spoken_name() translates it
  QRgb colour;
};
/// Sixteen, all different to the eye and in name.
[[nodiscard]] std::span<const NamedColour> palette_colours();

/// "brick red"; for a colour that is not in the palette "close to brick red, #a93327".
[[nodiscard]] QString spoken_name(const QColor& colour);

/// One colour as a button; chosen, it has a ring around it.
class Swatch : public QAbstractButton {
  Q_OBJECT
 public:
  explicit Swatch(const QColor& colour, QWidget* parent = nullptr);
  [[nodiscard]] QColor colour() const { return colour_; }
  QSize sizeHint() const override;

 protected:
  void paintEvent(QPaintEvent* event) override;

 private:
  QColor colour_;
};

/// Two rows of eight, a row of what was used last, and a button for any colour. Arrows move from swatch to swatch.
class ColourPalette : public QWidget {
  Q_OBJECT
 public:
  static constexpr qsizetype kLastUsed = 12;

  explicit ColourPalette(QWidget* parent = nullptr);

  [[nodiscard]] QColor colour() const { return colour_; }
  /// Emits nothing.
  void set_colour(const QColor& colour);
  /// After a stroke: the colour goes to the front of the last used.
  void mark_used(const QColor& colour);
  /// Newest first, at most kLastUsed, each once.
  [[nodiscard]] const QList<QColor>& last_used() const { return last_used_; }
  void set_last_used(const QList<QColor>& colours);

 signals:
  void colourPicked(const QColor& colour);

 private:
  Swatch* add_swatch(const QColor& colour, int row, int column);
  void fill_last_used();
  void show_chosen();
  void pick(const QColor& colour);
  void ask_for_any();

  QColor colour_;
  QList<QColor> last_used_;
  QList<Swatch*> recent_;
  QButtonGroup* group_;
  QGridLayout* grid_;
  QPushButton* more_;
};

}  // namespace relief::studio
