#include "support/shells.h"

#include <relief/core/slab_mesh.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <tuple>
#include <utility>
#include <vector>

namespace relief {
namespace {

using testing::mixed_shell;
using testing::plane_shell;
using testing::sphere_shell;
using testing::torus_shell;

std::vector<Fibre> four_fibres() {
  return {{{0, 0, 0}, {0, 1, 0}}, {{1, 0, 0}, {1, 1, 0}}, {{0, 0, -1}, {0, 1, -1}}, {{1, 0, -1}, {1, 1, -1}}};
}

TEST(SlabMesh, NeighboursAndFansAgree) {
  for (const auto& mesh : {sphere_shell(2, 4), torus_shell(12, 8, 4), plane_shell(5, 4)}) {
    ASSERT_NE(mesh, nullptr);
    std::size_t corners = 0;
    for (FibreId f = 0; f < mesh->fibres().size(); ++f) {
      SlabId before = 0;
      for (const SlabCorner c : mesh->fan(f)) {
        EXPECT_EQ(mesh->slabs()[c.slab].fibres[static_cast<std::size_t>(c.corner)], f);
        EXPECT_GE(c.slab, before);
        before = c.slab;
        ++corners;
      }
    }
    EXPECT_EQ(corners, 3 * mesh->slabs().size());
    for (SlabId s = 0; s < mesh->slab_count(); ++s)
      for (int k = 0; k < 3; ++k) {
        const SlabId other = mesh->slabs()[s].neighbours[static_cast<std::size_t>(k)];
        if (other == kNoSlab) continue;
        const int back = mesh->mirror_edge(s, k);
        EXPECT_EQ(mesh->slabs()[other].neighbours[static_cast<std::size_t>(back)], s);
      }
  }
}

TEST(SlabMesh, CopiesOfASampleAreOnePlace) {
  for (const auto& mesh : {sphere_shell(1, 5), torus_shell(12, 8, 5), plane_shell(3, 5)})
    for (SlabId s = 0; s < mesh->slab_count(); ++s)
      for (int j = 0; j <= 5; ++j)
        for (int i = 0; i + j <= 5; ++i) {
          const auto place = [&](SlabId slab, GridPoint p) {
            const auto w = weights(5, p);
            return mesh->corners(slab).point({w[0] / 5.0, w[1] / 5.0, w[2] / 5.0}, 0.37);
          };
          bool met_itself = false;
          SlabId before = 0;
          mesh->for_each_copy(
              s, [](SlabId) { return 5; }, {i, j},
              [&](const SampleCopy& copy) {
                EXPECT_EQ(place(copy.slab, copy.at), place(s, {i, j})) << "not bit-identical";
                EXPECT_GE(copy.slab, before);
                before = copy.slab;
                met_itself = met_itself || (copy.slab == s && copy.at == GridPoint{i, j});
              });
          EXPECT_TRUE(met_itself);
        }
}

TEST(SlabMesh, CopiesOfASampleAreOnePlaceWhereNDiffers) {
  for (const auto& like : {sphere_shell(1, 1), torus_shell(12, 8, 1), plane_shell(3, 1)}) {
    const auto mesh = mixed_shell(*like, 3, 4);
    std::size_t constrained = 0;
    for (SlabId s = 0; s < mesh->slab_count(); ++s) {
      const int n = mesh->intervals(s);
      for (int edge = 0; edge < 3; ++edge) {
        const SlabId other = mesh->slabs()[s].neighbours[static_cast<std::size_t>(edge)];
        EXPECT_EQ(mesh->edge_intervals(s, edge), other == kNoSlab ? n : std::min(n, mesh->intervals(other)));
      }
      const auto place = [&](SlabId slab, GridPoint p) {
        const double m = mesh->intervals(slab);
        const auto w = weights(mesh->intervals(slab), p);
        return mesh->corners(slab).point({w[0] / m, w[1] / m, w[2] / m}, 0.37);
      };
      for (int j = 0; j <= n; ++j)
        for (int i = 0; i + j <= n; ++i) {
          const GridPoint p = {i, j};
          std::size_t copies = 0;
          bool met_itself = false, all_meet_this = true;
          mesh->for_each_copy(s, p, [&](const SampleCopy& copy) {
            EXPECT_EQ(place(copy.slab, copy.at), place(s, p)) << "not bit-identical";
            ++copies;
            met_itself = met_itself || (copy.slab == s && copy.at == p);
            bool back = false;
            mesh->for_each_copy(copy.slab, copy.at,
                                [&](const SampleCopy& c) { back = back || (c.slab == s && c.at == p); });
            all_meet_this = all_meet_this && back;
          });
          EXPECT_TRUE(met_itself);
          EXPECT_TRUE(all_meet_this);
          const EdgePlace between = mesh->edge_place(s, p);
          if (!between.constrained()) {
            EXPECT_EQ(between.before, p);
            EXPECT_EQ(between.nearer(), p);
            continue;
          }
          ++constrained;
          EXPECT_EQ(copies, 1U);
          EXPECT_FALSE(mesh->edge_place(s, between.before).constrained());
          EXPECT_FALSE(mesh->edge_place(s, between.after).constrained());
          const double f = double(between.k) / between.r;
          const Vec3d chord = place(s, between.before) * (1 - f) + place(s, between.after) * f;
          EXPECT_LT(length(chord - place(s, p)), 0.02 * diagonal(mesh->box(s)));
        }
      mesh->for_each_constrained(s, [&](GridPoint p, const EdgePlace& between) {
        EXPECT_TRUE(mesh->edge_place(s, p).constrained());
        EXPECT_EQ(mesh->edge_place(s, p).before, between.before);
        --constrained;
      });
      EXPECT_EQ(constrained, 0U);
    }
  }
}

TEST(SlabMesh, TreeHoldsEverySlabOnceInsideItsBoxes) {
  const auto mesh = sphere_shell(3, 4);
  std::vector<int> seen(mesh->slabs().size(), 0);
  for (const auto& node : mesh->tree())
    for (std::uint32_t k = 0; k < node.count; ++k) {
      const SlabId s = mesh->tree_roots()[node.first + k];
      ++seen[s];
      EXPECT_TRUE(node.box.contains(mesh->box(s).low) && node.box.contains(mesh->box(s).high));
    }
  for (const int count : seen) EXPECT_EQ(count, 1);
}

TEST(SlabMesh, WithOtherIntervalsItIsAsMadeWithThem) {
  const std::vector<SlabMesh::Face> faces = {{{0, 1, 2}, 4}, {{1, 3, 2}, 8}};
  const std::vector<SlabMesh::Face> coarse = {{{0, 1, 2}, 1}, {{1, 3, 2}, 1}};
  const auto mesh = SlabMesh::make(four_fibres(), coarse), wanted = SlabMesh::make(four_fibres(), faces);
  ASSERT_TRUE(mesh && wanted);
  const auto other = mesh->with_intervals(std::array{4, 8});
  ASSERT_TRUE(other);
  EXPECT_EQ(other->content_hash(), wanted->content_hash());
  EXPECT_EQ(other->edge_intervals(1), (std::array{8, 4, 8}));
  EXPECT_NE(other->number(), mesh->number());
  EXPECT_EQ(other->fibres().data(), mesh->fibres().data());
  EXPECT_EQ(mesh->intervals(1), 1);
  const auto message = [&](int a, int b) {
    const auto made = mesh->with_intervals(std::array{a, b});
    return made ? std::string("accepted") : made.error().message;
  };
  EXPECT_EQ(message(4, 129), "slab 1 has 129 intervals, not 1 to 128");
  EXPECT_EQ(message(4, 12),
            "slab 0 and slab 1 share an edge with 4 and 12 intervals, which do not differ by a power of two");
  EXPECT_EQ(mesh->intervals(1), 1) << "a failure leaves what is kept as it was";

  SlabMesh given = *mesh;
  const Slab* const moved = given.slabs().data();
  const auto taken = std::move(given).with_intervals(std::array{4, 8});
  ASSERT_TRUE(taken);
  EXPECT_EQ(taken->content_hash(), wanted->content_hash());
  EXPECT_EQ(taken->slabs().data(), moved) << "nothing of it is copied";
  EXPECT_NE(taken->number(), mesh->number());
  EXPECT_FALSE(SlabMesh(*mesh).with_intervals(std::array{4, 129}));
}

TEST(SlabMesh, RefusesWhatIsNoCage) {
  using Face = SlabMesh::Face;
  const auto message = [](std::vector<Fibre> fibres, std::vector<Face> faces) {
    const auto made = SlabMesh::make(std::move(fibres), faces);
    return made ? std::string("accepted") : made.error().message;
  };
  const Face up{{0, 1, 2}, 4}, right{{1, 3, 2}, 4};
  EXPECT_EQ(message(four_fibres(), {up, right}), "accepted");
  EXPECT_EQ(message(four_fibres(), {}), "the cage has no slabs");
  EXPECT_EQ(message(four_fibres(), {up, {{1, 3, 7}, 4}}), "slab 1 names a fibre that does not exist");
  EXPECT_EQ(message(four_fibres(), {up, {{1, 3, 3}, 4}}), "slab 1 names a fibre twice");
  EXPECT_EQ(message(four_fibres(), {up, {{3, 1, 2}, 4}}), "slab 0 and slab 1 face opposite ways");
  EXPECT_EQ(message(four_fibres(), {up, {{1, 3, 2}, 129}}), "slab 1 has 129 intervals, not 1 to 128");
  EXPECT_EQ(message(four_fibres(), {up, {{1, 3, 2}, 16}}), "accepted");
  EXPECT_EQ(message(four_fibres(), {up, {{1, 3, 2}, 12}}),
            "slab 0 and slab 1 share an edge with 4 and 12 intervals, which do not differ by a power of two");
  EXPECT_EQ(message(four_fibres(), {up, {{1, 3, 2}, 6}}),
            "slab 0 and slab 1 share an edge with 4 and 6 intervals, which do not differ by a power of two");
  EXPECT_EQ(message(four_fibres(), {up}), "no slab uses fibre 3");
  EXPECT_EQ(message(four_fibres(), {up, right, {{2, 1, 0}, 4}}), "more than two slabs share an edge of slab 0");
  auto bad = four_fibres();
  bad[1].outer.x = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(message(bad, {up, right}), "fibre 1 has no length or is not finite");
  bad = four_fibres();
  bad[2].outer = bad[2].inner;
  EXPECT_EQ(message(bad, {up, right}), "fibre 2 has no length or is not finite");
  // Two slabs that touch in one fibre only.
  auto five = four_fibres();
  five.push_back({{-1, 0, 0}, {-1, 1, 0}});
  five.push_back({{-1, 0, 1}, {-1, 1, 1}});
  EXPECT_EQ(message(five, {up, right, {{0, 4, 5}, 4}}), "the slabs around fibre 0 do not form one fan");
}

TEST(SlabMesh, ASearchThatStopsAtEachSlabFindsWhatOneGoFinds) {
  const auto whole = torus_shell(12, 8, 8);
  std::vector<SlabId> some;
  for (SlabId s = 0; s < whole->slab_count(); s += 3) some.push_back(s);
  const auto once = whole->cut(some);
  ASSERT_TRUE(once);
  const auto mesh = once->cut(some);
  ASSERT_TRUE(mesh);
  for (const Vec3d from : {Vec3d{3, 0, 0}, Vec3d{0, 0.9, 2}, Vec3d{}}) {
    const auto distance = [&](const Box3d& box) { return box.distance2(from); };
    double reach = 0;
    std::vector<SlabId> found;
    const auto take = [&](SlabId s) {
      found.push_back(s);
      reach = std::min(reach, distance(mesh->box(s)) + 1);
    };
    reach = 1e9;
    ASSERT_FALSE(mesh->visit_nearest(distance, reach, [&](SlabId s) {
      take(s);
      return false;
    }));
    const std::vector<SlabId> in_one_go = std::exchange(found, {});
    EXPECT_GT(in_one_go.size(), 30U);
    EXPECT_LT(in_one_go.size(), std::size_t{mesh->slab_count()});
    reach = 1e9;
    SlabMesh::Visited at;
    std::size_t stops = 0;
    for (bool stopped = true; stopped; ++stops) {
      bool more = true;
      stopped = mesh->visit_nearest(
          distance, reach,
          [&](SlabId s) {
            if (!std::exchange(more, false)) return true;
            take(s);
            return false;
          },
          at);
    }
    EXPECT_EQ(found, in_one_go);
    EXPECT_EQ(stops, found.size());
  }
}

}  // namespace
}  // namespace relief
