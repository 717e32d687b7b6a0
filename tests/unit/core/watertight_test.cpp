// Rays through stored samples, edges, corners and borders: none passes the surface, from wherever it comes. Beside all
// micro-triangles, one after another, in exact numbers.
#include "exact_lines.h"
#include "support/shells.h"

#include <relief/base/cpu_time.h>
#include <relief/convert/convert.h>
#include <relief/core/sweep.h>
#include <relief/mesh/samples.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <random>
#include <string>
#include <vector>

namespace relief {
namespace {

using testing::displaced;
using testing::ExactTriangles;

/// Where on the surface a line is sent through.
enum class Aim { Sample, MicroEdge, SlabEdge, SlabCorner };
constexpr std::array kAims = {Aim::Sample, Aim::MicroEdge, Aim::SlabEdge, Aim::SlabCorner};
constexpr std::array<const char*, 4> kNames = {"samples", "edges", "edges of slabs", "corners of slabs"};

class Lines {
 public:
  explicit Lines(const Snapshot& model) : model_(model), mesh_(model.slab_mesh()) {}

  struct Line {
    Vec3d through, way;  ///< `way`: along the fibre there, outwards, of its length
  };
  Line next(Aim aim) {
    const auto slab = static_cast<SlabId>(random_() % mesh_.slab_count());
    const int n = mesh_.intervals(slab);
    const std::array<GridPoint, 3> corners = {GridPoint{0, 0}, {n, 0}, {0, n}};
    switch (aim) {
      case Aim::Sample:
        return at(slab, stitched(slab, any_sample(n)));
      case Aim::SlabCorner:
        return at(slab, corners[random_() % 3]);
      case Aim::SlabEdge:
        return on_edge(slab);
      case Aim::MicroEdge:
        break;
    }
    GridPoint a, b;
    do {
      a = any_sample(n);
      constexpr std::array<GridPoint, 6> kSteps = {{{1, 0}, {0, 1}, {-1, 1}, {-1, 0}, {0, -1}, {1, -1}}};
      b = a + kSteps[random_() % 6];
    } while (b.i < 0 || b.j < 0 || b.i + b.j > n || stitched(slab, a) == stitched(slab, b));
    return between(at(slab, stitched(slab, a)), at(slab, stitched(slab, b)));
  }
  double unit() { return std::uniform_real_distribution<double>(0, 1)(random_); }
  Vec3d anywhere() { return normalized(Vec3d{normal_(random_), normal_(random_), normal_(random_)}); }

 private:
  GridPoint any_sample(int n) {
    int i = static_cast<int>(random_() % static_cast<unsigned>(n + 1)),
        j = static_cast<int>(random_() % static_cast<unsigned>(n + 1));
    if (i + j > n) {
      i = n - i;
      j = n - j;
    }
    return {i, j};
  }
  /// The sample that stands for this one in triangles.
  [[nodiscard]] GridPoint stitched(SlabId slab, GridPoint p) const {
    return edge_place(mesh_.intervals(slab), mesh_.edge_intervals(slab), p).nearer();
  }
  [[nodiscard]] Line at(SlabId slab, GridPoint p) const {
    const int n = mesh_.intervals(slab);
    return {sample_position(model_, slab, p),
            sample_position(mesh_, slab, n, p, 1) - sample_position(mesh_, slab, n, p, 0)};
  }
  /// On the straight line between two samples that are joined by an edge.
  Line between(const Line& a, const Line& b) {
    const double share = unit();
    return {a.through * (1 - share) + b.through * share, a.way * (1 - share) + b.way * share};
  }
  /// On the border of a slab, between two samples that both its sides share.
  Line on_edge(SlabId slab) {
    const std::size_t edge = random_() % 3;
    const int n = mesh_.intervals(slab), shared = mesh_.edge_intervals(slab)[edge], step = n / shared;
    const int k = static_cast<int>(random_() % static_cast<unsigned>(shared)) * step;
    return between(at(slab, edge_point(n, static_cast<int>(edge), k)),
                   at(slab, edge_point(n, static_cast<int>(edge), k + step)));
  }

  const Snapshot& model_;
  const SlabMesh& mesh_;
  std::mt19937 random_{34};
  std::normal_distribution<double> normal_;
};

/// What became of lines.
struct Found {
  int lines = 0, passed = 0, outlines = 0;
  std::string first;
};

/// Sends lines through the surface from both sides, from near and from far, along the fibres and aslant, and compares
/// where they first cross it with what the exact triangles say.
void send(const Snapshot& model, const std::string& title, int lines_each) {
  const ExactTriangles exact(model);
  const double size = diagonal(model.slab_mesh().bounds()), hair = 1e-10 * size;
  MicroTriangles surface(model);
  for (const Aim aim : kAims) {
    Lines lines(model);
    Found found;
    for (int k = 0; k < lines_each; ++k) {
      const auto [through, fibre] = lines.next(aim);
      const double tilt = k % 2 == 0 ? 0 : 0.7 * lines.unit();
      const Vec3d way = normalized(fibre) + lines.anywhere() * tilt;
      for (const double side : {1.0, -1.0})
        for (const double far : {0.3 * length(fibre), 2 * size, 1000 * size}) {
          const Vec3d from = through + way * (side * far), to = through - way * (side * 0.3 * length(fibre));
          const auto all = exact.meetings(from, to, hair);
          ++found.lines;
          // Along an outline rounding decides whether the line meets it.
          const Vec3d first_place = all.empty() ? through : from + (to - from) * all.front().share;
          if (exact.is_outline(through, to - from, hair) || exact.is_outline(first_place, to - from, hair)) {
            ++found.outlines;
            continue;
          }
          ASSERT_FALSE(all.empty()) << title << " " << k;
          const bool in = all.front().in > 0;
          const auto hit = raycast(model, {from, (to - from) * (3 / far)});
          Sweep sweep(surface, from, to, in ? Crossing::In : Crossing::Out);
          const auto crossed = sweep.run();
          // A thousand diagonals away a place is a number of rounding error 1e-13 of the diagonal.
          const auto is_there = [&](Vec3d place) { return length(place - first_place) <= 1e-9 * size; };
          if (hit && is_there(hit->point.position) && crossed && is_there(crossed->position) &&
              std::abs(hit->distance * 3 / far - all.front().share) * length(to - from) <= 1e-9 * size)
            continue;
          ++found.passed;
          if (found.first.empty())
            found.first = "line " + std::to_string(k) + ", side " + std::to_string(side) + ", from " +
                          std::to_string(far / size) + " diagonals";
        }
    }
    const auto name = static_cast<std::size_t>(aim);
    std::printf("%s, %s: %d lines over %zu triangles, %d passed, %d along outlines\n", title.c_str(), kNames[name],
                found.lines, exact.size(), found.passed, found.outlines);
    EXPECT_EQ(found.passed, 0) << title << ", " << kNames[name] << ": " << found.first;
    EXPECT_LT(found.outlines, found.lines / 10);
  }
}

double rough(Vec3d p) { return 0.5 + 0.2 * std::sin(9 * p.x) * std::cos(8 * p.z) + 0.1 * std::sin(31 * p.y); }

TEST(Watertight, Spheres) {
  send(*displaced(testing::sphere_shell(2, 16), [](Vec3d p) { return (1 / length(p) - 0.8) / 0.4; }), "sphere", 400);
  send(*displaced(testing::sphere_shell(1, 15), [](Vec3d) { return 0.5; }), "sphere of n = 15", 400);
  send(*displaced(testing::sphere_shell(2, 16, 0.8e-3, 1.2e-3, {1e3, -2e3, 5e2}), [](Vec3d) { return 0.5; }),
       "small sphere far from the origin", 100);
}

TEST(Watertight, TwistedSlabsAndBordersOfDifferentN) {
  send(*displaced(testing::torus_shell(14, 9, 13, 0.3), rough), "rough torus", 400);
  send(*displaced(testing::mixed_shell(*testing::torus_shell(12, 8, 13), 3, 3), rough), "torus of different n", 400);
  send(*displaced(testing::mixed_shell(*testing::sphere_shell(1, 1), 1, 5), rough), "sphere of n from 1 to 32", 400);
}

TEST(Watertight, AConvertedPumpkin) {
  const auto source = make_sample("pumpkin", 30'000);
  ASSERT_TRUE(source);
  for (const int n : {0, 16}) {
    const auto made = convert(*source, {.slabs = 100, .intervals = n});
    ASSERT_TRUE(made) << made.error().message;
    const Snapshot& model = *made->model.head;
    send(model, n == 0 ? "pumpkin" : "pumpkin of n = 16", 400);
  }
}

/// Only shown: on a machine that does other things besides, times prove nothing.
TEST(Watertight, WhatARayCosts) {
  const auto cost = [](const Snapshot& model, const std::string& title) {
    const double size = diagonal(model.slab_mesh().bounds());
    Lines lines(model);
    std::vector<double> times;
    for (int k = 0; k < 2000; ++k) {
      const auto [through, fibre] = lines.next(kAims[static_cast<std::size_t>(k) % kAims.size()]);
      const Vec3d way = normalized(normalized(fibre) + lines.anywhere() * 0.7);
      const std::uint64_t begin = thread_cpu_ns();
      const auto hit = raycast(model, {through + way * size, -way});
      times.push_back(static_cast<double>(thread_cpu_ns() - begin) * 1e-3);
      EXPECT_TRUE(hit);
    }
    std::ranges::sort(times);
    std::printf("a ray through %s: median %.1f us, p99 %.1f us, most %.1f us\n", title.c_str(), times[times.size() / 2],
                times[times.size() * 99 / 100], times.back());
  };
  for (const int n : {16, 128}) {
    const auto mesh = testing::torus_shell(16, 10, n);
    cost(*displaced(mesh, rough), "a torus of n = " + std::to_string(n));
    cost(*displaced(mesh, [](Vec3d p) { return rough(p) + 0.1 * std::sin(900 * p.x + 700 * p.z); }),
         "a rough one of n = " + std::to_string(n));
  }
  for (const int most : {2, 3, 7}) {
    const int least = 128 >> most;
    cost(*displaced(testing::mixed_shell(*testing::torus_shell(16, 10, 1), least, most), rough),
         "a torus of n from " + std::to_string(least) + " to 128");
  }
  const auto source = make_sample("pumpkin", 30'000);
  ASSERT_TRUE(source);
  const auto made = convert(*source, {});
  ASSERT_TRUE(made) << made.error().message;
  cost(*made->model.head, "a converted pumpkin");
}

}  // namespace
}  // namespace relief
