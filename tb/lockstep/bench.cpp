// SPDX-License-Identifier: Apache-2.0
#include "tb/lockstep/bench.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <iterator>
#include <utility>

#include "cmodel/algor.hpp"
#include "tb/lockstep/verilated_rtl.hpp"

namespace meltstage::tb {

namespace {

constexpr double kClockHz = spec::kClkHz;
constexpr std::uint16_t kMsLast = spec::kClkHz / 1000 - 1;
constexpr double kConversionS =
    5e-6;  // a fresh conversion for every control tick, however early next_tick() brings it
constexpr std::array kFormats{k8E1, k8O1, k8N2, k8N1};  // as register FORMAT

UartLine line_of(unsigned baud, unsigned format) { return {kClockHz, baud * 100.0, kFormats[format]}; }

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

namespace {

// A clock as the points see it.
struct Moment {
  const chip::Chip& now;
  const chip::Inputs& in;
  const chip::Outputs& out;
  const Coverage::Before& before;

  std::uint16_t param(spec::Reg reg) const { return now.params()[reg]; }
  bool heating() const { return now.guard.run_q != 0; }
  bool manual() const { return (param(spec::kRegMode) & 1) != 0; }
  bool resets() const { return !in.rst_n && !before.reset; }
  bool answered() const { return now.sysctrl.cmd_done_q != 0; }
  bool refused(unsigned exception) const {
    return answered() && now.paramc.rsp_kind_q == chip::spec::kRspException &&
           now.paramc.rsp_exc_q == exception;
  }
  bool identified(unsigned code) const {
    return answered() && now.uartc.cmd_fc() == 43 && (now.uartc.cmd_a() & 0xFF) == code &&
           (now.paramc.rsp_kind_q == chip::spec::kRspIdStream ||
            now.paramc.rsp_kind_q == chip::spec::kRspIdObject);
  }
};

struct Point {
  const char* name;
  bool (*seen)(const Moment&);
};

constexpr Point kPoints[] = {
    {"heater pulse", [](const Moment& m) { return m.out.heater && !m.before.heater; }},
    {"heating by a manual duty",
     [](const Moment& m) { return m.heating() && m.manual() && m.now.algor.duty_q != 0; }},
    {"manual duty above DUTY_MAX",
     [](const Moment& m) {
       return m.heating() && m.manual() && m.now.algor.done_q != 0 &&
              m.now.algor.ext_q > m.now.algor.duty_max_q && m.now.algor.duty_max_q != 0;
     }},
    {"ramp up while heating",
     [](const Moment& m) {
       return m.heating() && m.param(spec::kRegRampUp) != 0 && m.now.algor.sp_work_q < m.now.algor.target_q;
     }},
    {"ramp down while heating",
     [](const Moment& m) {
       return m.heating() && m.param(spec::kRegRampDown) != 0 && m.now.algor.sp_work_q > m.now.algor.target_q;
     }},
    {"rise of the duty held by SLEW",
     [](const Moment& m) {
       return m.heating() && !m.manual() && m.now.algor.done_q != 0 && m.now.algor.slew_q != 0 &&
              m.now.algor.duty_q < static_cast<std::uint32_t>(m.now.algor.work_q);
     }},
    {"duty at a DUTY_MAX below 100 % in the PID segment",
     [](const Moment& m) {
       return m.now.algor.segment_q == chip::spec::kSegPid && m.now.algor.limited() &&
              m.now.algor.duty_max_q < 65536;
     }},
    {"integral above 0", [](const Moment& m) { return m.now.algor.i_q != 0; }},
    {"integral at its limit",
     [](const Moment& m) { return m.now.algor.i_q != 0 && m.now.algor.i_q == m.now.algor.duty_max_q << 14; }},
    {"integral held",
     [](const Moment& m) { return m.heating() && m.now.algor.i_q != 0 && m.now.algor.i_held_q != 0; }},
    {"whole degrees while heating",
     [](const Moment& m) {
       return m.heating() && m.now.algor.e_q != 0 && m.now.params().bit(spec::kRegCtrl, 3);
     }},
    {"droplets made up for",
     [](const Moment& m) {
       return m.heating() && m.now.algor.drops_q != 0 && m.param(spec::kRegFfDrop) != 0 &&
              m.now.algor.ext_q != 0;
     }},
    {"relay centred", [](const Moment& m) { return m.now.atune.cycles_q == spec::kTuneAdaptCycles; }},
    {"gains worked out", [](const Moment& m) { return m.now.atune.phase_q == chip::kTuneResults; }},
    {"tuning finished", [](const Moment& m) { return m.now.atune.end_q == chip::kTuneFinished; }},
    {"tuning stopped", [](const Moment& m) { return m.now.atune.end_q == chip::kTuneStopped; }},
    {"tuning ended by time", [](const Moment& m) { return m.now.atune.stop_q != 0; }},
    {"write refused while tuning",
     [](const Moment& m) { return m.refused(chip::spec::kExcBusy) && m.now.atune.tuning(); }},
    {"error at temperature", [](const Moment& m) { return m.now.quality.error_q != 0; }},
    {"settling time",
     [](const Moment& m) { return m.now.quality.band_q != 0xFFFF && m.now.quality.band_q != 0; }},
    {"hold power counted",
     [](const Moment& m) { return m.now.guard.hold_q != 0 && m.now.guard.hold_test_q == 0; }},
    {"test of the reading", [](const Moment& m) { return m.now.guard.hold_test_q != 0; }},
    {"load shown by a fall of the reading",
     [](const Moment& m) { return m.now.guard.hold_shown_q != 0 && m.now.guard.hold_test_q == 0; }},
    {"loop break counted", [](const Moment& m) { return m.now.guard.lba_q != 0; }},
    {"at temperature", [](const Moment& m) { return m.out.at_temp; }},
    {"late tick", [](const Moment& m) { return m.now.sysctrl.overrun_q != 0; }},
    {"prescaler while heating", [](const Moment& m) { return m.out.heater && m.now.pwmc.prescale_q != 0; }},
    {"PWM period below 2", [](const Moment& m) { return m.param(spec::kRegPwmPeriod) < 2; }},
    {"test mode while heating",
     [](const Moment& m) { return m.in.test_mode && m.heating() && m.now.sysctrl.tenth_q != 0; }},
    {"reset in test mode", [](const Moment& m) { return m.resets() && m.in.test_mode; }},
    {"reset", [](const Moment& m) { return m.resets(); }},
    {"reset while heating", [](const Moment& m) { return m.resets() && m.before.heating; }},
    {"reset while answering", [](const Moment& m) { return m.resets() && m.before.answering; }},
    {"reset with telemetry due", [](const Moment& m) { return m.resets() && m.before.telemetry_due; }},
    {"reset after a refused sample", [](const Moment& m) { return m.resets() && m.before.sample_refused; }},
    {"STOP while heating", [](const Moment& m) { return m.heating() && m.now.paramc.stop_q != 0; }},
    {"STOP seen on the wire while heating",
     [](const Moment& m) { return m.heating() && m.now.uartc.stop(); }},
    {"refusal by LOCK",
     [](const Moment& m) { return m.refused(chip::spec::kExcDevice) && m.param(spec::kRegLock) != 0; }},
    {"function code 08 with another sub-function",
     [](const Moment& m) { return m.refused(chip::spec::kExcFunction) && m.now.uartc.cmd_fc() == 8; }},
    {"function code 43 with another MEI type",
     [](const Moment& m) { return m.refused(chip::spec::kExcFunction) && m.now.uartc.cmd_fc() == 43; }},
    {"identification 01", [](const Moment& m) { return m.identified(1); }},
    {"identification 02", [](const Moment& m) { return m.identified(2); }},
    {"identification 03", [](const Moment& m) { return m.identified(3); }},
    {"identification 04", [](const Moment& m) { return m.identified(4); }},
    {"broadcast", [](const Moment& m) { return m.answered() && m.now.uartc.cmd_broadcast(); }},
    {"commit", [](const Moment& m) { return m.now.sysctrl.commit_q != 0; }},
    {"telemetry frame", [](const Moment& m) { return m.now.sysctrl.tlm_start_q != 0; }},
    {"character error", [](const Moment& m) { return m.now.uartc.char_errors() != 0; }},
    {"refused sample", [](const Moment& m) { return m.now.guard.sensor_errors_q != 0; }},
    {"corrected parameter flip", [](const Moment& m) { return m.now.mem.corrected() != 0; }},
};
static_assert(std::size(kPoints) <= Coverage::kMostPoints);

// Bytes of a frame of this function code; 0 = unknown.
unsigned right_length(const chip::Uartc& uart) {
  switch (uart.cmd_fc()) {
    case 3:
    case 4:
    case 6:
    case 8:
      return 8;
    case 16:
      return 9u + 2u * uart.cmd_b();
    case 17:
      return 4;
    case 43:
      return 7;
    default:
      return 0;
  }
}

}  // namespace

void Coverage::observe(const chip::Chip& now, const chip::Inputs& in, const chip::Outputs& out) {
  const Moment moment{now, in, out, before_};
  for (std::size_t i = 0; i < std::size(kPoints); ++i) {
    if (!points[i]) points[i] = kPoints[i].seen(moment);
  }
  const std::uint8_t state = now.sysctrl.state_q & 31;
  if (in.rst_n) {
    ++states[state];
    if (state != before_.state) ++arcs[before_.state][state];
    if (const unsigned rising = now.guard.fault_q & ~unsigned{before_.fault}) {
      for (unsigned i = 0; i < spec::kFaultCount; ++i) latched[i] += rising >> i & 1;
    }
    if (moment.heating()) ++segments[now.algor.segment_q & 3];
    if (moment.answered()) {
      const std::uint8_t function = now.uartc.cmd_fc();
      ++functions[function];
      if (now.paramc.rsp_kind_q == chip::spec::kRspException) ++exceptions[now.paramc.rsp_exc_q & 7];
      if (moment.refused(chip::spec::kExcValue) && now.uartc.cmd_len() != right_length(now.uartc))
        ++wrong_lengths[function];
    }
    const unsigned sensor = moment.param(spec::kRegSensType);
    if (now.sensc.done() && now.sensc.ok() && sensor < sensors.size()) ++sensors[sensor];
    crc_errors += now.uartc.crc_errors() != before_.crc_errors;
  }
  before_ = {.state = state,
             .fault = now.guard.fault_q,
             .crc_errors = now.uartc.crc_errors(),
             .reset = !in.rst_n,
             .heating = moment.heating(),
             .answering = out.uart_de,
             .telemetry_due = now.sysctrl.tlm_due_q != 0,
             .sample_refused = now.guard.bad_q != 0,
             .heater = out.heater};
}

void Coverage::add(const Coverage& other) {
  const auto sum = [](auto& a, const auto& b) {
    std::transform(a.begin(), a.end(), b.begin(), a.begin(), std::plus<>{});
  };
  sum(states, other.states);
  for (std::size_t i = 0; i < arcs.size(); ++i) sum(arcs[i], other.arcs[i]);
  sum(latched, other.latched);
  sum(segments, other.segments);
  sum(functions, other.functions);
  sum(wrong_lengths, other.wrong_lengths);
  sum(exceptions, other.exceptions);
  sum(sensors, other.sensors);
  for (std::size_t i = 0; i < points.size(); ++i) points[i] = points[i] || other.points[i];
  crc_errors += other.crc_errors;
}

std::vector<std::string> Coverage::holes() const {
  std::vector<std::string> list;
  const auto want = [&](bool seen, std::string what) {
    if (!seen) list.push_back(std::move(what));
  };
  for (const spec::StateInfo& s : spec::kStates) want(states[s.code] != 0, fmt::format("state {}", s.name));
  for (const spec::StateArc& a : spec::kStateArcs) {
    want(arcs[a.from][a.to] != 0,
         fmt::format("arc {} -> {}", spec::state_name(a.from), spec::state_name(a.to)));
  }
  for (unsigned i = 0; i < spec::kFaultCount; ++i)
    want(latched[i] != 0, fmt::format("fault {}", spec::kFaults[i].name));
  for (const unsigned fc : {3, 4, 6, 8, 16, 17, 43}) {
    want(functions[fc] != 0, fmt::format("function code {}", fc));
    want(wrong_lengths[fc] != 0, fmt::format("wrong length with function code {}", fc));
  }
  for (const unsigned exc : {1, 2, 3, 4, 6}) want(exceptions[exc] != 0, fmt::format("exception {:02}", exc));
  for (const unsigned segment :
       {chip::spec::kSegNone, chip::spec::kSegFull, chip::spec::kSegPid, chip::spec::kSegOff}) {
    want(segments[segment] != 0, fmt::format("segment {}", segment));
  }
  for (std::size_t i = 0; i < sensors.size(); ++i)
    want(sensors[i] != 0, fmt::format("sample of sensor {}", spec::kSensorPresets[i].name));
  for (std::size_t i = 0; i < std::size(kPoints); ++i) want(points[i], kPoints[i].name);
  want(crc_errors != 0, "CRC error");
  return list;
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
  const unsigned pins = static_cast<unsigned>(in_.rst_n) | static_cast<unsigned>(in_.uart_rx) << 1 |
                        static_cast<unsigned>(in_.spi_miso) << 2 | static_cast<unsigned>(in_.heater_fb) << 3 |
                        static_cast<unsigned>(in_.inhibit) << 4 | static_cast<unsigned>(in_.addr_strap) << 5 |
                        static_cast<unsigned>(in_.drop) << 8 | static_cast<unsigned>(in_.test_mode) << 9;
  hash_ = (hash_ ^ pins) * 0x100000001b3U;
  hash_ = (hash_ ^ cycle_) * 0x100000001b3U;
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
