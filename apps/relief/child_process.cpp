#include "child_process.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstddef>
#include <thread>

namespace relief::cli {

namespace {

/// Long enough for a command to remove what it has not finished; it does so within 0.1 s unless the machine is busy.
constexpr std::chrono::seconds kGrace{2};
constexpr std::size_t kMostOutput = std::size_t{1} << 20;  // bytes; a report has a few thousand
constexpr int kCannotRun = 127;                            // as shells have it

std::string text_of(int file) {
  std::string text(kMostOutput, '\0');
  std::size_t size = 0;
  while (size < text.size()) {
    const ssize_t got = ::pread(file, text.data() + size, text.size() - size, static_cast<off_t>(size));
    if (got <= 0) break;
    size += static_cast<std::size_t>(got);
  }
  text.resize(size);
  return text;
}

/// Becomes `relief`. Between fork and exec only calls that are safe in a signal handler.
[[noreturn]] void become(char* const* words, ChildLimits limits, int out, int err, pid_t parent) {
  ::setpgid(0, 0);
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(kCannotRun);  // it died before the line above
  if (limits.memory_mib > 0) {
    const rlimit most{.rlim_cur = limits.memory_mib << 20U, .rlim_max = limits.memory_mib << 20U};
    ::setrlimit(RLIMIT_DATA, &most);
  }
  const rlimit no_core{.rlim_cur = 0, .rlim_max = 0};
  ::setrlimit(RLIMIT_CORE, &no_core);
  const int nothing = ::open("/dev/null", O_RDONLY);
  if (nothing < 0 || ::dup2(nothing, STDIN_FILENO) < 0 || ::dup2(out, STDOUT_FILENO) < 0 ||
      ::dup2(err, STDERR_FILENO) < 0)
    ::_exit(kCannotRun);
  ::execv("/proc/self/exe", words);
  ::_exit(kCannotRun);
}

}  // namespace

Result<ChildProcess> ChildProcess::start(std::vector<std::string> arguments, ChildLimits limits) {
  std::string program = "relief";
  std::vector<char*> words = {program.data()};
  for (std::string& each : arguments) words.push_back(each.data());
  words.push_back(nullptr);
  ChildProcess child(limits);
  child.out_ = ::memfd_create("output", MFD_CLOEXEC);
  child.err_ = ::memfd_create("errors", MFD_CLOEXEC);
  if (child.out_ < 0 || child.err_ < 0) return io_error("relief", "cannot be started", errno);
  const pid_t parent = ::getpid();
  child.pid_ = ::fork();
  if (child.pid_ < 0) return io_error("relief", "cannot be started", errno);
  if (child.pid_ == 0) become(words.data(), limits, child.out_, child.err_, parent);
  return child;
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept : ChildProcess(ChildLimits{}) { *this = std::move(other); }

ChildProcess& ChildProcess::operator=(ChildProcess&& other) noexcept {
  std::swap(limits_, other.limits_);
  std::swap(pid_, other.pid_);
  std::swap(out_, other.out_);
  std::swap(err_, other.err_);
  std::swap(timed_out_, other.timed_out_);
  std::swap(started_, other.started_);
  std::swap(kill_at_, other.kill_at_);
  return *this;
}

ChildProcess::~ChildProcess() {
  if (pid_ > 0) {
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }
  if (out_ >= 0) ::close(out_);
  if (err_ >= 0) ::close(err_);
}

std::optional<Ended> ChildProcess::poll() {
  if (pid_ < 0) return {};
  const Clock::time_point now = Clock::now();
  const double seconds = std::chrono::duration<double>(now - started_).count();
  int state = 0;
  rusage usage{};
  if (::wait4(pid_, &state, WNOHANG, &usage) == pid_) {
    pid_ = -1;
    return Ended{.exit_status = WIFEXITED(state) ? WEXITSTATUS(state) : -1,
                 .signal = WIFSIGNALED(state) ? WTERMSIG(state) : 0,
                 .timed_out = timed_out_,
                 .out = text_of(out_),
                 .err = text_of(err_),
                 .seconds = seconds,
                 .peak_mib = static_cast<double>(usage.ru_maxrss) / 1024.0};
  }
  if (kill_at_) {
    if (now > *kill_at_) ::kill(pid_, SIGKILL);
  } else if (limits_.seconds > 0 && seconds > limits_.seconds) {
    timed_out_ = true;
    stop();
  }
  return {};
}

void ChildProcess::wait() {
  while (pid_ > 0 && !poll()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
}

void ChildProcess::stop() {
  if (pid_ < 0 || kill_at_) return;
  ::kill(pid_, SIGTERM);
  kill_at_ = Clock::now() + kGrace;
}

}  // namespace relief::cli
