// SPDX-License-Identifier: Apache-2.0
#include "asic/signoff/functional_session.hpp"

#include <fmt/format.h>

#include <stdexcept>

#include "cmodel/spec.hpp"
#include "tb/pins/chip_pins.hpp"

namespace meltstage::app {

namespace spec = chip::spec;

namespace {

constexpr std::uint64_t kFrameGapBits = 40;  // above 3.5 characters of any format
constexpr std::uint64_t kLatestAnswer =
    60000;  // clocks; the longest read of a sensor and the loop stand between

}  // namespace

FunctionalSession::FunctionalSession()
    : recorder_(set_.stream, tb::chip_pin_header("functional sign-off set")),
      transmitter_(line(), {}, stream(1, "functional host")),
      receiver_(line()) {
  in_.rst_n = false;
  out_ = chip_.outputs(in_);
}

tb::UartLine FunctionalSession::line() const {
  return {spec::kClkHz, 100.0 * baud_, tb::uart_format(format_)};
}

void FunctionalSession::fail(const std::string& what) const {
  throw std::logic_error(fmt::format("functional set: piece \"{}\", clock {}: {}",
                                     set_.pieces.empty() ? std::string() : set_.pieces.back().requirement,
                                     cycle_, what));
}

void FunctionalSession::step() {
  in_.uart_rx = transmitter_.step(cycle_);
  in_.spi_miso = sensor_.step(out_.spi_cs_n, out_.spi_sclk);
  in_.heater_fb = feedback_ < 0 ? out_.heater : feedback_ != 0;
  const auto levels = tb::pin_levels(in_, tb::before_clock(out_, in_));
  for (std::uint32_t pin = 0; pin < tb::kChipPinCount; ++pin) recorder_.set(pin, levels[pin]);
  recorder_.commit(cycle_);
  out_ = chip_.step(in_);
  receiver_.step(cycle_++, out_.uart_tx);
}

FunctionalSet FunctionalSession::finish() {
  recorder_.finish(cycle_ - 1);
  return std::move(set_);
}

void FunctionalSession::ticks(unsigned count) {
  for (unsigned i = 0; i < count; ++i) {
    const std::uint64_t latest = cycle_ + 3ULL * spec::kClkHz;
    do {
      if (cycle_ > latest) fail("no control computation");
      step();
    } while (!chip_.sysctrl.pwm_load_q);
    run(8);
  }
}

void FunctionalSession::reset(std::uint8_t strap, TimeBase time) {
  in_.addr_strap = strap;
  in_.test_mode = time == TimeBase::test;
  in_.rst_n = false;
  run(20);
  in_.rst_n = true;
  run(spec::kClkHz / 500);
  set_line(kResetBaud, 0, static_cast<std::uint8_t>(1 + strap));
}

void FunctionalSession::set_line(std::uint16_t baud, std::uint16_t format, std::uint8_t address) {
  baud_ = baud;
  format_ = format;
  address_ = address;
  transmitter_ = tb::UartTransmitter(line(), {}, stream(cycle_, "functional host"));
  receiver_ = tb::UartReceiver(line());
}

void FunctionalSession::send(const tb::ModbusRequest& request) {
  for (const tb::UartChar& character : request.frame) transmitter_.send(character);
  do {
    step();
  } while (!transmitter_.idle());
}

void FunctionalSession::unanswered(const tb::ModbusRequest& request) {
  constexpr double kPause_s = 1.8e-3;  // that FORMAT.PAUSE keeps, and a little
  send(request);
  std::uint64_t wait = static_cast<std::uint64_t>(line().bit_cycles() * 2 * kFrameGapBits);
  if ((format_ & spec::word_of({spec::kFormatPause})) != 0)
    wait += static_cast<std::uint64_t>(kPause_s * spec::kClkHz);
  for (std::uint64_t i = 0; i < wait; ++i) {
    step();
    if (out_.uart_de) fail("found an answer, expected none");
  }
}

void FunctionalSession::exchange(const tb::ModbusRequest& request, spec::Exception exception) {
  send(request);
  while (receiver_.take()) {
  }
  const std::uint64_t latest =
      cycle_ + kLatestAnswer + static_cast<std::uint64_t>(line().bit_cycles() * 2 * kFrameGapBits);
  while (!out_.uart_de) {
    if (cycle_ > latest)
      fail(fmt::format("no answer to function {} at {:02x}{:02x}", request.frame[1].data,
                       request.frame[2].data, request.frame[3].data));
    step();
  }
  while (out_.uart_de) step();
  run(static_cast<std::uint64_t>(line().bit_cycles() * kFrameGapBits));
  std::vector<std::uint8_t> answer;
  while (const auto byte = receiver_.take()) answer.push_back(byte->data);
  const std::uint8_t function = request.frame[1].data;
  const bool good = answer.size() >= 4 &&
                    answer[1] == (exception != spec::kExcNone ? function | spec::kExceptionFlag : function) &&
                    (exception == spec::kExcNone || answer[2] == exception);
  if (!good)
    fail(fmt::format("found answer {:02x} {:02x} to function {} at {:02x}{:02x}, expected exception {}",
                     answer.size() > 1 ? answer[1] : 0, answer.size() > 2 ? answer[2] : 0, function,
                     request.frame[2].data, request.frame[3].data, exception));
}

void FunctionalSession::write(std::uint16_t reg, std::int32_t value) {
  ask(tb::write_single_register(address_, static_cast<std::uint16_t>(spec::kHoldingBase + reg),
                                static_cast<std::uint16_t>(value)));
}

void FunctionalSession::write(std::uint16_t first, std::span<const std::int32_t> values) {
  std::vector<std::uint16_t> words;
  for (const std::int32_t value : values) words.push_back(static_cast<std::uint16_t>(value));
  ask(tb::write_multiple_registers(address_, static_cast<std::uint16_t>(spec::kHoldingBase + first), words));
}

void FunctionalSession::read_holding() {
  ask(tb::read_holding_registers(address_, spec::kHoldingBase, spec::kMaxRead));
  ask(tb::read_holding_registers(address_, spec::kHoldingBase + spec::kMaxRead,
                                 spec::kHoldingCount - spec::kMaxRead));
}

void FunctionalSession::read_inputs() {
  ask(tb::read_input_registers(address_, 0, spec::kMaxRead));
  ask(tb::read_input_registers(address_, spec::kMaxRead, spec::kInputCount - spec::kMaxRead));
}

void FunctionalSession::read_loop() { ask(tb::read_input_registers(address_, 0, spec::kInCause + 1)); }

void FunctionalSession::droplet(std::uint64_t clocks) {
  in_.drop = true;
  run(clocks);
  in_.drop = false;
  run(clocks);
}

void FunctionalSession::glitch(std::uint64_t clocks) {
  transmitter_.glitch(cycle_, clocks);
  run(clocks + static_cast<std::uint64_t>(line().bit_cycles() * kFrameGapBits));
}

}  // namespace meltstage::app
