#include "../shapes.h"

#include <relief/convert/convert.h>
#include <relief/convert/sample/coverage.h>
#include <relief/convert/sample/distance.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace relief {
namespace {

using namespace detail;

constexpr double kReach = 0.01;  // of the diagonal

/// A model of the unit box, and what places are held against it.
struct BoxModel {
  Conversion made;
  double diagonal;
  Lattice lattice;
  MeasuredSurface surface;
  SourceRays rays;

  explicit BoxModel(Conversion&& conversion)
      : made(std::move(conversion)),
        diagonal(made.model.info.source_diagonal),
        lattice(Lattice::around(bounds(made.mended), diagonal)),
        surface(*made.model.head, lattice, {}),
        rays(made.mended.positions, made.mended.triangles, lattice) {}

  [[nodiscard]] bool answers(const SourcePlace& place, double moved = 0) const {
    LocateHint hint;
    return surface.answers({place.at, place.normal * (kReach * diagonal)}, rays, moved, hint);
  }
  [[nodiscard]] ConvertReport::Coverage coverage_of(const TriangleMesh& source) const {
    const auto is_missing = [this](const SourcePlace& place, double) { return !answers(place); };
    return measure_coverage(places_of(source), {made.mended, rays, lattice, diagonal, is_missing}, {});
  }
};

BoxModel box_model() { return BoxModel(std::move(*convert(testing::box({1, 1, 1}), {.slabs = 12, .intervals = 8}))); }

// Fins that stand on a face: of five with a height of a tenth, 0.5 / 6.5 of the area is missing. The places at their
// feet lie near the box, but the box is not what is seen there: a distance would not count a sixth of them.
TEST(Coverage, WhatIsMissingIsToldByItsShareOfTheArea) {
  const BoxModel model = box_model();
  TriangleMesh source = testing::box({1, 1, 1});
  EXPECT_EQ(model.coverage_of(source).missed, 0U);
  const Box3d box = bounds(source);
  for (int k = 0; k < 5; ++k) {
    const double x = box.low.x + 0.2 + 0.15 * k, z = box.high.z;
    const auto first = static_cast<std::uint32_t>(source.positions.size());
    for (const Vec3d p :
         {Vec3d{x, box.low.y, z}, Vec3d{x, box.high.y, z}, Vec3d{x, box.high.y, z + 0.1}, Vec3d{x, box.low.y, z + 0.1}})
      source.positions.push_back(p);
    source.triangles.push_back({first, first + 1, first + 2});
    source.triangles.push_back({first, first + 2, first + 3});
  }
  const ConvertReport::Coverage coverage = model.coverage_of(source);
  EXPECT_NEAR(1 - coverage.share, 0.5 / 6.5, 0.001);
  EXPECT_EQ(coverage.share, 1 - double(coverage.missed) / double(coverage.places));
  EXPECT_GT(coverage.missing_near.z, box.high.z);
}

TEST(Coverage, APlaceIsAnsweredAlongItsNormalWithinReachOrWhereVerticesWereMoved) {
  const BoxModel model = box_model();
  const Box3d box = bounds(model.made.mended);
  const Vec3d top = {box.centre().x, box.centre().y, box.high.z};
  const double reach = kReach * model.diagonal;
  // High above all slabs nothing holds the place, and along x nothing is met.
  const Vec3d up = {0, 0, 1}, aside = {1, 0, 0};
  for (const double side : {-1.0, 1.0}) {
    EXPECT_TRUE(model.answers({top + up * (side * 0.9 * reach), up}));
    EXPECT_TRUE(model.answers({top + up * (side * 0.9 * reach), up * -1.0}));
    EXPECT_FALSE(model.answers({top + up * (side * 1.1 * reach), up}));
  }
  // Beside the box, in no slab.
  const Vec3d beside = {box.high.x + 3, box.centre().y, box.high.z - 0.5 * reach};
  EXPECT_FALSE(model.answers({beside, up}));
  EXPECT_FALSE(model.answers({top + up * (1.1 * reach), aside}));
  EXPECT_TRUE(model.answers({top + up * (1.1 * reach), aside}, 1.2 * reach));
}

}  // namespace
}  // namespace relief
