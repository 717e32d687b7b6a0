#include "damage.h"
#include "support/data.h"

#include <relief/mesh/export.h>
#include <relief/mesh/import.h>
#include <relief/mesh/repair.h>

#include <gtest/gtest.h>

#include <algorithm>

namespace relief {
namespace {

using testing::survives;
using testing::TempFolder;

TEST(BadFiles, EachGivesAMeshOrASentence) {
  RELIEF_DATA_FILE(folder, "b_bad");
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) files.push_back(entry.path());
  std::ranges::sort(files);
  ASSERT_GT(files.size(), 50U);
  std::vector<std::string> refused;
  for (const auto& file : files)
    if (!survives(file)) refused.push_back(file.filename().string());
  std::ranges::sort(refused);
  // What is refused is refused for a reason: no faces, damaged, not this kind of file. Anything more is a step back.
  const std::vector<std::string> known = {"ArmadilloBack_0.ply",
                                          "OutOfMemory.off",
                                          "b9.ply",
                                          "bun000.ply",
                                          "cube-stl-1.0_ascii-not_closed-invalid.stl",
                                          "degenerate_mesh.obj",
                                          "empty.obj",
                                          "empty.ply",
                                          "float_inf_point_cloud.ply",
                                          "inf_nan.obj",
                                          "invalidvertex.stl",
                                          "issue623.ply",
                                          "lucy100k_utf8_mangled.ply",
                                          "malformed.obj",
                                          "number_formats.obj",
                                          "obj_wireframe.obj",
                                          "ply_empty_bin.ply",
                                          "points_emptyface.ply",
                                          "stl_empty_bin.stl",
                                          "toomanyvertices.stl",
                                          "unparseable.stl"};
  EXPECT_EQ(refused, known);
}

TEST(BadFiles, ScansComeInWhole) {
  RELIEF_DATA_FILE(bunny, "a_models/bunny.ply");
  const auto soup = import_mesh(bunny);
  ASSERT_TRUE(soup.has_value()) << soup.error().message;
  EXPECT_EQ(soup->positions.size(), 35947U);
  EXPECT_EQ(soup->triangles.size(), 69451U);
  const auto out = repair(*soup);
  ASSERT_TRUE(out.has_value());
  EXPECT_EQ(out->report.unused_vertices, 1113U);
  EXPECT_EQ(out->report.parts, 1U);
  EXPECT_EQ(out->report.boundary_loops, 5U);
  RELIEF_DATA_FILE(horse, "a_models/horse.ply");
  const auto turned = repair(import_mesh(horse).value());
  EXPECT_EQ(turned->report.turned_parts, 1U);
  EXPECT_NEAR(signed_volume(turned->mesh), 0.000263418, 1e-8);
}

TEST(BadFiles, DamagedFilesOfEveryFormatGiveAMeshOrASentence) {
  const TempFolder folder;
  TriangleMesh mesh = testing::box({0, 0, 0}, {1, 2, 3});
  for (std::uint8_t k = 0; k < 8; ++k) mesh.colours.push_back({k, 0, 0, 255});
  std::vector<std::pair<std::string, std::string>> seeds;
  for (const std::string name : {"a.ply", "a.obj", "a.stl", "a.glb", "a.3mf"}) {
    ASSERT_TRUE(export_mesh(mesh, folder / name).has_value());
    seeds.emplace_back(name, testing::file_bytes(folder / name));
  }
  seeds.emplace_back("t.ply",
                     "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float "
                     "z\nproperty list uchar int w\n"
                     "element face 2\nproperty list uchar int vertex_indices\nelement tristrips 1\nproperty list int "
                     "int vertex_indices\n"
                     "end_header\n0 0 0 1 5\n1 0 0 0\n0 1 0 2 1 1\n0 0 1 0\n3 0 1 2\n4 0 1 2 3\n5 0 1 2 -1 3\n");
  seeds.emplace_back("t.stl",
                     "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 "
                     "0\nendloop\nendfacet\nendsolid x\n");
  seeds.emplace_back("t.off",
                     "COFF\n4 2 0\n0 0 0 1 0 0\n1 0 0 1 0 0\n0 1 0 0 0 1\n0 0 1 0 0 0\n3 0 1 2\n4 0 1 2 3 9 9 9\n");
  seeds.emplace_back("b.off", std::string("OFF BINARY\n") + std::string("\0\0\0\3\0\0\0\1\0\0\0\0", 12) +
                                  std::string(12, '\0') + std::string("\x3f\x80", 2) + std::string(14, '\0') +
                                  std::string("\x3f\x80", 2) + std::string(6, '\0') +
                                  std::string("\0\0\0\3\0\0\0\0\0\0\0\1\0\0\0\2\0\0\0\0", 20));
  seeds.emplace_back(
      "t.gltf",
      R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0,"scale":[1,2,3]}],"meshes":[{"primitives":[{"attributes":{"POSITION":0,"COLOR_0":1}}]}],)"
      R"("accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","sparse":{"count":1,"indices":{"bufferView":1,"componentType":5121},"values":{"bufferView":0}}},)"
      R"({"bufferView":0,"componentType":5121,"count":3,"type":"VEC4","normalized":true}],"bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":1,"byteLength":1}],)"
      R"("buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]})");
  for (const auto& [name, bytes] : seeds) EXPECT_TRUE(import_mesh(folder.put(name, bytes)).has_value()) << name;
  for (const auto& [name, bytes] : seeds) testing::expect_it_survives_damage(folder, name, bytes);
}

TEST(BadFiles, SmallFilesCannotAskForMuch) {
  const TempFolder folder;
  const std::string json =
      R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"children":[1,1,1,1,1,1,1,1]},{"children":[2,2,2,2,2,2,2,2]},{"mesh":0}],"meshes":[{}]})";
  EXPECT_FALSE(survives(folder.put("repeat.gltf", json)));
  EXPECT_FALSE(survives(folder.put("deep.gltf", std::string(200000, '['))));
  std::string polygon = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf";
  for (int k = 0; k < 30000; ++k) polygon += k % 3 == 0 ? " 1 3" : " 2 4";
  (void)survives(folder.put("tangle.obj", polygon + "\n"));
  const std::string cells =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement nothing "
      "18446744073709551615\n"
      "element face 1\nproperty list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n2000000000 0 1 2\n";
  EXPECT_FALSE(survives(folder.put("list.ply", cells)));
}

}  // namespace
}  // namespace relief
