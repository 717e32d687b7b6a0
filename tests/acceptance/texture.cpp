// S11: a fine texture under a moving tip: the force's spectrum against the texture's.
#include "acceptance/acceptance.h"
#include "support/driver.h"
#include "support/held_tools.h"

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

/// Of a slide along the middle of a sheet; m and m/s.
struct Slide {
  Sheet sheet;
  double pitch, height, depth, speed;
  int run_in = 0;  ///< ticks before those whose spectrum it is
};

/// A tool slides at a depth; the spectrum is that of what comes after the run-in.
Spectrum slide(const Slide& s, const testing::HeldTool& held = {}) {
  const SnapshotPtr model = waves(s.sheet, s.pitch, s.height);
  ServoSettings settings = testing::settings_with(kStiffness, 0, 0, s.sheet.edge);
  settings.tool = held.tool();
  testing::Driver hand(settings, testing::strong_device());
  std::vector<double> force;
  const double step = s.speed * kTick / s.sheet.edge;
  const int ticks = static_cast<int>(std::min(2000.0, 0.8 / step)) - s.run_in;
  static_cast<void>(hand.at(*model, {0.1, held.radius + 1e-3 / s.sheet.edge, 0.4}));
  const double height = held.radius - s.depth / s.sheet.edge;
  for (int k = 0; k < 100; ++k) static_cast<void>(hand.at(*model, {0.1, height, 0.4}));
  for (int k = -s.run_in; k < ticks; ++k) {
    const double along = 0.1 + (k + s.run_in) * step, aside = 0.4 + 0.03 * double(k + s.run_in) / ticks;
    const double felt = hand.at(*model, {along, height, aside}).force.y;
    if (k >= 0) force.push_back(felt);
  }
  const double frequency = s.speed * kTick / s.pitch;
  const double main = line(force, frequency);
  double alias = 0;
  const double width = 4.0 / ticks;  // of a line under the window
  for (double f = width; f < 0.5; f += 0.5 / ticks) {
    // Multiples below half the rate are the texture's own; what is folded back from above is not.
    const double multiple = f / frequency, nearest = std::max(1.0, std::round(multiple));
    if (std::abs(multiple - nearest) * frequency < width) continue;
    alias = std::max(alias, line(force, f));
  }
  return {20 * std::log10(main / (kStiffness * s.height)), 20 * std::log10(alias / main)};
}

}  // namespace

void texture(Report& report) {
  // A ball of 0.2 mm, and a rigid tool of which one point touches.
  constexpr double kBall = 0.2e-3, kTool = 1e-3;  // m
  const auto tools = [](const Sheet& sheet) {
    auto all = testing::held_tools(kBall / sheet.edge);
    const double size = kTool / sheet.edge;
    all[2].points = {{0, -size, 0}, {size, 0, 0}, {-size, 0, size}};
    all[2].radius = size;
    return all;
  };
  // Waves so low that the tool reaches into them: depth, and a ball's radius, times curvature stays below a tenth. A
  // ball that goes half its radius in a tick comes late, which is its own line.
  for (const testing::HeldTool& held : tools(kSmall)) {
    double main = 0, alias = -1e9;
    for (const double pitch : {0.5e-3, 1e-3, 2e-3})
      for (const double speed : {0.02, 0.05, 0.1, 0.2}) {
        if (speed / pitch > 400 || (held.is_ball() && speed * kTick > 0.5 * kBall)) continue;
        const double depth = 50e-6, reach = depth + (held.is_ball() ? kBall : 0);
        const double height = 0.02 * pitch * pitch / (4 * kPi * kPi * reach);
        const Spectrum found = slide({kSmall, pitch, height, std::max(depth, 1.5 * height), speed}, held);
        if (!(std::abs(found.main) <= main)) main = std::abs(found.main);
        if (!(found.alias <= alias)) alias = found.alias;
      }
    const std::string most = held.is_ball() ? "100" : "200";
    report.at_most("main line off stiffness times height, pitch 0.5 to 2 mm at 20 to " + most + " mm/s" + held.name,
                   main, 1, "dB");
    if (held.is_ball())
      report.shown("largest line that is not the texture's" + held.name, alias, "dB");
    else
      report.at_most("largest line that is not the texture's" + held.name, alias, -40, "dB");
  }
  // Where the tip is deeper than the waves are curved it goes from valley to valley, as any point does.
  const Spectrum deep = slide({kSmall, 1e-3, 20e-6, 1e-3, 0.05});
  report.shown("main line of 1 mm waves 20 um high, 1 mm deep", deep.main, "dB");
  // More than one wave in two ticks: once it runs, nothing of it comes back as another. A ball's waves are as high as
  // it is late at that speed.
  for (const testing::HeldTool& held : tools(kLong)) {
    const double height = held.is_ball() ? 20e-6 : 0.4e-6;
    double left = -1e9;
    for (const double pitch : {0.25e-3, 0.3e-3, 0.35e-3, 0.38e-3}) {
      const Spectrum fast = slide({kLong, pitch, height, 20e-6 + 1.5 * height, 0.2, 120}, held);
      if (!(fast.main <= left)) left = fast.main;
    }
    report.at_most("line left of waves shorter than two ticks' way, 0.25 to 0.38 mm at 200 mm/s" + held.name, left,
                   held.is_ball() ? -10 : -20, "dB");
  }
}

}  // namespace relief::acceptance
