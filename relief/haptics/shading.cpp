#include <relief/haptics/shading.h>

#include <algorithm>

namespace relief {

namespace {
// The next two: TheAccountHoldsATenthOfAMillimetreTimesTheForceOrThreeTenthsOfANewton.
constexpr double kSlack = 1e-4;  // m: times the force, what may be given ahead of what comes back
constexpr double kLight = 0.3;   // N: a force below it is taken for this one, as light touches would have no slack
// Of force times way: what may be given for good, less than any device's friction
// (NormalsThatAlwaysLeanForwardsAreLedBack).
constexpr double kFree = 3e-4;
}  // namespace

Vec3d Shading::step(Vec3d shaded, Vec3d way_out, double force, double stored, Vec3d move, double turn) noexcept {
  const double most = kSlack * std::max(kLight, force);
  const Vec3d last = normal_ * force_;
  const auto normal = [&] {
    const Vec3d wanted =
        given_ > 0 ? normalized(way_out + (shaded - way_out) * (1 - std::min(given_ / most, 1.0))) : shaded;
    return force_ > 0 ? turned_by(normal_, wanted, turn) : wanted;
  };
  const double before = given_;
  for (int k = 0; k < 2; ++k) {  // the normal goes by the account, and that by the normal
    given_ = before + EnergyAccount(energy_).book(dot(last + normal() * force, move) / 2, stored, 0);
    // What comes on top of the most is not shading's doing, and shading could not take it back.
    given_ = std::clamp(given_, -most, std::max(before, most));
    if (!(given_ > 0)) break;
    given_ = std::max(0.0, given_ - kFree * force * length(move));
  }
  normal_ = normal();
  force_ = force;
  energy_.set(stored);
  return normal_;
}

}  // namespace relief
