#include <gtest/gtest.h>
#include <studio/widgets/colour_palette.h>
#include <studio/widgets/theme.h>

#include <QApplication>
#include <QColorDialog>
#include <QSet>
#include <QSignalSpy>
#include <QTest>

namespace relief::studio {
namespace {

class ColourPaletteTest : public testing::Test {
 protected:
  ColourPaletteTest() {
    palette.show();
    EXPECT_TRUE(QTest::qWaitForWindowActive(&palette));
  }
  Swatch* swatch(const QString& name) {
    for (Swatch* found : palette.findChildren<Swatch*>())
      if (found->isVisible() && found->accessibleName() == name) return found;
    return nullptr;
  }
  int chosen() {
    int count = 0;
    for (const Swatch* found : palette.findChildren<Swatch*>()) count += found->isVisible() && found->isChecked();
    return count;
  }

  ColourPalette palette;
  QSignalSpy picked{&palette, &ColourPalette::colourPicked};
};

TEST(PaletteColours, AreSixteenWithNamesOfTheirOwn) {
  QSet<QString> names;
  QSet<QRgb> colours;
  for (const NamedColour& named : palette_colours()) {
    names.insert(QString::fromLatin1(named.name));
    colours.insert(named.colour);
  }
  EXPECT_EQ(names.size(), 16);
  EXPECT_EQ(colours.size(), 16);
}

TEST(PaletteColours, OthersAreNamedAfterTheNearest) {
  EXPECT_EQ(spoken_name(QColor(0xb4452b)), QStringLiteral("brick red"));
  EXPECT_EQ(spoken_name(QColor(0xb04428)), QStringLiteral("close to brick red, #b04428"));
  EXPECT_TRUE(spoken_name(Qt::black).contains(QStringLiteral("soot black")));
}

TEST_F(ColourPaletteTest, AClickPicks) {
  ASSERT_TRUE(swatch(QStringLiteral("ochre")));
  QTest::mouseClick(swatch(QStringLiteral("ochre")), Qt::LeftButton);
  ASSERT_EQ(picked.size(), 1);
  EXPECT_EQ(picked[0][0].value<QColor>(), QColor(0xd6a23c));
  EXPECT_EQ(palette.accessibleDescription(), QStringLiteral("ochre"));
  EXPECT_EQ(chosen(), 1);
}

TEST_F(ColourPaletteTest, ArrowsMoveAndPick) {
  swatch(QStringLiteral("clay"))->setFocus();
  QTest::keyClick(swatch(QStringLiteral("clay")), Qt::Key_Right);
  EXPECT_EQ(palette.colour(), QColor(0xb4452b));
}

TEST_F(ColourPaletteTest, SetColourEmitsNothingAndOneOutsideThePaletteIsChosenNowhere) {
  palette.set_colour(QColor(0x123456));
  EXPECT_EQ(picked.size(), 0);
  EXPECT_EQ(chosen(), 0);
}

TEST_F(ColourPaletteTest, LastUsedAreTwelveNewestFirstEachOnce) {
  for (int i = 0; i < 20; ++i) palette.mark_used(QColor(i, 0, 0));
  palette.mark_used(QColor(15, 0, 0));
  QApplication::processEvents();  // the layout shows what is new in it
  ASSERT_EQ(palette.last_used().size(), 12);
  EXPECT_EQ(palette.last_used()[0], QColor(15, 0, 0));
  EXPECT_EQ(palette.last_used()[1], QColor(19, 0, 0));
  EXPECT_EQ(palette.last_used()[11], QColor(8, 0, 0));
  int visible = 0;
  for (const Swatch* found : palette.findChildren<Swatch*>()) visible += found->isVisible();
  EXPECT_EQ(visible, 16 + 12);
}

TEST_F(ColourPaletteTest, AUsedColourOfThePaletteIsChosenOnceAndHasANameOfItsOwn) {
  palette.set_colour(QColor(0xd6a23c));
  palette.mark_used(QColor(0xd6a23c));
  QApplication::processEvents();
  EXPECT_TRUE(swatch(QStringLiteral("ochre, used before")));
  EXPECT_EQ(chosen(), 1);
}

TEST_F(ColourPaletteTest, AnyColourByTheDialog) {
  palette.findChild<QAbstractButton*>(QStringLiteral("colour_palette.more"))->click();
  auto* dialog = palette.findChild<QColorDialog*>();
  ASSERT_TRUE(dialog);
  dialog->setCurrentColor(QColor(0x123456));
  dialog->accept();
  ASSERT_EQ(picked.size(), 1);
  EXPECT_EQ(palette.colour(), QColor(0x123456));
}

}  // namespace
}  // namespace relief::studio
