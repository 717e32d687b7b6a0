// The one ray query: where a straight way first crosses the tessellated surface.
#include "support/exported.h"
#include "support/shells.h"

#include <relief/core/sweep.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <random>
#include <span>
#include <utility>
#include <vector>

namespace relief {
namespace {

using testing::displaced;
using testing::plane_shell;
using testing::torus_shell;

SnapshotPtr bumpy_torus() {
  return displaced(torus_shell(16, 10, 16), [](Vec3d p) {
    return 0.5 + 0.25 * std::sin(9 * p.x) * std::cos(8 * p.z) + 0.1 * std::sin(21 * p.y);
  });
}

/// Of all slabs, how much smaller a volume of coordinates is at one place than at another; negative where it is inside
/// out.
double least_jacobian(const SlabMesh& mesh) {
  double worst = 1;
  for (SlabId slab = 0; slab < mesh.slab_count(); ++slab) {
    const detail::LinearForm form(mesh.corners(slab), {});
    double least = 1e300, most = -1e300;
    for (int i = 0; i <= 6; ++i)
      for (int j = 0; i + j <= 6; ++j)
        for (int k = 0; k <= 6; ++k) {
          const double u = i / 6.0, v = j / 6.0, alpha = k / 6.0;
          const double here =
              dot(form.b + form.e * alpha, cross(form.c + form.f * alpha, form.d + form.e * u + form.f * v));
          least = std::min(least, here);
          most = std::max(most, here);
        }
    worst = std::min(worst, least / most);
  }
  return worst;
}

/// A plane shell's fibres, made to flare, to turn about the middle by so many radians per unit of height, and to lean.
std::shared_ptr<const SlabMesh> bent_shell(const SlabMesh& plane, double flare, double turn, double lean) {
  return testing::mapped_shell(plane, [=](Vec3d p) {
    const double x = (p.x - 0.5) * (1 + flare * p.y), z = (p.z - 0.5) * (1 + 2 * flare * p.y), a = turn * p.y;
    return Vec3d{x * std::cos(a) - z * std::sin(a), p.y * (1 + lean * p.x), x * std::sin(a) + z * std::cos(a)};
  });
}
/// The same with other intervals for the first slab than for the rest.
std::shared_ptr<const SlabMesh> with_intervals(const SlabMesh& mesh, int first, int others) {
  std::vector<SlabMesh::Face> faces;
  for (const Slab& slab : mesh.slabs()) faces.push_back({slab.fibres, faces.empty() ? first : others});
  auto made = SlabMesh::make({mesh.fibres().begin(), mesh.fibres().end()}, faces);
  return made ? std::make_shared<const SlabMesh>(*std::move(made)) : nullptr;
}

TEST(FirstEntry, AgreesWithTheRayOnWhereItGoesIn) {
  const SnapshotPtr model = bumpy_torus();
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(-1, 1);
  int hits = 0, misses = 0;
  for (int k = 0; k < 4000; ++k) {
    const Vec3d from = Vec3d{unit(random), unit(random), unit(random)} * 4.0;
    const double reach = std::pow(10, -2.5 * std::abs(unit(random)));
    Vec3d a = from;
    // From outside: start just above the surface half of the time, so that short ways hit, too.
    if (k % 2 == 0) {
      const SurfacePoint near = closest_point(*model, from);
      a = near.position + near.normal * (0.3 * reach);
    }
    const Vec3d b = a + Vec3d{unit(random), unit(random), unit(random)} * (4 * reach);
    const auto exact = raycast(*model, {a, b - a});
    const auto swept = first_entry(*model, a, b);
    if (exact && exact->distance < 1 && dot(exact->point.normal, b - a) > 0) continue;  // began inside
    const bool hit = exact && exact->distance < 1;
    ASSERT_EQ(hit, swept.has_value()) << k;
    (hit ? hits : misses) += 1;
    if (!hit) continue;
    EXPECT_NEAR(swept->distance, exact->distance, 1e-9);
    EXPECT_LT(length(swept->point.position - exact->point.position), 1e-9);
  }
  EXPECT_GT(hits, 500);
  EXPECT_GT(misses, 500);
}

TEST(FirstEntry, MissesNothingWhereFibresLeanAndNDiffers) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(-1, 1);
  int hits = 0;
  for (int round = 0; round < 36; ++round) {
    // Fibres that flare, and turn about the middle by up to half a right angle from the inner to the outer end.
    const double flare = 2 * std::abs(unit(random)), turn = 2 * unit(random), lean = 0.4 * unit(random);
    const auto bent = bent_shell(*plane_shell(1 + round % 3, 4, 0.15), flare, turn, lean);
    const auto mesh = round % 4 == 0   ? testing::mixed_shell(*bent, 1, 6)
                      : round % 4 == 1 ? testing::mixed_shell(*bent, 3, 3)
                                       : testing::mixed_shell(*bent, round % 4 == 2 ? 31 : 64, 0);
    ASSERT_TRUE(mesh);
    // A nearly level sheet, waves, or noise, faint or over all heights.
    const double tilt = 0.3 * unit(random), height = 0.05 * unit(random), waves = 10 + 10 * unit(random);
    const SnapshotPtr model = displaced(mesh, [=](Vec3d p) {
      if (round % 3 == 2) {
        const double any = 4e4 * std::sin(1e4 * p.x + 3e4 * p.y + 7e4 * p.z);
        return 0.5 + (round % 2 == 0 ? 0.9 : 0.05) * (any - std::floor(any) - 0.5);
      }
      return round % 2 == 0 ? 0.5 + 0.3 * std::sin(waves * p.x) * std::cos(waves * p.z)
                            : std::clamp(0.5 + (tilt * p.x + height - p.y) / 0.3, 0.0, 1.0);
    });
    std::vector<std::array<Vec3d, 3>> triangles;
    for (SlabId slab = 0; slab < mesh->slab_count(); ++slab)
      for_each_cell(mesh->intervals(slab), mesh->edge_intervals(slab), [&](const std::array<GridPoint, 3>& cell) {
        triangles.push_back({sample_position(*model, slab, cell[0]), sample_position(*model, slab, cell[1]),
                             sample_position(*model, slab, cell[2])});
      });
    for (int k = 0; k < 150; ++k) {
      const auto& [p, q, r] = triangles[random() % triangles.size()];
      const Vec3d on = (p + q + r) / 3, side = Vec3d{unit(random), 0.3 * unit(random), unit(random)} *
                                               std::pow(10, -2 * std::abs(unit(random)));
      const Vec3d from = on + side, way = side * (-1 - std::abs(unit(random)));
      double first = 2;
      for (const auto& [a, b, c] : triangles) {
        const double wa = dot(way, cross(b - from, c - from)), wb = dot(way, cross(c - from, a - from)),
                     wc = dot(way, cross(a - from, b - from)), sum = wa + wb + wc;
        if (!(wa <= 0 && wb <= 0 && wc <= 0 && sum < 0)) continue;
        const double t = dot(((a - from) * wa + (b - from) * wb + (c - from) * wc) / sum, way) / dot(way, way);
        if (t >= 0) first = std::min(first, t);
      }
      if (first > 1 - 1e-6) continue;
      const auto swept = first_entry(*model, from, from + way);
      ASSERT_TRUE(swept) << "round " << round << " way " << k;
      ASSERT_NEAR(swept->distance, first, 1e-9) << "round " << round << " way " << k;
      ++hits;
    }
  }
  EXPECT_GT(hits, 1500);
}

/// A way from a place of the surface goes in there, although rounding has put the place to one side of its triangle or
/// the other; a way from farther below does not, or what is cut off by a hair would be touched from within.
TEST(FirstEntry, BeginsAtMostABillionthOfASlabBelowTheSurface) {
  const SnapshotPtr model = bumpy_torus();
  const auto bare = testing::bare_triangles(*model);
  MicroTriangles surface(*model);
  std::mt19937 random(6);
  std::uniform_real_distribution<double> unit(-1, 1);
  int later = 0;
  for (int k = 0; k < 3000; ++k) {
    const double u = std::abs(unit(random));
    const auto place = surface.place_at(static_cast<SlabId>(random() % model->slab_mesh().slab_count()), u,
                                        (1 - u) * std::abs(unit(random)));
    ASSERT_TRUE(place);
    const SlabCorners& corners = surface.corners();
    const double side = length(corners.inner[1] - corners.inner[0]);
    const Vec3d way = normalized(normalized(Vec3d{unit(random), unit(random), unit(random)}) * 0.7 -
                                 normalized(place->triangle.area()));
    for (const double below : {0.0, 3e-10, 3e-9, 1e-6}) {
      const Vec3d from = place->position + way * (below * side), to = from + way;
      const auto swept = first_entry(*model, from, to);
      if (below < 1e-9) {
        ASSERT_TRUE(swept) << "way " << k << " from " << below;
        ASSERT_LT(swept->distance, 1e-12) << "way " << k << " from " << below;
        continue;
      }
      const auto first = bare.entry(from, to);
      ASSERT_EQ(swept.has_value(), first.has_value()) << "way " << k << " from " << below;
      if (!first) continue;
      ASSERT_NEAR(swept->distance, first->share, 1e-9) << "way " << k << " from " << below;
      ++later;
    }
  }
  EXPECT_GT(later, 100);
}

/// Two slabs whose long fibres flare, lean and turn, with a sample at any height beside any other.
SnapshotPtr twisted(int n, double depth, double flare, double turn, double lean) {
  const auto mesh = bent_shell(*plane_shell(1, n, depth), flare, turn, lean);
  if (!mesh) return nullptr;
  return displaced(mesh, [](Vec3d p) {
    const double any = 4e4 * std::sin(1e4 * p.x + 3e4 * p.y + 7e4 * p.z);
    return any - std::floor(any);
  });
}

/// Expects a sweep to go in where the bare triangles say. Returns whether they say so, not too near an end of the way.
bool goes_in(MicroTriangles& surface, const testing::BareTriangles& bare, Vec3d from, Vec3d to, int way) {
  const auto first = bare.entry(from, to);
  if (!first || first->share < 1e-6 || first->share > 1 - 1e-6) return false;
  Sweep sweep(surface, from, to, Crossing::In);
  EXPECT_TRUE(sweep.run()) << "way " << way;
  EXPECT_NEAR(sweep.share(), first->share, 1e-7) << "way " << way;
  return true;
}

/// Sends ways through any triangles: they go in where the bare triangles say. Returns how many went in.
int send_ways(const Snapshot& model, int ways, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto bare = testing::bare_triangles(model);
  MicroTriangles surface(model);
  int hits = 0;
  for (int k = 0; k < ways && !::testing::Test::HasFailure(); ++k) {
    const auto triangle = bare.corners(static_cast<std::uint32_t>(random() % bare.size()));
    const double u = std::abs(unit(random)), v = (1 - u) * std::abs(unit(random));
    const Vec3d on = triangle[0] * (1 - u - v) + triangle[1] * u + triangle[2] * v;
    const Vec3d any = {unit(random), unit(random), unit(random)};
    const Vec3d side = any * std::pow(10, 1 - 3 * std::abs(unit(random)));
    const Vec3d from = on + side, way = side * -2.0;
    hits += goes_in(surface, bare, from, from + way, k) ? 1 : 0;
  }
  return hits;
}

/// Slabs that are the right way round everywhere, if barely: in parts of them coordinates change without measure, and
/// where a slab has few samples, its flat triangles are far from where its curved coordinates put them.
TEST(FirstEntry, MissesNothingInTwistedSlabs) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  int hits = 0, barely = 0;
  for (int round = 0; round < 1600 && !HasFailure(); ++round) {
    const double flare = round % 3 == 0 ? 0 : 2 * std::abs(unit(random)), turn = 3 * unit(random),
                 lean = 0.4 * unit(random);
    const SnapshotPtr model = twisted(1 + round % 12, 0.15 + 0.5 * std::abs(unit(random)), flare, turn, lean);
    const double least = model ? least_jacobian(model->slab_mesh()) : 0;
    if (least < 5e-4) continue;
    hits += send_ways(*model, 60, random);
    barely += least < 0.02 ? 1 : 0;
  }
  EXPECT_GT(hits, 50'000);
  EXPECT_GT(barely, 50);
}

/// What a ray costs, in triangles that it places, where the coordinates of slabs bend.
TEST(FirstEntry, PlacesFewTriangles) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit(-1, 1);
  int met = 0, placed = 0;
  for (int round = 0; round < 12; ++round) {
    const double turn = 1.5 * unit(random), lean = 0.4 * unit(random);
    const auto mesh = bent_shell(*plane_shell(3, 64, 0.3), 0, turn, lean);
    ASSERT_TRUE(mesh);
    const SnapshotPtr model =
        displaced(mesh, [](Vec3d p) { return 0.5 + 0.2 * std::sin(9 * p.x) * std::cos(7 * p.z); });
    MicroTriangles surface(*model);
    for (int k = 0; k < 300; ++k) {
      const double u = std::abs(unit(random)), v = (1 - u) * std::abs(unit(random));
      const Vec3d on = surface_point(*model, static_cast<SlabId>(random() % mesh->slab_count()), u, v).position;
      const Vec3d side = {unit(random), 0.3 + 0.2 * unit(random), unit(random)};
      met += Sweep(surface, on + side, on - side, Crossing::In).run() ? 1 : 0;
    }
    placed += surface.placed();
  }
  EXPECT_GT(met, 2000);
  EXPECT_LT(placed, 50 * met);
}

/// Newton's steps do not settle everywhere beside a twisted slab, and its flat triangles reach beyond its curved walls.
TEST(FirstEntry, MissesNothingBesideCurvedWalls) {
  std::mt19937 random(1);
  for (const SnapshotPtr& model : {twisted(12, 0.58, 0, 2.56, 0.03), twisted(9, 0.56, 0, 2.65, 0.16)}) {
    ASSERT_TRUE(model);
    EXPECT_GT(send_ways(*model, 3000, random), 2000);
  }
}

/// Beside a slab of one interval the triangles of a fine one reach so far that each part of a way meets most of them.
/// Still no way places them all more than twice: that is six samples for each.
TEST(FirstEntry, PlacesEachTriangleAtMostTwiceWhereFewSamplesAreBesideMany) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(-1, 1);
  int met = 0;
  for (int round = 0; round < 60; ++round) {
    const double turn = 2 * unit(random), depth = 0.15 + 0.4 * std::abs(unit(random));
    const auto twisted = bent_shell(*plane_shell(1, 1, depth), 0, turn, 0);
    ASSERT_TRUE(twisted);
    const auto mesh = with_intervals(*twisted, 32, 1 << round % 4);
    ASSERT_TRUE(mesh);
    const SnapshotPtr model =
        displaced(mesh, [](Vec3d p) { return 0.5 + 0.45 * std::sin(9 * p.x) * std::cos(7 * p.z); });
    const auto bare = testing::bare_triangles(*model);
    MicroTriangles surface(*model);
    for (int k = 0; k < 300; ++k) {
      const auto triangle = bare.corners(static_cast<std::uint32_t>(random() % bare.size()));
      const Vec3d on = (triangle[0] + triangle[1] + triangle[2]) / 3;
      const Vec3d side = Vec3d{unit(random), unit(random), unit(random)} * 2.0;
      const int before = surface.placed();
      met += Sweep(surface, on + side, on - side, Crossing::In).run() ? 1 : 0;
      ASSERT_LE(surface.placed() - before, 6 * static_cast<int>(bare.size())) << "round " << round << " way " << k;
    }
  }
  EXPECT_GT(met, 5000);
}

/// Outside a slab there are places with the positions of places inside it, and from the slab's middle Newton's steps
/// come to them now and then: for four of 44 million places in two million slabs.
TEST(FirstEntry, MissesNothingWhereOutsideASlabItsPositionsComeAgain) {
  struct Found {
    std::array<Vec3d, 3> inner, outer;
    double u, v, alpha;
  };
  const std::array<Found, 4> all = {{{{{{-0.881378084, -0.736610857, -0.281727633},
                                        {1.61145297, -0.649731896, 0.0424787259},
                                        {0.553714425, 1.07064517, -0.0559116158}}},
                                      {{{0.82095961, 0.242617989, 4.81809108},
                                        {0.375471117, -0.252850751, 4.98738422},
                                        {0.910702709, 0.330725051, 4.7601355}}},
                                      0.96316,
                                      0.0182517,
                                      1},
                                     {{{{-0.430295152, 0.204634667, 0.157481775},
                                        {1.6251292, -0.580969794, -0.0595405587},
                                        {1.12141546, 1.27810955, 0.131131302}}},
                                      {{{0.443350493, 0.615726192, 2.81353844},
                                        {0.639955965, 0.70326596, 3.1643704},
                                        {0.476506369, 0.706755376, 2.98757216}}},
                                      0.938536,
                                      0.0170029,
                                      1},
                                     {{{{-0.379765802, 0.12455508, -0.037698996},
                                        {1.15796331, -0.202921969, 0.101823545},
                                        {0.287203831, 1.15816816, -0.0795265899}}},
                                      {{{0.471730965, 0.382358092, 0.524573223},
                                        {0.86295452, 0.379474378, 0.762009492},
                                        {0.507820542, 0.472202312, 0.537931068}}},
                                      0.645226,
                                      0.313258,
                                      1},
                                     {{{{0.655416645, 0.363005615, 0.172561613},
                                        {1.42488091, 0.276261522, 0.113073607},
                                        {0.380669502, 0.594211943, 0.163054442}}},
                                      {{{-0.388329676, 0.236187372, 0.385200108},
                                        {1.40151225, -0.664569421, 0.600410982},
                                        {0.964578839, 1.0064649, 0.667246038}}},
                                      0.959505,
                                      0.0229341,
                                      0}}};
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit(-1, 1);
  int met = 0;
  for (const Found& f : all) {
    std::vector<Fibre> fibres;
    for (std::size_t k = 0; k < 3; ++k) fibres.push_back({f.inner[k], f.outer[k]});
    for (const int n : {1, 16, 128}) {
      const SlabMesh::Face face = {{0, 1, 2}, n};
      auto mesh = SlabMesh::make(fibres, std::span(&face, 1));
      ASSERT_TRUE(mesh);
      const SnapshotPtr model = displaced(std::make_shared<const SlabMesh>(*std::move(mesh)),
                                          [&](Vec3d) { return f.alpha == 1 ? 0.999 : 0.001; });
      const auto bare = testing::bare_triangles(*model);
      MicroTriangles surface(*model);
      for (int k = 0; k < 2000; ++k) {
        const SurfacePoint at = surface_point(*model, 0, f.u + 0.02 * unit(random), f.v + 0.01 * unit(random));
        const Vec3d side = Vec3d{unit(random), unit(random), unit(random)} * std::pow(10, -4 * std::abs(unit(random)));
        met += goes_in(surface, bare, at.position + side, at.position - side, k) ? 1 : 0;
        ASSERT_FALSE(HasFailure()) << "n " << n;
      }
    }
  }
  EXPECT_GT(met, 2000);
}

/// What stitching draws out of a square reaches over more of its slope than a cell does.
TEST(FirstEntry, MissesNothingBesideFewSamplesWhereHeightsSlope) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1, 1);
  int met = 0;
  for (int round = 0; round < 160; ++round) {
    const double turn = 2.4 * unit(random), depth = 0.15 + 0.45 * std::abs(unit(random)), lean = 0.4 * unit(random);
    const auto bent = bent_shell(*plane_shell(1, 1, depth), 0, turn, lean);
    if (!bent || least_jacobian(*bent) < 1e-3) continue;
    const auto mesh = with_intervals(*bent, 64, 1 << round % 5);
    ASSERT_TRUE(mesh);
    const double a = 3 * unit(random), b = 3 * unit(random);
    const SnapshotPtr model = displaced(std::make_shared<const SlabMesh>(*std::move(mesh)),
                                        [=](Vec3d p) { return std::clamp(0.5 + a * p.x + b * p.z, 0.0, 1.0); });
    met += send_ways(*model, 200, random);
    if (HasFailure()) return;
  }
  EXPECT_GT(met, 10'000);
}

/// Along a flat face, triangles are seen edge-on, and all that tells where a way crosses them is rounding. The place is
/// one on the way.
TEST(FirstEntry, IsOnTheWayAlsoAlongAFace) {
  std::mt19937 random(8);
  std::uniform_real_distribution<double> unit(-1, 1);
  int met = 0;
  for (int round = 0; round < 8; ++round) {
    const Vec3d up = normalized(Vec3d{unit(random), unit(random), unit(random)});
    const Vec3d right = normalized(cross(up, {1, 0.3, 0.2})), forward = cross(right, up);
    const auto mesh = testing::mapped_shell(*plane_shell(2, round % 2 == 0 ? 8 : 3),
                                            [=](Vec3d p) { return right * p.x + up * p.y + forward * p.z; });
    ASSERT_TRUE(mesh);
    const SnapshotPtr model = displaced(mesh, [](Vec3d) { return 0.5; });
    MicroTriangles surface(*model);
    const auto any_place = [&] {
      const double u = std::abs(unit(random)), v = (1 - u) * std::abs(unit(random));
      return surface.place_at(static_cast<SlabId>(random() % mesh->slab_count()), u, v)->position;
    };
    for (int k = 0; k < 300; ++k) {
      const Vec3d from = any_place(), to = any_place();
      const auto place = Sweep(surface, from, to, Crossing::Any).run();
      if (!place) continue;
      const double off = length(cross(place->position - from, to - from)) / length(to - from);
      ASSERT_LT(off, 1e-9) << "round " << round << " way " << k;
      ++met;
    }
  }
  EXPECT_GT(met, 1000);
}

}  // namespace
}  // namespace relief
