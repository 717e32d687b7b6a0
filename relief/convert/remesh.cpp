#include <relief/base/try.h>
#include <relief/convert/decimate.h>
#include <relief/convert/directions.h>
#include <relief/convert/parallel.h>
#include <relief/convert/remesh.h>
#include <relief/convert/shell.h>
#include <relief/convert/sort_unique.h>
#include <relief/convert/winding.h>
#include <relief/mesh/repair.h>

#include <openvdb/openvdb.h>
#include <openvdb/tools/ChangeBackground.h>
#include <openvdb/tools/Composite.h>
#include <openvdb/tools/MeshToVolume.h>
#include <openvdb/tools/SignedFloodFill.h>
#include <openvdb/tools/VolumeToMesh.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_set>

namespace relief::detail {
namespace {

using openvdb::Coord;
using openvdb::FloatGrid;

/// Voxels on the surface: the default goes no further than the first, a given size no further than the second (about
/// 1.5 GiB while it is made).
constexpr double kManyVoxels = 150'000;
constexpr double kMostVoxels = 2'000'000;
constexpr double kCoarsest = 1.0 / 150;  ///< default voxel, share of the diagonal
/// A cell that the surface passes through has its corners within sqrt(3) of it.
constexpr float kBand = 1.8F;
constexpr float kHalfSheet = 1.0F;          ///< half the thickness that a sheet gets
constexpr float kFar = kBand + kHalfSheet;  ///< the value of what is away from any surface
constexpr double kClosedOff = 0.7;          ///< mean winding number just behind the skin of a solid
constexpr double kJustBehind = 0.1;
constexpr std::size_t kCrumb = 60;  ///< triangles of a part that is left out; a ball of two voxels has about as many

/// The source in voxels, from a corner of its box.
struct VoxelMesh {
  std::vector<Vec3d> points;
  std::vector<Triangle> triangles;

  // What OpenVDB asks for.
  // NOLINTBEGIN(readability-identifier-naming): its names
  [[nodiscard]] std::size_t polygonCount() const { return triangles.size(); }
  [[nodiscard]] std::size_t pointCount() const { return points.size(); }
  [[nodiscard]] std::size_t vertexCount(std::size_t /*polygon*/) const { return 3; }
  void getIndexSpacePoint(std::size_t polygon, std::size_t corner, openvdb::Vec3d& position) const {
    const Vec3d p = points[triangles[polygon][corner]];
    position = {p.x, p.y, p.z};
  }
  // NOLINTEND(readability-identifier-naming)
};

/// Lets OpenVDB see that the work was cancelled.
struct Interrupter {
  const Progress& progress;
  void start(const char* /*name*/ = nullptr) {}
  void end() {}
  // NOLINTNEXTLINE(readability-identifier-naming): OpenVDB's name
  bool wasInterrupted(int /*percent*/ = -1) { return progress.cancelled(); }
};

double area_of(const TriangleMesh& mesh) {
  double area = 0;
  for (const auto& [a, b, c] : mesh.triangles)
    area += length(cross(mesh.positions[b] - mesh.positions[a], mesh.positions[c] - mesh.positions[a])) / 2;
  return area;
}

double median_edge(const TriangleMesh& mesh) {
  std::vector<double> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (const Triangle& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) edges.push_back(length(mesh.positions[t[(k + 1) % 3]] - mesh.positions[t[k]]));
  const auto middle = edges.begin() + static_cast<std::ptrdiff_t>(edges.size() / 2);
  std::nth_element(edges.begin(), middle, edges.end());
  return *middle;
}

/// Which parts close nothing off, by part: just behind them, the whole mesh winds around little more than half.
std::vector<std::uint8_t> find_sheets(const VoxelMesh& mesh, const Parts& parts) {
  constexpr std::uint32_t kMost = 64;  // places looked at, of one part
  std::vector<std::uint32_t> size(parts.count, 0), seen(parts.count, 0);
  for (const std::uint32_t part : parts.of_face) ++size[part];
  std::vector<std::uint32_t> chosen;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const std::uint32_t part = parts.of_face[t];
    if (seen[part]++ % ((size[part] + kMost - 1) / kMost) == 0) chosen.push_back(t);
  }
  const WindingNumber winding(mesh.points, mesh.triangles);
  std::vector<double> behind(chosen.size());
  for_all(chosen.size(), 64, {}, [&](std::size_t k) {
    const auto& [a, b, c] = mesh.triangles[chosen[k]];
    const Vec3d p = mesh.points[a], q = mesh.points[b], r = mesh.points[c];
    behind[k] = winding.at((p + q + r) / 3.0 - normalized(cross(q - p, r - p)) * kJustBehind);
  });
  std::vector<double> sum(parts.count, 0), count(parts.count, 0);
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    const std::uint32_t part = parts.of_face[chosen[k]];
    sum[part] += behind[k];
    ++count[part];
  }
  std::vector<std::uint8_t> sheet(parts.count, 0);
  for (std::size_t p = 0; p < sheet.size(); ++p) sheet[p] = sum[p] < kClosedOff * count[p];
  return sheet;
}

/// Distance to the mesh, in voxels, where it is below `reach`.
FloatGrid::Ptr distance_field(const VoxelMesh& mesh, float reach, const Progress& progress) {
  Interrupter interrupter{progress};
  const auto transform = openvdb::math::Transform::createLinearTransform(1.0);
  return openvdb::tools::meshToVolume<FloatGrid>(interrupter, mesh, *transform, reach, reach,
                                                 openvdb::tools::UNSIGNED_DISTANCE_FIELD);
}

/// Corner k = 0..7 of a cell, which is named by its lowest corner; and the cell that a voxel is corner k of.
Coord corner_of(const Coord& cell, unsigned k) noexcept {
  return cell.offsetBy(static_cast<int>(k & 1U), static_cast<int>(k >> 1U & 1U), static_cast<int>(k >> 2U));
}
Coord cell_of(const Coord& voxel, unsigned k) noexcept {
  return voxel.offsetBy(-static_cast<int>(k & 1U), -static_cast<int>(k >> 1U & 1U), -static_cast<int>(k >> 2U));
}

/// Level set of a solid from its skin: the distance to the skin, negative where the mesh winds around more than half.
/// Across holes the surface goes on where the winding number is one half.
class SolidField {
 public:
  SolidField(const VoxelMesh& skin, const Progress& progress) : winding_(skin.points, skin.triangles) {
    grid_ = distance_field(skin, kBand, progress);
    openvdb::tools::changeBackground(grid_->tree(), kFar);
    std::vector<FloatGrid::TreeType::LeafNodeType*> leaves;
    grid_->tree().getNodes(leaves);
    if (!for_all(leaves.size(), 4, progress, [&](std::size_t k) {
          for (auto voxel = leaves[k]->beginValueOn(); voxel; ++voxel)
            if (winding_.at(place(voxel.getCoord())) > 0.5) voxel.setValue(-*voxel);
        }))
      return;
    close_holes(progress);
    openvdb::tools::signedFloodFill(grid_->tree());
  }
  [[nodiscard]] const FloatGrid::Ptr& grid() const noexcept { return grid_; }

 private:
  static Vec3d place(const Coord& c) noexcept { return {double(c.x()), double(c.y()), double(c.z())}; }

  /// Follows the change of sign out of the band, cell by cell, and sets the corners it meets.
  void close_holes(const Progress& progress) {
    auto values = grid_->getAccessor();
    std::unordered_set<Coord, std::hash<Coord>> seen;
    std::vector<Coord> front;
    const auto visit = [&](const Coord& cell) {
      if (seen.insert(cell).second) front.push_back(cell);
    };
    // Cells at the rim of the band: some corners set and of both signs, some not set.
    for (auto voxel = grid_->cbeginValueOn(); voxel; ++voxel) {
      const Coord at = voxel.getCoord();
      const bool inside = *voxel < 0;
      for (unsigned k = 0; k < 8; ++k) {
        const Coord cell = cell_of(at, k);
        bool both = false, open = false;
        for (unsigned c = 0; c < 8; ++c) {
          float value = 0;
          if (!values.probeValue(corner_of(cell, c), value))
            open = true;
          else
            both = both || (value < 0) != inside;
        }
        if (both && open) visit(cell);
      }
    }
    for (std::size_t next = 0; next < front.size(); ++next) {
      if (next % 256 == 0 && progress.cancelled()) return;
      const Coord cell = front[next];
      std::array<bool, 8> inside{};
      for (unsigned c = 0; c < 8; ++c) {
        const Coord at = corner_of(cell, c);
        float value = 0;
        if (!values.probeValue(at, value)) {
          value = static_cast<float>(std::clamp((0.5 - winding_.at(place(at))) * 4, double(-kBand), double(kBand)));
          values.setValueOn(at, value);
        }
        inside[c] = value < 0;
      }
      for (unsigned axis = 0; axis < 3; ++axis)
        for (const unsigned side : {0U, 1U}) {
          bool all = true, none = true;
          for (unsigned c = 0; c < 8; ++c)
            if ((c >> axis & 1U) == side) (inside[c] ? none : all) = false;
          if (all || none) continue;
          Coord beyond = cell;
          beyond[static_cast<int>(axis)] += side == 0 ? -1 : 1;
          visit(beyond);
        }
    }
  }

  WindingNumber winding_;
  FloatGrid::Ptr grid_;
};

/// Fills voxels until the inside and the outside each hang together by faces wherever they touch: then the surface is a
/// manifold, and no two of its sheets meet at an edge or a corner.
void part_sheets(FloatGrid& grid) {
  constexpr float kFilled = -0.25F;
  auto values = grid.getAccessor();
  std::vector<Coord> work;
  for (auto voxel = grid.cbeginValueOn(); voxel; ++voxel) work.push_back(voxel.getCoord());
  while (!work.empty()) {
    const Coord cell = work.back();
    work.pop_back();
    std::array<float, 8> at{};
    unsigned inside = 0;
    for (unsigned c = 0; c < 8; ++c) {
      at[c] = values.getValue(corner_of(cell, c));
      inside |= at[c] < 0 ? 1U << c : 0U;
    }
    if (inside == 0 || inside == 255) continue;
    const auto in = [&](unsigned c) { return (inside >> c & 1U) != 0; };
    // The outside corner to fill: of a face with only its diagonal inside, or of two opposite corners alone.
    unsigned fill = 8;
    const auto consider = [&](unsigned c) {
      if (!in(c) && (fill == 8 || at[c] < at[fill])) fill = c;
    };
    for (unsigned axis = 0; axis < 3; ++axis)
      for (const unsigned side : {0U, 1U}) {
        const unsigned base = side << axis, u = 1U << (axis + 1) % 3, v = 1U << (axis + 2) % 3;
        if (in(base) == in(base | u | v) && in(base | u) == in(base | v) && in(base) != in(base | u))
          for (const unsigned c : {base, base | u, base | v, base | u | v}) consider(c);
      }
    for (unsigned c = 0; c < 4; ++c)
      if (const unsigned pair = 1U << c | 1U << (7 - c); inside == pair || inside == (255U ^ pair))
        for (unsigned k = 0; k < 8; ++k) consider(k);
    if (fill == 8) continue;
    const Coord filled = corner_of(cell, fill);
    values.setValueOn(filled, kFilled);
    for (unsigned c = 0; c < 8; ++c) work.push_back(cell_of(filled, c));
  }
}

/// The zero surface, in model units.
TriangleMesh surface_of(const FloatGrid& grid, double voxel, Vec3d origin) {
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec3I> triangles;
  std::vector<openvdb::Vec4I> quads;
  openvdb::tools::volumeToMesh(grid, points, triangles, quads, 0.0, 0.0);
  TriangleMesh mesh;
  mesh.positions.reserve(points.size());
  for (const openvdb::Vec3s& p : points)
    mesh.positions.push_back(origin + Vec3d{double(p.x()), double(p.y()), double(p.z())} * voxel);
  // OpenVDB's polygons run clockwise.
  for (const openvdb::Vec3I& t : triangles) mesh.triangles.push_back({t[2], t[1], t[0]});
  for (const openvdb::Vec4I& q : quads) {
    const auto length2 = [&](unsigned a, unsigned b) {
      const Vec3d d = mesh.positions[q[static_cast<int>(b)]] - mesh.positions[q[static_cast<int>(a)]];
      return dot(d, d);
    };
    if (length2(0, 2) <= length2(1, 3)) {
      mesh.triangles.push_back({q[2], q[1], q[0]});
      mesh.triangles.push_back({q[3], q[2], q[0]});
    } else {
      mesh.triangles.push_back({q[3], q[1], q[0]});
      mesh.triangles.push_back({q[3], q[2], q[1]});
    }
  }
  return mesh;
}

/// Leaves out parts of so few triangles that they are an accident of the voxels, unless there is nothing else.
std::size_t drop_crumbs(TriangleMesh& mesh) {
  const Parts parts = find_parts(mesh.positions.size(), mesh.triangles);
  std::vector<std::size_t> size(parts.count, 0);
  for (const std::uint32_t part : parts.of_face) ++size[part];
  const auto crumbs = static_cast<std::size_t>(std::ranges::count_if(size, [](std::size_t s) { return s < kCrumb; }));
  if (crumbs == size.size()) return 0;
  std::size_t kept = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (size[parts.of_face[t]] >= kCrumb) mesh.triangles[kept++] = mesh.triangles[t];
  mesh.triangles.resize(kept);
  return crumbs;
}

/// Smooths around vertices that no direction sees all faces of, which the voxels leave in narrow places, until there
/// are none or it has tried long enough.
void open_up(TriangleMesh& mesh) {
  constexpr double kLeast = 0.05;  // visibility
  constexpr int kRounds = 30;
  const auto vertices = static_cast<std::uint32_t>(mesh.positions.size());
  std::vector<std::uint32_t> first(vertices + 1, 0), around(3 * mesh.triangles.size());
  for (const Triangle& t : mesh.triangles)
    for (const std::uint32_t v : t) ++first[v + 1];
  for (std::uint32_t v = 0; v < vertices; ++v) first[v + 1] += first[v];
  std::vector<std::uint32_t> fill(first.begin(), first.end() - 1);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
    for (const std::uint32_t v : mesh.triangles[t]) around[fill[v]++] = t;

  std::vector<Vec3d> normals;
  const auto is_blind = [&](std::uint32_t v) {
    normals.clear();
    for (std::uint32_t k = first[v]; k < first[v + 1]; ++k) {
      const auto& [a, b, c] = mesh.triangles[around[k]];
      normals.push_back(
          normalized(cross(mesh.positions[b] - mesh.positions[a], mesh.positions[c] - mesh.positions[a])));
    }
    return best_direction(normals).visibility < kLeast;
  };
  const auto with_ring = [&](std::vector<std::uint32_t>& list) {
    for (std::size_t k = 0, count = list.size(); k < count; ++k)
      for (std::uint32_t e = first[list[k]]; e < first[list[k] + 1]; ++e)
        for (const std::uint32_t v : mesh.triangles[around[e]]) list.push_back(v);
    sort_unique(list);
  };
  std::vector<std::uint32_t> suspects(vertices);
  for (std::uint32_t v = 0; v < vertices; ++v) suspects[v] = v;
  for (int round = 0; round < kRounds; ++round) {
    std::erase_if(suspects, [&](std::uint32_t v) { return !is_blind(v); });
    if (suspects.empty()) return;
    with_ring(suspects);
    std::vector<Vec3d> moved;
    for (const std::uint32_t v : suspects) {
      Vec3d sum;
      double count = 0;
      for (std::uint32_t e = first[v]; e < first[v + 1]; ++e)
        for (const std::uint32_t other : mesh.triangles[around[e]])
          if (other != v) sum += mesh.positions[other], ++count;
      moved.push_back(mesh.positions[v] * 0.5 + sum * (0.5 / std::max(count, 1.0)));
    }
    for (std::size_t k = 0; k < suspects.size(); ++k) mesh.positions[suspects[k]] = moved[k];
    with_ring(suspects);
  }
}

}  // namespace

Result<Remeshed> remesh(const TriangleMesh& source, double voxel, const Progress& progress) {
  // openvdb::initialize() is for reading and writing files only.
  const auto cancelled = [] { return fail(Errc::Cancelled, "remeshing was cancelled."); };
  const Box3d box = bounds(source);
  const double across = diagonal(box), area = area_of(source);
  const double finest = std::max(across / 4096, std::sqrt(area / kMostVoxels));
  if (voxel == 0) {
    voxel =
        std::max(std::min(median_edge(source), std::max(across * kCoarsest, finest)), std::sqrt(area / kManyVoxels));
  } else if (voxel < finest) {
    return fail(Errc::InvalidArgument, "the voxels to remesh with are too small; this source can take " +
                                           std::to_string(std::ceil(finest / across * 1e6) / 1e6) +
                                           " of its diagonal or more.");
  }
  progress("remesh", 0);
  VoxelMesh skin, sheets;
  skin.points.reserve(source.positions.size());
  for (const Vec3d p : source.positions) skin.points.push_back((p - box.low) / voxel);
  skin.triangles = source.triangles;
  const Parts parts = find_parts(skin.points.size(), skin.triangles);
  const std::vector<std::uint8_t> is_sheet = find_sheets(skin, parts);
  Remeshed result;
  result.voxel = voxel;
  result.sheets = static_cast<std::size_t>(std::ranges::count(is_sheet, std::uint8_t{1}));
  if (result.sheets > 0) {
    sheets.points = skin.points;
    std::size_t kept = 0;
    for (std::size_t t = 0; t < skin.triangles.size(); ++t) {
      if (is_sheet[parts.of_face[t]] != 0)
        sheets.triangles.push_back(skin.triangles[t]);
      else
        skin.triangles[kept++] = skin.triangles[t];
    }
    skin.triangles.resize(kept);
  }
  if (progress.cancelled()) return cancelled();

  progress("remesh", 0.2);
  FloatGrid::Ptr solid = FloatGrid::create(kFar);
  if (!skin.triangles.empty()) solid = SolidField(skin, progress).grid();
  if (progress.cancelled()) return cancelled();
  progress("remesh", 0.6);
  if (!sheets.triangles.empty()) {
    const FloatGrid::Ptr thick = distance_field(sheets, kFar, progress);
    if (progress.cancelled()) return cancelled();
    for (auto value = thick->beginValueOn(); value; ++value) value.setValue(*value - kHalfSheet);
    openvdb::tools::changeBackground(thick->tree(), kFar);
    openvdb::tools::csgUnion(*solid, *thick);
  }
  part_sheets(*solid);
  TriangleMesh made = surface_of(*solid, voxel, box.low);
  solid.reset();
  progress("remesh", 0.8);
  if (progress.cancelled()) return cancelled();
  result.crumbs = drop_crumbs(made);
  if (made.triangles.empty())
    return fail(Errc::Corrupt, "nothing of the source is as large as the voxels that it is remeshed with.");
  RELIEF_TRY(Repaired repaired, repair(made, progress));
  result.mesh = std::move(repaired.mesh);
  open_up(result.mesh);
  result.parts = repaired.report.parts;
  result.rims = repaired.report.boundary_loops;
  result.mesh.unit = source.unit;
  return result;
}

}  // namespace relief::detail
