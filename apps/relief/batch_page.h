// The page over a folder of models: index.html.
#pragma once

#include "batch_scans.h"

#include <relief/base/error.h>

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace relief::cli {

/// Returns a page that needs nothing but the files beside it: a table of failures, then a card for each model, those
/// with the weakest claim first. `waiting`: scans still to do.
[[nodiscard]] std::string batch_page(std::string_view title, std::span<const Record> records, std::size_t waiting);

/// Writes `out`/index.html from all records there, one writer at a time, so that the last of several shards to end
/// lists the work of all. Error: Io.
[[nodiscard]] Status write_batch_page(const std::filesystem::path& out, std::size_t waiting);

}  // namespace relief::cli
