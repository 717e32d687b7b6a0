// What the window does about preferences: each takes effect as soon as it is chosen.
#include "desktop_scheme.h"
#include "hand.h"
#include "main_window.h"
#include "navigation_card.h"
#include "preferences.h"
#include "preferences_dialog.h"
#include "split_view.h"
#include "start_page.h"
#include "text.h"
#include "widgets/theme.h"

#include <relief/edit/stroke.h>

#include <QApplication>
#include <QLabel>

namespace relief::studio {

namespace {

NavigationMap map_named(const QString& name) {
  if (name == QLatin1String("industry")) return NavigationMap::Industry;
  return name == QLatin1String("pen") ? NavigationMap::Pen : NavigationMap::Blender;
}

/// "low high exponent"; empty where it is no curve.
std::optional<PressureCurve> curve_of(const QString& words) {
  const QStringList parts = words.split(QLatin1Char(' '));
  if (parts.size() != 3) return std::nullopt;
  Stroke stroke;  // the library says what a curve may be
  stroke.brush.pressure = {parts[0].toDouble(), parts[1].toDouble(), parts[2].toDouble()};
  return check(stroke) ? std::optional(stroke.brush.pressure) : std::nullopt;
}

QString words_of(const PressureCurve& curve) {
  return QStringLiteral("%1 %2 %3").arg(curve.low).arg(curve.high).arg(curve.exponent);
}

/// An action's tip tells the key that it has now.
QString tip_of(const QString& id, const QAction& action) {
  const QString key = action.shortcut().toString(QKeySequence::NativeText);
  return QStringLiteral("<b>%1</b>%2<br>%3")
      .arg(ToolState::title(id), key.isEmpty() ? QString() : QStringLiteral(" (%1)").arg(key), ToolState::help(id));
}

}  // namespace

/// After all actions are there.
void MainWindow::build_preferences() {
  connect(&keys_, &KeyMap::changed, this, [this] {
    for (const QString& id : ToolState::ids())
      actions_.at("tool-" + id)->setToolTip(tip_of(id, *actions_.at("tool-" + id)));
  });
  connect(&tools_, &ToolState::settingChanged, this, [this](const QString& setting) {
    if (setting == QLatin1String("use_pressure")) settings_.setValue("input/pressure", tools_.use_pressure());
    if (setting == QLatin1String("use_tilt")) settings_.setValue("input/tilt", tools_.use_tilt());
    if (setting == QLatin1String("pressure_curve"))
      settings_.setValue("input/pressure-curve", words_of(tools_.brush().pressure));
    if (setting == QLatin1String("pressure_drives"))
      settings_.setValue("input/pressure-drives", text(name(tools_.brush().pressure_drives)));
  });
  if (const auto curve = curve_of(settings_.value("input/pressure-curve").toString())) tools_.set_pressure(*curve);
  if (const auto drives = pressure_drives_from_name(settings_.value("input/pressure-drives").toString().toStdString()))
    tools_.set_value(QStringLiteral("pressure_drives"), static_cast<double>(*drives));
  connect(hand_, &Hand::changed, this, [this] {
    if (chosen(settings_, "forces/sound").toBool() != hand_->sound())
      settings_.setValue("forces/sound", hand_->sound());
  });
  keep_look();
  connect(&desktop_, &DesktopScheme::changed, this, [this] { use_preference("look/theme"); });
  keys_.take_over(actions_);
  for (const char* key : {"look/reduced-motion", "input/map", "input/turntable", "input/pressure", "input/tilt",
                          "input/single-keys", "drawing/samples", "forces/most", "forces/sound", "folders/unnamed"})
    use_preference(key);
  ask_for_navigation();
  if (!keys_.complaint().isEmpty())
    QMetaObject::invokeMethod(this, [this] { say(keys_.complaint()); }, Qt::QueuedConnection);
}

/// The clay and the light are chosen for good; wires and maps are a look at this model.
void MainWindow::keep_look() {
  for (std::size_t k = 0; k < matcaps().size(); ++k) {
    QAction* action = actions_.at(QStringLiteral("matcap-%1").arg(k));
    const QString clay = text(matcaps()[k]);
    if (settings_.value("look/clay").toString() == clay) action->setChecked(true);
    connect(action, &QAction::toggled, this, [this, clay](bool on) {
      if (on) settings_.setValue("look/clay", clay);
    });
  }
  for (const char* id : {"cavity", "studio-light"}) {
    QAction* action = actions_.at(QLatin1String(id));
    const QString key = QStringLiteral("look/") + QLatin1String(id);
    action->setChecked(settings_.value(key, action->isChecked()).toBool());
    connect(action, &QAction::toggled, this, [this, key](bool on) { settings_.setValue(key, on); });
  }
}

void MainWindow::show_preferences(const QString& page) {
  if (!preferences_) {
    const QString device =
        viewport_->device().isEmpty() ? tr("not known before the first picture") : viewport_->device();
    preferences_ = new PreferencesDialog(
        settings_, keys_, drawing_->text().isEmpty() ? device : drawing_->text() + QStringLiteral(": ") + device, this);
    preferences_->setAttribute(Qt::WA_DeleteOnClose);
    connect(preferences_, &PreferencesDialog::changed, this, &MainWindow::use_preference);
  }
  if (!page.isEmpty()) preferences_->show_page(page);
  preferences_->show();
  preferences_->raise();
  preferences_->activateWindow();
}

void MainWindow::use_preference(const QString& key) {
  const QVariant value = chosen(settings_, key);
  if (key == QLatin1String("look/theme") || key == QLatin1String("look/text"))
    apply(*qApp, theme_for(chosen(settings_, "look/theme").toString(), desktop_.dark()),
          chosen(settings_, "look/text").toInt() / 100.0);
  if (key == QLatin1String("look/reduced-motion")) {
    setAnimated(!value.toBool());
    set_reduced_motion(value.toBool());
  }
  if (key == QLatin1String("input/map")) {
    views_->set_map(map_named(value.toString()));
    if (settings_.contains(key)) ask_for_navigation();
  }
  if (key == QLatin1String("input/turntable")) views_->set_turntable(value.toBool());
  if (key == QLatin1String("input/pressure") && tools_.use_pressure() != value.toBool())
    tools_.set_use_pressure(value.toBool());
  if (key == QLatin1String("input/tilt")) tools_.set_use_tilt(value.toBool());
  if (key == QLatin1String("input/single-keys")) keys_.set_single_keys(value.toBool());
  if (key == QLatin1String("drawing/samples")) {
    viewport_->set_final_samples(value.toInt());
    viewport_->redraw_everything();
  }
  if (key == QLatin1String("forces/most")) hand_->set_force_cap(value.toInt() / 100.0);
  if (key == QLatin1String("forces/sound") && hand_->sound() != value.toBool()) hand_->set_sound(value.toBool());
  if (key == QLatin1String("folders/unnamed")) Shelf::set_unnamed_folder(value.toString());
  if (key == QLatin1String("language")) build_anew();
}

/// Asked on the start page until it is answered, there or in the preferences.
void MainWindow::ask_for_navigation() {
  start_->set_question([this](QWidget* parent) -> QWidget* {
    if (settings_.contains("input/map")) return nullptr;
    auto* card = new NavigationCard(parent);
    // Queued: the card goes away with the page that it is on.
    connect(
        card, &NavigationCard::mapChosen, this,
        [this](const QString& map) {
          settings_.setValue("input/map", map);
          use_preference("input/map");
        },
        Qt::QueuedConnection);
    return card;
  });
}

void MainWindow::build_anew() {
  last_file_ = text(bridge_.file());
  wants_another_ = true;
  if (!close()) wants_another_ = false;
}

}  // namespace relief::studio
