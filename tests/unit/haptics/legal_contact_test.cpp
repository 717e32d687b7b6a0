// Contact judged tick by tick from the model's triangles: no tunnelling, no change of side without a way, no letting go
// inside; over slides, taps, deep presses and jumps, at rims, ears, fingers and through thin walls.
#include "support/contact_judge.h"
#include "support/data.h"
#include "support/shells.h"

#include <relief/convert/convert.h>
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
using testing::TriangleSoup;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr long kPressed = 5'000;
#else
constexpr long kPressed = 160'000;
#endif
constexpr int kTicks = 2000;  // per run

/// How many pressed ticks a model is judged by; in the long form 10^8 over all of them.
long wanted_ticks() { return std::getenv("RELIEF_SOAK") != nullptr ? 15'000'000 : kPressed; }

enum class Motion { Slide, Tap, Press, DeepPress, Jump };
constexpr std::array<const char*, 5> kNames = {"slide", "tap", "press to 4 %", "press to 10 %", "jump"};

/// A hand over one place of the surface. Depths and widths are shares of the diagonal.
class Hand {
 public:
  Hand(Motion motion, const SurfacePoint& place, const Box3d& bounds, std::mt19937& random)
      : motion_(motion), place_(place), bounds_(bounds), random_(random), size_(diagonal(bounds)) {
    side_ = normalized(cross(place.normal, std::abs(place.normal.x) < 0.7 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0}));
    other_ = cross(place.normal, side_);
    phase_ = 6.28 * unit();
    const bool pressing = motion == Motion::Press || motion == Motion::DeepPress;
    wander_ = (pressing ? 0.005 : 0.05) * unit();
    leap_ = 0.3 * std::pow(10, -2 * unit());
    at_ = place.position + place.normal * (0.01 * size_);
  }

  Vec3d next() {
    const int k = tick_++;
    if (motion_ == Motion::Jump) {
      if (k % 300 == 299) at_ = bounds_.centre() + anywhere() * (0.7 * size_);
      at_ += anywhere() * ((k % 7 == 6 ? leap_ : 0.002) * size_);
      return at_;
    }
    const double t = k * 1e-3, in = k < 100 ? -0.01 + 1.2e-4 * k : 0.002;
    double depth = in;
    if (motion_ == Motion::Tap) depth = 0.002 - 0.01 * std::sin(12 * t + 1) - (k < 50 ? 0.02 : 0);
    if (motion_ == Motion::Slide && k >= 100) depth = 0.005;
    if (motion_ == Motion::Press && k >= 100) depth = 0.021 - 0.019 * std::cos(4.1 * (t - 0.1));
    if (motion_ == Motion::DeepPress && k >= 100) depth = 0.051 - 0.049 * std::cos(4.1 * (t - 0.1));
    const double fade = std::min(1.0, k / 300.0);
    const Vec3d aside = side_ * (std::sin(3 * t + phase_) - std::sin(phase_)) +
                        other_ * (std::cos(2 * t + 2 * phase_) - std::cos(2 * phase_));
    return place_.position - place_.normal * (depth * size_) + aside * (wander_ * fade * size_);
  }

 private:
  double unit() { return std::uniform_real_distribution<double>(0, 1)(random_); }
  Vec3d anywhere() { return {2 * unit() - 1, 2 * unit() - 1, 2 * unit() - 1}; }

  Motion motion_;
  SurfacePoint place_;
  Box3d bounds_;
  std::mt19937& random_;
  double size_, phase_ = 0, wander_ = 0, leap_ = 0;
  Vec3d side_, other_, at_;
  int tick_ = 0;
};

/// Judges runs of all motions until so many ticks were pressed; every other run is over a thin part where there are
/// any.
void judge(const std::string& title, const Snapshot& model, bool closed, long wanted) {
  const TriangleSoup soup(model);
  const SlabMesh& mesh = model.slab_mesh();
  std::mt19937 random(8);
  std::uniform_real_distribution<double> unit(0, 1);
  std::array<long, 7> faults{};
  long pressed = 0, ticks = 0, thin = 0;
  for (int run = 0; pressed < wanted; ++run) {
    SurfacePoint place;
    for (int attempt = 0; attempt < 40; ++attempt) {
      double u = unit(random), v = unit(random);
      if (u + v > 1) {
        u = 1 - u;
        v = 1 - v;
      }
      place = surface_point(model, static_cast<SlabId>(unit(random) * mesh.slab_count()), u, v);
      const Vec3d out = place.normal * soup.size();
      if (!soup.crossings(place.position + out * 1e-4, place.position + out * 0.02).empty()) continue;
      const bool is_thin = !soup.crossings(place.position - out * 1e-4, place.position - out * 0.03).empty();
      thin += is_thin ? 1 : 0;
      if (run / 5 % 2 == 0 || is_thin) break;
    }
    const auto motion = static_cast<Motion>(run % 5);
    Hand hand(motion, place, soup.bounds(), random);
    Proxy proxy;
    ContactJudge ruling(soup, closed);
    for (int k = 0; k < kTicks; ++k) {
      const Vec3d cursor = hand.next();
      static_cast<void>(proxy.step(model, cursor, {}));
      const testing::Fault fault = ruling.judge(proxy, cursor);
      ++ticks;
      pressed += proxy.held() ? 1 : 0;
      if (fault == testing::Fault::None) continue;
      if (++faults[static_cast<std::size_t>(fault)] == 1)
        ADD_FAILURE() << title << ", " << kNames[static_cast<std::size_t>(motion)] << ", run " << run << ", tick " << k
                      << ": " << testing::name(fault);
    }
  }
  long bad = 0;
  for (std::size_t k = 1; k < faults.size(); ++k) {
    bad += faults[k];
    if (faults[k] > 0) std::printf("  %s: %ld\n", std::string(name(static_cast<testing::Fault>(k))).c_str(), faults[k]);
  }
  std::printf("%s: %ld pressed of %ld ticks, %ld thin places: %ld bad\n", title.c_str(), pressed, ticks, thin, bad);
  EXPECT_EQ(bad, 0);
}

bool is_closed(const SlabMesh& mesh) {
  return std::ranges::none_of(mesh.slabs(),
                              [](const Slab& s) { return std::ranges::count(s.neighbours, kNoSlab) > 0; });
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

class LegalContactOnScans : public ::testing::TestWithParam<const char*> {};

TEST_P(LegalContactOnScans, InPreviewMode) {
  RELIEF_DATA_FILE(file, std::string("a_models/") + GetParam() + ".ply");
  const auto mesh = import_mesh(file);
  ASSERT_TRUE(mesh) << mesh.error().message;
  const auto made = convert(*mesh, {.slabs = 200, .intervals = 32, .mode = Mode::Preview});
  ASSERT_TRUE(made) << made.error().message;
  // The sheets of a preview may pass through each other, so inside and outside are not asked for.
  judge(GetParam(), *made->model.head, false, wanted_ticks());
}
INSTANTIATE_TEST_SUITE_P(Scans, LegalContactOnScans,
                         ::testing::Values("bunny", "visible_human_skin", "scallop_scan", "elephant_refined"),
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
    static_cast<void>(proxy.step(*model, above, {}));
    EXPECT_EQ(judge.judge(proxy, above), testing::Fault::None);
    const Vec3d between = {0.4, 0.01, 0.4};
    static_cast<void>(proxy.step(*model, between, {}));
    EXPECT_EQ(judge.judge(proxy, between), testing::Fault::Tunnelled);
    static_cast<void>(proxy.step(*model, below, {}));
    EXPECT_EQ(judge.judge(proxy, below), testing::Fault::CaughtInAir);
  }
  proxy.reset();
  {
    ContactJudge judge(soup, false);
    static_cast<void>(proxy.step(*model, above, {}));
    static_cast<void>(judge.judge(proxy, above));
    static_cast<void>(proxy.step(*model, below, {}));
    EXPECT_EQ(judge.judge(proxy, below), testing::Fault::None);
    // The judge is told of a shorter way than the cursor went.
    static_cast<void>(proxy.step(*model, {0.6, -0.05, 0.6}, {}));
    EXPECT_EQ(judge.judge(proxy, below), testing::Fault::TooFast);
    Proxy gone;
    EXPECT_EQ(judge.judge(gone, below), testing::Fault::LetGoInside);
  }
  EXPECT_TRUE(soup.connected(above - Vec3d{0, 0.05, 0}, far - Vec3d{0, 0.05, 0}, 1, 1e-9));
  EXPECT_FALSE(soup.connected(above - Vec3d{0, 0.05, 0}, far - Vec3d{0, 0.05, 0}, 0.3, 1e-9));
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
