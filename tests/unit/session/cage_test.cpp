// Cages that change by strokes: what the history counts, and recordings on models that were cut.
#include "document_support.h"
#include "support/longer_fibres.h"

#include <relief/session/history.h>
#include <relief/session/recorder.h>
#include <relief/session/replay.h>

#include <gtest/gtest.h>
#include <support/cuts.h>
#include <support/folder.h>
#include <support/shells.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace relief {
namespace {

using detail::History;
using testing::displaced;
using testing::Folder;
using testing::RandomCuts;
using testing::sphere_shell;

SnapshotPtr with_cut(const SnapshotPtr& model, SlabId slab) {
  RandomCuts cuts(model);
  cuts.cut(slab);
  return cuts.model();
}

SnapshotPtr ball(int levels, int n) {
  return displaced(sphere_shell(levels, n), [](Vec3d p) { return 0.5 + 0.02 * std::sin(9 * p.x); });
}

TEST(HistoryOfCages, CountsThoseThatOnlyItHolds) {
  const SnapshotPtr first = ball(3, 8);
  History history(first, {}, 0, false);
  EXPECT_EQ(history.bytes(), 0U);
  const SnapshotPtr cut = with_cut(first, 7);
  history.push(cut, "cut", {});
  // Of the state before: its cage, and the tile that the cut one has no more.
  const std::size_t old_cage = first->slab_mesh().bytes_beside(&cut->slab_mesh());
  EXPECT_GE(old_cage, first->slab_mesh().slab_count() * sizeof(Slab));
  EXPECT_GE(history.bytes(), old_cage + first->tile(Layer::Displacement, 7).bytes());
  EXPECT_LT(history.bytes(), old_cage + first->tile(Layer::Displacement, 7).bytes() + 4096);
  history.move_to(0, first);
  const std::size_t new_cage = cut->slab_mesh().bytes_beside(&first->slab_mesh());
  EXPECT_GE(history.bytes(), new_cage + 4 * cut->tile(Layer::Displacement, 7).bytes());
  EXPECT_EQ(history.fit(history.bytes(), true), 0U);
  EXPECT_EQ(history.held(), 2U);
  history.saved_up_to(2);
  history.fit(history.bytes() - 1, true);
  EXPECT_EQ(history.held(), 1U);
  EXPECT_EQ(history.bytes(), 0U);
}

/// A cage with other grids alone shares what does not depend on them.
TEST(HistoryOfCages, CountsSharedPartsOnce) {
  const SnapshotPtr first = ball(3, 8);
  const auto finer = with_detail(first, {.cuts = {}, .grids = {{Layer::Displacement, 3, 16}}});
  ASSERT_TRUE(finer);
  const SlabMesh &a = first->slab_mesh(), &b = (*finer)->slab_mesh();
  EXPECT_LT(2 * b.bytes_beside(&a), b.bytes_beside(nullptr));
  EXPECT_EQ(b.bytes_beside(&b), 0U);
  EXPECT_GT(with_cut(first, 3)->slab_mesh().bytes_beside(&a), a.bytes_beside(nullptr));
}

/// Comes down on the ball, slides over it and lifts off.
std::vector<DeviceState> motion() {
  std::vector<DeviceState> readings;
  for (int k = 0; k < 800; ++k) {
    const double phase = k / 800.0, side = 1.2 * phase, reach = 1.25 - 0.32 * std::sin(std::numbers::pi * phase);
    DeviceState reading;
    reading.t = k * 1e-3;
    reading.position = Vec3d{std::sin(side), 0.3 * std::cos(7 * side), std::cos(side)} * (reach * 0.05);
    readings.push_back(reading);
  }
  return readings;
}

/// The model of a recording is found by its content among the strokes of its file, and the servo does the same on it.
TEST(RecordingsOfCages, AModelThatWasCutComesBackBitForBit) {
  const Folder folder;
  RandomCuts cuts(ball(2, 16), 3);
  auto file = ModelFile::create(folder / "a.relief", {.info = {}, .head = cuts.model()});
  ASSERT_TRUE(file) << file.error().message;
  const auto cut_some = [&] {
    for (int k = 0; k < 5; ++k) cuts.cut_one(3);
    const Status done = file->commit(cuts.model(), {.label = "cut"});
    ASSERT_TRUE(done) << done.error().message;
  };
  cut_some();
  cut_some();
  const SnapshotPtr model = cuts.model();
  const ServoSettings settings = {.workspace = {.metres_per_unit = 0.05}, .force = {.friction = 0.4}};
  auto recorder = Recorder::create(folder / "a.rlog", Recorder::Pace::Path,
                                   {.program = "test", .model = folder / "a.relief", .model_strokes = 2}, model,
                                   settings, DeviceInfo{.name = "hand"});
  ASSERT_TRUE(recorder) << recorder.error().message;
  Servo servo(settings, DeviceInfo{});
  std::uint64_t number = 0;
  for (const DeviceState& reading : motion()) {
    ServoTick tick;
    tick.number = number++;
    tick.model = model.get();
    tick.reading = reading;
    tick.sample = servo.step(*model, reading);
    recorder->tick(tick);
  }
  ASSERT_TRUE(recorder->finish(nullptr));
  cut_some();
  EXPECT_NE(file->model().head->content_hash(), model->content_hash());
  file = fail(Errc::NotFound, "closed");
  auto replay = Replay::open(folder / "a.rlog");
  ASSERT_TRUE(replay) << replay.error().message;
  const auto found = find_model(*replay, folder / "a.relief");
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ((*found)->content_hash(), model->content_hash());
  const auto verified = verify(*replay, *found);
  ASSERT_TRUE(verified) << verified.error().message;
  EXPECT_TRUE(verified->holds());
  EXPECT_EQ(verified->checked, 800U);
}

Result<Room> longer_below(const SnapshotPtr& surface, const RoomWanted& wanted, const Progress&) {
  // As far as the deepest of what is wanted, so that it matters what is asked for.
  double deepest = 0;
  for (const Capsule& cut : wanted.cut) deepest = std::max(deepest, 1 + cut.radius - length(cut.b));
  return Room{.model = testing::with_longer_fibres(surface, 5 * deepest, 0.5),
              .fibres = surface->slab_mesh().root_fibres().size()};
}

/// A document that is recorded while a servo feels it.
class RecordedDocument {
 public:
  RecordedDocument(const std::filesystem::path& file, RoomMaker make_room)
      : document_(testing::ball(), with(std::move(make_room))) {
    auto made = Recorder::create(file, Recorder::Pace::Path, {.program = "test"}, document_.head(), kSettings,
                                 DeviceInfo{.name = "hand"});
    EXPECT_TRUE(made) << made.error().message;
    recorder_.emplace(*std::move(made));
    document_.watch([this](const EditNote& note) { recorder_->note(note); });
  }
  /// Does a command, then feels the surface.
  void post(Command command) {
    document_.post(std::move(command));
    document_.settle();
    const SnapshotPtr head = document_.head();
    ServoTick tick;
    tick.number = ticks_++;
    tick.model = head.get();
    tick.reading.t = static_cast<double>(tick.number) * 1e-3;
    tick.reading.position = Vec3d{0.6, 0, 0.8} * (kSettings.workspace.metres_per_unit * (tick.number == 0 ? 1.1 : 0.6));
    tick.sample = servo_.step(*head, tick.reading);
    recorder_->tick(tick);
  }
  /// The stroke point by point; its end, or its cancel.
  void play(const Stroke& stroke, const Command& end) {
    post(BeginStroke{.brush = stroke.brush, .tip = stroke.tip, .label = stroke.label});
    for (const StrokePoint& point : stroke.points) {
      post(MoveStroke{{point}});
      // Room is taken with the next point after it was made.
      const auto ended = [&] { return events_.of<RoomEnded>().size() >= events_.of<RoomAsked>().size(); };
      while (!ended()) document_.settle();
    }
    post(end);
  }
  std::uint64_t end() {
    document_.watch({});
    EXPECT_TRUE(recorder_->finish(nullptr));
    return ticks_;
  }
  [[nodiscard]] std::uint64_t hash() const { return document_.head()->content_hash(); }
  [[nodiscard]] const testing::Events& events() const { return events_; }
  static constexpr ServoSettings kSettings = {.workspace = {.metres_per_unit = 0.05}, .force = {.friction = 0.4}};

 private:
  DocumentSettings with(RoomMaker make_room) {
    DocumentSettings settings = events_.settings();
    settings.make_room = std::move(make_room);
    return settings;
  }
  testing::Events events_;
  Document document_;
  std::optional<Recorder> recorder_;
  Servo servo_{kSettings, DeviceInfo{}};
  std::uint64_t ticks_ = 0;
};

/// Carves deeper and deeper, beyond the clay, which is 0.2 thick.
Stroke boring(double depth) {
  Stroke stroke;
  stroke.brush = {.tool = Tool::Carve, .radius = depth, .strength = 1};
  stroke.label = "bore";
  for (int k = 0; k <= 20; ++k) stroke.points.push_back({0.02 * k, {0.6, 0, 0.8}, 0.05 * k});
  return stroke;
}

TEST(RecordingsOfCages, ARecordedStrokeGetsTheSameRoomAndIsRepeatedBitForBit) {
  const Folder folder;
  RecordedDocument recorded(folder / "a.rlog", longer_below);
  recorded.play(boring(0.35), EndStroke{});
  EXPECT_GE(recorded.events().of<RoomEnded>().size(), 2U) << "while it goes on, and at its end";
  EXPECT_EQ(recorded.events().of<StrokeFinished>().back().result.limited, 0U);
  const std::uint64_t bored = recorded.hash();
  recorded.play(boring(0.45), CancelStroke{});
  EXPECT_EQ(recorded.hash(), bored);
  recorded.post(Undo{});
  recorded.post(Redo{});
  EXPECT_EQ(recorded.hash(), bored);
  recorded.play(testing::stroke_over_ball(0), EndStroke{});
  const std::uint64_t ticks = recorded.end();

  testing::Events events;
  DocumentSettings settings = events.settings();
  settings.make_room = longer_below;
  Document plain(testing::ball(), std::move(settings));
  testing::post(plain, boring(0.35));
  plain.settle();
  EXPECT_EQ(plain.head()->content_hash(), bored) << "recorded or not";

  auto replay = Replay::open(folder / "a.rlog");
  ASSERT_TRUE(replay) << replay.error().message;
  const SnapshotPtr model = testing::ball().head;
  const auto verified = verify(*replay, model, longer_below);
  ASSERT_TRUE(verified) << verified.error().message;
  EXPECT_TRUE(verified->holds()) << verified->stopped << (verified->difference ? verified->difference->field : "");
  EXPECT_EQ(verified->checked, ticks);
  const auto alone = verify(*replay, model);
  ASSERT_FALSE(alone);
  EXPECT_EQ(alone.error().code, Errc::InvalidArgument);
  // Other room is another model, which the servo feels.
  const auto other = verify(*replay, model, [](const SnapshotPtr& surface, const RoomWanted&, const Progress&) {
    return Result<Room>(Room{.model = testing::with_longer_fibres(surface, 0.1, 0), .fibres = 1});
  });
  ASSERT_TRUE(other) << other.error().message;
  EXPECT_FALSE(other->holds());
  const auto none = verify(*replay, model,
                           [](const SnapshotPtr&, const RoomWanted&, const Progress&) { return Result<Room>(Room{}); });
  ASSERT_TRUE(none) << none.error().message;
  EXPECT_FALSE(none->stopped.empty());
}

}  // namespace
}  // namespace relief
