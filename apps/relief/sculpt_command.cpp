// sculpt: strokes from a file, one transaction each.
#include "commands.h"

#include <relief/base/cpu_time.h>
#include <relief/base/try.h>
#include <relief/file/model_file.h>

#include <fmt/format.h>

#include <memory>

namespace relief::cli {

namespace {

using nlohmann::ordered_json;

/// The stroke as the journal keeps it: the same form as in a strokes file.
std::string journal_text(const Stroke& stroke) {
  ordered_json json;
  json["tool"] = name(stroke.brush.tool);
  json["radius"] = stroke.brush.radius;
  json["strength"] = stroke.brush.strength;
  if (stroke.brush.resilience > 0) json["resilience"] = stroke.brush.resilience;
  const Vec3d rgb = to_double(stroke.brush.colour) * 255.0;
  if (stroke.brush.tool == Tool::Paint) json["colour"] = {rgb.x, rgb.y, rgb.z};
  json["points"] = ordered_json::array();
  for (const StrokePoint& p : stroke.points)
    json["points"].push_back({p.t, p.position.x, p.position.y, p.position.z, p.pressure});
  return json.dump();
}

Status run_sculpt(const std::string& model, const std::string& strokes_file, const std::string& out, bool force,
                  const Context& context) {
  RELIEF_CHECK(check_outputs({out}, {strokes_file}));
  RELIEF_TRY(const std::vector<Stroke> strokes, read_strokes(strokes_file));
  std::error_code ignored;
  if (!std::filesystem::equivalent(model, out, ignored)) {
    RELIEF_CHECK(check_strokes(out, force));
    RELIEF_CHECK(ModelFile::copy(model, out, context.progress));
  }
  RELIEF_TRY(ModelFile file, open_model(out, context, false));
  Editor editor(file.model().head);
  ordered_json report = ordered_json::array();
  for (std::size_t k = 0; k < strokes.size(); ++k) {
    if (context.progress.cancelled())
      return fail(Errc::Cancelled, fmt::format("{}: cancelled after {} of {} strokes, which are saved", printable(out),
                                               k, strokes.size()));
    context.progress("sculpt", static_cast<double>(k) / static_cast<double>(strokes.size()));
    const double start = thread_cpu_seconds();
    const bool changed = play(editor, strokes[k]);
    const double seconds = thread_cpu_seconds() - start;
    std::uint64_t tiles = 0;
    if (changed) {
      for_each_change(*file.model().head, *editor.head(), [&](Layer, SlabId) { ++tiles; });
      StrokeRecord record;
      record.label = strokes[k].label.empty() ? std::string(name(strokes[k].brush.tool)) : strokes[k].label;
      record.details = journal_text(strokes[k]);
      RELIEF_CHECK(file.commit(editor.head(), record));
    }
    report.push_back(
        {{"tool", name(strokes[k].brush.tool)}, {"changed", changed}, {"tiles", tiles}, {"seconds", seconds}});
  }
  if (context.json) {
    ordered_json json;
    json["strokes"] = report;
    json["total"] = file.stroke_count();
    print_json(json);
  } else {
    std::size_t changed = 0;
    for (const auto& r : report) changed += r["changed"].get<bool>() ? 1U : 0U;
    print(fmt::format("{}: {} of {} strokes changed the model; {} in all\n", out, changed, strokes.size(),
                      file.stroke_count()));
  }
  return {};
}

}  // namespace

void add_sculpt(CLI::App& app, Context& context) {
  struct Options {
    std::string model, strokes, out;
    bool force = false;
  };
  auto o = std::make_shared<Options>();
  CLI::App* c = app.add_subcommand(
      "sculpt",
      "Play strokes on a model. OUT holds every finished stroke at every moment; it may be MODEL.\n"
      "S.json: [{\"tool\": \"carve\", \"radius\": r, \"strength\": s, \"colour\": [r, g, b], \"points\": [[t, x, y, z, "
      "pressure], "
      "...]}, ...]\n"
      "Lengths in model units, t in seconds, strength and pressure 0..1, colour 0..255; tools carve, deposit, paint.");
  c->add_option("MODEL", o->model, "The model")->required()->check(names_file);
  c->add_option("--strokes", o->strokes, "S.json: the strokes")->required()->check(names_file);
  c->add_option("-o,--output", o->out, "The model with the strokes")->required()->check(names_file);
  c->add_flag("--force", o->force, "Replace another model that has strokes, or a file that is no model");
  finish_command(*c, context, [o, &context] { return run_sculpt(o->model, o->strokes, o->out, o->force, context); });
}

}  // namespace relief::cli
