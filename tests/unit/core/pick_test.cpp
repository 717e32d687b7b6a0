// Picks: the nearest point beside all triangles, and that a hint changes no bit of any answer.
#include "support/shells.h"

#include <relief/base/triangle.h>
#include <relief/core/near_surface.h>
#include <relief/core/query.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <utility>
#include <vector>

namespace relief {
namespace {

using testing::displaced;
using testing::mixed_shell;
using testing::sphere_shell;
using testing::torus_shell;
using testing::with_hole;

double rough(Vec3d p) { return 0.5 + 0.2 * std::sin(9 * p.x) * std::cos(8 * p.z) + 0.1 * std::sin(31 * p.y); }

struct Triangle {
  SlabId slab;
  std::array<Vec3d, 3> corners;
};

/// All triangles of the surface, slab by slab.
std::vector<Triangle> triangles_of(const Snapshot& model) {
  const SlabMesh& mesh = model.slab_mesh();
  std::vector<Triangle> all;
  for (SlabId slab = 0; slab < mesh.slab_count(); ++slab)
    for_each_cell(mesh.intervals(slab), mesh.edge_intervals(slab), [&](const std::array<GridPoint, 3>& cell) {
      if (model.has(Layer::Void) && model.is_hole(slab, cell)) return;
      all.push_back({slab,
                     {sample_position(model, slab, cell[0]), sample_position(model, slab, cell[1]),
                      sample_position(model, slab, cell[2])}});
    });
  return all;
}

/// The nearest point, from one triangle after another.
struct Truth {
  SlabId slab = kNoSlab;
  double distance2 = std::numeric_limits<double>::infinity();
  Vec3d position;

  Truth(const std::vector<Triangle>& all, Vec3d p) {
    for (const auto& [s, corners] : all) {
      const auto& [a, b, c] = corners;
      const auto w = nearest_in_triangle(p, a, b, c);
      const Vec3d at = a * w[0] + b * w[1] + c * w[2];
      if (const double there2 = dot(p - at, p - at); there2 < distance2) {
        slab = s;
        distance2 = there2;
        position = at;
      }
    }
  }
};

class Anywhere {
 public:
  explicit Anywhere(std::uint32_t seed) : random_(seed) {}
  std::size_t below(std::size_t n) { return random_() % n; }
  double unit() { return std::uniform_real_distribution<double>(-1, 1)(random_); }
  Vec3d way() { return {normal_(random_), normal_(random_), normal_(random_)}; }
  /// Some power of ten, from least to most.
  double size(double least, double most) { return std::pow(10, least + (most - least) * (0.5 + 0.5 * unit())); }

 private:
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
};

SnapshotPtr mixed_torus() { return displaced(mixed_shell(*torus_shell(12, 8, 1), 1, 6), rough); }
bool in_band(Vec3d p) { return std::sin(5 * p.x) * std::cos(4 * p.z) > 0.6; }

void expect_same(const SurfacePoint& a, const SurfacePoint& b) {
  ASSERT_EQ(a.slab, b.slab);
  ASSERT_EQ(a.u, b.u);
  ASSERT_EQ(a.v, b.v);
  ASSERT_EQ(a.alpha, b.alpha);
  ASSERT_EQ(a.position, b.position);
  ASSERT_EQ(a.normal, b.normal);
}

TEST(ClosestPoint, IsThatOfAllTriangles) {
  std::vector<std::pair<std::string, SnapshotPtr>> models = {
      {"torus of n = 16", displaced(torus_shell(14, 9, 16, 0.3), rough)},
      {"torus of n = 31", displaced(torus_shell(9, 6, 31), rough)},
      {"torus of n from 1 to 64", mixed_torus()},
      {"the same with holes", with_hole(mixed_torus(), in_band)},
      {"noise", displaced(torus_shell(8, 6, 32),
                          [](Vec3d p) {
                            const double any = 4e4 * std::sin(1e4 * p.x + 3e4 * p.y + 7e4 * p.z);
                            return any - std::floor(any);
                          })},
      {"level sphere", displaced(sphere_shell(1, 64), [](Vec3d) { return 0.5; })},
      {"small sphere far from the origin",
       displaced(sphere_shell(1, 32, 0.8e-3, 1.2e-3, {1e3, -2e3, 5e2}), [](Vec3d) { return 0.5; })},
  };
  for (const auto& [title, model] : models) {
    const auto all = triangles_of(*model);
    const Box3d box = model->slab_mesh().bounds();
    const double size = diagonal(box);
    Anywhere any(7);
    for (int k = 0; k < 300; ++k) {
      // Near the surface, in the middle of a flat face or of a body, around it, and far away.
      const Triangle& t = all[any.below(all.size())];
      const Vec3d on = (t.corners[0] + t.corners[1] + t.corners[2]) / 3;
      const Vec3d p = k % 3 == 0   ? on + any.way() * (size * any.size(-6, -1))
                      : k % 3 == 1 ? box.centre() + any.way() * (0.3 * size)
                                   : box.centre() + any.way() * (size * any.size(0, 6));
      const Truth truth(all, p);
      const SurfacePoint found = closest_point(*model, p);
      ASSERT_EQ(found.slab, truth.slab) << title << ' ' << k;
      ASSERT_EQ(found.position, truth.position) << title << ' ' << k;
      const double distance = std::sqrt(truth.distance2);
      ASSERT_EQ(closest_point(*model, p, distance * (1 + 1e-9)).slab, found.slab);
      ASSERT_EQ(closest_point(*model, p, distance * (1 - 1e-9)).slab, kNoSlab);
    }
  }
}

TEST(ClosestPoint, HasAnAnswerAsFarAsDoublesHoldSquares) {
  const SnapshotPtr model = displaced(sphere_shell(1, 8), [](Vec3d) { return 0.5; });
  for (const double far : {1e9, 1e40, 1e80, 1e120, 1e150}) {
    const SurfacePoint found = closest_point(*model, {far, 0, 0});
    ASSERT_NE(found.slab, kNoSlab) << far;
    EXPECT_NEAR(length(found.position), 1, 0.05);
  }
  const double infinite = std::numeric_limits<double>::infinity(), none = std::numeric_limits<double>::quiet_NaN();
  for (const double wrong : {1e160, infinite, none}) EXPECT_EQ(closest_point(*model, {wrong, 0, 0}).slab, kNoSlab);
  EXPECT_EQ(closest_point(*model, {2, 0, 0}, 0).slab, kNoSlab);
  EXPECT_EQ(closest_point(*model, {1, 0, 0}, 0).slab, kNoSlab);
}

/// At a sample the surface is there to the bit, in each slab around it, so the answer is the lowest.
TEST(ClosestPoint, FindsSamplesEdgesAndCorners) {
  const SnapshotPtr model = displaced(mixed_shell(*sphere_shell(1, 1), 1, 5), rough);
  const SlabMesh& mesh = model->slab_mesh();
  PickHint hint;
  int samples = 0, slabs = 0;
  for (SlabId s = 0; s < mesh.slab_count(); ++s)
    for_each_cell(mesh.intervals(s), mesh.edge_intervals(s), [&](const std::array<GridPoint, 3>& cell) {
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3d p = sample_position(*model, s, cell[k]), q = sample_position(*model, s, cell[(k + 1) % 3]);
        SlabId lowest = kNoSlab;
        mesh.for_each_copy(s, cell[k], [&](const SampleCopy& copy) { lowest = std::min(lowest, copy.slab); });
        const SurfacePoint at = closest_point(*model, p, hint);
        ASSERT_EQ(at.position, p);
        ASSERT_EQ(at.slab, lowest);
        ++samples;
        slabs += lowest != s ? 1 : 0;
        const SurfacePoint middle = closest_point(*model, (p + q) * 0.5, hint);
        ASSERT_LE(length(middle.position - (p + q) * 0.5), 1e-15);
      }
    });
  EXPECT_GT(samples, 10'000);
  EXPECT_GT(slabs, 100);
}

/// Rays along the fibre of each sample and of the middle of each edge, from outside and from inside. The surface meets
/// each fibre once, so the first thing that they meet is what they are sent through.
TEST(Raycast, MeetsEverySampleAndEdgeFromBothSides) {
  const SnapshotPtr model = displaced(mixed_shell(*sphere_shell(1, 1), 1, 4), [](Vec3d) { return 0.5; });
  const SlabMesh& mesh = model->slab_mesh();
  PickHint hint;
  int rays = 0;
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    const int n = mesh.intervals(s);
    for_each_cell(n, mesh.edge_intervals(s), [&](const std::array<GridPoint, 3>& cell) {
      for (std::size_t k = 0; k < 3; ++k) {
        const GridPoint a = cell[k], b = cell[(k + 1) % 3];
        const auto fibre = [&](GridPoint p) {
          return sample_position(mesh, s, n, p, 1) - sample_position(mesh, s, n, p, 0);
        };
        const Vec3d p = sample_position(*model, s, a), q = sample_position(*model, s, b);
        for (const auto& [through, way] :
             {std::pair{p, fibre(a)}, std::pair{(p + q) * 0.5, (fibre(a) + fibre(b)) * 0.5}})
          for (const double side : {3.0, -0.4}) {
            const auto hit = raycast(*model, {through + way * side, way * -side}, hint);
            ASSERT_TRUE(hit) << s;
            ASSERT_LE(length(hit->point.position - through), 1e-12) << s;
            ASSERT_NEAR(hit->distance, 1, 1e-12);
            ++rays;
          }
      }
    });
  }
  EXPECT_GT(rays, 15'000);
}

/// A dent, and n changed nowhere: the next snapshot after an edit.
SnapshotPtr edited(const SnapshotPtr& model, SlabId slab, double value) {
  SnapshotDraft draft(model);
  Tile& tile = draft.edit(Layer::Displacement, slab);
  const int n = tile.intervals();
  for (int j = 1; j < n; ++j)
    for (int i = 1; i + j < n; ++i) tile.plane()[sample_index(n, {i, j})] = static_cast<float>(value);
  return draft.finish();
}

TEST(Hints, ChangeNoBit) {
  std::vector<SnapshotPtr> models = {mixed_torus(), with_hole(mixed_torus(), in_band),
                                     displaced(torus_shell(14, 9, 31), rough),
                                     displaced(sphere_shell(1, 128), [](Vec3d) { return 0.5; })};
  Anywhere any(3);
  PickHint hint;
  Vec3d p = {2, 1, 0};
  std::size_t now = 0;
  int hits = 0, misses = 0, nothing = 0;
  std::set<SlabId> slabs;
  for (int k = 0; k < 6000; ++k) {
    // Steps along, jumps, edits between two picks, another model.
    if (k % 97 == 96) now = any.below(models.size());
    if (k % 31 == 30)
      models[now] = edited(models[now], static_cast<SlabId>(any.below(models[now]->slab_mesh().slab_count())),
                           0.5 + 0.4 * any.unit());
    const Snapshot& model = *models[now];
    p = k % 50 == 49 ? any.way() * 2.0 : p + any.way() * any.size(-5, -1.5);
    const double within = k % 4 == 3 ? any.size(-4, 0) : std::numeric_limits<double>::infinity();
    const SurfacePoint near = closest_point(model, p, within);
    ASSERT_NO_FATAL_FAILURE(expect_same(closest_point(model, p, hint, within), near)) << k;
    if (near.slab == kNoSlab) {
      ++nothing;
      continue;
    }
    slabs.insert(near.slab);
    p += (near.position - p) * 0.1;  // so that it stays around
    // From the eye through the surface near by, and through one of its samples.
    const SlabMesh& mesh = model.slab_mesh();
    const GridPoint sample = edge_point(mesh.intervals(near.slab), k % 3, static_cast<int>(any.below(2)));
    const Vec3d eye = {1, 7, 2}, through = k % 2 == 0 ? near.position : sample_position(model, near.slab, sample);
    const Ray3d ray = {k % 5 == 0 ? p : eye, through - eye};
    const auto hit = raycast(model, ray), tracked = raycast(model, ray, hint);
    ASSERT_EQ(hit.has_value(), tracked.has_value()) << k;
    (hit ? hits : misses) += 1;
    if (!hit) continue;
    ASSERT_NO_FATAL_FAILURE(expect_same(hit->point, tracked->point)) << k;
    ASSERT_EQ(hit->distance, tracked->distance);
  }
  EXPECT_GT(hits, 2000);
  EXPECT_GT(misses, 100);
  EXPECT_GT(nothing, 100);
  EXPECT_GT(slabs.size(), 100U);
}

}  // namespace
}  // namespace relief
