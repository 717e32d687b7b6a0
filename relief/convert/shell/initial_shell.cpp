#include <relief/convert/geometry/visibility.h>
#include <relief/convert/shell/initial_shell.h>
#include <relief/convert/support/parallel.h>
#include <relief/convert/support/sort_unique.h>

#include <algorithm>
#include <numeric>

namespace relief::detail {
namespace {

constexpr double kLeastSeen = 0.02;  // visibility: fibres get no longer for less
constexpr float kTall = 16;          // times the other fibres of its face: such a fibre gives way first

}  // namespace

unsigned corners_to_lower(const std::array<std::array<float, 2>, 3>& heights,
                          const std::array<float, 3>& least) noexcept {
  const auto length_of = [](const std::array<float, 2>& halves) { return halves[kInner] + halves[kOuter]; };
  const float lowest = std::min({length_of(heights[0]), length_of(heights[1]), length_of(heights[2])});
  unsigned corners = 0;
  for (std::size_t k = 0; k < 3; ++k)
    if (length_of(heights[k]) > kTall * lowest && std::ranges::max(heights[k]) > least[k]) corners |= 1U << k;
  return corners;
}

bool InitialShell::update(std::span<const std::uint32_t> changed, std::span<const std::uint32_t> gone,
                          const Progress& progress) {
  constexpr int kRounds = 60;  // halvings of two sides from the longest fibre to the least height, and some more
  constexpr std::size_t kChunk = 8192;  // faces; after each the pairs tested so far are counted
  constexpr std::size_t kMostPairs = 30'000'000, kMostPairsEach = 2000;  // in all, and for each face: a few seconds
  const std::size_t points = source_.points.size(), faces = source_.faces.size();
  std::vector<std::uint32_t> again, work;
  directions_.resize(points);
  heights_.resize(points);
  least_.resize(points, float(kLeastHeight));
  ends_.resize(points);
  blamed_.assign(points, 0);
  works_.resize(faces, 0);
  faulty_.resize(faces, 0);
  if (tree_) {
    // Slabs that the removed trouble had shortened may now stand higher.
    again.assign(changed.begin(), changed.end());
    for (const std::uint32_t f : faults_)
      if (source_.alive(f)) again.insert(again.end(), source_.faces[f].begin(), source_.faces[f].end());
    again.insert(again.end(), shortest_.begin(), shortest_.end());
    sort_unique(again);
  } else {
    again.resize(points);
    std::iota(again.begin(), again.end(), 0U);
  }
  shortest_.clear();
  if (components_.of_face.size() != faces || !gone.empty()) components_ = find_components(points, source_.faces);
  if (!for_all(again.size(), 1024, progress, [&](std::size_t k) { start(again[k]); })) return false;
  if (tree_) {
    for (const std::uint32_t f : gone) faulty_[f] = 0;
    for (const std::uint32_t v : again) rings_.around(v, [&](std::uint32_t h) { work.push_back(h / 3); });
    sort_unique(work);
    const auto set = [&](std::uint32_t f) { tree_->set(f, box(f)); };
    for (auto f = static_cast<std::uint32_t>(tree_->count()); f < faces; ++f) set(f);
    std::for_each(gone.begin(), gone.end(), set);
    std::for_each(work.begin(), work.end(), set);
  } else {
    tree_ = std::make_unique<BoxTree>(faces, [&](std::size_t f) { return box(static_cast<std::uint32_t>(f)); });
    const auto is_wanted = [&](std::uint32_t v) { return wanted_.empty() || wanted_[v] != 0; };
    for (std::uint32_t f = 0; f < faces; ++f)
      if (source_.alive(f) && std::ranges::any_of(source_.faces[f], is_wanted)) work.push_back(f);
  }
  for (const std::uint32_t f : work) works_[f] = 1;

  const std::size_t most_pairs = kMostPairs + kMostPairsEach * work.size();
  pairs_ = 0;
  const auto test_all = [&](bool source_is_new) {
    for (const std::uint32_t f : work) faulty_[f] = 0;
    // A heap of triangles that all meet each other is given up early, always at the same point of the work.
    std::size_t begin = 0;
    for (; begin < work.size() && pairs_ < most_pairs; begin += kChunk)
      if (!for_all(std::min(kChunk, work.size() - begin), 256, progress,
                   [&](std::size_t k) { test(work[begin + k], source_is_new); }))
        return false;
    for (; begin < work.size(); ++begin) faulty_[work[begin]] = kFault;
    for (const std::uint32_t f : work) works_[f] = 0;
    return true;
  };
  for (int round = 0; round < kRounds && !work.empty(); ++round) {
    if (!test_all(round == 0)) return false;
    if (pairs_ >= most_pairs) break;
    if (!shrink(work)) break;
  }
  for (const std::uint32_t f : work) works_[f] = 0;
  faults_.clear();
  folds_.clear();
  for (std::uint32_t f = 0; f < faces; ++f)
    if (faulty_[f] != 0) ((faulty_[f] & kFault) != 0 ? faults_ : folds_).push_back(f);
  return true;
}

void InitialShell::start(std::uint32_t v) {
  thread_local std::vector<Vec3d> normals;
  normals.clear();
  const Vec3d at = to_double(source_.points[v]);
  double shortest = Box3d::kFar;
  rings_.around(v, [&](std::uint32_t h) {
    normals.push_back(source_.normal(h / 3));
    shortest = std::min(shortest, length(to_double(source_.points[source_.faces[h / 3][(h + 1) % 3]]) - at));
  });
  const Direction direction = best_direction(normals);
  directions_[v] = to_float(direction.d);
  if (kind_ == Heights::Creased)
    least_[v] = static_cast<float>(kLeastHeight / std::clamp(direction.visibility, kLeastSeen, 1.0));
  heights_[v].fill(static_cast<float>(std::clamp(kStarts[static_cast<std::size_t>(kind_)] * shortest,
                                                 std::min(double(least_[v]), tallest_), tallest_)));
  place(v);
}

void InitialShell::place(std::uint32_t v) {
  const Vec3d at = to_double(source_.points[v]), d = to_double(directions_[v]);
  ends_[v] = {snap(at - d * double(heights_[v][kInner])), snap(at + d * double(heights_[v][kOuter]))};
}

LatticeTriangle InitialShell::triangle(std::uint32_t f, Side side) const noexcept {
  const Face& face = source_.faces[f];
  return {ends_[face[0]][side], ends_[face[1]][side], ends_[face[2]][side]};
}

Box3d InitialShell::box(std::uint32_t f) const noexcept {
  Box3d box;
  if (!source_.alive(f)) return box;
  for (const std::uint32_t v : source_.faces[f])
    for (const LatticePoint p : ends_[v]) box.add(to_double(p));
  return box;
}

void InitialShell::test(std::uint32_t f, bool source_is_new) {
  constexpr std::uint8_t kBothSides = (1U << kInner) | (1U << kOuter);
  const SlabShape mine(triangle(f, kInner), triangle(f, kOuter));
  const SourceTriangle own = source_.triangle(f);
  const auto adjacent = [&](std::uint32_t face, std::uint32_t other) {
    return share_a_corner(source_.faces[face], source_.faces[other]);
  };
  // At a needle or a knife edge it is short fibres that have no room beside the source: the others give way first.
  const auto found = [&](std::uint32_t face, Side side) {
    float others = 0;
    for (const std::uint32_t v : source_.faces[face])
      if (!source_.is_needle(v)) others = std::max(others, heights_[v][side]);
    for (const std::uint32_t v : source_.faces[face])
      if (!source_.is_needle(v) || heights_[v][side] > kTall * others)
        std::atomic_ref(blamed_[v]).fetch_or(static_cast<std::uint8_t>(1U << side), std::memory_order_relaxed);
    std::atomic_ref(faulty_[face]).fetch_or(kFault, std::memory_order_relaxed);
  };
  // Beside a fibre that had to be very short a tall one prevails in all of a slab: where that one sees the back of a
  // triangle around the short one, it is the tall one that has to give way, not the source.
  const auto lower_the_tallest = [&](std::uint32_t face) {
    const auto [a, b, c] = source_.faces[face];
    const unsigned tall = corners_to_lower({heights_[a], heights_[b], heights_[c]}, {least_[a], least_[b], least_[c]});
    if (!may_shrink() || tall == 0) return false;
    for (std::size_t k = 0; k < 3; ++k)
      if ((tall >> k & 1U) != 0)
        std::atomic_ref(blamed_[source_.faces[face][k]]).fetch_or(kBothSides, std::memory_order_relaxed);
    std::atomic_ref(faulty_[face]).fetch_or(kFault, std::memory_order_relaxed);
    return true;
  };
  const auto judge = [&](std::uint32_t face, std::uint32_t triangle, Meeting meeting) {
    if (meeting == Meeting::Outer) found(face, kOuter);
    if (meeting == Meeting::Inner) found(face, kInner);
    if (meeting != Meeting::Folded) return;
    if (face == triangle || can_shrink(face, adjacent(face, triangle) ? face : triangle)) {
      found(face, kOuter);
      found(face, kInner);
    } else if (!lower_the_tallest(face)) {
      std::atomic_ref(faulty_[face]).fetch_or(kFold, std::memory_order_relaxed);
    }
  };
  const JacobianFault jacobian = jacobian_fault(mine.triangle(kInner), mine.triangle(kOuter));
  if (jacobian != JacobianFault::None) {
    if (jacobian != JacobianFault::Outer) found(f, kInner);
    if (jacobian != JacobianFault::Inner) found(f, kOuter);
  }
  thread_local std::vector<std::uint32_t> near;
  near.clear();
  tree_->query(mine.box(), [&](std::uint32_t g) {
    near.push_back(g);
    return true;
  });
  pairs_ += near.size();
  // Floats settle most of it.
  source_.for_near(mine, near, [&](std::uint32_t g, bool is_section) {
    if (!is_section) judge(f, g, mine.meet(g == f ? own : source_.triangle(g)));
  });
  const std::array<LatticeBox, 2> my_boxes = {LatticeBox(mine.triangle(kInner)), LatticeBox(mine.triangle(kOuter))};
  for (const std::uint32_t g : near) {
    if (works_[g] != 0 && g < f) continue;  // the pair is tested from the other slab
    const std::array<LatticeTriangle, 2> sides = {triangle(g, kInner), triangle(g, kOuter)};
    if (works_[g] == 0 && source_is_new) judge(g, f, SlabShape(sides[kInner], sides[kOuter]).meet(own));
    const bool joined = adjacent(f, g);
    const std::array<LatticeBox, 2> boxes = {LatticeBox(sides[kInner]), LatticeBox(sides[kOuter])};
    for (const Side mine_side : {kInner, kOuter})
      for (const Side side : {kInner, kOuter}) {
        if ((side == mine_side && joined) || !boxes[side].meets(my_boxes[mine_side])) continue;
        if (mine.surely_apart(mine_side, sides[side]) || !triangles_meet(mine.triangle(mine_side), sides[side]))
          continue;
        found(f, mine_side);
        found(g, side);
      }
    if (components_.of_face[f] == components_.of_face[g]) continue;
    const SlabShape theirs(sides[kInner], sides[kOuter]);
    if (mine.holds_end_of(theirs) || theirs.holds_end_of(mine)) {
      const Vec3d between = source_.triangle(g).a - own.a;
      found(f, dot(between, own.normal) > 0 ? kOuter : kInner);
      found(g, dot(between, source_.normal(g)) < 0 ? kOuter : kInner);
    }
  }
}

/// Returns whether the slab of a face may become thinner because another triangle folds in it: down to a share of the
/// shortest edge of both. Beside a needle less does not help: the lower a fibre, the more rounding turns it.
bool InitialShell::can_shrink(std::uint32_t f, std::uint32_t swallowed) const noexcept {
  constexpr double kThinEnough = 0.1;  // of the shortest edge: from there it is the source that is folded
  if (!may_shrink()) return false;
  double shortest = Box3d::kFar, tallest = 0;
  for (const std::uint32_t face : {f, swallowed})
    for (std::size_t k = 0; k < 3; ++k) {
      const Face& corners = source_.faces[face];
      shortest =
          std::min(shortest, length(to_double(source_.points[corners[k]] - source_.points[corners[(k + 1) % 3]])));
    }
  for (const std::uint32_t v : source_.faces[f])
    for (const float height : heights_[v]) tallest = std::max(tallest, double(height));
  return tallest > std::max(kLeastHeight, kThinEnough * shortest);
}

/// Halves what is to blame, and leaves in `work` the faces that this changes; false when none of it
/// may be lower.
bool InitialShell::shrink(std::vector<std::uint32_t>& work) {
  work.clear();
  if (!may_shrink()) return false;
  bool shrunk = false;
  for (std::uint32_t v = 0; v < blamed_.size(); ++v) {
    if (blamed_[v] == 0) continue;
    for (const Side side : {kInner, kOuter}) {
      float& height = heights_[v][side];
      if ((blamed_[v] >> side & 1U) == 0 || height <= least_[v]) continue;
      height = std::max(least_[v], height * 0.5F);
      if (height <= least_[v]) shortest_.push_back(v);
      shrunk = true;
    }
    blamed_[v] = 0;
    place(v);
    rings_.around(v, [&](std::uint32_t h) {
      if (works_[h / 3] != 0) return;
      works_[h / 3] = 1;
      work.push_back(h / 3);
    });
  }
  std::sort(work.begin(), work.end());
  return shrunk;
}

}  // namespace relief::detail
