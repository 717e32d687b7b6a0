// Tiles of slabs that were cut: each bit that does not fit across an edge that hangs is found.
#include <relief/core/query.h>
#include <relief/verify/verify.h>

#include <gtest/gtest.h>
#include <support/cuts.h>
#include <support/shells.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

namespace relief::verify {
namespace {

using testing::cut_at_random;
using testing::displaced;
using testing::mixed_shell;
using testing::plane_shell;
using testing::sphere_shell;
using testing::torus_shell;

/// Fibres and faces as plain numbers that a test may change.
struct PlainShell {
  std::vector<std::array<double, 3>> inner, outer;
  std::vector<std::array<std::uint32_t, 3>> faces;

  PlainShell(std::span<const Fibre> fibres, std::span<const Slab> slabs) {
    for (const Fibre& f : fibres) {
      inner.push_back({f.inner.x, f.inner.y, f.inner.z});
      outer.push_back({f.outer.x, f.outer.y, f.outer.z});
    }
    for (const Slab& s : slabs) faces.push_back(s.fibres);
  }
};

/// A model that was cut, and one of its layers.
struct Plain {
  PlainShell roots, pieces;
  std::vector<std::vector<float>> values;
  std::vector<int> intervals;

  Plain(const Snapshot& model, Layer layer)
      : roots(model.slab_mesh().root_fibres(), model.slab_mesh().roots()),
        pieces(model.slab_mesh().fibres(), model.slab_mesh().slabs()) {
    for (SlabId s = 0; s < model.slab_mesh().slab_count(); ++s) {
      const Tile& tile = model.tile(layer, s);
      values.emplace_back(tile.plane(), tile.plane() + tile.size());
      intervals.push_back(tile.intervals());
    }
  }
  [[nodiscard]] TileCheck check(Between between) const {
    std::vector<SampleTile> tiles;
    for (std::size_t s = 0; s < values.size(); ++s) tiles.push_back({intervals[s], values[s]});
    return check_tiles({roots.inner, roots.outer, roots.faces}, {pieces.inner, pieces.outer, pieces.faces}, tiles,
                       between);
  }
  [[nodiscard]] std::string first_fault() const {
    const TileCheck found = check(Between::Linear);
    return found.failures.empty() ? "nothing" : found.failures.front().what;
  }
};

double waves(Vec3d p) { return 0.5 + 0.3 * std::sin(4 * p.x + 3 * p.z) * std::cos(2 * p.y); }

TEST(CutTiles, OfAllKindsHold) {
  for (const auto& shell : {sphere_shell(1, 8), sphere_shell(1, 15), torus_shell(8, 6, 4), plane_shell(3, 6),
                            mixed_shell(*sphere_shell(1, 1), 1, 4), mixed_shell(*torus_shell(8, 6, 1), 3, 3)}) {
    const SnapshotPtr model =
        cut_at_random(testing::with_hole(displaced(shell, waves), [](Vec3d p) { return p.x > 0.3; }), 20);
    EXPECT_EQ(Plain(*model, Layer::Displacement).first_fault(), "nothing");
    EXPECT_EQ(Plain(*model, Layer::Void).check(Between::Nearer).failure_count, 0U);
  }
}

/// Here, too, what is shared counts, and what follows from it; of the rest any value will do.
TEST(CutTiles, EachBitOnAnEdgeCounts) {
  for (const auto& shell : {plane_shell(2, 8), mixed_shell(*plane_shell(2, 1), 1, 4)}) {
    const SnapshotPtr model = cut_at_random(displaced(shell, waves), 4, 2);
    const SlabMesh& mesh = model->slab_mesh();
    ASSERT_TRUE(mesh.is_cut());
    Plain plain(*model, Layer::Displacement);
    for (SlabId s = 0; s < mesh.slab_count(); ++s) {
      const int n = mesh.intervals(s);
      for (int j = 0; j <= n; ++j)
        for (int i = 0; i + j <= n; ++i) {
          int copies = 0;
          mesh.for_each_copy(s, {i, j}, [&](const SampleCopy&) { ++copies; });
          const bool bound = mesh.edge_place(s, {i, j}).constrained();
          float& value = plain.values[s][sample_index(n, {i, j})];
          const float kept = value;
          value = std::nextafter(value, 1.0F);
          EXPECT_EQ(plain.check(Between::Linear).failure_count > 0, copies > 1 || bound) << s << ": " << i << ' ' << j;
          value = kept;
        }
    }
    EXPECT_EQ(plain.first_fault(), "nothing");
  }
}

TEST(CutTiles, PiecesThatDoNotFitAreNamed) {
  testing::RandomCuts cuts(displaced(sphere_shell(1, 8), waves));
  cuts.cut(5);
  const SlabMesh& mesh = cuts.model()->slab_mesh();
  const Plain sound(*cuts.model(), Layer::Displacement);
  EXPECT_EQ(sound.first_fault(), "nothing");
  const HangingEdge* const hangs = mesh.hanging_at(static_cast<FibreId>(mesh.root_fibres().size()));
  ASSERT_NE(hangs, nullptr);
  const auto names = [](Plain plain, SlabId slab, int n, std::string_view what) {
    plain.intervals[slab] = n;
    plain.values[slab].assign(sample_count(n), 0.5F);
    return std::ranges::any_of(plain.check(Between::Linear).failures,
                               [&](const TileFailure& failure) { return failure.what.contains(what); });
  };
  EXPECT_TRUE(names(sound, hangs->slab, 7, "do not fit where one is cut"));
  EXPECT_TRUE(names(sound, hangs->slab, 16, "do not fit where one is cut"));
  EXPECT_FALSE(names(sound, hangs->slab, 4, "do not fit where one is cut"));
  EXPECT_TRUE(names(sound, hangs->across[0], 6, "differ in n by a factor that is not a power of two"));
  Plain torn = sound;
  torn.pieces.outer[hangs->middle][1] += 1e-12;
  EXPECT_NE(torn.first_fault().find("nothing lies across edge"), std::string::npos) << torn.first_fault();
  Plain gap = sound;
  gap.pieces.faces.pop_back();
  gap.values.pop_back();
  gap.intervals.pop_back();
  EXPECT_NE(gap.first_fault().find("nothing lies across edge"), std::string::npos) << gap.first_fault();
}

}  // namespace
}  // namespace relief::verify
