#include <relief/convert/certified.h>
#include <relief/convert/directions.h>
#include <relief/convert/fill.h>
#include <relief/convert/ordered_source.h>
#include <relief/convert/reducer.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <optional>
#include <tuple>
#include <utility>

namespace relief::detail {
namespace {

using Source = OrderedSource;

/// Moves source vertices that no direction sees well, and those given, towards their neighbours; at most so far in all.
class Smoother {
 public:
  /// `start`: where the caller's points lay before they were moved; those that only patches have are free to move.
  Smoother(Source& source, const ClosedSource& given, std::span<const LatticePoint> start, double farthest)
      : source_(source), farthest_(farthest), free_(source.points.size(), 1) {
    for (std::size_t t = 0; t < source.faces.size(); ++t)
      if (given.patch[source.face_of[t]] == 0)
        for (const std::uint32_t v : source.faces[t]) free_[v] = 0;
    for (const std::uint32_t v : source.point_of) start_.push_back(start[v]);
    twins_ = find_twins(source.faces, source.points.size());
    out_.assign(source.points.size(), kNone);
    for (std::uint32_t h = 0; h < twins_.size(); ++h) out_[source.faces[h / 3][h % 3]] = h;
  }

  /// The vertices whose visibility stays below `least`, after smoothing those below `wanted`.
  std::vector<std::uint32_t> smooth(std::span<const std::uint32_t> given, double wanted, double least);
  /// Frees what it holds; it is of no more use then.
  void release() {
    for (auto* const array : {&twins_, &out_}) *array = {};
    start_ = {};
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
  std::vector<std::uint8_t> free_;
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
      if (const double far = length(goal - start); far > farthest_ && free_[v] == 0)
        goal = start + (goal - start) * (farthest_ / far);
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

/// Moves points that lie on others towards the inside of their own faces, by a tenth of their shortest edge.
std::size_t part_touching(ClosedSource& s, double farthest) {
  std::vector<std::uint32_t> order(s.points.size());
  std::iota(order.begin(), order.end(), 0U);
  const auto key = [&](std::uint32_t v) { return std::tuple(s.points[v].x, s.points[v].y, s.points[v].z, v); };
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); });
  std::vector<std::uint8_t> touches(s.points.size(), 0);
  for (std::size_t k = 1; k < order.size(); ++k)
    if (s.points[order[k]] == s.points[order[k - 1]]) touches[order[k]] = touches[order[k - 1]] = 1;
  if (std::find(touches.begin(), touches.end(), std::uint8_t{1}) == touches.end()) return 0;
  std::vector<std::vector<Vec3d>> normals(s.points.size());
  std::vector<double> shortest(s.points.size(), Box3d::kFar);
  std::size_t count = 0;
  for (const Face& f : s.faces) {
    if (touches[f[0]] + touches[f[1]] + touches[f[2]] == 0) continue;
    const std::array<Vec3d, 3> p = {to_double(s.points[f[0]]), to_double(s.points[f[1]]), to_double(s.points[f[2]])};
    const Vec3d n = normalized(cross(p[1] - p[0], p[2] - p[0]));
    for (std::size_t k = 0; k < 3; ++k) {
      if (touches[f[k]] == 0) continue;
      normals[f[k]].push_back(n);
      shortest[f[k]] = std::min({shortest[f[k]], length(p[(k + 1) % 3] - p[k]), length(p[(k + 2) % 3] - p[k])});
    }
  }
  for (std::uint32_t v = 0; v < s.points.size(); ++v) {
    if (normals[v].empty()) continue;
    const Vec3d d = best_direction(normals[v]).d;
    s.points[v] = snap(to_double(s.points[v]) - d * std::min(farthest, std::max(4 * kLeastHeight, 0.1 * shortest[v])));
    ++count;
  }
  return count;
}

double area_of(const ClosedSource& s, std::size_t f) noexcept {
  const Vec3d a = to_double(s.points[s.faces[f][0]]);
  return 0.5 * length(cross(to_double(s.points[s.faces[f][1]]) - a, to_double(s.points[s.faces[f][2]]) - a));
}

/// What went of the scan: the area and the number of its faces, and how many parts as a whole.
struct Loss {
  double area = 0;
  std::size_t faces = 0, parts = 0;
};
/// Takes the bad faces out with the ring around them, and with one ring more each time that a place is cut again
/// (`heat`, per point), then closes the rims that this leaves. Pieces that come loose and are mere crumbs go, too. A
/// patch is phantom where what lay at its rim was. Empty when a rim cannot be closed.
std::optional<Loss> cut_and_close(ClosedSource& s, std::vector<std::uint8_t> gone, std::vector<std::uint8_t>& heat) {
  constexpr std::size_t kCrumb = 50;  // faces
  const std::size_t faces = s.faces.size();
  std::vector<std::uint8_t> rings(faces, 0), near(s.points.size());
  for (std::size_t f = 0; f < faces; ++f)
    if (gone[f] != 0)
      for (const std::uint32_t v : s.faces[f]) rings[f] = std::max<std::uint8_t>(rings[f], std::uint8_t(heat[v] + 1));
  for (bool any = true; any;) {
    any = false;
    std::fill(near.begin(), near.end(), std::uint8_t{0});
    for (std::size_t f = 0; f < faces; ++f)
      for (const std::uint32_t v : s.faces[f]) near[v] = std::max(near[v], rings[f]);
    for (std::size_t f = 0; f < faces; ++f) {
      const std::uint8_t most = std::max({near[s.faces[f][0]], near[s.faces[f][1]], near[s.faces[f][2]]});
      if (most == 0 || (gone[f] != 0 && rings[f] + 1 >= most)) continue;
      any = any || most > 1;
      gone[f] = 1;
      rings[f] = most - 1;
    }
  }
  const std::vector<std::uint32_t> twins = find_twins(s.faces, s.points.size());
  const auto on_rim = [&](std::uint32_t h) { return gone[h / 3] == 0 && gone[twins[h] / 3] != 0; };
  for (bool pinched = true; pinched;) {
    pinched = false;
    // A point where more than one stretch of rim passes holds several fans.
    std::vector<std::uint8_t> stretches(s.points.size(), 0);
    for (std::uint32_t h = 0; h < twins.size(); ++h)
      if (on_rim(h)) stretches[s.faces[h / 3][h % 3]] = std::uint8_t(std::min(2, stretches[s.faces[h / 3][h % 3]] + 1));
    for (std::size_t f = 0; f < faces; ++f)
      for (const std::uint32_t v : s.faces[f])
        if (stretches[v] > 1 && gone[f] == 0) {
          gone[f] = 1;
          pinched = true;
        }
    // Crumbs that have come loose.
    std::vector<std::uint8_t> seen(faces, 0);
    std::vector<std::uint32_t> piece;
    for (std::uint32_t seed = 0; seed < faces; ++seed) {
      if (gone[seed] != 0 || seen[seed] != 0) continue;
      piece.assign(1, seed);
      seen[seed] = 1;
      bool open = false;
      for (std::size_t k = 0; k < piece.size(); ++k)
        for (std::uint32_t h = 3 * piece[k]; h < 3 * piece[k] + 3; ++h) {
          const std::uint32_t other = twins[h] / 3;
          open = open || gone[other] != 0;
          if (gone[other] != 0 || seen[other] != 0) continue;
          seen[other] = 1;
          piece.push_back(other);
        }
      if (!open || piece.size() > kCrumb) continue;
      for (const std::uint32_t f : piece) gone[f] = 1;
      pinched = true;
    }
  }
  // What lay across each rim, by the point at which the patch's edge begins.
  std::vector<std::uint8_t> phantom_across(s.points.size(), 0);
  ClosedSource rest;
  for (std::uint32_t f = 0; f < faces; ++f) {
    if (gone[f] != 0) continue;
    rest.faces.push_back(s.faces[f]);
    rest.phantom.push_back(s.phantom[f]);
    rest.patch.push_back(s.patch[f]);
    for (std::uint32_t h = 3 * f; h < 3 * f + 3; ++h)
      if (on_rim(h)) phantom_across[s.faces[f][(h + 1) % 3]] = s.phantom[twins[h] / 3];
  }
  if (rest.faces.empty()) return std::nullopt;
  const auto rims = find_rims(s.points.size(), rest.faces);
  std::vector<Vec3d> places;
  for (const LatticePoint p : s.points) places.push_back(to_double(p));
  const std::vector<Closing> closings(rims.size(), Closing::Membrane);
  const std::vector<std::size_t> begins = close_rims(places, rest.faces, rims, closings);
  for (std::size_t r = 0; r < rims.size(); ++r) {
    if (rims[r].size() < 3) return std::nullopt;
    std::size_t votes = 0;
    for (const std::uint32_t v : rims[r]) votes += phantom_across[v];
    rest.phantom.resize(begins[r + 1], 2 * votes > rims[r].size());
    std::uint8_t most = 0;
    for (const std::uint32_t v : rims[r]) most = std::max(most, heat[v]);
    most = std::min<std::uint8_t>(most + 1, 20);
    for (const std::uint32_t v : rims[r]) heat[v] = most;
    heat.resize(places.size(), 0);
    for (std::size_t f = begins[r]; f < begins[r + 1]; ++f)
      for (const std::uint32_t v : rest.faces[f]) heat[v] = most;
  }
  rest.patch.resize(rest.faces.size(), 1);
  Loss loss;
  for (std::size_t f = 0; f < faces; ++f) {
    if (gone[f] == 0 || s.patch[f] != 0) continue;
    loss.area += area_of(s, f);
    ++loss.faces;
  }
  const Parts parts = find_parts(s.points.size(), s.faces);
  std::vector<std::uint8_t> left(parts.count, 0);
  for (std::size_t f = 0; f < faces; ++f)
    if (gone[f] == 0) left[parts.of_face[f]] = 1;
  loss.parts = static_cast<std::size_t>(std::count(left.begin(), left.end(), std::uint8_t{0}));
  rest.points = std::move(s.points);
  for (std::size_t v = rest.points.size(); v < places.size(); ++v) rest.points.push_back(snap(places[v]));
  s = std::move(rest);
  return loss;
}

}  // namespace

CertifiedShell build_certified(ClosedSource given, const CertifiedSettings& settings, const Progress& progress) {
  constexpr double kWanted = 0.22;  // visibility; more of it lets the shell become coarser
  constexpr double kLeast = 0.02;
  constexpr int kSmoothings = 3, kCuts = 12;
  constexpr double kMostReplaced = 0.03;  // of the area, and of the faces where there are many
  constexpr std::uint32_t kMostAround = 1000;
  CertifiedShell result;
  result.source = std::move(given);
  ClosedSource& s = result.source;
  std::vector<LatticePoint> start = s.points;
  std::vector<std::uint8_t> heat(s.points.size(), 0);
  result.parted_points = part_touching(s, settings.farthest);
  double area = 0, replaced = 0;
  std::size_t scanned_faces = 0;
  for (std::size_t f = 0; f < s.faces.size(); ++f) {
    if (s.patch[f] != 0) continue;
    area += area_of(s, f);
    ++scanned_faces;
  }
  {
    std::vector<std::uint32_t> valences(s.points.size(), 0);
    for (const Face& f : s.faces)
      for (const std::uint32_t v : f) ++valences[v];
    if (const auto most = std::max_element(valences.begin(), valences.end()); *most > kMostAround) {
      result.place = s.points[static_cast<std::size_t>(most - valences.begin())];
      result.obstacle =
          "a vertex has " + std::to_string(*most) + " triangles around it, more than " + std::to_string(kMostAround);
      return result;
    }
  }

  for (int cut = 0; cut <= kCuts; ++cut) {
    progress("shell", double(cut) / kCuts);
    Source source(s.points, s.faces);
    Smoother smoother(source, s, start, settings.farthest);
    std::vector<std::uint32_t> trouble;
    std::vector<std::uint8_t> bad(s.faces.size(), 0);
    // Smoothing settles a few crossings; many do not yield to it.
    for (int round = 0; round < (cut == 0 ? kSmoothings : 1); ++round) {
      const std::vector<std::uint32_t> singular = smoother.smooth(trouble, kWanted, kLeast);
      if (progress.cancelled()) return result;
      for (std::size_t v = 0; v < source.points.size(); ++v) s.points[source.point_of[v]] = source.points[v];
      Reducer reducer(source, settings.target, settings.longest);
      if (singular.empty() && !reducer.thin_shell(progress)) return result;
      if (singular.empty() && reducer.faults().empty()) {
        smoother.release();
        if (!reducer.reduce(progress)) return result;
        for (const double tolerance : settings.tolerances) {
          if (reducer.slab_count() <= settings.target) break;
          if (!reducer.reduce_further(tolerance, progress)) return result;
          result.tolerant = true;
        }
        if (!reducer.thicken(progress)) return result;
        result.obstacle.clear();
        result.shell = reducer.shell();
        std::vector<std::uint8_t> scanned(s.points.size(), 0);
        for (std::size_t f = 0; f < s.faces.size(); ++f)
          if (s.patch[f] == 0)
            for (const std::uint32_t v : s.faces[f]) scanned[v] = 1;
        for (std::size_t v = 0; v < s.points.size(); ++v) {
          if (scanned[v] == 0) continue;
          const double far = length(to_double(s.points[v] - start[v]));
          result.moved_points += far > 0;
          result.moved_most = std::max(result.moved_most, far);
        }
        return result;
      }
      std::fill(bad.begin(), bad.end(), std::uint8_t{0});
      if (!singular.empty()) {
        std::vector<std::uint8_t> marked(source.points.size(), 0);
        for (const std::uint32_t v : singular) marked[v] = 1;
        for (std::size_t f = 0; f < source.faces.size(); ++f)
          for (const std::uint32_t v : source.faces[f]) bad[source.face_of[f]] = bad[source.face_of[f]] | marked[v];
        result.place = source.points[singular.front()];
        result.obstacle = std::to_string(singular.size()) +
                          (singular.size() == 1 ? " vertex has faces" : " vertices have faces") +
                          " that no direction sees, as at a folded or doubled sheet";
        break;
      }
      trouble.clear();
      for (const std::uint32_t f : reducer.faults()) {
        trouble.insert(trouble.end(), source.faces[f].begin(), source.faces[f].end());
        bad[source.face_of[f]] = 1;
        if (cut == 0) result.bad_faces.push_back(source.face_of[f]);
      }
      result.place = source.points[trouble.front()];
      result.obstacle = std::to_string(reducer.faults().size()) + " triangles of the source meet others";
      if (reducer.faults().size() > 200 + s.faces.size() / 200) break;
    }
    if (cut == kCuts) break;
    const auto loss = cut_and_close(s, std::move(bad), heat);
    if (!loss) break;
    replaced += loss->area;
    result.replaced_faces += loss->faces;
    result.vanished_parts += loss->parts;
    const double share = std::max(replaced / area, double(result.replaced_faces) / double(scanned_faces + 2000));
    if (share > kMostReplaced) break;
    start.insert(start.end(), s.points.begin() + static_cast<std::ptrdiff_t>(start.size()), s.points.end());
  }
  return result;
}

}  // namespace relief::detail
