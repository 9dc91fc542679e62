// SPDX-License-Identifier: Apache-2.0
// What the pieces on protection and on long times share.
#pragma once

#include <fmt/format.h>

#include "asic/signoff/piece_steps.hpp"

namespace meltstage::app {

class ProtectionSteps : protected PieceSteps {
 protected:
  using PieceSteps::PieceSteps;

  static std::uint16_t bit(unsigned fault) { return static_cast<std::uint16_t>(1U << fault); }
  std::uint16_t causes() const { return s_.chip().guard.cause_q; }
  std::uint16_t faults() const { return s_.chip().guard.fault_q; }
  void expect_cause(unsigned fault, bool present) {
    if (((causes() & bit(fault)) != 0) != present)
      s_.fail(std::string(spec::kFaults[fault].name) + (present ? ": found no cause" : ": found a cause"));
  }
  // HoldPower's test begins within this time.
  void await_test(std::uint64_t tenths) {
    const auto begun = [&] { return s_.chip().guard.hold_test_q != 0; };
    for (std::uint64_t i = 0; i <= tenths && !begun(); ++i) s_.run(kTestTenth);
    if (!begun()) s_.fail("found none, expected HoldPower's test");
  }
  // The fault comes within this time, and no other before it.
  void expect_trip(unsigned fault, std::uint64_t tenths) {
    for (std::uint64_t i = 0; i <= tenths && faults() == 0; ++i) s_.run(kTestTenth);
    if (faults() != bit(fault))
      s_.fail(
          fmt::format("{} did not trip alone, found faults {:#06x}", spec::kFaults[fault].name, faults()));
    s_.read_loop();
  }
  void expect_heating() {
    if (!heating() || faults() != 0) s_.fail(fmt::format("found faults {:#06x}, expected none", faults()));
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

  // On until GUARD's means of reading and duty are there.
  void await_means() {
    const auto there = [&] {
      const chip::Guard& guard = s_.chip().guard;
      return guard.mean_temp() == guard.pv_q && guard.duty_sum_q >> 4 == s_.chip().algor.duty_q;
    };
    while (faults() == 0 && !there()) s_.ticks();
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
};

}  // namespace meltstage::app
