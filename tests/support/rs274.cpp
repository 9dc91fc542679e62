// SPDX-License-Identifier: Apache-2.0
#include "tests/support/rs274.hpp"

#include <unistd.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>

namespace meltstage::motion {

Interpreted interpret(const std::string& program) {
  const auto file =
      std::filesystem::temp_directory_path() / ("meltstage_rs274." + std::to_string(getpid()) + ".ngc");
  std::ofstream(file, std::ios::binary) << program;
  // It keeps its parameters in a file of the working folder.
  const std::string command = "cd '" + std::filesystem::temp_directory_path().string() +
                              "' && " MELTSTAGE_RS274 " -g '" + file.string() + "' 2>&1 </dev/null";
  Interpreted out;
  FILE* pipe = popen(command.c_str(), "r");
  std::array<char, 4096> buffer{};
  std::string text;
  while (pipe != nullptr && std::fgets(buffer.data(), buffer.size(), pipe) != nullptr) text += buffer.data();
  const int status = pipe == nullptr ? -1 : pclose(pipe);
  std::filesystem::remove(file);
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
