// The widgets without a screen: Qt's own "offscreen" platform, no X server needed.
#include <gtest/gtest.h>
#include <studio/widgets/theme.h>

#include <QApplication>

int main(int argc, char** argv) {
  qputenv("QT_QPA_PLATFORM", "offscreen");
  QApplication application(argc, argv);
  relief::studio::apply(application, relief::studio::dark_theme(), 1);
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
