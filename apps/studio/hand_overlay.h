// The hand in the picture: its tool, what it touches, and with how much force.
#pragma once

#include "overlays.h"

#include <relief/haptics/servo.h>

namespace relief::studio {

/// The stylus with its tip where the device is, a ring around the contact point, the virtual spring between the two,
/// and an arrow for the force. Where the tip is in the material, the gap between the two is what the hand would feel.
class HandOverlay : public Overlay {
 public:
  struct Shown {
    ServoSample sample;
    double force_limit = 1;  ///< N, whose arrow is the longest
    bool has_orientation = false;
  };
  std::optional<Shown> shown;

  [[nodiscard]] QRectF bounds(const OverlayView& view) const override;
  void paint(QPainter& painter, const OverlayView& view) const override;

 private:
  /// In pixels.
  struct Lines {
    QPointF tip, end;  ///< of the stylus
    double thick = 0;  ///< of its end
    QPolygonF ring;    ///< around the contact point; empty without contact
    QLineF spring;     ///< from the tip to the contact point
    QLineF arrow;      ///< of the force; no length where there is none
  };
  [[nodiscard]] std::optional<Lines> lines(const OverlayView& view) const;
};

}  // namespace relief::studio
