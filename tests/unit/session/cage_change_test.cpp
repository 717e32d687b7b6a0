// Strokes that need room, and other changes of the cage: steps of the one history like all others.
#include "document_support.h"
#include "support/fibre_maps.h"
#include "support/halved_roots.h"
#include "support/killed_child.h"
#include "support/longer_fibres.h"

#include <relief/core/detail.h>

#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <memory>
#include <thread>

namespace relief {
namespace {

using testing::ball;
using testing::Events;
using testing::post;
using testing::stroke_over_ball;
using testing::with_longer_fibres;

/// A tap deeper than the clay, which is 0.2 thick.
Stroke deep_tap(double depth) {
  Stroke stroke;
  stroke.brush = {.tool = Tool::Carve, .radius = depth, .strength = 1};
  stroke.label = "deep";
  stroke.points = {{0, {0.6, 0, 0.8}, 1}, {0.1, {0.6, 0, 0.8}, 1}};
  return stroke;
}

Stroke long_deposit() {
  Stroke stroke;
  stroke.brush = {.tool = Tool::Deposit, .radius = 0.3, .strength = 1};
  stroke.label = "lump";
  for (int k = 0; k <= 60; ++k) stroke.points.push_back({0.02 * k, {0.6, 0, 0.8}, 1});
  return stroke;
}

double lowest(const Snapshot& model) {
  double least = 9;
  for (SlabId s = 0; s < model.slab_mesh().slab_count(); ++s) {
    const int n = model.slab_mesh().intervals(s);
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i + j <= n; ++i) least = std::min(least, length(sample_position(model, s, {i, j})));
  }
  return least;
}

Result<Room> twice_as_long(const SnapshotPtr& surface, const RoomWanted&, const Progress&) {
  return Room{.model = with_longer_fibres(surface, 1, 2), .fibres = surface->slab_mesh().root_fibres().size()};
}

TEST(RoomUnderAStroke, ACutGoesAsDeepAsItWantsTo) {
  Events without, with;
  Document plain(ball(), without.settings());
  post(plain, deep_tap(0.35));
  plain.settle();
  EXPECT_GE(lowest(*plain.head()), 0.79) << "the clay ends there";
  EXPECT_GT(without.of<StrokeFinished>().back().result.limited, 0U);

  DocumentSettings settings = with.settings();
  settings.make_room = twice_as_long;
  Document document(ball(), std::move(settings));
  const std::uint64_t before = document.head()->content_hash();
  post(document, deep_tap(0.35));
  document.settle();
  EXPECT_NEAR(lowest(*document.head()), 0.65, 0.02);
  const std::uint64_t after = document.head()->content_hash();
  EXPECT_EQ(with.of<StrokeFinished>().back().result.limited, 0U);
  EXPECT_LE(with.of<RoomAsked>().size(), 2U) << "while the stroke goes on, and at its end";
  for (const RoomAsked& each : with.of<RoomAsked>()) EXPECT_TRUE(each.runs_out);
  ASSERT_GE(with.of<RoomEnded>().size(), 1U);
  EXPECT_GT(with.of<RoomEnded>()[0].fibres, 0U);
  EXPECT_TRUE(validate(*document.head()));
  document.post(Undo{});
  document.settle();
  EXPECT_EQ(document.head()->content_hash(), before) << "one step takes back the stroke and its room";
  document.post(Redo{});
  document.settle();
  EXPECT_EQ(document.head()->content_hash(), after);
  document.post(Undo{});
  post(document, stroke_over_ball(3));
  document.settle();
  EXPECT_TRUE(validate(*document.head()));
}

TEST(RoomUnderAStroke, ALumpGrowsOn) {
  Events events;
  DocumentSettings settings = events.settings();
  settings.make_room = twice_as_long;
  Document document(ball(), std::move(settings));
  post(document, long_deposit());
  document.settle();
  EXPECT_EQ(events.of<StrokeFinished>().back().result.limited, 0U);
  EXPECT_GE(events.of<RoomEnded>().size(), 1U);
  const SurfacePoint top =
      *raycast(*document.head(), {{6, 0, 8}, {-0.6, 0, -0.8}}).transform([](RayHit h) { return h.point; });
  EXPECT_GT(length(top.position), 1.3) << "it could be 1.2 before";
}

TEST(RoomUnderAStroke, IsTheSameForAHandThatIsStillAtIt) {
  Events events;
  DocumentSettings settings = events.settings();
  settings.make_room = twice_as_long;
  Document whole(ball(), settings), live(ball(), settings);
  const Stroke stroke = long_deposit();
  post(whole, stroke);
  whole.settle();
  live.post(BeginStroke{.brush = stroke.brush, .tip = stroke.tip, .label = stroke.label, .source = 0});
  for (const StrokePoint& p : stroke.points) {
    live.post(MoveStroke{{p}, 0});
    live.settle();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  live.post(EndStroke{0});
  live.settle();
  EXPECT_EQ(live.head()->content_hash(), whole.head()->content_hash());
}

/// Folded samples of a slab: between all three fibres of its root, and on the edge between the first two.
struct FoldedSamples {
  std::size_t inside = 0, edge = 0;
};
SampledAnew folded(SlabId slab, std::uint8_t moved, FoldedSamples samples) {
  SampledAnew all{.slab = slab, .moved = moved};
  all.folded[7] = samples.inside;
  all.folded[3] = samples.edge;
  return all;
}

TEST(RoomUnderAStroke, TellsOfAllRoomsThatAStrokeGot) {
  Events events;
  DocumentSettings settings = events.settings();
  const double before = length(ball().head->slab_mesh().root_fibres()[0].direction());
  settings.make_room = [&](const SnapshotPtr& surface, const RoomWanted&, const Progress&) -> Result<Room> {
    // The first one is not enough.
    const bool first = length(surface->slab_mesh().root_fibres()[0].direction()) < 1.01 * before;
    return Room{.model = with_longer_fibres(surface, first ? 0.2 : 1, 0),
                .fibres = 1,
                .overhang = first ? 0.25 : 0.125,
                .sampled = first ? std::vector<SampledAnew>{folded(7, 7, {.inside = 3}), folded(8, 7, {.inside = 2}),
                                                            folded(9, 7, {.inside = 1, .edge = 16})}
                                 : std::vector<SampledAnew>{folded(8, 7, {.inside = 4}),
                                                            folded(9, 4, {.inside = 0, .edge = 0})}};
  };
  Document document(ball(), std::move(settings));
  post(document, deep_tap(0.35));
  document.settle();
  EXPECT_EQ(events.of<StrokeFinished>().back().result.limited, 0U);
  EXPECT_EQ(events.of<StrokeFinished>().back().overhang, 0.25) << "the widest";
  EXPECT_EQ(events.of<StrokeFinished>().back().folded, 3U + 4U + 16U)
      << "a sample that was taken twice counts as it is now, one on an edge whose fibres stayed as it was";
  EXPECT_EQ(events.of<RoomEnded>().back().folded, 4U);
}

/// A ball whose fibres lean, or stand upright; fibres of the same numbers, and the same surface.
SnapshotPtr ball_of_fibres(bool lean, double bumps = 0) {
  return testing::displaced(testing::mapped_shell(*testing::sphere_shell(2, 16), testing::leaning(lean ? 1 : 0)),
                            [bumps](Vec3d p) { return 0.5 + bumps * std::sin(40 * p.x); });
}
Model leaning_ball() {
  Model model = ball();
  model.head = ball_of_fibres(true);
  return model;
}
/// A ball that goes 0.15 deep at the equator of that ball, whose clay is 0.2 thick.
Stroke tap_with_walls() {
  Stroke stroke;
  stroke.brush = {.tool = Tool::Carve, .radius = 0.16, .strength = 1};
  stroke.brush.detail = 0;
  stroke.brush.exact = true;
  stroke.label = "tap";
  stroke.tip = true;
  const Vec3d low = normalized(Vec3d{1, 0.2, 0.1}) * 0.83;
  stroke.points = {{0, low, 1}, {0.1, low, 1}};
  return stroke;
}

// There is clay enough. What leaning fibres take from beside the tool, fibres that stand upright keep.
TEST(RoomUnderAStroke, IsAskedForWhereAToolTakesWhatLiesBesideIt) {
  Events events;
  DocumentSettings settings = events.settings();
  int asked = 0;
  settings.make_room = [&](const SnapshotPtr&, const RoomWanted&, const Progress&) -> Result<Room> {
    ++asked;
    return Room{.model = ball_of_fibres(false), .fibres = 1};
  };
  Document document(leaning_ball(), std::move(settings));
  post(document, tap_with_walls());
  document.settle();
  EXPECT_EQ(asked, 1) << "at the end";
  ASSERT_EQ(events.of<RoomAsked>().size(), 1U);
  EXPECT_FALSE(events.of<RoomAsked>()[0].runs_out);
  EXPECT_TRUE(events.of<StrokeFinished>().back().result.changed);
  EXPECT_FALSE(events.of<StrokeFinished>().back().result.beside);
  EXPECT_TRUE(events.of<TakenBeside>().empty());
}

// Room is sampled from the surface, and is a little off it. The tool means what it meant.
TEST(RoomUnderAStroke, AToolKeepsItsAxisOnOtherFibres) {
  Events events;
  DocumentSettings settings = events.settings();
  settings.make_room = [](const SnapshotPtr&, const RoomWanted&, const Progress&) -> Result<Room> {
    return Room{.model = ball_of_fibres(false, 0.02), .fibres = 1};
  };
  Document document(leaning_ball(), std::move(settings));
  std::vector<Dab> first, again;
  bool is_again = false;
  document.watch([&](const EditNote& note) {
    if (std::holds_alternative<StrokeAgain>(note)) is_again = true;
    if (const auto* made = std::get_if<DabMade>(&note)) (is_again ? again : first).push_back(made->dab);
  });
  post(document, tap_with_walls());
  document.settle();
  document.watch({});
  ASSERT_FALSE(again.empty());
  ASSERT_EQ(first.size(), again.size());
  for (std::size_t k = 0; k < first.size(); ++k) {
    EXPECT_EQ(first[k].normal, again[k].normal);
    EXPECT_EQ(first[k].cursor, again[k].cursor);
    EXPECT_EQ(first[k].swept, again[k].swept);
  }
}

TEST(RoomUnderAStroke, MayHaveHalvedRoots) {
  const testing::Folder folder;
  const auto path = folder / "halved.relief";
  ASSERT_TRUE(ModelFile::create(path, ball()));
  std::uint64_t before = 0, after = 0;
  {
    Events events;
    DocumentSettings settings = events.settings();
    // The second room halves roots that the first has sampled again.
    settings.make_room = [](const SnapshotPtr& surface, const RoomWanted&, const Progress&) -> Result<Room> {
      const SnapshotPtr longer = with_longer_fibres(surface, 0.3, 0);
      const SlabId root = 40, last = surface->slab_mesh().slab_count() - 1;
      if (length(surface->slab_mesh().root_fibres()[0].direction()) < 0.41)  // as they are made
        return Room{.model = longer, .fibres = 1, .sampled = {folded(root, 7, {5, 0}), folded(last, 7, {3, 0})}};
      const testing::Halved halved = testing::halved(longer, root);
      return Room{.model = halved.model, .fibres = 1, .sampled = {folded(last + 1, 7, {2, 0})}, .halved = halved.roots};
    };
    auto document = Document::open(path, ModelFile::open(path).value(), std::move(settings));
    ASSERT_TRUE(document) << document.error().message;
    before = document->head()->content_hash();
    post(*document, deep_tap(0.35));
    document->settle();
    ASSERT_GE(events.of<RoomEnded>().size(), 2U) << "perhaps one more while the stroke goes on";
    const SlabMesh& mesh = document->head()->slab_mesh();
    EXPECT_EQ(mesh.roots().size(), ball().head->slab_mesh().roots().size() + 2);
    EXPECT_EQ(events.of<StrokeFinished>().back().folded, 5U) << "what was told of halved roots is told of their halves";
    EXPECT_TRUE(validate(*document->head()));
    after = document->head()->content_hash();
    for (int times = 0; times < 2; ++times) {
      document->post(Undo{});
      document->settle();
      EXPECT_EQ(document->head()->content_hash(), before);
      document->post(Redo{});
      document->settle();
      EXPECT_EQ(document->head()->content_hash(), after);
    }
  }
  const auto file = ModelFile::open(path, true);
  ASSERT_TRUE(file) << file.error().message;
  EXPECT_EQ(file->model().head->content_hash(), after);
  EXPECT_EQ((*file->at(0))->content_hash(), before);
  EXPECT_EQ((*file->as_made(1))->content_hash(), before) << "its slabs are those of the model as it was made";
}

TEST(RoomUnderAStroke, CannotAlwaysBeMade) {
  Events events;
  DocumentSettings settings = events.settings();
  std::atomic<int> asked = 0;
  settings.make_room = [&](const SnapshotPtr&, const RoomWanted& wanted, const Progress&) -> Result<Room> {
    ++asked;
    EXPECT_FALSE(wanted.cut.empty());
    return Room{.model = nullptr,
                .lacking = 7,
                .bar = RoomBar::Fibres,
                .bar_at = {1, 2, 3},
                .overhang = 0.25,
                .overhang_at = {4, 5, 6}};
  };
  Document document(ball(), std::move(settings));
  post(document, deep_tap(0.35));
  document.settle();

  EXPECT_GE(asked, 1);
  EXPECT_LE(asked, 2) << "while the stroke goes on, and at its end";
  EXPECT_GT(events.of<StrokeFinished>().back().result.limited, 0U);
  EXPECT_TRUE(events.of<StrokeFinished>().back().result.changed);
  ASSERT_GE(events.of<RoomEnded>().size(), 1U);
  EXPECT_EQ(events.of<RoomEnded>()[0].fibres, 0U);
  EXPECT_EQ(events.of<RoomEnded>()[0].lacking, 7U);
  EXPECT_EQ(events.of<RoomEnded>()[0].bar_at, Vec3d(1, 2, 3));
  EXPECT_EQ(events.of<RoomEnded>()[0].overhang, 0.25);
  EXPECT_EQ(events.of<RoomEnded>()[0].overhang_at, Vec3d(4, 5, 6));
  EXPECT_EQ(events.of<StrokeFinished>().back().overhang_at, Vec3d(4, 5, 6));
  EXPECT_EQ(events.of<StrokeFinished>().back().overhang, 0.25) << "an undercut is told with the stroke";
  // A stroke that has enough asks nobody.
  post(document, stroke_over_ball(0));
  document.settle();
  EXPECT_LE(asked, 2);
  EXPECT_EQ(events.of<StrokeFinished>().back().overhang, 0);
  EXPECT_EQ(events.of<StrokeFinished>().back().overhang_at, Vec3d());
}

TEST(RoomUnderAStroke, CanBeCancelled) {
  Events events;
  DocumentSettings settings = events.settings();
  std::atomic<int> asked = 0;
  settings.make_room = [&](const SnapshotPtr&, const RoomWanted&, const Progress& progress) -> Result<Room> {
    ++asked;
    while (!progress.cancelled()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return fail(Errc::Cancelled, "cancelled");
  };
  Document document(ball(), std::move(settings));
  const std::uint64_t before = document.head()->content_hash();
  const Stroke stroke = deep_tap(0.35);
  document.post(BeginStroke{.brush = stroke.brush, .tip = false, .label = "deep", .source = 4});
  document.post(MoveStroke{stroke.points, 4});
  while (asked < 1) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  document.post(CancelStroke{4});
  document.settle();
  EXPECT_EQ(document.head()->content_hash(), before);
  EXPECT_TRUE(events.of<StrokeFinished>().back().cancelled);
  post(document, stroke, 4);
  // While room is made for it or at its end, whichever comes first.
  while (events.of<StrokeFinished>().size() < 2) {
    document.post(CancelStroke{4});
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_TRUE(events.of<StrokeFinished>().back().cancelled);
  EXPECT_EQ(document.head()->content_hash(), before);
  EXPECT_TRUE(document.close());
}

// A stroke that has got room while it went on is played again at its end: that takes as long as the stroke.
TEST(RoomUnderAStroke, WhatComesAgainAtItsEndShowsProgressAndCanBeCancelled) {
  Events events;
  Document* told = nullptr;
  std::atomic<bool> ends = false;
  std::atomic<int> steps = 0;
  DocumentSettings settings = events.settings();
  settings.make_room = twice_as_long;
  settings.on_event = [&](const Event& event) {
    events.add(event);
    if (ends && std::holds_alternative<Progressed>(event) && ++steps == 3) told->post(CancelStroke{4});
  };
  Document document(ball(), std::move(settings));
  told = &document;
  const std::uint64_t before = document.head()->content_hash();
  Stroke stroke = deep_tap(0.35);
  document.post(BeginStroke{.brush = stroke.brush, .tip = false, .label = "deep", .source = 4});
  document.post(MoveStroke{stroke.points, 4});
  while (events.of<RoomEnded>().empty()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  for (int k = 0; k < 1000; ++k) stroke.points.push_back({0.2 + 1e-3 * k, {0.6, 0, 0.8}, 1});
  document.post(MoveStroke{{stroke.points.begin() + 2, stroke.points.end()}, 4});
  document.settle();
  ends = true;
  document.post(EndStroke{4});
  document.settle();
  EXPECT_GE(steps, 3);
  EXPECT_TRUE(events.of<StrokeFinished>().back().cancelled);
  EXPECT_EQ(document.head()->content_hash(), before);
}

/// What a process tells that sculpts: a state that its file has, or that it begins to make room.
struct Told {
  bool saved = false;
  std::uint64_t strokes = 0, hash = 0;
};

/// Sculpts a file without end, with strokes that need room and such that do not. Making room takes some milliseconds,
/// or does not end. Never returns.
[[noreturn]] void sculpt_and_tell(const std::filesystem::path& path, int pipe, bool room_ends) {
  const auto tell = [pipe](const Told& told) {
    if (::write(pipe, &told, sizeof told) != sizeof told) ::_exit(2);
  };
  Events events;
  DocumentSettings settings = events.settings();
  settings.make_room = [&](const SnapshotPtr& surface, const RoomWanted& wanted, const Progress& progress) {
    tell({.saved = false});
    do std::this_thread::sleep_for(std::chrono::milliseconds(4));
    while (!room_ends);
    return twice_as_long(surface, wanted, progress);
  };
  auto file = ModelFile::open(path);
  if (!file) ::_exit(3);
  auto document = Document::open(path, *std::move(file), std::move(settings));
  if (!document) ::_exit(4);
  for (int k = 0;; ++k) {
    post(*document, k % 3 == 1 ? deep_tap(0.35 + 0.1 * k) : stroke_over_ball(k));
    document->settle();
    const std::uint64_t strokes = document->statistics().undo_steps, hash = document->head()->content_hash();
    while (document->statistics().unsaved > 0) std::this_thread::sleep_for(std::chrono::microseconds(100));
    tell({.saved = true, .strokes = strokes, .hash = hash});
  }
}

TEST(RoomUnderAStroke, KilledWhileItIsMadeNoFinishedStrokeIsLost) {
  const int rounds = std::getenv("RELIEF_SOAK") != nullptr ? 200 : 10;
  const testing::Folder folder;
  const auto path = folder / "killed.relief";
  for (int round = 0; round < rounds; ++round) {
    ASSERT_TRUE(ModelFile::create(path, ball()));
    const bool room_ends = round % 2 == 1;
    // Killed while room is made for the second stroke; or some time after it is begun for the fifth, when the second
    // stands in the file.
    const std::uint64_t stand = room_ends ? 4 : 1;
    const auto told = testing::told_by_killed_child<Told>([&](int pipe) { sculpt_and_tell(path, pipe, room_ends); },
                                                          [&](const std::vector<Told>& so_far) {
                                                            return so_far.size() > 1 && !so_far.back().saved &&
                                                                   so_far.rbegin()[1].strokes >= stand;
                                                          },
                                                          static_cast<unsigned>(round * 7919 % 20000));

    const auto last = std::find_if(told.rbegin(), told.rend(), [](const Told& t) { return t.saved; });
    ASSERT_NE(last, told.rend());
    const auto file = ModelFile::open(path);
    ASSERT_TRUE(file) << file.error().message;
    ASSERT_GE(file->stroke_count(), last->strokes);
    const auto state = file->at(last->strokes);
    ASSERT_TRUE(state) << state.error().message;
    EXPECT_EQ((*state)->content_hash(), last->hash);
    EXPECT_TRUE(validate(*file->model().head));
    const auto fibre_of = [](const Snapshot& model) { return length(model.slab_mesh().root_fibres()[0].direction()); };
    EXPECT_EQ(fibre_of(**state) > 2 * fibre_of(*ball().head), room_ends) << "the second stroke got its room";
    if (!room_ends) {
      EXPECT_EQ(file->stroke_count(), 1U) << "the stroke that waits for room has left nothing";
    }
  }
}

/// All slabs cut once.
Result<SnapshotPtr> finer(const SnapshotPtr& model, const ChangeCage::AsMade&, const Progress&) {
  Detail detail;
  for (SlabId s = 0; s < model->slab_mesh().slab_count(); ++s) detail.cuts.push_back(s);
  return with_detail(model, detail);
}

TEST(ChangeOfTheCage, IsAStepOfTheHistory) {
  Events events;
  Document document(ball(), events.settings());
  std::vector<std::uint64_t> hashes = {document.head()->content_hash()};
  const auto next = [&] {
    document.settle();
    hashes.push_back(document.head()->content_hash());
  };
  post(document, stroke_over_ball(0));
  next();
  const SlabId before = document.head()->slab_mesh().slab_count();
  document.post(ChangeCage{.label = "finer", .details = {}, .make = finer});
  while (events.of<CageChanged>().empty()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  next();
  EXPECT_TRUE(events.of<CageChanged>()[0].changed);
  EXPECT_EQ(events.of<CageChanged>()[0].surface_moved, 0);
  EXPECT_EQ(document.head()->slab_mesh().slab_count(), 4 * before);
  post(document, stroke_over_ball(4));
  next();
  EXPECT_EQ(document.labels(), (std::vector<std::string>{"stroke 1", "finer", "stroke 5"}));
  for (std::size_t k = hashes.size() - 1; k > 0; --k) {
    document.post(Undo{});
    document.settle();
    EXPECT_EQ(document.head()->content_hash(), hashes[k - 1]);
  }
  for (std::size_t k = 1; k < hashes.size(); ++k) {
    document.post(Redo{});
    document.settle();
    EXPECT_EQ(document.head()->content_hash(), hashes[k]);
  }
}

TEST(ChangeOfTheCage, IsMadeAgainWhereTheModelHasChangedMeanwhile) {
  Events events;
  Document document(ball(), events.settings());
  std::atomic<int> made = 0;
  document.post(ChangeCage{.label = "finer",
                           .details = {},
                           .make = [&](const SnapshotPtr& model, const auto& as_made, const Progress& progress) {
                             // Whoever asks first loses.
                             if (made++ < 2) {
                               post(document, stroke_over_ball(made));
                               document.settle();
                             }
                             return finer(model, as_made, progress);
                           }});
  while (events.of<CageChanged>().empty()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_EQ(made, 3);
  EXPECT_TRUE(events.of<CageChanged>()[0].changed);
  EXPECT_EQ(document.labels().back(), "finer");
  EXPECT_EQ(document.labels().size(), 3U) << "no stroke was lost";
  document.post(Undo{});
  document.settle();
  const SlabId before = document.head()->slab_mesh().slab_count();
  document.post(Redo{});
  document.settle();
  EXPECT_EQ(document.head()->slab_mesh().slab_count(), 4 * before);
}

// What it asked for may have gone with the steps that a stroke has replaced.
TEST(ChangeOfTheCage, ThatFailsOnAModelThatHasChangedMeanwhileIsMadeAgain) {
  Events events;
  Document document(ball(), events.settings());
  std::atomic<int> made = 0;
  document.post(ChangeCage{
      .label = "finer",
      .details = {},
      .make = [&](const SnapshotPtr& model, const auto& as_made, const Progress& progress) -> Result<SnapshotPtr> {
        if (made++ > 0) return finer(model, as_made, progress);
        post(document, stroke_over_ball(1));
        document.settle();
        return fail(Errc::NotFound, "the step is gone");
      }});
  while (events.of<CageChanged>().empty()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_EQ(made, 2);
  EXPECT_TRUE(events.of<Failed>().empty());
  EXPECT_TRUE(events.of<CageChanged>()[0].changed);
}

TEST(ChangeOfTheCage, ThatFailsOrIsCancelledLeavesNothing) {
  Events events;
  Document document(ball(), events.settings());
  const std::uint64_t before = document.head()->content_hash();
  document.post(ChangeCage{.label = "no",
                           .details = {},
                           .make = [](const SnapshotPtr&, const auto&, const Progress&) -> Result<SnapshotPtr> {
                             return fail(Errc::InvalidArgument, "it cannot be done");
                           }});
  std::atomic<bool> making = false;
  document.post(
      ChangeCage{.label = "never",
                 .details = {},
                 .make = [&](const SnapshotPtr&, const auto&, const Progress& progress) -> Result<SnapshotPtr> {
                   making = true;
                   while (!progress.cancelled()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
                   return fail(Errc::Cancelled, "cancelled");
                 }});
  while (!making) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  document.post(CancelChanges{});
  while (events.of<CageChanged>().size() < 2) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_EQ(events.of<Failed>().size(), 1U) << "a cancelled one is no failure";
  EXPECT_EQ(document.head()->content_hash(), before);
  EXPECT_TRUE(document.labels().empty());
}

/// Waits until all that was done is in the file.
void save(Document& document) {
  document.settle();
  while (document.statistics().unsaved > 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

/// What a change of the cage gets as the model when its slabs were new; 0 where nobody has it.
std::uint64_t hash_as_made(Document& document, Events& events) {
  std::atomic<std::uint64_t> hash = 1;
  const std::size_t before = events.of<CageChanged>().size();
  document.post(
      ChangeCage{.label = "asks",
                 .details = {},
                 .make = [&](const SnapshotPtr&, const auto& as_made, const Progress& progress) -> Result<SnapshotPtr> {
                   const Result<SnapshotPtr> made = as_made(progress);
                   if (!made) return made;
                   hash = *made ? (*made)->content_hash() : 0;
                   return SnapshotPtr();
                 }});
  while (events.of<CageChanged>().size() == before) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_FALSE(events.of<CageChanged>().back().failed);
  return hash;
}

/// Other slabs, with the surface a little further out.
SnapshotPtr other_slabs() {
  return testing::displaced(testing::sphere_shell(1, 16), [](Vec3d) { return 0.55; });
}
Result<SnapshotPtr> with_other_slabs(const SnapshotPtr&, const ChangeCage::AsMade&, const Progress&) {
  return other_slabs();
}

TEST(ChangeOfTheCage, TellsHowFarItsMakerSaysThatTheSurfaceMoved) {
  Events events;
  Document document(ball(), events.settings());
  for (const SnapshotPtr& model : {other_slabs(), SnapshotPtr()})
    document.post(
        ChangeCage{.label = "moves", .details = {}, .make = [model](const SnapshotPtr&, const auto&, const Progress&) {
                     return Result<ChangeCage::Made>(ChangeCage::Made(model, 0.02));
                   }});
  while (events.of<CageChanged>().size() < 2) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_TRUE(events.of<CageChanged>()[0].changed);
  EXPECT_EQ(events.of<CageChanged>()[0].surface_moved, 0.02);
  EXPECT_FALSE(events.of<CageChanged>()[1].changed);
  EXPECT_EQ(events.of<CageChanged>()[1].surface_moved, 0) << "nothing has changed";
}

// New slabs may have the corners of the old ones, as in a cage of a few slabs.
TEST(ChangeOfTheCage, SlabsWithTheSameCornersMayBeNew) {
  const SnapshotPtr first = ball().head;
  const auto mapped = [&](auto&& map) {
    return testing::displaced(testing::mapped_shell(first->slab_mesh(), map), [](Vec3d) { return 0.5; });
  };
  const SnapshotPtr longer = mapped([](Vec3d p) { return p + normalized(p) * (0.2 * (length(p) - 1)); });
  const SnapshotPtr anew = mapped(testing::turned_askew);
  Events events;
  Document document(ball(), events.settings());
  const auto change_to = [&](const SnapshotPtr& model) {
    document.post(ChangeCage{
        .label = "change",
        .details = {},
        .make = [model](const SnapshotPtr&, const auto&, const Progress&) -> Result<SnapshotPtr> { return model; }});
    while (document.head() != model) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  };
  change_to(longer);
  EXPECT_EQ(hash_as_made(document, events), first->content_hash()) << "all of its fibres are longer";
  change_to(anew);
  EXPECT_EQ(hash_as_made(document, events), anew->content_hash());
}

TEST(ChangeOfTheCage, GetsTheModelAsItWasWhenItsSlabsWereNew) {
  const testing::Folder folder;
  const auto path = folder / "a.relief";
  const std::uint64_t first = ball().head->content_hash(), anew = other_slabs()->content_hash();
  {
    Events events;
    // So small a budget that only the file has the old states.
    Document document = testing::document_in(path, ball(), events.settings(1));
    for (int k = 0; k < 3; ++k) post(document, stroke_over_ball(k));
    save(document);
    EXPECT_EQ(hash_as_made(document, events), first);
    document.post(ChangeCage{.label = "new", .details = {}, .make = with_other_slabs});
    while (document.head()->content_hash() != anew) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    EXPECT_EQ(hash_as_made(document, events), anew);
    for (int k = 0; k < 3; ++k) post(document, stroke_over_ball(k));
    save(document);
    EXPECT_EQ(hash_as_made(document, events), anew) << "from the file";
    ASSERT_TRUE(document.close());
  }
  Events events;
  auto document = Document::open(path, ModelFile::open(path).value(), events.settings());
  ASSERT_TRUE(document);
  EXPECT_EQ(hash_as_made(*document, events), anew);
  document->post(Undo{4});
  document->settle();
  EXPECT_EQ(hash_as_made(*document, events), first) << "the slabs before";
}

// With what is left of a history nobody knows what the tools have moved.
TEST(ChangeOfTheCage, GetsNothingWhereTheHistoryBeginsAfterStrokes) {
  const testing::Folder folder;
  const auto path = folder / "a.relief", kept = folder / "b.relief", whole = folder / "c.relief";
  {
    Document document = testing::document_in(path, ball());
    for (int k = 0; k < 3; ++k) post(document, stroke_over_ball(k));
    ASSERT_TRUE(document.close());
  }
  const auto saved_elsewhere = [](Document& document, Events& events, const std::filesystem::path& to) {
    document.post(SaveElsewhere{to});
    while (events.of<SavedElsewhere>().empty()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  };
  {
    Events events;
    auto document = Document::open(path, ModelFile::open(path).value(), events.settings());
    ASSERT_TRUE(document);
    std::filesystem::remove(path);
    saved_elsewhere(*document, events, kept);
    EXPECT_EQ(hash_as_made(*document, events), 0U);
    post(*document, stroke_over_ball(4));
    ASSERT_TRUE(document->close());
  }
  {
    Events events;
    auto document = Document::open(kept, ModelFile::open(kept).value(), events.settings());
    ASSERT_TRUE(document);
    EXPECT_EQ(hash_as_made(*document, events), 0U) << "the file says so, too";
  }
  Events events, dropping;
  Document document(ball(), events.settings());
  post(document, stroke_over_ball(0));
  document.settle();
  EXPECT_EQ(hash_as_made(document, events), ball().head->content_hash());
  saved_elsewhere(document, events, whole);
  EXPECT_EQ(ModelFile::open(whole, true).value().first_state(), FirstState::AsMade);
  Document small(ball(), dropping.settings(1));
  for (int k = 0; k < 3; ++k) post(small, stroke_over_ball(k));
  small.settle();
  ASSERT_FALSE(dropping.of<HistoryDropped>().empty());
  EXPECT_EQ(hash_as_made(small, dropping), 0U);
  saved_elsewhere(small, dropping, path);
  EXPECT_EQ(ModelFile::open(path, true).value().first_state(), FirstState::Sculpted);
}

// It is read on the thread of the change: the document goes on meanwhile, and the change can be cancelled.
TEST(ChangeOfTheCage, CanBeCancelledWhileTheFileIsRead) {
  const testing::Folder folder;
  Events events;
  Document document = testing::document_in(folder / "a.relief", ball(), events.settings(1));
  for (int k = 0; k < 3; ++k) post(document, stroke_over_ball(k));
  save(document);
  std::atomic<bool> reading = false;
  document.post(
      ChangeCage{.label = "reads",
                 .details = {},
                 .make = [&](const SnapshotPtr&, const auto& as_made, const Progress& progress) -> Result<SnapshotPtr> {
                   reading = true;
                   while (true) {
                     if (auto made = as_made(progress); !made) return made;
                   }
                 }});
  while (!reading) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  post(document, stroke_over_ball(5));
  document.settle();
  EXPECT_EQ(document.labels().size(), 4U) << "strokes go on";
  document.post(CancelChanges{});
  while (events.of<CageChanged>().empty()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_TRUE(events.of<CageChanged>()[0].cancelled);
  ASSERT_TRUE(document.close());
}

}  // namespace
}  // namespace relief
