#include <relief/edit/seams.h>

#include <algorithm>
#include <array>
#include <bit>
#include <span>
#include <utility>

namespace relief::detail {

namespace {

using Values = std::array<float, 3>;  ///< of a sample, by channel

/// The samples that two slabs share along an edge, as one of them numbers them.
struct EdgeSamples {
  std::span<const std::uint16_t> numbers;  ///< of all samples there
  std::size_t stride;                      ///< from one shared sample to the next
  [[nodiscard]] std::size_t operator[](std::size_t t) const noexcept { return numbers[t * stride]; }
};

/// Whether two tiles hold the same bits along an edge of m intervals, its corners aside; `to` runs the other way.
bool same_edge(const Tile& a, EdgeSamples from, const Tile& b, EdgeSamples to, std::size_t m,
               int channel_count) noexcept {
  std::uint32_t differ = 0;
  for (int c = 0; c < channel_count; ++c) {
    const float *va = a.plane(c), *vb = b.plane(c);
    for (std::size_t t = 1; t < m; ++t)
      differ |= std::bit_cast<std::uint32_t>(va[from[t]]) ^ std::bit_cast<std::uint32_t>(vb[to[m - t]]);
  }
  return differ == 0;
}

void put_sample(Slot& to, std::size_t index, const Values& values, int channel_count, TilePool& pool) {
  const Tile& before = to.now();
  bool same = true;
  for (int c = 0; c < channel_count; ++c)
    same = same && std::bit_cast<std::uint32_t>(values[static_cast<std::size_t>(c)]) ==
                       std::bit_cast<std::uint32_t>(before.plane(c)[index]);
  if (same) return;
  if (!to.tile) to.tile = pool.copy(*to.base);
  bool was_changed = false, is_changed = false;
  for (int c = 0; c < channel_count; ++c) {
    float& value = to.tile->plane(c)[index];
    const float base = to.base->plane(c)[index];
    was_changed = was_changed || value != base;
    value = values[static_cast<std::size_t>(c)];
    is_changed = is_changed || value != base;
  }
  to.changes += static_cast<std::size_t>(is_changed);
  to.changes -= static_cast<std::size_t>(was_changed);
}

}  // namespace

void DabTiles::begin() {
  slots_.clear();
  computed_ = 0;
  if (++round_ != 0) return;
  // After 2^32 dabs the old numbers would look new.
  std::ranges::fill(marks_, Mark{});
  round_ = 1;
}

void DabTiles::add(Slot slot) {
  marks_[slot.slab] = {.round = round_, .slot = static_cast<std::uint32_t>(slots_.size())};
  slots_.push_back(std::move(slot));
  computed_ = slots_.size();
}

std::size_t DabTiles::slot_of(SlabId s, const Source& source) {
  if (marks_[s].round != round_) {
    marks_[s] = {.round = round_, .slot = static_cast<std::uint32_t>(slots_.size())};
    slots_.push_back({.slab = s, .base = &source.base(s), .tile = nullptr, .cover = source.cover(s), .changes = 0});
  }
  return marks_[s].slot;
}

void DabTiles::copy_sample(std::size_t from, std::size_t from_index, std::size_t to, std::size_t to_index,
                           int channel_count, TilePool& pool) {
  const Slot& source = slots_[from];
  Values values{};
  for (int c = 0; c < channel_count; ++c) values[static_cast<std::size_t>(c)] = source.now().plane(c)[from_index];
  put_sample(slots_[to], to_index, values, channel_count, pool);
  if (source.cover != nullptr) slots_[to].cover->plane()[to_index] = std::as_const(*source.cover).plane()[from_index];
}

void DabTiles::commit(const SlabMesh& mesh, Layer layer, const Source& source, TilePool& pool,
                      const std::function<const GridTables&(int)>& grid) {
  const int channel_count = channels(layer);
  for (std::size_t own = 0; own < computed_; ++own) {
    const SlabId s = slots_[own].slab;
    const Slab& slab = mesh.slabs()[s];
    for (int k = 0; k < 3; ++k) {
      const SlabId across = slab.neighbours[static_cast<std::size_t>(k)];
      if (across == kNoSlab) continue;
      const bool twin_computed = is_computed(across);
      if (twin_computed && across < s) continue;
      // A cover may differ where the values, rounded, are still the same.
      const bool covers = slots_[own].cover != nullptr;
      if (!covers && !slots_[own].tile && !(twin_computed && slots_[marks_[across].slot].tile)) continue;
      const std::size_t twin = slot_of(across, source);
      const int n = slots_[own].base->intervals(), twin_n = slots_[twin].base->intervals();
      const auto m = static_cast<std::size_t>(std::min(n, twin_n));
      const EdgeSamples from = {grid(n).edges[static_cast<std::size_t>(k)], static_cast<std::size_t>(n) / m};
      const EdgeSamples to = {grid(twin_n).edges[static_cast<std::size_t>(mesh.mirror_edge(s, k))],
                              static_cast<std::size_t>(twin_n) / m};
      if (!covers && same_edge(slots_[own].now(), from, slots_[twin].now(), to, m, channel_count)) continue;
      for (std::size_t t = 1; t < m; ++t) copy_sample(own, from[t], twin, to[m - t], channel_count, pool);
    }
  }
  for (std::size_t own = 0; own < computed_; ++own)
    for (const FibreId fibre : mesh.slabs()[slots_[own].slab].fibres) {
      // Slabs come in ascending order, so the first computed one at a fibre owns it.
      const auto fan = mesh.fan(fibre);
      const auto owner = std::ranges::find_if(fan, [&](SlabCorner c) { return is_computed(c.slab); });
      if (owner->slab != slots_[own].slab) continue;
      const auto changed = [&](SlabCorner c) { return is_computed(c.slab) && slots_[marks_[c.slab].slot].tile; };
      if (slots_[own].cover == nullptr && std::ranges::none_of(fan, changed)) continue;
      const int n = slots_[own].base->intervals();
      const std::size_t from = sample_index(n, corner_point(n, owner->corner));
      for (const SlabCorner c : fan)
        if (c.slab != owner->slab) {
          const std::size_t to = slot_of(c.slab, source);
          const int m = slots_[to].base->intervals();
          copy_sample(own, from, to, sample_index(m, corner_point(m, c.corner)), channel_count, pool);
        }
    }
  if (!has_own_intervals(layer)) return;
  for (Slot& slot : slots_) {
    if (!slot.tile) continue;
    mesh.for_each_constrained(slot.slab, [&](GridPoint p, const EdgePlace& place) {
      put_sample(slot, sample_index(slot.tile->intervals(), p), {constrained_value(*slot.tile, layer, place)}, 1, pool);
    });
    if (slot.changes == 0 && slot.tile->same_values(*slot.base)) slot.tile.reset();
  }
}

}  // namespace relief::detail
