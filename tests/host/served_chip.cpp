// SPDX-License-Identifier: Apache-2.0
#include "tests/host/served_chip.hpp"

#include <fmt/format.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>

namespace meltstage {

ServedChip::ServedChip(const std::string& options) {
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0) throw std::runtime_error("no pipe");
  const std::string command = fmt::format("cd {} && exec {} chip serve --port {} {}", folder_.path().string(),
                                          MELTSTAGE_COMMAND, port(), options);
  process_ = fork();
  if (process_ == 0) {
    prctl(PR_SET_PDEATHSIG, SIGTERM);  // a test that dies leaves no server behind
    dup2(ends[1], STDOUT_FILENO);
    dup2(ends[1], STDERR_FILENO);
    close(ends[0]);
    close(ends[1]);
    execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
    _exit(127);
  }
  close(ends[1]);
  pipe_ = ends[0];
  if (read_line().find("ends with Ctrl-C") == std::string::npos) {
    stop(SIGTERM);
    throw std::runtime_error("chip serve does not serve: " + output_);
  }
}

ServedChip::~ServedChip() { stop(SIGTERM); }

std::string ServedChip::read_line() {
  std::string line;
  char c = 0;
  while (c != '\n' && read(pipe_, &c, 1) == 1) line += c;
  output_ += line;
  return line;
}

int ServedChip::stop(int signal) {
  if (process_ < 0) return -1;
  kill(process_, signal);
  while (!read_line().empty()) {
  }
  close(pipe_);
  int status = 0;
  waitpid(process_, &status, 0);
  process_ = -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

}  // namespace meltstage
