// Pictures of four colours, and the question which colour a mesh has at a place.
#pragma once

#include "mesh_checks.h"
#include "support/images.h"

#include <relief/mesh/import.h>
#include <relief/mesh/triangle_mesh.h>

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <string_view>

namespace relief::testing {

inline constexpr Rgba8 kRed = {200, 10, 20}, kGreen = {30, 220, 40}, kBlue = {50, 60, 240}, kYellow = {250, 240, 70};

/// Red and green above, blue and yellow below, each a quarter.
inline Image quarters(std::uint32_t size = 64) {
  return image_of(size, size, [&](std::uint32_t x, std::uint32_t y) {
    return y < size / 2 ? (x < size / 2 ? kRed : kGreen) : (x < size / 2 ? kBlue : kYellow);
  });
}

inline void expect_colour(Vec3f colour, Rgba8 wanted, double tolerance = 0.5) {
  EXPECT_NEAR(double(colour.x) * 255, wanted.r, tolerance);
  EXPECT_NEAR(double(colour.y) * 255, wanted.g, tolerance);
  EXPECT_NEAR(double(colour.z) * 255, wanted.b, tolerance);
}

/// The colour of a flat mesh in the plane z = 0 at (x, y).
inline Vec3f colour_of(const TriangleMesh& mesh, double x, double y) {
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3d a = mesh.positions[mesh.triangles[t][0]], b = mesh.positions[mesh.triangles[t][1]],
                c = mesh.positions[mesh.triangles[t][2]], p = {x, y, 0};
    const double all = cross(b - a, c - a).z;
    const std::array<double, 3> w = {cross(b - p, c - p).z / all, cross(c - p, a - p).z / all,
                                     cross(a - p, b - p).z / all};
    if (w[0] >= 0 && w[1] >= 0 && w[2] >= 0) return colour_at(mesh, t, w);
  }
  ADD_FAILURE() << "no triangle at " << x << ", " << y;
  return {};
}

inline TriangleMesh import_of(const TempFolder& folder, std::string_view name, std::string_view bytes) {
  auto mesh = import_mesh(folder.put(name, bytes));
  EXPECT_TRUE(mesh.has_value()) << mesh.error().message;
  return mesh ? *std::move(mesh) : TriangleMesh{};
}

/// The notes of a file, with | between them.
inline std::string notes_of(const TempFolder& folder, std::string_view name, std::string_view bytes) {
  std::string all;
  for (const std::string& note : import_of(folder, name, bytes).notes) all += (all.empty() ? "" : "|") + note;
  return all;
}

/// How many triangles have this colour in their middle, to half a step of a byte.
inline std::size_t triangles_of_colour(const TriangleMesh& mesh, Rgba8 wanted) {
  std::size_t count = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3f c = colour_at(mesh, t, {1.0 / 3, 1.0 / 3, 1.0 / 3}) * 255.0F;
    if (std::abs(c.x - wanted.r) < 0.5F && std::abs(c.y - wanted.g) < 0.5F && std::abs(c.z - wanted.b) < 0.5F) ++count;
  }
  return count;
}

inline void expect_quarters(const TriangleMesh& mesh, double tolerance = 0.5) {
  EXPECT_TRUE(mesh.has_colour());
  expect_colour(colour_of(mesh, 0.2, 0.8), kRed, tolerance);
  expect_colour(colour_of(mesh, 0.8, 0.8), kGreen, tolerance);
  expect_colour(colour_of(mesh, 0.2, 0.2), kBlue, tolerance);
  expect_colour(colour_of(mesh, 0.8, 0.3), kYellow, tolerance);
}

}  // namespace relief::testing
