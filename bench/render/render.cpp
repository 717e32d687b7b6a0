#include "render.h"

#include "../timing.h"
#include "classic.h"
#include "support/shells.h"

#include <relief/base/cpu_time.h>
#include <relief/base/try.h>
#include <relief/convert/convert.h>
#include <relief/core/detail.h>
#include <relief/core/query.h>
#include <relief/edit/editor.h>
#include <relief/mesh/samples.h>
#include <relief/render/display_cache.h>
#include <relief/render/gl_context.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace relief::bench {

namespace {

using nlohmann::ordered_json;

double median(std::vector<double> values) {
  std::ranges::sort(values);
  return values.empty() ? 0 : values[values.size() / 2];
}

/// A ball of radius about 0.95 with relief of many sizes, in a shell from 0.8 to 1.05.
SnapshotPtr rough_ball(int levels, int n) {
  return testing::displaced(testing::icosphere_shell(levels, n, 0.8, 1.05), [](Vec3d p) {
    const Vec3d d = normalized(p);
    double height = 0.6, size = 0.12;
    for (double f = 4; f < 100; f *= 1.9, size *= 0.5)
      height += size * std::sin(f * d.x + 1.3 * f * d.y) * std::cos(f * d.z - 0.7 * f * d.x);
    return std::clamp(height, 0.1, 0.9);
  });
}

class FrameBench {
 public:
  explicit FrameBench(Extent extent)
      : form_(extent == Extent::Form),
        repeats_(form_                    ? 2
                 : extent == Extent::Long ? 60
                                          : 15) {}

  Status run() {
    out_["machine"] = to_json(this_machine());
    out_["machine"]["load_average_before"] = load_average();
    RELIEF_CHECK(small_model());
    RELIEF_CHECK(large_model());
    RELIEF_CHECK(following_dabs());
    for (const int levels : form_ ? std::vector{1} : std::vector{2, 5}) RELIEF_CHECK(following_cuts(levels));
    out_["machine"]["load_average_after"] = load_average();
    out_["repeats"] = repeats_;
    out_["extent"] = form_ ? "form only: the figures mean nothing" : "figures of this machine";
    out_["figures"] = figures_;
    return {};
  }
  ordered_json take() { return std::move(out_); }

 private:
  void add(const std::string& name, const std::string& surface, double value, const char* unit, Goal goal,
           const char* clock) {
    figures_.push_back(figure(name, surface, value, unit, goal, clock));
  }

  [[nodiscard]] Frame frame_of(const Snapshot& model) const {
    Frame frame;
    frame.width = form_ ? 320 : 1920;
    frame.height = form_ ? 180 : 1080;
    frame.camera = framing(model, 20, 15, 16.0 / 9);
    frame.tau = 0;
    frame.look.colours = false;
    pixels_.resize(static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height));
    return frame;
  }

  /// Process CPU seconds of a frame.
  Result<double> seconds(FrameRenderer& with, const Snapshot& model, const Frame& frame, bool everything) {
    RELIEF_CHECK(with.draw(model, frame, pixels_, frame.width, nullptr, everything));
    return with.stats().cpu_seconds;
  }

  /// Whole frames of the paper's size, in turn with the classic renderer's.
  Status small_model() {
    RELIEF_TRY(const TriangleMesh mesh, make_sample("pumpkin", form_ ? 5'000 : 100'000));
    RELIEF_TRY(const Conversion made, convert(mesh, {.slabs = form_ ? 40 : 200, .intervals = 15}));
    const Snapshot& model = *made.model.head;
    const std::string surface = fmt::format("pumpkin, {} triangles", model.slab_mesh().slab_count() * 225);
    RELIEF_TRY(FrameRenderer renderer, FrameRenderer::create());
    RELIEF_TRY(ClassicRenderer classic, ClassicRenderer::create(model));
    out_["device"] = renderer.device();
    const Frame frame = frame_of(model);
    std::vector<double> ours, theirs, nothing;
    for (int k = 0; k < 2 * repeats_; ++k) {
      RELIEF_TRY(const double mine, seconds(renderer, model, frame, true));
      const double start = process_cpu_seconds();
      RELIEF_CHECK(classic.draw(frame, pixels_));
      if (k == 0) continue;  // compiles shaders, uploads everything
      ours.push_back(mine);
      theirs.push_back(process_cpu_seconds() - start);
    }
    const std::uint64_t bytes = memory_without_colours(renderer, model);
    for (int k = 0; k < repeats_; ++k) {
      RELIEF_CHECK(seconds(renderer, model, frame, false));
      RELIEF_TRY(const double idle, seconds(renderer, model, frame, false));
      nothing.push_back(idle);
    }
    add("whole frame, matcap and hollows", surface, 1e3 * median(ours), "ms", at_most(33), "process CPU");
    add("the same, classic buffers", surface, 1e3 * median(theirs), "ms", {}, "process CPU");
    add("frame when nothing changed", surface, 1e3 * median(nothing), "ms", at_most(0.05), "process CPU");
    add("GPU memory, of classic", surface, static_cast<double>(bytes) / static_cast<double>(classic.gpu_bytes()),
        "times", at_most(0.25), "none");
    return {};
  }

  /// Of all buffers but the colours, which the classic ones do not have either.
  static std::uint64_t memory_without_colours(const FrameRenderer& renderer, const Snapshot& model) {
    std::uint64_t colours = 0;
    if (model.has(Layer::Colour))
      for (SlabId s = 0; s < model.slab_mesh().slab_count(); ++s) colours += 4 * model.tile(Layer::Colour, s).size();
    return renderer.stats().gpu_bytes - colours;
  }

  /// Ten million triangles: a stroke under a still camera, and a camera that moves.
  Status large_model() {
    const SnapshotPtr model = form_ ? rough_ball(1, 16) : rough_ball(3, 88);
    const SlabMesh& mesh = model->slab_mesh();
    const int n = mesh.intervals(0);
    const std::string surface = fmt::format("ball, {:.3g} M triangles", mesh.slab_count() * double(n) * n * 1e-6);
    RELIEF_TRY(FrameRenderer renderer, FrameRenderer::create());
    Frame frame = frame_of(*model);
    RELIEF_CHECK(seconds(renderer, *model, frame, true));
    const double classic = mesh.slab_count() * (static_cast<double>(sample_count(n)) * 28 + double(n) * n * 6);
    add("GPU memory, of classic", surface, static_cast<double>(renderer.stats().gpu_bytes) / classic, "times",
        at_most(0.25), "none");

    std::vector<double> full, coarse, passed;
    double full_triangles = 0, coarse_triangles = 0;
    for (int k = 0; k < std::max(2, repeats_ / 3); ++k) {
      for (const double tau : {0.0, 2.0}) {
        frame.tau = tau;
        frame.camera = framing(*model, 20 + k, 15, 16.0 / 9);
        RELIEF_TRY(const double took, seconds(renderer, *model, frame, true));
        (tau > 0 ? coarse : full).push_back(took);
        if (tau == 0) passed.push_back(renderer.stats().wall_seconds);
        (tau > 0 ? coarse_triangles : full_triangles) = static_cast<double>(renderer.stats().triangles);
      }
    }
    frame.tau = 0;
    RELIEF_CHECK(seconds(renderer, *model, frame, true));
    const double scale = diagonal(surface_bounds(*model));
    Editor editor(model);
    std::vector<double> strokes, pixels;
    const Vec3d towards = normalized(frame.camera.eye - frame.camera.target);
    const auto place = raycast(*model, {frame.camera.eye, -towards});
    if (!place) return fail(Errc::InvalidArgument, "the camera looks past the ball");
    editor.begin_stroke({.tool = Tool::Carve, .radius = 0.012 * scale, .strength = 0.3});
    PickHint hint;
    const Vec3d aside = normalized(cross(towards, {0, 1, 0}));
    for (int k = 0; k < 2 * repeats_; ++k) {
      const SurfacePoint at = closest_point(*editor.head(), place->point.position + aside * (0.002 * scale * k), hint);
      editor.dab({.slab = at.slab,
                  .contact = at.position,
                  .cursor = at.position - at.normal * (0.004 * scale),
                  .normal = at.normal,
                  .seconds = 0.01});
      RELIEF_TRY(const double took, seconds(renderer, *editor.head(), frame, false));
      if (renderer.stats().drawn.empty()) continue;
      strokes.push_back(took);
      pixels.push_back(std::sqrt(double(renderer.stats().drawn.width) * renderer.stats().drawn.height));
    }
    editor.end_stroke();
    add("whole frame, all samples", surface, 1e3 * median(full), "ms", {}, "process CPU");
    figures_.back()["more"] = {{"triangles", full_triangles}};
    // On a driver that draws with the CPU this says how busy the machine is, and nothing else.
    add("whole frame, all samples, with its way into memory", surface, 1e3 * median(passed), "ms",
        renderer.software() ? Goal{} : at_most(1000.0 / 60), "wall");
    add("moving camera, tau 2 px", surface, 1e3 * median(coarse), "ms", {}, "process CPU");
    figures_.back()["more"] = {{"triangles", coarse_triangles}};
    add("moving camera, times cheaper", surface, median(full) / std::max(median(coarse), 1e-9), "times", at_least(2),
        "process CPU");
    add("frame of a stroke, still camera", surface, 1e3 * median(strokes), "ms", {}, "process CPU");
    add("frame of a stroke, edge of its rectangle", surface, median(pixels), "pixels", {}, "none");
    add("frame of a stroke, times cheaper", surface, median(full) / std::max(median(strokes), 1e-9), "times",
        at_least(50), "process CPU");
    return {};
  }

  /// The display cache alone, after dabs of ten thousand samples.
  Status following_dabs() {
    RELIEF_TRY(const auto context, detail::GlContext::create());
    const detail::GlContext::Scope scope(*context);
    const SnapshotPtr model = form_ ? rough_ball(1, 16) : rough_ball(3, 64);
    detail::DisplayCache cache;
    static_cast<void>(cache.update(*model));
    const double wanted = form_ ? 200 : 10'000;
    // Area that so many samples cover, as that of a disc.
    double radius = std::sqrt(wanted / (0.5 * model->slab_mesh().slab_count() * 64.0 * 64 / (4 * 3.14159)) / 3.14159);
    if (form_) radius = 0.3;
    Editor editor(model);
    std::vector<double> seconds, samples, tiles;
    const CallTimer timer;
    editor.begin_stroke({.tool = Tool::Inflate, .radius = radius, .strength = 0.5});
    PickHint hint;
    for (int k = 0; k < (form_ ? 8 : 40 * repeats_); ++k) {
      const double turn = 0.1 * k;
      const SurfacePoint at =
          closest_point(*model, Vec3d{std::sin(turn), 0.3 * std::sin(0.7 * turn), std::cos(turn)}, hint);
      const auto changed = editor.dab(
          {.slab = at.slab, .contact = at.position, .cursor = at.position, .normal = at.normal, .seconds = 0.01});
      const SnapshotPtr head = editor.head();
      std::uint64_t touched = 0;
      const double took = timer([&] { touched = cache.update(*head)->tiles; });
      if (changed.samples == 0) continue;
      seconds.push_back(took);
      samples.push_back(static_cast<double>(changed.samples));
      tiles.push_back(static_cast<double>(touched));
    }
    editor.end_stroke();
    const std::string surface =
        fmt::format("ball, {} slabs, n = {}", model->slab_mesh().slab_count(), model->slab_mesh().intervals(0));
    add("display follows a dab, normals included", surface, 1e3 * median(seconds), "ms", at_most(0.5), "thread CPU");
    figures_.back()["more"] = {{"samples", median(samples)}, {"tiles", median(tiles)}};
    return {};
  }

  /// The display cache alone, when 20 slabs where a tool is are cut, so 60 are added, and when that is taken back.
  Status following_cuts(int levels) {
    RELIEF_TRY(const auto context, detail::GlContext::create());
    const detail::GlContext::Scope scope(*context);
    const SnapshotPtr model = rough_ball(levels, levels < 5 ? 32 : 16);
    const SlabMesh& mesh = model->slab_mesh();
    std::vector<SlabId> nearest(mesh.slab_count());
    std::iota(nearest.begin(), nearest.end(), 0U);
    std::ranges::sort(nearest, {}, [&](SlabId s) { return length(mesh.box(s).centre() - Vec3d{0.2, 0.1, 1}); });
    nearest.resize(20);
    RELIEF_TRY(const SnapshotPtr cut, with_detail(model, {.cuts = nearest, .grids = {}}));
    detail::DisplayCache kept;
    static_cast<void>(kept.update(*model));
    std::vector<double> cuts, undone, anew;
    const CallTimer timer;
    for (int k = 0; k < 2 * repeats_; ++k) {
      cuts.push_back(timer([&] { static_cast<void>(kept.update(*cut)); }));
      undone.push_back(timer([&] { static_cast<void>(kept.update(*model)); }));
      detail::DisplayCache fresh;
      anew.push_back(timer([&] { static_cast<void>(fresh.update(*cut)); }));
    }
    const std::string surface = fmt::format("ball, {} slabs, n = {}", mesh.slab_count(), mesh.intervals(0));
    add("display follows 20 slabs cut in four", surface, 1e3 * median(cuts), "ms", {}, "thread CPU");
    add("the same, taken back", surface, 1e3 * median(undone), "ms", {}, "thread CPU");
    add("display rebuilt", surface, 1e3 * median(anew), "ms", {}, "thread CPU");
    return {};
  }

  bool form_;
  int repeats_;
  mutable std::vector<std::uint32_t> pixels_;
  ordered_json out_, figures_ = ordered_json::array();
};

}  // namespace

Result<ordered_json> measure_frames(Extent extent) {
  FrameBench bench(extent);
  RELIEF_CHECK(bench.run());
  return bench.take();
}

std::string frames_text(const ordered_json& frames) {
  const ordered_json& machine = frames["machine"];
  return figures_table(frames["figures"]) +
         fmt::format(
             "  {}, {} cores; load average {:.1f} before, {:.1f} after\n"
             "  {}\n"
             "  1920 x 1080, one sample a pixel, read back with the background behind it; medians over {} frames or "
             "more, ours and\n"
             "  the classic renderer's in turn. Classic: one vertex buffer a slab, 28 bytes a vertex, indices of 16 "
             "bits, the same light.\n"
             "  GPU memory: samples, records, indices, commands and tables; not the pictures, and no colours.\n"
             "  {}\n",
             machine["processor"].get<std::string>(), machine["cores"].get<unsigned>(),
             machine["load_average_before"].get<double>(), machine["load_average_after"].get<double>(),
             frames["device"].get<std::string>(), frames["repeats"].get<int>(), frames["extent"].get<std::string>());
}

}  // namespace relief::bench
