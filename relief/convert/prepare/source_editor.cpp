#include <relief/base/free_memory.h>
#include <relief/convert/geometry/box_tree.h>
#include <relief/convert/geometry/visibility.h>
#include <relief/convert/geometry/winding_number.h>
#include <relief/convert/prepare/source_editor.h>
#include <relief/convert/shell/initial_shell.h>
#include <relief/convert/support/parallel.h>
#include <relief/convert/support/sort_unique.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <tuple>
#include <unordered_set>
#include <utility>

namespace relief::detail {
namespace {

// Where hardly a direction sees them, fibres may lean less towards the triangles than elsewhere, but by this share of
// the best visibility, a good part of it.
constexpr double kHardlySeenSlack = 0.25;
// Of the way to the mean of its neighbours, how far a step of smoothing takes a point: a marked one, and one around it.
constexpr double kMarkedStep = 0.5, kAroundStep = 0.1;
// Weights of a corner and of the sum of all three, for a place near the corner that lies within the face.
constexpr double kOfCorner = 0.7, kOfSum = 0.1;

std::int8_t sign_of(int sum) noexcept { return static_cast<std::int8_t>(int(sum > 0) - int(sum < 0)); }

}  // namespace

SourceEditor::SourceEditor(const ClosedSource& given, std::span<const LatticePoint> start, double farthest)
    : source_(given.points, given.faces),
      rings_(source_.faces, source_.points.size()),
      farthest_(farthest),
      free_(source_.points.size(), 1),
      sight_(source_.points.size(), Sight::Well),
      heat_(source_.points.size(), 0),
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

void SourceEditor::look_at(std::uint32_t v, double wanted, double least) {
  thread_local std::vector<Vec3d> normals;
  normals.clear();
  Vec3d sum;
  bool flat = false;  // a face without area
  rings_.around(v, [&](std::uint32_t h) {
    normals.push_back(source_.normal(h / 3));
    sum += normals.back();
    flat = flat || normals.back() == Vec3d{};
  });
  sight_[v] = flat ? Sight::Singular : Sight::Well;
  source_.most_slack[v] = 1;
  if (flat || normals.empty()) return;
  // The mean sees most of them well enough.
  const Vec3d mean = normalized(sum);
  if (std::all_of(normals.begin(), normals.end(), [&](Vec3d n) { return dot(n, mean) >= wanted; })) return;
  const double visibility = best_direction(normals).visibility;
  if (visibility >= wanted) return;
  const bool stays =
      !has_moved(v) && visibility < least && visibility >= kNeedle && shortest_edge_at(v) > kVeryLong * farthest_;
  if (!stays) sight_[v] = visibility < least ? Sight::Singular : Sight::Poor;
  if (visibility < kHardlySeen && sight_[v] != Sight::Singular)
    source_.most_slack[v] = static_cast<float>(kHardlySeenSlack * visibility);
}

/// Returns the same for a vertex that may have changed, with what follows for its triangles.
void SourceEditor::look_again_at(std::uint32_t v, double wanted, double least) {
  const float before = source_.most_slack[v];
  look_at(v, wanted, least);
  if (source_.most_slack[v] != before) rings_.around(v, [&](std::uint32_t h) { source_.update_normal(h / 3); });
}

double SourceEditor::shortest_edge_at(std::uint32_t v) const {
  double shortest = Box3d::kFar;
  rings_.around(v, [&](std::uint32_t h) {
    shortest =
        std::min(shortest, length(to_double(source_.points[source_.faces[h / 3][(h + 1) % 3]] - source_.points[v])));
  });
  return shortest;
}

std::vector<std::uint32_t> SourceEditor::faces_around(std::span<const std::uint32_t> points) const {
  std::vector<std::uint32_t> faces;
  for (const std::uint32_t v : points) rings_.around(v, [&](std::uint32_t h) { faces.push_back(h / 3); });
  sort_unique(faces);
  return faces;
}

std::optional<SourceEditor::Seen> SourceEditor::look_at_all(double wanted, double least, const Progress& progress) {
  const auto count = static_cast<std::uint32_t>(source_.points.size());
  const std::vector<float> before = source_.most_slack;
  if (!for_all(count, 1024, progress, [&](std::size_t v) { look_at(static_cast<std::uint32_t>(v), wanted, least); }))
    return std::nullopt;
  looked_ = true;
  poor_.clear();
  auto seen = Seen::Well;
  for (std::uint32_t v = 0; v < count; ++v) {
    if (source_.most_slack[v] != before[v]) rings_.around(v, [&](std::uint32_t h) { source_.update_normal(h / 3); });
    if (sight_[v] == Sight::Well) continue;
    poor_.push_back(v);
    seen = std::max(seen, sight_[v] == Sight::Poor ? Seen::Poorly : Seen::NotAll);
  }
  return seen;
}

std::vector<std::uint32_t> SourceEditor::singular() const {
  std::vector<std::uint32_t> found;
  for (const std::uint32_t v : poor_)
    if (sight_[v] == Sight::Singular) found.push_back(v);
  return found;
}

std::optional<std::vector<std::uint32_t>> SourceEditor::smooth(std::span<const std::uint32_t> given, double wanted,
                                                               double least, Neighbours neighbours,
                                                               const Progress& progress) {
  constexpr int kRounds = 60, kLate = 8;
  if (!looked_ && !look_at_all(wanted, least, progress)) return std::nullopt;
  std::vector<std::uint32_t> look = std::move(pending_), seen, marked, movers;
  pending_ = {};
  NumberSet seen_set, marked_set, movers_set, look_set;
  seen_set.reset(source_.points.size());
  marked_set.reset(source_.points.size());
  const auto mark = [&](std::uint32_t v) {
    if (marked_set.add(v)) marked.push_back(v);
  };
  const auto note_seen = [&] {
    for (const std::uint32_t v : look)
      if (seen_set.add(v)) seen.push_back(v);
  };
  for (const std::uint32_t v : given) mark(v);
  look.insert(look.end(), poor_.begin(), poor_.end());
  sort_unique(look);
  std::vector<std::pair<std::uint32_t, LatticePoint>> moves;
  for (int round = 0; round < kRounds; ++round) {
    if (progress.cancelled()) return std::nullopt;
    for (const std::uint32_t v : look) {
      look_again_at(v, wanted, least);
      if (sight_[v] != Sight::Well) mark(v);
    }
    note_seen();
    if (marked.empty()) {
      look.clear();
      break;
    }
    movers = marked;
    movers_set.reset(source_.points.size());
    for (const std::uint32_t v : marked) movers_set.add(v);
    if (neighbours == Neighbours::Follow || round >= kLate)
      for (const std::uint32_t v : marked)
        rings_.around(v, [&](std::uint32_t h) {
          if (const std::uint32_t w = source_.faces[h / 3][(h + 1) % 3]; movers_set.add(w)) movers.push_back(w);
        });
    moves.clear();
    for (const std::uint32_t v : movers) {
      Vec3d mean;
      double around = 0;
      rings_.around(v, [&](std::uint32_t h) {
        mean += to_double(source_.points[source_.faces[h / 3][(h + 1) % 3]]);
        ++around;
      });
      const Vec3d p = to_double(source_.points[v]);
      moves.emplace_back(v, within_reach(v, p + (mean / around - p) * (marked_set.has(v) ? kMarkedStep : kAroundStep)));
    }
    look = move_to(moves);
    marked.clear();
    marked_set.reset(source_.points.size());
    if (look.empty()) break;
    // What did not move is seen as before.
    look_set.reset(source_.points.size());
    for (const std::uint32_t v : look) look_set.add(v);
    for (const std::uint32_t v : movers)
      if (sight_[v] != Sight::Well && !look_set.has(v)) mark(v);
  }
  for (const std::uint32_t v : look) look_again_at(v, wanted, least);
  note_seen();
  std::sort(seen.begin(), seen.end());
  poor_.clear();
  for (const std::uint32_t v : seen)
    if (sight_[v] != Sight::Well) poor_.push_back(v);
  return singular();
}

/// Returns the winding number of the faces as they lie now.
void SourceEditor::follow_winding() {
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

/// Returns which way points of bad faces have to go that were not asked before: what lies before a face must not be
/// solid, and what lies behind it must be.
bool SourceEditor::find_ways(std::span<const std::uint32_t> bad, const Progress& progress) {
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
          const Vec3d at = p[c] * kOfCorner + (p[0] + p[1] + p[2]) * kOfSum;
          const bool hollow = winding_->at(at - ahead) < WindingNumber::kInside;
          const bool buried = winding_->at(at + ahead) > WindingNumber::kInside;
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

bool SourceEditor::push_apart(std::span<const std::uint32_t> bad, const Progress& progress) {
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

std::size_t SourceEditor::restore(std::vector<std::uint32_t> points, double least) {
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

/// Returns the place, or the nearest one to it that the point may come to lie at.
LatticePoint SourceEditor::within_reach(std::uint32_t v, Vec3d place) const {
  const Vec3d start = to_double(start_[v]);
  if (const double far = length(place - start); far > farthest_ && free_[v] == 0)
    place = start + (place - start) * (farthest_ / far);
  return snap(place);
}

/// Moves points; those that this gives other faces, ascending.
std::vector<std::uint32_t> SourceEditor::move_to(std::span<const std::pair<std::uint32_t, LatticePoint>> moves) {
  std::vector<std::uint32_t> touched, turned;
  touched_.reset(source_.points.size());
  turned_.reset(source_.faces.size());
  const auto touch = [&](std::uint32_t v) {
    if (touched_.add(v)) touched.push_back(v);
  };
  for (const auto& [v, to] : moves) {
    if (to == source_.points[v]) continue;
    source_.points[v] = to;
    touch(v);
    rings_.around(v, [&](std::uint32_t h) {
      touch(source_.faces[h / 3][(h + 1) % 3]);
      if (turned_.add(h / 3)) turned.push_back(h / 3);
    });
  }
  for (const std::uint32_t f : turned) source_.update_normal(f);
  std::sort(touched.begin(), touched.end());
  changes_.points.insert(changes_.points.end(), touched.begin(), touched.end());
  return touched;
}

void SourceEditor::find_components_once() {
  if (components_.count > 0) return;
  components_ = find_components(source_.points.size(), source_.faces);
  // The order of the faces given numbers them.
  std::vector<std::uint32_t> first(components_.count, kNone), order(components_.count), number(components_.count);
  for (std::size_t f = 0; f < source_.faces.size(); ++f)
    first[components_.of_face[f]] = std::min(first[components_.of_face[f]], source_.face_of[f]);
  std::iota(order.begin(), order.end(), 0U);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return first[a] < first[b]; });
  for (std::uint32_t k = 0; k < order.size(); ++k) number[order[k]] = k;
  component_sizes_.assign(components_.count, 0);
  for (std::uint32_t& part : components_.of_face) {
    part = number[part];
    ++component_sizes_[part];
  }
}

std::optional<SourceEditor::Loss> SourceEditor::cut_and_patch(std::span<const std::uint32_t> bad, std::size_t rings) {
  find_components_once();
  was_cut_ = true;
  forget_winding();
  const CutRegion region(source_, rings_, patch_, bad, rings, heat_);
  alive_ -= region.faces().size();
  if (alive_ == 0) return std::nullopt;
  Loss loss = loss_of(region);
  std::vector<std::uint32_t> lessened;
  for (const std::uint32_t f : region.faces()) {
    lessened.push_back(components_.of_face[f]);
    --component_sizes_[components_.of_face[f]];
  }
  const std::optional<Patches> patches = close_with_patches(source_, rings_, region);
  if (!patches || !replace(region, *patches)) return std::nullopt;
  sort_unique(lessened);
  for (const std::uint32_t c : lessened) loss.components += component_sizes_[c] == 0;
  return loss;
}

/// Takes the faces of a region out, and puts patches in their place. False where these do not fit the hole.
bool SourceEditor::replace(const CutRegion& region, const Patches& patches) {
  constexpr std::uint8_t kHottest = 20;  // rings more are cut there than a few tries would reach
  const auto first_point = static_cast<std::uint32_t>(source_.points.size());
  const auto first_face = static_cast<std::uint32_t>(source_.faces.size());
  source_.points.insert(source_.points.end(), patches.points.begin(), patches.points.end());
  start_.insert(start_.end(), patches.points.begin(), patches.points.end());
  source_.point_of.resize(source_.points.size(), kNone);
  free_.resize(source_.points.size(), 1);
  source_.most_slack.resize(source_.points.size(), 1);
  sight_.resize(source_.points.size(), Sight::Well);
  heat_.resize(source_.points.size(), 0);
  rings_.out.resize(source_.points.size(), kNone);
  for (std::size_t l = 0; l < patches.loops.size(); ++l) {
    const std::vector<std::uint32_t>& loop = patches.loops[l];
    const auto beyond = [&](std::uint32_t v) { return patches.edges[patches.edge_at(v)].second; };
    std::size_t phantoms = 0;
    std::uint8_t most = 0;
    for (const std::uint32_t v : loop) {
      phantoms += phantom_[rings_.twins[beyond(v)] / 3];
      most = std::max(most, heat_[v]);
    }
    most = std::min<std::uint8_t>(most + 1, kHottest);
    for (const std::uint32_t v : loop) heat_[v] = most;
    const std::uint32_t component = components_.of_face[beyond(loop[0]) / 3];
    for (std::size_t f = patches.begins[l]; f < patches.begins[l + 1]; ++f) {
      for (const std::uint32_t v : patches.faces[f]) heat_[v] = most;
      source_.faces.push_back(patches.faces[f]);
      phantom_.push_back(2 * phantoms > loop.size());
      components_.of_face.push_back(component);
      ++component_sizes_[component];
    }
  }
  const std::size_t all = source_.faces.size();
  alive_ += all - first_face;
  source_.face_of.resize(all, kNone);
  source_.normals.resize(all);
  patch_.resize(all, 1);
  rings_.twins.resize(3 * all, kNone);

  for (const std::uint32_t f : region.faces()) {
    for (const std::uint32_t v : source_.faces[f]) rings_.out[v] = kNone;
    source_.faces[f] = {kNone, kNone, kNone};
    changes_.gone.push_back(f);
  }
  for (const std::uint32_t f : patches.beside)
    for (std::uint32_t h = 3 * f; h < 3 * f + 3; ++h) rings_.out[source_.faces[f][h % 3]] = h;
  const auto origin = [&](std::uint32_t h) { return source_.faces[h / 3][h % 3]; };
  const auto target = [&](std::uint32_t h) { return source_.faces[h / 3][(h + 1) % 3]; };
  // Each new half-edge and each one at a loop has its opposite among the others.
  struct Link {
    std::uint32_t low, high, half_edge;
  };
  std::vector<Link> links;
  const auto add_link = [&](std::uint32_t h) {
    const auto [low, high] = std::minmax({origin(h), target(h)});
    links.push_back({low, high, h});
  };
  for (const auto& [v, h] : patches.edges) add_link(h);
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
  for (const auto& [v, h] : patches.edges) changed(v);
  for (std::uint32_t v = first_point; v < source_.points.size(); ++v) changed(v);
  return true;
}

SourceEditor::Loss SourceEditor::loss_of_cut(std::span<const std::uint32_t> bad, std::size_t rings) const {
  return loss_of(CutRegion(source_, rings_, patch_, bad, rings, heat_));
}

SourceEditor::Loss SourceEditor::loss_of(const CutRegion& region) const {
  const CutRegion::Piece widest = region.widest();
  Loss loss{.widest = widest.diagonal, .place = widest.middle};
  for (const std::uint32_t f : region.faces()) {
    if (!is_scanned(f)) continue;
    loss.area += area_of(f);
    ++loss.faces;
  }
  return loss;
}

SourceEditor::Changes SourceEditor::take_changes() {
  sort_unique(changes_.points);
  sort_unique(changes_.gone);
  return std::exchange(changes_, {});
}

void SourceEditor::forget_winding() {
  winding_.reset();
  free_memory(places_);
}

void SourceEditor::release() {
  forget_winding();
  free_memory(rings_.twins, rings_.out, start_, kept_, sight_, way_, asked_, stride_, components_.of_face);
}

void SourceEditor::put_back(ClosedSource& given) {
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

SourceEditor::Moves SourceEditor::moves() const {
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
