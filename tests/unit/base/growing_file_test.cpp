#include <relief/base/growing_file.h>

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

namespace relief {
namespace {

namespace fs = std::filesystem;

class GrowingFileTest : public ::testing::Test {
 protected:
  GrowingFileTest() : file_(fs::temp_directory_path() / ("relief-growing-" + std::to_string(::getpid()))) {}
  ~GrowingFileTest() override { fs::remove(file_); }
  std::string read() const {
    std::ostringstream text;
    text << std::ifstream(file_).rdbuf();
    return text.str();
  }
  fs::path file_;
};

TEST_F(GrowingFileTest, IsThereAtOnceAndGrows) {
  std::ofstream(file_) << "what was there before\n";
  auto file = GrowingFile::create(file_);
  ASSERT_TRUE(file) << file.error().message;
  EXPECT_EQ(read(), "");
  ASSERT_TRUE(file->write("a\nb\n"));
  EXPECT_EQ(file->lines(), 0U);
  ASSERT_TRUE(file->flush());
  EXPECT_EQ(read(), "a\nb\n");
  EXPECT_EQ(file->lines(), 2U);
  const std::string line(999, 'x');
  for (int k = 0; k < 200; ++k) ASSERT_TRUE(file->write(line + '\n'));
  EXPECT_GT(file->lines(), 130U) << "it flushes now and then";
  EXPECT_EQ(read().size() % 1000, 4U) << "whole lines only";
}

TEST_F(GrowingFileTest, EndsWithAWholeLineWhereTheDiskIsFull) {
  auto file = GrowingFile::create(file_);
  ASSERT_TRUE(file);
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit small{100'050, before.rlim_max};
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  const std::string line(99, 'x');
  Status last;
  for (int k = 0; k < 3000; ++k) last = file->write(line + '\n');
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, handler);
  ASSERT_FALSE(last);
  EXPECT_EQ(last.error().code, Errc::Io);
  EXPECT_NE(last.error().message.find(file_.filename().string()), std::string::npos) << last.error().message;
  EXPECT_FALSE(file->write("more\n")) << "the error stays";
  EXPECT_FALSE(file->flush());
  EXPECT_EQ(file->lines(), 1000U);
  EXPECT_EQ(fs::file_size(file_), 100'000U);
}

TEST_F(GrowingFileTest, AFolderThatIsNotThereIsAnError) {
  const auto file = GrowingFile::create(file_ / "f.csv");
  ASSERT_FALSE(file);
  EXPECT_NE(file.error().message.find("f.csv"), std::string::npos);
}

}  // namespace
}  // namespace relief
