// SPDX-License-Identifier: Apache-2.0
// The C++ model as a pin-accurate SystemC module: ports as rtl/tc_top.sv, equal to it at every clock. Use:
// docs/chip/systemc.md.
#pragma once

#include <optional>
#include <systemc>

#include "cmodel/chip.hpp"

namespace meltstage::systemc {

// Samples its inputs at the rising edge of clk_i (chip::spec::kClkHz); rst_ni low resets at once, inhibit_i
// high forces heater_o low at once. Starts in reset; the outputs have their levels after the first delta
// cycle.
class TcChip : public sc_core::sc_module {
 public:
  sc_core::sc_in<bool> clk_i{"clk_i"};
  sc_core::sc_in<bool> rst_ni{"rst_ni"};
  sc_core::sc_in<bool> uart_rx_i{"uart_rx_i"};
  sc_core::sc_out<bool> uart_tx_o{"uart_tx_o"};
  sc_core::sc_out<bool> uart_de_o{"uart_de_o"};
  sc_core::sc_out<bool> tlm_tx_o{"tlm_tx_o"};
  sc_core::sc_in<sc_dt::sc_uint<3>> addr_strap_i{"addr_strap_i"};
  sc_core::sc_out<bool> spi_sclk_o{"spi_sclk_o"};
  sc_core::sc_out<bool> spi_cs_no{"spi_cs_no"};
  sc_core::sc_out<bool> spi_mosi_o{"spi_mosi_o"};
  sc_core::sc_in<bool> spi_miso_i{"spi_miso_i"};
  sc_core::sc_out<bool> heater_o{"heater_o"};
  sc_core::sc_in<bool> heater_fb_i{"heater_fb_i"};
  sc_core::sc_out<bool> safe_en_o{"safe_en_o"};
  sc_core::sc_in<bool> inhibit_i{"inhibit_i"};
  sc_core::sc_in<bool> drop_i{"drop_i"};
  sc_core::sc_out<bool> fault_no{"fault_no"};
  sc_core::sc_out<bool> at_temp_o{"at_temp_o"};

  explicit TcChip(const sc_core::sc_module_name& name);

  // The state: to look at any flop, and to save (copy) or restore (assign) it between clock edges. The pins
  // follow what is changed here at the next edge of clk_i.
  chip::Chip& chip() { return chip_; }
  const chip::Chip& chip() const { return chip_; }

 private:
  void react();
  chip::Inputs inputs() const;
  void drive(const chip::Outputs& out);

  chip::Chip chip_;
  std::optional<chip::Outputs> driven_;
};

}  // namespace meltstage::systemc
