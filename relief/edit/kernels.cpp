#include <relief/base/lanes.h>
#include <relief/edit/kernels.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace relief::detail {

GridWeights weights_in_whole(int n, const RootPlace& part) {
  GridWeights made;
  const double steps = static_cast<double>(n) * (1 << part.level);
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i + j <= n; ++i) {
      const std::array<int, 3> w = part.in_root(weights(n, {i, j}));
      for (std::size_t k = 0; k < 3; ++k) made[k].push_back(static_cast<float>(w[k] / steps));
    }
  for (std::vector<float>& plane : made) plane.resize(plane.size() + kOverrun);
  return made;
}

GridTables::GridTables(int n) : weights(weights_in_whole(n)) {
  for (int k = 0; k < 3; ++k)
    for (int t = 0; t <= n; ++t)
      edges[static_cast<std::size_t>(k)].push_back(static_cast<std::uint16_t>(sample_index(n, edge_point(n, k, t))));
}

BorderTables::BorderTables(int n) {
  constexpr std::array<GridPoint, 6> kWays = {{{1, 0}, {0, 1}, {-1, 1}, {-1, 0}, {0, -1}, {1, -1}}};
  const auto inside = [&](GridPoint p) { return p.i >= 0 && p.j >= 0 && p.i + p.j <= n; };
  for (int edge = 0; edge < 3; ++edge)
    for (int t = 0; t < n; ++t) {
      const GridPoint p = edge_point(n, edge, t);
      std::size_t first = 0;
      while (inside(p + kWays[(first + 5) % 6]) || !inside(p + kWays[first])) ++first;
      std::vector<std::int32_t> found;
      for (std::size_t k = first; k < first + 6 && inside(p + kWays[k % 6]); ++k)
        found.push_back(static_cast<std::int32_t>(sample_index(n, p + kWays[k % 6])));
      const std::array<float, 4> shares =
          found.size() == 4 ? std::array<float, 4>{1, 2, 2, 1} : std::array<float, 4>{1, 1, 0, 0};
      own.push_back(static_cast<std::int32_t>(sample_index(n, p)));
      for (std::size_t k = 0; k < 4; ++k) {
        ring[k].push_back(found[std::min(k, found.size() - 1)]);
        share[k].push_back(shares[k]);
      }
    }
}

Resampling::Resampling(int n, int m) {
  for (int j = 0; j <= m; ++j)
    for (int i = 0; i + j <= m; ++i) {
      const GridCell cell = cell_at(n, static_cast<double>(i) / m, static_cast<double>(j) / m);
      for (std::size_t k = 0; k < 3; ++k) {
        index[k].push_back(static_cast<std::int32_t>(sample_index(n, cell.corners[k])));
        weight[k].push_back(static_cast<float>(cell.weights[k]));
      }
    }
}

namespace {
/// To float, within what a later square can hold; beyond it no tool reaches.
float narrow(double x) noexcept { return static_cast<float>(std::clamp(x, -1e15, 1e15)); }
}  // namespace

SlabFrame::SlabFrame(const SlabCorners& root, Vec3d origin, double radius, const GridWeights& weights) noexcept {
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t corner = root.order[k];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      inner[k][axis] = narrow((root.inner[corner][axis] - origin[axis]) / radius);
      direction[k][axis] = narrow((root.outer[corner][axis] - root.inner[corner][axis]) / radius);
    }
    weight[k] = weights[corner].data();
  }
}

namespace {

/// Three weighted corners, in a fixed order.
[[gnu::always_inline]] inline Vec3f mix3(const std::array<Vec3f, 3>& ends, float a, float b, float c) noexcept {
  return (ends[0] * a + ends[1] * b) + ends[2] * c;
}

/// The interpolated fibre of a sample.
struct SampleFibre {
  Vec3f inner, along;
};
/// Reads a frame sample by sample; all in registers.
struct FrameReader {
  std::array<Vec3f, 3> inner, direction;
  const float *wa, *wb, *wc, *spaces;
  float space_unit;
  [[gnu::always_inline]] explicit FrameReader(const SlabFrame& frame) noexcept
      : inner(frame.inner),
        direction(frame.direction),
        wa(frame.weight[0]),
        wb(frame.weight[1]),
        wc(frame.weight[2]),
        spaces(frame.space),
        space_unit(frame.space_unit) {}
  [[gnu::always_inline]] [[nodiscard]] SampleFibre fibre(std::size_t k) const noexcept {
    return {mix3(inner, wa[k], wb[k], wc[k]), mix3(direction, wa[k], wb[k], wc[k])};
  }
  [[gnu::always_inline]] [[nodiscard]] float space(std::size_t k) const noexcept { return space_unit * spaces[k]; }
};

/// 1 - exp(-x) for x >= 0: never falls, within 1e-7 for x <= 0.1, within 0.003 everywhere.
[[gnu::always_inline]] inline float share_of(float x) noexcept {
  const float power = x * (1.0F + x * (0.5F + x * (1.0F / 6 + x * (1.0F / 24))));
  return power / (1.0F + power);
}

[[gnu::always_inline]] inline float larger(float a, float b) noexcept { return a > b ? a : b; }
[[gnu::always_inline]] inline float smaller(float a, float b) noexcept { return a < b ? a : b; }

/// Returns how much is the last of what was `all` at the stroke's start; `cell`: the spacing in the same unit, be it
/// a share of the fibre or a length.
[[gnu::always_inline]] inline float fade_of(float all, float cell) noexcept {
  return smaller(larger(kFadeShare * all, kFadeSpacings * cell), 0.5F * all);
}

/// The lift alone keeps the ball out of the last of the clay, so that the floor stays a ball. What a blend takes below
/// it, and a mask that halves the lift, have this part of it to fade out in.
constexpr float kBlendFade = 0.25F;

/// The cutter at one sample.
struct Meeting {
  Vec3f out;           ///< from the centre of the ball that is nearest to the start's surface there
  float outside;       ///< the square of its length, less 1
  float fibre_square;  ///< the square of the fibre's length
  float inwards;       ///< what `outside` falls along the fibre: at the start, or from inside the ball to its entry
  float gap;           ///< from the start to where the fibre enters that ball, in shares of it
  int hit;             ///< whether it does
  float inside;        ///< how far inside the ball's outline as seen along the fibre, near it; below 0 outside
  float along;         ///< dot of fibre and `out`
};
/// Says how the ball is swept. The share of the sweep that counts at a place, counted from its centre, is
/// dot(place, per_way) + before.
struct Sweep {
  Vec3f along, per_way;
  float before;
};
/// Returns a ball that stands has none. Places count as deep as the ball's lowest point: of a tool that goes straight
/// down the lower ball counts, wherever the surface was.
Sweep sweep_of(const Cutter& cutter) noexcept {
  const float square = dot(cutter.along, cutter.along);
  const Vec3f way = square > 1e-12F ? cutter.along / square : Vec3f{};
  const float climb = dot(way, cutter.up);
  return {cutter.along, way - cutter.up * climb, -climb};
}
// Only the swept ball beside the sample counts, or the nearer end. With D the fibre, it is met where
// D.D t^2 + 2 D.out t + C = 0, counted from the start. The lowest point as origin keeps C small at the cut; of the two
// forms of t, that is taken which does not cancel. A ball that ends before the fibre begins is not met.
[[gnu::always_inline]] inline Meeting meet(const SampleFibre& f, float start, Vec3f up, const Sweep& swept) noexcept {
  const Vec3f place = f.inner + f.along * start;
  const float share = smaller(larger(dot(place, swept.per_way) + swept.before, 0.0F), 1.0F);
  const Vec3f from_lowest = place - swept.along * share, out = from_lowest - up;
  const float along = dot(f.along, out), square = dot(f.along, f.along);
  const float c = dot(from_lowest, from_lowest) - 2 * dot(from_lowest, up);
  const float found = along * along - square * c;
  const float root = std::sqrt(larger(found, 0.0F));
  const float above = along < 0 ? c : -(root + along), below = along < 0 ? root - along : square;
  const int hit = static_cast<int>(found >= 0) & static_cast<int>(root - along + start * square >= 0);
  return {out, c, square, larger(root, -along) - along, above / below, hit, 0.5F * found / square, along};
}

/// What normals of samples on a ball may be off by, for they are those of facets: in radians, on a ball of a radius of
/// one spacing. Angles below that ask for no blend, so that an older cut of the same ball stays as it is.
constexpr float kFacetNormal = 0.25F;
/// A fibre that stands at no more than this above the surface is taken to stand so: what it would have to go grows
/// without bound.
constexpr float kSteepest = 0.1F;  // cosine between fibre and normal

/// In radii: so far inside its outline, as seen along the fibre, the ball's wall becomes steeper than 70 degrees.
constexpr float kWall = 1.0F / 16;

/// Returns where a fibre enters the ball below the start, in shares of the fibre; 0 where it does not. A wall that
/// stands along the fibres has teeth as wide as the spacing, for each of them is in or out. There it becomes a ramp,
/// from `width` inside the outline, at most kWall, to half of that outside. `top`: what the blend takes of the ramp's
/// upper end.
[[gnu::always_inline]] inline float ramped(const Meeting& met, float start, float width, float top) noexcept {
  const float within = smaller(kWall, width), beyond = 0.5F * width;
  // Beside the outline the ball counts as so much larger that the fibre enters it where the ramp begins.
  const float lacks = larger(within - met.inside, 0.0F), c = met.outside - 2.0F * lacks;
  const float root = std::sqrt(larger(2.0F * (met.inside + lacks) * met.fibre_square, 0.0F));
  const bool inwards = met.along < 0;
  const float entry = (inwards ? c : -(root + met.along)) / (inwards ? root - met.along : met.fibre_square);
  const float share = larger(1.0F - lacks / larger(within + beyond, 1e-9F), 0.0F);
  const float soft = share * share * (3.0F - 2.0F * share);
  // A ball that ends before the fibre begins is not met.
  return root - met.along + start * met.fibre_square >= 0 ? smaller(entry + (1.0F - soft) * top, 0.0F) * soft : 0.0F;
}

/// Where a fibre leaves the blend of the start's surface with the ball, from the start, in shares of the fibre; the
/// start or the ball itself where they are farther apart. `gap`: where the fibre enters the ball if that is below the
/// start, else 0; `climb`: of the fibre along the start's normal; `per_two`: one over twice how far the start lies
/// below the ball's centre along it; `width`: of the blend along the normal.
// A place t along the fibre lies climb t above the start, and q t - clear beyond the ball's wall, both along the
// normal. The blend is where the larger one, plus max(width - |their difference|, 0)^2 / (4 width), is 0. So its body
// does not depend on how fibres stand, and fibres that pass the ball by meet it, too. From inside the ball, q is that
// of the chord, so that t is the gap where the blend ends. Without a width, the gap is taken in any case.
[[gnu::always_inline]] inline float blended(const Meeting& met, float gap, float climb, float per_two,
                                            float width) noexcept {
  const float clear = met.outside * per_two, left = larger(width - clear, 0.0F);
  const float one = larger(met.inwards * per_two * left + climb * clear, 0.0F), other = climb * width;
  const float blend = left * left / ((one + other) + 2.0F * std::sqrt(one * other));
  return climb * gap <= -width ? gap : smaller(-blend, gap);
}

[[gnu::always_inline]] inline bool cut_body(const SlabFrame& frame, const Cutter& cutter, const Start& start,
                                            const float* __restrict protect, const float* __restrict from,
                                            float* __restrict to, std::size_t count) noexcept {
  const FrameReader read(frame);
  const Vec3f up = cutter.up;
  const Sweep sweep = sweep_of(cutter);
  const float* __restrict alpha = start.displacement;
  const float* __restrict nx = start.x;
  const float* __restrict ny = start.y;
  const float* __restrict nz = start.z;
  const float blends = cutter.exact ? 0.0F : 3 * kWidestBlend;
  float least_climb = 0;
  std::uint32_t beside = 0;
  for (const Vec3f fibre : frame.direction) least_climb = larger(least_climb, kSteepest * length(fibre));
  RELIEF_VECTORS
  for (std::size_t k = 0; k < count; ++k) {
    const SampleFibre f = read.fibre(k);
    const float a = alpha[k], space = read.space(k);
    const Meeting met = meet(f, a, up, sweep);
    const Vec3f normal = {nx[k], ny[k], nz[k]};
    const float climb = larger(dot(f.along, normal), least_climb);
    const float down = -dot(met.out, normal), per_two = 0.5F / larger(down, 1e-9F);
    const float side = std::sqrt(std::abs(met.outside + (1.0F - down * down)));  // below 0 by rounding alone
    const float slope = smaller(larger((side + side) * per_two - kFacetNormal * space, 0.0F), kSteepestRim);
    const float blend = smaller(larger(blends - 2.0F * space, 0.0F), space);
    const float width = blend * slope, gap = ramped(met, a, blend, width / climb);
    const float lowest = a + blended(met, gap, climb, per_two, width);
    const float fade = kBlendFade * fade_of(a * climb, space), low = lowest * climb;
    const float faded = fade * fade / ((2.0F * fade - low) * climb);
    const float kept = low < fade ? faded : lowest;
    const float part = a + (kept - a) * (1.0F - protect[k]);
    to[k] = smaller(part, from[k]);
    // A blend of width h ends within 1.1 h of the ball.
    const float high = larger(dot(met.out, up), 0.0F);
    const float reach = 1.0F + smaller(kTold, kToldSpacings * space) + 1.1F * blend;
    const int taken = static_cast<int>(smaller(met.inside, -gap) > 0) & static_cast<int>(protect[k] < 1);
    beside |= static_cast<std::uint32_t>(taken & static_cast<int>(met.outside + 1.0F - high * high > reach * reach));
  }
  return beside != 0;
}

[[gnu::always_inline]] inline Lift lift_body(const SlabFrame& frame, const Cutter& cutter,
                                             const float* __restrict start, const float* __restrict protect,
                                             std::uint8_t* __restrict over, std::size_t count) noexcept {
  const FrameReader read(frame);
  const Vec3f up = cutter.up;
  const Sweep sweep = sweep_of(cutter);
  std::int32_t most = 0;  // lifts are not negative, so their bits sort as they do, and integers may come in any order
  std::uint32_t limited = 0;
  RELIEF_VECTORS
  for (std::size_t k = 0; k < count; ++k) {
    const SampleFibre f = read.fibre(k);
    const Meeting met = meet(f, start[k], up, sweep);
    const float at = start[k] + met.gap;
    const int cuts = met.hit & static_cast<int>(met.gap < 0) & static_cast<int>(protect[k] < 1);
    const float fade = fade_of(start[k], read.space(k) / std::sqrt(met.fibre_square));
    const float kept = fade * fade / larger(2.0F * fade - at, 1e-9F);
    const float lift = (kept - at) * dot(f.along, up) * (1.0F - protect[k]);
    const int late = cuts & static_cast<int>(at < fade);
    const int beyond = late & (static_cast<int>(at < 0) | static_cast<int>(lift > kTold));
    over[k] = static_cast<std::uint8_t>(beyond);
    limited += static_cast<std::uint32_t>(beyond);
    const auto bits = std::bit_cast<std::int32_t>(late != 0 ? lift : 0.0F);
    most = bits > most ? bits : most;
  }
  return {std::bit_cast<float>(most), limited};
}

template <Falloff kFalloff>
[[gnu::always_inline]] inline float falloff_of(float square) noexcept {
  const float left = larger(1.0F - square, 0.0F);
  if constexpr (kFalloff == Falloff::Linear) return larger(1.0F - std::sqrt(square), 0.0F);
  if constexpr (kFalloff == Falloff::Smooth) return left * left;
  return std::sqrt(left);
}

template <Falloff kFalloff>
[[gnu::always_inline]] inline void weigh_by(const SlabFrame& frame, const float* __restrict displacement,
                                            const float* __restrict protect, float* __restrict to,
                                            std::size_t count) noexcept {
  const FrameReader read(frame);
  RELIEF_VECTORS
  for (std::size_t k = 0; k < count; ++k) {
    const SampleFibre f = read.fibre(k);
    const Vec3f p = f.inner + f.along * displacement[k];
    to[k] = falloff_of<kFalloff>(dot(p, p)) * (1.0F - protect[k]);
  }
}
[[gnu::always_inline]] inline void weigh_body(const SlabFrame& frame, Falloff falloff, const float* displacement,
                                              const float* protect, float* to, std::size_t count) noexcept {
  if (falloff == Falloff::Linear)
    weigh_by<Falloff::Linear>(frame, displacement, protect, to, count);
  else if (falloff == Falloff::Dome)
    weigh_by<Falloff::Dome>(frame, displacement, protect, to, count);
  else
    weigh_by<Falloff::Smooth>(frame, displacement, protect, to, count);
}

[[gnu::always_inline]] inline void raise_body(const SlabFrame& frame, float amount, const float* __restrict weight,
                                              float* __restrict change, std::size_t count) noexcept {
  const FrameReader read(frame);
  RELIEF_VECTORS
  for (std::size_t k = 0; k < count; ++k) {
    const Vec3f along = read.fibre(k).along;
    change[k] = amount * weight[k] / std::sqrt(dot(along, along));
  }
}

[[gnu::always_inline]] inline void flatten_body(const SlabFrame& frame, const TargetPlane& plane, float amount,
                                                const float* __restrict displacement, const float* __restrict weight,
                                                float* __restrict change, std::size_t count) noexcept {
  const FrameReader read(frame);
  const Vec3f point = plane.point, normal = plane.normal;
  const float most = plane.raises ? std::numeric_limits<float>::max() : 0.0F;
  const float least = plane.lowers ? -std::numeric_limits<float>::max() : 0.0F;
  RELIEF_VECTORS
  for (std::size_t k = 0; k < count; ++k) {
    const SampleFibre f = read.fibre(k);
    const Vec3f p = f.inner + f.along * displacement[k];
    const float climb = dot(f.along, normal), size = std::sqrt(dot(f.along, f.along));
    const float all = dot(point - p, normal) / larger(climb, kSteepest * size);
    const float wanted = smaller(larger(all, least), most);
    change[k] = climb > kSteepest * size ? wanted * share_of(amount * weight[k]) : 0.0F;
  }
}

[[gnu::always_inline]] inline void approach_body(float amount, const float* __restrict weight, float* __restrict change,
                                                 std::size_t count) noexcept {
  RELIEF_VECTORS
  for (std::size_t k = 0; k < count; ++k) change[k] *= share_of(amount * weight[k]);
}

[[gnu::always_inline]] inline void scale_body(float amount, const float* __restrict weight, float* __restrict change,
                                              std::size_t count) noexcept {
  RELIEF_VECTORS
  for (std::size_t k = 0; k < count; ++k) change[k] *= amount * weight[k];
}

[[gnu::always_inline]] inline float room_body(const SlabFrame& frame, const float* __restrict weight,
                                              const float* __restrict change, const float* __restrict start,
                                              const float* __restrict from, std::size_t count) noexcept {
  const FrameReader read(frame);
  auto least = std::bit_cast<std::int32_t>(1.0F);  // shares are not negative: see lift_body
  RELIEF_VECTORS
  for (std::size_t k = 0; k < count; ++k) {
    const Vec3f along = read.fibre(k).along;
    const float left = 1.0F - from[k];
    const float fade = larger(fade_of(1.0F - start[k], read.space(k) / std::sqrt(dot(along, along))), 1e-9F);
    const float ended = larger(1.0F - left / fade, 0.0F);
    const float rises = change[k] > 0 ? weight[k] : 0.0F;
    const auto bits = std::bit_cast<std::int32_t>(larger(1.0F - rises * ended, 0.0F));
    least = bits < least ? bits : least;
  }
  return std::bit_cast<float>(least);
}

[[gnu::always_inline]] inline std::size_t settle_body(const float* __restrict from, const float* __restrict change,
                                                      float share, float* __restrict to, std::uint8_t* __restrict over,
                                                      std::size_t count) noexcept {
  std::uint32_t limited = 0;
  RELIEF_VECTORS
  for (std::size_t k = 0; k < count; ++k) {
    const float all = from[k] + change[k], some = from[k] + change[k] * share;
    to[k] = smaller(larger(some, 0.0F), 1.0F);
    const auto beyond = static_cast<std::uint32_t>(static_cast<int>(all > 1.0F) | static_cast<int>(all < 0.0F));
    over[k] = static_cast<std::uint8_t>(beyond);
    limited += beyond;
  }
  return limited;
}

[[gnu::always_inline]] inline void cover_body(float amount, const float* __restrict weight,
                                              const float* __restrict from, float* __restrict to,
                                              std::size_t count) noexcept {
  RELIEF_VECTORS
  for (std::size_t k = 0; k < count; ++k) to[k] = from[k] + (1.0F - from[k]) * share_of(amount * weight[k]);
}

[[gnu::always_inline]] inline void mix_body(const float* __restrict cover, float value, const float* __restrict start,
                                            float* __restrict to, std::size_t count) noexcept {
  RELIEF_VECTORS
  for (std::size_t k = 0; k < count; ++k) to[k] = start[k] * (1.0F - cover[k]) + value * cover[k];
}

[[gnu::always_inline]] inline void mix16_body(const float* __restrict cover, float value,
                                              const std::uint16_t* __restrict start, std::uint16_t* __restrict to,
                                              std::size_t count) noexcept {
  const float whole = value * 65535.0F;
  RELIEF_VECTORS
  for (std::size_t k = 0; k < count; ++k) {
    const float from = static_cast<float>(static_cast<std::int32_t>(start[k]));
    // Within 0..65535 already: both ends are, and so is what lies between them.
    to[k] = static_cast<std::uint16_t>(static_cast<std::int32_t>(from + (whole - from) * cover[k] + 0.5F));
  }
}

[[gnu::always_inline]] inline void positions_body(const SlabFrame& frame, const float* __restrict displacement,
                                                  float* __restrict x, float* __restrict y, float* __restrict z,
                                                  std::size_t count) noexcept {
  const FrameReader read(frame);
  RELIEF_VECTORS
  for (std::size_t k = 0; k < count; ++k) {
    const SampleFibre f = read.fibre(k);
    const Vec3f p = f.inner + f.along * displacement[k];
    x[k] = p.x;
    y[k] = p.y;
    z[k] = p.z;
  }
}

template <bool kSwell>
[[gnu::always_inline]] inline float change_of(Vec3f normal, Vec3f pull, float count, Vec3f fibre) noexcept {
  const float climb = dot(fibre, normal);
  const float area = std::sqrt(dot(normal, normal));
  const float least = kSteepest * area * std::sqrt(dot(fibre, fibre));
  const float up = kSwell ? area : dot(pull, normal) / larger(count, 1.0F);
  return climb > least ? up / climb : 0.0F;
}

/// Rows are short: they are gone through in whole vectors, a little into the next row, which comes after and puts that
/// right, or into the border, which others fill.
[[gnu::always_inline]] inline std::size_t whole_vectors(int samples) noexcept {
  return (static_cast<std::size_t>(samples) + kOverrun - 1) / kOverrun * kOverrun;
}

[[gnu::always_inline]] inline void normals_body(int n, const Neighbours& at, float* __restrict nx, float* __restrict ny,
                                                float* __restrict nz) noexcept {
  for (int j = 1; j < n - 1; ++j) {
    const std::size_t row = sample_index(n, {0, j}), above = sample_index(n, {0, j + 1}),
                      below = sample_index(n, {0, j - 1});
    const std::size_t inside = 1 + whole_vectors(n - j - 1);
    const float *x = at.x, *y = at.y, *z = at.z;
    RELIEF_VECTORS
    for (std::size_t i = 1; i < inside; ++i) {
      const auto place = [&](std::size_t k) { return Vec3f{x[k], y[k], z[k]}; };
      const Vec3f a = place(row + i + 1), b = place(above + i), c = place(above + i - 1), d = place(row + i - 1),
                  e = place(below + i), f = place(below + i + 1);
      const Vec3f normal = cross(c - a, d - b) + cross(e - a, f - d);
      const float one = 1.0F / larger(std::sqrt(dot(normal, normal)), 1e-30F);
      nx[row + i] = normal.x * one;
      ny[row + i] = normal.y * one;
      nz[row + i] = normal.z * one;
    }
  }
}

template <bool kSwell>
[[gnu::always_inline]] inline void around_row(const FrameReader& read, int n, int j, const Neighbours& at,
                                              float* __restrict change) noexcept {
  const std::size_t row = sample_index(n, {0, j});
  const std::size_t above = sample_index(n, {0, j + 1}) - row, below = row - sample_index(n, {0, j - 1});
  const float *x = at.x, *y = at.y, *z = at.z;
  const std::size_t last = row + 1 + whole_vectors(n - j - 1);
  RELIEF_VECTORS
  for (std::size_t k = row + 1; k < last; ++k) {
    const Vec3f p = {x[k], y[k], z[k]};
    const Vec3f a = Vec3f{x[k + 1], y[k + 1], z[k + 1]} - p, d = Vec3f{x[k - 1], y[k - 1], z[k - 1]} - p;
    const Vec3f b = Vec3f{x[k + above], y[k + above], z[k + above]} - p;
    const Vec3f c = Vec3f{x[k + above - 1], y[k + above - 1], z[k + above - 1]} - p;
    const Vec3f e = Vec3f{x[k - below], y[k - below], z[k - below]} - p;
    const Vec3f f = Vec3f{x[k - below + 1], y[k - below + 1], z[k - below + 1]} - p;
    // The hexagon around it as two quadrangles, each with the cross product of its diagonals as twice its area.
    const Vec3f normal = cross(c - a, d - b) + cross(e - a, f - d);
    const Vec3f pull = ((a + d) + (b + e)) + (c + f);
    change[k] = change_of<kSwell>(normal, pull, 6.0F, read.fibre(k).along);
  }
}
[[gnu::always_inline]] inline void around_body(const SlabFrame& frame, int n, bool swell, const Neighbours& at,
                                               float* change) noexcept {
  const FrameReader read(frame);
  for (int j = 1; j < n - 1; ++j)
    if (swell)
      around_row<true>(read, n, j, at, change);
    else
      around_row<false>(read, n, j, at, change);
}

[[gnu::always_inline]] inline void border_body(const BorderTables& table, const Neighbours& at,
                                               float* __restrict sums) noexcept {
  const std::size_t count = table.own.size();
  const std::int32_t *own = table.own.data(), *r0 = table.ring[0].data(), *r1 = table.ring[1].data(),
                     *r2 = table.ring[2].data(), *r3 = table.ring[3].data();
  const float *w0 = table.share[0].data(), *w1 = table.share[1].data(), *w2 = table.share[2].data(),
              *w3 = table.share[3].data();
  const float *x = at.x, *y = at.y, *z = at.z;
  float *nx = sums, *ny = sums + count, *nz = ny + count, *px = nz + count, *py = px + count, *pz = py + count;
  RELIEF_VECTORS
  for (std::size_t k = 0; k < count; ++k) {
    const Vec3f p = {x[own[k]], y[own[k]], z[own[k]]};
    const Vec3f a = Vec3f{x[r0[k]], y[r0[k]], z[r0[k]]} - p, b = Vec3f{x[r1[k]], y[r1[k]], z[r1[k]]} - p;
    const Vec3f c = Vec3f{x[r2[k]], y[r2[k]], z[r2[k]]} - p, d = Vec3f{x[r3[k]], y[r3[k]], z[r3[k]]} - p;
    const Vec3f normal = (cross(a, b) + cross(b, c)) + cross(c, d);
    const Vec3f pull = (a * w0[k] + b * w1[k]) + (c * w2[k] + d * w3[k]);
    nx[k] = normal.x;
    ny[k] = normal.y;
    nz[k] = normal.z;
    px[k] = pull.x;
    py[k] = pull.y;
    pz[k] = pull.z;
  }
}

template <bool kSwell>
[[gnu::always_inline]] inline void border_change_by(const SlabFrame& frame, const BorderTables& table,
                                                    const float* __restrict sums, const float* __restrict ways,
                                                    float* __restrict change) noexcept {
  const std::size_t count = table.own.size();
  const std::int32_t* own = table.own.data();
  const FrameReader read(frame);
  const float *nx = sums, *ny = sums + count, *nz = ny + count, *px = nz + count, *py = px + count, *pz = py + count;
  RELIEF_VECTORS
  for (std::size_t k = 0; k < count; ++k) {
    const auto at = static_cast<std::size_t>(own[k]);
    change[k] = change_of<kSwell>({nx[k], ny[k], nz[k]}, {px[k], py[k], pz[k]}, ways[k], read.fibre(at).along);
  }
}
[[gnu::always_inline]] inline void border_change_body(const SlabFrame& frame, const BorderTables& table, bool swell,
                                                      const float* sums, const float* ways, float* change) noexcept {
  if (swell)
    border_change_by<true>(frame, table, sums, ways, change);
  else
    border_change_by<false>(frame, table, sums, ways, change);
}

// Eight sums side by side in a fixed order, so that every build adds up alike.
[[gnu::always_inline]] inline std::array<double, 4> mean_body(const float* __restrict weight, const float* __restrict x,
                                                              const float* __restrict y, const float* __restrict z,
                                                              std::size_t count) noexcept {
  constexpr std::size_t kLanes = 8;
  std::array<float, kLanes> sw{}, sx{}, sy{}, sz{};
  std::size_t k = 0;
  for (; k + kLanes <= count; k += kLanes)
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      sw[lane] += weight[k + lane];
      sx[lane] += weight[k + lane] * x[k + lane];
      sy[lane] += weight[k + lane] * y[k + lane];
      sz[lane] += weight[k + lane] * z[k + lane];
    }
  std::array<double, 4> sum{};
  const auto add = [&](float w, float px, float py, float pz) {
    sum[0] += static_cast<double>(w);
    sum[1] += static_cast<double>(px);
    sum[2] += static_cast<double>(py);
    sum[3] += static_cast<double>(pz);
  };
  for (std::size_t lane = 0; lane < kLanes; ++lane) add(sw[lane], sx[lane], sy[lane], sz[lane]);
  for (; k < count; ++k) add(weight[k], weight[k] * x[k], weight[k] * y[k], weight[k] * z[k]);
  return sum;
}

[[gnu::always_inline]] inline void resample_body(const Resampling& table, const float* __restrict from,
                                                 float* __restrict to, std::size_t count) noexcept {
  const std::int32_t *ia = table.index[0].data(), *ib = table.index[1].data(), *ic = table.index[2].data();
  const float *wa = table.weight[0].data(), *wb = table.weight[1].data(), *wc = table.weight[2].data();
  RELIEF_VECTORS
  for (std::size_t k = 0; k < count; ++k) to[k] = (from[ia[k]] * wa[k] + from[ib[k]] * wb[k]) + from[ic[k]] * wc[k];
}

[[gnu::always_inline]] inline std::size_t count_body(const float* __restrict a, const float* __restrict b,
                                                     std::size_t stride, int planes, std::size_t count) noexcept {
  const std::size_t second = planes == 3 ? stride : 0, third = 2 * second;
  std::uint32_t changes = 0;
  RELIEF_VECTORS
  for (std::size_t k = 0; k < count; ++k)
    changes += static_cast<std::uint32_t>(a[k] != b[k]) | static_cast<std::uint32_t>(a[k + second] != b[k + second]) |
               static_cast<std::uint32_t>(a[k + third] != b[k + third]);
  return changes;
}

[[gnu::always_inline]] inline std::size_t count16_body(const std::uint16_t* __restrict a,
                                                       const std::uint16_t* __restrict b, std::size_t stride,
                                                       std::size_t count) noexcept {
  std::uint32_t changes = 0;
  RELIEF_VECTORS
  for (std::size_t k = 0; k < count; ++k) {
    const std::uint32_t differ = static_cast<std::uint32_t>(a[k] ^ b[k]) |
                                 static_cast<std::uint32_t>(a[k + stride] ^ b[k + stride]) |
                                 static_cast<std::uint32_t>(a[k + 2 * stride] ^ b[k + 2 * stride]);
    changes += static_cast<std::uint32_t>(differ != 0);
  }
  return changes;
}

// Values are not negative, so their bits sort as they do, and integers may be taken in any order.
[[gnu::always_inline]] inline float largest_body(const float* __restrict values, std::size_t count) noexcept {
  std::int32_t most = 0;
  RELIEF_VECTORS
  for (std::size_t k = 0; k < count; ++k) {
    const auto bits = std::bit_cast<std::int32_t>(values[k]);
    most = bits > most ? bits : most;
  }
  return std::bit_cast<float>(most);
}

// The kernels as one build has them: the bodies above, compiled for it.
#define RELIEF_KERNEL_BUILD(space, ...)                                                                               \
  namespace space {                                                                                                   \
  __VA_ARGS__ bool cut(const SlabFrame& frame, const Cutter& cutter, const Start& start, const float* protect,        \
                       const float* from, float* to, std::size_t count) {                                             \
    return cut_body(frame, cutter, start, protect, from, to, count);                                                  \
  }                                                                                                                   \
  __VA_ARGS__ Lift lift(const SlabFrame& frame, const Cutter& cutter, const float* start, const float* protect,       \
                        std::uint8_t* over, std::size_t count) {                                                      \
    return lift_body(frame, cutter, start, protect, over, count);                                                     \
  }                                                                                                                   \
  __VA_ARGS__ void weigh(const SlabFrame& frame, Falloff falloff, const float* displacement, const float* protect,    \
                         float* to, std::size_t count) {                                                              \
    weigh_body(frame, falloff, displacement, protect, to, count);                                                     \
  }                                                                                                                   \
  __VA_ARGS__ void raise(const SlabFrame& frame, float amount, const float* weight, float* change,                    \
                         std::size_t count) {                                                                         \
    raise_body(frame, amount, weight, change, count);                                                                 \
  }                                                                                                                   \
  __VA_ARGS__ void flatten(const SlabFrame& frame, const TargetPlane& plane, float amount, const float* displacement, \
                           const float* weight, float* change, std::size_t count) {                                   \
    flatten_body(frame, plane, amount, displacement, weight, change, count);                                          \
  }                                                                                                                   \
  __VA_ARGS__ void approach(float amount, const float* weight, float* change, std::size_t count) {                    \
    approach_body(amount, weight, change, count);                                                                     \
  }                                                                                                                   \
  __VA_ARGS__ void scale(float amount, const float* weight, float* change, std::size_t count) {                       \
    scale_body(amount, weight, change, count);                                                                        \
  }                                                                                                                   \
  __VA_ARGS__ float room(const SlabFrame& frame, const float* weight, const float* change, const float* start,        \
                         const float* from, std::size_t count) {                                                      \
    return room_body(frame, weight, change, start, from, count);                                                      \
  }                                                                                                                   \
  __VA_ARGS__ std::size_t settle(const float* from, const float* change, float share, float* to, std::uint8_t* over,  \
                                 std::size_t count) {                                                                 \
    return settle_body(from, change, share, to, over, count);                                                         \
  }                                                                                                                   \
  __VA_ARGS__ void cover(float amount, const float* weight, const float* from, float* to, std::size_t count) {        \
    cover_body(amount, weight, from, to, count);                                                                      \
  }                                                                                                                   \
  __VA_ARGS__ void mix(const float* cover, float value, const float* start, float* to, std::size_t count) {           \
    mix_body(cover, value, start, to, count);                                                                         \
  }                                                                                                                   \
  __VA_ARGS__ void mix16(const float* cover, float value, const std::uint16_t* start, std::uint16_t* to,              \
                         std::size_t count) {                                                                         \
    mix16_body(cover, value, start, to, count);                                                                       \
  }                                                                                                                   \
  __VA_ARGS__ void positions(const SlabFrame& frame, const float* displacement, float* x, float* y, float* z,         \
                             std::size_t count) {                                                                     \
    positions_body(frame, displacement, x, y, z, count);                                                              \
  }                                                                                                                   \
  __VA_ARGS__ void normals(int n, const Neighbours& at, float* x, float* y, float* z) {                               \
    normals_body(n, at, x, y, z);                                                                                     \
  }                                                                                                                   \
  __VA_ARGS__ void around(const SlabFrame& frame, int n, bool swell, const Neighbours& at, float* change) {           \
    around_body(frame, n, swell, at, change);                                                                         \
  }                                                                                                                   \
  __VA_ARGS__ void border(const BorderTables& table, const Neighbours& at, float* sums) {                             \
    border_body(table, at, sums);                                                                                     \
  }                                                                                                                   \
  __VA_ARGS__ void border_change(const SlabFrame& frame, const BorderTables& table, bool swell, const float* sums,    \
                                 const float* ways, float* change) {                                                  \
    border_change_body(frame, table, swell, sums, ways, change);                                                      \
  }                                                                                                                   \
  __VA_ARGS__ std::array<double, 4> mean(const float* weight, const float* x, const float* y, const float* z,         \
                                         std::size_t count) {                                                         \
    return mean_body(weight, x, y, z, count);                                                                         \
  }                                                                                                                   \
  __VA_ARGS__ void resample(const Resampling& table, const float* from, float* to, std::size_t count) {               \
    resample_body(table, from, to, count);                                                                            \
  }                                                                                                                   \
  __VA_ARGS__ std::size_t count_changes(const float* a, const float* b, std::size_t stride, int planes,               \
                                        std::size_t count) {                                                          \
    return count_body(a, b, stride, planes, count);                                                                   \
  }                                                                                                                   \
  __VA_ARGS__ std::size_t count_changes16(const std::uint16_t* a, const std::uint16_t* b, std::size_t stride,         \
                                          std::size_t count) {                                                        \
    return count16_body(a, b, stride, count);                                                                         \
  }                                                                                                                   \
  __VA_ARGS__ float largest(const float* values, std::size_t count) { return largest_body(values, count); }           \
  constexpr Kernels kAll = {cut,           lift,  weigh,    raise,         flatten,         approach, scale,  room,   \
                            settle,        cover, mix,      mix16,         positions,       normals,  around, border, \
                            border_change, mean,  resample, count_changes, count_changes16, largest};                 \
  }

RELIEF_KERNEL_BUILD(baseline, )
#if defined(__x86_64__)
RELIEF_KERNEL_BUILD(avx2, [[gnu::target("avx2")]])
#endif
#undef RELIEF_KERNEL_BUILD
#undef RELIEF_VECTORS

}  // namespace

const Kernels& baseline_kernels() noexcept { return baseline::kAll; }

const Kernels& best_kernels() noexcept {
#if defined(__x86_64__)
  static const bool has_avx2 = __builtin_cpu_supports("avx2") != 0;
  if (has_avx2) return avx2::kAll;
#endif
  return baseline::kAll;
}

}  // namespace relief::detail
