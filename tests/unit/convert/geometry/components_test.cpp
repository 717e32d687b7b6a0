#include <relief/convert/geometry/components.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace relief::detail {
namespace {

bool share_a_point(const Face& f, const Face& g) {
  return std::ranges::any_of(f, [&](std::uint32_t v) { return std::ranges::find(g, v) != g.end(); });
}

TEST(Components, AreWhatASearchFromFaceToFaceFinds) {
  std::mt19937 engine(5);
  const auto random = [&] { return static_cast<std::uint32_t>(engine()); };
  for (int round = 0; round < 40; ++round) {
    const std::uint32_t points = 20 + random() % 60;
    std::vector<Face> faces(1 + random() % 40);
    for (Face& f : faces)
      for (std::uint32_t& v : f) v = random() % points;
    for (std::size_t f = 0; f < faces.size(); ++f)
      if (random() % 8 == 0) faces[f] = {kNone, kNone, kNone};  // gone
    const Components found = find_components(points, faces);
    std::vector<std::uint32_t> number(faces.size(), kNone);
    std::uint32_t count = 0;
    for (std::size_t f = 0; f < faces.size(); ++f) {
      if (faces[f][0] == kNone || number[f] != kNone) continue;
      number[f] = count;
      for (bool grows = true; grows;) {
        grows = false;
        for (std::size_t g = 0; g < faces.size(); ++g)
          for (std::size_t h = 0; h < faces.size(); ++h)
            if (number[g] == count && number[h] == kNone && faces[h][0] != kNone && share_a_point(faces[g], faces[h]))
              number[h] = count, grows = true;
      }
      ++count;
    }
    EXPECT_EQ(found.count, count);
    for (std::size_t f = 0; f < faces.size(); ++f) EXPECT_EQ(found.of_face[f], number[f] == kNone ? 0 : number[f]) << f;
  }
}

}  // namespace
}  // namespace relief::detail
