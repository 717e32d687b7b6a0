// What of the surface is around a place, found once and then asked about from many places near it.
#pragma once

#include <relief/haptics/contact/patches.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

namespace relief::detail {

/// A list of the squares that come within a reach of a place. It has as many of the nearest as there is room for: about
/// the place itself no list knows more. It holds all triangles nearer than a distance to another place as long as
/// covers() says so. A query keeps the distances that it finds, so that the next one skips most squares. Cost of a
/// query: a few nanoseconds per square, about 60 for each one that may be near.
class Neighbourhood {
 public:
  /// Makes the list again, with a reach from `least` to `far`: twice as far beyond `least` as the last one, and as far
  /// as there is room for all squares, be it less than `least`.
  /// Once more than `most` samples are placed it leaves the rest, covers nothing yet, and returns false. The next call
  /// goes on from there, if what was begun is around its centre, or reaches far enough around it. Cost: some fifty
  /// nanoseconds a square.
  bool gather(MicroTriangles& surface, Vec3d centre, double least, double far, double flat, int most) noexcept {
    const bool same = state_ == State::Begun && least == least_ && far == far_ && flat == flat_;
    bool begun = same && (centre == centre_ || reach_around(centre) >= least);
    if (!begun) begin(centre, least, far, flat);
    for (;;) {
      const std::size_t known = slabs_;
      if (!go_on(surface, most)) {
        goes_on_ = begun && slabs_ > known;
        return false;
      }
      if (covers(centre, least)) return true;
      begin(centre, least, far, flat);  // it had to be cut short while it was made
      begun = false;
    }
  }
  void forget() noexcept {
    share_ = 1;
    state_ = State::None;
  }
  /// The last call did not come to the end, but nearer to that of what was begun before.
  [[nodiscard]] bool goes_on() const noexcept { return state_ == State::Begun && goes_on_; }

  /// Everything that is nearer to a place than this is in the list.
  [[nodiscard]] double reach_at(Vec3d point) const noexcept {
    return state_ == State::Whole ? reach_around(point) : -1;
  }
  /// Returns whether everything nearer to a place than a distance is in the list, or as much of the nearest as there is
  /// room for, if it was made around that place: no list has more.
  [[nodiscard]] bool covers(Vec3d point, double distance) const noexcept {
    return reach_at(point) >= distance || (state_ == State::Whole && point == centre_);
  }
  /// As visit_near(), for what is covered. Knows the triangles of a square from the patches. Once more than `most`
  /// samples are placed it leaves the rest, and returns false; what is known by then need not be found again.
  template <typename Visit>
  bool visit_near(MicroTriangles& surface, Patches& patches, Vec3d point, double& reach2, int most,
                  Visit&& visit) noexcept {
    surface.add_placed(static_cast<int>(list_.size() / kScanned));
    Look<Visit> look{surface, patches, point, reach2, most, visit};
    float clear = 0;
    return look_in(list_, centre_, look, clear) != End::Cut;
  }
  /// Returns up to `reach`, which is covered, no micro-triangle is nearer to the point than this.
  [[nodiscard]] double clear_around(Vec3d point, double reach) const noexcept {
    auto clear = static_cast<float>(reach * scale_);
    list_.each_near(to_float((point - centre_) * scale_), clear,
                    [&](std::size_t, float least) noexcept { clear = std::min(clear, least); });
    return std::min(reach, double{clear} / scale_);
  }

 private:
  static constexpr std::size_t kMost = 128;   // squares
  static constexpr std::size_t kScanned = 8;  // squares or slabs that are passed over in a sample's time
  // Of what is between least and far: so little is hardly more than nothing, but can be doubled.
  static constexpr double kLeastShare = 1.0 / kMost;
  static constexpr int kVisited = 3;  // samples' time that one takes whose triangles may be near

  /// Holds what is looked for.
  template <typename Visit>
  struct Look {
    MicroTriangles& surface;
    Patches& patches;
    Vec3d point;
    double& reach2;
    int most;
    Visit& visit;
  };
  enum class State { None, Begun, Whole };
  enum class End { All, Enough, Cut };  ///< Enough: nothing more is looked for, Cut: there is no more time
  struct Near {
    float least;
    std::uint32_t number;
    [[nodiscard]] bool operator<(const Near& other) const noexcept { return least < other.least; }
  };

  /// Visits what is near in some squares, from the nearest on, and keeps in them what is known then. `clear`: if it was
  /// all, none of their triangles is nearer than that.
  template <std::size_t kSize, typename Visit>
  End look_in(SquareList<kSize>& squares, Vec3d origin, Look<Visit>& look, float& clear) noexcept {
    const Vec3f place = to_float((look.point - origin) * scale_);
    const auto reach = [&]() noexcept { return static_cast<float>(std::sqrt(look.reach2) * scale_); };
    std::array<Near, kSize> near;
    std::size_t count = 0;
    float most = reach();
    clear = std::numeric_limits<float>::infinity();
    squares.each_near(place, clear, [&](std::size_t number, float least) noexcept {
      if (least < most)
        near[count++] = {least, static_cast<std::uint32_t>(number)};
      else
        clear = std::min(clear, least);
    });
    std::sort(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(count));
    for (const auto [least, number] : std::span(near).first(count)) {
      if (least >= most) {
        clear = std::min(clear, least);
        break;
      }
      if (look.surface.placed() > look.most) return End::Cut;
      look.surface.add_placed(kVisited);
      const GridSquare square = squares[number];
      float there = 0;
      if (square.flat || square.level == 0) {
        Patch& patch = look.patches.patches.of(look.surface, square, centre_, scale_, flat_);
        const bool bounded = patch.bounded();
        there = patch.visit_near(look.surface, look.point, look.reach2, look.visit);
        if (patch.bounded() && !bounded) look.patches.count_bounded();
      } else {
        Block& block = look.patches.block(look.surface, square, centre_, scale_, flat_);
        const End end = look_in(block.parts(), block.origin(), look, there);
        if (end != End::All) return end;
      }
      if (!(look.reach2 > 0)) return End::Enough;
      squares.keep(number, place, there);
      clear = std::min(clear, there);
      most = reach();
    }
    return End::All;
  }
  void begin(Vec3d centre, double least, double far, double flat) noexcept {
    list_.clear();
    centre_ = centre;
    least_ = least;
    far_ = far;
    flat_ = flat;
    scale_ = 1 / least;
    begun_ = reach_ = least + (far - least) * share_;
    at_ = {};
    slabs_ = 0;
    state_ = State::Begun;
  }
  /// Returns whether it has come to the end.
  bool go_on(MicroTriangles& surface, int most) noexcept {
    double reach2 = reach_ * reach_;
    const bool cut =
        surface.mesh().visit_nearest([&](const Box3d& box) noexcept { return box.distance2(centre_); }, reach2,
                                     [&](SlabId s) noexcept {
                                       if (surface.placed() > most) return true;
                                       add_slab(surface, s);
                                       ++slabs_;
                                       reach2 = reach_ * reach_;
                                       return false;
                                     },
                                     at_);
    if (cut) return false;
    state_ = State::Whole;
    list_.close();
    const double found = (reach_ - least_) / (far_ - least_);
    share_ = reach_ == begun_ ? std::min(2 * share_, 1.0) : std::max(found, kLeastShare);
    return true;
  }
  void add_slab(MicroTriangles& surface, SlabId s) noexcept {
    surface.add_placed(1);
    if (surface_box(surface.model(), s).distance2(centre_) > reach_ * reach_) return;
    surface.enter(s);
    NearSlab(surface, s, centre_, flat_)
        .squares(reach_, 2 * least_, scale_, [&](const auto& at, const auto& sheets, std::size_t lane) {
          if (list_.size() == kMost) drop_far(surface);
          list_.add(at, sheets, lane);
        });
  }
  /// Makes room for more by a reach that is no longer: none where more squares than there is room for may touch the
  /// centre.
  void drop_far(MicroTriangles& surface) noexcept {
    surface.add_placed(kMost / kScanned);
    reach_ = std::clamp(double{list_.keep_nearer_half()} / scale_, 0.0, reach_);
  }
  [[nodiscard]] double reach_around(Vec3d point) const noexcept {
    return reach_ * (1 - 1e-9) - length(point - centre_);
  }

  Vec3d centre_;
  double least_ = 0, far_ = 0, flat_ = 0, scale_ = 1;
  double reach_ = 0, begun_ = 0;  ///< begun_: as it was before it was cut short
  double share_ = 1;              ///< of what is between least and far, of the next list at most
  SlabMesh::Visited at_;          ///< how far it has got
  std::size_t slabs_ = 0;         ///< that have been dealt with
  State state_ = State::None;     ///< Whole: it has come to the end
  bool goes_on_ = false;          ///< the last call has got on with what was begun before
  SquareList<kMost> list_;        ///< relative to the centre
};

}  // namespace relief::detail
