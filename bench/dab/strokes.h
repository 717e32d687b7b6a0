// Strokes of one size on one model, with the clock on each dab.
#pragma once

#include <relief/core/query.h>
#include <relief/edit/editor.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <functional>
#include <span>
#include <vector>

namespace relief::bench {

/// What dabs took and did, one number each per dab.
struct Dabs {
  std::vector<double> seconds;  ///< thread CPU
  std::vector<double> samples;  ///< changed, copies of shared samples counted once per copy
  std::vector<double> ends;     ///< s, of Editor::end_stroke()
};
/// 0 of none.
[[nodiscard]] double median(std::vector<double> values);

/// The same dabs some times over: of each percentile the median over the rounds. Times in us.
class Rounds {
 public:
  void add(const Dabs& dabs);
  [[nodiscard]] nlohmann::ordered_json percentiles() const;
  /// The median dab, over the rounds.
  [[nodiscard]] double middle() const { return median(middles_); }
  [[nodiscard]] double least() const { return *std::ranges::min_element(middles_); }
  [[nodiscard]] double most() const { return *std::ranges::max_element(middles_); }
  [[nodiscard]] double samples() const { return median(samples_); }
  /// Of a stroke.
  [[nodiscard]] double end() const { return median(ends_); }

 private:
  std::vector<nlohmann::ordered_json> times_;
  std::vector<double> middles_, samples_, ends_;  ///< by round, medians
};

/// A radius at which the median dab changes as many samples as are wanted, or nearly.
struct Sized {
  double radius = 0, samples = 0;
  [[nodiscard]] bool is_near(double wanted) const noexcept {
    return samples >= 0.9 * wanted && samples <= 1.1 * wanted;
  }
};
/// `samples_at` tells what a radius changes; it grows with it.
[[nodiscard]] Sized find_radius(double wanted, double guess, const std::function<double(double)>& samples_at);

/// The brush of the benchmark's strokes: strength 0.3.
[[nodiscard]] Brush brush_of(Tool tool, double radius);
/// The time that such a dab stands for, s: a session makes 250 in a second.
inline constexpr double kDabSeconds = 4e-3;
/// Carve stays in its place and sinks, from so deep, a little with each dab, in radii: then each dab changes all
/// samples under the ball.
inline constexpr double kCarveDepth = 0.15, kCarveSinks = 0.0005;

/// The model with the layer that a tool writes, as its first stroke makes it; full where the tool takes away.
[[nodiscard]] SnapshotPtr with_layer(const SnapshotPtr& model, Tool tool, const SurfacePoint& somewhere);

/// Strokes that begin at these places of the model, one after the other. Carve stays and sinks, the others go a
/// sixteenth of the radius with each dab. The state before each stroke is held as undo does, and the newest head as a
/// reader does; making and letting go of them is in the time of the dabs.
[[nodiscard]] Dabs run_strokes(const SnapshotPtr& model, std::span<const SurfacePoint> starts, Tool tool, double radius,
                               int dabs);

/// Where dab k of such a stroke is on the model.
[[nodiscard]] SurfacePoint place_of(const Snapshot& model, const SurfacePoint& start, Tool tool, double radius, int k,
                                    PickHint& hint);
/// A unit vector across a unit normal.
[[nodiscard]] Vec3d aside(Vec3d normal) noexcept;

}  // namespace relief::bench
