// What the demo, the documents and other tests rely on when they use a sample model.
#include <relief/base/hash.h>
#include <relief/mesh/samples.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace relief {
namespace {

TriangleMesh sample(std::string_view name, std::size_t triangles) {
  auto mesh = make_sample(name, triangles);
  EXPECT_TRUE(mesh) << mesh.error().message;
  return mesh ? *std::move(mesh) : TriangleMesh{};
}

struct Topology {
  bool closed_and_oriented = true;  ///< every edge runs once each way
  bool one_fan_per_vertex = true;
  std::int64_t euler = 0;
};

Topology topology(const TriangleMesh& mesh) {
  Topology found;
  const std::size_t vertices = mesh.positions.size();
  std::vector<std::uint64_t> edges;
  std::vector<std::uint32_t> degree(vertices, 0);
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> next;  // (centre, from) -> to, around a vertex
  for (const Triangle& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3], c = t[(k + 2) % 3];
      edges.push_back((std::uint64_t{a} << 32U) | b);
      ++degree.at(a);
      next[{a, b}] = c;
    }
  std::ranges::sort(edges);
  if (std::ranges::adjacent_find(edges) != edges.end()) found.closed_and_oriented = false;
  for (const std::uint64_t e : edges)
    if (!std::ranges::binary_search(edges, std::rotl(e, 32))) found.closed_and_oriented = false;
  for (auto at = next.begin(); at != next.end();) {
    const auto [centre, first] = at->first;
    std::uint32_t steps = 0, here = first;
    do {
      const auto step = next.find({centre, here});
      if (step == next.end()) break;
      here = step->second;
      ++steps;
    } while (here != first && steps <= degree[centre]);
    if (steps != degree[centre]) found.one_fan_per_vertex = false;
    while (at != next.end() && at->first.first == centre) ++at;
  }
  found.euler = static_cast<std::int64_t>(vertices) - static_cast<std::int64_t>(edges.size() / 2) +
                static_cast<std::int64_t>(mesh.triangles.size());
  return found;
}

/// 1 for an equilateral triangle, 0 for one without area.
double quality(const TriangleMesh& mesh, const Triangle& t) {
  const Vec3d a = mesh.positions[t[0]], b = mesh.positions[t[1]], c = mesh.positions[t[2]];
  return 2.0 * std::sqrt(3.0) * length(cross(b - a, c - a)) /
         (dot(b - a, b - a) + dot(c - b, c - b) + dot(a - c, a - c));
}

double volume(const TriangleMesh& mesh) {
  double six = 0.0;
  for (const Triangle& t : mesh.triangles)
    six += dot(mesh.positions[t[0]], cross(mesh.positions[t[1]], mesh.positions[t[2]]));
  return six / 6.0;
}

Box3d box_of(const TriangleMesh& mesh) {
  Box3d box;
  for (const Vec3d p : mesh.positions) box.add(p);
  return box;
}

std::uint64_t content(const TriangleMesh& mesh) {
  Hash64 hash;
  hash.add_values(std::span<const Vec3d>(mesh.positions));
  hash.add_values(std::span<const Triangle>(mesh.triangles));
  hash.add_values(std::span<const Rgba8>(mesh.colours));
  return hash.value();
}

class Samples : public ::testing::TestWithParam<std::string_view> {};

TEST_P(Samples, AreClosedOrientedManifoldsOfTheRightGenus) {
  for (const std::size_t wish : {1'000U, 20'000U}) {
    const TriangleMesh mesh = sample(GetParam(), wish);
    const Topology found = topology(mesh);
    EXPECT_TRUE(found.closed_and_oriented) << wish;
    EXPECT_TRUE(found.one_fan_per_vertex) << wish;
    EXPECT_EQ(found.euler, GetParam() == "torus" ? 0 : 2) << wish;
    EXPECT_GT(volume(mesh), 1e5) << wish;
    EXPECT_EQ(mesh.colours.size(), mesh.positions.size());
  }
}

TEST_P(Samples, HaveTheTrianglesAskedForWithinTwoPercent) {
  for (const std::size_t wish : {1'000U, 1'001U, 1'090U, 1'333U, 2'500U, 7'777U, 50'000U}) {
    const auto got = static_cast<double>(sample(GetParam(), wish).triangles.size());
    EXPECT_NEAR(got, double(wish), 0.02 * double(wish));
  }
}

TEST_P(Samples, StandOnTheGroundAHundredTallAndCentred) {
  const Box3d box = box_of(sample(GetParam(), 20'000));
  EXPECT_NEAR(box.low.y, 0.0, 1e-9);
  EXPECT_NEAR(box.high.y, 100.0, 1e-9);
  EXPECT_LT(std::abs(box.centre().x), 5.0);
  EXPECT_LT(std::abs(box.centre().z), 5.0);
}

TEST_P(Samples, HaveWellShapedTriangles) {
  for (const std::size_t wish : {1'000U, 20'000U, 200'000U}) {
    const TriangleMesh mesh = sample(GetParam(), wish);
    double worst = 1.0, sum = 0.0;
    std::size_t slim = 0;
    for (const Triangle& t : mesh.triangles) {
      const double q = quality(mesh, t);
      worst = std::min(worst, q);
      sum += q;
      slim += q < 0.3 ? 1U : 0U;
    }
    const auto count = static_cast<double>(mesh.triangles.size());
    EXPECT_GT(worst, 0.005) << wish;  // none without area; the slimmest lie on the steepest relief
    EXPECT_LT(double(slim), 0.004 * count) << wish;
    EXPECT_GT(sum / count, 0.85) << wish;
  }
}

TEST_P(Samples, GainReliefWithTriangles) {
  // The relief shows as the angle between neighbouring faces: without detail it would halve when edges halve.
  const auto bend = [](const TriangleMesh& mesh) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, Vec3d> normals;
    double sum = 0.0;
    for (const Triangle& t : mesh.triangles) {
      const Vec3d n =
          normalized(cross(mesh.positions[t[1]] - mesh.positions[t[0]], mesh.positions[t[2]] - mesh.positions[t[0]]));
      for (std::size_t k = 0; k < 3; ++k) {
        const auto [at, fresh] = normals.try_emplace(std::minmax(t[k], t[(k + 1) % 3]), n);
        if (!fresh) sum += length(n - at->second);
      }
    }
    return sum / (1.5 * double(mesh.triangles.size()));
  };
  EXPECT_GT(bend(sample(GetParam(), 160'000)), 0.30 * bend(sample(GetParam(), 10'000)));
}

TEST_P(Samples, AreTheSameBytesEveryTime) {
  // From GCC 12 and clang 19, -O0 and -O3, x86-64. A change here changes every picture and figure made from the models.
  static const std::map<std::string_view, std::uint64_t> known = {{"pumpkin", 0x222bf8948fa8a16cULL},
                                                                  {"head", 0x306328318aad8537ULL},
                                                                  {"torus", 0x4107b0f67207e6d7ULL},
                                                                  {"bowl", 0x6ab6b176a69cb915ULL}};
  const TriangleMesh mesh = sample(GetParam(), 20'000);
  EXPECT_EQ(content(mesh), known.at(GetParam())) << std::hex << content(mesh);
  EXPECT_EQ(content(mesh), content(sample(GetParam(), 20'000)));
}

TEST_P(Samples, TellHowFarTheyAre) {
  std::vector<double> shares;
  const auto mesh =
      make_sample(GetParam(), 20'000,
                  {.report = [&](std::string_view, double share) { shares.push_back(share); }, .cancel = nullptr});
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(content(*mesh), content(sample(GetParam(), 20'000)));
  ASSERT_GT(shares.size(), 20U);
  EXPECT_LT(shares.size(), 200U);
  EXPECT_EQ(shares.front(), 0.0);
  EXPECT_EQ(shares.back(), 1.0);
  for (std::size_t k = 1; k < shares.size(); ++k) {
    EXPECT_GT(shares[k], shares[k - 1]);
    // Only the head has tables to fill before its grid.
    EXPECT_LT(shares[k] - shares[k - 1], k == 1 && GetParam() != "head" ? 0.06 : 0.04) << "a long silence";
  }
}

TEST_P(Samples, StopWhereverTheyAre) {
  for (const double when : {0.0, 0.02, 0.07, 0.1, 0.5, 0.955, 0.98}) {
    std::atomic<bool> stop{false};
    double last = 0.0;
    const auto mesh = make_sample(GetParam(), 20'000,
                                  {.report =
                                       [&](std::string_view, double share) {
                                         last = share;
                                         if (share >= when) {
                                           EXPECT_FALSE(stop) << "went on at " << share << ", stopped at " << when;
                                           stop = true;
                                         }
                                       },
                                   .cancel = &stop});
    ASSERT_FALSE(mesh) << when;
    EXPECT_EQ(mesh.error().code, Errc::Cancelled);
    EXPECT_EQ(mesh.error().message, "making the sample was cancelled");
    EXPECT_LT(last, when + 0.06);
  }
}

INSTANTIATE_TEST_SUITE_P(All, Samples, ::testing::ValuesIn(sample_names().begin(), sample_names().end()),
                         [](const auto& test) { return std::string(test.param); });

TEST(SampleShapes, TheHeadLooksAlongZ) {
  const TriangleMesh mesh = sample("head", 20'000);
  const auto nose = std::ranges::max_element(mesh.positions, {}, [](Vec3d p) { return p.z; });
  EXPECT_LT(std::abs(nose->x), 2.0);
  EXPECT_GT(nose->y, 40.0);
  EXPECT_LT(nose->y, 60.0);
}

TEST(SampleShapes, TheBowlIsThin) {
  // From above, the axis meets the inside first, the underside at most 4 % of the diagonal below it.
  const TriangleMesh mesh = sample("bowl", 20'000);
  double top = 0.0, underside = 100.0;
  for (const Vec3d p : mesh.positions)
    if (p.x * p.x + p.z * p.z < 25.0) {
      top = std::max(top, p.y);
      underside = std::min(underside, p.y);
    }
  EXPECT_GT(top - underside, 0.02 * diagonal(box_of(mesh)));
  EXPECT_LT(top - underside, 0.05 * diagonal(box_of(mesh)));
}

TEST(SampleErrors, NameTheKnownModels) {
  const auto mesh = make_sample("pump\nkin", 5'000);
  ASSERT_FALSE(mesh);
  EXPECT_EQ(mesh.error().code, Errc::NotFound);
  for (const std::string_view name : sample_names()) EXPECT_NE(mesh.error().message.find(name), std::string::npos);
  EXPECT_NE(mesh.error().message.find("pump\\x0akin"), std::string::npos) << mesh.error().message;
}

TEST(SampleErrors, ASampleThatIsCancelledBeforeItStartsSaysNothing) {
  const std::atomic<bool> stop{true};
  int reports = 0;
  const auto mesh =
      make_sample("head", 50'000'000, {.report = [&](std::string_view, double) { ++reports; }, .cancel = &stop});
  ASSERT_FALSE(mesh);
  EXPECT_EQ(mesh.error().code, Errc::Cancelled);
  EXPECT_EQ(reports, 0);
}

TEST(SampleErrors, RefuseCountsOutOfRange) {
  for (const std::size_t wish : {std::size_t{0}, std::size_t{999}, std::size_t{50'000'001}, ~std::size_t{0}}) {
    const auto mesh = make_sample("torus", wish);
    ASSERT_FALSE(mesh);
    EXPECT_EQ(mesh.error().code, Errc::InvalidArgument);
    EXPECT_NE(mesh.error().message.find("1000 to 50000000"), std::string::npos) << mesh.error().message;
  }
}

}  // namespace
}  // namespace relief
