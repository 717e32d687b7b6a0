#include <relief/convert/remesh/contour_fit.h>
#include <relief/convert/remesh/plane_fit.h>
#include <relief/convert/support/parallel.h>
#include <relief/convert/support/sort_unique.h>

#include <algorithm>
#include <array>
#include <optional>

namespace relief::detail {
namespace {

using Fit = FittedMesh::Fit;

constexpr double kOnSkin = 0.02;   // voxels: so near to the skin must the planes of its faces meet, to be an edge of it
constexpr double kExact = 1e-5;    // voxels from the planes: as good as on them
constexpr double kOutside = 0.25;  // voxels that a place in a face may lie outside its cell
constexpr int kFitRounds = 3;      // each takes half the distance between the planes and where they meet
constexpr int kFoldRounds = 5;

class ContourFit {
 public:
  ContourFit(const DualContour& contour, const HermiteGrid& grid, const Skin& skin, Follow follow)
      : contour_(contour), grid_(grid), skin_(skin), follow_(follow) {}

  [[nodiscard]] FittedMesh run(const Progress& progress) {
    const std::size_t count = contour_.cell_of.size();
    mesh_.positions.resize(count);
    mesh_.normals.resize(count);
    mesh_.fits.resize(count);
    mesh_.pending.assign(count, FittedMesh::kSeekAll);
    mesh_.triangles.resize(2 * contour_.quads.size());
    if (!for_all(count, 128, progress, [&](std::size_t v) { place(static_cast<std::uint32_t>(v)); })) return {};
    for (int round = 0;; ++round) {
      if (!for_all(contour_.quads.size(), 256, progress, [&](std::size_t q) { cut(q); })) return {};
      if (round == kFoldRounds || !unfold(round)) return std::move(mesh_);
    }
  }

 private:
  [[nodiscard]] const GridCrossing& crossing(std::uint32_t k) const noexcept { return grid_.crossings()[k]; }
  [[nodiscard]] Vec3d middle_of(std::uint32_t v) const noexcept {
    Vec3d sum;
    for (const std::uint32_t k : contour_.crossings_of(v)) sum += crossing(k).at();
    return sum / double(contour_.crossings_of(v).size());
  }
  [[nodiscard]] bool is_in_cell(std::uint32_t v, Vec3d p, double outside) const noexcept {
    const Vec3d d = p - place_of(grid_.cells()[contour_.cell_of[v]]);
    return std::min({d.x, d.y, d.z}) >= -outside && std::max({d.x, d.y, d.z}) <= 1 + outside;
  }
  /// Skin that lies within the solid is no place for a vertex.
  [[nodiscard]] bool is_outer(Vec3d at, Vec3d outwards) const noexcept {
    return !grid_.has_buried_skin(at) || skin_.is_outer(at, outwards);
  }
  void set(std::uint32_t v, Vec3d at, Vec3d normal, Fit how) {
    mesh_.positions[v] = at;
    mesh_.normals[v] = to_float(normal);
    mesh_.fits[v] = how;
  }

  void place(std::uint32_t v) {
    const Vec3d middle = middle_of(v);
    Vec3d outwards;
    bool free = false;
    for (const std::uint32_t k : contour_.crossings_of(v)) {
      outwards += to_double(crossing(k).normal);
      free = free || crossing(k).triangle == kNone;
    }
    outwards = normalized(outwards);
    if (free) return set(v, middle, outwards, Fit::Hole);
    if (follow_ == Follow::Middle) return set(v, middle, outwards, Fit::Moved);
    PlaneFit planes(middle);
    for (const std::uint32_t k : contour_.crossings_of(v)) planes.add(to_double(crossing(k).normal), crossing(k).at());
    for (int rank = planes.solve(); rank > 1; --rank)
      if (const auto met = where_planes_meet(v, planes.at(rank), rank, middle); met && is_outer(met->at, outwards))
        return set(v, met->at, met->normal, rank == 2 ? Fit::OnEdge : Fit::OnCorner);
    place_in_face(v, middle, outwards);
  }

  void place_in_face(std::uint32_t v, Vec3d middle, Vec3d outwards) {
    const auto is_good = [&](const Skin::Place& at) {
      return dot(at.normal, outwards) > 0 && is_in_cell(v, at.at, kOutside) && is_outer(at.at, at.normal);
    };
    Skin::Place best = skin_.nearest(middle);
    if (!is_good(best)) {
      best.distance = Box3d::kFar;
      for (const std::uint32_t k : contour_.crossings_of(v))
        if (const Skin::Place other = skin_.nearest_of(crossing(k).triangle, middle);
            other.distance < best.distance && is_good(other))
          best = other;
    }
    if (best.distance == Box3d::kFar) return set(v, middle, outwards, Fit::Moved);
    set(v, best.at, best.normal, Fit::OnFace);
  }

  /// The nearest place in the skin of a crossing that looks another way than where the vertex is, if there is one.
  void place_in_other_face(std::uint32_t v) {
    constexpr double kOther = 0.9;  // cosine of 25 degrees
    const Vec3d middle = middle_of(v), normal = to_double(mesh_.normals[v]);
    Skin::Place best;
    best.distance = Box3d::kFar;
    for (const std::uint32_t k : contour_.crossings_of(v)) {
      if (crossing(k).triangle == kNone || dot(to_double(crossing(k).normal), normal) > kOther) continue;
      if (const Skin::Place other = skin_.nearest_of(crossing(k).triangle, middle);
          other.distance < best.distance && is_in_cell(v, other.at, kOutside) && is_outer(other.at, other.normal))
        best = other;
    }
    if (best.distance < Box3d::kFar) set(v, best.at, best.normal, Fit::OnFace);
  }

  /// Returns the place of an edge or a corner of the skin near to where planes meet. Curved faces are asked for their
  /// planes again, nearer to it.
  [[nodiscard]] std::optional<Skin::Place> where_planes_meet(std::uint32_t v, Vec3d at, int rank, Vec3d middle) const {
    const std::span<const std::uint32_t> around = contour_.crossings_of(v);
    double off = 0;
    for (const std::uint32_t k : around)
      off = std::max(off, std::abs(dot(to_double(crossing(k).normal), at - crossing(k).at())));
    double share = 1;
    for (int round = 0; off > kExact && round < kFitRounds; ++round) {
      if (!is_in_cell(v, at, kOutside)) return std::nullopt;
      share /= 2;
      PlaneFit planes(middle);
      for (const std::uint32_t k : around) {
        const Skin::Place near = skin_.nearest(at + (crossing(k).at() - at) * share);
        planes.add(near.normal, near.at);
      }
      if (planes.solve() < rank) return std::nullopt;
      at = planes.at(rank);
    }
    const Skin::Place place = skin_.nearest(at);
    if (place.distance > kOnSkin || !is_in_cell(v, place.at, 0)) return std::nullopt;
    return place;
  }

  [[nodiscard]] Vec3d cross_of(const Triangle& t) const noexcept {
    const Vec3d a = mesh_.positions[t[0]];
    return cross(mesh_.positions[t[1]] - a, mesh_.positions[t[2]] - a);
  }
  [[nodiscard]] static std::array<Triangle, 2> cut_along(const DualContour::Quad& q, std::size_t k) noexcept {
    return {Triangle{q[k], q[k + 1], q[k + 2]}, Triangle{q[k], q[k + 2], q[(k + 3) % 4]}};
  }

  /// Along the diagonal that lies nearer to the skin; in the plane along that which leaves no fold and no sliver.
  void cut(std::size_t q) {
    constexpr double kNearer = 1e-3;  // voxels
    const DualContour::Quad& quad = contour_.quads[q];
    const bool free = std::ranges::any_of(quad, [&](std::uint32_t v) { return mesh_.fits[v] < Fit::OnFace; });
    std::size_t best = 0;
    const auto off = [&](std::size_t k) {
      return skin_.nearest((mesh_.positions[quad[k]] + mesh_.positions[quad[k + 2]]) / 2.0).distance;
    };
    const double difference = free || is_smooth(quad) ? 0 : off(0) - off(1);
    if (std::abs(difference) > kNearer) {
      best = difference > 0 ? 1 : 0;
    } else {
      const Vec3d outwards = to_double(crossing(static_cast<std::uint32_t>(q)).normal);
      std::array<double, 2> least{};
      for (const std::size_t k : {std::size_t{0}, std::size_t{1}}) {
        const auto halves = cut_along(quad, k);
        least[k] = std::min(dot(cross_of(halves[0]), outwards), dot(cross_of(halves[1]), outwards));
      }
      best = least[1] > least[0] ? 1 : 0;
    }
    const auto halves = cut_along(quad, best);
    mesh_.triangles[2 * q] = halves[0];
    mesh_.triangles[2 * q + 1] = halves[1];
  }

  /// Returns whether all corners of a quadrilateral lie in faces of the skin that look nearly the same way.
  [[nodiscard]] bool is_smooth(const DualContour::Quad& quad) const noexcept {
    constexpr double kSmooth = 0.985;  // cosine of ten degrees
    return std::ranges::all_of(quad, [&](std::uint32_t v) {
      return mesh_.fits[v] == Fit::OnFace && double(dot(mesh_.normals[v], mesh_.normals[quad[0]])) > kSmooth;
    });
  }
  /// Returns whether a triangle looks into the solid: against the skin, where it lies on that, else against all normals
  /// near it.
  [[nodiscard]] bool is_folded(std::size_t t) const {
    constexpr double kLeast = 1e-6;  // square voxels
    const Triangle& corners = mesh_.triangles[t];
    const Vec3d normal = cross_of(corners);
    if (!is_smooth(contour_.quads[t / 2])) {
      const Vec3d middle =
          (mesh_.positions[corners[0]] + mesh_.positions[corners[1]] + mesh_.positions[corners[2]]) / 3.0;
      if (const Skin::Place near = skin_.nearest(middle); near.distance < kOnSkin)
        return dot(normal, near.normal) < kLeast;
    }
    double best = dot(normal, to_double(grid_.crossings()[t / 2].normal));
    for (const std::uint32_t v : corners) best = std::max(best, dot(normal, to_double(mesh_.normals[v])));
    return best < kLeast;
  }

  /// Moves the corners of folded triangles off edges and corners of the skin; then into another of its faces; then
  /// towards the middles of their crossings, in the end all the way. False where none is folded.
  bool unfold(int round) {
    std::vector<std::uint8_t> folded(mesh_.triangles.size(), 0);
    for_all(folded.size(), 512, {}, [&](std::size_t t) { folded[t] = is_folded(t) ? 1 : 0; });
    std::vector<std::uint32_t> moved;
    for (std::size_t t = 0; t < folded.size(); ++t)
      if (folded[t] != 0) moved.insert(moved.end(), mesh_.triangles[t].begin(), mesh_.triangles[t].end());
    if (moved.empty()) return false;
    sort_unique(moved);
    for (const std::uint32_t v : moved) {
      if (round == 0) {
        if (mesh_.fits[v] > Fit::OnFace) place_in_face(v, middle_of(v), to_double(mesh_.normals[v]));
      } else if (round == 1) {
        place_in_other_face(v);
      } else {
        mesh_.positions[v] += (middle_of(v) - mesh_.positions[v]) * (double(round - 1) / (kFoldRounds - 2));
        mesh_.fits[v] = std::min(mesh_.fits[v], Fit::Moved);
      }
    }
    return true;
  }

  const DualContour& contour_;
  const HermiteGrid& grid_;
  const Skin& skin_;
  Follow follow_;
  FittedMesh mesh_;
};

}  // namespace

FittedMesh fit(const DualContour& contour, const HermiteGrid& grid, const Skin& skin, Follow follow,
               const Progress& progress) {
  return ContourFit(contour, grid, skin, follow).run(progress);
}

}  // namespace relief::detail
