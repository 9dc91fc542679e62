// SPDX-License-Identifier: Apache-2.0
// The model at work with a host and a sensor that say exactly what a piece of the functional set wants, its
// pins recorded clock by clock.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "asic/signoff/functional_vectors.hpp"
#include "cmodel/chip.hpp"
#include "recording/stream.hpp"
#include "tb/devices/modbus_host.hpp"

namespace meltstage::app {

// A sensor that sends the frame it is given, in any SPI mode: the next bit stands on the line from the edge
// behind each sampling edge on.
class FrameSource {
 public:
  // The last `length` bits of `word`, first bit first; mode: CPOL x 2 + CPHA.
  void set(std::uint32_t word, unsigned length, unsigned mode) {
    word_ = word;
    length_ = length;
    samples_on_rise_ = mode == 0 || mode == 3;
  }
  bool step(bool cs_n, bool sclk) {
    if (cs_n) {
      sent_ = 0;
      sampled_ = 0;
    } else if (sclk != sclk_) {
      if (sclk == samples_on_rise_)
        ++sampled_;
      else
        sent_ = sampled_;
    }
    sclk_ = sclk;
    return sent_ < length_ && (word_ >> (length_ - 1 - sent_) & 1) != 0;
  }

 private:
  std::uint32_t word_ = 0;
  unsigned length_ = 16, sent_ = 0, sampled_ = 0;
  bool samples_on_rise_ = true, sclk_ = false;
};

// Level of test_mode_i, chosen at a reset: in test time a millisecond and 0.1 s both last kTestTenth clocks.
enum class TimeBase : std::uint8_t { real, test };
constexpr std::uint64_t kTestTenth = chip::spec::kClkHz / 1000 / chip::spec::kTestSpeedup;

class FunctionalSession {
 public:
  static constexpr std::uint16_t kResetBaud = 1152;  // register BAUD

  FunctionalSession();

  void begin(std::string requirement) { set_.pieces.push_back({std::move(requirement), cycle_}); }
  FunctionalSet finish();

  void run(std::uint64_t clocks) {
    for (std::uint64_t i = 0; i < clocks; ++i) step();
  }
  // To the end of the next control computations. Throws when none comes within 3 s.
  void ticks(unsigned count = 1);
  // Pulse at the reset pin with this address strap; the line is as after reset, the chip has address 1 +
  // strap.
  void reset(std::uint8_t strap = 0, TimeBase time = TimeBase::test);
  // The host's side of the line from now on: registers BAUD and FORMAT, slave address.
  void set_line(std::uint16_t baud, std::uint16_t format, std::uint8_t address);

  // A request that is answered with data (all three throw std::logic_error when it is not as said).
  void ask(const tb::ModbusRequest& request) { exchange(request, chip::spec::kExcNone); }
  void refused(const tb::ModbusRequest& request, chip::spec::Exception exception) {
    exchange(request, exception);
  }
  void unanswered(const tb::ModbusRequest& request);
  void write(std::uint16_t reg, std::int32_t value);
  void write(std::uint16_t first, std::span<const std::int32_t> values);
  void command(std::uint16_t word) { write(chip::spec::kRegCmd, word); }
  void read_holding();
  void read_inputs();
  void read_loop();  // input registers 0..15: state, temperature, terms, faults and causes

  // Temperature in 1/64 degC as the plain 16-bit frame that `plain_sensor` in the pieces describes.
  void set_temperature(std::int16_t sixty_fourths) {
    sensor_.set(static_cast<std::uint16_t>(sixty_fourths), 16, 0);
  }
  FrameSource& sensor() { return sensor_; }
  // The feedback of the heater's switch follows heater_o unless it is held.
  void hold_feedback(bool level) { feedback_ = level ? 1 : 0; }
  void free_feedback() { feedback_ = -1; }
  void set_inhibit(bool pressed) { in_.inhibit = pressed; }
  void droplet(std::uint64_t clocks);
  void glitch(std::uint64_t clocks);  // on the idle receive line
  std::uint8_t address() const { return address_; }
  const chip::Chip& chip() const { return chip_; }
  [[noreturn]] void fail(const std::string& what) const;
  std::uint64_t cycle() const { return cycle_; }

 private:
  void step();
  void send(const tb::ModbusRequest& request);
  void exchange(const tb::ModbusRequest& request, chip::spec::Exception exception);
  tb::UartLine line() const;

  std::uint16_t baud_ = kResetBaud, format_ = 0;
  std::uint8_t address_ = 1;
  FunctionalSet set_;
  recording::Recorder recorder_;
  chip::Chip chip_;
  chip::Inputs in_;
  chip::Outputs out_;
  FrameSource sensor_;
  tb::UartTransmitter transmitter_;
  tb::UartReceiver receiver_;
  int feedback_ = -1;
  std::uint64_t cycle_ = 0;
};

}  // namespace meltstage::app
