// Where models lie: lists, damaged lists, and what a crash has left.
#include <gtest/gtest.h>
#include <studio/shelf.h>
#include <studio/text.h>

#include <QDir>
#include <QFile>
#include <QFileInfo>
#include <QJsonDocument>
#include <QJsonObject>
#include <QTemporaryDir>

namespace relief::studio {
namespace {

class ShelfTest : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* name : {"XDG_STATE_HOME", "XDG_CACHE_HOME"}) qputenv(name, folder_.path().toUtf8());
  }
  QString touch(const QString& name) {
    QFile file(folder_.filePath(name));
    EXPECT_TRUE(file.open(QIODevice::WriteOnly));
    return file.fileName();
  }
  QTemporaryDir folder_;
};

TEST_F(ShelfTest, RemembersTheNewestFirstAndEachOnce) {
  const QString a = touch("a.relief"), b = touch("b.relief");
  {
    Shelf shelf;
    shelf.opened(a, "A", 3);
    shelf.closed();
    shelf.opened(b, "B", 0);
    shelf.stroked(9);
    shelf.closed();
    shelf.opened(a, "A", 3);
    shelf.closed();
  }
  const Shelf shelf;
  ASSERT_EQ(shelf.recent().size(), 2U);
  EXPECT_EQ(shelf.recent()[0].file, a);
  EXPECT_EQ(shelf.recent()[1].strokes, 9U);
  EXPECT_TRUE(shelf.left_open().empty());
}

TEST_F(ShelfTest, ForgetsFilesThatAreGone) {
  const QString a = touch("a.relief");
  {
    Shelf shelf;
    shelf.opened(a, "A", 1);
    shelf.closed();
  }
  QFile::remove(a);
  EXPECT_TRUE(Shelf().recent().empty());
}

TEST_F(ShelfTest, ADamagedListIsSetAsideAndTold) {
  QFile list(state_folder() + "/recent.json");
  ASSERT_TRUE(list.open(QIODevice::WriteOnly));
  list.write("[{]");
  list.close();
  const Shelf shelf;
  EXPECT_TRUE(shelf.recent().empty());
  EXPECT_TRUE(shelf.complaint().contains("recent.json.damaged"));
  EXPECT_TRUE(QFile::exists(state_folder() + "/recent.json.damaged"));
}

TEST_F(ShelfTest, FindsWhatAProgramThatIsNoMoreHadOpen) {
  const QString a = touch("a.relief");
  QDir().mkpath(state_folder() + "/open");
  // No process has so high a number.
  QFile mark(state_folder() + "/open/99999999.json");
  ASSERT_TRUE(mark.open(QIODevice::WriteOnly));
  mark.write(QJsonDocument(QJsonObject{{"file", a}, {"title", "A"}, {"used", "2026-01-02T03:04:05"}, {"strokes", 214}})
                 .toJson());
  mark.close();
  const Shelf shelf;
  ASSERT_EQ(shelf.left_open().size(), 1U);
  EXPECT_EQ(shelf.left_open()[0].strokes, 214U);
  EXPECT_TRUE(Shelf().left_open().empty()) << "it is offered once";
}

TEST_F(ShelfTest, ARunningProgramIsNotRobbed) {
  const QString a = touch("a.relief");
  Shelf mine;
  mine.opened(a, "A", 1);
  EXPECT_TRUE(Shelf().left_open().empty());
}

TEST_F(ShelfTest, GivesEachNewModelAPlaceOfItsOwn) {
  const Shelf shelf;
  const QString one = shelf.new_unnamed("../Köpfe & Co.");
  EXPECT_TRUE(Shelf::is_unnamed(one));
  EXPECT_EQ(QFileInfo(one).absolutePath(), state_folder() + "/unnamed");
  QFile file(one);
  ASSERT_TRUE(file.open(QIODevice::WriteOnly));
  EXPECT_NE(shelf.new_unnamed("../Köpfe & Co."), one);
}

TEST(Text, LengthsHaveThreeDigitsAndTheirUnit) {
  const auto said = [](double length) { return length_text(length, Unit::Millimetre).toStdString(); };
  EXPECT_EQ(said(0), "0\u00a0mm");
  EXPECT_EQ(said(0.09), "0.0900\u00a0mm");
  EXPECT_EQ(said(8.5), "8.50\u00a0mm");
  EXPECT_EQ(said(26.34), "26.3\u00a0mm");
  EXPECT_EQ(said(1234), "1,234\u00a0mm");
  EXPECT_EQ(said(-1e-9), "0\u00a0mm");
  EXPECT_EQ(said(-0.5), "-0.500\u00a0mm");
  EXPECT_EQ(percent_text(0.604).toStdString(), "60\u00a0%");
}

}  // namespace
}  // namespace relief::studio
