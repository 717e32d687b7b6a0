#include <relief/session/cage_worker.h>

#include <utility>

namespace relief::detail {

CageWorker::CageWorker(std::function<void(Done)> tell, std::function<void(std::string_view, double)> report)
    : tell_(std::move(tell)), report_(std::move(report)) {}

CageWorker::~CageWorker() {
  {
    const std::scoped_lock lock(mutex_);
    closing_ = true;
    jobs_.clear();
    stop_.store(true);
    wake_.notify_one();
  }
  if (thread_.joinable()) thread_.join();
}

std::uint64_t CageWorker::ask(Job job) {
  const std::scoped_lock lock(mutex_);
  jobs_.emplace_back(++asked_, std::move(job));
  if (!thread_.joinable()) thread_ = std::thread([this] { run(); });
  wake_.notify_one();
  return asked_;
}

void CageWorker::cancel(std::uint64_t number) {
  {
    const std::scoped_lock lock(mutex_);
    if (running_ == number) stop_.store(true);
    if (std::erase_if(jobs_, [&](const auto& job) { return job.first == number; }) == 0) return;
  }
  tell_({number, fail(Errc::Cancelled, "cancelled")});
}

void CageWorker::run() {
  std::unique_lock lock(mutex_);
  while (true) {
    wake_.wait(lock, [&] { return !jobs_.empty() || closing_; });
    if (closing_) return;
    const auto [number, job] = std::move(jobs_.front());
    jobs_.pop_front();
    stop_.store(false);
    running_ = number;
    lock.unlock();
    Result<Room> made = job({.report = report_, .cancel = &stop_});
    tell_({number, std::move(made)});
    lock.lock();
    running_ = 0;
  }
}

}  // namespace relief::detail
