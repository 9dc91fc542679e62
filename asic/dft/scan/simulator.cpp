// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/scan/simulator.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#ifdef __linux__
#include <sys/prctl.h>
#endif
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <string_view>

#include "base/error.hpp"

namespace meltstage::dft {

namespace {

constexpr std::size_t kMostOutput = std::size_t{1} << 20;
constexpr int kNotStarted = 127;

using Clock = std::chrono::steady_clock;

// In the new process; only what may be called between fork and exec.
[[noreturn]] void become(char* const* words, const char* folder, int output) {
  setpgid(0, 0);
#ifdef __linux__
  prctl(PR_SET_PDEATHSIG, SIGKILL);
#endif
  const int nothing = open("/dev/null", O_RDONLY);
  if (nothing >= 0 && chdir(folder) == 0 && dup2(nothing, STDIN_FILENO) >= 0 &&
      dup2(output, STDOUT_FILENO) >= 0 && dup2(output, STDERR_FILENO) >= 0)
    execvp(words[0], words);
  _exit(kNotStarted);
}

// The program with all that it has started. Ends them when it goes out of scope.
class Started {
 public:
  Started(const std::vector<std::string>& words, const std::filesystem::path& folder) : name_(words[0]) {
    std::vector<char*> list;
    for (const std::string& word : words) list.push_back(const_cast<char*>(word.c_str()));
    list.push_back(nullptr);
    int ends[2] = {-1, -1};
    if (pipe2(ends, O_CLOEXEC) != 0) fail();
    process_ = fork();
    if (process_ == 0) become(list.data(), folder.c_str(), ends[1]);
    close(ends[1]);
    output_ = ends[0];
    if (process_ < 0) {
      close(output_);
      fail();
    }
    setpgid(process_, process_);  // here too: whoever comes first
  }
  Started(const Started&) = delete;
  Started& operator=(const Started&) = delete;
  ~Started() {
    end();
    close(output_);
  }

  int output() const { return output_; }
  int end() {
    if (process_ < 0) return status_;
    kill(-process_, SIGKILL);
    return wait();
  }
  int wait() {
    int how = 0;
    while (waitpid(process_, &how, 0) < 0 && errno == EINTR) {
    }
    kill(-process_, SIGKILL);  // what it has left behind
    process_ = -1;
    return status_ = WIFSIGNALED(how) ? 128 + WTERMSIG(how) : WEXITSTATUS(how);
  }

 private:
  [[noreturn]] void fail() const {
    throw UserError(fmt::format("{}: can't be started ({})", name_, std::strerror(errno)));
  }

  std::string name_;
  pid_t process_ = -1;
  int output_ = -1;
  int status_ = 0;
};

}  // namespace

ProgramEnd run_program(const std::vector<std::string>& words, const std::filesystem::path& folder,
                       std::chrono::milliseconds most,
                       const std::function<bool(const std::string&)>& goes_on) {
  Started program(words, folder);
  ProgramEnd end;
  Clock::time_point last = Clock::now();
  std::string line;
  const auto take = [&] {
    if (goes_on(line))
      last = Clock::now();
    else if (end.output.size() < kMostOutput)
      end.output += line + '\n';
    line.clear();
  };
  for (;;) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(last + most - Clock::now());
    if (left.count() <= 0) {
      end.stopped = true;
      end.status = program.end();
      return end;
    }
    pollfd ready{program.output(), POLLIN, 0};
    const int soon = static_cast<int>(std::min<std::int64_t>(left.count(), 60'000));
    if (poll(&ready, 1, soon) <= 0) continue;
    char buffer[4096];
    const ssize_t size = read(program.output(), buffer, sizeof buffer);
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) break;
    for (const char c : std::string_view(buffer, static_cast<std::size_t>(size))) {
      if (c != '\n' && line.size() < kMostOutput)
        line += c;
      else
        take();
    }
  }
  if (!line.empty()) take();
  end.status = program.wait();
  if (end.status == kNotStarted)
    throw UserError(fmt::format("{}: found no such program on the PATH, expected it installed", words[0]));
  return end;
}

}  // namespace meltstage::dft
