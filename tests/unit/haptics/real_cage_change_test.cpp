// A contact goes on across the cages that room and new slabs make: no flag, no allocation, and no more of a step of
// force than the surface moves.
#include "support/driver.h"
#include "support/fibre_maps.h"
#include "support/forbidden_calls.h"
#include "support/held_tools.h"
#include "support/shells.h"

#include <relief/convert/convert.h>
#include <relief/convert/refine.h>
#include <relief/convert/room.h>
#include <relief/mesh/samples.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

namespace relief {
namespace {

using testing::Driver;
using testing::HeldTool;
using testing::WatchedCalls;

constexpr double kStiffness = 400;  // N/m
constexpr int kTicks = 1200, kChange = 400;

class RealCageChange : public ::testing::Test {
 protected:
  void SetUp() override {
    ConvertSettings settings;
    settings.slabs = 100;
    settings.intervals = 16;
    auto made = convert(*make_sample("head", 6'000), settings);
    ASSERT_TRUE(made) << made.error().message;
    work_on(made->model);
  }
  void work_on(Model model) {
    model_ = std::move(model);
    diagonal_ = model_.info.source_diagonal;
    const Box3d box = bounds_of_surface(*model_.head);
    middle_ = (box.low + box.high) / 2;
  }
  /// On a turn about the head's middle, from in front: this much below the surface of the model as it was.
  [[nodiscard]] Vec3d at(int tick, double deep) const {
    const double turn = 0.3 * std::sin(2e-3 * tick);
    const Vec3d out = normalized(Vec3d{std::sin(turn), 0.2, std::cos(turn)});
    return raycast(*model_.head, {middle_ + out * diagonal_, -out})->point.position - out * deep;
  }
  /// For a ball that goes so deep, in diagonals.
  [[nodiscard]] SnapshotPtr with_room_there(double deep) const {
    const Vec3d on = at(0, 0), out = closest_point(*model_.head, on).normal;
    const double radius = 0.06 * diagonal_;
    const Vec3d centre = on - out * (deep * diagonal_ - radius);
    const auto made =
        make_room(*model_.head, {.cut = {{centre, centre, radius, out}}, .fill = {}}, {.diagonal = diagonal_});
    EXPECT_TRUE(made) << made.error().message;
    EXPECT_FALSE(made->moved.empty());
    moved_ = made->surface_moved;
    lacking_ = made->after.size();
    return *with_room(model_.head, *made);
  }

  struct Felt {
    double largest_step = 0;  ///< N, from tick to tick, once it presses
    int touched = 0, flagged = 0, forbidden = 0;
    std::uint32_t flags = 0;
  };
  /// The second model from tick kChange on, and then both in turns.
  [[nodiscard]] Felt led(const HeldTool& held, const SnapshotPtr& second) const {
    ServoSettings settings = testing::settings_with(kStiffness, 1, 0.4, 0.1 / diagonal_);
    settings.tool = held.tool();
    Driver hand(settings, testing::strong_device());
    Felt felt;
    ServoSample last;
    for (int k = 0; k < kTicks; ++k) {
      const double pressed = diagonal_ * std::min(0.005, 1.5e-4 * k - 0.03) - held.radius;
      const Vec3d place = at(k, pressed);
      const bool is_second = k >= kChange && (k < 2 * kChange || k / 50 % 2 == 0);
      const SnapshotPtr& now = is_second ? second : model_.head;
      const WatchedCalls watched;
      const ServoSample sample = hand.at(*now, place);
      felt.forbidden += watched.calls().total();
      felt.flagged += sample.flags != 0 ? 1 : 0;
      felt.flags |= sample.flags;
      felt.touched += sample.contact ? 1 : 0;
      if (k > 0) felt.largest_step = std::max(felt.largest_step, length(sample.force - last.force));
      last = sample;
    }
    return felt;
  }
  /// A step may be larger by what the surface moves, at the tool's stiffness.
  void expect_it_goes_on(const SnapshotPtr& second, double moved) const {
    for (const HeldTool& held : testing::held_tools(0.004 * diagonal_)) {
      SCOPED_TRACE(held.name);
      const Felt still = led(held, model_.head), changed = led(held, second);
      EXPECT_EQ(still.flags, 0U);
      EXPECT_EQ(changed.flagged, 0);
      EXPECT_EQ(changed.forbidden, 0);
      EXPECT_GT(changed.touched, kTicks / 2);
      EXPECT_LE(std::abs(changed.touched - still.touched), 2);
      const double newtons = kStiffness * moved * (0.1 / diagonal_);
      std::printf("%s: largest step %.4f N, without the change %.4f N; the surface moved %.1e of D, %.4f N\n",
                  held.name.c_str(), changed.largest_step, still.largest_step, moved / diagonal_, newtons);
      EXPECT_LE(changed.largest_step, still.largest_step + newtons + 1e-3);
    }
  }

  Model model_;
  double diagonal_ = 0;
  Vec3d middle_;
  mutable double moved_ = 0;
  mutable std::size_t lacking_ = 0;
};

TEST_F(RealCageChange, OfRoomThatWasMadeUnderTheTool) {
  const SnapshotPtr roomy = with_room_there(0.12);
  ASSERT_NE(roomy->slab_mesh().roots_number(), model_.head->slab_mesh().roots_number());
  expect_it_goes_on(roomy, moved_);
}

// Around the tool fibres lean by over 60 degrees. They had to be short before they could turn.
TEST_F(RealCageChange, OfRoomUnderFibresThatWereShortMeanwhile) {
  const auto ball = testing::mapped_shell(*testing::sphere_shell(2, 16, 0.9, 1.1), [](Vec3d p) {
    const Vec3d q = testing::leaning(2)({p.x, p.z, p.y});
    constexpr double kStep = 1.0 / (1 << 20);
    return Vec3d{std::round(q.x / kStep) * kStep, std::round(q.z / kStep) * kStep, std::round(q.y / kStep) * kStep};
  });
  Model model;
  model.info.source_diagonal = 2 * std::sqrt(3.0);
  model.head = testing::displaced(ball, [](Vec3d) { return 0.5; });
  work_on(std::move(model));
  const SnapshotPtr roomy = with_room_there(0.055);
  EXPECT_EQ(lacking_, 0U);
  expect_it_goes_on(roomy, moved_);
}

TEST_F(RealCageChange, OfNewSlabsForTheWholeModel) {
  const auto refined = refine(model_, RefineWhere::Model);
  ASSERT_TRUE(refined) << refined.error().message;
  expect_it_goes_on(refined->model.head, refined->moved_max);
}

}  // namespace
}  // namespace relief
