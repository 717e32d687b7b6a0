#include <relief/convert/shell/edge_operators.h>
#include <relief/convert/shell/fibre_direction.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <span>
#include <utility>

namespace relief::detail {
namespace {

// Shapes are those of shape_of(): 1 for an equilateral triangle, 0 for one without area.
constexpr double kLeastShape = 0.08;      // of a slab that a collapse makes, unless it was as bad before
constexpr double kAsBad = 0.9;            // of the shape before
constexpr double kLeastHalfShape = 0.15;  // the same of a half-edge collapse: a whole one may find a better place
constexpr double kDearer = 4;             // times the cost: half the work is worth a place that is not quite the best

// How a height changes where a check fails; see also HeightSearch::grow().
constexpr double kShrinkForJacobian = 0.6, kShrinkForOverlap = 0.8;
constexpr int kMostJacobianShrinks = 3;  // per direction: from there it is the direction that is wrong
constexpr int kMostTries = 10, kMostPatientTries = 24;

// A flip must gain: of the worse shape this factor and this much more; or two of the valences' distances from six, and
// then it must leave some shape.
constexpr double kFlipGain = 1.05, kFlipGainAtLeast = 0.02;
constexpr int kFlipValenceGain = 2, kEvenValence = 6;
constexpr double kFlipShapeKept = 0.5, kFlipLeastShape = 0.2;
constexpr int kLeastFlipValence = 4, kMostFlipValence = 11;  // of the ends it leaves and of those it comes to

}  // namespace

Merge collapse_cost(const LinkedDraft& draft, std::uint32_t u, std::uint32_t v) noexcept {
  Quadric q = draft.quadrics[u];
  q += draft.quadrics[v];
  return merge_ends(q, draft.at[u], draft.at[v]);
}

// While slabs are about as small as the source's triangles, one end can mostly be merged into the other as it is. Where
// one way round is too dear or makes slabs too thin the other is tried; what the checks refuse is left to collapse().
bool EdgeOperators::half_edge_collapse(std::uint32_t h, double most) {
  Quadric q = draft_.quadrics[draft_.origin(h)];
  q += draft_.quadrics[draft_.target(h)];
  const Vec3d edge = draft_.at[draft_.target(h)] - draft_.at[draft_.origin(h)];
  struct Way {
    std::uint32_t h;  // into its origin
    double cost;
  };
  const auto way_of = [&](std::uint32_t e) {
    return Way{e, merge_cost(q, draft_.at[draft_.origin(e)], dot(edge, edge))};
  };
  std::array<Way, 2> ways = {way_of(h), way_of(draft_.twins[h])};
  if (std::min(ways[0].cost, ways[1].cost) > kDearer * most || !draft_.link_allows(h)) return false;
  // First the end that has fewer slabs around it goes: they are what has to be tested.
  const int more = draft_.valences[draft_.target(h)] - draft_.valences[draft_.origin(h)];
  if (more > 0 || (more == 0 && ways[1].cost < ways[0].cost)) std::swap(ways[0], ways[1]);
  for (const auto& [way, cost] : ways) {
    if (cost > kDearer * most || !keeps_creases(way, draft_.at[draft_.origin(way)])) continue;
    Star& star = checks_.begin();
    star.set_edge(draft_, way);
    star.fresh = star.second;
    const std::uint32_t kept = draft_.origin(way);
    if (star.fresh == star.faces.size() || star.quality(draft_, draft_.at[kept]).least < kLeastHalfShape) continue;
    if (checks_.check(draft_, draft_.ends[kept]) != Fault::None) return false;
    merge(way, draft_.at[kept]);
    return true;
  }
  return false;
}

bool EdgeOperators::collapse(std::uint32_t h) {
  if (!draft_.link_allows(h)) return false;
  return collapse_somewhere(h, false) || (checks_.tolerance().loss > 0 && collapse_somewhere(h, true));
}

bool EdgeOperators::collapse_somewhere(std::uint32_t h, bool may_lose) {
  Star& star = checks_.begin();
  star.set_edge(draft_, h);
  aim_.reset();
  const Vec3d u = draft_.at[draft_.origin(h)], v = draft_.at[draft_.target(h)];
  const Vec3d best = collapse_cost(draft_, draft_.origin(h), draft_.target(h)).place;
  double before = star.quality_now(draft_).least;
  for (const std::uint32_t f : star.vanished) before = std::min(before, draft_.shape(draft_.faces[f]));
  for (const Vec3d at : {best, u, v, (u + v) * 0.5})
    if ((effort_.thorough || keeps_creases(h, at)) && collapse_to(h, at, before, may_lose)) return true;
  if (!effort_.thorough) return false;
  // Where the source may fold as it likes, a bad shape is no reason to keep a slab.
  const double least = checks_.tolerance().folds_at_will() ? 0 : before;
  const std::vector<LinkEdge> link = star.link(draft_);
  for (const Vec3d start : {best, (u + v) * 0.5})
    if (collapse_to(h, seeing_place(link, start), least, may_lose)) return true;
  return false;
}

bool EdgeOperators::keeps_creases(std::uint32_t h, Vec3d at) const {
  return creases_ == nullptr ||
         (creases_->allow(draft_.at[draft_.origin(h)], at) && creases_->allow(draft_.at[draft_.target(h)], at));
}

bool EdgeOperators::collapse_to(std::uint32_t h, Vec3d at, double shape_before, bool may_lose) {
  const Star& star = checks_.star();
  const double shape = star.quality(draft_, at).least;
  if (shape < kLeastShape && shape < kAsBad * shape_before) return false;
  if (!aim_) aim_ = view_of_source(source_, checks_.held(draft_)).best.d;
  const std::uint32_t u = draft_.origin(h), v = draft_.target(h);
  const Vec3d at_u = normalized(draft_.fibre(u)), at_v = normalized(draft_.fibre(v));
  const std::array<Vec3d, 5> choices = {*aim_, normalized(at_u + at_v), at_u, at_v,
                                        effort_.thorough ? star_direction(star.link(draft_), at).d : Vec3d{}};
  HeightSearch search(draft_, star, u, v, at, std::span(choices).first(effort_.thorough ? 5 : 4), growth_, longest_);
  std::optional<double> spare;  // area that may be lost, once a side would have to grow and cannot
  if (!search.start()) return false;
  int shrunk = 0;
  for (int attempt = 0; attempt < (effort_.patient ? kMostPatientTries : kMostTries); ++attempt) {
    if (!search.fit() && attempt > 0) return false;
    const Fault fault = checks_.check(draft_, search.ends(), spare);
    if (attempt == 0) growth_.learn(fault);
    bool goes_on = true;  // along this direction
    switch (fault) {
      case Fault::None:
        merge(h, at);
        return true;
      case Fault::Jacobian:
        goes_on = ++shrunk <= kMostJacobianShrinks;
        if (goes_on)
          for (const Side side : {kInner, kOuter}) search.shrink(side, kShrinkForJacobian);
        break;
      case Fault::Outer:
      case Fault::Inner: {
        const std::array<double, 2> before = search.heights();
        goes_on = search.grow_clear(fault == Fault::Outer ? kOuter : kInner, checks_);
        if (goes_on || !may_lose || spare) break;
        spare = checks_.tolerance().loss * checks_.held_area();
        goes_on = true;
        search.set_heights(before);
        break;
      }
      case Fault::Empty:
        goes_on = search.grow(kOuter);
        break;
      case Fault::OuterOverlap:
        goes_on = search.shrink(kOuter, kShrinkForOverlap);
        break;
      case Fault::InnerOverlap:
        goes_on = search.shrink(kInner, kShrinkForOverlap);
        break;
      case Fault::Outside:
        return false;
      case Fault::Winding:  // at no height
      case Fault::Folded:
      case Fault::Lost:
        goes_on = false;
        break;
    }
    if (goes_on) continue;
    if (!effort_.patient && fault != Fault::Folded) return false;
    if (!search.next()) return false;
    spare.reset();
    shrunk = 0;
  }
  return false;
}

/// Makes the collapse that was tested last.
void EdgeOperators::merge(std::uint32_t h, Vec3d at) {
  const std::uint32_t u = draft_.origin(h), v = draft_.target(h);
  draft_.collapse(h);
  draft_.quadrics[u] += draft_.quadrics[v];
  draft_.at[u] = at;
  draft_.ends[u] = checks_.ends();
  checks_.commit(draft_);
  draft_.touch(u);
}

bool EdgeOperators::is_worth_flipping(std::uint32_t h) const {
  const std::uint32_t u = draft_.origin(h), v = draft_.target(h);
  const std::uint32_t a = draft_.target(next_of(h)), b = draft_.target(next_of(draft_.twins[h]));
  const auto shape = [&](std::uint32_t i, std::uint32_t j, std::uint32_t k) { return draft_.shape({i, j, k}); };
  const double before = std::min(shape(u, v, a), shape(v, u, b)), after = std::min(shape(u, b, a), shape(b, v, a));
  const std::array<int, 4> degree = {draft_.valences[u], draft_.valences[v], draft_.valences[a], draft_.valences[b]};
  if (degree[0] < kLeastFlipValence || degree[1] < kLeastFlipValence || degree[2] > kMostFlipValence ||
      degree[3] > kMostFlipValence)
    return false;
  const auto off = [](int d) { return std::abs(d - kEvenValence); };
  const int gain = off(degree[0]) + off(degree[1]) + off(degree[2]) + off(degree[3]) - off(degree[0] - 1) -
                   off(degree[1] - 1) - off(degree[2] + 1) - off(degree[3] + 1);
  return after > kFlipGain * before + kFlipGainAtLeast ||
         (gain >= kFlipValenceGain && after > kFlipShapeKept * before && after > kFlipLeastShape);
}

bool EdgeOperators::flip(std::uint32_t h) {
  const std::uint32_t a = draft_.target(next_of(h)), b = draft_.target(next_of(draft_.twins[h]));
  if (!is_worth_flipping(h) || draft_.are_joined(a, b)) return false;
  if (creases_ != nullptr && creases_->hold_edge(draft_.at[draft_.origin(h)], draft_.at[draft_.target(h)]))
    return false;
  Star& star = checks_.begin();
  star.set_flip(draft_, h);
  if (checks_.check(draft_, {}) != Fault::None) return false;
  const std::array<std::uint32_t, 4> corners = {draft_.origin(h), draft_.target(h), a, b};
  draft_.flip(h);
  checks_.commit(draft_);
  for (const std::uint32_t v : corners) draft_.touch(v);
  return true;
}

}  // namespace relief::detail
