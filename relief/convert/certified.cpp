#include <relief/base/free_memory.h>
#include <relief/convert/blunt.h>
#include <relief/convert/certified.h>
#include <relief/convert/fans.h>
#include <relief/convert/laid_aside.h>
#include <relief/convert/reducer.h>
#include <relief/convert/sort_unique.h>

#include <algorithm>
#include <memory>
#include <numeric>
#include <optional>
#include <string_view>
#include <utility>

namespace relief::detail {
namespace {

double area_of(const ClosedSource& s, std::size_t f) noexcept {
  const Vec3d a = to_double(s.points[s.faces[f][0]]);
  return 0.5 * length(cross(to_double(s.points[s.faces[f][1]]) - a, to_double(s.points[s.faces[f][2]]) - a));
}

/// A source with its thin shell.
struct Start {
  OrderedSource source;
  std::vector<Ends> ends;
  std::unique_ptr<BoxTree> tree;
};

/// Puts what was mended back into the given source, and brings all into one order where something was cut.
Start finish(Mender&& mender, ThinShell&& thin, ClosedSource& given) {
  std::vector<Ends> ends = thin.take_ends();
  std::unique_ptr<BoxTree> tree = thin.take_tree();
  const bool was_cut = mender.was_cut();
  mender.release();
  mender.put_back(given);
  OrderedSource source = std::move(mender).take_source();
  if (!was_cut) {
    source.update();
    return {std::move(source), std::move(ends), std::move(tree)};
  }
  tree.reset();
  std::vector<Ends> ends_of(given.points.size());
  std::vector<float> slack_of(given.points.size());
  for (std::size_t v = 0; v < source.points.size(); ++v) {
    ends_of[source.point_of[v]] = ends[v];
    slack_of[source.point_of[v]] = source.most_slack[v];
  }
  source = OrderedSource(given.points, given.faces);
  ends.clear();
  for (std::uint32_t v = 0; v < source.points.size(); ++v) {
    ends.push_back(ends_of[source.point_of[v]]);
    source.most_slack[v] = slack_of[source.point_of[v]];
  }
  source.update();
  tree = std::make_unique<BoxTree>(source.faces.size(), [&](std::size_t f) {
    Box3d box;
    for (const std::uint32_t v : source.faces[f])
      for (const LatticePoint p : ends[v]) box.add(to_double(p));
    return box;
  });
  return {std::move(source), std::move(ends), std::move(tree)};
}

/// "7 triangles".
std::string counted(std::size_t triangles) {
  return std::to_string(triangles) + (triangles == 1 ? " triangle" : " triangles");
}

/// "7 triangles of the source", or how many of them were only made to close openings and cuts.
std::string triangles_of(const Mender& mender, std::span<const std::uint32_t> faces) {
  const auto made = std::ranges::count_if(faces, [&](std::uint32_t f) { return !mender.is_scanned(f); });
  const std::string all = counted(faces.size());
  if (made == 0) return all + " of the source";
  if (static_cast<std::size_t>(made) == faces.size()) return all + " that close openings";
  return all + ", " + std::to_string(made) + " of which close openings,";
}

/// Which parts the bad faces belong to, and how many of them have which fault.
std::vector<PartObstacle> parts_of(Mender& mender, std::span<const std::uint32_t> bad, std::string_view fault) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> found;  // part and face
  for (const std::uint32_t f : bad) found.emplace_back(mender.part_of(f), f);
  sort_unique(found);
  std::vector<PartObstacle> parts;
  std::vector<std::uint32_t> faces;
  for (std::size_t k = 0; k < found.size();) {
    const auto [part, face] = found[k];
    faces.clear();
    for (; k < found.size() && found[k].first == part; ++k) faces.push_back(found[k].second);
    const OrderedSource& source = mender.source();
    parts.push_back(
        {part, source.points[source.faces[face][0]], triangles_of(mender, faces) + " " + std::string(fault)});
  }
  return parts;
}

/// Those of some parts, ascending, that are at most so wide.
std::vector<PartObstacle> specks_of(Mender& mender, const std::vector<PartObstacle>& parts, double widest) {
  if (parts.empty()) return {};
  const OrderedSource& source = mender.source();
  std::vector<std::uint32_t> number(std::size_t{parts.back().part} + 1, kNone);
  for (std::uint32_t k = 0; k < parts.size(); ++k) number[parts[k].part] = k;
  std::vector<Box3d> boxes(parts.size());
  for (std::uint32_t f = 0; f < source.faces.size(); ++f) {
    const std::uint32_t part = mender.part_of(f);
    if (!source.alive(f) || part >= number.size() || number[part] == kNone) continue;
    for (const LatticePoint p : source.corners(f)) boxes[number[part]].add(to_double(p));
  }
  std::vector<PartObstacle> specks;
  for (std::size_t k = 0; k < parts.size(); ++k)
    if (const Vec3d e = boxes[k].extent(); std::max({e.x, e.y, e.z}) <= widest) specks.push_back(parts[k]);
  return specks;
}

/// Why no slab can stand on some faces: a clause. Of faces that meet in a corner it knows nothing.
std::string clause_of(const Mender& mender, const ThinShell& thin) {
  const OrderedSource& source = mender.source();
  std::size_t scanned = 0, invented = 0;  // that meet others; scanned ones those that meet scanned ones
  for (const std::uint32_t f : thin.faults()) {
    Box3d box;
    for (const LatticePoint p : source.corners(f)) box.add(to_double(p));
    bool meets = false, meets_scanned = false;
    thin.tree().query(box, [&](std::uint32_t g) {
      if (!source.alive(g) || share_a_corner(source.faces[f], source.faces[g])) return true;
      if (!triangles_meet(source.corners(f), source.corners(g))) return true;
      meets = true;
      meets_scanned = meets_scanned || (mender.is_scanned(f) && mender.is_scanned(g));
      return !meets_scanned;
    });
    scanned += meets_scanned;
    invented += meets && !meets_scanned;
  }
  if (scanned > 0) return counted(scanned) + " of the source" + (scanned == 1 ? " meets" : " meet") + " others";
  if (invented > 0) return "what closes openings meets itself or the source, in " + counted(invented);
  return counted(thin.faults().size()) + (thin.faults().size() == 1 ? " of the source lies" : " of the source lie") +
         " nearer to others than the lattice can tell apart, or fold";
}

constexpr double kWanted = 0.22;  // visibility; more of it lets the shell become coarser
constexpr double kLeast = 0.02;
constexpr double kMostReplaced = 0.03;  // of the area, and of the faces where there are many

/// What was scanned of a source, and how much of it patches have replaced.
class Replaced {
 public:
  explicit Replaced(const ClosedSource& s) {
    for (std::size_t f = 0; f < s.faces.size(); ++f) {
      if (s.patch[f] != 0) continue;
      area_ += area_of(s, f);
      ++faces_;
    }
  }
  void add(const Mender::Loss& loss) {
    lost_.area += loss.area;
    lost_.faces += loss.faces;
    lost_.parts += loss.parts;
    if (loss.widest > lost_.widest) {
      lost_.widest = loss.widest;
      lost_.place = loss.place;
    }
  }
  [[nodiscard]] bool is_too_much() const noexcept { return lost_.area > kMostReplaced * area_ || lost_.faces > most(); }
  [[nodiscard]] double share_of(std::size_t faces) const noexcept { return double(faces) / weight(); }
  /// So many scanned faces are not too many.
  [[nodiscard]] std::size_t most() const noexcept { return static_cast<std::size_t>(kMostReplaced * weight()); }
  [[nodiscard]] std::size_t scanned() const noexcept { return faces_; }
  [[nodiscard]] const Mender::Loss& lost() const noexcept { return lost_; }

 private:
  [[nodiscard]] double weight() const noexcept { return double(faces_ + 2000); }  // of all faces; few count for more

  double area_ = 0;  // square lattice steps
  std::size_t faces_ = 0;
  Mender::Loss lost_;
};

/// Notes what was done to the source, and hands it over with its shell.
Start succeed(CertifiedShell& result, Mender&& mender, ThinShell&& thin, const Replaced& replaced) {
  const Mender::Moves moves = mender.moves();
  result.moved_points = moves.points;
  result.moved_most = moves.most;
  result.replaced_faces = replaced.lost().faces;
  result.replaced_widest = replaced.lost().widest;
  result.replaced_place = replaced.lost().place;
  result.vanished_parts = replaced.lost().parts;
  result.obstacle.clear();
  result.bad_parts.clear();
  return finish(std::move(mender), std::move(thin), result.source);
}

std::vector<std::uint32_t> faces_around(const Mender& mender, std::span<const std::uint32_t> points) {
  std::vector<std::uint32_t> faces;
  for (const std::uint32_t v : points) mender.rings().around(v, [&](std::uint32_t h) { faces.push_back(h / 3); });
  sort_unique(faces);
  return faces;
}

/// Those of some vertices, by their numbers in the given source, that were given with it and whose edges are all longer
/// than this.
std::vector<std::uint32_t> with_long_edges(const Mender& mender, std::span<const std::uint32_t> vertices,
                                           double least) {
  const OrderedSource& source = mender.source();
  std::vector<std::uint32_t> found;
  for (const std::uint32_t v : vertices) {
    if (source.point_of[v] == kNone) continue;
    double shortest = Box3d::kFar;
    mender.rings().around(v, [&](std::uint32_t h) {
      shortest =
          std::min(shortest, length(to_double(source.points[source.faces[h / 3][(h + 1) % 3]] - source.points[v])));
    });
    if (shortest > least) found.push_back(source.point_of[v]);
  }
  return found;
}

/// Vertices that no direction sees and whose edges are long.
struct Tips {
  enum class Fate : std::uint8_t {
    Noted,  ///< the rest of the source is mended as it would be without them
    Cut,    ///< they are cut off
    Left    ///< they were, often enough
  };
  std::vector<std::uint32_t> points;  // of the given source
  Fate fate = Fate::Noted;
};

/// What becomes of vertices that hardly a direction sees.
enum class Needles : std::uint8_t {
  None,   ///< it is not known that smoothing does not help them
  Large,  ///< those stay that cannot be made blunt
  All     ///< all stay, and everything else as well
};

/// Smooths and cuts until a thin shell stands on the source: for few faults, far from each other. Nothing when
/// cancelled or with an obstacle; the source is then as it was given. `start`: where its points lay at first. `needles`
/// becomes Large, and nothing more is done, where it is None and smoothing leaves some. `tips` become those of them
/// whose edges are too long for smoothing to help; where they are cut off, nothing more is done before that.
std::optional<Start> smooth_and_cut(CertifiedShell& result, std::span<const LatticePoint> start,
                                    const CertifiedSettings& settings, Needles& needles, Tips& tips,
                                    const Progress& progress) {
  constexpr int kSmoothings = 3;
  constexpr int kMostCuts = 40;  // most are small, around vertices that no direction sees
  constexpr std::size_t kFewFolds = 256;
  constexpr double kLong = 4, kVeryLong = 30;  // edges, of how far a point may be moved
  const ClosedSource& s = result.source;
  Replaced replaced(s);
  const auto kept = tips.fate == Tips::Fate::Noted ? Mender::Needles::All : Mender::Needles::Unmoved;
  Mender mender(s, start, settings.farthest, needles == Needles::None ? Mender::Needles::None : kept);
  const OrderedSource& source = mender.source();
  // So many faults cannot be cut out: at the first cut, before which no patch is of our own making.
  const std::size_t hopeless = replaced.most() + s.faces.size() - replaced.scanned();
  ThinShell thin(source, mender.rings(), settings.longest, ThinShell::Heights::Shrinking, {}, hopeless);
  // Vertices that are seen, if only just, stay where they are when a thin shell stands for all that.
  const auto seen = mender.look_at_all(kWanted, needles == Needles::All ? kNeedle : kLeast, progress);
  if (!seen) return std::nullopt;
  if (*seen == Mender::Seen::Poorly) {
    if (!thin.update({}, {}, progress)) return std::nullopt;
    if (thin.faults().empty() && thin.folds().empty())
      return succeed(result, std::move(mender), std::move(thin), replaced);
  }
  if (needles == Needles::All) return std::nullopt;
  for (int cut = 0; cut <= kMostCuts; ++cut) {
    progress("shell", double(cut) / kMostCuts);
    std::vector<std::uint32_t> trouble, bad;
    // Smoothing settles a few crossings; many do not yield to it.
    const int rounds = cut == 0 ? kSmoothings : 1;
    bool stood = false;  // a thin shell, before folds were smoothed
    const auto as_it_stood = [&]() -> std::optional<Start> {
      std::vector<std::uint32_t> all(source.points.size());
      std::iota(all.begin(), all.end(), 0U);
      mender.restore(std::move(all), kLeast);
      ThinShell anew(source, mender.rings(), settings.longest);
      if (!anew.update({}, {}, progress) || !anew.faults().empty()) return std::nullopt;
      return succeed(result, std::move(mender), std::move(anew), replaced);
    };
    for (int round = 0; round < rounds; ++round) {
      const auto neighbours = cut == 0 && round == 0 ? Mender::Neighbours::FollowLate : Mender::Neighbours::Follow;
      const auto singular = mender.smooth(trouble, kWanted, kLeast, neighbours, progress);
      if (!singular) return std::nullopt;
      if (!singular->empty()) {
        if (stood)
          if (std::optional<Start> start_before = as_it_stood()) return start_before;
        if (needles == Needles::None) {
          needles = Needles::Large;
          return std::nullopt;
        }
        if (cut == 0 && tips.fate != Tips::Fate::Left) {
          tips.points = with_long_edges(mender, *singular, kLong * settings.farthest);
          if (!with_long_edges(mender, *singular, kVeryLong * settings.farthest).empty()) tips.fate = Tips::Fate::Cut;
          if (tips.fate == Tips::Fate::Cut && !tips.points.empty()) return std::nullopt;
        }
        bad = faces_around(mender, *singular);
        if (result.obstacle.empty()) {
          result.place = source.points[singular->front()];
          result.obstacle = std::to_string(singular->size()) +
                            (singular->size() == 1 ? " vertex has faces" : " vertices have faces") +
                            " that no direction sees, or only by a degree, and smoothing does not help";
        }
        if (cut == 0)
          result.bad_parts = parts_of(mender, bad, "lie around vertices whose faces no direction sees, or hardly one");
        break;
      }
      const Mender::Changes changes = mender.take_changes();
      if (!thin.update(changes.points, changes.gone, progress)) return std::nullopt;
      bad = thin.faults();
      // Folds are smoothed, or cut out with the faults: cuts for their sake alone make new ones.
      const bool last = round + 1 == rounds;
      if ((!bad.empty() || !last) && thin.folds().size() <= kFewFolds)
        bad.insert(bad.end(), thin.folds().begin(), thin.folds().end());
      if (bad.empty()) return succeed(result, std::move(mender), std::move(thin), replaced);
      if (last && stood)
        if (std::optional<Start> start_before = as_it_stood()) return start_before;
      if (thin.faults().empty() && tips.fate != Tips::Fate::Noted) {
        mender.keep();
        stood = true;
      }
      trouble.clear();
      for (const std::uint32_t f : bad) trouble.insert(trouble.end(), source.faces[f].begin(), source.faces[f].end());
      // What is said about the source is what was found before it was changed.
      if (cut == 0) {
        for (const std::uint32_t f : thin.faults()) result.bad_faces.push_back(source.face_of[f]);
        result.bad_parts = parts_of(mender, bad, "meet others, lie too near to them or fold");
      }
      if (result.obstacle.empty() && !thin.faults().empty()) {
        result.place = source.points[trouble.front()];
        result.obstacle = clause_of(mender, thin);
      }
      if (thin.faults().size() > 200 + s.faces.size() / 200) break;
    }
    if (cut == 0) result.specks = specks_of(mender, result.bad_parts, settings.speck);
    if (result.bad_parts.size() > kMostBadParts) result.bad_parts.resize(kMostBadParts);
    if (cut == kMostCuts || !result.specks.empty()) break;
    const auto loss = mender.cut_and_close(bad, 1);
    if (!loss) break;
    replaced.add(*loss);
    if (replaced.is_too_much()) break;
  }
  return std::nullopt;
}

/// Pushes sheets that were pushed apart farther from each other and evens them out, as far as points may lie from where
/// they were: between banks that all but touch no slab can grow. Where no thin shell stands then, points go back to
/// where it did. False when cancelled, or when it stands nowhere for all that.
bool widen(Mender& mender, ThinShell& thin, double longest, const Progress& progress) {
  constexpr int kRounds = 6;
  constexpr double kEven = 0.5;  // visibility that is wanted here
  const OrderedSource& source = mender.source();
  std::vector<std::uint8_t> pushed(source.points.size());
  for (std::uint32_t v = 0; v < pushed.size(); ++v) pushed[v] = mender.has_moved(v);
  mender.keep();
  ThinShell room(source, mender.rings(), longest, ThinShell::Heights::Roomy, pushed);
  std::vector<std::uint32_t> latest, touched, close, singular;
  for (int round = 0; round < kRounds; ++round) {
    if (!room.update(latest, {}, progress)) return false;
    close.clear();
    for (const std::uint32_t f : room.faults())
      if (std::ranges::any_of(source.faces[f], [&](std::uint32_t v) { return pushed[v] != 0; })) close.push_back(f);
    if (close.empty()) break;
    if (!mender.push_apart(close, progress)) return false;
    auto unseen = mender.smooth({}, kEven, kLeast, Mender::Neighbours::Follow, progress);
    if (!unseen) return false;
    singular = std::move(*unseen);
    latest = mender.take_changes().points;
    touched.insert(touched.end(), latest.begin(), latest.end());
  }
  std::vector<std::uint32_t> bad = faces_around(mender, singular), points;
  for (;;) {
    sort_unique(touched);
    if (!thin.update(touched, {}, progress)) return false;
    bad.insert(bad.end(), thin.faults().begin(), thin.faults().end());
    points.clear();
    for (const std::uint32_t f : bad)
      for (const std::uint32_t v : source.faces[f])
        mender.rings().around(v, [&](std::uint32_t h) { points.push_back(source.faces[h / 3][(h + 1) % 3]); });
    std::size_t back = mender.restore(points, kLeast);
    if (back == 0 && !bad.empty()) {
      // What stands in the way lies farther off.
      points.resize(source.points.size());
      std::iota(points.begin(), points.end(), 0U);
      back = mender.restore(points, kLeast);
    }
    if (back == 0) return bad.empty();
    bad.clear();
    touched = mender.take_changes().points;
  }
}

/// Pushes apart what meets until a thin shell stands on the source: for sheets that cross or touch along many faces,
/// and the folds among them. Where that leads no further, points may first lie farther from where they were, twice and
/// then four times as far as the settings say; then the least that is still bad is cut out. As smooth_and_cut() else.
std::optional<Start> push_and_cut(CertifiedShell& result, std::span<const LatticePoint> start,
                                  const CertifiedSettings& settings, bool needles, const Progress& progress) {
  constexpr int kRounds = 120, kVain = 3, kMostCuts = 12;
  constexpr std::size_t kMany = 1000;  // faces; what few take is soon done
  constexpr double kGain = 0.95;       // a round that leaves more of the bad faces was in vain
  constexpr double kFarther = 4;
  constexpr double kMostNear = 0.09;  // of the scanned faces: parts that lie in each other cannot be pushed out of it
  Replaced replaced(result.source);
  double farthest = settings.farthest;
  Mender mender(result.source, start, farthest, needles ? Mender::Needles::All : Mender::Needles::None);
  const OrderedSource& source = mender.source();
  ThinShell thin(source, mender.rings(), settings.longest);
  std::optional<ThinShell> room(std::in_place, source, mender.rings(), settings.longest, ThinShell::Heights::Stiff);
  Mender::Changes changes;  // since the thin shell was made
  std::size_t at_first = 0, fewest = source.faces.size();
  int vain = 0, cuts = 0;
  for (int round = 0; round < kRounds; ++round) {
    progress("shell", double(round) / kRounds);
    const auto singular = mender.smooth({}, kWanted, kLeast, Mender::Neighbours::Follow, progress);
    if (!singular) return std::nullopt;
    const Mender::Changes latest = mender.take_changes();
    if (!room->update(latest.points, latest.gone, progress)) return std::nullopt;
    changes.points.insert(changes.points.end(), latest.points.begin(), latest.points.end());
    changes.gone.insert(changes.gone.end(), latest.gone.begin(), latest.gone.end());
    const std::vector<std::uint32_t> folded = faces_around(mender, *singular);
    const auto with_folded = [&](std::vector<std::uint32_t> bad) {
      bad.insert(bad.end(), folded.begin(), folded.end());
      sort_unique(bad);
      return bad;
    };
    const std::vector<std::uint32_t> near = with_folded(room->faults());
    const auto scanned = std::ranges::count_if(near, [&](std::uint32_t f) { return mender.is_scanned(f); });
    const double share = replaced.share_of(static_cast<std::size_t>(scanned));
    if (share > kMostNear && near.size() > kMany) return std::nullopt;
    if (round == 0) {
      at_first = near.size();
      if (result.bad_faces.empty())
        for (const std::uint32_t f : near) result.bad_faces.push_back(source.face_of[f]);
    }
    vain = double(near.size()) > kGain * double(fewest) ? vain + 1 : 0;
    fewest = std::min(fewest, near.size());
    const bool may_go_farther = farthest < kFarther * settings.farthest;
    // Many faces, folds among them, that pushing makes no fewer at first do not yield to more room either.
    const bool in_vain = farthest == settings.farthest && !folded.empty() && near.size() >= std::max(at_first, kMany);
    const bool is_last = vain == kVain && may_go_farther && (share > kMostReplaced || in_vain);
    // The thin shell may stand all the same: solids with a common face are apart already.
    if (is_last && near.size() > kMany) return std::nullopt;
    if (!near.empty() && !is_last && (vain < kVain || may_go_farther)) {
      if (vain == kVain) {
        farthest *= 2;
        mender.allow(farthest);
        vain = 0;
      }
      if (!mender.push_apart(near, progress)) return std::nullopt;
      continue;
    }
    sort_unique(changes.points);
    sort_unique(changes.gone);
    if (!thin.update(changes.points, changes.gone, progress)) return std::nullopt;
    changes = {};
    const std::vector<std::uint32_t> bad = with_folded(thin.faults());
    if (bad.empty()) {
      room.reset();  // it makes one of its own
      if (!widen(mender, thin, settings.longest, progress)) return std::nullopt;
      return succeed(result, std::move(mender), std::move(thin), replaced);
    }
    if (is_last || ++cuts > kMostCuts) return std::nullopt;
    const auto loss = mender.cut_and_close(bad, 0);
    if (!loss) return std::nullopt;
    replaced.add(*loss);
    if (replaced.is_too_much()) return std::nullopt;
    fewest = source.faces.size();
    vain = 0;
  }
  return std::nullopt;
}

/// The vertices with very many triangles around them.
struct LargeFans {
  std::uint64_t pairs = 0;  ///< of triangles around the same one
  std::uint32_t largest = 0, triangles = 0;

  explicit LargeFans(const ClosedSource& s) {
    const std::vector<std::uint32_t> valences = valences_of(s);
    for (std::uint32_t v = 0; v < valences.size(); ++v) {
      const std::uint64_t n = valences[v];
      if (n <= kLargeFan) continue;
      pairs += n * n;
      if (n > triangles) largest = v, triangles = valences[v];
    }
  }
};

/// Divides large fans. False with an obstacle where so many triangles lie around vertices that work on all pairs of
/// them would take too long.
bool divide_large_fans(CertifiedShell& result) {
  constexpr std::uint64_t kMostPairs = 25'000'000;  // about 20 s
  ClosedSource& s = result.source;
  const LargeFans given(s);
  if (given.pairs == 0) return true;
  result.divided_fans = divide_fans(s);
  // Of long triangles that no longer have a corner in common, a quarter have boxes that meet.
  const std::uint64_t left = LargeFans(s).pairs;
  if (left + (given.pairs - std::min(given.pairs, left)) / 4 <= kMostPairs) return true;
  result.place = s.points[given.largest];
  result.obstacle =
      "a vertex has " + std::to_string(given.triangles) + " triangles around it, too many to compare each with each";
  std::size_t f = 0;
  while (std::ranges::find(s.faces[f], given.largest) == s.faces[f].end()) ++f;
  result.bad_parts = {{find_parts(s.points.size(), s.faces).of_face[f], result.place, result.obstacle}};
  return false;
}

/// A thin shell on the source once it is mended; nothing when cancelled or with an obstacle.
std::optional<Start> mend(CertifiedShell& result, const CertifiedSettings& settings, const Progress& progress) {
  if (!divide_large_fans(result)) return std::nullopt;
  constexpr int kTurns = 3;
  std::vector<LatticePoint> start = result.source.points;
  result.parted_points = part_touching(result.source, settings.farthest);
  std::optional<Start> mended;
  Needles needles = Needles::None;
  Tips tips;
  const auto needs_more = [&] { return !mended && result.specks.empty() && !progress.cancelled(); };
  const auto smooth = [&] { mended = smooth_and_cut(result, start, settings, needles, tips, progress); };
  const auto push = [&] { mended = push_and_cut(result, start, settings, needles != Needles::None, progress); };
  smooth();
  if (needs_more() && needles == Needles::Large) smooth();
  const auto may_do_without = [&] { return needs_more() && tips.fate == Tips::Fate::Noted; };
  if (may_do_without()) push();
  if (may_do_without() && needles == Needles::Large) {
    needles = Needles::All;
    smooth();
    needles = Needles::Large;
  }
  for (int turn = 1; turn <= kTurns && needs_more() && !tips.points.empty(); ++turn) {
    result.source.points = start;
    const std::vector<std::uint32_t> found = std::exchange(tips.points, {});
    const std::size_t blunted = cut_tips(result.source, found, settings.farthest);
    if (blunted == 0) break;
    result.blunted_points += blunted;
    tips.fate = turn < kTurns ? Tips::Fate::Cut : Tips::Fate::Left;
    start = result.source.points;
    result.parted_points = part_touching(result.source, settings.farthest);
    smooth();
  }
  if (needs_more() && result.blunted_points > 0) push();
  return mended;
}

}  // namespace

CertifiedShell build_certified(ClosedSource given, const CertifiedSettings& settings, const Progress& progress) {
  CertifiedShell result;
  result.source = std::move(given);
  std::optional<Start> start = mend(result, settings, progress);
  if (!start) {
    if (progress.cancelled()) result.obstacle.clear();
    return result;
  }
  const bool is_large = result.source.faces.size() > kLarge;
  free_memory(start->source.point_of, start->source.face_of, start->source.most_slack);
  LaidAside aside;  // what has the same points and faces in another order
  if (settings.lay_aside)
    aside.take(result.source.points, result.source.faces, result.source.patch, result.source.phantom);
  Reducer reducer(start->source, std::move(start->ends), std::move(start->tree), settings.target, settings.longest);
  if (!reducer.reduce(progress)) return result;
  constexpr std::size_t kFar = 8;  // times the target: from there it takes long and leads nowhere near
  constexpr double kNear = 2.5;    // the same: from there little would have to be very much
  bool folds = false;              // before anything was lost
  bool too_much = false;           // was lost
  for (const Tolerance& tolerance : settings.tolerances) {
    const std::size_t before = reducer.slab_count();
    if (before <= settings.target) break;
    const bool gives_up = tolerance.folds > 0;
    const bool loses = tolerance.loss > 0;
    if (loses && (settings.most_lost == 0 || is_large || double(before) > kNear * double(settings.target))) break;
    if (!gives_up && (is_large || before > kFar * settings.target)) continue;
    if (loses && !reducer.has_kept()) {
      reducer.keep();
      folds = result.tolerant;
    }
    if (!reducer.reduce_further(tolerance, progress)) return result;
    result.tolerant = result.tolerant || (gives_up && reducer.slab_count() < before);
    too_much = loses && reducer.lost() > settings.most_lost;
    if (too_much) break;
  }
  if (reducer.has_kept() && (reducer.slab_count() > settings.target || too_much)) {
    reducer.go_back();
    result.tolerant = folds;
  }
  if (!reducer.thicken(progress)) return result;
  result.shell = std::move(reducer).shell();
  start.reset();
  aside.give_back();
  return result;
}

}  // namespace relief::detail
