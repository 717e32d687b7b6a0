// Films, reports, and the two views beside each other.
#include "bowl.h"

#include <relief/file/model_file.h>

#include <gtest/gtest.h>
#include <studio/picture_of.h>
#include <studio/session_report.h>
#include <studio/split_view.h>
#include <studio/text.h>
#include <studio/turntable.h>
#include <studio/turntable_dialog.h>

#include <QApplication>
#include <QDir>
#include <QImage>
#include <QLabel>
#include <QProgressBar>
#include <QPushButton>
#include <QRegularExpression>
#include <QSignalSpy>
#include <QSpinBox>
#include <QTemporaryDir>
#include <QTest>
#include <QThreadPool>
#include <cstring>

namespace relief::studio {
namespace {

struct Films : testing::Test {
  Films() {
    film.folder = folder.path();
    film.stem = "it's a bowl";
    film.frames = 4;
    film.width = 64;
    film.height = 48;
    first.camera = framing(*bowl().head, 20, 15, 64.0 / 48);
    first.width = 64;
    first.height = 48;
    first.samples = 4;
  }
  ~Films() override { QThreadPool::globalInstance()->waitForDone(); }
  QStringList files() { return QDir(folder.path()).entryList(QDir::Files, QDir::Name); }

  QTemporaryDir folder;
  Turntable film;
  Frame first;
  std::atomic<bool> cancel{false};
};

TEST_F(Films, ATurntableIsNumberedPicturesAndAList) {
  std::vector<int> told;
  const Status drawn = draw_turntable(*bowl().head, first, film, [&](int done) { told.push_back(done); }, cancel);
  ASSERT_TRUE(drawn) << drawn.error().message;
  EXPECT_EQ(told, (std::vector<int>{1, 2, 3, 4}));
  EXPECT_EQ(files(), QStringList({"it's a bowl-0001.png", "it's a bowl-0002.png", "it's a bowl-0003.png",
                                  "it's a bowl-0004.png", "it's a bowl.ffconcat"}));
  std::vector<QImage> pictures;
  for (int k = 0; k < 4; ++k) pictures.emplace_back(frame_file(film, k));
  EXPECT_EQ(pictures[0].size(), QSize(64, 48));
  EXPECT_NE(pictures[0], pictures[1]);
  // The first frame is what F12 would save.
  const auto still = draw_picture(*bowl().head, first);
  ASSERT_TRUE(still);
  const QImage plain(still->rgb.data(), 64, 48, 3 * 64, QImage::Format_RGB888);
  const QImage film_first = pictures[0].convertToFormat(QImage::Format_RGB888);
  for (int y = 0; y < 48; ++y)
    EXPECT_EQ(std::memcmp(film_first.constScanLine(y), plain.constScanLine(y), 3 * 64), 0) << y;
  QFile list(folder.filePath("it's a bowl.ffconcat"));
  ASSERT_TRUE(list.open(QIODevice::ReadOnly));
  const QString words = QString::fromUtf8(list.readAll());
  EXPECT_TRUE(words.startsWith("ffconcat version 1.0\nfile 'it'\\''s a bowl-0001.png'\nduration 0.75"));
}

TEST_F(Films, AFullTurnEndsOneStepBeforeItsBegin) {
  film.degrees = 180;
  film.frames = 2;
  ASSERT_TRUE(draw_turntable(*bowl().head, first, film, [](int) {}, cancel));
  const QImage quarter(frame_file(film, 1));
  film.degrees = 360;
  film.frames = 4;
  ASSERT_TRUE(draw_turntable(*bowl().head, first, film, [](int) {}, cancel));
  EXPECT_EQ(QImage(frame_file(film, 1)), quarter);
}

TEST_F(Films, CancelledOrFailedLeavesNoFile) {
  const Status cancelled = draw_turntable(*bowl().head, first, film, [&](int done) { cancel = done == 2; }, cancel);
  ASSERT_FALSE(cancelled);
  EXPECT_EQ(cancelled.error().code, Errc::Cancelled);
  EXPECT_TRUE(QDir(folder.path()).isEmpty(QDir::AllEntries | QDir::Hidden | QDir::NoDotAndDotDot));
  cancel = false;
  film.folder = folder.filePath("not there");
  const Status failed = draw_turntable(*bowl().head, first, film, [](int) {}, cancel);
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().code, Errc::Io);
}

TEST_F(Films, TheDialogMakesAFilmAndCanBeCancelled) {
  QSettings settings(folder.filePath("studio.conf"), QSettings::IniFormat);
  settings.setValue("folders/pictures", folder.filePath("films"));
  settings.setValue("turntable/size", 0);
  TurntableDialog dialog(settings, bowl().head, first, "bowl");
  dialog.show();
  QSignalSpy finished(&dialog, &TurntableDialog::finished_film);
  dialog.findChild<QSpinBox*>("turntable-frames")->setValue(3);
  dialog.findChild<QPushButton*>("turntable-save")->click();
  EXPECT_TRUE(dialog.working());
  EXPECT_FALSE(dialog.findChild<QSpinBox*>("turntable-frames")->isEnabled());
  ASSERT_TRUE(finished.wait(60'000));
  EXPECT_EQ(finished[0][1].toInt(), 3);
  EXPECT_EQ(QDir(folder.filePath("films/bowl")).entryList({"*.png"}).size(), 3);
  EXPECT_EQ(settings.value("turntable/frames").toInt(), 3);

  dialog.show();
  dialog.findChild<QSpinBox*>("turntable-frames")->setValue(9999);
  dialog.findChild<QPushButton*>("turntable-save")->click();
  dialog.findChild<QPushButton*>("turntable-cancel")->click();
  ASSERT_TRUE(QTest::qWaitFor([&] { return !dialog.working(); }, 60'000));
  EXPECT_TRUE(dialog.isVisible()) << "for another try";
  EXPECT_EQ(
      QDir(folder.filePath("films/bowl")).entryList(QDir::AllEntries | QDir::Hidden | QDir::NoDotAndDotDot).size(), 4)
      << "the first film";
}

/// An open document of the bowl.
struct Session : Films {
  Session() {
    const auto file = path(folder.filePath("bowl.relief"));
    EXPECT_TRUE(bridge.open(file, *ModelFile::create(file, bowl())));
  }
  SessionFacts facts() {
    return {.title = "A <bowl>",
            .file = folder.filePath("bowl.relief"),
            .begun = counter.begun(),
            .now = counter.begun().addSecs(60),
            .tools = counter.tools(),
            .undone = counter.undone(),
            .document = bridge.document()->statistics(),
            .info = bridge.document()->info(),
            .slabs = bridge.head()->slab_mesh().slab_count(),
            .named = true,
            .hand = std::nullopt};
  }
  DocumentBridge bridge;
  SessionCounter counter{bridge};
  ToolState tools;
};

TEST_F(Session, AReportTellsStrokesByTool) {
  const auto file = path(folder.filePath("other.relief"));
  ASSERT_TRUE(bridge.open(file, *ModelFile::create(file, bowl())));
  dent(bridge);
  dent(bridge, 0.5);
  ASSERT_EQ(counter.tools().size(), 1U);
  const SessionCounter::OfTool& carved = counter.tools().at(Tool::Carve);
  EXPECT_EQ(carved.strokes, 2U);
  // Dabs that come again where room was made count each time there.
  EXPECT_GT(carved.samples, 0U);
  EXPECT_LE(carved.samples, bridge.document()->statistics().samples);
  bridge.post(Undo{});
  bridge.document()->settle();
  QApplication::processEvents();
  EXPECT_EQ(counter.undone(), 1U);

  QImage picture(8, 6, QImage::Format_RGB32);
  picture.fill(Qt::red);
  const QString page = QString::fromUtf8(session_report(facts(), picture));
  EXPECT_TRUE(page.contains("A &lt;bowl&gt;"));
  EXPECT_FALSE(page.contains("<bowl>"));
  EXPECT_TRUE(page.contains(QStringLiteral("<th>Carve</th><td>2</td>"))) << page.toStdString();
  EXPECT_TRUE(page.contains("<th>Slabs</th><td>" + QString::number(facts().slabs)));
  EXPECT_FALSE(page.contains("Device"));
  // It stands by itself: nothing is loaded from elsewhere.
  EXPECT_FALSE(page.contains(QRegularExpression("(src|href)=\"(?!data:)")));
  EXPECT_FALSE(page.contains("http"));
  const auto inside = QRegularExpression("base64,([A-Za-z0-9+/=]+)").match(page);
  EXPECT_EQ(
      QImage::fromData(QByteArray::fromBase64(inside.captured(1).toLatin1())).convertToFormat(QImage::Format_RGB32),
      picture);
}

TEST_F(Session, AReportHasTheDevicesFiguresWhereThereAreAny) {
  EXPECT_FALSE(figures_of(HandMonitor(), "Simulated hand"));
  HandMonitor monitor;
  for (std::uint64_t k = 0; k < 100; ++k) {
    ServoTick tick;
    tick.number = k;
    tick.sample.force = {0, 0, k == 50 ? 3.0 : 1.0};
    monitor.tick(tick);
  }
  monitor.drain();
  SessionFacts with = facts();
  with.hand = figures_of(monitor, "Simulated hand");
  ASSERT_TRUE(with.hand);
  EXPECT_EQ(with.hand->ticks, 100U);
  EXPECT_NEAR(with.hand->force, 3, 1e-6);
  EXPECT_TRUE(QString::fromUtf8(session_report(with, {})).contains("<th>Device</th><td>Simulated hand</td>"));
}

struct Views : Session {
  Views() : views(bridge, tools) {
    views.resize(800, 400);
    views.shaded().set_scene({bridge.head(), nullptr}, Unit::Millimetre, true);
    QObject::connect(&bridge, &DocumentBridge::snapshotChanged, &views,
                     [this] { views.shaded().set_model(bridge.head()); });
    views.show();
  }
  SplitView views;
};

TEST_F(Views, TheSecondViewFollowsAndLeads) {
  EXPECT_EQ(views.analysis(), nullptr);
  const QSignalSpy made(&views, &SplitView::analysisMade);
  views.show_map(Look::Map::Depth);
  ASSERT_NE(views.analysis(), nullptr);
  EXPECT_EQ(made.count(), 1);
  Viewport& second = *views.analysis();
  EXPECT_EQ(second.camera(), views.shaded().camera());
  EXPECT_EQ(second.look().map, Look::Map::Depth);
  EXPECT_EQ(views.shaded().look().map, Look::Map::None);
  EXPECT_EQ(second.scene().model, bridge.head());
  views.shaded().set_camera(orbit(second.camera(), 0.3, 0.1, true));
  EXPECT_EQ(second.camera(), views.shaded().camera());
  second.set_camera(zoom(second.camera(), 0.5, std::nullopt, 1));
  EXPECT_EQ(second.camera(), views.shaded().camera());
}

TEST_F(Views, AnotherLookIsForBothAndKeepsTheMap) {
  views.show_map(Look::Map::Depth);
  Look look = views.shaded().look();
  look.slab_wires = true;
  views.set_look(look);
  EXPECT_TRUE(views.shaded().look().slab_wires);
  EXPECT_TRUE(views.analysis()->look().slab_wires);
  EXPECT_EQ(views.analysis()->look().map, Look::Map::Depth);
  EXPECT_EQ(views.shaded().look().map, Look::Map::None);
}

TEST_F(Views, BothShowTheSameSnapshots) {
  views.show_map(Look::Map::Displacement);
  dent(bridge);
  EXPECT_EQ(views.analysis()->scene().model, bridge.head());
  EXPECT_EQ(views.shaded().scene().model, bridge.head());
  views.shaded().set_scene({}, Unit::Millimetre, false);
  EXPECT_EQ(views.analysis()->scene().model, nullptr);
}

TEST_F(Views, StrokesWorkInBothAndItCloses) {
  views.show_map(Look::Map::Slabs);
  views.show_map(Look::Map::Stretch);
  EXPECT_EQ(views.count(), 2) << "another map is no third view";
  QApplication::processEvents();
  tools.set_diagonal(diagonal(bridge.head()->slab_mesh().bounds()));
  for (Viewport* view : {&views.shaded(), views.analysis()}) {
    QPoint at = view->rect().center();
    while (!view->hit(at) && at.y() < view->height()) at.ry() += 5;
    ASSERT_TRUE(view->hit(at));
    const std::uint64_t before = bridge.head()->content_hash();
    QTest::mousePress(view, Qt::LeftButton, Qt::NoModifier, at);
    QTest::mouseMove(view, at + QPoint(8, 0));
    QTest::mouseRelease(view, Qt::LeftButton, Qt::NoModifier, at + QPoint(8, 0));
    bridge.document()->settle();
    QApplication::processEvents();
    EXPECT_NE(bridge.head()->content_hash(), before) << view->objectName().toStdString();
  }
  views.show_map(std::nullopt);
  EXPECT_EQ(views.analysis(), nullptr);
  EXPECT_EQ(views.count(), 1);
  views.shaded().set_camera(orbit(views.shaded().camera(), 0.2, 0, true));
  dent(bridge);
  EXPECT_EQ(views.shaded().scene().model, bridge.head());
}

}  // namespace
}  // namespace relief::studio
