// What is cut out and closed must be closed again, whatever is bad.
#include <relief/convert/prepare/patching.h>

#include <gtest/gtest.h>
#include <unit/convert/shell/shell_support.h>

#include <algorithm>
#include <random>

namespace relief::detail {
namespace {

struct Cut {
  SourceIndex source;
  Rings rings;
  std::vector<std::uint8_t> patch, heat;

  explicit Cut(const TriangleMesh& mesh) : Cut(LatticeMesh(mesh)) {}
  explicit Cut(const LatticeMesh& mesh)
      : source(mesh.points, mesh.faces),
        rings(source.faces, source.points.size()),
        patch(source.faces.size(), 0),
        heat(source.points.size(), 0) {}
  [[nodiscard]] CutRegion region(const std::vector<std::uint32_t>& bad, std::size_t around) const {
    return {source, rings, patch, bad, around, heat};
  }
};

TEST(CutRegion, HasTheRingsAroundABadFace) {
  const Cut cut(testing::bent_grid(12, 12, true, true, [](double u, double v) {
    const double a = 2 * std::numbers::pi * u, b = 2 * std::numbers::pi * v;
    return Vec3d{(2 + std::cos(b)) * std::cos(a), (2 + std::cos(b)) * std::sin(a), std::sin(b)};
  }));
  const std::uint32_t bad = 40;
  // Six triangles meet in each point: a ring has 12 more than its edges.
  EXPECT_EQ(cut.region({bad}, 0).faces(), std::vector{bad});
  const CutRegion one = cut.region({bad}, 1);
  EXPECT_EQ(one.faces().size(), 13U);
  for (std::uint32_t f = 0; f < cut.source.faces.size(); ++f)
    EXPECT_EQ(one.has(f), share_a_corner(cut.source.faces[f], cut.source.faces[bad])) << f;
  Box3d box;
  for (const std::uint32_t f : one.faces())
    for (const std::uint32_t v : cut.source.faces[f]) box.add(to_double(cut.source.points[v]));
  EXPECT_NEAR(one.widest().diagonal, length(box.extent()), 1e-6);
  EXPECT_LT(length(to_double(one.widest().middle) - box.centre()), 1);
  for (const std::uint32_t h : one.boundary()) {
    EXPECT_FALSE(one.has(h / 3));
    EXPECT_TRUE(one.has(cut.rings.twins[h] / 3));
  }
}

TEST(CutRegion, LeavesNoPieceThatIsPatchesAlone) {
  Cut cut(testing::ball(24));
  const auto height = [&](std::uint32_t f) {
    double sum = 0;
    for (const LatticePoint p : cut.source.corners(f)) sum += p.z / 3.0;
    return sum;
  };
  double low = 1e9, high = 0;
  for (const LatticePoint p : cut.source.points) {
    low = std::min(low, double(p.z));
    high = std::max(high, double(p.z));
  }
  const double belt = low + 0.5 * (high - low), cap = low + 0.7 * (high - low);
  std::vector<std::uint32_t> bad, above;
  for (std::uint32_t f = 0; f < cut.source.faces.size(); ++f) {
    if (height(f) > cap) above.push_back(f);
    if (height(f) > belt && height(f) <= cap) bad.push_back(f);
  }
  ASSERT_GT(above.size(), 100U) << "no mere crumb";
  const auto cut_above = [&] {
    const CutRegion region = cut.region(bad, 0);
    return std::ranges::count_if(above, [&](std::uint32_t f) { return region.has(f); });
  };
  EXPECT_EQ(cut_above(), 0);
  for (const std::uint32_t f : above) cut.patch[f] = 1;
  EXPECT_EQ(cut_above(), std::ssize(above));
  // One that was scanned is enough, also where the search begins with it.
  for (const std::uint32_t h : cut.region(bad, 0).boundary()) EXPECT_LT(height(h / 3), cap) << "all above is gone";
  std::uint32_t first = kNone;
  for (const std::uint32_t f : above)
    for (std::uint32_t h = 3 * f; h < 3 * f + 3; ++h)
      if (std::ranges::count(bad, cut.rings.twins[h] / 3) > 0) first = std::min(first, f);
  for (const std::uint32_t scanned : {first, above[above.size() / 2]}) {
    cut.patch[scanned] = 0;
    EXPECT_EQ(cut_above(), 0);
    cut.patch[scanned] = 1;
  }
}

TEST(Patching, ClosesWhateverIsCutOut) {
  std::mt19937 random(4);
  for (int round = 0; round < 30; ++round) {
    SCOPED_TRACE(round);
    const Cut cut(round % 2 == 0 ? testing::ball(12, 0.1) : testing::torus(24, 14));
    std::vector<std::uint32_t> bad;
    for (int k = 0; k < 1 + round / 3; ++k)
      bad.push_back(static_cast<std::uint32_t>(random() % cut.source.faces.size()));
    const CutRegion region = cut.region(bad, static_cast<std::size_t>(round % 3));
    for (const std::uint32_t f : bad) EXPECT_TRUE(region.has(f));
    const auto patches = close_with_patches(cut.source, cut.rings, region);
    ASSERT_TRUE(patches);
    std::vector<Face> faces = patches->faces;
    for (std::uint32_t f = 0; f < cut.source.faces.size(); ++f)
      if (!region.has(f)) faces.push_back(cut.source.faces[f]);
    EXPECT_TRUE(recount(faces).is_manifold);
    EXPECT_EQ(patches->begins.size(), patches->loops.size() + 1);
    EXPECT_EQ(patches->begins.back(), patches->faces.size());
    EXPECT_TRUE(std::ranges::is_sorted(patches->edges));
    EXPECT_EQ(patches->edges.size(), region.boundary().size());
  }
}

}  // namespace
}  // namespace relief::detail
