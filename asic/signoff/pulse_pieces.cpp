// SPDX-License-Identifier: Apache-2.0
// Pieces of the functional set: pulse-width modulation.
#include "asic/signoff/piece_steps.hpp"

namespace meltstage::app {

namespace {

class PulsePieces : private PieceSteps {
 public:
  explicit PulsePieces(PieceState& state) : PieceSteps(state) {}

  void record() { pulse_width(); }

 private:
  void pulse_width() {
    begin("PWM: duty ends, periods, prescaler, dither, shortest pulse");
    start_work();
    set(spec::kRegMode, kManual);
    s_.ticks();
    heat();
    for (unsigned i = 0; i < often(40, 8); ++i) {
      Parameters p = now_;
      p[spec::kRegManualDuty] = i < 4 ? (i % 2 == 0 ? 10000 : 0) : in_range(spec::kRegManualDuty);
      p[spec::kRegCtrl] = i % 2 == 0 ? kDither : 0;
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
    begin("PWM: periods and prescalers of all bits, run to their end");
    start_work();
    set(spec::kRegMode, kManual);
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
      set(spec::kRegCtrl, one_in(4) ? 0 : kDither);
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
};

}  // namespace

void record_pulses(PieceState& state) { PulsePieces(state).record(); }

}  // namespace meltstage::app
