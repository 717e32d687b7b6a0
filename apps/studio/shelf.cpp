#include "shelf.h"

#include "text.h"

#include <QCoreApplication>
#include <QCryptographicHash>
#include <QDir>
#include <QFile>
#include <QFileInfo>
#include <QJsonArray>
#include <QJsonDocument>
#include <QJsonObject>
#include <QRegularExpression>
#include <QSaveFile>
#include <algorithm>
#include <csignal>
#include <filesystem>

namespace relief::studio {

namespace {

constexpr std::size_t kMostRecent = 24;

QString folder(const char* variable, const char* beside_home, const QString& below = {}) {
  const QString given = qEnvironmentVariable(variable);
  const QString base =
      QDir::isAbsolutePath(given) ? given : QDir::homePath() + QLatin1Char('/') + QLatin1String(beside_home);
  const QString place = base + QStringLiteral("/relief") + below;
  QDir().mkpath(place);
  return place;
}

QJsonObject to_json(const ShelfEntry& e) {
  return {{QStringLiteral("file"), e.file},
          {QStringLiteral("title"), e.title},
          {QStringLiteral("used"), e.used.toString(Qt::ISODate)},
          {QStringLiteral("strokes"), qint64(e.strokes)}};
}

ShelfEntry from_json(const QJsonObject& o) {
  ShelfEntry e;
  e.file = o[QStringLiteral("file")].toString();
  e.title = o[QStringLiteral("title")].toString();
  e.used = QDateTime::fromString(o[QStringLiteral("used")].toString(), Qt::ISODate);
  e.strokes = static_cast<quint64>(std::max<qint64>(0, o[QStringLiteral("strokes")].toInteger()));
  e.unnamed = Shelf::is_unnamed(e.file);
  if (const QString picture = Shelf::picture_of(e.file); QFile::exists(picture)) e.picture = picture;
  return e;
}

QString& unnamed_folder() {
  static QString chosen;
  return chosen;
}

QString list_file() { return state_folder() + QStringLiteral("/recent.json"); }
QString mark_folder() { return folder("XDG_STATE_HOME", ".local/state", QStringLiteral("/open")); }
QString mark_file(qint64 pid) { return mark_folder() + QStringLiteral("/%1.json").arg(pid); }

bool write_json(const QString& file, const QJsonDocument& what) {
  QSaveFile out(file);
  return out.open(QIODevice::WriteOnly) && out.write(what.toJson()) >= 0 && out.commit();
}

}  // namespace

QString state_folder() { return folder("XDG_STATE_HOME", ".local/state"); }
QString config_folder() { return folder("XDG_CONFIG_HOME", ".config"); }
QString data_folder() { return folder("XDG_DATA_HOME", ".local/share"); }
QString cache_folder() { return folder("XDG_CACHE_HOME", ".cache"); }

Shelf::Shelf(QObject* parent) : QObject(parent) {
  read();
  find_left_open();
}

void Shelf::read() {
  QFile in(list_file());
  if (!in.open(QIODevice::ReadOnly)) return;
  QJsonParseError error;
  const QJsonDocument list = QJsonDocument::fromJson(in.readAll(), &error);
  in.close();
  if (!list.isArray()) {
    const QString aside = list_file() + QStringLiteral(".damaged");
    QFile::remove(aside);
    QFile::rename(list_file(), aside);
    complaint_ = tr("The list of recent models could not be read. It is now %1.").arg(aside);
    return;
  }
  for (const QJsonValue& value : list.array()) {
    ShelfEntry entry = from_json(value.toObject());
    if (!entry.file.isEmpty() && QFile::exists(entry.file)) recent_.push_back(std::move(entry));
  }
}

void Shelf::write() {
  QJsonArray list;
  for (const ShelfEntry& entry : recent_) list.append(to_json(entry));
  write_json(list_file(), QJsonDocument(list));
}

void Shelf::find_left_open() {
  const QDir folder(mark_folder());
  for (const QString& name : folder.entryList({QStringLiteral("*.json")}, QDir::Files)) {
    const qint64 pid = QFileInfo(name).completeBaseName().toLongLong();
    if (pid <= 0 || pid == QCoreApplication::applicationPid() || ::kill(static_cast<pid_t>(pid), 0) == 0) continue;
    QFile in(folder.filePath(name));
    if (!in.open(QIODevice::ReadOnly)) continue;
    ShelfEntry entry = from_json(QJsonDocument::fromJson(in.readAll()).object());
    in.close();
    in.remove();
    if (entry.file.isEmpty() || !QFile::exists(entry.file)) continue;
    for (ShelfEntry& known : recent_)
      if (known.file == entry.file) known = entry;
    left_open_.push_back(std::move(entry));
  }
  std::ranges::sort(left_open_, std::greater{}, &ShelfEntry::used);
}

QString Shelf::new_unnamed(const QString& title) const {
  QString place = unnamed_folder();
  if (place.isEmpty() || !QDir().mkpath(place)) place = preset_unnamed_folder();
  QString stem = title.simplified();
  stem.replace(QRegularExpression(QStringLiteral("[^A-Za-z0-9_-]+")), QStringLiteral("-"));
  if (stem.isEmpty()) stem = QStringLiteral("model");
  for (int k = 1;; ++k) {
    const QString file = QStringLiteral("%1/%2-%3.relief").arg(place, stem.left(40)).arg(k);
    if (!QFile::exists(file)) return file;
  }
}

bool Shelf::is_unnamed(const QString& file) {
  const QString place = QFileInfo(file).path();
  return place == preset_unnamed_folder() || (!unnamed_folder().isEmpty() && place == unnamed_folder());
}

void Shelf::set_unnamed_folder(const QString& folder) {
  unnamed_folder() = folder.isEmpty() ? QString() : QDir(folder).absolutePath();
}

QString Shelf::preset_unnamed_folder() { return folder("XDG_STATE_HOME", ".local/state", QStringLiteral("/unnamed")); }

QString Shelf::picture_of(const QString& file) {
  const QByteArray hash = QCryptographicHash::hash(file.toUtf8(), QCryptographicHash::Sha1).toHex();
  return folder("XDG_CACHE_HOME", ".cache", QStringLiteral("/thumbnails")) + QLatin1Char('/') +
         QString::fromLatin1(hash) + QStringLiteral(".png");
}

void Shelf::opened(const QString& file, const QString& title, quint64 strokes) {
  std::erase_if(recent_, [&](const ShelfEntry& e) { return e.file == file; });
  std::erase_if(left_open_, [&](const ShelfEntry& e) { return e.file == file; });
  open_ = {.file = file,
           .title = title,
           .used = QDateTime::currentDateTime(),
           .strokes = strokes,
           .unnamed = is_unnamed(file),
           .picture = {}};
  recent_.insert(recent_.begin(), open_);
  if (recent_.size() > kMostRecent) recent_.resize(kMostRecent);
  write();
  mark();
  emit changed();
}

void Shelf::stroked(quint64 strokes) {
  if (open_.file.isEmpty()) return;
  open_.strokes = strokes;
  open_.used = QDateTime::currentDateTime();
  mark();
}

void Shelf::closed() {
  QFile::remove(mark_file(QCoreApplication::applicationPid()));
  for (ShelfEntry& entry : recent_)
    if (entry.file == open_.file) {
      const QString picture = picture_of(entry.file);
      entry = open_;
      if (QFile::exists(picture)) entry.picture = picture;
    }
  open_ = {};
  write();
  emit changed();
}

void Shelf::forget(const QString& file) {
  std::erase_if(recent_, [&](const ShelfEntry& e) { return e.file == file; });
  std::erase_if(left_open_, [&](const ShelfEntry& e) { return e.file == file; });
  write();
  emit changed();
}

/// With each stroke, so it waits for no disk: it need only outlive the program, not the machine.
void Shelf::mark() {
  const QString file = mark_file(QCoreApplication::applicationPid()), beside = file + QStringLiteral(".new");
  QFile out(beside);
  if (!out.open(QIODevice::WriteOnly)) return;
  out.write(QJsonDocument(to_json(open_)).toJson());
  out.close();
  std::error_code ignored;
  std::filesystem::rename(path(beside), path(file), ignored);
}

}  // namespace relief::studio
