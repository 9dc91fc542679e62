// SPDX-License-Identifier: Apache-2.0
// Upset flops: a slice of `meltstage bench upset`, the flops whose upset would last, and the same upsets in
// the RTL.
#include "tb/trials/upset.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <string>
#include <tuple>
#include <utility>

#include "base/rng.hpp"
#include "cmodel/advance.hpp"
#include "tb/lockstep/lockstep.hpp"
#include "tb/lockstep/verilated_rtl.hpp"
#include "tb/pins/head.hpp"

namespace meltstage::tb {
namespace {

namespace spec = chip::spec;

std::size_t number_of(std::string_view block, std::string_view name, unsigned word, unsigned bit) {
  const auto& all = flop_bits();
  const auto at = std::find_if(all.begin(), all.end(), [&](const FlopBit& f) {
    return f.block == block && f.name == name && f.word == word && f.bit == bit;
  });
  if (at == all.end())
    throw std::logic_error(fmt::format("no flop {}.{}[{}] bit {}", block, name, word, bit));
  return static_cast<std::size_t>(at - all.begin());
}

std::string describe(const FlopBit& f) {
  return fmt::format("{}.{}[{}] bit {}", f.block, f.name, f.word, f.bit);
}

TEST(FlopBits, EachIsInvertedAlone) {
  EXPECT_GT(flop_bits().size(), 4000u);
  chip::Chip chip;
  const chip::Chip sound;
  for (std::size_t i = 0; i < flop_bits().size(); ++i) {
    invert_flop_bit(chip, i);
    EXPECT_TRUE(different(chip, sound)) << describe(flop_bits()[i]);
    invert_flop_bit(chip, i);
    EXPECT_FALSE(different(chip, sound)) << describe(flop_bits()[i]);
  }
}

TEST(Upset, NoneLeavesTheHeaterOutsideItsSpecification) {
  std::map<UpsetOutcome, unsigned> outcomes;
  Rng rng = stream(11, "upset slice");
  for (const UpsetPhase phase : kUpsetPhases) {
    const UpsetStudy study(phase, rng.below(2) == 0 ? UpsetPwm::fast : UpsetPwm::slow);
    for (std::size_t i = rng.below(60); i < flop_bits().size(); i += 60) {
      const auto result = study.strike({{i}, rng.uniform() * UpsetStudy::kTick_s});
      EXPECT_NE(result.outcome, UpsetOutcome::outside)
          << upset_phase_name(phase) << ", " << describe(flop_bits()[i]) << ", excess " << result.excess_s
          << " s";
      ++outcomes[result.outcome];
    }
  }
  EXPECT_GT(outcomes[UpsetOutcome::corrected], 0u);
  EXPECT_GT(outcomes[UpsetOutcome::stopped], 0u);
}

// Flops that hold for longer than a control tick what the heater does.
TEST(Upset, WhatWouldLastIsSeenAtOnce) {
  const UpsetStudy study(UpsetPhase::hold, UpsetPwm::fast);
  for (const auto& [block, name, bits] : {std::tuple{"algor", "i_q", 32u},
                                          {"algor", "filt_q", 22u},
                                          {"algor", "sp_work_q", 16u},
                                          {"pwmc", "prescale_q", 16u},
                                          {"pwmc", "period_q", 16u},
                                          {"pwmc", "high_q", 16u},
                                          {"pwmc", "acc_q", 32u}}) {
    for (unsigned b = 1; b < bits; b += 5) {
      const auto result = study.strike({{number_of(block, name, 0, b)}, 0.0501});
      EXPECT_EQ(result.outcome, UpsetOutcome::stopped) << block << "." << name << " bit " << b;
      EXPECT_EQ(result.faults, 1u << spec::kFaultState) << block << "." << name << " bit " << b;
    }
  }
}

TEST(Upset, OfTheRelayIsSeenAtOnce) {
  const UpsetStudy study(UpsetPhase::tuning, UpsetPwm::fast);
  ASSERT_TRUE(study.start().atune.tuning());
  ASSERT_LT(study.start().atune.duty(), study.start().atune.hold_q);  // at its lower level
  for (const auto& [name, bits] :
       {std::tuple{"phase_q", 3u}, {"on_q", 1u}, {"duty_on_q", 17u}, {"duty_off_q", 17u}, {"hold_q", 17u}}) {
    for (unsigned b = 0; b < bits; ++b) {
      const auto result = study.strike({{number_of("atune", name, 0, b)}, 0.0501});
      EXPECT_EQ(result.outcome, UpsetOutcome::stopped) << name << " bit " << b;
      EXPECT_EQ(result.faults, 1u << spec::kFaultState) << name << " bit " << b;
    }
  }
}

TEST(Upset, OfPwmSettingsAndControlPeriodChangesNothing) {
  const UpsetStudy study(UpsetPhase::hold, UpsetPwm::fast);
  for (const spec::Reg reg : {spec::kRegPwmPrescale, spec::kRegPwmPeriod, spec::kRegTs}) {
    for (unsigned b = 0; b < 22; b += 3) {
      if ((spec::kHolding[reg].stored >> b & 1) == 0) continue;
      const auto result = study.strike({{number_of("mem", "active_q", reg, b)}, 0.0501});
      EXPECT_EQ(result.outcome, UpsetOutcome::corrected) << spec::kHolding[reg].name << " bit " << b;
    }
  }
}

// Single upsets of the permission, stopped: no heat, and the fault says so.
TEST(Upset, OfThePermissionGivesNoHeat) {
  for (const UpsetPhase phase : {UpsetPhase::stopped, UpsetPhase::faulted}) {
    const UpsetStudy study(phase, UpsetPwm::fast);
    for (const char* name : {"run_q", "run_nq"}) {
      const auto result = study.strike({{number_of("guard", name, 0, 0)}, 0.0501});
      EXPECT_NE(result.outcome, UpsetOutcome::outside) << name;
      EXPECT_NE(result.faults & (1u << spec::kFaultState), 0) << name;
    }
    EXPECT_NE(study.strike({{number_of("paramc", "run_q", 0, 0)}, 0.0501}).outcome, UpsetOutcome::outside);
  }
}

// A command's pulse without its word: no relay experiment begins in a heated job.
TEST(Upset, OfACommandsPulseChangesNothing) {
  for (const UpsetPwm pwm : {UpsetPwm::fast, UpsetPwm::slow}) {
    const UpsetStudy study(UpsetPhase::hold, pwm);
    for (const char* name : {"run_q", "tune_q"})
      EXPECT_EQ(study.strike({{number_of("paramc", name, 0, 0)}, 0.0501}).outcome, UpsetOutcome::no_effect)
          << name;
  }
}

// The study can find what it looks for: two flips at once pass the parity, and the heater stays on for
// seconds.
TEST(UpsetControl, ADoubleFlipIsFoundOutside) {
  const UpsetStudy hold(UpsetPhase::hold, UpsetPwm::fast);
  bool found = false;  // in the high part of a PWM period
  for (int i = 0; i < 10; ++i) {
    const auto result =
        hold.strike({{number_of("pwmc", "prescale_q", 0, 12), number_of("pwmc", "prescale_q", 0, 13)},
                     0.05 + 1.3e-4 * i});
    found = found || result.outcome == UpsetOutcome::outside;
  }
  EXPECT_TRUE(found);
  const UpsetStudy stopped(UpsetPhase::stopped, UpsetPwm::fast);
  EXPECT_EQ(stopped.strike({{number_of("guard", "run_q", 0, 0), number_of("guard", "run_nq", 0, 0)}, 0.0501})
                .outcome,
            UpsetOutcome::outside);
}

// The RTL goes on from the same upset as the model does, flop by flop.
TEST(Upset, RtlAgrees) {
  constexpr std::uint64_t kBefore = 400;
  constexpr std::uint64_t kAfter = 12'000;
  Rng rng = stream(5, "upset in RTL");
  const UpsetStudy study(UpsetPhase::hold, UpsetPwm::fast);
  for (int i = 0; i < 60; ++i) {
    const auto flop = static_cast<std::size_t>(rng.below(flop_bits().size()));
    Head head({.sensor_noise_degc = 0.0});
    head.host().submit(read_input_registers(1, 0, 16));
    chip::Run run{.chip = study.start(), .out = study.start().outputs({}), .cycle = 0};
    chip::Inputs in;
    chip::step_until(run, kBefore + rng.below(20'000), head,
                     [&](std::uint64_t, const chip::Inputs& now, const chip::Outputs&) { in = now; });
    invert_flop_bit(run.chip, flop);
    auto rtl = make_verilated_rtl();
    rtl->set_assertions(false);
    rtl->load(run.chip, in);
    Lockstep lockstep(std::move(rtl), run.chip, run.cycle,
                      {.test = "upset", .seed = flop, .repeat_command = ""}, "");
    chip::Outputs out = run.chip.outputs(in);
    ASSERT_NO_THROW(for (std::uint64_t end = run.cycle + kAfter; run.cycle < end; ++run.cycle) out =
                        lockstep.step(head.step(run.cycle, out)))
        << describe(flop_bits()[flop]);
  }
}

}  // namespace
}  // namespace meltstage::tb
