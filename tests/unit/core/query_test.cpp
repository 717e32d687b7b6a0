#include "support/shells.h"

#include <relief/core/query.h>
#include <relief/core/tessellate.h>

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace relief {
namespace {

using testing::displaced;
using testing::mixed_shell;
using testing::plane_shell;
using testing::sphere_shell;
using testing::torus_shell;
using testing::with_hole;

/// A random place well spread over a slab, edges and corners included now and then.
struct Places {
  std::mt19937_64 random{7};
  double unit() { return std::uniform_real_distribution<double>(0, 1)(random); }
  std::array<double, 3> weights() {
    const double a = unit(), b = unit();
    const double u = 1 - std::sqrt(a), v = b * std::sqrt(a);
    return {1 - u - v, u, v};
  }
  SlabId slab(const SlabMesh& mesh) { return static_cast<SlabId>(random() % mesh.slab_count()); }
};

std::vector<std::shared_ptr<const SlabMesh>> shells() {
  return {sphere_shell(2, 8), torus_shell(14, 9, 8, 0.3), plane_shell(6, 8),
          sphere_shell(2, 8, 0.8e-3, 1.2e-3, {1e3, -2e3, 5e2}), sphere_shell(2, 8, 0.8e6, 1.2e6, {1e7, 0, 0})};
}

TEST(Locate, FindsTheSlabAndPlaceOfPointsInside) {
  for (const auto& mesh : shells()) {
    Places places;
    LocateHint hint;
    for (int k = 0; k < 20000; ++k) {
      const SlabId slab = places.slab(*mesh);
      const auto w = places.weights();
      const double alpha = places.unit();
      const Vec3d p = mesh->corners(slab).point(w, alpha);
      if (std::min({w[0], w[1], w[2]}) < 1e-4) continue;
      const auto at = locate(*mesh, p, hint);
      ASSERT_TRUE(at);
      ASSERT_EQ(at->slab, slab);
      EXPECT_NEAR(at->u, w[1], 1e-7);
      EXPECT_NEAR(at->v, w[2], 1e-7);
      EXPECT_NEAR(at->alpha, alpha, 1e-7);
      const Vec3d back = mesh->corners(slab).point({1 - at->u - at->v, at->u, at->v}, at->alpha);
      EXPECT_LT(length(back - p), 1e-9 * diagonal(mesh->box(slab)));
      LocateHint none;
      EXPECT_EQ(locate(*mesh, p, none)->slab, slab);
    }
  }
}

TEST(Locate, PointsOutsideAllSlabsAreOutside) {
  const auto mesh = sphere_shell(3, 8);
  LocateHint hint;
  for (const Vec3d p : {Vec3d{0, 0, 0}, Vec3d{0.5, 0.1, 0.2}, Vec3d{1.3, 0, 0}, Vec3d{1e300, 0, 0}, Vec3d{NAN, 0, 0},
                        Vec3d{INFINITY, 0, 0}})
    EXPECT_FALSE(locate(*mesh, p, hint));
}

// Points exactly on shared walls and fibres, as far as doubles go: one owner, the same one from every hint.
TEST(Locate, AWallPointBelongsToExactlyOneSlab) {
  for (const auto& mesh : {sphere_shell(2, 8), torus_shell(14, 9, 8, 0.3)}) {
    Places places;
    for (int k = 0; k < 20000; ++k) {
      const SlabId slab = places.slab(*mesh);
      const auto edge = static_cast<std::size_t>(places.random() % 3);
      const double s = k % 10 == 0 ? 0.0 : k % 10 == 1 ? places.unit() * 1e-6 : places.unit();
      const double alpha = 0.05 + 0.9 * places.unit();
      std::array<double, 3> w{};
      w[(edge + 1) % 3] = 1 - s;
      w[(edge + 2) % 3] = s;
      Vec3d p = mesh->corners(slab).point(w, alpha);
      if (k % 3 == 0) p += Vec3d{places.unit() - 0.5, places.unit() - 0.5, places.unit() - 0.5} * 1e-12;
      const SlabId other = mesh->slabs()[slab].neighbours[edge];
      const auto& fibres = mesh->slabs()[slab].fibres;
      const FibreId a = fibres[(edge + 1) % 3], b = fibres[(edge + 2) % 3];
      EXPECT_NE(wall_side(*mesh, a, b, p), wall_side(*mesh, b, a, p));
      if (s > 1e-4 && s < 1 - 1e-4) {
        EXPECT_NE(owns(*mesh, slab, p), owns(*mesh, other, p)) << "both or neither of two slabs own the point";
      }
      LocateHint none;
      const auto owner = locate(*mesh, p, none);
      ASSERT_TRUE(owner);
      for (const SlabId start : {slab, other}) {
        LocateHint hint{{start, 1.0 / 3, 1.0 / 3, 0.5}};
        const auto again = locate(*mesh, p, hint);
        ASSERT_TRUE(again);
        EXPECT_EQ(again->slab, owner->slab) << "the owner depends on the hint";
      }
    }
  }
}

// Two cages whose slabs differ little in place and not in number, asked by turns.
TEST(Locate, AHintFromAnotherCageMisleadsNobody) {
  const std::array cages = {sphere_shell(2, 8, 0.8, 1.2), sphere_shell(2, 8, 0.81, 1.22)};
  Places places;
  LocateHint hint;
  for (int k = 0; k < 2000; ++k) {
    const auto w = places.weights();
    const Vec3d p = cages[0]->corners(places.slab(*cages[0])).point(w, 0.2 + 0.6 * places.unit());
    for (const auto& cage : cages) {
      LocateHint none;
      const auto at = locate(*cage, p, hint), afresh = locate(*cage, p, none);
      ASSERT_TRUE(at && afresh);
      ASSERT_EQ(at->slab, afresh->slab);
      ASSERT_NEAR(at->alpha, afresh->alpha, 1e-9);
    }
  }
}

TEST(Locate, BeyondAnOpenRimIsOutside) {
  const auto mesh = plane_shell(2, 4);
  LocateHint hint;
  EXPECT_TRUE(locate(*mesh, {1e-9, 0, 0.3}, hint));
  EXPECT_FALSE(locate(*mesh, {-1e-9, 0, 0.3}, hint));
}

TEST(Samples, SharedSamplesHaveOnePositionAndOneNormal) {
  for (const auto& mesh : {sphere_shell(2, 6), torus_shell(14, 9, 15, 0.3), plane_shell(3, 7),
                           mixed_shell(*sphere_shell(2, 1), 3, 3), mixed_shell(*torus_shell(14, 9, 1, 0.3), 1, 4)}) {
    const SnapshotPtr model = displaced(mesh, [](Vec3d p) { return 0.5 + 0.2 * std::sin(9 * p.x + 5 * p.y * p.z); });
    ASSERT_TRUE(validate(*model)) << validate(*model).error().message;
    for (SlabId s = 0; s < mesh->slab_count(); ++s)
      for (int edge = 0; edge < 3; ++edge)
        for (int t = 0; t < mesh->intervals(s); ++t) {
          const int n = mesh->intervals(s);
          const GridPoint at = edge_point(n, edge, t);
          mesh->for_each_copy(s, at, [&](const SampleCopy& copy) {
            EXPECT_EQ(sample_position(*model, copy.slab, copy.at), sample_position(*model, s, at));
            EXPECT_EQ(sample_normal(*model, copy.slab, copy.at), sample_normal(*model, s, at));
          });
        }
  }
}

TEST(Samples, NormalsOfASphereAreRadial) {
  const auto mesh = sphere_shell(4, 16);
  // The radius 1 is where 0.8 + 0.4 alpha, scaled by the chord's length, reaches it.
  SnapshotDraft draft(Snapshot::make(mesh));
  for (SlabId s = 0; s < mesh->slab_count(); ++s)
    for (int j = 0; j <= 16; ++j)
      for (int i = 0; i + j <= 16; ++i) {
        const double in = length(sample_position(*mesh, s, 16, {i, j}, 0));
        const double out = length(sample_position(*mesh, s, 16, {i, j}, 1));
        draft.edit(Layer::Displacement, s).plane()[sample_index(16, {i, j})] =
            static_cast<float>((1 - in) / (out - in));
      }
  const SnapshotPtr model = draft.finish();
  double worst = 0;
  for (SlabId s = 0; s < mesh->slab_count(); s += 7)
    for (int j = 0; j <= 16; ++j)
      for (int i = 0; i + j <= 16; ++i) {
        const Vec3d p = sample_position(*model, s, {i, j});
        ASSERT_NEAR(length(p), 1, 1e-7);
        worst = std::max(worst, length(cross(sample_normal(*model, s, {i, j}), normalized(p))));
      }
  EXPECT_LT(worst, 2e-3);
}

TEST(Samples, AConstrainedOneThatIsOffByOneBitIsFound) {
  const auto mesh = mixed_shell(*plane_shell(2, 1), 1, 3);
  const SnapshotPtr model = displaced(mesh, [](Vec3d p) { return 0.5 + 0.3 * std::sin(4 * p.x + 3 * p.z); });
  ASSERT_TRUE(validate(*model));
  std::size_t tried = 0;
  for (SlabId s = 0; s < mesh->slab_count(); ++s)
    mesh->for_each_constrained(s, [&](GridPoint p, const EdgePlace&) {
      SnapshotDraft draft(model);
      float& value = draft.edit(Layer::Displacement, s).plane()[sample_index(mesh->intervals(s), p)];
      value = std::nextafter(value, 1.0F);
      const SnapshotPtr off = draft.finish();
      const Status found = validate(*off);
      ASSERT_FALSE(found);
      EXPECT_EQ(found.error().message,
                "a sample does not follow from those that a coarser slab shares: displacement of slab " +
                    std::to_string(s) + " at sample (" + std::to_string(p.i) + ", " + std::to_string(p.j) + ")");
      EXPECT_FALSE(validate(*off, Layer::Displacement, s));
      ++tried;
    });
  EXPECT_GT(tried, 10U);
}

TEST(Samples, ConstrainedOnesLieBetweenTheirEndsFromEitherSide) {
  std::mt19937 random{3};
  std::uniform_real_distribution<float> unit(0, 1);
  Tile tile(8, 1, 0);
  for (int round = 0; round < 2000; ++round) {
    const EdgePlace place = {{0, 0}, {8, 0}, 1 + round % 7, 8}, turned = {{8, 0}, {0, 0}, 8 - place.k, 8};
    float &a = tile.plane()[0], &b = tile.plane()[8];
    a = unit(random);
    b = round % 5 == 0 ? a : unit(random);
    const float value = constrained_value(tile, Layer::Displacement, place);
    EXPECT_EQ(value, constrained_value(tile, Layer::Displacement, turned));
    EXPECT_EQ(value, static_cast<float>(double{a} + (double{b} - double{a}) * place.k / 8));
    EXPECT_TRUE(value >= std::min(a, b) && value <= std::max(a, b));
    EXPECT_EQ(constrained_value(tile, Layer::Void, place), place.k <= 4 ? a : b);
  }
}

TEST(SurfacePoint, NormalIsContinuousAcrossSlabEdges) {
  for (const auto& mesh : {torus_shell(14, 9, 8, 0.3), mixed_shell(*torus_shell(14, 9, 1, 0.3), 1, 4)}) {
    const SnapshotPtr model =
        displaced(mesh, [](Vec3d p) { return 0.5 + 0.2 * std::sin(7 * p.x) * std::cos(6 * p.z); });
    // Constrained samples are rounded to float.
    const double slack = mesh->slabs()[0].intervals == 8 ? 1e-12 : 1e-7;
    for (SlabId s = 0; s < mesh->slab_count(); ++s)
      for (int edge = 0; edge < 3; ++edge)
        for (double t = 0.03; t < 1; t += 0.07) {
          const auto k = static_cast<std::size_t>(edge);
          const SlabId other = mesh->slabs()[s].neighbours[k];
          const auto m = static_cast<std::size_t>(mesh->mirror_edge(s, edge));
          std::array<double, 3> here{}, there{};
          here[(k + 1) % 3] = 1 - t;
          here[(k + 2) % 3] = t;
          there[(m + 1) % 3] = t;
          there[(m + 2) % 3] = 1 - t;
          const SurfacePoint a = surface_point(*model, s, here[1], here[2]);
          const SurfacePoint b = surface_point(*model, other, there[1], there[2]);
          EXPECT_LT(length(a.position - b.position), slack);
          EXPECT_LT(length(a.normal - b.normal), slack);
        }
  }
}

TEST(Probe, CrossesABorderOfDifferentNWithoutAStep) {
  const auto mesh = mixed_shell(*plane_shell(3, 1, 0.25), 1, 4);
  const SnapshotPtr model = displaced(mesh, [](Vec3d p) { return 0.7 + 0.1 * std::sin(8 * p.x) * std::cos(9 * p.z); });
  LocateHint hint;
  std::optional<Contact> last;
  std::size_t borders = 0;
  constexpr double kStep = 2e-5;
  for (double x = 0.01; x < 0.99; x += kStep) {
    const auto now = probe(*model, {x, 0.0, 0.2 + 0.55 * x}, hint);
    ASSERT_TRUE(now && now->touching());
    if (last) {
      EXPECT_LT(std::abs(now->depth - last->depth), 2 * kStep);
      EXPECT_LT(length(now->surface.position - last->surface.position), 3 * kStep);
      EXPECT_LT(length(now->surface.normal - last->surface.normal), 30 * kStep);
      const int n = mesh->intervals(now->at.slab), before = mesh->intervals(last->at.slab);
      borders += n != before ? 1 : 0;
    }
    last = now;
  }
  EXPECT_GE(borders, 3U);
}

/// Everything the hint remembers (slab, cell, normals) must give what is found without it, to the bit.
TEST(Probe, RemembersNothingThatChangesAnAnswer) {
  const auto relief = [](Vec3d p) { return 0.5 + 0.2 * std::sin(9 * p.x + 5 * p.y * p.z); };
  const auto other = [](Vec3d p) { return 0.6 + 0.1 * std::cos(7 * p.y - 4 * p.z); };
  const auto hole = [](Vec3d p) { return std::sin(5 * p.x) * std::cos(6 * p.z) > 0.6; };
  LocateHint hint, located;  // carried over from model to model and from cage to cage
  int holes = 0, outside = 0, slabs = 0;
  for (const auto& mesh : {sphere_shell(2, 1), sphere_shell(2, 8), torus_shell(14, 9, 15, 0.3), plane_shell(6, 32),
                           mixed_shell(*plane_shell(3, 1, 0.25), 1, 4), mixed_shell(*sphere_shell(2, 1), 3, 3),
                           mixed_shell(*torus_shell(14, 9, 1, 0.3), 1, 4)}) {
    const std::array<SnapshotPtr, 3> models = {displaced(mesh, relief), displaced(mesh, other),
                                               with_hole(displaced(mesh, relief), hole)};
    Places places;
    SlabCoord hand = {.slab = 0, .u = 0.3, .v = 0.3, .alpha = 0.5};
    std::array<double, 2> way = {1, 0};
    for (int k = 0; k < 20000; ++k) {
      const int n = mesh->intervals(hand.slab);
      if (k % 100 == 0) way = {places.unit() - 0.5, places.unit() - 0.5};
      if (k % 500 == 0) {
        const auto w = places.weights();
        hand = {places.slab(*mesh), w[1], w[2], places.unit()};
      }
      // Some steps of a fraction of a cell; now and then onto a line of the grid.
      hand.u += way[0] / n;
      hand.v += way[1] / n;
      if (k % 7 == 0) hand.u = std::round(hand.u * n) / n;
      if (k % 11 == 0) hand.v = std::round(hand.v * n) / n;
      hand.alpha = std::clamp(hand.alpha + 0.02 * (places.unit() - 0.5), 0.0, 1.0);
      const Vec3d p = mesh->corners(hand.slab).point({1 - hand.u - hand.v, hand.u, hand.v}, hand.alpha);
      const Snapshot& model = *models[static_cast<std::size_t>(k / 50 % 3)];

      const auto contact = probe(model, p, hint);
      const auto at = locate(*mesh, p, located);
      LocateHint none;
      const auto afresh = locate(*mesh, p, none);
      ASSERT_EQ(contact.has_value(), at.has_value());
      ASSERT_EQ(contact.has_value(), afresh.has_value());
      if (!contact) {
        ++outside;
        hand = {places.slab(*mesh), 0.3, 0.3, 0.5};
        continue;
      }
      ASSERT_EQ(contact->at.slab, afresh->slab);
      EXPECT_NEAR(contact->at.u, afresh->u, 1e-9);
      EXPECT_NEAR(contact->at.v, afresh->v, 1e-9);
      EXPECT_NEAR(contact->at.alpha, afresh->alpha, 1e-9);
      ASSERT_EQ(contact->at.slab, at->slab);
      ASSERT_EQ(contact->at.u, at->u);
      ASSERT_EQ(contact->at.v, at->v);
      ASSERT_EQ(contact->at.alpha, at->alpha);

      const SurfacePoint known = contact->surface, found = surface_point(model, at->slab, at->u, at->v);
      ASSERT_EQ(known.slab, found.slab);
      ASSERT_EQ(known.u, found.u);
      ASSERT_EQ(known.v, found.v);
      ASSERT_EQ(known.alpha, found.alpha);
      ASSERT_EQ(known.position, found.position);
      ASSERT_EQ(known.normal, found.normal);
      ASSERT_EQ(contact->hole, hole_at(model, at->slab, at->u, at->v));
      ASSERT_EQ(contact->depth, !contact->hole && at->alpha < found.alpha ? length(found.position - p) : 0.0);
      holes += contact->hole ? 1 : 0;
      slabs += at->slab != hand.slab ? 1 : 0;
      hand = *at;
    }
  }
  EXPECT_GT(holes, 1000);
  EXPECT_GT(outside, 10);
  EXPECT_GT(slabs, 300);
}

TEST(Holes, AreNotTouchedHitOrNearest) {
  const auto hole = [](Vec3d p) { return p.x > 0.4 && p.x < 0.6 && p.z > 0.4 && p.z < 0.6; };
  for (const bool uniform : {true, false}) {
    const auto mesh = uniform ? plane_shell(3, 16, 0.25) : mixed_shell(*plane_shell(3, 1, 0.25), 4, 3);
    const SnapshotPtr model = with_hole(displaced(mesh, [](Vec3d) { return 0.75; }), hole);
    ASSERT_TRUE(validate(*model)) << validate(*model).error().message;
    constexpr double kMargin = 0.09;  // the longest micro-edge is shorter
    Places places;
    LocateHint hint;
    for (int k = 0; k < 4000; ++k) {
      const double x = places.unit(), z = places.unit(), aside = std::max(std::abs(x - 0.5), std::abs(z - 0.5)) - 0.1;
      const auto contact = probe(*model, {x, 0.05, z}, hint);
      ASSERT_TRUE(contact);
      const auto hit = raycast(*model, {{x, 1, z}, {0, -1, 0}});
      EXPECT_EQ(contact->hole, !contact->touching());
      if (uniform) {
        EXPECT_EQ(contact->hole, !hit.has_value()) << x << ' ' << z;
      }
      EXPECT_EQ(contact->hole, hole_at(*model, contact->at.slab, contact->at.u, contact->at.v));
      if (aside < -kMargin) {
        EXPECT_TRUE(contact->hole);
      }
      if (aside > kMargin) {
        EXPECT_FALSE(contact->hole);
        EXPECT_NEAR(contact->depth, 0.075, 1e-9);
        EXPECT_LT(length(contact->surface.normal - Vec3d{0, 1, 0}), 1e-9);
      }
      const SurfacePoint near = closest_point(*model, {x, 0.3, z});
      EXPECT_FALSE(hole_at(*model, near.slab, near.u, near.v) &&
                   std::max(std::abs(near.position.x - 0.5), std::abs(near.position.z - 0.5)) < 0.1 - kMargin);
      if (!contact->hole) {
        EXPECT_NEAR(length(near.position - Vec3d{x, 0.125, z}), 0, 1e-9);
      }
    }
  }
  const SnapshotPtr nothing = with_hole(Snapshot::make(plane_shell(1, 4)), [](Vec3d) { return true; });
  EXPECT_EQ(closest_point(*nothing, {0.5, 0, 0.5}).slab, kNoSlab);
}

/// The surface that bends at a rim is the one that is there: what fills a hole has no say in its normals.
TEST(Holes, DoNotBendNormalsAtTheirRims) {
  const auto mesh = torus_shell(14, 9, 8);
  const SnapshotPtr whole = displaced(mesh, [](Vec3d p) { return 0.5 + 0.2 * std::sin(9 * p.x + 5 * p.y * p.z); });
  const auto inside = [](Vec3d p) { return length(p - Vec3d{2, 1, 0}) < 0.8; };
  const SnapshotPtr open = with_hole(whole, inside);
  const Tessellation surface = tessellate(*open);
  ASSERT_LT(surface.triangles.size(), tessellate(*whole).triangles.size());
  std::vector<Vec3d> sums(surface.positions.size());
  for (const auto& [a, b, c] : surface.triangles) {
    const Vec3d area = cross(surface.positions[b] - surface.positions[a], surface.positions[c] - surface.positions[a]);
    for (const std::uint32_t v : {a, b, c}) sums[v] += area;
  }
  for (std::size_t v = 0; v < sums.size(); ++v)
    EXPECT_LT(length(normalized(sums[v]) - to_double(surface.normals[v])), 1e-6);
  std::size_t gone = 0;
  for (SlabId s = 0; s < mesh->slab_count(); ++s)
    if (length(sample_position(*open, s, {2, 3}) - Vec3d{2, 1, 0}) < 0.5) {
      EXPECT_EQ(sample_normal(*open, s, {2, 3}), Vec3d{});
      ++gone;
    }
  EXPECT_GT(gone, 0U);
}

TEST(Raycast, HitsTheSphereWhereItMust) {
  const SnapshotPtr model = displaced(sphere_shell(3, 8), [](Vec3d) { return 0.5; });
  Places places;
  for (int k = 0; k < 500; ++k) {
    const Vec3d direction = normalized(Vec3d{places.unit() - 0.5, places.unit() - 0.5, places.unit() - 0.5});
    const auto hit = raycast(*model, {direction * 5.0, direction * -2.0});
    ASSERT_TRUE(hit);
    EXPECT_NEAR(length(hit->point.position), 1, 0.02);
    EXPECT_NEAR(hit->distance * 2, 5 - length(hit->point.position), 1e-9);
    EXPECT_GT(dot(hit->point.normal, direction), 0.95);
    EXPECT_FALSE(raycast(*model, {direction * 5.0, direction}));
  }
}

TEST(Raycast, NothingPassesBetweenSlabsOfDifferentN) {
  const auto mesh = mixed_shell(*sphere_shell(1, 1), 1, 4);
  const SnapshotPtr model = displaced(mesh, [](Vec3d p) { return 0.5 + 0.3 * std::sin(5 * p.x + 3 * p.y); });
  const Tessellation surface = tessellate(*model);
  Places places;
  for (SlabId s = 0; s < mesh->slab_count(); ++s)
    for (int edge = 0; edge < 3; ++edge)
      for (int k = 0; k < 300; ++k) {
        // Towards points of an edge and a hair beside it, from outside: a crack would let the ray through to the far
        // side.
        std::array<double, 3> w{};
        const double t = places.unit();
        w[static_cast<std::size_t>((edge + 1) % 3)] = 1 - t;
        w[static_cast<std::size_t>((edge + 2) % 3)] = t;
        const Vec3d aim = mesh->corners(s).point(w, places.unit() * 0.4 + 0.3) * (1 + 1e-9 * places.unit());
        const auto hit = raycast(*model, {aim * 3.0, -aim});
        ASSERT_TRUE(hit);
        EXPECT_GT(dot(hit->point.position, aim), 0) << "passed through an edge";
      }
  // The nearest point is that of the stitched triangles.
  for (int k = 0; k < 100; ++k) {
    const Vec3d p = {places.unit() * 3 - 1.5, places.unit() * 3 - 1.5, places.unit() * 3 - 1.5};
    const SurfacePoint near = closest_point(*model, p);
    double nearest_vertex = 1e30;
    for (const Vec3d v : surface.positions) nearest_vertex = std::min(nearest_vertex, length(v - p));
    EXPECT_LE(length(near.position - p), nearest_vertex + 1e-12);
    double off = 1e30;  // from the planes of the triangles around it
    for (const auto& [a, b, c] : surface.triangles) {
      const Vec3d pa = surface.positions[a], pb = surface.positions[b], pc = surface.positions[c];
      const Vec3d n = cross(pb - pa, pc - pa), q = near.position;
      const double ua = dot(n, cross(pb - q, pc - q)), ub = dot(n, cross(pc - q, pa - q)),
                   uc = dot(n, cross(pa - q, pb - q)), all = dot(n, n);
      if (std::min({ua, ub, uc}) > -1e-9 * all) off = std::min(off, std::abs(dot(normalized(n), q - pa)));
    }
    EXPECT_LT(off, 1e-9);
  }
}

TEST(Layers, ColourInterpolatesOnItsOwnGrid) {
  SnapshotDraft draft(Snapshot::make(plane_shell(1, 4)));
  draft.add_layer(Layer::Colour, 2, 0);
  draft.edit(Layer::Colour, 0).set(0, sample_index(2, {1, 0}), 1);
  draft.edit(Layer::Colour, 0).set(2, sample_index(2, {2, 0}), 1);
  const SnapshotPtr model = draft.finish();
  EXPECT_NEAR(double{colour_at(*model, 0, 0.5, 0).x}, 1, 1e-6);
  EXPECT_NEAR(double{colour_at(*model, 0, 0.75, 0).x}, 0.5, 1e-6);
  EXPECT_NEAR(double{colour_at(*model, 0, 0.75, 0).z}, 0.5, 1e-6);
  EXPECT_EQ(layer_at(*model, Layer::Stiffness, 0, 0.2, 0.2, 0.625), 0.625);
}

}  // namespace
}  // namespace relief
