// devices and bench.
#include "commands.h"

#include <relief/base/try.h>
#include <relief/devices/open_device.h>
#include <relief/session/replay.h>

#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <memory>
#include <thread>

extern char** environ;

namespace relief::cli {

namespace {

using nlohmann::ordered_json;

ordered_json to_json(const Freedom& f) {
  return {{"position", f.position}, {"rotation", f.rotation}, {"gripper", f.gripper}};
}

constexpr std::string_view kDeviceNames =
    "--device takes a name that relief devices lists.\n"
    "\n"
    "  sim:hand             a simulated hand; no device is needed\n"
    "  sim:hand:NAME        the same on a device like the one named, such as sim:hand:falcon-like\n"
    "  sim:hand:FILE.json   the same on a device with the figures of a file\n"
    "  replay:REC.rlog      a recording, played as the device that it was made with\n"
    "\n"
    "A device of your own is a C++ class: docs/how-to/own-device.md.\n";

/// Numbers that are not known are null.
ordered_json to_json(const DeviceInfo& d) {
  const Box3d room = workspace_of(d);
  ordered_json workspace;
  if (!room.empty()) workspace = {{room.low.x, room.low.y, room.low.z}, {room.high.x, room.high.y, room.high.z}};
  return {{"sensed", to_json(d.sensed)},
          {"actuated", to_json(d.actuated)},
          {"max_force", d.max_force},
          {"continuous_force", d.continuous_force},
          {"max_force_rate", d.max_force_rate},
          {"max_torque", d.max_torque},
          {"max_stiffness", d.max_stiffness},
          {"max_damping", d.max_damping},
          {"max_work", d.max_work},
          {"max_speed", d.max_speed},
          {"workspace", workspace},
          {"rate", d.rate > 0 ? ordered_json(d.rate) : ordered_json()},
          {"delay", std::max(d.delay, d.delay_ticks * tick_of(d))},
          {"handedness", name(d.handedness)},
          {"gravity_compensation", name(d.gravity)},
          {"filters", d.filters},
          {"serial", d.serial},
          {"absolute", d.absolute},
          {"pull", d.pull}};
}

/// "3 axes felt of 3; up to 3.3 N, 0.88 N for long; ...".
std::string facts_of(const DeviceListing& listing) {
  const DeviceInfo& d = listing.info;
  const Vec3d room = workspace_of(d).empty() ? Vec3d{} : workspace_of(d).extent();
  std::string text =
      fmt::format("{} axes, {} with force: up to {} N, {} N for long; {} N/m, {} N*s/m", d.sensed.count(),
                  d.actuated.count(), d.max_force, d.continuous_force, d.max_stiffness, d.max_damping);
  if (room != Vec3d{}) text += fmt::format("; {:.3g} x {:.3g} x {:.3g} m", room.x, room.y, room.z);
  if (d.rate > 0) text += fmt::format("; {:g} Hz", d.rate);
  if (!d.filters.empty()) text += "; filters: " + printable(d.filters);
  return text + "; " + std::string(name(listing.evidence));
}

Status run_devices(const Context& context) {
  ordered_json json;
  json["devices"] = ordered_json::array();
  for (const DeviceListing& d : list_devices()) {
    if (!context.json) print(fmt::format("{:24} {}\n{:24} {}\n", d.name, d.description, "", facts_of(d)));
    ordered_json one = {{"name", d.name}, {"description", d.description}, {"evidence", name(d.evidence)}};
    one.update(to_json(d.info));
    json["devices"].push_back(std::move(one));
  }
  // Their facts are in a file.
  const DeviceListing of_files[] = {
      {.name = "sim:hand:FILE.json", .description = "simulated hand on a device whose figures are in a file"},
      {.name = std::string(kReplayDevice) + "REC.rlog",
       .description = "a recording, played as the device that it was made with"}};
  for (const DeviceListing& d : of_files) {
    if (!context.json) print(fmt::format("{:24} {}\n", d.name, d.description));
    json["devices"].push_back({{"name", d.name}, {"description", d.description}, {"evidence", name(d.evidence)}});
  }
  if (context.json) print_json(json);
  return {};
}

/// The benchmark programs stand beside this one in a build folder and are not installed.
Status run_bench(const std::string& what, bool thorough, const Context& context) {
  std::error_code error;
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", error);
  const std::filesystem::path program = self.parent_path() / "relief-bench";
  if (error || !std::filesystem::exists(program, error))
    return fail(
        Errc::NotFound,
        fmt::format("{}: the benchmark program is missing; build it with ./dev build and run build/release/bin/relief",
                    printable(program.string())));
  std::string name = program.string();
  std::string subject = what;
  std::string long_flag = "--long", json_flag = "--json";
  std::vector<char*> arguments = {name.data(), subject.data()};
  if (thorough) arguments.push_back(long_flag.data());
  if (context.json) arguments.push_back(json_flag.data());
  arguments.push_back(nullptr);
  pid_t child = 0;
  if (posix_spawn(&child, name.c_str(), nullptr, nullptr, arguments.data(), environ) != 0)
    return fail(Errc::Io, printable(name) + ": cannot be started");
  int state = 0;
  while (true) {
    const pid_t ended = waitpid(child, &state, WNOHANG);
    if (ended == child) break;
    if (ended < 0 && errno != EINTR) return fail(Errc::Io, printable(name) + ": cannot be waited for");
    if (context.progress.cancelled()) kill(child, SIGTERM);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  if (context.progress.cancelled()) return fail(Errc::Cancelled, "cancelled");
  if (!WIFEXITED(state) || WEXITSTATUS(state) != 0) return fail(Errc::Io, printable(name) + ": the benchmark failed");
  return {};
}

}  // namespace

void add_devices(CLI::App& app, Context& context) {
  CLI::App* c = app.add_subcommand("devices", "List what can touch a model, with what each can do");
  context.catalogue[c] = {.group = "Check",
                          .examples = {{"relief devices"}, {"relief devices --json", "every figure of each"}},
                          .notes = std::string(kDeviceNames)};
  finish_command(*c, context, [&context] { return run_devices(context); });
}

void add_bench(CLI::App& app, Context& context) {
  auto what = std::make_shared<std::string>();
  auto thorough = std::make_shared<bool>(false);
  CLI::App* c = app.add_subcommand("bench", "Measure this build on this machine");
  context.catalogue[c] = {
      .group = "Measure",
      .examples = {{"relief bench touch", "time of a tick, beside its goal"}, {"relief bench all --long"}}};
  c->add_option(
       "WHAT", *what,
       "convert, query, touch, dab: goals and peers; clay: goals; render; paper: the paper's own table; or all")
      ->required()
      ->check(one_of({"convert", "query", "touch", "dab", "clay", "render", "paper", "all"}));
  c->add_flag("--long", *thorough, "take the time that steady figures need");
  // The benchmark programs print by themselves, with as many threads as each measurement says.
  finish_command(*c, context, [what, thorough, &context] { return run_bench(*what, *thorough, context); },
                 {.work = false});
}

}  // namespace relief::cli
