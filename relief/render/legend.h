// The colours of analysis maps, and the legend that says what they mean.
#pragma once

#include "text.h"

#include <string>

namespace relief::detail {

/// Holds what a map shows: values from low to high, over its colours.
struct MapScale {
  double low = 0, high = 1;
  friend bool operator==(const MapScale&, const MapScale&) = default;
};

/// Cividis for what has one end, blue - white - orange for what has a middle: both are told apart by all kinds of
/// colour vision. 256 colours, RGBA, sRGB.
[[nodiscard]] std::array<std::uint32_t, 256> map_colours(Look::Map map);
/// Returns the same at t, 0..1.
[[nodiscard]] Vec3f map_colour(Look::Map map, double t);

/// Returns the smallest of 1, 2, 5, 10, 20, ... times a power of ten that is not less.
[[nodiscard]] double rounded_up(double value) noexcept;

/// Draws it into the lower left corner of a picture of that height, right of what the look keeps free, where it meets
/// the rectangle. `text` null: without
/// words.
void draw_legend(const Pixels& pixels, int height, const Look& look, const MapScale& scale, const Text* text);

}  // namespace relief::detail
