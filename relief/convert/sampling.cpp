#include <relief/convert/parallel.h>
#include <relief/convert/sampling.h>
#include <relief/core/query.h>

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

/// The fibre of a sample.
Line fibre_at(const SlabCorners& corners, const Lattice& lattice, GridPoint at, int n) noexcept {
  const auto w = weights(n, at);
  return fibre_at(corners, lattice, {double(w[0]) / n, double(w[1]) / n, double(w[2]) / n});
}

/// The numbers of the samples next to one, by all the slabs that have it, in a fixed order; duplicates remain.
void neighbours_of(const SampleNumbers& numbers, SampleCopy at, std::vector<std::uint32_t>& out) {
  out.clear();
  constexpr std::array<GridPoint, 6> kSteps = {{{1, 0}, {0, 1}, {-1, 1}, {-1, 0}, {0, -1}, {1, -1}}};
  numbers.for_each_copy(at.slab, at.at, [&](const SampleCopy& copy) {
    const int n = numbers.intervals(copy.slab);
    for (const GridPoint step : kSteps) {
      const GridPoint p = {copy.at.i + step.i, copy.at.j + step.j};
      if (p.i >= 0 && p.j >= 0 && p.i + p.j <= n) out.push_back(static_cast<std::uint32_t>(numbers.of(copy.slab, p)));
    }
  });
}

/// What a fibre met; Elsewhere: the number is none of a sample's.
enum class Met : std::uint8_t { Elsewhere, Never, Beyond, Once, Often };

/// Fills the unknown values from the known ones around them: first ring by ring, then relaxed towards the mean of the
/// neighbours (a discrete Laplace equation). Where a whole part is unknown it gets 1/2.
void fill(const SampleNumbers& numbers, std::vector<Met>& met, std::vector<float>& values) {
  std::vector<std::uint32_t> unknown, begin = {0}, around, scratch;
  for (std::uint32_t k = 0; k < values.size(); ++k) {
    if (met[k] != Met::Never) continue;
    unknown.push_back(k);
    neighbours_of(numbers, numbers.place(k), scratch);
    around.insert(around.end(), scratch.begin(), scratch.end());
    begin.push_back(static_cast<std::uint32_t>(around.size()));
  }
  if (unknown.empty()) return;
  const auto mean = [&](std::size_t u, bool of_known_only) -> std::optional<float> {
    double sum = 0;
    int count = 0;
    for (std::uint32_t e = begin[u]; e < begin[u + 1]; ++e)
      if (!of_known_only || met[around[e]] != Met::Never) {
        sum += double(values[around[e]]);
        ++count;
      }
    if (count == 0) return std::nullopt;
    return static_cast<float>(sum / count);
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
    for (const std::uint32_t k : reached) met[k] = Met::Beyond;
    std::swap(front, later);
  }
  for (const std::uint32_t u : front) values[unknown[u]] = 0.5F;
  for (int sweep = 0; sweep < 60; ++sweep) {
    double change = 0;
    for (std::size_t step = 0; step < unknown.size(); ++step) {
      const std::size_t u = sweep % 2 == 0 ? step : unknown.size() - 1 - step;
      const auto value = mean(u, false);
      if (!value) continue;
      float& mine = values[unknown[u]];
      change = std::max(change, std::abs(double(*value) - double(mine)));
      mine = *value;
    }
    if (change < 1e-5) break;
  }
}

bool inside(const Crossing& c) noexcept { return c.t >= -kRounding && c.t <= 1 + kRounding; }

/// The crossings of a fibre with the source, those beyond its ends included.
void cross(const SampleSource& source, const Line& line, double from, double to, Crossings& found) {
  source.surface.cross(line.origin, line.direction, from, to, found);
  // Two faces of one point, crossed one after the other in the same sense: the fibre runs through their edge or point,
  // and is turned aside by rounding. It crosses the one that it is most inside of.
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

}  // namespace

SampleNumbers::SampleNumbers(const SlabMesh& mesh, int m) : mesh_(&mesh), m_(m), begin_(mesh.slab_count() + 1, 0) {
  for (SlabId s = 0; s < mesh.slab_count(); ++s) begin_[s + 1] = begin_[s] + sample_count(intervals(s));
}

SampleCopy SampleNumbers::place(std::size_t number) const noexcept {
  const auto next = std::upper_bound(begin_.begin(), begin_.end(), number);
  const auto s = static_cast<SlabId>(next - begin_.begin() - 1);
  int left = static_cast<int>(number - begin_[s]), row = intervals(s) + 1, j = 0;
  for (; left >= row; ++j) left -= row--;
  return {s, {left, j}};
}

AlphaField sample_alpha(const SlabMesh& mesh, const SampleNumbers& numbers, const SampleSource& source,
                        const Progress& progress) {
  std::vector<Met> met(numbers.end(), Met::Elsewhere);
  AlphaField field;
  field.values.resize(numbers.end());
  field.steepness.resize(numbers.end());
  field.is_void.resize(numbers.end());
  const auto take = [&](std::size_t k, const Crossing& c, Vec3d direction) {
    field.values[k] = static_cast<float>(std::clamp(c.t, 0.0, 1.0));
    field.steepness[k] = static_cast<float>(dot(source.surface.normal(c.triangle), direction));
    field.is_void[k] = c.triangle >= source.phantom_from;
  };

  const bool cast = for_all(mesh.slab_count(), 1, progress, [&](std::size_t slab) {
    const auto s = static_cast<SlabId>(slab);
    const SlabCorners corners = mesh.corners(s);
    Crossings crossings;
    numbers.for_each(s, [&](std::size_t k, GridPoint p) {
      const Line line = fibre_at(corners, source.lattice, p, numbers.intervals(s));
      cross(source, line, -kBeyond, 1 + kBeyond, crossings);
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
      met[k] = Met::Never;
      if (outermost != nullptr) {
        take(k, *outermost, line.direction);
        met[k] = within == 1 ? Met::Once : Met::Often;
      } else if (nearest != nullptr && within == 0) {
        take(k, *nearest, line.direction);
        met[k] = Met::Beyond;
      }
    });
  });
  if (!cast) return {};
  progress("sample", 0.6);

  // Several crossings: the outermost, unless the mean of the neighbours that were met once lies nearer to another.
  std::vector<std::uint32_t> often;
  for (std::uint32_t k = 0; k < met.size(); ++k)
    if (met[k] == Met::Often) often.push_back(k);
  const auto line_of = [&](std::size_t k) {
    const SampleCopy at = numbers.place(k);
    return fibre_at(mesh.corners(at.slab), source.lattice, at.at, numbers.intervals(at.slab));
  };
  std::vector<Crossing> chosen(often.size());
  const bool weighed = for_all(often.size(), 512, progress, [&](std::size_t o) {
    const std::uint32_t k = often[o];
    chosen[o].t = -1;
    std::vector<std::uint32_t> around;
    neighbours_of(numbers, numbers.place(k), around);
    double sum = 0;
    int votes = 0;
    for (const std::uint32_t other : around)
      if (met[other] == Met::Once) {
        sum += double(field.values[other]);
        ++votes;
      }
    if (votes < 2) return;
    const double mean = sum / votes;
    double nearest = std::abs(double(field.values[k]) - mean);
    if (nearest < 0.1) return;
    Crossings crossings;
    cross(source, line_of(k), -kRounding, 1 + kRounding, crossings);
    for (const Crossing& c : crossings.all()) {
      if (!c.front || std::abs(c.t - mean) >= nearest) continue;
      nearest = std::abs(c.t - mean);
      chosen[o] = c;
    }
  });
  if (!weighed) return {};
  for (std::size_t o = 0; o < often.size(); ++o)
    if (chosen[o].t >= -kRounding) take(often[o], chosen[o], line_of(often[o]).direction);

  if (!often.empty()) field.folded.resize(met.size());
  for (const std::uint32_t k : often) field.folded[k] = 1;
  for (const Met m : met) {
    field.hits.single += m == Met::Once;
    field.hits.several += m == Met::Often;
    field.hits.none += m == Met::Never || m == Met::Beyond;
  }
  fill(numbers, met, field.values);
  return field;
}

HitCount count_hits(const SlabMesh& mesh, const SampleSource& source, std::size_t already, const Progress& progress) {
  constexpr std::size_t kFibres = 1'000'000;
  HitCount hits;
  if (already >= kFibres || mesh.slab_count() == 0) return hits;
  // The centres of the upright triangles of an n grid: n (n + 1) / 2 in each slab.
  const std::size_t each = (kFibres - already + mesh.slab_count() - 1) / mesh.slab_count();
  int n = 1;
  while (static_cast<std::size_t>(n) * static_cast<std::size_t>(n + 1) / 2 < each) ++n;
  std::vector<HitCount> of_slab(mesh.slab_count());
  const bool cast = for_all(mesh.slab_count(), 1, progress, [&](std::size_t k) {
    const SlabCorners corners = mesh.corners(static_cast<SlabId>(k));
    Crossings crossings;
    for (int j = 0; j < n; ++j)
      for (int i = 0; i + j < n; ++i) {
        const double u = (i + 1.0 / 3) / n, v = (j + 1.0 / 3) / n;
        const std::array<double, 3> w = {1 - u - v, u, v};
        cross(source, fibre_at(corners, source.lattice, w), -kRounding, 1 + kRounding, crossings);
        HitCount& count = of_slab[k];
        ++(crossings.count == 0 ? count.none : crossings.count == 1 ? count.single : count.several);
      }
  });
  if (!cast) return hits;
  for (const HitCount& count : of_slab) {
    hits.single += count.single;
    hits.none += count.none;
    hits.several += count.several;
  }
  return hits;
}

bool sample_colour(const Snapshot& model, const SampleNumbers& numbers, const SourceSurface& source,
                   const Lattice& lattice, const TriangleMesh& coloured, std::span<Tile* const> tiles,
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
      source.cross(line.origin, line.direction, alpha - 0.25, alpha + 0.25, crossings);
      const Crossing* met = nullptr;
      for (const Crossing& c : crossings.all())
        if (met == nullptr || std::abs(c.t - alpha) < std::abs(met->t - alpha)) met = &c;
      Vec3f colour;
      if (met != nullptr) {
        colour = colour_at(coloured, met->triangle, met->weights);
      } else {
        const SourceSurface::Nearest nearest = source.nearest(line.origin + line.direction * alpha);
        colour = colour_at(coloured, nearest.triangle, nearest.weights);
      }
      // Each sample has one thread that writes it, in all of its slabs.
      numbers.for_each_copy(s, p, [&](const SampleCopy& copy) {
        const std::size_t index = sample_index(n, copy.at);
        for (int channel = 0; channel < 3; ++channel)
          tiles[copy.slab]->plane(channel)[index] = colour[static_cast<std::size_t>(channel)];
      });
    });
  });
}

}  // namespace relief::detail
