// From a triangle mesh to slabs with displacement maps.
#pragma once

#include <relief/base/error.h>
#include <relief/base/progress.h>
#include <relief/convert/stages.h>
#include <relief/core/clay.h>
#include <relief/core/model.h>
#include <relief/mesh/repair.h>
#include <relief/mesh/triangle_mesh.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace relief {

/// Holds what convert() is asked for.
struct ConvertSettings {
  int slabs = 200;    ///< target; 4 .. 1,000,000
  int intervals = 0;  ///< n of every slab, 1..128, or 0: chosen per slab by `error`; the paper used 15
  /// How far the surface may lie from the mended source, share of the diagonal: n becomes the power of two up to 128
  /// that keeps to it, where one does. Empty: 1e-4 where samples four times as dense as the source's corners keep to
  /// it.
  std::optional<double> error = {};
  /// Intervals m of the colour layer, only for coloured sources. 0: the power of two up to 128 that samples twice as
  /// densely as the source's colours in nearly all slabs, and at least as densely as a given n.
  int colour_intervals = 0;
  double thickness = 0.2;             ///< longest fibre, share of the source's diagonal
  Unit unit = Unit::Millimetre;       ///< what one model unit is
  std::optional<double> remesh = {};  ///< make the source a solid again first; the edge of a voxel, share of the
                                      ///< source's diagonal, or 0: chosen from the source
  std::optional<Mode> mode = {};      ///< certified or tolerant; empty: the best that can be proved
  /// Bytes of memory for the samples; empty: all in memory. Beyond it they lie in a temporary file (PagedMemory), which
  /// is slower, as does what large sources need only before and after slabs are made. The result is the same. To touch
  /// or sculpt such a model, open it from its file.
  std::optional<std::size_t> sample_memory = {};
  StageSink show = {};  ///< is given the stages as they are reached
};

/// Distances between two surfaces, shares of the diagonal.
struct Distance {
  /// root mean square, and the greatest
  double rms = 0, max = 0;
  std::size_t points = 0;  ///< looked at for the greatest
};

/// Holds what was made, and how long it took.
struct ConvertReport {
  static constexpr std::size_t kMostNamed = 5;  ///< of what was left out
  RepairReport repair;                          ///< what the import's repair did
  std::size_t given_triangles = 0;              ///< as they were read
  std::size_t source_triangles = 0;             ///< after repair
  std::size_t slabs = 0;                        ///< slabs of the model
  std::size_t slabs_asked = 0;                  ///< where the mode could not be kept with so many, there are more
  std::size_t dropped_parts = 0;                ///< smallest parts left out because the target cannot hold them
  /// Components left out because they lie so far from what holds the area that they alone would set the scale.
  struct Strays {
    /// how many, and their triangles
    std::size_t components = 0, triangles = 0;
    Vec3d near;                  ///< the middle of the farthest
    double away = 0;             ///< how far off that is, in diagonals of what holds the area
  } strays;                      ///< small components that were left out
  std::size_t fibres_cast = 0;   ///< through the samples of the finest grids, and more: a million at least; and as many
                                 ///< for each share of the source's visible area that no slab holds
  std::size_t hits_single = 0;   ///< fibres that met the source exactly once
  std::size_t hits_none = 0;     ///< filled from their neighbours, or missing with the slab
  std::size_t hits_missing = 0;  ///< of these, such as stand for the source's missing area
  std::size_t hits_several = 0;  ///< the crossing that agrees with the neighbours was taken
  /// The error that was requested, or else is aimed at, share of the diagonal; 0 where n was given. Slabs that do not
  /// keep to it, of the displaced surface to the mended source or back; with a given n, those that do not keep to 1e-4
  /// and for which the source has more detail than n. The greatest distance in them, share of the diagonal.
  double error = 0;
  bool error_asked = false;          ///< whether an error was requested, rather than n
  std::size_t slabs_too_coarse = 0;  ///< slabs that miss it
  double too_coarse_most = 0;        ///< the greatest distance in these, share of the diagonal
  /// Root mean square over an even choice of points, and greatest distance, shares of the diagonal. From the model to
  /// the mended source, back from its triangles except fill triangles, and the same for the source as read. The
  /// greatest is taken in the middles of micro-triangles and of their edges, and at the source's corners.
  Distance to_mended, from_mended, to_source, from_source;
  /// Says how much of the source's visible area the model has. Not visible is what lies inside of the closed surface
  /// that the slabs stand on (winding number above one half on both sides).
  struct Coverage {
    static constexpr double kNear = 0.01;    ///< of the diagonal: how far a place looks for the model, and how far what
                                             ///< the slabs stand on may lie from the source
    static constexpr double kWhole = 0.995;  ///< a certificate is only spoken of with such a share at least; the rims
                                             ///< of openings lose up to a micro-triangle
    std::size_t places = 0;  ///< spread evenly over the visible area, from which the model was looked for: along the
                             ///< source's normal there, kNear both ways, and as near as repair moved anything at most
    std::size_t missed = 0;  ///< of these, met nothing
    double share = 1;        ///< of the visible area, that is not missing
    double farthest = 0;     ///< of that, from what the slabs stand on at most, share of the diagonal
    double beyond =
        0;  ///< how far what the slabs stand on lies from the source, fill triangles aside; share of the diagonal
    double hidden = 0;  ///< share of the whole area that is known not to be visible; looked for where some lies far off
    Vec3d missing_near;         ///< the place that is farthest off, where some is missing
  } coverage;                   ///< how much of the source lies in slabs
  double thickness_min = 0;     ///< shortest fibre, share of the diagonal
  double thickness_median = 0;  ///< median fibre
  Clay clay;                    ///< below the surface and above it, shares of the diagonal
  /// Source vertices moved so that a direction sees all their faces, or off what these met (certified).
  std::size_t moved_vertices = 0;
  double moved_most = 0;               ///< how far at most, share of the diagonal
  std::size_t parted_vertices = 0;     ///< of these, such as lay on others
  std::size_t replaced_triangles = 0;  ///< cut out and closed with patches: where the source met itself, folded or was
                                       ///< seen from no side, and around there
  double replaced_widest = 0;          ///< across the widest hole that this made, share of the diagonal
  Vec3d replaced_near;                 ///< the middle of that
  std::size_t vanished_parts = 0;      ///< that were cut out as a whole
  std::size_t specks = 0;  ///< components left out, narrower than 1e-4 of the diagonal, on which no shell stands
  /// A component that has no slabs.
  struct LeftOut {
    std::size_t triangles = 0;  ///< its triangles
    Vec3d near;                 ///< a point of it, model units
    double across = 0;          ///< share of the diagonal
    std::string reason;         ///< a clause
  };
  std::vector<LeftOut> left_out;       ///< the first kMostNamed tiny components
  double lattice_step = 0;             ///< of what the shell stands on, share of the diagonal
  std::size_t split_high_valence = 0;  ///< vertices with very many triangles, which rings divide now
  std::size_t truncated_spikes = 0;    ///< vertices whose faces no direction saw, cut off and closed with patches
  std::size_t closed_openings = 0;     ///< openings of the source of which fill triangles are left; their samples are
                                       ///< void
  std::size_t phantom_triangles = 0;   ///< triangles that fill holes
  /// Holds what the remesh did.
  struct Remesh {
    double voxel = 0;        ///< its edge, share of the diagonal
    std::size_t sheets = 0;  ///< parts that close nothing off, made two voxels thick
    std::size_t crumbs = 0;  ///< parts of a few voxels, left out
    double lost = 0;         ///< share of the area of the solid's skin that is a voxel away or more: thinner than one
    Vec3d lost_near = {};    ///< the place of it that is farthest away, model units
    /// greatest distances between the two, share of the diagonal
    double to_skin = 0, from_skin = 0;
    bool is_smooth = false;  ///< the sharp edges of the source were given up
  };
  /// Of a source whose parts overlap: what became of its triangles, and how far points lie from where they would
  /// without rounding.
  struct Skin {
    std::size_t cut = 0;         ///< triangles of which parts lie inside
    std::size_t dropped = 0;     ///< that lie inside as a whole
    std::size_t open_parts = 0;  ///< parts with openings of which nothing is left: they lay inside of others
    Vec3d open_near = {};        ///< a point of the first of them, model units
    std::size_t coincident = 0;  ///< pieces of triangles that lay on others
    std::size_t repaired = 0;    ///< points moved where the cuts left slivers or rounding made faces cross
    double moved_most = 0;       ///< share of the diagonal
    std::size_t crossing = 0;    ///< pairs of triangles that cross nevertheless
    std::size_t specks = 0;      ///< parts of the skin left out, narrower than 1e-4 of the diagonal
  };
  std::optional<Skin> skin;      ///< where its outer skin took the place of the source
  std::optional<Remesh> remesh;  ///< where it was requested, or the mode could not do without
  /// Surface of which winding does not decide whether it lies inside, as open sheets through solids: it may be
  /// missing. The greater of what the remesh and the outer skin find.
  struct Undecided {
    static constexpr double kTold = 0.005;  ///< least share that is told; less of it lies around any hole
    double share = 0;  ///< of the source's area as scanned (repaired, without fill); 0: less than is told
    Vec3d near;        ///< a place of it, model units, where there is some
  } undecided;         ///< what of the source winding leaves open
  /// Holds what closed surfaces of the mended source's topology take at least; where there are more slabs than asked
  /// for.
  struct Fewest {
    /// slabs, and why so many: components and handles
    std::size_t slabs = 0, components = 0, handles = 0;
  } fewest;                ///< what the source needs at least
  bool is_fewest = false;  ///< tolerant mode found no way to the slabs asked for
  /// Slabs that stood on the source itself: there were too many, and a solid took its place.
  std::size_t slabs_that_hold = 0;
  std::vector<std::string> notes;  ///< what is odd about the source; sentences without a full stop
  std::string not_certified;       ///< why the shell is not certified, where that was tried; a sentence
  bool refused = false;            ///< by the verifier, which that sentence says; of whoever asks the verifier
  /// Connected components of the mended source. One certificate covers all of them: where one component cannot have it,
  /// none has. Then they are those of the repaired source, numbered by their first triangle, and `obstacles` names the
  /// ones at fault.
  struct Parts {
    /// A component without a certificate, and why.
    struct Obstacle {
      /// its number, and its triangles
      std::size_t part = 0, triangles = 0;
      Vec3d near;          ///< a point of the obstacle, model units
      std::string reason;  ///< a clause
    };
    /// components, and those of them that were certified
    std::size_t count = 0, certified = 0;
    std::vector<Obstacle> obstacles;  ///< the first twenty
  } parts;                            ///< connected components of the source
  /// A step of the work and its cost.
  struct Phase {
    std::string name;     ///< the name that progress shows
    double seconds;       ///< thread CPU time summed over all threads
    double wall_seconds;  ///< as it passed
  };
  std::vector<Phase> phases;  ///< in the order of the work
};

/// Holds what convert() makes.
struct Conversion {
  Model model;           ///< the model
  ConvertReport report;  ///< what was done, and how well
  TriangleMesh
      mended;  ///< the repaired source, the surface that the displacement was sampled from; phantom_from is set
};

/// Makes a model from a mesh, certified where it can be (docs/explanation/conversion.md), else as `settings.mode`
/// allows. Colours come from the source as read. The result does not depend on the number of threads. A moved source
/// comes back when it is not needed. Errors: Corrupt (nothing usable), NotManifold, Unfoldable (no certificate),
/// InvalidArgument, Cancelled.
[[nodiscard]] Result<Conversion> convert(TriangleMesh source, const ConvertSettings& settings,
                                         const Progress& progress = {});

/// Returns whether nearly all that can be seen of the source is there, and the model lies nowhere far from it: else a
/// proof speaks of something else, and the model is not called certified.
[[nodiscard]] bool is_of_the_source(const ConvertReport& report) noexcept;

/// Returns the greatest distance between the model and the source, both ways, with what the slabs stand on; of the
/// source what can be seen and is not missing. Share of the diagonal.
[[nodiscard]] double farthest_off(const ConvertReport& report) noexcept;

/// Returns what may still lead to a model where this mode is not available, as the end of a sentence.
[[nodiscard]] std::string remedy(Mode mode, bool is_remeshed);

/// Returns the displaced surface as a plain mesh with one vertex per distinct sample; level, phase and cancelling
/// as in tessellate().
[[nodiscard]] TriangleMesh to_mesh(const Snapshot& model, int level = 0, const Progress& progress = {});

/// Says how the surface goes into a mesh file.
struct SurfaceExport {
  /// Which axis shall point up.
  enum class Up : std::uint8_t {
    AsItLies,  ///< nothing is turned
    Y,         ///< what was up along z is up along y: a turn by 90 degrees about x
    Z,         ///< what was up along y is up along z: the turn back
  };
  int level = 0;                 ///< of detail, as in tessellate()
  Up up = Up::AsItLies;          ///< whether the mesh is turned
  Unit unit = Unit::Millimetre;  ///< what one model unit is
};

/// Holds what a mesh file got.
struct Exported {
  /// in the file
  std::size_t vertices = 0, triangles = 0;
};

/// Writes the displaced surface as a mesh, as export_mesh() does. PLY gets double coordinates where the model lies
/// farther than 20 of its diagonals from the origin. Phase "export". Errors: those of export_mesh().
[[nodiscard]] Result<Exported> export_surface(const Snapshot& model, const std::filesystem::path& file,
                                              const SurfaceExport& how = {}, const Progress& progress = {});

/// Returns the cage as text, its roots without their cuts, every number %.17g: "relief-slabs 1" (see
/// docs/reference/slabs.md).
[[nodiscard]] std::string to_slabs_text(const SlabMesh& mesh);

/// Writes to_slabs_text() into a file, whole and at once. Errors: Io; then the file is as it was.
[[nodiscard]] Status export_slabs(const SlabMesh& mesh, const std::filesystem::path& file);

/// Returns what a person wants to know first, in one sentence without its full stop: the mode, how far the model lies
/// from the scan in the user's unit, and what was removed, patched and moved.
[[nodiscard]] std::string verdict(const ConvertReport& report, const ModelInfo& info);

/// Returns a few lines for a person.
[[nodiscard]] std::string to_string(const ConvertReport& report);

}  // namespace relief
