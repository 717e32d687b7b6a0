// What a servo tick may never do: allocate, free, lock, call the system.
#include "support/forbidden_calls.h"
#include "support/shells.h"
#include "support/watched_servo.h"

#include <relief/base/cpu_time.h>
#include <relief/core/snapshot_channel.h>
#include <relief/devices/pointer_device.h>
#include <relief/devices/simulated_hand.h>
#include <relief/haptics/servo.h>

#include <gtest/gtest.h>
#include <linux/futex.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <functional>
#include <limits>
#include <memory>
#include <mutex>
#include <shared_mutex>
#include <thread>
#include <utility>
#include <vector>

namespace relief {
namespace {

using testing::ForbiddenCalls;
using testing::WatchedCalls;

/// What no optimiser may leave out.
template <typename T>
void keep(T* memory) {
  asm volatile("" : : "r"(memory) : "memory");
}

/// A forbidden call, and what it must be counted as.
struct Breach {
  const char* name;
  std::function<void()> make;
  ForbiddenCalls seen;
};

std::vector<Breach> breaches() {
  static std::mutex mutex;
  static std::shared_mutex shared;
  static void* memory = nullptr;  // of one breach for the next
  const auto kept = [](void* now) { keep(memory = now); };
  static int word = 0;
  void* const page = mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  std::vector<Breach> all = {{"new", [=] { kept(new int(3)); }, {.news = 1, .mallocs = 1}},
                             {"delete", [] { delete static_cast<int*>(memory); }, {.deletes = 1, .frees = 1}}};
  if (!testing::kCountsEverything) {
    for (Breach& breach : all) breach.seen.mallocs = breach.seen.frees = 0;
    return all;
  }
  const std::vector<Breach> more = {
      {"malloc", [=] { kept(std::malloc(100)); }, {.mallocs = 1}},
      {"realloc", [=] { kept(std::realloc(memory, 1000)); }, {.mallocs = 1, .frees = 1}},
      {"free", [] { std::free(memory); }, {.frees = 1}},
      {"calloc and free",
       [=] {
         kept(std::calloc(10, 10));
         std::free(memory);
       },
       {.mallocs = 1, .frees = 1}},
      {"aligned_alloc and free",
       [=] {
         kept(std::aligned_alloc(64, 640));
         std::free(memory);
       },
       {.mallocs = 1, .frees = 1}},
      {"posix_memalign and free",
       [] {
         EXPECT_EQ(posix_memalign(&memory, 64, 640), 0);
         std::free(memory);
       },
       {.mallocs = 1, .frees = 1}},
      {"a lock", [] { const std::scoped_lock lock(mutex); }, {.locks = 1}},
      {"a lock that is tried",
       [] {
         if (mutex.try_lock()) mutex.unlock();
       },
       {.locks = 1}},
      {"a lock for reading", [] { const std::shared_lock lock(shared); }, {.locks = 1}},
      {"a lock for writing", [] { const std::scoped_lock lock(shared); }, {.locks = 1}},
  };
  all.insert(all.end(), more.begin(), more.end());
  const std::vector<Breach> of_system = {
      {"futex", [] { syscall(SYS_futex, &word, FUTEX_WAKE_PRIVATE, 1, nullptr, nullptr, 0); }, {.system_calls = 1}},
      {"write", [] { EXPECT_EQ(write(STDERR_FILENO, "", 0), 0); }, {.system_calls = 1}},
      {"madvise", [=] { EXPECT_EQ(madvise(page, 4096, MADV_NORMAL), 0); }, {.system_calls = 1}},
      {"munmap", [=] { EXPECT_EQ(munmap(page, 4096), 0); }, {.system_calls = 1}},
      {"getrusage",
       [] {
         rusage usage{};
         EXPECT_EQ(getrusage(RUSAGE_THREAD, &usage), 0);
       },
       {.system_calls = 1}},
      {"a change of the signal mask",
       [] { EXPECT_EQ(pthread_sigmask(SIG_BLOCK, nullptr, nullptr), 0); },
       {.system_calls = 1}},
      {"another system call", [] { EXPECT_EQ(syscall(SYS_getppid), getppid()); }, {.system_calls = 2}},
      {"a sleep", [] { std::this_thread::sleep_for(std::chrono::microseconds(1)); }, {.sleeps = 1}},
      {"the clock",
       [] {
         static_cast<void>(thread_cpu_ns());
         static_cast<void>(std::chrono::steady_clock::now());
       },
       {}},
  };
  all.insert(all.end(), of_system.begin(), of_system.end());
  return all;
}

void expect_same(const ForbiddenCalls& calls, const ForbiddenCalls& expected, const char* what) {
  EXPECT_EQ(calls.news, expected.news) << what;
  EXPECT_EQ(calls.deletes, expected.deletes) << what;
  EXPECT_EQ(calls.mallocs, expected.mallocs) << what;
  EXPECT_EQ(calls.frees, expected.frees) << what;
  EXPECT_EQ(calls.locks, expected.locks) << what;
  EXPECT_EQ(calls.system_calls, expected.system_calls) << what;
  EXPECT_EQ(calls.sleeps, expected.sleeps) << what;
}

TEST(ForbiddenCalls, OfEachKindAreCountedAndStillDone) {
  const std::vector<Breach> all = breaches();
  std::vector<ForbiddenCalls> seen;
  bool with_system = false;
  // In a thread of its own: the watch is for good.
  std::thread([&] {
    seen.reserve(all.size());
    with_system = testing::watch_system_calls();
    for (const Breach& breach : all) {
      const WatchedCalls watch;
      breach.make();
      seen.push_back(watch.calls());
    }
  }).join();
  for (std::size_t k = 0; k < all.size(); ++k) {
    ForbiddenCalls expected = all[k].seen;
    if (!with_system) expected.system_calls = expected.sleeps = 0;
    expect_same(seen[k], expected, all[k].name);
  }
#if defined(__x86_64__)
  EXPECT_EQ(with_system, testing::kCountsEverything);
#endif
}

/// Whatever the tool; how many ticks touched.
int ticks_without_calls(const TouchTool& tool) {
  const auto sphere = [](double radius) {
    return testing::displaced(testing::sphere_shell(2, 16), [=](Vec3d p) { return (radius / length(p) - 0.8) / 0.4; });
  };
  SnapshotChannel channel(sphere(1));
  auto reader = channel.reader();
  PlantPreset preset = plant_presets().front();
  preset.plant.resonance = 80;
  SimulatedHand hand(preset, {.tremor = 1e-3},
                     [](double t) { return HandTarget{{0.05 * std::sin(3 * t), 0.02, 0.09 * std::cos(3 * t)}, 0}; });
  Servo servo({.workspace = {.metres_per_unit = 0.1}, .force = {.friction = 0.4}, .tool = tool}, hand.info());
  int touched = 0, faults = 0;
  for (int k = 0; k < 20'000; ++k) {
    if (k == 10'000) channel.publish(sphere(0.99));
    const WatchedCalls watch;
    DeviceState state;
    const bool alive = hand.read(state);
    if (k % 1500 == 7) state.position.x = std::numeric_limits<double>::quiet_NaN();
    const ServoSample felt = servo.step(reader.latest(), state);
    const bool written = hand.write({felt.force, felt.torque});
    const ForbiddenCalls calls = watch.calls();
    EXPECT_TRUE(alive && written);
    EXPECT_EQ(calls.total(), 0) << "tick " << k;
    if (::testing::Test::HasFailure()) return 0;
    touched += felt.contact ? 1 : 0;
    faults += felt.flags != 0 ? 1 : 0;
  }
  EXPECT_GT(faults, 10);
  return touched;
}

TEST(ServoTick, NeitherAllocatesNorFreesNorLocks) { EXPECT_GT(ticks_without_calls({}), 2000); }

TEST(ServoTick, NeitherDoesItWithABall) { EXPECT_GT(ticks_without_calls({.radius = 0.03}), 1000); }

TEST(ServoTick, NeitherDoesItWithARigidTool) {
  std::vector<Vec3d> points;
  for (int k = 0; k < 200; ++k) points.push_back(Vec3d{std::cos(2.4 * k), 0.01 * k - 1, std::sin(2.4 * k)} * 0.05);
  EXPECT_GT(ticks_without_calls({.points = points}), 1000);
}

TEST(PointerTick, NeitherAllocatesNorFreesNorLocks) {
  PointerPlace place = {
      .over = true, .surface = {}, .normal = {0, 0, 1}, .towards_eye = {0, 0, 1}, .rise = 0.03, .depth = 1e-3};
  PointerDevice device(place);
  int calls = 0;
  double farthest = 0;
  for (int k = 0; k < 5000; ++k) {
    place.surface = {0.03 * std::sin(0.01 * k), 0, k % 1000 < 500 ? 0.0 : -0.05};  // also over silhouettes
    const WatchedCalls watch;
    if (k % 8 == 0) device.point(place);
    DeviceState state;
    const bool alive = device.read(state) && device.write({});
    calls += watch.calls().total();
    ASSERT_TRUE(alive);
    farthest = std::max(farthest, std::abs(state.position.x));
  }
  EXPECT_EQ(calls, 0);
  EXPECT_GT(farthest, 0.02);
}

// ---- The loop around it, with a real clock

testing::WatchedRun watch_thread(bool pull, const std::function<void()>& breach = {}) {
  std::vector<SnapshotPtr> models;
  const auto cage = testing::sphere_shell(2, 16);
  for (const double radius : {1.0, 0.995})
    models.push_back(testing::displaced(cage, [=](Vec3d p) { return (radius / length(p) - 0.8) / 0.4; }));
  SimulatedHand hand(plant_presets().front(), {.tremor = 1e-3},
                     [](double t) { return HandTarget{{0.05 * std::sin(3 * t), 0.02, 0.09 * std::cos(3 * t)}, 0}; });
  hand.set_state({0, 0.02, 0.1}, {});
  return testing::watched_run(pull, models, {.workspace = {.metres_per_unit = 0.1}, .force = {.friction = 0.4}},
                              std::move(hand), 400, breach);
}

class ServoThreadCalls : public ::testing::TestWithParam<bool> {};

TEST_P(ServoThreadCalls, NothingButTheClockInAnyTick) {
  const testing::WatchedRun run = watch_thread(GetParam());
  ForbiddenCalls none;
  if (run.saw_system_calls && GetParam()) none.sleeps = 400;  // one before each tick; a push device sleeps itself
  expect_same(run.calls, none, "all that was called");
  EXPECT_GT(run.touched, 50);
  EXPECT_GT(run.models, 3);
  EXPECT_GT(run.settings, 3);
  EXPECT_GT(run.dropped, 0) << "the telemetry was full at times";
  EXPECT_GT(GetParam() ? run.stalled : run.lost, 0) << "and the standstill was seen";
}

TEST_P(ServoThreadCalls, EachForbiddenOneIsCounted) {
  // In one tick: all kinds at once.
  const std::vector<Breach> all = breaches();
  ForbiddenCalls expected;
  for (const Breach& breach : all) {
    expected.news += breach.seen.news;
    expected.deletes += breach.seen.deletes;
    expected.mallocs += breach.seen.mallocs;
    expected.frees += breach.seen.frees;
    expected.locks += breach.seen.locks;
    expected.system_calls += breach.seen.system_calls;
    expected.sleeps += breach.seen.sleeps;
  }
  const testing::WatchedRun run = watch_thread(GetParam(), [&] {
    for (const Breach& breach : all) breach.make();
  });
  if (GetParam()) expected.sleeps += 400;
  if (!run.saw_system_calls) expected.system_calls = expected.sleeps = 0;
  expect_same(run.calls, expected, "one of each");
}

INSTANTIATE_TEST_SUITE_P(Device, ServoThreadCalls, ::testing::Bool(),
                         [](const auto& pull) { return pull.param ? "Pull" : "Push"; });

}  // namespace
}  // namespace relief
