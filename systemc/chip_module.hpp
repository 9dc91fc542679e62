// SPDX-License-Identifier: Apache-2.0
// The C++ model as a pin-accurate SystemC module: ports as rtl/tc_top.sv (names and widths: cmodel/pins.hpp),
// equal to it at every clock. Use: docs/chip/systemc.md.
#pragma once

#include <optional>
#include <systemc>
#include <type_traits>

#include "cmodel/chip.hpp"

namespace meltstage::systemc {

// What a port of so many bits carries, as in Verilator's modules.
template <unsigned bits>
using Level = std::conditional_t<bits == 1, bool, sc_dt::sc_uint<static_cast<int>(bits)>>;

// Samples its inputs at the rising edge of clk_i (chip::spec::kClkHz); rst_ni low resets at once, inhibit_i
// high forces heater_o low at once. Starts in reset; the outputs have their levels after the first delta
// cycle.
class TcChip : public sc_core::sc_module {
 public:
  sc_core::sc_in<bool> clk_i{"clk_i"};
#define TC_IN(port, member, bits) sc_core::sc_in<Level<bits>> port{#port};
#define TC_OUT(port, member, bits) sc_core::sc_out<Level<bits>> port{#port};
  TC_INPUT_PINS(TC_IN)
  TC_OUTPUT_PINS(TC_OUT)
#undef TC_IN
#undef TC_OUT

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
