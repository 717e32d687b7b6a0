#include <relief/base/free_memory.h>
#include <relief/base/try.h>
#include <relief/convert/certified_shell.h>
#include <relief/convert/geometry/components.h>
#include <relief/convert/modes.h>
#include <relief/convert/obstacle_text.h>
#include <relief/convert/prepare/openings.h>
#include <relief/convert/prepare/small_components.h>
#include <relief/convert/remesh/remesh.h>
#include <relief/convert/report.h>
#include <relief/convert/sample/fibre_sampling.h>
#include <relief/convert/sample/sampled_model.h>
#include <relief/convert/sample/source_rays.h>
#include <relief/convert/skin/outer_skin.h>
#include <relief/convert/skinned_shell.h>
#include <relief/convert/stage_meshes.h>
#include <relief/verify/verify.h>

#include <malloc.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <string>
#include <utility>

namespace relief::detail {
namespace {

using CagePtr = std::shared_ptr<const SlabMesh>;

// How far a source vertex may be moved so that some direction sees its faces, share of the diagonal; more where sheets
// have to be pushed apart.
constexpr double kFarthest = 2e-3;
// How far points that coincide, as where corners or edges of solids touch, are moved off each other, share of the
// diagonal: a tenth of the error that is aimed at.
constexpr double kApart = 0.1 * kUsualError;
// No wider than this, share of the diagonal, a component that has no shell is left out: it is finer than the error that
// is aimed at.
constexpr double kSpeck = kUsualError;

/// Returns one interval per edge: the cage alone.
Result<CagePtr> slab_mesh_of(const Shell& shell, const Lattice& lattice) {
  std::vector<Fibre> fibres(shell.ends[kInner].size());
  for (std::size_t v = 0; v < fibres.size(); ++v)
    fibres[v] = {lattice.to_model(shell.ends[kInner][v]), lattice.to_model(shell.ends[kOuter][v])};
  std::vector<SlabMesh::Face> slabs;
  slabs.reserve(shell.faces.size());
  for (const Face& face : shell.faces) slabs.push_back({face, 1});
  RELIEF_TRY(auto mesh, SlabMesh::make(std::move(fibres), slabs));
  return std::make_shared<const SlabMesh>(std::move(mesh));
}

/// Returns what the verifier finds.
verify::Certificate check_shell(const Shell& shell, const Lattice& lattice) {
  const auto places = [&](Side side) {
    std::vector<std::array<double, 3>> ends;
    ends.reserve(shell.ends[side].size());
    for (const LatticePoint end : shell.ends[side]) {
      const Vec3d p = lattice.to_model(end);
      ends.push_back({p.x, p.y, p.z});
    }
    return ends;
  };
  const auto inner = places(kInner), outer = places(kOuter);
  return verify::check({inner, outer, shell.faces});
}

/// A shell that closes the openings of a source first, as suits them.
struct ClosedShell {
  CertifiedShell made;
  Lattice lattice;
  std::size_t openings = 0;                      ///< of which fill triangles are left
  std::optional<ConvertReport::Skin> skin = {};  ///< where parts overlapped
  Undecided undecided = {};                      ///< of what overlapped
};

/// Returns what stands in the way of slabs on a solid that was made again with sharp edges: it crosses itself so much
/// that cutting would take long, and a smooth one has no such places.
std::optional<Obstacle> crosses_too_much(const ClosedSource& solid, const Overlaps& overlaps) {
  const std::size_t pairs = overlaps.between + overlaps.within;
  if (double(pairs) <= kMostReplaced * double(solid.faces.size())) return std::nullopt;
  return Obstacle{DefectKind::SelfIntersection, solid.points[solid.faces[overlaps.first][0]],
                  find_components(solid.points.size(), solid.faces).of_face[overlaps.first], pairs};
}

/// `is_sharp_solid`: it was made again, with sharp edges.
ClosedShell close_and_certify(Paged<TriangleMesh>& open, const ConvertSettings& settings, double diagonal,
                              double most_lost, bool is_sharp_solid, const Progress& progress) {
  // What a tolerant shell may give up; what needs nothing given up comes first, in certified mode, too.
  constexpr std::array<Tolerance, 10> kTolerances = {
      {{}, {0.05}, {0.2}, {0.5}, {1}, {1, 0.01}, {1, 0.03}, {1, 0.1}, {1, 0.3}, {1, 1}}};
  constexpr int kAttempts = 3;
  Openings openings(open.get());
  ClosedShell result;
  const double room = kWhileMade * settings.thickness * diagonal;
  for (int attempt = 1;; ++attempt) {
    ClosedOpenings closed = openings.close(open.get(), room);
    const double share = diagonal / closed.lattice.step;
    result.lattice = closed.lattice;
    show_source(settings.show, Stage::Closed, closed.source, closed.lattice);
    Skinned source{std::move(closed.source), {}, {}};
    const auto overlaps = find_overlaps(source.source, progress);
    if (!overlaps) break;
    if (is_sharp_solid) {
      result.made.prepared.obstacle = crosses_too_much(source.source, *overlaps);
      if (result.made.prepared.obstacle) break;
    }
    if (asks_for_skin(*overlaps, source.source.faces.size(), attempt > kAttempts))
      source = take_skin(std::move(source.source), closed.lattice, 1 / share, settings.show, progress);
    open.rest();
    result.made = certify_skin(
        source,
        {.target = static_cast<std::size_t>(settings.slabs),
         .limits = {.longest = kWhileMade * settings.thickness * share,
                    .farthest = kFarthest * share,
                    .apart = kApart * share,
                    .speck = kSpeck * share},
         .longest = settings.thickness * share,
         .tolerances = std::span(kTolerances).first(settings.mode == Mode::Tolerant ? kTolerances.size() : 1),
         .most_lost = most_lost,
         .pages = open.pages()},
        progress);
    result.skin = source.report;
    result.undecided = source.undecided;
    // What the skin dropped takes its openings along.
    result.openings = source.report ? count_openings(closed.patches, source.face_of) : openings.count();
    if (!result.made.shell.faces.empty()) {
      show_source(settings.show, Stage::Prepared, result.made.prepared.source, closed.lattice);
      show_shell(settings.show, result.made.shell, closed.lattice);
    }
    const Prepared& prepared = result.made.prepared;
    if (!result.made.shell.faces.empty() || !prepared.obstacle || !prepared.specks.empty() || attempt > kAttempts)
      break;
    // Openings are closed in another way; in the end whatever overlaps is cut to its outer skin.
    if (attempt < kAttempts && openings.change(open.get(), closed.patches, prepared.bad_faces, room, progress))
      continue;
    if (result.skin) break;
    attempt = kAttempts;
  }
  return result;
}

/// Returns a component that is left out.
ConvertReport::LeftOut left_out_of(const TriangleMesh& mesh, const Components& components, const Obstacle& speck,
                                   double diagonal) {
  Box3d box;
  ConvertReport::LeftOut result;
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    if (components.of_face[f] != speck.component) continue;
    ++result.triangles;
    for (const std::uint32_t v : mesh.triangles[f]) box.add(mesh.positions[v]);
  }
  result.near = box.centre();
  result.across = relief::diagonal(box) / diagonal;
  result.reason = clause(speck);
  return result;
}

/// Returns the least number of triangles that a surface of some handles has: 4 for a ball, 14 for a torus (Ringel,
/// Jungerman).
std::size_t least_triangles(std::size_t handles) {
  const std::size_t corners =
      handles == 2 ? 10 : static_cast<std::size_t>(std::ceil((7 + std::sqrt(1 + 48 * double(handles))) / 2));
  return 2 * corners + 4 * handles - 4;
}

ConvertReport::Fewest fewest_slabs(const ClosedSource& source, const Components& parts) {
  std::vector<std::size_t> triangles(parts.count, 0), corners(parts.count, 0);
  std::vector<std::uint8_t> seen(source.points.size(), 0);
  for (std::size_t f = 0; f < source.faces.size(); ++f) {
    ++triangles[parts.of_face[f]];
    for (const std::uint32_t v : source.faces[f])
      if (std::exchange(seen[v], 1) == 0) ++corners[parts.of_face[f]];
  }
  ConvertReport::Fewest least;
  least.components = parts.count;
  for (std::size_t part = 0; part < parts.count; ++part) {
    const std::size_t handles = (triangles[part] / 2 + 2 - corners[part]) / 2;  // Euler
    least.handles += handles;
    least.slabs += least_triangles(handles);
  }
  return least;
}

}  // namespace

void add_undecided(ConvertReport& report, double area, Vec3d near, double scanned) {
  const double share = scanned > 0 ? std::min(area / scanned, 1.0) : 0;
  if (share < ConvertReport::Undecided::kTold || share <= report.undecided.share) return;
  report.undecided = {share, near};
}

/// Returns the shell in certified mode and the source that it is certified against, in place of the repaired one.
/// Without a certificate both stay, and the report has the reason (a clause); cancelled, there is no reason.
/// `most_lost`: share of the source's area that a tolerant shell may leave out.
CagePtr certify(Ground& ground, const ConvertSettings& settings, double diagonal, double most_lost,
                ConvertReport& report, const Progress& progress) {
  report.parts = {};
  std::vector<std::size_t> sizes;  // by component
  {
    const Components parts = find_components(ground.mesh.get().positions.size(), ground.mesh.get().triangles);
    sizes.resize(parts.count, 0);
    for (const std::uint32_t part : parts.of_face) ++sizes[part];
  }
  report.parts.count = sizes.size();
  const auto note_obstacle = [&](std::uint32_t part, Vec3d near, const std::string& reason) {
    if (report.parts.obstacles.size() == kMostBadComponents) return;
    report.parts.obstacles.push_back({part, sizes[part], near, reason});
  };
  Paged<TriangleMesh> rest;  // without the tiny components, once there are any
  Paged<TriangleMesh>* open = &ground.mesh;
  std::vector<ConvertReport::LeftOut> left_out;
  std::size_t specks = 0;
  std::vector<std::uint32_t> part_number(sizes.size());  // of those in `open`
  std::iota(part_number.begin(), part_number.end(), 0U);
  ClosedShell closed;
  for (;;) {
    closed =
        close_and_certify(*open, settings, diagonal, most_lost, report.remesh && !report.remesh->is_smooth, progress);
    const Prepared& made = closed.made.prepared;
    for (const Obstacle& bad : made.specks.empty() ? made.bad_components : made.specks)
      note_obstacle(part_number[bad.component], closed.lattice.to_model(bad.place), clause(bad));
    if (made.specks.empty() || made.specks.size() == part_number.size()) break;
    const Components parts = find_components(open->get().positions.size(), open->get().triangles);
    std::vector<std::uint32_t> gone;
    for (const Obstacle& speck : made.specks) {
      gone.push_back(speck.component);
      if (left_out.size() < ConvertReport::kMostNamed)
        left_out.push_back(left_out_of(open->get(), parts, speck, diagonal));
    }
    specks += gone.size();
    rest = Paged(without_components(open->get(), parts, gone), open->pages());
    open = &rest;
    std::size_t kept = 0;
    for (std::uint32_t part = 0; part < part_number.size(); ++part)
      if (!std::ranges::binary_search(gone, part)) part_number[kept++] = part_number[part];
    part_number.resize(kept);
  }
  CertifiedShell& made = closed.made;
  const Lattice& lattice = closed.lattice;
  if (made.shell.faces.empty()) {
    if (const std::optional<Obstacle>& obstacle = made.prepared.obstacle)
      report.not_certified = why_no_shell(*obstacle, lattice.to_model(obstacle->place));
    return nullptr;
  }
  // The proof is the verifier's, not the builder's.
  if (const verify::Certificate certificate = check_shell(made.shell, lattice); !certificate.all()) {
    report.not_certified = why_refused(certificate);
    return nullptr;
  }
  auto mesh = slab_mesh_of(std::exchange(made.shell, {}), lattice);
  if (!mesh) {
    report.not_certified = why_not_joined(mesh.error());
    return nullptr;
  }
  const Repairs& repairs = made.prepared.repairs;
  const ClosedSource& source = made.prepared.source;
  report.split_high_valence = repairs.split_vertices;
  report.truncated_spikes = repairs.truncated_spikes;
  report.moved_vertices = repairs.moved_points;
  report.moved_most = repairs.moved_most * lattice.step / diagonal;
  report.parted_vertices = repairs.parted_points;
  report.replaced_triangles = repairs.replaced_faces;
  report.replaced_widest = repairs.replaced_widest * lattice.step / diagonal;
  report.replaced_near = lattice.to_model(repairs.replaced_place);
  report.vanished_parts = repairs.vanished_components;
  report.skin = closed.skin;
  add_undecided(report, closed.undecided.area, closed.undecided.near, ground.scanned_area);
  report.specks = specks;
  report.left_out = std::move(left_out);
  report.lattice_step = lattice.step / diagonal;
  report.parts = {};
  const Components mended_parts = find_components(source.points.size(), source.faces);
  report.parts.count = mended_parts.count;
  if ((*mesh)->slab_count() > static_cast<std::size_t>(settings.slabs))
    report.fewest = fewest_slabs(source, mended_parts);
  report.parts.certified = made.tolerant ? 0 : report.parts.count;
  ground.tolerant = made.tolerant;
  ground.lattice = lattice;
  TriangleMesh mended;
  mended.unit = ground.mesh.get().unit;
  for (const int phantom : {0, 1}) {
    for (std::size_t f = 0; f < source.faces.size(); ++f)
      if (source.phantom[f] == phantom) mended.triangles.push_back(source.faces[f]);
    if (phantom == 0) ground.phantom_from = mended.triangles.size();
  }
  std::vector<std::uint32_t> number(source.points.size(), 0);
  for (const Face& t : mended.triangles)
    for (const std::uint32_t v : t) number[v] = 1;
  for (std::size_t v = 0; v < number.size(); ++v) {
    if (number[v] == 0) continue;
    number[v] = static_cast<std::uint32_t>(mended.positions.size());
    mended.positions.push_back(lattice.to_model(source.points[v]));
  }
  for (Face& t : mended.triangles)
    for (std::uint32_t& v : t) v = number[v];
  report.phantom_triangles = mended.triangles.size() - ground.phantom_from;
  report.closed_openings = closed.openings;
  ground.mesh = Paged(std::move(mended), ground.mesh.pages());
  return *mesh;
}

Status remesh_source(TriangleMesh& mended, double share, Follow follow, const StageSink& show, ConvertReport& report,
                     const Progress& progress) {
  const double across = diagonal(bounds(mended)), scanned = surface_area(mended);
  RELIEF_TRY(Remeshed made, remesh(mended, share * across, follow, progress));
  report.remesh = {.voxel = made.voxel / across,
                   .sheets = made.sheets,
                   .crumbs = made.crumbs,
                   .lost = made.lost,
                   .lost_near = made.lost_at,
                   .to_skin = made.to_skin / across,
                   .from_skin = made.from_skin / across,
                   .is_smooth = follow == Follow::Middle};
  report.repair.parts = made.parts;
  report.repair.boundary_loops = made.rims;
  report.undecided = {};
  add_undecided(report, made.undecided, made.undecided_at, scanned);
  mended = std::move(made.mesh);
  show_components(show, Stage::Remeshed, mended);
  return {};
}

namespace {

/// Of some fibres through a shell the share that meets nothing of what it stands on.
double missed_share(const SlabMesh& mesh, const Ground& ground, const Progress& progress) {
  constexpr std::size_t kWithout = 950'000;  // of the million that are looked at in the end
  const TriangleMesh& mended = ground.mesh.get();
  const SourceRays surface(mended.positions, mended.triangles, ground.lattice);
  const HitCount hits = count_hits(mesh, {surface, ground.lattice, ground.phantom_from}, kWithout, progress);
  return double(hits.none) / double(std::max<std::size_t>(hits.all(), 1));
}

/// Holds what slabs may stand on in the place of the source.
struct Solid {
  double voxel = 0;  ///< of the diagonal; 0: the source itself
  double lost = 0;   ///< share of it that may be outside the slabs
};

/// One try, all that it says of itself.
struct Attempt {
  Ground ground;
  ConvertReport report;
  CagePtr mesh = nullptr;
};

/// Slabs on the source, or on solids of it with ever larger voxels.
class Attempts {
 public:
  Attempts(const Ground& ground, const RepairedAgain& repaired, const ConvertSettings& settings, double diagonal,
           const ConvertReport& report, std::size_t always, const Progress& progress)
      : lattice_(ground.lattice),
        scanned_area_(ground.scanned_area),
        pages_(ground.mesh.pages()),
        most_(std::max(always, ground.mesh.get().triangles.size())),
        repaired_(repaired),
        settings_(settings),
        diagonal_(diagonal),
        at_first_(report),
        progress_(progress) {}

  [[nodiscard]] std::size_t asked() const noexcept { return static_cast<std::size_t>(settings_.slabs); }
  [[nodiscard]] bool is_few(const Attempt& made) const {
    return made.mesh != nullptr && made.mesh->slab_count() <= asked();
  }
  /// Returns where the source was remeshed already, such voxels are of no use.
  [[nodiscard]] bool is_finer(const Solid& solid) const {
    return at_first_.remesh && solid.voxel < at_first_.remesh->voxel;
  }
  /// Returns the source, or a solid of it, with its slabs; `most`: components that more slabs would take are left out.
  /// Nothing when cancelled, or where the solid cannot be made.
  std::optional<Attempt> make(TriangleMesh&& mesh, const Solid& solid, std::size_t most) const {
    Attempt made = {{Paged(std::move(mesh), pages_), 0, lattice_, scanned_area_}, at_first_};
    TriangleMesh& all = made.ground.mesh.get();
    if (solid.voxel > 0) {
      const double voxel = solid.voxel * diagonal_;
      if (2 * surface_area(all) > double(most_) * voxel * voxel) return std::nullopt;  // two in each square
      if (!remesh_source(all, solid.voxel, Follow::Middle, settings_.show, made.report, progress_)) return std::nullopt;
    }
    made.report.dropped_parts = drop_small_components(all.positions, all.triangles, most);
    made.ground.phantom_from = all.triangles.size();
    made.mesh = certify(made.ground, settings_, diagonal_, solid.lost, made.report, progress_);
    return made;
  }
  /// Returns the same on the source again: it is not kept beside what is worked on.
  std::optional<Attempt> make_again(const Solid& solid, std::size_t most) const {
    malloc_trim(0);                             // what was tried before takes no memory any more
    auto source = repaired_(solid.voxel == 0);  // a solid is made of the source itself
    return source ? make(std::move(*source), solid, most) : std::nullopt;
  }
  /// Returns where too many fibres miss what it stands on, it is made without any loss.
  std::optional<Attempt> with_little_lost(std::optional<Attempt> made, const Solid& solid) const {
    if (!made || !is_few(*made) || !made->ground.tolerant ||
        missed_share(*made->mesh, made->ground, progress_) <= solid.lost)
      return made;
    made.reset();
    return make_again({solid.voxel, 0}, asked());
  }

 private:
  const Lattice lattice_;
  const double scanned_area_;
  const bool pages_;
  const std::size_t most_;  // triangles of a solid
  const RepairedAgain& repaired_;
  const ConvertSettings& settings_;
  const double diagonal_;
  const ConvertReport at_first_;
  const Progress& progress_;
};

CagePtr keep(Attempt&& made, Ground& ground, ConvertReport& report) {
  ground = std::move(made.ground);
  report = std::move(made.report);
  return made.mesh;
}

}  // namespace

CagePtr tolerate(Ground& ground, const RepairedAgain& repaired, const ConvertSettings& settings, double diagonal,
                 ConvertReport& report, const Progress& progress) {
  // Shares of a solid's area that may be outside its slabs: little at first, as patches may replace, and in the end
  // what still leaves something to know it by.
  constexpr double kFew = kMostReplaced, kMany = 0.25;
  constexpr std::array<Solid, 6> kSolids = {
      {{1.0 / 150, kFew}, {0.01, kFew}, {0.02, kFew}, {0.04, kFew}, {0.08, kFew}, {0.08, kMany}}};
  constexpr std::size_t kAlways = 20'000;  // triangles that a solid may have, however few the source has
  const Attempts attempts(ground, repaired, settings, diagonal, report, kAlways, progress);
  const Solid source = {0, kFew};
  std::optional<Attempt> best =
      attempts.with_little_lost(attempts.make(std::move(ground.mesh).take(), source, attempts.asked()), source);
  if (!best) return nullptr;  // cancelled
  const std::string why = best->report.not_certified;
  const std::size_t held = best->mesh != nullptr ? best->mesh->slab_count() : 0;
  for (const Solid& solid : kSolids) {
    if (attempts.is_few(*best) || progress.cancelled()) break;
    if (attempts.is_finer(solid)) continue;
    std::optional<Attempt> made = attempts.with_little_lost(attempts.make_again(solid, attempts.asked()), solid);
    if (!made || made->mesh == nullptr || (!attempts.is_few(*made) && best->mesh != nullptr)) continue;
    made->report.not_certified = why;
    made->report.slabs_that_hold = held;
    best = std::move(made);
  }
  best->report.is_fewest = best->mesh != nullptr && !attempts.is_few(*best);
  return keep(std::move(*best), ground, report);
}

CagePtr stand_on_a_solid(Ground& ground, const RepairedAgain& repaired, const ConvertSettings& settings,
                         double diagonal, ConvertReport& report, const Progress& progress) {
  // Each has a little less of the source than the one before; 0.02 of a head is a nose.
  std::vector<Solid> solids = {{1.0 / 150}, {0.01}, {0.02}, {0.04}};
  if (report.remesh) solids.insert(solids.begin(), {report.remesh->voxel});
  constexpr std::size_t kAlways = 100'000;                               // triangles that a solid may have: about 10 s
  constexpr std::size_t kAll = std::numeric_limits<std::size_t>::max();  // no component is too small
  const std::string why = report.not_certified;
  const Attempts attempts(ground, repaired, settings, diagonal, report, kAlways, progress);
  ground.mesh.rest();  // each is made of the source again
  for (const Solid& solid : solids) {
    if (progress.cancelled()) break;
    if (attempts.is_finer(solid)) continue;
    std::optional<Attempt> made = attempts.make_again(solid, kAll);
    if (!made || made->mesh == nullptr) continue;
    made->report.not_certified = why;
    return keep(std::move(*made), ground, report);
  }
  return nullptr;
}

}  // namespace relief::detail
