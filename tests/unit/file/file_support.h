// What the tests of the model file share: a folder that goes away, models, strokes.
#pragma once

#include <relief/file/model_file.h>

#include <gtest/gtest.h>
#include <support/shells.h>
#include <unistd.h>

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

/// An empty folder, removed at the end; in memory where there is such a place, so that syncing costs nothing.
class Folder {
 public:
  Folder() {
    std::error_code ignored;
    const std::filesystem::path memory = "/dev/shm";
    const auto place = std::filesystem::is_directory(memory, ignored) && ::access(memory.c_str(), W_OK) == 0
                           ? memory
                           : std::filesystem::temp_directory_path();
    std::string pattern = (place / "relief-XXXXXX").string();
    if (::mkdtemp(pattern.data()) != nullptr) path_ = pattern;
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  [[nodiscard]] std::filesystem::path operator/(const char* name) const { return path_ / name; }
  /// Names of everything in it.
  [[nodiscard]] std::vector<std::string> names() const {
    std::vector<std::string> found;
    for (const auto& entry : std::filesystem::directory_iterator(path_)) found.push_back(entry.path().filename());
    std::sort(found.begin(), found.end());
    return found;
  }

 private:
  std::filesystem::path path_;
};

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
  const int n = draft.tile(layer, slab).intervals();
  std::set<SlabId> written;
  const auto write = [&](const SampleCopy& copy) {
    Tile& tile = draft.edit(layer, copy.slab);
    for (int c = 0; c < tile.channel_count(); ++c)
      tile.set(c, sample_index(tile.intervals(), copy.at), value * static_cast<float>(c + 1) / 4);
    written.insert(copy.slab);
  };
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i + j <= n; ++i)
      if (has_own_intervals(layer))
        mesh.for_each_copy(slab, {i, j}, write);
      else
        mesh.for_each_copy(slab, n, {i, j}, write);
  if (has_own_intervals(layer))
    for (const SlabId s : written) constrain(mesh, layer, s, draft.edit(layer, s));
}

/// The model after stroke `number` of an endless series: each changes a slab and its neighbours.
inline SnapshotPtr stroke(const SnapshotPtr& before, std::uint64_t number) {
  SnapshotDraft draft(before);
  const SlabId count = before->slab_mesh().slab_count();
  dab(draft, Layer::Displacement, static_cast<SlabId>(number * 37 % count), static_cast<float>(number % 97) / 97);
  return draft.finish();
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
