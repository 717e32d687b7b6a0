// The micro-triangles of squares that were asked about of late.
#pragma once

#include <relief/core/near_surface.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

namespace relief::detail {

/// Four triangles in discs. In floats, relative to a place near them, in units of about the distance that is asked
/// about.
struct Discs {
  FourVectors middle, normal;  ///< normal: unit, or zero where it is not known
  Four radius{};

  void set_always_near(std::size_t lane) noexcept { set(lane, 0, 1e15F); }
  void set_never_near(std::size_t lane) noexcept { set(lane, 1e9F, 0); }
  /// The triangles are no nearer to a place than the root of this: the way to its foot on the disc's plane or,
  /// where that is outside, to the rim.
  [[nodiscard]] Four least2_from(Vec3f place) const noexcept {
    const FourVectors from = {middle.x - place.x, middle.y - place.y, middle.z - place.z};
    const Four height = dot(from, normal), height2 = height * height, none = {};
    const Four past = greatest(root(greatest(dot(from, from) - height2, none)) - radius, none);
    return greatest(height2 + past * past - kRounding, none);
  }

 private:
  static constexpr float kRounding = 3e-5F;  // of a square of distances: more than floats may be off
  void set(std::size_t lane, float x, float r) noexcept {
    middle.x[lane] = x, middle.y[lane] = middle.z[lane] = 0;
    normal.x[lane] = normal.y[lane] = normal.z[lane] = 0;
    radius[lane] = r;
  }
};

/// Four bodies, each no farther from a disc than so much.
struct Plates {
  Discs discs;
  Four off{};

  /// The bodies are no nearer to a place than this.
  [[nodiscard]] Four least_from(Vec3f place) const noexcept { return root(discs.least2_from(place)) - off; }
};

/// Says how near the triangles of four squares are to a place at least, by what was found at others; as Sheets.
struct Clearances {
  static constexpr float kUnknown = -1e9F, kRounding = 1e-6F;
  FourVectors from;                ///< the place, for each
  Four clear = Four{} + kUnknown;  ///< they were no nearer to it than this,
  Four far{};                      ///< and their centre so far from it

  void keep(std::size_t lane, Vec3f place, float least, float distance) noexcept {
    from.x[lane] = place.x, from.y[lane] = place.y, from.z[lane] = place.z;
    clear[lane] = least;
    far[lane] = distance;
  }
  /// Returns a place that is so far from the centres of squares that reach so far from there. None of their points
  /// comes nearer by more than the way between the places, nor by more than the centre does and the turn of the
  /// direction to it.
  [[nodiscard]] Four least_from(Vec3f place, Four centre_far, Four wide) const noexcept {
    const FourVectors by = {from.x - place.x, from.y - place.y, from.z - place.z};
    const Four way = root(dot(by, by)), nearest = least(far, centre_far) - wide;
    const Four nearer = nearest > 0 ? far - centre_far + wide * way / nearest : way;
    const float rounded = std::abs(place.x) + std::abs(place.y) + std::abs(place.z);
    return clear - least(way, nearer) - kRounding * (1 + centre_far + rounded);
  }
};

/// Squares and their sheets, relative to a place, and what is known of how near they are.
template <std::size_t kMost>
class SquareList {
 public:
  [[nodiscard]] std::size_t size() const noexcept { return count_; }
  void clear() noexcept { count_ = 0; }
  void add(const GridSquare& at, const Sheets& sheets, std::size_t lane) noexcept {
    sheets_[count_ / kLanes].take(count_ % kLanes, sheets, lane);
    clearances_[count_ / kLanes].clear[count_ % kLanes] = Clearances::kUnknown;
    squares_[count_++] = at;
  }
  /// Comes after the last.
  void close() noexcept {
    for (std::size_t k = count_; k % kLanes != 0; ++k) sheets_[k / kLanes].set_never_near(k % kLanes);
  }
  /// Of a full list, keeps the half that is nearest to the place, and returns up to where there is nothing else; not
  /// closed afterwards.
  float keep_nearer_half() noexcept {
    std::array<float, kMost> least{};
    for (std::size_t k = 0; k < kMost; k += kLanes) {
      Four four{};
      static_cast<void>(sheets_[k / kLanes].may_be_near({}, std::numeric_limits<float>::infinity(), four));
      for (std::size_t lane = 0; lane < kLanes; ++lane) least[k + lane] = four[lane];
    }
    std::array<float, kMost> sorted = least;
    std::ranges::nth_element(sorted, sorted.begin() + kMost / 2);
    const float reach = sorted[kMost / 2];
    auto even = kMost / 2 - static_cast<std::size_t>(std::ranges::count_if(least, [&](float l) { return l < reach; }));
    count_ = 0;
    for (std::size_t k = 0; k < kMost; ++k)
      if (least[k] < reach || (least[k] == reach && even > 0 && even-- > 0))
        add(squares_[k], sheets_[k / kLanes], k % kLanes);
    return reach;
  }
  /// Calls visit(number, least) for those that may be nearer than `reach`, which may come down; `least`: their
  /// triangles are no nearer.
  template <typename Visit>
  void each_near(Vec3f place, const float& reach, Visit&& visit) const noexcept {
    for (std::size_t k = 0; k < count_; k += kLanes) {
      const Sheets& sheets = sheets_[k / kLanes];
      Four least;
      unsigned near = sheets.may_be_near(place, reach, least);
      if (near == 0) continue;
      least = greatest(least, clearances_[k / kLanes].least_from(place, sheets.far_from(place), sheets.wide()));
      for (near &= bits_of(least < reach); near != 0; near &= near - 1) {
        const auto lane = static_cast<std::size_t>(std::countr_zero(near));
        visit(k + lane, least[lane]);
      }
    }
  }
  [[nodiscard]] const GridSquare& operator[](std::size_t number) const noexcept { return squares_[number]; }
  /// The triangles of a square are no nearer to a place than `clear`.
  void keep(std::size_t number, Vec3f place, float clear) noexcept {
    const std::size_t lane = number % kLanes;
    clearances_[number / kLanes].keep(lane, place, clear, sheets_[number / kLanes].far_from(place)[lane]);
  }

 private:
  static constexpr std::size_t kLanes = 4;
  std::size_t count_ = 0;
  std::array<Sheets, kMost / kLanes> sheets_;
  std::array<Clearances, kMost / kLanes> clearances_;
  std::array<GridSquare, kMost> squares_;
};

/// The squares that a larger one has some levels below.
class Block {
 public:
  /// See Patch::make().
  void make(MicroTriangles& surface, const GridSquare& square, Vec3d origin, double scale, double flat) noexcept {
    origin_ = origin;
    parts_.clear();
    surface.enter(square.slab);
    NearSlab(surface, square.slab, origin, flat)
        .parts(square, scale, [&](const auto& at, const auto& sheets, std::size_t k) { parts_.add(at, sheets, k); });
    parts_.close();
  }
  using Parts = SquareList<NearSlab::kMostParts>;
  [[nodiscard]] Parts& parts() noexcept { return parts_; }
  /// Returns what its parts are relative to.
  [[nodiscard]] Vec3d origin() const noexcept { return origin_; }

 private:
  Vec3d origin_;
  Parts parts_;
};

/// The triangles of a square.
class Patch {
 public:
  static constexpr int kBounded = 24;  ///< so many samples' time it takes to bound its triangles
  /// `origin`: a place near it; `scale`: 1 over the distance that is asked about.
  void make(MicroTriangles& surface, const GridSquare& square, Vec3d origin, double scale, double flat) noexcept {
    surface.enter(square.slab);
    samples_ = NearSlab(surface, square.slab, origin, flat).samples(square);
    square_ = square;
    origin_ = origin;
    scale_ = scale;
    bounded_ = false;
    longest2_ = longest2();
  }
  /// Returns whether its triangles are bounded yet.
  [[nodiscard]] bool bounded() const noexcept { return bounded_; }
  /// As visit_near(), for these triangles, none of which is nearer than what it returns, in units of the scale.
  template <typename Visit>
  float visit_near(MicroTriangles& surface, Vec3d point, double& reach2, Visit&& visit) noexcept {
    const Vec3d from = point - origin_;
    if (!bounded_) {
      const double clear2 = clear2_from(from);
      if (clear2 >= reach2) return static_cast<float>(std::sqrt(clear2) * scale_);
      bound_all(surface);
    }
    const Vec3f place = to_float(from * scale_);
    const double scale2 = scale_ * scale_;
    auto most2 = static_cast<float>(reach2 * scale2);
    const Four far = Four{} + std::numeric_limits<float>::infinity(), quarters = quarters_.least_from(place);
    const FourMask later = quarters >= static_cast<float>(std::sqrt(reach2) * scale_);
    const Four least_later = later ? quarters : far;
    Four clear2 = least_later * least_later;
    double found2 = std::numeric_limits<double>::infinity();
    for (unsigned near = ~bits_of(later) & 15U; near != 0; near &= near - 1) {
      const auto quarter = static_cast<std::size_t>(std::countr_zero(near));
      for (std::size_t across = 0; across < 2; ++across) {
        const Four discs2 = discs_[2 * quarter + across].least2_from(place);
        const FourMask candidates = discs2 < most2;
        clear2 = least(clear2, candidates ? far : discs2);
        for (unsigned bits = bits_of(candidates); bits != 0; bits &= bits - 1) {
          const auto lane = static_cast<std::size_t>(std::countr_zero(bits));
          const auto of = Samples::of(first_of(quarter) + cell_of(lane), across);
          const NearTriangle t(
              square_.slab, {samples_.corners[of[0]], samples_.corners[of[1]], samples_.corners[of[2]]},
              {samples_.place(of[0]) - from, samples_.place(of[1]) - from, samples_.place(of[2]) - from});
          surface.add_placed(1);
          found2 = std::min(found2, t.distance2);
          if (!(t.distance2 < reach2)) continue;
          visit(t);
          most2 = static_cast<float>(reach2 * scale2);
        }
      }
    }
    const float rest2 = std::min({clear2[0], clear2[1], clear2[2], clear2[3]});
    return std::sqrt(std::min(rest2, static_cast<float>(found2 * scale2)));
  }

 private:
  using Samples = NearSlab::Samples;
  static constexpr std::size_t kLanes = 4;
  static constexpr std::size_t kCells = SampleBounds::kSide * Samples::kRow;  // of each row, the last is none
  // Squared area, up to which a triangle's plane is not known: below it floats lose digits.
  static constexpr float kSliver = std::numeric_limits<float>::min();
  // Squared radius, and distance from the origin, up to which floats are fine enough: 50 times their rounding, some
  // four times over, is what the bounds leave for it.
  static constexpr float kFar2 = 2500;
  static_assert(SampleBounds::kSide == kLanes);

  void bound_all(MicroTriangles& surface) noexcept {
    surface.add_placed(kBounded);
    bound(0);
    bound(1);
    bound_quarters();
    bounded_ = true;
  }
  /// A place in a triangle is no nearer than the nearest corner's square less a third of the longest edge's.
  [[nodiscard]] double clear2_from(Vec3d from) const noexcept { return nearest2(from) - longest2_ / 3; }
  using Distances = std::array<double, Samples::kPlaces>;
  /// Of the samples to a place relative to the origin; number by number, as in bound().
  [[nodiscard]] double nearest2(Vec3d from) const noexcept {
    Distances distance2;
    for (std::size_t k = 0; k < Samples::kPlaces; ++k) {
      const double x = samples_.x[k] - from.x, y = samples_.y[k] - from.y, z = samples_.z[k] - from.z;
      distance2[k] = x * x + y * y + z * z;
    }
    return *std::ranges::min_element(distance2);
  }
  /// No edge of a triangle is longer than the root of this.
  [[nodiscard]] double longest2() const noexcept {
    if (square_.flat) return std::numeric_limits<double>::infinity();
    constexpr std::size_t kRow = Samples::kRow;
    std::array<double, kCells> edge2{};
    const auto take = [&](std::size_t a, std::size_t b) noexcept {
      for (std::size_t k = 0; k + 1 < kCells; ++k) {
        const double x = samples_.x[k + a] - samples_.x[k + b], y = samples_.y[k + a] - samples_.y[k + b],
                     z = samples_.z[k + a] - samples_.z[k + b], length2 = x * x + y * y + z * z;
        edge2[k] = length2 > edge2[k] ? length2 : edge2[k];
      }
    };
    take(0, 1);
    take(0, kRow);
    take(1, kRow);
    take(1, kRow + 1);
    take(kRow, kRow + 1);
    double longest2 = 0;
    for (std::size_t k = 0; k + 1 < kCells; ++k)
      if (k % kRow + 1 < kRow) longest2 = std::max(longest2, edge2[k]);
    return longest2;
  }
  /// Finds the discs; `across`: of triangles across from those that the samples number.
  void bound(std::size_t across) noexcept {
    // Number by number, in doubles: so it becomes vectors, and the planes of thin triangles are right.
    struct Cells {
      std::array<float, kCells> x, y, z;
      [[nodiscard]] FourVectors from(std::size_t k) const noexcept { return {four(x, k), four(y, k), four(z, k)}; }
      /// Of the cells of a quarter, from its first one.
      static Four four(const std::array<float, kCells>& of, std::size_t k) noexcept {
        return Four{of[k + cell_of(0)], of[k + cell_of(1)], of[k + cell_of(2)], of[k + cell_of(3)]};
      }
    };
    Cells middles{}, areas{};
    std::array<float, kCells> radii2{};
    const auto [first, second, third] = Samples::of(0, across);
    for (std::size_t k = 0; k + 1 < kCells; ++k) {
      const Vec3d p = samples_.place(k + first) * scale_, q = samples_.place(k + second) * scale_ - p,
                  r = samples_.place(k + third) * scale_ - p;
      const Vec3d middle = (q + r) * (1.0 / 3), area = cross(q, r);
      const double p2 = dot(middle, middle), q2 = dot(q - middle, q - middle), r2 = dot(r - middle, r - middle);
      const double more = p2 > q2 ? p2 : q2;
      middles.x[k] = static_cast<float>(p.x + middle.x);
      middles.y[k] = static_cast<float>(p.y + middle.y);
      middles.z[k] = static_cast<float>(p.z + middle.z);
      areas.x[k] = static_cast<float>(area.x);
      areas.y[k] = static_cast<float>(area.y);
      areas.z[k] = static_cast<float>(area.z);
      radii2[k] = static_cast<float>(more > r2 ? more : r2);
    }
    for (std::size_t quarter = 0; quarter < kLanes; ++quarter) {
      Discs& discs = discs_[2 * quarter + across];
      const std::size_t k = first_of(quarter);
      const FourVectors area = areas.from(k);
      const Four area2 = dot(area, area), none = {};
      discs.middle = middles.from(k);
      discs.normal = area * (area2 > kSliver ? 1 / root(area2) : none);
      discs.radius = root(Cells::four(radii2, k));
      const std::uint32_t cells = samples_.triangles[across] >> k;
      const unsigned there = (cells & 3U) | (cells >> Samples::kRow & 3U) << 2U;
      // Floats are too coarse for a large one, and for one at the far end of a cliff.
      const FourMask coarse = (discs.radius * discs.radius > kFar2) | (dot(discs.middle, discs.middle) > kFar2);
      for (unsigned large = bits_of(coarse) & there; large != 0; large &= large - 1)
        discs.set_always_near(static_cast<std::size_t>(std::countr_zero(large)));
      for (unsigned none_there = ~there & 15U; none_there != 0; none_there &= none_there - 1)
        discs.set_never_near(static_cast<std::size_t>(std::countr_zero(none_there)));
    }
  }

  /// Finds what bounds the triangles of each quarter.
  void bound_quarters() noexcept {
    if (square_.flat) {
      for (std::size_t quarter = 0; quarter < kLanes; ++quarter)
        if (quarter == 0)
          quarters_.discs.set_always_near(quarter);
        else
          quarters_.discs.set_never_near(quarter);
      return;
    }
    const auto samples = [&](std::size_t k) noexcept {
      FourVectors four;
      for (std::size_t quarter = 0; quarter < kLanes; ++quarter) {
        const Vec3f place = to_float(samples_.place(first_of(quarter) + k) * scale_);
        four.x[quarter] = place.x, four.y[quarter] = place.y, four.z[quarter] = place.z;
      }
      return four;
    };
    constexpr std::size_t kRow = Samples::kRow;
    const FourVectors middle = samples(kRow + 1);
    const FourVectors area = cross(samples(2 * kRow + 2) - samples(0), samples(2 * kRow) - samples(2));
    const Four area2 = dot(area, area), none = {};
    const FourVectors normal = area * (area2 > kSliver ? 1 / root(area2) : none);
    Four high = {}, low = {}, far2 = {};
    for (const std::size_t k : {0UZ, 1UZ, 2UZ, kRow, kRow + 2, 2 * kRow, 2 * kRow + 1, 2 * kRow + 2}) {
      const FourVectors from = samples(k) - middle;
      const Four height = dot(from, normal);
      high = greatest(high, height);
      low = least(low, height);
      far2 = greatest(far2, dot(from, from));
    }
    quarters_.off = (high - low) * 0.5F + Sheets::kRounding;
    quarters_.discs = {middle + normal * ((high + low) * 0.5F), normal, root(far2)};
    const FourMask coarse = (far2 > kFar2) | (dot(middle, middle) > kFar2);
    for (unsigned large = bits_of(coarse); large != 0; large &= large - 1)
      quarters_.discs.set_always_near(static_cast<std::size_t>(std::countr_zero(large)));
  }
  /// Returns the number of a quarter's first cell, and of its others from there.
  [[nodiscard]] static constexpr std::size_t first_of(std::size_t quarter) noexcept {
    return (quarter / 2 * Samples::kRow + quarter % 2) * 2;
  }
  [[nodiscard]] static constexpr std::size_t cell_of(std::size_t lane) noexcept {
    return lane / 2 * Samples::kRow + lane % 2;
  }

  GridSquare square_{};
  double scale_ = 0, longest2_ = 0;
  bool bounded_ = false;  ///< the rest is known
  Vec3d origin_;
  Samples samples_;                      ///< relative to the origin
  Plates quarters_;                      ///< of two by two cells each
  std::array<Discs, 2 * kLanes> discs_;  ///< of a quarter's triangles, then of those across from them
};

/// Holds what was queried of late, of one snapshot, for one distance and one unevenness: of each of so many sets of
/// squares the last kWays.
template <typename Item, unsigned kSets>
class Recent {
 public:
  void forget() noexcept { keys_ = {}; }
  /// Samples that were placed so far to make what was not known, modulo 2^32.
  [[nodiscard]] std::uint32_t work() const noexcept { return work_; }
  /// See Patch::make().
  Item& of(MicroTriangles& surface, const GridSquare& square, Vec3d origin, double scale, double flat) noexcept {
    if (scale != scale_ || flat != flat_) forget();
    scale_ = scale;
    flat_ = flat;
    const std::uint64_t key = (std::uint64_t{square.slab} + 1) << 20U | static_cast<std::uint64_t>(square.flat) << 19U |
                              static_cast<std::uint64_t>(square.level << 16 | square.j << 8 | square.i);
    const std::size_t set = (key * 0x9E3779B97F4A7C15U >> 32U) % kSets;
    auto& keys = keys_[set];
    auto& used = used_[set];
    std::size_t way = 0;
    while (way < kWays && keys[way] != key) ++way;
    if (way == kWays) {
      way = static_cast<std::size_t>(std::ranges::min_element(used) - used.begin());
      const int placed = surface.placed();
      surface.add_placed(kFetched);
      items_[set * kWays + way].make(surface, square, origin, scale, flat);
      work_ += static_cast<std::uint32_t>(surface.placed() - placed);
      keys[way] = key;
    }
    used[way] = ++asked_;
    return items_[set * kWays + way];
  }

 private:
  static constexpr std::size_t kWays = 8;
  static constexpr int kFetched = 12;  // samples' time in which what is made waits for memory
  template <typename Number>
  using OfSets = std::array<std::array<Number, kWays>, kSets>;
  double scale_ = 0, flat_ = 0;
  std::uint64_t asked_ = 0;
  std::uint32_t work_ = 0;
  OfSets<std::uint64_t> keys_{};  ///< of squares, 0: none yet
  OfSets<std::uint64_t> used_{};  ///< when each was queried last
  std::array<Item, kWays * kSets> items_;
};

/// Cost: a few nanoseconds for what was queried of late, some three hundred for another, and a thousand where its
/// samples are not in the cache.
struct Patches {
  Recent<Patch, 32> patches;
  /// The parts of a block may be blocks too; those never take its place.
  [[nodiscard]] Block& block(MicroTriangles& surface, const GridSquare& square, Vec3d origin, double scale,
                             double flat) noexcept {
    if (square.level <= NearSlab::kParted) return fine_.of(surface, square, origin, scale, flat);
    return coarse_.of(surface, square, origin, scale, flat);
  }
  /// A patch was bounded.
  void count_bounded() noexcept { bounded_work_ += Patch::kBounded; }
  [[nodiscard]] std::uint32_t work() const noexcept {
    return patches.work() + bounded_work_ + fine_.work() + coarse_.work();
  }
  void forget() noexcept {
    patches.forget();
    fine_.forget();
    coarse_.forget();
  }

 private:
  Recent<Block, 64> fine_;
  Recent<Block, 16> coarse_;
  std::uint32_t bounded_work_ = 0;
};

}  // namespace relief::detail
