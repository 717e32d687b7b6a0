// Cages whose slabs are cut in four: what must stay, stays to the bit, and what is finer fits together.
#include "support/cuts.h"
#include "support/shells.h"

#include <relief/base/triangle.h>
#include <relief/core/detail.h>
#include <relief/core/facets.h>
#include <relief/core/micro_triangles.h>
#include <relief/core/near_surface.h>
#include <relief/core/tessellate.h>

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>
#include <set>

namespace relief {
namespace {

using testing::cut_at_random;
using testing::displaced;
using testing::mixed_shell;
using testing::plane_shell;
using testing::RandomCuts;
using testing::sphere_shell;
using testing::torus_shell;
using testing::with_hole;

double bumps(Vec3d p) { return 0.5 + 0.2 * std::sin(7 * p.x) * std::cos(5 * p.y + 3 * p.z); }

/// Evenly over each slab, at alpha 0.25.
SlabCoord random_place(const SlabMesh& mesh, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  double u = unit(random), v = unit(random);
  if (u + v > 1) {
    u = 1 - u;
    v = 1 - v;
  }
  return {static_cast<SlabId>(random() % mesh.slab_count()), u, v, 0.25};
}

/// Models of all kinds of n, even and odd, alike and mixed, closed and open, smooth and twisted.
std::vector<SnapshotPtr> models() {
  std::vector<SnapshotPtr> made;
  for (const int n : {1, 2, 15, 31, 32, 63, 128}) made.push_back(displaced(sphere_shell(1, n), bumps));
  made.push_back(displaced(torus_shell(8, 6, 8), bumps));
  made.push_back(displaced(plane_shell(3, 6), bumps));
  made.push_back(displaced(mixed_shell(*torus_shell(8, 6, 8), 1, 4), bumps));
  made.push_back(displaced(mixed_shell(*torus_shell(8, 6, 8), 3, 3), bumps));
  return made;
}

TEST(Detail, CopiesStayTheSameAndConstrainedSamplesFollow) {
  for (const SnapshotPtr& model : models()) {
    const SnapshotPtr cut = cut_at_random(model, 40);
    const Status sound = validate(*cut);
    EXPECT_TRUE(sound) << sound.error().message;
    EXPECT_GT(cut->slab_mesh().slab_count(), model->slab_mesh().slab_count() + 60);
  }
}

TEST(Detail, TheSurfaceDoesNotMove) {
  std::mt19937 random(3);
  for (const SnapshotPtr& model : models()) {
    const SnapshotPtr cut = cut_at_random(model, 40);
    double worst = 0;
    for (int k = 0; k < 4000; ++k) {
      const auto [s, u, v, alpha] = random_place(model->slab_mesh(), random);
      const auto there = heir(model->slab_mesh(), cut->slab_mesh(), {s, u, v, alpha});
      ASSERT_TRUE(there);
      EXPECT_EQ(there->alpha, 0.25);
      worst = std::max(
          worst, std::abs(displacement_at(*model, s, u, v) - displacement_at(*cut, there->slab, there->u, there->v)));
      const auto back = heir(cut->slab_mesh(), model->slab_mesh(), *there);
      ASSERT_TRUE(back);
      EXPECT_EQ(back->slab, s);
      EXPECT_NEAR(back->u, u, 1e-15);
      EXPECT_NEAR(back->v, v, 1e-15);
    }
    EXPECT_LE(worst, 2e-7) << "of alpha";
  }
}

TEST(Detail, EverySampleThatThereWasIsThereStill) {
  for (const SnapshotPtr& model : models()) EXPECT_EQ(testing::samples_lost(*model, *cut_at_random(model, 25)), 0U);
}

TEST(Detail, CopiesLieAtTheSamePlaceToTheBit) {
  for (const SnapshotPtr& model : models()) {
    const SnapshotPtr cut = cut_at_random(model, 40);
    const SlabMesh& mesh = cut->slab_mesh();
    std::map<std::array<double, 3>, std::set<std::pair<SlabId, std::pair<int, int>>>> by_place;
    for (SlabId s = 0; s < mesh.slab_count(); ++s) {
      const int n = mesh.intervals(s);
      for (int j = 0; j <= n; ++j)
        for (int i = 0; i + j <= n; ++i) {
          if (mesh.edge_place(s, {i, j}).constrained()) continue;
          const Vec3d p = sample_position(*cut, s, {i, j});
          by_place[{p.x, p.y, p.z}].insert({s, {i, j}});
        }
    }
    for (SlabId s = 0; s < mesh.slab_count(); ++s) {
      const int n = mesh.intervals(s);
      for (int edge = 0; edge < 3; ++edge)
        for (int t = 0; t < n; ++t) {
          const GridPoint at = edge_point(n, edge, t);
          if (mesh.edge_place(s, at).constrained()) continue;
          std::set<std::pair<SlabId, std::pair<int, int>>> copies;
          SlabId last = 0;
          mesh.for_each_copy(s, at, [&](const SampleCopy& copy) {
            EXPECT_GE(copy.slab, last) << "in order";
            last = copy.slab;
            copies.insert({copy.slab, {copy.at.i, copy.at.j}});
          });
          const Vec3d p = sample_position(*cut, s, at);
          EXPECT_EQ(copies, (by_place[{p.x, p.y, p.z}])) << "slab " << s << " edge " << edge << " t " << t;
        }
    }
  }
}

TEST(Detail, TrianglesMeetEdgeToEdge) {
  for (const SnapshotPtr& model : models()) {
    const SnapshotPtr cut = cut_at_random(model, 40);
    const bool open = std::ranges::any_of(model->slab_mesh().slabs(), [](const Slab& s) {
      return std::ranges::find(s.neighbours, kNoSlab) != s.neighbours.end();
    });
    for (int level = 0; level < level_count(cut->slab_mesh()); ++level) {
      const Tessellation t = tessellate(*cut, level);
      std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;
      for (const auto& [a, b, c] : t.triangles)
        for (const auto& side : {std::pair{a, b}, {b, c}, {c, a}}) ++sides[side];
      std::size_t alone = 0;
      for (const auto& [side, count] : sides) {
        EXPECT_EQ(count, 1);
        alone += sides.contains({side.second, side.first}) ? 0 : 1;
      }
      EXPECT_EQ(alone > 0, open) << "level " << level;
      if (!open) {
        EXPECT_EQ(alone, 0U) << "level " << level;
      }
    }
  }
}

TEST(Detail, QueriesFindTheSurfaceOfTheUncutModel) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1.3, 1.3);
  for (const SnapshotPtr& model : {displaced(sphere_shell(1, 32), bumps), displaced(torus_shell(8, 6, 8), bumps)}) {
    const SnapshotPtr cut = cut_at_random(model, 60);
    const double size = length(model->slab_mesh().bounds().extent());
    LocateHint hint, fine_hint;
    PickHint pick;
    int found = 0, hits = 0;
    for (int k = 0; k < 3000; ++k) {
      const Vec3d p = Vec3d{unit(random), unit(random), unit(random)} * (size / 3);
      const auto a = probe(*model, p, hint), b = probe(*cut, p, fine_hint);
      ASSERT_EQ(a.has_value(), b.has_value());
      if (a) {
        ++found;
        EXPECT_LE(length(a->surface.position - b->surface.position), 1e-7 * size);
        EXPECT_EQ(a->touching(), b->touching());
        EXPECT_TRUE(owns(cut->slab_mesh(), b->at.slab, p));
      }
      const Ray3d ray{p * 3.0, normalized(Vec3d{unit(random), unit(random), unit(random)} - p * 3.0)};
      const auto x = raycast(*model, ray), y = raycast(*cut, ray, pick);
      ASSERT_EQ(x.has_value(), y.has_value());
      if (x) {
        ++hits;
        EXPECT_NEAR(x->distance, y->distance, 1e-3 * size);
      }
      const SurfacePoint near = closest_point(*model, p), fine = closest_point(*cut, p);
      EXPECT_NEAR(length(near.position - p), length(fine.position - p), 1e-4 * size);
    }
    EXPECT_GT(found, 100);
    EXPECT_GT(hits, 500);
  }
}

/// Cut again and again at a place of the first slab.
SnapshotPtr cut_deep(const SnapshotPtr& model, int times) {
  const Vec3d p = model->slab_mesh().corners(0).point({0.31, 0.33, 0.36}, 0.5);
  RandomCuts cuts(model);
  for (int k = 0; k < times; ++k) {
    LocateHint none;
    const auto at = locate(cuts.model()->slab_mesh(), p, none);
    EXPECT_EQ(at ? cuts.model()->slab_mesh().level(at->slab) : -1, k);
    if (at) cuts.cut(at->slab);
  }
  return cuts.model();
}

/// Returns what a point is in, found by asking every slab: the lowest that owns it.
std::optional<SlabCoord> located_by_all(const SlabMesh& mesh, Vec3d p) {
  for (SlabId s = 0; s < mesh.slab_count(); ++s)
    if (owns(mesh, s, p)) return coordinates_in(mesh, s, p, 1e-5);
  return std::nullopt;
}

TEST(Detail, PlacesAreThoseThatAllSlabsWouldGive) {
  std::mt19937 random(17);
  std::uniform_real_distribution<double> unit(0, 1);
  int all_outside = 0;
  std::vector<SnapshotPtr> all_cut = {cut_deep(displaced(torus_shell(8, 6, 8), bumps), 9)};
  for (const SnapshotPtr& model : models()) all_cut.push_back(cut_at_random(model, 40));
  for (const SnapshotPtr& cut : all_cut) {
    const SlabMesh& mesh = cut->slab_mesh();
    LocateHint last;
    int inside = 0, outside = 0;
    for (int k = 0; k < 2000; ++k) {
      // Inside a slab, near a wall or a fibre of one, and anywhere around.
      const SlabCoord in = random_place(mesh, random);
      std::array<double, 3> w = {1 - in.u - in.v, in.u, in.v};
      for (int near = static_cast<int>(random() % 3); near > 0; --near) {
        const std::size_t to = random() % 3;
        const double share = 1e-4 * unit(random);
        for (std::size_t c = 0; c < 3; ++c) w[c] = c == to ? w[c] * share + 1 - share : w[c] * share;
      }
      const Box3d& all = mesh.bounds();
      const Vec3d anywhere =
          all.low + Vec3d{unit(random) * all.extent().x, unit(random) * all.extent().y, unit(random) * all.extent().z};
      const Vec3d p = k % 4 == 0 ? anywhere : mesh.corners(in.slab).point(w, 0.05 + 0.9 * unit(random));
      const auto wanted = located_by_all(mesh, p);
      LocateHint none;
      for (LocateHint* const hint : {&none, &last}) {
        const auto at = locate(mesh, p, *hint);
        ASSERT_EQ(at.has_value(), wanted.has_value()) << k;
        if (!at) continue;
        ASSERT_EQ(at->slab, wanted->slab) << k;
        EXPECT_NEAR(at->u, wanted->u, 1e-9);
        EXPECT_NEAR(at->v, wanted->v, 1e-9);
        EXPECT_NEAR(at->alpha, wanted->alpha, 1e-9);
        const Vec3d back = mesh.corners(at->slab).point({1 - at->u - at->v, at->u, at->v}, at->alpha);
        EXPECT_LT(length(back - p), 1e-9 * length(mesh.box(at->slab).extent()));
      }
      ++(wanted ? inside : outside);
    }
    EXPECT_GT(inside, 1500);
    all_outside += outside;
  }
  EXPECT_GT(all_outside, 1000);
}

/// Calls visit(triangle) for all of the surface.
template <typename Visit>
void for_each_triangle(const Snapshot& model, Visit&& visit) {
  const SlabMesh& mesh = model.slab_mesh();
  MicroTriangles surface(model);
  for (SlabId s = 0; s < mesh.slab_count(); ++s)
    for_each_cell(mesh.intervals(s), mesh.edge_intervals(s), [&](const std::array<GridPoint, 3>& cell) {
      MicroTriangle triangle{s, cell, {}};
      surface.measure(triangle);
      visit(triangle);
    });
}

TEST(Detail, WhatIsNearestIsNearestOfAllTriangles) {
  std::mt19937 random(19);
  std::uniform_real_distribution<double> unit(-1.3, 1.3);
  for (const SnapshotPtr& model : {displaced(sphere_shell(1, 8), bumps), displaced(torus_shell(8, 6, 8), bumps)}) {
    const SnapshotPtr cut = cut_at_random(model, 40);
    const double size = length(cut->slab_mesh().bounds().extent());
    PickHint last;
    SlabId nearest = kNoSlab;
    for (int k = 0; k < 300; ++k) {
      const Vec3d p = Vec3d{unit(random), unit(random), unit(random)} * (size / 3);
      double wanted = size;
      for_each_triangle(*cut, [&](const MicroTriangle& t) {
        const auto& [a, b, c] = t.positions;
        wanted = std::min(wanted, length(p - t.point(nearest_in_triangle(p, a, b, c))));
      });
      EXPECT_NEAR(length(closest_point(*cut, p).position - p), wanted, 1e-12 * size);
      EXPECT_NEAR(length(closest_point(*cut, p, last).position - p), wanted, 1e-12 * size);
      MicroTriangles surface(*cut);
      const double clear = detail::clear_around(surface, p, 0, size, nearest);
      EXPECT_LE(clear, wanted);
      EXPECT_GE(2 * clear, wanted * (1 - 1e-8));
    }
  }
}

TEST(Detail, WallsBetweenSlabsBelongToOneOfThem) {
  const SnapshotPtr model = displaced(torus_shell(8, 6, 8), bumps);
  const SnapshotPtr cut = cut_at_random(model, 60);
  const SlabMesh& mesh = cut->slab_mesh();
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int k = 0; k < 20000; ++k) {
    const auto s = static_cast<SlabId>(random() % mesh.slab_count());
    std::array<double, 3> w{};
    const std::size_t corner = random() % 3;
    const double t = random() % 8 == 0 ? 0.0 : unit(random);
    w[(corner + 1) % 3] = 1 - t;
    w[(corner + 2) % 3] = t;
    const Vec3d p = mesh.corners(s).point(w, 0.1 + 0.8 * unit(random));
    std::set<SlabId> owners;
    for (SlabId other = 0; other < mesh.slab_count(); ++other)
      if (mesh.box(other).contains(p) && owns(mesh, other, p)) owners.insert(other);
    if (t > 0) {
      EXPECT_EQ(owners.size(), 1U) << "at a fibre rounding may give it to two";
    }
    std::set<SlabId> answers;
    for (const SlabId start : {s, mesh.slabs()[s].neighbours[corner], kNoSlab}) {
      LocateHint hint;
      hint.last.slab = start;
      hint.last.u = hint.last.v = 0.3;
      hint.last.alpha = 0.5;
      const auto at = locate(mesh, p, hint);
      ASSERT_TRUE(at);
      answers.insert(at->slab);
    }
    EXPECT_EQ(answers.size(), 1U) << "whatever the hint";
    if (!owners.empty()) {
      EXPECT_EQ(*answers.begin(), *owners.begin());
    }
  }
}

TEST(Detail, NormalsOfCopiesAreTheSameToTheBit) {
  const SnapshotPtr cut = cut_at_random(displaced(mixed_shell(*torus_shell(8, 6, 8), 1, 4), bumps), 40);
  const SlabMesh& mesh = cut->slab_mesh();
  for (SlabId s = 0; s < mesh.slab_count(); ++s)
    for (int edge = 0; edge < 3; ++edge)
      for (int t = 0; t < mesh.intervals(s); ++t) {
        const GridPoint at = edge_point(mesh.intervals(s), edge, t);
        const Vec3d normal = sample_normal(*cut, s, at);
        EXPECT_NEAR(length(normal), 1, 1e-12);
        mesh.for_each_copy(s, at,
                           [&](const SampleCopy& copy) { EXPECT_EQ(sample_normal(*cut, copy.slab, copy.at), normal); });
      }
}

/// The same surface with four times as many samples along each edge of every third slab, two times elsewhere.
SnapshotPtr finer(const SnapshotPtr& model) {
  Detail detail;
  for (SlabId s = 0; s < model->slab_mesh().slab_count(); ++s)
    detail.grids.push_back({Layer::Displacement, s, (s % 3 == 0 ? 4 : 2) * model->intervals(Layer::Displacement, s)});
  const Result<SnapshotPtr> made = with_detail(model, detail);
  EXPECT_TRUE(made);
  return *made;
}

TEST(Detail, NewSamplesShowNoCreases) {
  // The judge: the smooth surface itself, a wave over a plane whose fibres stand along y.
  const auto height = [](Vec3d p) { return 0.04 * std::sin(4 * p.x) * std::cos(3 * p.z); };
  const auto normal = [](Vec3d p) {
    return normalized(
        Vec3d{-0.16 * std::cos(4 * p.x) * std::cos(3 * p.z), 1, 0.12 * std::sin(4 * p.x) * std::sin(3 * p.z)});
  };
  const SnapshotPtr model = displaced(plane_shell(1, 32, 0.25), [&](Vec3d p) { return 0.5 + 2 * height(p); });
  const SnapshotPtr fine = cut_at_random(finer(model), 2);
  // Beside it, what the triangles would show, whose edges are the old ones.
  double normals = 0, facets = 0, worst_normal = 0, worst_facet = 0;
  for (SlabId s = 0; s < fine->slab_mesh().slab_count(); ++s) {
    const int n = fine->slab_mesh().intervals(s);
    for (int j = 1; j < n; ++j)
      for (int i = 1; i + j < n; ++i) {
        const auto at = [&](int a, int b) { return sample_position(*fine, s, {a, b}); };
        const Vec3d right = at(i, j), wanted = normal(right);
        const Vec3d facet = normalized(cross(at(i + 1, j) - right, at(i, j + 1) - right));
        const double off = length(cross(wanted, sample_normal(*fine, s, {i, j}))), flat = length(cross(wanted, facet));
        normals += off * off;
        facets += flat * flat;
        worst_normal = std::max(worst_normal, off);
        worst_facet = std::max(worst_facet, flat);
      }
  }
  // Near the slab's border the normals know one side only.
  EXPECT_LE(std::sqrt(normals), 0.3 * std::sqrt(facets));
  EXPECT_LE(worst_normal, 0.7 * worst_facet);
}

TEST(Detail, NormalsLookNoFartherThanATickCanPayFor) {
  // One old triangle of 64 spacings; each normal asks six directions.
  Detail finest;
  finest.grids.push_back({Layer::Displacement, 0, 64});
  const Result<SnapshotPtr> fine = with_detail(displaced(plane_shell(1, 1), [](Vec3d) { return 0.5; }), finest);
  ASSERT_TRUE(fine);
  const detail::Facets facets((*fine)->slab_mesh(), 0, (*fine)->displacement(0));
  EXPECT_EQ(facets.reach({20, 20}, {1, 0}), 16);
  EXPECT_EQ(facets.reach({20, 20}, {0, -1}), 16);
  EXPECT_EQ(facets.reach({2, 20}, {-1, 0}), 2);
}

TEST(Detail, WhatAToolHasChangedIsNoLongerSmoothedOver) {
  // One new sample is lowered: it and its neighbours have the normals of the triangles around, and no others.
  const SnapshotPtr fine = finer(displaced(sphere_shell(1, 16), [](Vec3d) { return 0.5; }));
  const SlabId s = 0;
  const int n = fine->slab_mesh().intervals(s);
  const GridPoint dent = {n / 4 + 1, n / 4 + 1};
  SnapshotDraft draft(fine);
  draft.edit(Layer::Displacement, s).set(0, sample_index(n, dent), 0.3F);
  const SnapshotPtr changed = draft.finish();
  for (int j = 1; j < n; ++j)
    for (int i = 1; i + j < n; ++i) {
      const bool near =
          std::abs(i - dent.i) <= 1 && std::abs(j - dent.j) <= 1 && std::abs(i + j - dent.i - dent.j) <= 1;
      const double turned = length(cross(sample_normal(*fine, s, {i, j}), sample_normal(*changed, s, {i, j})));
      if (GridPoint{i, j} == dent) continue;
      if (near)
        EXPECT_GT(turned, 0.1) << i << " " << j;
      else
        EXPECT_LT(turned, 0.02) << i << " " << j;
    }
}

TEST(Detail, WalksAcrossEdgesFindTheTriangleBeyond) {
  for (const SnapshotPtr& model : models()) {
    const SnapshotPtr cut = cut_at_random(model, 30);
    MicroTriangles surface(*cut);
    const SlabMesh& mesh = cut->slab_mesh();
    for (SlabId s = 0; s < mesh.slab_count(); ++s)
      for_each_cell(mesh.intervals(s), mesh.edge_intervals(s), [&](const std::array<GridPoint, 3>& cell) {
        MicroTriangle t{s, cell, {}};
        surface.measure(t);
        for (std::size_t k = 0; k < 3; ++k) {
          const MicroTriangle other = surface.across(t, k);
          if (other.slab == kNoSlab) {
            EXPECT_TRUE(std::ranges::find(mesh.slabs()[s].neighbours, kNoSlab) != mesh.slabs()[s].neighbours.end());
            continue;
          }
          int shared = 0;
          for (const Vec3d p : other.positions)
            shared += p == t.positions[(k + 1) % 3] || p == t.positions[(k + 2) % 3];
          EXPECT_EQ(shared, 2);
          EXPECT_FALSE(other.slab == t.slab && other.corners == t.corners);
        }
      });
  }
}

TEST(Detail, SlabsThatStayKeepTheirTilesAndPages) {
  const SnapshotPtr model = displaced(sphere_shell(3, 8), bumps);
  const auto cut = with_detail(model, {.cuts = {400}, .grids = {}});
  ASSERT_TRUE(cut);
  std::size_t changed = 0;
  for_each_change(*model, **cut, [&](Layer, SlabId) { ++changed; });
  EXPECT_EQ(changed, 4U) << "the children";
  EXPECT_EQ((*cut)->table(Layer::Displacement)[0]->pages[0], model->table(Layer::Displacement)[0]->pages[0]);
  for_each_change(**cut, *model, [&](Layer, SlabId s) { EXPECT_EQ(s, 400U); });
}

TEST(Detail, LayersAreRefinedAlikeAndHolesStay) {
  const SnapshotPtr sheet =
      with_hole(displaced(plane_shell(3, 8), bumps), [](Vec3d p) { return length(p - Vec3d{0.5, 0, 0.5}) < 0.2; });
  SnapshotDraft draft(sheet);
  draft.add_layer(Layer::Colour, 5, 0.25F);
  draft.add_layer(Layer::Mask, 16, 0.5F);
  const SnapshotPtr model = draft.finish();
  const SnapshotPtr cut = cut_at_random(model, 20);
  const Status sound = validate(*cut);
  EXPECT_TRUE(sound) << sound.error().message;
  std::mt19937 random(2);
  int holes = 0;
  for (int k = 0; k < 4000; ++k) {
    const auto [s, u, v, alpha] = random_place(model->slab_mesh(), random);
    const auto there = heir(model->slab_mesh(), cut->slab_mesh(), {s, u, v, alpha});
    EXPECT_EQ(colour_at(*cut, there->slab, there->u, there->v).x, colour_at(*model, s, u, v).x);
    EXPECT_NEAR(layer_at(*cut, Layer::Mask, there->slab, there->u, there->v, 0), 0.5, 1e-15);
    if (hole_at(*model, s, u, v)) {
      ++holes;
      EXPECT_TRUE(hole_at(*cut, there->slab, there->u, there->v));
    }
  }
  EXPECT_GT(holes, 50);
}

/// Where n differs, a void sample of one side may have followed from others by the nearer one.
TEST(Detail, HolesFitWhereNDiffers) {
  for (const int odd : {1, 3})
    for (std::uint32_t seed = 1; seed <= 5; ++seed) {
      testing::RandomCuts cuts(with_hole(displaced(mixed_shell(*torus_shell(8, 6, 8), odd, 4), bumps),
                                         [](Vec3d p) { return p.y > 0.1 * p.x; }),
                               seed);
      for (int k = 0; k < 12; ++k) {
        cuts.cut_one(3);
        const Status sound = validate(*cuts.model());
        ASSERT_TRUE(sound) << sound.error().message;
      }
    }
}

TEST(Detail, RefusesWhatDoesNotFit) {
  const SnapshotPtr model = displaced(sphere_shell(1, 127), bumps);
  EXPECT_FALSE(with_detail(model, {.cuts = {3}, .grids = {}})) << "254 intervals";
  const SnapshotPtr other = displaced(sphere_shell(1, 8), bumps);
  EXPECT_FALSE(with_detail(other, {.cuts = {999}, .grids = {}}));
  EXPECT_TRUE(with_detail(other, {.cuts = {3, 3}, .grids = {}})) << "the child in the centre lies among its like";
  EXPECT_FALSE(with_detail(other, {.cuts = {3, other->slab_mesh().slab_count()}, .grids = {}})) << "two levels at once";
  EXPECT_FALSE(with_detail(other, {.cuts = {}, .grids = {{Layer::Displacement, 3, 200}}}));
  EXPECT_FALSE(with_detail(other, {.cuts = {}, .grids = {{Layer::Displacement, 999, 8}}}));
}

TEST(Detail, RootsStayWhatTheyWere) {
  const SnapshotPtr model = displaced(torus_shell(8, 6, 8), bumps);
  const SnapshotPtr cut = cut_at_random(model, 30);
  const SlabMesh &before = model->slab_mesh(), &after = cut->slab_mesh();
  EXPECT_EQ(after.roots_number(), before.roots_number());
  ASSERT_EQ(after.roots().size(), before.slabs().size());
  ASSERT_EQ(after.root_fibres().size(), before.fibres().size());
  for (SlabId s = 0; s < before.slab_count(); ++s) {
    EXPECT_EQ(after.roots()[s].fibres, before.slabs()[s].fibres);
    EXPECT_EQ(after.roots()[s].intervals, before.intervals(s));
  }
  EXPECT_NE(after.content_hash(), before.content_hash());
}

}  // namespace
}  // namespace relief
