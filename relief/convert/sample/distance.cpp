#include <relief/base/triangle.h>
#include <relief/convert/sample/distance.h>
#include <relief/convert/sample/sampled_model.h>
#include <relief/convert/sample/spread.h>
#include <relief/convert/support/parallel.h>
#include <relief/core/query.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <tuple>
#include <utility>
#include <vector>

namespace relief::detail {
namespace {

constexpr std::size_t kPoints = 12000;
/// How many cells about its place in a slab a point is compared with, each way: usually, and where it lies far off.
constexpr int kReach = 2, kFarReach = 6;
/// Barycentric weight by which a point may lie outside a slab that it is still compared with.
constexpr double kBesides = 0.2;
/// Barycentric weights of the middle of a micro-triangle, farthest from its samples.
constexpr std::array<double, 3> kCentre = {1.0 / 3, 1.0 / 3, 1.0 / 3};
/// Along a fibre, in its lengths.
constexpr double kHalfWay = 0.5;
/// Of a second difference of samples: how far a surface with a kink between them lies from the chord at most, which is
/// where the kink is half way.
constexpr double kOfBend = 0.25;
/// Of the diagonal, ten times the usual error: what seems to lie farther off may be near another sheet.
constexpr double kDoubtful = 10 * kUsualError;
/// Slabs that a comparison with everything looks into, about.
constexpr std::size_t kSearched = 32;

/// As for_all(), with a hint of the ones before, of so many together: neighbours follow each other.
template <typename Work>
void for_all_in_turn(std::size_t count, std::size_t together, const Progress& progress, Work&& work) {
  for_all((count + together - 1) / together, 1, progress, [&](std::size_t block) {
    LocateHint hint;
    for (std::size_t k = block * together; k < std::min(count, (block + 1) * together); ++k) work(k, hint);
  });
}

double root_mean_square(const std::vector<double>& distances) {
  double sum = 0;
  for (const double d : distances) sum += d * d;
  return distances.empty() ? 0 : std::sqrt(sum / double(distances.size()));
}

void keep_farthest(Farthest& farthest, const Farthest& other) noexcept {
  if (other.distance > farthest.distance) farthest = other;
}

double greatest(const std::vector<Farthest>& slabs) noexcept {
  double most = 0;
  for (const Farthest& f : slabs) most = std::max(most, f.distance);
  return most;
}

}  // namespace

MeasuredSurface::MeasuredSurface(const Snapshot& model, const Lattice& lattice, const Progress& progress)
    : model_(model), lattice_(lattice) {
  constexpr std::size_t kCells = 6000, kLeast = 2, kMost = 64;  // of all slabs, of one
  std::size_t most = 0;                                         // that any has
  for (const Slab& s : model.slab_mesh().slabs()) {
    const std::size_t cells = static_cast<std::size_t>(s.intervals) * static_cast<std::size_t>(s.intervals);
    most = std::max(most, cells);
    cells_ += cells;
  }
  room_ = std::min(most, std::clamp(kCells / std::max<std::size_t>(slabs(), 1), kLeast, kMost));
  bent_.resize(slabs() * room_);
  for_all(slabs(), 1, progress, [&](std::size_t s) {
    find_bent(static_cast<SlabId>(s), std::span(bent_).subspan(s * room_, room_));
    rest(static_cast<SlabId>(s));
  });
}

void MeasuredSurface::rest(SlabId s, std::size_t others) const noexcept {
  model_.tile(Layer::Displacement, s).rest(1 + others);
  if (model_.has(Layer::Void)) model_.tile(Layer::Void, s).rest(1 + others);
}

MeasuredSurface::BentCell::BentCell(double how_far, const Cell& corners) noexcept : bend(how_far) {
  for (std::size_t k = 0; k < 3; ++k)
    at[k] = {static_cast<std::uint8_t>(corners[k].i), static_cast<std::uint8_t>(corners[k].j)};
}
MeasuredSurface::Cell MeasuredSurface::BentCell::corners() const noexcept {
  Cell cell;
  for (std::size_t k = 0; k < 3; ++k) cell[k] = {at[k][0], at[k][1]};
  return cell;
}

// Where the surface that the samples lie on has a kink inside a micro-triangle, the displacement bends at its corners,
// and by kOfBend of these second differences it is off at most.
void MeasuredSurface::find_bent(SlabId s, std::span<BentCell> bent) const {
  const SlabMesh& mesh = model_.slab_mesh();
  const int n = mesh.intervals(s);
  const SlabCorners corners = mesh.corners(s);
  const float* const alpha = model_.displacement(s);
  const auto on_grid = [&](GridPoint p) { return p.i >= 0 && p.j >= 0 && p.i + p.j <= n; };
  std::vector<float> bends(sample_count(n));
  std::vector<Vec3d> places(bends.size());
  std::size_t at = 0;
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i + j <= n; ++i, ++at) {
      const std::array<double, 3> w = {double(n - i - j) / n, double(i) / n, double(j) / n};
      places[at] = corners.point(w, double(alpha[at]));
      for (const GridPoint step : {GridPoint{1, 0}, GridPoint{0, 1}, GridPoint{-1, 1}}) {
        const GridPoint next = {i + step.i, j + step.j}, last = {i - step.i, j - step.j};
        if (!on_grid(next) || !on_grid(last)) continue;
        const float bend = alpha[sample_index(n, next)] - 2 * alpha[at] + alpha[sample_index(n, last)];
        bends[at] = std::max(bends[at], std::abs(bend));
      }
    }
  const std::array<int, 3> edges = mesh.edge_intervals(s);
  const double wide = double(n) / std::min({edges[0], edges[1], edges[2]});
  std::vector<BentCell> cells;
  cells.reserve(static_cast<std::size_t>(n) * static_cast<std::size_t>(n));
  for_each_cell(n, edges, [&](const Cell& cell) {
    if (model_.is_hole(s, cell)) return;
    double bend = 0;
    std::array<double, 3> w{};
    std::array<Vec3d, 3> p;
    bool rim = false;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t index = sample_index(n, cell[k]);
      const auto weight = weights(n, cell[k]);
      bend += double(bends[index]);
      p[k] = places[index];
      for (std::size_t c = 0; c < 3; ++c) {
        w[c] += double(weight[c]) / (3 * n);
        rim = rim || weight[c] == 0;
      }
    }
    const Vec3d fibre = corners.weighted(corners.outer, w) - corners.weighted(corners.inner, w);
    const double rise = std::abs(dot(normalized(cross(p[1] - p[0], p[2] - p[0])), fibre));
    cells.emplace_back(kOfBend * bend * rise * (rim ? wide : 1) / lattice_.step, cell);
  });
  const auto by_bend = [](const BentCell& a, const BentCell& b) {
    return std::tuple(-a.bend, a.at[0][1], a.at[0][0], a.at[1][1], a.at[1][0]) <
           std::tuple(-b.bend, b.at[0][1], b.at[0][0], b.at[1][1], b.at[1][0]);
  };
  std::partial_sort_copy(cells.begin(), cells.end(), bent.begin(), bent.end(), by_bend);
}

std::vector<MeasuredSurface::Place> MeasuredSurface::even_places() const {
  const SlabMesh& mesh = model_.slab_mesh();
  // As many points in a slab as its middle has of the area, each inside a micro-triangle.
  const auto twice_area = [&](SlabId s) {
    const SlabCorners c = mesh.corners(s);
    const Vec3d a = c.point({1, 0, 0}, kHalfWay);
    return length(cross(c.point({0, 1, 0}, kHalfWay) - a, c.point({0, 0, 1}, kHalfWay) - a));
  };
  double all = 0;
  for (SlabId s = 0; s < mesh.slab_count(); ++s) all += twice_area(s);
  std::vector<Place> places;
  double sum = 0;
  std::size_t counter = 0;
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    const int n = mesh.intervals(s);
    const double share = all / double(kPoints);
    for (sum += twice_area(s); sum >= share && share > 0; sum -= share) {
      const auto [u, v] = spread(counter++);
      const GridCell cell = cell_at(n, u, v);
      if (model_.is_hole(s, cell.corners)) continue;
      Vec3d p;
      for (std::size_t k = 0; k < 3; ++k) p += sample_position(model_, s, cell.corners[k]) * cell.weights[k];
      places.push_back({p, s, u, v});
    }
    rest(s);
  }
  return places;
}

Measured MeasuredSurface::to(const SourceRays& other, Samples samples, const Progress& progress) const {
  Measured result{{}, std::vector<Farthest>(slabs())};
  const std::vector<Place> places = even_places();
  const auto distance = [&](Vec3d p) { return other.nearest(lattice_.to_lattice(p)).distance; };
  std::vector<double> distances(places.size());
  for_all(places.size(), 64, progress, [&](std::size_t k) { distances[k] = distance(places[k].position); });
  for (std::size_t k = 0; k < places.size(); ++k)
    keep_farthest(result.slabs[places[k].slab], {distances[k], places[k].u, places[k].v});
  const double found = greatest(result.slabs);
  for_all(slabs(), 1, progress, [&](std::size_t slab) {
    const auto s = static_cast<SlabId>(slab);
    const int n = model_.slab_mesh().intervals(s);
    Farthest& farthest = result.slabs[slab];
    const auto look = [&](const Cell& cell, const std::array<Vec3d, 3>& p, const std::array<double, 3>& w) {
      double u = 0, v = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        u += w[k] * cell[k].i / n;
        v += w[k] * cell[k].j / n;
      }
      const Farthest here(distance(p[0] * w[0] + p[1] * w[1] + p[2] * w[2]), u, v);
      const bool farther = here.distance > farthest.distance;
      keep_farthest(farthest, here);
      return farther;
    };
    const auto positions = [&](const Cell& cell) {
      return std::array{sample_position(model_, s, cell[0]), sample_position(model_, s, cell[1]),
                        sample_position(model_, s, cell[2])};
    };
    rest(s);
    const BentCell* worst = nullptr;
    for (const BentCell& cell : std::span(bent_).subspan(slab * room_, room_)) {
      if (cell.bend < farthest.distance) break;
      const Cell corners = cell.corners();
      const std::array<Vec3d, 3> p = positions(corners);
      bool farther = look(corners, p, kCentre);
      for (std::size_t k = 0; k < 3; ++k) {
        std::array<double, 3> w = {0.5, 0.5, 0.5};
        w[k] = 0;
        farther = look(corners, p, w) || farther;
      }
      if (farther) worst = &cell;
    }
    // There once more, in smaller steps.
    constexpr int kFine = 8;
    if (worst != nullptr) {
      const Cell corners = worst->corners();
      const std::array<Vec3d, 3> p = positions(corners);
      for (int j = 0; j <= kFine; ++j)
        for (int i = 0; i + j <= kFine; ++i)
          look(corners, p, {double(kFine - i - j) / kFine, double(i) / kFine, double(j) / kFine});
    }
    if (samples == Samples::OnIt) return;
    // Blocks of cells: no place in one is farther than its middle by more than its radius.
    constexpr int kSide = 8;
    const int across = n / kSide + 1;
    std::vector<std::vector<Cell>> blocks(static_cast<std::size_t>(across * across));
    for_each_cell(n, model_.slab_mesh().edge_intervals(s), [&](const Cell& cell) {
      if (model_.is_hole(s, cell)) return;
      blocks[static_cast<std::size_t>(cell[0].j / kSide * across + cell[0].i / kSide)].push_back(cell);
    });
    for (const std::vector<Cell>& cells : blocks) {
      Box3d box;
      for (const Cell& cell : cells)
        for (const Vec3d p : positions(cell)) box.add(p);
      if (cells.empty() ||
          distance(box.centre()) + 0.5 * diagonal(box) / lattice_.step <= std::max(found, farthest.distance))
        continue;
      for (const Cell& cell : cells) look(cell, positions(cell), kCentre);
    }
  });
  result.distance = {root_mean_square(distances), greatest(result.slabs), places.size() + 4 * cells_};
  return result;
}

Measured MeasuredSurface::from(std::span<const Vec3d> points, std::span<const Face> faces,
                               const Progress& progress) const {
  Measured result{{}, std::vector<Farthest>(slabs())};
  std::vector<Vec3d> chosen;
  for (const SpreadPoint& p : spread_over(points, faces, kPoints)) chosen.push_back(p.at);
  std::vector<Near> near(chosen.size());
  for_all_in_turn(chosen.size(), 64, progress,
                  [&](std::size_t k, LocateHint& hint) { near[k] = distance_within(chosen[k], kReach, hint); });
  // Points outside all slabs are compared with everything, which takes time; where there are many, some stand for all.
  constexpr std::size_t kMostOutside = 1500, kMostCornersOutside = 500;
  const auto distance = [&](Vec3d p) {
    const SurfacePoint nearest = closest_point(model_, p);
    rest(0, kSearched);
    return nearest.slab == kNoSlab ? 0 : length(nearest.position - p);
  };
  const auto distance_at_most = [&](Vec3d p, double most) {
    const SurfacePoint nearest = closest_point(model_, p, most);
    rest(0, kSearched);
    return nearest.slab == kNoSlab ? most : length(nearest.position - p);
  };
  double most_outside = 0;
  const auto look_outside = [&](std::span<const Vec3d> all, std::span<Near> of, std::size_t most) {
    std::vector<std::size_t> outside;
    for (std::size_t k = 0; k < of.size(); ++k)
      if (of[k].slab == kNoSlab && is_finite(all[k])) outside.push_back(k);
    const std::size_t stride = (outside.size() + most - 1) / most;
    std::vector<double> far(stride > 0 ? (outside.size() + stride - 1) / stride : 0);
    for_all(far.size(), 16, progress, [&](std::size_t k) { far[k] = distance(all[outside[k * stride]]); });
    for (std::size_t k = 0; k < outside.size(); ++k) of[outside[k]].most = far[k / stride];
    for (const double d : far) most_outside = std::max(most_outside, d);
  };
  look_outside(chosen, near, kMostOutside);
  // A point of one sheet may lie in a slab of another: what lies far off is compared with everything, too.
  const double doubtful = kDoubtful * length(model_.slab_mesh().tree()[0].box.extent());
  for_all(near.size(), 64, progress, [&](std::size_t k) {
    double& most = near[k].most;
    if (near[k].slab != kNoSlab && most > doubtful) most = distance_at_most(chosen[k], most);
  });
  std::vector<double> distances;
  distances.reserve(near.size());
  for (const Near& at : near) distances.push_back(at.most / lattice_.step);

  // The corners: what lies on the same fibre is a bound, and only those that lie farthest off by it are followed up.
  constexpr std::size_t kBlock = 1024, kMostFollowed = 64;  // corners in a block, points of a slab
  std::vector<std::uint8_t> used(points.size(), 0);
  for (const Face& f : faces)
    for (const std::uint32_t v : f) used[v] = 1;
  std::vector<std::vector<std::pair<double, std::uint32_t>>> farthest(slabs());  // bounds of corners, or of chosen
  const auto corner_count = static_cast<std::uint32_t>(points.size());
  const auto add = [&](SlabId s, double bound, std::uint32_t point) {
    auto& heap = farthest[s];
    if (heap.size() == kMostFollowed && bound <= heap.front().first) return;
    if (heap.size() == kMostFollowed) {
      std::pop_heap(heap.begin(), heap.end(), std::greater<>());
      heap.pop_back();
    }
    heap.emplace_back(bound, point);
    std::push_heap(heap.begin(), heap.end(), std::greater<>());
  };
  for (std::uint32_t k = 0; k < near.size(); ++k)
    if (near[k].slab != kNoSlab) add(near[k].slab, near[k].most, corner_count + k);
  std::size_t looked = chosen.size();
  constexpr std::size_t kAtOnce = 64 * kBlock;
  std::vector<Near> corners;
  std::vector<Near> lost;
  std::vector<Vec3d> lost_points;
  for (std::size_t begin = 0; begin < points.size(); begin += kAtOnce) {
    corners.assign(std::min(kAtOnce, points.size() - begin), {});
    for_all_in_turn(corners.size(), kBlock, progress, [&](std::size_t k, LocateHint& hint) {
      if (used[begin + k] != 0) corners[k] = along_the_fibre(points[begin + k], hint);
    });
    for (std::size_t k = 0; k < corners.size(); ++k) {
      if (used[begin + k] == 0) continue;
      ++looked;
      if (corners[k].slab != kNoSlab) {
        add(corners[k].slab, corners[k].most, static_cast<std::uint32_t>(begin + k));
      } else {
        lost.push_back(corners[k]);
        lost_points.push_back(points[begin + k]);
      }
    }
  }
  look_outside(lost_points, lost, kMostCornersOutside);

  std::vector<double> beside(farthest.size(), 0.0);  // of points that lie in another slab after all, model units
  const auto follow = [&](std::size_t s, bool with_everything) {
    result.slabs[s] = {};
    LocateHint hint;
    for (const auto& [bound, k] : farthest[s]) {
      if (bound / lattice_.step <= result.slabs[s].distance) break;
      const Vec3d p = k < corner_count ? points[k] : chosen[k - corner_count];
      Near at = distance_within(p, kFarReach, hint);
      if (at.slab != s) {
        beside[s] = std::max(beside[s], distance(p));
        continue;
      }
      if (with_everything) at.most = distance_at_most(p, at.most);
      keep_farthest(result.slabs[s], {at.most / lattice_.step, hint.last.u, hint.last.v});
    }
  };
  for_all(farthest.size(), 1, progress, [&](std::size_t s) {
    std::sort(farthest[s].begin(), farthest[s].end(), std::greater<>());
    follow(s, false);
  });
  constexpr std::size_t kMostSlabs = 256;
  std::vector<std::uint8_t> compared_with(farthest.size(), 0);
  for (std::size_t k = 0; k < std::min(kMostSlabs, farthest.size()) && !progress.cancelled(); ++k) {
    const auto s = static_cast<std::size_t>(std::ranges::max_element(result.slabs, {}, &Farthest::distance) -
                                            result.slabs.begin());
    if (compared_with[s] != 0 || result.slabs[s].distance * lattice_.step < doubtful) break;
    compared_with[s] = 1;
    follow(s, true);
  }
  for (const double d : beside) most_outside = std::max(most_outside, d);
  result.distance = {root_mean_square(distances), std::max(most_outside / lattice_.step, greatest(result.slabs)),
                     looked};
  return result;
}

bool MeasuredSurface::follows(Vec3d at, const SourceRays& solid, double reach, LocateHint& hint) const {
  const auto held = locate(model_.slab_mesh(), at, hint);
  if (!held) return false;
  const double alpha = displacement_at(model_, held->slab, held->u, held->v);
  rest(held->slab);
  const std::array<double, 3> weights = {1 - held->u - held->v, held->u, held->v};
  const SlabCorners corners = model_.slab_mesh().corners(held->slab);
  const Vec3d inner = corners.point(weights, 0), along = corners.point(weights, 1) - inner;
  if (std::abs(alpha - held->alpha) * length(along) <= reach) return true;
  Crossings met;
  solid.cross(lattice_.to_lattice(inner), along / lattice_.step, 0, 1, met);
  const auto nearest_to = [&](double t) {
    return std::ranges::min_element(met.all(), {}, [t](const Crossing& c) { return std::abs(c.t - t); });
  };
  return !met.all().empty() && nearest_to(held->alpha) == nearest_to(alpha);
}

bool MeasuredSurface::answers(const Ray3d& ray, const SourceRays& solid, double moved, LocateHint& hint) const {
  const double reach = length(ray.direction);
  Crossings met;
  solid.cross(lattice_.to_lattice(ray.origin), ray.direction / lattice_.step, -1, 1, met);
  const auto is_followed = [&](const Crossing& c) {
    return follows(ray.origin + ray.direction * c.t, solid, reach, hint);
  };
  if (std::ranges::any_of(met.all(), is_followed)) return true;
  const auto hit = raycast(model_, {ray.origin - ray.direction, ray.direction});
  rest(0, kSearched);
  if (hit && hit->distance <= 2) return true;
  const SourceRays::Nearest nearest = solid.nearest(lattice_.to_lattice(ray.origin));
  return nearest.distance * lattice_.step <= moved &&
         follows(lattice_.origin + solid.place(nearest) * lattice_.step, solid, reach, hint);
}

MeasuredSurface::Near MeasuredSurface::along_the_fibre(Vec3d p, LocateHint& hint) const {
  const SlabMesh& mesh = model_.slab_mesh();
  const auto at = locate(mesh, p, hint);
  if (!at) return {};
  const int n = mesh.intervals(at->slab);
  const std::array<int, 3> edges = mesh.edge_intervals(at->slab);
  GridCell cell = cell_at(n, at->u, at->v);
  for (GridPoint& corner : cell.corners) corner = edge_place(n, edges, corner).nearer();
  Vec3d on;
  for (std::size_t k = 0; k < 3; ++k) on += sample_position(model_, at->slab, cell.corners[k]) * cell.weights[k];
  const double most = model_.is_hole(at->slab, cell.corners) ? Box3d::kFar : length(on - p);
  rest(at->slab);
  return {most, at->slab};
}

MeasuredSurface::Near MeasuredSurface::distance_within(Vec3d p, int reach, LocateHint& hint) const {
  const SlabMesh& mesh = model_.slab_mesh();
  const auto at = locate(mesh, p, hint);
  if (!at) return {};
  double best2 = square_within(at->slab, at->u, at->v, p, reach);
  rest(at->slab);
  // Beyond the edges that are near there may be something nearer.
  const std::array<double, 3> weights = {1 - at->u - at->v, at->u, at->v};
  for (std::size_t k = 0; k < 3; ++k) {
    const SlabId other = mesh.slabs()[at->slab].neighbours[k];
    if (other == kNoSlab || weights[k] * mesh.intervals(at->slab) > reach) continue;
    if (const auto there = coordinates_in(mesh, other, p, kBesides))
      best2 = std::min(best2, square_within(other, there->u, there->v, p, reach));
    rest(other);
  }
  if (best2 == Box3d::kFar) return {};
  return {std::sqrt(best2), at->slab};
}

double MeasuredSurface::square_within(SlabId slab, double u, double v, Vec3d p, int reach) const {
  const SlabMesh& mesh = model_.slab_mesh();
  const int n = mesh.intervals(slab), across = 2 * reach + 2;
  const std::array<int, 3> edges = mesh.edge_intervals(slab);
  const int left = static_cast<int>(u * n) - reach, low = static_cast<int>(v * n) - reach;
  const auto on_grid = [&](GridPoint g) { return g.i >= 0 && g.j >= 0 && g.i + g.j <= n; };
  thread_local std::vector<Vec3d> places;  // by row
  places.resize(static_cast<std::size_t>(across * across));
  const auto place = [&](GridPoint g) -> Vec3d& {
    return places[static_cast<std::size_t>((g.j - low) * across + g.i - left)];
  };
  for (int j = low; j < low + across; ++j)
    for (int i = left; i < left + across; ++i)
      if (const GridPoint g = {i, j}; on_grid(g))
        place(g) = sample_position(model_, slab, edge_place(n, edges, g).nearer());
  double best2 = Box3d::kFar;
  const auto add = [&](const Cell& cell) {
    if (!std::all_of(cell.begin(), cell.end(), on_grid)) return;
    Cell to = cell;
    for (GridPoint& g : to) g = edge_place(n, edges, g).nearer();
    if (model_.is_hole(slab, to)) return;
    const Vec3d a = place(cell[0]), b = place(cell[1]), c = place(cell[2]);
    const auto w = nearest_in_triangle(p, a, b, c);
    const Vec3d away = a * w[0] + b * w[1] + c * w[2] - p;
    best2 = std::min(best2, dot(away, away));
  };
  for (int y = low; y + 1 < low + across; ++y)
    for (int x = left; x + 1 < left + across; ++x) {
      add({{{x, y}, {x + 1, y}, {x, y + 1}}});
      add({{{x + 1, y}, {x + 1, y + 1}, {x, y + 1}}});
    }
  return best2;
}

}  // namespace relief::detail
