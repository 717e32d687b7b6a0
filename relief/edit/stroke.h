// From the hand's way to dabs: the one engine behind files, servo, mouse and pen.
#pragma once

#include <relief/base/progress.h>
#include <relief/edit/editor.h>

#include <atomic>
#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace relief {

struct StrokePoint {
  double t = 0;         ///< s
  Vec3d position;       ///< anywhere near the surface, or the tool's tip (see Stroke::tip)
  double pressure = 1;  ///< 0..1
  friend bool operator==(const StrokePoint&, const StrokePoint&) noexcept = default;
};

/// A stroke as a file gives it and as the journal keeps it: see docs (relief sculpt).
struct Stroke {
  Brush brush;
  std::string label;
  bool tip = false;  ///< the points are where the tool's lowest point was, so that Carve cuts down to them, plus k,
                     ///< instead of strength * pressure * radius below the surface
  std::vector<StrokePoint> points;
};
inline constexpr std::size_t kMaxStrokeDabs = 10'000'000;

/// Whether a stroke can be played as it stands; else InvalidArgument with the first offence: a number that is not
/// finite, radius <= 0, strength, pressure or colour outside 0..1, k < 0, a pressure curve without extent, time that
/// runs backwards, more than kMaxStrokeDabs dabs.
[[nodiscard]] Status check(const Stroke& stroke);

/// Turns points into dabs while they come. What a stroke does depends on its way and its times, not on how many points
/// tell them or how they are split into calls of move(): between points the hand went straight and evenly. There is a
/// dab each time that the hand has gone radius/16 or 8 ms have passed, and one at the end. Points are projected to the
/// surface as it stood at the stroke's start; those farther outside than the radius are left out and counted. The
/// axis of a tool that cuts or flattens is the normal averaged over its area. Deposit and its like keep their place
/// (slab, u, v) on that surface but measure distances from the surface as it is now. A stroke that lasts no time counts
/// as a tap of 0.1 s. One thread; the editor must outlive it.
class StrokeEngine {
 public:
  explicit StrokeEngine(Editor& editor);
  StrokeEngine(StrokeEngine&&) noexcept;
  ~StrokeEngine();

  /// Asserts that no stroke is open and the brush is sane.
  void begin(const Brush& brush, bool tip = false);
  /// Points that are not finite or run back in time are left out; other values are clamped to their ranges.
  void move(std::span<const StrokePoint> points);
  StrokeResult end();
  void cancel();
  [[nodiscard]] bool open() const noexcept;
  /// What the open stroke has done so far, samples left at 0.
  [[nodiscard]] const StrokeResult& so_far() const noexcept;
  /// From now on no dab is made while the flag is set; for who cancels from another thread. May be null.
  void stop_at(const std::atomic<bool>* flag) noexcept;
  /// Called with each dab and what it did, after it was made; for recorders and statistics.
  void on_dab(std::function<void(const Dab&, const DabResult&)> call);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Plays a whole stroke. Cancelled: the editor's head is what it was, the result says that nothing changed. A brush
/// without a positive finite radius and a stroke of more than kMaxStrokeDabs dabs change nothing.
StrokeResult play(Editor& editor, const Stroke& stroke, const Progress& progress = {});

}  // namespace relief
