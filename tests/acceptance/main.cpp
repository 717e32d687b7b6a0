// acceptance ID... | all [--long] [--part K/N] [--json FILE] [--kept FOLDER]: runs acceptance tests of touch and prints
// each figure beside its threshold. --json writes them. --kept also fails where the short form's figures or thresholds
// are others than those of the newest safety-*.json in FOLDER, of which docs/evidence/safety.md is made. Exit 0: all
// hold; 1: a figure fails; 2: wrong usage; 77: nothing failed, but a test was skipped.
#include "acceptance/acceptance.h"

#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>

namespace relief::acceptance {
namespace {

constexpr std::array kTests = {
    Test{"S1", "plant self-test", plant},
    Test{"S2", "no limit cycles", limit_cycles},
    Test{"S3", "energy at the hand", human_port},
    Test{"S4", "no energy from closed paths", closed_ways},
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

std::string threshold(Figure::Bound bound, double limit, const std::string& unit) {
  if (bound == Figure::Bound::None) return "reported";
  return (bound == Figure::Bound::AtMost ? "<= " : ">= ") + written(limit, unit);
}
std::string threshold(const Figure& f) { return threshold(f.bound, f.limit, f.unit); }

const char* verdict(const Figure& f) {
  if (f.bound == Figure::Bound::None) return "";
  return f.holds() ? "holds" : "FAILS";
}

/// One row per figure: test, title, figure, value, unit, and where it is judged `at_most` or `at_least`, and `holds`. A
/// test that was skipped has a row with `skipped`, which says why.
void write_json(const std::string& path, bool in_long_form, const std::vector<std::pair<const Test*, Report>>& done) {
  using nlohmann::ordered_json;
  ordered_json rows = ordered_json::array();
  for (const auto& [test, report] : done) {
    for (const Figure& f : report.figures()) {
      ordered_json row = {
          {"test", test->id}, {"title", test->title}, {"figure", f.what}, {"value", f.value}, {"unit", f.unit}};
      if (f.bound != Figure::Bound::None) {
        row[f.bound == Figure::Bound::AtMost ? "at_most" : "at_least"] = f.limit;
        row["holds"] = f.holds();
      }
      rows.push_back(std::move(row));
    }
    for (const std::string& why : report.skips())
      rows.push_back({{"test", test->id}, {"title", test->title}, {"skipped", why}});
  }
  std::ofstream(path) << ordered_json{{"form", in_long_form ? "long" : "short"}, {"rows", rows}}.dump(1) << "\n";
}

/// The thresholds of a test's figures by their names. A figure that is only reported has none.
using Thresholds = std::map<std::string, std::set<std::string>>;

Thresholds thresholds(const Report& report) {
  Thresholds all;
  for (const Figure& f : report.figures()) {
    std::set<std::string>& of = all[f.what];
    if (f.bound != Figure::Bound::None) of.insert(threshold(f));
  }
  return all;
}
/// The same of the rows of a kept result.
Thresholds thresholds(const nlohmann::json& rows, std::string_view id) {
  Thresholds all;
  for (const auto& row : rows) {
    if (row["test"] != id || !row.contains("figure")) continue;
    std::set<std::string>& of = all[row["figure"]];
    for (const auto& [key, bound] : {std::pair{"at_most", Figure::Bound::AtMost}, {"at_least", Figure::Bound::AtLeast}})
      if (row.contains(key)) of.insert(threshold(bound, row[key], row["unit"]));
  }
  return all;
}
/// Figures that `one` judges and `other` lacks or judges otherwise. What is judged in some runs only, because a run may
/// not come to it, is passed over where the other one reports it.
std::vector<std::string> only_in(const Thresholds& one, const Thresholds& other) {
  std::vector<std::string> names;
  for (const auto& [what, of] : one) {
    const auto found = other.find(what);
    const bool reported = found != other.end() && found->second.empty();
    if (!of.empty() && !reported && (found == other.end() || found->second != of))
      names.push_back(fmt::format("{} {}", what, *of.begin()));
  }
  return names;
}

/// The newest safety-*.json of a folder: names end in the date.
std::filesystem::path newest_result(const std::filesystem::path& folder) {
  std::filesystem::path newest;
  const auto date = [](const std::filesystem::path& file) {
    const std::string stem = file.stem().string();
    return stem.substr(stem.size() - std::min<std::size_t>(stem.size(), 10));
  };
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (entry.path().filename().string().starts_with("safety-") &&
        (newest.empty() || date(newest) < date(entry.path())))
      newest = entry.path();
  return newest;
}

/// Whether the kept result judges the same figures by the same thresholds; prints what it does not. Tests that were
/// skipped in part are not compared.
bool as_kept(const std::filesystem::path& folder, const std::vector<std::pair<const Test*, Report>>& done) {
  const std::filesystem::path file = newest_result(folder);
  if (file.empty()) {
    fmt::print("  {} holds no safety-*.json; make one with ./dev bench results safety\n", folder.string());
    return false;
  }
  const nlohmann::json kept = nlohmann::json::parse(std::ifstream(file));
  bool same = true;
  for (const auto& [test, report] : done) {
    if (!report.skips().empty()) continue;
    const Thresholds now = thresholds(report), then = thresholds(kept["rows"], test->id);
    for (const std::string& figure : only_in(now, then))
      fmt::print("  {}: not so in {}: {}\n", test->id, file.filename().string(), figure);
    // A part has some of the figures only.
    const auto missing = report.part().of == 1 ? only_in(then, now) : std::vector<std::string>{};
    for (const std::string& figure : missing) fmt::print("  {}: only there: {}\n", test->id, figure);
    if (only_in(now, then).empty() && missing.empty()) continue;
    fmt::print("  write it again with ./dev bench results safety\n");
    same = false;
  }
  return same;
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
  std::string json, kept;
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
    } else if (word == "--json" && k + 1 < count) {
      json = words[++k];
    } else if (word == "--kept" && k + 1 < count) {
      kept = words[++k];
    } else {
      wanted.clear();
      break;
    }
  }
  if (wanted.empty()) {
    fmt::print(stderr,
               "acceptance: name tests from S1 to S23, or all; --long; --part K/N; --json FILE; --kept FOLDER\n");
    return 2;
  }
  std::vector<std::pair<const Test*, Report>> done;
  for (const Test* test : wanted) {
    fmt::print("{} {}\n", test->id, test->title);
    Report report(in_long_form, part);
    test->run(report);
    done.emplace_back(test, std::move(report));
  }
  if (!json.empty()) write_json(json, in_long_form, done);
  if (!std::all_of(done.begin(), done.end(), [](const auto& d) { return d.second.passed(); })) return 1;
  if (!kept.empty() && !in_long_form && !as_kept(kept, done)) return 1;
  const bool skipped = std::any_of(done.begin(), done.end(), [](const auto& d) { return !d.second.skips().empty(); });
  return skipped ? 77 : 0;
}
