// What 3MF files say of colour: base materials, colours, images, mixtures, and layers of these.
#include "bytes.h"
#include "colour_checks.h"
#include "damage.h"
#include "support/data.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>
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
using testing::png_bytes;
using testing::quarters;
using testing::stored_zip;
using testing::TempFolder;
using testing::triangles_of_colour;

constexpr std::string_view kPicture = R"(<texture2d id="4" path="/3D/Textures/a.png" contenttype="image/png"/>)";
/// Places of the square's corners in the image, v upwards, and the middle of its lower left quarter.
constexpr std::string_view kPlaces =
    R"(<texture2dgroup id="5" texid="4"><tex2coord u="0" v="0"/><tex2coord u="1" v="0"/><tex2coord u="1" v="1"/><tex2coord u="0" v="1"/><tex2coord u="0.25" v="0.25"/></texture2dgroup>)";

/// A model of the unit square in the plane z = 0; `first` and `second` are attributes of its triangles.
std::string square_model(std::string_view resources, std::string_view object, std::string_view first,
                         std::string_view second, std::string_view build = R"(<item objectid="9"/>)") {
  return std::string(R"(<?xml version="1.0"?><model unit="millimeter"><resources>)") + std::string(resources) +
         R"(<object id="9" )" + std::string(object) +
         R"(><mesh><vertices><vertex x="0" y="0" z="0"/><vertex x="1" y="0" z="0"/><vertex x="1" y="1" z="0"/>)" +
         R"(<vertex x="0" y="1" z="0"/></vertices><triangles><triangle v1="0" v2="1" v3="2" )" + std::string(first) +
         R"(/><triangle v1="0" v2="2" v3="3" )" + std::string(second) +
         R"(/></triangles></mesh></object></resources><build>)" + std::string(build) + "</build></model>";
}
TriangleMesh square(const TempFolder& folder, std::string_view resources, std::string_view object,
                    std::string_view first, std::string_view second, std::string_view build = R"(<item objectid="9"/>)",
                    bool picture = true) {
  std::vector<std::pair<std::string, std::string>> members = {
      {"3D/3dmodel.model", square_model(resources, object, first, second, build)}};
  if (picture) members.emplace_back("3D/Textures/a.png", png_bytes(quarters()));
  return import_of(folder, "a.3mf", stored_zip(members));
}
const std::string kPictured = std::string(kPicture) + std::string(kPlaces);

TEST(ThreeMfColour, AnImageLiesOnItsTriangles) {
  const TempFolder folder;
  const TriangleMesh mesh =
      square(folder, kPictured, "", R"(pid="5" p1="0" p2="1" p3="2")", R"(pid="5" p1="0" p2="2" p3="3")");
  expect_quarters(mesh);
  EXPECT_EQ(mesh.positions.size(), 4U);
  EXPECT_TRUE(mesh.notes.empty());
  // By the object's own group, and mirrored by its build item: the picture is mirrored with it.
  const TriangleMesh mirrored =
      square(folder, kPictured, R"(pid="5" pindex="0")", R"(p1="0" p2="1" p3="2")", R"(p1="0" p2="2" p3="3")",
             R"(<item objectid="9" transform="-1 0 0 0 1 0 0 0 1 1 0 0"/>)");
  expect_colour(colour_of(mirrored, 0.8, 0.8), kRed);
  expect_colour(colour_of(mirrored, 0.2, 0.2), testing::kYellow);
}

TEST(ThreeMfColour, AnImageThatIsNotThereIsANote) {
  const TempFolder folder;
  const TriangleMesh mesh = square(folder, kPictured, "", R"(pid="5" p1="0" p2="1" p3="2")",
                                   R"(pid="5" p1="0" p2="2" p3="3")", R"(<item objectid="9"/>)", false);
  EXPECT_FALSE(mesh.has_colour());
  ASSERT_EQ(mesh.notes.size(), 1U);
  EXPECT_NE(mesh.notes[0].find("a.png"), std::string::npos) << mesh.notes[0];
}

TEST(ThreeMfColour, TilesAsItsStyleSays) {
  const TempFolder folder;
  const auto with = [&](std::string_view style) {
    return square(
        folder,
        std::string(R"(<texture2d id="4" path="/3D/Textures/a.png" tilestyleu=")") + std::string(style) +
            R"("/><texture2dgroup id="5" texid="4"><tex2coord u="1" v="0.75"/><tex2coord u="2" v="0.75"/></texture2dgroup>)",
        R"(pid="5" pindex="0")", R"(p1="0" p2="1" p3="1")", R"(p1="0" p2="1" p3="0")");
  };
  // The first triangle's u runs from 1 at x = 0 to 2 at x = 1.
  expect_colour(colour_of(with("wrap"), 0.25, 0.1), kRed);
  expect_colour(colour_of(with("mirror"), 0.25, 0.1), kGreen);
  expect_colour(colour_of(with("clamp"), 0.75, 0.1), kGreen);
  expect_colour(colour_of(with("mirror"), 0.75, 0.1), kRed);
}

TEST(ThreeMfColour, PlainColoursKeepTheirTriangles) {
  const TempFolder folder;
  for (
      const std::string_view group :
      {R"(<m:colorgroup id="2"><m:color color="#C80A14"/><m:color color="#323CF0FF"/></m:colorgroup>)",
       R"(<basematerials id="2"><base name="a" displaycolor="#C80A14"/><base name="b" displaycolor="#323CF0FF"/></basematerials>)"}) {
    const TriangleMesh mesh = square(folder, group, R"(pid="2" pindex="1")", R"(pid="2" p1="0")", "");
    EXPECT_EQ(mesh.positions.size(), 4U);
    expect_colour(colour_of(mesh, 0.51, 0.5), kRed);
    expect_colour(colour_of(mesh, 0.49, 0.5), kBlue);
  }
  EXPECT_FALSE(square(folder, R"(<basematerials id="2"><base name="a" displaycolor="#808080"/></basematerials>)",
                      R"(pid="2" pindex="0")", "", "")
                   .has_colour());
}

TEST(ThreeMfColour, CornersMayDifferAndSoMayThoseThatMeet) {
  const TempFolder folder;
  const TriangleMesh mesh = square(
      folder,
      R"(<colorgroup id="2"><color color="#FF0000"/><color color="#00FF00"/><color color="#0000FF"/></colorgroup>)", "",
      R"(pid="2" p1="0" p2="1" p3="2")", R"(pid="2" p1="2" p2="2" p3="2")");
  // Corner 0 is red below and blue above the diagonal, so it is there twice; corner 2 is blue for both.
  EXPECT_EQ(mesh.positions.size(), 5U);
  expect_colour(colour_at(mesh, 0, {1, 0, 0}), {255, 0, 0});
  expect_colour(colour_at(mesh, 0, {0.5, 0.5, 0}), {128, 128, 0}, 0.6);
  expect_colour(colour_at(mesh, 1, {1, 0, 0}), {0, 0, 255});
  expect_colour(colour_at(mesh, 1, {0, 1, 0}), {0, 0, 255});
}

TEST(ThreeMfColour, MixturesAreMeansInLinearLight) {
  const TempFolder folder;
  const TriangleMesh mesh = square(
      folder,
      R"(<basematerials id="2"><base displaycolor="#FF0000"/><base displaycolor="#0000FF"/><base displaycolor="#00FF00"/></basematerials>)"
      R"(<compositematerials id="3" matid="2" matindices="0 1"><composite values="1 0"/><composite values="0.5 0.5"/></compositematerials>)",
      R"(pid="3" pindex="0")", "", R"(p1="1")");
  expect_colour(colour_of(mesh, 0.7, 0.2), {255, 0, 0});
  expect_colour(colour_of(mesh, 0.2, 0.7), {188, 0, 188});  // the sRGB code of half the light
}

TEST(ThreeMfColour, LayersAreMixedAndMultiplied) {
  const TempFolder folder;
  const std::string colours =
      R"(<colorgroup id="2"><color color="#FF0000"/><color color="#FFFFFF"/><color color="#00FF0080"/><color color="#808080"/></colorgroup>)";
  const auto multi = [&](std::string_view attributes, std::string_view first, std::string_view second) {
    return square(folder,
                  colours + kPictured + R"(<multiproperties id="7" )" + std::string(attributes) +
                      R"(><multi pindices=")" + std::string(first) + R"("/><multi pindices=")" + std::string(second) +
                      R"("/></multiproperties>)",
                  R"(pid="7" pindex="0")", "", R"(p1="1")");
  };
  // A colour of half cover over red: half the light of each (0x80 covers 128 of 255).
  const TriangleMesh veiled = multi(R"(pids="2 2")", "0 2", "1 0");
  expect_colour(colour_of(veiled, 0.7, 0.2), {187, 188, 0});
  expect_colour(colour_of(veiled, 0.2, 0.7), {255, 0, 0});
  // The image over a colour hides it, or is multiplied with it. The first triangle has one place only: blue, below
  // left.
  expect_colour(colour_of(multi(R"(pids="2 5")", "0 4", "0 4"), 0.7, 0.2), kBlue);
  expect_colour(colour_of(multi(R"(pids="2 5" blendmethods="multiply")", "0 4", "1 4"), 0.7, 0.2), {50, 0, 0});
  expect_colour(colour_of(multi(R"(pids="2 5" blendmethods="multiply")", "0 4", "1 4"), 0.2, 0.7), kBlue);
  // What it names and is not there is passed over.
  expect_colour(colour_of(multi(R"(pids="2 8 2")", "0 3 9", "7"), 0.7, 0.2), {255, 0, 0});
}

TEST(ThreeMfExtensions, OnesThatAreRequiredAreReadOrRefusedByName) {
  const TempFolder folder;
  const auto with = [&](const std::string& attributes) {
    std::string model = square_model("", "", "", "");
    return stored_zip({{"3D/3dmodel.model", model.insert(model.find("unit="), attributes + " ")}});
  };
  const std::string base = "http://schemas.microsoft.com/3dmanufacturing/";
  const std::string known = "xmlns:m=\"" + base + "material/2015/02\" xmlns:p=\"" + base + "production/2015/06\"";
  const std::string lattice = " xmlns:b=\"" + base + "beamlattice/2017/02\"";
  EXPECT_EQ(import_of(folder, "a.3mf", with(known + lattice + " requiredextensions=\"m  p\"")).triangles.size(), 2U);
  for (const auto& [attributes, name] :
       {std::pair{known + lattice + " requiredextensions=\"p b\"", "beamlattice/2017/02"},
        std::pair{std::string("requiredextensions='x'"), "extension x,"}}) {
    const auto refused = import_mesh(folder.put("a.3mf", with(attributes)));
    ASSERT_FALSE(refused.has_value());
    EXPECT_EQ(refused.error().code, Errc::UnsupportedFormat);
    EXPECT_NE(refused.error().message.find(name), std::string::npos) << refused.error().message;
  }
}

TEST(ThreeMfScene, ComponentsStandWhereTheirTransformsSayWithTheirColours) {
  const TempFolder folder;
  std::string model = square_model(
      R"(<colorgroup id="2"><color color="#C80A14"/><color color="#323CF0"/></colorgroup>)", R"(pid="2" pindex="0")",
      "", R"(p1="1")", R"(<item objectid="10" transform="1 0 0 0 1 0 0 0 1 10 0 0"/>)");
  const std::string parts =
      R"(<object id="10"><components><component objectid="9"/><component objectid="9" transform="0 2 0 -2 0 0 0 0 1 5 0 0"/></components></object></resources>)";
  model.replace(model.find("</resources>"), 12, parts);
  const TriangleMesh mesh = import_of(folder, "a.3mf", stored_zip({{"3D/3dmodel.model", model}}));
  ASSERT_EQ(mesh.positions.size(), 8U);
  // The second is turned by 90 degrees and twice as large: (x, y) goes to (15 - 2 y, 2 x).
  EXPECT_EQ(mesh.positions[1], (Vec3d{11, 0, 0}));
  EXPECT_EQ(mesh.positions[5], (Vec3d{15, 2, 0}));
  EXPECT_EQ(mesh.positions[7], (Vec3d{13, 0, 0}));
  expect_colour(colour_of(mesh, 10.7, 0.2), kRed);
  expect_colour(colour_of(mesh, 15 - 2 * 0.2, 2 * 0.7), kRed);
  expect_colour(colour_of(mesh, 15 - 2 * 0.7, 2 * 0.2), kBlue);
}

TEST(ThreeMfNotes, NameWhatAUserWouldMiss) {
  const TempFolder folder;
  EXPECT_EQ(square(folder, "", "", R"(paint_color="8")", "").notes.size(), 1U);
  std::string model = square_model("", "", "", "", R"(<item objectid="9"/><item objectid="11"/>)");
  model.replace(
      model.find("</resources>"), 12,
      R"(<object id="11" type="support"><components><component objectid="9"/></components></object></resources>)");
  const TriangleMesh supported = import_of(folder, "a.3mf", stored_zip({{"3D/3dmodel.model", model}}));
  EXPECT_EQ(supported.triangles.size(), 2U);
  EXPECT_EQ(supported.notes.size(), 1U);
}

TEST(ThreeMfNotes, ImagesThatAreNotUsedAreNamed) {
  const TempFolder folder;
  const auto notes = [&](std::string_view more) {
    const TriangleMesh mesh = square(folder, kPictured + std::string(more), R"(pid="5" pindex="0")", "", "");
    return mesh.notes.empty() ? std::string() : mesh.notes[0];
  };
  EXPECT_EQ(notes(R"(<pbmetallictexturedisplayproperties id="8" metallictextureid="4" roughnesstextureid="4"/>)"),
            "images of its materials other than colour were passed over: metallictextureid, roughnesstextureid");
  EXPECT_EQ(notes(R"(<pbspeculartexturedisplayproperties id="8" speculartextureid="4"/>)"),
            "images of its materials other than colour were passed over: speculartextureid");
  const auto layers = [&](std::string_view veil, std::string_view attributes) {
    return notes(R"(<colorgroup id="2"><color color=")" + std::string(veil) + R"("/></colorgroup>)" +
                 R"(<multiproperties id="7" )" + std::string(attributes) +
                 R"(><multi pindices="0 0"/></multiproperties>)");
  };
  const std::string mixed = "layers over an image could not be mixed with it; only one of them shows";
  EXPECT_EQ(layers("#FF000080", R"(pids="5 2")"), mixed);
  EXPECT_EQ(layers("#FF0000", R"(pids="5 5" blendmethods="multiply")"), mixed);
  // These need no image of their own.
  for (const std::string_view whole : {"#FF0000FF", "#FF000000"}) EXPECT_EQ(layers(whole, R"(pids="5 2")"), "");
  EXPECT_EQ(layers("#FF0000", R"(pids="5 2" blendmethods="multiply")"), "");
  EXPECT_EQ(layers("#FF000080", R"(pids="2 5")"), "");
}

TEST(ThreeMfNotes, ObjectsOutsideTheBuildListAreCounted) {
  const TempFolder folder;
  std::string model = square_model("", "", "", "");
  const std::size_t from = model.find("<object"), to = model.find("</resources>");
  for (const std::string id : {"10", "11"}) {
    std::string other = model.substr(from, to - from);
    model.insert(to, other.replace(other.find("id=\"9\""), 6, "id=\"" + id + "\""));
    EXPECT_EQ(testing::notes_of(folder, "a.3mf", stored_zip({{"3D/3dmodel.model", model}})),
              id == "10" ? "1 object that is not in its build list was left out"
                         : "2 objects that are not in its build list were left out");
  }
}

TEST(ThreeMfData, AnImageOfTwoColours) {
  RELIEF_DATA_FILE(file, "reports/3mf-texture/m.3mf");
  const auto mesh = import_mesh(file);
  ASSERT_TRUE(mesh.has_value()) << mesh.error().message;
  EXPECT_TRUE(mesh->notes.empty());
  EXPECT_EQ(triangles_of_colour(*mesh, {255, 0, 0}), 4512U);
  EXPECT_EQ(triangles_of_colour(*mesh, {0, 0, 255}), 4512U);
}

TEST(ThreeMfDamage, GivesAMeshOrASentence) {
  const TempFolder folder;
  const std::string model = square_model(
      R"(<basematerials id="1"><base displaycolor="#FF0000"/><base displaycolor="#0000FF"/></basematerials>)"
      R"(<compositematerials id="3" matid="1" matindices="0 1"><composite values="0.5 0.5"/></compositematerials>)" +
          kPictured +
          R"(<multiproperties id="7" pids="3 5" blendmethods="multiply"><multi pindices="0 4"/></multiproperties>)",
      R"(pid="5" pindex="0")", R"(pid="7" p1="0")", R"(pid="1" p1="0" p2="1" p3="0")",
      R"(<item objectid="9" transform="1 0 0 0 1 0 0 0 1 10 0 0"/>)");
  testing::expect_it_survives_damage(
      folder, "a.3mf", stored_zip({{"3D/3dmodel.model", model}, {"3D/Textures/a.png", png_bytes(quarters(4))}}));
  // Damage inside the model itself, which the sum of the archive's bytes would give away.
  const std::size_t seeds = std::getenv("RELIEF_SOAK") != nullptr ? 20'000 : 400;
  for (std::size_t seed = 0; seed < seeds; ++seed)
    static_cast<void>(
        testing::survives(folder.put("b.3mf", stored_zip({{"3D/3dmodel.model", testing::damage(model, seed)}}))));
}

}  // namespace
}  // namespace relief
