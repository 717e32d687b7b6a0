// What people choose for good: the names and presets of what is kept in the settings.
#pragma once

#include <QSettings>
#include <QStringList>
#include <optional>
#include <utility>

namespace relief::studio {

/// A choice that is kept under `key`. The first part of the key is its page.
struct Preference {
  const char* key;
  QVariant preset;
};

/// All of them, by page: look, input, drawing, forces, folders, language.
[[nodiscard]] const std::vector<Preference>& preferences();
/// Asserts that there is such a preference.
[[nodiscard]] QVariant preset_of(const QString& key);
/// What was chosen, else the preset. A kept value that is none of the possible ones counts as not chosen.
[[nodiscard]] QVariant chosen(const QSettings& settings, const QString& key);
/// The values that a choice among few may have; empty for all others.
[[nodiscard]] QStringList values_of(const QString& key);
/// The least and the most of a choice in percent; empty for all others.
[[nodiscard]] std::optional<std::pair<int, int>> percents_of(const QString& key);

}  // namespace relief::studio
