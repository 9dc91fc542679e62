// SPDX-License-Identifier: Apache-2.0
#include "app/chip/chip_tune.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "app/chip/chip_run.hpp"
#include "app/chip/latched_fault.hpp"
#include "base/error.hpp"
#include "base/terminal.hpp"
#include "cmodel/spec.hpp"
#include "host/commissioning.hpp"

namespace meltstage::app {

namespace {

using host::find_register;
using host::Setting;

constexpr auto kPollEvery = std::chrono::milliseconds(100);
// A set-point so far above ambient tells the head's loss.
constexpr double kLeastRise_degc = 20.0;
constexpr double kAmbientError_degc = 5.0;  // of a room that is told, and of a sensor
// Hold: it is looked at for so many ultimate periods.
constexpr double kLookPeriods = 4.0;
// The loop that the gains make must hold: the head's own swing, standard deviation.
constexpr double kLargestSwing_degc = 0.3;  // and half of the noise
// Small step, from below to the set-point, and the largest way past it beside the noise.
constexpr double kStep_degc = 3.0;
constexpr double kLargestOvershoot_degc = 1.5;
constexpr double kNoiseDeviations = 5.0;    // the largest of thousands of samples
constexpr double kOutside = 65535.0 * 0.1;  // BAND_TIME while the temperature is outside of AT_WINDOW

/// What self-tuning and `detector_settings` change, and the two detectors that know the head before it is
/// known.
constexpr std::array kChanged{"AT_WINDOW", "SETPOINT", "KP",        "KI_APPROACH", "KI_HOLD",  "KD",
                              "D_FILTER",  "KFF",      "CTRL",      "DTDT_MAX",    "LBA_TIME", "LBA_RISE",
                              "HOLD_MULT", "HOLD_ADD", "HOLD_TIME", "EXC_LIMIT",   "ZERO_WAIT"};
constexpr std::array kGains{"KP", "KI_APPROACH", "KI_HOLD", "KD", "D_FILTER", "KFF"};

/// The commissioning can't end well: why, as a sentence goes on after "autotune ".
struct Rejected {
  std::string why;
};

double value_of(host::Controller& controller, const char* name) {
  return controller.read(find_register(name));
}

std::vector<Setting> settings_now(host::Controller& controller) {
  std::vector<const host::Register*> wanted;
  for (const char* name : kChanged) wanted.push_back(&find_register(name));
  const auto words = controller.read(wanted);
  std::vector<Setting> settings;
  for (std::size_t i = 0; i < wanted.size(); ++i)
    settings.push_back({wanted[i], host::to_unit(*wanted[i], words[i])});
  return settings;
}

/// Why heating has ended, by the chip's own account.
std::string end_of_heating(host::Controller& controller) {
  const std::string fault = latched_fault(controller);
  return fault.empty() ? "stopped by STOP" : "stopped: " + fault;
}

host::Status status_while_heating(host::Controller& controller) {
  throw_if_interrupted();
  const host::Status status = controller.status();
  if (!status.running()) throw Rejected{end_of_heating(controller)};
  return status;
}

host::Tuning follow_tuning(host::Controller& controller, ProgressLine& line) {
  for (;;) {
    throw_if_interrupted();
    const host::Tuning tuning = controller.tuning();
    switch (tuning.phase) {
      case host::TuningPhase::finished:
        return tuning;
      case host::TuningPhase::stopped:
        throw Rejected{end_of_heating(controller)};
      case host::TuningPhase::timed_out:
        throw Rejected{"ended by time: the temperature did not swing; heater off"};
      case host::TuningPhase::never_ran:
        throw Rejected{"did not start"};
      case host::TuningPhase::runs:
        break;
    }
    const host::Status status = controller.status();
    line.show_share("autotune", static_cast<double>(tuning.cycles) / chip::spec::kTuneCycles,
                    fmt::format("{} of {} cycles, {:.2f} degC of {:.1f}, duty {:.1f} %", tuning.cycles,
                                chip::spec::kTuneCycles, status.temperature_degc.value_or(0.0),
                                status.setpoint_degc, status.duty_percent));
    std::this_thread::sleep_for(kPollEvery);
  }
}

/// The chip's own time, by its accepted samples: it may run faster or slower than this program's.
class ChipTime {
 public:
  explicit ChipTime(host::Controller& controller)
      : period_s_(value_of(controller, "TS") / 1000.0), last_(controller.status().samples) {}
  double passed_s(const host::Status& status) {
    passed_ += static_cast<std::uint16_t>(status.samples - last_);
    last_ = status.samples;
    return passed_ * period_s_;
  }

 private:
  double period_s_;
  double passed_ = 0.0;
  std::uint16_t last_;
};

/// Waits for chip time while heating.
void hold_for(host::Controller& controller, double time_s, ProgressLine& line, const std::string& what) {
  ChipTime time(controller);
  for (;;) {
    const host::Status status = status_while_heating(controller);
    const double passed_s = time.passed_s(status);
    line.show_share(
        what, std::min(1.0, passed_s / time_s),
        fmt::format("{:.2f} degC of {:.1f}", status.temperature_degc.value_or(0.0), status.setpoint_degc));
    if (passed_s >= time_s) return;
    std::this_thread::sleep_for(kPollEvery);
  }
}

/// Readings over `time_s` of chip time, and host::kReadings at least.
host::HoldRecord look(host::Controller& controller, double time_s, ProgressLine& line,
                      const std::string& what) {
  const std::array wanted{&find_register("PV_FINE"), &find_register("PV_SLOPE")};
  host::HoldRecord record;
  ChipTime time(controller);
  for (;;) {
    throw_if_interrupted();
    const auto words = controller.read(wanted);
    record.add(host::to_unit(*wanted[0], words[0]), host::to_unit(*wanted[1], words[1]));
    const double passed_s = time.passed_s(controller.status());
    const double readings = static_cast<double>(record.size()) / host::kReadings;
    line.show_share(what, std::min({1.0, readings, time_s > 0.0 ? passed_s / time_s : 1.0}));
    if (passed_s >= time_s && record.size() >= host::kReadings) return record;
    std::this_thread::sleep_for(kPollEvery);
  }
}

struct SmallStep {
  double overshoot_degc;
  double settling_s;
};

/// Down by kStep_degc and back to the set-point, judged by the chip's own figures.
SmallStep step_to(host::Controller& controller, double setpoint_degc, double tu_s, ProgressLine& line) {
  const host::Register& setpoint = find_register("SETPOINT");
  const auto go_to = [&](double degc, const char* what) {
    controller.write(std::vector<Setting>{{&setpoint, degc}});
    hold_for(controller, host::kSettlePeriods * tu_s, line, what);
  };
  go_to(setpoint_degc - kStep_degc, "step down");
  go_to(setpoint_degc, "step up");
  return {value_of(controller, "OVERSHOOT"), value_of(controller, "BAND_TIME")};
}

void print_gains(host::Controller& controller, const host::Tuning& tuning) {
  fmt::print("ultimate gain   {:.5f} 1/K\nultimate period {:.1f} s\nhold duty       {:.2f} %\n",
             tuning.ku_per_k, tuning.tu_s, tuning.hold_duty_percent);
  std::vector<const host::Register*> gains;
  for (const char* name : kGains) gains.push_back(&find_register(name));
  const auto words = controller.read(gains);
  for (std::size_t i = 0; i < gains.size(); ++i)
    fmt::print("{:<15} {} {}\n", gains[i]->name, host::value_text(*gains[i], words[i]), gains[i]->unit);
}

void print_detectors(const host::HeadModel& head, const host::HoldRecord& hold, const SmallStep& step,
                     const std::vector<Setting>& detectors) {
  fmt::print(
      "time constant   {:.0f} s\ndead time       {:.1f} s\nsteepest rise   {:.2f} degC/s\nnoise           "
      "{:.3f} degC\n",
      head.time_constant_s(), head.dead_time_s, head.rate_degc_per_s, hold.noise_degc());
  for (const Setting& s : detectors) {
    if (s.reg->name == "CTRL") {
      const unsigned rate = static_cast<unsigned>(s.value) >> chip::spec::kCtrlHeatRate;
      fmt::print("{:<15} {} (in CTRL)\n", "HEAT_RATE", rate);
    } else {
      fmt::print("{:<15} {} {}\n", s.reg->name, host::value_text(*s.reg, host::to_raw(*s.reg, s.value)),
                 s.reg->unit);
    }
  }
  fmt::print("step of {:.0f} degC  overshoot {:.2f} degC, settled after {:.1f} s, swing {:.2f} degC\n",
             kStep_degc, step.overshoot_degc, step.settling_s, hold.swing_degc());
}

/// Self-tuning in a window in which its relay does not switch on noise.
host::Tuning tune(host::Controller& controller, ProgressLine& line) {
  const host::Register& window = find_register("AT_WINDOW");
  const double window_degc = controller.read(window);
  const double noise_degc = look(controller, 0.0, line, "noise").noise_degc();
  controller.write(
      std::vector<Setting>{{&window, std::max(window_degc, host::relay_window_degc(noise_degc))}});
  if (!controller.status().running()) run_chip(controller);
  controller.start_tuning();
  const host::Tuning tuning = follow_tuning(controller, line);
  controller.write(std::vector<Setting>{{&window, window_degc}});
  return tuning;
}

void commission(host::Controller& controller, double setpoint_degc, double ambient_degc) {
  ProgressLine line;
  controller.write(host::settings_before_tuning(static_cast<std::uint16_t>(value_of(controller, "CTRL")),
                                                value_of(controller, "LBA_TIME")));
  const host::Tuning tuning = tune(controller, line);
  const auto head = host::identify_head(tuning, setpoint_degc - ambient_degc);
  if (!head)
    throw Rejected{
        fmt::format("rejected: ultimate gain {:.5f} 1/K, ultimate period {:.1f} s and hold duty {:.2f} % at "
                    "{:.1f} degC above "
                    "T_AMB belong to no head; is T_AMB the temperature around it?",
                    tuning.ku_per_k, tuning.tu_s, tuning.hold_duty_percent, setpoint_degc - ambient_degc)};
  hold_for(controller, host::kSettlePeriods * tuning.tu_s, line, "settling");
  const host::HoldRecord hold = look(controller, kLookPeriods * tuning.tu_s, line, "hold");
  const double largest_swing_degc = kLargestSwing_degc + 0.5 * hold.noise_degc();
  if (hold.swing_degc() > largest_swing_degc)
    throw Rejected{
        fmt::format("rejected: in hold the temperature swings by {:.2f} degC (standard deviation, noise of "
                    "{:.2f} degC taken out), "
                    "expected at most {:.2f}; the relay may have switched on noise: use a finer sensor, or a "
                    "shielded wire",
                    hold.swing_degc(), hold.noise_degc(), largest_swing_degc)};
  const std::vector<Setting> detectors = host::detector_settings(
      *head, hold.noise_degc(), static_cast<std::uint16_t>(value_of(controller, "CTRL")));
  controller.write(detectors);
  const SmallStep step = step_to(controller, setpoint_degc, tuning.tu_s, line);
  line.clear();
  const double largest_degc = kLargestOvershoot_degc + kNoiseDeviations * hold.noise_degc();
  if (step.overshoot_degc > largest_degc || step.settling_s >= kOutside)
    throw Rejected{fmt::format(
        "rejected: a step of {:.0f} degC went {:.2f} degC past the set-point and settled after {:.1f} s, "
        "expected at "
        "most {:.2f} degC and within {:.0f} s; draughts or printing while it ran?",
        kStep_degc, step.overshoot_degc, step.settling_s, largest_degc, host::kSettlePeriods * tuning.tu_s)};
  print_gains(controller, tuning);
  print_detectors(*head, hold, step, detectors);
}

}  // namespace

int tune_chip(host::Controller& controller) {
  controller.check_identity();
  if (value_of(controller, "MODE") != 0.0)
    throw UserError("MODE: found 1 (manual), expected 0: autotune needs the automatic mode");
  if (!controller.status().running()) {
    const std::string fault = latched_fault(controller);
    if (!fault.empty())
      throw host::BusError(fmt::format("autotune not begun, a fault is latched (`chip clear`): {}", fault));
  }
  const double setpoint_degc = value_of(controller, "SETPOINT");
  const double ambient_degc = value_of(controller, "T_AMB");
  if (setpoint_degc < ambient_degc + kLeastRise_degc)
    throw UserError(
        fmt::format("SETPOINT: found {:.1f} degC, expected at least {:.1f}: autotune measures the head at "
                    "its working temperature, "
                    "{:.0f} degC or more above T_AMB",
                    setpoint_degc, ambient_degc + kLeastRise_degc, kLeastRise_degc));
  const double coolest_degc = ambient_degc - kAmbientError_degc;
  const double reading_degc = value_of(controller, "PV");
  if (reading_degc < coolest_degc)
    throw UserError(fmt::format(
        "T_AMB: found {:.1f} degC, expected the room's temperature; the head reads {:.1f} degC, and can't be "
        "cooler than the room",
        ambient_degc, reading_degc));
  const std::vector<Setting> before = settings_now(controller);
  const auto give_up = [&](const std::string& why) {
    controller.stop();
    controller.write(before);
    on_stderr(fmt::format("meltstage: autotune {}; heater off, registers as before\n", why));
    return 1;
  };
  catch_interrupts();
  try {
    commission(controller, setpoint_degc, ambient_degc);
    return 0;
  } catch (const Rejected& rejected) {
    return give_up(rejected.why);
  } catch (const Interrupted&) {
    return give_up("left");
  } catch (const host::BusError& error) {
    return give_up(fmt::format("ended: {}", error.what()));
  }
}

}  // namespace meltstage::app
