// Shells and sources broken at random: the verifier and a slow, plain referee say the same.
#include "referee.h"

#include "cages.h"

#include <relief/verify/verify.h>

#include <gtest/gtest.h>
#include <support/shells.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <numbers>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace relief::verify {
namespace {

Point plus(const Point& a, const Point& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
Point times(const Point& a, double s) { return {a[0] * s, a[1] * s, a[2] * s}; }
Point between(const Point& a, const Point& b, double t) { return plus(times(a, 1 - t), times(b, t)); }
double dot(const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
double length(const Point& a) { return std::sqrt(dot(a, a)); }
Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// Random numbers, without the standard's distributions, which are not the same in all libraries.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : numbers_(seed) {}

  std::uint32_t below(std::size_t n) { return static_cast<std::uint32_t>(numbers_() % n); }
  bool one_in(std::size_t n) { return below(n) == 0; }
  double from_to(double low, double high) {
    return low + (high - low) * std::ldexp(static_cast<double>(numbers_() >> 11U), -53);
  }
  /// From a millionth to two, which is a shell's size; of each magnitude as often, or great ones only.
  double scale() { return std::pow(10.0, from_to(one_in(2) ? -6 : -0.7, 0.3)); }
  Point direction() {
    for (;;) {
      const Point p = {from_to(-1, 1), from_to(-1, 1), from_to(-1, 1)};
      const double size = length(p);
      if (size > 0.1 && size < 1) return times(p, 1 / size);
    }
  }
  Point vector(double shortest, double longest) {
    const Point way = direction();
    return times(way, from_to(shortest, longest));
  }
  Point move() {
    const Point way = direction();
    return times(way, scale());
  }

 private:
  std::mt19937_64 numbers_;
};

Point along(const Cage& cage, std::size_t f) { return plus(cage.outer[f], times(cage.inner[f], -1)); }
/// Whether a slab has both fibres.
bool share_a_slab(const Cage& cage, std::uint32_t f, std::uint32_t g) {
  return std::any_of(cage.faces.begin(), cage.faces.end(), [&](const Face& face) {
    return std::count(face.begin(), face.end(), f) > 0 && std::count(face.begin(), face.end(), g) > 0;
  });
}

/// Each slab cut into four at the middles of its edges.
Cage cut(const Cage& cage) {
  Cage finer = cage;
  finer.faces.clear();
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
  const auto middle = [&](std::uint32_t a, std::uint32_t b) {
    const auto [at, fresh] = middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(finer.inner.size()));
    if (fresh) finer.fibre(between(cage.inner[a], cage.inner[b], 0.5), between(cage.outer[a], cage.outer[b], 0.5));
    return at->second;
  };
  for (const auto& [a, b, c] : cage.faces) {
    const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    finer.faces.insert(finer.faces.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
  }
  return finer;
}

/// Between a box and one of half its size; eight triangles at a time lie in one plane.
Cage box() {
  Cage cage = cube_cage(0.5, 1);
  cage.move([](const Point& p) { return Point{p[0], p[1], 0.5 * p[2]}; });
  return cut(cage);
}

Cage bumpy_ball() {
  Cage ball = cage_of(*testing::sphere_shell(2, 1, 0.6, 1.1));
  for (std::size_t f = 0; f < ball.inner.size(); ++f) {
    const Point& p = ball.outer[f];
    const double bump = 1 + 0.15 * std::sin(4 * p[0] + 1) * std::cos(3 * p[1]) + 0.1 * p[2];
    ball.inner[f] = times(ball.inner[f], bump);
    ball.outer[f] = times(ball.outer[f], bump);
  }
  return ball;
}

Cage slab_alone() {
  Cage cage;
  cage.fibre({0, 0, 0}, {0, 0, 0.5});
  cage.fibre({1, 0, 0}, {1, 0, 0.5});
  cage.fibre({0, 1, 0}, {0, 1, 0.5});
  cage.faces = {{0, 1, 2}};
  return cage;
}

/// Sound ones of a size of about one; the first four are closed.
constexpr std::size_t kClosed = 4;
const std::vector<Cage>& bases() {
  static const std::vector<Cage> all = {cage_of(*testing::sphere_shell(1, 1, 0.6, 1.2)), bumpy_ball(),
                                        cage_of(*testing::torus_shell(8, 6, 1)),         box(),
                                        cage_of(*testing::plane_shell(3, 1, 0.2)),       slab_alone()};
  return all;
}

/// One of them between two surfaces of constant alpha.
Cage sound_cage(Dice& dice, std::size_t kinds) {
  Cage cage = bases()[dice.below(kinds)];
  const double low = dice.from_to(0, 0.6), high = dice.from_to(low + 0.2, 1);
  for (std::size_t f = 0; f < cage.inner.size(); ++f) {
    const Point in = cage.inner[f], out = cage.outer[f];
    cage.inner[f] = between(in, out, low);
    cage.outer[f] = between(in, out, high);
  }
  return cage;
}

/// Slabs around one fibre which turn about it so many times, or to either side of so many where the star is open.
Cage star(Dice& dice) {
  const bool closed = !dice.one_in(3);
  const std::uint32_t turns = 1 + dice.below(3), count = 2 * turns + 2 + dice.below(6);
  const double whole = closed ? turns : turns * dice.from_to(0.6, 1.2);
  Cage cage;
  cage.fibre({0, 0, 0}, {0, 0, 0.25});
  for (std::uint32_t k = 0; k < (closed ? count : count + 1); ++k) {
    const double angle = 2 * std::numbers::pi * whole * k / count, radius = dice.from_to(0.5, 1.5);
    const Point p = {radius * std::cos(angle), radius * std::sin(angle), dice.from_to(-0.1, 0.1)};
    cage.fibre(p, plus(p, {0, 0, 0.25}));
  }
  for (std::uint32_t k = 1; k <= count; ++k) cage.faces.push_back({0, k, closed && k == count ? 1 : k + 1});
  return cage;
}

// ---- Ways to break a shell

void move_an_end(Cage& cage, Dice& dice) {
  auto& ends = dice.one_in(2) ? cage.inner : cage.outer;
  Point& p = ends[dice.below(ends.size())];
  p = plus(p, dice.move());
}

void swap_ends(Cage& cage, Dice& dice) {
  const std::uint32_t f = dice.below(cage.inner.size());
  std::swap(cage.inner[f], cage.outer[f]);
}

void put_two_ends_in_one_place(Cage& cage, Dice& dice) {
  const Face& face = cage.faces[dice.below(cage.faces.size())];
  auto& ends = dice.one_in(2) ? cage.inner : cage.outer;
  ends[face[0]] = ends[face[1]];
}

void move_neighbours(Cage& cage, Dice& dice) {
  const std::uint32_t middle = dice.below(cage.inner.size()), which = dice.below(3);
  const Point by = dice.move();
  for (std::uint32_t f = 0; f < cage.inner.size(); ++f) {
    if (!share_a_slab(cage, middle, f)) continue;
    if (which != 0) cage.inner[f] = plus(cage.inner[f], by);
    if (which != 1) cage.outer[f] = plus(cage.outer[f], by);
  }
}

/// The like of it, or another one, moved.
template <typename Move>
void add_a_shell(Cage& cage, Dice& dice, Move&& move) {
  Cage other = dice.one_in(2) ? cage : sound_cage(dice, bases().size());
  other.move(move);
  cage.add(other);
}

void add_a_shell_about_the_same_centre(Cage& cage, Dice& dice) {
  const double scale = dice.one_in(2) ? dice.from_to(0.8, 1.25) : dice.from_to(0.2, 2);
  add_a_shell(cage, dice, [&](const Point& p) { return times(p, scale); });
}

void add_a_small_shell(Cage& cage, Dice& dice) {
  const std::uint32_t f = dice.below(cage.inner.size());
  const double alpha = dice.from_to(-0.5, 1.5), scale = dice.from_to(0.01, 0.1);
  const Point to = between(cage.inner[f], cage.outer[f], alpha);
  add_a_shell(cage, dice, [&](const Point& p) { return plus(times(p, scale), to); });
}

void add_a_shell_beside(Cage& cage, Dice& dice) {
  const Point to = dice.vector(0, 4);
  const double scale = dice.from_to(0.2, 1.6);
  add_a_shell(cage, dice, [&](const Point& p) { return plus(times(p, scale), to); });
}

/// Moved and scaled along two axes only, so that what is flat across the third stays in its planes.
void add_a_shell_in_the_plane(Cage& cage, Dice& dice) {
  const std::uint32_t kept = dice.below(3);
  const double reach = dice.one_in(2) ? 3 : 0.4, scale = dice.one_in(2) ? 1 : dice.from_to(0.1, 1);
  const Point to = {dice.from_to(-reach, reach), dice.from_to(-reach, reach), dice.from_to(-reach, reach)};
  add_a_shell(cage, dice, [&](const Point& p) {
    Point moved = plus(times(p, scale), to);
    moved[kept] = p[kept];
    return moved;
  });
}

/// A lone slab within the column of another, with its ends at any alpha.
void add_a_thorn(Cage& cage, Dice& dice) {
  const Face face = cage.faces[dice.below(cage.faces.size())];
  const double low = dice.from_to(-0.5, 1), high = dice.from_to(low + 0.05, 1.5), small = dice.from_to(0.05, 0.5);
  const auto middle = [&](const std::vector<Point>& ends) {
    return times(plus(ends[face[0]], plus(ends[face[1]], ends[face[2]])), 1.0 / 3);
  };
  const Point in = middle(cage.inner), out = middle(cage.outer);
  Cage thorn;
  for (const std::uint32_t f : face) {
    const Point from = between(in, cage.inner[f], small), to = between(out, cage.outer[f], small);
    thorn.fibre(between(from, to, low), between(from, to, high));
  }
  thorn.faces = {{0, 1, 2}};
  cage.add(thorn);
}

/// A sheet becomes a spiral.
void roll_a_sheet_up(Cage& cage, Dice& dice) {
  cage = cage_of(*testing::plane_shell(6, 1, 0.05));
  const double turns = dice.from_to(0.3, 1.8), apart = dice.from_to(0, 0.4);
  cage.move([&](const Point& p) {
    const double angle = 2 * std::numbers::pi * turns * p[0], radius = 1 - p[1] - apart * turns * p[0];
    return Point{radius * std::sin(angle), -radius * std::cos(angle), p[2]};
  });
}

void flip_a_slab(Cage& cage, Dice& dice) {
  Face& face = cage.faces[dice.below(cage.faces.size())];
  std::swap(face[1], face[2]);
}

void repeat_a_slab(Cage& cage, Dice& dice) {
  Face face = cage.faces[dice.below(cage.faces.size())];
  if (dice.one_in(2)) std::swap(face[0], face[1]);
  cage.faces.push_back(face);
}

void drop_a_slab(Cage& cage, Dice& dice) { cage.faces.erase(cage.faces.begin() + dice.below(cage.faces.size())); }

/// Two fibres become one; the slabs between them go.
void weld_fibres(Cage& cage, Dice& dice) {
  const std::uint32_t last = static_cast<std::uint32_t>(cage.inner.size()) - 1, kept = dice.below(last);
  std::uint32_t gone = kept + 1 + dice.below(last - kept);
  if (dice.one_in(2))
    for (std::uint32_t f = 0; f <= last; ++f)
      if (f > kept && share_a_slab(cage, kept, f)) gone = f;
  for (Face& face : cage.faces)
    for (std::uint32_t& f : face) {
      if (f == gone) f = kept;
      if (f == last && gone != last) f = gone;
    }
  std::swap(cage.inner[gone], cage.inner[last]);
  std::swap(cage.outer[gone], cage.outer[last]);
  cage.inner.pop_back();
  cage.outer.pop_back();
  if (dice.one_in(4)) return;
  std::erase_if(cage.faces, [](const Face& f) { return f[0] == f[1] || f[1] == f[2] || f[2] == f[0]; });
}

/// All of it, or its inner ends only.
void stretch(Cage& cage, Dice& dice) {
  std::array<Point, 3> rows{};
  const double strength = dice.from_to(0, 1.5);
  for (std::size_t k = 0; k < 3; ++k) {
    rows[k] = dice.vector(0, strength);
    rows[k][k] += 1;
  }
  const auto change = [&](const Point& p) { return Point{dot(rows[0], p), dot(rows[1], p), dot(rows[2], p)}; };
  if (dice.one_in(2)) return cage.move(change);
  for (Point& p : cage.inner) p = change(p);
}

/// The inner ends of a slab turned about its middle and stretched across.
void turn_a_slab(Cage& cage, Dice& dice) {
  const Face& face = cage.faces[dice.below(cage.faces.size())];
  Point middle = {}, axis = {};
  for (const std::uint32_t f : face) {
    middle = plus(middle, times(cage.inner[f], 1.0 / 3));
    axis = plus(axis, along(cage, f));
  }
  axis = times(axis, 1 / std::max(length(axis), 1e-6));
  const double angle = std::numbers::pi * dice.from_to(0.02, 1.5), wide = dice.from_to(0.2, 1);
  const Point across = dice.direction();
  for (const std::uint32_t f : face) {
    const Point from = plus(cage.inner[f], times(middle, -1)), up = times(axis, dot(axis, from));
    const Point flat = plus(from, times(up, -1));
    Point turned = plus(times(flat, std::cos(angle)), times(cross(axis, flat), std::sin(angle)));
    turned = plus(turned, times(across, (wide - 1) * dot(across, turned)));
    cage.inner[f] = plus(middle, plus(up, turned));
  }
}

/// Every fibre goes on through the same place, where the Jacobians touch zero.
void run_through_the_middle(Cage& cage, Dice& dice) {
  const double beyond = dice.one_in(2) ? 0.5 : 1;
  cage.snap(2);
  for (std::size_t f = 0; f < cage.inner.size(); ++f) cage.inner[f] = times(cage.outer[f], -beyond);
}

void turn_inside_out(Cage& cage, Dice& /*dice*/) {
  std::swap(cage.inner, cage.outer);
  for (Face& f : cage.faces) std::swap(f[1], f[2]);
}

void wind_a_star(Cage& cage, Dice& dice) { cage = star(dice); }

void change_nothing(Cage& /*cage*/, Dice& /*dice*/) {}

struct Way {
  const char* what;
  void (*change)(Cage& cage, Dice& dice);
  bool may_stay_sound, may_break;
};
constexpr std::array kWays = {
    Way{"nothing is changed", change_nothing, true, false},
    Way{"one end of a fibre is moved", move_an_end, true, true},
    Way{"the ends of a fibre are swapped", swap_ends, false, true},
    Way{"two ends are put in one place", put_two_ends_in_one_place, false, true},
    Way{"neighbouring fibres are moved", move_neighbours, true, true},
    Way{"a second shell stands about the same centre", add_a_shell_about_the_same_centre, true, true},
    Way{"a small shell stands on a fibre", add_a_small_shell, true, true},
    Way{"a second shell stands beside it", add_a_shell_beside, true, true},
    Way{"a second shell stands in the same planes", add_a_shell_in_the_plane, true, true},
    Way{"a lone slab stands in a column", add_a_thorn, true, true},
    Way{"a sheet is rolled up", roll_a_sheet_up, true, true},
    Way{"a slab runs the other way round", flip_a_slab, false, true},
    Way{"a slab stands twice", repeat_a_slab, false, true},
    Way{"a slab is left out", drop_a_slab, true, true},
    Way{"two fibres are welded", weld_fibres, true, true},
    Way{"the shell or its inner side is stretched", stretch, true, true},
    Way{"the inner triangle of a slab is turned", turn_a_slab, true, true},
    Way{"the fibres run through the middle", run_through_the_middle, false, true},
    Way{"the shell is turned inside out", turn_inside_out, true, false},
    Way{"slabs wind around a fibre", wind_a_star, true, true},
};

int rounds(int normally) { return std::getenv("RELIEF_SOAK") != nullptr ? 20 * normally : normally; }

std::set<std::uint32_t> failing(const Certificate& c, Condition condition) {
  const std::vector<std::uint32_t> slabs = c.failing(condition);
  return {slabs.begin(), slabs.end()};
}

/// How often something held and did not.
struct Tally {
  int held = 0, failed = 0;

  void expect(const char* what, bool may_hold, bool may_fail) const {
    EXPECT_EQ(held > 0, may_hold) << what << ": " << held;
    EXPECT_EQ(failed > 0, may_fail) << what << ": " << failed;
  }
};

TEST(VerifyReferee, SaysOfShellsWhatTheVerifierSays) {
  const int count = rounds(500);
  std::array<Tally, kWays.size()> tallies;
  std::array<int, kShellConditionCount> found{};  // broken by this condition, and by none before it
  int undecided = 0, dips = 0, differs = 0;
  for (int round = 0; round < count; ++round) {
    Dice dice(static_cast<std::uint64_t>(round));
    const std::size_t way = static_cast<std::size_t>(round) % kWays.size();
    SCOPED_TRACE("seed " + std::to_string(round) + ": " + kWays[way].what);
    Cage cage = sound_cage(dice, bases().size());
    // What lies on a coarse lattice touches often.
    const std::array<int, 5> lattices = {20, 16, 12, 8, 4};
    const bool to_be_sound = !kWays[way].may_break;
    const int bits = lattices[dice.below(to_be_sound ? 4 : 5)];
    cage.snap(bits);
    kWays[way].change(cage, dice);
    const bool twice = !to_be_sound && dice.one_in(5);
    if (twice && !cage.faces.empty()) kWays[dice.below(kWays.size())].change(cage, dice);
    cage.snap(bits);

    const Certificate c = check(cage.view());
    const Verdict verdict = judge(cage.view());
    if (verdict.undecided) {
      ++undecided;
      continue;
    }
    for (std::size_t k = 0; k < kShellConditionCount; ++k)
      EXPECT_EQ(c.holds[k], verdict.holds[k]) << name(static_cast<Condition>(k));
    for (const Condition condition : {Condition::C1, Condition::C2, Condition::C3, Condition::C4}) {
      if (!verdict.holds[0] || (condition == Condition::C4 && verdict.parts > 2)) continue;
      EXPECT_EQ(failing(c, condition), verdict.slabs[static_cast<std::size_t>(condition)]) << name(condition);
    }
    if (c.holds[0] && c.holds[1] && c.holds[2]) {
      EXPECT_FALSE(verdict.covers_twice) << "these triangles are not compared";
      EXPECT_FALSE(verdict.differs) << "this is never the only fault";
    }
    if (HasFailure()) return;

    const auto first = std::find(verdict.holds.begin(), verdict.holds.end(), false);
    if (first != verdict.holds.end()) ++found[static_cast<std::size_t>(first - verdict.holds.begin())];
    if (verdict.dips) ++dips;
    if (verdict.differs) ++differs;
    if (!twice) ++(c.all() ? tallies[way].held : tallies[way].failed);
  }
  for (std::size_t way = 0; way < kWays.size(); ++way)
    tallies[way].expect(kWays[way].what, kWays[way].may_stay_sound, kWays[way].may_break);
  for (std::size_t k = 0; k < kShellConditionCount; ++k) EXPECT_GT(found[k], 0) << name(static_cast<Condition>(k));
  EXPECT_GT(dips, 0);
  EXPECT_GT(differs, 0);
  EXPECT_LT(undecided, count / 20);
}

// ---- Ways to break a source

/// Four triangles to a slab, near the middle of its fibres.
Surface surface_in(const Cage& cage, Dice& dice) {
  const Cage finer = cut(cage);
  Surface surface{{}, finer.faces};
  for (std::size_t f = 0; f < finer.inner.size(); ++f)
    surface.points.push_back(between(finer.inner[f], finer.outer[f], dice.from_to(0.48, 0.52)));
  return surface;
}

/// The ends of a fibre at a random place of a random slab.
std::array<Point, 2> some_fibre(const Cage& cage, Dice& dice) {
  const Face& f = cage.faces[dice.below(cage.faces.size())];
  const double a = dice.from_to(0, 1), b = dice.from_to(0, 1 - a);
  const auto at = [&](const std::vector<Point>& ends) {
    return plus(times(ends[f[0]], 1 - a - b), plus(times(ends[f[1]], a), times(ends[f[2]], b)));
  };
  return {at(cage.inner), at(cage.outer)};
}

/// In the shell, or close to it.
Point some_point(const Cage& cage, Dice& dice) {
  const auto [in, out] = some_fibre(cage, dice);
  return between(in, out, dice.from_to(-0.5, 1.5));
}

void move_a_vertex(Surface& surface, Cage& /*cage*/, Dice& dice) {
  Point& p = surface.points[dice.below(surface.points.size())];
  p = plus(p, dice.move());
}

void flip_a_triangle(Surface& surface, Cage& /*cage*/, Dice& dice) {
  Face& f = surface.faces[dice.below(surface.faces.size())];
  std::swap(f[0], f[1]);
}

void drop_a_triangle(Surface& surface, Cage& /*cage*/, Dice& dice) {
  surface.faces.erase(surface.faces.begin() + dice.below(surface.faces.size()));
}

void repeat_a_triangle(Surface& surface, Cage& /*cage*/, Dice& dice) {
  surface.faces.push_back(surface.faces[dice.below(surface.faces.size())]);
}

void add_a_sheet(Surface& surface, Cage& cage, Dice& dice) {
  const Point at = some_point(cage, dice);
  const double size = dice.from_to(0.05, 0.5);
  const Surface sheet{{at, plus(at, times(dice.direction(), size)), plus(at, times(dice.direction(), size))},
                      {{0, 1, 2}}};
  surface.add(sheet);
}

/// A closed one.
void add_a_crumb(Surface& surface, Cage& cage, Dice& dice) {
  const Point at = some_point(cage, dice);
  const double size = dice.from_to(0.01, 0.1);
  Surface crumb;
  for (const Point& p : {Point{1, 1, 1}, Point{-1, -1, 1}, Point{-1, 1, -1}, Point{1, -1, -1}})
    crumb.points.push_back(plus(at, times(p, size)));
  crumb.faces = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  surface.add(crumb);
}

void shrink(Surface& surface, Cage& /*cage*/, Dice& dice) {
  const double change = dice.scale(), by = dice.one_in(2) ? 1 + change : 1 - change;
  for (Point& p : surface.points) p = times(p, by);
}

void shift(Surface& surface, Cage& /*cage*/, Dice& dice) {
  const Point by = dice.move();
  for (Point& p : surface.points) p = plus(p, by);
}

/// A hill rises from a wide surface in thick slabs, and leans over.
void raise_a_hill(Surface& surface, Cage& cage, Dice& dice) {
  cage = cage_of(*testing::sphere_shell(0, 1, 0.4, 1.4));
  const Cage finer = cut(cut(cut(cage)));
  const std::uint32_t top = dice.below(finer.inner.size());
  const Point centre = between(finer.inner[top], finer.outer[top], 0.5);
  const double height = dice.from_to(0.1, 0.4), width = dice.from_to(0.2, 0.4);
  const Point up = along(finer, top), aside = cross(up, dice.direction());
  const Point lean = times(aside, width * dice.from_to(0, 2) / length(aside));
  surface = {{}, finer.faces};
  for (std::size_t f = 0; f < finer.inner.size(); ++f) {
    const Point from_centre = plus(between(finer.inner[f], finer.outer[f], 0.5), times(centre, -1));
    const double share = std::exp(-dot(from_centre, from_centre) / (width * width));
    const Point on_fibre = between(finer.inner[f], finer.outer[f], 0.5 + height * share);
    surface.points.push_back(plus(on_fibre, times(lean, share)));
  }
}

void leave_it(Surface& /*surface*/, Cage& /*cage*/, Dice& /*dice*/) {}

struct SourceWay {
  const char* what;
  void (*change)(Surface& surface, Cage& cage, Dice& dice);
  bool may_hold, may_break;
};
constexpr std::array kSourceWays = {
    SourceWay{"nothing is changed", leave_it, true, false},
    SourceWay{"a vertex is moved", move_a_vertex, true, true},
    SourceWay{"a triangle runs the other way round", flip_a_triangle, false, true},
    SourceWay{"a triangle is left out", drop_a_triangle, false, true},
    SourceWay{"a triangle stands twice", repeat_a_triangle, false, true},
    SourceWay{"a sheet is added", add_a_sheet, false, true},
    SourceWay{"a closed crumb is added", add_a_crumb, false, true},
    SourceWay{"the source shrinks or grows", shrink, true, true},
    SourceWay{"the source is shifted", shift, true, true},
    SourceWay{"a hill leans over", raise_a_hill, true, true},
};

/// Whether one of so many fibres, at random places of random slabs, clearly meets the source other than once and
/// outwards.
bool some_fibre_differs(const Cage& cage, const Surface& surface, Dice& dice, int fibres) {
  const Meetings meetings(surface.view());
  for (int k = 0; k < fibres; ++k) {
    const auto [in, out] = some_fibre(cage, dice);
    const auto met = meetings.count(in, out);
    if (met.has_value() && (met->outwards != 1 || met->inwards != 0)) return true;
  }
  return false;
}

TEST(VerifyReferee, SaysOfSourcesWhatTheVerifierSays) {
  constexpr int kFibres = 2000;
  const int count = rounds(200);
  std::array<Tally, kSourceWays.size()> tallies;
  int seen = 0, folded = 0;      // by the fibres; by these and C6 alone, though no triangle is out of place
  int near = 0;                  // within the margin of C5, or without area
  std::array<int, 3> refused{};  // by C5, C6 and C7
  for (int round = 0; round < count; ++round) {
    Dice dice(static_cast<std::uint64_t>(round));
    const std::size_t way = static_cast<std::size_t>(round) % kSourceWays.size();
    SCOPED_TRACE("seed " + std::to_string(round) + ": " + kSourceWays[way].what);
    Cage cage = sound_cage(dice, kClosed);
    Surface surface = surface_in(cage, dice);
    kSourceWays[way].change(surface, cage, dice);
    const int bits = 14 + static_cast<int>(dice.below(7));
    cage.snap(bits);
    for (Point& p : surface.points) p = rounded(p, bits);

    const Certificate c = check(cage.view(), surface.view());
    for (std::size_t k = 0; k < kShellConditionCount; ++k) ASSERT_TRUE(c.holds[k]);
    const bool differs = some_fibre_differs(cage, surface, dice, kFibres);
    EXPECT_FALSE(differs && c.all());
    // C5 also fails where the source comes within the margin, and not all failures are listed.
    const bool is_near = std::any_of(c.failures.begin(), c.failures.end(),
                                     [](const Failure& f) { return f.what.find("comes within") != std::string::npos; });
    const auto met = slabs_met(cage.view(), surface.view());
    const std::set<std::uint32_t> named = failing(c, Condition::C5);
    if (is_near || !met.has_value()) {
      ++near;
    } else if (c.failure_count[5] <= 100) {
      EXPECT_EQ(named, *met);
    } else {
      EXPECT_TRUE(std::includes(named.begin(), named.end(), met->begin(), met->end()));
    }
    if (HasFailure()) return;
    if (differs) ++seen;
    if (differs && kSourceWays[way].may_hold && c.holds[5] && !c.holds[6] && c.holds[7]) ++folded;
    for (std::size_t k = 0; k < 3; ++k)
      if (!c.holds[k + 5]) ++refused[k];
    ++(c.all() ? tallies[way].held : tallies[way].failed);
  }
  for (std::size_t way = 0; way < kSourceWays.size(); ++way)
    tallies[way].expect(kSourceWays[way].what, kSourceWays[way].may_hold, kSourceWays[way].may_break);
  for (std::size_t k = 0; k < 3; ++k) EXPECT_GT(refused[k], 0) << name(static_cast<Condition>(k + 5));
  EXPECT_GT(seen, count / 4);
  EXPECT_GT(folded, 0);
  EXPECT_LT(near, count / 20);
}

}  // namespace
}  // namespace relief::verify
