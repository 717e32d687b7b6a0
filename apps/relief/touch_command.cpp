// touch: forces along a path, or live with a device.
#include "live.h"

#include <relief/base/cpu_time.h>
#include <relief/base/try.h>
#include <relief/devices/open_device.h>
#include <relief/file/model_file.h>
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

struct TouchOptions : LiveOptions {
  std::string path, out;
};

/// A path that is meant for another model, or in other units, is not felt anywhere.
void say_far_away(const std::string& path, const Box3d& box) {
  warn(fmt::format(
      "{}: no place is near the model, which reaches from ({:.4g}, {:.4g}, {:.4g}) to ({:.4g}, {:.4g}, {:.4g})",
      printable(path), box.low.x, box.low.y, box.low.z, box.high.x, box.high.y, box.high.z));
}

Status run_path(const TouchOptions& o, const Context& context) {
  RELIEF_TRY(const ModelFile file, open_model(o.model, context));
  RELIEF_TRY(const std::vector<PathRow> rows, read_path(o.path));
  // Limits and scale are those of the device named. Without one the limits are touch-like and the path may lead
  // anywhere: it need not fit into a workspace that nobody has to reach.
  DeviceInfo device = plant_presets().front().info;
  device.workspace_radius = 0;
  Workspace workspace = fit_workspace(device, file.model(), o.metres_per_unit, o.axes);
  if (!o.device.empty()) {
    RELIEF_TRY(const OpenedDevice named, open_named(o, file.model(), 0, context.progress));
    device = named.device->info();
    workspace = named.workspace;
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
  if (summary.ticks > 0 && summary.flagged == summary.ticks && (summary.flags & bit(ServoFault::BadPosition)) != 0)
    say_far_away(o.path, file.model().head->slab_mesh().bounds());
  ordered_json json = to_json(summary);
  json["metres_per_unit"] = settings.workspace.metres_per_unit;
  json["outputs"] = to_json(outputs);
  Status ended =
      end_of(outputs, cancelled ? fmt::format("stopped after {} of {} rows", summary.ticks, rows.size()) : "");
  add_error(json, ended);
  say(context, json, summary);
  return ended;
}

Status run_live(const TouchOptions& o, const Context& context) {
  RELIEF_TRY(const ModelFile file, open_model(o.model, context));
  RELIEF_TRY(const OpenedDevice opened, open_named(o, file.model(), 0, context.progress));
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
  Document document(file.model());
  Session session(device, document, settings, recorder ? &*recorder : nullptr);
  std::size_t told = 0;
  const double seconds = wait_for_end(session, o, context, "touch", told);
  const bool gone = !session.running() && !device.ended();
  Status recorded = session.stop();
  const SessionStats stats = session.stats();
  const std::vector<DeviceLoss> losses = session.losses();
  if (!context.json) say_losses(losses, told);
  std::vector<OutputEnd> outputs;
  if (out) outputs.push_back(out->finish());
  if (recorder) outputs.push_back(end_of(o, *recorder, std::move(recorded)));
  Status ended = end_of(outputs, context.progress.cancelled() ? fmt::format("stopped after {:.1f} s", seconds) : "");
  if (ended && gone) ended = device_lost(o, losses, stats.servo);
  const Summary summary = summary_of(stats);
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
  check_no_model({{o.out, "forces", ".csv"}, {o.record, "recordings", ".rlog"}});
  if (!o.path.empty()) return run_path(o, context);
  return run_live(o, context);
}

}  // namespace

void add_touch(CLI::App& app, Context& context) {
  auto o = std::make_shared<TouchOptions>();
  CLI::App* c = app.add_subcommand("touch", "Feel a model along a path, or live with a device");
  context.catalogue[c] = {
      .group = "Feel",
      .examples = {{"relief touch scan.relief --path press.csv -o force.csv"},
                   {"relief touch scan.relief --path press.csv -o force.csv --tool-radius 2", "a ball; in model units"},
                   {"relief touch scan.relief --device sim:hand --seconds 5 -o live.csv --record live.rlog"},
                   {"relief touch scan.relief --device replay:live.rlog -o again.csv"}},
      .notes = "The files: relief help path-csv. The column flags: relief help flags. Devices: relief help devices.\n"};
  c->add_option("MODEL", o->model, "the model")->required()->check(names_file);
  CLI::Option* path =
      c->add_option("--path", o->path, "the tool's path, felt with the limits and the scale of --device")
          ->check(names_file)
          ->type_name("PATH.csv");
  CLI::Option* out = c->add_option("-o,--output", o->out, "where the forces go, a row per tick")
                         ->check(names_file)
                         ->type_name("FORCE.csv");
  add_live_options(*c, *o);
  path->excludes("--seconds")->needs(out);
  finish_command(*c, context, [o, &context] { return run_touch(*o, context); });
  c->parse_complete_callback([o, c] {
    complete(*c, *o, o->path.empty());
    if (o->path.empty() && (o->device.empty() || (o->seconds == 0 && !o->device.starts_with(kReplayDevice))))
      throw CLI::ValidationError("touch needs --path P.csv -o F.csv, or --device NAME --seconds S");
  });
}

}  // namespace relief::cli
