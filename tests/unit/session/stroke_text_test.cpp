// Strokes as text: bit for bit there and back, and each problem with its place.
#include "relief/session/stroke_text.h"

#include <relief/base/nearest_word.h>

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <random>
#include <string>

namespace relief {
namespace {

Stroke full() {
  Stroke stroke;
  Brush& b = stroke.brush;
  b = {.tool = Tool::Layer, .radius = 0.1 + 0.2, .strength = 1.0 / 3, .colour = {0.1F, 0.7F, 1.0F / 3}};
  b.resilience = 1e-7;
  b.height = -0.3;
  b.falloff = Falloff::Dome;
  b.exact = true;
  b.pressure = {.low = 0.1, .high = 0.9, .exponent = 2.2};
  b.pressure_drives = PressureDrives::Both;
  b.stabiliser = 0.7;
  b.symmetry = 5;
  b.mirror = {1e300, -0.1, 5e-324};
  stroke.label = "Zwölf \"Striche\"\n";
  stroke.tip = true;
  stroke.points = {{0, {0.1, -0.2, 1e-17}, 0.3}, {0.25, {0.1 + 0.2, 5e-324, -1e-300}, 1}};
  return stroke;
}

void expect_same(const Stroke& a, const Stroke& b) {
  EXPECT_EQ(a.brush, b.brush);
  EXPECT_EQ(a.label, b.label);
  EXPECT_EQ(a.tip, b.tip);
  EXPECT_EQ(a.points, b.points);
}

TEST(StrokeText, ComesBackBitForBit) {
  Stroke plain;
  plain.points = {{0, {1, 2, 3}, 1}};
  for (const Stroke& stroke : {full(), plain}) {
    const auto back = stroke_of(text_of(stroke), "it");
    ASSERT_TRUE(back) << back.error().message;
    expect_same(*back, stroke);
  }
  // What has its default is left out.
  EXPECT_EQ(text_of(plain), R"({"tool":"carve","radius":1.0,"points":[[0.0,1.0,2.0,3.0,1.0]]})");
}

TEST(StrokeText, AnyNumbersComeBackBitForBit) {
  std::mt19937_64 random(7);
  const auto real = [&] {
    double x = 0;
    do {
      const std::uint64_t bits = random();
      std::memcpy(&x, &bits, sizeof x);
    } while (!std::isfinite(x));
    return x;
  };
  const auto share = [&] { return static_cast<double>(random() >> 11U) * 0x1p-53; };
  for (int k = 0; k < 500; ++k) {
    Stroke stroke;
    Brush& b = stroke.brush;
    b.tool = static_cast<Tool>(random() % tools().size());
    b.radius = 1e3 * share() + 1e-3;
    b.strength = share();
    b.colour = to_float(Vec3d{share(), share(), share()});
    b.resilience = share();
    b.height = real();
    b.stabiliser = share();
    b.symmetry = static_cast<std::uint8_t>(random() % 8);
    b.mirror = {real(), real(), real()};
    for (int i = 0; i < 4; ++i)
      stroke.points.push_back({i + share(), {share() - 0.5, share() - 0.5, share() - 0.5}, share()});
    const auto back = stroke_of(text_of(stroke), "it");
    ASSERT_TRUE(back) << back.error().message;
    expect_same(*back, stroke);
  }
}

TEST(StrokeText, EveryToolHasItsName) {
  for (std::size_t k = 0; k < tools().size(); ++k) {
    Stroke stroke;
    stroke.brush.tool = static_cast<Tool>(k);
    stroke.points = {{0, {}, 1}};
    const auto back = stroke_of(text_of(stroke), "it");
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(back->brush.tool, stroke.brush.tool);
  }
}

TEST(StrokeText, ProblemsNameTheStrokeAndTheField) {
  const std::string points = R"("points":[[0,0,0,1,1]])";
  const std::string good = R"({"tool":"carve","radius":1,)" + points + "}";
  const struct {
    std::string text;
    std::array<const char*, 2> said;
  } cases[] = {
      {"3", {"list", ""}},
      {"[3]", {"stroke 1", "no object"}},
      {"[" + good + R"(,{"radius":1}])", {"stroke 2", "needs a \"tool\", one of carve"}},
      {R"([{"tool":"crave","radius":1}])", {"; the nearest is carve", "known are carve, deposit"}},
      {R"([{"tool":"carve","radios":1}])",
       {"unknown field \"radios\"; the nearest is radius", "known are tool, radius"}},
      {R"([{"tool":"carve",)" + points + "}]", {"needs a \"radius\"", ""}},
      {R"([{"tool":"carve","radius":"2"}])", {"\"radius\" that is not a number", ""}},
      {R"([{"tool":"carve","radius":-2,)" + points + "}]", {"radius", "-2"}},
      {R"([{"tool":"paint","radius":1,)" + points + "}]", {"\"colour\"", "three numbers"}},
      {R"([{"tool":"paint","radius":1,"colour":[1,2,256]}])", {"\"colour\"", "outside"}},
      {R"([{"tool":"carve","radius":1,"points":[[0,0,0,1]]}])", {"point 1", "five numbers"}},
      {R"([{"tool":"carve","radius":1,"points":[]}])", {"needs \"points\"", ""}},
      {R"([{"tool":"carve","radius":1,"symmetry":"xx"}])", {"\"symmetry\" \"xx\"", "axes"}},
      {R"([{"tool":"carve","radius":1,"symmetry":"w"}])", {"\"symmetry\" \"w\"", "axes"}},
      {R"([{"tool":"carve","radius":1,"mirror":[1,2]}])", {"\"mirror\"", "three numbers"}},
      {R"([{"tool":"carve","radius":1,"falloff":"cubic"}])", {"\"falloff\" \"cubic\"", "known are"}},
      {R"([{"tool":"carve","radius":1,"exact":1}])", {"\"exact\"", "true or false"}},
      {R"([{"tool":"carve","radius":1,"pressure_curve":3}])", {"\"pressure_curve\"", "object"}},
      {R"([{"tool":"carve","radius":1,"pressure_curve":{"hi":1}}])", {"\"hi\"", "known are low, high, exponent"}},
      {R"([{"tool":"carve","radius":1,"pressure_curve":{"low":1,"high":0},)" + points + "}]", {"pressure curve", ""}},
      {R"([{"tool":"carve","radius":1,"pressure_drives":"size"}])",
       {"\"pressure_drives\" \"size\"", "known are strength, radius, both"}},
      {R"([{"tool":"carve","radius":1,"pressure_drives":2}])", {"\"pressure_drives\"", "no text"}},
      {R"([{"tool":"carve","radius":1,"label":3}])", {"\"label\"", "no text"}},
      {"[", {"line 1, column 2: not JSON", ""}},
      {R"([{"tool":"carve","radius":1e999}])", {"a number is too large", ""}},
  };
  for (const auto& bad : cases) {
    const auto read = strokes_of(bad.text, "a.json");
    ASSERT_FALSE(read) << bad.text;
    EXPECT_EQ(read.error().code, Errc::Corrupt);
    EXPECT_EQ(read.error().message.find("a.json"), 0U) << read.error().message;
    for (const char* said : bad.said)
      EXPECT_NE(read.error().message.find(said), std::string::npos) << said << " in: " << read.error().message;
  }
  EXPECT_TRUE(strokes_of("[" + good + "]", "a.json"));
}

TEST(NearestWord, IsTheOneThatWasMeantOrNone) {
  constexpr std::array<std::string_view, 4> words = {"carve", "paint", "smooth", "at"};
  EXPECT_EQ(detail::nearest_word("carv", words), "carve");
  EXPECT_EQ(detail::nearest_word("crave", words), "carve");
  EXPECT_EQ(detail::nearest_word("smoth", words), "smooth");
  EXPECT_EQ(detail::nearest_word("xaint", words), "paint");
  EXPECT_EQ(detail::nearest_word("plaster", words), "");
  EXPECT_EQ(detail::nearest_word("", words), "");
  EXPECT_EQ(detail::nearest_word(std::string(1000, 'a'), words), "");
}

}  // namespace
}  // namespace relief
