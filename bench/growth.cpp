#include "growth.h"

#include "support/shells.h"
#include "timing.h"

#include <relief/core/query.h>

#include <fmt/format.h>

#include <cmath>

namespace relief::bench {

namespace {

using nlohmann::ordered_json;

constexpr int kIntervals = 16;

ordered_json on_sphere(const Snapshot& model, int frames) {
  const double size = diagonal(model.slab_mesh().bounds());
  const CallTimer timer;
  LocateHint located, probed;
  std::vector<double> locates(static_cast<std::size_t>(frames), 1), probes(locates.size(), 1);
  std::size_t found = 0;
  for (int pass = 0; pass < 3; ++pass)
    for (std::size_t k = 0; k < locates.size(); ++k) {
      const double a = static_cast<double>(k) * 1e-4 * size;
      const Vec3d p = normalized(Vec3d{std::cos(a), 0.3 * std::sin(1.7 * a), std::sin(a)}) * (1 - 0.003 * size);
      locates[k] = std::min(locates[k], timer([&] { found += locate(model.slab_mesh(), p, located) ? 1U : 0U; }));
      probes[k] = std::min(probes[k], timer([&] { found += probe(model, p, probed) ? 1U : 0U; }));
    }
  return {{"slabs", model.slab_mesh().slab_count()},
          {"locate_ns", percentiles(locates, 1e9)},
          {"probe_ns", percentiles(probes, 1e9)},
          {"found_share", static_cast<double>(found) / static_cast<double>(6 * locates.size())}};
}

}  // namespace

ordered_json growth(std::span<const int> levels, int frames) {
  ordered_json json = ordered_json::array();
  for (const int level : levels) {
    const SnapshotPtr model = testing::displaced(testing::icosphere_shell(level, kIntervals, 0.97, 1.03), [](Vec3d p) {
      return 0.5 + 0.05 * std::sin(7 * p.x) * std::cos(5 * p.y);
    });
    json.push_back(on_sphere(*model, frames));
  }
  return json;
}

}  // namespace relief::bench
