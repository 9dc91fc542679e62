// SPDX-License-Identifier: Apache-2.0
// replay RECORDING.mvec [COUNTS]: the whole chip's netlist over recorded pins, each clock's outputs compared
// before it. Verilated with coverage, each net's toggles go into COUNTS. Beside it RECORDING.scan may say
// what goes through the scan chains (print_windows.py), a line a clock, a character a chain, the last chain
// first:
//   load bits     before the pins: into the chains, so that the run begins in that state
//   unload bits   after them: out of the chains before the clock, '-' if nothing has to
// Exits with 1 on a mismatch, 2 when a file can't be used.
#include <unistd.h>

#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "Vnetlist.h"
#include "cmodel/pins.hpp"
#include "recording/text.hpp"
#include "tb/pins/chip_pins.hpp"
#include "verilated.h"
#if VM_COVERAGE
#include "verilated_cov.h"
#endif

namespace {

using meltstage::chip::Inputs;
using meltstage::chip::Outputs;

struct Scan {
  std::vector<std::string> load;
  std::vector<std::string> unload;
};

unsigned binary(const std::string& digits) { return static_cast<unsigned>(std::stoul(digits, nullptr, 2)); }

Scan read_scan(const std::filesystem::path& path) {
  Scan scan;
  std::ifstream file(path);
  for (std::string word, bits; file >> word >> bits;)
    (word == "load" ? scan.load : scan.unload).push_back(bits);
  return scan;
}

// A layout has a port for each bit.
template <class Netlist>
void set_pins(Netlist& top, const Inputs& in) {
#define TC_PUT(port, member, bits)                   \
  if constexpr (requires { top.port; }) {            \
    top.port = in.member;                            \
  } else if constexpr (requires { top.port##_2; }) { \
    top.port##_0 = in.member & 1;                    \
    top.port##_1 = in.member >> 1 & 1;               \
    top.port##_2 = in.member >> 2 & 1;               \
  }
  TC_INPUT_PINS(TC_PUT)
#undef TC_PUT
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

// The inputs change while the clock falls, the outputs that a clock leaves are looked at while it is high.
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

unsigned digits(const Outputs& out) {
  unsigned all = 0;
#define TC_DIGIT(port, member, bits) all = all << 1 | out.member;
  TC_OUTPUT_PINS(TC_DIGIT)
#undef TC_DIGIT
  return all;
}

int replay(const std::filesystem::path& path, const char* counts) {
  const meltstage::recording::Stream recording = meltstage::recording::read_text(path);
  const Scan scan = read_scan(std::filesystem::path(path).replace_extension(".scan"));
  Vnetlist top;
  shifting(top, false);
  // A simulator sees edges: a flop behind a closed clock gate is reset by one of its reset, not by the level
  // from the start.
  for (const unsigned reset_n : {1u, 0u, 1u}) {
    top.rst_ni = reset_n;
    for (int i = 0; i < 4; ++i) fall(top), rise(top);
  }
  if (!scan.load.empty()) load(top, scan.load);
#if VM_COVERAGE
  Verilated::threadContextp()->coveragep()->zero();
#endif
  meltstage::recording::Cursor at(recording);
  unsigned long clocks = 0;
  unsigned long mismatches = 0;
  Outputs left{};
  do {
    if (isatty(2) && clocks % 10000 == 0)
      std::fprintf(stderr, "\rreplay: %lu of %lu clocks", clocks,
                   static_cast<unsigned long>(recording.final_cycle() + 1 - recording.first_cycle()));
    const Inputs in = meltstage::tb::inputs_of(at.values());
    set_pins(top, in);
    fall(top);
    if (clocks == 0) left = meltstage::chip::take_outputs(top);
    const Outputs out = meltstage::tb::before_clock(left, in);
    rise(top);
    left = meltstage::chip::take_outputs(top);
    const Outputs recorded = meltstage::tb::outputs_of(at.values());
    if (out != recorded && ++mismatches <= 3)
      std::printf("clock %lu: outputs %03x, recorded %03x\n", clocks, digits(out), digits(recorded));
    ++clocks;
  } while (at.step());
  if (isatty(2)) std::fprintf(stderr, "\n");
#if VM_COVERAGE
  if (counts != nullptr) VerilatedCov::write(counts);
#else
  static_cast<void>(counts);
#endif
  if (const unsigned long wrong = unload(top, scan.unload); wrong > 0) {
    std::printf("flops after the last clock: other than recorded at %lu of %zu shifts\n", wrong,
                scan.unload.size());
    mismatches += wrong;
  }
  std::printf("%lu clocks, %lu mismatches\n", clocks, mismatches);
  return mismatches == 0 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || argc > 3) return std::fprintf(stderr, "replay: expected RECORDING.mvec [COUNTS]\n"), 2;
  try {
    return replay(argv[1], argc == 3 ? argv[2] : nullptr);
  } catch (const std::exception& error) {
    return std::fprintf(stderr, "replay: %s\n", error.what()), 2;
  }
}
