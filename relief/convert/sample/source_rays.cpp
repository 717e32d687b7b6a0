#include <relief/base/assert.h>
#include <relief/base/triangle.h>
#include <relief/convert/sample/source_rays.h>

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>

namespace relief::detail {
namespace {

constexpr double kMiddle = Lattice::kSpan / 2;
constexpr double kScale = 2 / Lattice::kSpan;  // the lattice becomes [-1, 1]
constexpr double kSlack = 64;                  // steps: more than floats lose of a place in the scene
constexpr double kEdgeOn = 1e-9;               // sine of a line and a triangle: below it, its neighbours are met
// Share of a distance, and lengths of the scene: more than floats lose of a radius.
constexpr double kRadiusSlack = 1e-6;
constexpr float kLeastRadius = 1e-7F;

Vec3f to_scene(Vec3d p) noexcept { return to_float((p - Vec3d{kMiddle, kMiddle, kMiddle}) * kScale); }

/// What some rays meet, by RTCRay::id.
struct Hits {
  struct OfRay {
    std::array<std::uint32_t, kMostCrossings> triangles;
    std::size_t count = 0;

    [[nodiscard]] std::span<std::uint32_t> all() noexcept { return std::span(triangles).first(count); }
  };
  RTCIntersectContext context;  // first, so that the filter can reach the rest
  std::array<OfRay, SourceRays::kTogether> rays;

  explicit Hits(RTCIntersectContextFlags flags);
};

// Notes the triangle and lets the ray go on.
void note_hit(const RTCFilterFunctionNArguments* arguments) {
  auto* const hits = reinterpret_cast<Hits*>(arguments->context);
  const unsigned count = arguments->N;
  for (unsigned k = 0; k < count; ++k) {
    if (arguments->valid[k] == 0) continue;
    Hits::OfRay& ray = hits->rays[RTCRayN_id(arguments->ray, count, k)];
    if (ray.count < ray.triangles.size()) ray.triangles[ray.count++] = RTCHitN_primID(arguments->hit, count, k);
    arguments->valid[k] = 0;
  }
}

Hits::Hits(RTCIntersectContextFlags flags) {
  rtcInitIntersectContext(&context);
  context.flags = flags;
  context.filter = note_hit;
}

/// A ray of the float search. It reaches a little beyond what is asked for; the exact places decide.
struct SearchRay {
  double slack;  ///< beyond either end, in lengths of the direction
  Vec3f start, along;
  float far;

  SearchRay(const Line& line, double from, double to, Vec3d aside = {}) noexcept
      : slack(kSlack / length(line.direction)),
        start(to_scene(line.origin + line.direction * (from - slack) + aside)),
        along(to_float(line.direction * kScale)),
        far(static_cast<float>(to - from + 2 * slack)) {}
};

void shoot(RTCScene scene, const SearchRay& search, Hits& hits) {
  RTCRayHit ray{};
  ray.ray.org_x = search.start.x, ray.ray.org_y = search.start.y, ray.ray.org_z = search.start.z;
  ray.ray.dir_x = search.along.x, ray.ray.dir_y = search.along.y, ray.ray.dir_z = search.along.z;
  ray.ray.tfar = search.far;
  ray.ray.mask = ~0U;
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(scene, &hits.context, &ray);
}

/// Returns whether the triangles' boxes are mostly empty, as those of long slivers that lie askew.
bool has_slivers(std::span<const Vec3d> points, std::span<const Face> faces) {
  constexpr double kMuch = 30;
  double boxes = 0, triangles = 0;
  for (const Face& f : faces) {
    if (!is_finite(points[f[0]]) || !is_finite(points[f[1]]) || !is_finite(points[f[2]])) continue;
    Box3d box;
    for (const std::uint32_t v : f) box.add(points[v]);
    const Vec3d e = box.extent();
    boxes += e.x * e.y + e.y * e.z + e.z * e.x;
    triangles += 0.5 * length(cross(points[f[1]] - points[f[0]], points[f[2]] - points[f[0]]));
  }
  return boxes > kMuch * triangles;
}

}  // namespace

struct SourceRays::Scene {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
};

SourceRays::SourceRays(std::span<const Vec3d> points, std::span<const Face> faces, const Lattice& lattice)
    : points_(points),
      faces_(faces),
      origin_(lattice.origin),
      scale_(1 / lattice.step),
      scene_(std::make_unique<Scene>()) {
  scene_->device = rtcNewDevice(nullptr);
  if (scene_->device == nullptr) throw std::bad_alloc();
  scene_->scene = rtcNewScene(scene_->device);
  // Leaves that hold no corners are made in half the time and take 45 bytes less per triangle; rays cost 10 % more.
  constexpr std::size_t kMany = 300'000;
  const int compact = faces.size() > kMany ? RTC_SCENE_FLAG_COMPACT : RTC_SCENE_FLAG_NONE;
  rtcSetSceneFlags(scene_->scene, static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_ROBUST | compact |
                                                             RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION));
  // A hierarchy that cuts triangles apart takes longer to build, and pays where boxes hold little of them.
  const RTCBuildQuality quality = has_slivers(points, faces) ? RTC_BUILD_QUALITY_HIGH : RTC_BUILD_QUALITY_LOW;
  rtcSetSceneBuildQuality(scene_->scene, quality);
  RTCGeometry geometry = rtcNewGeometry(scene_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* const vertices = static_cast<float*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), points.size()));
  if (vertices == nullptr) throw std::bad_alloc();
  for (std::size_t v = 0; v < points.size(); ++v) {
    const Vec3f p = to_scene(point(static_cast<std::uint32_t>(v)));
    for (std::size_t k = 0; k < 3; ++k) vertices[3 * v + k] = p[k];
  }
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, faces.data(), 0, sizeof(Face),
                             faces.size());
  rtcSetGeometryBuildQuality(geometry, quality);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene_->scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene_->scene);
}

SourceRays::~SourceRays() {
  rtcReleaseScene(scene_->scene);
  rtcReleaseDevice(scene_->device);
}

void SourceRays::cross(Vec3d origin, Vec3d direction, double from, double to, Crossings& found) const {
  found.count = 0;
  if (!(length(direction) > 0) || !(to > from)) return;
  const Line line = {origin, direction};
  Hits hits(RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT);
  shoot(scene_->scene, SearchRay(line, from, to), hits);
  find_crossings(line, from, to, hits.rays[0].all(), found);
}

void SourceRays::cross(std::span<const Line> lines, double from, double to, std::span<Crossings> found) const {
  RELIEF_ASSERT(lines.size() <= kTogether && found.size() >= lines.size());
  Hits hits(RTC_INTERSECT_CONTEXT_FLAG_COHERENT);
  alignas(32) std::array<int, kTogether> valid{};
  RTCRayHit8 rays{};
  for (std::size_t k = 0; k < lines.size(); ++k) {
    found[k].count = 0;
    if (!(length(lines[k].direction) > 0) || !(to > from)) continue;
    const SearchRay search(lines[k], from, to);
    rays.ray.org_x[k] = search.start.x, rays.ray.org_y[k] = search.start.y, rays.ray.org_z[k] = search.start.z;
    rays.ray.dir_x[k] = search.along.x, rays.ray.dir_y[k] = search.along.y, rays.ray.dir_z[k] = search.along.z;
    rays.ray.tfar[k] = search.far;
    rays.ray.mask[k] = ~0U;
    rays.ray.id[k] = static_cast<unsigned>(k);
    rays.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;
    valid[k] = -1;
  }
  rtcIntersect8(valid.data(), scene_->scene, &hits.context, &rays);
  for (std::size_t k = 0; k < lines.size(); ++k)
    if (valid[k] != 0) find_crossings(lines[k], from, to, hits.rays[k].all(), found[k]);
}

/// Returns the crossings with what a search has met, or passed close by.
void SourceRays::find_crossings(const Line& line, double from, double to, std::span<const std::uint32_t> met,
                                Crossings& found) const {
  const auto& [origin, direction] = line;
  const double size = length(direction), slack = SearchRay(line, from, to).slack;
  const auto add = [&](std::uint32_t triangle, double least_inside) {
    std::optional<Crossing> c = crossing_with(triangle, origin, direction);
    if (c && c->inside < 0) c = settle(*c, origin, direction);
    if (c && c->inside >= least_inside && c->t >= from && c->t <= to) found.items[found.count++] = *c;
  };
  for (const std::uint32_t triangle : met) add(triangle, -Box3d::kFar);
  if (met.empty()) {
    // Near the tip of a needle the rounding of the ray takes it past the surface: rays beside it find what it crosses.
    constexpr double kBeside = 3;       // steps
    constexpr double kRounding = 1e-9;  // of weights
    const Vec3d one = normalized(std::abs(direction.x) < 0.5 * size ? relief::cross(direction, {1, 0, 0})
                                                                    : relief::cross(direction, {0, 1, 0}));
    const Vec3d other = relief::cross(direction, one) / size;
    Hits hits(RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT);
    for (const Vec3d aside : {one, -one, other, -other})
      shoot(scene_->scene, SearchRay(line, from, to, aside * kBeside), hits);
    const std::span<std::uint32_t> beside = hits.rays[0].all();
    std::ranges::sort(beside);
    for (std::size_t k = 0; k < beside.size(); ++k)
      if (k == 0 || beside[k] != beside[k - 1]) add(beside[k], -kRounding);
  }
  std::sort(found.items.begin(), found.items.begin() + static_cast<std::ptrdiff_t>(found.count),
            [](const Crossing& x, const Crossing& y) { return x.t != y.t ? x.t < y.t : x.triangle < y.triangle; });
  // Two faces of one edge, met in the same place and the same sense, are one crossing.
  std::size_t kept = 0;
  for (std::size_t k = 0; k < found.count; ++k) {
    std::size_t same = kept;
    for (std::size_t j = kept; j > 0 && found.items[k].t - found.items[j - 1].t < slack / 32; --j)
      if (found.items[j - 1].front == found.items[k].front) same = j - 1;
    if (same == kept || found.items[k].inside > found.items[same].inside) found.items[same] = found.items[k];
    kept += same == kept;
  }
  found.count = kept;
}

std::optional<Crossing> SourceRays::crossing_with(std::uint32_t triangle, Vec3d origin, Vec3d direction) const {
  const Face& f = faces_[triangle];
  const Vec3d a = point(f[0]) - origin, b = point(f[1]) - origin, c = point(f[2]) - origin;
  const Vec3d n = relief::cross(b - a, c - a);
  const double steep = dot(n, direction);
  if (!(std::abs(steep) > kEdgeOn * length(n) * length(direction))) return std::nullopt;
  const double t = dot(n, a) / steep;
  const Vec3d p = direction * t;
  std::array<double, 3> w = {dot(n, relief::cross(b - p, c - p)), dot(n, relief::cross(c - p, a - p)),
                             dot(n, relief::cross(a - p, b - p))};
  const double inside = std::min({w[0], w[1], w[2]}) / dot(n, n);
  for (double& weight : w) weight = std::max(0.0, weight);
  const double sum = w[0] + w[1] + w[2];
  for (double& weight : w) weight = sum > 0 ? weight / sum : 1.0 / 3;
  return Crossing{t, triangle, w, inside, steep > 0};
}

// The search runs in float and may return the neighbour of the crossed triangle. Where both are steep, that plane is
// met many steps away; at the rim of a thin lens, thousands.
Crossing SourceRays::settle(const Crossing& near, Vec3d origin, Vec3d direction) const {
  constexpr std::array<double, 3> kReaches = {64, 1024, 16384};  // steps
  constexpr double kRounding = 1e-12;                            // of weights
  struct Search {
    const SourceRays* surface;
    Vec3d origin, direction;
    Crossing missed, best;
  } search{this, origin, direction, near, near};
  const auto visit = [](RTCPointQueryFunctionArguments* arguments) {
    auto& s = *static_cast<Search*>(arguments->userPtr);
    if (!s.surface->share_a_point(arguments->primID, s.missed.triangle)) return false;
    const auto c = s.surface->crossing_with(arguments->primID, s.origin, s.direction);
    if (!c || c->front != s.missed.front || c->inside < -kRounding) return false;
    const double far = std::abs(c->t - s.missed.t), least = std::abs(s.best.t - s.missed.t);
    if (s.best.inside < -kRounding || far < least || (far == least && c->triangle < s.best.triangle)) s.best = *c;
    return false;
  };
  const Vec3f q = to_scene(origin + direction * near.t);
  RTCPointQuery query{};
  query.x = q.x, query.y = q.y, query.z = q.z;
  for (const double reach : kReaches) {
    query.radius = static_cast<float>(reach * kScale);
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(scene_->scene, &query, &context, visit, &search);
    if (search.best.inside >= -kRounding) break;
  }
  return search.best;
}

SourceRays::Nearest SourceRays::nearest(Vec3d p) const {
  struct Search {
    const SourceRays* surface;
    Vec3d p;
    Nearest best{.distance = std::numeric_limits<double>::infinity()};
  } search{this, p};
  const auto visit = [](RTCPointQueryFunctionArguments* arguments) {
    auto& s = *static_cast<Search*>(arguments->userPtr);
    const Face& f = s.surface->faces_[arguments->primID];
    // From p, so that nothing is lost far from the origin.
    const Vec3d a = s.surface->point(f[0]) - s.p, b = s.surface->point(f[1]) - s.p, c = s.surface->point(f[2]) - s.p;
    const auto w = nearest_in_triangle({}, a, b, c);
    const double distance = length(a * w[0] + b * w[1] + c * w[2]);
    if (!(distance < s.best.distance)) return false;
    s.best = {distance, arguments->primID, w};
    arguments->query->radius = static_cast<float>(distance * kScale * (1 + kRadiusSlack)) + kLeastRadius;
    return true;
  };
  const Vec3f q = to_scene(p);
  RTCPointQuery query{};
  query.x = q.x, query.y = q.y, query.z = q.z;
  query.radius = std::numeric_limits<float>::infinity();
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(scene_->scene, &query, &context, visit, &search);
  return search.best;
}

}  // namespace relief::detail
