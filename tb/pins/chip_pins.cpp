// SPDX-License-Identifier: Apache-2.0
#include "tb/pins/chip_pins.hpp"

#include <fmt/format.h>

#include <utility>

#include "cmodel/spec.hpp"

namespace meltstage::tb {

recording::Header chip_pin_header(std::string origin) {
  recording::Header header{
      .pins = {}, .clock_hz = chip::spec::kClkHz, .origin = std::move(origin), .meta = {}};
  const auto add = [&](const char* name, recording::Direction direction, unsigned width) {
    header.pins.push_back({name, direction, width, "chip"});
  };
  for (const char* name : {"rst_ni", "uart_rx_i"}) add(name, recording::Direction::in, 1);
  add("addr_strap_i", recording::Direction::in, 3);
  for (const char* name : {"spi_miso_i", "heater_fb_i", "inhibit_i", "drop_i", "test_mode_i"})
    add(name, recording::Direction::in, 1);
  for (const char* name : {"uart_tx_o", "uart_de_o", "tlm_tx_o", "spi_sclk_o", "spi_cs_no", "spi_mosi_o",
                           "heater_o", "safe_en_o", "fault_no", "at_temp_o"})
    add(name, recording::Direction::out, 1);
  return header;
}

chip::Inputs inputs_of(std::span<const std::uint64_t> pins) {
  chip::Inputs in;
  in.rst_n = pins[kPinRstN] != 0;
  in.uart_rx = pins[kPinUartRx] != 0;
  in.addr_strap = static_cast<std::uint8_t>(pins[kPinAddrStrap]);
  in.spi_miso = pins[kPinSpiMiso] != 0;
  in.heater_fb = pins[kPinHeaterFb] != 0;
  in.inhibit = pins[kPinInhibit] != 0;
  in.drop = pins[kPinDrop] != 0;
  in.test_mode = pins[kPinTestMode] != 0;
  return in;
}

chip::Outputs outputs_of(std::span<const std::uint64_t> pins) {
  chip::Outputs out{};
  out.uart_tx = pins[kPinUartTx] != 0;
  out.uart_de = pins[kPinUartDe] != 0;
  out.tlm_tx = pins[kPinTlmTx] != 0;
  out.spi_sclk = pins[kPinSpiSclk] != 0;
  out.spi_cs_n = pins[kPinSpiCsN] != 0;
  out.spi_mosi = pins[kPinSpiMosi] != 0;
  out.heater = pins[kPinHeater] != 0;
  out.safe_en = pins[kPinSafeEn] != 0;
  out.fault_n = pins[kPinFaultN] != 0;
  out.at_temp = pins[kPinAtTemp] != 0;
  return out;
}

std::array<std::uint64_t, kChipPinCount> pin_levels(const chip::Inputs& in, const chip::Outputs& out) {
  return {in.rst_n,     in.uart_rx,   in.addr_strap, in.spi_miso, in.heater_fb, in.inhibit,
          in.drop,      in.test_mode, out.uart_tx,   out.uart_de, out.tlm_tx,   out.spi_sclk,
          out.spi_cs_n, out.spi_mosi, out.heater,    out.safe_en, out.fault_n,  out.at_temp};
}

std::string output_difference(const chip::Outputs& recorded, const chip::Outputs& chip) {
  if (recorded == chip) return "";
  const auto a = pin_levels({}, recorded);
  const auto b = pin_levels({}, chip);
  const recording::Header header = chip_pin_header("difference");
  std::uint32_t pin = kPinUartTx;
  while (a[pin] == b[pin]) ++pin;
  return fmt::format("{} recorded {}, chip {}", header.pins[pin].name, a[pin], b[pin]);
}

}  // namespace meltstage::tb
