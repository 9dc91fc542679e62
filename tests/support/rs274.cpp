// SPDX-License-Identifier: Apache-2.0
#include "tests/support/rs274.hpp"

#include <array>
#include <cstdio>
#include <fstream>
#include <sstream>

#include "base/temporary_folder.hpp"

namespace meltstage::motion {

Rs274Run run_rs274(const std::string& program) {
  const TemporaryFolder folder;
  std::ofstream(folder.path() / "program.ngc", std::ios::binary) << program;
  // It keeps its parameters in a file of the working folder, and its tools in one of the home folder: two
  // that share either end by a bus error now and then.
  const std::string command =
      "cd '" + folder.path().string() + "' && HOME=$PWD " MELTSTAGE_RS274 " -g program.ngc 2>&1 </dev/null";
  Rs274Run run;
  FILE* pipe = popen(command.c_str(), "r");
  std::array<char, 4096> buffer{};
  while (pipe != nullptr && std::fgets(buffer.data(), buffer.size(), pipe) != nullptr)
    run.text += buffer.data();
  run.status = pipe == nullptr ? -1 : pclose(pipe);
  return run;
}

Interpreted interpret(const std::string& program) {
  Interpreted out;
  const auto [status, text] = run_rs274(program);
  std::istringstream lines(text);
  bool pressure = false, ended = false;
  std::string last;
  for (std::string line; std::getline(lines, line); last = line) {
    const auto open = line.find('(');
    const auto name_at = line.rfind(' ', open) + 1;
    if (open == std::string::npos) continue;
    const std::string what = line.substr(name_at, open - name_at);
    std::string numbers = line.substr(open + 1);
    std::replace(numbers.begin(), numbers.end(), ',', ' ');
    std::istringstream stream(numbers);
    if (what == "STRAIGHT_TRAVERSE" || what == "STRAIGHT_FEED" || what == "STRAIGHT_PROBE") {
      CanonicalMove move{what, {}, {}, pressure};
      for (double* v : {&move.linear_mm.x(), &move.linear_mm.y(), &move.linear_mm.z(), &move.rotary_deg.x(),
                        &move.rotary_deg.y(), &move.rotary_deg.z()})
        stream >> *v;
      out.moves.push_back(move);
    } else if (what == "USE_TOOL_LENGTH_OFFSET") {
      Eigen::Vector3d offset;
      stream >> offset.x() >> offset.y() >> offset.z();
      out.offsets_mm.push_back(offset);
    } else if (what == "SET_MOTION_OUTPUT_BIT" || what == "SET_AUX_OUTPUT_BIT") {
      pressure = true;
    } else if (what == "CLEAR_MOTION_OUTPUT_BIT" || what == "CLEAR_AUX_OUTPUT_BIT") {
      pressure = false;
    } else if (what == "PROGRAM_END") {
      ended = true;
    }
  }
  if (status != 0 || !ended) out.error = "rs274 stopped: " + last;
  return out;
}

}  // namespace meltstage::motion
