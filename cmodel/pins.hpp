// SPDX-License-Identifier: Apache-2.0
// Generated from spec/chip.toml by spec/generate.py; edit that.
// The chip's pins as the model has them, and the way to a top that has ports of their names.
// clang-format off
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace meltstage::chip {

// Levels of the input pins. Defaults: powered, out of reset, lines idle.
struct Inputs {
  bool rst_n = true;  // rst_ni
  bool uart_rx = true;  // uart_rx_i
  std::uint8_t addr_strap = 0;  // addr_strap_i, 3 bits
  bool spi_miso = false;  // spi_miso_i
  bool heater_fb = false;  // heater_fb_i
  bool inhibit = false;  // inhibit_i
  bool drop = false;  // drop_i
  bool test_mode = false;  // test_mode_i

  friend bool operator==(const Inputs&, const Inputs&) = default;
};

// Levels of the output pins, a bit each: they are copied and compared more often than anything else.
struct Outputs {
  bool uart_tx : 1;  // uart_tx_o
  bool uart_de : 1;  // uart_de_o
  bool tlm_tx : 1;  // tlm_tx_o
  bool spi_sclk : 1;  // spi_sclk_o
  bool spi_cs_n : 1;  // spi_cs_no
  bool spi_mosi : 1;  // spi_mosi_o
  bool heater : 1;  // heater_o
  bool safe_en : 1;  // safe_en_o
  bool fault_n : 1;  // fault_no
  bool at_temp : 1;  // at_temp_o

  friend bool operator==(const Outputs&, const Outputs&) = default;
};

// X(port of tc_top, member of Inputs or Outputs, bits) of each pin in operation, in this order; and of the pins for tests.
#define TC_INPUT_PINS(X) \
  X(rst_ni, rst_n, 1) \
  X(uart_rx_i, uart_rx, 1) \
  X(addr_strap_i, addr_strap, 3) \
  X(spi_miso_i, spi_miso, 1) \
  X(heater_fb_i, heater_fb, 1) \
  X(inhibit_i, inhibit, 1) \
  X(drop_i, drop, 1)
#define TC_TEST_PINS(X) \
  X(test_mode_i, test_mode, 1)
#define TC_OUTPUT_PINS(X) \
  X(uart_tx_o, uart_tx, 1) \
  X(uart_de_o, uart_de, 1) \
  X(tlm_tx_o, tlm_tx, 1) \
  X(spi_sclk_o, spi_sclk, 1) \
  X(spi_cs_no, spi_cs_n, 1) \
  X(spi_mosi_o, spi_mosi, 1) \
  X(heater_o, heater, 1) \
  X(safe_en_o, safe_en, 1) \
  X(fault_no, fault_n, 1) \
  X(at_temp_o, at_temp, 1)

namespace spec {

// Indices into kPins: inputs, then outputs.
enum Pin : std::uint32_t {
  kPinRstN = 0,
  kPinUartRx = 1,
  kPinAddrStrap = 2,
  kPinSpiMiso = 3,
  kPinHeaterFb = 4,
  kPinInhibit = 5,
  kPinDrop = 6,
  kPinTestMode = 7,
  kPinUartTx = 8,
  kPinUartDe = 9,
  kPinTlmTx = 10,
  kPinSpiSclk = 11,
  kPinSpiCsN = 12,
  kPinSpiMosi = 13,
  kPinHeater = 14,
  kPinSafeEn = 15,
  kPinFaultN = 16,
  kPinAtTemp = 17,
};
inline constexpr std::uint32_t kInputPins = 8;
inline constexpr std::uint32_t kOutputPins = 10;

struct PinInfo {
  std::string_view name;
  unsigned width;
  bool output;
};
inline constexpr std::array<PinInfo, kInputPins + kOutputPins> kPins{ {
    {"rst_ni", 1, false },
    {"uart_rx_i", 1, false },
    {"addr_strap_i", 3, false },
    {"spi_miso_i", 1, false },
    {"heater_fb_i", 1, false },
    {"inhibit_i", 1, false },
    {"drop_i", 1, false },
    {"test_mode_i", 1, false },
    {"uart_tx_o", 1, true },
    {"uart_de_o", 1, true },
    {"tlm_tx_o", 1, true },
    {"spi_sclk_o", 1, true },
    {"spi_cs_no", 1, true },
    {"spi_mosi_o", 1, true },
    {"heater_o", 1, true },
    {"safe_en_o", 1, true },
    {"fault_no", 1, true },
    {"at_temp_o", 1, true },
} };

// Lowest bits of the asynchronous pins in tc_top's synchroniser.
enum SyncBit : std::uint8_t {
  kSyncUartRx = 0,
  kSyncAddrStrap = 1,
  kSyncSpiMiso = 4,
  kSyncHeaterFb = 5,
  kSyncInhibit = 6,
  kSyncDrop = 7,
};

}  // namespace spec

// The asynchronous pins side by side, as the synchroniser takes them.
constexpr std::uint8_t asynchronous_pins(const Inputs& in) {
  return static_cast<std::uint8_t>((static_cast<unsigned>(in.uart_rx) & 1u) << spec::kSyncUartRx |
                                   (static_cast<unsigned>(in.addr_strap) & 7u) << spec::kSyncAddrStrap |
                                   (static_cast<unsigned>(in.spi_miso) & 1u) << spec::kSyncSpiMiso |
                                   (static_cast<unsigned>(in.heater_fb) & 1u) << spec::kSyncHeaterFb |
                                   (static_cast<unsigned>(in.inhibit) & 1u) << spec::kSyncInhibit |
                                   (static_cast<unsigned>(in.drop) & 1u) << spec::kSyncDrop);
}

// The levels onto the ports of a top: whatever has them as members, such as a Verilated model.
template <class Top>
void put_inputs(const Inputs& in, Top& top) {
#define TC_PUT(port, member, bits) top.port = in.member;
  TC_INPUT_PINS(TC_PUT)
  TC_TEST_PINS(TC_PUT)
#undef TC_PUT
}

template <class Top>
Outputs take_outputs(const Top& top) {
  return {
#define TC_GET(port, member, bits) .member = top.port != 0,
      TC_OUTPUT_PINS(TC_GET)
#undef TC_GET
  };
}

}  // namespace meltstage::chip
