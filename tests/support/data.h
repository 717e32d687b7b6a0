// The one way for a test to reach scans that are not part of the project.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string_view>

namespace relief::testing {

/// The folder with test scans: the environment's RELIEF_TEST_DATA, else what the build was configured with.
inline std::filesystem::path data_folder() {
  const char* chosen = std::getenv("RELIEF_TEST_DATA");
  return chosen != nullptr ? chosen : RELIEF_TEST_DATA;
}

}  // namespace relief::testing

/// Declares `name` as the path of a test file, or skips the test with a word when the folder is missing.
#define RELIEF_DATA_FILE(name, relative)                                            \
  const std::filesystem::path name = ::relief::testing::data_folder() / (relative); \
  if (!std::filesystem::exists(::relief::testing::data_folder())) GTEST_SKIP() << "skipped: no test data"
