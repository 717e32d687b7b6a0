// A small model for tests of windows.
#pragma once

#include <relief/convert/convert.h>
#include <relief/core/query.h>
#include <relief/mesh/samples.h>

#include <studio/bridge.h>

#include <QApplication>

namespace relief::studio {

/// A bowl of 40 slabs, made once.
inline const Model& bowl() {
  static const Model model = [] {
    ConvertSettings settings;
    settings.slabs = 40;
    settings.intervals = 7;
    return convert(*make_sample("bowl", 4000), settings)->model;
  }();
  return model;
}

/// Carves where the model is nearest to the corner of its box, and waits until the window has heard of it.
inline void dent(DocumentBridge& bridge, double pressure = 1) {
  const SnapshotPtr head = bridge.head();
  const Box3d box = bounds_of_surface(*head);
  BeginStroke begin;
  begin.brush.radius = 0.2 * diagonal(box);
  bridge.post(begin);
  bridge.post(MoveStroke{.points = {{0, closest_point(*head, box.high).position, pressure}}});
  bridge.post(EndStroke{});
  bridge.document()->settle();
  QApplication::processEvents();
}

}  // namespace relief::studio
