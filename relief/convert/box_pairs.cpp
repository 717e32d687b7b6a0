#include <relief/convert/box_pairs.h>

#include <algorithm>
#include <numeric>

namespace relief::detail {
namespace {

// A binary tree over the boxes, split at the median of the longest axis; leaves of up to four.
class Tree {
 public:
  explicit Tree(std::span<const Box3d> boxes) : boxes_(boxes), order_(boxes.size()) {
    std::iota(order_.begin(), order_.end(), 0U);
    nodes_.reserve(boxes.size());
    if (!boxes.empty()) build(0, order_.size());
  }

  template <typename Visit>
  void query(const Box3d& box, Visit&& visit) const {
    if (nodes_.empty()) return;
    std::vector<std::size_t>& stack = stack_;
    stack.assign(1, 0);
    while (!stack.empty()) {
      const Node& node = nodes_[stack.back()];
      const std::size_t left = stack.back() + 1;
      stack.pop_back();
      if (!node.box.meets(box)) continue;
      if (node.right == 0) {
        for (std::size_t k = node.begin; k < node.end; ++k)
          if (boxes_[order_[k]].meets(box)) visit(order_[k]);
      } else {
        stack.push_back(node.right);
        stack.push_back(left);
      }
    }
  }

 private:
  struct Node {
    Box3d box;
    std::size_t begin, end, right;  // right == 0: a leaf
  };

  void build(std::size_t begin, std::size_t end) {
    const std::size_t self = nodes_.size();
    nodes_.push_back({{}, begin, end, 0});
    Box3d box, centres;
    for (std::size_t k = begin; k < end; ++k) {
      box.add(boxes_[order_[k]]);
      centres.add(boxes_[order_[k]].centre());
    }
    nodes_[self].box = box;
    if (end - begin <= 4) return;
    const Vec3d extent = centres.extent();
    const std::size_t axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
    const std::size_t middle = (begin + end) / 2;
    const auto at = [&](std::size_t k) { return order_.begin() + static_cast<std::ptrdiff_t>(k); };
    std::nth_element(at(begin), at(middle), at(end), [&](std::uint32_t a, std::uint32_t b) {
      const double ca = boxes_[a].low[axis] + boxes_[a].high[axis], cb = boxes_[b].low[axis] + boxes_[b].high[axis];
      return ca != cb ? ca < cb : a < b;
    });
    build(begin, middle);
    nodes_[self].right = nodes_.size();
    build(middle, end);
  }

  std::span<const Box3d> boxes_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
  mutable std::vector<std::size_t> stack_;
};

}  // namespace

std::vector<std::pair<std::uint32_t, std::uint32_t>> meeting_boxes(std::span<const Box3d> boxes) {
  const Tree tree(boxes);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  for (std::uint32_t a = 0; a < boxes.size(); ++a) {
    const auto first = static_cast<std::ptrdiff_t>(pairs.size());
    tree.query(boxes[a], [&](std::uint32_t b) {
      if (b > a) pairs.emplace_back(a, b);
    });
    std::sort(pairs.begin() + first, pairs.end());
  }
  return pairs;
}

}  // namespace relief::detail
