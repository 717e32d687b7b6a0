#include <relief/base/free_memory.h>
#include <relief/verify/shell_facts.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>
#include <utility>

namespace relief::verify {

namespace {

using namespace detail;

std::string slab_name(std::size_t t) { return "slab " + std::to_string(t); }
std::string fibre_name(std::size_t f) { return "fibre " + std::to_string(f); }

class Checker {
 public:
  /// `facts`: what is known of the shell once it has passed C0.
  Checker(const Shell& shell, ShellFacts& facts, const Progress& progress)
      : shell_(shell), facts_(facts), progress_(progress) {}

  Certificate run() {
    Certificate& c = certificate_;
    c.failed.assign(shell_.triangles.size(), 0);
    c.holds[0] = numbers_hold() && snap() && complex_holds();
    if (!c.holds[0]) {
      name_slabs_of_bad_fibres();
      return std::move(c);
    }
    make_components();
    const bool sound = jacobians_hold();
    c.holds[1] = sound;
    c.holds[2] = windings_hold();
    // What follows takes their place.
    free_memory(fans_, fan_begin_, neighbours_);
    collect_boxes();
    const Tree tree(boxes_);
    c.holds[3] = pairs_hold(tree) && volumes_hold();
    c.holds[4] = c.holds[3] && nesting_holds(tree);
    return std::move(c);
  }

 private:
  void report(Condition condition, std::size_t a, std::size_t b, std::string what) {
    if (certificate_.failure_count[static_cast<std::size_t>(condition)]++ < kListed)
      certificate_.failures.push_back(
          {condition, static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b), std::move(what)});
  }
  /// A failure of one or two slabs.
  void report_slabs(Condition condition, std::size_t a, std::size_t b, std::string what) {
    fail_in(certificate_.failed, condition, a);
    fail_in(certificate_.failed, condition, b);
    report(condition, a, b, std::move(what));
  }
  [[nodiscard]] std::size_t count(Condition condition) const {
    return certificate_.failure_count[static_cast<std::size_t>(condition)];
  }

  [[nodiscard]] Point inner(std::uint32_t f) const { return widen(inner_[f]); }
  [[nodiscard]] Point outer(std::uint32_t f) const { return widen(outer_[f]); }

  // ---- C0

  /// A C0 failure of a fibre is filed under the first slab that names it, and fails in all that do.
  void report_fibre(std::size_t f, std::string_view what) {
    if (slab_with_.empty()) {
      bad_fibres_.assign(shell_.inner.size(), false);
      slab_with_.assign(shell_.inner.size(), kNothing);
      for (std::size_t t = shell_.triangles.size(); t-- > 0;)
        for (const std::uint32_t g : shell_.triangles[t])
          if (g < slab_with_.size()) slab_with_[g] = static_cast<std::uint32_t>(t);
    }
    bad_fibres_[f] = true;
    report(Condition::C0, slab_with_[f], slab_with_[f], fibre_name(f) + std::string(what));
  }
  void name_slabs_of_bad_fibres() {
    for (std::size_t t = 0; t < shell_.triangles.size(); ++t)
      for (const std::uint32_t f : shell_.triangles[t])
        if (f < bad_fibres_.size() && bad_fibres_[f]) fail_in(certificate_.failed, Condition::C0, t);
  }

  bool numbers_hold() {
    if (shell_.inner.size() != shell_.outer.size()) {
      report(Condition::C0, kNothing, kNothing,
             "there are " + std::to_string(shell_.inner.size()) + " inner but " + std::to_string(shell_.outer.size()) +
                 " outer ends of fibres");
      return false;
    }
    if (shell_.triangles.empty()) {
      report(Condition::C0, kNothing, kNothing, "there are no slabs");
      return false;
    }
    for (std::size_t t = 0; t < shell_.triangles.size(); ++t)
      for (const std::uint32_t f : shell_.triangles[t])
        if (f >= shell_.inner.size())
          report_slabs(
              Condition::C0, t, t,
              slab_name(t) + " names fibre " + std::to_string(f) + " of " + std::to_string(shell_.inner.size()));
    for (std::size_t f = 0; f < shell_.inner.size(); ++f)
      for (std::size_t k = 0; k < 3; ++k)
        if (!std::isfinite(shell_.inner[f][k]) || !std::isfinite(shell_.outer[f][k])) {
          report_fibre(f, " has a coordinate that is not a finite number");
          break;
        }
    return count(Condition::C0) == 0;
  }

  /// Counts in steps of the coarsest power of two of which all coordinates are multiples, from the lowest corner.
  bool snap() {
    facts_.extent = extent_of(shell_);
    const int step = facts_.extent.step();
    const double span = facts_.extent.span(step);
    if (!(span <= kMaxSpan)) {
      report(Condition::C0, kNothing, kNothing,
             "the coordinates lie on no lattice of at most 2^30 steps (they are multiples of 2^" +
                 std::to_string(step) + " and span more): snap them to a coarser one");
      return false;
    }
    certificate_.on_lattice = true;
    certificate_.lattice_step = std::ldexp(1.0, step);
    predicates_ = Predicates(span);
    const auto convert = [&](const Triples<double>& ends) {
      std::vector<Place> places(ends.size());
      for (std::size_t f = 0; f < ends.size(); ++f) {
        const auto end = ends[f];
        for (std::size_t k = 0; k < 3; ++k)
          places[f][k] = static_cast<std::int32_t>(std::ldexp(end[k] - facts_.extent.low[k], -step));
      }
      return places;
    };
    inner_ = convert(shell_.inner);
    outer_ = convert(shell_.outer);
    return true;
  }

  bool complex_holds() {
    for (std::size_t f = 0; f < inner_.size(); ++f)
      if (inner_[f] == outer_[f]) report_fibre(f, " has no length");
    triangles_hold();
    if (count(Condition::C0) == 0) edges_hold();
    if (count(Condition::C0) == 0) fans_hold();
    return count(Condition::C0) == 0;
  }

  void triangles_hold() {
    std::vector<std::pair<std::array<std::uint32_t, 3>, std::uint32_t>> sorted;
    sorted.reserve(shell_.triangles.size());
    for (std::size_t t = 0; t < shell_.triangles.size(); ++t) {
      std::array<std::uint32_t, 3> f = shell_.triangles[t];
      std::sort(f.begin(), f.end());
      if (f[0] == f[1] || f[1] == f[2]) report_slabs(Condition::C0, t, t, slab_name(t) + " names a fibre twice");
      sorted.emplace_back(f, static_cast<std::uint32_t>(t));
    }
    std::sort(sorted.begin(), sorted.end());
    for (std::size_t k = 1; k < sorted.size(); ++k)
      if (sorted[k].first == sorted[k - 1].first)
        report_slabs(
            Condition::C0, sorted[k - 1].second, sorted[k].second,
            slab_name(sorted[k - 1].second) + " and " + slab_name(sorted[k].second) + " have the same three fibres");
  }

  /// Fills neighbours_: entry k of a slab is the slab across the edge opposite its corner k.
  void edges_hold() {
    struct Edge {
      std::uint32_t low, high, slab;
      std::uint8_t corner;
      bool upwards;
    };
    std::vector<Edge> edges;
    edges.reserve(3 * shell_.triangles.size());
    for (std::uint32_t t = 0; t < shell_.triangles.size(); ++t)
      for (std::uint8_t k = 0; k < 3; ++k) {
        const std::uint32_t a = shell_.triangles[t][(k + 1U) % 3], b = shell_.triangles[t][(k + 2U) % 3];
        edges.push_back({std::min(a, b), std::max(a, b), t, k, a < b});
      }
    std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
      return std::tuple(a.low, a.high, a.slab, a.corner) < std::tuple(b.low, b.high, b.slab, b.corner);
    });
    neighbours_.assign(shell_.triangles.size(), {kNothing, kNothing, kNothing});
    for (std::size_t first = 0, last = 0; first < edges.size(); first = last) {
      while (last < edges.size() && edges[last].low == edges[first].low && edges[last].high == edges[first].high)
        ++last;
      if (last - first == 1) continue;
      const Edge &a = edges[first], &b = edges[first + 1];
      const std::string where = "the edge between fibres " + std::to_string(a.low) + " and " + std::to_string(a.high);
      if (last - first > 2) {
        for (std::size_t k = first; k < last; ++k) fail_in(certificate_.failed, Condition::C0, edges[k].slab);
        report(Condition::C0, a.slab, b.slab, where + " lies in " + std::to_string(last - first) + " slabs");
      } else if (a.upwards == b.upwards) {
        report_slabs(Condition::C0, a.slab, b.slab,
                     slab_name(a.slab) + " and " + slab_name(b.slab) + " run the same way through " + where);
      } else {
        neighbours_[a.slab][a.corner] = b.slab;
        neighbours_[b.slab][b.corner] = a.slab;
      }
    }
  }

  /// A corner of a slab.
  struct Corner {
    std::uint32_t slab, corner;
  };
  /// Returns the corners at a fibre, once fans_hold() has been there: counter-clockwise.
  [[nodiscard]] std::span<Corner> fan(std::size_t f) {
    return std::span(fans_).subspan(fan_begin_[f], fan_begin_[f + 1] - fan_begin_[f]);
  }

  void fans_hold() {
    fan_begin_.assign(inner_.size() + 1, 0);
    for (const auto& fibres : shell_.triangles)
      for (const std::uint32_t f : fibres) ++fan_begin_[f + 1];
    std::partial_sum(fan_begin_.begin(), fan_begin_.end(), fan_begin_.begin());
    fans_.resize(3 * shell_.triangles.size());
    {
      std::vector<std::uint32_t> filled(fan_begin_.begin(), fan_begin_.end() - 1);
      for (std::uint32_t t = 0; t < shell_.triangles.size(); ++t)
        for (std::uint32_t k = 0; k < 3; ++k) fans_[filled[shell_.triangles[t][k]]++] = {t, k};
    }
    open_.assign(inner_.size(), false);
    std::vector<Corner> ordered;
    for (std::size_t f = 0; f < inner_.size(); ++f) {
      const std::span<Corner> corners = fan(f);
      if (corners.empty()) {
        report_fibre(f, " belongs to no slab");
        continue;
      }
      Corner start = corners.front();
      for (const Corner c : corners)
        if (neighbours_[c.slab][(c.corner + 2) % 3] == kNothing) {
          start = c;
          open_[f] = true;
          break;
        }
      ordered.clear();
      Corner at = start;
      for (;;) {
        ordered.push_back(at);
        const std::uint32_t next = neighbours_[at.slab][(at.corner + 1) % 3];
        if (next == kNothing || next == start.slab) break;
        const auto& fibres = shell_.triangles[next];
        at = {next, fibres[0] == f ? 0U : fibres[1] == f ? 1U : 2U};
      }
      if (ordered.size() != corners.size()) {
        for (const Corner& c : corners) fail_in(certificate_.failed, Condition::C0, c.slab);
        report(Condition::C0, corners.front().slab, corners.back().slab,
               "the slabs around " + fibre_name(f) + " are not one fan");
      } else {
        std::copy(ordered.begin(), ordered.end(), corners.begin());
      }
    }
  }

  /// Numbers the slabs that hang together by shared walls.
  void make_components() {
    facts_.component.assign(shell_.triangles.size(), kNothing);
    std::vector<std::uint32_t> waiting;
    for (std::uint32_t seed = 0; seed < facts_.component.size(); ++seed) {
      if (facts_.component[seed] != kNothing) continue;
      const auto number = static_cast<std::uint32_t>(facts_.closed.size());
      facts_.closed.push_back(true);
      facts_.failed.push_back(0);
      facts_.seeds.push_back(seed);
      facts_.component[seed] = number;
      waiting.push_back(seed);
      while (!waiting.empty()) {
        const std::uint32_t t = waiting.back();
        waiting.pop_back();
        for (const std::uint32_t next : neighbours_[t]) {
          if (next == kNothing) {
            facts_.closed[number] = false;
          } else if (facts_.component[next] == kNothing) {
            facts_.component[next] = number;
            waiting.push_back(next);
          }
        }
      }
    }
  }

  // ---- C1: at corner i the Jacobian is a quadratic in alpha with the Bernstein coefficients c0, c1, c2.

  bool jacobians_hold() {
    unsound_.assign(shell_.triangles.size(), false);
    for (std::size_t t = 0; t < shell_.triangles.size(); ++t) {
      const auto& f = shell_.triangles[t];
      const Point e_in = inner(f[1]) - inner(f[0]), g_in = inner(f[2]) - inner(f[0]);
      const Point e_out = outer(f[1]) - outer(f[0]), g_out = outer(f[2]) - outer(f[0]);
      const Point n_in = cross(e_in, g_in), n_out = cross(e_out, g_out);
      const Point n_mid = cross(e_in, g_out) + cross(e_out, g_in);
      for (std::size_t i = 0; i < 3; ++i) {
        const Point d = outer(f[i]) - inner(f[i]);
        const Int128 c0 = dot(n_in, d), c2 = dot(n_out, d), twice_c1 = dot(n_mid, d);
        if (c0 > 0 && c2 > 0 && (twice_c1 >= 0 || square_below_product(twice_c1, 4 * c0, c2))) continue;
        const char* where = c0 <= 0   ? "at its inner triangle"
                            : c2 <= 0 ? "at its outer triangle"
                                      : "between its inner and outer triangle";
        report_slabs(Condition::C1, t, t, slab_name(t) + " is folded at " + fibre_name(f[i]) + " " + where);
        unsound_[t] = true;
        break;
      }
    }
    return count(Condition::C1) == 0;
  }

  // ---- C2: seen along the fibre each sound slab turns by less than half a turn, so a full turn shows as one step from
  // the right of the first link fibre to its left.

  bool windings_hold() {
    bool complete = true;
    for (std::uint32_t f = 0; f < inner_.size(); ++f) {
      const std::span<const Corner> corners = fan(f);
      if (std::any_of(corners.begin(), corners.end(), [&](const Corner& c) { return unsound_[c.slab]; })) {
        complete = false;
        continue;
      }
      // The fibre that a slab's turn ends at is k = 2 of it, counted from this one; k = 1 is where it starts.
      const auto link = [&](const Corner& c, std::uint32_t k) {
        return inner(shell_.triangles[c.slab][(c.corner + k) % 3]) - inner(f);
      };
      const Point along = outer(f) - inner(f), first = link(corners.front(), 1);
      int turns = 0, before = 0;
      for (const Corner& c : corners) {
        const int now = predicates_.determinant(along, first, link(c, 2));
        if (before < 0 && now >= 0) ++turns;
        before = now;
      }
      if (open_[f] ? turns == 0 : turns == 1) continue;
      for (const Corner& c : corners) fail_in(certificate_.failed, Condition::C2, c.slab);
      if (open_[f])
        report(Condition::C2, f, f, "the slabs around open " + fibre_name(f) + " turn a full circle or more");
      else
        report(Condition::C2, f, f,
               "the slabs around " + fibre_name(f) + " wind " + std::to_string(turns) + " times instead of once");
    }
    return complete && count(Condition::C2) == 0;
  }

  // ---- C3

  /// Inner triangles first, then the outer ones.
  void collect_boxes() {
    boxes_.reserve(2 * shell_.triangles.size());
    for (const auto* ends : {&inner_, &outer_})
      for (const auto& f : shell_.triangles) boxes_.push_back(box_of((*ends)[f[0]], (*ends)[f[1]], (*ends)[f[2]]));
  }
  [[nodiscard]] Triangle triangle(std::size_t k) const {
    const auto& ends = is_outer(k) ? outer_ : inner_;
    const auto& f = shell_.triangles[slab_of(k)];
    return {widen(ends[f[0]]), widen(ends[f[1]]), widen(ends[f[2]])};
  }
  [[nodiscard]] bool is_outer(std::size_t triangle) const { return triangle >= shell_.triangles.size(); }
  [[nodiscard]] std::size_t slab_of(std::size_t triangle) const {
    return is_outer(triangle) ? triangle - shell_.triangles.size() : triangle;
  }

  /// Tests all pairs while they are counted; then each slab that has not failed yet, until it does.
  bool pairs_hold(const Tree& tree) {
    bool complete = true;
    std::vector<bool> flat(boxes_.size());
    for (std::size_t k = 0; k < boxes_.size(); ++k) {
      const Triangle t = triangle(k);
      flat[k] = cross(t.b - t.a, t.c - t.a) == Point{};
      if (flat[k]) complete = false;  // its slab failed C1
    }
    for (std::size_t k = 0; k < boxes_.size(); ++k) {
      if (progress_.cancelled()) return false;
      const bool named_only = count(Condition::C3) >= kCounted;
      if (flat[k] || (named_only && certificate_.fails(Condition::C3, slab_of(k)))) continue;
      const Triangle mine = triangle(k);
      tree.query(boxes_[k], [&](std::uint32_t l) {
        if ((named_only ? l == k : l <= k) || flat[l] || !boxes_[l].meets(boxes_[k])) return true;
        const std::size_t a = slab_of(k), b = slab_of(l);
        if (is_outer(k) == is_outer(l) && share_a_fibre(a, b)) return true;
        if (!predicates_.meet(mine, triangle(l))) return true;
        if (named_only) {
          fail_in(certificate_.failed, Condition::C3, a);
          fail_in(certificate_.failed, Condition::C3, b);
        } else {
          report_pair(k, l);
        }
        return count(Condition::C3) < kCounted;
      });
    }
    certificate_.at_least[static_cast<std::size_t>(Condition::C3)] = count(Condition::C3) >= kCounted;
    return complete && count(Condition::C3) == 0;
  }
  void report_pair(std::size_t k, std::size_t l) {
    if (slab_of(l) < slab_of(k)) std::swap(k, l);
    const auto side = [&](std::size_t m) { return is_outer(m) ? "outer" : "inner"; };
    report_slabs(Condition::C3, slab_of(k), slab_of(l),
                 std::string("the ") + side(k) + " triangle of " + slab_name(slab_of(k)) + " meets the " + side(l) +
                     " triangle of " + slab_name(slab_of(l)));
  }
  [[nodiscard]] bool share_a_fibre(std::size_t a, std::size_t b) const {
    for (const std::uint32_t f : shell_.triangles[a])
      for (const std::uint32_t g : shell_.triangles[b])
        if (f == g) return true;
    return false;
  }

  bool volumes_hold() {
    std::vector<std::array<Int128, 2>> volumes(facts_.closed.size());  // six times the volume: inner, outer
    for (std::size_t k = 0; k < boxes_.size(); ++k) {
      const Triangle t = triangle(k);
      volumes[facts_.component[slab_of(k)]][is_outer(k)] += dot(cross(t.a, t.b), t.c);
    }
    for (std::uint32_t c = 0; c < facts_.closed.size(); ++c) {
      const int in = sign(volumes[c][0]), out = sign(volumes[c][1]);
      if (!facts_.closed[c] || (in == out && in != 0)) continue;
      fail_in(facts_.failed, Condition::C3, c);
      report(Condition::C3, facts_.seeds[c], facts_.seeds[c],
             "the part with " + slab_name(facts_.seeds[c]) + " has inner and outer volumes of different signs");
    }
    return count(Condition::C3) == 0;
  }

  // ---- C4: by C3 the surfaces do not meet. A part reaches into another's shell when one of its two surfaces lies
  // between the other's two, that is where the other's inner and outer winding numbers differ.

  bool nesting_holds(const Tree& tree) {
    struct Windings {
      int inner = 0, outer = 0;
    };
    std::vector<Windings> windings(facts_.closed.size());
    std::vector<std::uint32_t> touched;
    for (std::uint32_t part = 0; part < facts_.closed.size(); ++part) {
      std::uint32_t found = kNothing;
      for (const auto* ends : {&inner_, &outer_}) {
        const Place start = (*ends)[shell_.triangles[facts_.seeds[part]][0]];
        const Point p = widen(start);
        touched.clear();
        const Box ray(start, {std::numeric_limits<std::int32_t>::max(), start[1], start[2]});
        tree.query(ray, [&](std::uint32_t k) {
          const std::uint32_t other = facts_.component[slab_of(k)];
          if (other == part || !facts_.closed[other]) return true;
          const int crossing = ray_crossing(triangle(k), p);
          if (crossing == 0) return true;
          (is_outer(k) ? windings[other].outer : windings[other].inner) += crossing;
          touched.push_back(other);
          return true;
        });
        for (const std::uint32_t other : touched) {
          if (windings[other].inner != windings[other].outer) found = std::min(found, other);
        }
        for (const std::uint32_t other : touched) windings[other] = {};
      }
      if (found == kNothing) continue;
      for (const std::uint32_t one : {part, found}) fail_in(facts_.failed, Condition::C4, one);
      report(Condition::C4, facts_.seeds[part], facts_.seeds[found],
             "the part with " + slab_name(facts_.seeds[part]) + " reaches into the shell of the part with " +
                 slab_name(facts_.seeds[found]));
    }
    return count(Condition::C4) == 0;
  }

  /// Returns how the ray from p along +x passes through the triangle: +1 out of it, -1 into it, 0 not at all. The ray
  /// is thought shifted by (0, e, e^2) for a vanishing e > 0, so it meets no edge.
  [[nodiscard]] int ray_crossing(const Triangle& t, const Point& p) const {
    const auto turn = [&](const Point& a, const Point& b) {
      const std::int64_t area = (b[1] - a[1]) * (p[2] - a[2]) - (b[2] - a[2]) * (p[1] - a[1]);
      if (area != 0) return area > 0 ? 1 : -1;
      const std::int64_t slope = b[2] != a[2] ? a[2] - b[2] : b[1] - a[1];
      return slope > 0 ? 1 : slope < 0 ? -1 : 0;
    };
    const std::int64_t facing = cross(t.b - t.a, t.c - t.a)[0];
    if (facing == 0) return 0;
    const int sense = facing > 0 ? 1 : -1;
    if (turn(t.a, t.b) != sense || turn(t.b, t.c) != sense || turn(t.c, t.a) != sense) return 0;
    return predicates_.side(t, p) == -sense ? sense : 0;
  }

  const Shell& shell_;
  Certificate certificate_;
  ShellFacts& facts_;
  const Progress& progress_;
  Predicates predicates_{kMaxSpan};
  std::vector<std::uint32_t> slab_with_;                  // by fibre, once needed, as the next
  std::vector<bool> bad_fibres_;                          // named by failures of C0
  std::vector<Place> inner_, outer_;                      // by fibre
  std::vector<std::array<std::uint32_t, 3>> neighbours_;  // by slab
  std::vector<Corner> fans_;                              // fibre after fibre
  std::vector<std::uint32_t> fan_begin_;                  // by fibre, and the end
  std::vector<bool> open_;                                // by fibre
  std::vector<bool> unsound_;                             // by slab
  std::vector<Box> boxes_;                                // by triangle
};

}  // namespace

std::string_view name(Condition condition) noexcept {
  constexpr std::array<std::string_view, kConditionCount> kNames = {"C0", "C1", "C2", "C3", "C4", "C5", "C6", "C7"};
  return kNames[static_cast<std::size_t>(condition)];
}

std::vector<std::uint32_t> Certificate::failing(Condition condition) const {
  std::vector<std::uint32_t> slabs;
  for (std::uint32_t s = 0; s < failed.size(); ++s)
    if (fails(condition, s)) slabs.push_back(s);
  return slabs;
}

Certificate check(const Shell& shell, const Progress& progress) {
  ShellFacts facts;
  Certificate certificate = Checker(shell, facts, progress).run();
  facts.hand_on(certificate);
  return certificate;
}

Certificate check(const Shell& shell, const Source& source, const Progress& progress) {
  ShellFacts facts;
  Certificate certificate = Checker(shell, facts, progress).run();
  certificate.with_source = true;
  if (certificate.holds[0]) check_source(shell, facts, source, certificate, progress);
  facts.hand_on(certificate);
  return certificate;
}

}  // namespace relief::verify
