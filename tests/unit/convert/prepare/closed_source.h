// Closed meshes as the converter prepares them, and what holds of them afterwards.
#pragma once

#include <relief/convert/geometry/lattice.h>
#include <relief/convert/prepare/closed_source.h>
#include <relief/convert/prepare/prepare.h>
#include <relief/mesh/triangle_mesh.h>
#include <relief/verify/verify.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <vector>

namespace relief::testing {

/// On the lattice of a conversion, all of it scanned.
inline detail::ClosedSource closed_source(const TriangleMesh& mesh) {
  const Box3d box = bounds(mesh);
  const detail::Lattice lattice = detail::Lattice::around(box, 0.1 * length(box.extent()));
  detail::ClosedSource source;
  for (const Vec3d p : mesh.positions) source.points.push_back(detail::snap(lattice.to_lattice(p)));
  source.faces = mesh.triangles;
  source.patch.assign(source.faces.size(), 0);
  source.phantom = source.patch;
  return source;
}

/// Lattice steps.
inline double diagonal_of(const detail::ClosedSource& source) {
  Box3d box;
  for (const detail::LatticePoint p : source.points) box.add(detail::to_double(p));
  return length(box.extent());
}

/// As a conversion has them.
inline detail::PrepareLimits limits_for(const detail::ClosedSource& source) {
  const double diagonal = diagonal_of(source);
  return {.longest = 0.1 * diagonal, .farthest = 2e-3 * diagonal, .apart = 1e-5 * diagonal, .speck = 1e-4 * diagonal};
}

inline detail::Prepared prepared(const detail::ClosedSource& source) {
  return detail::prepare(source, limits_for(source), {});
}

/// Every edge has one face on either side, every face says whether it is a patch, and the shell that stands passes the
/// verifier (C0 to C4).
inline void expect_stands(const detail::Prepared& made) {
  ASSERT_TRUE(made.stand);
  EXPECT_FALSE(made.obstacle);
  const detail::ClosedSource& s = made.source;
  EXPECT_EQ(s.patch.size(), s.faces.size());
  EXPECT_EQ(s.phantom.size(), s.faces.size());
  EXPECT_EQ(std::ranges::count(detail::find_twins(s.faces, s.points.size()), detail::kNone), 0);
  const detail::SourceIndex& source = made.stand->source;
  EXPECT_EQ(source.faces.size(), s.faces.size());
  ASSERT_EQ(made.stand->ends.size(), source.points.size());
  std::array<std::vector<std::array<double, 3>>, 2> places;  // by side
  for (const detail::Ends& ends : made.stand->ends)
    for (std::size_t side = 0; side < 2; ++side) {
      const Vec3d p = detail::to_double(ends[side]);
      places[side].push_back({p.x, p.y, p.z});
    }
  const verify::Certificate shell = verify::check({places[0], places[1], source.faces});
  EXPECT_TRUE(shell.all()) << (shell.failures.empty() ? "" : shell.failures.front().what);
}

}  // namespace relief::testing
