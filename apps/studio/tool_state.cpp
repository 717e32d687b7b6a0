#include "tool_state.h"

#include "text.h"

#include <QCoreApplication>
#include <algorithm>
#include <cmath>
#include <utility>

namespace relief::studio {

namespace {

const QString kTouch = QStringLiteral("touch");
/// Shares of the diagonal.
constexpr double kFirstRadius = 0.04, kMostHeight = 0.05, kMostResilience = 0.02;

bool belongs_to_hand(const QString& setting) {
  return setting == QLatin1String("radius") || setting == QLatin1String("symmetry") ||
         setting == QLatin1String("stabiliser") || setting == QLatin1String("detail") ||
         setting == QLatin1String("pressure_curve") || setting == QLatin1String("pressure_drives");
}

/// Whether the number of this setting is kept from one session to the next.
bool is_kept(const SettingInfo& setting) {
  return setting.kind != SettingInfo::Kind::Colour && setting.kind != SettingInfo::Kind::Curve &&
         setting.id != "symmetry" && setting.id != "pressure_drives";
}

/// Of any tool: settings of one id are the same for all.
const SettingInfo* find(std::string_view id) {
  for (const ToolInfo& tool : tools())
    if (const auto at = std::ranges::find(tool.settings, id, &SettingInfo::id); at != tool.settings.end()) return &*at;
  return nullptr;
}

}  // namespace

ToolState::ToolState(QObject* parent) : QObject(parent) {
  for (std::size_t k = 0; k < tools().size(); ++k) {
    Brush brush;
    brush.tool = static_cast<Tool>(k);
    for (const SettingInfo& each : tools()[k].settings)
      if (each.kind != SettingInfo::Kind::Colour && each.unit != SettingInfo::Unit::Length)
        (void)set(brush, each.id, each.preset);
    brush.colour = {0.70F, 0.24F, 0.16F};
    brushes_.push_back(brush);
  }
  forget_hand();
}

const QStringList& ToolState::ids() {
  static const QStringList all = [] {
    QStringList list{kTouch};
    for (const ToolInfo& tool : tools()) list.append(text(tool.id));
    return list;
  }();
  return all;
}

std::optional<Tool> ToolState::tool_of(const QString& id) { return tool_from_name(id.toStdString()); }

QString ToolState::title(const QString& id) {
  const auto tool = tool_of(id);
  if (!tool) return QCoreApplication::translate("Tools", "Touch");
  return QCoreApplication::translate("Tools", std::string(info(*tool).title).c_str());
}

QString ToolState::help(const QString& id) {
  const auto tool = tool_of(id);
  if (!tool) return QCoreApplication::translate("Tools", "Feels the surface with a device, and leaves no trace.");
  return QCoreApplication::translate("Tools", std::string(info(*tool).help).c_str());
}

QString ToolState::key(const QString& id) {
  const auto tool = tool_of(id);
  return tool ? text(info(*tool).key) : QStringLiteral("T");
}

void ToolState::choose(const QString& id) {
  if (id == id_ || !ids().contains(id)) return;
  id_ = id;
  emit toolChanged(id);
}

Brush ToolState::brush_of(const QString& id) const {
  const auto tool = tool_of(id);
  Brush brush = tool ? brushes_[static_cast<std::size_t>(*tool)] : Brush{};
  brush.radius = hand_.radius;
  brush.symmetry = hand_.symmetry;
  brush.stabiliser = hand_.stabiliser;
  brush.detail = hand_.detail;
  brush.pressure = hand_.pressure;
  brush.pressure_drives = hand_.pressure_drives;
  brush.mirror = mirror_;
  return brush;
}

std::optional<Brush> ToolState::inverted() const {
  const auto mine = tool();
  if (!mine) return std::nullopt;
  const std::string_view opposite = info(*mine).opposite;
  if (opposite.empty()) return std::nullopt;
  Brush brush = brush_of(text(opposite));
  brush.strength = brushes_[static_cast<std::size_t>(*mine)].strength;
  if (opposite == info(*mine).id) brush.height = -brush.height;
  return brush;
}

Brush ToolState::smoothing() const { return brush_of(text(name(Tool::Smooth))); }

double ToolState::value(const QString& setting_id) const {
  return setting(brush(), setting_id.toStdString()).value_or(0);
}

std::pair<double, double> ToolState::range(const SettingInfo& setting) const {
  if (setting.unit != SettingInfo::Unit::Length) return {setting.min, setting.max};
  if (setting.id == "radius") return {least_radius(), most_radius()};
  if (setting.id == "height") return {-kMostHeight * diagonal_, kMostHeight * diagonal_};
  if (setting.id == "resilience") return {0, kMostResilience * diagonal_};
  return {0, most_radius()};
}

double ToolState::clamped(const SettingInfo& setting, double value) const {
  if (setting.kind != SettingInfo::Kind::Value) return value;
  const auto [low, high] = range(setting);
  return std::clamp(value, low, high);
}

void ToolState::set_value(const QString& setting_id, double value) {
  const std::string id = setting_id.toStdString();
  if (const SettingInfo* known = find(id)) value = clamped(*known, value);
  const auto mine = tool();
  Brush* brush = belongs_to_hand(setting_id) ? &hand_ : mine ? &brushes_[static_cast<std::size_t>(*mine)] : nullptr;
  if (brush == nullptr || setting(*brush, id) == value || !set(*brush, id, value)) return;
  emit settingChanged(setting_id);
}

void ToolState::set_colour(Vec3f colour) {
  for (Brush& brush : brushes_) brush.colour = colour;
  emit settingChanged(QStringLiteral("colour"));
}

void ToolState::set_pressure(const PressureCurve& curve) {
  hand_.pressure = curve;
  emit settingChanged(QStringLiteral("pressure_curve"));
}

void ToolState::set_use_pressure(bool use) {
  use_pressure_ = use;
  emit settingChanged(QStringLiteral("use_pressure"));
}

void ToolState::set_use_tilt(bool use) {
  if (use == std::exchange(use_tilt_, use)) return;
  emit settingChanged(QStringLiteral("use_tilt"));
}

void ToolState::set_diagonal(double diagonal) {
  if (!(diagonal > 0) || !std::isfinite(diagonal)) return;
  const double scale = diagonal / diagonal_;
  diagonal_ = diagonal;
  hand_.radius *= scale;
  hand_.stabiliser *= scale;
  for (Brush& brush : brushes_) {
    brush.resilience *= scale;
    brush.height *= scale;
  }
  emit settingChanged(QStringLiteral("radius"));
  emit settingChanged(QStringLiteral("stabiliser"));
}

void ToolState::forget_hand() {
  hand_.radius = kFirstRadius * diagonal_;
  hand_.stabiliser = 0;
  hand_.detail = kDetail;
  emit settingChanged(QStringLiteral("detail"));
  emit settingChanged(QStringLiteral("radius"));
  emit settingChanged(QStringLiteral("stabiliser"));
}

/// Calls `each` with the brush that holds a setting, the setting, and the key under which it is kept.
template <class State, class Each>
void ToolState::for_each_kept(State& state, const Each& each) {
  for (std::size_t k = 0; k < tools().size(); ++k)
    for (const SettingInfo& setting : tools()[k].settings) {
      if (!is_kept(setting)) continue;
      const QString id = text(setting.id);
      const bool shared = belongs_to_hand(id);
      each(shared ? state.hand_ : state.brushes_[k], setting,
           QStringLiteral("tools/") + (shared ? QString() : text(tools()[k].id) + QLatin1Char('/')) + id);
    }
}

void ToolState::keep(QSettings& settings) const {
  settings.setValue(QStringLiteral("tools/in-hand"), id_);
  for_each_kept(*this, [&](const Brush& brush, const SettingInfo& setting, const QString& key) {
    const double value = relief::setting(brush, setting.id).value_or(setting.preset);
    settings.setValue(key, setting.unit == SettingInfo::Unit::Length ? value / diagonal_ : value);
  });
}

void ToolState::take_kept(const QSettings& settings) {
  for_each_kept(*this, [&](Brush& brush, const SettingInfo& setting, const QString& key) {
    bool number = false;
    double value = settings.value(key).toDouble(&number);
    if (!number || !std::isfinite(value)) return;
    if (setting.kind == SettingInfo::Kind::Choice && (value < 0 || value >= double(setting.choices.size()))) return;
    if (setting.kind == SettingInfo::Kind::Switch) value = value != 0 ? 1 : 0;
    if (setting.unit == SettingInfo::Unit::Length) value *= diagonal_;
    (void)set(brush, setting.id, clamped(setting, value));
    emit settingChanged(text(setting.id));
  });
  choose(settings.value(QStringLiteral("tools/in-hand"), id_).toString());
}

}  // namespace relief::studio
