// SPDX-License-Identifier: Apache-2.0
// Clocks per second of one Verilated build of the RTL over a recording, whose pins it must give:
// verilator_speed.sh builds this once a set of flags. Best of three rounds, wall time, since two threads are
// one of the sets.
#include <verilated.h>

#include <algorithm>
#include <cstdio>
#include <ctime>

#include "Vtc_top.h"
#include "tests/rtl/replay.hpp"

int main(int argc, char** argv) {
  using namespace meltstage::tb;
  if (argc != 2) {
    std::fprintf(stderr, "verilator_speed: expected RECORDING\n");
    return 2;
  }
  const auto recording = read_recording(argv[1]);
  double clocks = 0.0;
  for (const Stretch& stretch : recording) clocks += static_cast<double>(stretch.clocks);
  double best = 0.0;
  for (int round = 0; round < 3; ++round) {
    VerilatedContext context;
    Vtc_top top(&context);
    timespec begin{};
    timespec end{};
    clock_gettime(CLOCK_MONOTONIC, &begin);
    const auto difference = first_difference(top, recording);
    clock_gettime(CLOCK_MONOTONIC, &end);
    if (difference) {
      std::printf("wrong at clock %llu\n", static_cast<unsigned long long>(*difference));
      return 1;
    }
    const double seconds = static_cast<double>(end.tv_sec - begin.tv_sec) +
                           1e-9 * static_cast<double>(end.tv_nsec - begin.tv_nsec);
    best = std::max(best, clocks / seconds);
    top.final();
  }
  std::printf("%.3f\n", best / 1e6);
}
