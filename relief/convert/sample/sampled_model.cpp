#include <relief/base/paged_memory.h>
#include <relief/base/try.h>
#include <relief/convert/failures.h>
#include <relief/convert/sample/distance.h>
#include <relief/convert/sample/resolution.h>
#include <relief/convert/sample/sampled_model.h>

#include <algorithm>
#include <array>
#include <bit>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

namespace relief::detail {
namespace {

using CagePtr = std::shared_ptr<const SlabMesh>;

/// Returns how fine the colour layer is: as the source's colours ask for, and as a given n; bounded for very many
/// slabs.
int colour_grid(const ConvertSettings& settings, const SlabMesh& mesh, const SourceRays& surface,
                const Lattice& lattice, const TriangleMesh& source) {
  constexpr std::size_t kMost = 20'000'000;  // samples
  if (settings.colour_intervals > 0) return settings.colour_intervals;
  const auto given = static_cast<int>(std::bit_ceil(static_cast<unsigned>(settings.intervals)));
  int m = std::max(given, colour_intervals(mesh, surface, lattice, source));
  while (m > 1 && sample_count(m) * mesh.slab_count() > kMost) m /= 2;
  return m;
}

/// Returns memory for samples on these grids: `most` bytes of ordinary memory for samples and slabs. Empty where that
/// is known not to suffice.
SampleMemory memory_for(const std::vector<int>& intervals, bool kept, std::optional<std::size_t> most) {
  constexpr std::size_t kSlab = 128;  // of what a slab takes beside its samples
  std::size_t all = 0, limit = most.value_or(PagedMemory::kNoLimit);
  limit -= std::min(limit, kSlab * intervals.size());
  for (const int n : intervals) all += Tile::padded(n) * sizeof(float) + Tile::kBeside;
  if (kept && all > limit) limit = 0;
  return {most ? std::make_shared<PagedMemory>(limit) : nullptr, std::make_shared<PagedMemory>(limit)};
}

/// Returns the displacement of every slab, and where the openings are, on grids that `choose` makes of these; none
/// keeps them. `marks_misses`: what meets nothing is marked like what meets the source several times.
Result<SnapshotPtr> sample_grids(CagePtr mesh, const SampleSource& source, std::vector<int> intervals,
                                 const std::function<int(const SlabSamples&)>& choose, bool marks_misses,
                                 std::optional<std::size_t> most, HitCount& hits, const Progress& progress) {
  RELIEF_TRY(SlabMesh finest, mesh->with_intervals(intervals));
  mesh.reset();
  const SampleMemory memory = memory_for(intervals, !choose, most);
  SampledAlpha sampled = sample_alpha(finest, source, choose, memory, progress);
  if (progress.cancelled()) return cancelled(Work::Conversion);
  hits = sampled.hits;
  intervals = std::move(sampled.intervals);
  RELIEF_TRY(SlabMesh chosen, std::move(finest).with_intervals(intervals));
  mesh = std::make_shared<const SlabMesh>(std::move(chosen));
  if (!settle_alpha(*mesh, source, sampled.slabs, memory, progress)) return cancelled(Work::Conversion);

  SnapshotDraft draft(Snapshot::make(mesh, [&](SlabId s) {
    const std::shared_ptr<Tile> tile = std::move(sampled.slabs[s].tile);
    constrain(*mesh, Layer::Displacement, s, *tile);
    return tile;
  }));
  const auto add_marks = [&](Layer layer, SlabId s, auto&& marked) {
    auto tile = Tile::make(layer, intervals[s], 0.0F, memory.tiles);
    for (std::size_t k = 0; k < tile->size(); ++k) tile->plane()[k] = marked(k) ? 1.0F : 0.0F;
    constrain(*mesh, layer, s, *tile);
    tile->rest();
    draft.put(layer, s, std::move(tile));
  };
  const auto any = [&](auto&& has) { return std::any_of(sampled.slabs.begin(), sampled.slabs.end(), has); };
  if (any([](const SlabAlpha& slab) { return !slab.is_void.empty(); }))
    draft.add_layer(Layer::Void, kOwnIntervals, 0.0F);
  const auto is_folded = [&](Met met) { return met == Met::Often || (marks_misses && met != Met::Once); };
  const bool folded = sampled.hits.several > 0 || (marks_misses && sampled.hits.none > 0);
  if (folded) draft.add_layer(Layer::Folded, kOwnIntervals, 0.0F);
  for (SlabId s = 0; s < mesh->slab_count(); ++s) {
    const SlabAlpha& slab = sampled.slabs[s];
    if (!slab.is_void.empty()) add_marks(Layer::Void, s, [&](std::size_t k) { return slab.is_void[k] != 0; });
    if (folded && !slab.met.empty()) add_marks(Layer::Folded, s, [&](std::size_t k) { return is_folded(slab.met[k]); });
    memory.scratch->rest(slab.met.size() + slab.is_void.size());
  }
  return draft.finish();
}

/// Doubles n where the surface does not keep to the error: in the slab, or in the one that sets the samples of the edge
/// where it is farthest off. False where nothing is left to double.
bool refine(const SlabMesh& mesh, std::span<const Farthest> there, std::span<const Farthest> back, double error,
            std::vector<int>& intervals) {
  std::vector<std::uint8_t> finer(intervals.size(), 0);
  for (SlabId s = 0; s < mesh.slab_count(); ++s)
    for (const Farthest& f : {there[s], back[s]}) {
      if (f.distance <= error * kAsGood) continue;
      const int n = mesh.intervals(s);
      const std::array<double, 3> weights = {1 - double(f.u) - double(f.v), double(f.u), double(f.v)};
      SlabId to_blame = s;
      for (std::size_t k = 0; k < weights.size(); ++k) {
        const SlabId other = mesh.slabs()[s].neighbours[k];
        if (other != kNoSlab && mesh.intervals(other) < n && weights[k] * mesh.intervals(other) < 1) to_blame = other;
      }
      finer[to_blame] = 1;
    }
  bool changed = false;
  for (SlabId s = 0; s < mesh.slab_count(); ++s)
    if (finer[s] != 0 && 2 * mesh.intervals(s) <= kMaxIntervals) {
      intervals[s] = 2 * mesh.intervals(s);
      changed = true;
    }
  return changed;
}

}  // namespace

Result<SnapshotPtr> sample_model(std::shared_ptr<const SlabMesh> cage, const SampledSurface& surface,
                                 const ConvertSettings& settings, double diagonal, HitCount& hits,
                                 const Progress& progress) {
  const SampleSource& source = surface.source;
  std::vector<int> intervals(cage->slab_count(), settings.intervals);
  const double error = settings.error.value_or(kUsualError) * diagonal / source.lattice.step;
  std::function<int(const SlabSamples&)> choose;
  if (settings.intervals == 0) {
    intervals = finest_intervals(*cage, source);
    choose = [error](const SlabSamples& samples) { return coarsest_intervals(samples, error); };
  }
  RELIEF_TRY(SnapshotPtr model, sample_grids(std::move(cage), source, intervals, choose, surface.marks_misses,
                                             settings.sample_memory, hits, progress));
  while (settings.error && settings.intervals == 0) {
    const MeasuredSurface made(*model, source.lattice, progress);
    const Measured there = made.to(source.surface, MeasuredSurface::Samples::OnIt, progress);
    const Measured back = made.from(surface.points, surface.triangles, progress);
    if (progress.cancelled()) return cancelled(Work::Conversion);
    cage = model->shared_slab_mesh();
    for (SlabId s = 0; s < cage->slab_count(); ++s) intervals[s] = cage->intervals(s);
    if (!refine(*cage, there.slabs, back.slabs, error, intervals)) break;
    model.reset();
    RELIEF_TRY(model, sample_grids(std::move(cage), source, intervals, {}, surface.marks_misses, settings.sample_memory,
                                   hits, progress));
  }
  hits += count_hits(model->slab_mesh(), source, hits.all(), progress);
  if (progress.cancelled()) return cancelled(Work::Conversion);
  return model;
}

Result<SnapshotPtr> add_colours(const SnapshotPtr& model, const SourceRays& surface, const Lattice& lattice,
                                const TriangleMesh& source, const ConvertSettings& settings, const Progress& progress) {
  const SlabMesh& mesh = model->slab_mesh();
  const int m = colour_grid(settings, mesh, surface, lattice, source);
  const SampleNumbers numbers(mesh, m);
  SnapshotDraft draft(model);
  draft.add_layer(Layer::Colour, m, 1.0F);
  const std::shared_ptr<PagedMemory> memory = model->tile(Layer::Displacement, 0).memory();
  std::vector<ColourTile> tiles;
  tiles.reserve(mesh.slab_count());
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    const auto tile = Tile::make(Layer::Colour, m, 1.0F, memory);
    tiles.push_back({tile.get(), tile->plane16(0)});
    draft.put(Layer::Colour, s, tile);
    tile->rest();
  }
  if (!sample_colour(*model, numbers, surface, lattice, source, tiles, progress)) return cancelled(Work::Conversion);
  return draft.finish();
}

}  // namespace relief::detail
