#include "support/shells.h"

#include <relief/core/query.h>
#include <relief/core/tessellate.h>

#include <gtest/gtest.h>

#include <map>

namespace relief {
namespace {

using testing::displaced;
using testing::plane_shell;
using testing::sphere_shell;

TEST(Tessellate, IsAClosedManifoldWithoutDuplicateVertices) {
  const SnapshotPtr model = displaced(sphere_shell(2, 8), [](Vec3d p) { return 0.5 + 0.3 * p.x; });
  for (int level = 0; level < level_count(8); ++level) {
    const Tessellation t = tessellate(*model, level);
    const std::size_t n = 8U >> static_cast<unsigned>(level);
    EXPECT_EQ(t.triangles.size(), 128 * n * n);
    EXPECT_EQ(t.positions.size(), 2 + t.triangles.size() / 2) << "Euler's count of a sphere";
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;
    for (const auto& [a, b, c] : t.triangles)
      for (const auto& side : {std::pair{a, b}, {b, c}, {c, a}}) ++sides[side];
    for (const auto& [side, count] : sides) {
      EXPECT_EQ(count, 1);
      EXPECT_TRUE(sides.contains({side.second, side.first}));
    }
    double volume = 0;
    for (const auto& [a, b, c] : t.triangles) volume += dot(t.positions[a], cross(t.positions[b], t.positions[c])) / 6;
    EXPECT_GT(volume, 0) << "triangles look inwards";
  }
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
