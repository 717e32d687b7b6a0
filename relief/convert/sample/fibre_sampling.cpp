#include <relief/base/free_memory.h>
#include <relief/convert/sample/fibre_sampling.h>
#include <relief/convert/support/parallel.h>
#include <relief/convert/support/sort_unique.h>
#include <relief/core/query.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <mutex>
#include <numeric>
#include <optional>
#include <utility>

namespace relief::detail {
namespace {

/// How far beyond its ends, in lengths of the fibre, a fibre looks for a surface that passes it by.
constexpr double kBeyond = 0.5;
/// A crossing this little outside the fibre, in its lengths, is rounding of the fibre's ends.
constexpr double kRounding = 1e-6;
/// Lengths of the fibre: the surface differs by so much between neighbouring samples where it is steep, so no nearer
/// crossing is preferred to the outermost.
constexpr double kSteep = 0.1;
/// Lengths of the fibre: a fill that no sample changes by more has settled. With the longest fibres, 0.2 of the
/// diagonal, that is a fiftieth of the usual error.
constexpr double kSettled = 1e-5;
/// Sweeps over what is filled: each is as long as the last, so wide gaps stay a little short of settled.
constexpr int kMostSweeps = 60;
/// Where nothing around says more: half way along the fibre.
constexpr float kHalfWay = 0.5F;
/// Lengths of the fibre, each way from a sample: where it looks for the coloured source, before it takes the nearest
/// place of all. A crossing farther off is that of another sheet.
constexpr double kColourNear = 0.25;
/// Of the progress that sampling shows: casting the fibres, the rest is what settles them.
constexpr double kCast = 0.6;

/// Returns the fibre of a sample.
Line fibre_at(const SlabCorners& corners, const Lattice& lattice, GridPoint at, int n) noexcept {
  const auto w = weights(n, at);
  return fibre_at(corners, lattice, {double(w[0]) / n, double(w[1]) / n, double(w[2]) / n});
}

constexpr std::array<GridPoint, 6> kSteps = {{{1, 0}, {0, 1}, {-1, 1}, {-1, 0}, {0, -1}, {1, -1}}};
constexpr bool on_grid(GridPoint p, int n) noexcept { return p.i >= 0 && p.j >= 0 && p.i + p.j <= n; }
/// Returns the place of a sample in its tile.
constexpr GridPoint grid_point(int n, std::size_t index) noexcept {
  int left = static_cast<int>(index), row = n + 1, j = 0;
  for (; left >= row; ++j) left -= row--;
  return {left, j};
}

bool inside(const Crossing& c) noexcept { return c.t >= -kRounding && c.t <= 1 + kRounding; }

// Two faces of one point, crossed one after the other in the same sense: the fibre runs through their edge or point,
// and is turned aside by rounding. It crosses the one that it is most inside of.
void join_crossings(const SampleSource& source, Crossings& found) {
  std::size_t kept = 0;
  for (std::size_t k = 0; k < found.count; ++k) {
    const bool again = kept > 0 && inside(found.items[k]) && inside(found.items[kept - 1]) &&
                       found.items[k].front == found.items[kept - 1].front &&
                       source.surface.share_a_point(found.items[k].triangle, found.items[kept - 1].triangle);
    if (!again)
      found.items[kept++] = found.items[k];
    else if (found.items[k].inside > found.items[kept - 1].inside)
      found.items[kept - 1] = found.items[k];
  }
  found.count = kept;
}

/// The crossings of a fibre with the source, those beyond its ends included.
void cross(const SampleSource& source, const Line& line, double from, double to, Crossings& found) {
  source.surface.cross(line.origin, line.direction, from, to, found);
  join_crossings(source, found);
}

/// Casts fibres that follow each other side by side: next() gives each, take(k, fibre, crossings) is told of it.
template <typename Next, typename Take>
void cross_all(const SampleSource& source, std::size_t count, double from, double to, Next&& next, Take&& take) {
  std::array<Line, SourceRays::kTogether> fibres;
  std::array<Crossings, SourceRays::kTogether> found;
  for (std::size_t begin = 0; begin < count; begin += fibres.size()) {
    const auto some = std::span(fibres).first(std::min(fibres.size(), count - begin));
    std::ranges::generate(some, next);
    source.surface.cross(some, from, to, found);
    for (std::size_t k = 0; k < some.size(); ++k) {
      join_crossings(source, found[k]);
      take(begin + k, some[k], found[k]);
    }
  }
}

/// The crossing that a sample takes.
struct Choice {
  Met met = Met::Never;
  Crossing crossing;
};
Choice outermost(const Crossings& crossings) noexcept {
  std::size_t within = 0;
  const Crossing* last = nullptr;
  const Crossing* nearest = nullptr;
  const auto excess = [](const Crossing& c) { return std::max(-c.t, c.t - 1); };
  for (const Crossing& c : crossings.all()) {
    if (inside(c)) {
      ++within;
      if (c.front) last = &c;
    } else if (c.front && (nearest == nullptr || excess(c) < excess(*nearest))) {
      nearest = &c;
    }
  }
  if (last != nullptr) return {within == 1 ? Met::Once : Met::Often, *last};
  if (nearest != nullptr && within == 0) return {Met::Beyond, *nearest};
  return {};
}

float alpha_of(const Crossing& c) noexcept { return static_cast<float>(std::clamp(c.t, 0.0, 1.0)); }

/// The samples of one slab by index.
class OwnField {
 public:
  OwnField(SlabSamples& samples, const SlabCorners& corners, const SampleSource& source)
      : samples_(samples), corners_(corners), source_(source) {}

  [[nodiscard]] Met met(std::size_t k) const noexcept { return samples_.met[k]; }
  [[nodiscard]] float value(std::size_t k) const noexcept { return samples_.alpha[k]; }
  void set(std::size_t k, float value) noexcept { samples_.alpha[k] = value; }
  void take(std::size_t k, const Crossing& c, Vec3d direction) noexcept {
    samples_.alpha[k] = alpha_of(c);
    samples_.steepness[k] = static_cast<float>(dot(source_.surface.normal(c.triangle), direction));
    samples_.is_void[k] = c.triangle >= source_.phantom_from;
  }
  [[nodiscard]] Line line(std::size_t k) const noexcept {
    return fibre_at(corners_, source_.lattice, grid_point(samples_.intervals, k), samples_.intervals);
  }
  [[nodiscard]] static std::pmr::memory_resource* scratch() noexcept { return std::pmr::new_delete_resource(); }
  static std::size_t rest_at(std::size_t) noexcept { return std::numeric_limits<std::size_t>::max(); }
  static void rest_scratch(std::size_t) noexcept {}
  void neighbours(std::size_t k, std::vector<std::size_t>& out) const {
    out.clear();
    const GridPoint at = grid_point(samples_.intervals, k);
    for (const GridPoint step : kSteps)
      if (const GridPoint p = {at.i + step.i, at.j + step.j}; on_grid(p, samples_.intervals))
        out.push_back(sample_index(samples_.intervals, p));
  }

 private:
  SlabSamples& samples_;
  const SlabCorners& corners_;
  const SampleSource& source_;
};

/// The distinct samples of all slabs by number.
class WholeField {
 public:
  WholeField(const SlabMesh& mesh, const SampleSource& source, std::vector<SlabAlpha>& slabs, PagedMemory& scratch)
      : mesh_(mesh), numbers_(mesh, kOwnIntervals), source_(source), slabs_(slabs), scratch_(scratch) {}

  [[nodiscard]] Met met(std::size_t k) const noexcept {
    const SampleCopy at = numbers_.place(k);
    const std::span<const Met> met = slabs_[at.slab].met;
    return met.empty() ? Met::Once : met[sample_index(mesh_.intervals(at.slab), at.at)];
  }
  [[nodiscard]] float value(std::size_t k) const noexcept {
    const SampleCopy at = numbers_.place(k);
    return std::as_const(*slabs_[at.slab].tile).plane()[sample_index(mesh_.intervals(at.slab), at.at)];
  }
  void set(std::size_t k, float value) noexcept {
    for_copies(k, [&](SlabAlpha& slab, std::size_t index) { slab.tile->plane()[index] = value; });
  }
  void take(std::size_t k, const Crossing& c, Vec3d) {
    const std::uint8_t is_void = c.triangle >= source_.phantom_from;
    for_copies(k, [&](SlabAlpha& slab, std::size_t index) {
      slab.tile->plane()[index] = alpha_of(c);
      if (is_void != 0 && slab.is_void.empty()) slab.is_void = scratch_.zeros<std::uint8_t>(slab.tile->size());
      if (!slab.is_void.empty()) slab.is_void[index] = is_void;
    });
  }
  [[nodiscard]] Line line(std::size_t k) const noexcept {
    const SampleCopy at = numbers_.place(k);
    return fibre_at(mesh_.corners(at.slab), source_.lattice, at.at, mesh_.intervals(at.slab));
  }
  /// By all the slabs that have the sample, in a fixed order; duplicates remain.
  void neighbours(std::size_t k, std::vector<std::size_t>& out) const {
    out.clear();
    const SampleCopy at = numbers_.place(k);
    numbers_.for_each_copy(at.slab, at.at, [&](const SampleCopy& copy) {
      for (const GridPoint step : kSteps)
        if (const GridPoint p = {copy.at.i + step.i, copy.at.j + step.j}; on_grid(p, mesh_.intervals(copy.slab)))
          out.push_back(numbers_.of(copy.slab, p));
    });
  }
  [[nodiscard]] const SampleNumbers& numbers() const noexcept { return numbers_; }
  [[nodiscard]] std::pmr::memory_resource* scratch() const noexcept { return &scratch_; }
  /// Lets the slab of a sample rest, and those around it; the first number beyond the slab's.
  std::size_t rest_at(std::size_t k) const noexcept {
    const SlabId s = numbers_.place(k).slab;
    slabs_[s].tile->rest();
    rest_scratch(slabs_[s].met.size());
    return numbers_.begin(s + 1);
  }
  void rest_scratch(std::size_t bytes) const noexcept { scratch_.rest(bytes); }

 private:
  template <typename Visit>
  void for_copies(std::size_t k, Visit&& visit) {
    const SampleCopy at = numbers_.place(k);
    numbers_.for_each_copy(at.slab, at.at, [&](const SampleCopy& copy) {
      visit(slabs_[copy.slab], sample_index(mesh_.intervals(copy.slab), copy.at));
    });
  }

  const SlabMesh& mesh_;
  SampleNumbers numbers_;
  const SampleSource& source_;
  std::vector<SlabAlpha>& slabs_;
  PagedMemory& scratch_;
};

/// Returns where the mean of the neighbours that were met once lies nearer to another crossing than to the outermost:
/// that one.
template <typename Field>
std::optional<Crossing> outvoted(const Field& field, std::size_t k, const SampleSource& source) {
  std::vector<std::size_t> around;
  field.neighbours(k, around);
  double sum = 0;
  int votes = 0;
  for (const std::size_t other : around)
    if (field.met(other) == Met::Once) {
      sum += double(field.value(other));
      ++votes;
    }
  if (votes < 2) return std::nullopt;
  const double mean = sum / votes;
  double nearest = std::abs(double(field.value(k)) - mean);
  if (nearest < kSteep) return std::nullopt;
  Crossings crossings;
  cross(source, field.line(k), -kRounding, 1 + kRounding, crossings);
  std::optional<Crossing> chosen;
  for (const Crossing& c : crossings.all()) {
    if (!c.front || std::abs(c.t - mean) >= nearest) continue;
    nearest = std::abs(c.t - mean);
    chosen = c;
  }
  return chosen;
}

/// A pass through samples by ascending number: rests wherever it comes to another slab.
template <typename Field>
class Resting {
 public:
  explicit Resting(const Field& field) : field_(field) {}
  void at(std::size_t k) noexcept {
    if (k >= next_) next_ = field_.rest_at(k);
  }

 private:
  const Field& field_;
  std::size_t next_ = 0;
};

/// Fills the unknown values from the known ones around them: first ring by ring, then relaxed towards the mean of the
/// neighbours (a discrete Laplace equation). Where a whole part is unknown it gets 1/2. False when cancelled.
template <typename Field>
bool fill(Field& field, std::span<const std::size_t> unknown, const Progress& progress) {
  if (unknown.empty()) return true;
  // What is kept of an unknown sample is far more than the sample itself, so it lies in scratch memory.
  constexpr std::size_t kBlock = 1024, kEach = 64;  // unknown samples, bytes
  const auto rest_after = [&](std::size_t step) {
    if (step % kBlock == 0) field.rest_scratch(kBlock * kEach);
  };
  // Places are the unknown samples and the known ones at their rim; there are fewer than 2^32.
  std::vector<std::size_t> scratch, rim;
  std::size_t links = 0;
  Resting looked(field);
  for (const std::size_t k : unknown) {
    looked.at(k);
    field.neighbours(k, scratch);
    links += scratch.size();
    for (const std::size_t other : scratch)
      if (field.met(other) != Met::Never) rim.push_back(other);
  }
  sort_unique(rim);
  std::pmr::vector<std::size_t> places(field.scratch());
  places.reserve(rim.size() + unknown.size());
  std::ranges::merge(rim, unknown, std::back_inserter(places));
  free_memory(rim);
  const auto place_of = [&](std::size_t k) {
    return static_cast<std::uint32_t>(std::lower_bound(places.begin(), places.end(), k) - places.begin());
  };
  std::pmr::vector<std::uint32_t> around(field.scratch()), begin(field.scratch()), mine(field.scratch()),
      front(unknown.size(), field.scratch()), later(field.scratch()), reached(field.scratch());
  around.reserve(links);
  begin.reserve(unknown.size() + 1);
  mine.reserve(unknown.size());
  later.reserve(unknown.size());
  reached.reserve(unknown.size());
  begin.push_back(0);
  Resting linked(field);
  for (const std::size_t k : unknown) {
    linked.at(k);
    field.neighbours(k, scratch);
    for (const std::size_t other : scratch) around.push_back(place_of(other));
    begin.push_back(static_cast<std::uint32_t>(around.size()));
    mine.push_back(place_of(k));
    rest_after(mine.size());
  }
  std::pmr::vector<float> values(field.scratch());
  std::pmr::vector<std::uint8_t> known(field.scratch());
  values.reserve(places.size());
  known.reserve(places.size());
  Resting read(field);
  for (const std::size_t k : places) {
    read.at(k);
    values.push_back(field.value(k));
    known.push_back(field.met(k) != Met::Never);
    rest_after(values.size());
  }
  std::iota(front.begin(), front.end(), 0U);

  const auto mean = [&](std::size_t u, bool of_known_only) -> std::optional<float> {
    double sum = 0;
    int count = 0;
    for (std::size_t e = begin[u]; e < begin[u + 1]; ++e)
      if (!of_known_only || known[around[e]] != 0) {
        sum += double(values[around[e]]);
        ++count;
      }
    if (count == 0) return std::nullopt;
    return static_cast<float>(sum / count);
  };
  while (!front.empty()) {
    later.clear();
    reached.clear();
    for (std::size_t step = 0; step < front.size(); ++step) {
      const std::uint32_t u = front[step];
      const auto value = mean(u, true);
      if (value) {
        values[mine[u]] = *value;
        reached.push_back(mine[u]);
      } else {
        later.push_back(u);
      }
      rest_after(step);
    }
    if (progress.cancelled()) return false;
    if (reached.empty()) break;
    for (const std::uint32_t k : reached) known[k] = 1;
    std::swap(front, later);
  }
  for (const std::uint32_t u : front) values[mine[u]] = kHalfWay;
  for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
    double change = 0;
    for (std::size_t step = 0; step < unknown.size(); ++step) {
      rest_after(step);
      const std::size_t u = sweep % 2 == 0 ? step : unknown.size() - 1 - step;
      const auto value = mean(u, false);
      if (!value) continue;
      float& old = values[mine[u]];
      change = std::max(change, std::abs(double(*value) - double(old)));
      old = *value;
    }
    if (progress.cancelled()) return false;
    if (change < kSettled) break;
  }
  Resting written(field);
  for (std::size_t u = 0; u < unknown.size(); ++u) {
    written.at(unknown[u]);
    field.set(unknown[u], values[mine[u]]);
    rest_after(u);
  }
  return true;
}

/// Settles what met the source not once; `often` and `never` are sample numbers, ascending.
template <typename Field>
bool settle(Field& field, const SampleSource& source, std::span<const std::size_t> often,
            std::span<const std::size_t> never, const Progress& progress) {
  // One that is chosen has no say in what others choose, so that they may be taken by and by.
  constexpr std::size_t kAtOnce = 1 << 14, kTogether = 64;  // neighbours mostly lie in one slab
  std::vector<std::optional<Crossing>> chosen;
  for (; !often.empty(); often = often.subspan(chosen.size())) {
    chosen.assign(std::min(often.size(), kAtOnce), {});
    const bool all = for_all(chosen.size(), 512, progress, [&](std::size_t o) {
      chosen[o] = outvoted(field, often[o], source);
      if (o % kTogether == 0) field.rest_at(often[o]);
    });
    if (!all) return false;
    Resting taken(field);
    for (std::size_t o = 0; o < chosen.size(); ++o) {
      taken.at(often[o]);
      if (const std::optional<Crossing>& c = chosen[o]) field.take(often[o], *c, field.line(often[o]).direction);
    }
  }
  free_memory(chosen);
  return fill(field, never, progress);
}

/// Holds what the fibres of one slab met, before it is settled.
struct CastSlab {
  SlabSamples samples;
  std::vector<std::size_t> often, never;  ///< samples that met the source so, ascending
  std::vector<Crossing> outermost_of_often;

  CastSlab(const SlabCorners& corners, int n, const SampleSource& source) : samples(n) {
    OwnField field(samples, corners, source);
    GridPoint at = {0, 0};
    const auto next = [&] {
      const Line fibre = fibre_at(corners, source.lattice, at, n);
      at = at.i + at.j < n ? GridPoint{at.i + 1, at.j} : GridPoint{0, at.j + 1};
      return fibre;
    };
    cross_all(source, sample_count(n), -kBeyond, 1 + kBeyond, next,
              [&](std::size_t k, const Line& fibre, const Crossings& crossings) {
                const Choice choice = outermost(crossings);
                samples.met[k] = choice.met;
                if (choice.met != Met::Never) field.take(k, choice.crossing, fibre.direction);
                if (choice.met == Met::Never) never.push_back(k);
                if (choice.met != Met::Often) return;
                often.push_back(k);
                outermost_of_often.push_back(choice.crossing);
              });
  }
};

}  // namespace

SampleNumbers::SampleNumbers(const SlabMesh& mesh, int m) : mesh_(&mesh), m_(m), begin_(mesh.slab_count() + 1, 0) {
  for (SlabId s = 0; s < mesh.slab_count(); ++s) begin_[s + 1] = begin_[s] + sample_count(intervals(s));
}

SampleCopy SampleNumbers::place(std::size_t number) const noexcept {
  const auto next = std::upper_bound(begin_.begin(), begin_.end(), number);
  const auto s = static_cast<SlabId>(next - begin_.begin() - 1);
  return {s, grid_point(intervals(s), number - begin_[s])};
}

std::vector<SlabSamples> sample_slabs(const SlabMesh& mesh, std::span<const SlabId> slabs, const SampleSource& source,
                                      const Progress& progress) {
  std::vector<SlabSamples> all;
  all.reserve(slabs.size());
  for (const SlabId s : slabs) all.emplace_back(mesh.intervals(s));
  const bool done = for_all(slabs.size(), 1, progress, [&](std::size_t k) {
    const SlabCorners corners = mesh.corners(slabs[k]);
    CastSlab cast(corners, mesh.intervals(slabs[k]), source);
    OwnField field(cast.samples, corners, source);
    if (settle(field, source, cast.often, cast.never, progress)) all[k] = std::move(cast.samples);
  });
  if (!done) all.clear();
  return all;
}

SampledAlpha sample_alpha(const SlabMesh& finest, const SampleSource& source,
                          const std::function<int(const SlabSamples&)>& choose, const SampleMemory& memory,
                          const Progress& progress) {
  const SampleNumbers numbers(finest, kOwnIntervals);
  SampledAlpha sampled;
  sampled.slabs.resize(finest.slab_count());
  sampled.intervals.resize(finest.slab_count());
  std::mutex counting;
  const bool cast = for_all(finest.slab_count(), 1, progress, [&](std::size_t slab) {
    const auto s = static_cast<SlabId>(slab);
    const int most = finest.intervals(s);
    const SlabCorners corners = finest.corners(s);
    CastSlab slab_cast(corners, most, source);
    auto& [samples, often, never, outermost_of_often] = slab_cast;
    OwnField field(samples, corners, source);
    HitCount hits;
    numbers.for_each(s, [&](std::size_t, GridPoint p) {
      const Met met = samples.met[sample_index(most, p)];
      ++(met == Met::Once ? hits.single : met == Met::Often ? hits.several : hits.none);
    });
    {
      const std::scoped_lock lock(counting);
      sampled.hits += hits;
    }
    int n = most;
    if (choose) {
      // What the slab's own samples say serves the choice; in the end its neighbours have a say, too.
      if (!settle(field, source, often, never, progress)) return;
      n = choose(samples);
      for (std::size_t o = 0; o < often.size(); ++o)
        field.take(often[o], outermost_of_often[o], field.line(often[o]).direction);
    }
    SlabAlpha& kept = sampled.slabs[slab];
    kept.tile = Tile::make(Layer::Displacement, n, 0.0F, memory.tiles);
    sampled.intervals[slab] = n;
    const auto every = [&](auto&& take) {
      const int step = most / n;
      for (int j = 0; j <= n; ++j)
        for (int i = 0; i + j <= n; ++i) take(sample_index(n, {i, j}), sample_index(most, {i * step, j * step}));
    };
    bool once = true, closed = true;
    every([&](std::size_t to, std::size_t from) {
      kept.tile->plane()[to] = samples.alpha[from];
      once = once && samples.met[from] == Met::Once;
      closed = closed && samples.is_void[from] == 0;
    });
    if (!once) {
      kept.met = memory.scratch->zeros<Met>(kept.tile->size());
      every([&](std::size_t to, std::size_t from) { kept.met[to] = samples.met[from]; });
    }
    if (!closed) {
      kept.is_void = memory.scratch->zeros<std::uint8_t>(kept.tile->size());
      every([&](std::size_t to, std::size_t from) { kept.is_void[to] = samples.is_void[from]; });
    }
    kept.tile->rest();
    memory.scratch->rest(kept.met.size() + kept.is_void.size());
  });
  if (!cast) return {};
  progress("sample", kCast);
  return sampled;
}

bool settle_alpha(const SlabMesh& mesh, const SampleSource& source, std::vector<SlabAlpha>& slabs,
                  const SampleMemory& memory, const Progress& progress) {
  WholeField field(mesh, source, slabs, *memory.scratch);
  std::pmr::vector<std::size_t> often(memory.scratch.get()), never(memory.scratch.get());
  const auto copies = [&](Met met) {
    std::ptrdiff_t count = 0;
    for (const SlabAlpha& slab : slabs) {
      count += std::ranges::count(slab.met, met);
      field.rest_scratch(slab.met.size());
    }
    return static_cast<std::size_t>(count);
  };
  often.reserve(copies(Met::Often));
  never.reserve(copies(Met::Never));
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    if (slabs[s].met.empty()) continue;
    field.numbers().for_each(s, [&](std::size_t k, GridPoint p) {
      const Met met = slabs[s].met[sample_index(mesh.intervals(s), p)];
      if (met == Met::Often) often.push_back(k);
      if (met == Met::Never) never.push_back(k);
    });
    field.rest_scratch(slabs[s].met.size());
  }
  return settle(field, source, often, never, progress);
}

HitCount count_hits(const SlabMesh& mesh, const SampleSource& source, std::size_t already, const Progress& progress) {
  constexpr std::size_t kFibres = 1'000'000;
  HitCount hits;
  if (already >= kFibres || mesh.slab_count() == 0) return hits;
  // The centres of the upright triangles of an n grid: n (n + 1) / 2 in each slab.
  const std::size_t each = (kFibres - already + mesh.slab_count() - 1) / mesh.slab_count();
  int n = 1;
  while (static_cast<std::size_t>(n) * static_cast<std::size_t>(n + 1) / 2 < each) ++n;
  std::mutex counting;
  const bool cast = for_all(mesh.slab_count(), 1, progress, [&](std::size_t k) {
    const SlabCorners corners = mesh.corners(static_cast<SlabId>(k));
    HitCount count;
    int i = 0, j = 0;
    const auto next = [&] {
      const double u = (i + 1.0 / 3) / n, v = (j + 1.0 / 3) / n;
      if (++i + j == n) i = 0, ++j;
      return fibre_at(corners, source.lattice, {1 - u - v, u, v});
    };
    cross_all(source, sample_count(n - 1), -kRounding, 1 + kRounding, next,
              [&](std::size_t, const Line&, const Crossings& crossings) {
                const bool leaves = std::ranges::any_of(crossings.all(), &Crossing::front);
                ++(!leaves ? count.none : crossings.count == 1 ? count.single : count.several);
              });
    const std::scoped_lock lock(counting);
    hits += count;
  });
  return cast ? hits : HitCount{};
}

bool sample_colour(const Snapshot& model, const SampleNumbers& numbers, const SourceRays& source,
                   const Lattice& lattice, const TriangleMesh& coloured, std::span<const ColourTile> tiles,
                   const Progress& progress) {
  const SlabMesh& mesh = model.slab_mesh();
  return for_all(mesh.slab_count(), 1, progress, [&](std::size_t slab) {
    const auto s = static_cast<SlabId>(slab);
    const SlabCorners corners = mesh.corners(s);
    const int n = numbers.intervals(s);
    Crossings crossings;
    numbers.for_each(s, [&](std::size_t, GridPoint p) {
      const Line line = fibre_at(corners, lattice, p, n);
      const double alpha = displacement_at(model, s, double(p.i) / n, double(p.j) / n);
      source.cross(line.origin, line.direction, alpha - kColourNear, alpha + kColourNear, crossings);
      const Crossing* met = nullptr;
      for (const Crossing& c : crossings.all())
        if (met == nullptr || std::abs(c.t - alpha) < std::abs(met->t - alpha)) met = &c;
      Vec3f colour;
      if (met != nullptr) {
        colour = colour_at(coloured, met->triangle, met->weights);
      } else {
        const SourceRays::Nearest nearest = source.nearest(line.origin + line.direction * alpha);
        colour = colour_at(coloured, nearest.triangle, nearest.weights);
      }
      // Each sample has one thread that writes it, in all of its slabs.
      numbers.for_each_copy(s, p, [&](const SampleCopy& copy) {
        std::uint16_t* const red = tiles[copy.slab].planes + sample_index(n, copy.at);
        for (std::size_t channel = 0; channel < 3; ++channel)
          red[channel * tiles[copy.slab].tile->stride()] = to_u16(colour[channel]);
      });
    });
    model.tile(Layer::Displacement, s).rest();
    tiles[s].tile->rest(2);  // with those of its neighbours
  });
}

}  // namespace relief::detail
