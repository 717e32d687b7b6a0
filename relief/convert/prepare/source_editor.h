// Small repairs that let a thin shell stand: smoothing within bounds, and patches in the place of what is folded.
#pragma once

#include <relief/base/progress.h>
#include <relief/convert/geometry/components.h>
#include <relief/convert/geometry/shell.h>
#include <relief/convert/geometry/source_index.h>
#include <relief/convert/geometry/winding_number.h>
#include <relief/convert/prepare/closed_source.h>
#include <relief/convert/prepare/patching.h>
#include <relief/convert/support/number_set.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

namespace relief::detail {

/// The least visibility of the tip of a needle or of a point of a knife edge that can stay: about a thousandth of a
/// degree, which fibres of many lattice steps can keep.
inline constexpr double kNeedle = 2e-5;
/// Edges of spikes, of how far a point may be moved: longer ones cannot be made blunt, and only truncating helps.
inline constexpr double kVeryLong = 30;
/// Visibility, about a degree: hardly a direction sees the faces around a vertex with less.
inline constexpr double kHardlySeen = 0.02;

/// A closed source while it is mended. Every step costs what lies near the places that it changes, not what the whole
/// source has; only the first smoothing looks at all of it. Deterministic.
class SourceEditor {
 public:
  /// `start`: where the points lay before anything moved them. No scanned point comes to lie farther from there than
  /// `farthest`, lattice steps; points that only patches have are free. Vertices that a direction sees only by kNeedle
  /// or a little more stay where they are and count as well seen where their edges are too long for smoothing to help.
  SourceEditor(const ClosedSource& given, std::span<const LatticePoint> start, double farthest);

  /// New faces and points come last; those that went have corners kNone.
  [[nodiscard]] const SourceIndex& source() const noexcept { return source_; }
  [[nodiscard]] const Rings& rings() const noexcept { return rings_; }
  /// Returns the connected component that a face belongs to, numbered by its first face among those given. The first
  /// call looks at all faces.
  [[nodiscard]] std::uint32_t component_of(std::uint32_t f) {
    find_components_once();
    return components_.of_face[f];
  }
  [[nodiscard]] SourceIndex take_source() && { return std::move(source_); }

  enum class Seen : std::uint8_t { Well, Poorly, NotAll };
  /// Returns how well some direction sees the faces of every vertex: whether all have the visibility that is wanted, or
  /// at least the least one; nothing when cancelled.
  std::optional<Seen> look_at_all(double wanted, double least, const Progress& progress);

  /// Returns the vertices of which no direction sees all faces, ascending; after look_at_all() or smooth().
  [[nodiscard]] std::vector<std::uint32_t> singular() const;

  enum class Neighbours : std::uint8_t { Follow, FollowLate };
  /// Moves vertices whose visibility is below `wanted`, and those given, towards their neighbours. These follow a
  /// little, from the start or only where moving the vertices alone does not help. The vertices whose visibility stays
  /// below `least`; nothing when cancelled.
  std::optional<std::vector<std::uint32_t>> smooth(std::span<const std::uint32_t> given, double wanted, double least,
                                                   Neighbours neighbours, const Progress& progress);

  /// Moves the points of faces that intersect others, or come too near to them, off these: into the solid where it
  /// overlaps itself, out of it where it is inside out. By 2 % of the edges there, and more each time that a point is
  /// moved. False when cancelled.
  bool push_apart(std::span<const std::uint32_t> bad, const Progress& progress);

  /// Remembers where the points lie now. Nothing may be cut before the last restore().
  void keep() { kept_ = source_.points; }
  /// Puts points back to where they were kept, those given and those around vertices that have changed since the last
  /// smoothing or restoring and whose visibility is below `least`. How many that moves.
  std::size_t restore(std::vector<std::uint32_t> points, double least);

  /// From now on scanned points may come to lie this far from where they were.
  void allow(double farthest) noexcept { farthest_ = farthest; }

  struct Loss {
    double area = 0;  ///< of scanned faces, square lattice steps
    std::size_t faces = 0, components = 0;
    double widest = 0;   ///< diagonal of the box around the widest hole, lattice steps
    LatticePoint place;  ///< in the middle of it
  };
  /// Cuts the faces out with so many rings around them, one ring more each time a place is cut again, and closes the
  /// loops. Tiny pieces that come loose go too, and so do pieces of patches alone. A patch is fill where its loop was.
  /// Empty when no face would be left or a loop cannot be closed: then discard the editor.
  std::optional<Loss> cut_and_patch(std::span<const std::uint32_t> bad, std::size_t rings);

  /// Returns what of the area and the faces that would cost.
  [[nodiscard]] Loss loss_of_cut(std::span<const std::uint32_t> bad, std::size_t rings) const;

  /// Holds what has changed since the last call: points that faces around them have moved, come or gone, and the faces
  /// that are no more.
  struct Changes {
    std::vector<std::uint32_t> points, gone;
  };
  Changes take_changes();

  /// Frees what only mending needs.
  void release();
  /// Puts the mended source into the given one, whose points stay the first ones, and the number of each point there
  /// into source().point_of. Once only.
  void put_back(ClosedSource& given);
  struct Moves {
    std::size_t points = 0;
    double most = 0;  ///< lattice steps
  };
  /// Scanned points that have moved.
  [[nodiscard]] Moves moves() const;
  [[nodiscard]] bool has_moved(std::uint32_t v) const noexcept { return !(source_.points[v] == start_[v]); }
  [[nodiscard]] bool is_scanned(std::uint32_t f) const noexcept { return patch_[f] == 0; }
  [[nodiscard]] bool was_cut() const noexcept { return was_cut_; }
  /// Lattice steps.
  [[nodiscard]] double shortest_edge_at(std::uint32_t v) const;
  /// Returns the faces around some points, ascending.
  [[nodiscard]] std::vector<std::uint32_t> faces_around(std::span<const std::uint32_t> points) const;

 private:
  void find_components_once();
  void look_at(std::uint32_t v, double wanted, double least);
  void look_again_at(std::uint32_t v, double wanted, double least);
  void follow_winding();
  void forget_winding();
  bool find_ways(std::span<const std::uint32_t> bad, const Progress& progress);
  [[nodiscard]] LatticePoint within_reach(std::uint32_t v, Vec3d place) const;
  std::vector<std::uint32_t> move_to(std::span<const std::pair<std::uint32_t, LatticePoint>> moves);
  [[nodiscard]] double area_of(std::uint32_t f) const noexcept { return 0.5 * length(source_.cross_of(f)); }
  [[nodiscard]] Loss loss_of(const CutRegion& region) const;
  bool replace(const CutRegion& region, const Patches& patches);

  SourceIndex source_;
  Rings rings_;
  double farthest_;
  std::vector<LatticePoint> start_, kept_;
  enum class Sight : std::uint8_t { Well, Poor, Singular };
  std::vector<std::uint8_t> free_;      // per point
  std::vector<Sight> sight_;            // per point: how well some direction sees its faces
  std::vector<std::uint32_t> poor_;     // points that are not seen well, ascending
  std::vector<std::uint32_t> pending_;  // points to look at in the next smoothing or restoring
  bool looked_ = false, was_cut_ = false;
  Changes changes_;
  std::vector<std::int8_t> way_;               // per point: 1 out of the solid, -1 into it, 0 not known
  std::vector<std::uint8_t> asked_;            // per point: whether its way was looked for
  std::vector<float> stride_;                  // per point: how far it was last pushed, share of its edges
  std::vector<Vec3d> places_;                  // per point: where it was when ways were last looked for
  std::optional<WindingNumber> winding_;       // of the faces at these places
  std::vector<std::uint8_t> patch_, phantom_;  // per face
  std::vector<std::uint8_t> heat_;             // per point: how often its place was cut
  Components components_;                      // of faces, once it was requested
  std::vector<std::size_t> component_sizes_;
  std::size_t alive_;
  NumberSet touched_, turned_;  // points and faces, by the last move_to()
};

}  // namespace relief::detail
