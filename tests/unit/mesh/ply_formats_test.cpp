// What PLY files say of colour, and the types that they count in.
#include "bytes.h"
#include "colour_checks.h"
#include "damage.h"
#include "support/data.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

namespace relief {
namespace {

using testing::colour_of;
using testing::expect_colour;
using testing::expect_quarters;
using testing::import_of;
using testing::kBlue;
using testing::kGreen;
using testing::kRed;
using testing::kYellow;
using testing::le;
using testing::notes_of;
using testing::png_bytes;
using testing::quarters;
using testing::TempFolder;
using testing::triangles_of_colour;

constexpr Rgba8 kFullRed = {255, 0, 0}, kFullBlue = {0, 0, 255};

/// A text PLY of the unit square: four vertices with what `vertex` declares behind x y z, one face per row of `faces`.
std::string square_ply(std::string_view head, std::string_view vertex, const std::array<std::string, 4>& values,
                       std::string_view face, const std::vector<std::string>& faces) {
  std::string text = "ply\nformat ascii 1.0\n" + std::string(head) +
                     "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n" + std::string(vertex) +
                     "element face " + std::to_string(faces.size()) + "\nproperty list uchar int vertex_indices\n" +
                     std::string(face) + "end_header\n";
  const std::array<std::string_view, 4> places = {"0 0 0 ", "1 0 0 ", "1 1 0 ", "0 1 0 "};
  for (std::size_t k = 0; k < 4; ++k) text += std::string(places[k]) + values[k] + "\n";
  for (const std::string& row : faces) text += row + "\n";
  return text;
}

constexpr std::string_view kWedges = "property list uchar float texcoord\n";
const std::string kWedgedSquare = "4 0 1 2 3 8 0 0 1 0 1 1 0 1";

TEST(PlyColour, AnImageLiesOnItsFacesByTheirCorners) {
  const TempFolder folder;
  folder.put("my skin.png", png_bytes(quarters()));
  const TriangleMesh mesh =
      import_of(folder, "a.ply", square_ply("comment TextureFile my skin.png\n", "", {}, kWedges, {kWedgedSquare}));
  expect_quarters(mesh);
  EXPECT_TRUE(mesh.notes.empty()) << mesh.notes.front();
  // The same picture cut along the square's diagonal, each triangle with places of its own.
  expect_quarters(import_of(folder, "b.ply",
                            square_ply("comment TextureFile my skin.png\n", "", {}, kWedges,
                                       {"3 0 1 2 6 0 0 1 0 1 1", "3 0 2 3 6 0 0 1 1 0 1"})));
}

TEST(PlyColour, AnImageLiesOnItsFacesByTheirVertices) {
  const TempFolder folder;
  folder.put("a.jpg", testing::jpeg_bytes(quarters(), false));
  for (const auto& [u, v] : std::vector<std::pair<std::string, std::string>>{
           {"s", "t"}, {"u", "v"}, {"texture_u", "texture_v"}, {"texture_s", "texture_t"}, {"s0", "t0"}}) {
    const std::string vertex = "property float " + u + "\nproperty double " + v + "\n";
    expect_quarters(
        import_of(folder, "a.ply",
                  square_ply("comment TextureFile a.jpg\n", vertex, {"0 0", "1 0", "1 1", "0 1"}, "", {"4 0 1 2 3"})),
        4);
  }
}

TEST(PlyColour, EachFaceSaysWhichImageIsItsOwn) {
  const TempFolder folder;
  folder.put("a.png", png_bytes(testing::image_of(2, 2, [](auto, auto) { return kRed; })));
  folder.put("b.png", png_bytes(testing::image_of(2, 2, [](auto, auto) { return kBlue; })));
  const std::string head = "comment TextureFile a.png\ncomment TextureFile b.png\n";
  const TriangleMesh mesh = import_of(folder, "a.ply",
                                      square_ply(head, "", {}, std::string(kWedges) + "property int texnumber\n",
                                                 {"3 0 1 2 6 0 0 1 0 1 1 1", "3 0 2 3 6 0 0 1 1 0 1 0"}));
  expect_colour(colour_of(mesh, 0.7, 0.2), kBlue);
  expect_colour(colour_of(mesh, 0.2, 0.7), kRed);
}

TEST(PlyColour, AMissingImageIsANoteAndTheOtherColourShows) {
  const TempFolder folder;
  const std::string colours = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  const TriangleMesh mesh = import_of(folder, "a.ply",
                                      square_ply("comment TextureFile gone.png\n", "", {},
                                                 std::string(kWedges) + colours, {kWedgedSquare + " 200 10 20"}));
  ASSERT_EQ(mesh.notes.size(), 1U);
  EXPECT_NE(mesh.notes[0].find("'gone.png'"), std::string::npos) << mesh.notes[0];
  expect_colour(colour_of(mesh, 0.3, 0.6), kRed);
  // Places in an image that no line names: nothing can be had, and that is said.
  EXPECT_EQ(import_of(folder, "b.ply", square_ply("", "", {}, kWedges, {kWedgedSquare})).notes.size(), 1U);
}

TEST(PlyColour, FacesHaveColoursOfTheirOwn) {
  const TempFolder folder;
  for (const auto& [type, red, blue] : std::vector<std::array<std::string, 3>>{
           {"uchar", "255 0 0", "0 0 255"}, {"ushort", "65535 0 0", "0 0 65535"}, {"float", "1 0 0", "0 0 1.0"}}) {
    std::string face;
    for (const std::string channel : {"red", "green", "blue"}) face += "property " + type + " " + channel + "\n";
    const TriangleMesh mesh =
        import_of(folder, "a.ply", square_ply("", "", {}, face, {"3 0 1 2 " + red, "3 0 2 3 " + blue}));
    EXPECT_TRUE(mesh.notes.empty());
    EXPECT_EQ(mesh.positions.size(), 4U);
    expect_colour(colour_of(mesh, 0.7, 0.2), kFullRed);
    expect_colour(colour_of(mesh, 0.2, 0.7), kFullBlue);
    expect_colour(colour_of(mesh, 0.51, 0.5), kFullRed);  // to the very edge: nothing is mixed
  }
}

TEST(PlyColour, OfSeveralColoursOneIsUsedAndANoteSaysSo) {
  const TempFolder folder;
  folder.put("a.png", png_bytes(quarters()));
  const std::string colours = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  const std::array<std::string, 4> differ = {"30 220 40", "30 220 40", "30 220 40", "0 0 0"};
  const std::array<std::string, 4> alike = {"255 255 255", "255 255 255", "255 255 255", "255 255 255"};
  const auto with = [&](bool image, const std::array<std::string, 4>& of_vertices) {
    return import_of(folder, "a.ply",
                     square_ply(image ? "comment TextureFile a.png\n" : "", colours, of_vertices,
                                std::string(kWedges) + colours, {kWedgedSquare + " 255 0 0"}));
  };
  const TriangleMesh pictured = with(true, differ);
  expect_quarters(pictured);
  EXPECT_EQ(pictured.notes.size(), 1U);
  const TriangleMesh by_vertex = with(false, differ);
  expect_colour(colour_of(by_vertex, 0.999, 0.001), kGreen);
  EXPECT_EQ(by_vertex.notes.size(), 1U);
  // White for all says nothing, so the faces' colour shows and no note is needed.
  const TriangleMesh by_face = with(false, alike);
  expect_colour(colour_of(by_face, 0.5, 0.4), kFullRed);
  EXPECT_TRUE(by_face.notes.empty());
}

/// A binary PLY of two triangles of the square, its face corners of `type`.
template <typename Index>
std::string binary_square(std::string_view type, bool big) {
  const auto number = [&](auto value) { return big ? testing::be(value) : le(value); };
  std::string bytes = std::string("ply\nformat binary_") + (big ? "big" : "little") +
                      "_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n" +
                      "element face 2\nproperty list uchar " + std::string(type) + " vertex_indices\nend_header\n";
  for (const float value : {0.0F, 0.0F, 0.0F, 1.0F, 0.0F, 0.0F, 1.0F, 1.0F, 0.0F, 0.0F, 1.0F, 0.0F})
    bytes += number(value);
  for (const auto& corners : {std::array{0, 1, 2}, std::array{0, 2, 3}}) {
    bytes += '\3';
    for (const int corner : corners) bytes += number(static_cast<Index>(corner));
  }
  return bytes;
}

TEST(PlyNotes, NameWhatIsPassedOver) {
  const TempFolder folder;
  const std::string vertex = "property float nx\nproperty float ny\nproperty float nz\nproperty float quality\n";
  const std::string row = "0 0 1 0.5";
  const TriangleMesh mesh =
      import_of(folder, "a.ply", square_ply("", vertex, {row, row, row, row}, "property int label\n", {"4 0 1 2 3 7"}));
  ASSERT_EQ(mesh.notes.size(), 2U);
  EXPECT_EQ(mesh.notes[0], "values of its vertices that have no use here were passed over: quality");
  EXPECT_EQ(mesh.notes[1], "values of its faces that have no use here were passed over: label");
  std::string many, values;
  for (int k = 0; k < 7; ++k) {
    many += "property float p" + std::to_string(k) + "\n";
    values += "0 ";
  }
  const TriangleMesh more =
      import_of(folder, "b.ply", square_ply("", many, {values, values, values, values}, "", {"4 0 1 2 3"}));
  ASSERT_EQ(more.notes.size(), 1U);
  EXPECT_TRUE(more.notes[0].ends_with("p0, p1, p2, p3, p4 and 2 more")) << more.notes[0];
}

TEST(PlyNotes, ImagesWithoutPlacesAreNamed) {
  const TempFolder folder;
  folder.put("a.png", png_bytes(quarters()));
  const std::string head = "comment TextureFile a.png\n";
  EXPECT_EQ(notes_of(folder, "a.ply", square_ply(head, "", {}, "", {"4 0 1 2 3"})),
            "its images were passed over, as no face or vertex has a place in one (texture coordinates)");
  EXPECT_EQ(notes_of(folder, "a.ply", square_ply(head, "", {}, kWedges, {kWedgedSquare})), "");
}

TEST(PlyNotes, OtherElementsAreNamed) {
  const TempFolder folder;
  const auto with = [&](std::string_view before, std::string_view camera, std::string_view behind) {
    std::string text = square_ply("", "", {}, "", {"4 0 1 2 3"});
    text.insert(text.find("element vertex"), before);
    text.insert(text.find("end_header"), behind);
    text.insert(text.find("0 0 0"), camera);
    return notes_of(folder, "a.ply", text + "0 1 5\n7\n");
  };
  const std::string camera = "element camera 1\nproperty float view\n";
  const std::string edges = "element edge 1\nproperty int a\nproperty int b\nproperty int c\n";
  const std::string materials = "element material 1\nproperty int k\n";
  EXPECT_EQ(with(camera, "0.5\n", edges + materials),
            "parts of it that have no use here were passed over: camera, edge, material");
  // One without a row has nothing to miss.
  std::string none = square_ply("", "", {}, "", {"4 0 1 2 3"});
  none.insert(none.find("end_header"), "element edge 0\nproperty int a\n");
  EXPECT_EQ(notes_of(folder, "a.ply", none), "");
}

TEST(PlyNotes, SurplusIsCounted) {
  const TempFolder folder;
  const std::string text = square_ply("", "", {}, "", {"4 0 1 2 3"});
  const std::string more = "its lines hold more values than its header declares; these were passed over";
  EXPECT_EQ(notes_of(folder, "a.ply", square_ply("", "", {"", "7", "", ""}, "", {"4 0 1 2 3"})), more);
  EXPECT_EQ(notes_of(folder, "a.ply", square_ply("", "", {}, "", {"4 0 1 2 3 0.5"})), more);
  EXPECT_EQ(notes_of(folder, "a.ply", text + "\n4 0 1 2 3\n"),
            "it holds 9 bytes more than it declares, which were passed over");
  for (const bool big : {false, true}) {
    const std::string binary = binary_square<std::int32_t>("int", big);
    EXPECT_EQ(notes_of(folder, "a.ply", binary + "7"), "it holds 1 byte more than it declares, which was passed over");
    EXPECT_EQ(notes_of(folder, "a.ply", binary + std::string("\r\n\0", 3)), "");
    EXPECT_EQ(notes_of(folder, "a.ply", binary), "");
  }
  // Blank lines and comments hold nothing, and normals follow from the faces.
  EXPECT_EQ(notes_of(folder, "a.ply", text + "\n \n# 4 0 1 2 3\n"), "");
  const std::string normals = "property float nx\nproperty float ny\nproperty float nz\n";
  EXPECT_EQ(notes_of(folder, "a.ply", square_ply("", normals, {"0 0 1", "0 0 1", "0 0 1", "0 0 1"}, "", {"4 0 1 2 3"})),
            "");
}

TEST(PlyNotes, FacesOfTwoCornersAreLines) {
  const TempFolder folder;
  EXPECT_EQ(notes_of(folder, "a.ply", square_ply("", "", {}, "", {"4 0 1 2 3", "2 0 2"})),
            "points or lines were passed over; only faces are read");
}

TEST(PlyTypes, WholeNumbersOf64BitsCount) {
  const TempFolder folder;
  for (const bool big : {false, true}) {
    for (const std::string_view type : {"int64", "long", "int64_t", "longlong"})
      EXPECT_EQ(import_of(folder, "a.ply", binary_square<std::int64_t>(type, big)).triangles,
                (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}))
          << type;
    for (const std::string_view type : {"uint64", "ulong", "uint64_t", "unsigned_long"})
      EXPECT_EQ(import_of(folder, "a.ply", binary_square<std::uint64_t>(type, big)).triangles.size(), 2U) << type;
    EXPECT_EQ(import_of(folder, "a.ply", binary_square<std::int16_t>("int16_t", big)).triangles.size(), 2U);
  }
  // 2^63 + 1 is no vertex, not even after it is cut down to 64 bits with a sign.
  std::string bytes = binary_square<std::uint64_t>("uint64", false);
  bytes.replace(bytes.size() - 8, 8, le((std::uint64_t{1} << 63U) + 1));
  const auto refused = import_mesh(folder.put("a.ply", bytes));
  ASSERT_FALSE(refused.has_value());
  testing::expect_sentence(refused.error().message, "a.ply");
}

TEST(PlyStrips, TakeTheirVerticesPlacesInTheImage) {
  const TempFolder folder;
  folder.put("a.png", png_bytes(quarters()));
  std::string text = square_ply("comment TextureFile a.png\n", "property float s\nproperty float t\n",
                                {"0 0", "1 0", "1 1", "0 1"}, "", {"6 0 1 3 2 -1 0"});
  text.replace(text.find("element face"), 12, "element tristrips");
  const TriangleMesh mesh = import_of(folder, "a.ply", text);
  EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 3}, {3, 1, 2}}));
  expect_quarters(mesh);
}

TEST(PlyData, ColoursAndTypesOfFilesThatPeopleHave) {
  RELIEF_DATA_FILE(reports, "reports");
  const auto textured = import_mesh(reports / "ply-texture/m.ply");
  ASSERT_TRUE(textured.has_value()) << textured.error().message;
  EXPECT_TRUE(textured->notes.empty());
  EXPECT_EQ(triangles_of_colour(*textured, kFullRed), 4512U);
  EXPECT_EQ(triangles_of_colour(*textured, kFullBlue), 4512U);
  const auto faces = import_mesh(reports / "face-colours/face_colour.ply");
  ASSERT_TRUE(faces.has_value()) << faces.error().message;
  EXPECT_EQ(triangles_of_colour(*faces, kFullRed), 4512U);
  EXPECT_EQ(triangles_of_colour(*faces, kFullBlue), 4512U);
  const auto wide = import_mesh(reports / "ply-types/i64.ply");
  ASSERT_TRUE(wide.has_value()) << wide.error().message;
  EXPECT_EQ(wide->triangles.size(), 9024U);
}

TEST(PlyDamage, GivesAMeshOrASentence) {
  const TempFolder folder;
  folder.put("a.png", png_bytes(quarters(4)));
  const std::string colours = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  const std::string text = square_ply(
      "comment TextureFile a.png\ncomment TextureFile b.png\n", "property float s\nproperty float t\n" + colours,
      {"0 0 1 2 3", "1 0 4 5 6", "1 1 7 8 9", "0 1 0 0 0"}, std::string(kWedges) + "property int texnumber\n" + colours,
      {kWedgedSquare + " 0 200 10 20", "3 0 1 2 6 0 0 1 0 1 1 1 9 9 9"});
  testing::expect_it_survives_damage(folder, "t.ply", text);
  testing::expect_it_survives_damage(folder, "b.ply", binary_square<std::uint64_t>("uint64", false));
}

}  // namespace
}  // namespace relief
