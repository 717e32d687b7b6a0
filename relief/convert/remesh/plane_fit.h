// The point that lies nearest to some planes, in the directions that they decide.
#pragma once

#include <relief/base/vec.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace relief::detail {

/// Fits a point to planes: the minimiser of the quadratic error function by its eigenvectors, without the small ones
/// (Ju et al. 2002, Lindstrom 2000). Where the planes leave it free, it stays at the given point.
class PlaneFit {
 public:
  explicit PlaneFit(Vec3d near) noexcept : near_(near) {}

  /// The plane through a point with a unit normal.
  void add(Vec3d normal, Vec3d on) noexcept {
    const double d = dot(normal, on - near_);
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) matrix_[i][j] += normal[i] * normal[j];
      right_[i] += normal[i] * d;
    }
  }

  /// Returns how many directions the planes decide: 1 where they are all but parallel, 2 along an edge, 3 in a corner.
  /// Call before at().
  [[nodiscard]] int solve() noexcept {
    find_eigenvectors();
    rank_ = 0;
    while (rank_ < 3 && value_[static_cast<std::size_t>(rank_)] > kLeast * value_[0]) ++rank_;
    return rank_;
  }
  /// Returns the fit in the `rank` directions that are decided best.
  [[nodiscard]] Vec3d at(int rank) const noexcept {
    Vec3d p = near_;
    for (std::size_t k = 0; k < static_cast<std::size_t>(std::min(rank, rank_)); ++k)
      p += vector_[k] * (dot(vector_[k], right_) / value_[k]);
    return p;
  }

 private:
  /// Ratio of eigenvalues: two planes that meet at 16 degrees or more are an edge, whatever number there is of each up
  /// to ten to one.
  static constexpr double kLeast = 0.005;
  static constexpr double kZero = 1e-15;  // share of the trace
  static constexpr int kSweeps = 12;      // of rotations; three or four lead to zero

  /// Jacobi rotations, then the greatest eigenvalue first.
  void find_eigenvectors() noexcept {
    auto a = matrix_;
    std::array<Vec3d, 3> v = {Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}};
    const double trace = a[0][0] + a[1][1] + a[2][2];
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
      if (std::abs(a[0][1]) + std::abs(a[0][2]) + std::abs(a[1][2]) <= kZero * trace) break;
      for (std::size_t p = 0; p < 2; ++p)
        for (std::size_t q = p + 1; q < 3; ++q) {
          if (a[p][q] == 0) continue;
          const double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
          const double t = (theta < 0 ? -1 : 1) / (std::abs(theta) + std::hypot(theta, 1));
          const double c = 1 / std::hypot(t, 1), s = t * c;
          for (std::size_t k = 0; k < 3; ++k) {
            const double kp = a[k][p], kq = a[k][q];
            a[k][p] = c * kp - s * kq;
            a[k][q] = s * kp + c * kq;
          }
          for (std::size_t k = 0; k < 3; ++k) {
            const double pk = a[p][k], qk = a[q][k];
            a[p][k] = c * pk - s * qk;
            a[q][k] = s * pk + c * qk;
          }
          const Vec3d vp = v[p], vq = v[q];
          v[p] = vp * c - vq * s;
          v[q] = vp * s + vq * c;
        }
    }
    std::array<std::size_t, 3> order = {0, 1, 2};
    std::ranges::stable_sort(order, [&](std::size_t i, std::size_t j) { return a[i][i] > a[j][j]; });
    for (std::size_t k = 0; k < 3; ++k) {
      value_[k] = a[order[k]][order[k]];
      vector_[k] = v[order[k]];
    }
  }

  Vec3d near_;
  std::array<std::array<double, 3>, 3> matrix_{};
  Vec3d right_;
  std::array<double, 3> value_{};
  std::array<Vec3d, 3> vector_{};
  int rank_ = 0;
};

}  // namespace relief::detail
