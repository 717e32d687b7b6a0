// Shells that are right by construction: for tests of everything that stands on core.
#pragma once

#include <relief/core/snapshot.h>

#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <utility>
#include <vector>

namespace relief::testing {

/// A sphere of slabs: a polyhedron with its corners on the unit sphere and triangles counter-clockwise seen from
/// outside, each face cut into 4 `levels` times. Fibres run radially from the inner to the outer radius around
/// `centre`.
inline std::shared_ptr<const SlabMesh> round_shell(std::vector<Vec3d> points, std::vector<std::array<FibreId, 3>> faces,
                                                   int levels, int n, double inner, double outer, Vec3d centre) {
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<FibreId, FibreId>, FibreId> middles;
    const auto middle = [&](FibreId a, FibreId b) {
      const auto [at, fresh] = middles.try_emplace(std::minmax(a, b), static_cast<FibreId>(points.size()));
      if (fresh) points.push_back(normalized(points[a] + points[b]));
      return at->second;
    };
    std::vector<std::array<FibreId, 3>> finer;
    for (const auto& [a, b, c] : faces) {
      const FibreId ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    faces = std::move(finer);
  }
  std::vector<Fibre> fibres;
  fibres.reserve(points.size());
  for (const Vec3d p : points) fibres.push_back({centre + p * inner, centre + p * outer});
  std::vector<SlabMesh::Face> slabs;
  slabs.reserve(faces.size());
  for (const auto& f : faces) slabs.push_back({f, n});
  auto mesh = SlabMesh::make(std::move(fibres), slabs);
  return mesh ? std::make_shared<const SlabMesh>(*std::move(mesh)) : nullptr;
}

/// An octahedron made round: 8 * 4^levels slabs.
inline std::shared_ptr<const SlabMesh> sphere_shell(int levels, int n, double inner = 0.8, double outer = 1.2,
                                                    Vec3d centre = {}) {
  return round_shell({{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}},
                     {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}}, levels,
                     n, inner, outer, centre);
}

/// The same as a hollow: the outer side shows inward, and displacement 0.5 lies 1 from the middle, or as much nearer as
/// the facets are flat.
inline std::shared_ptr<const SlabMesh> hollow_shell(int levels, int n) {
  const auto round = sphere_shell(levels, n, 0.98, 1.02);
  std::vector<Fibre> fibres;
  for (const Fibre& f : round->fibres()) fibres.push_back({f.outer, f.inner});
  std::vector<SlabMesh::Face> slabs;
  for (const Slab& s : round->slabs()) slabs.push_back({{s.fibres[0], s.fibres[2], s.fibres[1]}, n});
  auto mesh = SlabMesh::make(std::move(fibres), slabs);
  return mesh ? std::make_shared<const SlabMesh>(*std::move(mesh)) : nullptr;
}

/// An icosahedron made round: 20 * 4^levels slabs of nearly one size.
inline std::shared_ptr<const SlabMesh> icosphere_shell(int levels, int n, double inner = 0.8, double outer = 1.2) {
  const double g = (1 + std::sqrt(5.0)) / 2;
  std::vector<Vec3d> points = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                               {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  for (Vec3d& p : points) p = normalized(p);
  return round_shell(std::move(points),
                     {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                      {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                      {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}},
                     levels, n, inner, outer, {});
}

/// A flat open sheet of 2 * cells * cells slabs over [0,1]^2, y up: inner at y = -depth, outer at y = +depth;
/// displacement 0.5 is the plane y = 0.
inline std::shared_ptr<const SlabMesh> plane_shell(int cells, int n, double depth = 0.1) {
  std::vector<Fibre> fibres;
  const auto id = [&](int x, int z) { return static_cast<FibreId>(z * (cells + 1) + x); };
  for (int z = 0; z <= cells; ++z)
    for (int x = 0; x <= cells; ++x) {
      const double px = double(x) / cells, pz = double(z) / cells;
      fibres.push_back({{px, -depth, pz}, {px, depth, pz}});
    }
  std::vector<SlabMesh::Face> slabs;
  for (int z = 0; z < cells; ++z)
    for (int x = 0; x < cells; ++x) {
      slabs.push_back({{id(x, z), id(x, z + 1), id(x + 1, z + 1)}, n});
      slabs.push_back({{id(x, z), id(x + 1, z + 1), id(x + 1, z)}, n});
    }
  auto mesh = SlabMesh::make(std::move(fibres), slabs);
  return mesh ? std::make_shared<const SlabMesh>(*std::move(mesh)) : nullptr;
}

/// A ring of slabs with twisted, uneven walls: a torus of 2 * around * across slabs whose fibres are tilted by up to
/// `tilt` radians in a repeating pattern. Every slab is sound for tilt <= 0.3, around >= 8, across >= 6.
inline std::shared_ptr<const SlabMesh> torus_shell(int around, int across, int n, double tilt = 0.2) {
  std::vector<Fibre> fibres;
  const auto id = [&](int a, int b) { return static_cast<FibreId>((a % around) * across + b % across); };
  const double turn = 2 * 3.14159265358979323846;
  for (int a = 0; a < around; ++a)
    for (int b = 0; b < across; ++b) {
      const double p = turn * a / around, q = turn * b / across;
      const Vec3d out = {std::cos(q) * std::cos(p), std::sin(q), std::cos(q) * std::sin(p)};
      const Vec3d along = {-std::sin(p), 0, std::cos(p)};
      const Vec3d about = cross(along, out);
      const double s = tilt * std::sin(3.0 * a + 5.0 * b), r = tilt * std::cos(2.0 * a - 3.0 * b);
      const Vec3d d = normalized(out + along * s + about * r);
      const Vec3d base = Vec3d{std::cos(p), 0, std::sin(p)} * 2.0 + out * 0.8;
      fibres.push_back({base - d * 0.15, base + d * 0.15});
    }
  std::vector<SlabMesh::Face> slabs;
  for (int a = 0; a < around; ++a)
    for (int b = 0; b < across; ++b) {
      slabs.push_back({{id(a, b), id(a + 1, b + 1), id(a + 1, b)}, n});
      slabs.push_back({{id(a, b), id(a, b + 1), id(a + 1, b + 1)}, n});
    }
  auto mesh = SlabMesh::make(std::move(fibres), slabs);
  return mesh ? std::make_shared<const SlabMesh>(*std::move(mesh)) : nullptr;
}

/// The same slabs with every corner moved to map(p).
template <typename Map>
std::shared_ptr<const SlabMesh> mapped_shell(const SlabMesh& like, Map&& map) {
  std::vector<Fibre> fibres;
  for (const Fibre& f : like.fibres()) fibres.push_back({map(f.inner), map(f.outer)});
  std::vector<SlabMesh::Face> slabs;
  for (const Slab& slab : like.slabs()) slabs.push_back({slab.fibres, slab.intervals});
  auto mesh = SlabMesh::make(std::move(fibres), slabs);
  return mesh ? std::make_shared<const SlabMesh>(*std::move(mesh)) : nullptr;
}

/// The same cage with another n in each slab: odd * 2^k with k from 0 to `most`, in no order, so that neighbours differ
/// by up to 2^most.
inline std::shared_ptr<const SlabMesh> mixed_shell(const SlabMesh& like, int odd, int most) {
  std::vector<SlabMesh::Face> slabs;
  std::uint32_t state = 12345;
  for (const Slab& slab : like.slabs()) {
    state = state * 1664525U + 1013904223U;
    slabs.push_back({slab.fibres, odd << static_cast<int>((state >> 16U) % static_cast<unsigned>(most + 1))});
  }
  auto mesh = SlabMesh::make({like.fibres().begin(), like.fibres().end()}, slabs);
  return mesh ? std::make_shared<const SlabMesh>(*std::move(mesh)) : nullptr;
}

/// Gives every sample of a layer with own intervals the value field(p), p being the sample's position at alpha 0.5.
template <typename Field>
void fill(SnapshotDraft& draft, Layer layer, Field&& field) {
  const SlabMesh& mesh = draft.base().slab_mesh();
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    const int n = mesh.intervals(s);
    const SlabCorners corners = mesh.corners(s);
    Tile& tile = draft.edit(layer, s);
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i + j <= n; ++i) {
        const auto w = weights(n, {i, j});
        const std::array<double, 3> b = {double(w[0]) / n, double(w[1]) / n, double(w[2]) / n};
        tile.plane()[sample_index(n, {i, j})] = static_cast<float>(field(corners.point(b, 0.5)));
      }
    constrain(mesh, layer, s, tile);
  }
}

/// A snapshot whose displacement is field(p).
template <typename Field>
SnapshotPtr displaced(std::shared_ptr<const SlabMesh> mesh, Field&& field) {
  SnapshotDraft draft(Snapshot::make(std::move(mesh)));
  fill(draft, Layer::Displacement, field);
  return draft.finish();
}

/// A plane_shell() with a thorn in its middle, `high` of the slabs' depth.
inline SnapshotPtr with_thorn(std::shared_ptr<const SlabMesh> plane, double high) {
  return displaced(std::move(plane), [=](Vec3d p) {
    const double x = p.x - 0.5, z = p.z - 0.5;
    return 0.3 + high * std::exp(-(x * x + z * z) / 0.002);
  });
}

/// The model with a hole where is_void(p).
template <typename Where>
SnapshotPtr with_hole(const SnapshotPtr& model, Where&& is_void) {
  SnapshotDraft draft(model);
  draft.add_layer(Layer::Void, kOwnIntervals, 0);
  fill(draft, Layer::Void, [&](Vec3d p) { return is_void(p) ? 1.0 : 0.0; });
  return draft.finish();
}

}  // namespace relief::testing
