// SPDX-License-Identifier: Apache-2.0
// What the pieces of the functional set share: random values of useful sizes, and steps of a host that works
// with the chip.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <string>

#include "asic/signoff/functional_session.hpp"
#include "base/rng.hpp"
#include "cmodel/spec.hpp"

namespace meltstage::app {

namespace spec = chip::spec;

using Parameters = std::array<std::int32_t, spec::kHoldingCount>;

inline constexpr std::uint16_t kFastBaud = 5000;
inline constexpr std::uint16_t kTopTime = 65535;     // registers of time, 0.1 s
inline constexpr std::uint16_t kSetpointTop = 4950;  // T_MAX at its top less the margin
inline constexpr std::uint16_t kManual = spec::word_of({spec::kModeManual});
inline constexpr std::uint16_t kDither = spec::word_of({spec::kCtrlDither});
// CTRL as it is after reset, but for the check of the feedback.
inline constexpr std::uint16_t kCalmCtrl =
    spec::word_of({spec::kCtrlSegModel, spec::kCtrlDOnPv, spec::kCtrlFfEn, spec::kCtrlDither});
inline constexpr std::int32_t kPerTenthDegc = 5;  // 1/320 degC
inline constexpr std::int32_t kPerSixtyFourth = 32;

inline std::int16_t of_tenths(std::int32_t tenths) {
  return static_cast<std::int16_t>(tenths * kPerSixtyFourth / kPerTenthDegc);
}

// Nothing trips, the sensor is a plain 16-bit word in 1/64 degC, control periods and frames are the shortest.
Parameters calm();

// What goes on from piece to piece.
struct PieceState {
  bool quick;
  Rng random = stream(kFunctionalSeed, "");
  FunctionalSession session{};
  Parameters now = calm();  // values of the registers, as far as the pieces keep account of them
};

class PieceSteps {
 protected:
  explicit PieceSteps(PieceState& state)
      : s_(state.session), now_(state.now), quick_(state.quick), random_(state.random) {}

  // A piece draws from a stream of its own, so that what others draw is nothing to it.
  void begin(const std::string& requirement) {
    s_.begin(requirement);
    random_ = stream(kFunctionalSeed, requirement);
  }

  std::uint32_t below(std::uint32_t n) { return static_cast<std::uint32_t>(random_.below(n)); }
  bool one_in(std::uint32_t n) { return below(n) == 0; }
  // Of any magnitude with the same chance: small values as often as large ones.
  std::int32_t any_size(std::int32_t least, std::int32_t most) {
    const std::uint32_t span = static_cast<std::uint32_t>(most - least) + 1;
    unsigned bits = 0;
    while (bits < 32 && (span - 1) >> bits != 0) ++bits;
    const std::uint32_t value = static_cast<std::uint32_t>(random_.bits()) >> (32 - bits) >> below(bits);
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

  // Registers first..last but LOCK and the line's own.
  void write_range(const Parameters& p, std::uint16_t first, std::uint16_t last) {
    constexpr std::uint16_t kMost = spec::kWriteWords;
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
                     .hold_test = false,
                     .tuning = false,
                     .tune_duty = 0,
                     .tune_hold = 0};
    do {
      algor.step(in);
      in.start = false;
    } while (algor.done_q == 0);
    return algor;
  }

  tb::ModbusRequest write_request(std::uint16_t reg, std::int32_t value) const {
    return tb::write_single_register(s_.address(), static_cast<std::uint16_t>(spec::kHoldingBase + reg),
                                     static_cast<std::uint16_t>(value));
  }

  FunctionalSession& s_;
  Parameters& now_;
  const bool quick_;
  Rng& random_;
};

// The pieces by subject, each call those of one file. They follow each other as functional_set() has them.
void record_start(PieceState& state);
void record_registers(PieceState& state);
void record_commits(PieceState& state);
void record_line(PieceState& state);
void record_control(PieceState& state);
void record_tuning(PieceState& state);
void record_pulses(PieceState& state);
void record_protection(PieceState& state);
void record_long_times(PieceState& state);
void record_reset(PieceState& state);

}  // namespace meltstage::app
