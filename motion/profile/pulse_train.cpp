// SPDX-License-Identifier: Apache-2.0
#include "motion/profile/pulse_train.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "motion/profile/profile_parts.hpp"

namespace meltstage::motion {
namespace {

// Modulo 2^128, in which sums and products are exact whenever their result is in range.
__extension__ using Wide = unsigned __int128;

constexpr double kMostPulses = 0x1p31;
// A third difference that is half an LSB off puts the position n^3 / 6 as many LSBs off after n cycles.
constexpr double kMostCyclesOfJerk = 5e7;

}  // namespace

FixedPulses to_fixed(double pulses) {
  if (!(std::abs(pulses) < kMostPulses))
    throw MotionError(fmt::format("pulses: found {}, expected a number above -2^31 and below 2^31", pulses));
  return static_cast<FixedPulses>(std::ldexp(pulses, kFixedPulseBits));
}

double to_double(FixedPulses pulses) { return std::ldexp(static_cast<double>(pulses), -kFixedPulseBits); }

FixedPulses PulseAccumulators::position_after(std::uint64_t cycles) const {
  if (cycles == 0) return position;
  const Wide n = cycles;
  const Wide pairs = n * (n - 1) / 2;
  const Wide triples = n < 3 ? 0 : pairs * (n - 2) / 3;
  return static_cast<FixedPulses>(static_cast<Wide>(position) + n * static_cast<Wide>(first) +
                                  pairs * static_cast<Wide>(second) + triples * static_cast<Wide>(third));
}

PulseTrain::PulseTrain(const JerkProfile& profile, double pulses_per_mm, double start_pulses, double clock_hz)
    : upwards_(pulses_per_mm >= 0.0) {
  if (!std::isfinite(clock_hz) || clock_hz <= 0.0)
    throw MotionError(
        fmt::format("pulse train: found clock of {} Hz, expected a finite number above 0", clock_hz));
  const auto pulses_at = [&](double position_mm) {
    const double pulses = start_pulses + pulses_per_mm * position_mm;
    if (!(std::abs(pulses) < kMostPulses))
      throw MotionError(
          fmt::format("pulse train: found position of {} pulses, expected +-{}", pulses, kMostPulses));
    return to_fixed(pulses);
  };
  start_ = pulses_at(0.0);
  end_ = pulses_at(profile.end.position_mm);
  constexpr double kMostCycles = 0x1p62;
  if (!(profile.duration_s * clock_hz < kMostCycles))
    throw MotionError(fmt::format("pulse train: found {} s at {} Hz, expected less than 2^62 cycles",
                                  profile.duration_s, clock_hz));
  end_cycle_ = static_cast<std::uint64_t>(std::ceil(profile.duration_s * clock_hz));
  const double cycle_s = 1.0 / clock_hz;
  for (std::size_t i = 0; i < profile.segments; ++i) {
    const auto first_cycle = static_cast<std::uint64_t>(std::ceil(profile.start_times_s[i] * clock_hz));
    const double cycles = profile.durations_s[i] * clock_hz;
    const double parts =
        profile.starts[i].jerk_mm_s3 == 0.0 ? 1.0 : std::max(1.0, std::ceil(cycles / kMostCyclesOfJerk));
    const auto part_cycles = static_cast<std::uint64_t>(std::ceil(cycles / parts));
    for (std::uint64_t cycle = first_cycle;; cycle += part_cycles) {
      const double late_s = static_cast<double>(cycle) * cycle_s - profile.start_times_s[i];
      if (late_s >= profile.durations_s[i]) break;  // no cycle of it is left
      if (segments_ == parts_.size())
        throw MotionError(
            fmt::format("pulse train: found a jerk that lasts {:.6g} s at {} Hz, expected a motion of at "
                        "most {} parts of {:g} cycles; make it shorter",
                        profile.durations_s[i], clock_hz, parts_.size(), kMostCyclesOfJerk));
      const auto [position, velocity, acceleration, jerk] = after(profile.starts[i], std::max(0.0, late_s));
      const double speed_step = velocity * cycle_s, acceleration_step = acceleration * cycle_s * cycle_s,
                   jerk_step = jerk * cycle_s * cycle_s * cycle_s;
      parts_[segments_++] = {
          cycle,
          {pulses_at(position),
           to_fixed(pulses_per_mm * (speed_step + acceleration_step / 2.0 + jerk_step / 6.0)),
           to_fixed(pulses_per_mm * (acceleration_step + jerk_step)), to_fixed(pulses_per_mm * jerk_step)}};
    }
  }
}

FixedPulses PulseTrain::position(std::uint64_t cycle) const {
  if (cycle >= end_cycle_) return end_;
  if (segments_ == 0) return start_;
  std::size_t segment = segments_ - 1;
  while (segment > 0 && parts_[segment].first_cycle > cycle) --segment;
  return parts_[segment].accumulators.position_after(cycle - parts_[segment].first_cycle);
}

bool PulseTrain::reached(std::uint64_t cycle, FixedPulses wanted) const {
  const FixedPulses now = position(cycle);
  return upwards_ ? now >= wanted : now <= wanted;
}

std::uint64_t PulseTrain::cycle_reaching(FixedPulses wanted, std::uint64_t from_cycle) const {
  if (from_cycle >= end_cycle_ || reached(from_cycle, wanted)) return from_cycle;
  // Steps follow each other closely: look ever farther ahead, then halve.
  std::uint64_t before = from_cycle, ahead = 1;
  while (before + ahead < end_cycle_ && !reached(before + ahead, wanted)) {
    before += ahead;
    ahead *= 2;
  }
  std::uint64_t at = std::min(before + ahead, end_cycle_);
  while (at - before > 1) {
    const std::uint64_t middle = before + (at - before) / 2;
    (reached(middle, wanted) ? at : before) = middle;
  }
  return at;
}

}  // namespace meltstage::motion
