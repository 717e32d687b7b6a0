// Says of each tick of a surface contact point whether it was right, from the plain triangles of the model and nothing
// else of the product.
#pragma once

#include <relief/core/tessellate.h>
#include <relief/haptics/contact/ball_proxy.h>
#include <relief/haptics/contact/proxy.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <queue>
#include <string_view>
#include <utility>
#include <vector>

namespace relief::testing {

/// All micro-triangles of a model, in a grid of boxes.
class TriangleSoup {
 public:
  explicit TriangleSoup(const Snapshot& model) : surface_(tessellate(model)) {
    for (const Vec3d p : surface_.positions) bounds_.add(p);
    size_ = diagonal(bounds_);
    around_.resize(surface_.positions.size());
    Vec3d extent = bounds_.extent();
    const double most = std::max({extent.x, extent.y, extent.z});
    const double wanted = std::cbrt(static_cast<double>(surface_.triangles.size()) * 0.5);
    step_ = most / std::clamp(wanted * 3, 4.0, 200.0);
    for (std::size_t k = 0; k < 3; ++k) count_[k] = static_cast<int>(extent[k] / step_) + 1;
    boxes_.resize(static_cast<std::size_t>(count_[0]) * static_cast<std::size_t>(count_[1]) *
                  static_cast<std::size_t>(count_[2]));
    for (std::uint32_t t = 0; t < surface_.triangles.size(); ++t) {
      Box3d box;
      for (const std::uint32_t v : surface_.triangles[t]) {
        box.add(surface_.positions[v]);
        around_[v].push_back(t);
      }
      each_box(box, [&](std::vector<std::uint32_t>& list) { list.push_back(t); });
    }
    mark_.resize(surface_.triangles.size());
  }

  [[nodiscard]] double size() const noexcept { return size_; }
  [[nodiscard]] const Box3d& bounds() const noexcept { return bounds_; }

  /// A crossing of a way with the surface.
  struct Crossing {
    double t = 0;  ///< share of the way
    bool inwards = false;
  };
  /// All crossings of the straight way from a to b, in order.
  [[nodiscard]] std::vector<Crossing> crossings(Vec3d a, Vec3d b) const {
    std::vector<Crossing> found;
    const Vec3d way = b - a;
    const double parts = std::ceil(std::max(1.0, length(way) / step_));
    ++stamp_;
    for (double k = 0; k < parts; ++k) {
      Box3d box;
      box.add(a + way * (k / parts));
      box.add(a + way * ((k + 1) / parts));
      each(box, [&](std::uint32_t t) {
        const auto [p, q, r] = corners(t);
        const double wp = volume(way, q - a, r - a), wq = volume(way, r - a, p - a), wr = volume(way, p - a, q - a);
        const bool in = wp <= 0 && wq <= 0 && wr <= 0, out = wp >= 0 && wq >= 0 && wr >= 0;
        const double sum = wp + wq + wr;
        if (in == out || sum == 0) return;
        const Vec3d x = ((p - a) * wp + (q - a) * wq + (r - a) * wr) / sum;
        const double along = dot(x, way) / dot(way, way);
        if (along >= 0 && along <= 1) found.push_back({along, in});
      });
    }
    std::ranges::sort(found, {}, &Crossing::t);
    return found;
  }

  [[nodiscard]] double distance(Vec3d p, double most) const {
    double best = most;
    ++stamp_;
    each(ball(p, most), [&](std::uint32_t t) { best = std::min(best, distance_to(t, p)); });
    return best;
  }

  /// Whether one can go from p to q over the surface without leaving the ball of the given radius around p; both lie on
  /// the surface to within `hair`.
  [[nodiscard]] bool connected(Vec3d p, Vec3d q, double radius, double hair) const {
    // The triangle nearest to q goes first.
    std::priority_queue<std::pair<double, std::uint32_t>> front;
    const auto reach = [&](std::uint32_t t) {
      if (mark_[t] == stamp_) return;
      mark_[t] = stamp_;
      if (distance_to(t, p) <= radius + hair) front.emplace(-distance_to(t, q), t);
    };
    std::vector<std::uint32_t> begin;
    ++stamp_;
    each(ball(p, hair), [&](std::uint32_t t) {
      if (distance_to(t, p) <= hair) begin.push_back(t);
    });
    ++stamp_;
    for (const std::uint32_t t : begin) reach(t);
    while (!front.empty()) {
      const auto [gap, t] = front.top();
      if (-gap <= hair) return true;
      front.pop();
      for (const std::uint32_t v : surface_.triangles[t])
        for (const std::uint32_t next : around_[v]) reach(next);
    }
    return false;
  }

  /// Whether every place of the straight way from a to b is at least so far from the surface.
  [[nodiscard]] bool keeps_off(Vec3d a, Vec3d b, double distance_kept) const {
    const double way = length(b - a), least = 1e-3 * distance_kept;
    for (double done = 0;; done += least) {
      const double here = distance(a + (b - a) * (way > 0 ? std::min(1.0, done / way) : 0.0), distance_kept + way);
      if (here < distance_kept) return false;
      if (done >= way) return true;
      done += here - distance_kept;  // so far nothing can come nearer
    }
  }

  /// Whether a ball that is clear of the surface at a and at b can go from the one to the other by a way all of whose
  /// places are allowed. Looked for on a lattice of half its radius, whose points a smaller ball must be clear at, so
  /// that each such way is found and none that is found crosses the surface.
  template <typename Allowed>
  [[nodiscard]] bool has_way(Vec3d a, Vec3d b, double radius, Allowed&& allowed) const {
    constexpr std::size_t kMost = 200'000;  // lattice points; that is taken for no way
    const double step = 0.5 * radius;
    using Point = std::array<int, 3>;
    const auto place = [&](const Point& p) { return a + Vec3d{double(p[0]), double(p[1]), double(p[2])} * step; };
    std::map<Point, bool> seen;
    std::priority_queue<std::pair<double, Point>> front;
    front.emplace(0, Point{});
    while (!front.empty() && seen.size() < kMost) {
      const Point here = front.top().second;
      front.pop();
      if (length(place(here) - b) <= step) return true;
      for (int k = 0; k < 27; ++k) {
        const Point next = {here[0] + k % 3 - 1, here[1] + k / 3 % 3 - 1, here[2] + k / 9 - 1};
        if (!seen.emplace(next, true).second) continue;
        const Vec3d there = place(next);
        if (allowed(there) && distance(there, radius) >= step) front.emplace(-length(there - b), next);
      }
    }
    return false;
  }

  /// Whether p is inside a closed model, by a ray that no axis is parallel to.
  [[nodiscard]] bool inside(Vec3d p) const {
    const Vec3d far = p + normalized(Vec3d{0.3713, 0.8191, 0.4377}) * (2 * size_ + length(p - bounds_.centre()));
    int depth = 0;
    for (const Crossing c : crossings(p, far)) depth += c.inwards ? -1 : 1;
    return depth > 0;
  }

 private:
  static double volume(Vec3d a, Vec3d b, Vec3d c) { return dot(a, cross(b, c)); }
  [[nodiscard]] std::array<Vec3d, 3> corners(std::uint32_t t) const {
    const auto& v = surface_.triangles[t];
    return {surface_.positions[v[0]], surface_.positions[v[1]], surface_.positions[v[2]]};
  }
  static Box3d ball(Vec3d p, double radius) {
    return {p - Vec3d{radius, radius, radius}, p + Vec3d{radius, radius, radius}};
  }
  [[nodiscard]] double distance_to(std::uint32_t t, Vec3d p) const {
    const auto c = corners(t);
    const Vec3d normal = normalized(cross(c[1] - c[0], c[2] - c[0]));
    double beside = 1e300;
    bool over = true;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3d a = c[k], edge = c[(k + 1) % 3] - a;
      const double along = std::clamp(dot(p - a, edge) / dot(edge, edge), 0.0, 1.0);
      beside = std::min(beside, length(p - a - edge * along));
      over = over && dot(cross(edge, p - a), normal) >= 0;
    }
    return over ? std::abs(dot(p - c[0], normal)) : beside;
  }

  [[nodiscard]] int box_of(double x, std::size_t axis) const {
    return static_cast<int>(std::clamp((x - bounds_.low[axis]) / step_, 0.0, double(count_[axis] - 1)));
  }
  template <typename Visit>
  void each_box(const Box3d& box, Visit&& visit) const {
    for (int z = box_of(box.low.z, 2); z <= box_of(box.high.z, 2); ++z)
      for (int y = box_of(box.low.y, 1); y <= box_of(box.high.y, 1); ++y)
        for (int x = box_of(box.low.x, 0); x <= box_of(box.high.x, 0); ++x)
          visit(boxes_[static_cast<std::size_t>((z * count_[1] + y) * count_[0] + x)]);
  }
  /// The triangles of the boxes that a box meets, each once per stamp.
  template <typename Visit>
  void each(const Box3d& box, Visit&& visit) const {
    if (!box.meets(bounds_)) return;
    each_box(box, [&](const std::vector<std::uint32_t>& list) {
      for (const std::uint32_t t : list) {
        if (mark_[t] == stamp_) continue;
        mark_[t] = stamp_;
        visit(t);
      }
    });
  }

  Tessellation surface_;
  Box3d bounds_;
  double size_ = 0, step_ = 1;
  std::array<int, 3> count_{};
  mutable std::vector<std::vector<std::uint32_t>> boxes_;
  std::vector<std::vector<std::uint32_t>> around_;  ///< triangles by vertex
  mutable std::vector<std::uint32_t> mark_;
  mutable std::uint32_t stamp_ = 0;
};

/// What can be wrong with a tick.
enum class Fault {
  None,
  Tunnelled,     ///< the free cursor went in, and nothing held it
  CaughtInAir,   ///< held where the cursor did not go in
  OffSurface,    ///< the point is not on the surface
  ChangedSheet,  ///< the point did not come to its place over the surface or through the air
  TooFast,       ///< further than it may go for the cursor's motion
  LetGoInside,   ///< let go although the way from the point to the cursor leads through the surface, or inside
  Overlaps,      ///< a ball in the material
  TooDeep,       ///< deeper than a plain god-object in its place, where nothing is thin
};
[[nodiscard]] inline std::string_view name(Fault fault) {
  switch (fault) {
    case Fault::None:
      return "none";
    case Fault::Tunnelled:
      return "tunnelled";
    case Fault::CaughtInAir:
      return "caught in air";
    case Fault::OffSurface:
      return "off the surface";
    case Fault::ChangedSheet:
      return "changed sheet";
    case Fault::TooFast:
      return "too fast";
    case Fault::LetGoInside:
      return "let go inside";
    case Fault::Overlaps:
      return "overlaps";
    case Fault::TooDeep:
      return "too deep";
  }
  return "unknown";
}

/// Follows one contact point from tick to tick on a model that stays.
class ContactJudge {
 public:
  ContactJudge(const TriangleSoup& soup, bool closed) : soup_(soup), closed_(closed), hair_(1e-9 * soup.size()) {}

  /// The cursor has moved straight to `cursor`, and the point has been stepped.
  [[nodiscard]] Fault judge(const Proxy& proxy, Vec3d cursor) {
    const Fault fault = last_ ? verdict(proxy, cursor) : Fault::None;
    last_ = Last{cursor, proxy.held() ? proxy.position() : cursor, proxy.held()};
    return fault;
  }

 private:
  struct Last {
    Vec3d cursor, point;
    bool held;
  };

  [[nodiscard]] Fault verdict(const Proxy& proxy, Vec3d cursor) const {
    const bool held = proxy.held();
    // It may go in, be held, and slip off the part, all in one tick.
    if (!last_->held && !held && !proxy.has_left()) return tunnelled(cursor) ? Fault::Tunnelled : Fault::None;
    if (!held && !proxy.has_left()) return Fault::LetGoInside;
    Vec3d start = last_->point;
    if (!last_->held) {
      const auto in = entry(cursor);
      if (!in) return Fault::CaughtInAir;
      start = *in;
    }
    if (held && soup_.distance(proxy.position(), 4 * hair_) > hair_) return Fault::OffSurface;
    // Over the surface to where it is, or to where it took off.
    const Vec3d walked = proxy.has_left() ? proxy.left_at() : proxy.position();
    const double reach = 10 * length(cursor - last_->cursor) + 0.02 * length(cursor - start) + hair_;
    if (length(walked - start) > reach) return Fault::TooFast;
    if (!soup_.connected(start, walked, reach, hair_)) return Fault::ChangedSheet;
    if (held && proxy.has_left() && !clear(walked, proxy.position())) return Fault::ChangedSheet;
    if (!held && !clear(walked, cursor)) return Fault::LetGoInside;
    if (!held && closed_ && soup_.inside(cursor) && soup_.distance(cursor, 1e-6 * soup_.size()) >= 1e-6 * soup_.size())
      return Fault::LetGoInside;
    return Fault::None;
  }

  /// Where the cursor went in; empty where it did not.
  [[nodiscard]] std::optional<Vec3d> entry(Vec3d cursor) const {
    // The point may begin on the surface, to within rounding.
    const Vec3d from = last_->cursor - normalized(cursor - last_->cursor) * (10 * hair_);
    const auto all = soup_.crossings(from, cursor);
    const auto in = std::ranges::find_if(all, &TriangleSoup::Crossing::inwards);
    if (in == all.end()) return std::nullopt;
    return from + (cursor - from) * in->t;
  }
  [[nodiscard]] bool tunnelled(Vec3d cursor) const {
    const auto all = soup_.crossings(last_->cursor, cursor);
    const auto in = std::ranges::find_if(all, &TriangleSoup::Crossing::inwards);
    return in != all.end() && (1 - in->t) * length(cursor - last_->cursor) > 1e-6 * soup_.size();
  }
  /// Whether the straight way between two places stays out of the material, but for less than a tenth of a micrometre
  /// on a metre: a way off the surface may graze it. Through the back of an open sheet the way is free.
  [[nodiscard]] bool clear(Vec3d from, Vec3d to) const {
    const double way = length(to - from), slack = 1e-6 * soup_.size();
    auto all = soup_.crossings(from, to);
    std::erase_if(all, [&](const auto& c) { return c.t * way <= slack || (1 - c.t) * way <= slack; });
    const auto shallow = [&](double begin, double end) {
      const double most = 1e-7 * soup_.size();
      for (const double share : {0.25, 0.5, 0.75})
        if (soup_.distance(from + (to - from) * (begin + (end - begin) * share), 2 * most) > most) return false;
      return true;
    };
    if (closed_ && !all.empty() && !all.front().inwards && !shallow(0, all.front().t)) return false;
    for (std::size_t k = 0; k < all.size(); ++k)
      if (all[k].inwards && !shallow(all[k].t, k + 1 < all.size() ? all[k + 1].t : 1)) return false;
    return true;
  }

  const TriangleSoup& soup_;
  bool closed_;
  double hair_;
  std::optional<Last> last_;
};

/// Follows one ball from tick to tick on a closed model that stays; it starts in the open, clear of the surface.
class BallJudge {
 public:
  static constexpr double kFlat =
      1e-4;  ///< of the radius: unevenness that a ball does not feel (docs/reference/haptics.md)

  BallJudge(const TriangleSoup& soup, double radius) : soup_(soup), radius_(radius) {}

  /// The cursor has moved straight to `cursor`, and the ball has been stepped, which says that it touches or does not.
  [[nodiscard]] Fault judge(const BallProxy& ball, bool touches, Vec3d cursor) {
    const Vec3d centre = ball.held() ? ball.centre() : cursor;
    const Fault fault = last_ ? verdict(centre, cursor, touches) : Fault::None;
    last_ = Last{cursor, centre, ball.held() && !ball.under_way()};
    return fault;
  }
  /// By how much it was in a triangle at most, of its radius.
  [[nodiscard]] double most_overlap() const noexcept { return most_overlap_; }

 private:
  struct Last {
    Vec3d cursor, centre;
    bool held;
  };

  [[nodiscard]] Fault verdict(Vec3d centre, Vec3d cursor, bool touches) {
    const double overlap = 1 - soup_.distance(centre, radius_) / radius_;
    most_overlap_ = std::max(most_overlap_, overlap);
    if (overlap > kFlat) return Fault::Overlaps;
    const double went = length(centre - last_->centre), moved = length(cursor - last_->cursor);
    // It only ever comes nearer to the cursor, and once held it goes no further than this.
    const double reach = 10 * moved + 0.02 * length(cursor - last_->centre) + 1e-6 * radius_;
    if (last_->held && went > reach) return Fault::TooFast;
    if (!last_->held && touches && soup_.keeps_off(last_->centre, cursor, radius_ * (1 + kFlat)))
      return Fault::CaughtInAir;
    // A way of less than a radius between two places where it is clear leads through nothing.
    if (went < radius_ || soup_.keeps_off(last_->centre, centre, 0.5 * radius_)) return Fault::None;
    const double nearer = length(last_->centre - last_->cursor) + moved + radius_;
    const bool way = soup_.has_way(last_->centre, centre, radius_, [&](Vec3d p) {
      if (!last_->held) return length(p - cursor) <= nearer;
      return length(p - last_->centre) + length(p - centre) <= reach + 2 * radius_;
    });
    if (way) return Fault::None;
    return last_->held ? Fault::ChangedSheet : Fault::Tunnelled;
  }

  const TriangleSoup& soup_;
  double radius_, most_overlap_ = 0;
  std::optional<Last> last_;
};

}  // namespace relief::testing
