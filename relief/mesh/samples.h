// Models that the project makes itself: for the demo, the documents and the tests.
#pragma once

#include <relief/base/error.h>
#include <relief/base/progress.h>
#include <relief/mesh/triangle_mesh.h>

#include <cstddef>
#include <span>
#include <string_view>

namespace relief {

/// Returns the names make_sample() knows: "pumpkin" (ribbed, warty, with a stem), "head" (stylised, with eyes, nose,
/// lips, ears), "torus" (with fine relief), "bowl" (thin-walled).
[[nodiscard]] std::span<const std::string_view> sample_names() noexcept;

/// Returns a closed, oriented, manifold mesh with vertex colours, y up, facing +z, about 100 units tall, of `triangles`
/// triangles or within 2 % of it (at least 1000). The same arguments give the same bytes on every machine. Errors:
/// NotFound (unknown name, lists the known ones), InvalidArgument (count out of 1000 .. 50 million), Cancelled.
[[nodiscard]] Result<TriangleMesh> make_sample(std::string_view name, std::size_t triangles,
                                               const Progress& progress = {});

}  // namespace relief
