// What a hand feels on surfaces whose answer is known in closed form.
#include "support/driver.h"
#include "support/held_tools.h"

#include <relief/haptics/servo.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <random>
#include <utility>

namespace relief {
namespace {

using testing::displaced;
using testing::Driver;
using testing::fine_sphere;
using testing::flat_plane;
using testing::plane_shell;
using testing::settings_with;
using testing::sphere_shell;
using testing::strong_device;

TEST(Force, IsProportionalToDepthOnASphere) {
  const SnapshotPtr model = fine_sphere();
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(-1, 1);
  const double degree = std::numbers::pi / 180;
  for (int k = 0; k < 2000; ++k) {
    const Vec3d way = normalized(Vec3d{unit(random), unit(random), unit(random)} + Vec3d{1e-3, 0, 0});
    const double depth = 0.02 + 0.03 * (unit(random) + 1);
    Driver hand(settings_with(400), strong_device());
    EXPECT_FALSE(hand.at(*model, way * 1.01).contact);
    static_cast<void>(hand.at(*model, way * (1 - depth / 2), 0.02));  // a contact follows no faster than HandLimit
    const ServoSample felt = hand.at(*model, way * (1 - depth), 0.02);
    ASSERT_TRUE(felt.contact);
    EXPECT_EQ(felt.flags, 0U);
    EXPECT_NEAR(length(felt.force), 400 * depth * 0.1, 1e-3 * 400 * depth * 0.1);
    EXPECT_LT(std::acos(std::min(1.0, dot(normalized(felt.force), way))), 0.1 * degree);
    EXPECT_NEAR(length(felt.normal), 1, 1e-12);
    EXPECT_NEAR(felt.depth, depth, 1e-3 * depth);
    EXPECT_NEAR(length(felt.contact_point - felt.cursor), felt.depth, 1e-12);
    EXPECT_LT(length(closest_point(*model, felt.contact_point).position - felt.contact_point), 1e-12)
        << "on the surface";
  }
}

class Borders : public ::testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Mixed, Borders, ::testing::Bool());

TEST_P(Borders, ForceIsContinuousAcross) {
  // Slabs of n = 64, or of 16, 32 and 64 side by side.
  const SnapshotPtr model = GetParam() ? displaced(testing::mixed_shell(*sphere_shell(2, 1), 16, 2),
                                                   [](Vec3d p) { return (1 / length(p) - 0.8) / 0.4; })
                                       : fine_sphere();
  Driver hand(settings_with(400), strong_device());
  static_cast<void>(hand.at(*model, {0, 0.1, 1.05}));
  const double step = 1e-3;  // rad, and model units per tick: 0.1 m/s at the hand
  Vec3d last;
  std::vector<SlabId> slabs;
  for (int k = 0; k < 6284; ++k) {
    const double turn = k * step, r = k < 40 ? 1.04 - 0.0025 * k : 0.94;
    const Vec3d cursor = {r * std::sin(turn), 0.1 * r, r * std::cos(turn)};
    const ServoSample felt = hand.at(*model, cursor);
    if (k > 40) {
      ASSERT_TRUE(felt.contact) << k;
      // The force turns with the path, by |F| * step, and keeps its size: 2.2 N. Where n is 16 the contact point steps
      // over the edges of its micro-triangles by more than the cursor goes: at most 0.01 N.
      EXPECT_LT(length(felt.force - last), (GetParam() ? 4 : 1.5) * 2.4 * step)
          << "tick " << k << " slab " << felt.at.slab;
      if (slabs.empty() || slabs.back() != felt.at.slab) slabs.push_back(felt.at.slab);
    }
    last = felt.force;
  }
  EXPECT_GT(slabs.size(), 12U) << "the path has to cross borders to show anything";
}

TEST(Hole, LetsTheHandThroughAndTheRimHolds) {
  const auto hole = [](Vec3d p) { return p.x > 0.4 && p.x < 0.6 && p.z > 0.4 && p.z < 0.6; };
  for (const auto& shell : {plane_shell(4, 16), testing::mixed_shell(*plane_shell(4, 1), 4, 3)}) {
    const SnapshotPtr model = testing::with_hole(displaced(shell, [](Vec3d) { return 0.5; }), hole);
    for (const auto& [x, through] : {std::pair{0.5, true}, {0.2, false}, {0.85, false}}) {
      Driver hand(settings_with(400, 0, 0.3), strong_device());
      for (int k = 0; k < 400; ++k) {
        const double y = 0.05 - 0.0005 * k;  // through the floor of the slabs, at y = -0.1
        const ServoSample felt = hand.at(*model, {x, y, 0.5});
        if (through || y >= 0) {
          EXPECT_EQ(felt.force, Vec3d{}) << x << ' ' << y;
          EXPECT_FALSE(felt.contact);
        } else {
          EXPECT_TRUE(felt.contact);
          EXPECT_NEAR(felt.force.y, 400 * -y * 0.1, 1e-9);
        }
        EXPECT_EQ(felt.flags, 0U) << x << ' ' << y;
      }
    }
    // From the hole sideways below the surface: that is contact from below, so the safe state.
    Driver hand(settings_with(400), strong_device());
    for (int k = 0; k < 100; ++k) static_cast<void>(hand.at(*model, {0.5, 0.05 - 0.001 * k, 0.5}));
    for (int k = 0; k < 300; ++k) {
      const ServoSample felt = hand.at(*model, {0.5 + 0.001 * k, -0.05, 0.5});
      EXPECT_EQ(felt.force, Vec3d{}) << k;
    }
  }
}

TEST(Force, RowWithoutContactHasNoSlabAndNoForce) {
  const SnapshotPtr model = flat_plane();
  Driver hand(settings_with(400, 1, 0.5), strong_device());
  for (const Vec3d cursor : {Vec3d{0.5, 0.05, 0.5}, Vec3d{0.5, 3, 0.5}, Vec3d{7, 0.01, 0.5}}) {
    const ServoSample felt = hand.at(*model, cursor, 0.04);
    EXPECT_FALSE(felt.contact);
    EXPECT_EQ(felt.at.slab, kNoSlab);
    EXPECT_EQ(felt.depth, 0);
    EXPECT_EQ(felt.force, Vec3d{});
    EXPECT_EQ(felt.normal, Vec3d{});
    EXPECT_EQ(felt.contact_point, felt.cursor);
  }
}

TEST(Force, DampingActsAlongTheNormalAndNeverPullsIn) {
  const SnapshotPtr model = flat_plane();
  Driver hand(settings_with(400, 2), strong_device());
  double y = 0.02, deepest = 0;
  double most_over_spring = 0;
  bool eased = false;
  for (int k = 0; k < 400; ++k) {
    // Down at 0.03 m/s, along x at 0.05 m/s, then up at 1 m/s.
    const bool down = k < 200;
    y += down ? -3e-4 : 1e-2;
    const ServoSample felt = hand.at(*model, {0.2 + 5e-4 * std::min(k, 300), y, 0.5});
    if (!felt.contact) continue;
    EXPECT_EQ(felt.force.x, 0);
    EXPECT_EQ(felt.force.z, 0);
    EXPECT_GE(felt.force.y, 0);
    const double spring = 400 * felt.depth * 0.1;
    if (down) most_over_spring = std::max(most_over_spring, felt.force.y - spring);
    if (!down && felt.force.y < spring) eased = true;
    deepest = std::max(deepest, felt.depth);
  }
  EXPECT_NEAR(deepest, 0.04, 1e-3);
  EXPECT_NEAR(most_over_spring, 2 * 0.03, 1e-3) << "damping times the speed of the hand along the normal";
  EXPECT_TRUE(eased);
}

TEST(Force, VelocityEstimateIsRightForIrregularTicks) {
  const SnapshotPtr model = flat_plane();
  Driver hand(settings_with(400), strong_device());
  std::mt19937 random(3);
  std::uniform_real_distribution<double> gap(2e-4, 5e-3);
  double t = 0;
  Vec3d estimate;
  for (int k = 0; k < 200; ++k) {
    const double dt = gap(random);
    t += dt;
    estimate = hand.at(*model, {0.2 * t, 1.0 + 0.5 * t, 0}, dt).velocity;
  }
  EXPECT_NEAR(estimate.x, 0.02, 1e-9);
  EXPECT_NEAR(estimate.y, 0.05, 1e-9);

  DeviceState state;
  state.t = t + 1e-3;
  state.position = hand.servo().settings().workspace.to_device({0.2 * t, 1.0 + 0.5 * t, 0});
  state.velocity = {0.3, -0.2, 0.1};
  state.has_velocity = true;
  EXPECT_EQ(hand.servo().step(*model, state).velocity, state.velocity) << "the device's own velocity comes first";
}

TEST(Force, LimitsHoldAndAreFlagged) {
  const SnapshotPtr model = flat_plane();
  const DeviceInfo device = {.name = "weak", .max_force = 3.3, .max_stiffness = 1000, .max_force_rate = 500};
  ServoSettings settings = settings_with(5000);
  settings.force.max_force = 2;
  Driver hand(settings, device);
  static_cast<void>(hand.at(*model, {0.5, 0.01, 0.5}));
  double last = 0;
  std::uint32_t seen = 0;
  for (int k = 0; k < 20; ++k) {
    const ServoSample felt = hand.at(*model, {0.5, std::max(-0.05, 0.01 - 0.03 * k), 0.5});
    EXPECT_LE(length(felt.force), 2);
    EXPECT_LE(length(felt.force) - last, 0.5);
    last = length(felt.force);
    seen |= felt.flags;
  }
  EXPECT_NEAR(last, 2, 1e-9);
  EXPECT_EQ(seen, bit(ServoFault::ForceClamped) | bit(ServoFault::RateClamped) | bit(ServoFault::StiffnessClamped));
  // 1000 N/m and not the 5000 that were asked for.
  static_cast<void>(hand.at(*model, {0.5, -0.03, 0.5}));
  EXPECT_NEAR(length(hand.at(*model, {0.5, -0.01, 0.5}).force), 1, 1e-9);
  EXPECT_EQ(hand.at(*model, {0.5, 0.01, 0.5}).force, Vec3d{}) << "letting go is never delayed";
}

TEST(Force, LateTicksLowerTheStiffnessThatIsAllowed) {
  const SnapshotPtr model = flat_plane();
  const DeviceInfo device = {
      .name = "device", .max_force = 10, .max_stiffness = 1000, .max_damping = 5, .max_force_rate = 1e6};
  ServoSettings settings = settings_with(1000);
  settings.force.guard = true;
  Driver hand(settings, device);
  static_cast<void>(hand.at(*model, {0.5, 0.005, 0.5}));
  // 0.5 mm deep; the gentle first contact is over after the first ticks.
  double last = 0, step = 0;  // the force's, most in a tick
  const auto press = [&](int ticks, double dt) {
    ServoSample felt;
    for (int k = 0; k < ticks; ++k) {
      felt = hand.at(*model, {0.5, -0.005, 0.5}, dt);
      step = std::max(step, std::abs(felt.force.y - std::exchange(last, felt.force.y)));
    }
    return felt;
  };
  EXPECT_NEAR(press(1000, 1e-3).force.y, 0.5, 1e-9);
  step = 0;
  const ServoSample slow = press(400, 3e-3);
  EXPECT_NEAR(slow.force.y, 0.5 * 1.25 / 2.8, 1e-3);
  EXPECT_LT(step, 0.5 * 0.0051) << "without a leap";
  EXPECT_TRUE(slow.flags & bit(ServoFault::LateTicks));
  EXPECT_FALSE(slow.flags & bit(ServoFault::StiffnessClamped));
  EXPECT_NEAR(press(12'000, 1e-3).force.y, 0.5, 1e-9);
  // One late tick in a thousand is none, several are.
  step = 0;
  for (int k = 0; k < 5; ++k) {
    EXPECT_FALSE(press(1, 5e-3).flags & bit(ServoFault::LateTicks));
    EXPECT_FALSE(press(1999, 1e-3).flags & bit(ServoFault::LateTicks));
  }
  EXPECT_LT(step, 1e-9);
  for (int k = 0; k < 20; ++k) {
    static_cast<void>(press(1, 5e-3));
    static_cast<void>(press(99, 1e-3));
  }
  EXPECT_LT(press(1, 1e-3).force.y, 0.25);
  // A spring that is soft enough for such ticks stays as it is.
  settings.force.stiffness = 300;
  Driver soft(settings, device);
  static_cast<void>(soft.at(*model, {0.5, 0.005, 0.5}));
  ServoSample felt;
  for (int k = 0; k < 500; ++k) felt = soft.at(*model, {0.5, -0.005, 0.5}, 3e-3);
  EXPECT_NEAR(felt.force.y, 0.15, 1e-9);
  EXPECT_FALSE(felt.flags & bit(ServoFault::LateTicks));
}

TEST(Force, NormalsTurnNoFasterThanTheHandMovesOverDeepRelief) {
  // Waves as high as the hand is deep: what shading gives is soon more than it may.
  const SnapshotPtr model = displaced(sphere_shell(2, 64), [](Vec3d p) {
    const Vec3d d = normalized(p);
    return (1 / length(p) - 0.8) / 0.4 + 0.1 * std::sin(25 * d.x) * std::cos(22 * d.y) * std::sin(19 * d.z);
  });
  std::mt19937 random(8);
  std::uniform_real_distribution<double> unit(-1, 1);
  int checked = 0;
  for (int push = 0; push < 40; ++push) {
    Driver hand(settings_with(400), strong_device());
    Vec3d way = normalized(Vec3d{unit(random), unit(random), unit(random)} + Vec3d{1e-3, 0, 0}), drift;
    ServoSample last;
    Vec3d before;
    for (int k = 0; k < 600; ++k) {
      drift = drift * 0.99 + Vec3d{unit(random), unit(random), unit(random)} * 5e-5;
      way = normalized(way + drift);
      const Vec3d at = way * (1.1 - 0.2 * std::min(1.0, k / 200.0));
      const ServoSample felt = hand.at(*model, at);
      if (felt.contact && last.contact && felt.flags == 0) {
        const double turn = std::acos(std::clamp(dot(felt.normal, last.normal), -1.0, 1.0));
        ASSERT_LT(turn, 10 * length(at - before) / felt.depth + 0.0351) << push << " " << k;
        ++checked;
      }
      last = felt;
      before = at;
    }
  }
  EXPECT_GT(checked, 10'000);
}

TEST(Force, WhatTheSurfaceGivesIsNoLeak) {
  // Under a tool that is held still, 0.01 deep, the ground rises by 0.01 and falls by 0.02: 1 and 2 mm in the hand.
  const auto mesh = plane_shell(4, 8);
  const auto level = [&](double height) { return displaced(mesh, [=](Vec3d) { return 0.5 + height / 0.2; }); };
  const SnapshotPtr flat = level(0), raised = level(0.01), carved = level(-0.005);
  for (const testing::HeldTool& held : testing::held_tools(0.05))
    for (const bool exact : {false, true}) {
      ServoSettings settings = settings_with(1000);
      settings.force.guard = true;
      settings.force.exact_normals = exact;
      settings.tool = held.tool();
      Driver hand(settings, DeviceInfo{.max_force = 20, .max_stiffness = 3000, .continuous_force = 10});
      const auto at = [&](const Snapshot& model, double y) { return hand.at(model, {0.4, y + held.radius, 0.45}); };
      for (int k = 0; k <= 200; ++k) static_cast<void>(at(*flat, 0.01 - 1e-4 * k));
      for (int k = 0; k < 3000; ++k) static_cast<void>(at(*flat, -0.01));
      const double before = at(*flat, -0.01).leak;
      double rise = 0, most = 0;
      for (const SnapshotPtr& model : {raised, carved})
        for (int k = 0; k < 300; ++k) {
          const ServoSample felt = at(*model, -0.01);
          ASSERT_TRUE(felt.contact);
          ASSERT_EQ(felt.flags, 0U) << held.name;
          most = std::max(most, felt.leak);
          rise = std::max(rise, felt.force.y);
        }
      EXPECT_GT(rise, 1.8) << held.name << " feels it";
      EXPECT_LE(most, before + 1e-9) << held.name << (exact ? ", exact" : "");
    }
}

TEST(Force, NeverPullsInWhenTheSurfaceTurnsUnderTheTool) {
  // A bead of 4 mm radius: one tick takes the tool from its front to its back, faster than the force may turn.
  const SnapshotPtr model = fine_sphere();
  DeviceInfo device = strong_device();
  device.max_force_rate = 100;
  ServoSettings settings = settings_with(4000, 0, 0, 0.004);
  const auto through = [&] {
    Driver hand(settings, device);
    static_cast<void>(hand.at(*model, {0, 0, 1.01}));
    for (int k = 0; k < 50; ++k) static_cast<void>(hand.at(*model, {0, 0, 0.95}));
    EXPECT_GT(hand.at(*model, {0, 0, 0.95}).force.z, 0.5);
    return hand.at(*model, {0, 0, -0.95});
  };
  ServoSample felt = through();
  ASSERT_TRUE(felt.contact);
  EXPECT_GT(felt.contact_point.z, 0.9) << "held on the side it came from";
  EXPECT_GT(felt.force.z, 0.5);

  settings.force.paper_contact = true;
  felt = through();
  ASSERT_TRUE(felt.contact);
  EXPECT_NE(felt.flags & bit(ServoFault::RateClamped), 0U);
  EXPECT_GE(dot(felt.force, felt.normal), 0);
  EXPECT_LE(length(felt.force), 0.1) << "from nothing, at 0.1 N per tick";
}

TEST(Force, StiffnessLayerScales) {
  const SnapshotPtr plain = flat_plane();
  SnapshotDraft draft(plain);
  draft.add_layer(Layer::Stiffness, 4, 0.25F);
  const SnapshotPtr soft = draft.finish();
  for (const auto& [model, expected] : {std::pair{plain, 1.0}, std::pair{soft, 0.25}}) {
    Driver hand(settings_with(400), strong_device());
    static_cast<void>(hand.at(*model, {0.5, 0.001, 0.5}));
    EXPECT_NEAR(hand.at(*model, {0.5, -0.025, 0.5}).force.y, expected, 1e-6);
  }
}

/// Presses 0.02 deep at 400 N/m (0.8 N), then slides along x by `step` per tick; returns the last force.
Vec3d slide(Driver& hand, const Snapshot& model, double step, int ticks) {
  static_cast<void>(hand.at(model, {0.2, 0.01, 0.5}));
  ServoSample felt = hand.at(model, {0.2, -0.02, 0.5});
  for (int k = 1; k <= ticks; ++k) felt = hand.at(model, {0.2 + step * k, -0.02, 0.5});
  return felt.force;
}

TEST(Friction, SlidesAtTheCoefficientTimesTheNormalForce) {
  const SnapshotPtr model = flat_plane();
  for (const double mu : {0.1, 0.5, 1.5}) {
    Driver hand(settings_with(400, 0, mu), strong_device());
    const Vec3d force = slide(hand, *model, 1e-3, 200);
    EXPECT_NEAR(force.y, 0.8, 1e-6);
    EXPECT_NEAR(force.x, -mu * 0.8, 1e-6);
    EXPECT_NEAR(force.z, 0, 1e-12);
  }
  Driver hand(settings_with(400, 0, 0), strong_device());
  EXPECT_EQ(slide(hand, *model, 1e-3, 200).x, 0) << "0 switches friction off";
}

TEST(Friction, HoldsWithoutDriftOrChatter) {
  const SnapshotPtr model = flat_plane();
  Driver hand(settings_with(400, 0, 0.5), strong_device());
  static_cast<void>(slide(hand, *model, 5e-3, 10));
  // Back by half the stretch, then a trembling hold for a minute: the force has to be the same function of the place.
  static_cast<void>(hand.at(*model, {0.249, -0.02, 0.5}));
  const double held = hand.at(*model, {0.249, -0.02, 0.5}).force.x;
  for (int k = 0; k < 60'000; ++k) {
    const double shake = 1e-4 * std::sin(0.06 * k);
    const Vec3d force = hand.at(*model, {0.249 + shake, -0.02, 0.5}).force;
    ASSERT_NEAR(force.x, held - 40 * shake, 1e-9) << k;
  }
}

/// What friction gives at most, and what while it slides, as coefficients.
struct Coefficients {
  double still = 0, sliding = 0;
};
Coefficients rubbed(const Snapshot& model, double friction, double static_friction) {
  ServoSettings settings = settings_with(400, 0, friction);
  settings.force.static_friction = static_friction;
  Driver hand(settings, strong_device());
  static_cast<void>(hand.at(model, {0.2, 0.01, 0.5}));
  static_cast<void>(hand.at(model, {0.2, -0.02, 0.5}));
  Coefficients found;
  for (int k = 1; k <= 10'000; ++k) {
    found.sliding = -hand.at(model, {0.2 + 1e-5 * k, -0.02, 0.5}).force.x / 0.8;
    found.still = std::max(found.still, found.sliding);
  }
  return found;
}

TEST(Friction, BreakAwayAndSlidingHaveTheirOwnCoefficients) {
  const SnapshotPtr plain = flat_plane();
  const auto with_layers = [&](std::initializer_list<std::pair<Layer, float>> layers) {
    SnapshotDraft draft(plain);
    for (const auto& [layer, value] : layers) draft.add_layer(layer, 2, value);
    return draft.finish();
  };
  const SnapshotPtr still = with_layers({{Layer::StaticFriction, 0.75F}});
  const SnapshotPtr sliding = with_layers({{Layer::DynamicFriction, 0.25F}});
  const SnapshotPtr both = with_layers({{Layer::StaticFriction, 0.75F}, {Layer::DynamicFriction, 0.25F}});
  struct Case {
    const char* what;
    SnapshotPtr model;
    double friction, static_friction;
    Coefficients expected;
  };
  for (const Case& c : {Case{"layers", both, 0.1, 0, {0.75, 0.25}},
                        {"layers before settings", both, 0.1, 0.5, {0.75, 0.25}},
                        {"settings", plain, 0.25, 0.75, {0.75, 0.25}},
                        {"one setting for both", plain, 0.25, 0, {0.25, 0.25}},
                        {"never less than the other", plain, 0.5, 0.25, {0.5, 0.5}},
                        {"a layer and the other setting", still, 0.25, 0.5, {0.75, 0.25}},
                        {"the other layer", sliding, 0.5, 0.75, {0.75, 0.25}},
                        {"off", plain, 0, 0.75, {0, 0}},
                        {"at most 4", plain, 0.25, 1e300, {4, 0.25}}}) {
    const Coefficients found = rubbed(*c.model, c.friction, c.static_friction);
    // In a tick the pull grows by 0.005 of the pressure.
    EXPECT_NEAR(found.still, c.expected.still, 0.006) << c.what;
    EXPECT_NEAR(found.sliding, c.expected.sliding, 1e-6) << c.what;
  }
}

TEST(Servo, SurvivesTheExchangeOfTheModelForOneWithFewerSlabs) {
  const SnapshotPtr large = displaced(sphere_shell(3, 4), [](Vec3d) { return 0.5; });
  const SnapshotPtr small = displaced(sphere_shell(0, 4), [](Vec3d) { return 0.5; });
  Driver hand(settings_with(400), strong_device());
  for (int k = 0; k < 200; ++k) {
    const Vec3d way = normalized(Vec3d{std::sin(0.1 * k), std::cos(0.17 * k), std::cos(0.1 * k)});
    EXPECT_TRUE(is_finite(hand.at(k % 2 == 0 ? *large : *small, way, 0.04).force));
  }
}

/// A button that is down, drops out for one tick and is down again.
TEST(Servo, ButtonsAreDebouncedAsTheLatestSettingsSay) {
  const SnapshotPtr model = flat_plane();
  ServoSettings settings = settings_with(400);
  settings.readings.debounce = 0;
  Servo servo(settings, strong_device());
  int tick = 0;
  const auto in_the_gap = [&] {
    std::uint32_t held = 0;
    for (const std::uint32_t buttons : {1U, 0U, 1U}) {
      const DeviceState state = {.t = ++tick * 1e-3, .position = {0, 0.01, 0}, .velocity = {}, .buttons = buttons};
      const ServoSample sample = servo.step(*model, state);
      if (buttons == 0) held = sample.buttons;
    }
    return held;
  };
  EXPECT_EQ(in_the_gap(), 0U);
  settings.readings.debounce = 5e-3;
  servo.set(settings);
  EXPECT_EQ(in_the_gap(), 1U);
  settings.readings.debounce = 0;
  servo.set(settings);
  EXPECT_EQ(in_the_gap(), 0U);
}

}  // namespace
}  // namespace relief
