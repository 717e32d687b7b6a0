// touch: forces along a path, or live with a device.
#include "commands.h"

#include <relief/base/atomic_file.h>
#include <relief/base/try.h>
#include <relief/devices/open_device.h>
#include <relief/file/model_file.h>
#include <relief/session/session.h>

#include <fmt/format.h>

#include <chrono>
#include <memory>
#include <optional>
#include <thread>

namespace relief::cli {

namespace {

using nlohmann::ordered_json;

struct TouchOptions {
  std::string model, path, out, device;
  double metres_per_unit = 0;
  double seconds = 0;
  ForceSettings force;
};

std::vector<std::string> flag_names(std::uint32_t flags) {
  std::vector<std::string> names;
  for (std::uint32_t b = 1; b != 0 && b <= flags; b <<= 1U)
    if ((flags & b) != 0) names.emplace_back(name(static_cast<ServoFault>(b)));
  return names;
}

/// What the user learns from a run, whichever way it went.
struct Summary {
  std::uint64_t ticks = 0, contact = 0, flagged = 0;
  std::uint32_t flags = 0;
  double force_max = 0, depth_max = 0;
};

/// A scripted hand over the whole model; what a device is opened with.
Result<std::unique_ptr<HapticDevice>> open_named(const std::string& device, const Workspace& workspace,
                                                 const Box3d& bounds) {
  Box3d reach;
  reach.add(workspace.to_device(bounds.low));
  reach.add(workspace.to_device(bounds.high));
  return open_device(device, exploring_hand(reach));
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
  std::string flags;
  for (const std::string& f : flag_names(s.flags)) flags += (flags.empty() ? "" : ", ") + f;
  print(fmt::format("{} ticks, {} in contact, largest force {:.3f} N, deepest {:.4g}{}\n", s.ticks, s.contact,
                    s.force_max, s.depth_max,
                    flags.empty() ? "" : fmt::format("; {} ticks flagged: {}", s.flagged, flags)));
}

Status run_path(const TouchOptions& o, const Context& context) {
  RELIEF_TRY(const ModelFile file, ModelFile::open(o.model, true));
  RELIEF_TRY(const std::vector<PathRow> rows, read_path(o.path));
  // The limits are those of the device named, or touch-like.
  DeviceInfo device = plant_presets().front().info;
  const Box3d bounds = file.model().head->slab_mesh().bounds();
  if (!o.device.empty()) {
    RELIEF_TRY(const auto named, open_named(o.device, workspace_for(file.model(), device, o.metres_per_unit), bounds));
    device = named->info();
  }
  const ServoSettings settings{.workspace = workspace_for(file.model(), device, o.metres_per_unit), .force = o.force};
  Servo servo(settings, device);
  RELIEF_TRY(AtomicFile out, AtomicFile::create(o.out));
  RELIEF_CHECK(out.write(force_header()));
  Summary summary;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    if (k % 4096 == 0) {
      if (context.progress.cancelled()) return fail(Errc::Cancelled, "cancelled");
      context.progress("touch", static_cast<double>(k) / static_cast<double>(rows.size()));
    }
    DeviceState reading;
    reading.t = rows[k].t;
    reading.position = settings.workspace.to_device(rows[k].position);
    ServoSample sample = servo.step(*file.model().head, reading);
    // Without contact p is the cursor, as read and not through the device's units.
    if (!sample.contact) sample.contact_point = rows[k].position;
    ++summary.ticks;
    summary.contact += sample.contact ? 1U : 0U;
    summary.flagged += sample.flags != 0 ? 1U : 0U;
    summary.flags |= sample.flags;
    summary.force_max = std::max(summary.force_max, length(sample.force));
    summary.depth_max = std::max(summary.depth_max, sample.depth);
    RELIEF_CHECK(out.write(force_row(sample, rows[k].text)));
  }
  RELIEF_CHECK(out.commit());
  ordered_json json = to_json(summary);
  json["metres_per_unit"] = settings.workspace.metres_per_unit;
  say(context, json, summary);
  return {};
}

Status run_live(const TouchOptions& o, const Context& context) {
  RELIEF_TRY(const ModelFile file, ModelFile::open(o.model, true));
  const Workspace workspace = workspace_for(file.model(), plant_presets().front().info, o.metres_per_unit);
  RELIEF_TRY(const std::unique_ptr<HapticDevice> device,
             open_named(o.device, workspace, file.model().head->slab_mesh().bounds()));
  std::optional<AtomicFile> out;
  if (!o.out.empty()) {
    RELIEF_TRY(AtomicFile created, AtomicFile::create(o.out));
    out.emplace(std::move(created));
  }
  Session::Settings settings;
  settings.servo = {.workspace = workspace, .force = o.force};
  settings.keep_trace = out.has_value();
  Session session(*device, file.model().head, nullptr, settings);
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(o.seconds);
  while (session.running() && std::chrono::steady_clock::now() < end && !context.progress.cancelled()) {
    const double left = std::chrono::duration<double>(end - std::chrono::steady_clock::now()).count();
    context.progress("touch", 1 - left / o.seconds);
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  RELIEF_CHECK(session.stop());
  if (context.progress.cancelled()) return fail(Errc::Cancelled, "cancelled");
  const SessionStats& stats = session.stats();
  const Summary summary = {.ticks = stats.samples,
                           .contact = stats.contact_samples,
                           .flagged = stats.flagged_samples,
                           .flags = stats.flags,
                           .force_max = stats.force_max,
                           .depth_max = stats.depth_max};
  if (out) {
    RELIEF_CHECK(out->write(force_header()));
    for (const ServoSample& s : stats.trace)
      RELIEF_CHECK(out->write(force_row(s, fmt::format("{},{},{},{}", s.t, s.cursor.x, s.cursor.y, s.cursor.z))));
    RELIEF_CHECK(out->commit());
  }
  ordered_json json = to_json(summary);
  json["metres_per_unit"] = workspace.metres_per_unit;
  json["servo"] = {{"ticks", stats.servo.ticks},
                   {"overruns", stats.servo.overruns},
                   {"dropped", stats.servo.dropped},
                   {"realtime", stats.servo.realtime},
                   {"compute_ns_p50", stats.servo.compute.quantile(0.5)},
                   {"compute_ns_p999", stats.servo.compute.quantile(0.999)},
                   {"late_ns_p50", stats.servo.late.quantile(0.5)},
                   {"late_ns_max", stats.servo.late.max()}};
  say(context, json, summary);
  return {};
}

Status run_touch(const TouchOptions& o, const Context& context) {
  RELIEF_CHECK(check_outputs({o.out}, {o.model, o.path}));
  if (!o.path.empty()) return run_path(o, context);
  return run_live(o, context);
}

}  // namespace

Workspace workspace_for(const Model& model, const DeviceInfo& device, double metres_per_unit) {
  Workspace workspace = fit_workspace(device, model.head->slab_mesh().bounds());
  if (metres_per_unit > 0)
    workspace.metres_per_unit = metres_per_unit;
  else if (model.info.source_diagonal > 0)
    workspace.metres_per_unit = 0.15 / model.info.source_diagonal;
  return workspace;
}

void add_touch(CLI::App& app, Context& context) {
  auto o = std::make_shared<TouchOptions>();
  CLI::App* c =
      app.add_subcommand("touch",
                         "Feel a model along a path, or live with a device.\n"
                         "P.csv has the header t,x,y,z (s; model units), one row per tick. F.csv has a row "
                         "per row: position as read, contact 0/1,\n"
                         "slab, u, v of the surface contact point, alpha, depth (model units), that point p,\n"
                         "unit normal n outwards there, force f on the hand (N), and\n"
                         "flags: 1 bad position, 2 bad time, 4 too fast, 8 latched, 16 force clamped, 32 "
                         "rate clamped, 64 setting clamped,\n"
                         "128 start inside, 256 device lost, 512 overrun, 1024 sample dropped, 2048 surface jumped,\n"
                         "4096 passivity, 8192 load limited, 16384 speed limited, 32768 stalled.");
  c->add_option("MODEL", o->model, "The model")->required();
  CLI::Option* path = c->add_option("--path", o->path, "P.csv: the tip's path");
  CLI::Option* out = c->add_option("-o,--output", o->out, "F.csv: where the forces go");
  CLI::Option* device = c->add_option(
      "--device", o->device,
      "sim:hand, or another name that `relief devices` lists: live with --seconds; with --path its limits hold");
  CLI::Option* seconds = c->add_option("--seconds", o->seconds, "Live: how long")->check(in_range(0.01, 3600));
  c->add_option("--metres-per-unit", o->metres_per_unit,
                "Metres of the hand per model unit (default: the model's diagonal becomes 0.15 m)")
      ->check(in_range(1e-12, 1e12));
  c->add_option("--stiffness", o->force.stiffness, "N/m at the hand (default 400; the device's limit holds)")
      ->check(in_range(0, 1e6));
  c->add_option("--damping", o->force.damping, "N*s/m along the normal (default 1)")->check(in_range(0, 1e4));
  c->add_option("--friction", o->force.friction, "Coulomb coefficient, 0 to 4 (default 0: off)")->check(in_range(0, 4));
  c->add_flag("--exact-normals", o->force.exact_normals,
              "Push straight towards the surface contact point instead of along the interpolated normal");
  c->add_flag("--paper-contact", o->force.paper_contact,
              "Contact as the paper has it: a function of the tip's place alone, lost below the slabs");
  auto guard = std::make_shared<bool>(true);
  CLI::Option* guarded = c->add_flag(
      "--guard,!--no-guard", *guard,
      "Passivity controller, limits on lasting force, work and speed, gentle first contact; live they are on, "
      "along a path off");
  path->excludes(seconds)->needs(out);
  seconds->needs(device);
  finish_command(*c, context, [o, &context] { return run_touch(*o, context); });
  c->parse_complete_callback([o, guard, guarded] {
    o->force.guard = guarded->count() > 0 ? *guard : o->path.empty();
    if (o->path.empty() && (o->device.empty() || o->seconds == 0))
      throw CLI::ValidationError("touch needs --path P.csv -o F.csv, or --device NAME --seconds S");
  });
}

}  // namespace relief::cli
