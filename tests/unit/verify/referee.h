// A slow and plain judge of shells that shares no code with the verifier: all pairs, no trees, exact numbers of CGAL.
#pragma once

#include <relief/verify/verify.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <vector>

namespace relief::verify {

/// What the referee says of C0 to C4.
struct Verdict {
  std::array<bool, kShellConditionCount> holds{};
  std::array<std::set<std::uint32_t>, kShellConditionCount> slabs;  ///< where C1 to C4 fail, as in failing()
  std::size_t parts = 0;
  bool dips = false;          ///< some slab is folded between its ends only
  bool differs = false;       ///< a part has inner and outer volumes of different signs
  bool undecided = false;     ///< a sum of angles is too near its limit for doubles
  bool covers_twice = false;  ///< two triangles of one side that share a fibre meet beyond it
};

/// O(slabs^2). For shells whose numbers are finite and lie on the verifier's lattice.
[[nodiscard]] Verdict judge(const Shell& shell);

/// The slabs whose inner or outer triangles meet the source; nothing where a triangle has no area.
[[nodiscard]] std::optional<std::set<std::uint32_t>> slabs_met(const Shell& shell, const Source& source);

/// How often segments meet a source, in doubles, one triangle after another.
class Meetings {
 public:
  using Point = std::array<double, 3>;
  struct Count {
    int outwards = 0, inwards = 0;  ///< through the front from behind, and the other way
  };
  explicit Meetings(const Source& source);
  /// Nothing where the segment comes so near to an edge, or its own end to a triangle, that rounding might decide.
  [[nodiscard]] std::optional<Count> count(const Point& from, const Point& to) const;

 private:
  std::vector<std::array<Point, 3>> triangles_;
};

}  // namespace relief::verify
