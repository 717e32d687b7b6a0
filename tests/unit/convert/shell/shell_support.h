// Sources on the lattice, their thin shells, and what the verifier says of a draft.
#pragma once

#include <relief/convert/geometry/components.h>
#include <relief/convert/geometry/lattice.h>
#include <relief/convert/geometry/source_index.h>
#include <relief/convert/shell/coarsening.h>
#include <relief/convert/shell/initial_shell.h>
#include <relief/convert/shell/patch.h>
#include <relief/verify/verify.h>

#include <gtest/gtest.h>
#include <unit/convert/shapes.h>

#include <array>
#include <cstdint>
#include <memory>
#include <random>
#include <set>
#include <utility>
#include <vector>

namespace relief::detail {

/// A closed mesh snapped to a lattice around it.
struct LatticeMesh {
  Lattice lattice;
  std::vector<LatticePoint> points;
  std::vector<Face> faces;

  explicit LatticeMesh(const TriangleMesh& mesh) {
    Box3d box;
    for (const Vec3d p : mesh.positions) box.add(p);
    lattice = Lattice::around(box, 0.25 * length(box.extent()));
    for (const Vec3d p : mesh.positions) points.push_back(snap(lattice.to_lattice(p)));
    for (const Triangle& t : mesh.triangles) faces.push_back({t[0], t[1], t[2]});
  }
  [[nodiscard]] double steps(double model_length) const noexcept { return model_length / lattice.step; }
};

/// A source with its thin shell. Asserts that there is one.
struct ThinShell {
  LatticeMesh mesh;
  SourceIndex source;
  double longest;  ///< of a fibre, lattice steps
  std::vector<Ends> ends;
  std::unique_ptr<BoxTree> tree;

  explicit ThinShell(const TriangleMesh& of, double longest_share = 0.1) : mesh(of), source(mesh.points, mesh.faces) {
    Box3d box;
    for (const LatticePoint p : mesh.points) box.add(to_double(p));
    longest = longest_share * length(box.extent());
    const Rings rings(source.faces, source.points.size());
    InitialShell thin(source, rings, longest);
    EXPECT_TRUE(thin.update({}, {}, {}));
    EXPECT_TRUE(thin.faults().empty());
    ends = thin.take_ends();
    tree = thin.take_tree();
  }
  [[nodiscard]] ShellDraft draft() const {
    Components components = find_components(source.points.size(), source.faces);
    if (components.count == 1) components.of_face.clear();
    return finest_draft(source, std::vector<Ends>(ends), std::move(components.of_face));
  }
  /// All fibres free.
  [[nodiscard]] ShellPatch patch() const { return {source, *tree, longest, draft(), everywhere(), {}}; }
};

/// Boxes around the slabs of a thin shell.
inline std::unique_ptr<BoxTree> tree_of_slabs(const ThinShell& thin) {
  const ShellDraft draft = thin.draft();
  return std::make_unique<BoxTree>(draft.faces.size(),
                                   [&](std::size_t f) { return draft.box(static_cast<std::uint32_t>(f)); });
}

/// A thin shell made coarse, down to so many slabs or as far as that goes; without faces and fibres that are gone.
inline ShellDraft coarse(const ThinShell& thin, std::size_t target) {
  Coarsening coarsening(thin.source, *thin.tree, thin.longest, thin.draft(), everywhere(), {});
  EXPECT_TRUE(coarsening.sweep(4 * target, {}));
  EXPECT_TRUE(coarsening.reduce(target, {}));
  const ShellDraft all = std::move(coarsening).take_draft();
  ShellDraft kept;
  std::vector<std::uint32_t> number(all.ends.size(), kNone);
  for (std::uint32_t f = 0; f < all.faces.size(); ++f) {
    if (!all.alive(f)) continue;
    Face face = all.faces[f];
    for (std::uint32_t& v : face) {
      if (number[v] == kNone) {
        number[v] = static_cast<std::uint32_t>(kept.ends.size());
        kept.ends.push_back(all.ends[v]);
        kept.at.push_back(all.at[v]);
        kept.quadrics.push_back(all.quadrics[v]);
      }
      v = number[v];
    }
    kept.faces.push_back(face);
    kept.lists.append(all.lists.of(f));
    if (!all.component.empty()) kept.component.push_back(all.component[f]);
    kept.from.push_back(kNone);
  }
  return kept;
}
/// The same as a patch of free fibres.
inline ShellPatch coarse_patch(const ThinShell& thin, std::size_t target) {
  return {thin.source, *thin.tree, thin.longest, coarse(thin, target), everywhere(), {}};
}

/// What the verifier, which shares no code with the builder, says of a draft over a source.
inline verify::Certificate judge(const ShellDraft& draft, const SourceIndex& source) {
  using Row = std::array<double, 3>;
  const auto row = [](LatticePoint p) { return Row{double(p.x), double(p.y), double(p.z)}; };
  std::vector<Row> inner, outer, positions;
  std::vector<Face> slabs;
  std::vector<std::uint32_t> number(draft.ends.size(), kNone);  // fibres that are gone have none
  for (Face f : draft.faces) {
    if (f[0] == kNone) continue;
    for (std::uint32_t& v : f) {
      if (number[v] == kNone) {
        number[v] = static_cast<std::uint32_t>(inner.size());
        inner.push_back(row(draft.ends[v][kInner]));
        outer.push_back(row(draft.ends[v][kOuter]));
      }
      v = number[v];
    }
    slabs.push_back(f);
  }
  for (const LatticePoint p : source.points) positions.push_back(row(p));
  return verify::check({inner, outer, slabs}, verify::Source{positions, source.faces, std::nullopt});
}

/// All eight conditions.
inline void expect_certified(const ShellDraft& draft, const SourceIndex& source) {
  const verify::Certificate c = judge(draft, source);
  EXPECT_TRUE(c.all()) << (c.failures.empty() ? "" : c.failures.front().what);
}

/// Whether the faces of a draft are a closed, oriented manifold without repeated faces, counted anew: each half-edge
/// once, with its opposite, and one ring around each point. And how many points, edges and faces there are.
struct Recount {
  bool is_manifold = true;
  std::ptrdiff_t euler = 0;
};
inline Recount recount(const std::vector<Face>& faces) {
  Recount result;
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  std::set<std::uint32_t> points;
  std::set<std::set<std::uint32_t>> sets;
  std::ptrdiff_t alive = 0;
  for (const Face& f : faces) {
    if (f[0] == kNone) continue;
    ++alive;
    if (f[0] == f[1] || f[1] == f[2] || f[2] == f[0]) result.is_manifold = false;
    if (!sets.insert({f[0], f[1], f[2]}).second) result.is_manifold = false;
    for (std::size_t k = 0; k < 3; ++k) {
      points.insert(f[k]);
      if (!edges.insert({f[k], f[(k + 1) % 3]}).second) result.is_manifold = false;
    }
  }
  for (const auto& [u, v] : edges)
    if (!edges.contains({v, u})) result.is_manifold = false;
  for (const std::uint32_t v : points) {
    // From any face around v on, by the edges that two of them share, all must be reached.
    std::vector<std::pair<std::uint32_t, std::uint32_t>> link;  // from the next corner to the one after
    for (const Face& f : faces)
      for (std::size_t k = 0; k < 3; ++k)
        if (f[k] == v) link.emplace_back(f[(k + 1) % 3], f[(k + 2) % 3]);
    std::size_t walked = 1;
    for (std::uint32_t at = link[0].second; at != link[0].first && walked <= link.size(); ++walked) {
      std::uint32_t next = kNone;
      for (const auto& [from, to] : link)
        if (from == at) next = to;
      if (next == kNone) break;
      at = next;
    }
    if (walked != link.size()) result.is_manifold = false;
  }
  result.euler = static_cast<std::ptrdiff_t>(points.size()) - static_cast<std::ptrdiff_t>(edges.size()) / 2 + alive;
  return result;
}

/// A closed height field: a box of the given depth whose top is noise of the given height.
inline TriangleMesh noisy_field(int cells, double height, double depth = 0.5, unsigned seed = 3) {
  TriangleMesh mesh;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> noise(-height, height);
  const int across = cells + 1;
  for (int y = 0; y < across; ++y)
    for (int x = 0; x < across; ++x) {
      const bool rim = x == 0 || y == 0 || x == cells || y == cells;
      mesh.positions.push_back({double(x) / cells, double(y) / cells, rim ? 0 : noise(random)});
    }
  const auto id = [&](int x, int y) { return static_cast<std::uint32_t>(y * across + x); };
  for (int y = 0; y < cells; ++y)
    for (int x = 0; x < cells; ++x) {
      mesh.triangles.push_back({id(x, y), id(x + 1, y), id(x + 1, y + 1)});
      mesh.triangles.push_back({id(x, y), id(x + 1, y + 1), id(x, y + 1)});
    }
  // Walls and floor: a fan from the middle of the floor to the rim moved down.
  std::vector<std::uint32_t> rim;
  for (int k = 0; k < cells; ++k) rim.push_back(id(k, 0));
  for (int k = 0; k < cells; ++k) rim.push_back(id(cells, k));
  for (int k = cells; k > 0; --k) rim.push_back(id(k, cells));
  for (int k = cells; k > 0; --k) rim.push_back(id(0, k));
  const auto below = static_cast<std::uint32_t>(mesh.positions.size());
  for (const std::uint32_t v : rim) mesh.positions.push_back(mesh.positions[v] - Vec3d{0, 0, depth});
  const auto middle = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.push_back({0.5, 0.5, -depth});
  for (std::uint32_t k = 0; k < rim.size(); ++k) {
    const std::uint32_t next = (k + 1) % static_cast<std::uint32_t>(rim.size());
    mesh.triangles.push_back({rim[next], rim[k], below + k});
    mesh.triangles.push_back({rim[next], below + k, below + next});
    mesh.triangles.push_back({below + next, below + k, middle});
  }
  return mesh;
}

}  // namespace relief::detail
