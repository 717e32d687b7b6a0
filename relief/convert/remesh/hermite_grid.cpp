#include <relief/convert/remesh/hermite_grid.h>
#include <relief/convert/support/parallel.h>
#include <relief/convert/support/sort_unique.h>

#include <algorithm>
#include <cmath>

namespace relief::detail {
namespace {

constexpr double kSame = 1e-7;      // voxels: hits so near to each other are one, as on the edge of two triangles
constexpr float kAtCorner = 1e-6F;  // voxels: a hit so near to a corner of the grid may lie on either side of it
constexpr double kOnSkin = 1e-4;    // voxels: a crossing so near to the skin is one with it
constexpr int kBisections = 24;     // to the precision of a float

bool is_mixed(unsigned inside) noexcept { return inside != 0 && inside != 255; }

/// Returns whether the corners of a face of a cell are not all on one side.
bool is_mixed_face(unsigned inside, unsigned axis, unsigned side) noexcept {
  bool all = true, none = true;
  for (unsigned c = 0; c < 8; ++c)
    if ((c >> axis & 1U) == side) ((inside >> c & 1U) != 0 ? none : all) = false;
  return !all && !none;
}

Voxel beyond(Voxel cell, unsigned axis, unsigned side) noexcept {
  cell[axis] += side == 0 ? -1 : 1;
  return cell;
}

}  // namespace

std::optional<HermiteGrid> HermiteGrid::around(const Skin& skin, const Progress& progress) {
  HermiteGrid grid(skin);
  if (!grid.find_hits(progress)) return std::nullopt;
  grid.want_cells_at_hits();
  if (!grid.find_signs(progress) || !grid.close_holes(progress)) return std::nullopt;
  grid.sort_blocks();
  if (!grid.list_cells(progress) || !grid.list_crossings(progress)) return std::nullopt;
  grid.hits_ = {};
  return grid;
}

bool HermiteGrid::find_hits(const Progress& progress) {
  constexpr std::size_t kChunk = 1024;  // triangles
  const std::size_t count = skin_->triangles().size();
  std::vector<std::vector<Hit>> found((count + kChunk - 1) / kChunk);
  if (!for_all(found.size(), 1, progress, [&](std::size_t k) {
        for (std::size_t t = k * kChunk; t < std::min(count, (k + 1) * kChunk); ++t)
          rasterise(static_cast<std::uint32_t>(t), found[k]);
      }))
    return false;
  for (std::vector<Hit>& some : found) {
    hits_.insert(hits_.end(), some.begin(), some.end());
    some = {};
  }
  std::ranges::sort(hits_, [](const Hit& a, const Hit& b) {
    return a.edge != b.edge ? a.edge < b.edge : a.t != b.t ? a.t < b.t : a.triangle < b.triangle;
  });
  return !progress.cancelled();
}

/// Returns the lines of the grid through a triangle, axis by axis: rows of its projection. What lies on its rim counts.
void HermiteGrid::rasterise(std::uint32_t triangle, std::vector<Hit>& hits) const {
  constexpr double kRim = 1e-9;  // voxels, more than rounding
  std::array<Vec3d, 3> p;
  for (std::size_t k = 0; k < 3; ++k) p[k] = skin_->points()[skin_->triangles()[triangle][k]];
  const Vec3d normal = cross(p[1] - p[0], p[2] - p[0]);
  for (unsigned axis = 0; axis < 3; ++axis) {
    const unsigned u = (axis + 1) % 3, v = (axis + 2) % 3;
    if (normal[axis] == 0) continue;
    const auto [low_u, high_u] = std::minmax({p[0][u], p[1][u], p[2][u]});
    const auto [low, high] = std::minmax({p[0][axis], p[1][axis], p[2][axis]});
    for (double row = std::ceil(low_u - kRim); row <= high_u + kRim; ++row) {
      double from = Box3d::kFar, to = -Box3d::kFar;
      const double at = std::clamp(row, low_u, high_u);
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3d a = p[k], b = p[(k + 1) % 3];
        if (std::min(a[u], b[u]) > at || std::max(a[u], b[u]) < at) continue;
        if (a[u] == b[u]) {
          from = std::min({from, a[v], b[v]});
          to = std::max({to, a[v], b[v]});
          continue;
        }
        const double on = a[v] + (b[v] - a[v]) * ((at - a[u]) / (b[u] - a[u]));
        from = std::min(from, on);
        to = std::max(to, on);
      }
      for (double column = std::ceil(from - kRim); column <= to + kRim; ++column) {
        const double height =
            p[0][axis] - (normal[u] * (row - p[0][u]) + normal[v] * (column - p[0][v])) / normal[axis];
        const double within = std::clamp(height, low, high), step = std::floor(within);
        Voxel edge;
        edge[axis] = static_cast<std::int32_t>(step);
        edge[u] = static_cast<std::int32_t>(row);
        edge[v] = static_cast<std::int32_t>(column);
        hits.push_back({key(edge, axis), static_cast<float>(within - step), triangle});
      }
    }
  }
}

const HermiteGrid::Block* HermiteGrid::find(Voxel v) const noexcept {
  const auto found = block_of_.find(block_key(v));
  return found == block_of_.end() ? nullptr : &blocks_[found->second];
}

HermiteGrid::Block& HermiteGrid::block_with(Voxel v) {
  const auto [found, is_new] = block_of_.try_emplace(block_key(v), static_cast<std::uint32_t>(blocks_.size()));
  if (is_new) {
    blocks_.emplace_back();
    blocks_.back().low = {v.x & ~7, v.y & ~7, v.z & ~7};
  }
  return blocks_[found->second];
}

std::uint32_t HermiteGrid::index_of(Voxel v, unsigned list) const noexcept {
  const Block* block = find(v);
  const unsigned at = within(v);
  if (block == nullptr || !block->listed[list].has(at)) return kNone;
  return block->first[list] + block->listed[list].count_before(at);
}

void HermiteGrid::want_cells_at_hits() {
  std::uint64_t last = ~std::uint64_t{0};
  for (const Hit& hit : hits_) {
    constexpr std::uint64_t kMask = (1U << 20U) - 1;
    const auto axis = static_cast<unsigned>(hit.edge & 3U);
    const Voxel low = {static_cast<std::int32_t>(hit.edge >> 2U & kMask),
                       static_cast<std::int32_t>(hit.edge >> 22U & kMask), static_cast<std::int32_t>(hit.edge >> 42U)};
    // On a corner of the grid it may be a hit of either edge: no sign passes one or the other.
    if (hit.t < kAtCorner || hit.t > 1 - kAtCorner) {
      const Voxel beside = beyond(low, axis, hit.t < kAtCorner ? 0 : 1);
      block_with(beside).hit[axis].set(within(beside));
    }
    if (hit.edge == last) continue;
    last = hit.edge;
    block_with(low).hit[axis].set(within(low));
    Voxel from = low - Voxel{1, 1, 1}, to = low + Voxel{1, 1, 1};
    from[axis] = low[axis];
    for (std::int32_t z = from.z; z <= to.z; ++z)
      for (std::int32_t y = from.y; y <= to.y; ++y)
        for (std::int32_t x = from.x; x <= to.x; ++x) block_with({x, y, z}).wanted.set(within({x, y, z}));
  }
}

bool HermiteGrid::find_signs(const Progress& progress) {
  return for_all(blocks_.size(), 16, progress, [&](std::size_t b) { find_signs(blocks_[b]); });
}

/// Returns where the winding number changes at triangles alone, a sign is good for all corners that hang together by
/// edges without hits.
void HermiteGrid::find_signs(Block& block) const {
  std::vector<unsigned> front;
  for (unsigned k = 0; k < 512; ++k) {
    if (!block.wanted.has(k) || block.known.has(k)) continue;
    const auto corner = [](unsigned c) {
      return Voxel{static_cast<std::int32_t>(c & 7U), static_cast<std::int32_t>(c >> 3U & 7U),
                   static_cast<std::int32_t>(c >> 6U)};
    };
    const bool inside = skin_->is_inside(place_of(block.low + corner(k)));
    const auto settle = [&](unsigned c) {
      block.known.set(c);
      if (inside) block.inside.set(c);
      front.push_back(c);
    };
    settle(k);
    while (!front.empty()) {
      const unsigned from = front.back();
      front.pop_back();
      if (!skin_->is_closed()) continue;
      for (unsigned axis = 0; axis < 3; ++axis) {
        const unsigned step = 1U << 3U * axis, at = from >> 3U * axis & 7U;
        if (at > 0 && !block.hit[axis].has(from - step) && block.wanted.has(from - step) &&
            !block.known.has(from - step))
          settle(from - step);
        if (at < 7 && !block.hit[axis].has(from) && block.wanted.has(from + step) && !block.known.has(from + step))
          settle(from + step);
      }
    }
  }
}

HermiteGrid::Corners HermiteGrid::corners_around(const Block& block) const {
  Corners corners{};
  for (unsigned k = 0; k < 8; ++k) {
    const Voxel shift = corner_of({}, k) * kSide;
    const Block* from = k == 0 ? &block : find(block.low + shift);
    if (from == nullptr) continue;
    for (int z = shift.z; z < (shift.z == 0 ? 8 : 9); ++z)
      for (int y = shift.y; y < (shift.y == 0 ? 8 : 9); ++y)
        for (int x = shift.x; x < (shift.x == 0 ? 8 : 9); ++x) {
          const unsigned at = within({x, y, z});
          if (from->known.has(at))
            corners[static_cast<std::size_t>((z * 9 + y) * 9 + x)] = from->inside.has(at) ? 2 : 1;
        }
  }
  return corners;
}

namespace {

/// Returns the corners inside of a cell of a block, bit by bit; nothing where some are not known.
std::optional<unsigned> inside_of_cell(const std::array<std::uint8_t, 729>& corners, Voxel cell) noexcept {
  unsigned inside = 0;
  for (unsigned c = 0; c < 8; ++c) {
    const Voxel at = corner_of(cell, c);
    const std::uint8_t sign = corners[static_cast<std::size_t>((at.z * 9 + at.y) * 9 + at.x)];
    if (sign == 0) return std::nullopt;
    if (sign == 2) inside |= 1U << c;
  }
  return inside;
}

template <typename Visit>
void for_corners_of_block(Visit&& visit) {
  for (int z = 0; z < 8; ++z)
    for (int y = 0; y < 8; ++y)
      for (int x = 0; x < 8; ++x) visit(Voxel{x, y, z});
}

}  // namespace

/// Follows the change of sign from cell to cell to where no triangle is, until it comes back to itself.
bool HermiteGrid::close_holes(const Progress& progress) {
  std::vector<std::vector<Voxel>> found(blocks_.size());
  const auto sign_known = [&](Voxel v) {
    const Block* block = find(v);
    return block != nullptr && block->known.has(within(v));
  };
  const auto is_known = [&](Voxel cell) {
    for (unsigned c = 0; c < 8; ++c)
      if (!sign_known(corner_of(cell, c))) return false;
    return true;
  };
  const auto look_beyond = [&](Voxel cell, unsigned inside, std::vector<Voxel>& next) {
    if (!is_mixed(inside)) return;
    for (unsigned axis = 0; axis < 3; ++axis)
      for (const unsigned side : {0U, 1U})
        if (is_mixed_face(inside, axis, side) && !is_known(beyond(cell, axis, side)))
          next.push_back(beyond(cell, axis, side));
  };
  if (!for_all(blocks_.size(), 16, progress, [&](std::size_t b) {
        const Corners corners = corners_around(blocks_[b]);
        for_corners_of_block([&](Voxel v) {
          if (const auto inside = inside_of_cell(corners, v)) look_beyond(blocks_[b].low + v, *inside, found[b]);
        });
      }))
    return false;
  std::vector<Voxel> front;
  for (const std::vector<Voxel>& some : found) front.insert(front.end(), some.begin(), some.end());
  found = {};
  const auto before = [](Voxel a, Voxel b) { return key(a, 0) < key(b, 0); };
  const auto tidy = [&](std::vector<Voxel>& list) {
    std::ranges::sort(list, before);
    list.erase(std::unique(list.begin(), list.end()), list.end());
  };
  for (tidy(front); !front.empty();) {
    std::vector<Voxel> corners;
    for (const Voxel cell : front)
      for (unsigned c = 0; c < 8; ++c)
        if (const Voxel v = corner_of(cell, c); !sign_known(v)) corners.push_back(v);
    tidy(corners);
    std::vector<std::uint8_t> inside(corners.size());
    if (!for_all(corners.size(), 64, progress, [&](std::size_t k) {
          const Voxel v = corners[k];  // at the end of the grid everything is outside
          inside[k] = std::min({v.x, v.y, v.z}) > 1 && skin_->is_inside(place_of(v));
        }))
      return false;
    for (std::size_t k = 0; k < corners.size(); ++k) {
      Block& block = block_with(corners[k]);
      block.known.set(within(corners[k]));
      if (inside[k] != 0) block.inside.set(within(corners[k]));
    }
    std::vector<Voxel> next;
    for (const Voxel cell : front) {
      unsigned mask = 0;
      for (unsigned c = 0; c < 8; ++c)
        if (const Voxel v = corner_of(cell, c); find(v)->inside.has(within(v))) mask |= 1U << c;
      look_beyond(cell, mask, next);
    }
    front = std::move(next);
    tidy(front);
  }
  return true;
}

void HermiteGrid::sort_blocks() {
  std::ranges::sort(blocks_, [](const Block& a, const Block& b) { return block_key(a.low) < block_key(b.low); });
  for (std::uint32_t b = 0; b < blocks_.size(); ++b) block_of_[block_key(blocks_[b].low)] = b;
}

bool HermiteGrid::list_cells(const Progress& progress) {
  std::vector<std::vector<std::uint8_t>> inside(blocks_.size());
  if (!for_all(blocks_.size(), 16, progress, [&](std::size_t b) {
        const Corners corners = corners_around(blocks_[b]);
        for_corners_of_block([&](Voxel v) {
          if (const auto mask = inside_of_cell(corners, v); mask && is_mixed(*mask)) {
            blocks_[b].listed[3].set(within(v));
            inside[b].push_back(static_cast<std::uint8_t>(*mask));
          }
          const auto sign = [&](Voxel at) { return corners[static_cast<std::size_t>((at.z * 9 + at.y) * 9 + at.x)]; };
          for (unsigned axis = 0; axis < 3; ++axis)
            if (sign(v) + sign(beyond(v, axis, 1)) == 3 && sign(v) != 0 && sign(beyond(v, axis, 1)) != 0)
              blocks_[b].listed[axis].set(within(v));
        });
      }))
    return false;
  std::uint32_t crossings = 0;
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    Block& block = blocks_[b];
    block.first[3] = static_cast<std::uint32_t>(cells_.size());
    for_corners_of_block([&](Voxel v) {
      if (block.listed[3].has(within(v))) cells_.push_back(block.low + v);
    });
    inside_.insert(inside_.end(), inside[b].begin(), inside[b].end());
    for (unsigned axis = 0; axis < 3; ++axis) {
      block.first[axis] = crossings;
      crossings += block.listed[axis].count_before(511) + (block.listed[axis].has(511) ? 1 : 0);
    }
  }
  crossings_.resize(crossings);
  return true;
}

bool HermiteGrid::list_crossings(const Progress& progress) {
  std::vector<std::vector<Voxel>> buried(blocks_.size());
  if (!for_all(blocks_.size(), 16, progress, [&](std::size_t b) {
        const Block& block = blocks_[b];
        for (unsigned axis = 0; axis < 3; ++axis) {
          std::uint32_t next = block.first[axis];
          for_corners_of_block([&](Voxel v) {
            bool is_buried = block.hit[axis].has(within(v));
            if (block.listed[axis].has(within(v)))
              crossings_[next++] = crossing_on(block.low + v, axis, block.inside.has(within(v)), is_buried);
            if (is_buried) buried[b].push_back(block.low + v);
          });
        }
      }))
    return false;
  for (const std::vector<Voxel>& edges : buried)
    for (const Voxel edge : edges) mark_near_buried(edge);
  return true;
}

void HermiteGrid::mark_near_buried(Voxel edge) {
  constexpr std::int32_t kReach = 2;  // voxels: farther from its crossings no vertex lies
  Block* block = nullptr;
  for (std::int32_t z = edge.z - kReach; z <= edge.z + kReach; ++z)
    for (std::int32_t y = edge.y - kReach; y <= edge.y + kReach; ++y)
      for (std::int32_t x = edge.x - kReach; x <= edge.x + kReach; ++x) {
        const Voxel v = {x, y, z};
        if (block == nullptr || block->low != Voxel{x & ~7, y & ~7, z & ~7}) {
          const auto found = block_of_.find(block_key(v));
          block = found == block_of_.end() ? nullptr : &blocks_[found->second];
        }
        if (block != nullptr) block->near_buried.set(within(v));
      }
}

bool HermiteGrid::has_buried_skin(Vec3d near) const noexcept {
  const auto floor = [](double x) { return static_cast<std::int32_t>(std::floor(x)); };
  const Voxel at = {floor(near.x), floor(near.y), floor(near.z)};
  const Block* block = find(at);
  return block == nullptr || block->near_buried.has(within(at));
}

/// Of several hits the middle one of those where the sign changes.
GridCrossing HermiteGrid::crossing_on(Voxel low, unsigned axis, bool low_inside, bool& buried) const {
  GridCrossing crossing{.low = low, .axis = static_cast<std::uint8_t>(axis), .low_inside = low_inside, .normal = {}};
  const auto [first, last] =
      std::ranges::equal_range(hits_, key(low, axis), {}, [](const Hit& hit) { return hit.edge; });
  buried = false;
  if (first == last) return crossing_between_hits(crossing);
  const double outwards = low_inside ? 1 : -1;
  const auto take = [&](auto from, auto to) {  // hits in one place: the one that looks outwards most
    double best = -2;
    for (auto hit = from; hit != to; ++hit)
      if (const Vec3d n = skin_->normal(hit->triangle); n[axis] * outwards > best) {
        best = n[axis] * outwards;
        crossing.t = hit->t;
        crossing.triangle = hit->triangle;
        crossing.normal = to_float(n);
      }
    return best > 0;
  };
  std::vector<decltype(first)> groups = {first};
  for (auto hit = first; hit != last; ++hit)
    if (double(hit->t) - double((*groups.rbegin())->t) > kSame) groups.push_back(hit);
  groups.push_back(last);
  if (groups.size() == 2) return take(first, last) ? crossing : crossing_between_hits(crossing);
  buried = true;
  std::vector<std::size_t> changes;
  bool before = low_inside;
  for (std::size_t g = 0; g + 1 < groups.size(); ++g) {
    bool after = !low_inside;
    if (g + 2 < groups.size()) {
      Vec3d middle = place_of(low);
      middle[axis] += (double(groups[g]->t) + double(groups[g + 1]->t)) / 2;
      after = skin_->is_inside(middle);
    }
    if (before != after) changes.push_back(g);
    before = after;
  }
  const std::size_t middle = changes[changes.size() / 2];
  return take(groups[middle], groups[middle + 1]) ? crossing : crossing_between_hits(crossing);
}

/// Returns where the winding number passes one half without a hit: across a hole, or where rounding lost the hit.
GridCrossing HermiteGrid::crossing_between_hits(GridCrossing edge) const {
  double from = 0, to = 1;
  const auto at = [&](double t) {
    Vec3d p = place_of(edge.low);
    p[edge.axis] += t;
    return p;
  };
  for (int k = 0; k < kBisections; ++k) {
    const double middle = (from + to) / 2;
    (skin_->is_inside(at(middle)) == edge.low_inside ? from : to) = middle;
  }
  edge.t = static_cast<float>(from);
  const Vec3d p = at(from);
  const Skin::Place near = skin_->nearest(p);
  edge.triangle = near.distance < kOnSkin ? near.triangle : kNone;
  Vec3d normal = near.normal;
  if (edge.triangle == kNone) {
    constexpr double kStep = 0.25;  // voxels
    for (unsigned axis = 0; axis < 3; ++axis) {
      Vec3d step;
      step[axis] = kStep;
      normal[axis] = skin_->winding(p - step) - skin_->winding(p + step);
    }
    normal = normalized(normal);
  }
  edge.normal = to_float(normal);
  return edge;
}

}  // namespace relief::detail
