// SPDX-License-Identifier: Apache-2.0
// The pieces of the functional sign-off set: directed at one requirement each, with random values where
// values are what matters. What each asks for stands in docs/make/test-vectors.md.
#include <algorithm>
#include <initializer_list>
#include <random>
#include <stdexcept>
#include <utility>

#include "asic/signoff/functional_session.hpp"
#include "cmodel/spec.hpp"

namespace meltstage::app {

namespace spec = chip::spec;

namespace {

using Parameters = std::array<std::int32_t, spec::kHoldingCount>;

constexpr std::uint16_t kFastBaud = 5000;
constexpr std::uint16_t kTopTime = 65535;     // registers of time, 0.1 s
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
    real_time();
    at_work();
    registers();
    protocol();
    line_settings();
    sensors();
    control_periods();
    loop_arithmetic();
    ramps();
    regulation();
    self_tuning();
    pulse_width();
    protection();
    long_times();
    reset_in_operation();
    commits();
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
    p[spec::kRegTs] = 20;
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
  void start_work(TimeBase time = TimeBase::test) {
    s_.reset(0, time);
    s_.set_temperature(of_tenths(250));
    now_ = calm();
    s_.write(spec::kRegTs, now_[spec::kRegTs]);
    s_.write(spec::kRegBaud, kFastBaud);
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
    if (!heating()) s_.fail("heating did not begin: causes " + std::to_string(s_.chip().guard.cause_q));
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
      s_.reset(strap, TimeBase::real);
      s_.ask(tb::report_server_id(s_.address()));
    }
    s_.read_holding();
    s_.read_inputs();
    for (const std::uint8_t object : std::initializer_list<std::uint8_t>{0, 1, 2})
      s_.ask(tb::read_device_identification(s_.address(), 4, object));
    for (const std::uint8_t code : std::initializer_list<std::uint8_t>{1, 2, 3})
      s_.ask(tb::read_device_identification(s_.address(), code, 0));
  }

  // The only piece but the first in which a millisecond is one.
  void real_time() {
    s_.begin("time base in operation: control period, 0.1 s, ramp");
    start_work(TimeBase::real);
    set(spec::kRegTlmPeriod, 1);
    set(spec::kRegAtDwell, 1);
    set(spec::kRegRampUp, 1562);
    sample(of_tenths(250));
    heat();
    set(spec::kRegSetpoint, 260);
    s_.ticks(8);
    look();
  }

  // Every block once, briefly and all at a time: what a defect spoils for long shows here at once.
  void at_work() {
    s_.begin("closed loop at work: every block, briefly");
    start_work();
    set(spec::kRegTs, 200);
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
    p[spec::kRegTs] = 200;
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

  // Staged and active words take a value, its complement, and one in which two bits differ; Discard copies
  // the active words back to be read.
  void registers() {
    s_.begin("registers: staged and active, both values of every bit");
    s_.command(spec::kCmdDiscard);
    s_.read_holding();
    for (unsigned round = 0; round < often(5, 2); ++round) {
      Parameters value = calm();
      for (std::uint16_t reg = spec::kRegSetpoint; reg < spec::kHoldingCount; ++reg)
        value[reg] = in_range(reg);
      if (round == 0) {
        for (std::uint16_t reg = 0; reg < spec::kHoldingCount; ++reg) value[reg] = spec::kHolding[reg].max;
      }
      for (const Change change : {Change::none, Change::complement, Change::two_bits}) {
        Parameters p;
        for (std::uint16_t reg = 0; reg < spec::kHoldingCount; ++reg)
          p[reg] = changed(reg, value[reg], change);
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
    set(spec::kRegTs, 400);  // the commit waits for the control period's end, and more writes are refused
    s_.ticks(2);
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
    set(spec::kRegTs, calm()[spec::kRegTs]);
    s_.ticks();
  }

  enum class Change : std::uint8_t { none, complement, two_bits };
  static std::int32_t changed(std::uint16_t reg, std::int32_t value, Change change) {
    const spec::RegisterInfo& info = spec::kHolding[reg];
    if (change == Change::complement) return info.min + info.max - value;
    if (change == Change::none) return value;
    for (const std::int32_t bits : {0x0410, 0x0010}) {
      if ((value ^ bits) >= info.min && (value ^ bits) <= info.max) return value ^ bits;
    }
    return value;
  }

  // A commit opens all staged words at a time: two that aren't as after reset bring any pattern to the
  // corrector.
  void commits() {
    s_.begin("registers: commits of any two words");
    s_.reset();
    s_.write(spec::kRegTs, calm()[spec::kRegTs]);
    s_.write(spec::kRegBaud, kFastBaud);
    s_.ticks();
    s_.set_line(kFastBaud, 0, s_.address());
    for (unsigned round = 0; round < often(400, 4); ++round) {
      const auto few_bits = [&](spec::Reg reg) {
        return spec::kHolding[reg].reset ^ static_cast<std::int32_t>(random_() & random_() & 0xFFFF);
      };
      s_.write(spec::kRegKp, std::array{few_bits(spec::kRegKp), few_bits(spec::kRegKiApproach)});
      s_.ticks();
    }
    s_.read_holding();
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
    counted_frames();
  }

  // Each fault of the line counts up: a character at a time, a frame of one byte, a broadcast without an
  // answer.
  void counted_frames() {
    s_.begin("Modbus: counts of damaged characters, CRC errors and messages");
    constexpr double kEnds_bits = 30, kSilence_bits = 40;  // gives an incomplete frame up; ends a whole one
    tb::ModbusRequest damaged = tb::raw_frame(any_bytes(often(16600, 270)));
    for (tb::UartChar& character : damaged.frame) character.wrong_parity = true;
    s_.unanswered(damaged);
    tb::ModbusRequest single = tb::raw_frame(any_bytes(often(4200, 70)));
    for (tb::UartChar& character : single.frame) character.gap_bits = kEnds_bits;
    s_.unanswered(single);
    const std::uint8_t who[] = {0, 17};
    tb::ModbusRequest broadcasts;
    for (unsigned i = 0; i < often(2100, 70); ++i) {
      tb::ModbusRequest one = tb::with_crc(who);
      one.frame.front().gap_bits = kSilence_bits;
      broadcasts.frame.insert(broadcasts.frame.end(), one.frame.begin(), one.frame.end());
    }
    s_.unanswered(broadcasts);
    s_.read_inputs();
  }

  void line_settings() {
    s_.begin("line: baud rates, formats, addresses, telemetry at each");
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
      constexpr std::uint64_t kFrames = 50000;  // clocks
      set(spec::kRegTlmPeriod, 1);
      s_.run(kFrames);
      set(spec::kRegTlmPeriod, 0);
      s_.run(kFrames);  // to the end of the last; a new rate waits for that
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
    for (unsigned i = 0; i < often(16, 5); ++i) {
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

  // Every bit of the control period: each is waited for.
  void control_periods() {
    s_.begin("control periods, telemetry periods");
    start_work();
    heat();
    for (const std::int32_t ts : {2000, 1365, 682, 1024, 512, 341, 256, 170, 128, 85, 64, 31, 10}) {
      s_.write(spec::kRegTs, ts);
      s_.ticks(2);
      look();
    }
    set(spec::kRegTs, 40);
    s_.ticks(2);
    for (unsigned i = 0; i < often(24, 6); ++i) {
      // Whole powers of two are not waited for: what takes one for less is early.
      const bool waits = i % 2 == 0;
      const std::int32_t period = waits ? any_size(1, 2000) : 1 << (3 + i / 2 % 13);
      set(spec::kRegTlmPeriod, period);
      s_.run((waits ? static_cast<std::uint64_t>(period) + 120 : 120) * kTestTenth);
    }
    set(spec::kRegTlmPeriod, 0);
    s_.command(spec::kCmdStop);
  }

  // What a control computation with these parameters and this temperature would come to.
  chip::Algor computed(const Parameters& p, std::int16_t pv) const {
    chip::Params params;
    for (std::size_t i = 0; i < p.size(); ++i) params.value[i] = static_cast<std::uint16_t>(p[i]);
    chip::Algor algor = s_.chip().algor;
    chip::AlgorIn in{.params = params,
                     .start = true,
                     .sample_ok = true,
                     .run = true,
                     .at_temp = s_.chip().guard.at_temp_q != 0,
                     .ms = false,
                     .pv = pv,
                     .drop = false,
                     .tuning = false,
                     .tune_duty = 0,
                     .tune_hold = 0};
    do {
      algor.step(in);
      in.start = false;
    } while (algor.done_q == 0);
    return algor;
  }

  // Gains, limits and temperatures of any size.
  void draw_law(Parameters& p, std::int16_t& pv) {
    for (std::uint16_t reg = spec::kRegSetpoint; reg <= spec::kRegFfExt; ++reg) p[reg] = in_range(reg);
    for (std::uint16_t reg = spec::kRegKp; reg <= spec::kRegSlew; ++reg) p[reg] = in_range(reg);
    for (const std::uint16_t reg :
         {spec::kRegHoldMult, spec::kRegHoldAdd, spec::kRegPreset, spec::kRegFfDrop, spec::kRegAtWindow})
      p[reg] = in_range(reg);
    p[spec::kRegSetpoint] = std::min<std::int32_t>(p[spec::kRegSetpoint], kSetpointTop);
    p[spec::kRegCtrl] = static_cast<std::int32_t>(below(128) & ~0x20U);
    p[spec::kRegMode] = one_in(10) ? 1 : 0;
    p[spec::kRegAtDwell] = 0;
    if (!one_in(8)) p[spec::kRegRampUp] = p[spec::kRegRampDown] = 0;
    if (!one_in(4)) p[spec::kRegSlew] = 0;
    if (!one_in(3)) p[spec::kRegDutyMax] = 10000;
    if (one_in(2)) p[spec::kRegBandFull] = p[spec::kRegBandOff] = 5000;
    const std::int32_t near = of_tenths(p[spec::kRegSetpoint]) + (one_in(2) ? 1 : -1) * any_size(0, 4000);
    const bool far = one_in(3) || near < of_tenths(-390) || near > of_tenths(4990) || near == 0 || near == -1;
    pv = far ? any_temperature(-390, 4990) : static_cast<std::int16_t>(near);
  }

  // A new set each control period. Most are drawn until the duty is none of its limits, so that each bit of
  // each term counts in it; it shows in the length of the pulse.
  void loop_arithmetic() {
    s_.begin("control law: gains, limits, temperatures of any size");
    start_work();
    now_[spec::kRegTs] = 330;
    write_all(now_);
    s_.ticks(2);
    heat();
    for (unsigned i = 0; i < often(150, 60); ++i) {
      Parameters p = now_;
      std::int16_t pv = 1;
      const bool any = one_in(4);
      for (unsigned tries = 0; tries < 200; ++tries) {
        draw_law(p, pv);
        const chip::Algor result = computed(p, pv);
        if (any || (result.duty_q > 64 && result.duty_q + 64 < result.duty_max_q)) break;
      }
      p[spec::kRegPwmPeriod] = 6000 + static_cast<std::int32_t>(below(12000));
      write_range(p, spec::kRegSetpoint, spec::kRegFfExt);
      write_range(p, spec::kRegCtrl, spec::kRegSlew);
      if (one_in(3)) {
        write_range(p, spec::kRegAtWindow, spec::kRegAtDwell);
        write_range(p, spec::kRegHoldMult, spec::kRegHoldAdd);
        write_range(p, spec::kRegPwmPeriod, spec::kRegPwmPeriod);
        write_range(p, spec::kRegPreset, spec::kRegFfDrop);
        now_ = p;
      } else {
        for (const std::uint16_t reg : {spec::kRegAtWindow, spec::kRegAtDwell, spec::kRegHoldMult,
                                        spec::kRegHoldAdd, spec::kRegPreset, spec::kRegFfDrop})
          p[reg] = now_[reg];
      }
      for (unsigned drops = below(6); drops > 0; --drops) s_.droplet(3);
      s_.set_temperature(pv);
      s_.ticks();
      s_.read_loop();
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
      s_.run(2 * kTestTenth);
      look();
    }
    s_.command(spec::kCmdStop);
    set(spec::kRegTlmPeriod, 0);
  }

  // Relay cycles of so many control periods, more or less, until it ends; the plant's answer is a swing of
  // this height.
  void relay_cycles(std::int32_t middle, std::int32_t swing, std::uint32_t periods, unsigned turns) {
    const auto level = [&](bool above) {
      const std::int32_t away = swing - static_cast<std::int32_t>(below(8));
      return static_cast<std::int16_t>(
          std::clamp<std::int32_t>(above ? middle + away : middle - away, of_tenths(-390), of_tenths(4990)));
    };
    for (unsigned turn = 0; turn < turns && s_.chip().atune.tuning(); ++turn) {
      s_.set_temperature(level(turn % 2 == 0));
      for (std::uint32_t i = 1 + below(periods); i > 0 && s_.chip().atune.tuning(); --i) s_.ticks();
      if (turn % 4 == 3) look();
    }
  }

  // From a set-point in the middle of the range, with the relay on and off for so many control periods each
  // cycle and a swing of this height, to the end.
  void relay_run(std::int32_t swing, std::initializer_list<std::pair<unsigned, unsigned>> cycles) {
    constexpr std::int32_t kMiddle = 2300;
    write_all(now_ = calm());
    set(spec::kRegSetpoint, kMiddle);
    set(spec::kRegTs, 10);
    sample(static_cast<std::int16_t>(of_tenths(kMiddle) - 40));
    s_.ticks();
    heat();
    s_.command(spec::kCmdTune);
    for (const auto& [on, off] : cycles) {
      s_.set_temperature(static_cast<std::int16_t>(of_tenths(kMiddle) - swing));
      s_.ticks(on);
      s_.set_temperature(static_cast<std::int16_t>(of_tenths(kMiddle) + swing));
      s_.ticks(off);
    }
    s_.set_temperature(static_cast<std::int16_t>(of_tenths(kMiddle) - swing));
    s_.ticks(3);
    if (s_.chip().atune.tuning()) s_.fail("self-tuning has not ended");
    look();
    s_.read_holding();
    s_.command(spec::kCmdStop);
  }
  // Sums of many bits: the largest swings, and cycles of thousands of control periods.
  void long_relay_cycles() {
    s_.begin("self-tuning: largest swings, longest cycles");
    constexpr std::int32_t kLargest = 17200;
    relay_run(kLargest, {{4, 4}, {40, 40}, {40, 40}, {40, 40}, {40, 45}, {50, 41}, {44, 44}, {47, 42}});
    if (quick_) return;
    relay_run(kLargest / 3,
              {{4, 4}, {30, 3}, {3, 40}, {25, 90}, {1040, 1100}, {1040, 30}, {1060, 20}, {1000, 120}});
    relay_run(200, {{4, 4}, {600, 20}, {8, 700}, {90, 30}, {60, 130}, {180, 90}, {20, 11}, {300, 400}});
  }

  void self_tuning() {
    s_.begin("self-tuning: finished with different plants, stopped, out of time");
    constexpr unsigned kEnough = 40;  // turns
    for (unsigned run = 0; run < often(10, 5); ++run) {
      write_all(now_ = calm());
      const std::int32_t setpoint = 300 + static_cast<std::int32_t>(below(4000));
      set(spec::kRegSetpoint, setpoint);
      set(spec::kRegTAmb, run == 2 ? 1000 : in_range(spec::kRegTAmb) / 2);
      set(spec::kRegDutyMax, run % 2 == 0 ? 10000 : 2000 + static_cast<std::int32_t>(below(8000)));
      set(spec::kRegTs, 10);
      sample(static_cast<std::int16_t>(of_tenths(setpoint) - 40));
      s_.ticks();
      heat();
      s_.command(spec::kCmdTune);
      s_.refused(write_request(spec::kRegKp, 1), 6);
      const std::uint32_t periods = run == 1 ? often(90, 60) : 2U << below(5);
      relay_cycles(of_tenths(setpoint), 40 + any_size(0, run % 3 == 0 ? 12000 : 3000), periods,
                   run == 3 ? 7 : kEnough);
      if (run == 3) s_.command(spec::kCmdStop);
      s_.ticks(2);
      look();
      s_.read_holding();
      s_.command(spec::kCmdDiscard);
      s_.read_holding();
      s_.command(spec::kCmdStop);
    }
    long_relay_cycles();
    // No switch of the relay for its time: ends with heating off.
    write_all(now_ = calm());
    set(spec::kRegSetpoint, 3000);
    sample(of_tenths(250));
    s_.ticks();
    heat();
    s_.command(spec::kCmdTune);
    s_.run(2000 * kTestTenth);
    look();
    s_.run(std::uint64_t{14400} * kTestTenth);
    if (heating()) s_.fail("self-tuning has not ended by time");
    look();
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
    long_pulses();
  }

  // Each waited for, so that all bits of both counters and of what is carried to the next period move.
  void long_pulses() {
    s_.begin("PWM: periods and prescalers of all bits, run to their end");
    start_work();
    set(spec::kRegMode, 1);
    s_.ticks();
    heat();
    for (unsigned i = 0; i < often(40, 4); ++i) {
      constexpr std::int32_t kLongest = 65535, kWhole = 10000;  // counts; duty
      const std::int32_t period = i % 4 == 0 ? kLongest - any_size(0, 20000) : any_size(1000, kLongest);
      const std::int32_t shortest = one_in(3) ? 0 : any_size(0, period / 2);
      // Pulses and gaps right at the shortest as often as any.
      const std::int32_t edge =
          std::min(shortest * kWhole / period + static_cast<std::int32_t>(below(9)) - 4, kWhole);
      const std::int32_t duty = one_in(2)   ? in_range(spec::kRegManualDuty)
                                : one_in(2) ? std::max(edge, 0)
                                            : std::min(kWhole - edge, kWhole);
      set(spec::kRegManualDuty, duty);
      set(spec::kRegCtrl, one_in(4) ? 0 : 0x10);
      const std::int32_t values[] = {0, period, shortest};
      s_.write(spec::kRegPwmPrescale, values);
      s_.run(3 * static_cast<std::uint64_t>(period));
    }
    for (unsigned i = 0; i < often(16, 2); ++i) {
      set(spec::kRegManualDuty, in_range(spec::kRegManualDuty));
      const std::int32_t values[] = {i == 0 ? 65535 : any_size(1000, 65535),
                                     2 + static_cast<std::int32_t>(below(3)), 0};
      s_.write(spec::kRegPwmPrescale, values);
      s_.run(static_cast<std::uint64_t>(values[0]) * static_cast<std::uint64_t>(values[1] + 1));
    }
    const std::int32_t brief[] = {0, 3000, 0};
    s_.write(spec::kRegPwmPrescale, brief);
    s_.command(spec::kCmdStop);
    look();
  }

  // ---- protection ----

  static std::uint16_t bit(unsigned fault) { return static_cast<std::uint16_t>(1U << fault); }
  std::uint16_t causes() const { return s_.chip().guard.cause_q; }
  std::uint16_t faults() const { return s_.chip().guard.fault_q; }
  void expect_cause(unsigned fault, bool present) {
    if (((causes() & bit(fault)) != 0) != present)
      s_.fail(std::string(spec::kFaults[fault].name) + (present ? ": found no cause" : ": found a cause"));
  }
  // The fault comes within this time, and no other before it.
  void expect_trip(unsigned fault, std::uint64_t tenths) {
    for (std::uint64_t i = 0; i <= tenths && faults() == 0; ++i) s_.run(kTestTenth);
    if (faults() != bit(fault)) s_.fail(std::string(spec::kFaults[fault].name) + " did not trip alone");
    s_.read_loop();
  }
  void expect_heating() {
    if (!heating() || faults() != 0) s_.fail("found a fault, expected none");
  }
  // Of 5 x / 32 in tenths, the last register value that x still reaches (x >= register) or passes (x >
  // register).
  static std::int32_t reached(std::int32_t x) {
    return x * kPerTenthDegc >= 0 ? x * kPerTenthDegc / kPerSixtyFourth
                                  : -((-x * kPerTenthDegc + kPerSixtyFourth - 1) / kPerSixtyFourth);
  }
  static std::int32_t passed(std::int32_t x) { return -reached(-x) - 1; }
  std::int32_t clamp_to(std::uint16_t reg, std::int32_t value) const {
    return std::clamp(value, spec::kHolding[reg].min, spec::kHolding[reg].max);
  }
  std::int16_t to_sensor(std::int32_t pv) const {
    const std::int32_t value = std::clamp<std::int32_t>(pv, of_tenths(-390), of_tenths(4990));
    return static_cast<std::int16_t>(value == 0 || value == -1 ? 1 : value);
  }

  // Calm and heating at this temperature, with these control periods.
  void heat_calmly(std::int32_t tenths, std::int32_t ts) {
    if (heating()) s_.command(spec::kCmdStop);
    write_all(now_ = calm());
    sample(of_tenths(tenths));
    set(spec::kRegTs, ts);
    s_.ticks(2);
    heat();
    s_.ticks();
  }

  // Limits of temperature, rate and rise right at the sample, on either side; heater off, each cause for
  // itself.
  void limits_of_temperature() {
    s_.begin("protection: over- and under-temperature, rate, rise at zero duty, right at the limit");
    start_work();
    set(spec::kRegTs, 240);
    s_.ticks(2);
    for (unsigned i = 0; i < often(110, 30); ++i) {
      const chip::Guard& guard = s_.chip().guard;
      Parameters p = now_;
      std::int32_t pv = any_temperature(-390, 4900);
      const auto side = [&] { return static_cast<std::int32_t>(below(2)); };
      if (one_in(2))
        pv = (in_range(spec::kRegTMax) * kPerSixtyFourth + kPerTenthDegc - 1) / kPerTenthDegc - side();
      if (one_in(3)) pv = in_range(spec::kRegTMin) * kPerSixtyFourth / kPerTenthDegc + side();
      if (one_in(2)) pv = guard.pv_q + (one_in(2) ? 1 : -1) * any_size(1, 8000);
      pv = to_sensor(pv);
      p[spec::kRegTMax] = clamp_to(spec::kRegTMax, reached(pv) + side());
      p[spec::kRegTMin] = clamp_to(spec::kRegTMin, reached(pv) + side());
      const std::int32_t step = pv - guard.pv_q, drift = pv - guard.rate_ref_q;
      const std::int32_t change = std::max(std::abs(drift), 2 * std::min(std::abs(step), std::abs(drift)));
      p[spec::kRegDtdtMax] = one_in(4) ? 0 : clamp_to(spec::kRegDtdtMax, passed(change) + side());
      p[spec::kRegBadMax] = 1;
      p[spec::kRegZeroRise] =
          one_in(4) ? 0 : clamp_to(spec::kRegZeroRise, reached(pv - guard.zero_ref_q) + side());
      p[spec::kRegZeroWait] = one_in(4) ? in_range(spec::kRegZeroWait) : any_size(0, 300);
      const bool hot = pv * kPerTenthDegc >= p[spec::kRegTMax] * kPerSixtyFourth;
      const bool cold = pv * kPerTenthDegc < p[spec::kRegTMin] * kPerSixtyFourth;
      const bool rate = guard.settled_q != 0 && p[spec::kRegDtdtMax] != 0 &&
                        change * kPerTenthDegc > p[spec::kRegDtdtMax] * kPerSixtyFourth;
      write_range(p, spec::kRegTMax, spec::kRegSampleTimeout);
      sample(static_cast<std::int16_t>(pv));
      expect_cause(spec::kFaultOverTemp, hot);
      expect_cause(spec::kFaultUnderTemp, cold);
      expect_cause(spec::kFaultRate, rate);
      s_.read_loop();
    }
    write_all(now_ = calm());
    sample(of_tenths(250));
    s_.ticks(2);
    s_.command(spec::kCmdClearFault);
  }

  // Bad samples of both kinds, one fewer than BAD_MAX and as many.
  void bad_samples() {
    s_.begin("protection: bad samples in a row");
    start_work();
    set(spec::kRegTs, 30);
    for (std::int32_t most = 1; most <= 15; most += quick_ ? 7 : 2) {
      for (const bool device : {false, true}) {
        sample(of_tenths(250));
        s_.command(spec::kCmdClearFault);
        set(spec::kRegBadMax, most);
        set(spec::kRegSensFaultMask, device ? 1 : 0);
        s_.ticks();
        heat();
        for (std::int32_t count = most - 1; count <= most; ++count) {
          s_.sensor().set(device ? 0x0C35 : 0xFFFF, 16, 0);
          s_.ticks(static_cast<unsigned>(count));
          const unsigned fault = device ? spec::kFaultSensorFault : spec::kFaultSensorFrame;
          if (count == most && faults() != bit(fault)) s_.fail("bad samples did not trip");
          if (count < most) expect_heating();
          sample(of_tenths(250));
        }
        s_.read_loop();
      }
    }
  }

  // Full duty without a rise, with a rise too small, with one that is enough and starts the time again.
  void not_heating() {
    s_.begin("protection: NotHeating, times and rises of any size");
    start_work();
    for (unsigned i = 0; i < often(12, 3); ++i) {
      heat_calmly(1000, 60);
      set(spec::kRegCtrl, 0x10);
      set(spec::kRegBandFull, 0);
      set(spec::kRegDutyMax, 100 + static_cast<std::int32_t>(below(9900)));
      set(spec::kRegSetpoint, kSetpointTop);
      const std::int32_t time = any_size(700, 2500), rise = any_size(1, 20000);
      const std::int32_t from = any_temperature(-390, 1000);
      set(spec::kRegLbaRise, clamp_to(spec::kRegLbaRise, reached(rise) + (i % 2 == 0 ? 1 : 0)));
      sample(to_sensor(from));
      set(spec::kRegLbaTime, time);
      s_.ticks(4);
      expect_heating();
      sample(to_sensor(from + rise));
      expect_trip(spec::kFaultNotHeating, static_cast<std::uint64_t>(time) + 4);
    }
  }

  // Duty just above the hold power trips, as much below does not.
  void hold_power() {
    s_.begin("protection: HoldPower, right at the limit, times of any size");
    start_work();
    for (unsigned i = 0; i < often(16, 5); ++i) {
      heat_calmly(1000, 80);
      Parameters p = now_;
      const std::int16_t pv = any_temperature(300, 3500);
      std::int32_t add = -1;
      while (add < 0 || add > 10000) {
        p[spec::kRegSetpoint] = std::min<std::int32_t>(in_range(spec::kRegSetpoint), kSetpointTop);
        p[spec::kRegKp] = in_range(spec::kRegKp);
        p[spec::kRegKiApproach] = p[spec::kRegKiHold] = p[spec::kRegKd] = 0;
        p[spec::kRegCtrl] = 0x10;
        p[spec::kRegBandFull] = p[spec::kRegBandOff] = 5000;
        p[spec::kRegKff] = any_size(1, 4000);
        p[spec::kRegTAmb] = in_range(spec::kRegTAmb);
        p[spec::kRegHoldMult] = in_range(spec::kRegHoldMult);
        p[spec::kRegHoldAdd] = 0;
        const chip::Algor result = computed(p, pv);
        if (result.segment_q != chip::spec::kSegPid || result.duty_q <= result.hold_q) continue;
        // The largest addition that the duty still exceeds.
        add = 10000;
        while (add >= 0) {
          p[spec::kRegHoldAdd] = add;
          if (computed(p, pv).hold_q < result.duty_q) break;
          --add;
        }
      }
      const bool trips = i % 3 != 0;
      p[spec::kRegHoldAdd] = trips ? add : std::min(add + 1, 10000);
      p[spec::kRegHoldTime] = any_size(1, 1500);
      const bool above = computed(p, pv).hold_q < computed(p, pv).duty_q;
      s_.set_temperature(pv);
      s_.command(spec::kCmdHold);
      write_range(p, spec::kRegSetpoint, spec::kRegHoldTime);
      s_.command(spec::kCmdCommit);
      s_.ticks();
      if (above) {
        expect_trip(spec::kFaultHoldPower, static_cast<std::uint64_t>(p[spec::kRegHoldTime]) + 200);
      } else {
        s_.run(static_cast<std::uint64_t>(p[spec::kRegHoldTime] + 200) * kTestTenth);
        expect_heating();
        s_.read_loop();
      }
    }
  }

  // Above the set-point by the limit or a little less; inside the window or just outside.
  void excursion() {
    s_.begin("protection: Excursion and at-temperature, right at the limit, times of any size");
    start_work();
    for (unsigned i = 0; i < often(12, 5); ++i) {
      const std::int32_t setpoint = 300 + 5 * static_cast<std::int32_t>(below(600));  // whole 1/64 degC
      heat_calmly(setpoint, 100);
      const std::int32_t over = any_size(40, 6000), time = any_size(1, 1200), dwell = any_size(1, 1200);
      const bool trips = i % 3 != 0, inside = one_in(2);
      set(spec::kRegTlmPeriod, 1);
      const std::int32_t window[] = {clamp_to(spec::kRegAtWindow, passed(over) + (inside ? 1 : 0)), dwell};
      s_.write(spec::kRegAtWindow, window);
      set(spec::kRegSetpoint, setpoint);
      s_.ticks(2);  // armed at the set-point
      const std::int32_t limit[] = {clamp_to(spec::kRegExcLimit, passed(over) + (trips ? 0 : 1)), time};
      s_.write(spec::kRegExcLimit, limit);
      s_.ticks();
      sample(to_sensor(of_tenths(setpoint) + over));
      look();
      const bool above = over * kPerTenthDegc > limit[0] * kPerSixtyFourth;
      if (above) {
        expect_trip(spec::kFaultExcursion, static_cast<std::uint64_t>(time) + 4);
      } else {
        s_.run(static_cast<std::uint64_t>(std::max(time, dwell) + 4) * kTestTenth);
        expect_heating();
        // Below the set-point by as much: at temperature or not, but no excursion.
        sample(to_sensor(of_tenths(setpoint) - over));
        s_.run(static_cast<std::uint64_t>(dwell + 4) * kTestTenth);
        expect_heating();
      }
      look();
    }
  }

  // A hot head at zero duty whose samples don't move, 20 degC above ambient or a little less.
  void frozen() {
    s_.begin("protection: SensorStale by a frozen sample, right at the limit, times of any size");
    start_work();
    for (unsigned i = 0; i < often(10, 4); ++i) {
      heat_calmly(1000, 100);
      set(spec::kRegMode, 1);
      const std::int32_t ambient = in_range(spec::kRegTAmb), time = any_size(1, 1500);
      const bool trips = i % 3 != 0;
      const std::int32_t hot = (ambient + 200) * kPerSixtyFourth / kPerTenthDegc;
      const std::int16_t pv = to_sensor(trips ? hot + 1 : hot - 1);
      const bool active = pv * kPerTenthDegc > (ambient + 200) * kPerSixtyFourth;
      sample(pv);
      set(spec::kRegTAmb, ambient);
      s_.ticks(2);
      set(spec::kRegLbaTime, time);
      s_.ticks();
      if (active) {
        expect_trip(spec::kFaultSensorStale, static_cast<std::uint64_t>(time) + 4);
      } else {
        s_.run(static_cast<std::uint64_t>(time + 4) * kTestTenth);
        expect_heating();
      }
    }
  }

  // The first sample behind SAMPLE_TIMEOUT or in time.
  void stale() {
    s_.begin("protection: SensorStale, times of any size");
    start_work();
    for (unsigned i = 0; i < often(10, 4); ++i) {
      heat_calmly(1000, 60);
      const std::int32_t ts = any_size(60, 1500);
      const bool trips = i % 2 == 0;
      const std::int32_t values[] = {ts};
      s_.write(spec::kRegTs, values);
      set(spec::kRegSampleTimeout, trips ? ts - 3 : ts + 3);
      s_.ticks(2);
      if (trips) {
        if (faults() != bit(spec::kFaultSensorStale)) s_.fail("no stale sample");
      } else {
        expect_heating();
      }
      s_.read_loop();
      set(spec::kRegSampleTimeout, kTopTime);
      s_.ticks();
    }
  }

  // Telemetry shows the time left; the heater goes off with the last tenth.
  void host_watchdog() {
    s_.begin("protection: HostWatchdog, times of any size");
    start_work();
    for (unsigned i = 0; i < often(8, 4); ++i) {
      heat_calmly(1000, 90);
      set(spec::kRegTlmPeriod, 1);
      const std::int32_t time = any_size(500, 3000);
      set(spec::kRegHostWd, time);
      s_.run(static_cast<std::uint64_t>(time) * 3 / 4 * kTestTenth);
      expect_heating();
      s_.ask(tb::diagnostic_echo(s_.address(), 0x5A5A));
      s_.run(static_cast<std::uint64_t>(time) * 3 / 4 * kTestTenth);
      expect_heating();
      expect_trip(spec::kFaultHostWatchdog, static_cast<std::uint64_t>(time));
      s_.command(spec::kCmdClearFault);
    }
  }

  // The switch stays on for as long as FB_TIME, or a clock less.
  void heater_feedback() {
    s_.begin("protection: HeaterFb, times of any size");
    start_work();
    set(spec::kRegCtrl, 0x37);
    s_.ticks(2);
    for (unsigned i = 0; i < often(10, 4); ++i) {
      constexpr std::uint64_t kFeedbackStep = 16;  // clocks
      const std::int32_t time = i == 0 ? (quick_ ? 5000 : 40000) : any_size(1, 3000);
      set(spec::kRegFbTime, time);
      s_.ticks(2);
      for (const std::uint64_t clocks : {kFeedbackStep * static_cast<std::uint64_t>(time) - 1,
                                         kFeedbackStep * static_cast<std::uint64_t>(time) + 1}) {
        s_.hold_feedback(true);
        s_.run(clocks);
        s_.free_feedback();
        s_.run(20);
      }
      if (faults() != bit(spec::kFaultHeaterFb)) s_.fail("HeaterFb did not trip");
      s_.read_loop();
      s_.command(spec::kCmdClearFault);
    }
    set(spec::kRegCtrl, 0x17);
  }

  // The other causes: emergency stop, a control period too short for its work, a rise at zero duty while
  // heating.
  void other_faults() {
    s_.begin("protection: Inhibit, State, ZeroRise");
    start_work();
    heat();
    s_.set_inhibit(true);
    s_.run(1000);
    s_.refused(write_request(spec::kRegCmd, spec::kCmdClearFault), 4);
    s_.refused(write_request(spec::kRegCmd, spec::kCmdRun), 4);
    s_.set_inhibit(false);
    s_.run(100);
    look();
    heat_calmly(500, 10);
    set(spec::kRegSpiDiv, 255);
    expect_trip(spec::kFaultState, 2000);
    for (unsigned i = 0; i < often(6, 2); ++i) {
      heat_calmly(500, 100);
      set(spec::kRegMode, 1);
      set(spec::kRegManualDuty, 100);  // starts the time at zero duty again
      s_.ticks(2);
      set(spec::kRegManualDuty, 0);
      s_.ticks(2);
      const std::int32_t rise = any_size(40, 8000);
      const std::int32_t values[] = {clamp_to(spec::kRegZeroRise, reached(rise)), any_size(1, 400)};
      s_.write(spec::kRegZeroRise, values);
      s_.run(static_cast<std::uint64_t>(values[1] + 200) * kTestTenth);
      expect_heating();
      sample(to_sensor(of_tenths(500) + rise - 7));
      expect_heating();
      sample(to_sensor(of_tenths(500) + rise));
      expect_trip(spec::kFaultZeroRise, 200);
    }
  }

  // Detectors with limits and temperatures of any size; which of them trips is left to chance.
  void limits_of_any_size() {
    s_.begin("protection: limits of any size");
    start_work();
    for (unsigned i = 0; i < often(10, 8); ++i) {
      Parameters p = calm();
      p[spec::kRegTs] = 60;
      p[spec::kRegSetpoint] = static_cast<std::int32_t>(below(kSetpointTop));
      p[spec::kRegAtWindow] = in_range(spec::kRegAtWindow);
      p[spec::kRegAtDwell] = below(2) != 0 ? 0 : in_range(spec::kRegAtDwell);
      p[spec::kRegMode] = one_in(4) ? 1 : 0;
      p[spec::kRegManualDuty] = one_in(2) ? 0 : 10000;
      for (std::uint16_t reg = spec::kRegTMax; reg <= spec::kRegSampleTimeout; ++reg) {
        if (one_in(2)) p[reg] = in_range(reg);
      }
      p[spec::kRegTMax] = std::max<std::int32_t>(p[spec::kRegTMax], p[spec::kRegSetpoint] + 50);
      p[spec::kRegHostWd] = in_range(spec::kRegHostWd);
      write_all(calm());
      s_.set_temperature(any_temperature(-390, 4900));
      s_.ticks(2);
      if (causes() == 0) {
        s_.command(spec::kCmdClearFault);
        s_.command(spec::kCmdRun);
      }
      write_range(p, spec::kRegSetpoint, spec::kRegHoldMult);
      write_range(p, spec::kRegHoldAdd, spec::kRegSampleTimeout);
      for (unsigned n = 0; n < 4; ++n) {
        sample(any_temperature(-390, 4900));
        s_.read_loop();
      }
      look();
    }
    write_all(now_ = calm());
  }

  void protection() {
    limits_of_temperature();
    bad_samples();
    not_heating();
    hold_power();
    excursion();
    frozen();
    stale();
    host_watchdog();
    heater_feedback();
    other_faults();
    limits_of_any_size();
  }

  std::uint64_t long_time() const { return std::uint64_t{quick_ ? 3000U : 58000U} * kTestTenth; }

  // Counts of 0.1 s, as many at a time as can be.
  void count_while_heating() {
    start_work();
    heat_calmly(1000, 2000);
    Parameters p = now_;
    p[spec::kRegSetpoint] = 1500;
    p[spec::kRegBandFull] = p[spec::kRegBandOff] = 5000;
    p[spec::kRegCtrl] = 0x10;
    p[spec::kRegKp] = 0;
    p[spec::kRegKiApproach] = p[spec::kRegKiHold] = kTopTime;
    p[spec::kRegKd] = 0;
    p[spec::kRegKff] = 1;
    p[spec::kRegHoldMult] = p[spec::kRegHoldAdd] = 0;
    p[spec::kRegTlmPeriod] = 1;
    write_range(p, spec::kRegSetpoint, spec::kRegHoldAdd);
    s_.ticks(3);  // the integral is at its top, and stays there
    p[spec::kRegKiApproach] = p[spec::kRegKiHold] = 0;
    p[spec::kRegSetpoint] = 1000;
    p[spec::kRegAtWindow] = 1000;
    p[spec::kRegAtDwell] = kTopTime;
    p[spec::kRegExcLimit] = 10;
    p[spec::kRegExcTime] = p[spec::kRegHoldTime] = kTopTime;
    p[spec::kRegHostWd] = kTopTime;
    write_range(p, spec::kRegSetpoint, spec::kRegHoldTime);
    s_.ticks(2);
    s_.set_temperature(of_tenths(1050));
    now_ = p;
    s_.run(long_time());
    expect_heating();
  }

  // To their top; telemetry shows the time left of the watchdog.
  void long_heating() {
    s_.begin("long times: hold power, excursion, at-temperature, watchdog");
    count_while_heating();
    look();
    s_.ticks();
    look();
    if (!quick_) {
      constexpr std::uint64_t kToTheTop = 10000;  // 0.1 s
      for (std::uint64_t i = 0; i < kToTheTop && heating(); ++i) s_.run(kTestTenth);
      if (heating()) s_.fail("no detector tripped at its top");
    }
    look();
  }

  void long_heating_limits() {
    s_.begin("long times: the limits of hold power and excursion fall below their counts");
    count_while_heating();
    look();                                                // the watchdog begins anew
    const std::uint16_t all_high = quick_ ? 3072 : 61440;  // bits that the limits then don't have
    while (heating() && s_.chip().guard.exc_q < all_high) s_.run(kTestTenth);
    expect_heating();
    now_[spec::kRegExcTime] = now_[spec::kRegHoldTime] = 1;
    write_range(now_, spec::kRegExcTime, spec::kRegHoldTime);
    s_.ticks();
    if (faults() != (bit(spec::kFaultExcursion) | bit(spec::kFaultHoldPower)))
      s_.fail("found faults " + std::to_string(faults()) + ", expected Excursion and HoldPower");
    look();
  }

  void long_zero_duty() {
    s_.begin("long times: rise at zero duty, frozen sample, telemetry");
    start_work();
    heat_calmly(1000, 10);
    set(spec::kRegMode, 1);
    set(spec::kRegLbaTime, kTopTime);
    set(spec::kRegZeroWait, kTopTime);
    set(spec::kRegZeroRise, 80);
    set(spec::kRegTlmPeriod, 43690);
    s_.ticks();
    s_.run(long_time());
    expect_heating();
    look();
    set(spec::kRegZeroWait, 0);  // below its count: nothing has risen
    s_.ticks();
    expect_heating();
    set(spec::kRegLbaTime, 1);
    s_.ticks();
    if (faults() != bit(spec::kFaultSensorStale)) s_.fail("a frozen sample did not trip");
    look();
  }

  void long_full_duty() {
    s_.begin("long times: full duty without a rise, its limit moved ahead of the count");
    start_work();
    heat_calmly(1000, 60);
    set(spec::kRegCtrl, 0x10);
    set(spec::kRegBandFull, 0);
    set(spec::kRegLbaRise, 20);
    set(spec::kRegSetpoint, kSetpointTop);
    s_.ticks(2);
    set(spec::kRegLbaTime, kTopTime);
    const std::int32_t top = quick_ ? 1500 : 33000;
    for (std::int32_t count = s_.chip().guard.lba_q; count < top; count = s_.chip().guard.lba_q) {
      set(spec::kRegLbaTime, clamp_to(spec::kRegLbaTime, count + 2000 + any_size(0, 30000)));
      s_.run(1000 * kTestTenth);
      expect_heating();
    }
    set(spec::kRegLbaTime, s_.chip().guard.lba_q + 1500);
    expect_trip(spec::kFaultNotHeating, 1700);
  }

  // Nothing latches with the heater off, so limits may be anywhere.
  void long_without_samples() {
    s_.begin("long times: no good sample, rise at zero duty, limits on either side");
    start_work();
    set(spec::kRegTs, 10);
    set(spec::kRegZeroWait, kTopTime);
    s_.ticks(2);
    s_.sensor().set(0xFFFF, 16, 0);
    constexpr unsigned kLooks = 60;
    for (unsigned i = 0; i < kLooks; ++i) {
      s_.run(long_time() / kLooks);
      const std::int32_t near = s_.chip().guard.stale_q + (one_in(2) ? 1 : -1) * any_size(1, 3000);
      const std::int32_t limit = clamp_to(spec::kRegSampleTimeout, near);
      set(spec::kRegSampleTimeout, limit);
      s_.ticks(2);
      expect_cause(spec::kFaultSensorStale, s_.chip().guard.stale_q >= limit);
      s_.read_loop();
    }
    write_all(now_ = calm());
    sample(of_tenths(1000));
  }

  void long_times() {
    long_heating();
    long_heating_limits();
    long_zero_duty();
    long_full_duty();
    long_without_samples();
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
      s_.reset();
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
