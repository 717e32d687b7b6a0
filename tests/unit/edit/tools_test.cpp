// Every row of tools(), whatever it is: what a stroke may change and what it must leave alone. A new tool is tested by
// being there.
#include "edit_support.h"

#include <set>
#include <string>

namespace relief {
namespace {

using testing::for_each_pair;
using testing::same_sample;
using testing::valid;

/// One shell that strokes are tried on.
struct Ground {
  std::string name;
  SnapshotPtr model;
};

bool protected_at(Vec3d p) { return p.z > 0.35; }
bool hole_at(Vec3d p) { return p.z < -0.1 && p.x > 2.2; }

/// A tool that writes the mask finds half of it everywhere, so that it can be raised and lowered.
std::vector<Ground> grounds(const ToolInfo& tool) {
  const auto even = testing::torus_shell(12, 8, 16),
             mixed = testing::mixed_shell(*testing::torus_shell(12, 8, 1), 4, 3);
  std::vector<Ground> all = {
      {"torus", testing::displaced(even, testing::bumps)},
      {"mixed n", testing::displaced(mixed, testing::bumps)},
      {"holes", testing::with_hole(testing::displaced(even, testing::bumps), hole_at)},
      {"mixed n and holes", testing::with_hole(testing::displaced(mixed, testing::bumps), hole_at)}};
  if (tool.writes == Layer::Mask)
    for (Ground& g : all) g.model = testing::with_layer(g.model, Layer::Mask, 16, [](Vec3d) { return 0.5; });
  all.push_back({"masked", testing::with_layer(all[0].model, Layer::Mask, 16,
                                               [](Vec3d p) { return protected_at(p) ? 1.0 : 0.25; })});
  return all;
}

/// Along the outside of the torus, over its bumps.
Stroke stroke_of(Tool tool) {
  Stroke stroke{.brush = {.tool = tool, .radius = 0.3, .detail = 0, .strength = 0.6, .colour = {0, 0.2F, 1}},
                .label = {},
                .points = {}};
  for (int k = 0; k <= 40; ++k) {
    const double turn = -0.12 + 0.3 * k / 40;
    stroke.points.push_back({0.01 * k, {2.8 * std::cos(turn), 0.1, 2.8 * std::sin(turn)}, 0.3 + 0.01 * k});
  }
  return stroke;
}

/// The layer that a tool writes, as it is, or as the tool makes it before it changes anything.
SnapshotPtr with_written_layer(const SnapshotPtr& before, const SnapshotPtr& after, Layer layer) {
  if (before->has(layer)) return before;
  SnapshotDraft draft(before);
  draft.add_layer(layer, after->tile(layer, 0).intervals(), 0);
  if (layer == Layer::Colour)
    for (SlabId s = 0; s < before->slab_mesh().slab_count(); ++s)
      for (int c = 0; c < 3; ++c) {
        Tile& tile = draft.edit(layer, s);
        for (std::size_t k = 0; k < tile.size(); ++k) tile.set(c, k, kClayColour[static_cast<std::size_t>(c)]);
      }
  return draft.finish();
}

class EveryTool : public ::testing::TestWithParam<std::size_t> {
 protected:
  [[nodiscard]] static Tool tool() { return static_cast<Tool>(GetParam()); }
  [[nodiscard]] static const ToolInfo& row() { return tools()[GetParam()]; }
};
INSTANTIATE_TEST_SUITE_P(Rows, EveryTool, ::testing::Range(std::size_t{0}, tools().size()),
                         [](const auto& at) { return std::string(tools()[at.param].id); });

TEST_P(EveryTool, ChangesItsLayerAloneAndLeavesAValidModel) {
  for (const Ground& ground : grounds(row())) {
    Editor editor(ground.model);
    const StrokeResult result = play(editor, stroke_of(tool()));
    EXPECT_TRUE(result.changed) << ground.name;
    EXPECT_GT(result.samples, 50U) << ground.name;
    EXPECT_TRUE(valid(*editor.head())) << ground.name;
    for_each_change(*ground.model, *editor.head(), [&](Layer layer, SlabId) { EXPECT_EQ(layer, row().writes); });
    std::size_t differ = 0;
    const SnapshotPtr before = with_written_layer(ground.model, editor.head(), row().writes);
    for_each_pair(
        *before, *editor.head(), row().writes,
        [&](const Tile& a, const Tile& b, SlabId, std::size_t k, Vec3d) { differ += same_sample(a, b, k) ? 0U : 1U; });
    EXPECT_EQ(result.samples, differ) << ground.name;
  }
}

TEST_P(EveryTool, StaysWithinItsRadius) {
  const double radius = stroke_of(tool()).brush.radius;
  for (const Ground& ground : grounds(row())) {
    Editor editor(ground.model);
    StrokeEngine engine(editor);
    std::vector<Vec3d> places;
    engine.on_dab([&](const Dab& dab, const DabResult&) { places.push_back(dab.contact); });
    engine.begin(stroke_of(tool()).brush);
    engine.move(stroke_of(tool()).points);
    engine.end();
    // A constrained sample follows its two ends, and a sample that has been moved may come nearer than it was.
    const bool same_n = ground.name.find("mixed") == std::string::npos;
    double slack = same_n ? 1e-6 : testing::coarsest_cell(ground.model->slab_mesh());
    if (row().writes == Layer::Displacement) slack += 0.1 * radius;
    const SnapshotPtr before = with_written_layer(ground.model, editor.head(), row().writes);
    std::size_t far = 0;
    for_each_pair(
        *before, *editor.head(), row().writes, [&](const Tile& a, const Tile& b, SlabId s, std::size_t k, Vec3d p) {
          double least = 1e9;
          for (const Vec3d place : places) least = std::min(least, length(p - place));
          if (least <= radius + slack) return;
          ++far;
          EXPECT_TRUE(same_sample(a, b, k)) << ground.name << " slab " << s << " sample " << k << " at " << least;
        });
    EXPECT_GT(far, 1000U);
  }
}

TEST_P(EveryTool, LeavesWhatIsProtectedAndWhatIsAHole) {
  for (const Ground& ground : grounds(row())) {
    if (ground.name.find("mixed") != std::string::npos) continue;  // constrained samples follow their ends
    Editor editor(ground.model);
    EXPECT_TRUE(play(editor, stroke_of(tool())).changed);
    const SnapshotPtr before = with_written_layer(ground.model, editor.head(), row().writes);
    const SlabMesh& mesh = before->slab_mesh();
    const bool masked = ground.name == "masked" && row().writes != Layer::Mask;
    std::size_t kept = 0;
    for (SlabId s = 0; s < mesh.slab_count(); ++s) {
      const Tile &a = before->tile(row().writes, s), &b = editor.head()->tile(row().writes, s);
      const int n = a.intervals();
      for (int j = 0; j <= n; ++j)
        for (int i = 0; i + j <= n; ++i) {
          const double u = double(i) / n, v = double(j) / n;
          const bool hole = before->has(Layer::Void) && layer_at(*before, Layer::Void, s, u, v, 0) > 0.5 + 1e-9;
          if (!hole && !(masked && layer_at(*before, Layer::Mask, s, u, v, 0) > 1 - 1e-9)) continue;
          ++kept;
          EXPECT_TRUE(same_sample(a, b, sample_index(n, {i, j})))
              << ground.name << " slab " << s << " " << i << "," << j;
        }
    }
    EXPECT_EQ(kept > 100, masked || ground.name == "holes") << ground.name;
  }
}

TEST_P(EveryTool, CancelGivesTheStartBack) {
  for (const Ground& ground : grounds(row())) {
    Editor editor(ground.model);
    StrokeEngine engine(editor);
    engine.begin(stroke_of(tool()).brush);
    engine.move(stroke_of(tool()).points);
    EXPECT_NE(editor.head()->content_hash(), ground.model->content_hash());
    engine.cancel();
    EXPECT_EQ(editor.head(), ground.model);
    EXPECT_FALSE(editor.in_stroke());
    // And nothing of it shows in the next stroke.
    Editor fresh(ground.model);
    EXPECT_TRUE(play(editor, stroke_of(tool())).changed);
    play(fresh, stroke_of(tool()));
    EXPECT_EQ(editor.head()->content_hash(), fresh.head()->content_hash()) << ground.name;
  }
}

TEST_P(EveryTool, TwoRunsGiveTheSameBits) {
  for (const Ground& ground : grounds(row())) {
    Editor a(ground.model), b(ground.model);
    const StrokeResult one = play(a, stroke_of(tool())), two = play(b, stroke_of(tool()));
    EXPECT_EQ(a.head()->content_hash(), b.head()->content_hash()) << ground.name;
    EXPECT_EQ(one.samples, two.samples);
    EXPECT_EQ(one.limited, two.limited);
    EXPECT_EQ(one.dabs, two.dabs);
  }
}

TEST_P(EveryTool, DoesNothingWithoutStrength) {
  for (const Ground& ground : grounds(row())) {
    Editor editor(ground.model);
    Stroke stroke = stroke_of(tool());
    stroke.brush.strength = 0;
    EXPECT_FALSE(play(editor, stroke).changed) << ground.name;
    EXPECT_EQ(editor.head(), ground.model);
  }
}

TEST_P(EveryTool, HasSettingsThatAProgramCanShow) {
  const ToolInfo& tool = row();
  EXPECT_FALSE(tool.id.empty());
  EXPECT_FALSE(tool.title.empty());
  EXPECT_FALSE(tool.help.empty());
  EXPECT_EQ(tool.help.back(), '.');
  std::set<std::string_view> ids;
  for (const SettingInfo& info : tool.settings) {
    EXPECT_TRUE(ids.insert(info.id).second) << info.id;
    EXPECT_FALSE(info.title.empty());
    EXPECT_LE(info.min, info.preset) << info.id;
    EXPECT_LE(info.preset, info.max) << info.id;
    EXPECT_GT(info.step, 0) << info.id;
    EXPECT_EQ(info.kind == SettingInfo::Kind::Choice, !info.choices.empty()) << info.id;
    Brush brush;
    if (info.kind == SettingInfo::Kind::Colour || info.kind == SettingInfo::Kind::Curve) {
      // These are no plain number: Brush::colour and Brush::pressure.
      EXPECT_TRUE(info.id == "colour" || info.id == "pressure_curve") << info.id;
      EXPECT_FALSE(setting(brush, info.id));
      EXPECT_FALSE(set(brush, info.id, 1));
      continue;
    }
    for (const double value : {info.min, info.preset, info.max}) {
      EXPECT_TRUE(set(brush, info.id, value)) << info.id;
      EXPECT_EQ(setting(brush, info.id), value) << info.id;
    }
    if (info.kind == SettingInfo::Kind::Choice) {
      EXPECT_EQ(info.max, static_cast<double>(info.choices.size() - 1));
    }
    // It reaches the brush: another value, another brush.
    Brush other = brush;
    EXPECT_TRUE(set(other, info.id, info.min));
    EXPECT_NE(other, brush) << info.id;
  }
  for (const char* wanted : {"radius", "strength"}) EXPECT_TRUE(ids.contains(wanted)) << wanted;
}

TEST(Tools, IdsAndTitlesAreTheirOwn) {
  std::set<std::string_view> ids, titles;
  for (const ToolInfo& tool : tools()) {
    EXPECT_TRUE(ids.insert(tool.id).second) << tool.id;
    EXPECT_TRUE(titles.insert(tool.title).second) << tool.title;
    EXPECT_NE((", " + tool_names() + ",").find(", " + std::string(tool.id) + ","), std::string::npos);
  }
}

TEST(Settings, UnknownOnesAreTold) {
  Brush brush;
  EXPECT_FALSE(setting(brush, "softness"));
  EXPECT_FALSE(set(brush, "softness", 1));
  EXPECT_EQ(brush, Brush{});
}

TEST(Settings, ChoicesStayWithinTheirNumber) {
  Brush brush;
  EXPECT_TRUE(set(brush, "falloff", 99));
  EXPECT_EQ(brush.falloff, Falloff::Dome);
  EXPECT_TRUE(set(brush, "symmetry", -4));
  EXPECT_EQ(brush.symmetry, 0);
  EXPECT_TRUE(set(brush, "exact", 1));
  EXPECT_TRUE(brush.exact);
}

TEST(Falloffs, HaveNames) {
  for (const Falloff f : {Falloff::Own, Falloff::Linear, Falloff::Smooth, Falloff::Dome})
    EXPECT_EQ(falloff_from_name(name(f)), f);
  EXPECT_FALSE(falloff_from_name("square"));
}

}  // namespace
}  // namespace relief
