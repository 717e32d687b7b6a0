#include "batch_scans.h"

#include "commands.h"

#include <relief/base/atomic_file.h>
#include <relief/base/hash.h>
#include <relief/base/try.h>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <ranges>
#include <set>
#include <string_view>

namespace relief::cli {

namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr std::string_view kFormat = "relief-batch 1";
constexpr std::size_t kLongestPath = 4096;           // bytes, as Linux has it
constexpr std::uintmax_t kLargestList = 64U << 20U;  // bytes: half a million paths
constexpr std::uintmax_t kLargestRecord = 4U << 20U;

std::string lower(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

/// The name of a mesh without its extension, and that without .gz.
fs::path unpacked(const fs::path& file) { return lower(file.extension().string()) == ".gz" ? file.stem() : file; }

bool is_mesh(const fs::path& file) {
  static const auto known = has_extension({".ply", ".obj", ".stl", ".off", ".gltf", ".glb", ".3mf", ".drc"});
  return known(unpacked(file).string()).empty();
}

bool is_hidden(const fs::path& file) { return file.filename().string().starts_with('.'); }

/// A folder below that cannot be read costs its own scans alone.
std::error_code search(const fs::path& folder, const fs::path& out, FoundScans& found) {
  std::error_code error, ignored;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    if (is_hidden(at->path())) continue;
    if (at->is_directory(ignored)) {
      // A link may lead back to where it stands.
      if (at->is_symlink(ignored) || fs::equivalent(at->path(), out, ignored)) continue;
      if (const std::error_code why = search(at->path(), out, found))
        found.unreadable.push_back(printable(at->path().string()) + ": the folder cannot be read: " + why.message());
    } else if (is_mesh(at->path())) {
      found.scans.push_back({.file = at->path(), .name = {}});
    } else {
      found.others.push_back(printable(at->path().string(), kLongestPath));
    }
  }
  return error;
}

Result<std::vector<Scan>> listed(const std::string& list) {
  RELIEF_TRY(const std::string text, read_text(list == "-" ? "/dev/stdin" : list, kLargestList));
  std::vector<Scan> found;
  std::size_t number = 0;
  for (const auto part : std::views::split(text, '\n')) {
    std::string_view line(part.begin(), part.end());
    ++number;
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (line.empty() || line.starts_with('#')) continue;
    if (line.size() > kLongestPath || line.contains('\0'))
      return fail(Errc::InvalidArgument, fmt::format("{}: line {}: is not a path; a list is a text file with one path "
                                                     "on each line; unpack archives first",
                                                     printable(list), number));
    // A mesh that is missing fails alone, other text is no list at all.
    std::error_code ignored;
    if (!is_mesh(line) && !fs::exists(line, ignored))
      return fail(
          Errc::InvalidArgument,
          fmt::format("{}: line {}: \"{}\" is no file; a list is a text file with one path of a mesh on each line",
                      printable(list), number, printable(line, 60)));
    found.push_back({.file = fs::absolute(line).lexically_normal(), .name = {}});
  }
  return found;
}

std::uint64_t hash_of(std::string_view text) {
  Hash64 hash;
  hash.add_bytes(std::as_bytes(std::span(text)));
  return hash.value();
}

/// The names that a scan may have, best first; the last is its own alone.
std::array<std::string, 3> candidates(const fs::path& file) {
  std::string stem = unpacked(file.filename()).stem().string();
  for (char& c : stem)
    if (static_cast<unsigned char>(c) < ' ') c = '_';
  const std::string folder = file.parent_path().filename().string();
  return {stem, folder + "-" + stem, fmt::format("{}-{:08x}", stem, hash_of(file.string()) >> 32U)};
}

/// What tells a scan from others when its folder has moved.
std::string traits(const Inputs& inputs) {
  return fmt::format("{} {} {}", fs::path(inputs.scan).filename().string(), inputs.bytes, inputs.modified);
}

Record record_from(const ordered_json& json) {
  Record r;
  r.made_by = json.at("relief");
  r.inputs = {.scan = json.at("scan"),
              .bytes = json.at("bytes"),
              .modified = json.at("modified"),
              .options = json.at("options").get<std::vector<std::string>>()};
  r.done = json.at("status") == "done";
  r.picture = json.at("picture").is_string() ? json.at("picture").get<std::string>() : std::string();
  r.seconds = json.at("seconds");
  r.peak_mib = json.at("peak_mib");
  r.report = json.at("report");
  if (const ordered_json& failure = json.at("failure"); !r.done) {
    r.message = failure.at("message");
    r.exit_status = failure.at("exit_status").is_null() ? -1 : failure.at("exit_status").get<int>();
    r.signal = failure.at("signal").is_null() ? 0 : failure.at("signal").get<int>();
    r.timed_out = failure.at("timed_out");
  }
  return r;
}

ordered_json to_json(const Record& r) {
  const auto or_null = [](bool there, auto value) { return there ? ordered_json(value) : ordered_json(); };
  ordered_json json;
  json["format"] = kFormat;
  json["relief"] = r.made_by;
  json["status"] = r.done ? "done" : "failed";
  json["scan"] = r.inputs.scan;
  json["bytes"] = r.inputs.bytes;
  json["modified"] = r.inputs.modified;
  json["options"] = r.inputs.options;
  json["model"] = or_null(r.done, r.name + ".relief");
  json["picture"] = or_null(!r.picture.empty(), r.picture);
  json["seconds"] = r.seconds;
  json["peak_mib"] = r.peak_mib;
  json["failure"] = ordered_json();
  if (!r.done)
    json["failure"] = {{"message", r.message},
                       {"exit_status", or_null(r.signal == 0, r.exit_status)},
                       {"signal", or_null(r.signal != 0, r.signal)},
                       {"timed_out", r.timed_out}};
  json["report"] = r.report;
  return json;
}

}  // namespace

Result<FoundScans> find_scans(const std::string& from, const fs::path& out) {
  std::error_code ignored;
  FoundScans found;
  std::vector<Scan>& scans = found.scans;
  const std::string shown = printable(from);
  if (from != "-" && fs::is_directory(from, ignored)) {
    if (fs::equivalent(from, out, ignored))
      return fail(Errc::InvalidArgument, shown + ": is the folder of the scans and of the models; give -o another");
    const fs::path folder = fs::absolute(from).lexically_normal();
    if (const std::error_code error = search(folder, out, found))
      return io_error(folder.string(), "the folder cannot be read", error.value());
    if (scans.empty())
      return fail(Errc::NotFound, shown +
                                      ": holds no meshes (.ply, .obj, .stl, .off, .gltf, .glb, .3mf, .drc, with .gz or "
                                      "without); unpack archives first");
  } else if (is_mesh(from)) {
    return fail(Errc::InvalidArgument, shown + ": is a mesh, not a list of meshes; relief convert takes one");
  } else {
    RELIEF_TRY(scans, listed(from));
    if (scans.empty()) return fail(Errc::NotFound, shown + ": names no scans; a list has one path on each line");
  }
  std::ranges::sort(found.others);
  std::ranges::sort(scans, {}, &Scan::file);
  scans.erase(std::ranges::unique(scans, {}, &Scan::file).begin(), scans.end());
  return found;
}

Inputs Inputs::of(const fs::path& scan, std::vector<std::string> options) {
  Inputs now{.scan = printable(scan.string(), kLongestPath), .bytes = 0, .modified = {}, .options = std::move(options)};
  struct stat status{};
  if (::stat(scan.c_str(), &status) != 0) return now;
  now.bytes = static_cast<std::uint64_t>(status.st_size);
  now.modified = fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:09}Z", fmt::gmtime(status.st_mtim.tv_sec), status.st_mtim.tv_nsec);
  return now;
}

std::string Record::reason() const {
  for (const std::string& start : {inputs.scan + ": ", "'" + inputs.scan + "' "})
    if (message.starts_with(start)) return message.substr(start.size());
  return message;
}

Status save(const Record& record, const fs::path& out) {
  RELIEF_TRY(AtomicFile file, AtomicFile::create(out / (record.name + std::string(kRecord))));
  RELIEF_CHECK(file.write(to_json(record).dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n"));
  return file.commit();
}

Result<std::vector<Record>> read_records(const fs::path& out) {
  std::vector<Record> records;
  std::error_code error;
  for (fs::directory_iterator at(out, error), end; !error && at != end; at.increment(error)) {
    const std::string file = at->path().filename().string();
    if (!file.ends_with(kRecord)) continue;
    const auto text = read_text(at->path(), kLargestRecord);
    if (!text) continue;
    const ordered_json json = ordered_json::parse(*text, nullptr, false);
    if (!json.is_object() || json.value("format", ordered_json()) != kFormat) continue;
    try {
      records.push_back(record_from(json));
      records.back().name = file.substr(0, file.size() - kRecord.size());
    } catch (const ordered_json::exception&) {
      continue;
    }
  }
  if (error) return io_error(out.string(), "the folder cannot be read", error.value());
  std::ranges::sort(records, {}, &Record::name);
  return records;
}

void name_scans(std::vector<Scan>& scans, const std::vector<Record>& records, const fs::path& out) {
  std::error_code ignored;
  std::map<std::string, const Record*> by_scan, by_name;
  std::multimap<std::string, const Record*> moved;
  for (const Record& r : records) {
    by_scan[r.inputs.scan] = by_name[lower(r.name)] = &r;
    if (!fs::exists(r.inputs.scan, ignored)) moved.emplace(traits(r.inputs), &r);
  }
  // Some file systems do not tell case apart.
  std::set<std::string> taken;
  for (Scan& scan : scans) {
    const Inputs now = Inputs::of(scan.file, {});
    if (const auto had = by_scan.find(now.scan); had != by_scan.end()) {
      scan.name = had->second->name;
    } else if (const auto was = moved.find(traits(now)); was != moved.end()) {
      scan.name = was->second->name;
      moved.erase(was);
    }
    taken.insert(lower(scan.name));
  }
  std::map<std::string, int> times;
  for (const Scan& scan : scans)
    for (const std::string& name : candidates(scan.file)) ++times[lower(name)];
  const auto is_free = [&](const std::string& name) {
    if (times[lower(name)] > 1 || taken.contains(lower(name))) return false;
    if (const auto had = by_name.find(lower(name)); had != by_name.end())
      return !fs::exists(had->second->inputs.scan, ignored);
    return !fs::exists(out / (name + std::string(kRecord)), ignored);
  };
  for (Scan& scan : scans) {
    if (!scan.name.empty()) continue;
    const std::array<std::string, 3> names = candidates(scan.file);
    const auto* good = std::ranges::find_if(names, is_free);
    scan.name = good != names.end() ? *good : names.back();
  }
}

}  // namespace relief::cli
