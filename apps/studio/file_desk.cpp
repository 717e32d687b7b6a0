#include "file_desk.h"

#include "event_log.h"
#include "text.h"

#include <QFile>
#include <QFileInfo>
#include <utility>

namespace relief::studio {

FileDesk::FileDesk(DocumentBridge& bridge, QObject* parent) : QObject(parent), bridge_(bridge) {
  connect(&job_, &OpenJob::meshReady, this, &FileDesk::meshReady);
  connect(&job_, &OpenJob::progress, this, [this](const QString& phase, double share) {
    event_log().write(QStringLiteral("convert"), {{"phase", phase}, {"fraction", share}});
    emit progress(phase, share);
  });
  connect(&job_, &OpenJob::opened, this, &FileDesk::finish);
  connect(&job_, &OpenJob::cancelled, this, [this] {
    event_log().write(QStringLiteral("cancelled"));
    emit cancelled();
    go_back();
  });
  connect(&job_, &OpenJob::failed, this, [this](const Error& error) {
    emit failed(tr("%1 could not be opened").arg(QFileInfo(asked_).fileName()), error_text(error), asked_,
                error.code == Errc::Corrupt && is_model(asked_));
    go_back();
  });
  connect(&bridge_, &DocumentBridge::savedElsewhere, this, [this](const QString& file, bool) {
    title_ = QFileInfo(file).completeBaseName();
    if (!given_up_.isEmpty() && given_up_ != file) {
      QFile::remove(given_up_);
      shelf_.forget(given_up_);
    }
    given_up_.clear();
    shelf_.opened(file, title_, bridge_.document()->statistics().undo_steps);
  });
  connect(&bridge_, &DocumentBridge::historyChanged, this,
          [this](const HistoryChanged& history) { shelf_.stroked(history.undo_steps); });
}

QStringList FileDesk::suffixes() { return {"relief", "ply", "obj", "stl", "off", "glb", "gltf", "3mf", "drc", "gz"}; }

QString FileDesk::filters() {
  return tr("Models and scans") + QStringLiteral(" (*.") + suffixes().join(QStringLiteral(" *.")) + QLatin1Char(')') +
         QStringLiteral(";;") + tr("Relief models (*.relief)") + QStringLiteral(";;") + tr("All files (*)");
}

bool FileDesk::is_model(const QString& file) { return file.endsWith(QLatin1String(".relief"), Qt::CaseInsensitive); }

bool FileDesk::begin(const QString& file, const QString& title) {
  if (job_.running()) {
    emit said(tr("%1 is still being opened; cancel that first.").arg(title_));
    return false;
  }
  const QString open = bridge_.document() != nullptr ? text(bridge_.file()) : QString();
  QString why;
  if (!close(why)) {
    emit failed(tr("%1 could not be closed").arg(title_), why, text(bridge_.file()), false);
    return false;
  }
  before_ = open;
  before_title_ = title_;
  asked_ = file;
  title_ = title;
  emit openingBegun(title);
  return true;
}

/// What was open is there again where nothing came of the other.
void FileDesk::go_back() {
  if (before_.isEmpty()) return;
  asked_ = std::exchange(before_, QString());
  title_ = before_title_;
  emit openingBegun(title_);
  job_.open_model(asked_);
}

void FileDesk::open(const QString& file) {
  const QString whole = QFileInfo(file).absoluteFilePath(), title = QFileInfo(file).completeBaseName();
  if (!begin(whole, title)) return;
  if (is_model(whole))
    job_.open_model(whole);
  else
    job_.open_scan(whole, shelf_.new_unnamed(title), Unit::Millimetre);
}

void FileDesk::open_anew() {
  const QString scan = scan_;
  if (scan.isEmpty() || !begin(scan, title_)) return;
  job_.open_scan(scan, shelf_.new_unnamed(title_), Unit::Millimetre, true);
}

void FileDesk::open_sample(const QString& name) {
  if (begin(name, sample_title(name))) job_.open_sample(name, shelf_.new_unnamed(name));
}

void FileDesk::finish(const std::shared_ptr<Opened>& what) {
  const QString file = text(what->file);
  const Status open = bridge_.open(what->file, std::move(*what->model));
  if (!open) {
    emit failed(tr("%1 could not be opened").arg(title_), error_text(open.error()), file, false);
    go_back();
    return;
  }
  before_.clear();
  const ModelInfo& info = bridge_.document()->info();
  if (!info.source.empty() && Shelf::is_unnamed(file) && !what->report)
    title_ = QFileInfo(text(info.source)).completeBaseName();
  shelf_.opened(file, title_, bridge_.document()->statistics().undo_steps);
  if (event_log().active())
    event_log().write(QStringLiteral("opened"), {{"file", file},
                                                 {"slabs", qint64(bridge_.head()->slab_mesh().slab_count())},
                                                 {"strokes", qint64(bridge_.document()->statistics().undo_steps)},
                                                 {"hash", hash_text(bridge_.head()->content_hash())}});
  std::optional<Verdict> verdict;
  scan_ = what->report && QFile::exists(asked_) ? asked_ : QString();
  if (what->report) verdict = verdict_of(*what->report, info.mode, what->diagonal, info.unit);
  emit opened(verdict, what->doubt);
}

bool FileDesk::close(QString& why) {
  if (bridge_.document() == nullptr) return true;
  const Status closed = bridge_.close();
  if (!closed) {
    why = error_text(closed.error());
    return false;
  }
  shelf_.closed();
  return true;
}

void FileDesk::save_as(const QString& file, std::shared_ptr<const std::atomic<bool>> cancel) {
  const QString old = text(bridge_.file());
  given_up_ = Shelf::is_unnamed(old) ? old : QString();
  bridge_.post(SaveElsewhere{.file = path(file), .cancel = std::move(cancel)});
}

}  // namespace relief::studio
