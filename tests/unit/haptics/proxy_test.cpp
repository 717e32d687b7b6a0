// The surface contact point: entry, the walk, release, rims, and a surface that changes under it.
#include "support/driver.h"
#include "support/wandering_hand.h"

#include <relief/haptics/contact/proxy.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

namespace relief {
namespace {

using testing::displaced;
using testing::plane_shell;
using testing::sphere_shell;
using testing::torus_shell;

SnapshotPtr bumpy_torus() {
  return displaced(torus_shell(16, 10, 16), [](Vec3d p) {
    return 0.5 + 0.25 * std::sin(9 * p.x) * std::cos(8 * p.z) + 0.1 * std::sin(21 * p.y);
  });
}

TEST(FirstEntry, AgreesWithTheRayOnWhereItGoesIn) {
  const SnapshotPtr model = bumpy_torus();
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(-1, 1);
  int hits = 0, misses = 0;
  for (int k = 0; k < 4000; ++k) {
    const Vec3d from = Vec3d{unit(random), unit(random), unit(random)} * 4.0;
    const double reach = std::pow(10, -2.5 * std::abs(unit(random)));
    Vec3d a = from;
    // From outside: start just above the surface half of the time, so that short ways hit, too.
    if (k % 2 == 0) {
      const SurfacePoint near = closest_point(*model, from);
      a = near.position + near.normal * (0.3 * reach);
    }
    const Vec3d b = a + Vec3d{unit(random), unit(random), unit(random)} * (4 * reach);
    const auto exact = raycast(*model, {a, b - a});
    const auto swept = first_entry(*model, a, b);
    if (exact && exact->distance < 1 && dot(exact->point.normal, b - a) > 0) continue;  // began inside
    const bool hit = exact && exact->distance < 1;
    ASSERT_EQ(hit, swept.has_value()) << k;
    (hit ? hits : misses) += 1;
    if (!hit) continue;
    EXPECT_NEAR(swept->distance, exact->distance, 1e-9);
    EXPECT_LT(length(swept->point.position - exact->point.position), 1e-9);
  }
  EXPECT_GT(hits, 500);
  EXPECT_GT(misses, 500);
}

TEST(FirstEntry, MissesNothingWhereFibresLeanAndNDiffers) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(-1, 1);
  int hits = 0;
  for (int round = 0; round < 36; ++round) {
    // Fibres that flare, and turn about the middle by up to half a right angle from the inner to the outer end.
    const double flare = 2 * std::abs(unit(random)), turn = 2 * unit(random), lean = 0.4 * unit(random);
    const auto bent = testing::mapped_shell(*plane_shell(1 + round % 3, 4, 0.15), [=](Vec3d p) {
      const double x = (p.x - 0.5) * (1 + flare * p.y), z = (p.z - 0.5) * (1 + 2 * flare * p.y), a = turn * p.y;
      return Vec3d{x * std::cos(a) - z * std::sin(a), p.y * (1 + lean * p.x), x * std::sin(a) + z * std::cos(a)};
    });
    const auto mesh = round % 4 == 0   ? testing::mixed_shell(*bent, 1, 6)
                      : round % 4 == 1 ? testing::mixed_shell(*bent, 3, 3)
                                       : testing::mixed_shell(*bent, round % 4 == 2 ? 31 : 64, 0);
    ASSERT_TRUE(mesh);
    // A nearly level sheet, waves, or noise, faint or over all heights.
    const double tilt = 0.3 * unit(random), height = 0.05 * unit(random), waves = 10 + 10 * unit(random);
    const SnapshotPtr model = displaced(mesh, [=](Vec3d p) {
      if (round % 3 == 2) {
        const double any = 4e4 * std::sin(1e4 * p.x + 3e4 * p.y + 7e4 * p.z);
        return 0.5 + (round % 2 == 0 ? 0.9 : 0.05) * (any - std::floor(any) - 0.5);
      }
      return round % 2 == 0 ? 0.5 + 0.3 * std::sin(waves * p.x) * std::cos(waves * p.z)
                            : std::clamp(0.5 + (tilt * p.x + height - p.y) / 0.3, 0.0, 1.0);
    });
    std::vector<std::array<Vec3d, 3>> triangles;
    for (SlabId slab = 0; slab < mesh->slab_count(); ++slab)
      for_each_cell(mesh->intervals(slab), mesh->edge_intervals(slab), [&](const std::array<GridPoint, 3>& cell) {
        triangles.push_back({sample_position(*model, slab, cell[0]), sample_position(*model, slab, cell[1]),
                             sample_position(*model, slab, cell[2])});
      });
    for (int k = 0; k < 150; ++k) {
      const auto& [p, q, r] = triangles[random() % triangles.size()];
      const Vec3d on = (p + q + r) / 3, side = Vec3d{unit(random), 0.3 * unit(random), unit(random)} *
                                               std::pow(10, -2 * std::abs(unit(random)));
      const Vec3d from = on + side, way = side * (-1 - std::abs(unit(random)));
      double first = 2;
      for (const auto& [a, b, c] : triangles) {
        const double wa = dot(way, cross(b - from, c - from)), wb = dot(way, cross(c - from, a - from)),
                     wc = dot(way, cross(a - from, b - from)), sum = wa + wb + wc;
        if (!(wa <= 0 && wb <= 0 && wc <= 0 && sum < 0)) continue;
        const double t = dot(((a - from) * wa + (b - from) * wb + (c - from) * wc) / sum, way) / dot(way, way);
        if (t >= 0) first = std::min(first, t);
      }
      if (first > 1 - 1e-6) continue;
      const auto swept = first_entry(*model, from, from + way);
      ASSERT_TRUE(swept) << "round " << round << " way " << k;
      ASSERT_NEAR(swept->distance, first, 1e-9) << "round " << round << " way " << k;
      ++hits;
    }
  }
  EXPECT_GT(hits, 1500);
}

TEST(Proxy, ALeapThroughTheModelLooksAtFewTriangles) {
  const SnapshotPtr model = displaced(torus_shell(16, 10, 64), [](Vec3d p) {
    return 0.5 + 0.25 * std::sin(9 * p.x) * std::cos(8 * p.z) + 0.1 * std::sin(21 * p.y);
  });
  std::mt19937 random(6);
  std::uniform_real_distribution<double> unit(-1, 1);
  Proxy proxy;
  int held = 0;
  std::vector<int> placed;
  for (int k = 0; k < 4000; ++k) {
    const SurfacePoint near = closest_point(*model, Vec3d{unit(random), unit(random), unit(random)} * 1.5);
    const Vec3d cursor = near.position + near.normal * (0.02 * unit(random));
    do {
      held += proxy.step(*model, cursor, {}) ? 1 : 0;
      placed.push_back(proxy.samples_placed());
    } while (proxy.late());
  }
  EXPECT_GT(held, 1000);
  std::ranges::sort(placed);
  EXPECT_LT(placed[placed.size() / 2], 300);
  EXPECT_LT(placed.back(), 500);
}

/// A torus, rough to the last of a million and a third triangles, and cusps with creases between them.
std::vector<SnapshotPtr> rough_models() {
  const auto noise = [](Vec3d p) {
    const double any = 4e4 * std::sin(1e4 * p.x + 3e4 * p.y + 7e4 * p.z);
    return any - std::floor(any) - 0.5;
  };
  return {displaced(torus_shell(8, 6, 128),
                    [=](Vec3d p) {
                      return 0.5 + 0.25 * std::sin(9 * p.x) * std::cos(8 * p.z) + 0.1 * std::sin(21 * p.y) +
                             0.02 * noise(p);
                    }),
          displaced(sphere_shell(2, 64, 0.3, 1.2), [=](Vec3d p) {
            return 0.5 + 0.45 * std::sin(40 * std::atan2(p.x, p.z)) * std::sin(25 * p.y) + 0.02 * noise(p);
          })};
}

/// Leaps through a model: to beside its surface, and from one corner of its box to another.
class Leaps {
 public:
  explicit Leaps(const Snapshot& model) : model_(model), size_(diagonal(model.slab_mesh().bounds())) {}
  Vec3d next() {
    const Vec3d centre = model_.slab_mesh().bounds().centre(), any = {unit_(random_), unit_(random_), unit_(random_)};
    if (++count_ % 5 == 0) return centre + normalized(any) * (0.55 * size_);
    const SurfacePoint near = closest_point(model_, centre + any * (0.4 * size_));
    return near.position + near.normal * (0.01 * size_ * unit_(random_));
  }

 private:
  const Snapshot& model_;
  double size_;
  int count_ = 0;
  std::mt19937 random_{16};
  std::uniform_real_distribution<double> unit_{-1, 1};
};

TEST(Proxy, NoTickTakesLongWhereverTheCursorLeaps) {
  for (const SnapshotPtr& model : rough_models())
    for (const Proxy::Look look : {Proxy::Look::Here, Proxy::Look::Around}) {
      Proxy proxy;
      Leaps leaps(*model);
      int late = 0;
      std::vector<int> work;
      for (int k = 0; k < 4000; ++k) {
        static_cast<void>(proxy.step(*model, leaps.next(), {}, look));
        work.push_back(proxy.work());
        late += proxy.late() ? 1 : 0;
      }
      std::ranges::sort(work);
      EXPECT_GT(late, 400);
      EXPECT_LT(work[work.size() * 99 / 100], 700);
      EXPECT_LT(work.back(), 1200);
    }
}

TEST(Proxy, NothingTunnelsWhileItIsLateAndALeapComesToItsEnd) {
  for (const SnapshotPtr& model : rough_models()) {
    const SlabMesh& mesh = model->slab_mesh();
    const double hair = 1e-9 * diagonal(mesh.bounds());
    Proxy proxy;
    Leaps leaps(*model);
    LocateHint hint;
    Vec3d from = mesh.bounds().centre() + mesh.bounds().extent();
    static_cast<void>(proxy.step(*model, from, {}));
    int late = 0, met = 0, missed = 0, longest = 0;
    for (int k = 0; k < 1500; ++k) {
      const Vec3d cursor = leaps.next();
      // Some of the leaps are followed by others before they have come to their end.
      for (int tick = 1; tick == 1 || (proxy.late() && k % 3 != 0); ++tick) {
        ASSERT_LT(tick, 100) << k;
        longest = std::max(longest, tick);
        const bool was_held = proxy.held();
        const bool held = proxy.step(*model, cursor, {});
        late += proxy.late() ? 1 : 0;
        ASSERT_FALSE(held && proxy.late());
        if (proxy.late()) {
          const Vec3d start = proxy.has_left() ? proxy.left_at() : from, way = cursor - start;
          const double share = dot(proxy.place() - start, way) / dot(way, way);
          ASSERT_LT(length(start + way * share - proxy.place()), 1e3 * hair) << k;
          ASSERT_LT(share, 1);
        } else if (!held) {
          ASSERT_EQ(proxy.place(), cursor);
        }
        if (!was_held) {
          // It meets what is on the way from where it was in the open, and goes no farther than there is nothing.
          const Vec3d end = proxy.late() && !proxy.has_left() ? proxy.place() : cursor;
          const auto entry = first_entry(*model, from, end);
          const bool goes_in = entry && (1 - entry->distance) * length(end - from) > 10 * hair;
          (goes_in ? met : missed) += 1;
          ASSERT_EQ(goes_in, held || proxy.has_left()) << k << " " << tick;
        }
        from = proxy.place();
      }
      // And at rest in the material, it is held.
      if (!proxy.late() && !proxy.held() && length(closest_point(*model, cursor).position - cursor) > 1e6 * hair) {
        ASSERT_FALSE(inside(*model, cursor, hint)) << k;
      }
    }
    EXPECT_GT(late, 300);
    EXPECT_GT(met, 200);
    EXPECT_GT(missed, 300);
    EXPECT_LE(longest, 28);
  }
}

/// Rough ground around a height.
SnapshotPtr rough_at(const std::shared_ptr<const SlabMesh>& mesh, double alpha) {
  return displaced(mesh, [=](Vec3d p) { return alpha + 0.04 * std::sin(90 * p.x) * std::sin(80 * p.y + 70 * p.z); });
}

TEST(Proxy, WhereItIsLateASurfaceThatRisesPastItTakesItAlong) {
  const auto mesh = torus_shell(16, 10, 64);
  const SnapshotPtr low = rough_at(mesh, 0.3), high = rough_at(mesh, 0.9);
  LocateHint hint;
  int risen = 0, late = 0;
  for (int k = 0; k < 400; ++k) {
    // Over the crest of the tube, which is rough.
    const double turn = 0.016 * k;
    const Vec3d out = {std::cos(turn), 0, std::sin(turn)}, along = {-out.z, 0, out.x};
    const SurfacePoint near = closest_point(*low, out * 10.0);
    Proxy proxy;
    static_cast<void>(proxy.step(*low, near.position + out * 0.02, {}));
    const Vec3d cursor = near.position + out * 0.02 + along * (k % 2 == 0 ? 1.0 : 0.3);
    static_cast<void>(proxy.step(*low, cursor, {}));
    late += proxy.late() ? 1 : 0;
    if (!proxy.late() || !inside(*high, proxy.place(), hint)) continue;
    ++risen;
    static_cast<void>(proxy.step(*high, cursor, {.share = 0.1, .most = 0.01}));
    EXPECT_TRUE(proxy.held() || proxy.has_left()) << k;
    EXPECT_GT(proxy.rise(), 0) << k;
  }
  EXPECT_GT(risen, 20) << late;
}

TEST(Proxy, WhereItHasNotYetSetOutASurfaceThatRisesTakesItAlong) {
  const auto mesh = torus_shell(16, 10, 64);
  const SnapshotPtr low = rough_at(mesh, 0.3), same = rough_at(mesh, 0.3), high = rough_at(mesh, 0.9);
  const double across = diagonal(mesh->bounds());
  int there = 0;
  for (int k = 0; k < 400; ++k) {
    // Pressed on, then pulled along the rough surface and out: after the walk there is no time to look along the way.
    const double turn = 0.016 * k;
    const Vec3d out = {std::cos(turn), 0, std::sin(turn)}, along = {-out.z, 0, out.x};
    const Vec3d place = closest_point(*low, out * 10.0).position;
    for (const SnapshotPtr& next : {same, high}) {
      Proxy proxy;
      for (const double height : {0.02, 0.0, -0.005}) static_cast<void>(proxy.step(*low, place + out * height, {}));
      const Vec3d cursor = place + along * 0.9 - out * 0.05;
      static_cast<void>(proxy.step(*low, cursor, {}));
      if (!proxy.late() || !proxy.has_left() || length(proxy.place() - proxy.left_at()) > 1e-6 * across) break;
      static_cast<void>(proxy.step(*next, cursor, {.share = 0.1, .most = 0.01}));
      if (next == same) {
        EXPECT_EQ(proxy.rise(), 0) << k;
        continue;
      }
      ++there;
      EXPECT_TRUE(proxy.held() || proxy.has_left()) << k;
      EXPECT_GT(proxy.rise(), 0) << k;
    }
  }
  EXPECT_GT(there, 20);
}

TEST(Proxy, WhatAnEditTakesAwayGivesWayInBoundedTimeWhateverTheHandDoes) {
  // Pressed sideways into a thorn, which is then gone.
  const auto with_thorn = [](double high) {
    return displaced(plane_shell(4, 32), [=](Vec3d p) {
      const double x = p.x - 0.5, z = p.z - 0.5;
      return 0.3 + high * std::exp(-(x * x + z * z) / 0.002);
    });
  };
  const SnapshotPtr before = with_thorn(0.5), after = with_thorn(0);
  const Proxy::Ease ease = {.share = 0.06, .most = 5e-4};
  for (const Proxy::Look look : {Proxy::Look::Here, Proxy::Look::Around})
    for (const int moves_every : {0, 1, 2, 10})
      for (const Vec3d way : {Vec3d{1, 0, 0}, Vec3d{-1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}}) {
        Proxy proxy;
        Vec3d hand = {0.4, 0, 0.5};
        for (; hand.x < 0.48; hand.x += 1e-3) static_cast<void>(proxy.step(*before, hand, ease, look));
        for (int k = 0; k < 100; ++k) static_cast<void>(proxy.step(*before, hand, ease, look));
        ASSERT_TRUE(proxy.held());
        double depth = proxy.depth();
        ASSERT_GT(depth, 0.015);
        int ticks = 0;
        for (; proxy.held() && ticks < 400; ++ticks) {
          const double travel = moves_every > 0 && ticks % moves_every == 0 ? 2e-4 : 0;
          hand += way * travel;
          if (!proxy.step(*after, hand, ease, look)) break;
          EXPECT_LE(std::abs(proxy.depth() - depth), ease.most + 2 * travel) << ticks;
          depth = proxy.depth();
        }
        EXPECT_LT(ticks, 200) << "moves every " << moves_every;
        EXPECT_LE(depth, ease.most + 4e-4) << "when it is let go";
      }
}

TEST(Proxy, AFastHandInTheOpenIsNotLate) {
  // Nearly 3 m/s where the diagonal is 150 mm, close to the surface, with n = 64.
  const SnapshotPtr model = displaced(torus_shell(16, 10, 64), [](Vec3d p) {
    return 0.5 + 0.25 * std::sin(9 * p.x) * std::cos(8 * p.z) + 0.1 * std::sin(21 * p.y);
  });
  const double step = 0.0199 * diagonal(model->slab_mesh().bounds());
  std::mt19937 random(9);
  std::uniform_real_distribution<double> unit(-1, 1);
  int free = 0, late = 0;
  for (int k = 0; k < 4000; ++k) {
    const SurfacePoint near = closest_point(*model, Vec3d{unit(random), 0.3 * unit(random), unit(random)} * 1.5);
    const Vec3d from = near.position + near.normal * (step * std::abs(unit(random)));
    Proxy proxy;
    static_cast<void>(proxy.step(*model, from, {}));
    const Vec3d way = normalized(Vec3d{unit(random), unit(random), unit(random)}) * step;
    static_cast<void>(proxy.step(*model, from + way, {}));
    free += proxy.held() ? 0 : 1;
    late += proxy.late() ? 1 : 0;
  }
  EXPECT_GT(free, 1000);
  EXPECT_EQ(late, 0);
}

TEST(Proxy, StaysOnTheSurfaceAtTheNearestPlace) {
  const SnapshotPtr model = displaced(sphere_shell(2, 32), [](Vec3d p) {
    return (1 / length(p) - 0.8) / 0.4 + 0.02 * std::sin(20 * p.x) * std::cos(17 * p.y);
  });
  Proxy proxy;
  EXPECT_FALSE(proxy.step(*model, {0, 0, 1.1}, {}));
  double worst = 0;
  for (int k = 0; k < 5000; ++k) {
    const double turn = 1.3e-3 * k;
    const Vec3d way = normalized(Vec3d{std::sin(turn), 0.4 * std::sin(3 * turn), std::cos(turn)});
    const Vec3d cursor = way * (k < 60 ? 1.1 - 0.0025 * k : 0.95);
    const bool held = proxy.step(*model, cursor, {});
    if (k < 100) continue;
    ASSERT_TRUE(held) << k;
    const SurfacePoint& at = proxy.surface();
    EXPECT_LT(length(closest_point(*model, at.position).position - at.position), 1e-9);
    EXPECT_NEAR(proxy.depth(), length(at.position - cursor), 1e-12);
    EXPECT_EQ(proxy.rise(), 0);
    worst = std::max(worst, proxy.depth() / length(closest_point(*model, cursor).position - cursor));
  }
  EXPECT_LT(worst, 1.03);
}

TEST(Proxy, ComesNearerInEveryTickUnderARestingCursor) {
  const SnapshotPtr model = bumpy_torus();
  std::mt19937 random(12);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int press = 0; press < 50; ++press) {
    const SurfacePoint p =
        closest_point(*model, normalized(Vec3d{unit(random), 0.3 * unit(random), unit(random)}) * 3.2);
    Proxy proxy;
    static_cast<void>(proxy.step(*model, p.position + p.normal * 0.05, {}));
    const Vec3d cursor = p.position - p.normal * 0.05 + Vec3d{unit(random), unit(random), unit(random)} * 0.02;
    ASSERT_TRUE(proxy.step(*model, cursor, {}));
    double last = proxy.depth();
    for (int k = 0; k < 100; ++k) {
      ASSERT_TRUE(proxy.step(*model, cursor, {}));
      EXPECT_LE(proxy.depth(), last);
      last = proxy.depth();
    }
  }
}

TEST(Proxy, HoldsBelowTheSlabsAndLetsGoWhereItCameIn) {
  const SnapshotPtr model = displaced(plane_shell(4, 8), [](Vec3d) { return 0.5; });
  Proxy proxy;
  for (int k = 0; k <= 200; ++k) {
    const double y = 0.05 - 0.005 * (k <= 100 ? k : 200 - k);
    const bool held = proxy.step(*model, {0.4, y, 0.45}, {});
    if (std::abs(y) > 1e-9) {
      EXPECT_EQ(held, y < 0) << y;
    }
    if (!proxy.held()) continue;
    EXPECT_LT(length(proxy.surface().position - Vec3d{0.4, 0, 0.45}), 1e-9);
    EXPECT_NEAR(proxy.depth(), -y, 1e-9);
  }
}

TEST(Proxy, LetsGoBeyondAnOpenEdgeAndDoesNotCatchFromBelow) {
  const SnapshotPtr model = displaced(plane_shell(4, 8), [](Vec3d) { return 0.5; });
  Proxy proxy;
  static_cast<void>(proxy.step(*model, {0.8, 0.02, 0.5}, {}));
  for (double x = 0.8; x < 1.2; x += 0.01) {
    const bool held = proxy.step(*model, {x, -0.03, 0.5}, {});
    EXPECT_EQ(held, x < 1) << x;
    if (held) {
      EXPECT_NEAR(proxy.depth(), 0.03, 1e-9);
    }
  }
  // Back under the sheet, and up through it: nothing there holds a tool that comes from behind.
  for (double x = 1.2; x > 0.5; x -= 0.01) EXPECT_FALSE(proxy.step(*model, {x, -0.2, 0.5}, {}));
  for (double y = -0.2; y < 0.1; y += 0.01) EXPECT_FALSE(proxy.step(*model, {0.5, y, 0.5}, {}));
  do static_cast<void>(proxy.step(*model, {0.5, -0.01, 0.5}, {}));
  while (proxy.late());
  EXPECT_TRUE(proxy.held());
}

TEST(Proxy, SlidesOverAnEdgeAndIsFreeBeyondIt) {
  // A step of 0.16 down at x = 0.5, over one sample.
  const SnapshotPtr model = displaced(plane_shell(4, 32), [](Vec3d p) { return p.x < 0.5 ? 0.9 : 0.1; });
  Proxy proxy;
  static_cast<void>(proxy.step(*model, {0.3, 0.1, 0.3}, {}));
  for (double x = 0.3; x < 0.6; x += 0.002) {
    const bool held = proxy.step(*model, {x, 0.07, 0.3}, {});
    if (x < 0.49 || x > 0.52) {
      EXPECT_EQ(held, x < 0.5) << x;
    }
  }
}

/// A thin disc, pressed straight through near its rim and back, also with a lean outwards: the tool is held beyond it.
TEST(Proxy, IsNotLetGoWhereItIsPressedStraightPastARim) {
  const auto round = testing::sphere_shell(2, 16);
  const auto flat = testing::mapped_shell(*round, [](Vec3d p) { return Vec3d{p.x, 0.05 * p.y, p.z}; });
  const SnapshotPtr model = displaced(flat, [](Vec3d) { return 0.5; });
  for (const Proxy::Look look : {Proxy::Look::Here, Proxy::Look::Around}) {
    int pressed = 0, lost = 0;
    for (const double lean : {0.0, 0.2, 0.4, 0.6})
      for (double x = 0.7; x < 0.96; x += 0.02) {
        const auto in = raycast(*model, {{x, 1, 0.1}, {0, -1, 0}});
        ASSERT_TRUE(in);
        const Vec3d start = in->point.position, way = normalized(Vec3d{lean, -1, 0});
        Proxy proxy;
        for (int k = 0; k <= 400; ++k) {
          const double depth = 0.19 - 0.2 * std::cos(2 * 3.14159265 * k / 400);
          const bool held = proxy.step(*model, start + way * depth, {}, look);
          if (depth < 0.02) continue;
          ++pressed;
          lost += held ? 0 : 1;
        }
      }
    EXPECT_GT(pressed, 10'000);
    EXPECT_LE(lost, pressed / 1000);  // a tick or two where the hand turns round; once it was two in five
  }
}

/// A finger, thinner than the tool goes deep.
SnapshotPtr finger() {
  const auto thin =
      testing::mapped_shell(*testing::sphere_shell(2, 16), [](Vec3d p) { return Vec3d{p.x, 0.12 * p.y, 0.15 * p.z}; });
  return displaced(thin, [](Vec3d) { return 0.5; });
}

/// Pressed beyond the middle of a thin part and led about in circles there, or trembling.
struct DeepHand {
  Proxy proxy;
  Vec3d start, last, cursor;
  double made = 0;  ///< of the squared distance: what the point's own moves added to it since it is held
  double most = 0;

  DeepHand(const Snapshot& model, Vec3d above, Vec3d way, double depth, Proxy::Look look)
      : start(raycast(model, {above, way})->point.position) {
    for (int k = 0; k <= 400; ++k) to(model, start + way * (depth * (k - 20) / 380), look);
  }
  void to(const Snapshot& model, Vec3d next, Proxy::Look look) {
    const bool held = proxy.held();
    const Vec3d before = held ? proxy.surface().position : Vec3d{};
    last = cursor;
    cursor = next;
    if (!proxy.step(model, cursor, {}, look)) {
      made = 0;
    } else if (held) {
      const Vec3d middle = (cursor + last) * 0.5, now = proxy.surface().position;
      made += dot(now - middle, now - middle) - dot(before - middle, before - middle);
      most = std::max(most, made);
    }
  }
};

TEST(Proxy, ItsOwnMovesPutNothingIntoTheSpringInAThinPart) {
  const SnapshotPtr model = finger();
  for (const Proxy::Look look : {Proxy::Look::Here, Proxy::Look::Around})
    for (double x = -0.5; x < 0.6; x += 0.25)
      for (const double aside : {0.0, 0.03, 0.06}) {
        DeepHand hand(*model, {x, 1, aside}, {0, -1, 0}, 0.2, look);
        const Vec3d middle = hand.cursor;
        int held = 0;
        for (int k = 0; k < 6000; ++k) {
          const double turn = 2 * 3.14159265 * k / 1000;
          hand.to(*model,
                  middle + Vec3d{0.03 * std::sin(turn), 0.02 * std::sin(2 * turn), 0.03 * std::cos(turn) - 0.03}, look);
          held += hand.proxy.held() ? 1 : 0;
        }
        EXPECT_GT(held, 0);
        EXPECT_LT(hand.most, 1e-3 * 0.2 * 0.2) << x << " " << aside << " " << int(look);
      }
}

TEST(Proxy, ATremblingHandDoesNotWorkItOffAThinPart) {
  const SnapshotPtr model = finger();
  int lost = 0, wrong = 0;
  for (const Proxy::Look look : {Proxy::Look::Here, Proxy::Look::Around})
    for (double x = -0.5; x < 0.6; x += 0.25) {
      std::mt19937 random(7);
      std::normal_distribution<double> normal;
      DeepHand hand(*model, {x, 1, 0.02}, {0, -1, 0}, 0.2, look);
      const Vec3d middle = hand.cursor;
      Vec3d off;
      for (int k = 0; k < 8000; ++k) {
        off += Vec3d{normal(random), normal(random), normal(random)} * 2e-4 - off * 0.05;
        hand.to(*model, middle + off, look);
        lost += hand.proxy.held() ? 0 : 1;
        wrong += hand.proxy.held() && !(hand.proxy.way_out().y > 0) ? 1 : 0;
      }
    }
  EXPECT_EQ(lost, 0);
  EXPECT_EQ(wrong, 0);
}

TEST(Proxy, WhatIsFeltOfAnEditChangesByNoMoreThanItMay) {
  // A bump rises under the tip, or goes, so steep that the nearest place of the new surface is elsewhere.
  const auto mesh = plane_shell(4, 32);
  const auto bump = [&](double height) {
    return displaced(
        mesh, [=](Vec3d p) { return 0.5 + height * std::max(0.0, 1 - 5 * std::hypot(p.x - 0.46, p.z - 0.45)) / 0.2; });
  };
  const SnapshotPtr flat = bump(0), raised = bump(0.06);
  const Proxy::Ease ease = {.share = 0.065, .most = 2e-3};
  for (const Proxy::Look look : {Proxy::Look::Here, Proxy::Look::Around})
    for (const double depth : {0.01, 0.05, 0.1}) {
      Proxy proxy;
      const Vec3d cursor = {0.5, -depth, 0.45};
      for (int k = 0; k < 300; ++k)
        static_cast<void>(proxy.step(*flat, cursor + Vec3d{0, std::max(0.0, 2e-3 * (100 - k)), 0}, ease, look));
      ASSERT_TRUE(proxy.held());
      Vec3d last = proxy.way_out() * proxy.depth(), shaded = proxy.normal() * proxy.depth();
      const Vec3d first = last;
      double farthest = 0;
      for (int k = 0; k < 800; ++k) {
        ASSERT_TRUE(proxy.step(k < 400 ? *raised : *flat, cursor, ease, look)) << k;
        const Vec3d now = proxy.way_out() * proxy.depth(), now_shaded = proxy.normal() * proxy.depth();
        EXPECT_LE(length(now - last), ease.most * (1 + 1e-9)) << depth << " " << k;
        EXPECT_LE(length(now_shaded - shaded), 1.1 * ease.most) << depth << " " << k;
        last = now;
        shaded = now_shaded;
        farthest = std::max(farthest, length(now - first));
      }
      EXPECT_GT(farthest, 0.01) << "the change was felt";
      EXPECT_LT(length(last - first), 2e-3) << "and is gone again";
    }
}

TEST(Proxy, LetsGoOfAFastCursorThatComesOutAtAGrazingAngle) {
  const SnapshotPtr model = testing::fine_sphere();
  for (const double step : {0.01, 0.02, 0.04}) {
    const auto at = [&](double turn, double height) {
      return Vec3d{std::sin(turn), std::cos(turn), 0.01} * (1 + height);
    };
    Proxy proxy;
    static_cast<void>(proxy.step(*model, at(0, 0.01), {}));
    for (int k = 1; k <= 100; ++k) static_cast<void>(proxy.step(*model, at(1e-3 * k, 0.01 - 1.5e-4 * k), {}));
    ASSERT_TRUE(proxy.held());
    int held = 0;
    for (int k = 1; k <= 20; ++k) held += proxy.step(*model, at(0.1 + step * k, 0.005 * step * k), {}) ? 1 : 0;
    EXPECT_LE(held, 2) << step;
  }
}

TEST(Proxy, FollowsASurfaceThatRisesAndFalls) {
  const auto mesh = plane_shell(4, 8);
  const auto level = [&](double height) { return displaced(mesh, [=](Vec3d) { return 0.5 + height / 0.2; }); };
  const SnapshotPtr flat = level(0), raised = level(0.02), carved = level(-0.02);
  const Proxy::Ease ease = {.share = 0.1, .most = 1};
  Proxy proxy;
  static_cast<void>(proxy.step(*flat, {0.4, 0.01, 0.45}, ease));
  static_cast<void>(proxy.step(*flat, {0.4, -0.03, 0.45}, ease));
  EXPECT_NEAR(proxy.depth(), 0.03, 1e-6);
  double last = proxy.depth();
  EXPECT_TRUE(proxy.step(*raised, {0.4, -0.03, 0.45}, ease));
  EXPECT_NEAR(proxy.rise(), 0.02, 1e-6);
  EXPECT_NEAR(proxy.surface().position.y, 0.02, 1e-6);
  for (int k = 0; k < 100; ++k) {
    EXPECT_LE(std::abs(proxy.depth() - last), 0.0021) << "taken over by a tenth per tick";
    last = proxy.depth();
    ASSERT_TRUE(proxy.step(*raised, {0.4, -0.03, 0.45}, ease));
  }
  EXPECT_NEAR(proxy.depth(), 0.05, 1e-4);
  for (int k = 0; k < 100; ++k) {
    ASSERT_TRUE(proxy.step(*carved, {0.4, -0.03, 0.45}, ease));
    EXPECT_LE(std::abs(proxy.depth() - last), 0.0041);
    last = proxy.depth();
  }
  EXPECT_NEAR(proxy.depth(), 0.01, 1e-4);
  EXPECT_NEAR(proxy.surface().position.y, -0.02, 1e-6);
}

TEST(Proxy, IsCaughtByASurfaceThatRisesPastARestingCursor) {
  const auto mesh = plane_shell(4, 8);
  const auto level = [&](double height) { return displaced(mesh, [=](Vec3d) { return 0.5 + height / 0.2; }); };
  Proxy proxy;
  EXPECT_FALSE(proxy.step(*level(0), {0.4, 0.01, 0.45}, {.share = 0.1}));
  EXPECT_TRUE(proxy.step(*level(0.03), {0.4, 0.01, 0.45}, {.share = 0.1}));
  EXPECT_LT(proxy.depth(), 0.003) << "from nothing";
  for (int k = 0; k < 100; ++k) ASSERT_TRUE(proxy.step(*level(0.03), {0.4, 0.01, 0.45}, {.share = 0.1}));
  EXPECT_NEAR(proxy.depth(), 0.02, 1e-4);
}

TEST(Proxy, OtherSlabsUnderItAreReported) {
  const SnapshotPtr one = displaced(sphere_shell(2, 8), [](Vec3d) { return 0.5; });
  const SnapshotPtr two = displaced(sphere_shell(2, 8, 0.7, 1.3), [](Vec3d) { return 0.5; });
  Proxy proxy;
  static_cast<void>(proxy.step(*one, {0, 0, 1.1}, {}));
  ASSERT_TRUE(proxy.step(*one, {0, 0, 0.9}, {}));
  EXPECT_FALSE(proxy.step(*two, {0, 0, 0.9}, {}));
  EXPECT_TRUE(proxy.lost());
}

TEST(Proxy, WithoutItsNormalsItGoesTheSameWay) {
  const SnapshotPtr model = bumpy_torus();
  Proxy all, bare;
  testing::WanderingHand wandering;
  int held = 0;
  for (int k = 0; k < 5000; ++k) {
    const Vec3d hand = wandering.next();
    all.step(*model, hand, {});
    bare.step(*model, hand, {}, Proxy::Look::Here, Proxy::Tell::WayOut);
    ASSERT_EQ(all.held(), bare.held()) << k;
    if (!all.held()) continue;
    ++held;
    ASSERT_EQ(all.depth(), bare.depth());
    ASSERT_EQ(all.way_out(), bare.way_out());
    ASSERT_EQ(all.surface().position, bare.surface().position);
    if (k % 7 == 0) {
      ASSERT_EQ(all.surface().normal, bare.told_surface(*model).normal);
    }
  }
  EXPECT_GT(held, 500);
}

TEST(Proxy, SetsOffFromAPlaceInTheOpenOrOneThatTheSurfaceHasRisenPast) {
  const auto mesh = plane_shell(4, 8);
  const auto level = [&](double height) { return displaced(mesh, [=](Vec3d) { return 0.5 + height / 0.2; }); };
  const SnapshotPtr low = level(0), high = level(0.03);
  Proxy proxy;
  proxy.start(*mesh, {0.4, 0.01, 0.45});
  EXPECT_TRUE(proxy.step(*low, {0.4, -0.02, 0.45}, {}));
  EXPECT_NEAR(proxy.depth(), 0.02, 1e-6);
  LocateHint hint;
  const auto below = probe(*high, {0.4, 0.01, 0.45}, hint);
  ASSERT_TRUE(below && below->touching());
  proxy.start(*mesh, {0.4, 0.01, 0.45}, below->at);
  EXPECT_TRUE(proxy.step(*high, {0.4, 0.01, 0.45}, {.share = 0.1}));
  EXPECT_NEAR(proxy.rise(), 0.02, 1e-6);
  EXPECT_LT(proxy.depth(), 0.003) << "taken over little by little";
}

}  // namespace
}  // namespace relief
