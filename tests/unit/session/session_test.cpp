#include "document_support.h"
#include "session_support.h"

#include <relief/devices/open_device.h>
#include <relief/session/session.h>
#include <relief/session/stroke_text.h>

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

namespace relief {
namespace {

/// A sphere of radius about 1 in model units, 0.05 m in the hand.
Model ball() { return {.info = {}, .head = Snapshot::make(testing::sphere_shell(3, 16))}; }
using testing::kMetres;
using testing::settings;

/// Comes from +z, presses into the ball with the button held, slides, lifts off; `presses` times, a new brush each.
HandScript pressing(int presses, const std::shared_ptr<std::atomic<bool>>& done) {
  return [presses, done](double t) -> HandTarget {
    constexpr double kPress = 0.5;
    const int k = static_cast<int>(t / kPress);
    if (k >= presses) {
      done->store(true);
      return {{0, 0, 1.3 * kMetres}, 0};
    }
    const double phase = t / kPress - k;
    const bool down = phase > 0.3 && phase < 0.8;
    const double reach = phase > 0.1 && phase < 0.8 ? 0.9 : 1.3;
    const double side = 0.2 * k + (down ? 0.1 * (phase - 0.3) : 0);
    return {Vec3d{std::sin(side), 0, std::cos(side)} * (reach * kMetres),
            down ? 1U | (static_cast<std::uint32_t>(k) << 8U) : 0U};
  };
}

/// Runs the session until the script is over, or for ten seconds of wall time.
void wait_for(const std::atomic<bool>& done, const Session& session) {
  for (int k = 0; k < 1000 && !done.load() && session.running(); ++k)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
}

TEST(Session, PressesBecomeStrokesWithTheBrushesOfTheButtons) {
  auto done = std::make_shared<std::atomic<bool>>(false);
  SimulatedHand hand(plant_presets()[1], {.stiffness = 800, .damping = 8, .max_force = 3}, pressing(3, done));
  Document document(ball());
  const SnapshotPtr start = document.head();
  std::uint64_t seen = 0, next = 0;
  Session::Settings with_sink = settings();
  with_sink.on_tick = [&](const ServoTick& tick) {
    seen += tick.model != nullptr ? 1U : 0U;
    EXPECT_GE(tick.number, next);
    next = tick.number + 1;
  };
  Session session(hand, document, with_sink);
  session.set_brushes({{.tool = Tool::Carve, .radius = 0.2, .resilience = 0.005},
                       {.tool = Tool::Deposit, .radius = 0.2, .strength = 0.5},
                       {.tool = Tool::Paint, .radius = 0.2, .strength = 0.5, .colour = {1, 0, 0}}});
  // The application draws meanwhile: whatever it sees is whole.
  {
    SnapshotChannel::Reader reader = document.reader();
    for (int k = 0; k < 1000 && !done->load() && session.running(); ++k) {
      EXPECT_TRUE(validate(reader.latest()));
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  }
  ASSERT_TRUE(done->load());
  ASSERT_TRUE(session.stop());
  document.settle();
  const SessionStats stats = session.stats();
  const DocumentStatistics did = document.statistics();
  EXPECT_EQ(stats.strokes, 3U);
  EXPECT_EQ(did.strokes, 3U);
  EXPECT_GT(did.dabs, 20U);
  EXPECT_EQ(did.dab_time.count(), did.dabs);
  EXPECT_GT(stats.points, 20U);
  EXPECT_EQ(seen, stats.samples);
  EXPECT_GT(stats.contact_samples, 100U);
  const Snapshot& end = *document.head();
  EXPECT_TRUE(validate(end));
  EXPECT_TRUE(end.has(Layer::Colour));
  const auto alpha = [&](const Snapshot& model, double side) {
    return closest_point(model, Vec3d{std::sin(side), 0, std::cos(side)}).alpha;
  };
  EXPECT_LT(alpha(end, 0.025), alpha(*start, 0.025) - 0.02) << "carved";
  EXPECT_GT(alpha(end, 0.225), alpha(*start, 0.225) + 0.01) << "built";
}

TEST(Session, AButtonThatDropsOutIsOneStroke) {
  // Pressed for 1.2 s in which the hand slides, and up for 1 ms in each 100.
  std::vector<DeviceState> readings;
  for (int k = 0; k < 1400; ++k) {
    const double reach = k < 60 ? 1.25 - 0.005 * k : k < 1300 ? 0.95 : 1.25;
    const double side = 5e-4 * k;
    const bool down = k >= 60 && k < 1260 && k % 100 != 50;
    readings.push_back({.t = k * 1e-3,
                        .position = Vec3d{std::sin(side), 0, std::cos(side)} * (reach * kMetres),
                        .velocity = {},
                        .buttons = down ? 1U : 0U});
  }
  for (const double debounce : {20e-3, 0.0}) {
    ReplayDevice device(DeviceInfo{.name = "hand"}, readings);
    Session::Settings with = settings();
    with.servo.readings.debounce = debounce;
    Document document(ball());
    Session session(device, document, with);
    session.set_brush({.tool = Tool::Carve, .radius = 0.2});
    for (int k = 0; k < 2000 && session.running(); ++k) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    ASSERT_TRUE(session.stop());
    if (session.stats().servo.dropped != 0) GTEST_SKIP() << "the machine was too busy to keep every tick";
    document.settle();
    EXPECT_EQ(document.statistics().strokes, debounce > 0 ? 1U : 13U) << "or cut by each of them";
  }
}

/// What a hand does is in the file, and its text makes it again on the model as it was, stroke by stroke.
TEST(Session, EachFinishedStrokeIsInTheFileAndItsTextMakesItAgain) {
  const testing::Folder folder;
  testing::Events events;
  std::vector<std::uint64_t> hashes;
  {
    DocumentSettings with = events.settings();
    std::atomic<Document*> there{nullptr};
    with.on_event = [&](const Event& event) {
      events.add(event);
      const auto* finished = std::get_if<StrokeFinished>(&event);
      if (finished != nullptr && finished->result.changed) hashes.push_back(there.load()->head()->content_hash());
    };
    Document document = testing::document_in(folder / "a.relief", ball(), with);
    there.store(&document);
    auto done = std::make_shared<std::atomic<bool>>(false);
    SimulatedHand hand(plant_presets()[1], {.stiffness = 800, .damping = 8, .max_force = 3}, pressing(4, done));
    Session session(hand, document, settings());
    session.set_brushes({{.tool = Tool::Carve, .radius = 0.2, .resilience = 0.005},
                         {.tool = Tool::Clay, .radius = 0.2, .strength = 0.5, .stabiliser = 0.05},
                         {.tool = Tool::Paint, .radius = 0.2, .strength = 0.5, .colour = {1, 0, 0}, .symmetry = 1},
                         {.tool = Tool::Smooth, .radius = 0.2, .strength = 0.5}});
    wait_for(*done, session);
    ASSERT_TRUE(session.stop());
    ASSERT_TRUE(document.close());
  }
  ASSERT_EQ(hashes.size(), 4U);
  auto opened = ModelFile::open(folder / "a.relief");
  ASSERT_TRUE(opened) << opened.error().message;
  EXPECT_EQ(opened->stroke_count(), 4U);
  EXPECT_EQ(opened->model().head->content_hash(), hashes.back());
  const auto journal = opened->strokes();
  ASSERT_TRUE(journal);
  Editor editor(ball().head);
  for (std::size_t k = 0; k < journal->size(); ++k) {
    const auto stroke = stroke_of((*journal)[k].details, "journal");
    ASSERT_TRUE(stroke) << stroke.error().message;
    EXPECT_TRUE(stroke->tip);
    EXPECT_TRUE(play(editor, *stroke).changed);
    EXPECT_EQ(editor.head()->content_hash(), hashes[k]) << "stroke " << k + 1;
  }
}

/// The button stays down while the hand lifts off for `away` s, and touches again beside.
TEST(Session, AHandThatLiftsOffEndsItsStrokeAndOneThatBouncesDoesNot) {
  for (const double away : {0.02, 0.3}) {
    std::vector<DeviceState> readings;
    const int lift = 600, land = lift + static_cast<int>(away * 1000);
    for (int k = 0; k < land + 500; ++k) {
      const bool off = k >= lift && k < land;
      const double reach = k < 300 ? 1.25 - 0.001 * k : off ? 1.04 : 0.97;
      const double side = k < land ? 0 : std::min(1e-3 * (k - land), 0.1);
      readings.push_back({.t = k * 1e-3,
                          .position = Vec3d{std::sin(side), 0, std::cos(side)} * (reach * kMetres),
                          .velocity = {},
                          .buttons = k >= 320 && k < land + 450 ? 1U : 0U});
    }
    ReplayDevice device(DeviceInfo{.name = "hand"}, readings);
    Document document(ball());
    Session session(device, document, settings());
    session.set_brush({.tool = Tool::Deposit, .radius = 0.2, .strength = 0.2});
    for (int k = 0; k < 2000 && session.running(); ++k) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    ASSERT_TRUE(session.stop());
    if (session.stats().servo.dropped != 0) GTEST_SKIP() << "the machine was too busy to keep every tick";
    document.settle();
    EXPECT_EQ(session.stats().strokes, away > 0.05 ? 2U : 1U) << away;
    EXPECT_EQ(document.statistics().strokes, session.stats().strokes);
  }
}

/// A recording that ends, or breaks off.
class EndingDevice final : public HapticDevice {
 public:
  EndingDevice(std::vector<DeviceState> readings, bool lost) : readings_({}, std::move(readings)), lost_(lost) {}
  const DeviceInfo& info() const noexcept override { return readings_.info(); }
  bool read(DeviceState& state) noexcept override { return readings_.read(state); }
  bool ended() const noexcept override { return !lost_ && readings_.ended(); }
  bool write(const Wrench& wrench) noexcept override { return readings_.write(wrench); }

 private:
  ReplayDevice readings_;
  bool lost_;
};

TEST(Session, AStrokeIsKeptWhereTheDeviceEndsOrIsLost) {
  // Sixty readings of approach, sixty that press with the button down, then nothing more comes.
  std::vector<DeviceState> readings;
  for (int k = 0; k < 120; ++k) {
    const double reach = k < 60 ? 1.25 - 0.005 * k : 0.95;
    readings.push_back(
        {.t = k * 1e-3, .position = {0, 0, reach * kMetres}, .velocity = {}, .buttons = k >= 60 ? 1U : 0U});
  }
  for (const bool lost : {false, true}) {
    const testing::Folder folder;
    testing::Events events;
    Document document = testing::document_in(folder / "a.relief", ball(), events.settings());
    EndingDevice device(readings, lost);
    Session::Settings settings_here = settings();
    settings_here.loss.give_up_after = 0.1;
    Session session(device, document, settings_here);
    session.set_brush({.tool = Tool::Carve, .radius = 0.2});
    // It is in the file before anybody stops the session.
    for (int k = 0; k < 1000 && events.of<Saved>().empty(); ++k)
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    const auto opened = ModelFile::open(folder / "a.relief", true);
    ASSERT_TRUE(opened) << opened.error().message;
    EXPECT_EQ(opened->stroke_count(), 1U) << lost;
    for (int k = 0; k < 1000 && session.running(); ++k) std::this_thread::sleep_for(std::chrono::milliseconds(20));
    EXPECT_FALSE(session.running());
    EXPECT_TRUE(session.stop());
    EXPECT_TRUE(session.stop()) << "stopping twice is harmless";
    EXPECT_EQ(document.statistics().strokes, 1U);
    EXPECT_EQ((session.stats().flags & bit(ServoFault::DeviceLost)) != 0, lost);
    EXPECT_TRUE(validate(*document.head()));
  }
}

/// The hand feels nothing there, so the tip must not cut either, though it is in the material and the button is down.
TEST(Session, InTheSafeStateNothingIsCut) {
  enum class Case { Fine, StartsInside, Faults };
  for (const Case now : {Case::Fine, Case::StartsInside, Case::Faults}) {
    std::vector<DeviceState> readings;
    double t = 0;
    for (int k = 0; k < 300; ++k) {
      const double reach = now == Case::StartsInside ? 0.95 : std::max(0.95, 1.25 - 0.005 * k);
      t += now == Case::Faults && k == 90 ? 0.2 : 1e-3;  // a gap for which the servo lets go until the tip is outside
      readings.push_back({.t = t, .position = {0, 0, reach * kMetres}, .velocity = {}, .buttons = k >= 100 ? 1U : 0U});
    }
    EndingDevice device(readings, false);
    Document document(ball());
    const SnapshotPtr start = document.head();
    Session session(device, document, settings());
    session.set_brush({.tool = Tool::Carve, .radius = 0.2});
    for (int k = 0; k < 1000 && session.running(); ++k) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    ASSERT_FALSE(session.running());
    ASSERT_TRUE(session.stop());
    document.settle();
    const DocumentStatistics did = document.statistics();
    EXPECT_GT(session.stats().contact_samples, 150U) << "the tip is in the material, " << int(now);
    if (now == Case::Fine) {
      EXPECT_GT(did.dabs, 0U);
      EXPECT_EQ(did.strokes, 1U);
    } else {
      EXPECT_EQ(did.dabs, 0U) << int(now);
      EXPECT_EQ(document.head()->content_hash(), start->content_hash()) << int(now);
    }
  }
}

}  // namespace
}  // namespace relief
