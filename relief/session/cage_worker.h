// Makes other cages for a document, one after the other, on a thread of its own.
#pragma once

#include <relief/base/progress.h>
#include <relief/core/room.h>

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>

namespace relief::detail {

/// Its jobs are numbered from 1. One thread asks and cancels.
class CageWorker {
 public:
  using Job = std::function<Result<Room>(const Progress&)>;
  struct Done {
    std::uint64_t number = 0;
    Result<Room> result;
  };
  /// `tell` is called by the worker's thread and must not wait for it; `report` likewise, see Progress.
  CageWorker(std::function<void(Done)> tell, std::function<void(std::string_view, double)> report);
  CageWorker(const CageWorker&) = delete;
  CageWorker& operator=(const CageWorker&) = delete;
  /// Cancels what there is.
  ~CageWorker();

  std::uint64_t ask(Job job);
  /// That job's end is reported nevertheless: as cancelled, unless it was done already.
  void cancel(std::uint64_t number);

 private:
  void run();

  std::function<void(Done)> tell_;
  std::function<void(std::string_view, double)> report_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<std::pair<std::uint64_t, Job>> jobs_;
  std::uint64_t asked_ = 0, running_ = 0;  ///< the newest job; the one that is worked on, or 0
  bool closing_ = false;
  std::atomic<bool> stop_{false};  ///< the job that is worked on; written under the lock
  std::thread thread_;             ///< from the first job on
};

}  // namespace relief::detail
