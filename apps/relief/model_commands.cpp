// convert, verify, info, undo, redo: what is done with a model as a whole.
#include "commands.h"

#include <relief/base/atomic_file.h>
#include <relief/base/cpu_time.h>
#include <relief/base/try.h>
#include <relief/convert/convert.h>
#include <relief/core/plain_cage.h>
#include <relief/file/model_file.h>
#include <relief/mesh/export.h>
#include <relief/mesh/import.h>
#include <relief/verify/verify.h>

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <memory>
#include <numeric>
#include <optional>
#include <tuple>

namespace relief::cli {

namespace {

using nlohmann::ordered_json;

/// Shared samples once, those that follow from them not at all.
std::size_t distinct_samples(const SlabMesh& mesh) {
  std::size_t count = mesh.fibres().size();
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    const auto n = static_cast<std::size_t>(mesh.intervals(s));
    count += (n - 1) * (n - 2) / 2;
    for (int edge = 0; edge < 3; ++edge)
      if (const SlabId other = mesh.slabs()[s].neighbours[static_cast<std::size_t>(edge)];
          other == kNoSlab || other > s)
        count += static_cast<std::size_t>(mesh.edge_intervals(s, edge)) - 1;
  }
  return count;
}

using Corners = std::array<std::uint32_t, 3>;
verify::Shell view(const PlainCage& cage) { return {cage.inner, cage.outer, cage.triangles}; }

/// A source as the verifier reads it. Vertices at the same place are one, for formats that repeat them.
struct PlainSource {
  std::vector<Vec3d> positions;
  std::vector<Corners> triangles;
  std::optional<std::size_t> phantom_from;

  explicit PlainSource(TriangleMesh&& mesh)
      : positions(std::move(mesh.positions)), triangles(std::move(mesh.triangles)), phantom_from(mesh.phantom_from) {
    mesh = {};  // colours and images
    const auto place = [&](std::uint32_t v) { return std::tie(positions[v].x, positions[v].y, positions[v].z); };
    std::vector<std::uint32_t> order, number(positions.size());
    order.reserve(positions.size());
    for (std::uint32_t v = 0; v < positions.size(); ++v)
      if (is_finite(positions[v])) order.push_back(v);
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
      return std::tuple_cat(place(a), std::tie(a)) < std::tuple_cat(place(b), std::tie(b));
    });
    std::iota(number.begin(), number.end(), 0U);
    for (std::size_t k = 1; k < order.size(); ++k)
      if (positions[order[k]] == positions[order[k - 1]]) number[order[k]] = number[order[k - 1]];
    for (Corners& t : triangles)
      for (std::uint32_t& v : t)
        if (v < number.size()) v = number[v];
  }
  [[nodiscard]] verify::Source view() const {
    return {
        {positions.empty() ? nullptr : &positions.front().x, positions.size(), sizeof(Vec3d)}, triangles, phantom_from};
  }
};

/// What the verifier proves of a model; a certified or tolerant one is held against its mended source.
verify::Certificate certificate_of(const Model& model, TriangleMesh mended, const Progress& progress) {
  const PlainCage shell(model.head->slab_mesh());
  if (model.info.mode == Mode::Preview) return verify::check(view(shell), progress);
  const PlainSource source(std::move(mended));
  return verify::check(view(shell), source.view(), progress);
}

/// What the verifier finds in the tiles that lie on each slab's own grid; nothing where C0 fails, or when cancelled.
struct TileFaults {
  std::string first;                 ///< a sentence; empty where all hold
  std::vector<std::uint32_t> slabs;  ///< of the same layer, all that fail
};
TileFaults faults_of_tiles(const Snapshot& head, const verify::Certificate& certificate, const Progress& progress) {
  if (!certificate.holds[0] || progress.cancelled()) return {};
  const PlainCage shell(head.slab_mesh());
  for (const auto& [layer, between] :
       {std::pair{Layer::Displacement, verify::Between::Linear}, std::pair{Layer::Void, verify::Between::Nearer},
        std::pair{Layer::Folded, verify::Between::Nearer}}) {
    if (!head.has(layer)) continue;
    std::vector<verify::SampleTile> tiles;
    tiles.reserve(head.slab_mesh().slab_count());
    for (SlabId s = 0; s < head.slab_mesh().slab_count(); ++s) {
      const Tile& tile = head.tile(layer, s);
      tiles.push_back({tile.intervals(), {tile.plane(), tile.size()}});
      tile.rest();
    }
    const verify::TileCheck found =
        verify::check_tiles(view(shell), tiles, between, [&](SlabId s) { head.tile(layer, s).rest(); });
    if (found.failure_count > 0)
      return {fmt::format("the tiles of {}: {}", name(layer), found.failures.front().what), found.slabs};
  }
  return {};
}

bool claims(Mode mode, verify::Condition condition) { return relief::claims(mode).contains(verify::name(condition)); }
bool claim_holds(Mode mode, const verify::Certificate& c) {
  for (std::size_t k = 0; k < c.asked(); ++k)
    if (claims(mode, static_cast<verify::Condition>(k)) && !c.holds[k]) return false;
  return true;
}
/// The first sentence about something that the mode claims.
std::string first_reason(Mode mode, const verify::Certificate& c) {
  for (const verify::Failure& f : c.failures)
    if (claims(mode, f.condition)) return f.what;
  for (std::size_t k = 0; k < c.asked(); ++k)
    if (const auto condition = static_cast<verify::Condition>(k); claims(mode, condition) && !c.holds[k])
      return std::string(verify::name(condition)) + " could not be tested";
  return "no reason given";
}

/// How a condition fared; where it failed, `at_least` so often, and on request in which slabs.
ordered_json to_json(const verify::Certificate& certificate, bool name_slabs = false) {
  ordered_json object;
  for (std::size_t k = 0; k < certificate.asked(); ++k) {
    const auto condition = static_cast<verify::Condition>(k);
    ordered_json& of_one = object[std::string(verify::name(condition))];
    of_one = {{"holds", certificate.holds[k]}, {"failures", certificate.failure_count[k]}};
    if (certificate.at_least[k]) of_one["at_least"] = true;
    if (name_slabs) of_one["slabs"] = certificate.failing(condition);
  }
  return object;
}

struct ConvertOptions {
  std::string in, out, mended, mode, unit, remesh;
  ConvertSettings settings;
  bool force = false;
};

/// The mended source under a name of its own until the model stands, so that a run that fails leaves neither.
class MendedFile {
 public:
  Status write(const TriangleMesh& mesh, const std::filesystem::path& target, Unit unit) {
    target_ = behind_links(target);
    temporary_ = target_;
    temporary_ += fmt::format(".{}.part.ply", getpid());
    Status written = export_mesh(mesh, temporary_, {.unit = unit, .double_positions = true});
    if (!written) {  // the name that the user gave
      std::string& message = written.error().message;
      const std::string own = printable(temporary_.string());
      if (const std::size_t at = message.find(own); at != std::string::npos)
        message.replace(at, own.size(), printable(target.string()));
    }
    return written;
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

ordered_json to_json(const Conversion& made, const verify::Certificate& certificate,
                     const std::vector<std::string>& notes, double seconds, double wall_seconds) {
  const ConvertReport& r = made.report;
  ordered_json json;
  json["mode"] = name(made.model.info.mode);
  json["slabs"] = r.slabs;
  json["slabs_asked"] = r.slabs_asked;
  json["seconds"] = seconds;
  json["wall_seconds"] = wall_seconds;
  json["hits"] = {{"single", r.hits_single}, {"none", r.hits_none}, {"several", r.hits_several}};
  json["fibres"] = r.fibres_cast;
  json["samples"] = distinct_samples(made.model.head->slab_mesh());
  json["source_triangles"] = r.source_triangles;
  json["certificate"] = to_json(certificate);
  const SlabMesh& mesh = made.model.head->slab_mesh();
  const auto [least, most] = std::ranges::minmax(mesh.slabs(), {}, &Slab::intervals);
  json["intervals"] = {{"min", least.intervals}, {"max", most.intervals}};
  json["error"] = r.error > 0 ? ordered_json(r.error) : ordered_json();
  json["slabs_too_coarse"] = r.slabs_too_coarse;
  json["too_coarse_most"] = r.too_coarse_most;
  // The first two are those to the mended source.
  const auto distance = [](Distance d) { return ordered_json{{"rms", d.rms}, {"max", d.max}, {"points", d.points}}; };
  json["distance"] = distance(r.to_mended);
  json["distance"]["to_mended"] = distance(r.to_mended);
  json["distance"]["from_mended"] = distance(r.from_mended);
  json["distance"]["to_source"] = distance(r.to_source);
  json["distance"]["from_source"] = distance(r.from_source);
  if (!r.not_certified.empty()) json["not_certified"] = r.not_certified;
  json["parts"] = {{"count", r.parts.count}, {"certified", r.parts.certified}};
  for (const auto& part : r.parts.obstacles)
    json["parts"]["obstacles"].push_back({{"part", part.part},
                                          {"triangles", part.triangles},
                                          {"near", {part.near.x, part.near.y, part.near.z}},
                                          {"reason", part.reason}});
  if (r.remesh)
    json["remesh"] = {{"voxel", r.remesh->voxel}, {"sheets", r.remesh->sheets}, {"crumbs", r.remesh->crumbs}};
  json["mended"] = {{"moved_vertices", r.moved_vertices},   {"moved_most", r.moved_most},
                    {"parted_vertices", r.parted_vertices}, {"replaced_triangles", r.replaced_triangles},
                    {"vanished_parts", r.vanished_parts},   {"specks", r.specks},
                    {"dropped_parts", r.dropped_parts},     {"dropped_slabs", r.dropped_slabs},
                    {"closed_openings", r.closed_openings}, {"phantom_triangles", r.phantom_triangles}};
  if (r.replaced_triangles > 0) {
    json["mended"]["replaced_widest"] = r.replaced_widest;
    json["mended"]["replaced_near"] = {r.replaced_near.x, r.replaced_near.y, r.replaced_near.z};
  }
  json["thickness"] = {{"min", r.thickness_min}, {"median", r.thickness_median}};
  const RepairReport& f = r.repair;
  json["repair"] = {{"welded_vertices", f.welded_vertices},
                    {"sewn_vertices", f.sewn_vertices},
                    {"sewn_most", f.sewn_most},
                    {"unused_vertices", f.unused_vertices},
                    {"degenerate_triangles", f.degenerate_triangles},
                    {"flipped_triangles", f.flipped_triangles},
                    {"duplicate_triangles", f.duplicate_triangles},
                    {"nonfinite_triangles", f.nonfinite_triangles},
                    {"turned_triangles", f.turned_triangles},
                    {"turned_parts", f.turned_parts},
                    {"split_edges", f.split_edges},
                    {"split_vertices", f.split_vertices},
                    {"cut_seams", f.cut_seams},
                    {"parts", f.parts},
                    {"boundary_loops", f.boundary_loops},
                    {"corners_on_edges", f.corners_on_edges}};
  json["notes"] = notes;
  for (const std::string& note : r.notes) json["notes"].push_back(note);
  // A source that was tried again has some of them twice.
  json["phases"] = json["phases_wall"] = ordered_json::object();
  for (const auto& phase : r.phases) {
    json["phases"][phase.name] = json["phases"].value(phase.name, 0.0) + phase.seconds;
    json["phases_wall"][phase.name] = json["phases_wall"].value(phase.name, 0.0) + phase.wall_seconds;
  }
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  json["peak_mib"] = static_cast<double>(usage.ru_maxrss) / 1024.0;
  return json;
}

/// What a conversion may take at its peak.
std::size_t memory_limit(const TriangleMesh& source) { return (std::size_t{64} << 20) + 300 * source.triangles.size(); }

Status run_convert(ConvertOptions& o, const Context& context) {
  const Stopwatch whole;
  o.settings.mode = mode_from_name(o.mode);
  if (!o.remesh.empty()) o.settings.remesh = o.remesh == "auto" ? 0.0 : std::stod(o.remesh);
  RELIEF_CHECK(check_outputs({o.out, o.mended}, {o.in}));
  RELIEF_CHECK(check_no_model({o.mended}));
  RELIEF_CHECK(check_strokes(o.out, o.force));
  std::optional<NothingWritten> nothing_written(std::in_place);
  context.progress("import", 0);
  MendedFile mended;
  Conversion made;
  verify::Certificate certificate;
  TileFaults tiles;
  std::vector<std::string> notes;  // of the import
  std::vector<ConvertReport::Phase> phases;
  Stopwatch watch;
  const auto phase_done = [&](const char* name) {
    phases.push_back({name, watch.cpu(), watch.wall()});
    watch = {};
  };
  const auto convert_and_verify = [&]() -> Status {
    made = {};
    RELIEF_TRY(TriangleMesh source, import_mesh(o.in));
    phase_done("import");
    if (context.progress.cancelled()) return fail(Errc::Cancelled, "conversion was cancelled.");
    o.settings.unit =
        o.unit.empty() ? source.unit.value_or(Unit::Millimetre) : unit_from_name(o.unit).value_or(Unit::Millimetre);
    o.settings.sample_memory = memory_limit(source) / 6;
    notes = std::move(source.notes);
    auto converted = convert(std::move(source), o.settings, context.progress);
    // The library does not know the file's name, the user's sentence needs it.
    if (!converted) return fail(converted.error().code, printable(o.in) + ": " + converted.error().message);
    made = std::move(*converted);
    phases.insert(phases.end(), made.report.phases.begin(), made.report.phases.end());
    watch = {};
    // The mended source is on the disk, or was not asked for, when the verifier takes it.
    if (!o.mended.empty()) {
      nothing_written.reset();
      RELIEF_CHECK(mended.write(made.mended, o.mended, o.settings.unit));
      phase_done("mended");
    }
    certificate = certificate_of(made.model, std::move(made.mended), context.progress);
    tiles = faults_of_tiles(*made.model.head, certificate, context.progress);
    if (context.progress.cancelled()) return fail(Errc::Cancelled, "conversion was cancelled.");
    phase_done("verify");
    return {};
  };
  RELIEF_CHECK(convert_and_verify());
  if (made.model.info.mode == Mode::Certified && !claim_holds(Mode::Certified, certificate) && o.mode != "certified") {
    // The builder was wrong about its own work: what it made claims less, and says why.
    const std::string why = "the verifier refused the shell: " + first_reason(Mode::Certified, certificate);
    if (claim_holds(Mode::Tolerant, certificate) &&
        certificate.holds[static_cast<std::size_t>(verify::Condition::C5)]) {
      made.model.info.mode = Mode::Tolerant;
      made.report.parts.certified = 0;
    } else if (o.mode.empty()) {
      o.settings.mode = Mode::Preview;
      RELIEF_CHECK(convert_and_verify());
    }
    made.report.not_certified = why;
  }
  // What might have been given up was not.
  if (made.model.info.mode == Mode::Tolerant && claim_holds(Mode::Certified, certificate) &&
      made.report.hits_none == 0 && made.report.hits_several == 0) {
    made.model.info.mode = Mode::Certified;
    made.report.parts.certified = made.report.parts.count;
  }
  made.model.info.source = std::filesystem::path(o.in).filename().string();
  const Mode mode = made.model.info.mode;
  if (!claim_holds(mode, certificate))
    return fail(Errc::Unfoldable, fmt::format("{}: the verifier refused the slabs: {}; {}.", printable(o.in),
                                              first_reason(mode, certificate),
                                              remedy(o.settings.mode.value_or(mode), o.settings.remesh.has_value())));
  if (!tiles.first.empty())
    return fail(Errc::Unfoldable, fmt::format("{}: the verifier refused the samples: {}; this is a fault of Relief's, "
                                              "which other --samples may avoid.",
                                              printable(o.in), tiles.first));
  nothing_written.reset();
  RELIEF_TRY(const ModelFile saved, ModelFile::create(o.out, made.model, context.progress));
  RELIEF_CHECK(mended.keep());
  phase_done("save");
  made.report.phases = std::move(phases);
  const double seconds = whole.cpu();
  if (context.json) {
    print_json(to_json(made, certificate, notes, seconds, whole.wall()));
  } else {
    for (const std::string& note : notes) print(note + "\n");
    print(fmt::format("{}{}: {} slabs, {} mode, {:.2f} CPU s\n", to_string(made.report), o.out, made.report.slabs,
                      name(made.model.info.mode), seconds));
  }
  return {};
}

/// The share of the slabs' diagonal within which a sample must lie from where its fibre meets the source.
constexpr double kSampleTolerance = 1e-6;

/// Compares the samples of all slabs that no stroke has changed.
verify::SampleCheck compare_samples(const Snapshot& head, const Snapshot& first, const PlainCage& shell,
                                    const PlainSource& source, const Progress& progress) {
  constexpr std::array kJudged = {Layer::Displacement, Layer::Void, Layer::Folded};
  std::array<std::vector<verify::SampleTile>, kJudged.size()> tiles;
  for (SlabId s = 0; s < head.slab_mesh().slab_count(); ++s) {
    const bool as_sampled = std::ranges::all_of(kJudged, [&](Layer layer) {
      return head.has(layer) == first.has(layer) &&
             (!head.has(layer) || head.tile(layer, s).same_values(first.tile(layer, s)));
    });
    for (std::size_t k = 0; k < kJudged.size(); ++k) {
      if (!head.has(kJudged[k])) continue;
      const Tile& tile = head.tile(kJudged[k], s);
      tiles[k].push_back(
          {tile.intervals(), as_sampled ? std::span(tile.plane(), tile.size()) : std::span<const float>()});
    }
  }
  return verify::check_samples(view(shell), source.view(), tiles[0],
                               kSampleTolerance * diagonal(head.slab_mesh().bounds()),
                               verify::SampleMarks{.voids = tiles[1], .folded = tiles[2]}, progress);
}

/// " in 3 slabs: 2, 5, 7"; long lists are cut short. Nothing where no slab is named.
std::string in_slabs(const std::vector<std::uint32_t>& slabs) {
  constexpr std::size_t kShown = 20;
  if (slabs.empty()) return {};
  std::vector<std::string> shown;
  for (const std::uint32_t slab : std::span(slabs).first(std::min(slabs.size(), kShown)))
    shown.push_back(std::to_string(slab));
  std::string text = fmt::format(" in {} slab{}: {}", slabs.size(), slabs.size() == 1 ? "" : "s", joined(shown));
  if (slabs.size() > kShown) text += fmt::format(" and {} more (--json names all)", slabs.size() - kShown);
  return text;
}
/// "holds", or how often a condition fails, and where.
std::string verdict(const verify::Certificate& certificate, std::size_t k) {
  if (certificate.holds[k]) return "holds";
  const std::size_t failures = certificate.failure_count[k];
  if (failures == 0) return "could not be tested";
  return fmt::format("fails {}{} time{},{}", certificate.at_least[k] ? "at least " : "", failures,
                     failures == 1 ? "" : "s", in_slabs(certificate.failing(static_cast<verify::Condition>(k))));
}

ordered_json to_json(const verify::Failure& f) {
  const auto number = [](std::uint32_t k) { return k == verify::kNothing ? ordered_json() : ordered_json(k); };
  return {{"condition", verify::name(f.condition)}, {"a", number(f.a)}, {"b", number(f.b)}, {"what", f.what}};
}

Status run_verify(const std::string& file, const std::string& source_file, const Context& context) {
  std::optional<NothingWritten> nothing_written(std::in_place);
  // Opening checks the tiles, too; the verifier does it in its own way.
  RELIEF_TRY(const ModelFile model, ModelFile::open(file, true, context.progress));
  const Mode mode = model.model().info.mode;
  const PlainCage shell(model.model().head->slab_mesh());
  verify::Certificate certificate;
  verify::SampleCheck samples;
  std::optional<std::size_t> phantoms;  // of the source
  if (source_file.empty()) {
    certificate = verify::check(view(shell), context.progress);
  } else {
    RELIEF_TRY(TriangleMesh mesh, import_mesh(source_file));
    const PlainSource source(std::move(mesh));
    if (source.phantom_from) phantoms = source.triangles.size() - *source.phantom_from;
    certificate = verify::check(view(shell), source.view(), context.progress);
    if (certificate.holds[0] && !context.progress.cancelled()) {
      RELIEF_TRY(const SnapshotPtr first, model.at(0, context.progress));
      samples = compare_samples(*model.model().head, *first, shell, source, context.progress);
    }
  }
  const bool shell_holds = claim_holds(mode, certificate);
  const TileFaults tiles = faults_of_tiles(*model.model().head, certificate, context.progress);
  if (context.progress.cancelled()) return fail(Errc::Cancelled, "verification was cancelled.");
  nothing_written.reset();
  // Preview says nothing of where the samples lie.
  const bool samples_hold = mode == Mode::Preview || samples.off == 0;
  const bool holds = shell_holds && tiles.first.empty() && samples_hold;
  if (context.json) {
    ordered_json json;
    json["mode"] = name(mode);
    json["holds"] = holds;
    json["slabs"] = shell.triangles.size();
    json["certificate"] = to_json(certificate, true);
    json["tiles"] = certificate.holds[0] ? ordered_json(tiles.first.empty()) : ordered_json();
    if (!tiles.first.empty()) json["failed_tiles"] = {{"what", tiles.first}, {"slabs", tiles.slabs}};
    if (certificate.with_source) {
      json["source"] = {{"parts", certificate.source_parts},
                        {"moved", certificate.source_moved},
                        {"lattice_step", certificate.lattice_step},
                        {"phantom_triangles", phantoms ? ordered_json(*phantoms) : ordered_json()}};
      json["samples"] = {{"tested", samples.tested},
                         {"off", samples.off},
                         {"slabs", samples.slabs},
                         {"worst", samples.worst},
                         {"hits", {{"single", samples.single}, {"none", samples.none}, {"several", samples.several}}}};
    }
    if (samples.at_least) json["samples"]["at_least"] = true;
    json["failures"] = ordered_json::array();
    for (const auto& f : certificate.failures) json["failures"].push_back(to_json(f));
    if (certificate.with_source) {
      json["failed_samples"] = ordered_json::array();
      for (const auto& f : samples.failures)
        json["failed_samples"].push_back({{"slab", f.a}, {"sample", f.b}, {"what", f.what}});
    }
    print_json(json);
  } else {
    for (std::size_t k = 0; k < certificate.asked(); ++k)
      print(fmt::format("{} {}\n", verify::name(static_cast<verify::Condition>(k)), verdict(certificate, k)));
    for (const auto& f : certificate.failures) print(fmt::format("  {}: {}\n", verify::name(f.condition), f.what));
    if (certificate.holds[0])
      print(tiles.first.empty() ? "tiles hold\n"
                                : fmt::format("tiles fail{}; {}\n", in_slabs(tiles.slabs), tiles.first));
    if (certificate.with_source)
      print(fmt::format(
          "samples {} tested, {}{} off{}, at most {:.3g} away\nsource  {} part{}, judged on a lattice of {:.3g}, "
          "vertices moved by at most {:.3g}\n",
          samples.tested, samples.at_least ? "at least " : "", samples.off, in_slabs(samples.slabs), samples.worst,
          certificate.source_parts, certificate.source_parts == 1 ? "" : "s", certificate.lattice_step,
          certificate.source_moved));
    print(fmt::format("{}: all that {} mode claims {}\n", file, name(mode), holds ? "holds" : "does not hold"));
  }
  if (holds) return {};
  const std::string reason = !shell_holds           ? first_reason(mode, certificate)
                             : !tiles.first.empty() ? tiles.first
                                                    : samples.failures.front().what;
  return fail(
      Errc::Corrupt,
      fmt::format("{}: it does not hold what {} mode claims ({}); convert it again{}", printable(file), name(mode),
                  reason, source_file.empty() ? "" : ", or verify it with the file that convert --mended writes"));
}

/// What a stroke's own text says of samples that would have gone beyond their fibre; nothing where it says nothing.
std::optional<std::uint64_t> limited_samples(const StrokeRecord& stroke) {
  const auto details = ordered_json::parse(stroke.details, nullptr, false);
  if (!details.is_object()) return std::nullopt;
  const auto found = details.find("limited");
  return found != details.end() && found->is_number_unsigned() ? std::optional(found->get<std::uint64_t>())
                                                               : std::nullopt;
}

/// One entry of the history: what the journal holds, whether it is undone, and whether its state can be read.
struct HistoryLine {
  const StrokeRecord& stroke;
  bool undone, damaged;

  [[nodiscard]] ordered_json json() const {
    ordered_json line = {{"number", stroke.number},
                         {"label", stroke.damaged ? ordered_json() : ordered_json(stroke.label)},
                         {"tiles", stroke.damaged ? ordered_json() : ordered_json(stroke.tiles)},
                         {"undone", undone},
                         {"damaged", damaged}};
    if (const auto limited = limited_samples(stroke)) line["limited"] = *limited;
    return line;
  }
  [[nodiscard]] std::string text() const {
    std::string facts = stroke.damaged ? "its record is damaged" : fmt::format("{} tiles", stroke.tiles);
    if (const auto limited = limited_samples(stroke); limited.value_or(0) > 0)
      facts += fmt::format(", {} samples limited", *limited);
    if (undone) facts += ", undone";
    if (damaged) facts += ", damaged";
    return fmt::format("  {:4d}  {} ({})\n", stroke.number, printable(stroke.label), facts);
  }
};

Status run_salvage(const std::string& file, const std::string& out, bool force, const Context& context) {
  RELIEF_CHECK(check_outputs({out}, {file}));
  RELIEF_CHECK(check_strokes(out, force));
  RELIEF_TRY(const Salvaged saved, ModelFile::salvage(file, out, context.progress));
  const std::uint64_t strokes = saved.current - saved.first, redo = saved.last - saved.current;
  if (context.json) {
    print_json({{"salvaged", {{"first", saved.first}, {"current", saved.current}, {"last", saved.last}}},
                {"strokes", strokes},
                {"redo", redo},
                {"lost", saved.lost}});
    return {};
  }
  print(fmt::format("{}: the model at stroke {}; {} can be undone, {} redone; {}\n", out, saved.current, strokes, redo,
                    saved.lost.empty() ? "nothing is lost" : "lost: " + joined(saved.lost)));
  return {};
}

Status run_info(const std::string& file, bool list_strokes, const Context& context) {
  RELIEF_TRY(const ModelFile model, open_model(file, context));
  RELIEF_TRY(const std::vector<DamagedStrokes> damage, model.damage(context.progress));
  const ModelInfo& info = model.model().info;
  const Snapshot& head = *model.model().head;
  const SlabMesh& mesh = head.slab_mesh();
  std::vector<StrokeRecord> strokes;
  if (list_strokes) {
    RELIEF_TRY(strokes, model.strokes());
  }
  const auto line_of = [&](const StrokeRecord& s) {
    const bool damaged = std::ranges::any_of(
        damage, [&](const DamagedStrokes& lost) { return lost.first <= s.number && s.number <= lost.last; });
    return HistoryLine{s, s.number > model.stroke_count(), damaged};
  };
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
    json["damaged"] = ordered_json::array();
    for (const auto& [first, last] : damage) json["damaged"].push_back({{"first", first}, {"last", last}});
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
      for (const StrokeRecord& s : strokes) json["journal"].push_back(line_of(s).json());
    }
    print_json(json);
    return {};
  }
  for (const DamagedStrokes& lost : damage)
    print(fmt::format("{}: {} stops there\n", to_string(lost), lost.last < model.stroke_count() ? "undo" : "redo"));
  std::string layer_text;
  for (const std::string& layer : layers) layer_text += (layer_text.empty() ? "" : ", ") + layer;
  print(fmt::format(
      "mode     {}\nsource   {} ({}, diagonal {:.6g})\nslabs    {} of n = {}\nsamples  {} distinct, {:.1f} MiB of "
      "tiles\nlayers   {}\nstrokes  {}{}\n",
      name(info.mode), printable(info.source), name(info.unit), info.source_diagonal, mesh.slab_count(),
      n_min == n_max ? std::to_string(n_min) : fmt::format("{} to {}", n_min, n_max), distinct_samples(mesh),
      static_cast<double>(head.bytes()) / (1 << 20), layer_text, model.stroke_count(),
      model.redo_count() > 0 ? fmt::format(" ({} undone)", model.redo_count()) : ""));
  for (const StrokeRecord& s : strokes) print(line_of(s).text());
  return {};
}

Status run_undo(const std::string& file, std::uint64_t strokes, bool forward, const Context& context) {
  RELIEF_TRY(ModelFile model, open_model(file, context, false));
  RELIEF_TRY(const std::uint64_t moved,
             forward ? model.redo(strokes, context.progress) : model.undo(strokes, context.progress));
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
  c->add_option("IN", o->in, "The mesh")->required()->check(names_file);
  c->add_option("-o,--output", o->out, "The model, MODEL.relief")->required()->check(names_file);
  c->add_option("--slabs", o->settings.slabs, "Slabs to aim for (default 200)")->check(CLI::Range(4, 1'000'000));
  auto* samples = c->add_option("--samples", o->settings.intervals,
                                "Intervals n per slab edge, 1 to 128, the same in every slab (the paper used 15); "
                                "without it chosen per slab, see --error");
  samples->check(CLI::Range(1, kMaxIntervals));
  c->add_option(
       "--error", o->settings.error,
       "How far the surface may lie from the mended source, share of the diagonal, 1e-7 to 1; slabs get the smallest "
       "power of two for n that keeps to it, at most 128 (default 1e-4, with samples no finer than the source asks "
       "for)")
      ->check(in_range(1e-7, 1))
      ->excludes(samples);
  c->add_option(
       "--mode", o->mode,
       "certified: proven, with more slabs where it takes them, or exit 1; tolerant: the slabs asked for, with samples "
       "marked whose fibre does not meet the surface once, and on a solid made anew where the surface itself takes "
       "more; certified where that takes none; "
       "preview: quick, single slabs are sound; without it certified, else preview")
      ->check(CLI::IsMember({"certified", "tolerant", "preview"}));
  c->add_option("--thickness", o->settings.thickness, "Longest fibre, share of the diagonal, 1e-4 to 1 (default 0.1)")
      ->check(in_range(1e-4, 1));
  c->add_flag(
       "--remesh{auto}", o->remesh,
       "Make the source a solid anew first, for sources that meet themselves or are open; --remesh=VOXEL sets the "
       "edge of a voxel, share of the diagonal, 1e-5 to 0.1")
      ->check([](const std::string& text) { return text == "auto" ? std::string() : in_range(1e-5, 0.1)(text); });
  c->add_option("--unit", o->unit,
                "What a model unit is: mm, cm or m, kept for 3MF and glTF (default: what the file says, else mm)")
      ->check(CLI::IsMember({"mm", "cm", "m"}));
  c->add_option("--mended", o->mended, "Also write the repaired source, MENDED.ply (double coordinates)")
      ->check(has_extension({".ply"}));
  c->add_flag("--force", o->force, "Replace a model that has strokes, or a file that is no model");
  finish_command(*c, context, [o, &context] { return run_convert(*o, context); });
}

void add_verify(CLI::App& app, Context& context) {
  auto file = std::make_shared<std::string>();
  auto source = std::make_shared<std::string>();
  CLI::App* c = app.add_subcommand("verify", "Check a model with the independent verifier");
  c->add_option("MODEL", *file, "The model")->required()->check(names_file);
  c->add_option("--source", *source,
                "Also prove that every fibre meets this mesh exactly once: what convert --mended wrote, or a clean "
                "original")
      ->check(names_file);
  finish_command(*c, context, [=, &context] { return run_verify(*file, *source, context); });
}

void add_info(CLI::App& app, Context& context) {
  struct Options {
    std::string file, out;
    bool strokes = false, salvage = false, force = false;
  };
  auto o = std::make_shared<Options>();
  CLI::App* c = app.add_subcommand("info", "Say what a model holds, and save what is whole of a damaged one");
  c->add_option("MODEL", o->file, "The model")->required()->check(names_file);
  auto* strokes = c->add_flag("--strokes", o->strokes, "List the history: every stroke, undone ones at the end");
  auto* salvage = c->add_flag("--salvage", o->salvage,
                              "Write the newest whole state of a damaged model, with the strokes that follow it "
                              "without a gap, and say what is lost");
  auto* out = c->add_option("-o,--output", o->out, "Where --salvage writes, OUT.relief")->check(names_file);
  auto* force = c->add_flag("--force", o->force, "Replace a model that has strokes, or a file that is no model");
  salvage->excludes(strokes)->needs(out);
  out->needs(salvage);
  force->needs(salvage);
  finish_command(*c, context, [o, &context] {
    return o->salvage ? run_salvage(o->file, o->out, o->force, context) : run_info(o->file, o->strokes, context);
  });
}

void add_undo(CLI::App& app, Context& context) {
  for (const bool forward : {false, true}) {
    auto file = std::make_shared<std::string>();
    auto strokes = std::make_shared<std::uint64_t>(1);
    CLI::App* c =
        app.add_subcommand(forward ? "redo" : "undo", forward ? "Bring undone strokes back" : "Take strokes back");
    c->add_option("MODEL", *file, "The model, changed in place")->required()->check(names_file);
    c->add_option("--strokes", *strokes, "How many (default 1)")->check(CLI::Range(1, 1'000'000'000));
    finish_command(*c, context, [=, &context] { return run_undo(*file, *strokes, forward, context); });
  }
}

}  // namespace relief::cli
