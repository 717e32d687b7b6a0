#include <relief/convert/room/old_surface.h>
#include <relief/convert/room/solids.h>
#include <relief/convert/room/surface_resampling.h>
#include <relief/convert/sample/fibre_sampling.h>
#include <relief/convert/support/parallel.h>
#include <relief/convert/support/sort_unique.h>
#include <relief/core/query.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <utility>

namespace relief::detail {
namespace {

class Resampling {
 public:
  Resampling(const Snapshot& surface, const SlabMesh& mesh, const Lengthened& longer, std::span<const SlabId> slabs)
      : surface_(surface), mesh_(mesh), lattice_(longer.lattice), slabs_(slabs), old_(surface, slabs, lattice_) {
    moved_.reserve(longer.moved.size());
    for (const MovedFibre& m : longer.moved) moved_.push_back(m.fibre);
  }

  Resampled run(const RoomWanted& wanted, double most_moved, const Progress& progress) {
    Resampled made;
    const std::vector<SlabSamples> cast = sample_slabs(mesh_, slabs_, {rays_, lattice_, old_.phantom_from()}, progress);
    if (cast.empty()) return made;
    made.unmet = moved_of([&](std::size_t k) { return misses(slabs_[k], cast[k]); });
    if (!made.unmet.empty()) return made;
    for (const SlabId s : slabs_) made.sampled.push_back({.slab = s, .moved = moved_bits(s)});
    displacement_ = tiles_of(Layer::Displacement, [&](std::size_t k, GridPoint p, std::size_t index, Tile& tile) {
      tile.set(0, index, cast[k].alpha[index]);
      if (cast[k].met[index] != Met::Once) ++made.sampled[k].folded[between(slabs_[k], tile.intervals(), p)];
    });
    Tiles voids;
    if (surface_.has(Layer::Void))
      voids = tiles_of(Layer::Void, [&](std::size_t k, GridPoint, std::size_t index, Tile& tile) {
        tile.set(0, index, cast[k].is_void[index] != 0 ? 1.0F : 0.0F);
      });
    const std::vector<double> moved = moves_of_surface(wanted, voids, progress);
    made.moved_most = *std::ranges::max_element(moved);
    made.unmet = moved_of([&](std::size_t k) { return moved[k] > most_moved; });
    if (!made.unmet.empty()) return made;
    add(made, Layer::Displacement, displacement_);
    if (!voids.empty()) add(made, Layer::Void, voids);
    for (int k = 0; k < kLayerCount; ++k) {
      const auto layer = static_cast<Layer>(k);
      if (layer == Layer::Displacement || layer == Layer::Void || !surface_.has(layer)) continue;
      if (progress.cancelled()) return made;
      add(made, layer, carried(layer, cast));
    }
    return made;
  }

 private:
  using Tiles = std::vector<std::shared_ptr<Tile>>;

  /// Calls visit(GridPoint, index) for the samples of a grid.
  template <typename Visit>
  static void for_each_sample(int n, Visit&& visit) {
    std::size_t index = 0;
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i + j <= n; ++i, ++index) visit(GridPoint{i, j}, index);
  }

  [[nodiscard]] bool has_moved(FibreId f) const noexcept { return std::ranges::binary_search(moved_, f); }
  /// Returns the fibres of a slab's root.
  [[nodiscard]] const std::array<FibreId, 3>& fibres_of(const RootPlace& place) const noexcept {
    return mesh_.roots()[place.root].fibres;
  }
  /// Returns the fibres of a slab's root that have moved, as bits.
  [[nodiscard]] std::uint8_t moved_bits(SlabId s) const noexcept {
    std::uint8_t bits = 0;
    const RootPlace place = mesh_.root_place(s);
    for (std::size_t k = 0; k < 3; ++k)
      if (has_moved(fibres_of(place)[k])) bits |= static_cast<std::uint8_t>(1U << k);
    return bits;
  }
  /// Returns the fibres of a slab's root that a sample stands between, as bits.
  [[nodiscard]] std::uint8_t between(SlabId s, int n, GridPoint p) const noexcept {
    const std::array<int, 3> w = mesh_.root_place(s).in_root(weights(n, p));
    std::uint8_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k)
      if (w[k] != 0) bits |= static_cast<std::uint8_t>(1U << k);
    return bits;
  }
  /// Returns the old sample stays where all fibres that it stands between have.
  [[nodiscard]] bool stays(SlabId s, int n, GridPoint p) const noexcept {
    return (between(s, n, p) & moved_bits(s)) == 0;
  }

  /// Returns whether a fibre of a slab that does not stay meets nothing.
  [[nodiscard]] bool misses(SlabId s, const SlabSamples& cast) const {
    bool misses = false;
    for_each_sample(cast.intervals, [&](GridPoint p, std::size_t index) {
      misses = misses || (cast.met[index] == Met::Never && !stays(s, cast.intervals, p));
    });
    return misses;
  }

  /// Returns the moved fibres of the slabs that are at fault, by their place in slabs_.
  template <typename AtFault>
  [[nodiscard]] std::vector<FibreId> moved_of(AtFault&& at_fault) const {
    std::vector<FibreId> moved;
    for (std::size_t k = 0; k < slabs_.size(); ++k) {
      if (!at_fault(k)) continue;
      for (const FibreId f : fibres_of(mesh_.root_place(slabs_[k])))
        if (has_moved(f)) moved.push_back(f);
    }
    sort_unique(moved);
    return moved;
  }

  /// New tiles of a layer: take(k, p, index, tile) sets the samples that do not stay, each in the lowest of the slabs
  /// that have it.
  template <typename Take>
  Tiles tiles_of(Layer layer, Take&& take) const {
    Tiles tiles;
    const auto intervals_of = [&](SlabId s) { return surface_.tile(layer, s).intervals(); };
    for (std::size_t k = 0; k < slabs_.size(); ++k) {
      const SlabId s = slabs_[k];
      auto tile = std::make_shared<Tile>(surface_.tile(layer, s));
      const int n = tile->intervals();
      for (int j = 0; j <= n; ++j)
        for (int i = 0; i + j <= n; ++i) {
          const GridPoint p = {i, j};
          if (stays(s, n, p)) continue;
          const std::size_t index = sample_index(n, p);
          SampleCopy first;
          mesh_.for_each_copy(s, intervals_of, p, [&](const SampleCopy& copy) {
            if (first.slab == kNoSlab) first = copy;
          });
          if (first.slab == s) {
            take(k, p, index, *tile);
            continue;
          }
          const auto at = static_cast<std::size_t>(std::ranges::lower_bound(slabs_, first.slab) - slabs_.begin());
          for (int c = 0; c < tile->channel_count(); ++c)
            tile->set(c, index, tiles[at]->value(c, sample_index(intervals_of(first.slab), first.at)));
        }
      tiles.push_back(std::move(tile));
      constrain(mesh_, layer, s, intervals_of, *tiles.back());
    }
    return tiles;
  }

  void add(Resampled& made, Layer layer, const Tiles& tiles) const {
    for (std::size_t k = 0; k < slabs_.size(); ++k) {
      if (layer == Layer::Displacement || layer == Layer::Void) tiles[k]->find_bounds();
      made.tiles.push_back({layer, slabs_[k], tiles[k]});
    }
  }

  [[nodiscard]] double alpha_at(std::size_t k, double u, double v) const noexcept {
    const GridCell cell = cell_at(displacement_[k]->intervals(), u, v);
    double alpha = 0;
    for (std::size_t c = 0; c < 3; ++c)
      alpha +=
          cell.weights[c] *
          double(
              std::as_const(*displacement_[k]).plane()[sample_index(displacement_[k]->intervals(), cell.corners[c])]);
    return alpha;
  }

  /// Returns where on the old surface a fibre of a slab comes out, or the nearest place to that.
  [[nodiscard]] SlabPlace old_place(std::size_t k, double u, double v) const {
    const Line line = fibre_at(mesh_.corners(slabs_[k]), lattice_, {1 - u - v, u, v});
    const double alpha = alpha_at(k, u, v);
    constexpr double kAround = 0.1;  // of the fibre: the surface is looked for so near to where the samples say it is
    Crossings crossings;
    rays_.cross(line.origin, line.direction, alpha - kAround, alpha + kAround, crossings);
    const Crossing* met = nullptr;
    for (const Crossing& c : crossings.all())
      if (met == nullptr || std::abs(c.t - alpha) < std::abs(met->t - alpha)) met = &c;
    if (met != nullptr) return old_.place(met->triangle, met->weights);
    const SourceRays::Nearest nearest = rays_.nearest(line.origin + line.direction * alpha);
    return old_.place(nearest.triangle, nearest.weights);
  }

  /// Returns a layer beside the displacement, read where its samples come to lie on the old surface.
  Tiles carried(Layer layer, std::span<const SlabSamples> cast) const {
    return tiles_of(layer, [&](std::size_t k, GridPoint, std::size_t index, Tile& tile) {
      const int n = tile.intervals();
      GridPoint p;
      for (std::size_t row = static_cast<std::size_t>(n) + 1, left = index; left >= row; left -= row--) ++p.j;
      p.i = static_cast<int>(index - sample_index(n, {0, p.j}));
      const double u = double(p.i) / n, v = double(p.j) / n;
      if (layer == Layer::Folded) {
        if (cast[k].met[index] != Met::Once) {
          tile.set(0, index, 1);
          return;
        }
      }
      const SlabPlace from = old_place(k, u, v);
      const Tile& old = surface_.tile(layer, from.slab);
      const GridCell cell = cell_at(old.intervals(), from.u, from.v);
      for (int c = 0; c < tile.channel_count(); ++c) {
        double value = 0;
        for (std::size_t corner = 0; corner < 3; ++corner)
          value += cell.weights[corner] * double(old.value(c, sample_index(old.intervals(), cell.corners[corner])));
        if (layer == Layer::Folded) value = value > 0.5 ? 1 : 0;
        if (layer == Layer::Strata) value = strata_at(k, u, v, from, value);
        tile.set(c, index, static_cast<float>(std::clamp(value, double(range(layer).low), double(range(layer).high))));
      }
    });
  }

  /// A boundary keeps its depth below the surface.
  [[nodiscard]] double strata_at(std::size_t k, double u, double v, const SlabPlace& from,
                                 double value) const noexcept {
    const auto fibre_length = [](const SlabCorners& corners, double a, double b) {
      const std::array<double, 3> w = {1 - a - b, a, b};
      return length(corners.point(w, 1) - corners.point(w, 0));
    };
    const double depth = (displacement_at(surface_, from.slab, from.u, from.v) - value) *
                         fibre_length(surface_.slab_mesh().corners(from.slab), from.u, from.v);
    return alpha_at(k, u, v) - depth / fibre_length(mesh_.corners(slabs_[k]), u, v);
  }

  /// By slab: how far the surface lies from the old one, in the middles of some thousand micro-triangles outside the
  /// solids that are no holes.
  [[nodiscard]] std::vector<double> moves_of_surface(const RoomWanted& wanted, const Tiles& voids,
                                                     const Progress& progress) const {
    std::vector<double> most(slabs_.size(), 0);
    for_all(slabs_.size(), 1, progress, [&](std::size_t k) {
      const SlabId s = slabs_[k];
      const int n = mesh_.intervals(s);
      constexpr int kSeen = 1024;  // micro-triangles
      const int every = std::max(1, n * n / kSeen);
      const Tile& alpha = *displacement_[k];
      int count = 0;
      for_each_cell(n, mesh_.edge_intervals(s), [&](const std::array<GridPoint, 3>& cell) {
        if (count++ % every != 0) return;
        Vec3d middle;
        std::array<float, 3> holes{};
        for (std::size_t c = 0; c < 3; ++c) {
          const std::size_t index = sample_index(n, cell[c]);
          middle += sample_position(mesh_, s, n, cell[c], double(alpha.plane()[index])) / 3.0;
          if (!voids.empty()) holes[c] = voids[k]->value(0, index);
        }
        if (is_hole(holes[0], holes[1], holes[2]) || is_in(wanted.cut, middle) || is_in(wanted.fill, middle)) return;
        most[k] = std::max(most[k], rays_.nearest(lattice_.to_lattice(middle)).distance * lattice_.step);
      });
    });
    return most;
  }

  const Snapshot& surface_;
  const SlabMesh& mesh_;
  const Lattice& lattice_;
  std::span<const SlabId> slabs_;
  OldSurface old_;
  const SourceRays& rays_ = old_.rays();
  std::vector<FibreId> moved_;
  Tiles displacement_;
};

}  // namespace

Resampled resample(const Snapshot& surface, const SlabMesh& mesh, const Lengthened& longer,
                   std::span<const SlabId> slabs, const RoomWanted& wanted, double most_moved,
                   const Progress& progress) {
  return Resampling(surface, mesh, longer, slabs).run(wanted, most_moved, progress);
}

}  // namespace relief::detail
