#include <relief/convert/geometry/triangle_contact.h>
#include <relief/convert/skin/face_meetings.h>
#include <relief/convert/support/parallel.h>

#include <algorithm>
#include <iterator>
#include <numeric>

namespace relief::detail {
std::vector<std::uint32_t> order_in_space(std::span<const LatticePoint> points, std::span<const Face> faces) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> keys(faces.size());
  for (std::uint32_t f = 0; f < keys.size(); ++f) keys[f] = {morton_code(points[faces[f][0]]), f};
  std::sort(keys.begin(), keys.end());
  std::vector<std::uint32_t> order(keys.size());
  std::ranges::transform(keys, order.begin(), [](const auto& key) { return key.second; });
  return order;
}

FaceTree::FaceTree(std::span<const LatticePoint> points, std::span<const Face> faces)
    : points_(points),
      faces_(faces),
      order_(order_in_space(points, faces)),
      tree_(faces.size(), [this](std::size_t k) { return box_of(order_[k]); }) {}

Box3d FaceTree::box_of(std::uint32_t f) const noexcept {
  Box3d box;
  for (const std::uint32_t v : faces_[f]) box.add(to_double(points_[v]));
  return box;
}

FacePairs find_meetings(const FaceTree& tree, const Progress& progress) {
  constexpr std::size_t kPiece = 512;  // faces
  const std::span<const std::uint32_t> order = tree.order();
  std::vector<FacePairs> found((order.size() + kPiece - 1) / kPiece);
  for_all(found.size(), 1, progress, [&](std::size_t piece) {
    for (const std::uint32_t f : order.subspan(piece * kPiece, std::min(kPiece, order.size() - piece * kPiece))) {
      const LatticeTriangle t = tree.corners(f);
      const LatticeBox box(t);
      bool known = false;
      tree.query(tree.box_of(f), [&](std::uint32_t g) {
        if (g <= f) return true;
        const LatticeTriangle other = tree.corners(g);
        if (!box.meets(LatticeBox(other)) || !meet_beyond_corners(t, other)) return true;
        if (!known && !has_area(t)) return false;
        known = true;
        if (has_area(other)) found[piece].emplace_back(f, g);
        return true;
      });
    }
  });
  FacePairs pairs;
  for (const FacePairs& some : found) pairs.insert(pairs.end(), some.begin(), some.end());
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

}  // namespace relief::detail
