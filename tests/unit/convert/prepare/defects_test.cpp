// Defects, found as brute force finds them.
#include "../shapes.h"
#include "closed_source.h"

#include <relief/convert/prepare/defects.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace relief {
namespace {

using namespace detail;
using testing::append;
using testing::closed_source;

TEST(PatchIntersections, ArePairsThatShareNoCorner) {
  // A triangle, one across it, one beside that across both, and one at a corner of the first.
  ClosedSource source;
  source.points = {{0, 0, 0},      {900, 0, 0},     {0, 900, 0},   {100, 100, -500}, {120, 100, 500}, {100, 140, 500},
                   {90, 90, -200}, {90, 110, -200}, {130, 120, 9}, {0, 0, 700},      {500, 0, 700}};
  source.faces = {{0, 1, 2}, {3, 4, 5}, {6, 7, 8}, {0, 9, 10}};
  source.phantom.assign(4, 0);
  const auto count = [&](std::vector<std::uint8_t> patch) {
    source.patch = std::move(patch);
    return count_patch_intersections(source, {});
  };
  EXPECT_EQ(count({0, 0, 0, 0}), 0U);
  EXPECT_EQ(count({1, 0, 0, 0}), 2U);
  EXPECT_EQ(count({0, 0, 1, 0}), 2U);
  EXPECT_EQ(count({0, 0, 0, 1}), 0U);
  EXPECT_EQ(count({1, 1, 1, 1}), 3U);
}

/// A source while defects are looked for, with the initial shell on it.
struct Looked {
  SourceEditor editor;
  InitialShell shell;
  explicit Looked(const ClosedSource& given)
      : editor(given, given.points, 100), shell(editor.source(), editor.rings(), 0.1 * testing::diagonal_of(given)) {
    EXPECT_TRUE(shell.update({}, {}, {}));
  }
};

TEST(Defects, AreAllFacesThatMeetOthersByBruteForce) {
  // Two balls that cross along a circle, and a third far off; once all scanned, once the second one patches.
  TriangleMesh mesh = testing::ball(12);
  append(mesh, testing::ball(12), {1.2, 0.1, 0.2});
  const std::size_t patch_from = mesh.triangles.size() / 2;
  append(mesh, testing::ball(6), {-2.5, 0, 0});
  for (const bool patches : {false, true}) {
    ClosedSource given = closed_source(mesh);
    if (patches) std::fill_n(given.patch.begin() + std::ptrdiff_t(patch_from), patch_from, std::uint8_t{1});
    Looked looked(given);
    const SourceIndex& source = looked.editor.source();
    std::vector<std::uint32_t> meet;
    for (std::uint32_t f = 0; f < source.faces.size(); ++f)
      for (std::uint32_t g = 0; g < source.faces.size(); ++g)
        if (!share_a_corner(source.faces[f], source.faces[g]) && triangles_meet(source.corners(f), source.corners(g))) {
          meet.push_back(f);
          break;
        }
    ASSERT_GT(meet.size(), 40U);
    const std::vector<Defect> defects = shell_defects(looked.editor, looked.shell, false);
    const DefectKind kind = patches ? DefectKind::PatchIntersection : DefectKind::SelfIntersection;
    std::vector<std::uint32_t> found;
    for (const Defect& d : defects) {
      if (d.kind != kind) continue;
      found.push_back(d.at);
      EXPECT_EQ(d.place, source.points[source.faces[d.at][0]]);
      EXPECT_EQ(d.component, looked.editor.component_of(d.at));
      EXPECT_LT(d.component, 2U);
    }
    EXPECT_EQ(found, meet);
    const Obstacle all = gravest(defects);
    EXPECT_EQ(all.kind, kind);
    EXPECT_EQ(all.count, meet.size());
    const std::vector<Obstacle> by_component = gravest_by_component(defects);
    ASSERT_EQ(by_component.size(), 2U);
    EXPECT_EQ(by_component[0].component, 0U);
    EXPECT_EQ(by_component[1].component, 1U);
    EXPECT_EQ(by_component[0].count + by_component[1].count, meet.size());
  }
}

TEST(Defects, ASoundSourceHasNone) {
  Looked looked(closed_source(testing::torus(30, 20)));
  EXPECT_TRUE(shell_defects(looked.editor, looked.shell, true).empty());
  EXPECT_EQ(looked.editor.look_at_all(0.2, 0.02, {}), SourceEditor::Seen::Well);
}

TEST(Defects, SingularVerticesNameTheirFaces) {
  // A point pulled down through its own ring: no direction sees its faces.
  TriangleMesh mesh = testing::ball(20);
  const std::uint32_t pulled = 300;
  mesh.positions[pulled] = mesh.positions[pulled] * 0.7 + cross(mesh.positions[pulled], Vec3d{0, 0, 1}) * 0.3;
  Looked looked(closed_source(mesh));
  const SourceIndex& source = looked.editor.source();
  std::uint32_t at = 0;
  while (source.point_of[at] != pulled) ++at;
  const std::vector<std::uint32_t> points = {at};
  const std::vector<Defect> defects = singular_vertices(looked.editor, points);
  ASSERT_EQ(defects.size(), 1U);
  EXPECT_EQ(defects[0].kind, DefectKind::SingularVertex);
  EXPECT_EQ(defects[0].place, source.points[at]);
  std::vector<std::uint32_t> around;
  for (std::uint32_t f = 0; f < source.faces.size(); ++f)
    if (std::ranges::count(source.faces[f], at) > 0) around.push_back(f);
  EXPECT_EQ(faces_of(looked.editor, defects), around);
}

TEST(Defects, TheGravestKindIsTold) {
  const std::vector<Defect> defects = {{DefectKind::Fold, 7, {1, 0, 0}, 0},
                                       {DefectKind::TooNear, 8, {2, 0, 0}, 1},
                                       {DefectKind::SelfIntersection, 9, {3, 0, 0}, 1},
                                       {DefectKind::SelfIntersection, 10, {4, 0, 0}, 1}};
  const Obstacle worst = gravest(defects);
  EXPECT_EQ(worst.kind, DefectKind::SelfIntersection);
  EXPECT_EQ(worst.count, 2U);
  EXPECT_EQ(worst.place, (LatticePoint{3, 0, 0}));
  const std::vector<Obstacle> each = gravest_by_component(defects);
  ASSERT_EQ(each.size(), 2U);
  EXPECT_EQ(each[0].kind, DefectKind::Fold);
  EXPECT_EQ(each[1].kind, DefectKind::SelfIntersection);
}

}  // namespace
}  // namespace relief
