// Where fibres meet the solids that a tool cuts or fills.
#pragma once

#include <relief/convert/geometry/lattice.h>
#include <relief/convert/room.h>
#include <relief/convert/sample/fibre_sampling.h>

#include <optional>
#include <span>
#include <vector>

namespace relief::detail {

/// A range of places along a line, in its lengths.
struct Passage {
  double from = 0, to = 0;
};
/// Returns where a line passes through a capsule; nothing where it passes by. The line and the capsule have the same
/// unit.
[[nodiscard]] std::optional<Passage> passage(const Capsule& capsule, const Line& line) noexcept;
/// Returns whether a point lies in one of them.
[[nodiscard]] bool is_in(std::span<const Capsule> capsules, Vec3d p) noexcept;
[[nodiscard]] Box3d box_of(const Capsule& capsule) noexcept;
/// Returns the capsules in lattice coordinates.
[[nodiscard]] std::vector<Capsule> on_lattice(std::span<const Capsule> capsules, const Lattice& lattice);

}  // namespace relief::detail
