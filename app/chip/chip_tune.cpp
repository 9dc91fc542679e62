// SPDX-License-Identifier: Apache-2.0
#include "app/chip/chip_tune.hpp"

#include <fmt/format.h>

#include <chrono>
#include <thread>
#include <vector>

#include "app/terminal.hpp"
#include "cmodel/spec.hpp"

namespace meltstage::app {

namespace {

constexpr auto kPollEvery = std::chrono::milliseconds(250);

const char* end_of(host::TuningPhase phase) {
  switch (phase) {
    case host::TuningPhase::finished:
      return "finished";
    case host::TuningPhase::stopped:
      return "stopped by STOP or a fault";
    case host::TuningPhase::timed_out:
      return "ended by time: the temperature did not swing; heater off";
    default:
      return "did not start";
  }
}

void print_result(host::Controller& controller, const host::Tuning& tuning) {
  fmt::print("ultimate gain   {:.5f} 1/K\nultimate period {:.1f} s\nhold duty       {:.2f} %\n",
             tuning.ku_per_k, tuning.tu_s, tuning.hold_duty_percent);
  std::vector<const host::Register*> gains;
  for (const char* name : {"KP", "KI_APPROACH", "KI_HOLD", "KD", "D_FILTER", "KFF"})
    gains.push_back(&host::find_register(name));
  const auto words = controller.read(gains);
  for (std::size_t i = 0; i < gains.size(); ++i)
    fmt::print("{:<15} {} {}\n", gains[i]->name, host::value_text(*gains[i], words[i]), gains[i]->unit);
}

host::Tuning follow(host::Controller& controller) {
  ProgressLine line;
  for (;;) {
    throw_if_interrupted();
    const host::Tuning tuning = controller.tuning();
    if (tuning.phase != host::TuningPhase::runs) return tuning;
    const host::Status status = controller.status();
    line.show_share("autotune", static_cast<double>(tuning.cycles) / chip::spec::kTuneCycles,
                    fmt::format("{} of {} cycles, {:.2f} degC of {:.1f}, duty {:.1f} %", tuning.cycles,
                                chip::spec::kTuneCycles, status.temperature_degc.value_or(0.0),
                                status.setpoint_degc, status.duty_percent));
    std::this_thread::sleep_for(kPollEvery);
  }
}

}  // namespace

int tune_chip(host::Controller& controller) {
  catch_interrupts();
  try {
    controller.start_tuning();
    const host::Tuning tuning = follow(controller);
    if (tuning.phase == host::TuningPhase::finished) {
      print_result(controller, tuning);
      return 0;
    }
    on_stderr(fmt::format("meltstage: autotune {}\n", end_of(tuning.phase)));
  } catch (const Interrupted&) {
    on_stderr("meltstage: left; the chip tunes on until HOST_WD ends it, `chip stop` ends it now\n");
  }
  return 1;
}

}  // namespace meltstage::app
