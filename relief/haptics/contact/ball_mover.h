// A ball on its way among the micro-triangles: what is near it, and the steps that it takes.
#pragma once

#include <relief/haptics/contact/half_spaces.h>
#include <relief/haptics/contact/neighbourhood.h>
#include <relief/haptics/contact/principle.h>
#include <relief/haptics/contact/walk.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <utility>

namespace relief::detail::ball {

// Micro-triangles that are minded at a time. With half as many, a cone that rises does not push the ball out at once
// (AConeThatRisesDeepIntoItPushesItOutAtOnce); with twice as many, looking takes too long (GoesWithMaterialThatRises-).
constexpr int kMost = 10;
// Of the radius: so far beyond it they are minded before the ball comes there, so that a step does not first run into
// what lies beside it (MindsWhatIsAThousandthOfTheRadiusBeyondIt).
constexpr double kSkin = 1e-3;
// Of the radius: so far the ball goes at a time where it may meet something. Longer steps are tried in vain, shorter
// ones are too many (GoesWithMaterialThatRisesUnderItHoweverLongItLooks).
constexpr double kStride = 0.5;
// Of the radius: a step that is none (LessThanAMillionthOfTheRadiusIsNoStep).
constexpr double kRest = 1e-6;
// Of the longest step of a tick: what is left to the next, which is felt as roughness on fine texture. A tenth of it
// takes 10 to 25 % more time (LeavesATwentiethOfAStepToTheNextTick).
constexpr double kEnough = 0.05;
constexpr double kSlack = 1e-9;  // of the radius, or of a triangle: rounding
// Of the radius: unevenness that the ball does not feel (UnevennessOfThreeHundredThousandthsIsNotFelt).
constexpr double kFlat = 3e-5;
// What a tick may take, in the time of a sample that is placed, about 25 ns; after which it looks no further. Half of
// it is too little for a ball on dense ground (RestsOnTheRimOfAHoleAndOfASheet), twice as much too long
// (NoTickTakesLong).
constexpr int kWork = 480;
constexpr int kTriangleWork = 2;  // work units of a near triangle
constexpr int kStepWork = 8;      // work units of a step beside its query
// Ticks in which the ball may be late, or left where it is, for want of time to see. With more, it does not land in
// time on a rim (RestsOnTheRimOfAHoleAndOfASheet).
constexpr int kMostWaits = 2;
// Each tick that follows may take twice as much, so many times. With fewer, the ball waits for longer than 12 ticks
// (WhereALookTakesTooLongItWaitsForAFewTicksOnly).
constexpr int kMostDoubled = 3;
constexpr int kMostWork = kWork << kMostDoubled;  // and where the model has changed

/// The micro-triangles within a ball, or as many as there is room for, the nearest.
struct Around {
  std::array<NearTriangle, kMost> triangles;
  std::array<double, kMost> distance2;  ///< of each of them
  int count = 0, farthest = 0;
  double nearest = kAnywhere;  ///< of all; where there is none, they are no nearer than this

  [[nodiscard]] std::span<const NearTriangle> all() const noexcept {
    return std::span(triangles).first(static_cast<std::size_t>(count));
  }
  /// `limit2`: what was looked for; comes down to the farthest where there is no more room.
  void add(const NearTriangle& t, double& limit2) noexcept {
    const auto place = static_cast<std::size_t>(count < kMost ? count++ : farthest);
    triangles[place] = t;
    distance2[place] = t.distance2;
    if (count < kMost) return;
    const auto most = std::ranges::max_element(distance2);
    farthest = static_cast<int>(most - distance2.begin());
    limit2 = *most;
  }
};

inline Vec3d area(const NearTriangle& t) noexcept {
  return cross(t.relative[1] - t.relative[0], t.relative[2] - t.relative[0]);
}
/// Returns whether the point that was queried lies on the triangle's inner side.
inline bool shows_its_back(const NearTriangle& t) noexcept { return dot(area(t), t.relative[0]) > 0; }

/// Returns what place a triangle leaves to the ball's centre, relative to the place that the triangle is relative to.
/// One that is within the ball asks for a share of what it is too near.
inline HalfSpace beyond(const NearTriangle& t, double radius, double share) noexcept {
  const double distance = std::sqrt(t.distance2), room = radius - distance;
  const Vec3d normal = distance > kSlack * radius ? t.nearest / -distance : normalized(area(t));
  return {normal, room > 0 ? room * share : room};
}

/// Returns the triangle relative to another place, `from` further on.
inline NearTriangle seen_from(NearTriangle t, Vec3d from) noexcept {
  for (Vec3d& p : t.relative) p -= from;
  return {t.slab, t.corners, t.relative};
}

/// Returns how far a ball is driven into the surface.
inline double overlap_in(const Around& around, double radius) noexcept {
  double most = 0;
  for (const NearTriangle& t : around.all())
    if (!shows_its_back(t)) most = std::max(most, radius - std::sqrt(t.distance2));
  return most;
}

/// Returns whether what is nearest, within the radius, shows its back: a sheet that the ball came to from behind. At a
/// ridge the two sides are equally near, and one of them shows its face.
inline bool is_behind(const Around& around, double radius) noexcept {
  double face2 = kAnywhere, back2 = radius * radius * (1 - kSlack);
  for (const NearTriangle& t : around.all()) {
    double& least = shows_its_back(t) ? back2 : face2;
    least = std::min(least, t.distance2);
  }
  return back2 < radius * radius * (1 - kSlack) && back2 * (1 + kSlack) < face2;
}

/// Of the triangles that are no farther than `touching`, the one that pushes most that way; none where none does.
inline const NearTriangle* that_pushes_most(const Around& around, Vec3d way, double touching) noexcept {
  double most = 0;
  const NearTriangle* found = nullptr;
  for (const NearTriangle& t : around.all()) {
    const double distance = std::sqrt(t.distance2), pushes = -dot(t.nearest, way);
    if (distance > touching || !(pushes > most * distance) || shows_its_back(t)) continue;
    most = pushes / distance;
    found = &t;
  }
  return found;
}

/// The triangles that stopped a step of late: they will stop the next, and need not be found again by trying.
class Stops {
 public:
  void forget() noexcept { count_ = 0; }
  /// `from`: the place that the triangle is relative to.
  void add(NearTriangle t, Vec3d from) noexcept {
    const auto is_it = [&](const NearTriangle& known) noexcept {
      return known.slab == t.slab && known.corners == t.corners;
    };
    if (std::ranges::any_of(all(), is_it)) return;
    for (Vec3d& p : t.relative) p += from;
    triangles_[next_] = t;
    next_ = (next_ + 1) % kMost;
    count_ = std::max(count_, next_ == 0 ? kMost : next_);
  }
  /// Relative to the origin.
  [[nodiscard]] std::span<const NearTriangle> all() const noexcept { return std::span(triangles_).first(count_); }

 private:
  static constexpr std::size_t kMost = 3;  // planes that stop a ball
  std::array<NearTriangle, kMost> triangles_;
  std::size_t count_ = 0, next_ = 0;
};

/// Holds what barred the ball from leaving a place, where it still is: it need not be found again in the next tick.
struct Walls {
  double stride = 0;  ///< how far it was last to go from there at a time

  void forget() noexcept { count_ = 0; }
  [[nodiscard]] bool at(Vec3d place) const noexcept { return count_ > 0 && place == place_; }
  [[nodiscard]] std::span<const HalfSpace> all() const noexcept { return std::span(spaces_).first(count_); }
  void keep(Vec3d place, std::span<const HalfSpace> more, double next_stride) noexcept {
    if (!at(place)) count_ = 0;
    place_ = place;
    stride = next_stride;
    more = more.first(std::min(more.size(), spaces_.size() - count_));
    std::ranges::copy(more, spaces_.begin() + static_cast<std::ptrdiff_t>(count_));
    count_ += more.size();
  }

 private:
  Vec3d place_;
  std::array<HalfSpace, kMost> spaces_;  ///< relative to the place
  std::size_t count_ = 0;
};

/// A place that a ball has tried from another, and there was no time to see whether it may go there.
struct PutOff {
  Vec3d from, to;  ///< equal: there is none

  /// Returns whether it still leads from that place nearer to a goal, and no farther than `reach`.
  [[nodiscard]] bool leads(Vec3d place, Vec3d goal, double reach) const noexcept {
    return from == place && length(to - from) <= reach && length(goal - to) < length(goal - from);
  }
};

/// Holds what a ball keeps, and what it works with in a tick.
struct Room {
  static constexpr std::size_t kSpaces = std::size_t{3} * kMost;  // what is here, the walls, and what bars a try
  Neighbourhood list;                                             ///< around where it looked last
  Patches patches;
  Stops stops;
  Walls walls;
  PutOff put_off;
  int look_work = 0;         ///< what the last look took at what is known
  int waits = 0;             ///< for so many ticks its way to the cursor waited, and the list went on in none of them
  bool waiting = false;      ///< it was left where it was in the last
  SlabId nearest = kNoSlab;  ///< where to look first in free space
  std::array<Around, 4> around;
  std::size_t here = 0;  ///< which of them is around where the ball came to in the last tick
  bool known = false;    ///< that is of the same model
  std::array<HalfSpace, kSpaces> spaces;

  void forget() noexcept {
    list.forget();
    patches.forget();
    stops.forget();
    walls.forget();
    put_off = {};
    look_work = waits = 0;
    waiting = false;
    nearest = kNoSlab;
    known = false;
  }
};

/// The ball on its way.
class Mover {
 public:
  /// `work`: what it may take to look around at first; where that is too little, it stays where it is.
  Mover(MicroTriangles& surface, Room& room, Vec3d centre, double radius, double far, int work) noexcept
      : surface_(surface),
        room_(room),
        spaces_(room.spaces),
        start_(centre),
        centre_(centre),
        radius_(radius),
        here_(&room.around[room.here]),
        there_(&room.around[room.here ^ 1U]),
        from_start_(&room.around[room.here ^ 2U]),
        from_within_(&room.around[room.here ^ 3U]) {
    if (!room.known)
      cut_ = blind_ = !look_at(centre_, radius + far, *here_, work);
    else if (far > 0)
      look_far(radius + far);
  }
  /// The next tick starts here and need not look again.
  void stay() noexcept {
    room_.here = static_cast<std::size_t>(here_ - room_.around.data());
    room_.known = !blind_;
    room_.waiting = cut_ && centre_ == start_;
  }
  /// Counts for how many ticks the way to the cursor has waited.
  void count_wait() noexcept {
    if (!room_.waiting)
      room_.waits = 0;
    else if (!room_.list.goes_on())
      ++room_.waits;
  }

  /// Returns whether there was no time to see what is around it.
  [[nodiscard]] bool blind() const noexcept { return blind_; }
  [[nodiscard]] Vec3d centre() const noexcept { return centre_; }
  [[nodiscard]] Vec3d within() const noexcept { return within_; }
  [[nodiscard]] const Around& around() const noexcept { return *here_; }
  [[nodiscard]] int searches() const noexcept { return searches_; }

  void put_back_to_start() noexcept {
    if (centre_ != start_) std::swap(here_, from_start_);
    centre_ = start_;
  }
  /// To the place within reach that the last advance found.
  void put_back_within() noexcept {
    if (within_ == start_) return put_back_to_start();
    if (centre_ != within_) std::swap(here_, from_within_);
    centre_ = within_;
  }

  struct Way {
    bool settled = false;  ///< it came to rest
    bool straight = true;  ///< it never turned aside
    bool cut = false;      ///< there was no time to see
    double slid = 0;       ///< how far it went along the surface
  };
  /// Where an advance ends. Reach: at the end of its reach. Rest: at rest, the last place within reach being kept.
  /// Touch: at something in the way, which it does not go along.
  enum class Until { Reach, Rest, Touch };
  /// Towards the goal, in at most so many searches, by `reach` at most: straight where nothing is in the way, else
  /// along what is. `push`: what is within the ball is pushed out first. `work`: what the tick may take by then as far
  /// as `reach`, and `ahead` beyond it.
  Way advance(Vec3d goal, double reach, Until until, bool push, int searches, int work, int ahead) noexcept {
    const int before = searches_;
    searches += before;
    Way way;
    bool arrived = false;
    within_ = centre_;
    if (blind_) {
      way.cut = true;
      return way;
    }
    share_ = push ? 1 : 0;
    mind(share_);
    double stride = room_.walls.at(centre_) ? room_.walls.stride : kStride * radius_, rest = kRest * radius_;
    bool within = true;
    while (searches_ < searches) {
      const bool pushed = share_ > 0;
      const Vec3d target = pushed ? Vec3d{} : goal - centre_;
      auto step = until == Until::Touch ? open_part(target) : nearest_in(spaces(), target, kSlack * radius_);
      const double wanted = step ? length(*step) : 0;
      if (pushed && !(wanted > kRest * radius_)) {  // it is out, or squeezed from two sides
        share_ = 0;
        mind(0);
        continue;
      }
      if (!step) break;
      if (!stops_minded_ && wanted > kStride * radius_) {
        mind_stops();
        continue;
      }
      keep_stops(*step);
      const bool whole = *step == target;
      const bool slides = !whole && !pushed && until != Until::Touch, goes = !pushed;
      way.straight = way.straight && whole;
      way.settled = !pushed && !(wanted > rest) && !(whole && wanted > 0);
      if (way.settled) break;
      within = within && !(goes && reach <= 0);
      if (!within && until != Until::Rest) break;
      double longest = std::max(stride, here_->nearest - radius_);
      const bool short_of = goes && within && reach < std::min(longest, wanted);  // what comes next may be as long
      if (short_of) longest = reach;
      if (wanted > longest) *step *= longest / wanted;
      if (pushed) share_ = std::min(1.0, longest / wanted);
      Vec3d next = whole && wanted <= longest ? goal : centre_ + *step;
      double far = std::min(wanted, longest);
      if (const PutOff last = std::exchange(room_.put_off, {}); goes && within && last.leads(centre_, goal, reach)) {
        next = last.to;
        *step = next - centre_;
        far = length(*step);
      }
      // What takes too long waits for the next tick. One query is always made, so that each tick knows more than the
      // last.
      const int in_time = !arrived || within ? work : ahead;
      const int most = arrived || room_.waits < kMostWaits ? in_time : std::max(in_time, patience());
      way.cut = searches_ > before && surface_.placed() + room_.look_work > most;
      if (way.cut) break;
      surface_.add_placed(kStepWork + count_);
      tried_ = *step;
      way.cut = !look_at(next, count_ == 0 ? radius_ + length(goal - next) : 0, *there_, most);
      const bool barred = bars();
      if (barred) {
        stride = std::max(0.5 * stride, kSkin * radius_);
        if (share_ == 0 && centre_ == start_) room_.walls.keep(centre_, found_bars(), stride);
      }
      if (way.cut && !barred && goes) room_.put_off = {centre_, next};
      if (way.cut) break;
      if (barred) continue;
      arrive(next);
      arrived = true;
      if (within) within_ = next;
      if (slides) way.slid += far;
      if (goes) reach -= far;
      if (!short_of && !pushed) rest = std::max(rest, kEnough * wanted);
      way.settled = next == goal;
      if (way.settled) break;
      share_ = pushed ? 1 : 0;
      stride = std::min(2 * stride, kStride * radius_);
      mind(share_);
    }
    cut_ = way.cut;
    return way;
  }

 private:
  /// Takes what was found there for what is here; what was found at the start and within reach is kept.
  void arrive(Vec3d centre) noexcept {
    std::swap(here_, there_);
    if (centre_ == start_)
      std::swap(there_, from_start_);
    else if (centre_ == within_)
      std::swap(there_, from_within_);
    centre_ = centre;
  }
  /// Returns the part of a straight segment that the half-spaces leave open.
  [[nodiscard]] std::optional<Vec3d> open_part(Vec3d way) const noexcept {
    double share = 1;
    for (const HalfSpace& s : spaces())
      if (const double speed = dot(s.normal, way); speed < 0) share = std::min(share, s.room({}) / -speed);
    return share < 1 ? way * std::max(0.0, share) : way;
  }
  [[nodiscard]] std::span<HalfSpace> spaces() const noexcept { return spaces_.first(static_cast<std::size_t>(count_)); }
  /// Returns those that the last try has found.
  [[nodiscard]] std::span<const HalfSpace> found_bars() const noexcept {
    return spaces().last(static_cast<std::size_t>(barring_));
  }
  /// Finds what is nearer to a place than the radius and the skin. Where there is nothing, finds up to which distance
  /// there is none, at most `far`. It ends once the ball is barred there, or returns false where the tick has taken
  /// `most`; it continues in the next call.
  bool look_at(Vec3d at, double far, Around& found, int most) noexcept {
    ++searches_;
    const double near = this->near();
    found.count = 0;
    if (!room_.list.covers(at, near)) {
      if (far > near) {
        found.nearest = clear_up_to(at, far);
        if (found.nearest > near) return true;
      }
      if (!learn(at, most)) return false;
    }
    const int placed = surface_.placed();
    const std::uint32_t made = room_.patches.work();
    double reach2 = near * near;
    int barring = 0;
    const auto add = [&](const NearTriangle& t) noexcept {
      surface_.add_placed(kTriangleWork);
      found.add(t, reach2);
      if (bar(t) && ++barring == kMost) reach2 = 0;
    };
    const bool finished = room_.list.visit_near(surface_, room_.patches, at, reach2, most, add);
    room_.look_work = surface_.placed() - placed - static_cast<int>(room_.patches.work() - made);
    found.nearest = near;
    if (found.count > 0) {
      const auto all = std::span(found.distance2).first(static_cast<std::size_t>(found.count));
      found.nearest = std::sqrt(*std::ranges::min_element(all));
    } else if (far > near) {
      found.nearest = clear_in_list(at, far);
    }
    return finished;
  }
  /// Up to which distance there is nothing around the ball, at most `far`, as far as that is found without the list.
  void look_far(double far) noexcept {
    ++searches_;
    if (here_->count > 0 || far <= near()) return;
    const bool covered = room_.list.covers(centre_, near());
    here_->nearest = covered ? clear_in_list(centre_, far) : std::max(near(), clear_up_to(centre_, far));
  }
  /// Returns how far there is nothing around a place that the list covers, at most `far`.
  [[nodiscard]] double clear_in_list(Vec3d at, double far) const noexcept {
    return std::max(near(), room_.list.clear_around(at, std::min(far, room_.list.reach_at(at))));
  }
  /// Returns the same of a place in free space.
  [[nodiscard]] double clear_up_to(Vec3d at, double far) noexcept {
    return clear_around(surface_, at, near(), far, room_.nearest, 0);
  }
  /// Returns how far a look goes.
  [[nodiscard]] double near() const noexcept { return radius_ * (1 + kSkin); }
  /// Returns what the first step of a way that has waited may take.
  [[nodiscard]] int patience() const noexcept { return kWork << std::min(room_.waits, kMostDoubled); }
  /// Makes the list anew around a place, or returns that there is no time to in this tick.
  [[nodiscard]] bool learn(Vec3d at, int most) noexcept {
    return room_.list.gather(surface_, at, near(), near() + radius_, kFlat * radius_, most);
  }
  void mind(double share) noexcept {
    count_ = barring_ = 0;
    behind_ = is_behind(*here_, radius_);
    for (const NearTriangle& t : here_->all())
      if (!shows_its_back(t)) spaces_[static_cast<std::size_t>(count_++)] = beyond(t, radius_, share);
    if (share == 0 && room_.walls.at(centre_))
      for (const HalfSpace& wall : room_.walls.all()) spaces_[static_cast<std::size_t>(count_++)] = wall;
    stops_minded_ = false;
  }
  /// And those that stopped a step of late, which are not near yet.
  void mind_stops() noexcept {
    stops_minded_ = true;
    const double near2 = near() * near(), far2 = (1 + kStride) * (1 + kStride) * radius_ * radius_;
    for (const NearTriangle& known : room_.stops.all()) {
      const Vec3d to = known.relative[0] - centre_;
      if (dot(to, to) > far2 || count_ == static_cast<int>(Room::kSpaces)) continue;
      const NearTriangle t = seen_from(known, centre_);
      if (t.distance2 >= near2 && !shows_its_back(t))
        spaces_[static_cast<std::size_t>(count_++)] = beyond(t, radius_, 0);
    }
  }
  /// Of the triangles that barred the last try, keeps those at which the next step ends.
  void keep_stops(Vec3d step) noexcept {
    for (; barring_ > 0; --barring_) {
      const auto& [space, triangle] = bars_[static_cast<std::size_t>(barring_ - 1)];
      if (space.room(step) < kRest * radius_) room_.stops.add(*triangle, centre_ + tried_);
    }
  }
  /// Returns whether triangles around the next place bar the segment to it; they count from then on. A triangle that
  /// shows its back at both ends is a sheet, or a nearer one stands for it. A triangle that shows its back only here is
  /// beyond a ridge, unless the ball came to a sheet from behind.
  [[nodiscard]] bool bars() noexcept {
    bool barred = false;
    for (const NearTriangle& t : there_->all()) {
      const auto space = bar(t);
      if (!space) continue;
      barred = true;
      if (count_ == static_cast<int>(Room::kSpaces)) break;
      spaces_[static_cast<std::size_t>(count_++)] = *space;
      bars_[static_cast<std::size_t>(barring_++)] = {*space, &t};
    }
    return barred;
  }
  /// Returns what a triangle around the place that is tried leaves, if it bars the way there.
  [[nodiscard]] std::optional<HalfSpace> bar(const NearTriangle& t) const noexcept {
    const double radius2 = radius_ * radius_;
    if (t.distance2 >= radius2) return std::nullopt;
    const NearTriangle here = seen_from(t, -tried_);
    if (shows_its_back(here) && (behind_ || shows_its_back(t) || here.distance2 < radius2 * (1 - kSlack)))
      return std::nullopt;
    const HalfSpace space = beyond(here, radius_, share_);
    if (space.room(tried_) >= -2 * kSlack * radius_) return std::nullopt;
    return share_ > 0 ? beyond(here, radius_, 1) : space;
  }

  MicroTriangles& surface_;
  Room& room_;
  std::span<HalfSpace, Room::kSpaces> spaces_;
  Vec3d start_, centre_, within_;
  double radius_;
  Around *here_, *there_, *from_start_, *from_within_;
  int count_ = 0, searches_ = 0;
  struct Bar {
    HalfSpace space;
    const NearTriangle* triangle;
  };
  std::array<Bar, kMost> bars_;  ///< what barred the last try
  int barring_ = 0;
  bool stops_minded_ = false, cut_ = false, blind_ = false;  ///< blind_: not all around the ball is known
  bool behind_ = false;  ///< here the ball is in a sheet that it came to from behind
  Vec3d tried_;          ///< this step
  double share_ = 0;     ///< of what the ball is in, by which this step pushes it out; 0: it is not being pushed out
};

}  // namespace relief::detail::ball
