// Dialogs for files: opening, naming, exporting, pictures.
#include "background.h"
#include "event_log.h"
#include "export_dialog.h"
#include "main_window.h"
#include "picture_of.h"
#include "preferences.h"
#include "text.h"
#include "widgets/progress_strip.h"

#include <relief/base/try.h>
#include <relief/convert/convert.h>

#include <QApplication>
#include <QDateTime>
#include <QDir>
#include <QFileDialog>
#include <QFileInfo>
#include <QFrame>
#include <QRegularExpression>
#include <QStandardPaths>

namespace relief::studio {

namespace {

/// The folder of the last dialog, else the given one.
QString folder_of(const QSettings& settings, const QString& key, const QString& otherwise) {
  const QString kept = settings.value(QStringLiteral("folders/") + key).toString();
  return !kept.isEmpty() && QDir(kept).exists() ? kept : otherwise;
}

QString documents() { return QStandardPaths::writableLocation(QStandardPaths::DocumentsLocation); }

QString with_extension(QString file, const QString& extension) {
  return QFileInfo(file).suffix().isEmpty() ? file + extension : file;
}

/// ".stl" of "STL (*.stl)"; what is given where the filter names no extension.
QString extension_of(const QString& filter, const QString& otherwise) {
  static const QRegularExpression kPattern(QStringLiteral("\\(\\*(\\.\\w+)\\)"));
  const QRegularExpressionMatch found = kPattern.match(filter);
  return found.hasMatch() ? found.captured(1) : otherwise;
}

}  // namespace

void MainWindow::ask_open() {
  // The many extensions stand on the start page; in the dialog's line they would be cut.
  const QString file =
      QFileDialog::getOpenFileName(this, tr("Open a scan or a model"), folder_of(settings_, "open", documents()),
                                   FileDesk::filters(), nullptr, QFileDialog::HideNameFilterDetails);
  if (file.isEmpty()) return;
  settings_.setValue("folders/open", QFileInfo(file).absolutePath());
  open(file);
}

/// Where to, as "title.extension" in the folder of the last time; empty where nobody says. A name without an extension
/// gets that of the chosen filter.
QString MainWindow::ask_where(const QString& title, const QString& key, const QString& otherwise,
                              const QString& extension, const QString& filter) {
  const QString suggested = folder_of(settings_, key, otherwise) + QLatin1Char('/') + desk_.title() + extension;
  QString kind;
  const QString file = QFileDialog::getSaveFileName(this, title, suggested, filter, &kind);
  if (file.isEmpty()) return {};
  settings_.setValue(QStringLiteral("folders/") + key, QFileInfo(file).absolutePath());
  return with_extension(file, extension_of(kind, extension));
}

void MainWindow::ask_save_as() {
  if (bridge_.document() == nullptr) return;
  if (saving_) {
    say(tr("Saving …"));
    return;
  }
  const QString file = ask_where(tr("Name the model"), QStringLiteral("save"), documents(), QStringLiteral(".relief"),
                                 tr("Relief models (*.relief)"));
  if (file.isEmpty()) return;
  // The name that the model has: nothing is to be written a second time.
  const QString own = text(bridge_.file());
  if (QFileInfo(file) == QFileInfo(own) && !Shelf::is_unnamed(own)) {
    actions_.at("save")->trigger();
    return;
  }
  saving_ = begin_aside(tr("Saving …"));
  desk_.save_as(file, saving_);
}

void MainWindow::ask_export() {
  const SnapshotPtr head = bridge_.head();
  if (!head) return;
  const QString file = ask_where(tr("Export the model"), QStringLiteral("export"), documents(), QStringLiteral(".ply"),
                                 tr("PLY (*.ply);;STL (*.stl);;OBJ (*.obj);;glTF (*.glb);;3MF (*.3mf);;"
                                    "Slabs as text (*.slabs)"));
  if (file.isEmpty()) return;
  // Slabs are written as they lie, and whole.
  if (QFileInfo(file).suffix().toLower() == QLatin1String("slabs")) {
    export_to(file, [head, file](const Progress& progress) -> Status {
      if (progress.cancelled()) return fail(Errc::Cancelled, "nothing is exported: cancelled");
      return export_slabs(head->slab_mesh(), path(file));
    });
    return;
  }
  auto* dialog = new ExportDialog(settings_, *head, file, this);
  dialog->setAttribute(Qt::WA_DeleteOnClose);
  connect(dialog, &ExportDialog::chosen, this, [this, head, file, unit = unit_](SurfaceExport how) {
    how.unit = unit;
    export_to(file, [head, file, how](const Progress& progress) -> Status {
      RELIEF_CHECK(export_surface(*head, path(file), how, progress));
      return {};
    });
  });
  dialog->open();
}

void MainWindow::export_to(const QString& file, std::function<Status(const Progress&)> work) {
  work_aside(tr("Exporting …"), std::move(work), [this, file](const Status& status) {
    if (!status) {
      show_failure(tr("The model could not be exported"), error_text(status.error()), file, false);
      return;
    }
    event_log().write(QStringLiteral("exported"), {{"file", file}});
    say(tr("Exported to %1").arg(file));
  });
}

std::shared_ptr<std::atomic<bool>> MainWindow::begin_aside(const QString& title) {
  auto cancel = std::make_shared<std::atomic<bool>>(false);
  if (desk_.opening() || aside_) {
    say(title);
    return cancel;
  }
  aside_ = cancel;
  convert_->start(title);
  opening_->show();
  opening_->raise();
  place_over();
  return cancel;
}

void MainWindow::tell_aside(const std::shared_ptr<std::atomic<bool>>& cancel, const QString& title, double share) {
  if (cancel && aside_ == cancel) convert_->set_progress(title, share);
}

void MainWindow::end_aside(const std::shared_ptr<std::atomic<bool>>& cancel) {
  if (!cancel || aside_ != cancel) return;
  aside_.reset();
  convert_->finish();
  opening_->hide();
}

void MainWindow::work_aside(const QString& title, std::function<Status(const Progress&)> work,
                            std::function<void(const Status&)> done) {
  const auto cancel = begin_aside(title);
  const auto told = [this, guard = QPointer(this), cancel, title](std::string_view, double share) {
    QMetaObject::invokeMethod(
        QCoreApplication::instance(),
        [this, guard, cancel, title, share] {
          if (guard) tell_aside(cancel, title, share);
        },
        Qt::QueuedConnection);
  };
  in_background(
      this, [work = std::move(work), cancel, told] { return work({.report = told, .cancel = cancel.get()}); },
      [this, cancel, done = std::move(done)](const Status& status) {
        end_aside(cancel);
        if (!status && status.error().code == Errc::Cancelled)
          say(tr("Cancelled; nothing was kept."));
        else
          done(status);
      });
}

/// Writes what is whole of a damaged model to another file, and opens that.
void MainWindow::ask_salvage(const QString& file) {
  const QFileInfo damaged(file);
  QString to = QFileDialog::getSaveFileName(this, tr("Save what is whole of %1").arg(damaged.fileName()),
                                            damaged.absolutePath() + QLatin1Char('/') + damaged.completeBaseName() +
                                                tr("-salvaged") + QStringLiteral(".relief"),
                                            tr("Relief models (*.relief)"));
  if (to.isEmpty()) return;
  to = with_extension(to, QStringLiteral(".relief"));
  auto lost = std::make_shared<QStringList>();
  work_aside(
      tr("Saving what is whole …"),
      [file, to, lost](const Progress& progress) -> Status {
        RELIEF_TRY(const Salvaged saved, ModelFile::salvage(path(file), path(to), progress));
        for (const std::string& each : saved.lost) lost->append(text(each));
        return {};
      },
      [this, file, to, lost](const Status& status) {
        if (!status) {
          show_failure(tr("Nothing could be saved of %1").arg(QFileInfo(file).fileName()), error_text(status.error()),
                       file, false);
          return;
        }
        open(to);
        say(lost->isEmpty() ? tr("Nothing was lost.") : tr("Lost: %1.").arg(lost->join(QStringLiteral(", "))));
      });
}

/// The final frame of what is seen now, into the folder for pictures.
void MainWindow::ask_picture() {
  if (!bridge_.head()) return;
  const QString folder = chosen(settings_, "folders/pictures").toString();
  QDir().mkpath(folder);
  const QString stamp = QDateTime::currentDateTime().toString(QStringLiteral("yyyy-MM-dd HH.mm.ss"));
  save_picture(QStringLiteral("%1/%2 %3.png").arg(folder, desk_.title(), stamp));
}

void MainWindow::save_picture(const QString& file) {
  const SnapshotPtr head = bridge_.head();
  const Frame frame = viewport_->final_frame();
  in_background(
      this,
      [head, frame, file]() -> Status {
        RELIEF_TRY(const Picture picture, draw_picture(*head, frame));
        return save_png(picture, path(file));
      },
      [this, file, frame](const Status& status) {
        if (!status) {
          show_failure(tr("The picture could not be saved"), error_text(status.error()), file, false);
          return;
        }
        event_log().write(QStringLiteral("picture"),
                          {{"file", file}, {"width", frame.width}, {"height", frame.height}});
        say(tr("Picture saved: %1").arg(file));
      });
}

}  // namespace relief::studio
