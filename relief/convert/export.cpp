#include <relief/convert/convert.h>
#include <relief/core/tessellate.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>

namespace relief {

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

}  // namespace relief
