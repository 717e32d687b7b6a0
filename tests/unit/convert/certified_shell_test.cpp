// Certified mode: what it promises is counted here by brute force, on every triangle of the source.
#include "certified.h"
#include "shapes.h"

#include <relief/convert/certified_shell.h>
#include <relief/convert/convert.h>
#include <relief/convert/geometry/slab_test.h>
#include <relief/convert/geometry/source_index.h>
#include <relief/convert/shell/initial_shell.h>
#include <relief/core/query.h>
#include <relief/verify/verify.h>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <random>

namespace relief {
namespace {

using testing::append;
using testing::certificate;
using testing::certified;
using testing::expect_certified;
using testing::expect_holds_as_read;
using testing::passages;
using testing::pierced;
using testing::places;

TEST(Certified, RoundShapesReachTheTarget) {
  expect_certified(convert(testing::ball(24, 0.1), certified(60)), 60);
  expect_certified(convert(testing::torus(60, 30), certified(100)), 100);
}

TEST(Certified, SharpEdgesAndFlatFaces) {
  expect_certified(convert(testing::box({1, 2, 3}), certified(12)), 12, 200);
  expect_certified(convert(testing::box({1, 1, 0.03}), certified(12)), 12, 200);
  expect_certified(convert(testing::tetrahedron(), certified(4)), 4, 500);
}

TEST(Certified, PartsNestedAndApart) {
  TriangleMesh parts = testing::ball(12, 0.05);
  append(parts, testing::turned(testing::ball(10)), {}, 0.6);  // a cavity
  append(parts, testing::torus(30, 16), {6, 0, 0});
  expect_certified(convert(parts, certified(90)), 150);
}

TEST(Certified, SpecksBesideLargeTrianglesAreNotSwallowed) {
  // Far smaller than a slab could be thick there, outside and, as cavities, inside.
  TriangleMesh parts = testing::box({1, 1, 1});
  Box3d box;
  for (const Vec3d p : parts.positions) box.add(p);
  const Vec3d middle = box.low + box.extent() * 0.5;
  for (const double sign : {-1.0, 1.0})
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double face = sign * box.extent()[axis] * 0.5;
      Vec3d outside = middle, inside = middle;
      outside[axis] += face + sign * 0.02;
      inside[axis] += face - sign * 0.02;
      inside[(axis + 1) % 3] += 0.2;
      append(parts, testing::ball(4), outside, 0.005);
      append(parts, testing::turned(testing::ball(4)), inside, 0.005);
    }
  expect_certified(convert(parts, certified(100)), 400);
}

TEST(Certified, PartsThatFitIntoEachOthersShellsAreNotSwallowed) {
  // Fibres at the corners lean outwards and miss a plate of the same extents: as long as an edge, they have it between
  // them, and two thin walls end in each other.
  for (const double gap : {0.02, 0.003}) {
    TriangleMesh plate = testing::box({1, 1, 1});
    append(plate, testing::box({1, 1, 0.01}), {0, 0, 1 + gap});
    expect_certified(convert(plate, certified(24)), 24, 100);
    TriangleMesh hollow = testing::box({1, 1, 1});
    append(hollow, testing::turned(testing::box({1, 1, 1})), {gap, gap, gap}, 1 - 2 * gap);
    expect_certified(convert(hollow, certified(24)), 24, 100);
  }
}

TEST(Certified, FarFromTheOriginAndAtAnyScale) {
  for (const double scale : {1e-3, 1e6})
    expect_certified(
        convert(testing::scaled(testing::ball(16, 0.1), scale, Vec3d{1, 1, 1} * (1e3 * scale)), certified(60)), 60);
}

TEST(Certified, MendedSourceIsTheSourceWhereNothingHadToMove) {
  // Coordinates that the lattice holds exactly.
  TriangleMesh ball = testing::ball(16, 0.1);
  for (Vec3d& p : ball.positions)
    for (std::size_t k = 0; k < 3; ++k) p[k] = std::ldexp(std::round(std::ldexp(p[k], 16)), -16);
  const auto result = convert(ball, certified(60));
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(result->report.moved_vertices, 0U);
  EXPECT_EQ(result->mended.positions, ball.positions);
}

/// A model's tiles of a layer, as the verifier reads them; may be changed.
struct Tiles {
  std::vector<std::vector<float>> values;
  std::vector<int> intervals;

  Tiles(const Snapshot& model, Layer layer) {
    for (SlabId s = 0; s < model.slab_mesh().slab_count(); ++s) {
      intervals.push_back(model.slab_mesh().intervals(s));
      if (model.has(layer))
        values.emplace_back(model.tile(layer, s).plane(), model.tile(layer, s).plane() + model.tile(layer, s).size());
    }
  }
  [[nodiscard]] std::vector<verify::SampleTile> view() const {
    std::vector<verify::SampleTile> tiles;
    for (std::size_t s = 0; s < values.size(); ++s) tiles.push_back({intervals[s], values[s]});
    return tiles;
  }
};

TEST(Certified, TheVerifierHoldsVoidMarksAgainstTheMendedSource) {
  const auto holes = [](Vec3d p) { return p.z > 0.9 || p.x < -0.8; };
  const auto result = convert(pierced(testing::ball(40, 0.05), holes), certified(80, 16));
  ASSERT_TRUE(result) << result.error().message;
  const Snapshot& model = *result->model.head;
  const PlainCage cage(model.slab_mesh());
  const auto positions = places(result->mended);
  const verify::Source source = {positions, result->mended.triangles, result->mended.phantom_from};
  const Tiles values(model, Layer::Displacement);
  Tiles voids(model, Layer::Void);
  const Tiles folded(model, Layer::Folded);
  ASSERT_EQ(voids.values.size(), model.slab_mesh().slab_count());
  ASSERT_TRUE(folded.values.empty());
  const auto check = [&] {
    const auto tiles = values.view(), marks = voids.view(), folds = folded.view();
    return verify::check_samples({cage.inner, cage.outer, cage.triangles}, source, tiles, 1e-6,
                                 verify::SampleMarks{marks, folds});
  };
  EXPECT_EQ(check().off, 0U);
  std::mt19937 random(3);
  int flipped = 0, caught = 0;
  for (int k = 0; k < 60; ++k) {
    const std::size_t s = random() % voids.values.size(), at = random() % voids.values[s].size();
    float& mark = voids.values[s][at];
    mark = 1 - mark;
    ++flipped;
    caught += check().off > 0;
    mark = 1 - mark;
  }
  // Only a fibre that runs through the rim itself may be either.
  EXPECT_GE(caught, flipped - 1);
}

// Whose corners lie beside the lattice. In rings with a narrow gap between them fibres on one rim are a thousandth as
// long as on the other, and at the rims of flat bodies fibres run nearly along both sides.
TEST(Certified, CleanSourcesHoldAsTheyWereGiven) {
  const auto ring = [](int around, double from, double to) {
    return testing::bent_grid(around, 4, true, true, [&](double u, double v) {
      const double a = 2 * std::numbers::pi * u, r = v > 0.2 && v < 0.7 ? to : from;
      return Vec3d{r * std::cos(a), r * std::sin(a), v > 0.4 ? 1.0 : 0.0};
    });
  };
  std::vector<TriangleMesh> sources = {ring(64, 1, 1.2)};
  append(sources[0], ring(64, 1.2005, 1.4));
  append(sources[0], ring(90, 1.401, 1.6));
  std::mt19937 random(11);
  std::uniform_real_distribution<double> turn(0, 2 * std::numbers::pi);
  for (int k = 0; k < 4; ++k) {
    const double tilt = turn(random);
    TriangleMesh flat = testing::ball(2 + k % 4);
    for (Vec3d& p : flat.positions) {
      p.x *= 2;
      p = {p.x * std::cos(tilt) - p.y * std::sin(tilt), p.x * std::sin(tilt) + p.y * std::cos(tilt), 3e-4 * p.z};
    }
    sources.push_back(flat);
  }
  for (const TriangleMesh& source : sources) {
    const auto result = convert(source, certified(400));
    expect_certified(result, 1300, 5);
    EXPECT_EQ(result->report.moved_vertices, 0U);
    expect_holds_as_read(*result, source);
    const Snapshot& model = *result->model.head;
    const PlainCage cage(model.slab_mesh());
    const auto positions = places(source);
    const Tiles values(model, Layer::Displacement);
    const auto tiles = values.view();
    const verify::SampleCheck samples =
        verify::check_samples({cage.inner, cage.outer, cage.triangles}, {positions, source.triangles}, tiles,
                              1e-6 * result->model.info.source_diagonal);
    EXPECT_EQ(samples.off, 0U) << samples.failures.front().what;
  }
}

// Samples are cast from where the fibres are, however far that is from the origin of the model's units.
TEST(Certified, FarFromTheOriginTheSamplesAreWhereTheSourceIs) {
  TriangleMesh mesh = testing::ball(40, 0.05);
  const Vec3d far = {0x1p36, -0x1p35, 0x1p34};
  for (Vec3d& p : mesh.positions) {
    p = p * 256;
    for (std::size_t k = 0; k < 3; ++k) p[k] = std::round(p[k] * 64) / 64 + far[k];
  }
  const auto result = convert(mesh, certified(80, 16));
  ASSERT_TRUE(result) << result.error().message;
  const PlainCage cage(result->model.head->slab_mesh());
  const auto positions = places(result->mended);
  const Tiles values(*result->model.head, Layer::Displacement);
  const auto tiles = values.view();
  const verify::SampleCheck c = verify::check_samples({cage.inner, cage.outer, cage.triangles},
                                                      {positions, result->mended.triangles}, tiles, 1e-4);
  EXPECT_EQ(c.off, 0U);
  EXPECT_LT(c.worst, 1e-5) << "the rounding of alpha to a float, in a fibre some 150 long";
}

TEST(Certified, PartsThatCrossAreOneSolid) {
  TriangleMesh crossing = testing::ball(16);
  append(crossing, testing::ball(16), {0.9, 0.1, 0});
  const auto made = convert(crossing, certified(60));
  expect_certified(made, 60);
  ASSERT_TRUE(made->report.skin);
  EXPECT_GT(made->report.skin->dropped, 0U);
  EXPECT_NE(verdict(made->report, made->model.info).find("inside of other parts"), std::string::npos);
}

TEST(Certified, IsTheDefault) {
  ConvertSettings settings = certified(60);
  settings.mode.reset();
  const auto made = convert(testing::ball(16, 0.1), settings);
  ASSERT_TRUE(made);
  EXPECT_EQ(made->model.info.mode, Mode::Certified);
  EXPECT_TRUE(made->report.not_certified.empty());
}

TEST(Tolerant, ReachesTheTargetAndMarksWhatFolds) {
  const TriangleMesh source = testing::grooved_torus();
  const auto proven = convert(source, certified(60, 16));
  expect_certified(proven, 100'000, 2);
  ASSERT_GT(proven->report.slabs, 80U) << "this source is too smooth for the test";
  ConvertSettings settings = certified(60, 16);
  settings.mode = Mode::Tolerant;
  const auto result = convert(source, settings);
  ASSERT_TRUE(result) << result.error().message;
  const ConvertReport& report = result->report;
  EXPECT_EQ(result->model.info.mode, Mode::Tolerant);
  EXPECT_LE(report.slabs, 60U);
  EXPECT_NEAR(double(report.hits_none) / double(report.fibres_cast), 1 - report.coverage.share, 1e-6);
  EXPECT_LT(1 - report.coverage.share, 0.01);
  EXPECT_GT(report.hits_several, 0U);
  EXPECT_LT(double(report.hits_several), 0.1 * double(report.fibres_cast));
  const Snapshot& model = *result->model.head;
  EXPECT_TRUE(validate(model));
  EXPECT_TRUE(certificate(model.slab_mesh()).all());
  ASSERT_TRUE(model.has(Layer::Folded));
  // Marked is what brute force finds to be met several times.
  std::size_t marked = 0;
  for (SlabId s = 0; s < model.slab_mesh().slab_count(); ++s) {
    const SlabCorners corners = model.slab_mesh().corners(s);
    for (int j = 1; j < 16; ++j)
      for (int i = 1; i + j < 16; ++i) {
        const std::array<double, 3> w = {double(16 - i - j) / 16, i / 16.0, j / 16.0};
        const auto [out, in] = passages(result->mended, corners.point(w, 0), corners.point(w, 1));
        EXPECT_EQ(out - in, 1);
        const bool folded = model.tile(Layer::Folded, s).plane()[sample_index(16, {i, j})] > 0.5F;
        EXPECT_EQ(folded, out > 1);
        marked += folded;
      }
  }
  EXPECT_GT(marked, 0U);
}

// Near the target more is tried, or 112 were left.
TEST(Certified, LooksForPlacesAndDirectionsThatSeeTheStar) {
  ConvertSettings settings = certified(90);
  expect_certified(convert(testing::grooved_torus(), settings), 90, 4);
  settings.mode = Mode::Tolerant;
  expect_certified(convert(testing::grooved_torus(), settings), 90, 4);
}

TEST(Tolerant, IsCertifiedWhereNothingIsGivenUp) {
  TriangleMesh boxes = testing::box({1, 1, 1});
  append(boxes, testing::box({1, 2, 1}), {2, 0, 0});
  ConvertSettings settings = certified(24);
  settings.mode = Mode::Tolerant;
  expect_certified(convert(boxes, settings), 24);
}

bool has_note(const ConvertReport& report, std::string_view part) {
  return std::ranges::any_of(report.notes, [&](const std::string& note) { return note.contains(part); });
}

TEST(Certified, WhatCannotBeProvedIsRefusedOrMadeASolid) {
  const TriangleMesh star = testing::unheld_star();
  const std::string why = "near (";
  const auto refused = convert(star, certified(60));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, Errc::Unfoldable);
  EXPECT_NE(refused.error().message.find(why), std::string::npos) << refused.error().message;
  EXPECT_NE(refused.error().message.find("--mode tolerant"), std::string::npos) << refused.error().message;
  ConvertSettings any = certified(60);
  any.mode.reset();
  const auto made = convert(star, any);
  ASSERT_TRUE(made) << made.error().message;
  ASSERT_TRUE(made->report.remesh);
  EXPECT_TRUE(certificate(made->model.head->slab_mesh()).all());
  EXPECT_NE(made->report.not_certified.find(why), std::string::npos) << made->report.not_certified;
  EXPECT_NE(verdict(made->report, made->model.info).find("solid rebuilt"), std::string::npos);
}

/// What tolerant mode claims holds, of slabs and samples, with no more slabs than asked for.
void expect_tolerant(const Result<Conversion>& result, std::size_t asked) {
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_LE(result->report.slabs, asked) << to_string(result->report);
  const Snapshot& model = *result->model.head;
  EXPECT_TRUE(validate(model));
  EXPECT_TRUE(certificate(model.slab_mesh()).all());
  const PlainCage cage(model.slab_mesh());
  const Tiles values(model, Layer::Displacement), voids(model, Layer::Void), folded(model, Layer::Folded);
  const auto positions = places(result->mended);
  const auto tiles = values.view(), marks = voids.view(), folds = folded.view();
  const auto samples = verify::check_samples({cage.inner, cage.outer, cage.triangles},
                                             {positions, result->mended.triangles, result->mended.phantom_from}, tiles,
                                             1e-6, verify::SampleMarks{marks, folds});
  EXPECT_EQ(samples.off, 0U) << samples.failures.front().what;
}

// Slabs that hold all of it are more than 54: what sticks out of fewer is marked.
TEST(Tolerant, LeavesLittleOutsideRatherThanMoreSlabs) {
  ConvertSettings settings = certified(50, 16);
  settings.mode = Mode::Tolerant;
  const auto result = convert(testing::grooved_torus(60, 48), settings);
  expect_tolerant(result, 50);
  const ConvertReport& report = result->report;
  EXPECT_FALSE(report.remesh) << to_string(report);
  EXPECT_GT(report.hits_none, 0U);
  EXPECT_LT(double(report.hits_none), 0.03 * double(report.fibres_cast));
  // What it does not reach counts: at least what the surface is far from, at most what it is not near to.
  double all = 0, far = 0, beside = 0;
  for (const Triangle& t : result->mended.triangles) {
    const Vec3d a = result->mended.positions[t[0]], b = result->mended.positions[t[1]],
                c = result->mended.positions[t[2]];
    const double area = 0.5 * length(cross(b - a, c - a));
    const Vec3d middle = (a + b + c) / 3.0;
    const double off = length(closest_point(*result->model.head, middle).position - middle);
    all += area;
    if (off > ConvertReport::Coverage::kNear * result->model.info.source_diagonal) far += area;
    if (off > 1e-3 * result->model.info.source_diagonal) beside += area;
  }
  EXPECT_GT(report.coverage.missed, 0U);
  EXPECT_GE(1 - report.coverage.share, far / all - 0.002);
  EXPECT_LE(1 - report.coverage.share, beside / all + 0.002);
  EXPECT_EQ(report.not_certified, "no proof was found with 50 slabs");
  EXPECT_LT(report.from_mended.max, 0.03);
}

// Sheets that cross have no shell, and few slabs cannot follow two parts: a solid of them they can.
TEST(Tolerant, StandsOnASolidWhereTheSourceTakesMore) {
  TriangleMesh parts = testing::ball(12);
  append(parts, testing::torus(40, 20), {5, 0, 0});
  ConvertSettings settings = certified(40, 16);
  settings.mode = Mode::Tolerant;
  const auto result = convert(parts, settings);
  expect_tolerant(result, 40);
  ASSERT_TRUE(result->report.remesh);
  EXPECT_TRUE(has_note(result->report, "was rebuilt as a solid")) << to_string(result->report);
  EXPECT_LT(result->report.to_source.max, 2 * result->report.remesh->voxel);
}

TEST(Tolerant, LeavesTheSmallestPartsOutWhereAllTakeMore) {
  TriangleMesh parts;
  for (int k = 0; k < 6; ++k) {
    const double size = 1 - 0.1 * k;
    TriangleMesh part;
    part.positions = {{size, size, size}, {size, -size, -size}, {-size, size, -size}, {-size, -size, size}};
    part.triangles = {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}};
    append(parts, part, {3.0 * k, 0, 0});
  }
  ConvertSettings settings = certified(20, 4);
  settings.mode = Mode::Tolerant;
  const auto result = convert(parts, settings);
  expect_tolerant(result, 20);
  EXPECT_EQ(result->report.dropped_parts, 1U);
  EXPECT_EQ(result->report.parts.count, 5U);
}

// More slabs that hold the source, where no solid can be followed with so few.
TEST(Tolerant, HoldsTheSourceWhereNothingDoesWithSoFew) {
  TriangleMesh boxes = testing::box({1, 1, 1});
  append(boxes, testing::box({1, 2, 1}), {2, 0, 0});
  for (const int asked : {8, 10}) {
    ConvertSettings settings = certified(asked, 16);
    settings.mode = Mode::Tolerant;
    const auto result = convert(boxes, settings);
    if (result && result->report.remesh) continue;
    expect_certified(result, 24);
    EXPECT_NE(to_string(result->report).find(" slabs were the target"), std::string::npos);
    EXPECT_TRUE(has_note(result->report, "a greater --thickness")) << to_string(result->report);
  }
}

// Where handles take more, longer fibres would not help.
TEST(Tolerant, BlamesHandlesAndNotTheFibres) {
  ConvertSettings settings = certified(8, 4);
  settings.mode = Mode::Tolerant;
  const auto result = convert(testing::torus(40, 20), settings);
  ASSERT_TRUE(result) << result.error().message;
  if (result->report.slabs <= 8) return;
  EXPECT_TRUE(has_note(result->report, "--slabs 8 cannot be reached")) << to_string(result->report);
  EXPECT_FALSE(has_note(result->report, "--thickness")) << to_string(result->report);
}

// Each part needs slabs of its own, and more of them with handles.
TEST(Certified, SaysThatPartsTakeMoreSlabsThanAskedFor) {
  TriangleMesh parts = testing::ball(12);
  append(parts, testing::torus(40, 20), {5, 0, 0});
  const auto few = convert(parts, certified(12, 2));
  ASSERT_TRUE(few) << few.error().message;
  EXPECT_TRUE(has_note(few->report, "--slabs 12 cannot be reached")) << to_string(few->report);
  EXPECT_TRUE(has_note(few->report, "2 parts and 1 handle")) << to_string(few->report);
  EXPECT_TRUE(has_note(few->report, "18 at least")) << to_string(few->report);
  const auto enough = convert(parts, certified(400, 2));
  ASSERT_TRUE(enough) << enough.error().message;
  EXPECT_TRUE(std::ranges::all_of(enough->report.notes, [](const std::string& note) {
    return note.find("loses detail") != std::string::npos;
  })) << to_string(enough->report);
}

TEST(Convert, SaysThatThereAreFewerTrianglesThanSlabsAskedFor) {
  for (const Mode mode : {Mode::Certified, Mode::Tolerant}) {
    ConvertSettings settings = certified(100, 2);
    settings.mode = mode;
    const auto made = convert(testing::box({1, 2, 3}), settings);
    ASSERT_TRUE(made) << made.error().message;
    EXPECT_EQ(made->report.slabs, 12U);
    EXPECT_TRUE(has_note(made->report, "--slabs 100 is more than the 12 triangles")) << to_string(made->report);
  }
  EXPECT_FALSE(has_note(convert(testing::box({1, 2, 3}), certified(12, 2))->report, "more than"));
}

TEST(Certified, SameBitsAgainAndOnAnyNumberOfThreads) {
  std::array<std::uint64_t, 3> hashes{};
  for (const std::size_t run : {0U, 1U, 2U}) {
    const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, run == 1 ? 1 : 2);
    const auto result = convert(testing::torus(50, 24), certified(80));
    ASSERT_TRUE(result);
    hashes[run] = result->model.head->content_hash();
  }
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_EQ(hashes[0], hashes[2]);
}

// Enough triangles that space is cut into cells.
TEST(Certified, LargeSourcesInCellsOnAnyNumberOfThreads) {
  const TriangleMesh large = testing::ball(200, 0.1);
  ASSERT_GT(large.triangles.size(), 70000U);
  std::array<std::uint64_t, 2> hashes{};
  for (const std::size_t run : {0U, 1U}) {
    const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, run + 1);
    const auto result = convert(large, certified(100));
    if (run == 0) expect_certified(result, 100, 4);
    ASSERT_TRUE(result);
    hashes[run] = result->model.head->content_hash();
  }
  EXPECT_EQ(hashes[0], hashes[1]);
}

// On a rough source nearly every collapse has to find a height that the fibres around it allow.
TEST(Certified, RoughSourcesBecomeCoarse) {
  constexpr int kRows = 40;
  TriangleMesh rough = testing::ball(kRows);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> share(-1, 1);
  for (Vec3d& p : rough.positions) p = p * (1 + 2.5 * std::numbers::pi / kRows * share(random));
  expect_certified(convert(rough, certified(20)), 130, 4);
}

TEST(Certified, StopsWhenCancelled) {
  const std::atomic<bool> cancel = true;
  const auto result = convert(testing::ball(40, 0.1), certified(60), {.report = {}, .cancel = &cancel});
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, Errc::Cancelled);
}

class Section : public ::testing::Test {
 protected:
  /// A slab over the triangle (0,0), (1000,0), (0,1000), from z = 0 to 200, its fibres leaning as given.
  static detail::SlabShape slab(const std::array<Vec3d, 3>& lean = {}, Vec3d place = shift()) {
    const std::array<Vec3d, 3> base = {Vec3d{0, 0, 0}, Vec3d{1000, 0, 0}, Vec3d{0, 1000, 0}};
    detail::LatticeTriangle inner, outer;
    for (std::size_t k = 0; k < 3; ++k) {
      inner[k] = detail::snap(base[k] + place);
      outer[k] = detail::snap(base[k] + place + Vec3d{0, 0, 200} + lean[k]);
    }
    return {inner, outer};
  }
  static detail::SourceTriangle triangle(Vec3d a, Vec3d b, Vec3d c) {
    return {a + shift(), b + shift(), c + shift(), normalized(cross(b - a, c - a)), 1e-3};
  }
  static detail::SourceCluster cluster_around(const std::vector<detail::SourceTriangle>& triangles) {
    Box3d box;
    Vec3d sum;
    for (const detail::SourceTriangle& t : triangles) {
      for (const Vec3d p : {t.a, t.b, t.c}) box.add(p);
      sum += t.normal;
    }
    detail::SourceCluster block = {box.centre(), box.extent() * 0.5, normalized(sum), 1, 0};
    for (const detail::SourceTriangle& t : triangles) {
      block.cosine = std::min(block.cosine, dot(block.axis, t.normal) - 1e-6);
      block.slack = std::max(block.slack, t.slack);
    }
    return block;
  }
  static Vec3d shift() { return {5000, 6000, 7000}; }
};

TEST_F(Section, LevelTriangleIsCrossed) {
  const auto s = slab();
  EXPECT_EQ(s.meet(triangle({100, 100, 100}, {300, 100, 100}, {100, 300, 100})), detail::Meeting::Section);
  EXPECT_EQ(s.meet(triangle({100, 100, 100}, {100, 300, 100}, {300, 100, 100})), detail::Meeting::Folded)
      << "upside down";
}

TEST_F(Section, EndsAreKeptClear) {
  const auto s = slab();
  EXPECT_EQ(s.meet(triangle({100, 100, 199}, {300, 100, 150}, {100, 300, 150})), detail::Meeting::Outer)
      << "one step below";
  EXPECT_EQ(s.meet(triangle({100, 100, 197}, {300, 100, 150}, {100, 300, 150})), detail::Meeting::Section);
  EXPECT_EQ(s.meet(triangle({100, 100, -5}, {300, 100, 50}, {100, 300, 50})), detail::Meeting::Inner);
  EXPECT_EQ(s.meet(triangle({100, 100, 250}, {300, 100, 250}, {100, 300, 250})), detail::Meeting::Apart);
  EXPECT_EQ(s.meet(triangle({-900, -900, 100}, {-300, -900, 100}, {-900, -300, 100})), detail::Meeting::Apart);
}

TEST_F(Section, OnlyThePartOfTheSlabCountsThatTheTriangleIsIn) {
  // The fibre at corner 1 leans over so far that it runs back through a triangle which faces along -x and up.
  const auto s = slab({Vec3d{}, Vec3d{600, 0, 0}, Vec3d{}});
  const Vec3d tilt = {40, 0, 20};  // along the triangle, across y
  const auto at = [&](double x) { return triangle(Vec3d{x, 50, 80}, Vec3d{x, 50, 80} + tilt, Vec3d{x, 90, 80}); };
  EXPECT_EQ(s.meet(at(20)), detail::Meeting::Section) << "near the upright fibres";
  EXPECT_EQ(s.meet(at(1000)), detail::Meeting::Folded) << "near the leaning fibre";
}

TEST_F(Section, WhatPassesTheSlabByMayFaceAnyWay) {
  // Across the upper edge at y = 0, which none of the slab's own planes tells apart.
  const auto s = slab();
  const Vec3d low = {100, -80, 190}, high = {100, 80, 330}, along = {400, 0, 0};
  EXPECT_EQ(s.meet(triangle(low, high, low + along)), detail::Meeting::Section);
  EXPECT_EQ(s.meet(triangle(low, low + along, high)), detail::Meeting::Section);
}

// Slabs and triangles at random: where the verdict is Section, fibres that meet the triangle do so from the back to the
// front, and where it is Apart none meet it.
TEST_F(Section, VerdictsHoldOnSampledFibres) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> wide(-700, 700), share(0, 1);
  int sections = 0, folded = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    const auto v = [&](double size) { return Vec3d{wide(random), wide(random), wide(random)} * size; };
    const auto s = slab({v(0.6), v(0.6), v(0.6)});
    if (detail::jacobian_fault(s.triangle(0), s.triangle(1)) != detail::JacobianFault::None) continue;
    const Vec3d at = {300 + 0.5 * wide(random), 300 + 0.5 * wide(random), 100 + 0.1 * wide(random)};
    const double size = trial % 2 == 0 ? 0.05 : 0.3;
    const auto t = triangle(at + v(size), at + v(size), at + v(size));
    const auto verdict = s.meet(t);
    sections += verdict == detail::Meeting::Section;
    folded += verdict == detail::Meeting::Folded;
    if (verdict != detail::Meeting::Section && verdict != detail::Meeting::Apart) continue;
    const TriangleMesh mesh = {{t.a, t.b, t.c}, {{0, 1, 2}}, {}};
    for (int k = 0; k < 60; ++k) {
      double a = share(random), b = share(random);
      if (a + b > 1) a = 1 - a, b = 1 - b;
      const auto end = [&](std::size_t side) {
        const auto& c = s.triangle(side);
        return detail::to_double(c[0]) * (1 - a - b) + detail::to_double(c[1]) * a + detail::to_double(c[2]) * b;
      };
      const auto [out, in] = passages(mesh, end(0), end(1));
      ASSERT_EQ(in, 0);
      ASSERT_TRUE(verdict == detail::Meeting::Section || out == 0);
    }
  }
  EXPECT_GT(sections, 500);
  EXPECT_GT(folded, 500);
}

// Of a list of any length only what is apart is left out, the rest comes in its order, and no section is a fault.
TEST_F(Section, NothingNearIsLeftOut) {
  std::mt19937 random(29);
  std::uniform_real_distribution<double> wide(-700, 700);
  const auto v = [&](double size) { return Vec3d{wide(random), wide(random), wide(random)} * size; };
  std::vector<detail::LatticePoint> points;
  std::vector<detail::Face> faces;
  for (std::uint32_t k = 0; k < 60; ++k) {
    const Vec3d at = shift() + Vec3d{300 + 0.5 * wide(random), 300 + 0.5 * wide(random), 100 + 0.1 * wide(random)};
    for (int corner = 0; corner < 3; ++corner) points.push_back(detail::snap(at + v(0.1)));
    faces.push_back({3 * k, 3 * k + 1, 3 * k + 2});
  }
  const detail::SourceIndex source(points, faces);
  std::size_t near = 0, left_out = 0, sections = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const auto s = slab({v(0.3), v(0.3), v(0.3)});
    if (detail::jacobian_fault(s.triangle(0), s.triangle(1)) != detail::JacobianFault::None) continue;
    std::vector<std::uint32_t> some;
    for (int k = 0; k < trial % 10; ++k) some.push_back(static_cast<std::uint32_t>(random() % faces.size()));
    std::size_t next = 0;
    source.for_near(s, some, [&](std::uint32_t t, bool is_section) {
      for (; next < some.size() && some[next] != t; ++next, ++left_out) {
        EXPECT_TRUE(s.is_apart(source.triangle(some[next])));
      }
      ASSERT_LT(next, some.size());
      ++next;
      ++near;
      sections += is_section;
      const auto meeting = s.meet(source.triangle(t));
      EXPECT_TRUE(!is_section || meeting == detail::Meeting::Section || meeting == detail::Meeting::Apart);
    });
    for (; next < some.size(); ++next, ++left_out) EXPECT_TRUE(s.is_apart(source.triangle(some[next])));
  }
  EXPECT_GT(near, 500U);
  EXPECT_GT(left_out, 500U);
  EXPECT_GT(sections, 20U);
}

// What the quick test settles, the thorough one settles the same way.
TEST_F(Section, QuickVerdictsAgree) {
  std::mt19937 random(23);
  std::uniform_real_distribution<double> wide(-700, 700);
  int apart = 0, sections = 0, left = 0, boxes_apart = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    const auto v = [&](double size) { return Vec3d{wide(random), wide(random), wide(random)} * size; };
    const auto s = slab({v(0.3), v(0.3), v(0.3)});
    if (detail::jacobian_fault(s.triangle(0), s.triangle(1)) != detail::JacobianFault::None) continue;
    const detail::LatticePoint origin = detail::snap(shift() + v(2));
    const detail::QuickShape quick(s, origin);
    detail::FourTriangles four;
    std::array<detail::LatticeTriangle, 4> triangles{};
    std::array<std::array<float, 4>, 4> normals{};
    std::vector<detail::SourceTriangle> exact;
    const std::size_t count = 1 + static_cast<std::size_t>(trial) % 4;
    for (std::size_t k = 0; k < count; ++k) {
      const Vec3d at = shift() + Vec3d{300 + 0.5 * wide(random), 300 + 0.5 * wide(random), 100 + 0.1 * wide(random)};
      const detail::LatticeTriangle t = {detail::snap(at + v(0.1)), detail::snap(at + v(0.1)),
                                         detail::snap(at + v(0.1))};
      const Vec3d a = detail::to_double(t[0]), b = detail::to_double(t[1]), c = detail::to_double(t[2]);
      const Vec3f n = to_float(normalized(cross(b - a, c - a)));
      triangles[k] = t;
      normals[k] = {n.x, n.y, n.z, 1e-3F};
      exact.push_back({a, b, c, to_double(n), double(1e-3F)});
    }
    four.set(triangles, normals, count, origin);
    const auto verdict = quick.meet(four);
    EXPECT_EQ(verdict.near >> count, 0U);
    EXPECT_EQ(verdict.near & ~quick.near(four), 0U);
    const unsigned near_boxes = quick.near_boxes(four), crossed = quick.crossed(four);
    EXPECT_EQ(near_boxes >> count, 0U);
    for (std::size_t k = 0; k < count; ++k) {
      const auto meeting = s.meet(exact[k]);
      if ((near_boxes >> k & 1U) == 0) {
        EXPECT_EQ(s.meet(cluster_around({exact[k]})), detail::Meeting::Apart);
        ++boxes_apart;
      }
      EXPECT_FALSE((crossed >> k & 1U) != 0 && meeting == detail::Meeting::Folded);
      EXPECT_EQ(s.is_apart(exact[k]), meeting == detail::Meeting::Apart);
      if ((verdict.near >> k & 1U) == 0) {
        EXPECT_EQ(meeting, detail::Meeting::Apart);
        ++apart;
      } else if ((verdict.section >> k & 1U) != 0) {
        EXPECT_TRUE(meeting == detail::Meeting::Section || meeting == detail::Meeting::Apart);
        ++sections;
      } else {
        ++left;
      }
    }
  }
  EXPECT_GT(apart, 1000);
  EXPECT_GT(sections, 300);
  EXPECT_GT(left, 300);
  EXPECT_GT(boxes_apart, 1000);
}

// What holds for a block holds for each of its triangles.
TEST_F(Section, BlocksSpeakForTheirTriangles) {
  std::mt19937 random(29);
  std::uniform_real_distribution<double> wide(-700, 700);
  std::map<detail::Meeting, int> found;
  for (int trial = 0; trial < 40000; ++trial) {
    const auto v = [&](double size) { return Vec3d{wide(random), wide(random), wide(random)} * size; };
    const auto s = slab({v(0.1), v(0.1), v(0.1)});
    if (detail::jacobian_fault(s.triangle(0), s.triangle(1)) != detail::JacobianFault::None) continue;
    const Vec3d at = {300 + 0.4 * wide(random), 300 + 0.4 * wide(random), 100 + 0.1 * wide(random)};
    // Flat pieces and crumpled ones.
    const Vec3d e = Vec3d{40, 0, 0} + v(0.01), f = Vec3d{0, 40, 0} + v(0.01);
    const double crumpled = trial % 2 == 0 ? 0.002 : 0.04;
    std::vector<detail::SourceTriangle> triangles;
    for (int k = 0; k < 4; ++k) {
      const Vec3d corner = at + e * (k % 2) + f * (k / 2 % 2);
      triangles.push_back(triangle(corner + v(crumpled), corner + e + v(crumpled), corner + f + v(crumpled)));
    }
    const detail::Meeting whole = s.meet(cluster_around(triangles));
    ++found[whole];
    for (const detail::SourceTriangle& t : triangles) {
      const detail::Meeting meeting = s.meet(t);
      const bool is_apart = meeting == detail::Meeting::Apart, is_section = meeting == detail::Meeting::Section;
      EXPECT_TRUE(whole != detail::Meeting::Apart || is_apart);
      EXPECT_TRUE(whole != detail::Meeting::Section || is_apart || is_section);
      EXPECT_TRUE(whole != detail::Meeting::Within || is_section || meeting == detail::Meeting::Folded);
    }
  }
  for (const auto meeting :
       {detail::Meeting::Apart, detail::Meeting::Section, detail::Meeting::Within, detail::Meeting::Mixed})
    EXPECT_GT(found[meeting], 300);
}

// Floats tell no block apart that a slab meets, be it at the end of the lattice, and call none a section.
TEST_F(Section, QuickVerdictsOnBlocksErrOnTheSafeSide) {
  std::mt19937 random(31);
  std::uniform_real_distribution<double> unit(-1, 1);
  const std::array<Vec3d, 3> places = {shift(), Vec3d{33552000, 33551000, 33550000}, Vec3d{1500, 33552000, 16777000}};
  int apart = 0, near = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    const auto v = [&](double size) { return Vec3d{unit(random), unit(random), unit(random)} * size; };
    const Vec3d place = places[static_cast<std::size_t>(trial) % places.size()];
    const auto s = slab({v(150), v(150), v(150)}, place);
    if (detail::jacobian_fault(s.triangle(0), s.triangle(1)) != detail::JacobianFault::None) continue;
    const detail::LatticePoint origin = detail::snap(place + v(1000));
    detail::FourTriangles four;
    four.set({}, {}, 4, origin);
    std::array<detail::SourceCluster, 4> blocks;
    for (std::size_t k = 0; k < 4; ++k) {
      const Vec3d half = v(200);
      blocks[k] = {place + Vec3d{300, 300, 100} + v(1000),
                   {std::abs(half.x), std::abs(half.y), std::abs(half.z)},
                   {0, 0, 1},
                   0.9,
                   0};
      four.set(k, blocks[k], origin);
    }
    const detail::QuickShape quick(s, origin);
    const unsigned near_boxes = quick.near_boxes(four);
    const auto verdict = quick.meet(four);
    EXPECT_EQ(verdict.section, 0U);
    EXPECT_EQ(verdict.near, near_boxes);
    for (std::size_t k = 0; k < 4; ++k) {
      if ((near_boxes >> k & 1U) != 0) {
        ++near;
        continue;
      }
      EXPECT_EQ(s.meet(blocks[k]), detail::Meeting::Apart);
      ++apart;
    }
  }
  EXPECT_GT(apart, 5000);
  EXPECT_GT(near, 3000);
}

/// The thin shell of a mesh on the lattice.
class ThinShells : public ::testing::Test {
 protected:
  static constexpr double kScale = 1e6;  // lattice steps
  static detail::SourceIndex source_of(const TriangleMesh& mesh) {
    std::vector<detail::LatticePoint> points;
    for (const Vec3d p : mesh.positions) points.push_back(detail::snap((p + Vec3d{4, 4, 4}) * kScale));
    return {points, mesh.triangles};
  }
};

// What was faulty stands once the source is mended, and as high as it would have from the start.
TEST_F(ThinShells, StandAgainOnAMendedSource) {
  const TriangleMesh ball = testing::ball(24);
  TriangleMesh mesh = ball;
  append(mesh, ball, {0.5, 0.1, 0.2});
  detail::SourceIndex source = source_of(mesh);
  const detail::Rings rings(source.faces, source.points.size());
  detail::InitialShell thin(source, rings, kScale);
  ASSERT_TRUE(thin.update({}, {}, {}));
  const std::vector<std::uint32_t> faults = thin.faults();
  ASSERT_FALSE(faults.empty());
  std::vector<std::uint32_t> moved;
  for (std::uint32_t v = 0; v < source.points.size(); ++v) {
    if (source.point_of[v] < ball.positions.size()) continue;
    source.points[v] = source.points[v] + detail::snap(Vec3d{3, 0, 0} * kScale);
    moved.push_back(v);
  }
  source.update();
  ASSERT_TRUE(thin.update(moved, {}, {}));
  EXPECT_TRUE(thin.faults().empty());
  EXPECT_TRUE(thin.folds().empty());
  detail::InitialShell anew(source, rings, kScale);
  ASSERT_TRUE(anew.update({}, {}, {}));
  ASSERT_TRUE(anew.faults().empty());
  const std::vector<detail::Ends> ends = thin.take_ends(), expected = anew.take_ends();
  for (const std::uint32_t f : faults)
    for (const std::uint32_t v : source.faces[f]) EXPECT_EQ(ends[v], expected[v]);
}

// What the builder takes for a section the verifier must prove. Where two fibres of a slab lean away from a triangle,
// both cut that part of the slab off and show that the triangle lies beside it, but they do not cut at the same place.
TEST_F(Section, VerifierAgrees) {
  using detail::LatticeTriangle;
  const auto is_section = [](const LatticeTriangle& inner, const LatticeTriangle& outer, const LatticeTriangle& t) {
    const detail::SourceIndex source(t, std::array<detail::Face, 1>{{{0, 1, 2}}});
    return detail::SlabShape(inner, outer).meet(source.triangle(0)) == detail::Meeting::Section;
  };
  const auto is_refused = [](const LatticeTriangle& inner, const LatticeTriangle& outer, const LatticeTriangle& t) {
    const auto places = [](const LatticeTriangle& of) {
      std::vector<std::array<double, 3>> all;
      for (const detail::LatticePoint p : of) all.push_back({double(p.x), double(p.y), double(p.z)});
      return all;
    };
    const std::vector<std::array<std::uint32_t, 3>> face = {{0, 1, 2}};
    const auto in = places(inner), out = places(outer), corners = places(t);
    const verify::Certificate c = verify::check({in, out, face}, {corners, face});
    return std::ranges::any_of(c.failures, [](const verify::Failure& f) {
      return f.condition == verify::Condition::C6 && f.what.find("does not face outwards") != std::string::npos;
    });
  };
  // Around a slab and a triangle of a brain of six million triangles.
  const std::array<Vec3d, 3> in = {Vec3d{-83992, -493252, 206564}, Vec3d{-1416606, -496291, -1944465},
                                   Vec3d{-1040789, -397124, -1060500}};
  const std::array<Vec3d, 3> out = {Vec3d{-124366, 79041, 208428}, Vec3d{159430, 92742, -237017},
                                    Vec3d{-177138, 97140, 168305}};
  const std::array<Vec3d, 3> corners = {Vec3d{0, 0, 0}, Vec3d{-8842, 55383, 0}, Vec3d{55383, 55383, 64225}};
  const Vec3d middle = {8e6, 8e6, 8e6};
  std::mt19937 random(17);
  std::uniform_real_distribution<double> unit(-1, 1);
  int sections = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    const auto near = [&](Vec3d p, double by) {
      return detail::snap(middle + p + Vec3d{unit(random), unit(random), unit(random)} * by);
    };
    LatticeTriangle inner{}, outer{}, t{};
    for (std::size_t k = 0; k < 3; ++k) {
      inner[k] = near(in[k], 2e4);
      outer[k] = near(out[k], 2e4);
      t[k] = near(corners[k], 1e4);
    }
    if (detail::jacobian_fault(inner, outer) != detail::JacobianFault::None || !is_section(inner, outer, t)) continue;
    ++sections;
    EXPECT_FALSE(is_refused(inner, outer, t)) << "trial " << trial;
  }
  EXPECT_GT(sections, 1000);
}

TEST_F(Section, BlocksAgreeWithTheirTriangles) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1, 1);
  int settled = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    const auto v = [&](double size) { return Vec3d{unit(random), unit(random), unit(random)} * size; };
    const auto s = slab({v(100), v(100), v(100)});
    const Vec3d at = Vec3d{300, 300, 100} + v(500);
    std::vector<detail::SourceTriangle> triangles;
    Box3d box;
    Vec3d sum;
    for (int k = 0; k < 6; ++k) {
      const Vec3d p = at + v(30);
      triangles.push_back(triangle(p, p + Vec3d{20, 0, 0} + v(8), p + Vec3d{0, 20, 0} + v(8)));
      for (const Vec3d c : {triangles.back().a, triangles.back().b, triangles.back().c}) box.add(c);
      sum += triangles.back().normal;
    }
    double cosine = 1;
    for (const auto& t : triangles) cosine = std::min(cosine, dot(t.normal, normalized(sum)));
    const auto whole = s.meet(detail::SourceCluster{box.centre(), box.extent() * 0.5, normalized(sum), cosine, 1e-3});
    if (whole == detail::Meeting::Mixed) continue;
    ++settled;
    for (const auto& t : triangles) {
      const auto one = s.meet(t);
      EXPECT_TRUE(one == detail::Meeting::Apart || one == whole);
    }
  }
  EXPECT_GT(settled, 1000);
}

// What is not needed while slabs are made lies in a file then (sample_memory), also where there is no shell in the end,
// or only after several attempts.
TEST(Certified, WhereTheSourceLiesMeanwhileChangesNothing) {
  TriangleMesh crossing = testing::ball(12), specks = testing::ball(16, 0.1), parts = testing::ball(12);
  append(crossing, testing::ball(12), {1.2, 0, 0});
  append(specks, testing::ball(16), {0, 3, 0}, 1e-6);
  append(parts, testing::torus(40, 20), {5, 0, 0});
  TriangleMesh coloured = testing::torus(40, 20);
  for (const Vec3d p : coloured.positions)
    coloured.colours.push_back({static_cast<std::uint8_t>(100 + 40 * p.x), 7, static_cast<std::uint8_t>(9), 255});
  ConvertSettings few = certified(40, 8);
  few.mode = {};
  ConvertSettings solids = few, to_an_error = few, anew = few;
  solids.mode = Mode::Tolerant;
  to_an_error.intervals = 0;
  to_an_error.error = 5e-3;
  anew.remesh = 0.05;
  struct Case {
    const char* name;
    const TriangleMesh& source;
    ConvertSettings settings;
    Mode reached;
  };
  for (auto& [name, source, settings, reached] :
       {Case{"closed", testing::torus(40, 20), few, Mode::Certified},
        Case{"open", testing::sheet(30, 0.08), few, Mode::Certified}, Case{"specks", specks, few, Mode::Certified},
        Case{"crossing", crossing, few, Mode::Certified}, Case{"solids", parts, solids, Mode::Tolerant},
        Case{"coloured", coloured, few, Mode::Certified},
        Case{"to an error", testing::torus(40, 20), to_an_error, Mode::Certified},
        Case{"remeshed", parts, anew, Mode::Certified}}) {
    SCOPED_TRACE(name);
    const auto in_memory = convert(source, settings);
    ConvertSettings aside = settings;
    aside.sample_memory = 0;
    const auto in_file = convert(source, aside);
    ASSERT_TRUE(in_memory && in_file);
    EXPECT_EQ(in_file->model.info.mode, reached);
    EXPECT_EQ(in_file->model.head->has(Layer::Colour), !source.colours.empty());
    EXPECT_EQ(in_file->model.head->content_hash(), in_memory->model.head->content_hash());
    EXPECT_EQ(in_file->mended.positions, in_memory->mended.positions);
    EXPECT_EQ(in_file->mended.triangles, in_memory->mended.triangles);
    EXPECT_EQ(in_file->report.notes, in_memory->report.notes);
    EXPECT_EQ(in_file->report.from_source.max, in_memory->report.from_source.max);
    EXPECT_EQ(in_file->report.to_source.rms, in_memory->report.to_source.rms);
  }
}

TEST(Certified, StopsWhenCancelledWhileTheSourceLiesElsewhere) {
  ConvertSettings settings = certified(40, 8);
  settings.sample_memory = 0;
  for (const std::string_view phase : {"reduce", "sample", "measure"}) {
    SCOPED_TRACE(phase);
    std::atomic<bool> cancel = false;
    const auto result = convert(
        testing::torus(160, 80), settings,
        {.report = [&](std::string_view name, double) { cancel = cancel || name == phase; }, .cancel = &cancel});
    EXPECT_TRUE(cancel) << "there is no such phase";
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, Errc::Cancelled);
  }
}

// Slabs of so many are first reduced in cells; what of each is gone and which part the others are of must go together.
TEST(Certified, PartsOfManyTrianglesKeepToTheirOwn) {
  TriangleMesh parts = testing::torus(120, 60);
  append(parts, testing::ball(100, 0.05), {6, 0, 0});
  append(parts, testing::torus(90, 60), {0, 0, 5});
  ASSERT_GT(parts.triangles.size(), 60'000U);
  const auto result = convert(parts, certified(200));
  expect_certified(result, 200);
  EXPECT_EQ(result->report.parts.count, 3U);
  EXPECT_EQ(result->report.parts.certified, 3U);
}

}  // namespace
}  // namespace relief
