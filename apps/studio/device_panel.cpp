#include "device_panel.h"

#include "hand_text.h"
#include "text.h"
#include "widgets/accessible.h"
#include "widgets/icons.h"
#include "widgets/paragraph.h"
#include "widgets/plot.h"
#include "widgets/theme.h"
#include "widgets/value_bar.h"

#include <QGridLayout>
#include <QHBoxLayout>
#include <QLabel>
#include <QLocale>
#include <QMenu>
#include <QPushButton>
#include <QStyle>
#include <QVBoxLayout>
#include <algorithm>
#include <cmath>

namespace relief::studio {

namespace {

constexpr double kPlotSeconds = 10;
constexpr double kMicro = 1e6;

QString newton(double force) {
  return QStringLiteral("%1 N").arg(QLocale().toString(force, 'f', force < 9.95 ? 1 : 0));
}
QString micro(double seconds) { return QStringLiteral("%1 µs").arg(QLocale().toString(seconds * kMicro, 'f', 0)); }

/// A number with " N" or "×" behind it, as people may type it too.
ValueFormat with_sign(const QString& sign, int decimals, const QString& example) {
  return {.text = [sign, decimals](double v) { return QLocale().toString(v, 'f', decimals) + sign; },
          .parse = [sign](const QString& typed) -> std::optional<double> {
            bool ok = false;
            const double v = QString(typed).remove(sign.trimmed()).trimmed().replace(',', '.').toDouble(&ok);
            return ok ? std::optional(v) : std::nullopt;
          },
          .example = example};
}

void give_role(QLabel* label, const QString& role) {
  if (label->property("role").toString() == role) return;
  label->setProperty("role", role);
  label->style()->unpolish(label);
  label->style()->polish(label);
}

}  // namespace

DevicePanel::DevicePanel(Hand& hand, QMenu& devices, QWidget* parent)
    : QWidget(parent),
      hand_(hand),
      device_(new QPushButton(this)),
      claim_(new Paragraph({}, this)),
      state_(new Paragraph({}, this)),
      at_cursor_(new Paragraph({}, this)),
      live_(new QWidget(this)) {
  setObjectName(QStringLiteral("device-settings"));
  auto* column = new QVBoxLayout(this);
  column->setContentsMargins(scaled(8), scaled(6), scaled(8), scaled(6));
  column->setSpacing(scaled(5));
  device_->setObjectName(QStringLiteral("choose-device"));
  device_->setAccessibleName(tr("Choose a device"));
  device_->setMenu(&devices);
  device_->setIcon(icon(u"device"));
  device_->setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
  claim_->setProperty("role", "dim");
  state_->setObjectName(QStringLiteral("hand-state"));
  state_->setAccessibleName(tr("State of the hand"));
  state_->setFont(ui_font(10, QFont::DemiBold));
  at_cursor_->setObjectName(QStringLiteral("hand-at-cursor"));
  at_cursor_->setAccessibleName(tr("At the cursor"));
  at_cursor_->setProperty("role", "dim");
  at_cursor_->hide();
  column->addWidget(device_);
  column->addWidget(claim_);
  column->addWidget(state_);
  column->addWidget(live_);
  column->addStretch(1);
  auto* inside = new QVBoxLayout(live_);
  inside->setContentsMargins(0, 0, 0, 0);
  inside->setSpacing(scaled(5));
  build_buttons();
  auto* first = new QHBoxLayout;  // always seen, however low the panel is
  first->addWidget(freeze_);
  first->addWidget(forces_);
  inside->addLayout(first);
  build_plots();
  inside->addWidget(at_cursor_);
  lay_out_controls(*inside);
  connect(&hand_, &Hand::changed, this, &DevicePanel::refresh);
  connect(&hand_, &Hand::safetyChanged, this, &DevicePanel::refresh_state);
  connect(&hand_, &Hand::ticked, this, &DevicePanel::take);
  refresh();
}

void DevicePanel::build_plots() {
  const auto plot = [this](const QString& id, const QString& title, PlotView::Colour colour,
                           std::function<QString(double)> format) {
    auto* made = new PlotView(title, colour, live_);
    made->setObjectName(id);
    made->set_seconds(kPlotSeconds);
    made->set_format(std::move(format));
    live_->layout()->addWidget(made);
    connect(made, &PlotView::scrubbed, this, &DevicePanel::scrub);
    return made;
  };
  force_ = plot(QStringLiteral("plot-force"), tr("Force"), PlotView::Colour::Good, newton);
  depth_ = plot(QStringLiteral("plot-depth"), tr("Depth under the surface"), PlotView::Colour::Blue,
                [this](double depth) { return length_text(depth, unit_); });
  period_ = plot(QStringLiteral("plot-period"), tr("Period"), PlotView::Colour::Good, micro);
  time_ = plot(QStringLiteral("plot-time"), tr("Time per tick"), PlotView::Colour::Accent, micro);
}

QPushButton* DevicePanel::button(const QString& id, const QString& name, const QString& help, bool checkable) {
  auto* made = new QPushButton(live_);
  made->setObjectName(QStringLiteral("hand-") + id);
  made->setAccessibleName(name);
  made->setAccessibleDescription(help);
  made->setText(name);
  made->setToolTip(help);
  made->setCheckable(checkable);
  if (has_icon(id)) made->setIcon(icon(id));
  made->setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
  return made;
}

void DevicePanel::build_buttons() {
  freeze_ = button(QStringLiteral("freeze"), tr("Freeze"), tr("Keeps the plots as they are, to look at them"), true);
  forces_ = button(QStringLiteral("forces-off"), tr("Forces off"), tr("No force at once (Pause, or Esc twice)"), true);
  clutch_ =
      button(QStringLiteral("clutch"), tr("Clutch"), tr("The device moves, and the tool stays where it is"), true);
  recentre_ =
      button(QStringLiteral("recentre"), tr("Re-centre"), tr("Puts the tool before the middle of the picture"), false);
  record_ =
      button(QStringLiteral("record"), tr("Record"), tr("Writes all that the hand does and feels into a file"), true);
  play_ = button(QStringLiteral("play"), tr("Play"), tr("Plays the last recording as a device"), false);
  sound_ = button(QStringLiteral("sound"), tr("Sound"), tr("Lets the contact be heard"), true);
  limit_ = new ValueBar(tr("Force limit"), live_);
  limit_->setObjectName(QStringLiteral("force-limit"));
  limit_->set_help(tr("No more force than this reaches the hand"));
  limit_->set_format(with_sign(QStringLiteral(" N"), 1, QStringLiteral("1.5 N")));
  scale_ = new ValueBar(tr("Workspace scale"), live_);
  scale_->setObjectName(QStringLiteral("workspace-scale"));
  scale_->set_help(tr("How large the model is in the hand"));
  scale_->set_range(0.25, 4, ValueBar::Scale::Logarithmic);
  scale_->set_format(with_sign(QStringLiteral(" ×"), 2, QStringLiteral("1.5 ×")));
  // Assistive tools check a button without clicking it.
  connect(freeze_, &QPushButton::toggled, this, &DevicePanel::freeze);
  connect(forces_, &QPushButton::toggled, this, [this](bool off) {
    if (off == hand_.forces()) hand_.set_forces(!off);
  });
  connect(clutch_, &QPushButton::toggled, this, [this](bool held) {
    if (held != hand_.clutched()) hand_.set_clutch(held);
  });
  connect(sound_, &QPushButton::toggled, this, [this](bool on) {
    if (on != hand_.sound()) hand_.set_sound(on);
  });
  connect(record_, &QPushButton::toggled, this, [this](bool on) {
    if (on == hand_.recording()) return;
    if (on)
      emit recordAsked();
    else
      hand_.stop_recording();
  });
  connect(recentre_, &QPushButton::clicked, this, &DevicePanel::recentreAsked);
  connect(play_, &QPushButton::clicked, this, &DevicePanel::playAsked);
  connect(limit_, &ValueBar::valueEdited, &hand_, &Hand::set_force_limit);
  connect(scale_, &ValueBar::valueEdited, &hand_, &Hand::set_scale);
}

void DevicePanel::lay_out_controls(QVBoxLayout& column) {
  auto* grid = new QGridLayout;
  grid->setSpacing(scaled(4));
  grid->addWidget(clutch_, 0, 0);
  grid->addWidget(recentre_, 0, 1);
  grid->addWidget(record_, 1, 0);
  grid->addWidget(play_, 1, 1);
  grid->addWidget(sound_, 2, 0);
  column.addLayout(grid);
  column.addWidget(limit_);
  column.addWidget(scale_);
}

void DevicePanel::refresh() {
  const bool on = hand_.active();
  device_->setText(hand_.title());
  QString claim;
  for (const Hand::Choice& choice : Hand::choices())
    if (choice.id == hand_.id()) claim = choice.status;
  claim_->setText(claim);
  claim_->setVisible(on && !claim.isEmpty());
  live_->setVisible(on);
  if (!on) {
    for (PlotView* plot : {force_, depth_, period_, time_}) plot->clear();
    worst_ = longest_ = 0;
    freeze_->setChecked(false);
  } else {
    limit_->set_range(0, std::max(hand_.most_force(), 0.1));
    limit_->set_real_value(hand_.force_limit());
    scale_->set_real_value(hand_.scale());
    force_->set_limit(hand_.force_limit());
  }
  const bool arm = on && !hand_.probes();
  clutch_->setEnabled(arm);
  recentre_->setEnabled(arm);
  forces_->setChecked(!hand_.forces());
  clutch_->setChecked(hand_.clutched());
  record_->setChecked(hand_.recording());
  record_->setText(hand_.recording() ? tr("Stop") : tr("Record"));
  record_->setIcon(icon(hand_.recording() ? u"stop" : u"record"));
  play_->setEnabled(!hand_.last_recording().isEmpty() && !hand_.recording());
  sound_->setChecked(hand_.sound());
  refresh_state();
}

void DevicePanel::refresh_state() {
  const QString words =
      hand_.active() ? safety_sentence(hand_.safety(), !hand_.forces()) : tr("The mouse and the pen sculpt.");
  state_->setText(words);
  describe(state_, words);
  give_role(state_, !hand_.active()  ? QStringLiteral("dim")
                    : hand_.forces() ? safety_role(hand_.safety().state)
                                     : QStringLiteral("bad"));
}

void DevicePanel::take(int count) {
  const HandMonitor& monitor = hand_.monitor();
  const std::size_t size = monitor.size(), fresh = std::min(size, static_cast<std::size_t>(count));
  std::vector<Sample> force, depth, period, time;
  for (std::size_t k = size - fresh; k < size; ++k) {
    const HandTick& tick = monitor[k];
    force.push_back({tick.t, length(tick.force)});
    depth.push_back({tick.t, tick.depth});
    if (tick.period > 0) period.push_back({tick.t, tick.period});  // the first has none
    time.push_back({tick.t, tick.compute});
    longest_ = std::max(longest_, tick.period);
    worst_ = std::max(worst_, tick.compute);
  }
  force_->append(force);
  depth_->append(depth);
  period_->append(period);
  time_->append(time);
  if (fresh == 0 || !isVisible()) return;
  const HandTick& last = monitor[size - 1];
  force_->set_limit(hand_.force_limit());
  force_->set_text(tr("%1 of %2").arg(newton(static_cast<double>(length(last.force))), newton(hand_.force_limit())));
  depth_->set_text(length_text(static_cast<double>(last.depth), unit_));
  period_->set_text(
      tr("%1, longest %2").arg(micro(static_cast<double>(last.period)), micro(static_cast<double>(longest_))));
  time_->set_text(tr("%1, worst %2").arg(micro(static_cast<double>(last.compute)), micro(static_cast<double>(worst_))));
}

void DevicePanel::freeze(bool on) {
  for (PlotView* plot : {force_, depth_, period_, time_}) {
    plot->set_frozen(on);
    if (!on) plot->set_cursor(std::nullopt);
  }
  frozen_ = on ? hand_.monitor().freeze() : std::vector<HandTick>();
  say_at_cursor(on && !frozen_.empty() ? tr("Drag along a plot to see one moment.") : QString());
}

void DevicePanel::say_at_cursor(const QString& words) {
  at_cursor_->setText(words);
  at_cursor_->setVisible(!words.isEmpty());
  describe(at_cursor_, words);
}

void DevicePanel::scrub(double time) {
  for (PlotView* plot : {force_, depth_, period_, time_}) plot->set_cursor(time);
  const auto after = std::ranges::upper_bound(frozen_, time, {}, &HandTick::t);
  if (after == frozen_.begin()) return;
  const HandTick& tick = *std::prev(after);
  QStringList facts = {tr("%1 s").arg(QLocale().toString(tick.t, 'f', 3)),
                       newton(static_cast<double>(length(tick.force)))};
  if (tick.contact) facts << tr("%1 deep").arg(length_text(static_cast<double>(tick.depth), unit_));
  facts
      << tr("tick %1 after %2").arg(micro(static_cast<double>(tick.compute)), micro(static_cast<double>(tick.period)));
  facts << tr("at %1, %2, %3")
               .arg(static_cast<double>(tick.position.x), 0, 'g', 4)
               .arg(static_cast<double>(tick.position.y), 0, 'g', 4)
               .arg(static_cast<double>(tick.position.z), 0, 'g', 4);
  for (std::uint32_t flags = tick.flags; flags != 0; flags &= flags - 1)
    facts << text(name(static_cast<ServoFault>(flags & ~(flags - 1))));
  say_at_cursor(facts.join(QStringLiteral(" · ")));
}

}  // namespace relief::studio
