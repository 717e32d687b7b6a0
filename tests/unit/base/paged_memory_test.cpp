#include "support/resident.h"

#include <relief/base/paged_memory.h>

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <numeric>
#include <string>
#include <thread>
#include <vector>

namespace relief {
namespace {

using testing::resident_of_files;

constexpr std::size_t kMiB = std::size_t{1} << 20;

std::vector<std::span<std::uint32_t>> pieces(PagedMemory& memory, std::size_t count) {
  std::vector<std::span<std::uint32_t>> made;
  for (std::size_t k = 0; k < count; ++k) {
    made.push_back(memory.zeros<std::uint32_t>(kMiB / 4));
    std::iota(made.back().begin(), made.back().end(), static_cast<std::uint32_t>(k) << 20U);
    memory.rest(kMiB);
  }
  return made;
}

void expect_whole(const std::vector<std::span<std::uint32_t>>& made, PagedMemory& memory) {
  for (std::size_t k = 0; k < made.size(); ++k) {
    std::size_t wrong = 0;
    for (std::size_t at = 0; at < made[k].size(); ++at) wrong += made[k][at] != (k << 20U) + at;
    EXPECT_EQ(wrong, 0U) << k;
    memory.rest(kMiB);
  }
}

TEST(PagedMemory, KeepsToOrdinaryMemoryUpToItsLimit) {
  PagedMemory memory(64 * kMiB);
  expect_whole(pieces(memory, 48), memory);
  EXPECT_EQ(memory.file_bytes(), 0U);
}

TEST(PagedMemory, BeyondItsLimitLittleIsResidentAndNothingIsLost) {
  PagedMemory memory(8 * kMiB);
  const std::size_t before = resident_of_files();
  const auto made = pieces(memory, 96);
  EXPECT_GE(memory.file_bytes(), 80 * kMiB);
  EXPECT_LT(resident_of_files(), before + 16 * kMiB);
  expect_whole(made, memory);
  EXPECT_LT(resident_of_files(), before + 16 * kMiB);
}

TEST(PagedMemory, ThreadsMayWriteWhileOthersRest) {
  PagedMemory memory(0);
  std::vector<std::vector<std::span<std::uint32_t>>> made(4);
  {
    std::vector<std::jthread> threads;
    for (auto& mine : made) threads.emplace_back([&] { mine = pieces(memory, 12); });
  }
  for (const auto& mine : made) expect_whole(mine, memory);
}

TEST(PagedMemory, LeavesNoFileInItsFolder) {
  std::string folder = ::testing::TempDir() + "relief-paged-XXXXXX";
  ASSERT_NE(mkdtemp(folder.data()), nullptr);
  const char* const old = std::getenv("TMPDIR");
  const std::string before = old != nullptr ? old : "";
  setenv("TMPDIR", folder.c_str(), 1);
  {
    PagedMemory memory(0);
    expect_whole(pieces(memory, 4), memory);
    EXPECT_GT(memory.file_bytes(), 0U);
    EXPECT_TRUE(std::filesystem::is_empty(folder));
  }
  // A folder that is not there: another one is taken.
  std::filesystem::remove(folder);
  PagedMemory memory(0);
  expect_whole(pieces(memory, 4), memory);
  EXPECT_GT(memory.file_bytes(), 0U);
  old != nullptr ? setenv("TMPDIR", before.c_str(), 1) : unsetenv("TMPDIR");
}

TEST(PagedMemory, WhereNoFileMayBeWrittenItIsOrdinaryMemory) {
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit small = {kMiB, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  PagedMemory memory(0);
  expect_whole(pieces(memory, 12), memory);
  EXPECT_EQ(memory.file_bytes(), 0U);
  setrlimit(RLIMIT_FSIZE, &before);
}

}  // namespace
}  // namespace relief
