// SPDX-License-Identifier: Apache-2.0
// Pieces of the functional set: reset, identity, both time bases, every block at work once.
#include "asic/signoff/piece_steps.hpp"

namespace meltstage::app {

namespace {

class StartPieces : private PieceSteps {
 public:
  explicit StartPieces(PieceState& state) : PieceSteps(state) {}

  void record() {
    reset_and_identity();
    real_time();
    at_work();
  }

  void record_reset() { reset_in_operation(); }

 private:
  void reset_and_identity() {
    begin("reset, address straps, identification");
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
    begin("time base in operation: control period, 0.1 s, ramp");
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
    begin("closed loop at work: every block, briefly");
    start_work();
    set(spec::kRegTs, 200);
    set(spec::kRegTlmPeriod, 1);
    set(spec::kRegMode, kManual);
    struct Pulse {
      std::int32_t duty, ctrl, prescale, period, least;
    };
    for (const Pulse& to : {Pulse{3333, kCalmCtrl, 0, 701, 0}, Pulse{9876, kCalmCtrl & ~kDither, 2, 300, 20},
                            Pulse{50, kCalmCtrl, 0, 90, 7}, Pulse{6543, kCalmCtrl, 5, 2, 0},
                            Pulse{10000, kCalmCtrl, 0, 97, 0}}) {
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

  void reset_in_operation() {
    begin("reset in operation");
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
};

}  // namespace

void record_start(PieceState& state) { StartPieces(state).record(); }

void record_reset(PieceState& state) { StartPieces(state).record_reset(); }

}  // namespace meltstage::app
