#include "preferences.h"

#include "languages.h"
#include "shelf.h"

#include <relief/base/assert.h>

#include <QStandardPaths>
#include <algorithm>

namespace relief::studio {

const std::vector<Preference>& preferences() {
  static const std::vector<Preference> all = {
      {"look/theme", QStringLiteral("desktop")},
      {"look/text", 100},
      {"look/reduced-motion", false},
      {"input/map", QStringLiteral("blender")},
      {"input/turntable", true},
      {"input/pressure", true},
      {"input/tilt", false},
      {"input/single-keys", true},
      {"drawing/samples", QStringLiteral("16")},
      {"forces/most", 100},
      {"forces/sound", false},
      {"folders/pictures", QStandardPaths::writableLocation(QStandardPaths::PicturesLocation)},
      {"folders/unnamed", Shelf::preset_unnamed_folder()},
      {"language", QString()},
  };
  return all;
}

QVariant preset_of(const QString& key) {
  const auto found = std::ranges::find(preferences(), key, &Preference::key);
  RELIEF_ASSERT(found != preferences().end());
  return found->preset;
}

QStringList values_of(const QString& key) {
  if (key == QLatin1String("look/theme")) return {"desktop", "dark", "light"};
  if (key == QLatin1String("input/map")) return {"blender", "industry", "pen"};
  if (key == QLatin1String("drawing/samples")) return {"1", "4", "16"};
  if (key == QLatin1String("language")) return QStringList{QString()} + languages();
  return {};
}

std::optional<std::pair<int, int>> percents_of(const QString& key) {
  if (key == QLatin1String("look/text")) return std::pair(80, 200);
  if (key == QLatin1String("forces/most")) return std::pair(10, 100);
  return std::nullopt;
}

QVariant chosen(const QSettings& settings, const QString& key) {
  const QVariant preset = preset_of(key), kept = settings.value(key, preset);
  if (const QStringList values = values_of(key); !values.isEmpty())
    return values.contains(kept.toString()) ? kept : preset;
  if (const auto range = percents_of(key)) {
    bool number = false;
    const int percent = kept.toInt(&number);
    return number ? std::clamp(percent, range->first, range->second) : preset;
  }
  if (preset.typeId() == QMetaType::Bool) return kept.toBool();
  return kept.toString().isEmpty() ? preset : kept;
}

}  // namespace relief::studio
