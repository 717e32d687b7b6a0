#include <relief/convert/sampling.h>
#include <relief/core/query.h>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

namespace relief::detail {
namespace {

/// How far beyond its ends, in lengths of the fibre, a fibre looks for a surface that passes it by.
constexpr double kBeyond = 0.5;
/// A crossing this little outside the fibre is rounding of the fibre's ends.
constexpr double kRounding = 1e-6;

/// Calls work(k) for all k < count on all threads; false when cancelled.
template <typename Work>
bool for_all(std::size_t count, const Progress& progress, Work&& work) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 512), [&](const tbb::blocked_range<std::size_t>& range) {
    if (progress.cancelled()) return;
    for (std::size_t k = range.begin(); k != range.end(); ++k) work(k);
  });
  return !progress.cancelled();
}

/// The fibre of a sample in lattice coordinates.
struct Line {
  Vec3d origin, direction;
};
Line fibre_at(const SlabMesh& mesh, const Lattice& lattice, SampleCopy at, int n) noexcept {
  const auto w = weights(n, at.at);
  const std::array<double, 3> b = {double(w[0]) / n, double(w[1]) / n, double(w[2]) / n};
  const SlabCorners corners = mesh.corners(at.slab);
  const Vec3d in = lattice.to_lattice(corners.weighted(corners.inner, b));
  return {in, lattice.to_lattice(corners.weighted(corners.outer, b)) - in};
}

/// The numbers of the samples next to one, by all the slabs that have it, in a fixed order; duplicates remain.
void neighbours_of(const SlabMesh& mesh, const SampleNumbers& numbers, SampleCopy at, std::vector<std::uint32_t>& out) {
  out.clear();
  const int n = numbers.intervals();
  constexpr std::array<GridPoint, 6> kSteps = {{{1, 0}, {0, 1}, {-1, 1}, {-1, 0}, {0, -1}, {1, -1}}};
  mesh.for_each_copy(at.slab, n, at.at, [&](const SampleCopy& copy) {
    for (const GridPoint step : kSteps) {
      const GridPoint p = {copy.at.i + step.i, copy.at.j + step.j};
      if (p.i >= 0 && p.j >= 0 && p.i + p.j <= n) out.push_back(static_cast<std::uint32_t>(numbers.of(copy.slab, p)));
    }
  });
}

template <std::size_t N>
std::array<double, N> plus(std::array<double, N> a, const std::array<float, N>& b) noexcept {
  for (std::size_t k = 0; k < N; ++k) a[k] += double(b[k]);
  return a;
}

/// Fills the unknown values from the known ones around them: first ring by ring, then relaxed towards the mean of the
/// neighbours (a discrete Laplace equation). Where a whole part is unknown it gets `otherwise`.
template <std::size_t N>
void fill(const SlabMesh& mesh, const SampleNumbers& numbers, std::vector<std::uint8_t>& known,
          std::vector<std::array<float, N>>& values, const std::array<float, N>& otherwise) {
  std::vector<std::uint32_t> unknown, begin = {0}, around, scratch;
  for (std::uint32_t k = 0; k < values.size(); ++k) {
    if (known[k] != 0) continue;
    unknown.push_back(k);
    neighbours_of(mesh, numbers, numbers.places()[k], scratch);
    around.insert(around.end(), scratch.begin(), scratch.end());
    begin.push_back(static_cast<std::uint32_t>(around.size()));
  }
  if (unknown.empty()) return;
  const auto mean = [&](std::size_t u, bool of_known_only) -> std::optional<std::array<float, N>> {
    std::array<double, N> sum{};
    int count = 0;
    for (std::uint32_t e = begin[u]; e < begin[u + 1]; ++e)
      if (!of_known_only || known[around[e]] != 0) {
        sum = plus(sum, values[around[e]]);
        ++count;
      }
    if (count == 0) return std::nullopt;
    std::array<float, N> result{};
    for (std::size_t k = 0; k < N; ++k) result[k] = static_cast<float>(sum[k] / count);
    return result;
  };
  std::vector<std::uint32_t> front(unknown.size()), later, reached;
  for (std::uint32_t u = 0; u < unknown.size(); ++u) front[u] = u;
  while (!front.empty()) {
    later.clear();
    reached.clear();
    for (const std::uint32_t u : front) {
      const auto value = mean(u, true);
      if (value) {
        values[unknown[u]] = *value;
        reached.push_back(unknown[u]);
      } else {
        later.push_back(u);
      }
    }
    if (reached.empty()) break;
    for (const std::uint32_t k : reached) known[k] = 1;
    std::swap(front, later);
  }
  for (const std::uint32_t u : front) values[unknown[u]] = otherwise;
  for (int sweep = 0; sweep < 60; ++sweep) {
    double change = 0;
    for (std::size_t step = 0; step < unknown.size(); ++step) {
      const std::size_t u = sweep % 2 == 0 ? step : unknown.size() - 1 - step;
      const auto value = mean(u, false);
      if (!value) continue;
      std::array<float, N>& mine = values[unknown[u]];
      for (std::size_t k = 0; k < N; ++k) change = std::max(change, std::abs(double((*value)[k]) - double(mine[k])));
      mine = *value;
    }
    if (change < 1e-5) break;
  }
}

}  // namespace

SampleNumbers::SampleNumbers(const SlabMesh& mesh, int n) : n_(n), numbers_(mesh.slab_count() * sample_count(n)) {
  for (SlabId s = 0; s < mesh.slab_count(); ++s)
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i + j <= n; ++i) {
        SampleCopy owner;
        mesh.for_each_copy(s, n, {i, j}, [&](const SampleCopy& copy) {
          if (owner.slab == kNoSlab) owner = copy;
        });
        std::uint32_t& number = numbers_[s * sample_count(n) + sample_index(n, {i, j})];
        if (owner.slab == s && owner.at == GridPoint{i, j}) {
          number = static_cast<std::uint32_t>(places_.size());
          places_.push_back(owner);
        } else {
          number = static_cast<std::uint32_t>(of(owner.slab, owner.at));
        }
      }
}

SampledField<float> sample_alpha(const SlabMesh& mesh, const SampleNumbers& numbers, const SourceSurface& source,
                                 const Lattice& lattice, const Progress& progress) {
  enum class Met : std::uint8_t { Never, Beyond, Once, Often };
  const std::size_t count = numbers.count();
  const int n = numbers.intervals();
  std::vector<std::array<float, 1>> values(count);
  std::vector<Met> met(count, Met::Never);
  const auto inside = [](const Crossing& c) { return c.t >= -kRounding && c.t <= 1 + kRounding; };
  const auto stored = [](double t) { return static_cast<float>(std::clamp(t, 0.0, 1.0)); };
  SampledField<float> field;

  const bool cast = for_all(count, progress, [&](std::size_t k) {
    const Line line = fibre_at(mesh, lattice, numbers.places()[k], n);
    Crossings crossings;
    source.cross(line.origin, line.direction, -kBeyond, 1 + kBeyond, crossings);
    std::size_t within = 0;
    const Crossing* outermost = nullptr;
    const Crossing* nearest = nullptr;
    const auto excess = [](const Crossing& c) { return std::max(-c.t, c.t - 1); };
    for (const Crossing& c : crossings.all()) {
      if (inside(c)) {
        ++within;
        if (c.front) outermost = &c;
      } else if (c.front && (nearest == nullptr || excess(c) < excess(*nearest))) {
        nearest = &c;
      }
    }
    if (outermost != nullptr) {
      values[k][0] = stored(outermost->t);
      met[k] = within == 1 ? Met::Once : Met::Often;
    } else if (nearest != nullptr && within == 0) {
      values[k][0] = stored(nearest->t);
      met[k] = Met::Beyond;
    }
  });
  if (!cast) return field;
  progress("sample", 0.6);

  // Several crossings: the outermost, unless the mean of the neighbours that were met once lies nearer to another.
  std::vector<std::uint32_t> often;
  for (std::uint32_t k = 0; k < count; ++k)
    if (met[k] == Met::Often) often.push_back(k);
  std::vector<float> chosen(often.size());
  const bool weighed = for_all(often.size(), progress, [&](std::size_t o) {
    const std::uint32_t k = often[o];
    chosen[o] = values[k][0];
    std::vector<std::uint32_t> around;
    neighbours_of(mesh, numbers, numbers.places()[k], around);
    double sum = 0;
    int votes = 0;
    for (const std::uint32_t other : around)
      if (met[other] == Met::Once) {
        sum += double(values[other][0]);
        ++votes;
      }
    if (votes < 2) return;
    const double mean = sum / votes;
    if (std::abs(double(chosen[o]) - mean) < 0.1) return;
    const Line line = fibre_at(mesh, lattice, numbers.places()[k], n);
    Crossings crossings;
    source.cross(line.origin, line.direction, -kRounding, 1 + kRounding, crossings);
    for (const Crossing& c : crossings.all())
      if (c.front && std::abs(c.t - mean) < std::abs(double(chosen[o]) - mean)) chosen[o] = stored(c.t);
  });
  if (!weighed) return field;
  for (std::size_t o = 0; o < often.size(); ++o) values[often[o]][0] = chosen[o];

  std::vector<std::uint8_t> known(count);
  for (std::size_t k = 0; k < count; ++k) {
    known[k] = met[k] != Met::Never;
    field.single += met[k] == Met::Once;
    field.several += met[k] == Met::Often;
  }
  field.none = count - field.single - field.several;
  fill<1>(mesh, numbers, known, values, {0.5F});
  field.values.resize(count);
  for (std::size_t k = 0; k < count; ++k) field.values[k] = values[k][0];
  return field;
}

SampledField<std::array<float, 3>> sample_colour(const Snapshot& model, const SampleNumbers& numbers,
                                                 const SourceSurface& source, const Lattice& lattice,
                                                 const TriangleMesh& coloured, const Progress& progress) {
  const SlabMesh& mesh = model.slab_mesh();
  const int n = numbers.intervals();
  SampledField<std::array<float, 3>> field;
  std::vector<std::array<float, 3>> values(numbers.count());
  std::vector<std::uint8_t> known(numbers.count(), 0);
  const bool cast = for_all(numbers.count(), progress, [&](std::size_t k) {
    const SampleCopy at = numbers.places()[k];
    const Line line = fibre_at(mesh, lattice, at, n);
    const double alpha = displacement_at(model, at.slab, double(at.at.i) / n, double(at.at.j) / n);
    Crossings crossings;
    source.cross(line.origin, line.direction, alpha - 0.25, alpha + 0.25, crossings);
    const Crossing* met = nullptr;
    for (const Crossing& c : crossings.all())
      if (met == nullptr || std::abs(c.t - alpha) < std::abs(met->t - alpha)) met = &c;
    Vec3f colour;
    if (met != nullptr) {
      colour = colour_at(coloured, met->triangle, met->weights);
      known[k] = 1;
    } else {
      const SourceSurface::Nearest nearest = source.nearest(line.origin + line.direction * alpha);
      colour = colour_at(coloured, nearest.triangle, nearest.weights);
    }
    values[k] = {colour.x, colour.y, colour.z};
  });
  if (!cast) return field;
  field.single = static_cast<std::size_t>(std::count(known.begin(), known.end(), std::uint8_t{1}));
  field.none = values.size() - field.single;
  field.values = std::move(values);
  return field;
}

Distances measure_distances(const Snapshot& model, const SourceSurface& source, const Lattice& lattice) {
  constexpr std::size_t kPoints = 12000;
  const SlabMesh& mesh = model.slab_mesh();
  std::size_t total = 0;
  for (SlabId s = 0; s < mesh.slab_count(); ++s)
    total += sample_count(mesh.intervals(s) - 1) + sample_count(mesh.intervals(s));
  const std::size_t stride = std::max<std::size_t>(1, total / kPoints);
  std::vector<Vec3d> points;
  std::size_t counter = 0;
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    const int n = mesh.intervals(s);
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i + j <= n; ++i) {
        if (counter++ % stride == 0) points.push_back(sample_position(model, s, {i, j}));
        if (i + j < n && counter++ % stride == 0)
          points.push_back((sample_position(model, s, {i, j}) + sample_position(model, s, {i + 1, j}) +
                            sample_position(model, s, {i, j + 1})) /
                           3.0);
      }
  }
  std::vector<double> distances(points.size());
  for_all(points.size(), {},
          [&](std::size_t k) { distances[k] = source.nearest(lattice.to_lattice(points[k])).distance; });
  Distances result;
  for (const double d : distances) {
    result.rms += d * d;
    result.max = std::max(result.max, d);
  }
  if (!distances.empty()) result.rms = std::sqrt(result.rms / double(distances.size()));
  return result;
}

}  // namespace relief::detail
