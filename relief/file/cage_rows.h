// The table `cage`: the cage of the model as it was made, and what strokes made of it.
#pragma once

#include <relief/base/error.h>
#include <relief/core/slab_mesh.h>
#include <relief/core/snapshot.h>
#include <relief/file/database.h>

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace relief::detail {

struct Meta;

/// Intervals of the tiles of one layer, by slab.
using Grid = std::vector<std::uint8_t>;
[[nodiscard]] bool is_uniform(const Grid& grid) noexcept;

/// A cage as files tell it, and the grids on it. Another one than SlabMesh, because what strokes did to it is cheap
/// to follow here, and need not make sense in between.
struct CageState {
  std::vector<Fibre> fibres;            ///< of the roots
  std::vector<SlabMesh::Face> roots;    ///< with the intervals from before all cuts
  std::vector<SlabId> cuts;             ///< as in SlabMesh::cuts()
  std::vector<std::uint8_t> levels;     ///< by slab
  std::array<Grid, kLayerCount> grids;  ///< empty of layers that are not there, and of Void and Folded

  [[nodiscard]] SlabId slab_count() const noexcept { return static_cast<SlabId>(levels.size()); }
  [[nodiscard]] const Grid& grid(Layer layer) const noexcept {
    return grids[static_cast<std::size_t>(has_own_intervals(layer) ? Layer::Displacement : layer)];
  }
  /// Returns whether all grids have 1 to kMaxIntervals.
  [[nodiscard]] bool has_sound_grids() const noexcept;
  /// Cuts a slab, its grids by after_cuts(). False: there is no such slab, or it cannot be cut any further.
  [[nodiscard]] bool cut(SlabId slab);
};
[[nodiscard]] CageState cage_of(const Snapshot& model);
/// Returns whether a cage is that of a mesh, with the grids that the mesh has.
[[nodiscard]] bool is_of(const CageState& cage, const SlabMesh& mesh) noexcept;
/// Error: Corrupt, as from SlabMesh.
[[nodiscard]] Result<std::shared_ptr<const SlabMesh>> mesh_of(const CageState& cage);

/// How one cage comes from another.
enum class CageChange : std::uint8_t {
  Step,   ///< fibres of roots moved, slabs cut, grids made finer
  Roots,  ///< the same, but the roots have other intervals
  Anew,   ///< another cage: nothing of the one is known in the other
};
[[nodiscard]] CageChange change_between(const CageState& before, const CageState& after) noexcept;

/// Returns whether the fibres of the roots are the same, bit for bit.
[[nodiscard]] bool same_places(const CageState& a, const CageState& b) noexcept;

/// Returns the tile that rule kCarryRule gives a slab of m intervals which is a part of one with tile `from`; zeros
/// where that has samples that m lacks.
[[nodiscard]] TilePtr carried_tile(const TilePtr& from, Layer layer, const RootPlace& part, int m);

/// A part of the cage, by the number of the stroke that wrote it and what it is.
struct CagePart {
  std::int64_t stroke = 0;
  int kind = 0;  ///< a number for each kind
  /// Nothing of what no stroke writes: the fibres and slabs of the model as it was made, and what we do not know.
  [[nodiscard]] static std::optional<CagePart> from_name(std::string_view part) noexcept;
  /// Returns whether it says all of the cuts: then the stroke says all of the cage.
  [[nodiscard]] bool makes_cage_anew() const noexcept;
  /// Returns whether a state cannot be read without it; what was proven is proven again.
  [[nodiscard]] bool is_needed() const noexcept;
};
/// Of the model as it was made.
[[nodiscard]] bool is_first_part(std::string_view part) noexcept;

/// Reads and writes the table.
class CageRows {
 public:
  explicit CageRows(const Database& database) noexcept : database_(database) {}

  // ---- Writing; all inside a transaction that the caller ends. They give the number of rows that the stroke wrote.

  /// Returns the cage of a model as it is made.
  [[nodiscard]] Result<std::int64_t> write_first(const CageState& cage) const;
  /// Returns the whole cage at a stroke, with what was proven of its roots.
  [[nodiscard]] Result<std::int64_t> write_whole(std::int64_t stroke, const CageState& cage,
                                                 std::string_view certificate) const;
  /// Returns what a step changes; `carried` bytes of tiles follow from those before.
  [[nodiscard]] Result<std::int64_t> write_step(std::int64_t stroke, const CageState& before, const CageState& after,
                                                std::string_view certificate, std::size_t carried) const;
  /// Returns the grid of a layer that the stroke brings.
  [[nodiscard]] Status write_grid(std::int64_t stroke, Layer layer, const Grid& grid) const;
  [[nodiscard]] Status drop_after(std::int64_t stroke) const;

  // ---- Reading

  /// Returns the last stroke up to this one that says all of the cage; 0 where none does.
  [[nodiscard]] Result<std::int64_t> last_whole(std::int64_t stroke) const;
  /// Returns the strokes after the first and up to the last one named that change the cage or a grid, in order.
  [[nodiscard]] Result<std::vector<std::int64_t>> changes(std::int64_t after, std::int64_t last) const;
  /// Returns the cage at such a stroke, or at 0. There, grids of layers that are the same everywhere are left out.
  [[nodiscard]] Result<CageState> read_whole(std::int64_t stroke, const Meta& meta) const;

  struct Step {
    bool whole = false;            ///< all of the cage was told
    std::vector<SlabId> new_cuts;  ///< where not
    std::size_t may_carry = 0;     ///< bytes of tiles that the step may make, in proportion to its own
  };
  /// Takes the changes of a stroke over.
  [[nodiscard]] Result<Step> apply(std::int64_t stroke, CageState& cage) const;
  /// Returns the last stroke up to this one that made new slabs; 0 where none did.
  [[nodiscard]] Result<std::int64_t> slabs_made_at(std::int64_t stroke, const Meta& meta) const;
  /// Returns what the verifier proved of the roots at a stroke.
  [[nodiscard]] Result<std::string> certificate(std::int64_t stroke, const Meta& meta) const;

 private:
  [[nodiscard]] Status write(std::string_view part, std::span<const std::byte> raw, std::size_t width,
                             std::size_t expansion, std::size_t least = 0) const;
  /// Returns the unpacked bytes of a part; nothing where there is no such row.
  [[nodiscard]] Result<std::optional<std::vector<std::byte>>> read(std::string_view part, std::size_t width,
                                                                   std::size_t expansion,
                                                                   std::size_t* packed = nullptr) const;
  template <typename Value>
  [[nodiscard]] Result<std::optional<std::vector<Value>>> read_values(std::string_view part,
                                                                      std::size_t expansion) const;
  [[nodiscard]] std::unexpected<Error> damaged(std::int64_t stroke, std::string_view what) const;

  const Database& database_;
};

}  // namespace relief::detail
