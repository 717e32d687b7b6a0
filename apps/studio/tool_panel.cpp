#include "tool_panel.h"

#include "text.h"
#include "widgets/curve_editor.h"
#include "widgets/theme.h"
#include "widgets/value_bar.h"

#include <QCheckBox>
#include <QComboBox>
#include <QCoreApplication>
#include <QHBoxLayout>
#include <QLabel>
#include <QToolButton>
#include <QVBoxLayout>

namespace relief::studio {

namespace {

/// Those in the bar above the picture.
bool elsewhere(const SettingInfo& setting) { return setting.id == "radius" || setting.id == "strength"; }

QString in_our_language(std::string_view words) {
  return QCoreApplication::translate("Settings", std::string(words).c_str());
}

}  // namespace

ValueFormat format_of(const SettingInfo& setting, Unit unit) {
  if (setting.unit == SettingInfo::Unit::Length) return length_format(text(name(unit)));
  if (setting.unit == SettingInfo::Unit::Radii) return percent_format(1);  // the smallest are about one percent
  if (setting.unit == SettingInfo::Unit::Percent) return percent_format();
  return plain_format(2);
}

ToolPanel::ToolPanel(ToolState& tools, QWidget* parent) : ColumnArea(parent), tools_(tools) {
  setObjectName(QStringLiteral("tool-settings"));
  setAccessibleName(tr("Tool settings"));
  build();
  connect(&tools_, &ToolState::toolChanged, this, &ToolPanel::build);
  connect(&tools_, &ToolState::settingChanged, this, &ToolPanel::refresh);
}

QSize ToolPanel::sizeHint() const { return {scaled(250), scaled(450)}; }

void ToolPanel::set_unit(Unit unit) {
  unit_ = unit;
  build();
}

void ToolPanel::build() {
  refreshers_.clear();
  pointer_ = nullptr;
  curve_ = nullptr;
  auto* page = new QWidget;
  auto* column = new QVBoxLayout(page);
  column->setContentsMargins(scaled(8), scaled(6), scaled(8), scaled(6));
  auto* help = new QLabel(ToolState::help(tools_.id()), page);
  help->setWordWrap(true);
  help->setProperty("role", QStringLiteral("dim"));
  column->addWidget(help);
  if (const auto tool = tools_.tool())
    for (const SettingInfo& setting : info(*tool).settings)
      if (!elsewhere(setting)) add_setting(setting, *column);
  column->addStretch(1);
  setWidget(page);
  refresh();
}

void ToolPanel::refresh() {
  for (const auto& each : refreshers_) each();
}

void ToolPanel::add_setting(const SettingInfo& setting, QVBoxLayout& into) {
  const QString id = text(setting.id), title = in_our_language(setting.title);
  using Kind = SettingInfo::Kind;
  if (setting.kind == Kind::Value) {
    auto* bar = new ValueBar(title, this);
    const auto [low, high] = tools_.range(setting);
    bar->setObjectName(QStringLiteral("setting-") + id);
    bar->set_range(low, high, ValueBar::Scale::Linear, setting.unit == SettingInfo::Unit::Length ? 0 : setting.step);
    bar->set_format(format_of(setting, unit_));
    if (!setting.help.empty()) bar->set_help(in_our_language(setting.help));
    connect(bar, &ValueBar::valueEdited, this, [this, id](double value) { tools_.set_value(id, value); });
    refreshers_.emplace_back([this, bar, id] { bar->set_real_value(tools_.value(id)); });
    into.addWidget(bar);
  } else if (setting.kind == Kind::Curve) {
    add_pressure(into);
  } else if (setting.kind == Kind::Switch) {
    auto* box = new QCheckBox(title, this);
    box->setObjectName(QStringLiteral("setting-") + id);
    connect(box, &QCheckBox::toggled, this, [this, id](bool on) { tools_.set_value(id, on ? 1 : 0); });
    refreshers_.emplace_back([this, box, id] { box->setChecked(tools_.value(id) != 0); });
    into.addWidget(box);
  } else if (id == QLatin1String("symmetry")) {
    auto* row = new QHBoxLayout;
    row->addWidget(new QLabel(tr("Mirror"), this));
    for (int axis = 0; axis < 3; ++axis) {
      auto* box = new QCheckBox(QString(QChar(u'X' + axis)), this);
      box->setObjectName(QStringLiteral("mirror-%1").arg(axis));
      box->setAccessibleName(tr("Mirror %1").arg(QChar(u'X' + axis)));
      connect(box, &QCheckBox::toggled, this, [this, axis](bool on) {
        const int planes = static_cast<int>(tools_.value("symmetry"));
        tools_.set_value("symmetry", on ? planes | (1 << axis) : planes & ~(1 << axis));
      });
      refreshers_.emplace_back(
          [this, box, axis] { box->setChecked((static_cast<int>(tools_.value("symmetry")) >> axis & 1) != 0); });
      row->addWidget(box);
    }
    row->addStretch(1);
    into.addLayout(row);
  } else if (setting.kind == Kind::Choice) {
    auto* row = new QHBoxLayout;
    auto* label = new QLabel(title, this);
    auto* choice = new QComboBox(this);
    choice->setObjectName(QStringLiteral("setting-") + id);
    choice->setAccessibleName(title);
    label->setBuddy(choice);
    // "Pressure drives" goes on with its choice. A capital would make that the name of another control.
    const bool by_pressure = id == QLatin1String("pressure_drives");
    for (const std::string_view each : setting.choices) {
      QString words = in_our_language(each);
      if (!by_pressure) words[0] = words[0].toUpper();
      choice->addItem(words);
    }
    connect(choice, &QComboBox::currentIndexChanged, this, [this, id](int index) { tools_.set_value(id, index); });
    refreshers_.emplace_back([this, choice, id, by_pressure] {
      choice->setCurrentIndex(static_cast<int>(tools_.value(id)));
      choice->setEnabled(!by_pressure || tools_.use_pressure());
    });
    row->addWidget(label);
    row->addWidget(choice, 1);
    into.addLayout(row);
  }
}

void ToolPanel::add_pressure(QVBoxLayout& into) {
  auto* use = new QCheckBox(tr("Use pressure"), this);
  use->setObjectName(QStringLiteral("use-pressure"));
  use->setAccessibleDescription(tr("Whether a pen's pressure drives the tool"));
  connect(use, &QCheckBox::toggled, &tools_, &ToolState::set_use_pressure);
  refreshers_.emplace_back([this, use] { use->setChecked(tools_.use_pressure()); });
  into.addWidget(use);
  auto* tilt = new QCheckBox(tr("Tilt lightens"), this);
  tilt->setObjectName(QStringLiteral("use-tilt"));
  tilt->setAccessibleDescription(tr("Whether a pen works with less pressure the flatter it lies"));
  connect(tilt, &QCheckBox::toggled, &tools_, &ToolState::set_use_tilt);
  refreshers_.emplace_back([this, tilt] {
    tilt->setChecked(tools_.use_tilt());
    tilt->setEnabled(tools_.use_pressure());
  });
  into.addWidget(tilt);
  curve_ = new CurveEditor(this);
  curve_->setObjectName(QStringLiteral("pressure-curve"));
  connect(curve_, &CurveEditor::curveEdited, &tools_, &ToolState::set_pressure);
  refreshers_.emplace_back([this] {
    curve_->set_curve(tools_.brush().pressure);
    curve_->setEnabled(tools_.use_pressure());
  });
  into.addWidget(curve_);
  pointer_ = new QLabel(this);
  pointer_->setObjectName(QStringLiteral("pointer"));
  pointer_->setProperty("role", QStringLiteral("dim"));
  into.addWidget(pointer_);
  refreshers_.emplace_back(
      [this] { pointer_->setText(pointer_words_.isEmpty() ? tr("Mouse: no pressure") : pointer_words_); });
}

void ToolPanel::set_pointer(const QString& words, double pressure) {
  pointer_words_ = words;
  if (pointer_ != nullptr) pointer_->setText(words);
  if (curve_ != nullptr) curve_->set_live_pressure(pressure > 0 ? std::optional(pressure) : std::nullopt);
}

}  // namespace relief::studio
