// The document: one writer, one history, a saver that nobody waits for.
#include "document_support.h"
#include "relief/session/stroke_text.h"

#include <relief/core/detail.h>

#include <sys/resource.h>

#include <atomic>
#include <csignal>
#include <random>
#include <set>
#include <span>
#include <thread>

namespace relief {
namespace {

using testing::ball;
using testing::document_in;
using testing::Events;
using testing::Folder;
using testing::post;
using testing::stroke_over_ball;

std::uint64_t hash_of(const Document& document) { return document.head()->content_hash(); }

/// Hashes of the start and of what each of `count` strokes leads to.
std::vector<std::uint64_t> draw(Document& document, int count) {
  std::vector<std::uint64_t> hashes = {hash_of(document)};
  for (int k = 0; k < count; ++k) {
    post(document, stroke_over_ball(k));
    document.settle();
    hashes.push_back(hash_of(document));
    EXPECT_NE(hashes[hashes.size() - 2], hashes.back()) << k;
  }
  return hashes;
}

/// Undoes all one by one, then redoes all, and compares with the hashes.
void walk(Document& document, const std::vector<std::uint64_t>& hashes) {
  for (std::size_t k = hashes.size() - 1; k > 0; --k) {
    document.post(Undo{});
    document.settle();
    ASSERT_EQ(hash_of(document), hashes[k - 1]) << "undone to " << k - 1;
  }
  for (std::size_t k = 1; k < hashes.size(); ++k) {
    document.post(Redo{});
    document.settle();
    ASSERT_EQ(hash_of(document), hashes[k]) << "redone to " << k;
  }
}

TEST(Document, StrokesAreStepsOfOneHistory) {
  Events events;
  Document document(ball(), events.settings());
  const std::vector<std::uint64_t> hashes = draw(document, 6);
  walk(document, hashes);
  EXPECT_EQ(document.labels().size(), 6U);
  EXPECT_EQ(document.labels()[2], "stroke 3");
  document.post(Undo{4});
  document.settle();
  EXPECT_EQ(hash_of(document), hashes[2]);
  const HistoryChanged undone = events.of<HistoryChanged>().back();
  EXPECT_EQ(undone.undo_steps, 2U);
  EXPECT_EQ(undone.redo_steps, 4U);
  EXPECT_EQ(undone.undo_label, "stroke 2");
  EXPECT_EQ(undone.redo_label, "stroke 3");
  post(document, stroke_over_ball(11));
  document.post(Redo{9});
  document.settle();
  const HistoryChanged ended = events.of<HistoryChanged>().back();
  EXPECT_EQ(ended.undo_steps, 3U) << "a stroke after an undo ends the redo";
  EXPECT_EQ(ended.redo_steps, 0U);
  EXPECT_EQ(document.labels().back(), "stroke 12");
  document.post(Undo{100});
  document.settle();
  EXPECT_EQ(hash_of(document), hashes[0]) << "fewer steps at the end";
  EXPECT_TRUE(document.close());
}

TEST(Document, ThePublishedHeadIsWhatReadersSee) {
  Events events;
  Document document(ball(), events.settings());
  {
    SnapshotChannel::Reader reader = document.reader();
    post(document, stroke_over_ball(0));
    document.settle();
    EXPECT_EQ(&reader.latest(), document.head().get());
    EXPECT_EQ(events.of<SnapshotChanged>().back().number, document.head()->number());
  }
  EXPECT_TRUE(document.close());
  EXPECT_TRUE(document.close()) << "again harmless";
}

/// Samples that lie elsewhere in the second model; each must lie in one of the boxes with both its places.
std::size_t moved_inside(const Snapshot& a, const Snapshot& b, std::span<const SnapshotChanged> told) {
  const auto inside = [&](Vec3d p) {
    return std::ranges::any_of(told, [&](const SnapshotChanged& change) { return change.box.distance2(p) == 0; });
  };
  std::size_t moved = 0, outside = 0;
  for (SlabId s = 0; s < a.slab_mesh().slab_count(); ++s) {
    const int n = a.slab_mesh().intervals(s);
    for (int i = 0; i <= n; ++i) {
      for (int j = 0; i + j <= n; ++j) {
        const double u = static_cast<double>(i) / n, v = static_cast<double>(j) / n;
        const auto there = heir(a.slab_mesh(), b.slab_mesh(), {s, u, v, 0});
        const Vec3d p = surface_point(a, s, u, v).position;
        const Vec3d q = surface_point(b, there->slab, there->u, there->v).position;
        if (length(p - q) < 1e-6) continue;  // finer grids move it by the rounding of a float
        ++moved;
        outside += inside(p) && inside(q) ? 0U : 1U;
      }
    }
  }
  EXPECT_EQ(outside, 0U) << "of " << moved;
  return moved;
}

TEST(Document, WhatChangesLiesInTheBoxesThatAreTold) {
  for (const int k : {0, 1, 3, 4}) {
    Events events;
    Document document(ball(), events.settings());
    const SnapshotPtr before = document.head();
    post(document, stroke_over_ball(k));
    document.settle();
    const SnapshotPtr after = document.head();
    auto told = events.of<SnapshotChanged>();
    const std::size_t moved = moved_inside(*before, *after, told);
    if (k != 3) {
      EXPECT_GT(moved, 20U) << "tool " << k;
    }
    // Less than the whole: a picture need not be drawn anew for a stroke.
    EXPECT_LT(diagonal(told.front().box), 2.0) << k;
    document.post(Undo{});
    document.settle();
    told = events.of<SnapshotChanged>();
    moved_inside(*after, *document.head(), std::span(told).last(1));
  }
}

TEST(Document, ACancelTellsAllThatTheStrokeHadChanged) {
  Events events;
  Document document(ball(), events.settings());
  const Stroke stroke = stroke_over_ball(0, 60);
  document.post(BeginStroke{.brush = stroke.brush, .tip = false, .label = {}, .source = 0});
  document.post(MoveStroke{stroke.points, 0});
  document.settle();
  const SnapshotPtr middle = document.head();
  EXPECT_GT(events.of<SnapshotChanged>().size(), 2U);
  document.post(CancelStroke{});
  document.settle();
  const auto told = events.of<SnapshotChanged>();
  EXPECT_GT(moved_inside(*middle, *document.head(), std::span(told).last(1)), 100U);
}

TEST(Document, ALayerThatComesMayChangeHowAllOfTheSurfaceLooks) {
  Events events;
  Document document(ball(), events.settings());
  post(document, stroke_over_ball(2));
  document.settle();
  ASSERT_TRUE(document.head()->has(Layer::Colour));
  const Box3d all = document.head()->slab_mesh().bounds(), first = events.of<SnapshotChanged>().front().box;
  EXPECT_EQ(first.low, all.low);
  EXPECT_EQ(first.high, all.high);
  EXPECT_LT(diagonal(events.of<SnapshotChanged>().back().box), 2.0) << "the dabs after it do not";
}

TEST(Document, TheFileHasEachStrokeWithTheTextThatMakesItAgain) {
  const Folder folder;
  std::vector<std::uint64_t> hashes;
  {
    Document document = document_in(folder / "a.relief", ball());
    hashes = draw(document, 5);
    // As a hand tells it: point by point, some of them no points of a way.
    Stroke live = stroke_over_ball(5, 40);
    live.tip = true;
    live.brush = {.tool = Tool::Carve, .radius = 0.2, .resilience = 0.01, .stabiliser = 0.02, .symmetry = 1};
    for (StrokePoint& p : live.points) p.position = p.position * 0.97;
    document.post(BeginStroke{.brush = live.brush, .tip = true, .label = {}, .source = 3});
    for (std::size_t k = 0; k < live.points.size(); ++k) {
      document.post(MoveStroke{{live.points[k]}, 3});
      if (k == 20) document.post(MoveStroke{{{std::nan(""), {}, 1}, {0, {1, 0, 0}, 1}, {0.39, {NAN, 0, 0}, 1}}, 3});
      if (k == 25) document.post(MoveStroke{{{live.points[k].t, live.points[k].position, 1.7}}, 3});
    }
    document.post(EndStroke{3});
    document.settle();
    hashes.push_back(hash_of(document));
    ASSERT_TRUE(document.close());
  }
  auto file = ModelFile::open(folder / "a.relief");
  ASSERT_TRUE(file) << file.error().message;
  EXPECT_EQ(file->stroke_count(), 6U);
  EXPECT_EQ(file->model().head->content_hash(), hashes.back());
  const auto journal = file->strokes();
  ASSERT_TRUE(journal);
  EXPECT_EQ((*journal)[0].label, "stroke 1");
  EXPECT_EQ((*journal)[5].label, "carve") << "the tool's name";
  auto start = file->at(0);
  ASSERT_TRUE(start);
  Editor editor(*start);
  for (std::size_t k = 0; k < journal->size(); ++k) {
    const auto stroke = stroke_of((*journal)[k].details, "journal");
    ASSERT_TRUE(stroke) << stroke.error().message;
    EXPECT_TRUE(play(editor, *stroke).changed);
    EXPECT_EQ(editor.head()->content_hash(), hashes[k + 1]) << "stroke " << k + 1;
  }
}

TEST(Document, WherePressureDrivesTheRadiusTheTextMakesTheSameStroke) {
  for (const PressureDrives drives : {PressureDrives::Strength, PressureDrives::Radius, PressureDrives::Both}) {
    const Folder folder;
    std::uint64_t hash = 0;
    {
      Document document = document_in(folder / "a.relief", ball());
      Stroke live = stroke_over_ball(0, 40);
      live.brush.pressure = {.low = 0.1, .high = 0.9, .exponent = 1.4};
      live.brush.pressure_drives = drives;
      live.brush.symmetry = 1;
      for (std::size_t k = 0; k < live.points.size(); ++k)
        live.points[k].pressure = 0.5 - 0.5 * std::cos(0.3 * static_cast<double>(k));
      document.post(BeginStroke{.brush = live.brush, .tip = false, .label = {}, .source = 0});
      for (const StrokePoint& point : live.points) document.post(MoveStroke{{point}, 0});
      document.post(EndStroke{0});
      document.settle();
      hash = hash_of(document);
      ASSERT_TRUE(document.close());
    }
    auto file = ModelFile::open(folder / "a.relief");
    ASSERT_TRUE(file) << file.error().message;
    const auto journal = file->strokes();
    ASSERT_TRUE(journal);
    std::string text = journal->at(0).details;
    const std::string word = R"("pressure_drives":")" + std::string(name(drives)) + R"(",)";
    const std::size_t at = text.find(word);
    EXPECT_EQ(at == std::string::npos, drives == PressureDrives::Strength) << text.substr(0, 200);
    const auto hash_by = [&](const std::string& of) {
      Editor editor(*file->at(0));
      EXPECT_TRUE(play(editor, *stroke_of(of, "journal")).changed);
      return editor.head()->content_hash();
    };
    EXPECT_EQ(hash_by(text), hash);
    if (at == std::string::npos) continue;
    EXPECT_NE(hash_by(text.erase(at, word.size())), hash) << "without the word pressure means strength";
  }
}

TEST(Document, UndoGoesOnIntoTheStrokesThatTheFileHad) {
  const Folder folder;
  std::vector<std::uint64_t> hashes;
  {
    Document document = document_in(folder / "a.relief", ball());
    hashes = draw(document, 5);
    ASSERT_TRUE(document.close());
  }
  {
    auto file = ModelFile::open(folder / "a.relief");
    ASSERT_TRUE(file);
    ASSERT_TRUE(file->undo(1));
    auto opened = Document::open(folder / "a.relief", *std::move(file));
    ASSERT_TRUE(opened) << opened.error().message;
    EXPECT_EQ(opened->statistics().undo_steps, 4U);
    EXPECT_EQ(opened->statistics().redo_steps, 1U);
    opened->post(Redo{});
    opened->settle();
    EXPECT_EQ(hash_of(*opened), hashes[5]);
    post(*opened, stroke_over_ball(8));
    opened->settle();
    hashes.push_back(hash_of(*opened));
    walk(*opened, hashes);
    opened->post(Undo{6});
    ASSERT_TRUE(opened->close());
  }
  auto file = ModelFile::open(folder / "a.relief");
  ASSERT_TRUE(file);
  EXPECT_EQ(file->stroke_count(), 0U);
  EXPECT_EQ(file->redo_count(), 6U);
  EXPECT_EQ(file->model().head->content_hash(), hashes[0]);
  ASSERT_TRUE(file->redo(6));
  EXPECT_EQ(file->model().head->content_hash(), hashes[6]);
}

/// Bytes of the tiles that some of the snapshots have and the newest has not.
std::size_t bytes_beside(const std::vector<std::weak_ptr<const Snapshot>>& all, const SnapshotPtr& newest) {
  std::set<const Tile*> tiles, of_newest;
  std::size_t sum = 0;
  const auto visit = [](const Snapshot& model, auto&& call) {
    for (int k = 0; k < kLayerCount; ++k)
      if (const auto layer = static_cast<Layer>(k); model.has(layer))
        for (SlabId s = 0; s < model.slab_mesh().slab_count(); ++s) call(model.tile(layer, s));
  };
  visit(*newest, [&](const Tile& tile) { of_newest.insert(&tile); });
  for (const auto& one : all)
    if (const SnapshotPtr model = one.lock())
      visit(*model, [&](const Tile& tile) {
        if (!of_newest.contains(&tile) && tiles.insert(&tile).second) sum += tile.bytes();
      });
  return sum;
}

TEST(Document, TheHistoryKeepsToItsBudgetAndLosesNothing) {
  constexpr std::size_t kBudget = std::size_t{64} << 10U;
  const Folder folder;
  Document document = document_in(folder / "a.relief", ball(), {.history_bytes = kBudget, .on_event = {}});
  std::vector<std::uint64_t> hashes = {hash_of(document)};
  std::vector<std::weak_ptr<const Snapshot>> states = {document.head()};
  std::size_t all = 0;
  for (int k = 0; k < 60; ++k) {
    Stroke stroke = stroke_over_ball(k);
    stroke.brush.detail = 0;  // one cage of these alone would be more
    post(document, stroke);
    document.settle();
    hashes.push_back(hash_of(document));
    const SnapshotPtr before = states.back().lock();
    if (before) all += bytes_beside({before}, document.head());
    states.emplace_back(document.head());
  }
  ASSERT_GT(all, 2 * kBudget) << "it would not have fitted";
  // The saver lets go of what it has written before it says so.
  for (DocumentStatistics now = document.statistics(); now.unsaved > 0 || now.history_bytes > kBudget;
       now = document.statistics())
    std::this_thread::yield();
  document.settle();
  EXPECT_LE(document.statistics().history_bytes, kBudget);
  EXPECT_LE(bytes_beside(states, document.head()), kBudget);
  EXPECT_GT(document.statistics().history_held, 5U) << "it is used";
  walk(document, hashes);
  document.post(Undo{35});
  document.settle();
  EXPECT_EQ(hash_of(document), hashes[25]) << "many steps at once";
  document.post(Redo{20});
  document.settle();
  EXPECT_EQ(hash_of(document), hashes[45]);
  ASSERT_TRUE(document.close());
  auto file = ModelFile::open(folder / "a.relief");
  ASSERT_TRUE(file);
  EXPECT_EQ(file->model().head->content_hash(), hashes[45]);
  EXPECT_EQ(file->redo_count(), 15U);
}

TEST(Document, WithoutAFileOldStepsAreDroppedAndThisIsSaid) {
  constexpr std::size_t kBudget = std::size_t{64} << 10U;
  Events events;
  Document document(ball(), events.settings(kBudget));
  const std::vector<std::uint64_t> hashes = draw(document, 60);
  std::uint64_t dropped = 0;
  for (const HistoryDropped& one : events.of<HistoryDropped>()) dropped += one.steps;
  const DocumentStatistics now = document.statistics();
  EXPECT_GT(dropped, 10U);
  EXPECT_EQ(now.undo_steps + dropped, 60U);
  EXPECT_LE(now.history_bytes, kBudget);
  EXPECT_EQ(document.labels().size(), now.undo_steps);
  document.post(Undo{1000});
  document.settle();
  EXPECT_EQ(hash_of(document), hashes[dropped]) << "as far as was said";
  document.post(SetHistoryBytes{0});
  document.settle();
  EXPECT_EQ(document.statistics().redo_steps, 0U) << "nothing is held";
}

TEST(Document, ACancelReachesALongStrokeInside) {
  // The stroke would go round the ball a hundred times; it is cancelled as soon as something of it is seen.
  Events events;
  DocumentSettings settings = events.settings();
  std::atomic<Document*> there{nullptr};
  settings.on_event = [&](const Event& event) {
    events.add(event);
    if (std::holds_alternative<SnapshotChanged>(event) && there.load() != nullptr) there.load()->post(CancelStroke{});
  };
  Document document(ball(), settings);
  there.store(&document);
  const SnapshotPtr before = document.head();
  for (const bool many_points : {true, false}) {
    Stroke stroke = stroke_over_ball(0, many_points ? 10'000 : 2);
    if (!many_points) stroke.points.back().t = 3600;  // at rest for an hour: 450,000 dabs between two points
    const std::uint64_t dabs_before = document.statistics().dabs;
    post(document, stroke);
    document.settle();
    ASSERT_FALSE(events.of<StrokeFinished>().empty());
    const StrokeFinished finished = events.of<StrokeFinished>().back();
    EXPECT_TRUE(finished.cancelled);
    EXPECT_FALSE(finished.result.changed);
    EXPECT_EQ(hash_of(document), before->content_hash());
    EXPECT_LT(document.statistics().dabs - dabs_before, 200U);
    EXPECT_EQ(document.statistics().undo_steps, 0U);
  }
  there.store(nullptr);
  post(document, stroke_over_ball(0));
  document.settle();
  EXPECT_EQ(document.statistics().undo_steps, 1U) << "the next one is whole";
}

TEST(Document, ACancelOfAnEarlierStrokeLeavesTheNextOneAlone) {
  Events events;
  std::atomic<bool> first{true};
  std::atomic<Document*> there{nullptr};
  DocumentSettings settings = events.settings();
  settings.on_event = [&](const Event& event) {
    events.add(event);
    // All of this is waiting while the first stroke is being worked on.
    if (!std::holds_alternative<SnapshotChanged>(event) || there.load() == nullptr || !first.exchange(false)) return;
    there.load()->post(EndStroke{});
    post(*there.load(), stroke_over_ball(1));
    there.load()->post(CancelStroke{});  // of nothing: both have ended by then
  };
  Document document(ball(), settings);
  there.store(&document);
  const Stroke stroke = stroke_over_ball(0, 200);
  document.post(BeginStroke{.brush = stroke.brush, .tip = false, .label = {}, .source = 0});
  document.post(MoveStroke{stroke.points, 0});
  document.settle();
  document.settle();
  const auto finished = events.of<StrokeFinished>();
  ASSERT_EQ(finished.size(), 2U);
  EXPECT_FALSE(finished[0].cancelled);
  EXPECT_FALSE(finished[1].cancelled);
  EXPECT_EQ(document.statistics().undo_steps, 2U);
}

TEST(Document, StrokesOfTwoSourcesDoNotMix) {
  Events events;
  Document document(ball(), events.settings());
  const Stroke mouse = stroke_over_ball(0), hand = stroke_over_ball(1);
  document.post(BeginStroke{.brush = mouse.brush, .tip = false, .label = "mouse", .source = 1});
  document.post(BeginStroke{.brush = hand.brush, .tip = false, .label = "hand", .source = 2});
  document.post(MoveStroke{mouse.points, 1});
  document.post(MoveStroke{hand.points, 2});
  document.post(CancelStroke{2});
  document.post(EndStroke{2});
  document.post(EndStroke{1});
  document.settle();
  ASSERT_EQ(events.of<StrokeRefused>().size(), 1U);
  EXPECT_EQ(events.of<StrokeRefused>()[0].source, 2U);
  ASSERT_EQ(events.of<StrokeFinished>().size(), 1U);
  EXPECT_EQ(events.of<StrokeFinished>()[0].label, "mouse");
  EXPECT_FALSE(events.of<StrokeFinished>()[0].cancelled);
  Editor editor(ball().head);
  ASSERT_TRUE(play(editor, mouse).changed);
  EXPECT_EQ(hash_of(document), editor.head()->content_hash());
}

TEST(Document, UndoInsideAStrokeTakesItBack) {
  Events events;
  Document document(ball(), events.settings());
  const std::uint64_t start = hash_of(document);
  const Stroke stroke = stroke_over_ball(0);
  document.post(BeginStroke{.brush = stroke.brush, .tip = false, .label = {}, .source = 0});
  document.post(MoveStroke{stroke.points, 0});
  document.post(Undo{});
  document.post(MoveStroke{stroke.points, 0});
  document.post(EndStroke{});
  document.settle();
  EXPECT_EQ(hash_of(document), start);
  EXPECT_EQ(document.statistics().redo_steps, 1U);
}

TEST(Document, LimitsAndMissedPointsAreToldOnceAStroke) {
  Events events;
  Document document(ball(), events.settings());
  // Much deeper than the clay, in many dabs, and beside the ball.
  Stroke deep = stroke_over_ball(0, 20);
  deep.brush = {.tool = Tool::Carve, .radius = 0.5, .strength = 1};
  for (StrokePoint& p : deep.points) p.pressure = 1;
  deep.points.insert(deep.points.begin() + 10, 3, {deep.points[9].t, {4, 4, 4}, 1});
  post(document, deep);
  document.settle();
  ASSERT_EQ(events.of<LimitReached>().size(), 1U);
  EXPECT_GT(events.of<LimitReached>()[0].so_far.limited, 0U);
  const Vec3d first = events.of<LimitReached>()[0].so_far.limited_at;
  EXPECT_NEAR(length(first), 1, 0.1) << "a place on the ball";
  EXPECT_LT(length(first - deep.points[0].position), 0.2) << "its first dab goes beyond the clay";
  ASSERT_EQ(events.of<PointMissed>().size(), 1U);
  EXPECT_EQ(events.of<PointMissed>()[0].at, Vec3d(4, 4, 4));
  const StrokeFinished finished = events.of<StrokeFinished>().back();
  EXPECT_EQ(finished.result.missed, 3U);
  EXPECT_EQ(finished.result.missed_at, Vec3d(4, 4, 4));
  EXPECT_EQ(finished.result.limited_at, first);
  EXPECT_EQ(finished.result.detail_limited_at, Vec3d());
  EXPECT_GT(finished.result.limited, 0U);
  EXPECT_GT(finished.result.samples, 0U);
  EXPECT_GT(finished.tiles, 0U);
  post(document, stroke_over_ball(1));
  document.settle();
  EXPECT_EQ(events.of<LimitReached>().size(), 1U) << "a gentle one reaches none";
}

TEST(Document, AGridThatStaysTooCoarseIsToldOnceAStroke) {
  Events events;
  Document document(ball(), events.settings());
  Stroke fine = stroke_over_ball(0, 20);
  fine.brush.detail = 1e-6;
  post(document, fine);
  document.settle();
  ASSERT_EQ(events.of<DetailLimited>().size(), 1U);
  EXPECT_EQ(events.of<DetailLimited>()[0].at, events.of<StrokeFinished>().back().result.detail_limited_at);
  EXPECT_LT(length(events.of<DetailLimited>()[0].at - fine.points[0].position), fine.brush.radius);
  EXPECT_TRUE(events.of<StrokeFinished>().back().result.detail_limited);
  post(document, fine);
  document.settle();
  EXPECT_EQ(events.of<DetailLimited>().size(), 2U) << "another one, on the grid of the first";
  fine.brush.detail = 0;
  post(document, fine);
  document.settle();
  EXPECT_EQ(events.of<DetailLimited>().size(), 2U);
  EXPECT_FALSE(events.of<StrokeFinished>().back().result.detail_limited);
}

TEST(Document, ClayTakenBesideTheToolIsToldOnceAStroke) {
  for (const double lean : {0.0, 1.5}) {
    const auto mesh = testing::mapped_shell(*testing::plane_shell(4, 32, 0.3),
                                            [&](Vec3d p) { return Vec3d{p.x + lean * p.y, p.y, p.z}; });
    Events events;
    Model model;
    model.head = Snapshot::make(mesh);
    Document document(std::move(model), events.settings());
    Stroke cut;
    cut.brush = {.tool = Tool::Carve, .radius = 0.15, .detail = 0, .strength = 0.6};
    for (int k = 0; k <= 20; ++k) cut.points.push_back({0.02 * k, {0.4 + 0.01 * k, 0, 0.5}, 1});
    post(document, cut);
    document.settle();
    ASSERT_EQ(events.of<TakenBeside>().size(), lean > 0 ? 1U : 0U);
    const StrokeResult result = events.of<StrokeFinished>().back().result;
    EXPECT_EQ(result.beside, lean > 0);
    if (lean > 0) {
      EXPECT_EQ(events.of<TakenBeside>()[0].at, result.beside_at);
      EXPECT_LT(length(result.beside_at - Vec3d{0.5, 0, 0.5}), 0.2) << "on the way of the stroke";
    }
  }
}

TEST(Document, ABrushThatIsNoneIsRefusedWithASentence) {
  Events events;
  Document document(ball(), events.settings());
  const std::uint64_t start = hash_of(document);
  Stroke bad = stroke_over_ball(0);
  bad.brush.radius = -1;
  post(document, bad);
  document.settle();
  ASSERT_EQ(events.of<Failed>().size(), 1U);
  EXPECT_EQ(events.of<Failed>()[0].error.code, Errc::InvalidArgument);
  EXPECT_NE(events.of<Failed>()[0].error.message.find("radius"), std::string::npos);
  EXPECT_EQ(hash_of(document), start);
}

// ---- Saving

/// No file of this process grows beyond what it is, as on a full disk.
class FullDisk {
 public:
  explicit FullDisk(std::uintmax_t bytes) {
    std::signal(SIGXFSZ, SIG_IGN);
    ::getrlimit(RLIMIT_FSIZE, &before_);
    rlimit small = before_;
    small.rlim_cur = bytes;
    ::setrlimit(RLIMIT_FSIZE, &small);
  }
  ~FullDisk() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, SIG_DFL);
  }

 private:
  rlimit before_{};
};

TEST(Document, AFullDiskIsToldAtOnceAndTriedAgain) {
  const Folder folder;
  Events events;
  Document document = document_in(folder / "a.relief", ball(), events.settings());
  std::vector<std::uint64_t> hashes;
  {
    const FullDisk full(std::filesystem::file_size(folder / "a.relief") / 2);
    hashes = draw(document, 4);
    while (events.of<Failed>().empty()) std::this_thread::yield();
    EXPECT_EQ(events.of<Failed>()[0].error.code, Errc::Io);
    EXPECT_NE(events.of<Failed>()[0].error.message.find("a.relief"), std::string::npos);
    EXPECT_GE(events.of<Failed>()[0].unsaved, 1U);
    document.post(Undo{2});
    document.post(Redo{1});
    document.settle();
    EXPECT_EQ(hash_of(document), hashes[3]) << "the history does not need the disk";
    EXPECT_EQ(document.statistics().unsaved, 4U);
    EXPECT_TRUE(events.of<Saved>().empty());
  }
  post(document, stroke_over_ball(9));  // tries all again
  document.settle();
  hashes[4] = hash_of(document);
  walk(document, hashes);
  ASSERT_TRUE(document.close());
  EXPECT_EQ(events.of<Saved>().back().stroke, 4U);
  auto file = ModelFile::open(folder / "a.relief");
  ASSERT_TRUE(file) << file.error().message;
  EXPECT_EQ(file->stroke_count(), 4U);
  EXPECT_EQ(file->model().head->content_hash(), hashes[4]);
}

TEST(Document, ARoomyDiskIsFoundWithoutAnotherStroke) {
  const Folder folder;
  Events events;
  DocumentSettings settings = events.settings();
  settings.retry_after = std::chrono::milliseconds(5);
  Document document = document_in(folder / "a.relief", ball(), std::move(settings));
  {
    const FullDisk full(std::filesystem::file_size(folder / "a.relief") / 2);
    draw(document, 2);
    while (events.of<Failed>().empty()) std::this_thread::yield();
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    EXPECT_LE(events.of<Failed>().size(), 2U) << "what is known is not told again";
  }
  while (events.of<Saved>().empty() || events.of<Saved>().back().stroke < 2) std::this_thread::yield();
  EXPECT_EQ(document.statistics().unsaved, 0U);
}

TEST(Document, AStepIsReadFromTheFileThatHasAnotherOneInPlaceOfAnUnsavedStroke) {
  const Folder folder;
  Events events;
  Document document = document_in(folder / "a.relief", ball(), events.settings(0));
  // Without finer grids the pages of a stroke fit into the cache, so none is written that cannot be rolled back.
  const auto on_this_grid = [](int k) {
    Stroke stroke = stroke_over_ball(k);
    stroke.brush.detail = 0;
    return stroke;
  };
  std::vector<std::uint64_t> hashes = {hash_of(document)};
  for (int k = 0; k < 5; ++k) {
    post(document, on_this_grid(k));
    document.settle();
    hashes.push_back(hash_of(document));
  }
  while (document.statistics().unsaved > 0) std::this_thread::yield();
  document.post(Undo{2});
  document.settle();
  while (document.statistics().unsaved > 0) std::this_thread::yield();
  const FullDisk full(std::filesystem::file_size(folder / "a.relief") / 2);
  post(document, on_this_grid(21));  // the fourth; the file still has the other fourth, and the fifth
  document.settle();
  while (events.of<Failed>().empty()) std::this_thread::yield();
  for (const std::size_t k : {3U, 2U, 1U, 0U}) {
    document.post(Undo{});
    document.settle();
    EXPECT_EQ(hash_of(document), hashes[k]) << k;
  }
}

TEST(Document, CloseSaysWhatCouldNotBeSaved) {
  const Folder folder;
  Events events;
  Document document = document_in(folder / "a.relief", ball(), events.settings());
  const FullDisk full(std::filesystem::file_size(folder / "a.relief") / 2);
  draw(document, 2);
  const Status closed = document.close();
  ASSERT_FALSE(closed);
  EXPECT_EQ(closed.error().code, Errc::Io);
  EXPECT_EQ(events.of<Failed>().back().unsaved, 2U);
}

/// What a file has: the hashes of all its states, undone ones included.
std::vector<std::uint64_t> states_of(const std::filesystem::path& place) {
  auto file = ModelFile::open(place);
  EXPECT_TRUE(file) << file.error().message;
  std::vector<std::uint64_t> hashes;
  for (std::uint64_t k = 0; file && k <= file->stroke_count() + file->redo_count(); ++k) {
    auto state = file->at(k);
    EXPECT_TRUE(state) << state.error().message;
    hashes.push_back(state ? (*state)->content_hash() : 0);
  }
  return hashes;
}

TEST(Document, SaveElsewhereTakesTheWholeHistoryAlongAndGoesOnThere) {
  const Folder folder;
  Events events;
  Document document = document_in(folder / "a.relief", ball(), events.settings());
  std::vector<std::uint64_t> hashes = draw(document, 3);
  document.post(SaveElsewhere{folder / "b.relief"});
  post(document, stroke_over_ball(3));
  document.settle();
  hashes.push_back(hash_of(document));
  document.post(Undo{});
  ASSERT_TRUE(document.close());
  EXPECT_EQ(states_of(folder / "b.relief"), hashes);
  EXPECT_EQ(ModelFile::open(folder / "b.relief").value().stroke_count(), 3U) << "and the place in it";
  ASSERT_EQ(events.of<SavedElsewhere>().size(), 1U);
  EXPECT_TRUE(events.of<SavedElsewhere>()[0].whole);
  EXPECT_EQ(states_of(folder / "a.relief").back(), hashes[3]) << "the old one stays";
}

TEST(Document, SavingElsewhereCanBeGivenUpAndTheOldFileGoesOn) {
  const Folder folder;
  Events events;
  Document document = document_in(folder / "a.relief", ball(), events.settings());
  std::vector<std::uint64_t> hashes = draw(document, 3);
  document.post(SaveElsewhere{folder / "b.relief", std::make_shared<std::atomic<bool>>(true)});
  while (events.of<Failed>().empty()) std::this_thread::yield();
  EXPECT_EQ(events.of<Failed>()[0].error.code, Errc::Cancelled);
  EXPECT_EQ(events.of<Failed>()[0].unsaved, 0U);
  EXPECT_EQ(folder.names(), std::vector<std::string>{"a.relief"});
  post(document, stroke_over_ball(3));
  document.settle();
  hashes.push_back(hash_of(document));
  ASSERT_TRUE(document.close()) << "no failure of the file that there is";
  EXPECT_TRUE(events.of<SavedElsewhere>().empty());
  EXPECT_EQ(states_of(folder / "a.relief"), hashes);
}

TEST(Document, SaveElsewhereGoesOnWhereTheDiskIsFull) {
  const Folder folder;
  Events events;
  Document document = document_in(folder / "a.relief", ball(), events.settings());
  std::vector<std::uint64_t> hashes;
  {
    const FullDisk full(std::filesystem::file_size(folder / "a.relief") / 2);
    hashes = draw(document, 3);
    while (events.of<Failed>().empty()) std::this_thread::yield();
  }
  document.post(SaveElsewhere{folder / "b.relief"});  // where there is room
  ASSERT_TRUE(document.close());
  EXPECT_EQ(states_of(folder / "b.relief"), hashes);
  EXPECT_EQ(states_of(folder / "a.relief"), hashes)
      << "what was done before it goes into the old one, where that works";
}

TEST(Document, WhatTheFullDiskDidNotTakeIsInTheOtherFileAtOnce) {
  const Folder folder;
  Events events;
  DocumentSettings settings = events.settings();
  settings.retry_after = std::chrono::hours(1);  // nothing comes by another try
  Document document = document_in(folder / "a.relief", ball(), std::move(settings));
  {
    const FullDisk full(std::filesystem::file_size(folder / "a.relief") / 2);
    draw(document, 3);
    while (events.of<Failed>().empty()) std::this_thread::yield();
  }
  document.post(SaveElsewhere{folder / "b.relief"});
  document.settle();
  const auto last = std::chrono::steady_clock::now() + std::chrono::minutes(1);
  const auto saved = [&] { return !events.of<Saved>().empty() && events.of<Saved>().back().stroke == 3; };
  while (!saved() && std::chrono::steady_clock::now() < last) std::this_thread::yield();
  EXPECT_TRUE(saved());
  EXPECT_EQ(document.statistics().unsaved, 0U);
}

TEST(Document, WithoutAFileAllThatIsInMemoryIsSavedElsewhere) {
  const Folder folder;
  Events events;
  Document document(ball(), events.settings());
  std::vector<std::uint64_t> hashes = draw(document, 4);
  document.post(Undo{1});
  document.post(SaveElsewhere{folder / "no-such-folder" / "b.relief"});
  document.settle();
  while (events.of<Failed>().empty()) std::this_thread::yield();
  document.post(SaveElsewhere{folder / "b.relief"});
  document.settle();
  while (events.of<SavedElsewhere>().empty()) std::this_thread::yield();
  EXPECT_TRUE(events.of<SavedElsewhere>()[0].whole);
  {
    const auto reader = ModelFile::open(folder / "b.relief", true);
    ASSERT_TRUE(reader) << reader.error().message;
    EXPECT_EQ(reader->stroke_count(), 3U) << "at the place where the document is";
  }
  document.post(Redo{1});
  document.post(Undo{4});
  document.post(Redo{4});
  post(document, stroke_over_ball(7));
  document.settle();
  hashes.push_back(hash_of(document));
  ASSERT_TRUE(document.close());
  EXPECT_EQ(states_of(folder / "b.relief"), hashes);
  const auto journal = ModelFile::open(folder / "b.relief").value().strokes();
  ASSERT_TRUE(journal);
  const auto stroke = stroke_of((*journal)[1].details, "journal");
  ASSERT_TRUE(stroke) << stroke.error().message;
  EXPECT_EQ(stroke->points, stroke_over_ball(1).points) << "with their texts";
}

TEST(Document, WhereTheFileIsGoneWhatIsInMemoryIsSavedElsewhere) {
  const Folder folder;
  {
    Document document = document_in(folder / "a.relief", ball());
    draw(document, 3);
    ASSERT_TRUE(document.close());
  }
  Events events;
  auto file = ModelFile::open(folder / "a.relief");
  ASSERT_TRUE(file);
  auto document = Document::open(folder / "a.relief", *std::move(file), events.settings());
  ASSERT_TRUE(document);
  std::vector<std::uint64_t> hashes = {hash_of(*document)};
  for (int k = 3; k < 6; ++k) {
    post(*document, stroke_over_ball(k));
    document->settle();
    hashes.push_back(hash_of(*document));
  }
  std::filesystem::remove(folder / "a.relief");
  document->post(SaveElsewhere{folder / "b.relief"});
  document->settle();
  while (events.of<SavedElsewhere>().empty()) std::this_thread::yield();
  EXPECT_FALSE(events.of<SavedElsewhere>()[0].whole) << "the first three strokes are lost";
  EXPECT_EQ(document->statistics().undo_steps, 3U);
  walk(*document, hashes);
  post(*document, stroke_over_ball(9));
  document->settle();
  hashes.push_back(hash_of(*document));
  ASSERT_TRUE(document->close());
  EXPECT_EQ(states_of(folder / "b.relief"), hashes);
}

// ---- Threads

TEST(Document, AThousandCommandsFromSeveralThreads) {
  const Folder folder;
  Events events;
  std::uint64_t start = 0, end = 0;
  {
    Document document = document_in(folder / "a.relief", ball(), events.settings(std::size_t{128} << 10U));
    start = hash_of(document);
    constexpr int kThreads = 4, kEach = 250;
    std::atomic<bool> done{false};
    std::thread drawing([&] {
      SnapshotChannel::Reader reader = document.reader();
      while (!done.load()) {
        EXPECT_TRUE(validate(reader.latest()));
        static_cast<void>(document.statistics());
        static_cast<void>(document.labels());
        EXPECT_NE(document.head(), nullptr);
      }
    });
    std::vector<std::thread> threads;
    for (unsigned thread = 0; thread < kThreads; ++thread)
      threads.emplace_back([&, thread] {
        std::mt19937 random(thread);
        const StrokeSource source = thread / 2;  // two of them share one
        for (int k = 0; k < kEach; ++k) {
          const Stroke stroke = stroke_over_ball(static_cast<int>(random() % 50), 3);
          switch (random() % 8) {
            case 0:
            case 1:
              document.post(BeginStroke{.brush = stroke.brush, .tip = false, .label = {}, .source = source});
              break;
            case 2:
            case 3:
              document.post(MoveStroke{stroke.points, source});
              break;
            case 4:
              document.post(EndStroke{source});
              break;
            case 5:
              document.post(CancelStroke{source});
              break;
            case 6:
              document.post(Undo{random() % 3});
              break;
            default:
              document.post(Redo{random() % 3});
              break;
          }
        }
      });
    for (std::thread& thread : threads) thread.join();
    document.settle();
    done.store(true);
    drawing.join();
    end = hash_of(document);
    ASSERT_TRUE(document.close());
    EXPECT_TRUE(events.of<Failed>().empty());
    EXPECT_GT(document.statistics().strokes, 0U);
  }
  // A stroke that close() ended would be in it as well.
  const std::vector<std::uint64_t> states = states_of(folder / "a.relief");
  ASSERT_FALSE(states.empty());
  EXPECT_EQ(states.front(), start);
  EXPECT_NE(std::ranges::find(states, end), states.end());
}

}  // namespace
}  // namespace relief
