// SPDX-License-Identifier: Apache-2.0
#include "tests/support/run_command.hpp"

#include <sys/wait.h>

#include <array>
#include <cstdio>

namespace meltstage {

Ran run_shell(const std::string& line) {
  FILE* pipe = popen(("{ " + line + " ; } 2>&1").c_str(), "r");
  Ran ran{-1, {}};
  std::array<char, 4096> buffer;
  while (const std::size_t n = fread(buffer.data(), 1, buffer.size(), pipe))
    ran.output.append(buffer.data(), n);
  const int status = pclose(pipe);
  ran.status = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return ran;
}

std::string command_line(const std::string& arguments) {
  return std::string(MELTSTAGE_COMMAND) + " " + arguments;
}

Ran run_command(const std::string& arguments) { return run_shell(command_line(arguments)); }

Ran run_in_terminal(const std::string& arguments) {
  return run_shell("script --quiet --return --flush --command '" + std::string(MELTSTAGE_COMMAND) + " " +
                   arguments + "' /dev/null </dev/null");
}

}  // namespace meltstage
