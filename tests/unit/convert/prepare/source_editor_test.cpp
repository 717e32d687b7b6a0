#include "../certified.h"
#include "../shapes.h"

#include <relief/convert/prepare/hole_filling.h>
#include <relief/convert/prepare/source_editor.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace relief {
namespace {

using namespace detail;

TEST(SourceEditor, NothingStaysOfPatchesAlone) {
  // A tube with patchs over its ends: what is cut out at one rim leaves its patch without a neighbour.
  constexpr int kAround = 60, kRows = 20;
  const TriangleMesh tube = testing::bent_grid(kAround, kRows, true, false, [](double u, double v) {
    const double a = 2 * std::numbers::pi * u;
    return Vec3d{std::cos(a), std::sin(a), 2 * v} * 1e5 + Vec3d{2e5, 2e5, 2e5};
  });
  ClosedSource closed;
  std::vector<Vec3d> points = tube.positions;
  closed.faces = tube.triangles;
  const auto loops = find_boundary_loops(points.size(), closed.faces);
  fill_holes(points, closed.faces, loops, std::vector<Closing>(loops.size(), Closing::Patch));
  for (const Vec3d p : points) closed.points.push_back(snap(p));
  closed.phantom.assign(tube.triangles.size(), 0);
  closed.phantom.resize(closed.faces.size(), 1);
  closed.patch = closed.phantom;

  SourceEditor editor(closed, closed.points, 100);
  const SourceIndex& source = editor.source();
  std::vector<std::uint32_t> bad;
  for (std::uint32_t f = 0; f < source.faces.size(); ++f)
    if (source.face_of[f] < 2 * kAround) bad.push_back(f);
  const auto loss = editor.cut_and_patch(bad, 1);
  ASSERT_TRUE(loss);
  EXPECT_EQ(loss->faces, 4U * kAround);
  EXPECT_EQ(loss->components, 0U);
  std::vector<Face> faces;
  std::vector<std::uint8_t> scanned;
  for (std::uint32_t f = 0; f < source.faces.size(); ++f) {
    if (!source.alive(f)) continue;
    faces.push_back(source.faces[f]);
    scanned.push_back(editor.is_scanned(f));
  }
  const Components parts = find_components(source.points.size(), faces);
  EXPECT_EQ(parts.count, 1U);
  EXPECT_EQ(std::ranges::count(scanned, 1), 2 * kAround * (kRows - 2));
}

}  // namespace
}  // namespace relief
