// Certified mode: what it promises is counted here by brute force, on every triangle of the source.
#include "shapes.h"
#include "support/blocks.h"

#include <relief/base/triangle.h>
#include <relief/convert/blunt.h>
#include <relief/convert/certified.h>
#include <relief/convert/convert.h>
#include <relief/convert/directions.h>
#include <relief/convert/fans.h>
#include <relief/convert/fill.h>
#include <relief/convert/mend.h>
#include <relief/convert/ordered_source.h>
#include <relief/convert/section.h>
#include <relief/convert/thin_shell.h>
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

ConvertSettings certified(int slabs, int n = 8) {
  ConvertSettings settings;
  settings.slabs = slabs;
  settings.intervals = n;
  settings.mode = Mode::Certified;
  return settings;
}

/// How often the segment from a to b passes through the mesh: outwards, and inwards.
std::pair<int, int> passages(const TriangleMesh& mesh, Vec3d a, Vec3d b) {
  int out = 0, in = 0;
  const Vec3d along = b - a;
  for (const Triangle& t : mesh.triangles) {
    const Vec3d p = mesh.positions[t[0]] - a, q = mesh.positions[t[1]] - a, r = mesh.positions[t[2]] - a;
    const double u = dot(along, cross(p, q)), v = dot(along, cross(q, r)), w = dot(along, cross(r, p));
    const bool front = u > 0 && v > 0 && w > 0, back = u < 0 && v < 0 && w < 0;
    if (!front && !back) continue;
    const Vec3d n = cross(q - p, r - p);
    const double at = dot(n, p) / dot(n, along);
    if (at <= 0 || at >= 1) continue;
    out += dot(n, along) > 0;
    in += dot(n, along) < 0;
  }
  return {out, in};
}

/// Everything that certified mode claims, tested by counting on fibres at random places.
void expect_certified(const Result<Conversion>& result, int most_slabs, std::size_t fibres_per_slab = 20) {
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(result->model.info.mode, Mode::Certified);
  const ConvertReport& report = result->report;
  EXPECT_LE(report.slabs, static_cast<std::size_t>(most_slabs));
  EXPECT_EQ(report.hits_single, report.fibres_cast);
  EXPECT_EQ(report.hits_none + report.hits_several, 0U);
  EXPECT_TRUE(report.not_certified.empty()) << report.not_certified;
  const Snapshot& model = *result->model.head;
  EXPECT_TRUE(validate(model));
  const SlabMesh& mesh = model.slab_mesh();
  const verify::Certificate shell = certificate(mesh);
  EXPECT_TRUE(shell.all()) << (shell.failures.empty() ? "" : shell.failures.front().what);
  EXPECT_TRUE(shell.on_lattice);
  const double longest = 0.1 * result->model.info.source_diagonal;
  for (const Fibre& f : mesh.fibres()) EXPECT_LE(length(f.direction()), longest * (1 + 1e-9));
  std::mt19937 random(7);
  std::uniform_real_distribution<double> share(0, 1);
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    const SlabCorners corners = mesh.corners(s);
    for (std::size_t k = 0; k < fibres_per_slab; ++k) {
      double u = share(random), v = share(random);
      if (u + v > 1) u = 1 - u, v = 1 - v;
      const auto [out, in] =
          passages(result->mended, corners.point({1 - u - v, u, v}, 0), corners.point({1 - u - v, u, v}, 1));
      ASSERT_EQ(out, 1) << "slab " << s << " at " << u << ", " << v;
      ASSERT_EQ(in, 0) << "slab " << s << " at " << u << ", " << v;
    }
  }
}

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

TEST(Certified, OneSpikeIsMendedAloneAndReported) {
  TriangleMesh ball = testing::ball(24);
  // Pulled through its neighbours, the vertex has faces that no direction sees.
  const std::size_t spike = 500;
  const Vec3d aside = normalized(cross(ball.positions[spike], Vec3d{0, 0, 1}));
  ball.positions[spike] = ball.positions[spike] * 0.999 + aside * 0.22;
  const auto result = convert(ball, certified(60));
  expect_certified(result, 60);
  EXPECT_GT(result->report.moved_vertices, 0U);
  EXPECT_LE(result->report.moved_vertices, 4U);
  EXPECT_LT(result->report.moved_most, 0.01);
  EXPECT_EQ(result->report.replaced_triangles, 0U);
}

TEST(Certified, ManyPlacesAreMendedTheSameOnAnyNumberOfThreads) {
  // Vertices that have changed places lie across their neighbours' faces.
  TriangleMesh mesh = testing::ball(120, 0.05);
  append(mesh, testing::ball(10), {4, 0, 0});
  for (const std::size_t v : {3000U, 9000U, 9020U, 15000U, 21000U}) std::swap(mesh.positions[v], mesh.positions[v + 7]);
  std::array<std::uint64_t, 2> hashes{};
  for (const std::size_t run : {0U, 1U}) {
    const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, run + 1);
    const auto result = convert(mesh, certified(150));
    ASSERT_TRUE(result) << result.error().message;
    if (run == 0) expect_certified(result, 150, 4);
    const ConvertReport& report = result->report;
    EXPECT_GT(report.replaced_triangles, 20U);
    EXPECT_LT(report.replaced_triangles, 1500U);
    EXPECT_EQ(report.vanished_parts, 0U);
    EXPECT_EQ(report.parts.count, 2U);
    EXPECT_EQ(report.parts.certified, 2U);
    EXPECT_EQ(report.closed_openings, 0U);
    hashes[run] = result->model.head->content_hash();
  }
  EXPECT_EQ(hashes[0], hashes[1]);
}

TEST(Certified, ObstaclesNameTheirParts) {
  // A sound ball, and two balls that cross each other along a circle.
  TriangleMesh mesh = testing::ball(16, 0.1);
  append(mesh, testing::ball(60), {4, 0, 0});
  append(mesh, testing::ball(60), {5, 0.1, 0});
  ConvertSettings settings = certified(60);
  settings.mode.reset();
  const auto result = convert(mesh, settings);
  ASSERT_TRUE(result) << result.error().message;
  ASSERT_EQ(result->model.info.mode, Mode::Preview);
  const ConvertReport::Parts& parts = result->report.parts;
  EXPECT_EQ(parts.count, 3U);
  EXPECT_EQ(parts.certified, 0U);
  ASSERT_FALSE(parts.obstacles.empty());
  for (const auto& obstacle : parts.obstacles) {
    EXPECT_NE(obstacle.part, 0U);
    EXPECT_LT(obstacle.part, 3U);
    EXPECT_GT(obstacle.near.x, 3.0);
    EXPECT_GT(obstacle.triangles, 5000U);
    EXPECT_NE(obstacle.reason.find("triangles"), std::string::npos) << obstacle.reason;
  }
}

TEST(Certified, SpecksFinerThanTheLatticeAreLeftOutAndNamed) {
  TriangleMesh mesh;
  std::size_t per_speck = 0;
  constexpr std::size_t kSpecks = 7;
  for (std::size_t k = 0; k < kSpecks; ++k) {
    append(mesh, testing::ball(16), {double(k) / 4, 3, 0}, 1e-6);
    per_speck = mesh.triangles.size() / (k + 1);
  }
  append(mesh, testing::ball(16, 0.1));
  append(mesh, testing::ball(8), {-2, 0, 0}, 1e-4);  // small, but sound
  const auto result = convert(mesh, certified(60));
  expect_certified(result, 200);
  const ConvertReport& report = result->report;
  EXPECT_EQ(report.specks, kSpecks);
  EXPECT_EQ(report.parts.count, 2U);
  EXPECT_EQ(report.parts.certified, 2U);
  EXPECT_EQ(report.replaced_triangles, 0U);
  EXPECT_EQ(report.vanished_parts, 0U);
  ASSERT_EQ(report.notes.size(), 6U);
  for (std::size_t k = 0; k < 5; ++k) {
    EXPECT_NE(report.notes[k].find("a part of " + std::to_string(per_speck) + " triangles"), std::string::npos);
    EXPECT_NE(report.notes[k].find(", 3, "), std::string::npos) << report.notes[k];
  }
  EXPECT_EQ(report.notes[5], "2 more such parts were left out");

  // Where the others fail as well, all stay, and all that fail are named by their places in the source.
  append(mesh, testing::ball(60), {6, 0, 0});
  append(mesh, testing::ball(60), {7, 0.1, 0});
  ConvertSettings settings = certified(100);
  settings.mode.reset();
  const auto preview = convert(mesh, settings);
  ASSERT_TRUE(preview) << preview.error().message;
  EXPECT_EQ(preview->model.info.mode, Mode::Preview);
  EXPECT_EQ(preview->report.specks, 0U);
  EXPECT_TRUE(preview->report.notes.empty());
  EXPECT_EQ(preview->report.parts.count, kSpecks + 4);
  std::vector<std::size_t> named;
  for (const auto& obstacle : preview->report.parts.obstacles) {
    named.push_back(obstacle.part);
    EXPECT_EQ(obstacle.near.y > 2.9, obstacle.part < kSpecks) << obstacle.part;
    EXPECT_EQ(obstacle.near.x > 4.9, obstacle.part > kSpecks + 1) << obstacle.part;
  }
  std::ranges::sort(named);
  EXPECT_EQ(named, (std::vector<std::size_t>{0, 1, 2, 3, 4, 5, 6, 9, 10}));
  EXPECT_NE(to_string(preview->report).find("part 10 of 11"), std::string::npos);
}

/// Without the faces that have a corner for which `hole` holds.
TriangleMesh pierced(TriangleMesh mesh, const std::function<bool(Vec3d)>& hole) {
  std::erase_if(mesh.triangles, [&](const Triangle& t) {
    return hole(mesh.positions[t[0]]) || hole(mesh.positions[t[1]]) || hole(mesh.positions[t[2]]);
  });
  return mesh;
}

TEST(Certified, HolesAreClosedWithPhantoms) {
  const auto holes = [](Vec3d p) { return p.z > 0.9 || p.x < -0.8; };
  const auto result = convert(pierced(testing::ball(40, 0.05), holes), certified(80));
  expect_certified(result, 80);
  const ConvertReport& report = result->report;
  EXPECT_EQ(report.closed_openings, 2U);
  EXPECT_GT(report.phantom_triangles, 0U);
  EXPECT_EQ(report.replaced_triangles, 0U);
  const TriangleMesh& mended = result->mended;
  ASSERT_EQ(mended.phantom_from.value() + report.phantom_triangles, mended.triangles.size());
  EXPECT_EQ(*mended.phantom_from, report.source_triangles);
  for (std::size_t t = *mended.phantom_from; t < mended.triangles.size(); ++t) {
    const Vec3d centre = (mended.positions[mended.triangles[t][0]] + mended.positions[mended.triangles[t][1]] +
                          mended.positions[mended.triangles[t][2]]) /
                         3.0;
    EXPECT_TRUE(centre.z > 0.6 || centre.x < -0.5);
  }
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

std::vector<std::array<double, 3>> places(const TriangleMesh& mesh) {
  std::vector<std::array<double, 3>> all;
  for (const Vec3d p : mesh.positions) all.push_back({p.x, p.y, p.z});
  return all;
}

/// What the verifier says of the source as it was read, before its points were rounded to the lattice.
void expect_holds_as_read(const Conversion& made, const TriangleMesh& source) {
  const PlainCage cage(made.model.head->slab_mesh());
  const auto positions = places(source);
  const verify::Certificate c = verify::check({cage.inner, cage.outer, cage.triangles}, {positions, source.triangles});
  EXPECT_TRUE(c.all()) << c.failures.front().what;
}

TEST(Mender, NothingStaysOfPatchesAlone) {
  // A tube with membranes over its ends: what is cut out at one rim leaves its membrane without a neighbour.
  using namespace detail;
  constexpr int kAround = 60, kRows = 20;
  const TriangleMesh tube = testing::bent_grid(kAround, kRows, true, false, [](double u, double v) {
    const double a = 2 * std::numbers::pi * u;
    return Vec3d{std::cos(a), std::sin(a), 2 * v} * 1e5 + Vec3d{2e5, 2e5, 2e5};
  });
  ClosedSource closed;
  std::vector<Vec3d> points = tube.positions;
  closed.faces = tube.triangles;
  const auto rims = find_rims(points.size(), closed.faces);
  close_rims(points, closed.faces, rims, std::vector<Closing>(rims.size(), Closing::Membrane));
  for (const Vec3d p : points) closed.points.push_back(snap(p));
  closed.phantom.assign(tube.triangles.size(), 0);
  closed.phantom.resize(closed.faces.size(), 1);
  closed.patch = closed.phantom;

  Mender mender(closed, closed.points, 100, Mender::Needles::None);
  const OrderedSource& source = mender.source();
  std::vector<std::uint32_t> bad;
  for (std::uint32_t f = 0; f < source.faces.size(); ++f)
    if (source.face_of[f] < 2 * kAround) bad.push_back(f);
  const auto loss = mender.cut_and_close(bad, 1);
  ASSERT_TRUE(loss);
  EXPECT_EQ(loss->faces, 4U * kAround);
  EXPECT_EQ(loss->parts, 0U);
  std::vector<Face> faces;
  std::vector<std::uint8_t> scanned;
  for (std::uint32_t f = 0; f < source.faces.size(); ++f) {
    if (!source.alive(f)) continue;
    faces.push_back(source.faces[f]);
    scanned.push_back(mender.is_scanned(f));
  }
  const Parts parts = find_parts(source.points.size(), faces);
  EXPECT_EQ(parts.count, 1U);
  EXPECT_EQ(std::ranges::count(scanned, 1), 2 * kAround * (kRows - 2));
}

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
  EXPECT_LT(c.worst, 5e-6) << "the rounding of alpha to a float, in a fibre some 70 long";
}

TEST(Certified, TerrainAndBowlsStayOpenBehindABox) {
  for (const double height : {0.1, 0.2}) {
    const auto result = convert(testing::sheet(40, height), certified(100));
    expect_certified(result, 100);
    EXPECT_EQ(result->report.closed_openings, 1U);
    EXPECT_EQ(result->report.replaced_triangles, 0U);
  }
}

/// A bowl with a wall as thick as a fifth of its radius and a hole through its bottom, open between its two brims: the
/// outer one lies level, the inner one rises on one side and hangs down on the other.
TriangleMesh bowl_open_at_its_brims() {
  constexpr double kInside = 0.8, kHole = 0.2, kBrim = 0.3, kSlant = 0.5;
  const double inner = std::acos(kHole / kInside), outer = std::acos(kHole);
  const double through = kInside * std::sin(inner) - std::sin(outer);
  // Down the inside, through the hole, up the outside: r and z, in the ratio of their lengths.
  return testing::bent_grid(48, 60, true, false, [&](double u, double v) {
    const double a = 2 * std::numbers::pi * u;
    double at = v * (kBrim + kInside * inner - through + outer), r = kHole, z = 0;
    if (at <= kBrim) {
      r = kInside;
      z = (kBrim - at) * (1 + kSlant / kBrim * std::cos(a));
    } else if ((at -= kBrim) <= kInside * inner) {
      r = kInside * std::cos(at / kInside);
      z = -kInside * std::sin(at / kInside);
    } else if ((at -= kInside * inner) <= -through) {
      z = -kInside * std::sin(inner) - at;
    } else {
      r = std::cos(outer - (at + through));
      z = -std::sin(outer - (at + through));
    }
    return Vec3d{r * std::cos(a), r * std::sin(a), z};
  });
}

TEST(Certified, OnlyRimsThatABoxHelpsGetOne) {
  // The membranes of both brims cross each other. A box over the outer brim holds the inner one's membrane; a box on
  // the inner brim would run down through the bowl.
  const auto result = convert(bowl_open_at_its_brims(), certified(200));
  expect_certified(result, 250);
  EXPECT_EQ(result->report.closed_openings, 2U);
  EXPECT_LT(result->report.replaced_triangles, result->report.source_triangles / 50);
}

/// A slanting sheet close above a level one: the boxes of both would run through each other.
TriangleMesh two_sheets(double gap) {
  TriangleMesh mesh = testing::sheet(30);
  append(mesh,
         testing::bent_grid(30, 30, false, false, [&](double u, double v) { return Vec3d{u, v, gap + 0.2 * u}; }));
  return mesh;
}

TEST(Certified, SheetsWithoutRoomForABoxGetABack) {
  for (const double gap : {0.05, 0.01, 0.002}) {
    const TriangleMesh mesh = two_sheets(gap);
    const auto result = convert(mesh, certified(200));
    expect_certified(result, gap < 0.01 ? 1500 : 300);  // a thin plate stays fine
    const ConvertReport& report = result->report;
    EXPECT_EQ(report.parts.certified, 2U);
    EXPECT_EQ(report.closed_openings, 2U);
    EXPECT_EQ(report.replaced_triangles, 0U);
    EXPECT_EQ(report.moved_vertices, 0U);
    EXPECT_GT(report.phantom_triangles, 0U);
  }
}

TEST(Certified, WhatClosesOpeningsIsNotCalledTheSource) {
  // So near that neither a box nor a back has room.
  ConvertSettings settings = certified(100);
  settings.mode.reset();
  const auto result = convert(two_sheets(1e-5), settings);
  ASSERT_TRUE(result) << result.error().message;
  ASSERT_EQ(result->model.info.mode, Mode::Preview);
  EXPECT_TRUE(result->report.not_certified.starts_with("what closes openings meets itself or the source"))
      << result->report.not_certified;
}

TEST(CountMeetings, PairsWithPatchesThatShareNoCorner) {
  using detail::LatticePoint;
  // A triangle, one across it, one beside that across both, and one at a corner of the first.
  detail::ClosedSource source;
  source.points = {{0, 0, 0},      {900, 0, 0},     {0, 900, 0},   {100, 100, -500}, {120, 100, 500}, {100, 140, 500},
                   {90, 90, -200}, {90, 110, -200}, {130, 120, 9}, {0, 0, 700},      {500, 0, 700}};
  source.faces = {{0, 1, 2}, {3, 4, 5}, {6, 7, 8}, {0, 9, 10}};
  source.phantom.assign(4, 0);
  const auto count = [&](std::vector<std::uint8_t> patch) {
    source.patch = std::move(patch);
    return detail::count_meetings(source, {});
  };
  EXPECT_EQ(count({0, 0, 0, 0}), 0U);
  EXPECT_EQ(count({1, 0, 0, 0}), 2U);
  EXPECT_EQ(count({0, 0, 1, 0}), 2U);
  EXPECT_EQ(count({0, 0, 0, 1}), 0U);
  EXPECT_EQ(count({1, 1, 1, 1}), 3U);
}

TEST(Certified, VerticesThatAreSeenOnlyJustStayWhereTheyAre) {
  // Open: a lone obtuse triangle, whose corners are as sharp as 3 degrees. Closed: a wedge of 5 degrees.
  const TriangleMesh triangle = {{{0, 0, 0}, {10, 0, 0}, {1, 0.5, 0}}, {{0, 1, 2}}, {}};
  TriangleMesh wedge = testing::box({1, 0.0875, 1});
  for (Vec3d& p : wedge.positions) p.y *= 1 - p.x;
  wedge.triangles = {{0, 2, 1}, {4, 5, 6}, {0, 1, 5}, {0, 5, 4}, {0, 4, 6}, {0, 6, 2}, {2, 6, 5}, {2, 5, 1}};
  for (const TriangleMesh& mesh : {triangle, wedge}) {
    const auto result = convert(mesh, certified(40));
    expect_certified(result, 40);
    EXPECT_EQ(result->report.moved_vertices, 0U);
    EXPECT_EQ(result->report.replaced_triangles, 0U);
  }
}

/// A disc of n triangles, or where it is high a cone, on another one or on a flat disc.
TriangleMesh fans(std::uint32_t n, double top, double bottom, const std::function<double(std::uint32_t)>& width) {
  TriangleMesh mesh;
  mesh.positions = {{0, 0, top}, {0, 0, bottom}};
  for (std::uint32_t k = 0; k < n; ++k) {
    const double a = 2 * std::numbers::pi * k / n, r = width(k);
    mesh.positions.push_back({r * std::cos(a), r * std::sin(a), 0});
  }
  for (std::uint32_t k = 0; k < n; ++k) {
    const std::uint32_t a = 2 + k, b = 2 + (k + 1) % n;
    mesh.triangles.push_back({0, a, b});
    mesh.triangles.push_back({1, b, a});
  }
  return mesh;
}

TEST(Certified, LargeFansAreDivided) {
  const auto even = [](std::uint32_t) { return 1.0; };
  for (const TriangleMesh& mesh : {fans(1001, 0.7, 0, even), fans(600, 0.3, -0.3, [](std::uint32_t k) {
                                     return 1 + 0.1 * std::sin(std::numbers::pi * k / 60);
                                   })}) {
    const auto result = convert(mesh, certified(100));
    expect_certified(result, 100);
    // Each given point is where it was, and what came lies on the given surface, but for the rounding of the lattice.
    EXPECT_EQ(result->report.moved_vertices, 0U);
    EXPECT_GT(result->mended.positions.size(), mesh.positions.size());
    const double step = 4e-7;  // not below the lattice's for a model of this size
    for (std::size_t v = 0; v < mesh.positions.size(); ++v)
      ASSERT_LE(length(result->mended.positions[v] - mesh.positions[v]), step);
    std::vector<std::size_t> around(result->mended.positions.size(), 0);
    for (const Triangle& t : result->mended.triangles)
      for (const std::uint32_t v : t) ++around[v];
    EXPECT_LE(*std::max_element(around.begin(), around.end()), 256U);
    EXPECT_LT(result->report.to_source.max, result->report.to_mended.max + step);
  }
}

TEST(DivideFans, OnlyWhereTheSurfaceStays) {
  const auto closed = [](const TriangleMesh& mesh) {
    detail::ClosedSource source;
    for (const Vec3d p : mesh.positions) source.points.push_back(detail::snap((p + Vec3d{2, 2, 2}) * 0x1p22));
    source.faces = mesh.triangles;
    source.patch.assign(source.faces.size(), 0);
    source.phantom = source.patch;
    return source;
  };
  const auto signed_volume = [](const detail::ClosedSource& s) {
    double sum = 0;
    const auto at = [&](std::uint32_t v) { return detail::to_double(s.points[v]); };
    for (const detail::Face& f : s.faces) sum += dot(at(f[0]), cross(at(f[1]), at(f[2]))) / 6;
    return sum * 0x1p-66;
  };
  // Teeth, so that the rim is not convex; then so rough that no ring fits the lattice, and small.
  const auto teeth = [](std::uint32_t k) { return k % 2 == 0 ? 1.0 : 0.6; };
  const detail::ClosedSource before = closed(fans(3000, 0, -0.4, teeth));
  detail::ClosedSource after = before;
  EXPECT_GE(detail::divide_fans(after), 1U);
  EXPECT_NEAR(signed_volume(after), signed_volume(before), 1e-6);
  EXPECT_EQ(after.patch.size(), after.faces.size());
  EXPECT_EQ(after.phantom.size(), after.faces.size());
  const std::vector<std::uint32_t> twins = detail::find_twins(after.faces, after.points.size());
  EXPECT_EQ(std::count(twins.begin(), twins.end(), detail::kNone), 0);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> height(-0.1, 0.1);
  TriangleMesh crumpled = fans(1000, 1, -1, [](std::uint32_t) { return 1.0; });
  for (std::size_t v = 2; v < crumpled.positions.size(); ++v) crumpled.positions[v].z = height(random);
  detail::ClosedSource rough = closed(crumpled), small = closed(fans(200, 1, 0, teeth));
  EXPECT_EQ(detail::divide_fans(rough), 0U);
  EXPECT_EQ(rough.faces.size(), crumpled.triangles.size());
  EXPECT_EQ(detail::divide_fans(small), 0U);
}

TEST(Certified, NeedlesAndKnifeEdgesThatADirectionSeesStay) {
  const auto even = [](std::uint32_t) { return 1.0; };
  // A cone with a half angle of a fifth of a degree, a lens with a rim of a twentieth, a ball with one point far out.
  TriangleMesh spiked = testing::ball(40);
  const std::size_t tip = 1500;
  spiked.positions[tip] = spiked.positions[tip] * 8.0;
  for (const TriangleMesh& mesh : {fans(24, 300, 0, even), fans(60, 5e-4, -5e-4, even), spiked}) {
    const auto result = convert(mesh, certified(120));
    expect_certified(result, 120);
    EXPECT_EQ(result->report.moved_vertices, 0U);
    EXPECT_EQ(result->report.replaced_triangles, 0U);
    EXPECT_LT(result->report.from_source.max, 0.02);
    expect_holds_as_read(*result, mesh);
  }
  // Elsewhere something has to be mended: the spike stays for all that.
  const std::size_t pulled = 400;
  const Vec3d aside = normalized(cross(spiked.positions[pulled], Vec3d{0, 0, 1}));
  spiked.positions[pulled] = spiked.positions[pulled] * 0.999 + aside * 0.22;
  const auto result = convert(spiked, certified(120));
  expect_certified(result, 120);
  double farthest = 0;
  for (const Vec3d p : result->mended.positions) farthest = std::max(farthest, length(p));
  EXPECT_GT(farthest, 7.9);
}

TEST(Certified, WhatIsSaidOfACutIsTrue) {
  // Two points change places, far apart from each other: two crossings, each cut out for itself.
  TriangleMesh mesh = testing::ball(60, 0.02);
  std::swap(mesh.positions[2000], mesh.positions[2004]);
  ConvertSettings settings = certified(200);
  const auto result = convert(mesh, settings);
  ASSERT_TRUE(result) << result.error().message;
  const ConvertReport& report = result->report;
  if (report.replaced_triangles == 0) GTEST_SKIP() << "nothing had to be cut out";
  const Vec3d at = mesh.positions[2002];
  EXPECT_LT(length(report.replaced_near - at), 0.5);
  EXPECT_GT(report.replaced_widest, 0.01);
  EXPECT_LT(report.replaced_widest, 0.3);
  EXPECT_NE(to_string(report).find("cut out and closed with patches"), std::string::npos);
}

TEST(Certified, PartsThatTouchAreMovedApart) {
  // Two cubes that share an edge, as one surface whose edge has four faces.
  TriangleMesh both = testing::box({1, 1, 1});
  append(both, testing::box({1, 1, 1}), {1, 1, 0});
  const auto result = convert(both, certified(100));
  expect_certified(result, 100);
  EXPECT_GT(result->report.parted_vertices, 0U);
  EXPECT_GT(result->report.moved_most, 0);
  EXPECT_LE(result->report.moved_most, 2.1e-3);
}

TEST(Certified, BlocksThatShareFacesAreMovedApart) {
  // In any case shared edges and corners, too; every solid stays, no more than the reported distance from where it was.
  std::mt19937 random(3);
  std::size_t shared = 0;
  for (int round = 0; round < 12; ++round) {
    const auto place = [&](Vec3d p) {
      return round % 2 == 0 ? p : Vec3d{0.6 * p.x - 0.8 * p.y, 0.8 * p.x + 0.6 * p.y, 0.3 * p.x + p.z};
    };
    const auto blocks = testing::random_blocks(2 + round % 3, testing::kEachItsOwn, random, place);
    if (blocks.cubes == 0) continue;
    const auto result = convert(blocks.mesh, certified(400));
    expect_certified(result, 3000, 5);
    const ConvertReport& report = result->report;
    EXPECT_EQ(report.parts.certified, report.parts.count);
    EXPECT_EQ(report.replaced_triangles, 0U);
    EXPECT_EQ(report.parted_vertices > 0, report.repair.split_vertices > 0) << "round " << round;
    EXPECT_LE(report.from_mended.max, 1e-3);
    EXPECT_LE(report.from_source.max, report.moved_most + 1e-3);
    shared += blocks.shared_faces;
  }
  EXPECT_GT(shared, 60U);
}

TEST(Certified, VoxelSolidsAreBluntedWhereNoDirectionSeesThem) {
  // Solids of several cubes have corners whose faces look every way; where two cubes of one solid touch along an edge
  // or in a corner, its sheets lie on each other there.
  std::mt19937 random(5);
  std::size_t blunted = 0;
  for (int round = 0; round < 12; ++round) {
    const auto place = [&](Vec3d p) {
      return round % 2 == 0 ? p : Vec3d{0.6 * p.x - 0.8 * p.y, 0.8 * p.x + 0.6 * p.y, 0.3 * p.x + p.z};
    };
    const auto blocks = testing::random_blocks(3 + round % 3, 1, random, place);
    SCOPED_TRACE(round);
    const auto result = convert(blocks.mesh, certified(400));
    ASSERT_NO_FATAL_FAILURE(expect_certified(result, 3000, 5));
    const ConvertReport& report = result->report;
    EXPECT_EQ(report.parts.certified, report.parts.count);
    EXPECT_EQ(report.replaced_triangles, 0U);
    // What was cut off or moved lies as near to the mended source as the report says.
    double farthest = 0;
    for (const Vec3d p : blocks.mesh.positions) {
      double least = 1e9;
      for (const Triangle& t : result->mended.triangles) {
        const Vec3d a = result->mended.positions[t[0]], b = result->mended.positions[t[1]],
                    c = result->mended.positions[t[2]];
        const auto w = nearest_in_triangle(p, a, b, c);
        least = std::min(least, length(a * w[0] + b * w[1] + c * w[2] - p));
      }
      if (std::ranges::any_of(blocks.mesh.triangles, [&](const Triangle& t) {
            return std::ranges::any_of(t, [&](std::uint32_t v) { return blocks.mesh.positions[v] == p; });
          }))
        farthest = std::max(farthest, least);
    }
    EXPECT_LE(farthest, (2e-3 + report.moved_most) * result->model.info.source_diagonal);
    blunted += to_string(report).find("had faces that no direction sees") != std::string::npos;
  }
  EXPECT_GT(blunted, 6U);
}

TEST(CutTips, LeaveAClosedSurfaceThatIsSeenEverywhere) {
  // Six of eight cubes around a point: two notches meet in it and along an edge, which the source then has twice.
  constexpr std::int32_t kUnit = 1 << 20;
  std::mt19937 random(1);
  std::size_t cut = 0;
  for (int round = 0; round < 200; ++round) {
    const auto place = [&](Vec3d p) { return round % 2 == 0 ? p : Vec3d{p.x, p.y + 0.4 * p.x, p.z - 0.3 * p.y}; };
    const auto blocks = testing::random_blocks(2, 1, random, place);
    if (blocks.cubes == 0) continue;
    const auto repaired = repair(blocks.mesh);
    ASSERT_TRUE(repaired);
    detail::ClosedSource source;
    for (const Vec3d p : repaired->mesh.positions) source.points.push_back(detail::snap((p + Vec3d{1, 1, 1}) * kUnit));
    source.faces = repaired->mesh.triangles;
    source.patch.assign(source.faces.size(), 0);
    source.phantom.assign(source.faces.size(), 0);
    const auto visibilities = [&] {
      std::vector<std::vector<Vec3d>> normals(source.points.size());
      for (const Triangle& f : source.faces) {
        const Vec3d a = detail::to_double(source.points[f[0]]);
        const Vec3d n =
            normalized(cross(detail::to_double(source.points[f[1]]) - a, detail::to_double(source.points[f[2]]) - a));
        for (const std::uint32_t v : f) normals[v].push_back(n);
      }
      std::vector<double> seen;
      for (const auto& of : normals) seen.push_back(of.empty() ? 1 : detail::best_direction(of).visibility);
      return seen;
    };
    std::vector<std::uint32_t> tips;
    const std::vector<double> before = visibilities();
    for (std::uint32_t v = 0; v < before.size(); ++v)
      if (before[v] < 0.02) tips.push_back(v);
    const std::size_t given = source.faces.size();
    EXPECT_EQ(detail::cut_tips(source, tips, 0.01 * kUnit), tips.size());
    EXPECT_EQ(source.patch.size(), source.faces.size());
    EXPECT_EQ(source.phantom.size(), source.faces.size());
    EXPECT_EQ(std::ranges::count(std::span(source.patch).first(given), 1), 0);
    EXPECT_TRUE(detail::find_rims(source.points.size(), source.faces).empty());
    for (const double seen : visibilities()) EXPECT_GT(seen, 0.02) << "round " << round;
    cut += tips.size();
  }
  EXPECT_GT(cut, 40U);
}

TEST(Certified, SolidsThatShareAFaceCutInOtherTrianglesAreMovedApart) {
  // Boxes of 4 and 5, 5 and 7, 6 and 7 cells along each edge, one on top of the other: few points coincide.
  const auto add_box = [](TriangleMesh& to, int cells, double level) {
    for (int axis = 0; axis < 3; ++axis)
      for (const bool far : {false, true}) {
        const TriangleMesh side = testing::bent_grid(cells, cells, false, false, [&](double u, double v) {
          const double w = far ? 1 : 0;
          const Vec3d p = axis == 0 ? Vec3d{w, u, v} : axis == 1 ? Vec3d{v, w, u} : Vec3d{u, v, w};
          return Vec3d{p.x, p.y, p.z + level};
        });
        append(to, far ? side : testing::turned(side));
      }
  };
  for (const auto& [low, high] : {std::pair(4, 5), std::pair(5, 7), std::pair(6, 7)}) {
    TriangleMesh mesh;
    add_box(mesh, low, 0);
    add_box(mesh, high, 1);
    const auto result = convert(mesh, certified(200));
    expect_certified(result, 400);
    const ConvertReport& report = result->report;
    EXPECT_EQ(report.parts.certified, 2U);
    EXPECT_EQ(report.replaced_triangles, 0U);
    EXPECT_GT(report.moved_most, 0);
    EXPECT_LE(report.moved_most, 2.1e-3);
    EXPECT_LE(report.from_source.max, report.moved_most + report.from_mended.max + 1e-6);
  }
}

TEST(Certified, ASpikeThroughTheSurfaceIsCutOut) {
  // One vertex pushed through the far side: no smoothing within bounds can mend that.
  TriangleMesh mesh = testing::ball(80);
  mesh.positions[6000] = mesh.positions[6000] * -1.2;
  const auto result = convert(mesh, certified(100));
  ASSERT_TRUE(result) << result.error().message;
  expect_certified(result, 100);
  EXPECT_GT(result->report.replaced_triangles, 5U);
  EXPECT_LT(result->report.replaced_triangles, 200U);
  EXPECT_EQ(result->report.phantom_triangles, 0U);
  for (const Vec3d p : result->mended.positions) EXPECT_LT(length(p), 1.05);
}

/// Points whose faces no direction sees.
std::size_t count_singular(const TriangleMesh& mesh) {
  std::vector<std::vector<Vec3d>> normals(mesh.positions.size());
  for (const Triangle& t : mesh.triangles) {
    const Vec3d a = mesh.positions[t[0]];
    for (const std::uint32_t v : t)
      normals[v].push_back(normalized(cross(mesh.positions[t[1]] - a, mesh.positions[t[2]] - a)));
  }
  return static_cast<std::size_t>(
      std::ranges::count_if(normals, [](const auto& n) { return detail::best_direction(n).visibility <= 0; }));
}

/// The greatest distance between points of the same number, share of the source's diagonal, and how many moved.
std::pair<double, std::size_t> moves_between(const TriangleMesh& source, const Conversion& made) {
  double most = 0;
  std::size_t count = 0;
  EXPECT_EQ(made.mended.positions.size(), source.positions.size());
  for (std::size_t v = 0; v < source.positions.size(); ++v) {
    const double far = length(made.mended.positions[v] - source.positions[v]) / made.model.info.source_diagonal;
    most = std::max(most, far);
    count += far > 1e-7;  // more than rounding to the lattice
  }
  return {most, count};
}

TEST(Certified, FoldsAtRandomPlacesAreMendedAndMovesAreTrue) {
  std::mt19937 random(31);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::size_t singular = 0;
  for (int trial = 0; trial < 6; ++trial) {
    TriangleMesh mesh = trial % 2 == 0 ? testing::ball(40, 0.05) : testing::torus(90, 40);
    for (int fold = 0; fold < 5 + 5 * trial; ++fold) {
      // One and a half edges aside: across its neighbours.
      const Triangle& t = mesh.triangles[random() % mesh.triangles.size()];
      const Vec3d edge = mesh.positions[t[1]] - mesh.positions[t[0]];
      mesh.positions[t[0]] += edge * 1.5 + Vec3d{unit(random), unit(random), unit(random)} * (0.1 * length(edge));
    }
    singular += count_singular(mesh);
    const auto result = convert(mesh, certified(150));
    SCOPED_TRACE("trial " + std::to_string(trial));
    expect_certified(result, 1000, 4);
    const ConvertReport& report = result->report;
    EXPECT_GT(report.moved_vertices, 0U);
    EXPECT_LE(report.moved_most, 8.1e-3);
    EXPECT_LT(report.replaced_triangles, 60U * static_cast<std::size_t>(5 + 5 * trial));
    if (report.replaced_triangles > 0) continue;
    const auto [most, count] = moves_between(mesh, *result);
    EXPECT_NEAR(report.moved_most, most, 1e-6);
    EXPECT_EQ(report.moved_vertices, count);
  }
  EXPECT_GT(singular, 20U) << "these models are too easy for the test";
}

/// A round body with a slot along its equator, whose banks swell so far that they cross by `depth` in places.
TriangleMesh slotted_ball(double depth, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> turn(0, 2 * std::numbers::pi);
  const double above = turn(random), below = turn(random);
  TriangleMesh mesh = testing::bent_grid(160, 90, true, false, [&](double u, double v) {
    // Along the profile: the lower half of the ball, the lower bank inwards, the slot's floor, and back.
    const double a = 2 * std::numbers::pi * u, side = v < 0.5 ? -1 : 1, s = 1 - std::abs(2 * v - 1);  // 0 pole, 1 floor
    if (s == 0) return Vec3d{0, 0, side};
    double rho = 0, z = 0;
    if (s < 0.5) {
      const double b = 0.04 + (0.5 * std::numbers::pi - 0.04) * (1 - 2 * s);
      rho = std::cos(b), z = std::sin(b);
    } else {
      const double in = 2 * s - 1, swell = std::sin(std::numbers::pi * in);  // 0 at the rim, 1 in the floor
      rho = std::cos(0.04) - 0.4 * in;
      const double wave = 0.6 + 0.4 * std::sin(3 * a + (side > 0 ? above : below));
      z = 0.04 * (1 - swell * swell) * (1 - std::pow(in, 16)) - 0.5 * depth * wave * swell * swell;
    }
    return Vec3d{rho * std::cos(a), rho * std::sin(a), side * z};
  });
  return mesh;
}

TEST(Certified, SheetsThatCrossArePushedApart) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    const TriangleMesh mesh = slotted_ball(6e-3, seed);
    const auto result = convert(mesh, certified(200));
    SCOPED_TRACE("seed " + std::to_string(seed));
    expect_certified(result, 200, 2);  // 8 and 20 more where the banks are left as near as they first come clear
    const ConvertReport& report = result->report;
    EXPECT_GT(report.moved_vertices, 1000U);
    EXPECT_EQ(report.parted_vertices, 0U);
    EXPECT_LT(report.replaced_triangles, 50U);
    EXPECT_LE(report.moved_most, 8.1e-3);
  }
}

TEST(Certified, WhatIsInsideOutIsPushedOut) {
  // A plate whose two sides have changed places over a disc: its solid is thinner than nothing there.
  TriangleMesh plate = testing::ball(60);
  for (Vec3d& p : plate.positions) {
    const double x = p.x - 0.45;
    p.z *= 0.1 - 0.104 * std::exp(-std::pow((x * x + p.y * p.y) / 0.09, 3));
  }
  const auto result = convert(plate, certified(100));
  expect_certified(result, 200, 10);
  const ConvertReport& report = result->report;
  EXPECT_EQ(report.replaced_triangles, 0U);
  const auto [most, count] = moves_between(plate, *result);
  EXPECT_NEAR(report.moved_most, most, 1e-6);
  EXPECT_EQ(report.moved_vertices, count);
  EXPECT_GT(count, 100U);
  // There and nowhere else.
  for (std::size_t v = 0; v < plate.positions.size(); ++v) {
    const Vec3d p = plate.positions[v];
    if (std::hypot(p.x - 0.45, p.y) < 0.45) continue;
    EXPECT_LT(length(result->mended.positions[v] - p), 1e-6);
  }
}

TEST(Certified, WhatCannotBeProvedIsRefusedOrLeftToPreview) {
  TriangleMesh crossing = testing::ball(16);
  append(crossing, testing::ball(16), {0.9, 0.1, 0});
  const std::string why = "near (";
  const auto refused = convert(crossing, certified(60));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, Errc::Unfoldable);
  EXPECT_NE(refused.error().message.find(why), std::string::npos) << refused.error().message;
  EXPECT_NE(refused.error().message.find("--mode tolerant"), std::string::npos) << refused.error().message;
  ConvertSettings any = certified(60);
  any.mode.reset();
  const auto made = convert(crossing, any);
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_EQ(made->model.info.mode, Mode::Preview);
  EXPECT_NE(made->report.not_certified.find(why), std::string::npos) << made->report.not_certified;
  EXPECT_NE(to_string(made->report).find("not certified"), std::string::npos);
}

TEST(Certified, IsTheDefaultAndPreviewStays) {
  ConvertSettings settings = certified(60);
  settings.mode.reset();
  const auto made = convert(testing::ball(16, 0.1), settings);
  ASSERT_TRUE(made);
  EXPECT_EQ(made->model.info.mode, Mode::Certified);
  settings.mode = Mode::Preview;
  const auto preview = convert(testing::ball(16, 0.1), settings);
  ASSERT_TRUE(preview);
  EXPECT_EQ(preview->model.info.mode, Mode::Preview);
  EXPECT_TRUE(preview->report.not_certified.empty());
}

/// A torus with grooves whose rims overhang, so that few slabs cannot follow them.
TriangleMesh grooved_torus(int around = 150, int across = 128) {
  return testing::bent_grid(around, across, true, true, [](double u, double v) {
    const double a = 2 * std::numbers::pi * u, t = 2 * std::numbers::pi * v;
    const double b = t + 0.3 * std::sin(4 * t), r = 0.7 * (1 + 0.15 * std::sin(4 * t));
    return Vec3d{(2 + r * std::cos(b)) * std::cos(a), (2 + r * std::cos(b)) * std::sin(a), r * std::sin(b)};
  });
}

TEST(Tolerant, ReachesTheTargetAndMarksWhatFolds) {
  const TriangleMesh source = grooved_torus();
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
  EXPECT_EQ(report.hits_none, 0U);
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
  expect_certified(convert(grooved_torus(), settings), 90, 4);
  settings.mode = Mode::Tolerant;
  expect_certified(convert(grooved_torus(), settings), 90, 4);
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
  const auto result = convert(grooved_torus(60, 48), settings);
  expect_tolerant(result, 50);
  const ConvertReport& report = result->report;
  EXPECT_FALSE(report.remesh) << to_string(report);
  EXPECT_GT(report.hits_none, 0U);
  EXPECT_LT(double(report.hits_none), 0.03 * double(report.fibres_cast));
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
  EXPECT_TRUE(has_note(result->report, "these stand on a solid of it")) << to_string(result->report);
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
    EXPECT_NE(to_string(result->report).find(" slabs were asked for"), std::string::npos);
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
  EXPECT_TRUE(enough->report.notes.empty()) << to_string(enough->report);
}

TEST(Convert, SaysThatThereAreFewerTrianglesThanSlabsAskedFor) {
  for (const Mode mode : {Mode::Certified, Mode::Tolerant, Mode::Preview}) {
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
  static detail::SourceBlock block_around(const std::vector<detail::SourceTriangle>& triangles) {
    Box3d box;
    Vec3d sum;
    for (const detail::SourceTriangle& t : triangles) {
      for (const Vec3d p : {t.a, t.b, t.c}) box.add(p);
      sum += t.normal;
    }
    detail::SourceBlock block = {box.centre(), box.extent() * 0.5, normalized(sum), 1, 0};
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
  const detail::OrderedSource source(points, faces);
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
        EXPECT_EQ(s.meet(block_around({exact[k]})), detail::Meeting::Apart);
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
    const detail::Meeting whole = s.meet(block_around(triangles));
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
    std::array<detail::SourceBlock, 4> blocks;
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
  struct Made {
    std::vector<std::uint32_t> faults;
    std::vector<detail::Ends> ends;
  };
  static constexpr double kScale = 1e6;  // lattice steps
  static detail::OrderedSource source_of(const TriangleMesh& mesh) {
    std::vector<detail::LatticePoint> points;
    for (const Vec3d p : mesh.positions) points.push_back(detail::snap((p + Vec3d{4, 4, 4}) * kScale));
    return {points, mesh.triangles};
  }
  static Made made(const TriangleMesh& mesh, std::size_t most_faults) {
    const detail::OrderedSource source = source_of(mesh);
    const detail::Rings rings(source.faces, source.points.size());
    detail::ThinShell thin(source, rings, kScale, detail::ThinShell::Heights::Shrinking, {}, most_faults);
    EXPECT_TRUE(thin.update({}, {}, {}));
    std::vector<std::uint32_t> faults = thin.faults();
    return {std::move(faults), thin.take_ends()};
  }
};

// Sheets so near to each other that many slabs are faulty until they are thin: the look with the least heights leaves
// no trace.
TEST_F(ThinShells, ManyFaultsThatYieldAreNotGivenUp) {
  TriangleMesh mesh = testing::ball(24);
  append(mesh, testing::ball(24), {}, 1.002);
  const Made patient = made(mesh, detail::kNone), doubtful = made(mesh, 0);
  EXPECT_TRUE(patient.faults.empty());
  EXPECT_TRUE(doubtful.faults.empty());
  EXPECT_EQ(patient.ends, doubtful.ends);
}

TEST_F(ThinShells, FaultsThatDoNotYieldAreGivenUpEarly) {
  TriangleMesh mesh = testing::ball(24);
  append(mesh, testing::ball(24), {0.5, 0.1, 0.2});
  const Made patient = made(mesh, detail::kNone), hopeless = made(mesh, 0);
  EXPECT_GT(patient.faults.size(), 50U);
  EXPECT_TRUE(std::ranges::includes(hopeless.faults, patient.faults));
  EXPECT_LT(hopeless.faults.size(), 2 * patient.faults.size());
  EXPECT_NE(hopeless.ends, patient.ends);
  EXPECT_EQ(made(mesh, 2 * hopeless.faults.size()).ends, patient.ends) << "so many are not too many";
}

// What was given up stands once the source is mended, and as high as it would have from the start where it was faulty.
TEST_F(ThinShells, StandAgainOnAMendedSourceAfterGivingUp) {
  const TriangleMesh ball = testing::ball(24);
  TriangleMesh mesh = ball;
  append(mesh, ball, {0.5, 0.1, 0.2});
  detail::OrderedSource source = source_of(mesh);
  const detail::Rings rings(source.faces, source.points.size());
  detail::ThinShell thin(source, rings, kScale, detail::ThinShell::Heights::Shrinking, {}, 0);
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
  detail::ThinShell anew(source, rings, kScale);
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
    const detail::OrderedSource source(t, std::array<detail::Face, 1>{{{0, 1, 2}}});
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
    const auto whole = s.meet(detail::SourceBlock{box.centre(), box.extent() * 0.5, normalized(sum), cosine, 1e-3});
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
        Case{"crossing", crossing, few, Mode::Preview}, Case{"solids", parts, solids, Mode::Tolerant},
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
