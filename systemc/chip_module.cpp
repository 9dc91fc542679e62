// SPDX-License-Identifier: Apache-2.0
#include "chip_module.hpp"

namespace meltstage::systemc {

TcChip::TcChip(const sc_core::sc_module_name& name) : sc_core::sc_module(name) {
  SC_HAS_PROCESS(TcChip);
  SC_METHOD(react);
  sensitive << clk_i.pos() << rst_ni.neg() << inhibit_i;
}

// One process, so that an output has one driver; whatever woke it, it leaves the pins as they stand.
void TcChip::react() {
  const chip::Inputs in = inputs();
  if (!in.rst_n) {
    chip_ = chip::Chip{};
  } else if (clk_i.posedge()) {
    chip_.step(in);
  }
  drive(chip_.outputs(in));
}

chip::Inputs TcChip::inputs() const {
  chip::Inputs in;
#define TC_READ(port, member, bits) in.member = static_cast<decltype(in.member)>(port.read());
  TC_INPUT_PINS(TC_READ)
#undef TC_READ
  return in;
}

void TcChip::drive(const chip::Outputs& out) {
  if (out == driven_) return;
  driven_ = out;
#define TC_WRITE(port, member, bits) port.write(out.member);
  TC_OUTPUT_PINS(TC_WRITE)
#undef TC_WRITE
}

}  // namespace meltstage::systemc
