// Recordings: what a servo did comes back bit for bit, and what cannot be repeated is said.
#include "support/bits.h"
#include "support/shells.h"

#include <relief/devices/open_device.h>
#include <relief/session/fields.h>
#include <relief/session/recorder.h>
#include <relief/session/replay.h>
#include <relief/session/session.h>

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <thread>

namespace relief {
namespace {

constexpr double kMetres = 0.05;

DeviceState reading_at(int tick, Vec3d position) {
  DeviceState reading;
  reading.t = tick * 1e-3;
  reading.position = position;
  return reading;
}

class Record : public ::testing::Test {
 protected:
  Record()
      : folder_(std::filesystem::temp_directory_path() / ("relief-record-" + std::to_string(::getpid()))),
        file_(folder_ / "a.rlog") {
    std::filesystem::create_directory(folder_);
  }
  ~Record() override { std::filesystem::remove_all(folder_); }

  static SnapshotPtr ball() {
    return testing::displaced(testing::sphere_shell(3, 16), [](Vec3d p) { return 0.5 + 0.02 * std::sin(9 * p.x); });
  }
  static ServoSettings settings() { return {.workspace = {.metres_per_unit = kMetres}, .force = {.friction = 0.4}}; }

  /// Comes down on the ball, slides over it and lifts off, with readings that no device gives in between.
  static std::vector<DeviceState> motion() {
    std::vector<DeviceState> readings;
    for (int k = 0; k < 1500; ++k) {
      const double phase = k / 1500.0, side = 1.2 * phase;
      const double reach = 1.25 - 0.32 * std::sin(std::numbers::pi * phase);
      DeviceState reading =
          reading_at(k, Vec3d{std::sin(side), 0.3 * std::cos(7 * side), std::cos(side)} * (reach * kMetres));
      if (k > 700) {
        reading.has_velocity = true;
        reading.velocity = {0.05 * std::sin(0.1 * k), 0.01, -0.02};
        reading.has_orientation = true;
        reading.orientation = {std::cos(0.001 * k), 0, std::sin(0.001 * k), 0};
      }
      if (k == 1100) reading.position.x = std::numeric_limits<double>::quiet_NaN();
      if (k == 1200) reading.t = -1;
      reading.buttons = static_cast<std::uint32_t>(k / 100);
      readings.push_back(reading);
    }
    return readings;
  }

  Result<Recorder> recorder(const SnapshotPtr& model, Recorder::Pace pace = Recorder::Pace::Path) const {
    return Recorder::create(file_, pace, {.program = "test", .model = folder_ / "a.relief"}, model, settings(),
                            DeviceInfo{.name = "hand"});
  }
  /// Steps a servo over readings and records it; ticks for which `keep` is false are lost.
  void record(const SnapshotPtr& model, const std::vector<DeviceState>& readings,
              const std::function<bool(std::size_t)>& keep = {}, double static_friction = 0.6) const {
    auto made = recorder(model);
    ASSERT_TRUE(made) << made.error().message;
    Servo servo(settings(), DeviceInfo{});
    for (std::size_t k = 0; k < readings.size(); ++k) {
      ServoTick tick;
      tick.number = k;
      tick.model = model.get();
      tick.reading = readings[k];
      if (k == 1300) servo.stalled();
      if (k == 400) {
        ServoSettings stiffer = settings();
        stiffer.force.stiffness = 700;
        stiffer.force.static_friction = static_friction;
        servo.set(stiffer);
        made->set(stiffer);
      }
      tick.settings = k >= 400 ? 1 : 0;
      tick.sample = servo.step(*model, tick.reading);
      if (!keep || keep(k)) made->tick(tick);
    }
    const Status finished = made->finish(nullptr);
    ASSERT_TRUE(finished) << finished.error().message;
  }

  Verification verified(const SnapshotPtr& model) const {
    auto replay = Replay::open(file_);
    if (!replay) {
      ADD_FAILURE() << replay.error().message;
      return {};
    }
    auto result = verify(*replay, model);
    if (result) return *result;
    ADD_FAILURE() << result.error().message;
    return {};
  }

  /// Writes the recording anew with other columns of ticks, or other rows, or events.
  template <typename Change>
  void rewrite(Change&& change,
               const std::function<void(RecordingHead&, std::vector<RecordingEvent>&)>& change_events = {}) const {
    auto old = Recording::open(file_);
    ASSERT_TRUE(old) << old.error().message;
    RecordingHead head = old->head();
    // NOLINTNEXTLINE(misc-const-correctness): `change` changes them
    RecordingColumns& columns = head.streams[std::string(kTickStream)];
    const std::size_t width = row_bytes(columns);
    std::vector<std::vector<std::byte>> rows;
    std::uint64_t first = 0;
    for (std::span<const std::byte> batch;;) {
      const auto more = old->next(first, batch);
      ASSERT_TRUE(more.has_value());
      if (!*more) break;
      for (std::size_t at = 0; at < batch.size(); at += width)
        rows.emplace_back(batch.begin() + static_cast<std::ptrdiff_t>(at),
                          batch.begin() + static_cast<std::ptrdiff_t>(at + width));
    }
    change(columns, rows);
    std::vector<RecordingEvent> events = old->events();
    if (change_events) change_events(head, events);
    old = fail(Errc::NotFound, "closed");  // nobody may read a file that is replaced
    auto writer = RecordingWriter::create(file_, head);
    ASSERT_TRUE(writer) << writer.error().message;
    for (const RecordingEvent& event : events) ASSERT_TRUE(writer->add_event(event));
    for (std::size_t k = 0; k < rows.size(); ++k) ASSERT_TRUE(writer->add_ticks(k, rows[k]));
    const Status finished = writer->finish({});
    ASSERT_TRUE(finished) << finished.error().message;
  }
  static std::size_t offset_of(const RecordingColumns& columns, std::string_view name) {
    std::size_t at = 0;
    for (const RecordingColumn& column : columns) {
      if (column.name == name) break;
      at += bytes_of(column.type);
    }
    return at;
  }

  std::filesystem::path folder_, file_;
};

// Test S19 of a determinism that people can hold in their hands: the same recording, the same build, the same bits.
TEST_F(Record, ARecordingIsRepeatedBitForBit) {
  const SnapshotPtr model = ball();
  record(model, motion());
  const Verification found = verified(model);
  EXPECT_TRUE(found.holds()) << found.stopped << (found.difference ? found.difference->field : "");
  EXPECT_EQ(found.checked, 1500U);
  EXPECT_TRUE(found.missing.empty());
}

TEST_F(Record, EveryFieldComesBack) {
  const SnapshotPtr model = ball();
  const std::vector<DeviceState> readings = motion();
  record(model, readings);
  auto replay = Replay::open(file_);
  ASSERT_TRUE(replay) << replay.error().message;
  EXPECT_EQ(replay->device().name, "hand");
  EXPECT_EQ(replay->device().max_stiffness, DeviceInfo{}.max_stiffness);
  ASSERT_EQ(replay->settings().size(), 2U);
  EXPECT_EQ(replay->settings()[0].workspace.metres_per_unit, kMetres);
  EXPECT_EQ(replay->settings()[1].force.stiffness, 700);
  EXPECT_EQ(replay->settings()[0].force.static_friction, 0);
  EXPECT_EQ(replay->settings()[1].force.static_friction, 0.6);
  EXPECT_EQ(replay->recording().head().fact("program"), "test");
  Servo servo(settings(), DeviceInfo{});
  std::uint64_t number = 0, contact = 0, flagged = 0;
  RecordedTick tick;
  for (std::size_t k = 0; k < readings.size(); ++k) {
    if (k == 400) servo.set(replay->settings()[1]);
    if (k == 1300) servo.stalled();
    const auto more = replay->next(number, tick);
    ASSERT_TRUE(more && *more);
    ASSERT_EQ(number, k);
    const ServoSample sample = servo.step(*model, readings[k]);
    std::vector<std::byte> was, is;
    detail::append_row(tick, was);
    detail::append_row(RecordedTick{0, tick.settings, 0, readings[k], sample}, is);
    ASSERT_EQ(was, is) << k;
    EXPECT_EQ(testing::bits(tick.sample.device), testing::bits(sample.device));
    contact += sample.contact ? 1U : 0U;
    flagged += sample.flags != 0 ? 1U : 0U;
  }
  EXPECT_GT(contact, 300U);
  EXPECT_GT(flagged, 2U);
  const auto more = replay->next(number, tick);
  EXPECT_TRUE(more && !*more);
}

TEST_F(Record, TheFirstTickThatDiffersIsNamed) {
  const SnapshotPtr model = ball();
  record(model, motion());
  rewrite([](const RecordingColumns& columns, auto& rows) {
    rows[777][offset_of(columns, "force.y")] ^= std::byte{1};  // the last bit of one number
    rows[900][offset_of(columns, "depth")] ^= std::byte{1};
  });
  const Verification found = verified(model);
  ASSERT_TRUE(found.difference);
  EXPECT_EQ(found.difference->tick, 777U);
  EXPECT_EQ(found.difference->field, "force.y");
  EXPECT_NE(found.difference->recorded, found.difference->now);
  EXPECT_EQ(found.checked, 777U);
  EXPECT_FALSE(found.holds());
}

TEST_F(Record, AnotherModelDoesNotPass) {
  record(ball(), motion());
  const Verification found = verified(Snapshot::make(testing::sphere_shell(3, 16)));
  EXPECT_TRUE(found.difference);
}

TEST_F(Record, AGapIsSaidWithWhatCouldBeCheckedBefore) {
  const SnapshotPtr model = ball();
  record(model, motion(), [](std::size_t k) { return k < 600 || k >= 612; });
  const Verification found = verified(model);
  EXPECT_FALSE(found.difference);
  EXPECT_FALSE(found.holds());
  EXPECT_EQ(found.checked, 600U);
  EXPECT_NE(found.stopped.find("12 ticks before tick 612"), std::string::npos) << found.stopped;
  auto replay = Replay::open(file_);
  ASSERT_TRUE(replay);
  ASSERT_EQ(replay->recording().runs().size(), 2U);
  EXPECT_EQ(replay->recording().runs()[1].first, 612U);
  EXPECT_EQ(replay->recording().tick_count(), 1488U);
}

/// Every tick of motion() was checked and holds; one field could not be compared, for it was not recorded.
void expect_all_but(const Verification& found, const char* missing) {
  EXPECT_TRUE(found.holds());
  EXPECT_EQ(found.checked, 1500U);
  ASSERT_EQ(found.missing.size(), 1U);
  EXPECT_EQ(found.missing[0], missing);
}

TEST_F(Record, WhatAnOlderRecordingLacksIsNamedAndTheRestChecked) {
  const SnapshotPtr model = ball();
  record(model, motion());
  rewrite([](RecordingColumns& columns, auto& rows) {
    const std::size_t at = offset_of(columns, "alpha");
    for (auto& row : rows)
      row.erase(row.begin() + static_cast<std::ptrdiff_t>(at), row.begin() + static_cast<std::ptrdiff_t>(at + 8));
    std::erase_if(columns, [](const RecordingColumn& c) { return c.name == "alpha"; });
  });
  expect_all_but(verified(model), "tick: alpha");
}

TEST_F(Record, AnOlderRecordingHasOneFrictionForBoth) {
  const SnapshotPtr model = ball();
  record(model, motion(), {}, 0);
  // As programs before static_friction wrote it.
  rewrite([](RecordingColumns&, auto&) {},
          [](RecordingHead& head, std::vector<RecordingEvent>& events) {
            RecordingColumns& columns = head.streams["settings"];
            const auto at = static_cast<std::ptrdiff_t>(offset_of(columns, "static_friction"));
            for (RecordingEvent& event : events)
              if (event.stream == "settings") event.row.erase(event.row.begin() + at, event.row.begin() + at + 8);
            std::erase_if(columns, [](const RecordingColumn& c) { return c.name == "static_friction"; });
          });
  expect_all_but(verified(model), "settings: static_friction");
}

TEST_F(Record, WhatANewerProgramAddedIsReadButNotRepeated) {
  const SnapshotPtr model = ball();
  record(model, motion());
  for (const char* role : {"output", "input"}) {
    rewrite([&](RecordingColumns& columns, auto& rows) {
      if (columns.front().name == "grip") columns.front().role = role;
      if (columns.front().name == "grip") return;
      columns.insert(columns.begin(), {"grip", NumberType::U8, "", role});
      for (auto& row : rows) row.insert(row.begin(), std::byte{3});
    });
    auto replay = Replay::open(file_);
    ASSERT_TRUE(replay) << replay.error().message;
    const auto found = verify(*replay, model);
    if (std::string_view(role) == "output") {
      ASSERT_TRUE(found) << found.error().message;
      EXPECT_TRUE(found->holds());
    } else {
      ASSERT_FALSE(found);
      EXPECT_EQ(found.error().code, Errc::InvalidArgument);
      EXPECT_NE(found.error().message.find("grip"), std::string::npos) << found.error().message;
    }
  }
}

TEST_F(Record, OtherSettingsOnTheSameMotion) {
  // Straight down onto a plane and up again, without damping: the force is stiffness times depth.
  const SnapshotPtr plane = testing::displaced(testing::plane_shell(4, 8), [](Vec3d) { return 0.5; });
  std::vector<DeviceState> readings;
  for (int k = 0; k < 1000; ++k)
    readings.push_back(reading_at(k, {0.02, 2e-3 - 4e-3 * std::sin(std::numbers::pi * k / 1000), 0.02}));
  ServoSettings soft = settings();
  soft.force = {.stiffness = 300, .damping = 0, .guard = false};
  auto made = Recorder::create(file_, Recorder::Pace::Path, {}, plane, soft, DeviceInfo{});
  ASSERT_TRUE(made) << made.error().message;
  Servo servo(soft, DeviceInfo{});
  double squares = 0, deepest = 0;
  int pressed = 0;
  for (std::size_t k = 0; k < readings.size(); ++k) {
    const ServoTick tick{
        .number = k, .model = plane.get(), .reading = readings[k], .sample = servo.step(*plane, readings[k])};
    made->tick(tick);
    if (const double depth = -readings[k].position.y; depth > 0) {
      squares += depth * depth;
      deepest = std::max(deepest, depth);
      ++pressed;
    }
  }
  ASSERT_TRUE(made->finish(nullptr));
  auto replay = Replay::open(file_);
  ASSERT_TRUE(replay) << replay.error().message;
  const auto same = compare(*replay, plane, [](ServoSettings&) {});
  ASSERT_TRUE(same) << same.error().message;
  EXPECT_EQ(same->error_max, 0);
  EXPECT_EQ(same->contact_differs, 0U);
  EXPECT_EQ(same->ticks, 1000U);
  const auto stiffer = compare(*replay, plane, [](ServoSettings& s) { s.force.stiffness = 500; });
  ASSERT_TRUE(stiffer) << stiffer.error().message;
  EXPECT_NEAR(stiffer->force_rms, 300 * std::sqrt(squares / pressed), 1e-6);
  EXPECT_NEAR(stiffer->error_rms, 200 * std::sqrt(squares / pressed), 1e-6);
  EXPECT_NEAR(stiffer->error_max, 200 * deepest, 1e-9);
  EXPECT_NEAR(stiffer->direction_max, 0, 1e-6);
  EXPECT_EQ(stiffer->contact, static_cast<std::uint64_t>(pressed));
  EXPECT_EQ(stiffer->cost.count(), 1000U);
}

TEST_F(Record, ALiveSessionOfSculptingIsRepeatedThroughItsEdits) {
  const SnapshotPtr start = ball();
  std::vector<DeviceState> readings;
  for (int k = 0; k < 900; ++k) {
    const double side = 0.001 * k;
    const double reach = k < 200 ? 1.2 - 0.0012 * k : k < 700 ? 0.96 : 0.96 + 0.002 * (k - 700);
    const bool pressed = (k > 260 && k < 420) || (k > 470 && k < 650);
    readings.push_back(reading_at(k, Vec3d{std::sin(side), 0, std::cos(side)} * (reach * kMetres)));
    readings.back().buttons = pressed ? (k > 450 ? 0x101U : 1U) : 0U;
  }
  ReplayDevice device(DeviceInfo{.name = "hand"}, readings);
  auto made = recorder(start, Recorder::Pace::Live);
  ASSERT_TRUE(made) << made.error().message;
  Session session(device, start, nullptr, {.servo = settings(), .sculpt = {.full_depth = 0.02}}, &*made);
  session.set_brushes({{.tool = Tool::Carve, .radius = 0.2}, {.tool = Tool::Deposit, .radius = 0.15, .strength = 0.4}});
  ServoSettings stiffer = settings();
  stiffer.force.stiffness = 600;
  ASSERT_TRUE(session.set_servo(stiffer));
  for (int k = 0; k < 2000 && session.running(); ++k) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  const Status stopped = session.stop();
  ASSERT_TRUE(stopped) << stopped.error().message;
  EXPECT_EQ(session.stats().strokes, 2U);
  EXPECT_GT(session.stats().dabs, 20U);
  if (session.stats().servo.dropped != 0) GTEST_SKIP() << "the machine was too busy to keep every tick";

  const Verification found = verified(start);
  EXPECT_TRUE(found.holds()) << found.stopped << (found.difference ? found.difference->field : "");
  EXPECT_EQ(found.checked, 900U);
  auto replay = Replay::open(file_);
  ASSERT_TRUE(replay);
  EXPECT_EQ(replay->recording().head().fact("end"), "stopped");
  std::uint64_t number = 0;
  RecordedTick tick;
  while (*replay->next(number, tick)) {
  }
  EXPECT_GT(tick.model, 20U) << "the servo felt the edits";
  EXPECT_EQ(tick.settings, 1U);
  // Without the edits the recording cannot be repeated, so the check above has looked at them.
  EXPECT_FALSE(verified(session.head()).holds());
}

TEST_F(Record, ARecordingPlaysAsADevice) {
  const SnapshotPtr model = ball();
  record(model, motion());
  auto replay = Replay::open(file_);
  ASSERT_TRUE(replay);
  const auto readings = replay->readings();
  ASSERT_TRUE(readings) << readings.error().message;
  ASSERT_EQ(readings->size(), 1500U);
  ReplayDevice device(replay->device(), *readings);
  EXPECT_EQ(device.info().name, "hand");
  DeviceState state;
  for (const DeviceState& given : motion()) {
    ASSERT_TRUE(device.read(state));
    EXPECT_EQ(state.t, given.t);
    EXPECT_EQ(state.buttons, given.buttons);
    EXPECT_EQ(state.velocity, given.velocity);
    EXPECT_EQ(state.orientation, given.orientation);
  }
  EXPECT_FALSE(device.read(state));
}

TEST_F(Record, TheModelIsFoundAndKnownByItsContent) {
  const SnapshotPtr model = ball();
  const auto place = folder_ / "a.relief", other = folder_ / "b.relief";
  record(model, motion());
  auto replay = Replay::open(file_);
  ASSERT_TRUE(replay);
  auto found = find_model(*replay);
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().code, Errc::NotFound);
  EXPECT_NE(found.error().message.find("--model"), std::string::npos);
  ASSERT_TRUE(
      ModelFile::create(other, Model{.info = ModelInfo{}, .head = Snapshot::make(testing::sphere_shell(1, 4))}));
  found = find_model(*replay, other);
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().code, Errc::InvalidArgument);
  // Strokes that came later are taken back, in a copy.
  {
    auto file = ModelFile::create(place, Model{.info = ModelInfo{}, .head = model});
    ASSERT_TRUE(file) << file.error().message;
    Editor editor(model);
    editor.begin_stroke({.tool = Tool::Carve, .radius = 0.3});
    const SurfacePoint at = closest_point(*model, Vec3d{0, 0, 1});
    editor.dab(
        {.slab = at.slab, .contact = at.position, .cursor = at.position - at.normal * 0.05, .normal = at.normal});
    ASSERT_TRUE(editor.end_stroke());
    ASSERT_TRUE(file->commit(editor.head(), {.label = "dent"}));
  }
  found = find_model(*replay);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ((*found)->content_hash(), model->content_hash());
  EXPECT_TRUE(verified(*found).holds());
  auto file = ModelFile::open(place, true);
  ASSERT_TRUE(file);
  EXPECT_EQ(file->stroke_count(), 1U) << "the file itself stays as it is";
}

}  // namespace
}  // namespace relief
