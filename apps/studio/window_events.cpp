// What the window does about what happens: in the document, to files, in the picture.
#include "docks.h"
#include "document_log.h"
#include "event_log.h"
#include "failure_dialog.h"
#include "history_panel.h"
#include "layers_panel.h"
#include "main_window.h"
#include "split_view.h"
#include "start_page.h"
#include "text.h"
#include "tool_panel.h"
#include "widgets/banner.h"
#include "widgets/card.h"
#include "widgets/colour_palette.h"
#include "widgets/progress_strip.h"
#include "widgets/theme.h"
#include "widgets/value_bar.h"

#include <QFile>
#include <QFileInfo>
#include <QLabel>
#include <QPushButton>
#include <QStackedWidget>

namespace relief::studio {

namespace {

const QString kUnsaved = QStringLiteral("unsaved");  // a subject of the banner

/// Returns that a stroke can go no further at a place.
QString end_text(Vec3d at, double across, Unit unit) {
  return MainWindow::tr("The clay ends at %1: no further in this direction.").arg(place_text(at, across, unit));
}

/// Returns what of the form keeps a stroke from going on, where that is known.
QString bar_text(const RoomEnded& room, double across, Unit unit) {
  switch (room.bar) {
    case RoomBar::FarSide:
      return MainWindow::tr(
                 "The form is %1 thick at %2. A stroke goes to about its middle, for slabs cannot have holes.")
          .arg(length_text(room.bar_distance, unit), place_text(room.bar_at, across, unit));
    case RoomBar::OtherPart:
      return MainWindow::tr("Another part of the form is %1 away from %2. A stroke grows to about the middle.")
          .arg(length_text(room.bar_distance, unit), place_text(room.bar_at, across, unit));
    default:
      break;
  }
  if (!(room.overhang > 0)) return {};
  const QString under = length_text(room.overhang, unit), at = place_text(room.overhang_at, across, unit);
  return room.fibres > 0 || room.lacking == 0
             ? MainWindow::tr(
                   "The tool goes %1 under the surface at %2. Slabs cannot hold undercuts: the clay above goes, too.")
                   .arg(under, at)
             : MainWindow::tr(
                   "The clay ends at %2: the tool goes %1 under the surface, and slabs cannot hold undercuts.")
                   .arg(under, at);
}

}  // namespace

void MainWindow::connect_document() {
  log_document(bridge_, *viewport_);
  connect(&bridge_, &DocumentBridge::snapshotChanged, this, [this](const Box3d&) {
    const SnapshotPtr head = bridge_.head();
    if (layers_->set_model(head.get())) docks_->share_soon();
    viewport_->set_model(head);
  });
  connect(&bridge_, &DocumentBridge::strokeFinished, this, [this](const StrokeFinished& stroke) {
    bar_told_ = false;
    if (stroke.source == 0 && std::exchange(making_room_, false) && stroke.cancelled)
      say(tr("The stroke was taken back."));
    if (stroke.result.changed) keep_tools();  // as the model is: what was done stays, however the program ends
    if (stroke.result.changed && info(stroke.tool).writes == Layer::Colour) {
      colours_->mark_used(colours_->colour());
      docks_->share_soon();
      QStringList used;
      for (const QColor& each : colours_->last_used()) used.append(each.name());
      settings_.setValue("colours/used", used);
    }
  });
  connect(&bridge_, &DocumentBridge::historyChanged, this, [this] { refresh(); });
  connect(&bridge_, &DocumentBridge::saved, this, [this] { banner_->retract(kUnsaved); });
  connect(&bridge_, &DocumentBridge::savedElsewhere, this, [this](const QString& file, bool whole) {
    event_log().write(QStringLiteral("saved-elsewhere"), {{"file", file}});
    end_aside(std::exchange(saving_, nullptr));
    say(whole ? tr("Saved as %1").arg(file) : tr("Saved as %1, with the last steps of the history").arg(file));
    refresh();
  });
  connect(&bridge_, &DocumentBridge::limitReached, this, [this](const StrokeResult& so_far) {
    if (!bar_told_) say(end_text(so_far.limited_at, across_, unit_));
  });
  connect(&bridge_, &DocumentBridge::pointMissed, this, [this](const Vec3d& at) {
    say(tr("The tool leaves the surface on the way to %1: what it does there is left out.")
            .arg(place_text(at, across_, unit_)));
  });
  connect(&bridge_, &DocumentBridge::detailLimited, this, [this](const Vec3d& at) {
    say(tr("The surface stays coarser at %1 than this tool wants. A larger radius helps.")
            .arg(place_text(at, across_, unit_)));
  });
  connect(&bridge_, &DocumentBridge::takenBeside, this, [this](const Vec3d& at) {
    if (std::exchange(lean_told_, true)) return;
    say(tr("The fibres lean at %1: the tool takes some clay from beside it, too.").arg(place_text(at, across_, unit_)));
  });
  connect(&bridge_, &DocumentBridge::closed, this, [this] {
    making_room_ = changing_cage_ = false;
    end_aside(std::exchange(saving_, nullptr));
  });
  connect(&bridge_, &DocumentBridge::roomAsked, this, [this](quint32 source, bool runs_out) {
    making_room_ = source == 0;  // another hand's stroke is not the keyboard's to take back
    room_told_ = runs_out;
    if (!room_told_) return;  // where it takes long the status bar says so
    say(making_room_ ? tr("Making room under the stroke … Esc takes the stroke back.")
                     : tr("Making room under the stroke …"));
  });
  connect(&bridge_, &DocumentBridge::roomEnded, this, [this](const RoomEnded& room) {
    const QString bar = bar_text(room, across_, unit_);
    bar_told_ = !bar.isEmpty();
    if (bar_told_)
      say(bar);
    else if (!room_told_)
      return;  // nothing ran out; what is still taken from beside the tool, takenBeside tells
    else if (room.fibres == 0 && room.bar != RoomBar::None)
      say(end_text(room.bar_at, across_, unit_));
    else if (room.fibres == 0)
      say(tr("The clay ends here: no further in this direction."));
    else if (room.lacking == 0)
      say(tr("There is room again."));
    else
      say(tr("There is more room now, but at %1 not as much as the stroke wants.")
              .arg(place_text(room.bar_at, across_, unit_)));
  });
  connect(&bridge_, &DocumentBridge::cageChanged, this, [this](const CageChanged& change) {
    changing_cage_ = false;
    const QString label = text(change.label);
    if (change.changed && change.surface_moved > 0)
      say(tr("%1: done; the surface moved by at most %2")
              .arg(label, length_text(change.surface_moved, bridge_.document()->info().unit)));
    else if (change.changed)
      say(tr("%1: done").arg(label));
    else if (change.cancelled)
      say(tr("%1: stopped").arg(label));
    else if (!change.failed)
      say(tr("%1: nothing to do").arg(label));
    refresh();
  });
  connect(&bridge_, &DocumentBridge::progressed, this, [this](const QString& phase, double share) {
    if (phase == QLatin1String("copy") || phase == QLatin1String("save")) tell_aside(saving_, tr("Saving …"), share);
    if (making_room_ && phase == QLatin1String("room"))
      say_in_status(tr("Making room under the stroke: %1 %. Esc takes the stroke back.").arg(qRound(share * 100)));
    if (changing_cage_)
      say_in_status(tr("Working on the slabs: %1 %. You can go on sculpting.").arg(qRound(share * 100)));
  });
  connect(&bridge_, &DocumentBridge::strokeRefused, this,
          [this] { say(tr("The other hand is at work; the stroke was not begun.")); });
  connect(&bridge_, &DocumentBridge::historyDropped, this, [this](quint64 steps) {
    say(tr("%n old step(s) can no more be undone.", nullptr, static_cast<int>(steps)));
  });
  connect(&bridge_, &DocumentBridge::notSavedElsewhere, this, [this](bool was_cancelled) {
    end_aside(std::exchange(saving_, nullptr));
    if (!was_cancelled) return;
    const QString file = text(bridge_.file());
    say(tr("Cancelled: nothing was written. The model goes on in %1.")
            .arg(Shelf::is_unnamed(file) ? desk_.title() : QFileInfo(file).fileName()));
  });
  connect(&bridge_, &DocumentBridge::failed, this, [this](const QString& message, quint64 unsaved) {
    if (unsaved == 0) {
      say(message);
      return;
    }
    const QString words =
        tr("%n stroke(s) could not be saved yet: %1. You can go on; it is tried again every ten seconds.", nullptr,
           static_cast<int>(unsaved))
            .arg(message);
    say_in_banner(Mood::Warn, words, kUnsaved, {{tr("Save elsewhere …"), [this] { ask_save_as(); }}});
  });
}

void MainWindow::connect_files() {
  connect(start_, &StartPage::openAsked, this, &MainWindow::ask_open);
  connect(start_, &StartPage::fileAsked, this, [this](const QString& file) { open(file); });
  connect(start_, &StartPage::sampleAsked, &desk_, &FileDesk::open_sample);
  connect(viewport_, &Viewport::dropped, this, [this](const QStringList& files) {
    if (!files.isEmpty()) open(files.first());
  });
  connect(&desk_, &FileDesk::said, this, &MainWindow::say);
  connect(&desk_, &FileDesk::progress, convert_, &ProgressStrip::set_progress);
  connect(convert_, &ProgressStrip::cancelRequested, this, [this] {
    if (aside_)
      *aside_ = true;
    else
      desk_.cancel();
  });
  connect(&desk_, &FileDesk::openingBegun, this, [this](const QString&) {
    if (!camera_) camera_before_ = viewport_->camera();
    aside_.reset();
    convert_->start(tr("Opening"));
    opening_->show();
    opening_->raise();
    place_over();
    if (card_ != nullptr) card_->hide();
    viewport_->set_scene({}, unit_, false);
    verdict_.reset();
    refresh();
  });
  connect(&desk_, &FileDesk::meshReady, this, [this](const std::shared_ptr<const TriangleMesh>& mesh) {
    pages_->setCurrentWidget(views_);
    unit_ = mesh->unit.value_or(Unit::Millimetre);
    viewport_->set_scene({nullptr, mesh}, unit_, true);
    fit_tools(bounds(*mesh));
    refresh();
  });
  connect(&desk_, &FileDesk::opened, this, [this](const std::optional<Verdict>& verdict, const QString& doubt) {
    convert_->finish();
    opening_->hide();
    const SnapshotPtr head = bridge_.head();
    unit_ = bridge_.document()->info().unit;
    across_ = bridge_.document()->info().source_diagonal;
    lean_told_ = false;
    const bool frame_it = viewport_->scene().mesh == nullptr;
    fit_tools(surface_bounds(*head));
    layers_->set_model(head.get());
    pages_->setCurrentWidget(views_);
    viewport_->set_scene({head, nullptr}, unit_, frame_it);
    actions_.at("z-up")->setChecked(settings_.value("models/z-up/" + desk_.title(), false).toBool());
    if (const auto camera = std::exchange(camera_, std::nullopt)) viewport_->set_camera(*camera);
    viewport_->setFocus();
    refresh();
    show_verdict(verdict, doubt);
  });
  const auto end_opening = [this] {
    convert_->finish();
    opening_->hide();
    if (bridge_.document() == nullptr) {
      viewport_->set_scene({}, unit_, false);
      pages_->setCurrentWidget(start_);
    }
    if (desk_.goes_back()) camera_ = camera_before_;
    refresh();
  };
  connect(&desk_, &FileDesk::cancelled, this, [this, end_opening] {
    end_opening();
    say(tr("Cancelled; nothing was kept."));
  });
  connect(&desk_, &FileDesk::failed, this,
          [this, end_opening](const QString& title, const QString& why, const QString& file, bool damaged) {
            end_opening();
            show_failure(title, why, file, damaged);
          });
  connect(&bridge_, &DocumentBridge::closed, this, [this] {
    viewport_->set_scene({}, unit_, false);
    layers_->set_model(nullptr);
    pages_->setCurrentWidget(start_);
    refresh();
  });
}

/// Sizes of tools go by the size of what is seen, in unit_.
void MainWindow::fit_tools(const Box3d& surface) {
  tools_.set_diagonal(diagonal(surface));
  tools_.set_mirror(surface.centre());
  radius_->set_range(tools_.least_radius(), tools_.most_radius(), ValueBar::Scale::Logarithmic);
  radius_->set_format(length_format(text(name(unit_))));
  radius_->set_real_value(tools_.value("radius"));
  tool_panel_->set_unit(unit_);
}

void MainWindow::connect_view() {
  connect(viewport_, &Viewport::said, this, &MainWindow::say);
  connect(viewport_, &Viewport::undoAsked, actions_.at("undo"), &QAction::trigger);
  connect(viewport_, &Viewport::pointerKnown, this, [this](const QString& name, double pressure, double tilt) {
    tool_panel_->set_pointer(
        tr("Pen: %1, pressure %2, tilt %3°").arg(name).arg(pressure, 0, 'f', 2).arg(tilt, 0, 'f', 0), pressure);
  });
  // For the start page, should the program end without closing; the one that shows the work is made at the end.
  connect(viewport_, &Viewport::settled, this, [this] {
    if (!QFile::exists(Shelf::picture_of(text(bridge_.file())))) keep_picture();
  });
  connect(viewport_, &Viewport::deviceKnown, this, [this](const QString& name, bool software) {
    drawing_->setText(software ? tr("Software drawing") : name.section(QLatin1Char('/'), 0, 0));
    drawing_->setToolTip(name);
    fit_status();
  });
  connect(viewport_, &Viewport::colourPicked, this,
          [this](Vec3f colour) { choose_colour(QColor::fromRgbF(colour.x, colour.y, colour.z)); });
  connect(&tools_, &ToolState::toolChanged, this, [this](const QString& id) {
    event_log().write(QStringLiteral("tool"), {{"id", id}});
    if (QAction* action = actions_.at("tool-" + id); !action->isChecked()) action->setChecked(true);
    strength_->set_real_value(tools_.value("strength"));
    docks_->set_heading(*docks_->all().front(), ToolState::title(id));
    refresh();
  });
  connect(&tools_, &ToolState::settingChanged, this, [this](const QString& setting) {
    event_log().write(QStringLiteral("setting"), {{"id", setting}, {"value", tools_.value(setting)}});
    if (setting == QLatin1String("radius")) radius_->set_real_value(tools_.value(setting));
    if (setting == QLatin1String("strength")) strength_->set_real_value(tools_.value(setting));
    if (setting == QLatin1String("symmetry")) actions_.at("symmetry")->setChecked(tools_.brush().symmetry != 0);
  });
  strength_->set_real_value(tools_.value("strength"));
}

void MainWindow::show_verdict(const std::optional<Verdict>& verdict, const QString& doubt) {
  verdict_ = verdict;
  say_state();
  if (verdict) {
    event_log().write(QStringLiteral("verdict"),
                      {{"title", verdict->title}, {"text", verdict->lines.join(QLatin1Char(' '))}});
    if (card_ == nullptr) card_ = new Card(verdict->title, verdict->lines, viewport_);
    card_->set_title(verdict->title);
    card_->setObjectName(QStringLiteral("verdict"));
    card_->set_lines(verdict->lines);
    card_->set_mood(verdict->certified ? Mood::Good : Mood::Warn);
    if (card_->findChild<QPushButton*>() == nullptr) {
      QPushButton* upright = card_->add_button(tr("Stand it up"));
      upright->setToolTip(tr("For scans whose z axis points up"));
      connect(upright, &QPushButton::clicked, actions_.at("z-up"), &QAction::toggle);
      anew_ = card_->add_button(tr("Mend it and try again"));
      anew_->setToolTip(tr("Makes the scan a solid first; what is thinner than its voxels is lost"));
      connect(anew_, &QPushButton::clicked, &desk_, &FileDesk::open_anew);
      connect(card_->add_button(tr("Begin"), true), &QPushButton::clicked, card_, &QWidget::hide);
    }
    anew_->setVisible(!verdict->certified);
    card_->show();
    place_over();
  }
  if (!doubt.isEmpty()) say(error_text({Errc::Corrupt, doubt.toStdString()}));
}

void MainWindow::show_failure(const QString& title, const QString& why, const QString& file, bool damaged) {
  event_log().write(QStringLiteral("failed"), {{"title", title}, {"message", why}, {"file", file}});
  auto* dialog = new FailureDialog(title, why, file, this);
  if (damaged) dialog->add_remedy(tr("Save what is whole …"), [this, file] { ask_salvage(file); });
  if (bridge_.document() != nullptr && bridge_.document()->statistics().unsaved > 0)
    dialog->add_remedy(tr("Save elsewhere …"), [this] { ask_save_as(); });
  if (bridge_.document() == nullptr) dialog->add_remedy(tr("Open another file …"), [this] { ask_open(); });
  dialog->open();
}

}  // namespace relief::studio
