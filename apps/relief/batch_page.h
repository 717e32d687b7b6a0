// The page over a folder of models: index.html.
#pragma once

#include "batch_scans.h"

#include <relief/base/error.h>

#include <cstddef>
#include <filesystem>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace relief::cli {

/// What a run saw where it looked for scans, in the words of the page.
struct Seen {
  std::set<std::string> scans;          ///< as records name them
  std::vector<std::string> others;      ///< files that are not meshes
  std::vector<std::string> unreadable;  ///< folders, each with why
  [[nodiscard]] static Seen of(const FoundScans& found);
};

/// Returns a page that needs nothing but the files beside it: a table of failures, then a card for each model, those
/// with the weakest claim first, then the scans that are gone, folders that cannot be read and files passed over.
/// `waiting`: scans still to do.
[[nodiscard]] std::string batch_page(std::string_view title, std::span<const Record> records, std::size_t waiting,
                                     const Seen& seen);

/// Writes `out`/index.html from all records there, one writer at a time, so that the last of several shards to end
/// lists the work of all. Error: Io.
[[nodiscard]] Status write_batch_page(const std::filesystem::path& out, std::size_t waiting, const Seen& seen);

}  // namespace relief::cli
