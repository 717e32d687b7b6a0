// The frame of the command line: parsing, progress, Ctrl-C, one line per failure, exit status.
#include "commands.h"
#include "progress_line.h"
#include "usage.h"

#include <relief/base/atomic_file.h>
#include <relief/base/steps.h>
#include <relief/base/try.h>

#include <fmt/format.h>
#include <tbb/global_control.h>

#ifdef __GLIBC__
#include <link.h>
#include <malloc.h>
#include <sys/mman.h>
#endif
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <fstream>
#include <new>
#include <optional>
#include <span>
#include <type_traits>
#include <vector>

namespace relief::cli {

namespace {

constexpr int kDone = 0, kFailed = 1, kWrongUsage = 2, kCancelled = 130;

std::atomic<bool> cancel_asked{false};
static_assert(std::atomic<bool>::is_always_lock_free);

std::atomic<bool> nothing_written{false};
bool json_wanted = false;  // before any signal is handled

/// The first Ctrl-C asks the work to stop and clean up; the second ends the program at once.
void on_signal(int signal) {
  cancel_asked.store(true);
  std::signal(signal, SIG_DFL);
  alarm(1);
}

/// Work that has nothing to clean up need not be waited for.
void on_alarm(int /*signal*/) {
  if (!nothing_written.load()) return;
  constexpr std::string_view kLine = "relief: the command was cancelled\n";
  constexpr std::string_view kJson =
      "{\"error\": {\"code\": \"Cancelled\", \"message\": \"the command was cancelled\", \"file\": null, "
      "\"exit_status\": 130}}\n";
  [[maybe_unused]] auto ignored = write(STDERR_FILENO, kLine.data(), kLine.size());
  if (json_wanted) ignored = write(STDOUT_FILENO, kJson.data(), kJson.size());
  _exit(kCancelled);
}

/// One for the command that is run.
ProgressLine& progress_line(std::string_view command = {}, ProgressStyle style = ProgressStyle::None) {
  static ProgressLine line(command, style);
  return line;
}

/// The words of the command line, for the file that a message names.
std::vector<std::string> words;
bool quiet = false;
bool json_printed = false;

bool output_failed = false;

int exit_status_of(Errc code) { return code == Errc::Cancelled ? kCancelled : kFailed; }

/// The file of the command line that a message begins with.
std::string file_in(std::string_view message) {
  for (const std::string& word : words)
    for (const std::string_view name : {std::string_view(word), std::string_view(word).substr(word.find('=') + 1)})
      if (!name.empty() && !name.starts_with('-') && message.starts_with(printable(name) + ":"))
        return std::string(name);
  return {};
}

nlohmann::ordered_json error_json(std::string_view code, const std::string& message, int status) {
  const std::string file = file_in(message);
  return {{"code", code},
          {"message", message},
          {"file", file.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(file)},
          {"exit_status", status}};
}

/// Exactly one line, whatever a message holds; with --json also an object, unless the command printed its own.
int fail_with(std::string_view code, const std::string& message, int status) {
  if (json_wanted && !json_printed) print_json({{"error", error_json(code, message, status)}});
  std::fputs(("relief: " + printable(message, 480) + "\n").c_str(), stderr);
  return status;
}

int wrong_usage(const std::string& message) { return fail_with("Usage", message, kWrongUsage); }

#ifdef __GLIBC__
/// Whether the loader has written to what nobody else writes to.
bool has_text_relocations(const dl_phdr_info& object) {
  for (const ElfW(Phdr) & part : std::span(object.dlpi_phdr, object.dlpi_phnum)) {
    if (part.p_type != PT_DYNAMIC) continue;
    // NOLINTNEXTLINE(performance-no-int-to-ptr)
    for (const auto* entry = reinterpret_cast<const ElfW(Dyn)*>(object.dlpi_addr + part.p_vaddr);
         entry->d_tag != DT_NULL; ++entry)
      if (entry->d_tag == DT_TEXTREL || (entry->d_tag == DT_FLAGS && (entry->d_un.d_val & DF_TEXTREL) != 0))
        return true;
  }
  return false;
}

/// Takes what is only read, neither written nor run, of this program and its libraries out of the resident set: the
/// loader has read all names of symbols. What is asked for again comes back from the files.
int rest_read_only(dl_phdr_info* object, std::size_t, void*) {
  if (has_text_relocations(*object)) return 0;
  const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
  for (const ElfW(Phdr) & part : std::span(object->dlpi_phdr, object->dlpi_phnum)) {
    if (part.p_type != PT_LOAD || part.p_flags != PF_R) continue;
    const std::uintptr_t begin = (object->dlpi_addr + part.p_vaddr) / page * page;
    const std::uintptr_t end = object->dlpi_addr + part.p_vaddr + part.p_memsz;
    madvise(reinterpret_cast<void*>(begin), end - begin, MADV_DONTNEED);  // NOLINT(performance-no-int-to-ptr)
  }
  return 0;
}
#endif

int main_inner(int argc, char** argv) {
#ifdef __GLIBC__
  // Large arrays go back to the system when they are freed, and leave no holes.
  mallopt(M_MMAP_THRESHOLD, 1 << 20);
  dl_iterate_phdr(rest_read_only, nullptr);
#endif
  words.assign(argv + 1, argv + argc);
  json_wanted = std::ranges::find(words, "--json") != words.end();
  CLI::App app("Feel, carve and paint any triangle mesh.");
  app.name("relief");
  app.require_subcommand(1);
  app.set_version_flag("--version", std::string("relief ") + RELIEF_VERSION);

  Context context;
  context.catalogue[&app] = {
      .group = {},
      .examples = {{"relief convert scan.ply -o scan.relief", "mesh to model"},
                   {"relief touch scan.relief --path press.csv -o force.csv", "feel it along a path"},
                   {"relief sculpt scan.relief --strokes face.json -o new.relief", "carve, deposit, paint"},
                   {"relief render new.relief -o new.png", "a picture, no screen needed"}}};
  context.progress.report = [](std::string_view phase, double share) { progress_line().show(phase, share); };
  context.progress.cancel = &cancel_asked;
  // Of each group in the order of `relief --help`.
  add_convert(app, context);
  add_batch(app, context);
  add_sample(app, context);
  add_refine(app, context);
  add_verify(app, context);
  add_info(app, context);
  add_devices(app, context);
  add_touch(app, context);
  add_replay(app, context);
  add_sculpt(app, context);
  add_undo(app, context);
  add_studio(app, context);
  add_render(app, context);
  add_export(app, context);
  add_bench(app, context);
  add_help(app, context);
  add_completion(app, context);

  const std::vector<std::string> known = command_names(app);
  if (argc > 1 && !words[0].starts_with('-') && std::ranges::find(known, words[0]) == known.end())
    return wrong_usage(unknown_command(app, words[0]));
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    const auto chosen = app.get_subcommands();
    print(chosen.empty() ? overview(app, context.catalogue) : help_text(*chosen.front(), context.catalogue));
    return kDone;
  } catch (const CLI::CallForVersion& version) {
    print(std::string(version.what()) + "\n");
    return kDone;
  } catch (const CLI::ParseError& error) {
    return wrong_usage(usage_message(app, error));
  }
  quiet = context.quiet;
  const bool on_terminal = isatty(STDERR_FILENO) == 1;
  progress_line(app.get_subcommands().front()->get_name(), quiet                    ? ProgressStyle::None
                                                           : on_terminal            ? ProgressStyle::Overwritten
                                                           : context.progress_lines ? ProgressStyle::LinePerPhase
                                                                                    : ProgressStyle::None);

  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
  if (std::signal(SIGHUP, on_signal) == SIG_IGN) std::signal(SIGHUP, SIG_IGN);  // as under nohup
  std::signal(SIGALRM, on_alarm);
  std::signal(SIGPIPE, SIG_IGN);
  std::optional<tbb::global_control> limit;
  if (context.threads > 0)
    limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(context.threads));

  Status status;
  try {
    status = context.run();
  } catch (const CLI::ParseError& error) {
    progress_line().clear();
    return wrong_usage(usage_message(app, error));
  } catch (const std::bad_alloc&) {
    status = fail(Errc::Io, "out of memory; use a smaller model, fewer slabs or a smaller n");
  } catch (const std::exception& error) {
    status = fail(Errc::Io, error.what());
  }
  progress_line().clear();
  if (status && output_failed) status = fail(Errc::Io, "standard output cannot be written");
  if (status) return kDone;
  const Error& error = status.error();
  return fail_with(name(error.code), error.message, exit_status_of(error.code));
}

}  // namespace

NothingWritten::NothingWritten() { nothing_written.store(true); }
NothingWritten::~NothingWritten() { nothing_written.store(false); }

void finish_command(CLI::App& command, Context& context, std::function<Status()> action, SharedOptions shared) {
  const std::string general(kGeneral);
  if (shared.json) command.add_flag("--json", context.json, "print one JSON object and nothing else")->group(general);
  if (shared.work) {
    command.add_flag("--quiet", context.quiet, "print nothing but errors")->group(general);
    command
        .add_flag("--progress", context.progress_lines,
                  "print a line for each phase where standard error is not a terminal")
        ->group(general);
    command.add_option("--threads", context.threads, "threads to use; results do not depend on it")
        ->type_name("N")
        ->default_str("all")
        ->check(whole_in_range(1, 1024))
        ->group(general);
  }
  command.callback([&context, action = std::move(action)] { context.run = action; });
}

void add_error(nlohmann::ordered_json& json, const Status& ended) {
  if (!ended)
    json["error"] = error_json(name(ended.error().code), ended.error().message, exit_status_of(ended.error().code));
}

namespace {
/// "1e-7", as people write it.
template <typename Number>
std::string short_number(Number number) {
  std::string text = fmt::format("{}", number);
  const std::size_t e = text.find('e');
  if (e == std::string::npos) return text;
  const bool negative = text[e + 1] == '-';
  std::size_t digits = text.find_first_not_of("+-0", e + 1);
  return text.substr(0, e + 1) + (negative ? "-" : "") + text.substr(digits);
}

constexpr double kNoLimit = 1e9;  // so large a limit keeps numbers finite, and is not worth telling

/// One wording for a value that a number's option does not take.
template <typename Number>
CLI::Validator number_in(Number low, Number high, std::string_view kind) {
  const bool open = static_cast<double>(high) >= kNoLimit;
  const std::string range = open ? "at least " + short_number(low) : short_number(low) + " to " + short_number(high);
  const auto check = [=](std::string& text) -> std::string {
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    const bool number = error == std::errc{} && end == text.data() + text.size() &&
                        (std::is_floating_point_v<Number> || value == std::floor(value));
    if (!number) return fmt::format("\"{}\" is not a {}number ({})", printable(text, 40), kind, range);
    // Written so that nan fails, too.
    if (value >= static_cast<double>(low) && value <= static_cast<double>(high)) return {};
    return fmt::format("{} is not {}{}", printable(text, 40), open ? "" : "in ", range);
  };
  return {check, range, "range"};
}
}  // namespace

CLI::Validator in_range(double low, double high) { return number_in(low, high, ""); }
CLI::Validator whole_in_range(long low, long high) { return number_in(low, high, "whole "); }

CLI::Validator one_of(std::vector<std::string> choices) {
  const std::string described = joined(choices, "|");
  const auto check = [choices = std::move(choices)](std::string& text) -> std::string {
    if (std::ranges::find(choices, text) != choices.end()) return {};
    return fmt::format("\"{}\" is none of {}{}", printable(text, 40), joined(choices), nearest_of(text, choices));
  };
  return {check, described, "choices"};
}

std::string names_file(const std::string& file) {
  return file.empty() ? "takes the name of a file, and the one given is empty" : std::string();
}

Status check_outputs(std::initializer_list<std::string_view> outputs, std::initializer_list<std::string_view> inputs) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  std::vector<fs::path> targets;
  for (const std::string_view out : outputs) {
    if (out.empty()) continue;
    for (const std::string_view in : inputs)
      if (!in.empty() && fs::equivalent(in, out, ignored))
        return fail(Errc::InvalidArgument, printable(out) + ": is the input itself; choose another name");
    const fs::file_status status = fs::status(out, ignored);
    if (fs::is_directory(status)) return fail(Errc::Io, printable(out) + ": is a folder");
    // A device or a pipe has no folder that matters, and may take several outputs.
    if (fs::exists(status) && !fs::is_regular_file(status)) continue;
    const fs::path target = fs::weakly_canonical(behind_links(fs::absolute(out, ignored)), ignored);
    if (std::ranges::find(targets, target) != targets.end())
      return fail(Errc::InvalidArgument, printable(out) + ": is the name of two outputs; choose two names");
    targets.push_back(target);
    const std::string folder = target.parent_path().string();
    if (!fs::is_directory(folder, ignored))
      return fail(Errc::Io,
                  fmt::format("{}: cannot be written: there is no folder {}", printable(out), printable(folder)));
    if (access(folder.c_str(), W_OK) != 0)
      return fail(Errc::Io,
                  fmt::format("{}: cannot be written: the folder {} is read-only", printable(out), printable(folder)));
  }
  return {};
}

bool names_model(std::string_view file) {
  const auto is_model = has_extension({".relief"});
  return is_model(std::string(file)).empty() || is_model(behind_links(file).string()).empty();
}

Status check_strokes(const std::string& out, bool force, const Progress& progress) {
  std::error_code ignored;
  if (force || !std::filesystem::is_regular_file(out, ignored)) return {};
  const auto existing = ModelFile::open(out, true, part_of(progress, "replaced", 0, 1));
  if (!existing) {
    if (existing.error().code == Errc::Cancelled) return std::unexpected(existing.error());
    if (existing.error().code == Errc::UnsupportedFormat && std::filesystem::file_size(out, ignored) == 0) return {};
    return fail(Errc::InvalidArgument,
                fmt::format("{}; it may hold strokes that would be lost: choose another name, or --force",
                            existing.error().message));
  }
  if (const std::uint64_t strokes = existing->stroke_count() + existing->redo_count(); strokes > 0)
    return fail(Errc::InvalidArgument,
                fmt::format("{}: holds {} stroke{} that would be lost; choose another name, or --force", printable(out),
                            strokes, strokes == 1 ? "" : "s"));
  return {};
}

namespace {
/// The name with another extension, for a remedy.
std::string with_extension(std::string_view file, std::string_view extension) {
  return printable(std::filesystem::path(file).filename().replace_extension(extension).string());
}
}  // namespace

void refuse_usage(const std::string& message) { throw CLI::ValidationError(message); }

void check_no_model(std::initializer_list<OtherOutput> outputs) {
  for (const OtherOutput& out : outputs)
    if (names_model(out.file))
      refuse_usage(fmt::format("{}: {} need a name that does not end in .relief; use {}", printable(out.file), out.kind,
                               with_extension(out.file, out.extension)));
}

void check_model_name(const std::string& out, const std::string& in) {
  std::error_code ignored;
  if (names_model(out) || (!in.empty() && std::filesystem::equivalent(in, out, ignored))) return;
  refuse_usage(fmt::format("{}: a model needs a name that ends in .relief; use {}", printable(out),
                           with_extension(out, ".relief")));
}

Result<ModelFile> open_model(const std::string& file, const Context& context, bool read_only) {
  auto model = ModelFile::open(file, read_only, context.progress);
  if (!model && model.error().code == Errc::UnsupportedFormat)
    return fail(Errc::UnsupportedFormat, model.error().message + "; relief convert makes a model of a mesh");
  if (!model) return std::unexpected(std::move(model.error()));
  RELIEF_CHECK(warn_of_doubt(file, *model, context));
  return model;
}

Status warn_of_doubt(const std::string& file, const ModelFile& model, const Context& context) {
  const std::string doubt = model.doubt(context.progress);
  if (context.progress.cancelled()) return fail(Errc::Cancelled, printable(file) + ": opening was cancelled.");
  if (!doubt.empty())
    warn(fmt::format("{}: {}; relief verify names the places", printable(file), printable(doubt, 380)));
  return {};
}

std::string joined(const std::vector<std::string>& words, std::string_view between) {
  std::string text;
  for (const std::string& word : words) text.append(text.empty() ? "" : between).append(word);
  return text;
}

namespace {
void write_out(std::string_view text) {
  progress_line().clear();
  const bool written = std::fwrite(text.data(), 1, text.size(), stdout) == text.size() && std::fflush(stdout) == 0;
  if (!written && errno != EPIPE) output_failed = true;
}
}  // namespace

void warn(std::string_view text) {
  if (!quiet) std::fputs(fmt::format("relief: warning: {}\n", text).c_str(), stderr);
}

void print(std::string_view text) {
  if (!quiet) write_out(text);
}

nlohmann::ordered_json vector_json(Vec3d v) { return {v.x, v.y, v.z}; }
void print_json(const nlohmann::ordered_json& object) {
  write_out(object.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n");
  json_printed = true;
}

Result<std::string> read_text(const std::filesystem::path& file, std::uintmax_t limit) {
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  const std::string shown = printable(file.string());
  if (!std::filesystem::exists(status)) return fail(Errc::NotFound, shown + ": no such file");
  if (std::filesystem::is_directory(status)) return fail(Errc::Io, shown + ": is a folder");
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return fail(Errc::Io, shown + ": cannot be read");
  std::string text;
  std::string block(1U << 16U, '\0');
  while (stream.read(block.data(), static_cast<std::streamsize>(block.size())) || stream.gcount() > 0) {
    text.append(block, 0, static_cast<std::size_t>(stream.gcount()));
    if (text.size() > limit)
      return fail(Errc::Io,
                  fmt::format("{}: larger than {} MiB, which no file of this kind should be", shown, limit >> 20U));
  }
  return text;
}

}  // namespace relief::cli

int main(int argc, char** argv) try { return relief::cli::main_inner(argc, argv); } catch (const std::exception& e) {
  std::fprintf(stderr, "relief: %s\n", e.what());
  return 1;
}
