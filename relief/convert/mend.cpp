#include <relief/base/free_memory.h>
#include <relief/convert/box_tree.h>
#include <relief/convert/directions.h>
#include <relief/convert/fill.h>
#include <relief/convert/mend.h>
#include <relief/convert/parallel.h>
#include <relief/convert/sort_unique.h>
#include <relief/convert/thin_shell.h>
#include <relief/convert/winding.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <tuple>
#include <unordered_set>
#include <utility>

namespace relief::detail {
namespace {

/// Per point the first one that lies where it does, kNone where no other one does. Only points that faces name count.
std::vector<std::uint32_t> find_touching(const ClosedSource& source) {
  const std::span<const LatticePoint> points = source.points;
  std::vector<std::uint8_t> named(points.size(), 0);
  for (const Face& f : source.faces)
    for (const std::uint32_t v : f) named[v] = 1;
  std::vector<std::uint32_t> table(std::bit_ceil(2 * points.size() + 16), kNone);
  const std::size_t mask = table.size() - 1;
  std::vector<std::uint32_t> touched(points.size(), kNone);
  for (std::uint32_t v = 0; v < points.size(); ++v) {
    if (named[v] == 0) continue;
    const LatticePoint p = points[v];
    std::uint64_t code = static_cast<std::uint32_t>(p.x);
    for (const std::int32_t next : {p.y, p.z}) code = (code ^ code >> 29U) * 0xbf58476d1ce4e5b9U + std::uint32_t(next);
    code = (code ^ code >> 29U) * 0x94d049bb133111ebU;
    std::size_t at = (code >> 20U) & mask;
    while (table[at] != kNone && !(points[table[at]] == p)) at = (at + 1) & mask;
    if (table[at] == kNone) {
      table[at] = v;
    } else {
      touched[v] = touched[table[at]] = table[at];
    }
  }
  return touched;
}

/// The triangles around a point, each as the unit vectors along its edges there and its unit normal.
struct Fan {
  struct Wing {
    Vec3d from, to, normal;
  };
  std::uint32_t point = 0;
  double shortest = Box3d::kFar;  // edge
  std::vector<Wing> wings;
  Vec3d direction;  // that sees them all, if any does

  /// How many of the wings of another fan at the same place lie in the solid behind these, less those in front of them.
  [[nodiscard]] int holds(const Fan& other) const noexcept {
    constexpr double kOn = 1e-6;
    int held = 0;
    for (const Wing& wing : other.wings) {
      const Vec3d at = wing.from + wing.to;
      for (const Wing& mine : wings) {
        // Along the direction, each place lies over or under one of them.
        if (dot(cross(mine.from, at), direction) < 0 || dot(cross(at, mine.to), direction) < 0) continue;
        const double over = dot(mine.normal, at);
        held += int(over < -kOn) - int(over > kOn);
        break;
      }
    }
    return held;
  }
};

std::int8_t sign_of(int sum) noexcept { return static_cast<std::int8_t>(int(sum > 0) - int(sum < 0)); }

}  // namespace

std::size_t part_touching(ClosedSource& source, double farthest) {
  const std::vector<std::uint32_t> touched = find_touching(source);
  struct Corner {
    std::uint32_t place, point, face;
    auto operator<=>(const Corner&) const = default;
  };
  std::vector<Corner> corners;
  for (std::uint32_t f = 0; f < source.faces.size(); ++f)
    for (const std::uint32_t v : source.faces[f])
      if (touched[v] != kNone) corners.push_back({touched[v], v, f});
  std::sort(corners.begin(), corners.end());
  // All are moved away from where they lay, not one after the other.
  std::vector<std::pair<std::uint32_t, LatticePoint>> moved;
  std::vector<Fan> fans;  // at one place
  std::vector<Vec3d> normals;
  for (std::size_t k = 0; k < corners.size();) {
    const std::uint32_t place = corners[k].place;
    const Vec3d at = to_double(source.points[place]);
    fans.clear();
    while (k < corners.size() && corners[k].place == place) {
      Fan& fan = fans.emplace_back();
      fan.point = corners[k].point;
      normals.clear();
      for (; k < corners.size() && corners[k].point == fan.point; ++k) {
        const Face& f = source.faces[corners[k].face];
        const std::size_t i = f[0] == fan.point ? 0 : f[1] == fan.point ? 1 : 2;
        const Vec3d from = to_double(source.points[f[(i + 1) % 3]]) - at,
                    to = to_double(source.points[f[(i + 2) % 3]]) - at;
        fan.shortest = std::min({fan.shortest, length(from), length(to)});
        normals.push_back(normalized(cross(from, to)));
        fan.wings.push_back({normalized(from), normalized(to), normals.back()});
      }
      fan.direction = best_direction(normals).d;
    }
    for (const Fan& fan : fans) {
      int held = 0;
      for (const Fan& other : fans)
        if (&other != &fan) held += fan.holds(other);
      const double by = std::min(farthest, std::max(4 * kLeastHeight, 0.1 * fan.shortest));
      moved.emplace_back(fan.point, snap(at - fan.direction * (held > 0 ? -by : by)));
    }
  }
  for (const auto& [v, to] : moved) source.points[v] = to;
  return moved.size();
}

std::size_t count_meetings(const ClosedSource& given, const Progress& progress) {
  const OrderedSource source(given.points, given.faces);
  const auto box_of = [&](std::size_t f) {
    Box3d box;
    for (const LatticePoint p : source.corners(static_cast<std::uint32_t>(f))) box.add(to_double(p));
    return box;
  };
  const BoxTree tree(source.faces.size(), box_of);
  const auto is_patch = [&](std::uint32_t f) { return given.patch[source.face_of[f]] != 0; };
  std::size_t meetings = 0;
  for (std::uint32_t f = 0; f < source.faces.size(); ++f) {
    if (progress.cancelled()) break;
    if (!is_patch(f)) continue;
    tree.query(box_of(f), [&](std::uint32_t g) {
      const bool counted = is_patch(g) && g <= f;
      if (!counted && !share_a_corner(source.faces[f], source.faces[g]))
        meetings += triangles_meet(source.corners(f), source.corners(g));
      return true;
    });
  }
  return meetings;
}

Mender::Mender(const ClosedSource& given, std::span<const LatticePoint> start, double farthest, Needles needles)
    : source_(given.points, given.faces),
      rings_(source_.faces, source_.points.size()),
      farthest_(farthest),
      needles_(needles),
      free_(source_.points.size(), 1),
      sight_(source_.points.size(), Sight::Well),
      heat_(source_.points.size(), 0),
      level_(source_.faces.size(), 0),
      alive_(source_.faces.size()) {
  start_.reserve(source_.points.size());
  for (const std::uint32_t v : source_.point_of) start_.push_back(start[v]);
  patch_.reserve(source_.faces.size());
  phantom_.reserve(source_.faces.size());
  for (std::size_t f = 0; f < source_.faces.size(); ++f) {
    patch_.push_back(given.patch[source_.face_of[f]]);
    phantom_.push_back(given.phantom[source_.face_of[f]]);
    if (patch_[f] == 0)
      for (const std::uint32_t v : source_.faces[f]) free_[v] = 0;
  }
}

void Mender::look_at(std::uint32_t v, double wanted, double least) {
  // Where hardly a direction sees them, fibres may lean less towards the triangles than elsewhere, but by a good part
  // of what the best direction does.
  constexpr double kHardly = 0.02, kShare = 0.25;
  constexpr double kLong = 30;  // of how far a point may be moved: needles of longer edges cannot be made blunt
  thread_local std::vector<Vec3d> normals;
  normals.clear();
  Vec3d sum;
  double shortest = Box3d::kFar;
  bool flat = false;  // a face without area
  const Vec3d at = to_double(source_.points[v]);
  rings_.around(v, [&](std::uint32_t h) {
    normals.push_back(source_.normal(h / 3));
    sum += normals.back();
    flat = flat || normals.back() == Vec3d{};
    shortest = std::min(shortest, length(to_double(source_.points[source_.faces[h / 3][(h + 1) % 3]]) - at));
  });
  sight_[v] = flat ? Sight::Singular : Sight::Well;
  source_.most_slack[v] = 1;
  if (flat || normals.empty()) return;
  // The mean sees most of them well enough.
  const Vec3d mean = normalized(sum);
  if (std::all_of(normals.begin(), normals.end(), [&](Vec3d n) { return dot(n, mean) >= wanted; })) return;
  const double visibility = best_direction(normals).visibility;
  if (visibility >= wanted) return;
  const bool stays = needles_ != Needles::None && (needles_ == Needles::All || !has_moved(v)) && visibility < least &&
                     visibility >= kNeedle && shortest > kLong * farthest_;
  if (!stays) sight_[v] = visibility < least ? Sight::Singular : Sight::Poor;
  if (visibility < kHardly && sight_[v] != Sight::Singular)
    source_.most_slack[v] = static_cast<float>(kShare * visibility);
}

/// The same for a vertex that may have changed, with what follows for its triangles.
void Mender::look_again_at(std::uint32_t v, double wanted, double least) {
  const float before = source_.most_slack[v];
  look_at(v, wanted, least);
  if (source_.most_slack[v] != before) rings_.around(v, [&](std::uint32_t h) { source_.update_normal(h / 3); });
}

std::optional<Mender::Seen> Mender::look_at_all(double wanted, double least, const Progress& progress) {
  const auto count = static_cast<std::uint32_t>(source_.points.size());
  if (!for_all(count, 1024, progress, [&](std::size_t v) { look_at(static_cast<std::uint32_t>(v), wanted, least); }))
    return std::nullopt;
  looked_ = true;
  poor_.clear();
  auto seen = Seen::Well;
  for (std::uint32_t v = 0; v < count; ++v) {
    if (source_.is_needle(v)) rings_.around(v, [&](std::uint32_t h) { source_.update_normal(h / 3); });
    if (sight_[v] == Sight::Well) continue;
    poor_.push_back(v);
    seen = std::max(seen, sight_[v] == Sight::Poor ? Seen::Poorly : Seen::NotAll);
  }
  return seen;
}

std::optional<std::vector<std::uint32_t>> Mender::smooth(std::span<const std::uint32_t> given, double wanted,
                                                         double least, Neighbours neighbours,
                                                         const Progress& progress) {
  constexpr int kRounds = 60, kLate = 8;
  if (!looked_ && !look_at_all(wanted, least, progress)) return std::nullopt;
  std::vector<std::uint32_t> look = std::move(pending_), seen, marked(given.begin(), given.end()), movers;
  pending_ = {};
  look.insert(look.end(), poor_.begin(), poor_.end());
  sort_unique(look);
  std::vector<std::pair<std::uint32_t, LatticePoint>> moves;
  for (int round = 0; round < kRounds; ++round) {
    if (progress.cancelled()) return std::nullopt;
    for (const std::uint32_t v : look) {
      look_again_at(v, wanted, least);
      if (sight_[v] != Sight::Well) marked.push_back(v);
    }
    seen.insert(seen.end(), look.begin(), look.end());
    sort_unique(marked);
    if (marked.empty()) {
      look.clear();
      break;
    }
    movers = marked;
    if (neighbours == Neighbours::Follow || round >= kLate)
      for (const std::uint32_t v : marked)
        rings_.around(v, [&](std::uint32_t h) { movers.push_back(source_.faces[h / 3][(h + 1) % 3]); });
    sort_unique(movers);
    moves.clear();
    for (const std::uint32_t v : movers) {
      Vec3d mean;
      double around = 0;
      rings_.around(v, [&](std::uint32_t h) {
        mean += to_double(source_.points[source_.faces[h / 3][(h + 1) % 3]]);
        ++around;
      });
      const Vec3d p = to_double(source_.points[v]);
      const bool is_marked = std::binary_search(marked.begin(), marked.end(), v);
      moves.emplace_back(v, within_reach(v, p + (mean / around - p) * (is_marked ? 0.5 : 0.1)));
    }
    look = move_to(moves);
    marked.clear();
    if (look.empty()) break;
    // What did not move is seen as before.
    for (const std::uint32_t v : movers)
      if (sight_[v] != Sight::Well && !std::binary_search(look.begin(), look.end(), v)) marked.push_back(v);
  }
  for (const std::uint32_t v : look) look_again_at(v, wanted, least);
  seen.insert(seen.end(), look.begin(), look.end());
  sort_unique(seen);
  poor_.clear();
  std::vector<std::uint32_t> singular;
  for (const std::uint32_t v : seen) {
    if (sight_[v] != Sight::Well) poor_.push_back(v);
    if (sight_[v] == Sight::Singular) singular.push_back(v);
  }
  return singular;
}

/// The winding number of the faces as they lie now.
void Mender::follow_winding() {
  if (winding_) {
    std::vector<std::uint8_t> moved(places_.size());
    for (std::size_t v = 0; v < places_.size(); ++v) {
      const Vec3d place = to_double(source_.points[v]);
      moved[v] = !(std::exchange(places_[v], place) == place);
    }
    winding_->update(moved);
    return;
  }
  std::vector<Face> faces;
  places_.clear();
  places_.reserve(source_.points.size());
  faces.reserve(alive_);
  for (const LatticePoint p : source_.points) places_.push_back(to_double(p));
  for (std::uint32_t f = 0; f < source_.faces.size(); ++f)
    if (source_.alive(f)) faces.push_back(source_.faces[f]);
  winding_.emplace(places_, std::move(faces));
}

/// Which way points of bad faces have to go that were not asked before: what lies before a face must not be solid, and
/// what lies behind it must be.
bool Mender::find_ways(std::span<const std::uint32_t> bad, const Progress& progress) {
  constexpr double kNear = 0.15;  // of the face's shortest edge: beyond the room that a stiff shell asks for
  std::vector<std::uint32_t> ask;
  for (const std::uint32_t f : bad)
    if (std::ranges::any_of(source_.faces[f], [&](std::uint32_t v) { return asked_[v] == 0; })) ask.push_back(f);
  if (ask.empty()) return true;
  follow_winding();
  std::vector<std::array<std::int8_t, 3>> votes(ask.size());  // by corner
  if (!for_all(ask.size(), 64, progress, [&](std::size_t k) {
        const Face& t = source_.faces[ask[k]];
        const std::array<Vec3d, 3> p = {places_[t[0]], places_[t[1]], places_[t[2]]};
        const double shortest = std::min({length(p[1] - p[0]), length(p[2] - p[1]), length(p[0] - p[2])});
        const Vec3d ahead = source_.normal(ask[k]) * std::max(4 * kLeastHeight, kNear * shortest);
        for (std::size_t c = 0; c < 3; ++c) {
          const Vec3d at = p[c] * 0.7 + (p[0] + p[1] + p[2]) * 0.1;
          const bool hollow = winding_->at(at - ahead) < 0.5, buried = winding_->at(at + ahead) > 0.5;
          votes[k][c] = static_cast<std::int8_t>(int(hollow) - int(buried));
        }
      }))
    return false;
  std::vector<std::pair<std::uint32_t, std::int8_t>> found;  // point and vote
  for (std::size_t k = 0; k < ask.size(); ++k)
    for (std::size_t c = 0; c < 3; ++c)
      if (const std::uint32_t v = source_.faces[ask[k]][c]; asked_[v] == 0) found.emplace_back(v, votes[k][c]);
  std::sort(found.begin(), found.end());
  for (std::size_t k = 0; k < found.size();) {
    const std::uint32_t v = found[k].first;
    int sum = 0;
    for (; k < found.size() && found[k].first == v; ++k) sum += found[k].second;
    way_[v] = sign_of(sum);
    asked_[v] = 1;
  }
  return true;
}

bool Mender::push_apart(std::span<const std::uint32_t> bad, const Progress& progress) {
  constexpr float kFirst = 0.02F, kGrowth = 1.3F, kLast = 0.3F;  // of the mean edge
  constexpr int kSweeps = 3;
  way_.resize(source_.points.size(), 0);
  asked_.resize(source_.points.size(), 0);
  stride_.resize(source_.points.size(), 0);
  if (!find_ways(bad, progress)) return false;
  std::vector<std::uint32_t> points;
  for (const std::uint32_t f : bad) points.insert(points.end(), source_.faces[f].begin(), source_.faces[f].end());
  sort_unique(points);
  // Points that cannot tell follow their neighbours.
  std::vector<std::pair<std::uint32_t, std::int8_t>> followers;
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    followers.clear();
    for (const std::uint32_t v : points) {
      if (way_[v] != 0) continue;
      int sum = 0;
      rings_.around(v, [&](std::uint32_t h) { sum += way_[source_.faces[h / 3][(h + 1) % 3]]; });
      followers.emplace_back(v, sign_of(sum));
    }
    for (const auto& [v, way] : followers) way_[v] = way;
  }
  // All are moved away from where they lay, not one after the other.
  std::vector<std::pair<std::uint32_t, LatticePoint>> moves;
  std::vector<Vec3d> normals;
  for (const std::uint32_t v : points) {
    if (way_[v] == 0) continue;
    const Vec3d at = to_double(source_.points[v]);
    double edges = 0;
    normals.clear();
    rings_.around(v, [&](std::uint32_t h) {
      normals.push_back(source_.normal(h / 3));
      edges += length(to_double(source_.points[source_.faces[h / 3][(h + 1) % 3]]) - at);
    });
    stride_[v] = std::clamp(stride_[v] * kGrowth, kFirst, kLast);
    const double by = double(stride_[v]) * edges / double(normals.size());
    moves.emplace_back(v, within_reach(v, at + best_direction(normals).d * (by * way_[v])));
  }
  const std::vector<std::uint32_t> touched = move_to(moves);
  pending_.insert(pending_.end(), touched.begin(), touched.end());
  return true;
}

std::size_t Mender::restore(std::vector<std::uint32_t> points, double least) {
  sort_unique(pending_);
  for (const std::uint32_t v : pending_) {
    look_again_at(v, least, least);
    if (sight_[v] == Sight::Well) continue;
    points.push_back(v);
    rings_.around(v, [&](std::uint32_t h) { points.push_back(source_.faces[h / 3][(h + 1) % 3]); });
  }
  sort_unique(points);
  std::vector<std::pair<std::uint32_t, LatticePoint>> moves;
  for (const std::uint32_t v : points)
    if (!(source_.points[v] == kept_[v])) moves.emplace_back(v, kept_[v]);
  pending_ = move_to(moves);
  return moves.size();
}

/// The place, or the nearest one to it that the point may come to lie at.
LatticePoint Mender::within_reach(std::uint32_t v, Vec3d place) const {
  const Vec3d start = to_double(start_[v]);
  if (const double far = length(place - start); far > farthest_ && free_[v] == 0)
    place = start + (place - start) * (farthest_ / far);
  return snap(place);
}

/// Moves points; those that this gives other faces, ascending.
std::vector<std::uint32_t> Mender::move_to(std::span<const std::pair<std::uint32_t, LatticePoint>> moves) {
  std::vector<std::uint32_t> touched, turned;
  for (const auto& [v, to] : moves) {
    if (to == source_.points[v]) continue;
    source_.points[v] = to;
    touched.push_back(v);
    rings_.around(v, [&](std::uint32_t h) {
      touched.push_back(source_.faces[h / 3][(h + 1) % 3]);
      turned.push_back(h / 3);
    });
  }
  sort_unique(turned);
  for (const std::uint32_t f : turned) source_.update_normal(f);
  sort_unique(touched);
  changes_.points.insert(changes_.points.end(), touched.begin(), touched.end());
  return touched;
}

void Mender::find_parts_once() {
  if (parts_.count > 0) return;
  parts_ = find_parts(source_.points.size(), source_.faces);
  // The order of the faces given numbers them.
  std::vector<std::uint32_t> first(parts_.count, kNone), order(parts_.count), number(parts_.count);
  for (std::size_t f = 0; f < source_.faces.size(); ++f)
    first[parts_.of_face[f]] = std::min(first[parts_.of_face[f]], source_.face_of[f]);
  std::iota(order.begin(), order.end(), 0U);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return first[a] < first[b]; });
  for (std::uint32_t k = 0; k < order.size(); ++k) number[order[k]] = k;
  part_sizes_.assign(parts_.count, 0);
  for (std::uint32_t& part : parts_.of_face) {
    part = number[part];
    ++part_sizes_[part];
  }
}

void Mender::cut(std::uint32_t f, std::uint8_t level) {
  if (level_[f] == 0) cut_.push_back(f);
  level_[f] = std::max(level_[f], level);
}

/// The bad faces and the rings around them.
void Mender::mark_rings(std::span<const std::uint32_t> bad, std::size_t rings) {
  std::vector<std::vector<std::uint32_t>> fronts;  // by level
  const auto mark = [&](std::uint32_t f, std::size_t level) {
    if (level_[f] >= level) return;
    cut(f, static_cast<std::uint8_t>(level));
    if (fronts.size() <= level) fronts.resize(level + 1);
    fronts[level].push_back(f);
  };
  for (const std::uint32_t f : bad) {
    std::size_t heat = 0;
    for (const std::uint32_t v : source_.faces[f]) heat = std::max(heat, std::size_t{heat_[v]});
    mark(f, rings + heat + 1);
  }
  for (std::size_t level = fronts.size(); level-- > 2;)
    for (std::size_t k = 0; k < fronts[level].size(); ++k)
      if (level_[fronts[level][k]] == level)
        for (const std::uint32_t v : source_.faces[fronts[level][k]])
          rings_.around(v, [&](std::uint32_t h) { mark(h / 3, level - 1); });
}

std::vector<std::uint32_t> Mender::rim() const {
  std::vector<std::uint32_t> rim;
  for (const std::uint32_t f : cut_)
    for (std::uint32_t h = 3 * f; h < 3 * f + 3; ++h)
      if (!is_cut(rings_.twins[h] / 3)) rim.push_back(rings_.twins[h]);
  std::sort(rim.begin(), rim.end());
  return rim;
}

/// Cuts all faces at points where more than one stretch of rim passes, which hold several fans; whether there were any.
bool Mender::cut_pinched() {
  std::vector<std::uint32_t> origins;
  for (const std::uint32_t h : rim()) origins.push_back(source_.faces[h / 3][h % 3]);
  std::sort(origins.begin(), origins.end());
  bool any = false;
  for (std::size_t k = 1; k < origins.size(); ++k) {
    if (origins[k] != origins[k - 1]) continue;
    rings_.around(origins[k], [&](std::uint32_t h) { cut(h / 3, 1); });
    any = true;
  }
  return any;
}

/// Cuts small pieces that have come loose; whether there were any.
bool Mender::cut_crumbs() {
  constexpr std::size_t kCrumb = 50;        // faces
  std::vector<std::uint32_t> large, piece;  // large: faces at the rim of pieces that stay, ascending
  bool any = false;
  for (const std::uint32_t seed : rim()) {
    if (is_cut(seed / 3) || std::binary_search(large.begin(), large.end(), seed / 3)) continue;
    piece.assign(1, seed / 3);
    bool is_large = false;
    for (std::size_t k = 0; k < piece.size() && !is_large; ++k)
      for (std::uint32_t h = 3 * piece[k]; h < 3 * piece[k] + 3; ++h) {
        const std::uint32_t other = rings_.twins[h] / 3;
        if (is_cut(other) || std::find(piece.begin(), piece.end(), other) != piece.end()) continue;
        is_large = is_large || piece.size() == kCrumb || std::binary_search(large.begin(), large.end(), other);
        piece.push_back(other);
      }
    if (is_large) {
      large.push_back(seed / 3);
      std::inplace_merge(large.begin(), large.end() - 1, large.end());
      continue;
    }
    for (const std::uint32_t f : piece) cut(f, 1);
    any = true;
  }
  return any;
}

/// Cuts pieces in which nothing is left that was scanned, only patches; whether there were any.
bool Mender::cut_bare() {
  std::unordered_set<std::uint32_t> sound, seen;
  std::vector<std::uint32_t> piece;
  bool any = false;
  for (const std::uint32_t seed : rim()) {
    const std::uint32_t first = seed / 3;
    if (is_cut(first) || is_scanned(first) || sound.contains(first)) continue;
    piece.assign(1, first);
    seen = {first};
    bool is_sound = false;
    for (std::size_t k = 0; k < piece.size() && !is_sound; ++k)
      for (std::uint32_t h = 3 * piece[k]; h < 3 * piece[k] + 3; ++h) {
        const std::uint32_t other = rings_.twins[h] / 3;
        if (is_cut(other)) continue;
        is_sound = is_sound || is_scanned(other) || sound.contains(other);
        if (seen.insert(other).second) piece.push_back(other);
      }
    if (is_sound) {
      sound.insert(piece.begin(), piece.end());
      continue;
    }
    for (const std::uint32_t f : piece) cut(f, 1);
    any = true;
  }
  return any;
}

std::optional<Mender::Loss> Mender::cut_and_close(std::span<const std::uint32_t> bad, std::size_t rings) {
  find_parts_once();
  was_cut_ = true;
  forget_winding();
  cut_.clear();
  mark_rings(bad, rings);
  while (cut_pinched() || cut_crumbs() || cut_bare()) {
  }
  alive_ -= cut_.size();
  if (alive_ == 0) return std::nullopt;
  Loss loss;
  std::vector<std::uint32_t> lessened;
  for (const std::uint32_t f : cut_) {
    lessened.push_back(parts_.of_face[f]);
    --part_sizes_[parts_.of_face[f]];
    if (patch_[f] != 0) continue;
    loss.area += area_of(f);
    ++loss.faces;
  }
  find_widest(loss);
  if (!close(rim())) return std::nullopt;
  sort_unique(lessened);
  for (const std::uint32_t part : lessened) loss.parts += part_sizes_[part] == 0;
  return loss;
}

/// The widest piece among what is cut.
void Mender::find_widest(Loss& loss) const {
  std::vector<std::uint32_t> left = cut_, piece;
  std::sort(left.begin(), left.end());
  std::vector<std::uint8_t> seen(left.size(), 0);
  const auto place_of = [&](std::uint32_t f) {
    return static_cast<std::size_t>(std::lower_bound(left.begin(), left.end(), f) - left.begin());
  };
  for (std::size_t k = 0; k < left.size(); ++k) {
    if (seen[k] != 0) continue;
    seen[k] = 1;
    piece.assign(1, left[k]);
    Box3d box;
    for (std::size_t at = 0; at < piece.size(); ++at) {
      const std::uint32_t f = piece[at];
      for (const LatticePoint p : source_.corners(f)) box.add(to_double(p));
      for (std::uint32_t h = 3 * f; h < 3 * f + 3; ++h) {
        const std::uint32_t other = rings_.twins[h] / 3;
        if (!is_cut(other) || std::exchange(seen[place_of(other)], std::uint8_t{1}) != 0) continue;
        piece.push_back(other);
      }
    }
    if (const double wide = length(box.extent()); wide > loss.widest) {
      loss.widest = wide;
      loss.place = snap(box.centre());
    }
  }
}

/// Takes the cut faces out, and puts patches in their place.
bool Mender::close(const std::vector<std::uint32_t>& rim) {
  const auto origin = [&](std::uint32_t h) { return source_.faces[h / 3][h % 3]; };
  const auto target = [&](std::uint32_t h) { return source_.faces[h / 3][(h + 1) % 3]; };
  // The rims' loops run against the edges of the faces that stay; one edge begins at each point.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;  // its point in the loop, and the half-edge
  edges.reserve(rim.size());
  for (const std::uint32_t h : rim) edges.emplace_back(target(h), h);
  std::sort(edges.begin(), edges.end());
  const auto edge_at = [&](std::uint32_t v) {
    return static_cast<std::size_t>(std::lower_bound(edges.begin(), edges.end(), std::pair(v, 0U)) - edges.begin());
  };
  std::vector<std::vector<std::uint32_t>> loops;
  std::vector<std::uint8_t> seen(edges.size(), 0);
  for (std::size_t e = 0; e < edges.size(); ++e) {
    if (seen[e] != 0) continue;
    loops.emplace_back();
    for (std::size_t k = e; seen[k] == 0; k = edge_at(origin(edges[k].second))) {
      seen[k] = 1;
      loops.back().push_back(edges[k].first);
    }
    if (loops.back().size() < 3) return false;
  }

  // The faces at the rims, as a mesh with numbers of its own; the patches come after them.
  std::vector<std::uint32_t> stay, numbers;
  for (const auto& [v, h] : edges)
    rings_.around(v, [&](std::uint32_t e) {
      if (!is_cut(e / 3)) stay.push_back(e / 3);
    });
  sort_unique(stay);
  for (const std::uint32_t f : stay) numbers.insert(numbers.end(), source_.faces[f].begin(), source_.faces[f].end());
  sort_unique(numbers);
  const auto number_of = [&](std::uint32_t v) {
    return static_cast<std::uint32_t>(std::lower_bound(numbers.begin(), numbers.end(), v) - numbers.begin());
  };
  std::vector<Vec3d> places;
  std::vector<Face> faces;
  places.reserve(numbers.size());
  for (const std::uint32_t v : numbers) places.push_back(to_double(source_.points[v]));
  for (const std::uint32_t f : stay) {
    const Face& t = source_.faces[f];
    faces.push_back({number_of(t[0]), number_of(t[1]), number_of(t[2])});
  }
  std::vector<std::vector<std::uint32_t>> rims = loops;
  for (auto& loop : rims)
    for (std::uint32_t& v : loop) v = number_of(v);
  const std::vector<std::size_t> begins =
      close_rims(places, faces, rims, std::vector<Closing>(rims.size(), Closing::Membrane));

  const auto first_point = static_cast<std::uint32_t>(source_.points.size());
  const auto first_face = static_cast<std::uint32_t>(source_.faces.size());
  for (std::size_t k = numbers.size(); k < places.size(); ++k) {
    numbers.push_back(static_cast<std::uint32_t>(source_.points.size()));
    source_.points.push_back(snap(places[k]));
    source_.point_of.push_back(kNone);
    start_.push_back(source_.points.back());
  }
  free_.resize(source_.points.size(), 1);
  source_.most_slack.resize(source_.points.size(), 1);
  sight_.resize(source_.points.size(), Sight::Well);
  heat_.resize(source_.points.size(), 0);
  rings_.out.resize(source_.points.size(), kNone);
  for (std::size_t r = 0; r < loops.size(); ++r) {
    std::size_t votes = 0;
    std::uint8_t most = 0;
    for (const std::uint32_t v : loops[r]) {
      votes += phantom_[rings_.twins[edges[edge_at(v)].second] / 3];
      most = std::max(most, heat_[v]);
    }
    most = std::min<std::uint8_t>(most + 1, 20);
    for (const std::uint32_t v : loops[r]) heat_[v] = most;
    const std::uint32_t part = parts_.of_face[edges[edge_at(loops[r][0])].second / 3];
    for (std::size_t f = begins[r]; f < begins[r + 1]; ++f) {
      Face face{};
      for (std::size_t k = 0; k < 3; ++k) {
        face[k] = numbers[faces[f][k]];
        heat_[face[k]] = most;
      }
      source_.faces.push_back(face);
      phantom_.push_back(2 * votes > loops[r].size());
      parts_.of_face.push_back(part);
      ++part_sizes_[part];
    }
  }
  const std::size_t all = source_.faces.size();
  alive_ += all - first_face;
  source_.face_of.resize(all, kNone);
  source_.normals.resize(all);
  patch_.resize(all, 1);
  level_.resize(all, 0);
  rings_.twins.resize(3 * all, kNone);

  for (const std::uint32_t f : cut_) {
    for (const std::uint32_t v : source_.faces[f]) rings_.out[v] = kNone;
    source_.faces[f] = {kNone, kNone, kNone};
    level_[f] = 0;
    changes_.gone.push_back(f);
  }
  for (const std::uint32_t f : stay)
    for (std::uint32_t h = 3 * f; h < 3 * f + 3; ++h) rings_.out[origin(h)] = h;
  // Each new half-edge and each one at the rim has its opposite among the others.
  struct Link {
    std::uint32_t low, high, half_edge;
  };
  std::vector<Link> links;
  const auto add_link = [&](std::uint32_t h) {
    const auto [low, high] = std::minmax({origin(h), target(h)});
    links.push_back({low, high, h});
  };
  for (const std::uint32_t h : rim) add_link(h);
  for (std::uint32_t f = first_face; f < all; ++f) {
    source_.update_normal(f);
    for (std::uint32_t h = 3 * f; h < 3 * f + 3; ++h) {
      add_link(h);
      rings_.out[origin(h)] = h;
    }
  }
  std::sort(links.begin(), links.end(), [](const Link& a, const Link& b) {
    return std::tie(a.low, a.high, a.half_edge) < std::tie(b.low, b.high, b.half_edge);
  });
  if (links.size() % 2 != 0) return false;
  for (std::size_t k = 0; k < links.size(); k += 2) {
    const Link &a = links[k], &b = links[k + 1];
    if (a.low != b.low || a.high != b.high || origin(a.half_edge) == origin(b.half_edge)) return false;
    rings_.twins[a.half_edge] = b.half_edge;
    rings_.twins[b.half_edge] = a.half_edge;
  }

  const auto changed = [&](std::uint32_t v) {
    bool is_free = true;
    rings_.around(v, [&](std::uint32_t h) { is_free = is_free && patch_[h / 3] != 0; });
    free_[v] = is_free;
    pending_.push_back(v);
    changes_.points.push_back(v);
  };
  for (const auto& [v, h] : edges) changed(v);
  for (std::uint32_t v = first_point; v < source_.points.size(); ++v) changed(v);
  return true;
}

Mender::Changes Mender::take_changes() {
  sort_unique(changes_.points);
  sort_unique(changes_.gone);
  return std::exchange(changes_, {});
}

void Mender::forget_winding() {
  winding_.reset();
  free_memory(places_);
}

void Mender::release() {
  forget_winding();
  free_memory(rings_.twins, rings_.out, start_, kept_, sight_, way_, asked_, stride_, parts_.of_face);
}

void Mender::put_back(ClosedSource& given) {
  for (std::size_t v = 0; v < source_.points.size(); ++v) {
    if (source_.point_of[v] == kNone) {
      source_.point_of[v] = static_cast<std::uint32_t>(given.points.size());
      given.points.push_back(source_.points[v]);
    } else {
      given.points[source_.point_of[v]] = source_.points[v];
    }
  }
  if (!was_cut_) return;
  std::vector<std::uint8_t> stays(given.faces.size(), 0);
  for (std::uint32_t f = 0; f < source_.faces.size(); ++f)
    if (source_.alive(f) && source_.face_of[f] != kNone) stays[source_.face_of[f]] = 1;
  std::size_t kept = 0;
  for (std::size_t f = 0; f < stays.size(); ++f) {
    if (stays[f] == 0) continue;
    given.faces[kept] = given.faces[f];
    given.patch[kept] = given.patch[f];
    given.phantom[kept] = given.phantom[f];
    ++kept;
  }
  given.faces.resize(kept);
  given.patch.resize(kept);
  given.phantom.resize(kept);
  for (std::uint32_t f = 0; f < source_.faces.size(); ++f) {
    if (!source_.alive(f) || source_.face_of[f] != kNone) continue;
    const Face& t = source_.faces[f];
    given.faces.push_back({source_.point_of[t[0]], source_.point_of[t[1]], source_.point_of[t[2]]});
    given.patch.push_back(patch_[f]);
    given.phantom.push_back(phantom_[f]);
  }
}

Mender::Moves Mender::moves() const {
  std::vector<std::uint8_t> scanned(source_.points.size(), 0);
  for (std::uint32_t f = 0; f < source_.faces.size(); ++f)
    if (source_.alive(f) && patch_[f] == 0)
      for (const std::uint32_t v : source_.faces[f]) scanned[v] = 1;
  Moves moves;
  for (std::size_t v = 0; v < scanned.size(); ++v) {
    if (scanned[v] == 0) continue;
    const double far = length(to_double(source_.points[v] - start_[v]));
    moves.points += far > 0;
    moves.most = std::max(moves.most, far);
  }
  return moves;
}

}  // namespace relief::detail
