// touch: forces along a path, or live with a device.
#include "commands.h"
#include "force_file.h"
#include "program.h"

#include <relief/base/cpu_time.h>
#include <relief/base/try.h>
#include <relief/devices/open_device.h>
#include <relief/file/model_file.h>
#include <relief/render/renderer.h>
#include <relief/session/recorder.h>
#include <relief/session/replay.h>
#include <relief/session/session.h>

#include <fmt/format.h>

#include <chrono>
#include <memory>
#include <optional>
#include <thread>

namespace relief::cli {

namespace {

using nlohmann::ordered_json;

constexpr double kSmallestTip = 1e-6, kLargestTip = 0.05;  // of the diagonal

struct TouchOptions {
  std::string model, path, out, device, record;
  double metres_per_unit = 0;
  Quatd axes;  ///< from the device's to the model's
  double seconds = 0;
  ForceSettings force;
  ReadingSettings readings;
  int clutch_button = 0;  ///< 1 to 8; 0: none
  LossSettings loss;
  double tool_radius = 0;
  bool names_tool = false;  ///< an option says which
  std::string tool_points;
};

/// What the user learns from a run, whichever way it went.
struct Summary {
  std::uint64_t ticks = 0, contact = 0, flagged = 0;
  std::uint32_t flags = 0;
  double force_max = 0, depth_max = 0;

  void add(const ServoSample& sample) {
    ++ticks;
    contact += sample.contact ? 1U : 0U;
    flagged += sample.flags != 0 ? 1U : 0U;
    flags |= sample.flags;
    force_max = std::max(force_max, length(sample.force));
    depth_max = std::max(depth_max, sample.depth);
  }
};

/// What a recording that is played as a device says of how it was made.
struct Played {
  double radius = 0;
  std::vector<Vec3d> points;  ///< of a rigid tool
  bool same_model = false;    ///< it was made with this model
  std::string missing_end;    ///< a line for where its end is missing
};

/// A device, and how the model lies in its workspace.
struct OpenedDevice {
  std::unique_ptr<HapticDevice> device;
  Workspace workspace;
  std::optional<Played> played = {};  ///< of a recording
};

/// The recording that --device names; empty where it names another device.
std::string played_recording(const TouchOptions& o) {
  return o.device.starts_with(kReplayDevice) ? o.device.substr(kReplayDevice.size()) : std::string();
}

/// By its name. A simulated hand goes over the whole model; a recording is played where it was made, unless the scale
/// is given.
Result<OpenedDevice> open_named(const TouchOptions& o, const Model& model) {
  if (o.device.starts_with(kReplayDevice)) {
    RELIEF_TRY(Replay replay, Replay::open(played_recording(o)));
    RELIEF_TRY(std::vector<DeviceState> readings, replay.readings());
    const ServoSettings& recorded = replay.settings().front();
    const bool same =
        fmt::format("{:016x}", model.head->content_hash()) == replay.recording().head().fact("model_hash");
    return OpenedDevice{.device = std::make_unique<ReplayDevice>(replay.device(), std::move(readings)),
                        .workspace = o.metres_per_unit > 0 || o.axes != Quatd{}
                                         ? workspace_for(model, replay.device(), o.metres_per_unit, o.axes)
                                         : recorded.workspace,
                        .played = Played{.radius = recorded.tool.radius,
                                         .points = {recorded.tool.points.begin(), recorded.tool.points.end()},
                                         .same_model = same,
                                         .missing_end = missing_end(replay.recording())}};
  }
  // The hand's way depends on the workspace, and that on the device.
  RELIEF_TRY(const std::unique_ptr<HapticDevice> known, open_device(o.device, {}));
  const Workspace workspace = workspace_for(model, known->info(), o.metres_per_unit, o.axes);
  RELIEF_TRY(std::unique_ptr<HapticDevice> device, open_device(o.device, exploring_hand(*model.head, workspace)));
  if (const DeviceStatus status = device->status(); !status.to_do.empty())
    return fail(Errc::DeviceUnavailable, printable(o.device) + ": " + printable(status.to_do, 300));
  return OpenedDevice{.device = std::move(device), .workspace = workspace};
}

/// The servo's settings as the options ask for them; without a tool among them, that of a recording that is played.
/// `points` is where a rigid tool's are kept.
Result<ServoSettings> settings_for(const TouchOptions& o, const ModelFile& file, const Workspace& workspace,
                                   const std::optional<Played>& played, std::vector<Vec3d>& points) {
  double radius = o.tool_radius;
  if (!o.tool_points.empty()) {
    RELIEF_TRY(points, read_tool_points(o.tool_points));
  } else if (played && !o.names_tool) {
    radius = played->radius;
    points = played->points;
  }
  const std::string said = played && !o.names_tool
                               ? fmt::format("{} was made with --tool-radius", printable(played_recording(o)))
                               : "--tool-radius";
  if (points.empty()) RELIEF_CHECK(check_tool_radius(radius, file.model(), o.model, said));
  const std::uint32_t clutch = o.clutch_button > 0 ? 1U << static_cast<unsigned>(o.clutch_button - 1) : 0U;
  return ServoSettings{.workspace = workspace,
                       .force = o.force,
                       .tool = {radius, points},
                       .readings = o.readings,
                       .clutch = {.buttons = clutch}};
}

/// What was taken over from a recording that is played.
void say_played(const TouchOptions& o, const Played& played, const TouchTool& tool) {
  const std::string recording = printable(played_recording(o));
  if (!played.missing_end.empty()) print(played.missing_end + "\n");
  if (!o.names_tool)
    print(fmt::format("{}: its tool was taken over, {}\n", recording, tool_name(tool.radius, tool.points.size())));
  if (!played.same_model)
    print(fmt::format("{}: was made with another model than {}, or before that was changed\n", recording,
                      printable(o.model)));
}

/// The recorder that --record asks for.
Result<std::optional<Recorder>> recorder_for(const TouchOptions& o, Recorder::Pace pace, const ModelFile& file,
                                             const ServoSettings& settings, const DeviceInfo& device) {
  if (o.record.empty()) return std::nullopt;
  RELIEF_TRY(Recorder recorder, Recorder::create(o.record, pace,
                                                 {.program = program(),
                                                  .model = o.model,
                                                  .model_strokes = file.stroke_count(),
                                                  .model_unit = std::string(name(file.model().info.unit))},
                                                 file.model().head, settings, device));
  return std::optional<Recorder>(std::move(recorder));
}

ordered_json to_json(const Summary& s) {
  ordered_json json;
  json["ticks"] = s.ticks;
  json["contact"] = s.contact;
  json["flagged"] = s.flagged;
  json["flags"] = flag_names(s.flags);
  json["force_max"] = s.force_max;
  json["depth_max"] = s.depth_max;
  return json;
}

void say(const Context& context, const ordered_json& json, const Summary& s) {
  if (context.json) {
    print_json(json);
    return;
  }
  const std::string flags = joined(flag_names(s.flags));
  print(fmt::format(
      "{} ticks, {} in contact, largest force {:.3f} N, deepest {:.4g}{}\n", s.ticks, s.contact, s.force_max,
      s.depth_max,
      flags.empty() ? "" : fmt::format("; {} tick{} flagged: {}", s.flagged, s.flagged == 1 ? "" : "s", flags)));
}

/// How the recording ended.
OutputEnd end_of(const TouchOptions& o, const Recorder& recorder, Status status) {
  return {.name = printable(o.record), .rows = recorder.kept(), .status = std::move(status), .of = "ticks"};
}

ordered_json to_json(const std::vector<OutputEnd>& outputs) {
  ordered_json json = ordered_json::array();
  for (const OutputEnd& end : outputs) {
    ordered_json one = {{"file", end.name}, {std::string(end.of), end.rows}};
    if (end.lost > 0) one["lost"] = end.lost;
    if (!end.status) one["error"] = end.status.error().message;
    json.push_back(std::move(one));
  }
  return json;
}

/// "f.csv: 1200 rows".
std::string text_of(const OutputEnd& end) {
  return fmt::format("{}: {} {}{}{}", end.name, end.rows, end.of,
                     end.lost > 0 ? fmt::format(" ({} were left out: the disk was too slow)", end.lost) : "",
                     end.status ? "" : ", and then it failed");
}

/// Into the JSON of a run that failed, or was stopped, and left something all the same.
void add_error(ordered_json& json, const Status& ended) {
  if (!ended) json["error"] = {{"code", name(ended.error().code)}, {"message", ended.error().message}};
}

/// What the run ends in, each output for itself: the first that failed, with what the others hold.
Status end_of(const std::vector<OutputEnd>& outputs, const std::string& cancelled) {
  std::string rest;
  const OutputEnd* failed = nullptr;
  for (const OutputEnd& end : outputs) {
    if (!end.status && failed == nullptr)
      failed = &end;
    else
      rest += (rest.empty() ? "" : "; ") + text_of(end);
  }
  if (failed != nullptr)
    return fail(failed->status.error().code, fmt::format("{} ({} {} are in it){}", failed->status.error().message,
                                                         failed->rows, failed->of, rest.empty() ? "" : "; " + rest));
  if (!cancelled.empty()) return fail(Errc::Cancelled, cancelled + (rest.empty() ? "" : "; " + rest));
  return {};
}

Status run_path(const TouchOptions& o, const Context& context) {
  RELIEF_TRY(const ModelFile file, open_model(o.model, context));
  RELIEF_TRY(const std::vector<PathRow> rows, read_path(o.path));
  // The limits are those of the device named, or touch-like; without one the path may lead anywhere. It need not fit
  // into a workspace: nobody has to reach it.
  DeviceInfo device = plant_presets().front().info;
  device.workspace_radius = 0;
  const Workspace workspace = workspace_for(file.model(), device, o.metres_per_unit, o.axes);
  if (!o.device.empty()) {
    RELIEF_TRY(const OpenedDevice named, open_named(o, file.model()));
    device = named.device->info();
  }
  std::vector<Vec3d> points;
  RELIEF_TRY(const ServoSettings settings, settings_for(o, file, workspace, {}, points));
  RELIEF_TRY(std::optional<Recorder> recorder, recorder_for(o, Recorder::Pace::Path, file, settings, device));
  Servo servo(settings, device);
  RELIEF_TRY(PathForces out, PathForces::create(o.out, !points.empty()));
  Summary summary;
  bool takes_rows = true, cancelled = false;
  for (std::size_t k = 0; k < rows.size() && (takes_rows || recorder); ++k) {
    if (k % 4096 == 0) {
      cancelled = context.progress.cancelled();
      if (cancelled) break;
      context.progress("touch", static_cast<double>(k) / static_cast<double>(rows.size()));
    }
    ServoTick tick;
    tick.number = k;
    tick.model = file.model().head.get();
    tick.reading.t = rows[k].t;
    tick.reading.position = settings.workspace.to_device(rows[k].position);
    tick.reading.has_orientation = rows[k].orientation.has_value();
    tick.reading.orientation = rows[k].orientation.value_or(Quatd{});
    ServoSample& sample = tick.sample;
    if (recorder) {
      const std::uint64_t start = thread_cpu_ns();
      sample = servo.step(*tick.model, tick.reading);
      sample.compute_ns = static_cast<std::uint32_t>(thread_cpu_ns() - start);
      recorder->tick(tick);
    } else {
      sample = servo.step(*tick.model, tick.reading);
    }
    // Without contact p is the cursor: as read and not through the device's units, or the last good one.
    if (!sample.contact && (sample.flags & (bit(ServoFault::BadPosition) | bit(ServoFault::NoNews))) == 0)
      sample.contact_point = rows[k].position;
    summary.add(sample);
    takes_rows = takes_rows && out.row(sample, rows[k].text);
  }
  std::vector<OutputEnd> outputs = {out.finish()};
  if (recorder) {
    Status recorded = recorder->finish(nullptr);
    outputs.push_back(end_of(o, *recorder, std::move(recorded)));
  }
  ordered_json json = to_json(summary);
  json["metres_per_unit"] = settings.workspace.metres_per_unit;
  json["outputs"] = to_json(outputs);
  Status ended =
      end_of(outputs, cancelled ? fmt::format("stopped after {} of {} rows", summary.ticks, rows.size()) : "");
  add_error(json, ended);
  say(context, json, summary);
  return ended;
}

/// Tells of each loss of the device as it comes; `told` counts what was.
void say_losses(const std::vector<DeviceLoss>& losses, std::size_t& told) {
  for (std::size_t k = told / 2; k < losses.size(); ++k) {
    const DeviceLoss& loss = losses[k];
    if (told == 2 * k) {
      print(fmt::format("tick {}: the device does not answer{}; no force, trying again\n", loss.tick,
                        loss.reason.empty() ? "" : ": " + printable(loss.reason)));
      ++told;
    }
    if (!loss.over) return;
    print(fmt::format("the device answers again after {:.3g} s; forces come back once it has lifted off\n",
                      loss.seconds));
    ++told;
  }
}

ordered_json to_json(const std::vector<DeviceLoss>& losses) {
  ordered_json json = ordered_json::array();
  for (const DeviceLoss& loss : losses)
    json.push_back({{"tick", loss.tick},
                    {"seconds", loss.seconds},
                    {"over", loss.over},
                    {"reopened", loss.reopened},
                    {"reason", printable(loss.reason)}});
  return json;
}

ordered_json to_json(const ServoTimes& times) {
  return {{"ticks", times.ticks},
          {"overruns", times.overruns},
          {"dropped", times.dropped},
          {"realtime", times.realtime},
          {"memory_locked", times.memory_locked},
          {"note", times.note},
          {"losses", times.losses},
          {"compute_ns_p50", times.compute.quantile(0.5)},
          {"compute_ns_p999", times.compute.quantile(0.999)},
          {"late_ns_p50", times.late.quantile(0.5)},
          {"late_ns_max", times.late.max()}};
}

/// Waits until the time is over, the device has ended or is given up, or somebody stops it; returns how long that was,
/// s. Without --seconds a recording is played to its end.
double wait_for_end(const Session& session, const TouchOptions& o, const Context& context, std::size_t& told) {
  const auto start = std::chrono::steady_clock::now();
  for (double elapsed = 0;; std::this_thread::sleep_for(std::chrono::milliseconds(10))) {
    elapsed = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (!session.running() || (o.seconds > 0 && elapsed >= o.seconds) || context.progress.cancelled()) return elapsed;
    if (o.seconds > 0) context.progress("touch", elapsed / o.seconds);
    if (!context.json) say_losses(session.losses(), told);
  }
}

/// What a live run says when it is over.
void say_live(const Context& context, const ordered_json& json, const Summary& summary, const ServoTimes& times,
              const std::vector<OutputEnd>& outputs) {
  say(context, json, summary);
  if (context.json) return;
  for (const OutputEnd& end : outputs) print(text_of(end) + "\n");
  if (!times.note.empty()) print("servo: " + times.note + "\n");
  if (times.dropped > 0)
    print(fmt::format("{} ticks are missing: the machine was too busy to take them all down\n", times.dropped));
}

Status run_live(const TouchOptions& o, const Context& context) {
  RELIEF_TRY(const ModelFile file, open_model(o.model, context));
  RELIEF_TRY(const OpenedDevice opened, open_named(o, file.model()));
  HapticDevice& device = *opened.device;
  Session::Settings settings;
  settings.loss = o.loss;
  std::vector<Vec3d> points;
  RELIEF_TRY(settings.servo, settings_for(o, file, opened.workspace, opened.played, points));
  if (opened.played && !context.json) say_played(o, *opened.played, settings.servo.tool);
  RELIEF_TRY(std::optional<Recorder> recorder,
             recorder_for(o, Recorder::Pace::Live, file, settings.servo, device.info()));
  std::unique_ptr<LiveForces> out;
  if (!o.out.empty()) {
    RELIEF_TRY(out, LiveForces::create(o.out, !points.empty()));
    settings.on_tick = [&out](const ServoTick& tick) { out->take(tick); };
  }
  Session session(device, file.model().head, nullptr, settings, recorder ? &*recorder : nullptr);
  std::size_t told = 0;
  const double seconds = wait_for_end(session, o, context, told);
  const bool gone = !session.running() && !device.ended();
  static_cast<void>(session.stop());  // there is no file, and how the recording ended is asked for below
  const SessionStats& stats = session.stats();
  const std::vector<DeviceLoss> losses = session.losses();
  if (!context.json) say_losses(losses, told);
  std::vector<OutputEnd> outputs;
  if (out) outputs.push_back(out->finish());
  if (recorder) outputs.push_back(end_of(o, *recorder, session.recorded()));
  Status ended = end_of(outputs, context.progress.cancelled() ? fmt::format("stopped after {:.1f} s", seconds) : "");
  if (ended && gone) {
    const std::string why = losses.empty() ? stats.servo.note : losses.back().reason;
    ended = fail(Errc::DeviceLost, fmt::format("{}: the device did not answer any more{}", printable(o.device),
                                               why.empty() ? "" : ": " + printable(why)));
  }
  const Summary summary = {.ticks = stats.samples,
                           .contact = stats.contact_samples,
                           .flagged = stats.flagged_samples,
                           .flags = stats.flags,
                           .force_max = stats.force_max,
                           .depth_max = stats.depth_max};
  ordered_json json = to_json(summary);
  json["metres_per_unit"] = opened.workspace.metres_per_unit;
  json["tool_radius"] = settings.servo.tool.radius;
  json["tool_points"] = points.size();
  if (opened.played) json["recorded_model"] = opened.played->same_model;
  json["servo"] = to_json(stats.servo);
  json["losses"] = to_json(losses);
  json["outputs"] = to_json(outputs);
  add_error(json, ended);
  say_live(context, json, summary, stats.servo, outputs);
  return ended;
}

Status run_touch(const TouchOptions& o, const Context& context) {
  const std::string played = played_recording(o);
  RELIEF_CHECK(check_outputs({o.out, o.record}, {o.model, o.path, o.tool_points, played}));
  RELIEF_CHECK(check_no_model({o.out, o.record}));
  if (!o.path.empty()) return run_path(o, context);
  return run_live(o, context);
}

}  // namespace

Status check_tool_radius(double radius, const Model& model, std::string_view name, std::string_view said) {
  if (radius == 0) return {};
  const double size =
      model.info.source_diagonal > 0 ? model.info.source_diagonal : diagonal(surface_bounds(*model.head));
  const double least = kSmallestTip * size, most = kLargestTip * size;
  if (radius >= least && radius <= most) return {};
  return fail(Errc::InvalidArgument,
              fmt::format("{} {}: of {} it is {:.6g} to {:.6g}, a millionth to 5 % of the diagonal, or 0 for a point",
                          said, radius, printable(name), least, most));
}

std::string tool_name(double radius, std::size_t points) {
  if (points > 0) return fmt::format("a tool of {} points", points);
  return radius > 0 ? fmt::format("a ball of radius {}", radius) : "a point";
}

std::vector<std::string> flag_names(std::uint32_t flags) {
  std::vector<std::string> names;
  for (std::uint32_t b = 1; b != 0 && b <= flags; b <<= 1U)
    if ((flags & b) != 0) names.emplace_back(name(static_cast<ServoFault>(b)));
  return names;
}

Workspace workspace_for(const Model& model, const DeviceInfo& device, double metres_per_unit, Quatd axes) {
  Workspace workspace = fit_workspace(device, model.head->slab_mesh().bounds(), model.info.source_diagonal, axes);
  if (metres_per_unit > 0) workspace.metres_per_unit = metres_per_unit;
  return workspace;
}

void add_force_options(CLI::App& command, ForceSettings& force) {
  command.add_option("--stiffness", force.stiffness, "N/m at the hand, at most the device's [default 400]")
      ->check(in_range(0, 1e6))
      ->type_name("N");
  command.add_option("--damping", force.damping, "N*s/m along the normal, at most the device's [default 1]")
      ->check(in_range(0, 1e4))
      ->type_name("N");
  command.add_option("--friction", force.friction, "Coulomb coefficient [0 to 4, default 0: off]")
      ->check(in_range(0, 4))
      ->type_name("N");
  command
      .add_option("--static-friction", force.static_friction,
                  "That of a tool at rest, never less than --friction [0 to 4, default: as --friction]")
      ->check(in_range(0, 4))
      ->type_name("N");
  command.add_option("--max-force", force.max_force, "Largest force, N [default and at most: the device's]")
      ->check(in_range(0, 1e9))
      ->type_name("N");
  CLI::Option* exact =
      command.add_flag("--exact-normals", force.exact_normals,
                       "Push straight towards the contact point instead of along the interpolated normal");
  command
      .add_flag("--paper-contact", force.paper_contact,
                "Contact as the paper has it: a function of the tool's place alone, lost below the slabs")
      ->excludes(exact);
  CLI::Option* on = command.add_flag(
      "--guard", force.guard,
      "Passivity control, limits on lasting force, work and speed, gentle first contact [touch: live on]");
  command
      .add_flag_callback(
          "--no-guard", [&force] { force.guard = false; }, "Switch these off [touch: along a path off]")
      ->excludes(on);
}

bool names_guard(const CLI::App& command) { return command.count("--guard") + command.count("--no-guard") > 0; }

void add_touch(CLI::App& app, Context& context) {
  auto o = std::make_shared<TouchOptions>();
  CLI::App* c = app.add_subcommand("touch", "Feel a model along a path, or live with a device");
  c->footer(
      "Examples:\n"
      "  relief touch pumpkin.relief --path press.csv -o force.csv\n"
      "  relief touch pumpkin.relief --device sim:hand --seconds 5 -o live.csv --record live.rlog\n"
      "  relief touch pumpkin.relief --device replay:live.rlog -o again.csv\n\n"
      "P.csv: header t,x,y,z (s; model units), one row per tick, each a reading of the device.\n"
      "F.csv: a row per row: position as read, contact 0/1, slab,u,v,alpha and depth (model units), contact point p,\n"
      "unit normal n outwards, force f on the hand (N), and flags, a sum of:\n"
      "  1 bad position, 2 bad time, 4 too fast, 8 latched, 16 force clamped, 32 rate clamped,\n"
      "  64 stiffness clamped, 128 start inside, 256 device lost, 512 overrun, 1024 sample dropped,\n"
      "  2048 surface jumped, 4096 passivity, 8192 load limited, 16384 speed limited, 32768 stalled,\n"
      "  65536 late ticks, 131072 no news, 262144 looks uncalibrated, 524288 reconnected, 1048576 forces off");
  c->add_option("MODEL", o->model, "The model")->required()->check(names_file)->type_name("");
  CLI::Option* path = c->add_option("--path", o->path, "The tool's path, P.csv")->check(names_file)->type_name("FILE");
  CLI::Option* out =
      c->add_option("-o,--output", o->out, "Where the forces go, F.csv")->check(names_file)->type_name("FILE");
  CLI::Option* device = c->add_option("--device", o->device,
                                      "A name that `relief devices` lists, such as sim:hand: live for --seconds, "
                                      "a recording also to its end;\nwith --path its limits hold")
                            ->type_name("NAME")
                            ->check([](const std::string& name) -> std::string {
                              if (name.empty()) return "takes the name of a device, and the one given is empty";
                              return name == kReplayDevice ? names_file("") : std::string();
                            });
  CLI::Option* seconds = c->add_option("--seconds", o->seconds, "Live: how long [0.01 to 3600]")
                             ->check(in_range(0.01, 3600))
                             ->type_name("SECONDS");
  c->add_option("--metres-per-unit", o->metres_per_unit,
                "Metres of the hand per model unit [default: the diagonal is 0.15 m, or what fits the device]")
      ->check(in_range(1e-12, 1e12))
      ->type_name("METRES");
  auto axes = std::make_shared<std::string>();
  c->add_option("--axes", *axes,
                "Which device axis is the model's x, y and z, such as y,-x,z; no mirror [default x,y,z]")
      ->type_name("MAP")
      ->check([](const std::string& map) {
        const auto rotation = rotation_of_axes(map);
        return rotation ? std::string() : rotation.error().message;
      });
  add_force_options(*c, o->force);
  c->add_option("--debounce", o->readings.debounce,
                "Live: how long a button must be up before it counts as released [0 to 1, default 0.02]")
      ->check(in_range(0, 1))
      ->type_name("SECONDS");
  c->add_option("--clutch-button", o->clutch_button,
                "Live: while this button is down, the device moves and the tool and its force stay [1 to 8]")
      ->check([](const std::string& text) {
        const bool known = text.size() == 1 && text[0] >= '1' && text[0] <= '8';
        return known ? std::string() : "takes a button from 1 to 8, not \"" + printable(text, 40) + "\"";
      })
      ->type_name("K");
  c->add_option("--retry", o->loss.give_up_after,
                "Live: how long a device that does not answer is tried again; it is reopened after 1 s [default 30]")
      ->type_name("SECONDS")
      ->check(in_range(0, 1e9));
  c->get_option("--static-friction")->needs("--friction");
  CLI::Option* radius =
      c->add_option("--tool-radius", o->tool_radius,
                    "A ball: its radius in model units, at most 5 % of the diagonal [default: a point]")
          ->check(in_range(0, 1e300))
          ->type_name("R");
  c->add_option("--tool-points", o->tool_points,
                "A rigid tool: a CSV file x,y,z of at most 1000 points, model units, 0,0,0 being the device's place;\n"
                "P.csv may have the header t,x,y,z,qw,qx,qy,qz, and F.csv ends in the torque tx,ty,tz (N*m)")
      ->type_name("FILE")
      ->excludes(radius)
      ->check(names_file);
  c->add_option("--record", o->record, "Record every tick's input and output, REC.rlog, for relief replay")
      ->check(names_file)
      ->type_name("FILE");
  path->excludes(seconds)->needs(out);
  seconds->needs(device);
  finish_command(*c, context, [o, &context] { return run_touch(*o, context); });
  c->parse_complete_callback([o, c, axes] {
    if (!axes->empty()) o->axes = rotation_of_axes(*axes).value_or(Quatd{});
    o->names_tool = c->count("--tool-radius") + c->count("--tool-points") + c->count("--paper-contact") > 0;
    if (!names_guard(*c)) o->force.guard = o->path.empty();
    if (o->force.paper_contact && (o->tool_radius > 0 || !o->tool_points.empty()))
      throw CLI::ValidationError("--paper-contact is of a point: it goes with neither --tool-radius nor --tool-points");
    if (o->path.empty() && (o->device.empty() || (o->seconds == 0 && !o->device.starts_with(kReplayDevice))))
      throw CLI::ValidationError("touch needs --path P.csv -o F.csv, or --device NAME --seconds S");
  });
}

}  // namespace relief::cli
