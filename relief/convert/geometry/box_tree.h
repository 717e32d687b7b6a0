// A tree over boxes that lie in an order which keeps neighbours together.
#pragma once

#include <relief/base/lanes.h>
#include <relief/base/vec.h>
#include <relief/convert/geometry/lattice.h>
#include <relief/convert/support/parallel.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

namespace relief::detail {

/// Returns the box without bounds.
[[nodiscard]] constexpr Box3d everywhere() noexcept {
  Box3d box;
  box.low = {-Box3d::kFar, -Box3d::kFar, -Box3d::kFar};
  box.high = {Box3d::kFar, Box3d::kFar, Box3d::kFar};
  return box;
}

/// A box in float around one in double, wider by at most eight lattice steps. Coordinates in [0, 2^25].
struct FloatBox {
  std::array<float, 3> low{1e30F, 1e30F, 1e30F}, high{-1e30F, -1e30F, -1e30F};

  [[nodiscard]] static FloatBox around(const Box3d& box) noexcept {
    FloatBox b;
    for (std::size_t k = 0; k < 3; ++k) {  // floats up to 2^25 are off by two at most
      b.low[k] = static_cast<float>(box.low[k] - 4);
      b.high[k] = static_cast<float>(box.high[k] + 4);
    }
    return b;
  }
  [[nodiscard]] static FloatBox around(const LatticeBox& box) noexcept {
    const Four from = __builtin_convertvector(box.low - 4, Four), to = __builtin_convertvector(box.high + 4, Four);
    return {{from[0], from[1], from[2]}, {to[0], to[1], to[2]}};
  }
  [[nodiscard]] bool meets(const FloatBox& b) const noexcept {
    return ((low[0] <= b.high[0]) & (high[0] >= b.low[0]) & (low[1] <= b.high[1]) & (high[1] >= b.low[1]) &
            (low[2] <= b.high[2]) & (high[2] >= b.low[2])) != 0;
  }
  friend bool operator==(const FloatBox& a, const FloatBox& b) noexcept = default;
};

/// A box that many others are held against, one by one.
class BoxProbe {
 public:
  explicit BoxProbe(const FloatBox& box) noexcept
      : high_{box.high[0], box.high[1], box.high[2], 2e30F}, low_{-2e30F, box.low[0], box.low[1], box.low[2]} {}
  [[nodiscard]] bool meets(const FloatBox& b) const noexcept {
    static_assert(sizeof(FloatBox) == 6 * sizeof(float));
    // The box's six numbers overlap in two fours: the first ends with high[0], the second starts with low[2].
    Four first, second;
    const auto* bytes = reinterpret_cast<const std::byte*>(&b);
    std::memcpy(&first, bytes, sizeof(Four));
    std::memcpy(&second, bytes + 2 * sizeof(float), sizeof(Four));
    return bits_of((first <= high_) & (second >= low_)) == 15;
  }

 private:
  Four high_, low_;
};

/// Eight boxes to a node, node by node in the order given; no pointers, 28 bytes per box. Boxes are kept in float,
/// widened by at most eight lattice steps, so queries err on the safe side. Queries may run on many threads at once.
class BoxTree {
 public:
  /// box_of(k) for k < count, coordinates in [0, 2^25]. Runs on all threads, or on the caller's alone.
  template <typename BoxOf>
  BoxTree(std::size_t count, BoxOf&& box_of, bool on_all_threads = true) : count_(count) {
    const std::size_t grain = on_all_threads ? 256 : count + 1;  // nodes
    levels_.emplace_back((count + kWidth - 1) / kWidth);
    fill(levels_[0], grain, [&](std::size_t k) { return k < count ? FloatBox::around(box_of(k)) : FloatBox{}; });
    while (levels_.back().size() > 1) {
      std::vector<Node> above((levels_.back().size() + kWidth - 1) / kWidth);
      const std::vector<Node>& below = levels_.back();
      fill(above, grain, [&](std::size_t k) { return k < below.size() ? below[k].all() : FloatBox{}; });
      levels_.push_back(std::move(above));
    }
  }

  [[nodiscard]] std::size_t count() const noexcept { return count_; }

  /// Gives a box another place, or none when it is empty; k = count() adds one. Not while queries run.
  void set(std::size_t k, const Box3d& box) {
    count_ = std::max(count_, k + 1);
    FloatBox bounds = FloatBox::around(box);
    for (std::size_t level = 0; level < levels_.size(); ++level) {
      std::vector<Node>& nodes = levels_[level];
      const std::size_t n = k / kWidth;
      const bool is_new = n == nodes.size();
      if (is_new) nodes.push_back(Node::empty());
      const FloatBox before = nodes[n].all();
      nodes[n].set(k % kWidth, bounds);
      bounds = nodes[n].all();
      if (!is_new && bounds == before) return;
      k = n;
      if (level + 1 < levels_.size() || nodes.size() == 1) continue;
      levels_.push_back({Node::empty()});
      levels_.back()[0].set(0, levels_[level][0].all());
    }
  }

  /// Calls visit(k) for each k whose box may meet the given one, by ascending k, until it returns false.
  template <typename Visit>
  void query(const Box3d& box, Visit&& visit) const {
    if (count_ == 0) return;
    const FloatBox bounds = FloatBox::around(box);
    descend([&](const Node& node) { return node.meeting(bounds); }, visit);
  }

 private:
  static constexpr std::size_t kWidth = 8;

  struct Node {
    std::array<std::array<Lanes, kWidth / 4>, 3> low, high;

    [[nodiscard]] static Node empty() noexcept {
      Node node;
      for (std::size_t k = 0; k < kWidth; ++k) node.set(k, {});
      return node;
    }
    void set(std::size_t k, const FloatBox& b) noexcept {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        low[axis][k / 4].of[k % 4] = b.low[axis];
        high[axis][k / 4].of[k % 4] = b.high[axis];
      }
    }
    [[nodiscard]] FloatBox all() const noexcept {
      FloatBox b;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const Four l = least(low[axis][0].all(), low[axis][1].all());
        const Four h = greatest(high[axis][0].all(), high[axis][1].all());
        b.low[axis] = std::min(std::min(l[0], l[1]), std::min(l[2], l[3]));
        b.high[axis] = std::max(std::max(h[0], h[1]), std::max(h[2], h[3]));
      }
      return b;
    }
    [[nodiscard]] unsigned meeting(const FloatBox& b) const noexcept {
      unsigned mask = 0;
      for (std::size_t half = 0; half < 2; ++half) {
        FourMask hit = (low[0][half].all() <= b.high[0]) & (high[0][half].all() >= b.low[0]);
        for (std::size_t axis = 1; axis < 3; ++axis)
          hit &= (low[axis][half].all() <= b.high[axis]) & (high[axis][half].all() >= b.low[axis]);
        mask |= bits_of(hit) << 4 * half;
      }
      return mask;
    }
  };

  template <typename FloatBoxOf>
  static void fill(std::vector<Node>& nodes, std::size_t grain, FloatBoxOf&& bounds_of) {
    for_all(nodes.size(), grain, {}, [&](std::size_t n) {
      for (std::size_t k = 0; k < kWidth; ++k) nodes[n].set(k, bounds_of(n * kWidth + k));
    });
  }

  template <typename Choose, typename Visit>
  void descend(Choose&& choose, Visit&& visit) const {
    struct Step {
      std::uint32_t node;
      unsigned left;  // children that remain
    };
    std::array<Step, 12> path;  // 8^12 boxes
    std::size_t level = levels_.size() - 1;
    path[level] = {0, choose(levels_[level][0])};
    for (;;) {
      Step& at = path[level];
      if (at.left == 0) {
        if (++level == levels_.size()) return;
        continue;
      }
      const auto child =
          static_cast<std::uint32_t>(at.node * kWidth) + static_cast<std::uint32_t>(std::countr_zero(at.left));
      at.left &= at.left - 1;
      if (level == 0) {
        if (!visit(child)) return;
      } else {
        --level;
        path[level] = {child, choose(levels_[level][child])};
      }
    }
  }
  std::size_t count_;
  std::vector<std::vector<Node>> levels_;  // boxes first, the root last
};

}  // namespace relief::detail
