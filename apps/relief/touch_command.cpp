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

Status run_path(const TouchOptions& o, const Context& context) {
  RELIEF_TRY(const ModelFile file, open_model(o.model, context));
  RELIEF_TRY(const std::vector<PathRow> rows, read_path(o.path));
  // The limits are those of the device named, or touch-like; without one the path may lead anywhere. It need not fit
  // into a workspace: nobody has to reach it.
  DeviceInfo device = plant_presets().front().info;
  device.workspace_radius = 0;
  const Workspace workspace = fit_workspace(device, file.model(), o.metres_per_unit, o.axes);
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
  RELIEF_CHECK(check_no_model({o.out, o.record}));
  if (!o.path.empty()) return run_path(o, context);
  return run_live(o, context);
}

}  // namespace

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
  CLI::Option* path = c->add_option("--path", o->path,
                                    "The tool's path, P.csv, felt with the limits of --device; with --tool-points its "
                                    "header may be t,x,y,z,qw,qx,qy,qz, and F.csv ends in the torque tx,ty,tz (N*m)")
                          ->check(names_file)
                          ->type_name("FILE");
  CLI::Option* out =
      c->add_option("-o,--output", o->out, "Where the forces go, F.csv")->check(names_file)->type_name("FILE");
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
