// S11: a fine texture under a moving tip: the force's spectrum against the texture's.
#include "acceptance/acceptance.h"
#include "support/driver.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

namespace relief::acceptance {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kStiffness = 400, kTick = 1e-3;

/// A square sheet: its edge in m, slabs along that, intervals.
struct Sheet {
  double edge;
  int slabs, intervals;
};
constexpr Sheet kSmall = {0.02, 8, 64}, kLong = {0.08, 16, 128};

/// With waves along x; pitch and height in m.
SnapshotPtr waves(const Sheet& sheet, double pitch, double height) {
  return testing::displaced(testing::plane_shell(sheet.slabs, sheet.intervals, 0.02), [=](Vec3d p) {
    return 0.5 + 25 * height / sheet.edge * std::sin(2 * kPi * p.x * sheet.edge / pitch);
  });
}

/// Amplitude of one frequency in a force, under a Hann window; cycles per sample.
double line(const std::vector<double>& force, double frequency) {
  double c = 0, s = 0, sum = 0, mean = 0;
  for (const double f : force) mean += f / double(force.size());
  for (std::size_t k = 0; k < force.size(); ++k) {
    const double window = 0.5 - 0.5 * std::cos(2 * kPi * (double(k) + 0.5) / double(force.size()));
    c += window * (force[k] - mean) * std::cos(2 * kPi * frequency * double(k));
    s += window * (force[k] - mean) * std::sin(2 * kPi * frequency * double(k));
    sum += window;
  }
  return 2 * std::hypot(c, s) / sum;
}

struct Spectrum {
  double main = 0;   ///< dB, against stiffness times height
  double alias = 0;  ///< dB, the largest line away from the main one and its whole multiples, against it
};

/// The tip slides at a depth along the middle of the sheet; the spectrum is that of what comes after the run-in.
Spectrum slide(const Sheet& sheet, double pitch, double height, double depth, double speed, int run_in = 0) {
  const SnapshotPtr model = waves(sheet, pitch, height);
  testing::Driver hand(testing::settings_with(kStiffness, 0, 0, sheet.edge), testing::strong_device());
  std::vector<double> force;
  const double step = speed * kTick / sheet.edge;
  const int ticks = static_cast<int>(std::min(2000.0, 0.8 / step)) - run_in;
  static_cast<void>(hand.at(*model, {0.1, 1e-3 / sheet.edge, 0.4}));
  for (int k = 0; k < 100; ++k) static_cast<void>(hand.at(*model, {0.1, -depth / sheet.edge, 0.4}));
  for (int k = -run_in; k < ticks; ++k) {
    const double along = 0.1 + (k + run_in) * step, aside = 0.4 + 0.03 * double(k + run_in) / ticks;
    const double felt = hand.at(*model, {along, -depth / sheet.edge, aside}).force.y;
    if (k >= 0) force.push_back(felt);
  }
  const double frequency = speed * kTick / pitch;
  const double main = line(force, frequency);
  double alias = 0;
  const double width = 4.0 / ticks;  // of a line under the window
  for (double f = width; f < 0.5; f += 0.5 / ticks) {
    // Multiples below half the rate are the texture's own; what is folded back from above is not.
    const double multiple = f / frequency, nearest = std::max(1.0, std::round(multiple));
    if (std::abs(multiple - nearest) * frequency < width) continue;
    alias = std::max(alias, line(force, f));
  }
  return {20 * std::log10(main / (kStiffness * height)), 20 * std::log10(alias / main)};
}

}  // namespace

void texture(Report& report) {
  // Waves so low that the tip reaches into them: depth times curvature stays below a tenth.
  double main = 0, alias = -1e9;
  for (const double pitch : {0.5e-3, 1e-3, 2e-3})
    for (const double speed : {0.02, 0.05, 0.1, 0.2}) {
      if (speed / pitch > 400) continue;
      const double depth = 50e-6, height = 0.02 * pitch * pitch / (4 * kPi * kPi * depth);
      const Spectrum found = slide(kSmall, pitch, height, std::max(depth, 1.5 * height), speed);
      if (!(std::abs(found.main) <= main)) main = std::abs(found.main);
      if (!(found.alias <= alias)) alias = found.alias;
    }
  report.at_most("main line off stiffness times height, pitch 0.5 to 2 mm at 20 to 200 mm/s", main, 1, "dB");
  report.at_most("largest line that is not the texture's", alias, -40, "dB");
  // Where the tip is deeper than the waves are curved it goes from valley to valley, as any point does.
  const Spectrum deep = slide(kSmall, 1e-3, 20e-6, 1e-3, 0.05);
  report.shown("main line of 1 mm waves 20 um high, 1 mm deep", deep.main, "dB");
  // More than one wave in two ticks: once it runs, nothing of it comes back as another.
  double left = -1e9;
  for (const double pitch : {0.25e-3, 0.3e-3, 0.35e-3, 0.38e-3}) {
    const Spectrum fast = slide(kLong, pitch, 0.4e-6, 20e-6, 0.2, 120);
    if (!(fast.main <= left)) left = fast.main;
  }
  report.at_most("line left of waves shorter than two ticks' way, 0.25 to 0.38 mm at 200 mm/s", left, -20, "dB");
}

}  // namespace relief::acceptance
