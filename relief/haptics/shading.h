// Shaded normals that make no energy.
#pragma once

#include <relief/base/vec.h>
#include <relief/haptics/energy.h>

namespace relief {

/// Keeps interpolated normals from generating energy. A force along such a normal is not a gradient: on a closed path
/// over fine relief the hand gets out more than it put in. The account compares the work on the hand with the spring.
/// Beyond 0.1 mm times the force, the normal turns to the direction of the contact point, along which nothing is
/// gained, until the surplus is back.
class Shading {
 public:
  /// Returns the unit normal to push along in this tick. `shaded`, `way_out`: unit. `force`: N. `stored`: J in its
  /// spring. `move`: m, of the hand since the last tick. `turn`: rad, the most between two ticks' normals. Cost: a few
  /// nanoseconds.
  [[nodiscard]] Vec3d step(Vec3d shaded, Vec3d way_out, double force, double stored, Vec3d move, double turn) noexcept;
  /// No contact in this tick. The account stays.
  void rest() noexcept { change(0, 0); }
  /// Something else than the hand has changed the spring to this.
  void change(double force, double stored) noexcept {
    force_ = force;
    energy_.set(stored);
  }
  /// The spring has become so many times as stiff, which is not the hand's doing.
  void stiffen(double by) noexcept { change(force_ * by, energy_.stored() * by); }
  /// Forgets the contact.
  void reset() noexcept { *this = {}; }
  /// J that the hand got and did not put in; negative where it put in more.
  [[nodiscard]] double given() const noexcept { return given_; }

 private:
  double given_ = 0;
  Vec3d normal_;      ///< of the last tick
  double force_ = 0;  ///< N, along it; 0: without contact
  EnergyAccount energy_;
};

}  // namespace relief
