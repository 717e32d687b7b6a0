#include <gtest/gtest.h>
#include <studio/widgets/command_palette.h>

#include <QAction>
#include <QLabel>
#include <QLineEdit>
#include <QListWidget>
#include <QMainWindow>
#include <QMenu>
#include <QMenuBar>
#include <QSignalSpy>
#include <QTest>
#include <QToolBar>

namespace relief::studio {
namespace {

class CommandPaletteTest : public testing::Test {
 protected:
  CommandPaletteTest() {
    QMenu* file = window.menuBar()->addMenu(QStringLiteral("&File"));
    picture = file->addAction(QStringLiteral("&Save picture..."), QKeySequence(Qt::Key_F12));
    file->addSeparator();
    redo = file->addMenu(QStringLiteral("More"))->addAction(QStringLiteral("Redo"), QKeySequence::Redo);
    QToolBar* bar = window.addToolBar(QStringLiteral("Tools"));
    crease = bar->addAction(QStringLiteral("Crease"));
    bar->addAction(redo);  // in two places
    grey = bar->addAction(QStringLiteral("Reticent"));
    grey->setEnabled(false);
    window.setCentralWidget(canvas = new QLineEdit);
    window.resize(800, 600);
    window.show();
    EXPECT_TRUE(QTest::qWaitForWindowActive(&window));
    canvas->setFocus();
  }
  QStringList listed() {
    QStringList rows;
    for (int i = 0; i < list().count(); ++i) rows.append(list().item(i)->text());
    return rows;
  }
  QLineEdit& line() { return *palette.findChild<QLineEdit*>(); }
  QListWidget& list() { return *palette.findChild<QListWidget*>(); }

  QMainWindow window;
  QAction *picture, *redo, *crease, *grey;
  QLineEdit* canvas;
  CommandPalette& palette = *new CommandPalette(&window);
};

TEST_F(CommandPaletteTest, ListsWhatCanBeTriggeredOnceEach) {
  palette.open();
  EXPECT_EQ(listed().mid(0, 3), (QStringList{"Save picture...", "Redo", "Crease"}));
  EXPECT_FALSE(listed().contains(QStringLiteral("Reticent")));
  EXPECT_FALSE(listed().contains(QStringLiteral("More")));
  EXPECT_EQ(listed().count(QStringLiteral("Redo")), 1);
}

TEST_F(CommandPaletteTest, WordsNarrowInAnyOrder) {
  palette.open();
  line().setText(QStringLiteral("PICT sa"));
  EXPECT_EQ(listed(), QStringList{"Save picture..."});
  line().setText(QStringLiteral("re"));
  EXPECT_EQ(listed(), (QStringList{"Save picture...", "Redo", "Crease"}));
  line().setText(QStringLiteral("re zebra"));
  EXPECT_TRUE(listed().isEmpty());
  EXPECT_TRUE(palette.findChild<QLabel*>()->isVisible());  // says that there is none
  QTest::keyClick(&line(), Qt::Key_Return);                // nothing to do, nothing happens
  EXPECT_TRUE(palette.isVisible());
}

TEST_F(CommandPaletteTest, FurtherWordsFindACommandAndAreNotShown) {
  CommandPalette::set_words(*crease, QStringLiteral("fold valley"));
  palette.open();
  line().setText(QStringLiteral("valley cre"));
  EXPECT_EQ(listed(), QStringList{"Crease"});
  line().setText(QStringLiteral("valley save"));
  EXPECT_TRUE(listed().isEmpty());
}

TEST_F(CommandPaletteTest, EnterTriggersAndGivesTheFocusBack) {
  const QSignalSpy done(crease, &QAction::triggered);
  palette.open();
  EXPECT_TRUE(line().hasFocus());
  QTest::keyClicks(&line(), QStringLiteral("re"));
  QTest::keyClick(&line(), Qt::Key_Down);
  QTest::keyClick(&line(), Qt::Key_Down);
  QTest::keyClick(&line(), Qt::Key_Return);
  EXPECT_EQ(done.size(), 1);
  EXPECT_FALSE(palette.isVisible());
  EXPECT_TRUE(canvas->hasFocus());
}

TEST_F(CommandPaletteTest, EscapeClosesAndTriggersNothing) {
  const QSignalSpy done(picture, &QAction::triggered);
  palette.open();
  QTest::keyClick(&line(), Qt::Key_Escape);
  EXPECT_FALSE(palette.isVisible());
  EXPECT_TRUE(canvas->hasFocus());
  EXPECT_EQ(done.size(), 0);
}

TEST_F(CommandPaletteTest, ClosesWhenTheFocusGoesElsewhereAndLeavesItThere) {
  palette.open();
  canvas->setFocus();
  EXPECT_FALSE(palette.isVisible());
  EXPECT_TRUE(canvas->hasFocus());
}

TEST_F(CommandPaletteTest, IsAChildOfTheWindowThatStaysInsideIt) {
  window.resize(320, 200);
  palette.open();
  EXPECT_FALSE(palette.isWindow());
  EXPECT_TRUE(window.rect().contains(palette.geometry()));
}

TEST_F(CommandPaletteTest, OpensByItsActionAndByItsKeys) {
  EXPECT_EQ(palette.open_action()->shortcuts().size(), 2);
  QTest::keyClick(&window, Qt::Key_F3);
  EXPECT_TRUE(palette.isVisible());
  EXPECT_EQ(listed().size(), 3);  // not itself
}

TEST_F(CommandPaletteTest, RowsTellTheirShortcut) {
  palette.open();
  EXPECT_EQ(list().item(0)->data(Qt::AccessibleTextRole).toString(), QStringLiteral("Save picture..., F12"));
  EXPECT_FALSE(palette.accessibleName().isEmpty());
}

}  // namespace
}  // namespace relief::studio
