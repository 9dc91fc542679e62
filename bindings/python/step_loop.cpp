// SPDX-License-Identifier: Apache-2.0
// step_loop CLOCKS: what a C++ program takes for the loop that meltstage.Chip.step() runs, in ns of processor
// time a clock.
#include <fmt/format.h>

#include <cstdint>
#include <cstdlib>
#include <ctime>

#include "cmodel/chip.hpp"

int main(int argc, char** argv) {
  using namespace meltstage;
  if (argc != 2) return 2;
  const std::uint64_t clocks = std::strtoull(argv[1], nullptr, 10);
  chip::Chip chip;
  const chip::Inputs pins;
  const std::clock_t begin = std::clock();
  for (std::uint64_t clock = 0; clock < clocks; ++clock) chip.step(pins);
  const double seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  fmt::print("{:.3f} {}\n", seconds * 1e9 / static_cast<double>(clocks), chip.guard.samples_q);
  return 0;
}
