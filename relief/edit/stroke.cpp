#include <relief/base/assert.h>
#include <relief/base/try.h>
#include <relief/edit/editor.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace relief {

namespace {

/// Dabs of a stretch of the polyline, its end included, its start not; clamped so that it fits an integer.
std::size_t dabs_between(Vec3d a, Vec3d b, double radius) noexcept {
  const double steps = std::ceil(length(b - a) / (radius / 8));
  return steps >= 1 ? static_cast<std::size_t>(std::min(steps, 1e12)) : 1;
}

std::string number(double x) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%g", x);
  return text.data();
}

Status check_share(const std::string& what, double x) {
  if (!std::isfinite(x)) return fail(Errc::InvalidArgument, what + " is not a finite number");
  if (x < 0 || x > 1) return fail(Errc::InvalidArgument, what + " is " + number(x) + ", it must be within 0 and 1");
  return {};
}

Status check(const Brush& brush) {
  if (!std::isfinite(brush.radius)) return fail(Errc::InvalidArgument, "the stroke's radius is not a finite number");
  if (brush.radius <= 0)
    return fail(Errc::InvalidArgument, "the stroke's radius is " + number(brush.radius) + ", it must be above 0");
  RELIEF_CHECK(check_share("the stroke's strength", brush.strength));
  for (const float channel : {brush.colour.x, brush.colour.y, brush.colour.z})
    RELIEF_CHECK(check_share("the stroke's colour", static_cast<double>(channel)));
  if (!std::isfinite(brush.resilience) || brush.resilience < 0)
    return fail(Errc::InvalidArgument, "the stroke's resilience must be a finite number, 0 or more");
  return {};
}

bool is_finite(const StrokePoint& p) noexcept {
  return std::isfinite(p.t) && relief::is_finite(p.position) && std::isfinite(p.pressure);
}

/// One dab at a place of the surface as it stood at the stroke's start.
void dab_at(Editor& editor, const Brush& brush, const SurfacePoint& place, double pressure, double seconds) {
  if (place.slab == kNoSlab) return;  // too far away for any place to be the nearest
  const double p = std::clamp(pressure, 0.0, 1.0), s = std::clamp(brush.strength, 0.0, 1.0);
  // A tool that rests on the surface cuts nothing, also where the surface is hollow.
  if (brush.tool == Tool::Carve && !(s * p > 0)) return;
  Dab dab{.slab = place.slab,
          .contact = place.position,
          .cursor = place.position - place.normal * (s * p * brush.radius + brush.resilience),
          .normal = place.normal,
          .pressure = p,
          .seconds = seconds};
  if (brush.tool == Tool::Deposit) dab.contact = surface_point(*editor.head(), place.slab, place.u, place.v).position;
  editor.dab(dab);
}

}  // namespace

std::optional<Tool> tool_from_name(std::string_view text) noexcept {
  for (const Tool tool : {Tool::Carve, Tool::Deposit, Tool::Paint})
    if (text == name(tool)) return tool;
  return std::nullopt;
}

Status check(const Stroke& stroke) {
  constexpr double kLatest = 1e12;  // s
  RELIEF_CHECK(check(stroke.brush));
  std::size_t dabs = 0;
  for (std::size_t k = 0; k < stroke.points.size(); ++k) {
    const StrokePoint& p = stroke.points[k];
    const std::string where = "point " + std::to_string(k + 1) + " of the stroke";
    if (!is_finite(p)) return fail(Errc::InvalidArgument, where + " holds a number that is not finite");
    if (std::abs(p.t) > kLatest)
      return fail(Errc::InvalidArgument, where + " is at " + number(p.t) + " s, which no stroke lasts to");
    RELIEF_CHECK(check_share("the pressure at " + where, p.pressure));
    if (k > 0 && p.t < stroke.points[k - 1].t)
      return fail(Errc::InvalidArgument, where + " is earlier (" + number(p.t) + " s) than the one before it (" +
                                             number(stroke.points[k - 1].t) + " s)");
    dabs += k == 0 ? 1 : dabs_between(stroke.points[k - 1].position, p.position, stroke.brush.radius);
    if (dabs > kMaxStrokeDabs)
      return fail(Errc::InvalidArgument, "the stroke needs more than " + std::to_string(kMaxStrokeDabs) +
                                             " dabs up to " + where +
                                             " at one every radius/8; use a larger radius or a shorter path");
  }
  return {};
}

bool play(Editor& editor, const Stroke& stroke) {
  const Brush& brush = stroke.brush;
  if (!std::isfinite(brush.radius) || brush.radius <= 0) return false;
  const SnapshotPtr start = editor.head();

  struct Place {
    SurfacePoint at;
    double t, pressure;
  };
  std::vector<Place> places;
  std::size_t dabs = 0;
  for (const StrokePoint& p : stroke.points) {
    if (!is_finite(p)) continue;
    places.push_back({closest_point(*start, p.position), p.t, p.pressure});
    const std::size_t last = places.size() - 1;
    dabs += last == 0 ? 1 : dabs_between(places[last - 1].at.position, places[last].at.position, brush.radius);
    if (dabs > kMaxStrokeDabs) return false;
  }
  if (places.empty()) return false;

  editor.begin_stroke(brush, stroke.label);
  dab_at(editor, brush, places.front().at, places.front().pressure, places.size() == 1 ? 0.1 : 0.0);
  for (std::size_t k = 1; k < places.size(); ++k) {
    const Place &a = places[k - 1], &b = places[k];
    const std::size_t steps = dabs_between(a.at.position, b.at.position, brush.radius);
    const double seconds = std::max(b.t - a.t, 0.0) / static_cast<double>(steps);
    for (std::size_t step = 1; step < steps; ++step) {
      const double f = static_cast<double>(step) / static_cast<double>(steps);
      const Vec3d between = a.at.position + (b.at.position - a.at.position) * f;
      dab_at(editor, brush, closest_point(*start, between), a.pressure + (b.pressure - a.pressure) * f, seconds);
    }
    dab_at(editor, brush, b.at, b.pressure, seconds);
  }
  return editor.end_stroke();
}

}  // namespace relief
