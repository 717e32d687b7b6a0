// From the thin shell on the source to a coarse one.
#pragma once

#include <relief/base/progress.h>
#include <relief/convert/geometry/components.h>
#include <relief/convert/geometry/shell.h>
#include <relief/convert/geometry/source_index.h>
#include <relief/convert/shell/coarsening.h>
#include <relief/convert/shell/creases.h>
#include <relief/convert/shell/initial_shell.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace relief::detail {

/// Cuts space into cells while there are many slabs: cells run on all threads, and one fits into a cache. Then cells
/// are cut differently, so that other slabs lie inside; the last are reduced as a whole. The result does not depend on
/// the number of threads.
class Partition {
 public:
  /// `source` must outlive it. `ends` and `tree` are its thin shell's. `longest`: of a fibre, lattice steps.
  Partition(const SourceIndex& source, std::vector<Ends>&& ends, std::unique_ptr<BoxTree> tree, std::size_t target,
            double longest)
      : source_(source),
        creases_(source),
        target_(target),
        longest_(longest),
        ends_(std::move(ends)),
        tree_(std::move(tree)) {}

  /// False when cancelled.
  bool reduce(const Progress& progress);
  /// This and all that follows: after reduce().
  [[nodiscard]] std::size_t slab_count() const noexcept { return last_->slab_count(); }
  /// Goes on to the target where that much may be given up; all stays as it was where that takes no slab away. False
  /// when cancelled.
  bool reduce_further(Tolerance tolerance, const Progress& progress) {
    auto before = std::make_unique<Coarsening>(*last_);
    last_->tolerate(tolerance);
    if (!last_->reduce(target_, progress)) return false;
    if (last_->slab_count() >= before->slab_count()) last_ = std::move(before);
    return true;
  }
  /// Notes how things stand, for go_back().
  void keep() { kept_ = std::make_unique<Coarsening>(*last_); }
  [[nodiscard]] bool has_kept() const noexcept { return kept_ != nullptr; }
  /// Goes back to the slabs that keep() remembered.
  void go_back() { last_ = std::move(kept_); }
  /// As in Coarsening. False when cancelled.
  bool thicken(double longest, const Progress& progress) {
    kept_.reset();
    return last_->thicken(longest, creases_, progress);
  }
  /// It is of no more use then.
  [[nodiscard]] Shell shell() &&;
  /// As in Coarsening.
  [[nodiscard]] double lost() const { return last_->lost(); }

 private:
  const SourceIndex& source_;
  Creases creases_;
  std::size_t target_;
  double longest_;
  std::vector<Ends> ends_;
  std::unique_ptr<BoxTree> tree_;
  std::unique_ptr<Coarsening> last_;  // once reduce() has come that far
  std::unique_ptr<Coarsening> kept_;
};

}  // namespace relief::detail
