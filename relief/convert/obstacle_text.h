// What stands in the way of a shell, in words.
#pragma once

#include <relief/convert/prepare/defects.h>

#include <string>

namespace relief::detail {

/// Returns a clause that a place may follow, such as "12 triangles intersect others".
[[nodiscard]] std::string clause(const Obstacle& obstacle);

}  // namespace relief::detail
