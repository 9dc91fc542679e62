// SPDX-License-Identifier: Apache-2.0
// UARTC with a host on its line: waveforms made and read here, independently of the model's own receiver and
// transmitter.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <functional>
#include <string_view>
#include <vector>

#include "cmodel/uartc.hpp"

namespace meltstage::chip {
using Bytes = std::vector<std::uint8_t>;

inline constexpr double kClkHz = spec::kClkHz;
inline constexpr std::uint8_t kOwn = 17;

inline double bit_clocks(unsigned baud) { return kClkHz / (100.0 * baud); }

// CRC by the bit, as the Modbus specification words it; the model uses a table.
inline std::uint16_t crc_of(const Bytes& bytes) {
  unsigned crc = 0xFFFF;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1u) != 0 ? (crc >> 1) ^ 0xA001u : crc >> 1;
  }
  return static_cast<std::uint16_t>(crc);
}

inline Bytes sealed(Bytes bytes) {
  const std::uint16_t crc = crc_of(bytes);
  bytes.push_back(static_cast<std::uint8_t>(crc & 0xFFu));
  bytes.push_back(static_cast<std::uint8_t>(crc >> 8));
  return bytes;
}

// Levels of one character, start bit first.
inline std::vector<int> char_levels(std::uint8_t byte, std::uint8_t format) {
  std::vector<int> levels{0};
  int ones = 0;
  for (int bit = 0; bit < 8; ++bit) {
    levels.push_back((byte >> bit) & 1);
    ones += (byte >> bit) & 1;
  }
  if (format == spec::kFormat8E1) levels.push_back(ones % 2);
  if (format == spec::kFormat8O1) levels.push_back(1 - ones % 2);
  levels.push_back(1);
  if (format == spec::kFormat8N2) levels.push_back(1);
  return levels;
}

struct Decoded {
  Bytes bytes;
  unsigned errors = 0;  // parity or stop bits
};

// An ideal receiver: samples the middle of each bit counted from the falling edge.
inline Decoded decode(const std::vector<std::uint8_t>& line, double bit, std::uint8_t format) {
  Decoded out;
  const auto at = [&](double clock) {
    const auto index = static_cast<std::size_t>(clock);
    return index < line.size() ? line[index] : std::uint8_t{1};
  };
  std::size_t clock = 0;
  while (clock < line.size()) {
    if (line[clock] != 0) {
      ++clock;
      continue;
    }
    const double start = static_cast<double>(clock);
    unsigned byte = 0;
    for (unsigned i = 0; i < 8; ++i) byte |= static_cast<unsigned>(at(start + (1.5 + i) * bit)) << i;
    const std::vector<int> levels = char_levels(static_cast<std::uint8_t>(byte), format);
    bool good = true;
    for (std::size_t i = 0; i < levels.size(); ++i) {
      good = good && at(start + (0.5 + static_cast<double>(i)) * bit) == levels[i];
    }
    out.errors += good ? 0 : 1;
    out.bytes.push_back(static_cast<std::uint8_t>(byte));
    clock = static_cast<std::size_t>(start + (static_cast<double>(levels.size()) - 0.5) * bit);
  }
  return out;
}

// The port with a host on its line and a PARAMC behind it.
class Port {
 public:
  Uartc chip;
  UartcIn in;
  std::vector<std::uint8_t> tx_line, tlm_line, de_line;
  std::vector<std::uint64_t> stops, goods;  // clocks of the pulses
  std::uint64_t clock = 0;
  bool echo = false;    // the transceiver's receiver hears its own driver
  bool answers = true;  // commands are done at once with `kind`
  std::uint8_t kind = spec::kRspNone;
  std::uint8_t exc = 0;
  std::function<std::uint16_t(std::uint16_t)> reg = [](std::uint16_t address) {
    return static_cast<std::uint16_t>(address * 259u + 7u);
  };

  explicit Port(unsigned baud = 1152, std::uint8_t format = spec::kFormat8E1, std::uint8_t address = kOwn) {
    in.cfg_baud = static_cast<std::uint16_t>(baud);
    in.cfg_format = format;
    in.cfg_address = address;
    run(1);
  }

  double bit() const { return bit_clocks(chip.baud_q); }

  void run(std::uint64_t clocks) {
    for (std::uint64_t i = 0; i < clocks; ++i) clock_once();
  }
  void run_bits(double bits) { run(static_cast<std::uint64_t>(std::ceil(bits * bit()))); }

  // Holds the line at a level; fractions of a clock carry over, so that the host's bit time is exact in the
  // long run.
  void hold(int level, double clocks) {
    line_ = level;
    owed_ += clocks;
    const double whole = std::floor(owed_);
    owed_ -= whole;
    run(static_cast<std::uint64_t>(whole));
    line_ = 1;
  }

  void send_char(std::uint8_t byte, std::uint8_t format, double bit_time) {
    for (const int level : char_levels(byte, format)) hold(level, bit_time);
  }
  void send(const Bytes& bytes) { send(bytes, chip.format_q, bit()); }
  void send(const Bytes& bytes, std::uint8_t format, double bit_time) {
    for (const std::uint8_t byte : bytes) send_char(byte, format, bit_time);
  }

  // Silence until the port is at rest.
  void settle() {
    std::uint64_t guard = 0;
    do {
      run(16);
      ASSERT_LT(++guard, 1000000u) << "the port never comes to rest";
    } while (!chip.rx.idle() || chip.frame.open() || (answers && chip.cmd_valid()) || chip.rsp_busy() ||
             chip.tlm_busy());
  }

  // Sends a request and returns the answer's bytes.
  Bytes ask(const Bytes& request, std::uint8_t answer_kind) {
    kind = answer_kind;
    tx_line.clear();
    send(sealed(request));
    settle();
    const Decoded heard = decode(tx_line, bit(), chip.format_q);
    EXPECT_EQ(heard.errors, 0u);
    return heard.bytes;
  }

 private:
  int line_ = 1;
  double owed_ = 0;

  void clock_once() {
    in.rx = static_cast<std::uint8_t>(line_ & (echo ? static_cast<int>(chip.tx_o()) : 1));
    in.cmd_done = answers && chip.cmd_valid() && !in.cmd_done;
    in.rsp_kind = kind;
    in.rsp_exc = exc;
    in.rd_data = reg(chip.rd_addr());
    chip.step(in);
    in.tlm_start = false;
    ++clock;
    tx_line.push_back(chip.tx_o());
    tlm_line.push_back(chip.tlm_tx());
    de_line.push_back(chip.de());
    if (chip.stop()) stops.push_back(clock);
    if (chip.good()) goods.push_back(clock);
  }
};

inline const Bytes kReadTwo{kOwn, 0x03, 0x00, 0x00, 0x00, 0x02};
inline const Bytes kStop{kOwn, 0x06, 0x01, 0x00, 0x00, 0x00};

// Bytes of a text as they stand on the line.
inline Bytes text(std::string_view letters) { return {letters.begin(), letters.end()}; }

inline Bytes joined(Bytes left, const Bytes& right) {
  left.insert(left.end(), right.begin(), right.end());
  return left;
}

}  // namespace meltstage::chip
