// How deep the fibres should be so that the source lies between their ends, with room to carve and to add.
#pragma once

#include <relief/convert/shell.h>
#include <relief/convert/source_surface.h>

namespace relief::detail {

/// Measures how far the source departs from the base triangles along the fibres, and asks for that much on either side
/// and as much room again as `longest` (a whole fibre, lattice steps) and the size of the triangles allow.
[[nodiscard]] Fibres wanted_fibres(const BaseMesh& base, const SourceSurface& source, double longest);

/// Per slab the share of its fibres, 0..1, that pass the source by; 0 for slabs on a rim, beyond which there is no
/// source.
[[nodiscard]] std::vector<double> missed_shares(const Shell& shell, const SourceSurface& source);

}  // namespace relief::detail
