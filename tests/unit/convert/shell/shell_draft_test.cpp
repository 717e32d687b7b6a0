#include <relief/convert/shell/shell_draft.h>

#include <gtest/gtest.h>
#include <unit/convert/shell/shell_support.h>

#include <algorithm>
#include <random>
#include <vector>

namespace relief::detail {
namespace {

std::vector<std::uint32_t> codes(std::span<const TriangleReference> list) {
  std::vector<std::uint32_t> all;
  for (const TriangleReference r : list) all.push_back(r.code);
  return all;
}

LinkedDraft linked(const std::vector<Face>& faces, std::size_t points) {
  ShellDraft draft;
  draft.faces = faces;
  draft.ends.resize(points);
  draft.at.resize(points);
  draft.lists.resize(faces.size());
  return LinkedDraft(std::move(draft));
}
LinkedDraft linked(const TriangleMesh& mesh) {
  const LatticeMesh on_lattice(mesh);
  return linked(on_lattice.faces, on_lattice.points.size());
}

/// Twins, half-edges that leave, valences and count against the faces.
void expect_links(const LinkedDraft& draft) {
  std::vector<int> valences(draft.out.size(), 0);
  std::size_t alive = 0;
  for (std::uint32_t h = 0; h < draft.twins.size(); ++h) {
    if (!draft.alive(h / 3)) continue;
    alive += h % 3 == 0;
    ++valences[draft.origin(h)];
    const std::uint32_t twin = draft.twins[h];
    ASSERT_NE(twin, kNone);
    ASSERT_TRUE(draft.alive(twin / 3));
    EXPECT_EQ(draft.twins[twin], h);
    EXPECT_EQ(draft.origin(twin), draft.target(h));
    EXPECT_EQ(draft.target(twin), draft.origin(h));
  }
  EXPECT_EQ(alive, draft.alive_count);
  for (std::uint32_t v = 0; v < draft.out.size(); ++v) {
    EXPECT_EQ(draft.out[v] == kNone, valences[v] == 0);
    if (draft.out[v] == kNone) continue;
    EXPECT_EQ(draft.origin(draft.out[v]), v);
    EXPECT_EQ(draft.valences[v], valences[v]);
    int around = 0;
    draft.for_ring(v, [&](std::uint32_t h) {
      EXPECT_EQ(draft.origin(h), v);
      ++around;
    });
    EXPECT_EQ(around, valences[v]);
  }
}

TEST(TriangleReference, HoldsTrianglesAndClusters) {
  const TriangleReference t = TriangleReference::triangle(77), c = TriangleReference::cluster(5);
  EXPECT_FALSE(t.is_cluster());
  EXPECT_EQ(t.first(), 77U);
  EXPECT_TRUE(c.is_cluster());
  EXPECT_EQ(c.first(), 5 * kClusterSize);
  EXPECT_LT(TriangleReference::triangle(5 * kClusterSize - 1), c);
  EXPECT_LT(c, TriangleReference::triangle(5 * kClusterSize + 1));
}

TEST(ForTriangles, StopsWithTheSourceInItsLastCluster) {
  const LatticeMesh mesh(testing::tetrahedron());
  const SourceIndex source(mesh.points, mesh.faces);
  std::vector<std::uint32_t> seen;
  const std::vector<TriangleReference> all = {TriangleReference::cluster(0)};
  for_triangles(source, all, [&](std::uint32_t t) { seen.push_back(t); });
  EXPECT_EQ(seen, (std::vector<std::uint32_t>{0, 1, 2, 3}));
}

TEST(ReferenceLists, HoldWhatWasPutInThroughReplacingAndPacking) {
  std::mt19937 random(5);
  ReferenceLists lists;
  std::vector<std::vector<std::uint32_t>> expected(300);
  lists.resize(expected.size());
  std::size_t packed = 0, most = 0;
  for (int step = 0; step < 20000; ++step) {
    const auto slab = static_cast<std::uint32_t>(random() % expected.size());
    if (random() % 8 == 0) {
      lists.clear(slab);
      expected[slab].clear();
    } else {
      std::vector<TriangleReference> list(random() % 40);
      expected[slab].clear();
      for (TriangleReference& r : list) {
        r = TriangleReference::triangle(static_cast<std::uint32_t>(random() % 1000000));
        expected[slab].push_back(r.code);
      }
      lists.replace(slab, list);
    }
    const std::size_t before = lists.pool_size();
    lists.pack_if_stale();
    packed += lists.pool_size() < before;
    most = std::max(most, lists.pool_size());
    if (step % 500 != 0) continue;
    for (std::uint32_t k = 0; k < expected.size(); ++k) ASSERT_EQ(codes(lists.of(k)), expected[k]);
  }
  EXPECT_GT(packed, 2U) << "the pool was never packed";
  EXPECT_LT(most, 100000U) << "stale lists stay";
  lists.append(std::vector<TriangleReference>{TriangleReference::triangle(9)});
  EXPECT_EQ(codes(lists.of(300)), (std::vector<std::uint32_t>{18}));
  EXPECT_EQ(lists.size(), 301U);
}

TEST(LinkedDraft, FixesTheFibresOfBoundaryLoops) {
  const LinkedDraft draft = linked(testing::sheet(3));
  for (std::uint32_t v = 0; v < 16; ++v) {
    const bool inside = v == 5 || v == 6 || v == 9 || v == 10;
    EXPECT_EQ(draft.is_free(v), inside) << v;
  }
}

TEST(LinkedDraft, TouchesAFibreAndItsNeighbours) {
  LinkedDraft draft = linked(testing::sheet(4));
  const std::uint32_t middle = 12;
  draft.touch(middle);
  for (std::uint32_t v = 0; v < draft.out.size(); ++v) {
    bool near = v == middle;
    draft.for_ring(middle, [&](std::uint32_t h) { near = near || draft.target(h) == v; });
    EXPECT_EQ(draft.changed[v] > LinkedDraft::kAtFirst, near) << v;
  }
}

// The link condition, judged by what comes of a collapse: a manifold of the same Euler number without points of fewer
// than three faces.
TEST(LinkedDraft, AllowsTheCollapsesThatLeaveAManifold) {
  const std::vector<TriangleMesh> meshes = {testing::tetrahedron(), testing::ball(4), testing::torus(4, 3),
                                            testing::torus(7, 5), testing::box({1, 1, 1})};
  std::mt19937 random(11);
  std::size_t allowed = 0, refused_rightly = 0, refused_by_valence = 0;
  for (const TriangleMesh& mesh : meshes) {
    LinkedDraft draft = linked(mesh);
    const std::ptrdiff_t euler = recount(draft.faces).euler;
    for (int step = 0; step < 60 && draft.alive_count > 4; ++step) {
      std::vector<std::uint32_t> edges, possible;
      for (std::uint32_t h = 0; h < draft.twins.size(); ++h)
        if (draft.is_free_edge(h)) edges.push_back(h);
      for (const std::uint32_t h : edges) {
        LinkedDraft after = draft;
        after.collapse(h);
        const Recount found = recount(after.faces);
        int least = 1000, most = 0;
        for (const std::uint32_t v : {draft.origin(h), draft.target(next_of(h)), draft.target(next_of(draft.twins[h]))})
          least = std::min<int>(least, after.valences[v]), most = std::max<int>(most, after.valences[draft.origin(h)]);
        const bool is_sound = found.is_manifold && found.euler == euler && least >= 3;
        if (draft.link_allows(h)) {
          EXPECT_TRUE(is_sound);
          EXPECT_LE(most, LinkedDraft::kMostValence);
          possible.push_back(h);
          ++allowed;
        } else if (is_sound) {
          EXPECT_GT(most, LinkedDraft::kMostValence) << "a collapse that is possible was refused";
          ++refused_by_valence;
        } else {
          ++refused_rightly;
        }
      }
      if (possible.empty()) break;
      draft.collapse(possible[random() % possible.size()]);
      expect_links(draft);
    }
  }
  EXPECT_GT(allowed, 100U);
  EXPECT_GT(refused_rightly, 100U);
}

TEST(LinkedDraft, StaysLinkedThroughFlips) {
  LinkedDraft draft = linked(testing::torus(8, 6));
  std::mt19937 random(2);
  int flips = 0;
  for (int step = 0; step < 300; ++step) {
    const auto h = static_cast<std::uint32_t>(random() % draft.twins.size());
    const std::uint32_t u = draft.origin(h), v = draft.target(h), a = draft.target(next_of(h)),
                        b = draft.target(next_of(draft.twins[h]));
    if (draft.valences[u] < 4 || draft.valences[v] < 4 || draft.are_joined(a, b)) continue;
    draft.flip(h);
    EXPECT_TRUE(draft.are_joined(a, b));
    EXPECT_FALSE(draft.are_joined(u, v));
    ++flips;
    if (step % 20 == 0) {
      expect_links(draft);
      const Recount found = recount(draft.faces);
      EXPECT_TRUE(found.is_manifold);
      EXPECT_EQ(found.euler, 0);
    }
  }
  EXPECT_GT(flips, 100);
}

TEST(FinestDraft, HasASlabAndAListToFindForEachTriangle) {
  const ThinShell thin(testing::ball(6));
  const ShellDraft draft = thin.draft();
  EXPECT_EQ(draft.faces, thin.source.faces);
  ASSERT_EQ(draft.at.size(), thin.source.points.size());
  double area = 0, trace = 0;
  for (std::uint32_t v = 0; v < draft.at.size(); ++v) {
    EXPECT_EQ(draft.at[v], to_double(thin.source.points[v]));
    EXPECT_LT(draft.quadrics[v].error(draft.at[v]), 1e-9 * draft.quadrics[v].trace() * thin.longest * thin.longest);
    trace += draft.quadrics[v].trace();
  }
  for (std::uint32_t t = 0; t < draft.faces.size(); ++t) {
    EXPECT_EQ(draft.from[t], t);
    area += 0.5 * length(thin.source.cross_of(t));
  }
  EXPECT_NEAR(trace, area, 1e-9 * area) << "a third of each area at each corner";
}

}  // namespace
}  // namespace relief::detail
