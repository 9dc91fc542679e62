// SPDX-License-Identifier: Apache-2.0
// replay RECORDING [COUNTS]: the whole chip's netlist over recorded pins, each clock's outputs compared.
// Verilated with coverage, each net's toggles go into COUNTS. Exits with 1 on a mismatch. Lines of a
// recording, bits from the highest:
//   clocks inputs outputs   pins over so many clocks (tb/tools/recording.hpp)
//   load bits               before them: what goes into the scan chains with one clock, so that the run
//   begins in that state unload bits             after them: what has to come out of the chains before each
//   clock, '-' if nothing has to
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

namespace {

struct Step {
  unsigned long clocks = 0;
  unsigned inputs = 0;
  unsigned outputs = 0;
};

struct Recording {
  std::vector<std::string> load;
  std::vector<Step> steps;
  std::vector<std::string> unload;
  unsigned long clocks = 0;
};

unsigned binary(const std::string& digits) { return static_cast<unsigned>(std::stoul(digits, nullptr, 2)); }

Recording read(const char* path) {
  Recording recording;
  std::ifstream file(path);
  std::string word;
  std::string inputs;
  std::string outputs;
  while (file >> word >> inputs) {
    if (word == "load") {
      recording.load.push_back(inputs);
    } else if (word == "unload") {
      recording.unload.push_back(inputs);
    } else {
      file >> outputs;
      recording.steps.push_back({std::stoul(word), binary(inputs), binary(outputs)});
      recording.clocks += recording.steps.back().clocks;
    }
  }
  return recording;
}

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

template <class Netlist>
void set_scan(Netlist& top, unsigned bits) {
  if constexpr (requires { top.scan_i; }) {
    top.scan_i = bits;
  } else if constexpr (requires { top.scan_i_7; }) {
    top.scan_i_0 = bits & 1;
    top.scan_i_1 = bits >> 1 & 1;
    top.scan_i_2 = bits >> 2 & 1;
    top.scan_i_3 = bits >> 3 & 1;
    top.scan_i_4 = bits >> 4 & 1;
    top.scan_i_5 = bits >> 5 & 1;
    top.scan_i_6 = bits >> 6 & 1;
    top.scan_i_7 = bits >> 7 & 1;
  }
}

template <class Netlist>
unsigned get_scan(const Netlist& top) {
  if constexpr (requires { top.scan_o; })
    return top.scan_o;
  else if constexpr (requires { top.scan_o_7; })
    return top.scan_o_7 << 7 | top.scan_o_6 << 6 | top.scan_o_5 << 5 | top.scan_o_4 << 4 | top.scan_o_3 << 3 |
           top.scan_o_2 << 2 | top.scan_o_1 << 1 | top.scan_o_0;
  else
    return 0;
}

void set_pins(Vnetlist& top, unsigned in) {
  top.rst_ni = in & 1;
  top.uart_rx_i = in >> 1 & 1;
  set_strap(top, in >> 2 & 7);
  top.spi_miso_i = in >> 5 & 1;
  top.heater_fb_i = in >> 6 & 1;
  top.inhibit_i = in >> 7 & 1;
  top.drop_i = in >> 8 & 1;
}

unsigned get_pins(const Vnetlist& top) {
  return top.at_temp_o << 9 | top.fault_no << 8 | top.safe_en_o << 7 | top.heater_o << 6 |
         top.spi_mosi_o << 5 | top.spi_cs_no << 4 | top.spi_sclk_o << 3 | top.tlm_tx_o << 2 |
         top.uart_de_o << 1 | top.uart_tx_o;
}

// The inputs change while the clock falls, the outputs are looked at while it is high.
void fall(Vnetlist& top) {
  top.clk_i = 0;
  top.eval();
}
void rise(Vnetlist& top) {
  top.clk_i = 1;
  top.eval();
}

void shifting(Vnetlist& top, bool on) { top.test_mode_i = top.scan_en_i = on; }

void load(Vnetlist& top, const std::vector<std::string>& lines) {
  shifting(top, true);
  for (const std::string& bits : lines) {
    set_scan(top, binary(bits));
    fall(top);
    rise(top);
  }
  shifting(top, false);
}

// Clocks at which something else came out.
unsigned long unload(Vnetlist& top, const std::vector<std::string>& lines) {
  shifting(top, true);
  unsigned long wrong = 0;
  for (const std::string& bits : lines) {
    fall(top);
    const unsigned out = get_scan(top);
    bool equal = true;
    for (std::size_t i = 0; i < bits.size(); ++i)
      equal = equal && (bits[i] == '-' || unsigned(bits[i] - '0') == (out >> (bits.size() - 1 - i) & 1));
    wrong += !equal;
    rise(top);
  }
  return wrong;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || argc > 3) return std::fprintf(stderr, "replay: expected RECORDING [COUNTS]\n"), 2;
  const Recording recording = read(argv[1]);
  Vnetlist top;
  shifting(top, false);
  // A simulator sees edges: a flop behind a closed clock gate is reset by one of its reset, not by the level
  // from the start.
  for (const unsigned reset_n : {1u, 0u, 1u}) {
    top.rst_ni = reset_n;
    for (int i = 0; i < 4; ++i) fall(top), rise(top);
  }
  if (!recording.load.empty()) load(top, recording.load);
#if VM_COVERAGE
  Verilated::threadContextp()->coveragep()->zero();
#endif
  unsigned long clocks = 0;
  unsigned long mismatches = 0;
  for (const Step& step : recording.steps) {
    for (unsigned long i = 0; i < step.clocks; ++i, ++clocks) {
      if (isatty(2) && clocks % 10000 == 0)
        std::fprintf(stderr, "\rreplay: %lu of %lu clocks", clocks, recording.clocks);
      set_pins(top, step.inputs);
      fall(top);
      rise(top);
      const unsigned out = get_pins(top);
      if (out != step.outputs && ++mismatches <= 3)
        std::printf("clock %lu: outputs %03x, recorded %03x\n", clocks, out, step.outputs);
    }
  }
  if (isatty(2)) std::fprintf(stderr, "\n");
#if VM_COVERAGE
  if (argc == 3) VerilatedCov::write(argv[2]);
#endif
  if (const unsigned long wrong = unload(top, recording.unload); wrong > 0) {
    std::printf("flops after the last clock: other than recorded at %lu of %zu shifts\n", wrong,
                recording.unload.size());
    mismatches += wrong;
  }
  std::printf("%lu clocks, %lu mismatches\n", clocks, mismatches);
  return mismatches == 0 && clocks > 0 ? 0 : 1;
}
