#include "view_mesh.h"

#include <relief/core/tessellate.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace relief::demo {

namespace {

constexpr std::size_t kMostVertices = 65'535;
constexpr float kPlain = 0.78F;  ///< sRGB of a model without colours

void put(std::string& to, unsigned value) { to += static_cast<char>(value & 0xffU); }
void put16(std::string& to, unsigned value) {
  put(to, value);
  put(to, value >> 8U);
}
unsigned scaled(double share, double most) {
  return static_cast<unsigned>(std::lround(std::clamp(share, 0.0, 1.0) * most));
}

std::string encoded(const Tessellation& surface, const Box3d& box) {
  std::string places, normals, colours, corners;
  const Vec3d extent = box.extent();
  const auto share = [](double v, double low, double size) { return size > 0 ? (v - low) / size : 0; };
  for (const Vec3d p : surface.positions) {
    put16(places, scaled(share(p.x, box.low.x, extent.x), 65535));
    put16(places, scaled(share(p.y, box.low.y, extent.y), 65535));
    put16(places, scaled(share(p.z, box.low.z, extent.z), 65535));
  }
  for (const Vec3f n : surface.normals)
    for (const float v : {n.x, n.y, n.z}) put(normals, static_cast<unsigned>(std::lround(127 * v)));
  for (std::size_t k = 0; k < surface.positions.size(); ++k) {
    const Vec3f c = surface.colours.empty() ? Vec3f{kPlain, kPlain, kPlain} : surface.colours[k];
    for (const float v : {c.x, c.y, c.z}) put(colours, scaled(v, 255));
  }
  for (const auto& triangle : surface.triangles)
    for (const std::uint32_t v : triangle) put16(corners, v);
  return fmt::format(R"({{"places":"{}","normals":"{}","colours":"{}","corners":"{}"}})", base64(places),
                     base64(normals), base64(colours), base64(corners));
}

}  // namespace

std::string base64(std::string_view bytes) {
  static constexpr std::string_view kAlphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t k = 0; k < bytes.size(); k += 3) {
    std::uint32_t word = 0;
    for (std::size_t i = 0; i < 3; ++i)
      word = (word << 8U) | (k + i < bytes.size() ? static_cast<unsigned char>(bytes[k + i]) : 0U);
    for (std::size_t i = 0; i < 4; ++i) out += k + i <= bytes.size() ? kAlphabet[(word >> (18 - 6 * i)) & 63U] : '=';
  }
  return out;
}

ViewMesh view_mesh(const Snapshot& model, const Box3d& box, std::size_t bytes) {
  for (int level = 0; level < level_count(model.slab_mesh()); ++level) {
    const Tessellation surface = tessellate(model, level);
    if (surface.positions.size() > kMostVertices) continue;
    ViewMesh made{.json = encoded(surface, box), .triangles = surface.triangles.size()};
    if (made.json.size() <= bytes) return made;
  }
  return {};
}

}  // namespace relief::demo
