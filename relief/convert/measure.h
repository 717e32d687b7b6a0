// How far the displaced surface lies from another, and back.
#pragma once

#include <relief/convert/convert.h>
#include <relief/convert/lattice.h>
#include <relief/convert/source_surface.h>
#include <relief/core/snapshot.h>

#include <span>

namespace relief::detail {

/// The displaced surface of a model, without its holes. All distances are in lattice steps, over an even choice of
/// about ten thousand points. The same for any number of threads; without meaning when cancelled.
class MeasuredSurface {
 public:
  /// Both must outlive it.
  MeasuredSurface(const Snapshot& model, const Lattice& lattice) : model_(model), lattice_(lattice) {}

  /// From points inside micro-triangles to the nearest points of the other surface.
  [[nodiscard]] Distance to(const SourceSurface& other, const Progress& progress) const;
  /// From points spread over these triangles, by area, to this surface; they are in model units, and what is not finite
  /// is left out. Compared are the micro-triangles about the place where the point lies in its slab, so never less than
  /// it is; points outside all slabs are compared with everything, where there are very many a choice of them.
  [[nodiscard]] Distance from(std::span<const Vec3d> points, std::span<const Face> faces,
                              const Progress& progress) const;

 private:
  /// To the micro-triangles about the place where the point lies in its slab; below zero outside all slabs.
  [[nodiscard]] double distance_within(Vec3d model_point) const;
  const Snapshot& model_;
  const Lattice& lattice_;
};

}  // namespace relief::detail
