// What of the surface is around a place, found once and then asked about from many places near it.
#pragma once

#include <relief/core/patches.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <span>
#include <utility>

namespace relief::detail {

/// A list of the squares that come within a reach of a place. The triangles that are nearer to another place than a
/// distance are in them as long as covers(). Cost of a look at it: a nanosecond or two a square, twenty for each that
/// may be near, and what is done with the triangles of those that may be near.
class Neighbourhood {
 public:
  /// Makes the list anew, with a reach from `least` to `most`: the more squares there were in the last one, the less
  /// far. Where there is no room for those within `least`, it covers nothing. `flat`: see visit_near(). Cost: some
  /// fifty nanoseconds a square.
  void gather(MicroTriangles& surface, Vec3d centre, double least, double most, double flat) noexcept {
    list_.clear();
    centre_ = centre;
    flat_ = flat;
    scale_ = 1 / least;
    reach_ = least + (most - least) * share_;
    surface.mesh().visit_tree([&](const Box3d& box) { return box.distance2(centre) < reach_ * reach_; },
                              [&](SlabId s) {
                                surface.enter(s);
                                NearSlab(surface, s, centre, flat)
                                    .squares(reach_, kCoarse * least, scale_,
                                             [&](const auto& at, const auto& sheets, std::size_t lane) {
                                               if (list_.size() == kMost) drop_far(least, most);
                                               if (reach_ > 0) list_.add(at, sheets, lane);
                                             });
                                return false;
                              });
    list_.close();
    if (list_.size() > kEnough) share_ = std::max(0.8 * share_, kLeastShare);
    if (list_.size() < kEnough / 2) share_ = std::min(1.25 * share_, 1.0);
  }
  void forget() noexcept {
    reach_ = 0;
    share_ = kShare;
  }
  /// What part of the difference between the least and the most reach the next list will have at most.
  [[nodiscard]] double share() const noexcept { return share_; }

  /// Everything that is nearer to a place than this is in the list.
  [[nodiscard]] double reach_at(Vec3d point) const noexcept { return reach_ * (1 - 1e-9) - length(point - centre_); }
  [[nodiscard]] bool covers(Vec3d point, double distance) const noexcept { return reach_at(point) >= distance; }
  /// As visit_near(), for what is covered. Knows the triangles of a square from the patches. Once more than `most`
  /// samples are placed it leaves the rest, and returns false; what is known by then need not be found again.
  template <typename Visit>
  bool visit_near(MicroTriangles& surface, Patches& patches, Vec3d point, double& reach2, int most,
                  Visit&& visit) const noexcept {
    surface.add_placed(static_cast<int>(list_.size() / kScanned));
    std::array<Near, kMost> near;
    std::size_t count = 0;
    auto reach = static_cast<float>(std::sqrt(reach2) * scale_);
    const auto add = [&](const GridSquare& square, float least) noexcept {
      if (count < kMost)
        near[count++] = {least, square};
      else  // part of a larger one: there is room for the whole list
        visit_in(surface, patches, square, point, reach2, visit);
    };
    // The nearest comes next, after which there may be less to look for.
    const auto put_nearest_last = [&](std::size_t first) noexcept {
      const auto of = std::span(near).first(count).subspan(first);
      if (of.size() > 1) std::swap(*std::ranges::min_element(of, {}, &Near::least), of.back());
    };
    list_.each_near(to_float((point - centre_) * scale_), reach, add);
    put_nearest_last(0);
    while (count > 0) {
      const auto [least, square] = near[--count];
      if (least >= reach) continue;
      if (surface.placed() > most) return false;
      if (!square.flat && square.level > 0) {
        surface.add_placed(kVisited);
        const std::size_t first = count;
        patches.blocks.of(surface, square, centre_, scale_, flat_).each_near(point, reach, add);
        put_nearest_last(first);
        continue;
      }
      const double before = reach2;
      visit_in(surface, patches, square, point, reach2, visit);
      if (!(reach2 > 0)) return true;
      if (reach2 != before) reach = static_cast<float>(std::sqrt(reach2) * scale_);
    }
    return true;
  }
  /// Gets the triangles ready of squares that may be nearer to a place than `reach`, as long as the work is below
  /// `most` (samples placed).
  void prepare(MicroTriangles& surface, Patches& patches, Vec3d point, double reach, int most) const noexcept {
    const auto near = static_cast<float>(reach * scale_);
    const auto one = [&](const GridSquare& square, float) noexcept {
      if (surface.placed() < most) patches.patches.of(surface, square, centre_, scale_, flat_);
    };
    list_.each_near(to_float((point - centre_) * scale_), near, [&](const GridSquare& square, float least) noexcept {
      if (surface.placed() >= most) return;
      if (square.flat || square.level == 0)
        one(square, least);
      else
        patches.blocks.of(surface, square, centre_, scale_, flat_).each_near(point, near, one);
    });
  }
  /// Up to `reach`, which is covered, no micro-triangle is nearer to the point than this.
  [[nodiscard]] double clear_around(Vec3d point, double reach) const noexcept {
    auto clear = static_cast<float>(reach * scale_);
    list_.each_near(to_float((point - centre_) * scale_), clear,
                    [&](const GridSquare&, float least) noexcept { clear = std::min(clear, least); });
    return std::min(reach, double{clear} / scale_);
  }

 private:
  struct Near {
    float least;
    GridSquare square;
  };
  static constexpr std::size_t kMost = 512, kEnough = 130;
  static constexpr std::size_t kScanned = 16;  // squares that are passed over in the time of a sample that is placed
  static constexpr int kVisited = 2;           // and how many samples' time one takes whose triangles may be near
  static constexpr double kCoarse = 0.8;       // of the least reach: how large its squares are at most
  static constexpr double kShare = 0.5, kLeastShare = 0.02;  // of the room between the reaches: at first, and at last

  template <typename Visit>
  void visit_in(MicroTriangles& surface, Patches& patches, const GridSquare& square, Vec3d point, double& reach2,
                Visit&& visit) const noexcept {
    surface.add_placed(kVisited);
    patches.patches.of(surface, square, centre_, scale_, flat_).visit_near(point, reach2, visit);
  }
  /// Makes room for more by a shorter reach, none where that is not enough.
  void drop_far(double least, double most) noexcept {
    while (list_.size() == kMost && share_ > kLeastShare) {
      share_ *= 0.5;
      reach_ = least + (most - least) * share_;
      list_.keep_near(static_cast<float>(reach_ * scale_));
    }
    if (list_.size() == kMost) reach_ = 0;
  }

  Vec3d centre_;
  double reach_ = 0, scale_ = 1, share_ = kShare, flat_ = 0;
  SquareList<kMost> list_;  ///< relative to the centre
};

}  // namespace relief::detail
