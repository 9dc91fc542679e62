// SPDX-License-Identifier: Apache-2.0
// The virtual chip's surroundings when a program outside is its Modbus master: the heated head, and on the
// serial line the bytes of that program.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "cmodel/chip.hpp"
#include "tb/devices/uart.hpp"
#include "tb/pins/head.hpp"

namespace meltstage::app {

// Speed and character format of a serial line, as the chip's registers BAUD and FORMAT say.
struct LineSettings {
  std::uint16_t baud_100;  // 100 Bd
  std::uint8_t format;     // register FORMAT
  friend bool operator==(const LineSettings&, const LineSettings&) = default;
};

LineSettings line_settings(const chip::Chip& chip);
double baud(const LineSettings& settings);
// "8E1"
std::string_view format_name(const LineSettings& settings);

// The master's end of the serial line, in chip clocks.
class MasterEnd {
 public:
  explicit MasterEnd(const LineSettings& settings);

  // Puts a frame on the line, behind the silence that the chip needs to tell it from the one before. For a
  // line on which nothing is being sent.
  void send(std::uint64_t cycle, std::span<const std::uint8_t> frame);
  bool sending() const { return !transmitter_.idle(); }
  // Speaks another speed or format from now on; waits until nothing is on the line.
  void follow(const LineSettings& settings);
  // Characters heard since the last call.
  std::vector<std::uint8_t> take();
  // A character is being sent or heard.
  bool busy() const { return sending() || receiver_.receiving(); }

  bool step(std::uint64_t cycle, bool chip_tx) {
    receiver_.step(cycle, chip_tx);
    return transmitter_.step(cycle);
  }
  std::uint64_t next_event() const { return std::min(transmitter_.next_event(), receiver_.next_event()); }

 private:
  LineSettings settings_;
  tb::UartTransmitter transmitter_;
  tb::UartReceiver receiver_;
  std::vector<std::uint8_t> heard_;   // with an earlier speed or format
  std::uint64_t earliest_start_ = 0;  // of the next frame
};

// The head of the bench with its serial line handed to a MasterEnd. Satisfies chip::Surroundings.
struct ServedHead {
  tb::Head& head;
  MasterEnd& master;

  chip::Inputs step(std::uint64_t cycle, const chip::Outputs& out) {
    chip::Inputs in = head.step(cycle, out);
    in.uart_rx = master.step(cycle, out.uart_tx);
    return in;
  }
  std::uint64_t next_event() const { return std::min(head.next_event(), master.next_event()); }
};

}  // namespace meltstage::app
