// Strokes that once ran out of clay without a word, played again: they come out clean, or say why they had to stop.
#include "document_support.h"
#include "support/data.h"

#include <relief/convert/convert.h>
#include <relief/convert/room.h>
#include <relief/mesh/samples.h>
#include <relief/session/recorder.h>
#include <relief/session/replay.h>
#include <relief/session/stroke_text.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <numbers>
#include <string>
#include <vector>

namespace relief {
namespace {

using testing::Events;

/// What a file's strokes did to a default conversion of a sample of 100,000 triangles.
struct Played {
  SnapshotPtr before, after;
  double diagonal = 0;
  std::vector<Stroke> strokes;
  std::vector<StrokeFinished> told;
  std::vector<RoomEnded> rooms;

  /// The room that lacked most, which the sentence to people is about.
  [[nodiscard]] RoomEnded worst() const { return *std::ranges::max_element(rooms, {}, &RoomEnded::lacking); }
  /// Samples of the displaced surface on the bare inner or outer triangles.
  [[nodiscard]] std::size_t bare() const {
    std::size_t sum = 0;
    for (SlabId s = 0; s < after->slab_mesh().slab_count(); ++s) {
      const float* alpha = after->displacement(s);
      sum += static_cast<std::size_t>(std::count_if(alpha, alpha + sample_count(after->slab_mesh().intervals(s)),
                                                    [](float a) { return a <= 0 || a >= 1; }));
    }
    return sum;
  }
};

Played play_file(const char* sample, const std::filesystem::path& file) {
  Played all;
  std::ifstream stream(file);
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  auto strokes = strokes_of(text, file.string());
  EXPECT_TRUE(strokes) << strokes.error().message;
  auto made = convert(*make_sample(sample, 100'000), {});
  EXPECT_TRUE(made) << made.error().message;
  if (!strokes || !made) return all;
  all.strokes = *std::move(strokes);
  all.diagonal = made->model.info.source_diagonal;
  all.before = made->model.head;
  Events events;
  DocumentSettings settings = events.settings();
  settings.make_room = room_maker(all.diagonal);
  Document document(made->model, std::move(settings));
  for (const Stroke& stroke : all.strokes) testing::post(document, stroke);
  document.settle();
  all.after = document.head();
  all.told = events.of<StrokeFinished>();
  all.rooms = events.of<RoomEnded>();
  EXPECT_TRUE(validate(*all.after));
  EXPECT_EQ(all.told.size(), all.strokes.size());
  return all;
}

/// The sample pumpkin with a cut of 30.5 % of its diagonal.
const Played& pumpkin_cut(const std::filesystem::path& file) {
  static const Played kPlayed = play_file("pumpkin", file);
  return kPlayed;
}

/// The sample of a surface that lies farthest from another surface.
Vec3d farthest_from(const Snapshot& of, const Snapshot& from) {
  Vec3d farthest;
  double most = 0;
  PickHint hint;
  for (SlabId s = 0; s < of.slab_mesh().slab_count(); ++s) {
    const int n = of.slab_mesh().intervals(s);
    for (int j = 0; j <= n; j += 2)
      for (int i = 0; i + j <= n; i += 2) {
        const Vec3d p = sample_position(of, s, {i, j});
        const double off = length(closest_point(from, p, hint).position - p);
        if (off <= most) continue;
        most = off;
        farthest = p;
      }
  }
  return farthest;
}

TEST(StrokesPlayedAgain, ACutDeeperThanTheClayGoesToTheMiddleAndSaysThatTheFormEndsThere) {
  RELIEF_DATA_FILE(file, "reports/strokes/carve_deeper_than_clay.json");
  const Played& played = pumpkin_cut(file);
  ASSERT_EQ(played.told.size(), 1U);
  // 60 mm into a pumpkin that is some 100 mm thick there.
  EXPECT_TRUE(played.told[0].result.changed);
  EXPECT_GT(played.told[0].result.limited, 0U);
  ASSERT_FALSE(played.rooms.empty());
  EXPECT_EQ(played.worst().bar, RoomBar::FarSide);
  EXPECT_GT(played.worst().bar_distance, 0.4 * played.diagonal);
  EXPECT_LT(played.worst().bar_distance, 0.55 * played.diagonal);
  EXPECT_EQ(played.bare(), 0U) << "no bare inner triangles";
  const Vec3d place = played.strokes[0].points[0].position, in = -normalized(place);
  const auto was = raycast(*played.before, {place - in * played.diagonal, in});
  const auto is = raycast(*played.after, {place - in * played.diagonal, in});
  ASSERT_TRUE(was && is);
  const double deep = (is->distance - was->distance) / played.diagonal;
  std::printf("cut of 30.5 %% of the diagonal: %.3f deep, %zu samples limited\n", deep, played.told[0].result.limited);
  EXPECT_GT(deep, 0.15) << "it was 0.07 without room";
}

TEST(StrokesPlayedAgain, ARecordingOfThemIsRepeatedOnTheRoomThatTheyGot) {
  RELIEF_DATA_FILE(file, "reports/strokes/carve_deeper_than_clay.json");
  const Played& played = pumpkin_cut(file);
  ASSERT_EQ(played.told.size(), 1U);
  const testing::Folder folder;
  const ServoSettings servo_settings = {.workspace = {.metres_per_unit = 0.1 / played.diagonal}};
  Events events;
  DocumentSettings settings = events.settings();
  settings.make_room = room_maker(played.diagonal);
  Document document(Model{.info = {}, .head = played.before}, settings);
  auto recorder = Recorder::create(folder / "a.rlog", Recorder::Pace::Path, {.program = "test"}, played.before,
                                   servo_settings, DeviceInfo{});
  ASSERT_TRUE(recorder) << recorder.error().message;
  document.watch([&](const EditNote& note) { recorder->note(note); });
  Servo servo(servo_settings, DeviceInfo{});
  std::uint64_t ticks = 0;
  const auto feel = [&](Vec3d place) {
    const SnapshotPtr head = document.head();
    ServoTick tick;
    tick.number = ticks++;
    tick.model = head.get();
    tick.reading.t = static_cast<double>(tick.number) * 1e-3;
    tick.reading.position = place * servo_settings.workspace.metres_per_unit;
    tick.sample = servo.step(*head, tick.reading);
    recorder->tick(tick);
    return tick.sample.contact;
  };
  const Vec3d place = played.strokes[0].points[0].position, out = normalized(place);
  EXPECT_FALSE(feel(place + out * played.diagonal));
  testing::post(document, played.strokes[0]);
  document.settle();
  EXPECT_EQ(document.head()->content_hash(), played.after->content_hash()) << "recorded or not";
  const auto ground = raycast(*played.after, {place + out * played.diagonal, -out});
  ASSERT_TRUE(ground);
  EXPECT_TRUE(feel(ground->point.position - out * (0.01 * played.diagonal)));
  document.watch({});
  ASSERT_TRUE(recorder->finish(nullptr));
  auto replay = Replay::open(folder / "a.rlog");
  ASSERT_TRUE(replay) << replay.error().message;
  const auto verified = verify(*replay, played.before, room_maker(played.diagonal));
  ASSERT_TRUE(verified) << verified.error().message;
  EXPECT_TRUE(verified->holds()) << verified->stopped << (verified->difference ? verified->difference->field : "");
  EXPECT_EQ(verified->checked, ticks);
}

TEST(StrokesPlayedAgain, ALongDepositIsARoundLumpAndSaysWhereItHadToStop) {
  RELIEF_DATA_FILE(file, "reports/strokes/deposit_longer_than_room.json");
  const Played played = play_file("pumpkin", file);
  ASSERT_EQ(played.told.size(), 1U);
  std::printf("deposit: %zu samples limited, %zu at the end of the room\n", played.told[0].result.limited,
              played.bare());
  if (played.told[0].result.limited > 0) {
    ASSERT_FALSE(played.rooms.empty());
    EXPECT_NE(played.worst().bar, RoomBar::None);
  }
  // Across the way from where it began to its tip it is as wide in all directions, and narrower the farther out.
  const SurfacePoint on = closest_point(*played.before, played.strokes[0].points[0].position);
  const Vec3d tip = farthest_from(*played.after, *played.before);
  const Vec3d up = normalized(tip - on.position), side = normalized(cross(up, Vec3d{1, 0, 0})), ahead = cross(up, side);
  const double radius = played.strokes[0].brush.radius;
  std::printf("lump: %.2f radii high\n", length(tip - on.position) / radius);
  EXPECT_GT(length(tip - on.position), radius);
  double last = 1e9;
  for (const double share : {0.4, 0.6, 0.8}) {
    constexpr int kTurns = 24;
    double sum = 0, least = 1e9, most = 0;
    for (int k = 0; k < kTurns; ++k) {
      const double turn = 2 * std::numbers::pi * k / kTurns;
      const Vec3d from = on.position + (tip - on.position) * share;
      const auto out = raycast(*played.after, {from, side * std::cos(turn) + ahead * std::sin(turn)});
      ASSERT_TRUE(out);
      EXPECT_GT(dot(out->point.normal, out->point.position - from), 0) << "from inside";
      sum += out->distance / kTurns;
      least = std::min(least, out->distance);
      most = std::max(most, out->distance);
    }
    std::printf("at %.1f of it: %.3f radii wide, from %.3f to %.3f\n", share, sum / radius, least / radius,
                most / radius);
    EXPECT_LT(sum, last);
    EXPECT_LT(most, 2 * least);
    last = sum;
  }
}

TEST(StrokesPlayedAgain, TheExampleOnTheHeadComesOutWhole) {
  const Played played = play_file("head", std::filesystem::path(RELIEF_EXAMPLES) / "head.json");
  for (const StrokeFinished& stroke : played.told) {
    EXPECT_TRUE(stroke.result.changed) << stroke.label;
    EXPECT_EQ(stroke.result.limited, 0U) << stroke.label;
    EXPECT_EQ(stroke.result.missed, 0U) << stroke.label;
    EXPECT_FALSE(stroke.result.detail_limited) << stroke.label;
  }
  EXPECT_EQ(played.bare(), 0U);
}

}  // namespace
}  // namespace relief
