// What the tools that look around themselves make of the surface: against all micro-triangles around each sample, in
// double, and against closed forms.
#include "edit_support.h"

#include <random>
#include <string>
#include <vector>

namespace relief {
namespace {

using testing::apply;
using testing::dab_near;
using testing::displaced;
using testing::for_each_sample;
using testing::valid;

// ---- Neighbours

/// Gathered from every micro-triangle of every slab that has a copy of the sample.
struct Surroundings {
  Vec3d area;    ///< sum of twice the areas, times the normals
  Vec3d others;  ///< sum of the other corners, seen from the sample
  int count = 0;
};
Surroundings surroundings(const Snapshot& model, SlabId slab, GridPoint at) {
  const SlabMesh& mesh = model.slab_mesh();
  const Vec3d middle = sample_position(model, slab, at);
  Surroundings all;
  mesh.for_each_copy(slab, at, [&](const SampleCopy& copy) {
    const int n = mesh.intervals(copy.slab);
    const auto add = [&](GridPoint a, GridPoint b, GridPoint c) {
      for (const GridPoint p : {a, b, c})
        if (p.i < 0 || p.j < 0 || p.i + p.j > n) return;
      if (a != copy.at && b != copy.at && c != copy.at) return;
      const Vec3d pa = sample_position(model, copy.slab, a), pb = sample_position(model, copy.slab, b),
                  pc = sample_position(model, copy.slab, c);
      all.area += cross(pb - pa, pc - pa);
      all.others += pa + pb + pc - middle * 3.0;
      all.count += 2;
    };
    for (int j = copy.at.j - 1; j <= copy.at.j + 1; ++j)
      for (int i = copy.at.i - 1; i <= copy.at.i + 1; ++i) {
        add({i, j}, {i + 1, j}, {i, j + 1});
        add({i + 1, j}, {i + 1, j + 1}, {i, j + 1});
      }
  });
  return all;
}

/// What one dab of Smooth or Inflate should make of a sample; its value where the tool does not reach it.
double wanted(const Snapshot& model, const Brush& brush, const Dab& dab, SlabId s, GridPoint at) {
  const SlabMesh& mesh = model.slab_mesh();
  const int n = mesh.intervals(s);
  const double alpha = double(model.displacement(s)[sample_index(n, at)]);
  const double distance = length(sample_position(model, s, at) - dab.contact) / brush.radius;
  if (distance >= 1) return alpha;
  const double weight = std::pow(1 - distance * distance, 2);
  const double amount = info(brush.tool).rate * brush.strength * dab.pressure * dab.seconds * weight;
  const Vec3d fibre = sample_position(mesh, s, n, at, 1) - sample_position(mesh, s, n, at, 0);
  const Surroundings all = surroundings(model, s, at);
  if (brush.tool == Tool::Inflate) return alpha + brush.radius * amount / dot(fibre, normalized(all.area));
  const double above = dot(all.others / all.count, all.area) / dot(fibre, all.area);
  return alpha + above * (1 - std::exp(-amount));
}

/// Compares a dab with what each sample's surroundings say; tells how many samples of borders and corners moved.
void expect_as_surroundings_say(const SnapshotPtr& before, Vec3d where, double radius, const std::string& what) {
  const SlabMesh& mesh = before->slab_mesh();
  for (const Tool tool : {Tool::Smooth, Tool::Inflate}) {
    const Brush brush{.tool = tool, .radius = radius, .detail = 0, .strength = 0.9};
    Dab dab = dab_near(*before, where, 0, 0.8, tool == Tool::Smooth ? 0.002 : 0.02);
    dab.normal = normalized(where);
    Editor editor(before);
    EXPECT_EQ(apply(editor, brush, dab).limited, 0U);
    EXPECT_TRUE(valid(*editor.head()));
    std::size_t inside = 0, edges = 0, corners = 0;
    double worst = 0, largest = 0;
    for_each_sample(mesh, [&](SlabId s, std::size_t k, GridPoint at) {
      if (mesh.edge_place(s, at).constrained()) return;
      const double want = wanted(*before, brush, dab, s, at), was = double(before->displacement(s)[k]);
      worst = std::max(worst, std::abs(double(editor.head()->displacement(s)[k]) - want));
      largest = std::max(largest, std::abs(want - was));
      if (std::abs(want - was) < 1e-5) return;
      const auto w = weights(mesh.intervals(s), at);
      const int zeros = (w[0] == 0) + (w[1] == 0) + (w[2] == 0);
      ++(zeros == 0 ? inside : zeros == 1 ? edges : corners);
    });
    EXPECT_LE(worst, 2e-6 + 1e-5 * largest) << what << ", " << name(tool);
    EXPECT_GT(inside, 10U) << what;
    EXPECT_GT(edges, 10U) << what;
    EXPECT_GT(corners, 2U) << what;
  }
}

class Fan : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Slabs, Fan, ::testing::Values(3, 4, 5, 6, 7, 8));

TEST_P(Fan, SmoothAndInflateSeeAllSlabsAroundASample) {
  const auto even = testing::double_pyramid(GetParam(), 16);
  const auto mixed = testing::mixed_shell(*testing::double_pyramid(GetParam(), 1), 8, 2);
  for (const auto& mesh : {even, mixed}) {
    const SnapshotPtr model = displaced(mesh, testing::bumps);
    expect_as_surroundings_say(model, {0.01, 1, 0.005}, 0.5, "tip of " + std::to_string(GetParam()));
    expect_as_surroundings_say(model, {1, 0.01, 0.005}, 0.4, "waist of " + std::to_string(GetParam()));
  }
}

TEST(Neighbours, SmoothAndInflateSeeThemAcrossBordersOfAnyN) {
  for (const auto& mesh : {testing::torus_shell(12, 8, 15), testing::mixed_shell(*testing::torus_shell(12, 8, 1), 3, 3),
                           testing::mixed_shell(*testing::torus_shell(12, 8, 1), 4, 4), testing::sphere_shell(2, 12)}) {
    const SnapshotPtr model = displaced(mesh, testing::bumps);
    // Where six slabs meet, on an edge, and anywhere.
    const SlabCorners corners = mesh->corners(20);
    const Vec3d corner = corners.point({1, 0, 0}, 0.5), edge = corners.point({0.4, 0.6, 0}, 0.5);
    for (const Vec3d where : {corner, edge, corners.point({0.3, 0.3, 0.4}, 0.5)}) {
      const Vec3d out = normalized(corners.fibre(0));
      for (const Tool tool : {Tool::Smooth, Tool::Inflate}) {
        const Brush brush{.tool = tool, .radius = 0.5, .detail = 0, .strength = 0.9};
        Dab dab = dab_near(*model, where, 0, 0.8, tool == Tool::Smooth ? 0.002 : 0.02);
        dab.normal = out;
        Editor editor(model);
        EXPECT_GT(apply(editor, brush, dab).samples, 20U);
        double worst = 0, largest = 0;
        for_each_sample(*mesh, [&](SlabId s, std::size_t k, GridPoint at) {
          if (mesh->edge_place(s, at).constrained()) return;
          const double want = wanted(*model, brush, dab, s, at);
          largest = std::max(largest, std::abs(want - double(model->displacement(s)[k])));
          worst = std::max(worst, std::abs(double(editor.head()->displacement(s)[k]) - want));
        });
        EXPECT_LE(worst, 2e-6 + 1e-5 * largest) << name(tool);
        EXPECT_GT(largest, 1e-4);
      }
    }
  }
}

// ---- Planes, spheres, bumps

/// Leaning fibres of one height over the plane y = 0, whose ends go up and down: displaced so that the surface is flat.
SnapshotPtr leaning_plane(bool mixed) {
  auto mesh = testing::mapped_shell(*testing::plane_shell(4, 16), [](Vec3d p) {
    return Vec3d{p.x + 0.4 * p.y * std::sin(5 * p.z), p.y + 0.04 * std::sin(6 * p.x + 4 * p.z),
                 p.z + 0.4 * p.y * std::cos(4 * p.x)};
  });
  // Both ends of a fibre have to go up alike.
  std::vector<Fibre> fibres;
  for (const Fibre& f : mesh->fibres()) fibres.push_back({f.inner, {f.outer.x, f.inner.y + 0.2, f.outer.z}});
  std::vector<SlabMesh::Face> faces;
  for (const Slab& slab : mesh->slabs()) faces.push_back({slab.fibres, mixed ? 1 : 16});
  mesh = testing::built(SlabMesh::make(std::move(fibres), faces));
  if (mixed) mesh = testing::mixed_shell(*mesh, 4, 3);
  SnapshotDraft draft(Snapshot::make(mesh));
  for (SlabId s = 0; s < mesh->slab_count(); ++s) {
    const int n = mesh->intervals(s);
    Tile& tile = draft.edit(Layer::Displacement, s);
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i + j <= n; ++i)
        tile.plane()[sample_index(n, {i, j})] = static_cast<float>(-sample_position(*mesh, s, n, {i, j}, 0).y / 0.2);
    constrain(*mesh, Layer::Displacement, s, tile);
  }
  return draft.finish();
}

Stroke across(Tool tool, double radius, double strength, double seconds) {
  Stroke stroke{
      .brush = {.tool = tool, .radius = radius, .detail = 0, .strength = strength}, .label = {}, .points = {}};
  for (int k = 0; k <= 20; ++k) stroke.points.push_back({seconds * k / 20, {0.3 + 0.02 * k, 0, 0.45 + 0.005 * k}, 1});
  return stroke;
}

TEST(Planes, StayPlanesUnderSmoothAndFlatten) {
  for (const bool mixed : {false, true})
    for (const Tool tool : {Tool::Smooth, Tool::Flatten}) {
      const SnapshotPtr plane = leaning_plane(mixed);
      Editor editor(plane);
      play(editor, across(tool, 0.25, 1, 1));
      double before = 0, after = 0, lowest = 1, highest = 0;
      for_each_sample(plane->slab_mesh(), [&](SlabId s, std::size_t k, GridPoint at) {
        before = std::max(before, std::abs(sample_position(*plane, s, at).y));
        after = std::max(after, std::abs(sample_position(*editor.head(), s, at).y));
        lowest = std::min(lowest, double(plane->displacement(s)[k]));
        highest = std::max(highest, double(plane->displacement(s)[k]));
      });
      EXPECT_GT(highest - lowest, 0.3);
      EXPECT_LE(before, 1e-7);
      EXPECT_LE(after, 1e-6) << name(tool) << (mixed ? ", mixed n" : "");
    }
}

/// The unit sphere in a round shell, whose facets would stay flat at one alpha; `grain` is added to its radius.
template <typename Grain>
SnapshotPtr round_ball(int n, const Grain& grain) {
  return displaced(testing::icosphere_shell(2, n), [&](Vec3d p) { return ((1 + grain(p)) / length(p) - 0.8) / 0.4; });
}
double no_grain(Vec3d) { return 0; }

/// Of the noise that is left: the rms of the distance from the unit sphere, about its mean, within half the radius of a
/// place.
struct Roughness {
  double rms = 0, mean = 0;
};
Roughness roughness(const Snapshot& model, Vec3d where, double radius) {
  double sum = 0, squares = 0;
  int count = 0;
  for_each_sample(model.slab_mesh(), [&](SlabId s, std::size_t, GridPoint at) {
    const Vec3d p = sample_position(model, s, at);
    if (length(p - where) > 0.5 * radius) return;
    const double off = length(p) - 1;
    sum += off;
    squares += off * off;
    ++count;
  });
  return {std::sqrt(squares / count - sum * sum / (double(count) * count)), sum / count};
}

double noise_at(Vec3d p) {
  std::mt19937 random(static_cast<unsigned>(std::lround(p.x * 1e4) * 7919 + std::lround(p.y * 1e4) * 104729 +
                                            std::lround(p.z * 1e4) * 611953));
  random.discard(5);
  return std::uniform_real_distribution<double>(-1, 1)(random);
}

TEST(Smooth, TakesOutNoiseAndLeavesASphereWhereItIs) {
  Stroke stroke{
      .brush = {.tool = Tool::Smooth, .radius = 0.3, .detail = 0, .strength = 0.5}, .label = {}, .points = {}};
  for (int k = 0; k <= 40; ++k) {
    const double turn = -0.5 + k / 40.0;
    stroke.points.push_back({0.05 * k, {std::cos(turn), 0.1, std::sin(turn)}, 1});
  }
  const Vec3d middle = normalized(Vec3d{1, 0.1, 0});
  const SnapshotPtr noisy = round_ball(32, [](Vec3d p) { return 0.002 * noise_at(p); });
  Editor editor(noisy);
  play(editor, stroke);
  const Roughness before = roughness(*noisy, middle, 0.3), after = roughness(*editor.head(), middle, 0.3);
  EXPECT_GT(before.rms, 1e-3);
  EXPECT_LE(after.rms, before.rms / 5);
  Editor clean(round_ball(32, no_grain));
  play(clean, stroke);
  double moved = 0;
  for_each_sample(clean.head()->slab_mesh(), [&](SlabId s, std::size_t, GridPoint at) {
    moved = std::max(moved, std::abs(length(sample_position(*clean.head(), s, at)) - 1));
  });
  EXPECT_LE(moved, 1e-3);
}

TEST(Smooth, LowersABump) {
  const auto mesh = testing::plane_shell(4, 32);
  const auto bump = [](Vec3d p) {
    return 0.5 + 0.2 * std::exp(-(std::pow(p.x - 0.5, 2) + std::pow(p.z - 0.5, 2)) / (2 * 0.015 * 0.015));
  };
  Editor editor(displaced(mesh, bump));
  std::vector<double> heights;
  for (int k = 0; k < 4; ++k) {
    const auto hit = raycast(*editor.head(), {{0.5, 1, 0.5}, {0, -1, 0}});
    ASSERT_TRUE(hit);
    heights.push_back(hit->point.position.y);
    play(editor, {.brush = {.tool = Tool::Smooth, .radius = 0.15, .detail = 0},
                  .label = {},
                  .points = {{0, {0.5, 0.03, 0.5}, 1}, {0.3, {0.5, 0.03, 0.5}, 1}}});
  }
  EXPECT_NEAR(heights[0], 0.04, 1e-3);
  for (std::size_t k = 1; k < heights.size(); ++k) EXPECT_LT(heights[k], 0.9 * heights[k - 1]);
  EXPECT_GT(heights.back(), 0);
}

/// The rms of y about the plane that fits it best, near a place.
double rms_from_plane(const Snapshot& model, Vec3d where, double radius) {
  std::array<std::array<double, 4>, 3> m{};
  std::vector<Vec3d> near;
  for_each_sample(model.slab_mesh(), [&](SlabId s, std::size_t, GridPoint at) {
    const Vec3d p = sample_position(model, s, at) - where;
    if (std::hypot(p.x, p.z) > radius) return;
    near.push_back(p);
    const std::array<double, 4> row = {p.x, p.z, 1, p.y};
    for (std::size_t a = 0; a < 3; ++a)
      for (std::size_t b = 0; b < 4; ++b) m[a][b] += row[a] * row[b];
  });
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t other = 0; other < 3; ++other) {
      if (other == a) continue;
      const double share = m[other][a] / m[a][a];
      for (std::size_t b = 0; b < 4; ++b) m[other][b] -= share * m[a][b];
    }
  double squares = 0;
  for (const Vec3d p : near)
    squares += std::pow(p.y - m[0][3] / m[0][0] * p.x - m[1][3] / m[1][1] * p.z - m[2][3] / m[2][2], 2);
  return std::sqrt(squares / double(near.size()));
}

TEST(Flatten, BringsTheSurfaceToAPlane) {
  const SnapshotPtr bumpy = displaced(testing::plane_shell(4, 32), testing::bumps);
  Editor editor(bumpy);
  const Vec3d where = {0.5, 0, 0.5};
  double before = rms_from_plane(*bumpy, where, 0.12);
  EXPECT_GT(before, 3e-4);
  const double first = before;
  for (int k = 0; k < 3; ++k) {
    play(editor, {.brush = {.tool = Tool::Flatten, .radius = 0.25, .detail = 0},
                  .label = {},
                  .points = {{0, where, 1}, {0.2, where, 1}}});
    const double after = rms_from_plane(*editor.head(), where, 0.12);
    EXPECT_LT(after, 0.6 * before);
    before = after;
  }
  EXPECT_LT(before, first / 10);
}

TEST(Inflate, OfASphereGivesTheFallOffOnASphere) {
  const SnapshotPtr sphere = round_ball(32, no_grain);
  const double radius = 0.35, strength = 0.8, pressure = 0.7, seconds = 0.1;
  for (const Falloff falloff : {Falloff::Linear, Falloff::Smooth, Falloff::Dome}) {
    Editor editor(sphere);
    Dab dab = dab_near(*sphere, {0.4, 0.8, 0.3}, 0, pressure, seconds);
    dab.normal = normalized(dab.contact);
    apply(editor, {.tool = Tool::Inflate, .radius = radius, .detail = 0, .strength = strength, .falloff = falloff},
          dab);
    double worst = 0, highest = 0;
    for_each_sample(sphere->slab_mesh(), [&](SlabId s, std::size_t, GridPoint at) {
      const double d = length(sample_position(*sphere, s, at) - dab.contact) / radius;
      const double left = std::max(1 - d * d, 0.0);
      const double weight = falloff == Falloff::Linear   ? std::max(1 - d, 0.0)
                            : falloff == Falloff::Smooth ? left * left
                                                         : std::sqrt(left);
      const double rise = radius * strength * pressure * seconds * weight;
      const double got = length(sample_position(*editor.head(), s, at)) - length(sample_position(*sphere, s, at));
      worst = std::max(worst, std::abs(got - rise));
      highest = std::max(highest, got);
    });
    // The triangles' normal leans from the sphere's by a few thousandths, whose cosine differs from 1 by 1e-5.
    EXPECT_LE(worst, 1e-4 * radius * strength * pressure * seconds + 1e-7) << name(falloff);
    EXPECT_GT(highest, 0.95 * radius * strength * pressure * seconds);
  }
}

TEST(Clay, OnlyRaisesAndFillsHollowsFirst) {
  const SnapshotPtr bumpy = displaced(testing::plane_shell(4, 32), testing::bumps);
  Editor editor(bumpy);
  EXPECT_TRUE(play(editor, across(Tool::Clay, 0.2, 0.6, 0.5)).changed);
  double hollow = 0, hill = 0;
  int hollows = 0, hills = 0;
  for_each_sample(bumpy->slab_mesh(), [&](SlabId s, std::size_t k, GridPoint at) {
    const double rise = double(editor.head()->displacement(s)[k]) - double(bumpy->displacement(s)[k]);
    EXPECT_GE(rise, 0);
    const Vec3d p = sample_position(*bumpy, s, at);
    if (std::abs(p.x - 0.5) > 0.2 || std::abs(p.z - 0.5) > 0.05) return;
    const bool low = p.y < 0;
    (low ? hollow : hill) += rise;
    ++(low ? hollows : hills);
  });
  ASSERT_GT(hollows, 100);
  ASSERT_GT(hills, 20);
  EXPECT_GT(hollow / hollows, hill / hills);
}

TEST(LayerTool, NeverGoesBeyondItsHeight) {
  const auto mesh = testing::plane_shell(4, 32);
  for (const double high : {0.03, -0.03, 0.0}) {
    const double want = high == 0 ? 0.1 * 0.12 : high;
    Stroke stroke{
        .brush = {.tool = Tool::Layer, .radius = 0.12, .detail = 0, .height = high}, .label = {}, .points = {}};
    // Three times over itself, slowly.
    for (int k = 0; k <= 6; ++k)
      stroke.points.push_back({0.8 * k, {k % 2 == 0 ? 0.3 : 0.7, 0, k % 2 == 0 ? 0.45 : 0.55}, 1});
    Editor editor(Snapshot::make(mesh));
    EXPECT_TRUE(play(editor, stroke).changed);
    double most = 0, at_middle = 0;
    for_each_sample(*mesh, [&](SlabId s, std::size_t, GridPoint at) {
      const Vec3d p = sample_position(*editor.head(), s, at);
      // On the side of the height, as far as that and no farther.
      EXPECT_GE(p.y * (want > 0 ? 1 : -1), 0);
      most = std::max(most, std::abs(p.y));
      if (std::abs(p.x - 0.5) < 0.01 && std::abs(p.z - 0.5) < 0.01) at_middle = p.y;
    });
    EXPECT_LE(most, std::abs(want) * (1 + 1e-6)) << high;
    EXPECT_NEAR(at_middle, want, 0.02 * std::abs(want)) << high;
  }
}

TEST(MaskTools, CoverAndUncoverByTheirRate) {
  const auto mesh = testing::plane_shell(4, 32);
  const SnapshotPtr plane = Snapshot::make(mesh);
  const double radius = 0.2;
  const Dab dab = dab_near(*plane, {0.52, 0, 0.47}, 0, 0.7, 0.01);
  const auto values = [&](const Snapshot& model, const auto& visit) {
    for (SlabId s = 0; s < mesh->slab_count(); ++s) {
      const Tile& tile = model.tile(Layer::Mask, s);
      const int n = tile.intervals();
      for (int j = 0; j <= n; ++j)
        for (int i = 0; i + j <= n; ++i)
          visit(double(tile.plane()[sample_index(n, {i, j})]),
                length(sample_position(*mesh, s, n, {i, j}, 0.5) - dab.contact) / radius);
    }
  };
  const auto share = [&](double d, double seconds) {
    const double weight = d < 1 ? std::pow(1 - d * d, 2) : 0;
    return 1 - std::exp(-12 * 0.8 * 0.7 * weight * seconds);
  };
  // Ten dabs of a hundredth of a second are one of a tenth.
  Editor editor(plane);
  editor.begin_stroke({.tool = Tool::Mask, .radius = radius, .detail = 0, .strength = 0.8});
  for (int k = 0; k < 10; ++k) editor.dab(dab);
  EXPECT_TRUE(editor.end_stroke().changed);
  values(*editor.head(), [&](double value, double d) { EXPECT_NEAR(value, share(d, 0.1), 1e-5) << d; });
  // The mask does not protect itself: what was masked is uncovered by the same rate.
  editor.begin_stroke({.tool = Tool::Unmask, .radius = radius, .detail = 0, .strength = 0.8});
  for (int k = 0; k < 10; ++k) editor.dab(dab);
  EXPECT_TRUE(editor.end_stroke().changed);
  values(*editor.head(),
         [&](double value, double d) { EXPECT_NEAR(value, share(d, 0.1) * (1 - share(d, 0.1)), 1e-5) << d; });
  // Long enough, and nothing is left.
  editor.begin_stroke({.tool = Tool::Unmask, .radius = radius, .detail = 0, .strength = 0.8});
  for (int k = 0; k < 500; ++k) editor.dab(dab);
  editor.end_stroke();
  values(*editor.head(), [&](double value, double d) {
    if (d < 0.6) {
      EXPECT_LT(value, 1e-4) << d;
    }
  });
}

}  // namespace
}  // namespace relief
