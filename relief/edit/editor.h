// Tools, dabs, strokes and undo: the only code that makes new snapshots.
#pragma once

#include <relief/core/query.h>
#include <relief/core/snapshot.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace relief {

enum class Tool : std::uint8_t { Carve, Deposit, Paint };
[[nodiscard]] constexpr std::string_view name(Tool tool) noexcept {
  return tool == Tool::Carve ? "carve" : tool == Tool::Deposit ? "deposit" : "paint";
}
[[nodiscard]] std::optional<Tool> tool_from_name(std::string_view text) noexcept;

/// How a stroke acts. Lengths in model units.
struct Brush {
  Tool tool = Tool::Carve;
  double radius = 1;         ///< of the sphere, > 0
  double strength = 1;       ///< 0..1, see Dab
  Vec3f colour = {1, 1, 1};  ///< Paint: sRGB 0..1
  double resilience = 0;     ///< Carve: k, thickness of the band that yields without being cut (paper, Sec. 4.1)
};

/// One application of the tool.
/// Carve clips at the sphere with centre cursor + normal * (radius + k) (paper, Sec. 4.1); pressure and strength do not
/// enter, they already placed the cursor. Deposit raises the surface around `contact` by strength * radius * seconds,
/// falling off linearly to zero at the radius (paper, Sec. 4.2). Paint blends the colour around `contact` with the
/// intensity strength * pressure * (1 - distance / radius) (paper, Sec. 5).
struct Dab {
  SlabId slab = kNoSlab;  ///< where region growth starts: the slab of the contact
  Vec3d contact;          ///< surface contact point
  Vec3d cursor;           ///< Carve: the haptic cursor, below the surface
  Vec3d normal;           ///< unit, outwards
  double pressure = 1;    ///< 0..1
  double seconds = 0;     ///< Deposit: how long the tool was held here
};

/// What a dab did.
struct DabResult {
  std::size_t slabs = 0;    ///< reached by the sphere
  std::size_t samples = 0;  ///< whose value changed, copies of shared samples counted once per copy
};

/// What unpainted surface counts as when the first stroke of paint makes the colour layer; sRGB.
inline constexpr Vec3f kClayColour = {0.72F, 0.66F, 0.60F};

/// The single writer. One thread. Every published snapshot has bit-identical copies of shared samples, and constrained
/// ones that follow from them (asserted by tests with validate()).
class Editor {
 public:
  explicit Editor(SnapshotPtr head);
  Editor(Editor&&) noexcept = default;
  Editor& operator=(Editor&&) noexcept = default;
  Editor(const Editor&) = delete;
  Editor& operator=(const Editor&) = delete;
  ~Editor() = default;

  [[nodiscard]] const SnapshotPtr& head() const noexcept { return head_; }
  /// Asserts that no stroke is open and the brush is sane (positive finite radius).
  void begin_stroke(const Brush& brush, std::string label = {});
  /// Applies the tool; head() is then a new snapshot (the same one when nothing changed). Ignores dabs that are not
  /// finite, have no normal or name no slab; pressure and seconds are clamped to their ranges. Samples change in
  /// proportion to 1 - mask where the model has Layer::Mask, void ones not at all. The tool works on the slabs that
  /// hang together inside its sphere, starting at dab.slab, and whose fibres point to the tool's side (mean direction
  /// against dab.normal), so the far side of a thin wall stays as it is. The first paint makes the colour layer, filled
  /// with kClayColour. Cost: the samples of the slabs reached, whatever the model's size.
  DabResult dab(const Dab& dab);
  /// Ends the stroke; a stroke that changed nothing leaves no undo step. Returns whether it left one.
  bool end_stroke();
  /// Drops the open stroke: head() is again what it was at begin_stroke().
  void cancel_stroke();
  [[nodiscard]] bool in_stroke() const noexcept { return in_stroke_; }

  /// Moves head() to the snapshot before the last stroke, or after the next one; false at the end of the history and
  /// while a stroke is open.
  bool undo();
  bool redo();
  [[nodiscard]] std::size_t undo_count() const noexcept { return position_; }
  [[nodiscard]] std::size_t redo_count() const noexcept { return history_.size() - 1 - position_; }
  /// Label of the stroke that undo() would take back, or redo() bring back; empty when there is none.
  [[nodiscard]] std::string_view undo_label() const noexcept;
  [[nodiscard]] std::string_view redo_label() const noexcept;

 private:
  struct Scratch;  ///< buffers kept between dabs, so that a dab allocates only what the snapshot keeps

  SnapshotPtr head_;
  std::vector<SnapshotPtr> history_;  ///< history_[position_] is the state after the last finished stroke
  std::vector<std::string> labels_;   ///< labels_[k] names the stroke from history_[k] to history_[k + 1]
  std::size_t position_ = 0;
  bool in_stroke_ = false;
  Brush brush_;
  std::string label_;
  std::shared_ptr<Scratch> scratch_;
};

/// A stroke as a file gives it: see docs (relief sculpt).
struct StrokePoint {
  double t = 0;         ///< seconds
  Vec3d position;       ///< anywhere near the surface; projected to the surface as it stood at the stroke's start
  double pressure = 1;  ///< 0..1
};
struct Stroke {
  Brush brush;
  std::string label;
  std::vector<StrokePoint> points;
};
inline constexpr std::size_t kMaxStrokeDabs = 10'000'000;

/// Whether a stroke can be played as it stands; else InvalidArgument with the first offence: a number that is not
/// finite, radius <= 0, strength, pressure or colour outside 0..1, k < 0, time that runs backwards, more than
/// kMaxStrokeDabs dabs.
[[nodiscard]] Status check(const Stroke& stroke);

/// Plays a stroke on the editor: dabs along the polyline every radius/8 and at least one per point; carve puts the
/// cursor strength * pressure * radius, plus k, below the projected point; deposit keeps its place (slab, u, v) on the
/// stroke's first surface but measures distances from the surface as it has grown there, so the centre rises at
/// strength * radius per second; a deposit dab lasts as long as the hand took to get there (0.1 s for a stroke of a
/// single point). Asserts that no stroke is open. Points that are not finite are left out; other values are clamped to
/// their ranges; a brush without a positive finite radius and a stroke of more than kMaxStrokeDabs dabs change nothing.
/// Returns whether the stroke left an undo step.
bool play(Editor& editor, const Stroke& stroke);

}  // namespace relief
