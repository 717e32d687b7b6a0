#include "face.h"

#include <relief/core/query.h>
#include <relief/core/tessellate.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace relief::demo {

namespace {

/// A place on the face: x to the right, y up, both about -1..1 over the front of the model.
struct FacePoint {
  double x, y;
};
using Line = std::vector<FacePoint>;

enum BrushNumber : std::uint32_t { Cutter, Smoother, Builder, DarkPaint, LightPaint, Blush };

/// A hole of the face: a zigzag that fills it, then once around it, which leaves a clean rim.
Line fill(const Line& top, const Line& bottom) {
  Line line;
  for (std::size_t k = 0; k < top.size(); ++k) {
    line.push_back(k % 2 == 0 ? top[k] : bottom[k]);
    line.push_back(k % 2 == 0 ? bottom[k] : top[k]);
  }
  line.insert(line.end(), bottom.rbegin(), bottom.rend());
  line.insert(line.end(), top.begin(), top.end());
  return line;
}

/// A triangle that stands on its base, filled in `columns` passes.
Line triangle(FacePoint tip, double half_width, double height, int columns) {
  Line top, bottom;
  for (int k = 0; k <= columns; ++k) {
    const double side = 2.0 * k / columns - 1;
    bottom.push_back({tip.x + side * half_width, tip.y - height});
    top.push_back({tip.x + side * half_width, tip.y - height * std::abs(side)});
  }
  return fill(top, bottom);
}

/// A grin with two teeth.
Line grin() {
  constexpr int kColumns = 40;
  Line top, bottom;
  for (int k = 0; k <= kColumns; ++k) {
    const double x = -0.5 + static_cast<double>(k) / kColumns, side = std::abs(x);
    const bool tooth = side > 0.10 && side < 0.28;
    const double lip = -0.72 + 1.85 * x * x;
    bottom.push_back({x, lip});
    top.push_back({x, std::max(lip, -0.46 + 0.75 * x * x - (tooth ? 0.11 : 0.0))});
  }
  return fill(top, bottom);
}

Line arc(FacePoint from, FacePoint middle, FacePoint to) {
  Line line;
  for (int k = 0; k <= 12; ++k) {
    const double t = k / 12.0, a = (1 - t) * (1 - t), b = 2 * t * (1 - t), c = t * t;
    line.push_back({a * from.x + b * middle.x + c * to.x, a * from.y + b * middle.y + c * to.y});
  }
  return line;
}

class Planner {
 public:
  Planner(const Snapshot& model, const Workspace& workspace) : model_(model), workspace_(workspace) {
    for (const Vec3d p : tessellate(model).positions) box_.add(p);
    scale_ = diagonal(box_);
  }

  /// Follows a line at the given depth below the surface; `buttons` are held from touch-down to lift-off. What is built
  /// or painted adds up over time, so the hand goes slowly there.
  void follow(const Line& line, double depth, std::uint32_t buttons) {
    const std::uint32_t brush = buttons >> 8U;
    const double work = brush <= Smoother ? kWork : brush == DarkPaint ? kPaint : kSlow;
    std::vector<std::optional<RayHit>> places;
    for (std::size_t k = 0; k < line.size(); ++k) {
      const FacePoint to = line[k], from = k > 0 ? line[k - 1] : to;
      const double way = std::hypot(to.x - from.x, to.y - from.y);
      const int steps = std::max(1, static_cast<int>(way / 0.02));
      for (int s = k > 0 ? 1 : steps; s <= steps; ++s) {
        const double t = static_cast<double>(s) / steps;
        places.push_back(cast({std::lerp(from.x, to.x, t), std::lerp(from.y, to.y, t)}));
      }
    }
    bool down = false;
    for (const auto& place : places) {
      if (!place) {
        if (down) lift();
        down = false;
        continue;
      }
      const Vec3d p = place->point.position, n = place->point.normal;
      if (!down) {
        go(p + n * (0.04 * scale_), 0, kTravel);
        go(p - n * (0.3 * depth * scale_), 0, kTravel);
        down = true;
      }
      go(p - n * (depth * scale_), buttons, buttons == 0 ? kFeel : work);
      if (brush >= DarkPaint) painted_.emplace_back(p, brush);
      last_normal_ = n;
    }
    if (down) lift();
  }

  Performance finish(std::vector<Brush> brushes) {
    performance_.brushes = std::move(brushes);
    for (const auto& [place, brush] : painted_)
      performance_.painted.push_back({place, performance_.brushes[brush].colour, performance_.brushes[brush].radius});
    for (const Leg& leg : performance_.legs) performance_.seconds += leg.seconds;
    return std::move(performance_);
  }
  [[nodiscard]] double scale() const { return scale_; }

 private:
  static constexpr double kTravel = 0.2, kFeel = 0.08, kWork = 0.05, kPaint = 0.022, kSlow = 0.012;  // m/s

  std::optional<RayHit> cast(FacePoint f) const {
    const Vec3d half = box_.extent() * 0.5, centre = box_.centre();
    const Vec3d from = {centre.x + 0.8 * f.x * half.x, centre.y + (0.75 * f.y - 0.12) * half.y,
                        box_.high.z + 0.1 * scale_};
    auto hit = raycast(model_, {from, {0, 0, -1}});
    // Places that look away from the viewer are no part of a face.
    if (hit && hit->point.normal.z < 0.2) return std::nullopt;
    return hit;
  }
  void go(Vec3d to, std::uint32_t buttons, double speed) {
    const Vec3d target = workspace_.to_device(to);
    const Vec3d from = performance_.legs.empty() ? target : performance_.legs.back().position;
    const double seconds = performance_.legs.empty() ? 0.3 : std::max(0.004, length(target - from) / speed);
    performance_.legs.push_back({target, seconds, buttons});
  }
  void lift() {
    const Vec3d here = workspace_.to_model(performance_.legs.back().position);
    performance_.legs.back().buttons = 0;
    go(here + last_normal_ * (0.07 * scale_), 0, kTravel);
  }

  const Snapshot& model_;
  Workspace workspace_;
  Box3d box_;
  double scale_ = 1;
  Vec3d last_normal_{0, 0, 1};
  std::vector<std::pair<Vec3d, std::uint32_t>> painted_;  ///< places, and the brush that is led over them
  Performance performance_;
};

constexpr std::uint32_t press(BrushNumber brush) { return 1U | (static_cast<std::uint32_t>(brush) << 8U); }

}  // namespace

Performance plan_face(const Snapshot& model, const Workspace& workspace, bool brief) {
  Planner plan(model, workspace);
  const double d = plan.scale();
  const std::vector<Brush> brushes = {
      {.tool = Tool::Carve, .radius = 0.012 * d, .detail = kDetail / 2, .resilience = 0.002 * d},
      {.tool = Tool::Smooth, .radius = 0.016 * d, .strength = 0.6},
      {.tool = Tool::Deposit, .radius = 0.024 * d, .strength = 1.0},
      {.tool = Tool::Paint, .radius = 0.019 * d, .strength = 1.0, .colour = {0.23F, 0.11F, 0.05F}},
      {.tool = Tool::Paint, .radius = 0.018 * d, .strength = 1.0, .colour = {0.98F, 0.87F, 0.55F}},
      {.tool = Tool::Paint, .radius = 0.035 * d, .strength = 0.3, .colour = {0.80F, 0.20F, 0.12F}}};
  const Line left_eye = triangle({-0.30, 0.42}, 0.16, 0.30, brief ? 4 : 12);
  const Line right_eye = triangle({0.30, 0.42}, 0.16, 0.30, 12);
  const Line nose = triangle({0, 0.06}, 0.08, 0.18, 6);
  const Line mouth = grin();

  // Feel first.
  plan.follow(arc({-0.6, 0.1}, {0, 0.35}, {0.6, 0.1}), 0.004, 0);
  if (!brief) plan.follow(arc({0.5, -0.3}, {0, -0.55}, {-0.5, -0.3}), 0.004, 0);
  // Carve, and smooth the floor of what was carved.
  constexpr double kCut = 0.015, kFloor = kCut + 0.004;
  const Line left_brow = arc({-0.44, 0.48}, {-0.30, 0.66}, {-0.16, 0.52});
  const Line right_brow = arc({0.16, 0.52}, {0.30, 0.66}, {0.44, 0.48});
  plan.follow(left_eye, kCut, press(Cutter));
  plan.follow(left_eye, kFloor, press(Smoother));
  if (!brief) {
    for (const Line& line : {right_eye, nose, mouth}) {
      plan.follow(line, kCut, press(Cutter));
      plan.follow(line, kFloor, press(Smoother));
    }
    // Build brows.
    plan.follow(left_brow, 0.012, press(Builder));
    plan.follow(right_brow, 0.012, press(Builder));
  }
  // Paint: into what was carved, on what was built, and the cheeks.
  plan.follow(left_eye, kCut + 0.007, press(DarkPaint));
  if (!brief) {
    for (const Line& line : {right_eye, nose, mouth}) plan.follow(line, kCut + 0.007, press(DarkPaint));
    plan.follow(left_brow, 0.004, press(LightPaint));
    plan.follow(right_brow, 0.004, press(LightPaint));
    plan.follow(arc({-0.40, -0.06}, {-0.36, -0.10}, {-0.32, -0.06}), 0.010, press(Blush));
    plan.follow(arc({0.32, -0.06}, {0.36, -0.10}, {0.40, -0.06}), 0.010, press(Blush));
  }
  return plan.finish(brushes);
}

HandScript script_of(const Performance& performance, std::shared_ptr<std::atomic<bool>> done) {
  struct Way {
    std::vector<Leg> legs;
    std::vector<double> ends;  ///< s, when each leg is over
  };
  auto way = std::make_shared<Way>();
  way->legs = performance.legs;
  double t = 0;
  for (const Leg& leg : way->legs) way->ends.push_back(t += leg.seconds);
  return [way, done = std::move(done)](double now) -> HandTarget {
    if (way->legs.empty() || now >= way->ends.back()) {
      done->store(true, std::memory_order_relaxed);
      return {way->legs.empty() ? Vec3d{} : way->legs.back().position, 0};
    }
    const auto k = static_cast<std::size_t>(std::ranges::upper_bound(way->ends, now) - way->ends.begin());
    const Leg& leg = way->legs[k];
    const Vec3d from = k > 0 ? way->legs[k - 1].position : leg.position;
    const double share = 1 - (way->ends[k] - now) / leg.seconds;
    return {from + (leg.position - from) * share, leg.buttons};
  };
}

}  // namespace relief::demo
