// SPDX-License-Identifier: Apache-2.0
// The pieces of the functional sign-off set: directed at one requirement each, with random values where
// values are what matters. What each asks for stands in docs/test-vectors.md.
#include <algorithm>
#include <initializer_list>
#include <random>
#include <stdexcept>

#include "app/functional_session.hpp"
#include "cmodel/spec.hpp"

namespace meltstage::app {

namespace spec = chip::spec;

namespace {

using Parameters = std::array<std::int32_t, spec::kHoldingCount>;

constexpr std::uint16_t kFastBaud = 5000;
constexpr std::uint64_t kTenth = spec::kClkHz / 10;
constexpr std::uint64_t kMillisecond = spec::kClkHz / 1000;
constexpr std::uint16_t kSetpointTop = 4950;  // T_MAX at its top less the margin
constexpr std::int32_t kPerTenthDegc = 5;     // 1/320 degC
constexpr std::int32_t kPerSixtyFourth = 32;

std::int16_t of_tenths(std::int32_t tenths) {
  return static_cast<std::int16_t>(tenths * kPerSixtyFourth / kPerTenthDegc);
}

class Pieces {
 public:
  explicit Pieces(FunctionalLength length) : quick_(length == FunctionalLength::quick) {}

  FunctionalSet record() {
    reset_and_identity();
    at_work();
    registers();
    protocol();
    line_settings();
    sensors();
    loop_arithmetic();
    ramps();
    regulation();
    self_tuning();
    pulse_width();
    protection();
    reset_in_operation();
    return s_.finish();
  }

 private:
  // ---- random values ----

  std::uint32_t below(std::uint32_t n) { return static_cast<std::uint32_t>(random_() % n); }
  bool one_in(std::uint32_t n) { return below(n) == 0; }
  // Of any magnitude with the same chance: small values as often as large ones.
  std::int32_t any_size(std::int32_t least, std::int32_t most) {
    const std::uint32_t span = static_cast<std::uint32_t>(most - least) + 1;
    unsigned bits = 0;
    while (bits < 32 && (span - 1) >> bits != 0) ++bits;
    const std::uint32_t value = static_cast<std::uint32_t>(random_()) >> (32 - bits) >> below(bits);
    return least + static_cast<std::int32_t>(value % span);
  }
  std::int32_t in_range(std::uint16_t reg) {
    const spec::RegisterInfo& info = spec::kHolding[reg];
    if (one_in(8)) return one_in(2) ? info.min : info.max;
    if (one_in(2)) return any_size(info.min, info.max);
    return info.min + static_cast<std::int32_t>(below(static_cast<std::uint32_t>(info.max - info.min) + 1));
  }
  std::int16_t any_temperature(std::int32_t least_tenths, std::int32_t most_tenths) {
    const auto span = static_cast<std::uint32_t>(of_tenths(most_tenths) - of_tenths(least_tenths));
    const std::int32_t value = of_tenths(least_tenths) + static_cast<std::int32_t>(below(span));
    return static_cast<std::int16_t>(value == 0 || value == -1 ? 1
                                                               : value);  // all 0 or all 1 is a stuck line
  }
  unsigned often(unsigned whole, unsigned quick) const { return quick_ ? quick : whole; }

  // ---- steps that the pieces share ----

  // Nothing trips, the sensor is a plain 16-bit word in 1/64 degC, control periods and frames are the
  // shortest.
  static Parameters calm() {
    Parameters p{};
    for (std::size_t i = 0; i < p.size(); ++i) p[i] = spec::kHolding[i].reset;
    p[spec::kRegHostWd] = 0;
    p[spec::kRegCtrl] = 0x17;
    p[spec::kRegTs] = 10;
    p[spec::kRegTMax] = 5000;
    p[spec::kRegTMin] = -400;
    p[spec::kRegExcLimit] = 5000;
    p[spec::kRegExcTime] = 65535;
    p[spec::kRegLbaTime] = 0;
    p[spec::kRegHoldTime] = 0;
    p[spec::kRegDtdtMax] = 0;
    p[spec::kRegZeroRise] = 0;
    p[spec::kRegBadMax] = 15;
    p[spec::kRegSampleTimeout] = 65535;
    p[spec::kRegFbTime] = 65535;
    p[spec::kRegSensType] = 0;
    p[spec::kRegSensFrame] = 0x2010;
    p[spec::kRegSensData] = 16;
    p[spec::kRegSensScale] = 256;
    p[spec::kRegSensFaultMask] = 0;
    p[spec::kRegSensCheckMaskH] = 0;
    p[spec::kRegSensCheckMaskL] = 0;
    p[spec::kRegSpiDiv] = 2;
    p[spec::kRegPwmPeriod] = 3000;
    p[spec::kRegBaud] = kFastBaud;
    return p;
  }
  // Registers first..last but LOCK and the line's own.
  void write_range(const Parameters& p, std::uint16_t first, std::uint16_t last) {
    constexpr std::uint16_t kMost = 16;  // registers in a request
    const auto part = [&](std::uint16_t from, std::uint16_t to) {
      for (; from <= to; from = static_cast<std::uint16_t>(from + kMost))
        s_.write(from, std::span(p).subspan(from, std::min<std::size_t>(kMost, to - from + 1U)));
    };
    if (first < spec::kRegLock) part(first, std::min<std::uint16_t>(last, spec::kRegLock - 1));
    if (last > spec::kRegLock)
      part(std::max<std::uint16_t>(first, spec::kRegLock + 1),
           std::min<std::uint16_t>(last, spec::kRegPwmMinOn));
    if (last > spec::kRegFormat) part(std::max<std::uint16_t>(first, spec::kRegPreset), last);
  }
  void write_all(const Parameters& p) {
    s_.write(spec::kRegTMax, spec::kHolding[spec::kRegTMax].max);  // so that no SETPOINT is refused
    write_range(p, spec::kRegSetpoint, spec::kHoldingCount - 1);
  }
  // From reset to calm parameters on a fast line.
  void start_work(std::uint8_t strap = 0) {
    s_.reset(strap);
    s_.set_temperature(of_tenths(250));
    now_ = calm();
    s_.write(spec::kRegBaud, kFastBaud);
    s_.write(spec::kRegTs, now_[spec::kRegTs]);
    s_.ticks();
    s_.set_line(kFastBaud, 0, s_.address());
    write_all(now_);
    s_.ticks(2);
  }
  void set(std::uint16_t reg, std::int32_t value) {
    now_[reg] = value;
    s_.write(reg, value);
  }
  bool heating() const { return s_.chip().guard.run_q != 0; }
  void heat() {
    if (s_.chip().guard.fault_q != 0) s_.command(spec::kCmdClearFault);
    s_.command(spec::kCmdRun);
    s_.run(100);
    if (!heating()) throw std::logic_error("functional set: heating did not begin");
  }
  // Registers that the control computation and the judging of its result show.
  void look() { s_.read_inputs(); }
  void sample(std::int16_t sixty_fourths) {
    s_.set_temperature(sixty_fourths);
    s_.ticks();
  }

  // ---- pieces ----

  void reset_and_identity() {
    s_.begin("reset, address straps, identification");
    for (const std::uint8_t strap : std::initializer_list<std::uint8_t>{5, 2, 7, 0}) {
      s_.reset(strap);
      s_.ask(tb::report_server_id(s_.address()));
    }
    s_.read_holding();
    s_.read_inputs();
    for (const std::uint8_t object : std::initializer_list<std::uint8_t>{0, 1, 2})
      s_.ask(tb::read_device_identification(s_.address(), 4, object));
    for (const std::uint8_t code : std::initializer_list<std::uint8_t>{1, 2, 3})
      s_.ask(tb::read_device_identification(s_.address(), code, 0));
  }

  // Every block once, briefly and all at a time: what a defect spoils for long shows here at once.
  void at_work() {
    s_.begin("closed loop at work: every block, briefly");
    start_work();
    set(spec::kRegTlmPeriod, 1);
    set(spec::kRegMode, 1);
    struct Pulse {
      std::int32_t duty, ctrl, prescale, period, least;
    };
    for (const Pulse& to :
         {Pulse{3333, 0x17, 0, 701, 0}, Pulse{9876, 0x07, 2, 300, 20}, Pulse{50, 0x17, 0, 90, 7},
          Pulse{6543, 0x17, 5, 2, 0}, Pulse{10000, 0x17, 0, 97, 0}}) {
      set(spec::kRegManualDuty, to.duty);
      set(spec::kRegCtrl, to.ctrl);
      const std::int32_t values[] = {to.prescale, to.period, to.least};
      s_.write(spec::kRegPwmPrescale, values);
      s_.ticks();
      if (!heating()) heat();
      sample(any_temperature(100, 900));
      look();
    }
    Parameters p = calm();
    p[spec::kRegSetpoint] = 1234;
    p[spec::kRegTlmPeriod] = 1;
    p[spec::kRegPwmPeriod] = 509;
    p[spec::kRegBandFull] = 300;
    p[spec::kRegBandOff] = 200;
    p[spec::kRegFfDrop] = 3000;
    for (const std::int32_t slew : {0, 700}) {
      p[spec::kRegSlew] = slew;
      p[spec::kRegRampDown] = slew;
      write_all(p);
      for (const std::int32_t tenths : {900, 1210, 1229, 1236, 1251, 1500}) {
        s_.droplet(5);
        sample(of_tenths(tenths));
        look();
      }
    }
    s_.command(spec::kCmdTune);
    for (const std::int32_t tenths : {1200, 1260, 1190, 1270}) sample(of_tenths(tenths));
    look();
    s_.command(spec::kCmdStop);
    for (std::int32_t mode = 1; mode < 4; ++mode) {
      set(spec::kRegSensFrame, 0x2010 | (mode << 6));
      set(spec::kRegSensTrim, 100 * mode);
      s_.sensor().set(0x0C35U + static_cast<std::uint32_t>(mode), 16, static_cast<unsigned>(mode));
      s_.ticks();
      look();
    }
    write_all(now_ = calm());
    sample(of_tenths(250));
    heat();
    s_.set_inhibit(true);
    s_.run(100);
    s_.set_inhibit(false);
    look();
    s_.command(spec::kCmdStop);
    s_.command(spec::kCmdClearFault);
    s_.read_holding();
    look();
  }

  // Staged and active words take a value and its complement; Discard copies the active words back to be read.
  void registers() {
    s_.begin("registers: staged and active, both values of every bit, SECDED");
    s_.command(spec::kCmdDiscard);
    s_.read_holding();
    for (unsigned round = 0; round < often(8, 1); ++round) {
      Parameters value = calm();
      for (std::uint16_t reg = spec::kRegSetpoint; reg < spec::kHoldingCount; ++reg)
        value[reg] = in_range(reg);
      if (round == 0) {
        for (std::uint16_t reg = 0; reg < spec::kHoldingCount; ++reg) value[reg] = spec::kHolding[reg].max;
      }
      for (const bool complement : {false, true}) {
        Parameters p = value;
        for (std::uint16_t reg = 0; complement && reg < spec::kHoldingCount; ++reg)
          p[reg] = spec::kHolding[reg].min + spec::kHolding[reg].max - value[reg];
        p[spec::kRegSetpoint] = std::min<std::int32_t>(p[spec::kRegSetpoint], kSetpointTop);
        p[spec::kRegTs] = now_[spec::kRegTs];
        write_all(p);
        s_.read_holding();
        s_.ticks();
        s_.command(spec::kCmdDiscard);
        s_.read_holding();
        s_.read_inputs();
      }
    }
    write_all(now_);
    s_.ticks(2);

    s_.begin("registers: hold, commit, discard, lock");
    s_.command(spec::kCmdHold);
    for (const std::int32_t ts : {2000, 1365, 682, 10}) s_.write(spec::kRegTs, ts);
    for (const std::int32_t baud : {4095, 2730, 1365}) {
      s_.write(spec::kRegBaud, baud);
      s_.write(spec::kRegAddress, baud & 0xFF & 247);
      s_.write(spec::kRegFormat, baud & 7);
      s_.write(spec::kRegLock, 0);
      s_.read_holding();
    }
    s_.ticks(2);  // nothing of that is in force
    s_.read_inputs();
    s_.command(spec::kCmdDiscard);
    s_.read_holding();
    s_.command(spec::kCmdHold);
    s_.write(spec::kRegKp, 0x5AA5);
    s_.command(spec::kCmdCommit);
    s_.refused(write_request(spec::kRegKiHold, 1), 6);
    s_.ticks();
    s_.read_holding();
    for (const std::int32_t lock : {0x5555, 0xAAAA}) {
      s_.write(spec::kRegLock, lock);
      s_.ticks();
      s_.refused(write_request(spec::kRegKp, 1), 4);
      s_.command(spec::kCmdStop);
      s_.command(spec::kCmdStop);
      s_.read_holding();
      s_.read_inputs();
      s_.write(spec::kRegLock, 0);
      s_.ticks();
    }
  }

  tb::ModbusRequest write_request(std::uint16_t reg, std::int32_t value) const {
    return tb::write_single_register(s_.address(), static_cast<std::uint16_t>(spec::kHoldingBase + reg),
                                     static_cast<std::uint16_t>(value));
  }
  std::vector<std::uint8_t> any_bytes(std::size_t count) {
    std::vector<std::uint8_t> bytes;
    for (std::size_t i = 0; i < count; ++i) bytes.push_back(static_cast<std::uint8_t>(random_()));
    return bytes;
  }

  void protocol() {
    s_.begin("Modbus: functions, exceptions, broadcast, lengths, damaged frames");
    const std::uint8_t me = s_.address();
    for (unsigned i = 0; i < 12; ++i) s_.ask(tb::diagnostic_echo(me, static_cast<std::uint16_t>(random_())));
    for (const std::uint8_t function :
         std::initializer_list<std::uint8_t>{0, 1, 2, 5, 15, 22, 23, 43, 44, 64, 85, 127}) {
      const std::uint8_t bytes[] = {me, function, 0, 1, 2, 3};
      s_.refused(tb::with_crc(bytes), 1);
    }
    // Sixteen words of any value: the frame is stored whole before it is refused.
    for (unsigned i = 0; i < often(8, 2); ++i) {
      std::vector<std::uint16_t> words;
      for (unsigned w = 0; w < 16; ++w) words.push_back(static_cast<std::uint16_t>(random_()));
      words[0] = 0xFFFF;
      s_.refused(tb::write_multiple_registers(me, spec::kHoldingBase + spec::kRegPwmMinOn, words), 2);
      s_.refused(tb::write_multiple_registers(me, spec::kHoldingBase + spec::kRegSetpoint, words), 3);
    }
    const std::vector<std::uint16_t> many(17, 1);
    s_.refused(tb::write_multiple_registers(me, spec::kHoldingBase + 1, many), 3);
    s_.refused(tb::read_input_registers(me, 0, 33), 3);
    s_.refused(tb::read_input_registers(me, 0, 0), 3);
    for (unsigned i = 0; i < often(16, 4); ++i) {
      const auto address = static_cast<std::uint16_t>(0x0200 + below(0xFE00));
      s_.refused(tb::read_input_registers(me, address, 1), 2);
      s_.refused(write_request(static_cast<std::uint16_t>(address - spec::kHoldingBase), 0), 2);
    }
    for (std::uint16_t reg = spec::kRegSetpoint; reg < spec::kHoldingCount; ++reg) {
      const spec::RegisterInfo& info = spec::kHolding[reg];
      if (info.max < (info.is_signed ? 32767 : 65535)) s_.refused(write_request(reg, info.max + 1), 3);
      if (info.min > (info.is_signed ? -32768 : 0)) s_.refused(write_request(reg, info.min - 1), 3);
    }
    for (unsigned i = 0; i < often(40, 8); ++i) {
      const auto word = static_cast<std::uint16_t>(0xA500 ^ (1U << below(16)) ^ below(256));
      const bool known = word == spec::kCmdRun || word == spec::kCmdClearFault || word == spec::kCmdHold ||
                         word == spec::kCmdCommit || word == spec::kCmdDiscard || word == spec::kCmdTune ||
                         word == spec::kCmdStop;
      if (!known) s_.refused(write_request(spec::kRegCmd, word), 3);
    }
    s_.refused(tb::read_device_identification(me, 4, 3), 2);
    s_.refused(tb::read_device_identification(me, 0, 0), 3);
    s_.refused(write_request(spec::kRegCmd, spec::kCmdTune), 4);
    s_.refused(write_request(spec::kRegSetpoint, 5000), 3);
    s_.unanswered(tb::write_single_register(0, spec::kHoldingBase + spec::kRegKp, 0x1234));
    s_.unanswered(tb::write_single_register(0, spec::kHoldingBase + spec::kRegCmd, spec::kCmdStop));
    s_.unanswered(tb::read_input_registers(0, 0, 1));
    for (const std::uint8_t other : std::initializer_list<std::uint8_t>{0x55, 0xAA, 0xF7, 0x02, 0x03, 0x05,
                                                                        0x09, 0x11, 0x21, 0x41, 0x81})
      s_.unanswered(tb::read_input_registers(other, 0, 1));
    for (unsigned i = 0; i < often(40, 6); ++i) s_.unanswered(tb::raw_frame(any_bytes(1 + below(24))));
    for (unsigned i = 0; i < often(40, 6); ++i) {
      tb::ModbusRequest request = tb::diagnostic_echo(me, static_cast<std::uint16_t>(random_()));
      tb::UartChar& character = request.frame[below(static_cast<std::uint32_t>(request.frame.size()))];
      (i % 2 != 0 ? character.wrong_parity : character.missing_stop) = true;
      s_.unanswered(request);
    }
    for (const unsigned length : {255U, 256U, 257U, 300U}) s_.unanswered(tb::raw_frame(any_bytes(length)));
    for (const unsigned clocks : {1U, 4U, 8U, 14U}) s_.glitch(clocks);
    s_.read_inputs();
    if (!quick_) {
      for (unsigned i = 0; i < 600; ++i) s_.unanswered(tb::raw_frame(any_bytes(4)));
      s_.read_inputs();
    }
  }

  void line_settings() {
    s_.begin("line: baud rates, formats, addresses");
    struct Setting {
      std::uint16_t baud, format;
      std::uint8_t address;
    };
    for (const Setting& to :
         {Setting{4095, 1, 0xF7}, Setting{2730, 2, 0x55}, Setting{1365, 3, 0xAA & 0xF7}, Setting{960, 4, 1},
          Setting{3071, 6, 0x0F}, Setting{kFastBaud, 7, 0xF0}, Setting{kFastBaud, 0, 1}}) {
      const std::int32_t values[] = {to.address, to.baud, to.format};
      s_.write(spec::kRegAddress, values);
      s_.ticks();
      s_.set_line(to.baud, to.format, to.address);
      s_.run(20000);
      s_.ask(tb::report_server_id(s_.address()));
      s_.read_inputs();
      s_.unanswered(tb::raw_frame(any_bytes(5)));
    }
  }

  // What a sensor of this description sends: its checked bits right, its fault bits clear, the rest any.
  std::uint32_t any_frame(std::uint32_t check_mask, std::uint32_t check_value, std::uint32_t fault_mask) {
    return ((static_cast<std::uint32_t>(random_()) & ~check_mask) | (check_value & check_mask)) &
           ~(fault_mask & ~check_mask);
  }
  void sensors() {
    s_.begin("sensors: presets, custom frames of every length and mode, bad frames");
    start_work();
    for (std::uint16_t type = 1; type < spec::kSensorPresets.size(); ++type) {
      const spec::SensorPreset& preset = spec::kSensorPresets[type];
      set(spec::kRegSensType, type);
      set(spec::kRegSensTrim, in_range(spec::kRegSensTrim));
      set(spec::kRegSpiDiv, 2 + static_cast<std::int32_t>(below(12)));
      const unsigned length = preset.frame & 63U, mode = preset.frame >> 6 & 3U;
      for (unsigned i = 0; i < often(4, 2); ++i) {
        s_.sensor().set(any_frame(preset.check_mask, preset.check_value, preset.fault_mask), length, mode);
        s_.ticks();
        look();
      }
      s_.sensor().set(static_cast<std::uint32_t>(random_()), length, mode);
      s_.ticks();
      look();
    }
    for (unsigned i = 0; i < often(20, 4); ++i) {
      Parameters p = now_;
      p[spec::kRegSensType] = 0;
      p[spec::kRegSpiDiv] = i % 8 == 0 ? 255 : 2 + static_cast<std::int32_t>(below(20));
      for (std::uint16_t reg = spec::kRegSensFrame; reg <= spec::kRegSensTrim; ++reg) p[reg] = in_range(reg);
      const unsigned length = 1 + below(32), mode = below(4);
      p[spec::kRegSensFrame] =
          static_cast<std::int32_t>((p[spec::kRegSensFrame] & 0x3F00) | (mode << 6) | length);
      if (one_in(2)) p[spec::kRegSensSetup] = 0;
      if (one_in(2)) p[spec::kRegSensFaultMask] = 0;
      if (one_in(2)) {
        p[spec::kRegSensFrame] = static_cast<std::int32_t>(0x2000 | (mode << 6) | 32);
        p[spec::kRegSensCheckMaskH] = p[spec::kRegSensCheckMaskL] = 0;
      }
      write_range(p, spec::kRegSensType, spec::kRegSpiDiv);
      const auto mask =
          static_cast<std::uint32_t>(p[spec::kRegSensCheckMaskH] << 16 | p[spec::kRegSensCheckMaskL]);
      const auto value =
          static_cast<std::uint32_t>(p[spec::kRegSensCheckValueH] << 16 | p[spec::kRegSensCheckValueL]);
      const auto faults = static_cast<std::uint32_t>(p[spec::kRegSensFaultMask]);
      for (unsigned frame = 0; frame < 2; ++frame) {
        s_.sensor().set(any_frame(mask, value, faults), p[spec::kRegSensFrame] & 63, mode);
        s_.ticks();
        look();
      }
      // One checked or fault bit wrong.
      s_.sensor().set(any_frame(mask, value, faults) ^ (1U << below(32)), p[spec::kRegSensFrame] & 63, mode);
      s_.ticks();
      look();
    }
    for (const std::uint32_t stuck : {0U, ~0U}) {
      s_.sensor().set(stuck, 32, 0);
      s_.ticks(2);
      look();
    }
    write_all(now_ = calm());
    sample(of_tenths(250));
    s_.ticks();
  }

  // Gains, limits and temperatures of any size, a new set each control period.
  void loop_arithmetic() {
    s_.begin("control law: gains, limits, temperatures of any size");
    start_work();
    heat();
    for (unsigned i = 0; i < often(100, 16); ++i) {
      Parameters p = now_;
      for (std::uint16_t reg = spec::kRegSetpoint; reg <= spec::kRegFfExt; ++reg) p[reg] = in_range(reg);
      for (std::uint16_t reg = spec::kRegKp; reg <= spec::kRegSlew; ++reg) p[reg] = in_range(reg);
      for (const std::uint16_t reg :
           {spec::kRegHoldMult, spec::kRegHoldAdd, spec::kRegPreset, spec::kRegFfDrop})
        p[reg] = in_range(reg);
      p[spec::kRegSetpoint] = std::min<std::int32_t>(p[spec::kRegSetpoint], kSetpointTop);
      p[spec::kRegCtrl] = static_cast<std::int32_t>(below(128) & ~0x20U);
      if (!one_in(8)) p[spec::kRegMode] = 0;
      if (!one_in(4)) p[spec::kRegRampUp] = p[spec::kRegRampDown] = 0;
      if (!one_in(4)) p[spec::kRegSlew] = 0;
      if (!one_in(3)) p[spec::kRegDutyMax] = 10000;
      if (one_in(2)) p[spec::kRegBandFull] = p[spec::kRegBandOff] = 5000;
      write_range(p, spec::kRegSetpoint, spec::kRegFfExt);
      write_range(p, spec::kRegCtrl, spec::kRegSlew);
      write_range(p, spec::kRegHoldMult, spec::kRegHoldAdd);
      write_range(p, spec::kRegPreset, spec::kRegFfDrop);
      for (unsigned drops = below(6); drops > 0; --drops) s_.droplet(3);
      const std::int32_t near = of_tenths(p[spec::kRegSetpoint]) + (one_in(2) ? 1 : -1) * any_size(0, 4000);
      const bool far =
          one_in(3) || near < of_tenths(-390) || near > of_tenths(4990) || near == 0 || near == -1;
      s_.set_temperature(far ? any_temperature(-390, 4990) : static_cast<std::int16_t>(near));
      s_.ticks();
      look();
      if (!heating()) heat();
    }
    for (unsigned i = 0; i < 300; ++i) s_.droplet(2);  // the counter stops at its top
    s_.ticks();
    look();
    s_.command(spec::kCmdStop);
    write_all(now_ = calm());
    sample(of_tenths(250));
    s_.ticks();
  }

  void ramps() {
    s_.begin("set-point ramps, telemetry");
    set(spec::kRegTlmPeriod, 1);
    for (const std::int32_t rate : {1562, 1365, 682, 100, 3}) {
      const std::int32_t from = 300 + static_cast<std::int32_t>(below(4000));
      sample(of_tenths(from));
      set(spec::kRegRampUp, rate);
      set(spec::kRegRampDown, 1562 - rate / 2);
      set(spec::kRegSetpoint, kSetpointTop);
      s_.ticks();
      heat();
      for (unsigned i = 0; i < often(4, 2); ++i) {
        sample(static_cast<std::int16_t>(of_tenths(from) + any_size(0, 300)));
        look();
      }
      set(spec::kRegSetpoint, 0);
      for (unsigned i = 0; i < often(4, 2); ++i) {
        sample(static_cast<std::int16_t>(of_tenths(from) - any_size(0, 300)));
        look();
      }
      s_.command(spec::kCmdStop);
    }
    set(spec::kRegTlmPeriod, 0);
  }

  // The way to a set-point, past it and back: quality figures, at-temperature output.
  void regulation() {
    s_.begin("at temperature, quality figures");
    set(spec::kRegRampUp, 0);
    set(spec::kRegRampDown, 0);
    set(spec::kRegAtDwell, 0);
    set(spec::kRegTlmPeriod, 1);
    sample(of_tenths(250));
    heat();
    for (unsigned i = 0; i < often(12, 3); ++i) {
      const std::int32_t target = in_range(spec::kRegSetpoint);
      set(spec::kRegSetpoint, std::min<std::int32_t>(target, kSetpointTop));
      set(spec::kRegAtWindow, in_range(spec::kRegAtWindow));
      set(spec::kRegAtDwell, i % 6 == 0 ? 1 : 0);
      const std::int16_t middle = of_tenths(now_[spec::kRegSetpoint]);
      for (const int sign : {0, 1, -1, 1}) {
        const std::int32_t to = middle + sign * any_size(0, 6000);
        sample(static_cast<std::int16_t>(
            std::clamp<std::int32_t>(to == 0 || to == -1 ? 1 : to, of_tenths(-390), of_tenths(4990))));
      }
      sample(static_cast<std::int16_t>(middle + 1));
      if (i % 6 == 0) s_.run(2 * kTenth);
      look();
    }
    s_.command(spec::kCmdStop);
    set(spec::kRegTlmPeriod, 0);
  }

  void self_tuning() {
    s_.begin("self-tuning: finished with different plants, stopped");
    for (unsigned run = 0; run < often(4, 1); ++run) {
      write_all(now_ = calm());
      const std::int32_t setpoint = 300 + static_cast<std::int32_t>(below(4000));
      set(spec::kRegSetpoint, setpoint);
      set(spec::kRegTAmb, run == 2 ? 1000 : in_range(spec::kRegTAmb) / 2);
      set(spec::kRegDutyMax, run % 2 == 0 ? 10000 : 2000 + static_cast<std::int32_t>(below(8000)));
      const std::int32_t middle = of_tenths(setpoint);
      const std::int32_t swing = 40 + any_size(0, 3000);
      const auto level = [&](bool above) {
        const std::int32_t away = swing - static_cast<std::int32_t>(below(8));
        return static_cast<std::int16_t>(std::clamp<std::int32_t>(above ? middle + away : middle - away,
                                                                  of_tenths(-390), of_tenths(4990)));
      };
      sample(level(false));
      s_.ticks();
      heat();
      s_.command(spec::kCmdTune);
      s_.refused(write_request(spec::kRegKp, 1), 6);
      for (unsigned turn = 0; turn < 20 && s_.chip().atune.tuning(); ++turn) {
        for (unsigned i = 1 + below(run == 0 ? 6 : 2); i > 0 && s_.chip().atune.tuning(); --i)
          sample(level(turn % 2 == 0));
        look();
        if (run == 3 && turn == 6) s_.command(spec::kCmdStop);
      }
      s_.ticks(2);
      look();
      s_.read_holding();
      s_.command(spec::kCmdDiscard);
      s_.read_holding();
      s_.command(spec::kCmdStop);
    }
    write_all(now_ = calm());
    sample(of_tenths(250));
  }

  void pulse_width() {
    s_.begin("PWM: duty ends, periods, prescaler, dither, shortest pulse");
    start_work();
    set(spec::kRegMode, 1);
    s_.ticks();
    heat();
    for (unsigned i = 0; i < often(40, 8); ++i) {
      Parameters p = now_;
      p[spec::kRegManualDuty] = i < 4 ? (i % 2 == 0 ? 10000 : 0) : in_range(spec::kRegManualDuty);
      p[spec::kRegCtrl] = i % 2 == 0 ? 0x10 : 0;
      p[spec::kRegPwmPrescale] = any_size(0, i % 4 == 0 ? 3 : 300);
      p[spec::kRegPwmPeriod] = 2 + any_size(0, p[spec::kRegPwmPrescale] < 4 ? 30000 : 100);
      p[spec::kRegPwmMinOn] = one_in(2) ? 0 : any_size(0, p[spec::kRegPwmPeriod]) / 2;
      write_range(p, spec::kRegManualDuty, spec::kRegManualDuty);
      write_range(p, spec::kRegCtrl, spec::kRegCtrl);
      write_range(p, spec::kRegPwmPrescale, spec::kRegPwmMinOn);
      s_.ticks(i % 4 == 1 ? 3 : 1);
    }
    struct Long {
      std::int32_t prescale, period, duty;
    };
    for (const Long& to :
         {Long{65535, 2, 5000}, Long{0, 65535, 9999}, Long{0, 43690, 6666}, Long{0, 10, 10000}}) {
      set(spec::kRegManualDuty, to.duty);
      const std::int32_t values[] = {to.prescale, to.period, 0};
      s_.write(spec::kRegPwmPrescale, values);
      s_.ticks(2);
    }
    s_.command(spec::kCmdStop);
    look();
  }

  // One fault: what brings it about, what is seen, and that it can be cleared once its cause is gone.
  template <class Cause, class Remedy>
  void trip(unsigned fault, const Cause& cause, const Remedy& remedy) {
    s_.begin(std::string("protection: ") + std::string(spec::kFaults[fault].name));
    write_all(now_ = calm());
    set(spec::kRegAtWindow, 1000);
    set(spec::kRegSetpoint, 2000);
    sample(of_tenths(1950));
    heat();
    s_.ticks();
    cause();
    for (unsigned i = 0; i < 60 && (s_.chip().guard.fault_q >> fault & 1) == 0; ++i) s_.ticks();
    if ((s_.chip().guard.fault_q >> fault & 1) == 0)
      throw std::logic_error("functional set: " + std::string(spec::kFaults[fault].name) + " did not trip");
    look();
    s_.command(spec::kCmdStop);
    remedy();
    s_.ticks(2);
    look();
    for (unsigned i = 0; i < 60 && s_.chip().guard.cause_q != 0; ++i) s_.ticks();
    s_.command(spec::kCmdClearFault);
    look();
  }
  void protection() {
    const auto calm_again = [&] {
      write_all(now_ = calm());
      sample(of_tenths(250));
    };
    trip(
        spec::kFaultOverTemp,
        [&] {
          set(spec::kRegSetpoint, 1900);
          set(spec::kRegTMax, 2341);
          sample(of_tenths(2342));
        },
        calm_again);
    trip(
        spec::kFaultUnderTemp,
        [&] {
          set(spec::kRegTMin, 682);
          sample(of_tenths(681));
        },
        calm_again);
    trip(
        spec::kFaultSensorFault,
        [&] {
          set(spec::kRegBadMax, 3);
          set(spec::kRegSensFaultMask, 1);
          s_.ticks();
          s_.sensor().set(0x1235, 16, 0);
        },
        calm_again);
    trip(
        spec::kFaultSensorFrame,
        [&] {
          set(spec::kRegBadMax, 15);
          s_.ticks();
          s_.sensor().set(0xFFFF, 16, 0);
        },
        calm_again);
    trip(
        spec::kFaultSensorStale,
        [&] {
          set(spec::kRegSampleTimeout, 1);
          s_.ticks();
          s_.sensor().set(0xFFFF, 16, 0);
        },
        calm_again);
    trip(
        spec::kFaultSensorStale,  // frozen
        [&] {
          set(spec::kRegMode, 1);
          set(spec::kRegLbaTime, 1);
        },
        calm_again);
    trip(
        spec::kFaultRate,
        [&] {
          set(spec::kRegDtdtMax, 341);
          set(spec::kRegBadMax, 4);
          for (const int tenths : {1952, 1949, 1951}) sample(of_tenths(tenths));
          sample(of_tenths(3000));
        },
        calm_again);
    trip(
        spec::kFaultNotHeating,
        [&] {
          set(spec::kRegLbaTime, 1);
          set(spec::kRegMode, 0);
          set(spec::kRegCtrl, 0x10);
          set(spec::kRegBandFull, 0);
        },
        calm_again);
    trip(
        spec::kFaultHoldPower,
        [&] {
          set(spec::kRegHoldTime, 1);
          set(spec::kRegHoldMult, 1);
          set(spec::kRegHoldAdd, 1);
          set(spec::kRegKff, 100);
          set(spec::kRegCtrl, 0x10);
          set(spec::kRegBandFull, 5000);
          set(spec::kRegKp, 500);
        },
        calm_again);
    trip(
        spec::kFaultExcursion,
        [&] {
          set(spec::kRegExcLimit, 100);
          set(spec::kRegExcTime, 1);
          set(spec::kRegAtWindow, 20);
          sample(of_tenths(2000));
          s_.ticks();
          sample(of_tenths(2150));
        },
        calm_again);
    trip(
        spec::kFaultZeroRise,
        [&] {
          set(spec::kRegMode, 1);
          set(spec::kRegZeroWait, 1);
          set(spec::kRegZeroRise, 80);
          s_.run(2 * kTenth);
          sample(of_tenths(2100));
        },
        calm_again);
    trip(
        spec::kFaultHeaterFb,
        [&] {
          set(spec::kRegFbTime, quick_ ? 100 : 65535);
          set(spec::kRegCtrl, 0x37);
          s_.hold_feedback(true);
          set(spec::kRegMode, 1);
        },
        [&] {
          s_.free_feedback();
          calm_again();
        });
    trip(
        spec::kFaultHostWatchdog,
        [&] {
          set(spec::kRegHostWd, 1);
          s_.run(2 * kTenth);
        },
        calm_again);
    trip(
        spec::kFaultInhibit,
        [&] {
          s_.set_inhibit(true);
          s_.run(kMillisecond);
        },
        [&] {
          s_.refused(write_request(spec::kRegCmd, spec::kCmdClearFault), 4);
          s_.refused(write_request(spec::kRegCmd, spec::kCmdRun), 4);
          s_.set_inhibit(false);
        });

    // Detectors with limits and temperatures of any size; which of them trips is left to chance.
    s_.begin("protection: limits of any size");
    start_work();
    for (unsigned i = 0; i < often(10, 3); ++i) {
      Parameters p = calm();
      p[spec::kRegSetpoint] = static_cast<std::int32_t>(below(kSetpointTop));
      p[spec::kRegAtWindow] = in_range(spec::kRegAtWindow);
      p[spec::kRegAtDwell] = below(2) != 0 ? 0 : in_range(spec::kRegAtDwell);
      p[spec::kRegMode] = one_in(4) ? 1 : 0;
      p[spec::kRegManualDuty] = one_in(2) ? 0 : 10000;
      for (std::uint16_t reg = spec::kRegTMax; reg <= spec::kRegSampleTimeout; ++reg) {
        if (one_in(2)) p[reg] = in_range(reg);
      }
      p[spec::kRegTMax] = std::max<std::int32_t>(p[spec::kRegTMax], p[spec::kRegSetpoint] + 50);
      if (one_in(3)) p[spec::kRegLbaTime] = p[spec::kRegHoldTime] = p[spec::kRegZeroWait] = 1;
      p[spec::kRegHostWd] = in_range(spec::kRegHostWd);
      write_all(calm());
      s_.set_temperature(any_temperature(-390, 4900));
      s_.ticks(2);
      if (s_.chip().guard.cause_q == 0) {
        s_.command(spec::kCmdClearFault);
        s_.command(spec::kCmdRun);
      }
      write_range(p, spec::kRegSetpoint, spec::kHoldingCount - 1);
      for (unsigned n = 0; n < 5; ++n) {
        sample(any_temperature(-390, 4900));
        look();
      }
      if (one_in(6)) s_.run(kTenth);
      look();
    }
    write_all(now_ = calm());
  }

  void reset_in_operation() {
    s_.begin("reset in operation");
    sample(of_tenths(300));
    s_.ticks(2);
    if (s_.chip().guard.fault_q != 0) s_.command(spec::kCmdClearFault);
    heat();
    for (const std::int32_t ts : {1365, 682}) {
      s_.write(spec::kRegTs, ts);
      s_.ticks();
      s_.command(spec::kCmdDiscard);
      s_.read_holding();
      s_.reset(0);
      s_.read_holding();
      s_.read_inputs();
      if (ts == 1365) start_work();
    }
  }

  bool quick_;
  std::mt19937_64 random_{kFunctionalSeed};
  FunctionalSession s_;
  Parameters now_ = calm();
};

}  // namespace

FunctionalSet functional_set(FunctionalLength length) { return Pieces(length).record(); }

}  // namespace meltstage::app
