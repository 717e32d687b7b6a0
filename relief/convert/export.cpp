#include <relief/base/atomic_file.h>
#include <relief/base/steps.h>
#include <relief/base/try.h>
#include <relief/convert/convert.h>
#include <relief/convert/failures.h>
#include <relief/core/tessellate.h>
#include <relief/mesh/export.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>

namespace relief {

namespace {

/// Share of the time of an export that gathers the surface: 0.15 for 3MF, 0.55 for OBJ, 0.8 for PLY (4M triangles).
constexpr double kGathered = 0.6;
/// Diagonals from the origin. So far out a float is off by a millionth of the diagonal, a tenth of what the finest
/// samples lie apart.
constexpr double kFarOut = 20;

bool is_far_out(const Box3d& box) {
  double reach = 0;
  for (const Vec3d corner : {box.low, box.high})
    reach = std::max({reach, std::abs(corner.x), std::abs(corner.y), std::abs(corner.z)});
  return reach > kFarOut * diagonal(box);
}

void turn(TriangleMesh& mesh, SurfaceExport::Up up) {
  if (up == SurfaceExport::Up::AsItLies) return;
  const bool to_z = up == SurfaceExport::Up::Z;
  for (Vec3d& p : mesh.positions) p = to_z ? Vec3d{p.x, -p.z, p.y} : Vec3d{p.x, p.z, -p.y};
}

}  // namespace

TriangleMesh to_mesh(const Snapshot& model, int level, const Progress& progress) {
  Tessellation surface = tessellate(model, level, progress);
  TriangleMesh mesh;
  mesh.positions = std::move(surface.positions);
  mesh.triangles = std::move(surface.triangles);
  const auto byte = [](float v) {
    return static_cast<std::uint8_t>(std::lround(std::clamp(double(v), 0.0, 1.0) * 255));
  };
  mesh.colours.reserve(surface.colours.size());
  for (const Vec3f c : surface.colours) mesh.colours.push_back({byte(c.x), byte(c.y), byte(c.z), 255});
  return mesh;
}

Result<Exported> export_surface(const Snapshot& model, const std::filesystem::path& file, const SurfaceExport& how,
                                const Progress& progress) {
  TriangleMesh mesh = to_mesh(model, how.level, part_of(progress, "export", 0, kGathered));
  if (progress.cancelled()) return detail::not_written(file);
  turn(mesh, how.up);
  const ExportSettings settings = {.unit = how.unit, .double_positions = is_far_out(bounds(mesh))};
  RELIEF_CHECK(export_mesh(mesh, file, settings, part_of(progress, "export", kGathered, 1)));
  return Exported{mesh.positions.size(), mesh.triangles.size()};
}

std::string to_slabs_text(const SlabMesh& mesh) {
  std::array<char, 320> line{};
  std::snprintf(line.data(), line.size(), "relief-slabs 1\nfibres %zu\n", mesh.root_fibres().size());
  std::string text = line.data();
  for (const auto& [in, out] : mesh.root_fibres()) {
    std::snprintf(line.data(), line.size(), "%.17g %.17g %.17g %.17g %.17g %.17g\n", in.x, in.y, in.z, out.x, out.y,
                  out.z);
    text += line.data();
  }
  std::snprintf(line.data(), line.size(), "slabs %zu\n", mesh.roots().size());
  text += line.data();
  const auto neighbour = [](SlabId s) { return s == kNoSlab ? std::int64_t{-1} : std::int64_t{s}; };
  for (const Slab& s : mesh.roots()) {
    std::snprintf(line.data(), line.size(), "%u %u %u %lld %lld %lld %d\n", s.fibres[0], s.fibres[1], s.fibres[2],
                  static_cast<long long>(neighbour(s.neighbours[0])),
                  static_cast<long long>(neighbour(s.neighbours[1])),
                  static_cast<long long>(neighbour(s.neighbours[2])), s.intervals);
    text += line.data();
  }
  return text;
}

Status export_slabs(const SlabMesh& mesh, const std::filesystem::path& file) {
  RELIEF_TRY(AtomicFile target, AtomicFile::create(file));
  RELIEF_CHECK(target.write(to_slabs_text(mesh)));
  return target.commit();
}

}  // namespace relief
