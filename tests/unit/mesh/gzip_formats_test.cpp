// Files of any format inside gzip.
#include "damage.h"

#include <relief/mesh/export.h>
#include <relief/mesh/import.h>

#include <gtest/gtest.h>
#include <zlib.h>

#include <string>
#include <vector>

namespace relief {
namespace {

using testing::TempFolder;

std::string gzip(std::string_view bytes) {
  constexpr int kWithGzip = 15 + 16, kMemory = 8;
  z_stream stream{};
  EXPECT_EQ(deflateInit2(&stream, Z_BEST_COMPRESSION, Z_DEFLATED, kWithGzip, kMemory, Z_DEFAULT_STRATEGY), Z_OK);
  std::string out(deflateBound(&stream, bytes.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));  // zlib does not write there
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  out.resize(out.size() - stream.avail_out);
  deflateEnd(&stream);
  return out;
}

std::string refusal(const TempFolder& folder, std::string_view name, std::string_view bytes) {
  const auto file = folder.put(name, bytes);
  const auto mesh = import_mesh(file);
  EXPECT_FALSE(mesh.has_value());
  if (mesh) return {};
  testing::expect_sentence(mesh.error().message, file);
  return mesh.error().message;
}

TEST(Gzip, EveryFormatIsReadThroughIt) {
  const TempFolder folder;
  const TriangleMesh box = testing::box({0, 0, 0}, {1, 2, 3});
  for (const std::string name : {"a.ply", "a.obj", "a.stl", "a.glb", "a.3mf"}) {
    ASSERT_TRUE(export_mesh(box, folder / name).has_value());
    const auto plain = import_mesh(folder / name);
    const std::string packed = gzip(testing::file_bytes(folder / name));
    // By its first bytes, whatever the file is called.
    for (const std::string& as : {name + ".gz", name}) {
      const auto mesh = import_mesh(folder.put(as, packed));
      ASSERT_TRUE(mesh.has_value()) << mesh.error().message;
      EXPECT_EQ(mesh->positions, plain->positions) << as;
      EXPECT_EQ(mesh->triangles, plain->triangles) << as;
    }
  }
  // The name before .gz tells the format where the bytes do not: an OFF file may leave its keyword out.
  EXPECT_EQ(import_mesh(folder.put("b.off.gz", gzip("3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")))->triangles.size(), 1U);
}

TEST(Gzip, MembersFollowOneAnother) {
  const TempFolder folder;
  const std::string text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 3 2 1\n";
  const auto mesh =
      import_mesh(folder.put("a.obj.gz", gzip(text.substr(0, 20)) + gzip(text.substr(20)) + "something else"));
  ASSERT_TRUE(mesh.has_value()) << mesh.error().message;
  EXPECT_EQ(mesh->triangles.size(), 2U);
}

TEST(Gzip, DamageAndBombsAreRefused) {
  const TempFolder folder;
  const std::string packed = gzip("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_NE(refusal(folder, "a.obj.gz", packed.substr(0, packed.size() - 9)).find("gzip"), std::string::npos);
  std::string wrong = packed;
  wrong[packed.size() - 6] = static_cast<char>(wrong[packed.size() - 6] ^ 1);  // in the sum of all bytes
  EXPECT_NE(refusal(folder, "a.obj.gz", wrong).find("gzip"), std::string::npos);
  EXPECT_NE(refusal(folder, "a.obj.gz", "\x1f\x8b\x08 packed").find("gzip"), std::string::npos);
  EXPECT_NE(refusal(folder, "a.obj.gz", gzip(packed)).find("twice"), std::string::npos);
  // A hundred million blanks in a hundred thousand bytes.
  const std::string bomb = gzip(std::string(100'000'000, ' '));
  EXPECT_NE(refusal(folder, "a.obj.gz", bomb).find("hundred times"), std::string::npos);
}

TEST(Gzip, DamageGivesAMeshOrASentence) {
  const TempFolder folder;
  testing::expect_it_survives_damage(folder, "a.obj.gz",
                                     gzip("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n") + gzip("f 3 2 1\n"));
}

}  // namespace
}  // namespace relief
