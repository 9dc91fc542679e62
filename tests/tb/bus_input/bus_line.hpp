// SPDX-License-Identifier: Apache-2.0
// A host that puts anything on the chip's serial line, and holds the chip to what the standard says of it:
//   no register changes but by a sound frame to this unit or to all, and then to that frame's values, or by
//   an
//     exception not at all;
//   nothing is sent but the answer to a sound frame to this unit alone;
//   after anything, a valid request that starts 3.5 characters later is answered.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include "cmodel/chip.hpp"
#include "modbus_oracle.hpp"
#include "tb/devices/uart.hpp"

namespace meltstage::tb {

// The chip broke a promise; what() names it and the characters that led there.
struct Violation : std::logic_error {
  using std::logic_error::logic_error;
};

// The host's end of the line.
class HostEnd {
 public:
  HostEnd(const UartLine& line, double clock_error_ratio);
  chip::Inputs step(std::uint64_t cycle, const chip::Outputs& out);
  std::uint64_t next_event() const { return std::min(transmitter_.next_event(), receiver_.next_event()); }

  UartTransmitter& transmitter() { return transmitter_; }
  UartReceiver& receiver() { return receiver_; }
  bool driven() const { return driven_; }  // the chip's driver is on

 private:
  UartTransmitter transmitter_;
  UartReceiver receiver_;
  bool driven_ = false;
};

// What runs the chip: the model from event to event, or model and RTL in lockstep on every clock.
class Station {
 public:
  Station() = default;
  Station(const Station&) = delete;
  Station& operator=(const Station&) = delete;
  virtual ~Station() = default;
  virtual void run_until(std::uint64_t cycle, HostEnd& host) = 0;
  virtual std::uint64_t cycle() const = 0;
  virtual const chip::Chip& chip() const = 0;
  virtual void restart(const chip::Chip& state) = 0;
};
std::unique_ptr<Station> model_station(const chip::Chip& start);
// The model stepped on every clock with `fault` done to it before each: how a broken chip is made.
std::unique_ptr<Station> faulty_station(const chip::Chip& start, std::function<void(chip::Chip&)> fault);

inline constexpr std::uint8_t kBusUnit = 17;

struct LineSetting {
  std::uint16_t baud = 5000;  // 100 Bd
  std::uint8_t format = 0;    // register FORMAT
  double host_clock_error_ratio = 0.0;
};
// Bits of a character, start and stop bits included.
int char_bits_of(std::uint8_t format);
// A chip out of reset at kBusUnit with this line.
chip::Chip chip_on_line(const LineSetting& line);

// Counts of what a run has seen, to show that it saw anything.
struct BusCount {
  std::uint64_t segments = 0;
  std::uint64_t accepted = 0;  // certain frames
  std::uint64_t possible = 0;  // segments that the standard leaves open
  std::uint64_t exceptions = 0;
  std::uint64_t written = 0;  // registers whose staged value changed
};

class BusLine {
 public:
  // `station` stands at chip_on_line(line).
  BusLine(std::unique_ptr<Station> station, const LineSetting& line);

  // The segment, 3.5 characters after whatever was last on the line; then a read, 3.5 characters after the
  // segment or its answer. Throws Violation. A frame that writes the line's own registers (from ADDRESS on)
  // is followed by a fresh chip instead.
  void put(const Segment& segment);

  const BusCount& count() const { return count_; }
  const Station& station() const { return *station_; }

 private:
  struct Registers {
    std::array<std::uint16_t, chip::spec::kHoldingCount> staged, active;
    bool heating;
  };
  Registers registers() const;
  double bit() const;
  double char_bits() const { return format_.bits(); }
  void send(const Segment& segment);
  Bytes reply_within(double bits);
  void run_bits(double bits);
  void probe(const Segment& after);
  void check_registers(const Registers& before, const Registers& now, const std::vector<SoundFrame>& writers,
                       const Segment& segment) const;
  void check_written(const Registers& now, const SoundFrame& request, const Segment& segment) const;
  [[noreturn]] void fail(const Segment& segment, const std::string& what) const;

  std::unique_ptr<Station> station_;
  LineSetting setting_;
  UartFormat format_;
  HostEnd host_;
  std::uint64_t line_free_cycle_ = 0;  // end of the last stop bit of either side
  BusCount count_;
};

}  // namespace meltstage::tb
