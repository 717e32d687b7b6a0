// What assistive tools are told of the application.
#include <gtest/gtest.h>
#include <studio/accessible.h>

#include <QAccessible>
#include <QApplication>
#include <QWidget>
#include <memory>

namespace relief::studio {
namespace {

TEST(Accessible, AWindowThatHasClosedSinceTheyWereCountedIsNone) {
  install_accessibility();
  QWidget first;
  auto second = std::make_unique<QWidget>();
  QAccessibleInterface* const application = QAccessible::queryAccessibleInterface(qApp);
  ASSERT_NE(application, nullptr);
  EXPECT_EQ(application->role(), QAccessible::Application);
  EXPECT_EQ(application->parent(), nullptr);
  const int count = application->childCount();
  ASSERT_GE(count, 2);
  for (QWidget* const window : {&first, second.get()}) {
    const int index = application->indexOfChild(QAccessible::queryAccessibleInterface(window));
    ASSERT_GE(index, 0);
    EXPECT_EQ(application->child(index)->object(), window);
  }
  second.reset();
  EXPECT_EQ(application->childCount(), count - 1);
  EXPECT_EQ(application->child(count - 1), nullptr);
  EXPECT_EQ(application->child(-1), nullptr);
}

}  // namespace
}  // namespace relief::studio
