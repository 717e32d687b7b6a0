// All that can be done in the window, as actions: menus, keys and the command palette are made of them.
#include "docks.h"
#include "event_log.h"
#include "main_window.h"
#include "split_view.h"
#include "text.h"
#include "widgets/command_palette.h"
#include "widgets/icons.h"
#include "widgets/theme.h"

#include <relief/base/try.h>
#include <relief/convert/refine.h>

#include <QApplication>
#include <QDockWidget>
#include <QMenuBar>

namespace relief::studio {

QAction* MainWindow::add(const QString& id, const QString& title, const QKeySequence& key, std::function<void()> call) {
  auto* action = new QAction(title, this);
  action->setObjectName(id);
  action->setShortcut(key);
  action->setShortcutContext(Qt::WindowShortcut);
  if (has_icon(id)) action->setIcon(icon(id));
  if (call) connect(action, &QAction::triggered, this, [call = std::move(call)] { call(); });
  addAction(action);
  actions_[id] = action;
  return action;
}

void MainWindow::build_actions() {
  add("open", tr("&Open …"), QKeySequence::Open, [this] { ask_open(); });
  add("save", tr("&Save"), QKeySequence::Save, [this] {
    if (bridge_.document() == nullptr) return;
    if (Shelf::is_unnamed(text(bridge_.file())))
      ask_save_as();
    else if (bridge_.document()->statistics().unsaved > 0)
      say(tr("Saving …"));
    else
      say(tr("Saved as you work: every finished stroke is in %1.")
              .arg(QString::fromStdString(bridge_.file().filename().string())));
  });
  add("save-as", tr("Save &as …"), QKeySequence::SaveAs, [this] { ask_save_as(); });
  add("export", tr("&Export …"), QKeySequence(Qt::CTRL | Qt::Key_E), [this] { ask_export(); });
  add("picture", tr("Save a &picture"), QKeySequence(Qt::Key_F12), [this] { ask_picture(); });
  add("close-model", tr("&Close the model"), QKeySequence::Close, [this] {
    QString why;
    keep_picture();
    if (!desk_.close(why)) show_failure(tr("The model could not be closed"), why, {}, false);
  });
  add("quit", tr("&Quit"), QKeySequence::Quit, [this] { close(); });

  add("preferences", tr("&Preferences …"), QKeySequence(Qt::CTRL | Qt::Key_Comma), [this] { show_preferences(); });

  add("undo", tr("Undo"), QKeySequence::Undo, [this] { bridge_.post(Undo{}); });
  add("redo", tr("Redo"), QKeySequence(Qt::CTRL | Qt::SHIFT | Qt::Key_Z), [this] { bridge_.post(Redo{}); });
  add("repeat-stroke", tr("Repeat the last stroke"), QKeySequence(Qt::SHIFT | Qt::Key_R),
      [this] { views_->repeat_stroke(); });

  const auto add_refine = [this](const char* id, const QString& title, RefineWhere where) {
    add(QLatin1String(id), title, {}, [this, title, where] { refine_model(title, where); });
  };
  add_refine("refine-saturated", tr("Make &room where the clay has run out"), RefineWhere::Saturated);
  add_refine("refine-all", tr("Make everything &finer"), RefineWhere::All);
  add_refine("refine-model", tr("Make &new slabs for the model"), RefineWhere::Model);
  add("stop-refining", tr("Stop making slabs"), {}, [this] { bridge_.post(CancelChanges{}); });

  tool_group_ = new QActionGroup(this);
  for (const QString& id : ToolState::ids()) {
    QAction* tool = add("tool-" + id, ToolState::title(id), QKeySequence(ToolState::key(id)), {});
    tool->setIcon(icon(id));
    tool->setCheckable(true);
    tool->setToolTip(
        QStringLiteral("<b>%1</b> (%2)<br>%3").arg(ToolState::title(id), ToolState::key(id), ToolState::help(id)));
    tool->setStatusTip(ToolState::help(id));
    tool_group_->addAction(tool);
    // Assistive tools check the button without triggering the action.
    connect(tool, &QAction::toggled, this, [this, id](bool on) {
      if (on) tools_.choose(id);
    });
  }
  add("drag-radius", tr("Set the radius with the mouse"), QKeySequence(Qt::Key_F),
      [this] { views_->pointed_at().begin_drag("radius"); });
  add("drag-strength", tr("Set the strength with the mouse"), QKeySequence(Qt::SHIFT | Qt::Key_F),
      [this] { views_->pointed_at().begin_drag("strength"); });
  add("radius-less", tr("Smaller radius"), QKeySequence(Qt::Key_BracketLeft),
      [this] { tools_.set_value("radius", tools_.value("radius") / 1.1); });
  add("radius-more", tr("Larger radius"), QKeySequence(Qt::Key_BracketRight),
      [this] { tools_.set_value("radius", tools_.value("radius") * 1.1); });
  QAction* symmetry = add("symmetry", tr("Symmetry"), QKeySequence(Qt::Key_X), {});
  symmetry->setCheckable(true);
  connect(symmetry, &QAction::toggled, this, [this](bool on) {
    if (on != (tools_.brush().symmetry != 0)) tools_.set_value("symmetry", on ? 1 : 0);
  });
  add("pick-colour", tr("Pick a colour from the model"), QKeySequence(Qt::SHIFT | Qt::Key_S),
      [this] { views_->pointed_at().pick_colour(); });

  add("frame", tr("Show all"), QKeySequence(Qt::Key_Home), [this] { viewport_->frame_all(); });
  struct AxisKey {
    const char *id, *title;
    int key;
    AxisView view, opposite;
  };
  const std::array axes = {
      AxisKey{"front", QT_TR_NOOP("View from the front"), Qt::Key_1, AxisView::Front, AxisView::Back},
      AxisKey{"right", QT_TR_NOOP("View from the right"), Qt::Key_3, AxisView::Right, AxisView::Left},
      AxisKey{"top", QT_TR_NOOP("View from above"), Qt::Key_7, AxisView::Top, AxisView::Bottom}};
  const std::array opposites = {QT_TR_NOOP("View from behind"), QT_TR_NOOP("View from the left"),
                                QT_TR_NOOP("View from below")};
  for (std::size_t k = 0; k < axes.size(); ++k) {
    const AxisKey& axis = axes[k];
    const auto keys = [&](Qt::KeyboardModifiers m) {
      return QList<QKeySequence>{QKeySequence(m | Qt::Key(axis.key)),
                                 QKeySequence(m | Qt::KeypadModifier | Qt::Key(axis.key))};
    };
    add(QStringLiteral("view-") + axis.id, tr(axis.title), {}, [this, view = axis.view] {
      viewport_->set_camera(look_along(viewport_->camera(), view, viewport_->up()));
    })->setShortcuts(keys(Qt::NoModifier));
    add(QStringLiteral("view-not-") + axis.id, tr(opposites[k]), {}, [this, view = axis.opposite] {
      viewport_->set_camera(look_along(viewport_->camera(), view, viewport_->up()));
    })->setShortcuts(keys(Qt::ControlModifier));
  }
  struct Step {
    const char *id, *title;
    int key;
    double right, down;
  };
  constexpr double kStep = 0.2617993877991494;  // 15 degrees
  // The eye goes to the side that the key names, as in Blender: the model's turn is the opposite one.
  for (const Step& step : {Step{"turn-left", QT_TR_NOOP("Turn the view left"), Qt::Key_4, kStep, 0},
                           Step{"turn-right", QT_TR_NOOP("Turn the view right"), Qt::Key_6, -kStep, 0},
                           Step{"turn-up", QT_TR_NOOP("Turn the view up"), Qt::Key_8, 0, kStep},
                           Step{"turn-down", QT_TR_NOOP("Turn the view down"), Qt::Key_2, 0, -kStep}})
    add(QString::fromLatin1(step.id), tr(step.title), QKeySequence(step.key),
        [this, step] { viewport_->set_camera(orbit(viewport_->camera(), step.right, step.down, true)); });
  for (const auto& [id, title, key, side] : {std::tuple{"roll-left", QT_TR_NOOP("Roll left"), Qt::Key_4, 1.0},
                                             std::tuple{"roll-right", QT_TR_NOOP("Roll right"), Qt::Key_6, -1.0}})
    add(QString::fromLatin1(id), tr(title), QKeySequence(Qt::SHIFT | key),
        [this, side] { viewport_->set_camera(roll(viewport_->camera(), side * kStep)); });
  add("lens", tr("Perspective or parallel"), QKeySequence(Qt::Key_5),
      [this] { viewport_->set_camera(with_lens(viewport_->camera(), !viewport_->camera().parallel)); });
  QAction* up = add("z-up", tr("The z axis is up"), {}, {});
  up->setCheckable(true);
  connect(up, &QAction::toggled, this, [this](bool on) {
    if (on == (viewport_->up().z > 0)) return;
    settings_.setValue("models/z-up/" + desk_.title(), on);
    viewport_->set_up(on ? Vec3d{0, 0, 1} : Vec3d{0, 1, 0});
  });
  const auto look_switch = [this](const QString& id, const QString& title, const QKeySequence& key,
                                  std::function<bool(const Look&)> get, std::function<void(Look&, bool)> put) {
    QAction* action = add(id, title, key, {});
    action->setCheckable(true);
    action->setChecked(get(viewport_->look()));
    connect(action, &QAction::toggled, this, [this, put](bool on) {
      Look look = viewport_->look();
      put(look, on);
      use_look(look);
    });
  };
  look_switch(
      "wires", tr("Slab wires"), QKeySequence(Qt::ALT | Qt::Key_W), [](const Look& l) { return l.slab_wires; },
      [](Look& l, bool on) { l.slab_wires = on; });
  look_switch(
      "heat", tr("Heat map"), QKeySequence(Qt::ALT | Qt::Key_H),
      [](const Look& l) { return l.map == Look::Map::Displacement; },
      [](Look& l, bool on) { l.map = on ? Look::Map::Displacement : Look::Map::None; });
  look_switch(
      "cavity", tr("Cavity"), {}, [](const Look& l) { return l.cavity; }, [](Look& l, bool on) { l.cavity = on; });
  look_switch(
      "studio-light", tr("Studio light when still"), QKeySequence(Qt::ALT | Qt::Key_L),
      [](const Look& l) { return l.light == Look::Light::Studio; },
      [](Look& l, bool on) { l.light = on ? Look::Light::Studio : Look::Light::Matcap; });
  add("redraw", tr("Draw again"), QKeySequence(Qt::CTRL | Qt::SHIFT | Qt::Key_R),
      [this] { viewport_->redraw_everything(); });

  add("panels", tr("Hide or show all panels"), QKeySequence(Qt::Key_F4), [this] { docks_->close_or_open_all(); });
  QAction* full = add("fullscreen", tr("Full screen"), QKeySequence(Qt::Key_F11), {});
  full->setCheckable(true);
  connect(full, &QAction::toggled, this, [this](bool on) { on ? showFullScreen() : showNormal(); });
  add("theme", tr("Light or dark"), {}, [this] {
    settings_.setValue("look/theme", is_dark(current_theme()) ? "light" : "dark");
    use_preference("look/theme");
  });
  build_film_actions();
  add_words();
}

/// What other programs and people call these commands; the palette finds them by it.
void MainWindow::add_words() {
  for (const auto& [id, words] : {std::pair{"open", tr("load import file scan")},
                                  {"save", tr("write store")},
                                  {"export", tr("write mesh stl obj ply glb 3mf print")},
                                  {"picture", tr("screenshot image render png")},
                                  {"turntable", tr("film video animation")},
                                  {"report", tr("summary protocol html")},
                                  {"quit", tr("exit leave program")},
                                  {"preferences", tr("settings options language shortcuts")},
                                  {"undo", tr("back revert")},
                                  {"redo", tr("again repeat")},
                                  {"repeat-stroke", tr("once more same again")},
                                  {"refine-saturated", tr("clay ends extend remesh")},
                                  {"refine-all", tr("subdivide detail resolution")},
                                  {"refine-model", tr("remesh rebuild convert")},
                                  {"drag-radius", tr("brush size")},
                                  {"drag-strength", tr("brush intensity")},
                                  {"radius-less", tr("brush size smaller")},
                                  {"radius-more", tr("brush size bigger")},
                                  {"symmetry", tr("mirror")},
                                  {"pick-colour", tr("eyedropper pipette sample")},
                                  {"frame", tr("zoom fit reset home centre")},
                                  {"lens", tr("orthographic projection camera")},
                                  {"z-up", tr("upright orientation rotate stand")},
                                  {"wires", tr("wireframe edges grid")},
                                  {"heat", tr("displacement height colours")},
                                  {"cavity", tr("hollows ambient occlusion")},
                                  {"studio-light", tr("shadows quality lighting")},
                                  {"redraw", tr("refresh repaint")},
                                  {"panels", tr("sidebar docks interface")},
                                  {"fullscreen", tr("maximise window")},
                                  {"theme", tr("theme dark mode light mode appearance night")}})
    CommandPalette::set_words(*actions_.at(QString::fromLatin1(id)), words);
}

void MainWindow::build_menus() {
  const auto fill = [this](QMenu* menu, std::initializer_list<const char*> ids) {
    for (const char* id : ids) {
      if (*id == '-')
        menu->addSeparator();
      else
        menu->addAction(actions_.at(QString::fromLatin1(id)));
    }
  };
  QMenu* file = menuBar()->addMenu(tr("&File"));
  fill(file, {"open"});
  QMenu* recent = file->addMenu(tr("Open &recent"));
  connect(recent, &QMenu::aboutToShow, this, [this, recent] {
    recent->clear();
    for (const ShelfEntry& entry : desk_.shelf().recent())
      recent->addAction(entry.title, this, [this, file = entry.file] { open(file); });
    if (recent->isEmpty()) recent->addAction(tr("Nothing yet"))->setEnabled(false);
  });
  fill(file, {"-", "save", "save-as", "export", "picture", "turntable", "report", "-", "close-model", "quit"});
  QMenu* edit = menuBar()->addMenu(tr("&Edit"));
  fill(edit, {"undo", "redo", "repeat-stroke", "-", "drag-radius", "drag-strength", "radius-less", "radius-more",
              "symmetry", "pick-colour", "-", "refine-saturated", "refine-all", "refine-model", "stop-refining", "-",
              "preferences", "-"});
  QMenu* tool = edit->addMenu(tr("&Tools"));
  tool->addActions(tool_group_->actions());
  QMenu* view = menuBar()->addMenu(tr("&View"));
  fill(view, {"frame",        "-",    "view-front", "view-right", "view-top", "view-not-front", "view-not-right",
              "view-not-top", "-",    "turn-left",  "turn-right", "turn-up",  "turn-down",      "roll-left",
              "roll-right",   "lens", "z-up",       "-",          "wires",    "heat",           "cavity",
              "studio-light", "-"});
  QMenu* matcap = view->addMenu(tr("&Clay"));
  auto* group = new QActionGroup(this);
  for (std::size_t k = 0; k < matcaps().size(); ++k) {
    QAction* each = add(QStringLiteral("matcap-%1").arg(k),
                        QCoreApplication::translate("Matcaps", std::string(matcaps()[k]).c_str()), {}, {});
    each->setCheckable(true);
    each->setChecked(static_cast<int>(k) == viewport_->look().matcap);
    group->addAction(each);
    matcap->addAction(each);
    connect(each, &QAction::toggled, this, [this, k](bool on) {
      if (!on) return;
      Look look = viewport_->look();
      look.matcap = static_cast<int>(k);
      use_look(look);
    });
  }
  fill_analysis_menu(*view->addMenu(tr("&Analysis")));
  QMenu* panels = view->addMenu(tr("&Panels"));
  connect(panels, &QMenu::aboutToShow, this, [this, panels] {
    panels->clear();
    for (QDockWidget* dock : docks_->all()) panels->addAction(dock->toggleViewAction());
  });
  fill(view, {"panels", "-", "redraw", "fullscreen", "theme"});
  QMenu* help = menuBar()->addMenu(tr("Hel&p"));
  help->addAction(palette_->open_action());
}

void MainWindow::refine_model(const QString& title, RefineWhere where) {
  Document* const document = bridge_.document();
  if (document == nullptr) return;
  changing_cage_ = true;
  QString label = title;
  label.remove(QLatin1Char('&'));
  say(tr("%1 … You can go on sculpting.").arg(label));
  ModelInfo info = document->info();
  bridge_.post(ChangeCage{.label = label.toStdString(),
                          .details = {},
                          .make = [info, where](const SnapshotPtr& model, const ChangeCage::AsMade& as_made,
                                                const Progress& progress) -> Result<ChangeCage::Made> {
                            RELIEF_TRY(const SnapshotPtr made, as_made(progress));
                            RELIEF_TRY(const Refined refined, relief::refine({info, model}, where, made, progress));
                            return ChangeCage::Made(refined.model.head, refined.moved_max);
                          }});
  refresh();
}

void MainWindow::use_look(const Look& look) { views_->set_look(look); }

}  // namespace relief::studio
