// Colours of materials and images: what a reader makes of them, and what colour_at() answers.
#include "colour_checks.h"

#include <relief/mesh/import.h>
#include <relief/mesh/read/images.h>

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstring>

namespace relief {
namespace {

using testing::image_of;
using testing::jpeg_bytes;
using testing::png_bytes;
using testing::TempFolder;

using testing::colour_of;
using testing::expect_colour;
using testing::expect_quarters;
using testing::import_of;
using testing::kBlue;
using testing::kGreen;
using testing::kRed;
using testing::kYellow;
using testing::quarters;

/// The unit square as one quadrangle, its lower left corner at the image's lower left.
std::string square_obj(std::string_view head) {
  return std::string(head) + "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n" +
         "usemtl skin\nf 1/1 2/2 3/3 4/4\n";
}

TEST(ColourObj, AnImageLiesOnItsFaces) {
  for (const std::string_view name : {"a.png", "a picture.jpg", "progressive.jpg"}) {
    const TempFolder folder;
    folder.put(name, name.ends_with("png") ? png_bytes(quarters()) : jpeg_bytes(quarters(), name.starts_with("p")));
    folder.put("my skin.mtl",
               "newmtl other\nKd 1 0 0\nnewmtl skin\nKd 0.5 0.5 0.5\nmap_Kd " + std::string(name) + "\n");
    const TriangleMesh mesh = import_of(folder, "square.obj", square_obj("mtllib my skin.mtl\n"));
    EXPECT_TRUE(mesh.notes.empty()) << mesh.notes.front();
    expect_quarters(mesh, name.ends_with("png") ? 0.5 : 4);
  }
}

TEST(ColourObj, OptionsPlaceAndWrapTheImage) {
  const TempFolder folder;
  folder.put("a.png", png_bytes(quarters()));
  const auto with = [&](std::string_view options) {
    folder.put("m.mtl", "newmtl skin\nmap_Kd " + std::string(options) + " a.png\n");
    return import_of(folder, "square.obj", square_obj("mtllib m.mtl\n"));
  };
  // Twice across: the lower left quarter of the square shows the whole image.
  expect_colour(colour_of(with("-s 2 2 1"), 0.1, 0.4), kRed);
  expect_colour(colour_of(with("-s 2 2"), 0.6, 0.1), kBlue);
  expect_colour(colour_of(with("-s 2 2 -clamp on"), 0.6, 0.1), kYellow);
  expect_colour(colour_of(with("-blendu on -o 0.5 0 0 -mm 0 1"), 0.2, 0.8), kGreen);
}

TEST(ColourObj, WhatCannotBeHadIsANoteAndThePlainColour) {
  const TempFolder folder;
  const std::string whole = png_bytes(quarters());
  folder.put("cut.png", std::string_view(whole).substr(0, whole.size() / 2));
  folder.put("text.png", "not a picture");
  folder.put("cut.jpg", jpeg_bytes(quarters()).substr(0, 30));
  // A header that declares 60000 x 60000 pixels.
  std::string huge = whole;
  for (const std::size_t at : {16U, 20U}) huge.replace(at, 4, std::string_view("\x00\x00\xea\x60", 4));
  folder.put("huge.png", huge);
  for (const std::string_view image :
       {"cut.png", "text.png", "cut.jpg", "huge.png", "gone.png", "../gone.png", "/etc/passwd", "C:\\x\\gone.png"}) {
    folder.put("m.mtl", "newmtl skin\nKd 1 0.5 0\nmap_Kd " + std::string(image) + "\n");
    const TriangleMesh mesh = import_of(folder, "square.obj", square_obj("mtllib m.mtl\n"));
    ASSERT_EQ(mesh.notes.size(), 1U) << image;
    EXPECT_LE(mesh.notes[0].size(), 400U);
    expect_colour(colour_of(mesh, 0.4, 0.3), {255, 128, 0});
  }
  const TriangleMesh no_library = import_of(folder, "square.obj", square_obj("mtllib gone.mtl\n"));
  EXPECT_EQ(no_library.notes.size(), 1U);
  EXPECT_FALSE(no_library.has_colour());
}

TEST(ColourObj, APathOfAnotherMachineIsFoundByItsName) {
  const TempFolder folder;
  folder.put("a.png", png_bytes(quarters()));
  folder.put("m.mtl", "newmtl skin\nmap_Kd C:\\scans\\statue\\a.png\n");
  expect_quarters(import_of(folder, "square.obj", square_obj("mtllib m.mtl\n")));
}

TEST(ColourObj, ImagesGoBeforeVertexColoursAndThoseBeforePlainOnes) {
  const std::string vertices = "v 0 0 0 0 0 1\nv 1 0 0 0 0 1\nv 0 1 0 0 0 1\nvt 0.2 0.8\nusemtl skin\nf 1/1 2/1 3/1\n";
  const TempFolder folder;
  folder.put("a.png", png_bytes(quarters()));
  folder.put("m.mtl", "newmtl skin\nKd 1 0 0\n");
  expect_colour(colour_of(import_of(folder, "t.obj", "mtllib m.mtl\n" + vertices), 0.2, 0.2), {0, 0, 255});
  folder.put("m.mtl", "newmtl skin\nKd 1 0 0\nmap_Kd a.png\n");
  expect_colour(colour_of(import_of(folder, "t.obj", "mtllib m.mtl\n" + vertices), 0.2, 0.2), kRed);
}

TEST(ColourObj, PlainColoursKeepTheirFacesAndOneGreyIsNone) {
  const TempFolder folder;
  folder.put("m.mtl", "newmtl a\nKd 1 0 0\nnewmtl b\nKd 0 0 1\nnewmtl grey\nKd 0.8 0.8 0.8\n");
  const std::string quad = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
  const TriangleMesh two = import_of(folder, "t.obj", quad + "usemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\n");
  expect_colour(colour_of(two, 0.9, 0.5), {255, 0, 0});
  expect_colour(colour_of(two, 0.1, 0.5), {0, 0, 255});
  EXPECT_FALSE(import_of(folder, "t.obj", quad + "usemtl grey\nf 1 2 3 4\n").has_colour());
}

std::string base64(std::string_view bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string code;
  for (std::size_t k = 0; k < bytes.size(); k += 3) {
    std::uint32_t bits = 0;
    for (std::size_t c = 0; c < 3; ++c)
      bits = bits << 8U | (k + c < bytes.size() ? static_cast<unsigned char>(bytes[k + c]) : 0U);
    for (std::size_t c = 0; c < 4; ++c) code += k + c <= bytes.size() ? kDigits[bits >> (18 - 6 * c) & 63U] : '=';
  }
  return code;
}

/// The unit square in the plane z = 0 as glTF: positions, places in the image, colours of corners, indices.
std::string square_buffer(Vec3f corner_colour = {1, 1, 1}) {
  constexpr std::array<float, 12> kPositions = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
  constexpr std::array<float, 8> kPlaces = {0, 1, 1, 1, 1, 0, 0, 0};
  constexpr std::array<std::uint16_t, 6> kIndices = {0, 1, 2, 0, 2, 3};
  std::string bytes;
  const auto put = [&](const auto& values) {
    bytes.append(reinterpret_cast<const char*>(values.data()), sizeof values);
  };
  put(kPositions);
  put(kPlaces);
  for (int k = 0; k < 4; ++k) put(std::array<float, 3>{corner_colour.x, corner_colour.y, corner_colour.z});
  put(kIndices);
  return bytes;
}

/// `buffer` ends the first buffer's object, `attributes` and `rest` go where they say.
std::string square_gltf(const std::string& buffer, const std::string& attributes, const std::string& rest,
                        std::size_t image_bytes = 0) {
  std::string views = R"({"buffer":0,"byteOffset":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":32},)"
                      R"({"buffer":0,"byteOffset":80,"byteLength":48},{"buffer":0,"byteOffset":128,"byteLength":12})";
  if (image_bytes > 0) views += R"(,{"buffer":0,"byteOffset":140,"byteLength":)" + std::to_string(image_bytes) + "}";
  return R"({"asset":{"version":"2.0"},"buffers":[{)" + buffer + R"("byteLength":)" +
         std::to_string(140 + image_bytes) + R"(}],"bufferViews":[)" + views +
         R"(],"accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},)"
         R"({"bufferView":1,"componentType":5126,"count":4,"type":"VEC2"},)"
         R"({"bufferView":2,"componentType":5126,"count":4,"type":"VEC3"},)"
         R"({"bufferView":3,"componentType":5123,"count":6,"type":"SCALAR"}],)"
         R"("meshes":[{"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":1)" +
         attributes + R"(},"indices":3,"material":0}]}],"nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}],)" + rest + "}";
}

std::string inline_buffer(Vec3f corner_colour = {1, 1, 1}) {
  return R"("uri":"data:application/octet-stream;base64,)" + base64(square_buffer(corner_colour)) + R"(",)";
}

TEST(ColourGltf, ImagesInTheFileBesideItAndAsText) {
  const std::string picture = png_bytes(quarters());
  const std::string material =
      R"("materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}],"textures":[{"source":0}],"images":[{)";
  const TempFolder folder;
  folder.put("a picture.png", picture);
  expect_quarters(
      import_of(folder, "beside.gltf", square_gltf(inline_buffer(), "", material + R"("uri":"a%20picture.png"}])")));
  expect_quarters(import_of(
      folder, "text.gltf",
      square_gltf(inline_buffer(), "", material + R"("uri":"data:image/png;base64,)" + base64(picture) + R"("}])")));

  std::string json = square_gltf("", "", material + R"("bufferView":4,"mimeType":"image/png"}])", picture.size());
  std::string data = square_buffer() + picture;
  json.resize((json.size() + 3) / 4 * 4, ' ');
  data.resize((data.size() + 3) / 4 * 4, '\0');
  std::string glb = "glTF";
  const auto put = [&](std::size_t value) {
    const auto word = static_cast<std::uint32_t>(value);
    glb.append(reinterpret_cast<const char*>(&word), 4);
  };
  put(2), put(12 + 8 + json.size() + 8 + data.size());
  put(json.size()), glb += "JSON" + json;
  put(data.size()), glb += std::string_view("BIN\0", 4), glb += data;
  const TriangleMesh mesh = import_of(folder, "one.glb", glb);
  expect_quarters(mesh);
  EXPECT_TRUE(mesh.notes.empty());
}

TEST(ColourGltf, FactorVertexColourAndImageMultiplyInLinearLight) {
  const std::string picture =
      png_bytes(image_of(4, 4, [](std::uint32_t, std::uint32_t) { return Rgba8{188, 255, 255}; }));
  const TempFolder folder;
  folder.put("a.png", picture);
  // sRGB 188 is half the light of 255, so a quarter of it is 137.
  const std::string rest =
      R"("materials":[{"pbrMetallicRoughness":{"baseColorFactor":[0.5,1,0.25,1],"baseColorTexture":{"index":0}}}],)"
      R"("textures":[{"source":0}],"images":[{"uri":"a.png"}])";
  expect_colour(colour_of(import_of(folder, "f.gltf", square_gltf(inline_buffer(), "", rest)), 0.3, 0.6),
                {137, 255, 137}, 1);
  expect_colour(
      colour_of(import_of(folder, "v.gltf", square_gltf(inline_buffer({1, 0.5F, 1}), R"(,"COLOR_0":2)", rest)), 0.3,
                0.6),
      {137, 188, 137}, 1);
  expect_colour(
      colour_of(import_of(folder, "p.gltf",
                          square_gltf(inline_buffer(), "",
                                      R"("materials":[{"pbrMetallicRoughness":{"baseColorFactor":[1,0,0,1]}}])")),
                0.3, 0.6),
      {255, 0, 0});
  EXPECT_FALSE(import_of(folder, "w.gltf", square_gltf(inline_buffer(), "", R"("materials":[{}])")).has_colour());
}

TEST(ColourGltf, TransformsSamplersAndOldMaterials) {
  const TempFolder folder;
  folder.put("a.png", png_bytes(quarters()));
  const auto with = [&](std::string_view info, std::string_view sampler) {
    return import_of(
        folder, "t.gltf",
        square_gltf(
            inline_buffer(), "",
            R"("materials":[{"extensions":{"KHR_materials_pbrSpecularGlossiness":{"diffuseTexture":{"index":0)" +
                std::string(info) + R"(}}}}],"textures":[{"source":0,"sampler":0}],"samplers":[{)" +
                std::string(sampler) + R"(}],"images":[{"uri":"a.png"}])"));
  };
  expect_quarters(with("", ""));
  constexpr std::string_view kTwice = R"(,"extensions":{"KHR_texture_transform":{"scale":[2,1]}})";
  expect_colour(colour_of(with(kTwice, ""), 0.6, 0.8), kRed);
  expect_colour(colour_of(with(kTwice, R"("wrapS":33071)"), 0.6, 0.8), kGreen);
  expect_colour(colour_of(with(kTwice, R"("wrapS":33648)"), 0.6, 0.8), kGreen);
  expect_colour(colour_of(with(kTwice, R"("wrapS":33648)"), 0.9, 0.8), kRed);
  // A quarter turn about the upper left corner, then back into the image.
  expect_colour(
      colour_of(with(R"(,"extensions":{"KHR_texture_transform":{"rotation":1.5707963267948966}})", ""), 0.2, 0.8),
      kBlue);
}

TEST(ColourGltf, WhatCannotBeHadIsANote) {
  const TempFolder folder;
  const auto with = [&](std::string_view image) {
    return import_of(folder, "t.gltf",
                     square_gltf(inline_buffer(), "",
                                 R"("materials":[{"pbrMetallicRoughness":{"baseColorFactor":[0,1,0,1],)"
                                 R"("baseColorTexture":{"index":0}}}],"textures":[{"source":0}],"images":[{)" +
                                     std::string(image) + "}]"));
  };
  for (const std::string_view image :
       {R"("uri":"gone.png")", R"("uri":"https://example.org/a.png")", R"("bufferView":77)", R"("bufferView":0)",
        R"("uri":"data:image/png;base64,!!")", R"("uri":7)", ""}) {
    const TriangleMesh mesh = with(image);
    EXPECT_EQ(mesh.notes.size(), 1U) << image;
    expect_colour(colour_of(mesh, 0.3, 0.6), {0, 255, 0});
  }
}

TEST(ColourImage, LargeOnesAreHalvedUntilTheyFit) {
  const Image fine = image_of(
      100, 60, [](std::uint32_t x, std::uint32_t) { return x % 2 == 0 ? Rgba8{0, 100, 40} : Rgba8{100, 100, 60}; });
  for (const std::string& bytes : {png_bytes(fine), jpeg_bytes(fine)}) {
    std::uint64_t work = 10000;
    const auto small = detail::decode_image(bytes, 1000, work);
    ASSERT_TRUE(small) << small.error().message;
    EXPECT_EQ(work, 4000U);
    EXPECT_EQ(small->width, 25U);
    EXPECT_EQ(small->height, 15U);
    for (const Rgba8 c : small->pixels) {
      EXPECT_NEAR(c.r, 50, 3);
      EXPECT_NEAR(c.g, 100, 3);
      EXPECT_NEAR(c.b, 50, 3);
    }
    EXPECT_FALSE(detail::decode_image(bytes, 1000, work)) << "the bound on work";
  }
}

TEST(ColourImage, PngsOfEveryFormAreReadInTheirColourSpace) {
  const Image greys = image_of(16, 16, [](std::uint32_t x, std::uint32_t y) {
    const auto grey = static_cast<std::uint8_t>(16 * y + x);
    return Rgba8{grey, grey, grey};
  });
  const Image colours = image_of(16, 16, [](std::uint32_t x, std::uint32_t y) {
    return Rgba8{static_cast<std::uint8_t>(16 * y + x), static_cast<std::uint8_t>(255 - 17 * x),
                 static_cast<std::uint8_t>(17 * y)};
  });
  const auto is_in = [](std::uint8_t channel, bool linear) {
    if (!linear) return double(channel);
    const double light = channel / 255.0;
    return 255 * (light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1 / 2.4) - 0.055);
  };
  struct Space {
    int gamma;
    bool srgb;
    double off;  // libpng has a power of 2.2 for sRGB, which differs in the dark
  };
  for (const int kind : {PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_GRAY_ALPHA, PNG_COLOR_TYPE_RGB, PNG_COLOR_TYPE_RGB_ALPHA,
                         PNG_COLOR_TYPE_PALETTE})
    for (const int depth : {8, 16})
      for (const Space space :
           {Space{0, false, 0.6}, Space{0, true, 0.6}, Space{45455, false, 0.6}, Space{100'000, false, 9}}) {
        if (kind == PNG_COLOR_TYPE_PALETTE && depth == 16) continue;
        const Image& image = (kind & PNG_COLOR_MASK_COLOR) != 0 ? colours : greys;
        std::uint64_t work = 1000;
        const auto read = detail::decode_image(
            png_bytes(image, {.depth = depth, .kind = kind, .gamma = space.gamma, .srgb = space.srgb}), 1000, work);
        ASSERT_TRUE(read) << read.error().message;
        double worst = 0;
        for (std::size_t k = 0; k < image.pixels.size(); ++k) {
          const Rgba8 got = read->pixels[k], wanted = image.pixels[k];
          for (const auto channel : {&Rgba8::r, &Rgba8::g, &Rgba8::b})
            worst = std::max(worst, std::abs(got.*channel - is_in(wanted.*channel, space.gamma == 100'000)));
        }
        EXPECT_LE(worst, space.off) << "kind " << kind << ", " << depth << " bits, gamma " << space.gamma
                                    << (space.srgb ? ", sRGB" : "");
      }
}

TEST(ColourImage, PixelsAreReadBetweenTheirCentres) {
  TriangleMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}};
  mesh.materials = {{.colour = {},
                     .image = std::make_shared<const Image>(Image{2, 1, {{0, 0, 0}, {200, 100, 50}}}),
                     .wrap_u = Wrap::Clamp}};
  mesh.material_of = {0};
  mesh.uvs = {{{{0.25F, 0.5F}, {0.75F, 0.5F}, {2, 0.5F}}}};
  expect_colour(colour_at(mesh, 0, {1, 0, 0}), {0, 0, 0}, 0.01);
  expect_colour(colour_at(mesh, 0, {0.5, 0.5, 0}), {100, 50, 25}, 0.01);
  expect_colour(colour_at(mesh, 0, {0.75, 0.25, 0}), {50, 25, 13}, 0.6);
  expect_colour(colour_at(mesh, 0, {0, 0, 1}), {200, 100, 50}, 0.01);
  mesh.uvs[0][2] = {std::numeric_limits<float>::quiet_NaN(), 1e30F};
  EXPECT_GE(colour_at(mesh, 0, {0, 0, 1}).x, 0.0F);
}

}  // namespace
}  // namespace relief
