// SPDX-License-Identifier: Apache-2.0
// Inside the scan room: another program, watched while it runs.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace meltstage::dft {

struct ProgramEnd {
  bool stopped = false;  ///< by the time limit
  int status = 0;        ///< exit status; 128 and the signal's number when one ended it
  std::string output;    ///< its first megabyte, errors too; without lines that went on
};

/// Runs a program in `folder`, found by PATH, without an input. `goes_on` gets each line of output and tells
/// whether it shows that the program goes on; when none does for `most`, the program is killed with all that
/// it has started. It ends with this process, however that ends. Throws UserError when it can't be started.
ProgramEnd run_program(const std::vector<std::string>& words, const std::filesystem::path& folder,
                       std::chrono::milliseconds most,
                       const std::function<bool(const std::string&)>& goes_on);

}  // namespace meltstage::dft
