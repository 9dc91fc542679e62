// SPDX-License-Identifier: Apache-2.0
#include "tb/jobs/process.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <system_error>
#include <utility>

namespace meltstage::tb {

namespace {

// What the child's first three file descriptors are.
class FileActions {
 public:
  FileActions() { posix_spawn_file_actions_init(&actions_); }
  ~FileActions() { posix_spawn_file_actions_destroy(&actions_); }
  FileActions(const FileActions&) = delete;
  FileActions& operator=(const FileActions&) = delete;

  void null(int descriptor) {
    posix_spawn_file_actions_addopen(&actions_, descriptor, "/dev/null", O_RDWR, 0);
  }
  void from(int source, int descriptor) { posix_spawn_file_actions_adddup2(&actions_, source, descriptor); }
  pid_t spawn(const Arguments& arguments) const {
    std::vector<char*> argv;
    for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
    argv.push_back(nullptr);
    pid_t pid = -1;
    // Inherited as ignored, it would let the kernel take the child's status before we ask for it.
    if (std::signal(SIGCHLD, SIG_DFL) == SIG_ERR)
      throw std::system_error(errno, std::generic_category(), "SIGCHLD");
    if (const int error = posix_spawnp(&pid, argv[0], &actions_, nullptr, argv.data(), environ); error != 0)
      throw std::system_error(error, std::generic_category(), arguments[0] + ": cannot be started");
    return pid;
  }

 private:
  posix_spawn_file_actions_t actions_;
};

// Whether the child has ended; its status is known then. Throws std::system_error when it can't be asked for.
bool has_ended(pid_t pid, int options, int& status) {
  pid_t done;
  while ((done = waitpid(pid, &status, options)) == -1 && errno == EINTR) {
  }
  if (done == -1)
    throw std::system_error(errno, std::generic_category(), fmt::format("process {}: status", pid));
  return done == pid;
}

}  // namespace

Child::Child(const Arguments& arguments) {
  FileActions files;
  files.null(STDIN_FILENO);
  files.null(STDOUT_FILENO);
  pid_ = files.spawn(arguments);
}

Child& Child::operator=(Child&& other) noexcept {
  std::swap(pid_, other.pid_);
  return *this;
}

Child::~Child() {
  if (pid_ <= 0) return;
  kill(pid_, SIGKILL);
  while (waitpid(pid_, nullptr, 0) == -1 && errno == EINTR) {
  }
}

std::optional<int> Child::poll() {
  int status = 0;
  if (!has_ended(pid_, WNOHANG, status)) return std::nullopt;
  pid_ = -1;
  return status;
}

void end_with_parent() {
  const pid_t parent = getppid();
  if (prctl(PR_SET_PDEATHSIG, SIGKILL) != 0)
    throw std::system_error(errno, std::generic_category(), "prctl PR_SET_PDEATHSIG");
  if (getppid() != parent) std::raise(SIGKILL);  // it ended meanwhile
}

CommandOutput run_command(const Arguments& arguments) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) throw std::system_error(errno, std::generic_category(), "pipe");
  FileActions files;
  files.null(STDIN_FILENO);
  files.from(ends[1], STDOUT_FILENO);
  files.from(ends[1], STDERR_FILENO);
  pid_t pid = -1;
  try {
    pid = files.spawn(arguments);
  } catch (...) {
    close(ends[0]);
    close(ends[1]);
    throw;
  }
  close(ends[1]);
  CommandOutput output{0, {}};
  std::array<char, 4096> buffer;
  for (ssize_t n; (n = read(ends[0], buffer.data(), buffer.size())) != 0;) {
    if (n > 0) output.text.append(buffer.data(), static_cast<std::size_t>(n));
    if (n < 0 && errno != EINTR) break;
  }
  close(ends[0]);
  int status = 0;
  has_ended(pid, 0, status);
  output.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return output;
}

std::string describe_end(int wait_status) {
  if (WIFSIGNALED(wait_status)) return fmt::format("killed by signal {}", WTERMSIG(wait_status));
  return fmt::format("exit status {}", WEXITSTATUS(wait_status));
}

}  // namespace meltstage::tb
