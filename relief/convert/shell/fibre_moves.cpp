#include <relief/convert/shell/fibre_direction.h>
#include <relief/convert/shell/fibre_height.h>
#include <relief/convert/shell/fibre_moves.h>

#include <algorithm>
#include <array>
#include <vector>

namespace relief::detail {
namespace {

/// Of the whole way to where a fibre is wanted; what comes first is tried first.
constexpr std::array<double, 3> kShares = {1.0, 0.5, 0.25};
/// Visibility, a sine, that a turn must gain: less is not worth testing a star.
constexpr double kWorthATurn = 0.01;
/// The least gain of Quality that makes a slide worth its tests, by quality_of().
constexpr double kWorthASlide = 0.01;

/// Whether snap() leaves a place where it is, but for rounding: an end that it does not bends its fibre.
bool is_on_lattice(Vec3d p) noexcept {
  return std::min({p.x, p.y, p.z}) >= 0 && std::max({p.x, p.y, p.z}) <= Lattice::kSpan;
}

LatticePoint shifted(LatticePoint p, Vec3d by) noexcept { return snap(to_double(p) + by); }

/// Mostly the worst triangle, and a little of all: a slide may not buy the mean with the worst one.
constexpr double kOfTheMean = 0.3;
double value_of(const Quality& q) noexcept { return q.least + kOfTheMean * q.mean; }

}  // namespace

void FibreMoves::begin(std::uint32_t v) { checks_.begin().set_fibre(draft_, v); }

/// Makes the move of the star in hand if all tests pass.
bool FibreMoves::try_ends(Vec3d at, const Ends& ends) {
  if (length(to_double(ends[kOuter] - ends[kInner])) > longest_) return false;
  std::optional<double> spare;
  if (const double lost = checks_.lost_now(draft_); lost > 0) spare = lost;
  if (!checks_.passes(draft_, ends, spare)) return false;
  const std::uint32_t v = checks_.star().moved;
  draft_.at[v] = at;
  draft_.ends[v] = ends;
  checks_.commit(draft_);
  draft_.touch(v);
  return true;
}

bool FibreMoves::re_aim(std::uint32_t v) {
  begin(v);
  return turn_to_source();
}

void FibreMoves::improve(std::uint32_t v) {
  begin(v);
  turn_to_source();
  slide_to_middle();
  trim();
}

bool FibreMoves::turn_to_source() {
  const std::uint32_t v = checks_.star().moved;
  const SourceView view = view_of_source(source_, checks_.held(draft_));
  if (!(view.best.visibility > view.visibility(normalized(draft_.fibre(v))) + kWorthATurn)) return false;
  return turn_towards(view.best.d);
}

bool FibreMoves::turn(std::uint32_t v, Vec3d to, int halvings) {
  begin(v);
  return turn_towards(to, halvings);
}

/// About its place, as far as that goes.
bool FibreMoves::turn_towards(Vec3d to, int halvings) {
  const std::uint32_t v = checks_.star().moved;
  const Vec3d d = normalized(draft_.fibre(v)), at = draft_.at[v];
  const double depth = dot(at - to_double(draft_.ends[v][kInner]), d),
               height = dot(to_double(draft_.ends[v][kOuter]) - at, d);
  double share = 1;
  for (int k = 0; k <= halvings; ++k, share *= 0.5) {
    const Vec3d turned = normalized(d * (1 - share) + to * share);
    if (try_ends(at, {snap(at - turned * depth), snap(at + turned * height)})) return true;
  }
  return false;
}

/// Across itself towards the middle of its neighbours, where that makes the triangles around it better shaped.
void FibreMoves::slide_to_middle() {
  constexpr std::array<double, 2> kSlides = {0.6, 0.3};
  const Star& star = checks_.star();
  const std::uint32_t v = star.moved;
  if (is_on_crease(v)) return;
  Vec3d mean;
  for (const Face& f : star.faces) mean += draft_.at[f[1]] / double(star.faces.size());
  const Vec3d d = normalized(draft_.fibre(v));
  Vec3d step = mean - draft_.at[v];
  step = step - d * dot(step, d);
  const double before = value_of(star.quality_now(draft_));
  for (const double share : kSlides) {
    const Vec3d by = step * share;
    if (value_of(star.quality(draft_, draft_.at[v] + by)) < before + kWorthASlide) continue;
    if (try_ends(draft_.at[v] + by, {shifted(draft_.ends[v][kInner], by), shifted(draft_.ends[v][kOuter], by)})) return;
  }
}

/// Growing on demand leaves fibres too long, and long ones make collapses fail.
void FibreMoves::trim() {
  constexpr double kShortest = 1e-3;  // of the longest fibre: one shorter than that stays
  constexpr double kLess = 0.4;       // of a side
  const std::uint32_t v = checks_.star().moved;
  if (!(length(draft_.fibre(v)) > kShortest * longest_)) return;
  const auto shortened = [&](Side side) {
    return shifted(draft_.ends[v][side], (draft_.at[v] - to_double(draft_.ends[v][side])) * kLess);
  };
  const LatticePoint in = shortened(kInner), out = shortened(kOuter);
  if (!try_ends(draft_.at[v], {in, out}) && !try_ends(draft_.at[v], {draft_.ends[v][kInner], out}))
    try_ends(draft_.at[v], {in, draft_.ends[v][kOuter]});
}

void FibreMoves::settle(std::uint32_t v) {
  begin(v);
  const Vec3d now = draft_.at[v], in = to_double(draft_.ends[v][kInner]), out = to_double(draft_.ends[v][kOuter]);
  const Vec3d d = normalized(out - in);
  const double depth = dot(now - in, d), height = dot(out - now, d);
  const std::vector<LinkEdge> link = checks_.star().link(draft_);
  double least = 1;
  for (const LinkEdge& edge : link) {
    const Vec3d n = cross(edge.from - now, edge.to - now);
    if (const double size = length(n); size > 0) least = std::min(least, dot(n, d) / size);
  }
  const Vec3d step = is_on_crease(v) ? Vec3d{} : seeing_place(link, now) - now;
  for (const double share : kShares) {
    const Vec3d at = now + step * share;
    const Direction there = star_direction(link, at);
    if (there.visibility < least + kWorthATurn) continue;
    if (try_ends(at, {snap(at - there.d * depth), snap(at + there.d * height)})) return;
    if (try_ends(at, {snap(in + step * share), snap(out + step * share)})) return;
  }
  const Direction seen = star_direction(link, now);
  if (seen.visibility < least + kWorthATurn) return;
  for (const double share : kShares) {
    const Vec3d turned = normalized(d * (1 - share) + seen.d * share);
    if (try_ends(now, {snap(now - turned * depth), snap(now + turned * height)})) return;
  }
}

void FibreMoves::even_out(std::uint32_t v) {
  constexpr std::array<double, 3> kSteps = {1.0, 0.5, 0.2};
  if (is_on_crease(v)) return;
  begin(v);
  const std::vector<LinkEdge> link = checks_.star().link(draft_);
  std::array<Vec3d, 2> middle;
  for (const LinkEdge& edge : link) middle[edge.side] += edge.from / double(checks_.star().faces.size());
  const Vec3d now = draft_.at[v];
  const Ends old = draft_.ends[v];
  for (const double share : kSteps) {
    Ends moved = old;
    Vec3d by;
    for (const Side side : {kInner, kOuter}) {
      const Vec3d step = (middle[side] - to_double(old[side])) * share;
      moved[side] = snap(to_double(old[side]) + step);
      by += step * 0.5;
    }
    if (try_ends(now + by, moved)) return;
    if (try_ends(now, {old[kInner], moved[kOuter]}) || try_ends(now, {moved[kInner], old[kOuter]})) return;
  }
}

void FibreMoves::lengthen(std::uint32_t v, double share) {
  constexpr double kWorthIt = 0.05;  // of the fibre
  begin(v);
  const Vec3d in = to_double(draft_.ends[v][kInner]), out = to_double(draft_.ends[v][kOuter]), d = out - in;
  const double most = kJustBelow * longest_ / length(d) - 1;
  if (most < kWorthIt) return;
  const double both = std::min(share, most / 2), one = std::min(share, most);
  if (try_ends(draft_.at[v], {snap(in - d * both), snap(out + d * both)})) return;
  if (try_ends(draft_.at[v], {draft_.ends[v][kInner], snap(out + d * one)})) return;
  try_ends(draft_.at[v], {snap(in - d * one), draft_.ends[v][kOuter]});
}

bool FibreMoves::extend(std::uint32_t v, Side side, double steps, double least) {
  constexpr int kHalvings = 3;  // of a step that fails
  begin(v);
  const Vec3d d = normalized(draft_.fibre(v)) * (side == kOuter ? 1.0 : -1.0);
  for (int k = 0; k <= kHalvings && steps >= least; ++k, steps *= 0.5) {
    Ends ends = draft_.ends[v];
    const Vec3d to = to_double(ends[side]) + d * steps;
    if (!is_on_lattice(to)) continue;
    ends[side] = snap(to);
    if (ends[side] != draft_.ends[v][side] && try_ends(draft_.at[v], ends)) return true;
  }
  return false;
}

bool FibreMoves::put(std::uint32_t v, Vec3d at, const Ends& ends) {
  begin(v);
  return try_ends(at, ends);
}

bool FibreMoves::reach_to(std::uint32_t v, const std::array<double, 2>& reach) {
  begin(v);
  const Vec3d d = normalized(draft_.fibre(v)), at = draft_.at[v];
  const Vec3d in = at - d * reach[kInner], out = at + d * reach[kOuter];
  return is_on_lattice(in) && is_on_lattice(out) && try_ends(at, {snap(in), snap(out)});
}

}  // namespace relief::detail
