#include <relief/convert/shell/fibre_height.h>

#include <algorithm>

namespace relief::detail {
namespace {

/// A step up: this factor and this share of the old fibres' mean length, so that short sides grow quickly, too.
constexpr double kGrow = 1.35, kGrowByThickness = 0.1;
/// A step that changes a height by less than this share of it leads nowhere.
constexpr double kHardly = 0.02;
/// A side starts with this share of the old fibres' mean length at least.
constexpr double kLeastStart = 0.25;
/// A step towards an end of the interval goes this share of the way.
constexpr double kHalfWay = 0.5;

}  // namespace

double HeightInterval::nearest(double height) const noexcept {
  constexpr double kMargin = 0.02;  // of the interval, or of the height: at its very ends the Jacobian is zero
  const double margin = kMargin * std::min(most - least, height);
  return std::clamp(height, least + margin, std::max(least + margin, most - margin));
}

std::optional<std::array<HeightInterval, 2>> heights_along(const LinkedDraft& draft, const Star& star, Vec3d at,
                                                           Vec3d d) noexcept {
  std::array<HeightInterval, 2> heights;
  for (std::size_t k = star.fresh; k < star.faces.size(); ++k) {
    const Face& f = star.faces[k];
    const std::array<Vec3d, 2> fibres = {draft.fibre(f[1]), draft.fibre(f[2])};
    for (const Side side : {kInner, kOuter}) {
      const Vec3d b = to_double(draft.ends[f[1]][side]) - at, c = to_double(draft.ends[f[2]][side]) - at;
      // The triangle from the fibre's end, at the height h, to b and c has the normal n - h turn.
      const Vec3d n = cross(b, c), turn = cross(b - c, d) * (side == kOuter ? 1.0 : -1.0);
      if (!(dot(n, d) > 0)) return std::nullopt;
      for (const Vec3d fibre : fibres) {
        const double upright = dot(n, fibre), per_height = dot(turn, fibre);
        if (per_height > 0) {
          heights[side].most = std::min(heights[side].most, upright / per_height);
        } else if (per_height < 0) {
          heights[side].least = std::max(heights[side].least, upright / per_height);
        } else if (upright <= 0) {
          return std::nullopt;
        }
      }
      if (!(heights[side].least < heights[side].most)) return std::nullopt;
    }
  }
  return heights;
}

void StartGrowth::learn(Fault fault) noexcept {
  constexpr double kUp = 1.1, kDown = 0.97, kMost = 1.5;
  if (fault == Fault::Outer || fault == Fault::Inner) {
    double& growth = growth_[fault == Fault::Outer ? kOuter : kInner];
    growth = std::min(kMost, growth * kUp);
  } else {
    for (double& growth : growth_) growth = std::max(1.0, growth * kDown);
  }
}

HeightSearch::HeightSearch(const LinkedDraft& draft, const Star& star, std::uint32_t u, std::uint32_t v, Vec3d at,
                           std::span<const Vec3d> directions, const StartGrowth& growth, double longest) noexcept
    : draft_(draft),
      star_(star),
      old_{draft.ends[u], draft.ends[v]},
      at_(at),
      directions_(directions),
      growth_(growth),
      longest_(longest),
      thickness_((length(draft.fibre(u)) + length(draft.fibre(v))) * 0.5) {}

bool HeightSearch::start() {
  for (; choice_ < directions_.size(); ++choice_) {
    const Vec3d d = directions_[choice_];
    const auto found = heights_along(draft_, star_, at_, d);
    if (!found) continue;
    intervals_ = *found;
    for (const Side side : {kInner, kOuter}) {
      const double sign = side == kOuter ? 1 : -1;
      const double mean =
          0.5 * sign * (dot(to_double(old_[0][side]) - at_, d) + dot(to_double(old_[1][side]) - at_, d));
      heights_[side] = intervals_[side].nearest(std::max(mean, kLeastStart * thickness_) * growth_.of(side));
    }
    return true;
  }
  return false;
}

bool HeightSearch::fit() noexcept {
  const double sum = heights_[kInner] + heights_[kOuter];
  if (!(sum > kJustBelow * longest_)) return true;
  for (double& height : heights_) height *= kJustBelow * longest_ / sum;
  return false;
}

bool HeightSearch::grow(Side side) noexcept {
  const double before = heights_[side];
  heights_[side] =
      std::min(kGrow * before + kGrowByThickness * thickness_, kHalfWay * (before + intervals_[side].most));
  return heights_[side] > (1 + kHardly) * before;
}

bool HeightSearch::shrink(Side side, double share) noexcept {
  const double before = heights_[side];
  heights_[side] = std::max(share * before, kHalfWay * (before + intervals_[side].least));
  return heights_[side] < (1 - kHardly) * before;
}

bool HeightSearch::grow_clear(Side side, const SlabChecks& checks) noexcept {
  const auto is_clear = [&](double height) { return checks.would_clear(side, end_at(side, height)); };
  if (!is_clear(std::min(intervals_[side].most, longest_))) return false;
  while (grow(side))
    if (is_clear(heights_[side])) return true;
  return false;
}

}  // namespace relief::detail
