#include "support/shells.h"

#include <relief/base/paged_memory.h>
#include <relief/core/query.h>
#include <relief/core/snapshot.h>
#include <relief/core/snapshot_channel.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <limits>
#include <thread>
#include <vector>

namespace relief {
namespace {

using testing::icosphere_shell;
using testing::sphere_shell;

TEST(Snapshot, DraftCopiesOnlyWhatItWrites) {
  const SnapshotPtr first = Snapshot::make(sphere_shell(3, 8));
  const std::uint64_t hash = first->content_hash();
  SnapshotDraft draft(first);
  draft.edit(Layer::Displacement, 100).plane()[3] = 0.25F;
  draft.edit(Layer::Displacement, 100).plane()[4] = 0.75F;
  const SnapshotPtr second = draft.finish();
  EXPECT_EQ(first->content_hash(), hash);
  EXPECT_NE(second->content_hash(), hash);
  EXPECT_EQ(second->displacement(100)[3], 0.25F);
  EXPECT_EQ(second->displacement(100)[4], 0.75F);
  EXPECT_EQ(first->displacement(100)[3], 0.5F);
  int changed = 0;
  for_each_change(*first, *second, [&](Layer layer, SlabId s) {
    EXPECT_EQ(layer, Layer::Displacement);
    EXPECT_EQ(s, 100U);
    ++changed;
  });
  EXPECT_EQ(changed, 1);

  // The draft goes on from what it finished, and what it finished does not change any more.
  draft.edit(Layer::Displacement, 100).plane()[3] = 0.125F;
  const SnapshotPtr third = draft.finish();
  EXPECT_EQ(second->displacement(100)[3], 0.25F);
  EXPECT_EQ(third->displacement(100)[3], 0.125F);
}

TEST(Snapshot, BoundsOfEditedAndPutTilesAreThoseOfTheirSamples) {
  const auto mesh = sphere_shell(2, 16);
  SnapshotDraft draft(Snapshot::make(mesh));
  const auto check = [](const Tile& tile) {
    Tile anew(tile);
    anew.find_bounds();
    ASSERT_TRUE(tile.bounds_known());
    EXPECT_EQ(tile.bounds().range(), anew.bounds().range());
    for (int level = 0; level < anew.bounds().levels(); ++level) {
      const auto a = tile.bounds().between(level, 0, 0), b = anew.bounds().between(level, 0, 0);
      EXPECT_EQ(a.low, b.low);
      EXPECT_EQ(a.high, b.high);
    }
  };
  for (int k = 0; k < 4; ++k) {
    if (k == 1) draft.add_layer(Layer::Void, kOwnIntervals, 0);
    const Layer layer = k < 2 ? Layer::Displacement : Layer::Void;
    draft.edit(layer, 5).plane()[static_cast<std::size_t>(3 + k)] = 0.25F;
    // A tile that was in use before, with the bounds of other samples.
    const auto put = std::make_shared<Tile>(16, 1, 0.125F);
    put->find_bounds();
    std::ranges::copy(std::vector<float>(put->size(), 0.5F), put->plane());
    put->plane()[static_cast<std::size_t>(9 * k)] = 0.75F;
    draft.put(layer, 70, put);
    const SnapshotPtr model = draft.finish();
    for (const SlabId s : {5, 70}) check(model->tile(layer, s));
  }
}

TEST(Snapshot, IsMadeOfTilesThatLieInAMemoryOfTheirOwn) {
  const auto mesh = sphere_shell(2, 5);
  SnapshotPtr model;
  {
    const auto memory = std::make_shared<PagedMemory>(0);
    model = Snapshot::make(mesh, [&](SlabId s) {
      const auto tile = Tile::make(Layer::Displacement, mesh->intervals(s), 0.25F, memory);
      tile->plane()[1] = 0.75F;
      return tile;
    });
    EXPECT_GT(memory->file_bytes(), 0U);
  }
  for (SlabId s = 0; s < mesh->slab_count(); ++s) {
    const Tile& tile = model->tile(Layer::Displacement, s);
    EXPECT_EQ(tile.plane()[0], 0.25F);
    EXPECT_EQ(tile.plane()[1], 0.75F);
    ASSERT_TRUE(tile.bounds_known());
    EXPECT_NEAR(tile.bounds().range()[1], 0.75, 1e-4);
  }
  // The last tile takes its memory with it.
  const TilePtr last = model->shared_tile(Layer::Displacement, 0);
  model.reset();
  EXPECT_EQ(last->plane()[1], 0.75F);
}

TEST(Snapshot, ADraftThatEditsOneTileMakesANodeAndAPage) {
  const SnapshotPtr first = Snapshot::make(icosphere_shell(6, 1));
  ASSERT_EQ(first->slab_mesh().slab_count(), 81'920U);
  SnapshotDraft add(first);
  add.add_layer(Layer::Mask, 1, 0);
  const SnapshotPtr masked = add.finish();
  const PageTable &before = masked->table(Layer::Displacement), &mask = masked->table(Layer::Mask);
  EXPECT_EQ(before.size(), 20U);
  EXPECT_EQ(&before, &first->table(Layer::Displacement)) << "a layer that nobody wrote is copied";

  SnapshotDraft draft(masked);
  for (const SlabId s : {SlabId{0}, SlabId{50'000}, SlabId{81'919}}) {
    const SnapshotPtr from = draft.finish();
    for (int k = 0; k < 3; ++k) draft.edit(Layer::Displacement, s).plane()[0] = 0.25F;
    const SnapshotPtr to = draft.finish();
    const PageTable &a = from->table(Layer::Displacement), &b = to->table(Layer::Displacement);
    int nodes = 0, pages = 0, tiles = 0;
    for (std::size_t n = 0; n < a.size(); ++n) {
      nodes += a[n] != b[n];
      for (SlabId p = 0; p < kPagesPerNode; ++p) {
        pages += a[n]->pages[p] != b[n]->pages[p];
        for (SlabId t = 0; a[n]->pages[p] && t < kTilesPerPage; ++t)
          tiles += a[n]->pages[p]->tiles[t] != b[n]->pages[p]->tiles[t];
      }
    }
    EXPECT_EQ((std::array{nodes, pages, tiles}), (std::array{1, 1, 1})) << s;
    EXPECT_EQ(&to->table(Layer::Mask), &mask);
    std::vector<SlabId> changed;
    for_each_change(*from, *to, [&](Layer, SlabId slab) { changed.push_back(slab); });
    EXPECT_EQ(changed, std::vector{s});
    EXPECT_EQ(to->displacement(s)[0], 0.25F);
    EXPECT_EQ(from->displacement(s)[0], 0.5F);
  }
}

TEST(Snapshot, LayersComeAndAreFound) {
  const SnapshotPtr first = Snapshot::make(sphere_shell(1, 4));
  EXPECT_FALSE(first->has(Layer::Colour));
  SnapshotDraft draft(first);
  draft.add_layer(Layer::Colour, 16, 0.5F);
  draft.edit(Layer::Colour, 3).set(1, 0, 1.0F);
  const SnapshotPtr second = draft.finish();
  ASSERT_TRUE(second->has(Layer::Colour));
  EXPECT_EQ(second->tile(Layer::Colour, 3).value(1, 0), 1.0F);
  EXPECT_NEAR(double{second->tile(Layer::Colour, 4).value(1, 0)}, 0.5, 0.5 / 65535);
  EXPECT_EQ(second->tile(Layer::Colour, 3).intervals(), 16);
  int changed = 0;
  for_each_change(*first, *second, [&](Layer layer, SlabId) { changed += layer == Layer::Colour; });
  EXPECT_EQ(changed, 32);
}

TEST(Tile, OfColourHasSixteenBitsForEachChannel) {
  const auto widest = std::numeric_limits<std::uint16_t>::max();
  for (unsigned k = 0; k <= widest; ++k) {
    const auto sample = static_cast<std::uint16_t>(k);
    ASSERT_EQ(to_u16(from_u16(sample)), sample);
  }
  for (int k = 0; k < 256; ++k) EXPECT_EQ(to_u16(static_cast<float>(k) / 255.0F), 257 * k);
  for (const float value : {-1.0F, std::numeric_limits<float>::quiet_NaN()}) EXPECT_EQ(to_u16(value), 0);
  EXPECT_EQ(to_u16(1e9F), widest);

  Tile tile(Layer::Colour, 5, 0.25F);
  EXPECT_EQ(tile.type(), SampleType::U16);
  EXPECT_EQ(tile.stride(), 32U) << "21 samples, in whole lines of 64 bytes";
  EXPECT_EQ(tile.bytes(), 3U * 64);
  tile.set(2, 20, 0.75F);
  EXPECT_EQ(tile.plane16(2)[20], 49151);
  EXPECT_EQ(tile.plane16(2)[19], 16384);
  EXPECT_EQ(tile.value(2, 20), 49151 / 65535.0F);
  EXPECT_FALSE(tile.same_values(Tile(5, 3, 0.25F)));
  EXPECT_FALSE(tile.same_shape(Tile(5, 3, 0.25F)));
  EXPECT_DEATH((void)tile.plane(), "type_ == kType");
  EXPECT_DEATH((void)Tile(Layer::Mask, 5, 0).plane16(0), "type_ == kType");
}

TEST(Snapshot, LayerNamesGoBothWays) {
  for (int k = 0; k < kLayerCount; ++k) EXPECT_EQ(layer_from_name(name(static_cast<Layer>(k))), static_cast<Layer>(k));
  EXPECT_EQ(layer_from_name("no such layer"), std::nullopt);
}

TEST(Snapshot, ValidateNamesACrackAndABadValue) {
  SnapshotDraft draft(Snapshot::make(sphere_shell(1, 4)));
  draft.edit(Layer::Displacement, 7).plane()[sample_index(4, {2, 0})] = 0.25F;
  const auto crack = validate(*draft.finish());
  ASSERT_FALSE(crack);
  EXPECT_NE(crack.error().message.find("copies of a shared sample differ"), std::string::npos);

  SnapshotDraft other(Snapshot::make(sphere_shell(1, 4)));
  other.edit(Layer::Displacement, 5).plane()[sample_index(4, {1, 1})] = 1.5F;
  const auto outside = validate(*other.finish());
  ASSERT_FALSE(outside);
  EXPECT_NE(outside.error().message.find("slab 5 holds 1.5"), std::string::npos);
  EXPECT_TRUE(validate(*Snapshot::make(sphere_shell(1, 4))));
}

TEST(SnapshotChannel, FreesWhatNobodyPins) {
  SnapshotPtr model = Snapshot::make(sphere_shell(1, 4));
  const std::weak_ptr<const Snapshot> first = model;
  SnapshotChannel channel(model);
  SnapshotDraft draft(model);
  {
    SnapshotChannel::Reader reader = channel.reader();
    EXPECT_EQ(&reader.latest(), model.get());
    draft.edit(Layer::Displacement, 0).plane()[0] = 0.5F;
    model = draft.finish();
    channel.publish(model);
    EXPECT_FALSE(first.expired()) << "pinned by the reader";
    EXPECT_EQ(channel.held(), 2U);
    EXPECT_EQ(&reader.latest(), model.get());
    draft.edit(Layer::Displacement, 0).plane()[0] = 0.5F;
    model = draft.finish();
    channel.publish(model);
    EXPECT_TRUE(first.expired());
  }
  draft.edit(Layer::Displacement, 0).plane()[0] = 0.5F;
  model = draft.finish();
  channel.publish(model);
  EXPECT_EQ(channel.held(), 1U);
}

}  // namespace
}  // namespace relief
