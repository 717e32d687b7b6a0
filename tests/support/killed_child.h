// A child process that tells what it does, until it is killed.
#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <functional>
#include <vector>

namespace relief::testing {

/// Returns all that the child told. `work` gets the end of a pipe that takes Told as bytes, and must not return. The
/// child is killed `microseconds` after `enough` holds of what it told. Empty, with a failure, where it ends by itself.
template <typename Told>
std::vector<Told> told_by_killed_child(const std::function<void(int)>& work,
                                       const std::function<bool(const std::vector<Told>&)>& enough,
                                       unsigned microseconds) {
  std::array<int, 2> pipe{};
  EXPECT_EQ(::pipe(pipe.data()), 0);
  const pid_t child = ::fork();
  EXPECT_GE(child, 0);
  if (child == 0) {
    ::close(pipe[0]);
    work(pipe[1]);
    ::_exit(0);
  }
  ::close(pipe[1]);
  std::vector<Told> told;
  const auto hears = [&] {
    Told next{};
    if (::read(pipe[0], &next, sizeof next) != static_cast<ssize_t>(sizeof next)) return false;
    told.push_back(next);
    return true;
  };
  while (hears() && !enough(told)) {
  }
  ::usleep(microseconds);
  ::kill(child, SIGKILL);
  int status = 0;
  EXPECT_EQ(::waitpid(child, &status, 0), child);
  while (hears()) {
  }
  ::close(pipe[0]);
  EXPECT_TRUE(WIFSIGNALED(status)) << "the child failed by itself with " << WEXITSTATUS(status);
  if (!WIFSIGNALED(status)) told.clear();
  return told;
}

}  // namespace relief::testing
