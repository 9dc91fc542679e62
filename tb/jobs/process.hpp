// SPDX-License-Identifier: Apache-2.0
// Child processes: workers, and commands whose output is wanted.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

namespace meltstage::tb {

using Arguments = std::vector<std::string>;  // program first; searched in PATH when it has no slash

// A child without input and output; it may write to our standard error. Killed when this object goes away
// before it ended.
class Child {
 public:
  // Throws std::system_error when it can't be started.
  explicit Child(const Arguments& arguments);
  Child(Child&& other) noexcept : pid_(other.pid_) { other.pid_ = -1; }
  Child& operator=(Child&& other) noexcept;
  ~Child();

  // Wait status (waitpid) once it has ended.
  std::optional<int> poll();
  pid_t pid() const { return pid_; }

 private:
  pid_t pid_;
};

struct CommandOutput {
  int status;        // exit status; 128 + signal when killed
  std::string text;  // standard output and error together
};

// From now on this process, a worker, is killed when the one that started it ends: a run that was killed
// leaves nobody behind who would still write into its folder.
void end_with_parent();

// Runs a command to its end. Throws std::system_error when it can't be started.
CommandOutput run_command(const Arguments& arguments);

// "exit status 3" or "killed by signal 9".
std::string describe_end(int wait_status);

}  // namespace meltstage::tb
