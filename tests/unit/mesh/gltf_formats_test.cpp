// What bends and packs the parts of a glTF scene: skins, morph targets, meshopt and Draco compression.
#include "bytes.h"
#include "colour_checks.h"
#include "damage.h"
#include "support/data.h"

#include <gtest/gtest.h>

#if RELIEF_WITH_MESHOPTIMIZER
#include <meshoptimizer.h>
#endif
#if RELIEF_WITH_DRACO
#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#endif

#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

namespace relief {
namespace {

using testing::import_of;
using testing::le;
using testing::TempFolder;

/// A GLB as it grows: one buffer, one view for each array.
class Glb {
 public:
  int view(std::string_view bytes, std::string_view more = "") {
    buffer_.resize((buffer_.size() + 3) / 4 * 4);
    list(views_, R"({"buffer":0,"byteOffset":)" + std::to_string(buffer_.size()) + R"(,"byteLength":)" +
                     std::to_string(bytes.size()) + std::string(more) + "}");
    buffer_ += bytes;
    return view_count_++;
  }
  int accessor(int of_view, int type, std::size_t count, std::string_view shape, std::string_view more = "") {
    list(accessors_, std::string("{") +
                         (of_view < 0 ? std::string() : R"("bufferView":)" + std::to_string(of_view) + ",") +
                         R"("componentType":)" + std::to_string(type) + R"(,"count":)" + std::to_string(count) +
                         R"(,"type":")" + std::string(shape) + '"' + std::string(more) + "}");
    return accessor_count_++;
  }
  template <typename T>
  int values(const std::vector<T>& numbers, int type, std::string_view shape, std::size_t components,
             std::string_view more = "") {
    std::string bytes;
    for (const T number : numbers) bytes += le(number);
    return accessor(view(bytes), type, numbers.size() / components, shape, more);
  }
  int floats(const std::vector<float>& numbers, std::string_view shape, std::size_t components) {
    return values(numbers, 5126, shape, components);
  }

  /// `rest` is everything but the asset, the accessors, the views and the buffer.
  [[nodiscard]] std::string file(const std::string& rest, std::string_view more_buffers = "") const {
    std::string json = R"({"asset":{"version":"2.0"},)" + rest + R"(,"accessors":[)" + accessors_ +
                       R"(],"bufferViews":[)" + views_ + R"(],"buffers":[{"byteLength":)" +
                       std::to_string(buffer_.size()) + "}" + std::string(more_buffers) + "]}";
    json.resize((json.size() + 3) / 4 * 4, ' ');
    std::string chunk = buffer_;
    chunk.resize((chunk.size() + 3) / 4 * 4);
    const auto size = [](std::size_t n) { return le(static_cast<std::uint32_t>(n)); };
    return std::string("glTF") + le(2U) + size(28 + json.size() + chunk.size()) + size(json.size()) + "JSON" + json +
           size(chunk.size()) + std::string("BIN\0", 4) + chunk;
  }

 private:
  static void list(std::string& all, const std::string& one) {
    if (!all.empty()) all += ',';
    all += one;
  }

  std::string buffer_, views_, accessors_;
  int view_count_ = 0, accessor_count_ = 0;
};

std::string number(int n) { return std::to_string(n); }

/// The positions and corners of the box from -1 to 1, and a primitive of them with `more` attributes.
struct Box {
  TriangleMesh mesh = testing::box({-1, -1, -1}, {1, 1, 1});
  int positions, indices;
  explicit Box(Glb& glb) {
    std::vector<float> at;
    for (const Vec3d& p : mesh.positions)
      for (std::size_t k = 0; k < 3; ++k) at.push_back(static_cast<float>(p[k]));
    positions = glb.floats(at, "VEC3", 3);
    std::vector<std::uint16_t> corners;
    for (const Triangle& t : mesh.triangles)
      for (const std::uint32_t corner : t) corners.push_back(static_cast<std::uint16_t>(corner));
    indices = glb.values(corners, 5123, "SCALAR", 1);
  }
  [[nodiscard]] std::string primitive(std::string_view attributes = "", std::string_view more = "") const {
    return R"({"attributes":{"POSITION":)" + number(positions) + std::string(attributes) + R"(},"indices":)" +
           number(indices) + std::string(more) + "}";
  }
};

void expect_points(const TriangleMesh& mesh, const std::vector<Vec3d>& wanted) {
  ASSERT_EQ(mesh.positions.size(), wanted.size());
  for (std::size_t k = 0; k < wanted.size(); ++k)
    EXPECT_LT(length(mesh.positions[k] - wanted[k]), 1e-6)
        << k << ": " << mesh.positions[k].x << " " << mesh.positions[k].y << " " << mesh.positions[k].z;
}
template <typename Map>
std::vector<Vec3d> each(const std::vector<Vec3d>& points, Map&& map) {
  std::vector<Vec3d> out;
  for (std::size_t k = 0; k < points.size(); ++k) out.push_back(map(points[k], k));
  return out;
}

std::vector<float> identity() { return {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}; }

TEST(GltfSkin, TheNodesOwnTransformSaysNothing) {
  const TempFolder folder;
  Glb glb;
  const Box box(glb);
  const int joints = glb.values(std::vector<std::uint8_t>(32, 0), 5121, "VEC4", 4);
  std::vector<float> weights;
  for (int k = 0; k < 8; ++k) weights.insert(weights.end(), {1, 0, 0, 0});
  const int weight = glb.floats(weights, "VEC4", 4), bound = glb.floats(identity(), "MAT4", 16);
  const TriangleMesh mesh = import_of(
      folder, "a.glb",
      glb.file(
          R"("scenes":[{"nodes":[0,1]}],"nodes":[{"mesh":0,"skin":0,"scale":[100,100,100],"translation":[7,7,7]},{"translation":[0,5,0]}],)"
          R"("skins":[{"joints":[1],"inverseBindMatrices":)" +
          number(bound) + R"(}],"meshes":[{"primitives":[)" +
          box.primitive(R"(,"JOINTS_0":)" + number(joints) + R"(,"WEIGHTS_0":)" + number(weight)) + "]}]"));
  expect_points(mesh, each(box.mesh.positions, [](Vec3d p, std::size_t) { return p + Vec3d{0, 5, 0}; }));
  EXPECT_NEAR(signed_volume(mesh), 8.0, 1e-5);
}

/// The box with two sets of joints: joint 0 stays where it was bound, joint 1 hangs below it, turned and moved, joint 2
/// mirrors. `weights` has those of joint 0, 1 and 2 for each vertex, spread over both sets.
std::string bent_box(const std::array<float, 3>& weights, std::string_view nodes,
                     std::string_view skin_joints = "[1,2,3]") {
  Glb glb;
  const Box box(glb);
  std::vector<std::uint16_t> first, second;
  std::vector<std::uint8_t> first_weights;
  std::vector<float> second_weights;
  for (int k = 0; k < 8; ++k) {
    first.insert(first.end(), {0, 1, 0, 0});
    second.insert(second.end(), {2, 0, 0, 0});
    first_weights.insert(first_weights.end(), {static_cast<std::uint8_t>(std::lround(weights[0] * 255)),
                                               static_cast<std::uint8_t>(std::lround(weights[1] * 255)), 0, 0});
    second_weights.insert(second_weights.end(), {weights[2], 0, 0, 0});
  }
  const int joints_0 = glb.values(first, 5123, "VEC4", 4), joints_1 = glb.values(second, 5123, "VEC4", 4);
  const int weights_0 = glb.values(first_weights, 5121, "VEC4", 4, R"(,"normalized":true)");
  const int weights_1 = glb.floats(second_weights, "VEC4", 4);
  // Joint 0 was bound at (1, 0, 0), the others at the origin.
  std::vector<float> matrices = identity();
  matrices[12] = -1;
  for (int k = 0; k < 2; ++k)
    for (const float value : identity()) matrices.push_back(value);
  const int bound = glb.floats(matrices, "MAT4", 16);
  return glb.file(R"("scenes":[{"nodes":[0,1]}],"nodes":)" + std::string(nodes) + R"(,"skins":[{"joints":)" +
                  std::string(skin_joints) + R"(,"inverseBindMatrices":)" + number(bound) +
                  R"(}],"meshes":[{"primitives":[)" +
                  box.primitive(R"(,"JOINTS_0":)" + number(joints_0) + R"(,"WEIGHTS_0":)" + number(weights_0) +
                                R"(,"JOINTS_1":)" + number(joints_1) + R"(,"WEIGHTS_1":)" + number(weights_1)) +
                  "]}]");
}
constexpr std::string_view kJoints =
    R"([{"mesh":0,"skin":0},{"translation":[1,0,0],"children":[2,3]},)"
    R"({"translation":[0,2,0],"rotation":[0,0,0.70710678118654757,0.70710678118654757]},{"scale":[-1,1,1]}])";

TEST(GltfSkin, JointsMeltByTheirWeightsOverAllSets) {
  const TempFolder folder;
  const std::vector<Vec3d> box = testing::box({-1, -1, -1}, {1, 1, 1}).positions;
  // Joint 0: where it was. Joint 1, below joint 0: turned by 90 degrees about z, moved to (1, 2, 0). Joint 2: mirrored,
  // moved to (1, 0, 0).
  const auto at = [](double w0, double w1, double w2) {
    return [=](Vec3d p, std::size_t) {
      return p * w0 + (Vec3d{-p.y, p.x, p.z} + Vec3d{1, 2, 0}) * w1 + (Vec3d{-p.x, p.y, p.z} + Vec3d{1, 0, 0}) * w2;
    };
  };
  expect_points(import_of(folder, "a.glb", bent_box({1, 0, 0}, kJoints)), each(box, at(1, 0, 0)));
  expect_points(import_of(folder, "a.glb", bent_box({0, 1, 0}, kJoints)), each(box, at(0, 1, 0)));
  expect_points(import_of(folder, "a.glb", bent_box({0.2F, 0.8F, 0}, kJoints)), each(box, at(0.2, 0.8, 0)));
  expect_points(import_of(folder, "a.glb", bent_box({0.2F, 0.4F, 0.4F}, kJoints)), each(box, at(0.2, 0.4, 0.4)));
  // Weights whose sum is not one are taken as shares; a vertex without any stays.
  expect_points(import_of(folder, "a.glb", bent_box({0.2F, 0.2F, 0}, kJoints)), each(box, at(0.5, 0.5, 0)));
  expect_points(import_of(folder, "a.glb", bent_box({0, 0, 0}, kJoints)), box);
  // A joint that mirrors does not turn the surface inside out.
  EXPECT_NEAR(signed_volume(import_of(folder, "a.glb", bent_box({0, 0, 1}, kJoints))), 8.0, 1e-5);
}

TEST(GltfSkin, RefusesJointsThatAreNotThere) {
  const TempFolder folder;
  const auto refused = [&](const std::string& bytes) {
    const auto mesh = import_mesh(folder.put("a.glb", bytes));
    EXPECT_FALSE(mesh.has_value());
    if (mesh) return std::string();
    testing::expect_sentence(mesh.error().message, "a.glb");
    return mesh.error().message;
  };
  EXPECT_NE(refused(bent_box({0, 0, 1}, kJoints, "[1,2]")).find("joint 2 of 2"), std::string::npos);
  EXPECT_NE(refused(bent_box({0, 0, 1}, kJoints, "[1,2,9]")).find("node 9"), std::string::npos);
  EXPECT_NE(refused(bent_box({0, 0, 1}, kJoints, "[]")).find("skin 0"), std::string::npos);
  EXPECT_NE(refused(bent_box({0, 0, 1}, kJoints, "[1,2,3,1]")).find("matrices"), std::string::npos);
  // Joints outside the scene that stand below each other.
  EXPECT_NE(refused(bent_box({1, 0, 0}, R"([{"mesh":0,"skin":0},{},{"children":[3]},{"children":[2]}])", "[2,3,2]"))
                .find("below itself"),
            std::string::npos);
}

/// The box with two morph targets: the first moves all by (0, 0, 4), the second, sparse, vertex 5 by (8, 0, 0).
std::string morphed_box(std::string_view mesh_more, std::string_view node_more) {
  Glb glb;
  const Box box(glb);
  std::vector<float> all;
  for (int k = 0; k < 8; ++k) all.insert(all.end(), {0, 0, 4});
  const int lift = glb.floats(all, "VEC3", 3);
  const int where = glb.view(std::string(1, '\5')), what = glb.view(le(8.0F) + le(0.0F) + le(0.0F));
  const int stretch = glb.accessor(-1, 5126, 8, "VEC3",
                                   R"(,"sparse":{"count":1,"indices":{"bufferView":)" + number(where) +
                                       R"(,"componentType":5121},"values":{"bufferView":)" + number(what) + "}}");
  return glb.file(
      R"("scenes":[{"nodes":[0]}],"nodes":[{"mesh":0,"translation":[10,0,0])" + std::string(node_more) +
      R"(}],"meshes":[{"primitives":[)" +
      box.primitive("", R"(,"targets":[{"POSITION":)" + number(lift) + R"(},{"POSITION":)" + number(stretch) + "}]") +
      "]" + std::string(mesh_more) + "}]");
}

TEST(GltfMorph, WeightsOfTheMeshHoldUntilTheNodeHasItsOwn) {
  const TempFolder folder;
  const std::vector<Vec3d> box = testing::box({-1, -1, -1}, {1, 1, 1}).positions;
  const auto expect = [&](std::string_view of_mesh, std::string_view of_node, double lift, double stretch) {
    SCOPED_TRACE(std::string(of_mesh) + std::string(of_node));
    expect_points(import_of(folder, "a.glb", morphed_box(of_mesh, of_node)), each(box, [&](Vec3d p, std::size_t k) {
                    return p + Vec3d{10 + (k == 5 ? 8 * stretch : 0), 0, 4 * lift};
                  }));
  };
  expect("", "", 0, 0);
  expect(R"(,"weights":[0.5,0.25])", "", 0.5, 0.25);
  expect(R"(,"weights":[0.5,0.25])", R"(,"weights":[-1,2])", -1, 2);
  expect("", R"(,"weights":[0,1])", 0, 1);
  expect(R"(,"weights":[1])", "", 1, 0);
  const auto refused = import_mesh(folder.put("a.glb", morphed_box(R"(,"weights":["much"])", "")));
  ASSERT_FALSE(refused.has_value());
  testing::expect_sentence(refused.error().message, "a.glb");
}

TEST(GltfNotes, AnimationsAreNamedAndUnknownExtensionsToo) {
  const TempFolder folder;
  Glb glb;
  const Box box(glb);
  const std::string scene = R"("nodes":[{"mesh":0}],"meshes":[{"primitives":[)" + box.primitive() + "]}]";
  const TriangleMesh moving = import_of(folder, "a.glb", glb.file(scene + R"(,"animations":[{}])"));
  ASSERT_EQ(moving.notes.size(), 1U);
  EXPECT_NE(moving.notes[0].find("animations"), std::string::npos);
  const TriangleMesh rough = import_of(
      folder, "a.glb",
      glb.file(R"("nodes":[{"mesh":0}],"materials":[{"normalTexture":{"index":0}}],"meshes":[{"primitives":[)" +
               box.primitive("", R"(,"material":0)") + "]}]"));
  EXPECT_EQ(rough.notes.size(), 1U);
  const auto refused = import_mesh(folder.put(
      "b.glb", glb.file(scene + R"(,"extensionsRequired":["KHR_mesh_quantization","VENDOR_one","VENDOR_two"])")));
  ASSERT_FALSE(refused.has_value());
  testing::expect_sentence(refused.error().message, "b.glb");
  EXPECT_NE(refused.error().message.find("extensions VENDOR_one, VENDOR_two;"), std::string::npos)
      << refused.error().message;
}

TEST(GltfNotes, NameWhatAUserWouldMiss) {
  const TempFolder folder;
  Glb glb;
  const Box box(glb);
  const auto notes = [&](std::string_view primitive_more, std::string_view more_primitives, std::string_view more) {
    return testing::notes_of(
        folder, "a.glb",
        glb.file(R"("scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],"meshes":[{"primitives":[)" +
                 box.primitive("", primitive_more) + std::string(more_primitives) + "]}" + std::string(more)));
  };
  EXPECT_EQ(notes("", "", "]"), "");
  EXPECT_EQ(notes("", "," + box.primitive("", R"(,"mode":1)"), "]"),
            "points or lines were passed over; only faces are read");
  EXPECT_EQ(notes("", "", R"(],"cameras":[{}])"), "cameras or lights were passed over");
  EXPECT_EQ(notes("", "", R"(],"extensions":{"KHR_lights_punctual":{"lights":[{}]}})"),
            "cameras or lights were passed over");
  const std::string hidden = R"(,{"primitives":[)" + box.primitive() + "]}";
  EXPECT_EQ(notes("", "", hidden + "]"), "1 mesh outside its scene was left out");
  EXPECT_EQ(notes("", "", hidden + hidden + "]"), "2 meshes outside its scene were left out");
  EXPECT_EQ(notes(R"(,"material":0)", "", R"(],"materials":[{"emissiveFactor":[0,0,0]}])"), "");
  EXPECT_EQ(notes(R"(,"material":0)", "",
                  R"(],"materials":[{"normalTexture":{},"occlusionTexture":{},"emissiveTexture":{},)"
                  R"("pbrMetallicRoughness":{"metallicRoughnessTexture":{}},)"
                  R"("extensions":{"KHR_materials_clearcoat":{"clearcoatTexture":{}}}},{"unusedTexture":{}}])"),
            "images of its materials other than colour were passed over: clearcoatTexture, emissiveTexture, "
            "metallicRoughnessTexture, normalTexture, occlusionTexture");
}

#if RELIEF_WITH_MESHOPTIMIZER

/// EXT_meshopt_compression for a view of bytes that are packed.
std::string packing(std::string_view mode, std::size_t offset, std::size_t size, std::size_t count, std::size_t stride,
                    std::string_view filter = "NONE") {
  return R"(,"extensions":{"EXT_meshopt_compression":{"buffer":0,"byteOffset":)" + std::to_string(offset) +
         R"(,"byteLength":)" + std::to_string(size) + R"(,"count":)" + std::to_string(count) + R"(,"byteStride":)" +
         std::to_string(stride) + R"(,"mode":")" + std::string(mode) + R"(","filter":")" + std::string(filter) + "\"}}";
}

template <typename T>
std::string packed_vertices(const std::vector<T>& values, std::size_t count) {
  const std::size_t stride = values.size() * sizeof(T) / count;
  std::string out(meshopt_encodeVertexBufferBound(count, stride), '\0');
  out.resize(meshopt_encodeVertexBuffer(reinterpret_cast<unsigned char*>(out.data()), out.size(), values.data(), count,
                                        stride));
  return out;
}

/// The box, packed: positions of 16 bits (1000 for 1) or floats by the exponential filter; corners as triangles or as a
/// sequence.
std::string packed_box(bool filtered, bool sequence, std::size_t cut = 0) {
  const TriangleMesh box = testing::box({-1, -1, -1}, {1, 1, 1});
  std::string positions;
  std::size_t stride = 8;
  if (filtered) {
    std::vector<float> values, out(24);
    for (const Vec3d& p : box.positions)
      for (std::size_t k = 0; k < 3; ++k) values.push_back(static_cast<float>(p[k]));
    meshopt_encodeFilterExp(out.data(), 8, 12, 20, values.data());
    positions = packed_vertices(out, 8);
    stride = 12;
  } else {
    std::vector<std::int16_t> values;
    for (const Vec3d& p : box.positions) {
      for (std::size_t k = 0; k < 3; ++k) values.push_back(static_cast<std::int16_t>(1000 * p[k]));
      values.push_back(0);
    }
    positions = packed_vertices(values, 8);
  }
  std::vector<unsigned> corners;
  for (const Triangle& t : box.triangles) corners.insert(corners.end(), t.begin(), t.end());
  std::string indices(sequence ? meshopt_encodeIndexSequenceBound(36, 8) : meshopt_encodeIndexBufferBound(36, 8), '\0');
  auto* const to = reinterpret_cast<unsigned char*>(indices.data());
  indices.resize(sequence ? meshopt_encodeIndexSequence(to, indices.size(), corners.data(), 36)
                          : meshopt_encodeIndexBuffer(to, indices.size(), corners.data(), 36));
  const std::string chunk = positions + indices;
  Glb glb;
  glb.view(chunk);
  const std::string fallback = R"({"buffer":1,"byteLength":)";
  std::string rest =
      R"("extensionsRequired":["EXT_meshopt_compression","KHR_mesh_quantization"],"scenes":[{"nodes":[0]}],)"
      R"("nodes":[{"mesh":0)" +
      std::string(filtered ? "" : R"(,"scale":[0.001,0.001,0.001])") +
      R"(}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}])";
  glb.accessor(1, filtered ? 5126 : 5122, 8, "VEC3");
  glb.accessor(2, 5125, 36, "SCALAR");
  std::string file =
      glb.file(rest, R"(,{"byteLength":9999,"extensions":{"EXT_meshopt_compression":{"fallback":true}}})");
  // The packed views, of the buffer that is not there.
  const std::string views =
      "," + fallback + std::to_string(8 * stride) + R"(,"byteStride":)" + std::to_string(stride) +
      packing("ATTRIBUTES", 0, positions.size() - cut, 8, stride, filtered ? "EXPONENTIAL" : "NONE") + "}," + fallback +
      "144" + packing(sequence ? "INDICES" : "TRIANGLES", positions.size(), indices.size(), 36, 4) + "}";
  const std::size_t at = file.find("}],\"buffers\"") + 1;
  file.insert(at, views);
  const auto grow = [&](std::size_t place) {
    std::uint32_t size = 0;
    std::memcpy(&size, file.data() + place, 4);
    file.replace(place, 4, le(static_cast<std::uint32_t>(size + views.size())));
  };
  grow(8);
  grow(12);
  return file;
}

TEST(GltfMeshopt, PackedViewsComeInAsTheyWere) {
  const TempFolder folder;
  const TriangleMesh box = testing::box({-1, -1, -1}, {1, 1, 1});
  for (const bool filtered : {false, true}) {
    for (const bool sequence : {false, true}) {
      const TriangleMesh mesh = import_of(folder, "a.glb", packed_box(filtered, sequence));
      expect_points(mesh, box.positions);
      EXPECT_NEAR(signed_volume(mesh), 8.0, 1e-5);
      EXPECT_EQ(mesh.triangles.size(), 12U);
      // The codec may begin a triangle with another corner; a sequence it keeps.
      if (sequence) {
        EXPECT_EQ(mesh.triangles, box.triangles);
      }
    }
  }
  const auto refused = import_mesh(folder.put("a.glb", packed_box(false, false, 3)));
  ASSERT_FALSE(refused.has_value());
  testing::expect_sentence(refused.error().message, "a.glb");
  EXPECT_NE(refused.error().message.find("damaged"), std::string::npos) << refused.error().message;
}

#endif

#if RELIEF_WITH_DRACO

/// The box with a colour at each corner of a triangle: red below z = 0, blue above.
std::string draco_box(bool sequential) {
  const TriangleMesh box = testing::box({-1, -1, -1}, {1, 1, 1});
  draco::TriangleSoupMeshBuilder builder;
  builder.Start(static_cast<int>(box.triangles.size()));
  const int places = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
  const int colours = builder.AddAttribute(draco::GeometryAttribute::COLOR, 3, draco::DT_UINT8);
  for (std::size_t t = 0; t < box.triangles.size(); ++t) {
    std::array<std::array<float, 3>, 3> p;
    std::array<std::array<std::uint8_t, 3>, 3> c;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3f at = to_float(box.positions[box.triangles[t][k]]);
      p[k] = {at.x, at.y, at.z};
      c[k] = at.z > 0 ? std::array<std::uint8_t, 3>{0, 0, 255} : std::array<std::uint8_t, 3>{255, 0, 0};
    }
    const draco::FaceIndex face(static_cast<std::uint32_t>(t));
    builder.SetAttributeValuesForFace(places, face, p[0].data(), p[1].data(), p[2].data());
    builder.SetAttributeValuesForFace(colours, face, c[0].data(), c[1].data(), c[2].data());
  }
  const std::unique_ptr<draco::Mesh> mesh = builder.Finalize();
  draco::Encoder encoder;
  encoder.SetEncodingMethod(sequential ? draco::MESH_SEQUENTIAL_ENCODING : draco::MESH_EDGEBREAKER_ENCODING);
  encoder.SetAttributeQuantization(draco::GeometryAttribute::POSITION, 16);
  draco::EncoderBuffer buffer;
  EXPECT_TRUE(encoder.EncodeMeshToBuffer(*mesh, &buffer).ok());
  return {buffer.data(), buffer.size()};
}

void expect_draco_box(const TriangleMesh& mesh) {
  EXPECT_EQ(mesh.triangles.size(), 12U);
  EXPECT_NEAR(signed_volume(mesh), 8.0, 1e-3);  // 16 bits across the box
  EXPECT_EQ(mesh.colours.size(), mesh.positions.size());
  for (std::size_t k = 0; k < mesh.colours.size(); ++k)
    EXPECT_EQ(mesh.colours[k], mesh.positions[k].z > 0 ? (Rgba8{0, 0, 255}) : (Rgba8{255, 0, 0})) << k;
}

TEST(Draco, FilesOfItsOwn) {
  const TempFolder folder;
  for (const bool sequential : {true, false}) {
    const std::string bytes = draco_box(sequential);
    expect_draco_box(import_of(folder, "a.drc", bytes));
    for (std::size_t end = 5; end < bytes.size(); end += 3) {
      const auto cut = import_mesh(folder.put("a.drc", bytes.substr(0, end)));
      ASSERT_FALSE(cut.has_value()) << end;
      testing::expect_sentence(cut.error().message, "a.drc");
    }
  }
}

TEST(Draco, CountsAreBoundedByTheBytesThatThereAre) {
  const TempFolder folder;
  // A header of version 2.2 and 16 million faces, of which there is not one: without a bound room is made for them.
  const std::string head = std::string("DRACO\2\2\1\0\0\0", 11);
  const auto refused =
      import_mesh(folder.put("a.drc", head + "\x80\x80\x80\x08\x80\x80\x80\x08" + std::string(1, '\0') + "\1\1\1\1"));
  ASSERT_FALSE(refused.has_value());
  testing::expect_sentence(refused.error().message, "a.drc");
}

/// A GLB whose only primitive is packed; the colours that its accessor speaks of mean 0..1.
std::string draco_glb(const std::string& packed) {
  Glb glb;
  const int view = glb.view(packed);
  const int places = glb.accessor(-1, 5126, 36, "VEC3");
  const int colours = glb.accessor(-1, 5121, 36, "VEC3", R"(,"normalized":true)");
  const int indices = glb.accessor(-1, 5125, 36, "SCALAR");
  return glb.file(
      R"("extensionsRequired":["KHR_draco_mesh_compression"],"nodes":[{"mesh":0}],"meshes":[{"primitives":[)"
      R"({"attributes":{"POSITION":)" +
      number(places) + R"(,"COLOR_0":)" + number(colours) + R"(},"indices":)" + number(indices) +
      R"(,"extensions":{"KHR_draco_mesh_compression":{"bufferView":)" + number(view) +
      R"(,"attributes":{"POSITION":0,"COLOR_0":1}}}}]}])");
}

TEST(Draco, InsideGltf) {
  const TempFolder folder;
  for (const bool sequential : {true, false}) {
    const std::string packed = draco_box(sequential);
    expect_draco_box(import_of(folder, "a.glb", draco_glb(packed)));
    const auto refused = import_mesh(folder.put("b.glb", draco_glb(packed.substr(0, packed.size() / 2))));
    ASSERT_FALSE(refused.has_value());
    testing::expect_sentence(refused.error().message, "b.glb");
    EXPECT_NE(refused.error().message.find("Draco"), std::string::npos);
  }
}

#endif

TEST(GltfData, ASkinnedBallStandsAtItsJoint) {
  RELIEF_DATA_FILE(file, "reports/gltf-skin/skin.glb");
  const auto mesh = import_mesh(file);
  ASSERT_TRUE(mesh.has_value()) << mesh.error().message;
  const Box3d box = bounds(*mesh);
  EXPECT_LT(length(box.centre() - Vec3d{0, 5, 0}), 1e-3);
  for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(box.high[k] - box.low[k], 2.0, 0.06);
}

TEST(GltfDamage, GivesAMeshOrASentence) {
  const TempFolder folder;
  testing::expect_it_survives_damage(folder, "skin.glb", bent_box({0.2F, 0.4F, 0.4F}, kJoints));
  testing::expect_it_survives_damage(folder, "morph.glb",
                                     morphed_box(R"(,"weights":[0.5,0.25])", R"(,"weights":[1,1])"));
#if RELIEF_WITH_MESHOPTIMIZER
  testing::expect_it_survives_damage(folder, "meshopt.glb", packed_box(true, false));
  testing::expect_it_survives_damage(folder, "sequence.glb", packed_box(false, true));
#endif
#if RELIEF_WITH_DRACO
  for (const bool sequential : {false, true}) {
    testing::expect_it_survives_damage(folder, "a.drc", draco_box(sequential));
    testing::expect_it_survives_damage(folder, "draco.glb", draco_glb(draco_box(sequential)));
  }
#endif
}

}  // namespace
}  // namespace relief
