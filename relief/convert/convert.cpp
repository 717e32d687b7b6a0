#include <relief/base/cpu_time.h>
#include <relief/base/try.h>
#include <relief/convert/convert.h>
#include <relief/convert/failures.h>
#include <relief/convert/modes.h>
#include <relief/convert/prepare/strays.h>
#include <relief/convert/report.h>
#include <relief/convert/sample/coverage.h>
#include <relief/convert/sample/distance.h>
#include <relief/convert/sample/resolution.h>
#include <relief/convert/sample/sampled_model.h>
#include <relief/convert/sample/source_rays.h>
#include <relief/convert/stage_meshes.h>
#include <relief/convert/support/parallel.h>
#include <relief/convert/support/words.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <new>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

namespace relief {
namespace {

using namespace detail;

/// Adds phases to a report: time from one call to the next, and CPU time of the whole process.
class PhaseClock {
 public:
  explicit PhaseClock(std::vector<ConvertReport::Phase>& phases) : phases_(phases) {}
  void phase_done(std::string_view name) {
    phases_.push_back({std::string(name), watch_.cpu(), watch_.wall()});
    watch_ = {};
  }

 private:
  std::vector<ConvertReport::Phase>& phases_;
  Stopwatch watch_;
};

// What settings may be; all but the counts are shares of the diagonal.
constexpr Range kSlabs = {4, 1'000'000};
constexpr Range kIntervals = {1, kMaxIntervals};
constexpr Range kErrors = {1e-7, 1};    // a sample is exact to 6e-8 of its fibre, which may be as long as the diagonal
constexpr Range kVoxels = {1e-5, 0.1};  // finer than any source can take; hardly a shape is left
constexpr Range kThicknesses = {kUsualError, 1};  // shorter fibres hold no more than is missed anyway

Status check(const ConvertSettings& settings) {
  const auto is_free_or_in = [](Range range, double value) { return value == 0 || range.holds(value); };
  if (!kSlabs.holds(settings.slabs)) return outside_range(Setting::Slabs, settings.slabs, kSlabs);
  if (!is_free_or_in(kIntervals, settings.intervals))
    return outside_range(Setting::Intervals, settings.intervals, kIntervals);
  if (settings.error && !kErrors.holds(*settings.error)) return outside_range(Setting::Error, *settings.error, kErrors);
  if (!is_free_or_in(kIntervals, settings.colour_intervals))
    return outside_range(Setting::ColourIntervals, settings.colour_intervals, kIntervals);
  if (settings.remesh && !is_free_or_in(kVoxels, *settings.remesh))
    return outside_range(Setting::Voxel, *settings.remesh, kVoxels);
  if (settings.mode == Mode::Preview) return no_mode_to_convert_to();
  if (!kThicknesses.holds(settings.thickness))
    return outside_range(Setting::Thickness, settings.thickness, kThicknesses);
  return {};
}

/// Of its arrays.
std::size_t bytes_of(const TriangleMesh& mesh) noexcept {
  const auto bytes = [](const auto&... arrays) { return (std::span(arrays).size_bytes() + ...); };
  return bytes(mesh.positions, mesh.triangles, mesh.colours, mesh.material_of, mesh.uvs);
}

/// Returns whether the source as it was read and what was made of it are to lie in a file while they are not needed:
/// small ones leave room nevertheless is made meanwhile.
bool is_short_of_memory(const ConvertSettings& settings, const TriangleMesh& as_read, const TriangleMesh& made) {
  return settings.sample_memory && bytes_of(as_read) + bytes_of(made) > *settings.sample_memory / 2;
}

/// What no slab holds is met by no fibre: as many more count as never met as its share of the source's visible area.
void report_hits(const HitCount& hits, ConvertReport& report) {
  const double share = report.coverage.share;
  const auto missing =
      share > 0 ? static_cast<std::size_t>(std::llround(double(hits.all()) * (1 - share) / share)) : hits.all();
  report.fibres_cast = hits.all() + missing;
  report.hits_single = hits.single;
  report.hits_none = hits.none + missing;
  report.hits_missing = missing;
  report.hits_several = hits.several;
}

/// Returns the triangles of a mended source that are not fill.
std::span<const Face> scanned(const Ground& ground) {
  return std::span(ground.mesh.get().triangles).first(ground.phantom_from);
}

/// `finest`: of each slab, the n up to which the source has detail; only with a given n, which may lose it.
void report_coarse(std::span<const Farthest> there, std::span<const Farthest> back, std::span<const int> finest,
                   const ConvertSettings& settings, double of_diagonal, ConvertReport& report) {
  const double aim = settings.error.value_or(kUsualError);
  if (settings.intervals == 0) report.error = aim;
  for (std::size_t s = 0; s < there.size(); ++s) {
    const double most = std::max(there[s].distance, back[s].distance) * of_diagonal;
    if (most <= aim * kAsGood || (settings.intervals > 0 && settings.intervals >= finest[s])) continue;
    ++report.slabs_too_coarse;
    report.too_coarse_most = std::max(report.too_coarse_most, most);
  }
}

void report_thickness(const SlabMesh& mesh, double diagonal, ConvertReport& report) {
  std::vector<double> lengths;
  for (const Fibre& fibre : mesh.fibres()) lengths.push_back(length(fibre.direction()) / diagonal);
  std::sort(lengths.begin(), lengths.end());
  report.thickness_min = lengths.front();
  report.thickness_median = lengths[lengths.size() / 2];
}

/// Refuses a source so far from the origin that its triangles are no larger than what doubles tell apart there: rays
/// and exact tests would find each of them to meet all those around it.
Status check_resolution(const TriangleMesh& mesh, const Box3d& box, double room, const Lattice& lattice) {
  constexpr double kLeast = 4;  // lattice steps
  double farthest = 0;
  for (std::size_t k = 0; k < 3; ++k) farthest = std::max({farthest, std::abs(box.low[k]), std::abs(box.high[k])});
  if ((farthest + room) * 0x1p-51 < lattice.step) return {};  // it is the lattice that sets the step
  const double across = std::sqrt(2 * surface_area(mesh) / double(mesh.triangles.size()));
  if (across >= kLeast * lattice.step) return {};
  return too_far_from_the_origin(farthest, across);
}

/// Adds corners of the source: where one lies far off in a thin part, the places spread by area are few. The mended
/// source is needed only then.
void add_corners(const TriangleMesh& as_read, Ground& ground, double across, ConvertReport& report,
                 const Progress& progress) {
  using Coverage = ConvertReport::Coverage;
  Coverage& coverage = report.coverage;
  if (report.from_source.max <= Coverage::kNear && coverage.hidden == 0) {
    coverage.farthest = report.from_source.max;
    return;
  }
  const TriangleMesh& mended = ground.mesh.get();
  const SourceRays rays(mended.positions, mended.triangles, ground.lattice);
  const auto is_far = [](const SourcePlace&, double away) { return away > Coverage::kNear; };
  const Coverage corners =
      measure_coverage(corners_of(as_read), {mended, rays, ground.lattice, across, is_far}, progress);
  ground.mesh.rest();
  // What has no place has less of the area than one.
  if (corners.share < 1 && coverage.share == 1) {
    coverage.missing_near = corners.missing_near;
    coverage.missed = 1;
    coverage.share = 1 - 1 / double(std::max(coverage.places, coverage.missed));
  }
  // No farther from the model than both ways together.
  coverage.farthest = std::max(coverage.farthest, corners.farthest) + report.from_mended.max;
}

/// Returns by how much of the diagonal the source may have been moved aside: vertices by repair, all by voxels.
double moved_by(const ConvertReport& report) {
  const double moved = std::max(
      {report.moved_most, report.skin ? report.skin->moved_most : 0, report.remesh ? report.remesh->voxel : 0});
  return std::min(moved, ConvertReport::Coverage::kNear);
}

/// Returns whether repair left vertices or triangles that are not the source's own and do not fill its openings.
bool is_changed(const ConvertReport& report) noexcept {
  return report.moved_vertices + report.replaced_triangles + report.truncated_spikes > 0 || report.remesh ||
         (report.skin && report.skin->repaired > 0);
}

/// Returns how far the surface that the slabs stand on lies from the source at its corners and in the middles of its
/// triangles, lattice steps. Corners of the source's own lie on it, and unless there may be patches between them, so
/// does what they hold. Without meaning when cancelled. Runs on all threads.
double farthest_off(const TriangleMesh& mended, std::span<const Face> faces, const TriangleMesh& as_read,
                    bool maybe_patched, const SourceRays& source, const Lattice& lattice, const Progress& progress) {
  const auto key = [&](Vec3d p) {
    const LatticePoint at = snap(lattice.to_lattice(p));
    return std::array{at.x, at.y, at.z};
  };
  std::vector<decltype(key({}))> own;
  own.reserve(as_read.positions.size());
  for (const Vec3d p : as_read.positions)
    if (is_finite(p)) own.push_back(key(p));
  std::ranges::sort(own);
  const auto off = [&](Vec3d p) { return source.nearest(lattice.to_lattice(p)).distance; };
  constexpr std::size_t kTogether = 4096;  // corners, or triangles: one answer for all of them
  const auto greatest = [&](std::size_t count, auto&& of) {
    std::vector<double> most((count + kTogether - 1) / kTogether, 0.0);
    for_all(most.size(), 1, progress, [&](std::size_t block) {
      for (std::size_t k = block * kTogether; k < std::min(count, (block + 1) * kTogether); ++k)
        most[block] = std::max(most[block], of(k));
    });
    return most.empty() ? 0.0 : std::ranges::max(most);
  };
  std::vector<std::uint8_t> is_moved(mended.positions.size());  // of the corners of the faces, not of fill triangles
  for (const Face& f : faces)
    for (const std::uint32_t v : f) is_moved[v] = 1;
  const double corners = greatest(is_moved.size(), [&](std::size_t v) {
    const bool is_own = is_moved[v] == 0 || std::ranges::binary_search(own, key(mended.positions[v]));
    is_moved[v] = is_own ? 0 : 1;
    return is_own ? 0.0 : off(mended.positions[v]);
  });
  const double middles = greatest(faces.size(), [&](std::size_t k) {
    const Face& f = faces[k];
    if (!maybe_patched && is_moved[f[0]] + is_moved[f[1]] + is_moved[f[2]] == 0) return 0.0;
    return off((mended.positions[f[0]] + mended.positions[f[1]] + mended.positions[f[2]]) / 3.0);
  });
  return std::max(corners, middles);
}

/// Returns the mode that the shell and what it has of the source allow. Errors: Unfoldable where another one was
/// requested.
Result<Mode> mode_of(const Ground& ground, const ConvertSettings& settings, const ConvertReport& report) {
  if (!ground.tolerant && is_of_the_source(report)) return Mode::Certified;
  if (settings.mode != Mode::Certified) return Mode::Tolerant;
  return certified_something_else(report);
}

// Model units across: between them the eighth power of a length is a normal double.
constexpr Range kSizes = {1e-36, 1e36};

Status check_size(double across) {
  if (kSizes.holds(across)) return {};
  return size_out_of_bounds(across, kSizes);
}

Result<Conversion> convert_checked(TriangleMesh&& given, const ConvertSettings& settings, const Progress& progress) {
  Conversion result;
  ConvertReport& report = result.report;
  PhaseClock clock(report.phases);

  report.given_triangles = given.triangles.size();
  report.slabs_asked = static_cast<std::size_t>(settings.slabs);
  report.error_asked = settings.error.has_value();
  RELIEF_TRY(auto repaired, repair(given, progress));
  report.repair = repaired.report;
  RELIEF_CHECK(check_size(diagonal(bounds(repaired.mesh))));
  report.strays = leave_out_strays(repaired.mesh);
  show_components(settings.show, Stage::Repaired, repaired.mesh);
  clock.phase_done("repair");
  const double scanned_area = surface_area(repaired.mesh);
  if (settings.remesh) {
    RELIEF_CHECK(remesh_source(repaired.mesh, *settings.remesh, Follow::Skin, settings.show, report, progress));
    if (progress.cancelled()) return cancelled(Work::Conversion);
    clock.phase_done("remesh");
  }
  report.source_triangles = repaired.mesh.triangles.size();
  report.parts.count = report.repair.parts - report.strays.components;

  const Box3d box = bounds(repaired.mesh);
  const double across = diagonal(box);
  RELIEF_CHECK(check_size(across));
  const bool pages = is_short_of_memory(settings, given, repaired.mesh);
  const std::vector<SourcePlace> places = places_of(given);
  Paged<TriangleMesh> source(std::move(given), pages);
  source.rest();
  Ground ground{Paged(std::move(repaired.mesh), pages), report.source_triangles,
                Lattice::around(box, kWhileMade * settings.thickness * across), scanned_area};
  RELIEF_CHECK(check_resolution(ground.mesh.get(), box, kWhileMade * settings.thickness * across, ground.lattice));
  const auto repaired_again = [&](bool remeshed) -> Result<TriangleMesh> {
    RELIEF_TRY(auto made, repair(source.get(), progress));
    source.rest();
    TriangleMesh again = std::move(made.mesh);
    leave_out_strays(again);
    if (ConvertReport ignored; remeshed && settings.remesh)
      RELIEF_CHECK(remesh_source(again, *settings.remesh, Follow::Skin, {}, ignored, progress));
    return again;
  };
  std::shared_ptr<const SlabMesh> mesh = settings.mode == Mode::Tolerant
                                             ? tolerate(ground, repaired_again, settings, across, report, progress)
                                             : certify(ground, settings, across, 0, report, progress);
  if (mesh == nullptr && !settings.mode && !progress.cancelled())
    mesh = stand_on_a_solid(ground, repaired_again, settings, across, report, progress);
  clock.phase_done("certify");
  if (progress.cancelled()) return cancelled(Work::Conversion);
  if (mesh == nullptr) return no_shell(report, settings);
  const Lattice& lattice = ground.lattice;
  std::optional<SourceRays> surface(std::in_place, ground.mesh.get().positions, ground.mesh.get().triangles, lattice);
  clock.phase_done("hierarchy");

  report.slabs = mesh->slab_count();
  report_thickness(*mesh, across, report);

  progress("sample", 0);
  HitCount hits;
  const SampledSurface sampled = {
      {*surface, lattice, ground.phantom_from}, ground.mesh.get().positions, scanned(ground), ground.tolerant};
  RELIEF_TRY(result.model.head, sample_model(std::move(mesh), sampled, settings, across, hits, progress));
  report.clay = measure_clay(*result.model.head, across);
  clock.phase_done("sample");

  progress("measure", 0);
  const double share = lattice.step / across;
  const auto relative = [&](const Measured& m) {
    return Distance{m.distance.rms * share, m.distance.max * share, m.distance.points};
  };
  const MeasuredSurface made(*result.model.head, lattice, progress);
  // A fibre that meets nothing has its sample from its neighbours.
  const auto samples = hits.none > 0 ? MeasuredSurface::Samples::Anywhere : MeasuredSurface::Samples::OnIt;
  {
    const double reach = ConvertReport::Coverage::kNear * across, moved = moved_by(report) * across;
    const auto is_missing = [&](const SourcePlace& place, double) {
      LocateHint hint;
      return !made.answers({place.at, place.normal * reach}, *surface, moved, hint);
    };
    report.coverage = measure_coverage(places, {ground.mesh.get(), *surface, lattice, across, is_missing}, progress);
    const Measured there = made.to(*surface, samples, progress);
    std::vector<int> finest;
    if (settings.intervals > 0) finest = finest_intervals(result.model.head->slab_mesh(), sampled.source);
    surface.reset();
    const Measured back = made.from(ground.mesh.get().positions, scanned(ground), progress);
    if (progress.cancelled()) return cancelled(Work::Conversion);
    report.to_mended = relative(there);
    report.from_mended = relative(back);
    report_coarse(there.slabs, back.slabs, finest, settings, share, report);
  }
  const std::size_t mended_triangles = ground.mesh.get().triangles.size();
  ground.mesh.rest();
  {
    const TriangleMesh& as_read = source.get();
    report.from_source = relative(made.from(as_read.positions, as_read.triangles, progress));
    add_corners(as_read, ground, across, report, progress);
    const SourceRays rays(as_read.positions, as_read.triangles, lattice);
    report.to_source = relative(made.to(rays, samples, progress));
    report.coverage.beyond = report.to_source.max;
    const bool is_far = report.to_source.max > ConvertReport::Coverage::kNear;
    if (is_far || is_changed(report)) {
      const bool maybe_patched = is_far || report.replaced_triangles + report.truncated_spikes > 0;
      report.coverage.beyond =
          share * farthest_off(ground.mesh.get(), scanned(ground), as_read, maybe_patched, rays, lattice, progress);
      ground.mesh.rest();
    }
    clock.phase_done("measure");
    if (progress.cancelled()) return cancelled(Work::Conversion);

    if (as_read.has_colour()) {
      progress("colour", 0);
      RELIEF_TRY(result.model.head, add_colours(result.model.head, rays, lattice, as_read, settings, progress));
      clock.phase_done("colour");
    }
  }
  source = {};
  report_hits(hits, report);
  RELIEF_TRY(const Mode mode, mode_of(ground, settings, report));
  if (mode == Mode::Tolerant && report.not_certified.empty()) report.not_certified = why_tolerant(report);
  result.model.info = {.mode = mode, .unit = settings.unit, .source = {}, .source_diagonal = across};
  report.notes = notes_of(report, settings, result.model.info, mended_triangles);

  progress("measure", 1);
  result.mended = std::move(ground.mesh).take();
  result.mended.phantom_from = ground.phantom_from;
  return result;
}

}  // namespace

Result<Conversion> convert(TriangleMesh source, const ConvertSettings& settings, const Progress& progress) {
  RELIEF_CHECK(check(settings));
  const std::size_t triangles = source.triangles.size();
  try {
    return convert_checked(std::move(source), settings, progress);
  } catch (const std::bad_alloc&) {
    return not_enough_memory(triangles, settings.slabs);
  }
}

}  // namespace relief
