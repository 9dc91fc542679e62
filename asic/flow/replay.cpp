// SPDX-License-Identifier: Apache-2.0
// replay RECORDING COUNTS: the whole chip's netlist over recorded pins (tests/netlist/recording.hpp: lines
// "clocks inputs outputs"), each clock's outputs compared. Counts each net's toggles into COUNTS (Verilator's
// coverage file). Exits with 1 on a mismatch.
#include <cstdio>
#include <fstream>
#include <string>

#include "Vnetlist.h"
#include "verilated.h"
#include "verilated_cov.h"

int main(int argc, char** argv) {
  if (argc != 3) return std::fprintf(stderr, "replay: expected RECORDING COUNTS\n"), 2;
  std::ifstream recording(argv[1]);
  Vnetlist top;
  top.test_mode_i = 0;
  top.scan_en_i = 0;
  top.scan_i = 0;
  const auto clock = [&top] {
    top.eval();
    top.clk_i = 1;
    top.eval();
    top.clk_i = 0;
    top.eval();
  };
  // A simulator sees edges: a flop behind a closed clock gate is reset by one of its reset, not by the level
  // from the start.
  top.rst_ni = 1;
  for (int i = 0; i < 4; ++i) clock();
  unsigned long clocks = 0;
  unsigned long mismatches = 0;
  std::string inputs;
  std::string outputs;
  for (unsigned long length = 0; recording >> length >> inputs >> outputs;) {
    const unsigned in = std::stoul(inputs, nullptr, 2);
    const unsigned wanted = std::stoul(outputs, nullptr, 2);
    for (; length > 0; --length, ++clocks) {
      top.rst_ni = in & 1;
      top.uart_rx_i = in >> 1 & 1;
      top.addr_strap_i = in >> 2 & 7;
      top.spi_miso_i = in >> 5 & 1;
      top.heater_fb_i = in >> 6 & 1;
      top.inhibit_i = in >> 7 & 1;
      top.drop_i = in >> 8 & 1;
      clock();
      const unsigned out = top.at_temp_o << 9 | top.fault_no << 8 | top.safe_en_o << 7 | top.heater_o << 6 |
                           top.spi_mosi_o << 5 | top.spi_cs_no << 4 | top.spi_sclk_o << 3 |
                           top.tlm_tx_o << 2 | top.uart_de_o << 1 | top.uart_tx_o;
      if (out != wanted && ++mismatches <= 3)
        std::printf("clock %lu: outputs %03x, recorded %03x\n", clocks, out, wanted);
    }
  }
  VerilatedCov::write(argv[2]);
  std::printf("%lu clocks, %lu mismatches\n", clocks, mismatches);
  return mismatches == 0 && clocks > 0 ? 0 : 1;
}
