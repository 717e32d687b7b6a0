// The stages of a conversion as meshes that can be drawn.
#pragma once

#include <relief/mesh/triangle_mesh.h>

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string_view>

namespace relief {

/// In the order in which a conversion comes to them. Each has colours that say what was done.
enum class Stage : std::uint8_t {
  Repaired,  ///< welded, oriented, manifold; each component in a colour of its own
  Remeshed,  ///< the solid made again, where there is one
  Closed,    ///< with its openings closed; what closes them is red
  Skin,      ///< the outer skin, where parts overlap; what is left of each part in a colour of its own
  Prepared,  ///< what the shell stands on; patches are orange, what closes openings is red
  Shell      ///< the outer triangles of the slabs, each in a colour of its own
};
inline constexpr std::array kStages = {Stage::Repaired, Stage::Remeshed, Stage::Closed,
                                       Stage::Skin,     Stage::Prepared, Stage::Shell};

[[nodiscard]] constexpr std::string_view name(Stage stage) noexcept {
  constexpr std::array<std::string_view, kStages.size()> kNames = {"repaired", "remeshed", "closed",
                                                                   "skin",     "prepared", "shell"};
  return kNames[static_cast<std::size_t>(stage)];
}
[[nodiscard]] constexpr std::optional<Stage> stage_from_name(std::string_view text) noexcept {
  for (const Stage stage : kStages)
    if (text == name(stage)) return stage;
  return std::nullopt;
}

/// Takes the stages. One may come several times, where a source is tried in several ways: the last is the one that led
/// to the model. Corners are not shared between triangles. Called from the thread that converts.
using StageSink = std::function<void(Stage stage, TriangleMesh mesh)>;

}  // namespace relief
