// SPDX-License-Identifier: Apache-2.0
// Single-event study: one flop of the chip is inverted at a random clock of a heated job, and what follows is
// compared with the same job undisturbed. docs/chip/protection.md has the counts.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "cmodel/chip.hpp"

namespace meltstage::tb {

/// A flop's bit.
struct FlopBit {
  std::string_view block;  ///< RTL instance below tc_top, without "u_"
  std::string_view name;
  unsigned word;  ///< of an array
  unsigned bit;
};
/// Every flop bit of the chip.
const std::vector<FlopBit>& flop_bits();
/// Inverts the bit of that number; what hangs on the parameter memory follows.
void invert_flop_bit(chip::Chip& chip, std::size_t number);
/// Some flop differs.
bool different(const chip::Chip& a, const chip::Chip& b);

/// What the chip is doing when it is struck.
enum class UpsetPhase : std::uint8_t {
  full_power,
  hold,
  tuning,  ///< self-tuning, the relay at its lower level
  stopped,
  faulted
};
inline constexpr std::array kUpsetPhases{UpsetPhase::full_power, UpsetPhase::hold, UpsetPhase::tuning,
                                         UpsetPhase::stopped, UpsetPhase::faulted};
std::string_view upset_phase_name(UpsetPhase phase);

enum class UpsetOutcome : std::uint8_t {
  no_effect,  ///< every flop is again as without the upset
  corrected,  ///< the parameter memory has corrected it
  stopped,    ///< a fault was latched or the chip was reset or stopped: heater off
  disturbed,  ///< something differs still; the heater has kept to its specification
  outside,  ///< the heater was on when it must be off, or longer than commanded, for more than a control tick
};
inline constexpr std::array kUpsetOutcomes{UpsetOutcome::no_effect, UpsetOutcome::corrected,
                                           UpsetOutcome::stopped, UpsetOutcome::disturbed,
                                           UpsetOutcome::outside};
std::string_view upset_outcome_name(UpsetOutcome outcome);

/// How the PWM is set: the chip's reset values (1 kHz), or a slow output as for a relay (2 Hz by prescaler).
enum class UpsetPwm : std::uint8_t { fast, slow };

/// One phase, recorded undisturbed once; every strike starts from the same state.
class UpsetStudy {
 public:
  UpsetStudy(UpsetPhase phase, UpsetPwm pwm);

  struct Strike {
    std::vector<std::size_t> flops;  ///< numbers in flop_bits(); one for a single event
    double delay_s;                  ///< after the start of a control tick, 0 .. one tick
  };
  struct Result {
    UpsetOutcome outcome;
    double
        excess_s;  ///< on-time above the undisturbed run's, largest in a tick, from one tick after the strike
    std::uint16_t faults;  ///< latched at the end
  };
  Result strike(const Strike& what) const;

  const chip::Chip& start() const { return start_; }
  static constexpr double kTick_s = 0.1;

 private:
  struct Watched {
    chip::Chip chip;                // at the end
    std::vector<std::uint64_t> on;  // clocks with heater_o high up to each step of the watch
  };
  Watched watch(const Strike* strike) const;

  double pwm_period_s_;
  double element_degc_;
  chip::Chip start_;
  Watched sound_;
};

}  // namespace meltstage::tb
