// Dabs and strokes: the only code that makes new snapshots.
#pragma once

#include <relief/core/query.h>
#include <relief/core/snapshot.h>
#include <relief/edit/tools.h>

#include <cstddef>
#include <cstdint>
#include <memory>

namespace relief {

/// One application of the tool, where its sphere, the brush's radius times `size`, meets the surface. Carve clips at
/// the sphere with centre cursor + normal * (radius + k) (paper, Sec. 4.1), swept from `from` where the dab is `swept`.
/// All other tools work around `contact`, by rate * strength * pressure * fall-off * seconds. Deposit knows no pressure
/// (paper, Sec. 4.2).
struct Dab {
  SlabId slab = kNoSlab;  ///< where region growth starts: the slab of the contact
  Vec3d contact;          ///< surface contact point
  Vec3d cursor;           ///< Carve: the haptic cursor, below the surface
  Vec3d normal;           ///< unit, outwards: the tool's axis
  double pressure = 1;    ///< 0..1
  double seconds = 0;     ///< how long the tool was held here; 0: only Carve does anything
  Vec3d from = {};        ///< Carve: centre that the sphere would have had at the dab before
  bool swept = false;     ///< Carve: everything between the two is cut as well
  double size = 1;        ///< of the brush's radius; above 0, at most 1
};

/// Holds what a dab did.
struct DabResult {
  std::size_t slabs = 0;    ///< reached by the sphere
  std::size_t samples = 0;  ///< whose value changed, copies of shared samples counted once per copy
  /// that would have gone beyond their fibre's ends, or kept Carve from its depth by over 5 % of the radius; likewise
  std::size_t limited = 0;
  std::size_t slabs_added = 0;    ///< by cuts, for detail
  std::size_t samples_added = 0;  ///< in all layers
  bool detail_limited = false;    ///< whether the grid stayed coarser than the tool wanted it
  /// Carve: whether it took samples that stood over a twentieth of the radius, or half a spacing where that is less,
  /// beside the sphere and the column above it, for their fibres lean into it
  bool beside = false;
};

/// Holds what a stroke did from its beginning.
struct StrokeResult {
  bool changed = false;     ///< whether any sample has
  std::size_t dabs = 0;     ///< dabs that were applied
  std::size_t samples = 0;  ///< whose value is another one, copies counted once per copy
  std::size_t limited = 0;  ///< different ones, see DabResult
  std::size_t missed = 0;   ///< points of the stroke that were farther from the surface than the radius, and left out
  /// for detail; 0 where nothing has changed
  std::size_t slabs_added = 0, samples_added = 0;
  bool detail_limited = false;  ///< whether the grid stayed coarser somewhere than the tool wanted it
  bool beside = false;          ///< whether a dab has taken something from beside the sphere
  /// The surface under the first dab of each kind, model units; zero without one. `missed_at`: that point itself.
  Vec3d limited_at, missed_at, detail_limited_at, beside_at;
  /// Adds a dab at a contact, but for `samples`: those of several dabs may be the same.
  void add(const DabResult& dab, Vec3d contact) noexcept;
};

/// What unpainted surface counts as when the first stroke of paint makes the colour layer; sRGB.
inline constexpr Vec3f kClayColour = {0.72F, 0.66F, 0.60F};

/// The single writer. One thread. Every published snapshot has bit-identical copies of shared samples, and constrained
/// ones that follow from them (asserted by tests with validate()).
class Editor {
 public:
  /// Edits from a snapshot on; not null.
  explicit Editor(SnapshotPtr head);
  /// Takes over; the other one may only be destroyed or assigned to.
  Editor(Editor&&) noexcept;
  /// Takes over; the other one may only be destroyed or assigned to.
  Editor& operator=(Editor&&) noexcept;
  Editor(const Editor&) = delete;
  Editor& operator=(const Editor&) = delete;
  ~Editor();

  /// Returns the model with all dabs so far. The first call after a dab publishes it: some nanoseconds per changed
  /// sample.
  [[nodiscard]] const SnapshotPtr& head();
  /// Returns where the surface of (slab, u, v) is now, dabs that nobody has asked the head for included.
  [[nodiscard]] Vec3d position(SlabId slab, double u, double v) const noexcept;
  /// Returns the surface as it was when the open stroke began, in the cage of now: detail that the stroke has added is
  /// there.
  [[nodiscard]] const SnapshotPtr& start() const noexcept;
  /// Goes on from another snapshot of the same document (undo, redo), of whatever cage. Asserts that no stroke is open.
  void set_head(SnapshotPtr head);

  /// Asserts that no stroke is open and the brush is sane (positive finite radius).
  void begin_stroke(const Brush& brush);
  /// Applies the tool to the connected slabs inside its sphere whose mean fibre direction has a positive dot product
  /// with `dab.normal`. Ignores dabs that are not finite, name no slab or have no size; clamps pressure and seconds.
  /// Samples change by 1 - mask; void ones never. The grid gets finer first where Brush::detail wants it. Cost: the
  /// samples reached.
  /// docs/reference/tools.md has the formulas.
  DabResult dab(const Dab& dab);
  /// Ends the stroke.
  StrokeResult end_stroke();
  /// Drops the open stroke: head() is again what it was at begin_stroke().
  void cancel_stroke();
  /// Returns whether a stroke is open.
  [[nodiscard]] bool in_stroke() const noexcept;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace relief
