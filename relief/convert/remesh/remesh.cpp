#include <relief/convert/failures.h>
#include <relief/convert/geometry/components.h>
#include <relief/convert/geometry/half_edges.h>
#include <relief/convert/remesh/contour_fit.h>
#include <relief/convert/remesh/crease_insertion.h>
#include <relief/convert/remesh/dual_contouring.h>
#include <relief/convert/remesh/fold_mending.h>
#include <relief/convert/remesh/hermite_grid.h>
#include <relief/convert/remesh/remesh.h>
#include <relief/convert/remesh/sheets.h>
#include <relief/convert/remesh/source_skin.h>
#include <relief/convert/sample/spread.h>
#include <relief/convert/support/parallel.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <optional>

namespace relief::detail {
namespace {

/// Voxels on the surface: the default goes no further than the first, beyond which slabs for it take half a minute; no
/// further than the second where parts would be lost, as thin fins; and a given size no further than the third (about
/// a gigabyte while it is made).
constexpr double kManyVoxels = 100'000;
constexpr double kForThinParts = 300'000;
constexpr double kMostVoxels = 2'000'000;
constexpr double kCoarsest = 1.0 / 150;  ///< default voxel, share of the diagonal
constexpr double kPerWall = 1.5;     ///< voxels in a thin wall: from one on, no corner of the grid can fail to see it
constexpr double kThinWalls = 0.02;  ///< share of the area that may be thinner
constexpr std::size_t kFewest = 60;  ///< triangles of a part that stays; a ball of two voxels has about as many
/// Shares of a remesh's time when a step is done: thick sheets, known crossings, fitted vertices, inserted creases.
constexpr double kGrown = 0.2, kGridded = 0.5, kFitted = 0.7, kCreased = 0.9;
/// Voxels from the corner of the grid to the source's box: room for thick sheets, and a fraction that puts faces along
/// the axes off the grid.
constexpr Vec3d kMargin = {8.381966011, 8.276393202, 8.447213595};

double area_of(std::span<const Vec3d> points, std::span<const Triangle> triangles) {
  double area = 0;
  for (const auto& [a, b, c] : triangles) area += length(cross(points[b] - points[a], points[c] - points[a])) / 2;
  return area;
}

double median_edge(const TriangleMesh& mesh) {
  std::vector<double> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (const Triangle& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) edges.push_back(length(mesh.positions[t[(k + 1) % 3]] - mesh.positions[t[k]]));
  const auto middle = edges.begin() + static_cast<std::ptrdiff_t>(edges.size() / 2);
  std::nth_element(edges.begin(), middle, edges.end());
  return *middle;
}

/// Places spread evenly over the skin by area, of which those count that part inside from outside.
struct SkinSample {
  Vec3d at;
  Vec3d normal;
  bool outer = false;
};
std::vector<SkinSample> spread_over_all(const Skin& skin, std::size_t count) {
  std::vector<double> area = {0};
  const auto corners = [&](std::size_t t) {
    const auto& [a, b, c] = skin.triangles()[t];
    return std::array{skin.points()[a], skin.points()[b], skin.points()[c]};
  };
  for (std::size_t t = 0; t < skin.triangles().size(); ++t) {
    const auto [a, b, c] = corners(t);
    area.push_back(area.back() + length(cross(b - a, c - a)) / 2);
  }
  std::vector<SkinSample> samples(count);
  for_all(count, 64, {}, [&](std::size_t k) {
    const double at = area.back() * (double(k) + 0.5) / double(count);
    const auto t = static_cast<std::size_t>(std::upper_bound(area.begin(), area.end() - 1, at) - area.begin() - 1);
    // The R2 sequence, folded into the triangle.
    double u = std::fmod(double(k) * kFirstStep, 1), v = std::fmod(double(k) * kSecondStep, 1);
    if (u + v > 1) u = 1 - u, v = 1 - v;
    const auto [a, b, c] = corners(t);
    samples[k].at = a + (b - a) * u + (c - a) * v;
    samples[k].normal = skin.normal(static_cast<std::uint32_t>(t));
    samples[k].outer = skin.is_outer(samples[k].at, samples[k].normal);
  });
  return samples;
}
std::vector<SkinSample> spread_over(const Skin& skin, std::size_t count) {
  std::vector<SkinSample> samples = spread_over_all(skin, count);
  std::erase_if(samples, [](const SkinSample& s) { return !s.outer; });
  return samples;
}

/// Returns the thickness in voxels of the walls, all but the thinnest; `most` where they are thicker.
double thin_wall(const Skin& skin, double most) {
  constexpr std::size_t kSamples = 4000;
  constexpr double kBelow = 1e-3;  // voxels
  const std::vector<SkinSample> samples = spread_over(skin, kSamples);
  if (samples.empty()) return most;
  std::vector<double> thickness(samples.size());
  for_all(samples.size(), 64, {}, [&](std::size_t k) {
    thickness[k] = skin.way_out(samples[k].at - samples[k].normal * kBelow, -samples[k].normal, most);
  });
  const auto thin = thickness.begin() + static_cast<std::ptrdiff_t>(kThinWalls * double(thickness.size()));
  std::nth_element(thickness.begin(), thin, thickness.end());
  return *thin;
}

/// Returns how thick the solid is below a place of its skin, in voxels, at most `most`. Skin that lies within does not
/// end it.
double thickness_below(const Skin& skin, const SkinSample& sample, double most) {
  constexpr double kBelow = 1e-3;  // voxels
  double way = kBelow;
  while (way < most) {
    way += skin.way_out(sample.at - sample.normal * way, -sample.normal, most - way) + kBelow;
    if (!skin.is_inside(sample.at - sample.normal * (way + kBelow))) break;
  }
  return std::min(way, most);
}

/// Returns which of some places have one of others within `reach`.
std::vector<std::uint8_t> find_near(std::span<const Vec3d> places, std::span<const Vec3d> others, double reach) {
  const auto cell_of = [&](Vec3d p) {
    return std::array{std::floor(p.x / reach), std::floor(p.y / reach), std::floor(p.z / reach)};
  };
  std::map<std::array<double, 3>, std::vector<Vec3d>> cells;
  for (const Vec3d p : others) cells[cell_of(p)].push_back(p);
  std::vector<std::uint8_t> is_near(places.size(), 0);
  for (std::size_t k = 0; k < places.size(); ++k)
    for (int around = 0; around < 27 && is_near[k] == 0; ++around) {
      const auto [x, y, z] = cell_of(places[k]);
      const auto found = cells.find({x + around % 3 - 1, y + around / 3 % 3 - 1, z + around / 9 - 1});
      if (found == cells.end()) continue;
      is_near[k] = std::ranges::any_of(found->second, [&](Vec3d p) { return length(p - places[k]) <= reach; }) ? 1 : 0;
    }
  return is_near;
}

/// Returns whether a ball of a diameter fits into the solid at a place of its skin: else it lies on a fin, on its rim,
/// or beside an edge.
bool holds_a_ball(const Skin& skin, const SkinSample& sample, double diameter) {
  constexpr double kAlmost = 0.9;  // beside noise
  return skin.nearest(sample.at - sample.normal * (diameter / 2)).distance >= kAlmost * diameter / 2;
}

/// Returns the thickness in voxels of the thinnest part that is at least `least` thick and reaches far out of what is
/// `most` thick: a fin, not the tip of a wedge, nor an accident of one place. Nothing where there is none. `area`: of
/// the skin.
std::optional<double> thin_part(const Skin& skin, double area, double least, double most) {
  constexpr std::size_t kSamples = 20'000;
  constexpr double kFar = 2;          // of `most`, or spacings of the samples: what is nearer grows out of what stays
  constexpr std::size_t kPlaces = 3;  // of a part
  const std::vector<SkinSample> samples = spread_over_all(skin, kSamples);
  std::vector<double> thickness(samples.size());  // 0: neither
  for_all(samples.size(), 64, {}, [&](std::size_t k) {
    thickness[k] = thickness_below(skin, samples[k], most);
    const bool counts = thickness[k] < most ? samples[k].outer : holds_a_ball(skin, samples[k], most);
    if (!counts) thickness[k] = 0;
  });
  std::vector<Vec3d> thin, thick;
  std::vector<double> of_thin;
  for (std::size_t k = 0; k < samples.size(); ++k) {
    if (thickness[k] >= most) {
      thick.push_back(samples[k].at);
    } else if (thickness[k] >= least) {
      thin.push_back(samples[k].at);
      of_thin.push_back(thickness[k]);
    }
  }
  const double spacing = std::sqrt(area / double(kSamples));
  const std::vector<std::uint8_t> is_near = find_near(thin, thick, kFar * std::max(most, spacing));
  std::vector<double> far_out;
  for (std::size_t k = 0; k < thin.size(); ++k)
    if (is_near[k] == 0) far_out.push_back(of_thin[k]);
  if (far_out.size() < kPlaces) return std::nullopt;
  std::ranges::nth_element(far_out, far_out.begin() + (kPlaces - 1));
  return far_out[kPlaces - 1];
}

/// Holds the source in voxels, its sheets made thick.
struct Grown {
  std::unique_ptr<Skin> skin;
  std::size_t sheets = 0;
};
Grown grow(const TriangleMesh& source, Vec3d origin, double voxel) {
  std::vector<Vec3d> points;
  points.reserve(source.positions.size());
  for (const Vec3d p : source.positions) points.push_back((p - origin) / voxel);
  Grown grown = {std::make_unique<Skin>(std::move(points), source.triangles)};
  const Components parts = find_components(source.positions.size(), source.triangles);
  const std::vector<std::uint8_t> is_sheet = find_sheets(*grown.skin, parts);
  grown.sheets = static_cast<std::size_t>(std::ranges::count(is_sheet, std::uint8_t{1}));
  if (grown.sheets == 0) return grown;
  points = grown.skin->points();
  std::vector<Triangle> triangles = source.triangles;
  thicken_sheets(points, triangles, parts, is_sheet);
  grown.skin = std::make_unique<Skin>(std::move(points), std::move(triangles));
  return grown;
}

/// Leaves out parts of so few triangles that they are an accident of the voxels, unless there is nothing else.
std::size_t drop_crumbs(std::vector<Triangle>& triangles, const Components& parts) {
  std::vector<std::size_t> size(parts.count, 0);
  for (const std::uint32_t part : parts.of_face) ++size[part];
  const auto crumbs = static_cast<std::size_t>(std::ranges::count_if(size, [](std::size_t s) { return s < kFewest; }));
  if (crumbs == size.size()) return 0;
  std::size_t kept = 0;
  for (std::size_t t = 0; t < triangles.size(); ++t)
    if (size[parts.of_face[t]] >= kFewest) triangles[kept++] = triangles[t];
  triangles.resize(kept);
  return crumbs;
}

/// Looks for skin beside which winding does not decide. There is none where every edge has a triangle on its other
/// side.
void measure_undecided(const Skin& skin, Vec3d origin, double voxel, Remeshed& result) {
  constexpr std::size_t kSamples = 4000;
  if (skin.is_closed()) return;
  const std::vector<SkinSample> samples = spread_over_all(skin, kSamples);
  std::vector<std::uint8_t> is_decided(samples.size());
  for_all(samples.size(), 64, {},
          [&](std::size_t k) { is_decided[k] = skin.is_decided(samples[k].at, samples[k].normal) ? 1 : 0; });
  std::vector<std::size_t> open;
  for (std::size_t k = 0; k < samples.size(); ++k)
    if (is_decided[k] == 0) open.push_back(k);
  if (open.empty()) return;
  const double area = area_of(skin.points(), skin.triangles()) * voxel * voxel;
  result.undecided = area * double(open.size()) / double(samples.size());
  // The first may be one on an edge of a sound solid, where another face passes beside it.
  result.undecided_at = origin + samples[open[open.size() / 2]].at * voxel;
}

/// What is known of the vertices that are still named, and the share of them on the skin.
void measure(const FittedMesh& mesh, const Skin& skin, Vec3d origin, double voxel, Remeshed& result) {
  constexpr std::size_t kSamples = 20'000;
  std::vector<std::uint8_t> named(mesh.positions.size(), 0);
  for (const Triangle& t : mesh.triangles)
    for (const std::uint32_t v : t) named[v] = 1;
  std::size_t all = 0, on_skin = 0;
  double farthest = 0;
  for (std::size_t v = 0; v < named.size(); ++v) {
    if (named[v] == 0) continue;
    ++all;
    on_skin += mesh.fits[v] >= FittedMesh::Fit::OnFace ? 1 : 0;
    if (mesh.fits[v] == FittedMesh::Fit::Moved) farthest = std::max(farthest, skin.nearest(mesh.positions[v]).distance);
  }
  result.on_skin = double(on_skin) / double(std::max<std::size_t>(all, 1));
  result.to_skin = farthest * voxel;
  const std::vector<SkinSample> samples = spread_over(skin, kSamples);
  std::vector<double> distance(samples.size());
  const Skin made(mesh.positions, mesh.triangles);
  for_all(samples.size(), 64, {}, [&](std::size_t k) { distance[k] = made.nearest(samples[k].at).distance; });
  if (samples.empty()) return;
  const auto most = std::ranges::max_element(distance);
  result.from_skin = *most * voxel;
  result.lost_at = origin + samples[static_cast<std::size_t>(most - distance.begin())].at * voxel;
  result.lost = double(std::ranges::count_if(distance, [](double d) { return d >= 1; })) / double(distance.size());
}

TriangleMesh to_model(const FittedMesh& mesh, Vec3d origin, double voxel) {
  TriangleMesh made;
  std::vector<std::uint32_t> number(mesh.positions.size(), kNone);
  made.triangles = mesh.triangles;
  for (Triangle& t : made.triangles)
    for (std::uint32_t& v : t) {
      if (number[v] == kNone) {
        number[v] = static_cast<std::uint32_t>(made.positions.size());
        made.positions.push_back(origin + mesh.positions[v] * voxel);
      }
      v = number[v];
    }
  return made;
}

}  // namespace

Result<Remeshed> remesh(const TriangleMesh& source, double voxel, Follow follow, const Progress& progress) {
  const Box3d box = bounds(source);
  const double across = diagonal(box), area = area_of(source.positions, source.triangles);
  const double finest = std::max(across / 4096, std::sqrt(area / kMostVoxels));
  const bool is_free = voxel == 0;
  if (is_free) {
    voxel =
        std::max(std::min(median_edge(source), std::max(across * kCoarsest, finest)), std::sqrt(area / kManyVoxels));
  } else if (voxel < finest) {
    return voxels_too_small(finest / across);
  }
  progress("remesh", 0);
  Remeshed result;
  const auto origin = [&] { return box.low - kMargin * voxel; };
  Grown grown = grow(source, origin(), voxel);
  if (is_free) {
    // Walls want finer ones, and the two sides of sheets so few that both count.
    const double wanted = voxel * thin_wall(*grown.skin, kPerWall) / kPerWall;
    const double in_voxels = area_of(grown.skin->points(), grown.skin->triangles());
    double chosen = std::max({wanted, finest, voxel * std::sqrt(in_voxels / kManyVoxels)});
    // Parts that would be lost want the finest that they need, as far as the voxels go.
    const double least = std::max(finest, voxel * std::sqrt(in_voxels / kForThinParts));
    if (least < chosen) {
      const auto thin = thin_part(*grown.skin, in_voxels, kPerWall * least / voxel, kPerWall * chosen / voxel);
      if (thin) chosen = voxel * *thin / kPerWall;
    }
    if (chosen != voxel) {
      voxel = chosen;
      grown = grow(source, origin(), voxel);
    }
  }
  const Skin& skin = *grown.skin;
  result.voxel = voxel;
  result.sheets = grown.sheets;
  measure_undecided(skin, origin(), voxel, result);
  if (progress.cancelled()) return cancelled(Work::Remesh);

  progress("remesh", kGrown);
  const auto grid = HermiteGrid::around(skin, progress);
  if (!grid) return cancelled(Work::Remesh);
  progress("remesh", kGridded);
  FittedMesh mesh = fit(contour(*grid, skin, progress), *grid, skin, follow, progress);
  if (progress.cancelled()) return cancelled(Work::Remesh);
  progress("remesh", kFitted);
  constexpr int kRounds = 4;  // without a fold a crease may be seen that was hidden by it
  for (int round = 0; round < kRounds && follow == Follow::Skin; ++round) {
    if (!insert_creases(mesh, *grid, skin, progress)) return cancelled(Work::Remesh);
    if (!mend_folds(mesh, skin, progress)) break;
  }
  if (progress.cancelled()) return cancelled(Work::Remesh);
  const Components parts = find_components(mesh.positions.size(), mesh.triangles);
  result.crumbs = drop_crumbs(mesh.triangles, parts);
  if (mesh.triangles.empty()) return nothing_as_large_as_voxels();
  progress("remesh", kCreased);
  measure(mesh, skin, origin(), voxel, result);
  if (progress.cancelled()) return cancelled(Work::Remesh);
  result.mesh = to_model(mesh, origin(), voxel);
  result.mesh.unit = source.unit;
  result.parts = parts.count - result.crumbs;
  const std::vector<std::uint32_t> twins = find_twins(result.mesh.triangles, result.mesh.positions.size());
  result.rims = static_cast<std::size_t>(std::ranges::count(twins, kNone));
  return result;
}

}  // namespace relief::detail
