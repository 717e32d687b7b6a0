#include "claims.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace relief::demo {

namespace {

/// Share of the scan's diagonal, in percent, within which a model counts as one of this scan.
constexpr double kFar = 1;
/// us of CPU time: half a tick, so that the other half is left to the device's driver and the system.
constexpr double kTick = 500;
/// Percent of all ticks: one in a thousand, which the hand does not feel.
constexpr double kMissed = 0.1;
/// ms at all that the hand can pull with, a tenth of a second: a hand that is held back pulls until it comes free.
constexpr double kStuck = 100;
/// Percent of the painted places that may be covered by what was painted later.
constexpr double kUnseen = 10;

double percent(std::uint64_t part, std::uint64_t whole) {
  return whole > 0 ? 100 * static_cast<double>(part) / static_cast<double>(whole) : 0;
}

Claim certified(const Facts& f) {
  Claim c{.id = "certified",
          .text = "The conversion is certified: every fibre meets the scan exactly once",
          .value = static_cast<double>(f.failed_conditions),
          .unit = "conditions",
          .measured = fmt::format("{} of 8 conditions fail", f.failed_conditions)};
  if (f.is_certified) {
    c.why = "the verifier refuses a conversion that was called certified";
    return c;
  }
  // A conversion without a certificate is no broken promise, but none is kept either.
  c.value = std::max(c.value, 1.0);
  c.measured = "no certificate";
  c.verdict = Verdict::Warn;
  c.why = f.not_certified.empty() ? "the scan could be converted in tolerant mode only" : f.not_certified;
  return c;
}

Claim distance(const Facts& f) {
  const double share = 100 * f.distance / f.diagonal;
  Claim c{.id = "distance",
          .text = "The model lies close to the scan everywhere",
          .value = share,
          .limit = kFar,
          .unit = "% of the scan's size",
          .measured = fmt::format("at most {:.2g} {} away ({:.2g} % of the scan's size)", f.distance, f.unit, share),
          .why = "a part of the scan is missing or far from the model"};
  if (!f.own_model) {
    c.verdict = Verdict::Warn;
    c.why = "the demo takes few slabs and one grid for all scans; relief convert chooses them for this one";
  }
  return c;
}

Claim touch(const Facts& f) {
  return {.id = "touch",
          .text = "Touch is computed in half of the 1 ms of a tick, or less",
          .value = f.tick_p99,
          .limit = kTick,
          .unit = "µs",
          .measured = fmt::format("99 % of {} ticks take at most {:.1f} µs of CPU", f.ticks, f.tick_p99),
          .why = "a tick took too long on this machine"};
}

Claim missed(const Facts& f) {
  Claim c{.id = "missed",
          .text = "The hand gets a force every millisecond",
          .value = percent(f.missed, f.ticks + f.missed),
          .limit = kMissed,
          .unit = "% of the ticks",
          .measured = fmt::format("{} of {} ticks missed", f.missed, f.ticks + f.missed),
          .why = fmt::format("{} ticks took 1 ms of CPU or more", f.slow_ticks)};
  // Where the ticks themselves were short, the system gave the processor to others.
  if (percent(f.slow_ticks, f.ticks) <= kMissed) {
    c.verdict = Verdict::Warn;
    c.why = fmt::format("the system gave the processor away: a loop beside it that does nothing missed {} of {}",
                        f.null_missed, f.null_ticks + f.null_missed);
  }
  return c;
}

Claim force(const Facts& f) {
  return {.id = "force",
          .text = "The force stays within what the device can give",
          .value = f.force_max,
          .limit = f.force_limit,
          .unit = "N",
          .measured = fmt::format("at most {:.2f} N", f.force_max),
          .why = "a force was commanded that the device cannot give"};
}

Claim stuck(const Facts& f) {
  return {.id = "stuck",
          .text = "The hand is never stuck",
          .value = 1e3 * f.stuck_for,
          .limit = kStuck,
          .unit = "ms",
          .measured = fmt::format("it pulled with all its force for at most {:.0f} ms", 1e3 * f.stuck_for),
          .why = "the tool was held back while the hand went on"};
}

/// A claim that two content hashes are equal.
Claim equal(std::string id, std::string text, bool holds, std::string_view what) {
  return {.id = std::move(id),
          .text = std::move(text),
          .value = holds ? 0.0 : 1.0,
          .unit = "differences",
          .measured = fmt::format("{} {}", what, holds ? "equal" : "different"),
          .why = "the content hashes differ"};
}

Claim repeated(const Facts& f) {
  Claim c{.id = "replay",
          .text = "The recording gives the same forces again, bit for bit",
          .value = static_cast<double>(f.recorded - std::min(f.recorded, f.repeated)),
          .unit = "ticks",
          .measured = fmt::format("{} of {} ticks are the same", f.repeated, f.recorded),
          .why = f.not_repeated};
  if (f.dropped) c.verdict = Verdict::Warn;
  return c;
}

Claim paint(const Facts& f) {
  Claim c{.id = "paint",
          .text = "Paint is seen where it was meant",
          .value = percent(f.painted - f.seen, f.painted),
          .limit = kUnseen,
          .unit = "% of the places",
          .measured = fmt::format("at {} of {} places", f.seen, f.painted),
          .why = "paint was laid elsewhere"};
  if (!f.own_model) {
    c.verdict = Verdict::Warn;
    c.why = "some places cannot be seen from the front, or lie where the scan has no surface";
  }
  return c;
}

/// All of them; `verdict` says what each is where its limit is passed.
std::vector<Claim> all_claims(const Facts& f) {
  std::vector<Claim> claims = {certified(f), distance(f), touch(f), missed(f), force(f), stuck(f)};
  claims.push_back(equal("undo", fmt::format("Undo takes all {} strokes back, and redo brings them again", f.strokes),
                         f.undo_equal && f.redo_equal, "content hashes before and after are"));
  claims.push_back(
      equal("saved", "What was saved is what was made", f.reload_equal, "the content hashes of file and memory are"));
  claims.push_back(repeated(f));
  claims.push_back(paint(f));
  return claims;
}

}  // namespace

std::string_view name(Verdict verdict) noexcept {
  return verdict == Verdict::Pass ? "PASS" : verdict == Verdict::Warn ? "WARN" : "FAIL";
}

std::vector<Claim> judge(const Facts& facts, const Limits& limits) {
  std::vector<Claim> claims = all_claims(facts);
  for (Claim& claim : claims) {
    if (const auto own = limits.find(claim.id); own != limits.end()) {
      claim.limit = own->second;
      claim.verdict = Verdict::Fail;  // who sets a limit takes no excuse
    }
    if (claim.value <= claim.limit) {
      claim.verdict = Verdict::Pass;
      claim.why.clear();
    } else if (claim.verdict == Verdict::Pass) {
      claim.verdict = Verdict::Fail;
    }
  }
  return claims;
}

std::string claim_ids() {
  std::string text;
  for (const Claim& claim : all_claims({})) text += (text.empty() ? "" : ", ") + claim.id;
  return text;
}

Status add_limit(Limits& limits, std::string_view text) {
  const std::size_t sign = text.find('=');
  const std::string id(text.substr(0, sign)), number(sign == std::string_view::npos ? "" : text.substr(sign + 1));
  const std::vector<Claim> claims = all_claims({});
  char* end = nullptr;
  const double value = std::strtod(number.c_str(), &end);
  if (std::ranges::find(claims, id, &Claim::id) == claims.end() || number.empty() || *end != '\0' ||
      !std::isfinite(value))
    return fail(Errc::InvalidArgument,
                fmt::format("{}: NAME=NUMBER is expected, for example touch=50; the names are {}.", text, claim_ids()));
  limits[id] = value;
  return {};
}

Verdict worst(const std::vector<Claim>& claims) noexcept {
  Verdict verdict = Verdict::Pass;
  for (const Claim& claim : claims) verdict = std::max(verdict, claim.verdict);
  return verdict;
}

std::string summary(const std::vector<Claim>& claims) {
  const auto held = std::ranges::count(claims, Verdict::Pass, &Claim::verdict);
  const Verdict verdict = worst(claims);
  if (verdict == Verdict::Pass) return fmt::format("PASS: all {} claims hold.", claims.size());
  return fmt::format("{}: {} of {} claims hold; {}.", name(verdict), held, claims.size(),
                     verdict == Verdict::Warn ? "the others depend on the scan or the machine" : "see FAIL below");
}

}  // namespace relief::demo
