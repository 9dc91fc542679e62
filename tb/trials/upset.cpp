// SPDX-License-Identifier: Apache-2.0
#include "tb/trials/upset.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <stdexcept>
#include <type_traits>

#include "tb/trials/commissioning.hpp"
#include "tb/trials/heated_run.hpp"

namespace meltstage::chip {
namespace {

#define TC_QUOTE(x) #x
#define TC_TEXT(x) TC_QUOTE(x)

// f(block, name, word, value, bits) for each flop, an array's words one by one; `bits` is the mask of those
// that exist.
template <class Model, class F>
void visit_flops(Model& model, F&& f) {
#define TC_FLOP(type, name, width, reset) \
  f(TC_TEXT(TC_INSTANCE), #name, 0u, model.TC_MEMBER.name, ~std::uint64_t{0} >> (64 - width));
#define TC_ARRAY(type, name, count, width)                           \
  for (unsigned word = 0; word < count; ++word)                      \
    f(TC_TEXT(TC_INSTANCE), #name, word, model.TC_MEMBER.name[word], \
      std::uint64_t{array_flops<std::remove_cvref_t<decltype(model.TC_MEMBER)>>(word, width)});
#include "cmodel/for_each_flop.inc"
}

}  // namespace
}  // namespace meltstage::chip

namespace meltstage::tb {
namespace {

namespace spec = chip::spec;

constexpr double kSettle_s = 0.3;  // the fresh sensor's first conversions
constexpr double kWatch_s = 1.5;   // after the tick of the strike
constexpr double kStep_s = 0.01;
constexpr double kPoll_s = 0.05;
constexpr double kTolerance = 0.02;  // of a tick
constexpr double kSetpoint_degc = 110.0;
constexpr double kCold_degc = 60.0;
constexpr double kCooled_degc = 20.0;  // below the set-point, once stopped
constexpr double kSwing_degc = 2.0;    // to either side of the set-point while tuning
constexpr double kSlope_degc_per_s = 1.0;
constexpr int kSwings = 5;  // past the cycles that centre the relay

std::uint64_t clocks(double seconds) {
  return static_cast<std::uint64_t>(std::llround(seconds * spec::kClkHz));
}

std::string_view block_of(std::string_view instance) {
  const std::size_t dots = instance.find("__DOT__");
  return instance.substr(0, dots).substr(2);
}

}  // namespace

const std::vector<FlopBit>& flop_bits() {
  static const std::vector<FlopBit> bits = [] {
    std::vector<FlopBit> list;
    const chip::Chip chip;
    chip::visit_flops(chip, [&](const char* instance, const char* name, unsigned word, const auto&,
                                std::uint64_t present) {
      for (; present != 0; present &= present - 1)
        list.push_back({block_of(instance), name, word, static_cast<unsigned>(std::countr_zero(present))});
    });
    return list;
  }();
  return bits;
}

void invert_flop_bit(chip::Chip& chip, std::size_t number) {
  std::size_t left = number;
  chip::visit_flops(chip, [&]<class T>(const char*, const char*, unsigned, T& value, std::uint64_t bits) {
    const std::size_t count = static_cast<std::size_t>(std::popcount(bits));
    if (left < count) {
      for (; left != 0; --left) bits &= bits - 1;
      const std::uint64_t lowest = bits & (~bits + 1);
      // The highest bit of a signed flop is its sign, extended in the model.
      const bool sign = std::is_signed_v<T> && bits == lowest;
      value = static_cast<T>(static_cast<std::uint64_t>(value) ^ (sign ? ~(lowest - 1) : lowest));
    }
    left -= count;  // wraps past the flop that was meant, and then never fits again
  });
  chip.mem.refresh_params();
}

std::string_view upset_phase_name(UpsetPhase phase) {
  constexpr std::array<std::string_view, kUpsetPhases.size()> kNames{"full power", "hold", "tuning",
                                                                     "stopped", "faulted"};
  return kNames[static_cast<std::size_t>(phase)];
}

std::string_view upset_outcome_name(UpsetOutcome outcome) {
  constexpr std::array<std::string_view, kUpsetOutcomes.size()> kNames{"no effect", "corrected", "stopped",
                                                                       "disturbed", "outside"};
  return kNames[static_cast<std::size_t>(outcome)];
}

UpsetStudy::UpsetStudy(UpsetPhase phase, UpsetPwm pwm)
    : pwm_period_s_(pwm == UpsetPwm::fast ? 1e-3 : 0.5),
      element_degc_(phase == UpsetPhase::full_power ? kCold_degc : kSetpoint_degc) {
  std::vector<HeadSetting> settings = tuned_settings(plant_config("PH-1"), kSetpoint_degc);
  settings.push_back({spec::kRegPwmPrescale, pwm == UpsetPwm::fast ? 0 : 499});
  HeatedRun run({.sensor_noise_degc = 0.0}, settings);
  run.head().set_element_degc(kCold_degc);
  run.until(3.0);
  run.set_point(kSetpoint_degc);
  run.start();
  run.until(4.0);
  if (phase != UpsetPhase::full_power) {
    // On to a degree below the set-point, no faster than a head; there the integral grows to a head's hold
    // duty.
    for (double degc = kCold_degc; degc < kSetpoint_degc - 1.0; degc += 0.5) {
      run.head().set_element_degc(degc);
      run.until(run.now_s() + 1.0);
    }
    run.head().set_element_degc(kSetpoint_degc - 1.0);
    while (run.chip().algor.i_q >> 14 < 0.38 * 65536.0) {
      run.until(run.now_s() + 1.0);
      if (std::isfinite(run.tripped_s()))
        throw std::runtime_error(
            fmt::format("upset study: heating up tripped, faults {:#06x}", run.faults()));
    }
    run.head().set_element_degc(kSetpoint_degc);
    run.until(run.now_s() + 5.0);
  }
  if (phase == UpsetPhase::tuning) {
    run.write(spec::kRegCmd, spec::kCmdTune);
    // Swings until the relay's levels are centred, then to above its upper switch.
    for (int half = 0; half < 2 * kSwings; ++half) {
      const double way_degc = half % 2 == 0 ? -kSlope_degc_per_s : kSlope_degc_per_s;
      while (std::abs(element_degc_ + way_degc * kTick_s - kSetpoint_degc) <= kSwing_degc) {
        element_degc_ += way_degc * kTick_s;
        run.head().set_element_degc(element_degc_);
        run.until(run.now_s() + kTick_s);
      }
    }
  }
  if (phase == UpsetPhase::stopped) run.write(spec::kRegCmd, spec::kCmdStop);
  const auto cool = [&] {
    // So that a heater on by mistake is one at full power.
    for (; element_degc_ > kSetpoint_degc - kCooled_degc; element_degc_ -= 1.0) {
      run.head().set_element_degc(element_degc_);
      run.until(run.now_s() + 1.0);
    }
    run.head().set_element_degc(element_degc_);
  };
  if (phase == UpsetPhase::faulted) {
    run.head().set_inhibit(true);
    run.until(run.now_s() + 0.2);
    run.head().set_inhibit(false);
  }
  if (phase == UpsetPhase::stopped || phase == UpsetPhase::faulted) cool();
  // The chip's ticks lie on tenths of a second since its reset; the state is that just before one.
  run.until(std::ceil(run.now_s() * 10.0 + 1.0) / 10.0);
  start_ = run.chip();
  sound_ = watch(nullptr);
}

UpsetStudy::Watched UpsetStudy::watch(const Strike* strike) const {
  Head head({.sensor_noise_degc = 0.0});
  head.set_element_degc(element_degc_);
  chip::Run run{.chip = start_, .out = start_.outputs({}), .cycle = 0};
  std::uint64_t last = 0;
  bool was_on = run.out.heater;
  std::uint64_t on = 0;
  const auto observe = [&](std::uint64_t cycle, const chip::Inputs&, const chip::Outputs& out) {
    if (was_on) on += cycle - last;
    last = cycle;
    was_on = out.heater;
  };
  std::uint64_t next_poll = 0;
  const auto to = [&](double time_s) { chip::advance(run, clocks(time_s), head, observe); };
  Watched watched;
  const int steps = static_cast<int>(std::lround((kSettle_s + kTick_s + kWatch_s) / kStep_s));
  const double strike_s = strike != nullptr ? kSettle_s + strike->delay_s : -1.0;
  for (int i = 1; i <= steps; ++i) {
    const double end_s = i * kStep_s;
    if (run.cycle >= next_poll) {
      head.host().submit(read_input_registers(1, 0, 16));
      next_poll += clocks(kPoll_s);
    }
    if (strike_s > end_s - kStep_s && strike_s <= end_s) {
      to(strike_s);
      for (const std::size_t flop : strike->flops) invert_flop_bit(run.chip, flop);
      run.out = run.chip.outputs({});
    }
    to(end_s);
    while (head.host().take_result()) {
    }
    watched.on.push_back(on + (was_on ? run.cycle - last : 0));
  }
  watched.chip = run.chip;
  return watched;
}

UpsetStudy::Result UpsetStudy::strike(const Strike& what) const {
  const Watched& sound = sound_;
  const Watched hit = watch(&what);

  // From a tick after the strike on, and past the PWM period then under way: on-time in each tick's length.
  const auto first = static_cast<std::size_t>(std::ceil(
      (kSettle_s + what.delay_s + kTick_s + (pwm_period_s_ > kTick_s ? pwm_period_s_ : 0.0)) / kStep_s));
  const auto window = static_cast<std::size_t>(std::lround(std::max(kTick_s, pwm_period_s_) / kStep_s));
  double excess = 0.0;
  for (std::size_t i = first + window; i < sound.on.size(); ++i) {
    const double more = static_cast<double>(hit.on[i] - hit.on[i - window]) -
                        static_cast<double>(sound.on[i] - sound.on[i - window]);
    excess = std::max(excess, more / spec::kClkHz);
  }

  Result result{UpsetOutcome::disturbed, excess, hit.chip.guard.fault_q};
  const double allowed = kTolerance * static_cast<double>(window) * kStep_s;
  chip::Chip repaired = hit.chip;
  repaired.mem.corrected_q = sound.chip.mem.corrected_q;
  const auto same = [](const chip::Chip& a, const chip::Chip& b) { return !different(a, b); };
  if (excess > allowed)
    result.outcome = UpsetOutcome::outside;
  else if (same(hit.chip, sound.chip))
    result.outcome = UpsetOutcome::no_effect;
  else if (same(repaired, sound.chip))
    result.outcome = UpsetOutcome::corrected;
  else if (hit.chip.guard.run_q == 0 && sound.chip.guard.run_q != 0)
    result.outcome = UpsetOutcome::stopped;
  else if (hit.chip.guard.fault_q != 0 && sound.chip.guard.fault_q == 0)
    result.outcome = UpsetOutcome::stopped;
  return result;
}

bool different(const chip::Chip& a, const chip::Chip& b) {
  std::vector<std::uint64_t> values;
  chip::visit_flops(a, [&](const char*, const char*, unsigned, const auto& value, std::uint64_t) {
    values.push_back(static_cast<std::uint64_t>(value));
  });
  std::size_t i = 0;
  bool differ = false;
  chip::visit_flops(b, [&](const char*, const char*, unsigned, const auto& value, std::uint64_t) {
    differ = differ || values[i++] != static_cast<std::uint64_t>(value);
  });
  return differ;
}

}  // namespace meltstage::tb
