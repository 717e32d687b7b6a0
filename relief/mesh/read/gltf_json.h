// What the readers of glTF's JSON share: members of objects, checked as they are taken.
#pragma once

#include <nlohmann/json.hpp>

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>

namespace relief::detail {

using Json = nlohmann::json;

[[nodiscard]] inline const Json* member(const Json& object, const char* key) {
  if (!object.is_object()) return nullptr;
  const auto at = object.find(key);
  return at == object.end() ? nullptr : &*at;
}

/// Returns a whole number that is not negative; `otherwise` when it is missing.
[[nodiscard]] inline std::optional<std::uint64_t> whole(const Json& object, const char* key,
                                                        std::optional<std::uint64_t> otherwise = {}) {
  const Json* value = member(object, key);
  if (value == nullptr) return otherwise;
  if (value->is_number_unsigned()) return value->get<std::uint64_t>();
  if (value->is_number_float()) {
    const double real = value->get<double>();
    if (real >= 0.0 && real < 9e15 && std::trunc(real) == real) return static_cast<std::uint64_t>(real);
  }
  return std::nullopt;
}

/// Returns the element of a top-level array, or null.
[[nodiscard]] inline const Json* element(const Json& root, const char* array, std::optional<std::uint64_t> index) {
  const Json* list = member(root, array);
  return list != nullptr && list->is_array() && index && *index < list->size() ? &(*list)[*index] : nullptr;
}

[[nodiscard]] inline std::string text(const Json& object, const char* key) {
  const Json* value = member(object, key);
  return value != nullptr && value->is_string() ? value->get<std::string>() : std::string();
}

/// Fills `values` from a list of that many numbers; true when it is missing, too.
template <std::size_t kCount>
[[nodiscard]] bool numbers(const Json& object, const char* key, std::array<double, kCount>& values) {
  const Json* list = member(object, key);
  if (list == nullptr) return true;
  if (!list->is_array() || list->size() != kCount) return false;
  for (std::size_t k = 0; k < kCount; ++k) {
    if (!(*list)[k].is_number()) return false;
    values[k] = (*list)[k].template get<double>();
  }
  return true;
}

}  // namespace relief::detail
