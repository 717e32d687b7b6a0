#include "main_window.h"

#include "docks.h"
#include "event_log.h"
#include "hand.h"
#include "hand_overlay.h"
#include "history_panel.h"
#include "layers_panel.h"
#include "preferences_dialog.h"
#include "split_view.h"
#include "start_page.h"
#include "text.h"
#include "tool_panel.h"
#include "widgets/banner.h"
#include "widgets/card.h"
#include "widgets/colour_palette.h"
#include "widgets/command_palette.h"
#include "widgets/icons.h"
#include "widgets/progress_strip.h"
#include "widgets/theme.h"
#include "widgets/toast.h"
#include "widgets/value_bar.h"

#include <QAccessible>
#include <QApplication>
#include <QCloseEvent>
#include <QFile>
#include <QHBoxLayout>
#include <QKeyEvent>
#include <QLabel>
#include <QLayout>
#include <QMenuBar>
#include <QPushButton>
#include <QResizeEvent>
#include <QScreen>
#include <QStackedWidget>
#include <QStatusBar>
#include <QToolBar>
#include <QToolButton>
#include <QVBoxLayout>
#include <cmath>
#include <initializer_list>

namespace relief::studio {

namespace {

/// Qt's button for what has no room in a bar.
const QString kRest = QStringLiteral("qt_toolbar_ext_button");

}  // namespace

MainWindow::MainWindow(QSettings& settings, const DesktopScheme& desktop)
    : settings_(settings), desktop_(desktop), keys_(config_folder() + QStringLiteral("/keys.json")), desk_(bridge_) {
  setObjectName(QStringLiteral("studio"));
  setWindowTitle(QStringLiteral("Relief Studio"));
  setDockOptions(AnimatedDocks | AllowNestedDocks | AllowTabbedDocks);
  pages_ = new QStackedWidget(this);
  start_ = new StartPage(desk_.shelf(), pages_);
  views_ = new SplitView(bridge_, tools_, pages_);
  viewport_ = &views_->shaded();
  pages_->addWidget(start_);
  pages_->addWidget(views_);
  auto* middle = new QWidget(this);
  auto* column = new QVBoxLayout(middle);
  column->setContentsMargins(0, 0, 0, 0);
  column->setSpacing(0);
  banner_ = new Banner(middle);
  banner_->hide();
  // Over the picture, which therefore keeps its size when it comes and goes.
  // Beside the pages, not in them: a stack raises its page over all else, and shows assistive tools its pages only.
  opening_ = new QFrame(middle);
  opening_->setProperty("role", QStringLiteral("card"));
  convert_ = new ProgressStrip(opening_);
  (new QVBoxLayout(opening_))->addWidget(convert_);
  opening_->hide();
  pages_->installEventFilter(this);
  column->addWidget(banner_);
  column->addWidget(pages_, 1);
  setCentralWidget(middle);
  toast_ = new Toast(this);
  viewport_->installEventFilter(this);
  build_actions();
  palette_ = new CommandPalette(this);
  build_menus();
  build_bars();
  build_docks();
  build_hand();
  connect_document();
  connect_files();
  connect_view();
  build_preferences();
  tools_.take_kept(settings_);
  actions_.at("tool-" + tools_.id())->setChecked(true);
  resize(settings_.value("window/size", QSize(1500, 940)).toSize().boundedTo(screen()->availableGeometry().size()));
  if (settings_.contains("window/state")) restoreState(settings_.value("window/state").toByteArray());
  refresh();
  if (!desk_.shelf().complaint().isEmpty()) say(desk_.shelf().complaint());
}

/// Whatever shows the document goes before it does, also where the window was never asked to close.
MainWindow::~MainWindow() {
  delete hand_;
  for (QObject* each : std::initializer_list<QObject*>{&bridge_, &tools_, &desk_}) each->disconnect();
  qDeleteAll(findChildren<QWidget*>(QString(), Qt::FindDirectChildrenOnly));
}

void MainWindow::open(const QString& file, const std::optional<Camera>& camera) {
  camera_ = camera;
  desk_.open(file);
}

// ---- Layout

void MainWindow::build_bars() {
  const auto button = [this](QToolBar* bar, const QString& id, const QString& name) {
    bar->addAction(actions_.at(id));
    auto* made = qobject_cast<QToolButton*>(bar->widgetForAction(actions_.at(id)));
    made->setObjectName(QStringLiteral("button-") + id);
    made->setAccessibleName(name);
    made->setAccessibleDescription(actions_.at(id)->statusTip());
    return made;
  };
  // The button of a bar that has no room for all of its own.
  const auto name_rest = [](QToolBar* bar, const QString& name, const QString& help) {
    auto* rest = bar->findChild<QToolButton*>(kRest);
    rest->setAccessibleName(name);
    rest->setAccessibleDescription(help);
    rest->setToolTip(help);
  };
  top_ = addToolBar(tr("Top bar"));
  top_->setObjectName(QStringLiteral("top"));
  top_->setAccessibleName(tr("Top bar"));
  top_->setMovable(false);
  top_->setIconSize(QSize(scaled(20), scaled(20)));
  button(top_, "undo", tr("Undo"));
  button(top_, "redo", tr("Redo"));
  const auto bar = [this](const QString& name, const QString& setting, const QString& help, const QString& key) {
    auto* made = new ValueBar(name, top_);
    made->setObjectName(setting);
    made->set_help(help, key);
    made->setFixedWidth(scaled(170));
    connect(made, &ValueBar::valueEdited, this, [this, setting](double value) { tools_.set_value(setting, value); });
    top_->addWidget(made);
    return made;
  };
  radius_ = bar(tr("Radius"), "radius", tr("How large the tool is"), "F");
  strength_ = bar(tr("Strength"), "strength", tr("How much the tool does"), "Shift+F");
  strength_->set_range(0, 1);
  strength_->set_format(percent_format());
  button(top_, "symmetry", tr("Symmetry"));
  button(top_, "wires", tr("Slab wires"));
  button(top_, "heat", tr("Heat map"));
  auto* space = new QWidget(top_);
  space->setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Preferred);
  top_->addWidget(space);
  name_rest(top_, tr("More"), tr("Shows what has no room in the bar"));

  column_ = new QToolBar(tr("Tools"), this);
  column_->setObjectName(QStringLiteral("tools"));
  column_->setAccessibleName(tr("Tools"));
  column_->setMovable(false);
  column_->setIconSize(QSize(scaled(24), scaled(24)));
  addToolBar(Qt::LeftToolBarArea, column_);
  for (const QString& id : ToolState::ids()) {
    QToolButton* made = button(column_, "tool-" + id, ToolState::title(id));
    made->setProperty("tool", true);
  }
  column_->installEventFilter(this);
  name_rest(column_, tr("More tools"), tr("Shows the tools that have no room in the column"));

  status_ = new QLabel(this);
  status_->setObjectName(QStringLiteral("status"));
  status_->setAccessibleName(tr("Status"));
  facts_ = new QLabel(this);
  facts_->setObjectName(QStringLiteral("facts"));
  drawing_ = new QLabel(this);
  drawing_->setObjectName(QStringLiteral("drawing"));
  statusBar()->addWidget(status_, 1);
  statusBar()->addPermanentWidget(facts_);
  statusBar()->addPermanentWidget(drawing_);
  statusBar()->setSizeGripEnabled(false);
}

void MainWindow::build_docks() {
  docks_ = new Docks(*this, settings_);
  tool_panel_ = new ToolPanel(tools_, this);
  layers_ = new LayersPanel(this);
  history_ = new HistoryPanel(bridge_, this);
  docks_->add("tool-panel", tr("Tool"), tr("Tool panel"), ToolState::title(tools_.id()), tool_panel_);
  auto* layers = new QWidget(this);
  auto* column = new QVBoxLayout(layers);
  column->addWidget(layers_);
  colours_ = new ColourPalette(layers);
  column->addWidget(colours_);
  column->addStretch(1);
  connect(colours_, &ColourPalette::colourPicked, this, &MainWindow::choose_colour);
  QList<QColor> used;
  for (const QString& each : settings_.value("colours/used").toStringList()) used.append(QColor(each));
  colours_->set_last_used(used);
  const Vec3f first = tools_.brush_of(QStringLiteral("paint")).colour;
  const QColor kept(settings_.value("tools/colour").toString());
  choose_colour(kept.isValid() ? kept : QColor::fromRgbF(first.x, first.y, first.z));
  docks_->add("layers-panel", tr("Layers"), tr("Layers panel"), tr("Layers and colours"), layers);
  docks_->add("history-panel", tr("History"), tr("History panel"), tr("History"), history_);
}

/// What can be done now, and what the bars say.
void MainWindow::refresh() {
  const bool open = bridge_.document() != nullptr, seen = open || desk_.opening();
  const DocumentStatistics statistics = open ? bridge_.document()->statistics() : DocumentStatistics{};
  actions_.at("undo")->setEnabled(statistics.undo_steps > 0);
  actions_.at("redo")->setEnabled(statistics.redo_steps > 0);
  for (const char* id :
       {"save", "save-as", "export", "picture", "turntable", "report", "close-model", "pick-colour", "repeat-stroke"})
    actions_.at(id)->setEnabled(open);
  for (const char* id : {"refine-saturated", "refine-all", "refine-model"})
    actions_.at(id)->setEnabled(open && !changing_cage_);
  actions_.at("stop-refining")->setEnabled(open && changing_cage_);
  for (QAction* tool : tool_group_->actions()) tool->setEnabled(open || !desk_.opening());
  radius_->setEnabled(open);
  strength_->setEnabled(open && tools_.tool());
  const bool working = pages_->currentWidget() == views_;
  column_->setVisible(working);
  top_->setVisible(working);
  docks_->set_shown(working);
  QString title = QStringLiteral("Relief Studio");
  if (seen) title = desk_.title() + QStringLiteral(" — ") + title;
  setWindowTitle(title);
  say_state();
}

void MainWindow::say_state() {
  QStringList facts;
  if (bridge_.document() != nullptr) {
    const ModelInfo& info = bridge_.document()->info();
    facts.append(info.mode == Mode::Certified ? tr("Certified") : tr("Tolerant"));
    facts.append(tr("%n slab(s)", nullptr, static_cast<int>(bridge_.head()->slab_mesh().slab_count())));
    if (verdict_ && !verdict_->lines.isEmpty()) facts.append(verdict_->lines.first());
  }
  facts_->setText(facts.join(QStringLiteral(" · ")));
  fit_status();
}

void MainWindow::say_in_status(const QString& words) {
  if (status_->text() == words) return;  // a screen reader says each change
  status_->setText(words);
  status_->setAccessibleDescription(words);
  QAccessibleEvent event(status_, QAccessible::DescriptionChanged);
  QAccessible::updateAccessibility(&event);
  fit_status();
}

/// What happens counts more than what the model is: where not all has room, the rest goes.
void MainWindow::fit_status() {
  int room = statusBar()->width() - status_->sizeHint().width() - scaled(16);
  for (QLabel* each : {drawing_, facts_}) {
    room -= each->sizeHint().width() + scaled(16);
    each->setVisible(room >= 0);
  }
}

void MainWindow::say(const QString& words) {
  say_in_status(words);
  event_log().write(QStringLiteral("toast"), {{"text", words}});
  toast_->say(words, viewport_->ring_in_window());
}

void MainWindow::say_in_banner(Mood mood, const QString& words, const QString& subject,
                               std::vector<BannerAction> actions) {
  if (!banner_->say(mood, words, std::move(actions), subject)) return;
  say_in_status(words);
  event_log().write(QStringLiteral("banner"), {{"text", words}});
}

void MainWindow::keep_picture() {
  if (bridge_.document() == nullptr || viewport_->picture().isNull()) return;
  viewport_->picture()
      .scaled(QSize(300, 192), Qt::KeepAspectRatioByExpanding, Qt::SmoothTransformation)
      .copy(0, 0, 300, 192)
      .save(Shelf::picture_of(text(bridge_.file())));
}

void MainWindow::closeEvent(QCloseEvent* event) {
  desk_.cancel();
  keep_picture();
  QString why;
  if (!desk_.close(why)) {
    event->ignore();
    show_failure(tr("Not everything is saved"), why, text(bridge_.file()), false);
    return;
  }
  keep_tools();
  settings_.setValue("window/size", size());
  settings_.setValue("window/state", saveState());
  event_log().write(QStringLiteral("exit"));
  event->accept();
}

bool MainWindow::eventFilter(QObject* object, QEvent* event) {
  if ((object == viewport_ || object == pages_) && event->type() == QEvent::Resize) {
    place_over();
    fit_status();
  }
  // What had no room in the column may have it now: its button, which stays pressed, is to go.
  if (object == column_ && event->type() == QEvent::Resize) {
    const auto* resized = static_cast<QResizeEvent*>(event);
    auto* rest = column_->findChild<QToolButton*>(kRest);
    if (resized->size().height() != resized->oldSize().height() && rest->isChecked())
      QMetaObject::invokeMethod(
          this,
          [this, rest] {
            const bool animated = isAnimated();
            setAnimated(false);  // after a movement, Qt forgets to hide the button
            rest->click();
            setAnimated(animated);
            column_->layout()
                ->invalidate();  // it hides it only when it lays out, and the bar may be as large as before
            column_->layout()->activate();
          },
          Qt::QueuedConnection);
  }
  // Room is made after the hand has let go, too, when the view has no stroke any more that it could cancel.
  if (making_room_ && event->type() == QEvent::KeyPress && static_cast<QKeyEvent*>(event)->key() == Qt::Key_Escape)
    if (const auto* view = qobject_cast<Viewport*>(object); view != nullptr && !view->busy())
      bridge_.post(CancelStroke{});
  // The first stroke says that the verdict was read.
  if (object == viewport_ && event->type() == QEvent::MouseButtonPress && card_ != nullptr) card_->hide();
  return QMainWindow::eventFilter(object, event);
}

/// The verdict's card lies at the lower right of the picture.
void MainWindow::place_over() {
  const int height = opening_->sizeHint().height();
  const QRect page = pages_->geometry();
  opening_->setGeometry(page.left() + 16, page.bottom() + 1 - height - 16, page.width() - 32, height);
  if (card_ == nullptr || !card_->isVisible()) return;
  card_->setFixedWidth(std::min(scaled(340), viewport_->width() - 32));
  card_->adjustSize();
  card_->move(viewport_->width() - card_->width() - 16, viewport_->height() - card_->height() - 16);
}

void MainWindow::keep_tools() {
  tools_.keep(settings_);
  settings_.setValue("tools/colour", colours_->colour().name());
}

void MainWindow::choose_colour(const QColor& colour) {
  colours_->set_colour(colour);
  tools_.set_colour(
      {static_cast<float>(colour.redF()), static_cast<float>(colour.greenF()), static_cast<float>(colour.blueF())});
}

}  // namespace relief::studio
