// Whether the displacement says where the source is.
#include <relief/verify/shell_facts.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
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
double length(const Vector& a) { return std::sqrt(dot(a, a)); }

/// Returns a length to three digits, however small or large the model is.
std::string length_text(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.3g", value);
  return text.data();
}

/// A fibre between the corners; coordinates in steps.
struct Fibre {
  Vector inner, along;

  /// Returns whether it passes within a step of a box.
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

double away(const Vector& p, const Vector& a, const Vector& b) {  // a point from a segment
  const Vector e = b - a, w = p - a;
  const double along = dot(w, e), whole = dot(e, e);
  const double share = along <= 0 ? 0 : along >= whole ? 1 : along / whole;
  return length({w[0] - share * e[0], w[1] - share * e[1], w[2] - share * e[2]});
}
double away(const Vector& p, const Vector& a, const Vector& b, const Vector& c) {  // a point from a triangle
  const Vector n = cross(b - a, c - a);
  const bool above =
      dot(n, cross(b - a, p - a)) > 0 && dot(n, cross(c - b, p - b)) > 0 && dot(n, cross(a - c, p - c)) > 0;
  if (above) return std::abs(dot(n, p - a)) / length(n);
  return std::min({away(p, a, b), away(p, b, c), away(p, c, a)});
}

/// Returns how far a surface lies from the source at most when its vertices are the source's, rounded to the lattice of
/// the shell: half the diagonal of a cell, whatever the triangle. Nothing where the source lies on that lattice.
double rounding_of(const Extent& shell, const Extent& source) {
  const int step = shell.likely_step();
  return source.lowest >= step ? 0 : std::ldexp(std::sqrt(0.75), step);
}

class SampleChecker {
 public:
  /// `tolerance`, `rounding`: model units.
  SampleChecker(const Shell& shell, const Source& source, const CommonLattice& lattice, double tolerance,
                double rounding, const std::optional<SampleMarks>& marks)
      : shell_(shell),
        source_(source),
        lattice_(lattice),
        tolerance_(std::ldexp(tolerance, -lattice.step)),
        rounding_(std::ldexp(rounding, -lattice.step)),
        marks_(marks),
        said_(marks && !source.phantom_from ? source.triangles.size() : 0, Said::Nothing) {
    for (const auto& p : source.positions) points_.push_back(place(p));
    boxes_.reserve(source.triangles.size());
    for (const auto& f : source.triangles) {
      const auto corner = [&](std::size_t k) { return narrow(lattice_.at(source.positions[f[k]])); };
      boxes_.push_back(box_of(corner(0), corner(1), corner(2)));
    }
  }

  SampleCheck run(std::span<const SampleTile> tiles, const Progress& progress) {
    const Tree tree(boxes_);
    const auto bound = bound_samples(tiles);
    const std::size_t slabs = std::min(tiles.size(), shell_.triangles.size());
    for (std::size_t s = 0, told = 0; s < slabs && !progress.cancelled(); ++s) {
      if (const std::size_t percent = 100 * s / slabs; s == 0 || percent > told) {
        told = percent;
        progress("compare", static_cast<double>(s) / static_cast<double>(slabs));
      }
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
          if (!bound.contains({s, at}) && wanted(s)) check(tree, s, at, fibre(s, n, i, j), tile.values[at]);
    }
    check_.worst = std::ldexp(check_.worst, lattice_.step);
    return std::move(check_);
  }

 private:
  /// Slab and number of the samples that a coarser neighbour lacks.
  [[nodiscard]] std::set<std::pair<std::size_t, std::size_t>> bound_samples(std::span<const SampleTile> tiles) const {
    std::set<std::pair<std::size_t, std::size_t>> bound;
    for_each_shared_edge(shell_, [&](const SharedEdge& edge) {
      for (std::size_t side = 0; side < 2; ++side) {
        const std::uint32_t slab = edge.slab[side], other = edge.slab[1 - side];
        if (std::max(slab, other) >= tiles.size()) continue;
        const int n = tiles[slab].intervals, m = tiles[other].intervals;
        for (int t = 1; m > 0 && m < n && t < n; ++t)
          if (t * m % n != 0) bound.emplace(slab, sample_on_edge(n, edge.edge[side], t));
      }
    });
    return bound;
  }
  /// Returns whether what a sample of the slab says could still be counted, or name the slab.
  [[nodiscard]] bool wanted(std::size_t slab) {
    if (check_.off < kCounted || check_.slabs.back() != slab) return true;
    check_.at_least = true;
    return false;
  }
  void note(std::size_t slab, std::size_t sample, std::string what) {
    if (check_.slabs.empty() || check_.slabs.back() != slab) check_.slabs.push_back(static_cast<std::uint32_t>(slab));
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
    const double whole = length(fibre.along);
    tree.descend_if([&](const Box& box) { return fibre.reaches(box); },
                    [&](std::uint32_t t) {
                      if (fibre.reaches(boxes_[t])) cross_triangle(fibre, whole, t);
                      return true;
                    });
    std::sort(hits_.begin(), hits_.end(), [](const Hit& a, const Hit& b) { return a.at < b.at; });
    // What passes through an edge or a vertex meets several triangles at one place.
    const double apart = std::max(1e-7, 0x1p-20 / std::max(whole, 1.0));
    std::size_t places = 0;
    double nearest = whole, last = 0;
    for (const Hit& hit : hits_) {
      if (hit.how == Hit::How::Grazed) continue;
      if (places == 0 || hit.at - last > apart) ++places;
      last = hit.at;
      nearest = std::min(nearest, std::abs(hit.at - static_cast<double>(value)) * whole);
    }
    ++(places == 0 ? check_.none : places == 1 ? check_.single : check_.several);
    const auto name = [&] { return "sample " + std::to_string(sample) + " of slab " + std::to_string(slab); };
    if (!(value >= 0.0F && value <= 1.0F)) return note(slab, sample, name() + " is not in 0..1");
    const bool is_void = marks_ && marked(marks_->voids, slab, sample);
    const bool is_folded = marks_ && marked(marks_->folded, slab, sample);
    // A mark that its fibre does not meet the source once: where it leaves it nowhere, there is no place to lie at.
    if (is_folded && std::ranges::none_of(hits_, [](const Hit& h) { return h.leaves && h.how != Hit::How::Grazed; }))
      return;
    if (places == 0) {
      if (is_void && !source_.phantom_from) return;
      // Where the source passes through the fibre's end, or that grazes it, either may be what it is taken for.
      if (std::ranges::any_of(
              hits_, [&](const Hit& h) { return std::abs(h.at - static_cast<double>(value)) * whole <= tolerance_; }))
        return;
      return note(slab, sample, name() + " has a fibre that does not meet the source");
    }
    check_.worst = std::max(check_.worst, nearest);
    if (nearest > tolerance_ && !lies_on_rounded(tree, fibre, value, whole))
      return note(slab, sample,
                  name() + " lies " + length_text(std::ldexp(nearest, lattice_.step)) +
                      " away from where its fibre meets the source");
    if (!marks_) return;
    std::string wrong = wrong_void(is_void, value, whole, std::max(nearest, tolerance_));
    if (wrong.empty()) wrong = wrong_fold(is_folded, whole);
    if (!wrong.empty()) note(slab, sample, name() + wrong);
  }

  /// Returns whether the sample lies as near to the source as a surface must whose vertices are the source's, rounded.
  /// Along a fibre that grazes them the two are further apart, by 1 / sine, and it may meet them in different
  /// triangles.
  [[nodiscard]] bool lies_on_rounded(const Tree& tree, const Fibre& fibre, float value, double whole) const {
    if (rounding_ == 0) return false;
    Vector p = fibre.inner;
    for (std::size_t k = 0; k < 3; ++k) p[k] += static_cast<double>(value) * fibre.along[k];
    const double reach = rounding_ + 0x1p-24 * whole;  // the value is a float
    Point low{}, high{};
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::llround(std::floor(p[k] - reach)) - 1;
      high[k] = std::llround(std::ceil(p[k] + reach)) + 1;
    }
    bool found = false;
    tree.query({narrow(low), narrow(high)}, [&](std::uint32_t t) {
      const auto& f = source_.triangles[t];
      found = away(p, points_[f[0]], points_[f[1]], points_[f[2]]) <= reach;
      return !found;
    });
    return found;
  }

  [[nodiscard]] bool marked(std::span<const SampleTile> tiles, std::size_t slab, std::size_t sample) const {
    return slab < tiles.size() && sample < tiles[slab].values.size() && tiles[slab].values[sample] > 0.5F;
  }
  /// Returns what is wrong with the mark of a sample of which the surface lies here, within `reach` along the fibre, or
  /// with its absence; else nothing.
  [[nodiscard]] std::string wrong_void(bool is_void, float value, double whole, double reach) {
    bool can_be = false, clear = true;
    std::size_t here = 0;
    std::uint32_t triangle = 0;
    for (const Hit& hit : hits_) {
      if (std::abs(hit.at - static_cast<double>(value)) * whole > reach) continue;
      ++here;
      clear = clear && hit.how == Hit::How::Clear;
      triangle = hit.triangle;
      const Said said =
          source_.phantom_from ? (triangle >= *source_.phantom_from ? Said::Void : Said::Surface) : said_[triangle];
      can_be = can_be || said == Said::Nothing || said == (is_void ? Said::Void : Said::Surface);
    }
    if (!source_.phantom_from) {
      if (here != 1 || !clear) return {};  // it says nothing of any one triangle
      if (can_be) said_[triangle] = is_void ? Said::Void : Said::Surface;
    }
    if (can_be) return {};
    if (!source_.phantom_from)
      return std::string(is_void ? " is marked void, but others" : " is not marked void, but others") +
             " on source triangle " + std::to_string(triangle) + (is_void ? " are not" : " are");
    return is_void ? " is marked void, but its fibre meets the surface there"
                   : " is not marked void, but only what closes an opening is there";
  }
  /// Returns the same for the mark that its fibre, which leaves the source, does so several times.
  [[nodiscard]] std::string wrong_fold(bool folded, double whole) const {
    constexpr double kEnd = 1e-5;  // of the fibre: what meets it nearer to its ends may be beyond them
    struct Range {
      double low = std::numeric_limits<double>::infinity(), high = -low;
    };
    Range enters, leaves;
    bool one_way = true;
    for (const Hit& hit : hits_) {
      one_way = one_way && hit.leaves == hits_.front().leaves;
      if (hit.how != Hit::How::Clear || hit.at < kEnd || hit.at > 1 - kEnd) continue;
      Range& range = hit.leaves ? leaves : enters;
      range = {std::min(range.low, hit.at), std::max(range.high, hit.at)};
    }
    const bool often = std::max(leaves.high - enters.low, enters.high - leaves.low) * whole > tolerance_;
    if (!folded) return often ? " is not marked folded, but its fibre enters and leaves the source" : std::string();
    const bool at_one_place =
        hits_.size() < 2 || (one_way && (hits_.back().at - hits_.front().at) * whole <= tolerance_);
    return at_one_place ? " is marked folded, but its fibre meets the source once" : std::string();
  }

  void cross_triangle(const Fibre& fibre, double whole, std::uint32_t t) {
    constexpr double kGraze = 0x1p-8;  // steps
    const auto& f = source_.triangles[t];
    const Vector a = points_[f[0]] - fibre.inner, b = points_[f[1]] - fibre.inner, c = points_[f[2]] - fibre.inner;
    // The distance of the fibre's line from an edge, times the lengths of both and the sine between them.
    double u = dot(fibre.along, cross(b, c)), v = dot(fibre.along, cross(c, a)), w = dot(fibre.along, cross(a, b));
    const double sum = u + v + w, slack = 1e-12 * (std::abs(u) + std::abs(v) + std::abs(w));
    if (sum == 0) return;
    if (sum < 0) {
      u = -u;
      v = -v;
      w = -w;
    }
    const double graze = kGraze * whole;
    const Vector e = b - a, g = c - a;
    const double longest = length(e) + length(g);
    if (std::min({u, v, w}) < -std::max(slack, graze * longest)) return;
    const Vector n = cross(e, g);
    const double steep = dot(n, fibre.along);
    if (steep == 0) return;
    const double at = dot(n, a) / steep;
    const double of_u = graze * length(g - e), of_v = graze * length(g), of_w = graze * length(e);
    Hit hit = {.at = at, .triangle = t, .leaves = steep > 0, .how = Hit::How::Grazed};
    if (u >= -slack && v >= -slack && w >= -slack && at >= -1e-9 && at <= 1 + 1e-9)
      hit.how = u > of_u && v > of_v && w > of_w ? Hit::How::Clear : Hit::How::Met;
    else if (!marks_ || u < -of_u || v < -of_v || w < -of_w || at < -1e-5 || at > 1 + 1e-5)
      return;
    hits_.push_back(hit);
  }

  /// A place where a fibre meets a triangle of the source.
  struct Hit {
    /// Beside it or beyond the fibre's ends by no more than rounding; on it; and nowhere near its edges.
    enum class How : std::uint8_t { Grazed, Met, Clear };
    double at;  // along the fibre
    std::uint32_t triangle;
    bool leaves;  // through its front
    How how;
  };
  /// What the samples on a triangle say of it.
  enum class Said : std::uint8_t { Nothing, Surface, Void };

  const Shell& shell_;
  const Source& source_;
  const CommonLattice& lattice_;
  double tolerance_, rounding_;  // steps
  SampleCheck check_;
  std::vector<Vector> points_;  // by source vertex
  std::vector<Box> boxes_;      // by source triangle
  const std::optional<SampleMarks>& marks_;
  std::vector<Said> said_;  // by source triangle, where the source does not say it; else empty
  std::vector<Hit> hits_;   // scratch
};

}  // namespace

SampleCheck check_samples(const Shell& shell, const Source& source, std::span<const SampleTile> tiles, double tolerance,
                          const std::optional<SampleMarks>& marks, const Progress& progress) {
  Extent extent;
  const Extent slabs = extent_of(shell);
  const std::string fault = source_fault(source, extent);
  const CommonLattice lattice(slabs, extent);
  if (!fault.empty() || !lattice.fits) {
    SampleCheck refused;
    refused.off = 1;
    refused.failures.push_back(
        {Condition::C7, kNothing, kNothing,
         !fault.empty() ? fault
                        : "the source reaches so far beyond the slabs that no lattice of 2^30 steps holds both"});
    return refused;
  }
  return SampleChecker(shell, source, lattice, tolerance, rounding_of(slabs, extent), marks).run(tiles, progress);
}

}  // namespace relief::verify
