// The displaced surface as triangles: each place of them is the place of the slab that it names.
#include "room_support.h"

#include <relief/convert/room/old_surface.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

namespace relief::detail {
namespace {

struct Whole {
  SnapshotPtr model;
  std::vector<SlabId> slabs;
  Lattice lattice;
  OldSurface surface;

  explicit Whole(SnapshotPtr ball, std::size_t step = 1)
      : model(std::move(ball)),
        slabs(every(model->slab_mesh().slab_count(), step)),
        lattice(Lattice::around({{-1.5, -1.5, -1.5}, {1.5, 1.5, 1.5}}, 0)),
        surface(*model, slabs, lattice) {}
  static std::vector<SlabId> every(std::size_t count, std::size_t step) {
    std::vector<SlabId> slabs;
    for (std::size_t s = 0; s < count; s += step) slabs.push_back(static_cast<SlabId>(s));
    return slabs;
  }
};

/// The samples of a slab that a place lies between, weighed as they are drawn.
Vec3d point_at(const Snapshot& model, const SlabPlace& place) {
  const int n = model.slab_mesh().intervals(place.slab);
  const SampleField field = model.slab_mesh().field(place.slab);
  const double x = place.u * n, y = place.v * n;
  const auto at = [&](int i, int j) {
    return field.point(n, {i, j}, double{model.displacement(place.slab)[sample_index(n, {i, j})]});
  };
  int i = static_cast<int>(x), j = static_cast<int>(y);
  if (i + j >= n) (i > 0 ? i : j) -= 1;
  const double u = x - i, v = y - j;
  if (u + v <= 1) return at(i, j) * (1 - u - v) + at(i + 1, j) * u + at(i, j + 1) * v;
  return at(i + 1, j + 1) * (u + v - 1) + at(i + 1, j) * (1 - v) + at(i, j + 1) * (1 - u);
}

/// The place of a slab that a line from the middle of the ball meets, beside where it meets it; nothing where there is
/// no triangle.
struct Hit {
  std::size_t count = 0;
  std::uint32_t face = 0;
  SlabPlace place;
  Vec3d at;
};
Hit hit_along(const Whole& whole, Vec3d d) {
  Crossings found;
  const Vec3d from = whole.lattice.to_lattice({0, 0, 0}), to = whole.lattice.to_lattice(d * 1.3);
  whole.surface.rays().cross(from, to - from, 0, 1, found);
  if (found.count == 0) return {};
  const Crossing& c = found.all().front();
  return {found.count, c.triangle, whole.surface.place(c.triangle, c.weights), d * (1.3 * c.t)};
}

std::vector<Vec3d> directions(int count) {
  std::mt19937 random(2);
  std::normal_distribution<double> normal(0, 1);
  std::vector<Vec3d> all;
  for (int k = 0; k < count; ++k) all.push_back(normalized(Vec3d{normal(random), normal(random), normal(random)}));
  return all;
}

TEST(OldSurface, APlaceOfATriangleIsThatOfItsSlab) {
  const Whole whole(bumpy_ball(2, 8));
  std::set<SlabId> met;
  for (const Vec3d d : directions(500)) {
    const Hit hit = hit_along(whole, d);
    ASSERT_EQ(hit.count, 1U) << "stitched, lines pass no slit and meet nothing twice";
    EXPECT_LT(length(point_at(*whole.model, hit.place) - hit.at), 1e-6);
    EXPECT_GE(std::min({hit.place.u, hit.place.v, 1 - hit.place.u - hit.place.v}), -1e-9);
    met.insert(hit.place.slab);
  }
  EXPECT_GT(met.size(), 100U);
  EXPECT_EQ(whole.surface.phantom_from(), whole.model->slab_mesh().slab_count() * 8 * 8);
}

TEST(OldSurface, HasTheSlabsGivenAlone) {
  const Whole all(bumpy_ball(2, 8)), some(all.model, 3);
  std::size_t there = 0;
  for (const Vec3d d : directions(500)) {
    const Hit whole = hit_along(all, d), part = hit_along(some, d);
    ASSERT_EQ(part.count, whole.place.slab % 3 == 0 ? 1U : 0U);
    if (part.count == 0) continue;
    ++there;
    EXPECT_EQ(part.place.slab, whole.place.slab);
    EXPECT_LT(length(part.at - whole.at), 1e-9);
  }
  EXPECT_GT(there, 100U);
}

TEST(OldSurface, HolesComeLast) {
  const auto is_void = [](Vec3d p) { return p.z > 0.4; };
  const Whole whole(::relief::testing::with_hole(bumpy_ball(2, 8), is_void));
  const std::size_t all = whole.model->slab_mesh().slab_count() * 8 * 8;
  EXPECT_GT(whole.surface.phantom_from(), all / 2);
  EXPECT_LT(whole.surface.phantom_from(), all);
  for (const Vec3d d : directions(500)) {
    const Hit hit = hit_along(whole, d);
    ASSERT_EQ(hit.count, 1U) << "a hole is closed, too";
    if (std::abs(d.z - 0.4) > 0.1) {
      EXPECT_EQ(hit.face >= whole.surface.phantom_from(), is_void(d));
    }
    EXPECT_LT(length(point_at(*whole.model, hit.place) - hit.at), 1e-6);
  }
}

// Along an edge with different n the finer slab's samples lie on the coarser one's, whose triangles end there.
TEST(OldSurface, SlabsOfDifferentResolutionAreStitched) {
  const auto mixed = ::relief::testing::mixed_shell(*lattice_ball(2, 8), 4, 2);
  const Whole whole(::relief::testing::displaced(mixed, [](Vec3d p) { return 0.5 + 0.05 * std::sin(7 * p.x); }));
  std::set<int> met;
  for (const Vec3d d : directions(500)) {
    const Hit hit = hit_along(whole, d);
    ASSERT_EQ(hit.count, 1U);
    met.insert(whole.model->slab_mesh().intervals(hit.place.slab));
  }
  EXPECT_EQ(met.size(), 3U);
  // Triangles of different slabs around a fibre have its point in common.
  for (const FibreId f : {FibreId{0}, FibreId{1}, FibreId{2}, FibreId{3}}) {
    const Vec3d d = normalized(mixed->fibres()[f].outer), u = normalized(cross(d, Vec3d{0.3, 0.5, 0.8}));
    std::set<SlabId> slabs;
    std::vector<std::uint32_t> faces;
    for (int k = 0; k < 24; ++k) {
      const double a = 0.26 * k + 0.1;
      const Hit hit = hit_along(whole, normalized(d + (u * std::cos(a) + cross(d, u) * std::sin(a)) * 1e-3));
      if (slabs.insert(hit.place.slab).second) faces.push_back(hit.face);
    }
    ASSERT_GE(slabs.size(), 4U);
    for (const std::uint32_t face : faces) EXPECT_TRUE(whole.surface.rays().share_a_point(faces[0], face));
  }
}

}  // namespace
}  // namespace relief::detail
