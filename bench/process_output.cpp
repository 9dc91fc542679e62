// SPDX-License-Identifier: Apache-2.0
#include "bench/process_output.hpp"

#include <array>
#include <cstdio>
#include <memory>

namespace meltstage::app {

std::string output_of(const std::string& command) {
  const auto close = [](std::FILE* pipe) { pclose(pipe); };
  const std::unique_ptr<std::FILE, decltype(close)> pipe(popen(command.c_str(), "r"), close);
  std::string text;
  std::array<char, 4096> piece;
  while (pipe && std::fgets(piece.data(), piece.size(), pipe.get()) != nullptr) text += piece.data();
  return text;
}

}  // namespace meltstage::app
