#include <relief/base/assert.h>
#include <relief/base/try.h>
#include <relief/edit/stroke.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

namespace relief {

double dab_size(const Brush& brush, double pressure) noexcept {
  return brush.pressure_drives == PressureDrives::Strength ? 1.0 : brush.pressure(pressure);
}

namespace {

constexpr double kDabsPerRadius = 16;   // a groove round a ball of six radii then turns by half a degree per dab
constexpr double kLongestDab = 0.008;   // s: what the hand feels as at once, and a rate takes as even
constexpr double kTap = 0.1;            // s: how long a stroke counts that lasts no time
constexpr double kFarthestTime = 1e12;  // s
// Of the brush's radius, where pressure drives it: a line that is thinner has ended. Below it nothing is done, and dabs
// do not get nearer to each other.
constexpr double kThinnest = 1.0 / 64;
constexpr int kRing = 12;             // places around the tool from which its axis comes
constexpr double kRingRadius = 0.75;  // of the tool's

/// Returns how far the next dab is from one at a pressure of the hand, model units.
double spacing_at(const Brush& brush, double pressure) noexcept {
  return brush.radius * std::max(dab_size(brush, pressure), kThinnest) / kDabsPerRadius;
}

/// Dabs that the way between two points needs for its length; clamped so that it fits an integer.
std::size_t dabs_between(const StrokePoint& a, const StrokePoint& b, const Brush& brush) noexcept {
  const double by_length = length(b.position - a.position) / spacing_at(brush, std::min(a.pressure, b.pressure)),
               by_time = (b.t - a.t) / kLongestDab;
  const double steps = std::ceil(std::max(by_length, by_time));
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
  if (!std::isfinite(brush.detail) || brush.detail < 0)
    return fail(Errc::InvalidArgument, "the stroke's detail must be a share of the radius, 0 or more");
  if (!std::isfinite(brush.height)) return fail(Errc::InvalidArgument, "the stroke's height is not a finite number");
  if (!std::isfinite(brush.stabiliser) || brush.stabiliser < 0)
    return fail(Errc::InvalidArgument, "the stroke's stabiliser must be a length, 0 or more");
  const auto& [low, high, exponent] = brush.pressure;
  if (!(low >= 0 && low < high && high <= 1))
    return fail(Errc::InvalidArgument,
                "the stroke's pressure curve must go from a low to a high pressure within 0 and 1");
  if (!std::isfinite(exponent) || exponent <= 0)
    return fail(Errc::InvalidArgument, "the exponent of the stroke's pressure curve must be a number above 0");
  if (brush.pressure_drives > PressureDrives::Both)
    return fail(Errc::InvalidArgument, "the stroke's pressure drives nothing that there is");
  if (brush.symmetry > 7 || !is_finite(brush.mirror))
    return fail(Errc::InvalidArgument, "the stroke's mirror planes are not planes across x, y or z");
  return {};
}

bool is_finite(const StrokePoint& p) noexcept {
  return std::isfinite(p.t) && relief::is_finite(p.position) && std::isfinite(p.pressure) &&
         std::abs(p.t) <= kFarthestTime;
}

bool sane(const Brush& brush) noexcept { return check(brush).has_value(); }

/// Returns the normal of the surface around a place, averaged over the tool's area: the area vector of what a ring of
/// places around it encloses, whatever lies between them (Stokes). The place's own where the ring finds no such area.
Vec3d averaged_normal(const Snapshot& surface, const SurfacePoint& place, double radius,
                      std::array<PickHint, kRing>& hints) {
  const Vec3d n = place.normal;
  const Vec3d side = normalized(std::abs(n.x) < 0.6 ? cross(n, Vec3d{1, 0, 0}) : cross(n, Vec3d{0, 1, 0}));
  const Vec3d ahead = cross(n, side);
  std::array<Vec3d, kRing> ring{};
  for (int k = 0; k < kRing; ++k) {
    const double turn = 2 * std::numbers::pi * k / kRing;
    const Vec3d at = place.position + (side * std::cos(turn) + ahead * std::sin(turn)) * (radius * kRingRadius);
    const SurfacePoint found = closest_point(surface, at, hints[static_cast<std::size_t>(k)], radius);
    ring[static_cast<std::size_t>(k)] = (found.slab == kNoSlab ? at : found.position) - place.position;
  }
  Vec3d area;
  for (std::size_t k = 0; k < ring.size(); ++k) area += cross(ring[k], ring[(k + 1) % ring.size()]);
  const Vec3d axis = normalized(area);
  // Beside an edge that is sharper than a right angle the ring folds over itself.
  return dot(axis, n) > 0.3 ? axis : n;
}

}  // namespace

Status check(const Stroke& stroke) {
  RELIEF_CHECK(check(stroke.brush));
  std::size_t dabs = 0;
  for (std::size_t k = 0; k < stroke.points.size(); ++k) {
    const StrokePoint& p = stroke.points[k];
    const std::string where = "point " + std::to_string(k + 1) + " of the stroke";
    if (!std::isfinite(p.t) || !relief::is_finite(p.position) || !std::isfinite(p.pressure))
      return fail(Errc::InvalidArgument, where + " holds a number that is not finite");
    if (std::abs(p.t) > kFarthestTime)
      return fail(Errc::InvalidArgument, where + " is at " + number(p.t) + " s, which no stroke lasts to");
    RELIEF_CHECK(check_share("the pressure at " + where, p.pressure));
    if (k > 0 && p.t < stroke.points[k - 1].t)
      return fail(Errc::InvalidArgument, where + " is earlier (" + number(p.t) + " s) than the one before it (" +
                                             number(stroke.points[k - 1].t) + " s)");
    dabs += k == 0 ? 1 : dabs_between(stroke.points[k - 1], p, stroke.brush);
    if (dabs > kMaxStrokeDabs)
      return fail(Errc::InvalidArgument, "the stroke needs more than " + std::to_string(kMaxStrokeDabs) +
                                             " dabs up to " + where +
                                             "; use a larger radius, or a shorter path or time");
  }
  return {};
}

struct StrokeEngine::State {
  explicit State(Editor& e) noexcept : editor(e) {}

  Editor& editor;
  Brush brush;
  bool tip = false;
  SnapshotPtr felt;  ///< null: the surface that the editor began with
  StrokeResult so_far;
  std::function<void(const Dab&, const DabResult&)> on_dab;
  const std::atomic<bool>* cancel = nullptr;  ///< see stop_at()

  std::optional<StrokePoint> last;  ///< of the hand
  double began = 0;                 ///< s
  StrokePoint held;                 ///< of the tool, which trails the hand where there is a stabiliser
  double way = 0, seconds = 0;      ///< of the tool since the last dab
  double spacing = 0;               ///< model units, from the last dab to the next
  bool missed = false;              ///< whether the last dab was out of reach

  /// A dab and its mirror images.
  struct Image {
    bool swept = false;  ///< whether `cursor` and `axis` are those of the dab before
    Vec3d cursor, axis;
    PickHint hint = {}, seat = {};
    std::array<PickHint, kRing> ring = {};
  };
  std::array<Image, 8> images;

  [[nodiscard]] bool stopped() const noexcept { return cancel != nullptr && cancel->load(std::memory_order_relaxed); }

  void begin(const Brush& with, bool at_tip, SnapshotPtr on) {
    editor.begin_stroke(with);
    brush = with;
    tip = at_tip;
    felt = std::move(on);
    so_far = {};
    last.reset();
    way = seconds = 0;
    for (Image& image : images) image.swept = false;
  }

  void take(StrokePoint p) {
    if (!is_finite(p)) return;
    p.pressure = std::clamp(p.pressure, 0.0, 1.0);
    if (!last) {
      last = held = p;
      began = p.t;
      dab(0);
    } else {
      if (p.t < last->t) return;
      follow(p);
      last = p;
    }
    if (missed && so_far.missed == 0) so_far.missed_at = p.position;
    so_far.missed += missed ? 1U : 0U;
  }

  /// The hand goes straight and evenly from `last` to p; the tool trails it by the stabiliser's length: each bit of way
  /// takes it nearer by that bit's share of the length.
  void follow(const StrokePoint& p) {
    const double trail = brush.stabiliser, all = length(p.position - last->position);
    if (!(trail > 0) || all == 0) {
      go({p.t, trail > 0 ? held.position : p.position, p.pressure});
      return;
    }
    const Vec3d along = (p.position - last->position) / all, from = held.position;
    const Vec3d gap = from - last->position + along * trail;
    const double t = last->t, pressure = last->pressure;
    const double closest = spacing_at(brush, std::min(pressure, p.pressure));
    const auto steps = static_cast<std::size_t>(std::ceil(std::min(all / (0.5 * closest), 1e7)));
    for (std::size_t k = 1; k <= steps && !stopped(); ++k) {
      const double share = static_cast<double>(k) / static_cast<double>(steps), s = share * all;
      go({t + (p.t - t) * share, last->position + along * (s - trail) + gap * std::exp(-s / trail),
          pressure + (p.pressure - pressure) * share});
    }
  }

  /// The tool goes straight and evenly to b, with a dab at each radius/16, of the dab before, and each 8 ms.
  void go(const StrokePoint& b) {
    const StrokePoint a = held;
    const double all = length(b.position - a.position), time = std::max(b.t - a.t, 0.0);
    double done = 0;  // share of the way
    while (!stopped()) {
      const double by_way = all > 0 ? (spacing - way) / all : Box3d::kFar;
      const double by_time = time > 0 ? (kLongestDab - seconds) / time : Box3d::kFar;
      const double step = std::max(std::min(by_way, by_time), 0.0);
      if (!(done + step <= 1)) break;
      done += step;
      held = {a.t + time * done, a.position + (b.position - a.position) * done,
              a.pressure + (b.pressure - a.pressure) * done};
      dab(seconds + step * time);
    }
    way += (1 - done) * all;
    seconds += (1 - done) * time;
    held = b;
  }

  /// Where `held` is, and in the mirrors.
  void dab(double lasted) {
    way = seconds = 0;
    spacing = spacing_at(brush, held.pressure);
    missed = true;
    for (std::uint8_t image = 0; image <= brush.symmetry; ++image) {
      if ((image & ~brush.symmetry) != 0) continue;
      Vec3d at = held.position;
      for (std::size_t axis = 0; axis < 3; ++axis)
        if ((image >> axis & 1U) != 0) at[axis] = 2 * brush.mirror[axis] - at[axis];
      if (dab_at(images[image], at, lasted)) missed = false;
    }
  }

  /// False when the place is out of reach.
  bool dab_at(Image& image, Vec3d at, double lasted) {
    const bool was_swept = std::exchange(image.swept, false);
    const Snapshot& surface = felt ? *felt : *editor.start();
    const SurfacePoint place = closest_point(surface, at, image.hint);
    if (place.slab == kNoSlab) return false;
    const SurfacePoint seat = felt ? closest_point(*editor.start(), place.position, image.seat) : place;
    const Vec3d off = at - place.position;
    const bool below = dot(off, place.normal) < 0;
    if (length(off) > brush.radius && !(tip && below)) return false;
    const ToolInfo& tool = info(brush.tool);
    const double size = dab_size(brush, held.pressure), radius = brush.radius * size;
    if (size < kThinnest) return true;
    const bool drives_strength = brush.pressure_drives != PressureDrives::Radius;
    const double pressure = drives_strength ? brush.pressure(held.pressure) : 1.0;
    const double strength = std::clamp(brush.strength, 0.0, 1.0);
    // Only these have an axis; the others need to know which side is out.
    const bool turns = tool.action == Action::Cut || tool.action == Action::Plane;
    const Vec3d axis = turns ? averaged_normal(surface, place, radius, image.ring) : place.normal;
    Dab dab{.slab = seat.slab,
            .contact = place.position,
            .cursor = at,
            .normal = axis,
            .pressure = pressure,
            .seconds = lasted,
            .size = size};
    if (tool.action == Action::Cut) {
      const double deep = tip ? -dot(off, axis) - brush.resilience : strength * pressure * radius;
      // A tool that rests on the surface cuts nothing, also where the surface is hollow.
      if (!(deep > 0)) return true;
      if (!tip) dab.cursor = place.position - axis * (deep + brush.resilience);
      // The sphere has the size of this dab at the other end, too, as deep as the one before was.
      const double rises = radius + brush.resilience;
      const Vec3d centre = dab.cursor + axis * rises;
      dab.from = image.cursor + image.axis * rises;
      // The nearest place may leap, to another limb or round an edge; what lies between is not to be cut then.
      dab.swept = was_swept && length(centre - dab.from) < 0.5 * radius && dot(axis, image.axis) > 0.7;
      image.swept = true;
      image.cursor = dab.cursor;
      image.axis = axis;
    } else if (tool.writes == Layer::Displacement) {
      dab.contact = editor.position(seat.slab, seat.u, seat.v);
    }
    const DabResult result = editor.dab(dab);
    so_far.add(result, dab.contact);
    if (on_dab) on_dab(dab, result);
    return true;
  }

  StrokeResult end() {
    if (last && !stopped()) {
      // The tool catches up with the hand, in no time.
      if (brush.stabiliser > 0) go({held.t, last->position, last->pressure});
      const bool tap = last->t <= began;
      if (tap || way > 0 || seconds > 0) dab(tap ? kTap : seconds);
    }
    StrokeResult result = editor.end_stroke();
    result.missed = so_far.missed;
    result.missed_at = so_far.missed_at;
    last.reset();
    return result;
  }
};

StrokeEngine::StrokeEngine(Editor& editor) : state_(std::make_unique<State>(editor)) {}
StrokeEngine::StrokeEngine(StrokeEngine&&) noexcept = default;
StrokeEngine::~StrokeEngine() = default;

void StrokeEngine::begin(const Brush& brush, bool tip, SnapshotPtr felt) {
  RELIEF_ASSERT(sane(brush));
  state_->begin(brush, tip, std::move(felt));
}

void StrokeEngine::move(std::span<const StrokePoint> points) {
  RELIEF_ASSERT(open());
  for (const StrokePoint& p : points)
    if (!state_->stopped()) state_->take(p);
}

StrokeResult StrokeEngine::end() { return state_->end(); }

void StrokeEngine::cancel() { state_->editor.cancel_stroke(); }

bool StrokeEngine::open() const noexcept { return state_->editor.in_stroke(); }

const StrokeResult& StrokeEngine::so_far() const noexcept { return state_->so_far; }

void StrokeEngine::stop_at(const std::atomic<bool>* flag) noexcept { state_->cancel = flag; }

void StrokeEngine::on_dab(std::function<void(const Dab&, const DabResult&)> call) { state_->on_dab = std::move(call); }

StrokeResult play(Editor& editor, const Stroke& stroke, const Progress& progress) {
  if (!sane(stroke.brush)) return {};
  std::size_t dabs = 0;
  const StrokePoint* before = nullptr;
  for (const StrokePoint& p : stroke.points) {
    if (!is_finite(p)) continue;
    dabs += before == nullptr ? 1 : dabs_between(*before, p, stroke.brush);
    if (dabs > kMaxStrokeDabs) return {};
    before = &p;
  }
  StrokeEngine engine(editor);
  engine.begin(stroke.brush, stroke.tip);
  engine.stop_at(progress.cancel);
  const std::size_t count = stroke.points.size();
  for (std::size_t k = 0; k < count && !progress.cancelled(); ++k) {
    if (k % (1 + count / 100) == 0) progress("stroke", static_cast<double>(k) / static_cast<double>(count));
    engine.move(std::span(stroke.points).subspan(k, 1));
  }
  if (!progress.cancelled()) return engine.end();
  engine.cancel();
  return {};
}

}  // namespace relief
