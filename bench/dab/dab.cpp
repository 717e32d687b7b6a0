#include "dab.h"

#include "../timing.h"
#include "cuts.h"
#include "kept.h"
#include "plain_mesh.h"
#include "strokes.h"
#include "support/shells.h"

#include <relief/base/try.h>
#include <relief/core/tessellate.h>
#include <relief/edit/stroke.h>

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <utility>

namespace relief::bench {

namespace {

using nlohmann::ordered_json;

constexpr const char* kThreadClock = "thread CPU";
/// Samples that a dab changes, and how that is said.
constexpr std::array<std::pair<const char*, double>, 3> kSizes = {{{"1k", 1e3}, {"10k", 1e4}, {"100k", 1e5}}};
constexpr double kMoveSeconds = 8e-3;  // after which a stroke's engine makes a dab in any case

/// What is measured for how long.
struct Plan {
  int level, intervals;       ///< of the sphere: 20 * 4^level slabs
  double share;               ///< of the samples of kSizes that dabs change
  int rounds, strokes, dabs;  ///< of each round
  std::vector<int> growth;    ///< cells along the sides of sheets
  int growth_rounds;
};

Plan plan_of(Extent extent) {
  switch (extent) {
    case Extent::Form:
      return {.level = 2,
              .intervals = 8,
              .share = 0.01,
              .rounds = 1,
              .strokes = 2,
              .dabs = 4,
              .growth = {6, 8},
              .growth_rounds = 1};
    case Extent::Long:
      return {.level = 5,
              .intervals = 32,
              .share = 1,
              .rounds = 9,
              .strokes = 8,
              .dabs = 60,
              .growth = {64, 101, 202},
              .growth_rounds = 25};
    case Extent::Usual:
      break;
  }
  return {.level = 4,
          .intervals = 32,
          .share = 1,
          .rounds = 3,
          .strokes = 5,
          .dabs = 30,
          .growth = {64, 101, 202},
          .growth_rounds = 7};
}

/// What a whole dab may take, us.
Goal goal_of(Tool tool, const char* size) {
  static const std::map<std::pair<Tool, std::string_view>, double> kGoals = {
      {{Tool::Carve, "10k"}, 60},     {{Tool::Carve, "100k"}, 400}, {{Tool::Deposit, "10k"}, 60},
      {{Tool::Deposit, "100k"}, 400}, {{Tool::Paint, "10k"}, 60},   {{Tool::Paint, "100k"}, 400},
      {{Tool::Smooth, "10k"}, 100},
  };
  const auto found = kGoals.find({tool, size});
  return found == kGoals.end() ? Goal{} : at_most(found->second);
}

std::optional<PlainMesh::Kernel> plain_kernel(Tool tool) {
  switch (tool) {
    case Tool::Carve:
      return PlainMesh::Kernel::Carve;
    case Tool::Deposit:
      return PlainMesh::Kernel::Deposit;
    case Tool::Paint:
      return PlainMesh::Kernel::Paint;
    case Tool::Smooth:
      return PlainMesh::Kernel::Smooth;
    default:
      return std::nullopt;
  }
}

class DabBench {
 public:
  explicit DabBench(Extent extent) : extent_(extent), plan_(plan_of(extent)) {}

  Status run() {
    out_["machine"] = to_json(this_machine());
    out_["machine"]["load_average_before"] = load_average();
    out_["rounds"] = plan_.rounds;
    out_["strokes"] = plan_.strokes;
    out_["dabs"] = plan_.dabs;
    out_["extent"] =
        extent_ == Extent::Long
            ? "With --long: 10,000 strokes through a file, and a save on 43 million samples."
            : "Without --long: 500 strokes through a file, not 10,000; a save on 2.6 million samples, not 43.";
    out_["figures"] = ordered_json::array();
    make_sphere();
    for (std::size_t tool = 0; tool < tools().size(); ++tool)
      for (const auto& [size, samples] : kSizes) whole_dabs(static_cast<Tool>(tool), size, samples * plan_.share);
    plain_.reset();
    for (const Tool tool : {Tool::Carve, Tool::Deposit, Tool::Paint, Tool::Smooth}) by_mouse(tool);
    grow();
    append(measure_memory(extent_));
    RELIEF_TRY(const ordered_json cuts, measure_cuts(extent_));
    append(cuts);
    RELIEF_TRY(const ordered_json kept, measure_file(extent_));
    append(kept);
    out_["machine"]["load_average_after"] = load_average();
    return {};
  }
  [[nodiscard]] ordered_json take() { return std::move(out_); }

 private:
  void append(const ordered_json& figures) {
    for (const ordered_json& each : figures) out_["figures"].push_back(each);
  }

  /// A sphere with waves and grain, so that there is something to even out.
  void make_sphere() {
    sphere_ = testing::displaced(testing::icosphere_shell(plan_.level, plan_.intervals, 0.7, 1.3), [](Vec3d p) {
      return 0.5 + 0.01 * std::sin(9 * p.x) * std::cos(7 * p.y + 4 * p.z) +
             0.0005 * std::sin(310 * p.x) * std::sin(290 * p.y) * std::cos(270 * p.z);
    });
    const SlabMesh& mesh = sphere_->slab_mesh();
    const auto triangles = static_cast<double>(mesh.slab_count()) * plan_.intervals * plan_.intervals;
    surface_ = fmt::format("sphere, {} slabs, n = {}", mesh.slab_count(), plan_.intervals);
    samples_per_area_ = triangles / 2 / (4 * std::numbers::pi);
    for (int k = 0; k < plan_.strokes; ++k) {
      const double z = 1 - (2.0 * k + 1) / plan_.strokes, turn = 2.4 * k;
      const double across = std::sqrt(1 - z * z);
      starts_.push_back(closest_point(*sphere_, {across * std::cos(turn), across * std::sin(turn), z}));
    }
    plain_.emplace(tessellate(*sphere_));
  }

  /// Of the tool that changes about so many samples: a guess.
  [[nodiscard]] double first_guess(Tool tool, double wanted) const {
    const double touched = std::sqrt(wanted / samples_per_area_ / std::numbers::pi);
    return tool == Tool::Carve ? touched / std::sqrt(2 * kCarveDepth) : touched;
  }

  ordered_json row(const std::string& name, const Rounds& rounds, Goal goal, double wanted) const {
    ordered_json made = figure(name, surface_, rounds.middle(), "us", goal, kThreadClock);
    made["percentiles"] = rounds.percentiles();
    made["more"] = {
        {"samples", rounds.samples()}, {"wanted", wanted}, {"least round", rounds.least()}, {"most", rounds.most()}};
    made["within_10_percent"] = rounds.samples() >= 0.9 * wanted && rounds.samples() <= 1.1 * wanted;
    return made;
  }

  void whole_dabs(Tool tool, const char* size, double wanted) {
    const SnapshotPtr model = with_layer(sphere_, tool, starts_.front());
    const Sized sized = find_radius(wanted, first_guess(tool, wanted), [&](double radius) {
      return median(run_strokes(model, starts_, tool, radius, std::min(plan_.dabs, 6)).samples);
    });
    radius_[{tool, size}] = sized.radius;
    Rounds rounds;
    for (int k = 0; k < plan_.rounds; ++k) rounds.add(run_strokes(model, starts_, tool, sized.radius, plan_.dabs));
    const std::string what = fmt::format("{}, {} samples", name(tool), size);
    out_["figures"].push_back(row(what + ", whole dab", rounds, goal_of(tool, size), wanted));
    out_["figures"].back()["more"]["end of the stroke"] = rounds.end();
    if (const auto kernel = plain_kernel(tool))
      on_plain_mesh(tool, *kernel, what, first_guess(tool, wanted), wanted, rounds.middle());
  }

  // ---- The plain mesh

  Dabs plain_strokes(Tool tool, PlainMesh::Kernel kernel, double radius, int dabs) {
    const CallTimer timer;
    Dabs all;
    const double rate = kernel == PlainMesh::Kernel::Deposit ? radius : info(tool).rate;
    plain_->begin_stroke();
    for (const SurfacePoint& start : starts_) {
      PickHint hint;
      for (int k = 0; k < dabs; ++k) {
        const SurfacePoint at = place_of(*sphere_, start, tool, radius, k, hint);
        const double up = kernel == PlainMesh::Kernel::Carve ? radius * (1 - kCarveDepth - kCarveSinks * k) : 0;
        const PlainMesh::Dab dab = {.kernel = kernel,
                                    .centre = to_float(at.position + at.normal * up),
                                    .up = to_float(at.normal),
                                    .radius = static_cast<float>(radius),
                                    .amount = static_cast<float>(0.3 * kDabSeconds * rate),
                                    .colour = {0.8F, 0.2F, 0.1F}};
        std::size_t changed = 0;
        all.seconds.push_back(timer([&] { changed = plain_->dab(dab); }));
        all.samples.push_back(static_cast<double>(changed));
      }
    }
    plain_->undo();
    return all;
  }

  void on_plain_mesh(Tool tool, PlainMesh::Kernel kernel, const std::string& what, double guess, double wanted,
                     double ours) {
    const Sized sized = find_radius(wanted, guess, [&](double radius) {
      return median(plain_strokes(tool, kernel, radius, std::min(plan_.dabs, 6)).samples);
    });
    Rounds rounds;
    for (int k = 0; k < plan_.rounds; ++k) rounds.add(plain_strokes(tool, kernel, sized.radius, plan_.dabs));
    ordered_json made = row(what + ", plain mesh", rounds, {}, wanted);
    made["more"]["times slabs"] = rounds.middle() / std::max(ours, 0.01);
    out_["figures"].push_back(std::move(made));
  }

  // ---- By mouse

  /// A mouse or pen at 125 Hz: its ray meets the newest surface, the engine makes one dab of the way to there. Carve
  /// stays in its place with more and more pressure, for the same reason as in run_strokes().
  void by_mouse(Tool tool) {
    const bool carves = tool == Tool::Carve;
    const double wanted = 1e4 * plan_.share, radius = radius_[{tool, "10k"}];
    const SnapshotPtr model = with_layer(sphere_, tool, starts_.front());
    Rounds rounds, picks;
    for (int round = 0; round < plan_.rounds; ++round) {
      Dabs all, picked;
      Editor editor(model);
      StrokeEngine engine(editor);
      std::size_t dabs = 0, samples = 0;
      engine.on_dab([&](const Dab&, const DabResult& result) {
        ++dabs;
        samples = result.samples;
      });
      const CallTimer timer;
      SnapshotPtr reader = editor.head();
      std::vector<SnapshotPtr> history;
      PickHint hint;
      for (const SurfacePoint& start : starts_) {
        history.push_back(editor.head());
        Brush brush = brush_of(tool, radius);
        if (carves) brush.strength = 1;
        engine.begin(brush);
        for (int k = 0; k < plan_.dabs; ++k) {
          const Vec3d at = start.position + aside(start.normal) * (radius * (carves ? 1e-4 : 0.05) * k);
          const Ray3d ray = {at + start.normal * 2.0, -start.normal};
          const double pressure = carves ? kCarveDepth + kCarveSinks * k : 1;
          dabs = 0;
          std::optional<RayHit> hit;
          const double pick = timer([&] { hit = raycast(*reader, ray, hint); });
          if (!hit) continue;
          const StrokePoint point = {.t = kMoveSeconds * k, .position = hit->point.position, .pressure = pressure};
          const double move = timer([&] {
            engine.move({&point, 1});
            reader = editor.head();
          });
          // The first point of a stroke takes no time, so it changes nothing but what Carve cuts.
          if (dabs != 1 || k == 0) continue;
          all.seconds.push_back(pick + move);
          all.samples.push_back(static_cast<double>(samples));
          picked.seconds.push_back(pick);
          picked.samples.push_back(0);
        }
        engine.end();
      }
      rounds.add(all);
      picks.add(picked);
    }
    ordered_json made =
        row(fmt::format("{}, 10k samples, by mouse, pick included", name(tool)), rounds, at_most(100), wanted);
    made["more"]["ray alone"] = picks.middle();
    out_["figures"].push_back(std::move(made));
  }

  // ---- More slabs

  /// Flat sheets of more and more cells, whose fibres, tool and places shrink with them, so that the same is done.
  void grow() {
    struct Sheet {
      SnapshotPtr model;
      std::vector<SurfacePoint> starts;
      double cell;
    };
    std::vector<Sheet> sheets;
    for (const int cells : plan_.growth) {
      Sheet sheet = {.model = Snapshot::make(testing::plane_shell(cells, plan_.intervals, 2.0 / cells)),
                     .starts = {},
                     .cell = 1.0 / cells};
      Editor editor(sheet.model);
      editor.begin_stroke(brush_of(Tool::Deposit, 1.5 * sheet.cell));
      for (int k = 0; k < plan_.strokes; ++k) {
        // From the sheet's middle; places a little apart from the same corner of a cell each.
        const Vec3d from = {(cells / 2 + (k % 3) * 0.37 + 0.2) * sheet.cell, 0,
                            (cells / 2 + (k / 3) * 0.41 + 0.3) * sheet.cell};
        sheet.starts.push_back(closest_point(*sheet.model, from));
        const SurfacePoint& at = sheet.starts.back();
        editor.dab({.slab = at.slab,
                    .contact = at.position + Vec3d{0.3, 0, 0.2} * sheet.cell,
                    .cursor = at.position,
                    .normal = at.normal,
                    .seconds = 0.1});
      }
      editor.end_stroke();
      sheet.model = editor.head();
      sheets.push_back(std::move(sheet));
    }
    const Sheet& least = sheets.front();
    for (const Tool tool : {Tool::Carve, Tool::Deposit, Tool::Paint, Tool::Smooth}) {
      std::vector<SnapshotPtr> models;
      for (const Sheet& sheet : sheets) models.push_back(with_layer(sheet.model, tool, sheet.starts.front()));
      const Sized sized = find_radius(1e3 * plan_.share, 0.5 * least.cell, [&](double radius) {
        return median(run_strokes(models.front(), least.starts, tool, radius, std::min(plan_.dabs, 6)).samples);
      });
      std::vector<Rounds> times(sheets.size());
      std::vector<std::vector<double>> ratios(sheets.size());
      std::vector<double> middle(sheets.size());
      for (int round = 0; round < plan_.growth_rounds; ++round)
        for (std::size_t k = 0; k < sheets.size(); ++k) {
          const double radius = sized.radius * sheets[k].cell / least.cell;
          const Dabs dabs = run_strokes(models[k], sheets[k].starts, tool, radius, plan_.dabs);
          times[k].add(dabs);
          middle[k] = std::max(median(dabs.seconds), 1e-9);
          ratios[k].push_back(middle[k] / middle[0]);
        }
      for (std::size_t k = 1; k < sheets.size(); ++k) {
        const std::size_t from = models[0]->slab_mesh().slab_count(), to = models[k]->slab_mesh().slab_count();
        ordered_json made = figure(fmt::format("{}, 1k samples, growth", name(tool)),
                                   fmt::format("sheets of {} and {} slabs", from, to), median(ratios[k]), "times",
                                   at_most(1.1), kThreadClock);
        made["more"] = {{"us", times[k].middle()},
                        {"us on fewest", times[0].middle()},
                        {"samples", times[k].samples()},
                        {"wanted", 1e3 * plan_.share}};
        made["within_10_percent"] = sized.is_near(1e3 * plan_.share);
        out_["figures"].push_back(std::move(made));
      }
    }
  }

  Extent extent_;
  Plan plan_;
  SnapshotPtr sphere_;
  std::string surface_;
  double samples_per_area_ = 1;
  std::vector<SurfacePoint> starts_;
  std::optional<PlainMesh> plain_;
  std::map<std::pair<Tool, std::string_view>, double> radius_;
  ordered_json out_;
};

}  // namespace

Result<ordered_json> measure_dabs(Extent extent) {
  DabBench bench(extent);
  RELIEF_CHECK(bench.run());
  return bench.take();
}

std::string dab_text(const ordered_json& dab) {
  const ordered_json& machine = dab["machine"];
  return figures_table(dab["figures"]) +
         fmt::format(
             "  {}, {} cores, {} KiB of cache each, {} MiB of last-level cache; load average {:.1f} before, {:.1f} "
             "after\n"
             "  Whole dab: the tool, the copies that undo needs, a new snapshot. The state before each stroke is held "
             "as undo does,\n"
             "  the newest snapshot as a reader does. Median over {} rounds of {} strokes of {} dabs; least and most "
             "round: of p50.\n"
             "  samples: changed by the median dab, copies at the slabs' borders counted; the radius was searched for "
             "that, and what\n"
             "  is not within 10 % of what was wanted is to be seen there. Carve stays and sinks a little with each "
             "dab, so that each\n"
             "  changes all under the ball; the others go a sixteenth of their radius.\n"
             "  Plain mesh: the same surface and places, 1024 vertices to a leaf, AVX2 where the compiler can; times "
             "slabs: what it\n"
             "  takes of the time of slabs. Ball cuts: 0.6 of the radius deep; distances within a spacing of the rim "
             "and inside it;\n"
             "  ripple: standard deviation of height and normal along curves beside the rim, less the true ones.\n"
             "  {}\n",
             machine["processor"].get<std::string>(), machine["cores"].get<unsigned>(),
             machine["level_2_cache_bytes"].get<std::size_t>() >> 10U,
             machine["last_level_cache_bytes"].get<std::size_t>() >> 20U, machine["load_average_before"].get<double>(),
             machine["load_average_after"].get<double>(), dab["rounds"].get<int>(), dab["strokes"].get<int>(),
             dab["dabs"].get<int>(), dab["extent"].get<std::string>());
}

}  // namespace relief::bench
