// How much clay a model has: how deep tools may cut along the fibres, and how high they may build.
#pragma once

#include <relief/core/snapshot.h>

#include <cstddef>

namespace relief {

/// On one side of the surface, along the fibres, shares of the diagonal that was given.
struct ClaySide {
  static constexpr double kThin = 0.02;  ///< less than that is soon used up: a tool takes 0.005 to 0.02 at a time
  double least = 0;                      ///< of all fibres
  double tenth = 0;                      ///< one fibre in ten has less
  double median = 0;                     ///< one in two
  double thin_fibres = 0;                ///< share of the fibres that have less than kThin
  double thin_samples = 0;               ///< share of the samples, each slab's own ones
  Vec3d least_at;                        ///< the surface at the fibre that has the least, model units
};

/// The clay of a slab, on both sides of the surface.
struct Clay {
  /// towards the inner triangle, and towards the outer one
  ClaySide below, above;
  std::size_t fibres = 0;  ///< looked at: not those in holes
};

/// Of what is not a hole. Some 5 ns per sample; only a snapshot that is nothing but holes has no fibres. Any thread.
[[nodiscard]] Clay measure_clay(const Snapshot& model, double diagonal);

}  // namespace relief
