#include "room_support.h"

#include <relief/convert/convert.h>
#include <relief/convert/refine.h>
#include <relief/convert/room.h>
#include <relief/convert/room/fibre_lengthening.h>
#include <relief/convert/room/reach_wanted.h>
#include <relief/convert/room/solids.h>
#include <relief/convert/room/surface_resampling.h>
#include <relief/core/detail.h>
#include <relief/core/query.h>
#include <relief/edit/editor.h>
#include <relief/mesh/samples.h>

#include <gtest/gtest.h>
#include <support/fibre_maps.h>
#include <support/longer_fibres.h>
#include <support/shells.h>
#include <support/taps.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <numbers>
#include <numeric>
#include <random>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

namespace relief {
namespace {

constexpr double kDiagonal = 3.4;  // of the ball's bounding box
constexpr double kTold = 0.05;     // in radii: what tools may miss by untold
constexpr double kMoved = 0.025;   // in radii: and by so much the surface may move beside that

/// Fibres near its equator lean by 45 degrees, or by more, by the tangent.
std::shared_ptr<const SlabMesh> leaning_ball(double tangent = 1, int n = 16) {
  return testing::mapped_shell(*lattice_ball(2, n), [tangent](Vec3d p) {
    constexpr double kStep = 1.0 / (1 << 20);
    const Vec3d q = testing::leaning(tangent)(p);
    return Vec3d{std::round(q.x / kStep) * kStep, std::round(q.y / kStep) * kStep, std::round(q.z / kStep) * kStep};
  });
}

RoomGoals goals() {
  RoomGoals goals;
  goals.diagonal = kDiagonal;
  return goals;
}

struct Place {
  SurfacePoint on;
  double radius, depth;
  [[nodiscard]] Vec3d centre() const { return on.position - on.normal * (depth - radius); }
  [[nodiscard]] RoomWanted cut() const { return {.cut = {{centre(), centre(), radius, on.normal}}, .fill = {}}; }
};
Place place_at(const Snapshot& model, SlabId slab, double radius, double depth) {
  return {surface_point(model, slab, 0.3, 0.3), radius, depth};
}

/// What carving a ball leaves: how many samples ended before it, and how far those that lay in it are from it now.
struct Carved {
  std::size_t limited = 0;
  double most_off = 0;
  SnapshotPtr after = {};
};
Carved carve(const SnapshotPtr& model, const Place& place) {
  Editor editor(model);
  Brush brush;
  brush.detail = 0;  // samples are compared with those before
  brush.radius = place.radius;
  brush.exact = true;
  editor.begin_stroke(brush);
  Dab dab;
  dab.slab = place.on.slab;
  dab.contact = place.on.position;
  dab.cursor = place.on.position - place.on.normal * place.depth;
  dab.normal = place.on.normal;
  Carved carved = {.limited = editor.dab(dab).limited};
  editor.end_stroke();
  const SnapshotPtr after = carved.after = editor.head();
  const SlabMesh& mesh = model->slab_mesh();
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    const int n = mesh.intervals(s);
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i + j <= n; ++i) {
        const Vec3d was = sample_position(*model, s, {i, j});
        if (length(was - place.centre()) >= place.radius) continue;
        const double away = length(sample_position(*after, s, {i, j}) - place.centre());
        carved.most_off = std::max(carved.most_off, std::abs(away - place.radius));
      }
  }
  return carved;
}

/// How far the cut misses its ball, in depths.
double miss_of(const Snapshot& before, const Carved& carved, const Place& place) {
  const testing::Tap tap = {.stroke = {},
                            .low = place.on.position - place.on.normal * place.depth,
                            .normal = place.on.normal,
                            .centre = place.centre(),
                            .radius = place.radius,
                            .depth = place.depth};
  return testing::misses(before, *carved.after, tap).rms / place.depth;
}

/// The room and the snapshot with it, both tested.
std::pair<RoomMade, SnapshotPtr> make(const SnapshotPtr& model, const RoomWanted& wanted,
                                      const RoomGoals& with = goals()) {
  Result<RoomMade> made = make_room(*model, wanted, with);
  EXPECT_TRUE(made) << made.error().message;
  Result<SnapshotPtr> next = with_room(model, *made);
  EXPECT_TRUE(next) << next.error().message;
  expect_sound(**next);
  return {*std::move(made), *std::move(next)};
}

std::set<SlabId> slabs_around(const SlabMesh& mesh, const RoomMade& made) {
  std::set<SlabId> slabs;
  for (const MovedFibre& m : made.moved)
    for (const SlabCorner c : mesh.fan(m.fibre)) slabs.insert(c.slab);
  return slabs;
}

TEST(Room, GivesTheToolItsBall) {
  const SnapshotPtr model = bumpy_ball();
  for (const SlabId slab : {0U, 17U, 50U, 93U, 120U}) {
    SCOPED_TRACE(slab);
    const Place place = place_at(*model, slab, 0.3, 0.25);
    EXPECT_GT(carve(model, place).limited, 0U);
    const auto [made, next] = make(model, place.cut());
    EXPECT_FALSE(made.before.empty());
    EXPECT_TRUE(made.after.empty());
    EXPECT_GT(made.lengthened, 0U);
    const Carved carved = carve(next, place);
    EXPECT_EQ(carved.limited, 0U);
    EXPECT_LT(carved.most_off, 1e-4 * kDiagonal);
  }
}

TEST(Room, LeavesAllElseAsItIs) {
  const SnapshotPtr model = bumpy_ball();
  const Place place = place_at(*model, 17, 0.3, 0.25);
  const auto [made, next] = make(model, place.cut());
  const SlabMesh &was = model->slab_mesh(), &is = next->slab_mesh();
  const std::set<SlabId> touched = slabs_around(was, made);
  std::size_t shared = 0, kept = 0, changed = 0;
  const auto has_moved = [&](FibreId f) { return std::ranges::count(made.moved, f, &MovedFibre::fibre) > 0; };
  for (FibreId f = 0; f < was.fibres().size(); ++f)
    EXPECT_EQ(has_moved(f),
              was.fibres()[f].inner != is.fibres()[f].inner || was.fibres()[f].outer != is.fibres()[f].outer);
  for (SlabId s = 0; s < was.slab_count(); ++s) {
    if (!touched.contains(s)) {
      EXPECT_EQ(model->shared_tile(Layer::Displacement, s), next->shared_tile(Layer::Displacement, s));
      ++shared;
      continue;
    }
    const int n = was.intervals(s);
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i + j <= n; ++i) {
        const std::array<int, 3> w = weights(n, {i, j});
        bool stays = true;
        for (std::size_t k = 0; k < 3; ++k) stays = stays && (w[k] == 0 || !has_moved(was.slabs()[s].fibres[k]));
        const std::size_t index = sample_index(n, {i, j});
        if (stays) {
          EXPECT_EQ(model->displacement(s)[index], next->displacement(s)[index]);
          ++kept;
        } else {
          changed += model->displacement(s)[index] != next->displacement(s)[index];
        }
      }
  }
  EXPECT_GT(shared, 60U);
  EXPECT_GT(kept, 100U);
  EXPECT_GT(changed, 1000U);
  EXPECT_LT(made.surface_moved, 1e-3 * kDiagonal);
}

// Every new sample lies on the triangles of the old surface.
TEST(Room, SamplesTheOldSurface) {
  const SnapshotPtr model = bumpy_ball();
  const Place place = place_at(*model, 50, 0.3, 0.25);
  const auto [made, next] = make(model, place.cut());
  for (const SlabId s : slabs_around(model->slab_mesh(), made)) {
    const int n = next->slab_mesh().intervals(s);
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i + j <= n; ++i) {
        const Vec3d p = sample_position(*next, s, {i, j});
        EXPECT_LT(length(closest_point(*model, p).position - p), 1e-6);
      }
  }
  EXPECT_EQ(folded_in(made.sampled), 0U);
}

TEST(Room, MovesNothingWhereThereIsEnough) {
  const SnapshotPtr model = bumpy_ball();
  const auto [made, next] = make(model, place_at(*model, 17, 0.3, 0.01).cut());
  EXPECT_TRUE(made.moved.empty());
  EXPECT_TRUE(made.tiles.empty());
  EXPECT_TRUE(made.before.empty());
  EXPECT_EQ(next, model);
  const auto [none, same] = make(model, {});
  EXPECT_EQ(same, model);
}

TEST(Room, GivesAirToWhatIsFilled) {
  const SnapshotPtr model = bumpy_ball();
  const SurfacePoint on = surface_point(*model, 17, 0.3, 0.3);
  const Vec3d tip = on.position + on.normal * 0.2;
  const auto [made, next] = make(model, {.cut = {}, .fill = {{on.position, tip, 0.15, on.normal}}});
  EXPECT_FALSE(made.before.empty());
  EXPECT_TRUE(made.after.empty());
  for (const MovedFibre& m : made.moved) {
    const Fibre& was = model->slab_mesh().fibres()[m.fibre];
    EXPECT_GT(length(m.now.outer), length(was.outer));
  }
  // The highest place of the solid is in a slab now.
  LocateHint hint;
  EXPECT_FALSE(locate(model->slab_mesh(), tip + on.normal * 0.14, hint));
  LocateHint other;
  EXPECT_TRUE(locate(next->slab_mesh(), tip + on.normal * 0.14, other));
}

// The first stroke has come to the end of the clay: samples lie on the inner triangles themselves.
TEST(Room, FollowsAStrokeDown) {
  const SnapshotPtr model = bumpy_ball();
  const SurfacePoint on = surface_point(*model, 50, 0.3, 0.3);
  RoomWanted wanted;
  // Told from below: each lies in the one before it, and only the last is at the surface.
  for (int k = 5; k >= 0; --k) {
    const Vec3d centre = on.position - on.normal * (0.05 * k);
    wanted.cut.push_back({centre, centre, 0.06, {}});
  }
  const auto [made, next] = make(model, wanted);
  EXPECT_FALSE(made.before.empty());
  EXPECT_TRUE(made.after.empty());
  LocateHint hint;
  EXPECT_TRUE(locate(next->slab_mesh(), on.position - on.normal * 0.3, hint));
  // Balls that lie in the body and hang together with nothing at the surface are nobody's stroke.
  wanted.cut.resize(3);
  EXPECT_TRUE(make(model, wanted).first.before.empty());
}

// A ball as deep as this has walls: fibres that lean reach it from beside. Upright ones do not.
TEST(Room, TurnsFibresThatHangOverTheTool) {
  const SnapshotPtr model = testing::displaced(leaning_ball(), [](Vec3d) { return 0.5; });
  const Place place = {closest_point(*model, {1, 0.2, 0.1}), 0.2, 0.19};
  const auto [made, next] = make(model, place.cut());
  EXPECT_GT(made.overhang_before, 0.5 * place.radius);
  EXPECT_LT(made.overhang_after, kTold * place.radius);
  EXPECT_TRUE(made.after.empty());
  EXPECT_GT(made.turned, 0U);
}

// Fibres that lean by over 60 degrees, half as long as the slabs are wide: none turns far enough before its neighbours
// do. When all have become short, they turn one after the other, and are long again in the end.
TEST(Room, TurnsFibresThatWouldCrossWhileTheyAreLong) {
  const SnapshotPtr model = testing::displaced(leaning_ball(2, 32), [](Vec3d) { return 0.5; });
  const double below = 0.1;  // each of its fibres
  for (const Vec3d at : {Vec3d{1, 0.2, 0.1}, Vec3d{0.3, 1, -0.1}}) {
    const Place place = {closest_point(*model, at), 0.2, 0.19};
    EXPECT_GT(miss_of(*model, carve(model, place), place), 0.1);
    const auto [made, next] = make(model, place.cut());
    EXPECT_TRUE(made.after.empty());
    EXPECT_LT(made.overhang_after, kTold * place.radius);
    const Carved carved = carve(next, place);
    EXPECT_EQ(carved.limited, 0U);
    EXPECT_LT(miss_of(*model, carved, place), 0.01);
    const auto has_less = [&](const MovedFibre& m) { return 1 - length(m.now.inner) < 0.9 * below; };
    EXPECT_LE(std::ranges::count_if(made.moved, has_less), 2) << "clay for strokes beside this one";
    EXPECT_EQ(make(model, place.cut()).second->content_hash(), next->content_hash());
  }
}

// Here there is clay enough. What a tool takes beside itself is mended only where the surface then moves by no more
// than half of what the tool may miss.
TEST(Room, TurnsWhatOnlyHangsOverAsFarAsTheSurfaceStays) {
  const SnapshotPtr model = testing::displaced(leaning_ball(), [](Vec3d) { return 0.5; });
  const Place place = {closest_point(*model, {1, 0.2, 0.1}), 0.045, 0.042};
  const Result<RoomMade> free = make_room(*model, place.cut(), goals());
  ASSERT_TRUE(free);
  EXPECT_TRUE(free->before.empty()) << "no room is lacking";
  EXPECT_GT(free->overhang_before, kTold * place.radius);
  EXPECT_LT(free->overhang_after, free->overhang_before);
  EXPECT_GT(free->turned, 0U);
  EXPECT_LE(free->surface_moved, kMoved * place.radius);
}

/// Waves as long as a few samples over a ball of leaning fibres: where these turn, the surface moves.
SnapshotPtr wavy_ball(double high) {
  return testing::displaced(leaning_ball(),
                            [high](Vec3d p) { return high + 0.03 * std::sin(30 * p.x) * std::cos(30 * p.y + p.z); });
}

// At one place it moves by 0.018 radii, at another it would by 0.036.
TEST(Room, TurnsNothingWhereTheSurfaceWouldMoveByMoreThanAToolMayMiss) {
  const SnapshotPtr model = wavy_ball(0.5);
  std::vector<std::size_t> turned;
  for (const Vec3d at : {Vec3d{1, 0.2, 0.1}, Vec3d{-0.8, -0.2, 0.5}}) {
    const Place place = {closest_point(*model, at), 0.045, 0.042};
    const Result<RoomMade> made = make_room(*model, place.cut(), goals());
    ASSERT_TRUE(made);
    EXPECT_TRUE(made->before.empty()) << "no room is lacking";
    EXPECT_GT(made->overhang_before, kTold * place.radius);
    EXPECT_LE(made->surface_moved, kMoved * place.radius);
    turned.push_back(made->turned);
  }
  EXPECT_GT(turned[0], 0U);
  EXPECT_EQ(turned[1], 0U);
}

// The same where clay is lacking: what a fine tool misses must not come from the room that was made for it.
TEST(Room, MovesTheSurfaceLittleUnderAFineToolWhereClayIsLackingToo) {
  const SnapshotPtr model = wavy_ball(0.3);
  std::size_t with_room = 0;
  for (int k = 0; k < 12; ++k) {
    const double turn = 0.5 * k;
    const Place place = {closest_point(*model, {std::cos(turn), std::sin(turn), 0.3 * std::cos(5 * turn)}), 0.045,
                         0.042};
    const Result<RoomMade> made = make_room(*model, place.cut(), goals());
    ASSERT_TRUE(made);
    EXPECT_FALSE(made->before.empty()) << "room is lacking";
    EXPECT_LE(made->surface_moved, kMoved * place.radius) << k;
    with_room += made->moved.empty() ? 0 : 1;
  }
  EXPECT_GT(with_room, 0U);
}

// A ball whose middle lies in the body is met from beside by all fibres around its mouth, however they stand.
TEST(Room, SaysHowFarFibresHangOver) {
  const SnapshotPtr model = testing::displaced(leaning_ball(2), [](Vec3d) { return 0.5; });
  const Place place = {closest_point(*model, {1, 0.2, 0.1}), 0.2, 0.3};
  const auto [made, next] = make(model, place.cut());
  EXPECT_GT(made.overhang_after, 0);
  // Whoever asked is told, where it is more than a place may miss its tool by.
  const Result<Room> told = room_maker(kDiagonal)(model, place.cut(), {});
  ASSERT_TRUE(told);
  EXPECT_GT(made.overhang_after, Room::kLeastOverhang * kDiagonal);
  EXPECT_EQ(told->overhang, made.overhang_after);
  EXPECT_EQ(told->overhang_at, made.overhang_at);
  EXPECT_NEAR(length(told->overhang_at), 1, 0.2) << "on the surface of the ball";
  EXPECT_LT(length(told->overhang_at - place.on.position), 2 * place.radius) << "around the mouth";
  EXPECT_EQ(folded_in(told->sampled), folded_in(made.sampled));
  const Result<Room> upright = room_maker(kDiagonal)(bumpy_ball(), place_at(*bumpy_ball(), 17, 0.3, 0.01).cut(), {});
  ASSERT_TRUE(upright);
  EXPECT_EQ(upright->overhang, 0);
}

// A file of an old program does not say it. Then it depends on nothing but the surface, so that who repeats a recording
// that began after other strokes makes the same room.
TEST(Room, WithoutTheDiagonalOfTheSourceThatOfTheCageIsTaken) {
  const SnapshotPtr first = bumpy_ball(), longer = testing::with_longer_fibres(first, 0, 3);
  const RoomMaker maker = room_maker(0);
  const RoomWanted wanted = place_at(*first, 17, 0.3, 0.25).cut();
  const auto hash_of = [&](const RoomMaker& make, const SnapshotPtr& model) {
    const Result<Room> room = make(model, wanted, {});
    return room && room->model ? room->model->content_hash() : 0;
  };
  const auto across = [](const SnapshotPtr& model) { return diagonal(model->slab_mesh().bounds()); };
  ASSERT_NE(hash_of(room_maker(across(first)), longer), 0U);
  ASSERT_NE(hash_of(room_maker(across(first)), longer), hash_of(room_maker(across(longer)), longer));
  for (const SnapshotPtr& model : {first, longer})
    EXPECT_EQ(hash_of(maker, model), hash_of(room_maker(across(model)), model));
}

TEST(Room, IsMadeBelowASurfaceThatHasRunOut) {
  SnapshotDraft draft(bumpy_ball());
  const Vec3d towards = normalized(Vec3d{0.3, 0.5, 0.8});
  const SlabMesh& mesh = draft.base().slab_mesh();
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    const int n = mesh.intervals(s);
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i + j <= n; ++i)
        if (length(sample_position(draft.base(), s, {i, j}) - towards) < 0.25)
          draft.edit(Layer::Displacement, s).plane()[sample_index(n, {i, j})] = 0;
  }
  const SnapshotPtr model = draft.finish();
  ASSERT_TRUE(validate(*model));
  const SurfacePoint on = closest_point(*model, towards);
  ASSERT_EQ(on.alpha, 0);
  const Place place = {on, 0.3, 0.15};
  EXPECT_GT(carve(model, place).limited, 0U);
  const auto [made, next] = make(model, place.cut());
  EXPECT_TRUE(made.after.empty());
  EXPECT_EQ(carve(next, place).limited, 0U);
}

TEST(Room, SaysWhatItCouldNotReach) {
  const SnapshotPtr model = bumpy_ball();
  // Through the whole body and out at the other side.
  const SurfacePoint on = surface_point(*model, 17, 0.3, 0.3);
  const auto [made, next] = make(model, {.cut = {{on.position, -on.position, 0.4, on.normal}}, .fill = {}});
  EXPECT_FALSE(made.after.empty());
  for (const RoomLack& l : made.after) {
    EXPECT_GT(l.lack, 0);
    EXPECT_LT(length(closest_point(*model, l.near).position - l.near), 1e-5) << "a place on the surface";
  }
}

/// A sample, converted.
Model converted(const char* sample, std::size_t triangles, int slabs, int intervals = 16) {
  ConvertSettings settings;
  settings.slabs = slabs;
  settings.intervals = intervals;
  Result<Conversion> made = convert(*make_sample(sample, triangles), settings);
  EXPECT_TRUE(made) << made.error().message;
  return std::move(made->model);
}

/// What bars the way of a wish, and how far from the surface.
RoomBarred bar_of(const SnapshotPtr& model, const RoomWanted& wanted, const RoomGoals& with = goals()) {
  const Result<RoomMade> made = make_room(*model, wanted, with);
  EXPECT_TRUE(made) << made.error().message;
  return room_barred(*model, wanted, *made, with);
}

TEST(Room, TellsAHoleFromFibresThatHaveNoSpace) {
  const SnapshotPtr model = bumpy_ball();
  const SurfacePoint on = surface_point(*model, 17, 0.3, 0.3);
  // Out at the other side of a ball of radius 1, a chord away.
  const RoomWanted through = {.cut = {{on.position, on.position * -1.2, 0.4, normalized(on.position)}}, .fill = {}};
  const auto hole = bar_of(model, through);
  EXPECT_EQ(hole.by, RoomBar::FarSide);
  EXPECT_NEAR(hole.distance, 2 * length(on.position), 0.1);
  EXPECT_LT(length(hole.at - on.position), 1e-6) << "where the stroke goes in";
  // Less than a hole, but past the middle: the other half is the other side's.
  EXPECT_EQ(bar_of(model, {.cut = {{on.position, on.position * -0.2, 0.4, on.normal}}, .fill = {}}).by,
            RoomBar::FarSide);
  // Deep, and far from the other side: fibres that may not be longer bar it.
  RoomGoals with = goals();
  with.longest = 0.075;
  const auto deep = bar_of(model, place_at(*model, 17, 0.3, 0.25).cut(), with);
  EXPECT_EQ(deep.by, RoomBar::Fibres);
  EXPECT_EQ(deep.distance, 0);
  EXPECT_LT(length(deep.at - place_at(*model, 17, 0.3, 0.25).on.position), 0.3) << "under the tool";
  EXPECT_NEAR(length(deep.at), 1, 0.1) << "on the surface";
  // There is room already.
  EXPECT_EQ(bar_of(model, place_at(*model, 17, 0.3, 0.01).cut()).by, RoomBar::None);
}

TEST(Room, TellsAPartThatStandsOpposite) {
  // A ring: a lump across its hole grows into the other side.
  const auto [info, model] = converted("torus", 20000, 300);
  RoomGoals with;
  with.diagonal = info.source_diagonal;
  int told = 0;
  for (SlabId s = 0; s < model->slab_mesh().slab_count(); ++s) {
    const SurfacePoint on = surface_point(*model, s, 0.3, 0.3);
    const auto opposite = raycast(*model, {on.position + on.normal * (1e-3 * with.diagonal), on.normal});
    if (!opposite || dot(opposite->point.normal, on.normal) > 0) continue;
    const Vec3d end = on.position + on.normal * opposite->distance;
    const Result<RoomMade> made =
        make_room(*model, {.cut = {}, .fill = {{on.position, end, 0.15 * with.diagonal, on.normal}}}, with);
    ASSERT_TRUE(made) << made.error().message;
    const RoomBarred barred =
        room_barred(*model, {.cut = {}, .fill = {{on.position, end, 0.15 * with.diagonal, on.normal}}}, *made, with);
    if (barred.by != RoomBar::OtherPart) continue;
    ++told;
    EXPECT_NEAR(barred.distance, opposite->distance + 1e-3 * with.diagonal, 1e-5 * with.diagonal);
    EXPECT_LT(length(barred.at - on.position), 1e-5 * with.diagonal);
    if (told == 3) return;
  }
  FAIL() << "told only " << told << " times";
}

/// The same triangles in another order, their corners too.
TriangleMesh shuffled(const TriangleMesh& mesh, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<std::uint32_t> place(mesh.positions.size());
  std::iota(place.begin(), place.end(), 0U);
  std::ranges::shuffle(place, random);
  TriangleMesh other;
  other.positions.resize(mesh.positions.size());
  for (std::size_t v = 0; v < place.size(); ++v) other.positions[place[v]] = mesh.positions[v];
  for (auto t : mesh.triangles) {
    for (std::uint32_t& v : t) v = place[v];
    std::ranges::rotate(t, t.begin() + random() % 3);
    other.triangles.push_back(t);
  }
  std::ranges::shuffle(other.triangles, random);
  return other;
}

// Fibres stand elsewhere in each of these cages. Measured along the fibre that lacks most, a pumpkin of 200,000
// triangles was from 77 to 119 mm thick at one place.
TEST(Room, TellsTheSameHoweverTheMeshIsOrdered) {
  const TriangleMesh mesh = *make_sample("pumpkin", 20'000);
  ConvertSettings settings;
  settings.slabs = 200;
  settings.intervals = 16;
  for (const double share : {0.27, 0.35}) {  // of the diagonal: nearly through the form, and out on its other side
    std::vector<RoomBarred> told;
    std::set<std::uint64_t> cages;
    for (const unsigned seed : {0U, 1U, 2U, 3U}) {
      const Result<Conversion> made = convert(seed == 0 ? mesh : shuffled(mesh, seed), settings);
      ASSERT_TRUE(made) << made.error().message;
      const Snapshot& model = *made->model.head;
      cages.insert(model.content_hash());
      RoomGoals with;
      with.diagonal = made->model.info.source_diagonal;
      const Vec3d axis = normalized(Vec3d{0, 50, 60});
      const auto on = raycast(model, {axis * with.diagonal, -axis});
      ASSERT_TRUE(on);
      const double radius = share * with.diagonal;
      const RoomWanted wanted = {.cut = {{on->point.position, on->point.position, radius, axis}}, .fill = {}};
      const Result<RoomMade> room = make_room(model, wanted, with);
      ASSERT_TRUE(room) << room.error().message;
      told.push_back(room_barred(model, wanted, *room, with));
    }
    EXPECT_EQ(cages.size(), told.size()) << "other fibres each time";
    for (const RoomBarred& barred : told) {
      EXPECT_EQ(barred.by, RoomBar::FarSide);
      EXPECT_NEAR(barred.distance, told[0].distance, 0.01 * told[0].distance);
      EXPECT_LT(length(barred.at - told[0].at), 0.01 * told[0].distance);
    }
  }
}

TEST(Room, KeepsFibresAsShortAsAsked) {
  const SnapshotPtr model = bumpy_ball();
  RoomGoals with = goals();
  with.longest = 0.075;
  const auto [made, next] = make(model, place_at(*model, 17, 0.3, 0.25).cut(), with);
  EXPECT_FALSE(made.after.empty());
  for (const Fibre& f : next->slab_mesh().fibres()) EXPECT_LE(length(f.direction()), 0.075 * kDiagonal + 1e-6);
}

// For less than a hundredth of what is lacking the surface is not sampled again.
TEST(Room, MovesNothingForAHundredthOfWhatIsLacking) {
  const double depth = 0.125;
  const SnapshotPtr model = testing::displaced(testing::plane_shell(4, 8, depth), [](Vec3d) { return 0.5; });
  const Vec3d middle = {0.5, 0.0, 0.5}, out = {0, 1, 0};
  for (const double longer : {1e-3, 0.02}) {  // than fibres are, at places that lack a tenth
    RoomGoals with = goals();
    with.longest = (2 * depth + longer) / kDiagonal;
    const Result<RoomMade> made = make_room(*model, {.cut = {{middle, middle, 0.3, out}}, .fill = {}}, with);
    ASSERT_TRUE(made);
    EXPECT_FALSE(made->before.empty());
    EXPECT_EQ(made->moved.empty(), longer < 0.01) << longer;
  }
}

TEST(Room, HasNoFibresThatTheLatticeDoesNotHold) {
  const SnapshotPtr model = testing::displaced(testing::sphere_shell(2, 8, 0.9, 1.1), [](Vec3d) { return 0.5; });
  const Result<RoomMade> made = make_room(*model, place_at(*model, 17, 0.3, 0.25).cut(), goals());
  ASSERT_TRUE(made);
  EXPECT_FALSE(made->on_lattice);
  EXPECT_TRUE(made->moved.empty());
}

// Where n differs across an edge, constrained samples follow.
TEST(Room, HoldsWhereIntervalsDiffer) {
  const SnapshotPtr model = testing::displaced(testing::mixed_shell(*lattice_ball(2, 8), 4, 2),
                                               [](Vec3d p) { return 0.5 + 0.1 * std::sin(7 * p.x); });
  for (const SlabId slab : {3U, 40U, 77U}) {
    const Place place = place_at(*model, slab, 0.3, 0.2);
    const auto [made, next] = make(model, place.cut());
    EXPECT_TRUE(made.after.empty());
    EXPECT_EQ(carve(next, place).limited, 0U);
  }
}

TEST(Room, CarriesLayersToWhereTheyWere) {
  const auto field = [](Vec3d p) { return 0.5 + 0.4 * std::sin(3 * p.x) * std::sin(2 * p.y); };
  SnapshotDraft draft(testing::with_hole(bumpy_ball(), [](Vec3d p) { return length(p - Vec3d{0, 0, 1}) < 0.2; }));
  draft.add_layer(Layer::Mask, 32, 0);
  draft.add_layer(Layer::Colour, 16, 0);
  draft.add_layer(Layer::Strata, 16, 0);
  const SlabMesh& mesh = draft.base().slab_mesh();
  constexpr double kBuried = 0.04;  // below the surface
  for (SlabId s = 0; s < mesh.slab_count(); ++s)
    for (const Layer layer : {Layer::Mask, Layer::Colour, Layer::Strata}) {
      Tile& tile = draft.edit(layer, s);
      const int m = tile.intervals();
      for (int j = 0; j <= m; ++j)
        for (int i = 0; i + j <= m; ++i) {
          const SurfacePoint p = surface_point(draft.base(), s, double(i) / m, double(j) / m);
          const double value = layer == Layer::Strata ? p.alpha - kBuried / 0.2 : field(p.position);
          for (int c = 0; c < tile.channel_count(); ++c)
            tile.set(c, sample_index(m, {i, j}), static_cast<float>(value));
        }
    }
  const SnapshotPtr model = draft.finish();
  ASSERT_TRUE(validate(*model));
  const Place place = {closest_point(*model, normalized(Vec3d{0.3, 0.1, 0.95})), 0.3, 0.2};
  const auto [made, next] = make(model, place.cut());
  ASSERT_FALSE(made.moved.empty());
  std::size_t holes = 0;
  for (const SlabId s : slabs_around(mesh, made)) {
    for (int k = 0; k < 100; ++k) {
      const double u = 0.02 + 0.0096 * k, v = (k % 5 + 0.5) / 5 * (1 - u);
      const SurfacePoint p = surface_point(*next, s, u, v);
      EXPECT_NEAR(layer_at(*next, Layer::Mask, s, u, v, 0), field(p.position), 0.01);
      EXPECT_NEAR(double(colour_at(*next, s, u, v).y), field(p.position), 0.02);
      const SlabCorners corners = next->slab_mesh().corners(s);
      const std::array<double, 3> w = {1 - u - v, u, v};
      const Vec3d buried = corners.point(w, layer_at(*next, Layer::Strata, s, u, v, 0));
      EXPECT_NEAR(length(p.position - buried), kBuried, 0.01);
      const double from_rim = length(p.position - Vec3d{0, 0, 1}) - 0.2;
      if (std::abs(from_rim) < 0.05) continue;
      EXPECT_EQ(hole_at(*next, s, u, v), from_rim < 0);
      holes += from_rim < 0;
    }
  }
  EXPECT_GT(holes, 20U);
}

TEST(Room, IsTheSameEachTime) {
  const SnapshotPtr model = bumpy_ball();
  const RoomWanted wanted = place_at(*model, 93, 0.3, 0.25).cut();
  EXPECT_EQ(make(model, wanted).second->content_hash(), make(model, wanted).second->content_hash());
}

TEST(Room, RefusesWhatMakesNoSense) {
  const SnapshotPtr model = bumpy_ball();
  RoomWanted wanted = place_at(*model, 17, 0.3, 0.25).cut();
  EXPECT_EQ(make_room(*model, wanted, RoomGoals{}).error().code, Errc::InvalidArgument);
  wanted.cut[0].radius = std::nan("");
  EXPECT_EQ(make_room(*model, wanted, goals()).error().code, Errc::InvalidArgument);
  RoomMade other;
  other.moved.push_back({static_cast<FibreId>(model->slab_mesh().fibres().size()), {}});
  EXPECT_EQ(with_room(model, other).error().code, Errc::Corrupt);
}

TEST(Room, CanBeCancelled) {
  const SnapshotPtr model = bumpy_ball();
  const std::atomic<bool> cancel = true;
  const Result<RoomMade> made =
      make_room(*model, place_at(*model, 17, 0.3, 0.25).cut(), goals(), {.report = {}, .cancel = &cancel});
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().code, Errc::Cancelled);
}

Model model_of(const SnapshotPtr& head) {
  Model model = {.info = {}, .head = head};
  model.info.source_diagonal = kDiagonal;
  return model;
}

std::size_t samples_of(const Snapshot& model) {
  std::size_t sum = 0;
  for (const Slab& slab : model.slab_mesh().slabs()) sum += sample_count(slab.intervals);
  return sum;
}

/// How far the samples of a surface lie from another at most, each looked up.
double farthest_from(const Snapshot& from, const Snapshot& of, std::vector<double>* all = nullptr) {
  double most = 0;
  for (SlabId s = 0; s < of.slab_mesh().slab_count(); ++s) {
    const int n = of.slab_mesh().intervals(s);
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i + j <= n; ++i) {
        const Vec3d p = sample_position(of, s, {i, j});
        const double off = length(closest_point(from, p).position - p);
        most = std::max(most, off);
        if (all != nullptr) all->push_back(off);
      }
  }
  return most;
}

// 65 intervals cannot be doubled within a tile, nor halved: the cut alone makes them twice as fine.
TEST(Refine, AllIsTwiceAsFineWithAnyIntervals) {
  for (const int n : {15, 16, 65, 128}) {
    SCOPED_TRACE(n);
    const SnapshotPtr model = bumpy_ball(1, n);
    const Result<Refined> fine = refine(model_of(model), RefineWhere::All);
    ASSERT_TRUE(fine) << fine.error().message;
    ASSERT_TRUE(fine->model.head);
    const Snapshot& after = *fine->model.head;
    expect_sound(after);
    EXPECT_GT(samples_of(after), 3.5 * static_cast<double>(samples_of(*model)));
    // It is measured, not taken for granted: where fibres turn, the middle of an edge does not lie on it to the bit.
    EXPECT_LE(fine->moved_max, 5e-6 * kDiagonal);
    EXPECT_GT(fine->moved_max, 0);
    if (n < 65) {
      const double farthest = std::max(farthest_from(*model, after), farthest_from(after, *model));
      EXPECT_LE(fine->moved_max, 1.01 * farthest);
      EXPECT_GE(fine->moved_max, 0.9 * farthest) << "it looks at one sample of three at least";
    }
    for (SlabId s = 0; s < after.slab_mesh().slab_count(); ++s)
      EXPECT_EQ(after.slab_mesh().intervals(s) << after.slab_mesh().level(s), 2 * n);
  }
}

// Tools fade out before the end of the clay, so no sample stands at the end itself.
TEST(Refine, SaturatedFindsWhereToolsHaveFadedOut) {
  const SnapshotPtr model = bumpy_ball();
  const SurfacePoint on = surface_point(*model, 50, 0.3, 0.3);
  const auto carve_to = [&](const SnapshotPtr& from, double depth) {
    Editor editor(from);
    editor.begin_stroke({.tool = Tool::Carve, .radius = 0.3, .detail = 0});
    editor.dab({.slab = closest_point(*from, on.position).slab,
                .contact = on.position,
                .cursor = on.position - on.normal * depth,
                .normal = on.normal});
    return std::pair(editor.end_stroke(), editor.head());
  };
  const auto [result, carved] = carve_to(model, 0.4);
  ASSERT_GT(result.limited, 0U);
  const Result<Refined> refined = refine(model_of(carved), RefineWhere::Saturated, model);
  ASSERT_TRUE(refined) << refined.error().message;
  EXPECT_GT(refined->saturated_before, 0U);
  EXPECT_LT(refined->saturated_after, refined->saturated_before);
  EXPECT_GT(refined->fibres_moved, 0U);
  ASSERT_TRUE(refined->model.head);
  expect_sound(*refined->model.head);
  std::vector<double> off;
  const double most =
      std::max(farthest_from(*carved, *refined->model.head, &off), farthest_from(*refined->model.head, *carved, &off));
  double squares = 0;
  for (const double d : off) squares += d * d;
  const double rms = std::sqrt(squares / static_cast<double>(off.size()));
  EXPECT_NEAR(refined->moved_max, most, 0.01 * most) << "each sample looked up";
  EXPECT_NEAR(refined->moved_rms, rms, 0.01 * rms);
  const auto deepest = [&](const SnapshotPtr& of) {
    return length(raycast(*of, {on.position + on.normal, -on.normal})->point.position - on.position);
  };
  EXPECT_GT(deepest(carve_to(refined->model.head, 0.4).second), 1.3 * deepest(carved));
  // What no moved fibre is beside keeps its tile.
  std::size_t shared = 0;
  for (SlabId s = 0; s < model->slab_mesh().slab_count(); ++s)
    shared += carved->shared_tile(Layer::Displacement, s) == refined->model.head->shared_tile(Layer::Displacement, s);
  EXPECT_GT(shared, 60U);
}

// Conversion leaves little clay in a thin wall. No tool has brought the surface there, so it is none that ran out.
TEST(Refine, AThinWallThatNobodyTouchedIsNotSaturated) {
  const Model model = converted("bowl", 20000, 200);
  const Result<Refined> unknown = refine(model, RefineWhere::Saturated);
  ASSERT_TRUE(unknown) << unknown.error().message;
  EXPECT_GT(unknown->saturated_before, 0U) << "its walls are thin";
  const Result<Refined> refined = refine(model, RefineWhere::Saturated, model.head);
  ASSERT_TRUE(refined) << refined.error().message;
  EXPECT_EQ(refined->saturated_before, 0U);
  EXPECT_EQ(refined->saturated_after, 0U);
  EXPECT_EQ(refined->fibres_moved, 0U);
  // What a tool has taken there counts.
  const SurfacePoint on = surface_point(*model.head, 20, 0.3, 0.3);
  Editor editor(model.head);
  const double radius = 0.05 * model.info.source_diagonal;
  editor.begin_stroke({.tool = Tool::Carve, .radius = radius, .detail = 0});
  editor.dab(
      {.slab = on.slab, .contact = on.position, .cursor = on.position - on.normal * radius, .normal = on.normal});
  editor.end_stroke();
  const Result<Refined> carved = refine({model.info, editor.head()}, RefineWhere::Saturated, model.head);
  ASSERT_TRUE(carved) << carved.error().message;
  EXPECT_GT(carved->saturated_before, 0U);
}

// What is left of a fibre lies along it, and so does the way that tools have moved the surface. Where fibres lean by 75
// degrees, that way is four times the distance between the surfaces.
TEST(Refine, SaturatedSeesWornSamplesOnFibresThatLean) {
  const auto shell = testing::mapped_shell(*testing::plane_shell(4, 2), [](Vec3d p) {
    return Vec3d{p.x + p.y * std::tan(75 * std::numbers::pi / 180), p.y, p.z};
  });
  const SnapshotPtr made = testing::displaced(shell, [](Vec3d) { return 0.5; });
  // As near to the inner end as still counts on so coarse a grid, whose tools fade out early.
  const SnapshotPtr worn = testing::displaced(shell, [](Vec3d) { return 0.12; });
  const std::size_t all = refine(model_of(worn), RefineWhere::Saturated)->saturated_before;
  ASSERT_EQ(all, samples_of(*worn)) << "all stand at the end of their fibre";
  EXPECT_EQ(refine(model_of(worn), RefineWhere::Saturated, made)->saturated_before, all);
  EXPECT_EQ(refine(model_of(worn), RefineWhere::Saturated, worn)->saturated_before, 0U);
}

TEST(Refine, LookingForWhatHasRunOutShowsProgressAndCanBeCancelled) {
  const SnapshotPtr model = bumpy_ball();
  std::atomic<bool> cancel = false;
  std::size_t steps = 0;
  const Progress progress = {.report =
                                 [&](std::string_view phase, double) {
                                   if (phase == "clay" && ++steps == 5) cancel = true;
                                 },
                             .cancel = &cancel};
  const Result<Refined> refined = refine(model_of(model), RefineWhere::Saturated, model, progress);
  ASSERT_FALSE(refined);
  EXPECT_EQ(refined.error().code, Errc::Cancelled);
  EXPECT_EQ(steps, 5U);
}

// More intervals up to 32, then cuts; the slabs' own fibres stay, and so does the surface. Once done it is done. An odd
// grid of 65 beside one that is cut can neither stay nor have twice as many: its slab is cut, too.
TEST(Refine, SaturatedGivesLeaningSlabsFinerGrids) {
  for (const int n : {8, 32, 65}) {
    SCOPED_TRACE(n);
    const SnapshotPtr model = testing::displaced(
        testing::mapped_shell(*lattice_ball(n == 65 ? 1 : 2, n), testing::leaning(6)), [](Vec3d) { return 0.5; });
    ASSERT_FALSE(model->slab_mesh().has_detail());
    // As conversion leaves it where it has made fibres lean: samples lie far apart along them.
    SnapshotDraft draft(model);
    for (SlabId s = 0; s < model->slab_mesh().slab_count(); ++s)
      for (int j = 0; j <= n; ++j)
        for (int i = 0; i + j <= n; ++i)
          draft.edit(Layer::Displacement, s).plane()[sample_index(n, {i, j})] = static_cast<float>(
              0.5 + 0.3 * std::sin(9 * model->slab_mesh()
                                           .corners(s)
                                           .point({double(n - i - j) / n, double(i) / n, double(j) / n}, 0.5)
                                           .z));
    const SnapshotPtr steep = draft.finish();
    ASSERT_TRUE(validate(*steep));
    const Result<Refined> refined = refine(model_of(steep), RefineWhere::Saturated);
    ASSERT_TRUE(refined) << refined.error().message;
    EXPECT_GT(refined->slabs_leaning, 0U);
    EXPECT_GT(refined->slabs_finer, 0U);
    ASSERT_TRUE(refined->model.head);
    const Snapshot& after = *refined->model.head;
    EXPECT_TRUE(validate(after));
    EXPECT_GT(samples_of(after), samples_of(*steep));
    EXPECT_EQ(refined->fibres_moved, 0U);
    EXPECT_GT(refined->moved_max, 0) << "measured with the finer grids: not to the bit where fibres turn";
    EXPECT_LT(refined->moved_max, 1e-3 * kDiagonal);
    EXPECT_EQ(after.slab_mesh().has_detail() && after.slab_mesh().slab_count() > steep->slab_mesh().slab_count(),
              n >= 32);
    EXPECT_EQ(after.slab_mesh().roots_number(), steep->slab_mesh().roots_number());
    std::mt19937 random(3);
    std::uniform_real_distribution<double> unit(0, 1);
    for (int k = 0; k < 2000; ++k) {
      const auto s = static_cast<SlabId>(random() % after.slab_mesh().slab_count());
      const double u = unit(random), v = unit(random) * (1 - u);
      const auto there = heir(after.slab_mesh(), steep->slab_mesh(), {s, u, v, 0});
      ASSERT_TRUE(there);
      EXPECT_NEAR(displacement_at(after, s, u, v), displacement_at(*steep, there->slab, there->u, there->v), 2e-7);
    }
    const Result<Refined> again = refine(model_of(refined->model.head), RefineWhere::Saturated);
    ASSERT_TRUE(again) << again.error().message;
    EXPECT_EQ(again->slabs_finer, 0U);
    EXPECT_FALSE(again->model.head);
  }
}

// Openings come from the surface that is converted, layers from the nearest place of the old one.
TEST(Refine, NewSlabsKeepOpeningsAndLayers) {
  Model model = converted("torus", 6000, 80);
  const double diagonal = model.info.source_diagonal;
  const Vec3d rim = closest_point(*model.head, surface_point(*model.head, 20, 0.3, 0.3).position).position;
  const auto is_open = [&](Vec3d p, double radius) { return length(p - rim) < radius * diagonal; };
  const auto field = [&](Vec3d p) { return 0.5 + 0.4 * std::sin(6 * p.x / diagonal) * std::cos(5 * p.y / diagonal); };
  SnapshotDraft draft(testing::with_hole(model.head, [&](Vec3d p) { return is_open(p, 0.08); }));
  draft.add_layer(Layer::Mask, 16, 0);
  for (SlabId s = 0; s < draft.base().slab_mesh().slab_count(); ++s) {
    Tile& tile = draft.edit(Layer::Mask, s);
    for (int j = 0; j <= 16; ++j)
      for (int i = 0; i + j <= 16; ++i)
        tile.set(0, sample_index(16, {i, j}),
                 static_cast<float>(field(surface_point(draft.base(), s, i / 16.0, j / 16.0).position)));
  }
  model.head = draft.finish();
  ASSERT_TRUE(validate(*model.head));
  const Result<Refined> refined = refine(model, RefineWhere::Model);
  ASSERT_TRUE(refined) << refined.error().message;
  const Snapshot& after = *refined->model.head;
  EXPECT_TRUE(validate(after));
  ASSERT_TRUE(after.has(Layer::Mask));
  ASSERT_TRUE(after.has(Layer::Void)) << "the opening is one still";
  constexpr int kAcross = 10;
  std::size_t holes = 0, looked = 0;
  for (SlabId s = 0; s < after.slab_mesh().slab_count(); ++s)
    for (int i = 0; i < kAcross; ++i)
      for (int j = 0; i + j < kAcross; ++j) {
        const double u = (i + 0.3) / kAcross, v = (j + 0.3) / kAcross;
        const SurfacePoint p = surface_point(after, s, u, v);
        const double from = length(p.position - rim) / diagonal;
        if (from < 0.06) {
          EXPECT_TRUE(hole_at(after, s, u, v)) << from;
          ++holes;
        } else if (from > 0.12) {
          EXPECT_FALSE(hole_at(after, s, u, v)) << from;
          EXPECT_NEAR(layer_at(after, Layer::Mask, s, u, v, 0), field(p.position), 0.03);
          ++looked;
        }
      }
  EXPECT_GT(holes, 20U);
  EXPECT_GT(looked, 4000U);
}

// Leaning fibres and large slabs: what is not told is reached.
TEST(Room, IsMadeInAConvertedModelOrTold) {
  const auto [info, model] = converted("head", 20000, 200, 32);
  RoomGoals with;
  with.diagonal = info.source_diagonal;
  std::size_t told = 0, places = 0;
  for (SlabId s = 0; s < model->slab_mesh().slab_count(); s += 17) {
    const SurfacePoint on = surface_point(*model, s, 0.3, 0.3);
    const Place place = {on, 0.08 * with.diagonal, 0.05 * with.diagonal};
    const auto inside = raycast(*model, {on.position - on.normal * 1e-3 * with.diagonal, -on.normal});
    if (!inside || inside->distance < 3 * place.depth) continue;
    ++places;
    const auto [made, next] = make(model, place.cut(), with);
    EXPECT_LE(made.surface_moved, with.most_moved * with.diagonal);
    if (made.after.empty())
      EXPECT_EQ(carve(next, place).limited, 0U) << s;
    else
      ++told;
  }
  EXPECT_GE(places, 5U);
  EXPECT_LE(5 * told, places);
}

}  // namespace

namespace detail {
namespace {

TEST(Room, HalvesRootsWhereFibresBetweenThemCannotMove) {
  const auto [info, model] = converted("head", 20000, 200, 16);
  RoomGoals with;
  with.diagonal = info.source_diagonal;
  SurfacePoint on = surface_point(*model, 116, 0.3, 0.3);
  // The tool comes aslant.
  on.normal = normalized(on.normal + normalized(cross(on.normal, Vec3d{0.3, 0.5, 0.8})) * 0.6);
  const Place place = {on, 0.08 * with.diagonal, 0.072 * with.diagonal};
  const auto [made, next] = make(model, place.cut(), with);
  EXPECT_FALSE(made.before.empty());
  EXPECT_TRUE(made.after.empty());
  EXPECT_GT(made.halved.added, 0U);
  EXPECT_LE(made.surface_moved, with.most_moved * with.diagonal);
  EXPECT_EQ(next->slab_mesh().roots().size(), model->slab_mesh().roots().size() + made.halved.added);
  // What is not beside a fibre that is new or has moved stays.
  const std::set<SlabId> around = slabs_around(next->slab_mesh(), made);
  std::size_t stay = 0;
  for (SlabId s = 0; s < model->slab_mesh().slab_count(); ++s) {
    const SlabId now = made.halved.now(s);
    if (now == kNoSlab || around.contains(now)) continue;
    ++stay;
    EXPECT_EQ(model->shared_tile(Layer::Displacement, s), next->shared_tile(Layer::Displacement, now)) << s;
  }
  EXPECT_GT(stay, 50U);
  const auto again = make_room(*model, place.cut(), with);
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ((*with_room(model, *again))->content_hash(), next->content_hash());
}

// In a thin wall the clay ends wherever fibres are.
TEST(Room, HalvesNoRootsWhereThatDoesNotGiveAllThatIsLacking) {
  const auto [info, model] = converted("bowl", 20000, 200, 16);
  RoomGoals with;
  with.diagonal = info.source_diagonal;
  const Place place = place_at(*model, 14, 0.05 * with.diagonal, 0.03 * with.diagonal);
  const auto [made, next] = make(model, place.cut(), with);
  EXPECT_FALSE(made.after.empty());
  EXPECT_EQ(made.halved.added, 0U);
  EXPECT_EQ(next->slab_mesh().roots().size(), model->slab_mesh().roots().size());
}

TEST(Solids, LinesPassThroughCapsules) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto point = [&] { return Vec3d{unit(random), unit(random), unit(random)}; };
  std::size_t passed = 0;
  for (int k = 0; k < 400; ++k) {
    const Capsule c = {point(), k % 4 == 0 ? Vec3d{} : point(), 0.2 + 0.2 * unit(random), {}};
    const Line line = {point(), point()};
    const std::optional<Passage> p = passage(c, line);
    double first = Box3d::kFar, last = -Box3d::kFar;
    constexpr double kStep = 1e-3;
    for (double t = -6; t <= 6; t += kStep)
      if (is_in(std::span(&c, 1), line.origin + line.direction * t)) {
        first = std::min(first, t);
        last = std::max(last, t);
      }
    if (!p) {
      EXPECT_GT(first, last);
      continue;
    }
    if (first > last || first < -5.9 || last > 5.9) continue;
    ++passed;
    EXPECT_NEAR(p->from, first, 2 * kStep);
    EXPECT_NEAR(p->to, last, 2 * kStep);
  }
  EXPECT_GT(passed, 50U);
}

// Fibres that lean over steep bumps, and the samples on the slabs' shared edges: each has a mark in every slab.
/// A ball whose middle lies a little below a plane is met at its widest by fibres that stand on the plane around it, so
/// far below it. Tools tell what they take so, from a twentieth of their radius on.
TEST(ReachWanted, SeesWhatLiesATwentiethOfTheRadiusBesideATool) {
  const SnapshotPtr model = testing::displaced(testing::plane_shell(1, 16, 0.125), [](Vec3d) { return 0.5; });
  const SlabMesh& mesh = model->slab_mesh();
  const Lattice lattice = lattice_of(mesh, mesh.bounds(), 0.5).value();
  const std::vector<SlabId> slabs = {0, 1};
  const auto ends_of = [&](std::uint32_t face, std::size_t corner) {
    const Fibre& fibre = mesh.fibres()[mesh.slabs()[face].fibres[corner]];
    return Ends{snap(lattice.to_lattice(fibre.inner)), snap(lattice.to_lattice(fibre.outer))};
  };
  const double radius = 0.125 * (1 + 1e-5);  // over one sample at its widest
  for (const double below : {0.04, 0.07}) {
    const Vec3d middle = {0.5, -below * radius, 0.25};
    const std::vector<Capsule> cut = on_lattice(std::vector<Capsule>{{middle, middle, radius, {0, 1, 0}}}, lattice);
    const ReachWanted wishes(*model, lattice, slabs, cut, {}, goals());
    double beside = 0;
    wishes.for_each_lack(ends_of, [&](const Lacking& l) { beside = std::max(beside, l.beside * lattice.step); });
    if (below < 0.05)
      EXPECT_EQ(beside, 0);
    else
      EXPECT_NEAR(beside, below * radius, 0.01 * radius);
  }
}

TEST(Resampling, CountsASampleThatMeetsTheSurfaceSeveralTimesOnce) {
  SnapshotDraft draft(testing::displaced(
      lattice_ball(2, 16), [](Vec3d p) { return 0.5 + 0.2 * (std::sin(25 * p.x) + std::sin(25 * p.y)); }));
  draft.add_layer(Layer::Folded, kOwnIntervals, 0);
  const SnapshotPtr model = draft.finish();
  const SlabMesh& mesh = model->slab_mesh();
  std::vector<Fibre> fibres(mesh.fibres().begin(), mesh.fibres().end());
  Lengthened leaning;
  leaning.lattice = lattice_of(mesh, mesh.bounds(), 0.5).value();
  for (const FibreId f : {10U, 20U, 30U, 40U, 50U, 60U}) {
    const Vec3d aside = cross(fibres[f].outer, Vec3d{0.3, 0.5, 0.8}) * 0.4;
    fibres[f].outer = leaning.lattice.to_model(snap(leaning.lattice.to_lattice(fibres[f].outer + aside)));
    leaning.moved.push_back({f, fibres[f]});
  }
  const auto turned = mesh.with_root_fibres(fibres);
  ASSERT_TRUE(turned) << turned.error().message;
  std::vector<SlabId> slabs;
  for (const MovedFibre& m : leaning.moved)
    for (const SlabCorner c : mesh.fan(m.fibre)) slabs.push_back(c.slab);
  std::ranges::sort(slabs);
  const auto repeated = std::ranges::unique(slabs);
  slabs.erase(repeated.begin(), repeated.end());
  const Resampled made = resample(*model, *turned, leaning, slabs, {}, 1, {});
  ASSERT_TRUE(made.unmet.empty());
  std::size_t marks = 0, marked = 0;
  for (const MovedTile& t : made.tiles) {
    if (t.layer != Layer::Folded) continue;
    const int n = t.tile->intervals();
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i + j <= n; ++i) {
        if (t.tile->value(0, sample_index(n, {i, j})) == 0) continue;
        ++marks;
        SampleCopy first;
        mesh.for_each_copy(
            t.slab, [n](SlabId) { return n; }, {i, j},
            [&](const SampleCopy& copy) {
              if (first.slab == kNoSlab) first = copy;
            });
        marked += first.slab == t.slab ? 1 : 0;
      }
  }
  EXPECT_GT(marks, marked) << "some lie on edges";
  EXPECT_EQ(folded_in(made.sampled), marked);
}

// On upright fibres growing alone leaves less, on leaning ones becoming short first.
TEST(LengthenFor, OfBothWaysTheOneAfterWhichLessIsLackingIsKept) {
  for (const bool leans : {false, true}) {
    SCOPED_TRACE(leans);
    const SnapshotPtr model =
        testing::displaced(leans ? leaning_ball(2) : lattice_ball(2, 16), [](Vec3d) { return 0.5; });
    const Place place = {closest_point(*model, {1, 0.2, 0.1}), 0.4, leans ? 0.4 : 0.8};
    const Lengthened grown = lengthen_for(*model, place.cut(), goals(), RoomWay::Grow, {}, {}, {});
    const Lengthened shrunk = lengthen_for(*model, place.cut(), goals(), RoomWay::Shrink, {}, {}, {});
    ASSERT_EQ(shrunk.lack_after < grown.lack_after, leans);
    const Result<RoomMade> made = make_room(*model, place.cut(), goals());
    ASSERT_TRUE(made) << made.error().message;
    EXPECT_TRUE(std::ranges::equal(
        made->moved, (leans ? shrunk : grown).moved, {}, [](const MovedFibre& m) { return m.now.inner; },
        [](const MovedFibre& m) { return m.now.inner; }));
  }
}

TEST(CageLattice, HoldsAllFibresAndTheRoomAround) {
  const auto mesh = lattice_ball(1, 4);
  const std::optional<Lattice> lattice = lattice_of(*mesh, mesh->bounds(), 0.5);
  ASSERT_TRUE(lattice);
  EXPECT_LE(lattice->step, 1.0 / (1 << 20));
  for (const Fibre& f : mesh->fibres())
    for (const Vec3d p : {f.inner, f.outer}) EXPECT_EQ(lattice->to_model(snap(lattice->to_lattice(p))), p);
  const Vec3d low = lattice->to_lattice(mesh->bounds().low - Vec3d{0.5, 0.5, 0.5});
  const Vec3d high = lattice->to_lattice(mesh->bounds().high + Vec3d{0.5, 0.5, 0.5});
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_GE(low[k], 0);
    EXPECT_LE(high[k], Lattice::kSpan);
  }
  EXPECT_FALSE(lattice_of(*testing::sphere_shell(1, 4), mesh->bounds(), 0.5));
}

}  // namespace
}  // namespace detail
}  // namespace relief
