// The layers of the model, and which of them are seen.
#pragma once

#include <relief/core/snapshot.h>
#include <relief/render/frame.h>

#include <QWidget>
#include <functional>

class QToolButton;
class QVBoxLayout;

namespace relief::studio {

/// A row for each layer that the model has: an eye where it can be left out of the picture.
class LayersPanel : public QWidget {
  Q_OBJECT
 public:
  explicit LayersPanel(QWidget* parent = nullptr);
  /// Null: no model. Returns whether other layers are listed than before.
  bool set_model(const Snapshot* model);
  void set_look(const Look& look);

 signals:
  void lookChanged(const relief::Look& look);

 private:
  void add_row(Layer layer);
  void rebuild(unsigned layers);

  QVBoxLayout* rows_;
  unsigned layers_ = 0;  ///< bit by layer
  Look look_;
};

}  // namespace relief::studio
