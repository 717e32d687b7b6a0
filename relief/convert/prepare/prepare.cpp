#include <relief/convert/convert.h>
#include <relief/convert/geometry/components.h>
#include <relief/convert/prepare/coincident_points.h>
#include <relief/convert/prepare/prepare.h>
#include <relief/convert/prepare/source_editor.h>
#include <relief/convert/prepare/split_high_valence.h>
#include <relief/convert/prepare/truncate_spikes.h>
#include <relief/convert/support/sort_unique.h>

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <span>
#include <utility>

namespace relief::detail {
namespace {

constexpr double kWanted = 0.22;        // visibility; more of it lets the shell become coarser
constexpr double kLeast = kHardlySeen;  // visibility: below it smoothing has to help, or a patch
constexpr double kLong = 4;             // edges of spikes, of how far a point may be moved: truncated if all else fails
constexpr int kSmoothings = 3;          // settle a few crossings; many do not yield to it

/// How much of what was scanned may be replaced or pushed aside, and what has been replaced. Patches and fill are no
/// scan: to replace them costs nothing.
class Budget {
 public:
  explicit Budget(const ClosedSource& s)
      : most_faces_(kMostReplaced * (double(std::ranges::count(s.patch, 0)) + kFewFaces)) {
    for (std::size_t f = 0; f < s.faces.size(); ++f) {
      if (s.patch[f] != 0) continue;
      const Vec3d a = to_double(s.points[s.faces[f][0]]);
      area_ += 0.5 * length(cross(to_double(s.points[s.faces[f][1]]) - a, to_double(s.points[s.faces[f][2]]) - a));
    }
    left_area_ = kMostReplaced * area_;
    left_faces_ = most_faces_;
  }
  [[nodiscard]] bool allows(const SourceEditor::Loss& more) const noexcept {
    return left_cuts_ > 0 && more.area <= left_area_ && double(more.faces) <= left_faces_;
  }
  /// Says whether a certified model may lack so much, as it may where a patch lies off what it replaces.
  [[nodiscard]] bool may_be_missing(const SourceEditor::Loss& loss) const noexcept {
    return loss.area <= (1 - ConvertReport::Coverage::kWhole) * area_;
  }
  /// What has to go farther than the limits say must be so little that it could be replaced.
  [[nodiscard]] bool allows_pushing(std::size_t faces, bool farther) const noexcept {
    return double(faces) <= (farther ? most_faces_ : kPushed * most_faces_);
  }
  void spend(const SourceEditor::Loss& loss) noexcept {
    --left_cuts_;
    left_area_ -= loss.area;
    left_faces_ -= double(loss.faces);
    spent_.faces += loss.faces;
    spent_.components += loss.components;
    if (loss.widest > spent_.widest) {
      spent_.widest = loss.widest;
      spent_.place = loss.place;
    }
  }
  /// What was replaced is back; the cuts are made for all that.
  void begin_again() noexcept {
    left_area_ += spent_.area;
    left_faces_ += double(spent_.faces);
    spent_ = {};
  }
  [[nodiscard]] const SourceEditor::Loss& spent() const noexcept { return spent_; }

 private:
  // A patch of some rings takes 60 faces: a source of few faces may have one nevertheless.
  static constexpr double kFewFaces = 2000;
  static constexpr double kPushed = 3;  // times as many may meet: solids that lie in each other cannot be pushed apart
  static constexpr int kMostCuts = 40;  // so that it ends: what lies on patches costs nothing

  int left_cuts_ = kMostCuts;
  double area_ = 0, left_area_ = 0;  // square lattice steps
  double most_faces_, left_faces_;
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

enum class Remedy : std::uint8_t {
  Smooth,     ///< around the defects
  Cut,        ///< out, and patch
  PushApart,  ///< what meets, and cut out what is left
  None
};

/// Finds the defects of a source and gives them the cheapest remedy of their kinds that may still help, until there are
/// none.
class Mending {
 public:
  /// `start`: where the source's points lay at first. `pushes`: apart what meets, before anything is cut out.
  Mending(Prepared& result, std::span<const LatticePoint> start, const PrepareLimits& limits, bool may_truncate,
          double least, bool pushes, Budget& budget, const Progress& progress)
      : result_(result),
        limits_(limits),
        may_truncate_(may_truncate),
        progress_(progress),
        wanted_(limits.creased ? kLeast : kWanted),
        least_(least),
        pushes_(pushes),
        budget_(budget),
        farthest_(limits.farthest),
        editor_(result.source, start, farthest_),
        shell_(editor_.source(), editor_.rings(), limits.longest,
               limits.creased ? InitialShell::Heights::Creased : InitialShell::Heights::Shrinking) {
    editor_.keep();
  }

  /// Ends with a stand, or without a remedy that may help.
  void run();
  /// Whether every vertex given was seen, some by less than asked for, but by a needle's point at least.
  [[nodiscard]] bool has_needles() const noexcept { return has_needles_; }
  /// Whether what meets has to be pushed apart: more is bad than may be cut out, or cuts did not do.
  [[nodiscard]] bool has_to_push() const noexcept { return !pushes_ && (too_much_ || editor_.was_cut()); }
  /// Returns the vertices, by their numbers in the given source, that no direction saw after smoothing and whose edges
  /// are so long that it could not help. After run().
  [[nodiscard]] const std::vector<std::uint32_t>& spikes() const noexcept { return spikes_; }

 private:
  bool smooth(std::span<const std::uint32_t> trouble);
  void collect_changes();
  std::optional<std::vector<Defect>> find_defects();
  [[nodiscard]] Remedy remedy_for(std::span<const Defect> defects) const;
  [[nodiscard]] bool may_cut(std::span<const std::uint32_t> faces) const;
  void find_spikes(double least);
  void note(const std::vector<Defect>& defects);
  std::size_t restore_all();
  [[nodiscard]] std::size_t rings() const noexcept { return pushes_ ? 0 : 1; }  // around what is cut out
  bool push_apart();
  bool widen();

  Prepared& result_;
  const PrepareLimits& limits_;
  bool may_truncate_;
  const Progress& progress_;
  double wanted_, least_;  // visibility
  const bool pushes_;      // apart what meets
  Budget& budget_;
  double farthest_;  // that points may lie from their start by now, lattice steps
  SourceEditor editor_;
  InitialShell shell_;
  std::optional<InitialShell> room_;  // finds sheets that have not much of it, while these are pushed apart
  bool has_needles_ = false, too_much_ = false;
  int smoothings_ = 0;
  std::vector<std::uint32_t> singular_, spikes_;
  SourceEditor::Changes latest_, changes_;  // since room_, shell_ were made
};

void Mending::run() {
  using Seen = SourceEditor::Seen;
  const auto seen_as_needles = editor_.look_at_all(wanted_, kNeedle, progress_);
  const auto seen = seen_as_needles == Seen::Well ? seen_as_needles : editor_.look_at_all(wanted_, least_, progress_);
  if (!seen) return;
  has_needles_ = seen == Seen::NotAll && seen_as_needles != Seen::NotAll;
  singular_ = editor_.singular();
  find_spikes(kVeryLong);
  if (!spikes_.empty()) return;
  // Vertices that a direction sees, if only just, stay where they are if a shell stands on them.
  bool as_it_is = seen == Seen::Poorly && !pushes_;
  std::vector<std::uint32_t> trouble;
  for (int round = 0;; ++round) {
    progress_("shell", double(round) / (round + 10));
    if (!std::exchange(as_it_is, false) && !smooth(trouble)) return;
    if (pushes_ && !push_apart()) return;
    const std::optional<std::vector<Defect>> defects = find_defects();
    if (!defects) return;
    if (defects->empty()) break;
    const std::vector<std::uint32_t> faces = faces_of(editor_, *defects);
    const Remedy remedy = remedy_for(*defects);
    if (remedy != Remedy::Smooth) note(*defects);
    if (!result_.specks.empty()) return;
    trouble.clear();
    switch (remedy) {
      case Remedy::Smooth:
        for (const std::uint32_t f : faces)
          trouble.insert(trouble.end(), editor_.source().faces[f].begin(), editor_.source().faces[f].end());
        break;
      case Remedy::Cut: {
        const auto loss = editor_.cut_and_patch(faces, rings());
        if (!loss) return;
        budget_.spend(*loss);
        break;
      }
      case Remedy::PushApart:
        too_much_ = true;
        return;
      case Remedy::None:
        return;
    }
  }
  room_.reset();  // widen() makes one of its own
  if ((!pushes_ && !editor_.was_cut()) || widen()) succeed(result_, std::move(editor_), std::move(shell_), budget_);
}

bool Mending::smooth(std::span<const std::uint32_t> trouble) {
  const auto neighbours =
      smoothings_++ == 0 && !pushes_ ? SourceEditor::Neighbours::FollowLate : SourceEditor::Neighbours::Follow;
  auto singular = editor_.smooth(trouble, wanted_, least_, neighbours, progress_);
  if (!singular) return false;
  singular_ = std::move(*singular);
  return true;
}

void Mending::collect_changes() {
  latest_ = editor_.take_changes();
  changes_.points.insert(changes_.points.end(), latest_.points.begin(), latest_.points.end());
  changes_.gone.insert(changes_.gone.end(), latest_.gone.begin(), latest_.gone.end());
}

/// Returns what stands in the way of a shell now; nothing when cancelled.
std::optional<std::vector<Defect>> Mending::find_defects() {
  constexpr std::size_t kFewFolds = 256;  // faces; more of them are how the source is, and none is smoothed away
  std::vector<Defect> defects = singular_vertices(editor_, singular_);
  // Where these are too many already, the shell need not be looked at.
  if (!defects.empty() && !may_cut(faces_of(editor_, defects))) return defects;
  collect_changes();
  sort_unique(changes_.points);
  sort_unique(changes_.gone);
  if (!shell_.update(changes_.points, changes_.gone, progress_)) return std::nullopt;
  changes_ = {};
  // Folds are smoothed, or cut out with the faults: cuts for their sake alone make new ones.
  const bool with_folds =
      !pushes_ && (!shell_.faults().empty() || smoothings_ < kSmoothings) && shell_.folds().size() <= kFewFolds;
  for (const Defect& d : shell_defects(editor_, shell_, with_folds)) defects.push_back(d);
  return defects;
}

Remedy Mending::remedy_for(std::span<const Defect> defects) const {
  const bool is_new = !pushes_ && !editor_.was_cut();
  if (is_new && singular_.empty() && smoothings_ < kSmoothings &&
      shell_.faults().size() <= few_to_smooth(result_.source.faces.size()))
    return Remedy::Smooth;
  if (may_cut(faces_of(editor_, defects))) return Remedy::Cut;
  return pushes_ ? Remedy::None : Remedy::PushApart;
}

/// Says what was found before anything was cut out or pushed apart.
void Mending::note(const std::vector<Defect>& defects) {
  if (!result_.obstacle) {
    result_.obstacle = gravest(defects);
    result_.bad_components = gravest_by_component(defects);
    result_.specks = specks_among(editor_, result_.bad_components, limits_.speck);
    if (result_.bad_components.size() > kMostBadComponents) result_.bad_components.resize(kMostBadComponents);
  }
  if (editor_.was_cut()) return;
  for (const std::uint32_t f : faces_of(editor_, defects)) result_.bad_faces.push_back(editor_.source().face_of[f]);
  if (!pushes_) find_spikes(kLong);
}

/// Finds singular vertices whose edges are all that much longer than points may be moved.
void Mending::find_spikes(double least) {
  spikes_.clear();
  for (const std::uint32_t v : singular_)
    if (may_truncate_ && editor_.shortest_edge_at(v) > least * limits_.farthest)
      spikes_.push_back(editor_.source().point_of[v]);
}

/// Says whether what is left of the budget allows to cut faces out, and no other remedy comes first: larger places are
/// pushed apart before they are cut.
bool Mending::may_cut(std::span<const std::uint32_t> faces) const {
  const SourceEditor::Loss loss = editor_.loss_of_cut(faces, rings());
  return budget_.allows(loss) && (pushes_ || budget_.may_be_missing(loss));
}

/// Puts all points back to where they were kept. How many that moves.
std::size_t Mending::restore_all() {
  std::vector<std::uint32_t> points(editor_.source().points.size());
  std::iota(points.begin(), points.end(), 0U);
  return editor_.restore(std::move(points), least_);
}

/// Pushes apart what meets, or has less room than a stiff shell takes, until nothing does or that leads no further.
/// Where that leads no further, points may first lie farther from where they were, twice and then four times as far as
/// the limits say. False where there is too much of it, and when cancelled.
bool Mending::push_apart() {
  constexpr int kVain = 3;        // rounds without gain in a row, after which points may go farther
  constexpr double kGain = 0.95;  // a round that leaves more of the bad faces was in vain
  constexpr double kFarther = 4;  // times as far as the limits say, where sheets that cross need it
  std::size_t fewest = editor_.source().faces.size();
  if (!room_) room_.emplace(editor_.source(), editor_.rings(), limits_.longest, InitialShell::Heights::Stiff);
  for (int vain = 0;;) {
    collect_changes();
    if (!room_->update(latest_.points, latest_.gone, progress_)) return false;
    std::vector<std::uint32_t> near = editor_.faces_around(singular_);
    near.insert(near.end(), room_->faults().begin(), room_->faults().end());
    if (near.empty()) return true;
    sort_unique(near);
    const auto scanned =
        static_cast<std::size_t>(std::ranges::count_if(near, [&](std::uint32_t f) { return editor_.is_scanned(f); }));
    if (!budget_.allows_pushing(scanned, farthest_ > limits_.farthest)) return false;
    vain = double(near.size()) > kGain * double(fewest) ? vain + 1 : 0;
    fewest = std::min(fewest, near.size());
    if (vain == kVain) {
      if (farthest_ >= kFarther * limits_.farthest || !budget_.allows_pushing(scanned, true)) return true;
      farthest_ *= 2;
      editor_.allow(farthest_);
      vain = 0;
    }
    if (!editor_.push_apart(near, progress_) || !smooth({})) return false;
  }
}

/// Pushes sheets that were pushed apart, and patches, farther from what they are near to and evens them out, as far as
/// points may lie from where they were: between banks that all but touch no slab can grow. Where no shell stands then,
/// points go back to where it did. False when cancelled, or when it stands nowhere nevertheless.
bool Mending::widen() {
  constexpr int kRounds = 6;     // of pushing; what is too near then is put back
  constexpr double kEven = 0.5;  // visibility that is wanted here: half of what a plane has
  const SourceIndex& source = editor_.source();
  std::vector<std::uint8_t> pushed(source.points.size());
  for (std::uint32_t v = 0; v < pushed.size(); ++v) pushed[v] = editor_.has_moved(v);
  for (std::uint32_t f = 0; f < source.faces.size(); ++f)
    if (source.alive(f) && source.face_of[f] == kNone)
      for (const std::uint32_t v : source.faces[f]) pushed[v] = 1;
  for (std::uint32_t f = 0; f < source.faces.size(); ++f)
    if (source.alive(f) && editor_.is_scanned(f))
      for (const std::uint32_t v : source.faces[f]) pushed[v] = editor_.has_moved(v);
  editor_.keep();
  InitialShell room(source, editor_.rings(), limits_.longest, InitialShell::Heights::Roomy, pushed);
  std::vector<std::uint32_t> latest, touched, close, singular;
  for (int round = 0; round < kRounds; ++round) {
    if (!room.update(latest, {}, progress_)) return false;
    close.clear();
    for (const std::uint32_t f : room.faults())
      if (std::ranges::any_of(source.faces[f], [&](std::uint32_t v) { return pushed[v] != 0; })) close.push_back(f);
    if (close.empty()) break;
    if (!editor_.push_apart(close, progress_)) return false;
    auto unseen = editor_.smooth({}, kEven, least_, SourceEditor::Neighbours::Follow, progress_);
    if (!unseen) return false;
    singular = std::move(*unseen);
    latest = editor_.take_changes().points;
    touched.insert(touched.end(), latest.begin(), latest.end());
  }
  std::vector<std::uint32_t> bad = editor_.faces_around(singular), points;
  for (;;) {
    sort_unique(touched);
    if (!shell_.update(touched, {}, progress_)) return false;
    bad.insert(bad.end(), shell_.faults().begin(), shell_.faults().end());
    points.clear();
    for (const std::uint32_t f : bad)
      for (const std::uint32_t v : source.faces[f])
        editor_.rings().around(v, [&](std::uint32_t h) { points.push_back(source.faces[h / 3][(h + 1) % 3]); });
    std::size_t back = editor_.restore(points, least_);
    if (back == 0 && !bad.empty()) back = restore_all();  // what stands in the way lies farther off
    if (back == 0) return bad.empty();
    bad.clear();
    touched = editor_.take_changes().points;
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

}  // namespace

Prepared prepare(ClosedSource given, const PrepareLimits& limits, const Progress& progress) {
  Prepared result;
  result.source = std::move(given);
  ClosedSource& s = result.source;
  if (!split_high_valences(result)) return result;
  std::vector<LatticePoint> start = s.points;
  Budget budget(s);
  bool may_truncate = true, pushes = false;
  std::vector<std::uint32_t> spikes;
  for (double least = kLeast;;) {
    result.repairs.parted_points = separate_coincident_points(s, limits.apart);
    Mending mending(result, start, limits, may_truncate, least, pushes, budget, progress);
    mending.run();
    if (result.stand || !result.specks.empty() || progress.cancelled()) break;
    // What is tried next does not go on from there, but from what was given: what cuts did not do for is pushed apart,
    // needles stay as they are, then spikes are truncated, which makes a new source.
    s.points = start;
    budget.begin_again();
    if (!pushes) spikes = mending.spikes();
    pushes = mending.has_to_push();
    if (pushes) continue;
    if (mending.has_needles()) {
      least = kNeedle;
      continue;
    }
    if (spikes.empty()) break;
    const std::size_t truncated = truncate_spikes(s, spikes, limits.farthest);
    may_truncate = truncated > 0;
    result.repairs.truncated_spikes += truncated;
    start = s.points;
  }
  if (progress.cancelled()) result.obstacle.reset();
  return result;
}

}  // namespace relief::detail
