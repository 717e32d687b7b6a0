#include <relief/convert/obstacle_text.h>

#include <string_view>

namespace relief::detail {
namespace {

std::string one_or_many(std::size_t count, std::string_view one, std::string_view many) {
  return std::to_string(count) + " " + std::string(count == 1 ? one : many);
}

}  // namespace

std::string clause(const Obstacle& obstacle) {
  const std::size_t n = obstacle.count;
  switch (obstacle.kind) {
    case DefectKind::HighValence:
      return "a vertex has " + std::to_string(n) + " triangles around it, too many to compare";
    case DefectKind::SingularVertex:
      return one_or_many(n, "vertex has", "vertices have") + " no common front-facing direction";
    case DefectKind::SelfIntersection:
      return one_or_many(n, "triangle intersects others", "triangles intersect others");
    case DefectKind::PatchIntersection:
      return "what fills holes intersects itself or the source, in " + one_or_many(n, "triangle", "triangles");
    case DefectKind::TooNear:
      return one_or_many(n, "triangle lies", "triangles lie") + " on others, or too near to tell apart";
    case DefectKind::Fold:
      return one_or_many(n, "triangle has", "triangles have") + " another over it that folds";
  }
  return {};
}

}  // namespace relief::detail
