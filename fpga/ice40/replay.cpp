// SPDX-License-Identifier: Apache-2.0
// replay CLOCKS SEED: the harness of the RTL and the netlist read back from the bitstream, the same random bits into both, the bit that
// comes out compared on every clock. Exits with 1 on a mismatch.
#include <cstdio>
#include <cstdlib>
#include <random>

#include "Vbitstream.h"
#include "Vharness.h"

int main(int argc, char** argv) {
  const long clocks = argc > 1 ? std::atol(argv[1]) : 100'000;
  std::mt19937_64 random(argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1);
  Vharness rtl;
  Vbitstream netlist;
  long mismatches = 0;
  long moved = 0;
  bool last = false;
  const auto step = [&](auto& top, bool reset_n, bool serial, bool latch) {
    top.rst_ni = reset_n;
    top.serial_i = serial;
    top.latch_i = latch;
    top.clk_i = 0;
    top.eval();
    top.clk_i = 1;
    top.eval();
  };
  for (long clock = 0; clock < clocks; ++clock) {
    const bool reset_n = clock >= 4;
    const bool serial = random() & 1;
    const bool latch = random() % 48 == 0;
    step(rtl, reset_n, serial, latch);
    step(netlist, reset_n, serial, latch);
    if (reset_n && rtl.serial_o != netlist.serial_o && ++mismatches <= 3) std::printf("clock %ld: the bit that comes out differs\n", clock);
    moved += rtl.serial_o != last;
    last = rtl.serial_o;
  }
  std::printf("%ld clocks, %ld mismatches; the output moved %ld times\n", clocks, mismatches, moved);
  return mismatches == 0 && moved > clocks / 1000 ? 0 : 1;
}
