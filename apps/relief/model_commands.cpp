// convert, verify, info, undo, redo: what is done with a model as a whole.
#include "commands.h"

#include <relief/base/cpu_time.h>
#include <relief/base/try.h>
#include <relief/convert/convert.h>
#include <relief/file/model_file.h>
#include <relief/mesh/export.h>
#include <relief/mesh/import.h>
#include <relief/verify/verify.h>

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <memory>
#include <optional>

namespace relief::cli {

namespace {

using nlohmann::ordered_json;

std::size_t distinct_samples(const SlabMesh& mesh) {
  std::size_t count = mesh.fibres().size();
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    const auto n = static_cast<std::size_t>(mesh.intervals(s));
    count += n * n >= 3 * n ? (n - 1) * (n - 2) / 2 : 0;
    for (const SlabId other : mesh.slabs()[s].neighbours)
      if (other == kNoSlab || other > s) count += n - 1;
  }
  return count;
}

verify::Certificate certificate_of(const SlabMesh& mesh) {
  std::vector<std::array<double, 3>> inner, outer;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (const Fibre& f : mesh.fibres()) {
    inner.push_back({f.inner.x, f.inner.y, f.inner.z});
    outer.push_back({f.outer.x, f.outer.y, f.outer.z});
  }
  for (const Slab& s : mesh.slabs()) triangles.push_back(s.fibres);
  return verify::check({inner, outer, triangles});
}

/// What the model's mode claims: preview C0, C1 and the triangles of C3; the other modes all five.
bool claim_holds(Mode mode, const verify::Certificate& c) {
  return mode == Mode::Preview ? c.holds[0] && c.holds[1] && c.holds[3] : c.all();
}

ordered_json to_json(const verify::Certificate& certificate) {
  ordered_json object;
  for (std::size_t k = 0; k < certificate.holds.size(); ++k)
    object[std::string(verify::name(static_cast<verify::Condition>(k)))] = {{"holds", certificate.holds[k]},
                                                                            {"failures", certificate.failure_count[k]}};
  return object;
}

struct ConvertOptions {
  std::string in, out, mended, mode, unit;
  ConvertSettings settings;
  bool force = false;
};

/// Refuses a model whose strokes would be lost.
Status check_strokes(const ConvertOptions& o) {
  std::error_code ignored;
  if (o.force || !std::filesystem::exists(o.out, ignored)) return {};
  const auto existing = ModelFile::open(o.out, true);
  if (existing && existing->stroke_count() + existing->redo_count() > 0)
    return fail(Errc::InvalidArgument,
                fmt::format("{}: holds {} strokes that would be lost; choose another name, or --force",
                            printable(o.out), existing->stroke_count() + existing->redo_count()));
  return {};
}

/// The mended source under a name of its own until the model stands, so that a run that fails leaves neither.
class MendedFile {
 public:
  Status write(const TriangleMesh& mesh, const std::filesystem::path& target, Unit unit) {
    target_ = target;
    temporary_ = target;
    temporary_ += fmt::format(".{}.part.ply", getpid());
    return export_mesh(mesh, temporary_, {.unit = unit, .double_positions = true});
  }
  Status keep() {
    if (temporary_.empty()) return {};
    std::error_code error;
    std::filesystem::rename(temporary_, target_, error);
    if (error) return fail(Errc::Io, printable(target_.string()) + ": cannot be replaced: " + error.message());
    temporary_.clear();
    return {};
  }
  MendedFile() = default;
  MendedFile(const MendedFile&) = delete;
  MendedFile& operator=(const MendedFile&) = delete;
  ~MendedFile() {
    std::error_code ignored;
    if (!temporary_.empty()) std::filesystem::remove(temporary_, ignored);
  }

 private:
  std::filesystem::path target_, temporary_;
};

ordered_json to_json(const Conversion& made, const verify::Certificate& certificate, double seconds) {
  const ConvertReport& r = made.report;
  ordered_json json;
  json["mode"] = name(made.model.info.mode);
  json["slabs"] = r.slabs;
  json["seconds"] = seconds;
  json["hits"] = {{"single", r.hits_single}, {"none", r.hits_none}, {"several", r.hits_several}};
  json["samples"] = r.fibres_cast;
  json["source_triangles"] = r.source_triangles;
  json["certificate"] = to_json(certificate);
  json["distance"] = {{"rms", r.distance_rms}, {"max", r.distance_max}};
  if (!r.not_certified.empty()) json["not_certified"] = r.not_certified;
  json["moved"] = {{"vertices", r.moved_vertices}, {"most", r.moved_most}};
  json["thickness"] = {{"min", r.thickness_min}, {"median", r.thickness_median}};
  const RepairReport& f = r.repair;
  json["repair"] = {{"welded_vertices", f.welded_vertices},
                    {"unused_vertices", f.unused_vertices},
                    {"degenerate_triangles", f.degenerate_triangles},
                    {"duplicate_triangles", f.duplicate_triangles},
                    {"nonfinite_triangles", f.nonfinite_triangles},
                    {"turned_triangles", f.turned_triangles},
                    {"turned_parts", f.turned_parts},
                    {"split_edges", f.split_edges},
                    {"split_vertices", f.split_vertices},
                    {"cut_seams", f.cut_seams},
                    {"parts", f.parts},
                    {"boundary_loops", f.boundary_loops}};
  for (const auto& phase : r.phases) json["phases"][phase.name] = phase.seconds;
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  json["peak_mib"] = static_cast<double>(usage.ru_maxrss) / 1024.0;
  return json;
}

Status run_convert(ConvertOptions& o, const Context& context) {
  const double start = process_cpu_seconds();
  if (o.mode == "tolerant")
    return fail(Errc::Unfoldable,
                fmt::format("{}: this version makes no {} shells; convert without --mode, or with --mode preview",
                            printable(o.in), o.mode));
  o.settings.mode = mode_from_name(o.mode);
  RELIEF_CHECK(check_outputs({o.out, o.mended}, {o.in}));
  if (!o.mended.empty() && std::filesystem::weakly_canonical(o.out) == std::filesystem::weakly_canonical(o.mended))
    return fail(Errc::InvalidArgument,
                printable(o.out) + ": is both the model and the mended source; choose two names");
  RELIEF_CHECK(check_strokes(o));
  context.progress("import", 0);
  RELIEF_TRY(const TriangleMesh source, import_mesh(o.in));
  o.settings.unit = o.unit.empty() ? source.unit.value_or(Unit::Millimetre) : *unit_from_name(o.unit);
  auto converted = convert(source, o.settings, context.progress);
  // The library does not know the file's name, the user's sentence needs it.
  if (!converted) return fail(converted.error().code, printable(o.in) + ": " + converted.error().message);
  Conversion& made = *converted;
  made.model.info.source = std::filesystem::path(o.in).filename().string();
  const verify::Certificate certificate = certificate_of(made.model.head->slab_mesh());
  if (!claim_holds(made.model.info.mode, certificate)) {
    const std::string what = certificate.failures.empty() ? "no reason given" : certificate.failures.front().what;
    return fail(Errc::Unfoldable,
                fmt::format("{}: the shell failed its check ({}); try more --slabs or a smaller --thickness",
                            printable(o.in), what));
  }
  MendedFile mended;
  if (!o.mended.empty()) RELIEF_CHECK(mended.write(made.mended, o.mended, o.settings.unit));
  context.progress("save", 0.99);
  RELIEF_TRY(const ModelFile saved, ModelFile::create(o.out, made.model));
  RELIEF_CHECK(mended.keep());
  const double seconds = process_cpu_seconds() - start;
  if (context.json)
    print_json(to_json(made, certificate, seconds));
  else
    print(fmt::format("{}{}: {} slabs, {} mode, {:.2f} CPU s\n", to_string(made.report), o.out, made.report.slabs,
                      name(made.model.info.mode), seconds));
  return {};
}

Status run_verify(const std::string& file, const Context& context) {
  // Opening checks the tiles: sizes, ranges, copies of shared samples.
  RELIEF_TRY(const ModelFile model, ModelFile::open(file, true));
  const Mode mode = model.model().info.mode;
  const verify::Certificate certificate = certificate_of(model.model().head->slab_mesh());
  const bool holds = claim_holds(mode, certificate);
  if (context.json) {
    ordered_json json;
    json["mode"] = name(mode);
    json["holds"] = holds;
    json["slabs"] = model.model().head->slab_mesh().slab_count();
    json["certificate"] = to_json(certificate);
    json["tiles"] = true;
    json["failures"] = ordered_json::array();
    for (const auto& f : certificate.failures)
      json["failures"].push_back({{"condition", verify::name(f.condition)}, {"a", f.a}, {"b", f.b}, {"what", f.what}});
    print_json(json);
  } else {
    for (std::size_t k = 0; k < certificate.holds.size(); ++k)
      print(fmt::format("{} {}\n", verify::name(static_cast<verify::Condition>(k)),
                        certificate.holds[k] ? "holds" : fmt::format("fails {} times", certificate.failure_count[k])));
    for (const auto& f : certificate.failures) print(fmt::format("  {}: {}\n", verify::name(f.condition), f.what));
    print(fmt::format("tiles hold\n{}: all that {} mode claims {}\n", file, name(mode),
                      holds ? "holds" : "does not hold"));
  }
  if (!holds)
    return fail(Errc::Corrupt, fmt::format("{}: the shell does not hold what {} mode claims ({}); convert it again",
                                           printable(file), name(mode), certificate.failures.front().what));
  return {};
}

Status run_info(const std::string& file, bool list_strokes, const Context& context) {
  RELIEF_TRY(const ModelFile model, ModelFile::open(file, true));
  const ModelInfo& info = model.model().info;
  const Snapshot& head = *model.model().head;
  const SlabMesh& mesh = head.slab_mesh();
  std::vector<StrokeRecord> strokes;
  if (list_strokes) {
    RELIEF_TRY(strokes, model.strokes());
  }
  int n_min = kMaxIntervals, n_max = 1;
  for (const Slab& s : mesh.slabs()) {
    n_min = std::min(n_min, s.intervals);
    n_max = std::max(n_max, s.intervals);
  }
  std::vector<std::string> layers;
  for (int k = 0; k < kLayerCount; ++k)
    if (head.has(static_cast<Layer>(k))) layers.emplace_back(name(static_cast<Layer>(k)));
  if (context.json) {
    ordered_json json;
    json["mode"] = name(info.mode);
    json["slabs"] = mesh.slab_count();
    json["fibres"] = mesh.fibres().size();
    json["samples"] = distinct_samples(mesh);
    json["intervals"] = {{"min", n_min}, {"max", n_max}};
    json["strokes"] = model.stroke_count();
    json["redo"] = model.redo_count();
    json["layers"] = layers;
    if (head.has(Layer::Colour)) json["colour_intervals"] = head.tile(Layer::Colour, 0).intervals();
    json["unit"] = name(info.unit);
    json["source"] = info.source;
    json["source_diagonal"] = info.source_diagonal;
    const Box3d box = mesh.bounds();
    json["bounds"] = {{box.low.x, box.low.y, box.low.z}, {box.high.x, box.high.y, box.high.z}};
    json["tile_bytes"] = head.bytes();
    json["content_hash"] = fmt::format("{:016x}", head.content_hash());
    if (list_strokes) {
      json["journal"] = ordered_json::array();
      for (const StrokeRecord& s : strokes)
        json["journal"].push_back({{"number", s.number}, {"label", s.label}, {"tiles", s.tiles}});
    }
    print_json(json);
    return {};
  }
  std::string layer_text;
  for (const std::string& layer : layers) layer_text += (layer_text.empty() ? "" : ", ") + layer;
  print(fmt::format(
      "mode     {}\nsource   {} ({}, diagonal {:.6g})\nslabs    {} of n = {}\nsamples  {} distinct, {:.1f} MiB of "
      "tiles\nlayers   {}\nstrokes  {}{}\n",
      name(info.mode), printable(info.source), name(info.unit), info.source_diagonal, mesh.slab_count(),
      n_min == n_max ? std::to_string(n_min) : fmt::format("{} to {}", n_min, n_max), distinct_samples(mesh),
      static_cast<double>(head.bytes()) / (1 << 20), layer_text, model.stroke_count(),
      model.redo_count() > 0 ? fmt::format(" ({} undone)", model.redo_count()) : ""));
  for (const StrokeRecord& s : strokes)
    print(fmt::format("  {:4d}  {} ({} tiles)\n", s.number, printable(s.label), s.tiles));
  return {};
}

Status run_undo(const std::string& file, std::uint64_t strokes, bool forward, const Context& context) {
  RELIEF_TRY(ModelFile model, ModelFile::open(file));
  RELIEF_TRY(const std::uint64_t moved, forward ? model.redo(strokes) : model.undo(strokes));
  if (moved == 0)
    return fail(Errc::NotFound,
                fmt::format("{}: there is no stroke to {}", printable(file), forward ? "redo" : "undo"));
  if (context.json) {
    ordered_json json;
    json["moved"] = moved;
    json["strokes"] = model.stroke_count();
    json["redo"] = model.redo_count();
    print_json(json);
  } else {
    print(fmt::format("{} {} stroke{}; {} stand, {} can be redone\n", forward ? "redid" : "undid", moved,
                      moved == 1 ? "" : "s", model.stroke_count(), model.redo_count()));
  }
  return {};
}

}  // namespace

void add_convert(CLI::App& app, Context& context) {
  auto o = std::make_shared<ConvertOptions>();
  CLI::App* c = app.add_subcommand("convert", "Make a model from a triangle mesh (PLY, OBJ, STL, OFF, glTF, GLB, 3MF)");
  c->add_option("IN", o->in, "The mesh")->required();
  c->add_option("-o,--output", o->out, "The model, MODEL.relief")->required();
  c->add_option("--slabs", o->settings.slabs, "Slabs to aim for (default 200)")->check(CLI::Range(4, 1'000'000));
  c->add_option("--samples", o->settings.intervals,
                "Intervals n per slab edge, 1 to 128 (default 32; the paper used 15)")
      ->check(CLI::Range(1, kMaxIntervals));
  c->add_option("--mode", o->mode,
                "certified: proven, or exit 1; preview; without it the best that can be proved (tolerant is not in "
                "this version)")
      ->check(CLI::IsMember({"certified", "tolerant", "preview"}));
  c->add_option("--thickness", o->settings.thickness, "Longest fibre, share of the diagonal (default 0.1)")
      ->check(in_range(1e-4, 1));
  c->add_option("--unit", o->unit,
                "What a model unit is: mm, cm or m, kept for 3MF and glTF (default: what the file says, else mm)")
      ->check(CLI::IsMember({"mm", "cm", "m"}));
  c->add_option("--mended", o->mended, "Also write the repaired source (PLY, double coordinates)");
  c->add_flag("--force", o->force, "Replace a model that has strokes");
  finish_command(*c, context, [o, &context] { return run_convert(*o, context); });
}

void add_verify(CLI::App& app, Context& context) {
  auto file = std::make_shared<std::string>();
  CLI::App* c = app.add_subcommand("verify", "Check a model with the independent verifier");
  c->add_option("MODEL", *file, "The model")->required();
  finish_command(*c, context, [file, &context] { return run_verify(*file, context); });
}

void add_info(CLI::App& app, Context& context) {
  auto file = std::make_shared<std::string>();
  auto strokes = std::make_shared<bool>(false);
  CLI::App* c = app.add_subcommand("info", "Say what a model holds");
  c->add_option("MODEL", *file, "The model")->required();
  c->add_flag("--strokes", *strokes, "List the journal of strokes");
  finish_command(*c, context, [file, strokes, &context] { return run_info(*file, *strokes, context); });
}

void add_undo(CLI::App& app, Context& context) {
  for (const bool forward : {false, true}) {
    auto file = std::make_shared<std::string>();
    auto strokes = std::make_shared<std::uint64_t>(1);
    CLI::App* c =
        app.add_subcommand(forward ? "redo" : "undo", forward ? "Bring undone strokes back" : "Take strokes back");
    c->add_option("MODEL", *file, "The model, changed in place")->required();
    c->add_option("--strokes", *strokes, "How many (default 1)")->check(CLI::Range(1, 1'000'000'000));
    finish_command(*c, context, [=, &context] { return run_undo(*file, *strokes, forward, context); });
  }
}

}  // namespace relief::cli
