#include "live.h"

#include "program.h"

#include <relief/base/try.h>
#include <relief/devices/open_device.h>
#include <relief/render/picture.h>

#include <fmt/format.h>

#include <chrono>
#include <thread>

namespace relief::cli {

using nlohmann::ordered_json;

namespace {

/// "f.csv: 1200 rows".
std::string text_of(const OutputEnd& end) {
  return fmt::format("{}: {} {}{}{}", end.name, end.rows, end.of,
                     end.lost > 0 ? fmt::format(" ({} were left out: the disk was too slow)", end.lost) : "",
                     end.status ? "" : ", and then it failed");
}

}  // namespace

std::string played_recording(const LiveOptions& o) {
  return o.device.starts_with(kReplayDevice) ? o.device.substr(kReplayDevice.size()) : std::string();
}

Result<OpenedDevice> open_named(const LiveOptions& o, const Model& model, std::uint32_t buttons,
                                const Progress& progress) {
  if (o.device.starts_with(kReplayDevice)) {
    RELIEF_TRY(PlayedDevice played, play_as_device(played_recording(o), progress));
    const ServoSettings& recorded = played.replay.settings().front();
    const bool placed = o.metres_per_unit > 0 || o.axes != Quatd{};
    return OpenedDevice{
        .device = std::move(played.device),
        .workspace =
            placed ? fit_workspace(played.replay.device(), model, o.metres_per_unit, o.axes) : recorded.workspace,
        .played = OpenedDevice::Played{.radius = recorded.tool.radius,
                                       .points = {recorded.tool.points.begin(), recorded.tool.points.end()},
                                       .same_model = played.was_made_with(*model.head),
                                       .missing_end = missing_end(played.replay.recording())}};
  }
  // The hand's way depends on the workspace, and that on the device.
  RELIEF_TRY(const std::unique_ptr<HapticDevice> known, open_device(o.device, {}));
  const Workspace workspace = fit_workspace(known->info(), model, o.metres_per_unit, o.axes);
  RELIEF_TRY(std::unique_ptr<HapticDevice> device,
             open_device(o.device, exploring_hand(*model.head, workspace, buttons)));
  RELIEF_CHECK(bring_up(*device));
  return OpenedDevice{.device = std::move(device), .workspace = workspace};
}

Result<ServoSettings> settings_for(const LiveOptions& o, const ModelFile& file, const Workspace& workspace,
                                   const std::optional<OpenedDevice::Played>& played, std::vector<Vec3d>& points) {
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

void say_played(const LiveOptions& o, const OpenedDevice::Played& played, const TouchTool& tool) {
  const std::string recording = printable(played_recording(o));
  if (!played.missing_end.empty()) print(played.missing_end + "\n");
  if (!o.names_tool)
    print(fmt::format("{}: its tool was taken over, {}\n", recording, tool_name(tool.radius, tool.points.size())));
  if (!played.same_model)
    print(fmt::format("{}: was made with another model than {}, or before that was changed\n", recording,
                      printable(o.model)));
}

Result<std::optional<Recorder>> recorder_for(const LiveOptions& o, Recorder::Pace pace, const ModelFile& file,
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

Summary summary_of(const SessionStats& stats) {
  return {.ticks = stats.samples,
          .contact = stats.contact_samples,
          .flagged = stats.flagged_samples,
          .flags = stats.flags,
          .force_max = stats.force_max,
          .depth_max = stats.depth_max};
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

OutputEnd end_of(const LiveOptions& o, const Recorder& recorder, Status status) {
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

double wait_for_end(const Session& session, const LiveOptions& o, const Context& context, std::string_view phase,
                    std::size_t& told) {
  const auto start = std::chrono::steady_clock::now();
  for (double elapsed = 0;; std::this_thread::sleep_for(std::chrono::milliseconds(10))) {
    elapsed = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (!session.running() || (o.seconds > 0 && elapsed >= o.seconds) || context.progress.cancelled()) return elapsed;
    if (o.seconds > 0) context.progress(phase, elapsed / o.seconds);
    if (!context.json) say_losses(session.losses(), told);
  }
}

void say_live(const Context& context, const ordered_json& json, const Summary& summary, const ServoTimes& times,
              const std::vector<OutputEnd>& outputs) {
  say(context, json, summary);
  if (context.json) return;
  for (const OutputEnd& end : outputs) print(text_of(end) + "\n");
  if (!times.note.empty()) print("servo: " + times.note + "\n");
  if (times.dropped > 0)
    print(fmt::format("{} ticks are missing: the machine was too busy to take them all down\n", times.dropped));
}

Status device_lost(const LiveOptions& o, const std::vector<DeviceLoss>& losses, const ServoTimes& times) {
  const std::string why = losses.empty() ? times.note : losses.back().reason;
  return fail(Errc::DeviceLost, fmt::format("{}: the device did not answer any more{}", printable(o.device),
                                            why.empty() ? "" : ": " + printable(why)));
}

Status check_tool_radius(double radius, const Model& model, std::string_view name, std::string_view said) {
  if (radius == 0) return {};
  const double size =
      model.info.source_diagonal > 0 ? model.info.source_diagonal : diagonal(surface_bounds(*model.head));
  const BallRange range = ball_range(size);
  if (range.has(radius)) return {};
  return fail(Errc::InvalidArgument,
              fmt::format("{} {}: of {} it is {:.6g} to {:.6g}, a millionth to 5 % of the diagonal, or 0 for a point",
                          said, radius, printable(name), range.least, range.most));
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

void add_force_options(CLI::App& command, ForceSettings& force) {
  const std::string section = "Force";
  command.add_option("--stiffness", force.stiffness, "N/m at the hand, at most the device's")
      ->check(in_range(0, 1e6))
      ->type_name("K")
      ->default_str("400")
      ->group(section);
  command.add_option("--damping", force.damping, "N*s/m along the normal, at most the device's")
      ->check(in_range(0, 1e4))
      ->type_name("B")
      ->default_str("1")
      ->group(section);
  command.add_option("--friction", force.friction, "Coulomb coefficient")
      ->check(in_range(0, 4))
      ->type_name("MU")
      ->default_str("0: off")
      ->group(section);
  command.add_option("--static-friction", force.static_friction, "that of a tool at rest, never less than --friction")
      ->check(in_range(0, 4))
      ->type_name("MU")
      ->default_str("as --friction")
      ->group(section);
  command.add_option("--max-force", force.max_force, "largest force, N, at most the device's")
      ->check(in_range(0, 1e9))
      ->type_name("NEWTONS")
      ->default_str("the device's")
      ->group(section);
  CLI::Option* exact = command
                           .add_flag("--exact-normals", force.exact_normals,
                                     "push straight towards the contact point, not along the interpolated normal")
                           ->group(section);
  command
      .add_flag("--paper-contact", force.paper_contact,
                "contact as in the paper: of the tool's place alone, lost below the slabs")
      ->excludes(exact)
      ->group(section);
  CLI::Option* on = command.add_flag("--guard", force.guard, "switch on passivity control and load limits")
                        ->default_str("live")
                        ->group(section);
  command
      .add_flag_callback(
          "--no-guard", [&force] { force.guard = false; }, "switch off passivity control and load limits")
      ->default_str("along a path")
      ->excludes(on)
      ->group(section);
}

bool names_guard(const CLI::App& command) { return command.count("--guard") + command.count("--no-guard") > 0; }

void add_live_options(CLI::App& c, LiveOptions& o) {
  const std::string live = "Live", tool = "Tool";
  CLI::Option* device =
      c.add_option("--device", o.device, "what touches the model, such as sim:hand; relief devices lists them")
          ->type_name("DEVICE")
          ->check([](const std::string& name) -> std::string {
            if (name.empty()) return "takes the name of a device, and the one given is empty";
            return name == kReplayDevice ? names_file("") : std::string();
          })
          ->group(live);
  c.add_option("--seconds", o.seconds, "how long; a recording is also played to its end")
      ->check(in_range(0.01, 3600))
      ->type_name("SECONDS")
      ->needs(device)
      ->group(live);
  c.add_option("--metres-per-unit", o.metres_per_unit, "metres of the hand per model unit")
      ->check(in_range(1e-12, 1e12))
      ->type_name("METRES")
      ->default_str("the diagonal is 0.15 m, or what fits the device")
      ->group(live);
  c.add_option("--axes", o.axis_map, "which device axis is the model's x, y and z, such as y,-x,z; no mirror")
      ->type_name("MAP")
      ->default_str("x,y,z")
      ->check([](const std::string& map) {
        const auto rotation = rotation_of_axes(map);
        return rotation ? std::string() : rotation.error().message;
      })
      ->group(live);
  c.add_option("--debounce", o.readings.debounce, "how long a button must be up before it counts as released")
      ->check(in_range(0, 1))
      ->type_name("SECONDS")
      ->default_str("0.02")
      ->group(live);
  c.add_option("--clutch-button", o.clutch_button, "while this button is down, the device moves and the tool stays")
      ->check(whole_in_range(1, 8))
      ->type_name("K")
      ->default_str("none")
      ->group(live);
  c.add_option("--retry", o.loss.give_up_after, "how long a device that does not answer is tried again")
      ->type_name("SECONDS")
      ->check(in_range(0, 1e9))
      ->default_str("30")
      ->group(live);
  c.add_option("--record", o.record, "record every tick for relief replay")
      ->check(names_file)
      ->type_name("REC.rlog")
      ->group(live);
  CLI::Option* radius =
      c.add_option("--tool-radius", o.tool_radius, "a ball of this radius, model units, at most 5 % of the diagonal")
          ->check(in_range(0, 1e300))
          ->type_name("R")
          ->default_str("0: a point")
          ->group(tool);
  c.add_option("--tool-points", o.tool_points,
               "a rigid tool: x,y,z of at most 1000 points, model units; 0,0,0 is the device's place")
      ->type_name("FILE.csv")
      ->excludes(radius)
      ->check(names_file)
      ->group(tool);
  add_force_options(c, o.force);
  c.get_option("--static-friction")->needs("--friction");
}

void complete(const CLI::App& command, LiveOptions& o, bool guarded) {
  if (!o.axis_map.empty()) o.axes = rotation_of_axes(o.axis_map).value_or(Quatd{});
  o.names_tool = command.count("--tool-radius") + command.count("--tool-points") + command.count("--paper-contact") > 0;
  if (!names_guard(command)) o.force.guard = guarded;
  if (o.force.paper_contact && (o.tool_radius > 0 || !o.tool_points.empty()))
    throw CLI::ValidationError("--paper-contact is of a point: it goes with neither --tool-radius nor --tool-points");
}

}  // namespace relief::cli
