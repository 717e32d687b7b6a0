// The repaired source as something that rays can be cast at.
#pragma once

#include <relief/base/vec.h>
#include <relief/convert/geometry/half_edges.h>
#include <relief/convert/geometry/lattice.h>

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

namespace relief::detail {

/// A crossing of a line with the source, at origin + t * direction.
struct Crossing {
  double t = 0;
  std::uint32_t triangle = 0;
  std::array<double, 3> weights{};  ///< of the triangle's corners
  double inside = 0;                ///< the least weight as it was found; below zero the line just misses the triangle
  bool front = false;               ///< the line leaves through the front: normal . direction > 0
};

inline constexpr std::size_t kMostCrossings = 64;
struct Crossings {
  std::array<Crossing, kMostCrossings> items;
  std::size_t count = 0;
  [[nodiscard]] std::span<const Crossing> all() const noexcept { return std::span(items).first(count); }
};

/// A fibre, or another line, in lattice coordinates.
struct Line {
  Vec3d origin, direction;
};

/// A hierarchy over the source's triangles (Embree). Queries are in lattice coordinates; the search runs in float
/// about the middle of the lattice, places are computed again in double. Queries may run on many threads at once.
class SourceRays {
 public:
  /// Points are in model units, `lattice` turns them into its coordinates. Points and faces must outlive it; faces with
  /// a point that is not finite are never met. About 60 bytes per triangle of its own, 100 where these are few. Throws
  /// std::bad_alloc.
  SourceRays(std::span<const Vec3d> points, std::span<const Face> faces, const Lattice& lattice);
  ~SourceRays();
  SourceRays(const SourceRays&) = delete;
  SourceRays& operator=(const SourceRays&) = delete;

  /// All crossings with from <= t <= to by ascending t; what passes through an edge or a corner counts once, in the
  /// triangle that it is most inside of. At most kMostCrossings, those met first by the search.
  void cross(Vec3d origin, Vec3d direction, double from, double to, Crossings& found) const;
  /// The same of at most kTogether lines, which takes half the time where they lie side by side. `found`: by line.
  void cross(std::span<const Line> lines, double from, double to, std::span<Crossings> found) const;
  static constexpr std::size_t kTogether = 8;

  /// Returns the unit normal of a triangle, zero where it has no area, and its area in square lattice steps.
  [[nodiscard]] Vec3d normal(std::uint32_t triangle) const noexcept { return normalized(twice_area(triangle)); }
  [[nodiscard]] double area(std::uint32_t triangle) const noexcept { return 0.5 * length(twice_area(triangle)); }

  [[nodiscard]] bool share_a_point(std::uint32_t s, std::uint32_t t) const noexcept {
    for (const std::uint32_t v : faces_[s])
      for (const std::uint32_t w : faces_[t])
        if (v == w) return true;
    return false;
  }

  /// The point of the surface nearest to p.
  struct Nearest {
    double distance = 0;  ///< in lattice steps; infinite where the surface has no triangle
    std::uint32_t triangle = 0;
    std::array<double, 3> weights{};  ///< of the triangle's corners
  };
  [[nodiscard]] Nearest nearest(Vec3d p) const;
  /// Returns where that is.
  [[nodiscard]] Vec3d place(const Nearest& nearest) const noexcept {
    const Face& f = faces_[nearest.triangle];
    return point(f[0]) * nearest.weights[0] + point(f[1]) * nearest.weights[1] + point(f[2]) * nearest.weights[2];
  }

 private:
  /// Returns where the line meets a triangle's plane; nothing where it runs along it.
  [[nodiscard]] std::optional<Crossing> crossing_with(std::uint32_t triangle, Vec3d origin, Vec3d direction) const;
  void find_crossings(const Line& line, double from, double to, std::span<const std::uint32_t> met,
                      Crossings& found) const;
  /// Returns a crossing that just misses its triangle, or in its place that of the triangle beside it that is crossed.
  [[nodiscard]] Crossing settle(const Crossing& near, Vec3d origin, Vec3d direction) const;
  [[nodiscard]] Vec3d twice_area(std::uint32_t triangle) const noexcept {
    const Face& f = faces_[triangle];
    const Vec3d a = point(f[0]);
    return relief::cross(point(f[1]) - a, point(f[2]) - a);
  }
  [[nodiscard]] Vec3d point(std::uint32_t v) const noexcept { return (points_[v] - origin_) * scale_; }
  struct Scene;
  std::span<const Vec3d> points_;
  std::span<const Face> faces_;
  Vec3d origin_;  // of the lattice
  double scale_;  // lattice steps per model unit
  std::unique_ptr<Scene> scene_;
};

}  // namespace relief::detail
