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

/// One point of a stroke.
struct StrokePoint {
  double t = 0;         ///< s
  Vec3d position;       ///< anywhere near the surface, or the tool's tip (see Stroke::tip)
  double pressure = 1;  ///< 0..1
  friend bool operator==(const StrokePoint&, const StrokePoint&) noexcept = default;
};

/// A stroke as a file gives it and as the journal keeps it: see docs (relief sculpt).
struct Stroke {
  Brush brush;        ///< with what
  std::string label;  ///< what the history shows
  bool tip = false;   ///< the points are where the tool's lowest point was, so that Carve cuts down to them, plus k,
                      ///< instead of strength * pressure * radius below the surface
  std::vector<StrokePoint> points;  ///< in the order of time
};
inline constexpr std::size_t kMaxStrokeDabs = 10'000'000;

/// Returns InvalidArgument for a stroke that cannot be played, naming the first offence. Offences: numbers that are not
/// finite, radius <= 0, strength, pressure or colour outside 0 to 1, k or detail < 0. Also: an empty pressure curve,
/// time that runs backwards, over kMaxStrokeDabs dabs. Where pressure drives the radius, light strokes need more dabs.
[[nodiscard]] Status check(const Stroke& stroke);

/// Returns how wide a dab is at a pressure of the hand (0..1), as a share of the brush's radius; 1 where pressure does
/// not drive it. Any thread; of constant cost.
[[nodiscard]] double dab_size(const Brush& brush, double pressure) noexcept;

/// Turns points into dabs while they come: one after every radius/16 or 8 ms, and one at the end. The radius there is
/// the dab's: Brush::pressure_drives may let the pressure scale it. Below 1/64 of the brush's nothing is done. The
/// result depends on the path and its times, not on calls of move(). Points farther than the brush's radius from the
/// surface of the stroke's start are counted and left out. A stroke without duration is a tap of 0.1 s.
/// One thread; the editor must outlive it.
class StrokeEngine {
 public:
  /// Gives dabs to an editor, which must outlive this.
  explicit StrokeEngine(Editor& editor);
  /// Takes over; the other one may only be destroyed.
  StrokeEngine(StrokeEngine&&) noexcept;
  ~StrokeEngine();

  /// Asserts that no stroke is open and the brush is sane. `felt` is the surface on which the tool finds its places and
  /// axes; null: that of the editor. A stroke that is played again on other fibres goes by the one that it began on, so
  /// that it means the same.
  void begin(const Brush& brush, bool tip = false, SnapshotPtr felt = nullptr);
  /// Points that are not finite or run back in time are left out; other values are clamped to their ranges.
  void move(std::span<const StrokePoint> points);
  /// Ends the stroke, and keeps it.
  StrokeResult end();
  /// Ends the stroke as if it had never been.
  void cancel();
  /// Returns whether a stroke is open.
  [[nodiscard]] bool open() const noexcept;
  /// Returns what the open stroke has done so far, samples left at 0.
  [[nodiscard]] const StrokeResult& so_far() const noexcept;
  /// From now on no dab is made while the flag is set; for who cancels from another thread. May be null.
  void stop_at(const std::atomic<bool>* flag) noexcept;
  /// Called with each dab and what it did, after it was made; for recorders and statistics.
  void on_dab(std::function<void(const Dab&, const DabResult&)> call);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Plays a whole stroke on the fibres that there are; one that gets room needs a Document. Cancelled: the editor's head
/// is what it was, the result says that nothing changed. A brush without a positive finite radius and a stroke of more
/// than kMaxStrokeDabs dabs change nothing.
StrokeResult play(Editor& editor, const Stroke& stroke, const Progress& progress = {});

}  // namespace relief
