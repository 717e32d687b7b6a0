// What the demo's simulated hand does: it feels the front of a model, carves a face into it, builds brows, and paints.
#pragma once

#include <relief/core/snapshot.h>
#include <relief/devices/simulated_hand.h>
#include <relief/edit/editor.h>
#include <relief/haptics/servo.h>

#include <atomic>
#include <memory>
#include <vector>

namespace relief::demo {

/// One leg of the hand's way: from the place before to `position` in `seconds`, with the buttons held.
struct Leg {
  Vec3d position;  ///< m, where the hand pulls to
  double seconds = 0;
  std::uint32_t buttons = 0;
};

/// A place of the surface, as it was at first, that is to have a colour in the end.
struct Painted {
  Vec3d position;  ///< model units
  Vec3f colour;    ///< sRGB
  double radius;   ///< of the brush, model units
};

struct Performance {
  std::vector<Leg> legs;
  std::vector<Painted> painted;
  std::vector<Brush> brushes;  ///< chosen by the buttons, see Session::set_brushes
  double seconds = 0;
};

/// Plans the way over the surface as it is now, seen from +z. `brief` keeps one eye only. A model without a surface in
/// front of some part of the face gets the other parts.
[[nodiscard]] Performance plan_face(const Snapshot& model, const Workspace& workspace, bool brief);

/// The performance as a script; sets `done` when it is over. Does not allocate when called.
[[nodiscard]] HandScript script_of(const Performance& performance, std::shared_ptr<std::atomic<bool>> done);

}  // namespace relief::demo
