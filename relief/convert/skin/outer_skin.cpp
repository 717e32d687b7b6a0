#include <relief/base/disjoint_sets.h>
#include <relief/convert/geometry/components.h>
#include <relief/convert/skin/face_arrangement.h>
#include <relief/convert/skin/face_meetings.h>
#include <relief/convert/skin/outer_skin.h>
#include <relief/convert/skin/piece_winding.h>
#include <relief/convert/skin/skin_repair.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <span>
#include <utility>

namespace relief::detail {
namespace {

// Shares of the diagonal. Thinner pieces are still 30 lattice steps high, so rounding turns their normals by at most a
// degree. They go only where no point moves farther than 10 % of the default error.
constexpr double kThin = 3e-6, kFarthest = 1e-5;

/// The pieces that have the solid on one side only.
class Boundary {
 public:
  Boundary(const FaceArrangement& arrangement, const PieceWinding& winding)
      : all_(arrangement), winding_(winding), solid_side_(arrangement.pieces.size(), kOutside) {
    for (std::uint32_t p = 0; p < all_.pieces.size(); ++p) {
      const bool front = winding.is_in_solid(all_.pieces[p], p, 0), back = winding.is_in_solid(all_.pieces[p], p, 1);
      if (front == back) continue;
      solid_side_[p] = front ? 0 : 1;
      kept_.push_back(p);
    }
  }

  [[nodiscard]] const std::vector<std::uint32_t>& kept() const noexcept { return kept_; }
  [[nodiscard]] bool keeps(std::uint32_t p) const noexcept { return solid_side_[p] != kOutside; }
  /// Returns whether the solid lies in front of it: it is to look the other way.
  [[nodiscard]] bool is_turned(std::uint32_t p) const noexcept { return solid_side_[p] == 0; }
  /// Returns the half-edge of the piece that bounds the same part of the solid at a half-edge; kNone at a rim.
  [[nodiscard]] std::uint32_t partner(std::uint32_t h) const noexcept {
    std::uint32_t side = winding_.across[2 * h + solid_side_[h / 3]];
    while (!keeps(side / 6)) side = winding_.across[side ^ 1U];
    return side / 2 == h ? kNone : side / 2;
  }

 private:
  static constexpr std::uint8_t kOutside = 2;
  const FaceArrangement& all_;
  const PieceWinding& winding_;
  std::vector<std::uint8_t> solid_side_;  // per piece
  std::vector<std::uint32_t> kept_;
};

/// Half-edge 3 f + k of a face of the skin, in its sense, for the half-edge of its piece.
std::uint32_t half_edge_of_skin(std::uint32_t f, std::uint32_t h, bool is_turned) noexcept {
  return 3 * f + (is_turned ? 2 - h % 3 : h % 3);
}

/// The skin while it is made. Its points are the fans of its pieces.
struct Joined {
  SkinDraft draft;
  std::vector<std::uint32_t> twins;  // per half-edge
  std::uint32_t open = kNone;        // a half-edge of the arrangement at a rim
};

Joined join_pieces(const FaceArrangement& arrangement, const Boundary& boundary, std::span<const Face> faces) {
  Joined joined;
  const std::vector<std::uint32_t>& kept = boundary.kept();
  std::vector<std::uint32_t> number(arrangement.pieces.size(), kNone);
  for (std::uint32_t k = 0; k < kept.size(); ++k) number[kept[k]] = k;
  // Corners of kept pieces, joined across their edges.
  DisjointSets sets(3 * kept.size());
  const auto corner_at = [&](std::uint32_t h, std::uint32_t v) {
    const Face& t = arrangement.pieces[h / 3].corners;
    return 3 * number[h / 3] + (t[0] == v ? 0U : t[1] == v ? 1U : 2U);
  };
  joined.twins.assign(3 * kept.size(), kNone);
  for (const std::uint32_t p : kept)
    for (std::uint32_t h = 3 * p; h < 3 * p + 3; ++h) {
      const std::uint32_t other = boundary.partner(h);
      if (other == kNone) {
        joined.open = h;
        continue;
      }
      joined.twins[half_edge_of_skin(number[p], h, boundary.is_turned(p))] =
          half_edge_of_skin(number[other / 3], other, boundary.is_turned(other / 3));
      for (const std::uint32_t v : {arrangement.pieces[p].corners[h % 3], arrangement.pieces[p].corners[(h + 1) % 3]})
        sets.join(corner_at(h, v), corner_at(other, v));
    }
  SkinDraft& draft = joined.draft;
  std::vector<std::uint32_t> point(3 * kept.size(), kNone), pieces(faces.size(), 0);
  for (const Piece& piece : arrangement.pieces) ++pieces[piece.from];
  for (std::uint32_t k = 0; k < kept.size(); ++k) {
    const Piece& piece = arrangement.pieces[kept[k]];
    Face t{};
    for (std::uint32_t i = 0; i < 3; ++i) {
      std::uint32_t& v = point[sets.least(3 * k + i)];
      if (v == kNone) {
        v = static_cast<std::uint32_t>(draft.points.size());
        draft.points.push_back(arrangement.nearest(piece.corners[i]));
        draft.exact.push_back(arrangement.approximate(piece.corners[i]));
        draft.made.push_back(!arrangement.is_given(piece.corners[i]));
      }
      t[i] = v;
    }
    const Face& from = faces[piece.from];
    const LatticePoint a = arrangement.given[from[0]];
    Vec3d normal =
        normalized(cross(to_double(arrangement.given[from[1]] - a), to_double(arrangement.given[from[2]] - a)));
    if (boundary.is_turned(kept[k])) {
      // (a, b, c) becomes (a, c, b): half-edge k of the one is 2 - k of the other.
      std::swap(t[1], t[2]);
      normal = -normal;
    }
    draft.faces.push_back(t);
    draft.from.push_back(piece.from);
    draft.normals.push_back(normal);
    draft.piece.push_back(pieces[piece.from] > 1);
  }
  return joined;
}

/// Half-edges that run between the same points as others, as where two fans touch along an edge and have both its ends
/// in common: at most one to a face.
std::vector<std::uint32_t> find_doubled(const SkinDraft& draft, const std::vector<std::uint32_t>& twins) {
  struct Key {
    std::uint32_t from, to, half_edge;
    auto operator<=>(const Key&) const = default;
  };
  std::vector<Key> keys;
  for (std::uint32_t h = 0; h < twins.size(); ++h)
    keys.push_back({draft.faces[h / 3][h % 3], draft.faces[h / 3][(h + 1) % 3], h});
  std::sort(keys.begin(), keys.end());
  std::vector<std::uint8_t> used(draft.faces.size(), 0);
  std::vector<std::uint32_t> doubled;
  for (std::size_t k = 1; k < keys.size(); ++k) {
    if (keys[k].from != keys[k - 1].from || keys[k].to != keys[k - 1].to) continue;
    const std::uint32_t f = keys[k].half_edge / 3, g = twins[keys[k].half_edge] / 3;
    if (f == g || used[f] != 0 || used[g] != 0) continue;
    used[f] = used[g] = 1;
    doubled.push_back(keys[k].half_edge);
  }
  return doubled;
}

/// Puts a point of its own into the middle of each edge but one between the same two points.
void split_doubled_edges(SkinDraft& draft, std::vector<std::uint32_t>& twins) {
  for (std::vector<std::uint32_t> doubled = find_doubled(draft, twins); !doubled.empty();
       doubled = find_doubled(draft, twins))
    for (const std::uint32_t h : doubled) {
      const auto middle = static_cast<std::uint32_t>(draft.points.size());
      const std::uint32_t u = draft.faces[h / 3][h % 3], v = draft.faces[h / 3][(h + 1) % 3];
      draft.exact.push_back((draft.exact[u] + draft.exact[v]) * 0.5);
      draft.points.push_back(snap(draft.exact.back()));
      draft.made.push_back(1);
      // The far halves become faces of their own.
      std::array<std::uint32_t, 2> near{}, far{};
      for (std::size_t side = 0; side < 2; ++side) {
        const std::uint32_t e = side == 0 ? h : twins[h], f = e / 3;
        const auto half = static_cast<std::uint32_t>(draft.faces.size());
        const std::uint32_t to = draft.faces[f][(e + 1) % 3], top = draft.faces[f][last_of(e) % 3];
        draft.faces.push_back({middle, to, top});
        draft.from.push_back(draft.from[f]);
        draft.normals.push_back(draft.normals[f]);
        draft.piece.push_back(1);
        draft.piece[f] = 1;
        draft.faces[f][next_of(e) % 3] = middle;
        const std::uint32_t beyond = twins[next_of(e)];
        twins.resize(3 * draft.faces.size(), kNone);
        twins[3 * half + 1] = beyond;
        twins[beyond] = 3 * half + 1;
        twins[3 * half + 2] = next_of(e);
        twins[next_of(e)] = 3 * half + 2;
        near[side] = e;
        far[side] = 3 * half;
      }
      for (std::size_t side = 0; side < 2; ++side) {
        twins[near[side]] = far[1 - side];
        twins[far[1 - side]] = near[side];
      }
    }
}

/// Faces of which some are kept, and those that are kept in part; patches are none of the source's.
void count_faces(const FaceArrangement& arrangement, const Boundary& boundary, const ClosedSource& given,
                 OuterSkin& skin) {
  struct Count {
    std::uint32_t all = 0, kept = 0;
  };
  std::vector<Count> counts(given.faces.size());
  for (std::uint32_t p = 0; p < arrangement.pieces.size(); ++p) {
    Count& count = counts[arrangement.pieces[p].from];
    ++count.all;
    count.kept += boundary.keeps(p);
  }
  for (std::size_t f = 0; f < counts.size(); ++f) {
    const Count& count = counts[f];
    if (given.patch[f] != 0) continue;
    skin.dropped += count.kept == 0;
    skin.cut += count.kept > 0 && count.all > 1;
  }
}

/// Returns the largest face of each part.
FaceArrangement one_face_each(std::span<const LatticePoint> points, std::span<const Face> faces,
                              const Components& parts) {
  FaceArrangement samples;
  samples.given = points;
  samples.pieces.resize(parts.count);
  std::vector<double> largest(parts.count, -1);
  for (std::uint32_t f = 0; f < faces.size(); ++f) {
    const Face& t = faces[f];
    const Vec3d a = to_double(points[t[0]]);
    const double area = length(cross(to_double(points[t[1]]) - a, to_double(points[t[2]]) - a));
    if (area <= largest[parts.of_face[f]]) continue;
    largest[parts.of_face[f]] = area;
    samples.pieces[parts.of_face[f]] = {t, f};
  }
  return samples;
}

/// Turns parts that are inside out: they look inwards, and no solid lies around them that they could be a cavity of, as
/// far as their largest face tells. How many; nothing when cancelled.
std::optional<std::size_t> turn_outwards(std::span<const LatticePoint> points, std::vector<Face>& faces,
                                         const FaceTree& tree, const Progress& progress) {
  const Components parts = find_components(points.size(), faces);
  std::vector<double> volumes(parts.count, 0);
  for (std::size_t f = 0; f < faces.size(); ++f)
    volumes[parts.of_face[f]] +=
        dot(to_double(points[faces[f][0]]), cross(to_double(points[faces[f][1]]), to_double(points[faces[f][2]])));
  if (std::ranges::none_of(volumes, [](double volume) { return volume < 0; })) return 0;
  const auto winding = find_winding(one_face_each(points, faces, parts), tree, progress);
  if (!winding) return std::nullopt;
  std::vector<std::uint8_t> is_turned(parts.count, 0);
  for (std::size_t part = 0; part < parts.count; ++part)
    is_turned[part] = volumes[part] < 0 && winding->in_front[part] < 0;
  for (std::size_t f = 0; f < faces.size(); ++f)
    if (is_turned[parts.of_face[f]] != 0) std::swap(faces[f][1], faces[f][2]);
  return static_cast<std::size_t>(std::ranges::count(is_turned, 1));
}

/// Counts faces that lie on each other on both sides of an edge among the pieces, so that they are repaired.
void mark_fins(SkinDraft& draft, const std::vector<std::uint32_t>& twins, double closest) {
  for (std::uint32_t h = 0; h < twins.size(); ++h) {
    const std::uint32_t u = draft.faces[h / 3][last_of(h) % 3], v = draft.faces[twins[h] / 3][last_of(twins[h]) % 3];
    if (length(to_double(draft.points[u] - draft.points[v])) <= closest) draft.piece[h / 3] = 1;
  }
}

}  // namespace

std::optional<Overlaps> find_overlaps(const ClosedSource& source, const Progress& progress) {
  Overlaps overlaps;
  const FaceTree tree(source.points, source.faces);
  const FacePairs meetings = find_meetings(tree, progress);
  if (progress.cancelled()) return std::nullopt;
  const Components parts = find_components(source.points.size(), source.faces);
  std::vector<std::uint8_t> meets(parts.count, 0);
  if (!meetings.empty()) overlaps.first = meetings.front().first;
  for (const auto& [f, g] : meetings) {
    const std::uint32_t part = parts.of_face[f], other = parts.of_face[g];
    if (source.patch[f] != 0 || source.patch[g] != 0) {
      ++overlaps.patched;
    } else if (part == other) {
      ++overlaps.within;
    } else {
      ++overlaps.between;
      meets[part] = meets[other] = 1;
    }
  }
  if (parts.count == 1) return overlaps;
  const FaceArrangement samples = one_face_each(source.points, source.faces, parts);
  const auto winding = find_winding(samples, tree, progress);
  if (!winding) return std::nullopt;
  for (std::uint32_t p = 0; p < parts.count; ++p)
    if (meets[p] == 0 && !samples.pieces.empty())
      overlaps.nested += winding->is_in_solid(samples.pieces[p], p, 0) && winding->is_in_solid(samples.pieces[p], p, 1);
  return overlaps;
}

std::optional<OuterSkin> outer_skin(const ClosedSource& given, const Progress& progress) {
  OuterSkin skin;
  std::vector<Face> faces = given.faces;
  const FaceTree tree(given.points, faces);
  const auto turned = turn_outwards(given.points, faces, tree, progress);
  if (!turned) return std::nullopt;
  skin.turned = *turned;
  const FacePairs meetings = find_meetings(tree, progress);
  if (progress.cancelled()) return std::nullopt;
  const auto arrangement = arrange(given.points, faces, meetings, progress);
  if (!arrangement) return std::nullopt;
  skin.coincident = arrangement->coincident;
  const auto winding = find_winding(*arrangement, tree, progress);
  if (!winding) return std::nullopt;
  for (const std::uint32_t p : winding->undecided) {
    const Piece& piece = arrangement->pieces[p];
    if (given.phantom[piece.from] != 0) continue;
    if (skin.undecided == 0) skin.undecided_at = arrangement->nearest(piece.corners[0]);
    skin.undecided += arrangement->area(p);
  }
  const Boundary boundary(*arrangement, *winding);
  count_faces(*arrangement, boundary, given, skin);
  if (boundary.kept().empty()) {
    skin.fault = OuterSkin::Fault::Empty;
    return skin;
  }
  Joined joined = join_pieces(*arrangement, boundary, faces);
  if (joined.open != kNone) {
    skin.fault = OuterSkin::Fault::Open;
    skin.place = arrangement->nearest(arrangement->pieces[joined.open / 3].corners[joined.open % 3]);
    return skin;
  }
  SkinDraft& draft = joined.draft;
  split_doubled_edges(draft, joined.twins);
  Box3d box;
  for (const LatticePoint p : given.points) box.add(to_double(p));
  const double diagonal = length(box.extent());
  mark_fins(draft, joined.twins, kFarthest * diagonal);
  const SkinRepairs repairs = repair_skin(draft, kThin * diagonal, kFarthest * diagonal, progress);
  if (progress.cancelled()) return std::nullopt;
  skin.repaired = repairs.repaired;
  skin.slivers = repairs.slivers;
  skin.moved_most = repairs.moved_most;
  skin.crossing = repairs.crossing;
  skin.source.points = std::move(draft.points);
  skin.source.faces = std::move(draft.faces);
  skin.from = std::move(draft.from);
  for (const std::uint32_t f : skin.from) {
    skin.source.patch.push_back(given.patch[f]);
    skin.source.phantom.push_back(given.phantom[f]);
  }
  return skin;
}

}  // namespace relief::detail
