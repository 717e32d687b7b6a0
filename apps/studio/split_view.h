// The picture, and beside it another one that shows figures of the surface.
#pragma once

#include "viewport.h"

#include <QSplitter>
#include <optional>

namespace relief::studio {

/// The second view is made when it is asked for and goes when it is closed. Both show the same snapshots from the same
/// eye, and strokes can be made in both.
class SplitView : public QSplitter {
  Q_OBJECT
 public:
  SplitView(DocumentBridge& bridge, ToolState& tools, QWidget* parent = nullptr);
  [[nodiscard]] Viewport& shaded() { return *shaded_; }
  /// Null while it is closed.
  [[nodiscard]] Viewport* analysis() { return analysis_; }
  /// That of the first view; the second one keeps its map.
  void set_look(const Look& look);
  /// The newest stroke of the pointer in either view, once more; not while a hand is at work in one of them.
  void repeat_stroke();
  /// The view that the pointer is over, else the first one.
  [[nodiscard]] Viewport& pointed_at();
  /// Of both views.
  void set_map(NavigationMap map);
  void set_turntable(bool turntable);
  /// Empty, or Map::None, closes it.
  void show_map(std::optional<Look::Map> map);

 signals:
  /// To be connected like the first one.
  void analysisMade(relief::studio::Viewport* analysis);

 private:
  void make();
  void note_strokes(Viewport& view);
  void follow(Viewport& leader, Viewport& follower);

  DocumentBridge& bridge_;
  ToolState& tools_;
  Viewport* shaded_;
  Viewport* analysis_ = nullptr;
  bool following_ = false;
  PointerStroke last_stroke_;  ///< on the model that is shown
};

}  // namespace relief::studio
