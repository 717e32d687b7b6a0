// Shells that are right pass; shells broken in one way each fail exactly the condition that this way breaks.
#include "cages.h"
#include "report.h"

#include <relief/verify/verify.h>

#include <gtest/gtest.h>
#include <support/shells.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <set>
#include <vector>

namespace relief::verify {

namespace {

constexpr int kBits = 16;

Cage sphere(int levels = 1, double inner = 0.8, double outer = 1.2) {
  return snapped(*testing::sphere_shell(levels, 1, inner, outer), kBits);
}

/// A tetrahedron between its copies of half and full size.
Cage tetrahedron(double inner = 0.5) {
  Cage parts;
  for (const Point p : {Point{1, 1, 1}, Point{-1, -1, 1}, Point{-1, 1, -1}, Point{1, -1, -1}})
    parts.fibre({p[0] * inner, p[1] * inner, p[2] * inner}, p);
  parts.faces = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  return parts;
}

/// One open slab over a triangle in the plane z = height, one thick.
Cage plate(Point a, Point b, Point c, double thickness = 1) {
  Cage parts;
  for (const Point p : {a, b, c}) parts.fibre(p, {p[0], p[1], p[2] + thickness});
  parts.faces = {{0, 1, 2}};
  return parts;
}

std::vector<std::uint32_t> numbers(std::uint32_t from, std::uint32_t to) {
  std::vector<std::uint32_t> all;
  for (; from < to; ++from) all.push_back(from);
  return all;
}

std::set<Condition> broken(const Certificate& certificate) {
  std::set<Condition> conditions;
  for (const Failure& f : certificate.failures) conditions.insert(f.condition);
  return conditions;
}

#define EXPECT_SOUND(certificate)                                   \
  do {                                                              \
    const Certificate& c_ = (certificate);                          \
    EXPECT_TRUE(c_.all());                                          \
    EXPECT_TRUE(c_.on_lattice);                                     \
    for (const Failure& f_ : c_.failures) ADD_FAILURE() << f_.what; \
  } while (false)

TEST(Verify, PassesRightShells) {
  EXPECT_SOUND(sphere(0).check());
  EXPECT_SOUND(sphere(3).check());
  EXPECT_SOUND(tetrahedron().check());
  EXPECT_SOUND(cube_cage(0.5, 1).check());
  EXPECT_SOUND(snapped(*testing::torus_shell(16, 10, 1), kBits).check());
  EXPECT_SOUND(snapped(*testing::plane_shell(6, 1), kBits).check());
}

TEST(Verify, ScaleAndPlaceDoNotMatter) {
  Cage far;
  far.add(sphere(2), {0x1p34, -0x1p34, 0x1p33}, 0x1p20);
  EXPECT_SOUND(far.check());
  Cage tiny;
  tiny.add(sphere(2), {}, 0x1p-900);
  EXPECT_SOUND(tiny.check());
  Cage huge;
  huge.add(sphere(2), {}, 0x1p900);
  EXPECT_SOUND(huge.check());
}

TEST(Verify, UsesTheWholeLattice) {
  const double top = 0x1p29;  // the span is 2^30 steps
  Cage parts = cube_cage(1, top);
  EXPECT_SOUND(parts.check());
  parts.outer[7][0] = top + 1;
  const Certificate wider = parts.check();
  EXPECT_EQ(broken(wider), std::set{Condition::C0});
  EXPECT_FALSE(wider.on_lattice);
}

TEST(Verify, ShellsSideBySideOrInACavityPass) {
  Cage parts = cube_cage(2, 3);
  parts.add(cube_cage(0.5, 1), {8, 0, 0});
  parts.add(sphere());
  EXPECT_SOUND(parts.check());
}

TEST(Verify, FindsAFoldAtOneEnd) {
  Cage parts = sphere();
  parts.inner[4] = {parts.outer[4][0] * 2, parts.outer[4][1] * 2, parts.outer[4][2] * 2};
  const Certificate c = reported("an inner end is pulled out beyond its outer end", parts.check());
  EXPECT_EQ(c.failures.at(0).condition, Condition::C1);
  EXPECT_FALSE(c.holds[1]);
  for (const Failure& f : c.failures) {
    if (f.condition != Condition::C1) continue;
    const Face& face = parts.faces[f.a];
    EXPECT_TRUE(face[0] == 4 || face[1] == 4 || face[2] == 4) << f.what;
  }
}

TEST(Verify, FindsAFoldThatNothingElseShows) {
  Cage parts = plate({0, 0, 0}, {8, 0, 0}, {0, 8, 0});
  parts.inner[2] = {4, -8, 0};  // the inner triangle faces down; it meets nothing
  const Certificate c = reported("the inner triangle of a lone slab faces the other way", parts.check());
  EXPECT_EQ(broken(c), std::set{Condition::C1});
  EXPECT_EQ(c.failures.at(0).a, 0U);
}

TEST(Verify, FindsADipBetweenAllSamples) {
  // Over alpha the two edges shrink to nothing at 300001 and 300400 of 2^20 and grow again on the other side, so the
  // Jacobian is negative just between: samples at multiples of 1/256 are all positive.
  const double steps = 0x1p20, first = 300001, second = 300400;
  Cage parts;
  parts.fibre({0, 0, 0}, {0, 0, 4096});
  parts.fibre({-first, 0, 0}, {steps - first, 0, 4096});
  parts.fibre({0, -second, 0}, {0, steps - second, 4096});
  parts.faces = {{0, 1, 2}};
  for (int k = 0; k <= 256; ++k) {
    const double at = steps * k / 256;
    EXPECT_GT((at - first) * (at - second), 0);
  }
  const Certificate c = reported("the Jacobian dips below zero between 257 even samples of alpha", parts.check());
  EXPECT_EQ(broken(c), std::set{Condition::C1});
  EXPECT_EQ(c.failure_count[1], 1U);

  parts.inner[2] = {0, -first, 0};  // both at once: the Jacobian touches zero
  parts.outer[2] = {0, steps - first, 4096};
  EXPECT_EQ(broken(reported("the Jacobian touches zero in one place", parts.check())), std::set{Condition::C1});
}

/// Ten slabs around fibre 0, each turning by `turn`; closed when the last ends where the first begins.
Cage star(double turn, bool closed) {
  Cage parts;
  parts.fibre({0, 0, 0}, {0, 0, 64});
  const int count = closed ? 10 : 11;
  for (int k = 0; k < count; ++k) {
    // Each arm is longer than the one before, so no two ends coincide when the star winds twice.
    const double x = std::round((4096 + 64 * k) * std::cos(turn * k)),
                 y = std::round((4096 + 64 * k) * std::sin(turn * k));
    parts.fibre({x, y, 0}, {x, y, 64});
  }
  for (std::uint32_t k = 1; k <= 10; ++k) parts.faces.push_back({0, k, closed && k == 10 ? 1 : k + 1});
  return parts;
}

TEST(Verify, FindsAStarWoundTwice) {
  const double circle = 2 * std::numbers::pi;
  EXPECT_SOUND(star(circle / 10, true).check());
  const Certificate c = reported("ten slabs wind twice around their fibre", star(2 * circle / 10, true).check());
  EXPECT_EQ(broken(c), std::set{Condition::C2});
  EXPECT_EQ(c.failures.at(0).a, 0U) << "the fibre";
}

TEST(Verify, FindsAnOpenStarThatCloses) {
  const double circle = 2 * std::numbers::pi;
  EXPECT_SOUND(star(circle / 10.5, false).check());
  const Certificate c = reported("an open fan of slabs reaches around into itself", star(circle / 9.5, false).check());
  EXPECT_EQ(broken(c), std::set{Condition::C2});
}

TEST(Verify, FindsSheetsPushedIntoEachOther) {
  Cage parts = snapped(*testing::plane_shell(2, 1), kBits);
  const auto first = static_cast<std::uint32_t>(parts.faces.size());
  parts.add(snapped(*testing::plane_shell(2, 1), kBits), {0.25, 0.5, 0.25});
  EXPECT_SOUND(parts.check());
  for (std::size_t f = 9; f < parts.inner.size(); ++f)
    if (parts.inner[f][0] < 0.5) parts.inner[f][1] = 0;
  const Certificate c = reported("two sheets of slabs are pushed into each other", parts.check());
  EXPECT_EQ(broken(c), std::set{Condition::C3});
  for (const Failure& f : c.failures) EXPECT_TRUE(f.a < first && f.b >= first) << f.what;
}

TEST(Verify, TouchingCountsAsMeeting) {
  Cage parts = plate({0, 0, 0}, {8, 0, 0}, {0, 8, 0});
  parts.add(plate({2, 2, 2}, {8, 2, 2}, {2, 8, 2}));
  EXPECT_SOUND(parts.check());
  parts.inner[3] = {2, 2, 1};  // one corner on the face below
  EXPECT_EQ(broken(reported("one corner touches the face of another slab", parts.check())), std::set{Condition::C3});
}

TEST(Verify, CoplanarTrianglesAreComparedInTheirPlane) {
  Cage beside = plate({0, 0, 0}, {8, 0, 0}, {0, 8, 0});
  beside.add(plate({8, 8, 0}, {1, 8, 0}, {8, 1, 0}));  // boxes overlap, triangles do not
  EXPECT_SOUND(beside.check());

  Cage across = plate({0, 0, 0}, {8, 0, 0}, {0, 8, 0});
  across.add(plate({8, 8, 0}, {-1, 8, 0}, {8, -1, 0}));
  const Certificate c = reported("triangles of two slabs cross in one plane", across.check());
  EXPECT_EQ(broken(c), std::set{Condition::C3});
  EXPECT_EQ(c.failure_count[3], 2U) << "inner and outer";

  Cage within = plate({0, 0, 0}, {80, 0, 0}, {0, 80, 0});
  within.add(plate({10, 10, 0}, {20, 10, 0}, {10, 20, 0}));
  EXPECT_EQ(broken(reported("a triangle lies within another in one plane", within.check())), std::set{Condition::C3});
}

TEST(Verify, ComparesInnerWithOuterTriangles) {
  Cage parts = plate({0, 0, 0}, {8, 0, 0}, {0, 8, 0});
  parts.add(plate({0, 0, 1}, {8, 0, 1}, {0, 8, 1}));  // its inner triangle is the outer one of the first
  const Certificate c = reported("the inner triangle of a slab is the outer one of another", parts.check());
  EXPECT_EQ(broken(c), std::set{Condition::C3});
  EXPECT_EQ(c.failure_count[3], 1U);
}

TEST(Verify, FindsAPartInsideAnothersShell) {
  Cage parts = cube_cage(1, 9);
  parts.add(cube_cage(0.5, 1), {5, 0, 0});
  const Certificate c = reported("a part stands between the inner and outer triangles of another", parts.check());
  EXPECT_EQ(broken(c), std::set{Condition::C4});
  EXPECT_EQ(c.failures.at(0).a, 12U);
  EXPECT_EQ(c.failures.at(0).b, 0U);
}

TEST(Verify, FindsShellsThatInterleave) {
  Cage parts = cube_cage(1, 3);  // no surface of one meets a surface of the other, yet the shells overlap
  parts.add(cube_cage(2, 4));
  EXPECT_EQ(broken(reported("two shells interleave though no triangles of theirs meet", parts.check())),
            std::set{Condition::C4});
}

TEST(Verify, FindsInnerAndOuterSwapped) {
  Cage parts = sphere();
  std::swap(parts.inner, parts.outer);
  const Certificate c = reported("inner and outer ends are swapped", parts.check());
  EXPECT_EQ(broken(c), std::set{Condition::C1});
  EXPECT_EQ(c.failure_count[1], parts.faces.size());
}

// No shell has this fault alone: where C0, C1 and C2 hold and no two triangles meet, both volumes have the same sign.
TEST(Verify, FindsVolumesOfDifferentSigns) {
  Cage parts = sphere();
  for (std::size_t f = 0; f < parts.inner.size(); ++f)
    for (std::size_t k = 0; k < 3; ++k) {
      parts.outer[f][k] = std::round(parts.outer[f][k] * 1024) / 1024;
      parts.inner[f][k] = -0.5 * parts.outer[f][k];
    }
  parts.add(sphere(), {4, 0, 0});
  const auto wrong = static_cast<std::uint32_t>(sphere().faces.size());
  const Certificate c = reported("all fibres run through the centre and on to half as far beyond it", parts.check());
  EXPECT_EQ(broken(c), (std::set{Condition::C1, Condition::C3}));
  EXPECT_FALSE(c.holds[3]);
  EXPECT_EQ(c.failure_count[3], 1U);
  EXPECT_EQ(c.failures.back().what, "the part with slab 0 has inner and outer volumes of different signs");
  EXPECT_EQ(c.failing(Condition::C3), numbers(0, wrong));
}

TEST(Verify, PassesShellsTurnedInsideOut) {
  Cage parts = sphere();  // both volumes are negative, and the slabs as sound as before
  std::swap(parts.inner, parts.outer);
  for (Face& f : parts.faces) std::swap(f[1], f[2]);
  EXPECT_SOUND(parts.check());
}

TEST(Verify, FindsFaultsOfTheComplex) {
  const auto only_c0 = [](std::string_view way, const Cage& parts, std::uint32_t slab, const char* word) {
    const Certificate c = reported(way, parts.check());
    EXPECT_EQ(broken(c), std::set{Condition::C0});
    for (std::size_t k = 0; k < 5; ++k) EXPECT_FALSE(c.holds[k]);
    ASSERT_FALSE(c.failures.empty());
    EXPECT_EQ(c.failures[0].a, slab) << c.failures[0].what;
    EXPECT_NE(c.failures[0].what.find(word), std::string::npos) << c.failures[0].what;
  };
  Cage repeated = tetrahedron();
  repeated.faces[3] = repeated.faces[0];
  only_c0("a slab stands twice", repeated, 0, "same three");

  Cage reversed = tetrahedron();
  std::swap(reversed.faces[0][1], reversed.faces[0][2]);
  only_c0("one slab runs the other way round", reversed, 0, "same way");

  Cage twice = tetrahedron();
  twice.faces[2][1] = twice.faces[2][0];
  only_c0("a slab names one fibre twice", twice, 2, "twice");

  Cage range = tetrahedron();
  range.faces[1][2] = 4;
  only_c0("a slab names a fibre that is not there", range, 1, "fibre 4");

  Cage book = plate({0, 0, 0}, {8, 0, 0}, {0, 8, 0});
  book.fibre({8, 8, 0}, {8, 8, 1});
  book.fibre({9, 9, 0}, {9, 9, 1});
  book.faces.push_back({2, 1, 3});
  book.faces.push_back({2, 1, 4});
  only_c0("three slabs share one wall", book, 0, "3 slabs");

  Cage bow = plate({0, 0, 0}, {8, 0, 0}, {0, 8, 0});  // two slabs that share one fibre and no wall
  bow.fibre({-8, 0, 0}, {-8, 0, 1});
  bow.fibre({0, -8, 0}, {0, -8, 1});
  bow.faces.push_back({0, 3, 4});
  only_c0("two slabs share a fibre and no wall", bow, 0, "one fan");

  Cage unused = tetrahedron();
  unused.fibre({0, 0, 0}, {0, 0, 0.125});
  only_c0("a fibre belongs to no slab", unused, kNothing, "no slab");

  Cage pinched = tetrahedron();
  pinched.inner[3] = pinched.outer[3];
  only_c0("a fibre has no length", pinched, 1, "length");

  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    Cage wrong = tetrahedron();
    wrong.outer[2][1] = bad;
    only_c0(std::isnan(bad) ? "a coordinate is not a number" : "a coordinate is infinite", wrong, 0, "finite");
  }

  Cage uneven = tetrahedron();
  uneven.inner[0][0] = 0.1;
  only_c0("a coordinate lies on no lattice of 2^30 steps", uneven, kNothing, "lattice");

  Cage short_one = tetrahedron();
  short_one.outer.pop_back();
  only_c0("there are fewer outer ends than inner ones", short_one, kNothing, "ends");
  only_c0("there are no slabs", Cage{}, kNothing, "no slabs");
}

TEST(Verify, CountsAllFailuresButListsAHundred) {
  Cage parts;
  for (int k = 0; k < 150; ++k) parts.add(plate({0, 0, 0}, {8, 0, 0}, {0, 8, 0}), {10.0 * k, 0, 0});
  std::swap(parts.inner, parts.outer);
  const Certificate c = parts.check();
  EXPECT_EQ(c.failure_count[1], 150U);
  EXPECT_FALSE(c.at_least[1]);
  EXPECT_EQ(c.failures.size(), 100U);
  EXPECT_EQ(c.failing(Condition::C1), numbers(0, 150));
  EXPECT_TRUE(c.failing(Condition::C3).empty());
  // Those of one condition leave room for those of another.
  parts.add(plate({-100, 0, 0}, {-90, 0, 0}, {-90, 10, 0}));
  parts.add(plate({-95, 1, -5}, {-95, 2, -5}, {-95, 2, 5}));
  const Certificate both = parts.check();
  EXPECT_EQ(both.failing(Condition::C3), numbers(150, 152));
  EXPECT_EQ(std::ranges::count(both.failures, Condition::C3, &Failure::condition),
            static_cast<std::ptrdiff_t>(both.failure_count[3]));
}

TEST(Verify, NamesAllSlabsOfAFault) {
  Cage pinched = cube_cage(0.5, 1);
  pinched.inner[7] = pinched.outer[7];
  std::vector<std::uint32_t> around;
  for (std::uint32_t s = 0; s < pinched.faces.size(); ++s)
    if (std::ranges::count(pinched.faces[s], 7U) > 0) around.push_back(s);
  EXPECT_EQ(pinched.check().failing(Condition::C0), around);

  Cage nested = cube_cage(1, 9);
  nested.add(cube_cage(0.5, 1), {5, 0, 0});
  EXPECT_EQ(nested.check().failing(Condition::C4), numbers(0, 24));
}

// Beyond what is counted, slabs are only looked at until they fail; each that does must be named all the same.
TEST(Verify, NamesEverySlabHoweverManyMeet) {
  Cage parts;
  const auto upright = [](double x, double y, double turn) {
    return plate({x, y, 0}, {x + 8, y + turn, 0}, {x + 8, y + turn, 8}, 0.5);
  };
  const auto add_upright = [&](double x, double y, double turn) {
    Cage one = upright(x, y, turn);
    for (std::size_t f = 0; f < 3; ++f) {  // thick to the left of its run
      const Point p = one.inner[f];
      one.outer[f] = {p[0] + turn / 64, p[1] - 0.125, p[2]};
    }
    parts.add(one);
  };
  constexpr std::uint32_t kSheaf = 120, kPairs = 30, kAlone = 10;
  for (std::uint32_t k = 0; k < kSheaf; ++k) add_upright(0, k * 0.0625, 8 - k * 0.125);  // all across each other
  std::vector<std::uint32_t> failing = numbers(0, kSheaf);
  for (std::uint32_t k = 0; k < kPairs + kAlone; ++k) {
    const auto at = static_cast<std::uint32_t>(parts.faces.size());
    add_upright(100 + 20 * k, 0, 4);
    if (k >= kPairs) continue;
    add_upright(100 + 20 * k, 4, -4);
    failing.push_back(at);
    failing.push_back(at + 1);
  }
  const Certificate c = parts.check();
  EXPECT_TRUE(c.holds[1]);
  EXPECT_TRUE(c.at_least[3]);
  EXPECT_GE(c.failure_count[3], 10000U);
  EXPECT_LT(c.failure_count[3], 4U * kSheaf * kSheaf / 2);
  EXPECT_EQ(c.failing(Condition::C3), failing);
}

}  // namespace
}  // namespace relief::verify
