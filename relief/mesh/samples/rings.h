// Meshes a parametrised surface with evenly sized triangles: rings of vertices, each with as many as its length asks
// for.
#pragma once

#include "sample_math.h"

#include <relief/base/error.h>
#include <relief/base/progress.h>
#include <relief/base/try.h>
#include <relief/mesh/triangle_mesh.h>

#include <algorithm>
#include <utility>
#include <vector>

namespace relief::detail {

/// Tells how far the making of a sample has come, in steps of a hundredth, and hears whether it should stop.
class SampleProgress {
 public:
  explicit SampleProgress(const Progress& progress) noexcept : progress_(progress) {}

  /// Cancelled when the caller wants no more. Cheap enough for every few hundred vertices.
  [[nodiscard]] Status reach(double share) {
    if (progress_.cancelled()) return fail(Errc::Cancelled, "making the sample was cancelled");
    if (share >= next_) {
      progress_("sample", share);
      next_ = std::min(1.0, share + 0.01);
    }
    return {};
  }

  // Shares of the whole at which the phases end.
  static constexpr double kPrepared = 0.05, kLaidOut = 0.1, kPlaced = 0.96, kJoined = 0.99;

 private:
  const Progress& progress_;
  double next_ = 0.0;
};

/// A surface over (s, turn) in [0,1] x [0,1): turn runs around, s along; it looks to the side of d/dturn x d/ds.
/// Either s = 0 and s = 1 are poles, or s closes upon itself (closed()).
class SampleSurface {
 public:
  struct Vertex {
    Vec3d position;
    Vec3d colour;  ///< sRGB, 0 .. 1
  };

  SampleSurface() = default;
  SampleSurface(const SampleSurface&) = delete;
  SampleSurface& operator=(const SampleSurface&) = delete;
  virtual ~SampleSurface() = default;

  /// Called once before all else, for tables that take long to fill. Cancelled.
  [[nodiscard]] virtual Status prepare(SampleProgress&) { return {}; }
  [[nodiscard]] virtual bool closed() const noexcept { return false; }
  /// Returns the shape without relief; triangles are made even on it.
  [[nodiscard]] virtual Vec3d coarse(double s, double turn) const noexcept = 0;
  /// Returns how much shorter than elsewhere edges should be near a point of the coarse shape; near 1 and smooth.
  [[nodiscard]] virtual double weight(Vec3d) const noexcept { return 1.0; }
  /// Returns the shape with all the relief that triangles of this edge length can carry.
  [[nodiscard]] virtual Vertex fine(double s, double turn, double edge) const noexcept = 0;
};

/// Says where the rings lie and how vertices are spread along them, so that neighbours are equally far apart on the
/// coarse shape in both directions.
class RingLayout {
 public:
  [[nodiscard]] static Result<RingLayout> make(const SampleSurface& surface, SampleProgress& progress);

  [[nodiscard]] double area() const noexcept { return area_; }
  /// Mean length of the meridians.
  [[nodiscard]] double height() const noexcept { return heights_.back(); }
  /// Length of the ring at this height.
  [[nodiscard]] double ring_length(double height) const noexcept;
  struct Place {
    double s, turn;
  };
  /// `count` places evenly along the ring at this height; the first lies `shift` of a step behind the start.
  void spread(double height, std::size_t count, double shift, std::vector<Place>& places) const;

 private:
  static constexpr std::size_t kRows = 192, kColumns = 256;
  /// From the coarse shape at the grid points.
  RingLayout(const SampleSurface& surface, const std::vector<Vec3d>& points);
  struct Row {
    std::size_t row;
    double part;
  };
  [[nodiscard]] Row find(double height) const noexcept;
  [[nodiscard]] static std::size_t at(std::size_t row, std::size_t column) noexcept {
    return row * (kColumns + 1) + column;
  }

  double area_ = 0.0;
  std::vector<double> s_;        ///< s at each grid point
  std::vector<double> along_;    ///< part of the ring's length before each grid point, 0 .. 1
  std::vector<double> lengths_;  ///< of each row
  std::vector<double> heights_;  ///< of each row above the first
};

inline Result<RingLayout> RingLayout::make(const SampleSurface& surface, SampleProgress& progress) {
  std::vector<Vec3d> points((kRows + 1) * (kColumns + 1));
  for (std::size_t i = 0; i <= kRows; ++i) {
    RELIEF_CHECK(
        progress.reach(mix(SampleProgress::kPrepared, SampleProgress::kLaidOut, double(i) / double(kRows + 1))));
    for (std::size_t j = 0; j <= kColumns; ++j)
      points[at(i, j)] = j == kColumns ? points[at(i, 0)] : surface.coarse(double(i) / kRows, double(j) / kColumns);
  }
  return RingLayout(surface, points);
}

inline RingLayout::RingLayout(const SampleSurface& surface, const std::vector<Vec3d>& points)
    : s_(points.size()), along_(s_.size()), lengths_(kRows + 1), heights_(kRows + 1) {
  const auto weighed = [&](Vec3d a, Vec3d b) { return length(b - a) * surface.weight((a + b) * 0.5); };

  // Steps along each meridian, smoothed around the ring so that neighbouring meridians keep pace.
  std::vector<double> steps(kRows * kColumns), blurred(kColumns);
  for (std::size_t i = 0; i < kRows; ++i) {
    double* const row = steps.data() + i * kColumns;
    double mean = 0.0;
    for (std::size_t j = 0; j < kColumns; ++j) mean += row[j] = weighed(points[at(i, j)], points[at(i + 1, j)]);
    mean /= double(kColumns);
    for (int pass = 0; pass < 12; ++pass) {
      for (std::size_t j = 0; j < kColumns; ++j)
        blurred[j] = 0.25 * (row[(j + kColumns - 1) % kColumns] + 2.0 * row[j] + row[(j + 1) % kColumns]);
      std::copy(blurred.begin(), blurred.end(), row);
    }
    for (std::size_t j = 0; j < kColumns; ++j) row[j] = 0.85 * row[j] + 0.15 * mean;
  }
  std::vector<Vec3d> even(points.size());
  for (std::size_t j = 0; j <= kColumns; ++j) {
    const std::size_t column = j % kColumns;
    double total = 0.0;
    for (std::size_t i = 0; i < kRows; ++i) total += steps[i * kColumns + column];
    double before = 0.0;
    for (std::size_t i = 0, k = 0; k <= kRows; ++k) {
      const double wish = total * double(k) / kRows;
      while (i + 1 < kRows && before + steps[i * kColumns + column] < wish) before += steps[i++ * kColumns + column];
      const double part = clamp01((wish - before) / steps[i * kColumns + column]);
      s_[at(k, j)] = (double(i) + part) / kRows;
      even[at(k, j)] = mix(points[at(i, column)], points[at(i + 1, column)], part);
    }
  }
  for (std::size_t i = 0; i <= kRows; ++i) {
    double total = 0.0;
    for (std::size_t j = 0; j < kColumns; ++j) total += weighed(even[at(i, j)], even[at(i, j + 1)]);
    lengths_[i] = total;
    double before = 0.0;
    for (std::size_t j = 0; j < kColumns; ++j) {
      const double step = weighed(even[at(i, j)], even[at(i, j + 1)]);
      along_[at(i, j)] = before;
      before += total > 0.0 ? 0.88 * step / total + 0.12 / kColumns : 1.0 / kColumns;
    }
    along_[at(i, kColumns)] = 1.0;
    if (i == 0) continue;
    double up = 0.0;
    for (std::size_t j = 0; j < kColumns; ++j) up += weighed(even[at(i - 1, j)], even[at(i, j)]);
    heights_[i] = heights_[i - 1] + up / double(kColumns);
    area_ += 0.5 * (lengths_[i] + lengths_[i - 1]) * (heights_[i] - heights_[i - 1]);
  }
  if (surface.closed()) return;
  // A pole has no ring of its own: it takes over how the next one is divided.
  for (std::size_t j = 0; j <= kColumns; ++j) {
    along_[at(0, j)] = along_[at(1, j)];
    along_[at(kRows, j)] = along_[at(kRows - 1, j)];
  }
}

inline RingLayout::Row RingLayout::find(double height) const noexcept {
  const auto above = std::upper_bound(heights_.begin() + 1, heights_.end() - 1, height);
  const auto row = static_cast<std::size_t>(above - heights_.begin()) - 1;
  return {row, clamp01((height - heights_[row]) / (heights_[row + 1] - heights_[row]))};
}

inline double RingLayout::ring_length(double height) const noexcept {
  const auto [row, part] = find(height);
  return mix(lengths_[row], lengths_[row + 1], part);
}

inline void RingLayout::spread(double height, std::size_t count, double shift, std::vector<Place>& places) const {
  const auto [row, part] = find(height);
  const auto along = [&](std::size_t j) { return mix(along_[at(row, j)], along_[at(row + 1, j)], part); };
  places.resize(count);
  std::size_t j = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const double wish = (double(k) + shift) / double(count);
    while (j + 1 < kColumns && along(j + 1) <= wish) ++j;
    const double across = clamp01((wish - along(j)) / (along(j + 1) - along(j)));
    const double low = mix(s_[at(row, j)], s_[at(row, j + 1)], across);
    const double high = mix(s_[at(row + 1, j)], s_[at(row + 1, j + 1)], across);
    places[k] = {mix(low, high, part), (double(j) + across) / double(kColumns)};
  }
}

/// Returns a closed mesh of about this many triangles, scaled and moved to stand on y = 0 and reach y = 100. Errors:
/// Cancelled.
Result<TriangleMesh> mesh_surface(SampleSurface&& surface, std::size_t triangles, const Progress& progress);

}  // namespace relief::detail
