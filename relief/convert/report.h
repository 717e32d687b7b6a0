// The sentences of a conversion.
#pragma once

#include <relief/base/error.h>
#include <relief/convert/convert.h>
#include <relief/convert/prepare/prepare.h>
#include <relief/verify/verify.h>

#include <cstddef>
#include <string>
#include <vector>

namespace relief::detail {

/// Returns what is odd about the source and what was made of it; sentences without a full stop.
[[nodiscard]] std::vector<std::string> notes_of(const ConvertReport& report, const ConvertSettings& settings,
                                                const ModelInfo& info, std::size_t mended_triangles);

/// Why no shell stands on a source; a clause. `near`: where it is hindered first, model units.
[[nodiscard]] std::string why_no_shell(const Obstacle& obstacle, Vec3d near);

/// Why the verifier refused a shell; a clause.
[[nodiscard]] std::string why_refused(const verify::Certificate& certificate);

/// Why the slabs of a shell make no mesh; a clause.
[[nodiscard]] std::string why_not_joined(const Error& error);

/// Why a shell with a certificate is none of the source; a sentence without its full stop.
[[nodiscard]] std::string not_of_the_source(const ConvertReport& report);

/// Why a model is tolerant; a clause.
[[nodiscard]] std::string why_tolerant(const ConvertReport& report);

/// That there is no shell in the mode that was requested, why, and what to do.
[[nodiscard]] std::unexpected<Error> no_shell(const ConvertReport& report, const ConvertSettings& settings);

}  // namespace relief::detail
