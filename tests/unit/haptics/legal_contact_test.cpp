// Contact judged tick by tick from the model's triangles: no tunnelling, no change of side without a way, no letting go
// inside; over slides, taps, deep presses and jumps, at rims, ears, fingers and through thin walls.
#include "support/contact_runs.h"
#include "support/data.h"
#include "support/shells.h"

#include <relief/convert/convert.h>
#include <relief/core/sweep.h>
#include <relief/mesh/import.h>
#include <relief/mesh/samples.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <random>
#include <string>

namespace relief {
namespace {

using testing::ContactJudge;
using testing::is_closed;
using testing::TriangleSoup;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr long kPressed = 5'000;
#else
constexpr long kPressed = 160'000;
#endif

/// How many pressed ticks a model is judged by: over the bunny, the bowl and the three other scans, with the certified
/// ones, 10^6 together; in the long form 10^8.
long wanted_ticks() { return std::getenv("RELIEF_SOAK") != nullptr ? 15'000'000 : kPressed; }

void judge(const std::string& title, const Snapshot& model, bool closed, long wanted) {
  const testing::ContactRuns done = testing::judged_runs(model, closed, wanted);
  std::printf("%s: %ld pressed of %ld ticks, %ld thin places: %ld bad\n", title.c_str(), done.pressed, done.ticks,
              done.thin, done.bad());
  EXPECT_EQ(done.bad(), 0) << title << ", " << done.first;
}

class LegalContact : public ::testing::TestWithParam<const char*> {};

TEST_P(LegalContact, OnASample) {
  const auto mesh = make_sample(GetParam(), 30'000);
  ASSERT_TRUE(mesh);
  const auto made = convert(*mesh, {.slabs = 200, .intervals = 32});
  ASSERT_TRUE(made) << made.error().message;
  const Snapshot& model = *made->model.head;
  judge(GetParam(), model, is_closed(model.slab_mesh()), wanted_ticks());
}
INSTANTIATE_TEST_SUITE_P(Samples, LegalContact, ::testing::Values("bowl", "pumpkin", "head"),
                         [](const auto& test) { return std::string(test.param); });

/// As who converts a scan gets it: certified, with n per slab by the default error.
class LegalContactAsConverted : public ::testing::TestWithParam<const char*> {};

TEST_P(LegalContactAsConverted, OnACertifiedScan) {
  RELIEF_DATA_FILE(file, std::string("a_models/") + GetParam() + ".ply");
  const auto mesh = import_mesh(file);
  ASSERT_TRUE(mesh) << mesh.error().message;
  auto made = convert(*mesh, {});
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_EQ(made->model.info.mode, Mode::Certified);
  if (made->model.head->has(Layer::Void)) {
    // Where the scan is open, the way through the opening is none through the solid.
    judge(GetParam(), *made->model.head, false, wanted_ticks() / 2);
    made = convert(made->mended, {});
    ASSERT_TRUE(made) << made.error().message;
    EXPECT_EQ(made->model.info.mode, Mode::Certified);
  }
  const Snapshot& model = *made->model.head;
  ASSERT_TRUE(is_closed(model.slab_mesh()) && !model.has(Layer::Void));
  judge(GetParam() + std::string(", closed"), model, true, wanted_ticks() / 2);
  const double size = TriangleSoup(model).size();
  for (const double share : {0.002, 0.01, 0.03}) {
    const testing::ContactRuns done = testing::judged_ball_runs(model, share * size, wanted_ticks() / 100);
    std::printf("%s, a ball of %g: %ld pressed: %ld bad\n", GetParam(), share, done.pressed, done.bad());
    EXPECT_EQ(done.bad(), 0) << GetParam() << ", a ball of " << share << ", " << done.first;
  }
}
INSTANTIATE_TEST_SUITE_P(Scans, LegalContactAsConverted,
                         ::testing::Values("bunny", "visible_human_skin", "elephant_refined"),
                         [](const auto& test) { return std::string(test.param); });

double rough(Vec3d p) {
  return 0.5 + 0.25 * std::sin(9 * p.x) * std::cos(8 * p.z) + 0.15 * std::sin(41 * p.x + 30 * p.y);
}

TEST(LegalContact, OverARoughTorusAndARoughOpenSheet) {
  judge("torus", *testing::displaced(testing::torus_shell(16, 10, 16), rough), true, kPressed / 10);
  judge("sheet", *testing::displaced(testing::plane_shell(4, 16), rough), false, kPressed / 10);
}

TEST(LegalContact, OverSlabsOfDifferentNAndPastHoles) {
  const auto mixed = testing::mixed_shell(*testing::torus_shell(16, 10, 8), 3, 3);
  ASSERT_TRUE(mixed);
  const SnapshotPtr torus = testing::displaced(mixed, rough);
  judge("torus of different n", *torus, true, kPressed / 10);
  const auto holes = testing::with_hole(torus, [](Vec3d p) { return std::sin(6 * p.x) * std::sin(5 * p.z) > 0.6; });
  judge("torus with holes", *holes, false, kPressed / 10);
}

/// A judge that finds nothing wrong proves nothing: each fault must be seen where it is.
TEST(ContactJudge, SeesWhatIsWrong) {
  const SnapshotPtr model = testing::displaced(testing::plane_shell(4, 8), [](Vec3d) { return 0.5; });
  const SnapshotPtr higher = testing::displaced(testing::plane_shell(4, 8), [](Vec3d) { return 0.6; });
  const TriangleSoup soup(*model), other(*higher);
  const Vec3d above = {0.4, 0.05, 0.4}, below = {0.4, -0.05, 0.4}, far = {0.9, 0.05, 0.9};
  Proxy proxy;
  {
    // The point knows nothing of a sheet that the judge knows.
    ContactJudge judge(other, false);
    static_cast<void>(proxy.step(*model, above));
    EXPECT_EQ(judge.judge(proxy, above), testing::Fault::None);
    const Vec3d between = {0.4, 0.01, 0.4};
    static_cast<void>(proxy.step(*model, between));
    EXPECT_EQ(judge.judge(proxy, between), testing::Fault::Tunnelled);
    static_cast<void>(proxy.step(*model, below));
    EXPECT_EQ(judge.judge(proxy, below), testing::Fault::CaughtInAir);
  }
  proxy.reset();
  {
    ContactJudge judge(soup, false);
    static_cast<void>(proxy.step(*model, above));
    static_cast<void>(judge.judge(proxy, above));
    static_cast<void>(proxy.step(*model, below));
    EXPECT_EQ(judge.judge(proxy, below), testing::Fault::None);
    // The judge is told of a shorter way than the cursor went.
    static_cast<void>(proxy.step(*model, {0.6, -0.05, 0.6}));
    EXPECT_EQ(judge.judge(proxy, below), testing::Fault::TooFast);
    const Proxy gone;
    EXPECT_EQ(judge.judge(gone, below), testing::Fault::LetGoInside);
  }
  EXPECT_TRUE(soup.connected(above - Vec3d{0, 0.05, 0}, far - Vec3d{0, 0.05, 0}, 1, 1e-9));
  EXPECT_FALSE(soup.connected(above - Vec3d{0, 0.05, 0}, far - Vec3d{0, 0.05, 0}, 0.3, 1e-9));
}

TEST(BallJudge, SeesWhatIsWrong) {
  const SnapshotPtr model = testing::displaced(testing::plane_shell(4, 8), [](Vec3d) { return 0.5; });
  const SnapshotPtr higher = testing::displaced(testing::plane_shell(4, 8), [](Vec3d) { return 0.6; });
  const TriangleSoup soup(*model), other(*higher);
  const double radius = 5e-3;
  const Vec3d above = {0.4, 0.05, 0.4}, between = {0.4, 0.01, 0.4}, below = {0.4, -0.05, 0.4};
  BallProxy ball;
  const auto step = [&](testing::BallJudge& judge, Vec3d cursor, Vec3d told) {
    const bool touches = ball.step(*model, cursor, radius);
    return judge.judge(ball, touches, told);
  };
  {
    // The ball knows nothing of a sheet that the judge knows.
    testing::BallJudge judge(other, radius);
    EXPECT_EQ(step(judge, above, above), testing::Fault::None);
    EXPECT_EQ(step(judge, between, between), testing::Fault::Tunnelled);
    EXPECT_EQ(step(judge, below, below), testing::Fault::CaughtInAir);
    ball.reset();
    EXPECT_EQ(step(judge, above, above), testing::Fault::ChangedSheet);
    const Vec3d in = {0.4, 0.022, 0.4};
    EXPECT_EQ(step(judge, in, in), testing::Fault::Overlaps);
  }
  {
    // And the judge knows the ways round: over the sheet's edge within what the ball may go, but not beyond it.
    const Vec3d up = {0.99, 0.01, 0.5}, down = {0.99, -0.01, 0.5};
    EXPECT_TRUE(soup.has_way(up, down, radius, [&](Vec3d p) { return length(p - up) < 0.05; }));
    EXPECT_FALSE(soup.has_way(up, down, radius, [&](Vec3d p) { return length(p - up) < 0.05 && p.x < 1; }));
    EXPECT_TRUE(soup.keeps_off(up, {0.2, 0.01, 0.5}, radius));
    EXPECT_FALSE(soup.keeps_off(up, down, radius));
  }
  ball.reset();
  {
    testing::BallJudge judge(soup, radius);
    EXPECT_EQ(step(judge, above, above), testing::Fault::None);
    EXPECT_EQ(step(judge, below, below), testing::Fault::None);
    // The judge is told of a shorter way than the cursor went.
    EXPECT_EQ(step(judge, {0.6, -0.05, 0.6}, below), testing::Fault::TooFast);
  }
}

/// The sweep against the judge's brute force, from far away and from near.
TEST(FirstEntry, MissesNothingOnACertifiedBowl) {
  const auto mesh = make_sample("bowl", 30'000);
  ASSERT_TRUE(mesh);
  const auto made = convert(*mesh, {.slabs = 200, .intervals = 16});
  ASSERT_TRUE(made) << made.error().message;
  const Snapshot& model = *made->model.head;
  const TriangleSoup soup(model);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (const double length : {1e-4, 1e-3, 1e-2, 0.1, 1.0}) {
    int hits = 0, wrong = 0;
    for (int k = 0; k < kPressed / 80; ++k) {
      const auto slab = static_cast<SlabId>((unit(random) + 1) / 2 * model.slab_mesh().slab_count());
      const SurfacePoint p = surface_point(model, slab, (unit(random) + 1) / 4, (unit(random) + 1) / 4);
      const Vec3d way = normalized(Vec3d{unit(random), unit(random), unit(random)}) * (length * soup.size());
      const Vec3d from = p.position - way * ((unit(random) + 1) / 2) +
                         Vec3d{unit(random), unit(random), unit(random)} * (0.1 * length * soup.size());
      const auto all = soup.crossings(from, from + way);
      const auto in = std::ranges::find_if(all, &TriangleSoup::Crossing::inwards);
      const auto swept = first_entry(model, from, from + way);
      const bool hit = in != all.end();
      hits += hit ? 1 : 0;
      wrong += hit != swept.has_value() || (hit && std::abs(in->t - swept->distance) * length > 1e-9) ? 1 : 0;
    }
    EXPECT_GT(hits, kPressed / 320) << length;
    EXPECT_EQ(wrong, 0) << length;
  }
}

}  // namespace
}  // namespace relief
