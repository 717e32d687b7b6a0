// The demo: a model is converted, felt, carved and painted by a simulated hand while it is drawn, then saved, judged
// and shown.
#include "certificate.h"
#include "claims.h"
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
#include <relief/session/replay.h>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <numbers>
#include <optional>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

namespace relief::demo {

namespace {

constexpr double kHandForce = 4;  // N that the simulated hand pulls with at most: less than the device gives
constexpr double kAll = 0.95;     // share of it that counts as all

std::atomic<bool> cancel_asked{false};
void on_signal(int signal) {
  cancel_asked.store(true);
  std::signal(signal, SIG_DFL);
}

struct Options {
  std::string scan;
  std::filesystem::path out = "out";
  bool quick = false;
  std::vector<std::string> limits;
};

void say(const std::string& text) {
  std::fputs((text + "\n").c_str(), stdout);
  std::fflush(stdout);
}

/// The steps of the run. On a terminal the share that is done stands behind the step's name while it lasts.
class Steps {
 public:
  void begin(std::string text) {
    text_ = fmt::format("[{}/{}] {}", ++number_, kSteps, text);
    percent_ = -1;
    if (!on_terminal_) say(text_);
    show(0);
  }
  void show(double share) {
    const int percent = static_cast<int>(100 * share);
    if (!on_terminal_ || percent == percent_) return;
    percent_ = percent;
    std::fputs(fmt::format("\r\033[K{} {:3d} %", text_, percent).c_str(), stdout);
    std::fflush(stdout);
  }
  /// What came of it.
  void end(const std::string& text) {
    if (on_terminal_) say("\r\033[K" + text_);
    say("      " + text);
  }

 private:
  static constexpr int kSteps = 6;
  const bool on_terminal_ = isatty(STDOUT_FILENO) == 1;
  int number_ = 0, percent_ = -1;
  std::string text_;
};

/// A path as one types it here: short where it lies below the current folder, and one word of the shell.
std::string typed(const std::filesystem::path& path) {
  std::error_code error;
  const std::filesystem::path near = std::filesystem::proximate(path, error);
  std::string text =
      error || near.empty() || *near.begin() == ".." ? std::filesystem::absolute(path, error).string() : near.string();
  constexpr std::string_view kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789/._-+,:@";
  if (text.find_first_not_of(kPlain) == std::string::npos && !text.starts_with('-')) return text;
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? "'\\''" : std::string(1, c);
  return quoted + "'";
}

/// The folder of this program; empty where the system does not say.
std::filesystem::path program_folder() {
  std::error_code error;
  return std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
}

/// A program as it is typed: one of this folder needs its "./".
std::string as_program(const std::filesystem::path& program) {
  const std::string text = typed(program);
  return text.contains('/') ? text : "./" + text;
}

/// The relief program beside this one, else the one that the shell finds.
std::string relief_program() {
  std::error_code error;
  const std::filesystem::path beside = program_folder() / "relief";
  return std::filesystem::exists(beside, error) ? as_program(beside) : "relief";
}

/// What opens the window: ./dev, which builds it first, where the source tree is here and the window is not.
std::string studio_command() {
  std::error_code error;
  const std::filesystem::path folder = program_folder(), dev = folder / ".." / ".." / ".." / "dev";
  if (!std::filesystem::exists(folder / "relief-studio", error) && std::filesystem::is_regular_file(dev, error))
    return as_program(std::filesystem::canonical(dev, error)) + " studio";
  return relief_program() + " studio";
}

// NOLINTBEGIN(bugprone-unchecked-optional-access): run() fills what the steps after it use
class Demo {
 public:
  explicit Demo(const Options& options) : o_(options) {}

  /// Status is that of the run; whether its promises were kept is verdict().
  Status run() {
    for (const std::string& limit : o_.limits) RELIEF_CHECK(add_limit(limits_, limit));
    std::error_code error;
    std::filesystem::create_directories(o_.out, error);
    if (error) return fail(Errc::Io, printable(o_.out.string()) + ": cannot be made: " + error.message());
    greet();
    RELIEF_CHECK(convert_source());
    RELIEF_TRY(renderer_, make_renderer());
    RELIEF_CHECK(draw_before());
    RELIEF_CHECK(perform());
    RELIEF_CHECK(check());
    RELIEF_CHECK(draw_after());
    steps_.begin("Write the report");
    report_.claims = judge(facts_, limits_);
    RELIEF_CHECK(write_report(report_, o_.out / "report.html"));
    RELIEF_CHECK(write_verdict(report_, o_.out / "report.json"));
    steps_.end(fmt::format("everything is in {}", typed(o_.out)));
    say_verdict();
    return {};
  }
  [[nodiscard]] Verdict verdict() const { return worst(report_.claims); }

 private:
  static Result<std::optional<FrameRenderer>> make_renderer() {
    RELIEF_TRY(FrameRenderer made, FrameRenderer::create());
    return std::optional<FrameRenderer>(std::move(made));
  }

  void greet() const {
    const std::string what = o_.scan.empty() ? "Relief's own pumpkin" : printable(o_.scan);
    say(fmt::format(
        "Relief demo. It converts {}; a simulated hand feels, carves and paints it, with a force every\n"
        "millisecond, while it is drawn; then it checks what it promised, and draws pictures and a report.\n"
        "{} on 2 cores; it writes up to {} MB into {}. Ctrl-C stops it.\n",
        what, o_.quick ? "About 15 seconds" : "About 2 minutes", o_.quick ? 20 : 80, typed(o_.out)));
  }

  Status read_source(TriangleMesh& source) {
    if (o_.scan.empty()) {
      RELIEF_TRY(source, make_sample("pumpkin", o_.quick ? 20'000 : 300'000));
      report_.model_name = "pumpkin";
      return export_mesh(source, o_.out / "pumpkin.ply");
    }
    RELIEF_TRY(source, import_mesh(o_.scan));
    report_.model_name = printable(std::filesystem::path(o_.scan).filename().string(), 80);
    return {};
  }

  Status convert_source() {
    steps_.begin("Convert");
    TriangleMesh source;
    const double start = process_cpu_seconds();
    RELIEF_CHECK(read_source(source));
    ConvertSettings settings;
    settings.slabs = 200;
    settings.intervals = o_.quick ? 16 : 64;
    const Progress progress = {.report = [this](std::string_view, double share) { steps_.show(share); },
                               .cancel = &cancel_asked};
    const std::size_t triangles = source.triangles.size();
    Result<Conversion> converted = convert(std::move(source), settings, progress);
    // The library does not know the file's name, the user's sentence needs it.
    if (!converted)
      return fail(converted.error().code, (o_.scan.empty() ? "pumpkin" : o_.scan) + ": " + converted.error().message);
    Conversion made = std::move(*converted);
    made.model.info.source = report_.model_name;
    report_.convert_seconds = process_cpu_seconds() - start;
    report_.conversion = made.report;
    report_.conversion_verdict = relief::verdict(made.report, made.model.info);
    report_.title = "Relief demo: " + report_.model_name;
    report_.before = made.model.head;
    facts_.own_model = o_.scan.empty();
    facts_.is_certified = made.model.info.mode == Mode::Certified;
    facts_.not_certified = made.report.not_certified;
    facts_.failed_conditions = failed_conditions(made);
    facts_.distance =
        std::max({made.report.to_source.max, made.report.from_source.max, made.report.coverage.farthest}) *
        source_diagonal(made.model);
    facts_.diagonal = source_diagonal(made.model);
    facts_.unit = std::string(relief::name(made.model.info.unit));
    RELIEF_TRY(ModelFile created, ModelFile::create(o_.out / "model.relief", made.model));
    file_.emplace(std::move(created));
    box_ = bounds_of_surface(*made.model.head);
    // All pictures of a run have this shape and this view.
    report_.azimuth = 8;
    report_.elevation = 12;
    camera_ = framing(*made.model.head, report_.azimuth, report_.elevation, 16.0 / 9);
    steps_.end(fmt::format("{} triangles became {} slabs in {:.1f} CPU s. {}", triangles, made.report.slabs,
                           report_.convert_seconds, report_.conversion_verdict));
    return cancelled();
  }

  Status draw_before() {
    steps_.begin("Draw it before it is touched");
    const Snapshot& model = *file_->model().head;
    RELIEF_CHECK(picture(model, "before.png", "Before", "The model as it was converted, before anybody touched it.", {},
                         &before_));
    steps_.show(0.5);
    RELIEF_CHECK(picture(
        model, "slabs.png", "Slabs",
        fmt::format("The dark lines are the borders of the {} slabs, the coarse triangles that the model consists of. "
                    "All that is finer is a grid of heights in each of them.",
                    report_.conversion.slabs),
        {.look = {.slab_wires = true}}));
    steps_.end(drawn("before.png, slabs.png"));
    return {};
  }

  Status draw_after() {
    steps_.begin("Draw it after");
    const Snapshot& model = *file_->model().head;
    Picture after;
    RELIEF_CHECK(picture(model, "after.png", "After",
                         "The same model, seen from the same place, as the hand left it: eyes, nose and mouth are "
                         "carved, smoothed and painted dark; the brows are built up.",
                         {}, &after));
    count_colours(after);
    steps_.show(0.3);
    RELIEF_CHECK(hand_picture());
    steps_.show(0.6);
    RELIEF_CHECK(
        picture(model, "heat.png", "Heights and grid",
                "How far the surface lies above (orange) or below (blue) the middle of its slab, in the model's "
                "unit. Pale lines show where the grid became finer by itself, because the tool needed it.",
                {.look = {.slab_wires = true, .map = Look::Map::Displacement}}));
    RELIEF_CHECK(export_mesh(to_mesh(model), o_.out / "after.ply", {.unit = file_->model().info.unit}));
    // The order a reader wants: before and after side by side first.
    constexpr std::array<std::string_view, 5> kOrder = {"Before", "After", "Touch", "Slabs", "Heights and grid"};
    std::ranges::sort(report_.figures, {}, [&](const Figure& f) { return std::ranges::find(kOrder, f.title); });
    steps_.end(drawn("after.png, touch.png, heat.png"));
    return {};
  }

  [[nodiscard]] std::string drawn(std::string_view names) const {
    return fmt::format("{}, of {} triangles", names, renderer_->stats().triangles);
  }

  Status picture(const Snapshot& model, const char* file, const char* title, std::string caption, Frame frame,
                 Picture* keep = nullptr) {
    frame.camera = camera_;
    frame.width = o_.quick ? 320 : 1280;
    frame.height = o_.quick ? 180 : 720;
    frame.samples = 4;
    frame.tau = 0;
    frame.look.light = Look::Light::Studio;
    frame.look.lights = o_.quick ? 8 : 64;
    RELIEF_TRY(const Picture drawn, renderer_->picture(model, frame));
    RELIEF_CHECK(save_png(drawn, o_.out / file));
    if (keep != nullptr) *keep = drawn;
    report_.figures.push_back({o_.out / file, title, std::move(caption)});
    return cancelled();
  }

  /// Whether what was meant to be painted is seen in the picture: a place counts where a pixel within half of the
  /// brush's radius went a quarter of the way from what it was to the colour that was meant, or more.
  void count_colours(const Picture& after) {
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
    facts_.painted = painted_.size();
    facts_.seen = static_cast<std::size_t>(std::ranges::count_if(painted_, seen));
  }

  static Status cancelled() { return cancel_asked.load() ? fail(Errc::Cancelled, "cancelled") : Status{}; }

  /// Servo, editor and renderer at once.
  Status perform() {
    steps_.begin("Feel, carve and paint it");
    // A device with little friction: the hand draws smooth lines with it.
    const PlantPreset& preset = *std::ranges::find(plant_presets(), "premium-like", &PlantPreset::name);
    const std::uint64_t strokes = file_->stroke_count();
    RELIEF_TRY(Document document, Document::open(o_.out / "model.relief", *std::move(file_)));
    file_.reset();
    const SnapshotPtr head = document.head();
    const Workspace workspace = fit_workspace(preset.info, bounds_of_surface(*head));
    const Performance performance = plan_face(*head, workspace, o_.quick);
    painted_ = performance.painted;
    for (const Brush& brush : performance.brushes) report_.tools.push_back(brush.tool);
    facts_.force_limit = preset.info.max_force;
    auto done = std::make_shared<std::atomic<bool>>(false);
    SimulatedHand hand(preset, {.stiffness = 800, .damping = 8, .max_force = kHandForce}, script_of(performance, done));

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

    const Status drawn = draw_until(session, document, *done, performance.seconds);
    const Status stopped = session.stop();
    null_thread.join();
    made_ = document.head();
    report_.after = made_;
    report_.edits = document.statistics();
    if (drawn && stopped) undo_and_redo(document, head->content_hash());
    const Status saved = document.close();
    RELIEF_CHECK(drawn);
    RELIEF_CHECK(stopped);
    RELIEF_CHECK(saved);
    measure_forces();
    const SessionStats& stats = report_.stats = session.stats();
    facts_.tick_p99 = 1e-3 * static_cast<double>(stats.servo.compute.quantile(0.99));
    facts_.ticks = stats.servo.ticks;
    facts_.missed = stats.servo.overruns;
    facts_.slow_ticks = count_from(stats.servo.compute, 1e6);
    facts_.null_ticks = report_.null_loop.ticks;
    facts_.null_missed = report_.null_loop.overruns;
    facts_.force_max = report_.force_max;
    facts_.stuck_for = report_.stuck_for;
    facts_.strokes = report_.edits.strokes;
    facts_.dropped = stats.servo.dropped > 0;
    steps_.end(fmt::format("{:.0f} s at 1 kHz, {} of {} ticks in contact, up to {:.2f} N; {} strokes; {} frames drawn",
                           performance.seconds, stats.contact_samples, stats.samples, report_.force_max,
                           report_.edits.strokes, report_.frames));
    return cancelled();
  }

  /// Values of `from` ns or more, to the width of a bin.
  static std::uint64_t count_from(const TimeHistogram& times, double from) {
    std::uint64_t count = 0;
    for (int bin = 0; bin < TimeHistogram::kBins; ++bin)
      if (TimeHistogram::bin_low(bin) >= from) count += times.bin_count(bin);
    return count;
  }

  /// The greatest force, and how long it was all that the hand can pull with.
  void measure_forces() {
    double since = 0;
    bool pulls = false;
    for (const ServoSample& s : report_.trace) {
      const double force = length(s.force);
      report_.force_max = std::max(report_.force_max, force);
      if (!std::exchange(pulls, force > kAll * kHandForce)) since = s.t;
      if (pulls) report_.stuck_for = std::max(report_.stuck_for, s.t - since);
    }
  }

  void undo_and_redo(Document& document, std::uint64_t untouched) {
    const std::uint64_t steps = report_.edits.undo_steps;
    document.post(Undo{steps});
    document.settle();
    facts_.undo_equal = document.head()->content_hash() == untouched;
    document.post(Redo{steps});
    document.settle();
    facts_.redo_equal = document.head()->content_hash() == made_->content_hash();
  }

  Status draw_until(const Session& session, Document& document, const std::atomic<bool>& done, double lasting) {
    const auto begin = std::chrono::steady_clock::now();
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
      steps_.show(std::min(1.0, std::chrono::duration<double>(start - begin).count() / lasting));
      // The paper drew about 10 frames a second; the servo gets the rest of the machine.
      std::this_thread::sleep_until(start + std::chrono::milliseconds(100));
    }
    report_.frames = seconds.size();
    std::ranges::sort(seconds);
    if (!seconds.empty()) report_.frame_cpu_seconds = seconds[seconds.size() / 2];
    return {};
  }

  /// What was saved must be what was made, and the recording must give what was felt.
  Status check() {
    steps_.begin("Check: read the file back, repeat the recording");
    RELIEF_TRY(ModelFile opened, ModelFile::open(o_.out / "model.relief"));
    file_.emplace(std::move(opened));
    facts_.reload_equal = file_->model().head->content_hash() == made_->content_hash();
    RELIEF_TRY(Replay replay, Replay::open(o_.out / "session.rlog"));
    RELIEF_TRY(const SnapshotPtr model, find_model(replay, o_.out / "model.relief"));
    const Progress progress = {.report = [this](std::string_view, double share) { steps_.show(share); },
                               .cancel = &cancel_asked};
    RELIEF_TRY(const Verification found, relief::verify(replay, model, {}, progress));
    facts_.recorded = found.ticks;
    facts_.repeated = found.checked;
    facts_.not_repeated = found.stopped;
    if (found.difference)
      facts_.not_repeated =
          fmt::format("{} differs at {:.3f} s: {} was recorded, {} is computed now", found.difference->field,
                      found.difference->t, found.difference->recorded, found.difference->now);
    steps_.end(fmt::format("{} strokes read back; {} of {} ticks give the same forces again", file_->stroke_count(),
                           found.checked, found.ticks));
    return cancelled();
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
    return picture(
        *file_->model().head, "touch.png", "Touch",
        fmt::format(
            "The moment in which the hand pressed hardest while it carved. The pen is the tool, and its red tip is "
            "where the hand is; the yellow ball is as wide as the tool cuts; the green arrow is the force on "
            "the hand, {:.2f} N.",
            length(frame.hand ? frame.hand->force : Vec3d{})),
        frame);
  }

  void say_verdict() const {
    const std::vector<Claim>& claims = report_.claims;
    say("\n" + summary(claims));
    for (const Claim& c : claims) {
      say(fmt::format("  {}  {}\n        {}; limit {:.4g} {}", demo::name(c.verdict), c.text, c.measured, c.limit,
                      c.unit));
      if (!c.why.empty()) say("        Why: " + printable(c.why, 400));
    }
    const std::string program = relief_program(), model = typed(o_.out / "model.relief");
    say("\nLook:");
    say("  " + typed(o_.out / "report.html") + "  (the verdict, and the model in 3D, in a browser; no network)");
    for (const Figure& f : report_.figures) say("  " + typed(f.png));
    say("\nTry next:");
    say(fmt::format("  {} {}", studio_command(), model));
    say(fmt::format("  {} touch {} --device sim:hand --seconds 3", program, model));
    say(fmt::format("  {} export {} {}", program, model, typed(o_.out / "after.glb")));
  }

  Options o_;
  std::optional<FrameRenderer> renderer_;
  std::optional<ModelFile> file_;
  SnapshotPtr made_;              ///< what the hand left
  std::vector<Painted> painted_;  ///< what it was to paint
  Picture before_{};
  Box3d box_;
  Camera camera_;
  Steps steps_;
  Limits limits_;
  Facts facts_;
  Report report_;
};
// NOLINTEND(bugprone-unchecked-optional-access)

int main_inner(int argc, char** argv) {
  Options options;
  CLI::App app(
      "Converts a model, lets a simulated hand feel, carve and paint it, saves it, checks what was promised, and draws "
      "pictures and a report. Exit status: 0 where every claim holds or is excused (WARN), 1 where one fails, 2 wrong "
      "usage.");
  app.add_option("SCAN", options.scan, "A triangle mesh (default: Relief's own pumpkin)");
  app.add_option("--out", options.out, "Folder for the results (default: out)");
  app.add_flag("--quick", options.quick, "Small model, small pictures, one eye: for tests");
  app.add_option("--limit", options.limits,
                 "Judge by another limit, NAME=NUMBER in the unit of the report. Names: " + claim_ids())
      ->check([](const std::string& text) {
        Limits ignored;
        const Status known = add_limit(ignored, text);
        return known ? std::string() : known.error().message;
      });
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    std::fputs(app.help().c_str(), stdout);
    return 0;
  } catch (const CLI::ParseError& error) {
    std::fprintf(stderr, "relief-demo: %s; relief-demo --help lists the options\n",
                 printable(error.what(), 360).c_str());
    return 2;
  }
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
  Demo demo(options);
  if (const Status status = demo.run(); !status) {
    std::fputs(("relief-demo: " + printable(status.error().message, 480) + "\n").c_str(), stderr);
    return status.error().code == Errc::Cancelled ? 130 : 1;
  }
  return demo.verdict() == Verdict::Fail ? 1 : 0;
}

}  // namespace

}  // namespace relief::demo

int main(int argc, char** argv) try { return relief::demo::main_inner(argc, argv); } catch (const std::exception& e) {
  std::fprintf(stderr, "relief-demo: %s\n", e.what());
  return 1;
}
