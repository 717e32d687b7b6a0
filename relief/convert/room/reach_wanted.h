// How far fibres would have to reach so that solids can be cut out of the surface, and others put on it.
#pragma once

#include <relief/base/vec.h>
#include <relief/convert/geometry/shell.h>
#include <relief/convert/room.h>
#include <relief/convert/sample/fibre_sampling.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace relief::detail {

/// In radii of a solid: tools tell what they take farther beside it.
inline constexpr double kBeside = 0.05;

/// A place on the surface of a slab: its weights, and where it lies on a lattice.
struct SurfacePlace {
  std::array<double, 3> weights;
  Vec3d at;
};
/// Returns places all over the surface of a slab, its corners included: those of samples, at most so many intervals per
/// edge that a ball as wide as the slab hides less than a margin between them.
[[nodiscard]] std::vector<SurfacePlace> places_on(const Snapshot& surface, const Lattice& lattice, SlabId slab);

/// A place on the surface of a slab whose fibre ends too early, and by how much; lattice steps.
struct Lacking {
  std::uint32_t face = 0;  ///< by its number among those looked at
  Side side = kInner;
  std::array<double, 3> weights{};
  Vec3d near;           ///< where the surface lies
  double lack = 0;      ///< of what is wanted
  double short_of = 0;  ///< of what the tool needs at least, without the margin; below 0 where it has that
  double overhang =
      0;  ///< from the surface to a solid that lies beside it and is met nevertheless: a tool cuts this too
  /// From the surface to a solid beside it, however long the fibre is; 0 where that is below kBeside.
  double beside = 0;
  Vec3d axis;  ///< of the solid that reaches furthest there
  Vec3d way;   ///< from the surface along the fibre to where it is to end at least
};

/// The surface of some slabs, and the solids that its fibres may meet. Lattice coordinates.
class ReachWanted {
 public:
  /// Places on the surface are those of the samples, at most so many intervals per edge. The solids are on the lattice.
  ReachWanted(const Snapshot& surface, const Lattice& lattice, std::span<const SlabId> slabs,
              std::span<const Capsule> cut, std::span<const Capsule> fill, const RoomGoals& goals);

  /// Calls visit(Lacking) for all places that lack something or lie over a solid beside them, with the ends that
  /// ends_of(face, corner) gives.
  template <typename EndsOf, typename Visit>
  void for_each_lack(EndsOf&& ends_of, Visit&& visit) const {
    for (std::uint32_t f = 0; f < faces_.size(); ++f)
      if (may_lack(f)) visit_face(f, {ends_of(f, 0), ends_of(f, 1), ends_of(f, 2)}, visit);
  }
  /// Returns whether a solid may be met by fibres of the slab.
  [[nodiscard]] bool may_lack(std::uint32_t face) const noexcept {
    return !faces_[face].solids[kInner].empty() || !faces_[face].solids[kOuter].empty();
  }

 private:
  struct Solid {
    std::uint32_t number;
    bool is_near;  ///< beside the slab itself, not only beyond its ends
  };
  struct FaceWish {
    SlabCorners corners;                       // only the order of the fibres is of use
    double spacing = 0;                        // of the samples
    std::array<std::vector<Solid>, 2> solids;  // by the side on which they want room
    std::vector<SurfacePlace> places;
  };
  template <typename Visit>
  void visit_face(std::uint32_t f, const std::array<Ends, 3>& ends, Visit& visit) const {
    for (const SurfacePlace& place : faces_[f].places)
      for (const Side side : {kInner, kOuter})
        if (const Need need = need_at(faces_[f], ends, place, side);
            need.wanted > need.now || need.overhang > 0 || need.beside > 0)
          visit(Lacking{f, side, place.weights, place.at, std::max(need.wanted - need.now, 0.0), need.least - need.now,
                        need.overhang, need.beside, need.axis, need.along * need.least});
  }
  struct Need {
    double now = 0, least = 0, wanted = 0;  // reach from the surface along the fibre
    double overhang = 0, beside = 0;
    Vec3d axis = {};
    Vec3d along = {};  // the fibre, unit, towards the side that is to be longer
  };
  [[nodiscard]] Need need_at(const FaceWish& face, const std::array<Ends, 3>& ends, const SurfacePlace& place,
                             Side side) const noexcept;

  std::array<std::vector<Capsule>, 2> solids_;  // by side
  double margin_, fade_share_, fade_spacings_;
  std::vector<FaceWish> faces_;
};

}  // namespace relief::detail
