#include "kept.h"

#include "../timing.h"
#include "strokes.h"
#include "support/shells.h"

#include <relief/base/cpu_time.h>
#include <relief/base/try.h>
#include <relief/edit/stroke.h>
#include <relief/file/model_file.h>

#include <fmt/format.h>
#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <system_error>

namespace relief::bench {

namespace {

using nlohmann::ordered_json;

/// Bytes that the process holds of the heap. 0 under the sanitizers, which bring their own.
std::size_t held_bytes() {
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
}
/// What is held now beyond what was; 0 where that is less.
double more_than(std::size_t before) {
  const std::size_t now = held_bytes();
  return now > before ? static_cast<double>(now - before) : 0;
}

/// A sphere of 20 * 4^level slabs, each with tiles of its own.
SnapshotPtr sphere(int level, int n) {
  return testing::displaced(testing::icosphere_shell(level, n, 0.7, 1.3),
                            [](Vec3d p) { return 0.5 + 0.01 * std::sin(9 * p.x) * std::cos(7 * p.y + 4 * p.z); });
}

double triangles_of(const Snapshot& model) {
  double sum = 0;
  for (const Slab& slab : model.slab_mesh().slabs()) sum += static_cast<double>(slab.intervals) * slab.intervals;
  return sum;
}

/// A place on a sphere, number k of many that lie evenly.
SurfacePoint place_on(const Snapshot& model, int k, int count) {
  const double z = 1 - (2.0 * k + 1) / count, turn = std::numbers::pi * (3 - std::sqrt(5.0)) * k;
  const double across = std::sqrt(1 - z * z);
  return closest_point(model, {across * std::cos(turn), across * std::sin(turn), z});
}

ordered_json bytes_per_triangle(int level, int n) {
  ordered_json figures = ordered_json::array();
  const std::size_t before = held_bytes();
  SnapshotPtr model = sphere(level, n);
  const double triangles = triangles_of(*model);
  const std::string surface = fmt::format("sphere, {} slabs, n = {}", model->slab_mesh().slab_count(), n);
  figures.push_back(figure("memory per triangle, one layer", surface, more_than(before) / triangles, "bytes each",
                           at_most(5), "none"));
  {
    // Painted all over: every slab has a tile of its own.
    SnapshotDraft draft(with_layer(model, Tool::Paint, place_on(*model, 0, 2)));
    for (SlabId s = 0; s < model->slab_mesh().slab_count(); ++s) static_cast<void>(draft.edit(Layer::Colour, s));
    model = draft.finish();
  }
  figures.push_back(figure("memory per triangle, with colour", surface, more_than(before) / triangles, "bytes each",
                           at_most(8), "none"));
  const int m = model->tile(Layer::Colour, 0).intervals();
  figures.back()["more"] = {{"colours per sample", static_cast<double>(m) * m / (n * n)}};
  return figures;
}

/// What the heap holds more after a stroke because the state before it is kept.
double undo_bytes(const SnapshotPtr& model, double radius, int dabs) {
  const SurfacePoint start = place_on(*model, 1, 7);
  Editor editor(model);
  const auto stroke = [&] {
    editor.begin_stroke(brush_of(Tool::Deposit, radius));
    PickHint hint;
    for (int k = 0; k < dabs; ++k) {
      const SurfacePoint at = place_of(*model, start, Tool::Deposit, radius, k, hint);
      editor.dab({.slab = at.slab,
                  .contact = editor.position(at.slab, at.u, at.v),
                  .cursor = at.position,
                  .normal = at.normal,
                  .seconds = kDabSeconds});
      static_cast<void>(editor.head());
    }
    editor.end_stroke();
  };
  // The first one brings what the editor keeps for itself, and tiles that nothing but the head holds.
  stroke();
  const SnapshotPtr before = editor.head();
  const std::size_t held = held_bytes();
  stroke();
  return more_than(held);
}

/// A folder that goes when it is done with.
class Folder {
 public:
  Folder() : path_(std::filesystem::temp_directory_path() / fmt::format("relief-bench-{}", getpid())) {
    std::filesystem::create_directories(path_);
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

 private:
  std::filesystem::path path_;
};

constexpr const char* kWall = "wall";

/// One short stroke: a tap of deposit that changes some thousand samples.
SnapshotPtr tap(Editor& editor, const SurfacePoint& at, double radius) {
  const Stroke stroke = {
      .brush = brush_of(Tool::Deposit, radius), .label = "deposit", .points = {{.t = 0, .position = at.position}}};
  play(editor, stroke);
  return editor.head();
}

Status many_strokes(const std::filesystem::path& file, int level, int n, int strokes, ordered_json& figures) {
  SnapshotPtr model = sphere(level, n);
  const std::string surface =
      fmt::format("sphere, {} slabs, n = {}, {} strokes", model->slab_mesh().slab_count(), n, strokes);
  const double samples_per_area = triangles_of(*model) / 2 / (4 * std::numbers::pi);
  const double radius = std::sqrt(1000 / samples_per_area / std::numbers::pi) * (n < 32 ? 0.1 : 1);
  std::vector<double> cpu, wall;
  double empty_bytes = 0, memory = 0;
  {
    RELIEF_TRY(ModelFile opened, ModelFile::create(file, {.info = {}, .head = model}));
    empty_bytes = static_cast<double>(std::filesystem::file_size(file));
    Editor editor(model);
    model.reset();
    const std::size_t before = held_bytes();
    for (int k = 0; k < strokes; ++k) {
      const SnapshotPtr head = tap(editor, place_on(*editor.head(), k, strokes), radius);
      const Stopwatch watch;
      RELIEF_CHECK(opened.commit(head, {.number = opened.stroke_count() + 1, .label = "deposit"}));
      cpu.push_back(watch.cpu());
      wall.push_back(watch.wall());
    }
    memory = more_than(before);
  }
  const double bytes = static_cast<double>(std::filesystem::file_size(file));
  const auto time = [&](const char* what, const std::vector<double>& seconds, const char* clock) {
    ordered_json made = figure(what, surface, median(seconds) * 1e3, "ms", {}, clock);
    made["percentiles"] = percentiles(seconds, 1e3);
    made["percentiles"].erase("count");
    figures.push_back(std::move(made));
  };
  time("saving a stroke of 1k samples", cpu, "process CPU");
  time("saving a stroke of 1k samples", wall, kWall);
  figures.push_back(figure("file, per stroke of 1k samples", surface, (bytes - std::min(bytes, empty_bytes)) / strokes,
                           "bytes", {}, "none"));
  figures.back()["more"] = {{"file, MB", bytes * 1e-6}, {"without strokes, MB", empty_bytes * 1e-6}};
  figures.push_back(figure("memory, per stroke of 1k samples", surface, memory / strokes, "bytes", {}, "none"));
  std::vector<double> open_cpu, open_wall;
  for (int k = 0; k < 3; ++k) {
    const Stopwatch watch;
    RELIEF_TRY(const ModelFile opened, ModelFile::open(file, true));
    if (opened.stroke_count() != static_cast<std::uint64_t>(strokes))
      return fail(Errc::Corrupt,
                  fmt::format("the file holds {} strokes, {} were saved", opened.stroke_count(), strokes));
    open_cpu.push_back(watch.cpu());
    open_wall.push_back(watch.wall());
  }
  time("opening the file", open_cpu, "process CPU");
  time("opening the file", open_wall, kWall);
  return {};
}

Status large_save(const std::filesystem::path& file, int level, int n, ordered_json& figures) {
  const SnapshotPtr model = sphere(level, n);
  const double triangles = triangles_of(*model), samples_per_area = triangles / 2 / (4 * std::numbers::pi);
  const std::string surface =
      fmt::format("sphere, {} slabs, {:.1f}M samples", model->slab_mesh().slab_count(), triangles / 2e6);
  RELIEF_TRY(ModelFile opened, ModelFile::create(file, {.info = {}, .head = model}));
  Editor editor(model);
  std::vector<double> cpu, wall;
  const double radius = std::sqrt(10'000 / samples_per_area / std::numbers::pi) * (n < 32 ? 0.1 : 1);
  for (int k = 0; k < 9; ++k) {
    const SnapshotPtr head = tap(editor, place_on(*model, k, 9), radius);
    const Stopwatch watch;
    RELIEF_CHECK(opened.commit(head, {.number = opened.stroke_count() + 1, .label = "deposit"}));
    cpu.push_back(watch.cpu());
    wall.push_back(watch.wall());
  }
  figures.push_back(figure("saving a stroke of 10k samples", surface, median(cpu) * 1e3, "ms", {}, "process CPU"));
  figures.push_back(figure("saving a stroke of 10k samples", surface, median(wall) * 1e3, "ms", {}, kWall));
  return {};
}

}  // namespace

ordered_json measure_memory(Extent extent) {
  const bool form = extent == Extent::Form;
  const int level = form ? 2 : 4, n = form ? 8 : 32, dabs = form ? 10 : 250;
  ordered_json figures = bytes_per_triangle(level, n);
  const SnapshotPtr model = sphere(level, n);
  const std::string surface = fmt::format("sphere, {} slabs, n = {}", model->slab_mesh().slab_count(), n);
  const double samples_per_area = triangles_of(*model) / 2 / (4 * std::numbers::pi);
  for (const auto& [size, wanted] : {std::pair{"1k", 1e3}, {"10k", 1e4}, {"100k", 1e5}}) {
    const double radius = std::sqrt(wanted * (form ? 0.01 : 1) / samples_per_area / std::numbers::pi);
    figures.push_back(figure(fmt::format("undo of a stroke of {} dabs of {} samples, deposit", dabs, size), surface,
                             undo_bytes(model, radius, dabs), "bytes", {}, "none"));
  }
  return figures;
}

Result<ordered_json> measure_file(Extent extent) {
  ordered_json figures = ordered_json::array();
  const Folder folder;
  const bool form = extent == Extent::Form, thorough = extent == Extent::Long;
  RELIEF_CHECK(many_strokes(folder.path() / "many.relief", form ? 1 : 3, form ? 8 : 32,
                            form       ? 5
                            : thorough ? 10'000
                                       : 500,
                            figures));
  RELIEF_CHECK(large_save(folder.path() / "large.relief", form ? 1 : thorough ? 6 : 4, form ? 8 : 32, figures));
  return figures;
}

}  // namespace relief::bench
