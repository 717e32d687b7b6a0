// What the check of the shell hands on to the check of the source.
#pragma once

#include <relief/verify/exact.h>
#include <relief/verify/verify.h>

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <vector>

namespace relief::verify::detail {

/// A range of doubles: their box, and the power of two of which all are multiples.
struct Extent {
  std::array<double, 3> low, high;
  int lowest = std::numeric_limits<int>::max();  ///< exponent of the lowest bit set in any of them

  Extent();
  void add(const std::array<double, 3>& p);
  void add(const Extent& other);
  /// Returns the exponent of the coarsest lattice step; 0 when all coordinates are zero.
  [[nodiscard]] int step() const { return lowest == std::numeric_limits<int>::max() ? 0 : lowest; }
  /// Returns the exponent of the step to which the coordinates were rounded, as far as it shows: a few round numbers do
  /// not make a coarse lattice, so it is 2^20 of the longest side at most, but no finer than doubles are so far out.
  [[nodiscard]] int likely_step() const;
  /// Returns the longest side in steps of 2^step. A length of at most 2^30 steps has no rounding; a longer one stays
  /// longer.
  [[nodiscard]] double span(int step) const;
};

/// A shell that passed C0.
struct ShellFacts {
  Extent extent;
  std::vector<std::uint32_t> component;  ///< by slab: which slabs hang together
  std::vector<bool> closed;              ///< by component
  std::vector<std::uint32_t> seeds;      ///< by component: its lowest slab
  std::vector<std::uint8_t> failed;      ///< by component: what fails in all of its slabs, as in Certificate

  /// What fails in a whole component fails in each of its slabs.
  void hand_on(Certificate& certificate) const {
    for (std::size_t s = 0; s < component.size(); ++s) certificate.failed[s] |= failed[component[s]];
  }
};

/// Notes that a condition fails in a slab or a component.
inline void fail_in(std::vector<std::uint8_t>& failed, Condition condition, std::size_t which) {
  failed[which] |= static_cast<std::uint8_t>(1U << static_cast<unsigned>(condition));
}

/// Shell and source on one lattice.
struct CommonLattice {
  std::array<double, 3> origin{};  ///< a lattice point
  int step = 0;                    ///< exponent of the step
  double span = 0;                 ///< steps, of both together; at most 2^30
  bool fits = false;               ///< there is such a lattice
  bool moved = false;              ///< the source is not on it

  CommonLattice(const Extent& shell, const Extent& source);
  /// Returns the nearest lattice point.
  [[nodiscard]] Point at(const std::array<double, 3>& p) const;
};

/// Returns the extent of all coordinates of a shell.
[[nodiscard]] Extent extent_of(const Shell& shell);
/// Returns a sentence about the first number of the source that is not usable, or an empty one; fills `extent`.
[[nodiscard]] std::string source_fault(const Source& source, Extent& extent);

/// An edge that two slabs share, as each of them counts its edges: edge k lies opposite corner k.
struct SharedEdge {
  std::array<std::uint32_t, 2> slab, edge;
};
/// One that a single slab has.
struct LoneEdge {
  std::uint32_t slab, edge;
};
/// Tells of each, of a shell that passed C0, and of the lone ones if that is asked for. Takes 36 bytes per slab while
/// it does.
void for_each_shared_edge(const Shell& shell, const std::function<void(const SharedEdge&)>& told,
                          const std::function<void(const LoneEdge&)>& told_lone = {});
/// Number in its tile of the sample t of n intervals along an edge.
[[nodiscard]] std::size_t sample_on_edge(int n, std::uint32_t edge, int t);

/// C5 to C7, into the certificate of a shell that passed C0; none of them holds when cancelled.
void check_source(const Shell& shell, ShellFacts& facts, const Source& source, Certificate& certificate,
                  const Progress& progress);

}  // namespace relief::verify::detail
