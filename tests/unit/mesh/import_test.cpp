#include "bytes.h"
#include "mesh_checks.h"

#include <relief/mesh/import.h>

#include <gtest/gtest.h>

#include <bit>
#include <cstring>

namespace relief {
namespace {

using testing::TempFolder;

template <typename T>
void put_value(std::string& bytes, T value, bool big_endian = false) {
  bytes += big_endian ? testing::be(value) : testing::le(value);
}

TriangleMesh import_bytes(std::string_view name, std::string_view bytes) {
  const TempFolder folder;
  auto mesh = import_mesh(folder.put(name, bytes));
  EXPECT_TRUE(mesh.has_value()) << mesh.error().message;
  return mesh ? *std::move(mesh) : TriangleMesh{};
}

Error refuse_bytes(std::string_view name, std::string_view bytes) {
  const TempFolder folder;
  const auto file = folder.put(name, bytes);
  auto mesh = import_mesh(file);
  EXPECT_FALSE(mesh.has_value());
  if (mesh) return {};
  testing::expect_sentence(mesh.error().message, file);
  return mesh.error();
}

TEST(ImportPly, BothByteOrdersAndTextGiveTheSameMesh) {
  const std::string head =
      "element vertex 4\nproperty double x\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
      "property double y\nproperty list uchar float extra\nproperty double z\n"
      "element face 1\nproperty float quality\nproperty list ushort uint vertex_index\nend_header\n";
  const std::array<Vec3d, 4> points = {Vec3d{500000.001, 0, 0}, Vec3d{500001.002, 0, 0}, Vec3d{500001.003, 1, 0},
                                       Vec3d{500000.004, 1, 0}};
  std::vector<TriangleMesh> meshes;
  constexpr std::array<const char*, 3> kOrders = {"ascii", "binary_little_endian", "binary_big_endian"};
  for (const std::size_t order : {0U, 1U, 2U}) {
    std::string file = std::string("ply\nformat ").append(kOrders[order]).append(" 1.0\n").append(head);
    for (std::size_t k = 0; k < 4; ++k) {
      if (order == 0) {
        char line[200];
        std::snprintf(line, sizeof line, "%.17g %d 20 30 %.17g 2 0.5 0.5 %.17g\n", points[k].x, static_cast<int>(k),
                      points[k].y, points[k].z);
        file += line;
        continue;
      }
      put_value(file, points[k].x, order == 2);
      for (const std::uint8_t c : {static_cast<std::uint8_t>(k), std::uint8_t{20}, std::uint8_t{30}})
        put_value(file, c);
      put_value(file, points[k].y, order == 2);
      put_value(file, std::uint8_t{2});
      for (int n = 0; n < 2; ++n) put_value(file, 0.5F, order == 2);
      put_value(file, points[k].z, order == 2);
    }
    if (order == 0) {
      file += "0.25 4 0 1 2 3\n";
    } else {
      put_value(file, 0.25F, order == 2);
      put_value(file, std::uint16_t{4}, order == 2);
      for (std::uint32_t k = 0; k < 4; ++k) put_value(file, k, order == 2);
    }
    meshes.push_back(import_bytes("quad.ply", file));
  }
  for (const TriangleMesh& mesh : meshes) {
    ASSERT_EQ(mesh.positions.size(), 4U);
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_EQ(mesh.positions[k], points[k]);
      EXPECT_EQ(mesh.colours.at(k), (Rgba8{static_cast<std::uint8_t>(k), 20, 30, 255}));
    }
    EXPECT_EQ(mesh.triangles, meshes[0].triangles);
    EXPECT_EQ(mesh.triangles.size(), 2U);
  }
}

TEST(ImportPly, ColoursOfOtherTypesBecomeBytes) {
  const auto mesh =
      import_bytes("c.ply",
                   "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
                   "property ushort diffuse_red\nproperty float diffuse_green\nproperty uchar diffuse_blue\n"
                   "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
                   "0 0 0 65535 0.5 255\n1 0 0 0 2 128\n0 1 0 257 -1 0\n3 0 1 2\n");
  ASSERT_EQ(mesh.colours.size(), 3U);
  EXPECT_EQ(mesh.colours[0], (Rgba8{255, 128, 255, 255}));
  EXPECT_EQ(mesh.colours[1], (Rgba8{0, 255, 128, 255}));
  EXPECT_EQ(mesh.colours[2], (Rgba8{1, 0, 0, 255}));
}

TEST(ImportPly, StripsAlternateTheirSense) {
  const auto mesh =
      import_bytes("s.ply",
                   "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n"
                   "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
                   "0 0 0\n1 0 0\n0 1 0\n1 1 0\n2 2 0\n8 0 1 2 3 -1 1 4 3\n");
  ASSERT_EQ(mesh.triangles.size(), 3U);
  for (const auto& [a, b, c] : mesh.triangles) {
    EXPECT_GT(cross(mesh.positions[b] - mesh.positions[a], mesh.positions[c] - mesh.positions[a]).z, 0.0);
  }
}

TEST(ImportPly, HeaderLinesMayEndWithReturns) {
  std::string body;
  for (const float v : {0.F, 0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F, 0.F}) put_value(body, v);
  put_value(body, std::uint8_t{3});
  for (std::uint32_t k = 0; k < 3; ++k) put_value(body, k);
  for (const std::string end : {"\n", "\r\n", "\r"}) {
    std::string head;
    for (const char* line :
         {"ply", "format binary_little_endian 1.0", "element vertex 3", "property float x", "property float y",
          "property float z", "element face 1", "property list uchar int vertex_indices", "end_header"}) {
      head += line + end;
    }
    EXPECT_EQ(import_bytes("r.ply", head + body).triangles.size(), 1U);
  }
}

TEST(ImportPly, RefusesWhatTheFileCannotHold) {
  const std::string head =
      "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty double x\nproperty double y\n"
      "property double z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\nabc";
  const Error error = refuse_bytes("huge.ply", head);
  EXPECT_EQ(error.code, Errc::Corrupt);
  EXPECT_NE(error.message.find("4000000000"), std::string::npos);
}

TEST(ImportPly, NamesTheLineOfABadFace) {
  const Error error =
      refuse_bytes("bad.ply",
                   "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
                   "element face 2\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 "
                   "2\n3 0 1 90210\n");
  EXPECT_NE(error.message.find("line 14"), std::string::npos) << error.message;
  EXPECT_NE(error.message.find("90210"), std::string::npos);
}

TEST(ImportObj, ReadsWhatPeopleWrite) {
  const auto mesh = import_bytes("m.obj",
                                 "# comment\r\nmtllib x.mtl\r\nv 500000.123456789 4000000.25 0.001 1 0 0.5\r\nv +1. 0 "
                                 "0\r\n v 1 1 0\r\nv 0 1e0 0\r\n"
                                 "vt 0 0\r\nvn 0 0 1\r\nf 1/1/1 2//1 3/1 4 # quad\r\nf -4 -3 \\\r\n -2\r\n");
  ASSERT_EQ(mesh.positions.size(), 4U);
  EXPECT_EQ(mesh.positions[0], (Vec3d{500000.123456789, 4000000.25, 0.001}));
  EXPECT_EQ(mesh.triangles.size(), 3U);
  EXPECT_EQ(mesh.triangles[0], (Triangle{0, 1, 2}));
  ASSERT_EQ(mesh.colours.size(), 4U);
  EXPECT_EQ(mesh.colours[0], (Rgba8{255, 0, 128, 255}));
  EXPECT_EQ(mesh.colours[1], Rgba8{});
}

TEST(ImportObj, ColoursUpTo255) {
  const auto mesh = import_bytes("m.obj", "v 0 0 0 255 0 1\nv 1 0 0 0 128 0\nv 0 1 0 0 0 0\nf 1 2 3\n");
  EXPECT_EQ(mesh.colours.at(0), (Rgba8{255, 0, 1, 255}));
  EXPECT_EQ(mesh.colours.at(1), (Rgba8{0, 128, 0, 255}));
}

TEST(ImportObj, ReadsUtf16) {
  const std::string text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  for (const bool big_endian : {false, true}) {
    std::string wide = big_endian ? "\xfe\xff" : "\xff\xfe";
    for (const char c : text) wide += big_endian ? std::string{'\0', c} : std::string{c, '\0'};
    EXPECT_EQ(import_bytes("w.obj", wide).triangles.size(), 1U);
  }
}

TEST(ImportObj, CutsConcavePolygonsWithinThem) {
  // A comb: a fan from any corner would cover its gaps.
  std::string text;
  std::string face = "f";
  int count = 0;
  const auto point = [&](double x, double y) {
    text.append("v 3 ").append(std::to_string(x)).append(" ").append(std::to_string(y)).append("\n");
    face.append(" ").append(std::to_string(++count));
  };
  point(0, 0);
  point(11, 0);
  for (int tooth = 10; tooth >= 0; tooth -= 2) {
    point(tooth + 1, 5);
    point(tooth, 5);
    if (tooth > 0) {
      point(tooth, 1);
      point(tooth - 1, 1);
    }
  }
  const auto mesh = import_bytes("comb.obj", text + face + "\n");
  EXPECT_EQ(mesh.triangles.size(), static_cast<std::size_t>(count) - 2);
  Vec3d sum;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vec3d n = cross(mesh.positions[b] - mesh.positions[a], mesh.positions[c] - mesh.positions[a]) * 0.5;
    EXPECT_GT(n.x, 0.0) << "a triangle is turned over";
    sum += n;
  }
  EXPECT_DOUBLE_EQ(sum.x, 11 + 6 * 4);
  EXPECT_DOUBLE_EQ(testing::area(mesh), sum.x) << "triangles overlap";
}

TEST(ImportObj, CutsPolygonsWithABridgedHole) {
  const auto mesh = import_bytes(
      "hole.obj", "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 1 1 0\nv 1 3 0\nv 3 3 0\nv 3 1 0\nf 1 2 3 4 1 5 6 7 8 5\n");
  EXPECT_DOUBLE_EQ(testing::area(mesh), 16.0 - 4.0);
}

TEST(ImportObj, RefusesNumbersThatAreNone) {
  EXPECT_NE(refuse_bytes("n.obj", "v 0 0 0\nv 1 0 3.1+e2\nv 0 1 0\nf 1 2 3\n").message.find("line 2"),
            std::string::npos);
  EXPECT_NE(refuse_bytes("i.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 0\n").message.find("line 4"), std::string::npos);
  const Error far = refuse_bytes("f.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 7\n");
  EXPECT_NE(far.message.find("line 4"), std::string::npos) << far.message;
  EXPECT_NE(far.message.find("vertex 7 of 3"), std::string::npos) << far.message;
}

TEST(ImportObj, AFaceMayNameALaterVertex) {
  EXPECT_EQ(import_bytes("later.obj", "f 1 2 3 4\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n").triangles.size(), 2U);
}

TEST(ImportStl, TellsTextFromBinary) {
  std::string binary = "solid but binary";
  binary.resize(80, ' ');
  put_value(binary, std::uint32_t{1});
  for (const float v : {0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F, 0.F}) put_value(binary, v);
  put_value(binary, std::uint16_t{7});
  EXPECT_EQ(import_bytes("b.stl", binary).triangles.size(), 1U);
  EXPECT_EQ(import_bytes("longer.stl", binary + "trailing").triangles.size(), 1U);

  const auto mesh = import_bytes(
      "t.stl",
      "solid a\nendsolid\n\nSOLID b\n FACET normal 0 0 1\n  outer loop\n   vertex 500000.0001 0 0\n   vertex 1 0 0\n"
      "   Vertex 0 1 0\n  endloop\n endfacet\nendsolid b\n");
  ASSERT_EQ(mesh.triangles.size(), 1U);
  EXPECT_EQ(mesh.positions[0].x, 500000.0001);
}

TEST(ImportStl, RefusesDamage) {
  EXPECT_NE(refuse_bytes("cut.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n")
                .message.find("cut off"),
            std::string::npos);
  std::string binary(80, 'x');
  put_value(binary, std::uint32_t{1000});
  binary.append(60, '\0');
  EXPECT_EQ(refuse_bytes("short.stl", binary).code, Errc::Corrupt);
}

TEST(ImportOff, ReadsItsKinds) {
  const std::string body = "4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2 255 0 0\n3 0 2 3\n";
  EXPECT_EQ(import_bytes("a.off", "OFF\n" + body).triangles.size(), 2U);
  EXPECT_EQ(import_bytes("b.off", " # hello\nOFF" + body).triangles.size(), 2U);
  EXPECT_EQ(import_bytes("c.off", body).triangles.size(), 2U);
  const auto coloured =
      import_bytes("d.off", "COFF\n3 1 0\n0 0 0 255 0 0 255\n1 0 0 0 128 0 255\n0 1 0 0 0 1 0\n3 0 1 2\n");
  EXPECT_EQ(coloured.colours.at(1), (Rgba8{0, 128, 0, 255}));
  EXPECT_EQ(coloured.colours.at(2), (Rgba8{0, 0, 1, 0}));
  EXPECT_EQ(import_bytes("e.off", "NOFF\n3 1 0\n0 0 0 0 0 1\n1 0 0 0 0 1\n0 1 0 0 0 1\n3 0 1 2\n").positions.at(1),
            (Vec3d{1, 0, 0}));
}

TEST(ImportGltf, AppliesNodesAndMirrors) {
  // One triangle, drawn as it is, moved by 1e6 and scaled, and mirrored in x.
  const std::string json = R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,2]}],"nodes":[
    {"translation":[1000000.125,0,0],"scale":[2,2,2],"children":[1]},{"mesh":0,"rotation":[0,0,0.7071067811865476,0.7071067811865476]},
    {"mesh":0,"matrix":[-1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]}],
    "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
    "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},{"bufferView":1,"componentType":5121,"count":3,"type":"SCALAR"}],
    "bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":3}],
    "buffers":[{"byteLength":39,"uri":"part%201.bin"}]})";
  std::string buffer;
  for (const float v : {0.F, 0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F, 0.F}) put_value(buffer, v);
  buffer += std::string("\0\1\2", 3);
  const TempFolder folder;
  (void)folder.put("part 1.bin", buffer);
  const auto mesh = import_mesh(folder.put("scene.gltf", json));
  ASSERT_TRUE(mesh.has_value()) << mesh.error().message;
  ASSERT_EQ(mesh->triangles.size(), 2U);
  const Vec3d turned = mesh->positions[1];
  EXPECT_NEAR(turned.x, 1000000.125, 1e-9);
  EXPECT_NEAR(turned.y, 2.0, 1e-9);
  for (const auto& [a, b, c] : mesh->triangles) {
    EXPECT_GT(cross(mesh->positions[b] - mesh->positions[a], mesh->positions[c] - mesh->positions[a]).z, 0.0);
  }
}

/// One triangle whose copies EXT_mesh_gpu_instancing moves, turns and scales, below a node that moves them all; `first`
/// stands at the beginning of the file.
std::string instanced(const std::string& first, const std::string& attributes) {
  std::string buffer;
  for (const float v : {0.F, 0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F, 0.F}) put_value(buffer, v);                  // corners
  for (const float v : {0.F, 0.F, 0.F, 5.F, 0.F, 0.F}) put_value(buffer, v);                                 // moves
  for (const int v : {0, 0, 0, 32767, 0, 0, 23170, 23170}) put_value(buffer, static_cast<std::int16_t>(v));  // turns
  for (const float v : {1.F, 1.F, 1.F, 2.F, 2.F, 2.F}) put_value(buffer, v);                                 // scales
  const auto u32 = [](std::size_t v) {
    std::string bytes;
    put_value(bytes, static_cast<std::uint32_t>(v));
    return bytes;
  };
  std::string json = "{" + first + R"("asset":{"version":"2.0"},"extensionsUsed":["EXT_mesh_gpu_instancing"],
    "scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0,"translation":[0,0,7],
      "extensions":{"EXT_mesh_gpu_instancing":{"attributes":{)" +
                     attributes + R"(}}}}],
    "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
    "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},
      {"bufferView":0,"byteOffset":36,"componentType":5126,"count":2,"type":"VEC3"},
      {"bufferView":0,"byteOffset":60,"componentType":5122,"normalized":true,"count":2,"type":"VEC4"},
      {"bufferView":0,"byteOffset":76,"componentType":5126,"count":2,"type":"VEC3"}],
    "bufferViews":[{"buffer":0,"byteLength":100}],"buffers":[{"byteLength":100}]})";
  json.resize((json.size() + 3) / 4 * 4, ' ');
  return "glTF" + u32(2) + u32(28 + json.size() + buffer.size()) + u32(json.size()) + "JSON" + json +
         u32(buffer.size()) + std::string("BIN\0", 4) + buffer;
}

TEST(ImportGltf, MakesTheCopiesOfInstancing) {
  const std::string all = R"("ROTATION":2,"SCALE":3,"TRANSLATION":1)";
  for (const char* first : {"", R"("extensionsRequired":["EXT_mesh_gpu_instancing"],)"}) {
    const auto mesh = import_bytes("copies.glb", instanced(first, all));
    ASSERT_EQ(mesh.triangles.size(), 2U);
    EXPECT_EQ(mesh.positions[1], (Vec3d{1, 0, 7}));
    // A quarter turn about z, twice the size, 5 aside.
    EXPECT_NEAR(length(mesh.positions[4] - Vec3d{5, 2, 7}), 0.0, 1e-4);
    EXPECT_NEAR(length(mesh.positions[5] - Vec3d{3, 0, 7}), 0.0, 1e-4);
  }
  EXPECT_EQ(import_bytes("moved.glb", instanced("", R"("TRANSLATION":1)")).positions[5], (Vec3d{5, 1, 7}));
  EXPECT_EQ(import_bytes("numbered.glb", instanced("", R"("_ID":1)")).triangles.size(), 2U);
  EXPECT_EQ(import_bytes("none.glb", instanced("", "")).triangles.size(), 1U);
  EXPECT_EQ(refuse_bytes("short.glb", instanced("", R"("TRANSLATION":1,"SCALE":0)")).code, Errc::Corrupt);
  EXPECT_EQ(refuse_bytes("wrong.glb", instanced("", R"("ROTATION":1)")).code, Errc::Corrupt);
  EXPECT_EQ(refuse_bytes("missing.glb", instanced("", R"("SCALE":9)")).code, Errc::Corrupt);
}

TEST(ImportGltf, RefusesCyclesOutsideFilesAndUnknownExtensions) {
  const auto with = [](const std::string& rest) {
    return std::string(R"({"asset":{"version":"2.0"},)").append(rest).append("}");
  };
  EXPECT_EQ(
      refuse_bytes("cycle.gltf", with(R"("scenes":[{"nodes":[0]}],"nodes":[{"children":[1]},{"children":[0]}])")).code,
      Errc::Corrupt);
  EXPECT_EQ(refuse_bytes("out.gltf", with(R"("buffers":[{"byteLength":4,"uri":"../../etc/passwd"}])")).code,
            Errc::UnsupportedFormat);
  EXPECT_NE(refuse_bytes("lod.gltf", with(R"("extensionsRequired":["VENDOR_levels"])"))
                .message.find("VENDOR_levels; export it without that extension"),
            std::string::npos);
}

TEST(Import3mf, EveryUnitComesInAtItsSize) {
  const auto read = [](const std::string& attribute) {
    return import_bytes(
        "unit.3mf",
        testing::stored_zip(
            {{"3D/3dmodel.model",
              "<?xml version=\"1.0\"?><model" + attribute +
                  " xml:lang=\"en\"><resources><object id=\"1\"><mesh><vertices>"
                  "<vertex x=\"3\" y=\"0\" z=\"0\"/><vertex x=\"0\" y=\"7\" z=\"0\"/>"
                  "<vertex x=\"0\" y=\"0\" z=\"-1\"/></vertices><triangles>"
                  "<triangle v1=\"0\" v2=\"1\" v3=\"2\"/></triangles></mesh></object></resources>"
                  "<build><item objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 1 10 0 0\"/></build></model>"}}));
  };
  const auto expect = [&](const std::string& attribute, std::optional<Unit> unit, Vec3d high, double low_z) {
    const TriangleMesh mesh = read(attribute);
    EXPECT_EQ(mesh.unit, unit) << attribute;
    EXPECT_EQ(bounds(mesh).high, high) << attribute;
    EXPECT_EQ(bounds(mesh).low.z, low_z) << attribute;
  };
  expect("", Unit::Millimetre, {13, 7, 0}, -1);
  expect(" unit=\"millimeter\"", Unit::Millimetre, {13, 7, 0}, -1);
  expect(" unit='centimeter'", Unit::Centimetre, {13, 7, 0}, -1);
  expect(" unit=\"meter\"", Unit::Metre, {13, 7, 0}, -1);
  // Not Relief's: to the nearest double in millimetres, the build item's offset too.
  expect(" unit=\"micron\"", Unit::Millimetre, {0.013, 0.007, 0}, -0.001);
  expect(" unit=\"inch\"", Unit::Inch, {13, 7, 0}, -1);
  expect(" unit=\"foot\"", Unit::Millimetre, {13 * 304.8, 7 * 304.8, 0}, -304.8);
  expect(" unit=\"furlong\"", std::nullopt, {13, 7, 0}, -1);
}

TEST(Import, NamesWhatIsNoMesh) {
  const TempFolder folder;
  EXPECT_EQ(import_mesh(folder / "missing.ply").error().code, Errc::NotFound);
  EXPECT_EQ(import_mesh(folder / "").error().code, Errc::Io);
  EXPECT_NE(refuse_bytes("a.ply", "BZh91AY packed").message.find("bzip2"), std::string::npos);
  EXPECT_NE(refuse_bytes("a.stl", "version https://git-lfs.github.com/spec/v1\noid sha256:1\n").message.find("LFS"),
            std::string::npos);
  EXPECT_EQ(refuse_bytes("a.xyz", "hello").code, Errc::UnsupportedFormat);
  (void)refuse_bytes("empty.obj", "");
  (void)refuse_bytes("line\nbreak\x1b[31m.obj", "v 0 0 bell\x07\n");
}

TEST(Import, ContentCountsMoreThanTheName) {
  EXPECT_EQ(import_bytes("really_off.stl", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n").triangles.size(), 1U);
  EXPECT_EQ(import_bytes("no_extension", "# x\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").triangles.size(), 1U);
}

}  // namespace
}  // namespace relief
