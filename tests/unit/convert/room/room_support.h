// Balls for tests of room, and the proof that a model holds.
#pragma once

#include <relief/core/plain_cage.h>
#include <relief/core/query.h>
#include <relief/core/snapshot.h>
#include <relief/verify/verify.h>

#include <gtest/gtest.h>
#include <support/fibre_maps.h>
#include <support/shells.h>

#include <cmath>
#include <memory>

namespace relief {

/// A ball of slabs whose corners lie on a lattice, with its surface at radius 1.
inline std::shared_ptr<const SlabMesh> lattice_ball(int levels, int n) {
  return testing::mapped_shell(*testing::sphere_shell(levels, n, 0.9, 1.1), [](Vec3d p) {
    constexpr double kStep = 1.0 / (1 << 20);
    for (std::size_t k = 0; k < 3; ++k) p[k] = std::round(p[k] / kStep) * kStep;
    return p;
  });
}
inline SnapshotPtr bumpy_ball(int levels = 2, int n = 16) {
  return testing::displaced(lattice_ball(levels, n),
                            [](Vec3d p) { return 0.5 + 0.1 * std::sin(7 * p.x) * std::cos(5 * p.y + p.z); });
}

/// The tiles fit, and the cage passes the verifier.
inline void expect_sound(const Snapshot& model) {
  const Status status = validate(model);
  EXPECT_TRUE(status) << status.error().message;
  const PlainCage cage(model.slab_mesh());
  const verify::Certificate c = verify::check({cage.inner, cage.outer, cage.triangles});
  EXPECT_TRUE(c.all()) << (c.failures.empty() ? "" : c.failures.front().what);
}

}  // namespace relief
