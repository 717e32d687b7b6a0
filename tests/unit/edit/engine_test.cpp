// From the hand's way to dabs: what a stroke does depends on its way and its times, and on nothing else.
#include "edit_support.h"

#include <atomic>
#include <random>
#include <string>
#include <thread>
#include <utility>

namespace relief {
namespace {

using testing::for_each_sample;
using testing::valid;

// ---- However many events tell a way

using Way = StrokePoint (*)(double share);

StrokePoint line(double share) {
  return {0.8 * share, {0.3 + 0.4 * share, 0.02, 0.45 + 0.1 * share}, 0.2 + 0.7 * share};
}

/// Sixteen corners on a circle, in 1.6 s.
StrokePoint round_way(double share) {
  const auto corner = [](double k) {
    const double turn = 2 * std::numbers::pi * k / 16;
    return Vec3d{0.5 + 0.15 * std::cos(turn), 0.01, 0.5 + 0.15 * std::sin(turn)};
  };
  const double at = 16 * share, from = std::min(std::floor(at), 15.0);
  return {1.6 * share, corner(from) + (corner(from + 1) - corner(from)) * (at - from), 0.9 - 0.6 * share};
}

StrokePoint rest(double share) { return {share, {0.52, 0.03, 0.47}, 0.6}; }

std::vector<StrokePoint> events(Way way, int count) {
  std::vector<StrokePoint> points;
  for (int k = 0; k < count; ++k) points.push_back(way(double(k) / (count - 1)));
  return points;
}

/// At times of no order, the corners of round_way() among them.
std::vector<StrokePoint> uneven_events(Way way, int count) {
  std::mt19937 random(3);
  std::vector<double> shares;
  for (int k = 0; k <= 16; ++k) shares.push_back(k / 16.0);
  while (static_cast<int>(shares.size()) < count)
    shares.push_back(std::pow(std::uniform_real_distribution<double>(0, 1)(random), 3));
  std::ranges::sort(shares);
  std::vector<StrokePoint> points;
  for (const double share : shares) points.push_back(way(share));
  return points;
}

SnapshotPtr bumpy_sheet() { return testing::displaced(testing::plane_shell(4, 32), testing::bumps); }

/// What a stroke of a tool makes of the bumpy sheet, half masked where the tool writes the mask.
SnapshotPtr played(Tool tool, const std::vector<StrokePoint>& points, const SnapshotPtr& on,
                   PressureDrives drives = PressureDrives::Strength) {
  Editor editor(on);
  const StrokeResult result = play(editor, {.brush = {.tool = tool,
                                                      .radius = 0.1,
                                                      .detail = 0,
                                                      .strength = 0.7,
                                                      .colour = {0.1F, 0.2F, 1},
                                                      .pressure_drives = drives},
                                            .label = {},
                                            .points = points});
  EXPECT_TRUE(result.changed) << name(tool);
  EXPECT_EQ(result.missed, 0U) << name(tool);
  return editor.head();
}

/// The largest difference of a layer: model units along the fibre for the displacement, the value for others.
double largest_gap(const Snapshot& a, const Snapshot& b, Layer layer) {
  const SlabMesh& mesh = a.slab_mesh();
  double gap = 0;
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    const Tile &ta = a.tile(layer, s), &tb = b.tile(layer, s);
    const double unit = layer == Layer::Displacement ? length(mesh.corners(s).fibre(0)) : 1;
    for (int c = 0; c < ta.channel_count(); ++c)
      for (std::size_t k = 0; k < ta.size(); ++k)
        gap = std::max(gap, unit * std::abs(double(ta.value(c, k)) - double(tb.value(c, k))));
  }
  return gap;
}

class Events : public ::testing::TestWithParam<std::size_t> {
 protected:
  [[nodiscard]] static Tool tool() { return static_cast<Tool>(GetParam()); }
  static SnapshotPtr sheet() {
    const SnapshotPtr bumpy = bumpy_sheet();
    return info(tool()).writes == Layer::Mask ? testing::with_layer(bumpy, Layer::Mask, 32, [](Vec3d) { return 0.5; })
                                              : bumpy;
  }
  /// 1e-4 of the diagonal in height, one part of 255 in colour.
  static void expect_alike(const Snapshot& a, const Snapshot& b, const std::string& what) {
    const Layer layer = info(tool()).writes;
    const double bar = layer == Layer::Displacement ? 1e-4 * diagonal(a.slab_mesh().bounds()) : 1.0 / 255;
    EXPECT_LE(largest_gap(a, b, layer), bar) << what;
  }
};
INSTANTIATE_TEST_SUITE_P(Rows, Events, ::testing::Range(std::size_t{0}, tools().size()),
                         [](const auto& at) { return std::string(tools()[at.param].id); });

TEST_P(Events, OfALineMayBeFewOrMany) {
  const SnapshotPtr on = sheet(), few = played(tool(), events(line, 17), on);
  for (const int count : {2, 171, 1711})
    expect_alike(*few, *played(tool(), events(line, count), on), std::to_string(count));
  expect_alike(*few, *played(tool(), uneven_events(line, 200), on), "uneven");
}

TEST_P(Events, MayBeFewOrManyWherePressureDrivesTheRadius) {
  const SnapshotPtr on = sheet();
  for (const PressureDrives drives : {PressureDrives::Radius, PressureDrives::Both}) {
    const SnapshotPtr few = played(tool(), events(line, 17), on, drives);
    for (const int count : {2, 171})
      expect_alike(*few, *played(tool(), events(line, count), on, drives), std::to_string(count));
    expect_alike(*few, *played(tool(), uneven_events(line, 200), on, drives), "uneven");
    EXPECT_NE(few->content_hash(), played(tool(), events(line, 17), on)->content_hash());
  }
}

TEST_P(Events, OfARoundMayBeFewOrMany) {
  const SnapshotPtr on = sheet(), few = played(tool(), events(round_way, 17), on);
  for (const int count : {161, 1601})
    expect_alike(*few, *played(tool(), events(round_way, count), on), std::to_string(count));
  expect_alike(*few, *played(tool(), uneven_events(round_way, 200), on), "uneven");
}

TEST_P(Events, OfARestingPenMayBeFewOrMany) {
  const SnapshotPtr on = sheet(), few = played(tool(), events(rest, 10), on);
  for (const int count : {2, 1000}) expect_alike(*few, *played(tool(), events(rest, count), on), std::to_string(count));
}

TEST_P(Events, MayComeInOneCallOrOneByOne) {
  const SnapshotPtr on = sheet();
  for (const double stabiliser : {0.0, 0.03}) {
    const Brush brush{.tool = tool(), .radius = 0.1, .detail = 0, .strength = 0.7, .stabiliser = stabiliser};
    const std::vector<StrokePoint> points = uneven_events(round_way, 100);
    Editor a(on), b(on);
    StrokeEngine one(a), many(b);
    one.begin(brush);
    one.move(points);
    one.end();
    many.begin(brush);
    for (const StrokePoint& p : points) {
      many.move({});
      many.move({&p, 1});
      // A session looks at the head in between.
      static_cast<void>(b.head());
    }
    many.end();
    EXPECT_NE(a.head()->content_hash(), on->content_hash());
    EXPECT_EQ(a.head()->content_hash(), b.head()->content_hash());
  }
}

TEST(Ways, ADepositThatMovesLaysAnEvenRidge) {
  // Each place is under a fall-off of 1 - |x| / r for 2 r / v seconds, which makes strength * r * r / v.
  for (const double speed : {0.2, 1.0}) {
    Editor editor(Snapshot::make(testing::plane_shell(4, 64)));
    const double radius = 0.1, strength = 0.2 * speed, want = strength * radius * radius / speed;
    play(editor, {.brush = {.tool = Tool::Deposit, .radius = radius, .detail = 0, .strength = strength},
                  .label = {},
                  .points = {{0, {0.2, 0, 0.5}, 1}, {0.6 / speed, {0.8, 0, 0.5}, 1}}});
    for (double x = 0.32; x <= 0.68; x += 0.0043) {
      const auto hit = raycast(*editor.head(), {{x, 1, 0.5}, {0, -1, 0}});
      ASSERT_TRUE(hit);
      EXPECT_NEAR(hit->point.position.y, want, 0.01 * want) << x;
    }
  }
}

// ---- The stabiliser

/// Where the tool was at each dab of a stroke over the plane.
std::vector<Vec3d> places(const Brush& brush, const std::vector<StrokePoint>& points) {
  Editor editor(Snapshot::make(testing::plane_shell(4, 16)));
  StrokeEngine engine(editor);
  std::vector<Vec3d> found;
  engine.on_dab([&](const Dab& dab, const DabResult&) { found.push_back(dab.contact); });
  engine.begin(brush);
  engine.move(points);
  engine.end();
  return found;
}

constexpr Brush kTrailing{.tool = Tool::Paint, .radius = 0.08, .detail = 0, .stabiliser = 0.1};

TEST(Stabiliser, TheWayIsTheSameForFewAndManyEvents) {
  const std::vector<Vec3d> few = places(kTrailing, events(line, 17)), many = places(kTrailing, events(line, 1711));
  ASSERT_EQ(few.size(), many.size());
  ASSERT_GT(few.size(), 50U);
  for (std::size_t k = 0; k < few.size(); ++k) EXPECT_LE(length(few[k] - many[k]), 1e-3 * kTrailing.radius) << k;
}

TEST(Stabiliser, TrailsTheHandByItsLength) {
  // On a straight way the gap to the hand after a way s is L (1 - exp(-s / L)); the tool stands on the line.
  Editor editor(Snapshot::make(testing::plane_shell(4, 16)));
  StrokeEngine engine(editor);
  Vec3d at;
  engine.on_dab([&](const Dab& dab, const DabResult&) { at = dab.contact; });
  engine.begin(kTrailing);
  for (int k = 0; k <= 100; ++k) {
    const StrokePoint p{0.008 * k, {0.2 + 0.006 * k, 0, 0.5}, 1};
    engine.move({&p, 1});
    const double want = 0.1 * (1 - std::exp(-0.006 * k / 0.1));
    EXPECT_NEAR(p.position.x - at.x, want, 1.01 * kTrailing.radius / 16) << k;
    EXPECT_NEAR(at.z, 0.5, 1e-9);
  }
  engine.end();
}

TEST(Stabiliser, AZigzagLosesMoreThanHalfOfItsHeight) {
  const double high = 0.02;
  std::vector<StrokePoint> points;
  for (int k = 0; k <= 32; ++k)
    points.push_back({0.05 * k, {0.1 + 0.025 * k, 0, 0.5 + (k % 4 == 1 ? high : k % 4 == 3 ? -high : 0.0)}, 1});
  double most = 0, plain = 0;
  for (const Vec3d p : places(kTrailing, points)) most = std::max(most, std::abs(p.z - 0.5));
  Brush direct = kTrailing;
  direct.stabiliser = 0;
  for (const Vec3d p : places(direct, points)) plain = std::max(plain, std::abs(p.z - 0.5));
  EXPECT_GT(plain, 0.85 * high);
  EXPECT_LT(most, 0.5 * high);
}

TEST(Stabiliser, EndsWhereTheHandDid) {
  for (const Way way : {line, round_way}) {
    const std::vector<Vec3d> all = places(kTrailing, events(way, 50));
    const Vec3d hand = way(1).position;
    EXPECT_LE(std::hypot(all.back().x - hand.x, all.back().z - hand.z), 1e-9);
  }
}

// ---- Pressure

TEST(Pressure, TheCurveGoesFromLowToHigh) {
  const PressureCurve curve{.low = 0.2, .high = 0.8, .exponent = 2};
  const std::vector<std::pair<double, double>> wanted = {{0, 0},      {0.2, 0}, {0.35, 0.0625},
                                                         {0.5, 0.25}, {0.8, 1}, {1, 1}};
  for (const auto& [hand, tool] : wanted) EXPECT_NEAR(curve(hand), tool, 1e-12) << hand;
  EXPECT_EQ(PressureCurve{}(0.3), 0.3);
  EXPECT_EQ((PressureCurve{.low = 0, .high = 1, .exponent = 0.5}(0.25)), 0.5);
}

double height(const Snapshot& model, double x, double z) {
  const auto hit = raycast(model, {{x, 5, z}, {0, -1, 0}});
  return hit ? hit->point.position.y : -1e9;
}

TEST(Pressure, DrivesTheDepthThroughTheCurve) {
  const SnapshotPtr plane = Snapshot::make(testing::plane_shell(4, 32));
  for (const double hand : {0.3, 0.5, 0.7, 1.0}) {
    Editor editor(plane);
    const PressureCurve curve{.low = 0.2, .high = 0.8, .exponent = 2};
    play(editor, {.brush = {.tool = Tool::Carve, .radius = 0.2, .detail = 0, .strength = 0.4, .pressure = curve},
                  .label = {},
                  .points = {{0, {0.5, 0, 0.5}, hand}}});
    const double share = std::clamp((hand - 0.2) / 0.6, 0.0, 1.0);
    EXPECT_NEAR(height(*editor.head(), 0.5, 0.5), -0.4 * share * share * 0.2, 1e-4) << hand;
  }
}

TEST(Pressure, BelowTheCurveNothingHappens) {
  for (const ToolInfo& tool : tools()) {
    if (!tool.by_pressure) continue;
    Editor editor(bumpy_sheet());
    Stroke stroke{
        .brush = {.tool = *tool_from_name(tool.id), .radius = 0.1, .detail = 0, .pressure = {.low = 0.5, .high = 1}},
        .label = {},
        .points = events(line, 20)};
    for (StrokePoint& p : stroke.points) p.pressure = 0.4;
    EXPECT_FALSE(play(editor, stroke).changed) << tool.id;
  }
}

constexpr std::array kAllDriven = {PressureDrives::Strength, PressureDrives::Radius, PressureDrives::Both};

TEST(Pressure, DrivesTheRadiiOfDabsInTheCurvesProportion) {
  const PressureCurve curve{.low = 0.1, .high = 0.95, .exponent = 1.7};
  const SnapshotPtr plane = Snapshot::make(testing::plane_shell(4, 32));
  for (const PressureDrives drives : kAllDriven) {
    Editor editor(plane);
    StrokeEngine engine(editor);
    std::vector<Dab> dabs;
    engine.on_dab([&](const Dab& dab, const DabResult&) { dabs.push_back(dab); });
    const Brush brush{.tool = Tool::Carve, .radius = 0.1, .detail = 0, .pressure = curve, .pressure_drives = drives};
    engine.begin(brush);
    engine.move(events(line, 30));
    engine.end();
    ASSERT_GT(dabs.size(), 50U);
    for (std::size_t k = 0; k < dabs.size(); ++k) {
      const double hand = 0.2 + 0.7 * (dabs[k].contact.x - 0.3) / 0.4, pressed = curve(hand);
      EXPECT_NEAR(dabs[k].size, drives == PressureDrives::Strength ? 1 : pressed, 1e-6) << name(drives);
      EXPECT_NEAR(dabs[k].pressure, drives == PressureDrives::Radius ? 1 : pressed, 1e-6) << name(drives);
      if (k == 0) continue;
      const double gone =
          std::hypot(dabs[k].contact.x - dabs[k - 1].contact.x, dabs[k].contact.z - dabs[k - 1].contact.z);
      EXPECT_LE(gone, brush.radius * dabs[k - 1].size / 16 + 1e-9) << "thin dabs lie closer together";
    }
  }
}

TEST(Pressure, OnTheRadiusIsAToolOfThatRadius) {
  for (const ToolInfo& tool : tools()) {
    SnapshotPtr on = testing::displaced(testing::sphere_shell(1, 8), testing::bumps);
    // There must be a mask to be taken away.
    if (tool.writes == Layer::Mask) on = testing::with_layer(on, Layer::Mask, 8, [](Vec3d) { return 0.5; });
    const auto stroke = [&](double radius, double pressure, PressureDrives drives) {
      Editor editor(on);
      Stroke made{.brush = {.tool = *tool_from_name(tool.id),
                            .radius = radius,
                            .strength = 0.4,
                            .colour = {0, 0, 1},
                            .height = 0.02,
                            .pressure_drives = drives,
                            .stabiliser = 0.05,
                            .symmetry = 1},
                  .label = {},
                  .points = {}};
      for (int k = 0; k < 12; ++k)
        made.points.push_back({0.02 * k,
                               closest_point(*on, {0.95 * std::cos(0.05 * k), 0.95 * std::sin(0.05 * k), 0.3}).position,
                               pressure});
      EXPECT_TRUE(play(editor, made).changed) << tool.id;
      EXPECT_TRUE(valid(*editor.head()));
      return editor.head()->content_hash();
    };
    // Halves are exact, so it is the same to the bit: dabs, grid, and what they do.
    EXPECT_EQ(stroke(0.2, 0.5, PressureDrives::Radius), stroke(0.1, 1, PressureDrives::Strength)) << tool.id;
    EXPECT_EQ(stroke(0.2, 0.5, PressureDrives::Both), stroke(0.1, 0.5, PressureDrives::Strength)) << tool.id;
    EXPECT_EQ(stroke(0.2, 0.5, PressureDrives::Radius) == stroke(0.2, 0.5, PressureDrives::Both), !tool.by_pressure);
  }
}

TEST(Pressure, OnTheRadiusCutsAsDeepAsEachPlaceOfTheWaySays) {
  const SnapshotPtr plane = Snapshot::make(testing::plane_shell(4, 64));
  for (const bool lighter : {false, true}) {
    Editor editor(plane);
    Stroke stroke{.brush = {.tool = Tool::Carve,
                            .radius = 0.1,
                            .detail = 0,
                            .strength = 0.5,
                            .pressure_drives = PressureDrives::Radius},
                  .label = {},
                  .points = {{0, {0.3, 0, 0.5}, lighter ? 1 : 0.25}, {0.4, {0.7, 0, 0.5}, lighter ? 0.25 : 1}}};
    play(editor, stroke);
    for (double x = 0.35; x < 0.65; x += 0.01) {
      const double share = (x - 0.3) / 0.4, hand = lighter ? 1 - 0.75 * share : 0.25 + 0.75 * share;
      EXPECT_NEAR(height(*editor.head(), x, 0.5), -0.5 * hand * 0.1, 0.02 * 0.1) << x;
      // The groove is as wide as a ball that goes in to half of its radius.
      const double wide = std::sqrt(0.75) * hand * 0.1;
      EXPECT_LT(height(*editor.head(), x, 0.5 + 0.7 * wide), -0.1 * hand * 0.1) << x;
      EXPECT_GT(height(*editor.head(), x, 0.5 + 1.3 * wide), -1e-4) << x;
    }
  }
}

TEST(Pressure, OnTheRadiusLeavesALayerItsHeight) {
  Editor editor(Snapshot::make(testing::plane_shell(4, 32)));
  play(editor, {.brush = {.tool = Tool::Layer, .radius = 0.2, .detail = 0, .pressure_drives = PressureDrives::Radius},
                .label = {},
                .points = {{0, {0.5, 0, 0.5}, 0.5}, {2, {0.5, 0, 0.5}, 0.5}}});
  EXPECT_NEAR(height(*editor.head(), 0.5, 0.5), 0.02, 2e-4) << "10 % of the brush's radius";
}

TEST(Pressure, OnTheRadiusEndsAtASixtyFourthOfIt) {
  for (const ToolInfo& tool : tools()) {
    const auto changed = [&](double pressure) {
      Editor editor(bumpy_sheet());
      Stroke stroke{.brush = {.tool = *tool_from_name(tool.id),
                              .radius = 0.4,
                              .detail = 0,
                              .colour = {0, 0, 1},
                              .pressure_drives = PressureDrives::Radius},
                    .label = {},
                    .points = events(line, 20)};
      if (tool.id == "unmask")
        editor = Editor(testing::with_layer(bumpy_sheet(), Layer::Mask, 32, [](Vec3d) { return 0.5; }));
      for (StrokePoint& p : stroke.points) p.pressure = pressure;
      EXPECT_TRUE(check(stroke)) << "no more dabs than a stroke may have";
      const StrokeResult result = play(editor, stroke);
      EXPECT_EQ(result.missed, 0U) << tool.id;
      return result.changed;
    };
    EXPECT_FALSE(changed(0)) << tool.id;
    EXPECT_FALSE(changed(0.99 / 64)) << tool.id;
    EXPECT_TRUE(changed(4.0 / 64)) << tool.id;
  }
}

// ---- Symmetry

class Symmetry : public ::testing::TestWithParam<std::size_t> {};
INSTANTIATE_TEST_SUITE_P(Rows, Symmetry, ::testing::Range(std::size_t{0}, tools().size()),
                         [](const auto& at) { return std::string(tools()[at.param].id); });

/// By place on the middle surface, to 1e-6.
using ByPlace = std::map<std::array<long, 3>, std::array<float, 3>>;
std::array<long, 3> place_of(Vec3d p) {
  return {std::lround(p.x * 1e6), std::lround(p.y * 1e6), std::lround(p.z * 1e6)};
}

TEST_P(Symmetry, GivesEachImageTheMirrorOfTheChange) {
  const auto tool = static_cast<Tool>(GetParam());
  const Layer layer = info(tool).writes;
  for (const Vec3d centre : {Vec3d{}, Vec3d{1.5, -0.75, 3}}) {
    // A round octahedron is its own mirror image in all three planes, and so are these bumps.
    const auto mesh = testing::sphere_shell(2, 16, 0.8, 1.2, centre);
    SnapshotPtr on = testing::displaced(mesh, [&](Vec3d p) {
      const Vec3d q = p - centre;
      return testing::bumps({std::abs(q.x), std::abs(q.y), std::abs(q.z)});
    });
    if (layer == Layer::Mask) on = testing::with_layer(on, Layer::Mask, 16, [](Vec3d) { return 0.5; });
    // In the octant x, y, z > 0, too far from the planes to reach them.
    Stroke stroke{
        .brush = {.tool = tool, .radius = 0.2, .detail = 0, .strength = 0.8, .colour = {0, 0, 1}, .mirror = centre},
        .label = {},
        .points = {}};
    for (int k = 0; k <= 20; ++k)
      stroke.points.push_back(
          {0.02 * k, centre + normalized(Vec3d{0.5 + 0.01 * k, 0.55, 0.6 - 0.01 * k}), 0.3 + 0.02 * k});
    Editor alone(on);
    EXPECT_TRUE(play(alone, stroke).changed);
    const auto values = [&](const Snapshot& model, const auto& visit) {
      for (SlabId s = 0; s < mesh->slab_count(); ++s) {
        const Tile& tile = model.tile(layer, s);
        const int n = tile.intervals();
        for (int j = 0; j <= n; ++j)
          for (int i = 0; i + j <= n; ++i) {
            std::array<float, 3> v{};
            for (int c = 0; c < tile.channel_count(); ++c)
              v[static_cast<std::size_t>(c)] = tile.value(c, sample_index(n, {i, j}));
            visit(sample_position(*mesh, s, n, {i, j}, 0.5) - centre, v);
          }
      }
    };
    ByPlace once;
    values(*alone.head(), [&](Vec3d p, const std::array<float, 3>& v) { once[place_of(p)] = v; });
    for (const unsigned planes : {1U, 2U, 4U, 3U, 7U}) {
      stroke.brush.symmetry = static_cast<std::uint8_t>(planes);
      Editor editor(on);
      EXPECT_TRUE(play(editor, stroke).changed);
      EXPECT_TRUE(valid(*editor.head()));
      double gap = 0;
      std::size_t unknown = 0;
      values(*editor.head(), [&](Vec3d p, const std::array<float, 3>& v) {
        for (std::size_t axis = 0; axis < 3; ++axis)
          if ((planes >> axis & 1U) != 0) p[axis] = std::abs(p[axis]);
        const auto found = once.find(place_of(p));
        if (found == once.end())
          ++unknown;
        else
          for (std::size_t c = 0; c < 3; ++c) gap = std::max(gap, std::abs(double(v[c]) - double(found->second[c])));
      });
      EXPECT_EQ(unknown, 0U);
      // Colours may round to the next of 16 bits.
      EXPECT_LE(gap, layer == Layer::Colour ? 1.1 / 65535 : 1e-5) << planes;
    }
  }
}

TEST(MirrorImages, OneOutOfReachIsLeftOutAlone) {
  const SnapshotPtr on = bumpy_sheet();
  Editor a(on), b(on);
  Stroke stroke{.brush = {.tool = Tool::Carve, .radius = 0.1, .detail = 0}, .label = {}, .points = events(line, 40)};
  const StrokeResult plain = play(a, stroke);
  // The mirror plane x = -1: its image lies beside the sheet.
  stroke.brush.symmetry = 1;
  stroke.brush.mirror = {-1, 0, 0};
  const StrokeResult mirrored = play(b, stroke);
  EXPECT_TRUE(plain.changed);
  EXPECT_EQ(plain.dabs, mirrored.dabs);
  EXPECT_EQ(mirrored.missed, 0U);
  EXPECT_EQ(a.head()->content_hash(), b.head()->content_hash());
}

// ---- The tip

TEST(Tip, CutsDownToItsPoints) {
  const SnapshotPtr plane = Snapshot::make(testing::plane_shell(4, 64));
  const double radius = 0.1;
  for (const double band : {0.0, 0.01})
    for (const double deep : {0.02, 0.05}) {
      Editor editor(plane);
      const Stroke stroke{
          .brush = {.tool = Tool::Carve, .radius = radius, .detail = 0, .strength = 0.1, .resilience = band},
          .label = {},
          .tip = true,
          .points = {{0, {0.3, -deep, 0.5}, 0.1}, {1, {0.7, -deep, 0.5}, 0.9}}};
      const StrokeResult result = play(editor, stroke);
      EXPECT_TRUE(result.changed);
      EXPECT_EQ(result.missed, 0U);
      // Chords of the grid lie above the ball by h^2 / 8r = 2e-5.
      for (double x = 0.3; x <= 0.7; x += 0.0101) EXPECT_NEAR(height(*editor.head(), x, 0.5), band - deep, 4e-5) << x;
      // Aside the ball, and nothing beyond it.
      for (const double aside : {0.01, 0.02})
        EXPECT_NEAR(height(*editor.head(), 0.5, 0.5 + aside),
                    band - deep + radius - std::sqrt(radius * radius - aside * aside), 1e-4);
      EXPECT_EQ(height(*editor.head(), 0.5, 0.65), 0);
    }
}

TEST(Tip, FewOrManyEventsCutAlike) {
  const SnapshotPtr on = bumpy_sheet();
  std::vector<SnapshotPtr> cuts;
  for (const int count : {17, 171, 1711}) {
    Editor editor(on);
    Stroke stroke{.brush = {.tool = Tool::Carve, .radius = 0.1, .detail = 0},
                  .label = {},
                  .tip = true,
                  .points = events(line, count)};
    for (StrokePoint& p : stroke.points) p.position.y = -0.06;
    EXPECT_TRUE(play(editor, stroke).changed);
    cuts.push_back(editor.head());
  }
  const double bar = 1e-4 * diagonal(on->slab_mesh().bounds());
  EXPECT_LE(largest_gap(*cuts[0], *cuts[1], Layer::Displacement), bar);
  EXPECT_LE(largest_gap(*cuts[0], *cuts[2], Layer::Displacement), bar);
}

TEST(Tip, AboveTheSurfaceItCutsNothing) {
  Editor editor(Snapshot::make(testing::plane_shell(4, 32)));
  EXPECT_FALSE(play(editor, {.brush = {.tool = Tool::Carve, .radius = 0.1, .detail = 0},
                             .label = {},
                             .tip = true,
                             .points = {{0, {0.4, 0.01, 0.5}, 1}, {1, {0.6, 0.01, 0.5}, 1}}})
                   .changed);
}

TEST(Tip, DownARampItLeavesACylinder) {
  // Down and up again, on fibres that stand and that lean by 15 degrees both ways.
  for (const double lean : {0.0, 0.27, -0.27})
    for (const double slope : {0.4, -0.4}) {
      const auto mesh = testing::mapped_shell(*testing::plane_shell(4, 128, 0.4),
                                              [&](Vec3d p) { return Vec3d{p.x + lean * p.y, p.y, p.z}; });
      Editor editor(Snapshot::make(mesh));
      const double radius = 0.1, middle = -0.09;
      const Stroke stroke{
          .brush = {.tool = Tool::Carve, .radius = radius, .detail = 0, .exact = true},
          .label = {},
          .tip = true,
          .points = {{0, {0.3, middle + 0.2 * slope, 0.5}, 1}, {1, {0.7, middle - 0.2 * slope, 0.5}, 1}}};
      EXPECT_TRUE(play(editor, stroke).changed);
      double worst = 0;
      for (double x = 0.45; x <= 0.55; x += 0.0037)
        for (double aside = 0; aside <= 0.05; aside += 0.01) {
          const double want =
              middle - slope * (x - 0.5) + radius - std::sqrt((radius * radius - aside * aside) * (1 + slope * slope));
          worst = std::max(worst, std::abs(height(*editor.head(), x, 0.5 + aside) - want));
        }
      EXPECT_LE(worst, 0.01 * radius) << lean << " " << slope;
    }
}

TEST(Tip, DeeperThanItsRadiusItStillCuts) {
  const auto mesh = testing::plane_shell(4, 64, 0.5);
  Editor editor(Snapshot::make(mesh));
  const StrokeResult result = play(editor, {.brush = {.tool = Tool::Carve, .radius = 0.1, .detail = 0},
                                            .label = {},
                                            .tip = true,
                                            .points = {{0, {0.5, 0.05, 0.5}, 1}, {1, {0.5, -0.25, 0.5}, 1}}});
  EXPECT_TRUE(result.changed);
  EXPECT_NEAR(height(*editor.head(), 0.5, 0.5), -0.25, 1e-3);
}

// ---- Reach

TEST(OutOfReach, AStrokeThatLeavesAndComesBackWorksAtBothEnds) {
  for (const ToolInfo& tool : tools()) {
    const SnapshotPtr start = bumpy_sheet();
    const SnapshotPtr on =
        tool.writes == Layer::Mask ? testing::with_layer(start, Layer::Mask, 32, [](Vec3d) { return 0.5; }) : start;
    const auto dab_count = [&](const std::vector<StrokePoint>& points, SnapshotPtr& after) {
      Editor editor(on);
      const StrokeResult result = play(
          editor,
          {.brush = {.tool = *tool_from_name(tool.id), .radius = 0.08, .detail = 0}, .label = {}, .points = points});
      after = editor.head();
      return result;
    };
    // Two taps far from each other, and between them up to where nothing is in reach.
    SnapshotPtr both, here, there;
    const std::vector<StrokePoint> first = {{0, {0.25, 0.02, 0.5}, 0.8}, {0.3, {0.3, 0.02, 0.5}, 0.8}};
    const std::vector<StrokePoint> last = {{0.9, {0.7, 0.02, 0.5}, 0.8}, {1.2, {0.75, 0.02, 0.5}, 0.8}};
    std::vector<StrokePoint> all = first;
    for (const double x : {0.3, 0.5, 0.7}) all.push_back({0.3 + x, {x, 0.9, 0.5}, 0.8});
    all.insert(all.end(), last.begin(), last.end());
    for (StrokePoint& p : all)
      if (&p - all.data() >= 5) p.t += 0.3;
    const StrokeResult result = dab_count(all, both);
    EXPECT_TRUE(result.changed) << tool.id;
    EXPECT_EQ(result.missed, 3U) << tool.id;
    // In the middle nothing, at the ends as much as each end does alone.
    dab_count(first, here);
    dab_count(last, there);
    const Layer layer = tool.writes;
    const auto changed_at = [&](const Snapshot& model, double x) {
      double most = 0;
      const SlabMesh& mesh = model.slab_mesh();
      for (SlabId s = 0; s < mesh.slab_count(); ++s) {
        const Tile& tile = model.tile(layer, s);
        const int n = tile.intervals();
        for (int j = 0; j <= n; ++j)
          for (int i = 0; i + j <= n; ++i) {
            const Vec3d p = sample_position(mesh, s, n, {i, j}, 0.5);
            if (std::abs(p.x - x) > 0.06) continue;
            const std::size_t k = sample_index(n, {i, j});
            const float before = on->has(layer) ? on->tile(layer, s).value(0, k) : from_u16(to_u16(kClayColour.x));
            most = std::max(most, std::abs(double(tile.value(0, k)) - double(before)));
          }
      }
      return most;
    };
    EXPECT_EQ(changed_at(*both, 0.5), 0) << tool.id;
    EXPECT_GE(changed_at(*both, 0.27), 0.9 * changed_at(*here, 0.27)) << tool.id;
    EXPECT_GE(changed_at(*both, 0.73), 0.9 * changed_at(*there, 0.73)) << tool.id;
    EXPECT_GT(changed_at(*here, 0.27), 0) << tool.id;
    EXPECT_GT(changed_at(*there, 0.73), 0) << tool.id;
  }
}

TEST(OutOfReach, EachOfManyPointsIsCounted) {
  // Up to 0.2 above the plane and down again at 1 kHz: those above 0.1 are out of reach.
  Editor editor(Snapshot::make(testing::plane_shell(4, 32)));
  std::vector<StrokePoint> points;
  std::size_t above = 0;
  for (int k = 0; k <= 1000; ++k) {
    const double y = 0.2 * std::sin(std::numbers::pi * k / 1000);
    points.push_back({0.001 * k, {0.3 + 0.0004 * k, y, 0.5}, 1});
    above += y > 0.1 ? 1U : 0U;
  }
  const StrokeResult result =
      play(editor, {.brush = {.tool = Tool::Paint, .radius = 0.1, .detail = 0}, .label = {}, .points = points});
  EXPECT_TRUE(result.changed);
  // Points between two dabs, up to 8 ms apart, share what became of the first, at both crossings.
  EXPECT_NEAR(double(result.missed), double(above), 16);
}

TEST(OutOfReach, PointsAreCountedAndChangeNothing) {
  for (const ToolInfo& tool : tools()) {
    Editor editor(bumpy_sheet());
    const SnapshotPtr before = editor.head();
    std::vector<StrokePoint> points = events(line, 9);
    for (StrokePoint& p : points) p.position.y += 5;
    const StrokeResult result =
        play(editor,
             {.brush = {.tool = *tool_from_name(tool.id), .radius = 0.1, .detail = 0}, .label = {}, .points = points});
    EXPECT_FALSE(result.changed) << tool.id;
    EXPECT_EQ(result.missed, 9U) << tool.id;
    EXPECT_EQ(result.dabs, 0U) << tool.id;
    EXPECT_EQ(editor.head(), before) << tool.id;
  }
}

// ---- Stopping

TEST(Stop, AnotherThreadEndsALongStroke) {
  Editor editor(bumpy_sheet());
  const SnapshotPtr before = editor.head();
  StrokeEngine engine(editor);
  std::atomic<std::size_t> dabs = 0;
  std::atomic<bool> stop = false;
  engine.on_dab([&](const Dab&, const DabResult&) { dabs.fetch_add(1); });
  engine.stop_at(&stop);
  engine.begin({.tool = Tool::Inflate, .radius = 0.05, .detail = 0, .strength = 0.01});
  std::thread other([&] {
    while (dabs.load() < 20) std::this_thread::yield();
    stop = true;
  });
  // Two million dabs in one event.
  const std::vector<StrokePoint> points = {{0, {0.5, 0, 0.5}, 1}, {16000, {0.5, 0, 0.5}, 1}};
  engine.move(points);
  other.join();
  EXPECT_GE(dabs.load(), 20U);
  EXPECT_LT(dabs.load(), 1'000'000U);
  // No dab is made any more, and the stroke can be dropped.
  const std::size_t made = dabs.load();
  engine.move(points);
  EXPECT_EQ(dabs.load(), made);
  EXPECT_NE(editor.head()->content_hash(), before->content_hash());
  engine.cancel();
  EXPECT_EQ(editor.head(), before);
  // The next stroke is a new one.
  engine.stop_at(nullptr);
  engine.begin({.tool = Tool::Carve, .radius = 0.1, .detail = 0, .strength = 0.5});
  engine.move(events(line, 5));
  EXPECT_TRUE(engine.end().changed);
}

TEST(Stop, ACancelledPlayLeavesTheHeadAsItWas) {
  for (const ToolInfo& tool : tools()) {
    for (const bool at_once : {true, false}) {
      Editor editor(bumpy_sheet());
      const SnapshotPtr before = editor.head();
      std::atomic<bool> cancel = at_once;
      Progress progress;
      progress.cancel = &cancel;
      progress.report = [&](std::string_view, double share) { cancel = cancel || share > 0.5; };
      const StrokeResult result = play(editor,
                                       {.brush = {.tool = *tool_from_name(tool.id), .radius = 0.1, .detail = 0},
                                        .label = {},
                                        .points = events(line, 200)},
                                       progress);
      EXPECT_TRUE(cancel);
      EXPECT_FALSE(result.changed) << tool.id;
      EXPECT_EQ(editor.head(), before) << tool.id;
      EXPECT_FALSE(editor.in_stroke()) << tool.id;
    }
  }
}

TEST(Stop, PlayTellsHowFarItHasCome) {
  Editor editor(bumpy_sheet());
  double last = -1;
  int calls = 0;
  Progress progress;
  progress.report = [&](std::string_view phase, double share) {
    EXPECT_EQ(phase, "stroke");
    EXPECT_GE(share, last);
    EXPECT_LE(share, 1);
    last = share;
    ++calls;
  };
  EXPECT_TRUE(
      play(editor,
           {.brush = {.tool = Tool::Paint, .radius = 0.1, .detail = 0}, .label = {}, .points = events(line, 1000)},
           progress)
          .changed);
  EXPECT_GT(calls, 50);
  EXPECT_LE(calls, 120);
}

}  // namespace
}  // namespace relief
