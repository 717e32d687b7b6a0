// How long work tells how far it has come, and learns that it should stop.
#pragma once

#include <atomic>
#include <functional>
#include <string_view>

namespace relief {

/// Passed to long work. Both members may be empty. `report` is called from the thread that called the work, at most
/// a few hundred times, with the name of the phase and the share of it that is done, 0..1.
struct Progress {
  /// called with the phase and the share of it that is done, 0 to 1; may be empty
  std::function<void(std::string_view phase, double share)> report;
  const std::atomic<bool>* cancel = nullptr;  ///< set by another thread to end the work; may be null

  /// Reports, where somebody listens.
  void operator()(std::string_view phase, double share) const {
    if (report) report(phase, share);
  }
  /// Work that sees true returns Errc::Cancelled soon (under 0.1 s) and leaves nothing half done.
  [[nodiscard]] bool cancelled() const noexcept { return cancel != nullptr && cancel->load(std::memory_order_relaxed); }
};

}  // namespace relief
