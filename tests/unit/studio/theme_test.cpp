#include <gtest/gtest.h>
#include <studio/widgets/style.h>
#include <studio/widgets/theme.h>

#include <QApplication>

namespace relief::studio {
namespace {

/// Puts the dark theme at 100 % back when the test is over.
class ThemeTest : public testing::Test {
 protected:
  ~ThemeTest() override { apply(*qApp, dark_theme(), 1); }
};

class Contrast : public testing::TestWithParam<const Theme*> {};

TEST(ContrastRatio, IsOneForEqualAndTwentyOneForBlackOnWhite) {
  EXPECT_DOUBLE_EQ(contrast(Qt::black, Qt::black), 1);
  EXPECT_NEAR(contrast(Qt::black, Qt::white), 21, 1e-9);
  EXPECT_NEAR(contrast(QColor(0x777777), Qt::white), 4.48, 0.005);  // WCAG's own borderline grey
}

TEST_P(Contrast, OfTextAndStatesReachesFourAndAHalf) {
  const Theme& t = *GetParam();
  for (const QColor& under : {t.window, t.panel, t.raised, t.field})
    for (const QColor& over : {t.text, t.dim, t.accent, t.good, t.warn, t.bad})
      EXPECT_GE(contrast(under, over), 4.5) << over.name().toStdString() << " on " << under.name().toStdString();
  EXPECT_GE(contrast(t.accent, t.on_accent), 4.5);
  EXPECT_GE(contrast(t.field, curve_blue(t)), 4.5);
}

TEST_P(Contrast, OfBordersReachesOnePointThree) {
  const Theme& t = *GetParam();
  for (const QColor& under : {t.window, t.panel, t.field})
    EXPECT_GE(contrast(under, t.line), 1.3) << t.line.name().toStdString() << " on " << under.name().toStdString();
}

INSTANTIATE_TEST_SUITE_P(Themes, Contrast, testing::Values(&dark_theme(), &light_theme()),
                         [](const auto& test) { return is_dark(*test.param) ? "dark" : "light"; });

TEST_F(ThemeTest, DarkAndLightAreWhatTheirNamesSay) {
  EXPECT_TRUE(is_dark(dark_theme()));
  EXPECT_FALSE(is_dark(light_theme()));
}

TEST_F(ThemeTest, ApplySetsPaletteFontAndSheet) {
  apply(*qApp, light_theme(), 1.5);
  EXPECT_EQ(current_theme(), light_theme());
  EXPECT_EQ(qApp->palette().color(QPalette::WindowText), light_theme().text);
  EXPECT_DOUBLE_EQ(qApp->font().pointSizeF(), 15);
  EXPECT_EQ(scaled(20), 30);
  EXPECT_TRUE(qApp->styleSheet().contains(light_theme().accent.name()));
  EXPECT_FALSE(qApp->styleSheet().contains(dark_theme().panel.name()));
}

TEST_F(ThemeTest, TextSizeStaysBetween80And200Percent) {
  apply(*qApp, dark_theme(), 5);
  EXPECT_DOUBLE_EQ(text_scale(), 2);
  apply(*qApp, dark_theme(), 0.1);
  EXPECT_DOUBLE_EQ(text_scale(), 0.8);
}

TEST_F(ThemeTest, SheetHasNoColourWithoutAName) {
  EXPECT_FALSE(style_sheet().contains(u'@'));
  EXPECT_TRUE(style_sheet().contains(QStringLiteral("border: 1px solid")));
}

TEST_F(ThemeTest, LinesOfTheSheetKeepTheirWidthWhereLengthsGrow) {
  apply(*qApp, dark_theme(), 2);
  EXPECT_TRUE(style_sheet().contains(QStringLiteral("border: 1px solid")));
  EXPECT_TRUE(style_sheet().contains(QStringLiteral("padding: 12px 26px")));  // of a push button, 6px 13px
}

}  // namespace
}  // namespace relief::studio
