// From a triangle mesh to slabs with displacement maps.
#pragma once

#include <relief/base/error.h>
#include <relief/base/progress.h>
#include <relief/core/model.h>
#include <relief/mesh/repair.h>
#include <relief/mesh/triangle_mesh.h>

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace relief {

struct ConvertSettings {
  int slabs = 200;    ///< target; 4 .. 1,000,000
  int intervals = 0;  ///< n of every slab, 1..128, or 0: chosen per slab by `error`; the paper used 15
  /// How far the surface may lie from the mended source, share of the diagonal: n becomes the power of two up to 128
  /// that keeps to it, where one does. Empty: 1e-4 where samples four times as dense as the source's corners keep to
  /// it.
  std::optional<double> error = {};
  /// m of the colour layer, only for coloured sources; 0: a power of two, at most 128, at which its samples lie twice
  /// as dense as the source's colours do in nearly all slabs, and at least as dense as a given n.
  int colour_intervals = 0;
  double thickness = 0.1;  ///< longest fibre, share of the source's diagonal
  Unit unit = Unit::Millimetre;
  std::optional<double> remesh = {};  ///< make the source a solid anew first; the edge of a voxel, share of the
                                      ///< source's diagonal, or 0: chosen from the source
  std::optional<Mode> mode = {};      ///< empty: certified where that can be reached, else preview
  /// Bytes of memory for the samples. Beyond it, or all of them where a given n makes them more than that, they lie in
  /// a temporary file (see PagedMemory), which is slower than memory; without it in memory. The result is the same, but
  /// a model that is to be touched or sculpted must then be opened from its file. So does what large sources need only
  /// before and after slabs are made.
  std::optional<std::size_t> sample_memory = {};
};

struct Distance {
  double rms = 0, max = 0;
  std::size_t points = 0;  ///< looked at for the greatest
};

/// What was made, and how long it took.
struct ConvertReport {
  RepairReport repair;
  std::size_t source_triangles = 0;  ///< after repair
  std::size_t slabs = 0;
  std::size_t slabs_asked = 0;    ///< where the mode could not be kept with so many, there are more
  std::size_t dropped_parts = 0;  ///< smallest parts left out because the target cannot hold them
  std::size_t dropped_slabs = 0;  ///< left out because they had no room beside others, as where the source meets itself
  std::size_t fibres_cast = 0;    ///< through the samples of the finest grids, and more: a million at least
  std::size_t hits_single = 0;    ///< fibres that met the source exactly once
  std::size_t hits_none = 0;      ///< filled from their neighbours
  std::size_t hits_several = 0;   ///< the crossing that agrees with the neighbours was taken
  /// The error that was asked for, or else is aimed at; slabs that do not keep to it, of the displaced surface to the
  /// mended source or back; the greatest distance in them. Shares of the diagonal; not where n was given.
  double error = 0;
  std::size_t slabs_too_coarse = 0;
  double too_coarse_most = 0;
  /// Root mean square over an even choice of points, and greatest distance, shares of the diagonal: from the displaced
  /// surface to the mended source, back from its triangles that are not phantom, and the same to and from the source as
  /// it was read. The greatest is that in the middles of micro-triangles and of their edges, and at the source's
  /// corners.
  Distance to_mended, from_mended, to_source, from_source;
  double thickness_min = 0;  ///< shortest fibre, share of the diagonal
  double thickness_median = 0;
  /// Source vertices moved so that a direction sees all their faces, or off what these met (certified).
  std::size_t moved_vertices = 0;
  double moved_most = 0;               ///< how far at most, share of the diagonal
  std::size_t parted_vertices = 0;     ///< of these, such as lay on others
  std::size_t replaced_triangles = 0;  ///< cut out and closed with patches: where the source met itself, folded or was
                                       ///< seen from no side, and around there
  double replaced_widest = 0;          ///< across the widest hole that this made, share of the diagonal
  Vec3d replaced_near;                 ///< the middle of that
  std::size_t vanished_parts = 0;      ///< that were cut out as a whole
  std::size_t specks = 0;              ///< parts left out, narrower than 1e-4 of the diagonal, on which no shell stands
  std::size_t closed_openings = 0;     ///< rims closed with phantom triangles, whose samples are void
  std::size_t phantom_triangles = 0;
  struct Remesh {
    double voxel = 0;        ///< its edge, share of the diagonal
    std::size_t sheets = 0;  ///< parts that close nothing off, made two voxels thick
    std::size_t crumbs = 0;  ///< parts of a few voxels, left out
  };
  std::optional<Remesh> remesh;    ///< where it was asked for, or tolerant mode could not do without
  std::vector<std::string> notes;  ///< what is odd about the source; sentences without a full stop
  std::string not_certified;       ///< why the shell is not certified, where that was tried; a sentence
  /// Connected parts of the mended source. The certificate is one for all of them: where some cannot have it, none has,
  /// then the parts are those of the repaired source, numbered by their first triangle, and the obstacles tell which
  /// ones these are.
  struct Parts {
    struct Obstacle {
      std::size_t part = 0, triangles = 0;
      Vec3d near;
      std::string reason;  ///< a clause
    };
    std::size_t count = 0, certified = 0;
    std::vector<Obstacle> obstacles;  ///< the first twenty
  } parts;
  struct Phase {
    std::string name;
    double seconds;       ///< thread CPU time summed over all threads
    double wall_seconds;  ///< as it passed
  };
  std::vector<Phase> phases;
};

struct Conversion {
  Model model;
  ConvertReport report;
  TriangleMesh
      mended;  ///< the repaired source, the surface that the displacement was sampled from; phantom_from is set
};

/// With `remesh`, the source becomes a solid first: sheets that meet, double and cross count as one, holes are closed,
/// parts that close nothing off get a thickness of two voxels, and what is thinner than a voxel is lost; that solid is
/// then the mended source. Certified mode: a thin shell on the mended source is made coarse by steps of which each
/// keeps C0 to C7 of shell.md, so every fibre meets the mended source once; more slabs than the target remain where no
/// such step is left. Tolerant mode goes on from there with steps that keep C0 to C5, as long as the target is not
/// reached, then with such as keep C0 to C4 and leave little of the source outside, then on solids of it with ever
/// larger voxels; where the parts alone take more slabs, the smallest are left out. A model that such steps were
/// allowed for is tolerant here; who lets the verifier judge it may call it certified. Certified for closed sources
/// whose sheets do not meet; the mended source lies on the lattice. Preview mode: decimates the source to the target,
/// gives every vertex a direction that all its faces see and depths at which every slab passes the closed-form Jacobian
/// condition and no two of its triangles intersect. Then the displacement is sampled along the fibres, and the colours
/// of the source as it was read where they cross it. Fibre ends lie on a lattice whose step is a power of two. The
/// result does not depend on the number of threads. Errors: Corrupt (nothing usable in the source), NotManifold,
/// Unfoldable (certified: no certificate; preview: no valid depths at any count up to 16 times the target),
/// InvalidArgument, Cancelled. A source that is moved here is given back when it is not needed.
[[nodiscard]] Result<Conversion> convert(TriangleMesh source, const ConvertSettings& settings,
                                         const Progress& progress = {});

/// What may still lead to a model where this mode cannot be had, as the end of a sentence.
[[nodiscard]] std::string remedy(Mode mode, bool is_remeshed);

/// The displaced surface as a plain mesh with one vertex per distinct sample; level as in tessellate().
[[nodiscard]] TriangleMesh to_mesh(const Snapshot& model, int level = 0);

/// The cage as text, every number %.17g: "relief-slabs 1" (see docs/file-format.md).
[[nodiscard]] std::string to_slabs_text(const SlabMesh& mesh);

/// A few lines for a person.
[[nodiscard]] std::string to_string(const ConvertReport& report);

}  // namespace relief
