// SPDX-License-Identifier: Apache-2.0
// quiet() and skip() of each block against step(), from any flops and any inputs: in the whole chip a block
// is skipped only while all others are quiet too, which few states are in which it is about to act.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "base/rng.hpp"
#include "cmodel/chip.hpp"
#include "tb/stimulus/any_skip.hpp"
#include "tb/stimulus/any_state.hpp"

namespace meltstage::tb {
namespace {

namespace spec = chip::spec;

constexpr std::uint64_t kTrials = 60'000;

const Moments& moments() {
  static const Moments list(3, kMomentSeeds, kMomentClocks);
  return list;
}

// A chip most of whose blocks have changed flops; it need not be sound, as each block is looked at alone.
chip::Chip any_chip(Rng& rng) {
  for (;;) {
    Moment moment = any_moment(rng, moments());
    for (int changes = 0; changes < 8; ++changes) change_one_block(rng, moments(), moment);
    if (holds_invariants(moment.chip)) return moment.chip;
  }
}

// Inputs that would stir a block are rare among those it is given.
bool rarely(Rng& rng) { return rng.below(16) == 0; }
bool either(Rng& rng) { return rng.below(2) == 0; }

// `step(chip, clock)` steps one block of the chip, `skip(chip, clocks)` skips it.
class SkipTrial {
 public:
  template <class Step, class Skip>
  void compare(Rng& rng, const chip::Chip& chip, std::uint64_t quiet, const Step& step, const Skip& skip) {
    if (quiet == 0) return;
    const std::uint64_t part = part_of(rng, quiet);
    chip::Chip stepped = chip, leapt = chip;
    for (std::uint64_t clock = 0; clock < part; ++clock) step(stepped, clock);
    skip(leapt, part);
    ASSERT_EQ(list_differences(stepped, leapt), "") << part << " clocks of " << quiet << " from\n"
                                                    << list_differences(chip::Chip{}, chip);
    ++skipped_;
    whole_ += part == quiet;
  }

  ~SkipTrial() {
    testing::Test::RecordProperty("skipped", static_cast<int>(skipped_));
    testing::Test::RecordProperty("whole", static_cast<int>(whole_));
    EXPECT_GT(skipped_, kTrials / 100);
  }

 private:
  std::uint64_t skipped_ = 0, whole_ = 0;
};

constexpr auto kNothing = [](chip::Chip&, std::uint64_t) {};

// Runs `body(rng, chip, trial)` on any chips until one of them fails.
template <class Body>
void for_any_chip(std::string_view name, const Body& body) {
  SkipTrial trial;
  for (std::uint64_t number = 0; number < kTrials && !testing::Test::HasFatalFailure(); ++number) {
    Rng rng = stream(number, name);
    const chip::Chip chip = any_chip(rng);
    SCOPED_TRACE(fmt::format("trial {}", number));
    body(rng, chip, trial);
  }
}

TEST(BlockSkip, Algor) {
  for_any_chip("skip algor", [](Rng& rng, const chip::Chip& chip, SkipTrial& trial) {
    const chip::AlgorIn in{.params = chip.params(),
                           .start = rarely(rng),
                           .sample_ok = either(rng),
                           .run = either(rng),
                           .at_temp = either(rng),
                           .ms = false,  // the chip asks ramps() and stops before it
                           .pv = chip.guard.pv_q,
                           .drop = either(rng),
                           .hold_test = either(rng),
                           .tuning = either(rng),
                           .tune_duty = chip.atune.duty(),
                           .tune_hold = chip.atune.hold_q};
    const auto step = [&](chip::Chip& c, std::uint64_t) { c.algor.step(in); };
    trial.compare(rng, chip, chip.algor.quiet(in), step, kNothing);
  });
}

TEST(BlockSkip, Atune) {
  for_any_chip("skip atune", [](Rng& rng, const chip::Chip& chip, SkipTrial& trial) {
    const chip::AtuneIn in{.tune = rarely(rng),
                           .run = !rarely(rng),
                           .sample = rarely(rng),
                           .tenth = rarely(rng),
                           .commit = rarely(rng),
                           .pv = chip.guard.pv_q,
                           .sp_work = chip.algor.sp_work_q,
                           .amb = chip.algor.amb_q,
                           .ramping = either(rng),
                           .duty_max = chip.algor.duty_max_q,
                           .window = chip.params()[chip::spec::kRegAtWindow]};
    const auto step = [&](chip::Chip& c, std::uint64_t) { c.atune.step(in); };
    trial.compare(rng, chip, chip.atune.quiet(in), step, kNothing);
  });
}

TEST(BlockSkip, Quality) {
  for_any_chip("skip quality", [](Rng& rng, const chip::Chip& chip, SkipTrial& trial) {
    const chip::QualityIn in{.run = either(rng),
                             .sample = rarely(rng),
                             .tenth = rarely(rng),
                             .pv = chip.guard.pv_q,
                             .target = chip.algor.target_q,
                             .window = chip.params()[spec::kRegAtWindow],
                             .at_temp = either(rng),
                             .heater = either(rng)};
    const auto step = [&](chip::Chip& c, std::uint64_t) { c.quality.step(in); };
    const auto skip = [&](chip::Chip& c, std::uint64_t clocks) { c.quality.skip(in, clocks); };
    trial.compare(rng, chip, chip.quality.quiet(in), step, skip);
  });
}

TEST(BlockSkip, Pwmc) {
  for_any_chip("skip pwmc", [](Rng& rng, const chip::Chip& chip, SkipTrial& trial) {
    const chip::PwmcIn in{.prescale = chip.params()[spec::kRegPwmPrescale],
                          .period = either(rng) ? chip.pwmc.mul_period_q : chip.params()[spec::kRegPwmPeriod],
                          .min_on = chip.params()[spec::kRegPwmMinOn],
                          .dither = either(rng),
                          .enable = !rarely(rng),
                          .duty = chip.algor.duty_q,
                          .load = rarely(rng)};
    const auto step = [&](chip::Chip& c, std::uint64_t) { c.pwmc.step(in); };
    const auto skip = [](chip::Chip& c, std::uint64_t clocks) { c.pwmc.skip(clocks); };
    trial.compare(rng, chip, chip.pwmc.quiet(in), step, skip);
  });
}

TEST(BlockSkip, Sensc) {
  for_any_chip("skip sensc", [](Rng& rng, const chip::Chip& chip, SkipTrial& trial) {
    const chip::SenscIn in{
        .params = chip.params(), .start = rarely(rng), .reconfig = rarely(rng), .miso = either(rng)};
    const auto step = [&](chip::Chip& c, std::uint64_t) { c.sensc.step(in); };
    const auto skip = [](chip::Chip& c, std::uint64_t clocks) { c.sensc.skip(clocks); };
    trial.compare(rng, chip, chip.sensc.quiet(in), step, skip);
  });
}

TEST(BlockSkip, Sysctrl) {
  for_any_chip("skip sysctrl", [](Rng& rng, const chip::Chip& chip, SkipTrial& trial) {
    const chip::SysctrlIn in{.test_mode = either(rng),
                             .ts = chip.params()[spec::kRegTs],
                             .tlm_period = chip.params()[spec::kRegTlmPeriod],
                             .cmd_valid = rarely(rng),
                             .decoded = rarely(rng),
                             .writes = rarely(rng),
                             .last = rarely(rng),
                             .pending = rarely(rng),
                             .discarding = rarely(rng),
                             .sens_done = rarely(rng),
                             .algor_done = rarely(rng)};
    const auto step = [&](chip::Chip& c, std::uint64_t) { c.sysctrl.step(in); };
    const auto skip = [&](chip::Chip& c, std::uint64_t clocks) { c.sysctrl.skip(in, clocks); };
    trial.compare(rng, chip, chip.sysctrl.quiet(in), step, skip);
  });
}

TEST(BlockSkip, Uartc) {
  for_any_chip("skip uartc", [](Rng& rng, const chip::Chip& chip, SkipTrial& trial) {
    chip::UartcIn in{.rx = !rarely(rng),
                     .cfg_address = chip.uartc.address_q,
                     .cfg_baud = chip.uartc.baud_q,
                     .cfg_format = chip.uartc.format_q,
                     .cfg_pause = chip.uartc.pause_q != 0,
                     .cmd_done = rarely(rng),
                     .rsp_kind = chip.paramc.rsp_kind_q,
                     .rsp_exc = chip.paramc.rsp_exc_q,
                     .rd_wait = rarely(rng),
                     .tlm_start = rarely(rng)};
    if (rarely(rng)) ++in.cfg_baud;
    const auto step = [&](chip::Chip& c, std::uint64_t) { c.uartc.step(in); };
    const auto skip = [&](chip::Chip& c, std::uint64_t clocks) { c.uartc.skip(in, clocks); };
    trial.compare(rng, chip, chip.uartc.quiet(in), step, skip);
  });
}

TEST(BlockSkip, UartRx) {
  for_any_chip("skip uart_rx", [](Rng& rng, const chip::Chip& chip, SkipTrial& trial) {
    if (chip.uartc.rx.valid_q != 0) return;  // its pulse, which uartc asks for first
    const std::uint8_t rx = either(rng);
    const std::uint16_t baud = chip.uartc.baud_q;
    const auto format = static_cast<std::uint8_t>(rng.below(4));
    const bool pause = either(rng);
    const auto step = [&](chip::Chip& c, std::uint64_t) { c.uartc.rx.step(rx, baud, format, pause); };
    const auto skip = [&](chip::Chip& c, std::uint64_t clocks) { c.uartc.rx.skip(rx, baud, clocks); };
    trial.compare(rng, chip, chip.uartc.rx.quiet(rx, baud), step, skip);
  });
}

TEST(BlockSkip, UartTx) {
  for_any_chip("skip uart_tx", [](Rng& rng, const chip::Chip& chip, SkipTrial& trial) {
    if (chip.uartc.tx.take_q != 0) return;  // its pulse, which uartc asks for first
    const std::uint16_t baud = chip.uartc.baud_q;
    const auto format = static_cast<std::uint8_t>(rng.below(4));
    const chip::UartTxIn in{
        .valid = false, .data = static_cast<std::uint8_t>(rng.below(256)), .last = either(rng)};
    const auto step = [&](chip::Chip& c, std::uint64_t) { c.uartc.tx.step(in, baud, format); };
    const auto skip = [&](chip::Chip& c, std::uint64_t clocks) { c.uartc.tx.skip(baud, clocks); };
    trial.compare(rng, chip, chip.uartc.tx.quiet(baud), step, skip);
  });
}

TEST(BlockSkip, Guard) {
  for_any_chip("skip guard", [](Rng& rng, const chip::Chip& any, SkipTrial& trial) {
    chip::Chip chip = any;
    // its feedback counter is compared with one register only, and seldom just below it by chance
    const std::uint32_t trip = 16u * chip.params()[spec::kRegFbTime];
    if (either(rng))
      chip.guard.fb_q = trip - std::min<std::uint32_t>(trip, static_cast<std::uint32_t>(rng.below(4)));
    const chip::Sync::Seen feedback{either(rng), either(rng), either(rng)};
    chip::GuardIn in{.params = chip.params(),
                     .tenth = rarely(rng),
                     .sens_done = rarely(rng),
                     .sens_ok = either(rng),
                     .sens_dev_fault = either(rng),
                     .sens_pv = chip.sensc.pv(),
                     .duty = chip.algor.duty_q,
                     .hold_limit = chip.algor.hold_q,
                     .limited = either(rng),
                     .segment = chip.algor.segment_q,
                     .sp_work = chip.algor.sp_work_q,
                     .ramping = either(rng),
                     .pwm = either(rng),
                     .run = rarely(rng),
                     .stop = rarely(rng),
                     .clear = rarely(rng),
                     .good_frame = rarely(rng),
                     .mem_bad = rarely(rng),
                     .state_illegal = rarely(rng),
                     .overrun = rarely(rng),
                     .watch_parity = static_cast<std::uint8_t>(rng.below(4)),
                     .watch_still = static_cast<std::uint8_t>(rng.below(4)),
                     .inhibit = rarely(rng),
                     .heater_fb = feedback.first};
    // from a step on, its registers of the inputs hold what these inputs are
    chip.guard.step(in);
    const auto step = [&](chip::Chip& c, std::uint64_t clock) {
      chip::GuardIn now = in;
      now.heater_fb = clock == 0 ? feedback.first : clock == 1 ? feedback.second : feedback.later;
      c.guard.step(now);
    };
    const auto skip = [&](chip::Chip& c, std::uint64_t clocks) { c.guard.skip(in, feedback, clocks); };
    trial.compare(rng, chip, chip.guard.quiet(in, feedback), step, skip);
  });
}

}  // namespace
}  // namespace meltstage::tb
