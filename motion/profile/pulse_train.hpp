// SPDX-License-Identifier: Apache-2.0
// The step generator of an axis in fixed point: four accumulators that a counter in hardware could hold, and
// their values at any clock cycle without stepping through those before.
#pragma once

#include <array>
#include <cstdint>

#include "motion/profile/retarget.hpp"

namespace meltstage::motion {

/// Command pulses with 96 fractional bits: +-2^31 pulses in steps of 1.3e-29.
__extension__ using FixedPulses = __int128;
constexpr int kFixedPulseBits = 96;

/// @throws MotionError if the number is not above -2^31 and below 2^31.
FixedPulses to_fixed(double pulses);
double to_double(FixedPulses pulses);

/// Forward differences of a cubic over clock cycles. Each cycle position += first, first += second,
/// second += third; in fixed point this is exact.
struct PulseAccumulators {
  FixedPulses position = 0, first = 0, second = 0, third = 0;

  void tick() {
    position += first;
    first += second;
    second += third;
  }

  /// Position after `cycles` ticks: p + n d1 + n(n-1)/2 d2 + n(n-1)(n-2)/6 d3.
  FixedPulses position_after(std::uint64_t cycles) const;
};

/// A motion as an axis' pulses over the clock cycles from its start. Every segment of the motion is loaded
/// from the plan itself at its first whole cycle, so that the rounding of one doesn't reach the next; a long
/// one several times, as its rounding grows with the third power of its cycles. The position stays within
/// `largest_error_pulses` of the plan at every cycle, and a step comes at the first cycle at which the
/// position has passed the middle between two pulses: at most one cycle behind the plan.
class PulseTrain {
 public:
  static constexpr double kLargestErrorPulses = 1e-6;

  PulseTrain() = default;

  /// @param pulses_per_mm of the motion along its path; negative: the axis counts down
  /// @param start_pulses position of the axis at the motion's start, not rounded
  /// @throws MotionError if the motion leaves +-2^31 pulses, the clock isn't positive, or the motion is
  /// longer than 2^62 cycles or takes more parts than there is room for: its jerk lasts for minutes.
  PulseTrain(const JerkProfile& profile, double pulses_per_mm, double start_pulses, double clock_hz);

  /// First cycle at which the motion has ended; the position is exactly the plan's from there on.
  std::uint64_t end_cycle() const { return end_cycle_; }

  FixedPulses position(std::uint64_t cycle) const;

  /// Accumulators at a segment's first cycle, as a generator in hardware is loaded.
  /// A long segment of the motion is several here.
  std::size_t segments() const { return segments_; }
  std::uint64_t first_cycle(std::size_t segment) const { return parts_[segment].first_cycle; }
  const PulseAccumulators& accumulators(std::size_t segment) const { return parts_[segment].accumulators; }

  /// First cycle from `from_cycle` on at which a position in the direction of motion is reached or passed,
  /// for a motion that never turns back; the end, or `from_cycle` if that is later, for positions beyond the
  /// end.
  std::uint64_t cycle_reaching(FixedPulses position, std::uint64_t from_cycle) const;

 private:
  struct Part {
    std::uint64_t first_cycle = 0;
    PulseAccumulators accumulators;
  };

  bool reached(std::uint64_t cycle, FixedPulses position) const;

  std::array<Part, JerkProfile::kMostSegments> parts_{};
  std::size_t segments_ = 0;
  std::uint64_t end_cycle_ = 0;
  FixedPulses start_ = 0, end_ = 0;
  bool upwards_ = true;
};

}  // namespace meltstage::motion
