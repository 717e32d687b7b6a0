// Texture that is too fine for the speed of the tip is faded out.
#pragma once

#include <relief/core/query.h>

#include <array>
#include <cstddef>
#include <cstdint>

namespace relief {

/// Watches the texture under the contact point. Waves that pass in less than two ticks alias: they come back as a buzz
/// that the surface does not have. Where they prevail, the texture fades out. It samples the path between two ticks
/// twice per cell, and costs next to nothing within one cell. No allocation, no lock.
class TextureFade {
 public:
  /// Holds what is to be taken off.
  struct Fade {
    double share = 0;  ///< 0..1; 0 while the texture can be felt as it is
    /// Model units: how far the surface at the point stands above what it ran over lately, up to a wave's height.
    Vec3d above;
    Vec3d normal;  ///< unit, of what it ran over lately
  };
  /// Returns one tick: the point is now at `at`, and the contact's normal is `normal`. Waves that are lower than
  /// `unfelt` from top to bottom (model units) are none.
  Fade step(const Snapshot& model, const SurfacePoint& at, Vec3d normal, double unfelt) noexcept;
  /// The point lost its contact.
  void reset() noexcept { *this = {}; }

 private:
  /// Takes in the surface's height at the end of a piece of the way; there are so many pieces in this tick. Whether a
  /// wave has turned there.
  bool run_over(double way, double height, int pieces, double unfelt) noexcept;
  /// Another surface's heights are counted from elsewhere: this one goes on at `height`.
  void shift_to(double height) noexcept;
  /// Returns how far the last height is above the straight line through those of the last ticks.
  [[nodiscard]] double above_line() const noexcept;

  static constexpr std::size_t kTicks = 20;  ///< of the line: ten of the longest waves that fade
  /// Places of one root, u and v being those there: so cuts make no difference.
  struct InRoot {
    std::uint64_t roots = 0;  ///< their number
    SlabId root = kNoSlab;
    double u = 0, v = 0;
  };
  InRoot last_;  ///< where the point was
  Vec3d last_position_;
  double fibre_ = 0;                      ///< the length of the fibre there, model units
  double height_ = 0;                     ///< of the surface there over the inner end of its fibre, model units
  std::array<double, kTicks> heights_{};  ///< means of the last ticks
  std::size_t tick_ = 0;                  ///< the number of the oldest
  double slope_ = 0;                      ///< along the way, mean of lately
  double unevenness_ = 0;                 ///< mean square of the slope's difference from that
  bool rising_ = false;                   ///< the side of the mean on which the slope was last
  double swing_ = 0;                      ///< height gained against the mean slope on this side, model units
  double wave_ = 0;                       ///< mean of that per turn: the waves' height, model units
  double turns_ = 0;                      ///< changes of side per tick: two for each wave
  Vec3d normal_;                          ///< mean of lately
};

}  // namespace relief
