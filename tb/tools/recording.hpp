// SPDX-License-Identifier: Apache-2.0
// Pins of the chip's model over a run, run-length coded: lines "clocks inputs outputs", pins as binary
// digits.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "cmodel/chip.hpp"

namespace meltstage::tb {

// Bits from the highest: drop, inhibit, heater_fb, spi_miso, addr_strap[2:0], uart_rx, rst_n.
inline std::uint16_t pack(const chip::Inputs& in) {
  return static_cast<std::uint16_t>(in.drop << 8 | in.inhibit << 7 | in.heater_fb << 6 | in.spi_miso << 5 |
                                    (in.addr_strap & 7) << 2 | in.uart_rx << 1 | in.rst_n << 0);
}

// Bits from the highest: at_temp, fault_n, safe_en, heater, spi_mosi, spi_cs_n, spi_sclk, tlm_tx, uart_de,
// uart_tx.
inline std::uint16_t pack(const chip::Outputs& out) {
  return static_cast<std::uint16_t>(out.at_temp << 9 | out.fault_n << 8 | out.safe_en << 7 | out.heater << 6 |
                                    out.spi_mosi << 5 | out.spi_cs_n << 4 | out.spi_sclk << 3 |
                                    out.tlm_tx << 2 | out.uart_de << 1 | out.uart_tx << 0);
}

inline chip::Inputs unpack_inputs(std::uint16_t pins) {
  chip::Inputs in;
  in.drop = (pins >> 8 & 1) != 0;
  in.inhibit = (pins >> 7 & 1) != 0;
  in.heater_fb = (pins >> 6 & 1) != 0;
  in.spi_miso = (pins >> 5 & 1) != 0;
  in.addr_strap = pins >> 2 & 7;
  in.uart_rx = (pins >> 1 & 1) != 0;
  in.rst_n = (pins & 1) != 0;
  return in;
}

inline chip::Outputs unpack_outputs(std::uint16_t pins) {
  chip::Outputs out{};
  out.at_temp = (pins >> 9 & 1) != 0;
  out.fault_n = (pins >> 8 & 1) != 0;
  out.safe_en = (pins >> 7 & 1) != 0;
  out.heater = (pins >> 6 & 1) != 0;
  out.spi_mosi = (pins >> 5 & 1) != 0;
  out.spi_cs_n = (pins >> 4 & 1) != 0;
  out.spi_sclk = (pins >> 3 & 1) != 0;
  out.tlm_tx = (pins >> 2 & 1) != 0;
  out.uart_de = (pins >> 1 & 1) != 0;
  out.uart_tx = (pins >> 0 & 1) != 0;
  return out;
}

// So many clocks with these input pins, after each of which the output pins were these.
struct Stretch {
  std::uint64_t clocks;
  std::uint16_t in;
  std::uint16_t out;
};

// Throws std::runtime_error when the file is missing, empty or has a line of another form.
inline std::vector<Stretch> read_recording(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::vector<Stretch> recording;
  std::string clocks, in, out;
  while (file >> clocks >> in >> out) {
    recording.push_back({std::stoull(clocks), static_cast<std::uint16_t>(std::stoul(in, nullptr, 2)),
                         static_cast<std::uint16_t>(std::stoul(out, nullptr, 2))});
  }
  if (recording.empty()) {
    throw std::runtime_error(path.string() +
                             ": expected lines 'clocks inputs outputs', found none; build target recordings");
  }
  return recording;
}

}  // namespace meltstage::tb
