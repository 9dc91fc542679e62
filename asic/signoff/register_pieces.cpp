// SPDX-License-Identifier: Apache-2.0
// Pieces of the functional set: registers, staged and active, and their commits.
#include "asic/signoff/piece_steps.hpp"

namespace meltstage::app {

namespace {

class RegisterPieces : private PieceSteps {
 public:
  explicit RegisterPieces(PieceState& state) : PieceSteps(state) {}

  void record() { registers(); }

  void record_commits() { commits(); }

 private:
  // Staged and active words take a value, its complement, and one in which two bits differ; Discard copies
  // the active words back to be read.
  void registers() {
    begin("registers: staged and active, both values of every bit");
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

    begin("registers: hold, commit, discard, lock");
    s_.command(spec::kCmdHold);
    for (const std::int32_t ts : {2000, 1365, 682, 10}) s_.write(spec::kRegTs, ts);
    for (const std::int32_t baud : {4095, 2730, 1365}) {
      s_.write(spec::kRegBaud, baud);
      s_.write(spec::kRegAddress, baud & 0xFF & 247);
      s_.write(spec::kRegFormat, baud & spec::kHolding[spec::kRegFormat].max);
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
    s_.refused(write_request(spec::kRegKiHold, 1), spec::kExcBusy);
    s_.ticks();
    s_.read_holding();
    for (const std::int32_t lock : {0x5555, 0xAAAA}) {
      s_.write(spec::kRegLock, lock);
      s_.ticks();
      s_.refused(write_request(spec::kRegKp, 1), spec::kExcDevice);
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
    begin("registers: commits of any two words");
    s_.reset();
    s_.write(spec::kRegTs, calm()[spec::kRegTs]);
    s_.write(spec::kRegBaud, kFastBaud);
    s_.ticks();
    s_.set_line(kFastBaud, 0, s_.address());
    for (unsigned round = 0; round < often(400, 4); ++round) {
      const auto few_bits = [&](spec::Reg reg) {
        return spec::kHolding[reg].reset ^
               static_cast<std::int32_t>(random_.bits() & random_.bits() & 0xFFFF);
      };
      s_.write(spec::kRegKp, std::array{few_bits(spec::kRegKp), few_bits(spec::kRegKiApproach)});
      s_.ticks();
    }
    s_.read_holding();
  }
};

}  // namespace

void record_registers(PieceState& state) { RegisterPieces(state).record(); }

void record_commits(PieceState& state) { RegisterPieces(state).record_commits(); }

}  // namespace meltstage::app
