// Tiles that fit each other pass; each bit that does not fit is found.
#include <relief/core/query.h>
#include <relief/verify/verify.h>

#include <gtest/gtest.h>
#include <support/shells.h>

#include <cmath>
#include <vector>

namespace relief::verify {
namespace {

using testing::displaced;
using testing::mixed_shell;
using testing::plane_shell;
using testing::sphere_shell;
using testing::torus_shell;

/// A model's slabs and one of its layers, as plain numbers that a test may change.
struct Plain {
  std::vector<std::array<double, 3>> inner, outer;
  std::vector<std::array<std::uint32_t, 3>> faces;
  std::vector<std::vector<float>> values;
  std::vector<int> intervals;

  Plain(const Snapshot& model, Layer layer) {
    const SlabMesh& mesh = model.slab_mesh();
    for (const Fibre& f : mesh.fibres()) {
      inner.push_back({f.inner.x, f.inner.y, f.inner.z});
      outer.push_back({f.outer.x, f.outer.y, f.outer.z});
    }
    for (SlabId s = 0; s < mesh.slab_count(); ++s) {
      const Tile& tile = model.tile(layer, s);
      faces.push_back(mesh.slabs()[s].fibres);
      values.emplace_back(tile.plane(), tile.plane() + tile.size());
      intervals.push_back(tile.intervals());
    }
  }
  [[nodiscard]] TileCheck check(Between between, const WasRead& was_read = {}) const {
    std::vector<SampleTile> tiles;
    for (std::size_t s = 0; s < values.size(); ++s) tiles.push_back({intervals[s], values[s]});
    return check_tiles({inner, outer, faces}, tiles, between, was_read);
  }
};

double waves(Vec3d p) { return 0.5 + 0.3 * std::sin(4 * p.x + 3 * p.z) * std::cos(2 * p.y); }

TEST(Tiles, OfOneNAndOfManyHold) {
  for (const auto& shell :
       {sphere_shell(1, 7), torus_shell(12, 8, 4), plane_shell(3, 5), mixed_shell(*sphere_shell(1, 1), 3, 4),
        mixed_shell(*torus_shell(12, 8, 1), 1, 5), mixed_shell(*plane_shell(3, 1), 2, 3)}) {
    const SnapshotPtr model = testing::with_hole(displaced(shell, waves), [](Vec3d p) { return p.x > 0.3; });
    EXPECT_EQ(Plain(*model, Layer::Displacement).check(Between::Linear).failure_count, 0U);
    EXPECT_EQ(Plain(*model, Layer::Void).check(Between::Nearer).failure_count, 0U);
  }
}

TEST(Tiles, EachSlabThatIsReadIsTold) {
  const SnapshotPtr model = displaced(mixed_shell(*torus_shell(12, 8, 1), 1, 5), waves);
  const Plain plain(*model, Layer::Displacement);
  // Once for its size and range, once for its corners, and once with each neighbour.
  std::vector<int> told(plain.faces.size());
  EXPECT_EQ(plain.check(Between::Linear, [&](std::uint32_t s) { ++told[s]; }).failure_count, 0U);
  EXPECT_EQ(told, std::vector<int>(plain.faces.size(), 5));
}

/// A sample counts towards others when it is shared or follows from those that are; of the rest any value will do.
TEST(Tiles, EachBitOnAnEdgeCounts) {
  for (const auto& shell : {plane_shell(2, 4), mixed_shell(*plane_shell(2, 1), 1, 3)}) {
    Plain plain(*displaced(shell, waves), Layer::Displacement);
    for (SlabId s = 0; s < shell->slab_count(); ++s) {
      const int n = shell->intervals(s);
      for (int j = 0; j <= n; ++j)
        for (int i = 0; i + j <= n; ++i) {
          int copies = 0;
          shell->for_each_copy(s, {i, j}, [&](const SampleCopy&) { ++copies; });
          const bool bound = shell->edge_place(s, {i, j}).constrained();
          const std::size_t at = sample_index(n, {i, j});
          float& value = plain.values[s][at];
          const float kept = value;
          value = std::nextafter(value, 1.0F);
          const TileCheck found = plain.check(Between::Linear);
          EXPECT_EQ(found.failure_count > 0, copies > 1 || bound) << s << ": " << i << ' ' << j;
          if (bound) {
            ASSERT_EQ(found.failures.size(), 1U);
            EXPECT_EQ(found.failures[0].slab, s);
            EXPECT_EQ(found.failures[0].sample, at);
            EXPECT_EQ(found.failures[0].what, "sample " + std::to_string(at) + " of slab " + std::to_string(s) +
                                                  " does not follow from those that a coarser slab shares");
          }
          value = kept;
        }
    }
    EXPECT_EQ(plain.check(Between::Linear).failure_count, 0U);
  }
}

TEST(Tiles, WhatIsNoTileIsNamed) {
  const auto shell = mixed_shell(*plane_shell(2, 1), 2, 2);
  const SnapshotPtr model = displaced(shell, waves);
  const auto first = [&](auto&& change) {
    Plain plain(*model, Layer::Displacement);
    change(plain);
    const TileCheck found = plain.check(Between::Linear);
    return found.failures.empty() ? std::string("nothing") : found.failures.front().what;
  };
  EXPECT_EQ(first([](Plain&) {}), "nothing");
  EXPECT_EQ(first([](Plain& p) { p.values[3].pop_back(); }), "the tile of slab 3 has the wrong size");
  EXPECT_EQ(first([](Plain& p) { p.intervals[2] = 0; }), "the tile of slab 2 has the wrong size");
  EXPECT_EQ(first([](Plain& p) { p.values[1][0] = std::nanf(""); }), "sample 0 of slab 1 is not in 0..1");
  EXPECT_EQ(first([](Plain& p) { p.values[1][1] = 1.0001F; }), "sample 1 of slab 1 is not in 0..1");
  Plain flat(*Snapshot::make(shell), Layer::Displacement);
  flat.intervals[1] = 6;
  flat.values[1].assign(sample_count(6), 0.5F);
  ASSERT_FALSE(flat.check(Between::Linear).failures.empty());
  EXPECT_EQ(flat.check(Between::Linear).failures.front().what,
            "slabs 0 and 1 differ in n by a factor that is not a power of two");
  // The two kinds of layer are not taken for each other.
  EXPECT_GT(Plain(*model, Layer::Displacement).check(Between::Nearer).failure_count, 0U);
}

}  // namespace
}  // namespace relief::verify
