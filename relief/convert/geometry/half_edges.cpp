#include <relief/convert/geometry/half_edges.h>

#include <cstddef>
#include <numeric>

namespace relief::detail {

Stars::Stars(std::span<const Face> faces, std::size_t point_count)
    : begin(point_count + 1, 0), half_edges(faces.size() * 3) {
  for (const Face& f : faces)
    for (const std::uint32_t v : f) ++begin[v + 1];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<std::uint32_t> next(begin.begin(), begin.end() - 1);
  for (std::uint32_t h = 0; h < half_edges.size(); ++h) half_edges[next[faces[h / 3][h % 3]]++] = h;
}

std::vector<std::uint32_t> find_twins(std::span<const Face> faces, std::size_t point_count) {
  const Stars stars(faces, point_count);
  std::vector<std::uint32_t> twins(faces.size() * 3, kNone);
  for (std::uint32_t h = 0; h < twins.size(); ++h) {
    const std::uint32_t u = faces[h / 3][h % 3], v = faces[h / 3][(h + 1) % 3];
    for (const std::uint32_t e : stars.of(v))
      if (faces[e / 3][(e + 1) % 3] == u) twins[h] = e;
  }
  return twins;
}

Rings::Rings(std::span<const Face> faces, std::size_t point_count)
    : twins(find_twins(faces, point_count)), out(point_count, kNone) {
  for (std::uint32_t h = 0; h < twins.size(); ++h) out[faces[h / 3][h % 3]] = h;
}

}  // namespace relief::detail
