#include <relief/convert/prepare/hole_filling.h>
#include <relief/convert/prepare/patching.h>
#include <relief/convert/support/sort_unique.h>

#include <algorithm>
#include <unordered_set>
#include <utility>

namespace relief::detail {
namespace {

constexpr std::size_t kLoose = 50;  // faces of a piece that is cut with what held it: about two rings around a vertex

}  // namespace

CutRegion::CutRegion(const SourceIndex& source, const Rings& rings, std::span<const std::uint8_t> patch,
                     std::span<const std::uint32_t> bad, std::size_t around, std::span<const std::uint8_t> heat)
    : source_(source), rings_(rings), patch_(patch), level_(source.faces.size(), 0) {
  mark_rings(bad, around, heat);
  while (cut_pinched() || cut_crumbs() || cut_bare()) {
  }
}

void CutRegion::cut(std::uint32_t f, std::uint8_t level) {
  if (level_[f] == 0) faces_.push_back(f);
  level_[f] = std::max(level_[f], level);
}

/// Returns the bad faces and the rings around them.
void CutRegion::mark_rings(std::span<const std::uint32_t> bad, std::size_t rings, std::span<const std::uint8_t> heat) {
  std::vector<std::vector<std::uint32_t>> fronts;  // by level
  const auto mark = [&](std::uint32_t f, std::size_t level) {
    if (level_[f] >= level) return;
    cut(f, static_cast<std::uint8_t>(level));
    if (fronts.size() <= level) fronts.resize(level + 1);
    fronts[level].push_back(f);
  };
  for (const std::uint32_t f : bad) {
    std::size_t more = 0;
    for (const std::uint32_t v : source_.faces[f]) more = std::max(more, std::size_t{heat[v]});
    mark(f, rings + more + 1);
  }
  for (std::size_t level = fronts.size(); level-- > 2;)
    for (std::size_t k = 0; k < fronts[level].size(); ++k)
      if (level_[fronts[level][k]] == level)
        for (const std::uint32_t v : source_.faces[fronts[level][k]])
          rings_.around(v, [&](std::uint32_t h) { mark(h / 3, level - 1); });
}

std::vector<std::uint32_t> CutRegion::boundary() const {
  std::vector<std::uint32_t> half_edges;
  for (const std::uint32_t f : faces_)
    for (std::uint32_t h = 3 * f; h < 3 * f + 3; ++h)
      if (!has(rings_.twins[h] / 3)) half_edges.push_back(rings_.twins[h]);
  std::sort(half_edges.begin(), half_edges.end());
  return half_edges;
}

/// Cuts all faces at points where more than one stretch of rim passes, which hold several fans; whether there were any.
bool CutRegion::cut_pinched() {
  std::vector<std::uint32_t> origins;
  for (const std::uint32_t h : boundary()) origins.push_back(source_.faces[h / 3][h % 3]);
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
bool CutRegion::cut_crumbs() {
  std::vector<std::uint32_t> large, piece;  // large: faces at the rim of pieces that stay, ascending
  bool any = false;
  for (const std::uint32_t seed : boundary()) {
    if (has(seed / 3) || std::binary_search(large.begin(), large.end(), seed / 3)) continue;
    piece.assign(1, seed / 3);
    bool is_large = false;
    for (std::size_t k = 0; k < piece.size() && !is_large; ++k)
      for (std::uint32_t h = 3 * piece[k]; h < 3 * piece[k] + 3; ++h) {
        const std::uint32_t other = rings_.twins[h] / 3;
        if (has(other) || std::find(piece.begin(), piece.end(), other) != piece.end()) continue;
        is_large = is_large || piece.size() == kLoose || std::binary_search(large.begin(), large.end(), other);
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
bool CutRegion::cut_bare() {
  std::unordered_set<std::uint32_t> sound, seen;
  std::vector<std::uint32_t> piece;
  bool any = false;
  for (const std::uint32_t seed : boundary()) {
    const std::uint32_t first = seed / 3;
    if (has(first) || patch_[first] == 0 || sound.contains(first)) continue;
    piece.assign(1, first);
    seen = {first};
    bool is_sound = false;
    for (std::size_t k = 0; k < piece.size() && !is_sound; ++k)
      for (std::uint32_t h = 3 * piece[k]; h < 3 * piece[k] + 3; ++h) {
        const std::uint32_t other = rings_.twins[h] / 3;
        if (has(other)) continue;
        is_sound = is_sound || patch_[other] == 0 || sound.contains(other);
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

/// Returns the widest piece among what is cut.
CutRegion::Piece CutRegion::widest() const {
  Piece widest;
  std::vector<std::uint32_t> left = faces_, piece;
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
        if (!has(other) || std::exchange(seen[place_of(other)], std::uint8_t{1}) != 0) continue;
        piece.push_back(other);
      }
    }
    if (const double wide = length(box.extent()); wide > widest.diagonal) {
      widest.diagonal = wide;
      widest.middle = snap(box.centre());
    }
  }
  return widest;
}

std::optional<Patches> close_with_patches(const SourceIndex& source, const Rings& rings, const CutRegion& region) {
  Patches made;
  const auto origin = [&](std::uint32_t h) { return source.faces[h / 3][h % 3]; };
  const auto target = [&](std::uint32_t h) { return source.faces[h / 3][(h + 1) % 3]; };
  for (const std::uint32_t h : region.boundary()) made.edges.emplace_back(target(h), h);
  std::sort(made.edges.begin(), made.edges.end());
  std::vector<std::uint8_t> seen(made.edges.size(), 0);
  for (std::size_t e = 0; e < made.edges.size(); ++e) {
    if (seen[e] != 0) continue;
    made.loops.emplace_back();
    for (std::size_t k = e; seen[k] == 0; k = made.edge_at(origin(made.edges[k].second))) {
      seen[k] = 1;
      made.loops.back().push_back(made.edges[k].first);
    }
    if (made.loops.back().size() < 3) return std::nullopt;
  }

  // The faces at the loops, as a mesh with numbers of its own; the patches come after them.
  std::vector<std::uint32_t> numbers;
  for (const auto& [v, h] : made.edges)
    rings.around(v, [&](std::uint32_t e) {
      if (!region.has(e / 3)) made.beside.push_back(e / 3);
    });
  sort_unique(made.beside);
  for (const std::uint32_t f : made.beside)
    numbers.insert(numbers.end(), source.faces[f].begin(), source.faces[f].end());
  sort_unique(numbers);
  const auto number_of = [&](std::uint32_t v) {
    return static_cast<std::uint32_t>(std::lower_bound(numbers.begin(), numbers.end(), v) - numbers.begin());
  };
  std::vector<Vec3d> places;
  std::vector<Face> faces;
  places.reserve(numbers.size());
  for (const std::uint32_t v : numbers) places.push_back(to_double(source.points[v]));
  for (const std::uint32_t f : made.beside) {
    const Face& t = source.faces[f];
    faces.push_back({number_of(t[0]), number_of(t[1]), number_of(t[2])});
  }
  std::vector<std::vector<std::uint32_t>> loops = made.loops;
  for (auto& loop : loops)
    for (std::uint32_t& v : loop) v = number_of(v);
  made.begins = fill_holes(places, faces, loops, std::vector<Closing>(loops.size(), Closing::Patch));

  for (std::size_t k = numbers.size(); k < places.size(); ++k) {
    numbers.push_back(static_cast<std::uint32_t>(source.points.size() + made.points.size()));
    made.points.push_back(snap(places[k]));
  }
  for (std::size_t f = made.beside.size(); f < faces.size(); ++f)
    made.faces.push_back({numbers[faces[f][0]], numbers[faces[f][1]], numbers[faces[f][2]]});
  for (std::size_t& begin : made.begins) begin -= made.beside.size();
  return made;
}

}  // namespace relief::detail
