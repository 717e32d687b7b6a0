// replay: what a recording holds, whether it can be repeated bit for bit, and what other settings would have done.
#include "commands.h"
#include "replay_page.h"

#include <relief/base/steps.h>
#include <relief/base/try.h>
#include <relief/convert/room.h>
#include <relief/session/replay.h>

#include <fmt/format.h>

#include <algorithm>
#include <memory>

namespace relief::cli {

namespace {

using nlohmann::ordered_json;

struct ReplayOptions {
  std::string recording, model, csv, mcap, report;
  bool verify = false;
  ForceSettings force;
  double tool_radius = 0;
  std::function<void(ServoSettings&)> change;  ///< empty when no setting was given
};

ordered_json to_json(const ServoSettings& s, const DeviceInfo& device) {
  return {{"metres_per_unit", s.workspace.metres_per_unit},
          {"stiffness", s.force.stiffness},
          {"damping", s.force.damping},
          {"friction", s.force.friction},
          {"static_friction", std::max(s.force.friction, s.force.static_friction)},
          {"max_force", std::min(s.force.max_force, device.max_force)},
          {"exact_normals", s.force.exact_normals},
          {"paper_contact", s.force.paper_contact},
          {"guard", s.force.guard},
          {"tool_radius", s.tool.radius},
          {"tool_points", s.tool.points.size()}};
}

/// What the recording itself says.
ordered_json summary_of(const Replay& replay) {
  const Recording& recording = replay.recording();
  ordered_json json;
  json["recording"] = printable(recording.file().string());
  json["facts"] = ordered_json::object();
  for (const auto& [key, value] : recording.head().facts) json["facts"][printable(key, 60)] = printable(value, 400);
  json["ticks"] = recording.tick_count();
  json["gaps"] = ordered_json::array();
  std::uint64_t next = 0;
  for (const TickRun& run : recording.runs()) {
    if (run.first != next) json["gaps"].push_back({{"first", next}, {"ticks", run.first - next}});
    next = run.first + run.count;
  }
  const bool ended = !recording.head().fact("end").empty();
  json["whole"] = ended && !recording.cut();
  if (recording.cut()) json["cut"] = {{"bytes", recording.cut()->bytes}, {"of", recording.cut()->whole_bytes}};
  json["contact_law"] = replay.contact_law();
  json["events"] = recording.events().size();
  json["device"] = {{"name", printable(replay.device().name)},
                    {"max_force", replay.device().max_force},
                    {"max_stiffness", replay.device().max_stiffness},
                    {"max_damping", replay.device().max_damping},
                    {"max_force_rate", replay.device().max_force_rate}};
  json["settings"] = to_json(replay.settings().front(), replay.device());
  json["settings_changes"] = replay.settings().size() - 1;
  if (!replay.unknown().empty()) json["unknown"] = replay.unknown();
  return json;
}

/// Of friction at rest, where it is another one.
std::string at_rest(const ordered_json& settings) {
  const double still = settings["static_friction"].get<double>();
  return still > settings["friction"].get<double>() ? fmt::format(" ({} at rest)", still) : std::string();
}

std::string tool_of(const ordered_json& settings) {
  return ", " + tool_name(settings["tool_radius"].get<double>(), settings["tool_points"].get<std::size_t>());
}

void say_summary(const ordered_json& json) {
  for (const auto& [key, value] : json["facts"].items())
    print(fmt::format("{:14} {}\n", key, value.get<std::string>()));
  std::uint64_t lost = 0;
  for (const auto& gap : json["gaps"]) lost += gap["ticks"].get<std::uint64_t>();
  print(fmt::format("{} ticks{}, {} changes of the settings\n", json["ticks"].get<std::uint64_t>(),
                    lost == 0 ? "" : fmt::format(", {} lost in {} gaps", lost, json["gaps"].size()),
                    json["settings_changes"].get<std::uint64_t>()));
  const auto& s = json["settings"];
  print(fmt::format("stiffness {} N/m, damping {} N*s/m, friction {}{}{}{}{}{}\n", s["stiffness"].get<double>(),
                    s["damping"].get<double>(), s["friction"].get<double>(), at_rest(s),
                    s["exact_normals"].get<bool>() ? ", exact normals" : "",
                    s["paper_contact"].get<bool>() ? ", the paper's contact" : "",
                    s["guard"].get<bool>() ? ", guarded" : "", tool_of(s)));
}

/// Why forces may differ that are worked out anew; empty under the same law.
std::string other_law(int recorded) {
  if (recorded == kContactLaw) return {};
  return fmt::format("recorded under contact law {}, and this program has {} law {}, so differences are expected",
                     recorded, recorded < kContactLaw ? "the newer" : "the older", kContactLaw);
}

/// The sentence for a recording that could not be repeated; empty when it was.
std::string complaint(const Verification& v) {
  const std::string law = other_law(v.contact_law);
  if (v.difference)
    return fmt::format("tick {} (t = {} s) differs: {} is now {}, recorded {}{}", v.difference->tick, v.difference->t,
                       v.difference->field, v.difference->now, v.difference->recorded,
                       law.empty() ? "" : "; it was " + law);
  if (!v.stopped.empty())
    return fmt::format("cannot be checked from tick {} on: {}", v.checked, printable(v.stopped, 200));
  return {};
}

ordered_json to_json(const Verification& v) {
  ordered_json json;
  json["holds"] = v.holds();
  json["ticks"] = v.ticks;
  json["checked"] = v.checked;
  json["contact_law"] = v.contact_law;
  if (v.difference)
    json["difference"] = {{"tick", v.difference->tick},
                          {"t", v.difference->t},
                          {"field", v.difference->field},
                          {"recorded", v.difference->recorded},
                          {"now", v.difference->now}};
  if (!v.stopped.empty()) json["stopped"] = printable(v.stopped, 400);
  if (!v.missing.empty()) json["missing"] = v.missing;
  return json;
}

ordered_json to_json(const Comparison& c) {
  return {{"ticks", c.ticks},
          {"force_rms", c.force_rms},
          {"error_rms", c.error_rms},
          {"error_max", c.error_max},
          {"error_at", c.error_at},
          {"direction_rms_degrees", c.direction_rms},
          {"direction_max_degrees", c.direction_max},
          {"contact", c.contact},
          {"contact_differs", c.contact_differs},
          {"step_ns_p50", {{"recorded", c.cost.quantile(0.5)}, {"other", c.other_cost.quantile(0.5)}}},
          {"step_ns_p999", {{"recorded", c.cost.quantile(0.999)}, {"other", c.other_cost.quantile(0.999)}}}};
}

void say(const Comparison& c) {
  print(
      fmt::format("force rms {:.4g} N with the recorded settings; with the others it differs by rms {:.4g} N, at most "
                  "{:.4g} N (tick {})\n",
                  c.force_rms, c.error_rms, c.error_max, c.error_at));
  print(
      fmt::format("direction differs by rms {:.3g}, at most {:.3g} degrees; contact differs in {} of {} ticks, {} of "
                  "them in contact as recorded\n",
                  c.direction_rms, c.direction_max, c.contact_differs, c.ticks, c.contact));
  print(fmt::format("CPU per tick, median: {:.2f} us as recorded, {:.2f} us with the other settings\n",
                    static_cast<double>(c.cost.quantile(0.5)) * 1e-3,
                    static_cast<double>(c.other_cost.quantile(0.5)) * 1e-3));
}

Status run_replay(const ReplayOptions& o, const Context& context) {
  RELIEF_CHECK(check_outputs({o.csv, o.mcap, o.report}, {o.recording, o.model}));
  check_no_model({{o.csv, "tables", ".csv"}, {o.mcap, "recordings", ".mcap"}, {o.report, "pages", ".html"}});
  RELIEF_TRY(Replay replay, Replay::open(o.recording));
  SnapshotPtr model;
  ModelInfo info;
  RoomMaker make_room;
  const bool needs_model = o.verify || o.change || !o.model.empty();
  const int parts = (needs_model ? 1 : 0) + (o.csv.empty() ? 0 : 1) + (o.mcap.empty() ? 0 : 1) + (o.verify ? 1 : 0) +
                    (o.change ? 1 : 0);
  int part = 0;
  // What was asked for shares the whole evenly.
  const auto next_part = [&](std::string_view name) {
    const double from = part++;
    return part_of(context.progress, name, from / parts, (from + 1) / parts);
  };
  if (needs_model) {
    RELIEF_TRY(SnapshotPtr found, find_model(
                                      replay, o.model,
                                      [&](const auto& file, const ModelFile& opened) {
                                        info = opened.model().info;
                                        return warn_of_doubt(file.string(), opened, context);
                                      },
                                      next_part("reading")));
    model = std::move(found);
    make_room = room_maker(info.source_diagonal);
    RELIEF_CHECK(check_tool_radius(o.tool_radius, {.info = info, .head = model}, o.recording));
  }
  ordered_json json = summary_of(replay);
  if (!context.json) {
    if (const std::string missing = missing_end(replay.recording()); !missing.empty()) print(missing + "\n");
    if (const std::string law = other_law(replay.contact_law()); !law.empty() && !o.verify)
      print(printable(o.recording) + ": " + law + "\n");
  }
  if (!o.csv.empty()) RELIEF_CHECK(export_csv(replay.recording(), o.csv, kSlabOrNone, next_part("writing")));
  if (!o.mcap.empty()) RELIEF_CHECK(export_mcap(replay.recording(), o.mcap, kSlabOrNone, next_part("writing")));
  replay.rewind();
  if (!o.report.empty()) {
    RELIEF_CHECK(write_replay_page(replay, o.report));
    if (!context.json)
      print(fmt::format("{}: a page with the curves of {} ticks\n", printable(o.report),
                        replay.recording().tick_count()));
  }
  const bool only_shown = !o.verify && !o.change && o.csv.empty() && o.mcap.empty() && o.report.empty();
  if (only_shown && !context.json) say_summary(json);

  std::string failed;
  if (o.verify) {
    RELIEF_TRY(const Verification result, verify(replay, model, make_room, next_part("verifying")));
    json["verification"] = to_json(result);
    failed = complaint(result);
    if (!context.json && failed.empty())
      print(result.ticks == 0
                ? std::string("no whole tick, so there was nothing to check\n")
                : fmt::format("{} ticks, all the same bit for bit{}\n", result.ticks,
                              result.missing.empty() ? ""
                                                     : fmt::format("; not compared, because it was not recorded: {}",
                                                                   printable(joined(result.missing), 400))));
  }
  if (o.change) {
    RELIEF_TRY(const Comparison result, compare(replay, model, o.change, make_room, next_part("comparing")));
    ServoSettings changed = replay.settings().front();
    o.change(changed);
    json["other_settings"] = to_json(changed, replay.device());
    json["comparison"] = to_json(result);
    if (!context.json) say(result);
  }
  const Status ended = failed.empty() ? Status() : fail(Errc::Corrupt, printable(o.recording) + ": " + failed);
  add_error(json, ended);
  if (context.json) print_json(json);
  return ended;
}

}  // namespace

std::string missing_end(const Recording& recording) {
  const std::string name = printable(recording.file().string());
  const std::uint64_t ticks = recording.tick_count();
  if (recording.cut())
    return fmt::format("{}: its end is missing, the file was cut at {} of {} bytes; {} ticks are whole", name,
                       recording.cut()->bytes, recording.cut()->whole_bytes, ticks);
  if (recording.head().fact("end").empty())
    return fmt::format("{}: its end is missing, for the program that made it was ended; {} ticks are whole", name,
                       ticks);
  return {};
}

void add_replay(CLI::App& app, Context& context) {
  auto o = std::make_shared<ReplayOptions>();
  CLI::App* c = app.add_subcommand("replay", "Look into a recording, check it, or feel its motion with other settings");
  context.catalogue[c] = {
      .group = "Feel",
      .examples = {{"relief replay touch.rlog", "what it holds"},
                   {"relief replay touch.rlog --verify", "repeat every tick, compare bit for bit"},
                   {"relief replay touch.rlog --report touch.html", "a page with the worst ticks"},
                   {"relief replay touch.rlog --stiffness 800", "the same motion, a stiffer surface"}},
      .notes = "With a setting, the forces are compared with the recorded ones. The hand does not answer to them.\n"};
  c->add_option("REC", o->recording, "the recording (.rlog)")->required()->check(names_file);
  c->add_option("--model", o->model, "the model, where it has moved since and is not beside the recording")
      ->check(names_file)
      ->type_name("MODEL.relief");
  c->add_flag("--verify", o->verify, "repeat every tick and compare bit for bit; exit status 1 where one differs");
  c->add_option("--csv", o->csv, "write every tick as a line; the header has the units")
      ->check(names_file)
      ->type_name("FILE.csv");
  c->add_option("--mcap", o->mcap, "write an MCAP file of JSON messages (Foxglove, PlotJuggler, Rerun)")
      ->check(names_file)
      ->type_name("FILE.mcap");
  c->add_option("--report", o->report, "write a page with force, depth, work, times and the worst ticks")
      ->check(names_file)
      ->type_name("FILE.html");
  add_force_options(*c, o->force);
  c->add_option("--tool-radius", o->tool_radius, "a ball of this radius, model units; 0: a point")
      ->check(in_range(0, 1e300))
      ->type_name("R")
      ->group("Force");
  finish_command(*c, context, [o, &context] { return run_replay(*o, context); });
  c->parse_complete_callback([o, c] {
    const auto given = [c](const char* option) { return c->count(option) > 0; };
    const bool k = given("--stiffness"), b = given("--damping"), mu = given("--friction"),
               still = given("--static-friction"), most = given("--max-force"), ball = given("--tool-radius"),
               exact = given("--exact-normals"), paper = given("--paper-contact"), guard = names_guard(*c);
    if (paper && o->tool_radius > 0)
      throw CLI::ValidationError("--paper-contact is of a point: it goes without --tool-radius");
    if (!k && !b && !mu && !still && !most && !ball && !exact && !paper && !guard) return;
    o->change = [o, k, b, mu, still, most, ball, exact, paper, guard](ServoSettings& settings) {
      if (k) settings.force.stiffness = o->force.stiffness;
      if (b) settings.force.damping = o->force.damping;
      if (mu) settings.force.friction = o->force.friction;
      if (still) settings.force.static_friction = o->force.static_friction;
      if (most) settings.force.max_force = o->force.max_force;
      if (ball) settings.tool = {.radius = o->tool_radius};
      if (exact) settings.force.exact_normals = true;
      if (paper) settings.force.paper_contact = true;
      if (guard) settings.force.guard = o->force.guard;
    };
  });
}

}  // namespace relief::cli
