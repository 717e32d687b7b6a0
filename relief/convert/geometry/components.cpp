#include <relief/base/disjoint_sets.h>
#include <relief/convert/geometry/components.h>

namespace relief::detail {

Components find_components(std::size_t point_count, std::span<const Face> faces) {
  DisjointSets sets(point_count);
  for (const Face& f : faces)
    for (std::size_t k = 1; k < 3 && f[0] < point_count; ++k) sets.join(f[0], f[k]);
  Components components;
  components.of_face.resize(faces.size());
  std::vector<std::uint32_t> number(point_count, kNone);
  for (std::size_t s = 0; s < faces.size(); ++s) {
    if (faces[s][0] >= point_count) continue;
    std::uint32_t& n = number[sets.least(faces[s][0])];
    if (n == kNone) n = components.count++;
    components.of_face[s] = n;
  }
  return components;
}

}  // namespace relief::detail
