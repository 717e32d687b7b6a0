// relief-bench: measures this build on this machine. Every figure is thread CPU time unless its name says otherwise.
#include "clay/clay.h"
#include "dab/dab.h"
#include "growth.h"
#include "ours.h"
#include "paper/paper_algorithm.h"
#include "render/render.h"
#include "support/data.h"
#include "support/shells.h"
#include "timing.h"
#include "touch.h"
#include "ways.h"

#include <relief/base/cpu_time.h>
#include <relief/base/try.h>
#include <relief/convert/convert.h>
#include <relief/core/query.h>
#include <relief/core/tessellate.h>
#include <relief/edit/editor.h>
#include <relief/haptics/servo.h>
#include <relief/mesh/import.h>
#include <relief/mesh/samples.h>
#include <relief/render/frame.h>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>
#include <exception>

namespace relief::bench {

namespace {

using nlohmann::ordered_json;

struct Subject {
  std::string name;
  TriangleMesh mesh;
  int slabs;
};

/// The paper's models: its head and pumpkin stand for ours, the bunny is the real one where the test data is at hand.
std::vector<Subject> paper_subjects(std::size_t triangles) {
  std::vector<Subject> subjects;
  for (const char* name : {"head", "pumpkin"})
    if (auto mesh = make_sample(name, triangles)) subjects.push_back({name, *std::move(mesh), 200});
  if (auto bunny = import_mesh(testing::data_folder() / "a_models/bunny.ply"))
    subjects.push_back({"bunny", *std::move(bunny), 150});
  return subjects;
}

class Bench {
 public:
  explicit Bench(Extent extent) : extent_(extent), thorough_(extent == Extent::Long) {}

  Status run(const std::string& what) {
    const bool all = what == "all";
    if (all || what == "convert") RELIEF_CHECK(convert_times());
    if (all || what == "query") RELIEF_CHECK(query_times());
    if (all || what == "touch") {
      RELIEF_TRY(out_["touch"], measure_touch(extent_));
    }
    if (all || what == "dab") {
      RELIEF_TRY(out_["dab"], measure_dabs(extent_));
    }
    if (all || what == "clay") {
      RELIEF_TRY(out_["clay"], measure_clay(extent_));
    }
    if (all || what == "render") {
      RELIEF_TRY(out_["render"], measure_frames(extent_));
    }
    if (all || what == "paper") RELIEF_CHECK(paper_table());
    return {};
  }
  [[nodiscard]] const ordered_json& results() const { return out_; }

 private:
  /// Median over repeats of the CPU seconds of all threads.
  Status convert_times() {
    for (const Subject& s : paper_subjects(thorough_ ? 300'000 : 100'000)) RELIEF_CHECK(convert_time(s));
    return {};
  }

  /// In the best mode that can be proved.
  Status convert_time(const Subject& s) {
    std::vector<double> seconds;
    ConvertReport report;
    Mode reached = Mode::Preview;
    for (int k = 0; k < (thorough_ ? 5 : 3); ++k) {
      const double start = process_cpu_seconds();
      RELIEF_TRY(const Conversion made, convert(s.mesh, {.slabs = s.slabs}));
      seconds.push_back(process_cpu_seconds() - start);
      report = made.report;
      reached = made.model.info.mode;
    }
    std::ranges::sort(seconds);
    out_["convert"][s.name]["default"] = {
        {"mode", name(reached)},
        {"source_triangles", s.mesh.triangles.size()},
        {"slabs", report.slabs},
        {"cpu_seconds", seconds[seconds.size() / 2]},
        {"single_share", static_cast<double>(report.hits_single) / static_cast<double>(report.fibres_cast)},
        {"distance_rms", report.to_mended.rms}};
    return {};
  }

  /// The tracked query with and without normals, against the paper's own algorithm (15 bisections, slabs in sequence).
  Status query_times() {
    RELIEF_TRY(const Snapshot& model, pumpkin(200, 64));
    const std::vector<Vec3d> path = slide({model}, 0.005, 1e-4, thorough_ ? 200'000 : 20'000).cursors;
    const CallTimer timer;
    std::vector<double> locates, probes, cold, theirs;
    LocateHint hint;
    double sum = 0;
    for (const Vec3d p : path)
      locates.push_back(timer([&] { sum += locate(model.slab_mesh(), p, hint).has_value() ? 1 : 0; }));
    for (const Vec3d p : path)
      probes.push_back(timer([&] {
        const auto contact = probe(model, p, hint);
        sum += contact ? contact->depth : 0;
      }));
    for (const Vec3d p : path)
      cold.push_back(timer([&] {
        LocateHint none;
        sum += locate(model.slab_mesh(), p, none).has_value() ? 1 : 0;
      }));
    for (std::size_t k = 0; k < path.size(); k += 20)
      theirs.push_back(timer([&] { sum += paper::locate(model.slab_mesh(), path[k]).has_value() ? 1 : 0; }));
    out_["query"] = {{"model", "pumpkin, 200 slabs, n = 64"},
                     {"locate_ns", percentiles(locates, 1e9)},
                     {"probe_with_normal_ns", percentiles(probes, 1e9)},
                     {"locate_from_nothing_ns", percentiles(cold, 1e9)},
                     {"paper_in_sequence_ns", percentiles(theirs, 1e9)},
                     {"check", sum}};
    out_["query"]["growth"] = growth(thorough_ ? std::vector{2, 4, 6, 8} : std::vector{2, 6}, 20'000);
    return {};
  }

  /// Whole ticks with a point, on a slide.
  [[nodiscard]] ordered_json step_times(const Snapshot& model) const {
    const Surface surface = {model};
    const Way way = slide(surface, 0.005, 1e-4, thorough_ ? 200'000 : 20'000);
    TickRow row(surface, {});
    const CallTimer timer;
    std::vector<double> steps;
    row.approach(way.cursors.front(), way.ups.front());
    for (const Vec3d p : way.cursors) steps.push_back(timer([&] { static_cast<void>(row.tick(p, true)); }));
    ordered_json json = percentiles(steps, 1e9);
    json["contact_share"] = static_cast<double>(row.touching()) / static_cast<double>(row.ticks());
    return json;
  }

  ordered_json frames(FrameRenderer& renderer, const Snapshot& model, int width, int height) {
    std::vector<double> cpu, wall;
    const Camera camera = framing(model, 20, 15, static_cast<double>(width) / height);
    Frame frame;
    frame.camera = camera;
    frame.width = width;
    frame.height = height;
    frame.tau = 0;
    std::vector<std::uint32_t> pixels(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    for (int k = 0; k < (thorough_ ? 40 : 12); ++k) {
      if (!renderer.draw(model, frame, pixels, width, nullptr, true)) break;
      // The first frame compiles shaders and uploads everything.
      if (k == 0) continue;
      cpu.push_back(renderer.stats().cpu_seconds);
      wall.push_back(renderer.stats().wall_seconds);
    }
    return {{"triangles", renderer.stats().triangles},
            {"cpu_ms", percentiles(cpu, 1e3)},
            {"wall_ms", percentiles(wall, 1e3)}};
  }

  /// The table of the paper's Sec. 7, for the same numbers of slabs and samples.
  Status paper_table() {
    RELIEF_TRY(FrameRenderer renderer, FrameRenderer::create());
    for (const Subject& s : paper_subjects(100'000)) {
      const double start = process_cpu_seconds();
      RELIEF_TRY(const Conversion made, convert(s.mesh, {.slabs = s.slabs, .intervals = 15}));
      const double convert_seconds = process_cpu_seconds() - start;
      const Snapshot& head = *made.model.head;
      ordered_json row;
      row["slabs"] = head.slab_mesh().slab_count();
      row["polygons_per_slab"] = 225;
      row["triangles"] = tessellate(head).triangles.size();
      row["convert_cpu_seconds"] = convert_seconds;
      row["iteration_ns"] = step_times(head);
      row["paper_iteration_ns"] = 650'000;

      Editor editor(made.model.head);
      const double scale = made.model.info.source_diagonal;
      editor.begin_stroke({.tool = Tool::Carve, .radius = 0.03 * scale, .detail = 0});
      std::size_t samples = 0, dabs = 0;
      double dab_seconds = 0;
      const Way way = slide({head}, 0.004, 0.005, 400);
      for (const Vec3d p : way.cursors) {
        const SurfacePoint at = closest_point(*editor.head(), p);
        const double before = thread_cpu_seconds();
        samples += editor
                       .dab({.slab = at.slab,
                             .contact = at.position,
                             .cursor = at.position - at.normal * (0.004 * scale),
                             .normal = at.normal})
                       .samples;
        dab_seconds += thread_cpu_seconds() - before;
        ++dabs;
      }
      editor.end_stroke();
      row["dabs"] = dabs;
      row["samples_edited"] = samples;
      row["edits_per_second"] = dab_seconds > 0 ? static_cast<double>(samples) / dab_seconds : 0;
      row["dabs_per_second"] = dab_seconds > 0 ? static_cast<double>(dabs) / dab_seconds : 0;
      row["paper_dabs_per_second"] = 10;
      row["frame"] = frames(renderer, head, 1280, 720);
      row["paper_frames_per_second"] = 10;
      out_["paper"][s.name] = row;
    }
    return {};
  }

  Result<std::reference_wrapper<const Snapshot>> pumpkin(int slabs, int n) {
    if (!pumpkin_) {
      RELIEF_TRY(const TriangleMesh mesh, make_sample("pumpkin", 200'000));
      RELIEF_TRY(const Conversion made, convert(mesh, {.slabs = slabs, .intervals = n}));
      pumpkin_ = made.model.head;
    }
    return std::cref(*pumpkin_);
  }

  Extent extent_;
  bool thorough_;
  SnapshotPtr pumpkin_;
  ordered_json out_;
};

/// Nested objects as indented lines, percentiles in one line, what touch, dab, clay and render found as tables, for
/// people.
void print_lines(const ordered_json& object, int indent) {
  const auto text = [](const ordered_json& value) {
    return value.is_number_float() ? fmt::format("{:.5g}", value.get<double>()) : value.dump();
  };
  for (const auto& [key, value] : object.items()) {
    std::string line = fmt::format("{:{}}{:<24}", "", indent, key);
    if (key == "touch" || key == "dab" || key == "clay" || (key == "render" && value.contains("figures"))) {
      const std::string text_of = key == "touch"  ? touch_text(value)
                                  : key == "dab"  ? dab_text(value)
                                  : key == "clay" ? clay_text(value)
                                                  : frames_text(value);
      std::fputs((line + "\n" + text_of).c_str(), stdout);
      continue;
    }
    if (value.contains("p50")) {
      for (const auto& [name, number] : value.items()) line += fmt::format(" {} {:<9}", name, text(number));
    } else if (!value.is_object()) {
      line += " " + text(value);
    }
    std::fputs((line + "\n").c_str(), stdout);
    if (value.is_object() && !value.contains("p50")) print_lines(value, indent + 2);
  }
}

int main_inner(int argc, char** argv) {
  std::string what = "all";
  bool thorough = false, form = false, json = false;
  CLI::App app("Measures Relief on this machine. Times are CPU times.");
  app.add_option("WHAT", what, "convert, query, touch, dab, clay, render, paper or all")
      ->check(CLI::IsMember({"convert", "query", "touch", "dab", "clay", "render", "paper", "all"}));
  app.add_flag("--long", thorough, "More repeats, larger models");
  app.add_flag("--form", form, "With touch, dab, clay and render: next to nothing, to see the form of what it says")
      ->excludes("--long");
  app.add_flag("--json", json, "One JSON object on standard output");
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    std::fputs(app.help().c_str(), stdout);
    return 0;
  } catch (const CLI::ParseError& error) {
    std::fprintf(stderr, "relief-bench: %s; relief-bench --help lists the options\n", error.what());
    return 2;
  }
  Bench bench(form ? Extent::Form : thorough ? Extent::Long : Extent::Usual);
  if (const Status status = bench.run(what); !status) {
    std::fputs(("relief-bench: " + status.error().message + "\n").c_str(), stderr);
    return 1;
  }
  if (json)
    std::fputs((bench.results().dump(2) + "\n").c_str(), stdout);
  else
    print_lines(bench.results(), 0);
  return 0;
}

}  // namespace

}  // namespace relief::bench

int main(int argc, char** argv) try { return relief::bench::main_inner(argc, argv); } catch (const std::exception& e) {
  std::fprintf(stderr, "relief-bench: %s\n", e.what());
  return 1;
}
