#include "plain_mesh.h"

#include <relief/base/assert.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <utility>

// Makes one build for the machine at hand beside one for any.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define RELIEF_CLONES [[gnu::target_clones("arch=haswell", "default")]]
#else
#define RELIEF_CLONES
#endif

namespace relief::bench {

namespace {

constexpr std::size_t kBranch = 8;
constexpr std::size_t kLeaf = PlainMesh::kLeaf, kRing = PlainMesh::kRing;

/// The bits of x with two zeros before each.
std::uint64_t spread(std::uint64_t x) noexcept {
  x = (x | x << 32U) & 0x1f00000000ffffU;
  x = (x | x << 16U) & 0x1f0000ff0000ffU;
  x = (x | x << 8U) & 0x100f00f00f00f00fU;
  x = (x | x << 4U) & 0x10c30c30c30c30c3U;
  return (x | x << 2U) & 0x1249249249249249U;
}

/// Old vertex numbers along Morton's curve.
std::vector<std::uint32_t> along_curve(const std::vector<Vec3d>& points) {
  Box3d box;
  for (const Vec3d p : points) box.add(p);
  const Vec3d size = box.extent();
  const double cells = 2097151 / std::max({size.x, size.y, size.z});
  std::vector<std::pair<std::uint64_t, std::uint32_t>> keys(points.size());
  for (std::size_t v = 0; v < points.size(); ++v) {
    const Vec3d p = (points[v] - box.low) * cells;
    keys[v] = {spread(static_cast<std::uint64_t>(p.x)) | spread(static_cast<std::uint64_t>(p.y)) << 1U |
                   spread(static_cast<std::uint64_t>(p.z)) << 2U,
               static_cast<std::uint32_t>(v)};
  }
  std::ranges::sort(keys);
  std::vector<std::uint32_t> order(points.size());
  for (std::size_t k = 0; k < keys.size(); ++k) order[k] = keys[k].second;
  return order;
}

/// The ball, as the loops need it.
struct Ball {
  float x, y, z, square, inverse;  ///< centre, radius^2, 1 / radius
  float up_x, up_y, up_z;
};

struct Coordinates {
  const float *x, *y, *z;
};
struct Moved {
  float *x, *y, *z;
};
struct Ring {
  std::array<const std::int32_t*, kRing> next;
};

/// Vertices inside the ball move along -up to where it ends.
RELIEF_CLONES std::size_t carve(const Ball& b, float* __restrict x, float* __restrict y, float* __restrict z) {
  std::int32_t changed = 0;
  for (std::size_t v = 0; v < kLeaf; ++v) {
    const float dx = x[v] - b.x, dy = y[v] - b.y, dz = z[v] - b.z;
    const float high = dx * b.up_x + dy * b.up_y + dz * b.up_z;
    const float d2 = dx * dx + dy * dy + dz * dz;
    const float way = -std::sqrt(std::max(b.square - (d2 - high * high), 0.0F)) - high;
    const bool inside = d2 < b.square && way < 0;
    const float by = inside ? way : 0.0F;
    x[v] += by * b.up_x;
    y[v] += by * b.up_y;
    z[v] += by * b.up_z;
    changed += inside ? 1 : 0;
  }
  return static_cast<std::size_t>(changed);
}

/// Along the normals.
RELIEF_CLONES std::size_t deposit(const Ball& b, float amount, const Coordinates& normal, float* __restrict x,
                                  float* __restrict y, float* __restrict z) {
  const float *const nx = normal.x, *const ny = normal.y, *const nz = normal.z;
  std::int32_t changed = 0;
  for (std::size_t v = 0; v < kLeaf; ++v) {
    const float dx = x[v] - b.x, dy = y[v] - b.y, dz = z[v] - b.z;
    const float d2 = dx * dx + dy * dy + dz * dz;
    const float by = amount * std::max(1 - std::sqrt(d2) * b.inverse, 0.0F);
    x[v] += by * nx[v];
    y[v] += by * ny[v];
    z[v] += by * nz[v];
    changed += by > 0 ? 1 : 0;
  }
  return static_cast<std::size_t>(changed);
}

RELIEF_CLONES std::size_t paint(const Ball& b, float amount, Vec3f colour, const Coordinates& at, float* __restrict red,
                                float* __restrict green, float* __restrict blue) {
  std::int32_t changed = 0;
  for (std::size_t v = 0; v < kLeaf; ++v) {
    const float dx = at.x[v] - b.x, dy = at.y[v] - b.y, dz = at.z[v] - b.z;
    const float by = amount * std::max(1 - std::sqrt(dx * dx + dy * dy + dz * dz) * b.inverse, 0.0F);
    red[v] += by * (colour.x - red[v]);
    green[v] += by * (colour.y - green[v]);
    blue[v] += by * (colour.z - blue[v]);
    changed += by > 0 ? 1 : 0;
  }
  return static_cast<std::size_t>(changed);
}

RELIEF_CLONES void find_inside(const Ball& b, float square, const Coordinates& at, std::uint8_t* __restrict inside) {
  for (std::size_t v = 0; v < kLeaf; ++v) {
    const float dx = at.x[v] - b.x, dy = at.y[v] - b.y, dz = at.z[v] - b.z;
    inside[v] = dx * dx + dy * dy + dz * dz < square ? 1 : 0;
  }
}

/// Where the vertices of a list go: towards the mean of their neighbours.
RELIEF_CLONES void smooth(const Ball& b, float amount, const std::int32_t* __restrict list, std::size_t count,
                          const Coordinates& at, const Ring& ring, const Moved& to) {
  const float *const x = at.x, *const y = at.y, *const z = at.z;
  const std::int32_t *const r0 = ring.next[0], *const r1 = ring.next[1], *const r2 = ring.next[2],
                            *const r3 = ring.next[3], *const r4 = ring.next[4], *const r5 = ring.next[5];
  float* __restrict const to_x = to.x, * __restrict const to_y = to.y, * __restrict const to_z = to.z;
  for (std::size_t k = 0; k < count; ++k) {
    const std::int32_t v = list[k], a = r0[v], c = r1[v], d = r2[v], e = r3[v], f = r4[v], g = r5[v];
    const float dx = x[v] - b.x, dy = y[v] - b.y, dz = z[v] - b.z;
    const float by = amount * std::max(1 - std::sqrt(dx * dx + dy * dy + dz * dz) * b.inverse, 0.0F);
    to_x[k] = x[v] + by * ((x[a] + x[c] + x[d] + x[e] + x[f] + x[g]) * (1.0F / 6) - x[v]);
    to_y[k] = y[v] + by * ((y[a] + y[c] + y[d] + y[e] + y[f] + y[g]) * (1.0F / 6) - y[v]);
    to_z[k] = z[v] + by * ((z[a] + z[c] + z[d] + z[e] + z[f] + z[g]) * (1.0F / 6) - z[v]);
  }
}

/// Unit normals of the vertices of a list: of the triangles around each, weighted by area. The sum of the six is the
/// area that their outer edges enclose, whatever lies between them: that of two quadrangles.
RELIEF_CLONES void find_normals(const std::int32_t* __restrict list, std::size_t count, const Coordinates& at,
                                const Ring& ring, const Moved& to) {
  const float *const x = at.x, *const y = at.y, *const z = at.z;
  const std::int32_t *const r0 = ring.next[0], *const r1 = ring.next[1], *const r2 = ring.next[2],
                            *const r3 = ring.next[3], *const r4 = ring.next[4], *const r5 = ring.next[5];
  float* __restrict const to_x = to.x, * __restrict const to_y = to.y, * __restrict const to_z = to.z;
  for (std::size_t k = 0; k < count; ++k) {
    const std::int32_t v = list[k], a = r0[v], b = r1[v], c = r2[v], d = r3[v], e = r4[v], f = r5[v];
    const float px = x[c] - x[a], py = y[c] - y[a], pz = z[c] - z[a];
    const float qx = x[d] - x[b], qy = y[d] - y[b], qz = z[d] - z[b];
    const float sx = x[e] - x[a], sy = y[e] - y[a], sz = z[e] - z[a];
    const float tx = x[f] - x[d], ty = y[f] - y[d], tz = z[f] - z[d];
    const float nx = (py * qz - pz * qy) + (sy * tz - sz * ty);
    const float ny = (pz * qx - px * qz) + (sz * tx - sx * tz);
    const float nz = (px * qy - py * qx) + (sx * ty - sy * tx);
    const float scale = 1 / std::sqrt(std::max(nx * nx + ny * ny + nz * nz, 1e-30F));
    to_x[k] = nx * scale;
    to_y[k] = ny * scale;
    to_z[k] = nz * scale;
  }
}

struct Extreme {
  float low, high;
};
RELIEF_CLONES Extreme extremes(const float* values) {
  float low = values[0], high = values[0];
  for (std::size_t v = 0; v < kLeaf; ++v) {
    low = std::min(low, values[v]);
    high = std::max(high, values[v]);
  }
  return {low, high};
}

}  // namespace

PlainMesh::PlainMesh(const Tessellation& surface) : count_(surface.positions.size()) {
  const std::vector<std::uint32_t> order = along_curve(surface.positions);
  leaves_ = (count_ + kLeaf - 1) / kLeaf;
  const std::size_t padded = leaves_ * kLeaf;
  std::vector<std::uint32_t> number(count_);
  for (std::size_t v = 0; v < count_; ++v) number[order[v]] = static_cast<std::uint32_t>(v);
  for (std::size_t c = 0; c < 3; ++c) {
    at_[c].resize(padded);
    normals_[c].resize(padded);
    colours_[c].resize(padded, 0.7F);
    for (std::size_t v = 0; v < padded; ++v) {
      const std::uint32_t old = order[std::min(v, count_ - 1)];
      at_[c][v] = static_cast<float>(surface.positions[old][c]);
      normals_[c][v] = surface.normals[old][c];
    }
  }

  // Of each triangle at a vertex, the two others; then one after the other around it.
  std::vector<std::array<std::array<std::int32_t, 2>, kRing>> pairs(count_);
  std::vector<std::uint8_t> degree(count_, 0);
  for (const auto& triangle : surface.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t v = number[triangle[k]];
      RELIEF_ASSERT(degree[v] < kRing);
      pairs[v][degree[v]++] = {static_cast<std::int32_t>(number[triangle[(k + 1) % 3]]),
                               static_cast<std::int32_t>(number[triangle[(k + 2) % 3]])};
    }
  float longest = 0;
  for (auto& plane : ring_) plane.resize(padded);
  for (std::size_t v = 0; v < count_; ++v) {
    const std::span around(pairs[v].data(), degree[v]);
    std::int32_t next = around.front()[0];
    for (std::size_t k = 0; k < kRing; ++k) {
      ring_[k][v] = next;
      const Vec3f edge = position(static_cast<std::size_t>(next)) - position(v);
      longest = std::max(longest, dot(edge, edge));
      if (k + 1 >= around.size()) continue;
      const auto after = std::ranges::find(around, next, [](const auto& pair) { return pair[0]; });
      RELIEF_ASSERT(after != around.end());
      next = (*after)[1];
    }
  }
  for (auto& plane : ring_)
    std::fill(plane.begin() + static_cast<std::ptrdiff_t>(count_), plane.end(), plane[count_ - 1]);
  longest_edge_ = std::sqrt(longest);

  undo_.resize(leaves_);
  flags_.resize(kLeaf);
  for (std::size_t level = leaves_; true; level = (level + kBranch - 1) / kBranch) {
    tree_.emplace_back(level);
    if (level == 1) break;
  }
  changed_leaves_.resize(leaves_);
  std::iota(changed_leaves_.begin(), changed_leaves_.end(), 0U);
  refit();
}

std::size_t PlainMesh::bytes() const noexcept {
  std::size_t sum = 0;
  for (const auto* planes : {&at_, &normals_, &colours_})
    for (const Plane& plane : *planes) sum += plane.size() * sizeof(float);
  for (const auto& plane : ring_) sum += plane.size() * sizeof(std::int32_t);
  for (const auto& level : tree_) sum += level.size() * sizeof(Box);
  return sum;
}

void PlainMesh::begin_stroke() {
  for (const std::uint32_t leaf : kept_) idle_.push_back(std::move(undo_[leaf]));
  kept_.clear();
}

void PlainMesh::keep(std::size_t leaf) {
  if (undo_[leaf]) return;
  if (idle_.empty()) idle_.push_back(std::make_unique<Copy>(3 * kLeaf));
  undo_[leaf] = std::move(idle_.back());
  idle_.pop_back();
  kept_.push_back(static_cast<std::uint32_t>(leaf));
  for (std::size_t c = 0; c < 3; ++c)
    std::copy_n((*written_)[c].data() + leaf * kLeaf, kLeaf, undo_[leaf]->data() + c * kLeaf);
}

void PlainMesh::undo() {
  list_.clear();
  for (const std::uint32_t leaf : kept_) {
    for (std::size_t c = 0; c < 3; ++c)
      std::copy_n(undo_[leaf]->data() + c * kLeaf, kLeaf, (*written_)[c].data() + leaf * kLeaf);
    for (std::size_t v = leaf * kLeaf; v < (leaf + 1) * kLeaf; ++v) {
      list_.push_back(static_cast<std::int32_t>(v));
      for (const auto& plane : ring_) list_.push_back(plane[v]);
    }
  }
  std::ranges::sort(list_);
  list_.erase(std::unique(list_.begin(), list_.end()), list_.end());
  renew_normals();
  std::ranges::sort(kept_);
  changed_leaves_ = kept_;
  refit();
  begin_stroke();
}

void PlainMesh::find_leaves(Vec3f centre, float radius) {
  const auto meets = [&](const Box& box) {
    float square = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      const float off = std::max({box.low[c] - centre[c], centre[c] - box.high[c], 0.0F});
      square += off * off;
    }
    return square <= radius * radius;
  };
  found_.clear();
  if (meets(tree_.back().front())) found_.push_back(0);
  std::vector<std::uint32_t> below;
  for (std::size_t level = tree_.size() - 1; level > 0; --level) {
    below.clear();
    for (const std::uint32_t box : found_)
      for (std::size_t k = box * kBranch; k < std::min((box + 1) * kBranch, tree_[level - 1].size()); ++k)
        if (meets(tree_[level - 1][k])) below.push_back(static_cast<std::uint32_t>(k));
    std::swap(found_, below);
  }
}

/// Moves the vertices inside the sphere; changed_leaves_ are those of them.
std::size_t PlainMesh::move(const Dab& dab) {
  const Ball ball = {dab.centre.x,   dab.centre.y, dab.centre.z, dab.radius * dab.radius,
                     1 / dab.radius, dab.up.x,     dab.up.y,     dab.up.z};
  written_ = dab.kernel == Kernel::Paint ? &colours_ : &at_;
  changed_leaves_.clear();
  find_leaves(dab.centre, dab.radius);
  const Coordinates all = {at_[0].data(), at_[1].data(), at_[2].data()};
  std::size_t changed = 0;
  list_.clear();
  for (const std::uint32_t leaf : found_) {
    const std::size_t first = leaf * kLeaf;
    float *const x = at_[0].data() + first, *const y = at_[1].data() + first, *const z = at_[2].data() + first;
    keep(leaf);
    std::size_t here = 0;
    if (dab.kernel == Kernel::Carve) {
      here = carve(ball, x, y, z);
    } else if (dab.kernel == Kernel::Deposit) {
      const Coordinates normal = {normals_[0].data() + first, normals_[1].data() + first, normals_[2].data() + first};
      here = deposit(ball, dab.amount, normal, x, y, z);
    } else if (dab.kernel == Kernel::Paint) {
      here = paint(ball, dab.amount, dab.colour, {x, y, z}, colours_[0].data() + first, colours_[1].data() + first,
                   colours_[2].data() + first);
    } else {
      find_inside(ball, ball.square, {x, y, z}, flags_.data());
      const std::size_t before = list_.size();
      list_.resize(before + kLeaf);
      for (std::size_t v = 0; v < kLeaf; ++v) {
        list_[before + here] = static_cast<std::int32_t>(first + v);
        here += flags_[v];
      }
      list_.resize(before + here);
    }
    changed += here;
    if (here > 0) changed_leaves_.push_back(leaf);
  }
  if (dab.kernel != Kernel::Smooth) return changed;
  for (Plane& plane : moved_) plane.resize(std::max(plane.size(), list_.size()));
  smooth(ball, dab.amount, list_.data(), list_.size(), all,
         {{ring_[0].data(), ring_[1].data(), ring_[2].data(), ring_[3].data(), ring_[4].data(), ring_[5].data()}},
         {moved_[0].data(), moved_[1].data(), moved_[2].data()});
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t k = 0; k < list_.size(); ++k) at_[c][static_cast<std::size_t>(list_[k])] = moved_[c][k];
  return changed;
}

/// All vertices within two edges' length of the sphere: no triangle of another moved.
void PlainMesh::list_moved(const Dab& dab) {
  const float reach = dab.radius + 2 * longest_edge_;
  find_leaves(dab.centre, reach);
  const Ball ball = {.x = dab.centre.x,
                     .y = dab.centre.y,
                     .z = dab.centre.z,
                     .square = 0,
                     .inverse = 0,
                     .up_x = 0,
                     .up_y = 0,
                     .up_z = 0};
  std::size_t count = 0;
  list_.resize(found_.size() * kLeaf);
  for (const std::uint32_t leaf : found_) {
    const std::size_t first = leaf * kLeaf;
    find_inside(ball, reach * reach, {at_[0].data() + first, at_[1].data() + first, at_[2].data() + first},
                flags_.data());
    for (std::size_t v = 0; v < kLeaf; ++v) {
      list_[count] = static_cast<std::int32_t>(first + v);
      count += flags_[v];
    }
  }
  list_.resize(count);
}

void PlainMesh::renew_normals() {
  const std::size_t count = list_.size();
  for (Plane& plane : moved_) plane.resize(std::max(plane.size(), count));
  find_normals(list_.data(), count, {at_[0].data(), at_[1].data(), at_[2].data()},
               {{ring_[0].data(), ring_[1].data(), ring_[2].data(), ring_[3].data(), ring_[4].data(), ring_[5].data()}},
               {moved_[0].data(), moved_[1].data(), moved_[2].data()});
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t k = 0; k < count; ++k) normals_[c][static_cast<std::size_t>(list_[k])] = moved_[c][k];
}

void PlainMesh::find_box(std::size_t leaf) {
  Box& box = tree_.front()[leaf];
  for (std::size_t c = 0; c < 3; ++c) {
    const Extreme of = extremes(at_[c].data() + leaf * kLeaf);
    box.low[c] = of.low;
    box.high[c] = of.high;
  }
}

/// The boxes of the leaves that changed and of all above them.
void PlainMesh::refit() {
  for (const std::uint32_t leaf : changed_leaves_) find_box(leaf);
  for (std::size_t level = 1; level < tree_.size(); ++level) {
    std::uint32_t last = std::numeric_limits<std::uint32_t>::max();
    for (std::uint32_t& box : changed_leaves_) {
      box /= kBranch;
      if (std::exchange(last, box) == box) continue;
      const std::span<const Box> below(tree_[level - 1]);
      Box around = below[box * kBranch];
      for (const Box& each : below.subspan(box * kBranch, std::min(kBranch, below.size() - box * kBranch)))
        for (std::size_t c = 0; c < 3; ++c) {
          around.low[c] = std::min(around.low[c], each.low[c]);
          around.high[c] = std::max(around.high[c], each.high[c]);
        }
      tree_[level][box] = around;
    }
  }
}

std::size_t PlainMesh::dab(const Dab& dab) {
  const std::size_t changed = move(dab);
  if (dab.kernel == Kernel::Paint || changed == 0) return changed;
  list_moved(dab);
  renew_normals();
  refit();
  return changed;
}

}  // namespace relief::bench
