#include <relief/convert/geometry/components.h>
#include <relief/convert/prepare/coincident_points.h>
#include <relief/convert/prepare/prepare.h>
#include <relief/convert/prepare/source_editor.h>
#include <relief/convert/prepare/split_high_valence.h>
#include <relief/convert/prepare/truncate_spikes.h>
#include <relief/convert/support/sort_unique.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>
#include <span>
#include <utility>

namespace relief::detail {
namespace {

constexpr double kWanted = 0.22;  // visibility; more of it lets the shell become coarser
constexpr double kLeast = 0.02;   // visibility, about a degree: below it smoothing has to help, or a patch

/// Says how much of what was scanned patches may replace, and have replaced.
class Budget {
 public:
  explicit Budget(const ClosedSource& s) {
    for (std::size_t f = 0; f < s.faces.size(); ++f) {
      if (s.patch[f] != 0) continue;
      const Vec3d a = to_double(s.points[s.faces[f][0]]);
      area_ += 0.5 * length(cross(to_double(s.points[s.faces[f][1]]) - a, to_double(s.points[s.faces[f][2]]) - a));
      ++faces_;
    }
  }
  void spend(const SourceEditor::Loss& loss) {
    spent_.area += loss.area;
    spent_.faces += loss.faces;
    spent_.components += loss.components;
    if (loss.widest > spent_.widest) {
      spent_.widest = loss.widest;
      spent_.place = loss.place;
    }
  }
  [[nodiscard]] bool is_overspent() const noexcept {
    return spent_.area > kMost * area_ || spent_.faces > most_faces();
  }
  /// So many scanned faces, as a share of what counts as all of them.
  [[nodiscard]] double share_of(std::size_t faces) const noexcept { return double(faces) / weight(); }
  [[nodiscard]] std::size_t most_faces() const noexcept { return static_cast<std::size_t>(kMost * weight()); }
  [[nodiscard]] std::size_t scanned() const noexcept { return faces_; }
  [[nodiscard]] const SourceEditor::Loss& spent() const noexcept { return spent_; }

  static constexpr double kMost = 0.03;  // of the area, and of the faces where there are many

 private:
  // A patch of some rings takes 60 faces: a source of few faces may have one nevertheless.
  static constexpr double kFewFaces = 2000;
  [[nodiscard]] double weight() const noexcept { return double(faces_) + kFewFaces; }

  double area_ = 0;  // square lattice steps
  std::size_t faces_ = 0;
  SourceEditor::Loss spent_;
};

/// Puts what was edited back into the given source, and brings all into one order where something was cut.
InitialStand finish(SourceEditor&& editor, InitialShell&& shell, ClosedSource& given) {
  std::vector<Ends> ends = shell.take_ends();
  std::unique_ptr<BoxTree> tree = shell.take_tree();
  const bool was_cut = editor.was_cut();
  editor.release();
  editor.put_back(given);
  SourceIndex source = std::move(editor).take_source();
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
  source = SourceIndex(given.points, given.faces);
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

/// Notes what was done to the source, and hands it over with its shell.
void succeed(Prepared& result, SourceEditor&& editor, InitialShell&& shell, const Budget& budget) {
  const SourceEditor::Moves moves = editor.moves();
  Repairs& repairs = result.repairs;
  repairs.moved_points = moves.points;
  repairs.moved_most = moves.most;
  repairs.replaced_faces = budget.spent().faces;
  repairs.replaced_widest = budget.spent().widest;
  repairs.replaced_place = budget.spent().place;
  repairs.vanished_components = budget.spent().components;
  result.obstacle.reset();
  result.bad_components.clear();
  result.stand = finish(std::move(editor), std::move(shell), result.source);
}

/// Returns those components, of some with defects, that are at most so wide.
std::vector<Obstacle> specks_among(SourceEditor& editor, const std::vector<Obstacle>& components, double widest) {
  if (components.empty()) return {};
  const SourceIndex& source = editor.source();
  std::vector<std::uint32_t> number(std::size_t{components.back().component} + 1, kNone);
  for (std::uint32_t k = 0; k < components.size(); ++k) number[components[k].component] = k;
  std::vector<Box3d> boxes(components.size());
  for (std::uint32_t f = 0; f < source.faces.size(); ++f) {
    const std::uint32_t c = editor.component_of(f);
    if (!source.alive(f) || c >= number.size() || number[c] == kNone) continue;
    for (const LatticePoint p : source.corners(f)) boxes[number[c]].add(to_double(p));
  }
  std::vector<Obstacle> specks;
  for (std::size_t k = 0; k < components.size(); ++k)
    if (const Vec3d e = boxes[k].extent(); std::max({e.x, e.y, e.z}) <= widest) specks.push_back(components[k]);
  return specks;
}

/// Returns those of some vertices, by their numbers in the given source, that were given with it and whose edges are
/// all longer than this.
std::vector<std::uint32_t> with_long_edges(const SourceEditor& editor, std::span<const std::uint32_t> vertices,
                                           double least) {
  const SourceIndex& source = editor.source();
  std::vector<std::uint32_t> found;
  for (const std::uint32_t v : vertices)
    if (source.point_of[v] != kNone && editor.shortest_edge_at(v) > least) found.push_back(source.point_of[v]);
  return found;
}

/// Vertices whose faces have no common front-facing direction and whose edges are too long for smoothing to help.
struct Spikes {
  std::vector<std::uint32_t> points;  ///< of the given source
  bool very_long = false;             ///< one of them at least, so that nothing but truncating them helps
  int turns_left = 3;                 ///< of truncating; each may leave shorter ones. Without any they are cut out
};

/// Returns what stands on a source whose vertices are seen, if only just: they stay where they are.
bool stands_as_it_is(Prepared& result, SourceEditor& editor, InitialShell& shell, double wanted, double least,
                     const Budget& budget, const Progress& progress) {
  if (editor.look_at_all(wanted, least, progress) != SourceEditor::Seen::Poorly) return false;
  if (!shell.update({}, {}, progress) || !shell.faults().empty() || !shell.folds().empty()) return false;
  succeed(result, std::move(editor), std::move(shell), budget);
  return true;
}

/// Returns the visibility below which vertices are smoothed: those of sharp creases would carry the crease away with
/// them.
double wanted_of(const PrepareLimits& limits) noexcept { return limits.creased ? kLeast : kWanted; }

InitialShell::Heights heights_of(const PrepareLimits& limits) noexcept {
  return limits.creased ? InitialShell::Heights::Creased : InitialShell::Heights::Shrinking;
}

/// For few defects, far from each other: smooths around them, then cuts out what is left and closes it with patches,
/// until a shell stands. Where it fails, the source is as it was given. `start`: where its points lay at first.
/// Finds spikes; where they are so long that smoothing is known not to help, it fails at once.
void smooth_and_cut(Prepared& result, std::span<const LatticePoint> start, const PrepareLimits& limits, Spikes& spikes,
                    const Progress& progress) {
  constexpr int kSmoothings = 3;          // settle a few crossings; many do not yield to it
  constexpr int kMostCuts = 40;           // most are small, around vertices without a common front-facing direction
  constexpr std::size_t kFewFolds = 256;  // faces; more of them are how the source is, and none is smoothed away
  constexpr double kLong = 4, kVeryLong = 30;  // edges of spikes, of how far a point may be moved
  const ClosedSource& s = result.source;
  const double wanted = wanted_of(limits);
  Budget budget(s);
  SourceEditor editor(s, start, limits.farthest);
  const SourceIndex& source = editor.source();
  // So many faults cannot be cut out: at the first cut, before which no patch is of our own making.
  const std::size_t hopeless = budget.most_faces() + s.faces.size() - budget.scanned();
  InitialShell shell(source, editor.rings(), limits.longest, heights_of(limits), {}, hopeless);
  if (stands_as_it_is(result, editor, shell, wanted, kLeast, budget, progress)) return;
  std::vector<Defect> defects;
  std::vector<std::uint32_t> trouble;  // corners of faces with defects
  for (int cut = 0; cut <= kMostCuts; ++cut) {
    progress("shell", double(cut) / kMostCuts);
    trouble.clear();
    const int rounds = cut == 0 ? kSmoothings : 1;
    for (int round = 0; round < rounds; ++round) {
      const auto neighbours =
          cut == 0 && round == 0 ? SourceEditor::Neighbours::FollowLate : SourceEditor::Neighbours::Follow;
      const auto singular = editor.smooth(trouble, wanted, kLeast, neighbours, progress);
      if (!singular) return;
      if (!singular->empty()) {
        if (cut == 0 && spikes.turns_left > 0) {
          spikes.points = with_long_edges(editor, *singular, kLong * limits.farthest);
          spikes.very_long = !with_long_edges(editor, *singular, kVeryLong * limits.farthest).empty();
          if (spikes.very_long) return;
        }
        defects = singular_vertices(editor, *singular);
        break;
      }
      const SourceEditor::Changes changes = editor.take_changes();
      if (!shell.update(changes.points, changes.gone, progress)) return;
      // Folds are smoothed, or cut out with the faults: cuts for their sake alone make new ones.
      const bool may_smooth = round + 1 < rounds;
      const bool with_folds = (!shell.faults().empty() || may_smooth) && shell.folds().size() <= kFewFolds;
      defects = shell_defects(editor, shell, with_folds);
      if (defects.empty()) return succeed(result, std::move(editor), std::move(shell), budget);
      trouble.clear();
      for (const Defect& d : defects)
        trouble.insert(trouble.end(), source.faces[d.at].begin(), source.faces[d.at].end());
      if (cut == 0)
        for (const std::uint32_t f : shell.faults()) result.bad_faces.push_back(source.face_of[f]);
      if (shell.faults().size() > few_to_smooth(s.faces.size())) break;
    }
    // What is said about the source is what was found before it was changed.
    if (!result.obstacle) result.obstacle = gravest(defects);
    if (cut == 0) {
      result.bad_components = gravest_by_component(defects);
      result.specks = specks_among(editor, result.bad_components, limits.speck);
      if (result.bad_components.size() > kMostBadComponents) result.bad_components.resize(kMostBadComponents);
    }
    if (cut == kMostCuts || !result.specks.empty()) break;
    const auto loss = editor.cut_and_patch(faces_of(editor, defects), 1);
    if (!loss) break;
    budget.spend(*loss);
    if (budget.is_overspent()) break;
  }
}

/// Pushes sheets that were pushed apart farther from each other and evens them out, as far as points may lie from where
/// they were: between banks that all but touch no slab can grow. Where no shell stands then, points go back to where it
/// did. False when cancelled, or when it stands nowhere nevertheless.
bool widen(SourceEditor& editor, InitialShell& shell, double longest, const Progress& progress) {
  constexpr int kRounds = 6;     // of pushing; what is too near then is put back
  constexpr double kEven = 0.5;  // visibility that is wanted here: half of what a plane has
  const SourceIndex& source = editor.source();
  std::vector<std::uint8_t> pushed(source.points.size());
  for (std::uint32_t v = 0; v < pushed.size(); ++v) pushed[v] = editor.has_moved(v);
  editor.keep();
  InitialShell room(source, editor.rings(), longest, InitialShell::Heights::Roomy, pushed);
  std::vector<std::uint32_t> latest, touched, close, singular;
  for (int round = 0; round < kRounds; ++round) {
    if (!room.update(latest, {}, progress)) return false;
    close.clear();
    for (const std::uint32_t f : room.faults())
      if (std::ranges::any_of(source.faces[f], [&](std::uint32_t v) { return pushed[v] != 0; })) close.push_back(f);
    if (close.empty()) break;
    if (!editor.push_apart(close, progress)) return false;
    auto unseen = editor.smooth({}, kEven, kLeast, SourceEditor::Neighbours::Follow, progress);
    if (!unseen) return false;
    singular = std::move(*unseen);
    latest = editor.take_changes().points;
    touched.insert(touched.end(), latest.begin(), latest.end());
  }
  std::vector<std::uint32_t> bad = editor.faces_around(singular), points;
  for (;;) {
    sort_unique(touched);
    if (!shell.update(touched, {}, progress)) return false;
    bad.insert(bad.end(), shell.faults().begin(), shell.faults().end());
    points.clear();
    for (const std::uint32_t f : bad)
      for (const std::uint32_t v : source.faces[f])
        editor.rings().around(v, [&](std::uint32_t h) { points.push_back(source.faces[h / 3][(h + 1) % 3]); });
    std::size_t back = editor.restore(points, kLeast);
    if (back == 0 && !bad.empty()) {
      // What stands in the way lies farther off.
      points.resize(source.points.size());
      std::iota(points.begin(), points.end(), 0U);
      back = editor.restore(points, kLeast);
    }
    if (back == 0) return bad.empty();
    bad.clear();
    touched = editor.take_changes().points;
  }
}

/// For sheets that cross or touch along many faces, and the folds among them: pushes apart what meets until a shell
/// stands. Where that leads no further, points may first lie farther from where they were, twice and then four times as
/// far as the limits say; then the least that is still bad is cut out. As smooth_and_cut() else.
void push_and_cut(Prepared& result, std::span<const LatticePoint> start, const PrepareLimits& limits,
                  const Progress& progress) {
  constexpr int kRounds = 120;   // of pushing and cutting in all, so that it ends
  constexpr int kVain = 3;       // rounds without gain in a row, after which points may go farther, or are cut out
  constexpr int kMostCuts = 12;  // so that it ends
  constexpr std::size_t kMany = 1000;  // faces; what few take is soon done
  constexpr double kGain = 0.95;       // a round that leaves more of the bad faces was in vain
  constexpr double kFarther = 4;       // times as far as the limits say, where sheets that cross need it
  constexpr double kMostNear = 0.09;   // of the scanned faces: solids that lie in each other cannot be pushed out of it
  Budget budget(result.source);
  double farthest = limits.farthest;
  SourceEditor editor(result.source, start, farthest);
  const SourceIndex& source = editor.source();
  InitialShell shell(source, editor.rings(), limits.longest, heights_of(limits));
  std::optional<InitialShell> room(std::in_place, source, editor.rings(), limits.longest, InitialShell::Heights::Stiff);
  SourceEditor::Changes changes;  // since the shell was made
  std::size_t at_first = 0, fewest = source.faces.size();
  int vain = 0, cuts = 0;
  for (int round = 0; round < kRounds; ++round) {
    progress("shell", double(round) / kRounds);
    const auto singular = editor.smooth({}, wanted_of(limits), kLeast, SourceEditor::Neighbours::Follow, progress);
    if (!singular) return;
    const SourceEditor::Changes latest = editor.take_changes();
    if (!room->update(latest.points, latest.gone, progress)) return;
    changes.points.insert(changes.points.end(), latest.points.begin(), latest.points.end());
    changes.gone.insert(changes.gone.end(), latest.gone.begin(), latest.gone.end());
    const std::vector<std::uint32_t> around = editor.faces_around(*singular);
    const auto with_singular = [&](std::vector<std::uint32_t> bad) {
      bad.insert(bad.end(), around.begin(), around.end());
      sort_unique(bad);
      return bad;
    };
    const std::vector<std::uint32_t> near = with_singular(room->faults());
    const auto scanned = std::ranges::count_if(near, [&](std::uint32_t f) { return editor.is_scanned(f); });
    const double share = budget.share_of(static_cast<std::size_t>(scanned));
    if (share > kMostNear && near.size() > kMany) return;
    if (round == 0) {
      at_first = near.size();
      if (result.bad_faces.empty())
        for (const std::uint32_t f : near) result.bad_faces.push_back(source.face_of[f]);
    }
    vain = double(near.size()) > kGain * double(fewest) ? vain + 1 : 0;
    fewest = std::min(fewest, near.size());
    const bool may_go_farther = farthest < kFarther * limits.farthest;
    // Many faces, singular vertices among them, that pushing makes no fewer at first do not yield to more room either.
    const bool in_vain = farthest == limits.farthest && !around.empty() && near.size() >= std::max(at_first, kMany);
    const bool is_last = vain == kVain && may_go_farther && (share > Budget::kMost || in_vain);
    // The shell may still stand: solids with a common face are apart by now.
    if (is_last && near.size() > kMany) return;
    if (!near.empty() && !is_last && (vain < kVain || may_go_farther)) {
      if (vain == kVain) {
        farthest *= 2;
        editor.allow(farthest);
        vain = 0;
      }
      if (!editor.push_apart(near, progress)) return;
      continue;
    }
    sort_unique(changes.points);
    sort_unique(changes.gone);
    if (!shell.update(changes.points, changes.gone, progress)) return;
    changes = {};
    const std::vector<std::uint32_t> bad = with_singular(shell.faults());
    if (bad.empty()) {
      room.reset();  // it makes one of its own
      if (widen(editor, shell, limits.longest, progress)) succeed(result, std::move(editor), std::move(shell), budget);
      return;
    }
    if (is_last || ++cuts > kMostCuts) return;
    const auto loss = editor.cut_and_patch(bad, 0);
    if (!loss) return;
    budget.spend(*loss);
    if (budget.is_overspent()) return;
    fewest = source.faces.size();
    vain = 0;
  }
}

/// The vertices with very many triangles around them.
struct HighValences {
  std::uint64_t pairs = 0;  ///< of triangles around the same one
  std::uint32_t largest = 0, triangles = 0;

  explicit HighValences(const ClosedSource& s) {
    const std::vector<std::uint32_t> valences = valences_of(s);
    for (std::uint32_t v = 0; v < valences.size(); ++v) {
      const std::uint64_t n = valences[v];
      if (n <= kHighValence) continue;
      pairs += n * n;
      if (n > triangles) largest = v, triangles = valences[v];
    }
  }
};

/// Splits vertices of high valence. False with an obstacle where so many triangles lie around vertices that work on all
/// pairs of them would take too long.
bool split_high_valences(Prepared& result) {
  constexpr std::uint64_t kMostPairs = 25'000'000;  // about 20 s
  constexpr std::uint64_t kSplitShare = 4;  // of long triangles without a common corner, a quarter have boxes that meet
  ClosedSource& s = result.source;
  const HighValences given(s);
  if (given.pairs == 0) return true;
  result.repairs.split_vertices = split_high_valence(s);
  const std::uint64_t left = HighValences(s).pairs;
  if (left + (given.pairs - std::min(given.pairs, left)) / kSplitShare <= kMostPairs) return true;
  std::size_t f = 0;
  while (std::ranges::find(s.faces[f], given.largest) == s.faces[f].end()) ++f;
  result.obstacle = {DefectKind::HighValence, s.points[given.largest],
                     find_components(s.points.size(), s.faces).of_face[f], given.triangles};
  result.bad_components = {*result.obstacle};
  return false;
}

/// Truncates spikes of the source as it lay at first; how many.
std::size_t truncate(Prepared& result, std::vector<LatticePoint>& start, Spikes& spikes, const PrepareLimits& limits) {
  result.source.points = start;
  const std::size_t truncated = truncate_spikes(result.source, std::exchange(spikes.points, {}), limits.farthest);
  spikes.very_long = false;
  --spikes.turns_left;
  result.repairs.truncated_spikes += truncated;
  start = result.source.points;
  result.repairs.parted_points = separate_coincident_points(result.source, limits.apart);
  return truncated;
}

enum class Remedy : std::uint8_t {
  Smooth,     ///< and cut out what is left
  PushApart,  ///< and cut out what is left
  Leave,      ///< vertices that are seen by no more than a needle's point
  Truncate    ///< spikes, and smooth again
};
/// What changes little comes first.
constexpr std::array kRemedies = {Remedy::Smooth,   Remedy::PushApart, Remedy::Leave,    Remedy::Truncate,
                                  Remedy::Truncate, Remedy::Truncate,  Remedy::PushApart};

}  // namespace

Prepared prepare(ClosedSource given, const PrepareLimits& limits, const Progress& progress) {
  Prepared result;
  result.source = std::move(given);
  if (!split_high_valences(result)) return result;
  std::vector<LatticePoint> start = result.source.points;
  result.repairs.parted_points = separate_coincident_points(result.source, limits.apart);
  Spikes spikes;
  bool is_new = true;  // since sheets were pushed apart in vain
  for (const Remedy remedy : kRemedies) {
    if (result.stand || !result.specks.empty() || progress.cancelled()) break;
    switch (remedy) {
      case Remedy::Smooth:
        smooth_and_cut(result, start, limits, spikes, progress);
        break;
      case Remedy::PushApart:
        if (is_new && !spikes.very_long) push_and_cut(result, start, limits, progress);
        is_new = is_new && spikes.very_long;
        break;
      case Remedy::Leave: {
        if (spikes.very_long || result.obstacle->kind != DefectKind::SingularVertex) break;
        SourceEditor editor(result.source, start, limits.farthest);
        InitialShell shell(editor.source(), editor.rings(), limits.longest);
        stands_as_it_is(result, editor, shell, kWanted, kNeedle, Budget(result.source), progress);
        break;
      }
      case Remedy::Truncate:
        if (spikes.points.empty() || truncate(result, start, spikes, limits) == 0) break;
        is_new = true;
        smooth_and_cut(result, start, limits, spikes, progress);
        break;
    }
  }
  if (progress.cancelled()) result.obstacle.reset();
  return result;
}

}  // namespace relief::detail
