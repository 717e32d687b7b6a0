#include "display_cache.h"

#include <relief/core/tessellate.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace relief::detail {

namespace {

/// No buffer grows beyond this, whatever the model: far below what OpenGL 4.5 promises for a storage block (128 MiB).
constexpr std::size_t kChunkBytes = std::size_t{64} << 20U;

/// A slab as the vertex stage reads it.
struct Record {
  std::array<Vec3f, 3> inner, outer;  ///< relative to the centre
  std::uint32_t samples_at, intervals, colours_at, colour_intervals;
};

/// Octahedral map of the sphere to a square, 12 bits a side; largest error 0.06 degrees.
std::uint32_t pack_normal(Vec3f n) noexcept {
  const float sum = std::abs(n.x) + std::abs(n.y) + std::abs(n.z);
  if (!(sum > 0)) return 2048U | (2048U << 12U);
  float u = n.x / sum, v = n.y / sum;
  if (n.z < 0) {
    const float folded_u = (1 - std::abs(v)) * (u < 0 ? -1.0F : 1.0F);
    v = (1 - std::abs(u)) * (v < 0 ? -1.0F : 1.0F);
    u = folded_u;
  }
  const auto code = [](float t) { return static_cast<std::uint32_t>(std::lround((t * 0.5F + 0.5F) * 4095.0F)); };
  return code(u) | (code(v) << 12U);
}

std::uint32_t pack_colour(const Tile& tile, std::size_t k) noexcept {
  std::uint32_t word = 0xff000000U;
  for (int c = 0; c < 3; ++c) {
    const std::uint32_t nearest = (tile.plane16(c)[k] + 128U) / 257U;
    word |= nearest << (8U * static_cast<unsigned>(c));
  }
  return word;
}

/// Where in the ring of a slab's border samples a grid point lies.
std::size_t ring_index(int n, GridPoint p) noexcept {
  const std::array<int, 3> w = weights(n, p);
  for (int corner = 0; corner < 3; ++corner)
    if (w[static_cast<std::size_t>(corner)] == n)
      return static_cast<std::size_t>((corner + 2) % 3) * static_cast<std::size_t>(n);
  const int edge = w[0] == 0 ? 0 : w[1] == 0 ? 1 : 2;
  return static_cast<std::size_t>(edge) * static_cast<std::size_t>(n) +
         static_cast<std::size_t>(w[static_cast<std::size_t>((edge + 2) % 3)]);
}

}  // namespace

void DisplayCache::rebuild(const Snapshot& model) {
  const SlabMesh& mesh = model.slab_mesh();
  centre_ = mesh.bounds().centre();
  cavity_scale_ = 0.004 * diagonal(mesh.bounds());
  slabs_.assign(mesh.slab_count(), {});
  chunks_.clear();
  patterns_.clear();
  closed_ = true;
  std::map<Grid, std::uint32_t> open_chunk;
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    const int n = mesh.intervals(s);
    for (const SlabId other : mesh.slabs()[s].neighbours) closed_ = closed_ && other != kNoSlab;
    Grid grid = {.intervals = n, .edges = mesh.edge_intervals(s)};
    if (model.has(Layer::Void)) {
      bool holes = false;
      for_each_cell(n, [&](const std::array<GridPoint, 3>& cell) { holes = holes || model.is_hole(s, cell); });
      if (holes) grid.holed = s;
      closed_ = closed_ && !holes;
    }
    // Room for the finest colour tile too, so that a later colour layer never moves a slab to another chunk.
    const std::size_t most = kChunkBytes / std::max(sizeof(Record), sample_count(kMaxIntervals) * 4);
    auto at = open_chunk.find(grid);
    if (at == open_chunk.end() || chunks_[at->second].slabs.size() >= most) {
      at = open_chunk.insert_or_assign(grid, static_cast<std::uint32_t>(chunks_.size())).first;
      Chunk& chunk = chunks_.emplace_back();
      chunk.grid = grid;
      for (int level = 0; level < level_count(n); ++level) chunk.triangles.push_back(triangles_of(model, grid, level));
    }
    Chunk& chunk = chunks_[at->second];
    slabs_[s].chunk = at->second;
    slabs_[s].samples_at = chunk.sample_total;
    slabs_[s].ring.resize(3 * static_cast<std::size_t>(n));
    chunk.sample_total += sample_count(n);
    chunk.slabs.push_back(s);
  }
  for (Chunk& chunk : chunks_)
    chunk.samples = make_buffer(chunk.sample_total * sizeof(words_[0]), nullptr, GL_DYNAMIC_STORAGE_BIT);
}

void DisplayCache::place_colours(const Snapshot& model) {
  const SlabMesh& mesh = model.slab_mesh();
  colour_ = model.has(Layer::Colour);
  for (Chunk& chunk : chunks_) {
    chunk.colour_total = 0;
    std::vector<Record> records;
    records.reserve(chunk.slabs.size());
    for (const SlabId s : chunk.slabs) {
      const SlabCorners corners = mesh.corners(s);
      Record r{};
      for (std::size_t k = 0; k < 3; ++k) {
        r.inner[k] = to_float(corners.inner[k] - centre_);
        r.outer[k] = to_float(corners.outer[k] - centre_);
      }
      slabs_[s].colours_at = chunk.colour_total;
      r.samples_at = static_cast<std::uint32_t>(slabs_[s].samples_at);
      r.intervals = static_cast<std::uint32_t>(chunk.grid.intervals);
      r.colours_at = static_cast<std::uint32_t>(chunk.colour_total);
      if (colour_) {
        const int m = model.tile(Layer::Colour, s).intervals();
        r.colour_intervals = static_cast<std::uint32_t>(m);
        chunk.colour_total += sample_count(m);
      }
      records.push_back(r);
    }
    chunk.records = make_buffer(records.size() * sizeof(Record), records.data());
    chunk.colours = make_buffer(std::max<std::size_t>(chunk.colour_total, 1) * 4, nullptr, GL_DYNAMIC_STORAGE_BIT);
  }
}

/// Positions of all samples of the slab, and what its own micro-triangles give to each of them.
void DisplayCache::measure(const Snapshot& model, SlabId s) {
  const SlabMesh& mesh = model.slab_mesh();
  const int n = mesh.intervals(s);
  const SlabCorners corners = mesh.corners(s);
  const float* alpha = model.displacement(s);
  const std::size_t count = sample_count(n);
  positions_.resize(count);
  normals_.assign(count, {});
  spreads_.assign(count, {});

  // Relative to one corner of the slab: float then resolves the finest grid.
  const Vec3d origin = corners.inner[0];
  std::array<Vec3f, 3> in{}, along{};
  for (std::size_t k = 0; k < 3; ++k) {
    in[k] = to_float(corners.inner[k] - origin);
    along[k] = to_float(corners.outer[k] - corners.inner[k]);
  }
  const float share = 1.0F / static_cast<float>(n);
  std::size_t at = 0;
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i + j <= n; ++i, ++at) {
      const float b1 = static_cast<float>(i) * share, b2 = static_cast<float>(j) * share, b0 = 1 - b1 - b2;
      positions_[at] = in[1] * b1 + in[2] * b2 + (along[0] * b0 + along[1] * b1 + along[2] * b2) * alpha[at];
    }

  const float* voids = model.has(Layer::Void) ? model.tile(Layer::Void, s).plane() : nullptr;
  const auto add = [&](std::size_t a, std::size_t b, std::size_t c) {
    if (voids != nullptr && is_hole(voids[a], voids[b], voids[c])) return;
    const Vec3f &pa = positions_[a], &pb = positions_[b], &pc = positions_[c];
    const Vec3f ab = pb - pa, ac = pc - pa, bc = pc - pb;
    const Vec3f area = cross(ab, ac);
    normals_[a] += area;
    normals_[b] += area;
    normals_[c] += area;
    spreads_[a] += ab + ac;
    spreads_[b] += bc - ab;
    spreads_[c] += -ac - bc;
  };
  std::size_t row = 0;
  for (int j = 0; j < n; ++j) {
    const std::size_t length = static_cast<std::size_t>(n - j) + 1, next = row + length;
    for (std::size_t i = 0; i + 1 < length; ++i) {
      add(row + i, row + i + 1, next + i);
      if (i + 2 < length) add(row + i + 1, next + i + 1, next + i);
    }
    row = next;
  }

  SlabState& state = slabs_[s];
  Vec3f low = positions_[0], high = low;
  state.min_alpha = state.max_alpha = alpha[0];
  for (std::size_t k = 0; k < count; ++k) {
    const Vec3f p = positions_[k];
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    state.min_alpha = std::min(state.min_alpha, alpha[k]);
    state.max_alpha = std::max(state.max_alpha, alpha[k]);
  }
  const Vec3d shift = origin - centre_;
  state.box = {to_double(low) + shift, to_double(high) + shift};
}

/// Writes the words of the slab after measure(), with the shares of the slabs around it.
void DisplayCache::pack(const Snapshot& model, SlabId s) {
  const SlabMesh& mesh = model.slab_mesh();
  const int n = mesh.intervals(s);
  const float* alpha = model.displacement(s);
  words_.resize(sample_count(n));
  const auto scale = static_cast<float>(cavity_scale_);
  std::size_t at = 0;
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i + j <= n; ++i, ++at) {
      Vec3f normal = normals_[at], spread = spreads_[at];
      if (i == 0 || j == 0 || i + j == n) {
        normal = spread = {};
        mesh.for_each_copy(s, {i, j}, [&](SampleCopy copy) {
          const Share& share = slabs_[copy.slab].ring[ring_index(mesh.intervals(copy.slab), copy.at)];
          normal += share.normal;
          spread += share.spread;
        });
      }
      const float area = length(normal);
      // Mean curvature from the umbrella of triangles around the sample, 0 on a plane, positive in a hollow.
      float hollow = area > 0 ? dot(spread, normal) * 1.732F / (area * area) * scale : 0.0F;
      hollow /= 1 + std::abs(hollow);
      const auto code =
          static_cast<std::uint32_t>(std::lround((std::clamp(hollow, -1.0F, 1.0F) * 0.5F + 0.5F) * 254.0F));
      words_[at] = {std::bit_cast<std::uint32_t>(alpha[at]), pack_normal(normal) | (code << 24U)};
    }
  const SlabState& state = slabs_[s];
  glNamedBufferSubData(chunks_[state.chunk].samples, static_cast<GLintptr>(state.samples_at * sizeof(words_[0])),
                       static_cast<GLsizeiptr>(words_.size() * sizeof(words_[0])), words_.data());
}

void DisplayCache::upload_colours(const Snapshot& model, SlabId s) {
  const Tile& tile = model.tile(Layer::Colour, s);
  texels_.resize(tile.size());
  for (std::size_t k = 0; k < tile.size(); ++k) texels_[k] = pack_colour(tile, k);
  glNamedBufferSubData(chunks_[slabs_[s].chunk].colours, static_cast<GLintptr>(slabs_[s].colours_at * 4),
                       static_cast<GLsizeiptr>(texels_.size() * 4), texels_.data());
}

void DisplayCache::total_up() {
  bounds_ = {};
  min_alpha_ = 1;
  max_alpha_ = 0;
  for (const SlabState& state : slabs_) {
    bounds_.add(state.box);
    min_alpha_ = std::min(min_alpha_, state.min_alpha);
    max_alpha_ = std::max(max_alpha_, state.max_alpha);
  }
}

std::optional<std::uint64_t> DisplayCache::update(const Snapshot& model, const std::atomic<bool>* cancel) {
  const SlabMesh& mesh = model.slab_mesh();
  bool fresh = !last_ || last_->shared_slab_mesh() != model.shared_slab_mesh() ||
               last_->has(Layer::Void) != model.has(Layer::Void);
  if (!fresh) for_each_change(*last_, model, [&](Layer layer, SlabId) { fresh = fresh || layer == Layer::Void; });
  const auto cancelled = [&] {
    if (cancel == nullptr || !cancel->load(std::memory_order_relaxed)) return false;
    last_.reset();
    return true;
  };
  if (cancelled()) return std::nullopt;
  if (fresh) rebuild(model);
  bool colours_move = fresh || last_->has(Layer::Colour) != model.has(Layer::Colour);
  std::vector<bool> shape(mesh.slab_count(), fresh), colour(mesh.slab_count(), false);
  if (!fresh)
    for_each_change(*last_, model, [&](Layer layer, SlabId s) {
      if (layer == Layer::Displacement) shape[s] = true;
      if (layer != Layer::Colour) return;
      colour[s] = true;
      if (last_->has(layer) && last_->tile(layer, s).intervals() != model.tile(layer, s).intervals())
        colours_move = true;
    });
  if (colours_move) {
    place_colours(model);
    colour.assign(mesh.slab_count(), colour_);
  }

  // First the shares on the borders, then the words: a slab whose border changed takes its neighbours along.
  std::vector<bool> words = shape;
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    if (!shape[s]) continue;
    if (cancelled()) return std::nullopt;
    measure(model, s);
    const int n = mesh.intervals(s);
    const auto halvings = static_cast<float>(n & -n);
    for (int edge = 0; edge < 3; ++edge)
      for (int t = 0; t < n; ++t) {
        const std::size_t k = sample_index(n, edge_point(n, edge, t));
        const Share share{normals_[k] * halvings, spreads_[k] * halvings};
        Share& kept = slabs_[s].ring[ring_index(n, edge_point(n, edge, t))];
        if (kept == share) continue;
        kept = share;
        if (!fresh) mesh.for_each_copy(s, edge_point(n, edge, t), [&](SampleCopy copy) { words[copy.slab] = true; });
      }
  }
  std::uint64_t uploaded = 0;
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    if ((words[s] || colour[s]) && cancelled()) return std::nullopt;
    if (words[s]) {
      measure(model, s);
      pack(model, s);
      ++uploaded;
    }
    if (colour[s]) {
      upload_colours(model, s);
      ++uploaded;
    }
  }
  if (uploaded > 0) total_up();
  last_ = model;
  return uploaded;
}

template <typename Visit>
void DisplayCache::for_each_triangle(const Snapshot& model, const Grid& grid, int level, Visit&& visit) {
  const int step = level_step(grid.intervals, level);
  std::array<int, 3> edges = grid.edges;
  for (int& m : edges) m /= level_step(m, level);
  for_each_cell(grid.intervals / step, edges, [&](std::array<GridPoint, 3> cell) {
    for (GridPoint& p : cell) p = {p.i * step, p.j * step};
    if (grid.holed == kNoSlab || !model.is_hole(grid.holed, cell)) visit(cell);
  });
}

std::uint64_t DisplayCache::triangles_of(const Snapshot& model, const Grid& grid, int level) {
  std::uint64_t count = 0;
  if (grid.holed != kNoSlab) {
    for_each_triangle(model, grid, level, [&](const auto&) { ++count; });
    return count;
  }
  // Euler's count, from the samples inside and those on the border.
  const int n = grid.intervals / level_step(grid.intervals, level);
  int border = 0;
  for (const int m : grid.edges) border += m / level_step(m, level);
  return static_cast<std::uint64_t>((n - 1) * (n - 2) + border - 2);
}

const DisplayCache::Pattern& DisplayCache::pattern(const Grid& grid, int level) {
  const auto [at, missing] = patterns_.try_emplace({grid, std::min(level, level_count(grid.intervals) - 1)});
  if (missing) {
    std::vector<std::uint16_t> indices;
    for_each_triangle(*last_, grid, level, [&](const std::array<GridPoint, 3>& cell) {
      for (const GridPoint p : cell) indices.push_back(static_cast<std::uint16_t>(sample_index(grid.intervals, p)));
    });
    at->second.indices = make_buffer(std::max<std::size_t>(indices.size(), 1) * sizeof(indices[0]), indices.data());
    at->second.count = static_cast<GLsizei>(indices.size());
  }
  return at->second;
}

/// For each sample number of a grid its place, i + 256 j.
GLuint DisplayCache::grid_table(int n) {
  const auto [at, missing] = grid_tables_.try_emplace(n);
  if (missing) {
    std::vector<std::uint32_t> places;
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i + j <= n; ++i) places.push_back(static_cast<std::uint32_t>(i + 256 * j));
    at->second = make_buffer(places.size() * 4, places.data());
  }
  return at->second;
}

std::uint64_t DisplayCache::triangle_count(int level) const noexcept {
  std::uint64_t total = 0;
  for (const Chunk& chunk : chunks_)
    total +=
        chunk.triangles[std::min(static_cast<std::size_t>(level), chunk.triangles.size() - 1)] * chunk.slabs.size();
  return total;
}

std::uint64_t DisplayCache::draw(int level) { return draw(level, {}); }

std::uint64_t DisplayCache::draw(int level, const std::function<bool()>& go_on) {
  constexpr std::size_t kPortion = 100'000;
  if (vertex_array_ == 0) {
    vertex_array_ = make_vertex_array();
    for (GLuint k = 0; k < 7; ++k) {
      glEnableVertexArrayAttrib(vertex_array_, k);
      glVertexArrayAttribBinding(vertex_array_, k, 0);
      if (k < 6)
        glVertexArrayAttribFormat(vertex_array_, k, 3, GL_FLOAT, GL_FALSE, k * static_cast<GLuint>(sizeof(Vec3f)));
      else
        glVertexArrayAttribIFormat(vertex_array_, k, 4, GL_UNSIGNED_INT, offsetof(Record, samples_at));
    }
    glVertexArrayBindingDivisor(vertex_array_, 0, 1);
  }
  glBindVertexArray(vertex_array_);
  for (const Chunk& chunk : chunks_) {
    const Pattern& p = pattern(chunk.grid, level);
    if (p.count == 0) continue;
    glVertexArrayElementBuffer(vertex_array_, p.indices);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, chunk.samples);
    glVertexArrayVertexBuffer(vertex_array_, 0, chunk.records, 0, sizeof(Record));
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, grid_table(chunk.grid.intervals));
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 2, chunk.colours);
    const std::size_t slabs = chunk.slabs.size(), triangles = static_cast<std::size_t>(p.count) / 3;
    const std::size_t most = go_on ? std::max<std::size_t>(1, kPortion / triangles) : slabs;
    for (std::size_t first = 0; first < slabs; first += most) {
      glDrawElementsInstancedBaseInstance(GL_TRIANGLES, p.count, GL_UNSIGNED_SHORT, nullptr,
                                          static_cast<GLsizei>(std::min(most, slabs - first)),
                                          static_cast<GLuint>(first));
      if (go_on && !go_on()) return triangle_count(level);
    }
  }
  return triangle_count(level);
}

double DisplayCache::lowest(Vec3d up) const noexcept {
  double least = Box3d::kFar;
  for (const SlabState& state : slabs_) {
    const Box3d& b = state.box;
    least = std::min(least, up.x * (up.x > 0 ? b.low.x : b.high.x) + up.y * (up.y > 0 ? b.low.y : b.high.y) +
                                up.z * (up.z > 0 ? b.low.z : b.high.z));
  }
  return least;
}

}  // namespace relief::detail
