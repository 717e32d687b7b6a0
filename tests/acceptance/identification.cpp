// S10: what the force law was set to, recovered from what it did.
#include "acceptance/acceptance.h"
#include "support/driver.h"
#include "support/held_tools.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace relief::acceptance {
namespace {

constexpr int kUnknowns = 5;  // stiffness, damping, and a constant force

/// Least squares by the normal equations.
class Fit {
 public:
  void add(const std::array<double, kUnknowns>& factors, double value) {
    for (std::size_t i = 0; i < kUnknowns; ++i) {
      for (std::size_t j = 0; j < kUnknowns; ++j) matrix_[i][j] += factors[i] * factors[j];
      right_[i] += factors[i] * value;
    }
  }
  [[nodiscard]] std::array<double, kUnknowns> solved() const {
    auto m = matrix_;
    auto r = right_;
    for (std::size_t i = 0; i < kUnknowns; ++i)
      for (std::size_t j = i + 1; j < kUnknowns; ++j) {
        const double share = m[j][i] / m[i][i];
        for (std::size_t k = i; k < kUnknowns; ++k) m[j][k] -= share * m[i][k];
        r[j] -= share * r[i];
      }
    for (std::size_t i = kUnknowns; i-- > 0;) {
      for (std::size_t k = i + 1; k < kUnknowns; ++k) r[i] -= m[i][k] * r[k];
      r[i] /= m[i][i];
    }
    return r;
  }

 private:
  std::array<std::array<double, kUnknowns>, kUnknowns> matrix_{};
  std::array<double, kUnknowns> right_{};
};

/// A point or a ball, for which the surface lies its radius above: the force is stiffness times depth below that.
void identify(Report& report, const Snapshot& sphere, const testing::HeldTool& held) {
  const int ticks = (report.long_form() ? 600'000 : 20'000) / held.dear;
  double stiffness_off = 0, damping_off = 0, constant = 0;
  for (const auto& [stiffness, damping] : {std::pair{200.0, 0.5}, {400.0, 1.0}, {1000.0, 3.0}}) {
    const double metres = 0.05;
    ServoSettings settings = testing::settings_with(stiffness, damping, 0, metres);
    settings.tool = held.tool();
    testing::Driver hand(settings, testing::strong_device());
    static_cast<void>(hand.at(sphere, {0, 0, 1.05 + held.radius}));
    Fit fit;
    double mean = 0;
    for (int k = 1; k <= ticks; ++k) {
      const double t = k * 1e-3;
      // About on the sphere, pressing in and out at 1 and 2.3 Hz; all in closed form.
      const double a = 1.1 * std::sin(0.4 * t), b = 0.9 * std::sin(0.27 * t);
      const Vec3d way = normalized(Vec3d{std::tan(a), std::tan(b), 1});
      const double fade = std::min(1.0, t);
      const double height = 0.04 - fade * (0.12 + 0.02 * std::sin(6.3 * t) + 0.008 * std::sin(14.5 * t));
      const double speed = -(0.02 * 6.3 * std::cos(6.3 * t) + 0.008 * 14.5 * std::cos(14.5 * t));  // model units/s
      const Vec3d force = hand.at(sphere, way * (1 + held.radius + height)).force;
      if (t < 1.5) continue;
      mean += length(force);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        std::array<double, kUnknowns> factors{};
        factors[0] = -height * metres * way[axis];
        factors[1] = -speed * metres * way[axis];
        factors[2 + axis] = 1;
        fit.add(factors, force[axis]);
      }
    }
    const auto found = fit.solved();
    mean /= ticks - 1500;
    stiffness_off = std::max(stiffness_off, std::abs(found[0] / stiffness - 1));
    damping_off = std::max(damping_off, std::abs(found[1] / damping - 1));
    constant = std::max(constant, std::hypot(found[2], std::hypot(found[3], found[4])) / mean);
  }
  report.at_most("stiffness recovered, off by" + held.name, stiffness_off, 0.01);
  report.at_most("damping recovered, off by" + held.name, damping_off, 0.01);
  report.at_most("constant force (there is none), of the mean force" + held.name, constant, 0.01);
}

}  // namespace

void identification(Report& report) {
  const SnapshotPtr sphere = testing::fine_sphere();
  // The points of a rigid tool push together, each more the deeper it is: that is no spring with one stiffness.
  for (const testing::HeldTool& held : testing::held_tools(0.1))
    if (held.is_point() || held.is_ball()) identify(report, *sphere, held);
}

}  // namespace relief::acceptance
