// The frame of the command line: parsing, progress, Ctrl-C, one line per failure, exit status.
#include "commands.h"

#include <relief/base/atomic_file.h>
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
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <fstream>
#include <new>
#include <optional>
#include <span>
#include <vector>

namespace relief::cli {

namespace {

constexpr int kDone = 0, kFailed = 1, kWrongUsage = 2, kCancelled = 130;

std::atomic<bool> cancel_asked{false};
static_assert(std::atomic<bool>::is_always_lock_free);

std::atomic<bool> nothing_written{false};

/// The first Ctrl-C asks the work to stop and clean up; the second ends the program at once.
void on_signal(int signal) {
  cancel_asked.store(true);
  std::signal(signal, SIG_DFL);
  alarm(1);
}

/// Work that has nothing to clean up need not be waited for.
void on_alarm(int /*signal*/) {
  if (!nothing_written.load()) return;
  constexpr std::string_view kLine = "relief: the command was cancelled.\n";
  [[maybe_unused]] const auto ignored = write(STDERR_FILENO, kLine.data(), kLine.size());
  _exit(kCancelled);
}

/// Progress on a terminal: one line that is written over, and cleared at the end.
class ProgressLine {
 public:
  ProgressLine() : on_terminal_(isatty(STDERR_FILENO) == 1) {}
  void show(std::string_view phase, double share) {
    if (!on_terminal_) return;
    const int percent = static_cast<int>(share * 100);
    if (phase == phase_ && percent == percent_) return;
    phase_ = phase;
    percent_ = percent;
    std::fputs(fmt::format("\r\033[K{} {:3d} %", phase, percent).c_str(), stderr);
    shown_ = true;
  }
  void clear() {
    if (shown_) std::fputs("\r\033[K", stderr);
    shown_ = false;
  }

 private:
  bool on_terminal_, shown_ = false;
  std::string phase_;
  int percent_ = -1;
};

ProgressLine& progress_line() {
  static ProgressLine line;
  return line;
}

bool output_failed = false;

int fail_with(const Error& error) {
  // Exactly one line, whatever a message holds.
  std::fputs(("relief: " + printable(error.message, 480) + "\n").c_str(), stderr);
  return error.code == Errc::Cancelled ? kCancelled : kFailed;
}

int wrong_usage(const CLI::App& app, const std::string& message) {
  const auto chosen = app.get_subcommands();
  const std::string command = chosen.empty() ? "relief" : "relief " + chosen.front()->get_name();
  std::fputs(("relief: " + printable(message, 380) + " (see " + command + " --help)\n").c_str(), stderr);
  return kWrongUsage;
}

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
/// loader has read all names of symbols, 25 MiB for OpenVDB alone. What is asked for again comes back from the files.
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
  CLI::App app(
      "Touch, carve and paint any triangle mesh.\n\n"
      "A scan becomes slabs with displacement maps (convert), which a device, a path or a simulated hand touches "
      "(touch),\n"
      "tools shape (sculpt), and other programs read again (export). Lengths are in the units of the source file.\n"
      "Exit status: 0 done, 1 failed (standard error says why), 2 wrong usage, 130 cancelled.");
  app.name("relief");
  app.require_subcommand(1);
  app.set_version_flag("--version", std::string("relief ") + RELIEF_VERSION);

  Context context;
  context.progress.report = [](std::string_view phase, double share) { progress_line().show(phase, share); };
  context.progress.cancel = &cancel_asked;
  add_convert(app, context);
  add_verify(app, context);
  add_info(app, context);
  add_touch(app, context);
  add_sculpt(app, context);
  add_undo(app, context);
  add_render(app, context);
  add_export(app, context);
  add_sample(app, context);
  add_bench(app, context);
  add_devices(app, context);
  add_replay(app, context);
  add_studio(app, context);

  if (argc > 1 && argv[1][0] != '-') {
    const auto commands = app.get_subcommands([&](const CLI::App* c) { return c->get_name() == argv[1]; });
    if (commands.empty()) return wrong_usage(app, "there is no command " + printable(argv[1], 60));
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    print(app.help("", CLI::AppFormatMode::Normal));
    return kDone;
  } catch (const CLI::CallForVersion& version) {
    print(std::string(version.what()) + "\n");
    return kDone;
  } catch (const CLI::ParseError& error) {
    return wrong_usage(app, error.what());
  }

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
  } catch (const std::bad_alloc&) {
    status = fail(Errc::Io, "out of memory; use a smaller model, fewer slabs or a smaller n");
  } catch (const std::exception& error) {
    status = fail(Errc::Io, error.what());
  }
  progress_line().clear();
  if (status && output_failed) status = fail(Errc::Io, "standard output cannot be written");
  return status ? kDone : fail_with(status.error());
}

}  // namespace

NothingWritten::NothingWritten() { nothing_written.store(true); }
NothingWritten::~NothingWritten() { nothing_written.store(false); }

void finish_command(CLI::App& command, Context& context, std::function<Status()> action, bool has_json) {
  if (has_json) command.add_flag("--json", context.json, "Print one JSON object on standard output and nothing else");
  command.add_option("--threads", context.threads, "Threads to use; results do not depend on it (default: all)")
      ->check(CLI::Range(1, 1024));
  command.callback([&context, action = std::move(action)] { context.run = action; });
}

std::function<std::string(const std::string&)> in_range(double low, double high) {
  return [low, high](const std::string& text) -> std::string {
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    // Written so that what is no number fails, too.
    if (error == std::errc{} && end == text.data() + text.size() && value >= low && value <= high) return {};
    return fmt::format("takes a number from {:g} to {:g}, not \"{}\"", low, high, printable(text, 40));
  };
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
        return fail(Errc::InvalidArgument,
                    printable(out) + ": is the input itself; choose another name for the output");
    const fs::file_status status = fs::status(out, ignored);
    if (fs::is_directory(status))
      return fail(Errc::Io, printable(out) + ": is a folder, and cannot be written as a file");
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

namespace {
/// Whether a file, or what a link leads to, has the name of a model.
bool names_model(std::string_view file) {
  const auto is_model = has_extension({".relief"});
  return is_model(std::string(file)).empty() || is_model(behind_links(file).string()).empty();
}
}  // namespace

Status check_strokes(const std::string& out, bool force) {
  std::error_code ignored;
  if (force || !std::filesystem::is_regular_file(out, ignored)) return {};
  const auto existing = ModelFile::open(out, true);
  if (!existing) {
    if (existing.error().code == Errc::UnsupportedFormat) {
      if (std::filesystem::file_size(out, ignored) == 0) return {};
      // A file of another kind, unless its name says that it was a model.
      if (!names_model(out))
        return fail(Errc::InvalidArgument,
                    existing.error().message + " and would be lost; choose another name, or --force");
    }
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

Status check_no_model(std::initializer_list<std::string_view> outputs) {
  for (const std::string_view out : outputs)
    if (names_model(out))
      return fail(Errc::InvalidArgument,
                  printable(out) + ": is the name of a model, and this output is none; choose another name");
  return {};
}

Result<ModelFile> open_model(const std::string& file, const Context& context, bool read_only) {
  RELIEF_TRY(ModelFile model, ModelFile::open(file, read_only, context.progress));
  RELIEF_CHECK(warn_of_doubt(file, model, context));
  return model;
}

Status warn_of_doubt(const std::string& file, const ModelFile& model, const Context& context) {
  const std::string doubt = model.doubt(context.progress);
  if (context.progress.cancelled()) return fail(Errc::Cancelled, printable(file) + ": opening was cancelled.");
  if (!doubt.empty())
    std::fputs(
        fmt::format("relief: warning: {}: {}; relief verify names the places\n", printable(file), printable(doubt, 380))
            .c_str(),
        stderr);
  return {};
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

void print(std::string_view text) {
  progress_line().clear();
  const bool written = std::fwrite(text.data(), 1, text.size(), stdout) == text.size() && std::fflush(stdout) == 0;
  if (!written && errno != EPIPE) output_failed = true;
}

void print_json(const nlohmann::ordered_json& object) {
  print(object.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n");
}

Result<std::string> read_text(const std::filesystem::path& file, std::uintmax_t limit) {
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  const std::string shown = printable(file.string());
  if (!std::filesystem::exists(status)) return fail(Errc::NotFound, shown + ": no such file");
  if (std::filesystem::is_directory(status)) return fail(Errc::Io, shown + ": is a folder, not a file");
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
