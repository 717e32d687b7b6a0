#include <relief/convert/geometry/components.h>
#include <relief/convert/stage_meshes.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace relief::detail {
namespace {

constexpr Rgba8 kPlain = {200, 200, 196, 255}, kPatch = {236, 152, 52, 255}, kPhantom = {206, 66, 60, 255};

/// Colours that neighbouring numbers do not share: steps of the golden angle around the wheel.
Rgba8 colour_of(std::size_t k) {
  constexpr double kFirstHue = 0.58, kGolden = 0.61803398875;  // of a turn: blue, and from one to the next
  const double hue = 6 * std::fmod(kFirstHue + double(k) * kGolden, 1.0);
  const auto channel = [&](double at) {
    const double away = std::abs(std::remainder(hue - at, 6.0));
    return static_cast<std::uint8_t>(110 + 115 * std::clamp(2 - away, 0.0, 1.0));
  };
  return {channel(0), channel(2), channel(4), 255};
}

/// Each triangle with corners of its own, in its colour.
template <typename Position, typename Colour>
TriangleMesh painted(std::size_t triangles, Position&& position, Colour&& colour) {
  TriangleMesh mesh;
  mesh.positions.reserve(3 * triangles);
  mesh.colours.reserve(3 * triangles);
  mesh.triangles.reserve(triangles);
  for (std::size_t f = 0; f < triangles; ++f) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    const Rgba8 paint = colour(f);
    for (std::size_t k = 0; k < 3; ++k) {
      mesh.positions.push_back(position(f, k));
      mesh.colours.push_back(paint);
    }
    mesh.triangles.push_back({first, first + 1, first + 2});
  }
  return mesh;
}

}  // namespace

void show_components(const StageSink& sink, Stage stage, const TriangleMesh& mesh) {
  if (!sink) return;
  const Components components = find_components(mesh.positions.size(), mesh.triangles);
  sink(stage,
       painted(
           mesh.triangles.size(), [&](std::size_t f, std::size_t k) { return mesh.positions[mesh.triangles[f][k]]; },
           [&](std::size_t f) { return colour_of(components.of_face[f]); }));
}

void show_source(const StageSink& sink, Stage stage, const ClosedSource& source, const Lattice& lattice) {
  if (!sink) return;
  sink(stage, painted(
                  source.faces.size(),
                  [&](std::size_t f, std::size_t k) { return lattice.to_model(source.points[source.faces[f][k]]); },
                  [&](std::size_t f) {
                    return source.phantom[f] != 0 ? kPhantom : source.patch[f] != 0 ? kPatch : kPlain;
                  }));
}

void show_skin(const StageSink& sink, const ClosedSource& source, std::span<const std::uint32_t> part,
               const Lattice& lattice) {
  if (!sink) return;
  sink(Stage::Skin,
       painted(
           source.faces.size(),
           [&](std::size_t f, std::size_t k) { return lattice.to_model(source.points[source.faces[f][k]]); },
           [&](std::size_t f) { return colour_of(part[f]); }));
}

void show_shell(const StageSink& sink, const Shell& shell, const Lattice& lattice) {
  if (!sink) return;
  sink(Stage::Shell,
       painted(
           shell.faces.size(),
           [&](std::size_t f, std::size_t k) { return lattice.to_model(shell.ends[kOuter][shell.faces[f][k]]); },
           [&](std::size_t f) { return colour_of(f); }));
}

}  // namespace relief::detail
