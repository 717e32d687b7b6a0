#include "peers.h"

#include <relief/base/cpu_time.h>
#include <relief/base/lanes.h>

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/version.h>
#include <embree3/rtcore.h>
#include <malloc.h>
#include <openvdb/math/Stencils.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>
#include <openvdb/tools/MeshToVolume.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <limits>
#include <optional>
#include <utility>

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

struct Library {
  std::string name;
  double build_seconds = 0;
  std::size_t bytes = 0;
};

/// One of the two rows of a library.
template <typename Library>
class Row final : public Contestant {
 public:
  Row(std::shared_ptr<Library> library, const std::string& how, bool best) : library_(std::move(library)), best_(best) {
    name = library_->name + ", " + how;
    build_seconds = library_->build_seconds;
    bytes = library_->bytes;
    cold = best;
  }
  void approach(Vec3d /*first*/, Vec3d /*up*/) override { library_->forget(); }
  double ask(Vec3d cursor, bool coherent) override {
    const Nearest found = nearest(cursor, coherent);
    return found.point.x + found.normal.x + (found.inside ? 1 : 0);
  }
  std::optional<Nearest> answer(Vec3d cursor, bool coherent) override { return nearest(cursor, coherent); }

 private:
  [[nodiscard]] Nearest nearest(Vec3d cursor, bool coherent) {
    return best_ ? library_->best(cursor, coherent) : library_->plain(cursor);
  }
  std::shared_ptr<Library> library_;
  bool best_;
};

using detail::Four;

float dot(Four a, Four b) {
  const Four m = a * b;
  return m[0] + m[1] + m[2];
}

/// Where in a triangle the point nearest to p is: v along ab and w along ac. As nearest_in_triangle(), from the fewest
/// products of four numbers at a time.
struct InTriangle {
  float v = 0, w = 0;
  InTriangle(Four ab, Four ac, Four ap) {
    const float d1 = dot(ab, ap), d2 = dot(ac, ap), across = dot(ab, ac);
    const float d3 = d1 - dot(ab, ab), d4 = d2 - across, d5 = d1 - across, d6 = d2 - dot(ac, ac);
    if (d1 <= 0 && d2 <= 0) return;
    if (d3 >= 0 && d4 <= d3) {
      v = 1;
      return;
    }
    if (d6 >= 0 && d5 <= d6) {
      w = 1;
      return;
    }
    const float vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) {
      v = d1 / (d1 - d3);
    } else if (vb <= 0 && d2 >= 0 && d6 <= 0) {
      w = d2 / (d2 - d6);
    } else if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
      w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
      v = 1 - w;
    } else {
      const float scale = 1 / (va + vb + vc);
      v = vb * scale;
      w = vc * scale;
    }
  }
};

class Embree : public Library {
 public:
  explicit Embree(const Tessellation& surface) {
    const double start = process_cpu_seconds();
    device_ = rtcNewDevice("threads=2");
    name = "Embree " + std::to_string(rtcGetDeviceProperty(device_, RTC_DEVICE_PROPERTY_VERSION_MAJOR)) + "." +
           std::to_string(rtcGetDeviceProperty(device_, RTC_DEVICE_PROPERTY_VERSION_MINOR)) + "." +
           std::to_string(rtcGetDeviceProperty(device_, RTC_DEVICE_PROPERTY_VERSION_PATCH));
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
    Box3d box;
    for (const Vec3d p : surface.positions) box.add(p);
    size_ = static_cast<float>(diagonal(box));
    // A query that reads these through the indices takes half as long again.
    triangles_.reserve(surface.triangles.size());
    normals_.reserve(surface.triangles.size());
    for (const auto& [a, b, c] : surface.triangles) {
      const Four corner = four(surface.positions[a]);
      triangles_.push_back({corner, four(surface.positions[b]) - corner, four(surface.positions[c]) - corner});
      normals_.push_back({surface.normals[a], surface.normals[b], surface.normals[c]});
    }
    build_seconds = process_cpu_seconds() - start;
    bytes =
        static_cast<std::size_t>(std::max<ssize_t>(0, used_)) + triangles_.size() * (sizeof(Sides) + sizeof(Normals));
  }
  Embree(const Embree&) = delete;
  Embree& operator=(const Embree&) = delete;
  ~Embree() {
    rtcReleaseScene(scene_);
    rtcSetDeviceMemoryMonitorFunction(device_, nullptr, nullptr);
    rtcReleaseDevice(device_);
  }

  void forget() { last_.reset(); }
  Nearest plain(Vec3d p) { return within(four(p), std::numeric_limits<float>::infinity()); }
  /// The last answer is a point of the surface: none that is farther can be the nearest. The hair is for rounding.
  Nearest best(Vec3d cursor, bool coherent) {
    const Four p = four(cursor);
    float radius = std::numeric_limits<float>::infinity();
    if (coherent && last_) radius = std::sqrt(dot(p - *last_, p - *last_)) * (1 + 1e-5F) + size_ * 1e-6F;
    return within(p, radius);
  }

 private:
  /// A corner, and from there to the two others.
  struct Sides {
    Four a, ab, ac;
  };
  using Normals = std::array<Vec3f, 3>;
  struct Search {
    const Sides* triangles = nullptr;
    Four p, nearest;
    float v = 0, w = 0;
    float best2 = std::numeric_limits<float>::max();
    std::uint32_t triangle = 0;
  };
  static Four four(Vec3d p) {
    return Four{static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z), 0};
  }
  Nearest within(Four p, float radius) {
    Search search{.triangles = triangles_.data(), .p = p, .nearest = p};
    RTCPointQuery query = {.x = p[0], .y = p[1], .z = p[2], .time = 0, .radius = radius};
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(scene_, &query, &context, closer, &search);
    last_ = search.nearest;
    const auto& [a, b, c] = normals_[search.triangle];
    const Vec3f normal = normalized(a * (1 - search.v - search.w) + b * search.v + c * search.w);
    const Four away = p - search.nearest, up = {normal.x, normal.y, normal.z, 0};
    return {.point = to_double(Vec3f{search.nearest[0], search.nearest[1], search.nearest[2]}),
            .normal = to_double(normal),
            .inside = dot(away, up) < 0};
  }
  static bool closer(RTCPointQueryFunctionArguments* call) {
    auto& search = *static_cast<Search*>(call->userPtr);
    const auto& [a, ab, ac] = search.triangles[call->primID];
    const InTriangle at(ab, ac, search.p - a);
    const Four nearest = a + ab * at.v + ac * at.w, away = search.p - nearest;
    const float distance2 = dot(away, away);
    if (!(distance2 < search.best2)) return false;
    search.best2 = distance2;
    search.nearest = nearest;
    search.v = at.v;
    search.w = at.w;
    search.triangle = call->primID;
    call->query->radius = std::min(call->query->radius, std::sqrt(distance2));
    return true;
  }

  RTCDevice device_ = nullptr;
  RTCScene scene_ = nullptr;
  ssize_t used_ = 0;
  std::vector<Sides> triangles_;
  std::vector<Normals> normals_;
  float size_ = 0;
  std::optional<Four> last_;
};

class Vdb : public Library {
 public:
  explicit Vdb(const Tessellation& surface) {
    name = std::string("OpenVDB ") + OPENVDB_LIBRARY_VERSION_STRING;
    const double start = process_cpu_seconds();
    Box3d box;
    for (const Vec3d p : surface.positions) box.add(p);
    const double voxel = diagonal(box) / kVoxels;
    const auto transform = openvdb::math::Transform::createLinearTransform(voxel);
    std::vector<openvdb::Vec3s> points;
    points.reserve(surface.positions.size());
    for (const Vec3d p : surface.positions) points.emplace_back(openvdb::Vec3d(p.x, p.y, p.z));
    std::vector<openvdb::Vec3I> triangles;
    triangles.reserve(surface.triangles.size());
    for (const Corners& t : surface.triangles) triangles.emplace_back(t[0], t[1], t[2]);
    grid_ =
        openvdb::tools::meshToSignedDistanceField<openvdb::FloatGrid>(*transform, points, triangles, {}, kBand, kBand);
    accessor_.emplace(grid_->getConstAccessor());
    stencil_.emplace(*grid_);
    per_voxel_ = 1 / voxel;
    build_seconds = process_cpu_seconds() - start;
    bytes = static_cast<std::size_t>(grid_->memUsage());
  }

  void forget() {}
  Nearest plain(Vec3d p) {
    const openvdb::tools::GridSampler<openvdb::FloatGrid::ConstAccessor, openvdb::tools::BoxSampler> sampler(
        *accessor_, grid_->transform());
    const double h = 0.5 / per_voxel_;
    const auto at = [&](double x, double y, double z) {
      return static_cast<double>(sampler.wsSample(openvdb::Vec3d(p.x + x, p.y + y, p.z + z)));
    };
    return answer(p, at(0, 0, 0), {at(h, 0, 0) - at(-h, 0, 0), at(0, h, 0) - at(0, -h, 0), at(0, 0, h) - at(0, 0, -h)});
  }
  Nearest best(Vec3d p, bool /*coherent*/) {
    const openvdb::Vec3f at(static_cast<float>(p.x * per_voxel_), static_cast<float>(p.y * per_voxel_),
                            static_cast<float>(p.z * per_voxel_));
    stencil_->moveTo(at);
    const auto slope = stencil_->gradient(at);
    return answer(p, static_cast<double>(stencil_->interpolation(at)), to_double(Vec3f{slope[0], slope[1], slope[2]}));
  }

 private:
  static constexpr double kVoxels = 256;  // along the diagonal
  static constexpr float kBand = 6;       // voxels to either side of the surface: 2 % of the diagonal

  static Nearest answer(Vec3d p, double distance, Vec3d slope) {
    const Vec3d normal = length(slope) > 0 ? normalized(slope) : Vec3d{0, 0, 1};
    return {.point = p - normal * distance, .normal = normal, .inside = distance < 0};
  }

  openvdb::FloatGrid::Ptr grid_;
  std::optional<openvdb::FloatGrid::ConstAccessor> accessor_;
  std::optional<openvdb::math::BoxStencil<openvdb::FloatGrid>> stencil_;
  double per_voxel_ = 1;
};

class Cgal : public Library {
  using Kernel = CGAL::Simple_cartesian<double>;  // no slower than a kernel that filters, and as right for distances
  using Triangles = std::vector<Kernel::Triangle_3>;
  using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;
  using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;

 public:
  explicit Cgal(const Tessellation& surface) : surface_(surface) {
    name = std::string("CGAL ") + CGAL_VERSION_STR;
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
    tree_.accelerate_distance_queries();
    build_seconds = process_cpu_seconds() - start;
    const std::size_t after = resident_bytes();
    bytes = after > before ? after - before : 0;
  }

  void forget() { last_.reset(); }
  Nearest plain(Vec3d p) { return answer(p, tree_.closest_point_and_primitive(Kernel::Point_3(p.x, p.y, p.z))); }
  Nearest best(Vec3d p, bool coherent) {
    if (!coherent || !last_) {
      last_ = tree_.closest_point_and_primitive(Kernel::Point_3(p.x, p.y, p.z));
      return answer(p, *last_);
    }
    last_ = tree_.closest_point_and_primitive(Kernel::Point_3(p.x, p.y, p.z), *last_);
    return answer(p, *last_);
  }

 private:
  Nearest answer(Vec3d p, const Tree::Point_and_primitive_id& found) const {
    const auto triangle = static_cast<std::size_t>(found.second - triangles_.cbegin());
    return nearest_on(surface_, surface_.triangles[triangle], p);
  }

  const Tessellation& surface_;
  Triangles triangles_;
  Tree tree_;
  std::optional<Tree::Point_and_primitive_id> last_;
};

template <typename Made>
void add_rows(const Tessellation& surface, const char* plain, const char* best,
              std::vector<std::unique_ptr<Contestant>>& rows) {
  const auto library = std::make_shared<Made>(surface);
  rows.push_back(std::make_unique<Row<Made>>(library, plain, false));
  rows.push_back(std::make_unique<Row<Made>>(library, best, true));
}

}  // namespace

std::vector<std::unique_ptr<Contestant>> make_peers(const Tessellation& surface) {
  std::vector<std::unique_ptr<Contestant>> rows;
  add_rows<Embree>(surface, "plain", "bounded", rows);
  add_rows<Vdb>(surface, "plain", "one stencil", rows);
  add_rows<Cgal>(surface, "plain", "last as hint", rows);
  return rows;
}

}  // namespace relief::bench
