// F.csv while it grows: the forces of relief touch, a row per tick.
#pragma once

#include <relief/base/growing_file.h>
#include <relief/base/spsc_queue.h>
#include <relief/haptics/servo_thread.h>

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <thread>

namespace relief::cli {

/// The header of F.csv, and one of its rows; `echo` is the row's t,x,y,z as read. With the torque where there is one.
[[nodiscard]] std::string force_header(bool torque);
[[nodiscard]] std::string force_row(const ServoSample& sample, std::string_view echo, bool torque);

/// How an output ended.
struct OutputEnd {
  std::string name;          ///< printable
  std::uint64_t rows = 0;    ///< or ticks, that are in it
  std::uint64_t lost = 0;    ///< that it was too slow for
  Status status = {};        ///< what went wrong first
  std::string_view of = "";  ///< "rows" or "ticks"
};

/// Along a path: rows are written by the caller's thread, and are in the file every few thousand.
class PathForces {
 public:
  [[nodiscard]] static Result<PathForces> create(const std::filesystem::path& file, bool torque);
  /// Whether the file takes more.
  [[nodiscard]] bool row(const ServoSample& sample, std::string_view echo);
  [[nodiscard]] OutputEnd finish();

 private:
  PathForces(GrowingFile file, std::string name, bool torque);
  GrowingFile file_;
  std::string name_;
  bool torque_;
  std::uint64_t given_ = 0;
  Status status_;
};

/// Live: a thread of its own writes what comes, ten times a second. take() never waits; where the disk stands still for
/// more than a quarter of a minute, rows are left out and counted.
class LiveForces {
 public:
  [[nodiscard]] static Result<std::unique_ptr<LiveForces>> create(const std::filesystem::path& file, bool torque);
  LiveForces(const LiveForces&) = delete;
  LiveForces& operator=(const LiveForces&) = delete;
  ~LiveForces();
  /// One thread. x,y,z are the cursor, in model units.
  void take(const ServoTick& tick) noexcept;
  [[nodiscard]] OutputEnd finish();

 private:
  LiveForces(GrowingFile file, std::string name, bool torque);
  void write_loop();
  GrowingFile file_;
  std::string name_;
  bool torque_;
  SpscQueue<ServoSample> queue_;
  std::atomic<bool> ending_{false};
  std::uint64_t lost_ = 0;
  Status status_;  ///< the thread's, until it has ended
  std::thread thread_;
};

}  // namespace relief::cli
