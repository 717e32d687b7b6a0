#include "support/shells.h"

#include <relief/core/query.h>
#include <relief/core/tessellate.h>

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>
#include <tuple>

namespace relief {
namespace {

using testing::displaced;
using testing::mixed_shell;
using testing::plane_shell;
using testing::sphere_shell;
using testing::torus_shell;
using testing::with_hole;

using Side = std::pair<std::uint32_t, std::uint32_t>;

/// Each side of a triangle, and how many triangles have it in this direction.
std::map<Side, int> sides_of(const Tessellation& t) {
  std::map<Side, int> sides;
  for (const auto& [a, b, c] : t.triangles)
    for (const Side& side : {Side{a, b}, {b, c}, {c, a}}) ++sides[side];
  return sides;
}

/// Sides without a partner that runs the other way; each direction may occur once.
std::size_t open_sides(const Tessellation& t) {
  const auto sides = sides_of(t);
  std::size_t open = 0;
  for (const auto& [side, count] : sides) {
    EXPECT_EQ(count, 1);
    open += sides.contains({side.second, side.first}) ? 0 : 1;
  }
  return open;
}

bool every_vertex_is_used_once(const Tessellation& t) {
  std::vector<bool> used(t.positions.size());
  for (const auto& triangle : t.triangles)
    for (const std::uint32_t v : triangle) used[v] = true;
  std::set<std::array<double, 3>> places;
  for (const Vec3d p : t.positions) places.insert({p.x, p.y, p.z});
  return std::ranges::find(used, false) == used.end() && places.size() == t.positions.size();
}

TEST(Tessellate, IsAClosedManifoldWithoutDuplicateVertices) {
  const SnapshotPtr model = displaced(sphere_shell(2, 8), [](Vec3d p) { return 0.5 + 0.3 * p.x; });
  for (int level = 0; level < level_count(8); ++level) {
    const Tessellation t = tessellate(*model, level);
    const std::size_t n = 8U >> static_cast<unsigned>(level);
    EXPECT_EQ(t.triangles.size(), 128 * n * n);
    EXPECT_EQ(t.positions.size(), 2 + t.triangles.size() / 2) << "Euler's count of a sphere";
    EXPECT_EQ(open_sides(t), 0U);
    double volume = 0;
    for (const auto& [a, b, c] : t.triangles) volume += dot(t.positions[a], cross(t.positions[b], t.positions[c])) / 6;
    EXPECT_GT(volume, 0) << "triangles look inwards";
  }
}

/// Stitching a grid with any coarser edges: the border is that of the coarser edges, and no triangle turns over.
TEST(Tessellate, StitchedGridsCoverTheTriangleOnce) {
  for (const int n : {1, 2, 4, 8, 12, 16})
    for (int a = n;; a /= 2) {
      for (int b = n;; b /= 2) {
        for (int c = n;; c /= 2) {
          const std::array<int, 3> edges = {a, b, c};
          std::map<std::pair<std::size_t, std::size_t>, int> sides;
          int area = 0;
          for_each_cell(n, edges, [&](const std::array<GridPoint, 3>& cell) {
            const GridPoint p = cell[0], q = cell[1], r = cell[2];
            const int twice = (q.i - p.i) * (r.j - p.j) - (q.j - p.j) * (r.i - p.i);
            EXPECT_GT(twice, 0) << "turned over or without area";
            area += twice;
            for (std::size_t k = 0; k < 3; ++k) ++sides[{sample_index(n, cell[k]), sample_index(n, cell[(k + 1) % 3])}];
          });
          EXPECT_EQ(area, n * n) << n << ": " << a << ' ' << b << ' ' << c;
          int border = 0;
          for (const auto& [side, count] : sides) {
            EXPECT_EQ(count, 1);
            border += sides.contains({side.second, side.first}) ? 0 : 1;
          }
          EXPECT_EQ(border, a + b + c);
          if (c % 2 != 0) break;
        }
        if (b % 2 != 0) break;
      }
      if (a % 2 != 0) break;
    }
}

TEST(Tessellate, IsClosedWhereNDiffersAtEveryLevel) {
  const auto bumps = [](Vec3d p) { return 0.5 + 0.2 * std::sin(9 * p.x + 4 * p.y) * std::cos(7 * p.z); };
  for (const auto& [like, odd, handles] :
       {std::tuple{sphere_shell(2, 1), 1, 0}, {sphere_shell(1, 1), 3, 0}, {torus_shell(12, 8, 1), 1, 1}}) {
    const SnapshotPtr model = displaced(mixed_shell(*like, odd, 4), bumps);
    ASSERT_TRUE(validate(*model));
    const int levels = level_count(model->slab_mesh());
    EXPECT_EQ(levels, 5);
    for (int level = 0; level < levels; ++level) {
      const Tessellation t = tessellate(*model, level);
      EXPECT_EQ(open_sides(t), 0U);
      EXPECT_TRUE(every_vertex_is_used_once(t));
      EXPECT_EQ(t.positions.size() + 2 * static_cast<std::size_t>(handles), 2 + t.triangles.size() / 2)
          << "Euler's count";
      for (const auto& [a, b, c] : t.triangles)
        EXPECT_GT(length(cross(t.positions[b] - t.positions[a], t.positions[c] - t.positions[a])), 0);
    }
    EXPECT_EQ(tessellate(*model, levels - 1).triangles.size(),
              static_cast<std::size_t>(odd * odd) * model->slab_mesh().slab_count());
  }
}

TEST(Tessellate, LeavesHolesOut) {
  const auto flat = [](Vec3d) { return 0.5; };
  const auto in_hole = [](Vec3d p) { return p.y > 0.7; };
  for (const int most : {0, 3}) {
    const SnapshotPtr whole = displaced(mixed_shell(*sphere_shell(2, 1), most == 0 ? 8 : 1, most), flat);
    const SnapshotPtr model = with_hole(whole, in_hole);
    ASSERT_TRUE(validate(*model));
    for (int level = 0; level < level_count(whole->slab_mesh()) - 1; ++level) {
      const Tessellation full = tessellate(*whole, level), open = tessellate(*model, level);
      EXPECT_TRUE(every_vertex_is_used_once(open));
      EXPECT_GT(open_sides(open), 0U);
      // Kept: the triangles with two corners below the rim, give or take samples near it.
      const auto below = [&](const auto& triangle, double y) {
        int count = 0;
        for (const std::uint32_t v : triangle) count += full.positions[v].y < y ? 1 : 0;
        return count >= 2;
      };
      const auto lower = std::ranges::count_if(full.triangles, [&](const auto& t) { return below(t, 0.68); });
      const auto upper = std::ranges::count_if(full.triangles, [&](const auto& t) { return below(t, 0.72); });
      EXPECT_LE(static_cast<std::size_t>(lower), open.triangles.size());
      EXPECT_GE(static_cast<std::size_t>(upper), open.triangles.size());
    }
  }
  const SnapshotPtr nothing = with_hole(displaced(sphere_shell(1, 4), flat), [](Vec3d) { return true; });
  EXPECT_TRUE(tessellate(*nothing).triangles.empty());
  EXPECT_TRUE(tessellate(*nothing).positions.empty());
}

TEST(Tessellate, CoarseLevelsAreSubsetsOfTheSamples) {
  const SnapshotPtr model = displaced(plane_shell(2, 12), [](Vec3d p) { return p.x * p.z; });
  EXPECT_EQ(level_count(12), 3);
  EXPECT_EQ(level_count(15), 1);
  EXPECT_EQ(level_count(32), 6);
  const Tessellation fine = tessellate(*model, 0), coarse = tessellate(*model, 2);
  for (const Vec3d p : coarse.positions) EXPECT_NE(std::ranges::find(fine.positions, p), fine.positions.end());
}

}  // namespace
}  // namespace relief
