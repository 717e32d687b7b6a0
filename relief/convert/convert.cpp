#include <relief/base/cpu_time.h>
#include <relief/base/paged_memory.h>
#include <relief/base/try.h>
#include <relief/convert/certified.h>
#include <relief/convert/convert.h>
#include <relief/convert/decimate.h>
#include <relief/convert/fill.h>
#include <relief/convert/laid_aside.h>
#include <relief/convert/lattice.h>
#include <relief/convert/measure.h>
#include <relief/convert/reach.h>
#include <relief/convert/remesh.h>
#include <relief/convert/resolution.h>
#include <relief/convert/sampling.h>
#include <relief/convert/shell.h>
#include <relief/convert/sort_unique.h>
#include <relief/convert/source_surface.h>
#include <relief/core/tessellate.h>
#include <relief/verify/verify.h>

#include <malloc.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <functional>
#include <new>
#include <numeric>
#include <string_view>
#include <utility>

namespace relief {
namespace {

using namespace detail;

std::unexpected<Error> cancelled() { return fail(Errc::Cancelled, "conversion was cancelled."); }

/// Adds phases to a report: time from one call to the next, and CPU time of the whole process.
class PhaseClock {
 public:
  explicit PhaseClock(std::vector<ConvertReport::Phase>& phases) : phases_(phases) {}
  void phase_done(std::string_view name) {
    phases_.push_back({std::string(name), watch_.cpu(), watch_.wall()});
    watch_ = {};
  }

 private:
  std::vector<ConvertReport::Phase>& phases_;
  Stopwatch watch_;
};

constexpr double kUsualError = 1e-4;  // share of the diagonal
// How far a source vertex may be moved so that some direction sees its faces, share of the diagonal; more where sheets
// have to be pushed apart.
constexpr double kFarthest = 2e-3;

std::string number(double value) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%g", value);
  return text.data();
}

std::string place(Vec3d p) {
  std::array<char, 120> text{};
  std::snprintf(text.data(), text.size(), "(%g, %g, %g)", p.x, p.y, p.z);
  return text.data();
}

/// "7 parts".
std::string counted(std::size_t count, const char* what) {
  return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

Status check(const ConvertSettings& settings) {
  const auto outside = [](std::string_view what, const std::string& value, std::string_view range) {
    return fail(Errc::InvalidArgument, std::string(what) + " is " + value + "; it must be " + std::string(range) + ".");
  };
  if (settings.slabs < 4 || settings.slabs > 1'000'000)
    return outside("the number of slabs", std::to_string(settings.slabs), "4 to 1000000");
  if (settings.intervals < 0 || settings.intervals > kMaxIntervals)
    return outside("the number of intervals per edge", std::to_string(settings.intervals), "1 to 128");
  if (settings.error && !(*settings.error >= 1e-7 && *settings.error <= 1))
    return outside("the error", number(*settings.error), "1e-7 to 1, a share of the diagonal");
  if (settings.colour_intervals < 0 || settings.colour_intervals > kMaxIntervals)
    return outside("the number of colour intervals per edge", std::to_string(settings.colour_intervals), "0 to 128");
  if (settings.remesh && !(*settings.remesh == 0 || (*settings.remesh >= 1e-5 && *settings.remesh <= 0.1)))
    return outside("the voxel to remesh with", number(*settings.remesh), "0.00001 to 0.1, a share of the diagonal");
  if (!(settings.thickness >= 1e-4 && settings.thickness <= 1))
    return outside("the thickness", number(settings.thickness), "0.0001 to 1, a share of the diagonal");
  return {};
}

double diagonal_of(const Box3d& box) noexcept {
  const Vec3d e = box.extent();
  return std::hypot(e.x, e.y, e.z);
}

/// Of its arrays.
std::size_t bytes_of(const TriangleMesh& mesh) noexcept {
  const auto bytes = [](const auto&... arrays) { return (std::span(arrays).size_bytes() + ...); };
  return bytes(mesh.positions, mesh.triangles, mesh.colours, mesh.material_of, mesh.uvs);
}
void lay_aside(TriangleMesh& mesh, LaidAside& aside) {
  aside.take(mesh.positions, mesh.triangles, mesh.colours, mesh.material_of, mesh.uvs);
}

double area_of(const TriangleMesh& mesh) noexcept {
  double area = 0;
  for (const Face& t : mesh.triangles) {
    const Vec3d a = mesh.positions[t[0]];
    area += 0.5 * length(cross(mesh.positions[t[1]] - a, mesh.positions[t[2]] - a));
  }
  return area;
}

/// Leaves the smallest parts out when even their least number of slabs is more than `most`; says how many.
std::size_t drop_small_parts(const std::vector<Vec3d>& points, std::vector<Face>& faces, std::size_t most) {
  const Parts parts = find_parts(points.size(), faces);
  if (4 * std::size_t{parts.count} <= most) return 0;
  std::vector<double> areas(parts.count, 0);
  std::vector<std::size_t> sizes(parts.count, 0);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const Vec3d a = points[faces[f][0]];
    areas[parts.of_face[f]] += length(cross(points[faces[f][1]] - a, points[faces[f][2]] - a));
    ++sizes[parts.of_face[f]];
  }
  std::vector<std::uint32_t> order(parts.count);
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return areas[a] > areas[b]; });
  std::vector<std::uint8_t> keep(parts.count, 0);
  std::size_t used = 0, dropped = 0;
  for (const std::uint32_t part : order) {
    used += std::min<std::size_t>(4, sizes[part]);
    keep[part] = used <= most || part == order.front();
    dropped += keep[part] == 0;
  }
  std::size_t kept = 0;
  for (std::size_t f = 0; f < faces.size(); ++f)
    if (keep[parts.of_face[f]] != 0) faces[kept++] = faces[f];
  faces.resize(kept);
  return dropped;
}

struct CageSettings {
  std::size_t target;
  double longest;  ///< lattice steps
};

struct Cage {
  std::shared_ptr<const SlabMesh> mesh;
  std::size_t dropped = 0;
};

/// One base mesh with its shell, and how well they fit the source.
struct Attempt {
  Decimation::Result decimated;
  Shell shell;
  std::vector<std::uint32_t> flagged;  ///< base faces that cannot carry a slab, or whose slab misses much of the source
  double torn = 0;                     ///< share of the area that cannot carry a slab, crumbs not counted
  double missed = 0;                   ///< share of the fibres that pass the source by, weighted by area
  [[nodiscard]] double badness() const noexcept { return missed + 4 * torn + (torn > 0 ? 0.05 : 0); }
};

Attempt attempt_at(Decimation::Result decimated, const SourceSurface& source, double longest,
                   const Progress& progress) {
  constexpr double kMuch = 0.15;
  // A crumb that no slab can stand on would not get better with more faces: it is let go.
  constexpr std::uint32_t kCrumb = 8;
  Attempt attempt;
  attempt.shell = build_shell(decimated.base, wanted_fibres(decimated.base, source, longest), progress);
  attempt.decimated = std::move(decimated);
  const BaseMesh& base = attempt.decimated.base;
  std::vector<double> areas;
  double all = 0;
  for (const Face& f : base.faces) {
    const LatticePoint a = base.points[f[0]];
    areas.push_back(length(cross(to_double(base.points[f[1]] - a), to_double(base.points[f[2]] - a))));
    all += areas.back();
  }
  if (!(all > 0)) return attempt;
  const Parts parts = find_parts(base.points.size(), base.faces);
  std::vector<std::uint32_t> size(parts.count, 0), gone(parts.count, 0);
  for (const std::uint32_t part : parts.of_face) ++size[part];
  for (const std::uint32_t f : attempt.shell.dropped) ++gone[parts.of_face[f]];
  for (const std::uint32_t f : attempt.shell.dropped) {
    if (const std::uint32_t part = parts.of_face[f]; gone[part] == size[part] && size[part] <= kCrumb) continue;
    attempt.flagged.push_back(f);
    attempt.torn += areas[f] / all;
  }
  const std::vector<double> missed = missed_shares(attempt.shell, source);
  for (std::size_t s = 0; s < missed.size(); ++s) {
    attempt.missed += missed[s] * areas[attempt.shell.from[s]] / all;
    if (missed[s] > kMuch) attempt.flagged.push_back(attempt.shell.from[s]);
  }
  return attempt;
}

using CagePtr = std::shared_ptr<const SlabMesh>;

/// One interval per edge: the cage alone.
Result<CagePtr> slab_mesh_of(const Shell& shell, const Lattice& lattice) {
  std::vector<Fibre> fibres(shell.ends[kInner].size());
  for (std::size_t v = 0; v < fibres.size(); ++v)
    fibres[v] = {lattice.to_model(shell.ends[kInner][v]), lattice.to_model(shell.ends[kOuter][v])};
  std::vector<SlabMesh::Face> slabs;
  slabs.reserve(shell.faces.size());
  for (const Face& face : shell.faces) slabs.push_back({face, 1});
  RELIEF_TRY(auto mesh, SlabMesh::make(std::move(fibres), slabs));
  return std::make_shared<const SlabMesh>(std::move(mesh));
}

/// What the verifier finds.
verify::Certificate check_shell(const Shell& shell, const Lattice& lattice) {
  const auto places = [&](Side side) {
    std::vector<std::array<double, 3>> ends;
    ends.reserve(shell.ends[side].size());
    for (const LatticePoint end : shell.ends[side]) {
      const Vec3d p = lattice.to_model(end);
      ends.push_back({p.x, p.y, p.z});
    }
    return ends;
  };
  const auto inner = places(kInner), outer = places(kOuter);
  return verify::check({inner, outer, shell.faces});
}

/// Base mesh, fibres and shell in preview mode. Where faces cannot carry a slab, or slabs miss the source, the base is
/// made finer there and all is tried again, up to 16 times the target.
Result<Cage> build_cage(const std::vector<Vec3d>& points, const std::vector<Face>& faces, const SourceSurface& source,
                        const Lattice& lattice, const CageSettings& settings, const Progress& progress,
                        PhaseClock& clock) {
  constexpr double kEnough = 0.03;    // of the fibres may miss
  constexpr double kHairline = 1e-4;  // of the area may be torn
  constexpr double kFiner = 16;       // halves the edges where it weighs
  constexpr int kRounds = 5;
  const Decimation decimation(points, faces, settings.target, progress);
  if (progress.cancelled()) return cancelled();
  clock.phase_done("decimate");

  const std::size_t most = 16 * settings.target;
  std::vector<double> importance(decimation.point_count(), 1);
  // Each part takes four slabs at least; what many parts take is not taken from the large ones.
  const std::size_t for_parts = 4 * std::size_t{find_parts(points.size(), faces).count};
  std::size_t goal = std::min(most, std::max(settings.target, settings.target / 2 + for_parts));
  Attempt best;
  int in_vain = 0;
  for (int round = 0; round < kRounds; ++round) {
    progress("shell", double(round) / kRounds);
    Attempt attempt =
        attempt_at(decimation.finish(goal, most, importance, progress), source, settings.longest, progress);
    if (progress.cancelled()) return cancelled();
    std::vector<std::uint8_t> flagged(attempt.decimated.base.points.size(), 0);
    for (const std::uint32_t f : attempt.flagged)
      for (const std::uint32_t v : attempt.decimated.base.faces[f]) flagged[v] = 1;
    for (std::size_t v = 0; v < importance.size(); ++v)
      if (flagged[attempt.decimated.went_to[v]] != 0) importance[v] *= kFiner;
    const bool good = attempt.torn <= kHairline && attempt.missed <= kEnough;
    const std::size_t more = 3 * attempt.flagged.size();
    const bool better = round == 0 || attempt.badness() < 0.95 * best.badness();
    if (better) best = std::move(attempt);
    in_vain = better ? 0 : in_vain + 1;
    if (good || in_vain == 2 || goal >= most) break;
    goal = std::min(most, goal + std::max<std::size_t>(more, 4));
  }
  clock.phase_done("shell");
  const Shell& shell = best.shell;
  if (shell.faces.empty()) {
    const BaseMesh& base = best.decimated.base;
    const LatticePoint at = base.faces.empty() ? LatticePoint{} : base.points[base.faces.front()[0]];
    return fail(Errc::Unfoldable,
                "no slab can stand on the surface near " + place(lattice.to_model(at)) +
                    ", as where its sheets coincide or have no thickness; remesh the source as a solid (--remesh).");
  }
  RELIEF_TRY(auto mesh, slab_mesh_of(shell, lattice));
  return Cage{std::move(mesh), shell.dropped.size()};
}

/// What is sampled: the repaired source as it is, or closed and mended for a certified shell.
struct Ground {
  TriangleMesh mesh;             ///< phantom triangles come last
  std::size_t phantom_from = 0;  ///< the first of them
  Lattice lattice;
  bool tolerant = false;        ///< the shell may fold in a small share of the area
  std::size_t least_slabs = 0;  ///< that its parts take, where there are more than were asked for
};

/// A source whose openings are closed with phantom triangles, on the lattice; these come last.
struct Closed {
  ClosedSource source;
  std::vector<std::size_t> patches;  ///< where each rim's faces begin, and the end
  Lattice lattice;
};

Closed close_openings(const TriangleMesh& mesh, const std::vector<std::vector<std::uint32_t>>& rims,
                      const std::vector<Closing>& closings, double room) {
  Closed closed;
  ClosedSource& source = closed.source;
  std::vector<Vec3d> points = mesh.positions;
  source.faces = mesh.triangles;
  closed.patches = close_rims(points, source.faces, rims, closings);
  Box3d box;
  for (const Vec3d p : points) box.add(p);
  closed.lattice = Lattice::around(box, room);
  source.points.reserve(points.size());
  for (const Vec3d p : points) source.points.push_back(snap(closed.lattice.to_lattice(p)));
  source.phantom.assign(mesh.triangles.size(), 0);
  source.phantom.resize(source.faces.size(), 1);
  source.patch = source.phantom;
  return closed;
}

/// A patch that is about as large as what it closes would lie close behind it: a terrain or a range map gets a box.
std::vector<Closing> choose_closings(const TriangleMesh& mesh, const Parts& parts,
                                     const std::vector<std::vector<std::uint32_t>>& rims) {
  constexpr double kLarge = 0.55;  // of the part's area
  constexpr std::size_t kMostBoxes = 64;
  std::size_t boxes = 0;
  if (rims.empty()) return {};
  std::vector<std::uint32_t> part_of(mesh.positions.size(), 0);
  std::vector<double> areas(parts.count, 0);
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    const Face& t = mesh.triangles[f];
    const Vec3d a = mesh.positions[t[0]];
    areas[parts.of_face[f]] += length(cross(mesh.positions[t[1]] - a, mesh.positions[t[2]] - a));
    for (const std::uint32_t v : t) part_of[v] = parts.of_face[f];
  }
  std::vector<Closing> closings;
  for (const auto& rim : rims) {
    Vec3d centre, sum;
    for (const std::uint32_t v : rim) centre += mesh.positions[v] / double(rim.size());
    double area = 0;
    for (std::size_t k = 0; k < rim.size(); ++k) {
      const Vec3d n = cross(mesh.positions[rim[k]] - centre, mesh.positions[rim[(k + 1) % rim.size()]] - centre);
      sum += n;
      area += length(n);
    }
    const bool flat = length(sum) > 0.5 * area;
    const bool large = flat && area > kLarge * areas[part_of[rim.front()]];
    boxes += large;
    closings.push_back(large && boxes <= kMostBoxes ? Closing::Box : Closing::Membrane);
  }
  return closings;
}

/// The rims whose patches have some of these faces, ascending. `patches`: where each rim's faces begin, and their end.
std::vector<std::size_t> rims_with(const std::vector<std::size_t>& patches, std::span<const std::uint32_t> faces) {
  std::vector<std::size_t> rims;
  for (const std::uint32_t f : faces) {
    if (f < patches.front() || f >= patches.back()) continue;
    const auto next = std::upper_bound(patches.begin(), patches.end(), std::size_t{f});
    rims.push_back(static_cast<std::size_t>(next - patches.begin()) - 1);
  }
  sort_unique(rims);
  return rims;
}

/// Gives boxes to rims whose membranes have bad faces, the longest four one by one, the others together, each time
/// where the patches then meet no more of the surface and of each other than before: a box that would run through the
/// part does not help. Whether any was given, and not when cancelled.
bool give_boxes(const TriangleMesh& mesh, const std::vector<std::vector<std::uint32_t>>& rims,
                const std::vector<std::size_t>& patches, std::span<const std::uint32_t> bad_faces, double room,
                std::vector<Closing>& closings, const Progress& progress) {
  constexpr std::size_t kOneByOne = 4;  // each try costs about as much as closing all
  std::vector<std::size_t> tried = rims_with(patches, bad_faces);
  std::erase_if(tried, [&](std::size_t rim) { return closings[rim].kind != Closing::Membrane; });
  std::stable_sort(tried.begin(), tried.end(), [&](auto a, auto b) { return rims[a].size() > rims[b].size(); });
  if (tried.empty()) return false;
  bool any = false;
  std::size_t fewest = count_meetings(close_openings(mesh, rims, closings, room).source, progress);
  for (std::span<const std::size_t> left = tried; !left.empty() && !progress.cancelled();) {
    const bool one = tried.size() - left.size() < kOneByOne;
    const auto now = left.first(one ? 1 : left.size());
    left = left.subspan(now.size());
    for (const std::size_t rim : now) closings[rim] = Closing::Box;
    const std::size_t meetings = count_meetings(close_openings(mesh, rims, closings, room).source, progress);
    if (meetings <= fewest) {
      fewest = meetings;
      any = true;
    } else {
      for (const std::size_t rim : now) closings[rim] = Closing::Membrane;
    }
  }
  return any && !progress.cancelled();
}

/// Gives thin backs to rims whose boxes have bad faces, if so much as one depth makes the patches meet no more of the
/// surface and of each other; these rims come last then. Whether any was given, and not when cancelled.
bool give_backs(const TriangleMesh& mesh, std::vector<std::vector<std::uint32_t>>& rims,
                const std::vector<std::size_t>& patches, std::span<const std::uint32_t> bad_faces, double room,
                std::vector<Closing>& closings, const Progress& progress) {
  constexpr std::array<double, 4> kDepths = {0.02, 0.005, 0.00125, 0.0003};  // of the diagonal of the rim's box
  const std::vector<std::size_t> bad_rims = rims_with(patches, bad_faces);
  std::vector<std::vector<std::uint32_t>> ordered, last;
  std::vector<Closing> ordered_closings;
  for (std::size_t r = 0; r < rims.size(); ++r) {
    if (closings[r].kind == Closing::Box && std::ranges::binary_search(bad_rims, r)) {
      last.push_back(rims[r]);
    } else {
      ordered.push_back(rims[r]);
      ordered_closings.push_back(closings[r]);
    }
  }
  if (last.empty()) return false;
  ordered.insert(ordered.end(), last.begin(), last.end());
  for (const double share : kDepths) {
    std::vector<Closing> now = ordered_closings;
    for (const auto& rim : last) {
      Box3d box;
      for (const std::uint32_t v : rim) box.add(mesh.positions[v]);
      now.emplace_back(Closing::Back, share * diagonal_of(box));
    }
    const std::size_t meetings = count_meetings(close_openings(mesh, ordered, now, room).source, progress);
    if (progress.cancelled()) return false;
    if (meetings > 0) continue;
    rims = std::move(ordered);
    closings = std::move(now);
    return true;
  }
  return false;
}

/// Whether the source as it was read and what was made of it are to lie in a file while they are not needed: small ones
/// leave room for all that is made meanwhile.
bool is_short_of_memory(const ConvertSettings& settings, const TriangleMesh& as_read, const TriangleMesh& made) {
  return settings.sample_memory && bytes_of(as_read) + bytes_of(made) > *settings.sample_memory / 2;
}

/// A shell that closes the openings of a source first, as suits them.
struct ClosedShell {
  CertifiedShell made;
  Lattice lattice;
  std::size_t openings = 0;
};

/// `as_read` is not needed for it.
ClosedShell close_and_certify(TriangleMesh& open, TriangleMesh& as_read, Parts& parts, const ConvertSettings& settings,
                              double diagonal, double most_lost, const Progress& progress) {
  // What a tolerant shell may give up; what needs nothing given up comes first, in certified mode, too.
  constexpr std::array<Tolerance, 10> kTolerances = {
      {{}, {0.05}, {0.2}, {0.5}, {1}, {1, 0.01}, {1, 0.03}, {1, 0.1}, {1, 0.3}, {1, 1}}};
  constexpr int kAttempts = 3;
  const bool short_of_memory = is_short_of_memory(settings, open, as_read);
  auto rims = find_rims(open.positions.size(), open.triangles);
  std::vector<Closing> closings = choose_closings(open, parts, rims);
  ClosedShell result;
  result.openings = rims.size();
  const double room = settings.thickness * diagonal;
  for (int attempt = 1;; ++attempt) {
    Closed closed = close_openings(open, rims, closings, room);
    const double share = diagonal / closed.lattice.step;
    result.lattice = closed.lattice;
    LaidAside aside;
    if (short_of_memory) {
      lay_aside(open, aside);
      lay_aside(as_read, aside);
      aside.take(parts.of_face);
    }
    result.made = build_certified(
        std::move(closed.source),
        {.target = static_cast<std::size_t>(settings.slabs),
         .longest = settings.thickness * share,
         .farthest = kFarthest * share,
         .speck = kUsualError * share,
         .tolerances = std::span(kTolerances).first(settings.mode == Mode::Tolerant ? kTolerances.size() : 1),
         .most_lost = most_lost,
         .lay_aside = short_of_memory},
        progress);
    aside.give_back();
    const CertifiedShell& made = result.made;
    if (!made.shell.faces.empty() || made.obstacle.empty() || !made.specks.empty()) break;
    if (attempt == kAttempts) break;
    // Membranes that met the surface give way to boxes, and boxes that did to backs.
    if (attempt == 1 && give_boxes(open, rims, closed.patches, made.bad_faces, room, closings, progress)) continue;
    if (!give_backs(open, rims, closed.patches, made.bad_faces, room, closings, progress)) break;
  }
  return result;
}

/// A sentence about a part that was left out, without its full stop.
std::string left_out(const TriangleMesh& mesh, const Parts& parts, const PartObstacle& speck, double step,
                     double diagonal) {
  Box3d box;
  std::size_t triangles = 0;
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    if (parts.of_face[f] != speck.part) continue;
    ++triangles;
    for (const std::uint32_t v : mesh.triangles[f]) box.add(mesh.positions[v]);
  }
  return "a part of " + std::to_string(triangles) + " triangles at " + place((box.low + box.high) * 0.5) + ", only " +
         number(diagonal_of(box) / diagonal) + " of the diagonal across, was left out: on the lattice, whose step is " +
         number(step / diagonal) + " of it, " + speck.reason;
}

/// What closed surfaces take: fewer slabs than that cannot join to such shapes.
struct Least {
  std::size_t slabs = 0, handles = 0;
};

/// The least number of triangles that a surface of some handles has: 4 for a ball, 14 for a torus (Ringel, Jungerman).
std::size_t least_triangles(std::size_t handles) {
  const std::size_t corners =
      handles == 2 ? 10 : static_cast<std::size_t>(std::ceil((7 + std::sqrt(1 + 48 * double(handles))) / 2));
  return 2 * corners + 4 * handles - 4;
}

Least least_slabs(const ClosedSource& source, const Parts& parts) {
  std::vector<std::size_t> triangles(parts.count, 0), corners(parts.count, 0);
  std::vector<std::uint8_t> seen(source.points.size(), 0);
  for (std::size_t f = 0; f < source.faces.size(); ++f) {
    ++triangles[parts.of_face[f]];
    for (const std::uint32_t v : source.faces[f])
      if (std::exchange(seen[v], 1) == 0) ++corners[parts.of_face[f]];
  }
  Least least;
  for (std::size_t part = 0; part < parts.count; ++part) {
    const std::size_t handles = (triangles[part] / 2 + 2 - corners[part]) / 2;  // Euler
    least.handles += handles;
    least.slabs += least_triangles(handles);
  }
  return least;
}

/// The shell in certified mode, and the source that it is certified against in place of the repaired one; both stay as
/// they were, with a reason in the report (a sentence without its full stop), where there is no certificate; without
/// one when cancelled.
/// `most_lost`: share of the source's area that a tolerant shell may leave out. `as_read` is not needed for it.
std::shared_ptr<const SlabMesh> certify(Ground& ground, TriangleMesh& as_read, const ConvertSettings& settings,
                                        double diagonal, double most_lost, ConvertReport& report,
                                        const Progress& progress) {
  constexpr std::size_t kMostNotes = 5;
  report.parts = {};
  Parts parts = find_parts(ground.mesh.positions.size(), ground.mesh.triangles);
  report.parts.count = parts.count;
  std::vector<std::size_t> sizes(parts.count, 0);
  for (const std::uint32_t part : parts.of_face) ++sizes[part];
  const auto note_obstacle = [&](std::uint32_t part, Vec3d near, const std::string& reason) {
    if (report.parts.obstacles.size() == kMostBadParts) return;
    report.parts.obstacles.push_back({part, sizes[part], near, reason});
  };
  TriangleMesh rest;  // without the specks, once there are any
  TriangleMesh* open = &ground.mesh;
  std::vector<std::string> notes;  // about the specks
  std::size_t specks = 0;
  std::vector<std::uint32_t> part_number(parts.count);  // of those in `open`
  std::iota(part_number.begin(), part_number.end(), 0U);
  ClosedShell closed;
  for (;;) {
    closed = close_and_certify(*open, as_read, parts, settings, diagonal, most_lost, progress);
    const CertifiedShell& made = closed.made;
    for (const PartObstacle& bad : made.specks.empty() ? made.bad_parts : made.specks)
      note_obstacle(part_number[bad.part], closed.lattice.to_model(bad.place), bad.reason);
    if (made.specks.empty() || made.specks.size() == parts.count) break;
    std::vector<std::uint8_t> stays(parts.count, 1);
    for (const PartObstacle& speck : made.specks) {
      stays[speck.part] = 0;
      if (notes.size() < kMostNotes) notes.push_back(left_out(*open, parts, speck, closed.lattice.step, diagonal));
    }
    specks += made.specks.size();
    TriangleMesh fewer;
    fewer.positions = open->positions;
    for (std::size_t f = 0; f < parts.of_face.size(); ++f)
      if (stays[parts.of_face[f]] != 0) fewer.triangles.push_back(open->triangles[f]);
    std::size_t kept = 0;
    for (std::uint32_t part = 0; part < parts.count; ++part)
      if (stays[part] != 0) part_number[kept++] = part_number[part];
    rest = std::move(fewer);
    open = &rest;
    parts = find_parts(rest.positions.size(), rest.triangles);
  }
  CertifiedShell& made = closed.made;
  const Lattice& lattice = closed.lattice;
  if (made.shell.faces.empty()) {
    if (!made.obstacle.empty())
      report.not_certified = made.obstacle + ", first near " + place(lattice.to_model(made.place));
    return nullptr;
  }
  // The proof is the verifier's, not the builder's.
  if (const verify::Certificate certificate = check_shell(made.shell, lattice); !certificate.all()) {
    report.not_certified =
        certificate.failures.empty() ? "the shell failed its check" : certificate.failures.front().what;
    return nullptr;
  }
  auto mesh = slab_mesh_of(std::exchange(made.shell, {}), lattice);
  if (!mesh) {
    report.not_certified = "the slabs do not join: " + mesh.error().message;
    return nullptr;
  }
  if (made.divided_fans > 0)
    report.notes.push_back(std::to_string(made.divided_fans) +
                           " vertices had very many triangles around them, which rings divide now; the surface stays "
                           "within the rounding of the lattice");
  if (made.blunted_points > 0)
    report.notes.push_back(std::to_string(made.blunted_points) + (made.blunted_points == 1 ? " vertex" : " vertices") +
                           " had faces that no direction sees and long edges: the tips, at most " + number(kFarthest) +
                           " of the diagonal long, were cut off and closed with patches");
  report.moved_vertices = made.moved_points;
  report.moved_most = made.moved_most * lattice.step / diagonal;
  report.parted_vertices = made.parted_points;
  report.replaced_triangles = made.replaced_faces;
  report.replaced_widest = made.replaced_widest * lattice.step / diagonal;
  report.replaced_near = lattice.to_model(made.replaced_place);
  report.vanished_parts = made.vanished_parts;
  report.closed_openings = closed.openings;
  report.specks = specks;
  if (specks > notes.size()) notes.push_back(std::to_string(specks - notes.size()) + " more such parts were left out");
  report.notes.insert(report.notes.end(), notes.begin(), notes.end());
  report.parts = {};
  const Parts mended_parts = find_parts(made.source.points.size(), made.source.faces);
  report.parts.count = mended_parts.count;
  if (const auto asked = static_cast<std::size_t>(settings.slabs); (*mesh)->slab_count() > asked) {
    const Least least = least_slabs(made.source, mended_parts);
    ground.least_slabs = least.slabs;
    if (least.slabs > asked)
      report.notes.push_back("--slabs " + std::to_string(asked) + " cannot be reached: the mended source has " +
                             counted(mended_parts.count, "part") + " and " + counted(least.handles, "handle") +
                             ", and a part takes 4 slabs, or 14 and more with handles: " + std::to_string(least.slabs) +
                             " at least");
  }
  report.parts.certified = made.tolerant ? 0 : report.parts.count;
  ground.tolerant = made.tolerant;
  ground.lattice = lattice;
  TriangleMesh mended;
  mended.unit = ground.mesh.unit;
  for (const int phantom : {0, 1}) {
    for (std::size_t f = 0; f < made.source.faces.size(); ++f)
      if (made.source.phantom[f] == phantom) mended.triangles.push_back(made.source.faces[f]);
    if (phantom == 0) ground.phantom_from = mended.triangles.size();
  }
  std::vector<std::uint32_t> number(made.source.points.size(), 0);
  for (const Face& t : mended.triangles)
    for (const std::uint32_t v : t) number[v] = 1;
  for (std::size_t v = 0; v < number.size(); ++v) {
    if (number[v] == 0) continue;
    number[v] = static_cast<std::uint32_t>(mended.positions.size());
    mended.positions.push_back(lattice.to_model(made.source.points[v]));
  }
  for (Face& t : mended.triangles)
    for (std::uint32_t& v : t) v = number[v];
  ground.mesh = std::move(mended);
  report.phantom_triangles = ground.mesh.triangles.size() - ground.phantom_from;
  return *mesh;
}

/// Puts a solid made anew in the place of the repaired source.
Status remesh_source(TriangleMesh& mended, double share, ConvertReport& report, const Progress& progress) {
  const double across = diagonal_of(bounds(mended));
  RELIEF_TRY(Remeshed made, remesh(mended, share * across, progress));
  report.remesh = {.voxel = made.voxel / across, .sheets = made.sheets, .crumbs = made.crumbs};
  report.repair.parts = made.parts;
  report.repair.boundary_loops = made.rims;
  mended = std::move(made.mesh);
  return {};
}

/// Of some fibres through a shell the share that meets nothing of what it stands on.
double missed_share(const SlabMesh& mesh, const Ground& ground, const Progress& progress) {
  constexpr std::size_t kWithout = 950'000;  // of the million that are looked at in the end
  const SourceSurface surface(ground.mesh.positions, ground.mesh.triangles, ground.lattice);
  const HitCount hits = count_hits(mesh, {surface, ground.lattice, ground.phantom_from}, kWithout, progress);
  return double(hits.none) / double(std::max<std::size_t>(hits.all(), 1));
}

/// The shell in tolerant mode, else as certify(). Where no slabs that hold nearly all of the source are as few as asked
/// for, they stand on a solid of it whose voxels grow until they are, and the last may miss more of it. Where they
/// never are, those stay that hold the source, or the first solid. `repaired` gives the repaired source once more: it
/// is not kept beside what is worked on.
std::shared_ptr<const SlabMesh> tolerate(Ground& ground, TriangleMesh& as_read,
                                         const std::function<Result<TriangleMesh>()>& repaired,
                                         const ConvertSettings& settings, double diagonal, ConvertReport& report,
                                         const Progress& progress) {
  struct Solid {
    double voxel;  // of the diagonal
    double lost;   // share of it that may be outside the slabs
  };
  constexpr double kFew = 0.03, kMany = 0.25;
  constexpr std::array<Solid, 6> kSolids = {
      {{1.0 / 150, kFew}, {0.01, kFew}, {0.02, kFew}, {0.04, kFew}, {0.08, kFew}, {0.08, kMany}}};
  constexpr std::size_t kAlways = 20'000;  // triangles that a solid may have, however few the source has
  struct Tolerant {
    Ground ground;
    ConvertReport report;
    std::shared_ptr<const SlabMesh> mesh = nullptr;
  };
  const auto asked = static_cast<std::size_t>(settings.slabs);
  const std::size_t most = std::max(kAlways, ground.mesh.triangles.size());
  const ConvertReport at_first = report;
  const auto is_few = [&](const Tolerant& made) { return made.mesh != nullptr && made.mesh->slab_count() <= asked; };
  // The source, or a solid of it, with its slabs, of which the parts that are too many are left out.
  const auto make = [&](TriangleMesh&& mesh, const Solid& solid) -> std::optional<Tolerant> {
    Tolerant made = {{std::move(mesh), 0, ground.lattice}, at_first};
    if (solid.voxel > 0) {
      const double voxel = solid.voxel * diagonal;
      if (2 * area_of(made.ground.mesh) > double(most) * voxel * voxel) return std::nullopt;  // two in each square
      if (!remesh_source(made.ground.mesh, solid.voxel, made.report, progress)) return std::nullopt;
    }
    made.report.dropped_parts = drop_small_parts(made.ground.mesh.positions, made.ground.mesh.triangles, asked);
    made.ground.phantom_from = made.ground.mesh.triangles.size();
    made.mesh = certify(made.ground, as_read, settings, diagonal, solid.lost, made.report, progress);
    return made;
  };
  // Where too many fibres miss what it stands on, it is made without any loss.
  const auto attempt = [&](TriangleMesh&& mesh, const Solid& solid) {
    std::optional<Tolerant> made = make(std::move(mesh), solid);
    if (!made || !is_few(*made) || !made->ground.tolerant ||
        missed_share(*made->mesh, made->ground, progress) <= solid.lost)
      return made;
    made.reset();
    auto again = repaired();
    return again ? make(std::move(*again), {solid.voxel, 0}) : std::nullopt;
  };
  std::optional<Tolerant> best = attempt(std::move(ground.mesh), {0, kFew});
  if (!best) return nullptr;  // cancelled
  const std::string why = best->mesh != nullptr ? "no fewer than " + std::to_string(best->mesh->slab_count()) +
                                                      " slabs were found that hold the source"
                                                : best->report.not_certified;
  for (const Solid& solid : kSolids) {
    if (is_few(*best) || progress.cancelled()) break;
    if (at_first.remesh && solid.voxel <= at_first.remesh->voxel) continue;
    malloc_trim(0);  // what was tried before takes no memory any more
    auto source = repaired();
    if (!source) continue;
    std::optional<Tolerant> made = attempt(std::move(*source), solid);
    if (!made || made->mesh == nullptr || (!is_few(*made) && best->mesh != nullptr)) continue;
    made->report.notes.push_back(why + "; these stand on a solid of it with voxels of " +
                                 number(made->report.remesh->voxel) + " of the diagonal");
    best = std::move(made);
  }
  if (best->mesh != nullptr && !is_few(*best) && best->ground.least_slabs <= asked)
    best->report.notes.push_back("no fewer than " + std::to_string(best->mesh->slab_count()) +
                                 " slabs were found with fibres of at most " + number(settings.thickness) +
                                 " of the diagonal: a greater --thickness may allow fewer");
  ground = std::move(best->ground);
  report = std::move(best->report);
  return best->mesh;
}

/// How fine the colour layer is: as the source's colours ask for, and as a given n; bounded for very many slabs.
int colour_grid(const ConvertSettings& settings, const SlabMesh& mesh, const SourceSurface& surface,
                const Lattice& lattice, const TriangleMesh& source) {
  constexpr std::size_t kMost = 20'000'000;  // samples
  if (settings.colour_intervals > 0) return settings.colour_intervals;
  const auto given = static_cast<int>(std::bit_ceil(static_cast<unsigned>(settings.intervals)));
  int m = std::max(given, colour_intervals(mesh, surface, lattice, source));
  while (m > 1 && sample_count(m) * mesh.slab_count() > kMost) m /= 2;
  return m;
}

/// Memory for samples on these grids: `most` bytes of ordinary memory for them and for the slabs. None where it is
/// known that it would not hold them.
SampleMemory memory_for(const std::vector<int>& intervals, bool kept, std::optional<std::size_t> most) {
  constexpr std::size_t kSlab = 128;  // of what a slab takes beside its samples
  std::size_t all = 0, limit = most.value_or(PagedMemory::kNoLimit);
  limit -= std::min(limit, kSlab * intervals.size());
  for (const int n : intervals) all += Tile::padded(n) * sizeof(float) + Tile::kBeside;
  if (kept && all > limit) limit = 0;
  return {most ? std::make_shared<PagedMemory>(limit) : nullptr, std::make_shared<PagedMemory>(limit)};
}

/// The displacement of every slab, and where the openings are, on grids that `choose` makes of these; none keeps them.
/// `marks_misses`: what meets nothing is marked like what meets the source several times.
Result<SnapshotPtr> sample_grids(CagePtr mesh, const SampleSource& source, std::vector<int> intervals,
                                 const std::function<int(const SlabSamples&)>& choose, bool marks_misses,
                                 std::optional<std::size_t> most, HitCount& hits, const Progress& progress) {
  RELIEF_TRY(SlabMesh finest, mesh->with_intervals(intervals));
  mesh.reset();
  const SampleMemory memory = memory_for(intervals, !choose, most);
  SampledAlpha sampled = sample_alpha(finest, source, choose, memory, progress);
  if (progress.cancelled()) return cancelled();
  hits = sampled.hits;
  intervals = std::move(sampled.intervals);
  RELIEF_TRY(SlabMesh chosen, std::move(finest).with_intervals(intervals));
  mesh = std::make_shared<const SlabMesh>(std::move(chosen));
  if (!settle_alpha(*mesh, source, sampled.slabs, memory, progress)) return cancelled();

  SnapshotDraft draft(Snapshot::make(mesh, [&](SlabId s) {
    const std::shared_ptr<Tile> tile = std::move(sampled.slabs[s].tile);
    constrain(*mesh, Layer::Displacement, s, *tile);
    return tile;
  }));
  const auto add_marks = [&](Layer layer, SlabId s, auto&& marked) {
    auto tile = Tile::make(layer, intervals[s], 0.0F, memory.tiles);
    for (std::size_t k = 0; k < tile->size(); ++k) tile->plane()[k] = marked(k) ? 1.0F : 0.0F;
    constrain(*mesh, layer, s, *tile);
    tile->rest();
    draft.put(layer, s, std::move(tile));
  };
  const auto any = [&](auto&& has) { return std::any_of(sampled.slabs.begin(), sampled.slabs.end(), has); };
  if (any([](const SlabAlpha& slab) { return !slab.is_void.empty(); }))
    draft.add_layer(Layer::Void, kOwnIntervals, 0.0F);
  const auto is_folded = [&](Met met) { return met == Met::Often || (marks_misses && met != Met::Once); };
  const bool folded = sampled.hits.several > 0 || (marks_misses && sampled.hits.none > 0);
  if (folded) draft.add_layer(Layer::Folded, kOwnIntervals, 0.0F);
  for (SlabId s = 0; s < mesh->slab_count(); ++s) {
    const SlabAlpha& slab = sampled.slabs[s];
    if (!slab.is_void.empty()) add_marks(Layer::Void, s, [&](std::size_t k) { return slab.is_void[k] != 0; });
    if (folded && !slab.met.empty()) add_marks(Layer::Folded, s, [&](std::size_t k) { return is_folded(slab.met[k]); });
    memory.scratch->rest(slab.met.size() + slab.is_void.size());
  }
  return draft.finish();
}

/// Beyond the error that was asked for, rounding.
constexpr double kAsGood = 1 + 1e-6;

/// Doubles n where the surface does not keep to the error: in the slab, or in the one that sets the samples of the edge
/// where it is farthest off. False where nothing is left to double.
bool refine(const SlabMesh& mesh, std::span<const Farthest> there, std::span<const Farthest> back, double error,
            std::vector<int>& intervals) {
  std::vector<std::uint8_t> finer(intervals.size(), 0);
  for (SlabId s = 0; s < mesh.slab_count(); ++s)
    for (const Farthest& f : {there[s], back[s]}) {
      if (f.distance <= error * kAsGood) continue;
      const int n = mesh.intervals(s);
      const std::array<double, 3> weights = {1 - double(f.u) - double(f.v), double(f.u), double(f.v)};
      SlabId to_blame = s;
      for (std::size_t k = 0; k < weights.size(); ++k) {
        const SlabId other = mesh.slabs()[s].neighbours[k];
        if (other != kNoSlab && mesh.intervals(other) < n && weights[k] * mesh.intervals(other) < 1) to_blame = other;
      }
      finer[to_blame] = 1;
    }
  bool changed = false;
  for (SlabId s = 0; s < mesh.slab_count(); ++s)
    if (finer[s] != 0 && 2 * mesh.intervals(s) <= kMaxIntervals) {
      intervals[s] = 2 * mesh.intervals(s);
      changed = true;
    }
  return changed;
}

/// The triangles of a mended source that are not phantom.
std::span<const Face> scanned(const Ground& ground) {
  return std::span(ground.mesh.triangles).first(ground.phantom_from);
}

/// What was sampled, with the n that a given error asks for: each slab is sampled about as finely as its part of the
/// source, then its n is taken down as far as the error allows; where the surface does not keep to an error that was
/// asked for, n is doubled until it does. A given n is kept.
Result<SnapshotPtr> sample_surface(CagePtr cage, const SampleSource& source, const Ground& ground,
                                   const ConvertSettings& settings, double diagonal, ConvertReport& report,
                                   const Progress& progress) {
  std::vector<int> intervals(cage->slab_count(), settings.intervals);
  const double error = settings.error.value_or(kUsualError) * diagonal / source.lattice.step;
  std::function<int(const SlabSamples&)> choose;
  if (settings.intervals == 0) {
    intervals = finest_intervals(*cage, source);
    choose = [error](const SlabSamples& samples) { return coarsest_intervals(samples, error); };
  }
  HitCount hits;
  RELIEF_TRY(SnapshotPtr model, sample_grids(std::move(cage), source, intervals, choose, ground.tolerant,
                                             settings.sample_memory, hits, progress));
  while (settings.error && settings.intervals == 0) {
    const MeasuredSurface made(*model, source.lattice, progress);
    const Measured there = made.to(source.surface, MeasuredSurface::Samples::OnIt, progress);
    const Measured back = made.from(ground.mesh.positions, scanned(ground), progress);
    if (progress.cancelled()) return cancelled();
    cage = model->shared_slab_mesh();
    for (SlabId s = 0; s < cage->slab_count(); ++s) intervals[s] = cage->intervals(s);
    if (!refine(*cage, there.slabs, back.slabs, error, intervals)) break;
    model.reset();
    RELIEF_TRY(model, sample_grids(std::move(cage), source, intervals, {}, ground.tolerant, settings.sample_memory,
                                   hits, progress));
  }
  const HitCount more = count_hits(model->slab_mesh(), source, hits.all(), progress);
  if (progress.cancelled()) return cancelled();
  report.fibres_cast = hits.all() + more.all();
  report.hits_single = hits.single + more.single;
  report.hits_none = hits.none + more.none;
  report.hits_several = hits.several + more.several;
  return model;
}

Result<SnapshotPtr> add_colours(const SnapshotPtr& model, const SourceSurface& surface, const Lattice& lattice,
                                const TriangleMesh& source, const ConvertSettings& settings, const Progress& progress) {
  const SlabMesh& mesh = model->slab_mesh();
  const int m = colour_grid(settings, mesh, surface, lattice, source);
  const SampleNumbers numbers(mesh, m);
  SnapshotDraft draft(model);
  draft.add_layer(Layer::Colour, m, 1.0F);
  const std::shared_ptr<PagedMemory> memory = model->tile(Layer::Displacement, 0).memory();
  std::vector<ColourTile> tiles;
  tiles.reserve(mesh.slab_count());
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    const auto tile = Tile::make(Layer::Colour, m, 1.0F, memory);
    tiles.push_back({tile.get(), tile->plane16(0)});
    draft.put(Layer::Colour, s, tile);
    tile->rest();
  }
  if (!sample_colour(*model, numbers, surface, lattice, source, tiles, progress)) return cancelled();
  return draft.finish();
}

void report_coarse(std::span<const Farthest> there, std::span<const Farthest> back, const ConvertSettings& settings,
                   double of_diagonal, ConvertReport& report) {
  report.error = settings.error.value_or(kUsualError);
  for (std::size_t s = 0; s < there.size(); ++s) {
    const double most = std::max(there[s].distance, back[s].distance) * of_diagonal;
    if (most <= report.error * kAsGood) continue;
    ++report.slabs_too_coarse;
    report.too_coarse_most = std::max(report.too_coarse_most, most);
  }
}

void report_thickness(const SlabMesh& mesh, double diagonal, ConvertReport& report) {
  std::vector<double> lengths;
  for (const Fibre& fibre : mesh.fibres()) lengths.push_back(length(fibre.direction()) / diagonal);
  std::sort(lengths.begin(), lengths.end());
  report.thickness_min = lengths.front();
  report.thickness_median = lengths[lengths.size() / 2];
}

/// Where coordinates are coarser than the shape they describe, triangles collapse, and some of the others coincide.
/// Where triangles coincide and few have collapsed, the file has the surface twice.
void note_collapsed(std::size_t triangles, ConvertReport& report) {
  constexpr double kMany = 0.2;
  const std::size_t flat = report.repair.degenerate_triangles, twice = report.repair.duplicate_triangles;
  if (double(flat + twice) <= kMany * double(triangles)) return;
  const std::string of_all = " of " + std::to_string(triangles) + " triangles ";
  if (twice > flat)
    report.notes.push_back(std::to_string(twice) + of_all +
                           "have the same corners as another and were left out: the file has these faces more than "
                           "once");
  else
    report.notes.push_back(std::to_string(flat + twice) + of_all +
                           "have no area or coincide: the file's coordinates may be too coarse for the shape, as far "
                           "from the origin");
}

/// Refuses a source so far from the origin that its triangles are no larger than what doubles tell apart there: rays
/// and exact tests would find each of them to meet all those around it.
Status check_resolution(const TriangleMesh& mesh, const Box3d& box, double room, const Lattice& lattice) {
  constexpr double kLeast = 4;  // lattice steps
  double farthest = 0;
  for (std::size_t k = 0; k < 3; ++k) farthest = std::max({farthest, std::abs(box.low[k]), std::abs(box.high[k])});
  if ((farthest + room) * 0x1p-51 < lattice.step) return {};  // it is the lattice that sets the step
  const double across = std::sqrt(2 * area_of(mesh) / double(mesh.triangles.size()));
  if (across >= kLeast * lattice.step) return {};
  return fail(Errc::Corrupt, "the source lies " + number(farthest) +
                                 " from the origin, where the lattice has steps of " + number(lattice.step) +
                                 ", and its triangles are " + number(across) +
                                 " across on average, too small for that; move it nearer to the origin.");
}

Result<Conversion> convert_checked(TriangleMesh&& source, const ConvertSettings& settings, const Progress& progress) {
  Conversion result;
  ConvertReport& report = result.report;
  PhaseClock clock(report.phases);

  RELIEF_TRY(auto repaired, repair(source, progress));
  report.repair = repaired.report;
  note_collapsed(source.triangles.size(), report);
  clock.phase_done("repair");
  if (settings.remesh) {
    RELIEF_CHECK(remesh_source(repaired.mesh, *settings.remesh, report, progress));
    if (progress.cancelled()) return cancelled();
    clock.phase_done("remesh");
  }
  report.source_triangles = repaired.mesh.triangles.size();
  report.parts.count = report.repair.parts;

  const Box3d box = bounds(repaired.mesh);
  const double diagonal = diagonal_of(box);
  if (!std::isfinite(diagonal) || diagonal < 1e-36 || diagonal > 1e36)
    return fail(Errc::Corrupt,
                "the source is " + number(diagonal) + " across; coordinates of this size cannot be computed with.");
  Ground ground{std::move(repaired.mesh), report.source_triangles, Lattice::around(box, settings.thickness * diagonal)};
  RELIEF_CHECK(check_resolution(ground.mesh, box, settings.thickness * diagonal, ground.lattice));
  const auto target = static_cast<std::size_t>(settings.slabs);
  std::shared_ptr<const SlabMesh> mesh;
  Mode mode = Mode::Preview;
  if (settings.mode != Mode::Preview) {
    const auto repaired_again = [&]() -> Result<TriangleMesh> {
      RELIEF_TRY(auto again, repair(source, progress));
      if (ConvertReport ignored; settings.remesh)
        RELIEF_CHECK(remesh_source(again.mesh, *settings.remesh, ignored, progress));
      return std::move(again.mesh);
    };
    mesh = settings.mode == Mode::Tolerant
               ? tolerate(ground, source, repaired_again, settings, diagonal, report, progress)
               : certify(ground, source, settings, diagonal, 0, report, progress);
    clock.phase_done("certify");
    if (progress.cancelled()) return cancelled();
    if (mesh != nullptr) mode = ground.tolerant ? Mode::Tolerant : Mode::Certified;
    if (mesh == nullptr && settings.mode)
      return fail(Errc::Unfoldable, "no " + std::string(name(*settings.mode)) + " shell: " + report.not_certified +
                                        "; " + remedy(*settings.mode, settings.remesh.has_value()) + ".");
    if (mesh == nullptr && !settings.remesh)
      report.not_certified +=
          "; --remesh makes the source a solid first, which as a rule can be certified, and --mode tolerant does so "
          "where it must";
  }
  const Lattice& lattice = ground.lattice;
  std::optional<SourceSurface> surface(std::in_place, ground.mesh.positions, ground.mesh.triangles, lattice);
  clock.phase_done("hierarchy");

  if (mesh == nullptr) {
    std::vector<Vec3d> points;
    points.reserve(ground.mesh.positions.size());
    for (const Vec3d p : ground.mesh.positions) points.push_back(lattice.to_lattice(p));
    std::vector<Face> faces = ground.mesh.triangles;
    report.dropped_parts = drop_small_parts(points, faces, 16 * target);
    const CageSettings cage_settings = {target, settings.thickness * diagonal / lattice.step};
    RELIEF_TRY(const Cage cage, build_cage(points, faces, *surface, lattice, cage_settings, progress, clock));
    mesh = cage.mesh;
    report.dropped_slabs = cage.dropped;
  }
  report.slabs = mesh->slab_count();
  report.slabs_asked = static_cast<std::size_t>(settings.slabs);
  if (const std::size_t most = ground.mesh.triangles.size();
      report.slabs < report.slabs_asked && most < report.slabs_asked)
    report.notes.push_back("--slabs " + std::to_string(report.slabs_asked) + " is more than the " +
                           std::to_string(most) +
                           " triangles of the mended source, and slabs are no smaller than these: there are " +
                           std::to_string(report.slabs));
  report_thickness(*mesh, diagonal, report);

  const bool short_of_memory = is_short_of_memory(settings, source, ground.mesh);
  LaidAside as_read_aside, mended_aside;
  if (short_of_memory) lay_aside(source, as_read_aside);
  progress("sample", 0);
  const SampleSource sampled = {*surface, lattice, ground.phantom_from};
  RELIEF_TRY(result.model.head, sample_surface(std::move(mesh), sampled, ground, settings, diagonal, report, progress));
  clock.phase_done("sample");

  progress("measure", 0);
  const auto relative = [&](const Measured& m) {
    const Distance& d = m.distance;
    return Distance{d.rms * lattice.step / diagonal, d.max * lattice.step / diagonal, d.points};
  };
  const MeasuredSurface made(*result.model.head, lattice, progress);
  // A fibre that meets nothing has its sample from its neighbours.
  const auto samples = report.hits_none > 0 ? MeasuredSurface::Samples::Anywhere : MeasuredSurface::Samples::OnIt;
  {
    const Measured there = made.to(*surface, samples, progress);
    surface.reset();
    const Measured back = made.from(ground.mesh.positions, scanned(ground), progress);
    if (progress.cancelled()) return cancelled();
    report.to_mended = relative(there);
    report.from_mended = relative(back);
    if (settings.intervals == 0) report_coarse(there.slabs, back.slabs, settings, lattice.step / diagonal, report);
    if (settings.error && report.slabs_too_coarse > 0)
      report.notes.push_back("--error " + number(report.error) + " is not kept in " +
                             counted(report.slabs_too_coarse, "slab") + ", which n up to " +
                             std::to_string(kMaxIntervals) + " brings no nearer than " +
                             number(report.too_coarse_most) + "; more --slabs may");
  }
  as_read_aside.give_back();
  if (short_of_memory) lay_aside(ground.mesh, mended_aside);
  report.from_source = relative(made.from(source.positions, source.triangles, progress));
  {
    const SourceSurface as_read(source.positions, source.triangles, lattice);
    report.to_source = relative(made.to(as_read, samples, progress));
    clock.phase_done("measure");
    if (progress.cancelled()) return cancelled();

    if (source.has_colour()) {
      progress("colour", 0);
      RELIEF_TRY(result.model.head, add_colours(result.model.head, as_read, lattice, source, settings, progress));
      clock.phase_done("colour");
    }
  }
  source = {};

  result.model.info = {.mode = mode, .unit = settings.unit, .source = {}, .source_diagonal = diagonal};
  progress("measure", 1);
  mended_aside.give_back();
  result.mended = std::move(ground.mesh);
  result.mended.phantom_from = ground.phantom_from;
  return result;
}

}  // namespace

std::string remedy(Mode mode, bool is_remeshed) {
  if (mode == Mode::Preview) return "try more --slabs or a smaller --thickness";
  if (mode == Mode::Tolerant) return "convert with --mode preview";
  const std::string otherwise = "convert with --mode tolerant";
  return is_remeshed ? otherwise : "remesh the source as a solid (--remesh), or " + otherwise;
}

Result<Conversion> convert(TriangleMesh source, const ConvertSettings& settings, const Progress& progress) {
  RELIEF_CHECK(check(settings));
  const std::size_t triangles = source.triangles.size();
  try {
    return convert_checked(std::move(source), settings, progress);
  } catch (const std::bad_alloc&) {
    return fail(Errc::InvalidArgument, "there is not enough memory for " + std::to_string(triangles) +
                                           " triangles and " + std::to_string(settings.slabs) + " slabs.");
  }
}

TriangleMesh to_mesh(const Snapshot& model, int level) {
  Tessellation surface = tessellate(model, level);
  TriangleMesh mesh;
  mesh.positions = std::move(surface.positions);
  mesh.triangles = std::move(surface.triangles);
  const auto byte = [](float v) {
    return static_cast<std::uint8_t>(std::lround(std::clamp(double(v), 0.0, 1.0) * 255));
  };
  mesh.colours.reserve(surface.colours.size());
  for (const Vec3f c : surface.colours) mesh.colours.push_back({byte(c.x), byte(c.y), byte(c.z), 255});
  return mesh;
}

std::string to_slabs_text(const SlabMesh& mesh) {
  std::array<char, 320> line{};
  std::snprintf(line.data(), line.size(), "relief-slabs 1\nfibres %zu\n", mesh.fibres().size());
  std::string text = line.data();
  for (const auto& [in, out] : mesh.fibres()) {
    std::snprintf(line.data(), line.size(), "%.17g %.17g %.17g %.17g %.17g %.17g\n", in.x, in.y, in.z, out.x, out.y,
                  out.z);
    text += line.data();
  }
  std::snprintf(line.data(), line.size(), "slabs %zu\n", mesh.slabs().size());
  text += line.data();
  const auto neighbour = [](SlabId s) { return s == kNoSlab ? std::int64_t{-1} : std::int64_t{s}; };
  for (const Slab& s : mesh.slabs()) {
    std::snprintf(line.data(), line.size(), "%u %u %u %lld %lld %lld %d\n", s.fibres[0], s.fibres[1], s.fibres[2],
                  static_cast<long long>(neighbour(s.neighbours[0])),
                  static_cast<long long>(neighbour(s.neighbours[1])),
                  static_cast<long long>(neighbour(s.neighbours[2])), s.intervals);
    text += line.data();
  }
  return text;
}

std::string to_string(const ConvertReport& report) {
  std::array<char, 600> line{};
  std::string text = to_string(report.repair);
  if (!text.empty() && text.back() != '\n') text += '\n';
  if (report.remesh) {
    const ConvertReport::Remesh& r = *report.remesh;
    std::snprintf(line.data(), line.size(), "remeshed with voxels of %.2e of the diagonal\n", r.voxel);
    text += line.data();
    if (r.sheets > 0) text += std::to_string(r.sheets) + " parts that close nothing off became sheets of two voxels\n";
    if (r.crumbs > 0) text += std::to_string(r.crumbs) + " parts of a few voxels were left out\n";
  }
  std::snprintf(line.data(), line.size(),
                "%zu triangles became %zu slabs\n"
                "%zu fibres: %zu meet the source once, %zu never, %zu several times\n"
                "distance, of the diagonal (rms, greatest): to the mended source %.2e, %.2e; back %.2e, %.2e\n"
                "  to the source as read %.2e, %.2e; back %.2e, %.2e\n"
                "thickness, of the diagonal: least %.2e, median %.2e\n",
                report.source_triangles, report.slabs, report.fibres_cast, report.hits_single, report.hits_none,
                report.hits_several, report.to_mended.rms, report.to_mended.max, report.from_mended.rms,
                report.from_mended.max, report.to_source.rms, report.to_source.max, report.from_source.rms,
                report.from_source.max, report.thickness_min, report.thickness_median);
  text += line.data();
  if (report.slabs_too_coarse > 0) {
    std::snprintf(line.data(), line.size(), "%zu slabs lie farther than %.2g from the mended source, %.2e at most\n",
                  report.slabs_too_coarse, report.error, report.too_coarse_most);
    text += line.data();
  }
  if (report.slabs > report.slabs_asked)
    text += std::to_string(report.slabs_asked) +
            " slabs were asked for: no way was found to keep the mode with fewer than " + std::to_string(report.slabs) +
            "\n";
  for (const std::string& note : report.notes) text += note + "\n";
  if (!report.not_certified.empty()) text += "not certified: " + report.not_certified + "\n";
  if (report.parts.count > 1)
    for (const ConvertReport::Parts::Obstacle& part : report.parts.obstacles)
      text += "  part " + std::to_string(part.part) + " of " + std::to_string(report.parts.count) + ", " +
              std::to_string(part.triangles) + " triangles: " + part.reason + ", first near " + place(part.near) + "\n";
  if (report.moved_vertices > 0) {
    std::snprintf(line.data(), line.size(), "%zu source vertices moved by at most %.2e of the diagonal\n",
                  report.moved_vertices, report.moved_most);
    text += line.data();
  }
  if (report.closed_openings > 0)
    text += counted(report.closed_openings, "opening") + " closed with phantom triangles; samples on them are void\n";
  if (report.parted_vertices > 0)
    text += std::to_string(report.parted_vertices) + (report.parted_vertices == 1 ? " vertex was" : " vertices were") +
            " moved off others that lay there, or nearer than the lattice can tell apart\n";
  if (report.replaced_triangles > 0) {
    std::snprintf(line.data(), line.size(),
                  "%zu triangles cut out and closed with patches, where the source met itself, folded or was seen from "
                  "no side, and around there; the widest hole was %.2e of the diagonal wide, near %s\n",
                  report.replaced_triangles, report.replaced_widest, place(report.replaced_near).c_str());
    text += line.data();
  }
  if (report.vanished_parts > 0) text += counted(report.vanished_parts, "part") + " went with what was cut out\n";
  if (report.dropped_parts > 0)
    text += "without " + counted(report.dropped_parts, "part") + ", the smallest: more slabs would hold them\n";
  if (report.dropped_slabs > 0)
    text += "without " + counted(report.dropped_slabs, "slab") + " that had no room beside others\n";
  double seconds = 0;
  for (const ConvertReport::Phase& phase : report.phases) seconds += phase.seconds;
  std::snprintf(line.data(), line.size(), "%.2f s of CPU:", seconds);
  text += line.data();
  for (const ConvertReport::Phase& phase : report.phases) {
    std::snprintf(line.data(), line.size(), " %s %.2f", phase.name.c_str(), phase.seconds);
    text += line.data();
  }
  return text + "\n";
}

}  // namespace relief
