// SPDX-License-Identifier: Apache-2.0
// Clocks per second of one Verilated build of the RTL over a recording, whose pins it must give:
// verilator_speed.sh builds this once a set of flags. Best of three rounds, wall time, since two threads are
// one of the sets.
#include <verilated.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <optional>
#include <vector>

#include "Vtc_top.h"
#include "Vtc_top___024root.h"
#include "recording/text.hpp"
#include "tb/lockstep/rising_edge.hpp"
#include "tb/pins/chip_pins.hpp"

namespace meltstage::tb {
namespace {

// So many clocks with these inputs, before each of which the outputs are these.
struct Stretch {
  std::uint64_t clocks;
  chip::Inputs in;
  chip::Outputs out;
};

std::vector<Stretch> stretches_of(const recording::Stream& recording) {
  std::vector<Stretch> list;
  recording::Cursor at(recording);
  do {
    const std::uint64_t next = at.next_event_cycle().value_or(at.final_cycle() + 1);
    list.push_back({next - at.cycle(), inputs_of(at.values()), outputs_of(at.values())});
  } while (at.next_event());
  return list;
}

// Clock at which the outputs first differ from the recorded ones, nothing when they never do.
std::optional<std::uint64_t> first_difference(Vtc_top& top, const std::vector<Stretch>& recording) {
  std::uint64_t clock = 0;
  top.scan_en_i = 0;
  top.scan_i = 0;
  chip::put_inputs({.rst_n = false}, top);
  top.eval();
  verilated::rising_edge(top);  // Verilator takes the first pins for no edge: a clock resets
  chip::Outputs left = chip::take_outputs(top);
  for (const Stretch& stretch : recording) {
    chip::put_inputs(stretch.in, top);
    if (!stretch.in.rst_n) top.eval();  // reset acts without a clock
    for (std::uint64_t i = 0; i < stretch.clocks; ++i, ++clock) {
      if (before_clock(left, stretch.in) != stretch.out) return clock;
      verilated::rising_edge(top);
      left = chip::take_outputs(top);
    }
  }
  return std::nullopt;
}

}  // namespace
}  // namespace meltstage::tb

int main(int argc, char** argv) {
  using namespace meltstage::tb;
  if (argc != 2) {
    std::fprintf(stderr, "verilator_speed: expected RECORDING\n");
    return 2;
  }
  const auto recording = stretches_of(meltstage::recording::read_text(argv[1]));
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
