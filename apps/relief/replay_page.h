// A recording as one page.
#pragma once

#include <relief/base/error.h>
#include <relief/session/replay.h>

#include <filesystem>

namespace relief::cli {

/// HTML with drawings inside it: force, depth and work over the ticks, a histogram of compute time, the worst ticks.
/// Errors: Io, Corrupt.
[[nodiscard]] Status write_replay_page(Replay& replay, const std::filesystem::path& file);

}  // namespace relief::cli
