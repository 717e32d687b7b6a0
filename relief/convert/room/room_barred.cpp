#include <relief/base/assert.h>
#include <relief/convert/geometry/lattice.h>
#include <relief/convert/room.h>
#include <relief/convert/room/fibre_lengthening.h>
#include <relief/convert/room/reach_wanted.h>
#include <relief/convert/room/solids.h>
#include <relief/core/query.h>

#include <algorithm>
#include <optional>
#include <span>
#include <vector>

namespace relief {
namespace {

/// What is in a stroke's way, seen from a place on the surface.
struct Obstacle {
  Vec3d at;             ///< the place
  double distance = 0;  ///< from there to the far side, or to the other part
  double past = 0;      ///< by so much more than half of that the stroke wants to go, twice
};

/// Looks at the form along a stroke's axis. Fibres of both sides share what lies between them, so each side has about
/// half of it.
class Axes {
 public:
  Axes(const Snapshot& surface, const RoomGoals& goals)
      : surface_(surface), negligible_(detail::kNegligible * goals.diagonal), fade_share_(goals.fade_share) {}

  /// From the place where a tool that is at one end of the solid has the surface above its deepest point.
  [[nodiscard]] std::optional<Obstacle> under_cut(const Capsule& solid, Vec3d end) const {
    const Vec3d deepest = end - solid.axis * solid.radius;
    const auto up = surface_above(deepest, solid);
    if (!up) return std::nullopt;
    return ahead(deepest + solid.axis * *up, -solid.axis, *up, true);
  }
  /// From the place from which a solid is to be filled.
  [[nodiscard]] std::optional<Obstacle> over_fill(const Capsule& solid) const {
    const double height = dot(solid.b - solid.a, solid.axis) + solid.radius;
    // A stroke that goes on has raised the surface already.
    const auto below = next(solid.a + solid.axis * negligible_, -solid.axis, false, height);
    const Vec3d at = below ? solid.a - solid.axis * (*below - negligible_) : solid.a;
    return ahead(at, solid.axis, dot(solid.b - at, solid.axis) + solid.radius, false);
  }
  /// From a place on the surface to what bars a stroke that wants to go so far.
  [[nodiscard]] std::optional<Obstacle> ahead(Vec3d at, Vec3d way, double wanted, bool cuts) const {
    const double reach = 2 * wanted / (1 - fade_share_);
    const auto distance = next(at, way, cuts, reach);
    if (!distance) return std::nullopt;
    return Obstacle{at, *distance, reach - *distance};
  }

 private:
  /// Returns the distance at which a ray leaves the form, or enters it; the surface that it starts from does not count.
  [[nodiscard]] std::optional<double> next(Vec3d from, Vec3d way, bool leaves, double reach) const {
    for (double gone = negligible_; gone < reach;) {
      const auto met = raycast(surface_, {from + way * gone, way});
      if (!met) break;
      gone += met->distance;
      if (gone > reach) break;
      if ((dot(met->point.normal, way) > 0) == leaves) return gone;
      gone += negligible_;
    }
    return std::nullopt;
  }
  /// Returns how far above the deepest point of a tool the surface lies that it came from: the last one that is not
  /// above its centre. A tip deep inside has its centre there, too: then the next one.
  [[nodiscard]] std::optional<double> surface_above(Vec3d deepest, const Capsule& solid) const {
    const double most = (1 + detail::kBeside) * solid.radius;
    std::optional<double> above;
    for (double gone = 0;;) {
      const auto more = next(deepest + solid.axis * gone, solid.axis, true, Box3d::kFar);
      if (!more || (above && gone + *more > most)) return above;
      above = gone += *more;
      if (gone > most) return above;
    }
  }

  const Snapshot& surface_;
  double negligible_, fade_share_;
};

/// Where a slab lacks most, how far the stroke goes below or above that place, and what of it goes farthest there.
struct Asked {
  const RoomLack* lack;
  Vec3d way;
  double wanted = 0;
  const Capsule* solid = nullptr;  ///< null where only a leaning fibre meets one
};
Asked asked_at(const RoomLack& lack, std::span<const Capsule> solids) {
  Asked asked = {&lack, normalized(lack.way), length(lack.way), nullptr};
  double farthest = 0;
  for (const Capsule& solid : solids) {
    if (solid.axis == Vec3d{}) continue;
    const Vec3d way = lack.cuts ? -solid.axis : solid.axis;
    const auto met = detail::passage(solid, {lack.near, way});
    if (!met || !(met->to > farthest)) continue;
    farthest = met->to;
    asked = {&lack, way, met->to, &solid};
  }
  return asked;
}

}  // namespace

RoomBarred room_barred(const Snapshot& surface, const RoomWanted& wanted, const RoomMade& made,
                       const RoomGoals& goals) {
  RELIEF_ASSERT(goals.diagonal > 0);
  if (made.after.empty()) return {};
  std::vector<Asked> all;
  for (const RoomLack& lack : made.after) all.push_back(asked_at(lack, lack.cuts ? wanted.cut : wanted.fill));
  const Axes axes(surface, goals);
  struct {
    std::optional<Obstacle> obstacle;
    bool cuts = true;
    void take(const std::optional<Obstacle>& other, bool its_cuts) {
      if (!other || (obstacle && other->past <= obstacle->past)) return;
      obstacle = other;
      cuts = its_cuts;
    }
  } worst;
  // First below the tool itself, where the fibres have no say; then where slabs lack.
  std::vector<const Capsule*> seen;
  for (const Asked& asked : all) {
    if (asked.solid == nullptr || std::ranges::find(seen, asked.solid) != seen.end()) continue;
    const Capsule& solid = *asked.solid;
    seen.push_back(&solid);
    if (asked.lack->cuts)
      for (const Vec3d end : {solid.a, solid.b}) worst.take(axes.under_cut(solid, end), true);
    else
      worst.take(axes.over_fill(solid), false);
  }
  if (!worst.obstacle)
    for (const Asked& asked : all)
      worst.take(axes.ahead(asked.lack->near, asked.way, asked.wanted, asked.lack->cuts), asked.lack->cuts);
  if (worst.obstacle)
    return {worst.cuts ? RoomBar::FarSide : RoomBar::OtherPart, worst.obstacle->distance, worst.obstacle->at};
  return {RoomBar::Fibres, 0, std::ranges::max_element(made.after, {}, &RoomLack::lack)->near};
}

}  // namespace relief
