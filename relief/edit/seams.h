// What a dab makes of tiles, and how the samples that slabs share stay one: written by one commit, bit for bit.
#pragma once

#include <relief/core/snapshot.h>
#include <relief/edit/kernels.h>
#include <relief/edit/tile_pool.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

namespace relief::detail {

/// A tile that a dab computes, or that gets a shared sample from one.
struct Slot {
  SlabId slab = kNoSlab;
  const Tile* base = nullptr;  ///< before the dab
  std::shared_ptr<Tile> tile;  ///< after it; null while nothing has changed
  Tile* cover = nullptr;       ///< the stroke's own plane, where the tool keeps one
  std::size_t changes = 0;     ///< samples that differ between base and tile

  [[nodiscard]] const Tile& now() const noexcept { return tile ? *tile : *base; }
};

/// The tiles of one dab.
class DabTiles {
 public:
  explicit DabTiles(const SlabMesh& mesh) { take(mesh); }
  /// Goes on in another cage.
  void take(const SlabMesh& mesh) {
    marks_.resize(mesh.slab_count());
    joined_.resize(mesh.fibres().size());
  }

  /// Says where tiles are taken from that a dab did not compute, but that get samples from one that it did.
  struct Source {
    std::function<const Tile&(SlabId)> base;
    std::function<Tile*(SlabId)> cover;  ///< gives null where the tool keeps no cover
    /// Ranks slabs: of two computed slabs the lower rank owns what they share. The rank is the number of the slab at
    /// the stroke's start, since the numbers of its parts depend on the order of dabs.
    std::function<SlabId(SlabId)> rank;
    [[nodiscard]] bool owns(SlabId a, SlabId b) const {
      const SlabId of_a = rank(a), of_b = rank(b);
      return of_a != of_b ? of_a < of_b : a < b;
    }
  };

  void begin();
  /// A computed tile; ascending by slab.
  void add(Slot slot);
  /// Writes every shared sample of the computed tiles to all its copies, then what constrained samples follow from
  /// them. The lowest computed slab owns the value, see Source::rank.
  void commit(const SlabMesh& mesh, Layer layer, const Source& source, TilePool& pool,
              const std::function<const GridTables&(int)>& grid);
  [[nodiscard]] std::vector<Slot>& slots() noexcept { return slots_; }
  [[nodiscard]] bool is_computed(SlabId s) const noexcept {
    return marks_[s].round == round_ && marks_[s].slot < computed_;
  }

 private:
  struct Mark {
    std::uint32_t round = 0, slot = 0;
  };
  /// Along one edge of a slab, or along half of it, to the slab across.
  struct Seam {
    SlabId across = kNoSlab;
    int edge = 0, twin_edge = 0;
    EdgeShare share = EdgeShare::Whole;  ///< of the slab's edge; Halves: only `half` of it
    int half = 0;
  };
  /// The copies of a sample where slabs end, in order of slabs.
  struct AtFibre {
    SlabId slab;
    int corner;  ///< -1: it lies in the middle of `edge`
    int edge;
  };
  std::size_t slot_of(SlabId s, const Source& source);
  void join(std::size_t own, const Seam& seam, int channel_count, const Source& source, TilePool& pool,
            const std::function<const GridTables&(int)>& grid);
  void join_at(const SlabMesh& mesh, FibreId fibre, int channel_count, const Source& source, TilePool& pool);
  void copy_sample(std::size_t from, std::size_t from_index, std::size_t to, std::size_t to_index, int channel_count,
                   TilePool& pool);

  std::uint32_t round_ = 0;
  std::vector<Mark> marks_;
  std::vector<std::uint32_t> joined_;  ///< by fibre: the round in which its sample was last joined
  std::vector<Slot> slots_;
  std::size_t computed_ = 0;
  std::vector<AtFibre> at_fibre_;  ///< scratch
};

}  // namespace relief::detail
