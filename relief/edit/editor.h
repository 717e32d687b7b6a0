// Dabs and strokes: the only code that makes new snapshots.
#pragma once

#include <relief/core/query.h>
#include <relief/core/snapshot.h>
#include <relief/edit/tools.h>

#include <cstddef>
#include <cstdint>
#include <memory>

namespace relief {

/// One application of the tool, where the sphere of the brush's radius meets the surface.
/// Carve clips at the sphere with centre cursor + normal * (radius + k) (paper, Sec. 4.1), swept from `from` where the
/// dab is `swept`; pressure does not enter, it already placed the cursor. All other tools work around `contact`, by an
/// amount of rate * strength * pressure * fall-off * seconds; Deposit knows no pressure (paper, Sec. 4.2).
struct Dab {
  SlabId slab = kNoSlab;  ///< where region growth starts: the slab of the contact
  Vec3d contact;          ///< surface contact point
  Vec3d cursor;           ///< Carve: the haptic cursor, below the surface
  Vec3d normal;           ///< unit, outwards: the tool's axis
  double pressure = 1;    ///< 0..1
  double seconds = 0;     ///< how long the tool was held here
  Vec3d from = {};        ///< Carve: centre of the sphere at the dab before
  bool swept = false;     ///< Carve: everything between the two is cut as well
};

/// What a dab did.
struct DabResult {
  std::size_t slabs = 0;    ///< reached by the sphere
  std::size_t samples = 0;  ///< whose value changed, copies of shared samples counted once per copy
  std::size_t limited = 0;  ///< that would have gone beyond their fibre's ends, counted likewise
};

/// What a stroke did from its beginning.
struct StrokeResult {
  bool changed = false;
  std::size_t dabs = 0;
  std::size_t samples = 0;  ///< whose value is another one, copies counted once per copy
  std::size_t limited = 0;  ///< different ones that would have gone beyond their fibre's ends
  std::size_t missed = 0;   ///< points of the stroke that were farther from the surface than the radius, and left out
};

/// What unpainted surface counts as when the first stroke of paint makes the colour layer; sRGB.
inline constexpr Vec3f kClayColour = {0.72F, 0.66F, 0.60F};

/// The single writer. One thread. Every published snapshot has bit-identical copies of shared samples, and constrained
/// ones that follow from them (asserted by tests with validate()).
class Editor {
 public:
  explicit Editor(SnapshotPtr head);
  Editor(Editor&&) noexcept;
  Editor& operator=(Editor&&) noexcept;
  Editor(const Editor&) = delete;
  Editor& operator=(const Editor&) = delete;
  ~Editor();

  /// The model with all dabs so far. The first call after a dab publishes it: some nanoseconds per changed sample.
  [[nodiscard]] const SnapshotPtr& head();
  /// Where the surface of (slab, u, v) is now, dabs that nobody has asked the head for included.
  [[nodiscard]] Vec3d position(SlabId slab, double u, double v) const noexcept;
  /// The head as it was when the open stroke began.
  [[nodiscard]] const SnapshotPtr& start() const noexcept;
  /// Goes on from another snapshot of the same document (undo, redo). Asserts that no stroke is open.
  void set_head(SnapshotPtr head);

  /// Asserts that no stroke is open and the brush is sane (positive finite radius).
  void begin_stroke(const Brush& brush);
  /// Applies the tool. Ignores dabs that are not finite, have no normal or name no slab; pressure and seconds are
  /// clamped to their ranges. Samples change in proportion to 1 - mask where the model has Layer::Mask, void ones not
  /// at all. The tool works on the slabs that hang together inside its sphere, starting at dab.slab, and whose fibres
  /// point to the tool's side (mean direction against dab.normal), so the far side of a thin wall stays as it is. The
  /// first paint makes the colour layer, filled with kClayColour, the first mask the mask, filled with 0. Where the
  /// clay or the room above it ends, the tool fades out over the last tenth, at least two spacings, and says how many
  /// samples it could not move. Cost: the samples of the slabs reached.
  /// Carve depends on the snapshot at the stroke's start and on the dabs, not on their order or how often one comes.
  DabResult dab(const Dab& dab);
  /// Ends the stroke.
  StrokeResult end_stroke();
  /// Drops the open stroke: head() is again what it was at begin_stroke().
  void cancel_stroke();
  [[nodiscard]] bool in_stroke() const noexcept;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace relief
