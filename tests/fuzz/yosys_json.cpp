// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/core/capture_view.hpp"
#include "asic/netlist/yosys_library.hpp"
#include "tests/fuzz/entry.hpp"

extern "C" int FUZZ_ENTRY(const std::uint8_t* data, std::size_t size) {
  return meltstage::reads_or_refuses(data, size, [](std::string_view text) {
    const meltstage::dft::Netlist netlist = meltstage::dft::parse_yosys_json(text, "fuzz.json");
    meltstage::dft::verilog_text(netlist);
    meltstage::dft::capture_view(netlist, meltstage::dft::yosys_library());
  });
}
