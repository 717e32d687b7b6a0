#include "icons.h"

#include "theme.h"

#include <QDir>
#include <QFile>
#include <QIconEngine>
#include <QPainter>
#include <QPixmapCache>
#include <QSvgRenderer>

namespace relief::studio {

namespace {

/// The colours that stand for these in the files, so that any viewer shows them.
struct Inks {
  QColor ink;     ///< "black": the surface after the stroke
  QColor before;  ///< "gray": the surface before it
  QColor accent;  ///< "orange": the tool
};

QString file_of(QStringView id) { return QStringLiteral(":/relief/studio/icons/%1.svg").arg(id); }

Inks inks(QIcon::Mode mode, QIcon::State state) {
  const Theme& theme = current_theme();
  if (mode == QIcon::Disabled) {
    const QColor faint = mixed(theme.panel, theme.dim, 0.6);
    return {faint, faint, faint};
  }
  if (state == QIcon::On) return {theme.on_accent, mixed(theme.accent, theme.on_accent, 0.6), theme.on_accent};
  return {theme.text, theme.dim, theme.accent};
}

QByteArray coloured(QByteArray svg, const Inks& inks) {
  svg.replace("\"black\"", '"' + inks.ink.name().toLatin1() + '"');
  svg.replace("\"gray\"", '"' + inks.before.name().toLatin1() + '"');
  svg.replace("\"orange\"", '"' + inks.accent.name().toLatin1() + '"');
  return svg;
}

void paint_letter(QPainter& painter, const QRectF& rect, QStringView id, const QColor& ink) {
  QFont font = ui_font(10, QFont::DemiBold);
  font.setPixelSize(std::max(1, static_cast<int>(0.7 * rect.height())));
  painter.setFont(font);
  painter.setPen(ink);
  painter.drawText(rect, Qt::AlignCenter, id.left(1).toString().toUpper());
}

void paint_icon(QPainter& painter, const QRectF& rect, QStringView id, const Inks& inks) {
  QFile file(file_of(id));
  if (!file.open(QIODevice::ReadOnly)) return paint_letter(painter, rect, id, inks.ink);
  painter.setRenderHint(QPainter::Antialiasing);
  QSvgRenderer(coloured(file.readAll(), inks)).render(&painter, rect);
}

QPixmap rendered(QStringView id, const QSize& pixels, const Inks& inks) {
  const QString key = QStringLiteral("relief/%1/%2x%3/%4%5%6")
                          .arg(id)
                          .arg(pixels.width())
                          .arg(pixels.height())
                          .arg(inks.ink.name(), inks.before.name(), inks.accent.name());
  QPixmap pixmap;
  if (QPixmapCache::find(key, &pixmap)) return pixmap;
  pixmap = QPixmap(pixels);
  pixmap.fill(Qt::transparent);
  QPainter painter(&pixmap);
  const double side = std::min(pixels.width(), pixels.height());
  paint_icon(painter, {(pixels.width() - side) / 2, (pixels.height() - side) / 2, side, side}, id, inks);
  painter.end();
  QPixmapCache::insert(key, pixmap);
  return pixmap;
}

/// Draws when asked, so that a change of theme or text size needs no new icons.
class Engine : public QIconEngine {
 public:
  explicit Engine(QStringView id) : id_(id.toString()) {}
  void paint(QPainter* painter, const QRect& rect, QIcon::Mode mode, QIcon::State state) override {
    const double ratio = painter->device()->devicePixelRatioF();
    painter->drawPixmap(rect, scaledPixmap(rect.size() * ratio, mode, state, ratio));
  }
  QPixmap pixmap(const QSize& size, QIcon::Mode mode, QIcon::State state) override {
    return rendered(id_, size, inks(mode, state));
  }
  QPixmap scaledPixmap(const QSize& size, QIcon::Mode mode, QIcon::State state, qreal) override {
    return rendered(id_, size, inks(mode, state));
  }
  QIconEngine* clone() const override { return new Engine(id_); }
  QString iconName() override { return id_; }
  bool isNull() override { return false; }

 private:
  QString id_;
};

}  // namespace

QIcon icon(QStringView id) { return QIcon(new Engine(id)); }

bool has_icon(QStringView id) { return QFile::exists(file_of(id)); }

QStringList icon_ids() {
  QStringList ids = QDir(QStringLiteral(":/relief/studio/icons")).entryList({QStringLiteral("*.svg")});
  for (QString& id : ids) id.chop(4);
  ids.sort();
  return ids;
}

QPixmap icon_pixmap(QStringView id, int side, const QColor& colour, double pixel_ratio) {
  const int pixels = static_cast<int>(std::lround(side * pixel_ratio));
  QPixmap pixmap = rendered(id, {pixels, pixels}, {colour, colour, colour});
  pixmap.setDevicePixelRatio(pixel_ratio);
  return pixmap;
}

}  // namespace relief::studio
