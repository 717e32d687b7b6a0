// A contact goes on in another cage: with each tool nothing is felt of a cut, and no more than the samples' own change
// where fibres move or grids get finer.
#include "support/cuts.h"
#include "support/driver.h"
#include "support/forbidden_calls.h"
#include "support/held_tools.h"
#include "support/longer_fibres.h"

#include <relief/core/micro_triangles.h>
#include <relief/haptics/contact/walk.h>
#include <relief/haptics/foothold.h>
#include <relief/haptics/texture_fade.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <random>
#include <string>
#include <vector>

namespace relief {
namespace {

using testing::cut_at_random;
using testing::displaced;
using testing::Driver;
using testing::HeldTool;
using testing::plane_shell;
using testing::RandomCuts;
using testing::sphere_shell;
using testing::torus_shell;
using testing::WatchedCalls;
using testing::with_longer_fibres;

constexpr double kStiffness = 400, kMetres = 0.1;  // N/m; m per model unit

double waves(Vec3d p) { return 0.5 + 0.1 * std::sin(5 * p.x) * std::cos(4 * p.y + 3 * p.z); }

/// The same surface with n doubled wherever it is below that.
SnapshotPtr with_finer_grids(const SnapshotPtr& model, int least, SlabId every) {
  Detail finer;
  for (SlabId s = 0; s < model->slab_mesh().slab_count(); s += every)
    finer.grids.push_back({Layer::Displacement, s, least});
  return *with_detail(model, finer);
}

/// So small, and of so few points, that all is done in the tick.
std::array<HeldTool, 3> tools() {
  std::array<HeldTool, 3> all = testing::held_tools(0.03);
  all[2].points = testing::sphere_points(14, all[2].radius);
  return all;
}

/// A way of the hand over a model: pressed in, led about, out and in again.
struct Way {
  std::string name;
  SnapshotPtr model;
  std::function<Vec3d(int tick)> at;  ///< of the hand, model units, for a tool of that radius on top of it
};

/// `n`: of the torus, the coarser the less a ball has to do in a tick where it meets two sides at once.
std::vector<Way> ways(double radius, int n = 16) {
  // How deep it is pressed: in from the air, and out and in again every 0.7 s.
  const auto depth = [](int tick) {
    const double t = 1e-3 * tick;
    return std::min(0.02 * std::clamp(2.5 + 4 * std::sin(9 * t), -0.5, 1.0), 0.1 * t - 0.02);
  };
  // Below where the surface is on the way from one place to another.
  const auto below = [=](const SnapshotPtr& model, Vec3d from, Vec3d to, int tick) {
    const Vec3d in = normalized(to - from);
    return raycast(*model, {from, in})->point.position + in * (depth(tick) - radius);
  };
  std::vector<Way> made;
  const SnapshotPtr sphere = displaced(sphere_shell(1, 32), waves);
  made.push_back({"sphere", sphere, [=](int tick) {
                    const double t = 1e-3 * tick;
                    const Vec3d way = {std::cos(1.1 * t), 0.8 * std::sin(0.9 * t), std::sin(1.1 * t) + 0.3};
                    return below(sphere, way * 2, {}, tick);
                  }});
  const SnapshotPtr sheet = displaced(plane_shell(3, 16), waves);
  made.push_back({"sheet", sheet, [=](int tick) {
                    const double t = 1e-3 * tick;
                    const Vec3d over = {0.5 + 0.3 * std::sin(1.3 * t), 1, 0.5 + 0.3 * std::cos(1.7 * t)};
                    return below(sheet, over, over - Vec3d{0, 1, 0}, tick);
                  }});
  const SnapshotPtr torus = displaced(torus_shell(16, 10, n), waves);
  made.push_back({"torus", torus, [=](int tick) {
                    const double t = 0.3e-3 * tick;
                    const Vec3d out = {std::cos(t) * std::cos(2 * t), std::sin(2 * t), std::sin(t) * std::cos(2 * t)};
                    const Vec3d middle = {2 * std::cos(t), 0, 2 * std::sin(t)};
                    return below(torus, middle + out * 2, middle, tick);
                  }});
  return made;
}

Driver driver(const HeldTool& held) {
  ServoSettings settings = testing::settings_with(kStiffness, 1, 0.4, kMetres);
  settings.tool = held.tool();
  settings.force.static_friction = 0.6;
  return {settings, testing::strong_device()};
}

/// What a run was like.
struct Felt {
  std::vector<ServoSample> samples;
  int touched = 0, flagged = 0, forbidden = 0;
  double largest_step = 0;  ///< N, from tick to tick

  void add(const ServoSample& now) {
    if (!samples.empty()) largest_step = std::max(largest_step, length(now.force - samples.back().force));
    touched += now.contact ? 1 : 0;
    flagged += now.flags != 0 ? 1 : 0;
    samples.push_back(now);
  }
};

Felt led(const HeldTool& held, const Way& way, int ticks, const std::function<SnapshotPtr(int tick)>& model_at) {
  Driver hand = driver(held);
  Felt made;
  made.samples.reserve(static_cast<std::size_t>(ticks));
  for (int k = 0; k < ticks; ++k) {
    const SnapshotPtr model = model_at(k);
    const Vec3d place = way.at(k);
    const WatchedCalls watched;
    const ServoSample now = hand.at(*model, place);
    made.forbidden += watched.calls().total();
    made.add(now);
  }
  return made;
}

void expect_no_fault(const Felt& made, int ticks) {
  EXPECT_EQ(made.flagged, 0);
  EXPECT_EQ(made.forbidden, 0);
  EXPECT_GT(made.touched, ticks / 2);
  EXPECT_LT(made.touched, ticks) << "it also leaves the surface and meets it again";
}

/// Of forces, and of contact points where both touch.
double farthest_apart(const Felt& a, const Felt& b) {
  double most = 0;
  for (std::size_t k = 0; k < a.samples.size(); ++k) {
    const ServoSample &one = a.samples[k], &other = b.samples[k];
    most = std::max(most, length(one.force - other.force));
    if (one.contact && other.contact) most = std::max(most, length(one.contact_point - other.contact_point));
  }
  return most;
}

constexpr int kTicks = 1400, kChanges = 1000;

/// Cages that are cut on and on, and then all of that undone, snapshot by snapshot.
std::vector<SnapshotPtr> cut_and_undone(const SnapshotPtr& model, int count) {
  RandomCuts cuts(model);
  std::vector<SnapshotPtr> made = {model};
  while (static_cast<int>(made.size()) < count / 2) {
    cuts.cut_one(2);
    if (cuts.model() != made.back()) made.push_back(cuts.model());
  }
  for (std::size_t k = made.size(); k-- > 0;) made.push_back(made[k]);
  return made;
}

/// The models in turn, one per tick, for kChanges ticks after the first contact.
std::function<SnapshotPtr(int tick)> in_turn(const std::vector<SnapshotPtr>& models) {
  return [models](int k) {
    return k < kTicks - kChanges ? models.front() : models[static_cast<std::size_t>(k) % models.size()];
  };
}
std::function<SnapshotPtr(int tick)> always(const SnapshotPtr& model) {
  return [model](int /*k*/) { return model; };
}

TEST(CageChange, OfCutsAndTheirUndoNothingIsFelt) {
  for (const HeldTool& held : tools())
    for (const Way& way : ways(held.radius, held.is_ball() ? 8 : 16)) {
      SCOPED_TRACE(way.name + held.name);
      const Felt still = led(held, way, kTicks, always(way.model));
      const Felt cut = led(held, way, kTicks, in_turn(cut_and_undone(way.model, 120)));
      expect_no_fault(still, kTicks);
      expect_no_fault(cut, kTicks);
      EXPECT_LE(farthest_apart(still, cut), 1e-9) << "N, and model units";
    }
}

TEST(CageChange, OnACutModelContactIsWhatItIsOnTheModelAsItWas) {
  for (const HeldTool& held : tools())
    for (const Way& way : ways(held.radius, held.is_ball() ? 8 : 16)) {
      SCOPED_TRACE(way.name + held.name);
      const SnapshotPtr cut = cut_at_random(way.model, 60, 2);
      EXPECT_LE(farthest_apart(led(held, way, kTicks, always(way.model)), led(held, way, kTicks, always(cut))), 1e-9);
    }
}

TEST(CageChange, OfLongerFibresNothingIsFeltButTheRoundingOfTheSamples) {
  for (const HeldTool& held : tools())
    for (const Way& way : ways(held.radius, held.is_ball() ? 8 : 16)) {
      SCOPED_TRACE(way.name + held.name);
      const Felt still = led(held, way, kTicks, always(way.model));
      const Felt moved = led(held, way, kTicks,
                             in_turn({way.model, with_longer_fibres(way.model, 0.2, 0.1),
                                      with_longer_fibres(way.model, 0, 0.3), with_longer_fibres(way.model, 0, 0)}));
      expect_no_fault(moved, kTicks);
      EXPECT_LE(farthest_apart(still, moved), held.is_ball() ? 3e-4 : 2e-6) << "N, and model units";
    }
}

TEST(CageChange, OfFinerGridsAndLongerFibresNoMoreIsFeltThanTheSurfaceMoves) {
  for (const HeldTool& held : testing::held_tools(0.04))
    for (const Way& way : ways(held.radius, held.is_ball() ? 8 : 16)) {
      SCOPED_TRACE(way.name + held.name);
      const SnapshotPtr longer = with_longer_fibres(way.model, 0.2, 0.1);
      const Felt still = led(held, way, kTicks, always(way.model));
      const Felt moved = led(held, way, kTicks,
                             in_turn({way.model, longer, with_finer_grids(way.model, 32, 3),
                                      with_finer_grids(longer, 32, 2), cut_at_random(longer, 30, 2)}));
      expect_no_fault(moved, kTicks);
      // A point on its way to a minimum is a little farther on where the surface has changed.
      EXPECT_LE(moved.largest_step, 1.01 * still.largest_step + 1e-3) << "N";
    }
}

TEST(CageChange, ThePapersContactGoesOn) {
  for (const Way& way : ways(0)) {
    SCOPED_TRACE(way.name);
    const SnapshotPtr longer = with_longer_fibres(way.model, 0.2, 0.1);
    const auto models = in_turn({way.model, longer, cut_at_random(longer, 30, 2), cut_at_random(way.model, 30, 2)});
    ServoSettings settings = testing::settings_with(kStiffness, 1, 0.4, kMetres);
    settings.force.paper_contact = true;
    Driver hand(settings, testing::strong_device()), still(settings, testing::strong_device());
    for (int k = 0; k < kTicks; ++k) {
      const ServoSample now = hand.at(*models(k), way.at(k)), there = still.at(*way.model, way.at(k));
      ASSERT_EQ(now.flags, 0U);
      ASSERT_NEAR(length(now.force - there.force), 0, 1e-4);
    }
  }
}

TEST(CageChange, AHeldAnswerSpeaksOfTheCageThatItIsGivenFor) {
  const Way way = ways(0).front();
  const SnapshotPtr cut = cut_at_random(way.model, 60, 3);
  Servo servo({.workspace = {.metres_per_unit = kMetres}}, DeviceInfo{});
  DeviceState reading;
  ServoSample felt;
  for (int k = 0; k <= 400; ++k) {
    reading.t = 1e-3 * k;
    reading.position = servo.settings().workspace.to_device(way.at(k));
    felt = servo.step(*cut, reading);
  }
  ASSERT_TRUE(felt.contact);
  ASSERT_GE(felt.at.slab, way.model->slab_mesh().slab_count());
  const Vec3d there = felt.contact_point;
  felt = servo.step(*way.model, reading);
  ASSERT_LT(felt.at.slab, way.model->slab_mesh().slab_count());
  EXPECT_NEAR(length(surface_point(*way.model, felt.at.slab, felt.at.u, felt.at.v).position - there), 0, 1e-3);
}

TEST(CageChange, WalksOverACutSurfaceEndWhereTheyEndedBefore) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(0, 1);
  for (const Way& way : ways(0)) {
    SCOPED_TRACE(way.name);
    const SnapshotPtr cut = cut_at_random(way.model, 60, 3);
    const SlabMesh& mesh = way.model->slab_mesh();
    MicroTriangles before(*way.model), after(*cut);
    for (int k = 0; k < 3000; ++k) {
      const auto slab = static_cast<SlabId>(random() % mesh.slab_count());
      const double u = 0.5 * unit(random), v = 0.5 * unit(random);
      const auto there = heir(mesh, cut->slab_mesh(), {slab, u, v, 0.5});
      const auto from = before.place_at(slab, u, v), same = after.place_at(there->slab, there->u, there->v);
      ASSERT_TRUE(from && same);
      const Vec3d goal =
          from->position + (Vec3d{unit(random), unit(random), unit(random)} - Vec3d{0.5, 0.5, 0.5}) * 0.3;
      const detail::Descent a = detail::descend(before, *from, goal), b = detail::descend(after, *same, goal);
      ASSERT_EQ(a.ended, b.ended);
      ASSERT_NEAR(a.way, b.way, 1e-12);
      ASSERT_NEAR(length(a.rest.position - b.rest.position), 0, 1e-12);
      ASSERT_EQ(detail::leads_into_air(before, a.rest, goal), detail::leads_into_air(after, b.rest, goal));
    }
  }
}

TEST(CageChange, TextureFadesAsOnTheModelAsItWas) {
  // Waves of 2.5 spacings, run over so fast that they are faded out.
  const SnapshotPtr model =
      displaced(plane_shell(2, 32), [](Vec3d p) { return 0.5 + 0.02 * std::sin(2 * 3.14159 * p.x / 0.04); });
  const SnapshotPtr cut = cut_at_random(model, 30, 3), longer = with_longer_fibres(model, 0.4, 0.1);
  TextureFade before, after, lengthened;
  LocateHint hint;
  double most = 0;
  for (int k = 0; k < 300; ++k) {
    const double t = 0.08 * k;
    const auto at = locate(model->slab_mesh(), {0.5 + 0.4 * std::sin(t), 0, 0.3}, hint);
    ASSERT_TRUE(at);
    const SurfacePoint place = surface_point(*model, at->slab, at->u, at->v);
    const auto there = heir(model->slab_mesh(), cut->slab_mesh(), *at);
    const auto step = [](TextureFade& fade, const Snapshot& on, SurfacePoint touched) {
      return fade.step(on, {touched, {0, 1, 0}, touched.position}, 1e-6);
    };
    const TextureFade::Fade a = step(before, *model, place);
    const TextureFade::Fade b = step(after, *cut, surface_point(*cut, there->slab, there->u, there->v));
    const SnapshotPtr other = k == 150 ? longer : model;
    const TextureFade::Fade c = step(lengthened, *other, surface_point(*other, at->slab, at->u, at->v));
    ASSERT_NEAR(a.share, b.share, 1e-9);
    ASSERT_NEAR(length(a.above - b.above), 0, 1e-9);
    ASSERT_NEAR(a.share, c.share, 0.3) << k;
    ASSERT_LT(length(c.above), 0.02) << "where fibres begin is no wave";
    most = std::max(most, a.share);
  }
  EXPECT_GT(most, 0.9);
}

/// The places of one cage in another one.
class FootholdIn {
 public:
  FootholdIn(const SnapshotPtr& from, SlabCoord at) : at_(at) {
    MicroTriangles surface(*from);
    position_ = surface.place_at(at.slab, at.u, at.v)->position;
    foothold_.stand_in(from->slab_mesh(), at.slab);
  }
  [[nodiscard]] std::optional<SurfacePlace> find(const SnapshotPtr& model) const {
    MicroTriangles surface(*model);
    return foothold_.find(surface, at_, position_);
  }
  /// Returns what finding it took, in the time of a sample.
  [[nodiscard]] int work(const SnapshotPtr& model) const {
    MicroTriangles surface(*model);
    static_cast<void>(foothold_.find(surface, at_, position_));
    return surface.placed();
  }
  [[nodiscard]] double moved(const SnapshotPtr& model) const {
    const auto place = find(model);
    return place ? length(place->position - position_) : 1e9;
  }

 private:
  SlabCoord at_;
  Vec3d position_;
  detail::Foothold foothold_;
};

TEST(Foothold, WhatWasOnAnEdgeOfAMicroTriangleIsOnItToTheBit) {
  const SnapshotPtr model = displaced(plane_shell(1, 24), waves);
  const SnapshotPtr cut = cut_at_random(model, 20, 3);
  for (int i = 1; i < 12; ++i)
    for (const double part : {0.1, 0.3, 0.77}) {
      const FootholdIn on_edge(model, {0, (i + part) / 24, 5.0 / 24, 0.5});
      const auto place = on_edge.find(cut);
      ASSERT_TRUE(place);
      EXPECT_EQ(std::ranges::count(place->weights, 0.0), 1) << i;
    }
}

TEST(Foothold, InACageOfOtherRootsItIsTheNearestPlaceWithinTwoSpacings) {
  // A sheet that ends so far before the place; the samples' spacing is 1/16, or sqrt(2) of that along the diagonals.
  const SnapshotPtr sheet = displaced(plane_shell(1, 16), [](Vec3d) { return 0.5; });
  const double spacing = std::sqrt(2.0) / 16;
  for (const double beyond : {1.9, 2.1}) {
    std::vector<Fibre> fibres(sheet->slab_mesh().fibres().begin(), sheet->slab_mesh().fibres().end());
    for (Fibre& f : fibres) {
      f.inner.x -= 0.5 + beyond * spacing;
      f.outer.x -= 0.5 + beyond * spacing;
    }
    std::vector<SlabMesh::Face> faces;
    for (const Slab& slab : sheet->slab_mesh().slabs()) faces.push_back({slab.fibres, slab.intervals});
    const SnapshotPtr aside =
        Snapshot::make(std::make_shared<const SlabMesh>(*SlabMesh::make(std::move(fibres), faces)));
    LocateHint hint;
    const auto at = locate(sheet->slab_mesh(), {0.5, 0, 0.55}, hint);
    ASSERT_TRUE(at);
    const FootholdIn middle(sheet, *at);
    if (beyond < 2)
      EXPECT_NEAR(middle.moved(aside), beyond * spacing, 1e-9);
    else
      EXPECT_FALSE(middle.find(aside));
    // No tree leads there, nor the place's own fibre: the surface is searched, which takes some four microseconds in
    // all.
    EXPECT_NEAR(middle.work(aside), 4 + 40 + 120, 10) << beyond;
  }
}

TEST(Foothold, WhereACutHasOpenedAHoleItIsOnItsRim) {
  const SnapshotPtr sheet = displaced(plane_shell(1, 16), [](Vec3d) { return 0.5; });
  const SnapshotPtr cut = cut_at_random(sheet, 3, 2);
  const auto with_hole_of = [&](double radius) {
    return testing::with_hole(cut, [=](Vec3d p) { return std::hypot(p.x - 0.5, p.z - 0.3) < radius; });
  };
  LocateHint hint;
  const auto at = locate(sheet->slab_mesh(), {0.5, 0, 0.3}, hint);
  ASSERT_TRUE(at);
  const FootholdIn place(sheet, *at);
  EXPECT_LT(place.moved(cut), 1e-9);
  EXPECT_NEAR(place.work(cut), 4 + 3, 1) << "the cut's own tree says where it is, and three samples are placed";
  EXPECT_NEAR(place.moved(with_hole_of(0.08)), 0.05, 0.05);
  EXPECT_FALSE(place.find(with_hole_of(0.4)));
}

}  // namespace
}  // namespace relief
