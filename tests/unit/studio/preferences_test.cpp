// What people choose for good: kept, told at once, found by searching, and taken back; and their keys.
#include <gtest/gtest.h>
#include <studio/desktop_scheme.h>
#include <studio/key_map.h>
#include <studio/keys_page.h>
#include <studio/navigation_card.h>
#include <studio/preferences.h>
#include <studio/preferences_dialog.h>
#include <studio/shelf.h>
#include <studio/widgets/theme.h>

#include <QAction>
#include <QApplication>
#include <QCheckBox>
#include <QComboBox>
#include <QFile>
#include <QLabel>
#include <QLineEdit>
#include <QListWidget>
#include <QPushButton>
#include <QSignalSpy>
#include <QTemporaryDir>
#include <QTest>
#include <QTreeWidget>

namespace relief::studio {
namespace {

struct Preferences : testing::Test {
  Preferences() {
    qputenv("XDG_STATE_HOME", folder.path().toUtf8());
    const auto add = [this](const QString& id, const QString& title, const QKeySequence& key) {
      auto* action = new QAction(title, &owner);
      action->setShortcut(key);
      actions[id] = action;
    };
    add("carve", "Carve", QKeySequence(Qt::Key_C));
    add("smooth", "&Smooth", QKeySequence(Qt::Key_S));
    add("undo", "Undo", QKeySequence(Qt::CTRL | Qt::Key_Z));
    add("picture", "Picture", QKeySequence(Qt::Key_F12));
  }
  QString file(const QString& name) { return folder.filePath(name); }
  QString read(const QString& name) {
    QFile in(file(name));
    return in.open(QIODevice::ReadOnly) ? QString::fromUtf8(in.readAll()) : QString();
  }
  void write(const QString& name, const QByteArray& bytes) {
    QFile out(file(name));
    ASSERT_TRUE(out.open(QIODevice::WriteOnly));
    out.write(bytes);
  }

  QTemporaryDir folder;
  QObject owner;
  std::map<QString, QAction*> actions;
};

struct Dialog : Preferences {
  Dialog() : settings(file("studio.conf"), QSettings::IniFormat), keys(file("keys.json")) {
    keys.take_over(actions);
    dialog = std::make_unique<PreferencesDialog>(settings, keys, "Software drawing: test");
    dialog->show();
  }
  template <typename T>
  T* find(const QString& name) {
    T* found = dialog->findChild<T*>(name);
    EXPECT_NE(found, nullptr) << name.toStdString();
    return found;
  }
  QSettings settings;
  KeyMap keys;
  std::unique_ptr<PreferencesDialog> dialog;
};

// The style has its say after the rows are there: their places must be of its making, not of before.
TEST_F(Dialog, EachPageHasARowOfItsOwn) {
  auto* pages = find<QListWidget>("preferences-pages");
  for (const double size : {1.0, 1.5}) {
    apply(*qApp, dark_theme(), size);
    QApplication::processEvents();
    for (int k = 0; k + 1 < pages->count(); ++k) {
      const QRect row = pages->visualItemRect(pages->item(k));
      EXPECT_GE(row.height(), pages->sizeHintForRow(k));
      EXPECT_FALSE(row.intersects(pages->visualItemRect(pages->item(k + 1)))) << size << ' ' << k;
    }
    EXPECT_GE(pages->viewport()->width(), pages->sizeHintForColumn(0)) << size;
  }
  apply(*qApp, dark_theme(), 1);
}

TEST_F(Preferences, UnknownValuesCountAsNotChosen) {
  QSettings settings(file("studio.conf"), QSettings::IniFormat);
  EXPECT_EQ(chosen(settings, "look/theme"), QVariant("desktop"));
  settings.setValue("look/theme", "purple");
  settings.setValue("look/text", 900);
  settings.setValue("drawing/samples", "5");
  EXPECT_EQ(chosen(settings, "look/theme"), QVariant("desktop"));
  EXPECT_EQ(chosen(settings, "look/text").toInt(), 200);
  EXPECT_EQ(chosen(settings, "drawing/samples").toInt(), 16);
  settings.setValue("look/text", "large");
  EXPECT_EQ(chosen(settings, "look/text").toInt(), 100);
}

TEST_F(Preferences, ThemeFollowsTheDesktopWhereItIsKnown) {
  EXPECT_EQ(theme_for("desktop", false), light_theme());
  EXPECT_EQ(theme_for("desktop", true), dark_theme());
  EXPECT_EQ(theme_for("desktop", std::nullopt), dark_theme());
  EXPECT_EQ(theme_for("light", true), light_theme());
}

TEST_F(Dialog, ChoicesAreKeptAndToldAtOnce) {
  const QSignalSpy told(dialog.get(), &PreferencesDialog::changed);
  auto* map = find<QComboBox>("input-map");
  EXPECT_EQ(told.count(), 0);
  map->setCurrentIndex(1);
  EXPECT_EQ(settings.value("input/map").toString(), "industry");
  find<QCheckBox>("look-reduced-motion")->toggle();
  EXPECT_TRUE(settings.value("look/reduced-motion").toBool());
  ASSERT_EQ(told.count(), 2);
  EXPECT_EQ(told[0][0].toString(), "input/map");
}

TEST_F(Dialog, BackToDefaultsIsForOnePage) {
  find<QComboBox>("input-map")->setCurrentIndex(2);
  find<QCheckBox>("input-turntable")->setChecked(false);
  find<QComboBox>("look-theme")->setCurrentIndex(2);
  find<QPushButton>("defaults-input")->click();
  EXPECT_FALSE(settings.contains("input/map"));
  EXPECT_EQ(find<QComboBox>("input-map")->currentIndex(), 0);
  EXPECT_TRUE(find<QCheckBox>("input-turntable")->isChecked());
  EXPECT_EQ(settings.value("look/theme").toString(), "light");
}

TEST_F(Dialog, SearchFindsRowsOnAllPages) {
  auto* pages = find<QListWidget>("preferences-pages");
  auto* search = find<QLineEdit>("preferences-search");
  search->setText("turntable");
  EXPECT_EQ(pages->currentItem()->data(Qt::UserRole).toString(), "input");
  EXPECT_TRUE(find<QCheckBox>("input-turntable")->isVisible());
  EXPECT_FALSE(find<QComboBox>("input-map")->isVisible());
  EXPECT_TRUE(pages->item(0)->isHidden());
  search->setText("smooth carve nothing-like-it");
  for (int k = 0; k < pages->count(); ++k) EXPECT_TRUE(pages->item(k)->isHidden());
  search->setText("carve");
  EXPECT_EQ(pages->currentItem()->data(Qt::UserRole).toString(), "keys");
  search->clear();
  for (int k = 0; k < pages->count(); ++k) EXPECT_FALSE(pages->item(k)->isHidden());
}

TEST_F(Dialog, EveryControlHasItsName) {
  const QList<QWidget*> all = dialog->findChildren<QWidget*>();
  for (const QWidget* each : all) {
    const bool control = qobject_cast<const QComboBox*>(each) || qobject_cast<const QCheckBox*>(each) ||
                         qobject_cast<const QLineEdit*>(each);
    if (!control) continue;
    EXPECT_FALSE(each->accessibleName().isEmpty() || each->objectName().isEmpty()) << each->metaObject()->className();
  }
}

TEST_F(Preferences, KeysAreKeptUntilTheyAreReset) {
  {
    KeyMap keys(file("keys.json"));
    keys.take_over(actions);
    keys.set("carve", {QKeySequence(Qt::SHIFT | Qt::Key_K)});
    EXPECT_EQ(actions["carve"]->shortcut(), QKeySequence("Shift+K"));
  }
  EXPECT_TRUE(read("keys.json").contains("Shift+K"));
  actions["carve"]->setShortcut(QKeySequence(Qt::Key_C));
  KeyMap keys(file("keys.json"));
  keys.take_over(actions);
  EXPECT_EQ(actions["carve"]->shortcut(), QKeySequence("Shift+K"));
  keys.reset();
  EXPECT_EQ(actions["carve"]->shortcut(), QKeySequence("C"));
  EXPECT_FALSE(read("keys.json").contains("carve"));
}

TEST_F(Preferences, DamagedKeysArePutAsideAndTold) {
  for (const QByteArray bytes :
       {"{\"carve\": [\"Shift", "[1, 2]", "{\"carve\": \"C\"}", "{\"carve\": [\"Hyper+Nothing\"]}"}) {
    write("keys.json", bytes);
    KeyMap keys(file("keys.json"));
    keys.take_over(actions);
    EXPECT_TRUE(keys.complaint().contains("keys.json.damaged")) << bytes.constData();
    EXPECT_FALSE(QFile::exists(file("keys.json")));
    EXPECT_EQ(read("keys.json.damaged").toUtf8(), bytes);
    EXPECT_EQ(keys.keys("carve"), QList<QKeySequence>{QKeySequence("C")});
  }
}

TEST_F(Preferences, SingleKeysCanBeSwitchedOff) {
  KeyMap keys(file("keys.json"));
  keys.take_over(actions);
  keys.set_single_keys(false);
  EXPECT_TRUE(actions["carve"]->shortcut().isEmpty());
  EXPECT_EQ(actions["undo"]->shortcut(), QKeySequence("Ctrl+Z"));
  EXPECT_EQ(actions["picture"]->shortcut(), QKeySequence("F12"));
  EXPECT_TRUE(KeyMap::is_single(QKeySequence("Shift+T")));
  keys.set_single_keys(true);
  EXPECT_EQ(actions["carve"]->shortcut(), QKeySequence("C"));
}

TEST_F(Dialog, NewKeysArePressedAndCollisionsAsked) {
  dialog->show_page("keys");
  auto* list = find<QTreeWidget>("keys");
  list->setCurrentItem(list->findItems("Carve", Qt::MatchExactly).first());
  find<QPushButton>("key-change")->click();
  QTest::keyClick(list, Qt::Key_K, Qt::ControlModifier);
  EXPECT_EQ(actions["carve"]->shortcut(), QKeySequence("Ctrl+K"));
  // S is that of Smooth: nothing changes before somebody says so.
  find<QPushButton>("key-change")->click();
  QTest::keyClick(list, Qt::Key_S);
  EXPECT_EQ(actions["carve"]->shortcut(), QKeySequence("Ctrl+K"));
  EXPECT_TRUE(find<QLabel>("keys-words")->text().contains("Smooth"));
  find<QPushButton>("key-leave")->click();
  EXPECT_EQ(actions["smooth"]->shortcut(), QKeySequence("S"));
  find<QPushButton>("key-change")->click();
  QTest::keyClick(list, Qt::Key_S);
  find<QPushButton>("key-take-over")->click();
  EXPECT_EQ(actions["carve"]->shortcut(), QKeySequence("S"));
  EXPECT_TRUE(actions["smooth"]->shortcut().isEmpty());
  find<QPushButton>("defaults-keys")->click();
  EXPECT_EQ(actions["smooth"]->shortcut(), QKeySequence("S"));
  // Esc leaves it as it is.
  find<QPushButton>("key-change")->click();
  QTest::keyClick(list, Qt::Key_Escape);
  EXPECT_TRUE(dialog->isVisible());
  EXPECT_EQ(actions["carve"]->shortcut(), QKeySequence("C"));
}

TEST_F(Dialog, SharedKeysAreShown) {
  keys.set("smooth", {QKeySequence("C")});
  const auto* list = find<QTreeWidget>("keys");
  for (const char* title : {"Carve", "Smooth"}) {
    const QTreeWidgetItem* row = list->findItems(title, Qt::MatchExactly).first();
    EXPECT_TRUE(row->text(1).contains("also:")) << row->text(1).toStdString();
  }
}

TEST_F(Preferences, NavigationIsChosenByItsPicture) {
  NavigationCard card;
  const QSignalSpy told(&card, &NavigationCard::mapChosen);
  card.findChild<QAbstractButton*>("map-industry")->click();
  ASSERT_EQ(told.count(), 1);
  EXPECT_TRUE(values_of("input/map").contains(told[0][0].toString()));
}

TEST_F(Preferences, UnnamedModelsLieWherePeopleWant) {
  Shelf shelf;
  EXPECT_TRUE(Shelf::is_unnamed(shelf.new_unnamed("Head")));
  Shelf::set_unnamed_folder(file("elsewhere"));
  const QString place = shelf.new_unnamed("Head");
  EXPECT_TRUE(place.startsWith(file("elsewhere/"))) << place.toStdString();
  EXPECT_TRUE(Shelf::is_unnamed(place));
  EXPECT_TRUE(Shelf::is_unnamed(Shelf::preset_unnamed_folder() + "/Head-1.relief"));
  EXPECT_FALSE(Shelf::is_unnamed(file("Head.relief")));
  Shelf::set_unnamed_folder({});
}

}  // namespace
}  // namespace relief::studio
