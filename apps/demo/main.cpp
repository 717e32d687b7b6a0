// The demo: a model is converted, felt, carved and painted by a simulated hand while it is drawn, then saved and shown.
#include "face.h"
#include "report.h"

#include <relief/base/cpu_time.h>
#include <relief/base/try.h>
#include <relief/core/query.h>
#include <relief/file/model_file.h>
#include <relief/mesh/export.h>
#include <relief/mesh/import.h>
#include <relief/mesh/samples.h>
#include <relief/render/frame.h>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <numbers>
#include <optional>
#include <thread>
#include <vector>

namespace relief::demo {

namespace {

std::atomic<bool> cancel_asked{false};
void on_signal(int signal) {
  cancel_asked.store(true);
  std::signal(signal, SIG_DFL);
}

struct Options {
  std::string scan;
  std::filesystem::path out = "out";
  bool quick = false;
};

void say(const std::string& text) {
  std::fputs((text + "\n").c_str(), stdout);
  std::fflush(stdout);
}

// NOLINTBEGIN(bugprone-unchecked-optional-access): run() fills what the steps after it use
class Demo {
 public:
  explicit Demo(const Options& options) : o_(options) {}

  Status run() {
    std::error_code error;
    std::filesystem::create_directories(o_.out, error);
    if (error) return fail(Errc::Io, printable(o_.out.string()) + ": cannot be made: " + error.message());
    RELIEF_CHECK(convert_source());
    RELIEF_TRY(renderer_, make_renderer());
    RELIEF_CHECK(picture(*file_->model().head, "before.png", "before", {}, &before_));
    RELIEF_CHECK(picture(*file_->model().head, "slabs.png", "slabs", {.look = {.slab_wires = true}}));
    RELIEF_CHECK(perform());
    RELIEF_CHECK(reload());
    const Snapshot& head = *file_->model().head;
    Picture after;
    RELIEF_CHECK(picture(head, "after.png", "after", {}, &after));
    say_colours(after);
    RELIEF_CHECK(picture(head, "heat.png", "displacement and slabs after",
                         {.look = {.slab_wires = true, .map = Look::Map::Displacement}}));
    RELIEF_CHECK(hand_picture());
    RELIEF_CHECK(export_mesh(to_mesh(head), o_.out / "after.ply", {.unit = file_->model().info.unit}));
    // The order a reader wants: before and after side by side first.
    std::ranges::stable_sort(report_.figures, {}, [](const Figure& f) {
      return f.caption == "before" ? 0 : f.caption == "after" ? 1 : f.caption == "slabs" ? 2 : 3;
    });
    RELIEF_CHECK(write_report(report_, o_.out / "report.html"));
    say(
        fmt::format("written: {0}/report.html, before.png, after.png, slabs.png, heat.png, touch.png, model.relief, "
                    "after.ply, session.rlog",
                    o_.out.string()));
    return {};
  }

 private:
  static Result<std::optional<FrameRenderer>> make_renderer() {
    RELIEF_TRY(FrameRenderer made, FrameRenderer::create());
    return std::optional<FrameRenderer>(std::move(made));
  }

  Status convert_source() {
    TriangleMesh source;
    const double start = process_cpu_seconds();
    std::string source_name = "pumpkin";
    if (o_.scan.empty()) {
      RELIEF_TRY(source, make_sample("pumpkin", o_.quick ? 20'000 : 300'000));
      RELIEF_CHECK(export_mesh(source, o_.out / "pumpkin.ply"));
    } else {
      RELIEF_TRY(source, import_mesh(o_.scan));
      source_name = std::filesystem::path(o_.scan).filename().string();
    }
    ConvertSettings settings;
    settings.slabs = 200;
    settings.intervals = o_.quick ? 16 : 64;
    Progress progress;
    progress.cancel = &cancel_asked;
    RELIEF_TRY(Conversion made, convert(source, settings, progress));
    made.model.info.source = source_name;
    report_.convert_seconds = process_cpu_seconds() - start;
    report_.conversion = made.report;
    report_.model_name = source_name;
    report_.title = "Relief demo: " + source_name;
    say(fmt::format("converted {} ({} triangles) to {} slabs in {:.2f} CPU s", source_name, source.triangles.size(),
                    made.report.slabs, report_.convert_seconds));
    RELIEF_TRY(ModelFile created, ModelFile::create(o_.out / "model.relief", made.model));
    file_.emplace(std::move(created));
    box_ = surface_bounds(*made.model.head);
    // All pictures of a run have this shape and this view.
    camera_ = framing(*made.model.head, 14, 14, 16.0 / 9);
    return {};
  }

  Status picture(const Snapshot& model, const char* name, const char* caption, Frame frame, Picture* keep = nullptr) {
    frame.camera = camera_;
    frame.width = o_.quick ? 320 : 1280;
    frame.height = o_.quick ? 180 : 720;
    frame.samples = 4;
    frame.tau = 0;
    frame.look.light = Look::Light::Studio;
    frame.look.lights = o_.quick ? 8 : 64;
    RELIEF_TRY(const Picture drawn, renderer_->picture(model, frame));
    RELIEF_CHECK(save_png(drawn, o_.out / name));
    if (keep != nullptr) *keep = drawn;
    report_.figures.push_back({o_.out / name, caption});
    say(fmt::format("drew {} ({} triangles, {:.1f} CPU s)", name, renderer_->stats().triangles,
                    renderer_->stats().cpu_seconds));
    return cancelled();
  }

  /// Whether what was meant to be painted is seen in the picture: a place counts where a pixel within half of the
  /// brush's radius went a quarter of the way from what it was to the colour that was meant, or more.
  void say_colours(const Picture& after) const {
    const Vec3d forward = normalized(camera_.target - camera_.eye), right = normalized(cross(forward, camera_.up));
    const Vec3d up = cross(right, forward);
    const double focal = 0.5 * after.height / std::tan(camera_.field_of_view * std::numbers::pi / 360);
    const auto colour = [](const Picture& picture, int x, int y) {
      const std::size_t k =
          3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width) + static_cast<std::size_t>(x));
      return Vec3d{static_cast<double>(picture.rgb[k]), static_cast<double>(picture.rgb[k + 1]),
                   static_cast<double>(picture.rgb[k + 2])} /
             255.0;
    };
    const auto seen = [&](const Painted& place) {
      const Vec3d way = closest_point(*made_, place.position).position - camera_.eye;
      const double per_length = focal / dot(way, forward);
      const auto x = static_cast<int>(0.5 * after.width + per_length * dot(way, right));
      const auto y = static_cast<int>(0.5 * after.height - per_length * dot(way, up));
      const auto near = static_cast<int>(0.5 * place.radius * per_length);
      for (int j = std::max(y - near, 0); j <= std::min(y + near, after.height - 1); ++j)
        for (int i = std::max(x - near, 0); i <= std::min(x + near, after.width - 1); ++i) {
          const Vec3d was = colour(before_, i, j), wanted = to_double(place.colour) - was;
          if (dot(colour(after, i, j) - was, wanted) >= 0.25 * dot(wanted, wanted)) return true;
        }
      return false;
    };
    say(fmt::format("colours are seen where they were meant at {} of {} places", std::ranges::count_if(painted_, seen),
                    painted_.size()));
  }

  static Status cancelled() { return cancel_asked.load() ? fail(Errc::Cancelled, "cancelled") : Status{}; }

  /// Servo, editor and renderer at once.
  Status perform() {
    // A device with little friction: the hand draws smooth lines with it.
    const PlantPreset& preset = *std::ranges::find(plant_presets(), "premium-like", &PlantPreset::name);
    const std::uint64_t strokes = file_->stroke_count();
    RELIEF_TRY(Document document, Document::open(o_.out / "model.relief", *std::move(file_)));
    file_.reset();
    const SnapshotPtr head = document.head();
    const Workspace workspace = fit_workspace(preset.info, head->slab_mesh().bounds());
    const Performance performance = plan_face(*head, workspace, o_.quick);
    painted_ = performance.painted;
    say(fmt::format("the hand works for {:.0f} s", performance.seconds));
    auto done = std::make_shared<std::atomic<bool>>(false);
    SimulatedHand hand(preset, {.stiffness = 800, .damping = 8, .max_force = 4}, script_of(performance, done));

    Session::Settings settings;
    settings.servo.workspace = workspace;
    settings.on_tick = [this](const ServoTick& tick) { report_.trace.push_back(tick.sample); };
    settings.sculpt.full_depth = 0.008 * diagonal(box_);
    RELIEF_TRY(Recorder recorder, Recorder::create(o_.out / "session.rlog", Recorder::Pace::Live,
                                                   {.program = "relief-demo",
                                                    .model = o_.out / "model.relief",
                                                    .model_strokes = strokes,
                                                    .model_unit = std::string(name(document.info().unit))},
                                                   head, settings.servo, hand.info()));
    Session session(hand, document, settings, &recorder);
    session.set_brushes(performance.brushes);
    std::thread null_thread([&] { report_.null_loop = null_loop(performance.seconds, &cancel_asked); });

    const Status drawn = draw_until(session, document, *done);
    const Status stopped = session.stop();
    null_thread.join();
    const Status saved = document.close();
    RELIEF_CHECK(drawn);
    RELIEF_CHECK(stopped);
    RELIEF_CHECK(saved);
    made_ = document.head();
    double clamped_since = 0;
    bool clamped = false;
    for (const ServoSample& s : report_.trace) {
      report_.force_max = std::max(report_.force_max, length(s.force));
      if (!std::exchange(clamped, (s.flags & bit(ServoFault::ForceClamped)) != 0)) clamped_since = s.t;
      if (clamped) report_.stuck_for = std::max(report_.stuck_for, s.t - clamped_since);
    }
    report_.stats = session.stats();
    report_.edits = document.statistics();
    const SessionStats& stats = report_.stats;
    say(
        fmt::format("felt {} ticks ({} in contact, up to {:.2f} N, at the largest force for {:.0f} ms at a time), {} "
                    "strokes, {} dabs, {} samples edited, {} frames drawn",
                    stats.samples, stats.contact_samples, report_.force_max, 1e3 * report_.stuck_for,
                    report_.edits.strokes, report_.edits.dabs, report_.edits.samples, report_.frames));
    return cancelled();
  }

  Status draw_until(const Session& session, Document& document, const std::atomic<bool>& done) {
    Frame frame;
    frame.camera = camera_;
    frame.width = o_.quick ? 320 : 640;
    frame.height = o_.quick ? 180 : 360;
    std::vector<std::uint32_t> pixels(static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height));
    SnapshotChannel::Reader reader = document.reader();
    std::vector<double> seconds;
    while (!done.load() && session.running() && !cancel_asked.load()) {
      const auto start = std::chrono::steady_clock::now();
      RELIEF_TRY(const PixelRect drawn, renderer_->draw(reader.latest(), frame, pixels, frame.width));
      if (!drawn.empty()) {
        seconds.push_back(renderer_->stats().cpu_seconds);
        report_.frame_triangles = std::max(report_.frame_triangles, renderer_->stats().triangles);
      }
      // The paper drew about 10 frames a second; the servo gets the rest of the machine.
      std::this_thread::sleep_until(start + std::chrono::milliseconds(100));
    }
    report_.frames = seconds.size();
    std::ranges::sort(seconds);
    if (!seconds.empty()) report_.frame_cpu_seconds = seconds[seconds.size() / 2];
    return {};
  }

  /// What was saved must be what was made.
  Status reload() {
    const std::uint64_t made = made_->content_hash();
    RELIEF_TRY(ModelFile opened, ModelFile::open(o_.out / "model.relief"));
    file_.emplace(std::move(opened));
    report_.reload_identical = file_->model().head->content_hash() == made;
    if (!report_.reload_identical)
      return fail(Errc::Corrupt, (o_.out / "model.relief").string() + ": differs from what was saved");
    say(fmt::format("saved and read back: {} strokes, content hash {:016x}", file_->stroke_count(), made));
    return {};
  }

  /// The moment of the largest force while carving, with the hand.
  Status hand_picture() {
    const auto& trace = report_.trace;
    const auto strongest = std::ranges::max_element(
        trace, {}, [](const ServoSample& s) { return s.contact && (s.buttons & 1U) != 0 ? length(s.force) : -1.0; });
    Frame frame;
    if (strongest != trace.end() && strongest->contact)
      frame.hand = HandOverlay{.cursor = strongest->cursor,
                               .contact_point = strongest->contact_point,
                               .force = strongest->force,
                               .tool_radius = 0.014 * diagonal(box_),
                               .contact = true};
    return picture(*file_->model().head, "touch.png", "the hand where it pressed hardest: tool, contact point, force",
                   frame);
  }

  Options o_;
  std::optional<FrameRenderer> renderer_;
  std::optional<ModelFile> file_;
  SnapshotPtr made_;              ///< what the hand left
  std::vector<Painted> painted_;  ///< what it was to paint
  Picture before_{};
  Box3d box_;
  Camera camera_;
  Report report_;
};
// NOLINTEND(bugprone-unchecked-optional-access)

int main_inner(int argc, char** argv) {
  Options options;
  CLI::App app(
      "Converts a model, lets a simulated hand feel, carve and paint it, saves it, and draws pictures and a report.");
  app.add_option("SCAN", options.scan, "A triangle mesh (default: Relief's own pumpkin)");
  app.add_option("--out", options.out, "Folder for the results (default: out)");
  app.add_flag("--quick", options.quick, "Small model, small pictures, one eye: for tests");
  CLI11_PARSE(app, argc, argv);
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
  if (const Status status = Demo(options).run(); !status) {
    std::fputs(("relief-demo: " + printable(status.error().message, 480) + "\n").c_str(), stderr);
    return status.error().code == Errc::Cancelled ? 130 : 1;
  }
  return 0;
}

}  // namespace

}  // namespace relief::demo

int main(int argc, char** argv) try { return relief::demo::main_inner(argc, argv); } catch (const std::exception& e) {
  std::fprintf(stderr, "relief-demo: %s\n", e.what());
  return 1;
}
