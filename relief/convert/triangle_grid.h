// A uniform grid over boxes that come and go: which of them may meet a given box.
#pragma once

#include <relief/base/vec.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace relief::detail {

/// Boxes are entered under a number and never taken out: a number stands in all cells around the boxes that it ever
/// had, so the caller tests what it is given once more. Rebuild when many entries are stale.
class TriangleGrid {
 public:
  /// Enters box_of(k), where it is not empty, for k < count. Cells are about `cell` wide, wider where the boxes would
  /// lie in too many of them.
  template <typename BoxOf>
  void build(std::size_t count, double cell, BoxOf&& box_of) {
    constexpr double kEnough = 24;   // cells per box
    constexpr double kFinest = 128;  // cells per axis
    Box3d all;
    std::size_t boxes = 0;
    for (std::uint32_t k = 0; k < count; ++k) {
      const Box3d box = box_of(k);
      all.add(box);
      boxes += !box.empty();
    }
    if (boxes == 0) all.add(Vec3d{});
    const Vec3d extent = all.extent();
    cell = std::max(cell, std::max({extent.x, extent.y, extent.z, 1.0}) / kFinest);
    double entries = 0;
    for (bool fits = false; !fits; cell *= fits ? 1 : 1.5) {
      entries = 0;
      for (std::uint32_t k = 0; k < count; ++k) {
        const Box3d box = box_of(k);
        if (box.empty()) continue;
        const Vec3d e = box.extent();
        entries += (1 + e.x / cell) * (1 + e.y / cell) * (1 + e.z / cell);
      }
      fits = entries <= kEnough * double(boxes);
    }
    reset(all, cell, count);
    // Until many are stale; what is not used stays untouched.
    entries_.reserve(static_cast<std::size_t>(3.1 * entries) + 4 * 4096);
    for (std::uint32_t k = 0; k < count; ++k)
      if (const Box3d box = box_of(k); !box.empty()) insert(k, box);
  }

  void insert(std::uint32_t number, const Box3d& box) {
    Cells cells = cells_of(box);
    Cells& known = known_[number];
    // What is known stays known: only cells beyond it are entered.
    if (known.from[0] <= known.to[0]) {
      for (std::size_t k = 0; k < 3; ++k) {
        cells.from[k] = std::min(cells.from[k], known.from[k]);
        cells.to[k] = std::max(cells.to[k], known.to[k]);
      }
      if (cells == known) return;
    }
    for_each_cell(cells, [&](int x, int y, int z, std::size_t cell) {
      if (known.holds(x, y, z)) return;
      entries_.push_back({number, heads_[cell]});
      heads_[cell] = static_cast<std::uint32_t>(entries_.size() - 1);
    });
    known = cells;
  }

  /// Calls visit(number) for each number that may meet the box, once or more often; stops when visit returns false.
  template <typename Visit>
  void query(const Box3d& box, Visit&& visit) const {
    bool go_on = true;
    for_each_cell(cells_of(box), [&](int, int, int, std::size_t cell) {
      for (std::uint32_t e = heads_[cell]; go_on && e != kEnd; e = entries_[e].next) go_on = visit(entries_[e].number);
    });
  }

  [[nodiscard]] std::size_t entry_count() const noexcept { return entries_.size(); }

 private:
  void reset(const Box3d& all, double cell, std::size_t numbers) {
    low_ = all.low;
    const Vec3d extent = all.extent();
    cell_ = cell;
    for (std::size_t k = 0; k < 3; ++k) size_[k] = static_cast<int>(extent[k] / cell_) + 1;
    // Cells share heads where there are many more of them than numbers.
    const std::size_t cells =
        static_cast<std::size_t>(size_[0]) * static_cast<std::size_t>(size_[1]) * static_cast<std::size_t>(size_[2]);
    heads_.assign(std::bit_ceil(std::min(cells, 4 * numbers + 64)), kEnd);
    entries_.clear();
    known_.assign(numbers, {});
  }

  static constexpr std::uint32_t kEnd = 0xffffffffU;
  struct Entry {
    std::uint32_t number, next;
  };

  struct Cells {
    std::array<std::int16_t, 3> from{0, 0, 0}, to{-1, -1, -1};
    [[nodiscard]] bool holds(int x, int y, int z) const noexcept {
      return x >= from[0] && x <= to[0] && y >= from[1] && y <= to[1] && z >= from[2] && z <= to[2];
    }
    friend bool operator==(const Cells& a, const Cells& b) noexcept = default;
  };

  [[nodiscard]] Cells cells_of(const Box3d& box) const noexcept {
    Cells cells;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto clamped = [&](double v) {
        return static_cast<std::int16_t>(std::clamp(static_cast<int>((v - low_[k]) / cell_), 0, size_[k] - 1));
      };
      cells.from[k] = clamped(box.low[k]);
      cells.to[k] = clamped(box.high[k]);
    }
    return cells;
  }

  template <typename Visit>
  void for_each_cell(const Cells& cells, Visit&& visit) const {
    for (int z = cells.from[2]; z <= cells.to[2]; ++z)
      for (int y = cells.from[1]; y <= cells.to[1]; ++y)
        for (int x = cells.from[0]; x <= cells.to[0]; ++x)
          visit(x, y, z,
                ((static_cast<std::size_t>(z) * static_cast<std::size_t>(size_[1]) + static_cast<std::size_t>(y)) *
                     static_cast<std::size_t>(size_[0]) +
                 static_cast<std::size_t>(x)) &
                    (heads_.size() - 1));
  }

  Vec3d low_;
  double cell_ = 1;
  std::array<int, 3> size_{1, 1, 1};
  std::vector<std::uint32_t> heads_;
  std::vector<Entry> entries_;
  std::vector<Cells> known_;
};

}  // namespace relief::detail
