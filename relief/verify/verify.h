// The independent check of a shell: exact, on plain arrays, sharing no code with the builder.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace relief::verify {

/// A shell as plain numbers: fibre i runs from inner[i] to outer[i]; each triangle names three fibres,
/// counter-clockwise seen from outside.
struct Shell {
  std::span<const std::array<double, 3>> inner, outer;
  std::span<const std::array<std::uint32_t, 3>> triangles;
};

/// The conditions that need no source surface. C0: an oriented manifold complex, no repeated triangle, inner != outer.
/// C1: the Jacobian is positive in every closed slab. C2: the inner triangles around each fibre, seen along it, wind
/// exactly once. C3: inner and outer triangles are pairwise disjoint unless they share a corner. C4: no part contains
/// another.
enum class Condition : std::uint8_t { C0, C1, C2, C3, C4 };
[[nodiscard]] std::string_view name(Condition condition) noexcept;

struct Failure {
  Condition condition;
  std::uint32_t a = 0, b = 0;  ///< slabs; for C2 a is the fibre; b = a where there is only one
  std::string what;            ///< one sentence
};

struct Certificate {
  std::array<bool, 5> holds{};                 ///< by condition; false also when it could not be tested (below)
  std::array<std::size_t, 5> failure_count{};  ///< counting stops at 100 000 pairs
  std::vector<Failure> failures;               ///< the first 100
  bool on_lattice = false;                     ///< coordinates were exact lattice points, so the verdict is exact
  [[nodiscard]] bool all() const noexcept { return holds[0] && holds[1] && holds[2] && holds[3] && holds[4]; }
};

/// Exact where all coordinates are multiples of one power of two that spans at most 2^30 steps (what convert writes);
/// other shells fail C0 with a sentence saying so. Errors of the shell are findings, never exceptions. O(slabs log
/// slabs). Nothing else is tested where C0 fails, C2 not at fibres of slabs that fail C1, C3 not for triangles without
/// area, C4 not where C3 fails. At open edges the curved walls of the boundary are not tested: C3 speaks of the
/// triangles only.
[[nodiscard]] Certificate check(const Shell& shell);

}  // namespace relief::verify
