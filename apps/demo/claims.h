// What the demo promises of a run, and whether it was kept.
#pragma once

#include <relief/base/error.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace relief::demo {

/// Warn: the limit was passed, for a reason that lies in the scan or in the machine.
enum class Verdict : std::uint8_t { Pass, Warn, Fail };
/// "PASS", "WARN", "FAIL".
[[nodiscard]] std::string_view name(Verdict verdict) noexcept;

/// One promise. It is kept where `value` is at most `limit`.
struct Claim {
  std::string id = {};    ///< one word, as --limit takes it
  std::string text = {};  ///< a sentence without a full stop
  double value = 0, limit = 0;
  std::string unit = {};      ///< of both
  std::string measured = {};  ///< the value in words, with its unit
  Verdict verdict = Verdict::Pass;
  std::string why = {};  ///< of Warn and Fail: a sentence without a full stop
};

/// What was measured in one run.
struct Facts {
  bool is_certified = false;
  std::string not_certified;            ///< why not, a sentence; may be empty
  std::size_t failed_conditions = 0;    ///< that the verifier refused, of C0 to C7
  double distance = 0, diagonal = 1;    ///< model units: greatest distance of scan and model; size of the scan
  std::string unit = "mm";              ///< of both
  double tick_p99 = 0;                  ///< us of CPU time
  std::uint64_t ticks = 0, missed = 0;  ///< periods of 1 ms, and those that were skipped
  std::uint64_t null_ticks = 0, null_missed = 0;  ///< the same of a loop beside it that does nothing
  std::uint64_t slow_ticks = 0;                   ///< whose own CPU time was 1 ms or more
  double force_max = 0, force_limit = 0;          ///< N; the greatest, and that of the device
  double stuck_for = 0;                           ///< s, the longest time at all that the hand can pull with
  std::uint64_t strokes = 0;
  bool undo_equal = false, redo_equal = false;  ///< content hashes after all strokes were undone, and done again
  bool reload_equal = false;                    ///< content hash of the file read back
  std::uint64_t recorded = 0, repeated = 0;     ///< ticks; those that gave the same forces again, bit for bit
  std::string not_repeated;                     ///< why not all; empty where all did
  bool dropped = false;                         ///< the recording lacks ticks, for the disk or the machine was slow
  std::size_t painted = 0, seen = 0;            ///< places that were to be painted; those whose colour is seen
  bool own_model = true;                        ///< not a scan of the user's
};

/// Other limits by Claim::id, in the claim's unit.
using Limits = std::map<std::string, double, std::less<>>;

/// The claims in the order in which people read them. Beyond one of `limits` a claim fails, whatever the reason.
[[nodiscard]] std::vector<Claim> judge(const Facts& facts, const Limits& limits = {});
/// What `--limit ID=VALUE` may name, with commas between.
[[nodiscard]] std::string claim_ids();
/// Adds "ID=VALUE" to the limits. Error: InvalidArgument.
[[nodiscard]] Status add_limit(Limits& limits, std::string_view text);

/// The worst of all.
[[nodiscard]] Verdict worst(const std::vector<Claim>& claims) noexcept;
/// "PASS: all 9 claims hold." or what does not.
[[nodiscard]] std::string summary(const std::vector<Claim>& claims);

}  // namespace relief::demo
