// What queries, ticks and dabs cost on a model before and after its slabs were cut where it is touched, in one run.
#include "../dab/strokes.h"
#include "../timing.h"
#include "clay.h"
#include "support/cuts.h"
#include "support/driver.h"
#include "support/held_tools.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace relief::bench {
namespace {

using nlohmann::ordered_json;

constexpr std::size_t kTicks = 20'000, kFewTicks = 1'000, kBlock = 500;
constexpr double kDeep = 0.01, kStep = 3e-4;  // model units, of which the diagonal has 3.5

double waves(Vec3d p) { return 0.5 + 0.05 * std::sin(5 * p.x) * std::cos(4 * p.y + 3 * p.z); }

/// Cursors on a turn about the model, so deep below its surface.
std::vector<Vec3d> turn(const Snapshot& model, double deep, std::size_t ticks) {
  std::vector<Vec3d> way;
  way.reserve(ticks);
  for (std::size_t k = 0; k < ticks; ++k) {
    const double t = kStep * static_cast<double>(k);
    const Vec3d out = normalized(Vec3d{std::cos(t), 0.3 * std::sin(3 * t), std::sin(t)});
    way.push_back(out * (length(raycast(model, {out * 2, -out})->point.position) - deep));
  }
  return way;
}

/// The model with all slabs near the way cut so many times, and n at least this where that is not 0.
SnapshotPtr cut_along(const SnapshotPtr& model, const std::vector<Vec3d>& way, int levels, int n) {
  testing::RandomCuts cuts(model);
  for (const Vec3d p : way) {
    LocateHint hint;
    const auto at = locate(cuts.model()->slab_mesh(), p, hint);
    if (at && cuts.model()->slab_mesh().level(at->slab) < levels) cuts.cut(at->slab);
  }
  Detail finer;
  for (SlabId s = 0; n > 0 && s < cuts.model()->slab_mesh().slab_count(); ++s)
    if (cuts.model()->slab_mesh().level(s) > 0) finer.grids.push_back({Layer::Displacement, s, n});
  return n > 0 ? *with_detail(cuts.model(), finer) : cuts.model();
}

/// Something that is asked at every place of the way.
using Ask = std::function<void(const Snapshot&, Vec3d)>;
struct Question {
  std::string name;
  double above = 0;          ///< of the way, model units
  std::size_t together = 1;  ///< so many are timed at a time, where one takes less than the clock
  std::function<Ask()> make;
};

std::vector<Question> questions() {
  std::vector<Question> all;
  all.push_back({"query", 0, 20, [] {
                   return [hint = std::make_shared<LocateHint>()](const Snapshot& model, Vec3d p) {
                     static_cast<void>(probe(model, p, *hint));
                   };
                 }});
  all.push_back({"locate, cold", 0, 20, [] {
                   return [](const Snapshot& model, Vec3d p) {
                     LocateHint hint;
                     static_cast<void>(locate(model.slab_mesh(), p, hint));
                   };
                 }});
  all.push_back({"nearest point", 0, 1, [] {
                   return [hint = std::make_shared<PickHint>()](const Snapshot& model, Vec3d p) {
                     static_cast<void>(closest_point(model, p, *hint));
                   };
                 }});
  for (const testing::HeldTool& held : testing::held_tools(0.04))
    all.push_back({"tick" + held.name, held.radius, 1, [held] {
                     ServoSettings settings = testing::settings_with(400, 1, 0.4);
                     settings.tool = held.tool();
                     return [hand = std::make_shared<testing::Driver>(settings, testing::strong_device()),
                             first = true](const Snapshot& model, Vec3d p) mutable {
                       // A rigid tool takes some ticks to see that it is in the open.
                       for (int k = std::exchange(first, false) ? 100 : 0; k > 0; --k)
                         static_cast<void>(hand->at(model, p * (1 + 1e-3 * k)));
                       static_cast<void>(hand->at(model, p));
                     };
                   }});
  return all;
}

/// Seconds of each tick, of each model: in turns, so that what else the machine does meets all alike.
std::vector<std::vector<double>> timed(const Question& question, const std::vector<SnapshotPtr>& models,
                                       const std::vector<Vec3d>& way) {
  const CallTimer time;
  std::vector<Ask> asks;
  for (std::size_t m = 0; m < models.size(); ++m) asks.push_back(question.make());
  std::vector<std::vector<double>> took(models.size());
  for (std::size_t from = 0; from < way.size(); from += kBlock)
    for (std::size_t m = 0; m < models.size(); ++m)
      for (std::size_t k = from; k < std::min(from + kBlock, way.size()); k += question.together) {
        const auto ask = [&] {
          for (std::size_t i = k; i < k + question.together; ++i)
            asks[m](*models[m], way[i] + normalized(way[i]) * question.above);
        };
        took[m].push_back(time(ask) / static_cast<double>(question.together));
      }
  return took;
}

/// A model, and one that is not cut and has the same spacing.
struct Case {
  const char* name;
  SnapshotPtr model, beside;
};

/// Median seconds of carving dabs of some 1,000 samples, over rounds in turns; first of the one, then of the other.
std::array<double, 2> dabs_of(const Case& of, const std::vector<Vec3d>& way, int rounds) {
  constexpr double kRadius = 0.12;  // model units: some 1,000 samples on grids like these
  constexpr int kStrokes = 6, kDabs = 30;
  std::array<std::vector<double>, 2> took;
  for (int round = 0; round < rounds; ++round)
    for (const std::size_t k : {0U, 1U}) {
      const SnapshotPtr& model = k == 0 ? of.model : of.beside;
      std::vector<SurfacePoint> starts;
      for (std::size_t place = 0; place < kStrokes; ++place)
        starts.push_back(closest_point(*model, way[place * way.size() / kStrokes]));
      took[k].push_back(median(run_strokes(model, starts, Tool::Carve, kRadius, kDabs).seconds));
    }
  return {median(took[0]), median(took[1])};
}

}  // namespace

ordered_json measure_readers(Extent extent) {
  const bool form = extent == Extent::Form;
  const SnapshotPtr model = testing::displaced(testing::sphere_shell(2, 32), waves);
  const std::vector<Vec3d> way = turn(*model, kDeep, form ? kFewTicks : kTicks);
  const auto finer = [&](int n) {
    Detail grids;
    for (SlabId s = 0; s < model->slab_mesh().slab_count(); ++s) grids.grids.push_back({Layer::Displacement, s, n});
    return *with_detail(model, grids);
  };
  const SnapshotPtr fine = finer(64), finest = finer(128);
  const std::vector<Case> all = {{"cut once, n 16, beside n 32", cut_along(model, way, 1, 0), model},
                                 {"cut twice, n 8, beside n 32", cut_along(model, way, 2, 0), model},
                                 {"cut once, n 32, beside n 64", cut_along(model, way, 1, 32), fine},
                                 {"cut twice, n 32, beside n 128", cut_along(model, way, 2, 32), finest}};
  ordered_json figures = ordered_json::array();
  const auto add = [&](const std::string& what, const char* on, double is, double beside) {
    ordered_json made = figure(what + " on cut slabs", on, is / beside, "times", at_most(1.1), "thread CPU");
    made["more"] = {{"us", 1e6 * is}, {"uncut, us", 1e6 * beside}};
    figures.push_back(std::move(made));
  };
  for (const Question& question : questions())
    for (const Case& one : all) {
      const auto took = timed(question, {one.model, one.beside}, way);
      add(question.name, one.name, median(took[0]), median(took[1]));
    }
  for (const Case& one : all) {
    const auto [is, beside] = dabs_of(one, way, form ? 1 : 5);
    add("dab", one.name, is, beside);
  }
  return figures;
}

}  // namespace relief::bench
