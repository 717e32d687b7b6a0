#include <relief/convert/shell/initial_shell.h>

#include <gtest/gtest.h>
#include <unit/convert/shell/shell_support.h>

#include <algorithm>
#include <vector>

namespace relief::detail {
namespace {

TEST(InitialShell, IsCertifiedOnCleanSources) {
  TriangleMesh nested = testing::ball(14);
  testing::append(nested, testing::ball(14), {}, 0.8);
  TriangleMesh chain = testing::torus(24, 12);
  testing::append(chain, testing::ball(12), {0, 0, 0});
  for (const TriangleMesh& mesh :
       {testing::tetrahedron(), testing::box({1, 2, 3}), testing::box({1, 1, 0.01}), testing::ball(20, 0.1),
        testing::torus(30, 18), noisy_field(16, 0.03), nested, chain}) {
    const ThinShell thin(mesh);
    for (const double share : {1.0, 0.01}) {
      const Rings rings(thin.source.faces, thin.source.points.size());
      InitialShell shell(thin.source, rings, share * thin.longest);
      ASSERT_TRUE(shell.update({}, {}, {}));
      EXPECT_TRUE(shell.faults().empty());
      if (!shell.folds().empty()) continue;
      ShellDraft draft = thin.draft();
      draft.ends = shell.take_ends();
      for (std::uint32_t v = 0; v < draft.ends.size(); ++v) {
        EXPECT_LE(length(draft.fibre(v)), share * thin.longest + 2);
        // The fibre runs through its point, to the rounding of its ends.
        const Vec3d in = to_double(draft.ends[v][kInner]), d = normalized(draft.fibre(v));
        EXPECT_LT(length(cross(to_double(thin.source.points[v]) - in, d)), 2);
      }
      expect_certified(draft, thin.source);
    }
  }
}

TEST(InitialShell, NamesTheFacesThatMeet) {
  TriangleMesh crossing = testing::ball(10);
  testing::append(crossing, testing::ball(10), {0.5, 0.3, 0.2});
  const LatticeMesh mesh(crossing);
  const SourceIndex source(mesh.points, mesh.faces);
  const Rings rings(source.faces, source.points.size());
  InitialShell thin(source, rings, mesh.steps(0.3));
  ASSERT_TRUE(thin.update({}, {}, {}));
  std::vector<std::uint32_t> meeting;
  for (std::uint32_t a = 0; a < source.faces.size(); ++a)
    for (std::uint32_t b = 0; b < source.faces.size(); ++b)
      if (!share_a_corner(source.faces[a], source.faces[b]) && triangles_meet(source.corners(a), source.corners(b))) {
        meeting.push_back(a);
        break;
      }
  ASSERT_FALSE(meeting.empty());
  EXPECT_TRUE(std::ranges::includes(thin.faults(), meeting));
  EXPECT_LT(thin.faults().size(), source.faces.size() / 2);
}

// A face with a tall fibre that cannot be lower is no fault of the shell: another triangle folds in it for good.
TEST(InitialShell, LowersTallFibresOnlyWhileTheyMayBeLower) {
  constexpr auto kLeast = float(kLeastHeight);
  const auto corners = [&](float tall, float least) {
    return corners_to_lower({{{kLeast, kLeast}, {tall, tall}, {2 * kLeast, kLeast}}}, {kLeast, least, kLeast});
  };
  EXPECT_EQ(corners(20 * kLeast, kLeast), 0b010U);
  EXPECT_EQ(corners(20 * kLeast, 19 * kLeast), 0b010U);
  EXPECT_EQ(corners(20 * kLeast, 20 * kLeast), 0U);
  EXPECT_EQ(corners(16 * kLeast, kLeast), 0U);
  EXPECT_EQ(corners_to_lower({{{30, 30}, {1, 0}, {8, 9}}}, {30, 0, 8}), 0b100U);
}

TEST(InitialShell, MadeAnewWhereTheSourceHasChangedIsAsSound) {
  const LatticeMesh mesh(testing::ball(16));
  SourceIndex source(mesh.points, mesh.faces);
  const Rings rings(source.faces, source.points.size());
  InitialShell thin(source, rings, mesh.steps(0.2));
  ASSERT_TRUE(thin.update({}, {}, {}));
  const std::uint32_t moved = 100;
  source.points[moved] = snap(to_double(source.points[moved]) * 0.999 + Vec3d{1.6e7, 1.6e7, 1.6e7} * 0.001);
  source.update();
  std::vector<std::uint32_t> changed = {moved};
  rings.around(moved, [&](std::uint32_t h) { changed.push_back(source.faces[h / 3][(h + 1) % 3]); });
  ASSERT_TRUE(thin.update(changed, {}, {}));
  EXPECT_TRUE(thin.faults().empty());
  expect_certified(finest_draft(source, thin.take_ends(), {}), source);
}

}  // namespace
}  // namespace relief::detail
