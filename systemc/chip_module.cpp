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
  return {.rst_n = rst_ni.read(),
          .uart_rx = uart_rx_i.read(),
          .addr_strap = static_cast<std::uint8_t>(addr_strap_i.read().to_uint()),
          .spi_miso = spi_miso_i.read(),
          .heater_fb = heater_fb_i.read(),
          .inhibit = inhibit_i.read(),
          .drop = drop_i.read()};
}

void TcChip::drive(const chip::Outputs& out) {
  if (out == driven_) return;
  driven_ = out;
  uart_tx_o.write(out.uart_tx);
  uart_de_o.write(out.uart_de);
  tlm_tx_o.write(out.tlm_tx);
  spi_sclk_o.write(out.spi_sclk);
  spi_cs_no.write(out.spi_cs_n);
  spi_mosi_o.write(out.spi_mosi);
  heater_o.write(out.heater);
  safe_en_o.write(out.safe_en);
  fault_no.write(out.fault_n);
  at_temp_o.write(out.at_temp);
}

}  // namespace meltstage::systemc
