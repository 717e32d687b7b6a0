#include "clay.h"

#include "../dab/cuts.h"
#include "support/cuts.h"
#include "support/data.h"
#include "support/taps.h"

#include <relief/base/cpu_time.h>
#include <relief/base/try.h>
#include <relief/convert/convert.h>
#include <relief/convert/refine.h>
#include <relief/convert/room.h>
#include <relief/core/clay.h>
#include <relief/mesh/import.h>
#include <relief/mesh/samples.h>
#include <relief/session/document.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <numbers>
#include <random>
#include <thread>
#include <utility>
#include <vector>

namespace relief::bench {

namespace {

using nlohmann::ordered_json;
using testing::Misses;
using testing::Tap;
using testing::Taps;

constexpr const char* kNoClock = "none";

/// How many of each.
struct Plan {
  int balls, cuts, places, rounds, conversions;
};
Plan plan_of(Extent extent) {
  switch (extent) {
    case Extent::Form:
      return {.balls = 2, .cuts = 1, .places = 2, .rounds = 2, .conversions = 1};
    case Extent::Long:
      return {.balls = 100, .cuts = 50, .places = 20, .rounds = 10, .conversions = 3};
    case Extent::Usual:
      break;
  }
  return {.balls = 25, .cuts = 10, .places = 20, .rounds = 10, .conversions = 1};
}

struct Subject {
  std::string name;
  TriangleMesh mesh;
};
Result<std::vector<Subject>> subjects(Extent extent) {
  std::vector<Subject> all;
  if (extent == Extent::Form) {
    RELIEF_TRY(TriangleMesh mesh, make_sample("head", 4'000));
    all.push_back({"sample head", std::move(mesh)});
    return all;
  }
  for (const char* file :
       {"a_models/pumpkin.ply", "a_models/head_lps.ply", "a_models/bunny.ply", "b_bad/variant/sphere.stl"}) {
    const std::filesystem::path place = testing::data_folder() / file;
    if (!std::filesystem::exists(place)) continue;
    RELIEF_TRY(TriangleMesh mesh, import_mesh(place));
    all.push_back({place.stem().string(), std::move(mesh)});
  }
  for (const char* name : {"head", "pumpkin"}) {
    if (!all.empty()) break;
    RELIEF_TRY(TriangleMesh mesh, make_sample(name, 100'000));
    all.push_back({std::string("sample ") + name, std::move(mesh)});
  }
  return all;
}

std::size_t samples_of(const Snapshot& model) {
  std::size_t sum = 0;
  for (const Slab& slab : model.slab_mesh().slabs()) sum += sample_count(slab.intervals);
  return sum;
}

/// The value that so many of a hundred do not exceed; 0 of none.
double percentile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

/// A converted model and its figures.
class Clay {
 public:
  Clay(std::string name, Model model, Extent extent, ordered_json& figures)
      : name_(std::move(name)),
        model_(std::move(model)),
        diagonal_(model_.info.source_diagonal),
        plan_(plan_of(extent)),
        figures_(figures) {}

  void of_conversion(double beside_thin) {
    const relief::Clay clay = measure_clay(*model_.head, diagonal_);
    const auto side = [&](const char* which, const ClaySide& of) {
      add(fmt::format("clay {}, least of a default conversion's fibres", which), 100 * of.least, "% of D", {},
          {{"one in ten", 100 * of.tenth}, {"median", 100 * of.median}, {"share under 2 %", 100 * of.thin_fibres}});
    };
    side("below", clay.below);
    side("above", clay.above);
    const auto [deep, thick] = deep_fibres();
    add("fibres with 5 % below, of those where the body is 20 % thick", thick > 0 ? 100.0 * deep / thick : 100, "%",
        at_least(85), {{"fibres", thick}});
    add("conversion, beside --thickness 0.1", beside_thin, "times", at_most(1.2), {}, "process CPU");
  }

  void of_small_balls() {
    constexpr double kRadius = 0.005, kDepth = 0.6 * kRadius;  // of the diagonal
    // What a grid of r / 12 gives beside the crease between samples, at the slope of this rim (cuts with a clip).
    const double slope = std::sqrt(1 - 0.4 * 0.4) / 0.4, crease = 0.3 * (kRadius / 12) * slope * diagonal_;
    Taps taps(model_.head, diagonal_, 3);
    std::vector<double> rms, most;
    double told = 0, off = 0;
    for (int k = 0; k < plan_.balls; ++k) {
      const Tap tap = taps.next(kRadius * diagonal_, kDepth * diagonal_).with(true, kDetail);
      const auto [result, after] = with_room(tap.stroke);
      const Misses found = testing::misses(*model_.head, *after, tap);
      const double share = 100 * found.rms / tap.depth;
      off += share > 5 ? 1 : 0;
      if (result.limited > 0 || result.beside || result.missed > 0) {
        ++told;
        continue;
      }
      rms.push_back(share);
      most.push_back(std::max(found.left, found.too_much) / crease);
    }
    add("ball of 0.5 % of the diagonal, places over 5 % of its depth off, told ones included", off / plan_.balls * 100,
        "%", at_most(0), {{"places", plan_.balls}, {"told", told}});
    add("ball of 0.5 % of the diagonal, rms of its depth, the worst place not told", percentile(rms, 1), "%",
        at_most(5), {{"median", percentile(rms, 0.5)}});
    add("ball of 0.5 % of the diagonal, largest miss not told, of 0.3 spacings times the slope", percentile(most, 1),
        "times", at_most(1));
  }

  /// A place is reached where next to no sample ends before the tool does, and the cut is the ball's. Where the form
  /// itself ends or folds in the ball, no height over the surface can be the cut: those places are counted apart.
  void of_deep_cuts(double radius, double depth, double most_rms, double most_left_out) {
    Taps taps(model_.head, diagonal_, 5);
    std::vector<double> rms, saturated, seconds;
    double left_out = 0, untold = 0, other = 0, other_left_out = 0;
    for (int k = 0; k < plan_.cuts; ++k) {
      const Tap tap = taps.next(radius * diagonal_, depth * diagonal_, 3 * depth * diagonal_).with(true, 1.0 / 40);
      const double before = process_cpu_seconds();
      const auto [result, after] = with_room(tap.stroke);
      seconds.push_back(process_cpu_seconds() - before);
      const Misses found = testing::misses(*model_.head, *after, tap);
      const double ends = static_cast<double>(result.limited) / std::max(1.0, static_cast<double>(result.samples));
      const double off = found.rms / tap.depth;
      constexpr double kFew = 1e-3;  // of the samples, or of the ball
      const bool is_beyond = testing::beyond_heights(*model_.head, tap, diagonal_) > kFew;
      other += is_beyond ? 1 : 0;
      if (ends > kFew || off > most_rms) {
        ++(is_beyond ? other_left_out : left_out);
        untold += result.limited == 0 && !result.beside && result.missed == 0 ? 1 : 0;
        continue;
      }
      rms.push_back(100 * off);
      saturated.push_back(100 * ends);
    }
    const std::string cut = fmt::format("cut of {:g} % of the diagonal", 100 * depth);
    const auto share_of = [](double part, double all) { return all > 0 ? 100 * part / all : 0; };
    add(cut + ", places not reached", share_of(left_out, plan_.cuts - other), "%", at_most(100 * most_left_out),
        {{"places", plan_.cuts - other}, {"of these not told", untold}, {"CPU s, the slowest", percentile(seconds, 1)}},
        "process CPU");
    add(cut + ", places not reached where the form ends or folds in the ball", share_of(other_left_out, other), "%", {},
        {{"places", other}});
    add(cut + ", rms of its depth where reached, the worst", percentile(rms, 1), "%", at_most(100 * most_rms),
        {{"median", percentile(rms, 0.5)}});
    add(cut + ", samples at the end of their fibres where reached, the worst", percentile(saturated, 1), "%",
        at_most(0.1));
  }

  void of_fine_places() {
    constexpr double kRadius = 0.005, kSpacing = 5e-4;  // of the diagonal
    Taps taps(model_.head, diagonal_, 7);
    std::vector<Tap> all;
    for (int k = 0; k < plan_.places; ++k)
      all.push_back(taps.next(kRadius * diagonal_, 0.6 * kRadius * diagonal_).with(true, kSpacing / kRadius));
    Editor editor(model_.head);
    const double before = thread_cpu_seconds();
    for (const Tap& tap : all) static_cast<void>(play(editor, tap.stroke));
    const double seconds = thread_cpu_seconds() - before, places = plan_.places;
    const Snapshot& after = *editor.head();
    const double slabs = after.slab_mesh().slab_count() - model_.head->slab_mesh().slab_count();
    add("slabs added per place, r 0.005, s 5e-4", slabs / places, "", at_most(90),
        {{"slabs before", model_.head->slab_mesh().slab_count()}});
    const auto was = static_cast<double>(samples_of(*model_.head)), is = static_cast<double>(samples_of(after));
    add("samples of the model after such places", is / was, "times", at_most(1.05),
        {{"added per place", (is - was) / places}, {"places", places}});
    const auto bytes = static_cast<double>(after.bytes()) - static_cast<double>(model_.head->bytes());
    add("memory added per place", bytes / places, "bytes", {});
    add("time of a place", 1e3 * seconds / places, "ms", {}, {}, "thread CPU");
    add("finer grids move the surface", moved_by(after), "of alpha", at_most(2e-7));
    add("least angle after 20 generations, of its root's", least_angle(20), "times", at_least(0.5));
  }

  /// Cuts and refine in turn in one place: slabs that stand away from it and whose fibres and grids stay. Refine gives
  /// slabs that lean finer grids, wherever they are; how many is told.
  void of_repeated_work() {
    const double radius = 0.02 * diagonal_;
    const Tap tap = Taps(model_.head, diagonal_, 9).next(radius, 0.25 * radius).with(true, kDetail);
    Model now = model_;
    for (int round = 0; round < plan_.rounds; ++round) {
      Stroke deeper = tap.stroke;
      for (StrokePoint& p : deeper.points) p.position = tap.low - tap.normal * (0.7 * radius * round);
      now.head = with_room(deeper, now).second;
      if (const auto refined = refine(now, RefineWhere::Saturated); refined && refined->model.head)
        now.head = refined->model.head;
    }
    const SlabMesh &was = model_.head->slab_mesh(), &is = now.head->slab_mesh();
    const std::vector<RootPlace> parts = parts_after(was, is);
    double same = 0, compared = 0, finer = 0;
    for (SlabId s = 0; s < was.slab_count(); ++s) {
      if (was.box(s).distance2(tap.low) < 16 * radius * radius || parts[s].level > 0 || !stands(was, is, s)) continue;
      if (was.intervals(s) != is.intervals(s)) {
        ++finer;
        continue;
      }
      ++compared;
      const float *a = model_.head->displacement(s), *b = now.head->displacement(s);
      const auto count = sample_count(was.intervals(s));
      same += std::equal(a, a + count, b) ? 1 : 0;
    }
    add(fmt::format("slabs not touched, the same bits after {} rounds of carving and refining", plan_.rounds),
        100 * same / std::max(compared, 1.0), "%", at_least(100), {{"slabs", compared}, {"made finer", finer}});
  }

  /// A stroke of one second in real time over slabs that are too coarse for it.
  void of_a_stroke_in_time() {
    const Box3d box = bounds_of_surface(*model_.head);
    const Vec3d middle = (box.low + box.high) / 2;
    std::vector<StrokePoint> way;
    for (int k = 0; k <= 1000; ++k) {
      const double turn = 0.6 * (k / 1000.0 - 0.5);
      const Vec3d out = normalized(Vec3d{std::sin(turn), 0.3, std::cos(turn)});
      if (const auto hit = raycast(*model_.head, {middle + out * diagonal_, -out}))
        way.push_back({1e-3 * k, hit->point.position, 1});
    }
    using Clock = std::chrono::steady_clock;
    const auto frame = std::chrono::microseconds(16'667);
    Document document(model_);
    document.post(BeginStroke{.brush = {.radius = 0.005 * diagonal_}, .tip = false, .label = {}, .source = 0});
    const auto began = Clock::now();
    auto frame_ends = began + frame;
    std::uint64_t last = document.head()->number();
    double publications = 0, frames = 0, missed = 0;
    bool is_new = false;
    for (const StrokePoint& p : way) {
      std::this_thread::sleep_until(began +
                                    std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(p.t)));
      document.post(MoveStroke{{p}, 0});
      if (const std::uint64_t now = document.head()->number(); std::exchange(last, now) != now) {
        ++publications;
        is_new = true;
      }
      if (Clock::now() < frame_ends) continue;
      ++frames;
      missed += std::exchange(is_new, false) ? 0 : 1;
      frame_ends += frame;
    }
    document.post(EndStroke{0});
    document.settle();
    add("frames of 1/60 s without a publication, a stroke of 1 s over coarse slabs", missed, "", at_most(0),
        {{"frames", frames}, {"publications", publications}}, "wall");
  }

 private:
  using More = std::vector<std::pair<const char*, double>>;
  void add(const std::string& what, double value, const char* unit, Goal goal, const More& more = {},
           const char* clock = kNoClock) {
    ordered_json made = figure(what, name_, value, unit, goal, clock);
    for (const auto& [key, number] : more) made["more"][key] = number;
    figures_.push_back(std::move(made));
  }

  /// Fibres with 5 % of the diagonal below the surface, of those below which the body is 20 % thick; both counts.
  [[nodiscard]] std::pair<double, double> deep_fibres() const {
    constexpr double kDeep = 0.05, kThick = 0.2, kAside = 1e-4;
    const SlabMesh& mesh = model_.head->slab_mesh();
    double deep = 0, thick = 0;
    for (FibreId f = 0; f < mesh.root_fibres().size(); ++f) {
      if (mesh.fan(f).empty()) continue;
      const SlabCorner at = mesh.fan(f).front();
      const int n = mesh.intervals(at.slab);
      const std::array<GridPoint, 3> corners = {{{0, 0}, {n, 0}, {0, n}}};
      const Vec3d on = sample_position(*model_.head, at.slab, corners[static_cast<std::size_t>(at.corner)]);
      const Fibre& fibre = mesh.root_fibres()[f];
      const Vec3d in = -normalized(fibre.direction());
      const auto far = raycast(*model_.head, {on + in * (kAside * diagonal_), in});
      if (!far || far->distance < kThick * diagonal_) continue;
      ++thick;
      deep += length(on - fibre.inner) >= kDeep * diagonal_ ? 1 : 0;
    }
    return {deep, thick};
  }

  [[nodiscard]] std::pair<StrokeResult, SnapshotPtr> with_room(const Stroke& stroke) const {
    return with_room(stroke, model_);
  }
  [[nodiscard]] std::pair<StrokeResult, SnapshotPtr> with_room(const Stroke& stroke, const Model& model) const {
    StrokeResult result;
    Document document(model, {.on_event =
                                  [&](const Event& event) {
                                    if (const auto* done = std::get_if<StrokeFinished>(&event)) result = done->result;
                                  },
                              .make_room = room_maker(diagonal_)});
    document.post(BeginStroke{.brush = stroke.brush, .tip = stroke.tip, .label = stroke.label, .source = 0});
    document.post(MoveStroke{stroke.points, 0});
    document.post(EndStroke{0});
    document.settle();
    return {result, document.head()};
  }

  /// The same cuts and grids on the surface as it was: how far alphas differ between samples, at random places.
  [[nodiscard]] double moved_by(const Snapshot& after) const {
    Detail detail;
    const auto cuts = after.slab_mesh().cuts().subspan(model_.head->slab_mesh().cuts().size());
    detail.cuts.assign(cuts.begin(), cuts.end());
    for (SlabId s = 0; s < after.slab_mesh().slab_count(); ++s)
      detail.grids.push_back({Layer::Displacement, s, after.slab_mesh().intervals(s)});
    const auto finer = relief::with_detail(model_.head, detail);
    if (!finer) return 1;
    constexpr int kPlaces = 27'000;
    return testing::moved_between(*model_.head, **finer, kPlaces);
  }

  /// Of inner and outer triangles, where a slab was cut again and again; as a share of the least of its root.
  [[nodiscard]] double least_angle(int generations) const {
    testing::RandomCuts cuts(model_.head);
    for (int k = 0; k < generations; ++k) cuts.cut(0);
    return testing::least_angle_of_roots(cuts.model()->slab_mesh(), model_.head->slab_mesh());
  }

  static bool stands(const SlabMesh& was, const SlabMesh& is, SlabId s) {
    const SlabCorners a = was.corners(s), b = is.corners(s);
    return a.inner == b.inner && a.outer == b.outer;
  }

  std::string name_;
  Model model_;
  double diagonal_;
  Plan plan_;
  ordered_json& figures_;
};

/// Converts by default and with short fibres; the model, and how many times the CPU time of the second the first took.
Result<std::pair<Model, double>> converted(const TriangleMesh& mesh, Extent extent) {
  std::vector<double> times;
  std::optional<Model> model;
  for (int k = 0; k < plan_of(extent).conversions; ++k) {
    ConvertSettings settings;
    if (extent == Extent::Form) settings = {.slabs = 60, .intervals = 16};
    const double start = process_cpu_seconds();
    RELIEF_TRY(Conversion made, convert(mesh, settings));
    const double middle = process_cpu_seconds();
    settings.thickness = 0.1;
    RELIEF_TRY(const Conversion thin, convert(mesh, settings));
    times.push_back((middle - start) / (process_cpu_seconds() - middle));
    model = std::move(made.model);
  }
  return std::pair(*std::move(model), percentile(times, 0.5));
}

}  // namespace

Result<ordered_json> measure_clay(Extent extent) {
  ordered_json figures = ordered_json::array();
  RELIEF_TRY(const std::vector<Subject> all, subjects(extent));
  for (const Subject& subject : all) {
    RELIEF_TRY(auto made, converted(subject.mesh, extent));
    Clay clay(subject.name, std::move(made.first), extent, figures);
    clay.of_conversion(made.second);
    clay.of_small_balls();
    clay.of_deep_cuts(0.08, 0.05, 0.01, 0.1);
    clay.of_deep_cuts(0.10, 0.09, 0.03, 0.3);
    clay.of_fine_places();
    clay.of_repeated_work();
    clay.of_a_stroke_in_time();
  }
  for (const ordered_json& rim : measure_rims(extent)) figures.push_back(rim);
  for (const ordered_json& reader : measure_readers(extent)) figures.push_back(reader);
  return ordered_json{{"figures", std::move(figures)}};
}

std::string clay_text(const ordered_json& clay) { return figures_table(clay["figures"]); }

}  // namespace relief::bench
