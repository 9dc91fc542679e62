// SPDX-License-Identifier: Apache-2.0
#include "tb/trials/commissioning.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

namespace meltstage::tb {
namespace {

namespace spec = chip::spec;

constexpr double kLongestTuning_s = 7200.0;
constexpr double kLookEvery_s = 1.0;

std::vector<HeadSetting> limits(double highest_degc) {
  return {{spec::kRegTMax, static_cast<std::int32_t>(std::lround((highest_degc + kOverTarget_degc) * 10.0))},
          {spec::kRegTMin, 50}};
}

constexpr auto kResetCtrl = static_cast<std::uint16_t>(spec::kHolding[spec::kRegCtrl].reset);

void append(std::vector<HeadSetting>& to, const std::vector<HeadSetting>& more) {
  to.insert(to.end(), more.begin(), more.end());
}

void require_heating(const HeatedRun& run, const HeadConfig& config) {
  if (std::isfinite(run.tripped_s()))
    throw std::runtime_error(fmt::format("commissioning of {}: faults {:#06x} after {:.1f} s",
                                         config.plant.name, run.faults(), run.tripped_s()));
}

host::HoldRecord look(HeatedRun& run) {
  host::HoldRecord record;
  while (record.size() < host::kReadings) {
    run.until(run.now_s() + kLookEvery_s);
    record.add(run.reading_degc(), run.chip().guard.slope_q / 64.0);
  }
  return record;
}

}  // namespace

std::vector<HeadSetting> as_words(std::span<const host::Setting> settings) {
  std::vector<HeadSetting> words;
  for (const host::Setting& s : settings)
    words.push_back(
        {static_cast<spec::Reg>(s.reg->address - spec::kHoldingBase), host::to_raw(*s.reg, s.value)});
  return words;
}

std::vector<HeadSetting> tuned_settings(const PlantConfig& plant, double highest_degc) {
  constexpr double kTs_s = 0.1;
  const StepResponse step = step_response(plant);
  const double dead = step.dead_time_s;
  const double kp = 0.7 / (step.rate_degc_per_s * dead);
  const host::HeadModel head{.hold_duty_per_k = plant.block_ambient_w_per_k / plant.power_w,
                             .dead_time_s = dead,
                             .rate_degc_per_s = step.rate_degc_per_s};
  const auto whole = [](double x) { return static_cast<std::int32_t>(std::lround(x)); };
  std::vector<HeadSetting> settings{
      {spec::kRegTs, whole(kTs_s * 1e3)},
      {spec::kRegKp, whole(kp * 65536.0)},
      {spec::kRegKiApproach, whole(kp * kTs_s / (8.0 * dead) * 1024.0 * 16384.0)},
      {spec::kRegKiHold, whole(kp * kTs_s / (4.0 * dead) * 1024.0 * 16384.0)},
      {spec::kRegKd, whole(kp * 0.5 * dead / kTs_s * 1024.0 * 8.0)},
      {spec::kRegKff, whole(head.hold_duty_per_k * 4194304.0)}};
  append(settings, limits(highest_degc));
  append(settings, as_words(host::detector_settings(head, 0.0, kResetCtrl)));
  return settings;
}

Commissioned commission(const HeadConfig& config, double working_degc, double highest_degc) {
  std::vector<HeadSetting> settings = limits(highest_degc);
  std::vector<HeadSetting> at_first = settings;
  append(at_first, as_words(host::settings_before_tuning(kResetCtrl, 0.0)));
  HeatedRun run(config, at_first);
  const auto window =
      static_cast<std::int32_t>(std::ceil(10.0 * host::relay_window_degc(look(run).noise_degc())));
  run.write(spec::kRegAtWindow, std::max<std::int32_t>(window, spec::kHolding[spec::kRegAtWindow].reset));
  run.set_point(working_degc);
  run.start();
  run.until(run.now_s() + kLookEvery_s);  // a command waits for the tick of the one before
  run.write(spec::kRegCmd, spec::kCmdTune);
  const chip::Atune& atune = run.chip().atune;
  while (atune.end_q != chip::kTuneFinished) {
    run.until(run.now_s() + kLookEvery_s);
    require_heating(run, config);
    if (run.now_s() > kLongestTuning_s)
      throw std::runtime_error(fmt::format("commissioning of {}: not finished", config.plant.name));
  }
  const chip::Params& params = run.chip().params();
  const host::Tuning tuning{.phase = host::TuningPhase::finished,
                            .cycles = 0,
                            .ku_per_k = atune.ku_q / 65536.0,
                            .tu_s = atune.tu() / 4.0 * params[spec::kRegTs] / 1000.0,
                            .hold_duty_percent = atune.hold_q / 655.36};
  const auto head = host::identify_head(tuning, working_degc - params.s16(spec::kRegTAmb) / 10.0);
  if (!head) throw std::runtime_error(fmt::format("commissioning of {}: no such head", config.plant.name));

  run.until(run.now_s() + host::kSettlePeriods * tuning.tu_s);
  const host::HoldRecord hold = look(run);
  require_heating(run, config);

  for (const spec::Reg reg :
       {spec::kRegKp, spec::kRegKiApproach, spec::kRegKiHold, spec::kRegKd, spec::kRegDFilter, spec::kRegKff})
    settings.push_back({reg, params[reg]});
  append(settings, as_words(host::detector_settings(*head, hold.noise_degc(), kResetCtrl)));
  return {*head, hold.noise_degc(), hold.swing_degc(), settings};
}

}  // namespace meltstage::tb
