// Whether the displacement says where the source is.
#include <relief/verify/shell_facts.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

namespace relief::verify {

namespace {

using namespace detail;
using Vector = std::array<double, 3>;

Vector operator-(const Vector& a, const Vector& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
double dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
double length(const Vector& a) { return std::hypot(a[0], a[1], a[2]); }

/// A fibre between the corners; coordinates in steps.
struct Fibre {
  Vector inner, along;

  /// Whether it passes within a step of a box.
  [[nodiscard]] bool reaches(const Box& box) const {
    double from = 0, to = 1;
    for (std::size_t k = 0; k < 3; ++k) {
      const double low = static_cast<double>(box.low[k]) - 1 - inner[k];
      const double high = static_cast<double>(box.high[k]) + 1 - inner[k];
      if (along[k] == 0) {
        if (low > 0 || high < 0) return false;
        continue;
      }
      const double a = low / along[k], b = high / along[k];
      from = std::max(from, std::min(a, b));
      to = std::min(to, std::max(a, b));
    }
    return from <= to;
  }
};

class SampleChecker {
 public:
  SampleChecker(const Shell& shell, const Source& source, const CommonLattice& lattice, double tolerance)
      : shell_(shell), source_(source), lattice_(lattice), tolerance_(std::ldexp(tolerance, -lattice.step)) {
    for (const auto& p : source.positions) points_.push_back(place(p));
    boxes_.reserve(source.triangles.size());
    for (const auto& f : source.triangles) {
      const auto corner = [&](std::size_t k) { return narrow(lattice_.at(source.positions[f[k]])); };
      boxes_.push_back(box_of(corner(0), corner(1), corner(2)));
    }
  }

  SampleCheck run(std::span<const SampleTile> tiles) {
    const Tree tree(boxes_);
    const auto bound = bound_samples(tiles);
    for (std::size_t s = 0; s < std::min(tiles.size(), shell_.triangles.size()); ++s) {
      const SampleTile& tile = tiles[s];
      if (tile.values.empty()) continue;
      const auto n = static_cast<std::size_t>(std::max(tile.intervals, 0));
      if (n == 0 || tile.values.size() != (n + 1) * (n + 2) / 2) {
        note(s, 0, "the tile of slab " + std::to_string(s) + " has the wrong size");
        continue;
      }
      std::size_t at = 0;
      for (std::size_t j = 0; j <= n; ++j)
        for (std::size_t i = 0; i + j <= n; ++i, ++at)
          if (!bound.contains({s, at})) check(tree, s, at, fibre(s, n, i, j), tile.values[at]);
    }
    check_.worst = std::ldexp(check_.worst, lattice_.step);
    return std::move(check_);
  }

 private:
  /// Slab and number of the samples that a coarser neighbour lacks.
  [[nodiscard]] std::set<std::pair<std::size_t, std::size_t>> bound_samples(std::span<const SampleTile> tiles) const {
    std::set<std::pair<std::size_t, std::size_t>> bound;
    for (const SharedEdge& edge : shared_edges(shell_))
      for (std::size_t side = 0; side < 2; ++side) {
        const std::uint32_t slab = edge.slab[side], other = edge.slab[1 - side];
        if (std::max(slab, other) >= tiles.size()) continue;
        const int n = tiles[slab].intervals, m = tiles[other].intervals;
        for (int t = 1; m > 0 && m < n && t < n; ++t)
          if (t * m % n != 0) bound.emplace(slab, sample_on_edge(n, edge.edge[side], t));
      }
    return bound;
  }
  void note(std::size_t slab, std::size_t sample, std::string what) {
    if (check_.off++ < kListed)
      check_.failures.push_back(
          {Condition::C7, static_cast<std::uint32_t>(slab), static_cast<std::uint32_t>(sample), std::move(what)});
  }
  [[nodiscard]] Vector place(const std::array<double, 3>& p) const {
    Vector v{};
    for (std::size_t k = 0; k < 3; ++k) v[k] = std::ldexp(p[k] - lattice_.origin[k], -lattice_.step);
    return v;
  }
  [[nodiscard]] Fibre fibre(std::size_t slab, std::size_t n, std::size_t i, std::size_t j) const {
    const std::array<std::size_t, 3> w = {n - i - j, i, j};
    Vector inner{}, outer{};
    for (std::size_t c = 0; c < 3; ++c) {
      const double share = static_cast<double>(w[c]) / static_cast<double>(n);
      const Vector in = place(shell_.inner[shell_.triangles[slab][c]]);
      const Vector out = place(shell_.outer[shell_.triangles[slab][c]]);
      for (std::size_t k = 0; k < 3; ++k) {
        inner[k] += share * in[k];
        outer[k] += share * out[k];
      }
    }
    return {inner, outer - inner};
  }

  void check(const Tree& tree, std::size_t slab, std::size_t sample, const Fibre& fibre, float value) {
    ++check_.tested;
    hits_.clear();
    tree.descend_if([&](const Box& box) { return fibre.reaches(box); },
                    [&](std::uint32_t t) {
                      if (fibre.reaches(boxes_[t])) cross_triangle(fibre, t);
                      return true;
                    });
    std::sort(hits_.begin(), hits_.end());
    // What passes through an edge or a vertex meets several triangles at one place.
    const double whole = length(fibre.along), apart = std::max(1e-7, 0x1p-20 / std::max(whole, 1.0));
    std::size_t places = 0;
    for (std::size_t k = 0; k < hits_.size(); ++k)
      if (k == 0 || hits_[k] - hits_[k - 1] > apart) ++places;
    ++(places == 0 ? check_.none : places == 1 ? check_.single : check_.several);
    const auto name = [&] { return "sample " + std::to_string(sample) + " of slab " + std::to_string(slab); };
    if (!(value >= 0.0F && value <= 1.0F)) return note(slab, sample, name() + " is not in 0..1");
    if (places == 0) return note(slab, sample, name() + " has a fibre that does not meet the source");
    double nearest = whole;
    for (const double hit : hits_) nearest = std::min(nearest, std::abs(hit - static_cast<double>(value)) * whole);
    check_.worst = std::max(check_.worst, nearest);
    if (nearest > tolerance_)
      note(slab, sample,
           name() + " lies " + std::to_string(std::ldexp(nearest, lattice_.step)) +
               " away from where its fibre meets the source");
  }

  void cross_triangle(const Fibre& fibre, std::uint32_t t) {
    const auto& f = source_.triangles[t];
    const Vector a = points_[f[0]] - fibre.inner, b = points_[f[1]] - fibre.inner, c = points_[f[2]] - fibre.inner;
    const double u = dot(fibre.along, cross(b, c)), v = dot(fibre.along, cross(c, a)),
                 w = dot(fibre.along, cross(a, b));
    const double sum = u + v + w, slack = 1e-12 * (std::abs(u) + std::abs(v) + std::abs(w));
    if (sum == 0) return;
    if (!((u >= -slack && v >= -slack && w >= -slack) || (u <= slack && v <= slack && w <= slack))) return;
    const Vector n = cross(b - a, c - a);
    const double steep = dot(n, fibre.along);
    if (steep == 0) return;
    const double at = dot(n, a) / steep;
    if (at >= -1e-9 && at <= 1 + 1e-9) hits_.push_back(at);
  }

  const Shell& shell_;
  const Source& source_;
  const CommonLattice& lattice_;
  double tolerance_;  // steps
  SampleCheck check_;
  std::vector<Vector> points_;  // by source vertex
  std::vector<Box> boxes_;      // by source triangle
  std::vector<double> hits_;    // scratch
};

}  // namespace

SampleCheck check_samples(const Shell& shell, const Source& source, std::span<const SampleTile> tiles,
                          double tolerance) {
  Extent extent;
  const std::string fault = source_fault(source, extent);
  const CommonLattice lattice(extent_of(shell), extent);
  if (!fault.empty() || !lattice.fits) {
    SampleCheck refused;
    refused.off = 1;
    refused.failures.push_back(
        {Condition::C7, kNothing, kNothing,
         !fault.empty() ? fault
                        : "the source reaches so far beyond the slabs that no lattice of 2^30 steps holds both"});
    return refused;
  }
  return SampleChecker(shell, source, lattice, tolerance).run(tiles);
}

}  // namespace relief::verify
