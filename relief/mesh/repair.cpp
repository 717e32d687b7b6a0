#include <relief/base/assert.h>
#include <relief/base/compact.h>
#include <relief/base/disjoint_sets.h>
#include <relief/base/free_memory.h>
#include <relief/base/try.h>
#include <relief/mesh/predicates.h>
#include <relief/mesh/repair.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <iterator>
#include <numeric>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

namespace relief {
namespace {

using Index = std::uint32_t;
constexpr Index kNone = 0xffffffffU;
constexpr Index kMany = 0xfffffffeU;

// Half-edge 3 t + k runs from corner k of triangle t to corner k + 1.
constexpr Index next_edge(Index h) noexcept { return h % 3 == 2 ? h - 2 : h + 1; }
constexpr Index previous_edge(Index h) noexcept { return h % 3 == 0 ? h + 2 : h - 1; }

/// The half-edges along each edge, and for edges of exactly two the other one.
struct EdgeTable {
  std::vector<Index> twin;         ///< per half-edge: the only other one, kNone, or kMany when there are more
  std::vector<Index> crowd;        ///< half-edges of edges with more than two, edge by edge
  std::vector<Index> crowd_start;  ///< where each such edge begins in `crowd`, and its end
};

/// Groups by the lower vertex (a counting sort), then sorts each small group by the higher one.
EdgeTable make_edges(const std::vector<Triangle>& triangles, std::size_t vertex_count) {
  EdgeTable table;
  const auto half_edges = static_cast<Index>(triangles.size() * 3);
  table.twin.assign(half_edges, kNone);
  const auto ends = [&](Index h) {
    const Triangle& t = triangles[h / 3];
    return std::minmax(t[h % 3], t[(h + 1) % 3]);
  };
  std::vector<Index> start(vertex_count + 1, 0);
  for (Index h = 0; h < half_edges; ++h) ++start[std::size_t{ends(h).first} + 1];
  std::partial_sum(start.begin(), start.end(), start.begin());
  struct Entry {
    Index high, half_edge;
    bool operator<(const Entry& b) const noexcept { return high != b.high ? high < b.high : half_edge < b.half_edge; }
  };
  std::vector<Entry> entries(half_edges);
  std::vector<Index> fill(start.begin(), start.end() - 1);
  for (Index h = 0; h < half_edges; ++h) {
    const auto [low, high] = ends(h);
    entries[fill[low]++] = {high, h};
  }
  for (std::size_t v = 0; v < vertex_count; ++v) {
    const auto first = entries.begin() + start[v];
    const auto last = entries.begin() + start[v + 1];
    std::sort(first, last);
    for (auto from = first; from != last;) {
      auto to = from + 1;
      while (to != last && to->high == from->high) ++to;
      if (to - from == 2) {
        table.twin[from->half_edge] = from[1].half_edge;
        table.twin[from[1].half_edge] = from->half_edge;
      } else if (to - from > 2) {
        table.crowd_start.push_back(static_cast<Index>(table.crowd.size()));
        for (auto at = from; at != to; ++at) {
          table.twin[at->half_edge] = kMany;
          table.crowd.push_back(at->half_edge);
        }
      }
      from = to;
    }
  }
  if (!table.crowd_start.empty()) table.crowd_start.push_back(static_cast<Index>(table.crowd.size()));
  return table;
}

/// How far apart corners may lie where open edges are taken for one, share of the diagonal. Single precision rounds to
/// 1e-7 of it within some lengths of the origin; features of shapes start far above.
constexpr double kSeam = 1e-6;

/// Returns the hashed number of the cell of size `cell` at whole coordinates x, y, z.
std::uint64_t cell_number(double cell, double x, double y, double z) noexcept {
  std::uint64_t hash = std::bit_cast<std::uint64_t>(cell);
  for (const double v : {x, y, z}) {
    hash = (hash ^ std::bit_cast<std::uint64_t>(v + 0.0)) * 0x9e3779b97f4a7c15ULL;
    hash ^= hash >> 29U;
  }
  return hash;
}

/// The numbers of the cells that a box meets that is no wider than a cell: 8 at most.
template <typename F>
void for_each_cell(double cell, Vec3d low, Vec3d high, F&& visit) {
  const auto first = [&](double v) { return std::floor(v / cell); };
  const Vec3d a = {first(low.x), first(low.y), first(low.z)}, b = {first(high.x), first(high.y), first(high.z)};
  for (unsigned k = 0; k < 8; ++k) {
    const bool x = (k & 1U) != 0, y = (k & 2U) != 0, z = (k & 4U) != 0;
    if ((x && a.x == b.x) || (y && a.y == b.y) || (z && a.z == b.z)) continue;
    visit(cell_number(cell, x ? b.x : a.x, y ? b.y : a.y, z ? b.z : a.z));
  }
}

struct InCell {
  std::uint64_t cell;
  Index id;
  auto operator<=>(const InCell&) const = default;
};

/// Says which closed parts lie inside which: parity of the crossings of a ray along +x. Triangles are found by a grid
/// over (y, z); whether the ray passes through one is decided exactly, so that it meets neighbours' common edges once.
class Nesting {
 public:
  Nesting(const std::vector<Vec3d>& positions, const std::vector<Triangle>& triangles,
          const std::vector<Index>& part_of, const std::vector<bool>& closed)
      : positions_(positions), triangles_(triangles), part_of_(part_of), closed_(closed), crossings_(closed.size(), 0) {
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      if (!closed[part_of[t]]) continue;
      for (const Index corner : triangles[t]) box_.add(positions[corner]);
    }
    // As fine as keeps the lists short; few huge triangles make it coarse.
    for (cells_ = std::clamp<int>(static_cast<int>(std::sqrt(static_cast<double>(triangles.size()))), 1, 1024);
         cells_ > 1; cells_ /= 2) {
      if (entry_count() <= 8 * triangles.size() + 1024) break;
    }
    start_.assign(static_cast<std::size_t>(cells_) * static_cast<std::size_t>(cells_) + 1, 0);
    for_each_entry([&](std::size_t cell, Index) { ++start_[cell + 1]; });
    std::partial_sum(start_.begin(), start_.end(), start_.begin());
    entries_.resize(start_.back());
    std::vector<std::size_t> fill(start_.begin(), start_.end() - 1);
    for_each_entry([&](std::size_t cell, Index t) { entries_[fill[cell]++] = t; });
    budget_ = 64 * triangles.size() + 400'000'000;
  }

  /// Returns the closed parts around a point, sorted. Beyond a bound on the whole work (absurd nestings) it answers
  /// "none".
  std::vector<Index> around(Vec3d p) {
    std::vector<Index> inside;
    touched_.clear();
    const std::size_t c =
        cell(p.y, box_.low.y, box_.high.y) * static_cast<std::size_t>(cells_) + cell(p.z, box_.low.z, box_.high.z);
    for (std::size_t k = start_[c]; k < start_[c + 1]; ++k) {
      if (budget_ == 0) return {};
      --budget_;
      const Index t = entries_[k];
      if (!passes(p, t)) continue;
      if (crossings_[part_of_[t]]++ == 0) touched_.push_back(part_of_[t]);
    }
    for (const Index part : touched_) {
      if (crossings_[part] % 2 == 1) inside.push_back(part);
      crossings_[part] = 0;
    }
    std::ranges::sort(inside);
    return inside;
  }

 private:
  [[nodiscard]] std::size_t cell(double value, double low, double high) const noexcept {
    const double share = high > low ? (value - low) / (high - low) : 0.0;
    return static_cast<std::size_t>(std::clamp(share * cells_, 0.0, static_cast<double>(cells_ - 1)));
  }
  struct Span {
    std::size_t y0, y1, z0, z1;
  };
  [[nodiscard]] Span span_of(Index t) const noexcept {
    Box3d b;
    for (const Index corner : triangles_[t]) b.add(positions_[corner]);
    return {cell(b.low.y, box_.low.y, box_.high.y), cell(b.high.y, box_.low.y, box_.high.y),
            cell(b.low.z, box_.low.z, box_.high.z), cell(b.high.z, box_.low.z, box_.high.z)};
  }
  [[nodiscard]] std::size_t entry_count() const noexcept {
    std::size_t sum = 0;
    for (Index t = 0; t < triangles_.size(); ++t) {
      if (!closed_[part_of_[t]]) continue;
      const Span s = span_of(t);
      sum += (s.y1 - s.y0 + 1) * (s.z1 - s.z0 + 1);
    }
    return sum;
  }
  template <typename F>
  void for_each_entry(F&& visit) const {
    for (Index t = 0; t < triangles_.size(); ++t) {
      if (!closed_[part_of_[t]]) continue;
      const Span s = span_of(t);
      for (std::size_t y = s.y0; y <= s.y1; ++y)
        for (std::size_t z = s.z0; z <= s.z1; ++z) visit(y * static_cast<std::size_t>(cells_) + z, t);
    }
  }
  /// Returns whether the ray from p along +x passes through triangle t.
  [[nodiscard]] bool passes(Vec3d p, Index t) const noexcept {
    const Triangle& corners = triangles_[t];
    bool within = false;
    for (std::size_t k = 0; k < 3; ++k) {
      Vec3d low = positions_[corners[k]];
      Vec3d high = positions_[corners[(k + 1) % 3]];
      if ((low.z > p.z) == (high.z > p.z)) continue;
      if (low.z > high.z) std::swap(low, high);
      if (detail::orientation({low.y, low.z}, {high.y, high.z}, {p.y, p.z}) > 0) within = !within;
    }
    if (!within) return false;
    const Vec3d a = positions_[corners[0]] - p;
    const Vec3d n = cross(positions_[corners[1]] - p - a, positions_[corners[2]] - p - a);
    return n.x > 0.0 ? dot(n, a) > 0.0 : dot(n, a) < 0.0;
  }

  const std::vector<Vec3d>& positions_;
  const std::vector<Triangle>& triangles_;
  const std::vector<Index>& part_of_;
  const std::vector<bool>& closed_;
  Box3d box_;
  int cells_ = 1;
  std::vector<std::size_t> start_;
  std::vector<Index> entries_;
  std::vector<Index> crossings_;
  std::vector<Index> touched_;
  std::size_t budget_ = 0;
};

class Repairer {
 public:
  Repairer(const TriangleMesh& soup, const Progress& progress)
      : soup_(soup), progress_(progress), coloured_(!soup.colours.empty()) {
    mesh_.unit = soup.unit;
  }

  Result<Repaired> run() {
    using Step = void (Repairer::*)();
    constexpr std::array<Step, 8> kSteps = {&Repairer::weld,          &Repairer::drop_duplicates, &Repairer::sew,
                                            &Repairer::resolve_flat,  &Repairer::orient,          &Repairer::split,
                                            &Repairer::turn_outwards, &Repairer::drop_unused};
    for (std::size_t k = 0; k < kSteps.size(); ++k) {
      progress_("repair", static_cast<double>(k) / kSteps.size());
      if (progress_.cancelled()) return fail(Errc::Cancelled, "repair was cancelled");
      (this->*kSteps[k])();
      if (mesh_.triangles.empty() && report_.nonfinite_triangles > 0)
        return fail(Errc::Corrupt, "the mesh has no triangle with area among those with finite coordinates; " +
                                       std::to_string(report_.nonfinite_triangles) +
                                       " have a corner that is infinite or not a number; export it again");
      if (mesh_.triangles.empty())
        return fail(Errc::Corrupt, "the mesh has no triangle with area; export it again, closer to the origin");
    }
    progress_("repair", 1.0);
    return Repaired{std::move(mesh_), report_};
  }

 private:
  [[nodiscard]] Vec3d at(Index vertex) const noexcept { return mesh_.positions[vertex]; }
  [[nodiscard]] Index from(Index h) const noexcept { return mesh_.triangles[h / 3][h % 3]; }
  [[nodiscard]] Index to(Index h) const noexcept { return mesh_.triangles[h / 3][(h + 1) % 3]; }
  [[nodiscard]] Index opposite(Index h) const noexcept { return mesh_.triangles[h / 3][(h + 2) % 3]; }
  [[nodiscard]] bool flat(const Triangle& t) const noexcept { return !detail::has_area(at(t[0]), at(t[1]), at(t[2])); }

  /// Drops triangles that are not finite, merges used vertices at equal positions, drops triangles with a repeated
  /// corner.
  void weld() {
    const std::size_t count = soup_.positions.size();
    std::vector<bool> finite(count);
    for (std::size_t v = 0; v < count; ++v) finite[v] = is_finite(soup_.positions[v]);
    std::vector<bool> named(count, false);
    std::vector<bool> used(count, false);
    for (const Triangle& t : soup_.triangles) {
      for (const Index corner : t) {
        RELIEF_ASSERT(corner < count);
        named[corner] = true;
      }
      if (!finite[t[0]] || !finite[t[1]] || !finite[t[2]]) continue;
      for (const Index corner : t) used[corner] = true;
    }
    const auto used_count = static_cast<std::size_t>(std::ranges::count(used, true));
    std::vector<Index> slots(std::bit_ceil(2 * used_count + 2), kNone);
    std::vector<Index> target(count, kNone);
    mesh_.positions.reserve(used_count);
    const auto bits = [](double value) { return std::bit_cast<std::uint64_t>(value + 0.0); };  // -0 -> +0
    for (std::size_t v = 0; v < count; ++v) {
      if (!named[v]) ++report_.unused_vertices;
      if (!used[v]) continue;
      const Vec3d p = soup_.positions[v];
      std::uint64_t hash = bits(p.x) * 0x9e3779b97f4a7c15ULL;
      hash = (hash ^ (hash >> 29U) ^ bits(p.y)) * 0xbf58476d1ce4e5b9ULL;
      hash = (hash ^ (hash >> 31U) ^ bits(p.z)) * 0x94d049bb133111ebULL;
      std::size_t slot = (hash ^ (hash >> 30U)) & (slots.size() - 1);
      while (slots[slot] != kNone && mesh_.positions[slots[slot]] != p) slot = (slot + 1) & (slots.size() - 1);
      if (slots[slot] == kNone) {
        slots[slot] = static_cast<Index>(mesh_.positions.size());
        mesh_.positions.push_back(p);
        if (coloured_) mesh_.colours.push_back(soup_.colours[v]);
      } else {
        ++report_.welded_vertices;
      }
      target[v] = slots[slot];
    }
    mesh_.triangles.reserve(soup_.triangles.size());
    // Where no vertices were merged no two shells have one in common.
    if (report_.welded_vertices > 0) find_shells();
    std::size_t kept = 0;
    for (std::size_t k = 0; k < soup_.triangles.size(); ++k) {
      const Triangle& t = soup_.triangles[k];
      const Triangle w = {target[t[0]], target[t[1]], target[t[2]]};
      if (!finite[t[0]] || !finite[t[1]] || !finite[t[2]]) {
        ++report_.nonfinite_triangles;
      } else if (w[0] == w[1] || w[1] == w[2] || w[2] == w[0]) {
        ++report_.degenerate_triangles;
      } else {
        mesh_.triangles.push_back(w);
        if (!shell_of_.empty()) shell_of_[kept++] = shell_of_[k];
      }
    }
    shell_of_.resize(kept);
  }

  /// What hangs together by the vertices as the source names them: per triangle the least of these.
  void find_shells() {
    DisjointSets shells(soup_.positions.size());
    for (const Triangle& t : soup_.triangles)
      for (const Index v : {t[1], t[2]}) shells.join(t[0], v);
    shell_of_.reserve(soup_.triangles.size());
    for (const Triangle& t : soup_.triangles) shell_of_.push_back(shells.least(t[0]));
  }

  enum class Common : std::uint8_t { Triangle, Edge };
  /// Turns closed shells that are inside out and have a triangle in the same sense in common with one that is not, as
  /// given in pairs: solids on either side of a face have it in opposite senses. Or an edge; then those stay that lie
  /// within the other's box, for they may be cavities. Whether there were any.
  bool turn_shells(const std::vector<std::array<Index, 2>>& pairs, Common common) {
    std::vector<Index> ids;
    for (const auto& [t, other] : pairs)
      if (shell_of_[t] != shell_of_[other]) ids.insert(ids.end(), {shell_of_[t], shell_of_[other]});
    std::ranges::sort(ids);
    ids.erase(std::ranges::unique(ids).begin(), ids.end());
    if (ids.empty()) return false;
    const auto number_of = [&](Index shell) {
      const auto found = std::ranges::lower_bound(ids, shell);
      return found != ids.end() && *found == shell ? static_cast<Index>(found - ids.begin()) : kNone;
    };
    struct Edge {
      Index shell, low, high;
      int sense;
      [[nodiscard]] auto place() const noexcept { return std::array{shell, low, high}; }
    };
    std::vector<Edge> edges;
    std::vector<double> volumes(ids.size(), 0.0);
    std::vector<Vec3d> origins(ids.size());
    std::vector<Box3d> boxes(ids.size());
    for (Index t = 0; t < mesh_.triangles.size(); ++t) {
      const Index shell = number_of(shell_of_[t]);
      if (shell == kNone) continue;
      const auto& [a, b, c] = mesh_.triangles[t];
      if (boxes[shell].empty()) origins[shell] = at(a);
      for (const Index corner : {a, b, c}) boxes[shell].add(at(corner));
      volumes[shell] += dot(at(a) - origins[shell], cross(at(b) - origins[shell], at(c) - origins[shell]));
      for (Index h = 3 * t; h < 3 * t + 3; ++h) {
        const auto [low, high] = std::minmax({from(h), to(h)});
        edges.push_back({shell, low, high, from(h) == low ? 1 : -1});
      }
    }
    // Closed: as many triangles run along each edge as against it.
    std::ranges::sort(edges, {}, &Edge::place);
    for (std::size_t k = 0; k < edges.size();) {
      const Edge first = edges[k];
      int sum = 0;
      for (; k < edges.size() && edges[k].place() == first.place(); ++k) sum += edges[k].sense;
      if (sum != 0) volumes[first.shell] = 0.0;
    }
    std::vector<bool> turns(ids.size(), false);
    for (const auto& [t, other] : pairs) {
      Index inside_out = number_of(shell_of_[t]), sound = number_of(shell_of_[other]);
      if (inside_out == kNone || sound == kNone) continue;
      if (volumes[inside_out] > volumes[sound]) std::swap(inside_out, sound);
      if (!(volumes[inside_out] < 0.0 && volumes[sound] > 0.0)) continue;
      const Box3d& box = boxes[inside_out];
      const bool within = boxes[sound].contains(box.low) && boxes[sound].contains(box.high);
      if (common == Common::Triangle || !within) turns[inside_out] = true;
    }
    for (Index t = 0; t < mesh_.triangles.size(); ++t)
      if (const Index shell = number_of(shell_of_[t]); shell != kNone && turns[shell])
        std::swap(mesh_.triangles[t][1], mesh_.triangles[t][2]);
    const auto turned = static_cast<std::size_t>(std::ranges::count(turns, true));
    report_.turned_parts += turned;
    return turned != 0;
  }

  /// Drops triangles with the corners of another, unless the two are a face that solids share.
  void drop_duplicates() {
    const std::size_t count = mesh_.triangles.size();
    const auto sorted = [&](Index t) {
      Triangle s = mesh_.triangles[t];
      std::ranges::sort(s);
      return s;
    };
    std::vector<Index> start(mesh_.positions.size() + 1, 0);
    for (Index t = 0; t < count; ++t) ++start[std::size_t{sorted(t)[0]} + 1];
    std::partial_sum(start.begin(), start.end(), start.begin());
    struct Entry {
      Index middle, high, triangle;
      auto operator<=>(const Entry&) const = default;
    };
    std::vector<Entry> entries(count);
    std::vector<Index> fill(start.begin(), start.end() - 1);
    for (Index t = 0; t < count; ++t) {
      const Triangle s = sorted(t);
      entries[fill[s[0]]++] = {s[1], s[2], t};
    }
    const auto sense = [&](Index t) {  // which way round its corners run
      const auto& [a, b, c] = mesh_.triangles[t];
      return (a < b) == ((b < c) == (c < a));
    };
    std::vector<bool> gone(count, false);
    std::size_t dropped = 0;
    std::vector<std::array<Index, 2>> pairs, alike;  // of opposite senses, and of the same
    for (std::size_t v = 0; v + 1 < start.size(); ++v) {
      std::sort(entries.begin() + start[v], entries.begin() + start[v + 1]);
      for (Index k = start[v]; k < start[v + 1];) {
        const Index first = entries[k].triangle;
        Index opposite = kNone;
        Index last = k + 1;
        for (; last < start[v + 1]; ++last) {
          if (entries[k].middle != entries[last].middle || entries[k].high != entries[last].high) break;
          const Index t = entries[last].triangle;
          if (opposite == kNone && sense(t) != sense(first)) opposite = t;
          if (sense(t) == sense(first)) alike.push_back({first, t});
          gone[t] = t != opposite;
          dropped += gone[t] ? 1U : 0U;
        }
        if (opposite != kNone) pairs.push_back({first, opposite});
        k = last;
      }
    }
    if (!shell_of_.empty() && !alike.empty() && turn_shells(alike, Common::Triangle)) {
      drop_duplicates();  // shared faces are in opposite senses now
    } else if (dropped != 0) {
      report_.duplicate_triangles += dropped;
      keep([&](Index t) { return !gone[t]; });
      if (!pairs.empty()) drop_duplicates();  // once more: numbers have changed
    } else if (!pairs.empty()) {
      gone = doubled_sheets(pairs);
      report_.duplicate_triangles += static_cast<std::size_t>(std::ranges::count(gone, true));
      keep([&](Index t) { return !gone[t]; });
    }
  }

  /// Of triangles that coincide and look opposite ways, both stay where two solids share a face: around each stretch of
  /// them, other triangles bound a solid on either side. The second of each pair goes where not, as in a sheet that is
  /// there twice. Which ones go.
  std::vector<bool> doubled_sheets(const std::vector<std::array<Index, 2>>& pairs) {
    const std::size_t count = mesh_.triangles.size();
    std::vector<bool> gone(count, false);
    std::vector<Index> pair_of(count, kNone);
    for (Index k = 0; k < pairs.size(); ++k)
      for (const Index t : pairs[k]) pair_of[t] = k;
    DisjointSets stretches(pairs.size());
    const EdgeTable edges = make_edges(mesh_.triangles, mesh_.positions.size());
    std::vector<std::array<Index, 2>> bounds;  // a pair at an edge with others, and whether these agree
    for (std::size_t e = 0; e + 1 < edges.crowd_start.size(); ++e) {
      const auto crowd =
          std::span(edges.crowd).subspan(edges.crowd_start[e], edges.crowd_start[e + 1] - edges.crowd_start[e]);
      Index one = kNone;
      int along = 0, against = 0;  // single triangles
      for (const Index h : crowd) {
        const Index pair = pair_of[h / 3];
        if (pair == kNone) {
          ++(from(h) < to(h) ? along : against);
        } else if (one == kNone) {
          one = pair;
        } else {
          stretches.join(pair, one);
        }
      }
      if (one != kNone && along + against != 0) bounds.push_back({one, along == against ? 1U : 0U});
    }
    std::vector<bool> bounded(pairs.size(), false), broken(pairs.size(), false);
    for (const auto& [pair, agree] : bounds) (agree != 0 ? bounded : broken)[stretches.least(pair)] = true;
    for (Index k = 0; k < pairs.size(); ++k)
      for (Index h = 3 * pairs[k][0]; h < 3 * pairs[k][0] + 3; ++h)
        if (edges.twin[h] != kMany) broken[stretches.least(k)] = true;  // ends there
    for (Index k = 0; k < pairs.size(); ++k)
      if (!bounded[stretches.least(k)] || broken[stretches.least(k)]) gone[pairs[k][1]] = true;
    return gone;
  }

  template <typename F>
  void keep(F&& wanted) {
    std::size_t kept = 0;
    for (Index t = 0; t < mesh_.triangles.size(); ++t)
      if (wanted(t)) {
        if (!shell_of_.empty()) shell_of_[kept] = shell_of_[t];
        mesh_.triangles[kept++] = mesh_.triangles[t];
      }
    mesh_.triangles.resize(kept);
    if (!shell_of_.empty()) shell_of_.resize(kept);
  }

  /// Welds open edges to those that lie along them with all but the same corners and run the other way: files that give
  /// each triangle corners of its own, rounded on their own, come apart along such seams. Only where each of two edges
  /// has no other to go with, no vertex goes farther than its triangles' size allows, and no edge gets more than two
  /// triangles by it. The class of vertices that become one takes the place of its first.
  void sew() {
    edges_ = make_edges(mesh_.triangles, mesh_.positions.size());
    const std::vector<Index> open = open_edges();
    if (open.empty()) return;
    const double size = diagonal(bounds(mesh_));
    if (!std::isfinite(size)) return;
    const std::vector<double> reach = seam_reach(open, kSeam * size);
    std::vector<std::array<Index, 2>> seams = find_seams(open, reach, kSeam * size);
    std::vector<Index> root;
    constexpr int kRounds = 16;  // for time; a few do
    for (int round = 0; !seams.empty() && round < kRounds; ++round) {
      if (progress_.cancelled()) return;
      root = join_seams(seams);
      const std::vector<bool> bad = bad_joins(root, reach);
      if (bad.empty()) break;
      if (round + 1 == kRounds) seams.clear();
      std::erase_if(seams, [&](const auto& seam) { return bad[root[from(seam[0])]] || bad[root[to(seam[0])]]; });
    }
    if (seams.empty()) return;
    for (Index v = 0; v < root.size(); ++v) {
      if (root[v] == v) continue;
      ++report_.sewn_vertices;
      report_.sewn_most = std::max(report_.sewn_most, length(at(v) - at(root[v])) / size);
    }
    for (Triangle& t : mesh_.triangles)
      for (Index& corner : t) corner = root[corner];
    drop_duplicates();
    edges_ = make_edges(mesh_.triangles, mesh_.positions.size());
  }

  [[nodiscard]] std::vector<Index> open_edges() const {
    std::vector<Index> open;
    for (Index h = 0; h < edges_.twin.size(); ++h)
      if (edges_.twin[h] == kNone) open.push_back(h);
    return open;
  }

  /// Returns how far the vertices of open edges may go: `most`, and 10 % of the shortest edge of the triangles around.
  [[nodiscard]] std::vector<double> seam_reach(const std::vector<Index>& open, double most) const {
    constexpr double kShare = 0.1;
    std::vector<double> reach(mesh_.positions.size(), 0.0);
    for (const Index h : open) reach[from(h)] = reach[to(h)] = most;
    for (Index t = 0; t < mesh_.triangles.size(); ++t) {
      const auto& [a, b, c] = mesh_.triangles[t];
      if (reach[a] + reach[b] + reach[c] == 0.0) continue;
      const double shortest = std::min({length(at(b) - at(a)), length(at(c) - at(b)), length(at(a) - at(c))});
      for (const Index v : {a, b, c}) reach[v] = std::min(reach[v], kShare * shortest);
    }
    return reach;
  }

  /// Pairs of open edges of which each is the other's only counterpart.
  [[nodiscard]] std::vector<std::array<Index, 2>> find_seams(const std::vector<Index>& open,
                                                             const std::vector<double>& reach, double most) const {
    // By the place of their middles; cells are smaller for short edges, so that they are not crowded. Each edge stands
    // in all cells where its counterpart may.
    std::vector<InCell> entries;
    entries.reserve(open.size() + open.size() / 4);
    const Vec3d low = bounds(mesh_).low;
    for (Index k = 0; k < open.size(); ++k) {
      const Vec3d a = at(from(open[k])) - low, b = at(to(open[k])) - low;
      const double r = std::max(reach[from(open[k])], reach[to(open[k])]);
      const double size = length(b - a);
      if (!(r > 0.0 && size > 2 * r)) continue;
      const Vec3d middle = a * 0.5 + b * 0.5, around = {r, r, r};
      const int shortest = std::ilogb(size - 2 * r), longest = std::ilogb(size + 2 * r);
      const int finest = std::ilogb(most) + 6;
      const auto stand = [&](int level) {
        for_each_cell(std::ldexp(1.0, std::min(level, finest)), middle - around, middle + around,
                      [&](std::uint64_t cell) { entries.push_back({cell, k}); });
      };
      stand(shortest);
      if (std::min(longest, finest) != std::min(shortest, finest)) stand(longest);
    }
    std::ranges::sort(entries);
    const auto near = [&](Index v, Index w) {
      const double r = std::min(reach[v], reach[w]);
      const Vec3d d = at(v) - at(w);
      return dot(d, d) <= r * r;
    };
    std::vector<Index> partner(open.size(), kNone);  // kMany: more than one edge lies there, or too many to look at
    const auto meet = [&](Index k, Index with) { partner[k] = partner[k] == kNone ? with : kMany; };
    constexpr std::ptrdiff_t kCrowd = 64;
    for (auto first = entries.begin(); first != entries.end();) {
      auto last = first + 1;
      while (last != entries.end() && last->cell == first->cell) ++last;
      for (auto one = first; one != last; ++one) {
        if (last - first > kCrowd) partner[one->id] = kMany;
        if (last - first > kCrowd) continue;
        for (auto other = one + 1; other != last; ++other) {
          const Index h = open[one->id], g = open[other->id];
          if (partner[one->id] == other->id) continue;  // met in another cell
          if (!near(from(h), to(g)) || !near(to(h), from(g))) continue;
          // Triangles that lie upon each other are no neighbours.
          const bool apart = !near(opposite(h), opposite(g));
          meet(one->id, apart ? other->id : kMany);
          meet(other->id, apart ? one->id : kMany);
        }
      }
      first = last;
    }
    std::vector<std::array<Index, 2>> seams;
    for (Index k = 0; k < open.size(); ++k) {
      const Index other = partner[k];
      if (other < open.size() && k < other && partner[other] == k) seams.push_back({open[k], open[other]});
    }
    return seams;
  }

  /// Per vertex the first of those that it becomes one with when the seams are sewn.
  [[nodiscard]] std::vector<Index> join_seams(const std::vector<std::array<Index, 2>>& seams) const {
    DisjointSets joined(mesh_.positions.size());
    for (const auto& [h, g] : seams) {
      joined.join(from(h), to(g));
      joined.join(to(h), from(g));
    }
    std::vector<Index> root(mesh_.positions.size());
    for (Index v = 0; v < root.size(); ++v) root[v] = joined.least(v);
    return root;
  }

  /// Returns the vertices at which joining goes too far: one would leave its place by more than its reach, or an edge
  /// would get a third triangle, or a second that runs the same way. Empty: none.
  [[nodiscard]] std::vector<bool> bad_joins(const std::vector<Index>& root, const std::vector<double>& reach) const {
    std::vector<bool> bad;
    const auto mark = [&](Index v) {
      bad.resize(root.size(), false);
      bad[v] = true;
    };
    for (Index v = 0; v < root.size(); ++v)
      if (root[v] != v && length(at(v) - at(root[v])) > reach[v]) mark(root[v]);
    std::vector<Triangle> joined = mesh_.triangles;
    for (Triangle& t : joined)
      for (Index& corner : t) corner = root[corner];
    const EdgeTable edges = make_edges(joined, root.size());
    const auto new_ends = [&](Index h, Index g) { return std::minmax(from(h), to(h)) != std::minmax(from(g), to(g)); };
    const auto mark_ends = [&](Index h) {
      mark(root[from(h)]);
      mark(root[to(h)]);
    };
    for (std::size_t k = 0; k + 1 < edges.crowd_start.size(); ++k)
      for (Index e = edges.crowd_start[k] + 1; e < edges.crowd_start[k + 1]; ++e)
        if (new_ends(edges.crowd[e - 1], edges.crowd[e])) mark_ends(edges.crowd[e]);
    for (Index h = 0; h < edges.twin.size(); ++h) {
      const Index g = edges.twin[h];
      if (g != kNone && g != kMany && root[from(h)] == root[from(g)] && new_ends(h, g)) mark_ends(h);
    }
    return bad;
  }

  /// A triangle without area has one corner on the opposite edge. Dropping it would leave a gap of no width but an open
  /// edge in the mesh, so that edge is flipped instead where one other triangle lies behind it. What remains is
  /// dropped.
  void resolve_flat() {
    std::vector<Index> work;
    for (Index t = 0; t < mesh_.triangles.size(); ++t)
      if (flat(mesh_.triangles[t])) work.push_back(t);
    if (work.empty()) return;
    // Strips of flat triangles unravel from their ends. Each flip between two flat ones shortens an edge, so this ends;
    // the bound is for time.
    std::size_t flips = 16 * work.size() + 64;
    std::vector<Index> left;
    for (bool moved = true; moved && flips > 0; std::swap(work, left)) {
      moved = false;
      left.clear();
      for (const Index t : work) {
        if (flips > 0 && flat(mesh_.triangles[t]) && flip_longest(t, edges_.twin)) {
          moved = true;
          --flips;
        }
        if (flat(mesh_.triangles[t])) left.push_back(t);
      }
      report_.flipped_triangles += work.size() - left.size();
    }
    if (!work.empty()) {
      std::vector<bool> gone(mesh_.triangles.size(), false);
      for (const Index t : work) gone[t] = true;
      report_.degenerate_triangles += work.size();
      keep([&](Index t) { return !gone[t]; });
    }
    if (report_.flipped_triangles != 0) drop_duplicates();
    edges_ = make_edges(mesh_.triangles, mesh_.positions.size());
  }

  [[nodiscard]] Index longest_edge(Index t) const noexcept {
    Index longest = 3 * t;
    double longest2 = -1.0;
    for (Index h = 3 * t; h < 3 * t + 3; ++h) {
      const Vec3d d = at(to(h)) - at(from(h));
      if (dot(d, d) <= longest2) continue;
      longest2 = dot(d, d);
      longest = h;
    }
    return longest;
  }

  /// Flips the longest edge of flat triangle t when what lies behind has area, or is flat with the same longest edge.
  bool flip_longest(Index t, std::vector<Index>& twin) {
    const Index longest = longest_edge(t);
    const Index other = twin[longest];
    if (other == kNone || other == kMany) return false;
    const Index n = other / 3;
    if (flat(mesh_.triangles[n]) && longest_edge(n) != other) return false;
    const Index b = opposite(longest);
    const Index d = opposite(other);
    const Index p = from(other);
    const Index q = to(other);
    if (b == d) return false;
    // Across the longest edge p q stands (p, q, d). The pair becomes (p, b, d) and (b, q, d).
    const bool same_way = from(longest) == p;
    const Index to_q = same_way ? next_edge(longest) : previous_edge(longest);
    const Index to_p = same_way ? previous_edge(longest) : next_edge(longest);
    const Index outside_pb = twin[to_p];
    const Index outside_bq = twin[to_q];
    const Index outside_qd = twin[next_edge(other)];
    const Index outside_dp = twin[previous_edge(other)];
    mesh_.triangles[n] = {p, b, d};
    mesh_.triangles[t] = {b, q, d};
    const auto join = [&](Index h, Index with) {
      twin[h] = with;
      if (with != kNone && with != kMany) twin[with] = h;
    };
    join(3 * n, outside_pb);
    join(3 * n + 2, outside_dp);
    join(3 * t, outside_bq);
    join(3 * t + 1, outside_qd);
    join(3 * n + 1, 3 * t + 2);
    return true;
  }

  /// Turns triangles so that neighbours across edges of exactly two agree; each patch keeps the sense of its majority.
  void orient() {
    if (!shell_of_.empty()) {
      std::vector<std::array<Index, 2>> touching;
      for (std::size_t e = 0; e + 1 < edges_.crowd_start.size(); ++e)
        for (Index k = edges_.crowd_start[e] + 1; k < edges_.crowd_start[e + 1]; ++k)
          if (shell_of_[edges_.crowd[k] / 3] != shell_of_[edges_.crowd[k - 1] / 3])
            touching.push_back({edges_.crowd[k - 1] / 3, edges_.crowd[k] / 3});
      if (turn_shells(touching, Common::Edge)) edges_ = make_edges(mesh_.triangles, mesh_.positions.size());
      free_memory(shell_of_);
    }
    const auto count = static_cast<Index>(mesh_.triangles.size());
    std::vector<std::uint8_t> state(count, 0);  // 1: stays, 2: turns
    std::vector<Index> patch;
    std::size_t turned = 0;
    for (Index seed = 0; seed < count; ++seed) {
      if (state[seed] != 0) continue;
      patch.assign(1, seed);
      state[seed] = 1;
      std::size_t against = 0;
      for (std::size_t k = 0; k < patch.size(); ++k) {
        const Index t = patch[k];
        for (Index h = 3 * t; h < 3 * t + 3; ++h) {
          const Index other = edges_.twin[h];
          if (other == kNone || other == kMany || state[other / 3] != 0) continue;
          const bool agrees = from(h) != from(other);
          state[other / 3] = agrees ? state[t] : static_cast<std::uint8_t>(3 - state[t]);
          against += state[other / 3] == 2 ? 1U : 0U;
          patch.push_back(other / 3);
        }
      }
      const std::uint8_t minority = 2 * against > patch.size() ? 1 : 2;
      for (const Index t : patch) {
        if (state[t] != minority) continue;
        std::swap(mesh_.triangles[t][1], mesh_.triangles[t][2]);
        ++turned;
      }
    }
    report_.turned_triangles = turned;
    if (turned != 0) edges_ = make_edges(mesh_.triangles, mesh_.positions.size());
  }

  /// Decides who is whose neighbour at crowded edges, cuts what cannot be oriented, and gives every fan a vertex of its
  /// own.
  void split() {
    std::vector<Index>& twin = edges_.twin;
    for (Index h = 0; h < twin.size(); ++h) {
      const Index other = twin[h];
      if (other == kNone || other == kMany || from(h) != from(other)) continue;
      twin[h] = twin[other] = kNone;
      ++report_.cut_seams;
    }
    for (std::size_t k = 0; k + 1 < edges_.crowd_start.size(); ++k) {
      pair_around(
          std::span(edges_.crowd).subspan(edges_.crowd_start[k], edges_.crowd_start[k + 1] - edges_.crowd_start[k]));
      ++report_.split_edges;
    }
    give_fans_vertices();
    if (report_.split_vertices != 0 || report_.cut_seams != 0 || report_.split_edges != 0) part_shared_edges();
  }

  /// Pairs the half-edges of one edge so that each pair encloses material: sorted by angle around the edge, a triangle
  /// that runs against the edge opens a wedge of material and one that runs along it closes it.
  void pair_around(std::span<const Index> crowd) {
    std::vector<Index>& twin = edges_.twin;
    const Index u = std::min(from(crowd[0]), to(crowd[0]));
    const Index v = std::max(from(crowd[0]), to(crowd[0]));
    const Vec3d axis = normalized(at(v) - at(u));
    const auto away = [&](Index h) {
      const Vec3d d = at(opposite(h)) - at(u);
      return d - axis * dot(axis, d);
    };
    const Vec3d first = normalized(away(crowd[0]));
    const Vec3d second = cross(axis, first);
    struct Wing {
      double angle;  // grows with the angle from `first`, -2 .. 2
      Index half_edge;
    };
    std::vector<Wing> wings;
    for (const Index h : crowd) {
      twin[h] = kNone;
      const Vec3d d = away(h);
      const double x = dot(d, first);
      const double y = dot(d, second);
      const double size = std::abs(x) + std::abs(y);
      const double slope = size > 0.0 ? y / size : 0.0;
      wings.push_back({x >= 0.0 ? slope : slope >= 0.0 ? 2.0 - slope : -2.0 - slope, h});
    }
    std::ranges::sort(wings, [](const Wing& a, const Wing& b) {
      return a.angle != b.angle ? a.angle < b.angle : a.half_edge < b.half_edge;
    });
    // Where solids touch, the material of one ends before that of the other begins, whatever rounding says of the
    // angles. The round starts behind the widest gap, so that none that touch lie on either side of its start.
    std::size_t begin = 0;
    double widest = wings.front().angle + 4.0 - wings.back().angle;
    for (std::size_t k = 1; k < wings.size(); ++k) {
      const double gap = wings[k].angle - wings[k - 1].angle;
      if (gap > widest) {
        widest = gap;
        begin = k;
      }
    }
    std::ranges::rotate(wings, wings.begin() + static_cast<std::ptrdiff_t>(begin));
    const auto touches = [](const Wing& a, const Wing& b) {
      constexpr double kSame = 1e-6;  // about the angle, rad; single precision gives 1e-7 of a length
      const double gap = b.angle - a.angle;
      return (gap < 0.0 ? gap + 4.0 : gap) <= kSame;
    };
    for (auto group = wings.begin(); group != wings.end();) {
      auto last = group + 1;
      while (last != wings.end() && touches(last[-1], *last)) ++last;
      std::stable_partition(group, last, [&](const Wing& w) { return from(w.half_edge) != v; });
      group = last;
    }
    // Twice round, since a wedge may span the start.
    std::vector<Index> opened;
    for (std::size_t k = 0; k < 2 * wings.size(); ++k) {
      const Index h = wings[k % wings.size()].half_edge;
      if (twin[h] != kNone) continue;
      if (from(h) == v) {
        if (k < wings.size()) opened.push_back(h);
      } else if (!opened.empty()) {
        twin[h] = opened.back();
        twin[opened.back()] = h;
        opened.pop_back();
      }
    }
  }

  /// One vertex per fan: the first fan around a vertex keeps it, each further one gets a copy.
  void give_fans_vertices() {
    const std::vector<Index>& twin = edges_.twin;
    const auto half_edges = static_cast<Index>(twin.size());
    std::vector<Triangle> triangles = mesh_.triangles;
    std::vector<bool> seen(half_edges, false);
    std::vector<std::uint8_t> fans(mesh_.positions.size(), 0);
    for (Index seed = 0; seed < half_edges; ++seed) {
      if (seen[seed]) continue;
      const Index vertex = from(seed);
      Index id = vertex;
      if (fans[vertex] != 0) {
        if (fans[vertex] == 1) ++report_.split_vertices;
        fans[vertex] = 2;
        id = static_cast<Index>(mesh_.positions.size());
        mesh_.positions.push_back(at(vertex));
        if (coloured_) mesh_.colours.push_back(Rgba8(mesh_.colours[vertex]));
      } else {
        fans[vertex] = 1;
      }
      const auto claim = [&](Index h) {
        seen[h] = true;
        triangles[h / 3][h % 3] = id;
      };
      claim(seed);
      Index h = twin[previous_edge(seed)];
      for (; h != kNone && h != seed; h = twin[previous_edge(h)]) claim(h);
      if (h == seed) continue;
      for (h = twin[seed]; h != kNone; h = twin[next_edge(h)]) claim(next_edge(h));
    }
    mesh_.triangles = std::move(triangles);
  }

  /// Two sheets that were cut apart along an edge may still share both its ends. Then all but one of them get a vertex
  /// of their own in the middle of the edge.
  void part_shared_edges() {
    const std::vector<Index>& twin = edges_.twin;
    const EdgeTable shared = make_edges(mesh_.triangles, mesh_.positions.size());
    std::vector<std::pair<Index, Index>> middles;  // half-edge, its new vertex
    const auto add_middle = [&](Index h) {
      const auto id = static_cast<Index>(mesh_.positions.size());
      mesh_.positions.push_back(at(from(h)) * 0.5 + at(to(h)) * 0.5);
      if (coloured_) mesh_.colours.push_back(Rgba8(mesh_.colours[from(h)]));
      middles.emplace_back(h, id);
      if (twin[h] != kNone) middles.emplace_back(twin[h], id);
    };
    for (std::size_t k = 0; k + 1 < shared.crowd_start.size(); ++k) {
      const auto crowd =
          std::span(shared.crowd).subspan(shared.crowd_start[k], shared.crowd_start[k + 1] - shared.crowd_start[k]);
      for (const Index h : crowd) {
        const bool first = h == crowd[0] || twin[h] == crowd[0];
        if (!first && (twin[h] == kNone || h < twin[h])) add_middle(h);
      }
    }
    for (Index h = 0; h < shared.twin.size(); ++h) {
      const Index other = shared.twin[h];
      if (other != kNone && other != kMany && other != twin[h] && h < other) add_middle(other);
    }
    if (!middles.empty()) {
      std::ranges::sort(middles);
      for (std::size_t k = 0; k < middles.size();) {
        const Index t = middles[k].first / 3;
        std::array<Index, 3> middle = {kNone, kNone, kNone};
        for (; k < middles.size() && middles[k].first / 3 == t; ++k) middle[middles[k].first % 3] = middles[k].second;
        cut_triangle(t, middle);
      }
    }
    edges_ = make_edges(mesh_.triangles, mesh_.positions.size());
  }

  /// Replaces a triangle by the pieces that new vertices on its edges make of it.
  void cut_triangle(Index t, const std::array<Index, 3>& middle) {
    const Triangle corners = mesh_.triangles[t];
    std::vector<Index> ring;
    for (std::size_t k = 0; k < 3; ++k) {
      ring.push_back(corners[k]);
      if (middle[k] != kNone) ring.push_back(middle[k]);
    }
    bool first = true;
    const auto put = [&](Triangle piece) {
      first ? void(mesh_.triangles[t] = piece) : mesh_.triangles.push_back(piece);
      first = false;
    };
    if (ring.size() == 6) {
      put({ring[1], ring[3], ring[5]});
      put({ring[0], ring[1], ring[5]});
      put({ring[2], ring[3], ring[1]});
      put({ring[4], ring[5], ring[3]});
      return;
    }
    // Start at a middle, so that no piece has three points of one edge.
    std::size_t start = 0;
    while (std::ranges::find(corners, ring[start]) != corners.end()) ++start;
    std::ranges::rotate(ring, ring.begin() + static_cast<std::ptrdiff_t>(start));
    if (ring.size() == 5 && std::ranges::find(middle, ring[2]) != middle.end()) {
      // middle, corner, middle, corner, corner
      put({ring[0], ring[1], ring[2]});
      put({ring[0], ring[2], ring[3]});
      put({ring[0], ring[3], ring[4]});
      return;
    }
    for (std::size_t k = 1; k + 1 < ring.size(); ++k) put({ring[0], ring[k], ring[k + 1]});
  }

  /// Finds the parts and their rims, and turns closed parts that are inside out.
  void turn_outwards() {
    const std::vector<Index>& twin = edges_.twin;
    const auto count = static_cast<Index>(mesh_.triangles.size());
    std::vector<Index> part_of(count, kNone);
    std::vector<Index> part;
    std::vector<bool> closed;
    std::vector<double> volume;
    std::vector<Box3d> boxes;
    std::vector<std::array<Index, 2>> range;  // into `order`
    std::vector<Index> order;
    for (Index seed = 0; seed < count; ++seed) {
      if (part_of[seed] != kNone) continue;
      const auto id = static_cast<Index>(closed.size());
      part.assign(1, seed);
      part_of[seed] = id;
      bool whole = true;
      double six = 0.0;
      Box3d box;
      const Vec3d origin = at(mesh_.triangles[seed][0]);
      for (std::size_t k = 0; k < part.size(); ++k) {
        const Triangle& t = mesh_.triangles[part[k]];
        six += dot(at(t[0]) - origin, cross(at(t[1]) - origin, at(t[2]) - origin));
        for (const Index corner : t) box.add(at(corner));
        for (Index h = 3 * part[k]; h < 3 * part[k] + 3; ++h) {
          whole = whole && twin[h] != kNone;
          if (twin[h] == kNone || part_of[twin[h] / 3] != kNone) continue;
          part_of[twin[h] / 3] = id;
          part.push_back(twin[h] / 3);
        }
      }
      closed.push_back(whole);
      volume.push_back(six);
      boxes.push_back(box);
      range.push_back({static_cast<Index>(order.size()), static_cast<Index>(order.size() + part.size())});
      order.insert(order.end(), part.begin(), part.end());
    }
    report_.parts = closed.size();
    count_rims();
    count_corners_on_edges();

    bool inside_out = false;
    for (std::size_t k = 0; k < closed.size(); ++k) inside_out = inside_out || (closed[k] && volume[k] < 0.0);
    if (!inside_out) return;
    std::vector<Index> by_size;
    for (Index k = 0; k < closed.size(); ++k)
      if (closed[k]) by_size.push_back(k);
    std::ranges::stable_sort(by_size, [&](Index a, Index b) { return std::abs(volume[a]) > std::abs(volume[b]); });
    Nesting nesting(mesh_.positions, mesh_.triangles, part_of, closed);
    std::vector<bool> turns(closed.size(), false);
    for (const Index k : by_size) {
      // Inside another part only where several of its points agree; parts that merely overlap are not nested.
      std::vector<Index> around;
      if (by_size.size() > 1) {
        const Index first = range[k][0];
        const Index size = range[k][1] - first;
        for (Index sample = 0; sample < 5; ++sample) {
          const Index t = order[first + static_cast<Index>(std::uint64_t{size} * sample / 5)];
          std::vector<Index> here = nesting.around(at(mesh_.triangles[t][0]));
          std::vector<Index> both;
          std::ranges::set_intersection(around, here, std::back_inserter(both));
          around = sample == 0 ? std::move(here) : std::move(both);
          if (around.empty()) break;
        }
        std::erase_if(around, [&](Index other) {
          return other == k || std::abs(volume[other]) <= std::abs(volume[k]) || !boxes[other].contains(boxes[k].low) ||
                 !boxes[other].contains(boxes[k].high);
        });
      }
      // How often the space just outside this part is filled, and whether the nearest part around it was turned.
      int filled = 0;
      bool parent_turns = false;
      double parent_size = -1.0;
      for (const Index other : around) {
        filled += (volume[other] > 0.0) != turns[other] ? 1 : -1;
        if (parent_size < 0.0 || std::abs(volume[other]) < parent_size) {
          parent_size = std::abs(volume[other]);
          parent_turns = turns[other];
        }
      }
      const bool outwards = (volume[k] > 0.0) != parent_turns;
      turns[k] = outwards ? parent_turns : filled > 0 ? parent_turns : !parent_turns;
      if (!turns[k] || volume[k] == 0.0) continue;
      ++report_.turned_parts;
      for (Index at_triangle = range[k][0]; at_triangle < range[k][1]; ++at_triangle) {
        Triangle& t = mesh_.triangles[order[at_triangle]];
        std::swap(t[1], t[2]);
      }
    }
  }

  void count_rims() {
    std::vector<Index> leaving(mesh_.positions.size(), kNone);
    const auto half_edges = static_cast<Index>(edges_.twin.size());
    for (Index h = 0; h < half_edges; ++h)
      if (edges_.twin[h] == kNone) leaving[from(h)] = h;
    std::vector<bool> seen(half_edges, false);
    for (Index h = 0; h < half_edges; ++h) {
      if (edges_.twin[h] != kNone || seen[h]) continue;
      ++report_.boundary_loops;
      for (Index along = h; along != kNone && !seen[along]; along = leaving[to(along)]) seen[along] = true;
    }
  }

  /// Where sheets lie along each other without common corners, those of one lie on open edges of the other.
  void count_corners_on_edges() {
    constexpr std::size_t kMostEdges = std::size_t{1} << 20U;  // for time
    const std::vector<Index> open = open_edges();
    const double near = kSeam * diagonal(bounds(mesh_));
    double sum = 0.0;
    for (const Index h : open) sum += length(at(to(h)) - at(from(h)));
    if (open.size() > kMostEdges || !(near > 0.0) || !std::isfinite(sum)) return;
    // Corners by their cells; edges are looked at in pieces no longer than a cell.
    const double step = std::max(sum / static_cast<double>(open.size()), 16 * near);
    const double cell = 1.25 * step;
    const Vec3d low = bounds(mesh_).low;
    std::vector<InCell> corners;
    for (const Index h : open) {
      const Vec3d p = at(from(h)) - low;
      for_each_cell(cell, p, p, [&](std::uint64_t number) { corners.push_back({number, from(h)}); });
    }
    std::ranges::sort(corners);
    std::vector<bool> found(mesh_.positions.size(), false);
    std::size_t budget = 256 * open.size();
    for (const Index h : open) {
      const Vec3d a = at(from(h)) - low, along = at(to(h)) - at(from(h));
      const double size = length(along);
      if (size <= 16 * near) continue;
      const Vec3d direction = along / size, margin = {near, near, near};
      const auto look = [&](std::uint64_t number) {
        for (auto c = std::ranges::lower_bound(corners, number, {}, &InCell::cell);
             c != corners.end() && c->cell == number && budget > 0; ++c) {
          --budget;
          const Vec3d d = at(c->id) - low - a;
          const double s = dot(d, direction);
          // Not such as lie at its ends.
          if (s <= 2 * near || s >= size - 2 * near) continue;
          const Vec3d aside = d - direction * s;
          if (dot(aside, aside) <= near * near) found[c->id] = true;
        }
      };
      const auto pieces = static_cast<std::size_t>(std::ceil(size / step));
      for (std::size_t k = 0; k < pieces; ++k) {
        Box3d piece;
        piece.add(a + along * (static_cast<double>(k) / static_cast<double>(pieces)));
        piece.add(a + along * (static_cast<double>(k + 1) / static_cast<double>(pieces)));
        for_each_cell(cell, piece.low - margin, piece.high + margin, look);
      }
    }
    report_.corners_on_edges = static_cast<std::size_t>(std::ranges::count(found, true));
  }

  void drop_unused() {
    const std::size_t dropped = coloured_ ? drop_unused_points(mesh_.triangles, mesh_.positions, mesh_.colours)
                                          : drop_unused_points(mesh_.triangles, mesh_.positions);
    report_.unused_vertices += dropped - report_.sewn_vertices;
  }

  const TriangleMesh& soup_;
  const Progress& progress_;
  bool coloured_;
  TriangleMesh mesh_;
  RepairReport report_;
  std::vector<Index> shell_of_;  // per triangle, while it may matter; empty: there is none
  EdgeTable edges_;
};

}  // namespace

Result<Repaired> repair(const TriangleMesh& soup, const Progress& progress) {
  RELIEF_ASSERT(soup.colours.empty() || soup.colours.size() == soup.positions.size());
  // Half-edges are numbered with 32 bits, and splitting may add a few.
  if (soup.triangles.size() > 1'300'000'000) return fail(Errc::Corrupt, "the mesh has more than 1.3 billion triangles");
  return Repairer(soup, progress).run();
}

std::string to_string(const RepairReport& report) {
  std::string text;
  const auto line = [&](std::size_t count, std::string_view one, std::string_view many) {
    if (count == 0) return;
    text += std::to_string(count) + " " + std::string(count == 1 ? one : many) + "\n";
  };
  line(report.welded_vertices, "vertex welded", "vertices welded");
  if (report.sewn_vertices > 0) {
    std::array<char, 40> most{};
    std::snprintf(most.data(), most.size(), "%.2g of the diagonal", report.sewn_most);
    const std::string what = std::string(" of open edges welded to others up to ") + most.data() + " away";
    line(report.sewn_vertices, "vertex" + what, "vertices" + what);
  }
  line(report.unused_vertices, "unused vertex dropped", "unused vertices dropped");
  line(report.nonfinite_triangles, "triangle dropped that is not finite", "triangles dropped that are not finite");
  line(report.degenerate_triangles, "triangle without area dropped", "triangles without area dropped");
  line(report.flipped_triangles, "triangle without area resolved by flipping an edge",
       "triangles without area resolved by flipping edges");
  line(report.duplicate_triangles, "duplicate triangle dropped", "duplicate triangles dropped");
  line(report.turned_triangles, "triangle turned to agree with its neighbours",
       "triangles turned to agree with their neighbours");
  line(report.turned_parts, "closed part turned outwards", "closed parts turned outwards");
  line(report.split_edges, "edge with more than two triangles split", "edges with more than two triangles split");
  line(report.split_vertices, "vertex split into fans", "vertices split into fans");
  line(report.cut_seams, "edge cut because its part cannot be oriented",
       "edges cut because their parts cannot be oriented");
  line(report.corners_on_edges,
       "corner of an open edge lies on another open edge, within 1e-06 of the diagonal: sheets lie along each other "
       "without common corners there",
       "corners of open edges lie on other open edges, within 1e-06 of the diagonal: sheets lie along each other "
       "without common corners there");
  if (!text.empty()) text.pop_back();
  return text;
}

}  // namespace relief
