// SPDX-License-Identifier: Apache-2.0
// Pieces of the functional set: self-tuning.
#include "asic/signoff/piece_steps.hpp"

namespace meltstage::app {

namespace {

class TuningPieces : private PieceSteps {
 public:
  explicit TuningPieces(PieceState& state) : PieceSteps(state) {}

  void record() { self_tuning(); }

 private:
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
    begin("self-tuning: largest swings, longest cycles");
    constexpr std::int32_t kLargest = 17200;
    relay_run(kLargest, {{4, 4}, {40, 40}, {40, 40}, {40, 40}, {40, 45}, {50, 41}, {44, 44}, {47, 42}});
    if (quick_) return;
    relay_run(kLargest / 3,
              {{4, 4}, {30, 3}, {3, 40}, {25, 90}, {1040, 1100}, {1040, 30}, {1060, 20}, {1000, 120}});
    relay_run(200, {{4, 4}, {600, 20}, {8, 700}, {90, 30}, {60, 130}, {180, 90}, {20, 11}, {300, 400}});
  }

  void self_tuning() {
    begin("self-tuning: finished with different plants, stopped, out of time");
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
      s_.refused(write_request(spec::kRegKp, 1), spec::kExcBusy);
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
};

}  // namespace

void record_tuning(PieceState& state) { TuningPieces(state).record(); }

}  // namespace meltstage::app
