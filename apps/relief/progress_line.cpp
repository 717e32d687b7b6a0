#include "progress_line.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdio>

namespace relief::cli {

namespace {

struct Phase {
  std::string_view command, name, shown;
  double share;  ///< of the command's time
};

/// In the order in which a command does them, the shares of one command adding up to 1. Those of convert are the wall
/// clock's on the pumpkin, the bunny and the ogre, two threads. Other scans differ, and their remaining time with them.
constexpr std::array kPhases = {
    Phase{"convert", "replaced", "reading", 0},
    Phase{"convert", "import", "reading", 0.03},
    Phase{"convert", "repair", "preparing", 0},
    Phase{"convert", "remesh", "rebuilding", 0.02},
    Phase{"convert", "shell", "preparing", 0.05},
    Phase{"convert", "reduce", "building slabs", 0.55},
    Phase{"convert", "sample", "sampling", 0.14},
    Phase{"convert", "measure", "measuring", 0.11},
    Phase{"convert", "colour", "colouring", 0.04},
    Phase{"convert", "verify", "verifying", 0.05},
    Phase{"convert", "save", "writing", 0.01},
    Phase{"convert", "export", "writing", 0},
    Phase{"verify", "read", "reading", 0},
    Phase{"verify", "open", "reading", 0.05},
    Phase{"verify", "import", "reading", 0.05},
    Phase{"verify", "verify", "verifying", 0.70},
    Phase{"verify", "compare", "comparing samples", 0.20},
    Phase{"refine", "replaced", "reading", 0},
    Phase{"refine", "open", "reading", 0.05},
    Phase{"refine", "remesh", "rebuilding", 0.02},
    Phase{"refine", "shell", "preparing", 0.05},
    Phase{"refine", "reduce", "building slabs", 0.50},
    Phase{"refine", "sample", "sampling", 0.15},
    Phase{"refine", "layers", "moving layers", 0.10},
    Phase{"refine", "measure", "measuring", 0.10},
    Phase{"refine", "copy", "copying", 0.03},
    Phase{"render", "open", "reading", 0.05},
    Phase{"render", "import", "reading", 0.05},
    Phase{"render", "render", "drawing", 0.80},
    Phase{"render", "save", "writing", 0.10},
    Phase{"sculpt", "replaced", "reading", 0},
    Phase{"sculpt", "copy", "copying", 0.05},
    Phase{"sculpt", "open", "reading", 0.05},
    Phase{"sculpt", "recording", "reading", 0},
    Phase{"sculpt", "sculpt", "sculpting", 0.90},
    Phase{"touch", "open", "reading", 0.05},
    Phase{"touch", "recording", "reading", 0.05},
    Phase{"touch", "touch", "touching", 0.90},
    Phase{"export", "open", "reading", 0.50},
    Phase{"export", "export", "writing", 0.50},
    Phase{"sample", "sample", "making", 0.70},
    Phase{"sample", "export", "writing", 0.30},
};

const Phase* phase_named(std::string_view command, std::string_view name) {
  const auto* const found =
      std::ranges::find_if(kPhases, [&](const Phase& p) { return p.command == command && p.name == name; });
  return found == kPhases.end() ? nullptr : found;
}

/// Whether a command has phases of which the whole is known.
bool has_plan(std::string_view command) {
  return std::ranges::find(kPhases, command, &Phase::command) != kPhases.end();
}

constexpr double kFirstEstimate = 2;        // s: until then too little is known to say what is left
constexpr double kLeastForEstimate = 0.02;  // of the whole: below it the estimate jumps by more than half

}  // namespace

double OverallShare::add(std::string_view phase, double share) {
  share = std::clamp(share, 0.0, 1.0);
  // A command of one phase says itself how far it is.
  if (!has_plan(command_)) return value_ = std::max(value_, share);
  double before = 0;
  for (const Phase& p : kPhases) {
    if (p.command != command_) continue;
    if (p.name == phase) {
      value_ = std::max(value_, before + p.share * share);
      break;
    }
    before += p.share;
  }
  return value_;
}

std::string_view shown_name(std::string_view command, std::string_view phase) {
  const Phase* known = phase_named(command, phase);
  return known == nullptr ? phase : known->shown;
}

ProgressLine::ProgressLine(std::string_view command, ProgressStyle style)
    : command_(command), style_(style), overall_(command) {}

std::string ProgressLine::remaining(double seconds) const {
  const double done = overall_.value();
  if (seconds < kFirstEstimate || done < kLeastForEstimate) return {};
  const double left = seconds * (1 - done) / done;
  if (left >= 90) return fmt::format(", about {:.0f} min left", left / 60);
  return fmt::format(", about {:.0f} s left", left);
}

void ProgressLine::show(std::string_view phase, double share) {
  if (style_ == ProgressStyle::None) return;
  const double overall = overall_.add(phase, share);
  if (style_ == ProgressStyle::LinePerPhase && phase == phase_) return;
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  std::string line =
      fmt::format("{}: {} {:.0f} %{}", command_, shown_name(command_, phase), 100 * overall, remaining(seconds));
  phase_ = phase;
  if (line == line_) return;
  line_ = std::move(line);
  std::fputs((style_ == ProgressStyle::LinePerPhase ? "relief: " + line_ + "\n" : "\r\033[K" + line_).c_str(), stderr);
  shown_ = style_ == ProgressStyle::Overwritten;
}

void ProgressLine::clear() {
  if (shown_) std::fputs("\r\033[K", stderr);
  shown_ = false;
  line_.clear();
}

}  // namespace relief::cli
