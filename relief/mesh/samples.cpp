#include "samples/bowl.h"
#include "samples/head.h"
#include "samples/pumpkin.h"
#include "samples/rings.h"
#include "samples/torus.h"

#include <relief/base/try.h>
#include <relief/mesh/samples.h>

#include <algorithm>
#include <array>
#include <string>

namespace relief {

namespace detail {

Result<TriangleMesh> mesh_surface(SampleSurface&& surface, std::size_t triangles, const Progress& progress) {
  SampleProgress done(progress);
  RELIEF_CHECK(done.reach(0.0));
  RELIEF_CHECK(surface.prepare(done));
  RELIEF_TRY(const RingLayout layout, RingLayout::make(surface, done));
  const bool closed = surface.closed();
  const double edge = std::sqrt(4.0 * layout.area() / (std::sqrt(3.0) * double(triangles)));
  const double strips = std::max(6.0, std::floor(layout.height() / (edge * std::sqrt(0.75)) + 0.5));
  const auto rings = static_cast<std::size_t>(strips) - (closed ? 0 : 1);
  const auto ring_height = [&](std::size_t k) { return layout.height() * double(closed ? k : k + 1) / strips; };

  // Every vertex of a ring brings two triangles, so the counts must sum to half the wish: find the factor that makes
  // them.
  std::vector<double> lengths(rings);
  for (std::size_t k = 0; k < rings; ++k) lengths[k] = layout.ring_length(ring_height(k));
  constexpr double kLeast = 5.0;
  const auto count_at = [&](double per_unit, std::size_t k) {
    return std::max(kLeast, std::floor(lengths[k] * per_unit + 0.5));
  };
  double few = 0.0, many = 4.0 / edge;
  for (int step = 0; step < 60; ++step) {
    const double middle = 0.5 * (few + many);
    double sum = 0.0;
    for (std::size_t k = 0; k < rings; ++k) sum += count_at(middle, k);
    (2.0 * sum < double(triangles) ? few : many) = middle;
  }
  std::vector<std::uint32_t> counts(rings), firsts(rings + 1);
  firsts[0] = closed ? 0U : 1U;
  for (std::size_t k = 0; k < rings; ++k) {
    counts[k] = static_cast<std::uint32_t>(count_at(many, k));
    firsts[k + 1] = firsts[k] + counts[k];
  }

  TriangleMesh mesh;
  const std::size_t vertices = firsts[rings] + (closed ? 0U : 1U);
  mesh.positions.reserve(vertices);
  mesh.colours.reserve(vertices);
  Box3d box;
  const auto add_vertex = [&](double s, double turn) {
    const SampleSurface::Vertex v = surface.fine(s, turn, edge);
    const auto byte = [](double c) { return static_cast<std::uint8_t>(std::floor(clamp01(c) * 255.0 + 0.5)); };
    mesh.positions.push_back(v.position);
    box.add(v.position);
    mesh.colours.push_back({byte(v.colour.x), byte(v.colour.y), byte(v.colour.z), 255});
  };
  const auto shift = [](std::size_t k) { return std::uint64_t{k & 1U}; };  // in half steps, so that rings are staggered
  std::vector<RingLayout::Place> places;
  if (!closed) add_vertex(0.0, 0.0);
  for (std::size_t k = 0; k < rings; ++k) {
    layout.spread(ring_height(k), counts[k], 0.5 * double(shift(k)), places);
    for (const auto& [s, turn] : places) {
      if (mesh.positions.size() % 256 == 0) {
        const double part = double(mesh.positions.size()) / double(vertices);
        RELIEF_CHECK(done.reach(mix(SampleProgress::kLaidOut, SampleProgress::kPlaced, part)));
      }
      add_vertex(s, turn);
    }
  }
  if (!closed) add_vertex(1.0, 0.0);

  mesh.triangles.reserve(2 * std::size_t{firsts[rings] - firsts[0]});
  if (!closed)
    for (std::uint32_t i = 0; i < counts[0]; ++i)
      mesh.triangles.push_back({0, firsts[0] + (i + 1) % counts[0], firsts[0] + i});
  for (std::size_t k = 0; k + (closed ? 0 : 1) < rings; ++k) {
    RELIEF_CHECK(done.reach(mix(SampleProgress::kPlaced, SampleProgress::kJoined, double(k) / double(rings))));
    // Walk along both rings at once; step on the one whose next edge has its middle first.
    const std::size_t next = (k + 1) % rings;
    const std::uint64_t n = counts[k], m = counts[next];
    const auto low = [&](std::uint64_t i) { return firsts[k] + static_cast<std::uint32_t>(i % n); };
    const auto high = [&](std::uint64_t j) { return firsts[next] + static_cast<std::uint32_t>(j % m); };
    for (std::uint64_t i = 0, j = 0; i < n || j < m;) {
      if (j == m || (i < n && (2 * i + shift(k) + 1) * m < (2 * j + shift(next) + 1) * n)) {
        mesh.triangles.push_back({low(i), low(i + 1), high(j)});
        ++i;
      } else {
        mesh.triangles.push_back({low(i), high(j + 1), high(j)});
        ++j;
      }
    }
  }
  if (!closed)
    for (std::uint32_t i = 0; i < counts[rings - 1]; ++i)
      mesh.triangles.push_back({firsts[rings - 1] + i, firsts[rings - 1] + (i + 1) % counts[rings - 1], firsts[rings]});

  const double scale = 100.0 / box.extent().y;
  for (std::size_t k = 0; k < mesh.positions.size(); ++k) {
    if (k % 65536 == 0)
      RELIEF_CHECK(done.reach(mix(SampleProgress::kJoined, 1.0, double(k) / double(mesh.positions.size()))));
    Vec3d& p = mesh.positions[k];
    p = {p.x * scale, (p.y - box.low.y) * scale, p.z * scale};
  }
  RELIEF_CHECK(done.reach(1.0));
  return mesh;
}

}  // namespace detail

namespace {

/// In the order in which they are shown.
constexpr std::array<std::string_view, 4> kNames = {"pumpkin", "head", "torus", "bowl"};

}  // namespace

std::span<const std::string_view> sample_names() noexcept { return kNames; }

Result<TriangleMesh> make_sample(std::string_view name, std::size_t triangles, const Progress& progress) {
  constexpr std::size_t kFewest = 1'000, kMost = 50'000'000;
  if (std::ranges::find(kNames, name) == kNames.end()) {
    std::string known;
    for (const std::string_view k : kNames) known.append(known.empty() ? "" : ", ").append(k);
    return fail(Errc::NotFound, "there is no sample model '" + printable(name) + "'; the known ones are " + known);
  }
  if (triangles < kFewest || triangles > kMost)
    return fail(Errc::InvalidArgument, "a sample model has " + std::to_string(kFewest) + " to " +
                                           std::to_string(kMost) + " triangles, not " + std::to_string(triangles));
  if (name == "pumpkin") return detail::mesh_surface(detail::PumpkinSurface(), triangles, progress);
  if (name == "head") return detail::mesh_surface(detail::HeadSurface(), triangles, progress);
  if (name == "torus") return detail::mesh_surface(detail::TorusSurface(), triangles, progress);
  return detail::mesh_surface(detail::BowlSurface(), triangles, progress);
}

}  // namespace relief
