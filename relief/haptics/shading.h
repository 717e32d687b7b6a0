// Shaded normals that make no energy.
#pragma once

#include <relief/base/vec.h>

namespace relief {

/// A force along an interpolated normal is no gradient: led around a closed way over relief that is finer than the
/// contact is deep, a hand gets more out of it than it put in. So account is kept of what the hand got and what is left
/// in the spring. What is given beyond a little (0.1 mm times the force) leads the normal over to the straight way out,
/// along which nothing is gained, until it has come back. That goes with the way, not with time: at rest nothing
/// changes. What a crest or a groove gives on one side and takes on the other is less than that little. The normal
/// turns no faster than the way out may, so that the force does not jump where the account is soon full.
class Shading {
 public:
  /// The normal to push along in this tick, unit. `shaded`, `way_out`: unit; `force`: N, along it; `stored`: J in its
  /// spring, of which `gift` came by other ways than the hand's in this tick; `move`: m, the hand's since the last
  /// tick; `turn`: rad, between this tick's normal and the last one's of the contact, at most. A few nanoseconds.
  [[nodiscard]] Vec3d step(Vec3d shaded, Vec3d way_out, double force, double stored, double gift, Vec3d move,
                           double turn) noexcept;
  /// No contact in this tick. The account stays.
  void rest() noexcept { force_ = stored_ = 0; }
  /// The model was moved under the tool: what the spring gains in the next tick is not the hand's doing.
  void moved() noexcept { moved_ = true; }
  /// The spring has become so many times as stiff, which is not the hand's doing.
  void stiffen(double by) noexcept { force_ *= by, stored_ *= by; }
  void reset() noexcept { *this = {}; }
  /// J that the hand got and did not put in; negative where it put in more.
  [[nodiscard]] double given() const noexcept { return given_; }

 private:
  double given_ = 0;
  bool moved_ = false;
  Vec3d normal_;       ///< of the last tick
  double force_ = 0;   ///< N, along it; 0: without contact
  double stored_ = 0;  ///< J in the spring then
};

}  // namespace relief
