// How far the displaced surface lies from another, and back.
#pragma once

#include <relief/convert/convert.h>
#include <relief/convert/lattice.h>
#include <relief/convert/source_surface.h>
#include <relief/core/snapshot.h>

#include <span>

namespace relief::detail {

/// The displaced surface of a model, without its holes. All distances are in lattice steps, over an even choice of
/// about ten thousand points. The same for any number of threads.
class MeasuredSurface {
 public:
  /// Both must outlive it.
  MeasuredSurface(const Snapshot& model, const Lattice& lattice) : model_(model), lattice_(lattice) {}

  /// From points inside micro-triangles to the nearest points of the other surface.
  [[nodiscard]] Distance to(const SourceSurface& other) const;
  /// From points spread over these triangles, by area, to this surface: to the micro-triangles about the place where
  /// the point lies in its slab, so never less than it is; points outside all slabs are compared with everything.
  [[nodiscard]] Distance from(std::span<const Vec3d> points, std::span<const Face> faces) const;

 private:
  [[nodiscard]] double distance_from(Vec3d model_point) const;
  const Snapshot& model_;
  const Lattice& lattice_;
};

}  // namespace relief::detail
