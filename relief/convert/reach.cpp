#include <relief/convert/parallel.h>
#include <relief/convert/reach.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace relief::detail {
namespace {

struct Departure {
  std::array<double, 3> weights;
  double height;  ///< of the source above the base along the fibre; NaN where there is none
};

}  // namespace

Fibres wanted_fibres(const BaseMesh& base, const SourceSurface& source, double longest) {
  Fibres fibres;
  fibres.directions = vertex_directions(base);
  const std::size_t points = base.points.size(), faces = base.faces.size();
  // About 30,000 rays in all.
  const int m = std::clamp(static_cast<int>(std::sqrt(60000.0 / double(faces))), 3, 16);
  const std::size_t per_face = static_cast<std::size_t>(m + 1) * static_cast<std::size_t>(m + 2) / 2;
  std::vector<Departure> departures(faces * per_face);
  for_all(faces, 16, {}, [&](std::size_t s) {
    const Face& f = base.faces[s];
    std::size_t at = s * per_face;
    // What lies farther off than the face is large is another part of the source.
    double edge = 0;
    for (std::size_t k = 0; k < 3; ++k)
      edge = std::max(edge, length(to_double(base.points[f[k]]) - to_double(base.points[f[(k + 1) % 3]])));
    const double far = std::min(longest, 1.5 * edge);
    Crossings crossings;
    for (int j = 0; j <= m; ++j)
      for (int i = 0; i + j <= m; ++i, ++at) {
        const std::array<double, 3> w = {double(m - i - j) / m, double(i) / m, double(j) / m};
        Vec3d p, d;
        for (std::size_t k = 0; k < 3; ++k) {
          p += to_double(base.points[f[k]]) * w[k];
          d += fibres.directions[f[k]] * w[k];
        }
        departures[at] = {w, std::numeric_limits<double>::quiet_NaN()};
        source.cross(p, d, -far, far, crossings);
        for (const Crossing& c : crossings.all())
          if (c.front && !(std::abs(c.t) >= std::abs(departures[at].height))) departures[at].height = c.t;
      }
  });

  std::array<std::vector<double>, 2> need = {std::vector<double>(points, 0.0), std::vector<double>(points, 0.0)};
  for (int pass = 0; pass < 6; ++pass)
    for (std::size_t k = 0; k < departures.size(); ++k) {
      const auto& [w, height] = departures[k];
      if (std::isnan(height)) continue;
      const Side side = height > 0 ? kOuter : kInner;
      const Face& f = base.faces[k / per_face];
      double reached = 0, squares = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        reached += w[c] * need[side][f[c]];
        squares += w[c] * w[c];
      }
      const double missing = std::abs(height) - reached;
      if (missing > 0)
        for (std::size_t c = 0; c < 3; ++c) need[side][f[c]] += missing * w[c] / squares;
    }

  std::vector<double> edges(points, 0), edge_counts(points, 0);
  for (const Face& f : base.faces)
    for (std::size_t k = 0; k < 3; ++k) {
      const double edge = length(to_double(base.points[f[k]]) - to_double(base.points[f[(k + 1) % 3]]));
      for (const std::uint32_t v : {f[k], f[(k + 1) % 3]}) {
        edges[v] += edge;
        edge_counts[v] += 1;
      }
    }
  for (const Side side : {kInner, kOuter}) fibres.wanted[side].resize(points);
  const double allowed = longest - 4;  // both ends are rounded to the lattice
  for (std::size_t v = 0; v < points; ++v) {
    const double edge = edge_counts[v] > 0 ? edges[v] / edge_counts[v] : 0;
    const double in = need[kInner][v], out = need[kOuter][v];
    const double squeeze = in + out > allowed ? allowed / (in + out) : 1;
    const double room = std::clamp((allowed - in - out) / 2, 0.0, 0.8 * edge);
    fibres.wanted[kInner][v] = in * squeeze + room;
    fibres.wanted[kOuter][v] = out * squeeze + room;
  }
  return fibres;
}

std::vector<double> missed_shares(const Shell& shell, const SourceSurface& source) {
  const std::size_t faces = shell.faces.size();
  std::vector<std::uint64_t> edges;
  const auto key = [](std::uint32_t a, std::uint32_t b) { return (std::uint64_t{a} << 32U) | b; };
  for (const Face& f : shell.faces)
    for (std::size_t k = 0; k < 3; ++k) edges.push_back(key(f[k], f[(k + 1) % 3]));
  std::sort(edges.begin(), edges.end());
  const int m = std::clamp(static_cast<int>(std::sqrt(20000.0 / double(std::max<std::size_t>(faces, 1)))), 4, 10);
  std::vector<double> shares(faces, 0);
  for_all(faces, 16, {}, [&](std::size_t s) {
    const Face& f = shell.faces[s];
    bool rim = false;
    for (std::size_t k = 0; k < 3; ++k)
      rim = rim || !std::binary_search(edges.begin(), edges.end(), key(f[(k + 1) % 3], f[k]));
    int cast = 0, missed = 0;
    Crossings crossings;
    for (int j = 0; j < m; ++j)
      for (int i = 0; i + j < m; ++i) {
        // Off the corners and edges by a third of a step.
        const double u = (i + 1.0 / 3) / m, v = (j + 1.0 / 3) / m;
        const std::array<double, 3> w = {1 - u - v, u, v};
        Vec3d in, out;
        for (std::size_t k = 0; k < 3; ++k) {
          in += to_double(shell.ends[kInner][f[k]]) * w[k];
          out += to_double(shell.ends[kOuter][f[k]]) * w[k];
        }
        source.cross(in, out - in, 0, 1, crossings);
        bool front = false;
        for (const Crossing& c : crossings.all()) front = front || c.front;
        ++cast;
        missed += front ? 0 : 1;
      }
    shares[s] = std::max(0.0, double(missed) / cast - (rim ? 0.25 : 0));
  });
  return shares;
}

}  // namespace relief::detail
