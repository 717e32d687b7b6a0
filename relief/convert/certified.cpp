#include <relief/convert/certified.h>
#include <relief/convert/reducer.h>
#include <relief/convert/sort_unique.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>

namespace relief::detail {
namespace {

double area_of(const ClosedSource& s, std::size_t f) noexcept {
  const Vec3d a = to_double(s.points[s.faces[f][0]]);
  return 0.5 * length(cross(to_double(s.points[s.faces[f][1]]) - a, to_double(s.points[s.faces[f][2]]) - a));
}

/// A source with its thin shell.
struct Start {
  OrderedSource source;
  std::vector<Ends> ends;
  std::unique_ptr<BoxTree> tree;
};

/// Puts what was mended back into the given source, and brings all into one order where something was cut.
Start finish(Mender&& mender, ThinShell&& thin, ClosedSource& given) {
  std::vector<Ends> ends = thin.take_ends();
  std::unique_ptr<BoxTree> tree = thin.take_tree();
  const bool was_cut = mender.was_cut();
  mender.release();
  mender.put_back(given);
  OrderedSource source = std::move(mender).take_source();
  if (!was_cut) {
    source.update();
    return {std::move(source), std::move(ends), std::move(tree)};
  }
  tree.reset();
  std::vector<Ends> ends_of(given.points.size());
  for (std::size_t v = 0; v < source.points.size(); ++v) ends_of[source.point_of[v]] = ends[v];
  source = OrderedSource(given.points, given.faces);
  ends.clear();
  for (const std::uint32_t v : source.point_of) ends.push_back(ends_of[v]);
  tree = std::make_unique<BoxTree>(source.faces.size(), [&](std::size_t f) {
    Box3d box;
    for (const std::uint32_t v : source.faces[f])
      for (const LatticePoint p : ends[v]) box.add(to_double(p));
    return box;
  });
  return {std::move(source), std::move(ends), std::move(tree)};
}

/// Which parts the bad faces belong to.
std::vector<PartObstacle> parts_of(Mender& mender, std::span<const std::uint32_t> bad, std::string_view reason) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> found;  // part and face
  for (const std::uint32_t f : bad) found.emplace_back(mender.part_of(f), f);
  sort_unique(found);
  std::vector<PartObstacle> parts;
  for (std::size_t k = 0; k < found.size() && parts.size() < kMostBadParts;) {
    const auto [part, face] = found[k];
    std::size_t count = 0;
    for (; k < found.size() && found[k].first == part; ++k) ++count;
    const OrderedSource& source = mender.source();
    parts.push_back({part, source.points[source.faces[face][0]], std::to_string(count) + std::string(reason)});
  }
  return parts;
}

/// Smooths and cuts until a thin shell stands on the source; nothing when cancelled or with an obstacle.
std::optional<Start> mend(CertifiedShell& result, const CertifiedSettings& settings, const Progress& progress) {
  constexpr double kWanted = 0.22;  // visibility; more of it lets the shell become coarser
  constexpr double kLeast = 0.02;
  constexpr int kSmoothings = 3, kCuts = 12;
  constexpr double kMostReplaced = 0.03;  // of the area, and of the faces where there are many
  ClosedSource& s = result.source;
  double area = 0, replaced = 0;
  std::size_t scanned_faces = 0;
  for (std::size_t f = 0; f < s.faces.size(); ++f) {
    if (s.patch[f] != 0) continue;
    area += area_of(s, f);
    ++scanned_faces;
  }
  const std::vector<LatticePoint> start = s.points;
  result.parted_points = part_touching(s, settings.farthest);
  Mender mender(s, start, settings.farthest);
  const OrderedSource& source = mender.source();
  ThinShell thin(source, mender.rings(), settings.longest);
  for (int cut = 0; cut <= kCuts; ++cut) {
    progress("shell", double(cut) / kCuts);
    std::vector<std::uint32_t> trouble, bad;
    // Smoothing settles a few crossings; many do not yield to it.
    for (int round = 0; round < (cut == 0 ? kSmoothings : 1); ++round) {
      const auto singular = mender.smooth(trouble, kWanted, kLeast, progress);
      if (!singular) return std::nullopt;
      bad.clear();
      if (!singular->empty()) {
        for (const std::uint32_t v : *singular)
          mender.rings().around(v, [&](std::uint32_t h) { bad.push_back(h / 3); });
        result.place = source.points[singular->front()];
        result.obstacle = std::to_string(singular->size()) +
                          (singular->size() == 1 ? " vertex has faces" : " vertices have faces") +
                          " that no direction sees, as at a folded or doubled sheet";
        result.bad_parts = parts_of(mender, bad, " triangles lie around vertices whose faces no direction sees");
        break;
      }
      const Mender::Changes changes = mender.take_changes();
      if (!thin.update(changes.points, changes.gone, progress)) return std::nullopt;
      if (thin.faults().empty()) {
        const Mender::Moves moves = mender.moves();
        result.moved_points = moves.points;
        result.moved_most = moves.most;
        result.obstacle.clear();
        result.bad_parts.clear();
        return finish(std::move(mender), std::move(thin), s);
      }
      bad = thin.faults();
      trouble.clear();
      for (const std::uint32_t f : bad) {
        trouble.insert(trouble.end(), source.faces[f].begin(), source.faces[f].end());
        if (cut == 0) result.bad_faces.push_back(source.face_of[f]);
      }
      result.place = source.points[trouble.front()];
      result.obstacle = std::to_string(bad.size()) + " triangles of the source meet others";
      result.bad_parts = parts_of(mender, bad, " triangles meet others");
      if (bad.size() > 200 + s.faces.size() / 200) break;
    }
    if (cut == kCuts) break;
    const auto loss = mender.cut_and_close(bad);
    if (!loss) break;
    replaced += loss->area;
    result.replaced_faces += loss->faces;
    result.vanished_parts += loss->parts;
    const double share = std::max(replaced / area, double(result.replaced_faces) / double(scanned_faces + 2000));
    if (share > kMostReplaced) break;
  }
  return std::nullopt;
}

}  // namespace

std::optional<Crowd> find_crowd(std::size_t point_count, std::span<const Face> faces) {
  constexpr std::uint32_t kMostAround = 1000;
  std::vector<std::uint32_t> valences(point_count, 0);
  for (const Face& f : faces)
    for (const std::uint32_t v : f) ++valences[v];
  const auto most = std::max_element(valences.begin(), valences.end());
  if (most == valences.end() || *most <= kMostAround) return std::nullopt;
  return Crowd{
      static_cast<std::size_t>(most - valences.begin()),
      "a vertex has " + std::to_string(*most) + " triangles around it, more than " + std::to_string(kMostAround)};
}

CertifiedShell build_certified(ClosedSource given, const CertifiedSettings& settings, const Progress& progress) {
  CertifiedShell result;
  result.source = std::move(given);
  std::optional<Start> start = mend(result, settings, progress);
  if (!start) {
    if (progress.cancelled()) result.obstacle.clear();
    return result;
  }
  Reducer reducer(start->source, std::move(start->ends), std::move(start->tree), settings.target, settings.longest);
  if (!reducer.reduce(progress)) return result;
  for (const double tolerance : settings.tolerances) {
    if (reducer.slab_count() <= settings.target) break;
    if (!reducer.reduce_further(tolerance, progress)) return result;
    result.tolerant = true;
  }
  if (!reducer.thicken(progress)) return result;
  result.shell = reducer.shell();
  return result;
}

}  // namespace relief::detail
