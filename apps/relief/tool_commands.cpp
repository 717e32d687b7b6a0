// devices and bench.
#include "commands.h"

#include <relief/base/try.h>
#include <relief/devices/open_device.h>

#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <memory>
#include <thread>

extern char** environ;

namespace relief::cli {

namespace {

Status run_devices(const Context& context) {
  nlohmann::ordered_json json;
  json["devices"] = nlohmann::ordered_json::array();
  std::vector<DeviceListing> devices = list_devices();
  devices.push_back({"sim:hand:FILE.json", "simulated hand on a device whose figures are in a file"});
  devices.push_back(
      {std::string(kReplayDevice) + "REC.rlog", "a recording, played as the device that it was made with"});
  for (const DeviceListing& d : devices) {
    if (!context.json) print(fmt::format("{:24} {}\n", d.name, d.description));
    json["devices"].push_back({{"name", d.name}, {"description", d.description}});
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
  CLI::App* c = app.add_subcommand("devices", "List what can touch a model");
  finish_command(*c, context, [&context] { return run_devices(context); });
}

void add_bench(CLI::App& app, Context& context) {
  auto what = std::make_shared<std::string>();
  auto thorough = std::make_shared<bool>(false);
  CLI::App* c = app.add_subcommand("bench", "Measure this build on this machine");
  c->add_option("WHAT", *what, "convert, query, touch, dab, render, paper (the paper's own table), or all")
      ->required()
      ->check(CLI::IsMember({"convert", "query", "touch", "dab", "render", "paper", "all"}));
  c->add_flag("--long", *thorough, "Take the time that steady figures need");
  finish_command(*c, context, [what, thorough, &context] { return run_bench(*what, *thorough, context); });
}

}  // namespace relief::cli
