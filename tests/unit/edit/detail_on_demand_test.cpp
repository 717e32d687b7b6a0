#include "edit_support.h"

#include <relief/core/detail.h>

#include <array>
#include <cmath>
#include <map>
#include <random>
#include <utility>
#include <vector>

namespace relief {
namespace {

using testing::bumps;
using testing::dab_near;
using testing::displaced;
using testing::sphere_shell;
using testing::valid;

/// Coarse where a small tool works: 32 slabs with eight intervals, or as many as is said.
SnapshotPtr coarse(int n = 8) { return displaced(sphere_shell(1, n), bumps); }

/// The displacement of each sample by its place, and whether all copies of one agree.
std::map<std::array<double, 3>, float> samples_by_place(const Snapshot& model) {
  std::map<std::array<double, 3>, float> found;
  const SlabMesh& mesh = model.slab_mesh();
  testing::for_each_sample(mesh, [&](SlabId s, std::size_t k, GridPoint p) {
    if (mesh.edge_place(s, p).constrained()) return;
    const Vec3d at = sample_position(mesh, s, mesh.intervals(s), p, 0.5);
    const auto [place, fresh] = found.try_emplace({at.x, at.y, at.z}, model.displacement(s)[k]);
    EXPECT_EQ(place->second, model.displacement(s)[k]);
  });
  return found;
}

/// Calls visit(slab, u, v) for places between samples all over the model.
template <typename Visit>
void for_each_place(const SlabMesh& mesh, int per_slab, std::uint32_t seed, Visit&& visit) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  for (SlabId s = 0; s < mesh.slab_count(); ++s)
    for (int k = 0; k < per_slab; ++k) {
      double u = unit(random), v = unit(random);
      if (u + v > 1) {
        u = 1 - u;
        v = 1 - v;
      }
      visit(s, u, v);
    }
}

/// How far two models of one origin lie apart, of alpha.
double largest_difference(const Snapshot& a, const Snapshot& b, int per_slab = 40) {
  double worst = 0;
  for_each_place(b.slab_mesh(), per_slab, 7, [&](SlabId s, double u, double v) {
    const auto there = heir(b.slab_mesh(), a.slab_mesh(), {s, u, v, 0});
    worst =
        std::max(worst, std::abs(displacement_at(b, s, u, v) - displacement_at(a, there->slab, there->u, there->v)));
  });
  return worst;
}

double coarsest_near(const Snapshot& model, Vec3d p, double radius) {
  double coarsest = 0;
  const SlabMesh& mesh = model.slab_mesh();
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    bool near = false;
    for_each_cell(6, [&](const std::array<GridPoint, 3>& cell) {
      const Vec3d at = surface_point(model, s, cell[0].i / 6.0, cell[0].j / 6.0).position;
      near = near || length(at - p) < radius;
    });
    if (!near) continue;
    std::array<Vec3d, 3> corners{};
    for (std::size_t k = 0; k < 3; ++k) corners[k] = surface_point(model, s, k == 1 ? 1 : 0, k == 2 ? 1 : 0).position;
    for (std::size_t k = 0; k < 3; ++k)
      coarsest = std::max(coarsest, length(corners[k] - corners[(k + 1) % 3]) / mesh.intervals(s));
  }
  return coarsest;
}

TEST(DetailOnDemand, ComesWhereTheToolIsAndNowhereElse) {
  for (const int n : {4, 8, 15, 32, 128}) {
    const SnapshotPtr before = coarse(n);
    Editor editor(before);
    const double radius = 0.03;
    const Dab dab = dab_near(*before, {0.3, 0.8, 0.5}, 0.4 * radius);
    const DabResult told = testing::apply(editor, {.radius = radius}, dab);
    const Snapshot& after = *editor.head();
    EXPECT_TRUE(valid(after));
    EXPECT_GT(told.slabs_added, 0U);
    EXPECT_GT(told.samples_added, 0U);
    EXPECT_FALSE(told.detail_limited);
    EXPECT_LE(coarsest_near(after, dab.contact, radius), 1.001 * radius / 12);
    SlabId kept = 0;
    for (SlabId s = 0; s < before->slab_mesh().slab_count(); ++s)
      kept += before->shared_tile(Layer::Displacement, s) == after.shared_tile(Layer::Displacement, s) ? 1U : 0U;
    EXPECT_GT(kept, before->slab_mesh().slab_count() / 2) << "for n " << n;
    // Outside the tool the surface is the old one.
    for_each_place(after.slab_mesh(), 30, 3, [&](SlabId s, double u, double v) {
      const SurfacePoint at = surface_point(after, s, u, v);
      if (length(at.position - dab.contact) < 1.2 * radius) return;
      const auto there = heir(after.slab_mesh(), before->slab_mesh(), {s, u, v, 0});
      EXPECT_NEAR(at.alpha, displacement_at(*before, there->slab, there->u, there->v), 2e-7);
    });
  }
}

TEST(DetailOnDemand, WhatStandsElsewhereInASlabCostsNothingHere) {
  // Fibres that lean: those beside the tool pass over it, far above the surface.
  const auto sheet =
      testing::mapped_shell(*testing::plane_shell(1, 64, 0.4), [](Vec3d p) { return Vec3d{p.x + 2 * p.y, p.y, p.z}; });
  std::array<std::size_t, 2> added{};
  for (const bool peak : {false, true}) {
    const SnapshotPtr before = displaced(sheet, [&](Vec3d p) { return peak && p.x > 0.8 && p.z > 0.8 ? 0.95 : 0.3; });
    Editor editor(before);
    const Vec3d place = surface_point(*before, 0, 0.5, 0.2).position;
    added[peak ? 1 : 0] = testing::apply(editor, {.radius = 0.05}, dab_near(*before, place, 0.03)).samples_added;
    EXPECT_TRUE(valid(*editor.head()));
  }
  EXPECT_GT(added[0], 1000U);
  EXPECT_EQ(added[1], added[0]);
}

TEST(DetailOnDemand, IsNotMadeWhereNoneIsNeeded) {
  const SnapshotPtr before = coarse(32);
  for (const Brush& brush :
       {Brush{.radius = 0.03, .detail = 0}, Brush{.radius = 0.6}, Brush{.tool = Tool::Smooth, .radius = 0.1}}) {
    Editor editor(before);
    const DabResult told =
        testing::apply(editor, brush, dab_near(*before, {0.3, 0.8, 0.5}, 0.4 * brush.radius, 1, 0.1));
    EXPECT_GT(told.samples, 0U);
    EXPECT_EQ(told.slabs_added, 0U);
    EXPECT_EQ(told.samples_added, 0U);
    EXPECT_EQ(editor.head()->shared_slab_mesh(), before->shared_slab_mesh());
  }
}

TEST(DetailOnDemand, IsDroppedWithAStrokeThatChangesNothing) {
  const SnapshotPtr before = coarse();
  Editor editor(before);
  editor.begin_stroke({.tool = Tool::Deposit, .radius = 0.03});
  editor.dab(dab_near(*before, {0, 1, 0}, 0, 1, 0));
  const StrokeResult told = editor.end_stroke();
  EXPECT_FALSE(told.changed);
  EXPECT_EQ(told.slabs_added, 0U);
  EXPECT_EQ(editor.head(), before);

  editor.begin_stroke({.tool = Tool::Deposit, .radius = 0.03});
  EXPECT_GT(editor.dab(dab_near(*before, {0, 1, 0}, 0, 1, 0.1)).slabs_added, 0U);
  editor.cancel_stroke();
  EXPECT_EQ(editor.head(), before);
  EXPECT_GT(testing::apply(editor, {.radius = 0.3}, dab_near(*before, {0, 1, 0}, 0.1)).samples, 0U);
  EXPECT_TRUE(valid(*editor.head()));
}

TEST(DetailOnDemand, UndoAndRedoCrossTheChangeOfTheCage) {
  const SnapshotPtr before = coarse();
  const std::uint64_t hash = before->content_hash();
  Editor editor(before);
  testing::apply(editor, {.radius = 0.02}, dab_near(*before, {0.3, 0.8, 0.5}, 0.01));
  const SnapshotPtr carved = editor.head();
  ASSERT_NE(carved->slab_mesh().slab_count(), before->slab_mesh().slab_count());
  const std::uint64_t carved_hash = carved->content_hash();
  for (int k = 0; k < 3; ++k) {
    editor.set_head(before);
    EXPECT_EQ(editor.head()->content_hash(), hash);
    testing::apply(editor, {.tool = Tool::Paint, .radius = 0.05}, dab_near(*before, {0, 1, 0}, 0, 1, 0.1));
    EXPECT_TRUE(valid(*editor.head()));
    editor.set_head(carved);
    EXPECT_EQ(editor.head()->content_hash(), carved_hash);
    testing::apply(editor, {.tool = Tool::Inflate, .radius = 0.05}, dab_near(*carved, {0.3, 0.8, 0.5}, 0, 1, 0.1));
    EXPECT_TRUE(valid(*editor.head()));
  }
}

void expect_any_order(int n, PressureDrives drives) {
  const SnapshotPtr before = coarse(n);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<Dab> dabs;
  for (int k = 0; k < 60; ++k) {
    const Vec3d way = {0.3 + 0.25 * unit(random), 0.8, 0.5 + 0.25 * unit(random)};
    const double size = drives == PressureDrives::Strength ? 1 : std::array{1.0, 0.6, 0.25}[random() % 3];
    dabs.push_back(dab_near(*before, way, size * (0.02 + 0.01 * unit(random))));
    dabs.back().size = size;
  }
  std::map<std::array<double, 3>, float> first;
  constexpr std::array kTimes = {1, 1, 10, 100};
  for (std::size_t run = 0; run < kTimes.size(); ++run) {
    if (run > 0) std::ranges::shuffle(dabs, random);
    Editor editor(before);
    editor.begin_stroke({.radius = 0.05, .pressure_drives = drives});
    for (int again = 0; again < kTimes[run]; ++again)
      for (const Dab& dab : dabs) editor.dab(dab);
    const StrokeResult told = editor.end_stroke();
    EXPECT_GT(told.slabs_added, 0U);
    EXPECT_TRUE(valid(*editor.head()));
    const auto found = samples_by_place(*editor.head());
    if (run == 0) {
      first = found;
      continue;
    }
    std::size_t common = 0, other = 0;
    for (const auto& [place, alpha] : found) {
      const auto there = first.find(place);
      if (there == first.end()) continue;
      ++common;
      other += there->second != alpha ? 1U : 0U;
    }
    EXPECT_GT(common, first.size() * 9 / 10);
    EXPECT_EQ(other, 0U) << "of " << common << " in run " << run << ", n " << n;
  }
}

TEST(DetailOnDemand, TheDabsOfACarvingGiveTheSameBitsInAnyOrderAndHoweverOften) {
  for (const int n : {8, 32}) expect_any_order(n, PressureDrives::Strength);
}

TEST(DetailOnDemand, DabsOfAllSizesDoSo) {
  for (const int n : {8, 32}) expect_any_order(n, PressureDrives::Radius);
}

TEST(DetailOnDemand, AStrokeDoesWhatItDoesOnAGridThatIsFineFromTheStart) {
  const SnapshotPtr before = coarse(16);
  // 2 cuts of all slabs: spacings of a sixteenth of the radius and less.
  SnapshotPtr fine = before;
  for (int level = 0; level < 2; ++level) {
    Detail all;
    for (SlabId s = 0; s < fine->slab_mesh().slab_count(); ++s) all.cuts.push_back(s);
    for (SlabId s = 0; s < 4 * fine->slab_mesh().slab_count(); ++s)
      all.grids.push_back({.layer = Layer::Displacement, .slab = s, .intervals = 32});
    const auto next = with_detail(fine, all);
    ASSERT_TRUE(next) << next.error().message;
    fine = *next;
  }
  for (const ToolInfo& tool : tools()) {
    if (tool.writes != Layer::Displacement) continue;
    Stroke stroke{
        .brush = {.tool = *tool_from_name(tool.id), .radius = 0.06, .strength = 0.5}, .label = {}, .points = {}};
    const Vec3d from = normalized(Vec3d{0.1, 1, 0.3}), to = normalized(Vec3d{0.35, 1, 0.1});
    for (int k = 0; k <= 10; ++k) {
      const Vec3d way = normalized(from + (to - from) * (k / 10.0));
      stroke.points.push_back({0.02 * k, closest_point(*before, way).position});
    }
    Editor on_demand(before), from_start(fine);
    const StrokeResult told = play(on_demand, stroke);
    stroke.brush.detail = 0;
    play(from_start, stroke);
    EXPECT_TRUE(told.changed) << tool.id;
    EXPECT_TRUE(valid(*on_demand.head())) << tool.id;
    EXPECT_TRUE(valid(*from_start.head())) << tool.id;
    const double off = largest_difference(*on_demand.head(), *from_start.head(), 20);
    // At the rim of a cut the spacing shows, by half of one at the most; the others are smooth, and smoothing works on
    // the grid as it is.
    const double spacing = 0.06 / 12 / 0.4;  // a share of the fibres
    EXPECT_LE(off, tool.action == Action::Cut ? spacing / 2 : tool.action == Action::Even ? 5e-4 : 5e-5) << tool.id;
    EXPECT_EQ(told.slabs_added > 0, tool.action != Action::Even) << tool.id;
  }
}

TEST(DetailOnDemand, EveryToolLeavesEverySnapshotValidWhereEdgesHang) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(0, 1);
  for (const int n : {2, 15, 16}) {
    Editor editor(n == 16 ? displaced(testing::mixed_shell(*sphere_shell(1, 4), 1, 5), bumps) : coarse(n));
    std::size_t added = 0;
    for (int k = 0; k < 24; ++k) {
      const ToolInfo& tool = tools()[static_cast<std::size_t>(k) % tools().size()];
      const Vec3d way = {unit(random) - 0.5, 0.8, unit(random) - 0.5};
      const Brush brush{.tool = *tool_from_name(tool.id),
                        .radius = 0.02 + 0.2 * unit(random) * unit(random),
                        .colour = {0, 0, 1},
                        .height = 0.01};
      editor.begin_stroke(brush);
      for (int d = 0; d < 4; ++d) {
        const Vec3d aside = way + Vec3d{0.3 * d * brush.radius, 0, 0};
        editor.dab(dab_near(*editor.start(), aside, 0.3 * brush.radius, 1, 0.05));
        if (d == 2) {
          ASSERT_TRUE(valid(*editor.head())) << tool.id << ", stroke " << k << ", n " << n;
        }
      }
      added += editor.end_stroke().slabs_added;
      ASSERT_TRUE(valid(*editor.head())) << tool.id << ", stroke " << k << ", n " << n;
    }
    EXPECT_GT(added, 100U);
    EXPECT_TRUE(editor.head()->slab_mesh().is_cut());
  }
}

TEST(DetailOnDemand, PaintRefinesItsOwnGrid) {
  const SnapshotPtr before = coarse(8);
  Editor editor(before);
  const StrokeResult told = [&] {
    editor.begin_stroke({.tool = Tool::Paint, .radius = 0.2, .colour = {1, 0, 0}});
    editor.dab(dab_near(*before, {0.3, 0.8, 0.5}, 0, 1, 0.1));
    return editor.end_stroke();
  }();
  const Snapshot& after = *editor.head();
  EXPECT_TRUE(valid(after));
  EXPECT_GT(told.samples_added, 0U);
  // No displacement sample came with it but where cuts need them.
  EXPECT_EQ(samples_by_place(after), samples_by_place(*before));
  EXPECT_LE(largest_difference(*before, after), 2e-7);
}

TEST(DetailOnDemand, TheEndOfTheClayIsToldAndFadedOnCutSlabsToo) {
  const SnapshotPtr before = coarse(8);
  Editor on_demand(before), as_it_is(before);
  const Dab dab = dab_near(*before, {0.3, 0.8, 0.5}, 0.35);
  const DabResult told = testing::apply(on_demand, {.radius = 0.36}, dab);
  const DabResult of_coarse = testing::apply(as_it_is, {.radius = 0.36, .detail = 0}, dab);
  EXPECT_GT(told.samples_added, 0U);
  ASSERT_GT(of_coarse.limited, 0U);
  // As many samples beyond the clay, counted in the same area; a few less, for a coarse grid fades out over two of its
  // own spacings.
  const SlabMesh& mesh = on_demand.head()->slab_mesh();
  int finest = 0;
  for (SlabId s = 0; s < mesh.slab_count(); ++s) finest = std::max(finest, mesh.intervals(s) << mesh.level(s));
  const double finer = finest / 8.0 * finest / 8.0;
  EXPECT_GT(static_cast<double>(told.limited), 0.6 * finer * static_cast<double>(of_coarse.limited));
  EXPECT_LT(static_cast<double>(told.limited), 1.3 * finer * static_cast<double>(of_coarse.limited));
  testing::for_each_sample(on_demand.head()->slab_mesh(), [&](SlabId s, std::size_t k, GridPoint) {
    EXPECT_GT(on_demand.head()->displacement(s)[k], 0.0F) << "no bare inner triangle";
  });
}

TEST(DetailOnDemand, IsLimitedAndSaysSo) {
  const SnapshotPtr before = coarse(8);
  Editor editor(before);
  const DabResult told =
      testing::apply(editor, {.radius = 0.2, .detail = 1e-4}, dab_near(*before, {0.3, 0.8, 0.5}, 0.05));
  EXPECT_TRUE(told.detail_limited);
  EXPECT_LE(told.slabs_added, 20000U);
  EXPECT_LE(told.samples_added, std::size_t{1} << 22U);
  EXPECT_GT(told.samples_added, std::size_t{1} << 18U);
  EXPECT_TRUE(valid(*editor.head()));

  Editor tiny(before);
  const DabResult of_tiny = testing::apply(tiny, {.radius = 1e-5}, dab_near(*before, {0.3, 0.8, 0.5}, 0.5e-5));
  EXPECT_TRUE(of_tiny.detail_limited) << "no finer than 1e-5 of the diagonal";
  EXPECT_TRUE(valid(*tiny.head()));
}

TEST(DetailOnDemand, AMovingToolRefinesAheadRarely) {
  const SnapshotPtr before = coarse(8);
  Editor editor(before);
  StrokeEngine engine(editor);
  std::size_t dabs = 0, changes = 0;
  engine.on_dab([&](const Dab&, const DabResult& result) {
    ++dabs;
    changes += result.slabs_added > 0 || result.samples_added > 0 ? 1U : 0U;
  });
  engine.begin({.radius = 0.03, .strength = 0.4});
  for (int k = 0; k <= 100; ++k) {
    const double turn = 0.01 * k;
    const StrokePoint p = {0.01 * k, closest_point(*before, {std::sin(turn), std::cos(turn), 0.2}).position};
    engine.move(std::span(&p, 1));
  }
  EXPECT_GT(engine.end().slabs_added, 0U);
  EXPECT_GT(changes, 5U);
  EXPECT_LE(changes, dabs / 8);
  EXPECT_TRUE(valid(*editor.head()));
}

}  // namespace
}  // namespace relief
