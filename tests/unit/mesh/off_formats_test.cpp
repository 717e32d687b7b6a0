// The variants of OFF: what the letters before the keyword say, colours, and the binary form.
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

using testing::be;
using testing::colour_of;
using testing::expect_colour;
using testing::import_of;
using testing::le;
using testing::notes_of;
using testing::TempFolder;
using testing::triangles_of_colour;

constexpr Rgba8 kRed = {255, 0, 0}, kGreen = {0, 255, 0}, kBlue = {0, 0, 255};

/// The unit square: four vertices with `behind` each, and two faces with what stands behind their corners.
std::string square_off(std::string_view head, const std::array<std::string, 4>& behind, std::string_view first = "",
                       std::string_view second = "") {
  std::string text(head);
  const std::array<std::string_view, 4> places = {"0 0 0", "1 0 0", "1 1 0", "0 1 0"};
  for (std::size_t k = 0; k < 4; ++k) text += std::string(places[k]) + " " + behind[k] + "\n";
  return text + "3 0 1 2 " + std::string(first) + "\n3 0 2 3 " + std::string(second) + "\n";
}
std::array<std::string, 4> all(std::string_view behind) {
  std::array<std::string, 4> values;
  values.fill(std::string(behind));
  return values;
}

void expect_square(const TriangleMesh& mesh) {
  EXPECT_EQ(mesh.positions, (std::vector<Vec3d>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}));
  EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}));
}

TEST(OffLetters, SayWhatAVertexHasInWhateverOrderTheyStand) {
  const TempFolder folder;
  struct Case {
    std::string_view keyword, behind;
    bool coloured;
  };
  for (const auto& [keyword, behind, coloured] :
       {Case{"OFF", "", false}, Case{"COFF", "0 255 0", true}, Case{"COFF", "0.0 1.0 0.0 0.5", true},
        Case{"NOFF", "0 0 1", false}, Case{"CNOFF", "0 0 1 0 255 0 255", true}, Case{"NCOFF", "0 0 1 0 1 0 1", true},
        Case{"STOFF", "0.5 0.5", false}, Case{"STCNOFF", "0 0 1 0 255 0 255 0.5 0.5", true},
        Case{"CSTOFF", "0 255 0 0.5 0.5", true}, Case{"NSTOFF", "0 0 1 0.5 0.5", false}, Case{"4OFF", "1", false},
        Case{"C4OFF", "1 0 255 0", true}, Case{"4NOFF", "1 0 0 1", false}}) {
    const TriangleMesh mesh = import_of(folder, "a.off", square_off(std::string(keyword) + "\n4 2 0\n", all(behind)));
    SCOPED_TRACE(std::string(keyword) + " " + std::string(behind));
    expect_square(mesh);
    EXPECT_EQ(mesh.has_colour(), coloured);
    if (coloured) expect_colour(colour_of(mesh, 0.7, 0.2), kGreen);
    EXPECT_EQ(mesh.notes.size(), keyword.contains("ST") && !coloured ? 1U : 0U);
  }
}

TEST(OffLetters, AFourthCoordinateDividesTheOthers) {
  const TempFolder folder;
  const TriangleMesh mesh = import_of(folder, "a.off", "4OFF\n3 1 0\n0 0 0 1\n2 0 0 2\n0 4 8 -4\n3 0 1 2\n");
  EXPECT_EQ(mesh.positions, (std::vector<Vec3d>{{0, 0, 0}, {1, 0, 0}, {0, -1, -2}}));
}

TEST(OffLetters, TheNumberOfDimensionsStandsBeforeTheCounts) {
  const TempFolder folder;
  expect_square(import_of(folder, "a.off", square_off("nOFF\n3\n4 2 0\n", {})));
  expect_square(import_of(folder, "a.off", square_off("4nOFF 3 4 2 0\n", all("1"))));
  EXPECT_EQ(import_of(folder, "a.off", "nOFF 2\n3 1 0\n0 0\n1 0\n0 1\n3 0 1 2\n").positions[2], (Vec3d{0, 1, 0}));
  const auto refused = import_mesh(folder.put("b.off", "nOFF 5\n3 1 0\n0 0 0 0 0\n1 0 0 0 0\n0 1 0 0 0\n3 0 1 2\n"));
  ASSERT_FALSE(refused.has_value());
  testing::expect_sentence(refused.error().message, "b.off");
  EXPECT_NE(refused.error().message.find("5 dimensions"), std::string::npos);
}

TEST(OffText, CountsMayStandOnTheFirstLineAndCommentsAnywhere) {
  const TempFolder folder;
  expect_square(import_of(folder, "a.off", square_off("# made by hand\n\nOFF 4 2 5\n", {})));
  expect_square(
      import_of(folder, "a.off",
                square_off("OFF # the keyword\n#\n4 # vertices\n2 # faces\n0\n# now they come\n", all("# one"))));
  expect_square(import_of(folder, "a.off", square_off("4 2 0\n", {})));
}

TEST(OffColour, StandsBehindVerticesOfPlainFilesToo) {
  const TempFolder folder;
  const TriangleMesh mesh = import_of(folder, "a.off", square_off("OFF\n4 2 0\n", all("0 0 255 255")));
  expect_square(mesh);
  expect_colour(colour_of(mesh, 0.5, 0.4), kBlue);
  expect_colour(colour_of(import_of(folder, "a.off", square_off("OFF\n4 2 0\n", all("0 0.5 0.25"))), 0.5, 0.4),
                {0, 128, 64});
  // Directions of length one and values that no colour has are something else.
  EXPECT_FALSE(import_of(folder, "a.off", square_off("OFF\n4 2 0\n", all("0 0.6 0.8"))).has_colour());
  EXPECT_FALSE(import_of(folder, "a.off", square_off("OFF\n4 2 0\n", all("0 -0.5 0.8"))).has_colour());
  EXPECT_FALSE(import_of(folder, "a.off", square_off("OFF\n4 2 0\n", all("7"))).has_colour());
}

TEST(OffColour, StandsBehindFaces) {
  const TempFolder folder;
  for (const auto& [first, second] : std::vector<std::pair<std::string, std::string>>{{"255 0 0", "0 0 255"},
                                                                                      {"1.0 0.0 0.0", "0 0 1"},
                                                                                      {"255 0 0 128", "0 0 255 255"},
                                                                                      {"1 0 0 0.5", "0 0 1 1"}}) {
    const TriangleMesh mesh = import_of(folder, "a.off", square_off("OFF\n4 2 0\n", {}, first, second));
    expect_colour(colour_of(mesh, 0.7, 0.2), kRed);
    expect_colour(colour_of(mesh, 0.2, 0.7), kBlue);
    EXPECT_TRUE(mesh.notes.empty());
  }
  const TriangleMesh mapped = import_of(folder, "a.off", square_off("OFF\n4 2 0\n", {}, "3", "7"));
  EXPECT_FALSE(mapped.has_colour());
  ASSERT_EQ(mapped.notes.size(), 1U);
  EXPECT_NE(mapped.notes[0].find("colour map"), std::string::npos);
  // White on every face is no colour.
  EXPECT_FALSE(import_of(folder, "a.off", square_off("OFF\n4 2 0\n", {}, "255 255 255", "255 255 255")).has_colour());
}

/// The square with a colour at each vertex and behind each face, all numbers in one byte order.
std::string binary_off(bool big, bool normals, bool counts_colours) {
  const auto number = [&](auto value) { return big ? be(value) : le(value); };
  std::string bytes = normals ? "CNOFF BINARY\n" : "COFF BINARY\n";
  for (const std::uint32_t count : {4U, 2U, 0U}) bytes += number(count);
  for (const auto& [x, y] : {std::pair{0.0F, 0.0F}, {1.0F, 0.0F}, {1.0F, 1.0F}, {0.0F, 1.0F}}) {
    for (const float value : {x, y, 0.0F}) bytes += number(value);
    if (normals)
      for (const float value : {0.0F, 0.0F, 1.0F}) bytes += number(value);
    for (const float value : {0.0F, x, 1.0F - x, 1.0F}) bytes += number(value);
  }
  for (const auto& corners : {std::array{0U, 1U, 2U}, std::array{0U, 2U, 3U}}) {
    bytes += number(3U);
    for (const std::uint32_t corner : corners) bytes += number(corner);
    if (counts_colours) bytes += number(0U);
  }
  return bytes;
}

TEST(OffBinary, BothByteOrdersWithNormalsAndColours) {
  const TempFolder folder;
  for (const bool big : {true, false}) {
    for (const bool normals : {true, false}) {
      for (const bool counts_colours : {true, false}) {
        const TriangleMesh mesh = import_of(folder, "a.off", binary_off(big, normals, counts_colours));
        expect_square(mesh);
        expect_colour(colour_of(mesh, 0.001, 0.0005), kBlue, 1);
        expect_colour(colour_of(mesh, 0.999, 0.5), kGreen, 1);
      }
    }
  }
  const auto cut = import_mesh(folder.put("a.off", binary_off(true, true, true).substr(0, 150)));
  ASSERT_FALSE(cut.has_value());
  testing::expect_sentence(cut.error().message, "a.off");
}

TEST(OffBinary, FacesHaveColoursOfTheirOwn) {
  const TempFolder folder;
  std::string bytes = "OFF BINARY\n" + be(4U) + be(2U) + be(0U);
  for (const float value : {0.0F, 0.0F, 0.0F, 1.0F, 0.0F, 0.0F, 1.0F, 1.0F, 0.0F, 0.0F, 1.0F, 0.0F}) bytes += be(value);
  bytes += be(3U) + be(0U) + be(1U) + be(2U) + be(3U) + be(1.0F) + be(0.0F) + be(0.0F);
  bytes += be(3U) + be(0U) + be(2U) + be(3U) + be(4U) + be(0.0F) + be(0.0F) + be(1.0F) + be(1.0F);
  const TriangleMesh mesh = import_of(folder, "a.off", bytes);
  expect_square(mesh);
  expect_colour(colour_of(mesh, 0.7, 0.2), kRed);
  expect_colour(colour_of(mesh, 0.2, 0.7), kBlue);
}

constexpr std::string_view kVertices = "values of its vertices that have no use here were passed over";
constexpr std::string_view kFaces = "values of its faces that have no use here were passed over";

TEST(OffNotes, NameValuesThatHaveNoUse) {
  const TempFolder folder;
  const auto notes = [&](std::string_view head, const std::array<std::string, 4>& behind, std::string_view face = "") {
    return notes_of(folder, "a.off", square_off(head, behind, face));
  };
  for (const std::string_view rest : {"7", "7 8", "0 -0.5 0.8", "1 2 3 4 5", "1 2 3 4 5 6 7", "red"})
    EXPECT_EQ(notes("OFF\n4 2 0\n", all(rest)), kVertices) << rest;
  EXPECT_EQ(notes("NOFF\n4 2 0\n", all("0 0 1 255 0 0")), kVertices);
  EXPECT_EQ(notes("COFF\n4 2 0\n", all("255 0 0 255 9")), kVertices);
  for (const std::string_view rest : {"7 8", "1 2 3 4 5", "1 2 3 4 5 6 7", "red"})
    EXPECT_EQ(notes("OFF\n4 2 0\n", {}, rest), kFaces) << rest;
  // Normals follow from the faces, and comments hold nothing.
  EXPECT_EQ(notes("OFF\n4 2 0\n", all("0 -0.6 0.8")), "");
  EXPECT_EQ(notes("NOFF\n4 2 0\n", all("0 0 1")), "");
  EXPECT_EQ(notes("4nOFF 3\n4 2 0\n", all("1 # seven")), "");
}

TEST(OffNotes, SurplusIsCountedAndLinesAreNamed) {
  const TempFolder folder;
  const std::string text = square_off("OFF\n4 2 0\n", {}), binary = binary_off(true, false, true);
  EXPECT_EQ(notes_of(folder, "a.off", text + "\n3 0 1 3\n"),
            "it holds 7 bytes more than it declares, which were passed over");
  EXPECT_EQ(notes_of(folder, "a.off", binary + "7"), "it holds 1 byte more than it declares, which was passed over");
  for (const std::string& whole : {text, text + "\n# 3 0 1 3\n", binary, binary + "\n"})
    EXPECT_EQ(notes_of(folder, "a.off", whole), "") << whole;
  EXPECT_EQ(notes_of(folder, "a.off", "OFF 3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n2 0 1\n"),
            "points or lines were passed over; only faces are read");
}

TEST(OffData, VertexColoursOfAPlainFile) {
  RELIEF_DATA_FILE(file, "reports/face-colours/vertex_colour_plain.off");
  const auto mesh = import_mesh(file);
  ASSERT_TRUE(mesh.has_value()) << mesh.error().message;
  EXPECT_EQ(mesh->triangles.size(), 9024U);
  const std::size_t red = triangles_of_colour(*mesh, kRed), blue = triangles_of_colour(*mesh, kBlue);
  EXPECT_GT(red, 4000U);
  EXPECT_GT(blue, 4000U);
}

TEST(OffDamage, GivesAMeshOrASentence) {
  const TempFolder folder;
  testing::expect_it_survives_damage(
      folder, "t.off", square_off("4STCNOFF\n4 2 0\n", all("1 0 0 1 0 255 0 255 0.5 0.5"), "255 0 0", "3"));
  testing::expect_it_survives_damage(folder, "p.off", square_off("nOFF 3\n4 2 0\n", all("0 0 255"), "1 0 0", "0 0 1"));
  testing::expect_it_survives_damage(folder, "b.off", binary_off(true, true, true));
}

}  // namespace
}  // namespace relief
