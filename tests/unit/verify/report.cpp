#include "report.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <set>
#include <vector>

namespace relief::verify {
namespace {

struct Row {
  std::string way, fails, sentence;
  std::size_t first;  ///< of the conditions that fail
};
std::vector<Row>& rows() {
  static std::vector<Row> all;
  return all;
}

class Report final : public ::testing::Environment {
 public:
  void TearDown() override {
    const char* file = std::getenv("RELIEF_VERIFIER_REPORT");
    if (file == nullptr) return;
    std::ranges::stable_sort(rows(), {}, &Row::first);
    std::string table = "| what is broken | fails | the verifier's first sentence about it |\n|---|---|---|\n";
    for (const Row& row : rows()) table += "| " + row.way + " | " + row.fails + " | " + row.sentence + " |\n";
    std::ofstream(file) << table;
    std::ifstream page(RELIEF_SOURCE_DIR "/docs/evidence/verifier.md");
    const std::string text{std::istreambuf_iterator<char>(page), {}};
    EXPECT_NE(text.find(table), std::string::npos)
        << "docs/evidence/verifier.md does not hold the table that is now in " << file;
  }
};

/// What is listed of slabs is also among those that are named, and the other way round where all is listed.
void expect_named(const Certificate& c) {
  std::array<std::set<std::uint32_t>, kConditionCount> listed;
  for (const Failure& f : c.failures) {
    const auto k = static_cast<std::size_t>(f.condition);
    if (f.condition == Condition::C2) continue;  // a fibre
    if (f.a != kNothing) listed[k].insert(f.a);
    if (k < 5 && f.b != kNothing) listed[k].insert(f.b);
  }
  for (std::size_t k = 0; k < kConditionCount; ++k) {
    const auto condition = static_cast<Condition>(k);
    const std::vector<std::uint32_t> named = c.failing(condition);
    EXPECT_TRUE(std::ranges::is_sorted(named));
    EXPECT_TRUE(std::ranges::includes(named, listed[k])) << name(condition);
    EXPECT_EQ(named.empty(), c.failure_count[k] == 0 || (k != 2 && listed[k].empty())) << name(condition);
    if ((k == 1 || k == 5 || k == 6) && c.failure_count[k] <= 100) {
      EXPECT_TRUE(std::ranges::equal(named, listed[k])) << name(condition);
    }
  }
}

}  // namespace

Certificate reported(std::string_view way, Certificate certificate) {
  static const auto* const registered = ::testing::AddGlobalTestEnvironment(new Report);
  static_cast<void>(registered);
  expect_named(certificate);
  Row row{std::string(way), {}, "(none)", kConditionCount};
  for (std::size_t k = 0; k < certificate.asked(); ++k) {
    if (certificate.failure_count[k] == 0) continue;
    const auto condition = static_cast<Condition>(k);
    row.first = std::min(row.first, k);
    row.fails += (row.fails.empty() ? "" : ", ") + std::string(name(condition));
    if (row.first != k) continue;
    const auto said = std::ranges::find(certificate.failures, condition, &Failure::condition);
    if (said != certificate.failures.end()) row.sentence = said->what;
  }
  rows().push_back(std::move(row));
  return certificate;
}

}  // namespace relief::verify
