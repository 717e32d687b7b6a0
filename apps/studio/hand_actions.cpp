// The hand in the window: its menu, button, panel, keys, and what of it lies over the picture.
#include "device_panel.h"
#include "docks.h"
#include "hand.h"
#include "hand_overlay.h"
#include "hand_text.h"
#include "main_window.h"
#include "panic_keys.h"
#include "shelf.h"
#include "text.h"
#include "widgets/accessible.h"
#include "widgets/banner.h"
#include "widgets/column_area.h"
#include "widgets/force_meter.h"
#include "widgets/icons.h"
#include "widgets/theme.h"

#include <QActionGroup>
#include <QDateTime>
#include <QDir>
#include <QFileDialog>
#include <QFileInfo>
#include <QLabel>
#include <QMenu>
#include <QMenuBar>
#include <QToolBar>
#include <QToolButton>
#include <utility>

namespace relief::studio {

namespace {

// Subjects of the banner.
const QString kHand = QStringLiteral("hand"), kForcesOff = QStringLiteral("forces-off");

/// A new place for a recording of a model; its folder exists.
QString new_recording(const std::filesystem::path& model) {
  const QString folder = state_folder() + QStringLiteral("/recordings");
  QDir().mkpath(folder);
  return QStringLiteral("%1/%2-%3.rlog")
      .arg(folder, text(model.stem()), QDateTime::currentDateTime().toString(QStringLiteral("yyyyMMdd-HHmmss")));
}

/// Keeps a widget in the lower left corner of a view. As long as it is seen, the legend of colours stands beside it.
class CornerKeeper : public QObject {
 public:
  CornerKeeper(QWidget* widget, Viewport& view) : QObject(widget), widget_(widget), view_(view) {
    view.installEventFilter(this);
    widget->installEventFilter(this);
    place();
  }
  bool eventFilter(QObject* object, QEvent* event) override {
    const bool resized = object == &view_ && event->type() == QEvent::Resize;
    if (resized || event->type() == QEvent::ShowToParent || event->type() == QEvent::HideToParent) place();
    return false;
  }

 private:
  void place() {
    const int margin = scaled(16);
    widget_->resize(widget_->sizeHint());
    widget_->move(margin, view_.height() - widget_->height() - margin);
    view_.keep_left_free(widget_->isVisibleTo(&view_) ? widget_->geometry().right() + 1 : 0);
  }
  QWidget* widget_;
  Viewport& view_;
};

}  // namespace

void MainWindow::build_hand() {
  hand_ = new Hand(bridge_, tools_, this);
  hand_overlay_ = std::make_unique<HandOverlay>();
  viewport_->add_overlay(hand_overlay_.get());
  meter_ = new ForceMeter(viewport_);
  meter_->setAccessibleName(tr("Force meter"));  // the plot is called Force
  meter_->hide();
  new CornerKeeper(meter_, *viewport_);
  build_hand_actions();
  device_panel_ = new DevicePanel(*hand_, *devices_, this);
  auto* scroll = new ColumnArea(this);
  scroll->setWidget(device_panel_);
  device_dock_ = docks_->add(QStringLiteral("device-panel"), tr("Device"), tr("Device panel"), tr("Device"), scroll);
  docks_->put_under(*docks_->all().at(1), *device_dock_);
  device_ = new QToolButton(top_);
  device_->setObjectName(QStringLiteral("device"));
  device_->setAccessibleName(tr("Device"));
  device_->setToolButtonStyle(Qt::ToolButtonTextBesideIcon);
  device_->setIcon(icon(u"device"));
  device_->setMenu(devices_);
  device_->setPopupMode(QToolButton::InstantPopup);
  top_->addWidget(device_);
  connect_hand();
  show_hand();
}

void MainWindow::build_hand_actions() {
  devices_ = new QMenu(tr("&Devices"), this);
  // Help stays the last one.
  menuBar()->insertMenu(menuBar()->actions().last(), devices_);
  auto* group = new QActionGroup(this);
  for (const Hand::Choice& choice : Hand::choices()) {
    QAction* action = add(QStringLiteral("device-") + choice.id, choice.title, {}, {});
    action->setCheckable(true);
    action->setToolTip(choice.status);
    action->setStatusTip(choice.status);
    group->addAction(action);
    devices_->addAction(action);
    connect(action, &QAction::toggled, this, [this, id = choice.id](bool on) {
      if (on && hand_->id() != id) use_device(id);
    });
  }
  devices_->setToolTipsVisible(true);
  devices_->addAction(add(QStringLiteral("play-recording"), tr("&Play a recording …"), {}, [this] {
    const QString file = QFileDialog::getOpenFileName(
        this, tr("Play a recording"), state_folder() + QStringLiteral("/recordings"), tr("Recordings (*.rlog)"));
    if (!file.isEmpty()) play_recording(file);
  }));
  devices_->addSeparator();
  devices_->addAction(add(QStringLiteral("forces-off"), tr("&Forces off"), QKeySequence(Qt::Key_Pause),
                          [this] { hand_->set_forces(false); }));
  devices_->addAction(
      add(QStringLiteral("forces-on"), tr("Forces &on again"), {}, [this] { hand_->set_forces(true); }));
  devices_->addAction(add(QStringLiteral("recentre"), tr("&Re-centre"), {}, [this] { recentre_hand(); }));
  devices_->addAction(
      add(QStringLiteral("clutch"), tr("&Clutch"), {}, [this] { hand_->set_clutch(!hand_->clutched()); }));
  devices_->addAction(add(QStringLiteral("record"), tr("Re&cord"), {}, [this] { record_hand(!hand_->recording()); }));
  devices_->addAction(
      add(QStringLiteral("sound"), tr("&Sound of the contact"), {}, [this] { hand_->set_sound(!hand_->sound()); }));
  panic_ = new PanicKeys([this] { hand_->set_forces(false); }, this);
}

void MainWindow::connect_hand() {
  connect(hand_, &Hand::changed, this, &MainWindow::show_hand);
  connect(hand_, &Hand::safetyChanged, this, &MainWindow::show_hand_state);
  connect(hand_, &Hand::ticked, this, &MainWindow::show_hand_tick);
  connect(hand_, &Hand::said, this, &MainWindow::say);
  // Why forces went off without anybody's doing: it stays until somebody has read it.
  connect(hand_, &Hand::alarm, this, [this](const QString& sentence, bool good) {
    say_in_banner(good ? Mood::Good : Mood::Bad, sentence, kHand, {});
  });
  connect(device_panel_, &DevicePanel::recentreAsked, this, &MainWindow::recentre_hand);
  connect(device_panel_, &DevicePanel::recordAsked, this, [this] { record_hand(true); });
  connect(device_panel_, &DevicePanel::playAsked, this, [this] { play_recording(hand_->last_recording()); });
  connect(viewport_, &Viewport::pointed, hand_, &Hand::point);
  connect(viewport_, &Viewport::left, hand_, &Hand::leave);
  connect(viewport_, &Viewport::depthTurned, hand_, &Hand::turn_depth);
  // What it said of a model that is gone, nobody can act upon. A device that is lost ends the session, not the model.
  connect(&bridge_, &DocumentBridge::closed, this, [this] { banner_->retract(kHand); });
  connect(&bridge_, &DocumentBridge::opened, this,
          [this] { device_panel_->set_unit(bridge_.document()->info().unit); });
}

void MainWindow::use_device(const QString& id) {
  banner_->retract(kHand);  // it spoke of another session
  hand_->choose(id);
}
QString MainWindow::device() const { return hand_->id(); }

void MainWindow::play_recording(const QString& file) { use_device(QStringLiteral("replay:") + file); }

void MainWindow::recentre_hand() {
  hand_->recentre(viewport_->ray(QPointF(viewport_->width() * 0.5, viewport_->height() * 0.5)));
}

void MainWindow::record_hand(bool on) {
  if (on)
    hand_->record(new_recording(bridge_.file()));
  else
    hand_->stop_recording();
}

void MainWindow::show_hand() {
  const bool on = hand_->active(), arm = on && !hand_->probes();
  panic_->set_on(on);
  for (const char* id : {"forces-off", "forces-on", "record"}) actions_.at(id)->setEnabled(on);
  for (const char* id : {"recentre", "clutch"}) actions_.at(id)->setEnabled(arm);
  if (const auto found = actions_.find("device-" + hand_->id()); found != actions_.end())
    found->second->setChecked(true);
  if (!on) {
    hand_overlay_->shown.reset();
    viewport_->update_overlays();
    meter_->set_force(0);
  }
  // Whoever feels wants to see what.
  docks_->favour(on ? device_dock_ : nullptr);
  docks_->share_soon();
  meter_->setVisible(on);
  meter_->set_forces_on(hand_->forces());
  if (on && hand_->force_limit() > 0) meter_->set_limit(hand_->force_limit());
  // A servo beside a picture that the CPU draws needs the core more.
  viewport_->set_beside_servo(on);
  show_forces_off();
  show_hand_state();
}

/// A banner as long as somebody has switched the forces off.
void MainWindow::show_forces_off() {
  const bool off = hand_->active() && !hand_->forces();
  if (off == std::exchange(forces_off_shown_, off)) return;
  if (!off) {
    banner_->retract(kForcesOff);
    return;
  }
  say_in_banner(Mood::Warn, safety_sentence(hand_->safety(), true), kForcesOff,
                {{tr("Forces on again"), [this] { hand_->set_forces(true); }}});
}

void MainWindow::show_hand_state() {
  const QString state = hand_->active() ? safety_sentence(hand_->safety(), !hand_->forces()) : tr("no device");
  device_->setText(hand_->title());
  device_->setToolTip(state);
  describe(device_, state);
}

void MainWindow::show_hand_tick() {
  const ServoSample& sample = hand_->monitor().last();
  meter_->set_force(length(sample.force));
  hand_overlay_->shown = {.sample = sample, .force_limit = hand_->force_limit(), .has_orientation = false};
  viewport_->update_overlays();
}

}  // namespace relief::studio
