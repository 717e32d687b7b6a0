// Further kinds of pictures: a film on a turntable, a report of the session, and the view of figures beside the other.
#include "background.h"
#include "event_log.h"
#include "hand.h"
#include "main_window.h"
#include "picture_of.h"
#include "preferences.h"
#include "session_report.h"
#include "split_view.h"
#include "text.h"
#include "turntable_dialog.h"

#include <relief/base/try.h>

#include <QDir>
#include <QFileDialog>
#include <QFileInfo>
#include <QMenu>
#include <QSaveFile>

namespace relief::studio {

void MainWindow::build_film_actions() {
  session_ = new SessionCounter(bridge_, this);
  add("turntable", tr("Save a &turntable …"), {}, [this] { ask_turntable(); });
  add("report", tr("Save a &report of the session …"), {}, [this] { ask_report(); });
  struct Each {
    const char *id, *title, *help;
    Look::Map map;
  };
  const std::array maps = {
      Each{"analysis-off", QT_TR_NOOP("No analysis"), QT_TR_NOOP("Closes the second view"), Look::Map::None},
      Each{"analysis-displacement", QT_TR_NOOP("Displacement"), QT_TR_NOOP("Where along its fibre the surface lies"),
           Look::Map::Displacement},
      Each{"analysis-depth", QT_TR_NOOP("Depth of clay"), QT_TR_NOOP("How much there is to carve or to lay on"),
           Look::Map::Depth},
      Each{"analysis-slabs", QT_TR_NOOP("Slabs"), QT_TR_NOOP("Each slab in a colour of its own"), Look::Map::Slabs},
      Each{"analysis-stretch", QT_TR_NOOP("Stretch"), QT_TR_NOOP("Where samples lie far apart"), Look::Map::Stretch}};
  analysis_group_ = new QActionGroup(this);
  for (const Each& each : maps) {
    QAction* action = add(QString::fromLatin1(each.id), tr(each.title), {}, {});
    action->setStatusTip(tr(each.help));
    action->setCheckable(true);
    action->setChecked(each.map == Look::Map::None);
    analysis_group_->addAction(action);
    connect(action, &QAction::toggled, this, [this, map = each.map](bool on) {
      if (on) views_->show_map(map);
    });
  }
  connect(views_, &SplitView::analysisMade, this, [this](Viewport* made) {
    made->installEventFilter(this);
    connect(made, &Viewport::said, this, &MainWindow::say);
    connect(made, &Viewport::colourPicked, viewport_, &Viewport::colourPicked);
    connect(made, &Viewport::dropped, viewport_, &Viewport::dropped);
    connect(made, &Viewport::pointed, hand_, &Hand::point);
    connect(made, &Viewport::left, hand_, &Hand::leave);
    connect(made, &Viewport::depthTurned, hand_, &Hand::turn_depth);
  });
}

void MainWindow::fill_analysis_menu(QMenu& menu) { menu.addActions(analysis_group_->actions()); }

void MainWindow::ask_turntable() {
  const SnapshotPtr head = bridge_.head();
  if (!head) return;
  auto* dialog = new TurntableDialog(settings_, head, viewport_->final_frame(), desk_.title(), this);
  dialog->setAttribute(Qt::WA_DeleteOnClose);
  connect(dialog, &TurntableDialog::finished_film, this, [this](const QString& folder, int frames) {
    event_log().write(QStringLiteral("turntable"), {{"folder", folder}, {"frames", frames}});
    say(tr("%n picture(s) saved in %1", nullptr, frames).arg(folder));
  });
  connect(dialog, &TurntableDialog::failed, this,
          [this](const QString& why) { show_failure(tr("The turntable could not be saved"), why, {}, false); });
  dialog->show();
}

void MainWindow::ask_report() {
  if (!bridge_.head()) return;
  const QString file =
      ask_where(tr("Save a report of the session"), QStringLiteral("report"),
                chosen(settings_, "folders/pictures").toString(), QStringLiteral(".html"), tr("Web pages (*.html)"));
  if (!file.isEmpty()) save_report(file);
}

void MainWindow::save_report(const QString& file) {
  const SnapshotPtr head = bridge_.head();
  const SessionFacts facts = {.title = desk_.title(),
                              .file = text(bridge_.file()),
                              .begun = session_->begun(),
                              .now = QDateTime::currentDateTime(),
                              .tools = session_->tools(),
                              .undone = session_->undone(),
                              .document = bridge_.document()->statistics(),
                              .info = bridge_.document()->info(),
                              .slabs = head->slab_mesh().slab_count(),
                              .named = !Shelf::is_unnamed(text(bridge_.file())),
                              .hand = figures_of(hand_->monitor(), hand_->title())};
  in_background(
      this,
      [head, facts, file, frame = viewport_->final_frame()]() -> Status {
        RELIEF_TRY(const Picture picture, draw_picture(*head, frame));
        const QImage image(picture.rgb.data(), picture.width, picture.height, 3 * picture.width, QImage::Format_RGB888);
        const QByteArray page = session_report(facts, image);
        QSaveFile out(file);
        if (out.open(QIODevice::WriteOnly) && out.write(page) == page.size() && out.commit()) return {};
        return fail(Errc::Io, file.toStdString() + ": " + out.errorString().toStdString());
      },
      [this, file](const Status& status) {
        if (!status) {
          show_failure(tr("The report could not be saved"), error_text(status.error()), file, false);
          return;
        }
        event_log().write(QStringLiteral("report"), {{"file", file}});
        say(tr("Report saved: %1").arg(file));
      });
}

}  // namespace relief::studio
