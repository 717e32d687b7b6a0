// The one question of a first start: with which buttons people turn the view.
#pragma once

#include <QFrame>

namespace relief::studio {

/// Three maps, each with a picture of the mouse or the pen. A card among others, not a dialog: who does not answer
/// works with the first one.
class NavigationCard : public QFrame {
  Q_OBJECT
 public:
  explicit NavigationCard(QWidget* parent = nullptr);

 signals:
  /// "blender", "industry" or "pen", as the preferences name them.
  void mapChosen(const QString& map);
};

}  // namespace relief::studio
