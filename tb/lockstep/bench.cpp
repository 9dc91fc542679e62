// SPDX-License-Identifier: Apache-2.0
#include "tb/lockstep/bench.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <utility>

#include "tb/lockstep/verilated_rtl.hpp"
#include "tb/pins/chip_pins.hpp"

namespace meltstage::tb {

namespace {

constexpr double kClockHz = spec::kClkHz;
constexpr std::uint16_t kMsLast = spec::kClkHz / 1000 - 1;
constexpr double kConversionS =
    5e-6;  // a fresh conversion for every control tick, however early next_tick() brings it

UartLine line_of(std::uint16_t baud, std::uint8_t format) {
  return {kClockHz, baud * 100.0, uart_format(format)};
}

bool differ(const SpiFaults& a, const SpiFaults& b) {
  return a.probe != b.probe || a.miso != b.miso || a.frozen != b.frozen ||
         a.reserved_bits_wrong != b.reserved_bits_wrong;
}

// Nothing is under way but the wait for a tick or a command.
bool at_rest(const chip::Chip& chip) {
  const auto state = chip.sysctrl.state_q;
  return (state == spec::kStCmdReady || state == spec::kStCfgPwm || state == spec::kStIdle) &&
         chip.sysctrl.tick_pend_q == 0 && chip.sysctrl.ms_q == 0 && !chip.uartc.cmd_valid();
}

class ModelAlone final : public Device {
 public:
  explicit ModelAlone(const chip::Chip& start) : chip_(start) {}
  chip::Outputs step(const chip::Inputs& in) override { return chip_.step(in); }
  const chip::Chip& model() const override { return chip_; }
  void restart(const chip::Chip& state, const chip::Inputs&) override { chip_ = state; }
  Compared finish() override { return {}; }

 private:
  chip::Chip chip_;
};

class InLockstep final : public Device {
 public:
  InLockstep(MakeRtl make, std::filesystem::path failures, const chip::Chip& start, RunIdentity identity)
      : make_(std::move(make)), failures_(std::move(failures)), identity_(std::move(identity)) {
    restart(start, {});
  }
  chip::Outputs step(const chip::Inputs& in) override { return run_->step(in); }
  const chip::Chip& model() const override { return run_->model(); }

  void restart(const chip::Chip& state, const chip::Inputs& in) override {
    const std::uint64_t cycle = run_ ? run_->cycle() : 0;
    if (run_) done_ = sum(done_, run_->compared());
    auto rtl = make_();
    rtl->load(state, in);
    run_.emplace(std::move(rtl), state, cycle, identity_, failures_);
  }
  Compared finish() override {
    const Compared all = sum(done_, run_->compared());
    if (all.clocks == 0 || all.pin_values == 0 || all.flop_values == 0) {
      throw std::logic_error(fmt::format("test={}: nothing was compared", identity_.test));
    }
    return all;
  }

 private:
  static Compared sum(const Compared& a, const Compared& b) {
    return {a.clocks + b.clocks, a.pin_values + b.pin_values, a.flop_values + b.flop_values,
            a.resets + b.resets, a.frames + b.frames,         a.samples + b.samples};
  }

  MakeRtl make_;
  std::filesystem::path failures_;
  RunIdentity identity_;
  Compared done_;
  std::optional<Lockstep> run_;
};

}  // namespace

Settings quick(std::initializer_list<Setting> others) {
  Settings settings{{spec::kRegBaud, 5000}, {spec::kRegTs, 10}, {spec::kRegSpiDiv, 2}};
  settings.insert(settings.end(), others);
  return settings;
}

chip::Chip chip_with(const Settings& settings) {
  chip::Chip chip;
  for (int i = 0; i < 4; ++i) chip.step({});  // the reset synchroniser lets go
  for (const Setting& s : settings) chip.mem.preset(s.reg, s.value);
  for (int i = 0; i < 4; ++i) chip.step({});  // the idle serial port takes baud rate, format and address over
  return chip;
}

void flip_active(chip::Chip& chip, spec::Reg reg, std::uint32_t mask) {
  chip.mem.active_q[reg] ^= mask;
  chip.mem.refresh_params();
}

std::unique_ptr<Device> model_alone(const chip::Chip& start) { return std::make_unique<ModelAlone>(start); }

std::unique_ptr<Device> in_lockstep(const chip::Chip& start, const RunIdentity& identity,
                                    const std::filesystem::path& failures) {
  return std::make_unique<InLockstep>(make_verilated_rtl, failures, start, identity);
}

std::unique_ptr<Device> in_lockstep_with(const MakeRtl& make, const chip::Chip& start,
                                         const RunIdentity& identity) {
  return std::make_unique<InLockstep>(make, std::filesystem::path(), start, identity);
}

Bench::Bench(std::unique_ptr<Device> device, const std::string& sensor, std::uint64_t seed)
    : temperature([this](std::uint64_t) { return world.temperature_degc; }),
      device_(std::move(device)),
      sensor_(make_spi_sensor(sensor, {.clock_hz = kClockHz,
                                       .source = [this](std::uint64_t cycle) { return temperature(cycle); },
                                       .noise = stream(seed, "sensor"),
                                       .conversion_s = kConversionS})),
      seed_(seed),
      out_(device_->model().outputs({})) {
  coverage_.toggles.resume(model());
  tune();
}

// Host's line to the chip's present baud rate and format.
void Bench::tune() {
  const auto& uart = model().uartc;
  if (uart.baud_q == baud_ && uart.format_q == format_ && transmitter_) return;
  baud_ = uart.baud_q;
  format_ = uart.format_q;
  const UartLine line = line_of(baud_, format_);
  transmitter_.emplace(line, UartTiming{}, stream(seed_, "line"));
  receiver_.emplace(line);
  transmitter_->step(cycle_);
}

void Bench::hash_pins() {
  if (in_ == hashed_) return;
  hashed_ = in_;
  const auto fold = [this](std::uint64_t byte) { hash_ = (hash_ ^ (byte & 0xFFU)) * 0x100000001b3U; };
  const auto levels = pin_levels(in_, {});
  for (std::uint32_t pin = 0; pin < spec::kInputPins; ++pin) fold(levels[pin]);  // none has more than 8 bits
  for (unsigned byte = 0; byte < sizeof cycle_; ++byte) fold(cycle_ >> 8 * byte);
}

void Bench::check_safety(std::uint16_t latching_before) const {
  const auto broken = [&](const char* what) {
    throw SafetyViolation(fmt::format("cycle {}: heater high {}, expected low (fault {:#06x}, cause {:#06x})",
                                      cycle_, what, model().guard.fault_q, model().guard.cause_q));
  };
  if (latching_before != 0 && model().guard.fault_q == 0) {
    throw SafetyViolation(
        fmt::format("cycle {}: cause {:#06x} has not latched a fault", cycle_, latching_before));
  }
  if (!out_.heater) return;
  if (!out_.fault_n) broken("with a fault latched");
  if (in_.inhibit) broken("with the emergency stop pressed");
  if (latching_before != 0) broken("one clock after a cause");
  if (!in_.rst_n) broken("in reset");
}

chip::Outputs Bench::clock() {
  if (differ(world.sensor, applied_)) {
    applied_ = world.sensor;
    sensor_->set_faults(applied_);
  }
  in_.rst_n = !world.reset;
  in_.inhibit = world.inhibit;
  in_.drop = world.drop;
  in_.test_mode = world.test_mode;
  in_.addr_strap = world.addr_strap;
  in_.heater_fb = world.feedback == Feedback::follows ? out_.heater : world.feedback == Feedback::stuck_high;
  in_.spi_miso = sensor_->step(cycle_, out_.spi_cs_n, out_.spi_sclk, out_.spi_mosi);
  in_.uart_rx = transmitter_->step(cycle_);
  hash_pins();
  const chip::Guard& guard = model().guard;
  const unsigned latching =
      guard.cause_q & (guard.run_q != 0 ? 0x7FFFu : 0x7FFFu & ~unsigned{spec::kFaultRunOnly});
  out_ = device_->step(in_);
  check_safety(in_.rst_n ? static_cast<std::uint16_t>(latching) : std::uint16_t{0});
  receiver_->step(cycle_, out_.uart_tx);
  coverage_.observe(model(), in_, out_);
  ++cycle_;
  return out_;
}

void Bench::run(std::uint64_t clocks) {
  for (std::uint64_t i = 0; i < clocks; ++i) clock();
}

bool Bench::run_until(const std::function<bool(const chip::Chip&)>& condition, std::uint64_t clocks) {
  for (std::uint64_t i = 0; i < clocks; ++i) {
    if (condition(model())) return true;
    clock();
  }
  return condition(model());
}

void Bench::send(const ModbusRequest& request) {
  tune();
  for (const UartChar& character : request.frame) transmitter_->send(character);
}

ModbusResult Bench::ask(const ModbusRequest& request, std::uint64_t wait_clocks) {
  send(request);
  while (sending()) clock();
  while (receiver_->take()) continue;
  ModbusResult result;
  for (std::uint64_t waited = 0; !out_.uart_de; ++waited) {
    if (waited == wait_clocks) return result;
    clock();
  }
  RtuFrame reply;
  reply.start_cycle = cycle_;
  while (out_.uart_de) clock();
  while (const auto byte = receiver_->take()) {
    reply.bytes.push_back(byte->data);
    reply.line_error |= byte->parity_error || byte->framing_error;
  }
  reply.end_cycle = cycle_;
  std::vector<std::uint8_t> sent;
  for (const UartChar& character : request.frame) sent.push_back(character.data);
  return judge_reply(sent, reply);
}

ModbusResult Bench::write(spec::Reg reg, std::uint16_t value) {
  return ask(write_single_register(unit(), static_cast<std::uint16_t>(spec::kHoldingBase + reg), value));
}

ModbusResult Bench::write_block(spec::Reg first, const std::vector<std::uint16_t>& values) {
  return ask(
      write_multiple_registers(unit(), static_cast<std::uint16_t>(spec::kHoldingBase + first), values));
}

namespace {
std::vector<std::uint16_t> data_of(const ModbusResult& result, unsigned first) {
  if (result.outcome != ModbusOutcome::data) {
    throw std::runtime_error(fmt::format("reading register {:#x}: no data, exception {} {}", first,
                                         result.exception_code, result.problem));
  }
  return result.registers;
}
}  // namespace

std::vector<std::uint16_t> Bench::read_holding(unsigned first, unsigned count) {
  const auto address = static_cast<std::uint16_t>(spec::kHoldingBase + first);
  return data_of(ask(read_holding_registers(unit(), address, static_cast<std::uint16_t>(count))), address);
}

std::vector<std::uint16_t> Bench::read_input(unsigned first, unsigned count) {
  const auto address = static_cast<std::uint16_t>(first);
  return data_of(ask(read_input_registers(unit(), address, static_cast<std::uint16_t>(count))), address);
}

void Bench::poke(const std::function<void(chip::Chip&)>& change) {
  chip::Chip state = model();
  change(state);
  device_->restart(state, in_);
  coverage_.toggles.resume(model());
}

void Bench::next_tick() {
  run(100);  // the sensor converts between two readings
  run_until(at_rest, 2'000'000);
  if (model().sysctrl.state_q == spec::kStIdle)
    command(spec::kCmdStop);  // the host's first command starts the cycle
  run_until(at_rest, 2'000'000);
  poke([](chip::Chip& chip) {
    chip.sysctrl.ms_cnt_q = kMsLast - 2;
    chip.sysctrl.ts_cnt_q = static_cast<std::uint16_t>((chip.params()[spec::kRegTs] - 1) & 0x7FF);
  });
  run_until([](const chip::Chip& chip) { return chip.sysctrl.state_q == spec::kStReadTemp; }, 10'000);
  run_until(at_rest, 2'000'000);
}

void Bench::next_tenth() {
  run_until(at_rest, 2'000'000);
  poke([](chip::Chip& chip) { chip.sysctrl.tenth_cnt_q = 99; });
  next_tick();
}

}  // namespace meltstage::tb
