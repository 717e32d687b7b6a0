// How clean cuts are: against the exact ball and plane, along rims and grooves, and where the clay or the room ends.
#include "edit_support.h"

#include <cctype>
#include <complex>
#include <cstdio>
#include <random>
#include <string>
#include <utility>

namespace relief {
namespace {

using testing::dab_near;
using testing::for_each_sample;
using testing::valid;

using Sheet = std::shared_ptr<const SlabMesh>;

/// What the shell over the plane y = 0 looks like.
struct Shape {
  std::string name;
  double spacing;  ///< the largest of its samples
  Sheet mesh;
};

constexpr double kHalfFibre = 0.25;

/// Equilateral triangles of spacing 1 / (4 * n), fibres along y.
Shape even_sheet(int n) {
  const Sheet plane = testing::plane_shell(4, n, kHalfFibre);
  return {"even", 0.25 / n, testing::mapped_shell(*plane, [](Vec3d p) {
            return Vec3d{p.x - 0.5 * p.z + 0.25, p.y, 0.5 + (p.z - 0.5) * std::sqrt(0.75)};
          })};
}

struct Ball {
  Vec3d centre;  ///< above or on the plane
  double radius;
  [[nodiscard]] double rim() const { return std::sqrt(radius * radius - centre.y * centre.y); }
  /// From a point to the plane y = 0 without what is inside the ball, and the ball's part below it.
  [[nodiscard]] double distance(Vec3d p) const {
    const double out = std::hypot(p.x - centre.x, p.z - centre.z);
    const double to_rim = std::hypot(out - rim(), p.y);
    double least = out >= rim() ? std::abs(p.y) : to_rim;
    const Vec3d way = p - centre;
    const double size = length(way);
    if (size > 0 && centre.y + way.y / size * radius <= 0) least = std::min(least, std::abs(size - radius));
    return std::min(least, to_rim);
  }
};

/// The surface straight below a place.
SurfacePoint below(const Snapshot& model, double x, double z) {
  const auto hit = raycast(model, {{x, 1, z}, {0, -1, 0}});
  if (!hit) throw std::runtime_error("the ray misses the sheet");
  return hit->point;
}

/// Errors of cuts in spacings, ripple along the rim in spacings and degrees.
struct Figures {
  double square = 0, worst = 0, height_square = 0, normal_square = 0;
  std::size_t places = 0, circles = 0;
  [[nodiscard]] double rms() const { return std::sqrt(square / double(places)); }
  [[nodiscard]] double height_ripple() const { return std::sqrt(height_square / double(circles)); }
  [[nodiscard]] double normal_ripple() const {
    return std::sqrt(normal_square / double(circles)) * 180 / std::numbers::pi;
  }

  void look(const Snapshot& model, const Ball& ball, double h) {
    const double reach = ball.radius + 3 * h, step = h / 5;
    const int most = static_cast<int>(reach / step);
    for (int a = -most; a <= most; ++a)
      for (int b = -most; b <= most; ++b) {
        if (std::hypot(a, b) * step > reach) continue;
        const double off = ball.distance(below(model, ball.centre.x + a * step, ball.centre.z + b * step).position) / h;
        square += off * off;
        worst = std::max(worst, off);
        ++places;
      }
    for (int ring = -4; ring <= 4; ++ring) look_along(model, ball, ball.rim() + 0.25 * ring * h, h);
  }

  /// What is left of heights and normals along a circle less their means over 30 degrees each way, about half a radius:
  /// a rim is as wide as its samples are far apart, and where these differ it changes slowly. That is no ripple.
  void look_along(const Snapshot& model, const Ball& ball, double out, double h) {
    constexpr int kTurns = 360, kEachWay = 30;
    std::vector<double> heights;
    std::vector<Vec3d> normals;
    for (int k = 0; k < kTurns; ++k) {
      const double turn = 2 * std::numbers::pi * k / kTurns, c = std::cos(turn), s = std::sin(turn);
      const SurfacePoint at = below(model, ball.centre.x + out * c, ball.centre.z + out * s);
      heights.push_back(at.position.y / h);
      // Outwards, upwards, along the circle.
      normals.push_back({at.normal.x * c + at.normal.z * s, at.normal.y, at.normal.z * c - at.normal.x * s});
    }
    for (int k = 0; k < kTurns; ++k) {
      double height = 0;
      Vec3d normal;
      for (int other = k - kEachWay; other <= k + kEachWay; ++other) {
        const auto near = static_cast<std::size_t>((other + kTurns) % kTurns);
        height += heights[near] / (2 * kEachWay + 1);
        normal += normals[near];
      }
      const auto here = static_cast<std::size_t>(k);
      height_square += std::pow(heights[here] - height, 2) / kTurns;
      normal_square += std::pow(std::acos(std::min(dot(normals[here], normalized(normal)), 1.0)), 2) / kTurns;
    }
    ++circles;
  }
};

/// Cuts of 0.6 r at random places of the sheet, each into the sheet as it was.
Figures cut(const Shape& shape, double radius, bool exact, int times) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-0.1, 0.1);
  const SnapshotPtr plane = Snapshot::make(shape.mesh);
  Figures figures;
  for (int k = 0; k < times; ++k) {
    const Vec3d at = {0.5 + unit(random), 0, 0.5 + unit(random)};
    Dab dab = dab_near(*plane, at, 0);
    dab.normal = {0, 1, 0};
    dab.cursor = at - Vec3d{0, 0.6 * radius, 0};
    Editor editor(plane);
    const DabResult result =
        testing::apply(editor, {.tool = Tool::Carve, .radius = radius, .detail = 0, .exact = exact}, dab);
    EXPECT_EQ(result.limited, 0U);
    EXPECT_TRUE(valid(*editor.head()));
    figures.look(*editor.head(), {dab.cursor + dab.normal * radius, radius}, shape.spacing);
  }
  return figures;
}

/// Into the test's output and its report.
void tell(const std::string& what, double figure) {
  std::printf("%-40s %.4g\n", what.c_str(), figure);
  std::string key = what;
  for (char& c : key)
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
  ::testing::Test::RecordProperty(key, std::to_string(figure));
}

void tell(const std::string& what, const Figures& f) {
  tell(what + ": rms, h", f.rms());
  tell(what + ": max, h", f.worst);
  tell(what + ": height ripple, h", f.height_ripple());
  tell(what + ": normal ripple, degrees", f.normal_ripple());
}

TEST(Cuts, ErrorAndRippleOfABallInAPlane) {
  const Shape sheet = even_sheet(64);
  for (const int spacings : {6, 12, 25}) {
    const Figures smooth = cut(sheet, spacings * sheet.spacing, false, 6);
    const Figures hard = cut(sheet, spacings * sheet.spacing, true, 6);
    tell("r/h " + std::to_string(spacings), smooth);
    tell("exact, r/h " + std::to_string(spacings), hard);
    EXPECT_LE(smooth.rms(), 0.1);
    EXPECT_LE(smooth.worst, 0.45);
    // What the hard clip gives on this grid: a crease that falls between samples.
    EXPECT_LE(hard.rms(), 0.045);
    EXPECT_LE(hard.worst, 0.34);
    if (spacings < 12) continue;
    EXPECT_LE(smooth.height_ripple(), 0.03);
    EXPECT_LE(smooth.normal_ripple(), 0.9);
  }
}

// In units of the spacing as it was: what detail under the tool gives a ball of 12 of them.
TEST(Cuts, WithTheSpacingHalvedTheRimIsTwiceAsEven) {
  const Shape sheet = even_sheet(128);
  const Figures halved = cut(sheet, 24 * sheet.spacing, false, 6);
  tell("r/h 12, spacing halved: height ripple, h", halved.height_ripple() / 2);
  tell("r/h 12, spacing halved: normal ripple, degrees", halved.normal_ripple());
  EXPECT_LE(halved.height_ripple() / 2, 0.015);
  EXPECT_LE(halved.normal_ripple(), 0.9);
}

TEST(Cuts, InSlabsOfAnyShape) {
  const double lean = std::tan(20 * std::numbers::pi / 180);
  const Sheet plane = testing::plane_shell(4, 64, kHalfFibre), even = even_sheet(64).mesh;
  const std::vector<Shape> shapes = {
      {"right angles", 0.25 / 64 * std::sqrt(2), plane},
      {"stretched", 0.25 / 64 * std::hypot(1, 1. / 3),
       testing::mapped_shell(*plane, [](Vec3d p) { return Vec3d{p.x, p.y, 0.5 + (p.z - 0.5) / 3}; })},
      {"n and 2n", 0.25 / 32, testing::mixed_shell(*even_sheet(1).mesh, 32, 1)},
      {"leaning", 0.25 / 64, testing::mapped_shell(*even, [&](Vec3d p) { return Vec3d{p.x + lean * p.y, p.y, p.z}; })}};
  for (const Shape& shape : shapes) {
    const Figures smooth = cut(shape, 12 * shape.spacing, false, 4), hard = cut(shape, 12 * shape.spacing, true, 4);
    tell(shape.name, smooth);
    tell(shape.name + ", exact", hard);
    EXPECT_LE(smooth.rms(), 0.1);
    // Halved at least: what the grid's directions add to the normals' ripple stays the same for both.
    EXPECT_LE(smooth.normal_ripple(), 0.6 * hard.normal_ripple());
    // Leaning fibres, too: on one side the wall of 66 degrees stands within a few degrees of them, and they see a
    // crease of a spacing as one of three. The exact ball has teeth of 0.067 of a spacing there.
    EXPECT_LE(smooth.worst, shape.name == "leaning" ? 0.55 : 0.45);
    EXPECT_LE(smooth.height_ripple(), 0.03);
  }
}

/// Where the wall of a shaft stands at half of its height, in spacings from the circle that the ball leaves.
struct Wall {
  double off = 0, teeth = 0;
};
Wall wall_of(const Shape& sheet, double radius, double depth, bool exact) {
  constexpr int kTurns = 360;
  const double h = sheet.spacing;
  const SnapshotPtr plane = Snapshot::make(sheet.mesh);
  const Vec3d at = {0.513, 0, 0.507};
  Editor editor(plane);
  Dab dab = dab_near(*plane, at, 0);
  dab.normal = {0, 1, 0};
  dab.cursor = at - Vec3d{0, depth, 0};
  EXPECT_EQ(testing::apply(editor, {.tool = Tool::Carve, .radius = radius, .detail = 0, .exact = exact}, dab).limited,
            0U);
  Wall wall;
  std::vector<double> offs;
  for (int k = 0; k < kTurns; ++k) {
    const double turn = 2 * std::numbers::pi * k / kTurns, c = std::cos(turn), s = std::sin(turn);
    double out = radius - 3 * h;
    while (out < radius + 3 * h &&
           below(*editor.head(), at.x + out * c, at.z + out * s).position.y < -0.5 * (depth - radius))
      out += h / 50;
    offs.push_back((out - radius) / h);
    wall.off += offs.back() / kTurns;
  }
  for (const double off : offs) wall.teeth += std::pow(off - wall.off, 2) / kTurns;
  wall.teeth = std::sqrt(wall.teeth);
  return wall;
}

TEST(Cuts, AWallAlongTheFibresHasNoTeeth) {
  // A ball that goes deeper than its radius leaves a shaft. Its wall has the fibres' direction, so each of them is
  // either in or out: the samples' lattice shows in it, with teeth of half a spacing each way.
  const Shape sheet = even_sheet(64);
  for (const int spacings : {12, 25}) {
    const double radius = spacings * sheet.spacing;
    const Wall smooth = wall_of(sheet, radius, 1.6 * radius, false), hard = wall_of(sheet, radius, 1.6 * radius, true);
    const std::string what = "shaft, r/h " + std::to_string(spacings);
    tell(what + ": off, h", smooth.off);
    tell(what + ": teeth, h", smooth.teeth);
    tell(what + ", exact: off, h", hard.off);
    tell(what + ", exact: teeth, h", hard.teeth);
    EXPECT_LE(smooth.teeth, 0.5 * hard.teeth);
    EXPECT_LE(std::abs(smooth.off), 0.3);
  }
}

TEST(Cuts, AreBlendedByTheSamplesUnderThemNotByThoseFarAway) {
  // A slab whose neighbours have samples twice as far apart: in its middle they do not count.
  const double spacing = 0.25 / 128, radius = 12 * spacing;
  const Sheet fine = even_sheet(128).mesh;
  const SlabId middle = closest_point(*Snapshot::make(fine), {0.5, 0, 0.5}).slab;
  std::vector<SlabMesh::Face> slabs;
  for (SlabId s = 0; s < fine->slab_count(); ++s) slabs.push_back({fine->slabs()[s].fibres, s == middle ? 128 : 64});
  const auto mixed = SlabMesh::make({fine->fibres().begin(), fine->fibres().end()}, slabs);
  ASSERT_TRUE(mixed);
  const Vec3d at = fine->corners(middle).point({1. / 3, 1. / 3, 1. / 3}, 0.5);
  std::array<Figures, 2> figures;
  for (const std::size_t k : {0U, 1U}) {
    const SnapshotPtr plane = Snapshot::make(k == 0 ? fine : std::make_shared<const SlabMesh>(*mixed));
    Dab dab = dab_near(*plane, at, 0);
    dab.normal = {0, 1, 0};
    dab.cursor = at - Vec3d{0, 0.6 * radius, 0};
    Editor editor(plane);
    testing::apply(editor, {.tool = Tool::Carve, .radius = radius, .detail = 0}, dab);
    EXPECT_TRUE(valid(*editor.head()));
    figures[k].look(*editor.head(), {dab.cursor + dab.normal * radius, radius}, spacing);
  }
  tell("fine", figures[0]);
  tell("fine beside coarse", figures[1]);
  EXPECT_EQ(figures[1].rms(), figures[0].rms());
  EXPECT_EQ(figures[1].height_ripple(), figures[0].height_ripple());
}

TEST(Cuts, OfManyStrokesInOnePlaceShowNoSlabBorders) {
  // Inside the cut, on a corner of six slabs, the normals are the ball's.
  const Shape sheet = even_sheet(32);
  const double radius = 12 * sheet.spacing;
  const Vec3d corner = sheet.mesh->corners(20).point({1, 0, 0}, 0.5);
  for (const int strokes : {1, 2, 20}) {
    Editor editor(Snapshot::make(sheet.mesh));
    Dab dab = dab_near(*editor.head(), corner, 0);
    dab.normal = {0, 1, 0};
    dab.cursor = corner - Vec3d{0, 0.6 * radius, 0};
    for (int k = 0; k < strokes; ++k) testing::apply(editor, {.tool = Tool::Carve, .radius = radius, .detail = 0}, dab);
    const Ball ball = {dab.cursor + dab.normal * radius, radius};
    double worst = 0;
    std::size_t inside = 0;
    for_each_sample(*sheet.mesh, [&](SlabId s, std::size_t, GridPoint at) {
      const Vec3d p = sample_position(*editor.head(), s, at);
      if (std::hypot(p.x - ball.centre.x, p.z - ball.centre.z) > 0.6 * ball.rim()) return;
      const double cosine = dot(sample_normal(*editor.head(), s, at), normalized(ball.centre - p));
      worst = std::max(worst, std::acos(std::min(cosine, 1.0)) * 180 / std::numbers::pi);
      ++inside;
    });
    tell("normals after " + std::to_string(strokes) + ", degrees", worst);
    EXPECT_GT(inside, 100U);
    EXPECT_LE(worst, 0.9) << strokes;
  }
}

// ---- Grooves

constexpr double kGrooveRadius = 0.25, kRough = 0.003 * kGrooveRadius;

/// 64 spacings per radius, with noise of 0.3 % of it, the same for all copies of a sample.
SnapshotPtr rough_sheet(double rough = kRough) {
  const Shape sheet = {"fine", 1. / 256, testing::plane_shell(2, 128, kHalfFibre)};
  return testing::displaced(sheet.mesh, [=](Vec3d p) {
    std::mt19937 random(static_cast<unsigned>(std::lround(p.x * 256) * 1000 + std::lround(p.z * 256)));
    random.discard(10);
    return 0.5 + rough * std::uniform_real_distribution<double>(-1, 1)(random) / (2 * kHalfFibre);
  });
}

/// The amplitude of the floor's height at one frequency (per unit of length), from x = 0.25 to 0.75 at z = 0.5, seen
/// through a Hann window.
double band(const Snapshot& model, double frequency) {
  constexpr int kPlaces = 1024;
  std::complex<double> sum;
  double mean = 0;
  std::vector<double> heights;
  for (int k = 0; k < kPlaces; ++k) heights.push_back(below(model, 0.25 + 0.5 * (k + 0.5) / kPlaces, 0.5).position.y);
  for (const double y : heights) mean += y / kPlaces;
  for (int k = 0; k < kPlaces; ++k) {
    const double share = (k + 0.5) / kPlaces;
    sum += (heights[static_cast<std::size_t>(k)] - mean) * (1 - std::cos(2 * std::numbers::pi * share)) *
           std::polar(1.0, 2 * std::numbers::pi * frequency * 0.5 * share);
  }
  return 2 * std::abs(sum) / kPlaces;
}

/// The floor against the part of a cylinder around the line `deep` below the plane.
void expect_groove(const Snapshot& model, double deep, const std::string& what) {
  const double r = kGrooveRadius;
  double worst = 0;
  for (double x = 0.25; x <= 0.75; x += 0.00173)
    for (double aside = -0.3 * r; aside <= 0.3 * r; aside += 0.05 * r) {
      const double want = r - deep - std::sqrt(r * r - aside * aside);
      worst = std::max(worst, std::abs(below(model, x, 0.5 + aside).position.y - want));
    }
  const double at_dabs = band(model, 16 / r);
  tell(what + ": worst, depths", worst / deep);
  tell(what + ": band at the dabs, radii", at_dabs / r);
  EXPECT_LE(worst, 0.02 * deep + kRough) << what;
  EXPECT_LE(at_dabs, 1e-4 * r) << what;
}

TEST(Grooves, SweptDabsLeaveACylinder) {
  const double r = kGrooveRadius, deep = 0.3 * r;
  Editor editor(rough_sheet());
  editor.begin_stroke({.tool = Tool::Carve, .radius = r, .detail = 0});
  Vec3d from;
  for (int k = 0; k <= 48; ++k) {
    Dab dab = dab_near(*editor.start(), {0.125 + k * r / 16, 0, 0.5}, 0);
    dab.normal = {0, 1, 0};
    dab.cursor = {0.125 + k * r / 16, -deep, 0.5};
    dab.swept = k > 0;
    dab.from = std::exchange(from, dab.cursor + dab.normal * r);
    editor.dab(dab);
  }
  EXPECT_TRUE(editor.end_stroke().changed);
  EXPECT_TRUE(valid(*editor.head()));
  expect_groove(*editor.head(), deep, "dabs");
}

TEST(Grooves, PlayedStrokesLeaveACylinder) {
  const double r = kGrooveRadius;
  // So fast that a dab stands at each sixteenth of the radius. Without noise the ridges between them show best.
  for (const double rough : {kRough, 0.0})
    for (const int count : {2, 61}) {
      Editor editor(rough_sheet(rough));
      Stroke stroke{
          .brush = {.tool = Tool::Carve, .radius = r, .detail = 0, .strength = 0.6}, .label = {}, .points = {}};
      for (int k = 0; k < count; ++k) {
        const double share = double(k) / (count - 1);
        stroke.points.push_back({0.2 * share, {0.125 + 0.75 * share, 0.01, 0.5}, 0.5});
      }
      EXPECT_TRUE(play(editor, stroke).changed);
      EXPECT_TRUE(valid(*editor.head()));
      expect_groove(*editor.head(), 0.3 * r,
                    "played from " + std::to_string(count) + (rough > 0 ? " on noise" : " on a plane"));
    }
}

/// The unit sphere in a round shell, whose facets would stay flat at one alpha.
SnapshotPtr ball_model(int levels, int n) {
  return testing::displaced(testing::icosphere_shell(levels, n), [](Vec3d p) { return (1 / length(p) - 0.8) / 0.4; });
}

/// How far from the middle the surface lies along a tilted great circle, a quarter turn of it.
Vec3d round_the_ball(double turn) { return {std::cos(turn), 0.6 * std::sin(turn), 0.8 * std::sin(turn)}; }
std::vector<double> floor_of_round(const Snapshot& model) {
  std::vector<double> radii;
  for (double turn = 0.3; turn <= 1.2; turn += 0.002) {
    const Vec3d out = round_the_ball(turn);
    const auto hit = raycast(model, {out * 2.0, -out});
    if (hit) radii.push_back(length(hit->point.position));
  }
  return radii;
}
Stroke stroke_round(double radius, double strength) {
  Stroke stroke{
      .brush = {.tool = Tool::Carve, .radius = radius, .detail = 0, .strength = strength}, .label = {}, .points = {}};
  for (int k = 0; k <= 300; ++k) stroke.points.push_back({0.002 * k, round_the_ball(0.005 * k), 1});
  return stroke;
}

TEST(Grooves, RoundABallAreOfOneDepth) {
  // Across the borders of slabs, where the axis turns all the way.
  const double radius = 0.25, deep = 0.3 * radius;
  Editor editor(ball_model(2, 64));
  EXPECT_TRUE(play(editor, stroke_round(radius, 0.3)).changed);
  EXPECT_TRUE(valid(*editor.head()));
  double worst = 0;
  for (const double r : floor_of_round(*editor.head())) worst = std::max(worst, std::abs(r - (1 - deep)));
  tell("round a ball: worst, depths", worst / deep);
  EXPECT_LE(worst, 0.02 * deep);
}

// ---- Where the clay ends

/// The sphere nearest to some points in the least squares of |p|^2 - 2 p.c + w = 0, and the rms distance from it.
struct FittedBall {
  Vec3d centre;
  double radius = 0, rms = 0;
};
FittedBall fitted(const std::vector<Vec3d>& points) {
  Vec3d middle;
  for (const Vec3d p : points) middle += p / double(points.size());
  std::array<std::array<double, 5>, 4> m{};
  for (const Vec3d p : points) {
    const Vec3d q = p - middle;
    const std::array<double, 5> row = {2 * q.x, 2 * q.y, 2 * q.z, 1, dot(q, q)};
    for (std::size_t a = 0; a < 4; ++a)
      for (std::size_t b = 0; b < 5; ++b) m[a][b] += row[a] * row[b];
  }
  for (std::size_t a = 0; a < 4; ++a)
    for (std::size_t other = 0; other < 4; ++other) {
      if (other == a) continue;
      const double share = m[other][a] / m[a][a];
      for (std::size_t b = 0; b < 5; ++b) m[other][b] -= share * m[a][b];
    }
  const Vec3d c = {m[0][4] / m[0][0], m[1][4] / m[1][1], m[2][4] / m[2][2]};
  FittedBall ball{middle + c, std::sqrt(m[3][4] / m[3][3] + dot(c, c)), 0};
  for (const Vec3d p : points) ball.rms += std::pow(length(p - ball.centre) - ball.radius, 2) / double(points.size());
  ball.rms = std::sqrt(ball.rms);
  return ball;
}

/// Carves deeper than the clay under a place, and looks at what is there.
void expect_fade_out(const SnapshotPtr& before, Vec3d where, double radius, double deep, const std::string& what) {
  const SlabMesh& mesh = before->slab_mesh();
  Editor editor(before);
  const Dab dab = dab_near(*before, where, deep);
  const DabResult told = testing::apply(editor, {.tool = Tool::Carve, .radius = radius, .detail = 0}, dab);
  EXPECT_TRUE(valid(*editor.head()));
  const Vec3d centre = dab.cursor + dab.normal * radius;
  std::size_t beyond = 0, in_the_last = 0;
  double lowest = 1, deepest = 0;
  for_each_sample(mesh, [&](SlabId s, std::size_t k, GridPoint at) {
    const double a = double(before->displacement(s)[k]), b = double(editor.head()->displacement(s)[k]);
    lowest = std::min(lowest, b);
    deepest = std::max(deepest, length(sample_position(*before, s, at) - sample_position(*editor.head(), s, at)));
    // The ball holds the inner end: it would have taken all of the fibre.
    const auto ball_holds = [&](double alpha) {
      return a > 0 && length(sample_position(mesh, s, mesh.intervals(s), at, alpha) - centre) < radius;
    };
    beyond += ball_holds(0) ? 1U : 0U;
    in_the_last += ball_holds(0) || ball_holds(0.15 * a) ? 1U : 0U;
  });
  // Inside the rim's blend.
  std::vector<Vec3d> floor;
  for_each_sample(mesh, [&](SlabId s, std::size_t, GridPoint at) {
    const Vec3d p = sample_position(*editor.head(), s, at);
    if (length(p - sample_position(*before, s, at)) > 0.4 * deepest) floor.push_back(p);
  });
  ASSERT_GT(floor.size(), 200U);
  const FittedBall ball = fitted(floor);
  tell(what + ": rms from a ball, depths", ball.rms / deepest);
  tell(what + ": lowest alpha", lowest);
  EXPECT_GT(lowest, 0);
  EXPECT_GT(beyond, 50U);
  // All that are beyond the clay, and none that are not even in its last tenth; two spacings are somewhat more here.
  EXPECT_GE(double(told.limited), 0.99 * double(beyond));
  EXPECT_LE(told.limited, in_the_last);
  EXPECT_LE(ball.rms, 0.02 * deepest) << what;
  EXPECT_NEAR(ball.radius, radius, 0.05 * radius) << what;
}

TEST(FadeOut, ACutDeeperThanTheClayStaysABall) {
  expect_fade_out(Snapshot::make(testing::plane_shell(4, 32, 0.1)), {0.52, 0, 0.47}, 0.3, 0.2, "plane");
  expect_fade_out(Snapshot::make(testing::sphere_shell(2, 32)), {0.3, 0.8, 0.4}, 0.5, 0.35, "sphere");
  expect_fade_out(Snapshot::make(testing::mixed_shell(*testing::sphere_shell(2, 1), 16, 2)), {0.3, 0.8, 0.4}, 0.5, 0.35,
                  "sphere of mixed n");
  expect_fade_out(testing::displaced(testing::torus_shell(12, 8, 32), testing::bumps), {2.6, 0.4, 0.3}, 0.4, 0.3,
                  "bumpy torus");
}

TEST(FadeOut, AStrokeDeeperThanTheClayKeepsAnEvenFloor) {
  const auto mesh = testing::plane_shell(4, 32, 0.1);
  Editor editor(Snapshot::make(mesh));
  const Stroke stroke{.brush = {.tool = Tool::Carve, .radius = 0.25, .detail = 0, .strength = 1},
                      .label = {},
                      .points = {{0, {0.25, 0, 0.5}, 0.8}, {1, {0.75, 0, 0.5}, 0.8}}};
  EXPECT_GT(play(editor, stroke).limited, 100U);
  double low = 0, high = -1;
  for (double x = 0.3; x < 0.7; x += 0.002) {
    const double y = below(*editor.head(), x, 0.5).position.y;
    low = std::min(low, y);
    high = std::max(high, y);
  }
  EXPECT_GT(low, -0.1);
  EXPECT_LT(high, -0.06);
  EXPECT_LT(high - low, 0.02 * 0.1);
}

TEST(FadeOut, RoundABallTheFloorStaysEven) {
  // A fifth deeper than the clay, which is 0.2 thick.
  const SnapshotPtr ball = ball_model(2, 64);
  Editor editor(ball);
  EXPECT_GT(play(editor, stroke_round(0.4, 0.6)).limited, 100U);
  EXPECT_TRUE(valid(*editor.head()));
  const std::vector<double> radii = floor_of_round(*editor.head());
  // Where the clay ends there are facets, 0.8 from the middle at their corners and 0.785 between, which meet at 0.29
  // radians. The floor may follow them, but bends no more than they do, over 0.016 radians each way.
  double bend = 0;
  for (std::size_t k = 8; k + 8 < radii.size(); ++k)
    bend = std::max(bend, std::abs(radii[k - 8] + radii[k + 8] - 2 * radii[k]));
  tell("deeper than the clay round a ball: bend", bend);
  EXPECT_LE(bend, 0.016 * 0.29 * 0.8);
  EXPECT_GT(std::ranges::min(radii), 0.785);
  EXPECT_LT(std::ranges::max(radii), 0.82);
}

// No sample lies right under the tool, so none has all of its weight: were the nearest one not to end it all, each dab
// would raise it a little, and a plateau would grow as long as the stroke lasts. After 30 s it would have 26, 1.8 and
// 5.6 % of what has changed.
TEST(FadeOut, ADepositLongerThanTheRoomIsRoundAtTheTop) {
  for (const auto& [tool, most] : {std::pair(Tool::Deposit, 0.001), {Tool::Inflate, 0.003}, {Tool::Clay, 0.012}}) {
    const auto mesh = testing::plane_shell(4, 32, 0.1);
    Editor editor(Snapshot::make(mesh));
    std::vector<StrokePoint> points;
    for (int k = 0; k <= 3000; ++k) points.push_back({0.01 * k, {0.52, 0.05, 0.47}, 1});
    const StrokeResult told =
        play(editor, {.brush = {.tool = tool, .radius = 0.3, .detail = 0}, .label = {}, .points = points});
    EXPECT_TRUE(valid(*editor.head()));
    std::size_t changed = 0, near_top = 0, at_end = 0;
    double highest = 0;
    for_each_sample(*mesh, [&](SlabId s, std::size_t k, GridPoint) {
      const float a = editor.head()->displacement(s)[k];
      highest = std::max(highest, double(a));
      if (a == 0.5F) return;
      ++changed;
      near_top += a > 0.999F ? 1U : 0U;
      at_end += a == 1.0F ? 1U : 0U;
    });
    tell(std::string(name(tool)) + ": share at the top", double(near_top) / double(changed));
    EXPECT_GT(told.limited, 0U) << name(tool);
    EXPECT_GT(highest, 0.9F);
    EXPECT_EQ(at_end, 0U) << name(tool);
    EXPECT_LE(double(near_top), most * double(changed)) << name(tool);
  }
}

}  // namespace
}  // namespace relief
