#include "shapes.h"
#include "support/data.h"
#include "support/folder.h"

#include <relief/base/paged_memory.h>
#include <relief/convert/convert.h>
#include <relief/convert/sample/sampled_model.h>
#include <relief/convert/sample/source_rays.h>
#include <relief/core/query.h>
#include <relief/core/tessellate.h>
#include <relief/mesh/import.h>
#include <relief/mesh/samples.h>
#include <relief/verify/verify.h>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <filesystem>
#include <map>
#include <sstream>

namespace relief {
namespace {

using testing::append;
using testing::certificate;

ConvertSettings few(int slabs, int n = 15) {
  ConvertSettings settings;
  settings.slabs = slabs;
  settings.intervals = n;
  return settings;
}

std::size_t open_edges(const SlabMesh& mesh) {
  std::size_t count = 0;
  for (const Slab& s : mesh.slabs())
    for (const SlabId other : s.neighbours) count += other == kNoSlab;
  return count;
}

/// What holds for every conversion.
void expect_sound(const Result<Conversion>& result, const ConvertSettings& settings) {
  ASSERT_TRUE(result) << result.error().message;
  const Snapshot& model = *result->model.head;
  const ConvertReport& report = result->report;
  const auto valid = validate(model);
  EXPECT_TRUE(valid) << valid.error().message;
  const verify::Certificate shell = certificate(model.slab_mesh());
  EXPECT_TRUE(shell.all()) << (shell.failures.empty() ? "" : shell.failures.front().what);
  EXPECT_TRUE(shell.on_lattice);
  EXPECT_EQ(report.slabs, model.slab_mesh().slab_count());
  EXPECT_EQ(report.hits_single + report.hits_none + report.hits_several, report.fibres_cast);
  const double diagonal = result->model.info.source_diagonal;
  for (const Fibre& f : model.slab_mesh().fibres())
    EXPECT_LE(length(f.direction()), settings.thickness * diagonal * (1 + 1e-6));
  EXPECT_NE(result->model.info.mode, Mode::Preview);
  EXPECT_GT(report.thickness_min, 0);
}

double single_share(const ConvertReport& report) { return double(report.hits_single) / double(report.fibres_cast); }

// An edge, and a corner, that two cubes have in common.
TEST(Convert, CubesThatTouchMoveByATenthOfTheUsualErrorAtMost) {
  for (const Vec3d by : {Vec3d{1, 1, 0}, Vec3d{1, 1, 1}}) {
    TriangleMesh cubes = testing::box({1, 1, 1});
    append(cubes, testing::box({1, 1, 1}), by, 1);
    ConvertSettings settings = few(200, 8);
    const auto made = convert(cubes, settings);
    ASSERT_TRUE(made) << made.error().message;
    EXPECT_EQ(made->model.info.mode, Mode::Certified);
    EXPECT_GT(made->report.moved_vertices, 0U);
    EXPECT_LE(made->report.moved_most, 1e-5);
    EXPECT_LT(made->report.to_source.max, detail::kUsualError);
    EXPECT_NE(verdict(made->report, made->model.info).find("moved by at most"), std::string::npos);
  }
}

TEST(Convert, AnOpenSheetInsideABallIsTold) {
  TriangleMesh mesh = testing::ball(24);
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (const Vec3d p : {Vec3d{-0.3, -0.3, 0}, Vec3d{0.3, -0.3, 0}, Vec3d{0.3, 0.3, 0}, Vec3d{-0.3, 0.3, 0}})
    mesh.positions.push_back(p);
  mesh.triangles.push_back({first, first + 1, first + 2});
  mesh.triangles.push_back({first, first + 2, first + 3});
  const auto made = convert(mesh, few(60, 8));
  ASSERT_TRUE(made) << made.error().message;
  const std::string said = verdict(made->report, made->model.info);
  EXPECT_NE(said.find("removed: 2 triangles inside of other parts; 1 open part inside of others, near"),
            std::string::npos)
      << said;
  EXPECT_EQ(said.find("left open"), std::string::npos) << said;
}

// Beside the sheet the box's winding number is one half more or less: which side of it is the solid's is left to
// chance.
TEST(Convert, AnOpenSheetThroughABoxIsClosedOrTold) {
  TriangleMesh mesh = testing::box({1, 1, 1});
  append(mesh, testing::sheet(8), {-0.3, -0.3, 0.51}, 1.6);
  const auto closed = convert(mesh, few(60, 8));
  ASSERT_TRUE(closed) << closed.error().message;
  EXPECT_EQ(closed->report.closed_openings, 1U);
  EXPECT_EQ(closed->report.undecided.share, 0);

  ConvertSettings settings = few(60, 8);
  settings.remesh = 0.02;
  const auto solid = convert(mesh, settings);
  ASSERT_TRUE(solid) << solid.error().message;
  EXPECT_NEAR(solid->report.undecided.share, 1.6 * 1.6 / (6 + 1.6 * 1.6), 0.06);
  EXPECT_NEAR(solid->report.undecided.near.z, 0.51, 1e-6);
  EXPECT_TRUE(std::ranges::any_of(solid->report.notes, [](const std::string& note) {
    return note.starts_with("inside and outside cannot be told apart for ");
  }));
  const auto box = convert(testing::pierced(testing::ball(40), [](Vec3d p) { return p.z > 0.97; }), settings);
  ASSERT_TRUE(box) << box.error().message;
  EXPECT_EQ(box->report.undecided.share, 0) << "a hole is closed";
}

// A pipe of which one end is sunk in a block and the other, which stays open, is cut in two by a plate.
TEST(Convert, AnOpeningThatIsCutInTwoIsOneStill) {
  TriangleMesh mesh = testing::box({1, 1, 3});
  std::erase_if(mesh.triangles, [&](const Triangle& t) {
    const auto z = [&](std::size_t k) { return mesh.positions[t[k]].z; };
    return z(0) == z(1) && z(1) == z(2);
  });
  append(mesh, testing::box({3, 3, 1}), {-1, -1, -0.5});
  append(mesh, testing::box({0.2, 3, 1}), {0.4, -1, 2.5});
  const auto made = convert(mesh, few(100, 8));
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_EQ(made->report.closed_openings, 1U);
  EXPECT_GT(made->report.phantom_triangles, 1U);
}

TEST(Convert, AStrayTriangleSetsNoScale) {
  TriangleMesh mesh = testing::ball(16, 0.1);
  const auto alone = convert(mesh, few(40, 4));
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (const Vec3d p : {Vec3d{1e6, 0, 0}, Vec3d{1e6, 1e-2, 0}, Vec3d{1e6, 0, 1e-2}}) mesh.positions.push_back(p);
  mesh.triangles.push_back({first, first + 1, first + 2});
  const auto made = convert(mesh, few(40, 4));
  ASSERT_TRUE(alone && made);
  EXPECT_EQ(made->model.info.mode, Mode::Certified);
  EXPECT_EQ(made->model.head->content_hash(), alone->model.head->content_hash());
  EXPECT_EQ(made->report.strays.components, 1U);
  EXPECT_EQ(made->report.strays.triangles, 1U);
  EXPECT_GT(made->report.strays.near.x, 9e5);
  EXPECT_NE(verdict(made->report, made->model.info).find("far off"), std::string::npos);
}

// Of two balls the smaller has a fifth of the area, and there are slabs for one.
TEST(Convert, WhatIsMissingCounts) {
  TriangleMesh mesh = testing::ball(20);
  append(mesh, testing::ball(20), {3, 0, 0}, 0.5);
  ConvertSettings settings = few(6, 8);
  settings.mode = Mode::Tolerant;
  const auto made = convert(mesh, settings);
  ASSERT_TRUE(made) << made.error().message;
  const ConvertReport& report = made->report;
  EXPECT_EQ(report.dropped_parts, 1U);
  EXPECT_NEAR(report.coverage.share, 0.8, 0.001);
  EXPECT_NEAR(double(report.coverage.missed), 0.2 * double(report.coverage.places), 0.001 * 12'000);
  EXPECT_EQ(report.coverage.hidden, 0);
  EXPECT_GT(report.coverage.missing_near.x, 2.4);
  EXPECT_NEAR(double(report.hits_none) / double(report.fibres_cast), 0.2, 0.001);
  EXPECT_EQ(made->model.info.mode, Mode::Tolerant);
  EXPECT_NE(verdict(report, made->model.info).find("20 % of what can be seen of it is missing"), std::string::npos)
      << verdict(report, made->model.info);
  // Inside of the larger one nobody sees it.
  TriangleMesh buried = testing::ball(20);
  append(buried, testing::ball(20), {0.1, 0, 0}, 0.5);
  const auto whole = convert(buried, few(60, 8));
  ASSERT_TRUE(whole) << whole.error().message;
  EXPECT_EQ(whole->model.info.mode, Mode::Certified);
  EXPECT_EQ(whole->report.coverage.share, 1);
  EXPECT_NEAR(whole->report.coverage.hidden, 0.2, 0.001);
}

TEST(Convert, SaysWhereItTakesMoreSlabsThanAskedFor) {
  const auto mesh = make_sample("head", 5'000);
  ASSERT_TRUE(mesh);
  const auto few = convert(*mesh, {.slabs = 4}), enough = convert(*mesh, {.slabs = 400});
  ASSERT_TRUE(few && enough);
  EXPECT_EQ(few->report.slabs_asked, 4U);
  ASSERT_GT(few->report.slabs, 4U);
  EXPECT_NE(to_string(few->report).find("4 slabs were the target"), std::string::npos);
  ASSERT_LE(enough->report.slabs, 400U);
  EXPECT_EQ(to_string(enough->report).find("slabs were the target"), std::string::npos);
}

TEST(Convert, BallAtEveryGridSize) {
  for (const int n : {1, 2, 15, 32, 63, 128}) {
    const ConvertSettings settings = few(80, n);
    const auto result = convert(testing::ball(40, 0.05), settings);
    expect_sound(result, settings);
    ASSERT_TRUE(result);
    EXPECT_LE(result->report.slabs, 80U);
    EXPECT_GE(result->report.slabs, 60U);
    EXPECT_EQ(open_edges(result->model.head->slab_mesh()), 0U);
    EXPECT_EQ(result->report.hits_single, result->report.fibres_cast) << n;
    EXPECT_LT(result->report.to_mended.max, n == 1 ? 0.1 : n == 2 ? 0.04 : n == 15 ? 4e-3 : 2e-3) << n;
  }
}

TEST(Convert, LeavesRoomToCarveAndToAdd) {
  const ConvertSettings settings = few(80);
  const auto result = convert(testing::ball(40), settings);
  expect_sound(result, settings);
  const Snapshot& model = *result->model.head;
  for (SlabId s = 0; s < model.slab_mesh().slab_count(); ++s) {
    const float* const alpha = model.displacement(s);
    for (std::size_t k = 0; k < sample_count(15); ++k) {
      EXPECT_GT(alpha[k], 0.15F);
      EXPECT_LT(alpha[k], 0.9F);
    }
  }
  EXPECT_GT(result->report.thickness_min, 0.05);
}

TEST(Convert, TorusStaysATorus) {
  const ConvertSettings settings = few(120);
  const auto result = convert(testing::torus(80, 40), settings);
  expect_sound(result, settings);
  const SlabMesh& mesh = result->model.head->slab_mesh();
  EXPECT_EQ(open_edges(mesh), 0U);
  EXPECT_LE(mesh.slab_count(), 120U);
  // Euler characteristic 0: V - E + F with E = 3 F / 2.
  EXPECT_EQ(2 * mesh.fibres().size(), mesh.slab_count());
  EXPECT_GT(single_share(result->report), 0.99);
}

TEST(Convert, CubeAndTetrahedronAreExact) {
  for (const TriangleMesh& solid : {testing::box({1, 1, 1}), testing::tetrahedron()}) {
    const ConvertSettings settings = few(4, 8);
    const auto result = convert(solid, settings);
    expect_sound(result, settings);
    EXPECT_EQ(open_edges(result->model.head->slab_mesh()), 0U);
    EXPECT_LT(result->report.to_mended.rms, 0.02);
  }
  const ConvertSettings settings = few(12, 8);
  const auto cube = convert(testing::box({1, 1, 1}), settings);
  expect_sound(cube, settings);
  EXPECT_EQ(cube->report.slabs, 12U);
  EXPECT_LT(cube->report.to_mended.max, 1e-6);
}

TEST(Convert, ThinPlateStaysClosed) {
  const ConvertSettings settings = few(40);
  const auto plate = convert(testing::box({1, 1, 0.002}), settings);
  expect_sound(plate, settings);
  EXPECT_EQ(open_edges(plate->model.head->slab_mesh()), 0U);
  EXPECT_LT(plate->report.to_mended.max, 1e-4);
}

TEST(Convert, KnifeEdgeStaysClosed) {
  TriangleMesh blade = testing::box({1, 1, 0.1});
  for (Vec3d& p : blade.positions)
    if (p.y > 0.5) p.z = p.z > 0.05 ? 0.0505 : 0.0495;
  const ConvertSettings settings = few(40);
  const auto result = convert(blade, settings);
  expect_sound(result, settings);
  EXPECT_EQ(open_edges(result->model.head->slab_mesh()), 0U);
}

TEST(Convert, FlatSheetStaysFlat) {
  const ConvertSettings settings = few(20);
  const auto result = convert(testing::sheet(30), settings);
  expect_sound(result, settings);
  EXPECT_TRUE(result->model.head->has(Layer::Void));
  EXPECT_LE(result->report.slabs, 20U);
  // But for what closes it, which begins within a micro-triangle of the rim.
  for (const Vec3d p : to_mesh(*result->model.head).positions)
    EXPECT_TRUE(std::max(std::abs(p.x - 0.5), std::abs(p.y - 0.5)) > 0.48 || std::abs(p.z) < 1e-6)
        << p.x << " " << p.y << " " << p.z;
}

TEST(Convert, HillyOpenSheet) {
  const ConvertSettings settings = few(100, 32);
  const auto result = convert(testing::sheet(60, 0.08), settings);
  expect_sound(result, settings);
  EXPECT_GT(single_share(result->report), 0.97);
  EXPECT_LT(result->report.to_mended.rms, 1e-3);
}

TEST(Convert, NestedBallsKeepTheirCavity) {
  TriangleMesh mesh = testing::ball(30);
  append(mesh, testing::turned(testing::ball(24)), {}, 0.9);
  const ConvertSettings settings = few(200);
  const auto result = convert(mesh, settings);
  expect_sound(result, settings);
  EXPECT_EQ(open_edges(result->model.head->slab_mesh()), 0U);
  // The volume of the wall, less what 200 slabs of 15 intervals round off.
  const double wall = 4.18879 * (1 - 0.9 * 0.9 * 0.9);
  EXPECT_NEAR(signed_volume(to_mesh(*result->model.head)), wall, 0.05 * wall);
}

TEST(Convert, SmallPartBesideALargeOneIsNotSwallowed) {
  // The crumb lies within the depth that the ball's slabs would like to have.
  TriangleMesh mesh = testing::ball(30);
  append(mesh, testing::ball(8), {1.08, 0.02, 0.03}, 0.03);
  const ConvertSettings settings = few(80);
  const auto result = convert(mesh, settings);
  expect_sound(result, settings);
  EXPECT_EQ(open_edges(result->model.head->slab_mesh()), 0U);
}

TEST(Convert, PartsFarApart) {
  TriangleMesh mesh = testing::ball(30);
  append(mesh, testing::torus(30, 20), {500, -300, 200});
  const ConvertSettings settings = few(150);
  const auto result = convert(mesh, settings);
  expect_sound(result, settings);
  EXPECT_EQ(open_edges(result->model.head->slab_mesh()), 0U);
  EXPECT_GT(single_share(result->report), 0.98);
}

TEST(Convert, EveryPartGetsItsSlabsBeyondTheTarget) {
  TriangleMesh mesh;
  for (int k = 0; k < 100; ++k) append(mesh, testing::ball(6), {double(3 * (k % 10)), double(3 * (k / 10)), 0});
  const ConvertSettings settings = few(50, 4);
  const auto result = convert(mesh, settings);
  expect_sound(result, settings);
  EXPECT_EQ(result->report.dropped_parts, 0U);
  EXPECT_GE(result->report.slabs, 400U);
  EXPECT_EQ(open_edges(result->model.head->slab_mesh()), 0U);
}

TEST(Convert, MoebiusStripIsCutAndConverted) {
  const ConvertSettings settings = few(60);
  const auto result = convert(testing::moebius(60), settings);
  expect_sound(result, settings);
  EXPECT_GT(result->report.repair.cut_seams, 0U);
}

TEST(Convert, AnySizeAnywhere) {
  const TriangleMesh ball = testing::ball(24, 0.05);
  for (const auto& [scale, shift] :
       {std::pair{1e-3, 0.0}, {1e6, 0.0}, {1.0, 1e6}, {1e-3, 1e6}, {1e-30, 0.0}, {1e30, 0.0}}) {
    const ConvertSettings settings = few(60);
    const auto result = convert(testing::scaled(ball, scale, {shift, -shift, shift}), settings);
    expect_sound(result, settings);
    ASSERT_TRUE(result);
    EXPECT_EQ(open_edges(result->model.head->slab_mesh()), 0U);
    EXPECT_GT(single_share(result->report), 0.99) << scale << " " << shift;
    EXPECT_LT(result->report.to_mended.rms, 1e-3) << scale << " " << shift;
  }
}

TEST(Convert, TheNumberOfThreadsChangesNothing) {
  TriangleMesh mesh = testing::torus(60, 30);
  for (const Vec3d p : mesh.positions)
    mesh.colours.push_back(
        {static_cast<std::uint8_t>(40 * (p.x + 3)), static_cast<std::uint8_t>(40 * (p.y + 3)), 7, 255});
  std::vector<std::uint64_t> hashes;
  for (const std::size_t threads : {1U, 2U, 2U}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const auto result = convert(mesh, few(100, 16));
    ASSERT_TRUE(result);
    hashes.push_back(result->model.head->content_hash());
  }
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_EQ(hashes[0], hashes[2]);
}

TEST(Convert, WhereTheSamplesLieChangesNothing) {
  const auto bowl = make_sample("bowl", 2000);
  ASSERT_TRUE(bowl);
  TriangleMesh crossing = testing::ball(12);  // fibres meet it several times, and not at all
  append(crossing, testing::ball(12), {1.2, 0, 0});
  for (const auto& [source, n] : {std::pair{*bowl, 0}, std::pair{crossing, 15}}) {
    ConvertSettings settings = few(100, n);
    const auto in_memory = convert(source, settings);
    settings.sample_memory = 0;
    const auto in_file = convert(source, settings);
    ASSERT_TRUE(in_memory && in_file);
    const Snapshot &model = *in_file->model.head, &before = *in_memory->model.head;
    EXPECT_EQ(model.content_hash(), before.content_hash());
    EXPECT_EQ(in_file->report.from_mended.max, in_memory->report.from_mended.max);
    ASSERT_NE(model.tile(Layer::Displacement, 0).memory(), nullptr);
    EXPECT_GT(model.tile(Layer::Displacement, 0).memory()->file_bytes(), 0U);
    EXPECT_EQ(before.tile(Layer::Displacement, 0).memory(), nullptr) << "what is not asked for";
    SnapshotDraft draft(in_file->model.head);
    EXPECT_EQ(draft.edit(Layer::Displacement, 0).memory(), nullptr) << "an edited tile lies in the file";
  }
}

TEST(Convert, ColoursFollowTheSource) {
  TriangleMesh mesh = testing::ball(60);
  const auto colour = [](Vec3d p) { return Vec3d{(p.x + 1) / 2, (p.y + 1) / 2, (p.z + 1) / 2}; };
  for (const Vec3d p : mesh.positions) {
    const Vec3d c = colour(p) * 255;
    mesh.colours.push_back(
        {static_cast<std::uint8_t>(c.x), static_cast<std::uint8_t>(c.y), static_cast<std::uint8_t>(c.z), 255});
  }
  ConvertSettings settings = few(60);
  const auto result = convert(mesh, settings);
  expect_sound(result, settings);
  const Snapshot& model = *result->model.head;
  ASSERT_TRUE(model.has(Layer::Colour));
  EXPECT_EQ(model.tile(Layer::Colour, 0).intervals(), 32) << "twice as dense as the corners of the ball";
  for (SlabId s = 0; s < model.slab_mesh().slab_count(); ++s) {
    const SurfacePoint p = surface_point(model, s, 0.3, 0.4);
    const Vec3d want = colour(normalized(p.position));
    const Vec3d got = to_double(colour_at(model, s, 0.3, 0.4));
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(got[c], want[c], 0.02);
  }
  const TriangleMesh out = to_mesh(model);
  ASSERT_EQ(out.colours.size(), out.positions.size());
  EXPECT_NEAR(out.colours[0].r, 255 * colour(normalized(out.positions[0])).x, 6);
  settings.colour_intervals = 5;
  EXPECT_EQ(convert(mesh, settings)->model.head->tile(Layer::Colour, 0).intervals(), 5);
}

TEST(Convert, ColoursOfEightBitsComeOutAsTheyWentIn) {
  for (const Rgba8 colour : {Rgba8{0, 1, 2, 255}, Rgba8{127, 128, 129, 255}, Rgba8{253, 254, 255, 255}}) {
    TriangleMesh mesh = testing::ball(20);
    mesh.colours.assign(mesh.positions.size(), colour);
    const auto result = convert(mesh, few(60, 5));
    ASSERT_TRUE(result);
    const TriangleMesh out = to_mesh(*result->model.head);
    ASSERT_EQ(out.colours.size(), out.positions.size());
    for (const Rgba8 c : out.colours) ASSERT_EQ(std::tie(c.r, c.g, c.b), std::tie(colour.r, colour.g, colour.b));
  }
}

/// A ball of loose triangles, its image laid on along y: below z = 0 a picture, above it plain.
TriangleMesh pictured_ball(int rows, const std::function<Vec3d(double, double)>& picture, Rgba8 plain) {
  constexpr std::uint32_t kSize = 256;
  Image image{kSize, kSize, {}};
  for (std::uint32_t y = 0; y < kSize; ++y)
    for (std::uint32_t x = 0; x < kSize; ++x) {
      const Vec3d c = picture((x + 0.5) / kSize, (y + 0.5) / kSize) * 255;
      image.pixels.push_back({static_cast<std::uint8_t>(std::lround(c.x)), static_cast<std::uint8_t>(std::lround(c.y)),
                              static_cast<std::uint8_t>(std::lround(c.z))});
    }
  const TriangleMesh joined = testing::ball(rows);
  TriangleMesh mesh;
  mesh.materials = {{.colour = {},
                     .image = std::make_shared<const Image>(std::move(image)),
                     .wrap_u = Wrap::Clamp,
                     .wrap_v = Wrap::Clamp},
                    {.colour = plain}};
  for (const Triangle& t : joined.triangles) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.triangles.push_back({first, first + 1, first + 2});
    TriangleUv& uv = mesh.uvs.emplace_back();
    double height = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3d p = joined.positions[t[k]];
      mesh.positions.push_back(p);
      uv[k] = {static_cast<float>((p.x + 1) / 2), static_cast<float>((p.z + 1) / 2)};
      height += p.z;
    }
    mesh.material_of.push_back(height > 0 ? 1U : 0U);
  }
  return mesh;
}

TEST(Convert, ImagesArriveAtTheResolutionOfTheColours) {
  const auto picture = [](double u, double v) {
    const double wave = std::sin(40 * u) * std::sin(31 * v);
    return Vec3d{0.5 + 0.45 * wave, u, 1 - v};
  };
  constexpr Rgba8 kPlain = {10, 120, 230};
  // Triangles far larger than the waves, so only the image can carry them.
  const TriangleMesh mesh = pictured_ball(10, picture, kPlain);
  TriangleMesh doubled = mesh;
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 7) {
    doubled.triangles.push_back(mesh.triangles[t]);
    doubled.material_of.push_back(mesh.material_of[t]);
    doubled.uvs.push_back(mesh.uvs[t]);
  }
  for (const TriangleMesh& source : {mesh, testing::turned(mesh), doubled}) {
    ConvertSettings settings = few(60, 32);
    settings.colour_intervals = 64;
    TriangleMesh given = source;
    // turned() swaps corners; so must what belongs to them.
    if (given.triangles[0] != mesh.triangles[0])
      for (TriangleUv& uv : given.uvs) std::swap(uv[1], uv[2]);
    const auto result = convert(given, settings);
    expect_sound(result, settings);
    ASSERT_TRUE(result);
    const Snapshot& model = *result->model.head;
    ASSERT_TRUE(model.has(Layer::Colour));
    std::size_t below = 0, above = 0;
    double worst = 0;
    for (SlabId s = 0; s < model.slab_mesh().slab_count(); ++s)
      for (int j = 0; j <= 64; ++j)
        for (int i = 0; i + j <= 64; ++i) {
          const Vec3d p = surface_point(model, s, i / 64.0, j / 64.0).position;
          const Tile& tile = model.tile(Layer::Colour, s);
          const std::size_t at = sample_index(64, {i, j});
          const Vec3d got = to_double({tile.value(0, at), tile.value(1, at), tile.value(2, at)});
          if (std::abs(p.z) < 0.25) continue;
          const Vec3d want = p.z > 0 ? Vec3d{kPlain.r / 255.0, kPlain.g / 255.0, kPlain.b / 255.0}
                                     : picture((p.x + 1) / 2, (p.z + 1) / 2);
          worst = std::max(worst, length(got - want));
          ++(p.z > 0 ? above : below);
        }
    EXPECT_GT(std::min(above, below), 20'000U);
    EXPECT_LT(worst, 0.06);
  }
}

TEST(Convert, ColoursAreAsFineAsTheSourceHasThem) {
  const auto colours_at_n = [](const TriangleMesh& source, int n) {
    return convert(source, few(60, n))->model.head->tile(Layer::Colour, 0).intervals();
  };
  TriangleMesh coarse = testing::ball(10);
  coarse.colours.assign(coarse.positions.size(), {200, 100, 50, 255});
  EXPECT_LE(colours_at_n(coarse, 0), 8) << "the displacement is finer";
  EXPECT_EQ(colours_at_n(coarse, 15), 16) << "as fine as the n that was asked for";
  // As few triangles, and about 500 pixels to a slab.
  EXPECT_EQ(colours_at_n(pictured_ball(10, [](double u, double v) { return Vec3d{u, v, 0}; }, {}), 0), 128);
}

/// The greatest distance of each slab from the mended source and back, share of the diagonal: by many points of each
/// micro-triangle, and by the source's corners.
std::vector<double> farthest_of_slabs(const Conversion& made) {
  constexpr int kFine = 3;
  constexpr std::size_t kMostCorners = 20'000;
  const Snapshot& model = *made.model.head;
  const SlabMesh& mesh = model.slab_mesh();
  const double diagonal = made.model.info.source_diagonal;
  const detail::Lattice lattice = detail::Lattice::around(bounds(made.mended), 0.1 * diagonal);
  const detail::SourceRays source(made.mended.positions, made.mended.triangles, lattice);
  std::vector<double> farthest(mesh.slab_count(), 0);
  for (SlabId s = 0; s < mesh.slab_count(); ++s)
    for_each_cell(mesh.intervals(s), mesh.edge_intervals(s), [&](const std::array<GridPoint, 3>& cell) {
      const std::array<Vec3d, 3> p = {sample_position(model, s, cell[0]), sample_position(model, s, cell[1]),
                                      sample_position(model, s, cell[2])};
      for (int j = 0; j <= kFine; ++j)
        for (int i = 0; i + j <= kFine; ++i) {
          const Vec3d q = (p[0] * (kFine - i - j) + p[1] * i + p[2] * j) * (1.0 / kFine);
          farthest[s] = std::max(farthest[s], source.nearest(lattice.to_lattice(q)).distance * lattice.step / diagonal);
        }
    });
  LocateHint hint;
  const std::size_t stride = 1 + made.mended.positions.size() / kMostCorners;
  for (std::size_t v = 0; v < made.mended.positions.size(); v += stride) {
    const Vec3d p = made.mended.positions[v];
    if (const auto at = locate(mesh, p, hint))
      farthest[at->slab] = std::max(farthest[at->slab], length(closest_point(model, p).position - p) / diagonal);
  }
  return farthest;
}

TEST(Convert, TheGreatestDistanceIsThatOfADenseMeasurement) {
  for (const auto& [mesh, n] : {std::pair{testing::ball(40, 0.2), 15}, std::pair{testing::ball(16, 0.3), 32},
                                std::pair{testing::torus(60, 24), 8}}) {
    ConvertSettings settings = few(60, n);
    settings.mode = Mode::Certified;
    const auto result = convert(mesh, settings);
    ASSERT_TRUE(result) << result.error().message;
    const std::vector<double> farthest = farthest_of_slabs(*result);
    const double truth = *std::max_element(farthest.begin(), farthest.end());
    const double reported = std::max(result->report.to_mended.max, result->report.from_mended.max);
    EXPECT_GT(reported, 0.95 * truth) << n;
    EXPECT_LT(reported, 1.02 * truth) << n;
    EXPECT_GT(result->report.to_mended.points, result->report.slabs * static_cast<std::size_t>(4 * n * n));
    EXPECT_GT(result->report.from_mended.points, mesh.positions.size());
    EXPECT_EQ(result->report.error, 0) << "n was given";
    const auto off = std::ranges::count_if(farthest, [](double d) { return d > 1e-4; });
    EXPECT_LE(result->report.slabs_too_coarse, static_cast<std::size_t>(off) + 2) << n << ": a measurement apart";
    if (n == 8) {
      EXPECT_GT(2 * result->report.slabs_too_coarse, static_cast<std::size_t>(off)) << "far from the default";
    }
    const bool told = std::ranges::any_of(result->report.notes, [&](const std::string& note) {
      return note.starts_with("--samples " + std::to_string(n) + " loses detail in ");
    });
    EXPECT_EQ(told, result->report.slabs_too_coarse > 0) << n;
  }
}

/// Where fibres pass the source by, samples do not lie on it, and no bend of the surface tells how far off it is.
TEST(Convert, TheGreatestDistanceIsFoundWhereFibresMeetNothing) {
  for (const int slabs : {48, 50}) {
    ConvertSettings settings = few(slabs, 16);
    settings.mode = Mode::Tolerant;
    const auto made = convert(testing::grooved_torus(60, 48), settings);
    ASSERT_TRUE(made) << made.error().message;
    ASSERT_GT(made->report.hits_none, 100U);
    const Snapshot& model = *made->model.head;
    const double diagonal = made->model.info.source_diagonal;
    const detail::Lattice lattice = detail::Lattice::around(bounds(made->mended), 0.1 * diagonal);
    const detail::SourceRays source(made->mended.positions, made->mended.triangles, lattice);
    double most = 0;
    for (SlabId s = 0; s < model.slab_mesh().slab_count(); ++s)
      for_each_cell(16, [&](const std::array<GridPoint, 3>& cell) {
        Vec3d middle;
        for (const GridPoint& p : cell) middle += sample_position(model, s, p) / 3;
        most = std::max(most, source.nearest(lattice.to_lattice(middle)).distance * lattice.step / diagonal);
      });
    EXPECT_GE(made->report.to_mended.max, (1 - 1e-6) * most);
  }
}

/// The slabs' borders do not lie on its edges.
TEST(Convert, ASourceOfFewTrianglesIsSampledFinelyWhereItIsSharp) {
  TriangleMesh triangle;
  triangle.positions = {{0, 0, 0}, {3, 0.1, 0}, {0.7, 2, 0.3}};
  triangle.triangles = {{0, 1, 2}};
  const auto made = convert(triangle, {.slabs = 200});
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_LT(std::max(made->report.to_mended.max, made->report.from_mended.max), 5e-3);  // with n = 8: 0.1
}

TEST(Convert, KeepsToTheErrorOrTellsWhichSlabsDoNot) {
  const TriangleMesh mesh = testing::ball(90, 0.03);
  std::size_t before = 0;
  for (const double error : {1e-3, 1e-4, 3e-5}) {
    ConvertSettings settings = few(60, 0);
    settings.mode = Mode::Certified;
    settings.error = error;
    const auto result = convert(mesh, settings);
    ASSERT_TRUE(result) << result.error().message;
    const std::vector<double> farthest = farthest_of_slabs(*result);
    std::size_t samples = 0, finest = 0;
    for (const Slab& s : result->model.head->slab_mesh().slabs()) {
      samples += sample_count(s.intervals);
      finest += s.intervals == kMaxIntervals;
    }
    const auto off = std::count_if(farthest.begin(), farthest.end(), [&](double d) { return d > 1.02 * error; });
    EXPECT_LE(static_cast<std::size_t>(off), result->report.slabs_too_coarse) << error;
    EXPECT_LE(result->report.slabs_too_coarse, finest) << error << ": all others could be finer";
    EXPECT_EQ(result->report.slabs_too_coarse > 0, result->report.too_coarse_most > error) << error;
    EXPECT_GT(samples, before) << "no finer than it must be";
    before = samples;
    EXPECT_TRUE(error < 5e-5 || result->report.slabs_too_coarse == 0) << error;
  }
}

TEST(Convert, StopsWhenAsked) {
  std::atomic<bool> cancel = true;
  Progress progress;
  progress.cancel = &cancel;
  const TriangleMesh mesh = testing::ball(60);
  const auto at_once = convert(mesh, few(80), progress);
  ASSERT_FALSE(at_once);
  EXPECT_EQ(at_once.error().code, Errc::Cancelled);
  for (const std::string_view phase : {"shell", "reduce", "sample", "measure"}) {
    cancel = false;
    bool seen = false;
    progress.report = [&](std::string_view name, double share) {
      EXPECT_GE(share, 0);
      EXPECT_LE(share, 1);
      if (name != phase) return;
      seen = true;
      cancel = true;
    };
    const auto result = convert(mesh, few(80), progress);
    EXPECT_TRUE(seen) << phase;
    ASSERT_FALSE(result) << phase;
    EXPECT_EQ(result.error().code, Errc::Cancelled);
  }
}

TEST(Convert, SaysWhatCollapsed) {
  TriangleMesh far = testing::ball(60);
  for (Vec3d& p : far.positions) p = to_double(to_float(p + Vec3d{1e7, 1e7, 1e7}));
  const auto collapsed = convert(far, few(40, 0));
  ASSERT_TRUE(collapsed) << collapsed.error().message;
  ASSERT_GE(collapsed->report.notes.size(), 1U);
  EXPECT_NE(collapsed->report.notes.front().find("14160 triangles"), std::string::npos)
      << collapsed->report.notes.front();
  EXPECT_NE(to_string(collapsed->report).find(collapsed->report.notes.front()), std::string::npos);

  EXPECT_NE(collapsed->report.notes.front().find("far from the origin"), std::string::npos);

  // Every face twice has nothing to do with where it lies.
  TriangleMesh doubled = testing::ball(12);
  const std::size_t once = doubled.triangles.size();
  doubled.triangles.insert(doubled.triangles.end(), doubled.triangles.begin(),
                           doubled.triangles.begin() + std::ptrdiff_t(once));
  const auto halved = convert(doubled, few(40, 0));
  ASSERT_TRUE(halved) << halved.error().message;
  ASSERT_GE(halved->report.notes.size(), 1U);
  const std::string& twice = halved->report.notes.front();
  EXPECT_NE(twice.find(std::to_string(once) + " of " + std::to_string(2 * once)), std::string::npos) << twice;
  EXPECT_NE(twice.find("more than once"), std::string::npos) << twice;
  EXPECT_EQ(twice.find("origin"), std::string::npos) << twice;
}

TEST(Convert, RefusesWhatIsTooFarFromTheOriginForItsTriangles) {
  const TriangleMesh ball = testing::ball(30);  // triangles of some 0.09
  const ConvertSettings settings = few(40);
  expect_sound(convert(testing::scaled(ball, 1, {1e12, 0, 0}), settings), settings);
  for (const double away : {1e14, -1e15}) {
    const auto far = convert(testing::scaled(ball, 1, {away, 0, 0}), settings);
    ASSERT_FALSE(far);
    EXPECT_EQ(far.error().code, Errc::Corrupt);
    EXPECT_NE(far.error().message.find("from the origin"), std::string::npos) << far.error().message;
  }
  // It is the size of the triangles that counts.
  EXPECT_TRUE(convert(testing::scaled(ball, 100, {1e14, 0, 0}), settings));
}

TEST(Convert, RefusesWithASentence) {
  const TriangleMesh mesh = testing::ball(8);
  const auto refused = [&](const ConvertSettings& settings, std::string_view word) {
    const auto result = convert(mesh, settings);
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, Errc::InvalidArgument);
    EXPECT_NE(result.error().message.find(word), std::string::npos) << result.error().message;
  };
  refused(few(3), "3");
  refused(few(2'000'000), "2000000");
  refused(few(80, -1), "-1");
  refused(few(80, 129), "129");
  for (const double error : {0.0, -1e-4, 2.0, std::nan("")}) {
    ConvertSettings settings = few(80, 0);
    settings.error = error;
    refused(settings, "error");
  }
  ConvertSettings thin = few(80);
  thin.thickness = 0;
  refused(thin, "thickness");
  thin.thickness = std::nan("");
  refused(thin, "thickness");
  EXPECT_EQ(convert({}, few(80)).error().code, Errc::Corrupt);
}

TEST(ToMesh, HasOneVertexPerDistinctSampleAndIsClosed) {
  const auto result = convert(testing::ball(30), few(60, 16));
  ASSERT_TRUE(result);
  const TriangleMesh full = to_mesh(*result->model.head), half = to_mesh(*result->model.head, 1);
  const std::size_t slabs = result->report.slabs;
  EXPECT_EQ(full.positions.size(), slabs / 2 + 2 + slabs * 3 / 2 * 15 + slabs * 15 * 14 / 2);
  EXPECT_EQ(full.triangles.size(), 256 * result->report.slabs);
  EXPECT_EQ(half.triangles.size(), 64 * result->report.slabs);
  for (const TriangleMesh* mesh : {&full, &half}) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    for (const Triangle& t : mesh->triangles)
      for (std::size_t k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
    for (const auto& [edge, count] : edges) {
      EXPECT_EQ(count, 1);
      EXPECT_TRUE(edges.contains({edge.second, edge.first}));
    }
    EXPECT_NEAR(signed_volume(*mesh), 4.1, 0.1);
  }
  EXPECT_TRUE(full.colours.empty());
}

TEST(ExportSurface, TurnsAndThinsWhatItWrites) {
  using Up = SurfaceExport::Up;
  const testing::Folder folder;
  const auto result = convert(testing::ball(30), few(60, 16));
  ASSERT_TRUE(result);
  const Snapshot& model = *result->model.head;
  const auto exported = [&](const SurfaceExport& how) {
    const auto made = export_surface(model, folder / "out.obj", how);
    EXPECT_TRUE(made) << made.error().message;
    auto read = import_mesh(folder / "out.obj");
    EXPECT_TRUE(read);
    EXPECT_EQ(made->vertices, read->positions.size());
    EXPECT_EQ(made->triangles, read->triangles.size());
    return std::move(read->positions);
  };
  for (const int level : {0, 1}) {
    const std::vector<Vec3d> lies = exported({.level = level}), z_up = exported({.level = level, .up = Up::Z}),
                             y_up = exported({.level = level, .up = Up::Y});
    EXPECT_EQ(lies, to_mesh(model, level).positions);
    ASSERT_EQ(z_up.size(), lies.size());
    ASSERT_EQ(y_up.size(), lies.size());
    for (std::size_t v = 0; v < lies.size(); ++v) {
      EXPECT_EQ(z_up[v], (Vec3d{lies[v].x, -lies[v].z, lies[v].y}));
      EXPECT_EQ(y_up[v], (Vec3d{lies[v].x, lies[v].z, -lies[v].y}));
    }
  }
  const std::atomic<bool> cancel{true};
  EXPECT_EQ(export_surface(model, folder / "never.obj", {}, {.report = {}, .cancel = &cancel}).error().code,
            Errc::Cancelled);
  EXPECT_FALSE(std::filesystem::exists(folder / "never.obj"));

  double told = 0;
  const Progress progress = {.report =
                                 [&](std::string_view phase, double share) {
                                   EXPECT_EQ(phase, "export");
                                   EXPECT_GE(share, told) << "one share of the whole";
                                   told = share;
                                 },
                             .cancel = nullptr};
  ASSERT_TRUE(export_surface(model, folder / "out.obj", {}, progress));
  EXPECT_EQ(told, 1);
}

TEST(ExportSurface, FarFromTheOriginPlyKeepsDoubles) {
  const testing::Folder folder;
  TriangleMesh near = testing::ball(30), far = near;
  for (Vec3d& p : far.positions) p += Vec3d{1e6, 0, 0};
  for (TriangleMesh* source : {&near, &far}) {
    const bool is_far = source == &far;
    const auto result = convert(std::move(*source), few(60, 16));
    ASSERT_TRUE(result);
    ASSERT_TRUE(export_surface(*result->model.head, folder / "out.ply"));
    const auto read = import_mesh(folder / "out.ply");
    ASSERT_TRUE(read);
    EXPECT_EQ(read->positions == to_mesh(*result->model.head).positions, is_far);
  }
}

TEST(ToSlabsText, ReadsBackBitForBit) {
  const auto result = convert(testing::sheet(10, 0.05), few(20, 7));
  ASSERT_TRUE(result);
  const SlabMesh& mesh = result->model.head->slab_mesh();
  std::istringstream text(to_slabs_text(mesh));
  std::string word;
  std::size_t count = 0;
  int version = 0;
  text >> word >> version;
  EXPECT_EQ(word, "relief-slabs");
  EXPECT_EQ(version, 1);
  text >> word >> count;
  EXPECT_EQ(word, "fibres");
  ASSERT_EQ(count, mesh.fibres().size());
  for (const Fibre& f : mesh.fibres()) {
    Fibre g;
    text >> g.inner.x >> g.inner.y >> g.inner.z >> g.outer.x >> g.outer.y >> g.outer.z;
    EXPECT_EQ(f.inner, g.inner);
    EXPECT_EQ(f.outer, g.outer);
  }
  text >> word >> count;
  EXPECT_EQ(word, "slabs");
  ASSERT_EQ(count, mesh.slabs().size());
  for (const Slab& s : mesh.slabs()) {
    for (const FibreId f : s.fibres) {
      FibreId g = 0;
      text >> g;
      EXPECT_EQ(f, g);
    }
    for (const SlabId a : s.neighbours) {
      std::int64_t b = 0;
      text >> b;
      EXPECT_EQ(b, a == kNoSlab ? -1 : std::int64_t{a});
    }
    int n = 0;
    text >> n;
    EXPECT_EQ(n, 7);
  }
  EXPECT_TRUE(text.good());
  EXPECT_FALSE(text >> word) << "nothing follows";
}

TEST(ConvertScan, BunnyAt150Slabs) {
  RELIEF_DATA_FILE(file, "a_models/bunny.ply");
  const auto mesh = import_mesh(file);
  ASSERT_TRUE(mesh);
  const ConvertSettings settings = few(150, 15);
  const auto result = convert(*mesh, settings);
  expect_sound(result, settings);
  EXPECT_LE(result->report.slabs, 150U);
  EXPECT_GE(single_share(result->report), 0.97);
}

/// What the table of conversions must show (docs/evidence/conversion.md): slabs, and the greatest rms there and back,
/// shares of the diagonal.
struct Must {
  const char* file;
  int slabs;
  double rms;
  bool closed;  ///< and clean: nothing has to move
};
class ConvertTable : public ::testing::TestWithParam<Must> {};

TEST_P(ConvertTable, SlabsCertificateSingleFibresAndDistance) {
  const Must& must = GetParam();
  RELIEF_DATA_FILE(file, must.file);
  const auto mesh = import_mesh(file);
  ASSERT_TRUE(mesh);
  ConvertSettings settings;
  settings.slabs = must.slabs;
  settings.intervals = 63;
  const auto result = convert(*mesh, settings);
  ASSERT_TRUE(result) << result.error().message;
  const ConvertReport& report = result->report;
  EXPECT_EQ(result->model.info.mode, Mode::Certified) << report.not_certified;
  EXPECT_LE(report.slabs, static_cast<std::size_t>(must.slabs));
  EXPECT_GE(report.fibres_cast, 1'000'000U);
  EXPECT_EQ(report.hits_single, report.fibres_cast);
  EXPECT_LE(report.to_mended.rms, must.rms);
  EXPECT_LE(report.from_mended.rms, must.rms);
  const auto places = [](const TriangleMesh& of) {
    std::vector<std::array<double, 3>> all;
    for (const Vec3d p : of.positions) all.push_back({p.x, p.y, p.z});
    return all;
  };
  const PlainCage cage(result->model.head->slab_mesh());
  const auto judge = [&](const TriangleMesh& source) {
    const auto rows = places(source);
    const verify::Certificate c = verify::check({cage.inner, cage.outer, cage.triangles}, {rows, source.triangles});
    EXPECT_TRUE(c.all()) << (c.failures.empty() ? "" : c.failures.front().what);
  };
  judge(result->mended);
  if (!must.closed) return;
  EXPECT_EQ(report.moved_vertices, 0U);
  judge(*mesh);
}
INSTANTIATE_TEST_SUITE_P(Scans, ConvertTable,
                         ::testing::Values(Must{"a_models/bunny.ply", 150, 1.2e-4, false},
                                           Must{"a_models/igea.ply", 200, 3e-5, true},
                                           Must{"a_models/nefertiti.ply", 400, 5e-5, false}),
                         [](const auto& one) { return std::filesystem::path(one.param.file).stem().string(); });

}  // namespace
}  // namespace relief
