#include <relief/mesh/read/colour_space.h>
#include <relief/mesh/triangle_mesh.h>

#include <algorithm>
#include <cmath>

namespace relief {
namespace {

/// Returns the pixel that stands for place `at` along a side of `size` pixels.
std::size_t wrapped(std::int64_t at, std::uint32_t size, Wrap wrap) noexcept {
  const std::int64_t n = size;
  if (wrap == Wrap::Clamp) return static_cast<std::size_t>(std::clamp<std::int64_t>(at, 0, n - 1));
  const std::int64_t period = wrap == Wrap::Mirror ? 2 * n : n;
  const std::int64_t k = (at % period + period) % period;
  return static_cast<std::size_t>(k < n ? k : period - 1 - k);
}

/// Returns the image at (u, v), 0..255.
Vec3d look_up(const Material& material, double u, double v) noexcept {
  const Image& image = *material.image;
  // Beyond 2^20 repetitions a float has no places within the image.
  const auto sane = [](double x) { return std::abs(x) < 1048576.0 ? x : 0.0; };
  const double x = sane(u) * image.width - 0.5, y = sane(v) * image.height - 0.5;
  const double x0 = std::floor(x), y0 = std::floor(y);
  Vec3d sum;
  for (const int dy : {0, 1}) {
    const std::size_t row = wrapped(static_cast<std::int64_t>(y0) + dy, image.height, material.wrap_v);
    for (const int dx : {0, 1}) {
      const std::size_t column = wrapped(static_cast<std::int64_t>(x0) + dx, image.width, material.wrap_u);
      const Rgba8 c = image.pixels[row * image.width + column];
      const double weight = (dx == 0 ? 1 - (x - x0) : x - x0) * (dy == 0 ? 1 - (y - y0) : y - y0);
      sum += Vec3d{double(c.r), double(c.g), double(c.b)} * weight;
    }
  }
  return sum;
}

constexpr Vec3d kWhite = {1, 1, 1};

/// Returns the product of two colours, in linear light.
Vec3d product(Vec3d a, Vec3d b) noexcept {
  if (a == kWhite) return b;
  if (b == kWhite) return a;
  const auto times = [](double x, double y) {
    return detail::encode_srgb(detail::decode_srgb(x) * detail::decode_srgb(y));
  };
  return {times(a.x, b.x), times(a.y, b.y), times(a.z, b.z)};
}

}  // namespace

Vec3f colour_at(const TriangleMesh& mesh, std::size_t triangle, const std::array<double, 3>& weights) noexcept {
  Vec3d colour = kWhite;
  if (!mesh.colours.empty()) {
    colour = {};
    for (std::size_t k = 0; k < 3; ++k) {
      const Rgba8 c = mesh.colours[mesh.triangles[triangle][k]];
      colour += Vec3d{double(c.r), double(c.g), double(c.b)} * (weights[k] / 255);
    }
  }
  if (!mesh.material_of.empty()) {
    const Material& material = mesh.materials[mesh.material_of[triangle]];
    const Rgba8 c = material.colour;
    colour = product(colour, {c.r / 255.0, c.g / 255.0, c.b / 255.0});
    if (material.image != nullptr && !mesh.uvs.empty()) {
      double u = 0, v = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        u += weights[k] * double(mesh.uvs[triangle][k][0]);
        v += weights[k] * double(mesh.uvs[triangle][k][1]);
      }
      colour = product(colour, look_up(material, u, v) * (1 / 255.0));
    }
  }
  const auto unit = [](double x) { return static_cast<float>(std::clamp(x, 0.0, 1.0)); };
  return {unit(colour.x), unit(colour.y), unit(colour.z)};
}

Box3d bounds(const TriangleMesh& mesh) noexcept {
  Box3d box;
  for (const Vec3d& p : mesh.positions) box.add(p);
  return box;
}

double surface_area(const TriangleMesh& mesh) noexcept {
  double area = 0;
  for (const Triangle& t : mesh.triangles) {
    const Vec3d a = mesh.positions[t[0]];
    area += 0.5 * length(cross(mesh.positions[t[1]] - a, mesh.positions[t[2]] - a));
  }
  return area;
}

double signed_volume(const TriangleMesh& mesh) noexcept {
  const Box3d box = bounds(mesh);
  if (box.empty()) return 0.0;
  const Vec3d centre = box.centre();
  double six = 0.0;
  for (const auto& [a, b, c] : mesh.triangles) {
    six += dot(mesh.positions[a] - centre, cross(mesh.positions[b] - centre, mesh.positions[c] - centre));
  }
  return six / 6.0;
}

}  // namespace relief
