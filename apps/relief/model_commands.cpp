// convert, verify, info, undo, redo: what is done with a model as a whole.
#include "commands.h"

#include <relief/base/atomic_file.h>
#include <relief/base/cpu_time.h>
#include <relief/base/try.h>
#include <relief/convert/convert.h>
#include <relief/convert/proof.h>
#include <relief/core/clay.h>
#include <relief/core/detail.h>
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
    for (std::size_t edge = 0; edge < 3; ++edge) {
      const SlabId other = mesh.slabs()[s].neighbours[edge];
      const EdgeShare share = mesh.slabs()[s].shares[edge];
      // Where edges hang, the finer side counts.
      if (share == EdgeShare::Whole ? other == kNoSlab || other > s : share != EdgeShare::Halves)
        count += static_cast<std::size_t>(mesh.edge_intervals(s, static_cast<int>(edge))) - 1;
    }
  }
  return count;
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
  Status write(const TriangleMesh& mesh, const std::filesystem::path& target, Unit unit, const Progress& progress) {
    target_ = behind_links(target);
    temporary_ = target_;
    temporary_ += fmt::format(".{}.part.ply", getpid());
    Status written = export_mesh(mesh, temporary_, {.unit = unit, .double_positions = true}, progress);
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

/// How deep tools may cut and how high they may build, for a person.
std::string to_text(const Clay& clay) {
  const auto side = [](const ClaySide& s) {
    return fmt::format("{:.2g} % at least, in nine fibres of ten {:.2g} % or more, in {:.2g} % of all under {:g} %",
                       100 * s.least, 100 * s.tenth, 100 * s.thin_fibres, 100 * ClaySide::kThin);
  };
  return "below the surface " + side(clay.below) + "; above it " + side(clay.above) + " (of the diagonal)";
}

ordered_json to_json(const Clay& clay) {
  const auto side = [](const ClaySide& s) {
    return ordered_json{{"least", s.least},
                        {"tenth", s.tenth},
                        {"median", s.median},
                        {"thin_fibres", s.thin_fibres},
                        {"thin_samples", s.thin_samples},
                        {"least_near", vector_json(s.least_at)}};
  };
  return {{"fibres", clay.fibres}, {"below", side(clay.below)}, {"above", side(clay.above)}};
}

ordered_json to_json(const Conversion& made, const verify::Certificate& certificate,
                     const std::vector<std::string>& notes, double seconds, double wall_seconds) {
  const ConvertReport& r = made.report;
  ordered_json json;
  json["verdict"] = verdict(r, made.model.info);
  json["mode"] = name(made.model.info.mode);
  json["slabs"] = r.slabs;
  json["slabs_asked"] = r.slabs_asked;
  json["seconds"] = seconds;
  json["wall_seconds"] = wall_seconds;
  json["hits"] = {{"single", r.hits_single}, {"none", r.hits_none}, {"several", r.hits_several}};
  json["fibres_cast"] = r.fibres_cast;
  const ConvertReport::Coverage& coverage = r.coverage;
  json["coverage"] = {{"visible_share", coverage.share},
                      {"farthest", coverage.farthest},
                      {"hidden_share", coverage.hidden},
                      {"places", coverage.places},
                      {"missed", coverage.missed}};
  if (coverage.share < 1) json["coverage"]["missing_near"] = vector_json(coverage.missing_near);
  json["samples"] = distinct_samples(made.model.head->slab_mesh());
  json["source_triangles"] = r.source_triangles;
  json["certificate"] = to_json(certificate);
  const SlabMesh& mesh = made.model.head->slab_mesh();
  const auto [least, most] = std::ranges::minmax(mesh.slabs(), {}, &Slab::intervals);
  json["intervals"] = {{"min", least.intervals}, {"max", most.intervals}};
  json["error_goal"] = r.error > 0 ? ordered_json(r.error) : ordered_json();
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
                                          {"near", vector_json(part.near)},
                                          {"reason", part.reason}});
  if (r.remesh)
    json["remesh"] = {{"voxel", r.remesh->voxel},     {"sheets", r.remesh->sheets},
                      {"crumbs", r.remesh->crumbs},   {"lost", r.remesh->lost},
                      {"to_skin", r.remesh->to_skin}, {"from_skin", r.remesh->from_skin},
                      {"smooth", r.remesh->is_smooth}};
  if (r.remesh && r.remesh->lost > 0) json["remesh"]["lost_near"] = vector_json(r.remesh->lost_near);
  if (r.skin)
    json["skin"] = {{"dropped", r.skin->dropped},   {"open_parts", r.skin->open_parts},
                    {"cut", r.skin->cut},           {"coincident", r.skin->coincident},
                    {"repaired", r.skin->repaired}, {"moved_most", r.skin->moved_most},
                    {"crossing", r.skin->crossing}, {"specks", r.skin->specks}};
  if (r.undecided.share > 0)
    json["undecided"] = {{"share", r.undecided.share}, {"near", vector_json(r.undecided.near)}};
  json["mended"] = {{"moved_vertices", r.moved_vertices},      {"moved_most", r.moved_most},
                    {"parted_vertices", r.parted_vertices},    {"replaced_triangles", r.replaced_triangles},
                    {"vanished_parts", r.vanished_parts},      {"specks", r.specks},
                    {"dropped_parts", r.dropped_parts},        {"closed_openings", r.closed_openings},
                    {"phantom_triangles", r.phantom_triangles}};
  if (r.strays.components > 0)
    json["mended"]["strays"] = {
        {"parts", r.strays.components}, {"triangles", r.strays.triangles}, {"near", vector_json(r.strays.near)}};
  if (r.replaced_triangles > 0) {
    json["mended"]["replaced_widest"] = r.replaced_widest;
    json["mended"]["replaced_near"] = vector_json(r.replaced_near);
  }
  json["thickness"] = {{"min", r.thickness_min}, {"median", r.thickness_median}};
  json["clay"] = to_json(r.clay);
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

/// A file that does not say its unit counts as mm. Scans in metres show by their size: less than 5 mm across, or more
/// than 20 m, is rarely what stood before the scanner. `across`: without what lies far off.
void add_doubt_of_size(double across, std::vector<std::string>& notes) {
  constexpr double kSmall = 5, kLarge = 20'000;  // mm
  if (across >= kSmall && across <= kLarge) return;
  notes.push_back(
      fmt::format("the file does not say its unit, and {:.3g} mm across would be {}: give --unit m, cm or in if it is "
                  "another",
                  across, across < kSmall ? "small" : "large"));
}

Status run_convert(ConvertOptions& o, const Context& context) {
  const Stopwatch whole;
  o.settings.mode = mode_from_name(o.mode);
  if (!o.remesh.empty()) o.settings.remesh = o.remesh == "auto" ? 0.0 : std::stod(o.remesh);
  RELIEF_CHECK(check_outputs({o.out, o.mended}, {o.in}));
  check_model_name(o.out);
  check_no_model({{o.mended, "meshes", ".ply"}});
  RELIEF_CHECK(check_strokes(o.out, o.force, context.progress));
  std::optional<NothingWritten> nothing_written(std::in_place);
  MendedFile mended;
  Conversion made;
  verify::Certificate certificate;
  std::vector<std::string> notes;  // of the import
  std::vector<ConvertReport::Phase> phases;
  Stopwatch watch;
  const auto phase_done = [&](const char* name) {
    phases.push_back({name, watch.cpu(), watch.wall()});
    watch = {};
  };
  const auto convert_and_verify = [&]() -> Status {
    made = {};
    if (names_model(o.in))
      return fail(Errc::InvalidArgument,
                  printable(o.in) + ": is a model already; relief refine or relief export takes it");
    RELIEF_TRY(TriangleMesh source, import_mesh(o.in, context.progress));
    phase_done("import");
    if (context.progress.cancelled()) return fail(Errc::Cancelled, "conversion was cancelled.");
    o.settings.unit =
        o.unit.empty() ? source.unit.value_or(Unit::Millimetre) : unit_from_name(o.unit).value_or(Unit::Millimetre);
    o.settings.sample_memory = memory_limit(source) / 6;
    notes = std::move(source.notes);
    const bool is_unit_known = !o.unit.empty() || source.unit;
    auto converted = convert(std::move(source), o.settings, context.progress);
    // The library does not know the file's name, the user's sentence needs it.
    if (!converted) return fail(converted.error().code, printable(o.in) + ": " + converted.error().message);
    made = std::move(*converted);
    if (!is_unit_known) add_doubt_of_size(made.model.info.source_diagonal, notes);
    phases.insert(phases.end(), made.report.phases.begin(), made.report.phases.end());
    watch = {};
    // The mended source is on the disk, or was not asked for, when the verifier takes it.
    if (!o.mended.empty()) {
      nothing_written.reset();
      RELIEF_CHECK(mended.write(made.mended, o.mended, o.settings.unit, context.progress));
      phase_done("mended");
    }
    auto proof = prove(made, o.settings.mode, o.settings.remesh.has_value(), context.progress);
    if (context.progress.cancelled()) return fail(Errc::Cancelled, "conversion was cancelled.");
    if (!proof) return fail(proof.error().code, printable(o.in) + ": " + proof.error().message);
    certificate = std::move(*proof);
    phase_done("verify");
    return {};
  };
  RELIEF_CHECK(convert_and_verify());
  made.model.info.source = std::filesystem::path(o.in).filename().string();
  nothing_written.reset();
  RELIEF_TRY(const ModelFile saved, ModelFile::create(o.out, made.model, context.progress));
  RELIEF_CHECK(mended.keep());
  phase_done("save");
  made.report.phases = std::move(phases);
  const double seconds = whole.cpu();
  if (context.json) {
    print_json(to_json(made, certificate, notes, seconds, whole.wall()));
  } else {
    print(verdict(made.report, made.model.info) + ".\n");
    for (const std::string& note : notes) print(note + "\n");
    print(fmt::format("{}{}: {} slabs, {} mode, {:.2f} CPU s\n", to_string(made.report), o.out, made.report.slabs,
                      name(made.model.info.mode), seconds));
  }
  return {};
}

/// The share of the slabs' diagonal within which a sample must lie from where its fibre meets the source.
constexpr double kSampleTolerance = 1e-6;

/// Of each root, whether it is one of the model as it was made, and its fibres are where they were.
std::vector<bool> roots_in_place(const SlabMesh& now, const SlabMesh& made) {
  std::vector<bool> in_place(now.roots().size());
  const auto stays = [&](FibreId f) {
    return now.root_fibres()[f].inner == made.root_fibres()[f].inner &&
           now.root_fibres()[f].outer == made.root_fibres()[f].outer;
  };
  for (std::size_t s = 0; s < std::min(in_place.size(), made.roots().size()); ++s)
    in_place[s] = now.roots()[s].fibres == made.roots()[s].fibres && std::ranges::all_of(now.roots()[s].fibres, stays);
  return in_place;
}

constexpr std::array kJudged = {Layer::Displacement, Layer::Void, Layer::Folded};

/// Of each root in place, whether no stroke changed a sample of it: the pieces that it was cut into have what follows
/// from the samples it had.
std::vector<bool> roots_as_sampled(const Snapshot& head, const Snapshot& first, std::vector<bool> in_place) {
  const SlabMesh& mesh = head.slab_mesh();
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    const RootPlace place = mesh.root_place(s);
    if (!in_place[place.root]) continue;
    const bool same = first.slab_mesh().level(place.root) == 0 && std::ranges::all_of(kJudged, [&](Layer layer) {
                        if (head.has(layer) != first.has(layer)) return false;
                        if (!head.has(layer)) return true;
                        const TilePtr& then = first.shared_tile(layer, place.root);
                        const int n = head.intervals(layer, s);
                        if (place.level == 0 && n == then->intervals()) return head.tile(layer, s).same_values(*then);
                        return can_carry(then->intervals(), place, n) &&
                               head.tile(layer, s).same_values(*part_of(*then, layer, place, n));
                      });
    if (!same) in_place[place.root] = false;
  }
  return in_place;
}

/// Compares the samples of all roots that no stroke has changed.
verify::SampleCheck compare_samples(const Snapshot& head, const SnapshotPtr& first, const std::vector<bool>& in_place,
                                    const PlainCage& shell, const PlainSource& source, const Progress& progress) {
  const std::vector<bool> as_sampled = first ? roots_as_sampled(head, *first, in_place) : in_place;
  std::array<std::vector<verify::SampleTile>, kJudged.size()> tiles;
  for (SlabId s = 0; s < as_sampled.size(); ++s)
    for (std::size_t k = 0; k < kJudged.size(); ++k) {
      if (!head.has(kJudged[k])) continue;
      if (!as_sampled[s]) {
        const bool was_there = first && s < first->slab_mesh().roots().size();
        tiles[k].push_back({was_there ? first->slab_mesh().intervals(s) : head.slab_mesh().roots()[s].intervals, {}});
        continue;
      }
      const Tile& tile = first->tile(kJudged[k], s);
      tiles[k].push_back({tile.intervals(), std::span(tile.plane(), tile.size())});
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

/// "C0 to C4", "C0, C1 and C3": the conditions that were tested and that the mode claims.
std::string judged(Mode mode, std::size_t tested) {
  std::vector<std::size_t> which;
  for (std::size_t k = 0; k < tested; ++k)
    if (claims(mode, static_cast<verify::Condition>(k))) which.push_back(k);
  const auto name_of = [&](std::size_t at) {
    return std::string(verify::name(static_cast<verify::Condition>(which[at])));
  };
  const std::size_t last = which.size() - 1;
  if (which[last] - which.front() == last) return name_of(0) + " to " + name_of(last);
  std::string text = name_of(0);
  for (std::size_t at = 1; at < last; ++at) text += ", " + name_of(at);
  return text + " and " + name_of(last);
}

/// One sentence: what was checked and how it went. Without a mesh, that the distance to the scan was not.
std::string verdict_of(Mode mode, bool holds, const std::string& conditions, bool has_source, bool has_first) {
  if (!holds) return fmt::format("not all that {} mode claims holds", name(mode));
  if (!has_first)
    return conditions + " and the tiles hold; the distance to the scan is not known: strokes that are lost changed it";
  if (has_source) return fmt::format("all that {} mode claims holds", name(mode));
  return conditions + " and the tiles hold; the distance to the scan was not checked: add --source SCAN";
}

Status run_verify(const std::string& file, const std::string& source_file, const Context& context) {
  std::optional<NothingWritten> nothing_written(std::in_place);
  // Opening checks the tiles, too; the verifier does it in its own way.
  RELIEF_TRY(const ModelFile model, ModelFile::open(file, true, context.progress));
  const Mode mode = model.model().info.mode;
  const SlabMesh& mesh = model.model().head->slab_mesh();
  const PlainCage shell(mesh);
  SnapshotPtr first;  // as it was converted
  if (model.first_state() == FirstState::AsMade) {
    RELIEF_TRY(first, model.at(0, context.progress));
  }
  // Where nobody has that, nothing of the model is known to be as it was then.
  const std::vector<bool> in_place =
      first ? roots_in_place(mesh, first->slab_mesh()) : std::vector<bool>(mesh.roots().size());
  const auto moved = static_cast<std::size_t>(std::ranges::count(in_place, false));
  verify::Certificate certificate;
  verify::SampleCheck samples;
  std::optional<std::size_t> phantoms;  // of the source
  if (source_file.empty()) {
    certificate = verify::check(view(shell), context.progress);
  } else {
    RELIEF_TRY(TriangleMesh triangles, import_mesh(source_file, context.progress));
    const PlainSource source(std::move(triangles));
    if (source.phantom_from) phantoms = source.triangles.size() - *source.phantom_from;
    certificate = verify::check(view(shell), source.view(), context.progress);
    if (certificate.holds[0] && !context.progress.cancelled())
      samples = compare_samples(*model.model().head, first, in_place, shell, source, context.progress);
  }
  const bool shell_holds = claim_holds(mode, certificate, moved == 0);
  const TileFaults tiles = faults_of_tiles(*model.model().head, certificate, context.progress);
  if (context.progress.cancelled()) return fail(Errc::Cancelled, "verification was cancelled.");
  nothing_written.reset();
  // Preview says nothing of where the samples lie.
  const bool samples_hold = mode == Mode::Preview || samples.off == 0;
  const bool holds = shell_holds && tiles.first.empty() && samples_hold;
  Status verdict_status;
  if (!holds) {
    const std::string reason = !shell_holds           ? first_reason(mode, certificate, moved == 0)
                               : !tiles.first.empty() ? tiles.first
                                                      : samples.failures.front().what;
    verdict_status =
        fail(Errc::Corrupt,
             fmt::format("{}: the claims of {} mode fail ({}); convert it again{}", printable(file), name(mode), reason,
                         source_file.empty() ? "" : ", or give --source what --mended wrote"));
  }
  const std::string verdict_text =
      verdict_of(mode, holds, judged(mode, claimed(certificate, moved == 0)), !source_file.empty(), first != nullptr);
  if (context.json) {
    ordered_json json;
    json["verdict"] = verdict_text;
    json["mode"] = name(mode);
    json["holds"] = holds;
    json["distance_checked"] = samples.tested > 0;
    json["slabs"] = shell.triangles.size();
    json["pieces"] = mesh.slab_count();
    json["moved_slabs"] = moved;
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
    add_error(json, verdict_status);
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
    if (moved > 0 && first)
      print(fmt::format("strokes moved the fibres of {} slab{}: C0 to C4 are claimed\n", moved, moved == 1 ? "" : "s"));
    print(fmt::format("{}: {}\n", file, verdict_text));
  }
  return verdict_status;
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
  check_model_name(out);
  RELIEF_CHECK(check_strokes(out, force, {.report = {}, .cancel = context.progress.cancel}));
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

int finest_grid(const Snapshot& model, Layer layer) {
  int finest = 1;
  for (SlabId s = 0; s < model.slab_mesh().slab_count(); ++s) finest = std::max(finest, model.intervals(layer, s));
  return finest;
}

Status run_info(const std::string& file, bool list_strokes, const Context& context) {
  auto opened = open_model(file, context);
  // A file of another kind may be a mesh, unless its name says that it was a model.
  if (!opened && opened.error().code == Errc::UnsupportedFormat && !list_strokes && !names_model(file))
    return run_mesh_info(file, context);
  RELIEF_TRY(const ModelFile model, std::move(opened));
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
  const Clay clay = measure_clay(head, source_diagonal(model.model()));
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
    json["slabs"] = mesh.roots().size();
    json["pieces"] = mesh.slab_count();
    json["fibres"] = mesh.root_fibres().size();
    json["samples"] = distinct_samples(mesh);
    json["intervals"] = {{"min", n_min}, {"max", n_max}};
    json["strokes"] = model.stroke_count();
    json["redo"] = model.redo_count();
    json["damaged"] = ordered_json::array();
    for (const auto& [first, last] : damage) json["damaged"].push_back({{"first", first}, {"last", last}});
    json["layers"] = layers;
    if (head.has(Layer::Colour)) json["colour_intervals"] = finest_grid(head, Layer::Colour);
    json["unit"] = name(info.unit);
    json["source"] = info.source;
    json["source_diagonal"] = info.source_diagonal;
    const Box3d box = mesh.bounds();
    json["bounds"] = {vector_json(box.low), vector_json(box.high)};
    json["clay"] = to_json(clay);
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
      "mode     {}\nsource   {} ({}, diagonal {:.6g})\nslabs    {}{} of n = {}\nsamples  {} distinct, {:.1f} MiB of "
      "tiles\nclay     {}\nlayers   {}\nstrokes  {}{}\n",
      name(info.mode), printable(info.source), name(info.unit), info.source_diagonal, mesh.roots().size(),
      mesh.is_cut() ? fmt::format(", cut into {} pieces", mesh.slab_count()) : "",
      n_min == n_max ? std::to_string(n_min) : fmt::format("{} to {}", n_min, n_max), distinct_samples(mesh),
      static_cast<double>(head.bytes()) / (1 << 20), to_text(clay), layer_text, model.stroke_count(),
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
  CLI::App* c =
      app.add_subcommand("convert", "Make a model from a triangle mesh (PLY, OBJ, STL, OFF, glTF, GLB, 3MF, DRC)");
  context.catalogue[c] = {
      .group = "Make",
      .examples = {{"relief convert scan.ply -o scan.relief"},
                   {"relief convert scan.ply -o fine.relief --slabs 500 --samples 31"},
                   {"relief convert broken.stl -o solid.relief --remesh", "self-intersecting or open"},
                   {"relief convert scan.ply -o scan.relief --unit cm --mended mended.ply"}}};
  c->add_option("MESH", o->in, "the mesh")->required()->check(names_file);
  c->add_option("-o,--output", o->out, "where to write the model")
      ->required()
      ->check(names_file)
      ->type_name("MODEL.relief");
  c->add_option("--slabs", o->settings.slabs, "slabs to aim for")
      ->check(whole_in_range(4, 1'000'000))
      ->type_name("N")
      ->default_str("200");
  auto* samples = c->add_option("--samples", o->settings.intervals,
                                "intervals per slab edge, the same in every slab; the paper used 15");
  samples->check(whole_in_range(1, kMaxIntervals))->type_name("n")->default_str("per slab");
  c->add_option("--error", o->settings.error, "allowed distance to the mended mesh, share of the diagonal")
      ->check(in_range(1e-7, 1))
      ->excludes(samples)
      ->type_name("E")
      ->default_str("1e-4, no finer than the mesh");
  c->add_option("--mode", o->mode, "certified: proven, exit 1 if not; tolerant: N slabs, bad samples marked")
      ->check(one_of({"certified", "tolerant"}))
      ->type_name("MODE")
      ->default_str("best that can be proved");
  c->add_option("--thickness", o->settings.thickness, "longest fibre, share of the diagonal")
      ->check(in_range(1e-4, 1))
      ->type_name("T")
      ->default_str("0.2");
  c->add_flag("--remesh{auto}", o->remesh,
              "rebuild the mesh as a solid first; VOXEL: edge of a voxel, share of the diagonal, 1e-5 to 0.1")
      ->check([](const std::string& text) { return text == "auto" ? std::string() : in_range(1e-5, 0.1)(text); })
      ->type_name("VOXEL");
  c->add_option("--unit", o->unit, "what one model unit is")
      ->check(one_of({"mm", "cm", "m", "in"}))
      ->default_str("the file's, else mm");
  c->add_option("--mended", o->mended, "also write the mended mesh, in double precision")
      ->check(has_extension({".ply"}))
      ->type_name("FILE.ply");
  c->add_flag("--force", o->force, "replace a model that has strokes, or a file that is not a model");
  finish_command(*c, context, [o, &context] { return run_convert(*o, context); });
}

void add_verify(CLI::App& app, Context& context) {
  auto file = std::make_shared<std::string>();
  auto source = std::make_shared<std::string>();
  CLI::App* c = app.add_subcommand("verify", "Check a model with the independent verifier");
  context.catalogue[c] = {.group = "Check",
                          .examples = {{"relief verify scan.relief"},
                                       {"relief verify scan.relief --source mended.ply", "its fibres, too"}}};
  c->add_option("MODEL", *file, "the model")->required()->check(names_file);
  c->add_option("--source", *source,
                "prove that every fibre meets this mesh exactly once: what convert --mended wrote, or a clean original")
      ->check(names_file)
      ->type_name("MESH.ply");
  finish_command(*c, context, [=, &context] { return run_verify(*file, *source, context); });
}

void add_info(CLI::App& app, Context& context) {
  struct Options {
    std::string file, out;
    bool strokes = false, salvage = false, force = false;
  };
  auto o = std::make_shared<Options>();
  CLI::App* c =
      app.add_subcommand("info", "Say what a model or a mesh holds, and save what is whole of a damaged model");
  context.catalogue[c] = {.group = "Check",
                          .examples = {{"relief info scan.ply", "triangles, unit, size of a mesh"},
                                       {"relief info scan.relief --strokes", "with the history"},
                                       {"relief info damaged.relief --salvage -o saved.relief"}}};
  c->add_option("MODEL", o->file, "the model, or a mesh")->required()->check(names_file);
  auto* strokes = c->add_flag("--strokes", o->strokes, "list every stroke, undone ones at the end");
  auto* salvage = c->add_flag("--salvage", o->salvage,
                              "write the newest whole state of a damaged model, with the strokes that follow it, and "
                              "say what is lost");
  auto* out =
      c->add_option("-o,--output", o->out, "where --salvage writes")->check(names_file)->type_name("OUT.relief");
  auto* force = c->add_flag("--force", o->force, "replace a model that has strokes, or a file that is not a model");
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
    const std::string name = forward ? "redo" : "undo";
    CLI::App* c = app.add_subcommand(name, forward ? "Bring undone strokes back" : "Take strokes back");
    context.catalogue[c] = {.group = "Shape",
                            .examples = {{"relief " + name + " scan.relief", "the last one"},
                                         {"relief " + name + " scan.relief --strokes 3"}}};
    c->add_option("MODEL", *file, "the model, changed in place")->required()->check(names_file);
    c->add_option("--strokes", *strokes, "how many")
        ->check(whole_in_range(1, 1'000'000'000))
        ->type_name("N")
        ->default_str("1");
    finish_command(*c, context, [=, &context] { return run_undo(*file, *strokes, forward, context); });
  }
}

}  // namespace relief::cli
