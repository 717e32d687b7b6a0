// How far a command has come, for people: one line on a terminal, a line per phase elsewhere.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>

namespace relief::cli {

/// How far a whole command has come, of the phases that its work reports. Never falls; a phase that is not known to
/// belong to the command does not move it.
class OverallShare {
 public:
  explicit OverallShare(std::string_view command) : command_(command) {}
  /// 0..1, once this phase has come so far.
  double add(std::string_view phase, double share);
  [[nodiscard]] double value() const { return value_; }

 private:
  std::string command_;
  double value_ = 0;
};

/// What a phase of a command is called for people: "sample" of convert is "sampling".
[[nodiscard]] std::string_view shown_name(std::string_view command, std::string_view phase);

/// Where the lines go.
enum class ProgressStyle : std::uint8_t { None, Overwritten, LinePerPhase };

class ProgressLine {
 public:
  ProgressLine(std::string_view command, ProgressStyle style);
  void show(std::string_view phase, double share);
  /// Takes the line off the terminal, so that something else can be written.
  void clear();

 private:
  [[nodiscard]] std::string remaining(double seconds) const;
  std::string command_;
  ProgressStyle style_;
  OverallShare overall_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::string phase_, line_;
  bool shown_ = false;
};

}  // namespace relief::cli
