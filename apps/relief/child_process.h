// Relief as a process of its own: what one job costs or breaks leaves the others alone.
#pragma once

#include <relief/base/error.h>

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace relief::cli {

/// What a process may take; 0 means that there is no limit.
struct ChildLimits {
  double seconds = 0;
  std::uint64_t memory_mib = 0;  ///< of memory that it writes and shares with nobody
};

/// What came of a process.
struct Ended {
  int exit_status = 0;  ///< -1 where a signal ended the process
  int signal = 0;       ///< 0 where the process ended by itself
  bool timed_out = false;
  std::string out, err;  ///< the first MiB of each output
  double seconds = 0;    ///< as time passed
  double peak_mib = 0;   ///< most memory resident at a time
};

/// One running `relief`. It reads nothing, is out of reach of the terminal's Ctrl-C, and ends when this process or the
/// object does.
class ChildProcess {
 public:
  /// Error: Io where the system starts no more processes.
  [[nodiscard]] static Result<ChildProcess> start(std::vector<std::string> arguments, ChildLimits limits = {});
  ChildProcess(ChildProcess&& other) noexcept;
  /// The process that was here before goes with the other object.
  ChildProcess& operator=(ChildProcess&& other) noexcept;
  ~ChildProcess();

  /// Returns at once; holds a value the first time that the process is found to have ended. Enforces the time limit, so
  /// that it must be called often.
  [[nodiscard]] std::optional<Ended> poll();
  /// Waits for the end, where it has not come yet.
  void wait();
  /// Asks the process to clean up and end. poll() kills it after two seconds more.
  void stop();

 private:
  using Clock = std::chrono::steady_clock;
  explicit ChildProcess(ChildLimits limits) : limits_(limits) {}
  ChildLimits limits_;
  pid_t pid_ = -1;  ///< also the number of its process group
  int out_ = -1, err_ = -1;
  bool timed_out_ = false;
  Clock::time_point started_ = Clock::now();
  std::optional<Clock::time_point> kill_at_;
};

}  // namespace relief::cli
