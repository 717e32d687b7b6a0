// batch: the scans of a collection, each converted by a process of its own.
#include "batch_page.h"
#include "batch_scans.h"
#include "child_process.h"
#include "commands.h"
#include "program.h"

#include <relief/base/try.h>
#include <relief/file/model_file.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <csignal>
#include <cstring>
#include <memory>
#include <thread>

namespace relief::cli {

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
using nlohmann::ordered_json;

constexpr std::chrono::milliseconds kPause{10};    // between looks at the running processes
constexpr std::chrono::seconds kPageInterval{30};  // a page of 500 scans takes some 50 ms to write
constexpr double kDefaultTimeout = 3600;           // s; the largest known scans take minutes
constexpr int kThreadsPerJob = 4;                  // of this machine's; a conversion keeps no more of them busy
constexpr std::array<std::string_view, 4> kPicture = {"--size", "400x300", "--view", "corner"};

/// Options of `convert` that hold for every scan of a batch.
struct ConvertOption {
  const char *name, *placeholder;
};
constexpr std::array<ConvertOption, 6> kConvertOptions = {{{"--slabs", "N"},
                                                           {"--samples", "n"},
                                                           {"--error", "E"},
                                                           {"--mode", "MODE"},
                                                           {"--thickness", "T"},
                                                           {"--unit", "mm|cm|m|in"}}};

struct BatchOptions {
  std::string from, out, shard = "1/1", remesh;
  std::array<std::string, kConvertOptions.size()> values;
  int jobs = 0;
  double timeout = kDefaultTimeout;
  std::uint64_t memory = 0;  // MiB
  bool retry = false, force = false;
};

std::vector<std::string> convert_options(const BatchOptions& o) {
  std::vector<std::string> words;
  for (std::size_t k = 0; k < kConvertOptions.size(); ++k)
    if (!o.values[k].empty()) words.insert(words.end(), {kConvertOptions[k].name, o.values[k]});
  if (!o.remesh.empty()) words.push_back(o.remesh == "auto" ? "--remesh" : "--remesh=" + o.remesh);
  return words;
}

struct Shard {
  std::size_t index = 1, count = 1;
};

/// "i/N". Error: InvalidArgument.
Result<Shard> parse_shard(const std::string& text) {
  Shard shard;
  const char* const end = text.data() + text.size();
  const auto [slash, bad_index] = std::from_chars(text.data(), end, shard.index);
  if (bad_index == std::errc{} && slash != end && *slash == '/') {
    const auto [rest, bad_count] = std::from_chars(slash + 1, end, shard.count);
    if (bad_count == std::errc{} && rest == end && shard.index >= 1 && shard.index <= shard.count) return shard;
  }
  return fail(Errc::InvalidArgument,
              fmt::format("--shard takes i/N with i from 1 to N, as 2/8, not \"{}\"", printable(text, 40)));
}

/// Makes the folder where it is missing. Error: Io.
Status prepare_folder(const fs::path& out) {
  std::error_code error;
  if (fs::exists(out, error) && !fs::is_directory(out, error))
    return fail(Errc::Io, printable(out.string()) + ": is a file; -o takes a folder");
  fs::create_directories(out, error);
  if (error) return io_error(out.string(), "the folder cannot be made", error.value());
  return check_outputs({(out / "index.html").string()}, {});
}

std::string duration(double seconds) {
  const auto whole = static_cast<long>(seconds + 0.5);
  if (whole < 60) return fmt::format("{} s", whole);
  if (whole < 3600) return fmt::format("{} min", (whole + 30) / 60);
  return fmt::format("{} h {} min", whole / 3600, whole % 3600 / 60);
}

bool is_full_disk(const std::string& message) {
  return message.contains("disk is full") || message.contains(std::strerror(ENOSPC));
}

/// The sentence of a command that failed, without the program's name.
std::string last_line(std::string text) {
  while (text.ends_with('\n')) text.pop_back();
  if (const std::size_t at = text.rfind('\n'); at != std::string::npos) text.erase(0, at + 1);
  constexpr std::string_view kProgram = "relief: ";
  if (text.starts_with(kProgram)) text.erase(0, kProgram.size());
  return text;
}

/// Why a process did not do its work.
std::string reason_of(const Ended& ended, const BatchOptions& o) {
  if (ended.timed_out) return fmt::format("took longer than {} (--timeout)", duration(o.timeout));
  const std::string line = last_line(ended.err);
  const bool wants_memory = ended.signal != 0 || line.contains("memory");
  if (o.memory > 0 && wants_memory) return fmt::format("needs more memory than {} MiB (--memory)", o.memory);
  if (ended.signal == SIGKILL)
    return "was killed by the system, most likely for want of memory; try fewer --jobs, or --memory";
  if (ended.signal != 0)
    return fmt::format("crashed with signal {} ({}), which is a fault of Relief's", ended.signal,
                       strsignal(ended.signal));
  return line.empty() ? fmt::format("ended with exit status {} and said nothing", ended.exit_status) : line;
}

/// The work on a list of scans: at most so many processes at a time, a record of each scan when it ends.
class Batch {
 public:
  Batch(BatchOptions options, const Context& context)
      : o_(std::move(options)), context_(context), out_(fs::absolute(o_.out).lexically_normal()) {
    if (out_.filename().empty()) out_ = out_.parent_path();
    const int threads =
        context.threads > 0 ? context.threads : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
    if (o_.jobs == 0) o_.jobs = std::max(1, threads / kThreadsPerJob);
    threads_per_job_ = std::max(1, threads / o_.jobs);
  }
  Status run();

 private:
  /// A scan at work: being converted, then drawn.
  struct Job {
    Scan scan;
    Record record;
    ChildProcess process;
    bool draws = false;
  };

  Result<std::vector<Scan>> scans_of_shard();
  Status work();
  /// Begins with the next scan, or passes over it where its record says that nothing is left to do.
  Status begin(const Scan& scan);
  [[nodiscard]] Result<bool> is_settled(const Scan& scan, const Inputs& inputs);
  [[nodiscard]] Status keep_place(Record& record, const Inputs& now) const;
  /// Takes what a process left. Returns whether the job goes on.
  Result<bool> go_on(Job& job, const Ended& ended);
  Status finish(Job& job);
  [[nodiscard]] std::string sentence(const Record& record) const;
  void show_progress();
  /// Scans of this run that have neither a model nor a failure yet.
  [[nodiscard]] std::size_t waiting() const {
    return scans_.size() - done_ - skipped_ - failed_.size() - failed_before_;
  }
  void stop_all();
  [[nodiscard]] fs::path output(const std::string& name, std::string_view extension) const {
    return out_ / (name + std::string(extension));
  }

  BatchOptions o_;
  const Context& context_;
  fs::path out_;
  int threads_per_job_ = 1;
  std::vector<Scan> scans_;
  std::vector<Record> before_;
  std::vector<Job> jobs_;
  std::size_t next_ = 0, done_ = 0, skipped_ = 0;
  std::vector<Record> failed_;
  std::size_t failed_before_ = 0;
  Seen seen_;
  double bytes_all_ = 0, bytes_skipped_ = 0, bytes_done_ = 0;
  Clock::time_point started_ = Clock::now(), page_written_ = Clock::now();
};

Result<std::vector<Scan>> Batch::scans_of_shard() {
  RELIEF_TRY(const Shard shard, parse_shard(o_.shard));
  RELIEF_TRY(FoundScans found, find_scans(o_.from, out_));
  std::vector<Scan>& scans = found.scans;
  seen_ = Seen::of(found);
  for (const std::string& folder : seen_.unreadable) warn(folder + "; its scans are left out");
  RELIEF_CHECK(prepare_folder(out_));
  RELIEF_TRY(before_, read_records(out_));
  name_scans(scans, before_, out_);
  std::vector<Scan> ours;
  for (std::size_t k = shard.index - 1; k < scans.size(); k += shard.count) ours.push_back(std::move(scans[k]));
  return ours;
}

/// Empty files count as well, so that the fraction ends at one.
double weight(const Inputs& inputs) { return static_cast<double>(inputs.bytes) + 1; }

Status Batch::run() {
  RELIEF_TRY(scans_, scans_of_shard());
  for (const Scan& scan : scans_) bytes_all_ += weight(Inputs::of(scan.file, {}));
  const Status worked = work();
  stop_all();
  const Status listed = write_batch_page(out_, waiting(), seen_);
  RELIEF_CHECK(worked);  // of a full disk, the work says more than the page
  RELIEF_CHECK(listed);
  const std::string page = (out_ / "index.html").string();
  const std::size_t failed = failed_.size() + failed_before_;
  const std::string remedy = failed_before_ > 0 ? fmt::format(" ({} before; --retry tries again)", failed_before_) : "";
  Status ended;
  if (failed > 0)
    ended = fail(Errc::Io, fmt::format("{}: {} of {} scans failed{}; index.html lists them", printable(o_.out), failed,
                                       scans_.size(), remedy));
  else if (const auto& folders = seen_.unreadable; !folders.empty())
    ended = fail(Errc::Io, fmt::format("{} folder{} cannot be read, the first is {}", folders.size(),
                                       folders.size() == 1 ? "" : "s", folders.front()));
  if (context_.json) {
    ordered_json json = {{"scans", scans_.size()},
                         {"shard", o_.shard},
                         {"done", done_},
                         {"skipped", skipped_},
                         {"failed", failed},
                         {"failed_before", failed_before_},
                         {"other_files", seen_.others.size()},
                         {"unreadable", seen_.unreadable},
                         {"seconds", std::chrono::duration<double>(Clock::now() - started_).count()},
                         {"index", page},
                         {"failures", ordered_json::array()}};
    for (const Record& r : failed_)
      json["failures"].push_back(
          {{"scan", r.inputs.scan}, {"record", r.name + std::string(kRecord)}, {"message", r.message}});
    add_error(json, ended);
    print_json(json);
  } else {
    const std::size_t passed = seen_.others.size();
    const std::string others =
        passed > 0 ? fmt::format("; {} other file{} passed over", passed, passed == 1 ? "" : "s") : std::string();
    print(fmt::format("{} scan{}: {} done, {} done before, {} failed{}; see {}\n", scans_.size(),
                      scans_.size() == 1 ? "" : "s", done_, skipped_, failed, others,
                      printable(o_.out + "/index.html")));
  }
  return ended;
}

Status Batch::work() {
  while (next_ < scans_.size() || !jobs_.empty()) {
    if (context_.progress.cancelled())
      return fail(Errc::Cancelled, printable(o_.out) + ": the batch was cancelled; the same command continues it");
    while (next_ < scans_.size() && jobs_.size() < static_cast<std::size_t>(o_.jobs) && !context_.progress.cancelled())
      RELIEF_CHECK(begin(scans_[next_++]));
    for (std::size_t k = 0; k < jobs_.size();) {
      const auto ended = jobs_[k].process.poll();
      bool goes_on = true;
      // What was stopped from outside says nothing about the scan.
      if (ended && context_.progress.cancelled()) break;
      if (ended) {
        RELIEF_TRY(goes_on, go_on(jobs_[k], *ended));
      }
      if (goes_on) {
        ++k;
        continue;
      }
      RELIEF_CHECK(finish(jobs_[k]));
      jobs_.erase(jobs_.begin() + static_cast<std::ptrdiff_t>(k));
    }
    show_progress();
    if (Clock::now() - page_written_ > kPageInterval) {
      RELIEF_CHECK(write_batch_page(out_, waiting(), seen_));
      page_written_ = Clock::now();
    }
    std::this_thread::sleep_for(kPause);
  }
  return {};
}

/// Takes down where a scan lies now, when it was moved.
Status Batch::keep_place(Record& record, const Inputs& now) const {
  if (record.inputs.scan == now.scan) return {};
  record.message = record.reason();  // which stands without the place
  record.inputs.scan = now.scan;
  return save(record, out_);
}

Result<bool> Batch::is_settled(const Scan& scan, const Inputs& inputs) {
  const auto before = std::ranges::find(before_, scan.name, &Record::name);
  if (before == before_.end() || !before->inputs.gives_the_same(inputs)) return false;
  if (!before->done) {
    if (o_.retry) return false;
    ++failed_before_;
    RELIEF_CHECK(keep_place(*before, inputs));
    return true;
  }
  const fs::path model = output(scan.name, ".relief");
  const auto opened = ModelFile::open(model, true, {.report = {}, .cancel = context_.progress.cancel});
  if (!opened && opened.error().code == Errc::Cancelled) return std::unexpected(opened.error());
  const bool is_broken = !opened && (opened.error().code == Errc::Corrupt || opened.error().code == Errc::NotFound ||
                                     opened.error().code == Errc::UnsupportedFormat);
  if (!is_broken) {
    ++skipped_;
    RELIEF_CHECK(keep_place(*before, inputs));
    return true;
  }
  // It may hold strokes that can be salvaged.
  std::error_code error;
  if (fs::exists(model, error)) {
    const fs::path aside = output(scan.name, ".relief.damaged");
    fs::rename(model, aside, error);
    if (error) return io_error(model.string(), "is damaged and cannot be put aside", error.value());
  }
  return false;
}

Status Batch::begin(const Scan& scan) {
  Record record;
  record.name = scan.name;
  record.made_by = program();
  record.inputs = Inputs::of(scan.file, convert_options(o_));
  RELIEF_TRY(const bool is_settled_before, is_settled(scan, record.inputs));
  if (is_settled_before) {
    bytes_skipped_ += weight(record.inputs);
    return {};
  }
  // What is there is of other inputs from now on.
  std::error_code ignored;
  fs::remove(output(scan.name, kRecord), ignored);
  std::vector<std::string> words = {"convert",
                                    scan.file.string(),
                                    "-o",
                                    output(scan.name, ".relief").string(),
                                    "--json",
                                    "--threads",
                                    std::to_string(threads_per_job_)};
  words.insert(words.end(), record.inputs.options.begin(), record.inputs.options.end());
  if (o_.force) words.emplace_back("--force");
  RELIEF_TRY(ChildProcess process, ChildProcess::start(words, {.seconds = o_.timeout, .memory_mib = o_.memory}));
  jobs_.push_back({.scan = scan, .record = std::move(record), .process = std::move(process)});
  return {};
}

Result<bool> Batch::go_on(Job& job, const Ended& ended) {
  Record& r = job.record;
  r.seconds += ended.seconds;
  r.peak_mib = std::max(r.peak_mib, ended.peak_mib);
  const bool worked = ended.exit_status == 0;
  if (!worked && is_full_disk(ended.err))
    return fail(Errc::Io, printable(o_.out) + ": the disk is full; free space, and the same command continues");
  if (job.draws) {
    // A model without a picture is a model.
    if (worked) r.picture = r.name + ".png";
    return false;
  }
  r.report = ordered_json::parse(ended.out, nullptr, false);
  r.done = worked && r.report.is_object();
  if (!r.done) {
    r.report = nullptr;
    r.message = reason_of(ended, o_);
    r.exit_status = ended.exit_status;
    r.signal = ended.signal;
    r.timed_out = ended.timed_out;
    return false;
  }
  std::vector<std::string> words = {"render",    output(r.name, ".relief").string(),
                                    "-o",        output(r.name, ".png").string(),
                                    "--look",    "matcap",
                                    "--samples", "4",
                                    "--threads", std::to_string(threads_per_job_)};
  words.insert(words.end(), kPicture.begin(), kPicture.end());
  RELIEF_TRY(job.process, ChildProcess::start(words, {.seconds = o_.timeout, .memory_mib = o_.memory}));
  job.draws = true;
  return true;
}

Status Batch::finish(Job& job) {
  RELIEF_CHECK(save(job.record, out_));
  bytes_done_ += weight(job.record.inputs);
  if (!context_.json) print(sentence(job.record) + "\n");
  if (job.record.done)
    ++done_;
  else
    failed_.push_back(std::move(job.record));
  return {};
}

std::string Batch::sentence(const Record& r) const {
  const std::string name = printable(r.name, 80);
  if (!r.done) return fmt::format("{}: failed: {}", name, printable(r.reason(), 300));
  return fmt::format("{}: {}", name, r.report.value("verdict", ""));
}

void Batch::show_progress() {
  const std::size_t ended = next_ - jobs_.size();
  const std::string text = fmt::format("scan {} of {}", std::min(ended + 1, scans_.size()), scans_.size());
  context_.progress(text, (bytes_skipped_ + bytes_done_) / bytes_all_);
}

void Batch::stop_all() {
  for (Job& job : jobs_) job.process.stop();
  for (Job& job : jobs_) job.process.wait();
  jobs_.clear();
}

}  // namespace

void add_batch(CLI::App& app, Context& context) {
  auto o = std::make_shared<BatchOptions>();
  CLI::App* convert = app.get_subcommand("convert");
  CLI::App* c = app.add_subcommand("batch", "Convert a whole collection of scans, and continue where it stopped");
  context.catalogue[c] = {
      .group = "Make",
      .examples = {{"relief batch scans -o models"},
                   {"relief batch scans -o models --jobs 4 --timeout 600 --memory 8000"},
                   {"relief batch list.txt -o models --slabs 500 --retry", "a path per line; failed ones again"},
                   {"relief batch scans -o models --shard 2/8", "on the second of eight machines"}}};
  c->add_option(
       "SCANS", o->from,
       "folder with meshes, searched with all folders in it, or text file with a path per line; - reads that from "
       "standard input")
      ->required()
      ->type_name("FOLDER|LIST")
      ->check(names_file);
  c->add_option("-o,--output", o->out,
                "folder for NAME.relief, NAME.report.json, NAME.png of each scan, and index.html")
      ->required()
      ->type_name("FOLDER")
      ->check(names_file);
  c->add_option("--shard", o->shard,
                "every N-th scan only, from the i-th on; shards share a folder and run at any time")
      ->type_name("i/N")
      ->check([](const std::string& text) {
        const auto parsed = parse_shard(text);
        return parsed ? std::string() : parsed.error().message;
      });
  c->add_option("--jobs", o->jobs, "scans at a time")
      ->type_name("N")
      ->check(whole_in_range(1, 1024))
      ->default_str("one for every 4 threads");
  c->add_option("--timeout", o->timeout, "stop a scan that takes longer; 0: never")
      ->type_name("SECONDS")
      ->check(in_range(0, 1e7))
      ->default_str("3600");
  c->add_option("--memory", o->memory, "stop a scan that needs more; 0: no limit")
      ->type_name("MIB")
      ->check(whole_in_range(0, 100'000'000))
      ->default_str("0");
  c->add_flag("--retry", o->retry, "also try again what failed before");
  for (std::size_t k = 0; k < kConvertOptions.size(); ++k)
    c->add_option(kConvertOptions[k].name, o->values[k], "as for relief convert")
        ->type_name(kConvertOptions[k].placeholder)
        ->check(*convert->get_option(kConvertOptions[k].name)->get_validator(0))
        ->group("Conversion");
  c->add_flag("--remesh{auto}", o->remesh, "as for relief convert; --remesh=VOXEL")->group("Conversion");
  c->add_flag("--force", o->force, "replace models that have strokes");
  const auto run = [o, &context] { return Batch(*o, context).run(); };
  finish_command(*c, context, run);
  // The options of a conversion are judged where they belong, before any scan is touched.
  c->callback([o, &context, convert, run] {
    std::vector<std::string> words = convert_options(*o);
    words.insert(words.end(), {"-o", "MODEL.relief", "SCAN"});
    std::ranges::reverse(words);
    convert->parse(std::move(words));
    context.run = run;
  });
}

}  // namespace relief::cli
