// Which tool is in the hand, and how it is set.
#pragma once

#include <relief/edit/tools.h>

#include <QObject>
#include <QSettings>
#include <QString>
#include <vector>

namespace relief::studio {

/// Touch, and all tools of the library with a brush each. Radius, sample spacing, symmetry, pressure curve, what it
/// drives and stabiliser are those of the hand and the same for all tools; all else belongs to the tool.
class ToolState : public QObject {
  Q_OBJECT
 public:
  explicit ToolState(QObject* parent = nullptr);

  /// "touch" or the id of a tool.
  [[nodiscard]] static const QStringList& ids();
  [[nodiscard]] static QString title(const QString& id);
  [[nodiscard]] static QString help(const QString& id);
  [[nodiscard]] static QString key(const QString& id);
  /// Empty for "touch".
  [[nodiscard]] static std::optional<Tool> tool_of(const QString& id);

  [[nodiscard]] const QString& id() const { return id_; }
  [[nodiscard]] std::optional<Tool> tool() const { return tool_of(id_); }
  void choose(const QString& id);

  /// The brush of the tool in the hand; of Touch, one that does nothing but has the hand's radius.
  [[nodiscard]] Brush brush() const { return brush_of(id_); }
  [[nodiscard]] Brush brush_of(const QString& id) const;
  /// That of the opposite tool, of Smooth; empty where there is none.
  [[nodiscard]] std::optional<Brush> inverted() const;
  [[nodiscard]] Brush smoothing() const;

  /// By the id of a setting; clamped to what it may be.
  [[nodiscard]] double value(const QString& setting) const;
  void set_value(const QString& setting, double value);
  void set_colour(Vec3f colour);
  void set_pressure(const PressureCurve& curve);
  void set_use_pressure(bool use);
  [[nodiscard]] bool use_pressure() const { return use_pressure_; }
  /// Whether a pen works with less pressure the flatter it lies.
  void set_use_tilt(bool use);
  [[nodiscard]] bool use_tilt() const { return use_tilt_; }
  void set_mirror(Vec3d point) { mirror_ = point; }

  /// Lengths keep their share of it: a tool is as large on the next model as on this one. Does nothing where it is no
  /// positive finite length, as of a mesh that is not repaired yet.
  void set_diagonal(double diagonal);
  /// Radius, stabiliser and sample spacing as on the first day.
  void forget_hand();
  /// Writes the tool in the hand and all that is set, lengths as shares of the diagonal, below "tools/". Not the
  /// symmetry, which is the model's, and not the pen's curve, which the preferences keep.
  void keep(QSettings& settings) const;
  /// Takes over what keep() has written; what is not there or may not be stays as it is.
  void take_kept(const QSettings& settings);
  /// What a setting of kind Value may be; lengths follow the model.
  [[nodiscard]] std::pair<double, double> range(const SettingInfo& setting) const;
  [[nodiscard]] double least_radius() const { return 0.001 * diagonal_; }
  [[nodiscard]] double most_radius() const { return 0.25 * diagonal_; }

 signals:
  void toolChanged(const QString& id);
  /// The id of a setting, "colour" or "pressure_curve".
  void settingChanged(const QString& setting);

 private:
  [[nodiscard]] double clamped(const SettingInfo& setting, double value) const;
  template <class State, class Each>
  static void for_each_kept(State& state, const Each& each);

  QString id_ = QStringLiteral("carve");
  std::vector<Brush> brushes_;  ///< by number of the tool
  Brush hand_;                  ///< what all tools share; lengths in model units
  Vec3d mirror_;
  double diagonal_ = 1;
  bool use_pressure_ = true, use_tilt_ = false;
};

}  // namespace relief::studio
