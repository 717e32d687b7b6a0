// Sections 4 and 5: carving, adding, painting.
#include "support/shells.h"

#include <relief/core/query.h>
#include <relief/edit/editor.h>

#include <gtest/gtest.h>

#include <functional>

namespace relief {
namespace {

using testing::displaced;
using testing::plane_shell;
using testing::sphere_shell;

/// Visits every sample of the displacement with its place in both snapshots.
void each_sample(const Snapshot& before, const Snapshot& after, const std::function<void(Vec3d, Vec3d)>& visit) {
  for (SlabId s = 0; s < before.slab_mesh().slab_count(); ++s) {
    const int n = before.slab_mesh().intervals(s);
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i + j <= n; ++i) visit(sample_position(before, s, {i, j}), sample_position(after, s, {i, j}));
  }
}

/// A dab at a surface point with the cursor `depth` below it.
Dab dab_at(const Snapshot& model, Vec3d near, double depth) {
  const SurfacePoint p = closest_point(model, near);
  return {.slab = p.slab, .contact = p.position, .cursor = p.position - p.normal * depth, .normal = p.normal};
}

TEST(PaperSec4_1, TheSurfaceIsClippedAtTheSphere) {
  const SnapshotPtr before = displaced(plane_shell(4, 15, 0.3), [](Vec3d) { return 0.5; });
  Editor editor(before);
  const double r = 0.2, k = 0.01, depth = 0.08;
  editor.begin_stroke({.tool = Tool::Carve, .radius = r, .detail = 0, .resilience = k, .exact = true});
  const Dab dab = dab_at(*before, {0.52, 0, 0.47}, depth);
  editor.dab(dab);
  editor.end_stroke();
  const Vec3d centre = dab.cursor + dab.normal * (r + k);
  int clipped = 0;
  each_sample(*before, *editor.head(), [&](Vec3d was, Vec3d is) {
    EXPECT_GT(length(is - centre), r - 1e-6) << "geometry that falls inside the sphere is clipped";
    if (length(was - centre) < r - 1e-6) {
      EXPECT_NEAR(length(is - centre), r, 1e-6) << "to the sphere's boundary";
      ++clipped;
    } else {
      EXPECT_LT(length(is - was), 1e-6) << "what lies outside stays";
    }
  });
  EXPECT_GT(clipped, 100);
}

TEST(PaperSec4_1, ResilientBandYieldsWithoutBeingCut) {
  const SnapshotPtr before = displaced(plane_shell(4, 15, 0.3), [](Vec3d) { return 0.5; });
  Editor editor(before);
  editor.begin_stroke({.tool = Tool::Carve, .radius = 0.2, .detail = 0, .resilience = 0.02, .exact = true});
  EXPECT_EQ(editor.dab(dab_at(*before, {0.5, 0, 0.5}, 0.019)).samples, 0U);
  EXPECT_GT(editor.dab(dab_at(*before, {0.5, 0, 0.5}, 0.03)).samples, 0U);
  EXPECT_TRUE(editor.end_stroke().changed);
}

TEST(PaperSec4_1, TheFillCrossesSlabEdgesWithoutASeam) {
  const SnapshotPtr before = Snapshot::make(sphere_shell(2, 15));
  // On a fibre where several slabs meet.
  const SlabCorners c = before->slab_mesh().corners(17);
  Editor editor(before);
  editor.begin_stroke({.tool = Tool::Carve, .radius = 0.35, .detail = 0, .exact = true});
  const DabResult done = editor.dab(dab_at(*before, (c.inner[0] + c.outer[0]) * 0.5, 0.1));
  EXPECT_GE(done.slabs, 4U);
  EXPECT_TRUE(editor.end_stroke().changed);
  EXPECT_TRUE(validate(*editor.head()));
}

TEST(PaperSec4_2, MaterialIsAddedInAConeAtConstantSpeedRegardlessOfPressure) {
  const SnapshotPtr before = displaced(plane_shell(4, 15, 0.3), [](Vec3d) { return 0.4; });
  const double r = 0.2, seconds = 0.3, strength = 0.5;
  std::vector<std::uint64_t> results;
  for (const double pressure : {0.1, 1.0}) {
    Editor editor(before);
    editor.begin_stroke({.tool = Tool::Deposit, .radius = r, .detail = 0, .strength = strength});
    Dab dab = dab_at(*before, {0.5, 0, 0.5}, 0.01);
    dab.pressure = pressure;
    dab.seconds = seconds;
    editor.dab(dab);
    editor.end_stroke();
    each_sample(*before, *editor.head(), [&](Vec3d was, Vec3d is) {
      const double layer = strength * r * seconds * std::max(0.0, 1 - length(was - dab.contact) / r);
      EXPECT_NEAR(is.y - was.y, layer, 1e-6);
    });
    results.push_back(editor.head()->content_hash());
  }
  EXPECT_EQ(results[0], results[1]);
}

TEST(PaperSec4_3, AHeightFieldIsNeverUndercut) {
  // Pressing in from the side of a hill would undercut it; the surface stays one value per fibre, within the slab.
  const SnapshotPtr before =
      displaced(plane_shell(4, 15, 0.4), [](Vec3d p) { return 0.3 + 0.5 * std::exp(-40 * (p.x - 0.5) * (p.x - 0.5)); });
  Editor editor(before);
  editor.begin_stroke({.tool = Tool::Carve, .radius = 0.15, .detail = 0, .exact = true});
  Dab dab = dab_at(*before, {0.40, 0.1, 0.5}, 0.1);
  dab.normal = normalized(Vec3d{-1, 0.2, 0});
  editor.dab(dab);
  editor.end_stroke();
  EXPECT_TRUE(validate(*editor.head()));
  each_sample(*before, *editor.head(), [&](Vec3d was, Vec3d is) {
    EXPECT_NEAR(is.x, was.x, 1e-12);
    EXPECT_LE(is.y, was.y + 1e-12);
  });
}

TEST(PaperSec5, ColourIsBlendedByPressureAndDistance) {
  SnapshotDraft draft(Snapshot::make(plane_shell(4, 15, 0.3)));
  draft.add_layer(Layer::Colour, 32, 0.25F);
  const SnapshotPtr before = draft.finish();
  Editor editor(before);
  const double r = 0.2, pressure = 0.6;
  const Vec3f paint = {1.0F, 0.5F, 0.0F};
  editor.begin_stroke({.tool = Tool::Paint, .radius = r, .detail = 0, .strength = 1, .colour = paint});
  Dab dab = dab_at(*before, {0.5, 0, 0.5}, 0.01);
  dab.pressure = pressure;
  dab.seconds = 0.05;
  editor.dab(dab);
  editor.end_stroke();
  const Snapshot& after = *editor.head();
  for (SlabId s = 0; s < after.slab_mesh().slab_count(); ++s)
    for (int j = 0; j <= 32; ++j)
      for (int i = 0; i + j <= 32; ++i) {
        const Vec3d at = surface_point(after, s, i / 32.0, j / 32.0).position;
        // The paper's share per dab as a rate per second: dabs of any length add up to the same.
        const double rate = info(Tool::Paint).rate * pressure * std::max(0.0, 1 - length(at - dab.contact) / r);
        const double k = 1 - std::exp(-rate * dab.seconds);
        const Vec3f is = colour_at(after, s, i / 32.0, j / 32.0);
        for (std::size_t c = 0; c < 3; ++c)
          EXPECT_NEAR(double{is[c]}, double{paint[c]} * k + 0.25 * (1 - k), 1e-4) << "c_n = c_p k + c_o (1 - k)";
      }
  each_sample(*before, after, [](Vec3d was, Vec3d is) { EXPECT_EQ(was, is) << "painting moves nothing"; });
}

TEST(PaperSec5, LightTouchLeavesNoColour) {
  SnapshotDraft draft(Snapshot::make(plane_shell(2, 15, 0.3)));
  draft.add_layer(Layer::Colour, 32, 0.25F);
  const SnapshotPtr before = draft.finish();
  Editor editor(before);
  editor.begin_stroke({.tool = Tool::Paint, .radius = 0.2, .detail = 0, .colour = {1, 0, 0}});
  Dab dab = dab_at(*before, {0.5, 0, 0.5}, 0.001);
  dab.pressure = 0;
  dab.seconds = 1;
  EXPECT_EQ(editor.dab(dab).samples, 0U);
  EXPECT_FALSE(editor.end_stroke().changed);
}

}  // namespace
}  // namespace relief
