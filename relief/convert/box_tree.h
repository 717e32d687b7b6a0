// A tree over boxes that lie in an order which keeps neighbours together.
#pragma once

#include <relief/base/vec.h>
#include <relief/convert/parallel.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace relief::detail {

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
  [[nodiscard]] bool meets(const FloatBox& b) const noexcept {
    return ((low[0] <= b.high[0]) & (high[0] >= b.low[0]) & (low[1] <= b.high[1]) & (high[1] >= b.low[1]) &
            (low[2] <= b.high[2]) & (high[2] >= b.low[2])) != 0;
  }
};

/// Eight boxes to a node, node by node in the order given; no pointers, 28 bytes per box. Boxes are kept in float,
/// widened by at most eight lattice steps, so queries err on the safe side. Queries may run on many threads at once.
class BoxTree {
 public:
  /// box_of(k) for k < count, coordinates in [0, 2^25]. Runs on all threads.
  template <typename BoxOf>
  BoxTree(std::size_t count, BoxOf&& box_of) : count_(count) {
    levels_.emplace_back((count + kWidth - 1) / kWidth);
    fill(levels_[0], [&](std::size_t k) { return k < count ? FloatBox::around(box_of(k)) : FloatBox{}; });
    while (levels_.back().size() > 1) {
      std::vector<Node> above((levels_.back().size() + kWidth - 1) / kWidth);
      const std::vector<Node>& below = levels_.back();
      fill(above, [&](std::size_t k) { return k < below.size() ? below[k].all() : FloatBox{}; });
      levels_.push_back(std::move(above));
    }
  }

  /// Calls visit(k) for each k whose box may meet the given one, by ascending k, until it returns false.
  template <typename Visit>
  void query(const Box3d& box, Visit&& visit) const {
    if (count_ == 0) return;
    const FloatBox bounds = FloatBox::around(box);
    descend([&](const Node& node) { return node.meeting(bounds); }, visit);
  }
  /// The same for boxes that the segment from origin + from * direction to origin + to * direction may meet.
  template <typename Visit>
  void query(Vec3d origin, Vec3d direction, double from, double to, Visit&& visit) const {
    if (count_ == 0) return;
    descend([&](const Node& node) { return node.meeting(origin, direction, from, to); }, visit);
  }
  /// Calls distance2(k) with the boxes nearest to p first, as long as boxes are nearer than what it returned last: the
  /// least squared distance found so far.
  template <typename Distance2>
  void nearest(Vec3d p, Distance2&& distance2) const {
    if (count_ == 0) return;
    double best = Box3d::kFar;
    approach(levels_.size() - 1, 0, p, best, distance2);
  }

 private:
  static constexpr std::size_t kWidth = 8;

  struct Node {
    std::array<std::array<float, kWidth>, 3> low, high;

    void set(std::size_t k, const FloatBox& b) noexcept {
      for (std::size_t axis = 0; axis < 3; ++axis) low[axis][k] = b.low[axis], high[axis][k] = b.high[axis];
    }
    [[nodiscard]] FloatBox all() const noexcept {
      FloatBox b;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        b.low[axis] = *std::min_element(low[axis].begin(), low[axis].end());
        b.high[axis] = *std::max_element(high[axis].begin(), high[axis].end());
      }
      return b;
    }
    [[nodiscard]] unsigned meeting(const FloatBox& b) const noexcept {
      std::array<std::uint8_t, kWidth> hit;
      for (std::size_t k = 0; k < kWidth; ++k)
        hit[k] =
            static_cast<std::uint8_t>((low[0][k] <= b.high[0]) & (high[0][k] >= b.low[0]) & (low[1][k] <= b.high[1]) &
                                      (high[1][k] >= b.low[1]) & (low[2][k] <= b.high[2]) & (high[2][k] >= b.low[2]));
      unsigned mask = 0;
      for (std::size_t k = 0; k < kWidth; ++k) mask |= unsigned{hit[k]} << k;
      return mask;
    }
    [[nodiscard]] unsigned meeting(Vec3d origin, Vec3d direction, double from, double to) const noexcept {
      unsigned mask = 0;
      for (std::size_t k = 0; k < kWidth; ++k) {
        double enter = from, leave = to;
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const double a = double(low[axis][k]) - origin[axis], b = double(high[axis][k]) - origin[axis];
          if (direction[axis] == 0) {
            if (a > 0 || b < 0) leave = -Box3d::kFar;
            continue;
          }
          const double inverse = 1 / direction[axis];
          enter = std::max(enter, std::min(a * inverse, b * inverse));
          leave = std::min(leave, std::max(a * inverse, b * inverse));
        }
        mask |= static_cast<unsigned>(enter <= leave) << k;
      }
      return mask;
    }
    [[nodiscard]] std::array<double, kWidth> distances2(Vec3d p) const noexcept {
      std::array<double, kWidth> result{};
      for (std::size_t axis = 0; axis < 3; ++axis)
        for (std::size_t k = 0; k < kWidth; ++k) {
          const double gap = std::max({double(low[axis][k]) - p[axis], p[axis] - double(high[axis][k]), 0.0});
          result[k] += gap * gap;
        }
      return result;
    }
  };

  template <typename FloatBoxOf>
  static void fill(std::vector<Node>& nodes, FloatBoxOf&& bounds_of) {
    for_all(nodes.size(), 256, {}, [&](std::size_t n) {
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
  template <typename Distance2>
  void approach(std::size_t level, std::uint32_t at, Vec3d p, double& best, Distance2& distance2) const {
    std::array<double, kWidth> far = levels_[level][at].distances2(p);
    for (;;) {
      const auto nearest = std::min_element(far.begin(), far.end());
      if (!(*nearest < best)) return;
      const auto child = static_cast<std::uint32_t>(at * kWidth) + static_cast<std::uint32_t>(nearest - far.begin());
      *nearest = Box3d::kFar;
      if (level > 0)
        approach(level - 1, child, p, best, distance2);
      else if (child < count_)
        best = distance2(child);
    }
  }

  std::size_t count_;
  std::vector<std::vector<Node>> levels_;  // boxes first, the root last
};

}  // namespace relief::detail
