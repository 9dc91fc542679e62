// SPDX-License-Identifier: Apache-2.0
// A recording on a Verilated top: RTL, netlist, or RTL with a fault in it.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "tb/tools/recording.hpp"

namespace meltstage::tb {

template <class Top>
void set_pins(Top& top, std::uint16_t in) {
  top.drop_i = in >> 8 & 1;
  top.inhibit_i = in >> 7 & 1;
  top.heater_fb_i = in >> 6 & 1;
  top.spi_miso_i = in >> 5 & 1;
  top.addr_strap_i = in >> 2 & 7;
  top.uart_rx_i = in >> 1 & 1;
  top.rst_ni = in & 1;
}

template <class Top>
std::uint16_t get_pins(const Top& top) {
  return static_cast<std::uint16_t>(
      top.at_temp_o << 9 | top.fault_no << 8 | top.safe_en_o << 7 | top.heater_o << 6 | top.spi_mosi_o << 5 |
      top.spi_cs_no << 4 | top.spi_sclk_o << 3 | top.tlm_tx_o << 2 | top.uart_de_o << 1 | top.uart_tx_o << 0);
}

// Clock at which the outputs first differ from the recorded ones, nothing when they never do.
template <class Top>
std::optional<std::uint64_t> first_difference(Top& top, const std::vector<Stretch>& recording) {
  std::uint64_t clock = 0;
  top.clk_i = 0;
  top.test_mode_i = 0;
  top.scan_en_i = 0;
  top.scan_i = 0;
  set_pins(top, 0);
  top.eval();
  for (const Stretch& stretch : recording) {
    set_pins(top, stretch.in);
    if ((stretch.in & 1) == 0) top.eval();  // reset acts without a clock
    for (std::uint64_t i = 0; i < stretch.clocks; ++i, ++clock) {
      top.clk_i = 1;
      top.eval();
      top.clk_i = 0;
      top.eval();
      if (get_pins(top) != stretch.out) return clock;
    }
  }
  return std::nullopt;
}

}  // namespace meltstage::tb
