#include "touch.h"

#include "allocations.h"
#include "compare.h"
#include "growth.h"
#include "ours.h"
#include "support/data.h"
#include "support/tools.h"
#include "timing.h"

#include <relief/base/try.h>
#include <relief/convert/convert.h>
#include <relief/core/query.h>
#include <relief/mesh/import.h>
#include <relief/mesh/samples.h>

#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <optional>
#include <thread>

namespace relief::bench {

namespace {

using nlohmann::ordered_json;

constexpr std::size_t kPoints = TouchTool::kMostPoints;
/// Bytes that are gone through so that a core's own caches hold nothing of a tick: many times what those hold, and less
/// than what cores share.
constexpr std::size_t kOwnEviction = std::size_t{16} << 20U;
constexpr int kColdPasses = 3;

/// What is measured for how long.
struct Plan {
  Repeats repeats;
  std::size_t pumpkin_triangles;
  int pumpkin_slabs, intervals;
  int scan_slabs;
  std::vector<int> scan_intervals;
  std::optional<int> dense_intervals;  ///< of the pumpkin once more
  bool all_tools;                      ///< also on the surfaces whose n is another than `intervals`
  int tool_frames;
  int evicted_ticks, paced_ticks;
  std::vector<int> growth_levels;
  int growth_frames;
};

Plan plan_of(Extent extent) {
  // 920 slabs with n = 32 are 0.94 million triangles, 1,020 with n = 128 are 16.7 million.
  Plan plan = {.repeats = {},
               .pumpkin_triangles = 300'000,
               .pumpkin_slabs = 920,
               .intervals = 32,
               .scan_slabs = 200,
               .scan_intervals = {32, 64},
               .dense_intervals = std::nullopt,
               .all_tools = false,
               .tool_frames = 1'000,
               .evicted_ticks = 1'200,
               .paced_ticks = 2'000,
               .growth_levels = {2, 4, 6},
               .growth_frames = 20'000};
  if (extent == Extent::Long) {
    plan.repeats = {.frames = 20'000, .places = 300, .rounds = 3};
    plan.dense_intervals = 128;
    plan.all_tools = true;
    plan.tool_frames = 5'000;
    plan.evicted_ticks = plan.paced_ticks = 10'000;
    plan.growth_levels = {2, 4, 6, 8};
  } else if (extent == Extent::Form) {
    plan = {.repeats = {.frames = 200, .places = 10, .rounds = 1},
            .pumpkin_triangles = 4'000,
            .pumpkin_slabs = 60,
            .intervals = 8,
            .scan_slabs = 150,
            .scan_intervals = {4},
            .dense_intervals = 16,
            .all_tools = false,
            .tool_frames = 50,
            .evicted_ticks = 20,
            .paced_ticks = 50,
            .growth_levels = {1, 2},
            .growth_frames = 200};
  }
  return plan;
}

class TouchBench {
 public:
  explicit TouchBench(Extent extent) : plan_(plan_of(extent)) {}

  Status run() {
    out_["machine"] = to_json(machine_);
    out_["machine"]["evicting_bytes"] = {own_.bytes(), all_.bytes()};
    out_["machine"]["load_average_before"] = load_average();
    out_["figures"] = ordered_json::array();
    RELIEF_CHECK(pumpkin());
    for (const int n : plan_.scan_intervals)
      for (const char* scan : {"igea", "bunny"}) RELIEF_CHECK(this->scan(scan, n));
    if (plan_.dense_intervals) RELIEF_CHECK(dense_pumpkin(*plan_.dense_intervals));
    grow();
    memory();
    out_["machine"]["load_average_after"] = load_average();
    return {};
  }
  [[nodiscard]] ordered_json take() { return std::move(out_); }

 private:
  void figure(const std::string& name, const std::string& surface, double value, const char* unit, Goal goal,
              const ordered_json& also = nullptr, const char* clock = "thread CPU") {
    ordered_json row = bench::figure(name, surface, value, unit, goal, clock);
    if (!also.is_null()) row["percentiles"] = also;
    out_["figures"].push_back(std::move(row));
  }
  /// A percentile of a row of times in ns, told in us.
  void time(const std::string& name, const std::string& surface, const ordered_json& ns, const char* which, Goal goal,
            const char* clock = "thread CPU") {
    ordered_json us;
    for (const char* each : {"p50", "p90", "p99", "p999", "max"}) us[each] = ns[each].get<double>() / 1000;
    figure(name, surface, us[which].get<double>(), "us", goal, us, clock);
  }

  Status pumpkin() {
    RELIEF_TRY(const TriangleMesh mesh, make_sample("pumpkin", plan_.pumpkin_triangles));
    {
      const std::string name = fmt::format("pumpkin, n = {}", plan_.intervals);
      RELIEF_CHECK(on_surface(name, mesh, {.slabs = plan_.pumpkin_slabs, .intervals = plan_.intervals}, true));
    }
    // As convert makes a model by default, n differs from slab to slab.
    RELIEF_TRY(const Conversion made, convert(mesh, {.slabs = plan_.scan_slabs}));
    const Surface surface = {*made.model.head};
    tools("pumpkin, n per slab", surface, make_ways(surface, plan_.repeats.frames));
    return {};
  }
  Status scan(const std::string& scan, int n) {
    const std::string name = fmt::format("{}, n = {}", scan, n);
    const std::filesystem::path file = testing::data_folder() / ("a_models/" + scan + ".ply");
    if (!std::filesystem::exists(file)) {
      out_["same_surface"][name] = {{"skipped", "no test data"}};
      return {};
    }
    RELIEF_TRY(const TriangleMesh mesh, import_mesh(file));
    return on_surface(name, mesh, {.slabs = plan_.scan_slabs, .intervals = n}, false);
  }
  Status dense_pumpkin(int n) {
    RELIEF_TRY(const TriangleMesh mesh, make_sample("pumpkin", plan_.pumpkin_triangles));
    return on_surface(fmt::format("pumpkin, n = {}", n), mesh, {.slabs = plan_.pumpkin_slabs * 51 / 46, .intervals = n},
                      false);
  }

  /// Beside the peers, and with the tools; on one surface also with cold caches and in a loop.
  Status on_surface(const std::string& name, const TriangleMesh& mesh, const ConvertSettings& settings, bool cold) {
    const double start = process_cpu_seconds();
    RELIEF_TRY(const Conversion made, convert(mesh, settings));
    const double build_seconds = process_cpu_seconds() - start;
    const Surface surface = {*made.model.head};
    ordered_json& beside = out_["same_surface"][name];
    const std::vector<Way> ways = make_ways(surface, plan_.repeats.frames);
    beside = compare_on(surface, build_seconds, ways, plan_.repeats, cold ? &all_ : nullptr);
    const ordered_json& rows = beside["rows"];
    const ordered_json &query = rows[kTrackedQuery]["warm_ns"], &point = rows[kContactPoint]["warm_ns"];
    time("tracked query, median", name, query["slide"], "p50", at_most(0.1));
    time("contact point, median", name, point["slide"], "p50",
         settings.intervals == plan_.intervals ? at_most(0.5) : Goal{});
    time("whole tick, p99.9", name, rows[kTick]["warm_ns"]["hand"], "p999", at_most(10));
    const auto embree = std::ranges::find_if(rows.items(), [](const auto& row) {
      return row.key().starts_with("Embree") && row.key().ends_with("bounded");
    });
    const double ratio = embree.value()["warm_ns"]["slide"]["p50"].template get<double>() /
                         std::max(1.0, query["slide"]["p50"].get<double>());
    const bool dense = plan_.dense_intervals && settings.intervals == *plan_.dense_intervals;
    figure("tracked query, times faster than Embree at its best", name, ratio, "times",
           name.starts_with("pumpkin") ? at_least(dense ? 30 : 10) : Goal{});
    if (plan_.all_tools || settings.intervals == plan_.intervals) tools(name, surface, ways);
    if (cold) {
      evicted(name, surface, "core's own caches evicted", own_);
      evicted(name, surface, "all caches evicted", all_);
      paced(name, surface, false);
      paced(name, surface, true);
    }
    return {};
  }

  /// Whole ticks with balls and with rigid tools.
  void tools(const std::string& name, const Surface& surface, std::span<const Way> ways) {
    for (const auto& [percent, goal] : {std::pair{0.3, Goal{}}, {1.0, at_most(20)}, {3.0, Goal{}}}) {
      TickRow row(surface, {.radius = percent / 100 * surface.size});
      time(fmt::format("whole tick, ball of {} % of the diagonal, p99.9", percent), name,
           by_hand(row, ways.first(kHandWays)), "p999", goal);
      touched(row);
    }
    // A sphere of which half is in the surface, and one that is in it as a whole.
    const std::vector<Vec3d> half = testing::sphere_points(kPoints, 0.05 * surface.size);
    const std::vector<Vec3d> whole = testing::sphere_points(kPoints, 0.01 * surface.size);
    TickRow half_in(surface, {.points = half}), all_in(surface, {.points = whole});
    const Way shallow = slide(surface, 0.005, 1e-4, plan_.tool_frames);
    const Way deep = slide(surface, 0.015, 1e-4, plan_.tool_frames);
    time(fmt::format("whole tick, rigid tool of {} points, all in, p99.9", kPoints), name,
         where_all_touch(all_in, whole, surface, deep), "p999", at_most(300));
    touched(all_in);
    time(fmt::format("whole tick, rigid tool of {} points, half in, p99.9", kPoints), name,
         by_hand(half_in, std::span(&shallow, 1)), "p999", {});
    touched(half_in);
  }
  /// Says of the last figure in which share of its ticks the tool touched, and in which the servo gave no force for
  /// safety.
  void touched(const TickRow& row) {
    out_["figures"].back()["touching_share"] = static_cast<double>(row.touching()) / static_cast<double>(row.ticks());
    out_["figures"].back()["latched_share"] = static_cast<double>(row.latched()) / static_cast<double>(row.ticks());
  }
  [[nodiscard]] ordered_json by_hand(TickRow& row, std::span<const Way> ways) const {
    std::vector<double> all;
    for (const Way& way : ways) {
      LeastTimes times;
      for (int round = 0; round < plan_.repeats.rounds; ++round) times.add_round(row, way);
      all.insert(all.end(), times.seconds().begin(), times.seconds().end());
    }
    return percentiles(all, 1e9);
  }
  /// Of the frames in which every point of the tool is below the surface.
  [[nodiscard]] ordered_json where_all_touch(TickRow& row, std::span<const Vec3d> points, const Surface& surface,
                                             const Way& way) const {
    LeastTimes times;
    for (int round = 0; round < plan_.repeats.rounds; ++round) times.add_round(row, way);
    std::vector<double> seconds;
    LocateHint hint;
    for (std::size_t k = 0; k < way.cursors.size(); ++k)
      if (std::ranges::all_of(points, [&](Vec3d p) { return inside(surface.model, way.cursors[k] + p, hint); }))
        seconds.push_back(times.seconds()[k]);
    return percentiles(seconds, 1e9);
  }

  /// What of a tick is due to the tick itself: of each the least of some passes. And what one pass measures, whatever
  /// else the machine does.
  void evicted(const std::string& name, const Surface& surface, const char* how, Eviction& eviction) {
    TickRow row(surface, {});
    const Way way = slide(surface, 0.005, 1e-4, plan_.evicted_ticks);
    const CallTimer timer;
    std::vector<double> least(way.cursors.size(), std::numeric_limits<double>::infinity()), all;
    for (int pass = 0; pass < kColdPasses; ++pass) {
      row.approach(way.cursors.front(), way.ups.front());
      for (std::size_t k = 0; k < way.cursors.size(); ++k) {
        eviction();
        all.push_back(timer([&] { static_cast<void>(row.tick(way.cursors[k], true)); }));
        least[k] = std::min(least[k], all.back());
      }
    }
    time(fmt::format("whole tick, {} before each, p99.9", how), name, percentiles(least, 1e9), "p999", at_most(30));
    time(fmt::format("whole tick, {} before each, one pass, p99.9", how), name, percentiles(all, 1e9), "p999",
         at_most(30));
  }

  /// A loop at 1 kHz that sleeps between its ticks. `busy`: another thread reads and writes memory meanwhile.
  void paced(const std::string& name, const Surface& surface, bool busy) {
    TickRow row(surface, {});
    const Way way = slide(surface, 0.005, 1e-4, plan_.paced_ticks);
    std::atomic<bool> done = false;
    std::thread other;
    if (busy)
      other = std::thread([&] {
        for (Eviction work(more_than_all_caches(machine_)); !done.load(std::memory_order_relaxed);) work();
      });
    const CallTimer timer;
    std::vector<double> cpu, wall;
    row.approach(way.cursors.front(), way.ups.front());
    timespec wake{};
    clock_gettime(CLOCK_MONOTONIC, &wake);
    for (const Vec3d p : way.cursors) {
      constexpr long kSecond = 1'000'000'000, kPeriod = 1'000'000;  // ns
      wake.tv_nsec += kPeriod;
      if (wake.tv_nsec >= kSecond) {
        wake.tv_nsec -= kSecond;
        ++wake.tv_sec;
      }
      clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &wake, nullptr);
      const auto before = std::chrono::steady_clock::now();
      cpu.push_back(timer([&] { static_cast<void>(row.tick(p, true)); }));
      wall.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - before).count());
    }
    done = true;
    if (other.joinable()) other.join();
    const std::string what =
        busy ? "whole tick in a loop at 1 kHz, memory busy, p99.9" : "whole tick in a loop at 1 kHz, p99.9";
    time(what, name, percentiles(cpu, 1e9), "p999", busy ? Goal{} : at_most(30));
    time(what, name, percentiles(wall, 1e9), "p999", {}, "wall");
  }

  void grow() {
    out_["growth"] = growth(plan_.growth_levels, plan_.growth_frames);
    const ordered_json &least = out_["growth"].front(), &most = out_["growth"].back();
    const double before = least["probe_ns"]["p50"].get<double>();
    figure(
        "tracked query, growth of the median",
        fmt::format("spheres of {} and {} slabs", least["slabs"].get<std::size_t>(), most["slabs"].get<std::size_t>()),
        most["probe_ns"]["p50"].get<double>() / std::max(1.0, before), "times", at_most(1.3));
  }

  /// Bytes of a servo, and of what it asks of the heap.
  void memory() {
    const std::vector<Vec3d> points = testing::sphere_points(kPoints, 1);
    for (const auto& [name, tool] : {std::pair{"point", TouchTool{}},
                                     {"ball", TouchTool{.radius = 1}},
                                     {"1000 points", TouchTool{.points = points}}}) {
      const ServoSettings settings = {.workspace = {}, .force = {}, .tool = tool};
      const DeviceInfo device;
      const std::size_t before = allocated_bytes();
      const Servo servo(settings, device);
      const std::size_t bytes = sizeof servo + allocated_bytes() - before;
      figure(fmt::format("memory of a servo, {}", name), "", static_cast<double>(bytes), "bytes", {}, nullptr, "none");
    }
  }

  Plan plan_;
  Machine machine_ = this_machine();
  Eviction own_{kOwnEviction}, all_{more_than_all_caches(machine_)};
  ordered_json out_;
};

}  // namespace

Result<ordered_json> measure_touch(Extent extent) {
  TouchBench bench(extent);
  RELIEF_CHECK(bench.run());
  return bench.take();
}

std::string touch_text(const ordered_json& touch) {
  const ordered_json& machine = touch["machine"];
  std::string text = figures_table(touch["figures"]);
  text += fmt::format(
      "  {}, {} cores, {} KiB of cache each, {} MiB of last-level cache; load average {:.1f} before, {:.1f} after\n"
      "  Warm, unless said otherwise: of each frame the least of all passes after a first one, so that preemption goes "
      "and\n"
      "  hard frames stay; p99.9 of slide, tap and press together. Core's own caches evicted: {} MiB are read and "
      "changed\n"
      "  before each tick, many times what a core keeps for itself; all caches: {} MiB, half as much again as the "
      "last\n"
      "  level holds. In either no line of the tick, its code included, is left in the core's own caches, nor the\n"
      "  translations of its addresses. Of each tick the least of {} passes; one pass: with all that happens beside "
      "it.\n"
      "  The loops sleep between their ticks, one pass. Thread CPU: what two readings of the clock take is off; wall: "
      "it\n"
      "  is not.\n",
      machine["processor"].get<std::string>(), machine["cores"].get<unsigned>(),
      machine["level_2_cache_bytes"].get<std::size_t>() >> 10U,
      machine["last_level_cache_bytes"].get<std::size_t>() >> 20U, machine["load_average_before"].get<double>(),
      machine["load_average_after"].get<double>(), machine["evicting_bytes"][0].get<std::size_t>() >> 20U,
      machine["evicting_bytes"][1].get<std::size_t>() >> 20U, kColdPasses);
  return text + comparison_table(touch["same_surface"]);
}

}  // namespace relief::bench
