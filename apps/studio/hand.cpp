#include "hand.h"

#include "event_log.h"
#include "hand_sound.h"
#include "hand_text.h"
#include "text.h"

#include <relief/base/try.h>
#include <relief/core/query.h>
#include <relief/session/replay.h>

#include <QFileInfo>
#include <QJsonArray>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <optional>
#include <utility>

namespace relief::studio {

namespace {

const QString kNone = QStringLiteral("none"), kMouse = QStringLiteral("mouse"),
              kSimulated = QStringLiteral("simulated");
const QString kOther = QStringLiteral("sim:hand:"), kReplay = text(kReplayDevice);

constexpr int kFrame = 16;                                  // ms between two takings of ticks: 60 a second
constexpr int kLogEvery = 60;                               // of these: once a second
constexpr float kLate = 2e-3F;                              // s after the due time
constexpr double kHover = 1.5e-3;                           // m at the hand, of the mouse's tool above the surface
constexpr double kFirstDepth = 2.5e-3;                      // m at the hand: 1 N with the usual stiffness
constexpr double kNotch = 0.25e-3;                          // m per notch of the wheel
constexpr double kLeastDepth = 0.25e-3, kMostDepth = 8e-3;  // m
constexpr double kFullDepth = 2e-3, kLightDepth = 0.2e-3;   // m at the hand that count as pressure 1 and 0
constexpr double kCalm = 0.4;          // pace of the simulated hand in the studio: people want to see what it does
constexpr double kInFront = 8e-3;      // m at the hand, of a tool that was put before the surface
constexpr std::uint32_t kSculpts = 1;  // button 0

/// So that a touch is alive: what wood and stone have.
constexpr ForceSettings kTouch = {.friction = 0.25, .static_friction = 0.35};

}  // namespace

/// A session and all that must outlive it.
struct Hand::Live {
  std::unique_ptr<HapticDevice> device;
  PointerDevice* pointer = nullptr;  ///< the same, where it is one
  PointerResistance resistance;
  PointerFeel feel;
  std::vector<Vec3d> points;  ///< of a recording's rigid tool
  ServoSettings servo;
  std::optional<Recorder> recorder;
  // Of the session's thread.
  std::optional<SnapshotChannel::Reader> reader;
  SoundTicks sound;
  std::atomic<double> metres{1};
  std::atomic<bool> sculpts{false};  ///< the tool in the hand changes material
  std::optional<Session> session;
  std::optional<HandControl> control;

  void tick(const ServoTick& tick, HandMonitor& monitor, HandSound& out) {
    monitor.tick(tick);
    if (!out.wants()) return;
    const bool carving = sculpts.load(std::memory_order_relaxed) && (tick.sample.buttons & kSculpts) != 0;
    out.tick(sound.next(tick.sample, reader->latest(), metres.load(std::memory_order_relaxed), carving));
  }
};

Hand::Hand(DocumentBridge& bridge, ToolState& tools, QObject* parent)
    : QObject(parent), bridge_(bridge), tools_(tools), depth_(kFirstDepth), sound_(std::make_unique<HandSound>()) {
  timer_.setInterval(kFrame);
  connect(&timer_, &QTimer::timeout, this, &Hand::take_ticks);
  connect(&bridge_, &DocumentBridge::opened, this, [this] { start(); });
  connect(&bridge_, &DocumentBridge::closing, this, [this] {
    stop();
    // A document that could not be closed stays.
    QTimer::singleShot(0, this, [this] { start(); });
  });
  connect(&tools_, &ToolState::toolChanged, this, &Hand::use_brush);
  connect(&tools_, &ToolState::settingChanged, this, &Hand::use_brush);
}

Hand::~Hand() { stop(); }

// ---- Which device

std::vector<Hand::Choice> Hand::choices() {
  std::vector<Choice> all = {{kNone, title_of(kNone), tr("the mouse and the pen sculpt all the same")},
                             {kMouse, title_of(kMouse), tr("shows and sounds the force; nobody feels it")},
                             {kSimulated, title_of(kSimulated), evidence_text(Evidence::Simulated)}};
  const std::vector<DeviceListing> known = list_devices();
  // The first one is the simulated hand itself.
  for (std::size_t k = 1; k < known.size(); ++k)
    all.push_back({text(known[k].name), title_of(text(known[k].name)), evidence_text(known[k].evidence)});
  return all;
}

QString Hand::title_of(const QString& id) {
  if (id == kNone) return tr("No device");
  if (id == kMouse) return tr("Mouse as a force probe");
  if (id == kSimulated) return tr("Simulated hand");
  if (id.startsWith(kReplay)) return tr("Recording %1").arg(QFileInfo(id.mid(kReplay.size())).fileName());
  if (id.startsWith(kOther)) return tr("Simulated hand, %1").arg(id.mid(kOther.size()));
  return id;
}

bool Hand::held() const {
  return live_ && !probes() && id_ != kSimulated && !id_.startsWith(kReplay) && !id_.startsWith(QLatin1String("sim:"));
}

bool Hand::probes() const { return live_ && live_->pointer != nullptr; }

void Hand::choose(const QString& id) {
  stop();
  id_ = id.isEmpty() ? kNone : id;
  forces_ = true;
  start();
  emit changed();
}

Result<std::unique_ptr<Hand::Live>> Hand::make_live(Document& document, const QString& recording) {
  auto live = std::make_unique<Live>();
  const Model model = {document.info(), document.head()};
  if (id_ == kMouse) {
    const Workspace space = fit_workspace({.workspace_radius = 0}, model);
    const Box3d box = bounds_of_surface(*model.head);
    const Ray3d ahead = {box.centre() + Vec3d{0, 0, 2 * diagonal(box)}, {0, 0, -1}};
    PointerPlace start = pointer_place(*model.head, has_ray_ ? ray_ : ahead, space, hint_);
    start.depth = -kHover;
    auto pointer = std::make_unique<PointerDevice>(start);
    live->pointer = pointer.get();
    live->device = std::move(pointer);
    live->servo.workspace = space;
  } else if (id_.startsWith(kReplay)) {
    RELIEF_TRY(PlayedDevice played, play_as_device(path(id_.mid(kReplay.size()))));
    const ServoSettings& recorded = played.replay.settings().front();
    live->servo.workspace = recorded.workspace;
    live->points.assign(recorded.tool.points.begin(), recorded.tool.points.end());
    live->servo.tool = {recorded.tool.radius, live->points};
    live->device = std::move(played.device);
  } else {
    const std::string name = id_ == kSimulated ? "sim:hand" : id_.toStdString();
    RELIEF_TRY(const std::unique_ptr<HapticDevice> known, open_(name, {}));
    live->servo.workspace = fit_workspace(known->info(), model);
    HandScript script = exploring_hand(*model.head, live->servo.workspace);
    RELIEF_TRY(live->device, open_(name, [script = std::move(script)](double t) { return script(kCalm * t); }));
  }
  RELIEF_CHECK(bring_up(*live->device));
  live->servo.force = kTouch;
  live->servo.force.max_force = live->device->info().max_force;
  if (!recording.isEmpty()) {
    RELIEF_TRY(live->recorder, Recorder::create(path(recording), Recorder::Pace::Live,
                                                {.program = "relief-studio",
                                                 .model = bridge_.file(),
                                                 .model_strokes = document.statistics().strokes,
                                                 .model_unit = std::string(relief::name(document.info().unit))},
                                                model.head, live->servo, live->device->info()));
  }
  return live;
}

void Hand::start(const QString& recording) {
  Document* document = bridge_.document();
  if (live_ || document == nullptr || id_ == kNone) return;
  // A stroke of the mouse that is still being worked on would come between the recorder's head and its first note.
  if (!recording.isEmpty()) document->settle();
  auto made = make_live(*document, recording);
  if (!made) {
    id_ = kNone;
    say(made.error());
    emit changed();
    return;
  }
  live_ = *std::move(made);
  monitor_.clear();
  alarms_ = 0;
  told_ = {};
  late_ = since_log_ = 0;
  compute_ = {};
  live_->reader.emplace(document->reader());
  live_->metres = live_->servo.workspace.metres_per_unit;
  const double metres = live_->servo.workspace.metres_per_unit;
  Session::Settings settings;
  settings.servo = live_->servo;
  settings.sculpt.full_depth = kFullDepth / metres;
  settings.sculpt.light_depth = kLightDepth / metres;
  settings.on_tick = [live = live_.get(), this](const ServoTick& tick) { live->tick(tick, monitor_, *sound_); };
  live_->session.emplace(*live_->device, *document, settings, live_->recorder ? &*live_->recorder : nullptr);
  live_->control.emplace(*live_->session, live_->device->info(), live_->servo);
  if (!forces_) live_->control->forces(false);
  limit_force();
  if (scale_ != 1) set_scale(scale_);
  use_brush();
  sound_->run(true);
  timer_.start();
  event_log().write(QStringLiteral("device"), {{"id", id_}, {"recording", recording}});
  emit changed();
  emit safetyChanged();
}

void Hand::stop() {
  if (!live_) return;
  timer_.stop();
  sound_->run(false);
  const Status recorded = live_->session->stop();
  const SessionStats stats = live_->session->stats();
  const auto micro = [](std::uint64_t ns) { return static_cast<double>(ns) * 1e-3; };
  event_log().write(QStringLiteral("device-end"), {{"id", id_},
                                                   {"ticks", qint64(stats.servo.ticks)},
                                                   {"overruns", qint64(stats.servo.overruns)},
                                                   {"dropped", qint64(stats.servo.dropped)},
                                                   {"late_us_p999", micro(stats.servo.late.quantile(0.999))},
                                                   {"compute_us_p50", micro(stats.servo.compute.quantile(0.5))},
                                                   {"compute_us_p999", micro(stats.servo.compute.quantile(0.999))},
                                                   {"force_max", stats.force_max}});
  live_.reset();
  if (!recorded) say(recorded.error());
  emit changed();
  emit safetyChanged();
}

void Hand::use_brush() {
  if (!live_) return;
  live_->session->set_brush(tools_.brush());
  live_->sculpts = tools_.tool().has_value();
}

void Hand::say(const Error& error) { emit said(error_text(error)); }

// ---- Its ticks

void Hand::take_ticks() {
  if (!live_) return;
  const std::size_t fresh = monitor_.drain();
  live_->control->flush();
  if (live_->pointer != nullptr) static_cast<void>(live_->pointer->felt(live_->feel));
  for (std::size_t k = monitor_.size() - std::min(fresh, monitor_.size()); k < monitor_.size(); ++k) {
    compute_.add(static_cast<std::uint64_t>(monitor_[k].compute * 1e9F));
    late_ += monitor_[k].late > kLate ? 1 : 0;
  }
  if (fresh > 0) emit ticked(static_cast<int>(fresh));
  const SafetyWatch& watch = monitor_.safety();
  if (watch.alarms() > std::exchange(alarms_, watch.alarms()))
    if (const QString sentence = alarm_sentence(watch.alarm()); !sentence.isEmpty())
      emit alarm(sentence, watch.alarm().cause == ServoFault::Reconnected);
  if (const HandSafety now = watch.now(); now != told_) {
    told_ = now;
    log_state();
    emit safetyChanged();
  }
  if (++since_log_ >= kLogEvery) log_state();
  if (live_->session->running()) return;
  // A recording is at its end, or a device is lost for good.
  const bool played = id_.startsWith(kReplay);
  stop();
  id_ = kNone;
  if (played)
    emit said(tr("The recording has been played."));
  else
    emit alarm(tr("The device is lost. Choose it again once it answers."), false);
  emit changed();
}

void Hand::log_state() {
  since_log_ = 0;
  if (!event_log().active()) return;
  const ServoSample& last = monitor_.last();
  const HandSafety now = safety();
  const double millimetres = metres_per_unit() * 1e3;
  QJsonArray flags;
  for (std::uint32_t left = last.flags; left != 0; left &= left - 1)
    flags.append(text(name(static_cast<ServoFault>(left & ~(left - 1)))));
  const auto micro = [this](double q) { return static_cast<double>(compute_.quantile(q)) * 1e-3; };
  event_log().write(QStringLiteral("hand"), {{"device", id_},
                                             {"ticks", qint64(monitor_.taken())},
                                             {"missing", qint64(monitor_.missing())},
                                             {"late", late_},
                                             {"cpu_us_p50", micro(0.5)},
                                             {"cpu_us_p999", micro(0.999)},
                                             {"contact", last.contact},
                                             {"force", length(last.force)},
                                             {"force_limit", force_limit()},
                                             {"forces", forces_},
                                             {"depth", last.depth * millimetres},
                                             {"flags", flags},
                                             {"kind", state_word(now.state)},
                                             {"cause", text(name(now.cause))},
                                             {"state", safety_sentence(now, !forces_)}});
}

// ---- What people set

void Hand::set_forces(bool on) {
  if (live_) live_->control->forces(on);
  forces_ = on;
  log_state();
  emit changed();
  emit safetyChanged();
}

double Hand::most_force() const { return live_ ? cap_ * live_->device->info().max_force : 0; }

double Hand::force_limit() const { return live_ ? live_->control->force_limit() : 0; }

void Hand::set_force_limit(double newton) {
  if (!live_) return;
  limit_ = newton < most_force() ? std::max(newton, 0.0) : std::numeric_limits<double>::infinity();
  limit_force();
}

void Hand::limit_force() { live_->control->limit_force(std::min(limit_, most_force())); }

void Hand::set_force_cap(double share) {
  cap_ = std::clamp(share, 0.0, 1.0);
  if (!live_) return;
  limit_force();
  emit changed();
}

void Hand::set_scale(double factor) {
  scale_ = std::clamp(factor, HandControl::kLeastScale, HandControl::kMostScale);
  if (!live_) return;
  live_->control->scale(scale_, monitor_.taken() > 0 ? monitor_.last().cursor : live_->servo.workspace.model_origin);
  live_->metres = metres_per_unit();
}

bool Hand::clutched() const { return live_ && live_->control->clutched(); }

void Hand::set_clutch(bool held) {
  if (!live_) return;
  live_->control->clutch(held);
  emit changed();
}

void Hand::recentre(const Ray3d& view) {
  if (!live_ || live_->pointer != nullptr) return;
  const SnapshotPtr model = bridge_.head();
  const Vec3d along = normalized(view.direction);
  const auto hit = raycast(*model, view, hint_);
  const Vec3d place = hit ? hit->point.position : bounds_of_surface(*model).centre();
  live_->control->recentre(place - along * (kInFront / metres_per_unit()));
}

double Hand::metres_per_unit() const { return live_ ? live_->control->settings().workspace.metres_per_unit : 1; }

void Hand::set_sound(bool on) {
  sound_->set_on(on);
  if (!sound_->trouble().isEmpty()) emit said(sound_->trouble());
  emit changed();
}

bool Hand::sound() const { return sound_->on(); }

QString Hand::sound_trouble() const { return sound_->trouble(); }

// ---- Recording

bool Hand::recording() const { return live_ && live_->recorder.has_value(); }

void Hand::record(const QString& file) {
  if (!live_) return;
  stop();
  start(file);
  if (recording()) last_recording_ = file;
  emit changed();
}

void Hand::stop_recording() {
  if (!recording()) return;
  stop();
  start();
  emit said(tr("Recorded into %1.").arg(QFileInfo(last_recording_).fileName()));
}

// ---- The mouse as a force probe

void Hand::point(const Ray3d& ray, bool pressed, double pressure) {
  ray_ = ray;
  has_ray_ = true;
  if (!probes()) return;
  const Ray3d held = live_->resistance.step(ray, pressed, length(live_->feel.force));
  PointerPlace place = pointer_place(*bridge_.head(), held, live_->control->settings().workspace, hint_);
  place.pressure = std::clamp(pressure, 0.0, 1.0);
  // A mouse presses with 1, a pen as hard as it is pressed.
  place.depth = pressed ? depth_ * (place.pressure > 0 ? place.pressure : 1) : -kHover;
  live_->pointer->point(place);
}

void Hand::leave() {
  if (has_ray_) point(ray_, false, 0);
}

void Hand::turn_depth(double notches) {
  depth_ = std::clamp(depth_ + notches * kNotch, kLeastDepth, kMostDepth);
  if (has_ray_) point(ray_, true, 1);
}

}  // namespace relief::studio
