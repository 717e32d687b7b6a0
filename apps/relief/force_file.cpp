#include "force_file.h"

#include <relief/base/try.h>

#include <fmt/format.h>

#include <chrono>
#include <cstddef>
#include <utility>

namespace relief::cli {

namespace {

constexpr std::uint64_t kPathRows = 4096;                 // between two flushes: some milliseconds
constexpr std::size_t kLiveRows = std::size_t{1} << 14U;  // that may wait for the disk: 16 s
constexpr std::chrono::milliseconds kLiveEvery{100};      // what a kill -9 may cost

std::uint64_t rows_of(const GrowingFile& file) { return file.lines() > 0 ? file.lines() - 1 : 0; }

}  // namespace

std::string force_header(bool torque) {
  return fmt::format("t,x,y,z,contact,slab,u,v,alpha,depth,px,py,pz,nx,ny,nz,fx,fy,fz,flags{}\n",
                     torque ? ",tx,ty,tz" : "");
}

std::string force_row(const ServoSample& s, std::string_view echo, bool torque) {
  const SlabCoord at = s.contact ? s.at : SlabCoord{};
  std::string row = fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}", echo, s.contact ? 1 : 0,
                                s.contact ? static_cast<std::int64_t>(at.slab) : -1, at.u, at.v, at.alpha,
                                s.contact ? s.depth : 0.0, s.contact_point.x, s.contact_point.y, s.contact_point.z,
                                s.normal.x, s.normal.y, s.normal.z, s.force.x, s.force.y, s.force.z, s.flags);
  if (torque) row += fmt::format(",{},{},{}", s.torque.x, s.torque.y, s.torque.z);
  return row + '\n';
}

// ---- Along a path

PathForces::PathForces(GrowingFile file, std::string name, bool torque)
    : file_(std::move(file)), name_(std::move(name)), torque_(torque) {}

Result<PathForces> PathForces::create(const std::filesystem::path& file, bool torque) {
  RELIEF_TRY(GrowingFile made, GrowingFile::create(file));
  PathForces forces(std::move(made), printable(file.string()), torque);
  forces.status_ = forces.file_.write(force_header(torque));
  return forces;
}

bool PathForces::row(const ServoSample& sample, std::string_view echo) {
  if (status_) status_ = file_.write(force_row(sample, echo, torque_));
  if (status_ && ++given_ % kPathRows == 0) status_ = file_.flush();
  return status_.has_value();
}

OutputEnd PathForces::finish() {
  if (status_) status_ = file_.flush();
  return {.name = name_, .rows = rows_of(file_), .status = status_, .of = "rows"};
}

// ---- Live

LiveForces::LiveForces(GrowingFile file, std::string name, bool torque)
    : file_(std::move(file)),
      name_(std::move(name)),
      torque_(torque),
      queue_(kLiveRows),
      status_(file_.write(force_header(torque))),
      thread_([this] { write_loop(); }) {}

LiveForces::~LiveForces() {
  ending_.store(true, std::memory_order_release);
  if (thread_.joinable()) thread_.join();
}

Result<std::unique_ptr<LiveForces>> LiveForces::create(const std::filesystem::path& file, bool torque) {
  RELIEF_TRY(GrowingFile made, GrowingFile::create(file));
  return std::unique_ptr<LiveForces>(new LiveForces(std::move(made), printable(file.string()), torque));
}

void LiveForces::take(const ServoTick& tick) noexcept {
  if (tick.model != nullptr && !queue_.push(tick.sample)) ++lost_;
}

void LiveForces::write_loop() {
  for (;;) {
    // Read before the queue is found empty: what was pushed before the end is then still taken.
    const bool last_round = ending_.load(std::memory_order_acquire);
    for (ServoSample s; queue_.pop(s);)
      if (status_)
        status_ =
            file_.write(force_row(s, fmt::format("{},{},{},{}", s.t, s.cursor.x, s.cursor.y, s.cursor.z), torque_));
    if (status_) status_ = file_.flush();
    if (last_round) return;
    std::this_thread::sleep_for(kLiveEvery);
  }
}

OutputEnd LiveForces::finish() {
  ending_.store(true, std::memory_order_release);
  if (thread_.joinable()) thread_.join();
  return {.name = name_, .rows = rows_of(file_), .lost = lost_, .status = status_, .of = "rows"};
}

}  // namespace relief::cli
