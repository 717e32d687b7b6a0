// Texture that is too fine for the speed of the tip is faded out.
#pragma once

#include <relief/core/query.h>

#include <array>
#include <cstddef>
#include <cstdint>

namespace relief {

/// Watches the texture under a tool. Waves that pass in less than two ticks alias: they come back as a buzz
/// that the surface does not have. Where they prevail, the texture fades out. It samples the path between two ticks
/// twice per cell, and costs next to nothing within one cell. No allocation, no lock.
class TextureFade {
 public:
  /// Holds what a tool feels in a tick.
  struct Felt {
    const SurfacePoint& at;  ///< where it touches
    Vec3d normal;            ///< unit, of the contact
    Vec3d held;              ///< where the tool's origin would be if nothing gave way, model units
    bool is_point = true;    ///< it is a single point, and `held` is where that touches
  };
  /// Holds what is to be taken off.
  struct Fade {
    double share = 0;  ///< 0..1; 0 while the texture can be felt as it is
    Vec3d above;       ///< model units: how far the tool is held above its way of lately, up to a wave's height
    Vec3d normal;      ///< unit, of what it ran over lately
  };
  /// Returns one tick. Waves that are lower than `unfelt` from top to bottom (model units) are none.
  Fade step(const Snapshot& model, const Felt& felt, double unfelt) noexcept;
  /// The tool lost its contact.
  void reset() noexcept { *this = {}; }

 private:
  /// Takes in the surface's height at the end of a piece of the way; there are so many pieces in this tick. Whether a
  /// wave has turned there.
  bool run_over(double way, double height, int pieces, double unfelt) noexcept;
  /// Another place's heights are counted from elsewhere: the tool was held at this one there in the last tick.
  void shift_to(double height) noexcept;
  /// Returns how far the tool is held above the straight line through the heights of the last ticks.
  [[nodiscard]] double above_line() const noexcept;

  /// Of the line: ten of the longest waves that fade (ItsLineGoesThroughTheLastTwentyTicks).
  static constexpr std::size_t kTicks = 20;
  /// Places of one root, u and v being those there: so cuts make no difference.
  struct InRoot {
    std::uint64_t roots = 0;  ///< their number
    SlabId root = kNoSlab;
    double u = 0, v = 0;
    [[nodiscard]] bool is_in_its_root() const noexcept { return u >= 0 && v >= 0 && u + v <= 1; }
  };
  static InRoot in_root(const SlabMesh& mesh, const RootPlace& place, double u, double v) noexcept;

  InRoot last_;  ///< where the tool touched
  Vec3d last_position_, origin_;
  double fibre_ = 0;                      ///< the length of the fibre there, model units
  double height_ = 0;                     ///< of the surface there over the inner end of its fibre, model units
  double held_ = 0;                       ///< likewise, of the place where the tool was held
  std::array<double, kTicks> heights_{};  ///< means of that in the last ticks
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
