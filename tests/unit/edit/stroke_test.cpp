// Strokes as they come from a file: what play() makes of them, and what check() refuses.
#include "edit_support.h"

namespace relief {
namespace {

using testing::valid;

Stroke line(Tool tool, double radius, std::vector<StrokePoint> points, double strength = 1) {
  return {.brush = {.tool = tool, .radius = radius, .detail = 0, .strength = strength, .colour = {0, 0, 1}},
          .label = {},
          .points = std::move(points)};
}

double height(Editor& editor, double x, double z) {
  const auto hit = raycast(*editor.head(), {{x, 5, z}, {0, -1, 0}});
  return hit ? hit->point.position.y : -1;
}

TEST(Names, ToolsHaveNames) {
  for (std::size_t k = 0; k < tools().size(); ++k) {
    const auto tool = static_cast<Tool>(k);
    EXPECT_EQ(tool_from_name(name(tool)), tool);
  }
  EXPECT_FALSE(tool_from_name("smear"));
  EXPECT_FALSE(tool_from_name(""));
}

TEST(Play, CarvesToStrengthTimesPressureTimesRadiusWhateverTheBand) {
  for (const double k : {0.0, 0.02}) {
    Editor editor(Snapshot::make(testing::plane_shell(4, 32)));
    Stroke stroke = line(Tool::Carve, 0.2, {{0, {0.3, 0.1, 0.51}, 0.5}}, 0.6);
    stroke.brush.resilience = k;
    EXPECT_TRUE(play(editor, stroke).changed);
    EXPECT_NEAR(height(editor, 0.3, 0.51), -0.6 * 0.5 * 0.2, 1e-3);
  }
}

TEST(Play, AStrokeBetweenTwoPointsLeavesAnEvenGroove) {
  Editor editor(Snapshot::make(testing::plane_shell(4, 64)));
  EXPECT_TRUE(play(editor, line(Tool::Carve, 0.1, {{0, {0.2, 0.1, 0.4}, 0.3}, {1, {0.8, 0.1, 0.4}, 0.3}})).changed);
  // Dabs stand radius/8 apart: the ridges between them are about (r/16)^2 / 2r = 0.0002 high.
  for (double x = 0.2; x <= 0.8; x += 0.01) EXPECT_NEAR(height(editor, x, 0.4), -0.03, 8e-4) << x;
  EXPECT_NEAR(height(editor, 0.5, 0.7), 0, 1e-9);
}

TEST(Play, PressureIsInterpolated) {
  Editor editor(Snapshot::make(testing::plane_shell(4, 64)));
  play(editor, line(Tool::Carve, 0.1, {{0, {0.2, 0, 0.4}, 0}, {1, {0.8, 0, 0.4}, 0.8}}));
  EXPECT_NEAR(height(editor, 0.5, 0.4), -0.04, 2e-3);
  EXPECT_NEAR(height(editor, 0.65, 0.4), -0.06, 2e-3);
}

TEST(Play, RestingWithoutPressureCutsNothing) {
  // A hollow surface that a resting ball would overlap.
  Editor editor(
      testing::displaced(testing::plane_shell(4, 32), [](Vec3d p) { return 0.3 + 1.2 * ((p.x - 0.5) * (p.x - 0.5)); }));
  EXPECT_FALSE(play(editor, line(Tool::Carve, 3, {{0, {0.5, 0, 0.5}, 0}})).changed);
  EXPECT_FALSE(play(editor, line(Tool::Carve, 3, {{0, {0.5, 0, 0.5}, 1}}, 0)).changed);
}

TEST(Play, PointsAreProjectedToTheSurfaceAtTheStart) {
  // Staying in one place does not dig deeper and deeper.
  Editor editor(Snapshot::make(testing::plane_shell(4, 32)));
  std::vector<StrokePoint> points;
  for (int k = 0; k < 50; ++k) points.push_back({0.01 * k, {0.5, 0.09, 0.5}, 0.4});
  play(editor, line(Tool::Carve, 0.1, points));
  EXPECT_NEAR(height(editor, 0.5, 0.5), -0.04, 1e-6);
}

TEST(Play, DepositRaisesTheCentreAtStrengthTimesRadiusPerSecond) {
  for (const int count : {2, 5, 201}) {
    Editor editor(Snapshot::make(testing::plane_shell(4, 32, 0.5)));
    std::vector<StrokePoint> points;
    for (int k = 0; k < count; ++k) points.push_back({1.5 * k / (count - 1), {0.5, 0.1, 0.5}, 0.2});
    play(editor, line(Tool::Deposit, 0.2, points, 0.5));
    EXPECT_NEAR(height(editor, 0.5, 0.5), 0.5 * 0.2 * 1.5, 1e-4);
  }
  Editor editor(Snapshot::make(testing::plane_shell(4, 32)));
  play(editor, line(Tool::Deposit, 0.2, {{3, {0.5, 0.1, 0.5}, 1}}));
  EXPECT_NEAR(height(editor, 0.5, 0.5), 0.2 * 0.1, 1e-5);
}

TEST(Play, TheRateOfDabsDoesNotChangeTheRelief) {
  const auto mesh = testing::torus_shell(12, 8, 15);
  std::vector<SnapshotPtr> reliefs;
  for (const int rate : {250, 500, 1000}) {
    Editor editor(Snapshot::make(mesh));
    std::vector<StrokePoint> points;
    for (int k = 0; k <= rate / 2; ++k) {
      const double t = double(k) / rate;
      points.push_back({t, {2.9 * std::cos(0.4 * t), 0.3, 2.9 * std::sin(0.4 * t)}, 1});
    }
    EXPECT_TRUE(play(editor, line(Tool::Deposit, 0.3, points, 0.7)).changed);
    EXPECT_TRUE(valid(*editor.head()));
    reliefs.push_back(editor.head());
  }
  float highest = 0, gap = 0;
  testing::for_each_sample(*mesh, [&](SlabId s, std::size_t k, GridPoint) {
    const float finest = reliefs[2]->displacement(s)[k];
    highest = std::max(highest, finest - 0.5F);
    for (const int rate : {0, 1})
      gap = std::max(gap, std::abs(reliefs[std::size_t(rate)]->displacement(s)[k] - finest));
  });
  EXPECT_GT(highest, 0.1F);
  EXPECT_LT(gap, 0.01F * highest);
}

TEST(Play, EndsWithTheSameBitsEachTime) {
  std::vector<std::uint64_t> hashes;
  for (int run = 0; run < 2; ++run) {
    Editor editor(testing::displaced(testing::sphere_shell(2, 15), testing::bumps));
    for (const Tool tool : {Tool::Carve, Tool::Deposit, Tool::Paint})
      play(editor, line(tool, 0.2, {{0, {1, 0, 0}, 0.4}, {0.3, {0, 1, 0.2}, 0.6}, {0.5, {-1, 0.5, 0}, 0.1}}));
    EXPECT_TRUE(valid(*editor.head()));
    hashes.push_back(editor.head()->content_hash());
  }
  EXPECT_EQ(hashes[0], hashes[1]);
}

TEST(Play, LeavesOutWhatIsNotFinite) {
  const double nan = std::nan("");
  const auto mesh = testing::plane_shell(4, 15);
  const std::vector<StrokePoint> good = {{0, {0.3, 0, 0.5}, 0.5}, {1, {0.6, 0, 0.5}, 0.5}};
  const std::vector<StrokePoint> bad = {
      good[0], {0.2, {nan, 0, 0}, 1}, {nan, {0.4, 0, 0.4}, 1}, {0.3, {0, 0, 0}, HUGE_VAL}, good[1]};
  Editor a(Snapshot::make(mesh)), b(Snapshot::make(mesh));
  EXPECT_TRUE(play(a, line(Tool::Carve, 0.1, good)).changed);
  EXPECT_TRUE(play(b, line(Tool::Carve, 0.1, bad)).changed);
  EXPECT_EQ(a.head()->content_hash(), b.head()->content_hash());
  Editor c(Snapshot::make(mesh));
  EXPECT_FALSE(play(c, line(Tool::Carve, 0.1, {{0, {nan, 0, 0}, 1}})).changed);
  EXPECT_FALSE(play(c, line(Tool::Carve, 0.1, {})).changed);
  for (const double radius : {0.0, -1.0, nan, double(HUGE_VAL)})
    EXPECT_FALSE(play(c, line(Tool::Carve, radius, good)).changed);
  // 2.4e9 dabs.
  EXPECT_FALSE(play(c, line(Tool::Carve, 1e-9, good)).changed);
  EXPECT_FALSE(play(c, line(Tool::Carve, 1e-300, good)).changed);
  EXPECT_FALSE(c.in_stroke());
  // Points out of reach are left out, as is time that runs backwards.
  const StrokeResult far = play(c, line(Tool::Paint, 0.1, {{0, {0.5, 40, 0.5}, 1}, {1, {0.5, 0.11, 0.5}, 1}}));
  EXPECT_FALSE(far.changed);
  EXPECT_EQ(far.missed, 2U);
  Editor d(Snapshot::make(mesh));
  EXPECT_TRUE(play(c, line(Tool::Deposit, 0.1, {{5, {0.4, 0, 0.5}, 1}, {1, {0.6, 0, 0.5}, 1}})).changed);
  EXPECT_TRUE(play(d, line(Tool::Deposit, 0.1, {{5, {0.4, 0, 0.5}, 1}})).changed);
  EXPECT_EQ(c.head()->content_hash(), d.head()->content_hash());
  EXPECT_TRUE(valid(*c.head()));
}

TEST(Check, NamesWhatIsWrong) {
  const Stroke good = line(Tool::Carve, 0.1, {{0, {0, 0, 0}, 0.5}, {1, {1, 0, 0}, 0.5}});
  EXPECT_TRUE(check(good));
  EXPECT_TRUE(check(line(Tool::Carve, 0.1, {})));
  const auto message = [&](auto&& spoil) {
    Stroke stroke = good;
    spoil(stroke);
    const Status status = check(stroke);
    EXPECT_FALSE(status);
    if (status) return std::string{};
    EXPECT_EQ(status.error().code, Errc::InvalidArgument);
    return status.error().message;
  };
  const double nan = std::nan("");
  const auto expect = [](const std::string& text, const char* part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  expect(message([](Stroke& s) { s.brush.radius = 0; }), "radius is 0");
  expect(message([](Stroke& s) { s.brush.radius = -3; }), "radius is -3");
  expect(message([&](Stroke& s) { s.brush.radius = nan; }), "radius");
  expect(message([](Stroke& s) { s.brush.radius = HUGE_VAL; }), "radius");
  expect(message([](Stroke& s) { s.brush.strength = 1.5; }), "strength is 1.5");
  expect(message([&](Stroke& s) { s.brush.strength = nan; }), "strength");
  expect(message([](Stroke& s) { s.brush.colour.y = 255; }), "colour is 255");
  expect(message([](Stroke& s) { s.brush.resilience = -1; }), "resilience");
  expect(message([](Stroke& s) { s.points[1].pressure = -0.5; }), "pressure at point 2 of the stroke is -0.5");
  expect(message([&](Stroke& s) { s.points[1].position.z = nan; }), "point 2");
  expect(message([&](Stroke& s) { s.points[0].t = nan; }), "point 1");
  expect(message([](Stroke& s) { s.points[1].t = -1; }), "point 2 of the stroke is earlier");
  expect(message([](Stroke& s) { s.brush.radius = 8e-9; }), "10000000 dabs");
  expect(message([](Stroke& s) { s.brush.radius = 1e-300; }), "10000000 dabs");
  expect(message([](Stroke& s) { s.points[1].position.x = 1e300; }), "10000000 dabs");
}

}  // namespace
}  // namespace relief
