#include <relief/base/atomic_file.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

namespace relief {
namespace {

namespace fs = std::filesystem;

class AtomicFileTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = ::testing::TempDir() + "relief-atomic-XXXXXX";
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { fs::remove_all(folder_); }

  [[nodiscard]] fs::path path(const char* name) const { return folder_ / name; }
  [[nodiscard]] std::vector<std::string> names() const {
    std::vector<std::string> found;
    for (const auto& entry : fs::directory_iterator(folder_)) found.push_back(entry.path().filename().string());
    std::sort(found.begin(), found.end());
    return found;
  }
  static std::string read(const fs::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  static void put(const fs::path& file, std::string_view text) { std::ofstream(file, std::ios::binary) << text; }

 private:
  fs::path folder_;
};

using Names = std::vector<std::string>;

TEST_F(AtomicFileTest, AppearsWholeAtCommit) {
  auto file = AtomicFile::create(path("a.ply"));
  ASSERT_TRUE(file);
  ASSERT_TRUE(file->write("one "));
  EXPECT_FALSE(fs::exists(path("a.ply")));
  ASSERT_TRUE(file->write("two"));
  ASSERT_TRUE(file->commit());
  EXPECT_EQ(read(path("a.ply")), "one two");
  EXPECT_EQ(names(), Names{"a.ply"});
}

TEST_F(AtomicFileTest, WithoutCommitTheTargetStaysAndNothingIsLeft) {
  put(path("a.ply"), "old");
  {
    auto file = AtomicFile::create(path("a.ply"));
    ASSERT_TRUE(file);
    ASSERT_TRUE(file->write(std::string(300'000, 'x')));
    EXPECT_EQ(read(path("a.ply")), "old");
  }
  EXPECT_EQ(read(path("a.ply")), "old");
  EXPECT_EQ(names(), Names{"a.ply"});
}

TEST_F(AtomicFileTest, KeepsEveryByteWhateverTheBlocks) {
  std::string whole;
  auto file = AtomicFile::create(path("a.bin"));
  ASSERT_TRUE(file);
  for (const std::size_t size : {1U, 65535U, 65536U, 65537U, 0U, 7U, 400'000U}) {
    std::string block(size, '\0');
    for (std::size_t k = 0; k < size; ++k) block[k] = static_cast<char>(k * 31U + size);
    ASSERT_TRUE(file->write(block));
    whole += block;
  }
  ASSERT_TRUE(file->commit());
  EXPECT_EQ(read(path("a.bin")), whole);
}

TEST_F(AtomicFileTest, KeepsTheRightsAndTheLinkOfWhatItReplaces) {
  put(path("real.ply"), "old");
  fs::permissions(path("real.ply"), fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_read);
  fs::create_symlink("real.ply", path("link.ply"));
  auto file = AtomicFile::create(path("link.ply"));
  ASSERT_TRUE(file);
  ASSERT_TRUE(file->write("new"));
  ASSERT_TRUE(file->commit());
  EXPECT_TRUE(fs::is_symlink(path("link.ply")));
  EXPECT_EQ(read(path("real.ply")), "new");
  EXPECT_EQ(fs::status(path("real.ply")).permissions(),
            fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_read);
}

TEST_F(AtomicFileTest, WhatAKilledRunLeftDoesNoHarm) {
  put(path("a.ply.aBcDeF.part"), "left");
  auto first = AtomicFile::create(path("a.ply"));
  auto second = AtomicFile::create(path("a.ply"));
  ASSERT_TRUE(first && second);
  ASSERT_TRUE(first->write("first"));
  ASSERT_TRUE(second->write("second"));
  ASSERT_TRUE(second->commit());
  ASSERT_TRUE(first->commit());
  EXPECT_EQ(read(path("a.ply")), "first");
  EXPECT_EQ(read(path("a.ply.aBcDeF.part")), "left");
}

TEST_F(AtomicFileTest, ErrorsNameTheTargetInOneLine) {
  for (const char* name : {"gone/a.ply", "gone\n/a.ply"}) {
    const auto file = AtomicFile::create(path(name));
    ASSERT_FALSE(file);
    EXPECT_EQ(file.error().code, Errc::Io);
    EXPECT_NE(file.error().message.find("a.ply"), std::string::npos);
    EXPECT_EQ(file.error().message.find('\n'), std::string::npos);
  }
  fs::create_directory(path("folder"));
  const auto file = AtomicFile::create(path("folder"));
  ASSERT_FALSE(file);
  EXPECT_NE(file.error().message.find("folder"), std::string::npos);
  EXPECT_EQ(names(), Names{"folder"});
}

// /dev/full answers every write as a full disk does.
TEST_F(AtomicFileTest, FullDiskIsAnErrorAndADeviceIsNotReplaced) {
  const fs::path device = "/dev/full";
  if (!fs::is_character_file(device)) GTEST_SKIP() << "skipped: no /dev/full";
  auto file = AtomicFile::create(device);
  ASSERT_TRUE(file);
  ASSERT_TRUE(file->write("x"));
  const Status status = file->commit();
  ASSERT_FALSE(status);
  EXPECT_NE(status.error().message.find("/dev/full"), std::string::npos);
  EXPECT_TRUE(fs::is_character_file(device));
}

}  // namespace
}  // namespace relief
