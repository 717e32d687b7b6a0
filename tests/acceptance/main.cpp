// acceptance ID... | all [--long] [--part K/N] [--markdown FILE]: runs acceptance tests of touch and prints each figure
// beside its threshold. Exit 0: all hold; 1: a figure fails; 2: wrong usage; 77: nothing failed, but a test was
// skipped.
#include "acceptance/acceptance.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>

namespace relief::acceptance {
namespace {

constexpr std::array kTests = {
    Test{"S1", "plant self-test", plant},
    Test{"S2", "no limit cycles", limit_cycles},
    Test{"S3", "energy at the hand", human_port},
    Test{"S4", "no energy from closed ways", closed_ways},
    Test{"S5", "continuous force over smooth surfaces", force_continuity},
    Test{"S6", "borders and edits", borders_and_edits},
    Test{"S7", "sculpting under the tip", sculpting},
    Test{"S8", "no pops", pops},
    Test{"S9", "friction", friction},
    Test{"S10", "stiffness and damping recovered", identification},
    Test{"S11", "texture", texture},
    Test{"S12", "the safe state", safe_state},
    Test{"S13", "start and resume", start_and_resume},
    Test{"S14", "limits on every command", limits},
    Test{"S15", "what stands still", standstill},
    Test{"S16", "work per tick", work_per_tick},
    Test{"S17", "deadlines", deadlines},
    Test{"S18", "nothing forbidden in a tick", forbidden_calls},
    Test{"S19", "determinism", determinism},
    Test{"S20", "recorded human motion", recorded_motion},
    Test{"S21", "ground truth", ground_truth},
    Test{"S22", "hand-over of snapshots", hand_over},
    Test{"S23", "contact as the god-object", god_object},
};

/// "1.5e-3 m", whole numbers as they are.
std::string written(double value, const std::string& unit) {
  return fmt::format("{:.4g}{}{}", value, unit.empty() ? "" : " ", unit);
}

std::string threshold(const Figure& f) {
  if (f.bound == Figure::Bound::None) return "reported";
  return (f.bound == Figure::Bound::AtMost ? "<= " : ">= ") + written(f.limit, f.unit);
}

const char* verdict(const Figure& f) {
  if (f.bound == Figure::Bound::None) return "";
  return f.holds() ? "holds" : "FAILS";
}

void write_markdown(const std::string& path, const std::vector<std::pair<const Test*, Report>>& done) {
  std::ofstream out(path);
  out << "| test | figure | reached | threshold | |\n|---|---|---|---|---|\n";
  for (const auto& [test, report] : done) {
    for (const Figure& f : report.figures())
      out << fmt::format("| {} | {}: {} | {} | {} | {} |\n", test->id, test->title, f.what, written(f.value, f.unit),
                         threshold(f), verdict(f));
    for (const std::string& why : report.skips())
      out << fmt::format("| {} | {} | skipped: {} | | |\n", test->id, test->title, why);
  }
}

}  // namespace

bool Figure::holds() const noexcept {
  if (bound == Bound::None) return true;
  return bound == Bound::AtMost ? value <= limit : value >= limit;
}

void Report::add(Figure figure) {
  fmt::print("  {:<64} {:>16}   {:<18} {}\n", figure.what, written(figure.value, figure.unit), threshold(figure),
             verdict(figure));
  std::fflush(stdout);
  figures_.push_back(std::move(figure));
}
void Report::at_most(std::string what, double value, double limit, std::string unit) {
  add({std::move(what), value, Figure::Bound::AtMost, limit, std::move(unit)});
}
void Report::at_least(std::string what, double value, double limit, std::string unit) {
  add({std::move(what), value, Figure::Bound::AtLeast, limit, std::move(unit)});
}
void Report::shown(std::string what, double value, std::string unit) {
  add({std::move(what), value, Figure::Bound::None, 0, std::move(unit)});
}
void Report::skipped(std::string why) {
  fmt::print("  skipped: {}\n", why);
  skips_.push_back(std::move(why));
}
bool Report::passed() const noexcept {
  return (!figures_.empty() || !skips_.empty()) &&
         std::all_of(figures_.begin(), figures_.end(), [](const Figure& f) { return f.holds(); });
}

}  // namespace relief::acceptance

int main(int count, char** words) {
  using namespace relief::acceptance;
  bool in_long_form = std::getenv("RELIEF_SOAK") != nullptr;
  std::string markdown;
  Part part;
  std::vector<const Test*> wanted;
  for (int k = 1; k < count; ++k) {
    const std::string_view word = words[k];
    const auto named = std::find_if(kTests.begin(), kTests.end(), [&](const Test& t) { return t.id == word; });
    if (named != kTests.end()) {
      wanted.push_back(&*named);
    } else if (word == "all") {
      for (const Test& t : kTests) wanted.push_back(&t);
    } else if (word == "--long") {
      in_long_form = true;
    } else if (word == "--part" && k + 1 < count && std::sscanf(words[k + 1], "%d/%d", &part.number, &part.of) == 2 &&
               part.number >= 1 && part.number <= part.of) {
      ++k;
    } else if (word == "--markdown" && k + 1 < count) {
      markdown = words[++k];
    } else {
      wanted.clear();
      break;
    }
  }
  if (wanted.empty()) {
    fmt::print(stderr, "acceptance: name tests from S1 to S23, or all; --long; --part K/N; --markdown FILE\n");
    return 2;
  }
  std::vector<std::pair<const Test*, Report>> done;
  for (const Test* test : wanted) {
    fmt::print("{} {}\n", test->id, test->title);
    Report report(in_long_form, part);
    test->run(report);
    done.emplace_back(test, std::move(report));
  }
  if (!markdown.empty()) write_markdown(markdown, done);
  if (!std::all_of(done.begin(), done.end(), [](const auto& d) { return d.second.passed(); })) return 1;
  const bool skipped = std::any_of(done.begin(), done.end(), [](const auto& d) { return !d.second.skips().empty(); });
  return skipped ? 77 : 0;
}
