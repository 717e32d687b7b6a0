// Runs of scripted hands over a model, each tick of which is judged.
#pragma once

#include "support/contact_judge.h"
#include "support/exported.h"
#include "support/god_ball.h"

#include <relief/core/query.h>
#include <relief/haptics/contact/ball_proxy.h>
#include <relief/haptics/hand_limit.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace relief::testing {

enum class Motion { Slide, Tap, Press, DeepPress, Jump, Rush };
inline constexpr std::array<const char*, 6> kMotions = {"slide",         "tap",  "press to 4 %",
                                                        "press to 10 %", "jump", "rush"};

/// A hand over one place of the surface. Depths and widths are shares of the diagonal; with a diagonal of 0.15 m it
/// rushes at 2 m/s and jumps by up to 50 mm.
class ScriptedHand {
 public:
  ScriptedHand(Motion motion, const SurfacePoint& place, const Box3d& bounds, std::mt19937& random)
      : motion_(motion), place_(place), bounds_(bounds), random_(random), size_(diagonal(bounds)) {
    side_ = normalized(cross(place.normal, std::abs(place.normal.x) < 0.7 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0}));
    other_ = cross(place.normal, side_);
    phase_ = 6.28 * unit();
    const bool pressing = motion == Motion::Press || motion == Motion::DeepPress;
    at_ = place.position + place.normal * (0.01 * size_);
    wander_ = (pressing ? 0.005 : 0.05) * unit();
    leap_ = 0.33 * std::pow(10, -2 * unit());
    way_ = normalized(place.position - at_);
  }

  Vec3d next() {
    const int k = tick_++;
    if (motion_ == Motion::Jump) {
      if (k % 300 == 299) at_ = bounds_.centre() + anywhere() * (0.7 * size_);
      at_ += anywhere() * ((k % 7 == 6 ? leap_ : 0.002) * size_);
      return at_;
    }
    if (motion_ == Motion::Rush) {
      // Straight through, and back towards the middle from outside.
      if (k % 97 == 96 || length(at_ - bounds_.centre()) > 0.6 * size_)
        way_ = normalized(bounds_.centre() + anywhere() * (0.3 * size_) - at_);
      at_ += way_ * (0.0133 * size_);
      return at_;
    }
    const double t = k * 1e-3, in = k < 100 ? -0.01 + 1.2e-4 * k : 0.002;
    double depth = in;
    if (motion_ == Motion::Tap) depth = 0.002 - 0.01 * std::sin(12 * t + 1) - (k < 50 ? 0.02 : 0);
    if (motion_ == Motion::Slide && k >= 100) depth = 0.005;
    if (motion_ == Motion::Press && k >= 100) depth = 0.021 - 0.019 * std::cos(4.1 * (t - 0.1));
    if (motion_ == Motion::DeepPress && k >= 100) depth = 0.051 - 0.049 * std::cos(4.1 * (t - 0.1));
    const double fade = std::min(1.0, k / 300.0);
    const Vec3d aside = side_ * (std::sin(3 * t + phase_) - std::sin(phase_)) +
                        other_ * (std::cos(2 * t + 2 * phase_) - std::cos(2 * phase_));
    return place_.position - place_.normal * (depth * size_) + aside * (wander_ * fade * size_);
  }

 private:
  double unit() { return std::uniform_real_distribution<double>(0, 1)(random_); }
  Vec3d anywhere() { return {2 * unit() - 1, 2 * unit() - 1, 2 * unit() - 1}; }

  Motion motion_;
  SurfacePoint place_;
  Box3d bounds_;
  std::mt19937& random_;
  double size_, phase_ = 0, wander_ = 0, leap_ = 0;
  Vec3d side_, other_, at_, way_;
  int tick_ = 0;
};

/// What was judged.
struct ContactRuns {
  long pressed = 0, ticks = 0;
  long thin = 0;                  ///< places where the part is thinner than 3 % of the diagonal
  long compared = 0, deeper = 0;  ///< with a god-object, but for jumps and rushes; over 1.05 times as deep
  double most_times = 0;          ///< as deep as a god-object
  std::array<long, 9> faults{};   ///< by Fault
  double overlap = 0;             ///< by how much a ball was in a triangle at most, of its radius
  std::string first;              ///< the first fault and where it was
  [[nodiscard]] long bad() const {
    long sum = 0;
    for (std::size_t k = 1; k < faults.size(); ++k) sum += faults[k];
    return sum;
  }
};

inline bool is_closed(const SlabMesh& mesh) {
  return std::ranges::none_of(mesh.slabs(),
                              [](const Slab& s) { return std::ranges::count(s.neighbours, kNoSlab) > 0; });
}

/// Outside thin places what is held is to be no deeper than a plain god-object on the bare triangles that was where it
/// was, and has followed the cursor since; where that has been free for 60 ticks, at no depth. Thin is a place from
/// which the line through the cursor comes out of the body within twice the depth: of the product's place, or of the
/// god-object's. There, where the product lets go, and where a god-object goes off over an open rim, the comparison
/// ends, and begins again from where the product is.
class DepthJudge {
 public:
  /// `radius`: of a ball; 0: a point.
  DepthJudge(const BareTriangles& bare, double radius, bool closed)
      : oracle_(bare, radius, 1), slack_(1e-4 * bare.diagonal()), closed_(closed) {}
  /// How many times as deep the product is as the god-object was at most in the last 60 ticks; none where the two are
  /// not compared. 1e-4 of the diagonal is let pass. `place`: the contact point, or the centre of a ball.
  [[nodiscard]] std::optional<double> judge(bool held, Vec3d place, Vec3d cursor) {
    if (!held || oracle_.past_the_middle(place, cursor)) {
      following_ = false;
      return {};
    }
    if (!std::exchange(following_, true)) {
      following_ = oracle_.hold(place, cursor);
      depths_.clear();
      began_ = place;
      since_ = free_for_ = 0;
      if (!following_) return {};
    }
    const OracleTick oracle = oracle_.move(cursor);
    const double depth = length(place - cursor);
    if (!oracle.held && closed_) {
      if (++free_for_ <= kTicks) return {};
      return depth > slack_ ? std::numeric_limits<double>::infinity() : 0;
    }
    if (!oracle.held || free_for_ > 0 || oracle_.past_the_middle(oracle.point, cursor)) {
      following_ = false;
      return {};
    }
    depths_.push_back(oracle.depth);
    if (depths_.size() > kTicks) depths_.erase(depths_.begin());
    double most = *std::ranges::max_element(depths_);
    // As long it has to come out of a thin place, where it was right.
    if (++since_ < kTicks) most = std::max(most, length(began_ - cursor));
    return std::max(0.0, depth - slack_) / std::max(most, 1e-300);
  }

 private:
  static constexpr std::size_t kTicks = 60;

  Oracle oracle_;
  double slack_;
  bool closed_, following_ = false;
  Vec3d began_;
  std::size_t since_ = 0, free_for_ = 0;
  std::vector<double> depths_;
};

/// A point or a ball, and its judges.
class JudgedPoint {
 public:
  JudgedPoint(const TriangleSoup& soup, const BareTriangles& bare, bool closed)
      : judge_(soup, closed), depth_(bare, 0, closed) {}
  [[nodiscard]] Fault step(const Snapshot& model, Vec3d cursor) {
    static_cast<void>(proxy_.step(model, cursor));
    times_ = depth_.judge(proxy_.held(), proxy_.position(), cursor);
    return judge_.judge(proxy_, cursor);
  }
  [[nodiscard]] bool held() const noexcept { return proxy_.held(); }
  [[nodiscard]] double overlap() const noexcept { return 0; }
  [[nodiscard]] std::optional<double> times_as_deep() const noexcept { return times_; }

 private:
  Proxy proxy_;
  ContactJudge judge_;
  DepthJudge depth_;
  std::optional<double> times_;
};
class JudgedBall {
 public:
  JudgedBall(const TriangleSoup& soup, const BareTriangles& bare, double radius)
      : judge_(soup, radius), depth_(bare, radius, true), radius_(radius) {}
  [[nodiscard]] Fault step(const Snapshot& model, Vec3d cursor) {
    const bool touches = ball_.step(model, cursor, radius_);
    times_ = depth_.judge(touches, ball_.centre(), cursor);
    return judge_.judge(ball_, touches, cursor);
  }
  [[nodiscard]] bool held() const noexcept { return ball_.held(); }
  [[nodiscard]] double overlap() const noexcept { return judge_.most_overlap(); }
  [[nodiscard]] std::optional<double> times_as_deep() const noexcept { return times_; }

 private:
  BallProxy ball_;
  BallJudge judge_;
  DepthJudge depth_;
  double radius_;
  std::optional<double> times_;
};

/// Judges runs of all motions until so many ticks were pressed; every other round is over a thin part where there are
/// any. start(soup, run, radius) gives what is judged in a run; a tool's radius is so large, and its way begins as far
/// above the surface as a point's.
template <typename Start>
ContactRuns judged_runs(const Snapshot& model, long wanted, unsigned seed, double radius, Start&& start) {
  constexpr int kTicks = 2000;  // per run
  const TriangleSoup soup(model);
  const SlabMesh& mesh = model.slab_mesh();
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  ContactRuns done;
  for (int run = 0; done.pressed < wanted; ++run) {
    SurfacePoint place;
    for (int attempt = 0; attempt < 40; ++attempt) {
      double u = unit(random), v = unit(random);
      if (u + v > 1) {
        u = 1 - u;
        v = 1 - v;
      }
      place = surface_point(model, static_cast<SlabId>(unit(random) * mesh.slab_count()), u, v);
      const Vec3d out = place.normal * soup.size();
      if (!soup.crossings(place.position + out * 1e-4, place.position + out * 0.02).empty()) continue;
      const bool is_thin = !soup.crossings(place.position - out * 1e-4, place.position - out * 0.03).empty();
      done.thin += is_thin ? 1 : 0;
      if (run / int(kMotions.size()) % 2 == 0 || is_thin) break;
    }
    const auto motion = static_cast<std::size_t>(run) % kMotions.size();
    place.position += place.normal * radius;
    ScriptedHand hand(static_cast<Motion>(motion), place, soup.bounds(), random);
    auto judged = start(soup, run);
    HandLimit limit;
    for (int k = 0; k < kTicks; ++k) {
      const Vec3d cursor = limit.follow({hand.next(), {}}, 0, soup.size()).origin;
      // A ball begins where it has room, and that in the open: so far above one part may be within another.
      if (k == 0 && radius > 0 && (soup.distance(cursor, radius) < radius || soup.inside(cursor))) break;
      Fault fault = judged.step(model, cursor);
      ++done.ticks;
      done.pressed += judged.held() ? 1 : 0;
      if (const auto times = judged.times_as_deep(); times && motion < static_cast<std::size_t>(Motion::Jump)) {
        ++done.compared;
        done.deeper += *times > 1.05 ? 1 : 0;
        done.most_times = std::max(done.most_times, *times);
        if (fault == Fault::None && *times > 1.5) fault = Fault::TooDeep;
      }
      if (fault == Fault::None) continue;
      ++done.faults[static_cast<std::size_t>(fault)];
      if (done.first.empty())
        done.first = std::string(kMotions[motion]) + ", run " + std::to_string(run) + ", tick " + std::to_string(k) +
                     ": " + std::string(name(fault));
    }
    done.overlap = std::max(done.overlap, judged.overlap());
  }
  return done;
}

/// Of a point.
inline ContactRuns judged_runs(const Snapshot& model, bool closed, long wanted, unsigned seed = 8) {
  const BareTriangles bare = bare_triangles(model);
  return judged_runs(model, wanted, seed, 0,
                     [&](const TriangleSoup& soup, int) { return JudgedPoint(soup, bare, closed); });
}
/// Of a ball, on a closed model.
inline ContactRuns judged_ball_runs(const Snapshot& model, double radius, long wanted, unsigned seed = 8) {
  const BareTriangles bare = bare_triangles(model);
  return judged_runs(model, wanted, seed, radius,
                     [&](const TriangleSoup& soup, int) { return JudgedBall(soup, bare, radius); });
}

}  // namespace relief::testing
