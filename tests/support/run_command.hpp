// SPDX-License-Identifier: Apache-2.0
// The `meltstage` command from outside.
#pragma once

#include <string>

namespace meltstage {

struct Ran {
  int status;          // exit status, -1 when it was killed
  std::string output;  // standard output and error together
};

// Runs any line in a shell to its end.
Ran run_shell(const std::string& line);
/// The line that calls the command with these arguments, for run_shell().
std::string command_line(const std::string& arguments);

// Runs `meltstage ARGUMENTS` in a shell to its end.
Ran run_command(const std::string& arguments);

// The same with a terminal as its input, output and error.
Ran run_in_terminal(const std::string& arguments);

}  // namespace meltstage
