// Shells with a right source inside pass; each way of getting the source wrong fails exactly what it breaks.
#include "cages.h"
#include "report.h"

#include <relief/base/triangle.h>
#include <relief/verify/verify.h>

#include <gtest/gtest.h>
#include <support/shells.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace relief::verify {

namespace {

constexpr int kBits = 20;
constexpr double kSteps = 0x1p20;

Point rounded(Vec3d p) { return verify::rounded({p.x, p.y, p.z}, kBits); }

Cage sphere_cage(int levels = 2, double inner = 0.8, double outer = 1.2, Vec3d centre = {}) {
  return snapped(*testing::sphere_shell(levels, 1, inner, outer, centre), kBits);
}
/// 8 * 4^levels triangles; radius(direction) from the centre.
Surface ball(int levels, const std::function<double(Vec3d)>& radius, Vec3d centre = {}) {
  Surface surface;
  const auto mesh = testing::sphere_shell(levels, 1, 0.5, 1);
  for (const Fibre& f : mesh->fibres()) surface.points.push_back(rounded(centre + f.outer * radius(f.outer)));
  for (const relief::Slab& s : mesh->slabs()) surface.faces.push_back(s.fibres);
  return surface;
}
Surface ball(int levels = 4, double radius = 1, Vec3d centre = {}) {
  return ball(levels, [=](Vec3d) { return radius; }, centre);
}

using Conditions = std::set<Condition>;
/// What does not hold; each must have said why.
Conditions broken(const Certificate& c) {
  Conditions conditions;
  for (std::size_t k = 0; k < kConditionCount; ++k) {
    const auto condition = static_cast<Condition>(k);
    if (!c.holds[k]) conditions.insert(condition);
    const bool listed = std::any_of(c.failures.begin(), c.failures.end(),
                                    [&](const Failure& f) { return f.condition == condition && !f.what.empty(); });
    EXPECT_EQ(listed, c.failure_count[k] > 0);
  }
  return conditions;
}
bool says(const Certificate& c, std::string_view words) {
  return std::any_of(c.failures.begin(), c.failures.end(),
                     [&](const Failure& f) { return f.what.find(words) != std::string::npos; });
}

#define EXPECT_PROVEN(certificate)                                  \
  do {                                                              \
    const Certificate& c_ = (certificate);                          \
    EXPECT_TRUE(c_.all());                                          \
    for (const Failure& f_ : c_.failures) ADD_FAILURE() << f_.what; \
  } while (false)

Vec3d turned(Vec3d p) {  // about a skew axis, so that no coordinate stays on a lattice
  const double c = std::cos(0.7), s = std::sin(0.7);
  const Vec3d q = {c * p.x - s * p.y, s * p.x + c * p.y, p.z};
  return {q.x, c * q.y - s * q.z, s * q.y + c * q.z};
}

TEST(VerifySource, PassesABallInItsShell) {
  const Certificate c = sphere_cage().check(ball());
  EXPECT_PROVEN(c);
  EXPECT_TRUE(c.with_source);
  EXPECT_EQ(c.asked(), 8U);
  EXPECT_EQ(c.source_moved, 0.0);
  EXPECT_LE(c.lattice_step, 1 / kSteps);
  EXPECT_EQ(c.source_parts, 1U);
  EXPECT_PROVEN(sphere_cage(3).check(ball(2)));
  EXPECT_PROVEN(cube_cage(0.5, 1).check(cube(0.75)));
}

TEST(VerifySource, WithoutASourceOnlyTheShellIsAskedFor) {
  const Cage cage = sphere_cage();
  const Certificate c = check(cage.view());
  EXPECT_TRUE(c.all());
  EXPECT_EQ(c.asked(), 5U);
  EXPECT_FALSE(c.holds[5] || c.holds[6] || c.holds[7]);
}

TEST(VerifySource, ASourceOffTheLatticeIsMovedByLessThanAStep) {
  const Surface source = ball(5).moved(turned);
  const Certificate c = sphere_cage().check(source);
  EXPECT_PROVEN(c);
  EXPECT_GT(c.source_moved, 0.0);
  EXPECT_LT(c.source_moved, c.lattice_step);
  EXPECT_LT(c.source_moved, 1e-8);
}

TEST(VerifySource, ScaleAndPlaceDoNotMatter) {
  for (const double scale : {0x1p-900, 0x1p20, 0x1p900}) {
    Cage cage = sphere_cage();
    for (auto* ends : {&cage.inner, &cage.outer})
      for (Point& p : *ends) p = {p[0] * scale, p[1] * scale, p[2] * scale + 64 * scale};
    const auto place = [&](Vec3d p) { return p * scale + Vec3d{0, 0, 64 * scale}; };
    EXPECT_PROVEN(cage.check(ball().moved(place)));
    EXPECT_PROVEN(cage.check(ball().moved(turned).moved(place)));
  }
}

TEST(VerifySource, EveryFibreWillDoForTheHit) {
  // Fibres that pass exactly through vertices and edges of the source among them.
  Cage cage = sphere_cage(3);
  const Surface source = ball(2);
  for (std::size_t k = 0; k < cage.faces.size(); ++k) {
    std::swap(cage.faces[0], cage.faces[k]);
    for (int turn = 0; turn < 2; ++turn) {
      std::rotate(cage.faces[0].begin(), cage.faces[0].begin() + 1, cage.faces[0].end());
      const Certificate c = cage.check(source);
      ASSERT_TRUE(c.all()) << k << ' ' << c.failures.front().what;
    }
    std::swap(cage.faces[0], cage.faces[k]);
  }
}

TEST(VerifySource, SeveralPartsEachWithTheirOwn) {
  Cage cage = sphere_cage();
  cage.add(sphere_cage(2, 0.8, 1.2, {4, 0, 0}));
  cage.add(sphere_cage(2, 0.3, 0.5));  // in the cavity of the first
  Surface source = ball();
  source.add(ball(4, 1, {4, 0, 0}));
  EXPECT_EQ(broken(reported("the source lacks what one part of the shell is for", cage.check(source))),
            (Conditions{Condition::C7}));
  source.add(ball(3, 0.4));
  const Certificate c = cage.check(source);
  EXPECT_PROVEN(c);
  EXPECT_EQ(c.source_parts, 3U);
}

TEST(VerifySource, FindsWhatPassesThroughTheShell) {
  Surface source = ball();
  source.points[100] = rounded(vec(source.points[100]) * 1.3);
  const Certificate out = reported("a source vertex sticks out of the shell", sphere_cage().check(source));
  EXPECT_EQ(broken(out), (Conditions{Condition::C5}));
  EXPECT_TRUE(says(out, "meets the outer triangle of slab")) << out.failures.front().what;
  for (const Failure& f : out.failures)
    EXPECT_EQ(std::count(source.faces[f.b].begin(), source.faces[f.b].end(), 100U), 1);
  source.points[100] = rounded(vec(source.points[100]) * 0.5);
  EXPECT_TRUE(says(reported("a source vertex dips through the inner triangles", sphere_cage().check(source)),
                   "meets the inner triangle of slab"));
}

TEST(VerifySource, KeepsTwoStepsFromTheShell) {
  const double step = 0x1p-19;  // 2^20 of them are the cage
  EXPECT_PROVEN(cube_cage(0.5, 1).check(cube(1 - 2 * step)));
  EXPECT_PROVEN(cube_cage(0.5, 1).check(cube(0.5 + 2 * step)));
  // Corners are further away than faces, so this is about distances of all kinds.
  const Certificate near = reported("the source comes within one lattice step of the outer triangles",
                                    cube_cage(0.5, 1).check(cube(1 - step)));
  EXPECT_EQ(broken(near), (Conditions{Condition::C5}));
  EXPECT_TRUE(says(near, "within two lattice steps of the outer triangle"));
  EXPECT_EQ(broken(reported("the source comes within one lattice step of the inner triangles",
                            cube_cage(0.5, 1).check(cube(0.5 + step)))),
            (Conditions{Condition::C5}));
  // Flat on flat: coplanar triangles that cover each other.
  EXPECT_TRUE(says(reported("the source lies on the outer triangles", cube_cage(0.5, 1).check(cube(1))),
                   "meets the outer triangle"));
}

TEST(VerifySource, KeepsTwoStepsFromEdgesAndCorners) {
  // A spike whose tip comes near an edge or a corner of the outer cube's inside, or beside it.
  const double step = 0x1p-19;                                           // 2^20 of them are the cage
  for (const Point tip : {Point{0.25, 0.25, 1}, Point{0.25, 0.5, 1}}) {  // on a diagonal edge, on a face
    for (const int steps : {0, 1, 2, 3}) {
      Surface source = cube(0.75);
      // The top is cut into a fan around the tip.
      std::erase_if(source.faces, [](const Face& f) { return f[0] >= 4 && f[1] >= 4 && f[2] >= 4; });
      source.points.push_back({tip[0], tip[1], 1 - steps * step});
      for (const auto& [a, b] : {std::pair(4U, 5U), std::pair(5U, 7U), std::pair(7U, 6U), std::pair(6U, 4U)})
        source.faces.push_back({a, b, 8});
      EXPECT_EQ(cube_cage(0.5, 1).check(source).holds[5], steps >= 2) << steps;
    }
  }
}

/// The source triangle that holds a direction.
std::size_t face_towards(const Surface& source, Vec3d direction) {
  std::size_t best = 0;
  double most = -2;
  for (std::size_t t = 0; t < source.faces.size(); ++t) {
    const Face& f = source.faces[t];
    const Vec3d centre = normalized(vec(source.points[f[0]]) + vec(source.points[f[1]]) + vec(source.points[f[2]]));
    if (dot(centre, direction) > most) {
      most = dot(centre, direction);
      best = t;
    }
  }
  return best;
}

TEST(VerifySource, FindsAFoldInOneCornerOfASlab) {
  const Surface right = ball();
  const std::size_t t = face_towards(right, normalized(Vec3d{-0.3, -0.8, 0.55}));
  const Face f = right.faces[t];
  Surface source = right;
  // One corner is drawn across the opposite edge and a little up: the triangle turns over.
  const Vec3d across = (vec(right.points[f[1]]) + vec(right.points[f[2]])) * 0.5;
  source.points[f[0]] = rounded(across + (across - vec(right.points[f[0]])) * 0.5 + across * 0.01);
  const Certificate c = reported("one source triangle is folded over", sphere_cage().check(source));
  EXPECT_EQ(broken(c), (Conditions{Condition::C6}));
  EXPECT_TRUE(std::any_of(c.failures.begin(), c.failures.end(), [&](const Failure& g) { return g.b == t; }));
}

/// Whether some slab whose box the triangle meets has a corner fibre that sees it from behind.
bool fails_three_corners(const Cage& cage, const Surface& source, std::size_t t) {
  const Face& f = source.faces[t];
  const Vec3d a = vec(source.points[f[0]]), n = cross(vec(source.points[f[1]]) - a, vec(source.points[f[2]]) - a);
  const Vec3d middle = (a + vec(source.points[f[1]]) + vec(source.points[f[2]])) / 3.0;
  for (const Face& s : cage.faces) {
    Box3d box;
    bool behind = false;
    for (const std::uint32_t k : s) {
      box.add(vec(cage.inner[k]));
      box.add(vec(cage.outer[k]));
      behind = behind || dot(n, vec(cage.outer[k]) - vec(cage.inner[k])) <= 0;
    }
    // The slab that holds it: on the inner side of the three planes through its fibres (these meet at the origin here).
    bool inside = true;
    for (std::size_t k = 0; k < 3; ++k)
      inside = inside && dot(cross(vec(cage.outer[s[k]]), vec(cage.outer[s[(k + 1) % 3]])), middle) >= 0;
    if (inside && behind) return true;
  }
  return false;
}

TEST(VerifySource, SteepButSingleValuedPasses) {
  // Rays from the centre meet any such surface once, but fibres of far corners see its slopes from behind.
  const Cage cage = sphere_cage(1, 0.5, 1.6);
  const auto bumps = [](Vec3d d) { return 1 + 0.14 * std::sin(14 * d.x) * std::sin(13 * d.y) * std::cos(15 * d.z); };
  for (const int levels : {4, 5}) {
    const Surface source = ball(levels, bumps);
    EXPECT_PROVEN(cage.check(source));
    std::size_t steep = 0;
    for (std::size_t t = 0; t < source.faces.size(); ++t) steep += fails_three_corners(cage, source, t) ? 1 : 0;
    EXPECT_GT(steep, source.faces.size() / 50);
  }
}

TEST(VerifySource, StretchingAndShearingChangeNothing) {
  // The triangles around a vertex then look almost away from each other: few directions see them all.
  const auto stretch = [](Vec3d p) { return Vec3d{p.x, p.y, p.z * 0x1p8}; };
  const auto shear = [](Vec3d p) { return Vec3d{p.x + p.z * 0x1p7, p.y - p.z * 0x1p6, p.z}; };
  const auto bumps = [](Vec3d d) { return 1 + 0.1 * std::sin(14 * d.x) * std::sin(13 * d.y) * std::cos(15 * d.z); };
  for (const auto& map : {std::function<Vec3d(Vec3d)>(stretch), std::function<Vec3d(Vec3d)>(shear)}) {
    Cage cage = sphere_cage(1, 0.5, 1.6);
    for (auto* ends : {&cage.inner, &cage.outer})
      for (Point& p : *ends) {
        const Vec3d q = map(vec(p));
        p = {q.x, q.y, q.z};
      }
    EXPECT_PROVEN(cage.check(ball(5, bumps).moved(map)));
    Surface folded = ball(5, bumps);
    folded.points[900] = rounded(normalized(vec(folded.points[900]) + Vec3d{0.1, 0, 0.1}));
    EXPECT_EQ(broken(cage.check(folded.moved(map))), (Conditions{Condition::C6}));
  }
}

TEST(VerifySource, FindsWhatTheShellLeavesOut) {
  for (const Vec3d where : {Vec3d{3, 0, 0}, Vec3d{0.1, 0.2, 0}}) {
    Surface source = ball();
    source.add(ball(1, 0.125, where));
    const Certificate c = reported(where.x > 1 ? "a second part of the source lies beside the shell"
                                               : "a second part of the source lies in the shell's cavity",
                                   sphere_cage().check(source));
    EXPECT_EQ(broken(c), (Conditions{Condition::C7}));
    EXPECT_TRUE(says(c, "is met by 0 test fibres"));
  }
}

TEST(VerifySource, FindsASourceTwiceInOneShell) {
  Surface source = ball(4, 0.95);
  source.add(ball(4, 1.05));
  const Certificate c = reported("two surfaces lie in one shell", sphere_cage().check(source));
  EXPECT_EQ(broken(c), (Conditions{Condition::C7}));
  EXPECT_TRUE(says(c, "meets the source 2 times"));
}

TEST(VerifySource, FindsASourceInsideOut) {
  const Certificate c = reported("the source is inside out", sphere_cage().check(ball().inside_out()));
  EXPECT_EQ(broken(c), (Conditions{Condition::C6}));
  EXPECT_GE(c.failure_count[6], ball().faces.size());
}

/// A ball whose meridians go round `turns` times.
Surface wound(int turns) {
  const int rings = 24, around = 24 * turns;
  Surface surface;
  surface.points = {{0, 0, -1}, {0, 0, 1}};
  for (int r = 1; r < rings; ++r)
    for (int k = 0; k < around; ++k) {
      const double p = std::numbers::pi * (double(r) / rings - 0.5), q = 2 * std::numbers::pi * turns * k / around;
      surface.points.push_back(rounded({std::cos(p) * std::cos(q), std::cos(p) * std::sin(q), std::sin(p)}));
    }
  const auto at = [&](int r, int k) {
    return r == 0 ? 0U : r == rings ? 1U : static_cast<std::uint32_t>(2 + (r - 1) * around + k % around);
  };
  for (int r = 0; r < rings; ++r)
    for (int k = 0; k < around; ++k) {
      if (r > 0) surface.faces.push_back({at(r, k), at(r, k + 1), at(r + 1, k)});
      if (r + 1 < rings) surface.faces.push_back({at(r, k + 1), at(r + 1, k + 1), at(r + 1, k)});
    }
  return surface;
}

TEST(VerifySource, FindsAVertexWoundTwice) {
  EXPECT_PROVEN(sphere_cage().check(wound(1)));
  const Certificate c = reported("the source winds twice around two vertices", sphere_cage().check(wound(2)));
  EXPECT_EQ(broken(c), (Conditions{Condition::C6, Condition::C7}));  // who winds twice is met twice
  EXPECT_EQ(c.failure_count[6], 2U);
  EXPECT_TRUE(says(c, "source vertex 0 wind 2 times"));
  EXPECT_TRUE(says(c, "source vertex 1 wind 2 times"));
}

TEST(VerifySource, FindsTheDirectionThatSeesAFlatSpike) {
  // Three fronts at a spike's tip, of which two nearly turn their backs on the third: one direction sees them all at a
  // sine of 0.022, and hardly another one sees them.
  std::mt19937 random(3);
  std::uniform_real_distribution<double> turn(0, 2 * std::numbers::pi), spread(0.002, 1.5);
  for (int trial = 0; trial < 100; ++trial) {
    const double first = turn(random);
    std::array<Vec3d, 3> fronts{};
    const std::array<double, 3> around = {first, first + std::numbers::pi - spread(random),
                                          first + std::numbers::pi + spread(random)};
    for (std::size_t k = 0; k < 3; ++k) fronts[k] = normalized(Vec3d{std::cos(around[k]), std::sin(around[k]), 0.022});
    Surface spike;
    spike.points.push_back({0, 0, 0});
    for (std::size_t k = 0; k < 3; ++k)
      spike.points.push_back(rounded(normalized(cross(fronts[(k + 1) % 3], fronts[k])) * 0.5));
    spike.faces = {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {3, 2, 1}};
    const Certificate c = sphere_cage().check(spike);
    EXPECT_FALSE(says(c, "at source vertex 0")) << "trial " << trial;
  }
}

TEST(VerifySource, FindsAnOpenSource) {
  Surface source = ball();
  source.faces.erase(source.faces.begin() + 77);
  const Certificate c = reported("a triangle of the source is missing", sphere_cage().check(source));
  EXPECT_EQ(broken(c), (Conditions{Condition::C7}));
  EXPECT_EQ(c.failure_count[7], 3U);
  EXPECT_TRUE(says(c, "is open"));
  // Half a ball, and nothing at all.
  std::erase_if(source.faces, [&](const Face& f) { return source.points[f[0]][2] < 0; });
  EXPECT_EQ(broken(reported("half of the source is missing", sphere_cage().check(source))),
            (Conditions{Condition::C7}));
  EXPECT_EQ(broken(reported("there is no source", sphere_cage().check(Surface{}))), (Conditions{Condition::C7}));
}

TEST(VerifySource, OpenShellsAreNotProven) {
  Cage cage = sphere_cage();
  cage.faces.pop_back();
  const Certificate c = reported("a slab of the shell is missing", cage.check(ball()));
  EXPECT_EQ(broken(c), (Conditions{Condition::C7}));
  EXPECT_TRUE(says(c, "is open, so one fibre does not speak"));
}

TEST(VerifySource, FindsSurfacesThatAreNone) {
  Surface twice = ball();
  twice.faces.push_back(twice.faces[5]);
  EXPECT_EQ(broken(reported("a source triangle stands twice", sphere_cage().check(twice))),
            (Conditions{Condition::C6}));
  Surface turned_face = ball();
  std::swap(turned_face.faces[5][0], turned_face.faces[5][1]);
  EXPECT_TRUE(broken(reported("a source triangle runs the other way round", sphere_cage().check(turned_face)))
                  .contains(Condition::C6));
  Surface repeated = ball();
  repeated.faces[5][0] = repeated.faces[5][1];
  EXPECT_TRUE(broken(reported("a source triangle names one vertex twice", sphere_cage().check(repeated)))
                  .contains(Condition::C6));
  Surface pinched = ball(4, 0.95);  // two balls that share a vertex
  const Surface other = ball(4, 1.05);
  const auto first = static_cast<std::uint32_t>(pinched.points.size());
  pinched.add(other);
  for (Face& f : pinched.faces)
    for (std::uint32_t& v : f)
      if (v == first + 50) v = 50;
  const Certificate c = reported("two surfaces share a vertex", sphere_cage().check(pinched));
  EXPECT_EQ(broken(c), (Conditions{Condition::C6, Condition::C7}));
  EXPECT_TRUE(says(c, "source vertex 50 are not one fan"));
}

TEST(VerifySource, FindsTrianglesWithoutArea) {
  Surface source = ball();  // one edge is split, and its middle is a corner of two triangles and of a flat third
  const Face f = source.faces[9];
  const Vec3d a = vec(source.points[f[0]]), b = vec(source.points[f[1]]);
  const auto middle = static_cast<std::uint32_t>(source.points.size());
  source.points.push_back({(a.x + b.x) / 2, (a.y + b.y) / 2, (a.z + b.z) / 2});
  source.faces[9] = {f[0], middle, f[2]};
  source.faces.push_back({middle, f[1], f[2]});
  source.faces.push_back({f[0], f[1], middle});
  const Certificate c = reported("a source triangle has no area", sphere_cage().check(source));
  EXPECT_TRUE(broken(c).contains(Condition::C6));
  EXPECT_TRUE(says(c, "has no area"));
  EXPECT_TRUE(c.holds[7]);
}

TEST(VerifySource, SaysWhatIsWrongWithNumbers) {
  Surface source = ball();
  source.faces[3][1] = 99999;
  EXPECT_TRUE(says(reported("a source triangle names a vertex that is not there", sphere_cage().check(source)),
                   "source triangle 3 names vertex 99999"));
  source = ball();
  source.points[7][1] = std::numeric_limits<double>::quiet_NaN();
  const Certificate c = reported("a source coordinate is not a number", sphere_cage().check(source));
  EXPECT_TRUE(says(c, "source vertex 7 has a coordinate that is not a finite number"));
  EXPECT_FALSE(c.holds[5] || c.holds[6] || c.holds[7]);
  EXPECT_TRUE(c.holds[4]);
  source = ball();
  source.points[7][1] = 1e300;
  EXPECT_TRUE(says(reported("a source vertex lies absurdly far away", sphere_cage().check(source)), "reaches so far"));
  source = ball();
  source.points.push_back({std::numeric_limits<double>::infinity(), 0, 0});  // nobody names it
  EXPECT_PROVEN(sphere_cage().check(source));
}

TEST(VerifySource, ABrokenShellIsNotProvenByItsSource) {
  Cage cage = sphere_cage();
  cage.faces[4][1] = 9999;
  EXPECT_FALSE(
      reported("a slab names a fibre that is not there, with a right source inside", cage.check(ball())).all());
  cage = sphere_cage();
  std::swap(cage.inner[9], cage.outer[9]);
  const Certificate c =
      reported("inner and outer end of one fibre are swapped, with a right source inside", cage.check(ball()));
  EXPECT_TRUE(broken(c).contains(Condition::C1));
  EXPECT_FALSE(c.all());
}

// ---- Against brute force

std::size_t crossings(const Surface& source, Vec3d from, Vec3d to) {
  std::size_t count = 0;
  const Vec3d d = to - from;
  for (const Face& f : source.faces) {
    const Vec3d a = vec(source.points[f[0]]) - from, b = vec(source.points[f[1]]) - from,
                c = vec(source.points[f[2]]) - from;
    const double u = dot(d, cross(b, c)), v = dot(d, cross(c, a)), w = dot(d, cross(a, b));
    if (!((u > 0 && v > 0 && w > 0) || (u < 0 && v < 0 && w < 0))) continue;
    const Vec3d n = cross(b - a, c - a);
    const double t = dot(n, a) / dot(n, d);
    if (t > 0 && t < 1) ++count;
  }
  return count;
}

TEST(VerifySource, NeverPassesWhereAFibreIsNotMetOnce) {
  std::mt19937_64 random(20020527);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto any = [&] { return Vec3d{unit(random), unit(random), unit(random)}; };
  std::size_t passed = 0, wrong = 0, missed_by_sampling = 0;
  for (int round = 0; round < 300; ++round) {
    Cage cage = sphere_cage(1, 0.6, 1.5);
    const double tilt = 0.12 * std::abs(unit(random));
    for (auto* ends : {&cage.inner, &cage.outer})
      for (Point& p : *ends) p = rounded(vec(p) + any() * tilt);
    const double rough = 0.3 * std::abs(unit(random));
    Surface source = ball(2).moved([&](Vec3d p) { return vec(rounded(p + any() * rough)); });
    if (round % 3 == 0) source = source.moved([&](Vec3d p) { return p + any() * 1e-12; });  // off the lattice
    const Certificate c = cage.check(source);
    bool once = true;
    for (const Face& f : cage.faces)
      for (int k = 0; k < 60; ++k) {
        double u = std::abs(unit(random)), v = std::abs(unit(random));
        if (u + v > 1) u = 1 - u, v = 1 - v;
        const auto at = [&](const std::vector<Point>& ends) {
          return vec(ends[f[0]]) * (1 - u - v) + vec(ends[f[1]]) * u + vec(ends[f[2]]) * v;
        };
        once = once && crossings(source, at(cage.inner), at(cage.outer)) == 1;
      }
    if (c.all()) {
      ++passed;
      EXPECT_TRUE(once) << "round " << round;
    } else if (once) {
      ++missed_by_sampling;
    }
    if (!once) ++wrong;
  }
  // The rounds tell something only where both kinds occur, and where the verdict is not "no" out of caution.
  EXPECT_GT(passed, 40U);
  EXPECT_GT(wrong, 40U);
  EXPECT_LT(missed_by_sampling, passed);
}

// ---- Samples

struct Tiles {
  std::vector<std::vector<float>> values;
  int n;

  [[nodiscard]] std::vector<SampleTile> view() const {
    std::vector<SampleTile> tiles;
    for (const auto& v : values) tiles.push_back({n, v});
    return tiles;
  }
};

/// The displacement of a cube of half size 0.75 in the cage of cubes of 0.5 and 1.
Tiles cube_tiles(const Cage& cage, int n) {
  return {std::vector<std::vector<float>>(cage.faces.size(),
                                          std::vector<float>(static_cast<std::size_t>((n + 1) * (n + 2) / 2), 0.5F)),
          n};
}

TEST(VerifySamples, ComparesEachWithItsFibre) {
  const Cage cage = cube_cage(0.5, 1);
  const Surface source = cube(0.75);
  Tiles tiles = cube_tiles(cage, 6);
  const auto found = [&] { return check_samples(cage.view(), source.view(), tiles.view(), 1e-4); };
  SampleCheck c = found();
  EXPECT_EQ(c.tested, 12U * 28U);
  EXPECT_EQ(c.single, c.tested);
  EXPECT_EQ(c.off, 0U);
  EXPECT_LT(c.worst, 1e-9);

  tiles.values[7][20] += 0.001F;
  c = found();
  EXPECT_EQ(c.off, 1U);
  ASSERT_EQ(c.failures.size(), 1U);
  EXPECT_EQ(c.failures[0].a, 7U);
  EXPECT_EQ(c.failures[0].b, 20U);
  EXPECT_GT(c.worst, 0.0005 - 1e-6);
  EXPECT_LT(c.worst, 0.001);
  tiles.values[7].clear();  // not to be looked at
  EXPECT_EQ(found().off, 0U);
  EXPECT_EQ(found().tested, 11U * 28U);

  std::atomic<bool> cancel = false;
  Progress progress;
  progress.cancel = &cancel;
  progress.report = [&](std::string_view, double share) { cancel = share > 0.4; };
  c = check_samples(cage.view(), source.view(), tiles.view(), 1e-4, std::nullopt, progress);
  EXPECT_GT(c.tested, 0U);
  EXPECT_LT(c.tested, 8U * 28U) << "cancelled half-way";

  tiles.values[3].pop_back();
  EXPECT_EQ(found().off, 1U);
  tiles.values[3].clear();
  tiles.values[4][0] = std::numeric_limits<float>::quiet_NaN();
  tiles.values[4][1] = 1.5F;
  EXPECT_EQ(found().off, 2U);
}

TEST(VerifySamples, ThoseThatACoarserNeighbourLacksAreNotHeldAgainstTheSource) {
  const Cage cage = cube_cage(0.5, 1);
  const Surface source = cube(0.75);
  const Tiles coarse = cube_tiles(cage, 4);
  Tiles fine = cube_tiles(cage, 16);
  std::vector<SampleTile> tiles = coarse.view();
  tiles[5] = fine.view()[5];
  const auto found = [&] { return check_samples(cage.view(), source.view(), tiles, 1e-4); };
  const std::size_t tested = 11U * 15U + 153U - 3U * 12U;  // 16 - 4 of them along each edge
  EXPECT_EQ(found().tested, tested);
  EXPECT_EQ(found().off, 0U);
  fine.values[5][1] = fine.values[5][3] = 0.7F;  // on an edge, between those that the neighbour has
  EXPECT_EQ(found().off, 0U);
  fine.values[5][18] = 0.7F;  // inside
  EXPECT_EQ(found().off, 1U);
  fine.values[5][4] = 0.7F;  // shared
  EXPECT_EQ(found().off, 2U);
  // The neighbour need not be looked at, its n counts.
  for (std::size_t s = 0; s < tiles.size(); ++s)
    if (s != 5) tiles[s].values = {};
  EXPECT_EQ(found().tested, 153U - 3U * 12U);
}

/// The cage between cubes and a source cube between them, one side of which closes an opening.
struct OpenBox {
  static constexpr int kN = 6;
  Cage cage = cube_cage(0.5, 1);
  Surface source = cube(0.75);
  Tiles values = cube_tiles(cage, kN), voids = cube_tiles(cage, kN), folded = cube_tiles(cage, kN);

  OpenBox() {
    for (std::size_t s = 0; s < cage.faces.size(); ++s) {
      std::ranges::fill(voids.values[s], s >= 10 ? 1.0F : 0.0F);  // the last side
      std::ranges::fill(folded.values[s], 0.0F);
    }
  }
  [[nodiscard]] SampleCheck check(std::optional<std::size_t> phantom_from) const {
    const auto v = voids.view(), f = folded.view();
    Source seen = source.view();
    seen.phantom_from = phantom_from;
    return check_samples(cage.view(), seen, values.view(), 1e-4, SampleMarks{v, f});
  }
  /// On how many sides of the cube a sample lies, and whether on the last.
  [[nodiscard]] std::pair<int, bool> sides_of(std::size_t slab, std::size_t sample) const {
    std::size_t at = 0;
    for (int j = 0; j <= kN; ++j)
      for (int i = 0; i + j <= kN; ++i, ++at) {
        if (at != sample) continue;
        const auto& f = cage.faces[slab];
        const Vec3d p =
            (vec(cage.outer[f[0]]) * (kN - i - j) + vec(cage.outer[f[1]]) * i + vec(cage.outer[f[2]]) * j) / kN;
        const auto on = [](double x) { return std::abs(x) > 1 - 1e-9 ? 1 : 0; };
        return {on(p.x) + on(p.y) + on(p.z), p.z > 1 - 1e-9};
      }
    return {};
  }
};

TEST(VerifySamples, VoidIsWhatClosesAnOpeningAndNothingElse) {
  OpenBox box;
  ASSERT_EQ(box.source.faces[10][0], 4U);  // the side at +z
  EXPECT_EQ(box.check(10).off, 0U);
  EXPECT_EQ(box.check(std::nullopt).off, 0U);
  EXPECT_EQ(box.check(12).off, 2U * 28U) << "nothing closes an opening";
  for (std::size_t s = 0; s < box.cage.faces.size(); ++s)
    for (std::size_t k = 0; k < box.voids.values[s].size(); ++k) {
      float& mark = box.voids.values[s][k];
      mark = 1 - mark;
      const auto [sides, on_last] = box.sides_of(s, k);
      const bool rim = on_last && sides > 1;
      const SampleCheck c = box.check(10);
      EXPECT_EQ(c.off, rim ? 0U : 1U) << s << ' ' << k;
      if (!rim) {
        EXPECT_EQ(c.slabs, std::vector<std::uint32_t>(1, static_cast<std::uint32_t>(s)));
        EXPECT_NE(c.failures.at(0).what.find("marked void"), std::string::npos);
      }
      // Not knowing which they are, only samples inside of triangles contradict each other.
      const bool inside = k != 0 && sides == 1 && (s < 10 || on_last);
      if (inside && k == 8) {
        EXPECT_GT(box.check(std::nullopt).off, 0U) << s;
      }
      mark = 1 - mark;
    }
  // A scan that was left open: a void sample may meet nothing.
  box.source.faces.resize(10);
  EXPECT_EQ(box.check(std::nullopt).off, 0U);
  EXPECT_GT(box.check(10).off, 0U);
  box.voids.values[10][8] = 0;
  EXPECT_EQ(box.check(std::nullopt).off, 1U);
}

TEST(VerifySamples, FoldedIsWhatFibresMeetSeveralTimes) {
  OpenBox box;
  const auto inside = [&](std::size_t s, std::size_t k) { return box.sides_of(s, k).first == 1; };
  const std::size_t all = box.check(10).tested;
  for (auto& tile : box.folded.values) std::ranges::fill(tile, 1.0F);
  EXPECT_EQ(box.check(10).off, all) << "a fibre that meets it once, also through an edge";
  // Out, in, and out again: the samples are on the middle one.
  box.source.add(cube(0.6));
  Surface turned = box.source.inside_out();
  std::copy(turned.faces.begin(), turned.faces.begin() + 12, box.source.faces.begin());
  box.source.add(cube(0.9));
  std::size_t seen = 0;
  for (auto& tile : box.voids.values) std::ranges::fill(tile, 0.0F);
  EXPECT_EQ(box.check(box.source.faces.size()).off, 0U);
  for (auto& tile : box.folded.values) std::ranges::fill(tile, 0.0F);
  const SampleCheck c = box.check(box.source.faces.size());
  for (std::size_t s = 0; s < 12; ++s)
    for (std::size_t k = 0; k < 28; ++k) seen += inside(s, k);
  EXPECT_GE(c.off, seen / 2) << "those that lie on an edge of the source may be either";
  EXPECT_NE(c.failures.at(0).what.find("not marked folded"), std::string::npos);
}

TEST(VerifySamples, FoldedMayMeetNothing) {
  OpenBox box;
  for (auto& tile : box.voids.values) std::ranges::fill(tile, 0.0F);
  for (auto& tile : box.folded.values) std::ranges::fill(tile, 0.0F);
  box.source.faces.resize(10);
  const SampleCheck unmarked = box.check(10);
  ASSERT_GT(unmarked.none, 0U);
  EXPECT_EQ(unmarked.off, unmarked.none);
  for (SampleCheck c = unmarked; c.off > 0; c = box.check(10))
    for (const Failure& f : c.failures) {
      ASSERT_NE(f.what.find("does not meet the source"), std::string::npos) << f.what;
      box.folded.values[f.a][f.b] = 1;
    }
  // A fibre that only enters leaves it nowhere.
  for (auto& tile : box.folded.values) std::ranges::fill(tile, 1.0F);
  box.source = box.source.inside_out();
  EXPECT_EQ(box.check(10).off, 0U);
}

TEST(VerifySamples, NamesEverySlabHoweverManyAreOff) {
  const Cage cage = cube_cage(0.5, 1);
  Tiles tiles = cube_tiles(cage, 100);  // 12 times 5151
  for (std::size_t s = 0; s < 12; ++s)
    if (s != 3 && s != 9) std::ranges::fill(tiles.values[s], 0.25F);
  tiles.values[11].assign(5151, 0.5F);
  tiles.values[11][2000] = 0.25F;
  // Their copies on shared edges are right, or wrong, by their own slab.
  const SampleCheck c = check_samples(cage.view(), cube(0.75).view(), tiles.view(), 1e-4);
  EXPECT_TRUE(c.at_least);
  EXPECT_GE(c.off, 10000U);
  EXPECT_LT(c.off, 2U * 5151U + 20U);
  EXPECT_EQ(c.slabs, (std::vector<std::uint32_t>{0, 1, 2, 4, 5, 6, 7, 8, 10, 11}));
}

TEST(VerifySamples, LengthsAreReadableInTinyModels) {
  Cage cage = cube_cage(0x1p-41, 0x1p-40);
  const Surface source = cube(0x1.8p-41);
  Tiles tiles = cube_tiles(cage, 1);
  tiles.values[0][0] = 0.75F;
  const SampleCheck c = check_samples(cage.view(), source.view(), tiles.view(), 0x1p-60);
  EXPECT_EQ(c.off, 1U);
  EXPECT_NE(c.failures.at(0).what.find("lies 1.97e-13 away"), std::string::npos) << c.failures.at(0).what;
}

/// Where the segment from p meets the source first, as a share of it; nothing where it does not.
std::optional<double> first_hit(const Surface& source, Vec3d p, Vec3d along) {
  std::optional<double> first;
  for (const Face& f : source.faces) {
    const Vec3d a = vec(source.points[f[0]]) - p, b = vec(source.points[f[1]]) - p, c = vec(source.points[f[2]]) - p;
    const double u = dot(along, cross(b, c)), v = dot(along, cross(c, a)), w = dot(along, cross(a, b));
    if (!((u > 0 && v > 0 && w > 0) || (u < 0 && v < 0 && w < 0))) continue;
    const Vec3d n = cross(b - a, c - a);
    const double t = dot(n, a) / dot(n, along);
    if (t > 0 && t < 1 && (!first || t < *first)) first = t;
  }
  return first;
}
double distance_from(const Surface& source, Vec3d p) {
  double least = std::numeric_limits<double>::infinity();
  for (const Face& f : source.faces) {
    const Vec3d a = vec(source.points[f[0]]), b = vec(source.points[f[1]]), c = vec(source.points[f[2]]);
    const auto w = nearest_in_triangle(p, a, b, c);
    least = std::min(least, length(a * w[0] + b * w[1] + c * w[2] - p));
  }
  return least;
}

// What convert does to a clean scan: its vertices go to the lattice of the shell before the samples are taken. Along
// fibres that graze it the hits move much further than that, and into other triangles.
TEST(VerifySamples, ASourceOffTheLatticeIsTheOneOfItsRoundedVertices) {
  constexpr int kN = 6;
  const auto rough = [](Vec3d d) { return 1.05 + 0.3 * std::sin(900 * d.x + 700 * d.y + 500 * d.z); };
  const Cage cage = sphere_cage(2, 0.5, 1.6);
  const Surface source = ball(4, rough).moved(turned);
  const Surface on_lattice = source.moved([](Vec3d p) { return vec(rounded(p)); });
  ASSERT_GT(source.faces.size(), 2000U);
  constexpr double kTolerance = 1e-9;
  std::mt19937_64 random(1991);
  std::uniform_real_distribution<double> unit(0, 1);
  std::size_t close = 0, right = 0, wrong = 0;
  double worst = 0;
  for (std::size_t s = 0; s < cage.faces.size(); ++s) {
    const Face& f = cage.faces[s];
    std::vector<float> taken, moved;
    std::vector<SampleTile> tiles(cage.faces.size(), {kN, {}});
    std::vector<double> away;  // of those that were moved, from the source, in bounds
    for (int j = 0; j <= kN; ++j)
      for (int i = 0; i + j <= kN; ++i) {
        const auto at = [&](const std::vector<Point>& ends) {
          return (vec(ends[f[0]]) * (kN - i - j) + vec(ends[f[1]]) * i + vec(ends[f[2]]) * j) / kN;
        };
        const Vec3d p = at(cage.inner), along = at(cage.outer) - p;
        const double t = first_hit(on_lattice, p, along).value_or(0.5);
        taken.push_back(static_cast<float>(t));
        const double by = std::ldexp(1 / kSteps, static_cast<int>(8 * unit(random)) - 2);
        moved.push_back(static_cast<float>(t + (unit(random) < 0.5 ? by : -by) / length(along)));
        const double bound = std::sqrt(0.75) / kSteps + 0x1p-24 * length(along);
        away.push_back(distance_from(source, p + along * static_cast<double>(moved.back())) / bound);
      }
    tiles[s].values = taken;
    const SampleCheck as_taken = check_samples(cage.view(), source.view(), tiles, kTolerance);
    EXPECT_EQ(as_taken.off, 0U) << s;
    worst = std::max(worst, as_taken.worst);
    // Against what they were taken from, there is no such room.
    EXPECT_EQ(check_samples(cage.view(), on_lattice.view(), tiles, 0x1p-23).off, 0U) << s;
    tiles[s].values = moved;
    EXPECT_GT(check_samples(cage.view(), on_lattice.view(), tiles, 0x1p-23).off, 26U) << s;
    std::set<std::uint32_t> found;
    for (const Failure& g : check_samples(cage.view(), source.view(), tiles, kTolerance).failures) found.insert(g.b);
    for (std::uint32_t k = 0; k < away.size(); ++k) {
      if (std::abs(away[k] - 1) < 1e-3) continue;
      ++(away[k] > 1 ? wrong : right);
      EXPECT_EQ(found.contains(k), away[k] > 1) << s << ' ' << k << ' ' << away[k];
      close += away[k] > 1 && away[k] < 1.5;
    }
  }
  EXPECT_GT(worst, 3 / kSteps) << "no fibre grazed the source";
  EXPECT_GT(right, 500U);
  EXPECT_GT(wrong, 500U);
  EXPECT_GT(close, 50U) << "none was moved by little more than the bound";
}

TEST(VerifySamples, CountsWhatFibresMeet) {
  const Cage cage = cube_cage(0.5, 1);
  Surface source = cube(0.75);
  source.add(cube(0.875));
  const Tiles tiles = cube_tiles(cage, 4);
  SampleCheck c = check_samples(cage.view(), source.view(), tiles.view(), 1e-4);
  EXPECT_EQ(c.several, c.tested);
  EXPECT_EQ(c.off, 0U);  // one of the two is where the sample says
  source = cube(0.25);
  c = check_samples(cage.view(), source.view(), tiles.view(), 1e-4);
  EXPECT_EQ(c.none, c.tested);
  EXPECT_EQ(c.off, c.tested);
  EXPECT_EQ(c.failures.size(), 100U);
  source.faces[0][0] = 1000;
  c = check_samples(cage.view(), source.view(), tiles.view(), 1e-4);
  EXPECT_EQ(c.off, 1U);
}

// Slabs are looked at a branch of their tree at a time, as many as a share of the source's triangles. Beside a large
// source they all are one branch: what is said about them must be the same.
TEST(VerifySource, SaysTheSameOfManyBranchesAsOfOne) {
  const Vec3d aside = {4, 0, 0};
  Cage cage = sphere_cage(5);  // 8192 slabs, in eight branches beside a small source
  cage.add(sphere_cage(0, 0.2, 1.5, aside));
  Surface source = ball(4);
  std::mt19937 random(7);
  std::uniform_int_distribution<std::size_t> any(0, source.points.size() - 1);
  for (int k = 0; k < 30; ++k) {
    Point& p = source.points[any(random)];
    const double by = k % 3 == 0 ? 1.3 : k % 3 == 1 ? 0.7 : 1.1;  // out, in, and within the shell
    for (double& x : p) x = std::round(x * by * kSteps) / kSteps;
  }
  std::swap(source.faces[100][1], source.faces[100][2]);
  source.faces[200][1] = source.faces[200][0];
  const auto check_beside = [&](int levels) {
    Surface both = source;
    both.add(ball(levels, 0.8, aside));
    return cage.check(both);
  };
  const Certificate many = check_beside(1), one = check_beside(8);
  EXPECT_GT(many.failure_count[5], 100U);
  EXPECT_GT(many.failure_count[6], 10U);
  EXPECT_EQ(many.failure_count, one.failure_count);
  EXPECT_EQ(many.holds, one.holds);
  ASSERT_EQ(many.failures.size(), one.failures.size());
  for (std::size_t k = 0; k < many.failures.size(); ++k) {
    EXPECT_EQ(many.failures[k].condition, one.failures[k].condition);
    EXPECT_EQ(many.failures[k].a, one.failures[k].a);
    EXPECT_EQ(many.failures[k].b, one.failures[k].b);
    EXPECT_EQ(many.failures[k].what, one.failures[k].what);
  }
}

// Beyond what is counted, triangles are only looked at where they could name another slab: a large wrong source names
// the slabs that its pieces name, each of them too small for that.
TEST(VerifySource, NamesEverySlabHoweverMuchOfTheSourceIsWrong) {
  const Cage cage = sphere_cage(5);  // 8192 slabs, in several branches
  Surface source = ball(6, [](Vec3d d) { return d.x > 0.5 ? 1.21 : d.z > 0.3 ? 1.0 : 0.9; });
  for (std::size_t t = 0; t < source.faces.size(); ++t)
    if (source.points[source.faces[t][0]][1] > 0.25) std::swap(source.faces[t][1], source.faces[t][2]);
  const Certificate whole = cage.check(source);
  std::array<std::set<std::uint32_t>, kConditionCount> pieces;
  constexpr std::size_t kPieces = 16;
  for (std::size_t k = 0; k < kPieces; ++k) {
    Surface piece = source;
    piece.faces.clear();
    for (std::size_t t = k; t < source.faces.size(); t += kPieces) piece.faces.push_back(source.faces[t]);
    const Certificate c = cage.check(piece);
    for (const Condition condition : {Condition::C5, Condition::C6}) {
      EXPECT_FALSE(c.at_least[static_cast<std::size_t>(condition)]);
      const auto named = c.failing(condition);
      pieces[static_cast<std::size_t>(condition)].insert(named.begin(), named.end());
    }
  }
  for (const std::size_t k : {5U, 6U}) {
    const auto named = whole.failing(static_cast<Condition>(k));
    EXPECT_GT(named.size(), 100U);
    EXPECT_LT(named.size(), cage.faces.size());
    EXPECT_TRUE(std::ranges::equal(named, pieces[k])) << k;
  }
  EXPECT_TRUE(whole.at_least[6]);
  EXPECT_GE(whole.failure_count[6], 10000U);
}

TEST(VerifySource, CancelledClaimsNothingThatWasNotTested) {
  const std::atomic<bool> cancel = true;
  const Cage cage = sphere_cage();
  const Surface source = ball();
  ASSERT_TRUE(cage.check(source).all());
  const Certificate c = verify::check(cage.view(), source.view(), {.report = {}, .cancel = &cancel});
  EXPECT_FALSE(c.all());
  for (const Condition condition : {Condition::C5, Condition::C6, Condition::C7})
    EXPECT_FALSE(c.holds[static_cast<std::size_t>(condition)]);
}

}  // namespace
}  // namespace relief::verify
