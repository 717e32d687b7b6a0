#include <relief/convert/room/solids.h>

#include <algorithm>
#include <cmath>

namespace relief::detail {
namespace {

/// Returns where |o + t d| <= r.
std::optional<Passage> within(Vec3d o, Vec3d d, double radius) noexcept {
  const double a = dot(d, d), b = dot(o, d), c = dot(o, o) - radius * radius;
  const double square = b * b - a * c;
  if (!(a > 0) || square < 0) return std::nullopt;
  const double root = std::sqrt(square);
  return Passage{(-b - root) / a, (-b + root) / a};
}

}  // namespace

std::optional<Passage> passage(const Capsule& capsule, const Line& line) noexcept {
  std::optional<Passage> all;
  const auto add = [&](Passage p) { all = all ? Passage{std::min(all->from, p.from), std::max(all->to, p.to)} : p; };
  for (const Vec3d end : {capsule.a, capsule.b})
    if (const auto p = within(line.origin - end, line.direction, capsule.radius)) add(*p);
  const Vec3d along = capsule.b - capsule.a;
  const double square = dot(along, along);
  if (!(square > 0)) return all;
  // Between the ends: the cylinder, seen along its axis, and cut off at the planes through the ends.
  const Vec3d o = line.origin - capsule.a, d = line.direction;
  const double from = dot(o, along) / square, per = dot(d, along) / square;
  const Vec3d across_o = o - along * from, across_d = d - along * per;
  auto p = within(across_o, across_d, capsule.radius);
  if (!p) return all;
  if (per != 0) {
    const double first = -from / per, second = (1 - from) / per;
    p->from = std::max(p->from, std::min(first, second));
    p->to = std::min(p->to, std::max(first, second));
  } else if (from < 0 || from > 1) {
    return all;
  }
  if (p->from <= p->to) add(*p);
  return all;
}

bool is_in(std::span<const Capsule> capsules, Vec3d p) noexcept {
  return std::ranges::any_of(capsules, [&](const Capsule& c) {
    const Vec3d along = c.b - c.a;
    const double square = dot(along, along);
    const double share = square > 0 ? std::clamp(dot(p - c.a, along) / square, 0.0, 1.0) : 0.0;
    const Vec3d away = p - c.a - along * share;
    return dot(away, away) <= c.radius * c.radius;
  });
}

Box3d box_of(const Capsule& capsule) noexcept {
  const Vec3d reach = {capsule.radius, capsule.radius, capsule.radius};
  Box3d box;
  for (const Vec3d end : {capsule.a, capsule.b}) {
    box.add(end - reach);
    box.add(end + reach);
  }
  return box;
}

std::vector<Capsule> on_lattice(std::span<const Capsule> capsules, const Lattice& lattice) {
  std::vector<Capsule> all;
  all.reserve(capsules.size());
  for (const Capsule& c : capsules)
    all.push_back({lattice.to_lattice(c.a), lattice.to_lattice(c.b), c.radius / lattice.step, c.axis});
  return all;
}

}  // namespace relief::detail
