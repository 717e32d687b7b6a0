// Recordings: what a servo did comes back bit for bit, and what cannot be repeated is said.
#include "support/bits.h"
#include "support/canceller.h"
#include "support/shells.h"

#include <relief/devices/open_device.h>
#include <relief/session/fields.h>
#include <relief/session/recorder.h>
#include <relief/session/replay.h>
#include <relief/session/session.h>

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>
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

TEST_F(Record, WhatTheDevicesSayComesBack) {
  const SnapshotPtr model = ball();
  DeviceInfo device = {.name = "arm", .serial = "A123", .filters = "force gate 0.3"};
  device.delay = 0.0015;
  device.workspace.add(Vec3d{-0.1, -0.2, -0.3});
  device.workspace.add(Vec3d{0.1, 0.2, 0.3});
  device.rate = 4000;
  device.sensed = {.position = 3, .rotation = 3, .gripper = 1};
  device.actuated = {.position = 2, .rotation = 1, .gripper = 0};
  device.handedness = Handedness::Left;
  device.gravity = GravityCompensation::Library;
  device.absolute = false;
  auto made = Recorder::create(file_, Recorder::Pace::Path, {}, model, settings(), device);
  ASSERT_TRUE(made) << made.error().message;
  Servo servo(settings(), device);
  ServoTick tick;
  tick.model = model.get();
  tick.reading = reading_at(1, {0, 0, 0.06});
  tick.reading.angular_velocity = {1, 2, 3};
  tick.reading.has_angular_velocity = true;
  tick.reading.gripper = 0.01;
  tick.reading.gripper_force = 0.5;
  tick.reading.has_gripper = true;
  tick.reading.pressure = 0.25;
  tick.reading.has_pressure = true;
  tick.reading.forces_off = true;
  tick.reading.buttons = 1;
  tick.reading.pressed = 3;
  tick.reading.released = 2;
  tick.sample = servo.step(*model, tick.reading);
  made->tick(tick);
  ASSERT_TRUE(made->finish(nullptr));
  EXPECT_EQ(made->kept(), 1U);

  auto replay = Replay::open(file_);
  ASSERT_TRUE(replay) << replay.error().message;
  EXPECT_EQ(replay->recording().head().fact("device_filters"), "force gate 0.3");
  EXPECT_EQ(replay->recording().head().fact("device_serial_hash").size(), 16U);
  EXPECT_EQ(replay->contact_law(), kContactLaw);
  std::vector<std::byte> was, is;
  detail::append_row(device, was);
  detail::append_row(replay->device(), is);
  EXPECT_EQ(was, is);
  std::uint64_t number = 0;
  RecordedTick found;
  ASSERT_TRUE(*replay->next(number, found));
  was.clear();
  is.clear();
  detail::append_row(RecordedTick{0, 0, 0, tick.reading, tick.sample}, was);
  detail::append_row(found, is);
  EXPECT_EQ(was, is);
  EXPECT_EQ(found.sample.buttons, 3U) << "the click between two readings";
  EXPECT_TRUE(verified(model).holds());
}

TEST_F(Record, AWorkspaceThatIsMovedMeanwhileIsRepeated) {
  const SnapshotPtr model = ball();
  auto made = recorder(model);
  ASSERT_TRUE(made) << made.error().message;
  Servo servo(settings(), DeviceInfo{});
  ServoSettings now = settings();
  std::uint32_t changes = 0;
  double force = 0;
  for (int k = 0; k < 1200; ++k) {
    ServoTick tick;
    tick.number = static_cast<std::uint64_t>(k);
    tick.model = model.get();
    tick.reading = reading_at(k, {0, 0.001 * std::sin(0.01 * k), kMetres * (1.05 - 0.1 * std::min(1.0, k / 300.0))});
    if (k % 7 == 0) tick.reading.t -= 1.5e-3;  // no news
    tick.reading.buttons = k > 600 && k < 650 && k % 10 != 0 ? 2U : 0U;
    if (k % 100 == 50) {
      now.workspace.rotation = {std::cos(1e-4 * k), 0, std::sin(1e-4 * k), 0};
      now.workspace.metres_per_unit *= 1.01;
      now.clutch = {
          .held = k == 350 || k == 450, .buttons = 2, .recentre = k > 900 ? 1U : 0U, .centre = {0, 0.05, 0.98}};
      now.readings.debounce = 5e-3;
      servo.set(now);
      made->set(now);
      ++changes;
    }
    tick.settings = changes;
    tick.sample = servo.step(*model, tick.reading);
    force = std::max(force, length(tick.sample.force));
    made->tick(tick);
  }
  ASSERT_TRUE(made->finish(nullptr));
  EXPECT_GT(force, 0.5);
  const Verification found = verified(model);
  EXPECT_TRUE(found.holds()) << found.stopped << (found.difference ? found.difference->field : "");
  EXPECT_EQ(found.checked, 1200U);
}

TEST_F(Record, OneThatIsCutShortIsVerifiedAsFarAsItIsWhole) {
  const SnapshotPtr model = ball();
  record(model, motion());
  std::ifstream in(file_, std::ios::binary);
  const std::string sound{std::istreambuf_iterator<char>(in), {}};
  std::uint64_t last = 0;
  int refused = 0;
  for (std::size_t part = 1; part <= 24; ++part) {
    std::ofstream(file_, std::ios::binary) << sound.substr(0, sound.size() * part / 24 - 7);
    auto replay = Replay::open(file_);
    if (!replay) {
      ++refused;
      EXPECT_EQ(last, 0U);
      EXPECT_NE(replay.error().message.find("was cut"), std::string::npos) << replay.error().message;
      continue;
    }
    ASSERT_TRUE(replay->recording().cut());
    const auto found = verify(*replay, model);
    ASSERT_TRUE(found) << found.error().message;
    EXPECT_TRUE(found->holds()) << found->stopped;
    EXPECT_GE(found->checked, last);
    last = found->checked;
  }
  EXPECT_GE(last, 1250U) << "only the end of the last page is cut";
  EXPECT_LE(refused, 5) << "the head: what the ticks are made of";
}

TEST_F(Record, WhatComesAfterAFullDiskIsNotWritten) {
  const SnapshotPtr model = ball();
  auto made = recorder(model, Recorder::Pace::Live);
  ASSERT_TRUE(made) << made.error().message;
  Servo servo(settings(), DeviceInfo{});
  std::mt19937_64 random(3);
  std::uint64_t number = 0;
  const auto run = [&](int ticks) {
    for (int k = 0; k < ticks; ++k, ++number) {
      ServoTick tick;
      tick.number = number;
      tick.clock_ns = random();  // does not pack
      tick.model = model.get();
      tick.reading = reading_at(static_cast<int>(number), {0, 0, 1.2 * kMetres});
      tick.sample = servo.step(*model, tick.reading);
      made->tick(tick);
      if (k % 250 == 249) std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  };
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit small{100'000, before.rlim_max};
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  run(10'000);
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, handler);
  run(1'000);
  const Status finished = made->finish(nullptr);
  ASSERT_FALSE(finished);
  EXPECT_NE(finished.error().message.find("a.rlog"), std::string::npos) << finished.error().message;
  auto replay = Replay::open(file_);
  ASSERT_TRUE(replay) << replay.error().message;
  EXPECT_EQ(replay->recording().tick_count(), made->kept());
  ASSERT_EQ(replay->recording().runs().size(), 1U) << "no gap";
  EXPECT_GT(made->kept(), 500U);
  EXPECT_LT(made->kept(), 10'000U);
  EXPECT_TRUE(verified(model).holds());
}

TEST_F(Record, ATickIsLeftOutWhoseSettingsWereCutOff) {
  const SnapshotPtr model = ball();
  record(model, motion());
  // The change of the settings at tick 400 is lost with the end, by a page that comes late.
  rewrite([](RecordingColumns&, auto&) {},
          [](RecordingHead&, std::vector<RecordingEvent>& events) {
            std::erase_if(events, [](const RecordingEvent& e) { return e.stream == "settings" && e.at == 1; });
          });
  {
    auto whole = Replay::open(file_);
    ASSERT_TRUE(whole);
    EXPECT_FALSE(verify(*whole, model)) << "of a whole file that is damage";
  }
  std::filesystem::resize_file(file_, std::filesystem::file_size(file_) - 1);
  const Verification found = verified(model);
  EXPECT_TRUE(found.holds());
  EXPECT_EQ(found.checked, 400U);
}

TEST_F(Record, OneOfAnOlderContactLawOpensPlaysAndIsCompared) {
  const std::filesystem::path data = std::filesystem::path(RELIEF_SOURCE_DIR) / "tests/data";
  auto replay = Replay::open(data / "law-1.rlog");
  ASSERT_TRUE(replay) << replay.error().message;
  EXPECT_EQ(replay->contact_law(), 1);
  EXPECT_EQ(replay->recording().tick_count(), 220U);
  EXPECT_TRUE(replay->unknown().empty()) << replay->unknown();
  EXPECT_EQ(replay->settings()[0].force.friction, 0.3);
  EXPECT_EQ(replay->settings()[0].workspace.rotation, Quatd{});
  EXPECT_EQ(replay->settings()[0].readings.debounce, ReadingSettings{}.debounce);
  const auto readings = replay->readings();
  ASSERT_TRUE(readings);
  EXPECT_EQ(readings->size(), 220U);
  const auto model = find_model(*replay);
  ASSERT_TRUE(model) << model.error().message << ": the model is beside it, under the name that it had";
  const auto found = verify(*replay, *model);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ(found->contact_law, 1);
  ASSERT_TRUE(found->difference) << "its reading that came twice was a fault then";
  EXPECT_LE(found->difference->tick, 200U);
  EXPECT_NE(std::ranges::find(found->missing, "settings: debounce"), found->missing.end());
  const auto compared = compare(*replay, *model, [](ServoSettings& s) { s.force.friction = 0; });
  ASSERT_TRUE(compared) << compared.error().message;
  EXPECT_EQ(compared->ticks, 220U);
  EXPECT_GT(compared->force_rms, 0.3);
}

/// Gives no reading for some ticks.
class GappyDevice final : public HapticDevice {
 public:
  explicit GappyDevice(std::vector<DeviceState> readings) : readings_({.name = "hand"}, std::move(readings)) {}
  const DeviceInfo& info() const noexcept override { return readings_.info(); }
  bool read(DeviceState& state) noexcept override {
    ++asked_;
    return (asked_ < 300 || asked_ > 310) && readings_.read(state);
  }
  bool ended() const noexcept override { return readings_.ended(); }
  bool write(const Wrench& wrench) noexcept override { return readings_.write(wrench); }

 private:
  ReplayDevice readings_;
  int asked_ = 0;
};

TEST_F(Record, ADeviceThatWasAwayLeavesNoGap) {
  const SnapshotPtr model = ball();
  std::vector<DeviceState> readings;
  for (int k = 0; k < 700; ++k) {
    const double reach = k < 400 ? 1.25 - 0.3 * std::min(1.0, k / 250.0) : 1.25;
    readings.push_back(reading_at(k, {0, 0, reach * kMetres}));
  }
  readings[600].position.z = 1.2 * kMetres;
  GappyDevice device(readings);
  auto made = recorder(model, Recorder::Pace::Live);
  ASSERT_TRUE(made) << made.error().message;
  Document document({.info = {}, .head = model});
  Session session(device, document, {.servo = settings()}, &*made);
  for (int k = 0; k < 2000 && session.running(); ++k) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  ASSERT_TRUE(session.stop());
  if (session.stats().servo.dropped != 0) GTEST_SKIP() << "the machine was too busy to keep every tick";
  ASSERT_EQ(session.losses().size(), 1U);
  EXPECT_TRUE(session.losses()[0].over);
  EXPECT_EQ(made->kept(), 700U);
  const Verification found = verified(model);
  EXPECT_TRUE(found.holds()) << found.stopped << (found.difference ? found.difference->field : "");
  EXPECT_EQ(found.checked, 700U);
  auto replay = Replay::open(file_);
  ASSERT_TRUE(replay);
  EXPECT_EQ(replay->recording().head().fact("end"), "stopped");
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
  Document document({.info = {}, .head = start});
  Session session(device, document, {.servo = settings(), .sculpt = {.full_depth = 0.02}}, &*made);
  session.set_brushes({{.tool = Tool::Carve, .radius = 0.2, .pressure_drives = PressureDrives::Both},
                       {.tool = Tool::Deposit, .radius = 0.15, .strength = 0.4}});
  ServoSettings stiffer = settings();
  stiffer.force.stiffness = 600;
  ASSERT_TRUE(session.set_servo(stiffer));
  // Somebody else undoes, redoes, cancels and draws meanwhile; the hand feels that, too.
  const SurfacePoint other = closest_point(*start, Vec3d{1, 0, 0});
  const auto draw = [&](double t, bool whole) {
    document.post(BeginStroke{.brush = {.tool = Tool::Inflate, .radius = 0.3}, .tip = false, .label = {}, .source = 7});
    document.post(MoveStroke{{{t, other.position, 1}, {t + 0.1, other.position, 1}}, 7});
    document.post(whole ? Command(EndStroke{7}) : Command(CancelStroke{7}));
  };
  draw(0, true);
  document.post(Undo{});
  draw(0.2, false);
  for (int k = 0; k < 2000 && session.running(); ++k) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    if (k == 160) document.post(Undo{});  // if the hand has a stroke open, it ends with that
    if (k == 164) document.post(Redo{});
  }
  const Status stopped = session.stop();
  ASSERT_TRUE(stopped) << stopped.error().message;
  EXPECT_GE(document.statistics().strokes, 2U);
  EXPECT_GT(document.statistics().dabs, 20U);
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
  EXPECT_FALSE(verified(document.head()).holds());
}

TEST_F(Record, ReadingItCanBeCancelled) {
  const SnapshotPtr model = ball();
  record(model, motion());
  const int stopped = testing::times_stopped(
      [&](const Progress& progress) { return testing::code(play_as_device(file_, progress)); }, [] {}, 101);
  EXPECT_GT(stopped, 50);
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
    ASSERT_TRUE(editor.end_stroke().changed);
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
