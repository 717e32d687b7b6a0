#include <relief/convert/geometry/source_index.h>
#include <relief/convert/support/parallel.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace relief::detail {
namespace {

/// Fibres lean towards every face they cross by this sine at least, so that rounding cannot turn it.
constexpr float kLeastSlack = 5e-3F;
/// The same at most, at needles, which two lattice steps may turn by more: else no fibre could cross them.
constexpr double kMostSlack = 0.01;
/// Of the cosine of a cluster's cone: normals are floats.
constexpr double kConeRounding = 1e-6;

}  // namespace

SourceIndex::SourceIndex(std::span<const LatticePoint> given, std::span<const Face> given_faces) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> order(given_faces.size());
  for (std::uint32_t t = 0; t < order.size(); ++t) order[t] = {morton_code(given[given_faces[t][0]]), t};
  std::sort(order.begin(), order.end());
  std::vector<std::uint32_t> number(given.size(), kNone);
  points.reserve(given.size());
  point_of.reserve(given.size());
  faces.reserve(order.size());
  face_of.reserve(order.size());
  for (const auto& [code, t] : order) {
    Face f{};
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint32_t& n = number[given_faces[t][k]];
      if (n == kNone) {
        n = static_cast<std::uint32_t>(points.size());
        points.push_back(given[given_faces[t][k]]);
        point_of.push_back(given_faces[t][k]);
      }
      f[k] = n;
    }
    faces.push_back(f);
    face_of.push_back(t);
  }
  most_slack.assign(points.size(), 1);
  update();
}

void SourceIndex::update_normal(std::uint32_t t) {
  normals[t] = {0, 0, 0, 1};
  if (!alive(t)) return;
  const Vec3d n = cross_of(t);
  const double size = length(n);
  if (!(size > 0)) return;
  // A move of the corners by the clearance turns the normal by about the clearance over the triangle's height; for
  // needles this is let go.
  const Vec3d a = to_double(points[faces[t][0]]);
  const Vec3d e = to_double(points[faces[t][1]]) - a, g = to_double(points[faces[t][2]]) - a;
  const double turn = 2 * kClearance * (length(e) + length(g)) / size;
  const Vec3f unit = to_float(n / size);
  float slack = std::max(kLeastSlack, static_cast<float>(std::min(turn, kMostSlack)));
  for (const std::uint32_t v : faces[t]) slack = std::min(slack, most_slack[v]);
  normals[t] = {unit.x, unit.y, unit.z, slack};
}

void SourceIndex::update() {
  normals.resize(faces.size());
  for_all(faces.size(), 4096, {}, [&](std::size_t k) { update_normal(static_cast<std::uint32_t>(k)); });
  clusters.assign((faces.size() + kClusterSize - 1) / kClusterSize, {});
  for_all(clusters.size(), 1024, {}, [&](std::size_t b) {
    Box3d box;
    Vec3d sum;
    double slack = 0;
    const auto begin = static_cast<std::uint32_t>(b) * kClusterSize;
    const auto end = std::min(static_cast<std::uint32_t>(faces.size()), begin + kClusterSize);
    for (std::uint32_t t = begin; t < end; ++t) {
      for (const std::uint32_t v : faces[t]) box.add(to_double(points[v]));
      sum += normal(t);
      slack = std::max(slack, double(normals[t][3]));
    }
    const Vec3d axis = normalized(sum);
    double cosine = 1;
    for (std::uint32_t t = begin; t < end; ++t) cosine = std::min(cosine, dot(axis, normal(t)));
    clusters[b] = {box.centre(), box.extent() * 0.5, axis, cosine - kConeRounding, slack};
  });
}

}  // namespace relief::detail
