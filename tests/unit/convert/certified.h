// What certified mode promises, counted by brute force.
#pragma once

#include "shapes.h"

#include <relief/convert/convert.h>
#include <relief/core/query.h>
#include <relief/verify/verify.h>

#include <gtest/gtest.h>

#include <array>
#include <random>
#include <utility>
#include <vector>

namespace relief::testing {

inline ConvertSettings certified(int slabs, int n = 8) {
  ConvertSettings settings;
  settings.slabs = slabs;
  settings.intervals = n;
  settings.mode = Mode::Certified;
  return settings;
}

/// How often the segment from a to b passes through the mesh: outwards, and inwards.
inline std::pair<int, int> passages(const TriangleMesh& mesh, Vec3d a, Vec3d b) {
  int out = 0, in = 0;
  const Vec3d along = b - a;
  for (const Triangle& t : mesh.triangles) {
    const Vec3d p = mesh.positions[t[0]] - a, q = mesh.positions[t[1]] - a, r = mesh.positions[t[2]] - a;
    const double u = dot(along, cross(p, q)), v = dot(along, cross(q, r)), w = dot(along, cross(r, p));
    const bool front = u > 0 && v > 0 && w > 0, back = u < 0 && v < 0 && w < 0;
    if (!front && !back) continue;
    const Vec3d n = cross(q - p, r - p);
    const double at = dot(n, p) / dot(n, along);
    if (at <= 0 || at >= 1) continue;
    out += dot(n, along) > 0;
    in += dot(n, along) < 0;
  }
  return {out, in};
}

/// Everything that certified mode claims, tested by counting on fibres at random places.
inline void expect_certified(const Result<Conversion>& result, int most_slabs, std::size_t fibres_per_slab = 20) {
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(result->model.info.mode, Mode::Certified);
  const ConvertReport& report = result->report;
  EXPECT_LE(report.slabs, static_cast<std::size_t>(most_slabs));
  EXPECT_EQ(report.hits_single, report.fibres_cast);
  EXPECT_EQ(report.hits_none + report.hits_several, 0U);
  EXPECT_TRUE(report.not_certified.empty()) << report.not_certified;
  const Snapshot& model = *result->model.head;
  EXPECT_TRUE(validate(model));
  const SlabMesh& mesh = model.slab_mesh();
  const verify::Certificate shell = certificate(mesh);
  EXPECT_TRUE(shell.all()) << (shell.failures.empty() ? "" : shell.failures.front().what);
  EXPECT_TRUE(shell.on_lattice);
  const double longest = 0.2 * result->model.info.source_diagonal;
  for (const Fibre& f : mesh.fibres()) EXPECT_LE(length(f.direction()), longest * (1 + 1e-9));
  std::mt19937 random(7);
  std::uniform_real_distribution<double> share(0, 1);
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    const SlabCorners corners = mesh.corners(s);
    for (std::size_t k = 0; k < fibres_per_slab; ++k) {
      double u = share(random), v = share(random);
      if (u + v > 1) u = 1 - u, v = 1 - v;
      const auto [out, in] =
          passages(result->mended, corners.point({1 - u - v, u, v}, 0), corners.point({1 - u - v, u, v}, 1));
      ASSERT_EQ(out, 1) << "slab " << s << " at " << u << ", " << v;
      ASSERT_EQ(in, 0) << "slab " << s << " at " << u << ", " << v;
    }
  }
}

inline std::vector<std::array<double, 3>> places(const TriangleMesh& mesh) {
  std::vector<std::array<double, 3>> all;
  for (const Vec3d p : mesh.positions) all.push_back({p.x, p.y, p.z});
  return all;
}

/// What the verifier says of the source as it was read, before its points were rounded to the lattice.
inline void expect_holds_as_read(const Conversion& made, const TriangleMesh& source) {
  const PlainCage cage(made.model.head->slab_mesh());
  const auto positions = places(source);
  const verify::Certificate c = verify::check({cage.inner, cage.outer, cage.triangles}, {positions, source.triangles});
  EXPECT_TRUE(c.all()) << c.failures.front().what;
}

}  // namespace relief::testing
