// Shells and shorthands for the tests of dabs and strokes.
#pragma once

#include "support/shells.h"

#include <relief/edit/stroke.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace relief::testing {

/// The mesh, or the end of the test.
inline std::shared_ptr<const SlabMesh> built(Result<SlabMesh> mesh) {
  if (!mesh) throw std::runtime_error(mesh.error().message);
  return std::make_shared<const SlabMesh>(*std::move(mesh));
}

/// A double pyramid over a polygon of k corners: fibres with fans of k slabs (the two tips) and of 4.
inline std::shared_ptr<const SlabMesh> double_pyramid(int k, int n) {
  std::vector<Vec3d> points = {{0, 1, 0}, {0, -1, 0}};
  for (int c = 0; c < k; ++c) {
    const double turn = 2 * std::numbers::pi * c / k;
    points.push_back({std::cos(turn), 0, std::sin(turn)});
  }
  std::vector<Fibre> fibres;
  fibres.reserve(points.size());
  for (const Vec3d p : points) fibres.push_back({p * 0.7, p * 1.3});
  std::vector<SlabMesh::Face> faces;
  for (int c = 0; c < k; ++c) {
    const auto a = static_cast<FibreId>(2 + c), b = static_cast<FibreId>(2 + (c + 1) % k);
    faces.push_back({{0, b, a}, n});
    faces.push_back({{1, a, b}, n});
  }
  return built(SlabMesh::make(std::move(fibres), faces));
}

/// A closed thin plate over [-1,1]^2, y up, bent to y = bend * (x^2 + z^2) (a bowl for bend > 0): slabs 0 ..
/// 2*cells*cells-1 are the upper side, the others the lower; the two share the fibres of the rim. Displacement 0.5 is
/// 0.02 thick.
inline std::shared_ptr<const SlabMesh> thin_plate(int cells, int n, double bend) {
  std::vector<Fibre> fibres;
  std::map<std::array<int, 3>, FibreId> ids;
  const auto id = [&](int x, int z, int side) {
    const bool rim = x == 0 || z == 0 || x == cells || z == cells;
    const auto [at, fresh] = ids.try_emplace({x, z, rim ? 0 : side}, static_cast<FibreId>(fibres.size()));
    if (fresh) {
      const Vec3d flat = {2.0 * x / cells - 1, 0, 2.0 * z / cells - 1};
      const Vec3d middle = flat + Vec3d{0, bend * dot(flat, flat), 0};
      const Vec3d out = rim ? Vec3d{x == 0       ? -1.0
                                    : x == cells ? 1.0
                                                 : 0.0,
                                    0,
                                    z == 0       ? -1.0
                                    : z == cells ? 1.0
                                                 : 0.0}
                            : Vec3d{0, side > 0 ? 1.0 : -1.0, 0};
      fibres.push_back({middle + out * 0.001, middle + out * 0.019});
    }
    return at->second;
  };
  std::vector<SlabMesh::Face> faces;
  for (const int side : {1, -1})
    for (int z = 0; z < cells; ++z)
      for (int x = 0; x < cells; ++x) {
        const FibreId a = id(x, z, side), b = id(x, z + 1, side), c = id(x + 1, z + 1, side), d = id(x + 1, z, side);
        // Cut through the corners of the plate, so that no slab has three fibres of the rim.
        std::vector<std::array<FibreId, 3>> pair = {{a, b, c}, {a, c, d}};
        if ((2 * x < cells) != (2 * z < cells)) pair = {{a, b, d}, {b, c, d}};
        for (const auto& [p, q, r] : pair) faces.push_back({side > 0 ? std::array{p, q, r} : std::array{p, r, q}, n});
      }
  return built(SlabMesh::make(std::move(fibres), faces));
}

/// A dab on the surface near p, with the cursor `depth` below it.
inline Dab dab_near(const Snapshot& model, Vec3d p, double depth, double pressure = 1, double seconds = 0) {
  const SurfacePoint at = closest_point(model, p);
  return {.slab = at.slab,
          .contact = at.position,
          .cursor = at.position - at.normal * depth,
          .normal = at.normal,
          .pressure = pressure,
          .seconds = seconds};
}

/// One stroke of one dab.
inline DabResult apply(Editor& editor, const Brush& brush, const Dab& dab) {
  editor.begin_stroke(brush);
  const DabResult result = editor.dab(dab);
  editor.end_stroke();
  return result;
}

inline ::testing::AssertionResult valid(const Snapshot& model) {
  const Status status = validate(model);
  if (status) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << status.error().message;
}

/// Calls visit(slab, sample index, grid point) for every stored displacement sample.
template <typename Visit>
void for_each_sample(const SlabMesh& mesh, Visit&& visit) {
  for (SlabId s = 0; s < mesh.slab_count(); ++s)
    for (int j = 0; j <= mesh.intervals(s); ++j)
      for (int i = 0; i + j <= mesh.intervals(s); ++i)
        visit(s, sample_index(mesh.intervals(s), {i, j}), GridPoint{i, j});
}

/// The largest spacing of samples anywhere in the cage, at the outer ends.
inline double coarsest_cell(const SlabMesh& mesh) {
  double most = 0;
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    const SlabCorners c = mesh.corners(s);
    for (std::size_t k = 0; k < 3; ++k)
      most = std::max(most, length(c.outer[k] - c.outer[(k + 1) % 3]) / mesh.intervals(s));
  }
  return most;
}

/// Calls visit(tile before, tile after, slab, sample index, position before) for every stored sample of a layer that
/// both models have.
template <typename Visit>
void for_each_pair(const Snapshot& before, const Snapshot& after, Layer layer, Visit&& visit) {
  const SlabMesh& mesh = before.slab_mesh();
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    const Tile &a = before.tile(layer, s), &b = after.tile(layer, s);
    const int n = a.intervals();
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i + j <= n; ++i) {
        const double alpha = displacement_at(before, s, double(i) / n, double(j) / n);
        visit(a, b, s, sample_index(n, {i, j}), sample_position(mesh, s, n, {i, j}, alpha));
      }
  }
}

/// Whether a sample has the same bits in two tiles.
inline bool same_sample(const Tile& a, const Tile& b, std::size_t k) {
  bool same = true;
  for (int c = 0; c < a.channel_count(); ++c) same = same && a.value(c, k) == b.value(c, k);
  return same;
}

/// Gives a layer of m intervals per slab, of one channel, the value field(p), p on the middle surface.
template <typename Field>
SnapshotPtr with_layer(const SnapshotPtr& model, Layer layer, int m, Field&& field) {
  SnapshotDraft draft(model);
  draft.add_layer(layer, m, 0);
  const SlabMesh& mesh = model->slab_mesh();
  for (SlabId s = 0; s < mesh.slab_count(); ++s)
    for (int j = 0; j <= m; ++j)
      for (int i = 0; i + j <= m; ++i)
        draft.edit(layer, s).plane()[sample_index(m, {i, j})] =
            static_cast<float>(field(sample_position(mesh, s, m, {i, j}, 0.5)));
  return draft.finish();
}

/// Mild relief that no symmetry hides.
inline double bumps(Vec3d p) {
  return 0.5 + 0.08 * std::sin(5 * p.x + 1) * std::cos(4 * p.y) + 0.05 * std::sin(7 * p.z + 2 * p.x);
}

}  // namespace relief::testing
