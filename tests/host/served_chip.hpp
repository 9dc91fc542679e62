// SPDX-License-Identifier: Apache-2.0
// A `meltstage chip serve` of the test's own, and commands run against it.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>

#include "base/temporary_folder.hpp"
#include "tests/support/run_command.hpp"

namespace meltstage {

class ServedChip {
 public:
  // Starts it with these options beside --port and waits until it serves; throws std::runtime_error when it
  // ends instead.
  explicit ServedChip(const std::string& options);
  ~ServedChip();
  ServedChip(const ServedChip&) = delete;
  ServedChip& operator=(const ServedChip&) = delete;

  std::string port() const { return (folder_.path() / "tc").string(); }
  // Waveforms, when the options had --vcd with this name.
  const std::filesystem::path& folder() const { return folder_.path(); }
  pid_t process() const { return process_; }
  // Ends it with the signal; its exit status, -1 when the signal killed it.
  int stop(int signal);
  // What it has printed, all of it after stop().
  const std::string& output() const { return output_; }

 private:
  std::string read_line();

  TemporaryFolder folder_;
  pid_t process_ = -1;
  int pipe_ = -1;
  std::string output_;
};

}  // namespace meltstage
