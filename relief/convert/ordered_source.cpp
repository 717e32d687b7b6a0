#include <relief/convert/ordered_source.h>
#include <relief/convert/parallel.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace relief::detail {
namespace {

/// Fibres lean towards every face they cross by this sine at least, so that rounding cannot turn it.
constexpr float kLeastSlack = 5e-3F;

/// Bits of x, y, z interleaved; 10 of each.
std::uint32_t morton(LatticePoint p) noexcept {
  const auto spread = [](std::uint32_t v) {
    v = (v | (v << 16U)) & 0x030000ffU;
    v = (v | (v << 8U)) & 0x0300f00fU;
    v = (v | (v << 4U)) & 0x030c30c3U;
    return (v | (v << 2U)) & 0x09249249U;
  };
  const auto top = [](std::int32_t v) { return std::min(static_cast<std::uint32_t>(v) >> 15U, 1023U); };
  return spread(top(p.x)) | (spread(top(p.y)) << 1U) | (spread(top(p.z)) << 2U);
}

}  // namespace

Stars::Stars(std::span<const Face> faces, std::size_t point_count)
    : begin(point_count + 1, 0), half_edges(faces.size() * 3) {
  for (const Face& f : faces)
    for (const std::uint32_t v : f) ++begin[v + 1];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<std::uint32_t> next(begin.begin(), begin.end() - 1);
  for (std::uint32_t h = 0; h < half_edges.size(); ++h) half_edges[next[faces[h / 3][h % 3]]++] = h;
}

std::vector<std::uint32_t> find_twins(std::span<const Face> faces, std::size_t point_count) {
  const Stars stars(faces, point_count);
  std::vector<std::uint32_t> twins(faces.size() * 3, kNone);
  for (std::uint32_t h = 0; h < twins.size(); ++h) {
    const std::uint32_t u = faces[h / 3][h % 3], v = faces[h / 3][(h + 1) % 3];
    for (const std::uint32_t e : stars.of(v))
      if (faces[e / 3][(e + 1) % 3] == u) twins[h] = e;
  }
  return twins;
}

Rings::Rings(std::span<const Face> faces, std::size_t point_count)
    : twins(find_twins(faces, point_count)), out(point_count, kNone) {
  for (std::uint32_t h = 0; h < twins.size(); ++h) out[faces[h / 3][h % 3]] = h;
}

OrderedSource::OrderedSource(std::span<const LatticePoint> given, std::span<const Face> given_faces) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> order(given_faces.size());
  for (std::uint32_t t = 0; t < order.size(); ++t) order[t] = {morton(given[given_faces[t][0]]), t};
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

void OrderedSource::update_normal(std::uint32_t t) {
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
  float slack = std::max(kLeastSlack, static_cast<float>(std::min(turn, 0.01)));
  for (const std::uint32_t v : faces[t]) slack = std::min(slack, most_slack[v]);
  normals[t] = {unit.x, unit.y, unit.z, slack};
}

void OrderedSource::update() {
  normals.resize(faces.size());
  for_all(faces.size(), 4096, {}, [&](std::size_t k) { update_normal(static_cast<std::uint32_t>(k)); });
  blocks.assign((faces.size() + kBlock - 1) / kBlock, {});
  for_all(blocks.size(), 1024, {}, [&](std::size_t b) {
    Box3d box;
    Vec3d sum;
    double slack = 0;
    const auto begin = static_cast<std::uint32_t>(b) * kBlock;
    const auto end = std::min(static_cast<std::uint32_t>(faces.size()), begin + kBlock);
    for (std::uint32_t t = begin; t < end; ++t) {
      for (const std::uint32_t v : faces[t]) box.add(to_double(points[v]));
      sum += normal(t);
      slack = std::max(slack, double(normals[t][3]));
    }
    const Vec3d axis = normalized(sum);
    double cosine = 1;
    for (std::uint32_t t = begin; t < end; ++t) cosine = std::min(cosine, dot(axis, normal(t)));
    blocks[b] = {box.centre(), box.extent() * 0.5, axis, cosine - 1e-6, slack};
  });
}

}  // namespace relief::detail
