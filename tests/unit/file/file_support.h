// What the tests of the model file share: a folder that goes away, models, strokes.
#pragma once

#include <relief/file/model_file.h>

#include <gtest/gtest.h>
#include <support/cuts.h>
#include <support/folder.h>
#include <support/shells.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace relief::testing {

inline std::string read_file(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}
inline void write_file(const std::filesystem::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

/// A ball with some relief.
inline Model ball(std::shared_ptr<const SlabMesh> shell) {
  Model model;
  model.info = {.mode = Mode::Certified, .unit = Unit::Centimetre, .source = "ball \"1\".ply", .source_diagonal = 2.5};
  model.head = displaced(std::move(shell), [](Vec3d p) {
    return 0.5 + 0.2 * std::round(64 * p.x * p.y + 16 * p.z) / 64;  // sums of few roundings: the same on every machine
  });
  return model;
}
/// 128 slabs in two pages.
inline Model ball(int levels = 2, int n = 6) { return ball(sphere_shell(levels, n)); }

/// Sets all samples of a slab in a layer, together with their copies in its neighbours.
inline void dab(SnapshotDraft& draft, Layer layer, SlabId slab, float value) {
  const SlabMesh& mesh = draft.base().slab_mesh();
  const auto intervals_of = [&](SlabId s) { return draft.tile(layer, s).intervals(); };
  const int n = intervals_of(slab);
  std::set<SlabId> written;
  const auto write = [&](const SampleCopy& copy) {
    Tile& tile = draft.edit(layer, copy.slab);
    for (int c = 0; c < tile.channel_count(); ++c)
      tile.set(c, sample_index(tile.intervals(), copy.at), value * static_cast<float>(c + 1) / 4);
    written.insert(copy.slab);
  };
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i + j <= n; ++i) mesh.for_each_copy(slab, intervals_of, {i, j}, write);
  for (const SlabId s : written) constrain(mesh, layer, s, intervals_of, draft.edit(layer, s));
}

/// The model after stroke `number` of an endless series: each changes a slab and its neighbours.
inline SnapshotPtr stroke(const SnapshotPtr& before, std::uint64_t number) {
  SnapshotDraft draft(before);
  const SlabId count = before->slab_mesh().slab_count();
  dab(draft, Layer::Displacement, static_cast<SlabId>(number * 37 % count), static_cast<float>(number % 97) / 97);
  return draft.finish();
}

/// A slab cut in four, and those before it that must be.
inline SnapshotPtr with_cut(const SnapshotPtr& model, SlabId slab) {
  RandomCuts cuts(model);
  cuts.cut(slab);
  return cuts.model();
}

/// The content hash of the model in a file; 0 and a failure where it does not open.
inline std::uint64_t saved_hash(const std::filesystem::path& file) {
  const auto opened = ModelFile::open(file, true);
  if (opened) return opened->model().head->content_hash();
  ADD_FAILURE() << opened.error().message;
  return 0;
}

}  // namespace relief::testing

/// The value of a Result, or the end of the test with its message.
// NOLINTNEXTLINE(bugprone-macro-parentheses): a declaration has none
#define RELIEF_MUST(declaration, expression)                                         \
  auto must_##declaration = (expression);                                            \
  ASSERT_TRUE(must_##declaration.has_value()) << must_##declaration.error().message; \
  auto& declaration = *must_##declaration

#define EXPECT_OK(expression)                                         \
  do {                                                                \
    const auto& ok_ = (expression);                                   \
    EXPECT_TRUE(ok_.has_value()) << (ok_ ? "" : ok_.error().message); \
  } while (false)
