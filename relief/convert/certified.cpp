#include <relief/convert/certified.h>
#include <relief/convert/directions.h>
#include <relief/convert/ordered_source.h>
#include <relief/convert/reducer.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace relief::detail {
namespace {

using Source = OrderedSource;

/// Moves source vertices that no direction sees well, and those given, towards their neighbours; at most so far in all.
class Smoother {
 public:
  Smoother(Source& source, double farthest) : source_(source), farthest_(farthest), start_(source.points) {
    twins_ = find_twins(source.faces, source.points.size());
    out_.assign(source.points.size(), kNone);
    for (std::uint32_t h = 0; h < twins_.size(); ++h) out_[source.faces[h / 3][h % 3]] = h;
  }

  /// The vertices whose visibility stays below `least`, after smoothing those below `wanted`.
  std::vector<std::uint32_t> smooth(std::span<const std::uint32_t> given, double wanted, double least);
  [[nodiscard]] std::size_t moved() const noexcept {
    std::size_t count = 0;
    for (std::size_t v = 0; v < start_.size(); ++v) count += !(start_[v] == source_.points[v]);
    return count;
  }
  [[nodiscard]] double moved_most() const noexcept {
    double most = 0;
    for (std::size_t v = 0; v < start_.size(); ++v)
      most = std::max(most, length(to_double(source_.points[v] - start_[v])));
    return most;
  }

 private:
  template <typename Visit>
  void for_neighbours(std::uint32_t v, Visit&& visit) const {
    std::uint32_t h = out_[v];
    do {
      visit(source_.faces[h / 3][(h + 1) % 3]);
      h = twins_[last_of(h)];
    } while (h != out_[v]);
  }
  double visibility(std::uint32_t v) {
    normals_.clear();
    std::uint32_t h = out_[v];
    do {
      const Vec3d n = source_.cross_of(h / 3);
      if (!(dot(n, n) > 0)) return -1;
      normals_.push_back(normalized(n));
      h = twins_[last_of(h)];
    } while (h != out_[v]);
    return best_direction(normals_).visibility;
  }

  Source& source_;
  double farthest_;
  std::vector<LatticePoint> start_;
  std::vector<std::uint32_t> twins_, out_;
  std::vector<Vec3d> normals_;
};

std::vector<std::uint32_t> Smoother::smooth(std::span<const std::uint32_t> given, double wanted, double least) {
  const auto count = static_cast<std::uint32_t>(source_.points.size());
  std::vector<std::uint32_t> look(count), marked(given.begin(), given.end());
  std::iota(look.begin(), look.end(), 0U);
  std::vector<std::uint8_t> is_marked(count, 0);
  std::vector<Vec3d> goals;
  std::vector<std::uint32_t> movers;
  for (int round = 0; round < 60; ++round) {
    for (const std::uint32_t v : look)
      if (visibility(v) < wanted) marked.push_back(v);
    std::sort(marked.begin(), marked.end());
    marked.erase(std::unique(marked.begin(), marked.end()), marked.end());
    if (marked.empty()) break;
    for (const std::uint32_t v : marked) is_marked[v] = 1;
    movers = marked;
    for (const std::uint32_t v : marked) for_neighbours(v, [&](std::uint32_t w) { movers.push_back(w); });
    std::sort(movers.begin(), movers.end());
    movers.erase(std::unique(movers.begin(), movers.end()), movers.end());
    goals.clear();
    for (const std::uint32_t v : movers) {
      Vec3d mean;
      double around = 0;
      for_neighbours(v, [&](std::uint32_t w) {
        mean += to_double(source_.points[w]);
        ++around;
      });
      const Vec3d p = to_double(source_.points[v]), start = to_double(start_[v]);
      Vec3d goal = p + (mean / around - p) * (is_marked[v] != 0 ? 0.5 : 0.1);
      if (const double far = length(goal - start); far > farthest_) goal = start + (goal - start) * (farthest_ / far);
      goals.push_back(goal);
    }
    bool any = false;
    look.clear();
    for (std::size_t k = 0; k < movers.size(); ++k) {
      const LatticePoint to = snap(goals[k]);
      any = any || !(to == source_.points[movers[k]]);
      source_.points[movers[k]] = to;
      look.push_back(movers[k]);
      for_neighbours(movers[k], [&](std::uint32_t w) { look.push_back(w); });
    }
    std::sort(look.begin(), look.end());
    look.erase(std::unique(look.begin(), look.end()), look.end());
    for (const std::uint32_t v : marked) is_marked[v] = 0;
    marked.clear();
    if (!any) break;
  }
  std::vector<std::uint32_t> bad;
  for (std::uint32_t v = 0; v < count; ++v)
    if (visibility(v) < least) bad.push_back(v);
  source_.update();
  return bad;
}

}  // namespace

CertifiedShell build_certified(std::vector<LatticePoint> points, std::span<const Face> faces,
                               const CertifiedSettings& settings, const Progress& progress) {
  constexpr double kWanted = 0.3;  // visibility; more of it lets the shell become coarser
  constexpr double kLeast = 0.02;
  constexpr int kRounds = 8;
  CertifiedShell result;
  Source source(points, faces);
  Smoother smoother(source, settings.farthest);
  std::vector<std::uint32_t> trouble;
  for (int round = 0; round < kRounds; ++round) {
    progress("shell", double(round) / kRounds);
    const std::vector<std::uint32_t> singular = smoother.smooth(trouble, kWanted, kLeast);
    if (progress.cancelled()) return result;
    if (!singular.empty()) {
      result.place = source.points[singular.front()];
      result.obstacle = std::to_string(singular.size()) +
                        (singular.size() == 1 ? " vertex has faces" : " vertices have faces") +
                        " that no direction sees, as at a folded or doubled sheet";
      return result;
    }
    Reducer reducer(source, settings.target, settings.longest);
    if (!reducer.thin_shell(progress)) return result;
    if (!reducer.faults().empty()) {
      trouble.clear();
      for (const std::uint32_t f : reducer.faults())
        trouble.insert(trouble.end(), source.faces[f].begin(), source.faces[f].end());
      result.place = source.points[trouble.front()];
      result.obstacle = std::to_string(reducer.faults().size()) + " triangles of the source meet others";
      // Smoothing settles a few crossings; many do not yield to it.
      if (reducer.faults().size() > 200 + faces.size() / 200) return result;
      continue;
    }
    result.obstacle.clear();
    if (!reducer.reduce(progress) || !reducer.thicken(progress)) return result;
    result.shell = reducer.shell();
    result.points = std::move(points);
    for (std::size_t v = 0; v < source.points.size(); ++v) result.points[source.point_of[v]] = source.points[v];
    result.moved_points = smoother.moved();
    result.moved_most = smoother.moved_most();
    return result;
  }
  return result;
}

}  // namespace relief::detail
