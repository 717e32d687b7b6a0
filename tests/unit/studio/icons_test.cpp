#include <relief/edit/tools.h>

#include <gtest/gtest.h>
#include <studio/widgets/icons.h>
#include <studio/widgets/theme.h>

#include <QApplication>
#include <QImage>
#include <QPainter>
#include <QSvgRenderer>

namespace relief::studio {
namespace {

/// Pixels that are nearer to `colour` than `distance` levels in each channel and fully covered.
int count(const QPixmap& pixmap, const QColor& colour, int distance = 8) {
  const QImage image = pixmap.toImage().convertToFormat(QImage::Format_ARGB32);
  int found = 0;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const QColor c = image.pixelColor(x, y);
      found += c.alpha() > 250 && std::abs(c.red() - colour.red()) < distance &&
               std::abs(c.green() - colour.green()) < distance && std::abs(c.blue() - colour.blue()) < distance;
    }
  }
  return found;
}

int covered(const QPixmap& pixmap) {
  const QImage image = pixmap.toImage().convertToFormat(QImage::Format_ARGB32);
  int found = 0;
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x) found += qAlpha(image.pixel(x, y)) > 128;
  return found;
}

QString id_of(const ToolInfo& tool) { return QString::fromUtf8(tool.id.data(), qsizetype(tool.id.size())); }

TEST(Icons, EveryToolHasOne) {
  for (const ToolInfo& tool : tools()) EXPECT_TRUE(has_icon(id_of(tool))) << tool.id;
}

TEST(Icons, EveryToolsPictureShowsTheToolInAccent) {
  for (const ToolInfo& tool : tools()) {
    const QPixmap pixmap = icon(id_of(tool)).pixmap(QSize(64, 64), 1.0);
    EXPECT_GT(count(pixmap, current_theme().accent), 20) << tool.id;
    EXPECT_GT(count(pixmap, current_theme().text), 20) << tool.id;
  }
}

TEST(Icons, NoTwoLookAlike) {
  const QStringList ids = icon_ids();
  ASSERT_GT(ids.size(), 40);
  QHash<QByteArray, QString> seen;
  for (const QString& id : ids) {
    const QImage image = icon(id).pixmap(QSize(32, 32), 1.0).toImage();
    const QByteArray bytes(reinterpret_cast<const char*>(image.constBits()), image.sizeInBytes());
    EXPECT_FALSE(seen.contains(bytes)) << id.toStdString() << " is " << seen.value(bytes).toStdString();
    seen.insert(bytes, id);
  }
}

TEST(Icons, EachIsAPictureAtEverySize) {
  for (const QString& id : icon_ids()) {
    EXPECT_TRUE(QSvgRenderer(QStringLiteral(":/relief/studio/icons/%1.svg").arg(id)).isValid()) << id.toStdString();
    for (const int side : {16, 24, 32, 64}) {
      const QPixmap pixmap = icon(id).pixmap(QSize(side, side), 1.0);
      EXPECT_EQ(pixmap.width(), side);
      EXPECT_GT(covered(pixmap), side / 2) << id.toStdString() << " at " << side;
    }
  }
}

TEST(Icons, CheckedIsInkOnAccentAndDisabledHasNoAccent) {
  const QIcon carve = icon(u"carve");
  const QPixmap checked = carve.pixmap(QSize(64, 64), 1.0, QIcon::Normal, QIcon::On);
  EXPECT_GT(count(checked, current_theme().on_accent), 40);
  EXPECT_EQ(count(checked, current_theme().accent), 0);
  const QPixmap disabled = carve.pixmap(QSize(64, 64), 1.0, QIcon::Disabled, QIcon::Off);
  EXPECT_EQ(count(disabled, current_theme().accent), 0);
  EXPECT_GT(covered(disabled), 40);
}

TEST(Icons, FollowTheTheme) {
  const QIcon undo = icon(u"undo");
  EXPECT_GT(count(undo.pixmap(QSize(64, 64), 1.0), dark_theme().text), 40);
  apply(*qApp, light_theme(), 1);
  EXPECT_GT(count(undo.pixmap(QSize(64, 64), 1.0), light_theme().text), 40);
  EXPECT_EQ(count(undo.pixmap(QSize(64, 64), 1.0), dark_theme().text), 0);
  apply(*qApp, dark_theme(), 1);
}

TEST(Icons, OneWithoutAPictureIsItsFirstLetter) {
  EXPECT_FALSE(has_icon(u"zebra"));
  const QPixmap letter = icon(u"zebra").pixmap(QSize(32, 32), 1.0);
  EXPECT_GT(covered(letter), 20);
  EXPECT_NE(letter.toImage(), icon(u"yak").pixmap(QSize(32, 32), 1.0).toImage());
}

TEST(Icons, SharpAtTwoPixelsToThePixel) {
  EXPECT_EQ(icon(u"carve").pixmap(QSize(24, 24), 2.0).width(), 48);
  EXPECT_EQ(icon_pixmap(u"warning", 20, Qt::red, 1.5).width(), 30);
}

}  // namespace
}  // namespace relief::studio
