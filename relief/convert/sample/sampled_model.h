// From a cage and the surface in it to a model: displacement, marks, colours.
#pragma once

#include <relief/base/error.h>
#include <relief/base/progress.h>
#include <relief/convert/convert.h>
#include <relief/convert/sample/fibre_sampling.h>
#include <relief/convert/sample/source_rays.h>
#include <relief/core/snapshot.h>

#include <memory>
#include <span>

namespace relief::detail {

/// Where no error is asked for, what is aimed at; share of the diagonal. F. i. 0.1 mm of a head.
inline constexpr double kUsualError = 1e-4;
/// Beyond the error that was requested, rounding.
inline constexpr double kAsGood = 1 + 1e-6;

/// Holds what is sampled, and what of it was scanned.
struct SampledSurface {
  SampleSource source;
  std::span<const Vec3d> points;    ///< model units
  std::span<const Face> triangles;  ///< those that are not fill
  bool marks_misses = false;        ///< what meets nothing is marked like what meets the source several times
};

/// Samples the displacement along the fibres. Each slab is sampled about as finely as its part of the source; then its
/// n goes down as far as the error allows, or doubles until a requested error is kept. A given n stays. `hits` counts
/// at least a million fibres. Errors: Cancelled.
[[nodiscard]] Result<SnapshotPtr> sample_model(std::shared_ptr<const SlabMesh> cage, const SampledSurface& surface,
                                               const ConvertSettings& settings, double diagonal, HitCount& hits,
                                               const Progress& progress);

/// Returns the model with the colours of the source as it was read, where fibres cross it. Errors: Cancelled.
[[nodiscard]] Result<SnapshotPtr> add_colours(const SnapshotPtr& model, const SourceRays& surface,
                                              const Lattice& lattice, const TriangleMesh& source,
                                              const ConvertSettings& settings, const Progress& progress);

}  // namespace relief::detail
