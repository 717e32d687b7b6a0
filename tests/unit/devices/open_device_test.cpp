#include <relief/devices/open_device.h>

#include <gtest/gtest.h>

#include <cmath>

namespace relief {
namespace {

HandTarget still(double /*t*/) { return {}; }

TEST(OpenDevice, OpensEveryListedName) {
  ASSERT_GE(list_devices().size(), 5U);
  for (const DeviceListing& listing : list_devices()) {
    auto device = open_device(listing.name, still);
    ASSERT_TRUE(device) << listing.name;
    EXPECT_FALSE(listing.description.empty());
    DeviceState state;
    EXPECT_TRUE((*device)->read(state));
    EXPECT_TRUE((*device)->write({}));
  }
  EXPECT_EQ((*open_device("sim:hand", still))->info().max_force, 3.3);
  EXPECT_EQ((*open_device("sim:hand:premium-like", still))->info().max_force, 8.5);
}

TEST(OpenDevice, AnUnknownNameGetsTheKnownOnes) {
  for (const char* name : {"", "sim", "sim:hand:", "sim:hand:omega", "mouse\n"}) {
    const auto device = open_device(name, still);
    ASSERT_FALSE(device) << name;
    EXPECT_EQ(device.error().code, Errc::NotFound);
    EXPECT_NE(device.error().message.find("sim:hand:falcon-like"), std::string::npos);
    EXPECT_EQ(device.error().message.find('\n'), std::string::npos);
    EXPECT_LT(device.error().message.size(), 500U);
  }
}

TEST(ReplayDevice, PlaysEachReadingOnceAndIsThenLost) {
  std::vector<DeviceState> path(3);
  for (std::size_t k = 0; k < path.size(); ++k) {
    path[k].t = 0.5 * static_cast<double>(k);
    path[k].position = {static_cast<double>(k), 2, 3};
  }
  ReplayDevice device(DeviceInfo{}, path);
  DeviceState state;
  for (const DeviceState& expected : path) {
    ASSERT_TRUE(device.read(state));
    EXPECT_EQ(state.t, expected.t);
    EXPECT_EQ(state.position, expected.position);
    EXPECT_TRUE(device.write({.force = {1, 2, 3}, .torque = {}}));
  }
  EXPECT_FALSE(device.read(state));
  EXPECT_FALSE(device.read(state));
}

TEST(ExploringHand, StartsOutsidePressesInAndMovesSmoothly) {
  Box3d reach;
  reach.add(Vec3d{-0.04, -0.03, -0.02});
  reach.add(Vec3d{0.06, 0.03, 0.04});
  const HandScript script = exploring_hand(reach);
  const auto share = [&](Vec3d p) {  // 1 on the ellipsoid that touches the box's faces
    const Vec3d q = p - reach.centre(), h = reach.extent() * 0.5;
    return length(Vec3d{q.x / h.x, q.y / h.y, q.z / h.z});
  };
  EXPECT_GT(share(script(0).position), 1.1);
  Vec3d last = script(0).position;
  int presses = 0;
  bool in = false;
  Box3d seen;
  for (int k = 1; k <= 30'000; ++k) {
    const HandTarget now = script(1e-3 * k);
    ASSERT_LT(length(now.position - last), 0.6e-3) << "under 0.6 m/s, t = " << 1e-3 * k;
    ASSERT_LT(share(now.position), 1.21);
    if (const bool pressed = share(now.position) < 0.75; pressed != in) {
      in = pressed;
      presses += in ? 1 : 0;
    }
    if (in) seen.add(now.position);
    last = now.position;
  }
  EXPECT_EQ(presses, 15);
  EXPECT_GT(diagonal(seen), 0.5 * diagonal(reach)) << "all sides";
  EXPECT_TRUE(is_finite(exploring_hand(Box3d{})(0.7).position));
}

}  // namespace
}  // namespace relief
