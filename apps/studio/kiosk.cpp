#include "kiosk.h"

#include "background.h"
#include "document_log.h"
#include "event_log.h"
#include "kiosk_choose.h"
#include "kiosk_stage.h"
#include "languages.h"
#include "preferences.h"
#include "shelf.h"
#include "text.h"
#include "widgets/theme.h"

#include <relief/base/steps.h>
#include <relief/base/try.h>
#include <relief/core/query.h>

#include <QApplication>
#include <QDir>
#include <QFile>
#include <QFrame>
#include <QLabel>
#include <QLineEdit>
#include <QPointer>
#include <QStackedWidget>
#include <QVBoxLayout>
#include <csignal>

namespace relief::studio {

namespace {

/// Pictures per second of the turntable, and radians between two: 6 degrees a second, slow enough to look.
constexpr int kTurnsPerSecond = 10;
constexpr double kTurn = 0.0105;
/// ms that each model turns before the next one comes.
constexpr int kNext = 30'000;
/// Seconds on the page of pictures before the models turn by themselves.
constexpr int kChoosePatience = 60;
/// Of a load's percent: the original is read for the first half, its copy is written for the second.
constexpr double kReadShare = 0.5;

/// Where the private copies of this process lie. Those of processes that are no more are removed.
QString copies_folder() {
  QDir all(cache_folder());
  for (const QString& name : all.entryList({QStringLiteral("kiosk-*")}, QDir::Dirs)) {
    const auto pid = name.mid(6).toInt();
    if (pid > 0 && ::kill(pid, 0) != 0) QDir(all.filePath(name)).removeRecursively();
  }
  const QString folder = all.filePath(QStringLiteral("kiosk-%1").arg(QCoreApplication::applicationPid()));
  QDir().mkpath(folder);
  return folder;
}

}  // namespace

struct Kiosk::Loaded {
  QString file;
  std::optional<ModelFile> copy;
  Unit unit = Unit::Millimetre;
};

Kiosk::Kiosk(std::vector<Exhibit> exhibits, const QSettings& settings, QString language, const QString& device)
    : exhibits_(std::move(exhibits)),
      code_(settings.value("kiosk/code", "relief").toString()),
      first_language_(std::move(language)),
      language_(first_language_),
      folder_(copies_folder()),
      most_force_(chosen(settings, "forces/most").toInt() / 100.0),
      log_(state_folder() + QStringLiteral("/log")) {
  setObjectName(QStringLiteral("kiosk"));
  setWindowTitle(tr("Relief"));
  setWindowFlags(Qt::Window | Qt::FramelessWindowHint);
  setContextMenuPolicy(Qt::PreventContextMenu);
  auto* whole = new QVBoxLayout(this);
  whole->setContentsMargins(0, 0, 0, 0);
  pages_ = new QStackedWidget(this);
  whole->addWidget(pages_);
  choose_ = new KioskChoose(exhibits_, pages_);
  stage_ = new KioskStage(bridge_, tools_, pages_);
  pages_->addWidget(choose_);
  pages_->addWidget(stage_);
  build_covers();
  log_document(bridge_, stage_->viewport());
  connect(choose_, &KioskChoose::chosen, this, [this](int exhibit) { open(static_cast<std::size_t>(exhibit)); });
  connect(choose_, &KioskChoose::languageChosen, this, &Kiosk::speak);
  connect(stage_, &KioskStage::undoAsked, this, [this] { bridge_.post(Undo{}); });
  connect(stage_, &KioskStage::againAsked, this, [this] {
    log(QStringLiteral("reset"), QStringLiteral("started again by the visitor"));
    open(current_);
  });
  connect(stage_, &KioskStage::othersAsked, this, [this] {
    close_copy();
    show_page(Page::Choose);
  });
  connect(&bridge_, &DocumentBridge::snapshotChanged, this,
          [this](const Box3d&) { stage_->viewport().set_model(bridge_.head()); });
  connect(&bridge_, &DocumentBridge::historyChanged, this,
          [this](const HistoryChanged& history) { stage_->set_touched(history.undo_steps > 0); });
  connect(&bridge_, &DocumentBridge::failed, this,
          [this](const QString& message, quint64) { log_.write(QStringLiteral("not saved: ") + message); });
  connect(&stage_->viewport(), &Viewport::pointed, &hand_, &Hand::point);
  connect(&stage_->viewport(), &Viewport::left, &hand_, &Hand::leave);
  // Queued: what comes of it may end the session that ticks.
  connect(
      &hand_, &Hand::ticked, this,
      [this] {
        if (hand_.held()) hand_at(hand_.monitor().last().device);
      },
      Qt::QueuedConnection);
  connect(&hand_, &Hand::alarm, this, [this](const QString& sentence) { log_.write(sentence); });
  connect(&hand_, &Hand::said, this, [this](const QString& words) { log_.write(words); });
  connect(&watch_, &IdleWatch::countdown, this, &Kiosk::count);
  connect(&watch_, &IdleWatch::resumed, this, [this] {
    count_->hide();
    if (page_ == Page::Model) log(QStringLiteral("model"), {});
  });
  connect(&watch_, &IdleWatch::expired, this, &Kiosk::expired);
  connect(&turn_timer_, &QTimer::timeout, this, &Kiosk::turn);
  connect(&next_timer_, &QTimer::timeout, this, &Kiosk::attract_next);
  code_timer_.setSingleShot(true);
  connect(&code_timer_, &QTimer::timeout, this, [this] { code_frame_->hide(); });
  QApplication::instance()->installEventFilter(this);
  if (!device.isEmpty()) hand_.choose(device);
  say_words();
  log_.write(QStringLiteral("started with %1 models").arg(exhibits_.size()));
  show_page(Page::Choose);
  draw_pictures();
}

Kiosk::~Kiosk() {
  if (stop_load_) stop_load_->store(true);
  close_copy();
  QDir(folder_).removeRecursively();
}

void Kiosk::resizeEvent(QResizeEvent*) {
  cover_->setGeometry(rect());
  for (QFrame* each : {count_, code_frame_}) {
    each->adjustSize();
    each->move(rect().center() - each->rect().center());
  }
}

/// A visitor's language; back to the first one when nobody is there.
void Kiosk::speak(const QString& language) {
  if (language == language_) return;
  language_ = language;
  use_language(*qApp, language);
  say_words();
}

void Kiosk::say_words() {
  choose_->set_language(language_);
  code_line_->setAccessibleName(tr("Code to leave"));
  code_line_->setPlaceholderText(tr("Code to leave"));
}

// ---- Pages

void Kiosk::show_page(Page page) {
  page_ = page;
  const bool stage = page != Page::Choose;
  pages_->setCurrentWidget(stage ? static_cast<QWidget*>(stage_) : choose_);
  stage_->set_controls_shown(page == Page::Model);
  cover_->setVisible(page == Page::Loading || page == Page::Attract);
  cover_->raise();
  count_->hide();
  turn_timer_.stop();
  next_timer_.stop();
  if (page == Page::Attract) {
    cover_title_->setText(exhibits_[current_].caption(language_).title);
    cover_words_->setText(tr("Touch to begin"));
    next_timer_.start(kNext);
    if (!reduced_motion()) turn_timer_.start(1000 / kTurnsPerSecond);
    watch_.stop();
  } else if (page == Page::Loading) {
    cover_title_->setText(exhibits_[current_].caption(language_).title);
    cover_words_->setText(tr("One moment …"));
    watch_.stop();
  } else {
    watch_.start(page == Page::Model ? exhibits_[current_].timeout_s : kChoosePatience);
  }
  cover_->layout()->activate();
  if (page == Page::Choose) log(QStringLiteral("choose"), {});
  if (page == Page::Attract) log(QStringLiteral("attract"), {});
  emit pageChanged();
}

void Kiosk::open(std::size_t exhibit) {
  current_ = exhibit;
  show_page(Page::Loading);
  load(exhibit, Page::Model);
}

/// Reads the original and makes the copy that is worked on, on a worker; shows it on page `then`.
void Kiosk::load(std::size_t exhibit, Page then) {
  const quint64 serial = ++serial_;
  auto made = std::make_shared<Loaded>();
  made->file = QStringLiteral("%1/%2.relief").arg(folder_).arg(serial);
  if (stop_load_) stop_load_->store(true);
  stop_load_ = std::make_shared<std::atomic<bool>>(false);
  const auto tell = [guard = QPointer(this), serial](std::string_view, double share) {
    QMetaObject::invokeMethod(
        QCoreApplication::instance(),
        [guard, serial, share] {
          if (guard) guard->tell_load(serial, share);
        },
        Qt::QueuedConnection);
  };
  in_background(
      this,
      [from = exhibits_[exhibit].model, made, tell, stop = stop_load_]() -> Status {
        const Progress progress{.report = tell, .cancel = stop.get()};
        RELIEF_TRY(const ModelFile original,
                   ModelFile::open(path(from), true, part_of(progress, "read", 0, kReadShare)));
        made->unit = original.model().info.unit;
        const FirstState first = original.stroke_count() == 0 ? original.first_state() : FirstState::Sculpted;
        RELIEF_TRY(made->copy, ModelFile::create(path(made->file), original.model(),
                                                 part_of(progress, "copy", kReadShare, 1), first));
        return {};
      },
      [this, exhibit, made, serial, then](const Status& status) {
        if (serial != serial_) {
          made->copy.reset();
          QFile::remove(made->file);
        } else if (!status) {
          drop(exhibit, text(status.error().message));
        } else {
          loaded(exhibit, *made, then);
        }
      });
}

void Kiosk::tell_load(quint64 serial, double share) {
  if (serial == serial_ && page_ == Page::Loading)
    cover_words_->setText(tr("One moment … %1 %").arg(static_cast<int>(100 * share)));
}

void Kiosk::loaded(std::size_t exhibit, Loaded& made, Page then) {
  current_ = exhibit;
  close_copy();
  hand_.set_force_cap(std::min(exhibits_[exhibit].force_cap, most_force_));
  if (const Status open = bridge_.open(path(made.file), std::move(*made.copy)); !open) {
    drop(exhibit, text(open.error().message));
    return;
  }
  copy_ = made.file;
  const SnapshotPtr head = bridge_.head();
  const Box3d box = bounds_of_surface(*head);
  tools_.set_diagonal(diagonal(box));
  tools_.forget_hand();
  tools_.set_mirror(box.centre());
  stage_->set_exhibit(exhibits_[exhibit]);
  stage_->set_language(exhibits_[exhibit], language_);
  stage_->set_touched(false);
  stage_->set_others(exhibits_.size() > broken_.size() + 1);
  // A device that lies on its own must do nothing.
  if (then == Page::Attract) tools_.choose(QStringLiteral("touch"));
  hand_.set_forces(then == Page::Model);
  show_page(then);
  stage_->viewport().set_scene({head, nullptr}, made.unit, true);
  stage_->viewport().setFocus();
  if (then != Page::Model) return;
  event_log().write(
      QStringLiteral("opened"),
      {{"file", copy_}, {"slabs", qint64(head->slab_mesh().slab_count())}, {"hash", hash_text(head->content_hash())}});
  log(QStringLiteral("model"), QStringLiteral("opened ") + exhibits_[exhibit].model);
}

/// A model that was whole at the start and is not any more: visitors get another one.
void Kiosk::drop(std::size_t exhibit, const QString& why) {
  log_.write(QStringLiteral("left out: ") + why);
  broken_.insert(exhibit);
  choose_->take_away(exhibit);
  if (page_ == Page::Attract)
    attract_next();
  else
    show_page(Page::Choose);
}

void Kiosk::close_copy() {
  if (bridge_.document() == nullptr) return;
  stage_->viewport().set_scene({}, Unit::Millimetre, false);
  if (const Status closed = bridge_.close(); !closed)
    log_.write(QStringLiteral("not closed: ") + text(closed.error().message));
  QFile::remove(copy_);
  copy_.clear();
}

// ---- Nobody there

void Kiosk::count(int seconds_left) {
  if (page_ != Page::Model) return;
  count_words_->setText(tr("Start again in %1\ntouch to go on").arg(seconds_left));
  count_->adjustSize();
  count_->move(rect().center() - count_->rect().center());
  count_->raise();
  if (!count_->isVisible()) log(QStringLiteral("countdown"), {});
  count_->show();
}

void Kiosk::expired() {
  if (page_ == Page::Model) {
    const bool touched = bridge_.document() != nullptr && bridge_.document()->statistics().undo_steps > 0;
    close_copy();
    log(QStringLiteral("reset"), touched ? QStringLiteral("given up, nobody is there") : QString());
  }
  speak(first_language_);
  attract_next();
}

/// The next model that can be shown turns slowly.
void Kiosk::attract_next() {
  for (std::size_t k = 1; k <= exhibits_.size(); ++k) {
    const std::size_t next = (current_ + k) % exhibits_.size();
    if (broken_.contains(next)) continue;
    if (page_ != Page::Attract) show_page(Page::Attract);
    load(next, Page::Attract);
    return;
  }
  show_page(Page::Choose);
}

void Kiosk::turn() {
  Viewport& viewport = stage_->viewport();
  viewport.set_camera(orbit(viewport.camera(), kTurn, 0, true));
}

void Kiosk::log(const QString& page, const QString& words) {
  event_log().write(QStringLiteral("kiosk"), {{"page", page}});
  if (!words.isEmpty()) log_.write(words);
}

}  // namespace relief::studio
