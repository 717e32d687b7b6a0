// Which scans a batch converts, under which names, and what became of each.
#pragma once

#include <relief/base/error.h>

#include <nlohmann/json.hpp>

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace relief::cli {

/// One scan of a collection.
struct Scan {
  std::filesystem::path file;  ///< absolute
  std::string name;            ///< of its outputs, without an extension
};

/// What was found where a collection was looked for.
struct FoundScans {
  std::vector<Scan> scans;
  std::vector<std::string> others;      ///< printable paths of files that are not meshes
  std::vector<std::string> unreadable;  ///< folders, each with why
};

/// Returns the scans of `from` sorted by path, each once: the meshes of a folder and of the folders in it, except below
/// `out` and where a name begins with a dot; or the lines of a text file ("-": of standard input). Errors name the
/// place: NotFound, Io, InvalidArgument (no scans, a folder that is `out` itself, a mesh for a list, a text with a line
/// that is neither a file nor the name of a mesh).
[[nodiscard]] Result<FoundScans> find_scans(const std::string& from, const std::filesystem::path& out);

/// What a scan and its options were when it was worked on.
struct Inputs {
  std::string scan;  ///< its absolute path, printable
  std::uint64_t bytes = 0;
  std::string modified;  ///< UTC, with nanoseconds; empty where there is no such file
  std::vector<std::string> options;
  [[nodiscard]] static Inputs of(const std::filesystem::path& scan, std::vector<std::string> options);
  /// Whether the other's model is as good, wherever the scan lies now.
  [[nodiscard]] bool gives_the_same(const Inputs& other) const {
    return bytes == other.bytes && modified == other.modified && options == other.options;
  }
};

/// The end of a record's name. NAME.json alone is the caption of a model in a kiosk.
inline constexpr std::string_view kRecord = ".report.json";

/// NAME.report.json: how one scan fared.
struct Record {
  std::string name;
  std::string made_by;  ///< program and version
  Inputs inputs;
  bool done = false;
  std::string message;  ///< why it failed
  int exit_status = 0;  ///< of the command that failed; -1 where a signal ended it
  int signal = 0;
  bool timed_out = false;
  std::string picture;  ///< a file beside the record; empty where none could be drawn
  double seconds = 0, peak_mib = 0;
  nlohmann::ordered_json report;  ///< what `relief convert --json` printed; null where it failed

  /// The message without the scan's path, for a place where that stands already.
  [[nodiscard]] std::string reason() const;
};

/// Writes OUT/NAME.report.json whole or not at all. Error: Io.
[[nodiscard]] Status save(const Record& record, const std::filesystem::path& out);
/// Returns the records in a folder, sorted by name. Files that are no records are passed over. Error: Io.
[[nodiscard]] Result<std::vector<Record>> read_records(const std::filesystem::path& out);

/// Gives each scan a name of its own. A scan that has a record, or had one where it lay before, keeps its name. Others
/// have the file's name, with the folder's before it where files in several folders have the same, or with a number.
/// The list and the records alone decide, so that shards agree.
void name_scans(std::vector<Scan>& scans, const std::vector<Record>& records, const std::filesystem::path& out);

}  // namespace relief::cli
