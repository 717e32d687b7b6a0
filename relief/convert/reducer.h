// From the thin shell on the source to a coarse one.
#pragma once

#include <relief/base/progress.h>
#include <relief/convert/ordered_source.h>
#include <relief/convert/shell.h>
#include <relief/convert/slab_reducer.h>
#include <relief/convert/thin_shell.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace relief::detail {

/// While there are many slabs, space is cut into cells, and what lies inside a cell is reduced for itself: cells run on
/// all threads, and what one holds fits into a cache. Then the cells are cut anew, so that other slabs lie inside; the
/// last ones are reduced as a whole. The result does not depend on the number of threads.
class Reducer {
 public:
  /// `source` must outlive it. `ends` and `tree` are its thin shell's. `longest`: of a fibre, lattice steps.
  Reducer(const OrderedSource& source, std::vector<Ends>&& ends, std::unique_ptr<BoxTree> tree, std::size_t target,
          double longest)
      : source_(source), target_(target), longest_(longest), ends_(std::move(ends)), tree_(std::move(tree)) {}

  /// False when cancelled.
  bool reduce(const Progress& progress);
  /// This and all that follows: after reduce().
  [[nodiscard]] std::size_t slab_count() const noexcept { return last_->slab_count(); }
  /// Goes on to the target where that much may be given up; all stays as it was where that takes no slab away. False
  /// when cancelled.
  bool reduce_further(Tolerance tolerance, const Progress& progress) {
    auto before = std::make_unique<SlabReducer>(*last_);
    last_->tolerate(tolerance);
    if (!last_->reduce(target_, progress)) return false;
    if (last_->slab_count() >= before->slab_count()) last_ = std::move(before);
    return true;
  }
  /// Notes how things stand, for go_back().
  void keep() { kept_ = std::make_unique<SlabReducer>(*last_); }
  [[nodiscard]] bool has_kept() const noexcept { return kept_ != nullptr; }
  /// To how they stood at keep().
  void go_back() { last_ = std::move(kept_); }
  /// False when cancelled.
  bool thicken(const Progress& progress) {
    kept_.reset();
    return last_->thicken(progress);
  }
  /// It is of no more use then.
  [[nodiscard]] Shell shell() &&;
  /// As in SlabReducer.
  [[nodiscard]] double lost() const { return last_->lost(); }

 private:
  const OrderedSource& source_;
  std::size_t target_;
  double longest_;
  std::vector<Ends> ends_;
  std::unique_ptr<BoxTree> tree_;
  std::unique_ptr<SlabReducer> last_;  // once reduce() has come that far
  std::unique_ptr<SlabReducer> kept_;
};

}  // namespace relief::detail
