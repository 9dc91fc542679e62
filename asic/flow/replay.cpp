// SPDX-License-Identifier: Apache-2.0
// replay RECORDING [COUNTS]: the whole chip's netlist over recorded pins (tests/netlist/recording.hpp: lines
// "clocks inputs outputs"), each clock's outputs compared. Verilated with coverage, each net's toggles go
// into COUNTS. Exits with 1 on a mismatch.
#include <unistd.h>

#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

#include "Vnetlist.h"
#include "verilated.h"
#if VM_COVERAGE
#include "verilated_cov.h"
#endif

struct Step {
  unsigned long clocks = 0;
  unsigned inputs = 0;
  unsigned outputs = 0;
};

// a layout has a port for each bit
template <class Netlist>
void set_strap(Netlist& top, unsigned strap) {
  if constexpr (requires { top.addr_strap_i; }) {
    top.addr_strap_i = strap;
  } else {
    top.addr_strap_i_0 = strap & 1;
    top.addr_strap_i_1 = strap >> 1 & 1;
    top.addr_strap_i_2 = strap >> 2 & 1;
  }
}

int main(int argc, char** argv) {
  if (argc < 2 || argc > 3) return std::fprintf(stderr, "replay: expected RECORDING [COUNTS]\n"), 2;
  std::ifstream recording(argv[1]);
  std::vector<Step> steps;
  unsigned long all_clocks = 0;
  std::string inputs;
  std::string outputs;
  for (unsigned long length = 0; recording >> length >> inputs >> outputs; all_clocks += length)
    steps.push_back({length, static_cast<unsigned>(std::stoul(inputs, nullptr, 2)),
                     static_cast<unsigned>(std::stoul(outputs, nullptr, 2))});
  Vnetlist top;
  top.test_mode_i = 0;
  top.scan_en_i = 0;
  // the inputs change while the clock falls, the outputs are looked at while it is high
  const auto fall = [&top] {
    top.clk_i = 0;
    top.eval();
  };
  const auto rise = [&top] {
    top.clk_i = 1;
    top.eval();
  };
  // A simulator sees edges: a flop behind a closed clock gate is reset by one of its reset, not by the level
  // from the start.
  top.rst_ni = 1;
  for (int i = 0; i < 4; ++i) fall(), rise();
  unsigned long clocks = 0;
  unsigned long mismatches = 0;
  for (const Step& step : steps) {
    const unsigned in = step.inputs;
    for (unsigned long i = 0; i < step.clocks; ++i, ++clocks) {
      if (isatty(2) && clocks % 10000 == 0)
        std::fprintf(stderr, "\rreplay: %lu of %lu clocks", clocks, all_clocks);
      top.rst_ni = in & 1;
      top.uart_rx_i = in >> 1 & 1;
      set_strap(top, in >> 2 & 7);
      top.spi_miso_i = in >> 5 & 1;
      top.heater_fb_i = in >> 6 & 1;
      top.inhibit_i = in >> 7 & 1;
      top.drop_i = in >> 8 & 1;
      fall();
      rise();
      const unsigned out = top.at_temp_o << 9 | top.fault_no << 8 | top.safe_en_o << 7 | top.heater_o << 6 |
                           top.spi_mosi_o << 5 | top.spi_cs_no << 4 | top.spi_sclk_o << 3 |
                           top.tlm_tx_o << 2 | top.uart_de_o << 1 | top.uart_tx_o;
      if (out != step.outputs && ++mismatches <= 3)
        std::printf("clock %lu: outputs %03x, recorded %03x\n", clocks, out, step.outputs);
    }
  }
  if (isatty(2)) std::fprintf(stderr, "\n");
#if VM_COVERAGE
  if (argc == 3) VerilatedCov::write(argv[2]);
#endif
  std::printf("%lu clocks, %lu mismatches\n", clocks, mismatches);
  return mismatches == 0 && clocks > 0 ? 0 : 1;
}
