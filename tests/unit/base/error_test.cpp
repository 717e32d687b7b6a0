#include <relief/base/error.h>
#include <relief/base/try.h>

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

namespace relief {
namespace {

using namespace std::string_literals;

TEST(ErrorName, IsTheEnumeratorAndDiffersForEachCode) {
  EXPECT_EQ(name(Errc::InvalidArgument), "InvalidArgument");
  EXPECT_EQ(name(Errc::NewerVersion), "NewerVersion");
  EXPECT_EQ(name(Errc::Cancelled), "Cancelled");
  std::set<std::string_view> names;
  for (int k = 0; k <= static_cast<int>(Errc::Cancelled); ++k) names.insert(name(static_cast<Errc>(k)));
  EXPECT_EQ(names.size(), 11U);
}

TEST(Printable, LeavesWhatATerminalShows) {
  EXPECT_EQ(printable(""), "");
  EXPECT_EQ(printable("head.ply"), "head.ply");
  EXPECT_EQ(printable("Büste \u4f60\u597d \U0001F3FA.ply"), "Büste \u4f60\u597d \U0001F3FA.ply");
}

TEST(Printable, EscapesControlCharacters) {
  EXPECT_EQ(printable("a\nb\tc\r"), "a\\x0ab\\x09c\\x0d");
  EXPECT_EQ(printable("\x1b[31mred\x7f"), "\\x1b[31mred\\x7f");
  EXPECT_EQ(printable("a\0b"s), "a\\x00b");
  // C1 controls, line separators and marks that turn the direction of writing are controls, too.
  EXPECT_EQ(printable("\u009b"), "\\xc2\\x9b");
  EXPECT_EQ(printable("\u2028"), "\\xe2\\x80\\xa8");
  EXPECT_EQ(printable("a\u202egpj.exe"), "a\\xe2\\x80\\xaegpj.exe");
}

TEST(Printable, EscapesWhatIsNotUtf8) {
  EXPECT_EQ(printable("\xff"), "\\xff");
  EXPECT_EQ(printable("\x80z"), "\\x80z");                           // continuation without a lead
  EXPECT_EQ(printable("caf\xe9"), "caf\\xe9");                       // Latin-1 at the end
  EXPECT_EQ(printable("\xc0\xaf"), "\\xc0\\xaf");                    // overlong slash
  EXPECT_EQ(printable("\xe0\x80\xaf"), "\\xe0\\x80\\xaf");           // overlong
  EXPECT_EQ(printable("\xed\xa0\x80"), "\\xed\\xa0\\x80");           // surrogate
  EXPECT_EQ(printable("\xf4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80");  // beyond U+10FFFF
  EXPECT_EQ(printable("\xe4\xbd"), "\\xe4\\xbd");                    // cut in the middle
  EXPECT_EQ(printable("\xe4\xbdx"), "\\xe4\\xbdx");
}

TEST(Printable, CutsAtTheLimitAndNeverInsideACharacter) {
  EXPECT_EQ(printable("abcdef", 6), "abcdef");
  EXPECT_EQ(printable("abcdefg", 6), "abcdef...");
  EXPECT_EQ(printable("ab\u4f60\u597d", 5), "ab\u4f60...");
  EXPECT_EQ(printable("ab\u4f60\u597d", 4), "ab...");
  EXPECT_EQ(printable("\n\n\n", 9), "\\x0a\\x0a...");
  EXPECT_EQ(printable(std::string(100000, 'x')).size(), 203U);
}

Result<int> half(int value) {
  if (value % 2 != 0) return fail(Errc::InvalidArgument, std::to_string(value) + " is odd");
  return value / 2;
}
Result<int> quarter(int value) {
  RELIEF_TRY(const int first, half(value));
  RELIEF_TRY(const int second, half(first));
  return second;
}
Status check_quarter(int value, bool& reached) {
  RELIEF_CHECK(quarter(value));
  reached = true;
  return {};
}

TEST(Try, PassesValuesOnAndReturnsTheFirstError) {
  EXPECT_EQ(quarter(12).value(), 3);
  const Result<int> failed = quarter(6);
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().code, Errc::InvalidArgument);
  EXPECT_EQ(failed.error().message, "3 is odd");
}

TEST(Try, CheckReturnsFromTheFunction) {
  bool reached = false;
  EXPECT_TRUE(check_quarter(8, reached));
  EXPECT_TRUE(reached);
  reached = false;
  EXPECT_EQ(check_quarter(5, reached).error().message, "5 is odd");
  EXPECT_FALSE(reached);
}

}  // namespace
}  // namespace relief
