// The finest shell of all: one slab on every triangle of the source.
#pragma once

#include <relief/base/progress.h>
#include <relief/convert/geometry/box_tree.h>
#include <relief/convert/geometry/components.h>
#include <relief/convert/geometry/shell.h>
#include <relief/convert/geometry/source_index.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace relief::detail {

/// The least fibre half that the thin shell may have, lattice steps: the clearance of two, and what rounding of the
/// ends turns a fibre by, must be little of it.
inline constexpr double kLeastHeight = 12;

/// Returns a bit for each corner of a face whose fibre is to give way to the lowest one: it is more than 16 times as
/// long and may still be shorter. `heights`: of the fibre halves by corner and Side; `least`: of these, by corner. All
/// in lattice steps.
[[nodiscard]] unsigned corners_to_lower(const std::array<std::array<float, 2>, 3>& heights,
                                        const std::array<float, 3>& least) noexcept;

/// The first shell: each fibre runs through its vertex in a direction that all faces there front, so C2, C7 and C6 of
/// its own triangle hold by construction. Heights start at about the edges' lengths and halve where C1, C3, C4, C5 or
/// C6 fail. Where the source changes, only that part is made again. Runs on all threads; the result does not depend on
/// their number.
class InitialShell {
 public:
  enum class Heights : std::uint8_t {
    Shrinking,  ///< 0.8 of the shortest edge at the point, halved as long as that helps
    Creased,    ///< the same, but where a direction hardly sees the faces, fibres stay so long that their ends lie as
                ///< far from the faces as those of others: sharp creases between surfaces that cut each other
    Stiff,      ///< 0.05 of it for good: the faults are where the source does not have that much room
    Roomy       ///< the same with 0.3 of it
  };
  /// All must outlive it. `longest`: of a fibre, lattice steps. `wanted`: per point, whether faults of the faces there
  /// are asked for at first; none: all are.
  InitialShell(const SourceIndex& source, const Rings& rings, double longest, Heights heights = Heights::Shrinking,
               std::span<const std::uint8_t> wanted = {})
      : source_(source), rings_(rings), tallest_(kMostOfLongest * longest), kind_(heights), wanted_(wanted) {}

  /// Makes the shell, or makes it again where the source has changed: `changed` are the points that faces around them
  /// have moved, come or gone, and `gone` the faces that are no more. False when cancelled; it is of no use then.
  bool update(std::span<const std::uint32_t> changed, std::span<const std::uint32_t> gone, const Progress& progress);

  /// Faces of the source that cannot be made valid, ascending.
  [[nodiscard]] const std::vector<std::uint32_t>& faults() const noexcept { return faults_; }
  /// Further faces in whose slabs another triangle folds however thin they are, ascending: they hinder collapses, and
  /// are against C6 if nothing is collapsed there.
  [[nodiscard]] const std::vector<std::uint32_t>& folds() const noexcept { return folds_; }
  /// Per point of the source. The shell is of no more use then; the same for the tree.
  [[nodiscard]] std::vector<Ends> take_ends() { return std::move(ends_); }
  /// Over boxes that hold the slabs, in the order of the source's faces.
  [[nodiscard]] const BoxTree& tree() const noexcept { return *tree_; }
  [[nodiscard]] std::unique_ptr<BoxTree> take_tree() { return std::move(tree_); }

 private:
  static constexpr std::array<double, 4> kStarts = {0.8, 0.8, 0.05, 0.3};  // by Heights, of the shortest edge
  static constexpr double kMostOfLongest = 0.49;  // two halves, rounded to the lattice, are not longer than the longest
  static constexpr std::uint8_t kFault = 1, kFold = 2;

  [[nodiscard]] bool may_shrink() const noexcept { return kind_ == Heights::Shrinking || kind_ == Heights::Creased; }
  void start(std::uint32_t v);
  void place(std::uint32_t v);
  [[nodiscard]] LatticeTriangle triangle(std::uint32_t f, Side side) const noexcept;
  [[nodiscard]] Box3d box(std::uint32_t f) const noexcept;
  void test(std::uint32_t f, bool source_is_new);
  [[nodiscard]] bool can_shrink(std::uint32_t f, std::uint32_t swallowed) const noexcept;
  bool shrink(std::vector<std::uint32_t>& work);

  const SourceIndex& source_;
  const Rings& rings_;
  double tallest_;  // fibre half
  Heights kind_;
  std::span<const std::uint8_t> wanted_;
  std::vector<Vec3f> directions_;
  std::vector<std::array<float, 2>> heights_;  // by Side
  std::vector<float> least_;                   // per point: of its heights
  std::vector<Ends> ends_;
  std::vector<std::uint8_t> blamed_;  // per point, a bit per Side
  std::vector<std::uint8_t> works_, faulty_;
  std::vector<std::uint32_t> faults_, folds_;
  std::vector<std::uint32_t> shortest_;  // points whose fibres have been cut down to the least
  Components components_;
  std::atomic<std::size_t> pairs_ = 0;
  std::unique_ptr<BoxTree> tree_;  // of the slabs as they were at first: they only shrink
};

}  // namespace relief::detail
