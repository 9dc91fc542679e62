// SPDX-License-Identifier: Apache-2.0
// Tools that run as processes of their own.
#pragma once

#include <string>
#include <vector>

namespace meltstage::hls {

/// What a finished process has said, both streams together.
struct Finished {
  int status;
  std::string output;
};

/// Runs `program` of the search path until it ends. Throws UserError naming `package` when there is none.
Finished run_tool(const std::string& program, const std::string& package,
                  const std::vector<std::string>& arguments);

/// The first line of a tool's output that holds `word`, or its last line.
std::string line_with(const std::string& output, const std::string& word);

}  // namespace meltstage::hls
