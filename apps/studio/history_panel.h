// All strokes, as rows that one can go to.
#pragma once

#include "bridge.h"

#include <QListWidget>

namespace relief::studio {

/// A row per stroke and one for the model as it was converted; those that were undone are dim. The last one that is on
/// the disk is marked.
class HistoryPanel : public QListWidget {
  Q_OBJECT
 public:
  explicit HistoryPanel(DocumentBridge& bridge, QWidget* parent = nullptr);
  [[nodiscard]] QSize sizeHint() const override;

 protected:
  bool event(QEvent* event) override;

 private:
  void refresh();
  void go_to(int row);

  DocumentBridge& bridge_;
  quint64 saved_ = 0, undo_ = 0;
  bool filling_ = false;
};

}  // namespace relief::studio
