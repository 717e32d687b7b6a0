// Every question one can ask of a snapshot. Pure functions; those marked noexcept neither allocate nor lock.
#pragma once

#include <relief/base/progress.h>
#include <relief/core/surface_point.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <optional>

namespace relief {

namespace detail {
/// The slab as p = A + B u + C v + (D + E u + F v) alpha, relative to a point. Who asks for another takes it off A
/// first, so that nothing is lost far from the origin.
struct LinearForm {
  Vec3d a, b, c, d, e, f;
  double size2 = 0;  ///< squared length scale of the slab

  LinearForm() = default;
  LinearForm(const SlabCorners& k, Vec3d point) noexcept
      : a(k.inner[0] - point),
        b(k.inner[1] - k.inner[0]),
        c(k.inner[2] - k.inner[0]),
        d(k.outer[0] - k.inner[0]),
        e((k.outer[1] - k.inner[1]) - d),
        f((k.outer[2] - k.inner[2]) - d),
        size2(std::max({dot(b, b), dot(c, c), dot(d, d)})) {}
};

/// Newton for the coordinates of p (relative to the form's origin), also somewhat outside the slab. False when it does
/// not settle near the slab.
[[nodiscard]] bool solve(const LinearForm& s, Vec3d p, SlabCoord& at) noexcept;

/// One slab of one cage.
struct SlabInHand {
  std::uint64_t cage = 0;  ///< its number
  SlabId slab = kNoSlab;
  SlabCorners corners = {};
  LinearForm form;  ///< relative to the origin
};

/// All that probe() reads of one cell of one snapshot.
struct KnownCell {
  CellNormals normals;
  std::array<double, 3> alphas = {};
  bool hole = false;
};
}  // namespace detail

/// Holds what the last query found; makes the next one quick, never different.
struct LocateHint {
  SlabCoord last;                 ///< where the last query ended
  detail::SlabInHand shape = {};  ///< of last.slab, or of one before
  detail::KnownCell cell = {};    ///< of probe()
};

/// Returns the slab that holds the point and the place in it; empty outside all slabs (paper, Sec. 3.1). The hint's
/// slab and its neighbours come first, then the hierarchy. A point on a wall belongs to exactly one slab (owns()). (u,
/// v, alpha) reproduce the point within 1e-9 of the slab's size. Cost: two Newton steps with a hint of the last tick.
[[nodiscard]] std::optional<SlabCoord> locate(const SlabMesh& mesh, Vec3d point, LocateHint& hint) noexcept;

/// Returns the coordinates of a point in one given slab, also a little outside it (u, v, 1-u-v >= -margin); empty when
/// alpha is not within [-margin, 1+margin] or there is no solution.
[[nodiscard]] std::optional<SlabCoord> coordinates_in(const SlabMesh& mesh, SlabId slab, Vec3d point,
                                                      double margin) noexcept;

/// On which side of a wall a point lies: a function of the point and the two fibres alone, taken in order of their
/// numbers, so both slabs of the wall get the same answer. True: on the side of the slab that runs a -> b
/// counter-clockwise.
[[nodiscard]] bool wall_side(const SlabMesh& mesh, FibreId a, FibreId b, Vec3d point) noexcept;

/// Returns whether the slab is the owner of the point: alpha in [0, 1], and for each wall inside it or, within 1e-5 of
/// the wall in barycentric terms, on its side of it by wall_side().
[[nodiscard]] bool owns(const SlabMesh& mesh, SlabId slab, Vec3d point) noexcept;

/// Displacement at (u, v), interpolated from the three nearest samples (paper, Sec. 3.2).
[[nodiscard]] double displacement_at(const Snapshot& model, SlabId slab, double u, double v) noexcept;
/// Returns a one-channel layer at (u, v), interpolated likewise; `fallback` where the model has no such layer.
[[nodiscard]] double layer_at(const Snapshot& model, Layer layer, SlabId slab, double u, double v,
                              double fallback) noexcept;
/// Colour at (u, v), 0..1; white where the model has none.
[[nodiscard]] Vec3f colour_at(const Snapshot& model, SlabId slab, double u, double v) noexcept;

/// Returns whether the surface has a hole at (u, v); O(1).
[[nodiscard]] bool hole_at(const Snapshot& model, SlabId slab, double u, double v) noexcept;

/// Returns the point at (u, v) of a slab.
[[nodiscard]] SurfacePoint surface_point(const Snapshot& model, SlabId slab, double u, double v) noexcept;

/// Holds what the cursor touches (paper, Sec. 3.3 and 3.4).
struct Contact {
  SlabCoord at;          ///< the cursor's own coordinates
  SurfacePoint surface;  ///< the surface along the cursor's fibre
  double depth = 0;      ///< penetration along the fibre, model units; 0 when the cursor is above the surface
  bool hole = false;     ///< the surface has a hole there, so nothing is touched at any depth
  /// Returns whether the cursor is below the surface.
  [[nodiscard]] bool touching() const noexcept { return depth > 0; }
};
/// Empty outside all slabs.
[[nodiscard]] std::optional<Contact> probe(const Snapshot& model, Vec3d cursor, LocateHint& hint) noexcept;

/// Returns a box around the surface, not much larger than it, where the box of the cage also holds the room around it;
/// what is hole is left out, unless all is. Some 50 ns per slab.
[[nodiscard]] Box3d bounds_of_surface(const Snapshot& model) noexcept;

/// Returns whether a point is in the solid: in a slab below the surface, or below all slabs. A ray where it is in no
/// slab.
[[nodiscard]] bool inside(const Snapshot& model, Vec3d point, LocateHint& hint) noexcept;

/// The place that was picked last, of this or another snapshot or model; makes the next pick quick, never different.
/// Starts as none.
struct PickHint {
  SlabId slab = kNoSlab;  ///< which slab
  /// place in its triangle, 0 to 1
  double u = 0, v = 0;
  detail::CellNormals normals = {};  ///< there
};

/// Returns the nearest point of the tessellated surface, holes left out, exact as far as doubles hold squared
/// distances. Of equally near points the one in the lowest slab counts. The slab is kNoSlab where p is not finite or
/// beyond 1e154, everything is a hole, or nothing is nearer than `within`. Cost: about 2 us on the surface with a near
/// hint, at any n.
[[nodiscard]] SurfacePoint closest_point(const Snapshot& model, Vec3d p, PickHint& hint,
                                         double within = std::numeric_limits<double>::infinity()) noexcept;
/// Returns the same from nothing.
[[nodiscard]] SurfacePoint closest_point(const Snapshot& model, Vec3d p,
                                         double within = std::numeric_limits<double>::infinity()) noexcept;
/// Says where a ray meets the surface.
struct RayHit {
  SurfacePoint point;   ///< the place
  double distance = 0;  ///< in lengths of the ray's direction
};
/// Returns the first crossing of the tessellated surface with the ray; watertight, see Sweep. Of crossings that are
/// equally far to the bit it is that of the lowest slab. Cost: about 5 us, whatever n, with a hint or without.
[[nodiscard]] std::optional<RayHit> raycast(const Snapshot& model, const Ray3d& ray, PickHint& hint) noexcept;
/// Returns the same from nothing.
[[nodiscard]] std::optional<RayHit> raycast(const Snapshot& model, const Ray3d& ray) noexcept;

/// Returns whether the copies of every shared sample are bit-identical in all layers, constrained samples have exactly
/// their constrained_value(), and all values are within their ranges; else the first offence (Corrupt, naming layer,
/// slab and sample).
/// `progress` is told the share of tiles, and asked: Cancelled.
[[nodiscard]] Status validate(const Snapshot& model, const Progress& progress = {});
/// Returns the same for one tile and its copies in the tiles around it.
[[nodiscard]] Status validate(const Snapshot& model, Layer layer, SlabId slab);

}  // namespace relief
