// Large balls and repeated work in converted models: the clay does not end, or that is told.
#include "document_support.h"
#include "support/data.h"

#include <relief/convert/convert.h>
#include <relief/convert/refine.h>
#include <relief/convert/room.h>
#include <relief/core/detail.h>
#include <relief/mesh/import.h>
#include <relief/mesh/samples.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace relief {
namespace {

using testing::Events;

/// A ball that is to be cut where a point of the surface lies.
struct Ball {
  Vec3d low, normal, centre;
  double radius;
};

/// How far a cut misses its ball.
struct Misses {
  double left = 0;      ///< clay inside the ball, from it, at most
  double too_much = 0;  ///< what was cut beyond it, at most
};

/// Looks from the ball's centre down on what it was to cut. Nothing is taken from the program but where a ray meets a
/// surface.
Misses misses(const Snapshot& before, const Snapshot& after, const Ball& ball) {
  Misses found;
  const Vec3d side = normalized(std::abs(ball.normal.x) < 0.8 ? cross(ball.normal, Vec3d{1, 0, 0})
                                                              : cross(ball.normal, Vec3d{0, 1, 0}));
  const Vec3d across = cross(ball.normal, side);
  constexpr int kRings = 24, kTurns = 48;
  for (int ring = 0; ring < kRings; ++ring)
    for (int turn = 0; turn < kTurns; ++turn) {
      const double tilt = std::numbers::pi / 2 * (ring + 0.5) / kRings, round = 2 * std::numbers::pi * turn / kTurns;
      const Vec3d way =
          -ball.normal * std::cos(tilt) + (side * std::cos(round) + across * std::sin(round)) * std::sin(tilt);
      const auto was = raycast(before, {ball.centre, way});
      if (!was || was->distance > ball.radius) continue;
      // What lies behind the place where the ball is left: the body, as far as it goes, or nothing until it begins.
      const auto beyond = raycast(before, {ball.centre + way * ball.radius, way});
      const auto is = raycast(after, {ball.centre, way});
      if (!beyond) continue;  // an opening of the scan
      const double next = ball.radius + beyond->distance, reach = is ? std::min(is->distance, next) : next;
      const bool in_body = dot(beyond->point.normal, way) > 0;
      found.left = std::max(found.left, ball.radius - reach);
      if (in_body) found.too_much = std::max(found.too_much, reach - ball.radius);
    }
  return found;
}

class Clay : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    if (GetParam() == "sample") {
      take(*make_sample("head", 20000));
    } else {
      RELIEF_DATA_FILE(file, GetParam());
      take(*import_mesh(file));
    }
  }
  void take(const TriangleMesh& mesh) {
    auto made = convert(mesh, {});
    ASSERT_TRUE(made) << made.error().message;
    model_ = made->model;
    diagonal_ = model_.info.source_diagonal;
  }
  /// A tap with a ball so deep below a place that the centre stands in the open above it, and the ball that it means:
  /// its axis is the mean normal under the tool. Empty where the place has none.
  std::optional<std::pair<Stroke, Ball>> random_tap(double radius, double depth) {
    const Snapshot& model = *model_.head;
    std::uniform_real_distribution<double> unit(-1, 1);
    const Box3d box = bounds_of_surface(model);
    const Vec3d middle = (box.low + box.high) / 2;
    const Vec3d from = middle + normalized(Vec3d{unit(random_), unit(random_), unit(random_)}) * diagonal_;
    const Vec3d to = middle + Vec3d{unit(random_), unit(random_), unit(random_)} * (0.2 * diagonal_);
    const auto hit = raycast(model, {from, normalized(to - from)});
    if (!hit) return {};
    const Vec3d low = hit->point.position - hit->point.normal * depth;
    Stroke stroke;
    stroke.brush = {.tool = Tool::Carve, .radius = radius, .detail = 1.0 / 40, .exact = true};
    stroke.tip = true;
    stroke.points = {{0, low, 1}, {0.1, low, 1}};
    Editor editor(model_.head);
    StrokeEngine engine(editor);
    std::optional<Dab> dab;
    engine.on_dab([&](const Dab& given, const DabResult&) {
      if (!dab) dab = given;
    });
    engine.begin(stroke.brush, stroke.tip);
    engine.move(stroke.points);
    engine.cancel();
    if (!dab) return {};
    const Ball ball = {dab->cursor, normalized(dab->normal), dab->cursor + normalized(dab->normal) * radius, radius};
    const auto down = raycast(model, {ball.centre, -ball.normal}), up = raycast(model, {ball.centre, ball.normal});
    const bool is_open = down && down->distance < radius && dot(down->point.normal, ball.normal) > 0 &&
                         (!up || dot(up->point.normal, ball.normal) < 0);
    return is_open ? std::optional(std::pair{stroke, ball}) : std::nullopt;
  }

  Model model_;
  double diagonal_ = 0;
  std::mt19937 random_{3};
};

/// 25 in each model: what is not told leaves no clay in the ball, and takes none beside it, to 1e-3 of the diagonal.
TEST_P(Clay, ALargeBallIsCutOrTold) {
  const double radius = 0.06 * diagonal_, depth = 0.03 * diagonal_;
  std::size_t told = 0, places = 0, rooms = 0;
  Misses worst;
  while (places < 25) {
    const auto tap = random_tap(radius, depth);
    if (!tap) continue;
    ++places;
    Events events;
    DocumentSettings settings = events.settings();
    settings.make_room = room_maker(diagonal_);
    Document document(model_, std::move(settings));
    testing::post(document, tap->first);
    document.settle();
    ASSERT_EQ(events.of<StrokeFinished>().size(), 1U);
    const StrokeResult result = events.of<StrokeFinished>()[0].result;
    const std::vector<RoomEnded> made = events.of<RoomEnded>();
    EXPECT_EQ(events.of<TakenBeside>().size(), result.beside ? 1U : 0U);
    rooms += made.empty() ? 0 : 1;
    const bool is_told = result.limited > 0 || result.missed > 0 || result.beside;
    told += is_told ? 1 : 0;
    const Misses found = misses(*model_.head, *document.head(), tap->second);
    EXPECT_TRUE(validate(*document.head()));
    if (is_told) continue;
    worst.left = std::max(worst.left, found.left / diagonal_);
    worst.too_much = std::max(worst.too_much, found.too_much / diagonal_);
    EXPECT_LE(found.left, 1e-3 * diagonal_) << places;
    EXPECT_LE(found.too_much, 1e-3 * diagonal_) << places;
  }
  std::printf(
      "%s: %zu places, room was made for %zu, told %zu; clay left at most %.1e, cut too much at most %.1e of the "
      "diagonal\n",
      GetParam().c_str(), places, rooms, told, worst.left, worst.too_much);
  EXPECT_LE(told, places / 2);
}

/// 25 small ones: what is not told misses the ball by no more than a grid of its spacing does.
TEST_P(Clay, ASmallBallIsCutOrTold) {
  const double radius = 0.005 * diagonal_, depth = 0.003 * diagonal_;
  std::size_t told = 0;
  double worst = 0;
  for (std::size_t places = 0; places < 25;) {
    const auto tap = random_tap(radius, depth);
    if (!tap) continue;
    ++places;
    Editor editor(model_.head);
    const StrokeResult result = play(editor, tap->first);
    if (result.limited > 0 || result.beside) {
      ++told;
      continue;
    }
    const Misses found = misses(*model_.head, *editor.head(), tap->second);
    worst = std::max({worst, found.left / depth, found.too_much / depth});
  }
  std::printf("%s: %zu of 25 small balls told; the others miss by at most %.3f of the depth\n", GetParam().c_str(),
              told, worst);
  EXPECT_LE(worst, 0.1);
  EXPECT_LE(told, 12U);
}

/// Ten times a cut in one place, each deeper than the last, with finer grids and longer fibres for it. What lies away
/// from it keeps its bits.
TEST_P(Clay, TenRoundsOfCarvingAndRefiningLeaveAllElseToTheBit) {
  const SnapshotPtr before = model_.head;
  const double radius = 0.02 * diagonal_;
  std::optional<std::pair<Stroke, Ball>> tap;
  while (!tap) tap = random_tap(radius, 0.25 * radius);
  const Vec3d place = tap->second.low, up = tap->second.normal;
  Events events;
  DocumentSettings settings = events.settings();
  settings.make_room = room_maker(diagonal_);
  Document document(model_, std::move(settings));
  std::size_t moved = 0;
  for (int round = 1; round <= 10; ++round) {
    Stroke deeper = tap->first;
    deeper.brush.detail = kDetail;
    for (StrokePoint& p : deeper.points) p.position = place - up * (0.7 * radius * (round - 1));
    testing::post(document, deeper);
    document.settle();
    EXPECT_TRUE(validate(*document.head())) << round;
  }
  for (const RoomEnded& made : events.of<RoomEnded>()) moved += made.fibres;
  EXPECT_GT(moved, 0U);
  const auto rounds = events.of<StrokeFinished>();
  ASSERT_EQ(rounds.size(), 10U);
  for (const StrokeFinished& done : rounds) EXPECT_TRUE(done.result.changed);
  model_.head = document.head();
  const Snapshot& after = *model_.head;
  const SlabMesh &was = before->slab_mesh(), &is = after.slab_mesh();
  const std::vector<RootPlace> parts = parts_after(was, is);
  const auto stands = [&](SlabId root) {
    const SlabCorners a = was.corners(root), b = is.corners(root);
    for (std::size_t k = 0; k < 3; ++k)
      if (a.inner[k] != b.inner[k] || a.outer[k] != b.outer[k]) return false;
    return true;
  };
  // Away from the tool and from fibres that have moved.
  std::size_t same = 0;
  for (SlabId s = 0; s < was.slab_count(); ++s) {
    if (was.box(s).distance2(place) < 16 * radius * radius) continue;
    ASSERT_EQ(parts[s].root, s);
    if (parts[s].level > 0 || !stands(s)) continue;
    ASSERT_EQ(was.intervals(s), is.intervals(s));
    const float *a = before->displacement(s), *b = after.displacement(s);
    EXPECT_TRUE(std::equal(a, a + sample_count(was.intervals(s)), b)) << s;
    ++same;
  }
  std::printf("%s: %zu fibres moved in ten rounds; %zu of %u slabs compared, %u slabs now\n", GetParam().c_str(), moved,
              same, was.slab_count(), is.slab_count());
  EXPECT_GT(2 * same, was.slab_count());
}

/// New slabs for all of a model with a thin thorn: what is told of the surface covers what was there, too.
TEST(NewSlabs, TellHowFarTheSurfaceMovedBothWays) {
  ConvertSettings settings;
  settings.slabs = 100;
  settings.intervals = 16;
  auto made = convert(*make_sample("head", 3000), settings);
  ASSERT_TRUE(made) << made.error().message;
  Model model = made->model;
  const double diagonal = model.info.source_diagonal;
  const Box3d box = bounds_of_surface(*model.head);
  const auto hit = raycast(*model.head, {{0, box.high.y + diagonal, 0}, {0, -1, 0}});
  ASSERT_TRUE(hit);
  Editor editor(model.head);
  Stroke thorn;
  thorn.brush = {.tool = Tool::Deposit, .radius = 0.006 * diagonal, .detail = 0.25};
  for (int k = 0; k <= 10; ++k) thorn.points.push_back({0.1 * k, hit->point.position, 1});
  ASSERT_TRUE(play(editor, thorn).changed);
  model.head = editor.head();
  const auto refined = refine(model, RefineWhere::Model);
  ASSERT_TRUE(refined) << refined.error().message;
  double most = 0;
  PickHint hint;
  for (SlabId s = 0; s < model.head->slab_mesh().slab_count(); ++s) {
    if (model.head->slab_mesh().box(s).distance2(hit->point.position) > 1e-4 * diagonal * diagonal) continue;
    const int n = model.head->slab_mesh().intervals(s);
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i + j <= n; ++i) {
        const Vec3d p = sample_position(*model.head, s, {i, j});
        if (length(p - hit->point.position) < 0.01 * diagonal)
          most = std::max(most, length(closest_point(*refined->model.head, p, hint).position - p));
      }
  }
  std::printf("new slabs: moved by at most %.2e of the diagonal; what was there lies up to %.2e from them\n",
              refined->moved_max / diagonal, most / diagonal);
  EXPECT_GT(most, 2e-4 * diagonal) << "a part of the thorn is gone";
  EXPECT_GE(refined->moved_max, most);
}

/// A fine stroke of one second at 1,000 points a second over slabs that are far too coarse for it: how many frames of a
/// screen at 60 Hz pass without a new snapshot.
TEST(ClayInTime, AFineStrokeIsPublishedAsItGoes) {
  auto made = convert(*make_sample("head", 20000), {});
  ASSERT_TRUE(made) << made.error().message;
  const double diagonal = made->model.info.source_diagonal;
  const SnapshotPtr before = made->model.head;
  Events events;
  Document document(made->model, events.settings());
  const Box3d box = bounds_of_surface(*before);
  const Vec3d middle = (box.low + box.high) / 2;
  std::vector<StrokePoint> way;
  for (int k = 0; k <= 1000; ++k) {
    const double turn = 0.6 * (k / 1000.0 - 0.5);
    const Vec3d out = {std::sin(turn), 0.3, std::cos(turn)};
    const auto hit = raycast(*before, {middle + normalized(out) * diagonal, -normalized(out)});
    if (hit) way.push_back({1e-3 * k, hit->point.position, 1});
  }
  ASSERT_GT(way.size(), 900U);
  document.post(BeginStroke{.brush = {.radius = 0.005 * diagonal}, .tip = false, .label = {}, .source = 0});
  using Clock = std::chrono::steady_clock;
  const auto began = Clock::now();
  std::uint64_t last = document.head()->number();
  std::size_t publications = 0, frames = 0, missed = 0;
  bool is_new = false;
  auto frame_ends = began + std::chrono::microseconds(16'667);
  for (const StrokePoint& p : way) {
    std::this_thread::sleep_until(began +
                                  std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(p.t)));
    document.post(MoveStroke{{p}, 0});
    if (const std::uint64_t now = document.head()->number(); now != last) {
      last = now;
      ++publications;
      is_new = true;
    }
    if (Clock::now() < frame_ends) continue;
    ++frames;
    missed += std::exchange(is_new, false) ? 0 : 1;
    frame_ends += std::chrono::microseconds(16'667);
  }
  document.post(EndStroke{0});
  document.settle();
  const SlabId slabs = document.head()->slab_mesh().slab_count();
  std::printf("a stroke of 1 s: %zu publications, %zu of %zu frames without one; %u slabs became %u\n", publications,
              missed, frames, before->slab_mesh().slab_count(), slabs);
  EXPECT_GT(slabs, before->slab_mesh().slab_count());
  EXPECT_FALSE(events.of<SnapshotChanged>().empty());
  EXPECT_TRUE(validate(*document.head()));
}

INSTANTIATE_TEST_SUITE_P(Models, Clay,
                         ::testing::Values("sample", "a_models/pumpkin.ply", "a_models/head_lps.ply",
                                           "a_models/bunny.ply", "b_bad/variant/sphere.stl"));

}  // namespace
}  // namespace relief
