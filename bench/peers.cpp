#include "peers.h"

#include <relief/base/cpu_time.h>
#include <relief/base/triangle.h>

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>
#include <embree3/rtcore.h>
#include <malloc.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>
#include <openvdb/tools/MeshToVolume.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <optional>

namespace relief::bench {
namespace {

using Corners = std::array<std::uint32_t, 3>;

std::size_t resident_bytes() {
  malloc_trim(0);
  std::ifstream file("/proc/self/statm");
  std::size_t pages = 0, resident = 0;
  file >> pages >> resident;
  return resident * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

Vec3d nearest_on(const Tessellation& surface, const Corners& t, Vec3d p, std::array<double, 3>& weights) {
  const auto& at = surface.positions;
  weights = nearest_in_triangle(p, at[t[0]], at[t[1]], at[t[2]]);
  return at[t[0]] * weights[0] + at[t[1]] * weights[1] + at[t[2]] * weights[2];
}

/// The answer whose nearest point lies on this triangle.
Nearest answer_on(const Tessellation& surface, const Corners& t, Vec3d p) {
  std::array<double, 3> weights{};
  const Vec3d nearest = nearest_on(surface, t, p, weights);
  Vec3d normal;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3f n = surface.normals[t[k]];
    normal += Vec3d{n.x, n.y, n.z} * weights[k];
  }
  normal = normalized(normal);
  const double distance = length(p - nearest);
  return {nearest, normal, dot(p - nearest, normal) < 0 ? -distance : distance};
}

class Embree final : public Peer {
 public:
  explicit Embree(const Tessellation& surface) : surface_(surface) {
    name = "embree closest point";
    const double start = process_cpu_seconds();
    device_ = rtcNewDevice("threads=2");
    rtcSetDeviceMemoryMonitorFunction(
        device_,
        [](void* self, ssize_t change, bool) {
          static_cast<Embree*>(self)->used_ += change;
          return true;
        },
        this);
    scene_ = rtcNewScene(device_);
    rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_HIGH);
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                                 3 * sizeof(float), surface.positions.size()));
    for (const Vec3d p : surface.positions)
      for (std::size_t axis = 0; axis < 3; ++axis) *vertices++ = static_cast<float>(p[axis]);
    auto* indices = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, sizeof(Corners), surface.triangles.size()));
    for (const Corners& t : surface.triangles) indices = std::copy(t.begin(), t.end(), indices);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene_);
    build_seconds = process_cpu_seconds() - start;
    bytes = static_cast<std::size_t>(std::max<ssize_t>(0, used_));
  }
  Embree(const Embree&) = delete;
  Embree& operator=(const Embree&) = delete;
  ~Embree() override {
    rtcReleaseScene(scene_);
    rtcSetDeviceMemoryMonitorFunction(device_, nullptr, nullptr);
    rtcReleaseDevice(device_);
  }

  Nearest nearest(Vec3d p, bool coherent) override {
    Search search{.surface = &surface_, .p = p, .at = p};
    double radius = std::numeric_limits<float>::max();
    // The last answer is a point of the surface: none that is farther can be the nearest. The hair is for floats.
    if (coherent && last_) radius = length(p - *last_) * (1 + 1e-6) + 1e-9;
    RTCPointQuery query = {.x = static_cast<float>(p.x),
                           .y = static_cast<float>(p.y),
                           .z = static_cast<float>(p.z),
                           .time = 0,
                           .radius = static_cast<float>(radius)};
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(scene_, &query, &context, closer, &search);
    last_ = search.at;
    return answer_on(surface_, surface_.triangles[search.triangle], p);
  }

 private:
  struct Search {
    const Tessellation* surface = nullptr;
    Vec3d p, at;
    double best = std::numeric_limits<double>::max();
    std::uint32_t triangle = 0;
  };
  static bool closer(RTCPointQueryFunctionArguments* call) {
    auto& search = *static_cast<Search*>(call->userPtr);
    const Corners& t = search.surface->triangles[call->primID];
    std::array<double, 3> weights{};
    const Vec3d q = nearest_on(*search.surface, t, search.p, weights);
    const double d = length(search.p - q);
    if (d >= search.best) return false;
    search.best = d;
    search.at = q;
    search.triangle = call->primID;
    call->query->radius = std::min(call->query->radius, static_cast<float>(d));
    return true;
  }

  const Tessellation& surface_;
  RTCDevice device_ = nullptr;
  RTCScene scene_ = nullptr;
  ssize_t used_ = 0;
  std::optional<Vec3d> last_;
};

class Vdb final : public Peer {
 public:
  explicit Vdb(const Tessellation& surface) {
    name = "openvdb signed distance";
    const double start = process_cpu_seconds();
    Box3d box;
    for (const Vec3d p : surface.positions) box.add(p);
    const auto transform = openvdb::math::Transform::createLinearTransform(diagonal(box) / 256);
    std::vector<openvdb::Vec3s> points;
    for (const Vec3d p : surface.positions) points.emplace_back(openvdb::Vec3d(p.x, p.y, p.z));
    std::vector<openvdb::Vec3I> triangles;
    for (const Corners& t : surface.triangles) triangles.emplace_back(t[0], t[1], t[2]);
    grid_ = openvdb::tools::meshToSignedDistanceField<openvdb::FloatGrid>(*transform, points, triangles, {}, 6, 6);
    accessor_.emplace(grid_->getConstAccessor());
    build_seconds = process_cpu_seconds() - start;
    bytes = static_cast<std::size_t>(grid_->memUsage());
  }

  Nearest nearest(Vec3d p, bool) override {
    const openvdb::tools::GridSampler<openvdb::FloatGrid::ConstAccessor, openvdb::tools::BoxSampler> sampler(
        *accessor_, grid_->transform());
    const double h = 0.5 * grid_->voxelSize()[0];
    const auto at = [&](double x, double y, double z) {
      return static_cast<double>(sampler.wsSample(openvdb::Vec3d(p.x + x, p.y + y, p.z + z)));
    };
    const double d = at(0, 0, 0);
    const Vec3d slope = {at(h, 0, 0) - at(-h, 0, 0), at(0, h, 0) - at(0, -h, 0), at(0, 0, h) - at(0, 0, -h)};
    const Vec3d normal = length(slope) > 0 ? normalized(slope) : Vec3d{0, 0, 1};
    return {p - normal * d, normal, d};
  }

 private:
  openvdb::FloatGrid::Ptr grid_;
  std::optional<openvdb::FloatGrid::ConstAccessor> accessor_;
};

class Cgal final : public Peer {
  using Kernel = CGAL::Simple_cartesian<double>;
  using Triangles = std::vector<Kernel::Triangle_3>;
  using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;
  using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;

 public:
  explicit Cgal(const Tessellation& surface) : surface_(surface) {
    name = "cgal tree";
    const std::size_t before = resident_bytes();
    const double start = process_cpu_seconds();
    triangles_.reserve(surface.triangles.size());
    const auto point = [&](std::uint32_t v) {
      const Vec3d p = surface.positions[v];
      return Kernel::Point_3(p.x, p.y, p.z);
    };
    for (const Corners& t : surface.triangles) triangles_.emplace_back(point(t[0]), point(t[1]), point(t[2]));
    tree_.insert(triangles_.cbegin(), triangles_.cend());
    tree_.build();
    build_seconds = process_cpu_seconds() - start;
    const std::size_t after = resident_bytes();
    bytes = after > before ? after - before : 0;
  }

  Nearest nearest(Vec3d p, bool coherent) override {
    const Kernel::Point_3 query(p.x, p.y, p.z);
    const auto found =
        coherent && last_ ? tree_.closest_point_and_primitive(query, *last_) : tree_.closest_point_and_primitive(query);
    last_ = found;
    const auto triangle = static_cast<std::size_t>(found.second - triangles_.cbegin());
    return answer_on(surface_, surface_.triangles[triangle], p);
  }

 private:
  const Tessellation& surface_;
  Triangles triangles_;
  Tree tree_;
  std::optional<Tree::Point_and_primitive_id> last_;
};

}  // namespace

std::vector<std::unique_ptr<Peer>> make_peers(const Tessellation& surface) {
  std::vector<std::unique_ptr<Peer>> peers;
  peers.push_back(std::make_unique<Embree>(surface));
  peers.push_back(std::make_unique<Vdb>(surface));
  peers.push_back(std::make_unique<Cgal>(surface));
  return peers;
}

}  // namespace relief::bench
