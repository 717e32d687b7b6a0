// The tree over boxes and the cells of space, against going through everything.
#include <relief/convert/geometry/box_tree.h>
#include <relief/convert/shell/kd_partition.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

namespace relief::detail {
namespace {

/// Boxes along a winding line, so that neighbours in order lie near each other.
std::vector<Box3d> boxes_along_a_line(std::size_t count) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<Box3d> boxes;
  Vec3d at = {1e7, 1e7, 1e7};
  for (std::size_t k = 0; k < count; ++k) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      at[axis] = std::clamp(at[axis] + 20000 * (unit(random) - 0.5), 1e5, 3e7);
    Box3d box;
    box.add(at);
    box.add(at + Vec3d{unit(random), unit(random), unit(random)} * 30000);
    boxes.push_back(box);
  }
  return boxes;
}

Box3d widened(Box3d box, double by) {
  box.low = box.low - Vec3d{by, by, by};
  box.high = box.high + Vec3d{by, by, by};
  return box;
}

class Tree : public ::testing::TestWithParam<std::size_t> {
 protected:
  std::vector<Box3d> boxes_ = boxes_along_a_line(GetParam());
  BoxTree tree_{boxes_.size(), [this](std::size_t k) { return boxes_[k]; }};
  std::mt19937 random_{17};
  Vec3d near_some() {
    std::uniform_real_distribution<double> unit(-1, 1);
    return boxes_[random_() % boxes_.size()].centre() + Vec3d{unit(random_), unit(random_), unit(random_)} * 40000;
  }
};

TEST_P(Tree, FindsWhatMeetsABox) {
  for (int trial = 0; trial < 200; ++trial) {
    Box3d box;
    box.add(near_some());
    box.add(near_some());
    if (trial % 2 == 0) box = widened({box.low, box.low}, 5000);
    std::vector<std::uint32_t> found;
    tree_.query(box, [&](std::uint32_t k) {
      found.push_back(k);
      return true;
    });
    EXPECT_TRUE(std::is_sorted(found.begin(), found.end()));
    const std::set<std::uint32_t> all(found.begin(), found.end());
    EXPECT_EQ(all.size(), found.size());
    for (std::uint32_t k = 0; k < boxes_.size(); ++k) {
      if (boxes_[k].meets(box)) {
        EXPECT_TRUE(all.contains(k));
      } else if (all.contains(k)) {
        EXPECT_TRUE(widened(boxes_[k], 16).meets(box));
      }
    }
  }
}

TEST_P(Tree, IsTheSameOnOneThread) {
  const BoxTree alone(boxes_.size(), [this](std::size_t k) { return boxes_[k]; }, false);
  for (int trial = 0; trial < 50; ++trial) {
    const Box3d box = widened({near_some(), near_some()}, 20000);
    const auto found_in = [&](const BoxTree& tree) {
      std::vector<std::uint32_t> found;
      tree.query(box, [&](std::uint32_t k) {
        found.push_back(k);
        return true;
      });
      return found;
    };
    EXPECT_EQ(found_in(alone), found_in(tree_));
  }
}

TEST_P(Tree, StopsWhenTold) {
  std::size_t calls = 0;
  tree_.query(widened(boxes_[0], 1e8), [&](std::uint32_t) { return ++calls < 3; });
  EXPECT_EQ(calls, std::min<std::size_t>(3, boxes_.size()));
}

TEST_P(Tree, FindsBoxesThatWereMovedAddedAndTakenOut) {
  const std::vector<Box3d> others = boxes_along_a_line(2 * boxes_.size() + 100);
  for (std::size_t k = 0; k < others.size(); ++k) {
    if (k < boxes_.size() && k % 3 == 0) continue;  // stays
    const Box3d box = k % 5 == 4 ? Box3d{} : others[k];
    if (k < boxes_.size()) {
      boxes_[k] = box;
    } else {
      boxes_.push_back(box);
    }
    tree_.set(k, box);
  }
  EXPECT_EQ(tree_.count(), boxes_.size());
  for (int trial = 0; trial < 100; ++trial) {
    const Box3d box = widened({near_some(), near_some()}, 20000);
    std::set<std::uint32_t> found;
    tree_.query(box, [&](std::uint32_t k) { return found.insert(k).second; });
    for (std::uint32_t k = 0; k < boxes_.size(); ++k) {
      if (boxes_[k].empty()) {
        EXPECT_FALSE(found.contains(k));
      } else if (boxes_[k].meets(box)) {
        EXPECT_TRUE(found.contains(k));
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Sizes, Tree, ::testing::Values(1, 7, 8, 9, 64, 65, 3000));

TEST(KdPartition, EveryPointIsInACellThatItsBoxNames) {
  std::mt19937 random(5);
  std::normal_distribution<double> bell(0, 1000);
  std::vector<Vec3d> points;
  for (int k = 0; k < 5000; ++k) points.push_back({bell(random), bell(random), 0.1 * bell(random)});
  for (const double share : {0.5, 0.4}) {
    std::vector<Vec3d> copy = points;
    const KdPartition cells(copy, 300, share);
    EXPECT_GE(cells.count(), points.size() / 300);
    EXPECT_LE(cells.count(), 60U);
    std::vector<std::size_t> held(cells.count(), 0);
    for (const Vec3d p : points) {
      std::size_t inside = 0;
      for (std::size_t c = 0; c < cells.count(); ++c) inside += cells.box(c).contains(p);
      EXPECT_GE(inside, 1U);
      std::size_t named = 0;
      cells.for_each({p, p}, [&](std::uint32_t c) {
        EXPECT_TRUE(cells.box(c).contains(p));
        ++named;
        ++held[c];
      });
      EXPECT_EQ(named, inside);
    }
    for (const std::size_t count : held) EXPECT_LE(count, 310U);
  }
}

TEST(KdPartition, EqualPointsEnd) {
  std::vector<Vec3d> points(1000, Vec3d{1, 2, 3});
  EXPECT_EQ(KdPartition(points, 10, 0.5).count(), 1U);
  std::vector<Vec3d> none;
  EXPECT_EQ(KdPartition(none, 10, 0.5).count(), 1U);
}

}  // namespace
}  // namespace relief::detail
