// The oracle of contact for a ball: its centre is a god-object on bare triangles that are grown by its radius.
#pragma once

#include "support/god_object.h"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <vector>

namespace relief::testing {

/// The centre of a ball that the cursor pulls. It goes towards the cursor by small steps and never comes nearer to a
/// triangle than the radius. Each triangle so grown is convex, so the plane through its place that is nearest to the
/// centre keeps the centre out of it; where the planes of all triangles in reach leave no way nearer, it rests.
/// Triangles have no back for it: round an open edge it goes behind the surface.
class GodBall {
 public:
  /// `step`: of the radius, the longest straight way of the centre between two queries.
  GodBall(const BareTriangles& surface, double radius, double step = 0.02)
      : surface_(surface), radius_(radius), step_(step * radius) {}

  /// It is held with its centre at a place, under a cursor.
  void hold(Vec3d centre, Vec3d cursor) {
    held_ = true;
    centre_ = centre;
    cursor_ = cursor;
  }
  /// The cursor has moved straight to `cursor`; it begins in the air, at least the radius off the surface, or held.
  [[nodiscard]] OracleTick move(Vec3d cursor) {
    const bool begins = !cursor_;
    const Vec3d last = cursor_.value_or(cursor);
    if (begins) centre_ = cursor;
    const Vec3d from = centre_;
    const bool was_held = held_;
    const double parts = std::max(1.0, std::ceil(length(cursor - last) / step_));
    bool changed = false;
    for (double k = 1; k <= parts; ++k) {
      approach(last + (cursor - last) * (k / parts));
      changed = changed || held_ != was_held;
    }
    cursor_ = cursor;
    OracleTick tick{held_, centre_, length(centre_ - cursor), false};
    tick.jumped = !begins && (changed || (held_ && is_jump(from, centre_, last, cursor)));
    return tick;
  }

 private:
  /// Keeps the centre where dot(out, centre - here) >= least.
  struct Plane {
    Vec3d out;
    double least;
  };

  void approach(Vec3d cursor) {
    held_ = true;
    for (int k = 0; k < kMostSteps; ++k) {
      find_planes();
      const Vec3d way = nearest_allowed(cursor - centre_);
      const double far = length(way);
      if (far <= step_ && way == cursor - centre_) {
        centre_ = cursor;
        held_ = false;
        return;
      }
      if (far < kRest * radius_) return;
      centre_ += way * std::min(1.0, step_ / far);
    }
  }

  void find_planes() {
    planes_.clear();
    surface_.each_within(centre_, radius_ + step_, [&](const BareTriangles::Place& place, double distance) {
      const Plane plane = {(centre_ - place.position) / distance, radius_ - distance};
      const auto is_same = [&](const Plane& p) { return dot(p.out - plane.out, p.out - plane.out) < 1e-24; };
      if (std::ranges::none_of(planes_, is_same)) planes_.push_back(plane);
    });
  }

  /// The way nearest to the wanted one that all planes allow. The planes that bound it are found one by one: whichever
  /// is overstepped most joins them.
  [[nodiscard]] Vec3d nearest_allowed(Vec3d wanted) {
    bounding_.clear();
    Vec3d way = wanted;
    for (;;) {
      const Plane* most = nullptr;
      double by = 1e-12 * radius_;
      for (const Plane& p : planes_)
        if (p.least - dot(p.out, way) > by) {
          by = p.least - dot(p.out, way);
          most = &p;
        }
      if (most == nullptr) return way;
      if (bounding_.size() == kMostBounding) return {};
      bounding_.push_back(*most);
      way = nearest_to_bounding(wanted);
    }
  }
  /// The same by the planes of bounding_ alone: of the points on one, two or three of them, the nearest one that the
  /// others allow. None is nearer than where the ball is, if only that is allowed.
  [[nodiscard]] Vec3d nearest_to_bounding(Vec3d wanted) const {
    Vec3d best;
    double least = length(wanted);
    const auto try_out = [&](Vec3d way) {
      if (length(way - wanted) > least) return;
      for (const Plane& p : bounding_)
        if (p.least - dot(p.out, way) > 1e-12 * radius_) return;
      least = length(way - wanted);
      best = way;
    };
    const std::size_t count = bounding_.size();
    for (std::size_t i = 0; i < count; ++i) {
      const Plane& p = bounding_[i];
      try_out(wanted + p.out * (p.least - dot(p.out, wanted)));
      for (std::size_t j = 0; j < i; ++j) {
        const Plane& q = bounding_[j];
        const Vec3d line = cross(p.out, q.out);
        const double square = dot(line, line);
        if (square < 1e-20) continue;
        const Vec3d on = (cross(q.out, line) * p.least + cross(line, p.out) * q.least) / square;
        try_out(on + line * (dot(wanted - on, line) / square));
        for (std::size_t k = 0; k < j; ++k) {
          const Plane& r = bounding_[k];
          const double volume = dot(line, r.out);
          if (std::abs(volume) < 1e-12) continue;
          try_out((cross(q.out, r.out) * p.least + cross(r.out, p.out) * q.least + line * r.least) / volume);
        }
      }
    }
    return best;
  }

  static constexpr int kMostSteps = 10'000;
  static constexpr std::size_t kMostBounding = 12;
  static constexpr double kRest = 1e-7;  // of the radius, a shorter way is none: IsItsRadiusAboveAPlane fails at 1e-3

  const BareTriangles& surface_;
  double radius_, step_;
  std::optional<Vec3d> cursor_;
  Vec3d centre_;
  bool held_ = false;
  std::vector<Plane> planes_, bounding_;
};

/// The oracle of a tool: of a ball, or of a point where the radius is 0.
class Oracle {
 public:
  /// `parts`: of a point's way in a tick (GodObject).
  Oracle(const BareTriangles& surface, double radius, int parts = 20) : surface_(surface), radius_(radius) {
    if (radius > 0)
      ball_.emplace(surface, radius);
    else
      point_.emplace(surface, parts);
  }
  OracleTick move(Vec3d cursor) { return ball_ ? ball_->move(cursor) : point_->move(cursor); }
  /// It is held where a tool is, under a cursor; false where a point is not on the surface.
  [[nodiscard]] bool hold(Vec3d place, Vec3d cursor) {
    if (ball_) {
      ball_->hold(place, cursor);
      return true;
    }
    const auto on = surface_.nearest_within(place, 1e-6 * surface_.diagonal());
    if (on) point_->hold(*on, cursor);
    return on.has_value();
  }
  /// Whether the line from what is held through the cursor comes out of the body within twice the depth. The body of a
  /// ball's centre is the solid grown by the radius.
  [[nodiscard]] bool past_the_middle(Vec3d held, Vec3d cursor) const {
    const Vec3d in = cursor - held;
    const double depth = length(in), far = 2 * depth - radius_;
    return far > 0 && surface_.entry(held + in * (far / depth), held).has_value();
  }

 private:
  const BareTriangles& surface_;
  double radius_;
  std::optional<GodObject> point_;
  std::optional<GodBall> ball_;
};

}  // namespace relief::testing
