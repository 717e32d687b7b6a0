// The second page of a kiosk: one exhibit, and what can be done to it.
#pragma once

#include "exhibits.h"
#include "tool_state.h"
#include "viewport.h"

class QBoxLayout;
class QButtonGroup;
class QLabel;
class QPushButton;
class QVBoxLayout;

namespace relief::studio {

/// Large controls around the picture: tools at the left, the caption, colours, Undo and Start again at the right.
class KioskStage : public QWidget {
  Q_OBJECT
 public:
  KioskStage(DocumentBridge& bridge, ToolState& tools, QWidget* parent = nullptr);
  /// The tools, keys and colours that this exhibit has.
  void set_exhibit(const Exhibit& exhibit);
  void set_language(const Exhibit& exhibit, const QString& language);
  /// Whether there is something to undo.
  void set_touched(bool touched);
  void set_others(bool others);
  /// Hides all but the picture.
  void set_controls_shown(bool shown);
  [[nodiscard]] Viewport& viewport() { return *viewport_; }

 signals:
  void undoAsked();
  void againAsked();
  void othersAsked();

 private:
  void add_tools(const QStringList& ids);
  void add_colours();
  void choose(const QString& id);

  ToolState& tools_;
  Viewport* viewport_;
  QWidget *left_, *right_, *colours_;
  QVBoxLayout* tool_column_;
  QButtonGroup* tool_group_;
  QLabel *title_, *sentences_;
  QPushButton *undo_, *again_, *others_;
};

}  // namespace relief::studio
