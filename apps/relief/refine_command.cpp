// refine: finer grids and new slabs for a model that was sculpted.
#include "commands.h"

#include <relief/base/cpu_time.h>
#include <relief/base/try.h>
#include <relief/convert/refine.h>
#include <relief/file/model_file.h>

#include <fmt/format.h>

#include <memory>
#include <utility>

namespace relief::cli {

namespace {

using nlohmann::ordered_json;

struct RefineOptions {
  std::string model, out, where = "saturated";
  bool force = false;
};

std::size_t samples_of(const Snapshot& model) {
  std::size_t count = 0;
  for (SlabId s = 0; s < model.slab_mesh().slab_count(); ++s) count += sample_count(model.slab_mesh().intervals(s));
  return count;
}

ordered_json json_of(const Refined& refined, const Snapshot& before, const Snapshot& after, double seconds) {
  ordered_json json;
  json["changed"] = refined.model.head != nullptr;
  json["slabs"] = {{"before", before.slab_mesh().slab_count()}, {"after", after.slab_mesh().slab_count()}};
  json["samples"] = {{"before", samples_of(before)}, {"after", samples_of(after)}};
  json["saturated"] = {{"before", refined.saturated_before}, {"after", refined.saturated_after}};
  json["fibres"] = {{"moved", refined.fibres_moved}, {"lacking", refined.fibres_lacking}};
  json["leaning"] = {{"slabs", refined.slabs_leaning}, {"finer", refined.slabs_finer}};
  json["surface_moved"] = {{"rms", refined.moved_rms}, {"max", refined.moved_max}};
  json["seconds"] = seconds;
  return json;
}

/// What was done, in one sentence or two.
std::string verdict_of(RefineWhere where, const Refined& refined, const Snapshot& before, const Snapshot& after) {
  std::string text;
  switch (where) {
    case RefineWhere::Saturated:
      if (refined.saturated_before == 0 && refined.slabs_leaning == 0)
        return "Nothing to do: tools have brought no sample to the end of its fibre";
      if (!refined.model.head && refined.saturated_before == 0)
        return fmt::format("Nothing to do: fibres lean in {} slabs, whose grids are fine enough",
                           refined.slabs_leaning);
      if (!refined.model.head)
        return fmt::format(
            "Nothing changed: {} samples stand at the end of their fibres, and none can be made longer "
            "there; --where model makes new slabs",
            refined.saturated_before);
      if (refined.fibres_moved > 0)
        text = fmt::format("Room made: {} fibres reach further; {} of {} samples still stand at the end of theirs",
                           refined.fibres_moved, refined.saturated_after, refined.saturated_before);
      else if (refined.saturated_before > 0)
        text = fmt::format("{} samples stand at the end of their fibres, and none can be made longer there",
                           refined.saturated_before);
      if (refined.slabs_leaning > 0)
        text += fmt::format("{}Fibres lean in {} slabs: {} got finer grids", text.empty() ? "" : ". ",
                            refined.slabs_leaning, refined.slabs_finer);
      break;
    case RefineWhere::All:
      text = fmt::format("Twice the samples along every edge: {} where there were {}", samples_of(after),
                         samples_of(before));
      break;
    case RefineWhere::Model:
      if (!refined.model.head) return "Nothing to do: no stroke has changed the model since its slabs were made";
      text = fmt::format("New slabs: {} where there were {}", after.slab_mesh().slab_count(),
                         before.slab_mesh().slab_count());
      break;
  }
  return text + fmt::format(". The surface moved by {:.3g} at most, {:.2g} rms", refined.moved_max, refined.moved_rms);
}

Status run_refine(const RefineOptions& o, const Context& context) {
  const RefineWhere where = *refine_where_from_name(o.where);
  RELIEF_CHECK(check_outputs({o.out}, {}));
  check_model_name(o.out, o.model);
  std::error_code ignored;
  const bool in_place = std::filesystem::equivalent(o.model, o.out, ignored);
  RELIEF_TRY(std::optional<ModelFile> read, open_model(o.model, context));
  if (!in_place) RELIEF_CHECK(check_strokes(o.out, o.force, context.progress));
  const Model model = read->model();
  const double start = process_cpu_seconds();
  RELIEF_TRY(const SnapshotPtr as_made, read->as_made(read->stroke_count(), context.progress));
  RELIEF_TRY(const Refined refined, refine(model, where, as_made, context.progress));
  read.reset();
  const double seconds = process_cpu_seconds() - start;
  if (!in_place) RELIEF_CHECK(ModelFile::copy(o.model, o.out, context.progress));
  if (refined.model.head) {
    RELIEF_TRY(ModelFile file, open_model(o.out, context, false));
    RELIEF_CHECK(file.commit(refined.model.head, {.label = "refine " + o.where}, context.progress));
  }
  const Snapshot& after = refined.model.head ? *refined.model.head : *model.head;
  if (context.json) {
    print_json(json_of(refined, *model.head, after, seconds));
    return {};
  }
  print(printable(o.out) + ": " + verdict_of(where, refined, *model.head, after) + "\n");
  return {};
}

}  // namespace

void add_refine(CLI::App& app, Context& context) {
  auto o = std::make_shared<RefineOptions>();
  CLI::App* c = app.add_subcommand("refine", "Make room and finer grids for sculpting");
  context.catalogue[c] = {.group = "Make",
                          .examples = {{"relief refine carved.relief -o roomy.relief", "room where the clay ran out"},
                                       {"relief refine carved.relief -o fine.relief --where all"},
                                       {"relief refine carved.relief -o new.relief --where model"}}};
  c->add_option("MODEL", o->model, "the model")->required()->check(names_file);
  c->add_option("-o,--output", o->out, "the refined model; may be MODEL")
      ->required()
      ->check(names_file)
      ->type_name("OUT.relief");
  c->add_option("--where", o->where,
                "saturated: longer fibres where room has run out; all: twice the samples per edge; model: new slabs")
      ->check(one_of({"saturated", "all", "model"}))
      ->type_name("WHERE")
      ->default_str("saturated");
  c->add_flag("--force", o->force, "replace OUT where it has strokes of its own");
  finish_command(*c, context, [=, &context] { return run_refine(*o, context); });
}

}  // namespace relief::cli
