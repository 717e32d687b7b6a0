#include "crash_report.h"

#include <execinfo.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <string_view>

namespace relief::studio {

namespace {

struct Fault {
  int signal;
  std::string_view words;
};
constexpr std::array kFaults = {Fault{SIGSEGV, "SIGSEGV"}, Fault{SIGBUS, "SIGBUS"}, Fault{SIGILL, "SIGILL"},
                                Fault{SIGFPE, "SIGFPE"}, Fault{SIGABRT, "SIGABRT"}};
constexpr int kMostCalls = 64;

void say(std::string_view words) {
  [[maybe_unused]] const auto ignored = write(STDERR_FILENO, words.data(), words.size());
}

/// Only what a signal handler may call, but for backtrace(), which is safe once it has been called before.
void on_fault(int signal) {
  say("relief studio: ended by ");
  for (const Fault& fault : kFaults)
    if (fault.signal == signal) say(fault.words);
  say("; the calls that led there:\n");
  std::array<void*, kMostCalls> calls{};
  backtrace_symbols_fd(calls.data(), backtrace(calls.data(), kMostCalls), STDERR_FILENO);
  raise(signal);  // no longer handled here
}

}  // namespace

void report_crashes() {
  // The first call loads a library, which a handler may not. A stack that is full has no room for the handler.
  std::array<void*, 1> first{};
  backtrace(first.data(), 1);
  static std::array<char, 1U << 16U> room;
  stack_t own{};
  own.ss_sp = room.data();
  own.ss_size = room.size();
  sigaltstack(&own, nullptr);
  for (const Fault& fault : kFaults) {
    struct sigaction before{};
    if (sigaction(fault.signal, nullptr, &before) != 0 || before.sa_handler != SIG_DFL) continue;
    struct sigaction ours{};
    ours.sa_handler = on_fault;
    ours.sa_flags = static_cast<int>(SA_RESETHAND | SA_NODEFER | SA_ONSTACK);
    sigaction(fault.signal, &ours, nullptr);
  }
}

}  // namespace relief::studio
