// S16 to S18: what a tick costs, what lateness does, and what a tick may never call.
#include "acceptance/acceptance.h"
#include "support/driver.h"
#include "support/forbidden_calls.h"
#include "support/held_tools.h"
#include "support/watched_servo.h"

#include <relief/base/cpu_time.h>
#include <relief/devices/simulated_hand.h>
#include <relief/haptics/contact/proxy.h>
#include <relief/render/frame.h>
#include <relief/session/session.h>

#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace relief::acceptance {
namespace {

double quantile(std::vector<int> counts, double q) {
  if (counts.empty()) return std::nan("");
  const auto at = counts.begin() + static_cast<std::ptrdiff_t>(q * double(counts.size() - 1));
  std::ranges::nth_element(counts, at);
  return *at;
}

double mean(const std::vector<int>& counts) {
  double sum = 0;
  for (const int count : counts) sum += count;
  return counts.empty() ? std::nan("") : sum / double(counts.size());
}

/// A rolling sheet of 2 * cells * cells slabs of n = 32, each with the same detail.
SnapshotPtr sheet(int cells) {
  return testing::displaced(testing::plane_shell(cells, 32, 0.4 / cells), [=](Vec3d p) {
    return 0.5 + 0.2 * std::sin(4.1 * (p.x - 0.5) * cells) * std::cos(3.7 * (p.z - 0.5) * cells);
  });
}

struct Work {
  std::vector<int> placed;  ///< samples per tick
  TimeHistogram compute;    ///< ns
};
/// Slides, presses and taps in the middle of a sheet, the same in lengths of its slabs whatever their number.
Work work_over(int cells, int ticks) {
  const SnapshotPtr model = sheet(cells);
  Proxy proxy;
  Work work;
  for (int k = 0; k < ticks; ++k) {
    const double t = k * 1e-3;
    const double tap = k % 4000 < 3000 ? 0.15 : 0.3;
    const Vec3d cursor = {0.5 + (0.9 * std::sin(0.8 * t)) / cells, (0.05 - tap * (1 - std::cos(6 * t)) / 2) / cells,
                          0.5 + (0.8 * std::cos(0.7 * t)) / cells};
    const std::uint64_t start = thread_cpu_ns();
    static_cast<void>(proxy.step(*model, cursor));
    work.compute.add(thread_cpu_ns() - start);
    work.placed.push_back(proxy.samples_placed());
  }
  return work;
}

struct Live {
  SessionStats session;
  std::uint64_t dabs = 0;
  int pictures = 0;
};
/// A simulated hand carves a sphere of a million triangles while another thread draws each state that it finds.
Live live_session(double seconds) {
  const SnapshotPtr model = testing::shaped(testing::sphere_shell(3, 45), testing::sphere_field());
  const Workspace space = {.metres_per_unit = 0.045};
  SimulatedHand hand(plant_presets().front(), {.max_force = 1}, [](double t) {
    return HandTarget{{0.04 * std::sin(t), 0.016, 0.04 * std::cos(t)}, t > 0.3 ? 1U : 0U};
  });
  hand.set_state({0, 0.017, 0.047}, {});
  Document document({.info = {}, .head = model});
  Session session(hand, document, {.servo = {.workspace = space}, .sculpt = {.full_depth = 0.05}});
  session.set_brush({.tool = Tool::Carve, .radius = 0.05, .strength = 0.2});
  std::atomic<int> pictures{0};
  std::jthread drawing([&pictures, reader = document.reader(), model](const std::stop_token& stop) mutable {
    Result<FrameRenderer> renderer = FrameRenderer::create();
    if (!renderer) {
      std::fprintf(stderr, "%s\n", renderer.error().message.c_str());
      return;
    }
    Frame frame;
    frame.width = 640;
    frame.height = 360;
    frame.camera = framing(*model, 0, 40, 640.0 / 360);
    std::vector<std::uint32_t> pixels(std::size_t{640} * 360);
    while (!stop.stop_requested()) {
      if (!renderer->draw(reader.latest(), frame, pixels, frame.width)) return;
      ++pictures;
    }
  });
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
  drawing = {};  // ends and waits
  if (const Status stopped = session.stop(); !stopped) std::fprintf(stderr, "%s\n", stopped.error().message.c_str());
  return {session.stats(), document.statistics().dabs, pictures};
}

double us(std::uint64_t ns) { return double(ns) * 1e-3; }

void show_times(Report& report, const std::string& what, const TimeHistogram& times) {
  report.shown(what + ", p50", us(times.quantile(0.5)), "us");
  report.shown("    p99.99", us(times.quantile(0.9999)), "us");
  report.shown("    largest", us(times.max()), "us");
}

}  // namespace

void work_per_tick(Report& report) {
  const int ticks = report.long_form() ? 1'000'000 : 40'000;
  const Work small = work_over(4, ticks), large = work_over(24, ticks);
  report.shown("triangles of the small sheet", 2.0 * 4 * 4 * 32 * 32);
  report.at_least("triangles of the large sheet", 2.0 * 24 * 24 * 32 * 32, 1e6);
  const auto compare = [&](const std::string& which, double few, double many) {
    report.shown("samples looked at per tick on the large sheet, " + which, many);
    report.at_most("    against the small one, " + which, std::max(many / few, few / many), 1.2);
  };
  compare("mean", mean(small.placed), mean(large.placed));
  compare("p99.9", quantile(small.placed, 0.999), quantile(large.placed, 0.999));
  report.at_most("samples looked at in any tick", quantile(large.placed, 1), 1000);
  show_times(report, "CPU time of a contact point's tick, small sheet", small.compute);
  show_times(report, "the same, large sheet", large.compute);
  const Live live = live_session(report.long_form() ? 60 : 3);
  report.shown("dabs while carving a million triangles live", double(live.dabs));
  report.shown("pictures of it drawn meanwhile", live.pictures);
  show_times(report, "CPU time of a whole tick meanwhile", live.session.servo.compute);
  show_times(report, "the null loop's, in the same run", null_loop(1).compute);
}

void deadlines(Report& report) {
  // On a virtual clock: ticks come late by a trace, whole periods are skipped, and the device holds the last force.
  const SnapshotPtr model = testing::fine_sphere();
  const PlantPreset preset = plant_presets().front();
  SimulatedHand hand(preset, {.max_force = 1},
                     [](double t) { return HandTarget{{0.03 * std::sin(2 * t), 0.02, 0.03 * std::cos(2 * t)}, 0}; });
  hand.set_state({0, 0.025, 0.052}, {});
  Servo servo({.workspace = {.metres_per_unit = 0.05}, .force = {.friction = 0.3}}, hand.info());
  const int periods = report.long_form() ? 3'000'000 : 60'000;
  int ticks = 0, skipped = 0, over_limit = 0, too_quick = 0, flagged = 0, lowered = 0, lost = 0, unsafe = 0, stalls = 0;
  Vec3d last;
  double last_t = 0;
  std::uint32_t random = 1;
  bool after_stall = false;
  constexpr std::uint32_t kLimits = bit(ServoFault::ForceClamped) | bit(ServoFault::RateClamped) |
                                    bit(ServoFault::Passivity) | bit(ServoFault::LateTicks);
  for (int k = 0; k < periods; ++ticks) {
    DeviceState state;
    static_cast<void>(hand.read(state));
    const ServoSample felt = servo.step(*model, state);
    const double dt = state.t - last_t;
    const double size = length(felt.force);
    over_limit += size > hand.info().max_force ? 1 : 0;
    too_quick += size > length(last) + hand.info().max_force_rate * dt * (1 + 1e-9) && ticks > 0 ? 1 : 0;
    if (after_stall) {
      // Longer than any tick may be late: the safe state, in the same tick.
      ++stalls;
      unsafe += size > 0 || (felt.flags & bit(ServoFault::BadTime)) == 0 ? 1 : 0;
    } else if (stalls == 0) {
      flagged += (felt.flags & ~kLimits) != 0 ? 1 : 0;
      lowered += (felt.flags & bit(ServoFault::LateTicks)) != 0 ? 1 : 0;
      lost += state.t > 0.5 && !felt.contact ? 1 : 0;
    }
    last = felt.force;
    last_t = state.t;
    // Mostly in time; one in a hundred late by 1 to 10 ms, one in a thousand by 40 ms; a stall of 80 ms in the last
    // tenth.
    random = random * 1664525U + 1013904223U;
    const unsigned dice = random >> 16U;
    int late = dice % 1000 == 0 ? 40 : dice % 100 == 1 ? 1 + int(dice % 10) : 0;
    after_stall = k > periods / 10 * 9 && dice % 500 == 2;
    if (after_stall) late = 80;
    skipped += late;
    k += 1 + late;
    for (int period = 0; period <= late; ++period) static_cast<void>(hand.write({felt.force, felt.torque}));
  }
  report.shown("ticks on a virtual clock", ticks);
  report.at_least("periods skipped, of all", double(skipped) / periods, 0.05);
  report.at_most("forces above the device's", over_limit, 0);
  report.at_most("forces that grew faster than it allows", too_quick, 0);
  report.shown("share of ticks in which stiffness was lowered for the late ones", double(lowered) / ticks, "");
  report.at_most("ticks up to 40 ms late that were taken for faults", flagged, 0);
  report.at_most("of them without contact", lost, 0);
  report.at_least("stalls of 80 ms", stalls, 3);
  report.at_most("of them without zero force in the same tick", unsafe, 0);

  const double seconds = report.long_form() ? 120 : 1.5;
  const SessionStats live = live_session(seconds).session;
  const ServoTimes idle = null_loop(seconds);
  for (const auto& [what, times] : {std::pair{"live session", &live.servo}, {"null loop", &idle}}) {
    report.shown(std::string(what) + ": ticks", double(times->ticks));
    report.shown("    periods missed", double(times->overruns));
    report.shown("    late, p50", us(times->late.quantile(0.5)), "us");
    report.shown("    late, p99.9", us(times->late.quantile(0.999)), "us");
    report.shown("    late, largest", us(times->late.max()), "us");
  }
}

namespace {

/// The hand of both: all over the top of a ball of radius 1 that is 0.1 m large.
SimulatedHand roaming_hand(const testing::HeldTool& held) {
  return {plant_presets().front(), {.tremor = 1e-3}, [larger = 1 + held.radius](double t) {
            return HandTarget{Vec3d{0.05 * std::sin(3 * t), 0.02, 0.09 * std::cos(3 * t)} * larger, 0};
          }};
}
ServoSettings roaming_settings(const testing::HeldTool& held) {
  return {.workspace = {.metres_per_unit = 0.1}, .force = {.friction = 0.4}, .tool = held.tool()};
}

void show_calls(Report& report, const std::string& of, const testing::ForbiddenCalls& calls, bool watched) {
  report.at_most("allocations and frees" + of, calls.news + calls.deletes + calls.mallocs + calls.frees, 0);
  if (testing::kCountsEverything)
    report.at_most("locks" + of, calls.locks, 0);
  else
    report.skipped("locks cannot be counted under a sanitizer");
  if (watched)
    report.at_most("system calls but for the clock" + of, calls.system_calls, 0);
  else
    report.skipped("system calls cannot be watched here");
}

/// Minor ones are judged where nothing but a step is in between, and no sanitizer's own memory.
void show_faults(Report& report, const std::string& of, long minor_faults, long major_faults, bool steps) {
  const std::string minor = "minor page faults after warm-up" + of;
  if (steps && testing::kCountsEverything)
    report.at_most(minor, double(minor_faults), 0);
  else
    report.shown(minor, double(minor_faults));
  report.at_most("major page faults after warm-up" + of, double(major_faults), 0);
}

/// One tick after the other, without the loop around them.
void calls_of_steps(Report& report, const testing::HeldTool& held, const std::vector<SnapshotPtr>& models) {
  SnapshotChannel channel(models.front());
  SimulatedHand hand = roaming_hand(held);
  Servo servo(roaming_settings(held), hand.info());
  // Until each branch of a tick has been taken: its code is then in memory, as in the loop, which locks it there.
  const int warm = 10'000, ticks = (report.long_form() ? 3'000'000 : 30'000) / held.dear;
  testing::ForbiddenCalls calls;
  int touched = 0, changes = 0, breaches = 0;
  rusage before{}, after{};
  bool watched = false;
  std::atomic<bool> done{false};
  // The editor publishes meanwhile.
  std::thread editor([&] {
    for (std::size_t k = 1; !done.load(); ++k) {
      channel.publish(models[k % models.size()]);
      std::this_thread::sleep_for(std::chrono::microseconds(100));
    }
  });
  std::thread([&, reader = channel.reader()]() mutable {
    watched = testing::watch_system_calls();
    {
      // The watch must see a forbidden call where there is one.
      const testing::WatchedCalls watch;
      std::free(std::malloc(1));
      static_cast<void>(syscall(SYS_getppid));
      breaches = watch.calls().total();
    }
    const Snapshot* last = models.front().get();
    const auto tick = [&] {
      DeviceState state;
      static_cast<void>(hand.read(state));
      const Snapshot& model = reader.latest();
      changes += &model != std::exchange(last, &model) ? 1 : 0;
      const ServoSample felt = servo.step(model, state);
      static_cast<void>(hand.write({felt.force, felt.torque}));
      touched += felt.contact ? 1 : 0;
    };
    for (int k = 0; k < warm; ++k) tick();
    getrusage(RUSAGE_THREAD, &before);
    {
      const testing::WatchedCalls watch;
      for (int k = 0; k < ticks; ++k) tick();
      calls = watch.calls();
      calls.system_calls += calls.sleeps;
    }
    getrusage(RUSAGE_THREAD, &after);
  }).join();
  done.store(true);
  editor.join();
  report.at_least("ticks in contact, of all" + held.name, double(touched) / (warm + ticks), 0.1);
  report.at_least("ticks in which a new model came" + held.name, changes, 20);
  if (testing::kCountsEverything)
    report.at_least("forbidden calls seen where three are made" + held.name, breaches, watched ? 3 : 2);
  show_calls(report, held.name, calls, watched);
  show_faults(report, held.name, after.ru_minflt - before.ru_minflt, after.ru_majflt - before.ru_majflt, true);
}

/// The servo's own thread, or that of a push device, with all that goes on around a step.
void calls_of_thread(Report& report, const testing::HeldTool& held, const std::vector<SnapshotPtr>& models, bool pull) {
  const int ticks = report.long_form() ? 60'000 : 600;
  const testing::WatchedRun run = testing::watched_run(pull, models, roaming_settings(held), roaming_hand(held), ticks);
  const std::string of = (pull ? ", the servo's thread" : ", a push device's thread") + held.name;
  report.at_least("ticks in contact" + of, run.touched, 20);
  report.at_least("changes of model and settings" + of, std::min(run.models, run.settings), 3);
  report.at_least("ticks after a full queue and after a standstill" + of,
                  std::min(run.dropped, pull ? run.stalled : run.lost), 1);
  testing::ForbiddenCalls calls = run.calls;
  // A loop of our own sleeps once before each tick.
  calls.system_calls += std::abs(calls.sleeps - (pull && run.saw_system_calls ? ticks : 0));
  show_calls(report, of, calls, run.saw_system_calls);
  show_faults(report, of, run.minor_faults, run.major_faults, false);
}

}  // namespace

void forbidden_calls(Report& report) {
  std::vector<SnapshotPtr> models;
  const auto cage = testing::sphere_shell(2, 64);
  for (const double radius : {1.0, 0.995})
    models.push_back(testing::shaped(cage, [=](Vec3d p) { return length(p) - radius; }));
  for (const testing::HeldTool& held : testing::held_tools(0.05)) {
    calls_of_steps(report, held, models);
    calls_of_thread(report, held, models, true);
    calls_of_thread(report, held, models, false);
  }
}

}  // namespace relief::acceptance
