// SPDX-License-Identifier: Apache-2.0
#include "app/functional_vectors.hpp"

#include <fmt/format.h>

#include <memory>
#include <optional>
#include <stdexcept>

#include "cmodel/spec.hpp"
#include "tb/chip_pins.hpp"
#include "tb/head.hpp"
#include "tb/verilated_rtl.hpp"

namespace meltstage::app {

namespace spec = chip::spec;

namespace {

constexpr std::uint8_t kUnit = 1;
constexpr std::uint64_t kMillisecond = spec::kClkHz / 1000;

// Model and devices, their pins recorded.
class Session {
 public:
  Session() : head_({}), recorder_(set_.stream, tb::chip_pin_header("functional sign-off set")) {
    out_ = chip_.outputs({.rst_n = false});
  }

  void begin(std::string requirement) { set_.pieces.push_back({std::move(requirement), cycle_}); }
  void run(std::uint64_t clocks) {
    for (std::uint64_t i = 0; i < clocks; ++i) step();
  }
  // A request and its answer, or the time in which none came.
  void ask(tb::ModbusRequest request) {
    head_.host().submit(std::move(request));
    while (!head_.host().take_result()) step();
  }
  void write(std::uint16_t reg, std::int32_t value) {
    ask(tb::write_single_register(kUnit, static_cast<std::uint16_t>(spec::kHoldingBase + reg),
                                  static_cast<std::uint16_t>(value)));
  }
  void read_all() {
    constexpr std::uint16_t kMost = 32;  // registers in a request
    ask(tb::read_holding_registers(kUnit, spec::kHoldingBase, kMost));
    ask(tb::read_holding_registers(kUnit, spec::kHoldingBase + kMost, spec::kHoldingCount - kMost));
    read_inputs();
  }
  void read_inputs() {
    ask(tb::read_input_registers(kUnit, 0, 24));
    ask(tb::read_input_registers(kUnit, 24, spec::kInputCount - 24));
  }
  tb::Head& head() { return head_; }
  FunctionalSet finish() {
    recorder_.finish(cycle_ - 1);
    return std::move(set_);
  }

 private:
  void step() {
    const chip::Inputs in = head_.step(cycle_, out_);
    out_ = chip_.step(in);
    const auto levels = tb::pin_levels(in, out_);
    for (std::uint32_t pin = 0; pin < tb::kChipPinCount; ++pin) recorder_.set(pin, levels[pin]);
    recorder_.commit(cycle_++);
  }

  tb::Head head_;
  chip::Chip chip_;
  FunctionalSet set_;
  vectors::Recorder recorder_;
  chip::Outputs out_;
  std::uint64_t cycle_ = 0;
};

// These change the line itself; they are read, not written.
bool is_of_line(std::uint16_t reg) {
  return reg == spec::kRegAddress || reg == spec::kRegBaud || reg == spec::kRegFormat ||
         reg == spec::kRegLock;
}

void reset(Session& session) {
  session.head().set_reset(true);
  session.run(20);
  session.head().set_reset(false);
  session.run(2 * kMillisecond);
}

void register_suite(Session& session, FunctionalLength length) {
  session.read_all();
  for (const bool upper : {true, false}) {
    if (!upper && length == FunctionalLength::quick) continue;
    for (std::uint16_t reg = spec::kRegSetpoint; reg < spec::kHoldingCount; ++reg) {
      const spec::RegisterInfo& info = spec::kHolding[reg];
      if (!is_of_line(reg) && reg != spec::kRegPreset) session.write(reg, upper ? info.max : info.min);
    }
    session.write(spec::kRegCmd, spec::kCmdCommit);
    session.run(120 * kMillisecond);
    session.read_all();
  }
  session.ask(tb::diagnostic_echo(kUnit, 0xA53C));
  session.ask(tb::report_server_id(kUnit));
  session.ask(tb::read_device_identification(kUnit, 2, 0));
}

void heat(Session& session) {
  session.write(spec::kRegCmd, spec::kCmdClearFault);
  session.write(spec::kRegCmd, spec::kCmdRun);
  session.run(60 * kMillisecond);
  session.read_inputs();
}

void control(Session& session) {
  session.write(spec::kRegTs, 10);
  session.write(spec::kRegSetpoint, 1100);
  session.write(spec::kRegPwmPeriod, 3000);
  session.run(120 * kMillisecond);
  heat(session);
  for (const double degc : {60.0, 105.0, 109.0, 112.0}) {
    session.head().set_element_degc(degc);
    session.run(40 * kMillisecond);
    session.read_inputs();
  }
  session.write(spec::kRegMode, 1);
  for (const int duty : {0, 3, 5000, 9997, 10000}) {
    session.write(spec::kRegManualDuty, duty);
    session.run(20 * kMillisecond);
  }
}

void trips(Session& session) {
  session.head().set_element_degc(160.0);
  session.run(30 * kMillisecond);
  session.read_inputs();
  session.head().set_element_degc(28.0);
  heat(session);
  session.head().set_inhibit(true);
  session.run(kMillisecond);
  session.head().set_inhibit(false);
  session.read_inputs();
  heat(session);
  session.head().set_drop(true);
  session.run(kMillisecond);
  session.head().set_drop(false);
  session.write(spec::kRegHostWd, 1);
  session.run(250 * kMillisecond);
  session.read_inputs();
}

}  // namespace

FunctionalSet functional_set(FunctionalLength length) {
  Session session;
  session.begin("reset");
  reset(session);
  session.begin("register suite");
  register_suite(session, length);
  session.begin("reset in operation");
  reset(session);
  session.begin("control and PWM ends");
  control(session);
  session.begin("trip path, emergency stop, watchdog");
  trips(session);
  return session.finish();
}

PinReplay replay_pins(const vectors::Stream& stream, ReplayDevice device) {
  if (stream.header().pins != tb::chip_pin_header("").pins)
    throw std::runtime_error("recording: found other pins than the chip's, expected a recording of the chip");
  chip::Chip model;
  const std::unique_ptr<tb::VerilatedRtl> rtl =
      device == ReplayDevice::rtl ? tb::make_verilated_rtl() : nullptr;
  PinReplay result;
  vectors::Cursor cursor(stream);
  for (bool more = true; more; more = cursor.step()) {
    const chip::Inputs in = tb::inputs_of(cursor.values());
    const chip::Outputs recorded = tb::outputs_of(cursor.values());
    const chip::Outputs out = rtl ? rtl->step(in) : model.step(in);
    ++result.clocks;
    result.strobes += tb::kChipPinCount - tb::kPinUartTx;
    if (out == recorded) continue;
    if (result.mismatches++ == 0)
      result.first = fmt::format("cycle {}: {}", cursor.cycle(), tb::output_difference(recorded, out));
  }
  return result;
}

std::vector<dft::FunctionalStretch> functional_stretches(const vectors::Stream& stream,
                                                         const std::vector<std::string>& input_ports,
                                                         const std::string& clock,
                                                         const std::vector<std::string>& output_ports) {
  struct Source {
    std::uint32_t pin;
    unsigned bit;
  };
  const auto sources_of = [&](const std::vector<std::string>& ports) {
    std::vector<std::optional<Source>> sources;
    for (const std::string& port : ports) {
      const std::size_t bracket = port.find('[');
      const auto pin = vectors::find_pin(stream.header(), port.substr(0, bracket));
      if (!pin && port != clock)
        throw std::runtime_error(
            fmt::format("recording: found no pin {}, expected every port of the netlist", port));
      const unsigned bit =
          bracket == std::string::npos ? 0 : static_cast<unsigned>(std::stoul(port.substr(bracket + 1)));
      sources.push_back(pin ? std::optional(Source{*pin, bit}) : std::nullopt);
    }
    return sources;
  };
  const auto inputs = sources_of(input_ports), outputs = sources_of(output_ports);
  vectors::Cursor cursor(stream);
  const auto values_of = [&](const std::vector<std::optional<Source>>& sources) {
    std::vector<std::uint8_t> values;
    for (const auto& source : sources)
      values.push_back(source && (cursor.value(source->pin) >> source->bit & 1) != 0 ? 1 : 0);
    return values;
  };
  std::vector<dft::FunctionalStretch> stretches;
  for (bool more = true; more; more = cursor.next_event()) {
    dft::FunctionalStretch stretch{
        cursor.next_event_cycle().value_or(cursor.final_cycle() + 1) - cursor.cycle(), values_of(inputs),
        values_of(outputs)};
    const bool same = !stretches.empty() && stretches.back().inputs == stretch.inputs &&
                      stretches.back().outputs == stretch.outputs;
    if (same)
      stretches.back().clocks += stretch.clocks;
    else
      stretches.push_back(std::move(stretch));
  }
  return stretches;
}

}  // namespace meltstage::app
