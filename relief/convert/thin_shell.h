// The finest shell of all: one slab on every triangle of the source.
#pragma once

#include <relief/base/progress.h>
#include <relief/convert/box_tree.h>
#include <relief/convert/ordered_source.h>
#include <relief/convert/shell.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace relief::detail {

using Ends = std::array<LatticePoint, 2>;  ///< of a fibre, by Side

/// The least fibre half that the thin shell may have, lattice steps.
inline constexpr double kLeastHeight = 12;

/// Each fibre runs through its vertex in the direction that sees all the faces there, so C2, C6 and C7 hold by
/// construction; heights are halved where C1, C3 or C5 fail. Where the source changes, only what lies there is made
/// anew. Runs on all threads; the result does not depend on their number.
class ThinShell {
 public:
  /// Both must outlive it. `longest`: of a fibre, lattice steps.
  ThinShell(const OrderedSource& source, const Rings& rings, double longest)
      : source_(source), rings_(rings), tallest_(0.49 * longest) {}

  /// Makes the shell, or makes it anew where the source has changed: `changed` are the points that faces around them
  /// have moved, come or gone, and `gone` the faces that are no more. False when cancelled; it is of no use then.
  bool update(std::span<const std::uint32_t> changed, std::span<const std::uint32_t> gone, const Progress& progress);

  /// Faces of the source that cannot be made valid, ascending.
  [[nodiscard]] const std::vector<std::uint32_t>& faults() const noexcept { return faults_; }
  /// Per point of the source. The shell is of no more use then; the same for the tree.
  [[nodiscard]] std::vector<Ends> take_ends() { return std::move(ends_); }
  /// Over boxes that hold the slabs, in the order of the source's faces.
  [[nodiscard]] std::unique_ptr<BoxTree> take_tree() { return std::move(tree_); }

 private:
  void start(std::uint32_t v);
  void place(std::uint32_t v);
  [[nodiscard]] LatticeTriangle triangle(std::uint32_t f, Side side) const noexcept;
  [[nodiscard]] Box3d box(std::uint32_t f) const noexcept;
  void test(std::uint32_t f, bool source_is_new);
  bool shrink(std::vector<std::uint32_t>& work);

  const OrderedSource& source_;
  const Rings& rings_;
  double tallest_;  // fibre half
  std::vector<Vec3f> directions_;
  std::vector<std::array<float, 2>> heights_;  // by Side
  std::vector<Ends> ends_;
  std::vector<std::uint8_t> blamed_;  // per point, a bit per Side
  std::vector<std::uint8_t> works_, faulty_;
  std::vector<std::uint32_t> faults_, shortest_;  // shortest_: points whose fibres have been cut down to the least
  std::atomic<std::size_t> pairs_ = 0;
  std::unique_ptr<BoxTree> tree_;  // of the slabs as they were at first: they only shrink
};

}  // namespace relief::detail
