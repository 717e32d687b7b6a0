// The kiosk: what its curator writes, when it begins anew, and that originals stay as they are.
#include "bowl.h"

#include <relief/file/model_file.h>

#include <gtest/gtest.h>
#include <studio/idle_watch.h>
#include <studio/kiosk.h>
#include <studio/kiosk_log.h>
#include <studio/text.h>

#include <QAbstractButton>
#include <QAction>
#include <QApplication>
#include <QDir>
#include <QLabel>
#include <QLineEdit>
#include <QRegularExpression>
#include <QSignalSpy>
#include <QTemporaryDir>
#include <QTest>
#include <QThreadPool>
#include <QWindow>
#include <cmath>

namespace relief::studio {
namespace {

struct Exhibits : testing::Test {
  Exhibits() {
    qputenv("XDG_STATE_HOME", (folder.path() + "/state").toUtf8());
    qputenv("XDG_CACHE_HOME", (folder.path() + "/cache").toUtf8());
    qputenv("MESA_SHADER_CACHE_DISABLE", "true");
    QDir().mkpath(shown());
  }
  QString shown() { return folder.path() + "/shown"; }
  QString file(const QString& name) { return shown() + QLatin1Char('/') + name; }
  void put_model(const QString& name) { EXPECT_TRUE(ModelFile::create(path(file(name)), bowl())); }
  void put(const QString& name, const QByteArray& bytes) {
    QFile out(file(name));
    ASSERT_TRUE(out.open(QIODevice::WriteOnly));
    out.write(bytes);
  }
  QByteArray bytes_of(const QString& name) {
    QFile in(file(name));
    return in.open(QIODevice::ReadOnly) ? in.readAll() : QByteArray();
  }
  QTemporaryDir folder;
};

TEST_F(Exhibits, CaptionsAreReadInTheirLanguages) {
  put_model("bowl.relief");
  put("bowl.json",
      R"({"title": {"en": "A bowl", "de": "Eine Schale"}, "sentences": {"de": ["Aus Ton."], "en": ["Of clay.", "Touch it."]},
                       "tools": ["touch", "smooth"], "force_cap": 0.25, "timeout_s": 30})");
  const auto all = read_exhibits({shown()});
  ASSERT_TRUE(all) << all.error().message;
  ASSERT_EQ(all->size(), 1U);
  const Exhibit& bowl = all->front();
  EXPECT_EQ(bowl.caption("de").title.toStdString(), "Eine Schale");
  EXPECT_EQ(bowl.caption("en").sentences.size(), 2);
  EXPECT_EQ(bowl.caption("fr").title.toStdString(), "A bowl");
  EXPECT_EQ(bowl.tools, QStringList({"touch", "smooth"}));
  EXPECT_EQ(bowl.force_cap, 0.25);
  EXPECT_EQ(bowl.timeout_s, 30);
}

TEST_F(Exhibits, WhatIsNotWrittenHasItsDefault) {
  put_model("bowl.relief");
  const auto plain = read_exhibit(file("bowl.relief"));
  ASSERT_TRUE(plain);
  EXPECT_EQ(plain->caption("en").title.toStdString(), "bowl");
  EXPECT_EQ(plain->force_cap, 0.6);
  EXPECT_EQ(plain->timeout_s, 90);
  EXPECT_GE(plain->tools.size(), 3);
  put("bowl.json", R"({"title": "For all", "sentences": {"de": ["Nur deutsch."]}})");
  EXPECT_EQ(read_exhibit(file("bowl.relief"))->caption("de").title.toStdString(), "For all");
}

TEST_F(Exhibits, BadCaptionsAreNamedWithPlaceAndRemedy) {
  put_model("bowl.relief");
  struct Bad {
    const char *json, *says;
  };
  for (const Bad& bad :
       {Bad{"{\"title\": \"x\",\n \"sentences\": [", "line 2 is no JSON"}, Bad{"[]", "one JSON object"},
        Bad{R"({"titel": "x"})", "\"titel\", which means nothing"}, Bad{R"({"title": ""})", "must be words"},
        Bad{R"({"sentences": ["a", "b", "c", "d"]})", "three at most"}, Bad{R"({"sentences": [1]})", "words in quotes"},
        Bad{R"({"title": {"english": "x"}})", "two letters"},
        Bad{R"({"tools": ["carv"]})", "no tool; there are touch, carve"}, Bad{R"({"tools": []})", "at least one"},
        Bad{R"({"force_cap": 1.5})", "from 0 to 1"}, Bad{R"({"timeout_s": 0})", "from 2 to 3600"}}) {
    put("bowl.json", bad.json);
    const auto read = read_exhibits({file("bowl.relief")});
    ASSERT_FALSE(read) << bad.json;
    EXPECT_NE(read.error().message.find("bowl.json: "), std::string::npos) << read.error().message;
    EXPECT_NE(read.error().message.find(bad.says), std::string::npos) << read.error().message;
    EXPECT_EQ(read.error().message.find('\n'), std::string::npos);
  }
}

// The one in docs/how-to/kiosk.md.
TEST_F(Exhibits, TheExampleIsRead) {
  put_model("pumpkin.relief");
  QFile::copy(QStringLiteral(RELIEF_SOURCE_DIR "/examples/kiosk/pumpkin.json"), file("pumpkin.json"));
  const auto read = read_exhibit(file("pumpkin.relief"));
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->caption("de").title.toStdString(), "Ein Kürbis");
  EXPECT_EQ(read->caption("en").sentences.size(), 3);
  EXPECT_EQ(read->force_cap, 0.4);
}

TEST_F(Exhibits, BadModelsAreNamed) {
  EXPECT_FALSE(read_exhibits({file("none.relief")}));
  EXPECT_FALSE(read_exhibits({shown()})) << "a folder without models";
  put("bad.relief", "no model at all");
  const auto read = read_exhibits({shown()});
  ASSERT_FALSE(read);
  EXPECT_NE(read.error().message.find("bad.relief"), std::string::npos) << read.error().message;
}

TEST(IdleWatch, CountsDownAndIsCalledBack) {
  IdleWatch watch;
  QSignalSpy counted(&watch, &IdleWatch::countdown), resumed(&watch, &IdleWatch::resumed),
      expired(&watch, &IdleWatch::expired);
  watch.start(3);
  watch.tick();
  watch.tick();
  EXPECT_EQ(counted.count(), 0);
  watch.activity();
  EXPECT_EQ(resumed.count(), 0) << "it had not begun to count down";
  for (int k = 0; k < 2; ++k) watch.tick();
  EXPECT_EQ(counted.count(), 0);
  watch.tick();
  ASSERT_EQ(counted.count(), 1);
  EXPECT_EQ(counted[0][0].toInt(), 10);
  watch.tick();
  watch.activity();
  EXPECT_EQ(resumed.count(), 1);
  counted.clear();
  for (int k = 0; k < 3 + 10; ++k) watch.tick();
  ASSERT_EQ(counted.count(), 11);
  EXPECT_EQ(counted.last()[0].toInt(), 0);
  EXPECT_EQ(expired.count(), 0);
  watch.tick();
  EXPECT_EQ(expired.count(), 1);
}

TEST(KioskLog, KeepsThirtyDays) {
  const QTemporaryDir folder;
  const KioskLog log(folder.path());
  const QDate today(2026, 11, 26);
  const auto make = [&](const QString& name) {
    QFile out(folder.filePath(name));
    EXPECT_TRUE(out.open(QIODevice::WriteOnly));
  };
  for (const int age : {0, 30, 31, 400})
    make(QStringLiteral("kiosk-%1.log").arg(today.addDays(-age).toString(Qt::ISODate)));
  make(QStringLiteral("kiosk-notes.log"));
  log.tidy(today);
  EXPECT_EQ(QDir(folder.path()).entryList(QDir::Files),
            QStringList({"kiosk-2026-10-27.log", "kiosk-2026-11-26.log", "kiosk-notes.log"}));
}

struct KioskWindow : Exhibits {
  KioskWindow() {
    put_model("bowl.relief");
    put_model("copy.relief");
    put("bowl.json",
        R"({"title": "A bowl", "sentences": ["Of clay."], "tools": ["touch", "carve", "paint"], "timeout_s": 2})");
    before = bytes_of("bowl.relief");
    settings.setValue("kiosk/code", "4711");
    begin();
  }
  ~KioskWindow() override { QThreadPool::globalInstance()->waitForDone(); }
  /// Seconds without visitors go by when the test says so.
  void begin(const QString& device = {}) {
    kiosk.reset();
    kiosk = std::make_unique<Kiosk>(*read_exhibits({shown()}), settings, "en", device);
    kiosk->watch().set_second(3'600'000);
    kiosk->resize(1200, 800);
    kiosk->show();
  }
  bool wait_for(Kiosk::Page page) {
    return QTest::qWaitFor([&] { return kiosk->page() == page; }, 30'000);
  }
  void open() {
    kiosk->findChild<QAbstractButton*>("exhibit-0")->click();
    ASSERT_TRUE(wait_for(Kiosk::Page::Model));
  }
  std::uint64_t hash() { return kiosk->bridge().head()->content_hash(); }
  template <typename T>
  T* find(const QString& name) {
    return kiosk->findChild<T*>(name);
  }

  QByteArray before;
  QSettings settings{folder.path() + "/studio.conf", QSettings::IniFormat};
  std::unique_ptr<Kiosk> kiosk;
};

TEST_F(KioskWindow, VisitorsWorkOnACopyAndTheOriginalComesBack) {
  open();
  const std::uint64_t first = hash();
  EXPECT_EQ(first, bowl().head->content_hash());
  EXPECT_FALSE(find<QAbstractButton>("kiosk-undo")->isEnabled());
  dent(kiosk->bridge());
  EXPECT_NE(hash(), first);
  EXPECT_TRUE(find<QAbstractButton>("kiosk-undo")->isEnabled());
  find<QAbstractButton>("kiosk-undo")->click();
  kiosk->bridge().document()->settle();
  EXPECT_EQ(hash(), first);
  dent(kiosk->bridge());
  const std::filesystem::path copy = kiosk->bridge().file();
  EXPECT_NE(text(copy), file("bowl.relief"));
  // Nobody is there any more.
  for (int k = 0; k < 2 + IdleWatch::kCountdown; ++k) kiosk->watch().tick();
  EXPECT_TRUE(find<QWidget>("kiosk-countdown")->isVisible());
  kiosk->activity();
  EXPECT_FALSE(find<QWidget>("kiosk-countdown")->isVisible());
  EXPECT_NE(hash(), first) << "somebody came back in time";
  for (int k = 0; k < 3 + IdleWatch::kCountdown; ++k) kiosk->watch().tick();
  EXPECT_EQ(kiosk->page(), Kiosk::Page::Attract);
  EXPECT_FALSE(std::filesystem::exists(copy));
  kiosk->activity();
  EXPECT_EQ(kiosk->page(), Kiosk::Page::Choose);
  open();
  EXPECT_EQ(hash(), first);
  EXPECT_EQ(bytes_of("bowl.relief"), before);
}

TEST_F(KioskWindow, ShowsTheCuratorsToolsAndWords) {
  open();
  EXPECT_EQ(find<QLabel>("caption")->text().toStdString(), "Of clay.");
  for (const char* id : {"touch", "carve", "paint"})
    EXPECT_NE(find<QAbstractButton>(QStringLiteral("kiosk-tool-") + id), nullptr) << id;
  EXPECT_EQ(find<QAbstractButton>("kiosk-tool-smooth"), nullptr);
  EXPECT_TRUE(find<QAbstractButton>("kiosk-tool-carve")->isChecked());
  for (QAbstractButton* each : kiosk->findChildren<QAbstractButton*>(QRegularExpression("^kiosk-tool-")))
    EXPECT_GE(each->height(), 60) << "a fingertip";
}

TEST_F(KioskWindow, SpeaksTheVisitorsLanguageUntilNobodyIsThere) {
  put("bowl.json", R"({"title": {"en": "A bowl", "de": "Eine Schale"}})");
  begin();
  const auto title = [&] { return find<QAbstractButton>("exhibit-0")->text().toStdString(); };
  EXPECT_EQ(title(), "A bowl");
  find<QAbstractButton>("language-de")->click();
  EXPECT_EQ(title(), "Eine Schale");
  open();
  EXPECT_EQ(find<QAbstractButton>("kiosk-again")->text().toStdString(),
            QCoreApplication::translate("relief::studio::KioskStage", "Start again").toStdString());
  for (int k = 0; k < 90 + 1 + IdleWatch::kCountdown; ++k) kiosk->watch().tick();
  kiosk->activity();
  EXPECT_EQ(title(), "A bowl");
}

TEST_F(KioskWindow, ThereIsNoWayOut) {
  open();
  const QSignalSpy opened(&kiosk->bridge(), &DocumentBridge::opened);
  kiosk->close();
  EXPECT_TRUE(kiosk->isVisible());
  for (const auto key : {Qt::Key_Q, Qt::Key_W, Qt::Key_O, Qt::Key_S, Qt::Key_K})
    QTest::keyClick(kiosk.get(), key, Qt::ControlModifier);
  for (const auto key : {Qt::Key_F3, Qt::Key_F11, Qt::Key_Escape}) QTest::keyClick(kiosk.get(), key);
  EXPECT_TRUE(kiosk->isVisible());
  EXPECT_EQ(kiosk->page(), Kiosk::Page::Model);
  EXPECT_EQ(opened.count(), 0);
  EXPECT_TRUE(kiosk->findChildren<QAction*>().isEmpty());
}

TEST_F(KioskWindow, LeavesWithTheCodeOnly) {
  const auto enter = [&](const QString& code) {
    QTest::keyClick(kiosk->windowHandle(), Qt::Key_L, Qt::ControlModifier | Qt::AltModifier | Qt::ShiftModifier);
    ASSERT_TRUE(find<QWidget>("kiosk-code")->isVisible());
    auto* line = find<QLineEdit>("kiosk-code-line");
    QTest::keyClicks(line, code);
    QTest::keyClick(line, Qt::Key_Return);
    EXPECT_FALSE(find<QWidget>("kiosk-code")->isVisible());
  };
  enter("relief");
  EXPECT_TRUE(kiosk->isVisible());
  enter("4711");
  EXPECT_FALSE(kiosk->isVisible());
}

TEST_F(KioskWindow, ADeviceInTheHandCountsAndOneOnTheTableDoesNot) {
  open();
  for (int k = 0; k < 2; ++k) kiosk->watch().tick();
  ASSERT_TRUE(find<QWidget>("kiosk-countdown")->isVisible());
  kiosk->hand_at({0.1, 0, 0});  // where it lies
  kiosk->hand_at({0.1015, 0, 0});
  kiosk->hand_at({std::nan(""), 0, 0});
  EXPECT_TRUE(find<QWidget>("kiosk-countdown")->isVisible());
  kiosk->hand_at({0.1021, 0, 0});
  EXPECT_FALSE(find<QWidget>("kiosk-countdown")->isVisible());
}

TEST_F(KioskWindow, ForcesAreCappedAndOffWhileModelsTurn) {
  put("bowl.json", R"({"force_cap": 0.25, "timeout_s": 2})");
  begin("mouse");
  open();
  Hand& hand = kiosk->hand();
  ASSERT_TRUE(hand.active());
  EXPECT_TRUE(hand.forces());
  const double capped = hand.most_force();
  EXPECT_GT(capped, 0);
  EXPECT_LE(hand.force_limit(), capped);
  hand.set_force_cap(1);
  EXPECT_NEAR(capped, 0.25 * hand.most_force(), 1e-9);
  for (int k = 0; k < 3 + IdleWatch::kCountdown; ++k) kiosk->watch().tick();
  ASSERT_TRUE(QTest::qWaitFor([&] { return kiosk->page() == Kiosk::Page::Attract && hand.active(); }, 30'000));
  EXPECT_FALSE(hand.forces());
  // What the preferences say holds here, too.
  settings.setValue("forces/most", 10);
  begin("mouse");
  open();
  EXPECT_NEAR(kiosk->hand().most_force(), 0.1 / 0.25 * capped, 1e-9);
}

TEST_F(KioskWindow, AModelDamagedLaterIsSkippedAndLogged) {
  put("bowl.relief", "no longer a model");
  kiosk->findChild<QAbstractButton*>("exhibit-0")->click();
  ASSERT_TRUE(wait_for(Kiosk::Page::Choose));
  EXPECT_FALSE(find<QWidget>("exhibit-0")->isVisible());
  EXPECT_TRUE(find<QWidget>("exhibit-1")->isVisible());
  const QDir logs(folder.path() + "/state/relief/log");
  ASSERT_EQ(logs.entryList(QDir::Files).size(), 1);
  QFile log(logs.filePath(logs.entryList(QDir::Files).first()));
  ASSERT_TRUE(log.open(QIODevice::ReadOnly));
  EXPECT_TRUE(QString::fromUtf8(log.readAll()).contains("left out: "));
}

}  // namespace
}  // namespace relief::studio
