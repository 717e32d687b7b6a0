// The settings of the tool in the hand, made from its row in the library.
#pragma once

#include "tool_state.h"
#include "widgets/column_area.h"
#include "widgets/value_format.h"

#include <relief/base/unit.h>

#include <functional>
#include <vector>

class QCheckBox;
class QLabel;
class QVBoxLayout;

namespace relief::studio {

class CurveEditor;
class ColourPanel;

/// How a setting's value is shown and typed.
[[nodiscard]] ValueFormat format_of(const SettingInfo& setting, Unit unit);

/// Radius and strength are in the bar above the picture and not here. Tools that come later need no line of this.
class ToolPanel : public ColumnArea {
  Q_OBJECT
 public:
  explicit ToolPanel(ToolState& tools, QWidget* parent = nullptr);
  /// The same for all tools, so that the panels below stay where they are when another one is taken.
  [[nodiscard]] QSize sizeHint() const override;
  void set_unit(Unit unit);
  /// What the pointer says about itself: "Mouse: no pressure", or a pen's name and pressure, 0..1.
  void set_pointer(const QString& words, double pressure);

 signals:
  void pickColour();

 private:
  void build();
  void refresh();
  void add_setting(const SettingInfo& setting, QVBoxLayout& into);
  void add_pressure(QVBoxLayout& into);

  ToolState& tools_;
  Unit unit_ = Unit::Millimetre;
  std::vector<std::function<void()>> refreshers_;
  QLabel* pointer_ = nullptr;
  CurveEditor* curve_ = nullptr;
  QString pointer_words_;
};

}  // namespace relief::studio
