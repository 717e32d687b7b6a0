#include "kiosk.h"

#include "background.h"
#include "document_log.h"
#include "event_log.h"
#include "kiosk_choose.h"
#include "kiosk_stage.h"
#include "languages.h"
#include "picture_of.h"
#include "shelf.h"
#include "text.h"
#include "widgets/theme.h"

#include <relief/base/try.h>

#include <QApplication>
#include <QCloseEvent>
#include <QDir>
#include <QKeyEvent>
#include <QLabel>
#include <QLineEdit>
#include <QMouseEvent>
#include <QStackedWidget>
#include <QVBoxLayout>
#include <csignal>
#include <cstdio>

namespace relief::studio {

namespace {

/// Pictures per second of the turntable, and radians between two: 6 degrees a second, slow enough to look.
constexpr int kTurnsPerSecond = 10;
constexpr double kTurn = 0.0105;
/// ms that each model turns before the next one comes.
constexpr int kNext = 30'000;
/// ms that the field for the code stays.
constexpr int kCodePatience = 20'000;
/// Seconds on the page of pictures before the models turn by themselves.
constexpr int kChoosePatience = 60;

/// m: a device that nobody holds trembles by less.
constexpr double kHeld = 0.002;

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

QImage to_image(const Picture& picture) {
  return QImage(picture.rgb.data(), picture.width, picture.height, 3 * picture.width, QImage::Format_RGB888).copy();
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
  connect(&hand_, &Hand::ticked, this, [this] {
    if (hand_.held()) hand_at(hand_.monitor().last().device); });
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
  close_copy();
  QDir(folder_).removeRecursively();
}

/// What lies over the pages: words on a model that turns or is being opened, the countdown, the field for the code.
void Kiosk::build_covers() {
  cover_ = new QWidget(this);
  cover_->setObjectName(QStringLiteral("kiosk-cover"));
  auto* column = new QVBoxLayout(cover_);
  column->setContentsMargins(scaled(60), scaled(60), scaled(60), scaled(60));
  cover_title_ = new QLabel(cover_);
  cover_title_->setFont(ui_font(34, QFont::DemiBold));
  cover_words_ = new QLabel(cover_);
  cover_words_->setFont(ui_font(20));
  column->addWidget(cover_title_);
  column->addStretch(1);
  column->addWidget(cover_words_, 0, Qt::AlignHCenter);
  for (QLabel* label : {cover_title_, cover_words_}) {
    label->setTextFormat(Qt::PlainText);
    label->setStyleSheet(
        QStringLiteral("color: white; background: rgba(0, 0, 0, 110); border-radius: 10px; padding: 10px 18px;"));
  }
  column->setAlignment(cover_title_, Qt::AlignLeft);
  const auto frame = [this](const QString& id) {
    auto* made = new QFrame(this);
    made->setObjectName(id);
    made->setProperty("role", QStringLiteral("card"));
    made->hide();
    auto* lines = new QVBoxLayout(made);
    lines->setContentsMargins(scaled(44), scaled(36), scaled(44), scaled(36));
    return made;
  };
  count_ = frame(QStringLiteral("kiosk-countdown"));
  count_words_ = new QLabel(count_);
  count_words_->setFont(ui_font(26, QFont::DemiBold));
  count_words_->setAlignment(Qt::AlignCenter);
  count_->layout()->addWidget(count_words_);
  code_frame_ = frame(QStringLiteral("kiosk-code"));
  code_line_ = new QLineEdit(code_frame_);
  code_line_->setObjectName(QStringLiteral("kiosk-code-line"));
  code_line_->setEchoMode(QLineEdit::Password);
  code_line_->setContextMenuPolicy(Qt::NoContextMenu);
  code_line_->setMaxLength(64);
  code_line_->setMinimumWidth(scaled(260));
  code_frame_->layout()->addWidget(code_line_);
  connect(code_line_, &QLineEdit::returnPressed, this, &Kiosk::check_code);
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
  in_background(
      this,
      [from = exhibits_[exhibit].model, made]() -> Status {
        RELIEF_TRY(const ModelFile original, ModelFile::open(path(from), true));
        made->unit = original.model().info.unit;
        RELIEF_TRY(made->copy, ModelFile::create(path(made->file), original.model()));
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

void Kiosk::loaded(std::size_t exhibit, Loaded& made, Page then) {
  current_ = exhibit;
  close_copy();
  hand_.set_force_cap(exhibits_[exhibit].force_cap);
  if (const Status open = bridge_.open(path(made.file), std::move(*made.copy)); !open) {
    drop(exhibit, text(open.error().message));
    return;
  }
  copy_ = made.file;
  const SnapshotPtr head = bridge_.head();
  const Box3d box = head->slab_mesh().bounds();
  tools_.set_diagonal(diagonal(box));
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
  event_log().write(QStringLiteral("opened"), {{"file", copy_},
                                               {"slabs", qint64(head->slab_mesh().slab_count())},
                                               {"hash", hash_text(head->content_hash())}});
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

void Kiosk::activity() {
  if (page_ == Page::Attract) {
    ++serial_;  // a model that is still being read is not wanted any more
    close_copy();
    show_page(Page::Choose);
    return;
  }
  watch_.activity();
}

void Kiosk::hand_at(Vec3d at) {
  if (!last_hand_) last_hand_ = at;
  if (!(length(at - *last_hand_) > kHeld)) return;  // a reading that is no number is no motion
  last_hand_ = at;
  activity();
}

// ---- Input

bool Kiosk::is_input(const QEvent& event) {
  switch (event.type()) {
    case QEvent::MouseMove: {
      // A widget that comes or goes under a pointer makes moves, too.
      const QPointF at = static_cast<const QMouseEvent&>(event).globalPosition();
      return std::exchange(last_pointer_, at) != at;
    }
    case QEvent::MouseButtonPress:
    case QEvent::MouseButtonRelease:
    case QEvent::Wheel:
    case QEvent::KeyPress:
    case QEvent::ShortcutOverride:  // all that comes of a key that chooses a tool
    case QEvent::TouchBegin:
    case QEvent::TouchUpdate:
    case QEvent::TabletPress:
    case QEvent::TabletMove:
    case QEvent::NativeGesture:
      return true;
    default:
      return false;
  }
}

bool Kiosk::eventFilter(QObject*, QEvent* event) {
  switch (event->type()) {
    case QEvent::DragEnter:
    case QEvent::Drop:
    case QEvent::ContextMenu:
    case QEvent::ToolTip:
      return true;
    default:
      break;
  }
  const bool from_outside = event->spontaneous() || event->type() == QEvent::ShortcutOverride;
  if (!from_outside || !is_input(*event)) return false;
  const bool awake = page_ == Page::Choose || (page_ == Page::Model && !watch_.counting_down());
  if (event->type() == QEvent::KeyPress) {
    const auto* key = static_cast<const QKeyEvent*>(event);
    constexpr Qt::KeyboardModifiers kLeave = Qt::ControlModifier | Qt::AltModifier | Qt::ShiftModifier;
    if (key->key() == Qt::Key_L && key->modifiers() == kLeave) {
      ask_code();
      return true;
    }
  }
  activity();
  return !awake && event->type() != QEvent::MouseMove;  // what wakes the kiosk does nothing else
}

void Kiosk::closeEvent(QCloseEvent* event) {
  if (leaving_)
    event->accept();
  else
    event->ignore();
}

void Kiosk::ask_code() {
  code_line_->clear();
  code_frame_->show();
  code_frame_->adjustSize();
  code_frame_->move(rect().center() - code_frame_->rect().center());
  code_frame_->raise();
  code_line_->setFocus();
  code_timer_.start(kCodePatience);
}

void Kiosk::check_code() {
  code_frame_->hide();
  if (code_line_->text() != code_) {
    log_.write(QStringLiteral("a wrong code to leave"));
    return;
  }
  log_.write(QStringLiteral("left with the code"));
  event_log().write(QStringLiteral("exit"));
  leaving_ = true;
  close();
  QCoreApplication::exit(0);
}

// ---- Around it

/// The picture of each model, one after the other, on workers.
void Kiosk::draw_pictures() {
  const QSize size = choose_->picture_size() * devicePixelRatioF();
  for (std::size_t k = 0; k < exhibits_.size(); ++k) {
    auto picture = std::make_shared<QImage>();
    in_background(
        this,
        [from = exhibits_[k].model, look = stage_->viewport().look(), size, picture]() -> Status {
          RELIEF_TRY(const ModelFile original, ModelFile::open(path(from), true));
          Frame frame;
          frame.width = size.width();
          frame.height = size.height();
          frame.samples = 4;
          frame.look = look;
          frame.camera = framing(*original.model().head, 20, 15, size.width() / double(size.height()));
          RELIEF_TRY(const Picture drawn, draw_picture(*original.model().head, frame));
          *picture = to_image(drawn);
          return {};
        },
        [this, k, picture](const Status& status) {
          if (status)
            choose_->set_picture(k, *picture);
          else
            log_.write(QStringLiteral("no picture: ") + text(status.error().message));
        });
  }
}

void Kiosk::log(const QString& page, const QString& words) {
  event_log().write(QStringLiteral("kiosk"), {{"page", page}});
  if (!words.isEmpty()) log_.write(words);
}

int run_kiosk(QApplication& application, const QStringList& models_or_folders, const QSettings& settings,
              const QString& language, const QString& device) {
  Result<std::vector<Exhibit>> exhibits = read_exhibits(models_or_folders);
  if (!exhibits) {
    std::fprintf(stderr, "relief studio: %s\n", exhibits.error().message.c_str());
    return 1;
  }
  event_log().write(QStringLiteral("start"), {{"pid", QCoreApplication::applicationPid()}});
  Kiosk kiosk(std::move(*exhibits), settings, language, device);
  kiosk.showFullScreen();
  kiosk.activateWindow();
  return application.exec();
}

}  // namespace relief::studio
