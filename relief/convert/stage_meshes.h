// Draws the stages of a conversion for who asked to see them.
#pragma once

#include <relief/convert/geometry/lattice.h>
#include <relief/convert/geometry/shell.h>
#include <relief/convert/prepare/closed_source.h>
#include <relief/convert/stages.h>

#include <cstdint>
#include <span>

namespace relief::detail {

/// Nothing is done where nobody asked.
void show_components(const StageSink& sink, Stage stage, const TriangleMesh& mesh);
/// What closes openings is red, patches are orange, the rest is grey.
void show_source(const StageSink& sink, Stage stage, const ClosedSource& source, const Lattice& lattice);
/// `part`: per face, the number of the part that it comes from.
void show_skin(const StageSink& sink, const ClosedSource& source, std::span<const std::uint32_t> part,
               const Lattice& lattice);
void show_shell(const StageSink& sink, const Shell& shell, const Lattice& lattice);

}  // namespace relief::detail
