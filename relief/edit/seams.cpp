#include <relief/edit/seams.h>

#include <algorithm>
#include <array>
#include <bit>
#include <span>
#include <type_traits>
#include <utility>

namespace relief::detail {

namespace {

using Values = std::array<float, 3>;  ///< of a sample, by channel

/// The samples that two slabs share along an edge, as one of them numbers them.
struct EdgeSamples {
  std::span<const std::uint16_t> numbers;  ///< of all samples there
  std::size_t stride;                      ///< from one shared sample to the next
  std::size_t first = 0;                   ///< where they begin
  [[nodiscard]] std::size_t operator[](std::size_t t) const noexcept { return numbers[first + t * stride]; }
};

/// Returns whether two tiles hold the same bits along an edge of m intervals, its corners aside; `to` runs the other
/// way.
bool same_edge(const Tile& a, EdgeSamples from, const Tile& b, EdgeSamples to, std::size_t m,
               int channel_count) noexcept {
  std::uint32_t differ = 0;
  const auto compare = [&](const auto* va, const auto* vb) {
    using Bits = std::conditional_t<std::is_same_v<decltype(va), const float*>, std::uint32_t, std::uint16_t>;
    for (std::size_t t = 1; t < m; ++t) differ |= std::bit_cast<Bits>(va[from[t]]) ^ std::bit_cast<Bits>(vb[to[m - t]]);
  };
  for (int c = 0; c < channel_count; ++c) {
    if (a.type() == SampleType::U16)
      compare(a.plane16(c), b.plane16(c));
    else
      compare(a.plane(c), b.plane(c));
  }
  return differ == 0;
}

void put_sample(Slot& to, std::size_t index, const Values& values, int channel_count, TilePool& pool) {
  const Tile& before = to.now();
  bool same = true;
  for (int c = 0; c < channel_count; ++c)
    same = same && std::bit_cast<std::uint32_t>(values[static_cast<std::size_t>(c)]) ==
                       std::bit_cast<std::uint32_t>(before.value(c, index));
  if (same) return;
  if (!to.tile) to.tile = pool.copy(*to.base);
  bool was_changed = false, is_changed = false;
  for (int c = 0; c < channel_count; ++c) {
    const float value = values[static_cast<std::size_t>(c)], base = to.base->value(c, index);
    was_changed = was_changed || to.tile->value(c, index) != base;
    is_changed = is_changed || value != base;
    to.tile->set(c, index, value);
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
  std::ranges::fill(joined_, 0U);
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
  for (int c = 0; c < channel_count; ++c) values[static_cast<std::size_t>(c)] = source.now().value(c, from_index);
  put_sample(slots_[to], to_index, values, channel_count, pool);
  if (source.cover != nullptr) slots_[to].cover->plane()[to_index] = std::as_const(*source.cover).plane()[from_index];
}

/// Writes what the slab shares with one across an edge to the one that does not own it.
void DabTiles::join(std::size_t own, const Seam& seam, int channel_count, const Source& source, TilePool& pool,
                    const std::function<const GridTables&(int)>& grid) {
  const bool twin_computed = is_computed(seam.across);
  if (twin_computed && source.owns(seam.across, slots_[own].slab)) return;
  // A cover may differ where the values, rounded, are still the same.
  const bool covers = slots_[own].cover != nullptr;
  if (!covers && !slots_[own].tile && !(twin_computed && slots_[marks_[seam.across].slot].tile)) return;
  const std::size_t twin = slot_of(seam.across, source);
  const int n = slots_[own].base->intervals(), twin_n = slots_[twin].base->intervals();
  const bool halves = seam.share == EdgeShare::Halves;
  const int ways = halves ? n / 2 : n, twin_ways = halves || seam.share == EdgeShare::Whole ? twin_n : twin_n / 2;
  const int m = std::min(ways, twin_ways);
  const auto steps = [&](int all) { return static_cast<std::size_t>(all / m); };
  const EdgeSamples from = {grid(n).edges[static_cast<std::size_t>(seam.edge)], steps(ways),
                            static_cast<std::size_t>(halves ? seam.half * ways : 0)};
  const EdgeSamples to = {grid(twin_n).edges[static_cast<std::size_t>(seam.twin_edge)], steps(twin_ways),
                          static_cast<std::size_t>(seam.share == EdgeShare::MiddleAtEnd ? twin_ways : 0)};
  const auto count = static_cast<std::size_t>(m);
  if (!covers && same_edge(slots_[own].now(), from, slots_[twin].now(), to, count, channel_count)) return;
  for (std::size_t t = 1; t < count; ++t) copy_sample(own, from[t], twin, to[count - t], channel_count, pool);
}

/// Writes the sample at a fibre to all slabs that meet there, from the one of them that owns it; once per dab.
void DabTiles::join_at(const SlabMesh& mesh, FibreId fibre, int channel_count, const Source& source, TilePool& pool) {
  if (std::exchange(joined_[fibre], round_) == round_) return;
  SlabId owner = kNoSlab;
  bool changed = false;
  mesh.for_each_at(fibre, [&](SlabId s) {
    if (!is_computed(s)) return;
    if (owner == kNoSlab || source.owns(s, owner)) owner = s;
    changed = changed || slots_[marks_[s].slot].tile;
  });
  const std::size_t own = marks_[owner].slot;
  if (slots_[own].cover == nullptr && !changed) return;
  at_fibre_.clear();
  for (const SlabCorner c : mesh.fan(fibre)) at_fibre_.push_back({c.slab, static_cast<int>(c.corner), 0});
  if (const HangingEdge* hangs = mesh.hanging_at(fibre)) {
    const auto place = std::ranges::lower_bound(at_fibre_, hangs->slab, {}, &AtFibre::slab);
    at_fibre_.insert(place, {hangs->slab, -1, hangs->edge});
  }
  const auto sample = [&](const AtFibre& at, int n) {
    return sample_index(n, at.corner < 0 ? edge_point(n, at.edge, n / 2) : corner_point(n, at.corner));
  };
  const auto from_place = std::ranges::find(at_fibre_, owner, &AtFibre::slab);
  const std::size_t from = sample(*from_place, slots_[own].base->intervals());
  for (const AtFibre& at : at_fibre_)
    if (at.slab != owner) {
      const std::size_t to = slot_of(at.slab, source);
      copy_sample(own, from, to, sample(at, slots_[to].base->intervals()), channel_count, pool);
    }
}

void DabTiles::commit(const SlabMesh& mesh, Layer layer, const Source& source, TilePool& pool,
                      const std::function<const GridTables&(int)>& grid) {
  const int channel_count = channels(layer);
  for (std::size_t own = 0; own < computed_; ++own) {
    const SlabId s = slots_[own].slab;
    for (int k = 0; k < 3; ++k) {
      const Slab& slab = mesh.slabs()[s];
      const auto edge = static_cast<std::size_t>(k);
      if (slab.shares[edge] == EdgeShare::Halves) {
        const HangingEdge& hangs = mesh.hanging(s, k);
        for (std::size_t half = 0; half < 2; ++half)
          join(own, {hangs.across[half], k, hangs.edges[half], EdgeShare::Halves, static_cast<int>(half)},
               channel_count, source, pool, grid);
      } else if (slab.neighbours[edge] != kNoSlab) {
        join(own, {slab.neighbours[edge], k, slab.mirrors[edge], slab.shares[edge]}, channel_count, source, pool, grid);
      }
    }
  }
  for (std::size_t own = 0; own < computed_; ++own) {
    const SlabId s = slots_[own].slab;
    for (int k = 0; k < 3; ++k) {
      const auto corner = static_cast<std::size_t>(k);
      join_at(mesh, mesh.slabs()[s].fibres[corner], channel_count, source, pool);
      if (mesh.slabs()[s].shares[corner] == EdgeShare::Halves)
        join_at(mesh, mesh.hanging(s, k).middle, channel_count, source, pool);
    }
  }
  const auto intervals_of = [&](SlabId s) { return source.base(s).intervals(); };
  for (Slot& slot : slots_) {
    if (!slot.tile) continue;
    mesh.for_each_constrained(slot.slab, intervals_of, [&](GridPoint p, const EdgePlace& place) {
      Values values{};
      for (int c = 0; c < channel_count; ++c)
        values[static_cast<std::size_t>(c)] = constrained_value(*slot.tile, layer, place, c);
      put_sample(slot, sample_index(slot.tile->intervals(), p), values, channel_count, pool);
    });
    if (slot.changes == 0 && slot.tile->same_values(*slot.base)) slot.tile.reset();
  }
}

}  // namespace relief::detail
