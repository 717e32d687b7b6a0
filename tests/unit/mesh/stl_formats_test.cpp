// The dialects of STL: colours in the spare bits, counts that are wrong, and text as programs write it.
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
using testing::import_of;
using testing::le;
using testing::notes_of;
using testing::TempFolder;
using testing::triangles_of_colour;

constexpr Rgba8 kRed = {255, 0, 0}, kBlue = {0, 0, 255};
constexpr std::uint16_t kOwn = 0x8000, kLowest = 31, kHighest = 31 << 10;

/// The unit square as two facets, with the 16 bits behind each; `count` is what the header declares.
std::string square_stl(std::string head, std::uint16_t first, std::uint16_t second, std::uint32_t count = 2) {
  head.resize(80);
  std::string bytes = head + le(count);
  const auto facet = [&](const std::array<float, 9>& corners, std::uint16_t bits) {
    for (const float value : {0.0F, 0.0F, 1.0F}) bytes += le(value);
    for (const float value : corners) bytes += le(value);
    bytes += le(bits);
  };
  facet({0, 0, 0, 1, 0, 0, 1, 1, 0}, first);
  facet({0, 0, 0, 1, 1, 0, 0, 1, 0}, second);
  return bytes;
}

TEST(StlColour, BitFifteenMarksAColourWithBlueLowest) {
  const TempFolder folder;
  const TriangleMesh mesh = import_of(folder, "a.stl", square_stl("", kOwn | kHighest, kOwn | kLowest));
  expect_colour(colour_of(mesh, 0.7, 0.2), kRed);
  expect_colour(colour_of(mesh, 0.2, 0.7), kBlue);
  EXPECT_TRUE(mesh.notes.empty());
  // 16 of 31 is 131.6 of 255.
  const TriangleMesh half = import_of(folder, "a.stl", square_stl("", kOwn | 16 << 5, 0));
  expect_colour(colour_of(half, 0.7, 0.2), {0, 132, 0});
  expect_colour(colour_of(half, 0.2, 0.7), {255, 255, 255});
  // Without the mark the bits are something else.
  EXPECT_FALSE(import_of(folder, "a.stl", square_stl("", kHighest, kLowest)).has_colour());
}

TEST(StlColour, MagicsNamesAColourInTheHeaderAndHasRedLowest) {
  const TempFolder folder;
  const std::string head = "COLOR=\x28\x50\xa0\xff,MATERIAL=";
  const TriangleMesh mesh = import_of(folder, "a.stl", square_stl(head, kLowest, kHighest));
  expect_colour(colour_of(mesh, 0.7, 0.2), kRed);
  expect_colour(colour_of(mesh, 0.2, 0.7), kBlue);
  const TriangleMesh general = import_of(folder, "a.stl", square_stl(head, kOwn | kLowest, kLowest));
  expect_colour(colour_of(general, 0.7, 0.2), {40, 80, 160});
  expect_colour(colour_of(general, 0.2, 0.7), kRed);
  // No facet says anything: all have the general colour, unless it is the grey of those who have none.
  expect_colour(colour_of(import_of(folder, "a.stl", square_stl(head, 0, 0)), 0.7, 0.2), {40, 80, 160});
  EXPECT_FALSE(import_of(folder, "a.stl", square_stl("COLOR=\x80\x80\x80\xff", 0, 0)).has_colour());
}

TEST(StlCount, TheSizeRulesAndANoteSaysSo) {
  const TempFolder folder;
  for (const std::uint32_t count : {0U, 1U, 3U, 0xffffffffU}) {
    for (const std::string head : {"", "solid made by a program that writes binary"}) {
      const TriangleMesh mesh = import_of(folder, "a.stl", square_stl(head, 0, 0, count));
      EXPECT_EQ(mesh.triangles.size(), 2U);
      ASSERT_EQ(mesh.notes.size(), 1U);
      EXPECT_NE(mesh.notes[0].find(std::string("declares ") + std::to_string(count)), std::string::npos)
          << mesh.notes[0];
    }
  }
  // Whole facets, and something else behind them: what is declared is read.
  const TriangleMesh more = import_of(folder, "a.stl", square_stl("", 0, 0) + std::string(60, 's'));
  EXPECT_EQ(more.triangles.size(), 2U);
  EXPECT_EQ(more.notes.size(), 1U);
  // Less than a facet behind the last one, which the count does not show.
  const TriangleMesh little = import_of(folder, "a.stl", square_stl("", 0, 0) + std::string(7, 's'));
  EXPECT_EQ(little.triangles.size(), 2U);
  ASSERT_EQ(little.notes.size(), 1U);
  EXPECT_EQ(little.notes[0], "it holds 2 triangles as a binary STL, and 7 bytes more, which were passed over");
  // Inside a facet the file is cut off.
  const auto cut = import_mesh(folder.put("a.stl", square_stl("", 0, 0).substr(0, 170)));
  ASSERT_FALSE(cut.has_value());
  testing::expect_sentence(cut.error().message, "a.stl");
  EXPECT_NE(cut.error().message.find("cut off"), std::string::npos);
  // Text of the very size of one facet is no facet.
  EXPECT_FALSE(import_mesh(folder.put("a.stl", std::string(134, 'x'))).has_value());
}

const std::string kFacet = "facet normal 0 0 1 outer loop vertex 0 0 0 vertex 1 0 0 vertex 1 1 0 endloop endfacet ";
const std::string kOther = "facet normal 0 0 1 outer loop vertex 0 0 0 vertex 1 1 0 vertex 0 1 0 endloop endfacet ";

std::string upper(std::string text) {
  for (char& c : text) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return text;
}
/// With one piece of text for another, everywhere.
std::string with(std::string_view text, std::string_view from, std::string_view to) {
  std::string out;
  for (std::size_t at = 0; at < text.size();) {
    const bool here = text.substr(at).starts_with(from);
    out += here ? to : text.substr(at, 1);
    at += here ? from.size() : 1;
  }
  return out;
}

TEST(StlText, IsReadAsProgramsWriteIt) {
  const TempFolder folder;
  const std::string body = kFacet + kOther;
  const std::vector<std::string> texts = {
      "solid ball " + body + "endsolid ball",
      upper("solid ball " + body + "endsolid ball"),
      with("solid ball\n" + body + "endsolid ball\n", " ", "\n"),
      std::string("solid outer vertex\n") + with(with(body, "endloop", "end loop\n"), "endfacet", "end facet\n") +
          "end solid outer vertex",
      std::string("solid\r\n") + with(body, "endloop", "endloop of a facet\r\n") + "endsolid\r\n",
      "solid a " + kFacet + "endsolid a solid b of two words " + kOther + "endsolid b",
      "solid a\n" + kFacet + "\nendsolid solid a\nsolid #2\n" + kOther + "\nend\n",
      std::string("  solid x\n\n") + with(body, "endfacet", "") + "endsolid",
      body};
  for (const std::string& text : texts) {
    const TriangleMesh mesh = import_of(folder, "a.stl", text);
    EXPECT_EQ(mesh.positions, (std::vector<Vec3d>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 0, 0}, {1, 1, 0}, {0, 1, 0}}))
        << text;
    EXPECT_TRUE(mesh.notes.empty()) << text;
  }
}

TEST(StlText, AMissingEndIsANoteAndACutFacetIsRefused) {
  const TempFolder folder;
  const std::string text = "solid ball\n" + kFacet + "\n" + kOther;
  const TriangleMesh mesh = import_of(folder, "a.stl", text);
  EXPECT_EQ(mesh.triangles.size(), 2U);
  ASSERT_EQ(mesh.notes.size(), 1U);
  EXPECT_NE(mesh.notes[0].find("endsolid"), std::string::npos) << mesh.notes[0];
  for (const std::string_view last :
       {"normal 0 0 1 outer loop vertex 0 0 0", "normal", "outer loop", "outer loop vertex 0 0"}) {
    const auto cut = import_mesh(folder.put("a.stl", "solid ball\n" + kFacet + "\nfacet " + std::string(last)));
    ASSERT_FALSE(cut.has_value()) << last;
    testing::expect_sentence(cut.error().message, "a.stl");
  }
}

TEST(StlNotes, NameWhatMayBeColours) {
  const TempFolder folder;
  EXPECT_EQ(notes_of(folder, "a.stl", square_stl("", kHighest, kLowest)),
            "values of its facets that are no colours were passed over");
  // What is the same in all fills the place; where some are marked as colours, the others have none.
  for (const auto& [first, second] : {std::pair{0, 0}, {0x2020, 0x2020}, {kOwn | kHighest, kLowest + 0}})
    EXPECT_EQ(notes_of(folder, "a.stl",
                       square_stl("", static_cast<std::uint16_t>(first), static_cast<std::uint16_t>(second))),
              "");
  EXPECT_EQ(notes_of(folder, "a.stl", square_stl("COLOR=\x28\x50\xa0\xff", kHighest, kLowest)), "");
  const std::string whole = "solid color\n" + kFacet + kOther + "endsolid color\n";
  EXPECT_EQ(notes_of(folder, "a.stl", whole), "");
  EXPECT_EQ(notes_of(folder, "a.stl", with(whole, "endloop", "endloop\ncolor 1 0 0\n")),
            "colours between its facets (color) are not part of STL and were passed over");
}

TEST(StlData, ColoursCountsAndText) {
  RELIEF_DATA_FILE(reports, "reports");
  const auto coloured = import_mesh(reports / "stl-colour/magics.stl");
  ASSERT_TRUE(coloured.has_value()) << coloured.error().message;
  EXPECT_EQ(triangles_of_colour(*coloured, kRed), 4512U);
  EXPECT_EQ(triangles_of_colour(*coloured, kBlue), 4512U);
  for (const std::string_view name : {"stl-count/count_low.stl", "stl-count/count_zero.stl"}) {
    const auto mesh = import_mesh(reports / name);
    ASSERT_TRUE(mesh.has_value()) << mesh.error().message;
    EXPECT_EQ(mesh->triangles.size(), 9024U) << name;
    EXPECT_EQ(mesh->notes.size(), 1U) << name;
  }
  for (const std::string_view name : {"stl-text/end_words.stl", "stl-text/no_endsolid.stl", "stl-text/one_line.stl"}) {
    const auto mesh = import_mesh(reports / name);
    ASSERT_TRUE(mesh.has_value()) << mesh.error().message;
    EXPECT_EQ(mesh->triangles.size(), 224U) << name;
  }
}

TEST(StlDamage, GivesAMeshOrASentence) {
  const TempFolder folder;
  testing::expect_it_survives_damage(folder, "m.stl", square_stl("COLOR=\x28\x50\xa0\xff", kLowest, kOwn));
  testing::expect_it_survives_damage(folder, "v.stl", square_stl("solid", kOwn | kLowest, kOwn | kHighest, 7));
  testing::expect_it_survives_damage(folder, "t.stl",
                                     "solid a " + kFacet + "endsolid a solid b " + kOther + "end solid b");
}

}  // namespace
}  // namespace relief
