// One dab of each tool: against the paper's flood fill, and the promises a sculptor relies on.
#include "edit_support.h"
#include "flood_fill.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <random>

namespace relief {
namespace {

using testing::apply;
using testing::bumps;
using testing::dab_near;
using testing::displaced;
using testing::for_each_sample;
using testing::valid;
using testing::Values;

double largest_gap(const Values& a, const Values& b) {
  double gap = 0;
  for (std::size_t s = 0; s < a.size(); ++s)
    for (std::size_t k = 0; k < a[s].size(); ++k) gap = std::max(gap, std::abs(a[s][k] - b[s][k]));
  return gap;
}

struct Case {
  std::shared_ptr<const SlabMesh> mesh;
  Vec3d at;
  double radius, depth;
};

/// n of all slabs; 0 for slabs of 1 to 32 side by side.
std::vector<Case> cases(int n) {
  std::vector<Case> all = {{testing::sphere_shell(1, std::max(n, 1)), {0.3, 0.9, 0.2}, 0.45, 0.06},
                           {testing::torus_shell(12, 8, std::max(n, 1)), {2.6, 0.4, 0.3}, 0.4, 0.05},
                           {testing::plane_shell(4, std::max(n, 1)), {0.45, 0, 0.55}, 0.3, 0.04}};
  if (n == 0)
    for (Case& c : all) c.mesh = testing::mixed_shell(*c.mesh, 1, 5);
  return all;
}

class Reference : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Intervals, Reference, ::testing::Values(0, 1, 2, 15, 32));

TEST_P(Reference, CarveIsThePapersClip) {
  for (const Case& c : cases(GetParam())) {
    const SnapshotPtr model = displaced(c.mesh, bumps);
    const Brush brush{.tool = Tool::Carve, .radius = c.radius, .detail = 0, .resilience = 0.01, .exact = true};
    const Dab dab = dab_near(*model, c.at, c.depth);
    Editor editor(model);
    const DabResult result = apply(editor, brush, dab);
    const Values want = testing::reference_displacement(*model, brush, dab);
    EXPECT_LE(largest_gap(testing::values_of(*editor.head(), Layer::Displacement), want), 1e-5);
    if (GetParam() >= 15) {
      EXPECT_GT(result.samples, 20U);
    }
    EXPECT_TRUE(valid(*editor.head()));
  }
}

TEST_P(Reference, DepositIsThePapersCone) {
  for (const Case& c : cases(GetParam())) {
    const SnapshotPtr model = displaced(c.mesh, bumps);
    const Brush brush{.tool = Tool::Deposit, .radius = c.radius, .detail = 0, .strength = 0.8};
    const Dab dab = dab_near(*model, c.at, 0, 1, 0.1);
    Editor editor(model);
    const DabResult result = apply(editor, brush, dab);
    const Values want = testing::reference_displacement(*model, brush, dab);
    EXPECT_LE(largest_gap(testing::values_of(*editor.head(), Layer::Displacement), want), 1e-5);
    if (GetParam() >= 15) {
      EXPECT_GT(result.samples, 20U);
    }
    EXPECT_TRUE(valid(*editor.head()));
  }
}

TEST_P(Reference, PaintIsThePapersBlend) {
  for (const Case& c : cases(GetParam())) {
    Editor editor(displaced(c.mesh, bumps));
    const Brush first{
        .tool = Tool::Paint, .radius = c.radius * 0.8, .detail = 0, .strength = 0.9, .colour = {0.1F, 0.9F, 0.4F}};
    apply(editor, first, dab_near(*editor.head(), c.at + Vec3d{0.05, 0.05, 0}, 0, 1, 0.1));
    const SnapshotPtr model = editor.head();
    if (!model->has(Layer::Colour)) continue;  // n = 1 may have no texel within the brush
    const Brush brush{.tool = Tool::Paint, .radius = c.radius, .detail = 0, .strength = 0.7, .colour = {1, 0.2F, 0}};
    const Dab dab = dab_near(*model, c.at, 0, 0.6, 0.02);
    apply(editor, brush, dab);
    for (int channel = 0; channel < 3; ++channel)
      EXPECT_LE(largest_gap(testing::values_of(*editor.head(), Layer::Colour, channel),
                            testing::reference_colour(*model, brush, dab, channel)),
                1e-5);
    EXPECT_TRUE(valid(*editor.head()));
  }
}

TEST(Carve, LeavesTheToolsSphereBehind) {
  const auto mesh = testing::sphere_shell(2, 32);
  for (const double radius : {0.2, 0.5, 5.0, 5000.0}) {
    Editor editor(Snapshot::make(mesh));
    const SnapshotPtr before = editor.head();
    const Dab dab = dab_near(*before, {0.4, 0.8, 0.3}, 0.03);
    apply(editor, {.tool = Tool::Carve, .radius = radius, .detail = 0, .exact = true}, dab);
    const Vec3d centre = dab.cursor + dab.normal * radius;
    std::size_t cut = 0;
    for_each_sample(*mesh, [&](SlabId s, std::size_t k, GridPoint at) {
      if (editor.head()->displacement(s)[k] == before->displacement(s)[k]) return;
      ++cut;
      EXPECT_NEAR(length(sample_position(*editor.head(), s, at) - centre), radius, 1e-5 * 0.4);
    });
    EXPECT_GT(cut, 100U);
  }
}

TEST(Carve, ResilientBandIsNotCut) {
  Editor editor(Snapshot::make(testing::plane_shell(4, 32)));
  const SnapshotPtr before = editor.head();
  const Brush brush{.tool = Tool::Carve, .radius = 0.3, .detail = 0, .resilience = 0.05};
  const Vec3d at = {0.4, 0, 0.61};
  EXPECT_EQ(apply(editor, brush, dab_near(*before, at, 0.049)).samples, 0U);
  EXPECT_EQ(editor.head(), before);
  EXPECT_GT(apply(editor, brush, dab_near(*before, at, 0.06)).samples, 0U);
  // The cut is as deep as the cursor went beyond the band.
  EXPECT_NEAR(closest_point(*editor.head(), {0.4, -0.02, 0.61}).position.y, -0.01, 1e-3);
}

/// On a plane whose fibres lean by an angle, the outermost one that the ball meets touches it. Its start lies beside
/// the ball where it leans so much that it passes under the rim. On a fine grid half a spacing counts.
TEST(Carve, TellsWhatItTakesFromBesideTheBall) {
  constexpr double kRadius = 0.2, kDegree = std::numbers::pi / 180;
  for (const double depth : {0.3, 0.6})
    for (const double lean : {0.0, 20.0, 40.0, 50.0, 60.0}) {
      const double slope = std::tan(lean * kDegree), high = 1 - depth;
      const auto mesh = testing::mapped_shell(*testing::plane_shell(4, 64, 0.2),
                                              [&](Vec3d p) { return Vec3d{p.x + slope * p.y, p.y, p.z}; });
      const double start = (1 - high * std::sin(lean * kDegree)) / std::cos(lean * kDegree);
      const bool passes_under = start * std::sin(lean * kDegree) > high * std::cos(lean * kDegree);
      const double half_spacing = 0.5 / (4 * 64) / kRadius;
      const bool is_beside = passes_under && std::hypot(start, high) > 1 + half_spacing;
      Editor editor(Snapshot::make(mesh));
      const DabResult told = apply(editor, {.tool = Tool::Carve, .radius = kRadius, .detail = 0, .exact = true},
                                   dab_near(*editor.head(), {0.5, 0, 0.5}, depth * kRadius));
      EXPECT_GT(told.samples, 0U);
      EXPECT_EQ(told.beside, is_beside) << lean << " degrees, " << depth << " deep";
    }
}

TEST(Carve, FadesOutBeforeTheClayEnds) {
  const auto mesh = testing::plane_shell(3, 15);
  Editor editor(Snapshot::make(mesh));
  const DabResult told =
      apply(editor, {.tool = Tool::Carve, .radius = 0.3, .detail = 0}, dab_near(*editor.head(), {0.5, 0, 0.5}, 0.25));
  EXPECT_GT(told.limited, 0U);
  float least = 1;
  for_each_sample(
      *mesh, [&](SlabId s, std::size_t k, GridPoint) { least = std::min(least, editor.head()->displacement(s)[k]); });
  EXPECT_GT(least, 0.0F);
  EXPECT_LT(least, 0.25F);
  EXPECT_TRUE(valid(*editor.head()));
}

TEST(Carve, AStrokesDabsGiveTheSameBitsInAnyOrderAndHoweverOftenTheyCome) {
  std::mt19937 random(9);
  std::uniform_real_distribution<double> unit(0, 1);
  for (const auto& mesh :
       {testing::torus_shell(12, 8, 31), testing::mixed_shell(*testing::torus_shell(8, 6, 1), 2, 4)}) {
    const SnapshotPtr model = displaced(mesh, bumps);
    std::vector<Dab> dabs;
    for (int k = 0; k < 12; ++k) {
      dabs.push_back(dab_near(*model, {2.6, 0.3 * unit(random), 0.5 * unit(random)}, 0.1 * unit(random)));
      if (k % 3 == 0) continue;
      dabs.back().swept = true;
      dabs.back().from = dabs[dabs.size() - 2].cursor + dabs[dabs.size() - 2].normal * 0.4;
    }
    std::optional<std::uint64_t> want;
    for (const int times : {1, 10, 100}) {
      Editor editor(model);
      editor.begin_stroke({.tool = Tool::Carve, .radius = 0.4, .detail = 0});
      for (int round = 0; round < times; ++round) {
        std::ranges::shuffle(dabs, random);
        for (const Dab& dab : dabs) editor.dab(dab);
        if (round % 7 == 0) static_cast<void>(editor.head());
      }
      EXPECT_TRUE(editor.end_stroke().changed);
      EXPECT_TRUE(valid(*editor.head()));
      if (!want) want = editor.head()->content_hash();
      EXPECT_EQ(editor.head()->content_hash(), *want) << times;
    }
  }
}

TEST(Carve, MoreStrokesInTheSamePlaceRoundTheRimByLessThanACell) {
  const auto mesh = testing::torus_shell(12, 8, 128);
  const SnapshotPtr before = displaced(mesh, bumps);
  const double radius = 0.4;
  const Brush brush{.tool = Tool::Carve, .radius = radius, .detail = 0};
  // Inside a slab, and on a corner of six.
  for (const Vec3d where : {Vec3d{2.6, 0.4, 0.3}, sample_position(*before, 40, {0, 0})}) {
    Editor editor(before);
    const Dab dab = dab_near(*before, where, 0.09);
    EXPECT_GT(apply(editor, brush, dab).samples, 0U);
    const SnapshotPtr once = editor.head();
    for (int k = 0; k < 20; ++k) apply(editor, brush, dab);
    const Vec3d centre = dab.cursor + dab.normal * radius;
    std::size_t inside = 0;
    double deepest = 0, moved = 0;
    for_each_sample(*mesh, [&](SlabId s, std::size_t k, GridPoint at) {
      const double first = double(once->displacement(s)[k]), last = double(editor.head()->displacement(s)[k]);
      const SlabCorners corners = mesh->corners(s);
      double cell = 0, fibre = 1e9;
      for (std::size_t e = 0; e < 3; ++e) {
        cell = std::max(cell, length(corners.outer[e] - corners.outer[(e + 1) % 3]) / mesh->intervals(s));
        fibre = std::min(fibre, length(corners.fibre(e)));
      }
      deepest = std::max(deepest, (first - last) * fibre / (4 * cell));
      // Two cells inside the widest blend, so that a sample's neighbours lie on the ball as well.
      const double cut = (double(before->displacement(s)[k]) - first) * fibre;
      if (cut < 6 * cell) return;
      EXPECT_NEAR(length(sample_position(*once, s, at) - centre), radius, 2e-6);
      ++inside;
      moved = std::max(moved, std::abs(first - last));
    });
    EXPECT_LE(deepest, 1);
    EXPECT_LE(moved, 1e-6);
    EXPECT_GT(inside, 100U);
  }
}

TEST(Deposit, RaisesTheCentreAtStrengthTimesRadiusPerSecondAndStopsAtTheTop) {
  const auto mesh = testing::plane_shell(2, 32, 0.1);
  Editor editor(Snapshot::make(mesh));
  const Brush brush{.tool = Tool::Deposit, .radius = 0.2, .detail = 0, .strength = 0.5};
  apply(editor, brush, dab_near(*editor.head(), {0.5, 0, 0.5}, 0, 1, 0.1));
  EXPECT_NEAR(closest_point(*editor.head(), {0.5, 0.05, 0.5}).position.y, 0.5 * 0.2 * 0.1, 1e-6);
  apply(editor, brush, dab_near(*editor.head(), {0.5, 0, 0.5}, 0, 1, 1e6));
  EXPECT_NEAR(closest_point(*editor.head(), {0.5, 0.2, 0.5}).position.y, 0.1, 1e-7);
  EXPECT_TRUE(valid(*editor.head()));
}

TEST(Paint, MakesTheColourLayerAndFallsOffLinearly) {
  const auto mesh = testing::plane_shell(2, 15);
  Editor editor(Snapshot::make(mesh));
  const Brush brush{.tool = Tool::Paint, .radius = 0.25, .detail = 0, .strength = 1, .colour = {0, 0, 1}};
  const Dab dab = dab_near(*editor.head(), {0.5, 0, 0.5}, 0, 0.8, 0.05);
  apply(editor, brush, dab);
  const Snapshot& model = *editor.head();
  ASSERT_TRUE(model.has(Layer::Colour));
  EXPECT_EQ(model.tile(Layer::Colour, 0).intervals(), 32);
  for (SlabId s = 0; s < mesh->slab_count(); ++s)
    for (int j = 0; j <= 32; ++j)
      for (int i = 0; i + j <= 32; ++i) {
        const Vec3d p = sample_position(*mesh, s, 32, {i, j}, 0.5);
        const double share = 1 - std::exp(-12 * 0.8 * 0.05 * std::max(0.0, 1 - length(p - dab.contact) / 0.25));
        for (std::size_t c = 0; c < 3; ++c)
          EXPECT_NEAR(double(model.tile(Layer::Colour, s).value(int(c), sample_index(32, {i, j}))),
                      double(brush.colour[c]) * share + double(kClayColour[c]) * (1 - share), 1e-4);
      }
}

TEST(Paint, ColourGridIsCappedAt128) {
  Editor editor(Snapshot::make(testing::plane_shell(1, 100)));
  apply(editor, {.tool = Tool::Paint, .radius = 0.3, .detail = 0}, dab_near(*editor.head(), {0.5, 0, 0.5}, 0, 1, 0.1));
  ASSERT_TRUE(editor.head()->has(Layer::Colour));
  EXPECT_EQ(editor.head()->tile(Layer::Colour, 0).intervals(), 128);
}

TEST(Mask, ProtectsInProportion) {
  const auto mesh = testing::plane_shell(4, 31);
  for (const int mask_grid : {31, 16}) {
    SnapshotDraft draft(Snapshot::make(mesh));
    draft.add_layer(Layer::Mask, mask_grid, 0);
    // Free for x < 0.25, protected for x >= 0.75, between in proportion.
    for (SlabId s = 0; s < mesh->slab_count(); ++s)
      for (int j = 0; j <= mask_grid; ++j)
        for (int i = 0; i + j <= mask_grid; ++i) {
          const double x = sample_position(*mesh, s, mask_grid, {i, j}, 0.5).x;
          draft.edit(Layer::Mask, s).plane()[sample_index(mask_grid, {i, j})] =
              static_cast<float>(std::clamp(2 * x - 0.5, 0.0, 1.0));
        }
    const SnapshotPtr masked = draft.finish(), plain = Snapshot::make(mesh);
    const Dab dab = dab_near(*plain, {0.5, 0, 0.5}, 0.05, 1, 0.1);
    for (const Tool tool : {Tool::Carve, Tool::Deposit}) {
      const Brush brush{.tool = tool, .radius = 0.7, .detail = 0};
      Editor a(masked), b(plain);
      apply(a, brush, dab);
      apply(b, brush, dab);
      EXPECT_TRUE(valid(*a.head()));
      for_each_sample(*mesh, [&](SlabId s, std::size_t k, GridPoint at) {
        const double x = sample_position(*mesh, s, 31, at, 0.5).x;
        const double free = 1 - std::clamp(2 * x - 0.5, 0.0, 1.0);
        const float whole = b.head()->displacement(s)[k] - 0.5F, part = a.head()->displacement(s)[k] - 0.5F;
        // A coarser mask bends within one of its cells of the two corners of the ramp.
        const double slack = mask_grid == 31 ? 1e-6 : 0.02;
        EXPECT_NEAR(double(part), double(whole) * free, std::abs(double(whole)) * slack + 1e-6);
        if (x > 0.78) {
          EXPECT_EQ(part, 0.0F);
        }
      });
    }
    Editor painter(masked);
    apply(painter, {.tool = Tool::Paint, .radius = 0.7, .detail = 0, .colour = {0, 0, 0}}, dab);
    EXPECT_LT(colour_at(*painter.head(), dab.slab, 0.3, 0.3).x, kClayColour.x);
    const SurfacePoint kept = closest_point(*painter.head(), {0.9, 0, 0.5});
    EXPECT_NEAR(double{colour_at(*painter.head(), kept.slab, kept.u, kept.v).x}, double{kClayColour.x}, 0.5 / 65535);
  }
}

TEST(Holes, StayAsTheyAre) {
  const auto is_void = [](Vec3d p) { return p.x > 0.5 && p.z > 0.4; };
  for (const bool uniform : {true, false}) {
    const auto mesh = uniform ? testing::plane_shell(4, 31) : testing::mixed_shell(*testing::plane_shell(4, 1), 1, 5);
    const SnapshotPtr model = testing::with_hole(Snapshot::make(mesh), is_void);
    for (const Tool tool : {Tool::Carve, Tool::Deposit, Tool::Paint}) {
      Editor editor(model);
      apply(editor, {.tool = tool, .radius = 0.45, .detail = 0, .colour = {0, 0, 0}},
            dab_near(*model, {0.45, 0, 0.45}, 0.05, 1, 0.1));
      const Snapshot& after = *editor.head();
      EXPECT_TRUE(valid(after));
      for_each_change(*model, after, [&](Layer layer, SlabId) { EXPECT_NE(layer, Layer::Void); });
      std::size_t worked = 0;
      for (SlabId s = 0; s < mesh->slab_count(); ++s) {
        const Layer layer = tool == Tool::Paint ? Layer::Colour : Layer::Displacement;
        const Tile& tile = after.tile(layer, s);
        const int n = tile.intervals();
        const float untouched = tool == Tool::Paint ? from_u16(to_u16(kClayColour.x)) : 0.5F;
        for (int j = 0; j <= n; ++j)
          for (int i = 0; i + j <= n; ++i) {
            const GridPoint p = {i, j};
            // On an edge the coarser slab may have the last word.
            const bool inside = i > 0 && j > 0 && i + j < n;
            const bool in_hole = layer_at(after, Layer::Void, s, double(i) / n, double(j) / n, 0) > 0.5;
            const float value = tile.value(0, sample_index(n, p));
            if (in_hole && (inside || uniform)) {
              EXPECT_EQ(value, untouched);
            }
            worked += value != untouched ? 1 : 0;
          }
      }
      EXPECT_GT(worked, 20U) << name(tool);
    }
  }
}

TEST(Dab, CountsChangedSamplesOncePerCopy) {
  for (const Tool tool : {Tool::Carve, Tool::Deposit, Tool::Paint}) {
    const auto mesh = testing::sphere_shell(2, 15);
    Editor editor(displaced(mesh, bumps));
    const Brush first{.tool = Tool::Paint, .radius = 0.4, .detail = 0, .colour = {1, 0, 0}};
    apply(editor, first, dab_near(*editor.head(), {0.3, 0.9, 0.2}, 0, 1, 0.1));
    const SnapshotPtr before = editor.head();
    const DabResult result = apply(editor, {.tool = tool, .radius = 0.3, .detail = 0, .colour = {0, 1, 0}},
                                   dab_near(*before, {0.3, 0.9, 0.2}, 0.05, 1, 0.1));
    const Layer layer = tool == Tool::Paint ? Layer::Colour : Layer::Displacement;
    std::size_t differ = 0;
    for (SlabId s = 0; s < mesh->slab_count(); ++s) {
      const Tile &a = before->tile(layer, s), &b = editor.head()->tile(layer, s);
      std::size_t here = 0;
      for (std::size_t k = 0; k < a.size(); ++k) {
        bool differs = false;
        for (int c = 0; c < channels(layer); ++c) differs = differs || a.value(c, k) != b.value(c, k);
        here += differs ? 1 : 0;
      }
      // Tiles that stay as they are stay shared.
      EXPECT_EQ(here == 0, &a == &b);
      differ += here;
    }
    EXPECT_EQ(result.samples, differ);
    EXPECT_GT(differ, 0U);
  }
}

TEST(Dab, HostileNumbersChangeNothing) {
  const SnapshotPtr model = Snapshot::make(testing::sphere_shell(1, 15));
  const double nan = std::nan(""), inf = HUGE_VAL;
  const Dab good = dab_near(*model, {0, 1, 0}, 0.05, 1, 0.1);
  for (const Tool tool : {Tool::Carve, Tool::Deposit, Tool::Paint}) {
    Editor editor(model);
    editor.begin_stroke({.tool = tool, .radius = 0.3, .detail = 0});
    for (const double bad : {nan, inf, -inf}) {
      std::vector<Dab> dabs(8, good);
      dabs[0].contact.x = bad;
      dabs[1].cursor.y = bad;
      dabs[2].normal.z = bad;
      dabs[3].pressure = bad;
      dabs[4].seconds = bad;
      dabs[5].normal = {};
      dabs[6].slab = kNoSlab;
      dabs[7].slab = model->slab_mesh().slab_count();
      for (const Dab& dab : dabs) EXPECT_EQ(editor.dab(dab).samples, 0U);
    }
    EXPECT_EQ(editor.head(), model);
    Dab wild = good;
    wild.contact = wild.cursor = {1e300, -1e300, 1e300};
    EXPECT_EQ(editor.dab(wild).samples, 0U);
    wild = good;
    wild.seconds = 1e300;
    wild.pressure = 1e300;
    editor.dab(wild);
    EXPECT_TRUE(valid(*editor.head()));
    editor.end_stroke();
  }
  for (const double radius : {1e-300, 1e-12, 1e12, 1e300}) {
    Editor editor(model);
    editor.begin_stroke({.tool = Tool::Carve, .radius = radius, .detail = 0});
    editor.dab(good);
    editor.end_stroke();
    EXPECT_TRUE(valid(*editor.head()));
  }
}

TEST(Dab, RandomDabsKeepEveryPromise) {
  std::mt19937 random(20020527);
  std::uniform_real_distribution<double> unit(0, 1), both(-1, 1);
  for (const auto& mesh : {testing::sphere_shell(1, 15), testing::torus_shell(10, 6, 7), testing::double_pyramid(5, 8),
                           testing::plane_shell(3, 1), testing::thin_plate(4, 6, 0.3),
                           testing::mixed_shell(*testing::sphere_shell(1, 1), 3, 3),
                           testing::mixed_shell(*testing::thin_plate(4, 1, 0.3), 1, 4)}) {
    Editor editor(displaced(mesh, bumps));
    for (int k = 0; k < 60; ++k) {
      const Tool tool = static_cast<Tool>(k % static_cast<int>(tools().size()));
      const Vec3d p = Vec3d{both(random), both(random), both(random)} * 2.0;
      const Brush brush{.tool = tool,
                        .radius = 0.02 + unit(random),
                        .detail = 0,
                        .strength = unit(random),
                        .colour = {float(unit(random)), float(unit(random)), float(unit(random))},
                        .resilience = 0.02 * unit(random),
                        .height = 0.1 * both(random),
                        .exact = unit(random) < 0.3};
      const SnapshotPtr before = editor.head();
      apply(editor, brush, dab_near(*before, p, 0.2 * unit(random), unit(random), unit(random)));
      ASSERT_TRUE(valid(*editor.head())) << name(tool) << " dab " << k;
      for_each_sample(*mesh, [&](SlabId s, std::size_t i, GridPoint) {
        const float a = before->displacement(s)[i], b = editor.head()->displacement(s)[i];
        if (tool == Tool::Carve) {
          ASSERT_LE(b, a);
        }
        if (tool == Tool::Deposit || tool == Tool::Clay) {
          ASSERT_GE(b, a);
        }
        if (info(tool).writes != Layer::Displacement) {
          ASSERT_EQ(b, a);
        }
      });
    }
  }
}

}  // namespace
}  // namespace relief
