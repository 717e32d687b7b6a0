#include <relief/convert/sample/fibre_sampling.h>
#include <relief/convert/shell/patch.h>
#include <relief/core/slab_mesh.h>
#include <relief/mesh/samples.h>

#include <gtest/gtest.h>
#include <unit/convert/shell/shell_support.h>

#include <algorithm>
#include <array>
#include <map>
#include <vector>

namespace relief::detail {
namespace {

struct Model {
  const char* name;
  TriangleMesh mesh;
};
std::vector<Model> models() {
  return {{"bowl", *make_sample("bowl", 3000)},
          {"torus", testing::torus(30, 18)},
          {"ball", testing::ball(24, 0.1)},
          {"field", noisy_field(16, 0.03)}};
}

Shell shell_of(const ShellDraft& draft) {
  Shell shell;
  shell.faces = draft.faces;
  for (const Ends& e : draft.ends)
    for (const Side side : {kInner, kOuter}) shell.ends[side].push_back(e[side]);
  return shell;
}

/// The fibres of a shell within a share of its diagonal of one of them are free; all others, and the slabs between
/// them, must stay.
std::vector<std::uint8_t> fixed_beyond(const ShellDraft& draft, std::uint32_t centre, double share) {
  Box3d box;
  for (const Vec3d p : draft.at) box.add(p);
  const double reach = share * length(box.extent());
  std::vector<std::uint8_t> fixed;
  for (const Vec3d p : draft.at) fixed.push_back(length(p - draft.at[centre]) > reach);
  return fixed;
}

void expect_rim_stays(const ShellPatch& patch, const Shell& before) {
  std::size_t rim = 0, free = 0;
  for (std::uint32_t v = 0; v < before.ends[kInner].size(); ++v) {
    if (patch.draft().is_free(v)) {
      ++free;
      continue;
    }
    ++rim;
    EXPECT_EQ(patch.draft().ends[v], (Ends{before.ends[kInner][v], before.ends[kOuter][v]}));
  }
  EXPECT_GT(rim, 0U);
  EXPECT_GT(free, 0U);
  EXPECT_EQ(patch.draft().faces, before.faces);
}

TEST(ShellPatch, LengthensInnerFibresAndKeepsItsRim) {
  for (const Model& model : models()) {
    SCOPED_TRACE(model.name);
    const ThinShell thin(model.mesh, 0.2);
    const Shell shell = shell_of(coarse(thin, 100));
    const BoxTree tree = tree_of(thin.source);
    ShellDraft draft = draft_of(shell, thin.source, tree);
    const std::vector<std::uint8_t> fixed = fixed_beyond(draft, 7, 0.3);
    ShellPatch patch(thin.source, tree, thin.longest, std::move(draft), fixed, {});
    EXPECT_TRUE(patch.check().empty());
    std::vector<ShellPatch::Reach> before, wanted;
    for (std::uint32_t v = 0; v < shell.ends[kInner].size(); ++v) {
      before.push_back(patch.reach(v));
      wanted.push_back({0.4 * thin.longest, 0.5 * thin.longest});
    }
    // What has failed is not tried as long as nothing changes around it.
    ShellPatch::FailedSteps all(2 * wanted.size(), patch.draft().clock);
    ASSERT_TRUE(patch.lengthen(wanted, all, {}));
    for (std::uint32_t v = 0; v < wanted.size(); ++v) EXPECT_EQ(patch.reach(v), before[v]);
    ShellPatch::FailedSteps failed;
    ASSERT_TRUE(patch.lengthen(wanted, failed, {}));
    EXPECT_TRUE(patch.check().empty());
    expect_rim_stays(patch, shell);
    expect_certified(patch.draft(), thin.source);
    std::array<double, 2> grown{};
    for (std::uint32_t v = 0; v < wanted.size(); ++v)
      for (const Side side : {kInner, kOuter}) {
        EXPECT_GE(patch.reach(v)[side], before[v][side] - 2);
        EXPECT_LE(patch.reach(v)[side], std::max(before[v][side], wanted[v][side]) + 2);
        grown[side] += patch.reach(v)[side] - before[v][side];
      }
    EXPECT_GT(grown[kInner], 0.2 * thin.longest);
    EXPECT_GT(grown[kOuter], 0.2 * thin.longest);
  }
}

TEST(ShellPatch, ReAimsInnerFibresAndKeepsItsRim) {
  std::size_t turned = 0;
  for (const Model& model : models()) {
    SCOPED_TRACE(model.name);
    const ThinShell thin(model.mesh);
    const Shell shell = shell_of(coarse(thin, 100));
    const BoxTree tree = tree_of(thin.source);
    ShellDraft draft = draft_of(shell, thin.source, tree);
    const std::vector<std::uint8_t> fixed = fixed_beyond(draft, 7, 0.3);
    ShellPatch patch(thin.source, tree, thin.longest, std::move(draft), fixed, {});
    turned += patch.re_aim({});
    EXPECT_TRUE(patch.check().empty());
    expect_rim_stays(patch, shell);
    expect_certified(patch.draft(), thin.source);
  }
  EXPECT_GT(turned, 3U);
}

TEST(ShellPatch, FindsTheStarsThatFail) {
  const ThinShell thin(testing::ball(24, 0.1));
  Shell shell = shell_of(coarse(thin, 100));
  const BoxTree tree = tree_of(thin.source);
  const std::uint32_t spoilt = 11;
  // The outer end through the surface and out at the inner side.
  const LatticePoint in = shell.ends[kInner][spoilt];
  shell.ends[kOuter][spoilt] = in + LatticePoint{1, 1, 1};
  const std::vector<std::uint8_t> none(shell.ends[kInner].size(), 0);
  ShellPatch patch(thin.source, tree, thin.longest, draft_of(shell, thin.source, tree), none, {});
  const std::vector<ShellPatch::FibreFault> faults = patch.check();
  // The fibre and its neighbours, whose stars hold its slabs.
  std::vector<std::uint32_t> expected = {spoilt};
  patch.draft().for_ring(spoilt, [&](std::uint32_t h) { expected.push_back(patch.draft().target(h)); });
  std::ranges::sort(expected);
  std::vector<std::uint32_t> found;
  for (const auto& [fibre, fault] : faults) found.push_back(fibre);
  for (const std::uint32_t v : expected) EXPECT_TRUE(std::ranges::binary_search(found, v)) << v;
  EXPECT_LT(found.size(), 3 * expected.size());
}

/// The displaced surface of slabs with a dent around one fibre: the same places on the fibres of both sides of a wall.
TriangleMesh displaced(const ShellDraft& draft, const LatticeMesh& on, Vec3d dent, double radius, double depth) {
  constexpr int kIntervals = 6;
  TriangleMesh mesh;
  std::map<std::array<std::int32_t, 3>, std::uint32_t> known;
  for (const Face& f : draft.faces) {
    std::array<std::uint32_t, 3> order = {0, 1, 2};
    std::ranges::sort(order, {}, [&](std::uint32_t k) { return f[k]; });
    std::map<std::pair<int, int>, std::uint32_t> ids;
    for (int j = 0; j <= kIntervals; ++j)
      for (int i = 0; i + j <= kIntervals; ++i) {
        const std::array<double, 3> w = {double(kIntervals - i - j) / kIntervals, double(i) / kIntervals,
                                         double(j) / kIntervals};
        Vec3d at, d;
        for (const std::uint32_t k : order) at += draft.at[f[k]] * w[k];
        for (const std::uint32_t k : order) d += draft.fibre(f[k]) * w[k];
        const double away = length(at - dent) / radius;
        const LatticePoint p = snap(at - normalized(d) * (away < 1 ? depth * (1 - away * away) : 0));
        const auto [it, is_new] =
            known.emplace(std::array{p.x, p.y, p.z}, static_cast<std::uint32_t>(mesh.positions.size()));
        if (is_new) mesh.positions.push_back(on.lattice.to_model(p));
        ids[{i, j}] = it->second;
      }
    for (int j = 0; j < kIntervals; ++j)
      for (int i = 0; i + j < kIntervals; ++i) {
        mesh.triangles.push_back({ids[{i, j}], ids[{i + 1, j}], ids[{i, j + 1}]});
        if (i + j < kIntervals - 1) mesh.triangles.push_back({ids[{i + 1, j}], ids[{i + 1, j + 1}], ids[{i, j + 1}]});
      }
  }
  return mesh;
}

SlabMesh mesh_of(const ShellDraft& draft, const Lattice& lattice, int n) {
  std::vector<Fibre> fibres;
  for (const Ends& e : draft.ends) fibres.push_back({lattice.to_model(e[kInner]), lattice.to_model(e[kOuter])});
  std::vector<SlabMesh::Face> faces;
  for (const Face& f : draft.faces) faces.push_back({f, n});
  return *SlabMesh::make(fibres, faces);
}

// What room for clay needs: a dent, fibres around it made longer inwards, and their fan sampled anew.
TEST(ShellPatch, MakesRoomBelowADentInADisplacedSurface) {
  const ThinShell thin(testing::ball(24), 0.2);
  const ShellDraft shell = coarse(thin, 100);
  const std::uint32_t centre = 7;
  const double radius = 0.5 * thin.longest;
  double deepest = Box3d::kFar;
  for (const Ends& e : shell.ends) deepest = std::min(deepest, length(to_double(e[kOuter] - e[kInner])));
  const TriangleMesh dented = displaced(shell, thin.mesh, shell.at[centre], radius, 0.2 * deepest);
  std::vector<LatticePoint> points;
  for (const Vec3d p : dented.positions) points.push_back(snap(thin.mesh.lattice.to_lattice(p)));
  std::vector<Face> faces;
  for (const Triangle& t : dented.triangles) faces.push_back({t[0], t[1], t[2]});
  const SourceIndex source(points, faces);
  const BoxTree tree = tree_of(source);
  ShellDraft draft = draft_of(shell_of(shell), source, tree);
  const Vec3d middle = shell.at[centre];
  EXPECT_GT(length(draft.at[centre] - middle), 0.1 * deepest) << "the place on the fibre follows the dent";
  std::vector<std::uint8_t> fixed = fixed_beyond(draft, centre, 0.25);
  ShellPatch patch(source, tree, thin.longest, std::move(draft), fixed, {});
  ASSERT_TRUE(patch.check().empty());
  std::vector<ShellPatch::Reach> wanted(shell.ends.size(), ShellPatch::Reach{});
  const double before = patch.reach(centre)[kInner];
  wanted[centre][kInner] = before + 0.1 * thin.longest;
  ShellPatch::FailedSteps failed;
  ASSERT_TRUE(patch.lengthen(wanted, failed, {}));
  EXPECT_GT(patch.reach(centre)[kInner], before + 0.05 * thin.longest);
  EXPECT_TRUE(patch.check().empty());
  expect_rim_stays(patch, shell_of(shell));
  expect_certified(patch.draft(), source);

  // The fan's samples lie on the surface, and those on edges that stayed are as they were.
  const SourceRays rays(dented.positions, faces, thin.mesh.lattice);
  const SampleSource sampled = {rays, thin.mesh.lattice, faces.size()};
  constexpr int kIntervals = 8;
  const SlabMesh old_mesh = mesh_of(shell, thin.mesh.lattice, kIntervals);
  const SlabMesh new_mesh = mesh_of(patch.draft(), thin.mesh.lattice, kIntervals);
  std::vector<SlabId> fan;
  for (SlabId s = 0; s < patch.draft().faces.size(); ++s)
    if (std::ranges::count(patch.draft().faces[s], centre) > 0) fan.push_back(s);
  const std::vector<SlabSamples> was = sample_slabs(old_mesh, fan, sampled, {});
  const std::vector<SlabSamples> is = sample_slabs(new_mesh, fan, sampled, {});
  ASSERT_EQ(is.size(), fan.size());
  std::size_t kept = 0, changed = 0;
  for (std::size_t k = 0; k < fan.size(); ++k) {
    const SlabCorners corners = new_mesh.corners(fan[k]);
    const std::size_t moved = static_cast<std::size_t>(std::ranges::find(patch.draft().faces[fan[k]], centre) -
                                                       patch.draft().faces[fan[k]].begin());
    std::size_t at = 0;
    for (int j = 0; j <= kIntervals; ++j)
      for (int i = 0; i + j <= kIntervals; ++i, ++at) {
        ASSERT_EQ(is[k].met[at], Met::Once);
        const std::array<double, 3> w = {double(kIntervals - i - j) / kIntervals, double(i) / kIntervals,
                                         double(j) / kIntervals};
        const Vec3d p = thin.mesh.lattice.to_lattice(corners.point(w, double(is[k].alpha[at])));
        EXPECT_LT(rays.nearest(p).distance, 2);
        if (w[moved] == 0) {
          EXPECT_EQ(is[k].alpha[at], was[k].alpha[at]);
          ++kept;
        } else {
          changed += is[k].alpha[at] != was[k].alpha[at];
        }
      }
  }
  EXPECT_EQ(kept, fan.size() * (kIntervals + 1));
  EXPECT_GT(changed, kept);
}

}  // namespace
}  // namespace relief::detail
