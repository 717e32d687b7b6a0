#include "report.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>
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
    std::ifstream page(RELIEF_SOURCE_DIR "/docs/verifier.md");
    const std::string text{std::istreambuf_iterator<char>(page), {}};
    EXPECT_NE(text.find(table), std::string::npos)
        << "docs/verifier.md does not hold the table that is now in " << file;
  }
};

}  // namespace

Certificate reported(std::string_view way, Certificate certificate) {
  static const auto* const registered = ::testing::AddGlobalTestEnvironment(new Report);
  static_cast<void>(registered);
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
