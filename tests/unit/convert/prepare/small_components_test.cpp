#include "../shapes.h"

#include <relief/convert/prepare/small_components.h>

#include <gtest/gtest.h>

namespace relief {
namespace {

using namespace detail;
using testing::append;

/// Balls of the radii 1, 0.1, 0.5 side by side.
TriangleMesh three_balls() {
  TriangleMesh mesh = testing::ball(6);
  append(mesh, testing::ball(6), {3, 0, 0}, 0.1);
  append(mesh, testing::ball(6), {6, 0, 0}, 0.5);
  return mesh;
}

TEST(SmallComponents, TheLeastAreaGoesFirst) {
  const TriangleMesh mesh = three_balls();
  const std::size_t each = mesh.triangles.size() / 3;
  for (const auto& [most, dropped] : {std::pair(12, 0), std::pair(11, 1), std::pair(8, 1), std::pair(7, 2)}) {
    std::vector<Face> faces = mesh.triangles;
    EXPECT_EQ(drop_small_components(mesh.positions, faces, std::size_t(most)), std::size_t(dropped)) << most;
    EXPECT_EQ(faces.size(), (3 - std::size_t(dropped)) * each);
    for (const Face& f : faces) {
      const double x = mesh.positions[f[0]].x;
      EXPECT_FALSE(dropped > 0 && x > 2 && x < 4) << "the smallest";
      EXPECT_FALSE(dropped > 1 && x > 4) << "the next";
    }
  }
}

TEST(SmallComponents, OneStaysHoweverFewSlabsThereMayBe) {
  const TriangleMesh mesh = three_balls();
  std::vector<Face> faces = mesh.triangles;
  EXPECT_EQ(drop_small_components(mesh.positions, faces, 1), 2U);
  EXPECT_EQ(find_components(mesh.positions.size(), faces).count, 1U);
}

TEST(SmallComponents, AreLeftOutByNumber) {
  const TriangleMesh mesh = three_balls();
  const Components components = find_components(mesh.positions.size(), mesh.triangles);
  const std::vector<std::uint32_t> gone = {0, 2};
  const TriangleMesh rest = without_components(mesh, components, gone);
  EXPECT_EQ(rest.positions, mesh.positions);
  EXPECT_EQ(rest.triangles.size(), mesh.triangles.size() / 3);
  for (const Triangle& t : rest.triangles) EXPECT_NEAR(rest.positions[t[0]].x, 3, 0.2);
}

}  // namespace
}  // namespace relief
