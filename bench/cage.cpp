// What queries and ticks cost on a model before and after its slabs were cut where it is touched, in one run.
#include "support/cuts.h"
#include "support/driver.h"
#include "support/held_tools.h"
#include "timing.h"

#include <fmt/format.h>

#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace relief::bench {
namespace {

constexpr int kTicks = 20'000, kBlock = 500;
constexpr double kDeep = 0.01, kStep = 3e-4;  // model units, of which the diagonal has 3.5

double waves(Vec3d p) { return 0.5 + 0.05 * std::sin(5 * p.x) * std::cos(4 * p.y + 3 * p.z); }

/// Cursors on a turn about the model, so deep below its surface.
std::vector<Vec3d> turn(const Snapshot& model, double deep) {
  std::vector<Vec3d> way;
  way.reserve(kTicks);
  for (int k = 0; k < kTicks; ++k) {
    const double t = kStep * k;
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

double at(std::vector<double> values, double share) {
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))] * 1e6;
}

void run(const std::string& only) {
  const SnapshotPtr model = testing::displaced(testing::sphere_shell(2, 32), waves);
  const std::vector<Vec3d> way = turn(*model, kDeep);
  const auto finer = [&](int n) {
    Detail grids;
    for (SlabId s = 0; s < model->slab_mesh().slab_count(); ++s) grids.grids.push_back({Layer::Displacement, s, n});
    return *with_detail(model, grids);
  };
  // The same spacing each time, as it is and after cuts.
  struct Case {
    std::string name;
    SnapshotPtr model;
    std::size_t beside;  ///< number of the one that is not cut
  };
  const std::vector<Case> all = {{"n 32", model, 0},
                                 {"cut once, n 16", cut_along(model, way, 1, 0), 0},
                                 {"cut twice, n 8", cut_along(model, way, 2, 0), 0},
                                 {"n 64", finer(64), 3},
                                 {"cut once, n 32", cut_along(model, way, 1, 32), 3},
                                 {"n 128", finer(128), 5},
                                 {"cut twice, n 32", cut_along(model, way, 2, 32), 5}};
  std::vector<SnapshotPtr> models;
  for (const Case& one : all) models.push_back(one.model);
  fmt::print("thread CPU in us: p50, p99.9, mean, and as shares of those not cut\n");
  for (const Question& question : questions()) {
    if (!only.empty() && question.name != only) continue;
    const auto took = timed(question, models, way);
    const auto mean = [&](std::size_t m) {
      double sum = 0;
      for (const double t : took[m]) sum += t;
      return sum / static_cast<double>(took[m].size()) * 1e6;
    };
    for (std::size_t m = 0; m < models.size(); ++m)
      fmt::print("{:18} {:18} {:6} slabs {:8.3f} {:8.3f} {:8.3f}   {:5.2f} {:5.2f} {:5.2f}\n", question.name,
                 all[m].name, models[m]->slab_mesh().slab_count(), at(took[m], 0.5), at(took[m], 0.999), mean(m),
                 at(took[m], 0.5) / at(took[all[m].beside], 0.5), at(took[m], 0.999) / at(took[all[m].beside], 0.999),
                 mean(m) / mean(all[m].beside));
  }
}

}  // namespace
}  // namespace relief::bench

/// The name of a question, or none: all of them.
int main(int count, char** arguments) { relief::bench::run(count > 1 ? arguments[1] : ""); }
